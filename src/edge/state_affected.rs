//! What closures and the wind do to plans: who is affected, what their drones are to fly instead, and who is free again.

use super::failures::as_reported;
use super::fleet::{self, Detour, DetourAnswer, DetourMeans};
use super::flights::Scene;
use super::snapshot::{PlanEntry, PlanFlags, Version};
use super::state::State;
use super::state_alarms::AFTER_RELIEF;
use crate::airspace::{Airspace, Closure};
use crate::compose::equip;
use crate::recompose::{Outcome, Recomposition, Request, World};
use crate::wire::{EventKind, PlanState};
use jiff::Timestamp;
use std::sync::Arc;
use std::sync::atomic::Ordering;

/// At most this many plans are recomposed in flight before what a batch has changed is in force.
const RECOMPOSED_MAX: usize = 16;

/// Closures that plans have not been held against.
#[derive(Debug, Default)]
pub(super) struct Fresh {
    /// Those that count now and did not before, or do so in another form.
    pub(super) in_force: Vec<Arc<Closure>>,
    /// Those that were put and do not count yet: only plans whose times are computed are held against them.
    pub(super) announced: Vec<Arc<Closure>>,
    /// Whether the wind has changed, which may leave any plan short that is flown.
    pub(super) has_turned_wind: bool,
}

impl State {
    /// Looks over the plans that something new meets, and those that may be open again.
    ///
    /// Gives what the drones of the plans that are affected now are told.
    pub(super) fn review_plans(
        &mut self,
        before: &Arc<Airspace>,
        fresh: &Fresh,
        now: Timestamp,
    ) -> Vec<Detour> {
        let after = self.next.airspace.clone();
        let touched = std::mem::take(&mut self.touched_plans);
        self.recomposed = 0;
        let has_opened = after.opened_at() != before.opened_at();
        // What was only announced may be lifted, too.
        let may_fly = self.flights.is_some() && after.revision() != before.revision();
        if fresh.in_force.is_empty() && touched.is_empty() && !has_opened && !may_fly {
            return Vec::new();
        }
        let plans = self.next.plans.values();
        let active: Vec<Arc<PlanEntry>> = plans.filter(|plan| plan.is_active()).cloned().collect();
        let mut detours = Vec::new();
        for plan in active {
            let is_flown = plan.reported.flight.is_some() && self.flights.is_some();
            let announced = fresh.announced.iter().filter(|_| is_flown);
            let mut counting = fresh.in_force.iter().chain(announced);
            let is_hit =
                touched.contains(&plan.id) || counting.any(|closure| meets(&plan, closure));
            let may_be_free = has_opened || (may_fly && is_flown);
            if !is_hit && may_be_free && plan.flags.affected {
                let is_free = self.relieve(&plan, &after, now);
                if is_free {
                    continue;
                }
            }
            if is_hit || (fresh.has_turned_wind && is_flown) {
                detours.extend(self.affect(&plan, &after, fresh, now));
            }
        }
        detours
    }

    /// What closes a version of a plan from a leg on: ids, as far as they are told by times, and none where it is the wind;
    /// `None` where nothing does.
    fn obstruction(
        &self,
        plan: &PlanEntry,
        version: &Version,
        from_leg: usize,
        airspace: &Arc<Airspace>,
        now: Timestamp,
    ) -> Option<Vec<String>> {
        let Some((flights, flown)) = self.flights.as_deref().zip(version.flight.as_deref()) else {
            let is_blocked = fleet::is_blocked(airspace, &version.composition, from_leg);
            return is_blocked.then(Vec::new);
        };
        let scene = Scene {
            snapshot: &self.next,
            airspace,
            now,
        };
        let ids = flights.closures_met(scene, plan, (version, flown), from_leg);
        let is_cut =
            !ids.is_empty() || flights.falls_short(scene, plan, (version, flown), from_leg);
        is_cut.then_some(ids)
    }

    /// Marks a plan affected where something ahead of its drone is closed, with what it is to fly instead.
    fn affect(
        &mut self,
        plan: &Arc<PlanEntry>,
        airspace: &Arc<Airspace>,
        fresh: &Fresh,
        now: Timestamp,
    ) -> Option<Detour> {
        let topology = airspace.topology();
        let progress = fleet::progress(topology, plan, &self.drones, now)?;
        let obstruction = self.obstruction(plan, &plan.reported, progress.leg, airspace, now);
        let current_blocked = plan.falls_short() || obstruction.is_some();
        let proposal_blocked = plan
            .wanted
            .as_ref()
            .is_some_and(|proposed| self.obstruction(plan, proposed, 0, airspace, now).is_some());
        if !current_blocked && !proposal_blocked {
            return None;
        }
        if !current_blocked && plan.is_as_planned() {
            self.withdraw_wanted(plan);
            return None;
        }
        let affected_by = match plan.reported.flight {
            Some(_) if self.flights.is_some() => obstruction.unwrap_or_default(),
            _ => affecting(plan, airspace, &fresh.in_force, progress.leg),
        };
        if plan.wanted.is_some() && !proposal_blocked {
            // Its drone has been told a way that is still open, and may be about to take it over.
            let marked = PlanEntry {
                flags: plan.flags.and_affected(),
                affected_by,
                ..(**plan).clone()
            };
            self.keep_plan(marked);
            return None;
        }
        if plan.reported.flight.is_some() && self.flights.is_some() {
            if self.recomposed >= RECOMPOSED_MAX {
                self.put_off(plan, affected_by);
                return None;
            }
            self.recomposed += 1;
        }
        let means = DetourMeans {
            snapshot: &self.next,
            airspace,
            trees: Some(&self.trees),
            drones: &self.drones,
            flights: self.flights.as_deref(),
            now,
        };
        let detour = fleet::detour(plan, &progress, &means, &mut self.scratch);
        let mut detour = self.checked(detour, airspace, now);
        let version = self.version_of(&detour, airspace, now);
        detour.version = version.as_ref().map(|version| version.number);
        let marked = Arc::new(PlanEntry {
            affected_by,
            ..(**plan).clone()
        });
        let plan = self.replace_wanted(&marked, version);
        let plan = self.contingent_without_way(plan);
        self.tell(EventKind::PlanAffected, &plan);
        if plan.wanted.is_none() {
            self.alarm_without_way(&plan, now);
        }
        detour.plan = plan;
        Some(detour)
    }

    /// Marks a plan affected now, and leaves what it is to fly instead to the next batch: what closes is in force before all
    /// drones have been answered.
    fn put_off(&mut self, plan: &Arc<PlanEntry>, affected_by: Vec<String>) {
        self.touched_plans.insert(plan.id.clone());
        let is_told = plan.flags.affected && plan.affected_by == affected_by;
        if is_told && plan.wanted.is_none() {
            return;
        }
        let marked = Arc::new(PlanEntry {
            affected_by,
            ..(**plan).clone()
        });
        let plan = self.replace_wanted(&marked, None);
        self.tell(EventKind::PlanAffected, &plan);
    }

    /// The version that a detour makes, with its contingencies; `None` where there is no way.
    pub(super) fn version_of(
        &mut self,
        detour: &Detour,
        airspace: &Airspace,
        now: Timestamp,
    ) -> Option<Version> {
        let plan = &detour.plan;
        let made = match &detour.answer {
            DetourAnswer::Shortest { request, answer } => {
                self.shortest_version(plan, request, answer, airspace, now)?
            }
            DetourAnswer::Flown(answer) => answer.version_without_number()?,
        };
        Some(Version {
            number: plan.next_version.fetch_add(1, Ordering::Relaxed),
            // What its drone has reported goes on to count.
            recomposition_id: plan
                .wanted
                .as_ref()
                .and_then(|before| before.recomposition_id.clone()),
            acknowledge_by: now.checked_add(self.settings.acknowledge_within).ok(),
            ..made
        })
    }

    /// A version by distance, with its contingencies, but for its number.
    fn shortest_version(
        &mut self,
        plan: &PlanEntry,
        request: &Request,
        answer: &Recomposition,
        airspace: &Airspace,
        now: Timestamp,
    ) -> Option<Version> {
        let destination = match answer.outcome {
            Outcome::NoRoute => return None,
            Outcome::Diverted => *answer.path.nodes.last()?,
            Outcome::Rerouted | Outcome::Unaffected | Outcome::Hold => plan.destination,
        };
        // What its drone has reported stays closed in its contingencies too.
        let closes_leg = request.report.failure.closes_leg();
        let imagined = closes_leg.then(|| as_reported(airspace, request, now));
        // Tables know worlds by their numbers, which that of an imagined one may be too.
        let is_real = std::ptr::eq(airspace, &*self.next.airspace);
        let world = match &imagined {
            Some(airspace) => World {
                airspace,
                trees: None,
            },
            None => World {
                airspace,
                trees: is_real.then_some(&*self.trees),
            },
        };
        let composition = equip(
            &world,
            answer.path.clone(),
            answer.first_stretch_m,
            destination,
            plan.airspeed_mps,
            &mut self.scratch,
        );
        let topology = airspace.topology();
        let warnings = answer.warnings.iter();
        Some(Version {
            number: 0,
            epoch: self.next.epoch,
            sent_at: now,
            outcome: Some(answer.outcome),
            composition,
            flight: None,
            first_stretch_m: answer.first_stretch_m,
            departs_at: now,
            recomposition_id: None,
            acknowledge_by: None,
            warnings: warnings
                .map(|warning| {
                    let (code, message) = crate::formats::warning_text(topology, warning);
                    (code.into(), message)
                })
                .collect(),
        })
    }

    /// A plan whose way is open again keeps it; what its drone itself has reported stays failed. Tells whether it is.
    fn relieve(&mut self, plan: &Arc<PlanEntry>, airspace: &Arc<Airspace>, now: Timestamp) -> bool {
        let reported = plan
            .wanted
            .as_ref()
            .is_some_and(|proposed| proposed.recomposition_id.is_some());
        if reported || !plan.may_go_on() {
            return false;
        }
        let progress = fleet::progress(airspace.topology(), plan, &self.drones, now);
        let blocked = progress.is_some_and(|progress| {
            let obstruction = self.obstruction(plan, &plan.reported, progress.leg, airspace, now);
            obstruction.is_some()
        });
        if blocked {
            return false;
        }
        let withdrawn = self.withdraw_wanted(plan);
        let relieved = PlanEntry {
            state: match plan.state {
                PlanState::Contingent => PlanState::Activated,
                state => state,
            },
            flags: PlanFlags {
                affected: false,
                unacknowledged: false,
                ..plan.flags
            },
            affected_by: Vec::new(),
            ..(*withdrawn).clone()
        };
        self.end_plan_alarms(&plan.id, &AFTER_RELIEF);
        let plan = self.keep_plan(relieved);
        self.tell(EventKind::PlanRelieved, &plan);
        true
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
        if fleet::is_hit(closure, &plan.reported.composition, from_leg)
            && !ids.contains(&closure.id)
        {
            ids.push(closure.id.clone());
        }
    }
    ids
}

/// Whether a closure closes anything of what a plan flies or is to fly; how far its drone has come is looked at later.
fn meets(plan: &PlanEntry, closure: &Closure) -> bool {
    let mut versions = std::iter::once(&plan.reported).chain(&plan.wanted);
    versions.any(|version| {
        let flown = version.flight.as_deref();
        let takes_pads = flown.is_some_and(|flown| {
            let mut stops = flown.stop_nodes();
            stops.any(|node| closure.pads.contains(&node))
        });
        takes_pads || fleet::is_hit(closure, &version.composition, 0)
    })
}
