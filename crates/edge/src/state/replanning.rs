//! After something has changed and is in force: which plans it meets, and what their drones are told, a few at a time.
//!
//! What closes is enforced before any plan is looked at. The plans that it meets are then found by the segments, nodes and
//! pads that they take, shown as affected, and queued; between slices of the queue new orders are carried out.

use super::State;
use super::affected::{Affected, Found};
use crate::background::give_way;
use crate::drones::progress::{self, Progress};
use crate::planner::Concern;
use crate::plans::entry::PlanEntry;
use crate::plans::fleet::Detour;
use crate::replanning::waves::{CONTINGENCIES_AT_ONCE, Finding, Job, Means, WAVE_SIZE, Wave};
use crate::replanning::{Causes, Look, Place, Tally, Task, Turn};
use crate::snapshot::Snapshot;
use jiff::Timestamp;
use serde_json::json;
use skyway_contract::{EventKind, PlanState};
use skyway_engine::airspace::{Airspace, Closure};
use skyway_engine::network::SegmentIx;
use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// A plan whose findings have been overtaken so often is looked at alone, while the next wave waits.
const LOST_MAX: u8 = 3;

impl Snapshot {
    /// The plans that take any of what a closure closes, by their ids.
    fn plans_on(&self, closure: &Closure) -> BTreeSet<Arc<str>> {
        let topology = self.topology();
        let nodes = closure.hits.nodes.iter();
        let around = nodes.flat_map(|&node| topology.arcs(node).iter().map(|arc| arc.segment));
        let segments: BTreeSet<SegmentIx> = closure
            .hits
            .segments
            .iter()
            .copied()
            .chain(around)
            .collect();
        let mut plans = BTreeSet::new();
        for segment in segments {
            let there = self.traffic().on(segment).iter();
            plans.extend(there.map(|leg| leg.plan.id().clone()));
        }
        for &node in &closure.pads {
            let there = self.traffic().stays_at(node).iter();
            plans.extend(there.map(|stay| stay.plan.clone()));
        }
        plans
    }

    /// Whether something that has closed meets a plan, whether its drone has been answered or not.
    pub(crate) fn is_affected(&self, plan: &PlanEntry) -> bool {
        plan.flags.affected || self.pending.contains_key(&plan.id) || !self.shut(plan).is_empty()
    }

    /// The closures on the way of a quote: it is in no index, and no drone is told.
    pub(crate) fn shut(&self, plan: &PlanEntry) -> Vec<&str> {
        let way = &plan.reported.composition;
        let is_shut = || progress::is_blocked(&self.airspace, way, 0);
        if !plan.is_quote() || !plan.is_active() || !is_shut() {
            return Vec::new();
        }
        let met = self.airspace.in_force();
        let met = met.filter(|closure| progress::is_hit(closure, way, 0));
        met.map(|closure| closure.id.as_str()).collect()
    }

    /// The closures that affect a plan, those included whose answer is pending.
    pub(crate) fn affecting<'a>(&'a self, plan: &'a PlanEntry) -> impl Iterator<Item = &'a str> {
        let known: BTreeSet<&str> = plan.affected_by.iter().map(String::as_str).collect();
        let pending = self.pending.get(&plan.id).into_iter();
        let pending = pending.flat_map(|causes| causes.iter().map(|cause| &**cause));
        let pending = pending.filter(move |cause| !known.contains(cause));
        plan.affected_by.iter().map(String::as_str).chain(pending)
    }
}

impl State {
    /// Whether any plan waits for its answer, or for its contingencies.
    pub(crate) fn has_waiting(&self) -> bool {
        !self.queue.is_empty() || !self.lacking_contingencies.is_empty()
    }

    /// Whether all plans that wait are in the next wave.
    pub(crate) fn fits_next_wave(&self) -> bool {
        self.queue.len() <= WAVE_SIZE
    }

    /// Finds the plans that something new meets and those that may be free again, and queues them. Nothing is
    /// recomposed yet. Tells whether plans wait now that did not before.
    pub(crate) fn look_up(&mut self, look: &Look, now: Timestamp) -> bool {
        let before = self.queue.len();
        let airspace = self.next.airspace.clone();
        for id in std::mem::take(&mut self.touched_plans) {
            self.look_at_touched(&id, &airspace, now);
        }
        let mut met: BTreeMap<Arc<str>, Vec<(Arc<str>, &Closure)>> = BTreeMap::new();
        for closure in look.in_force.iter().chain(&look.announced) {
            let id: Arc<str> = Arc::from(&*closure.id);
            let off_network = self.off_network.iter().cloned();
            let plans = self.next.plans_on(closure).into_iter().chain(off_network);
            for plan in plans.collect::<BTreeSet<_>>() {
                met.entry(plan).or_default().push((id.clone(), closure));
            }
        }
        for (id, closures) in met {
            self.look_at_met(&id, &closures, &airspace, now);
            give_way();
        }
        if look.has_opened || look.announcements || look.has_turned_wind {
            self.look_at_others(look);
        }
        self.queue.len() > before
    }

    /// A plan that is new, or whose drone flies something else now, was made on an earlier state, perhaps.
    fn look_at_touched(&mut self, id: &str, airspace: &Arc<Airspace>, now: Timestamp) {
        let Some((plan, progress)) = self.ahead_of(id, airspace, now) else {
            return;
        };
        let has_no_answer = plan.flags.affected && plan.wanted.is_none();
        if has_no_answer || self.is_cut(&plan, &progress, airspace, now) {
            self.queue_plan(&plan, progress.leg, Some(&progress), Causes::default(), now);
            self.show_pending(&plan.id, &Causes::default());
        }
    }

    /// An active plan, and how far its drone is. One that waits has nothing ahead of it but what it is to fly from there.
    fn ahead_of(
        &self,
        id: &str,
        airspace: &Airspace,
        now: Timestamp,
    ) -> Option<(Arc<PlanEntry>, Progress)> {
        let plan = self.next.plans.get(id).filter(|plan| plan.is_active())?;
        let topology = airspace.topology();
        let progress = progress::progress_or_wait(topology, plan, &self.drones, now)?;
        Some((plan.clone(), progress))
    }

    /// A plan that takes something of what has closed: whether that is ahead of its drone, and so whether it is affected.
    fn look_at_met(
        &mut self,
        id: &str,
        closures: &[(Arc<str>, &Closure)],
        airspace: &Arc<Airspace>,
        now: Timestamp,
    ) {
        let Some((plan, progress)) = self.ahead_of(id, airspace, now) else {
            return;
        };
        let mut nearest: Option<usize> = None;
        let mut causes = BTreeSet::new();
        for (id, closure) in closures {
            let scene = self.next.scene_in(airspace, now);
            let ahead = progress::ahead(&plan, &progress);
            let planner = &self.planner;
            let reported = planner.first_met(scene, &plan.reported, ahead, closure);
            let to_fly = plan.to_fly().filter_map(|version| {
                planner.first_met(scene, version, progress::whole(version), closure)
            });
            let wanted = to_fly.min();
            // What is only to be flown begins where its drone is.
            let wanted = wanted.map(|leg| progress.leg + leg);
            if let Some(leg) = [reported, wanted].into_iter().flatten().min() {
                nearest = Some(nearest.map_or(leg, |known| known.min(leg)));
                causes.insert(id.clone());
            }
        }
        if let Some(leg) = nearest {
            let causes = Arc::new(causes);
            self.queue_plan(&plan, leg, Some(&progress), causes.clone(), now);
            self.show_pending(&plan.id, &causes);
        }
    }

    /// Plans that may be free again, and those that the wind may leave short.
    fn look_at_others(&mut self, look: &Look) {
        let plans = self.next.plans.values();
        // A quote is led around nothing.
        let is_flown = |plan: &&Arc<PlanEntry>| plan.is_active() && !plan.is_quote();
        let active: Vec<Arc<PlanEntry>> = plans.filter(is_flown).cloned().collect();
        for plan in active {
            let minds = |concern| self.planner.minds(concern, Some(&plan.reported));
            let minds_announced = look.announcements && minds(Concern::Announced);
            let may_be_free = look.has_opened || minds_announced;
            let has_no_way = plan.flags.affected && plan.wanted.is_none();
            let may_fall_short = look.has_turned_wind && minds(Concern::Wind);
            let turn = match (may_fall_short, plan.flags.affected) {
                (true, _) => turn_of(&plan),
                // There may be a way now, be it not the one that it flies.
                (false, true) if may_be_free && has_no_way => turn_of(&plan),
                (false, true) if may_be_free => Turn::MayBeFree,
                _ => continue,
            };
            self.queue.add(Task {
                place: Place {
                    turn,
                    left_s: i64::MAX,
                    ..place_of(&plan)
                },
                causes: Causes::default(),
                lost: 0,
            });
        }
    }

    fn queue_plan(
        &mut self,
        plan: &PlanEntry,
        leg: usize,
        progress: Option<&Progress>,
        causes: Causes,
        now: Timestamp,
    ) {
        let left_s = progress.map_or(0.0, |progress| time_left_s(plan, progress, leg, now));
        let new = self.queue.add(Task {
            place: Place {
                left_s: left_s as i64,
                ..place_of(plan)
            },
            causes,
            lost: 0,
        });
        for cause in new {
            let tally = self.tallies.entry(cause).or_default();
            tally.plan_count += 1;
            tally.left += 1;
        }
    }

    /// The plans that are looked at next, on a state: those that something new meets, and only then those that lack
    /// contingencies. `None` where no plan waits.
    pub(crate) fn next_wave(&mut self, snapshot: Arc<Snapshot>, now: Timestamp) -> Option<Wave> {
        let queue = &mut self.queue;
        let tasks = std::iter::from_fn(|| queue.pop());
        let mut jobs: Vec<Job> = tasks.take(WAVE_SIZE).map(Job::Replan).collect();
        if jobs.is_empty() {
            let lacking = &mut self.lacking_contingencies;
            let plans = std::iter::from_fn(|| lacking.pop_first());
            let plans = plans.take(CONTINGENCIES_AT_ONCE);
            jobs = plans.map(Job::Contingencies).collect();
        }
        self.occupied_since.clear();
        (!jobs.is_empty()).then(|| Wave::new(snapshot, now, jobs))
    }

    /// What waves are worked on with.
    pub(crate) fn means_of_waves(&self) -> Means {
        Means {
            planner: self.planner.clone(),
            drones: self.drones.clone(),
        }
    }

    /// A wave on this thread, with all that comes of it. Gives what drones are told.
    pub(crate) fn replan(&mut self, now: Timestamp, told: &mut dyn FnMut()) -> Vec<Detour> {
        let mut detours = Vec::new();
        let Some(wave) = self.next_wave(Arc::new(self.next.clone()), now) else {
            return detours;
        };
        wave.work(&self.means_of_waves());
        for number in 0..wave.jobs().len() {
            self.commit(&wave, number, now, &mut detours);
            told();
        }
        detours
    }

    /// Commits what a wave has found for one of its plans.
    pub(crate) fn commit(
        &mut self,
        wave: &Wave,
        number: usize,
        now: Timestamp,
        detours: &mut Vec<Detour>,
    ) {
        let found = wave.take(number);
        match (wave.jobs().get(number), found) {
            (Some(Job::Replan(task)), found) => {
                let detour = match found {
                    Some(Finding::Detour(detour)) => Some(detour),
                    _ => None,
                };
                let airspace = wave.snapshot.airspace.clone();
                let found = (task.lost < LOST_MAX).then_some(Found { detour, airspace });
                self.carry_out_task(task, found, now, detours);
            }
            (Some(Job::Contingencies(plan)), Some(Finding::Contingencies(versions))) => {
                self.take_contingencies(plan, versions, &wave.snapshot.airspace);
            }
            (Some(Job::Contingencies(plan)), None) => {
                tracing::error!(%plan, "the contingencies of a plan could not be worked out");
            }
            _ => {}
        }
    }

    /// Answers the drone of one plan.
    fn carry_out_task(
        &mut self,
        task: &Task,
        found: Option<Found>,
        now: Timestamp,
        detours: &mut Vec<Detour>,
    ) {
        let airspace = &self.next.airspace.clone();
        let shown = self.hide_pending(&task.place.plan);
        let plan = self.next.plans.get(&task.place.plan).cloned();
        let Some(plan) = plan.filter(|plan| plan.is_active()) else {
            self.settle(&*task.causes, "ended");
            return;
        };
        let affected = match task.may_be_cut() {
            true => self.affect(&plan, airspace, (&task.causes, found), now),
            false => Affected::Not,
        };
        let is_clear = task.may_be_cut() && matches!(affected, Affected::Not);
        let mut told_of = Vec::new();
        let outcome = match affected {
            Affected::Not => {
                if plan.flags.affected && self.relieve(&plan, airspace, now) {
                    told_of.clone_from(&plan.affected_by);
                } else if task.may_be_cut() && shown.is_some() && !plan.flags.affected {
                    told_of = task.causes.iter().map(|cause| cause.to_string()).collect();
                    self.tell_relieved(&plan, &told_of);
                }
                "unaffected"
            }
            Affected::Kept(outcome) => outcome,
            Affected::Told(detour) => {
                let outcome = detour.outcome().name();
                told_of.clone_from(&detour.plan.affected_by);
                detours.push(*detour);
                outcome
            }
            Affected::Overtaken => {
                self.queue_again(task, shown);
                return;
            }
        };
        // What the drone is told names the closures that are in its way: others of its task have not met it after all.
        let told = self.next.plans.get(&task.place.plan);
        let named: BTreeSet<&str> = told
            .into_iter()
            .flat_map(|plan| plan.affected_by.iter().map(String::as_str))
            .collect();
        let (named, not_met): (Vec<&Arc<str>>, Vec<&Arc<str>>) = task
            .causes
            .iter()
            .partition(|cause| named.contains(&***cause));
        self.settle(named, outcome);
        self.settle(not_met.iter().copied(), "unaffected");
        let told_of: BTreeSet<&str> = told_of.iter().map(String::as_str).collect();
        let passed = not_met.iter().filter(|cause| !told_of.contains(&****cause));
        let passed: Vec<String> = passed.map(|cause| cause.to_string()).collect();
        self.tell_passed(&plan.id, &passed);
        if shown.is_some() && !is_clear {
            self.show_queued(&plan.id);
        }
    }

    /// What has met a plan since its wave began is looked at in a later one.
    fn show_queued(&mut self, plan: &Arc<str>) {
        let task = self.queue.task(plan).filter(|task| task.may_be_cut());
        if let Some(causes) = task.map(|task| task.causes.clone()) {
            self.show_pending(plan, &causes);
        }
    }

    /// Shows a plan as affected by closures before its drone is answered.
    fn show_pending(&mut self, plan: &Arc<str>, causes: &Causes) {
        let shown = self.next.pending.entry(plan.clone()).or_default();
        let new: Vec<Arc<str>> = causes.difference(shown).cloned().collect();
        for cause in &new {
            *self.pending_counts.entry(cause.clone()).or_default() += 1;
        }
        if !new.is_empty() {
            Arc::make_mut(shown).extend(new);
        }
    }

    /// A plan's drone is answered, or queued again. Gives what was shown.
    fn hide_pending(&mut self, plan: &Arc<str>) -> Option<Causes> {
        let shown = self.next.pending.remove(plan)?;
        for cause in &*shown {
            let Some(count) = self.pending_counts.get_mut(cause) else {
                continue;
            };
            *count -= 1;
            if *count == 0 {
                self.pending_counts.remove(cause);
            }
        }
        Some(shown)
    }

    /// Queues a plan again whose finding was overtaken; it stays shown as it was.
    fn queue_again(&mut self, task: &Task, shown: Option<Causes>) {
        if let Some(shown) = shown {
            self.show_pending(&task.place.plan, &shown);
        }
        let new = self.queue.add(Task {
            lost: task.lost + 1,
            ..task.clone()
        });
        // A cause for which the plan was queued meanwhile is answered once.
        let causes = task.causes.iter();
        for cause in causes.filter(|cause| new.binary_search(cause).is_err()) {
            if let Some(tally) = self.tallies.get_mut(cause) {
                tally.plan_count = tally.plan_count.saturating_sub(1);
                tally.left = tally.left.saturating_sub(1);
            }
        }
    }

    /// Counts an answer for the closures that asked for it, and tells when all have theirs.
    fn settle<'a>(
        &mut self,
        causes: impl IntoIterator<Item = &'a Arc<str>>,
        outcome: &'static str,
    ) {
        for cause in causes {
            let Some(tally) = self.tallies.get_mut(cause) else {
                continue;
            };
            *tally.outcomes.entry(outcome).or_default() += 1;
            tally.left = tally.left.saturating_sub(1);
            if tally.left > 0 {
                continue;
            }
            if let Some(Tally {
                plan_count,
                outcomes,
                ..
            }) = self.tallies.remove(cause)
            {
                let data = json!({
                    "closure_id": &**cause,
                    "plan_count": plan_count,
                    "outcomes": outcomes,
                });
                self.happen(EventKind::Replanned, data);
            }
        }
    }
}

/// The place of a plan whose drone is at what has closed.
fn place_of(plan: &PlanEntry) -> Place {
    Place {
        turn: turn_of(plan),
        left_s: 0,
        priority: Reverse(plan.priority),
        departs_at: plan.reported.departs_at,
        plan: plan.id.clone(),
    }
}

fn turn_of(plan: &PlanEntry) -> Turn {
    match plan.state {
        PlanState::Accepted => Turn::OnTheGround,
        _ => Turn::InTheAir,
    }
}

/// How long a drone takes to the leg of its plan that has closed, in seconds.
fn time_left_s(plan: &PlanEntry, progress: &Progress, leg: usize, now: Timestamp) -> f64 {
    let legs = &plan.reported.composition.legs;
    let before = legs
        .get(progress.leg..leg.min(legs.len()))
        .unwrap_or_default();
    let between_m: f64 = before.iter().map(|leg| leg.length_m).sum();
    let after: f64 = legs[progress.leg..].iter().map(|leg| leg.length_m).sum();
    let flown_m = (after - progress.remaining_m).max(0.0);
    let waits_s = plan.reported.departs_at.duration_since(now).as_secs_f64();
    if let Some(flown) = plan.reported.flight.as_deref() {
        // Stays on pads are in its times.
        let flight = &flown.composition.plan;
        let entered = flight.legs.get(leg).map(|leg| leg.enters_s);
        return (waits_s + entered.unwrap_or(flight.arrives_s)).max(0.0);
    }
    let left_m = (between_m - flown_m).max(0.0);
    waits_s.max(0.0) + left_m / plan.airspeed_mps.max(0.1)
}
