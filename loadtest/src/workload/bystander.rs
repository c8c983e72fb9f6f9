//! A zone over a fleet: when it is in force for a bystander, and when the last drone is told.

use super::filling::{Accepted, Nodes};
use super::listener::{Heard, Listener};
use super::world::{Disc, World};
use crate::arrivals::Chance;
use crate::fleet::asked;
use crate::load::{self, Asked, Flow, Pace, Reading, Source, Standing, Stop};
use crate::measures::Seen;
use crate::requests;
use crate::scenario::{Arrivals, Dialect};
use crate::servers::Server;
use crate::transport::{Connections, Status, Told, Wanted};
use crate::watch::Watch;
use crate::{Result, cores};
use http::Method;
use serde::Deserialize;
use skyway::wire::{DroneFacts, FailureReport, FailureType, Id, Place, Service, ZoneAck, ZoneList};
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
/// How long it asks at most.
const PATIENCE: Duration = Duration::from_secs(30);
/// Drones that are told later count as not told; how soon they are has a goal of its own.
const TOLD_WITHIN: Duration = Duration::from_secs(120);
/// An edge has settled when it tells nothing and works less than this part of so long a time.
const QUIET: Duration = Duration::from_millis(300);
const IDLE_PART: u32 = 10;
const SETTLED_WITHIN: Duration = Duration::from_secs(15);
/// Plans that are tried for one whose way a bystander can ask for.
const CANDIDATES: usize = 200;
/// Lists of zones that are asked for until all are lifted.
const PAGES: usize = 100;
/// The status of an answer that has not come in the edge's own time.
const DEADLINE_EXCEEDED: u16 = 504;

/// An edge with its subscriber.
pub(crate) struct Edge {
    pub(crate) address: SocketAddr,
    pid: String,
    pub(crate) connections: Rc<Connections>,
    /// What operators do goes another way than what drones ask.
    pub(crate) operator: Connections,
    pub(crate) listener: Listener,
}

/// What became of a zone.
pub(crate) struct Struck {
    /// From the first byte of its POST to the first answer that avoids it.
    pub(crate) in_force: Option<Duration>,
    /// From the first byte of its POST to the answer; none where that was no success.
    pub(crate) answered: Option<Duration>,
    /// From the first byte of its POST to the last outcome; none where it meets no plan.
    pub(crate) told: Option<Duration>,
    pub(crate) met: usize,
    pub(crate) untold: usize,
    /// Questions of the bystander that had no answer.
    pub(crate) unanswered: u64,
    pub(crate) events: Vec<Heard>,
}

/// The way of an answer.
#[derive(Deserialize)]
struct Answered<'a> {
    #[serde(borrow)]
    path: Nodes<'a>,
}

impl Edge {
    pub(crate) async fn of(server: &Server) -> Result<Self> {
        let listener = Listener::of(server.address).await?;
        Ok(Self::heard_by(listener, server))
    }

    pub(crate) fn heard_by(listener: Listener, server: &Server) -> Self {
        let address = server.address;
        Self {
            address,
            pid: server.pid().to_string(),
            connections: Rc::new(Connections::new(address, ASKED_AT_ONCE, 1)),
            operator: Connections::new(address, 1, 1),
            listener,
        }
    }

    /// Waits until the edge has nothing more to do and to tell, or for as long as there is
    /// patience.
    pub(crate) async fn settled(&self) -> Result<()> {
        let begun = Instant::now();
        while begun.elapsed() < SETTLED_WITHIN {
            let before = (self.listener.last(), cores::processor_time(&self.pid)?);
            sleep(QUIET).await;
            let worked = cores::processor_time(&self.pid)?.saturating_sub(before.1);
            if worked < QUIET / IDLE_PART && self.listener.last() == before.0 {
                break;
            }
        }
        Ok(())
    }

    /// A report of a drone that flies by, whose answer leads through a zone that is not there yet,
    /// at another edge, too.
    pub(crate) async fn bystander(
        &self,
        other: &Self,
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
            let told_elsewhere = asked(&other.connections, &wanted).await?;
            let both = [told, told_elsewhere];
            if both
                .iter()
                .all(|told| leads_through(world, disc, told) == Some(true))
            {
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
            posted: Cell::new(Instant::now() + PATIENCE),
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
            stop,
            &mut watch,
        );
        let (ran, ack) = tokio::join!(asking, self.post(&source));
        let sent = source.posted.get();
        let ack = ack?;
        let since = |at: Instant| at.saturating_duration_since(sent);
        let mut struck = Struck {
            in_force: source.avoided.get().map(since),
            answered: ack.as_ref().map(|ack| since(ack.at)),
            told: None,
            met: ack.map_or(0, |ack| ack.met),
            untold: 0,
            unanswered: ran.recorder.all().scheduled() - ran.recorder.all().answered,
            events: events_before,
        };
        self.wait_until_told(disc, sent, &mut struck).await?;
        Ok(struck)
    }

    /// Nothing where the edge is too busy to say that the zone is in force.
    async fn post(&self, bystander: &Bystander) -> Result<Option<Ack>> {
        sleep(BEFORE).await;
        let body = bystander.world.feature(&bystander.disc).to_string();
        let wanted = requests::send(Method::POST, "/v1/zones", body);
        let told = self.operator.ask_telling(&wanted, &bystander.posted).await;
        let ack = told.map_err(Into::into).and_then(|told| Ack::of(&told));
        if ack.is_err() {
            bystander.stop.set(true);
        }
        ack
    }

    async fn wait_until_told(&self, disc: &Disc, sent: Instant, struck: &mut Struck) -> Result<()> {
        if struck.met == 0 && struck.answered.is_some() {
            return Ok(());
        }
        let met = Cell::new(struck.met);
        let to_tell = Cell::new(struck.met);
        let is_it = |heard: &Heard| {
            let replanned = heard.replanned();
            let replanned = replanned.filter(|replanned| replanned.closure_id == disc.id);
            if let Some(replanned) = &replanned {
                met.set(replanned.plan_count);
                to_tell.set(replanned.to_tell());
            }
            replanned.is_some()
        };
        let are_all_told = self.listener.has_come(TOLD_WITHIN, is_it).await?;
        let waited = sent.elapsed();
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
        if !are_all_told {
            struck.told = Some(waited);
        }
        struck.met = met.get();
        // Where the edge does not even say how many there are, one at least is not told.
        let untold = to_tell.get().saturating_sub(plans.len());
        struck.untold = untold.max(usize::from(!are_all_told));
        struck.events.extend(heard);
        Ok(())
    }

    /// Lifts all zones.
    pub(crate) async fn lift(&self) -> Result<()> {
        for _ in 0..PAGES {
            let told = asked(&self.operator, &requests::get("/v1/zones")).await?;
            let zones: ZoneList<'_> = serde_json::from_slice(&told.body)?;
            if zones.features.is_empty() {
                return Ok(());
            }
            for (feature, etag) in zones.features.iter().zip(zones.etags) {
                let standing = Standing::Zone {
                    id: feature["id"].as_str().unwrap_or_default().to_owned(),
                    etag: etag.into_owned(),
                };
                // One that is not lifted is in the next list.
                self.operator.ask(&requests::removal(&standing)).await?;
            }
        }
        Err("the edge does not lift its zones".into())
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
            ms(self.answered),
            self.met,
            ms(self.told),
            self.untold
        )
    }
}

/// What the answer to a zone says, and when it came.
pub(crate) struct Ack {
    at: Instant,
    met: usize,
}

impl Ack {
    /// Nothing where the edge is too busy, or past its own deadline.
    pub(crate) fn of(told: &Told) -> Result<Option<Self>> {
        let at = Instant::now();
        if told.status.is_shed() || told.status == Status::Rest(DEADLINE_EXCEEDED) {
            return Ok(None);
        }
        if !told.status.is_success() {
            let body = String::from_utf8_lossy(&told.body);
            return Err(format!("a zone was answered with {}: {body}", told.status.text()).into());
        }
        let ack: ZoneAck<'_> = serde_json::from_slice(&told.body)?;
        let met = ack.effect.plan_count;
        Ok(Some(Self { at, met }))
    }
}

/// Asks the same question until its answer avoids a zone.
struct Bystander {
    wanted: Wanted,
    world: Rc<World>,
    disc: Disc,
    /// When the first byte of the zone was sent; until then a time to come.
    posted: Cell<Instant>,
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
        let may_know = now > self.posted.get() && !self.stop.get();
        if may_know && leads_through(&self.world, &self.disc, told) == Some(false) {
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
