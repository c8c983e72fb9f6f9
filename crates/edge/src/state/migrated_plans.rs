//! Plans when the network changes: flown on where their ways are as they were, else recomposed from where their
//! drones are, or ended where their source or destination is gone.

use super::State;
use super::alarms::AT_THE_END;
use crate::drones::progress;
use crate::line::mailbox::Content;
use crate::planner::{Displaced, Version};
use crate::plans::entry::PlanEntry;
use crate::plans::fleet::{self, Detour};
use crate::plans::served::begins_m;
use crate::plans::stops;
use crate::snapshot::Snapshot;
use crate::writer::commands::Command;
use crate::{views, words};
use jiff::Timestamp;
use serde_json::json;
use skyway_contract::{self as wire, AlarmKind, EventKind, PlanState};
use skyway_engine::airspace::Airspace;
use skyway_engine::compose::{Change, Composition};
use skyway_engine::flight::{Location, ServiceStop};
use skyway_engine::geo::Point;
use skyway_engine::itinerary::Occupancy;
use skyway_engine::network::{Correspondence, NodeIx, Topology};
use skyway_engine::recompose::{Outcome, Request};
use skyway_formats::{Known, resolve_report};
use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::Ordering;

impl State {
    /// Carries all plans over to the network that is in service now; `before` is the state on the one before.
    pub(super) fn carry_plans_over(
        &mut self,
        before: &Snapshot,
        change: &Change<'_>,
        now: Timestamp,
    ) {
        self.next.occupancy = Occupancy::default();
        self.guarded.clear();
        for plan in before.plans.values() {
            if plan.is_active() && plan.is_quote() {
                self.end_with_network(plan, before, "network_changed");
            } else if plan.is_active() {
                self.carry_plan_over(plan, before, change, now);
            } else {
                self.migrate_ended_plan(plan, change);
            }
        }
    }

    fn carry_plan_over(
        &mut self,
        plan: &Arc<PlanEntry>,
        before: &Snapshot,
        change: &Change<'_>,
        now: Timestamp,
    ) {
        let Some((source, destination)) = ends_over(plan, change.correspondence) else {
            self.end_with_network(plan, before, "source_or_destination_gone");
            return;
        };
        let current = version_carried(plan, &plan.reported, change);
        let proposed = plan.wanted.as_deref();
        let proposed = proposed.map(|version| version_carried(plan, version, change));
        let plan_over = |current: Version, wanted: Option<Version>| PlanEntry {
            source,
            destination,
            reported: Arc::new(current),
            wanted: wanted.map(Arc::new),
            sent: sent_carried(plan, change),
            ..(**plan).clone()
        };
        match (current, proposed) {
            (Some(current), None) => {
                let current = flown_as_it_was(current);
                self.fly_on(plan_over(current, None));
            }
            (Some(current), Some(Some(proposed))) => {
                let current = flown_as_it_was(current);
                let proposed = flown_as_it_was(proposed);
                self.fly_on(plan_over(current, Some(proposed)));
            }
            (Some((current, _)), Some(None)) => {
                let remnant = plan.wanted.as_deref().map(nothing_left_of);
                self.redirect(plan_over(current, remnant), now);
            }
            (None, _) => {
                let remnant = plan.wanted.as_deref().map(nothing_left_of);
                match self.legs_left(plan, before, change, now) {
                    Some((current, cut_m)) => {
                        if let Some(drone) = &plan.drone_id {
                            self.drones
                                .begin_later(drone, (&plan.id, current.number), cut_m);
                        }
                        self.redirect(plan_over(current, remnant), now);
                    }
                    None => self.redirect_from_place(
                        plan,
                        before,
                        destination,
                        |current| plan_over(current, remnant),
                        now,
                    ),
                }
            }
        }
    }

    /// A plan whose ways are as they were.
    fn fly_on(&mut self, plan: PlanEntry) {
        self.occupy_all(&plan);
        let plan = self.keep_plan(plan);
        self.touched_plans.insert(plan.id.clone());
    }

    /// What is left of the way of a plan around its drone, and how many metres before that are left out; `None` where the leg that
    /// it is on is gone.
    fn legs_left(
        &self,
        plan: &PlanEntry,
        before: &Snapshot,
        change: &Change<'_>,
        now: Timestamp,
    ) -> Option<(Version, f64)> {
        let progress = progress::progress(before.topology(), plan, &self.drones, now)?;
        let composition = &plan.reported.composition;
        let legs = composition.legs_left(change.correspondence, progress.leg);
        if legs.is_empty() {
            return None;
        }
        let cut_m = begins_m(before.topology(), &plan.reported, legs.start);
        let cut_m = if legs.start == 0 { 0.0 } else { cut_m };
        let left = part_carried(plan, legs, change)?;
        let left = Version {
            // It leads nowhere now, whatever its drone was told.
            outcome: left.outcome.filter(|outcome| *outcome != Outcome::Diverted),
            ..left
        };
        Some((left, cut_m))
    }

    /// Proposes a way from where the drone of a plan is on what is left of its way.
    fn redirect(&mut self, plan: PlanEntry, now: Timestamp) {
        self.occupy_all(&plan);
        let plan = self.keep_plan(plan);
        let airspace = self.next.airspace.clone();
        let progress = progress::progress(airspace.topology(), &plan, &self.drones, now);
        let version = progress.and_then(|progress| {
            let detour = fleet::detour(&plan, &progress, &self.means(&airspace, now));
            let detour = self.checked(detour, &airspace, now);
            self.version_of(&detour, &airspace, now)
        });
        let plan = self.replace_wanted(&plan, version);
        self.touched_plans.insert(plan.id.clone());
        self.tell(EventKind::PlanAffected, &plan);
        if plan.wanted.is_none() {
            self.alarm_without_way(&plan, now);
        }
    }

    /// The leg that the drone of a plan is on is gone: its way is composed from its place. As nothing is left of the
    /// old one, the new one stands in its place at once, and is proposed as well for its drone to acknowledge.
    fn redirect_from_place(
        &mut self,
        plan: &Arc<PlanEntry>,
        before: &Snapshot,
        destination: NodeIx,
        plan_over: impl FnOnce(Version) -> PlanEntry,
        now: Timestamp,
    ) {
        let place = place_of(plan, before.topology(), &self.drones, now);
        let place = place.map(|place| before.topology().frame().from_plane(place));
        let detour = self.detour_from(plan, before, (destination, place), now);
        let airspace = self.next.airspace.clone();
        let version = detour.and_then(|detour| {
            let on_network = Detour {
                plan: Arc::new(PlanEntry {
                    destination,
                    ..(**plan).clone()
                }),
                ..detour
            };
            let on_network = self.checked(on_network, &airspace, now);
            self.version_of(&on_network, &airspace, now)
        });
        let Some(imposed) = version else {
            self.end_with_network(plan, before, "no_way_on");
            return;
        };
        let number = plan.next_version.fetch_add(1, Ordering::Relaxed);
        let proposed = Version {
            number,
            ..imposed.clone()
        };
        let plan = plan_over(imposed);
        self.occupy_all(&plan);
        self.time_arrival(&plan.id, &plan.reported);
        let plan = self.replace_wanted(&Arc::new(plan), Some(proposed));
        self.touched_plans.insert(plan.id.clone());
        self.tell(EventKind::PlanAffected, &plan);
    }

    /// What a drone at a place, or on a pad, is told that is to go to a node.
    fn detour_from(
        &self,
        plan: &Arc<PlanEntry>,
        before: &Snapshot,
        (destination, place): (NodeIx, Option<[f64; 2]>),
        now: Timestamp,
    ) -> Option<Detour> {
        let drone = plan.drone_id.as_deref();
        let progress = progress::progress(before.topology(), plan, &self.drones, now);
        let here = |node: NodeIx| self.next.topology().node(before.topology().node_id(node));
        let onward = stops::onward(before.topology(), plan, progress.as_ref(), now);
        let onward: Option<Vec<ServiceStop>> = onward
            .iter()
            .map(|stop| {
                let node = here(stop.node)?;
                Some(ServiceStop { node, ..*stop })
            })
            .collect();
        let onward = onward?;
        let request = place.and_then(|it| request_from(&self.next.airspace, it, destination));
        let displaced = Displaced {
            before: before.topology(),
            destination,
            request: request.map(|mut request| {
                request.lead_by(onward.clone());
                request
            }),
            onward,
            leg: progress.map_or(0, |progress| progress.leg),
            sighting: drone.and_then(|id| self.drones.last(id)),
        };
        let scene = self.next.scene(now);
        let answered = self.planner.replan_displaced(scene, plan, displaced)?;
        let mut detour = Detour::new(plan, now, answered);
        // Of a way that only the report's reader assumed.
        detour.answer.is_another_way();
        Some(detour)
    }

    /// Ends a plan that has nowhere to go any more. It is told in the words of the network before, and forgotten; its drone is told,
    /// and where that has departed an operator is alarmed.
    fn end_with_network(&mut self, plan: &Arc<PlanEntry>, before: &Snapshot, why: &str) {
        if let Some(drone) = &plan.drone_id
            && self.next.flown_by.get(drone) == Some(&plan.id)
        {
            self.next.flown_by.remove(drone);
        }
        self.next.active_plans = self.next.active_plans.saturating_sub(1);
        self.next.plans.remove(&plan.id);
        let ended = PlanEntry {
            state: PlanState::Ended,
            ended_as: Some(wire::EndedAs::Cancelled),
            wanted: None,
            ..(**plan).clone()
        };
        self.tell_last_of_flight(&ended);
        let data = json!({"plan": views::plan_summary(before, &ended), "why": why});
        self.happen(EventKind::PlanEnded, data);
        self.post(&ended, &[], Content::Ended(wire::EndedAs::Cancelled));
        self.end_plan_alarms(&plan.id, &AT_THE_END);
        if plan.drone_id.is_some() && self.may_have_departed(plan) {
            let message = format!(
                "the plan '{}' has ended on a new network, and its drone has departed: land it, or order it a new plan",
                plan.id
            );
            self.raise_plan_alarm(AlarmKind::NoRoute, &ended, message);
        }
    }

    /// The order of a version that was worked out on another network; a plan that it does not fit is looked over instead.
    pub(super) fn version_over(
        &mut self,
        id: &Arc<str>,
        version: Version,
        made_on: &Topology,
        correspondence: &Correspondence,
    ) -> Option<Command> {
        let plan = self.next.plans.get(id).cloned()?;
        let topology = self.next.topology().clone();
        let change = Change {
            from: made_on,
            to: &topology,
            correspondence,
        };
        let carried = version_carried(&plan, &version, &change);
        let Some(carried) = carried else {
            self.touched_plans.insert(id.clone());
            return None;
        };
        Some(Command::ProposeVersion {
            plan: id.clone(),
            version: Box::new(flown_as_it_was(carried)),
        })
    }
}

/// A version that is flown as it was; contingencies that cannot be flown are worked out anew.
fn flown_as_it_was((version, contingencies_hold): (Version, bool)) -> Version {
    match contingencies_hold {
        true => version,
        false => version.without_contingencies(),
    }
}

/// The request of a drone at a place that is to go to a node.
fn request_from(airspace: &Airspace, place: [f64; 2], destination: NodeIx) -> Option<Request> {
    let goal = words::node_id(airspace.topology(), destination);
    let report = wire::FailureReport {
        failure: Some(wire::FailureType::ServiceLevel),
        location: Some(wire::Place::Pair(place)),
        destination: Some(goal),
        ..wire::FailureReport::default()
    };
    let settled = resolve_report(&report, &Known::nothing(), airspace, &mut Vec::new());
    settled.ok().map(|settled| settled.request)
}

pub(super) fn ends_over(
    plan: &PlanEntry,
    correspondence: &Correspondence,
) -> Option<(NodeIx, NodeIx)> {
    let source = correspondence.node(plan.source)?;
    let mut stops = plan.reported.stops.iter();
    if !stops.all(|stop| correspondence.node(stop.node).is_some()) {
        return None;
    }
    Some((source, correspondence.node(plan.destination)?))
}

/// A version of which all legs are flown as they were, and whether its contingencies hold too.
pub(super) fn version_carried(
    plan: &PlanEntry,
    version: &Version,
    change: &Change<'_>,
) -> Option<(Version, bool)> {
    let legs = 0..version.composition.legs.len();
    version.carried_over(plan.airspeed_mps, legs, change)
}

/// Some legs of the reported version of a plan, as a way of their own.
pub(super) fn part_carried(
    plan: &PlanEntry,
    legs: Range<usize>,
    change: &Change<'_>,
) -> Option<Version> {
    let starts_as_before = legs.start == 0;
    let part = plan
        .reported
        .carried_over(plan.airspeed_mps, legs, change)?
        .0;
    Some(Version {
        first_stretch_m: if starts_as_before {
            part.first_stretch_m
        } else {
            0.0
        },
        stretch: part.stretch.filter(|_| starts_as_before),
        ..part
    })
}

/// What was sent and may be flown, as far as its way is there.
pub(super) fn sent_carried(plan: &PlanEntry, change: &Change<'_>) -> Vec<Arc<Version>> {
    let sent = plan.sent.iter();
    let carried = sent.filter_map(|version| version_carried(plan, version, change));
    carried.map(|(version, _)| Arc::new(version)).collect()
}

/// A proposed version without its way: what its drone has reported goes on to count.
pub(super) fn nothing_left_of(version: &Version) -> Version {
    Version {
        composition: Composition {
            way: skyway_engine::routing::Path::default(),
            legs: Vec::new(),
            length_m: 0.0,
            flight_time_s: 0.0,
        },
        flight: None,
        stretch: None,
        ..version.clone()
    }
}

/// Where the drone of a plan is, on the network of its plan: by its telemetry, else by nominal times.
fn place_of(
    plan: &PlanEntry,
    topology: &Topology,
    drones: &crate::drones::Drones,
    now: Timestamp,
) -> Option<Point> {
    let version = &plan.reported;
    let Some(progress) = progress::progress(topology, plan, drones, now) else {
        let last = version.composition.way.nodes.last();
        return last.map(|&node| topology.position(node));
    };
    if let (_, Some((_, place))) = progress::ahead(plan, &progress) {
        return Some(place);
    }
    let leg = &version.composition.legs[progress.leg];
    let (from, to) = (topology.position(leg.from), topology.position(leg.to));
    Some(match progress.location {
        Location::At(place) => place,
        Location::LegStart => from,
        Location::Unknown => {
            let elapsed_s = now.duration_since(version.departs_at).as_secs_f64();
            let lasts_s = leg.arrival_s - leg.departure_s;
            let fraction = match lasts_s > 0.0 {
                true => ((elapsed_s - leg.departure_s) / lasts_s).clamp(0.0, 1.0),
                false => 0.0,
            };
            from.towards(to, fraction)
        }
    })
}
