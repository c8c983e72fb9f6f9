//! A registry in this process, over a store in a file, with a client.

use crate::drafts::{NETWORK, square};
use bytes::Bytes;
use jiff::Timestamp;
use prometheus_client::registry::Registry as Metrics;
use reqwest::Method;
use serde_json::{Value, json};
use skyway::access::{Caller, Role};
use skyway::api::metrics::RequestMetrics;
use skyway::api::operations::{Daemon, Listener};
use skyway::api::registry;
use skyway::api::server::{
    Authentication, Drain, GateConfig, KnownTokens, QueueWait, ServerConfig, Slots, serve,
};
use skyway::clock::{Clock, ManualClock};
use skyway::dispatch::{self, Dispatch};
use skyway::registry::{HighWater, Opening, Registry, Settings, open_store};
use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;
use tempfile::TempDir;
use tokio::net::TcpListener;
use tokio::sync::watch;
use tokio::task::JoinHandle;
use tokio_util::sync::CancellationToken;

/// Longer than anything takes, so that a test that hangs fails.
pub(crate) const WAIT_AT_MOST: Duration = Duration::from_secs(40);

/// A folder for a store that outlives the registries over it.
pub(crate) struct Place {
    folder: TempDir,
}

impl Place {
    pub(crate) fn new() -> Self {
        Self {
            folder: tempfile::tempdir().expect("a folder"),
        }
    }

    pub(crate) fn path(&self) -> &Path {
        self.folder.path()
    }

    pub(crate) fn store(&self) -> PathBuf {
        self.path().join("registry.db")
    }

    /// Opens the registry that is there.
    pub(crate) async fn open(&self, settings: Settings, new_epoch: bool) -> Served {
        let store = open_store(&self.store().display().to_string()).await;
        let start: Timestamp = "2026-11-27T18:00:00Z".parse().expect("an instant");
        let (clock, hand) = Clock::by_hand(start);
        let registry = Registry::open(Opening {
            store: store.expect("a store"),
            settings,
            clock,
            high_water: Some(HighWater::at(self.path().join("high-water"))),
            new_epoch,
        });
        let registry = registry.await.expect("a registry");
        Served::serve(registry, hand).await
    }
}

/// A registry that is served.
pub(crate) struct Served {
    pub(crate) registry: Arc<Registry>,
    dispatch: Arc<Dispatch>,
    pub(crate) drain: Drain,
    pub(crate) hand: ManualClock,
    address: SocketAddr,
    admin: SocketAddr,
    client: reqwest::Client,
    stop: CancellationToken,
    running: JoinHandle<()>,
}

/// What was answered.
pub(crate) struct Told {
    pub(crate) status: u16,
    headers: reqwest::header::HeaderMap,
    pub(crate) body: String,
    pub(crate) bytes: Bytes,
}

impl Told {
    pub(crate) fn header(&self, name: &str) -> String {
        let value = self.headers.get(name);
        value.map_or_else(String::new, |value| {
            value.to_str().expect("text").to_owned()
        })
    }

    pub(crate) fn etag(&self) -> String {
        self.header("etag")
    }

    #[track_caller]
    pub(crate) fn json(&self) -> Value {
        serde_json::from_str(&self.body).unwrap_or_else(|error| panic!("{error}: {}", self.body))
    }

    /// The same answer, which has to have this status.
    #[track_caller]
    pub(crate) fn is(self, status: u16) -> Self {
        assert_eq!(self.status, status, "{}", self.body);
        self
    }

    /// The same answer, which has to be this problem.
    #[track_caller]
    pub(crate) fn refuses(self, status: u16, code: &str) -> Self {
        let told = self.is(status);
        assert_eq!(told.json()["code"], code, "{}", told.body);
        told
    }
}

async fn listen(
    listener: Listener,
    router: axum::Router,
    drain: &Drain,
    authentication: Authentication,
) -> SocketAddr {
    let socket = TcpListener::bind("127.0.0.1:0").await.expect("a free port");
    let address = socket.local_addr().expect("an address");
    let gate = GateConfig {
        daemon: Daemon::Registry,
        listener,
        authentication,
        slots: Slots::default(),
        queue_wait: Arc::new(QueueWait::unbounded()),
        body_bytes_max: 1 << 20,
        file_bytes_max: 8 << 20,
        deadline: WAIT_AT_MOST,
        follow_wait: WAIT_AT_MOST,
    };
    let metrics = Arc::new(RequestMetrics::new(&mut Metrics::default()));
    let config = ServerConfig::default();
    tokio::spawn(serve(socket, router, gate, config, metrics, drain.clone()));
    address
}

impl Served {
    async fn serve(registry: Arc<Registry>, hand: ManualClock) -> Self {
        let settings = dispatch::Settings::default();
        let dispatch = Dispatch::new(registry.clone(), registry.documents(), settings);
        let drain = Drain::new();
        let (router, _) = registry::router(dispatch.clone(), drain.clone());
        let loopback = Authentication::Loopback;
        let address = listen(Listener::Main, router, &drain, loopback.clone()).await;
        let metrics = Arc::new(Metrics::default());
        let admin = registry::admin_router(dispatch.clone(), metrics, drain.clone());
        let admin = listen(Listener::Admin, admin, &drain, loopback).await;
        let client = reqwest::Client::builder().no_proxy().http1_only();
        let stop = CancellationToken::new();
        Self {
            running: tokio::spawn(registry.clone().run(stop.clone())),
            registry,
            dispatch,
            drain,
            hand,
            address,
            admin,
            client: client.build().expect("a client"),
            stop,
        }
    }

    /// A registry with the square in it.
    pub(crate) async fn with_network(place: &Place, settings: Settings) -> Self {
        let served = place.open(settings, false).await;
        let path = format!("PUT /v1/networks/{NETWORK}");
        served.ask(&path, &[], &square()).await.is(201);
        served
    }

    /// The same registry behind tokens: `ROLE/TENANT` is the token of that role and tenant.
    pub(crate) async fn ask_only_with_tokens(&mut self) {
        let (router, _) = registry::router(self.dispatch.clone(), self.drain.clone());
        let tokens = Authentication::Tokens(KnownTokens {
            find: Arc::new(caller_of),
            changed: watch::channel(0).1,
        });
        self.address = listen(Listener::Main, router, &self.drain, tokens).await;
    }

    /// Ends it and closes its store.
    pub(crate) async fn end(self) {
        self.drain.begin();
        self.stop.cancel();
        self.running.await.expect("the upkeep ends");
    }

    /// Asks whether it is ready, without waiting for the answer.
    pub(crate) fn probe_later(&self) -> JoinHandle<Told> {
        let (client, address) = (self.client.clone(), self.address);
        tokio::spawn(async move { ask(&client, address, "GET /readyz", &[], "").await })
    }

    /// Closes its store, which answers nothing more; the registry is served as before.
    pub(crate) async fn lose_store(&mut self) {
        self.stop.cancel();
        (&mut self.running).await.expect("the upkeep ends");
    }

    /// Asks the public listener; `line` is a method and a path.
    pub(crate) async fn ask(&self, line: &str, headers: &[(&str, &str)], body: &str) -> Told {
        ask(&self.client, self.address, line, headers, body).await
    }

    /// Posts bytes in an encoding to the public listener.
    pub(crate) async fn post_bytes(&self, path: &str, encoding: &str, body: Vec<u8>) -> Told {
        let request = self.client.post(format!("http://{}{path}", self.address));
        let request = request
            .header("content-type", "application/json")
            .header("content-encoding", encoding);
        let sent = request.body(body).timeout(WAIT_AT_MOST).send().await;
        told(sent.expect("an answer")).await
    }

    pub(crate) async fn ask_admin(&self, line: &str) -> Told {
        ask(&self.client, self.admin, line, &[], "").await
    }

    /// Asks for something below the network.
    pub(crate) async fn get(&self, path: &str) -> Told {
        self.ask(&format!("GET /v1/networks/{NETWORK}{path}"), &[], "")
            .await
    }

    /// Asks for something below the network without waiting for the answer.
    pub(crate) fn get_later(&self, path: &str) -> JoinHandle<Told> {
        let (client, address) = (self.client.clone(), self.address);
        let line = format!("GET /v1/networks/{NETWORK}{path}");
        tokio::spawn(async move { ask(&client, address, &line, &[], "").await })
    }

    /// Writes something below the network; `line` is a method and what follows the network's path.
    pub(crate) async fn write(&self, line: &str, headers: &[(&str, &str)], body: &Value) -> Told {
        let (method, path) = line.split_once(' ').expect("a method and a path");
        let line = format!("{method} /v1/networks/{NETWORK}{path}");
        let body = match body.is_null() {
            true => String::new(),
            false => body.to_string(),
        };
        self.ask(&line, headers, &body).await
    }

    pub(crate) async fn post_zone(&self, id: &str) -> Told {
        self.write("POST /zones", &[], &circle(id, 10.0))
            .await
            .is(201)
    }
}

fn caller_of(token: &str) -> Option<Caller> {
    let (token, network) = match token.split_once('@') {
        Some((token, network)) => (token, Some(Arc::from(network))),
        None => (token, None),
    };
    let (role, tenant) = token.split_once('/')?;
    let role = Role::OF_TOKENS.into_iter().find(|is| is.name() == role)?;
    Some(Caller {
        role,
        subject: Arc::from(format!("{tenant}/desk")),
        tenant: Arc::from(tenant),
        network,
    })
}

async fn ask(
    client: &reqwest::Client,
    address: SocketAddr,
    line: &str,
    headers: &[(&str, &str)],
    body: &str,
) -> Told {
    let (method, path) = line.split_once(' ').expect("a method and a path");
    let method: Method = method.parse().expect("a method");
    let mut request = client.request(method, format!("http://{address}{path}"));
    if !body.is_empty() {
        request = request.header("content-type", "application/json");
    }
    for (name, value) in headers {
        request = request.header(*name, *value);
    }
    let sent = request
        .body(body.to_owned())
        .timeout(WAIT_AT_MOST)
        .send()
        .await;
    told(sent.unwrap_or_else(|error| panic!("{line}: {error}"))).await
}

async fn told(response: reqwest::Response) -> Told {
    let (status, headers) = (response.status().as_u16(), response.headers().clone());
    let bytes = response.bytes().await.expect("a body");
    Told {
        status,
        headers,
        body: String::from_utf8_lossy(&bytes).into_owned(),
        bytes,
    }
}

/// A circle around the middle of the square.
pub(crate) fn circle(id: &str, radius_m: f64) -> Value {
    json!({
        "type": "Feature",
        "id": id,
        "geometry": {"type": "Point", "coordinates": [50.0, 50.0]},
        "properties": {"radius_m": radius_m},
    })
}
