//! Plays a workload: an edge fills with plans, zones close over it, drones are told; beside it an
//! empty edge.

use super::Workload;
use super::bystander::{Edge, Struck};
use super::edges::{Started, ground, start};
use super::filling::{Accepted, Filled, Filler};
use super::goals::{Figures, Measure, Spread};
use super::kills::{Drones, Killed, Pages};
use super::listener::Heard;
use super::record::Record;
use super::storm::{Reporters, Storm, small_disc};
use super::world::{Disc, World};
use crate::Result;
use crate::arrivals::Chance;
use crate::fleet::asked;
use crate::requests::{self, get};
use crate::run::eprintln_line;
use http::Method;
use serde_json::{Value, json};
use skyway::wire::CompactNetwork;
use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;
use std::rc::Rc;
use std::time::Duration;

/// Which part of the plans a large zone meets, and how far off the middle of the network it lies.
const LARGE_PART: f64 = 0.5;
const OFF_THE_MIDDLE: f64 = 0.1;
/// Places that are drawn for a zone until a bystander flies by it.
const DRAWS_PER_ZONE: usize = 20;
/// How often a plan is looked at whose contingencies are pending.
const PENDING_LOOKED_FOR: Duration = Duration::from_millis(100);

/// How a workload is played.
#[derive(Clone, Debug)]
pub(crate) struct PlayOptions {
    pub(crate) program: PathBuf,
    /// The load has a core of its own.
    pub(crate) is_pinned: bool,
    pub(crate) record: Option<PathBuf>,
    pub(crate) commit: String,
}

/// What the zones of one kind came to.
#[derive(Default)]
struct Tallied {
    in_force: Spread,
    at_empty: Spread,
    answered: Spread,
    told: Spread,
    met: Vec<usize>,
    untold: usize,
    unanswered: u64,
    zones_unanswered: usize,
}

/// A workload while it is played.
struct Run<'a> {
    workload: &'a Workload,
    options: &'a PlayOptions,
    world: Rc<World>,
    full: Started,
    empty: Started,
    chance: Chance,
    record: Record,
    figures: Figures,
}

/// Plays a workload and gives its figures.
///
/// # Errors
/// Where an edge does not start, or refuses what is no question of load.
pub(crate) async fn play(workload: &Workload, options: &PlayOptions) -> Result<Figures> {
    let network = tempfile::tempdir()?;
    let network = ground(workload, options, network.path()).map(|name| (name, network))?;
    let full = start(workload, options, &network.0, true).await?;
    let told = asked(&full.edge.operator, &get("/v1/network?format=compact")).await?;
    let compact: CompactNetwork<'static> = serde_json::from_slice(&told.body)?;
    let mut record = Record::at(options.record.as_deref())?;
    if record.is_kept() {
        let network = asked(&full.edge.operator, &get("/v1/network")).await?;
        record.begin(workload, &options.commit, &network.body)?;
    }
    let mut run = Run {
        workload,
        options,
        world: Rc::new(World::of(compact)),
        empty: start(workload, options, &network.0, true).await?,
        full,
        chance: Chance::of(workload.seed),
        record,
        figures: Figures::default(),
    };
    let filled = run.fill().await?;
    if workload.packs {
        run.write_packs(&filled).await?;
    }
    match workload.zones.kills {
        0 => {
            run.strike(&filled).await?;
            run.tell("recompositions, and a storm of zones");
            run.report(&filled).await?;
        }
        kills => {
            run.tell(&format!("a storm of zones, and {kills} kills"));
            run.kill(&filled).await?;
        }
    }
    run.write_plans().await?;
    let Run {
        record,
        mut figures,
        full,
        empty,
        world,
        ..
    } = run;
    record.end()?;
    drop((full, empty));
    bare(workload, options, &network.0, &world, &mut figures).await?;
    Ok(figures)
}

fn filler<'a>(workload: &'a Workload, world: &'a World, edge: &'a Edge) -> Filler<'a> {
    Filler {
        workload,
        world,
        connections: &edge.operator,
        chance: Chance::of(workload.seed),
        begun_at: jiff::Timestamp::now(),
        number: 0,
    }
}

/// The same fleet at an edge that stores nothing, where a goal asks for it.
async fn bare(
    workload: &Workload,
    options: &PlayOptions,
    network: &str,
    world: &World,
    figures: &mut Figures,
) -> Result<()> {
    let of_bare = [Measure::BareP50Ms, Measure::BareP99Ms, Measure::BareMaxMs];
    if workload
        .goals
        .iter()
        .all(|goal| !of_bare.contains(&goal.measure))
    {
        return Ok(());
    }
    eprintln_line(&format!("{}: the same without a store", workload.name));
    let started = start(workload, options, network, false).await?;
    let mut filler = filler(workload, world, &started.edge);
    filler.fill(&mut Record::at(None)?).await?;
    started.edge.settled().await?;
    let times = filler.when_full().await?;
    for (measure, part) in of_bare.into_iter().zip([0.5, 0.99, 1.0]) {
        figures.put(measure, times.at_ms(part));
    }
    Ok(())
}

impl Run<'_> {
    fn tell(&self, what: &str) {
        eprintln_line(&format!("{}: {what}", self.workload.name));
    }

    fn spins(&self) -> bool {
        self.options.is_pinned && !self.workload.is_quick
    }

    async fn fill(&mut self) -> Result<Filled> {
        self.tell(&format!("{} plans", self.workload.plans));
        let world = self.world.clone();
        let mut filler = filler(self.workload, &world, &self.full.edge);
        let filled = filler.fill(&mut self.record).await?;
        if filled.plans.is_empty() {
            return Err("no plan was accepted".into());
        }
        self.full.edge.settled().await?;
        let full = filler.when_full().await?;
        self.tell(&format!(
            "{} plans accepted, {} refused, p50 {:.2} ms, p99 {:.2} ms; full: p50 {:.2} ms, p99 {:.2} ms",
            filled.plans.len(),
            filled.refused,
            filled.times.at_ms(0.5),
            filled.times.at_ms(0.99),
            full.at_ms(0.5),
            full.at_ms(0.99)
        ));
        let told = asked(&self.full.edge.operator, &get("/v1/plans?page_size=1")).await?;
        let plans: Value = serde_json::from_slice(&told.body)?;
        let figures = &mut self.figures;
        figures.put(
            Measure::Departed,
            plans["counts"]["activated"].as_f64().unwrap_or_default(),
        );
        figures.put(
            Measure::Missing,
            (self.workload.plans - filled.plans.len()) as f64,
        );
        figures.put(Measure::RefusedPercent, filled.refused_percent());
        let parts = [0.5, 0.99, 1.0];
        let filling = [
            Measure::FillingP50Ms,
            Measure::FillingP99Ms,
            Measure::FillingMaxMs,
        ];
        let when_full = [
            Measure::ComposeP50Ms,
            Measure::ComposeP99Ms,
            Measure::ComposeMaxMs,
        ];
        for ((part, filling), when_full) in parts.into_iter().zip(filling).zip(when_full) {
            figures.put(filling, filled.times.at_ms(part));
            figures.put(when_full, full.at_ms(part));
        }
        if !filled.at_mark.is_empty() {
            let growth = full.at_ms(0.5) / filled.at_mark.at_ms(0.5);
            figures.put(Measure::ComposeGrowth, growth);
        }
        Ok(filled)
    }

    /// Zones one after the other, each at the empty edge and at the full one.
    async fn strike(&mut self, filled: &Filled) -> Result<()> {
        let (mut large, mut small) = (Tallied::default(), Tallied::default());
        for number in 0..self.workload.zones.large {
            let mut draws = 0..DRAWS_PER_ZONE;
            while draws.next().is_some() {
                let disc = self.large_disc(filled, format!("large-{number}"));
                if self.strike_with(filled, &disc, &mut large).await? {
                    break;
                }
            }
        }
        for number in 0..self.workload.zones.small {
            let mut draws = 0..DRAWS_PER_ZONE;
            while draws.next().is_some() {
                let id = format!("small-{number}");
                let plans: Vec<&Accepted> = filled.plans.iter().collect();
                let disc = small_disc(&self.world, &plans, id, &mut self.chance);
                if self.strike_with(filled, &disc, &mut small).await? {
                    break;
                }
            }
        }
        let zones = self.workload.zones.large + self.workload.zones.small;
        let unseen = zones - large.in_force.len() - small.in_force.len();
        let figures = &mut self.figures;
        let mut in_force = large.in_force.clone();
        in_force.join(&small.in_force);
        let mut at_empty = large.at_empty.clone();
        at_empty.join(&small.at_empty);
        if !in_force.is_empty() {
            let p99_ms = in_force.at_ms(0.99);
            figures.put(Measure::BystanderP99Ms, p99_ms);
            figures.put(Measure::BystanderEmptyP99Ms, at_empty.at_ms(0.99));
            figures.put(Measure::BystanderRatio, p99_ms / at_empty.at_ms(0.99));
        }
        figures.put(Measure::BystanderUnseen, unseen as f64);
        let late = large.zones_unanswered + small.zones_unanswered;
        figures.put(Measure::ZonesUnanswered, late as f64);
        let unanswered = (large.unanswered + small.unanswered) as f64;
        figures.put(Measure::BystanderUnanswered, unanswered);
        large.met.sort_unstable();
        let met = large.met.get(large.met.len() / 2).copied();
        figures.put(Measure::Met, met.unwrap_or_default() as f64);
        figures.put(Measure::ToldMs, large.told.at_ms(0.5));
        figures.put(Measure::ToldWorstMs, large.told.at_ms(1.0));
        figures.put(Measure::ToldSmallMs, small.told.at_ms(1.0));
        figures.put(Measure::AnsweredMs, large.answered.at_ms(0.5));
        figures.put(Measure::Untold, (large.untold + small.untold) as f64);
        Ok(())
    }

    fn large_disc(&mut self, filled: &Filled, id: String) -> Disc {
        let centre = self
            .world
            .about_the_middle(OFF_THE_MIDDLE, &mut self.chance);
        self.world.disc_over(id, centre, LARGE_PART, &filled.ways())
    }

    /// False where no bystander flies by.
    async fn strike_with(
        &mut self,
        filled: &Filled,
        disc: &Disc,
        tallied: &mut Tallied,
    ) -> Result<bool> {
        let (full, empty) = (&self.full.edge, &self.empty.edge);
        let (world, plans) = (&self.world, &filled.plans);
        let found = full.bystander(empty, world, plans, disc, &mut self.chance);
        let Some(bystander) = found.await? else {
            return Ok(false);
        };
        let spins = self.spins();
        let at_empty = empty.strike(world, disc, bystander.clone(), spins).await?;
        empty.lift().await?;
        let struck = full.strike(world, disc, bystander, spins).await?;
        self.tell(&struck.told_of(disc));
        full.lift().await?;
        full.settled().await?;
        self.record.heard(&struck.events)?;
        tallied.add(&struck, &at_empty);
        Ok(true)
    }

    /// What recompositions take, in the quiet and, of those who fly on as they were, in a storm.
    async fn report(&mut self, filled: &Filled) -> Result<()> {
        let spins = self.spins();
        let reporters = Reporters {
            edge: &self.full.edge,
            world: &self.world,
            plans: filled.plans.iter().collect(),
            spins,
        };
        reporters
            .quiet(self.workload, &mut self.chance, &mut self.figures)
            .await;
        let has_changed = self.take_over(filled).await?;
        let fly_on = |plan: &&Accepted| !has_changed.contains(&plan.id);
        let reporters = Reporters {
            edge: &self.full.edge,
            world: &self.world,
            plans: filled.plans.iter().filter(fly_on).collect(),
            spins,
        };
        if self.workload.zones.storm > 0 && !reporters.plans.is_empty() {
            reporters
                .storm(self.workload, &mut self.chance, &mut self.figures)
                .await?;
        }
        self.record.heard(&self.full.edge.listener.take())
    }

    /// A storm in which the edge is killed.
    async fn kill(&mut self, filled: &Filled) -> Result<()> {
        let plans = filled.plans.iter().collect::<Vec<_>>();
        let count = self.workload.zones.storm;
        let storm = Storm::of(&self.world, &plans, count, &mut self.chance);
        let killed = Killed {
            started: &mut self.full,
            storm,
            zones: self.workload.zones,
            plans: &filled.plans,
            drones: Drones::of(&mut self.record),
            chance: &mut self.chance,
        };
        killed.play(&mut self.figures).await
    }

    /// A last large zone, and every drone takes over what it is told; gives the plans of those that
    /// did.
    async fn take_over(&mut self, filled: &Filled) -> Result<BTreeSet<String>> {
        let disc = self.large_disc(filled, "last".to_owned());
        let edge = &self.full.edge;
        let body = self.world.feature(&disc).to_string();
        let zone = requests::send(Method::POST, "/v1/zones", body);
        // Where the edge is too busy to answer in time, the zone is in force all the same.
        edge.operator.ask(&zone).await?;
        edge.settled().await?;
        let told = edge.listener.take();
        let mut has_changed = BTreeSet::new();
        for (plan, version) in wanted_versions(&told) {
            let path = format!("/v1/plans/{plan}/ack");
            let body = json!({ "version": version }).to_string();
            let ack = requests::send(Method::POST, path, body);
            // Where it is too late the drone flies on.
            if edge.operator.ask(&ack).await?.status.is_success() {
                has_changed.insert(plan);
            }
        }
        edge.lift().await?;
        edge.settled().await?;
        self.record.heard(&told)?;
        self.record.heard(&edge.listener.take())?;
        Ok(has_changed)
    }

    /// What drones do when the line is gone, once that is worked out: they depart later.
    async fn write_packs(&mut self, filled: &Filled) -> Result<()> {
        let begun = std::time::Instant::now();
        for plan in &filled.plans {
            let plan = get(format!("/v1/plans/{}", plan.id));
            while is_pending(&asked(&self.full.edge.operator, &plan).await?.body)? {
                tokio::time::sleep(PENDING_LOOKED_FOR).await;
            }
        }
        self.tell(&format!(
            "packs; contingencies were pending for {:.1} s after the last plan",
            begun.elapsed().as_secs_f64()
        ));
        for plan in &filled.plans {
            let pack = format!("/v1/plans/{}/pack", plan.id);
            let told = asked(&self.full.edge.operator, &get(pack)).await?;
            self.record.pack(&plan.id, &told.body)?;
        }
        Ok(())
    }

    /// How every plan stands at the end.
    async fn write_plans(&mut self) -> Result<()> {
        if !self.record.is_kept() {
            return Ok(());
        }
        let mut plans = Pages::of("/v1/plans", "plans");
        while let Some(page) = plans.next(&self.full.edge.operator).await? {
            for plan in &page {
                self.record.stands(plan)?;
            }
        }
        Ok(())
    }
}

/// Whether contingencies of a plan are still being worked out.
fn is_pending(plan: &[u8]) -> Result<bool> {
    let plan: Value = serde_json::from_slice(plan)?;
    let mut legs = plan["reported"]["legs"].as_array().into_iter().flatten();
    Ok(legs.any(|leg| leg["if_closed"].is_null()))
}

/// The newest version that each drone is asked to fly.
fn wanted_versions(events: &[Heard]) -> BTreeMap<String, u32> {
    let mut newest = BTreeMap::new();
    for outcome in events.iter().filter_map(Heard::outcome) {
        match outcome.plan.wanted {
            Some(wanted) => newest.insert(outcome.plan.id, wanted.version),
            None => newest.remove(&outcome.plan.id),
        };
    }
    newest
}

impl Tallied {
    fn add(&mut self, struck: &Struck, at_empty: &Struck) {
        if let (Some(in_force), Some(at_empty)) = (struck.in_force, at_empty.in_force) {
            self.in_force.add(in_force);
            self.at_empty.add(at_empty);
        }
        match struck.answered {
            Some(answered) => self.answered.add(answered),
            None => self.zones_unanswered += 1,
        }
        self.met.push(struck.met);
        self.untold += struck.untold;
        self.unanswered += struck.unanswered;
        if let Some(told) = struck.told {
            self.told.add(told);
        }
    }
}
