//! An edge of a run: the use cases, the writer, the storekeeper and the task that follows, as they ship, without
//! threads; it crashes and begins again with what its disk has.

use crate::disk::SlowFile;
use crate::history::edges::Sight;
use crate::history::{Holding, Version};
use crate::line::{Line, Taken};
use crate::memory_disk::{Breakage, MemoryDisk};
use crate::places::{NETWORK, lattice, tag_of, tag_of_text};
use crate::world::{Who, World};
use skyway::clock::Clock;
use skyway::edge::sync::{Following, SyncSettings, SyncStatus};
use skyway::edge::{Caller, Decision, Edge, Opening, PageRequest, Settings, StoreFile};
use skyway::formats::load_network;
use skyway::wire::ObjectKind;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// All that a list can have here.
const ALL: PageRequest = PageRequest {
    size: Some(1_000),
    token: None,
};

/// An edge that is up.
struct Up {
    edge: Arc<Edge>,
    following: Following,
}

#[derive(Default)]
struct Standing {
    up: Option<Up>,
    /// How often it has begun.
    begun: u64,
}

/// Where an edge is, whether it is up or not.
pub(crate) struct Outpost {
    pub(crate) world: Arc<World>,
    pub(crate) number: usize,
    pub(crate) caller: Caller,
    disk: MemoryDisk,
    /// What the registry has taken from this edge, in all of its lives.
    taken: Taken,
    standing: Mutex<Standing>,
}

impl Outpost {
    pub(crate) fn new(world: &Arc<World>, number: usize) -> Self {
        Self {
            world: world.clone(),
            number,
            caller: Caller::anyone(),
            disk: MemoryDisk::default(),
            taken: Taken::default(),
            standing: Mutex::default(),
        }
    }

    pub(crate) fn who(&self) -> Who {
        Who::Edge(self.number)
    }

    pub(crate) fn name(&self) -> String {
        self.who().name()
    }

    /// The name of this life of it. What it states holds until it ends: a later one begins with what the disk has.
    pub(crate) fn life(&self) -> String {
        format!("{}.{}", self.name(), self.begun())
    }

    /// Begins with what its disk has.
    pub(crate) async fn begin(&self) {
        if self.edge().is_some() {
            return;
        }
        let begun = {
            let mut standing = self.lock();
            standing.begun += 1;
            standing.begun
        };
        let chance = self.world.chance(self.who(), 1_000 + begun);
        let file = SlowFile::open(&self.disk, chance);
        let edge = open(self.number, self.world.clock(), file).await;
        let line = Line::new(&self.world, self.who(), begun, &self.taken);
        let following = edge.follow_registry(line, self.sync_settings(begun));
        self.lock().up = Some(Up { edge, following });
        self.world
            .tell(self.who(), format!("begins for the {begun}. time"));
    }

    fn sync_settings(&self, begun: u64) -> SyncSettings {
        SyncSettings {
            network: NETWORK.to_owned(),
            edge_id: self.name(),
            advertise: None,
            poll_wait: Duration::from_secs(5),
            retry_within: Duration::from_secs(2),
            seed: self.world.seed.wrapping_mul(64) + 8 * begun + self.number as u64,
        }
    }

    /// Ends without a warning: what is not committed is forgotten.
    pub(crate) async fn crash(&self) {
        let Some(up) = self.lock().up.take() else {
            return;
        };
        self.disk.crash();
        self.check_defects(&up.edge);
        self.world.tell(self.who(), "crashes".to_owned());
        up.following.stop().await;
    }

    /// Breaks the disk of an edge that is up, or mends it.
    pub(crate) fn set_disk(&self, breakage: Breakage) {
        if self.edge().is_some() {
            self.disk.set(breakage);
            self.world
                .tell(self.who(), format!("its disk has the fault {breakage:?}"));
        }
    }

    /// A defect in what follows is survived, and not overlooked here.
    fn check_defects(&self, edge: &Edge) {
        let restarts = edge.status().registry.map_or(0, |sync| sync.restarts);
        if restarts > 0 {
            let text = format!("{}: following began anew {restarts} times", self.name());
            self.world.violation(text);
        }
        let refused = edge.status().checker_cases;
        if refused > 0 {
            let text = format!("{}: the checker refused {refused} answers", self.name());
            self.world.violation(text);
        }
    }

    pub(crate) fn edge(&self) -> Option<Arc<Edge>> {
        self.lock().up.as_ref().map(|up| up.edge.clone())
    }

    /// How often it has begun.
    pub(crate) fn begun(&self) -> u64 {
        self.lock().begun
    }

    /// What is in force now, by what the edge says.
    pub(crate) fn sight(&self) -> Option<Sight> {
        let edge = self.edge()?;
        let cursor = edge.stamp().registry_revision?;
        let zones = self.zones(&edge);
        let at = Version {
            epoch: cursor.epoch,
            revision: cursor.revision,
        };
        // What the registry has taken is no longer waiting, and not yet of a revision that was read.
        let mut waiting = self.taken.after(at);
        waiting.extend(self.waiting(&edge, &zones));
        Some(Sight {
            edge: self.life(),
            moment: self.world.recorder.moment(),
            at,
            zones,
            waiting,
        })
    }

    fn zones(&self, edge: &Edge) -> Holding {
        let listed = edge.zones(&self.caller, &ALL).expect("a list");
        let zones = listed.features.iter().map(|zone| {
            let id = zone["id"].as_str().unwrap_or_default();
            (id.to_owned(), tag_of(zone))
        });
        zones.collect()
    }

    /// Zones that the registry has yet to be told of, and those that wait for an operator.
    fn waiting(&self, edge: &Edge, zones: &Holding) -> BTreeMap<String, Option<String>> {
        let mut waiting = BTreeMap::new();
        for hold in edge.holds(&self.caller, &ALL).expect("a list").holds {
            let ids = hold.closures.iter().chain(&hold.kept_as);
            waiting.extend(ids.map(|id| (id.to_string(), zones.get(&**id).cloned())));
        }
        for entry in edge.snapshot().outbox() {
            if entry.kind == ObjectKind::Zone {
                waiting.insert(entry.id.to_string(), entry.body.as_deref().map(tag_of_text));
            }
        }
        waiting
    }

    /// Closures that no zone causes.
    pub(crate) fn closures(&self) -> BTreeSet<String> {
        let Some(edge) = self.edge() else {
            return BTreeSet::new();
        };
        let zones = self.zones(&edge);
        let listed = edge.closures(&self.caller, &ALL).expect("a list").closures;
        let ids = listed.into_iter().map(|closure| closure.id.into_owned());
        ids.filter(|id| !zones.contains_key(id)).collect()
    }

    /// An operator decides all that waits for one.
    pub(crate) async fn decide_holds(&self, mut accepts: impl FnMut() -> bool) {
        let Some(edge) = self.edge() else {
            return;
        };
        for hold in edge.holds(&self.caller, &ALL).expect("a list").holds {
            // Removals that are not wanted would be told by all edges at once, and what is left to one edge is never
            // the same everywhere.
            let is_open = hold.reason == "changed_elsewhere";
            let decision = match !is_open || accepts() {
                true => Decision::Accept,
                false => Decision::Reject,
            };
            let decided = edge.decide_hold(&self.caller, &hold.id, decision).await;
            let told = decided.map_or_else(|refusal| refusal.to_string(), |_| "done".to_owned());
            let text = format!(
                "hold {} of {:?}: {decision:?}: {told}",
                hold.reason, hold.closures
            );
            self.world.count("holds");
            let ids = hold.closures.iter().map(ToString::to_string);
            self.world.notes().decided.extend(ids);
            self.world.tell(self.who(), text);
        }
    }

    pub(crate) fn sync(&self) -> Option<SyncStatus> {
        let edge = self.edge()?;
        self.check_defects(&edge);
        edge.status().registry
    }

    // Set or taken, never half.
    fn lock(&self) -> MutexGuard<'_, Standing> {
        self.standing.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// An edge over the lattice.
async fn open(number: usize, clock: Clock, file: Box<dyn StoreFile>) -> Arc<Edge> {
    let settings = Settings {
        closed_fraction_max: 0.2,
        follows_registry: true,
        ..Settings::default()
    };
    let text = lattice();
    let network = load_network(&text).expect("the lattice is a network");
    let epoch = 1_000 * (number as u64 + 1);
    let topology = Arc::new(network.topology);
    let opening = Opening::new(topology, text.into(), epoch, settings, clock).in_place();
    let edge = Edge::open(opening, file).await;
    edge.expect("its disk has what was committed")
}
