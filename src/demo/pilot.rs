//! One drone: it asks for a plan, flies it, tells where it is, reports what fails, and flies what it is told.

use super::client::{Client, ClientError};
use super::flight::Flight;
use super::map::Map;
use super::script::{Delivery, PilotScript, PlannedFailure};
use crate::clock::Clock;
use crate::geo::Point;
use crate::wire;
use jiff::Timestamp;
use std::sync::Arc;
use std::time::Duration;
use tokio_util::sync::CancellationToken;

/// How often a pilot looks around, in the machine's time.
const TICK: Duration = Duration::from_millis(500);
/// What is left in a battery that is full (0.98 is what its charging curve reaches).
const FULL: f64 = 0.98;
/// What a metre takes of a battery: 3.95 Wh/km of 68.1 Wh, a DJI Phantom 3 without payload at 16 m/s.
const BATTERY_PER_M: f64 = 3.95e-3 / 68.1;

/// A pilot and its drone.
#[derive(Debug)]
pub(super) struct Pilot {
    drone_id: String,
    script: PilotScript,
    map: Arc<Map>,
    client: Arc<Client>,
    clock: Clock,
    /// When it last moved.
    moved_at: Timestamp,
    /// How many plans it has asked for.
    asked: u32,
    battery_fraction: f64,
    at: At,
}

/// What a drone is doing.
#[derive(Debug)]
enum At {
    /// Landed on a node, until its next delivery.
    Station { node: usize, until: Timestamp },
    /// Flying a plan.
    Way(Box<Mission>),
}

/// A plan that is flown.
#[derive(Debug)]
struct Mission {
    plan_id: String,
    version: u32,
    airspeed_mps: f64,
    destination: wire::Id<'static>,
    flight: Flight,
    /// What is still to fail, and how many metres before the end.
    failure: Option<(PlannedFailure, f64)>,
    /// True while the drone waits where it is to be told what to fly instead.
    hovers: bool,
}

impl Pilot {
    /// A pilot whose drone has landed on a node of the script's choice.
    pub(super) fn new(
        number: u32,
        mut script: PilotScript,
        map: Arc<Map>,
        client: Arc<Client>,
        clock: Clock,
    ) -> Self {
        let now = clock.now();
        let node = script.home(&map);
        let until = now.saturating_add(script.first_wait()).unwrap_or(now);
        Self {
            drone_id: format!("drone-{number}"),
            script,
            map,
            client,
            clock,
            moved_at: now,
            asked: 0,
            battery_fraction: FULL,
            at: At::Station { node, until },
        }
    }

    /// Flies until it is told to stop. What goes wrong is logged, and tried again at the next tick.
    pub(super) async fn fly(mut self, stop: CancellationToken) {
        let mut ticks = tokio::time::interval(TICK);
        ticks.set_missed_tick_behavior(tokio::time::MissedTickBehavior::Delay);
        loop {
            tokio::select! {
                () = stop.cancelled() => return,
                _ = ticks.tick() => {}
            }
            tokio::select! {
                () = stop.cancelled() => return,
                done = self.tick() => if let Err(error) = done {
                    tracing::warn!(drone = self.drone_id, %error, "a pilot tries again");
                }
            }
        }
    }

    async fn tick(&mut self) -> Result<(), ClientError> {
        let now = self.clock.now();
        let elapsed_s = now.duration_since(self.moved_at).as_secs_f64();
        self.moved_at = now;
        self.advance(elapsed_s);
        let told = self.tell_position().await?;
        if let At::Station { node, until } = self.at {
            return match now >= until {
                true => self.depart(node).await,
                false => Ok(()),
            };
        }
        if let Some(told) = told {
            self.obey(told).await?;
        }
        self.report_what_fails().await?;
        self.land().await
    }

    fn advance(&mut self, elapsed_s: f64) {
        let At::Way(mission) = &mut self.at else {
            return;
        };
        let metres = match mission.hovers {
            true => 0.0,
            false => mission.airspeed_mps * elapsed_s,
        };
        let before_m = mission.flight.remaining_m();
        mission.flight.advance(metres);
        let flown_m = before_m - mission.flight.remaining_m();
        self.battery_fraction = (self.battery_fraction - flown_m * BATTERY_PER_M).max(0.0);
    }

    async fn tell_position(&self) -> Result<Option<wire::Position<'static>>, ClientError> {
        let (speed_mps, heading_deg) = match &self.at {
            At::Way(mission) if !mission.hovers => {
                (mission.airspeed_mps, mission.flight.heading_deg())
            }
            At::Way(mission) => (0.0, mission.flight.heading_deg()),
            At::Station { .. } => (0.0, None),
        };
        let entry = wire::TelemetryEntry {
            drone_id: self.drone_id.clone(),
            location: wire::Place::Pair(self.map.coordinates(self.place())),
            timestamp: None,
            altitude_m: None,
            altitude_reference: None,
            airborne: Some(matches!(self.at, At::Way(_))),
            leg: None,
            fraction: None,
            battery_fraction: Some(self.battery_fraction),
            ground_speed_mps: Some(speed_mps),
            heading_deg,
        };
        self.client.telemetry(&entry).await
    }

    fn place(&self) -> Point {
        match &self.at {
            At::Station { node, .. } => self.map.position(*node),
            At::Way(mission) => mission.flight.place(),
        }
    }

    /// Asks for the plan of the next delivery.
    async fn depart(&mut self, node: usize) -> Result<(), ClientError> {
        let delivery = self.script.delivery(&self.map, node);
        self.asked += 1;
        let request = wire::DeliveryRequest {
            id: Some(format!("{}-{}", self.drone_id, self.asked)),
            source: self.map.id(node).clone(),
            destination: self.map.id(delivery.destination).clone(),
            start_time: None,
            payload_kg: Some(delivery.payload_kg),
            drone_id: Some(self.drone_id.clone()),
            airspeed_mps: Some(delivery.airspeed_mps),
            airframe: None,
            battery_fraction: None,
            objective: None,
            deadline: None,
        };
        let plan = match self.client.compose(&request).await {
            Ok(plan) => plan,
            // The answer to an earlier request was lost, so there is a plan that this drone does not know.
            Err(error) if error.is_conflict() => return self.end_unknown_plans().await,
            Err(error) => return Err(error),
        };
        match self.mission(&plan, delivery, node) {
            Some(mission) => self.at = At::Way(Box::new(mission)),
            None => {
                tracing::warn!(plan = %plan.id, "the plan leads over nodes that are not on the map")
            }
        }
        Ok(())
    }

    fn mission(
        &self,
        plan: &wire::Plan<'static>,
        delivery: Delivery,
        node: usize,
    ) -> Option<Mission> {
        let nodes = &plan.reported.path.nodes;
        let flight = Flight::along(&self.map, self.map.position(node), nodes)?;
        let length_m = flight.remaining_m();
        let failure = delivery.failure.map(|planned| {
            let before_end_m = length_m * (1.0 - planned.after_fraction);
            (planned, before_end_m)
        });
        Some(Mission {
            plan_id: plan.id.to_string(),
            version: plan.reported.version,
            airspeed_mps: delivery.airspeed_mps,
            destination: plan.destination.clone(),
            flight,
            failure,
            hovers: false,
        })
    }

    async fn end_unknown_plans(&self) -> Result<(), ClientError> {
        let plans = self.client.plans_of(&self.drone_id).await?.plans;
        let is_flown = |plan: &&wire::Plan<'_>| plan.state != wire::PlanState::Ended;
        for plan in plans.iter().filter(is_flown) {
            self.client.end_plan(&plan.id).await?;
        }
        Ok(())
    }

    /// Takes over what the edge proposes; waits where there is nothing to fly yet.
    async fn obey(&mut self, told: wire::Position<'static>) -> Result<(), ClientError> {
        let place = self.place();
        let At::Way(mission) = &mut self.at else {
            return Ok(());
        };
        if told.plan_id.as_deref() != Some(&*mission.plan_id) {
            // Its time is over, or somebody has cancelled it: this drone will be told nothing new.
            mission.hovers = false;
            return Ok(());
        }
        mission.hovers = told.affected;
        let Some(wanted) = told
            .wanted
            .filter(|wanted| wanted.version != mission.version)
        else {
            return Ok(());
        };
        let Some(flight) = Flight::along(&self.map, place, &wanted.path.nodes) else {
            return Ok(());
        };
        let ack = wire::Ack {
            version: wanted.version,
            location: Some(wire::Place::Pair(self.map.coordinates(place))),
            ..wire::Ack::default()
        };
        match self.client.acknowledge(&mission.plan_id, &ack).await {
            Ok(()) => {
                mission.version = wanted.version;
                mission.flight = flight;
                mission.hovers = false;
                Ok(())
            }
            // The plan is over: the next answer tells.
            Err(error) if error.is_conflict() => Ok(()),
            Err(error) => Err(error),
        }
    }

    /// Reports what fails here by the script, once.
    async fn report_what_fails(&mut self) -> Result<(), ClientError> {
        let At::Way(mission) = &mut self.at else {
            return Ok(());
        };
        let Some((planned, before_end_m)) = mission.failure else {
            return Ok(());
        };
        let Some(leg) = mission.flight.leg().filter(|_| !mission.hovers) else {
            return Ok(());
        };
        if mission.flight.remaining_m() > before_end_m {
            return Ok(());
        }
        let location = self.map.coordinates(mission.flight.place());
        let report = wire::FailureReport {
            id: Some(wire::Id::new(format!("{}-failure", mission.plan_id))),
            failure: Some(planned.failure),
            service: Some(wire::Service {
                plan_id: Some(mission.plan_id.clone()),
                leg: Some(leg),
                ..wire::Service::default()
            }),
            location: Some(wire::Place::Pair(location)),
            drone: Some(wire::DroneFacts {
                id: Some(self.drone_id.clone()),
                battery_fraction: Some(self.battery_fraction),
                airspeed_mps: Some(mission.airspeed_mps),
                ..wire::DroneFacts::default()
            }),
            destination: Some(mission.destination.clone()),
            ..wire::FailureReport::default()
        };
        let answer = self.client.report(&report).await?;
        mission.failure = None;
        // The version to take over comes with the next answer to telemetry, as after a zone.
        mission.hovers = answer.answer.outcome != wire::Outcome::Unaffected;
        Ok(())
    }

    /// At the end of the path the plan is done with, and the drone stays for a while.
    async fn land(&mut self) -> Result<(), ClientError> {
        let At::Way(mission) = &self.at else {
            return Ok(());
        };
        if !mission.flight.is_over() {
            return Ok(());
        }
        let place = self.map.coordinates(mission.flight.place());
        match self.client.complete_plan(&mission.plan_id, place).await {
            Ok(()) => {}
            // Somebody has ended it before.
            Err(error) if error.is_conflict() || error.is_missing() => {}
            Err(error) => return Err(error),
        }
        let node = mission.flight.end();
        let now = self.clock.now();
        let until = now.saturating_add(self.script.turnaround()).unwrap_or(now);
        self.battery_fraction = FULL;
        self.at = At::Station { node, until };
        Ok(())
    }
}
