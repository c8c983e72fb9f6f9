//! Telemetry that shows a drone early, late or with less battery than planned: a `service_level` failure by itself.

use super::Edge;
use super::failures::Manner;
use super::plan_entry::PlanEntry;
use super::planner::Concern;
use super::progress;
use super::records::AnswerRecord;
use super::snapshot::Snapshot;
use crate::access::Caller;
use crate::formats::ParsedReport;
use crate::wire;
use jiff::{SignedDuration, Timestamp};
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};

/// A plan is answered so often at most.
const APART: SignedDuration = SignedDuration::from_mins(1);
/// So many plans are remembered before those answered long ago are forgotten.
const REMEMBERED: usize = 1_000;

/// When the drone of a plan was answered last for being off it.
#[derive(Debug, Default)]
pub(super) struct OffPlan(Mutex<BTreeMap<Arc<str>, Timestamp>>);

impl OffPlan {
    /// Whether a plan may be answered now; then it counts as answered.
    fn begins(&self, plan: &Arc<str>, now: Timestamp) -> bool {
        // The map is whole after every call, so a panic elsewhere cannot spoil it.
        let mut last = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let is_recent = |at: &Timestamp| now.duration_since(*at) < APART;
        if last.get(plan).is_some_and(is_recent) {
            return false;
        }
        if last.len() >= REMEMBERED {
            last.retain(|_, at| is_recent(at));
        }
        last.insert(plan.clone(), now);
        true
    }
}

impl Edge {
    /// Answers a drone that was seen off its plan, at most once a minute; `None` where it is on it.
    pub(super) fn answer_off_plan(
        &self,
        caller: &Caller,
        snapshot: &Snapshot,
        plan: &Arc<PlanEntry>,
        entry: &wire::TelemetryEntry,
        now: Timestamp,
    ) -> Option<Arc<AnswerRecord>> {
        let is_waiting = !plan.is_as_planned() || plan.wanted.is_some();
        let version = &plan.reported;
        if is_waiting || !self.planner.minds(Concern::Telemetry, Some(version)) {
            return None;
        }
        let sighting = self.drones.last(&entry.drone_id)?;
        let topology = snapshot.topology();
        let progress = progress::progress(topology, plan, &self.drones, now)?;
        let is_off = self.planner.is_off(topology, version, &progress, &sighting);
        if !is_off || !self.off_plan.begins(&plan.id, now) {
            return None;
        }
        let leg = u32::try_from(progress.leg).ok();
        let report = wire::FailureReport {
            failure: Some(wire::FailureType::ServiceLevel),
            service: Some(wire::Service {
                plan_id: Some(plan.id.to_string()),
                leg,
                ..wire::Service::default()
            }),
            location: Some(entry.location.clone()),
            timestamp: Some(sighting.seen_at.to_string()),
            drone: Some(wire::DroneFacts {
                id: Some(entry.drone_id.clone()),
                battery_fraction: sighting.battery_fraction,
                ..wire::DroneFacts::default()
            }),
            ..wire::FailureReport::default()
        };
        let parsed = ParsedReport {
            report,
            warnings: Vec::new(),
        };
        let answered = self.answer_in_place(caller, parsed, Manner::First).ok()?;
        answered.record().cloned()
    }
}
