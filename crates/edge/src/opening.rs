//! How an edge begins: with nothing, or with all that its file has.

use crate::Edge;
use crate::background::SearchTurns;
use crate::drones::Drones;
use crate::drones::answered_lately::AnsweredLately;
use crate::drones::positions::Positions;
use crate::events::{Events, Happening};
use crate::failures::records::Records;
use crate::line::Lines;
use crate::line::claims::Claims;
use crate::network::documents::NetworkDocuments;
use crate::network::tables::{TableMaker, Tables};
use crate::planner::{Concern, Planner, planner_of};
use crate::replanning::offers::Offers;
use crate::replanning::opened::{self, Listener, Opened};
use crate::replies::{Bounds, ReportReplies, WriteReplies};
use crate::settings::Settings;
use crate::snapshot::{FIRST_TOPOLOGY, Snapshot};
use crate::state::State;
use crate::store::{
    Identity, Keeper, Reply, Row, Store, StoreFault, StoreFile, Table, Transaction, Waiting,
    WavesAhead, airframe_row, check_clock, open_identity, restore, stored_network,
};
use crate::sync::Contact;
use crate::writer::{Unanswered, Watch, WaveState, WhenIdle, Writer, WriterLoop, WriterStep};
use arc_swap::{ArcSwap, ArcSwapOption};
use bytes::Bytes;
use jiff::Timestamp;
use skyway_contract::ClockKind;
use skyway_engine::network::Topology;
use skyway_service::clock::Clock;
use skyway_service::config::PackKeys;
use std::io;
use std::sync::atomic::AtomicU64;
use std::sync::{Arc, Mutex};
use thiserror::Error;
use tokio::runtime::Handle;

/// Why an edge does not begin.
#[derive(Debug, Error)]
pub enum OpenError {
    /// Its file cannot be used.
    #[error(transparent)]
    Store(#[from] StoreFault),
    /// The system gives no threads.
    #[error("the system refuses what the edge needs: {0}")]
    System(#[from] io::Error),
}

/// What an edge begins with.
#[derive(Debug)]
pub struct Opening {
    topology: Arc<Topology>,
    geojson: Bytes,
    epoch: u64,
    settings: Settings,
    clock: Clock,
    fresh_id: String,
    is_in_place: bool,
    storekeepers_place: Option<Handle>,
    pack_keys: Option<PackKeys>,
    watch: Watch,
}

impl Opening {
    /// An edge over a network.
    ///
    /// `geojson` is the text that the topology was read from, which clients get. `epoch` is to be greater than
    /// that of every start before, such as the time of the start; one with a file sees to that by itself.
    pub fn new(
        topology: Arc<Topology>,
        geojson: Bytes,
        epoch: u64,
        settings: Settings,
        clock: Clock,
    ) -> Self {
        Self {
            topology,
            geojson,
            epoch,
            settings,
            fresh_id: format!("edge-{epoch}"),
            // Threads of its own would make of one run of a client's clock another each time.
            is_in_place: clock.kind() == ClockKind::External,
            clock,
            storekeepers_place: None,
            pack_keys: None,
            watch: Watch::default(),
        }
    }

    /// With this id, where the file has none yet.
    #[must_use]
    pub fn fresh_id(mut self, id: String) -> Self {
        self.fresh_id = id;
        self
    }

    /// Without threads: everything happens on the caller's thread, in the order in which it is asked.
    /// What is due happens with the next change, or [`Edge::tick`].
    #[must_use]
    pub fn in_place(mut self) -> Self {
        self.is_in_place = true;
        self
    }

    /// With somebody who is told, on the writer's thread, where the writer is: as long as that takes, it does nothing.
    #[must_use]
    pub fn watched_by(mut self, watch: impl Fn(WriterStep) + Send + Sync + 'static) -> Self {
        self.watch = Watch(Some(Arc::new(watch)));
        self
    }

    /// With keys to sign packs with; without them it makes one that ends with it.
    #[must_use]
    pub fn signing_with(mut self, keys: Option<PackKeys>) -> Self {
        self.pack_keys = keys;
        self
    }

    /// With its file kept on another runtime than the one it is opened on.
    #[must_use]
    pub fn storing_on(mut self, runtime: Handle) -> Self {
        self.storekeepers_place = Some(runtime);
        self
    }

    /// Begins an edge that forgets everything when it ends.
    ///
    /// # Errors
    /// When a thread cannot be started.
    pub fn without_store(self) -> io::Result<Arc<Edge>> {
        let identity = Identity::of_one_start(self.fresh_id.clone(), self.epoch);
        let (tables, maker) = Tables::new(self.settings.trees_bytes);
        let state = self.state(&identity, &tables);
        let lines = Arc::new(Lines::new(Arc::new(state.next.clone()), self.clock.kind()));
        let store = Store::without_file(lines.clone());
        self.begin(state, (store, lines), identity, (tables, maker))
    }

    pub(super) async fn with_store(
        mut self,
        mut file: Box<dyn StoreFile>,
    ) -> Result<Arc<Edge>, OpenError> {
        let number = file.number().await?;
        let facts = file.load(Table::Facts).await?;
        let (identity, identity_row) = open_identity(&facts, self.fresh_id.clone(), self.epoch)?;
        let airframe_row = airframe_row(&facts, self.settings.names_airframe);
        if airframe_row.is_none() {
            self.settings.flight = None;
            tracing::warn!(
                "the store was written without an airframe, so this edge has none and plans by distance; \
                 set flight.airframe: phantom3, another one, or none"
            );
        }
        if let Some((topology, geojson)) = stored_network(&facts, &self.topology)? {
            self.topology = topology;
            self.geojson = geojson;
        }
        let clock_row = check_clock(&facts, self.clock.kind())?;
        let mut restored = restore(&mut *file, &facts, &self.topology).await?;
        if let Some(as_of) = restored.as_of {
            self.clock.resume(as_of, restored.clock_apart);
        }
        let replies = std::mem::take(&mut restored.replies);
        let (tables, maker) = Tables::new(self.settings.trees_bytes);
        let mut state = self.state(&identity, &tables);
        state.restore(restored, self.clock.now());
        let stored = Arc::new(state.next.clone());
        // By a clock that has stepped nothing opens before the first batch either.
        state.hear_clock(&self.clock.reading());
        // Remembered before anything is told under the new epoch.
        let network_row = crate::store::network_row(&stored.network, &self.topology);
        let rows: Vec<Row> = [identity_row, network_row]
            .into_iter()
            .chain(airframe_row)
            .chain(clock_row)
            .collect();
        let number = number + 1;
        let writer = identity.epoch;
        let first = Transaction {
            number,
            writer,
            rows,
        };
        file.commit(&first).await?;
        let lines = Arc::new(Lines::new(stored.clone(), self.clock.kind()));
        let clock = self.clock.clone();
        let (keeper, store) =
            Keeper::new(file, (number, stored), lines.clone(), clock, &self.settings);
        state.store = store.health().clone();
        let place = self.storekeepers_place.take();
        let keeper = place.unwrap_or_else(Handle::current).spawn(keeper.run());
        let edge = self.begin(state, (store, lines), identity, (tables, maker))?;
        for (at, reply) in replies {
            match reply {
                Reply::Report(reply) => edge.report_replies.restore(*reply, at),
                Reply::Write(reply) => edge.write_replies.restore(reply, at),
            }
        }
        // Nothing fails while it holds the lock.
        if let Ok(mut place) = edge.keeper.lock() {
            *place = Some(keeper);
        }
        Ok(edge)
    }

    fn state(&self, identity: &Identity, tables: &Tables) -> State {
        let documents = NetworkDocuments::of(&self.topology, self.geojson.clone(), FIRST_TOPOLOGY);
        let next = Snapshot::empty(
            self.topology.clone(),
            Arc::new(documents),
            (identity.epoch, identity.lineage),
            self.clock.now(),
            &self.settings,
        );
        let drones = Arc::new(Drones::new(self.settings.drones_max));
        let now = self.clock.now();
        let planner = planner_of(&self.settings, now, tables.clone());
        let mut state = State::new(next, now, self.settings.clone(), drones, planner);
        state.writes = identity.first_number();
        state
    }

    /// Publishes the state, with what has become due while the edge was away, and sets writer and tables to work.
    fn begin(
        self,
        mut state: State,
        (store, lines): (Store, Arc<Lines>),
        identity: Identity,
        (tables, maker): (Tables, TableMaker),
    ) -> io::Result<Arc<Edge>> {
        let (settings, clock, epoch) = (self.settings, self.clock, identity.epoch);
        let (planner, drones) = (state.planner.clone(), state.drones.clone());
        let events = Arc::new(events_of(epoch, &clock, &settings));
        let now = clock.now();
        let (snapshot, told) = caught_up(&mut state, self.is_in_place, now);
        let world = Arc::new(ArcSwap::new(snapshot.clone()));
        events.add(told, now, &snapshot.revision);
        store.publish(Waiting::without_answers(snapshot));
        if !self.is_in_place {
            let world = world.clone();
            maker.start(move || world.load().airspace().clone())?;
        }
        let (opened, mut listener) = word_of_openings(&*planner, &clock, self.is_in_place);
        let writer_loop = WriterLoop {
            opened,
            state,
            store: store.clone(),
            clock: clock.clone(),
            world: world.clone(),
            events: events.clone(),
            tables: tables.clone(),
            watch: self.watch,
            workers: None,
            wave: WaveState::default(),
            when_idle: WhenIdle::default(),
            waiting: Unanswered::default(),
            waves_ahead: WavesAhead::default(),
        };
        let edge = Arc::new(Edge {
            contact: Contact::new(&clock),
            records: Records::new(epoch, settings.records_max, settings.records_bytes_max),
            report_replies: ReportReplies::new(Bounds::of(&settings)),
            write_replies: WriteReplies::new(Bounds::of(&settings), store.clone()),
            next_number: AtomicU64::new(identity.first_number() + 1),
            keeper: Mutex::new(None),
            id: identity.id,
            lineage: identity.lineage,
            is_in_place: self.is_in_place,
            settings,
            clock,
            epoch,
            world,
            guard: writer_loop.state.guard.clone(),
            writer: writer_of(writer_loop, self.is_in_place)?,
            store,
            events,
            lines,
            claims: Claims::default(),
            drones,
            positions: Positions::default(),
            planner,
            failure_rates: ArcSwapOption::empty(),
            pack_keys: ArcSwap::from_pointee(self.pack_keys.map_or_else(|| fresh_keys(now), Ok)?),
            off_plan: AnsweredLately::default(),
            offers: Mutex::new(Offers::new(listener.take_if(|_| self.is_in_place))),
            tables,
            turns: SearchTurns::default(),
        });
        let started = listener.map(|listener| listener.start(Arc::downgrade(&edge)));
        started.transpose().map(|_| edge)
    }
}

/// A key that nobody else has.
fn fresh_keys(now: Timestamp) -> io::Result<PackKeys> {
    let mut seed = [0; 32];
    getrandom::fill(&mut seed).map_err(io::Error::other)?;
    Ok(PackKeys::of_seed(seed, now))
}

fn writer_of(writer_loop: WriterLoop, is_in_place: bool) -> io::Result<Writer> {
    match is_in_place {
        true => Ok(Writer::in_place(writer_loop)),
        false => Writer::start(writer_loop),
    }
}

fn events_of(epoch: u64, clock: &Clock, settings: &Settings) -> Events {
    let bounds = (settings.events_max, settings.events_bytes_max);
    Events::new((epoch, clock.kind()), bounds, settings.event_streams_max)
}

/// Where it is told that something has opened, and the other end, which a thread hears, or in place a client that moves
/// the clock; nothing where neither is there.
fn word_of_openings(
    planner: &dyn Planner,
    clock: &Clock,
    is_in_place: bool,
) -> (Option<Opened>, Option<Listener>) {
    let is_heard = !is_in_place || clock.kind() == ClockKind::External;
    let leads_to_offers = planner.minds(Concern::Improvement, None) && is_heard;
    leads_to_offers.then(opened::channel).unzip()
}

/// The state with what has become due while the edge was away, and what is told of it.
fn caught_up(
    state: &mut State,
    is_in_place: bool,
    now: Timestamp,
) -> (Arc<Snapshot>, Vec<Happening>) {
    let enforced = state.enforce(Vec::new(), now);
    state.look_up(&enforced.look, now);
    // The writer goes on with the rest.
    state.replan(now, &mut || {});
    while is_in_place && state.has_waiting() {
        state.replan(now, &mut || {});
    }
    state.told()
}
