//! Drones that fall silent in flight. One that never told where it is on a plan is not silent: it sends no telemetry.

use super::State;
use super::timers::Due;
use crate::line::mailbox::Content;
use crate::plans::entry::PlanEntry;
use jiff::{SignedDuration, Timestamp};
use skyway_contract::{AlarmKind, EventKind, PlanState};
use std::sync::Arc;

impl State {
    /// Looks again once the drone of a plan, if nothing more is heard of it, has been silent for too long; where nothing was
    /// heard of it yet, after as long again.
    pub(super) fn listen_for(&mut self, plan: &PlanEntry) {
        let from = self.last_sign_of(plan).unwrap_or(self.now);
        self.listen_from(plan, from);
    }

    /// Looks again once a drone of which nothing is heard after an instant has been silent for too long. The instant is when
    /// something happened, not when the writer came to it: drones are seen meanwhile.
    pub(super) fn listen_from(&mut self, plan: &PlanEntry, from: Timestamp) {
        let at = from.checked_add(self.settings.silent_after);
        let at = at.unwrap_or(Timestamp::MAX);
        // Whole seconds, so that many plans are looked at together.
        let second = at.as_second() + i64::from(at.subsec_nanosecond() > 0);
        let at = Timestamp::from_second(second).unwrap_or(Timestamp::MAX);
        self.timers.set(at, Due::Sign(plan.id.clone()));
    }

    /// Looks again after all drones in flight from now on: by a clock that was set back, it would be much later.
    pub(super) fn listen_anew(&mut self, now: Timestamp) {
        let plans: Vec<_> = self
            .next
            .plans
            .values()
            .filter(|plan| is_flown(plan))
            .cloned()
            .collect();
        for plan in plans {
            self.listen_from(&plan, now);
        }
    }

    /// When the drone of a plan was last heard of on it, in flight.
    fn last_sign_of(&self, plan: &PlanEntry) -> Option<Timestamp> {
        let sighting = self.drones.last(plan.drone_id.as_deref()?)?;
        // One that gives its place with an answer is not held against the plan, and keeps how far telemetry saw it come.
        let flown = sighting.flown.as_ref().filter(|it| it.plan == plan.id);
        let has_told = flown.is_some() && sighting.seen_at >= plan.reported.departs_at;
        (sighting.is_on(&plan.id) || has_told).then_some(sighting.seen_at)
    }

    /// The drone of a plan should have been heard of by now.
    pub(super) fn miss_sign(&mut self, id: &Arc<str>, now: Timestamp) {
        let plan = self.next.plans.get(id).cloned();
        let Some(plan) = plan.filter(|plan| is_flown(plan) && !plan.flags.silent) else {
            return;
        };
        let heard_at = self.last_sign_of(&plan);
        // What drones told is not stored: of one that was heard of before a restart nothing has come since.
        let before = || now.checked_sub(self.settings.silent_after).ok();
        let is_silent =
            |heard_at: &Timestamp| now.duration_since(*heard_at) >= self.settings.silent_after;
        let silent_since = heard_at.or_else(|| before().filter(|_| plan.flags.heard));
        let Some(heard_at) = silent_since.filter(is_silent) else {
            let plan = match heard_at.is_some() {
                true => self.note_heard(plan),
                false => plan,
            };
            self.listen_for(&plan);
            return;
        };
        let plan = self.keep_plan(plan.with(|plan| {
            plan.state = PlanState::Contingent;
            plan.flags.silent = true;
            plan.flags.heard = true;
        }));
        self.tell(EventKind::PlanContingent, &plan);
        self.post(&plan, &[], Content::WhereAreYou);
        let message = format!(
            "nothing was heard of the drone of plan '{id}' for {} s: it may fly its contingencies; call it",
            silence_s(now, heard_at)
        );
        self.raise_plan_alarm(AlarmKind::Contingent, &plan, message);
    }

    /// Remembers over a restart that the drone of a plan tells where it is.
    fn note_heard(&mut self, plan: Arc<PlanEntry>) -> Arc<PlanEntry> {
        if plan.flags.heard {
            return plan;
        }
        self.keep_plan(plan.with(|plan| plan.flags.heard = true))
    }

    /// A drone that was silent is heard of again.
    pub(super) fn hear_of_again(&mut self, plan: &Arc<PlanEntry>) -> Arc<PlanEntry> {
        if !plan.flags.silent {
            return plan.clone();
        }
        let has_no_way = plan.flags.affected
            && plan.wanted.is_none()
            && !self.next.pending.contains_key(&plan.id);
        let plan = self.keep_plan(plan.with(|plan| {
            plan.state = match has_no_way {
                true => PlanState::Contingent,
                false => PlanState::Activated,
            };
            plan.flags.silent = false;
        }));
        self.attend_again(&plan);
        self.tell(EventKind::PlanConforming, &plan);
        plan
    }

    /// The drone of a plan need not be called or asked any more; if nothing more comes of it, it is silent again.
    pub(super) fn attend_again(&mut self, plan: &PlanEntry) {
        self.end_plan_alarms(&plan.id, &[AlarmKind::Contingent]);
        self.drop_questions(plan);
        self.listen_from(plan, self.now);
    }
}

fn is_flown(plan: &PlanEntry) -> bool {
    plan.is_active() && plan.state != PlanState::Accepted
}

fn silence_s(now: Timestamp, heard_at: Timestamp) -> i64 {
    let silence: SignedDuration = now.duration_since(heard_at);
    silence.as_secs()
}
