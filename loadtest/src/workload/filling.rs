//! An edge that fills with plans, one request after the other, and what a plan takes once it is
//! full.

use super::Workload;
use super::goals::Spread;
use super::record::Record;
use super::world::World;
use crate::Result;
use crate::arrivals::Chance;
use crate::load::Standing;
use crate::requests;
use crate::scenario::Dialect;
use crate::transport::{Connections, Status, Told};
use jiff::{SignedDuration, Timestamp};
use serde::Deserialize;
use skyway::wire::{DeliveryRequest, Id};
use std::cell::Cell;
use std::time::{Duration, Instant};

/// Draws for each plan that is wanted, before it is given up.
const DRAWS_PER_PLAN: usize = 3;

/// An accepted plan.
pub(crate) struct Accepted {
    pub(crate) id: String,
    pub(crate) drone: String,
    /// The nodes of its way, by their numbers.
    pub(crate) way: Vec<usize>,
}

/// What is read of a plan: the least, as it is read while the edge is measured.
#[derive(Deserialize)]
struct Plan<'a> {
    id: String,
    drone_id: Option<String>,
    #[serde(borrow)]
    reported: Reported<'a>,
}

#[derive(Deserialize)]
struct Reported<'a> {
    #[serde(borrow)]
    path: Nodes<'a>,
}

#[derive(Deserialize)]
pub(crate) struct Nodes<'a> {
    #[serde(borrow)]
    pub(crate) nodes: Vec<Id<'a>>,
}

/// What came of filling.
#[derive(Default)]
pub(crate) struct Filled {
    pub(crate) plans: Vec<Accepted>,
    pub(crate) times: Spread,
    /// What a plan took at the first mark.
    pub(crate) at_mark: Spread,
    pub(crate) refused: usize,
}

impl Filled {
    pub(crate) fn refused_percent(&self) -> f64 {
        let asked = self.refused + self.plans.len();
        100.0 * self.refused as f64 / asked.max(1) as f64
    }

    pub(crate) fn ways(&self) -> Vec<&[usize]> {
        self.plans.iter().map(|plan| plan.way.as_slice()).collect()
    }
}

/// Draws requests and asks them.
pub(crate) struct Filler<'a> {
    pub(crate) workload: &'a Workload,
    pub(crate) world: &'a World,
    pub(crate) connections: &'a Connections,
    pub(crate) chance: Chance,
    pub(crate) begun_at: Timestamp,
    pub(crate) number: usize,
}

impl Filler<'_> {
    /// Asks until all plans are accepted, or the time is over.
    pub(crate) async fn fill(&mut self, record: &mut Record) -> Result<Filled> {
        let begun = Instant::now();
        let within = Duration::from_secs_f64(self.workload.fill_within_s);
        let mut filled = Filled::default();
        for _ in 0..self.workload.plans * DRAWS_PER_PLAN {
            if filled.plans.len() == self.workload.plans || begun.elapsed() > within {
                break;
            }
            let request = self.draw();
            let (told, took) = self.asked(&request).await?;
            filled.times.add(took);
            match accepted(&told)? {
                None => {
                    filled.refused += 1;
                    record.refused(&request, &told)?;
                }
                Some(plan) => {
                    record.composed(&told)?;
                    filled.plans.push(self.known(plan));
                }
            }
            if self.workload.mark == Some(filled.plans.len()) && filled.at_mark.is_empty() {
                filled.at_mark = self.when_full().await?;
            }
        }
        Ok(filled)
    }

    /// Plans that are composed and cancelled again, one after the other: what each took to be
    /// composed.
    pub(crate) async fn when_full(&mut self) -> Result<Spread> {
        let mut times = Spread::default();
        for _ in 0..self.workload.samples {
            let request = self.draw();
            let (told, took) = self.asked(&request).await?;
            times.add(took);
            if let Some(plan) = accepted(&told)? {
                let removal = requests::removal(&Standing::Plan(plan.id));
                self.connections.ask(&removal).await?;
            }
        }
        Ok(times)
    }

    fn draw(&mut self) -> DeliveryRequest {
        let (source, destination) = self.world.ends(&mut self.chance);
        let after_s = self.chance.unit() * self.workload.departures_s;
        let start = self.begun_at + SignedDuration::from_secs_f64(after_s);
        self.number += 1;
        DeliveryRequest {
            id: None,
            source: self.world.ids[source].clone(),
            destination: Some(self.world.ids[destination].clone()),
            stops: None,
            start_time: (self.workload.departures_s > 0.0).then(|| start.to_string()),
            payload_kg: None,
            drone_id: Some(format!("drone-{}", self.number)),
            airspeed_mps: self.workload.airspeed_mps,
            airframe: self.workload.airframe.clone(),
            battery_fraction: None,
            objective: None,
            deadline: None,
            priority: None,
            delivery_id: None,
        }
    }

    async fn asked(&self, request: &DeliveryRequest) -> Result<(Told, Duration)> {
        let wanted = requests::delivery(Dialect::Rest, request);
        let sent = Cell::new(Instant::now());
        let told = self.connections.ask_telling(&wanted, &sent).await?;
        Ok((told, sent.get().elapsed()))
    }

    fn known(&self, plan: Plan<'_>) -> Accepted {
        let nodes = plan.reported.path.nodes.iter().map(Id::text);
        Accepted {
            way: self.world.way(nodes),
            id: plan.id,
            drone: plan.drone_id.unwrap_or_default(),
        }
    }
}

/// The plan; nothing where there is none to be had, and an error where something else is wrong.
fn accepted(told: &Told) -> Result<Option<Plan<'_>>> {
    match told.status {
        Status::Rest(201) => Ok(Some(serde_json::from_slice(&told.body)?)),
        Status::Rest(409 | 422) => Ok(None),
        status if status.is_shed() => Ok(None),
        status => {
            let body = String::from_utf8_lossy(&told.body);
            Err(format!("a plan was answered with {}: {body}", status.text()).into())
        }
    }
}
