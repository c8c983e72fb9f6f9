//! A plan's legs with their times, lengths and contingencies.
//!
//! Every leg has two contingencies, so that a drone that loses its edge knows what to do: the detour to take
//! if that leg closes, and the nearest alternate. Both begin at the leg's start.

use super::conflict::Occupation;
use super::open_way::{prepare_missing_table, shortest_way};
use crate::flight::{FailureReport, FailureType, Location};
use crate::network::{NodeIx, SegmentIx, Topology};
use crate::recompose::{Outcome, Recomposition, Request, Scratch, World, recompose};
use crate::routing::Path;

/// A way with its legs: what is to be flown.
#[derive(Clone, Debug, PartialEq)]
pub struct Composition {
    /// The way; a single node where the drone is there already.
    pub way: Path,
    /// One leg for each segment of the way.
    pub legs: Vec<Leg>,
    /// Metres to fly in all, those before the first node included.
    pub length_m: f64,
    /// Nominal flying time in seconds, that before the first node included.
    pub flight_time_s: f64,
}

impl Composition {
    /// Whether the contingencies of any leg are still to be worked out.
    pub fn lacks_contingencies(&self) -> bool {
        self.legs.iter().any(|leg| leg.if_closed.is_none())
    }

    /// When each leg is flown if flying begins at `start_s` seconds of a clock that all plans share.
    pub fn occupations(&self, start_s: f64) -> Vec<Occupation> {
        let legs = self.legs.iter().enumerate();
        legs.map(|(number, leg)| Occupation {
            segment: leg.segment,
            from: leg.from,
            leg: number,
            enters_s: start_s + leg.departure_s,
            leaves_s: start_s + leg.arrival_s,
        })
        .collect()
    }
}

/// A leg of a plan: one segment in one direction.
#[derive(Clone, Debug, PartialEq)]
pub struct Leg {
    /// The node it starts from.
    pub from: NodeIx,
    /// The node it ends at.
    pub to: NodeIx,
    /// Its segment.
    pub segment: SegmentIx,
    /// Length in metres.
    pub length_m: f64,
    /// When it starts, in seconds from when flying begins.
    pub departure_s: f64,
    /// When it ends, in seconds from when flying begins.
    pub arrival_s: f64,
    /// What to do if it closes while the drone is at its start; `None` until that has been worked out.
    pub if_closed: Option<Contingency>,
    /// Where to go from its start when nothing else helps; `None` where no alternate can be reached.
    pub safe: Option<Alternate>,
}

/// What to do on a leg that closes.
#[derive(Clone, Debug, PartialEq)]
pub struct Contingency {
    /// What the drone would be told.
    pub outcome: Outcome,
    /// The nodes from the leg's start until the detour meets the plan again for good, or else its end; empty
    /// for [`Outcome::NoRoute`].
    pub nodes: Vec<NodeIx>,
    /// The last of the nodes, where the plan is flown on from it as it was; `None` for a detour that does not
    /// end where the plan ends.
    pub rejoins: Option<NodeIx>,
    /// From the leg's start to the end of the route so changed, in metres; `None` without a route.
    pub remaining_length_m: Option<f64>,
    /// How much longer than the plan that is, in metres; `None` where the two do not end at the same node.
    /// Below 0 where the plan is not the shortest way.
    pub extra_m: Option<f64>,
}

/// The nearest alternate: open, with pads, and reachable.
#[derive(Clone, Debug, PartialEq)]
pub struct Alternate {
    /// The node.
    pub node: NodeIx,
    /// The nodes from the leg's start to it; it alone where the leg starts there.
    pub nodes: Vec<NodeIx>,
    /// How far it is, in metres.
    pub length_m: f64,
}

/// The shortest open way from a source to a destination, with its legs; `None` when there is none.
///
/// The airspeed is in metres per second, finite and above 0. The table of the destination is put into the
/// world's cache if it is not there.
pub fn compose(
    world: &World<'_>,
    source: NodeIx,
    destination: NodeIx,
    airspeed_mps: f64,
    scratch: &mut Scratch,
) -> Option<Composition> {
    scratch.fit(world.airspace.topology());
    prepare_missing_table(world, destination, scratch.searcher());
    let way = shortest_way(world, source, destination, scratch.searcher())?;
    Some(with_contingencies(
        world,
        way,
        0.0,
        destination,
        airspeed_mps,
        scratch,
    ))
}

/// A way that exists, with its legs and their contingencies.
///
/// `first_stretch_m` metres are flown, at the airspeed, before the first node; the first leg departs after
/// them. Detours lead to `destination`, where the way need not end: a diverted one does not. The airspeed is
/// in metres per second, finite and above 0. The table of the destination is put into the world's cache if
/// it is not there.
pub fn with_contingencies(
    world: &World<'_>,
    way: Path,
    first_stretch_m: f64,
    destination: NodeIx,
    airspeed_mps: f64,
    scratch: &mut Scratch,
) -> Composition {
    let topology = world.airspace.topology();
    scratch.fit(topology);
    prepare_missing_table(world, destination, scratch.searcher());
    let way_m = way.length_m(topology);
    let (mut flown_m, mut time_s) = (0.0, first_stretch_m / airspeed_mps);
    let mut legs = Vec::with_capacity(way.segments.len());
    for (place, (ends, &segment)) in way.nodes.windows(2).zip(&way.segments).enumerate() {
        let (from, to) = (ends[0], ends[1]);
        let length_m = topology.segment(segment).length_m;
        let departure_s = time_s;
        time_s += leg_time_s(topology, segment, airspeed_mps);
        let mut answer = |failure| {
            let report = FailureReport {
                failure,
                leg: (from, to),
                location: Location::LegStart,
                cause_location: None,
                destination,
                // Neither answer below depends on the plan, so it need not be copied for every leg.
                remaining_path: None,
            };
            recompose(world, &Request::exact(report), scratch)
        };
        let detour = answer(FailureType::Navigational);
        let diversion = answer(FailureType::Operational);
        legs.push(Leg {
            from,
            to,
            segment,
            length_m,
            departure_s,
            arrival_s: time_s,
            if_closed: Some(contingency(&way, place, way_m - flown_m, detour)),
            safe: alternate(from, diversion),
        });
        flown_m += length_m;
    }
    Composition {
        length_m: first_stretch_m + way_m,
        flight_time_s: time_s,
        legs,
        way,
    }
}

/// Nominal flying time of a way in seconds, after a first stretch at the airspeed.
pub fn flight_time_s(
    topology: &Topology,
    way: &Path,
    first_stretch_m: f64,
    airspeed_mps: f64,
) -> f64 {
    let segments = way.segments.iter();
    segments.fold(first_stretch_m / airspeed_mps, |time_s, &segment| {
        time_s + leg_time_s(topology, segment, airspeed_mps)
    })
}

/// Seconds on a segment: at the airspeed, or its limit where that is slower.
pub(super) fn leg_time_s(topology: &Topology, segment: SegmentIx, airspeed_mps: f64) -> f64 {
    let limit_mps = topology.speed_limit_mps(segment).unwrap_or(f64::INFINITY);
    topology.segment(segment).length_m / airspeed_mps.min(limit_mps)
}

/// Cuts the answer for a closed leg to the part that leaves the plan, of which `rest_m` metres were left.
fn contingency(plan: &Path, leg: usize, rest_m: f64, detour: Recomposition) -> Contingency {
    let mut nodes = detour.path.nodes;
    let ends_with_plan = nodes.last().is_some() && nodes.last() == plan.nodes.last();
    let (mut rejoins, mut extra_m) = (None, None);
    if ends_with_plan {
        // Ways that end at the same node and share their last segments share the nodes between them.
        let planned = plan.segments[leg..].iter().rev();
        let backwards = planned.zip(detour.path.segments.iter().rev());
        let flown_as_planned = backwards.take_while(|(one, other)| one == other).count();
        nodes.truncate(nodes.len() - flown_as_planned);
        rejoins = nodes.last().copied();
        extra_m = detour.remaining_length_m.map(|length_m| length_m - rest_m);
    }
    Contingency {
        outcome: detour.outcome,
        nodes,
        rejoins,
        remaining_length_m: detour.remaining_length_m,
        extra_m,
    }
}

/// The end of a diversion, with the leg's start put before a path that begins at the leg's end.
fn alternate(leg_start: NodeIx, diversion: Recomposition) -> Option<Alternate> {
    let mut nodes = diversion.path.nodes;
    let node = *nodes.last()?;
    let length_m = diversion.remaining_length_m?;
    // An open leg may be flown to its end first: that stretch is in the length, but not in the path.
    if nodes.first() != Some(&leg_start) {
        nodes.insert(0, leg_start);
    }
    Some(Alternate {
        node,
        nodes,
        length_m,
    })
}
