//! Deliveries over two edges, each with its own network, flown by drones on the line; then the same while registry and edges
//! are killed.

use super::drones::{Flown, fly};
use super::judged::{Judged, all, flights, is_final};
use super::town::{Client, Plan, Town, drone_id, generated};
use super::{DeliveriesArguments, Part};
use crate::arrivals::Chance;
use crate::rows::{Row, at};
use crate::run::eprintln_line;
use jiff::Timestamp;
use serde_json::Value;
use std::collections::BTreeMap;
use std::time::{Duration, Instant};
use tokio::task::{JoinError, JoinHandle, JoinSet, spawn_local};
use tokio::time::sleep;

const SEED: u64 = 2;
const NETWORKS: [&str; 2] = ["east", "west"];
/// Segments of a delivery.
const STEPS: usize = 2;
/// Orders that are under way to the registry at a time.
const ORDERED_AT_ONCE: usize = 32;
/// The customer's endpoint fails this part of all calls while daemons are killed.
const FAILS: f64 = 0.1;
/// Between two kills, and how long a daemon is away: at least, at most, in seconds.
const QUIET_S: [f64; 2] = [5.0, 20.0];
const AWAY_S: [f64; 2] = [0.0, 2.0];
/// How long the last deliveries may take, once daemons are killed no more: drones are far.
const LAST_WITHIN: Duration = Duration::from_secs(3_600);
/// How long a second drone of a delivery may still be on its way to the drop.
const COUNTED_WITHIN: Duration = Duration::from_secs(3_600);
const LOOK_AGAIN: Duration = Duration::from_millis(500);

struct Size {
    drones: usize,
    quiet: usize,
    killed: usize,
    /// How long all of them may take.
    patience: Duration,
}

pub(super) async fn measure(arguments: &DeliveriesArguments) -> crate::Result<Vec<Row>> {
    let size = match arguments.quick {
        false => Size {
            // Few enough that most places are nobody's home.
            drones: 2_000,
            quiet: 1_000,
            killed: 10_000,
            patience: Duration::from_secs(3_600),
        },
        true => Size {
            drones: 10,
            quiet: 4,
            killed: 8,
            patience: Duration::from_secs(600),
        },
    };
    let folder = tempfile::tempdir()?;
    let network = generated(&arguments.server, folder.path(), (SEED, arguments.quick))?;
    let mut town = Town::open(&Plan {
        program: arguments.server.clone(),
        registry: arguments.stores(Part::Kills),
        network: Some(&network),
        names: &NETWORKS,
        airframe: "phantom3",
        drones: size.drones,
        seed: SEED,
    })
    .await?;
    let flown = Flown::default();
    for (name, edge) in NETWORKS.iter().zip(&town.edges) {
        let drones: Vec<String> = (0..size.drones)
            .map(|number| drone_id(name, number))
            .collect();
        fly(edge.address(), &drones, &flown);
    }
    let mut chance = Chance::of(SEED);
    let ordered = orders(&town, "quiet", size.quiet, &mut chance);
    let ordered = order(&town.client, ordered).await?;
    all_told(&town, &ordered, size.patience).await;
    all_counted(&town, &ordered, &flown).await;
    let found = all(&town).await?;
    let judged = Judged::of(&town, &ordered, &found, Some(&flown));
    let what = format!("{} deliveries over two edges", judged.deliveries);
    let times_ms = told_after(&town, &ordered, &found);
    let mut rows = vec![Row::at_most(
        format!("{what}: from the drop to its webhook `delivered`, p99"),
        (at(&times_ms, 0.99), 1_000.0),
        "ms",
    )];
    rows.extend(judged.rows(&what, true));
    let before = ordered;

    town.receiver.fail(FAILS);
    let (ordered, kills) = killed(&mut town, &size, &mut chance).await?;
    let together: Vec<String> = before.into_iter().chain(ordered).collect();
    all_counted(&town, &together, &flown).await;
    let judged = Judged::of(&town, &together, &all(&town).await?, Some(&flown));
    let (failed, repeated) = {
        let received = town.receiver.received();
        (received.failed, received.repeated)
    };
    let what = format!(
        "{} deliveries over two edges, {} kills of the registry and {} of edges, {failed} calls of the endpoint failed and {repeated} repeated, {} delivered",
        judged.deliveries, kills[0], kills[1], judged.delivered
    );
    rows.extend(judged.rows(&what, true));
    Ok(rows)
}

/// Orders over both networks, each with its key.
fn orders(town: &Town, label: &str, count: usize, chance: &mut Chance) -> Vec<(Value, String)> {
    let order = |number| {
        let network = NETWORKS[number % NETWORKS.len()];
        (
            town.order(network, STEPS, chance),
            format!("{label}-{number}"),
        )
    };
    (0..count).map(order).collect()
}

/// Orders deliveries; gives their ids.
async fn order(client: &Client, orders: Vec<(Value, String)>) -> Result<Vec<String>, String> {
    let mut ordering = JoinSet::new();
    let mut ordered = Vec::with_capacity(orders.len());
    for (order, key) in orders {
        while ordering.len() >= ORDERED_AT_ONCE {
            ordered.extend(done(ordering.join_next().await)?);
        }
        let client = client.clone();
        ordering.spawn_local(async move {
            let ordered = client.order(&order, &key).await;
            ordered.map_err(|error| error.to_string())
        });
    }
    while let Some(ended) = ordering.join_next().await {
        ordered.extend(done(Some(ended))?);
    }
    Ok(ordered)
}

type Ordering = JoinHandle<Result<Vec<String>, String>>;
type Ordered = Result<Result<String, String>, JoinError>;

fn done(ordered: Option<Ordered>) -> Result<Option<String>, String> {
    let ordered = ordered.transpose().map_err(|error| error.to_string())?;
    ordered.transpose()
}

/// Waits until the endpoint was told how each of them ended, or the time is over.
pub(super) async fn all_told(town: &Town, ordered: &[String], patience: Duration) -> bool {
    let begun = Instant::now();
    while begun.elapsed() < patience {
        let open = ordered.iter().filter(|id| !has_ended(town, id)).count();
        if open == 0 {
            return true;
        }
        sleep(LOOK_AGAIN).await;
    }
    false
}

/// Waits until the drones of all that were delivered have counted that, and none has a drop before it.
async fn all_counted(town: &Town, ordered: &[String], flown: &Flown) {
    let begun = Instant::now();
    let is_flown = |id: &String| !was_delivered(town, id) || !flights(flown, id).is_empty();
    let is_counted = || flown.before.borrow().is_empty() && ordered.iter().all(is_flown);
    while !is_counted() && begun.elapsed() < COUNTED_WITHIN {
        sleep(LOOK_AGAIN).await;
    }
}

fn was_delivered(town: &Town, id: &str) -> bool {
    let received = town.receiver.received();
    let mut events = received.events.get(id).into_iter().flatten();
    events.any(|event| event.status == "delivered")
}

fn has_ended(town: &Town, id: &str) -> bool {
    let received = town.receiver.received();
    let events = received.events.get(id);
    events.is_some_and(|events| events.iter().any(|event| is_final(&event.status)))
}

/// From when each was delivered until the endpoint was told, in milliseconds, sorted.
fn told_after(town: &Town, ordered: &[String], found: &BTreeMap<String, Value>) -> Vec<f64> {
    let received = town.receiver.received();
    let mut times_ms: Vec<f64> = ordered
        .iter()
        .filter_map(|id| {
            let changes = found.get(id)?["history"].as_array()?;
            let is_delivered = |change: &&Value| change["status"] == "delivered";
            let at = changes.iter().find(is_delivered)?["at"].as_str()?;
            let at: Timestamp = at.parse().ok()?;
            let events = received.events.get(id)?;
            let told = events.iter().find(|event| event.status == "delivered")?;
            Some(told.taken_at.duration_since(at).as_secs_f64() * 1e3)
        })
        .collect();
    times_ms.sort_by(f64::total_cmp);
    times_ms
}

/// Orders all at once while daemons are killed, until all have ended. Gives the orders, and the kills of the registry and of edges.
async fn killed(
    town: &mut Town,
    size: &Size,
    chance: &mut Chance,
) -> crate::Result<(Vec<String>, [usize; 2])> {
    let mut kills = [0, 0];
    let orders = orders(town, "killed", size.killed, chance);
    let client = town.client.clone();
    let mut ordering = Some(spawn_local(async move { order(&client, orders).await }));
    let mut ordered: Vec<String> = Vec::new();
    let begun = Instant::now();
    while begun.elapsed() < size.patience {
        if let Some(done) = ordering.take_if(|ordering: &mut Ordering| ordering.is_finished()) {
            ordered = done.await??;
        }
        if ordering.is_none() && ordered.iter().all(|id| has_ended(town, id)) {
            return Ok((ordered, kills));
        }
        sleep(drawn(QUIET_S, chance)).await;
        let victim = chance.below(1 + town.edges.len());
        kills[victim.min(1)] += 1;
        let away = drawn(AWAY_S, chance);
        let daemon = match victim.checked_sub(1) {
            None => &mut town.registry,
            Some(edge) => &mut town.edges[edge],
        };
        daemon.kill();
        sleep(away).await;
        daemon.start_again()?;
    }
    if let Some(ordering) = ordering {
        ordered = ordering.await??;
    }
    if !all_told(town, &ordered, LAST_WITHIN).await {
        eprintln_line("not all deliveries have ended in time");
    }
    Ok((ordered, kills))
}

fn drawn([least_s, most_s]: [f64; 2], chance: &mut Chance) -> Duration {
    Duration::from_secs_f64(least_s + chance.unit() * (most_s - least_s))
}
