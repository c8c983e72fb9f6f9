//! The demo's crew: pilots that deliver on their own account, an operator who closes circles now and then, and a market: a
//! provider whose couriers fly what the registry assigns to them, and a shop that orders.
//!
//! All are clients like any other and speak REST: each drone listens to the stream of its mail at an edge. What is to
//! happen, and when, comes from a [`Script`] that a seed determines; what the daemons tell decides what becomes of it.

mod client;
mod courier;
mod drone;
mod flight;
mod mailbox;
mod map;
mod market;
mod operator;
mod pilot;
mod script;
mod shop;

pub use client::ClientError;
pub use script::Script;

use crate::clock::Clock;
use client::Client;
use courier::Courier;
use map::Map;
use market::Market;
use operator::Operator;
use pilot::Pilot;
use shop::{Receiver, Shop};
use std::sync::Arc;
use std::time::Duration;
use tokio::sync::mpsc::Sender;
use tokio::task::JoinSet;
use tokio_util::sync::CancellationToken;

/// Before a registry that does not answer is asked again, in the machine's time.
const AGAIN_AFTER: Duration = Duration::from_secs(1);

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
        crew.spawn(drone::fly(pilot, stop.clone()));
    }
    let (registry_url, network) = &fleet.registry;
    let registry = (Client::new(registry_url)?, network.clone());
    let operator = Operator::new(script.operator(), map, (client, registry), clock);
    crew.spawn(operator.work(stop));
    all_of(crew).await;
    Ok(())
}

/// What to deal in.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Trade {
    /// How many drones the provider has.
    pub drones: usize,
    /// What determines where they are based, and what is ordered.
    pub seed: u64,
    /// Where the registry is, such as `http://127.0.0.1:8180`, and the id of the network there.
    pub registry: (String, String),
}

/// Opens a market at a registry and deals there until it is told to stop; the provider's drones fly at the edge at a base
/// URL. What is delivered is told in `lines`, a line each.
///
/// `clock` is to show the time of that edge, or a little less. What goes wrong later is logged and tried again.
///
/// # Errors
/// When the network cannot be read from the edge, or has no two nodes to fly between, or there is no free port.
pub async fn deal(
    trade: &Trade,
    base_url: &str,
    clock: Clock,
    lines: Sender<String>,
    stop: CancellationToken,
) -> Result<(), ClientError> {
    let client = Arc::new(Client::new(base_url)?);
    let map = Arc::new(Map::of(&client.network().await?)?);
    let script = Script::new(trade.seed);
    let (registry_url, network) = &trade.registry;
    let market = Arc::new(Market::at(registry_url, network)?);
    let homes = script.homes(&map, trade.drones);
    let numbered = (1..).map(Market::drone_id).zip(homes);
    let fleet: Vec<(String, usize)> = numbered.collect();
    let receiver = Receiver::open().await?;
    let address = receiver.address();
    let mut crew = JoinSet::new();
    crew.spawn(receiver.serve(lines, stop.clone()));
    for courier in &fleet {
        let (map, client, market) = (map.clone(), client.clone(), market.clone());
        let courier = Courier::new(courier.clone(), map, client, market, clock.clone());
        crew.spawn(drone::fly(courier, stop.clone()));
    }
    crew.spawn(async move {
        let opened = async {
            while let Err(error) = market.open(&map, &fleet, address).await {
                tracing::warn!(%error, "the demo's market is opened again");
                tokio::time::sleep(AGAIN_AFTER).await;
            }
        };
        tokio::select! {
            () = stop.cancelled() => return,
            () = opened => {}
        }
        let shop = Shop {
            script: script.shop(),
            map,
            market,
            clock,
        };
        shop.work(stop).await;
    });
    all_of(crew).await;
    Ok(())
}

/// Waits until all have ended.
async fn all_of(mut crew: JoinSet<()>) {
    while let Some(ended) = crew.join_next().await {
        if let Err(error) = ended {
            tracing::error!(%error, "one of the demo's crew is lost");
        }
    }
}
