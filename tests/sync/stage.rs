//! A registry and edges on a small network, and short ways to say what happens to them.

pub(crate) use crate::ladder::ladder;
use crate::line::Line;
use crate::memory_disk::MemoryDisk;
use jiff::{SignedDuration, Timestamp};
use serde_json::{Value, json};
use skyway::clock::{Clock, ManualClock};
use skyway::edge::sync::{Following, RegistryClient, SyncSettings};
use skyway::edge::{
    self, Caller, Decision, Edge, EventStream, Idempotency, PageRequest, Settings, ZoneWrite,
};
use skyway::formats::{load_network, write_network};
use skyway::network::Topology;
use skyway::registry::store::{Compaction, Store};
use skyway::registry::{self, Opening, Registry, WriteOptions, open_store};
use skyway::wire::{self, EventKind, Freshness, ObjectKind};
use std::sync::Arc;
use std::time::Duration;
use tempfile::TempDir;
use tokio_stream::StreamExt;

pub(crate) const NETWORK: &str = "ladder";
/// When every story begins.
pub(crate) const DAWN: &str = "2026-11-21T06:00:00Z";
/// Longer than anything takes, so that a test that hangs fails.
const WAIT_AT_MOST: Duration = Duration::from_secs(40);

pub(crate) fn dawn() -> Timestamp {
    DAWN.parse().expect("an instant")
}

/// A registry over a store in a file of its own.
pub(crate) struct Central {
    folder: TempDir,
    pub(crate) registry: Arc<Registry>,
    pub(crate) store: Arc<dyn Store>,
}

impl Central {
    pub(crate) async fn open() -> Self {
        Self::with(registry::Settings::default()).await
    }

    pub(crate) async fn with(settings: registry::Settings) -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        let (registry, store) = open(&folder, false, settings).await;
        let central = Self {
            folder,
            registry,
            store,
        };
        let text = write_network(&ladder());
        let manner = manner(None);
        let put = central.registry.put_network(NETWORK, &text, &manner);
        put.await.expect("a network");
        central
    }

    /// Drops the log of all that was changed.
    pub(crate) async fn compact(&self) {
        let (body, _) = self.registry.network(NETWORK).await.expect("a network");
        let compaction = Compaction {
            network: NETWORK.to_owned(),
            oldest: self.head().await,
            base_revision: 1,
            base: body.to_string(),
        };
        self.store.compact(&compaction).await.expect("compacted");
    }

    /// A copy of the store, while nothing writes.
    #[expect(
        clippy::disallowed_methods,
        reason = "a test copies the file of a store, as a backup does"
    )]
    pub(crate) fn back_up(&self) -> TempDir {
        let copy = tempfile::tempdir().expect("a folder");
        for file in self.folder.path().read_dir().expect("files") {
            let file = file.expect("a file");
            std::fs::copy(file.path(), copy.path().join(file.file_name())).expect("a copy");
        }
        copy
    }

    /// Opens a copy in place of the store.
    pub(crate) async fn restore_backup(&mut self, backup: TempDir) {
        self.folder = backup;
        self.restore().await;
    }

    /// Opens the same store again, as one restored from a backup.
    pub(crate) async fn restore(&mut self) {
        let settings = registry::Settings::default();
        let (registry, store) = open(&self.folder, true, settings).await;
        self.registry = registry;
        self.store = store;
    }

    pub(crate) async fn put_zone(&self, id: &str, x: f64, y: f64, radius_m: f64) -> String {
        let current = self.registry.object(NETWORK, ObjectKind::Zone, id).await;
        let manner = manner(current.ok().map(|(_, etag)| etag));
        let feature = circle(id, x, y, radius_m);
        let put = self
            .registry
            .put_zone(NETWORK, Some(id), feature, &manner)
            .await;
        put.expect("a zone").etag.expect("a version")
    }

    pub(crate) async fn lift_zone(&self, id: &str) {
        let kind = ObjectKind::Zone;
        let (_, etag) = self
            .registry
            .object(NETWORK, kind, id)
            .await
            .expect("a zone");
        let lifted = self
            .registry
            .delete(NETWORK, kind, id, &manner(Some(etag)))
            .await;
        lifted.expect("lifted");
    }

    /// The zones that the registry has, by id and radius.
    pub(crate) async fn zones(&self) -> Vec<(String, f64)> {
        let page = PageRequest {
            size: Some(1_000),
            token: None,
        };
        let listed = self
            .registry
            .objects(NETWORK, ObjectKind::Zone, &page)
            .await;
        let listed = listed.expect("a list").objects;
        listed.iter().map(id_and_radius).collect()
    }

    pub(crate) async fn closures(&self) -> Vec<Value> {
        let page = PageRequest::default();
        let kind = ObjectKind::Closure;
        let listed = self.registry.objects(NETWORK, kind, &page).await;
        listed.expect("a list").objects
    }

    pub(crate) async fn head(&self) -> u64 {
        let networks = self.registry.networks().await.expect("networks").networks;
        networks[0].head
    }
}

async fn open(
    folder: &TempDir,
    new_epoch: bool,
    settings: registry::Settings,
) -> (Arc<Registry>, Arc<dyn Store>) {
    let file = folder.path().join("registry.db");
    let store = open_store(&file.display().to_string()).await;
    let store = store.expect("a store");
    let registry = Registry::open(Opening {
        store: store.clone(),
        settings,
        clock: Clock::by_hand(dawn()).0,
        high_water: None,
        new_epoch,
    });
    (registry.await.expect("a registry"), store)
}

pub(crate) fn manner(if_match: Option<String>) -> WriteOptions {
    WriteOptions {
        subject: "operator".to_owned(),
        if_match,
        ..WriteOptions::default()
    }
}

/// An edge that follows.
pub(crate) struct Outpost {
    pub(crate) edge: Arc<Edge>,
    pub(crate) line: Line,
    pub(crate) hand: ManualClock,
    pub(crate) caller: Caller,
    following: Option<Following>,
}

impl Outpost {
    /// A registry with an edge that has all of it.
    pub(crate) async fn alone() -> (Central, Self) {
        let central = Central::open().await;
        let north = Self::set(&central, "north");
        north.settle(&central).await;
        (central, north)
    }

    /// The same with two.
    pub(crate) async fn pair() -> (Central, Self, Self) {
        let central = Central::open().await;
        let [north, south] = ["north", "south"].map(|name| Self::set(&central, name));
        north.settle(&central).await;
        south.settle(&central).await;
        (central, north, south)
    }

    pub(crate) fn set(central: &Central, name: &str) -> Self {
        Self::with(&central.registry, name, Settings::default())
    }

    pub(crate) fn with(registry: &Arc<Registry>, name: &str, settings: Settings) -> Self {
        let line = Line::to(registry, name, NETWORK);
        Self::following(line.clone(), line, name, settings)
    }

    /// One that keeps what it knows on a disk, and goes on with what is there.
    pub(crate) async fn over(registry: &Arc<Registry>, name: &str, disk: &MemoryDisk) -> Self {
        Self::over_with(registry, name, disk, Settings::default()).await
    }

    pub(crate) async fn over_with(
        registry: &Arc<Registry>,
        name: &str,
        disk: &MemoryDisk,
        settings: Settings,
    ) -> Self {
        let line = Line::to(registry, name, NETWORK);
        Self::on_disk(disk, line, name, settings).await
    }

    /// The machine dies and starts again, cut off from the registry.
    pub(crate) async fn crash(mut self, name: &str, disk: &MemoryDisk) -> Self {
        disk.crash();
        if let Some(following) = self.following.take() {
            following.stop().await;
        }
        let line = Line::to_nothing(name, NETWORK);
        Self::on_disk(disk, line, name, Settings::default()).await
    }

    async fn on_disk(disk: &MemoryDisk, line: Line, name: &str, settings: Settings) -> Self {
        let (opening, hand) = opening(settings);
        let edge = Edge::open(opening, disk.open()).await;
        let raised = (edge.expect("an edge"), hand);
        Self::raised(raised, line.clone(), line, name)
    }

    /// An edge that has no network of its own.
    pub(crate) fn without_network(
        registry: &Arc<Registry>,
        name: &str,
        settings: Settings,
    ) -> Self {
        let line = Line::to(registry, name, NETWORK);
        let raised = raise_on(Topology::nothing(), String::new(), settings);
        Self::raised(raised, line.clone(), line, name)
    }

    /// An edge over another network, which the registry has under its name.
    pub(crate) fn on(registry: &Arc<Registry>, network: &str, on: (Topology, String)) -> Self {
        let line = Line::to(registry, "north", network);
        let raised = raise_on(on.0, on.1, Settings::default());
        let mut settings = sync_settings("north");
        settings.network = network.to_owned();
        Self::raised_by(raised, line.clone(), line, settings)
    }

    /// An edge that follows what a script says.
    pub(crate) fn reading(script: impl RegistryClient, settings: Settings) -> Self {
        Self::following(script, Line::nowhere(), "north", settings)
    }

    fn following(client: impl RegistryClient, line: Line, name: &str, settings: Settings) -> Self {
        Self::raised(raise(settings), client, line, name)
    }

    fn raised(
        raised: (Arc<Edge>, ManualClock),
        client: impl RegistryClient,
        line: Line,
        name: &str,
    ) -> Self {
        Self::raised_by(raised, client, line, sync_settings(name))
    }

    fn raised_by(
        (edge, hand): (Arc<Edge>, ManualClock),
        client: impl RegistryClient,
        line: Line,
        settings: SyncSettings,
    ) -> Self {
        let following = edge.follow_registry(client, settings);
        Self {
            edge,
            line,
            hand,
            caller: Caller::anyone(),
            following: Some(following),
        }
    }

    pub(crate) async fn end(mut self) {
        if let Some(following) = self.following.take() {
            following.stop().await;
        }
    }

    /// Waits until something is so, moving the clock on so that pauses end.
    pub(crate) async fn until(&self, what: &str, is_so: impl AsyncFn() -> bool) {
        let waited = async {
            while !is_so().await {
                self.hand.advance(SignedDuration::from_millis(20));
                tokio::time::sleep(Duration::from_millis(1)).await;
            }
        };
        let waited = tokio::time::timeout(WAIT_AT_MOST, waited).await;
        waited.unwrap_or_else(|_| panic!("it never was so: {what}; {:?}", self.edge.status()));
    }

    /// Waits until what the edge knows now is on its disk.
    pub(crate) async fn stored(&self) {
        self.edge.tick().await.expect("the writer works");
    }

    /// Waits until the edge has all that the registry has.
    pub(crate) async fn has_read(&self, central: &Central) {
        self.until("all is read", async || {
            let identity = central.registry.identity().await.expect("an id");
            let (epoch, head) = (identity.epoch, central.head().await);
            let cursor = self.edge.stamp().registry_revision;
            cursor.is_some_and(|cursor| (cursor.epoch, cursor.revision) == (epoch, head))
        })
        .await;
    }

    /// Waits until the edge has all that the registry has, and the registry all of the edge.
    pub(crate) async fn settle(&self, central: &Central) {
        self.until("all is equal", async || {
            let (epoch, head) = (
                central.registry.identity().await.expect("an id").epoch,
                central.head().await,
            );
            let status = self.edge.status();
            let cursor = status.stamp.registry_revision;
            let is_there =
                cursor.is_some_and(|cursor| (cursor.epoch, cursor.revision) == (epoch, head));
            // It knows so a moment after it is so.
            let is_fresh = status.stamp.freshness == Freshness::Fresh;
            is_there && is_fresh && status.registry.expect("it follows").outbox == 0
        })
        .await;
    }

    pub(crate) fn zones(&self) -> Vec<(String, f64)> {
        let page = PageRequest {
            size: Some(1_000),
            token: None,
        };
        let listed = self.edge.zones(&self.caller, &page).expect("a list");
        listed.features.iter().map(id_and_radius).collect()
    }

    pub(crate) fn ids(&self) -> Vec<String> {
        self.zones().into_iter().map(|(id, _)| id).collect()
    }

    pub(crate) fn blocked(&self) -> usize {
        self.edge.status().blocked_segments
    }

    pub(crate) fn sync(&self) -> skyway::edge::sync::SyncStatus {
        self.edge.status().registry.expect("it follows")
    }

    pub(crate) async fn put_zone(&self, id: &str, x: f64, y: f64, radius_m: f64) {
        let etag = self.edge.zone(&self.caller, id).ok().map(|(_, etag)| etag);
        let write = ZoneWrite {
            id: Some(id.to_owned()),
            if_match: etag,
            validate_only: false,
        };
        let feature = circle(id, x, y, radius_m);
        let put = self.edge.put_zone(&self.caller, feature, write).await;
        put.expect("a zone");
    }

    pub(crate) async fn lift_zone(&self, id: &str) {
        let (_, etag) = self.edge.zone(&self.caller, id).expect("a zone");
        let write = ZoneWrite {
            id: Some(id.to_owned()),
            if_match: Some(etag),
            validate_only: false,
        };
        let lifted = self.edge.delete_zone(&self.caller, write, None).await;
        lifted.expect("lifted");
    }

    pub(crate) async fn close(&self, id: &str, segment: &str) {
        let draft = wire::ClosureDraft {
            id: Some(id.to_owned()),
            segments: vec![segment.to_owned()],
            ..wire::ClosureDraft::default()
        };
        let closed = self
            .edge
            .close(&self.caller, draft, Idempotency::default())
            .await;
        closed.expect("a closure");
    }

    pub(crate) fn holds(&self) -> Vec<wire::Hold<'static>> {
        let page = PageRequest::default();
        self.edge.holds(&self.caller, &page).expect("a list").holds
    }

    pub(crate) async fn decide(&self, hold: &wire::Hold<'_>, decision: Decision) {
        let decided = self.edge.decide_hold(&self.caller, &hold.id, decision);
        decided.await.expect("decided");
    }

    pub(crate) fn events(&self) -> EventStream {
        self.edge.events(None).expect("a stream")
    }
}

/// What has happened on a stream up to the next event of this kind.
pub(crate) async fn up_to(events: &mut EventStream, kind: EventKind) -> Vec<(EventKind, Value)> {
    let mut told = Vec::new();
    loop {
        let next = tokio::time::timeout(WAIT_AT_MOST, events.next()).await;
        let next = next.unwrap_or_else(|_| panic!("never {kind:?}: {told:?}"));
        let event = next.expect("more").expect("no gap");
        told.push((event.kind, event.event.data.clone()));
        if event.kind == kind {
            return told;
        }
    }
}

pub(crate) fn sync_settings(name: &str) -> SyncSettings {
    SyncSettings {
        network: NETWORK.to_owned(),
        edge_id: name.to_owned(),
        advertise: None,
        poll_wait: Duration::from_secs(10),
        retry_within: Duration::from_millis(200),
        seed: 1,
    }
}

/// An edge over the ladder, on a clock moved by hand.
pub(crate) fn raise(settings: Settings) -> (Arc<Edge>, ManualClock) {
    let (opening, hand) = opening(settings);
    (opening.without_store().expect("threads"), hand)
}

fn raise_on(topology: Topology, text: String, settings: Settings) -> (Arc<Edge>, ManualClock) {
    let (opening, hand) = opening_on(topology, text, settings);
    (opening.without_store().expect("threads"), hand)
}

fn opening(settings: Settings) -> (edge::Opening, ManualClock) {
    let text = write_network(&ladder());
    let loaded = load_network(&text).expect("the ladder is a network");
    opening_on(loaded.topology, text, settings)
}

fn opening_on(
    topology: Topology,
    text: String,
    settings: Settings,
) -> (edge::Opening, ManualClock) {
    let settings = Settings {
        closed_fraction_max: 0.2,
        follows_registry: true,
        ..settings
    };
    let (clock, hand) = Clock::by_hand(dawn());
    let opening = edge::Opening::new(Arc::new(topology), text.into(), 7, settings, clock);
    (opening, hand)
}

/// A round zone.
pub(crate) fn circle(id: &str, x: f64, y: f64, radius_m: f64) -> Value {
    json!({
        "type": "Feature", "id": id,
        "geometry": {"type": "Point", "coordinates": [x, y]},
        "properties": {"radius_m": radius_m, "margin_m": 0},
    })
}

fn id_and_radius(feature: &Value) -> (String, f64) {
    let id = feature["id"].as_str().expect("an id").to_owned();
    let radius_m = feature["properties"]["radius_m"].as_f64();
    (id, radius_m.unwrap_or_default())
}
