//! Plans and their versions as they come in, and where they are in the indices of a snapshot.

use super::State;
use super::alarms::WITHOUT_WAY;
use super::timers::Due;
use crate::drones::progress;
use crate::events::Happening;
use crate::line::mailbox::{Content, WITHOUT_WAY_TEXT};
use crate::planner::{Concern, Version, legs, stays};
use crate::plans::already_exists;
use crate::plans::entry::PlanEntry;
use crate::plans::fleet::Detour;
use crate::writer::commands::Done;
use crate::{views, words};
use serde_json::{Value, json};
use skyway_contract::{EndedAs, EventKind};
use skyway_engine::recompose::Outcome;
use skyway_service::refusal::{Code, Refusal};
use std::sync::Arc;

/// What is told of a version whose pad another plan has too.
const PAD_CONTESTED: &str = "pad_contested";
/// At most this many versions of a plan are kept that its drone may be flying.
const VERSIONS_MAX: usize = 8;

impl State {
    /// Whether a plan may have an id.
    fn check_plan_id(&self, id: &Arc<str>) -> Result<(), Refusal> {
        if self.next.plans.contains_key(id) {
            return Err(already_exists(id));
        }
        if self.cancelled_before.contains(id) {
            let detail = format!(
                "plan '{id}' was cancelled before it was asked for; give another one its own id"
            );
            return Err(Refusal::new(Code::PlanStateConflict, detail));
        }
        Ok(())
    }

    pub(super) fn add_plan(&mut self, plan: PlanEntry) -> Result<Done, Refusal> {
        self.check_plan_id(&plan.id)?;
        // Those that have ended and still take something count too.
        let is_full = |state: &Self| {
            let held = state.next.plans.len().saturating_sub(state.over.len());
            held >= state.settings.plans_max
        };
        if is_full(self) && !plan.is_quote() {
            // Quotes take no place from who flies.
            self.end_oldest_quote();
        }
        if is_full(self) {
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
        let minds_traffic = self.planner.minds(Concern::Traffic, Some(&plan.reported));
        let scene = self.next.scene(self.now);
        let own = scene.traffic.own(None, plan.drone_id.as_deref());
        let is_met = || self.planner.meets(scene, own, &plan.reported, &|_| true);
        if minds_traffic && is_met() {
            // Another plan has come between: this one is composed anew.
            return Ok(Done::Outdated);
        }
        if plan.is_quote() {
            return Ok(self.add_quote(plan));
        }
        if let Some(drone) = &plan.drone_id {
            self.free_air_held_by(drone);
            self.empty_mailbox(drone);
            self.end_alarms_of_former_plans(drone);
            self.next.flown_by.insert(drone.clone(), plan.id.clone());
        }
        self.next.active_plans += 1;
        self.occupy(&plan.id, &plan.reported);
        self.time_departure(&plan);
        self.time_arrival(&plan.id, &plan.reported);
        let plan = Arc::new(plan);
        self.next.plans.insert(plan.id.clone(), plan.clone());
        self.note_contingencies(&plan);
        // It was composed on an earlier snapshot, perhaps.
        self.touched_plans.insert(plan.id.clone());
        self.tell(EventKind::PlanComposed, &plan);
        if plan.flown_for.is_some() {
            self.note_flight(&plan);
            self.post(&plan, &[], Content::Assigned);
        }
        Ok(Done::Plan(plan))
    }

    /// Keeps a quote, which takes nothing and ends by itself.
    fn add_quote(&mut self, plan: PlanEntry) -> Done {
        let (now, airspace) = (self.now, self.next.airspace.clone());
        let progress = progress::progress(airspace.topology(), &plan, &self.drones, now);
        if progress.is_some_and(|progress| self.is_cut(&plan, &progress, &airspace, now)) {
            // Something has closed since it was composed.
            return Done::Outdated;
        }
        self.next.active_plans += 1;
        self.time_quote(&plan);
        let plan = self.keep_plan(plan);
        self.tell(EventKind::PlanComposed, &plan);
        Done::Plan(plan)
    }

    /// Proposes the version that a failure report led to.
    pub(super) fn propose_version(&mut self, id: &str, version: Version) -> Done {
        let Some(plan) = self
            .next
            .plans
            .get(id)
            .cloned()
            .filter(|plan| plan.is_active() && !plan.is_quote())
        else {
            return Done::Nothing;
        };
        if plan.has_version(version.number) || version.number < plan.reported.number {
            return Done::Nothing;
        }
        let is_another_way = version.outcome != Some(Outcome::Unaffected);
        let flags = plan.flags;
        let version = self.with_contest(&plan.id, version);
        if plan.versions().any(|sent| sent.number > version.number) {
            return self.keep_overtaken(&plan, version);
        }
        let plan = self.replace_wanted(&plan, Some(version));
        if !is_another_way {
            // It may go on as it flies; what it is sent has its times and pads as they are now.
            let plan = self.keep_plan(PlanEntry {
                flags,
                ..(*plan).clone()
            });
            self.tell(EventKind::PlanOffered, &plan);
            return Done::Plan(plan);
        }
        self.tell(EventKind::PlanAffected, &plan);
        Done::Plan(plan)
    }

    /// Keeps a version that its drone has been told by an answer, and that a newer one has overtaken on its way here: it may be
    /// flown.
    fn keep_overtaken(&mut self, plan: &Arc<PlanEntry>, version: Version) -> Done {
        if plan.versions().count() >= VERSIONS_MAX {
            return Done::Nothing;
        }
        self.occupy(&plan.id, &version);
        let mut sent = plan.sent.clone();
        let place = sent.partition_point(|sent| sent.number < version.number);
        sent.insert(place, Arc::new(version));
        Done::Plan(self.keep_plan(PlanEntry {
            sent,
            ..(**plan).clone()
        }))
    }

    /// A drone in flight has to be told something: where another plan has taken its pad meanwhile, that too.
    pub(super) fn with_contest(&self, plan: &str, mut version: Version) -> Version {
        version.warnings.retain(|(code, _)| code != PAD_CONTESTED);
        if let Some((stay, other)) = self
            .next
            .traffic()
            .shares_pad(self.next.own(plan), &version)
        {
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
        let (scene, own) = (self.next.scene(self.now), self.next.own(id));
        let meets = |_: &_| self.planner.meets(scene, own, &version, &|_| true);
        let Some(plan) = plan.filter(|plan| !meets(plan)) else {
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
            self.alarm_unseparated(plan, wanted);
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

    /// Whether a first stretch of a plan is in no index of the air.
    pub(super) fn note_off_network(&mut self, plan: &PlanEntry) {
        let is_off = |version: &Arc<Version>| {
            let stretch = version.stretch.as_ref();
            stretch.is_some_and(|stretch| stretch.is_off_network())
        };
        match plan.is_active() && plan.versions().any(is_off) {
            true => self.off_network.insert(plan.id.clone()),
            false => self.off_network.remove(&plan.id),
        };
    }

    pub(super) fn keep_plan(&mut self, plan: PlanEntry) -> Arc<PlanEntry> {
        let plan = Arc::new(plan);
        self.next.plans.insert(plan.id.clone(), plan.clone());
        self.note_off_network(&plan);
        self.guard(&plan);
        self.note_contingencies(&plan);
        self.end_unseparated(&plan);
        self.drop_overtaken_mail(&plan);
        self.note_flight(&plan);
        plan
    }

    /// Takes what the versions of a plan need that its drone may be flying, or may take over yet; for long where it is overdue.
    pub(super) fn occupy_all(&mut self, plan: &PlanEntry) {
        for version in plan.versions() {
            self.occupy(&plan.id, version);
        }
        if plan.flags.overdue || plan.reported.holds_at().is_some() {
            self.hold_pads(plan);
        }
    }

    pub(super) fn occupy(&mut self, plan: &Arc<str>, version: &Version) {
        self.occupied_since.insert(plan.clone());
        let occupancy = &mut self.next.occupancy;
        for (segment, leg) in legs(plan, version) {
            occupancy.put_leg(segment, leg);
        }
        for (node, stay) in stays(plan, version) {
            occupancy.put_stay(node, stay);
        }
    }

    pub(super) fn vacate(&mut self, plan: &Arc<str>, version: &Version) {
        let occupancy = &mut self.next.occupancy;
        for (segment, leg) in legs(plan, version) {
            occupancy.remove_leg(segment, plan, leg.version, leg.leg);
        }
        for (node, stay) in stays(plan, version) {
            occupancy.remove_stay(node, plan, stay.version, stay.number);
        }
    }

    /// Tells what happened to a plan: its outcome is that of the newest version that its drone was sent.
    pub(super) fn tell(&mut self, kind: EventKind, plan: &PlanEntry) {
        let newest = plan.wanted.as_ref().unwrap_or(&plan.reported);
        let has_no_way = kind == EventKind::PlanAffected && plan.wanted.is_none();
        if has_no_way {
            self.tell_without_way(plan, None);
            return;
        }
        let outcome = words::outcome_name(newest.outcome);
        self.tell_outcome(kind, plan, outcome, &plan.affected_by);
        let number = newest.number;
        let content = match (kind, plan.ended_as) {
            (EventKind::PlanAffected, _) => Content::Version(number),
            (EventKind::PlanDeclined, _) if plan.wanted.is_some() => Content::Version(number),
            // Who declines an offer flies on as it was.
            (EventKind::PlanDeclined, _) if plan.is_as_planned() && plan.may_go_on() => return,
            (EventKind::PlanDeclined, _) => Content::Declined,
            (EventKind::PlanOffered, _) => Content::Offer(number),
            // Who has landed knows.
            (EventKind::PlanEnded, Some(how @ (EndedAs::Cancelled | EndedAs::Lost))) => {
                Content::Ended(how)
            }
            _ => return,
        };
        self.post(plan, &plan.affected_by, content);
    }

    /// A plan is flown as it was: what met it is over, or lies behind its drone.
    pub(super) fn tell_relieved(&mut self, plan: &PlanEntry, causes: &[String]) {
        let plan = self.next.plans.get(&plan.id).cloned();
        if let Some(plan) = plan {
            self.tell_outcome(EventKind::PlanRelieved, &plan, "unaffected", causes);
            self.post(&plan, causes, Content::Relieved);
        }
    }

    /// Some of what has closed lies behind the drone of a plan by now. Its drone is told no more than what else it is told.
    pub(super) fn tell_passed(&mut self, plan: &Arc<str>, causes: &[String]) {
        let plan = self.next.plans.get(plan).cloned();
        if let Some(plan) = plan.filter(|_| !causes.is_empty()) {
            self.tell_outcome(EventKind::PlanRelieved, &plan, "unaffected", causes);
        }
    }

    /// The drone of a plan has no way: what closes it, what to do, and the least bad way as far as there is any.
    pub(super) fn tell_without_way(&mut self, plan: &PlanEntry, detour: Option<&Detour>) {
        let outcome = Outcome::NoRoute.name();
        self.tell_outcome(EventKind::PlanAffected, plan, outcome, &plan.affected_by);
        let way = detour.and_then(|detour| detour.unsafe_way(self.next.topology()));
        let unsafe_way = way.as_ref().map(|way| Arc::from(way.to_string()));
        self.post(plan, &plan.affected_by, Content::NoWay(unsafe_way));
        if let Some(Value::Object(members)) = self.events.last_mut().map(|told| &mut told.data) {
            members.insert("unsafe_way".to_owned(), way.unwrap_or(Value::Null));
            members.insert("what_to_do".to_owned(), json!(WITHOUT_WAY_TEXT));
        }
    }

    fn tell_outcome(
        &mut self,
        kind: EventKind,
        plan: &PlanEntry,
        outcome: &'static str,
        causes: &[String],
    ) {
        let data = json!({
            "plan": views::plan_summary(&self.next, plan),
            "outcome": outcome,
            "causes": causes,
        });
        self.events.push(Happening::new(kind, data));
    }
}
