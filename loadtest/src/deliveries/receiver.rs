//! The customer's endpoint: what it is told, when, and how often it fails.

use crate::Result;
use crate::arrivals::Chance;
use axum::Router;
use axum::body::Bytes;
use axum::extract::State;
use axum::http::{HeaderMap, StatusCode};
use axum::routing::post;
use jiff::Timestamp;
use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};
use std::net::{Ipv4Addr, SocketAddr};
use std::sync::{Arc, Mutex, MutexGuard};
use tokio::net::TcpListener;

/// A status of a delivery that was told.
#[derive(Clone, Debug)]
pub(super) struct Event {
    pub(super) status: String,
    /// When it was first taken, of all the times that it came.
    pub(super) taken_at: Timestamp,
}

/// What an endpoint was told.
#[derive(Default)]
pub(super) struct Received {
    /// By delivery, in the order in which they were first taken.
    pub(super) events: BTreeMap<String, Vec<Event>>,
    /// Calls that it failed.
    pub(super) failed: usize,
    /// Calls with what it had taken before.
    pub(super) repeated: usize,
    ids: BTreeSet<String>,
    fails: f64,
}

/// An endpoint.
pub(super) struct Receiver {
    pub(super) address: SocketAddr,
    state: Arc<Endpoint>,
}

struct Endpoint {
    chance: Mutex<Chance>,
    received: Mutex<Received>,
}

impl Receiver {
    pub(super) async fn open(seed: u64) -> Result<Self> {
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).await?;
        let address = listener.local_addr()?;
        let state = Arc::new(Endpoint {
            chance: Mutex::new(Chance::of(seed)),
            received: Mutex::default(),
        });
        let router = Router::new().route("/hooks", post(take));
        let router = router.with_state(state.clone());
        tokio::spawn(async move { axum::serve(listener, router).await });
        Ok(Self { address, state })
    }

    /// From now on it fails this part of all calls.
    pub(super) fn fail(&self, part: f64) {
        self.received().fails = part;
    }

    pub(super) fn received(&self) -> MutexGuard<'_, Received> {
        self.state
            .received
            .lock()
            .expect("a call that panics ends the run")
    }
}

async fn take(State(state): State<Arc<Endpoint>>, headers: HeaderMap, body: Bytes) -> StatusCode {
    let drawn = state.chance.lock().map_or(1.0, |mut chance| chance.unit());
    let id = headers
        .get("webhook-id")
        .and_then(|id| id.to_str().ok())
        .unwrap_or_default();
    let told: Value = serde_json::from_slice(&body).unwrap_or_default();
    let data = &told["data"];
    let (Some(delivery), Some(status)) = (data["delivery_id"].as_str(), data["status"].as_str())
    else {
        return StatusCode::BAD_REQUEST;
    };
    let Ok(mut received) = state.received.lock() else {
        return StatusCode::INTERNAL_SERVER_ERROR;
    };
    if drawn < received.fails {
        received.failed += 1;
        return StatusCode::SERVICE_UNAVAILABLE;
    }
    if !received.ids.insert(id.to_owned()) {
        received.repeated += 1;
        return StatusCode::NO_CONTENT;
    }
    let event = Event {
        status: status.to_owned(),
        taken_at: Timestamp::now(),
    };
    let events = received.events.entry(delivery.to_owned());
    events.or_default().push(event);
    StatusCode::NO_CONTENT
}
