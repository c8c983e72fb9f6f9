//! The edge: use cases over one snapshot, and the single writer that makes the next.
//!
//! A request takes one [`Snapshot`] and keeps it from beginning to end; nothing it reads changes meanwhile.
//! What changes the state is a command to the writer, which carries out commands in batches, publishes one
//! snapshot for each batch, stores it and then acknowledges. Both dialects call the use cases here; nothing
//! here knows HTTP or gRPC.

mod alarms;
mod background;
mod clock_steps;
mod drones;
mod entries;
mod events;
mod failures;
mod line;
mod locks;
mod metrics;
mod network;
mod opening;
mod planner;
mod plans;
mod replanning;
mod replies;
mod scratches;
mod settings;
mod snapshot;
mod standing;
mod state;
mod status;
mod store;
pub mod sync;
mod upstream;
mod views;
mod weather;
mod words;
mod writer;
mod zones;

pub use alarms::AlarmFilter;
pub use background::Background;
pub use events::{EventRecord, EventStream};
pub use failures::answered::{FullRecord, ReportResponse};
pub use failures::traces::TRACES_TARGET;
pub use line::sessions::Session;
pub use line::stream::{Mail, MailStream};
pub use network::replacement::NewNetwork;
pub use opening::{OpenError, Opening};
pub use plans::PlanFilter;
pub use plans::words::PlanWord;
pub use replies::Idempotency;
pub use settings::{ClosureLives, FlightSettings, Settings};
pub use skyway_service::access::{Caller, Role};
pub use skyway_service::intake::PageRequest;
pub use skyway_service::refusal::{Code, Refusal};
pub use snapshot::Snapshot;
pub use status::Status;
pub use store::{
    Pending, Row, SqliteFile, StoreFault, StoreFile, StoreStatus, StoredDecision, Table,
    Transaction, read_decision, read_network,
};
pub use upstream::{OutboxEntry, RegistryCursor, Upstream};
pub use writer::WriterStep;
pub use writer::commands::Decision;
pub use zones::ZoneWrite;
pub use zones::import::{FEED_BYTES_MAX, FeedImport};

use arc_swap::{ArcSwap, ArcSwapOption};
use background::{SearchTurns, Turns, in_place};
use bytes::Bytes;
use drones::Drones;
use drones::answered_lately::AnsweredLately;
use drones::positions::Positions;
use events::Events;
use failures::guard::Guard;
use failures::records::Records;
use line::Lines;
use line::claims::Claims;
use locks::lock;
use network::tables::Tables;
use planner::Planner;
use replanning::offers::Offers;
use replies::{ReportReplies, WriteReplies};
use skyway_contract as wire;
use skyway_engine::network::Topology;
use skyway_service::clock::Clock;
use skyway_service::config::PackKeys;
use standing::Staleness;
use std::borrow::Cow;
use std::sync::atomic::AtomicU64;
use std::sync::{Arc, Mutex};
use store::Store;
use sync::Contact;
use tokio::task::{JoinError, JoinHandle};
use writer::Writer;
use writer::commands::{Command, Outcome};

/// An edge: everything behind its use cases.
pub struct Edge {
    settings: Settings,
    clock: Clock,
    /// Random, made once.
    id: String,
    epoch: u64,
    /// The epoch of the first start, which ids that outlive a start carry.
    lineage: u64,
    /// Whether everything happens on the caller's thread.
    is_in_place: bool,
    world: Arc<ArcSwap<Snapshot>>,
    writer: Writer,
    store: Store,
    events: Arc<Events>,
    lines: Arc<Lines>,
    claims: Claims,
    drones: Arc<Drones>,
    /// Where they were, for the registry.
    positions: Positions,
    planner: Arc<dyn Planner>,
    pack_keys: ArcSwap<PackKeys>,
    /// What the registry told last of how often what fails.
    failure_rates: ArcSwapOption<wire::NetworkStatistics>,
    /// What the checker has not let pass.
    guard: Arc<Guard>,
    records: Records,
    off_plan: AnsweredLately,
    report_replies: ReportReplies,
    write_replies: WriteReplies,
    tables: Tables,
    turns: SearchTurns,
    next_number: AtomicU64,
    contact: Contact,
    offers: Mutex<Offers>,
    /// The storekeeper, until it is waited for.
    keeper: Mutex<Option<JoinHandle<()>>>,
}

impl Edge {
    /// Starts an edge that forgets everything when it ends: its state, and the threads that keep it.
    ///
    /// `geojson` is the text that the topology was read from, which clients get. Over [`Topology::nothing`] an edge is
    /// not ready until [`Edge::replace_network`] gives it one. `epoch` is to be greater than that of every start before, such as the time of the start.
    ///
    /// # Errors
    /// When a thread cannot be started.
    pub fn start(
        topology: Arc<Topology>,
        geojson: Bytes,
        epoch: u64,
        settings: Settings,
        clock: Clock,
    ) -> std::io::Result<Arc<Self>> {
        Opening::new(topology, geojson, epoch, settings, clock).without_store()
    }

    /// Starts an edge that goes on where it ended: with all that its file has.
    ///
    /// # Errors
    /// When the file cannot be read or written, is of another network, or a thread cannot be started.
    pub async fn open(opening: Opening, file: Box<dyn StoreFile>) -> Result<Arc<Self>, OpenError> {
        opening.with_store(file).await
    }

    /// Ends the edge's part in its file, once all is written that can be. The edge takes no more changes that
    /// would survive it.
    pub async fn end(&self) {
        self.store.close();
        let keeper = lock(&self.keeper).take();
        if let Some(keeper) = keeper
            && keeper.await.is_err()
        {
            tracing::error!("the storekeeper has failed");
        }
    }

    /// The id of this edge: random, made once, and kept with what it knows.
    pub fn id(&self) -> &str {
        &self.id
    }

    /// The state as it is now.
    pub fn snapshot(&self) -> Arc<Snapshot> {
        self.world.load_full()
    }

    /// The clock that all times of this edge come from.
    pub fn clock(&self) -> &Clock {
        &self.clock
    }

    /// The network; one without nodes while there is none.
    pub fn topology(&self) -> Arc<Topology> {
        self.world.load().topology().clone()
    }

    /// What answers say of the state as it is now.
    pub fn stamp(&self) -> wire::Stamp<'static> {
        self.stamp_of(&self.world.load_full())
    }

    fn stamp_of(&self, snapshot: &Snapshot) -> wire::Stamp<'static> {
        let standing = self.standing(snapshot);
        wire::Stamp {
            revision: Cow::Owned(snapshot.revision.to_string()),
            topology_revision: snapshot.airspace.topology_revision(),
            registry_revision: standing.registry_revision,
            registry_age_s: standing.registry_age_s,
            freshness: standing.freshness,
            clock: standing.clock,
            network: words::network_name(snapshot.topology()).into_owned(),
        }
    }

    /// How current the edge is. One that follows no registry is its own authority, and fresh while its clock can
    /// be believed; one that has never read the registry that it is to follow knows nothing of it.
    fn standing(&self, snapshot: &Snapshot) -> Staleness {
        let settings = &self.settings;
        let reading = self.clock.reading();
        let cursor = snapshot.registry.as_deref();
        let cursor = cursor.filter(|_| settings.follows_registry);
        let age = cursor.and_then(|_| self.contact.age());
        Staleness {
            registry_revision: cursor.map(|cursor| wire::RegistryRevision {
                epoch: cursor.epoch,
                revision: cursor.revision,
            }),
            registry_age_s: age.map(|age| age.as_secs_f64()),
            freshness: match cursor {
                _ if reading.apart.is_some() || self.guard.is_degraded(reading.now) => {
                    wire::Freshness::Degraded
                }
                Some(_) => self
                    .contact
                    .freshness(settings.stale_after, settings.degraded_after),
                None if settings.follows_registry => wire::Freshness::Degraded,
                None => wire::Freshness::Fresh,
            },
            clock: self.clock.kind(),
        }
    }

    /// Events from after an id, or from now on.
    ///
    /// # Errors
    /// When the id is none, or too old; when too many listen already.
    pub fn events(&self, after: Option<&str>) -> Result<EventStream, Refusal> {
        self.events.listen(after)
    }

    /// The id of the latest event, from which a listener that has just read a list goes on.
    pub fn latest_event_id(&self) -> String {
        self.events.latest_id()
    }

    /// Carries out what is due by now without waiting for the clock, as a clock moved by hand does, until the drones of all
    /// plans have been told what to fly.
    ///
    /// # Errors
    /// When the writer cannot take it.
    pub async fn tick(&self) -> Result<(), Refusal> {
        self.command(Command::Settle).await.map(drop)
    }

    async fn command(&self, command: Command) -> Result<(Outcome, Arc<Snapshot>), Refusal> {
        let (is_change, told) = (command.changes_by_request(), command.told());
        let (reply, snapshot) = self.writer.ask(command).await?;
        let outcome = reply?;
        if let Some(told) = told {
            told.log();
        }
        match is_change && !outcome.durable && self.store.is_kept() {
            true => Err(not_durable()),
            false => Ok((outcome, snapshot)),
        }
    }

    /// Does what takes a core for long, such as a search, when it is its turn.
    async fn in_turn<T: Send + 'static>(
        &self,
        turns: &Turns,
        work: impl FnOnce() -> T + Send + 'static,
    ) -> Result<T, Refusal> {
        match self.is_in_place {
            true => Ok(in_place(work)),
            false => turns.work(work).await.map_err(|error| failed(&error)),
        }
    }

    /// Does what may take long where blocking is allowed.
    async fn aside<T: Send + 'static>(
        &self,
        work: impl FnOnce() -> T + Send + 'static,
    ) -> Result<T, Refusal> {
        if self.is_in_place {
            return Ok(in_place(work));
        }
        let done = tokio::task::spawn_blocking(work).await;
        done.map_err(|error| failed(&error))
    }
}

fn failed(error: &JoinError) -> Refusal {
    Refusal::new(Code::Internal, format!("a computation failed: {error}"))
}

/// It is so, and may not be so after a restart.
fn not_durable() -> Refusal {
    let detail =
        "it is in force here and could not be stored; it is stored as soon as the disk takes it";
    Refusal {
        enforced: true,
        ..Refusal::new(Code::NotDurable, detail)
    }
}

impl std::fmt::Debug for Edge {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter
            .debug_struct("Edge")
            .field("epoch", &self.epoch)
            .finish_non_exhaustive()
    }
}
