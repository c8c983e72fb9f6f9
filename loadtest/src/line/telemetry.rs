//! What sessions take while their drones tell where they are: memory, a part of a core, and how much faster that is.

use super::client::Session;
use super::{LineArguments, Served, Size, served};
use crate::Result;
use crate::rows::Row;
use skyway::api::grpc::proto::session_request::Body as Said;
use skyway::api::grpc::proto::session_response::Body as Told;
use skyway::api::grpc::proto::{LonLat, Place, ReportTelemetryRequest, TelemetryEntry, place};
use std::time::{Duration, Instant};
use tokio::time::{interval, sleep};

/// Over as many streams when not each drone has its own.
const STREAMS: usize = 100;
/// Positions that are sent as fast as they are answered, and how many of a session before it is asked.
const POSITIONS: usize = 20_000;
const ASKED_EVERY: usize = 500;
/// Requests in flight at a time where each is one of its own.
const IN_FLIGHT: usize = 50;
const ABOVE_SYDNEY: (f64, f64) = (151.207, -33.865);

pub(super) async fn measure(arguments: &LineArguments, size: Size) -> Result<Vec<Row>> {
    let mut rows = Vec::new();
    for (streams, most_kib, what) in [
        (size.sessions, 64.0, "a connection each"),
        (STREAMS.min(size.sessions), 8.0, "over 100 streams"),
    ] {
        let edge = served(arguments, "none").await?;
        let (memory_kib, sessions) = begin(&edge, size.sessions, streams).await?;
        let what = format!("{} sessions, {what}", size.sessions);
        let bound = (memory_kib / size.sessions as f64, most_kib);
        rows.push(Row::at_most(
            format!("{what}: memory of each"),
            bound,
            "KiB",
        ));
        let share = tell_every_second(&edge, &sessions, size).await?;
        let bound = (100.0 * share, 50.0);
        rows.push(Row::at_most(
            format!("{what}: telemetry at 1 Hz"),
            bound,
            "% of a core",
        ));
    }
    rows.push(faster(arguments, size).await?);
    Ok(rows)
}

fn position(drone: usize) -> TelemetryEntry {
    let (lon, lat) = ABOVE_SYDNEY;
    let place = Some(place::Place::LonLat(LonLat { lon, lat }));
    TelemetryEntry {
        drone_id: name(drone),
        location: Some(Place { place }),
        ..TelemetryEntry::default()
    }
}

fn name(drone: usize) -> String {
    format!("drone-{drone}")
}

/// Sessions, each with its drones.
type Sessions = Vec<(Session, std::ops::Range<usize>)>;

/// Puts drones on the line, as many on each stream; gives how much more memory the edge holds then, in KiB.
async fn begin(edge: &Served, drones: usize, streams: usize) -> Result<(f64, Sessions)> {
    let before_kib = edge.resident_kib()?;
    let each = drones.div_ceil(streams);
    let mut sessions = Vec::with_capacity(streams);
    for first in (0..drones).step_by(each) {
        let on_it = first..(first + each).min(drones);
        let connection = edge.connect().await?;
        let session = connection
            .session(on_it.clone().map(name).collect())
            .await?;
        sessions.push((session, on_it));
    }
    sleep(Duration::from_secs(1)).await;
    Ok((edge.resident_kib()? - before_kib, sessions))
}

/// Each drone tells where it is once a second, evenly over it; gives which part of a core the edge takes.
async fn tell_every_second(edge: &Served, sessions: &Sessions, size: Size) -> Result<f64> {
    const STEPS: usize = 100;
    let mut step = interval(Duration::from_secs(1) / STEPS as u32);
    let (worked_s, begun) = (edge.worked_s()?, Instant::now());
    for second in 0..size.telemetry_s {
        for part in 0..STEPS {
            step.tick().await;
            let due = sessions.iter().skip(part).step_by(STEPS);
            for (session, drones) in due {
                let positions = drones.clone().map(position).collect();
                let asked = (second + 1 == size.telemetry_s).then_some(1);
                session.say(asked, Said::Telemetry(ReportTelemetryRequest { positions }));
            }
        }
    }
    Ok((edge.worked_s()? - worked_s) / begun.elapsed().as_secs_f64())
}

/// How many times as many positions a second are taken over a session as in requests of their own.
async fn faster(arguments: &LineArguments, size: Size) -> Result<Row> {
    let edge = served(arguments, "none").await?;
    let count = POSITIONS * size.sessions / super::SESSIONS.max(1);
    let count = count.max(ASKED_EVERY);
    let connection = edge.connect().await?;
    let begun = Instant::now();
    let mut answers = tokio::task::JoinSet::new();
    for number in 0..count {
        if answers.len() >= IN_FLIGHT {
            answers.join_next().await;
        }
        let connection = connection.clone();
        let message = ReportTelemetryRequest {
            positions: vec![position(number % 100)],
        };
        answers.spawn_local(async move {
            let answered = connection.telemetry(&message).await;
            assert!(answered.is_ok(), "{answered:?}");
        });
    }
    while answers.join_next().await.is_some() {}
    let alone_s = begun.elapsed().as_secs_f64();

    let mut session = connection.session((0..100).map(name).collect()).await?;
    let begun = Instant::now();
    for first in (0..count).step_by(ASKED_EVERY) {
        for number in first..first + ASKED_EVERY {
            let positions = vec![position(number % 100)];
            let asked = (number + 1 == first + ASKED_EVERY).then_some(1);
            session.say(asked, Said::Telemetry(ReportTelemetryRequest { positions }));
        }
        while !matches!(session.next().await?, Told::Telemetry(_)) {}
    }
    let on_session_s = begun.elapsed().as_secs_f64();
    let times = alone_s / on_session_s;
    Ok(Row::at_least(
        "telemetry over a session, beside requests of their own",
        (times, 3.0),
        "times",
    ))
}
