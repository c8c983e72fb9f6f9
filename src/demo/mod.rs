//! The demo fleet: pilots that fly deliveries, and an operator who closes circles now and then.
//!
//! It is a client of an edge like any other and speaks REST to it: each drone listens to the stream of its mail. What is to
//! happen, and when, comes from a [`Script`] that a seed determines; what the edge tells decides what becomes of it.

mod client;
mod flight;
mod mailbox;
mod map;
mod operator;
mod pilot;
mod script;

pub use client::ClientError;
pub use script::Script;

use crate::clock::Clock;
use client::Client;
use map::Map;
use operator::Operator;
use pilot::Pilot;
use std::sync::Arc;
use tokio::task::JoinSet;
use tokio_util::sync::CancellationToken;

/// What fleet to fly.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Fleet {
    /// How many drones, each with a pilot.
    pub drones: u32,
    /// What determines the deliveries, the failures, the zones and the wind.
    pub seed: u64,
    /// Where the registry of its edge is, such as `http://127.0.0.1:8180`, and the id of the network there.
    pub registry: (String, String),
}

/// Flies a fleet against the edge at a base URL, such as `http://127.0.0.1:8080`, until it is told to stop.
///
/// `clock` is to show the time of that edge, or a little less. What goes wrong later is logged and tried again.
///
/// # Errors
/// When the network cannot be read from the edge, or has no two nodes to fly between.
pub async fn fly(
    fleet: &Fleet,
    base_url: &str,
    clock: Clock,
    stop: CancellationToken,
) -> Result<(), ClientError> {
    let client = Arc::new(Client::new(base_url)?);
    let map = Arc::new(Map::of(&client.network().await?)?);
    let script = Script::new(fleet.seed);
    let mut crew = JoinSet::new();
    for number in 1..=fleet.drones {
        let script = script.pilot(number);
        let pilot = Pilot::new(number, script, map.clone(), client.clone(), clock.clone());
        crew.spawn(pilot.fly(stop.clone()));
    }
    let (registry_url, network) = &fleet.registry;
    let registry = (Client::new(registry_url)?, network.clone());
    let operator = Operator::new(script.operator(), map, (client, registry), clock);
    crew.spawn(operator.work(stop));
    while let Some(ended) = crew.join_next().await {
        if let Err(error) = ended {
            tracing::error!(%error, "one of the demo's crew is lost");
        }
    }
    Ok(())
}
