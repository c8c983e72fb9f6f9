//! Plans in flight: where their drones are, what blocks them, and what they are to fly instead.

use super::drones::Drones;
use super::plan_entry::PlanEntry;
use super::planner::{Flights, FlownAnswer, OccupationKey, Scene, Version};
use super::progress::{Progress, ahead, is_hit, is_on_stretch, leg_ahead};
use super::snapshot::Snapshot;
use crate::airspace::{Airspace, Closure};
use crate::compose::{Conflict, Occupation, conflicts};
use crate::flight::{Aloft, Circumstances, FailureReport, FailureType, Location};
use crate::geo::Point;
use crate::network::Topology;
use crate::recompose::{Outcome, Recomposition, Request, Scratch, World, recompose};
use crate::routing::{TreeCache, Way};
use jiff::Timestamp;
use serde_json::Value;
use std::sync::Arc;

/// What a plan's drone is told when something ahead has closed.
#[derive(Clone, Debug)]
pub(super) struct Detour {
    pub(super) plan: Arc<PlanEntry>,
    pub(super) answer: DetourAnswer,
    /// What was asked of the leg that the drone is on.
    pub(super) report: Option<FailureReport>,
    /// How much longer the route becomes, in metres; `None` where it does not lead to the destination.
    pub(super) extra_m: Option<f64>,
    /// The proposed version; `None` in a preview and where there is no way.
    pub(super) version: Option<u32>,
}

/// How a detour was worked out.
#[derive(Clone, Debug)]
pub(super) enum DetourAnswer {
    /// By distance.
    Shortest {
        request: Box<Request>,
        answer: Box<Recomposition>,
    },
    /// By the flight model.
    Flown(Box<FlownAnswer>),
}

impl DetourAnswer {
    /// Nothing that was planned is touched where the plan was only assumed: it is another way for who flies it.
    pub(super) fn is_another_way(&mut self) {
        let outcome = match self {
            Self::Shortest { answer, .. } => &mut answer.outcome,
            Self::Flown(answer) => &mut answer.outcome,
        };
        if *outcome == Outcome::Unaffected {
            *outcome = Outcome::Rerouted;
        }
    }
}

impl Detour {
    /// What the drone is told.
    pub(super) fn outcome(&self) -> Outcome {
        match &self.answer {
            DetourAnswer::Shortest { answer, .. } => answer.outcome,
            DetourAnswer::Flown(answer) => answer.outcome,
        }
    }

    /// The least bad way, where there is no other.
    pub(super) fn unsafe_way(&self, topology: &Topology) -> Option<Value> {
        let DetourAnswer::Shortest { answer, .. } = &self.answer else {
            return None;
        };
        let way = answer.unsafe_way.as_ref()?;
        serde_json::to_value(crate::formats::unsafe_way(topology, way)).ok()
    }

    /// The way that it is to take; without nodes where there is none.
    pub(super) fn way(&self) -> Way {
        match &self.answer {
            DetourAnswer::Shortest { answer, .. } => answer.path.clone(),
            DetourAnswer::Flown(answer) => answer.way(),
        }
    }
}

/// What detours are worked out with.
pub(super) struct DetourMeans<'a> {
    pub(super) snapshot: &'a Snapshot,
    /// That of the snapshot, or an imagined one.
    pub(super) airspace: &'a Arc<Airspace>,
    /// Tables of that airspace, where there are any.
    pub(super) trees: Option<&'a TreeCache>,
    pub(super) drones: &'a Drones,
    /// The flight model, where it is on.
    pub(super) flights: Option<&'a Flights>,
    pub(super) now: Timestamp,
}

impl<'a> DetourMeans<'a> {
    fn scene(&self) -> Scene<'a> {
        Scene {
            snapshot: self.snapshot,
            airspace: self.airspace,
            now: self.now,
        }
    }
}

/// How far a place is from the straight line between two others, ends included, in metres.
pub(super) fn distance_to_line_m(place: Point, from: Point, to: Point) -> f64 {
    let along_m2 = from.distance_m(to).powi(2);
    let dot = (place.x - from.x) * (to.x - from.x) + (place.y - from.y) * (to.y - from.y);
    let fraction = match along_m2 > 0.0 {
        true => (dot / along_m2).clamp(0.0, 1.0),
        false => 0.0,
    };
    place.distance_m(from.towards(to, fraction))
}

/// Whether a closure of a world meets a plan ahead of its drone: by times where they are computed.
pub(super) fn is_met(
    plan: &PlanEntry,
    progress: &Progress,
    closure: &Closure,
    means: &DetourMeans<'_>,
) -> bool {
    let version = &plan.reported;
    if let Some((flights, flown)) = means.flights.zip(version.flight.as_deref()) {
        let met = flights.closures_met(means.scene(), plan, (version, flown), progress.leg);
        let (_, stretch) = ahead(plan, progress);
        let topology = means.airspace.topology();
        return met.contains(&closure.id) || is_on_stretch(stretch, closure, topology);
    }
    let is_in_force = means.airspace.is_in_force(&closure.id);
    let (from_leg, stretch) = ahead(plan, progress);
    is_in_force
        && (is_hit(closure, &version.composition, from_leg)
            || is_on_stretch(stretch, closure, means.airspace.topology()))
}

/// What a plan's drone is told in a world where something ahead has closed.
pub(super) fn detour(
    plan: &Arc<PlanEntry>,
    progress: &Progress,
    means: &DetourMeans<'_>,
    scratch: &mut Scratch,
) -> Detour {
    detour_for(plan, progress, None, means, scratch)
}

/// The same for a failure of the drone itself, where there is one.
pub(super) fn detour_for(
    plan: &Arc<PlanEntry>,
    progress: &Progress,
    failure: Option<FailureType>,
    means: &DetourMeans<'_>,
    scratch: &mut Scratch,
) -> Detour {
    let (leg, remaining_path) = leg_ahead(plan, progress);
    // A leg that its drone has reported stays failed for it, published or not.
    let reported = plan
        .wanted
        .as_ref()
        .is_some_and(|wanted| wanted.recomposition_id.is_some());
    let otherwise = match reported {
        true => FailureType::Navigational,
        false => FailureType::ServiceLevel,
    };
    let drone = plan.drone_id.as_deref();
    let sighting = drone.and_then(|id| means.drones.last(id));
    let circumstances = Circumstances {
        aloft: match progress.location {
            Location::LegStart => Aloft::Grounded,
            Location::At(_) | Location::Unknown => Aloft::Airborne,
        },
        speed_mps: plan.airspeed_mps,
        place_age_s: sighting.map_or(0.0, |sighting| {
            let age = means.now.duration_since(sighting.seen_at);
            age.as_secs_f64().max(0.0)
        }),
        ..Circumstances::default()
    };
    let report = FailureReport {
        failure: failure.unwrap_or(otherwise),
        leg,
        location: progress.location,
        cause_location: None,
        destination: plan.destination,
        remaining_path,
    };
    let turns_back = report.remaining_path.is_none();
    let request = Request {
        circumstances,
        ..Request::exact(report.clone())
    };
    let (mut answer, remaining_length_m) = answered(plan, request, progress.leg, means, scratch);
    if turns_back {
        answer.is_another_way();
    }
    let detour = Detour {
        plan: plan.clone(),
        report: Some(report),
        answer,
        extra_m: None,
        version: None,
    };
    let leads_there = matches!(
        detour.outcome(),
        Outcome::Rerouted | Outcome::Unaffected | Outcome::Hold
    );
    let extra_m = remaining_length_m
        .filter(|_| leads_there)
        .map(|length_m| length_m - progress.remaining_m);
    Detour { extra_m, ..detour }
}

/// The answer to a request of a plan's drone on a leg: by the flight model where its plan is flown by that.
pub(super) fn answered(
    plan: &PlanEntry,
    request: Request,
    leg: usize,
    means: &DetourMeans<'_>,
    scratch: &mut Scratch,
) -> (DetourAnswer, Option<f64>) {
    if let Some(flights) = means.flights
        && plan.reported.flight.is_some()
    {
        let drone = plan.drone_id.as_deref();
        let sighting = drone.and_then(|id| means.drones.last(id));
        let answer = flights.answer(means.scene(), plan, &request, (leg, sighting.as_ref()));
        let version = answer.version.as_ref();
        let length_m = version.map(|(_, composition)| composition.length_m);
        return (DetourAnswer::Flown(Box::new(answer)), length_m);
    }
    let world = World {
        airspace: means.airspace,
        trees: means.trees,
    };
    let answer = recompose(&world, &request, scratch);
    let length_m = answer.remaining_length_m;
    let answer = DetourAnswer::Shortest {
        request: Box::new(request),
        answer: Box::new(answer),
    };
    (answer, length_m)
}

/// A version's place in the index of what is on which segment when.
pub(super) fn occupations(
    plan: &Arc<str>,
    version: &Version,
) -> impl Iterator<Item = (OccupationKey, Occupation)> {
    let (plan, number) = (plan.clone(), version.number);
    let all = version.occupations().into_iter();
    all.map(move |occupation| {
        let key = OccupationKey {
            segment: occupation.segment.0,
            plan: plan.clone(),
            version: number,
            leg: u32::try_from(occupation.leg).unwrap_or(u32::MAX),
        };
        (key, occupation)
    })
}

/// Another active plan that comes too near, and where.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct PlanConflict {
    pub(super) plan: Arc<str>,
    pub(super) conflict: Conflict,
}

/// The conflicts of all versions of a plan with those of all other active plans, at most so many.
pub(super) fn conflicts_of(
    snapshot: &Snapshot,
    plan: &PlanEntry,
    headway_s: f64,
    at_most: usize,
) -> Vec<PlanConflict> {
    let mut found: Vec<PlanConflict> = Vec::new();
    for own in plan.versions().flat_map(|version| version.occupations()) {
        let first = OccupationKey::first_of(own.segment);
        let there = snapshot.occupations.range(first..);
        let there = there.take_while(|(key, _)| key.segment == own.segment.0);
        for (key, other) in there.filter(|(key, _)| key.plan != plan.id) {
            let [own, other] = [std::slice::from_ref(&own), std::slice::from_ref(other)];
            let met = conflicts(own, other, headway_s).into_iter();
            let met = met.map(|conflict| PlanConflict {
                plan: key.plan.clone(),
                conflict,
            });
            for conflict in met {
                let is_known = found.iter().any(|other| {
                    let (known, new) = (&other.conflict, &conflict.conflict);
                    let is_same = (known.leg, known.direction) == (new.leg, new.direction);
                    other.plan == conflict.plan && is_same
                });
                if !is_known {
                    found.push(conflict);
                }
            }
            if found.len() >= at_most {
                return found;
            }
        }
    }
    found
}
