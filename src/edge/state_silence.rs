//! Drones that fall silent in flight. One of which nothing was ever heard on a plan is not silent: it sends no telemetry.

use super::commands::Done;
use super::mailbox::Content;
use super::plan_entry::{PlanEntry, PlanFlags};
use super::state::State;
use super::timers::Due;
use crate::wire::{AlarmKind, EventKind, PlanState};
use jiff::{SignedDuration, Timestamp};
use std::sync::Arc;

impl State {
    /// Looks again, once so much time has passed, whether the drone of a plan is still heard of.
    pub(super) fn listen_for(&mut self, plan: &Arc<str>) {
        let at = self.now.checked_add(self.settings.silent_after);
        self.listen_at(plan, at.unwrap_or(Timestamp::MAX));
    }

    fn listen_at(&mut self, plan: &Arc<str>, at: Timestamp) {
        // Whole seconds, so that many plans are looked at together.
        let second = at.as_second() + i64::from(at.subsec_nanosecond() > 0);
        let at = Timestamp::from_second(second).unwrap_or(Timestamp::MAX);
        self.timers.set(at, Due::Sign(plan.clone()));
    }

    /// The drone of a plan should have been heard of by now.
    pub(super) fn miss_sign(&mut self, id: &Arc<str>, now: Timestamp) {
        let plan = self.next.plans.get(id).cloned();
        let is_flown =
            |plan: &Arc<PlanEntry>| plan.is_active() && plan.state != PlanState::Accepted;
        let Some(plan) = plan.filter(|plan| is_flown(plan) && !plan.flags.silent) else {
            return;
        };
        let sighting = plan.drone_id.as_deref().and_then(|id| self.drones.last(id));
        let heard_at = sighting.filter(|sighting| sighting.is_on(&plan.id));
        let Some(heard_at) = heard_at.map(|sighting| sighting.seen_at) else {
            self.listen_for(id);
            return;
        };
        let silent_at = heard_at.checked_add(self.settings.silent_after);
        let silent_at = silent_at.unwrap_or(Timestamp::MAX);
        if silent_at > now {
            self.listen_at(id, silent_at);
            return;
        }
        let plan = self.keep_plan(PlanEntry {
            state: PlanState::Contingent,
            flags: PlanFlags {
                silent: true,
                ..plan.flags
            },
            ..(*plan).clone()
        });
        self.tell(EventKind::PlanContingent, &plan);
        self.post(&plan, &[], Content::WhereAreYou);
        let message = format!(
            "nothing was heard of the drone of plan '{id}' for {} s: it may fly its contingencies; call it",
            silence_s(now, heard_at)
        );
        self.raise_plan_alarm(AlarmKind::Contingent, &plan, message);
    }

    /// A drone that was silent is heard of again.
    pub(super) fn hear_of_again(&mut self, plan: &Arc<PlanEntry>) -> Done {
        if !plan.flags.silent {
            return Done::Nothing;
        }
        let has_no_way = plan.flags.affected
            && plan.wanted.is_none()
            && !self.next.pending.contains_key(&plan.id);
        let plan = self.keep_plan(PlanEntry {
            state: match has_no_way {
                true => PlanState::Contingent,
                false => PlanState::Activated,
            },
            flags: PlanFlags {
                silent: false,
                ..plan.flags
            },
            ..(**plan).clone()
        });
        self.end_plan_alarms(&plan.id, &[AlarmKind::Contingent]);
        self.drop_questions(&plan);
        self.listen_for(&plan.id);
        self.tell(EventKind::PlanConforming, &plan);
        Done::Plan(plan)
    }
}

fn silence_s(now: Timestamp, heard_at: Timestamp) -> i64 {
    let silence: SignedDuration = now.duration_since(heard_at);
    silence.as_secs()
}
