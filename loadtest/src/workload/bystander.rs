//! A zone over a fleet: when it is in force for a bystander, and when the last drone is told.

use super::filling::Accepted;
use super::listener::{Heard, Listener};
use super::world::{Disc, World};
use crate::Result;
use crate::arrivals::Chance;
use crate::fleet::asked;
use crate::load::{self, Asked, Flow, Pace, Reading, Source, Standing, Stop};
use crate::measures::Seen;
use crate::requests;
use crate::scenario::{Arrivals, Dialect};
use crate::transport::{Connections, Told, Wanted};
use crate::watch::Watch;
use http::Method;
use serde::Deserialize;
use skyway::wire::{DroneFacts, FailureReport, FailureType, Id, Place, Service, ZoneAck};
use std::cell::Cell;
use std::collections::BTreeSet;
use std::net::SocketAddr;
use std::rc::Rc;
use std::time::{Duration, Instant};
use tokio::time::sleep;

/// How often a bystander asks, and how many of its questions may be under way.
const ASKED_PER_S: f64 = 1000.0;
const ASKED_AT_ONCE: usize = 64;
/// For so long it asks before the zone is posted.
const BEFORE: Duration = Duration::from_millis(30);
/// How long it asks at most, and how long the drones may take to be told.
const PATIENCE: Duration = Duration::from_secs(60);
/// An edge has settled when nothing has happened for so long.
const QUIET: Duration = Duration::from_millis(300);
/// Plans that are tried for one whose way a bystander can ask for.
const CANDIDATES: usize = 200;

/// An edge with its subscriber.
pub(crate) struct Edge {
    pub(crate) address: SocketAddr,
    pub(crate) connections: Rc<Connections>,
    /// What operators do goes another way than what drones ask.
    pub(crate) operator: Connections,
    pub(crate) listener: Listener,
}

/// What became of a zone.
pub(crate) struct Struck {
    /// From the first byte of its POST to the first answer that avoids it.
    pub(crate) in_force: Option<Duration>,
    /// From the first byte of its POST to the answer.
    pub(crate) answered: Duration,
    /// From the first byte of its POST to the last outcome; none where it meets no plan.
    pub(crate) told: Option<Duration>,
    pub(crate) met: usize,
    pub(crate) untold: usize,
    /// Questions of the bystander that had no answer.
    pub(crate) unanswered: u64,
    pub(crate) events: Vec<Heard>,
    etag: String,
}

/// The way of an answer.
#[derive(Deserialize)]
struct Answered<'a> {
    #[serde(borrow)]
    path: Nodes<'a>,
}

#[derive(Deserialize)]
struct Nodes<'a> {
    #[serde(borrow)]
    nodes: Vec<Id<'a>>,
}

impl Edge {
    pub(crate) async fn at(address: SocketAddr) -> Result<Self> {
        Ok(Self {
            address,
            connections: Rc::new(Connections::new(address, ASKED_AT_ONCE, 1)),
            operator: Connections::new(address, 1, 1),
            listener: Listener::of(address).await?,
        })
    }

    pub(crate) async fn settled(&self) -> Result<()> {
        self.listener.quiet(QUIET, PATIENCE).await
    }

    /// A report of a drone that flies by, whose answer leads through a zone that is not there yet.
    pub(crate) async fn bystander(
        &self,
        world: &World,
        plans: &[Accepted],
        disc: &Disc,
        chance: &mut Chance,
    ) -> Result<Option<Wanted>> {
        for _ in 0..CANDIDATES {
            let way = &plans[chance.below(plans.len())].way;
            let (Some(source), Some(destination)) = (way.first(), way.last()) else {
                continue;
            };
            let is_clear = [source, destination]
                .iter()
                .all(|end| disc.is_clear_of(world, **end));
            if !is_clear || !disc.is_entered(world, way) {
                continue;
            }
            let Some(beside) = world.off_the_way(*source, way) else {
                continue;
            };
            let ends = [*source, beside, *destination].map(|node| world.ids[node].clone());
            let wanted = requests::failure(Dialect::Rest, &report(ends));
            let told = asked(&self.connections, &wanted).await?;
            if leads_through(world, disc, &told) == Some(true) {
                return Ok(Some(wanted));
            }
        }
        Ok(None)
    }

    /// Posts a zone while a bystander asks, and waits until every drone is told.
    pub(crate) async fn strike(
        &self,
        world: &Rc<World>,
        disc: &Disc,
        bystander: Wanted,
        spins: bool,
    ) -> Result<Struck> {
        let events_before = self.listener.take();
        let stop: Stop = Rc::new(Cell::new(false));
        let source = Rc::new(Bystander {
            wanted: bystander,
            world: world.clone(),
            disc: disc.clone(),
            avoided: Cell::new(None),
            stop: stop.clone(),
        });
        let pace = Pace {
            flow: Flow::Open {
                arrivals: Arrivals::Constant,
                rate_per_s: ASKED_PER_S,
                seed: 1,
            },
            warm_up: Duration::ZERO,
            measured: PATIENCE,
            in_flight: ASKED_AT_ONCE,
            timeout: PATIENCE,
            interval: PATIENCE,
            spins,
        };
        let mut watch = Watch::new(format!("zone {}", disc.id), None);
        // Its connection is there before it counts.
        asked(&self.operator, &requests::get("/livez")).await?;
        let asking = load::run(
            source.clone(),
            self.connections.clone(),
            pace,
            stop.clone(),
            &mut watch,
        );
        let (ran, posted) = tokio::join!(asking, self.post(world, disc, &stop));
        let (sent, answered, ack) = posted?;
        let mut struck = Struck {
            in_force: source
                .avoided
                .get()
                .map(|at| at.saturating_duration_since(sent)),
            answered,
            told: None,
            met: ack.met,
            untold: 0,
            unanswered: ran.recorder.all().scheduled() - ran.recorder.all().answered,
            events: events_before,
            etag: ack.etag,
        };
        self.wait_until_told(disc, sent, &mut struck).await?;
        Ok(struck)
    }

    async fn post(
        &self,
        world: &World,
        disc: &Disc,
        stop: &Stop,
    ) -> Result<(Instant, Duration, Ack)> {
        sleep(BEFORE).await;
        let body = world.feature(disc).to_string();
        let wanted = requests::send(Method::POST, "/v1/zones", body);
        let sent = Cell::new(Instant::now());
        let told = self.operator.ask_telling(&wanted, &sent).await;
        let answered = sent.get().elapsed();
        let ack = told.map_err(Into::into).and_then(|told| Ack::of(&told));
        if ack.is_err() {
            stop.set(true);
        }
        Ok((sent.get(), answered, ack?))
    }

    async fn wait_until_told(&self, disc: &Disc, sent: Instant, struck: &mut Struck) -> Result<()> {
        if struck.met > 0 {
            let is_it = |heard: &Heard| {
                let replanned = heard.replanned();
                replanned.is_some_and(|replanned| replanned.closure_id == disc.id)
            };
            self.listener.has_come(PATIENCE, is_it).await?;
        }
        let heard = self.listener.take();
        let mut plans = BTreeSet::new();
        for event in &heard {
            let outcome = event.outcome();
            let Some(outcome) = outcome.filter(|outcome| outcome.causes.contains(&disc.id)) else {
                continue;
            };
            plans.insert(outcome.plan.id);
            struck.told = Some(event.at.saturating_duration_since(sent));
        }
        struck.untold = struck.met.saturating_sub(plans.len());
        struck.events.extend(heard);
        Ok(())
    }

    /// Lifts a zone and waits until drones are told that.
    pub(crate) async fn lift(&self, disc: &Disc, struck: &Struck) -> Result<()> {
        let standing = Standing::Zone {
            id: disc.id.clone(),
            etag: struck.etag.clone(),
        };
        asked(&self.operator, &requests::removal(&standing)).await?;
        self.settled().await
    }
}

impl Struck {
    /// In words, as it goes on.
    pub(crate) fn told_of(&self, disc: &Disc) -> String {
        let ms = |time: Option<Duration>| match time {
            Some(time) => format!("{:.1} ms", time.as_secs_f64() * 1e3),
            None => "never".to_owned(),
        };
        format!(
            "zone {} of {:.0} m: in force {}, answered {}, {} plans met, the last told {}, {} untold",
            disc.id,
            disc.radius_m,
            ms(self.in_force),
            ms(Some(self.answered)),
            self.met,
            ms(self.told),
            self.untold
        )
    }
}

/// What the answer to a zone says.
pub(crate) struct Ack {
    pub(crate) met: usize,
    pub(crate) etag: String,
}

impl Ack {
    pub(crate) fn of(told: &Told) -> Result<Self> {
        if !told.status.is_success() {
            let body = String::from_utf8_lossy(&told.body);
            return Err(format!("a zone was answered with {}: {body}", told.status.text()).into());
        }
        let ack: ZoneAck<'_> = serde_json::from_slice(&told.body)?;
        Ok(Self {
            met: ack.effect.plan_count,
            etag: ack.etag.unwrap_or_default().into_owned(),
        })
    }
}

/// Asks the same question until its answer avoids a zone.
struct Bystander {
    wanted: Wanted,
    world: Rc<World>,
    disc: Disc,
    avoided: Cell<Option<Instant>>,
    stop: Stop,
}

impl Source for Bystander {
    fn next(&self) -> Asked {
        Asked {
            name: "bystander",
            wanted: self.wanted.clone(),
            reading: Reading::Recomposition,
        }
    }

    fn read(&self, _asked: &Asked, told: &Told) -> Seen {
        let now = Instant::now();
        if !self.stop.get() && leads_through(&self.world, &self.disc, told) == Some(false) {
            self.avoided.set(Some(now));
            self.stop.set(true);
        }
        Seen::default()
    }

    fn had_no_success(&self, _asked: Asked) {}
}

/// Nothing where the answer cannot be read.
fn leads_through(world: &World, disc: &Disc, told: &Told) -> Option<bool> {
    let answered: Answered<'_> = serde_json::from_slice(&told.body).ok()?;
    let way = world.way(answered.path.nodes.iter().map(Id::text));
    Some(disc.is_entered(world, &way))
}

/// The dry run of a drone without a plan, at a node, that cannot fly on to the next one.
fn report([source, beside, destination]: [Id<'static>; 3]) -> FailureReport {
    FailureReport {
        failure: Some(FailureType::Navigational),
        service: Some(Service {
            from: Some(source.clone()),
            to: Some(beside),
            ..Service::default()
        }),
        location: Some(Place::Node(source)),
        drone: Some(DroneFacts {
            id: Some("bystander".to_owned()),
            ..DroneFacts::default()
        }),
        destination: Some(destination),
        dry_run: Some(true),
        ..FailureReport::default()
    }
}
