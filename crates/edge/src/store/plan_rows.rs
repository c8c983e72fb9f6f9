//! Rows of plans, with their versions and contingencies as their drones were told them.

use super::codec::{Dictionary, Names, Places, read, write};
use super::file::StoreFault;
use super::flight_rows::{StoredFlight, read_flight, store_flight};
use super::stretch_rows::{StoredStretch, read_stretch, store_stretch};
use crate::planner::{FlightOrder, Version};
use crate::plans::entry::{FlownFor, LandedOn, PRIORITY, PlanEntry, PlanFlags, is_zero};
use jiff::Timestamp;
use serde::{Deserialize, Serialize};
use skyway_contract::{EndedAs, Flag, PlanState};
use skyway_engine::compose::{Alternate, Composition, Contingency, Leg};
use skyway_engine::flight::ServiceStop;
use skyway_engine::network::Topology;
use skyway_engine::recompose::Outcome;
use skyway_engine::routing::Path;
use std::borrow::Cow;
use std::ops::Not;
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};

/// Numbers of versions that may have been given to drones and not stored, at most: none is given twice.
const NUMBERS_AHEAD: u32 = 1_000;

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct StoredPlan {
    /// The nodes that it names; numbers below are places in this list.
    nodes: Vec<String>,
    subject: Arc<str>,
    drone_id: Option<Arc<str>>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    flown_for: Option<FlownFor>,
    source: u32,
    destination: u32,
    payload_kg: f64,
    airspeed_mps: f64,
    #[serde(default = "usual_priority", skip_serializing_if = "is_usual")]
    priority: u8,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    order: Option<FlightOrder>,
    state: StoredState,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    ended_as: Option<EndedAs>,
    #[serde(default, skip_serializing_if = "Not::not")]
    affected: bool,
    #[serde(default, skip_serializing_if = "Not::not")]
    overdue: bool,
    #[serde(default, skip_serializing_if = "Not::not")]
    unacknowledged: bool,
    #[serde(default, skip_serializing_if = "Not::not")]
    silent: bool,
    #[serde(default, skip_serializing_if = "Not::not")]
    heard: bool,
    #[serde(default, skip_serializing_if = "Not::not")]
    holds: bool,
    /// The node, the pad and since when.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    landed_on: Option<(u32, u16, Timestamp)>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    expires_at: Option<Timestamp>,
    #[serde(default, skip_serializing_if = "is_zero")]
    declined: u32,
    #[serde(alias = "current")]
    reported: StoredVersion,
    #[serde(default, alias = "proposed", skip_serializing_if = "Option::is_none")]
    wanted: Option<StoredVersion>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    sent: Vec<StoredVersion>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    affected_by: Vec<String>,
    next_version: u32,
}

/// How a plan stands, in the words of today and of those who wrote stores before plans ended by being told to.
#[derive(Clone, Copy, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
enum StoredState {
    Accepted,
    Activated,
    Nonconforming,
    Contingent,
    Ended,
    /// Before: flown, or about to be.
    Active,
    /// Before: something ahead had closed.
    Affected,
    /// Before: its time was over.
    Completed,
    /// Before: deleted.
    Cancelled,
}

impl StoredState {
    fn of(state: PlanState) -> Self {
        match state {
            PlanState::Accepted => Self::Accepted,
            PlanState::Activated => Self::Activated,
            PlanState::Nonconforming => Self::Nonconforming,
            PlanState::Contingent => Self::Contingent,
            PlanState::Ended => Self::Ended,
        }
    }

    /// The state, what became of the plan, and whether it was affected, as far as this says so.
    fn read(self) -> (PlanState, Option<EndedAs>, bool) {
        match self {
            Self::Accepted => (PlanState::Accepted, None, false),
            // Whether it has departed is seen by its times.
            Self::Active => (PlanState::Accepted, None, false),
            Self::Affected => (PlanState::Accepted, None, true),
            Self::Activated => (PlanState::Activated, None, false),
            Self::Nonconforming => (PlanState::Nonconforming, None, false),
            Self::Contingent => (PlanState::Contingent, None, false),
            Self::Ended => (PlanState::Ended, None, false),
            Self::Completed => (PlanState::Ended, Some(EndedAs::Delivered), false),
            Self::Cancelled => (PlanState::Ended, Some(EndedAs::Cancelled), false),
        }
    }
}

fn usual_priority() -> u8 {
    PRIORITY
}

fn is_usual(priority: &u8) -> bool {
    *priority == PRIORITY
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct StoredVersion {
    number: u32,
    /// 0 where it was stored before versions had epochs.
    #[serde(default)]
    epoch: u64,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    sent_at: Option<Timestamp>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    outcome: Option<Outcome>,
    way: Vec<u32>,
    length_m: f64,
    flight_time_s: f64,
    first_stretch_m: f64,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    stretch: Option<StoredStretch>,
    legs: Vec<StoredLeg>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    flight: Option<StoredFlight>,
    departs_at: Timestamp,
    /// Nodes at which its delivery is served, and for how many seconds.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    stops: Vec<(u32, f64)>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    recomposition_id: Option<Arc<str>>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    acknowledge_by: Option<Timestamp>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    flags: Vec<Flag>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    warnings: Vec<(Cow<'static, str>, String)>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct StoredLeg {
    length_m: f64,
    departure_s: f64,
    arrival_s: f64,
    /// What to do if it closes; absent until that has been worked out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    outcome: Option<Outcome>,
    detour: Vec<u32>,
    rejoins: Option<u32>,
    remaining_m: Option<f64>,
    extra_m: Option<f64>,
    safe: Option<(Vec<u32>, f64)>,
}

pub(super) fn write_plan(topology: &Topology, plan: &PlanEntry) -> String {
    let mut dictionary = Dictionary::default();
    let source = dictionary.place(plan.source);
    let destination = dictionary.place(plan.destination);
    let landed_on = plan.landed_on.map(|landed| {
        let node = dictionary.place(landed.node);
        (node, landed.pad, landed.since)
    });
    let mut stored = |version: &Arc<Version>| store_version(topology, version, &mut dictionary);
    let reported = stored(&plan.reported);
    let wanted = plan.wanted.as_ref().map(&mut stored);
    let sent = plan.sent.iter().map(&mut stored).collect();
    write(&StoredPlan {
        nodes: Names(topology).nodes(dictionary.nodes()),
        subject: plan.subject.clone(),
        drone_id: plan.drone_id.clone(),
        flown_for: plan.flown_for.clone(),
        source,
        destination,
        payload_kg: plan.payload_kg,
        airspeed_mps: plan.airspeed_mps,
        priority: plan.priority,
        order: plan.order.clone(),
        state: StoredState::of(plan.state),
        ended_as: plan.ended_as,
        affected: plan.flags.affected,
        overdue: plan.flags.overdue,
        unacknowledged: plan.flags.unacknowledged,
        silent: plan.flags.silent,
        heard: plan.flags.heard,
        holds: plan.holds,
        landed_on,
        expires_at: plan.expires_at,
        declined: plan.declined,
        reported,
        wanted,
        sent,
        affected_by: plan.affected_by.clone(),
        next_version: plan.next_version.load(Ordering::Relaxed),
    })
}

fn store_version(
    topology: &Topology,
    version: &Version,
    dictionary: &mut Dictionary,
) -> StoredVersion {
    let composition = &version.composition;
    let legs = composition.legs.iter();
    let stops = version.stops.iter();
    StoredVersion {
        number: version.number,
        epoch: version.epoch,
        sent_at: Some(version.sent_at),
        outcome: version.outcome,
        way: dictionary.places(&composition.way.nodes),
        length_m: composition.length_m,
        flight_time_s: composition.flight_time_s,
        first_stretch_m: version.first_stretch_m,
        stretch: version
            .stretch
            .as_ref()
            .map(|stretch| store_stretch(topology, stretch, dictionary)),
        legs: legs.map(|leg| store_leg(leg, dictionary)).collect(),
        flight: version
            .flight
            .as_deref()
            .map(|flight| store_flight(topology, flight, dictionary)),
        departs_at: version.departs_at,
        stops: stops
            .map(|stop| (dictionary.place(stop.node), stop.service_s))
            .collect(),
        recomposition_id: version.recomposition_id.clone(),
        acknowledge_by: version.acknowledge_by,
        flags: version.flags.clone(),
        warnings: version.warnings.clone(),
    }
}

fn store_leg(leg: &Leg, dictionary: &mut Dictionary) -> StoredLeg {
    let (detour, safe) = (leg.if_closed.as_ref(), leg.safe.as_ref());
    StoredLeg {
        length_m: leg.length_m,
        departure_s: leg.departure_s,
        arrival_s: leg.arrival_s,
        outcome: detour.map(|detour| detour.outcome),
        detour: detour.map_or_else(Vec::new, |detour| dictionary.places(&detour.nodes)),
        rejoins: detour.and_then(|detour| Some(dictionary.place(detour.rejoins?))),
        remaining_m: detour.and_then(|detour| detour.remaining_length_m),
        extra_m: detour.and_then(|detour| detour.extra_m),
        safe: safe.map(|safe| (dictionary.places(&safe.nodes), safe.length_m)),
    }
}

pub(super) fn read_plan(
    topology: &Topology,
    key: &str,
    body: &str,
) -> Result<PlanEntry, StoreFault> {
    let stored: StoredPlan = read("plan", key, body)?;
    let nodes = Names(topology).find_nodes(&stored.nodes)?;
    let places = Places(&nodes);
    let read_one = |version: &StoredVersion| read_version(topology, places, version).map(Arc::new);
    let (state, ended_as, was_affected) = stored.state.read();
    let next = stored.next_version.saturating_add(NUMBERS_AHEAD);
    Ok(PlanEntry {
        id: Arc::from(key),
        subject: stored.subject,
        drone_id: stored.drone_id,
        flown_for: stored.flown_for,
        source: places.node(stored.source)?,
        destination: places.node(stored.destination)?,
        payload_kg: stored.payload_kg,
        airspeed_mps: stored.airspeed_mps,
        priority: stored.priority,
        order: stored.order,
        state,
        ended_as: stored.ended_as.or(ended_as),
        flags: PlanFlags {
            affected: stored.affected || was_affected,
            overdue: stored.overdue,
            unacknowledged: stored.unacknowledged,
            silent: stored.silent,
            heard: stored.heard,
        },
        reported: read_one(&stored.reported)?,
        wanted: stored.wanted.as_ref().map(read_one).transpose()?,
        sent: stored.sent.iter().map(read_one).collect::<Result<_, _>>()?,
        holds: stored.holds,
        landed_on: match &stored.landed_on {
            &Some((node, pad, since)) => Some(LandedOn {
                node: places.node(node)?,
                pad,
                since,
            }),
            None => None,
        },
        expires_at: stored.expires_at,
        declined: stored.declined,
        affected_by: stored.affected_by,
        next_version: Arc::new(AtomicU32::new(next)),
    })
}

fn read_safe(
    places: Places<'_>,
    (nodes, length_m): &(Vec<u32>, f64),
) -> Result<Alternate, StoreFault> {
    let nodes = places.nodes(nodes)?;
    let node = nodes.last().copied();
    let node = node.ok_or_else(|| StoreFault::damaged("a plan has a way to no alternate"))?;
    Ok(Alternate {
        node,
        nodes,
        length_m: *length_m,
    })
}

fn read_detour(
    places: Places<'_>,
    leg: &StoredLeg,
    outcome: Outcome,
) -> Result<Contingency, StoreFault> {
    Ok(Contingency {
        outcome,
        nodes: places.nodes(&leg.detour)?,
        rejoins: leg.rejoins.map(|place| places.node(place)).transpose()?,
        remaining_length_m: leg.remaining_m,
        extra_m: leg.extra_m,
    })
}

fn read_version(
    topology: &Topology,
    places: Places<'_>,
    stored: &StoredVersion,
) -> Result<Version, StoreFault> {
    let broken = |what: &str| StoreFault::damaged(format!("a plan has {what}"));
    let nodes = places.nodes(&stored.way)?;
    if nodes.len() != stored.legs.len() + 1 {
        return Err(broken("another number of legs than of segments"));
    }
    let mut way = Path::default();
    let mut legs = Vec::with_capacity(stored.legs.len());
    for (ends, leg) in nodes.windows(2).zip(&stored.legs) {
        let (from, to) = (ends[0], ends[1]);
        let segment = topology.segment_between(from, to);
        let segment = segment.ok_or_else(|| broken("a leg without a segment"))?;
        way.segments.push(segment);
        let safe = leg.safe.as_ref().map(|safe| read_safe(places, safe));
        legs.push(Leg {
            from,
            to,
            segment,
            length_m: leg.length_m,
            departure_s: leg.departure_s,
            arrival_s: leg.arrival_s,
            if_closed: leg
                .outcome
                .map(|outcome| read_detour(places, leg, outcome))
                .transpose()?,
            safe: safe.transpose()?,
        });
    }
    way.nodes = nodes;
    let flight = stored.flight.as_ref();
    let flight = flight.map(|flight| read_flight(topology, places, &legs, flight));
    let stretch = stored.stretch.as_ref();
    let stretch = stretch.map(|it| read_stretch(topology, places, it));
    let flight = flight.transpose()?.map(Arc::new);
    let stops = stored.stops.iter().map(|&(node, service_s)| {
        let node = places.node(node)?;
        Ok::<_, StoreFault>(ServiceStop { node, service_s })
    });
    Ok(Version {
        number: stored.number,
        epoch: stored.epoch,
        sent_at: stored.sent_at.unwrap_or(stored.departs_at),
        outcome: stored.outcome,
        composition: Composition {
            way,
            legs,
            length_m: stored.length_m,
            flight_time_s: stored.flight_time_s,
        },
        flight,
        stretch: stretch.transpose()?,
        first_stretch_m: stored.first_stretch_m,
        departs_at: stored.departs_at,
        stops: stops.collect::<Result<_, _>>()?,
        recomposition_id: stored.recomposition_id.clone(),
        acknowledge_by: stored.acknowledge_by,
        flags: stored.flags.clone(),
        warnings: stored.warnings.clone(),
    })
}
