//! A street with shops and drones, a store in a file, and those who dispatch over it.

use super::edge::{MadeUpEdge, STREET};
use crate::harness::Place;
use jiff::{SignedDuration, Timestamp};
use serde_json::{Value, json};
use skyway::access::{Caller, Role};
use skyway::clock::{Clock, ManualClock};
use skyway::dispatch::{Dispatch, Settings};
use skyway::formats::write_network;
use skyway::network::{Coordinates, NetworkDraft, NodeDraft, SegmentDraft};
use skyway::refusal::Refusal;
use skyway::registry::documents::{Commit, Committed, Document, DocumentKind, Documents, Message};
use skyway::registry::{Opening, Registry, WriteOptions, open_store};
use skyway::wire::{
    Delivery, DeliveryOrder, DeliveryStatus, EdgeNews, EdgeReport, EndedAs, FlightNews, Id,
    NewsEntry, PlanState, WebhookDraft,
};
use std::sync::Arc;

pub(crate) const NETWORK: &str = "street";
pub(crate) const EDGE: &str = "edge-1";
pub(crate) const SERVICE: &str = "swift:parcels";
const HOOK: &str = "shop:hook";
/// The most orders of a customer that are not over.
pub(crate) const OPEN_MAX: u64 = 320;

pub(crate) struct World {
    pub(crate) dispatch: Arc<Dispatch>,
    pub(crate) documents: Arc<dyn Documents>,
    pub(crate) edge: Arc<MadeUpEdge>,
    pub(crate) hand: Arc<ManualClock>,
    clock: Clock,
    place: Arc<Place>,
}

fn street() -> String {
    let nodes = STREET.map(|(id, x)| NodeDraft {
        id: id.to_owned(),
        position: [x, 0.0],
        pads: 4,
        ..NodeDraft::default()
    });
    let segments = STREET.windows(2).map(|ends| SegmentDraft {
        from: ends[0].0.to_owned(),
        to: ends[1].0.to_owned(),
        ..SegmentDraft::default()
    });
    write_network(&NetworkDraft {
        name: "Street".to_owned(),
        coordinates: Coordinates::Planar,
        nodes: nodes.to_vec(),
        segments: segments.collect(),
        ..NetworkDraft::default()
    })
}

pub(crate) fn customer(tenant: &str) -> Caller {
    of(Role::Customer, tenant)
}

pub(crate) fn of(role: Role, tenant: &str) -> Caller {
    Caller {
        role,
        subject: Arc::from(format!("{tenant}/desk")),
        tenant: Arc::from(tenant),
        network: None,
    }
}

impl World {
    /// The street, with a service of the provider `swift` and drones at these nodes: `swift:0`, `swift:1`, ...
    pub(crate) async fn with_drones(homes: &[&str]) -> Self {
        let (clock, hand) = Clock::by_hand("2026-11-27T18:00:00Z".parse().expect("an instant"));
        let (place, edge) = (Arc::new(Place::new()), Arc::new(MadeUpEdge::default()));
        let world = Self::over(place, edge, clock, Arc::new(hand), true).await;
        world.put_service(&json!({})).await;
        for (number, home) in homes.iter().enumerate() {
            world.put_drone(&format!("swift:{number}"), home).await;
        }
        let hook = WebhookDraft {
            url: "http://127.0.0.1:9/".to_owned(),
            events: Vec::new(),
        };
        let shop = customer("shop");
        let put = world.dispatch.put_webhook(&shop, HOOK, &hook, None);
        put.await.expect("a webhook");
        world
    }

    /// Another process over the same store, at the same time.
    pub(crate) async fn another(&self) -> Self {
        let (place, edge) = (self.place.clone(), self.edge.clone());
        Self::over(place, edge, self.clock.clone(), self.hand.clone(), false).await
    }

    async fn over(
        place: Arc<Place>,
        edge: Arc<MadeUpEdge>,
        clock: Clock,
        hand: Arc<ManualClock>,
        is_new: bool,
    ) -> Self {
        let store = open_store(&place.store().display().to_string()).await;
        let registry = Registry::open(Opening {
            store: store.expect("a store"),
            settings: skyway::registry::Settings::default(),
            clock: clock.clone(),
            high_water: None,
            new_epoch: false,
        });
        let registry = registry.await.expect("a registry");
        if is_new {
            let options = WriteOptions::default();
            let put = registry.put_network(NETWORK, &street(), &options).await;
            put.expect("a network");
        }
        let report = EdgeReport {
            epoch: 1,
            revision: 1,
            nack: None,
            url: Some("http://edge.invalid".to_owned()),
        };
        let noted = registry.report_edge(NETWORK, EDGE, report).await;
        noted.expect("an edge");
        let settings = Settings {
            webhooks_anywhere: true,
            open_max: OPEN_MAX,
            ..Settings::default()
        };
        let documents = registry.documents();
        let client = edge.clone();
        let dispatch = Dispatch::with_edges(registry, documents.clone(), settings, client);
        Self {
            dispatch,
            documents,
            edge,
            hand,
            clock,
            place,
        }
    }

    pub(crate) fn now(&self) -> Timestamp {
        self.clock.now()
    }

    pub(crate) fn pass(&self, seconds: i64) {
        self.hand.advance(SignedDuration::from_secs(seconds));
    }

    pub(crate) async fn put(&self, kind: DocumentKind, id: &str, state: &str, body: &Value) {
        let before = self.documents.document(kind, id).await.expect("answers");
        let commit = Commit {
            puts: vec![Document {
                kind,
                id: id.to_owned(),
                tenant: "swift".to_owned(),
                party: String::new(),
                state: state.to_owned(),
                version: before.map_or(1, |before| before.version + 1),
                changed_ms: 0,
                body: body.to_string(),
            }],
            ..Commit::default()
        };
        let committed = self.documents.commit(&commit).await.expect("answers");
        assert_eq!(committed, Committed::Done);
    }

    pub(crate) async fn put_drone(&self, id: &str, home: &str) {
        let body =
            json!({"network": NETWORK, "home": home, "payload_max_kg": 3.0, "state": "available"});
        self.put(DocumentKind::Drone, id, "available", &body).await;
    }

    /// Publishes the service, with some fields otherwise; with another id beside it.
    pub(crate) async fn put_service(&self, otherwise: &Value) {
        let mut body = json!({
            "id": SERVICE,
            "provider": "swift",
            "name": "Parcels",
            "network": NETWORK,
            "payload_max_kg": 3.0,
            "time_zone": "UTC",
            "tariff": {"currency": "AUD", "base": "5", "per_km": "2", "minimum": "0"},
        });
        for (name, value) in otherwise.as_object().expect("fields") {
            body[name] = value.clone();
        }
        let id = body["id"].as_str().expect("an id");
        self.put(DocumentKind::Service, id, "", &body).await;
    }

    pub(crate) async fn try_order(&self, order: &DeliveryOrder) -> Result<Delivery, Refusal> {
        let shop = customer("shop");
        let options = WriteOptions {
            subject: shop.subject.to_string(),
            ..WriteOptions::default()
        };
        let reply = self
            .dispatch
            .create_delivery(&shop, order, &options)
            .await?;
        Ok(serde_json::from_str(&reply.body).expect("a delivery"))
    }

    /// Orders a delivery from one node to another. Its id.
    pub(crate) async fn order(&self, source: &str, destination: &str) -> String {
        // Ids sort by time.
        self.hand.advance(SignedDuration::from_millis(1));
        let placed = self.try_order(&errand(source, destination)).await;
        placed.expect("an order").id
    }

    pub(crate) async fn assign(&self) {
        self.dispatch.assign_now().await.expect("the store answers");
    }

    pub(crate) async fn delivery(&self, id: &str) -> Delivery {
        let found = self.dispatch.delivery(&customer("shop"), id).await;
        found.expect("a delivery")
    }

    pub(crate) async fn status(&self, id: &str) -> DeliveryStatus {
        self.delivery(id).await.status
    }

    pub(crate) async fn reason(&self, id: &str) -> String {
        self.delivery(id).await.reason.unwrap_or_default()
    }

    /// The drone of a delivery; empty where it has none.
    pub(crate) async fn drone_of(&self, id: &str) -> String {
        let allocation = self.delivery(id).await.allocation;
        allocation.map_or_else(String::new, |allocation| allocation.drone_id)
    }

    /// How a drone stands, and for which delivery.
    pub(crate) async fn drone(&self, id: &str) -> (String, Option<String>) {
        let document = self.documents.document(DocumentKind::Drone, id).await;
        let body = document.expect("answers").expect("a drone").body;
        let body: Value = serde_json::from_str(&body).expect("JSON");
        let state = body["state"].as_str().expect("a state").to_owned();
        (state, body["delivery_id"].as_str().map(str::to_owned))
    }

    /// What the webhook is told of a delivery, in order.
    pub(crate) async fn told(&self, id: &str) -> Vec<String> {
        let messages = self.documents.messages(HOOK, None, 1_000).await;
        let mut messages: Vec<Message> = messages.expect("answers");
        messages.retain(|message| message.subject == id);
        messages.sort_by_key(|message| message.number);
        messages
            .iter()
            .map(|message| message.event.clone())
            .collect()
    }

    /// News of the flight of a delivery.
    pub(crate) async fn news(&self, id: &str, state: PlanState, stops_served: u32) -> FlightNews {
        let delivery = self.delivery(id).await;
        let plan_id = delivery.allocation.expect("a drone").plan_id;
        self.news_of(id, plan_id, state, stops_served)
    }

    /// News of a plan that is flown for a delivery.
    pub(crate) fn news_of(
        &self,
        id: &str,
        plan_id: String,
        state: PlanState,
        stops_served: u32,
    ) -> FlightNews {
        let expected_at = self.now().checked_add(SignedDuration::from_secs(60));
        FlightNews {
            plan_id,
            delivery_id: id.to_owned(),
            drone_id: None,
            state,
            ended_as: None,
            version: 1,
            outcome: "composed".to_owned(),
            stops_served,
            stops: 2,
            holds: false,
            expected_at: expected_at.expect("within the calendar").to_string(),
            causes: Vec::new(),
            place: Some([2_500.0, 0.0]),
            landed_on: None,
        }
    }

    /// All news of a flight that goes as it should.
    pub(crate) async fn whole_flight(&self, id: &str, home: &str) -> Vec<FlightNews> {
        let mut ended = self.news(id, PlanState::Ended, 2).await;
        ended.ended_as = Some(EndedAs::Delivered);
        ended.landed_on = Some(home.to_owned());
        vec![
            self.news(id, PlanState::Accepted, 0).await,
            self.news(id, PlanState::Activated, 0).await,
            self.news(id, PlanState::Activated, 1).await,
            self.news(id, PlanState::Activated, 2).await,
            ended,
        ]
    }

    /// Tells news, numbered from `first` on. How far they are taken.
    pub(crate) async fn tell(&self, first: u64, flights: &[FlightNews]) -> u64 {
        let news = self.numbered(first, flights);
        let taken = self.dispatch.take_news(NETWORK, EDGE, news).await;
        taken.expect("news").through
    }

    pub(crate) fn numbered(&self, first: u64, flights: &[FlightNews]) -> EdgeNews {
        let entries = flights
            .iter()
            .zip(first..)
            .map(|(flight, number)| NewsEntry {
                number,
                at: self.now().to_string(),
                flight: Some(flight.clone()),
                failure: None,
            });
        EdgeNews {
            lineage: 1,
            news: entries.collect(),
        }
    }
}

pub(crate) fn errand(source: &str, destination: &str) -> DeliveryOrder {
    DeliveryOrder {
        network: Some(NETWORK.to_owned()),
        source: Some(Id::new(source.to_owned())),
        destination: Some(Id::new(destination.to_owned())),
        payload_kg: Some(1.0),
        ..DeliveryOrder::default()
    }
}
