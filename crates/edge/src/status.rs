//! What the edge says of itself to its keepers.

use crate::Edge;
use crate::snapshot::Snapshot;
use crate::store::StoreStatus;
use crate::sync::SyncStatus;
use crate::words::NO_AIRFRAME;
use serde::Serialize;
use skyway_contract as wire;

/// How the edge stands: counts and bounds, no ids and no places.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Status {
    /// Version of the program.
    pub version: &'static str,
    /// Its nodes.
    pub nodes: usize,
    /// Its segments.
    pub segments: usize,
    /// Zones, whether they count now or not.
    pub zones: usize,
    /// Closures that no zone causes.
    pub closures: usize,
    /// Segments that are blocked now.
    pub blocked_segments: usize,
    /// Plans that are not over.
    pub active_plans: usize,
    /// Plans that have something closed ahead.
    pub affected_plans: usize,
    /// Plans whose drones are elsewhere, higher, lower, earlier or later than they were told.
    pub nonconforming_plans: usize,
    /// Plans whose drones are silent, or have no way that they could be told.
    pub contingent_plans: usize,
    /// Proposed versions that were not acknowledged in time, ever.
    pub plans_unacknowledged: u64,
    /// Proposals that wait for an operator.
    pub proposals: usize,
    /// Removals that wait for an operator.
    pub holds: usize,
    /// Alarms that no operator has acknowledged and whose cause has not ended.
    pub alarms: usize,
    /// Alarms raised since the start, by kind.
    pub alarms_raised: Vec<(wire::AlarmKind, u64)>,
    /// Drones seen.
    pub drones: usize,
    /// Drones that are on a session now.
    pub drones_on_sessions: usize,
    /// Messages that drones have not received, and versions that they have not answered.
    pub mail: usize,
    /// Answers kept, and about how many bytes they and their worlds take.
    pub records: usize,
    /// See `records`.
    pub record_bytes: usize,
    /// Destinations with a table.
    pub tables: usize,
    /// Bytes they take.
    pub table_bytes: usize,
    /// Requests that found their destination's table.
    pub table_hits: u64,
    /// Requests that did not, and were answered by A*.
    pub table_misses: u64,
    /// What drones fly that name no airframe; `none` where plans are by distance.
    pub airframe: String,
    /// What says so: the `setting`, the `default`, or the `store`, which was written before there was a default.
    pub airframe_by: &'static str,
    /// The id of this edge: random, made once, and kept with what it knows.
    pub edge_id: String,
    /// What of all this survives a restart.
    pub store: StoreStatus,
    /// How many answers the checker has not let pass.
    pub checker_cases: u64,
    /// How often the wall clock has stepped.
    pub clock_steps: u64,
    /// How far it is ahead of the time, in seconds, while its last step is unconfirmed; null where it has not stepped.
    pub clock_apart_s: Option<f64>,
    /// How following the registry stands; null without one.
    pub registry: Option<SyncStatus>,
    /// The world as answers carry it.
    #[serde(flatten)]
    pub stamp: wire::Stamp<'static>,
}

impl Edge {
    /// How the edge stands.
    pub fn status(&self) -> Status {
        let snapshot = self.snapshot();
        let topology = snapshot.topology();
        let (records, record_bytes) = self.records.figures();
        let tables = self.tables.trees().figures();
        let plans = || snapshot.plans.values();
        let in_state = |state| plans().filter(|plan| plan.state == state).count();
        let clock = self.clock.reading();
        let flight = self.settings.flight.as_ref();
        Status {
            version: env!("CARGO_PKG_VERSION"),
            nodes: topology.node_count(),
            segments: topology.segment_count(),
            zones: snapshot.zones.len(),
            closures: snapshot.closures.len(),
            blocked_segments: snapshot.airspace.closed().blocked_segment_count(),
            active_plans: snapshot.active_plans,
            nonconforming_plans: in_state(wire::PlanState::Nonconforming),
            contingent_plans: in_state(wire::PlanState::Contingent),
            affected_plans: plans()
                .filter(|plan| plan.is_active() && snapshot.is_affected(plan))
                .count(),
            plans_unacknowledged: snapshot.unacknowledged,
            proposals: snapshot.proposals.len(),
            holds: snapshot.holds.len(),
            alarms: snapshot
                .alarms
                .values()
                .filter(|alarm| alarm.ended_at.is_none() && alarm.acknowledged.is_none())
                .count(),
            alarms_raised: snapshot.alarm_counts().collect(),
            drones: self.drones.count(),
            drones_on_sessions: self.claims.count(),
            mail: snapshot.mail.len(),
            records,
            record_bytes,
            tables: tables.destinations,
            table_bytes: tables.bytes,
            table_hits: tables.hits,
            table_misses: tables.misses,
            airframe: flight.map_or_else(
                || NO_AIRFRAME.to_owned(),
                |flight| flight.airframe.name.clone(),
            ),
            airframe_by: match (self.settings.names_airframe, flight) {
                (true, _) => "setting",
                (false, Some(_)) => "default",
                (false, None) => "store",
            },
            edge_id: self.id.clone(),
            store: self.store.status(),
            checker_cases: self.guard.cases(),
            clock_steps: clock.steps,
            clock_apart_s: clock.apart.map(|apart| apart.as_secs_f64()),
            registry: self
                .settings
                .follows_registry
                .then(|| self.sync_status(&snapshot)),
            stamp: self.stamp_of(&snapshot),
        }
    }

    fn sync_status(&self, snapshot: &Snapshot) -> SyncStatus {
        let oldest = snapshot.outbox.get_min();
        let waited = oldest.map(|(_, entry)| self.clock.now().duration_since(entry.made_at));
        let cursor = snapshot.registry.as_ref();
        let (positions, positions_left_out) = self.positions.figures();
        let counted = self.contact.status();
        SyncStatus {
            registry_id: cursor.map(|cursor| cursor.registry_id.to_string()),
            outbox: snapshot.outbox.len(),
            outbox_age_s: waited.map_or(0.0, |waited| waited.as_secs_f64().max(0.0)),
            news: snapshot.news.len(),
            news_lost: snapshot.news.dropped() + counted.news_lost,
            positions,
            positions_left_out,
            ..counted
        }
    }
}
