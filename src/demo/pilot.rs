//! A drone that delivers on its own account: it asks for a plan, flies it, and reports what fails.

use super::client::{Client, ClientError};
use super::drone::{AIRFRAME, At, Crew, Drone};
use super::map::Map;
use super::script::{Delivery, PilotScript, PlannedFailure};
use crate::clock::Clock;
use crate::wire;
use jiff::Timestamp;
use std::sync::Arc;

/// A pilot and its drone.
#[derive(Debug)]
pub(super) struct Pilot {
    drone: Drone,
    script: PilotScript,
    /// How many plans it has asked for.
    plan_count: u32,
    /// Until when its drone stays where it has landed.
    until: Timestamp,
    /// The plan that it has asked for and was not answered.
    asked: Option<(Delivery, wire::DeliveryRequest)>,
    errand: Option<Errand>,
}

/// What a plan is flown for.
#[derive(Debug)]
struct Errand {
    destination: wire::Id<'static>,
    /// What is still to fail, and when.
    failure: Option<(PlannedFailure, Timestamp)>,
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
            drone: Drone::landed(format!("drone-{number}"), node, map, client, clock),
            script,
            plan_count: 0,
            until,
            asked: None,
            errand: None,
        }
    }

    /// Asks for the plan of the next delivery.
    async fn depart(&mut self, node: usize) -> Result<(), ClientError> {
        let (delivery, request) = match self.asked.take() {
            Some(asked) => asked,
            None => self.next_delivery(node),
        };
        self.asked = Some((delivery, request.clone()));
        let plan = self.drone.depart(&request).await?;
        self.asked = None;
        match plan {
            Some(plan) => self.errand = Some(self.errand(&plan, delivery)),
            // It charges, a pad becomes free, or the wind drops: the next delivery is another one.
            None => self.stay(),
        }
        Ok(())
    }

    fn next_delivery(&mut self, node: usize) -> (Delivery, wire::DeliveryRequest) {
        let map = &self.drone.map;
        let delivery = self.script.delivery(map, node);
        self.plan_count += 1;
        let request = wire::DeliveryRequest {
            id: Some(format!("{}-{}", self.drone.id, self.plan_count)),
            source: map.id(node).clone(),
            destination: Some(map.id(delivery.destination).clone()),
            stops: None,
            start_time: None,
            payload_kg: Some(delivery.payload_kg),
            drone_id: Some(self.drone.id.clone()),
            airspeed_mps: None,
            airframe: Some(AIRFRAME.to_owned()),
            battery_fraction: Some(self.drone.battery_fraction),
            objective: None,
            deadline: None,
            priority: None,
            delivery_id: None,
        };
        (delivery, request)
    }

    fn errand(&self, plan: &wire::Plan<'static>, delivery: Delivery) -> Errand {
        let failure = match &self.drone.at {
            At::Way(mission) => delivery
                .failure
                .map(|planned| (planned, mission.flight.after(planned.after_fraction))),
            At::Station(_) => None,
        };
        Errand {
            destination: plan.destination.clone(),
            failure,
        }
    }

    /// Reports what fails here by the script, once.
    async fn report_what_fails(&mut self) -> Result<(), ClientError> {
        let (At::Way(mission), Some(errand)) = (&mut self.drone.at, &mut self.errand) else {
            return Ok(());
        };
        let now = self.drone.moved_at;
        let Some((planned, _)) = errand.failure.filter(|(_, at)| now >= *at) else {
            return Ok(());
        };
        let Some(leg) = mission.flight.leg(now).filter(|_| !mission.hovers) else {
            return Ok(());
        };
        let location = self.drone.map.coordinates(mission.flight.place(now));
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
                id: Some(self.drone.id.clone()),
                airframe: Some(AIRFRAME.to_owned()),
                battery_fraction: Some(self.drone.battery_fraction),
                ..wire::DroneFacts::default()
            }),
            destination: Some(errand.destination.clone()),
            ..wire::FailureReport::default()
        };
        let answer = self.drone.client.report(&report).await?;
        errand.failure = None;
        // The version to take over comes by itself, as after a zone.
        mission.hovers = answer.answer.outcome != wire::Outcome::Unaffected;
        Ok(())
    }

    /// Stays for a while where its drone has landed.
    fn stay(&mut self) {
        let now = self.drone.clock.now();
        let until = now.saturating_add(self.script.turnaround());
        self.until = until.unwrap_or(now);
    }
}

impl Crew for Pilot {
    fn drone(&mut self) -> &mut Drone {
        &mut self.drone
    }

    /// To nothing about a plan of which it does not know.
    fn listens(&self) -> bool {
        self.asked.is_none()
    }

    async fn act(&mut self) -> Result<(), ClientError> {
        match self.drone.at {
            At::Station(node) if self.drone.moved_at >= self.until => self.depart(node).await,
            At::Station(_) => Ok(()),
            At::Way(_) => {
                self.report_what_fails().await?;
                if self.drone.land().await? {
                    self.stay();
                }
                Ok(())
            }
        }
    }
}
