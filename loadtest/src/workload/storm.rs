//! Recompositions at the full fleet, by themselves and while zones come by the thousand.

use super::Workload;
use super::bystander::Edge;
use super::filling::Accepted;
use super::goals::{Figures, Measure};
use super::world::{Disc, World};
use crate::Result;
use crate::arrivals::Chance;
use crate::load::{self, Asked, Flow, Pace, Ran, Reading, Source, Stop};
use crate::measures::Seen;
use crate::requests;
use crate::scenario::{Arrivals, Dialect};
use crate::transport::{Connections, Told, Wanted};
use crate::watch::Watch;
use http::Method;
use jiff::Timestamp;
use skyway::wire::{DroneFacts, FailureReport, FailureType, Place, Service};
use std::cell::{Cell, RefCell};
use std::collections::BTreeMap;
use std::net::SocketAddr;
use std::rc::Rc;
use std::time::{Duration, Instant};
use tokio::task::JoinSet;
use tokio::time::sleep_until;

/// Reports a second, and how many may be under way.
const REPORTS_PER_S: f64 = 200.0;
const REPORTS_AT_ONCE: usize = 64;
const TIMEOUT: Duration = Duration::from_secs(10);
/// For so long the quiet before the storm is measured.
const QUIET_S: f64 = 3.0;
/// All zones of a storm are sent within this time, if the edge takes them.
const STORM: Duration = Duration::from_secs(1);
/// Zones under way at once; an edge takes 32.
const ZONES_AT_ONCE: usize = 24;
const ZONE_RADIUS_M: f64 = 10.0;
/// The longest that a storm may take.
const PATIENCE: Duration = Duration::from_secs(30);

/// Failures of drones on legs of their plans, one after the other.
struct Reports {
    wanted: Vec<Wanted>,
    turn: Cell<usize>,
}

impl Source for Reports {
    fn next(&self) -> Asked {
        let turn = self.turn.get();
        self.turn.set(turn + 1);
        Asked {
            name: "recompose",
            wanted: self.wanted[turn % self.wanted.len()].clone(),
            reading: Reading::Nothing,
        }
    }

    fn read(&self, _asked: &Asked, _told: &Told) -> Seen {
        Seen::default()
    }

    fn had_no_success(&self, _asked: Asked) {}
}

/// A fleet that reports failures.
pub(crate) struct Reporters<'a> {
    pub(crate) edge: &'a Edge,
    pub(crate) world: &'a Rc<World>,
    pub(crate) plans: Vec<&'a Accepted>,
    pub(crate) spins: bool,
}

impl Reporters<'_> {
    /// What recompositions take where nothing else happens.
    pub(crate) async fn quiet(
        &self,
        workload: &Workload,
        chance: &mut Chance,
        figures: &mut Figures,
    ) {
        let measured = Duration::from_secs_f64(workload.samples as f64 / REPORTS_PER_S);
        let ran = self.run(measured, &Rc::default(), chance).await;
        let all = ran.recorder.all();
        figures.put(Measure::RecomposeP50Ms, all.from_sent.at_ms(0.5));
        figures.put(Measure::RecomposeP99Ms, all.from_sent.at_ms(0.99));
    }

    /// The same before and in a storm of zones.
    pub(crate) async fn storm(
        &self,
        workload: &Workload,
        chance: &mut Chance,
        figures: &mut Figures,
    ) -> Result<()> {
        let quiet_s = if workload.is_quick { 0.2 } else { QUIET_S };
        let quiet = self
            .run(Duration::from_secs_f64(quiet_s), &Rc::default(), chance)
            .await;
        let stop: Stop = Rc::default();
        let storm = Storm::of(self.world, &self.plans, workload.zones.storm, chance);
        let begun = Instant::now();
        let running = self.run(PATIENCE, &stop, chance);
        let posting = async {
            let posted = storm.post(self.edge.address, workload.zones.storm).await;
            stop.set(true);
            posted
        };
        let (ran, posted) = tokio::join!(running, posting);
        posted?;
        let ended = Instant::now();
        self.edge.settled().await?;
        let last = self.edge.listener.last();
        let (quiet, all) = (quiet.recorder.all(), ran.recorder.all());
        let p99s_ms = [&quiet, &all].map(|tally| tally.from_intended.at_ms(0.99));
        let unanswered = all.scheduled() - all.answered + quiet.scheduled() - quiet.answered;
        let refused = workload.zones.storm - storm.taken().len();
        figures.put(Measure::StormS, (ended - begun).as_secs_f64());
        figures.put(Measure::StormQuietP99Ms, p99s_ms[0]);
        figures.put(Measure::StormP99Ms, p99s_ms[1]);
        figures.put(Measure::StormBeyondMs, p99s_ms[1] - p99s_ms[0]);
        figures.put(Measure::StormErrors, unanswered as f64 + refused as f64);
        let told = last.map_or(Duration::ZERO, |at| at.saturating_duration_since(ended));
        figures.put(Measure::StormToldS, told.as_secs_f64());
        Ok(())
    }

    async fn run(&self, measured: Duration, stop: &Stop, chance: &mut Chance) -> Ran {
        let draw = |_| report(self.world, &self.plans, chance);
        let wanted = (0..REPORTS_PER_S as usize).map(draw).collect();
        let pace = Pace {
            flow: Flow::Open {
                arrivals: Arrivals::Poisson,
                rate_per_s: REPORTS_PER_S,
                seed: 1,
            },
            warm_up: Duration::ZERO,
            measured,
            in_flight: REPORTS_AT_ONCE,
            timeout: TIMEOUT,
            interval: measured,
            spins: self.spins,
        };
        let source = Rc::new(Reports {
            wanted,
            turn: Cell::new(0),
        });
        let mut watch = Watch::new("recompositions".to_owned(), None);
        let connections = self.edge.connections.clone();
        load::run(source, connections, pace, stop.clone(), &mut watch).await
    }
}

/// A zone of a storm.
#[derive(Debug)]
struct Sent {
    wanted: Wanted,
    /// When it was last sent, if it was.
    at: Option<Timestamp>,
    is_taken: bool,
}

/// Zones that come within a second.
pub(crate) struct Storm {
    zones: Rc<RefCell<BTreeMap<String, Sent>>>,
    gap: Duration,
}

impl Storm {
    /// As many zones, each over a leg of a plan.
    pub(crate) fn of(
        world: &World,
        plans: &[&Accepted],
        count: usize,
        chance: &mut Chance,
    ) -> Self {
        let zones = (0..count).map(|number| {
            let id = format!("storm-{number:05}");
            let disc = small_disc(world, plans, id.clone(), chance);
            let body = world.feature(&disc).to_string();
            let sent = Sent {
                wanted: requests::send(Method::POST, "/v1/zones", body),
                at: None,
                is_taken: false,
            };
            (id, sent)
        });
        Self {
            zones: Rc::new(RefCell::new(zones.collect())),
            gap: STORM.div_f64(count.max(1) as f64),
        }
    }

    /// Sends those among the first `until` that the edge has not taken yet, as fast as they are to
    /// come, if it takes them so fast.
    pub(crate) async fn post(&self, address: SocketAddr, until: usize) -> Result<()> {
        let connections = Rc::new(Connections::new(address, ZONES_AT_ONCE, 1));
        let begun = Instant::now();
        let mut sending = JoinSet::new();
        for (number, (id, wanted)) in (0_u32..).zip(self.waiting(until)) {
            if begun.elapsed() > PATIENCE {
                break;
            }
            sleep_until((begun + self.gap * number).into()).await;
            if sending.len() >= ZONES_AT_ONCE {
                sending.join_next().await.transpose()?;
            }
            let (connections, zones) = (connections.clone(), self.zones.clone());
            sending.spawn_local(async move {
                with(&zones, &id, |sent| sent.at = Some(Timestamp::now()));
                let told = connections.ask(&wanted).await;
                let is_taken = told.is_ok_and(|told| told.status.is_success());
                with(&zones, &id, |sent| sent.is_taken = is_taken);
            });
        }
        while let Some(sent) = sending.join_next().await {
            sent?;
        }
        Ok(())
    }

    fn waiting(&self, until: usize) -> Vec<(String, Wanted)> {
        let zones = self.zones.borrow();
        let waiting = zones.iter().take(until).filter(|(_, sent)| !sent.is_taken);
        waiting
            .map(|(id, sent)| (id.clone(), sent.wanted.clone()))
            .collect()
    }

    /// The zones whose answer says that they are in force.
    pub(crate) fn taken(&self) -> Vec<String> {
        let zones = self.zones.borrow();
        let taken = zones.iter().filter(|(_, sent)| sent.is_taken);
        taken.map(|(id, _)| id.clone()).collect()
    }

    /// Notes that a zone is there whose answer has not come; gives when it was sent, nothing where its answer had come.
    pub(crate) fn found(&self, id: &str) -> Option<Timestamp> {
        let mut zones = self.zones.borrow_mut();
        let sent = zones.get_mut(id).filter(|sent| !sent.is_taken)?;
        sent.is_taken = true;
        sent.at
    }
}

fn with(zones: &RefCell<BTreeMap<String, Sent>>, id: &str, change: impl FnOnce(&mut Sent)) {
    if let Some(sent) = zones.borrow_mut().get_mut(id) {
        change(sent);
    }
}

/// A small zone over a leg of a plan.
pub(crate) fn small_disc(
    world: &World,
    plans: &[&Accepted],
    id: String,
    chance: &mut Chance,
) -> Disc {
    let way = &plans[chance.below(plans.len())].way;
    let leg = chance.below(way.len().saturating_sub(1));
    let other = (leg + 1).min(way.len() - 1);
    Disc {
        id,
        centre: world.middle(way[leg], way[other]),
        radius_m: ZONE_RADIUS_M,
    }
}

/// The dry run of a drone at the start of a leg of its plan that it cannot fly.
fn report(world: &World, plans: &[&Accepted], chance: &mut Chance) -> Wanted {
    let plan = &plans[chance.below(plans.len())];
    let leg = chance.below(plan.way.len().saturating_sub(1));
    let report = FailureReport {
        failure: Some(FailureType::Navigational),
        service: Some(Service {
            plan_id: Some(plan.id.clone()),
            leg: u32::try_from(leg).ok(),
            ..Service::default()
        }),
        location: Some(Place::Node(world.ids[plan.way[leg]].clone())),
        drone: Some(DroneFacts {
            id: Some(plan.drone.clone()),
            ..DroneFacts::default()
        }),
        dry_run: Some(true),
        ..FailureReport::default()
    };
    requests::failure(Dialect::Rest, &report)
}
