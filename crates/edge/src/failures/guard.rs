//! What the checker has not let pass: counted, told, and remembered for a minute.

use crate::entries::AlarmDraft;
use crate::locks::lock;
use crate::words;
use jiff::{SignedDuration, Timestamp};
use serde_json::{Value, json};
use skyway_contract::{self as wire, AlarmKind};
use skyway_engine::checked::Case;
use skyway_engine::network::Topology;
use skyway_formats::IntoTerm;
use std::borrow::Cow;
use std::collections::VecDeque;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex};

/// More cases than this within a minute make the edge degraded.
const CASES_MAX: usize = 5;
const MINUTE: SignedDuration = SignedDuration::from_mins(1);

/// How many answers did not pass, and when the last of them.
#[derive(Debug, Default)]
pub(crate) struct Guard {
    cases: AtomicU64,
    lately: Mutex<VecDeque<Timestamp>>,
}

impl Guard {
    /// How many cases there were since the start.
    pub(crate) fn cases(&self) -> u64 {
        self.cases.load(Ordering::Relaxed)
    }

    /// Notes a case; tells whether with it the edge becomes degraded.
    pub(crate) fn note(&self, now: Timestamp) -> bool {
        self.cases.fetch_add(1, Ordering::Relaxed);
        let mut lately = lock(&self.lately);
        lately.retain(|at| now.duration_since(*at) < MINUTE);
        lately.push_back(now);
        let becomes_so = lately.len() == CASES_MAX + 1;
        if lately.len() > CASES_MAX + 1 {
            lately.pop_front();
        }
        becomes_so
    }

    /// Whether there were enough cases within the last minute that nothing of this edge should be believed.
    pub(crate) fn is_degraded(&self, now: Timestamp) -> bool {
        if self.cases() <= CASES_MAX as u64 {
            return false;
        }
        let lately = lock(&self.lately);
        let recent = lately.iter().filter(|at| now.duration_since(**at) < MINUTE);
        recent.count() > CASES_MAX
    }
}

/// A case in the words of the wire.
pub(crate) fn case_view(topology: &Topology, case: &Case) -> wire::CheckerCase<'static> {
    let fault = &case.fault;
    wire::CheckerCase {
        rule: Cow::Borrowed(fault.rule.name()),
        place: Cow::Owned(fault.place_text(topology)),
        message: Cow::Owned(fault.text(topology)),
        stated: fault.stated.filter(|figure| figure.is_finite()),
        found: fault.found.filter(|figure| figure.is_finite()),
        outcome: case.outcome.into_term(),
        nodes: words::node_ids(topology, &case.nodes),
        fallback: Cow::Borrowed(case.fallback.name()),
    }
}

/// Whom a case is about: the answer, the plan and the drone, as far as there are any.
pub(crate) type Subjects<'a> = (Option<String>, Option<&'a str>, Option<&'a str>);

/// What an event tells of a case.
pub(crate) fn case_data(
    topology: &Topology,
    case: &Case,
    (recomposition, plan, drone): Subjects<'_>,
) -> Value {
    let view = case_view(topology, case);
    tracing::error!(
        rule = &*view.rule,
        message = &*view.message,
        fallback = &*view.fallback,
        recomposition,
        plan,
        "the checker did not let an answer pass"
    );
    json!({
        "case": view,
        "recomposition_id": recomposition,
        "plan_id": plan,
        "drone_id": drone,
    })
}

/// What operators are told of a case; of too many in a minute, that the edge is degraded.
pub(crate) fn alarms_of(
    topology: &Topology,
    case: &Case,
    (recomposition, plan, drone): Subjects<'_>,
    becomes_degraded: bool,
) -> impl Iterator<Item = AlarmDraft> {
    let fault = case.fault.text(topology);
    let instead = case.fallback.name();
    let message = format!("an answer did not pass and was not sent ({instead} instead): {fault}");
    let told = AlarmDraft {
        plan: plan.map(Arc::from),
        drone: drone.map(Arc::from),
        recomposition: recomposition.map(Arc::from),
        ..AlarmDraft::new(AlarmKind::Checker, message)
    };
    let message = format!("more than {CASES_MAX} answers did not pass within a minute");
    let degraded = AlarmDraft::new(AlarmKind::Degraded, message);
    std::iter::once(told).chain(becomes_degraded.then_some(degraded))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn more_than_five_cases_in_a_minute_degrade_for_as_long() {
        let guard = Guard::default();
        let at = |second: i64| Timestamp::from_second(second).expect("an instant");
        for second in 0..5 {
            assert!(!guard.note(at(second)));
        }
        assert!(!guard.is_degraded(at(5)));
        assert!(guard.note(at(10)));
        assert!(!guard.note(at(11)) && guard.is_degraded(at(12)));
        assert!(!guard.is_degraded(at(75)));
        assert_eq!(guard.cases(), 7);
    }
}
