//! Whether a leg of a plan comes too near to legs of others: the judge flies both and looks.

use crate::flight::{FlightRules, FlownLeg, LegCourse, TrafficLeg};
use crate::geo::Point;
use crate::network::{NodeIx, Topology};

/// Times this much apart, in seconds, count as equal.
const TIME_TOLERANCE_S: f64 = 1e-5;
/// Two drones are looked at so often, in seconds.
const LOOK_S: f64 = 0.1;
/// Nearer by less than they fly between two looks, in metres, may be rounding.
const DISTANCE_TOLERANCE_M: f64 = 0.5;
/// Drones this far above each other, in metres, may be at one place.
const VERTICAL_M: f64 = 10.0;
/// Within this of a node that both come to, in metres, the time between them there counts instead.
const SHARED_NODE_M: f64 = 50.0;

/// Whether another leg is too near to one that is taken off for, or not.
pub(super) fn is_too_near(
    topology: &Topology,
    rules: &FlightRules,
    (leg, takes_off): (&FlownLeg, bool),
    other: &TrafficLeg,
) -> bool {
    let is_apart = other.leaves_s + rules.headway_s.max(rules.node_headway_s) < leg.enters_s
        || leg.leaves_s + rules.headway_s.max(rules.node_headway_s) < other.enters_s;
    if rules.headway_s <= 0.0 || is_apart {
        return false;
    }
    is_near_on_segment(rules, leg, other)
        || is_near_at_node(topology, rules, (leg, takes_off), other)
        || (other.segment != leg.segment && is_near_in_the_air(topology, rules, leg, other))
}

fn is_near_on_segment(rules: &FlightRules, leg: &FlownLeg, other: &TrafficLeg) -> bool {
    let is_near = match other.from == leg.from {
        true => (other.enters_s - leg.enters_s).abs() <= rules.headway_s,
        false => {
            leg.enters_s < other.leaves_s - TIME_TOLERANCE_S
                && other.enters_s < leg.leaves_s - TIME_TOLERANCE_S
        }
    };
    other.segment == leg.segment && is_near
}

fn is_near_at_node(
    topology: &Topology,
    rules: &FlightRules,
    (leg, takes_off): (&FlownLeg, bool),
    other: &TrafficLeg,
) -> bool {
    let passages = [
        (other.from, other.enters_s),
        (end_of(topology, other), other.leaves_s),
    ];
    passages.into_iter().any(|(node, passes_s)| {
        let is_within =
            |at_s: f64| (at_s - passes_s).abs() < rules.node_headway_s - TIME_TOLERANCE_S;
        (node == leg.to && is_within(leg.leaves_s))
            || (takes_off && node == leg.from && is_within(leg.enters_s))
    })
}

fn is_near_in_the_air(
    topology: &Topology,
    rules: &FlightRules,
    leg: &FlownLeg,
    other: &TrafficLeg,
) -> bool {
    let other_to = end_of(topology, other);
    let shared = [leg.from, leg.to].map(|node| {
        let is_shared = node == other.from || node == other_to;
        is_shared.then(|| topology.position(node))
    });
    let own = LegCourse::of(topology, leg.from, leg.to, leg.segment);
    let theirs = LegCourse::of(topology, other.from, other_to, other.segment);
    let is_near = |at_s: f64| {
        let (place, height_m) =
            place_on(&own, (at_s - leg.enters_s) / (leg.leaves_s - leg.enters_s));
        let share = (at_s - other.enters_s) / (other.leaves_s - other.enters_s);
        let (other_place, other_height_m) = place_on(&theirs, share);
        let is_at_node = shared
            .iter()
            .flatten()
            .any(|node| node.distance_m(place) <= SHARED_NODE_M);
        let above_m = match (height_m, other_height_m) {
            (Some(own_m), Some(other_m)) => (own_m - other_m).abs(),
            _ => 0.0,
        };
        !is_at_node
            && place.distance_m(other_place) < rules.crossing_m - DISTANCE_TOLERANCE_M
            && above_m < VERTICAL_M - DISTANCE_TOLERANCE_M
    };
    // One of them may be above the node before or after its leg.
    let hovers_s = (rules.node_headway_s - TIME_TOLERANCE_S).max(0.0);
    [(hovers_s, 0.0), (0.0, hovers_s)]
        .into_iter()
        .any(|(own_s, others_s)| {
            let from_s = (leg.enters_s - own_s).max(other.enters_s - others_s);
            let until_s = (leg.leaves_s + own_s).min(other.leaves_s + others_s);
            let looks = ((until_s - from_s) / LOOK_S).ceil().max(0.0) as usize;
            let at_s = |look: usize| (from_s + look as f64 * LOOK_S).min(until_s);
            from_s < until_s && (0..=looks).any(|look| is_near(at_s(look)))
        })
}

fn end_of(topology: &Topology, leg: &TrafficLeg) -> NodeIx {
    let ends = topology.segment(leg.segment);
    match ends.from == leg.from {
        true => ends.to,
        false => ends.from,
    }
}

/// Where a drone is after a share of its time, at the same speed all along.
fn place_on(course: &LegCourse, share: f64) -> (Point, Option<f64>) {
    let corners = course.corners.windows(2);
    let lengths_m: Vec<f64> = corners
        .map(|pair| {
            let up_m = pair[1].height_m.unwrap_or(0.0) - pair[0].height_m.unwrap_or(0.0);
            pair[0].place.distance_m(pair[1].place).hypot(up_m)
        })
        .collect();
    let mut left_m = share.clamp(0.0, 1.0) * lengths_m.iter().sum::<f64>();
    for (pair, &length_m) in course.corners.windows(2).zip(&lengths_m) {
        if left_m <= length_m && length_m > 0.0 {
            let part = left_m / length_m;
            let heights = pair[0].height_m.zip(pair[1].height_m);
            let height_m = heights.map(|(low_m, high_m)| low_m + (high_m - low_m) * part);
            return (pair[0].place.towards(pair[1].place, part), height_m);
        }
        left_m -= length_m;
    }
    let last = course.corners.last();
    let here = last.map(|corner| (corner.place, corner.height_m));
    here.unwrap_or((Point::new(0.0, 0.0), None))
}
