//! What closures and the wind do to plans: who is affected, what their drones are to fly instead, and who is free again.

use super::failures::as_reported;
use super::fleet::{self, Detour, DetourAnswer, DetourMeans};
use super::plan_entry::{PlanEntry, PlanFlags};
use super::planner::{Scene, Version, version_flags};
use super::progress::{self, Ahead, Progress};
use super::state::State;
use super::state_alarms::AFTER_RELIEF;
use super::stretches::Stretch;
use crate::airspace::{Airspace, Closure};
use crate::compose::equip;
use crate::recompose::{Outcome, Recomposition, Request, World};
use crate::wire::{EventKind, PlanState};
use jiff::Timestamp;
use std::sync::Arc;
use std::sync::atomic::Ordering;

/// What a change has made, for which plans have to be looked at.
#[derive(Debug, Default)]
pub(super) struct Look {
    /// The closures that count now and did not before, or do so in another form.
    pub(super) in_force: Vec<Arc<Closure>>,
    /// Those that were put and do not count yet: only plans whose times are computed are held against them.
    pub(super) announced: Vec<Arc<Closure>>,
    /// Whether anything has opened.
    pub(super) has_opened: bool,
    /// Whether what was only announced may have been lifted: only plans whose times are computed may be free by that.
    pub(super) may_fly: bool,
    /// Whether the wind has changed, which may leave any plan short that is flown.
    pub(super) has_turned_wind: bool,
}

/// What a look at a plan came to.
#[derive(Debug)]
pub(super) enum Affected {
    /// Nothing is closed ahead of its drone.
    Not,
    /// What its drone has been told already is still open: this outcome.
    Kept(&'static str),
    /// Its drone is told this.
    Told(Box<Detour>),
}

impl State {
    /// What closes a version of a plan from a leg on: ids, as far as they are told by times, and none where it is the wind;
    /// `None` where nothing does.
    fn obstruction(
        &self,
        plan: &PlanEntry,
        version: &Version,
        (from_leg, stretch): Ahead<'_>,
        airspace: &Arc<Airspace>,
        now: Timestamp,
    ) -> Option<Vec<String>> {
        let on_stretch = stretch.map_or_else(Vec::new, |(stretch, place)| {
            stretch.obstructed_by(airspace, place)
        });
        let Some((flights, flown)) = self.flights.as_deref().zip(version.flight.as_deref()) else {
            let is_blocked = progress::is_blocked(airspace, &version.composition, from_leg);
            return (is_blocked || !on_stretch.is_empty()).then_some(on_stretch);
        };
        let scene = Scene {
            snapshot: &self.next,
            airspace,
            now,
        };
        let mut ids = flights.closures_met(scene, plan, (version, flown), from_leg);
        ids.extend(on_stretch);
        let is_cut =
            !ids.is_empty() || flights.falls_short(scene, plan, (version, flown), from_leg);
        is_cut.then_some(ids)
    }

    /// Whether anything is closed ahead of the drone of a plan, on what it flies or is to fly.
    pub(super) fn is_cut(
        &self,
        plan: &PlanEntry,
        progress: &Progress,
        airspace: &Arc<Airspace>,
        now: Timestamp,
    ) -> bool {
        let is_obstructed = |version: &Version, ahead: Ahead<'_>| {
            let obstruction = self.obstruction(plan, version, ahead, airspace, now);
            obstruction.is_some()
        };
        let wanted = plan.wanted.as_deref();
        plan.falls_short()
            || is_obstructed(&plan.reported, progress::ahead(plan, progress))
            || wanted.is_some_and(|wanted| is_obstructed(wanted, progress::whole(wanted)))
    }

    /// Marks a plan affected where something ahead of its drone is closed, with what it is to fly instead.
    pub(super) fn affect(
        &mut self,
        plan: &Arc<PlanEntry>,
        airspace: &Arc<Airspace>,
        causes: &[String],
        now: Timestamp,
    ) -> Affected {
        let topology = airspace.topology();
        let Some(progress) = progress::progress(topology, plan, &self.drones, now) else {
            return Affected::Not;
        };
        let ahead = progress::ahead(plan, &progress);
        let obstruction = self.obstruction(plan, &plan.reported, ahead, airspace, now);
        let reported_blocked = plan.falls_short() || obstruction.is_some();
        let wanted_blocked = plan.wanted.as_ref().is_some_and(|wanted| {
            let whole = progress::whole(wanted);
            self.obstruction(plan, wanted, whole, airspace, now)
                .is_some()
        });
        if !reported_blocked && !wanted_blocked {
            return Affected::Not;
        }
        if !reported_blocked && plan.is_as_planned() {
            self.withdraw_wanted(plan);
            return Affected::Not;
        }
        let affected_by = match plan.reported.flight {
            Some(_) if self.flights.is_some() => obstruction.unwrap_or_default(),
            _ => affecting(plan, airspace, causes, &progress),
        };
        if let Some(wanted) = plan.wanted.as_ref().filter(|_| !wanted_blocked) {
            return self.keep_wanted(plan, wanted, affected_by);
        }
        self.recompose_plan(plan, &progress, airspace, affected_by, now)
    }

    /// The drone of a plan has been told a way that is still open, and may be about to take it over.
    fn keep_wanted(
        &mut self,
        plan: &Arc<PlanEntry>,
        wanted: &Version,
        affected_by: Vec<String>,
    ) -> Affected {
        let is_as_told = plan.flags.affected && plan.affected_by == affected_by;
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

    /// Works out what the drone of a plan is to fly instead, and tells it.
    fn recompose_plan(
        &mut self,
        plan: &Arc<PlanEntry>,
        progress: &Progress,
        airspace: &Arc<Airspace>,
        affected_by: Vec<String>,
        now: Timestamp,
    ) -> Affected {
        let means = DetourMeans {
            snapshot: &self.next,
            airspace,
            trees: Some(&self.trees),
            drones: &self.drones,
            flights: self.flights.as_deref(),
            now,
        };
        let detour = fleet::detour(plan, progress, &means, &mut self.scratch);
        let mut detour = self.checked(detour, airspace, now);
        let marked = Arc::new(PlanEntry {
            affected_by,
            ..(**plan).clone()
        });
        let may_go_on = plan.may_go_on() && !has_reported(plan);
        if detour.outcome() == Outcome::Unaffected && may_go_on {
            // What has closed on its leg lies behind its drone: there is nothing to take over.
            self.stay_on_way(plan);
            self.tell_relieved(plan, &marked.affected_by);
            detour.plan = marked;
            return Affected::Told(Box::new(detour));
        }
        let was_without_way = plan.flags.affected && plan.wanted.is_none();
        let is_as_told = was_without_way && plan.affected_by == marked.affected_by;
        let version = self.version_of(&detour, airspace, now);
        detour.version = version.as_ref().map(|version| version.number);
        let plan = self.replace_wanted(&marked, version);
        let plan = self.contingent_without_way(plan);
        if plan.wanted.is_none() {
            self.alarm_without_way(&plan, now);
        }
        match plan.wanted {
            Some(_) => self.tell(EventKind::PlanAffected, &plan),
            None if is_as_told => {}
            None => self.tell_without_way(&plan, Some(&detour)),
        }
        detour.plan = plan;
        Affected::Told(Box::new(detour))
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
            DetourAnswer::Flown(answer) => {
                let version = answer.version_without_number()?;
                let first = version.composition.way.nodes.first().copied();
                let report = detour.report.as_ref().zip(first);
                let stretch = report.and_then(|(report, first)| {
                    Stretch::between(airspace, report, first, version.first_stretch_m)
                });
                Version { stretch, ..version }
            }
        };
        Some(Version {
            number: plan.next_version.fetch_add(1, Ordering::Relaxed),
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
            // A drone that holds on the ground keeps its plan until the zone over it has ended.
            Outcome::NoRoute | Outcome::Hold => return None,
            Outcome::Diverted => *answer.path.nodes.last()?,
            Outcome::Rerouted | Outcome::Unaffected => plan.destination,
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
            stretch: Stretch::of(airspace, answer.reentry),
            first_stretch_m: answer.first_stretch_m,
            departs_at: now,
            recomposition_id: None,
            acknowledge_by: None,
            flags: version_flags(&answer.flags),
            warnings: warnings
                .map(|warning| {
                    let (code, message) = crate::formats::warning_text(topology, warning);
                    (code.into(), message)
                })
                .collect(),
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
        let blocked = progress.is_some_and(|progress| {
            let ahead = progress::ahead(plan, &progress);
            let obstruction = self.obstruction(plan, &plan.reported, ahead, airspace, now);
            obstruction.is_some()
        });
        if blocked {
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
        self.keep_plan(PlanEntry {
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
        })
    }
}

/// Whether what the drone of a plan is to fly comes from a report of its own, which goes on to count.
fn has_reported(plan: &PlanEntry) -> bool {
    let wanted = plan.wanted.as_ref();
    wanted.is_some_and(|wanted| wanted.recomposition_id.is_some())
}

/// The closures that block a plan from a leg on: those known that still count, and the new ones.
fn affecting(
    plan: &PlanEntry,
    airspace: &Airspace,
    causes: &[String],
    progress: &Progress,
) -> Vec<String> {
    let (from_leg, stretch) = progress::ahead(plan, progress);
    let is_met = |closure: &Closure| {
        progress::is_hit(closure, &plan.reported.composition, from_leg)
            || progress::is_on_stretch(stretch, closure, airspace.topology())
    };
    let known = plan.affected_by.iter().chain(causes);
    let mut ids: Vec<String> = Vec::new();
    for id in known {
        let closure = airspace.closure(id);
        let counts = closure.is_some_and(|closure| {
            airspace.is_in_force(id) && (plan.affected_by.contains(id) || is_met(closure))
        });
        if counts && !ids.contains(id) {
            ids.push(id.clone());
        }
    }
    if ids.is_empty() {
        let all = airspace.in_force();
        let met = all.filter(|closure| is_met(closure));
        ids.extend(met.map(|closure| closure.id.clone()));
    }
    ids
}
