//! One immutable state of the edge: what a request holds from beginning to end.
//!
//! The airspace is rebuilt by [`Airspace::apply`]; everything else lies in maps that successive snapshots
//! share, so that publishing one costs what changed.

use super::alarms::AlarmEntry;
pub(super) use super::entries::{
    ClosureEntry, Contested, PendingReview, ProposalEntry, Reported, ZoneEntry,
};
use super::flights::{FlightOrder, FlownVersion, PadKey};
use super::network::NetworkDocuments;
use super::settings::Settings;
use super::stretches::Stretch;
use super::upstream::{OutboxEntry, RegistryCursor};
use crate::airspace::Airspace;
use crate::compose::{Composition, Occupation};
use crate::flight::Reservation;
use crate::formats::IntoTerm;
use crate::network::{NodeIx, SegmentIx, Topology};
use crate::wire;
use imbl::OrdMap;
use jiff::Timestamp;
use std::borrow::Cow;
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};

/// The topology revision of the network that an edge starts with.
pub(super) const FIRST_TOPOLOGY: u64 = 1;

/// One version of a plan.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Version {
    pub(super) number: u32,
    /// The epoch of the edge that made it: versions are ordered by epoch, then number.
    pub(super) epoch: u64,
    /// When its drone could first be told of it.
    pub(super) sent_at: Timestamp,
    /// `None` for a first version; what its drone was told for a recomposed one.
    pub(super) outcome: Option<crate::recompose::Outcome>,
    pub(super) composition: Composition,
    /// How it is flown, where the flight model made it; the composition is derived from that.
    pub(super) flight: Option<Arc<FlownVersion>>,
    /// How its drone comes to its first node, where it is not there.
    pub(super) stretch: Option<Stretch>,
    /// Flown before the first node, in metres.
    pub(super) first_stretch_m: f64,
    pub(super) departs_at: Timestamp,
    pub(super) recomposition_id: Option<Arc<str>>,
    /// Until when a proposed version is to be acknowledged.
    pub(super) acknowledge_by: Option<Timestamp>,
    /// What its drone was told to know of it.
    pub(super) flags: Vec<wire::Flag>,
    pub(super) warnings: Vec<(Cow<'static, str>, String)>,
}

impl Version {
    /// When it is on each of its segments, in seconds of Unix time.
    pub(super) fn occupations(&self) -> Vec<Occupation> {
        let departs_s = self.departs_s();
        let legs = self.composition.occupations(departs_s);
        let first_s = legs.first().map(|first| first.enters_s);
        let arrives_s = departs_s + self.composition.flight_time_s;
        let stretch = self.stretch.as_ref();
        let stretch = stretch.and_then(|it| it.occupation(departs_s, first_s.unwrap_or(arrives_s)));
        stretch.into_iter().chain(legs).collect()
    }

    /// The pads that it takes, in seconds of Unix time.
    pub(super) fn reservations(&self) -> Vec<Reservation> {
        let departs_s = self.departs_s();
        let flight = self.flight.iter();
        let stays = flight.flat_map(|flight| flight.reservations());
        stays
            .map(|stay| Reservation {
                from_s: departs_s + stay.from_s,
                until_s: departs_s + stay.until_s,
                ..stay
            })
            .collect()
    }

    fn departs_s(&self) -> f64 {
        self.departs_at.as_microsecond() as f64 / 1e6
    }

    /// When it ends.
    pub(super) fn arrives_at(&self) -> Timestamp {
        later(self.departs_at, self.composition.flight_time_s)
    }

    /// Where it ends.
    pub(super) fn last_node(&self) -> Option<NodeIx> {
        self.composition.way.nodes.last().copied()
    }

    /// Whether its drone was told to land where it was not to go.
    pub(super) fn is_diversion(&self) -> bool {
        self.outcome == Some(crate::recompose::Outcome::Diverted)
    }

    /// When the drone leaves the last pad on its way, in flight for the last time.
    pub(super) fn takes_off_last_at(&self) -> Timestamp {
        let flight = self.flight.as_deref();
        let stop = flight.and_then(|flight| flight.composition.plan.stops.last());
        stop.map_or(self.departs_at, |stop| {
            later(self.departs_at, stop.takes_off_s)
        })
    }
}

/// The flags of an answer, as its version has them.
pub(super) fn version_flags(flags: &[crate::recompose::Flag]) -> Vec<wire::Flag> {
    flags.iter().map(|&flag| flag.into_term()).collect()
}

/// An instant some seconds later; the end of time where that is beyond it.
pub(super) fn later(instant: Timestamp, seconds: f64) -> Timestamp {
    let span = jiff::SignedDuration::try_from_secs_f64(seconds);
    span.ok()
        .and_then(|span| instant.checked_add(span).ok())
        .unwrap_or(Timestamp::MAX)
}

/// What holds of a plan beside its state.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct PlanFlags {
    /// Something ahead of its drone has closed, or the wind leaves it short.
    pub(super) affected: bool,
    /// Nobody has heard that it has ended, some time after its arrival.
    pub(super) overdue: bool,
    /// A wanted version was not acknowledged in its time.
    pub(super) unacknowledged: bool,
}

impl PlanFlags {
    /// The same of a plan that is affected.
    pub(super) fn and_affected(self) -> Self {
        Self {
            affected: true,
            ..self
        }
    }
}

/// The pad on which a drone stands since it has landed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct LandedOn {
    pub(super) node: NodeIx,
    /// Counted from 0.
    pub(super) pad: u16,
    pub(super) since: Timestamp,
}

/// What a drone takes itself, so that it is not in its own way: its plan, and the pad on which it
/// stands since the plan before.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Own<'a> {
    plan: Option<&'a str>,
    landed: Option<&'a str>,
}

impl Own<'_> {
    /// Whether what is taken for this plan is its own.
    pub(super) fn has(self, plan: &str) -> bool {
        self.plan == Some(plan) || self.landed == Some(plan)
    }
}

/// A composition plan.
#[derive(Clone, Debug)]
pub(super) struct PlanEntry {
    pub(super) id: Arc<str>,
    /// Whose it is.
    pub(super) subject: Arc<str>,
    pub(super) drone_id: Option<Arc<str>>,
    pub(super) source: NodeIx,
    pub(super) destination: NodeIx,
    pub(super) payload_kg: f64,
    pub(super) airspeed_mps: f64,
    /// What was asked for of its flight, where the flight model was on.
    pub(super) order: Option<FlightOrder>,
    pub(super) state: wire::PlanState,
    /// What became of it, once it has ended.
    pub(super) ended_as: Option<wire::EndedAs>,
    pub(super) flags: PlanFlags,
    /// What the drone says it flies.
    pub(super) reported: Arc<Version>,
    /// What it is to fly instead, where that is another one.
    pub(super) wanted: Option<Arc<Version>>,
    /// Further versions that were sent since the reported one: the drone may have taken any of them over.
    pub(super) sent: Vec<Arc<Version>>,
    /// Whether it has ended, and its drone may still be on its ways or its last pad: they stay taken.
    pub(super) holds: bool,
    /// The pad that its drone has taken at its end, until it is known to have left.
    pub(super) landed_on: Option<LandedOn>,
    /// Until when it is a quote: a plan that no drone is named for takes nothing.
    pub(super) expires_at: Option<Timestamp>,
    /// How often its drone has declined since it last took something over.
    pub(super) declined: u32,
    /// Ids of the closures that block the reported version.
    pub(super) affected_by: Vec<String>,
    /// The number of the next version; shared by all states of the plan, as answers take numbers without the writer.
    pub(super) next_version: Arc<AtomicU32>,
}

// Two states of a plan are the same where all is that a restart needs.
impl PartialEq for PlanEntry {
    fn eq(&self, other: &Self) -> bool {
        let numbers = [self, other].map(|plan| plan.next_version.load(Ordering::Relaxed));
        (&self.id, &self.subject, &self.drone_id) == (&other.id, &other.subject, &other.drone_id)
            && (self.source, self.destination) == (other.source, other.destination)
            && (self.payload_kg, self.airspeed_mps) == (other.payload_kg, other.airspeed_mps)
            && self.order == other.order
            && (self.state, self.ended_as) == (other.state, other.ended_as)
            && (self.flags, self.holds, self.declined) == (other.flags, other.holds, other.declined)
            && (self.landed_on, self.expires_at) == (other.landed_on, other.expires_at)
            && self.sent == other.sent
            && self.reported == other.reported
            && self.wanted == other.wanted
            && self.affected_by == other.affected_by
            && numbers[0] == numbers[1]
    }
}

impl PlanEntry {
    /// Whether it is still flown, or about to be.
    pub(super) fn is_active(&self) -> bool {
        self.state != wire::PlanState::Ended
    }

    /// Whether it is only a quote: no drone flies it, and it takes nothing.
    pub(super) fn is_quote(&self) -> bool {
        self.expires_at.is_some()
    }

    /// Whether it is active and nothing ahead of its drone has closed.
    pub(super) fn is_as_planned(&self) -> bool {
        self.is_active() && !self.flags.affected
    }

    /// Every version that its drone may be flying, or may take over yet; in their order.
    pub(super) fn versions(&self) -> impl Iterator<Item = &Arc<Version>> {
        let sent = self.sent.iter();
        std::iter::once(&self.reported)
            .chain(sent)
            .chain(&self.wanted)
    }

    /// Whether its drone stands on a pad: it has not departed, or a stay covers the time.
    pub(super) fn stands_at(&self, now: Timestamp) -> bool {
        let now_s = now.as_microsecond() as f64 / 1e6;
        let stays = self.reported.reservations();
        let covers = |from_s: f64, until_s: f64| from_s <= now_s && now_s <= until_s;
        now < self.reported.departs_at || stays.iter().any(|stay| covers(stay.from_s, stay.until_s))
    }

    /// Whether its drone may simply go on flying the reported version: it leads where the plan goes, and the drone
    /// knows it. A change of the network may leave a version of which neither is true.
    pub(super) fn may_go_on(&self) -> bool {
        let current = &self.reported;
        let is_known = current.acknowledge_by.is_none();
        is_known && !self.ends_early()
    }

    /// Whether the reported version ends before the destination though nobody was told to divert.
    pub(super) fn ends_early(&self) -> bool {
        let last = self.reported.composition.way.nodes.last();
        !self.reported.is_diversion() && last != Some(&self.destination)
    }
}

/// Where a plan is on a segment: ordered by segment, then plan, version and leg.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct OccupationKey {
    pub(super) segment: u32,
    pub(super) plan: Arc<str>,
    pub(super) version: u32,
    pub(super) leg: u32,
}

impl OccupationKey {
    /// Before all that are on a segment.
    pub(super) fn first_of(segment: SegmentIx) -> Self {
        Self {
            segment: segment.0,
            plan: Arc::from(""),
            version: 0,
            leg: 0,
        }
    }
}

/// One immutable state of the edge.
#[derive(Clone, Debug)]
pub struct Snapshot {
    pub(super) epoch: u64,
    /// The epoch of the edge's first start, which entity tags of all its starts carry.
    pub(super) lineage: u64,
    /// `epoch-sequence`, as answers carry it.
    pub(super) revision: Arc<str>,
    pub(super) airspace: Arc<Airspace>,
    /// The network as clients get it.
    pub(super) network: Arc<NetworkDocuments>,
    pub(super) zones: OrdMap<Arc<str>, Arc<ZoneEntry>>,
    pub(super) closures: OrdMap<Arc<str>, Arc<ClosureEntry>>,
    pub(super) proposals: OrdMap<u64, Arc<ProposalEntry>>,
    pub(super) holds: OrdMap<u64, Arc<PendingReview>>,
    pub(super) alarms: OrdMap<u64, Arc<AlarmEntry>>,
    /// How many were raised since the start, by kind in the order of `AlarmKind::ALL`.
    pub(super) alarms_raised: [u64; wire::AlarmKind::ALL.len()],
    pub(super) plans: OrdMap<Arc<str>, Arc<PlanEntry>>,
    /// The plans that something new meets and whose drones have not been answered yet, with the closures that do. Not
    /// stored: an edge that starts looks at every plan.
    pub(super) pending: OrdMap<Arc<str>, Arc<[String]>>,
    /// The active plan of each drone.
    pub(super) flown_by: OrdMap<Arc<str>, Arc<str>>,
    /// The ended plan with which each drone has landed that still stands on its pad.
    pub(super) landed: OrdMap<Arc<str>, Arc<str>>,
    pub(super) occupations: OrdMap<OccupationKey, Occupation>,
    /// Who has which pad when, in seconds of Unix time.
    pub(super) reservations: OrdMap<PadKey, Reservation>,
    /// What closures from reports close.
    pub(super) reported: Reported,
    /// How many closures of each drone's reports are alive.
    pub(super) alive_reports: OrdMap<Arc<str>, usize>,
    /// And of the reports of each drone or fleet that has a token, by its subject.
    pub(super) alive_by_subject: OrdMap<Arc<str>, usize>,
    pub(super) active_plans: usize,
    /// How many proposed versions were not acknowledged in time.
    pub(super) unacknowledged: u64,
    /// How far the registry is followed; none before it was first read.
    pub(super) registry: Option<Arc<RegistryCursor>>,
    /// What the registry has yet to be told, in its order.
    pub(super) outbox: OrdMap<u64, Arc<OutboxEntry>>,
    /// The weather as the registry has it, as text.
    pub(super) weather: Option<Arc<str>>,
}

impl Snapshot {
    /// Nothing closed, nobody flying.
    pub(super) fn empty(
        topology: Arc<Topology>,
        network: Arc<NetworkDocuments>,
        (epoch, lineage): (u64, u64),
        now: Timestamp,
        settings: &Settings,
    ) -> Self {
        let airspace = Airspace::open(topology, FIRST_TOPOLOGY, now, settings.horizon);
        Self {
            epoch,
            lineage,
            revision: revision_text(epoch, airspace.revision()),
            airspace: Arc::new(airspace),
            network,
            zones: OrdMap::new(),
            closures: OrdMap::new(),
            proposals: OrdMap::new(),
            holds: OrdMap::new(),
            alarms: OrdMap::new(),
            alarms_raised: Default::default(),
            plans: OrdMap::new(),
            pending: OrdMap::new(),
            flown_by: OrdMap::new(),
            landed: OrdMap::new(),
            occupations: OrdMap::new(),
            reservations: OrdMap::new(),
            reported: Reported::default(),
            alive_reports: OrdMap::new(),
            alive_by_subject: OrdMap::new(),
            active_plans: 0,
            unacknowledged: 0,
            registry: None,
            outbox: OrdMap::new(),
            weather: None,
        }
    }

    /// The airspace of this state.
    pub fn airspace(&self) -> &Arc<Airspace> {
        &self.airspace
    }

    /// The network.
    pub fn topology(&self) -> &Arc<Topology> {
        self.airspace.topology()
    }

    /// What the registry has yet to be told, in its order.
    pub fn outbox(&self) -> impl Iterator<Item = &OutboxEntry> {
        self.outbox.values().map(|entry| &**entry)
    }

    /// Whether there is a network to answer on.
    pub(super) fn has_network(&self) -> bool {
        self.topology().node_count() > 0
    }

    /// The version of a thing as an entity tag, quoted.
    pub(super) fn etag(&self, version: u64) -> String {
        format!("\"{}-{version}\"", self.lineage)
    }

    /// Which quota one more closure would exceed, of a report of this drone with the token of this subject.
    pub(super) fn exceeded_quota(
        &self,
        settings: &Settings,
        (drone, subject): (&str, Option<&str>),
        more: Reported,
    ) -> Option<&'static str> {
        let alive = self.alive_reports.get(drone).copied().unwrap_or_default();
        if alive >= settings.alive_per_drone {
            return Some("drone_quota");
        }
        let of_subject = subject.and_then(|subject| self.alive_by_subject.get(subject));
        if subject.is_some()
            && of_subject.copied().unwrap_or_default() >= settings.alive_per_subject
        {
            return Some("subject_quota");
        }
        let exceeds = |closed: usize, more: usize, all: usize, least: f64| {
            let allowed = (settings.closed_fraction_max * all as f64).max(least);
            more > 0 && (closed + more) as f64 > allowed
        };
        let (topology, closed) = (self.topology(), self.reported);
        // Counted only where pads are closed, which is rare.
        let with_pads = || {
            topology
                .nodes()
                .filter(|&node| topology.pads(node) > 0)
                .count()
        };
        let too_many_segments = exceeds(
            closed.segments,
            more.segments,
            topology.segment_count(),
            0.0,
        );
        // One roof of a small network is more than its share, and still the next that a drone lands on.
        let too_many_pads = more.pads > 0 && exceeds(closed.pads, more.pads, with_pads(), 1.0);
        (too_many_segments || too_many_pads).then_some("network_quota")
    }

    /// What the drone of a plan takes itself.
    pub(super) fn own<'a>(&'a self, plan: Option<&'a str>) -> Own<'a> {
        let entry = plan.and_then(|id| self.plans.get(id));
        let drone = entry.and_then(|entry| entry.drone_id.as_deref());
        Own {
            plan,
            ..self.own_of_drone(drone)
        }
    }

    /// What a drone without a plan takes itself.
    pub(super) fn own_of_drone(&self, drone: Option<&str>) -> Own<'_> {
        let landed = drone.and_then(|drone| self.landed.get(drone));
        Own {
            plan: None,
            landed: landed.map(|plan| &**plan),
        }
    }

    /// Where a drone stands since it has landed, with the plan that it has landed with.
    pub(super) fn landed_plan(&self, drone: &str) -> Option<(&Arc<PlanEntry>, LandedOn)> {
        let plan = self.plans.get(&**self.landed.get(drone)?)?;
        Some((plan, plan.landed_on?))
    }

    /// The plan that a drone flies.
    pub(super) fn plan_of_drone(&self, drone_id: &str) -> Option<&Arc<PlanEntry>> {
        let plan = self.flown_by.get(drone_id)?;
        self.plans.get(&**plan).filter(|plan| plan.is_active())
    }
}

/// A revision as answers carry it.
pub(super) fn revision_text(epoch: u64, sequence: u64) -> Arc<str> {
    Arc::from(format!("{epoch}-{sequence}"))
}
