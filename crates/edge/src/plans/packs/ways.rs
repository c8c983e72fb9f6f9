//! The contingencies of a version as ways that a pack can say: with what is flown after them, where they land before, and whether
//! something has closed on them since they were worked out.

use crate::planner::{DetourEnd, FlownVersion, Version, later};
use crate::snapshot::Snapshot;
use jiff::Timestamp;
use skyway_engine::airspace::{Airspace, Closure};
use skyway_engine::flight::{LegCourse, StopKind, crossing_height};
use skyway_engine::geo::{AltitudeReference, total_m};
use skyway_engine::network::{NodeIx, SegmentIx, Topology};
use skyway_engine::recompose::Outcome;
use skyway_pack::write::{Contingency, DraftHop, DraftWay};
use skyway_pack::{Node, State, Stop};
use std::sync::Arc;

/// By so much, in seconds, and this part of the flight, windows are taken to be wider, as the times of a contingency are those of
/// the plan and drones are late.
const WINDOW_MARGIN_S: f64 = 600.0;
const WINDOW_MARGIN_GROWTH: f64 = 0.1;
/// So far, in metres, the length of a detour may be from what its parts add up to.
const LENGTH_TOLERANCE_M: f64 = 1.0;
/// Units of a pack in a degree, a metre, a height of a metre, a dip of a metre, and a whole battery.
const PER_DEGREE: f64 = 1e7;
const PER_METRE: f64 = 100.0;
const HEIGHT_PER_METRE: f64 = 10.0;
const DIP_PER_METRE: f64 = 2.0;
const BATTERY: f64 = 10_000.0;

/// What is closed, or will be while a version is flown.
pub(crate) struct Closing<'a> {
    airspace: &'a Airspace,
    /// Those that do not count yet.
    announced: Vec<&'a Arc<Closure>>,
}

impl<'a> Closing<'a> {
    pub(crate) fn of(snapshot: &'a Snapshot, version: &Version) -> Self {
        let airspace = &snapshot.airspace;
        let closures = airspace.closures();
        let to_come =
            closures.filter(|(closure, in_force)| !in_force && !closure.windows.is_empty());
        let departs_at = version.departs_at;
        let ended = |closure: &&Arc<Closure>| {
            let mut ends = closure
                .windows
                .iter()
                .map(skyway_engine::airspace::Window::until);
            ends.all(|end| end.is_some_and(|end| end < departs_at.min(airspace.as_of())))
        };
        Self {
            airspace,
            announced: to_come
                .map(|(closure, _)| closure)
                .filter(|closure| !ended(closure))
                .collect(),
        }
    }

    /// Whether any of these segments, or the pads of any of these nodes, is closed or may be between two instants.
    fn meets(
        &self,
        segments: &[SegmentIx],
        pads: &[NodeIx],
        (from, until): (Timestamp, Timestamp),
    ) -> bool {
        let closed = self.airspace.closed();
        let is_closed = segments.iter().any(|&segment| closed.blocks(segment))
            || pads.iter().any(|&node| self.airspace.closes_pads(node));
        let topology = self.airspace.topology();
        let is_hit = |closure: &Closure| {
            let hits = &closure.hits;
            let hits_node = |node: &NodeIx| hits.nodes.binary_search(node).is_ok();
            segments.iter().any(|segment| {
                let ends = topology.segment(*segment);
                hits.segments.binary_search(segment).is_ok()
                    || hits_node(&ends.from)
                    || hits_node(&ends.to)
            }) || pads
                .iter()
                .any(|node| closure.pads.contains(node) || hits_node(node))
        };
        let announced = self.announced.iter();
        let mut counting = announced.filter(|closure| {
            let mut windows = closure.windows.iter();
            windows.any(|window| window.meets(from, until))
        });
        is_closed || counting.any(|closure| is_hit(closure))
    }
}

/// A version on its way into a pack.
pub(crate) struct PackedVersion<'a> {
    pub(crate) topology: &'a Topology,
    pub(crate) version: &'a Version,
    /// What has to be left in the battery where a way draws on the reserve.
    pub(crate) floor: f64,
    /// What heights are measured from.
    pub(crate) reference: Option<AltitudeReference>,
    pub(crate) closing: Closing<'a>,
}

/// A way from the first node of a leg, by its nodes, and how it is flown where that was computed.
struct Flown<'a> {
    leg: usize,
    /// To its end: where it lands.
    nodes: Vec<NodeIx>,
    /// How many of its segments the pack tells.
    hops: usize,
    rejoins: Option<usize>,
    end: Option<&'a DetourEnd>,
    /// Whether it has to find a pad at its end.
    needs_pad: bool,
}

impl<'a> PackedVersion<'a> {
    fn flight(&self) -> Option<&'a FlownVersion> {
        self.version.flight.as_deref()
    }

    /// The flight, where its battery is known.
    fn energy(&self) -> Option<&'a FlownVersion> {
        self.flight().filter(|flight| flight.is_energy_checked)
    }

    pub(crate) fn node(&self, node: NodeIx) -> Node {
        let topology = self.topology;
        let frame = topology.frame();
        let unit = match frame.is_geographic() {
            true => PER_DEGREE,
            false => PER_METRE,
        };
        let place = frame.from_plane(topology.position(node));
        let reference = topology
            .node_altitude(node)
            .map(|altitude| altitude.reference);
        let height_m = crossing_height(topology, node).filter(|_| reference == self.reference);
        Node {
            index: node.0,
            place: place.map(|coordinate| (coordinate * unit).round() as i32),
            height_dm: height_m.and_then(height_dm),
        }
    }

    /// How far below the heights of its nodes a segment is flown, in half metres; `None` where a pack cannot say it.
    pub(crate) fn dips_half_m(
        &self,
        from: NodeIx,
        to: NodeIx,
        segment: SegmentIx,
    ) -> Option<[u8; 2]> {
        let course = LegCourse::of(self.topology, from, to, segment);
        let dip = |node: NodeIx, fraction: f64| {
            let passed_m = crossing_height(self.topology, node);
            let flown_m = course.height_m(fraction);
            let dip_m = passed_m
                .zip(flown_m)
                .map_or(0.0, |(passed, flown)| passed - flown);
            let dip = (dip_m * DIP_PER_METRE).ceil().max(0.0);
            (dip < f64::from(u8::MAX)).then_some(dip as u8)
        };
        Some([dip(from, 0.0)?, dip(to, 1.0)?])
    }

    /// The battery that it takes to begin a leg; where the drone charges before it, that with which it takes off.
    pub(crate) fn battery_e4(&self, number: usize) -> Option<u16> {
        let flight = self.energy()?;
        let plan = &flight.composition.plan;
        let leg = plan.legs.get(number)?;
        let before = plan.stops.iter().find(|stop| stop.before_leg == number);
        if let Some(stop) = before.filter(|stop| stop.kind != StopKind::Start) {
            return Some(battery_e4(stop.battery_after));
        }
        let landing = plan.stops.iter().find(|stop| stop.before_leg > number);
        let left = landing.map_or(plan.battery_at_arrival, |stop| stop.battery_before);
        let reserve = self.reserve(flight.reserve_used);
        Some(battery_e4(leg.battery_before - left + reserve))
    }

    fn reserve(&self, is_reserve_used: bool) -> f64 {
        let reserve = self
            .flight()
            .map_or(0.0, |flight| flight.composition.reserve);
        match is_reserve_used {
            true => self.floor.min(reserve),
            false => reserve,
        }
    }

    /// Whether the drone lands at the first node of a leg, which is not the first of all.
    pub(crate) fn lands_before(&self, number: usize) -> bool {
        let stops = self.flight().map(|flight| &flight.composition.plan.stops);
        let mut stops = stops.into_iter().flatten();
        stops.any(|stop| stop.before_leg == number && stop.kind != StopKind::Start)
    }

    pub(crate) fn detour(&self, number: usize) -> Contingency {
        let legs = &self.version.composition.legs;
        let Some(detour) = &legs[number].if_closed else {
            return Contingency::Without(State::Pending);
        };
        if detour.outcome == Outcome::NoRoute || detour.nodes.is_empty() {
            return Contingency::Without(State::None);
        }
        // Until when it holds nobody has computed.
        if detour.outcome == Outcome::Hold && self.flight().is_none() {
            return Contingency::Without(State::LeftOut);
        }
        let way = &self.version.composition.way.nodes;
        let met = detour.rejoins.and_then(|node| {
            let place = way[number..].iter().rposition(|other| *other == node)?;
            Some(number + place)
        });
        let mut nodes = detour.nodes.clone();
        let off_plan = nodes.len() - 1;
        nodes.extend(met.and_then(|met| way.get(met + 1..)).unwrap_or_default());
        let length_m = self.length_m(&nodes);
        let stated_m = detour.remaining_length_m;
        let adds_up = length_m
            .zip(stated_m)
            .is_some_and(|(added, stated)| (added - stated).abs() <= LENGTH_TOLERANCE_M);
        if length_m.is_some() && !adds_up {
            return Contingency::Without(State::LeftOut);
        }
        let ends = self.flight().and_then(|flight| flight.ends.get(number));
        let end = ends.and_then(|ends| ends.if_closed.as_ref());
        let rejoins = met.and_then(|met| self.rejoins(end, off_plan, met));
        let hops = match (met, rejoins) {
            (Some(met), Some(rejoins)) => off_plan + (rejoins - met),
            _ => nodes.len() - 1,
        };
        self.way(&Flown {
            leg: number,
            nodes,
            hops,
            rejoins,
            end,
            needs_pad: detour.outcome == Outcome::Diverted,
        })
    }

    /// The first leg from which on a detour that meets the plan at a leg is flown as the plan, landings included; `None` where that is its end.
    fn rejoins(&self, end: Option<&DetourEnd>, off_plan: usize, met: usize) -> Option<usize> {
        let count = self.version.composition.legs.len();
        let stops = end.and_then(|end| end.stops.as_deref()).unwrap_or_default();
        let lands = |leg: usize| {
            let mut stops = stops.iter();
            stops.any(|stop| stop.before_leg == off_plan + (leg - met))
        };
        let differing = (met..count)
            .rev()
            .find(|&leg| lands(leg) != self.lands_before(leg));
        let rejoins = differing.map_or(met, |leg| leg + 1);
        (rejoins < count).then_some(rejoins)
    }

    pub(crate) fn alternate(&self, number: usize) -> Contingency {
        let leg = &self.version.composition.legs[number];
        let Some(alternate) = &leg.safe else {
            return Contingency::Without(match leg.if_closed {
                None => State::Pending,
                Some(_) => State::None,
            });
        };
        let ends = self.flight().and_then(|flight| flight.ends.get(number));
        self.way(&Flown {
            leg: number,
            nodes: alternate.nodes.clone(),
            hops: alternate.nodes.len() - 1,
            rejoins: None,
            end: ends.and_then(|ends| ends.safe.as_ref()),
            needs_pad: true,
        })
    }

    fn segments(&self, nodes: &[NodeIx]) -> Option<Vec<SegmentIx>> {
        let between = |ends: &[NodeIx]| self.topology.segment_between(ends[0], ends[1]);
        nodes.windows(2).map(between).collect()
    }

    fn length_m(&self, nodes: &[NodeIx]) -> Option<f64> {
        let segments = self.segments(nodes)?;
        let lengths = segments
            .iter()
            .map(|&it| self.topology.segment(it).length_m);
        Some(total_m(lengths))
    }

    fn way(&self, flown: &Flown<'_>) -> Contingency {
        let Some(segments) = self.segments(&flown.nodes) else {
            return Contingency::Without(State::Void);
        };
        let stops = flown.end.and_then(|end| end.stops.as_deref());
        // A store of before has kept no stops.
        if self.flight().is_some() && stops.is_none() {
            return Contingency::Without(State::LeftOut);
        }
        let stops = stops.unwrap_or_default();
        let landings = stops
            .iter()
            .filter_map(|stop| flown.nodes.get(stop.before_leg));
        let last = flown.nodes.last().filter(|_| flown.needs_pad);
        let pads: Vec<NodeIx> = landings.chain(last).copied().collect();
        if self.closing.meets(&segments, &pads, self.span(flown)) {
            return Contingency::Without(State::Void);
        }
        let stop_before = |leg: usize| {
            let stop = stops.iter().find(|stop| stop.before_leg == leg)?;
            Some(Stop {
                battery_e4: battery_e4(stop.battery[1]),
                not_before_ds: Some((stop.takes_off_s * 10.0).max(0.0) as u32),
            })
        };
        let mut hops = Vec::with_capacity(flown.hops);
        for (number, (ends, &segment)) in flown.nodes.windows(2).zip(&segments).enumerate() {
            if number == flown.hops {
                break;
            }
            let Some(dips_half_m) = self.dips_half_m(ends[0], ends[1], segment) else {
                return Contingency::Without(State::LeftOut);
            };
            // Where it meets the plan, the plan says whether it lands.
            let stop = stop_before(number + 1).filter(|_| number + 1 < flown.hops);
            hops.push(DraftHop {
                to: self.node(ends[1]),
                dips_half_m,
                stop,
            });
        }
        Contingency::Way(DraftWay {
            battery_e4: self.needed_e4(flown),
            rejoins: flown.rejoins.and_then(|leg| u16::try_from(leg).ok()),
            is_reserve_used: flown.end.is_some_and(|end| end.reserve_used),
            begins_with: stop_before(0),
            hops,
        })
    }

    /// The battery that a way takes at its first node: what it draws until it first lands, and what has to be left then.
    fn needed_e4(&self, flown: &Flown<'_>) -> Option<u16> {
        let flight = self.energy()?;
        let begins = flight.composition.plan.legs.get(flown.leg)?.battery_before;
        let end = flown.end?;
        let landing = end.stops.as_deref()?.first();
        let left = landing.map_or(end.battery, |stop| stop.battery[0]);
        Some(battery_e4(begins - left + self.reserve(end.reserve_used)))
    }

    /// When it is flown, with margins.
    fn span(&self, flown: &Flown<'_>) -> (Timestamp, Timestamp) {
        let version = self.version;
        let begins_s = version.composition.legs[flown.leg].departure_s;
        let nominal_s = version.composition.flight_time_s;
        let ends_s = flown.end.map_or(2.0 * nominal_s, |end| end.arrives_s);
        let margin_s = WINDOW_MARGIN_S + WINDOW_MARGIN_GROWTH * ends_s.max(0.0);
        let at = |seconds: f64| later(version.departs_at, seconds);
        (at(begins_s - margin_s), at(ends_s + margin_s))
    }
}

/// A height in decimetres; `None` where it is more than a pack can say.
fn height_dm(height_m: f64) -> Option<i16> {
    let height_dm = (height_m * HEIGHT_PER_METRE).round();
    (height_dm.abs() <= f64::from(i16::MAX)).then_some(height_dm as i16)
}

/// A part of a battery, rounded up.
fn battery_e4(part: f64) -> u16 {
    // Figures that were added up are a little beside a round one.
    (part * BATTERY - 1e-6).ceil().clamp(0.0, BATTERY) as u16
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_height_that_a_pack_cannot_say_is_unknown() {
        assert_eq!(height_dm(-12.34), Some(-123));
        assert_eq!(height_dm(3_276.7), Some(i16::MAX));
        assert_eq!(height_dm(3_640.0), None);
        assert_eq!(height_dm(f64::NAN), None);
    }
}
