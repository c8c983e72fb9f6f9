//! The first stretch, flags and the least bad way in the words of the wire.

use crate::flight::{FirstStretch, LegCourse, Reentry, StretchKind, crossing_height};
use crate::geo::Point;
use crate::identifier::node_id;
use crate::network::{NodeIx, Topology};
use crate::recompose::{Flag, Near, Recomposition, UnsafeWay};
use crate::wire;
use crate::wire_terms::IntoTerm;
use std::borrow::Cow;

/// Longitudes and latitudes are written in parts of a degree, a tenth of a millimetre each.
const STEPS_PER_DEGREE: f64 = 1e9;
/// Metres are written to the millimetre.
const STEPS_PER_M: f64 = 1e3;

/// A first stretch as it is written.
pub fn first_stretch<'a>(topology: &'a Topology, reentry: &Reentry) -> wire::FirstStretch<'a> {
    let stretch = &reentry.stretch;
    let leg = stretch.leg;
    wire::FirstStretch {
        kind: stretch.kind.into_term(),
        from: leg.map(|leg| node_id(topology, leg.from)),
        to: leg.map(|leg| node_id(topology, leg.to)),
        segment: leg
            .and_then(|leg| leg.segment)
            .map(|segment| topology.segment_id(segment)),
        fraction: leg.map(|leg| leg.fraction),
        enters: node_id(topology, reentry.node),
        length_m: stretch.length_m,
        overrun_m: (stretch.overrun_m > 0.0).then_some(stretch.overrun_m),
        geometry: line_of(topology, reentry),
    }
}

/// Where a first stretch begins, where it turns, and the node.
fn line_of(topology: &Topology, reentry: &Reentry) -> Vec<wire::Waypoint> {
    let stretch = &reentry.stretch;
    let mut line = vec![waypoint(
        topology,
        stretch.begin,
        height_of(topology, stretch, reentry.node),
    )];
    if let Some(turn) = turning_point(topology, reentry) {
        let height_m = line[0].height_m;
        line.push(waypoint(topology, turn, height_m));
    }
    if stretch.kind != StretchKind::None {
        let node = topology.position(reentry.node);
        line.push(waypoint(
            topology,
            node,
            crossing_height(topology, reentry.node),
        ));
    }
    line
}

/// Where a drone that has to fly on before it can turn does so.
fn turning_point(topology: &Topology, reentry: &Reentry) -> Option<Point> {
    let stretch = &reentry.stretch;
    let leg = stretch.leg.filter(|_| stretch.overrun_m > 0.0)?;
    let away = if reentry.node == leg.to {
        leg.from
    } else {
        leg.to
    };
    let end = topology.position(away);
    let ahead_m = stretch.begin.distance_m(end);
    let share = (stretch.overrun_m / ahead_m).min(1.0);
    (ahead_m > 0.0).then(|| stretch.begin.towards(end, share))
}

/// The height where a stretch begins: that of the leg there; off every leg, and where the network has none, that at which the node is
/// passed.
fn height_of(topology: &Topology, stretch: &FirstStretch, node: NodeIx) -> Option<f64> {
    let on_leg = stretch.leg.and_then(|leg| Some((leg, leg.segment?)));
    match on_leg {
        Some((leg, segment)) => {
            LegCourse::of(topology, leg.from, leg.to, segment).height_m(leg.fraction)
        }
        None => crossing_height(topology, node),
    }
}

/// A place with its height as it is written: on the earth to a tenth of a millimetre, heights to a millimetre.
pub fn waypoint(topology: &Topology, point: Point, height_m: Option<f64>) -> wire::Waypoint {
    let frame = topology.frame();
    let steps = match frame.is_geographic() {
        true => STEPS_PER_DEGREE,
        false => STEPS_PER_M,
    };
    let rounded = |number: f64, steps: f64| (number * steps).round() / steps;
    let [x, y] = frame.from_plane(point).map(|number| rounded(number, steps));
    wire::Waypoint {
        x,
        y,
        height_m: height_m.map(|height_m| rounded(height_m, STEPS_PER_M)),
    }
}

/// What holds of the way told, as it is written.
pub(super) fn flags(flags: &[Flag]) -> Vec<wire::Flag> {
    flags.iter().map(|&flag| flag.into_term()).collect()
}

/// The least bad way as it is written.
pub fn unsafe_way<'a>(topology: &'a Topology, way: &UnsafeWay) -> wire::UnsafeWay<'a> {
    let nodes = way.nodes.iter();
    let line = way.line.iter();
    wire::UnsafeWay {
        reason: Cow::Borrowed(way.code.reason()),
        code: Cow::Borrowed(way.code.name()),
        nodes: nodes.map(|&node| node_id(topology, node)).collect(),
        geometry: line.map(|&point| waypoint(topology, point, None)).collect(),
        length_m: way.length_m,
        battery_fraction: way.battery,
    }
}

/// A near node as it is written.
pub(super) fn near<'a>(topology: &'a Topology, near: &Near) -> wire::Near<'a> {
    wire::Near {
        node: node_id(topology, near.node),
        length_m: near.length_m,
        pads: near.pads,
        battery_fraction: near.battery,
        why_not: Cow::Borrowed(near.why_not.name()),
    }
}

/// The answer to a drone that is in the air, where it is unknown whether it is.
pub(super) fn if_airborne<'a>(
    topology: &'a Topology,
    answer: &'a Recomposition,
) -> Option<Box<wire::IfAirborne<'a>>> {
    let airborne = answer.if_airborne.as_deref()?;
    Some(Box::new(wire::IfAirborne {
        outcome: airborne.outcome.into_term(),
        path: crate::answer::path(topology, &airborne.path),
        first_stretch: airborne
            .reentry
            .as_ref()
            .map(|reentry| first_stretch(topology, reentry)),
        first_stretch_m: airborne.first_stretch_m,
        remaining_length_m: airborne.remaining_length_m,
        flags: flags(&airborne.flags),
        unsafe_way: airborne
            .unsafe_way
            .as_ref()
            .map(|way| unsafe_way(topology, way)),
    }))
}
