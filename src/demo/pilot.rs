//! One drone: it asks for a plan, flies it, tells where it is, reports what fails, and flies what it is told.

use super::client::{Client, ClientError};
use super::flight::Flight;
use super::map::Map;
use super::script::{Delivery, PilotScript, PlannedFailure};
use crate::clock::Clock;
use crate::geo::Point;
use crate::wire;
use jiff::{SignedDuration, Timestamp};
use std::sync::Arc;
use std::time::Duration;
use tokio_util::sync::CancellationToken;

/// How often a pilot looks around, in the machine's time.
const TICK: Duration = Duration::from_millis(500);
/// What its drone is.
const AIRFRAME: &str = "phantom3";
/// What is in a battery that is full (0.98 is what its charging curve reaches).
const FULL: f64 = 0.98;
/// What is missing in a battery falls to 1/e of it in so many seconds on a pad.
const CHARGE_TAU_S: f64 = 960.0;

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
    destination: wire::Id<'static>,
    flight: Flight,
    /// What is still to fail, and when.
    failure: Option<(PlannedFailure, Timestamp)>,
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
        let elapsed = now.duration_since(self.moved_at);
        self.moved_at = now;
        self.advance(elapsed);
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

    /// Lets a battery run down in the air, and charge on a pad.
    fn advance(&mut self, elapsed: SignedDuration) {
        let now = self.moved_at;
        self.battery_fraction = match &mut self.at {
            At::Way(mission) => {
                if mission.hovers {
                    mission.flight.wait(now, elapsed);
                }
                mission.flight.battery(now)
            }
            At::Station { node, .. } if self.map.has_pads(*node) => {
                let left = (-elapsed.as_secs_f64() / CHARGE_TAU_S).exp();
                let charged = 1.0 - (1.0 - self.battery_fraction) * left;
                charged.min(FULL).max(self.battery_fraction)
            }
            // Where there is no pad its crew brings another battery.
            At::Station { .. } => FULL,
        };
    }

    async fn tell_position(&self) -> Result<Option<wire::Position<'static>>, ClientError> {
        let now = self.moved_at;
        let (speed_mps, heading_deg, airborne) = match &self.at {
            At::Way(mission) => {
                let flight = &mission.flight;
                let speed_mps = match mission.hovers {
                    true => 0.0,
                    false => flight.ground_speed_mps(now),
                };
                (speed_mps, flight.heading_deg(now), !flight.is_on_pad(now))
            }
            At::Station { .. } => (0.0, None, false),
        };
        let entry = wire::TelemetryEntry {
            drone_id: self.drone_id.clone(),
            location: wire::Place::Pair(self.map.coordinates(self.place())),
            timestamp: None,
            altitude_m: None,
            altitude_reference: None,
            airborne: Some(airborne),
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
            At::Way(mission) => mission.flight.place(self.moved_at),
        }
    }

    /// Asks for the plan of the next delivery.
    async fn depart(&mut self, node: usize) -> Result<(), ClientError> {
        let delivery = self.script.delivery(&self.map, node);
        self.asked += 1;
        let request = wire::DeliveryRequest {
            id: Some(format!("{}-{}", self.drone_id, self.asked)),
            source: self.map.id(node).clone(),
            destination: Some(self.map.id(delivery.destination).clone()),
            stops: None,
            start_time: None,
            payload_kg: Some(delivery.payload_kg),
            drone_id: Some(self.drone_id.clone()),
            airspeed_mps: None,
            airframe: Some(AIRFRAME.to_owned()),
            battery_fraction: Some(self.battery_fraction),
            objective: None,
            deadline: None,
            priority: None,
        };
        let plan = match self.client.compose(&request).await {
            Ok(plan) => plan,
            // It charges, a pad becomes free, or the wind drops: the next delivery is another one.
            Err(error) if error.is_no_plan() => {
                self.at = self.station(node);
                return Ok(());
            }
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
        let from = (self.map.position(node), self.battery_fraction);
        let flight = Flight::along(&self.map, from, &plan.reported)?;
        let failure = delivery.failure;
        let failure = failure.map(|planned| (planned, flight.after(planned.after_fraction)));
        Some(Mission {
            plan_id: plan.id.to_string(),
            version: plan.reported.version,
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
        let from = (place, self.battery_fraction);
        let Some(flight) = Flight::along(&self.map, from, &wanted) else {
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
        let now = self.moved_at;
        let Some((planned, _)) = mission.failure.filter(|(_, at)| now >= *at) else {
            return Ok(());
        };
        let Some(leg) = mission.flight.leg(now).filter(|_| !mission.hovers) else {
            return Ok(());
        };
        let location = self.map.coordinates(mission.flight.place(now));
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
                airframe: Some(AIRFRAME.to_owned()),
                battery_fraction: Some(self.battery_fraction),
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
        if !mission.flight.is_over(self.moved_at) {
            return Ok(());
        }
        let place = self.map.coordinates(mission.flight.place(self.moved_at));
        match self.client.complete_plan(&mission.plan_id, place).await {
            Ok(()) => {}
            // Somebody has ended it before.
            Err(error) if error.is_conflict() || error.is_missing() => {}
            Err(error) => return Err(error),
        }
        let node = mission.flight.end();
        self.at = self.station(node);
        Ok(())
    }

    /// On a node for a while.
    fn station(&mut self, node: usize) -> At {
        let now = self.clock.now();
        let until = now.saturating_add(self.script.turnaround()).unwrap_or(now);
        At::Station { node, until }
    }
}
