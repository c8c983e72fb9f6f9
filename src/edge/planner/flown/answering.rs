//! What the drone of a plan is to fly when the world has changed, by the flight model.

use super::{DroneKind, Flights, FlownVersion, Ground};
use crate::airspace::Airspace;
use crate::compose::Composition;
use crate::delivery::{
    BatteryNow, DeliveryRequest, FlightFailure, FlightRecomposition, answer_failure,
    answer_standing,
};
use crate::edge::drones::Sighting;
use crate::edge::plan_entry::PlanEntry;
use crate::edge::planner::{Version, later, version_flags};
use crate::edge::snapshot::Snapshot;
use crate::flight::{Stop, StopKind};
use crate::formats::warning_text;
use crate::itinerary::{FlightCause, Objective};
use crate::network::{NodeIx, Topology};
use crate::recompose::{Flag, Outcome, Request, Severance};
use crate::routing::Way;
use jiff::Timestamp;
use std::borrow::Cow;
use std::sync::Arc;

/// A drone that was seen so near to a node, in metres, may stand on a pad there.
pub(super) const AT_NODE_M: f64 = 50.0;

/// A state of the edge, with an airspace that may be an imagined one.
#[derive(Clone, Copy, Debug)]
pub(in crate::edge) struct Scene<'a> {
    pub(in crate::edge) snapshot: &'a Snapshot,
    pub(in crate::edge) airspace: &'a Arc<Airspace>,
    pub(in crate::edge) now: Timestamp,
}

/// What the drone of a plan is told.
#[derive(Clone, Debug)]
pub(in crate::edge) struct FlownAnswer {
    pub(in crate::edge) outcome: Outcome,
    /// What it is to fly; `None` where there is nothing.
    pub(in crate::edge) version: Option<(Arc<FlownVersion>, Composition)>,
    /// When that departs.
    pub(in crate::edge) departs_at: Timestamp,
    pub(in crate::edge) warnings: Vec<(Cow<'static, str>, String)>,
    /// What holds of the way told.
    pub(in crate::edge) flags: Vec<Flag>,
    /// What was asked for a drone in the air; `None` for one that stands.
    pub(in crate::edge) asked: Option<Box<Request>>,
}

impl FlownAnswer {
    fn of(ground: &Ground, answer: &FlightRecomposition, departs_at: Timestamp) -> Self {
        let topology = ground.skies.topology();
        let composition = answer.composition.as_ref();
        let version = composition.map(|composition| {
            let (flown, way) = FlownVersion::of(ground, composition, answer.into(), departs_at);
            (Arc::new(flown), way)
        });
        let warnings = answer.warnings.iter().map(|warning| {
            let (code, message) = warning_text(topology, warning);
            (code.into(), message)
        });
        Self {
            outcome: answer.outcome,
            version,
            departs_at,
            warnings: warnings.collect(),
            flags: answer.flags.clone(),
            asked: None,
        }
    }

    /// The version that it makes, but for its number and what comes of its plan; `None` where there is nothing to fly.
    pub(in crate::edge) fn version_without_number(&self) -> Option<Version> {
        let (flown, composition) = self.version.as_ref()?;
        Some(Version {
            number: 0,
            epoch: 0,
            sent_at: self.departs_at,
            outcome: Some(self.outcome),
            composition: composition.clone(),
            stretch: None,
            first_stretch_m: flown.composition.plan.start.flown_m,
            flight: Some(flown.clone()),
            departs_at: self.departs_at,
            recomposition_id: None,
            acknowledge_by: None,
            flags: version_flags(&self.flags),
            warnings: self.warnings.clone(),
        })
    }

    /// The way that it leads; without nodes where there is none.
    pub(in crate::edge) fn way(&self) -> Way {
        let version = self.version.as_ref();
        version.map_or_else(Way::default, |(_, composition)| composition.way.clone())
    }
}

/// A drone that stands on a pad, or has not left yet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::edge) struct Stand {
    pub(in crate::edge) node: NodeIx,
    /// From when on it can do anything.
    pub(in crate::edge) from: Timestamp,
    pub(in crate::edge) battery: f64,
}

impl Flights {
    /// What flies a plan.
    pub(in crate::edge) fn kind_of(&self, plan: &PlanEntry) -> DroneKind {
        let named = plan.order.as_ref().map(|order| &*order.airframe);
        let airspeed_mps = Some(plan.airspeed_mps);
        let airframe = self.airframe(named, airspeed_mps);
        // What the configuration does not have any more is flown as the default.
        let airframe = airframe.unwrap_or_else(|| self.settings.airframe.clone());
        DroneKind::new(airframe, plan.payload_kg)
    }

    /// Ids of the closures that a version of a plan meets from a leg on, at the times at which it is there.
    pub(in crate::edge) fn closures_met(
        &self,
        scene: Scene<'_>,
        plan: &PlanEntry,
        (version, flown): (&Version, &FlownVersion),
        from_leg: usize,
    ) -> Vec<String> {
        let Scene {
            snapshot,
            airspace,
            now,
        } = scene;
        let (sky, setting) = self.bare(snapshot, airspace, &self.kind_of(plan), now);
        let departs_s = self.seconds(version.departs_at);
        let timed = flown.composition_at(departs_s);
        let met = setting.in_the_way(&timed.plan, timed.began_s, from_leg);
        let mut ids: Vec<String> = met
            .iter()
            .filter_map(|cause| match cause {
                FlightCause::Closure(number) => sky.skies.causes().get(*number),
                _ => None,
            })
            .filter_map(|severance| match severance {
                Severance::Closure(id) => Some(id.clone()),
                Severance::Report | Severance::Network => None,
            })
            .collect();
        ids.sort_unstable();
        ids.dedup();
        ids
    }

    /// Whether the wind leaves a version of a plan short from a leg on, by more than telemetry may be off.
    pub(in crate::edge) fn falls_short(
        &self,
        scene: Scene<'_>,
        plan: &PlanEntry,
        (version, flown): (&Version, &FlownVersion),
        from_leg: usize,
    ) -> bool {
        let topology = scene.airspace.topology();
        let weather = scene.snapshot.weather.as_ref();
        let compiled = self.compiled(topology, &self.kind_of(plan), weather);
        let timed = flown.composition_at(self.seconds(version.departs_at));
        let least = (timed.reserve - self.settings.battery_tolerance).max(0.0);
        compiled.setting.falls_short(&timed.plan, from_leg, least)
    }

    /// Answers the drone of a plan: in flight by a request that says where it is, on the ground from where it stands.
    pub(in crate::edge) fn answer(
        &self,
        scene: Scene<'_>,
        plan: &PlanEntry,
        request: &Request,
        (leg, sighting): (usize, Option<&Sighting>),
    ) -> FlownAnswer {
        let Scene { airspace, now, .. } = scene;
        let topology = airspace.topology();
        // What its drone has reported does not fit one that stands.
        let may_stand = !request.report.failure.closes_leg();
        let stand = may_stand
            .then(|| self.stand(topology, plan, sighting, now))
            .flatten();
        let Some(stand) = stand else {
            let battery = battery_of(plan, leg, sighting);
            return self.answer_in_flight(scene, plan, request, (leg, battery));
        };
        self.answer_standing(scene, plan, stand, request.report.destination)
    }

    /// Answers the drone of a plan that stands somewhere.
    pub(in crate::edge) fn answer_standing(
        &self,
        scene: Scene<'_>,
        plan: &PlanEntry,
        stand: Stand,
        destination: NodeIx,
    ) -> FlownAnswer {
        let ground = self.ground_of(scene, plan);
        let request = DeliveryRequest {
            source: stand.node,
            destination,
            start_s: self.seconds(stand.from),
            battery: stand.battery,
            objective: self.objective_of(plan),
            deadline_s: self.deadline_s(plan, scene.now),
        };
        let answer = self.with_scratch(scene.airspace.topology(), |scratch| {
            answer_standing(&ground.world(), &request, None, scratch)
        });
        FlownAnswer::of(&ground, &answer, stand.from)
    }

    /// Answers the drone of a plan by a request that says where it is, with what is known of its battery.
    pub(in crate::edge) fn answer_in_flight(
        &self,
        scene: Scene<'_>,
        plan: &PlanEntry,
        request: &Request,
        (leg, battery): (usize, BatteryNow),
    ) -> FlownAnswer {
        let now = scene.now;
        let ground = self.ground_of(scene, plan);
        let planned_stops = stops_ahead(plan, leg);
        let failure = FlightFailure {
            request,
            at_s: self.seconds(now),
            battery,
            objective: self.objective_of(plan),
            deadline_s: self.deadline_s(plan, now),
            planned_stops: planned_stops.as_deref(),
            landing: None,
        };
        let answer = self.with_scratch(scene.airspace.topology(), |scratch| {
            answer_failure(&ground.world(), &failure, scratch)
        });
        FlownAnswer {
            asked: Some(Box::new(request.clone())),
            ..FlownAnswer::of(&ground, &answer, now)
        }
    }

    /// What the drone of a plan flies in.
    pub(super) fn ground_of(&self, scene: Scene<'_>, plan: &PlanEntry) -> Ground {
        let kind = self.kind_of(plan);
        let Scene {
            snapshot,
            airspace,
            now,
        } = scene;
        self.ground(snapshot, airspace, &kind, snapshot.own(Some(&plan.id)), now)
    }

    pub(super) fn objective_of(&self, plan: &PlanEntry) -> Objective {
        let order = plan.order.as_ref();
        order.map_or(self.settings.objective, |order| order.objective)
    }

    /// The deadline that was stated, or that the plan has kept so far; none where that is over, or was never one.
    pub(super) fn deadline_s(&self, plan: &PlanEntry, now: Timestamp) -> Option<f64> {
        let stated = plan.order.as_ref().and_then(|order| order.deadline);
        let flown = plan.reported.flight.as_deref();
        let kept_s = flown
            .map(|flown| self.seconds(plan.reported.departs_at) + flown.composition.deadline_s);
        let deadline_s = stated.map(|deadline| self.seconds(deadline)).or(kept_s);
        deadline_s.filter(|deadline_s| deadline_s.is_finite() && *deadline_s > self.seconds(now))
    }

    /// Where the drone of a plan stands, if it does.
    pub(in crate::edge) fn stand(
        &self,
        topology: &Topology,
        plan: &PlanEntry,
        sighting: Option<&Sighting>,
        now: Timestamp,
    ) -> Option<Stand> {
        let version = &plan.reported;
        let flown = version.flight.as_deref()?;
        let start = &flown.composition.plan.start;
        let now_s = now.duration_since(version.departs_at).as_secs_f64();
        let seen = sighting.filter(|sighting| sighting.seen_at >= version.departs_at);
        if start.on_ground && now_s <= start.at_s {
            return Some(Stand {
                node: start.node,
                from: later(version.departs_at, start.at_s),
                battery: start.battery,
            });
        }
        let stops = &flown.composition.plan.stops;
        let stop = stops
            .iter()
            .find(|stop| stop.lands_s <= now_s && now_s < stop.takes_off_s)?;
        let landed_at = later(version.departs_at, stop.lands_s);
        let seen = seen.filter(|sighting| sighting.seen_at >= landed_at);
        let is_elsewhere = seen.is_some_and(|sighting| {
            let place = sighting.position(topology.frame());
            place.distance_m(topology.position(stop.node)) > AT_NODE_M
        });
        if is_elsewhere {
            return None;
        }
        let seen_battery = seen.and_then(|sighting| sighting.battery_fraction);
        Some(Stand {
            node: stop.node,
            from: now,
            battery: seen_battery.unwrap_or_else(|| self.charged(plan, stop, now_s)),
        })
    }

    /// The battery of a drone on a pad, as far as it has been charged by now.
    fn charged(&self, plan: &PlanEntry, stop: &Stop, now_s: f64) -> f64 {
        let handling_s = match stop.kind {
            StopKind::Start => 0.0,
            StopKind::Charge => self.settings.rules.stop_s,
            StopKind::Swap => return stop.battery_before,
        };
        let charging_s = (now_s - stop.lands_s - handling_s).max(0.0);
        let charging = self.kind_of(plan).airframe.charging();
        charging.level_after(stop.battery_before, charging_s)
    }
}

/// What is known of the battery of the drone of a plan.
pub(in crate::edge) fn battery_of(
    plan: &PlanEntry,
    leg: usize,
    sighting: Option<&Sighting>,
) -> BatteryNow {
    let version = &plan.reported;
    let seen = sighting.filter(|sighting| sighting.seen_at >= version.departs_at);
    if let Some(battery) = seen.and_then(|sighting| sighting.battery_fraction) {
        return BatteryNow::Given(battery);
    }
    let flown = version.flight.as_deref();
    let leg = flown.and_then(|flown| flown.composition.plan.legs.get(leg));
    match leg {
        Some(leg) => BatteryNow::ByPlan {
            before: leg.battery_before,
            after: leg.battery_after,
        },
        None => {
            let left = flown.map(|flown| flown.composition.plan.battery_at_arrival);
            BatteryNow::Given(left.unwrap_or_default())
        }
    }
}

/// Where a plan was going to stop from a leg on.
pub(super) fn stops_ahead(plan: &PlanEntry, leg: usize) -> Option<Vec<NodeIx>> {
    let flown = plan.reported.flight.as_deref()?;
    let stops = flown.composition.plan.stops.iter();
    let ahead = stops.filter(|stop| stop.before_leg > leg);
    Some(ahead.map(|stop| stop.node).collect())
}
