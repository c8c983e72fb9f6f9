//! Rows of plans, with their versions and contingencies as their drones were told them.

use super::codec::{Dictionary, Instant, Names, Places, read, write};
use super::file::StoreFault;
use super::flight_rows::{
    StoredFlight, StoredOrder, read_flight, read_order, store_flight, store_order,
};
use super::stretch_rows::{StoredStretch, read_stretch, store_stretch};
use crate::planner::Version;
use crate::plans::entry::{FlownFor, LandedOn, PRIORITY, PlanEntry, PlanFlags};
use serde::{Deserialize, Serialize};
use skyway_contract::{EndedAs, Flag, PlanState};
use skyway_engine::compose::{Alternate, Composition, Contingency, Leg};
use skyway_engine::flight::ServiceStop;
use skyway_engine::network::Topology;
use skyway_engine::recompose::Outcome;
use skyway_engine::routing::Path;
use std::borrow::Cow;
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};

/// Numbers of versions that may have been given to drones and not stored, at most: none is given twice.
const NUMBERS_AHEAD: u32 = 1_000;

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct StoredPlan {
    /// The nodes that it names; numbers below are places in this list.
    nodes: Vec<String>,
    subject: String,
    drone_id: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    flown_for: Option<StoredFlownFor>,
    source: u32,
    destination: u32,
    payload_kg: f64,
    airspeed_mps: f64,
    #[serde(default = "usual_priority", skip_serializing_if = "is_usual")]
    priority: u8,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    order: Option<StoredOrder>,
    state: StoredState,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    ended_as: Option<EndedAs>,
    #[serde(default, skip_serializing_if = "is_false")]
    affected: bool,
    #[serde(default, skip_serializing_if = "is_false")]
    overdue: bool,
    #[serde(default, skip_serializing_if = "is_false")]
    unacknowledged: bool,
    #[serde(default, skip_serializing_if = "is_false")]
    silent: bool,
    #[serde(default, skip_serializing_if = "is_false")]
    heard: bool,
    #[serde(default, skip_serializing_if = "is_false")]
    holds: bool,
    /// The node, the pad and since when.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    landed_on: Option<(u32, u16, Instant)>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    expires_at: Option<Instant>,
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

/// The delivery at the registry that a plan is flown for.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct StoredFlownFor {
    delivery: String,
    stops: u32,
    #[serde(default, skip_serializing_if = "is_zero")]
    served: u32,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    landed_on: Option<String>,
}

fn store_flown_for(flown_for: &FlownFor) -> StoredFlownFor {
    StoredFlownFor {
        delivery: flown_for.delivery.to_string(),
        stops: flown_for.stops,
        served: flown_for.served,
        landed_on: flown_for.landed_on.as_deref().map(str::to_owned),
    }
}

fn read_flown_for(stored: StoredFlownFor) -> FlownFor {
    FlownFor {
        delivery: Arc::from(stored.delivery),
        stops: stored.stops,
        served: stored.served,
        landed_on: stored.landed_on.map(Arc::from),
    }
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

fn is_false(flag: &bool) -> bool {
    !flag
}

fn usual_priority() -> u8 {
    PRIORITY
}

fn is_usual(priority: &u8) -> bool {
    *priority == PRIORITY
}

fn is_zero(number: &u32) -> bool {
    *number == 0
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct StoredVersion {
    number: u32,
    /// 0 where it was stored before versions had epochs.
    #[serde(default)]
    epoch: u64,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    sent_at: Option<Instant>,
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
    departs_at: Instant,
    /// Nodes at which its delivery is served, and for how many seconds.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    stops: Vec<(u32, f64)>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    recomposition_id: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    acknowledge_by: Option<Instant>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    flags: Vec<Flag>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    warnings: Vec<(String, String)>,
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
        (node, landed.pad, landed.since.into())
    });
    let mut stored = |version: &Arc<Version>| store_version(topology, version, &mut dictionary);
    let reported = stored(&plan.reported);
    let wanted = plan.wanted.as_ref().map(&mut stored);
    let sent = plan.sent.iter().map(&mut stored).collect();
    write(&StoredPlan {
        nodes: Names(topology).nodes(dictionary.nodes()),
        subject: plan.subject.to_string(),
        drone_id: plan.drone_id.as_deref().map(str::to_owned),
        flown_for: plan.flown_for.as_ref().map(store_flown_for),
        source,
        destination,
        payload_kg: plan.payload_kg,
        airspeed_mps: plan.airspeed_mps,
        priority: plan.priority,
        order: plan.order.as_ref().map(store_order),
        state: StoredState::of(plan.state),
        ended_as: plan.ended_as,
        affected: plan.flags.affected,
        overdue: plan.flags.overdue,
        unacknowledged: plan.flags.unacknowledged,
        silent: plan.flags.silent,
        heard: plan.flags.heard,
        holds: plan.holds,
        landed_on,
        expires_at: plan.expires_at.map(Into::into),
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
        sent_at: Some(version.sent_at.into()),
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
        departs_at: version.departs_at.into(),
        stops: stops
            .map(|stop| (dictionary.place(stop.node), stop.service_s))
            .collect(),
        recomposition_id: version.recomposition_id.as_deref().map(str::to_owned),
        acknowledge_by: version.acknowledge_by.map(Into::into),
        flags: version.flags.clone(),
        warnings: version
            .warnings
            .iter()
            .map(|(code, message)| (code.to_string(), message.clone()))
            .collect(),
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
        subject: Arc::from(stored.subject),
        drone_id: stored.drone_id.map(Arc::from),
        flown_for: stored.flown_for.map(read_flown_for),
        source: places.node(stored.source)?,
        destination: places.node(stored.destination)?,
        payload_kg: stored.payload_kg,
        airspeed_mps: stored.airspeed_mps,
        priority: stored.priority,
        order: stored.order.as_ref().map(read_order).transpose()?,
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
            Some((node, pad, since)) => Some(LandedOn {
                node: places.node(*node)?,
                pad: *pad,
                since: since.read()?,
            }),
            None => None,
        },
        expires_at: Instant::read_some(stored.expires_at.as_ref())?,
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
    let warnings = stored.warnings.iter().cloned();
    let stretch = stored.stretch.as_ref();
    let stretch = stretch.map(|it| read_stretch(topology, places, it));
    let sent_at = stored.sent_at.as_ref().unwrap_or(&stored.departs_at);
    let flight = flight.transpose()?.map(Arc::new);
    let stops = stored.stops.iter().map(|&(node, service_s)| {
        let node = places.node(node)?;
        Ok::<_, StoreFault>(ServiceStop { node, service_s })
    });
    Ok(Version {
        number: stored.number,
        epoch: stored.epoch,
        sent_at: sent_at.read()?,
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
        departs_at: stored.departs_at.read()?,
        stops: stops.collect::<Result<_, _>>()?,
        recomposition_id: stored.recomposition_id.as_deref().map(Arc::from),
        acknowledge_by: Instant::read_some(stored.acknowledge_by.as_ref())?,
        flags: stored.flags.clone(),
        warnings: warnings
            .map(|(code, message)| (Cow::Owned(code), message))
            .collect(),
    })
}
