//! Every answer is shown to the checker before it is sent; what does not pass is not sent.

use super::guard::{Subjects, alarms_of, case_data};
use super::recomposing::{Case, Recomposed};
use crate::Edge;
use crate::events::Happening;
use crate::planner::Answer;
use crate::plans::ways::PlanWays;
use crate::snapshot::Snapshot;
use jiff::Timestamp;
use skyway_contract::EventKind;
use skyway_engine::checked::{self, FallenBackTo, Known};
use skyway_engine::checker::Fault;
use skyway_engine::flight::FailureType;
use skyway_formats::ReadWarning;
use std::sync::Arc;

/// So often a report is answered again because something has closed while its answer was worked out.
const AGAIN_MOST: usize = 4;

impl Edge {
    /// Answers a report, and checks the answer against the world that is current then.
    ///
    /// An answer that fails only by what has closed meanwhile is computed again, and is no case. After a change of the network
    /// it is checked against the one that it is of.
    pub(crate) fn recompose_checked(
        &self,
        case: &Case<'_>,
        read: &mut Vec<ReadWarning>,
    ) -> Recomposed {
        self.recompose_current(case, AGAIN_MOST, read)
    }

    /// Answers a report on the world of its case, and so often again on the one that has come meanwhile.
    fn recompose_current(
        &self,
        case: &Case<'_>,
        again_most: usize,
        read: &mut Vec<ReadWarning>,
    ) -> Recomposed {
        let said_before = read.len();
        let answer = self.recompose(case, read);
        let current = self.world.load_full();
        let is_same = Arc::ptr_eq(&current.airspace, &case.snapshot.airspace);
        let may_compare = Arc::ptr_eq(current.topology(), case.snapshot.topology());
        if is_same || !may_compare {
            return self.passed(case, answer, read);
        }
        let at_sending = Case {
            snapshot: &current,
            ..*case
        };
        if self.fault_of(&at_sending, &answer).is_none() {
            return self.recomposed(case, answer, None, read);
        }
        if self.fault_of(case, &answer).is_some() {
            return self.passed(case, answer, read);
        }
        if again_most == 0 {
            return self.passed(&at_sending, answer, read);
        }
        read.truncate(said_before);
        self.recompose_current(&at_sending, again_most - 1, read)
    }

    /// This answer, or what goes instead of it.
    fn passed(&self, case: &Case<'_>, answer: Answer, read: &mut Vec<ReadWarning>) -> Recomposed {
        let Some(fault) = self.fault_of(case, &answer) else {
            return self.recomposed(case, answer, None, read);
        };
        let (answer, refused) = self.fall_back(case, answer, fault);
        self.recomposed(case, answer, Some(refused), read)
    }

    /// The rule that an answer breaks, if it breaks any.
    fn fault_of(&self, case: &Case<'_>, answer: &Answer) -> Option<Fault> {
        let (scene, known) = (case.scene(), known(case));
        self.planner
            .check(scene, case.request, &known, answer)
            .err()
    }

    /// What goes instead of an answer that did not pass: the first that does.
    fn fall_back(&self, case: &Case<'_>, refused: Answer, fault: Fault) -> (Answer, checked::Case) {
        let (scene, request) = (case.scene(), case.request);
        let baseline = self.planner.recompose_plainly(scene, request, &refused);
        let passes = |answer: &Answer| self.fault_of(case, answer).is_none();
        if let Some(mut baseline) = baseline.filter(passes) {
            baseline.stands_in(request.strategy);
            let case = checked::Case {
                fault,
                outcome: refused.told().outcome,
                nodes: refused.told().path.nodes.clone(),
                fallback: FallenBackTo::Baseline,
            };
            return (baseline, case);
        }
        let plan = case.plan.map(|plan| &**plan);
        let ways = PlanWays::of(&request.report, plan);
        let (alternatives, refused) = (ways.alternatives(), (refused, fault));
        self.planner
            .fall_back(scene, request, &known(case), alternatives, refused)
    }

    /// Tells of an answer that did not pass: counted, an event, an alarm, a line in the log.
    pub(crate) fn tell_case(
        &self,
        snapshot: &Snapshot,
        case: &checked::Case,
        subjects: Subjects<'_>,
        now: Timestamp,
    ) {
        let becomes_degraded = self.guard.note(now);
        let topology = snapshot.topology();
        let data = case_data(topology, case, subjects.clone());
        let happening = Happening::new(EventKind::CheckerCase, data);
        self.events.add(vec![happening], now, &snapshot.revision);
        for alarm in alarms_of(topology, case, subjects, becomes_degraded) {
            self.raise_alarm(alarm);
        }
    }
}

/// What the report says of who sent it, beside the request.
fn known(case: &Case<'_>) -> Known {
    let facts = case.report.drone.as_ref();
    let is_fraction = |fraction: &f64| (0.0..=1.0).contains(fraction);
    let battery = facts
        .and_then(|facts| facts.battery_fraction)
        .filter(is_fraction);
    let has_payload = facts.is_some_and(|facts| facts.payload_kg.is_some());
    let is_operational = case.request.report.failure == FailureType::Operational;
    Known {
        battery,
        has_figure: is_operational && (battery.is_some() || has_payload),
        ..Known::default()
    }
}
