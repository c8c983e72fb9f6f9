//! One drone: it asks for a plan, flies it, tells where it is, reports what fails, and flies what it is told.

use super::client::{Client, ClientError};
use super::flight::Flight;
use super::mailbox::Mailbox;
use super::map::Map;
use super::script::{Delivery, PilotScript, PlannedFailure};
use crate::clock::Clock;
use crate::geo::Point;
use crate::wire::{self, MessageKind};
use jiff::Timestamp;
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
/// A version that has its drone farther away than this, in metres, was overtaken by the flight.
const NEAR_M: f64 = 150.0;

/// A pilot and its drone.
#[derive(Debug)]
pub(super) struct Pilot {
    drone_id: String,
    script: PilotScript,
    map: Arc<Map>,
    client: Arc<Client>,
    clock: Clock,
    mailbox: Mailbox,
    /// What it was told and has not carried out.
    told: Option<wire::DroneMessage<'static>>,
    /// When it last moved.
    moved_at: Timestamp,
    /// How many plans it has asked for.
    plan_count: u32,
    /// The plan that it has asked for and was not answered.
    asked: Option<(Delivery, wire::DeliveryRequest)>,
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
    /// The version that is flown. Only a higher one is taken over.
    version: VersionRank,
    destination: wire::Id<'static>,
    flight: Flight,
    /// What is still to fail, and when.
    failure: Option<(PlannedFailure, Timestamp)>,
    /// True while the drone waits where it is to be told what to fly instead.
    hovers: bool,
}

/// Token, epoch and number of a version.
type VersionRank = (u64, u64, u32);

fn rank_of(version: &wire::PlanVersion<'_>) -> VersionRank {
    (version.token, version.epoch, version.version)
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
        let drone_id = format!("drone-{number}");
        Self {
            mailbox: Mailbox::open(client.clone(), drone_id.clone()),
            told: None,
            drone_id,
            script,
            map,
            client,
            clock,
            moved_at: now,
            plan_count: 0,
            asked: None,
            battery_fraction: FULL,
            at: At::Station { node, until },
        }
    }

    /// Flies until it is told to stop. What goes wrong is logged, and tried again at the next tick.
    pub(super) async fn fly(mut self, stop: CancellationToken) {
        let mut ticks = tokio::time::interval(TICK);
        ticks.set_missed_tick_behavior(tokio::time::MissedTickBehavior::Delay);
        loop {
            let next = tokio::select! {
                () = stop.cancelled() => return,
                _ = ticks.tick() => None,
                // One after the other; and none about a plan of which it does not know.
                told = self.mailbox.next(), if self.told.is_none() && self.asked.is_none() => told,
            };
            let done = async {
                match next {
                    Some(told) => self.obey(told).await,
                    None => self.tick().await,
                }
            };
            tokio::select! {
                () = stop.cancelled() => return,
                done = done => if let Err(error) = done {
                    tracing::warn!(drone = self.drone_id, %error, "a pilot tries again");
                }
            }
        }
    }

    async fn tick(&mut self) -> Result<(), ClientError> {
        self.advance();
        self.tell_position().await?;
        if let Some(told) = self.told.take() {
            self.obey(told).await?;
        }
        match self.at {
            At::Station { node, until } if self.moved_at >= until => self.depart(node).await,
            At::Station { .. } => Ok(()),
            At::Way(_) => {
                self.report_what_fails().await?;
                self.land().await
            }
        }
    }

    /// Lets a battery run down in the air, and charge on a pad.
    fn advance(&mut self) {
        let now = self.clock.now();
        let elapsed = now.duration_since(self.moved_at);
        self.moved_at = now;
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

    async fn tell_position(&self) -> Result<(), ClientError> {
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
        let (delivery, request) = match self.asked.take() {
            Some(asked) => asked,
            None => self.next_delivery(node),
        };
        let plan = match self.client.compose(&request).await {
            Ok(plan) => plan,
            // It charges, a pad becomes free, or the wind drops: the next delivery is another one.
            Err(error) if error.is_no_plan() => {
                self.at = self.station(node);
                return Ok(());
            }
            // The answer to an earlier request was lost: there is a plan that this drone does not know.
            Err(error) => {
                let id = request.id.clone().unwrap_or_default();
                self.asked = Some((delivery, request));
                match error.is_conflict() {
                    true => self.client.plan(&id).await?,
                    false => return Err(error),
                }
            }
        };
        self.asked = None;
        match self.mission(&plan, delivery, node) {
            Some(mission) => self.at = At::Way(Box::new(mission)),
            None => {
                tracing::warn!(plan = %plan.id, "the plan leads over nodes that are not on the map")
            }
        }
        Ok(())
    }

    fn next_delivery(&mut self, node: usize) -> (Delivery, wire::DeliveryRequest) {
        let delivery = self.script.delivery(&self.map, node);
        self.plan_count += 1;
        let request = wire::DeliveryRequest {
            id: Some(format!("{}-{}", self.drone_id, self.plan_count)),
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
        (delivery, request)
    }

    fn mission(
        &self,
        plan: &wire::Plan<'static>,
        delivery: Delivery,
        node: usize,
    ) -> Option<Mission> {
        let from = (self.map.position(node), self.battery_fraction);
        let mut flight = Flight::along(&self.map, from, &plan.reported)?;
        flight.begin_at(self.moved_at);
        let failure = delivery.failure;
        let failure = failure.map(|planned| (planned, flight.after(planned.after_fraction)));
        Some(Mission {
            plan_id: plan.id.to_string(),
            version: rank_of(&plan.reported),
            destination: plan.destination.clone(),
            flight,
            failure,
            hovers: false,
        })
    }

    /// Carries out what it was told, and keeps it for the next tick where the edge could not be told so.
    async fn obey(&mut self, told: wire::DroneMessage<'static>) -> Result<(), ClientError> {
        self.advance();
        let done = self.carry_out(&told).await;
        if done.is_err() {
            self.told = Some(told);
        }
        done
    }

    async fn carry_out(&mut self, told: &wire::DroneMessage<'static>) -> Result<(), ClientError> {
        if let At::Way(mission) = &mut self.at
            && *mission.plan_id == *told.plan_id
        {
            match (told.kind, &told.version) {
                (MessageKind::Version | MessageKind::Offer, Some(version)) => {
                    return self.answer(version).await;
                }
                (MessageKind::NoWay, _) => mission.hovers = true,
                (MessageKind::Relieved | MessageKind::Ended, _) => mission.hovers = false,
                _ => {}
            }
        }
        self.client.receive(&self.drone_id, &told.id).await
    }

    /// Takes a version over, or declines it where the drone has flown past its beginning.
    async fn answer(&mut self, version: &wire::PlanVersion<'static>) -> Result<(), ClientError> {
        let place = self.place();
        let location = Some(wire::Place::Pair(self.map.coordinates(place)));
        let At::Way(mission) = &mut self.at else {
            return Ok(());
        };
        let mut is_declined = false;
        if rank_of(version) > mission.version {
            let from = (place, self.battery_fraction);
            let flight = Flight::along(&self.map, from, version)
                .filter(|flight| flight.place(self.moved_at).distance_m(place) <= NEAR_M);
            match flight {
                Some(flight) => {
                    mission.version = rank_of(version);
                    mission.flight = flight;
                    mission.hovers = false;
                }
                None => is_declined = true,
            }
        }
        let answered = match is_declined {
            true => {
                let decline = wire::Decline {
                    version: version.version,
                    reason: Some("passed".to_owned()),
                    location,
                    ..wire::Decline::default()
                };
                self.client.decline(&mission.plan_id, &decline).await
            }
            false => {
                let ack = wire::Ack {
                    version: mission.version.2,
                    location,
                    ..wire::Ack::default()
                };
                self.client.acknowledge(&mission.plan_id, &ack).await
            }
        };
        match answered {
            // The plan is over, which the next message tells.
            Err(error) if error.is_conflict() => Ok(()),
            answered => answered,
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
        // The version to take over comes by itself, as after a zone.
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
