//! Positions as edges tell them, gzip and all: how many a second are stored, and how soon a day of one drone is read.

use super::DeliveriesArguments;
use super::town::{Client, Plan, Town, drone_id};
use crate::Result;
use crate::rows::Row;
use flate2::Compression;
use flate2::write::GzEncoder;
use http::{Method, header};
use jiff::Timestamp;
use skyway::wire::{PositionBatch, PositionEntry, PositionHistory, PositionsTaken};
use std::io::Write;
use std::time::{Duration, Instant};
use tokio::task::JoinSet;
use tokio::time::{MissedTickBehavior, interval};

const SEED: u64 = 4;
const NETWORK: &str = "sydney";
const PATH: &str = "/v1/networks/sydney/edges/edge-sydney/positions";
/// Each tells its place once a second.
const DRONES: usize = 50_000;
const BATCH: usize = 10_000;
/// Batches that are under way at a time.
const IN_FLIGHT: usize = 8;
const RUNS_FOR: Duration = Duration::from_secs(300);
const QUICK_RUNS_FOR: Duration = Duration::from_secs(3);
const DAY_S: i64 = 86_400;
const READS: usize = 9;
const ABOVE_SYDNEY: [f64; 2] = [151.207, -33.865];

pub(super) async fn measure(
    arguments: &DeliveriesArguments,
    stores: Vec<String>,
) -> Result<Vec<Row>> {
    let runs_for = match arguments.quick {
        true => QUICK_RUNS_FOR,
        false => RUNS_FOR,
    };
    let town = Town::open(&Plan {
        program: arguments.server.clone(),
        registry: stores,
        network: None,
        names: &[NETWORK],
        airframe: "none",
        drones: 1,
        seed: SEED,
    })
    .await?;
    let now_ms = Timestamp::now().as_millisecond();
    let day: Vec<PositionEntry> = (0..DAY_S)
        .map(|second| entry(&drone_id(NETWORK, 0), now_ms - (DAY_S - second) * 1_000))
        .collect();
    for part in day.chunks(BATCH) {
        send(&town.client, part.to_vec()).await?;
    }
    let (stored, took) = store(&town.client, runs_for).await?;
    let per_s = stored as f64 / took.as_secs_f64();
    let mut times_ms = Vec::with_capacity(READS);
    let path = day_path(now_ms)?;
    for _ in 0..READS {
        let begun = Instant::now();
        let connection = town.client.connection().await?;
        let read = connection.ask(Method::GET, &path, Vec::new()).await?;
        times_ms.push(begun.elapsed().as_secs_f64() * 1e3);
        let read: PositionHistory = serde_json::from_slice(&read)?;
        if read.positions.len() != day.len() {
            let count = read.positions.len();
            return Err(format!("{count} positions of a day were read").into());
        }
    }
    times_ms.sort_by(f64::total_cmp);
    let what = format!(
        "PostgreSQL, {} s of positions in batches of {BATCH}, gzip",
        took.as_secs()
    );
    Ok(vec![
        Row::at_least(format!("{what}: stored"), (per_s, 50_000.0), "rows/s"),
        Row::at_most(
            format!("one day of one drone, {DAY_S} positions: read, median of {READS}"),
            (times_ms[READS / 2], 50.0),
            "ms",
        ),
    ])
}

/// The day that ends at a moment.
fn day_path(now_ms: i64) -> Result<String> {
    let from = Timestamp::from_millisecond(now_ms - DAY_S * 1_000)?;
    let until = Timestamp::from_millisecond(now_ms)?;
    Ok(format!(
        "/v1/drones/{}/positions?from={from}&until={until}&limit=100000",
        drone_id(NETWORK, 0)
    ))
}

/// Sends what the drones tell, as long as this; how many rows were stored, and how long that took.
async fn store(client: &Client, runs_for: Duration) -> Result<(u64, Duration)> {
    let batches_a_second = DRONES / BATCH;
    let mut due = interval(Duration::from_secs(1) / batches_a_second as u32);
    // What is late is sent at once: the rate is what is measured.
    due.set_missed_tick_behavior(MissedTickBehavior::Burst);
    let begun = Instant::now();
    let mut sending = JoinSet::new();
    let mut stored = 0;
    let mut number = 0;
    while begun.elapsed() < runs_for {
        due.tick().await;
        while sending.len() >= IN_FLIGHT {
            stored += done(sending.join_next().await)?;
        }
        let first = (number % batches_a_second) * BATCH;
        let at_ms = Timestamp::now().as_millisecond();
        let positions = (first..first + BATCH)
            .map(|drone| entry(&format!("drone-{drone}"), at_ms))
            .collect();
        let client = client.clone();
        sending.spawn_local(async move {
            let sent = send(&client, positions).await;
            sent.map_err(|error| error.to_string())
        });
        number += 1;
    }
    while let Some(sent) = sending.join_next().await {
        stored += done(Some(sent))?;
    }
    Ok((stored, begun.elapsed()))
}

type Sent = std::result::Result<std::result::Result<u64, String>, tokio::task::JoinError>;

fn done(sent: Option<Sent>) -> Result<u64> {
    Ok(sent.transpose()?.transpose()?.unwrap_or_default())
}

fn entry(drone: &str, at_ms: i64) -> PositionEntry {
    let [lon, lat] = ABOVE_SYDNEY;
    // Small steps, as a drone makes them.
    let step = (at_ms % 100_000) as f64 * 1e-7;
    PositionEntry {
        drone_id: drone.to_owned(),
        at_ms,
        lon: lon + step,
        lat: lat - step,
        altitude_m: Some(60.0),
        battery_fraction: Some(0.8),
        speed_mps: Some(12.0),
    }
}

/// Sends a batch as an edge does; how many of its rows were stored.
async fn send(client: &Client, positions: Vec<PositionEntry>) -> Result<u64> {
    let body = tokio::task::spawn_blocking(move || {
        let batch = PositionBatch {
            positions,
            left_out: 0,
        };
        let mut encoder = GzEncoder::new(Vec::new(), Compression::fast());
        encoder.write_all(&serde_json::to_vec(&batch)?)?;
        encoder.finish()
    })
    .await??;
    let connection = client.connection().await?;
    let request = connection.request(Method::POST, PATH, "application/json");
    let request = request.header(header::CONTENT_ENCODING, "gzip");
    let (status, answer) = connection.send(request, body).await?;
    if !status.is_success() {
        let told = String::from_utf8_lossy(&answer);
        return Err(format!("positions: {status}: {told}").into());
    }
    let taken: PositionsTaken = serde_json::from_slice(&answer)?;
    Ok(taken.stored)
}
