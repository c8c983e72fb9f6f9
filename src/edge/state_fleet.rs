//! Orders about plans, and what closures do to them.

use super::events::Happening;
use super::failures::as_reported;
use super::fleet::{self, Detour};
use super::orders::Done;
use super::snapshot::{PlanEntry, Version, later};
use super::state::State;
use super::timers::Due;
use super::views;
use crate::airspace::{Airspace, Closure};
use crate::compose::equip;
use crate::recompose::{Outcome, World};
use crate::refusal::{Code, Refusal};
use crate::wire::{EventKind, PlanState};
use jiff::Timestamp;
use serde_json::json;
use std::sync::Arc;
use std::sync::atomic::Ordering;

/// How long after its nominal end a plan counts as flown, in seconds.
pub(super) const GRACE_S: f64 = 300.0;
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
        self.time_arrival(&plan.id, &proposed);
        let taken_over = PlanEntry {
            state: PlanState::Active,
            current: Arc::new(Version {
                acknowledge_by: None,
                ..(*proposed).clone()
            }),
            proposed: None,
            affected_by: Vec::new(),
            ..(*plan).clone()
        };
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
        let plan = self.replace_proposal(&plan, Some(version));
        self.tell(EventKind::PlanAffected, &plan);
        Done::Plan(plan)
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
            // From now on only what is flown counts; the proposal may still be taken over.
            if let Some(proposed) = proposed {
                self.vacate(&plan.id, proposed);
            }
            self.next.unacknowledged += 1;
            self.tell(EventKind::PlanUnacknowledged, &plan);
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
        if plan.current.number != version || later(plan.current.arrives_at(), GRACE_S) > now {
            return;
        }
        self.end_plan(&plan, PlanState::Completed);
    }

    /// Looks over the plans that something new in force meets, and those that may be open again.
    ///
    /// Gives what the drones of the plans that are affected now are told.
    pub(super) fn review_plans(
        &mut self,
        before: &Arc<Airspace>,
        fresh: &[Arc<Closure>],
        now: Timestamp,
    ) -> Vec<Detour> {
        let after = self.next.airspace.clone();
        let touched = std::mem::take(&mut self.touched_plans);
        let has_opened = after.opened_at() != before.opened_at();
        if fresh.is_empty() && touched.is_empty() && !has_opened {
            return Vec::new();
        }
        let plans = self.next.plans.values();
        let active: Vec<Arc<PlanEntry>> = plans.filter(|plan| plan.is_active()).cloned().collect();
        let mut detours = Vec::new();
        for plan in active {
            let is_touched = touched.contains(&plan.id);
            let is_hit = fresh.iter().any(|closure| meets(&plan, closure));
            if is_touched || is_hit {
                detours.extend(self.affect(&plan, &after, fresh, now));
            } else if has_opened && plan.state == PlanState::Affected {
                self.relieve(&plan, &after, now);
            }
        }
        detours
    }

    /// Marks a plan affected where something ahead of its drone is closed, with what it is to fly instead.
    fn affect(
        &mut self,
        plan: &Arc<PlanEntry>,
        airspace: &Arc<Airspace>,
        fresh: &[Arc<Closure>],
        now: Timestamp,
    ) -> Option<Detour> {
        let topology = airspace.topology();
        let progress = fleet::progress(topology, plan, &self.drones, now)?;
        let current = &plan.current.composition;
        let current_blocked =
            plan.falls_short() || fleet::is_blocked(airspace, current, progress.leg);
        let proposal_blocked = plan
            .proposed
            .as_ref()
            .is_some_and(|proposed| fleet::is_blocked(airspace, &proposed.composition, 0));
        if !current_blocked && !proposal_blocked {
            return None;
        }
        let affected_by = affecting(plan, airspace, fresh, progress.leg);
        if plan.proposed.is_some() && !proposal_blocked {
            // Its drone has been told a way that is still open, and may be about to take it over.
            let marked = PlanEntry {
                state: PlanState::Affected,
                affected_by,
                ..(**plan).clone()
            };
            self.keep_plan(marked);
            return None;
        }
        let world = World {
            airspace,
            trees: Some(&self.trees),
        };
        let mut detour = fleet::detour(plan, &progress, &world, &mut self.scratch);
        let version = self.version_of(&detour, airspace, now);
        detour.version = version.as_ref().map(|version| version.number);
        let marked = Arc::new(PlanEntry {
            affected_by,
            ..(**plan).clone()
        });
        let plan = self.replace_proposal(&marked, version);
        self.tell(EventKind::PlanAffected, &plan);
        detour.plan = plan;
        Some(detour)
    }

    /// The version that a detour makes, with its contingencies; `None` where there is no way.
    pub(super) fn version_of(
        &mut self,
        detour: &Detour,
        airspace: &Airspace,
        now: Timestamp,
    ) -> Option<Version> {
        let answer = &detour.answer;
        let destination = match answer.outcome {
            Outcome::NoRoute => return None,
            Outcome::Diverted => *answer.path.nodes.last()?,
            Outcome::Rerouted | Outcome::Unaffected => detour.plan.destination,
        };
        // What its drone has reported stays closed in its contingencies too.
        let imagined = detour
            .request
            .report
            .failure
            .closes_leg()
            .then(|| as_reported(airspace, &detour.request, now));
        let world = match &imagined {
            Some(airspace) => World {
                airspace,
                trees: None,
            },
            None => World {
                airspace,
                trees: Some(&self.trees),
            },
        };
        let airspeed_mps = detour.plan.airspeed_mps;
        let way = answer.path.clone();
        let composition = equip(
            &world,
            way,
            answer.first_stretch_m,
            destination,
            airspeed_mps,
            &mut self.scratch,
        );
        let topology = airspace.topology();
        let warnings = answer.warnings.iter();
        Some(Version {
            number: detour.plan.next_version.fetch_add(1, Ordering::Relaxed),
            outcome: Some(answer.outcome),
            composition,
            first_stretch_m: answer.first_stretch_m,
            departs_at: now,
            // What its drone has reported goes on to count.
            recomposition_id: detour
                .plan
                .proposed
                .as_ref()
                .and_then(|before| before.recomposition_id.clone()),
            acknowledge_by: now.checked_add(self.settings.acknowledge_within).ok(),
            warnings: warnings
                .map(|warning| {
                    let (code, message) = crate::formats::warning_text(topology, warning);
                    (code.into(), message)
                })
                .collect(),
        })
    }

    /// A plan whose way is open again keeps it; what its drone itself has reported stays failed.
    fn relieve(&mut self, plan: &Arc<PlanEntry>, airspace: &Airspace, now: Timestamp) {
        let reported = plan
            .proposed
            .as_ref()
            .is_some_and(|proposed| proposed.recomposition_id.is_some());
        if reported || !plan.may_go_on() {
            return;
        }
        let progress = fleet::progress(airspace.topology(), plan, &self.drones, now);
        let blocked = progress.is_some_and(|progress| {
            fleet::is_blocked(airspace, &plan.current.composition, progress.leg)
        });
        if blocked {
            return;
        }
        if let Some(proposed) = &plan.proposed {
            self.vacate(&plan.id, proposed);
        }
        let relieved = PlanEntry {
            state: PlanState::Active,
            proposed: None,
            affected_by: Vec::new(),
            ..(**plan).clone()
        };
        let plan = self.keep_plan(relieved);
        self.tell(EventKind::PlanRelieved, &plan);
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
    }

    pub(super) fn vacate(&mut self, plan: &Arc<str>, version: &Version) {
        for (key, _) in fleet::occupations(plan, version) {
            self.next.occupations.remove(&key);
        }
    }

    pub(super) fn time_arrival(&mut self, plan: &Arc<str>, version: &Version) {
        let over = later(version.arrives_at(), GRACE_S);
        let (plan, version) = (plan.clone(), version.number);
        self.timers.set(over, Due::Arrival { plan, version });
    }

    pub(super) fn tell(&mut self, kind: EventKind, plan: &PlanEntry) {
        let data = json!({"plan": views::plan_summary(&self.next, plan)});
        self.events.push(Happening::new(kind, data));
    }
}

/// The closures that block a plan from a leg on: those known that still count, and the fresh ones.
fn affecting(
    plan: &PlanEntry,
    airspace: &Airspace,
    fresh: &[Arc<Closure>],
    from_leg: usize,
) -> Vec<String> {
    let known = plan
        .affected_by
        .iter()
        .filter(|id| airspace.is_in_force(id));
    let mut ids: Vec<String> = known.cloned().collect();
    for closure in fresh {
        if fleet::is_hit(closure, &plan.current.composition, from_leg) && !ids.contains(&closure.id)
        {
            ids.push(closure.id.clone());
        }
    }
    ids
}

/// Whether a closure closes anything of what a plan flies or is to fly; how far its drone has come is looked at later.
fn meets(plan: &PlanEntry, closure: &Closure) -> bool {
    let proposed = plan.proposed.as_ref();
    fleet::is_hit(closure, &plan.current.composition, 0)
        || proposed.is_some_and(|proposed| fleet::is_hit(closure, &proposed.composition, 0))
}
