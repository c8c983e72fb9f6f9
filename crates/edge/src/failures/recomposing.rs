//! What a settled report is answered, and what becomes of the plan of its drone.

use super::records::PlanChange;
use super::traces;
use crate::Edge;
use crate::drones::Drones;
use crate::planner::{Answer, Asked, Course, DEFAULT_AIRSPEED_MPS, Occasion, Scene, Sent, Version};
use crate::plans::entry::PlanEntry;
use crate::plans::stretches::Stretch;
use crate::snapshot::{FIRST_TOPOLOGY, Snapshot};
use jiff::Timestamp;
use skyway_contract as wire;
use skyway_engine::airspace::Airspace;
use skyway_engine::checked;
use skyway_engine::flight::Aloft;
use skyway_engine::recompose::Request;
use skyway_formats::ReadWarning;
use skyway_planted::{self as planted, Bug};
use std::sync::Arc;
use std::sync::atomic::Ordering;

/// A report that has been settled, and what is known beside it.
#[derive(Clone, Copy)]
pub(crate) struct Case<'a> {
    pub(crate) snapshot: &'a Arc<Snapshot>,
    pub(crate) report: &'a wire::FailureReport,
    pub(crate) request: &'a Request,
    /// The plan that it is about.
    pub(crate) plan: Option<&'a Arc<PlanEntry>>,
    /// Whether the answer may change that plan.
    pub(crate) may_change: bool,
    /// The drone, where the caller may speak for it.
    pub(crate) drone_id: Option<&'a str>,
    pub(crate) now: Timestamp,
}

impl<'a> Case<'a> {
    /// What the planner is asked.
    fn asked(&self, drones: &'a Drones) -> Asked<'a> {
        Asked {
            report: self.report,
            request: self.request,
            plan: self.plan.map(|plan| &**plan),
            drone_id: self.drone_id,
            drones,
        }
    }

    /// What it is planned in.
    pub(crate) fn scene(&self) -> Scene<'a> {
        self.snapshot.scene(self.now)
    }
}

/// An answer that may be sent, and what comes with it.
pub(crate) struct Recomposed {
    pub(crate) answer: Answer,
    /// What it was computed on.
    pub(crate) snapshot: Arc<Snapshot>,
    /// The answer that it replaces, if one did not pass.
    pub(crate) refused: Option<checked::Case>,
    /// What it changes of a plan.
    pub(crate) plan: Option<PlanChange>,
    /// `None` without a path.
    pub(crate) remaining_time_s: Option<f64>,
}

impl Recomposed {
    /// The same for a record with this id.
    pub(crate) fn of_record(mut self, id: &str) -> Self {
        let proposed = self.plan.as_mut().and_then(|plan| plan.version.as_mut());
        if let Some(version) = proposed {
            version.recomposition_id = Some(Arc::from(id));
        }
        self
    }

    /// The plans and the wind that it was computed among; `None` where they made no difference.
    pub(crate) fn among(&self) -> Option<Arc<Snapshot>> {
        let depends = self.answer.depends_on_traffic();
        depends.then(|| self.snapshot.clone())
    }
}

impl Edge {
    /// Answers a report.
    pub(crate) fn recompose(&self, case: &Case<'_>, read: &mut Vec<ReadWarning>) -> Answer {
        let _span = traces::of_search().entered();
        let before = self.stale_airspace(case);
        let airspace = before.as_ref().unwrap_or(&case.snapshot.airspace);
        let scene = case.snapshot.scene_in(airspace, case.now);
        self.planner
            .recompose(scene, &case.asked(&self.drones), read)
    }

    /// What comes with an answer.
    pub(crate) fn recomposed(
        &self,
        case: &Case<'_>,
        answer: Answer,
        refused: Option<checked::Case>,
        read: &mut Vec<ReadWarning>,
    ) -> Recomposed {
        let changed = case.plan.filter(|_| case.may_change);
        let plan = changed.map(|plan| PlanChange {
            plan: plan.id.clone(),
            version: self.proposed(case, plan, &answer),
        });
        let topology = case.snapshot.topology();
        let airspeed_mps = airspeed_mps(case.report, case.plan.map(|plan| &**plan));
        // One that stands leaves when its plan begins.
        let stands = case.request.circumstances.aloft == Aloft::Grounded;
        let waiting = case.plan.filter(|_| stands);
        let proposed = plan.as_ref().and_then(|plan| plan.version.as_ref());
        let departs_at = proposed.map(|version| version.departs_at);
        let departs_at = departs_at.or(waiting.map(|plan| plan.reported.departs_at));
        let times = (case.now, departs_at.unwrap_or(case.now));
        let remaining_time_s = answer.remaining_time_s(topology, airspeed_mps, times);
        answer.warn(case.report, remaining_time_s, case.now, read);
        Recomposed {
            answer,
            snapshot: case.snapshot.clone(),
            refused,
            plan,
            remaining_time_s,
        }
    }

    /// The version that an answer proposes to a plan; `None` without a way, or where nothing changes.
    fn proposed(&self, case: &Case<'_>, plan: &PlanEntry, answer: &Answer) -> Option<Version> {
        let scene = case.scene();
        let course = self
            .planner
            .course(scene, plan, (Occasion::Report, case.request), answer)?;
        let acknowledge_within = self.settings.acknowledge_within;
        let sent = Sent {
            number: plan.next_version.fetch_add(1, Ordering::Relaxed),
            epoch: self.epoch,
            at: case.now,
            acknowledge_by: case.now.checked_add(acknowledge_within).ok(),
        };
        let stretch = Stretch::of_answer(scene.airspace, &case.request.report, answer.told());
        let course = Course { stretch, ..course };
        Some(Version::of(course, answer.told(), scene.topology(), sent))
    }

    /// The world as it was before anything closed: with a planted defect, answers are computed on it.
    fn stale_airspace(&self, case: &Case<'_>) -> Option<Arc<Airspace>> {
        planted::is(Bug::StaleAnswer).then(|| {
            let topology = case.snapshot.topology().clone();
            let horizon = self.settings.horizon;
            Arc::new(Airspace::open(topology, FIRST_TOPOLOGY, case.now, horizon))
        })
    }
}

fn airspeed_mps(report: &wire::FailureReport, plan: Option<&PlanEntry>) -> f64 {
    let stated = report.drone.as_ref().and_then(|drone| drone.airspeed_mps);
    let possible = stated.filter(|speed_mps| *speed_mps > 0.0 && *speed_mps <= 100.0);
    let planned = plan.map(|plan| plan.airspeed_mps);
    possible.or(planned).unwrap_or(DEFAULT_AIRSPEED_MPS)
}
