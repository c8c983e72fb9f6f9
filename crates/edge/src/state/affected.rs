//! What closures and the wind do to plans: who is affected, what their drones are to fly instead, and who is free again.

use super::State;
use super::alarms::AFTER_RELIEF;
use super::timers::Due;
use crate::drones::progress::{self, Progress};
use crate::planner::{Concern, Occasion, Sent, Version};
use crate::plans::entry::PlanEntry;
use crate::plans::fleet::{self, Detour, DetourMeans};
use crate::replanning::Causes;
use jiff::{SignedDuration, Timestamp};
use skyway_contract::{EventKind, PlanState};
use skyway_engine::airspace::Airspace;
use skyway_engine::checked::Known;
use skyway_engine::recompose::Outcome;
use skyway_planted::{self as planted, Bug};
use std::collections::BTreeSet;
use std::sync::Arc;
use std::sync::atomic::Ordering;

/// After so long a plan without a way is looked at again.
const WAY_AGAIN: SignedDuration = SignedDuration::from_secs(15);

/// What a look at a plan came to.
#[derive(Debug)]
pub(super) enum Affected {
    /// Nothing is closed ahead of its drone.
    Not,
    /// What its drone has been told already is still open: this outcome.
    Kept(&'static str),
    /// Its drone is told this.
    Told(Box<Detour>),
    /// What was found for it has been overtaken.
    Overtaken,
}

/// What a wave has found for a plan.
#[derive(Debug)]
pub(super) struct Found {
    pub(super) detour: Option<Box<Detour>>,
    /// What it was found on.
    pub(super) airspace: Arc<Airspace>,
}

impl State {
    /// Whether anything is closed ahead of the drone of a plan, on what it flies or is to fly.
    pub(super) fn is_cut(
        &self,
        plan: &PlanEntry,
        progress: &Progress,
        airspace: &Arc<Airspace>,
        now: Timestamp,
    ) -> bool {
        let obstructed = fleet::obstructed(plan, progress, &self.means(airspace, now));
        obstructed.is_reported || obstructed.wanted_by.is_some()
    }

    /// Marks a plan affected where something ahead of its drone is closed, with what it is to fly instead.
    pub(super) fn affect(
        &mut self,
        plan: &Arc<PlanEntry>,
        airspace: &Arc<Airspace>,
        (causes, found): (&Causes, Option<Found>),
        now: Timestamp,
    ) -> Affected {
        let topology = airspace.topology();
        let Some(progress) = progress::progress_or_wait(topology, plan, &self.drones, now) else {
            return Affected::Not;
        };
        let ahead = progress::ahead(plan, &progress);
        let obstructed = fleet::obstructed(plan, &progress, &self.means(airspace, now));
        if !obstructed.is_reported && obstructed.wanted_by.is_none() {
            return Affected::Not;
        }
        if !obstructed.is_reported && plan.is_as_planned() && plan.wanted.is_some() {
            self.withdraw_wanted(plan);
            return Affected::Not;
        }
        let scene = self.next.scene_in(airspace, now);
        let mut affected_by = self
            .planner
            .affected_by(scene, plan, ahead, obstructed.by, causes);
        let is_wanted = obstructed.wanted_by.is_some();
        // What meets only the way that its drone is to take over is named, too.
        let met = obstructed.wanted_by.into_iter().flatten();
        let in_force = causes
            .iter()
            .filter(|cause| is_wanted && airspace.is_in_force(cause));
        let met = met.chain(in_force.map(|cause| cause.to_string()));
        let known: BTreeSet<String> = affected_by.iter().cloned().collect();
        let also: BTreeSet<String> = met.filter(|id| !known.contains(id)).collect();
        affected_by.extend(also);
        if let Some(wanted) = plan.wanted.as_ref().filter(|_| !is_wanted) {
            return self.keep_wanted(plan, wanted, affected_by);
        }
        let is_of_wave = found.is_some();
        let is_clear = affected_by.is_empty();
        let detour = match found {
            Some(found) => self.not_overtaken(found, plan),
            None => Some(fleet::detour(plan, &progress, &self.means(airspace, now))),
        };
        let Some(detour) = detour else {
            return Affected::Overtaken;
        };
        let checked = self.checked(detour, airspace, now);
        let version = self.version_of(&checked, airspace, now);
        if is_clear
            && version
                .as_ref()
                .is_some_and(|it| leads_no_further(plan, it))
        {
            self.time_way(plan, now);
            return Affected::Not;
        }
        let of_wave = version.as_ref().filter(|_| is_of_wave);
        if of_wave.is_some_and(|version| self.meets_newcomers(plan, version)) {
            return Affected::Overtaken;
        }
        // A drone that may be flying a withdrawn version is sent an explicit one, even to fly on as it was.
        let may_stay = plan.wanted.is_some() || !is_wanted;
        self.take_detour(plan, (checked, may_stay), version, affected_by, now)
    }

    /// What a wave has found for a plan, unless that is another one now, or what has closed or was taken since makes it one that
    /// the checker would refuse: that is no fault of the search.
    fn not_overtaken(&self, found: Found, plan: &Arc<PlanEntry>) -> Option<Detour> {
        let detour = *found.detour?;
        let is_same_airspace = Arc::ptr_eq(&found.airspace, &self.next.airspace);
        let has_way = !detour.way().nodes.is_empty();
        if !Arc::ptr_eq(&detour.plan, plan) || !(is_same_airspace || has_way) {
            return None;
        }
        if is_same_airspace && self.occupied_since.is_empty() {
            return Some(detour);
        }
        if planted::is(Bug::ClosedBetween) {
            return Some(detour);
        }
        let (request, answer) = (&detour.request, &detour.answer);
        let known = Known::default();
        let checked = self
            .planner
            .check(self.next.scene(detour.at), request, &known, answer);
        checked.is_ok().then_some(detour)
    }

    /// Whether a version would come too near to what others have taken since the wave began.
    fn meets_newcomers(&self, plan: &PlanEntry, version: &Version) -> bool {
        if !self.planner.minds(Concern::Traffic, Some(version)) {
            return false;
        }
        let scene = self.next.scene(self.now);
        let own = scene.traffic.own_of_plan(plan);
        let is_new = |other: &str| self.occupied_since.contains(other);
        self.planner.meets(scene, own, version, &is_new)
    }

    /// The drone of a plan has been told a way that is still open, and may be about to take it over.
    fn keep_wanted(
        &mut self,
        plan: &Arc<PlanEntry>,
        wanted: &Version,
        affected_by: Vec<String>,
    ) -> Affected {
        let is_as_told = plan.flags.affected && are_same(&plan.affected_by, &affected_by);
        let marked = self.keep_plan(PlanEntry {
            flags: plan.flags.and_affected(),
            affected_by,
            ..(**plan).clone()
        });
        if !is_as_told {
            self.tell(EventKind::PlanAffected, &marked);
        }
        Affected::Kept(wanted.outcome.map_or("composed", Outcome::name))
    }

    /// Tells the drone of a plan what it is to fly instead.
    fn take_detour(
        &mut self,
        plan: &Arc<PlanEntry>,
        (mut detour, may_stay): (Detour, bool),
        version: Option<Version>,
        affected_by: Vec<String>,
        now: Timestamp,
    ) -> Affected {
        let marked = Arc::new(PlanEntry {
            affected_by,
            ..(**plan).clone()
        });
        let may_go_on = may_stay && plan.may_go_on() && !has_reported(plan);
        if detour.outcome() == Outcome::Unaffected && may_go_on {
            // What has closed on its leg lies behind its drone: there is nothing to take over.
            self.stay_on_way(plan);
            self.tell_relieved(plan, &marked.affected_by);
            detour.plan = marked;
            return Affected::Told(Box::new(detour));
        }
        let was_without_way = plan.flags.affected && plan.wanted.is_none();
        let is_as_told = was_without_way && are_same(&plan.affected_by, &marked.affected_by);
        detour.version = version.as_ref().map(|version| version.number);
        let plan = self.replace_wanted(&marked, version);
        let plan = self.contingent_without_way(plan);
        if plan.wanted.is_none() {
            self.alarm_without_way(&plan, now);
            self.time_way(&plan, now);
        }
        match plan.wanted {
            Some(_) => self.tell(EventKind::PlanAffected, &plan),
            None if is_as_told => {}
            None => self.tell_without_way(&plan, Some(&detour)),
        }
        detour.plan = plan;
        Affected::Told(Box::new(detour))
    }

    /// Looks at a plan without a way again after a while, where it may have one though nothing has opened.
    pub(super) fn time_way(&mut self, plan: &PlanEntry, now: Timestamp) {
        if self.planner.minds(Concern::Traffic, Some(&plan.reported))
            && let Ok(again) = now.checked_add(WAY_AGAIN)
        {
            self.time_look(&plan.id, again);
        }
    }

    /// Looks at a plan at an instant, unless that is to happen before.
    pub(super) fn time_look(&mut self, plan: &Arc<str>, at: Timestamp) {
        let known = self.timed_looks.get(plan);
        if known.is_none_or(|known| at < *known) {
            self.timed_looks.insert(plan.clone(), at);
            self.timers.set(at, Due::Way(plan.clone()));
        }
    }

    /// The time has come to look at a plan again; at its arrival, where that is yet to come, once more.
    pub(super) fn look_for_way(&mut self, plan: Arc<str>, now: Timestamp) {
        if self.timed_looks.get(&plan).is_some_and(|at| *at <= now) {
            self.timed_looks.remove(&plan);
        }
        let entry = self.next.plans.get(&plan).cloned();
        if let Some(entry) = entry.filter(|it| it.is_active() && now < it.reported.arrives_at()) {
            self.time_way_on(&entry);
        }
        self.touched_plans.insert(plan);
    }

    /// What detours are worked out with.
    pub(super) fn means<'a>(
        &'a self,
        airspace: &'a Arc<Airspace>,
        now: Timestamp,
    ) -> DetourMeans<'a> {
        DetourMeans {
            scene: self.next.scene_in(airspace, now),
            planner: &*self.planner,
            drones: &self.drones,
        }
    }

    /// The version that a detour makes, with its contingencies; `None` where there is no way.
    pub(super) fn version_of(
        &self,
        detour: &Detour,
        airspace: &Arc<Airspace>,
        now: Timestamp,
    ) -> Option<Version> {
        let (plan, answer) = (&detour.plan, &detour.answer);
        let scene = self.next.scene_in(airspace, now);
        let course =
            self.planner
                .course(scene, plan, (Occasion::Change, &detour.request), answer)?;
        let sent = Sent {
            number: plan.next_version.fetch_add(1, Ordering::Relaxed),
            epoch: self.next.epoch,
            at: now,
            acknowledge_by: now.checked_add(self.settings.acknowledge_within).ok(),
        };
        let made = Version::of(course, answer.told(), airspace.topology(), sent);
        Some(Version {
            // What its drone has reported goes on to count.
            recomposition_id: plan
                .wanted
                .as_ref()
                .and_then(|before| before.recomposition_id.clone()),
            // What is to be taken over is another way than the one that is flown.
            outcome: made.outcome.map(|outcome| match outcome {
                Outcome::Unaffected => Outcome::Rerouted,
                other => other,
            }),
            ..made
        })
    }

    /// A plan whose way is open again keeps it; what its drone itself has reported stays failed. Tells whether it is.
    pub(super) fn relieve(
        &mut self,
        plan: &Arc<PlanEntry>,
        airspace: &Arc<Airspace>,
        now: Timestamp,
    ) -> bool {
        if has_reported(plan) || !plan.may_go_on() {
            return false;
        }
        let progress = progress::progress(airspace.topology(), plan, &self.drones, now);
        let means = self.means(airspace, now);
        let by = |progress| fleet::obstructed(plan, &progress, &means).by;
        let blocked = progress.and_then(by).is_some();
        // One that may yet be flying what was withdrawn is not told to forget what it was told instead.
        let is_closed = |version: &Arc<Version>| {
            let ahead = progress::whole(version);
            let by = self.planner.obstruction(means.scene, plan, version, ahead);
            by.is_some()
        };
        if blocked || plan.sent.iter().any(is_closed) {
            return false;
        }
        let relieved = self.stay_on_way(plan);
        self.tell_relieved(&relieved, &plan.affected_by);
        true
    }

    /// The drone of a plan flies on as it reported.
    fn stay_on_way(&mut self, plan: &Arc<PlanEntry>) -> Arc<PlanEntry> {
        let withdrawn = self.withdraw_wanted(plan);
        self.end_plan_alarms(&plan.id, &AFTER_RELIEF);
        self.keep_plan(withdrawn.with(|plan| {
            // Of one that is silent nothing is heard all the same.
            if plan.state == PlanState::Contingent && !plan.flags.silent {
                plan.state = PlanState::Activated;
            }
            plan.flags.affected = false;
            plan.flags.unacknowledged = false;
            plan.affected_by.clear();
            plan.declined = 0;
        }))
    }
}

/// Whether what the drone of a plan is to fly comes from a report of its own, which goes on to count.
fn has_reported(plan: &PlanEntry) -> bool {
    let wanted = plan.wanted.as_ref();
    wanted.is_some_and(|wanted| wanted.recomposition_id.is_some())
}

/// Whether the drone of a plan stands where its version ends without a way on, and another one leads no further.
fn leads_no_further(plan: &PlanEntry, version: &Version) -> bool {
    let ends_there = plan.reported.ends_at_stop() && version.ends_at_stop();
    let waits_on = plan.waits_at().is_some() && version.composition.legs.is_empty();
    (ends_there || waits_on) && version.last_node() == plan.reported.last_node()
}

/// Whether two lists name the same closures: the nearest come first, and which these are changes as a drone flies on.
fn are_same(one: &[String], other: &[String]) -> bool {
    let one: BTreeSet<&String> = one.iter().collect();
    one == other.iter().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn closures_are_the_same_in_whatever_order() {
        let named = |ids: &[&str]| ids.iter().map(|id| (*id).to_owned()).collect::<Vec<_>>();
        let before = named(&["a", "b", "c"]);
        assert!(are_same(&before, &named(&["a", "c", "b"])));
        assert!(!are_same(&before, &named(&["a", "c"])));
        assert!(!are_same(&before, &named(&["a", "c", "d"])));
    }
}
