//! After something has changed and is in force: which plans it meets, and what their drones are told, a few at a time.
//!
//! What closes is enforced before any plan is looked at. The plans that it meets are then found by the segments, nodes and
//! pads that they take, shown as affected, and queued; between slices of the queue new orders are carried out.

use super::events::Happening;
use super::fleet::Detour;
use super::plan_entry::PlanEntry;
use super::planner::Concern;
use super::progress::{self, Progress};
use super::replanning::Look;
use super::replanning::{Place, Task, Turn, Wave};
use super::snapshot::Snapshot;
use super::state::State;
use super::state_affected::Affected;
use crate::airspace::{Airspace, Closure};
use crate::network::SegmentIx;
use crate::wire::{EventKind, PlanState};
use jiff::Timestamp;
use serde_json::json;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// How much is done in a slice of the queue, in looks at a plan.
const SLICE: usize = 1_024;
/// What a recomposition costs, in looks.
const RECOMPOSED_COST: usize = 16;
/// And one that avoids other plans.
const COST_AMONG_TRAFFIC: usize = 64;

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
            plans.extend(there.map(|leg| leg.plan.clone()));
        }
        for &node in &closure.pads {
            let there = self.traffic().stays_at(node).iter();
            plans.extend(there.map(|stay| stay.plan.clone()));
        }
        plans
    }

    /// Whether something that has closed meets a plan, whether its drone has been answered or not.
    pub(super) fn is_affected(&self, plan: &PlanEntry) -> bool {
        plan.flags.affected || self.pending.contains_key(&plan.id) || !self.shut(plan).is_empty()
    }

    /// The closures on the way of a quote: it is in no index, and no drone is told.
    pub(super) fn shut(&self, plan: &PlanEntry) -> Vec<&str> {
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
    pub(super) fn affecting<'a>(&'a self, plan: &'a PlanEntry) -> impl Iterator<Item = &'a String> {
        let pending = self.pending.get(&plan.id).into_iter();
        let pending = pending.flat_map(|causes| causes.iter());
        let is_known = |cause: &&String| !plan.affected_by.contains(cause);
        plan.affected_by.iter().chain(pending.filter(is_known))
    }
}

impl State {
    /// Whether any plan waits for its answer.
    pub(super) fn has_waiting(&self) -> bool {
        !self.queue.is_empty()
    }

    /// Finds the plans that something new meets and those that may be free again, and queues them. Nothing is
    /// recomposed yet.
    pub(super) fn look_up(&mut self, look: &Look, now: Timestamp) {
        let airspace = self.next.airspace.clone();
        for id in std::mem::take(&mut self.touched_plans) {
            self.look_at_touched(&id, &airspace, now);
        }
        let mut met: BTreeMap<Arc<str>, Vec<&Arc<Closure>>> = BTreeMap::new();
        for closure in look.in_force.iter().chain(&look.announced) {
            for plan in self.next.plans_on(closure) {
                met.entry(plan).or_default().push(closure);
            }
        }
        for (id, closures) in met {
            self.look_at_met(&id, &closures, &airspace, now);
        }
        if look.has_opened || look.announcements || look.has_turned_wind {
            self.look_at_others(look);
        }
    }

    /// A plan that is new, or whose drone flies something else now, was made on an earlier state, perhaps.
    fn look_at_touched(&mut self, id: &str, airspace: &Arc<Airspace>, now: Timestamp) {
        let plan = self.next.plans.get(id).cloned();
        let Some(plan) = plan.filter(|plan| plan.is_active()) else {
            return;
        };
        let Some(progress) = progress::progress(airspace.topology(), &plan, &self.drones, now)
        else {
            return;
        };
        let has_no_answer = plan.flags.affected && plan.wanted.is_none();
        if has_no_answer || self.is_cut(&plan, &progress, airspace, now) {
            self.queue_plan(&plan, progress.leg, Some(&progress), Vec::new(), now);
            self.next.pending.entry(plan.id.clone()).or_default();
        }
    }

    /// A plan that takes something of what has closed: whether that is ahead of its drone, and so whether it is affected.
    fn look_at_met(
        &mut self,
        id: &str,
        closures: &[&Arc<Closure>],
        airspace: &Arc<Airspace>,
        now: Timestamp,
    ) {
        let plan = self.next.plans.get(id).cloned();
        let Some(plan) = plan.filter(|plan| plan.is_active()) else {
            return;
        };
        let Some(progress) = progress::progress(airspace.topology(), &plan, &self.drones, now)
        else {
            return;
        };
        let mut nearest: Option<usize> = None;
        let mut causes = Vec::new();
        for closure in closures {
            let scene = self.next.scene_in(airspace, now);
            let ahead = progress::ahead(&plan, &progress);
            let planner = &self.planner;
            let reported = planner.first_met(scene, &plan.reported, ahead, closure);
            let wanted = plan.wanted.as_ref();
            let wanted = wanted.and_then(|wanted| {
                planner.first_met(scene, wanted, progress::whole(wanted), closure)
            });
            // What is only to be flown begins where its drone is.
            let wanted = wanted.map(|leg| progress.leg + leg);
            if let Some(leg) = [reported, wanted].into_iter().flatten().min() {
                nearest = Some(nearest.map_or(leg, |known| known.min(leg)));
                causes.push(closure.id.clone());
            }
        }
        if let Some(leg) = nearest {
            self.queue_plan(&plan, leg, Some(&progress), causes, now);
            let known = self.queue.causes(&plan.id).unwrap_or_default();
            self.next.pending.insert(plan.id.clone(), Arc::from(known));
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
                    left_ms: i64::MAX,
                    departs_at: plan.reported.departs_at,
                    plan: plan.id.clone(),
                },
                causes: Vec::new(),
            });
        }
    }

    fn queue_plan(
        &mut self,
        plan: &PlanEntry,
        leg: usize,
        progress: Option<&Progress>,
        causes: Vec<String>,
        now: Timestamp,
    ) {
        let left_s = progress.map_or(0.0, |progress| time_left_s(plan, progress, leg, now));
        let new = self.queue.add(Task {
            place: Place {
                turn: turn_of(plan),
                left_ms: (left_s * 1e3) as i64,
                departs_at: plan.reported.departs_at,
                plan: plan.id.clone(),
            },
            causes,
        });
        for cause in new {
            let wave = self.waves.entry(cause).or_default();
            wave.plan_count += 1;
            wave.left += 1;
        }
    }

    /// Answers the drones of plans from the queue, as many as a slice has room for or as long as `may_go_on`. Gives what
    /// they are told.
    pub(super) fn replan(
        &mut self,
        now: Timestamp,
        may_go_on: &mut dyn FnMut() -> bool,
    ) -> Vec<Detour> {
        let airspace = self.next.airspace.clone();
        let mut detours = Vec::new();
        let mut room = SLICE;
        while room > 0
            && let Some(task) = self.queue.pop()
        {
            let spent = self.carry_out_task(&task, &airspace, now, &mut detours);
            room = room.saturating_sub(spent);
            if !may_go_on() {
                break;
            }
        }
        detours
    }

    /// Answers the drone of one plan; tells what that cost.
    fn carry_out_task(
        &mut self,
        task: &Task,
        airspace: &Arc<Airspace>,
        now: Timestamp,
        detours: &mut Vec<Detour>,
    ) -> usize {
        let was_shown = self.next.pending.remove(&task.place.plan).is_some();
        let plan = self.next.plans.get(&task.place.plan).cloned();
        let Some(plan) = plan.filter(|plan| plan.is_active()) else {
            self.settle(&task.causes, "ended");
            return 1;
        };
        let affected = match task.may_be_cut() {
            true => self.affect(&plan, airspace, &task.causes, now),
            false => Affected::Not,
        };
        let (outcome, cost) = match affected {
            Affected::Not => {
                let is_told = plan.flags.affected && self.relieve(&plan, airspace, now);
                if !is_told && was_shown && !plan.flags.affected {
                    self.tell_relieved(&plan, &task.causes);
                }
                ("unaffected", 1)
            }
            Affected::Kept(outcome) => (outcome, 1),
            Affected::Told(detour) => {
                let outcome = detour.outcome().name();
                detours.push(*detour);
                let minds_traffic = self.planner.minds(Concern::Traffic, Some(&plan.reported));
                let cost = if minds_traffic {
                    COST_AMONG_TRAFFIC
                } else {
                    RECOMPOSED_COST
                };
                (outcome, cost)
            }
        };
        self.settle(&task.causes, outcome);
        cost
    }

    /// Counts an answer for the closures that asked for it, and tells when all have theirs.
    fn settle(&mut self, causes: &[String], outcome: &'static str) {
        for cause in causes {
            let Some(wave) = self.waves.get_mut(cause) else {
                continue;
            };
            *wave.outcomes.entry(outcome).or_default() += 1;
            wave.left = wave.left.saturating_sub(1);
            if wave.left > 0 {
                continue;
            }
            if let Some(Wave {
                plan_count,
                outcomes,
                ..
            }) = self.waves.remove(cause)
            {
                let data = json!({
                    "closure_id": cause,
                    "plan_count": plan_count,
                    "outcomes": outcomes,
                });
                self.events.push(Happening::new(EventKind::Replanned, data));
            }
        }
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
    let left_m = (between_m - flown_m).max(0.0);
    waits_s.max(0.0) + left_m / plan.airspeed_mps.max(0.1)
}
