//! What the drones of plans are to be told is shown to the checker before it becomes a version.

use super::State;
use crate::failures::guard::{alarms_of, case_data};
use crate::plans::fleet::Detour;
use crate::plans::ways::PlanWays;
use jiff::Timestamp;
use skyway_contract::EventKind;
use skyway_engine::airspace::Airspace;
use skyway_engine::checked::{self, Known};
use std::sync::Arc;

impl State {
    /// A detour that may be told: this one, or the first of those in its place that passes.
    pub(super) fn checked(
        &mut self,
        mut detour: Detour,
        airspace: &Arc<Airspace>,
        now: Timestamp,
    ) -> Detour {
        let (plan, request) = (&detour.plan, &detour.request);
        let scene = self.next.scene_in(airspace, detour.at);
        let known = Known::default();
        let checked = self.planner.check(scene, request, &known, &detour.answer);
        let Err(fault) = checked else {
            return detour;
        };
        let ways = PlanWays::of_plan(plan, request.report.leg).unwrap_or_default();
        let (alternatives, refused) = (ways.alternatives(), (*detour.answer, fault));
        let (answer, case) = self
            .planner
            .fall_back(scene, request, &known, alternatives, refused);
        detour.answer = Box::new(answer);
        self.tell_case(&detour, &case, now);
        detour
    }

    /// Tells of a version that did not pass.
    fn tell_case(&mut self, detour: &Detour, case: &checked::Case, now: Timestamp) {
        let becomes_degraded = self.guard.note(now);
        let plan = &detour.plan;
        let subjects = (None, Some(&*plan.id), plan.drone_id.as_deref());
        let topology = self.next.topology().clone();
        let data = case_data(&topology, case, subjects.clone());
        self.happen(EventKind::CheckerCase, data);
        for alarm in alarms_of(&topology, case, subjects, becomes_degraded) {
            self.raise_alarm(alarm, now);
        }
    }
}
