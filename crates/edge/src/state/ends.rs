//! The life of a plan from its departure to its end. Its planned times end nothing: what it takes stays taken until somebody
//! says what became of it, or nobody has for long.

use super::State;
use super::airspace::just_after;
use super::alarms::AT_THE_END;
use super::timers::Due;
use crate::line::mailbox::Content;
use crate::planner::{Version, later};
use crate::plans::entry::{LandedOn, PlanEntry, PlanFlags};
use crate::writer::commands::{CancelledWhen, Done, Seen};
use jiff::{SignedDuration, Timestamp};
use skyway_contract::{AlarmKind, EndedAs, EventKind, PlanState};
use skyway_engine::geo::Point;
use skyway_engine::network::NodeIx;
use skyway_service::refusal::{Code, Refusal};
use std::sync::Arc;

/// So long after its arrival a plan that has not ended is overdue.
const OVERDUE_AFTER: SignedDuration = SignedDuration::from_secs(60);
/// A place that is older says no longer where a drone in flight is.
const SEEN_JUST_NOW: SignedDuration = SignedDuration::from_secs(15);
/// At most this many plans that are over are still told of; the oldest go first.
const OVER_MAX: usize = 1_000;
/// So many ids are known of plans that were cancelled before they were asked for.
const CANCELLED_BEFORE_MAX: usize = 1_000;

/// So near to a node, in metres, a drone that has landed is on it.
pub(crate) const LANDED_WITHIN_M: f64 = 50.0;

/// How many nodes are looked at for the nearest one.
const NEIGHBOURS: usize = 4;

/// What a plan takes beyond its end, beside the pad that its drone stands on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Holds {
    Nothing,
    /// The last pad of each version.
    Pads,
    /// All that it took in flight.
    All,
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

    /// Looks for a way on once a drone is where its version ends without one.
    pub(super) fn time_way_on(&mut self, plan: &PlanEntry) {
        if plan.reported.ends_at_stop() || plan.waits_at().is_some() {
            self.time_look(&plan.id, just_after(plan.reported.arrives_at()));
        }
    }

    pub(super) fn time_quote(&mut self, plan: &PlanEntry) {
        if let Some(expires_at) = plan.expires_at {
            let due = Due::Quote(plan.id.clone());
            self.timers.set(just_after(expires_at), due);
        }
    }

    /// The time of a quote is over.
    pub(super) fn expire_quote(&mut self, id: &str, now: Timestamp) {
        let plan = self.next.plans.get(id).cloned();
        let is_over = |plan: &Arc<PlanEntry>| plan.expires_at.is_some_and(|at| at <= now);
        if let Some(plan) = plan.filter(|plan| plan.is_active() && is_over(plan)) {
            self.end_plan(&plan, (EndedAs::Cancelled, None), Holds::Nothing);
        }
    }

    /// Ends the quote that expires first, if there is any.
    pub(super) fn end_oldest_quote(&mut self) {
        let plans = self.next.plans.values();
        let quotes = plans.filter(|plan| plan.is_active() && plan.is_quote());
        let oldest = quotes.min_by_key(|plan| (plan.expires_at, plan.id.clone()));
        if let Some(plan) = oldest.cloned() {
            self.end_plan(&plan, (EndedAs::Cancelled, None), Holds::Nothing);
        }
    }

    /// By its times a plan's drone has departed.
    pub(super) fn depart(&mut self, id: &str) {
        if let Some(plan) = self.next.plans.get(id).cloned() {
            self.activate(&plan);
        }
    }

    fn activate(&mut self, plan: &Arc<PlanEntry>) {
        if plan.state == PlanState::Accepted {
            self.leave_pad_of(plan);
            self.listen_from(plan, plan.reported.departs_at);
            self.keep_plan(plan.with(|plan| plan.state = PlanState::Activated));
        }
    }

    /// The drone of a plan departs: the pad on which it stood is free.
    fn leave_pad_of(&mut self, plan: &PlanEntry) {
        if let Some(drone) = &plan.drone_id {
            self.leave_pad(drone);
        }
    }

    /// What telemetry shows of the drone of a plan.
    pub(super) fn see_plan(&mut self, id: &str, seen: Seen) -> Done {
        let plan = self.next.plans.get(id).cloned();
        if seen == Seen::LeftItsPad {
            let landed = plan.filter(|plan| plan.landed_on.is_some());
            landed.iter().for_each(|plan| self.leave_pad_of(plan));
            return Done::Nothing;
        }
        let Some(plan) = plan.filter(|plan| plan.is_active()) else {
            return Done::Nothing;
        };
        let state = match (seen, plan.state) {
            (Seen::Landed(version), _) => {
                if plan.reported.number == version && plan.reported.ends_at_stop() {
                    return Done::Plan(plan);
                }
                if plan.reported.number == version {
                    let how = landed_as(&plan);
                    let node = plan.reported.last_node();
                    return Done::Plan(self.land(&plan, how, node));
                }
                return Done::Nothing;
            }
            (Seen::Served { version, stops }, _) => {
                return self.note_served(&plan, version, stops);
            }
            (Seen::Departed, PlanState::Accepted) => PlanState::Activated,
            (Seen::Heard, _) if plan.flags.silent => {
                return Done::Plan(self.hear_of_again(&plan));
            }
            (Seen::Deviates, PlanState::Activated) => PlanState::Nonconforming,
            (Seen::Conforms, PlanState::Nonconforming) => PlanState::Activated,
            _ => return Done::Nothing,
        };
        if seen == Seen::Departed {
            self.leave_pad_of(&plan);
            self.listen_for(&plan);
        }
        let plan = self.keep_plan(plan.with(|plan| plan.state = state));
        match seen {
            Seen::Deviates => self.tell(EventKind::PlanNonconforming, &plan),
            Seen::Conforms => self.tell(EventKind::PlanConforming, &plan),
            _ => {}
        }
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
        self.keep_plan(plan.with(|plan| plan.state = state))
    }

    /// The arrival of a plan is over: nothing of it is freed, but somebody should look.
    pub(super) fn pass_arrival(&mut self, id: &str, version: u32, now: Timestamp) {
        let plan = self.next.plans.get(id).cloned();
        let Some(plan) = plan.filter(|plan| plan.is_active()) else {
            return;
        };
        // Who holds without a way on is not to arrive; whether it is silent is looked at all the same.
        let is_of_now = plan.reported.number == version && overdue_at(&plan.reported) <= now;
        if is_of_now && plan.reported.holds_at().is_some() {
            self.hold_pads(&plan);
        }
        if plan.waits_at().is_some() || !is_of_now {
            return;
        }
        let id = plan.id.clone();
        let lost_at = self.lost_at(&plan);
        self.timers.set(lost_at, Due::Silence(id));
        if plan.flags.overdue {
            return;
        }
        let plan = self.keep_plan(plan.with(|plan| plan.flags.overdue = true));
        self.hold_pads(&plan);
        self.tell(EventKind::PlanOverdue, &plan);
        self.alarm_at_full_pads(&plan);
    }

    /// When a plan counts as lost unless its drone is heard of again.
    fn lost_at(&self, plan: &PlanEntry) -> Timestamp {
        let seen = plan.drone_id.as_deref();
        let seen = seen.and_then(|drone| Some(self.drones.last(drone)?.seen_at));
        let arrives_at = plan.reported.arrives_at();
        // What one that is heard of told before a restart is forgotten.
        let restored_at = self.restored_at.filter(|_| plan.flags.heard);
        let signs = [seen, restored_at].into_iter().flatten();
        let heard_at = signs.fold(arrives_at, Timestamp::max);
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
        // Its drone may stand on the pad that it was to land on.
        let plan = self.end_plan(&plan, (EndedAs::Lost, None), Holds::Pads);
        let message = format!(
            "nobody has heard of plan '{}' for long: say what became of it, or look for its drone",
            plan.id
        );
        self.raise_plan_alarm(AlarmKind::Lost, &plan, message);
    }

    /// Cancels a plan. Where it is in flight and nobody knows where, its drone may be anywhere on its ways: they stay taken.
    pub(super) fn cancel_plan(&mut self, id: &str, when: CancelledWhen) -> Result<Done, Refusal> {
        let plan = self.plan(id);
        if plan.is_err() {
            self.refuse_from_now_on(id);
        }
        let plan = plan?;
        if plan.ended_as == Some(EndedAs::Cancelled) {
            return Ok(Done::Plan(plan));
        }
        if !plan.is_active() {
            return Err(over(id));
        }
        if when == CancelledWhen::BeforeDeparture && self.may_have_departed(&plan) {
            let detail = format!("the drone of the plan '{id}' has departed, or was to");
            return Err(Refusal::new(Code::PlanStateConflict, detail));
        }
        let may_fly = plan.drone_id.is_some() && plan.state != PlanState::Accepted;
        let is_known = when == CancelledWhen::Placed || self.is_seen_in_flight(&plan);
        let holds = match may_fly && !is_known {
            true => Holds::All,
            false => Holds::Nothing,
        };
        Ok(Done::Plan(self.end_plan(
            &plan,
            (EndedAs::Cancelled, None),
            holds,
        )))
    }

    /// A plan of this id is refused if it is asked for yet. No row is kept: with this process every request ends that is on its way.
    fn refuse_from_now_on(&mut self, id: &str) {
        if self.cancelled_before.len() >= CANCELLED_BEFORE_MAX {
            self.cancelled_before.pop_front();
        }
        self.cancelled_before.push_back(Arc::from(id));
    }

    /// Its drone has told so, or its time has come: one that is silent may fly.
    pub(super) fn may_have_departed(&self, plan: &PlanEntry) -> bool {
        let sighting = plan.drone_id.as_deref();
        let sighting = sighting.and_then(|drone| self.drones.last(drone));
        let is_airborne = sighting.is_some_and(|sighting| {
            // Else that was on its flight before.
            sighting.airborne == Some(true) && sighting.seen_at >= plan.reported.sent_at
        });
        plan.state != PlanState::Accepted || is_airborne || self.now > plan.reported.departs_at
    }

    fn is_seen_in_flight(&self, plan: &PlanEntry) -> bool {
        let sighting = plan.drone_id.as_deref();
        let sighting = sighting.and_then(|drone| self.drones.last(drone));
        sighting.is_some_and(|sighting| {
            let age = self.now.duration_since(sighting.seen_at);
            sighting.seen_at >= plan.reported.departs_at && age <= SEEN_JUST_NOW
        })
    }

    /// A drone says that it has landed, at a place or at the end of what it flies.
    pub(super) fn complete_plan(
        &mut self,
        id: &str,
        landed: EndedAs,
        place: Option<Point>,
    ) -> Result<Done, Refusal> {
        let plan = self.plan(id)?;
        if plan.is_quote() {
            return Err(only_quoted(id));
        }
        let node = match place {
            Some(place) => self.node_at(place),
            None => plan.reported.last_node(),
        };
        let is_at_end = node == plan.reported.last_node();
        if plan.is_active() && is_at_end && plan.reported.ends_at_stop() {
            // A way on is looked for again and again from its arrival on.
            return Ok(Done::Plan(plan));
        }
        if plan.is_active() {
            return Ok(Done::Plan(self.land(&plan, landed, node)));
        }
        if plan.ended_as == Some(EndedAs::Lost) {
            // It is found.
            return Ok(Done::Plan(self.amend_end(&plan, landed, node)));
        }
        if plan.holds && plan.landed_on.is_none() {
            // It was cancelled in flight, and now it is known where its drone is.
            return Ok(Done::Plan(self.amend_end(&plan, EndedAs::Cancelled, node)));
        }
        Ok(Done::Plan(plan))
    }

    /// The node that a drone which has landed at a place stands on.
    fn node_at(&self, place: Point) -> Option<NodeIx> {
        let topology = self.next.topology();
        let off_m = |node: NodeIx| topology.position(node).distance_m(place);
        let boxes = topology
            .node_tree()
            .nearest_neighbor_iter(&[place.x as f32, place.y as f32]);
        // The tree's boxes are rounded, so neighbours may come swapped.
        let near = boxes.take(NEIGHBOURS).map(|boxed| boxed.node);
        let node = near.min_by(|&one, &other| off_m(one).total_cmp(&off_m(other)))?;
        (off_m(node) <= LANDED_WITHIN_M).then_some(node)
    }

    /// Ends a plan whose drone has landed: its pad is the drone's from now on.
    fn land(
        &mut self,
        plan: &Arc<PlanEntry>,
        how: EndedAs,
        node: Option<NodeIx>,
    ) -> Arc<PlanEntry> {
        // Whatever pad it stood on before it has left.
        self.leave_pad_of(plan);
        let landed = node.and_then(|node| self.pad_landed_on(plan, node));
        let plan = self.with_end_of_delivery(plan, how, node);
        self.end_plan(&plan, (how, landed), Holds::Nothing)
    }

    /// An operator says what became of a plan.
    pub(super) fn release_plan(&mut self, id: &str, ended_as: EndedAs) -> Result<Done, Refusal> {
        let plan = self.plan(id)?;
        if plan.is_active() {
            let plan = self.with_end_of_delivery(&plan, ended_as, None);
            let plan = self.end_plan(&plan, (ended_as, None), Holds::Nothing);
            // Its drone may be on its way yet.
            self.post(&plan, &[], Content::Ended(ended_as));
            return Ok(Done::Plan(plan));
        }
        if plan.holds {
            return Ok(Done::Plan(self.amend_end(&plan, ended_as, None)));
        }
        if plan.ended_as == Some(ended_as) {
            return Ok(Done::Plan(plan));
        }
        Err(over(id))
    }

    /// What became of a plan that has ended, and still took what its drone may have been on.
    pub(super) fn amend_end(
        &mut self,
        plan: &Arc<PlanEntry>,
        ended_as: EndedAs,
        landed_at: Option<NodeIx>,
    ) -> Arc<PlanEntry> {
        for version in plan.versions() {
            self.vacate(&plan.id, version);
        }
        self.leave_landed(plan);
        self.end_plan_alarms(&plan.id, &[AlarmKind::Lost]);
        // It may take a pad again, and is forgotten once it takes nothing.
        self.over.retain(|id| *id != plan.id);
        let landed_on = landed_at.filter(|_| !self.has_flown_since(plan));
        let landed_on = landed_on.and_then(|node| self.pad_landed_on(plan, node));
        let plan = self.with_end_of_delivery(plan, ended_as, landed_at);
        let plan = self.keep_plan(PlanEntry {
            ended_as: Some(ended_as),
            sent: Vec::new(),
            holds: landed_on.is_some(),
            landed_on,
            ..(*plan).clone()
        });
        self.take_landed(&plan);
        self.tell(EventKind::PlanEnded, &plan);
        if !plan.holds {
            self.forget_later(&plan.id);
        }
        plan
    }

    /// Whether the drone of a plan that has ended has departed on another one since: where it landed before it does not stand.
    fn has_flown_since(&self, plan: &PlanEntry) -> bool {
        plan.drone_id.as_deref().is_some_and(|drone| {
            let landed = self.next.landed.get(drone);
            let flown = self.next.plan_of_drone(drone);
            landed.is_some_and(|other| *other != plan.id)
                || flown.is_some_and(|other| other.state != PlanState::Accepted)
        })
    }

    /// Ends a plan, which may take something beyond its end.
    fn end_plan(
        &mut self,
        plan: &Arc<PlanEntry>,
        (how, landed_on): (EndedAs, Option<LandedOn>),
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
        let is_held = holds != Holds::Nothing || landed_on.is_some();
        let sent = plan.sent.iter().chain(&plan.wanted);
        let plan = self.keep_plan(PlanEntry {
            state: PlanState::Ended,
            ended_as: Some(how),
            flags: PlanFlags::default(),
            wanted: None,
            // What it may still take is found by them.
            sent: sent.filter(|_| holds != Holds::Nothing).cloned().collect(),
            holds: is_held,
            landed_on,
            ..(**plan).clone()
        });
        if holds != Holds::Nothing {
            self.hold_pads(&plan);
        }
        self.take_landed(&plan);
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
            && let Some(forgotten) = self.next.plans.remove(&oldest)
        {
            self.forget_mail(&forgotten);
        }
    }
}

/// How a plan ends whose drone has landed at the end of what it flies.
pub(crate) fn landed_as(plan: &PlanEntry) -> EndedAs {
    match plan.reported.last_node() == Some(plan.destination) {
        true => EndedAs::Delivered,
        false => EndedAs::Diverted,
    }
}

fn overdue_at(version: &Version) -> Timestamp {
    later(version.arrives_at(), OVERDUE_AFTER.as_secs_f64())
}

/// A drone speaks of the plan that it flies, and a quote is flown by none.
pub(super) fn only_quoted(id: &str) -> Refusal {
    let detail = format!(
        "plan '{id}' is a quote, which no drone flies: ask for a plan with 'drone_id' to fly it"
    );
    Refusal::new(Code::PlanStateConflict, detail)
}

fn over(id: &str) -> Refusal {
    let detail = format!("plan '{id}' is over");
    Refusal::new(Code::PlanStateConflict, detail)
}
