//! A run: some edges and a registry, those who work at them, what goes wrong meanwhile, and the time to heal.

use crate::actors::{administer, operate};
use crate::central::{Backup, Central};
use crate::drones::fly;
use crate::judge;
use crate::memory_disk::Breakage;
use crate::outpost::Outpost;
use crate::rounds::Chance;
use crate::world::{Troubles, Who, World};
use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;
use tokio::runtime::Builder;
use tokio::time::timeout;

/// For so long things go wrong.
const TROUBLED_MS: u64 = 45_000;
/// After so long everyone has to have the same.
const HEALED_WITHIN: Duration = Duration::from_secs(180);

/// After so long everything is over, whatever becomes of it.
const ENDED_WITHIN: Duration = Duration::from_secs(600);

/// What a run came to.
pub(crate) struct Came {
    pub(crate) violations: Vec<String>,
    pub(crate) trace: Vec<String>,
    pub(crate) counts: BTreeMap<&'static str, u64>,
}

/// The run that a seed makes.
pub(crate) fn run(seed: u64) -> Came {
    let runtime = Builder::new_current_thread()
        .enable_time()
        .start_paused(true)
        .build();
    runtime.expect("a runtime").block_on(story(seed))
}

async fn story(seed: u64) -> Came {
    let central = Central::open(seed).await;
    let world = Arc::new(World::new(seed, central));
    let violations = match timeout(ENDED_WITHIN, act(&world)).await {
        Ok(violations) => violations,
        Err(_) => vec![format!("it has not ended after {ENDED_WITHIN:?}")],
    };
    let mut counts = world.notes().counts.clone();
    counts.insert("questions for the log", world.central.questions());
    Came {
        violations,
        trace: world.trace.lines(),
        counts,
    }
}

/// Lets it happen, and judges it.
async fn act(world: &Arc<World>) -> Vec<String> {
    let mut chance = world.chance(Who::Chaos, 0);
    let count = 2 + chance.below(3) as usize;
    let outposts: Vec<Arc<Outpost>> = (0..count)
        .map(|number| Arc::new(Outpost::new(world, number)))
        .collect();
    let mut tasks = Vec::new();
    for outpost in &outposts {
        outpost.begin().await;
        tasks.push(tokio::spawn(operate(outpost.clone())));
        tasks.push(tokio::spawn(fly(outpost.clone())));
    }
    for number in 0..2 {
        tasks.push(tokio::spawn(administer(world.clone(), number)));
    }
    Chaos::new(world, &outposts, chance).rage().await;
    world.over.cancel();
    for task in tasks {
        task.await.expect("who takes part ends well");
    }
    heal(world, &outposts).await;
    let violations = judge::violations(world, &outposts);
    for outpost in &outposts {
        world.tell(outpost.who(), format!("ends with {:?}", outpost.sight()));
    }
    violations
}

/// What goes wrong.
struct Chaos<'a> {
    world: &'a Arc<World>,
    outposts: &'a [Arc<Outpost>],
    chance: Chance,
    backups: Vec<Backup>,
    /// Edges that are down, and when they begin again.
    down: Vec<(u64, usize)>,
    registry_begins_ms: Option<u64>,
}

impl<'a> Chaos<'a> {
    fn new(world: &'a Arc<World>, outposts: &'a [Arc<Outpost>], chance: Chance) -> Self {
        Self {
            world,
            outposts,
            chance,
            backups: Vec::new(),
            down: Vec::new(),
            registry_begins_ms: None,
        }
    }

    fn tell(&self, what: impl Into<String>) {
        self.world.tell(Who::Chaos, what.into());
    }

    async fn rage(&mut self) {
        self.world.troubles().delay_max_ms = 60;
        while self.world.now_ms() < TROUBLED_MS {
            let pause = Duration::from_millis(100 + self.chance.below(2_000));
            self.world.pause(Who::Chaos, pause).await;
            self.raise().await;
            match self.chance.below(100) {
                0..20 => self.cut(),
                20..35 => self.mend(),
                35..57 => self.disturb(),
                57..65 => self.end_registry(),
                65..77 => self.end_edge().await,
                77..85 => self.break_disk(),
                85..92 => self.backups.push(self.world.central.back_up()),
                92..95 => self.restore(),
                _ => {}
            }
        }
    }

    /// A party that is down long enough begins again.
    async fn raise(&mut self) {
        let now_ms = self.world.now_ms();
        if self.registry_begins_ms.is_some_and(|at| at <= now_ms) {
            self.registry_begins_ms = None;
            self.world.central.begin().await;
            self.tell(format!(
                "the registry begins at {}",
                self.world.central.head()
            ));
        }
        let is_due = |(at_ms, _): &(u64, usize)| *at_ms <= now_ms;
        let (due, later): (Vec<_>, Vec<_>) = self.down.iter().copied().partition(is_due);
        self.down = later;
        for (_, number) in due {
            self.outposts[number].begin().await;
        }
    }

    fn draw_edge(&mut self) -> usize {
        self.chance.below(self.outposts.len() as u64) as usize
    }

    fn cut(&mut self) {
        let number = self.draw_edge();
        self.world.troubles().cut.insert(number);
        self.world.count("cuts");
        self.tell(format!("the line of e{number} is cut"));
    }

    fn mend(&mut self) {
        self.world.troubles().cut.clear();
        self.tell("all lines are mended");
        mend_disks(self.outposts);
    }

    fn break_disk(&mut self) {
        let number = self.draw_edge();
        let breakages = [Breakage::Full, Breakage::Doubtful, Breakage::Hanging];
        let breakage = breakages[self.chance.below(3) as usize];
        self.world.count("broken disks");
        self.outposts[number].set_disk(breakage);
    }

    fn disturb(&mut self) {
        let troubles = Troubles {
            lost: [0, 0, 5, 20, 50][self.chance.below(5) as usize],
            bent: [0, 0, 0, 10, 40][self.chance.below(5) as usize],
            twice: [0, 5, 20][self.chance.below(3) as usize],
            delay_max_ms: [5, 60, 300, 3_000][self.chance.below(4) as usize],
            cut: self.world.troubles().cut.clone(),
        };
        self.tell(format!("{troubles:?}"));
        *self.world.troubles() = troubles;
    }

    fn end_registry(&mut self) {
        self.world.central.crash();
        self.world.count("crashes of the registry");
        let down_ms = self.chance.below(6_000);
        self.registry_begins_ms = Some(self.world.now_ms() + down_ms);
        self.tell("the registry crashes");
    }

    async fn end_edge(&mut self) {
        let number = self.draw_edge();
        if self.outposts[number].edge().is_none() {
            return;
        }
        self.outposts[number].crash().await;
        self.world.count("crashes of edges");
        let down_ms = self.chance.below(6_000);
        self.down.push((self.world.now_ms() + down_ms, number));
    }

    /// Puts one of the last backups in place of the store.
    fn restore(&mut self) {
        let count = self.backups.len() as u64;
        let place = self.chance.below(count) as usize;
        let Some(backup) = self.backups.get(place) else {
            return;
        };
        let lost = self.world.central.restore(backup);
        self.world.count("restored backups");
        self.tell(format!(
            "a backup is restored, without {} changes",
            lost.gone.len()
        ));
        self.world.notes().restored.push(lost);
        self.registry_begins_ms = Some(self.world.now_ms());
    }
}

fn mend_disks(outposts: &[Arc<Outpost>]) {
    for outpost in outposts {
        outpost.set_disk(Breakage::None);
    }
}

/// Everything works again, and operators decide what waits for them, until everyone has the same.
async fn heal(world: &Arc<World>, outposts: &[Arc<Outpost>]) {
    *world.troubles() = Troubles {
        delay_max_ms: 20,
        ..Troubles::default()
    };
    mend_disks(outposts);
    world.central.begin().await;
    for outpost in outposts {
        outpost.begin().await;
    }
    world.tell(Who::Chaos, "everything works again".to_owned());
    let mut chance = world.chance(Who::Chaos, 1);
    let end_ms = world.now_ms() + HEALED_WITHIN.as_millis() as u64;
    while world.now_ms() < end_ms && !is_healed(world, outposts) {
        world.pause(Who::Chaos, Duration::from_millis(500)).await;
        for outpost in outposts {
            outpost.decide_holds(|| chance.below(2) == 0).await;
        }
    }
    if !is_healed(world, outposts) {
        let stati: Vec<String> = outposts
            .iter()
            .map(|it| format!("{}: {:?} {:?}", it.name(), it.sight(), it.sync()))
            .collect();
        let head = world.central.head();
        world.violation(format!(
            "not healed in time: the registry is at {head}; {stati:#?}"
        ));
    }
}

fn is_healed(world: &World, outposts: &[Arc<Outpost>]) -> bool {
    let head = world.central.head();
    outposts.iter().all(|outpost| {
        let is_there = outpost
            .sight()
            .is_some_and(|sight| sight.at == head && sight.waiting.is_empty());
        is_there && outpost.sync().is_some_and(|sync| sync.outbox == 0)
    })
}
