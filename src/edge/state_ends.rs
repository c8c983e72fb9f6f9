//! The life of a plan from its departure to its end. Its planned times end nothing: what it takes stays taken until somebody
//! says what became of it, or nobody has for long.

use super::orders::Done;
use super::snapshot::{PlanEntry, PlanFlags, Version, later};
use super::state::State;
use super::state_airspace::just_after;
use super::state_alarms::AT_THE_END;
use super::timers::Due;
use crate::flight::Reservation;
use crate::refusal::{Code, Refusal};
use crate::wire::{AlarmKind, EndedAs, EventKind, PlanState};
use jiff::{SignedDuration, Timestamp};
use std::sync::Arc;

/// So long after its arrival a plan that has not ended is overdue.
const OVERDUE_AFTER: SignedDuration = SignedDuration::from_secs(60);
/// A pad that is taken until somebody says otherwise is taken for so many seconds.
const FOR_LONG_S: f64 = 1e9;
/// At most this many plans that are over are still told of; the oldest go first.
const OVER_MAX: usize = 1_000;

/// What a plan takes beyond its end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Holds {
    Nothing,
    /// The last pad of each version.
    Pads,
    /// All that it took in flight.
    All,
}

/// What telemetry shows of a plan's drone.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Seen {
    /// It is in the air.
    Departed,
    /// It is off every way that it was told.
    OffItsWays,
    /// It is on one of them again.
    OnItsWay,
    /// It rests at the end of this version.
    Landed(u32),
}

impl State {
    pub(super) fn time_departure(&mut self, plan: &PlanEntry) {
        let at = just_after(plan.reported.departs_at);
        self.timers.set(at, Due::Departure(plan.id.clone()));
    }

    pub(super) fn time_arrival(&mut self, plan: &Arc<str>, version: &Version) {
        let at = overdue_at(version);
        let (plan, version) = (plan.clone(), version.number);
        self.timers.set(at, Due::Arrival { plan, version });
    }

    /// By its times a plan's drone has departed.
    pub(super) fn depart(&mut self, id: &str) {
        if let Some(plan) = self.next.plans.get(id).cloned() {
            self.activate(&plan);
        }
    }

    fn activate(&mut self, plan: &Arc<PlanEntry>) {
        if plan.state == PlanState::Accepted {
            self.keep_plan(PlanEntry {
                state: PlanState::Activated,
                ..(**plan).clone()
            });
        }
    }

    /// What telemetry shows of the drone of a plan.
    pub(super) fn see_plan(&mut self, id: &str, seen: Seen) -> Done {
        let plan = self.next.plans.get(id).cloned();
        let Some(plan) = plan.filter(|plan| plan.is_active()) else {
            return Done::Nothing;
        };
        let state = match (seen, plan.state) {
            (Seen::Landed(version), _) => {
                if plan.reported.number == version {
                    let how = landed_as(&plan);
                    return Done::Plan(self.end_plan(&plan, how));
                }
                return Done::Nothing;
            }
            (Seen::Departed, PlanState::Accepted) => PlanState::Activated,
            (Seen::OffItsWays, PlanState::Activated) => PlanState::Nonconforming,
            (Seen::OnItsWay, PlanState::Nonconforming) => PlanState::Activated,
            _ => return Done::Nothing,
        };
        let plan = self.keep_plan(PlanEntry {
            state,
            ..(*plan).clone()
        });
        Done::Plan(plan)
    }

    /// A plan is contingent where there is no way that its drone could be told.
    pub(super) fn contingent_without_way(&mut self, plan: Arc<PlanEntry>) -> Arc<PlanEntry> {
        if plan.wanted.is_some() {
            return plan;
        }
        let state = match plan.state {
            PlanState::Accepted => PlanState::Accepted,
            _ => PlanState::Contingent,
        };
        self.keep_plan(PlanEntry {
            state,
            ..(*plan).clone()
        })
    }

    /// The arrival of a plan is over: nothing of it is freed, but somebody should look.
    pub(super) fn pass_arrival(&mut self, id: &str, version: u32, now: Timestamp) {
        let plan = self.next.plans.get(id).cloned();
        let Some(plan) = plan.filter(|plan| plan.is_active()) else {
            return;
        };
        if plan.reported.number != version || overdue_at(&plan.reported) > now {
            return;
        }
        let id = plan.id.clone();
        if plan.drone_id.is_none() {
            // Nobody flies it, and nobody will say that it has ended.
            self.end_plan(&plan, EndedAs::Cancelled);
            return;
        }
        let lost_at = self.lost_at(&plan);
        self.timers.set(lost_at, Due::Silence(id));
        if plan.flags.overdue {
            return;
        }
        let plan = self.keep_plan(PlanEntry {
            flags: PlanFlags {
                overdue: true,
                ..plan.flags
            },
            ..(*plan).clone()
        });
        self.hold_pads(&plan);
        self.tell(EventKind::PlanOverdue, &plan);
    }

    /// When a plan counts as lost unless its drone is heard of again.
    fn lost_at(&self, plan: &PlanEntry) -> Timestamp {
        let seen = plan.drone_id.as_deref();
        let seen = seen.and_then(|drone| Some(self.drones.last(drone)?.seen_at));
        let arrives_at = plan.reported.arrives_at();
        let heard_at = seen.map_or(arrives_at, |seen_at| seen_at.max(arrives_at));
        let lost_at = heard_at.checked_add(self.settings.lost_after);
        lost_at.unwrap_or(Timestamp::MAX)
    }

    /// Nobody has said for long what became of a plan.
    pub(super) fn miss_plan(&mut self, id: &str, now: Timestamp) {
        let plan = self.next.plans.get(id).cloned();
        let Some(plan) = plan.filter(|plan| plan.is_active() && plan.flags.overdue) else {
            return;
        };
        let lost_at = self.lost_at(&plan);
        if lost_at > now {
            self.timers.set(lost_at, Due::Silence(plan.id.clone()));
            return;
        }
        let plan = self.end_plan(&plan, EndedAs::Lost);
        let message = format!(
            "nobody has heard of plan '{}' for long: say what became of it, or look for its drone",
            plan.id
        );
        self.raise_plan_alarm(AlarmKind::Lost, &plan, message);
    }

    /// Cancels a plan. Where it is in flight and nobody knows where, its drone may be anywhere on its ways: they stay taken.
    pub(super) fn cancel_plan(&mut self, id: &str) -> Result<Done, Refusal> {
        let plan = self.plan(id)?;
        if plan.ended_as == Some(EndedAs::Cancelled) {
            return Ok(Done::Plan(plan));
        }
        if !plan.is_active() {
            return Err(over(id));
        }
        let may_fly = plan.drone_id.is_some() && plan.state != PlanState::Accepted;
        let holds = match may_fly && !self.is_seen_in_flight(&plan) {
            true => Holds::All,
            false => Holds::Nothing,
        };
        Ok(Done::Plan(self.end_plan_holding(
            &plan,
            EndedAs::Cancelled,
            holds,
        )))
    }

    fn is_seen_in_flight(&self, plan: &PlanEntry) -> bool {
        let sighting = plan.drone_id.as_deref();
        let sighting = sighting.and_then(|drone| self.drones.last(drone));
        sighting.is_some_and(|sighting| sighting.seen_at >= plan.reported.departs_at)
    }

    /// A drone says that it has landed, at a place or at the end of what it flies.
    pub(super) fn complete_plan(&mut self, id: &str, landed: EndedAs) -> Result<Done, Refusal> {
        let plan = self.plan(id)?;
        if plan.is_active() {
            return Ok(Done::Plan(self.end_plan(&plan, landed)));
        }
        if plan.ended_as == Some(EndedAs::Lost) {
            // It is found.
            return Ok(Done::Plan(self.amend_end(&plan, landed)));
        }
        Ok(Done::Plan(plan))
    }

    /// An operator says what became of a plan.
    pub(super) fn release_plan(&mut self, id: &str, ended_as: EndedAs) -> Result<Done, Refusal> {
        let plan = self.plan(id)?;
        if plan.is_active() {
            return Ok(Done::Plan(self.end_plan_holding(
                &plan,
                ended_as,
                Holds::Nothing,
            )));
        }
        if plan.holds {
            return Ok(Done::Plan(self.amend_end(&plan, ended_as)));
        }
        if plan.ended_as == Some(ended_as) {
            return Ok(Done::Plan(plan));
        }
        Err(over(id))
    }

    /// What became of a plan that has ended, and still took what its drone may have been on.
    fn amend_end(&mut self, plan: &Arc<PlanEntry>, ended_as: EndedAs) -> Arc<PlanEntry> {
        for version in plan.versions() {
            self.vacate(&plan.id, version);
        }
        let plan = self.keep_plan(PlanEntry {
            ended_as: Some(ended_as),
            sent: Vec::new(),
            holds: false,
            ..(**plan).clone()
        });
        self.tell(EventKind::PlanEnded, &plan);
        self.forget_later(&plan.id);
        plan
    }

    /// A drone that begins another plan is nowhere else: what ended ones of it still took is free.
    pub(super) fn free_held_by(&mut self, drone: &str) {
        let is_held =
            |plan: &&Arc<PlanEntry>| plan.holds && plan.drone_id.as_deref() == Some(drone);
        let plans = self.next.plans.values();
        let held: Vec<Arc<PlanEntry>> = plans.filter(is_held).cloned().collect();
        for plan in held {
            let ended_as = plan.ended_as.unwrap_or(EndedAs::Cancelled);
            self.amend_end(&plan, ended_as);
        }
    }

    /// The last pad that each version of a plan takes stays taken.
    pub(super) fn hold_pads(&mut self, plan: &PlanEntry) {
        for version in plan.versions() {
            let stays = super::flights::stays(&plan.id, version);
            let last = stays.max_by(|left, right| left.1.until_s.total_cmp(&right.1.until_s));
            if let Some((key, stay)) = last {
                let stay = Reservation {
                    until_s: stay.until_s + FOR_LONG_S,
                    ..stay
                };
                self.next.reservations.insert(key, stay);
            }
        }
    }

    /// Ends a plan. A drone that is lost may stand on the pad that it was to land on.
    pub(super) fn end_plan(&mut self, plan: &Arc<PlanEntry>, how: EndedAs) -> Arc<PlanEntry> {
        let holds = match how {
            EndedAs::Lost => Holds::Pads,
            EndedAs::Delivered | EndedAs::Diverted | EndedAs::Cancelled => Holds::Nothing,
        };
        self.end_plan_holding(plan, how, holds)
    }

    fn end_plan_holding(
        &mut self,
        plan: &Arc<PlanEntry>,
        how: EndedAs,
        holds: Holds,
    ) -> Arc<PlanEntry> {
        if holds != Holds::All {
            for version in plan.versions() {
                self.vacate(&plan.id, version);
            }
        }
        if let Some(drone) = &plan.drone_id
            && self.next.flown_by.get(drone) == Some(&plan.id)
        {
            self.next.flown_by.remove(drone);
        }
        self.next.active_plans = self.next.active_plans.saturating_sub(1);
        let is_held = holds != Holds::Nothing;
        let sent = plan.sent.iter().chain(&plan.wanted);
        let plan = self.keep_plan(PlanEntry {
            state: PlanState::Ended,
            ended_as: Some(how),
            flags: PlanFlags::default(),
            wanted: None,
            // What it may still take is found by them.
            sent: sent.filter(|_| is_held).cloned().collect(),
            holds: is_held,
            ..(**plan).clone()
        });
        if is_held {
            self.hold_pads(&plan);
        }
        self.end_plan_alarms(&plan.id, &AT_THE_END);
        self.tell(EventKind::PlanEnded, &plan);
        if !is_held {
            self.forget_later(&plan.id);
        }
        plan
    }

    /// A plan that takes nothing any more is told of until too many others have ended after it.
    pub(super) fn forget_later(&mut self, plan: &Arc<str>) {
        self.over.push_back(plan.clone());
        if self.over.len() > OVER_MAX
            && let Some(oldest) = self.over.pop_front()
        {
            self.next.plans.remove(&oldest);
        }
    }
}

/// How a plan ends whose drone has landed at the end of what it flies.
pub(super) fn landed_as(plan: &PlanEntry) -> EndedAs {
    match plan.reported.last_node() == Some(plan.destination) {
        true => EndedAs::Delivered,
        false => EndedAs::Diverted,
    }
}

fn overdue_at(version: &Version) -> Timestamp {
    later(version.arrives_at(), OVERDUE_AFTER.as_secs_f64())
}

fn over(id: &str) -> Refusal {
    let detail = format!("plan '{id}' is over");
    Refusal::new(Code::PlanStateConflict, detail)
}
