//! Plans in flight: where their drones are, what blocks them, and what they are to fly instead.

use super::entry::PlanEntry;
use super::stops::onward;
use crate::drones::progress::{Progress, ahead, leg_ahead, whole};
use crate::drones::{Drones, Sighting};
use crate::planner::{Answer, ON_PAD_M, Planner, Scene, occupation};
use crate::snapshot::Snapshot;
use jiff::Timestamp;
use serde_json::Value;
use skyway_engine::compose::{Conflict, conflicts};
use skyway_engine::flight::{Aloft, Circumstances, FailureReport, FailureType, Location};
use skyway_engine::geo::Point;
use skyway_engine::network::{NodeIx, Topology};
use skyway_engine::recompose::{Outcome, Request};
use skyway_engine::routing::Path;
use std::sync::Arc;

/// What a plan's drone is told when something ahead has closed.
#[derive(Clone, Debug)]
pub(crate) struct Detour {
    pub(crate) plan: Arc<PlanEntry>,
    /// When it was worked out: what is told begins then, however much later it is committed.
    pub(crate) at: Timestamp,
    /// What was asked.
    pub(crate) request: Box<Request>,
    pub(crate) answer: Box<Answer>,
    /// How much longer the route becomes, in metres; `None` where it does not lead to the destination.
    pub(crate) extra_m: Option<f64>,
    /// The proposed version; `None` in a preview and where there is no way.
    pub(crate) version: Option<u32>,
}

impl Detour {
    /// Whose extra length no request has asked for.
    pub(crate) fn new(
        plan: &Arc<PlanEntry>,
        at: Timestamp,
        (request, answer): (Request, Answer),
    ) -> Self {
        Self {
            plan: plan.clone(),
            at,
            request: Box::new(request),
            answer: Box::new(answer),
            extra_m: None,
            version: None,
        }
    }

    /// What the drone is told.
    pub(crate) fn outcome(&self) -> Outcome {
        self.answer.told().outcome
    }

    /// The least bad way, where there is no other.
    pub(crate) fn unsafe_way(&self, topology: &Topology) -> Option<Value> {
        let way = self.answer.told().unsafe_way.as_ref()?;
        serde_json::to_value(skyway_formats::unsafe_way(topology, way)).ok()
    }

    /// The way that it is to take; without nodes where there is none.
    pub(crate) fn way(&self) -> &Path {
        &self.answer.told().path
    }
}

/// What detours are worked out with.
#[derive(Clone, Copy)]
pub(crate) struct DetourMeans<'a> {
    /// Of the snapshot, or with an imagined airspace.
    pub(crate) scene: Scene<'a>,
    pub(crate) planner: &'a dyn Planner,
    pub(crate) drones: &'a Drones,
}

/// What is in the way of the drone of a plan.
#[derive(Debug)]
pub(crate) struct Obstructed {
    /// Ahead of it on what it flies: ids, as far as they are told by times.
    pub(crate) by: Option<Vec<String>>,
    /// Whether it cannot go on flying that.
    pub(crate) is_reported: bool,
    /// On the version that it is to fly, likewise; where there is none, on those that it may have taken over before they were
    /// withdrawn.
    pub(crate) wanted_by: Option<Vec<String>>,
}

/// What is in the way of the drone of a plan, on what it flies and on what it is to fly.
pub(crate) fn obstructed(
    plan: &PlanEntry,
    progress: &Progress,
    means: &DetourMeans<'_>,
) -> Obstructed {
    let by = |version, ahead| means.planner.obstruction(means.scene, plan, version, ahead);
    let mut to_fly = plan.to_fly();
    let wanted_by = to_fly.find_map(|version| by(version, whole(version)));
    let by = by(&plan.reported, ahead(plan, progress));
    Obstructed {
        // A way on from the stop where it ends is looked for once its drone is there.
        is_reported: (plan.ends_early() && !plan.comes_to_stop(means.scene.now)) || by.is_some(),
        by,
        wanted_by,
    }
}

/// What a plan's drone is told in a world where something ahead has closed.
pub(crate) fn detour(
    plan: &Arc<PlanEntry>,
    progress: &Progress,
    means: &DetourMeans<'_>,
) -> Detour {
    detour_for(plan, progress, None, means)
}

/// The same for a failure of the drone itself, where there is one.
pub(crate) fn detour_for(
    plan: &Arc<PlanEntry>,
    progress: &Progress,
    failure: Option<FailureType>,
    means: &DetourMeans<'_>,
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
    let circumstances = circumstances(plan, progress, leg, (sighting.as_ref(), means.scene));
    let report = FailureReport {
        failure: failure.unwrap_or(otherwise),
        leg,
        location: progress.location,
        cause_location: None,
        destination: plan.destination,
        remaining_path,
    };
    let turns_back = report.remaining_path.is_none();
    let mut request = Request {
        circumstances,
        ..Request::exact(report)
    };
    let (topology, now) = (means.scene.topology(), means.scene.now);
    request.lead_by(onward(topology, plan, Some(progress), now));
    let at = (progress.leg, sighting.as_ref());
    let answered = means.planner.replan(means.scene, plan, request, at);
    let mut detour = Detour::new(plan, means.scene.now, answered);
    if turns_back {
        detour.answer.is_another_way();
    }
    let length_m = detour.answer.told().remaining_length_m;
    detour.extra_m = match detour.outcome() {
        // It flies on as it was; where its drone is between two reports is no detour.
        Outcome::Unaffected => length_m.map(|_| 0.0),
        Outcome::Rerouted | Outcome::Hold => {
            length_m.map(|length_m| length_m - progress.remaining_m)
        }
        _ => None,
    };
    detour
}

/// Whether the drone of a plan is in the air, and how far it may have come since it was seen.
fn circumstances(
    plan: &PlanEntry,
    progress: &Progress,
    leg: (NodeIx, NodeIx),
    (sighting, scene): (Option<&Sighting>, Scene<'_>),
) -> Circumstances {
    let topology = scene.topology();
    let airborne = sighting.and_then(|sighting| sighting.airborne_now(scene.now));
    let is_on_pad = |place: Point| {
        let mut ends = [leg.0, leg.1].into_iter();
        ends.any(|node| topology.position(node).distance_m(place) <= ON_PAD_M)
    };
    let aloft = match progress.location {
        Location::LegStart => Aloft::Grounded,
        // By its plan it has left, but it is late.
        Location::At(place) if airborne == Some(false) && is_on_pad(place) => Aloft::Grounded,
        Location::At(_) | Location::Unknown => Aloft::Airborne,
    };
    let age_s = sighting.map_or(0.0, |sighting| {
        scene.now.duration_since(sighting.seen_at).as_secs_f64()
    });
    Circumstances {
        aloft,
        speed_mps: plan.airspeed_mps,
        place_age_s: match aloft {
            Aloft::Grounded => 0.0,
            Aloft::Airborne | Aloft::Unknown => age_s.max(0.0),
        },
        ..Circumstances::default()
    }
}

/// Another active plan that comes too near, and where.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct PlanConflict {
    pub(crate) plan: Arc<str>,
    pub(crate) conflict: Conflict,
}

/// The conflicts of all versions of a plan with those of all other active plans, up to a bound.
pub(crate) fn conflicts_of(
    snapshot: &Snapshot,
    plan: &PlanEntry,
    headway_s: f64,
    at_most: usize,
) -> Vec<PlanConflict> {
    let mut found: Vec<PlanConflict> = Vec::new();
    for own in plan.versions().flat_map(|version| version.occupations()) {
        let there = snapshot.traffic().on(own.segment).iter();
        for taken in there.filter(|taken| *taken.plan != *plan.id) {
            let other = occupation(own.segment, taken);
            let [own, other] = [std::slice::from_ref(&own), std::slice::from_ref(&other)];
            let met = conflicts(own, other, headway_s).into_iter();
            let met = met.map(|conflict| PlanConflict {
                plan: taken.plan.id().clone(),
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
