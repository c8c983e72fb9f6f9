//! Plans and their versions as they come in, and where they are in the indices of a snapshot.

use super::events::Happening;
use super::fleet;
use super::flights;
use super::orders::Done;
use super::snapshot::{PlanEntry, Version};
use super::state::State;
use super::state_alarms::WITHOUT_WAY;
use super::timers::Due;
use super::views;
use crate::refusal::{Code, Refusal};
use crate::wire::EventKind;
use serde_json::json;
use std::sync::Arc;

/// What is told of a version whose pad another plan has too.
const PAD_CONTESTED: &str = "pad_contested";
/// At most this many versions of a plan are kept that its drone may be flying.
const VERSIONS_MAX: usize = 8;

impl State {
    pub(super) fn add_plan(&mut self, plan: PlanEntry) -> Result<Done, Refusal> {
        if self.next.plans.contains_key(&plan.id) {
            let detail = format!(
                "there is a plan '{}' already; give this one another id",
                plan.id
            );
            return Err(Refusal::new(Code::AlreadyExists, detail));
        }
        // Those that have ended and still take something count too.
        if self.next.plans.len().saturating_sub(self.over.len()) >= self.settings.plans_max {
            let detail = format!(
                "{} plans are active, as many as this edge holds",
                self.settings.plans_max
            );
            return Err(Refusal::new(Code::LimitReached, detail));
        }
        if let Some(other) = plan
            .drone_id
            .as_deref()
            .and_then(|drone| self.next.plan_of_drone(drone))
        {
            let detail = format!(
                "drone '{}' flies plan '{}' already; cancel that first",
                plan.drone_id.as_deref().unwrap_or_default(),
                other.id
            );
            return Err(Refusal::new(Code::PlanStateConflict, detail));
        }
        let headway_s = self.settings.headway_s;
        let is_flown = plan.reported.flight.is_some();
        if is_flown && flights::meets_others(&self.next, &plan.id, &plan.reported, headway_s) {
            // Another plan has come between: this one is composed anew.
            return Ok(Done::Outdated);
        }
        if let Some(drone) = &plan.drone_id {
            self.free_held_by(drone);
            self.next.flown_by.insert(drone.clone(), plan.id.clone());
        }
        self.next.active_plans += 1;
        self.occupy(&plan.id, &plan.reported);
        self.time_departure(&plan);
        self.time_arrival(&plan.id, &plan.reported);
        let plan = Arc::new(plan);
        self.next.plans.insert(plan.id.clone(), plan.clone());
        // It was composed on an earlier snapshot, perhaps.
        self.touched_plans.insert(plan.id.clone());
        self.tell(EventKind::PlanComposed, &plan);
        Ok(Done::Plan(plan))
    }

    /// Proposes the version that a failure report led to.
    pub(super) fn propose_version(&mut self, id: &str, version: Version) -> Done {
        let Some(plan) = self
            .next
            .plans
            .get(id)
            .cloned()
            .filter(|plan| plan.is_active())
        else {
            return Done::Nothing;
        };
        if plan.versions().any(|sent| sent.number >= version.number) {
            return Done::Nothing;
        }
        let version = self.with_contest(&plan.id, version);
        let plan = self.replace_wanted(&plan, Some(version));
        self.tell(EventKind::PlanAffected, &plan);
        Done::Plan(plan)
    }

    /// A drone in flight has to be told something: where another plan has taken its pad meanwhile, that too.
    pub(super) fn with_contest(&self, plan: &str, mut version: Version) -> Version {
        version.warnings.retain(|(code, _)| code != PAD_CONTESTED);
        if let Some((stay, other)) = flights::shares_pad(&self.next, plan, &version) {
            let node = self.next.topology().node_id(stay.node);
            let message = format!(
                "plan '{other}' has pad {} of node '{node}' at the same time",
                stay.pad
            );
            version.warnings.push((PAD_CONTESTED.into(), message));
        }
        version
    }

    /// Offers a version that is better than the one flown; one that has been overtaken is dropped.
    pub(super) fn offer_version(&mut self, id: &str, instead_of: u32, version: Version) -> Done {
        let is_as_it_was = |plan: &Arc<PlanEntry>| {
            let is_flown = plan.is_as_planned() && plan.wanted.is_none();
            is_flown && plan.reported.number == instead_of
        };
        let plan = self.next.plans.get(id).cloned().filter(is_as_it_was);
        let headway_s = self.settings.headway_s;
        let Some(plan) =
            plan.filter(|_| !flights::meets_others(&self.next, id, &version, headway_s))
        else {
            return Done::Nothing;
        };
        let offered = self.replace_wanted(&plan, Some(version));
        let plan = self.keep_plan(PlanEntry {
            flags: plan.flags,
            ..(*offered).clone()
        });
        self.touched_plans.insert(plan.id.clone());
        self.tell(EventKind::PlanOffered, &plan);
        Done::Plan(plan)
    }

    /// Asks the drone of a plan to fly a version, or nothing but what it flies; what it was asked before may be on its way yet.
    pub(super) fn replace_wanted(
        &mut self,
        plan: &Arc<PlanEntry>,
        version: Option<Version>,
    ) -> Arc<PlanEntry> {
        let sent = self.sent_before(plan);
        let wanted = version.map(|version| {
            Arc::new(Version {
                epoch: self.next.epoch,
                sent_at: self.now,
                ..version
            })
        });
        if let Some(wanted) = &wanted {
            self.end_plan_alarms(&plan.id, &WITHOUT_WAY);
            self.occupy(&plan.id, wanted);
            if let Some(by) = wanted.acknowledge_by {
                let (plan, version) = (plan.id.clone(), wanted.number);
                self.timers.set(by, Due::Acknowledgement { plan, version });
            }
        }
        self.keep_plan(PlanEntry {
            flags: plan.flags.and_affected(),
            wanted,
            sent,
            ..(**plan).clone()
        })
    }

    /// Takes back what a plan's drone is asked to fly: it may go on as it flies.
    pub(super) fn withdraw_wanted(&mut self, plan: &Arc<PlanEntry>) -> Arc<PlanEntry> {
        let sent = self.sent_before(plan);
        self.keep_plan(PlanEntry {
            wanted: None,
            sent,
            ..(**plan).clone()
        })
    }

    /// What a plan's drone may have taken over once nothing that it has been told so far is wanted any more. The oldest are
    /// forgotten where they become too many.
    fn sent_before(&mut self, plan: &Arc<PlanEntry>) -> Vec<Arc<Version>> {
        // What nothing is left of on another network is flown by nobody.
        let is_way = |version: &&Arc<Version>| !version.composition.way.nodes.is_empty();
        let wanted = plan.wanted.iter().filter(is_way);
        let mut sent: Vec<Arc<Version>> = plan.sent.iter().chain(wanted).cloned().collect();
        // With the reported one and the next one.
        let too_many = (sent.len() + 2).saturating_sub(VERSIONS_MAX);
        for forgotten in sent.drain(..too_many) {
            self.vacate(&plan.id, &forgotten);
        }
        sent
    }

    pub(super) fn plan(&self, id: &str) -> Result<Arc<PlanEntry>, Refusal> {
        let plan = self.next.plans.get(id).cloned();
        plan.ok_or_else(|| Refusal::not_found("plan", id))
    }

    pub(super) fn keep_plan(&mut self, plan: PlanEntry) -> Arc<PlanEntry> {
        let plan = Arc::new(plan);
        self.next.plans.insert(plan.id.clone(), plan.clone());
        plan
    }

    pub(super) fn occupy(&mut self, plan: &Arc<str>, version: &Version) {
        for (key, stay) in fleet::occupations(plan, version) {
            self.next.occupations.insert(key, stay);
        }
        for (key, stay) in flights::stays(plan, version) {
            self.next.reservations.insert(key, stay);
        }
    }

    pub(super) fn vacate(&mut self, plan: &Arc<str>, version: &Version) {
        for (key, _) in fleet::occupations(plan, version) {
            self.next.occupations.remove(&key);
        }
        for (key, _) in flights::stays(plan, version) {
            self.next.reservations.remove(&key);
        }
    }

    pub(super) fn tell(&mut self, kind: EventKind, plan: &PlanEntry) {
        let data = json!({"plan": views::plan_summary(&self.next, plan)});
        self.events.push(Happening::new(kind, data));
    }
}
