//! A burst of orders, and a steady rate of them afterwards: how soon each has a drone and an accepted plan.

use super::drones::{Flown, fly};
use super::town::{Plan, Town, drone_id, generated};
use super::{DeliveriesArguments, Part};
use crate::Result;
use crate::arrivals::Chance;
use crate::rows::{Row, at};
use crate::run::eprintln_line;
use jiff::Timestamp;
use std::cell::RefCell;
use std::collections::BTreeMap;
use std::rc::Rc;
use std::time::Duration;
use tokio::task::JoinSet;
use tokio::time::{Instant, sleep, sleep_until};

const SEED: u64 = 1;
const NETWORK: &str = "city";
/// Segments of a delivery.
const STEPS: usize = 3;
/// How long the last orders may take.
const PATIENCE: Duration = Duration::from_secs(60);
/// The most orders without a drone whose reasons are told.
const TOLD_MAX: usize = 5;
const LOOK_AGAIN: Duration = Duration::from_millis(100);

struct Size {
    drones: usize,
    /// Orders of the burst, and how long it takes.
    burst: u32,
    burst_for: Duration,
    /// Orders afterwards, one a second.
    steady: u32,
}

pub(super) async fn measure(arguments: &DeliveriesArguments) -> Result<Vec<Row>> {
    let size = match arguments.quick {
        false => Size {
            drones: 1_000,
            burst: 300,
            burst_for: Duration::from_secs(3),
            steady: 600,
        },
        true => Size {
            drones: 30,
            burst: 10,
            burst_for: Duration::from_secs(1),
            steady: 3,
        },
    };
    let folder = tempfile::tempdir()?;
    let network = generated(&arguments.server, folder.path(), (SEED, arguments.quick))?;
    let town = Town::open(&Plan {
        program: arguments.server.clone(),
        registry: arguments.stores(Part::Burst),
        network: Some(&network),
        names: &[NETWORK],
        airframe: "phantom3",
        drones: size.drones,
        seed: SEED,
    })
    .await?;
    let drones: Vec<String> = (0..size.drones)
        .map(|number| drone_id(NETWORK, number))
        .collect();
    fly(town.edges[0].address(), &drones, &Flown::default());
    let sent = send(&town, &size).await?;
    let begun = Instant::now();
    let mut parts = assigned_after(&town, &sent);
    while parts.iter().any(|part| part.contains(&f64::INFINITY)) && begun.elapsed() < PATIENCE {
        sleep(LOOK_AGAIN).await;
        parts = assigned_after(&town, &sent);
    }
    tell_late(&town, &sent).await?;
    let names = [
        format!("{} orders in {} s", size.burst, size.burst_for.as_secs()),
        format!("{} orders at 1/s", size.steady),
    ];
    let mut rows = Vec::new();
    for (name, times_ms) in names.iter().zip(&mut parts) {
        times_ms.sort_by(f64::total_cmp);
        let what = format!(
            "{name}, {} drones, flown: from the order to its webhook `assigned`",
            size.drones
        );
        for (label, share) in [("p50", 0.5), ("p99", 0.99)] {
            let found = at(times_ms, share);
            rows.push(Row::at_most(
                format!("{what}, {label}"),
                (found, 1_000.0),
                "ms",
            ));
        }
    }
    let late = parts
        .iter()
        .flatten()
        .filter(|time_ms| time_ms.is_infinite());
    rows.push(Row::at_most(
        "without a drone a minute after the last",
        (late.count() as f64, 0.0),
        "orders",
    ));
    Ok(rows)
}

/// When each order was due, by the id of its delivery, and whether it is one of the burst.
type Sent = BTreeMap<String, (Timestamp, bool)>;

/// How long it took until the endpoint was told of a drone, in milliseconds: of the orders of the burst, and of those after it.
/// Infinite for those without one.
fn assigned_after(town: &Town, sent: &Sent) -> [Vec<f64>; 2] {
    let received = town.receiver.received();
    let mut parts = [Vec::new(), Vec::new()];
    for (id, (sent_at, is_burst)) in sent {
        let mut events = received.events.get(id).into_iter().flatten();
        let assigned = events.find(|event| event.status == "assigned");
        let after_ms = assigned.map_or(f64::INFINITY, |assigned| {
            assigned.taken_at.duration_since(*sent_at).as_secs_f64() * 1e3
        });
        parts[usize::from(!is_burst)].push(after_ms);
    }
    parts
}

/// What the first orders wait for that have no drone.
async fn tell_late(town: &Town, sent: &Sent) -> Result<()> {
    let late: Vec<&String> = {
        let received = town.receiver.received();
        let has_drone = |id: &String| {
            let mut events = received.events.get(id).into_iter().flatten();
            events.any(|event| event.status == "assigned")
        };
        sent.keys()
            .filter(|id| !has_drone(id))
            .take(TOLD_MAX)
            .collect()
    };
    for id in late {
        let delivery = town.client.get(&format!("/v1/deliveries/{id}")).await?;
        eprintln_line(&format!(
            "{id}: {} {}",
            delivery["status"], delivery["reason"]
        ));
    }
    Ok(())
}

/// Sends orders when they are due, whatever became of those before.
async fn send(town: &Town, size: &Size) -> Result<Sent> {
    let mut chance = Chance::of(SEED);
    let sent: Rc<RefCell<Sent>> = Rc::default();
    let mut sending = JoinSet::new();
    let begun = Instant::now();
    for number in 0..size.burst + size.steady {
        let due = match number.checked_sub(size.burst) {
            None => size.burst_for * number / size.burst,
            Some(after) => size.burst_for + Duration::from_secs(u64::from(after)),
        };
        sleep_until(begun + due).await;
        let order = town.order(NETWORK, STEPS, &mut chance);
        let (client, sent) = (town.client.clone(), sent.clone());
        let due_at = Timestamp::now();
        let is_burst = number < size.burst;
        sending.spawn_local(async move {
            let id = client.order(&order, &format!("burst-{number}")).await;
            let id = id.map_err(|error| error.to_string())?;
            sent.borrow_mut().insert(id, (due_at, is_burst));
            Ok::<(), String>(())
        });
    }
    while let Some(done) = sending.join_next().await {
        done??;
    }
    Ok(sent.take())
}
