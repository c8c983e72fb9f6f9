//! An edge with the plans of a fleet, and what is asked of it.

use crate::Result;
use crate::percentiles::Percentiles;
use crate::world::World;
use jiff::{SignedDuration, Timestamp};
use serde_json::{Value, json};
use skyway::clock::{Clock, ManualClock};
use skyway::edge::{
    Caller, Edge, EventStream, FeedImport, FlightSettings, Idempotency, Opening, Settings,
    ZoneWrite,
};
use skyway::flight::Airframe;
use skyway::formats::parse_report;
use skyway::network::NodeIx;
use skyway::wire::{self, EventKind};
use std::sync::Arc;
use std::time::{Duration, Instant};
use tokio_stream::StreamExt;

const DAWN: &str = "2026-11-21T06:00:00Z";
const EPOCH: u64 = 1;

/// Times of one kind of request.
#[derive(Default)]
pub(crate) struct Times(Vec<f64>);

impl Times {
    fn add(&mut self, took: Duration) {
        self.0.push(took.as_nanos() as f64);
    }

    pub(crate) fn print(self, name: &str) {
        let count = self.0.len();
        let times = Percentiles::taken(self.0);
        let [p50, p99, slowest] = [0.5, 0.99, 1.0].map(|share| times.at_us(share) / 1e3);
        println!("| {name} | {count} | {p50:.3} | {p99:.3} | {slowest:.3} |");
    }
}

/// What zones of one size took.
pub(crate) struct Waves {
    size: &'static str,
    answered: Times,
    told: Times,
    settled: Times,
    met: Vec<usize>,
}

impl Waves {
    pub(crate) fn print(mut self) {
        self.met.sort_unstable();
        let met = self.met[self.met.len() / 2];
        let size = self.size;
        self.answered.print(&format!("{size} zone: answer"));
        if met > 0 {
            let name = format!("{size} zone: the last of {met} plans is replanned");
            self.told.print(&name);
            let name = format!("{size} zone: the last has its contingencies");
            self.settled.print(&name);
        }
    }
}

/// A plan that was put.
struct Put {
    id: String,
    drone: String,
    way: Vec<NodeIx>,
}

/// An edge and its plans.
pub(crate) struct Fleet {
    world: World,
    /// Plans depart within this time.
    departures_s: f64,
    edge: Arc<Edge>,
    hand: ManualClock,
    caller: Caller,
    plans: Vec<Put>,
    refused: usize,
    asked: usize,
}

impl Fleet {
    pub(crate) fn over(world: World, departures_s: f64) -> Result<Self> {
        let (clock, hand) = Clock::by_hand(DAWN.parse()?);
        let settings = Settings {
            closed_fraction_max: 1.0,
            flight: Some(FlightSettings::of(Airframe::phantom3())),
            ..Settings::default()
        };
        let network = world.network();
        let (topology, geojson) = (network.topology, network.geojson);
        let opening = Opening::new(topology, geojson, EPOCH, settings, clock);
        Ok(Self {
            edge: opening.without_store()?,
            world,
            departures_s,
            hand,
            caller: Caller::anyone(),
            plans: Vec::new(),
            refused: 0,
            asked: 0,
        })
    }

    pub(crate) fn plan_count(&self) -> usize {
        self.plans.len()
    }

    pub(crate) fn refused(&self) -> usize {
        self.refused
    }

    /// Lets time pass for all drones.
    pub(crate) async fn fly_for(&self, time: SignedDuration) -> Result<()> {
        self.hand.advance(time);
        self.settle().await
    }

    /// Until every plan is answered that something met, and has its contingencies.
    pub(crate) async fn settle(&self) -> Result<()> {
        Ok(self.edge.tick().await?)
    }

    /// Asks for a plan; nothing where there is none to be had.
    async fn compose(&mut self) -> Result<(Option<wire::Plan<'static>>, Duration)> {
        self.asked += 1;
        let [source, destination] = self.world.ends();
        let dawn: Timestamp = DAWN.parse()?;
        let after_s = 60.0 + self.world.share() * self.departures_s;
        let start = dawn + SignedDuration::from_secs_f64(after_s);
        let request = json!({
            "source": source, "destination": destination,
            "drone_id": format!("drone-{}", self.asked), "start_time": start.to_string(),
        });
        let request = serde_json::from_value(request)?;
        let begun = Instant::now();
        let composing = self
            .edge
            .compose_plan(&self.caller, request, Idempotency::default());
        let plan = composing.await;
        let took = begun.elapsed();
        match plan {
            Ok(plan) => Ok((Some(plan), took)),
            // Among the plans of others there may be no way; that is not to be the rule.
            Err(refusal) if 2 * self.refused > self.asked => Err(refusal.into()),
            Err(_) => Ok((None, took)),
        }
    }

    /// One more plan, if it is accepted.
    pub(crate) async fn put(&mut self) -> Result<()> {
        match self.compose().await?.0 {
            Some(plan) => {
                let topology = &self.world.topology;
                let nodes = plan.reported.path.nodes.iter();
                let way = nodes.filter_map(|id| topology.node(id.text())).collect();
                self.plans.push(Put {
                    id: plan.id.into_owned(),
                    drone: plan.drone_id.unwrap_or_default().into_owned(),
                    way,
                });
            }
            None => self.refused += 1,
        }
        Ok(())
    }

    /// Plans that are composed and cancelled again.
    pub(crate) async fn compositions(&mut self, count: usize) -> Result<Times> {
        let mut times = Times::default();
        for _ in 0..count {
            let (plan, took) = self.compose().await?;
            times.add(took);
            if let Some(plan) = plan {
                let cancelling =
                    self.edge
                        .cancel_plan(&self.caller, &plan.id, wire::Cancellation::default());
                cancelling.await?;
            }
            self.settle().await?;
        }
        Ok(times)
    }

    /// Dry runs of a drone without a plan that cannot fly a leg of its way, among the plans of all others.
    pub(crate) async fn recompositions(&mut self, count: usize) -> Result<Times> {
        let mut times = Times::default();
        for _ in 0..count {
            let [source, destination] = self.world.ends();
            let topology = &self.world.topology;
            let node = topology.node(&source).ok_or("a node that was drawn")?;
            let beside = topology
                .arcs(node)
                .first()
                .ok_or("a node without segments")?;
            let report = json!({
                "type": "navigational", "dry_run": true, "airborne": true,
                "service": {"from": source, "to": topology.node_id(beside.to)},
                "location": {"node": source}, "destination": destination,
                "drone": {"id": "bystander", "battery_fraction": 0.9},
            });
            times.add(self.answer(&report).await?);
        }
        Ok(times)
    }

    /// Dry runs of drones that cannot fly a leg of their plans.
    pub(crate) async fn recompositions_of_plans(&mut self, count: usize) -> Result<Times> {
        let mut times = Times::default();
        for _ in 0..count {
            let plan = &self.plans[self.world.below(self.plans.len())];
            let leg = self.world.below(plan.way.len() - 1);
            let node = self.world.topology.node_id(plan.way[leg]);
            let report = json!({
                "type": "navigational", "dry_run": true,
                "service": {"plan_id": plan.id, "leg": leg},
                "location": {"node": node}, "drone": {"id": plan.drone},
            });
            times.add(self.answer(&report).await?);
        }
        Ok(times)
    }

    /// How long the answer to a report takes.
    async fn answer(&self, report: &Value) -> Result<Duration> {
        let parsed = parse_report(report.to_string().as_bytes())?;
        let begun = Instant::now();
        let answered = self.edge.report_failure(&self.caller, parsed).await;
        let took = begun.elapsed();
        answered?;
        Ok(took)
    }

    /// Zones one after the other, each lifted again.
    pub(crate) async fn waves(&mut self, size: &'static str, count: usize) -> Result<Waves> {
        let mut waves = Waves {
            size,
            answered: Times::default(),
            told: Times::default(),
            settled: Times::default(),
            met: Vec::new(),
        };
        for _ in 0..count {
            let zone = self.zone(size);
            let mut events = self.edge.events(None)?;
            let begun = Instant::now();
            let put = self.edge.create_zone(
                &self.caller,
                zone,
                ZoneWrite::default(),
                Idempotency::default(),
            );
            let ack = put.await?;
            waves.answered.add(begun.elapsed());
            if ack.effect.plan_count > 0 {
                until_replanned(&mut events).await?;
            }
            waves.told.add(begun.elapsed());
            self.settle().await?;
            waves.settled.add(begun.elapsed());
            waves.met.push(ack.effect.plan_count);
            let lifted = ZoneWrite {
                id: Some("z".to_owned()),
                if_match: ack.etag.map(|etag| etag.into_owned()),
                validate_only: false,
            };
            self.edge.delete_zone(&self.caller, lifted, None).await?;
            self.settle().await?;
        }
        Ok(waves)
    }

    /// Imports of a feed whose zones all change, until they are in force.
    pub(crate) async fn imports(&mut self, zones: usize, count: usize) -> Result<Times> {
        let mut times = Times::default();
        for _ in 0..count {
            let feed = self.world.feed(zones);
            let import = FeedImport {
                feed: "national".to_owned(),
                ..FeedImport::default()
            };
            let begun = Instant::now();
            let told = self.edge.import_zones(&self.caller, feed, import).await?;
            times.add(begun.elapsed());
            let counts = told.counts;
            if !told.enforced || counts.created + counts.changed != zones {
                return Err(format!("of {zones} zones came {counts:?}").into());
            }
        }
        Ok(times)
    }

    fn zone(&mut self, size: &str) -> Value {
        if size == "large" {
            return self
                .world
                .over_half(self.plans.iter().map(|plan| plan.way.as_slice()));
        }
        if self.plans.is_empty() {
            let [one, _] = self.world.ends();
            let node = self.world.topology.node(&one);
            return self.world.over_leg(&node.into_iter().collect::<Vec<_>>());
        }
        let plan = &self.plans[self.world.below(self.plans.len())];
        let leg = self.world.below(plan.way.len() - 1);
        self.world.over_leg(&plan.way[leg..leg + 2])
    }
}

/// Until the last plan that a zone meets is told.
async fn until_replanned(events: &mut EventStream) -> Result<()> {
    while let Some(event) = events.next().await {
        if event?.kind == EventKind::Replanned {
            return Ok(());
        }
    }
    Err("the events have ended".into())
}
