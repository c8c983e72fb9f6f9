//! What the drone of a plan is to fly when the world has changed, by the flight model.

use super::known::assumed_of;
use super::reported::ReportingDrone;
use super::terms::DroneKind;
use super::{Budget, Flights, FlownVersion, Ground};
use crate::drones::Sighting;
use crate::planner::{AT_NODE_M, ON_PAD_M};
use crate::planner::{Answer, Scene, Version, later};
use crate::plans::entry::PlanEntry;
use jiff::Timestamp;
use skyway_engine::delivery::BatteryNow;
use skyway_engine::flight::{Stop, StopKind};
use skyway_engine::itinerary::{FlightCause, Objective};
use skyway_engine::network::{NodeIx, Topology};
use skyway_engine::recompose::{Request, Severance};
use std::sync::Arc;

/// A drone that stands on a pad, or has not left yet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Stand {
    pub(super) node: NodeIx,
    /// On which pad, counted from 0, where that is known.
    pub(super) pad: Option<u16>,
    /// From when on it can do anything.
    pub(super) from: Timestamp,
    pub(super) battery: f64,
}

impl Flights {
    /// What flies a plan.
    pub(super) fn kind_of(&self, plan: &PlanEntry) -> DroneKind {
        let named = plan.order.as_ref().map(|order| &*order.airframe);
        let airspeed_mps = Some(plan.airspeed_mps);
        let airframe = self.airframe(named, airspeed_mps);
        // What the configuration does not have any more is flown as the default.
        let airframe = airframe.unwrap_or_else(|| self.settings.airframe.clone());
        DroneKind::new(airframe, plan.payload_kg)
    }

    /// Ids of the closures that a version of a plan meets from a leg on, at the times at which it is there.
    pub(super) fn closures_met(
        &self,
        scene: Scene<'_>,
        plan: &PlanEntry,
        (version, flown): (&Version, &FlownVersion),
        from_leg: usize,
    ) -> Vec<String> {
        let (sky, setting) = self.bare(scene, &self.kind_of(plan));
        let departs_s = self.seconds(version.departs_at);
        let timed = flown.composition_at(departs_s);
        let met = setting.in_the_way(&timed.plan, timed.began_s, from_leg);
        let mut ids: Vec<String> = met
            .iter()
            .filter_map(|cause| match cause {
                FlightCause::Closure(number) => sky.skies.cause_of(*number),
                _ => None,
            })
            .filter_map(|severance| match severance {
                Severance::Closure(id) => Some(id),
                Severance::Report | Severance::Network => None,
            })
            .collect();
        ids.sort_unstable();
        ids.dedup();
        ids
    }

    /// Whether the wind leaves a version of a plan short from a leg on, by more than telemetry may be off.
    pub(super) fn exceeds_battery(
        &self,
        scene: Scene<'_>,
        plan: &PlanEntry,
        (version, flown): (&Version, &FlownVersion),
        from_leg: usize,
    ) -> bool {
        let compiled = self.compiled(scene, &self.kind_of(plan));
        let timed = flown.composition_at(self.seconds(version.departs_at));
        let least = (timed.reserve - self.settings.battery_tolerance).max(0.0);
        compiled
            .setting
            .exceeds_battery(&timed.plan, from_leg, least)
    }

    /// Answers the drone of a plan that stands somewhere.
    pub(super) fn answer_standing(
        self: &Arc<Self>,
        scene: Scene<'_>,
        plan: &PlanEntry,
        (stand, sighting): (Stand, Option<&Sighting>),
        request: &Request,
    ) -> Answer {
        let drone = ReportingDrone {
            battery: BatteryNow::Given(stand.battery),
            stand: Some(stand),
            planned_stops: None,
            ..self.drone_of(scene, plan, sighting)
        };
        self.answer_report(scene, drone, request)
    }

    /// Answers the drone of a plan by a request that says where it is: on a leg.
    pub(super) fn answer_in_flight(
        self: &Arc<Self>,
        scene: Scene<'_>,
        plan: &PlanEntry,
        request: &Request,
        (leg, sighting): (usize, Option<&Sighting>),
    ) -> Answer {
        let drone = ReportingDrone {
            battery: battery_of(plan, leg, sighting),
            planned_stops: stops_ahead(plan, leg),
            ..self.drone_of(scene, plan, sighting)
        };
        self.answer_report(scene, drone, request)
    }

    /// The drone of a plan, of which its plan says everything.
    fn drone_of(
        &self,
        scene: Scene<'_>,
        plan: &PlanEntry,
        sighting: Option<&Sighting>,
    ) -> ReportingDrone {
        ReportingDrone {
            kind: self.kind_of(plan),
            battery: BatteryNow::Given(0.0),
            assumed: assumed_of(Some(plan), sighting, scene.now),
            objective: self.objective_of(plan),
            deadline_s: self.deadline_s(plan, scene.now),
            planned_stops: None,
            stand: None,
            landing: None,
            budget: Budget::Wave,
            plan: Some(plan.id.clone()),
            drone_id: plan.drone_id.clone(),
        }
    }

    /// What the drone of a plan flies in.
    pub(super) fn ground_of(&self, scene: Scene<'_>, plan: &PlanEntry) -> Ground {
        let own = scene.traffic.own_of_plan(plan);
        self.ground(scene, &self.kind_of(plan), own, Budget::Wave)
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

    /// Until when closures may be in the way of a version. Windows are widened the more the longer they are ahead, and telemetry may
    /// show a drone somewhat late.
    pub(super) fn over_at(&self, version: &Version) -> Timestamp {
        let rules = &self.settings.rules;
        let flight_s = version.composition.flight_time_s.max(0.0);
        let margin_s = rules.time_margin_s + rules.time_margin_growth * flight_s;
        later(version.arrives_at(), 600.0 + 0.1 * flight_s + margin_s)
    }

    /// Where the drone of a plan stands, if it does.
    pub(super) fn stand(
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
        let stops = &flown.composition.plan.stops;
        let first = stops.first().filter(|stop| stop.before_leg == 0);
        if start.on_ground && now_s <= start.at_s {
            return Some(Stand {
                node: start.node,
                pad: start.pad.or(first.map(|stop| stop.pad)),
                from: later(version.departs_at, start.at_s),
                battery: start.battery,
            });
        }
        let waits_at = |node| Stand {
            node,
            pad: version.pad_at(node, now),
            from: now,
            battery: seen
                .and_then(Sighting::battery_here)
                .unwrap_or(start.battery),
        };
        if let Some(node) = version.holds_at() {
            return Some(waits_at(node));
        }
        let stop = stops
            .iter()
            .find(|stop| stop.lands_s <= now_s && now_s < stop.takes_off_s);
        let Some(stop) = stop else {
            return plan.waits_at().map(waits_at);
        };
        let landed_at = later(version.departs_at, stop.lands_s);
        let seen = seen.filter(|sighting| sighting.seen_at >= landed_at);
        let is_elsewhere = seen.is_some_and(|sighting| {
            let place = sighting.position(topology.frame());
            let off_m = place.distance_m(topology.position(stop.node));
            let is_in_the_air = sighting.airborne == Some(true);
            off_m > if is_in_the_air { ON_PAD_M } else { AT_NODE_M }
        });
        if is_elsewhere {
            return None;
        }
        Some(self.on_stop(plan, stop, seen, now))
    }

    /// Where its drone stands at a stop that it has landed for: it is handled before it can do anything.
    fn on_stop(
        &self,
        plan: &PlanEntry,
        stop: &Stop,
        seen: Option<&Sighting>,
        now: Timestamp,
    ) -> Stand {
        let departs_at = plan.reported.departs_at;
        let now_s = now.duration_since(departs_at).as_secs_f64();
        let rules = &self.settings.rules;
        let handling_s = match stop.kind {
            StopKind::Start => 0.0,
            StopKind::Charge => rules.stop_s,
            StopKind::Swap => rules.swap_s,
        };
        let ready_s = stop.lands_s + handling_s;
        let has_it_ahead = now_s < ready_s;
        let seen_battery = seen.and_then(Sighting::battery_here);
        // What it says of a battery that is about to be swapped ends with that.
        let seen_battery = seen_battery.filter(|_| stop.kind != StopKind::Swap || !has_it_ahead);
        Stand {
            node: stop.node,
            pad: Some(stop.pad),
            from: match has_it_ahead {
                true => later(departs_at, ready_s),
                false => now,
            },
            battery: seen_battery.unwrap_or_else(|| self.charged(plan, stop, now_s - ready_s)),
        }
    }

    /// The battery of a drone on a pad, a time in seconds after it was handled there; before that, the battery with which it landed.
    fn charged(&self, plan: &PlanEntry, stop: &Stop, after_s: f64) -> f64 {
        let charging = self.kind_of(plan).airframe.charging();
        match stop.kind {
            StopKind::Swap => charging.full,
            _ => charging.level_after(stop.battery_before, after_s.max(0.0)),
        }
    }
}

/// What is known of the battery of the drone of a plan.
fn battery_of(plan: &PlanEntry, leg: usize, sighting: Option<&Sighting>) -> BatteryNow {
    let version = &plan.reported;
    let seen = sighting.filter(|sighting| sighting.seen_at >= version.departs_at);
    if let Some(battery) = seen.and_then(Sighting::battery_here) {
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
