//! How long it takes from a zone that is posted until drones have the version that leads around it.

use super::client::{Connection, Session};
use super::{LineArguments, Size, served};
use crate::Result;
use crate::arrivals::Chance;
use crate::rows::{Row, at};
use crate::workload::World;
use http::Method;
use serde_json::{Value, json};
use skyway::api::grpc::proto::MessageKind;
use skyway::api::grpc::proto::session_response::Body as Told;
use skyway::wire::CompactNetwork;
use std::collections::BTreeSet;
use std::time::{Duration, Instant};
use tokio::sync::mpsc::{UnboundedReceiver, unbounded_channel};
use tokio::task::spawn_local;
use tokio::time::timeout;

const SEED: u64 = 1;
/// Over as many streams the drones are told.
const STREAMS: usize = 100;
/// One of this many drones is on a line that no one reads.
const UNREAD_OF: usize = 100;
/// How long nobody may be told before all that are told have been.
const SILENCE: Duration = Duration::from_secs(3);

/// A fleet on the line.
struct Fleet {
    operator: Connection,
    world: World,
    ways: Vec<Vec<usize>>,
    /// When a drone was told a version.
    told: UnboundedReceiver<(String, Instant)>,
}

pub(super) async fn measure(arguments: &LineArguments, size: Size) -> Result<Vec<Row>> {
    let mut rows = Vec::new();
    let edge = served(arguments, "none").await?;
    let mut fleet = Fleet::fill(edge.connect().await?, size.sessions, Some(0.1)).await?;
    let unread = fleet.ways.len() / UNREAD_OF + 1;
    fleet
        .listen(&edge.connect().await?, size.sessions, unread)
        .await?;
    let mut stalled = fleet.stall(&edge.connect().await?, unread).await?;
    // Of few drones a hundredth may be none.
    let part = (5.0 / size.sessions as f64).max(0.01);
    let few = fleet.told_after(part).await?;
    let what = format!(
        "by distance, {} of {} drones: told",
        few.len(),
        fleet.ways.len()
    );
    rows.push(Row::at_most(
        format!("{what}, p50"),
        (at(&few, 0.5), 30.0),
        "ms",
    ));
    rows.push(Row::at_most(
        format!("{what}, p99"),
        (at(&few, 0.99), 100.0),
        "ms",
    ));
    let many = fleet.told_after(0.5).await?;
    let what = format!(
        "by distance, {} of {} drones: the last is told, beside {unread} that read nothing",
        many.len(),
        fleet.ways.len()
    );
    rows.push(Row::at_most(what, (at(&many, 1.0), 1_000.0), "ms"));
    rows.push(fleet.caught_up(&mut stalled, unread).await?);
    drop(edge);

    let edge = served(arguments, "phantom3").await?;
    let drones = (size.sessions / 50).max(10);
    let mut fleet = Fleet::fill(edge.connect().await?, drones, None).await?;
    fleet.listen(&edge.connect().await?, drones, 0).await?;
    let flown = fleet.told_after(0.5).await?;
    let what = format!(
        "Sydney flown, {} of {} drones: told, p99",
        flown.len(),
        fleet.ways.len()
    );
    rows.push(Row::at_most(what, (at(&flown, 0.99), 300.0), "ms"));
    Ok(rows)
}

fn name(drone: usize) -> String {
    format!("drone-{drone}")
}

/// The drone that is told a version, or that there is none.
fn told_a_way(told: Told) -> Option<String> {
    let Told::Message(message) = told else {
        return None;
    };
    let is_way = matches!(message.kind(), MessageKind::Version | MessageKind::NoWay);
    is_way.then_some(message.drone_id)
}

impl Fleet {
    /// As many plans as wanted, or as many as are accepted of three times as many requests.
    async fn fill(operator: Connection, plans: usize, airspeed_mps: Option<f64>) -> Result<Self> {
        let network = operator
            .ask(Method::GET, "/v1/network?format=compact", Vec::new())
            .await?;
        let compact: CompactNetwork<'static> = serde_json::from_slice(&network)?;
        let world = World::of(compact);
        let mut chance = Chance::of(SEED);
        let mut ways = Vec::new();
        let mut refused = None;
        for _ in 0..3 * plans {
            if ways.len() == plans {
                break;
            }
            let (source, destination) = world.ends(&mut chance);
            let mut asked = json!({
                "source": world.ids[source], "destination": world.ids[destination],
                "drone_id": name(ways.len()),
            });
            if let Some(airspeed_mps) = airspeed_mps {
                asked["airspeed_mps"] = json!(airspeed_mps);
            }
            let told = operator
                .ask(Method::POST, "/v1/plans", asked.to_string().into())
                .await;
            let told = match told {
                Ok(told) => told,
                Err(error) => {
                    refused = Some(error);
                    continue;
                }
            };
            let plan: Value = serde_json::from_slice(&told)?;
            let nodes = plan["reported"]["path"]["nodes"].as_array();
            let nodes = nodes.into_iter().flatten().filter_map(Value::as_str);
            ways.push(world.way(nodes));
        }
        if let Some(error) = refused.filter(|_| ways.is_empty()) {
            return Err(error);
        }
        let (_, told) = unbounded_channel();
        Ok(Self {
            operator,
            world,
            ways,
            told,
        })
    }

    /// Puts its drones but for the last ones on the line, over streams of one connection.
    async fn listen(
        &mut self,
        connection: &Connection,
        drones: usize,
        unread: usize,
    ) -> Result<()> {
        let (telling, told) = unbounded_channel();
        self.told = told;
        let each = drones.div_ceil(STREAMS).max(1);
        let listening = self.ways.len() - unread;
        for first in (0..listening).step_by(each) {
            let on_it = first..(first + each).min(listening);
            let mut session: Session = connection.session(on_it.map(name).collect()).await?;
            let telling = telling.clone();
            spawn_local(async move {
                // It ends with its edge.
                while let Ok(told) = session.next().await {
                    let Some(drone) = told_a_way(told) else {
                        continue;
                    };
                    if telling.send((drone, Instant::now())).is_err() {
                        return;
                    }
                }
            });
        }
        Ok(())
    }

    /// Puts its last drones on a line of their own that no one reads.
    async fn stall(&self, connection: &Connection, unread: usize) -> Result<Session> {
        let last = self.ways.len() - unread..self.ways.len();
        connection.session(last.map(name).collect()).await
    }

    /// Reads the line that no one has read: each of its drones that is to fly another version is told so.
    async fn caught_up(&self, stalled: &mut Session, unread: usize) -> Result<Row> {
        let mut told = BTreeSet::new();
        while let Ok(next) = timeout(SILENCE, stalled.next()).await {
            told.extend(told_a_way(next?));
        }
        let mut wanted = BTreeSet::new();
        for drone in (self.ways.len() - unread..self.ways.len()).map(name) {
            let path = format!("/v1/plans?drone_id={drone}");
            let plans = self.operator.ask(Method::GET, &path, Vec::new()).await?;
            let plans: Value = serde_json::from_slice(&plans)?;
            if !plans["plans"][0]["wanted"].is_null() {
                wanted.insert(drone);
            }
        }
        let missed = wanted.difference(&told).count();
        Ok(Row {
            what: format!("the {unread} that read nothing: told once they read"),
            found: format!("{} of {}", wanted.len() - missed, wanted.len()),
            goal: "all".to_owned(),
            is_met: missed == 0 && !wanted.is_empty(),
            is_always_held: true,
        })
    }

    /// Closes an area over this part of the fleet; gives how long it took until each drone was told, in milliseconds, sorted.
    async fn told_after(&mut self, part: f64) -> Result<Vec<f64>> {
        while let Ok(Some(_)) = timeout(SILENCE, self.told.recv()).await {}
        let mut chance = Chance::of(SEED);
        let middle = self.world.about_the_middle(0.1, &mut chance);
        let ways: Vec<&[usize]> = self.ways.iter().map(Vec::as_slice).collect();
        let disc = self
            .world
            .disc_over(format!("zone-{part}"), middle, part, &ways);
        let zone = self.world.feature(&disc).to_string();
        let begun = Instant::now();
        let operator = self.operator.clone();
        let posting = spawn_local(async move {
            let posted = operator.ask(Method::POST, "/v1/zones", zone.into()).await;
            posted.map_err(|error| error.to_string())
        });
        let mut times_ms = Vec::new();
        while let Ok(Some((_, at))) = timeout(SILENCE, self.told.recv()).await {
            times_ms.push(at.duration_since(begun).as_secs_f64() * 1e3);
        }
        posting.await??;
        if times_ms.is_empty() {
            let text = format!("no drone was told of a zone of {} m", disc.radius_m);
            return Err(text.into());
        }
        times_ms.sort_by(f64::total_cmp);
        Ok(times_ms)
    }
}
