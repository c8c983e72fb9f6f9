//! A customer's endpoint that fails half of the time: deliveries are ordered and called off, and it is told all of it.

use super::judged::{Judged, all};
use super::kills::all_told;
use super::town::{Plan, Request, Town};
use super::{DeliveriesArguments, Part};
use crate::Result;
use crate::arrivals::Chance;
use crate::rows::Row;
use http::Method;
use serde_json::Value;
use std::time::{Duration, Instant};
use tokio::time::{MissedTickBehavior, interval};

const SEED: u64 = 3;
const NETWORK: &str = "sydney";
const STEPS: usize = 3;
const FAILS: f64 = 0.5;
const RUNS_FOR: Duration = Duration::from_secs(3_600);
const QUICK_RUNS_FOR: Duration = Duration::from_secs(3);
/// Between two orders.
const EVERY: Duration = Duration::from_millis(500);
/// How long the last messages may take once the endpoint takes all: longer than the longest wait of the backoff, 36 minutes.
const PATIENCE: Duration = Duration::from_secs(2_400);

pub(super) async fn measure(arguments: &DeliveriesArguments) -> Result<Vec<Row>> {
    let runs_for = match arguments.quick {
        true => QUICK_RUNS_FOR,
        false => RUNS_FOR,
    };
    let town = Town::open(&Plan {
        program: arguments.server.clone(),
        registry: arguments.stores(Part::Webhooks),
        network: None,
        names: &[NETWORK],
        airframe: "none",
        // Their orders wait for one until they are called off.
        drones: 0,
        seed: SEED,
    })
    .await?;
    town.receiver.fail(FAILS);
    let mut chance = Chance::of(SEED);
    let mut every = interval(EVERY);
    every.set_missed_tick_behavior(MissedTickBehavior::Delay);
    let begun = Instant::now();
    let mut ordered = Vec::new();
    while begun.elapsed() < runs_for {
        every.tick().await;
        let order = town.order(NETWORK, STEPS, &mut chance);
        let key = format!("webhooks-{}", ordered.len());
        let id = town.client.order(&order, &key).await?;
        let path = format!("/v1/deliveries/{id}/cancel");
        let cancel = Request::new(Method::POST, &path, &Value::Null);
        town.client.ask(&cancel).await?;
        ordered.push(id);
    }
    // Otherwise one in some thousands would fail a dozen times, and wait for the next attempt beyond any patience.
    town.receiver.fail(0.0);
    all_told(&town, &ordered, PATIENCE).await;
    let judged = Judged::of(&town, &ordered, &all(&town).await?, None);
    let (failed, repeated) = {
        let received = town.receiver.received();
        (received.failed, received.repeated)
    };
    let what = format!(
        "{} deliveries in {} s, an endpoint that failed {failed} calls and was told {repeated} messages again",
        ordered.len(),
        runs_for.as_secs()
    );
    Ok(judged.rows(&what, false))
}
