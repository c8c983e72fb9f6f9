//! Plans that the edge composed, and failures on their legs: what drones would report that fly them.

use crate::Result;
use crate::arrivals::Chance;
use crate::requests::{self, get};
use crate::scenario::{self, Dialect};
use crate::transport::{Connections, Status, Told, Wanted};
use skyway::wire::{
    CompactNetwork, DeliveryRequest, DroneFacts, FailureReport, FailureType, Id, Outcome, Place,
    Plan, Recomposition, Service,
};
use std::time::Duration;
use tokio::time::sleep;

/// A plan without a leg beside its last is no use: its failure leaves nothing to recompose.
const NODES_LEAST: usize = 3;
/// Draws for each plan that is wanted, before it is given up.
const DRAWS_PER_PLAN: usize = 20;
/// The edge builds tables of destinations as they are asked for, in a queue that is bounded.
const PASSES: usize = 3;
const TABLES_WITHIN: Duration = Duration::from_millis(400);

/// A plan that is flown.
pub(crate) struct FlownPlan {
    pub(crate) id: String,
    pub(crate) drone: String,
    pub(crate) nodes: Vec<Id<'static>>,
}

/// What the requests are made of.
pub(crate) struct Fleet {
    pub(crate) nodes: Vec<Id<'static>>,
    /// West, south, east, north; or metres.
    pub(crate) bounds: [f64; 4],
    pub(crate) places: Vec<[f64; 2]>,
    pub(crate) plans: Vec<FlownPlan>,
    /// Told with their remaining path, so that nothing has to be looked up.
    pub(crate) reports: Vec<FailureReport>,
}

/// Asks and wants success.
pub(crate) async fn asked(connections: &Connections, wanted: &Wanted) -> Result<Told> {
    let told = connections.ask(wanted).await?;
    match told.status.is_success() {
        true => Ok(told),
        false => Err(format!(
            "{wanted} was answered with {}: {}",
            told.status.text(),
            String::from_utf8_lossy(&told.body)
        )
        .into()),
    }
}

impl Fleet {
    /// Has the plans composed and draws the failures.
    pub(crate) async fn compose(
        connections: &Connections,
        wanted: &scenario::Fleet,
        seed: u64,
    ) -> Result<Self> {
        let told = asked(connections, &get("/v1/network?format=compact")).await?;
        let network: CompactNetwork<'static> = serde_json::from_slice(&told.body)?;
        let mut fleet = Self::over(network);
        let mut chance = Chance::of(seed);
        for draw in 0..wanted.plans * DRAWS_PER_PLAN {
            if fleet.plans.len() == wanted.plans {
                break;
            }
            let request = DeliveryRequest {
                id: None,
                source: fleet.nodes[chance.below(fleet.nodes.len())].clone(),
                destination: Some(fleet.nodes[chance.below(fleet.nodes.len())].clone()),
                stops: None,
                start_time: None,
                payload_kg: None,
                drone_id: Some(format!("drone-{draw}")),
                airspeed_mps: Some(wanted.airspeed_mps),
                airframe: None,
                battery_fraction: None,
                objective: None,
                deadline: None,
                priority: None,
                delivery_id: None,
            };
            fleet.plans.extend(flown(connections, &request).await?);
        }
        if fleet.plans.len() < wanted.plans {
            return Err("the network has too few ways for that many plans".into());
        }
        for number in 0..wanted.reports {
            let plan = &fleet.plans[chance.below(fleet.plans.len())];
            let leg = chance.below(plan.nodes.len() - 1);
            fleet.reports.push(report(plan, leg, number));
        }
        Ok(fleet)
    }

    fn over(network: CompactNetwork<'static>) -> Self {
        let places: Vec<[f64; 2]> = network
            .coordinates
            .chunks_exact(2)
            .map(|pair| [pair[0], pair[1]])
            .collect();
        let mut bounds = [f64::MAX, f64::MAX, f64::MIN, f64::MIN];
        for [x, y] in &places {
            bounds = [
                bounds[0].min(*x),
                bounds[1].min(*y),
                bounds[2].max(*x),
                bounds[3].max(*y),
            ];
        }
        Self {
            nodes: network.ids,
            bounds,
            places,
            plans: Vec::new(),
            reports: Vec::new(),
        }
    }

    /// Asks everything a few times, so that destinations have their tables; gives the last answers, as lines of JSON.
    pub(crate) async fn warm(&self, connections: &Connections, is_quick: bool) -> Result<String> {
        let passes = if is_quick { 1 } else { PASSES };
        let mut lines = String::new();
        for _ in 0..passes {
            lines.clear();
            for report in &self.reports {
                let told = asked(connections, &requests::failure(Dialect::Rest, report)).await?;
                lines.push_str(std::str::from_utf8(&told.body)?);
                lines.push('\n');
            }
            if !is_quick {
                sleep(TABLES_WITHIN).await;
            }
        }
        Ok(lines)
    }

    /// The report of a drone whose leg of a plan has failed, for everyone to know.
    pub(crate) fn to_publish(&self, number: usize, leg: usize) -> FailureReport {
        let plan = &self.plans[number % self.plans.len()];
        let leg = leg % (plan.nodes.len() - 1);
        FailureReport {
            failure: Some(FailureType::Navigational),
            service: Some(Service {
                plan_id: Some(plan.id.clone()),
                leg: u32::try_from(leg).ok(),
                ..Service::default()
            }),
            location: Some(Place::Node(plan.nodes[leg].clone())),
            drone: Some(DroneFacts {
                id: Some(plan.drone.clone()),
                ..DroneFacts::default()
            }),
            ..FailureReport::default()
        }
    }
}

/// Which part of recorded answers leads on to the destination.
pub(crate) fn rerouted_share(lines: &str) -> f64 {
    let is_rerouted = |line: &&str| {
        let answer: serde_json::Result<Recomposition<'_>> = serde_json::from_str(line);
        answer.is_ok_and(|answer| answer.answer.outcome == Outcome::Rerouted)
    };
    lines.lines().filter(is_rerouted).count() as f64 / lines.lines().count().max(1) as f64
}

/// Nothing where there is no way, or one that is too short.
async fn flown(connections: &Connections, request: &DeliveryRequest) -> Result<Option<FlownPlan>> {
    let told = connections
        .ask(&requests::delivery(Dialect::Rest, request))
        .await?;
    match told.status {
        Status::Rest(201) => {}
        // No way leads there, or both are the same.
        Status::Rest(409 | 422) => return Ok(None),
        _ => return Err(String::from_utf8_lossy(&told.body).into_owned().into()),
    }
    let plan: Plan<'_> = serde_json::from_slice(&told.body)?;
    let nodes = plan.reported.path.nodes;
    let nodes: Vec<Id<'static>> = nodes.into_iter().map(Id::into_owned).collect();
    Ok((nodes.len() >= NODES_LEAST).then(|| FlownPlan {
        id: plan.id.into_owned(),
        drone: plan.drone_id.unwrap_or_default().into_owned(),
        nodes,
    }))
}

/// The dry run of a drone at the start of a leg that it cannot fly.
fn report(plan: &FlownPlan, leg: usize, number: usize) -> FailureReport {
    let ahead = &plan.nodes[leg..];
    FailureReport {
        failure: Some(FailureType::Navigational),
        service: Some(Service {
            from: Some(ahead[0].clone()),
            to: Some(ahead[1].clone()),
            ..Service::default()
        }),
        location: Some(Place::Node(ahead[0].clone())),
        drone: Some(DroneFacts {
            id: Some(format!("reporter-{number}")),
            battery_fraction: Some(0.62),
            ..DroneFacts::default()
        }),
        remaining_path: Some(ahead.to_vec()),
        destination: ahead.last().cloned(),
        dry_run: Some(true),
        ..FailureReport::default()
    }
}
