//! One immutable state of the edge: what a request holds from beginning to end.
//!
//! The airspace is rebuilt by [`Airspace::apply`]; everything else lies in maps that successive snapshots
//! share, so that publishing one costs what changed.

use crate::entries::AlarmEntry;
pub(super) use crate::entries::{ClosureEntry, PendingReview, ProposalEntry, Reported, ZoneEntry};
use crate::line::mailbox::{MailEntry, MailKey};
use crate::network::documents::NetworkDocuments;
use crate::planner::{Own, Scene, Traffic};
use crate::plans::entry::{LandedOn, PlanEntry};
use crate::replanning::Causes;
use crate::settings::Settings;
use crate::upstream::news::News;
use crate::upstream::{OutboxEntry, RegistryCursor};
use imbl::OrdMap;
use jiff::{SignedDuration, Timestamp};
use skyway_contract as wire;
use skyway_engine::airspace::Airspace;
use skyway_engine::itinerary::Occupancy;
use skyway_engine::network::Topology;
use std::sync::Arc;

/// The topology revision of the network that an edge starts with.
pub(super) const FIRST_TOPOLOGY: u64 = 1;

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
    pub(super) pending: OrdMap<Arc<str>, Causes>,
    /// The active plan of each drone.
    pub(super) flown_by: OrdMap<Arc<str>, Arc<str>>,
    /// The ended plan with which each drone has landed that still stands on its pad.
    pub(super) landed: OrdMap<Arc<str>, Arc<str>>,
    /// Who is on which segment and on which pad when, in seconds of Unix time.
    pub(super) occupancy: Occupancy,
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
    /// What each drone has yet to be told.
    pub(super) mail: OrdMap<MailKey, Arc<MailEntry>>,
    /// What the registry has yet to be told, in its order.
    pub(super) outbox: OrdMap<u64, Arc<OutboxEntry>>,
    /// What the registry has yet to be told of flights and failures.
    pub(super) news: News,
    /// The weather as it was put, here or at the registry, as text.
    pub(super) weather: Option<Arc<str>>,
    /// Whether it was put here, where no registry was followed.
    pub(super) has_own_weather: bool,
    /// How far the wall clock is ahead of the time, where it has stepped and no operator has confirmed that.
    pub(super) clock_apart: Option<SignedDuration>,
}

impl Snapshot {
    /// Nothing closed, no drone flying.
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
            occupancy: Occupancy::default(),
            reported: Reported::default(),
            alive_reports: OrdMap::new(),
            alive_by_subject: OrdMap::new(),
            active_plans: 0,
            unacknowledged: 0,
            registry: None,
            mail: OrdMap::new(),
            outbox: OrdMap::new(),
            news: News::default(),
            weather: None,
            has_own_weather: false,
            clock_apart: None,
        }
    }

    /// How many alarms of each kind were raised since the start.
    pub(super) fn alarm_counts(&self) -> impl Iterator<Item = (wire::AlarmKind, u64)> {
        wire::AlarmKind::ALL.into_iter().zip(self.alarms_raised)
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

    /// What the registry has yet to be told of flights and failures, in its order.
    pub fn news(&self) -> impl Iterator<Item = &wire::NewsEntry> {
        self.news.entries().map(|entry| &**entry)
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

    /// What all plans take of the air and of the pads.
    pub(super) fn traffic(&self) -> Traffic<'_> {
        Traffic {
            occupancy: &self.occupancy,
            landed: &self.landed,
        }
    }

    /// What is planned in at an instant.
    pub(super) fn scene(&self, now: Timestamp) -> Scene<'_> {
        self.scene_in(&self.airspace, now)
    }

    /// The same with an airspace that may be an imagined one.
    pub(super) fn scene_in<'a>(&'a self, airspace: &'a Arc<Airspace>, now: Timestamp) -> Scene<'a> {
        Scene {
            airspace,
            is_imagined: !Arc::ptr_eq(airspace, &self.airspace),
            revision: &self.revision,
            weather: self.weather.as_ref(),
            traffic: self.traffic(),
            now,
        }
    }

    /// What the drone of a plan takes itself.
    pub(super) fn own<'a>(&'a self, plan: &'a str) -> Own<'a> {
        let entry = self.plans.get(plan);
        let drone = entry.and_then(|entry| entry.drone_id.as_deref());
        self.traffic().own(Some(plan), drone)
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
