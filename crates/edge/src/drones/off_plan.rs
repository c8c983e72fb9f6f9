//! Telemetry that shows a drone elsewhere, early, late or with less battery than planned: a `service_level` failure by
//! itself.

use super::progress;
use crate::Edge;
use crate::failures::ReplyMode;
use crate::failures::records::AnswerRecord;
use crate::planner::Concern;
use crate::plans::entry::PlanEntry;
use crate::snapshot::Snapshot;
use jiff::{SignedDuration, Timestamp};
use skyway_contract as wire;
use skyway_formats::ParsedReport;
use skyway_service::access::Caller;
use std::sync::Arc;

/// So often the drone of a plan is answered at most that is early, late or short of battery.
const OFF_ITS_TIMES: SignedDuration = SignedDuration::from_mins(1);
/// And one that is elsewhere: from where it is then.
const WHERE_IT_IS: SignedDuration = SignedDuration::from_secs(10);

impl Edge {
    /// The report of a drone that was seen off its plan: at most once a minute where it is early, late or short of battery,
    /// every ten seconds where it is elsewhere; `None` where it is on it.
    pub(crate) fn off_plan_report(
        &self,
        snapshot: &Snapshot,
        plan: &Arc<PlanEntry>,
        entry: &wire::TelemetryEntry,
        now: Timestamp,
    ) -> Option<ParsedReport> {
        let version = &plan.reported;
        let sighting = self.drones.last(&entry.drone_id)?;
        let is_elsewhere = sighting.is_elsewhere();
        let is_waiting = !plan.is_as_planned() || plan.wanted.is_some();
        let minds = || self.planner.minds(Concern::Telemetry, Some(version));
        if !is_elsewhere && (is_waiting || !minds()) {
            return None;
        }
        let topology = snapshot.topology();
        let progress = progress::progress(topology, plan, &self.drones, now)?;
        let apart = match is_elsewhere {
            true => WHERE_IT_IS,
            false => OFF_ITS_TIMES,
        };
        // On its first stretch it is on no leg, whose times it could miss.
        let is_off =
            || !progress.on_stretch && self.planner.is_off(topology, version, &progress, &sighting);
        if !is_elsewhere && !is_off() {
            return None;
        }
        if !self.off_plan.begins(&plan.id, now, apart) {
            return None;
        }
        let leg = u32::try_from(progress.leg).ok();
        let leg = leg.filter(|_| !progress.on_stretch);
        let report = wire::FailureReport {
            failure: Some(wire::FailureType::ServiceLevel),
            service: Some(wire::Service {
                plan_id: Some(plan.id.to_string()),
                leg,
                ..wire::Service::default()
            }),
            location: Some(entry.location.clone()),
            airborne: sighting.airborne,
            timestamp: Some(sighting.seen_at.to_string()),
            drone: Some(wire::DroneFacts {
                id: Some(entry.drone_id.clone()),
                battery_fraction: sighting.battery_here(),
                ..wire::DroneFacts::default()
            }),
            ..wire::FailureReport::default()
        };
        Some(ParsedReport {
            report,
            warnings: Vec::new(),
        })
    }

    /// Answers such a report, which takes a search.
    pub(crate) fn answer_off_plan(
        &self,
        caller: &Caller,
        report: ParsedReport,
    ) -> Option<Arc<AnswerRecord>> {
        let answered = self.answer_in_place(caller, report, ReplyMode::First);
        answered.ok()?.record().cloned()
    }
}
