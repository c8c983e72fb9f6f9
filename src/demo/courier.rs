//! A drone of a provider: it stands at home, flies what it is assigned, and comes home.

use super::client::{Client, ClientError};
use super::drone::{AIRFRAME, At, Crew, Drone};
use super::map::Map;
use super::market::Market;
use crate::clock::Clock;
use crate::wire;
use jiff::{SignedDuration, Timestamp};
use std::sync::Arc;

/// Before it asks again for a way home, or to be assigned again, in simulated time.
const AGAIN_AFTER: SignedDuration = SignedDuration::from_secs(30);

/// A courier and its drone.
#[derive(Debug)]
pub(super) struct Courier {
    drone: Drone,
    home: usize,
    market: Arc<Market>,
    /// How often it has flown home by itself.
    return_count: u32,
    /// Whether it has landed elsewhere since the registry was told that it is at home.
    was_astray: bool,
    /// Before that it asks for nothing.
    until: Timestamp,
}

impl Courier {
    /// A courier whose drone stands at home.
    pub(super) fn new(
        (drone_id, home): (String, usize),
        map: Arc<Map>,
        client: Arc<Client>,
        market: Arc<Market>,
        clock: Clock,
    ) -> Self {
        let until = clock.now();
        Self {
            drone: Drone::landed(drone_id, home, map, client, clock),
            home,
            market,
            return_count: 0,
            was_astray: false,
            until,
        }
    }

    /// Flies home from where it was diverted to.
    async fn fly_home(&mut self, node: usize) -> Result<(), ClientError> {
        self.was_astray = true;
        let map = &self.drone.map;
        let request = wire::DeliveryRequest {
            id: Some(format!(
                "{}-home-{}",
                self.drone.id.replace(':', "-"),
                self.return_count + 1
            )),
            source: map.id(node).clone(),
            destination: Some(map.id(self.home).clone()),
            stops: None,
            start_time: None,
            payload_kg: Some(0.0),
            drone_id: Some(self.drone.id.clone()),
            airspeed_mps: None,
            airframe: Some(AIRFRAME.to_owned()),
            battery_fraction: Some(self.drone.battery_fraction),
            objective: None,
            deadline: None,
            priority: None,
            delivery_id: None,
        };
        match self.drone.depart(&request).await? {
            Some(_) => self.return_count += 1,
            None => self.pause(),
        }
        Ok(())
    }

    /// Tells the registry that it is at home again. While the registry is away it is told later.
    async fn report_home(&mut self) {
        let home = self.drone.map.id(self.home);
        match self.market.put_drone(&self.drone.id, home).await {
            Ok(()) => self.was_astray = false,
            Err(error) => {
                tracing::info!(drone = self.drone.id, %error, "it is not known yet that it is at home");
                self.pause();
            }
        }
    }

    fn pause(&mut self) {
        let now = self.drone.moved_at;
        self.until = now.saturating_add(AGAIN_AFTER).unwrap_or(now);
    }
}

impl Crew for Courier {
    fn drone(&mut self) -> &mut Drone {
        &mut self.drone
    }

    fn listens(&self) -> bool {
        true
    }

    async fn act(&mut self) -> Result<(), ClientError> {
        let is_time = self.drone.moved_at >= self.until;
        match self.drone.at {
            At::Way(_) => {
                self.drone.land().await?;
                Ok(())
            }
            At::Station(node) if node != self.home && is_time => self.fly_home(node).await,
            At::Station(node) if node == self.home && self.was_astray && is_time => {
                self.report_home().await;
                Ok(())
            }
            At::Station(_) => Ok(()),
        }
    }
}
