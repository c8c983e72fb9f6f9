//! Orders about plans, and where plans are in the indices of a snapshot.

use super::events::Happening;
use super::fleet;
use super::flights;
use super::orders::Done;
use super::snapshot::{PlanEntry, Version};
use super::state::State;
use super::state_alarms::{AFTER_RELIEF, AT_THE_END, WITHOUT_WAY};
use super::timers::Due;
use super::views;
use crate::refusal::{Code, Refusal};
use crate::wire::{AlarmKind, EventKind, PlanState};
use jiff::Timestamp;
use serde_json::json;
use std::sync::Arc;

/// What is told of a version whose pad another plan has too.
const PAD_CONTESTED: &str = "pad_contested";
/// At most this many plans that are over are still told of; the oldest go first.
const OVER_MAX: usize = 1_000;

impl State {
    pub(super) fn add_plan(&mut self, plan: PlanEntry) -> Result<Done, Refusal> {
        if self.next.plans.contains_key(&plan.id) {
            let detail = format!(
                "there is a plan '{}' already; give this one another id",
                plan.id
            );
            return Err(Refusal::new(Code::AlreadyExists, detail));
        }
        if self.next.active_plans >= self.settings.plans_max {
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
        let is_flown = plan.current.flight.is_some();
        if is_flown && flights::meets_others(&self.next, &plan.id, &plan.current, headway_s) {
            // Another plan has come between: this one is composed anew.
            return Ok(Done::Outdated);
        }
        if let Some(drone) = &plan.drone_id {
            self.next.flown_by.insert(drone.clone(), plan.id.clone());
        }
        self.next.active_plans += 1;
        self.occupy(&plan.id, &plan.current);
        self.time_arrival(&plan.id, &plan.current);
        let plan = Arc::new(plan);
        self.next.plans.insert(plan.id.clone(), plan.clone());
        // It was composed on an earlier snapshot, perhaps.
        self.touched_plans.insert(plan.id.clone());
        self.tell(EventKind::PlanComposed, &plan);
        Ok(Done::Plan(plan))
    }

    pub(super) fn cancel_plan(&mut self, id: &str) -> Result<Done, Refusal> {
        let plan = self.plan(id)?;
        if plan.state == PlanState::Cancelled {
            return Ok(Done::Plan(plan));
        }
        if !plan.is_active() {
            return Err(Refusal::new(
                Code::PlanStateConflict,
                format!("plan '{id}' is over"),
            ));
        }
        Ok(Done::Plan(self.end_plan(&plan, PlanState::Cancelled)))
    }

    pub(super) fn acknowledge_plan(&mut self, id: &str, version: u32) -> Result<Done, Refusal> {
        let plan = self.plan(id)?;
        if !plan.is_active() {
            return Err(Refusal::new(
                Code::PlanStateConflict,
                format!("plan '{id}' is over"),
            ));
        }
        if plan.current.number == version {
            return Ok(Done::Plan(plan));
        }
        let Some(proposed) = plan
            .proposed
            .clone()
            .filter(|proposed| proposed.number == version)
        else {
            let proposed = plan
                .proposed
                .as_ref()
                .map_or("none".to_owned(), |proposed| proposed.number.to_string());
            let detail = format!(
                "plan '{id}' has no version {version} to take over: it flies {}, proposed is {proposed}",
                plan.current.number
            );
            return Err(Refusal::new(Code::PlanStateConflict, detail));
        };
        self.vacate(&plan.id, &plan.current);
        // One that was not acknowledged in time did not count any more.
        let proposed = self.with_contest(&plan.id, (*proposed).clone());
        self.occupy(&plan.id, &proposed);
        self.time_arrival(&plan.id, &proposed);
        let taken_over = PlanEntry {
            state: PlanState::Active,
            current: Arc::new(Version {
                acknowledge_by: None,
                ..proposed
            }),
            proposed: None,
            affected_by: Vec::new(),
            ..(*plan).clone()
        };
        self.end_plan_alarms(&plan.id, &AFTER_RELIEF);
        let plan = self.keep_plan(taken_over);
        self.touched_plans.insert(plan.id.clone());
        self.tell(EventKind::PlanAcknowledged, &plan);
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
        let newest = plan
            .proposed
            .as_ref()
            .map_or(plan.current.number, |proposed| proposed.number);
        if version.number <= newest {
            return Done::Nothing;
        }
        let version = self.with_contest(&plan.id, version);
        let plan = self.replace_proposal(&plan, Some(version));
        self.tell(EventKind::PlanAffected, &plan);
        Done::Plan(plan)
    }

    /// A drone in flight has to be told something: where another plan has taken its pad meanwhile, that too.
    fn with_contest(&self, plan: &str, mut version: Version) -> Version {
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
            let is_flown = plan.state == PlanState::Active && plan.proposed.is_none();
            is_flown && plan.current.number == instead_of
        };
        let plan = self.next.plans.get(id).cloned().filter(is_as_it_was);
        let headway_s = self.settings.headway_s;
        let Some(plan) =
            plan.filter(|_| !flights::meets_others(&self.next, id, &version, headway_s))
        else {
            return Done::Nothing;
        };
        let offered = self.replace_proposal(&plan, Some(version));
        let plan = self.keep_plan(PlanEntry {
            state: PlanState::Active,
            ..(*offered).clone()
        });
        self.touched_plans.insert(plan.id.clone());
        self.tell(EventKind::PlanOffered, &plan);
        Done::Plan(plan)
    }

    /// Takes an offer back.
    pub(super) fn withdraw_offer(&mut self, plan: &Arc<PlanEntry>) {
        if let Some(offered) = &plan.proposed {
            self.vacate(&plan.id, offered);
        }
        self.keep_plan(PlanEntry {
            proposed: None,
            ..(**plan).clone()
        });
    }

    pub(super) fn miss_acknowledgement(&mut self, id: &str, version: u32, now: Timestamp) {
        let Some(plan) = self
            .next
            .plans
            .get(id)
            .cloned()
            .filter(|plan| plan.is_active())
        else {
            return;
        };
        let proposed = plan
            .proposed
            .as_ref()
            .filter(|proposed| proposed.number == version);
        if proposed.is_some_and(|proposed| proposed.acknowledge_by.is_some_and(|by| by <= now)) {
            if plan.state == PlanState::Active {
                // Nobody had to take what was offered.
                self.withdraw_offer(&plan);
                return;
            }
            // From now on only what is flown counts; the proposal may still be taken over.
            if let Some(proposed) = proposed {
                self.vacate(&plan.id, proposed);
            }
            self.next.unacknowledged += 1;
            self.tell(EventKind::PlanUnacknowledged, &plan);
            let message = format!(
                "version {version} of plan '{}' was not acknowledged in time: call its drone",
                plan.id
            );
            self.raise_plan_alarm(AlarmKind::Unacknowledged, &plan, message);
        }
    }

    pub(super) fn complete_plan(&mut self, id: &str, version: u32, now: Timestamp) {
        let Some(plan) = self
            .next
            .plans
            .get(id)
            .cloned()
            .filter(|plan| plan.is_active())
        else {
            return;
        };
        if plan.current.number != version || plan.current.over_at() > now {
            return;
        }
        self.end_plan(&plan, PlanState::Completed);
    }

    pub(super) fn replace_proposal(
        &mut self,
        plan: &Arc<PlanEntry>,
        version: Option<Version>,
    ) -> Arc<PlanEntry> {
        if let Some(before) = &plan.proposed {
            self.vacate(&plan.id, before);
        }
        let proposed = version.map(Arc::new);
        if let Some(proposed) = &proposed {
            self.end_plan_alarms(&plan.id, &WITHOUT_WAY);
            self.occupy(&plan.id, proposed);
            if let Some(by) = proposed.acknowledge_by {
                let (plan, version) = (plan.id.clone(), proposed.number);
                self.timers.set(by, Due::Acknowledgement { plan, version });
            }
        }
        self.keep_plan(PlanEntry {
            state: PlanState::Affected,
            proposed,
            ..(**plan).clone()
        })
    }

    fn end_plan(&mut self, plan: &Arc<PlanEntry>, state: PlanState) -> Arc<PlanEntry> {
        self.vacate(&plan.id, &plan.current);
        if let Some(proposed) = &plan.proposed {
            self.vacate(&plan.id, proposed);
        }
        if let Some(drone) = &plan.drone_id
            && self.next.flown_by.get(drone) == Some(&plan.id)
        {
            self.next.flown_by.remove(drone);
        }
        self.next.active_plans = self.next.active_plans.saturating_sub(1);
        let plan = self.keep_plan(PlanEntry {
            state,
            proposed: None,
            ..(**plan).clone()
        });
        self.end_plan_alarms(&plan.id, &AT_THE_END);
        self.tell(EventKind::PlanEnded, &plan);
        self.over.push_back(plan.id.clone());
        if self.over.len() > OVER_MAX
            && let Some(oldest) = self.over.pop_front()
        {
            self.next.plans.remove(&oldest);
        }
        plan
    }

    fn plan(&self, id: &str) -> Result<Arc<PlanEntry>, Refusal> {
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

    pub(super) fn time_arrival(&mut self, plan: &Arc<str>, version: &Version) {
        let over = version.over_at();
        let (plan, version) = (plan.clone(), version.number);
        self.timers.set(over, Due::Arrival { plan, version });
    }

    pub(super) fn tell(&mut self, kind: EventKind, plan: &PlanEntry) {
        let data = json!({"plan": views::plan_summary(&self.next, plan)});
        self.events.push(Happening::new(kind, data));
    }
}
