//! The mailboxes in the state: what is put into them, what overtakes what, and what is taken out.

use super::State;
use crate::line::mailbox::{Content, FIRST_VERSION, KEPT_MAX, MailEntry};
use crate::plans::entry::PlanEntry;
use crate::views::CAUSES_MAX;
use crate::writer::commands::Done;
use std::sync::Arc;

impl State {
    /// Puts a message for the drone of a plan into its mailbox, in the place of those that it overtakes.
    pub(super) fn post(&mut self, plan: &PlanEntry, causes: &[String], content: Content) {
        let Some(drone) = plan.drone_id.clone().filter(|_| !plan.is_quote()) else {
            return;
        };
        let mut causes = causes.to_vec();
        causes.sort_unstable();
        causes.dedup();
        causes.truncate(CAUSES_MAX);
        // An order that stands already is not given twice.
        let is_same = |entry: &&Arc<MailEntry>| {
            let is_order = entry.plan == plan.id && entry.content.is_order();
            is_order && entry.content == content
        };
        let standing = self.next.mail_of(&drone, 0).find(is_same).cloned();
        if let Some(standing) = standing {
            let entry = MailEntry {
                causes,
                ..(*standing).clone()
            };
            self.next.mail.insert(entry.key(), Arc::new(entry));
            return;
        }
        let is_overtaken =
            |entry: &MailEntry| entry.plan == plan.id && content.overtakes(&entry.content);
        self.drop_mail(&drone, is_overtaken);
        let entry = MailEntry {
            drone,
            number: self.write_number(),
            at: self.now,
            plan: plan.id.clone(),
            causes,
            content,
        };
        self.bound_mail(&entry.drone);
        self.next.mail.insert(entry.key(), Arc::new(entry));
    }

    /// Takes out the orders of a plan that are no longer what its drone is to fly; all but its end once it is over.
    pub(super) fn drop_overtaken_mail(&mut self, plan: &PlanEntry) {
        if let Some(drone) = plan.drone_id.clone().filter(|_| !self.next.mail.is_empty()) {
            let is_over = |entry: &MailEntry| match plan.is_active() {
                // It flies the plan that it was assigned, and another version of it.
                true if entry.content == Content::Assigned => !plan.has_version(FIRST_VERSION),
                true => entry.content.is_order() && !entry.is_open_order(Some(plan)),
                false => !matches!(entry.content, Content::Ended(_) | Content::Alarm(..)),
            };
            self.drop_mail(&drone, |entry| entry.plan == plan.id && is_over(entry));
        }
    }

    /// Nobody asks any more where the drone of a plan is.
    pub(super) fn drop_questions(&mut self, plan: &PlanEntry) {
        if let Some(drone) = &plan.drone_id {
            self.drop_mail(drone, |entry| {
                entry.plan == plan.id && entry.content == Content::WhereAreYou
            });
        }
    }

    /// A plan is told of no more, nor is its drone told of it.
    pub(super) fn forget_mail(&mut self, plan: &PlanEntry) {
        if let Some(drone) = &plan.drone_id {
            self.drop_mail(drone, |entry| entry.plan == plan.id);
        }
    }

    /// A drone begins with a plan: what it was told of earlier ones is over.
    pub(super) fn empty_mailbox(&mut self, drone: &Arc<str>) {
        self.drop_mail(drone, |_| true);
    }

    /// A drone has received its messages up to one. Orders stay until they are acknowledged, declined or overtaken.
    pub(super) fn receive_mail(&mut self, drone: &Arc<str>, through: u64) -> Done {
        let plans = self.next.plans.clone();
        self.drop_mail(drone, |entry| {
            let plan = plans.get(&entry.plan).map(|plan| &**plan);
            entry.number <= through && !entry.is_open_order(plan)
        });
        Done::Nothing
    }

    fn drop_mail(&mut self, drone: &Arc<str>, is_dropped: impl Fn(&MailEntry) -> bool) {
        let mail = self.next.mail_of(drone, 0);
        let dropped = mail.filter(|entry| is_dropped(entry));
        let dropped: Vec<_> = dropped.map(|entry| entry.key()).collect();
        for key in dropped {
            self.next.mail.remove(&key);
        }
    }

    /// Makes room for one more message.
    fn bound_mail(&mut self, drone: &Arc<str>) {
        if self.next.mail_of(drone, 0).count() < KEPT_MAX {
            return;
        }
        let mut mail = self.next.mail_of(drone, 0);
        let is_spared = |content: &Content| content.is_order() || *content == Content::Assigned;
        let oldest = mail.find(|entry| !is_spared(&entry.content)).cloned();
        drop(mail);
        if let Some(oldest) = oldest {
            tracing::warn!(
                %drone,
                plan = %oldest.plan,
                "a message was never received, and makes room for a newer one"
            );
            self.next.mail.remove(&oldest.key());
        }
    }
}
