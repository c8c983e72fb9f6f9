//! What the state has to do with the store: it begins with what is in it, and refuses what must not be lost
//! while it fails.

use super::State;
use super::airspace::just_after;
use super::timers::Due;
use crate::entries::{ClosureEntry, ProposalEntry};
use crate::line::mailbox::Content;
use crate::plans::entry::PlanEntry;
use crate::store::Restored;
use crate::writer::commands::Command;
use jiff::{SignedDuration, Timestamp};
use skyway_engine::airspace::{Change, Closure};
use skyway_planted::{self as planted, Bug};
use skyway_service::refusal::{Code, Refusal};
use std::sync::Arc;

/// So long the drone of a forgotten plan may be away and is told that it has ended.
const ENDS_KEPT: SignedDuration = SignedDuration::from_hours(24);

impl State {
    /// Takes up what was known when the edge ended, for the time at which it was known. What has become due
    /// since happens with the first batch.
    pub(crate) fn restore(&mut self, restored: Restored, now: Timestamp) {
        let mut changes = Vec::with_capacity(restored.zones.len() + restored.closures.len());
        for (entry, closure) in restored.zones {
            let id = Arc::from(entry.zone.id());
            self.next.zones.insert(id, Arc::new(entry));
            changes.push(Change::Put(Arc::new(closure)));
        }
        for entry in restored.closures {
            changes.push(Change::Put(entry.closure.clone()));
            self.restore_closure(entry);
        }
        let as_of = restored.as_of.unwrap_or(now);
        self.restored_at = Some(now);
        let airspace = self.next.airspace.apply(&changes, as_of);
        self.next.revision = crate::snapshot::revision_text(self.next.epoch, airspace.revision());
        self.next.airspace = Arc::new(airspace);
        for proposal in restored.proposals {
            self.restore_proposal(proposal);
        }
        for hold in restored.holds {
            self.next.holds.insert(hold.number, Arc::new(hold));
        }
        for alarm in restored.alarms {
            self.restore_alarm(alarm);
        }
        let mut plans = restored.plans;
        // Those that are over are forgotten in the order in which they ended, as far as that can be told.
        plans.sort_by_cached_key(|plan| (plan.reported.arrives_at(), plan.id.clone()));
        for plan in plans {
            self.restore_plan(plan);
        }
        for entry in restored.mail {
            // A plan that a new network has ended is forgotten, and its drone may not know yet.
            let age = now.duration_since(entry.at);
            let is_end = matches!(entry.content, Content::Ended(_)) && age < ENDS_KEPT;
            if is_end || self.next.plans.contains_key(&entry.plan) {
                self.next.mail.insert(entry.key(), Arc::new(entry));
            }
        }
        let is_forgotten = planted::is(Bug::DropOutbox);
        for entry in restored.outbox.into_iter().filter(|_| !is_forgotten) {
            self.next.outbox.insert(entry.number, Arc::new(entry));
        }
        self.restore_news(restored.news);
        self.next.registry = restored.registry.map(Arc::new);
        self.next.weather = restored.weather;
        self.next.has_own_weather = restored.has_own_weather;
        self.next.unacknowledged = restored.unacknowledged;
    }

    fn restore_closure(&mut self, entry: ClosureEntry) {
        let id: Arc<str> = Arc::from(entry.closure.id.as_str());
        if let Some(until) = entry.until {
            self.timers.set(just_after(until), Due::Closure(id.clone()));
        }
        self.count_reported(None, Some(&entry));
        self.next.closures.insert(id, Arc::new(entry));
    }

    fn restore_proposal(&mut self, proposal: ProposalEntry) {
        let due = Due::Proposal(proposal.number);
        self.timers.set(just_after(proposal.expires_at), due);
        self.next
            .proposals
            .insert(proposal.number, Arc::new(proposal));
    }

    fn restore_plan(&mut self, plan: PlanEntry) {
        let id = plan.id.clone();
        if plan.is_active() && plan.is_quote() {
            self.next.active_plans += 1;
            self.time_quote(&plan);
        } else if plan.is_active() {
            self.next.active_plans += 1;
            if let Some(drone) = &plan.drone_id {
                self.next.flown_by.insert(drone.clone(), id.clone());
            }
            // What met it may have been in force when the edge ended, and its drone not answered.
            self.touched_plans.insert(id.clone());
            self.time_departure(&plan);
            self.listen_for(&plan);
            self.time_arrival(&id, &plan.reported);
            self.time_way_on(&plan);
            self.occupy_all(&plan);
            self.guard(&plan);
            let wanted = plan.wanted.as_ref();
            if let Some((wanted, by)) = wanted.and_then(|it| Some((it, it.acknowledge_by?))) {
                let due = Due::Acknowledgement {
                    plan: id.clone(),
                    version: wanted.number,
                };
                self.timers.set(by, due);
            }
        } else if plan.holds {
            self.hold_again(&plan);
        } else {
            self.over.push_back(id.clone());
        }
        self.note_contingencies(&plan);
        self.note_off_network(&plan);
        self.next.plans.insert(id, Arc::new(plan));
    }

    /// While the store fails, what closes more is enforced all the same; what a restart must not undo is refused.
    pub(super) fn check_store(&self, order: &Command) -> Result<(), Refusal> {
        if !self.store.is_failing() {
            return Ok(());
        }
        let only_closes_more = match order {
            Command::PutZone { closure, .. } => self.encloses_what_stands(closure),
            Command::ImportZones(update) => self.import_only_closes_more(update),
            Command::ChangeClosure { id, until, .. } => {
                let entry = self.next.closures.get(id.as_str());
                entry.is_none_or(|entry| until.is_none_or(|until| ends_by(entry, until)))
            }
            Command::PutClosure(_)
            | Command::Publish(_)
            | Command::Propose(_)
            | Command::Follow(_)
            | Command::Forwarded { .. }
            | Command::NotForwarded { .. }
            | Command::News(_)
            | Command::ReplaceNetwork(_)
            // What is in it is looked at when it is carried out.
            | Command::MadeOn { .. }
            | Command::By { .. }
            | Command::ProposeVersion { .. }
            | Command::OfferVersion { .. }
            | Command::RaiseAlarm(_)
            | Command::ReceiveMail { .. }
            | Command::SeePlan { .. }
            | Command::AdvanceTo(_)
            | Command::Tick
            | Command::Settle => true,
            Command::DeleteZone { .. }
            | Command::LiftClosure { .. }
            | Command::DecideProposal { .. }
            | Command::DecideHold { .. }
            | Command::PutWeather { .. }
            | Command::AddPlan(_)
            | Command::CancelPlan { .. }
            | Command::AcknowledgePlan { .. }
            | Command::AcknowledgeAlarm { .. }
            | Command::DeclinePlan { .. }
            | Command::CompletePlan { .. }
            | Command::ReleasePlan { .. } => false,
        };
        match only_closes_more {
            true => Ok(()),
            false => {
                let detail = "the store of this edge fails, so that a restart would undo this; nothing was changed";
                Err(Refusal::new(Code::StoreFull, detail).retry_after_s(5))
            }
        }
    }

    /// Whether a closure closes all that the one with its id closes now.
    pub(super) fn encloses_what_stands(&self, closure: &Closure) -> bool {
        let standing = self.next.airspace.closure(&closure.id);
        let changed = self.changes.iter().rev().find_map(|change| match change {
            Change::Put(put) if put.id == closure.id => Some(put),
            _ => None,
        });
        let standing = changed.or(standing);
        standing.is_none_or(|standing| closure.encloses(standing, self.now))
    }
}

/// Whether a closure ends by itself at this instant at the latest.
fn ends_by(entry: &ClosureEntry, until: Timestamp) -> bool {
    entry.until.is_some_and(|ends| ends <= until)
}
