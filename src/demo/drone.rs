//! A drone: where it is, what is in its battery, and how it flies what it is told.

use super::client::{Client, ClientError};
use super::flight::Flight;
use super::mailbox::Mailbox;
use super::map::Map;
use crate::clock::Clock;
use crate::geo::Point;
use crate::wire::{self, MessageKind};
use jiff::Timestamp;
use std::sync::Arc;
use std::time::Duration;
use tokio_util::sync::CancellationToken;

/// How often a crew looks around, in the machine's time.
const TICK: Duration = Duration::from_millis(500);
/// What a drone of the demo is.
pub(super) const AIRFRAME: &str = "phantom3";
/// What is in a battery that is full (0.98 is what its charging curve reaches).
const FULL: f64 = 0.98;
/// What is missing in a battery falls to 1/e of it in this many seconds on a pad.
const CHARGE_TAU_S: f64 = 960.0;
/// A version that has its drone farther away than this, in metres, was overtaken by the flight.
const NEAR_M: f64 = 150.0;

/// Who decides what a drone does next.
pub(super) trait Crew: Send {
    /// Its drone.
    fn drone(&mut self) -> &mut Drone;

    /// Whether its drone may be told something now.
    fn listens(&self) -> bool;

    /// What it does of its own accord, once its drone has told where it is.
    fn act(&mut self) -> impl Future<Output = Result<(), ClientError>> + Send;
}

/// Flies with a crew until it is told to stop. What goes wrong is logged, and tried again at the next tick.
pub(super) async fn fly(mut crew: impl Crew, stop: CancellationToken) {
    let mut ticks = tokio::time::interval(TICK);
    ticks.set_missed_tick_behavior(tokio::time::MissedTickBehavior::Delay);
    loop {
        let listens = crew.listens();
        let drone = crew.drone();
        let next = tokio::select! {
            () = stop.cancelled() => return,
            _ = ticks.tick() => None,
            // One after the other.
            told = drone.mailbox.next(), if listens && drone.told.is_none() => told,
        };
        let done = async {
            match next {
                Some(told) => crew.drone().obey(told).await,
                None => tick(&mut crew).await,
            }
        };
        let done = tokio::select! {
            () = stop.cancelled() => return,
            done = done => done,
        };
        if let Err(error) = done {
            tracing::warn!(drone = crew.drone().id, %error, "a crew tries again");
        }
    }
}

async fn tick(crew: &mut impl Crew) -> Result<(), ClientError> {
    let drone = crew.drone();
    drone.advance();
    drone.tell_position().await?;
    if let Some(told) = drone.told.take() {
        drone.obey(told).await?;
    }
    crew.act().await
}

/// A drone.
#[derive(Debug)]
pub(super) struct Drone {
    pub(super) id: String,
    pub(super) map: Arc<Map>,
    pub(super) client: Arc<Client>,
    pub(super) clock: Clock,
    mailbox: Mailbox,
    /// What it was told and has not carried out.
    told: Option<wire::DroneMessage<'static>>,
    /// When it last moved.
    pub(super) moved_at: Timestamp,
    pub(super) battery_fraction: f64,
    pub(super) at: At,
}

/// What a drone is doing.
#[derive(Debug)]
pub(super) enum At {
    /// Landed on a node.
    Station(usize),
    /// Flying a plan.
    Way(Box<Mission>),
}

/// A plan that is flown.
#[derive(Debug)]
pub(super) struct Mission {
    pub(super) plan_id: String,
    /// The node that it begins on.
    from: usize,
    /// The version that is flown. Only a higher one is taken over.
    version: VersionRank,
    pub(super) flight: Flight,
    /// True while the drone waits where it is to be told what to fly instead.
    pub(super) hovers: bool,
}

/// Token, epoch and number of a version.
type VersionRank = (u64, u64, u32);

fn rank_of(version: &wire::PlanVersion<'_>) -> VersionRank {
    (version.token, version.epoch, version.version)
}

impl Drone {
    /// A drone with a full battery that has landed on a node.
    pub(super) fn landed(
        id: String,
        node: usize,
        map: Arc<Map>,
        client: Arc<Client>,
        clock: Clock,
    ) -> Self {
        Self {
            mailbox: Mailbox::open(client.clone(), id.clone()),
            id,
            map,
            client,
            moved_at: clock.now(),
            clock,
            told: None,
            battery_fraction: FULL,
            at: At::Station(node),
        }
    }

    /// Asks for a plan from where it has landed, and begins it; none where there is none that can be flown.
    pub(super) async fn depart(
        &mut self,
        request: &wire::DeliveryRequest,
    ) -> Result<Option<wire::Plan<'static>>, ClientError> {
        let plan = match self.client.compose(request).await {
            Ok(plan) => plan,
            Err(error) if error.is_no_plan() => return Ok(None),
            // The answer to an earlier request was lost: there is a plan that this drone does not know.
            Err(error) if error.is_conflict() => {
                let id = request.id.as_deref().unwrap_or_default();
                self.client.plan(id).await?
            }
            Err(error) => return Err(error),
        };
        Ok(self.begin(&plan.id, &plan.reported).then_some(plan))
    }

    /// Begins a plan where it has landed; `false` where it has not, or the plan leads over nodes that are not on the map.
    fn begin(&mut self, plan_id: &str, version: &wire::PlanVersion<'static>) -> bool {
        let At::Station(node) = self.at else {
            return false;
        };
        let from = (self.map.position(node), self.battery_fraction);
        let Some(mut flight) = Flight::along(&self.map, from, version) else {
            tracing::warn!(plan_id, "the plan leads over nodes that are not on the map");
            return false;
        };
        flight.take_off_at(self.moved_at);
        self.at = At::Way(Box::new(Mission {
            plan_id: plan_id.to_owned(),
            from: node,
            version: rank_of(version),
            flight,
            hovers: false,
        }));
        true
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
            At::Station(node) if self.map.has_pads(*node) => {
                let left = (-elapsed.as_secs_f64() / CHARGE_TAU_S).exp();
                let charged = 1.0 - (1.0 - self.battery_fraction) * left;
                charged.min(FULL).max(self.battery_fraction)
            }
            // Where there is no pad its crew brings another battery.
            At::Station(_) => FULL,
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
            At::Station(_) => (0.0, None, false),
        };
        let entry = wire::TelemetryEntry {
            drone_id: self.id.clone(),
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
            At::Station(node) => self.map.position(*node),
            At::Way(mission) => mission.flight.place(self.moved_at),
        }
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
        let now = self.moved_at;
        match (&mut self.at, told.kind, &told.version) {
            (At::Station(_), MessageKind::Assigned, Some(version)) => {
                self.begin(&told.plan_id, version);
            }
            (At::Way(mission), kind, version) if *mission.plan_id == *told.plan_id => {
                match (kind, version) {
                    (MessageKind::Version | MessageKind::Offer, Some(version)) => {
                        return self.answer(version).await;
                    }
                    (MessageKind::NoWay, _) => mission.hovers = true,
                    // What has not taken off stays.
                    (MessageKind::Ended, _) if !mission.flight.has_begun(now) => {
                        self.at = At::Station(mission.from);
                    }
                    (MessageKind::Relieved | MessageKind::Ended, _) => mission.hovers = false,
                    _ => {}
                }
            }
            _ => {}
        }
        self.client.receive(&self.id, &told.id).await
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

    /// Lands at the end of the path, where the plan is done with; tells whether it has.
    pub(super) async fn land(&mut self) -> Result<bool, ClientError> {
        let At::Way(mission) = &self.at else {
            return Ok(false);
        };
        if !mission.flight.is_over(self.moved_at) {
            return Ok(false);
        }
        let place = self.map.coordinates(mission.flight.place(self.moved_at));
        match self.client.complete_plan(&mission.plan_id, place).await {
            Ok(()) => {}
            // Somebody has ended it before.
            Err(error) if error.is_conflict() || error.is_missing() => {}
            Err(error) => return Err(error),
        }
        self.at = At::Station(mission.flight.end());
        Ok(true)
    }
}
