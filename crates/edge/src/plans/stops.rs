//! The stops of a delivery: which of them its drone has yet to make, and where it goes from one to the next.

use super::entry::PlanEntry;
use crate::drones::progress::Progress;
use crate::planner::{AT_NODE_M, Version};
use jiff::Timestamp;
use skyway_contract as wire;
use skyway_engine::flight::{Location, ServiceStop, Stop};
use skyway_engine::network::{NodeIx, Topology};
use skyway_service::intake::Faults;

/// A delivery has at most this many stops: each is a search of its own.
const STOPS_MAX: usize = 16;
/// The longest that a delivery is served at a stop, in seconds.
const SERVICE_MAX_S: f64 = 3_600.0;

/// Reads where a delivery begins, where it is served, and where it ends if that is stated. Faults are added.
pub(crate) fn read_places(
    topology: &Topology,
    request: &wire::DeliveryRequest,
    faults: &mut Faults,
) -> (Option<NodeIx>, Vec<ServiceStop>, Option<NodeIx>) {
    let source = faults.node("/source", topology, &request.source);
    let stated = request.destination.as_ref();
    let destination = stated.and_then(|id| faults.node("/destination", topology, id));
    let asked = request.stops.as_deref().unwrap_or_default();
    if stated.is_none() && asked.is_empty() {
        let message = "nothing says where the delivery goes".to_owned();
        let hint = "state a 'destination'; with 'stops' it may be left out".to_owned();
        faults.add("missing_field", "/destination", message, Some(hint));
    }
    let stops = read_stops(topology, asked, faults);
    check_ends((source, destination), &stops, faults);
    (source, stops, destination)
}

fn read_stops(
    topology: &Topology,
    stops: &[wire::ServiceStop<'_>],
    faults: &mut Faults,
) -> Vec<ServiceStop> {
    if stops.len() > STOPS_MAX {
        let message = format!("{} are more than {STOPS_MAX} stops", stops.len());
        faults.add("too_many", "/stops", message, None);
        return Vec::new();
    }
    let mut read = Vec::with_capacity(stops.len());
    for (place, stop) in stops.iter().enumerate() {
        let pointer = format!("/stops/{place}/node");
        let node = faults.node(&pointer, topology, &stop.node);
        let (least, most) = (0.0, SERVICE_MAX_S);
        let at = format!("/stops/{place}/service_s");
        let service_s = faults.number(&at, Some(stop.service_s), least, most);
        if let Some(node) = node.filter(|&node| topology.pads(node) == 0) {
            let message = format!("node '{}' has no pad to stop on", topology.node_id(node));
            faults.add("no_pads", &pointer, message, None);
        }
        read.extend(
            node.zip(service_s)
                .map(|(node, service_s)| ServiceStop { node, service_s }),
        );
    }
    read
}

/// A delivery leads from each of its places to another one.
fn check_ends(
    (source, destination): (Option<NodeIx>, Option<NodeIx>),
    stops: &[ServiceStop],
    faults: &mut Faults,
) {
    let nodes = source.into_iter().chain(stops.iter().map(|stop| stop.node));
    let nodes: Vec<NodeIx> = nodes.collect();
    let stays = |place: &usize| nodes[*place] == nodes[place + 1];
    if let Some(place) = (0..nodes.len().saturating_sub(1)).find(stays) {
        let message = "the delivery is at this node already".to_owned();
        let hint = "leave it out, or add its 'service_s' to the stop before".to_owned();
        faults.add(
            "same_node",
            &format!("/stops/{place}/node"),
            message,
            Some(hint),
        );
    }
    let is_end = |last: &&ServiceStop| Some(last.node) == destination;
    if stops.last().filter(is_end).is_some() {
        let message = "the last stop is the destination".to_owned();
        let hint = "leave the stop out: a delivery ends where it goes".to_owned();
        faults.add("same_node", "/destination", message, Some(hint));
    }
}

/// Where a delivery goes: to its stops, and to its end, where nothing is served. Empty without stops.
pub(crate) fn with_end(stops: &[ServiceStop], destination: NodeIx) -> Vec<ServiceStop> {
    let end = ServiceStop {
        node: destination,
        service_s: 0.0,
    };
    let is_end = |stop: &ServiceStop| stop.node == destination;
    match stops {
        [] => Vec::new(),
        // The last stop may be the end.
        [.., last] if is_end(last) => stops.to_vec(),
        _ => stops.iter().copied().chain([end]).collect(),
    }
}

/// The stops among the places of [`with_end`].
pub(crate) fn without_end(onward: &[ServiceStop]) -> Vec<ServiceStop> {
    let stops = onward.len().saturating_sub(1);
    onward[..stops].to_vec()
}

/// Where the delivery of a plan goes from where its drone is, to be served for what is left of it where it stands; empty without
/// stops ahead.
pub(crate) fn onward(
    topology: &Topology,
    plan: &PlanEntry,
    progress: Option<&Progress>,
    now: Timestamp,
) -> Vec<ServiceStop> {
    let version = &plan.reported;
    let made_or_ahead = version.flight.iter();
    let mut flown = made_or_ahead.flat_map(|flight| &flight.composition.plan.stops);
    let now_s = now.duration_since(version.departs_at).as_secs_f64();
    let mut ahead = Vec::new();
    let served = plan.served_of_reported();
    for (place, stop) in version.stops.iter().enumerate() {
        let flown = flown.find(|flown| flown.service_s.is_some());
        if place < served {
            continue;
        }
        let left_s = match (flown, progress) {
            (Some(flown), Some(progress)) if is_missed(topology, plan, flown, progress) => {
                Some(stop.service_s)
            }
            (Some(flown), Some(progress)) => left_of(topology, flown, progress, now_s),
            _ => Some(stop.service_s),
        };
        let left = left_s.map(|left_s| ServiceStop {
            service_s: left_s.min(stop.service_s),
            ..*stop
        });
        ahead.extend(left);
    }
    with_end(&ahead, plan.destination)
}

/// Whether the drone of a delivery was seen to have flown on from a stop at which it was not served.
fn is_missed(topology: &Topology, plan: &PlanEntry, stop: &Stop, progress: &Progress) -> bool {
    let Location::At(place) = progress.location else {
        return false;
    };
    let is_away = place.distance_m(topology.position(stop.node)) > AT_NODE_M;
    plan.flown_for.is_some() && is_away && stop.before_leg <= progress.leg
}

/// How long its drone has yet to be served at a stop, in seconds; `None` where it has been, or has left.
fn left_of(topology: &Topology, stop: &Stop, progress: &Progress, now_s: f64) -> Option<f64> {
    let service_s = stop.service_s.unwrap_or_default();
    if stop.before_leg > progress.leg + 1 {
        return Some(service_s);
    }
    let is_near = match progress.location {
        Location::At(place) => place.distance_m(topology.position(stop.node)) <= AT_NODE_M,
        Location::LegStart => stop.before_leg == progress.leg,
        Location::Unknown => false,
    };
    let has_come = stop.before_leg <= progress.leg;
    if !is_near || stop.before_leg < progress.leg {
        return (!has_come).then_some(service_s);
    }
    let stays = stop.lands_s <= now_s && now_s < stop.takes_off_s;
    match stays {
        true => {
            let left_s = stop.lands_s + service_s - now_s;
            (left_s > 0.0).then_some(left_s)
        }
        // Earlier than planned it has yet to be served; later than planned it has taken off, or comes only now.
        false if now_s < stop.lands_s => Some(service_s),
        false => (!has_come).then_some(service_s),
    }
}

impl Version {
    /// How many of its stops its flight makes.
    pub(crate) fn stops_flown(&self) -> usize {
        let flight = self.flight.iter();
        let stops = flight.flat_map(|flight| &flight.composition.plan.stops);
        stops.filter(|stop| stop.service_s.is_some()).count()
    }

    /// Whether it ends where its delivery is to be served, or was served last, and to go on.
    pub(crate) fn ends_at_stop(&self) -> bool {
        let flown = self.stops_flown();
        let is_there = |stop: &ServiceStop| self.last_node() == Some(stop.node);
        // The one before it, where there is one, and the one that is next.
        let at = self.stops.get(flown.saturating_sub(1)..=flown);
        at.is_some_and(|at| at.iter().any(is_there)) && !self.is_diversion()
    }
}
