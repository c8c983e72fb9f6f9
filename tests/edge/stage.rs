//! An edge on a small network, and short ways to say what happens to it.

pub(crate) use crate::ladder::{ladder, segment};
use bytes::Bytes;
use jiff::{SignedDuration, Timestamp};
use serde_json::{Value, json};
use skyway::clock::{Clock, ManualClock, ManualClocks};
use skyway::edge::{
    Caller, Edge, Idempotency, NewNetwork, Opening, Refusal, ReportResponse, Settings, StoreFile,
    WriterStep, ZoneWrite,
};
use skyway::formats::{load_network, parse_report, read_network, write_network};
use skyway::network::{NetworkDraft, NodeDraft, SegmentDraft, Topology};
use skyway::wire;
use std::sync::{Arc, OnceLock, Weak};
use std::time::Duration;

/// When every story begins.
pub(crate) const DAWN: &str = "2026-11-21T06:00:00Z";
/// The epoch of every edge here, so that ids are the same in every run.
pub(crate) const EPOCH: u64 = 7;

/// Longer than any disk takes that works.
pub(crate) const WAIT_AT_MOST: Duration = Duration::from_secs(30);

pub(crate) struct Stage {
    pub(crate) edge: Arc<Edge>,
    pub(crate) hand: Arc<ManualClock>,
    settings: Settings,
    pub(crate) caller: Caller,
}

impl Drop for Stage {
    /// Every answer and every version has passed the checker.
    fn drop(&mut self) {
        if !std::thread::panicking() {
            assert_eq!(self.edge.status().checker_cases, 0, "cases of the checker");
        }
    }
}

impl Stage {
    /// A ladder of two rows of eight nodes, 100 m apart:
    ///
    /// ```text
    /// b0 - b1 - b2 - ... - b7
    ///  |    |    |          |
    /// a0 - a1 - a2 - ... - a7
    /// ```
    pub(crate) fn set() -> Self {
        // Of the ladder's 22 segments one hundredth would be none.
        Self::with(Settings {
            closed_fraction_max: 0.2,
            ..Settings::default()
        })
    }

    pub(crate) fn with(settings: Settings) -> Self {
        let network = loaded(&ladder());
        Self::on(network.topology, network.geojson, settings)
    }

    /// On a network of one's own.
    pub(crate) fn on(topology: Arc<Topology>, geojson: Bytes, settings: Settings) -> Self {
        let dawn: Timestamp = DAWN.parse().expect("an instant");
        let (clock, hand) = Clock::by_hand(dawn);
        let opening = Opening::new(topology, geojson, EPOCH, settings.clone(), clock);
        Self {
            edge: opening.without_store().expect("threads"),
            hand: Arc::new(hand),
            caller: Caller::anyone(),
            settings,
        }
    }

    /// Watched on the writer's thread, which does nothing meanwhile; in place everything is on one thread.
    pub(crate) fn watched(
        settings: Settings,
        is_in_place: bool,
        watch: impl Fn(&Arc<Edge>, WriterStep) + Send + Sync + 'static,
    ) -> Self {
        let known: Arc<OnceLock<Weak<Edge>>> = Arc::default();
        let place = known.clone();
        let (opening, hand) = opening(settings.clone());
        let opening = opening.watched_by(move |step| {
            if let Some(edge) = place.get().and_then(Weak::upgrade) {
                watch(&edge, step);
            }
        });
        let opening = match is_in_place {
            true => opening.in_place(),
            false => opening,
        };
        let edge = opening.without_store().expect("threads");
        known.set(Arc::downgrade(&edge)).expect("once");
        Self {
            edge,
            hand: Arc::new(hand),
            caller: Caller::anyone(),
            settings,
        }
    }

    /// The same over a file.
    pub(crate) async fn over(file: Box<dyn StoreFile>) -> Self {
        let settings = Settings {
            commit_within: WAIT_AT_MOST,
            ..Settings::default()
        };
        Self::over_with(file, settings).await
    }

    /// Over a disk that may hang.
    pub(crate) async fn impatient(file: Box<dyn StoreFile>) -> Self {
        let settings = Settings {
            commit_within: Duration::from_millis(100),
            ..Settings::default()
        };
        Self::over_with(file, settings).await
    }

    pub(crate) async fn over_with(file: Box<dyn StoreFile>, settings: Settings) -> Self {
        let settings = Settings {
            closed_fraction_max: 0.2,
            ..settings
        };
        let (opening, hand) = opening(settings.clone());
        Self {
            edge: Edge::open(opening, file).await.expect("an edge"),
            hand: Arc::new(hand),
            caller: Caller::anyone(),
            settings,
        }
    }

    /// Another start over the same file, once all is stored: the clock goes on, the process does not.
    pub(crate) async fn again(self, file: Box<dyn StoreFile>) -> Self {
        let settings = self.settings.clone();
        self.again_with(file, settings).await
    }

    /// The same, configured otherwise.
    pub(crate) async fn again_with(self, file: Box<dyn StoreFile>, settings: Settings) -> Self {
        let (topology, geojson) = network();
        let clock = self.edge.clock().clone();
        self.edge.end().await;
        let opening = Opening::new(topology, geojson, EPOCH, settings.clone(), clock);
        Self {
            edge: Edge::open(opening, file).await.expect("an edge"),
            settings,
            hand: self.hand.clone(),
            caller: self.caller.clone(),
        }
    }

    /// Over a file, by a clock of one's own; the hand of the stage moves nothing.
    pub(crate) async fn by_clock(file: Box<dyn StoreFile>, clock: Clock) -> Self {
        let settings = Settings {
            commit_within: WAIT_AT_MOST,
            ..Settings::default()
        };
        let (topology, geojson) = network();
        let opening = Opening::new(topology, geojson, EPOCH, settings.clone(), clock);
        Self {
            edge: Edge::open(opening, file).await.expect("an edge"),
            hand: Arc::new(Clock::by_hand(DAWN.parse().expect("an instant")).1),
            caller: Caller::anyone(),
            settings,
        }
    }

    /// On a machine's clock, of which both the wall clock and the time that only goes forward are moved by hand; the
    /// hand of the stage moves nothing.
    pub(crate) fn on_machine_clock() -> (Self, ManualClocks) {
        let network = loaded(&ladder());
        let dawn: Timestamp = DAWN.parse().expect("an instant");
        let (clock, hands) = Clock::by_two_hands(dawn);
        let settings = Settings {
            closed_fraction_max: 0.2,
            ..Settings::default()
        };
        let (topology, geojson) = (network.topology, network.geojson);
        let opening = Opening::new(topology, geojson, EPOCH, settings.clone(), clock);
        let stage = Self {
            edge: opening.without_store().expect("threads"),
            hand: Arc::new(Clock::by_hand(dawn).1),
            caller: Caller::anyone(),
            settings,
        };
        (stage, hands)
    }

    /// Changes the ladder, or what has become of it, and puts that into service.
    pub(crate) async fn rebuild(&self, change: impl FnOnce(&mut NetworkDraft)) {
        let text = self.edge.network_geojson().expect("a network").0;
        let text = std::str::from_utf8(&text).expect("UTF-8");
        let mut draft = read_network(text).expect("a network");
        change(&mut draft);
        let replaced = self.edge.replace_network(loaded(&draft)).await;
        replaced.expect("the network is put into service");
    }

    /// Lets time pass, and what is due happen.
    pub(crate) async fn pass(&self, span: SignedDuration) {
        self.hand.advance(span);
        self.settle().await;
    }

    /// Waits until the writer has done all that was handed in before.
    pub(crate) async fn settle(&self) {
        self.edge.tick().await.expect("the writer works");
    }

    pub(crate) async fn report(&self, body: Value) -> Result<ReportResponse, Refusal> {
        let parsed = parse_report(body.to_string().as_bytes())?;
        let answered = self.edge.report_failure(&self.caller, parsed).await;
        self.settle().await;
        answered
    }

    /// The answer to a report as its drone gets it.
    pub(crate) async fn answer(&self, body: Value) -> Value {
        let answered = self.report(body).await.expect("an outcome");
        serde_json::to_value(answered.to_wire()).expect("JSON")
    }

    pub(crate) async fn compose(
        &self,
        id: &str,
        drone: &str,
        from: &str,
        to: &str,
    ) -> wire::Plan<'static> {
        let request = json!({"id": id, "drone_id": drone, "source": from, "destination": to, "airspeed_mps": 10.0});
        let request = serde_json::from_value(request).expect("a delivery request");
        let plan = self
            .edge
            .compose_plan(&self.caller, request, Idempotency::default())
            .await;
        plan.expect("a plan")
    }

    pub(crate) fn plan(&self, id: &str) -> wire::Plan<'static> {
        self.edge.plan(&self.caller, id).expect("a plan")
    }

    pub(crate) async fn zone(&self, feature: Value) -> wire::ZoneAck<'static> {
        let write = ZoneWrite::default();
        let ack = self
            .edge
            .create_zone(&self.caller, feature, write, Idempotency::default())
            .await;
        ack.expect("a zone")
    }

    pub(crate) async fn see(&self, drone: &str, x: f64, y: f64) -> wire::TelemetryAnswer<'static> {
        self.see_at(drone, json!({"x": x, "y": y})).await
    }

    pub(crate) async fn see_at(
        &self,
        drone: &str,
        location: Value,
    ) -> wire::TelemetryAnswer<'static> {
        let positions = vec![json!({"drone_id": drone, "location": location})];
        let batch = wire::Telemetry { positions };
        let told = self.edge.telemetry(&self.caller, batch).await;
        told.expect("telemetry")
    }
}

/// The ladder, and its text.
pub(crate) fn network() -> (Arc<Topology>, Bytes) {
    let network = loaded(&ladder());
    (network.topology, network.geojson)
}

fn opening(settings: Settings) -> (Opening, ManualClock) {
    let dawn: Timestamp = DAWN.parse().expect("an instant");
    let (clock, hand) = Clock::by_hand(dawn);
    let (topology, geojson) = network();
    (
        Opening::new(topology, geojson, EPOCH, settings, clock),
        hand,
    )
}

/// A round zone.
pub(crate) fn circle(id: &str, x: f64, y: f64, radius_m: f64) -> Value {
    json!({
        "type": "Feature", "id": id,
        "geometry": {"type": "Point", "coordinates": [x, y]},
        "properties": {"radius_m": radius_m, "margin_m": 0},
    })
}

/// Ids as text, for comparing.
pub(crate) fn names(ids: &[wire::Id<'_>]) -> Vec<String> {
    ids.iter().map(ToString::to_string).collect()
}

/// A network as an edge takes it.
pub(crate) fn loaded(draft: &NetworkDraft) -> NewNetwork {
    let text = write_network(draft);
    let loaded = load_network(&text).expect("a network");
    NewNetwork::new(Arc::new(loaded.topology), text.into())
}

/// Takes a node and its segments away.
pub(crate) fn without(draft: &mut NetworkDraft, node: &str) {
    draft.nodes.retain(|other| other.id != node);
    let touches = |segment: &SegmentDraft| segment.from == node || segment.to == node;
    draft.segments.retain(|segment| !touches(segment));
}

pub(crate) fn node(id: &str, x: f64, y: f64) -> NodeDraft {
    NodeDraft {
        id: id.to_owned(),
        position: [x, y],
        ..NodeDraft::default()
    }
}
