//! What the drones of plans are to be told is shown to the checker before it becomes a version.

use super::checking::PlanWays;
use super::events::Happening;
use super::fleet::{Detour, DetourAnswer};
use super::guard::{alarms_of, case_data};
use super::plan_entry::PlanEntry;
use super::planner::{FlownAnswer, RefusedAnswer, Scene};
use super::state::State;
use crate::airspace::Airspace;
use crate::checked::{self, Checked, Known};
use crate::planted;
use crate::wire::EventKind;
use jiff::Timestamp;
use std::sync::Arc;

impl State {
    /// A detour that may be told: this one, or the first of those in its place that passes.
    pub(super) fn checked(
        &mut self,
        mut detour: Detour,
        airspace: &Arc<Airspace>,
        now: Timestamp,
    ) -> Detour {
        if planted::is_unchecked() {
            return detour;
        }
        let (request, answer, fault) = match detour.answer {
            DetourAnswer::Flown(answer) => {
                let refused = self.refused(&detour.plan, &answer, airspace, now);
                let Some(refused) = refused else {
                    detour.answer = DetourAnswer::Flown(answer);
                    return detour;
                };
                (Box::new(refused.request), refused.answer, refused.fault)
            }
            DetourAnswer::Shortest { request, answer } => {
                let known = Known::default();
                match checked::check_answer(airspace, &request, &known, &answer, None) {
                    Err(fault) => (request, *answer, fault),
                    Ok(()) => {
                        detour.answer = DetourAnswer::Shortest { request, answer };
                        return detour;
                    }
                }
            }
        };
        let ways = PlanWays::of_plan(&detour.plan, request.report.leg).unwrap_or_default();
        let Checked { answer, case } = checked::settle(
            airspace,
            &request,
            &Known::default(),
            ways.alternatives(),
            (answer, fault),
            &mut self.scratch,
        );
        let answer = Box::new(answer);
        detour.answer = DetourAnswer::Shortest { request, answer };
        if let Some(case) = case {
            self.tell_case(&detour, &case, now);
        }
        detour
    }

    fn refused(
        &self,
        plan: &PlanEntry,
        answer: &FlownAnswer,
        airspace: &Arc<Airspace>,
        now: Timestamp,
    ) -> Option<RefusedAnswer> {
        let scene = Scene {
            snapshot: &self.next,
            airspace,
            now,
        };
        self.flights.as_ref()?.refused(scene, plan, answer)
    }

    /// Tells of a version that did not pass.
    fn tell_case(&mut self, detour: &Detour, case: &checked::Case, now: Timestamp) {
        let becomes_degraded = self.guard.note(now);
        let plan = &detour.plan;
        let subjects = (None, Some(&*plan.id), plan.drone_id.as_deref());
        let topology = self.next.topology().clone();
        let data = case_data(&topology, case, subjects.clone());
        self.events
            .push(Happening::new(EventKind::CheckerCase, data));
        for alarm in alarms_of(&topology, case, subjects, becomes_degraded) {
            self.raise_alarm(alarm, now);
        }
    }
}
