//! An edge in this process, with a client, and a transcript of what they say to each other.

use bytes::Bytes;
use jiff::Timestamp;
use prometheus_client::registry::Registry;
use reqwest::{Method, Response};
use serde_json::Value;
use skyway::api::grpc;
use skyway::api::metrics::RequestMetrics;
use skyway::api::operations::{Daemon, Listener};
use skyway::api::rest;
use skyway::api::server::{
    Authentication, Drain, GateConfig, QueueWait, ServerConfig, Services, Slots, serve,
};
use skyway::clock::{Clock, ManualClock};
use skyway::edge::{Edge, Settings};
use skyway::formats::load_network;
use skyway::network::Topology;
use skyway::network::bundled::SYDNEY_CBD;
use std::fmt::Write;
use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Duration;
use tokio::net::TcpListener;

/// Longer than anything takes, so that a test that hangs fails.
pub(crate) const WAIT_AT_MOST: Duration = Duration::from_secs(60);

/// Headers that a transcript shows.
const SHOWN: [&str; 10] = [
    "content-type",
    "location",
    "etag",
    "allow",
    "retry-after",
    "server-timing",
    "skyway-revision",
    "skyway-freshness",
    "skyway-clock",
    "www-authenticate",
];

/// The listeners of an edge, and a client.
pub(crate) struct Api {
    pub(crate) edge: Arc<Edge>,
    pub(crate) drain: Drain,
    address: SocketAddr,
    admin: SocketAddr,
    client: reqwest::Client,
}

/// What was answered.
pub(crate) struct Told {
    pub(crate) status: u16,
    pub(crate) headers: Vec<(String, String)>,
    pub(crate) body: String,
}

impl Told {
    pub(crate) fn header(&self, name: &str) -> Option<&str> {
        let found = self.headers.iter().find(|(known, _)| known == name);
        found.map(|(_, value)| value.as_str())
    }

    #[track_caller]
    pub(crate) fn json(&self) -> Value {
        serde_json::from_str(&self.body).unwrap_or_else(|error| panic!("{error}: {}", self.body))
    }

    /// The code of the problem.
    #[track_caller]
    pub(crate) fn code(&self) -> String {
        let code = self.json()["code"].as_str().map(str::to_owned);
        code.unwrap_or_else(|| panic!("no problem: {} {}", self.status, self.body))
    }

    /// The same answer, which has to have this status.
    #[track_caller]
    pub(crate) fn is(self, status: u16) -> Self {
        assert_eq!(self.status, status, "{}", self.body);
        self
    }
}

impl Api {
    pub(crate) async fn start() -> Self {
        Self::with(Settings::default()).await
    }

    pub(crate) async fn with(settings: Settings) -> Self {
        let loaded = load_network(SYDNEY_CBD).expect("a network");
        Self::on(Arc::new(loaded.topology), SYDNEY_CBD, settings).await
    }

    /// Over a network of one's own, or none.
    pub(crate) async fn on(
        topology: Arc<Topology>,
        text: &'static str,
        settings: Settings,
    ) -> Self {
        let start: Timestamp = "2026-11-27T18:00:00Z".parse().expect("an instant");
        // A clock whose hand is gone stands still.
        Self::at(topology, text.into(), settings, start).await.0
    }

    /// The same at a time, with the hand that moves it.
    pub(crate) async fn at(
        topology: Arc<Topology>,
        text: Bytes,
        settings: Settings,
        start: Timestamp,
    ) -> (Self, ManualClock) {
        let (clock, hand) = Clock::by_hand(start);
        (Self::by(clock, topology, text, settings).await, hand)
    }

    /// The same by a clock of one's own.
    pub(crate) async fn by(
        clock: Clock,
        topology: Arc<Topology>,
        text: Bytes,
        settings: Settings,
    ) -> Self {
        let edge = Edge::start(topology, text, 7, settings, clock).expect("threads");
        let drain = Drain::new();
        let (router, _) = rest::router(edge.clone(), drain.clone());
        let health = grpc::Health::starting().await;
        let handlers = grpc::handlers(&edge, grpc::Limits::default(), &health);
        let services = Services::from(router).with_grpc(handlers.expect("descriptors"));
        let address = listen(Listener::Main, services, &drain).await;
        let registry = Arc::new(Registry::default());
        let admin = rest::admin_router(edge.clone(), registry, drain.clone());
        let admin = listen(Listener::Admin, admin, &drain).await;
        let client = reqwest::Client::builder().no_proxy().http1_only();
        let client = client.redirect(reqwest::redirect::Policy::none());
        Self {
            edge,
            drain,
            address,
            admin,
            client: client.build().expect("a client"),
        }
    }

    /// Where the public listener is.
    pub(crate) fn url(&self) -> String {
        format!("http://{}", self.address)
    }

    /// Another public listener of the same edge, with routes of one's own.
    pub(crate) async fn another(&self, router: impl Into<Services>) -> String {
        let address = listen(Listener::Main, router, &self.drain).await;
        format!("http://{address}")
    }

    /// Waits until the writer has done what it was told before: a report is answered without waiting for that.
    pub(crate) async fn settled(&self) {
        self.edge.tick().await.expect("the writer takes it");
    }

    /// Sends a request and leaves the body of the answer to be read.
    pub(crate) async fn open(&self, line: &str, headers: &[(&str, &str)], body: &str) -> Response {
        self.send(self.address, line, headers, body).await
    }

    async fn send(
        &self,
        address: SocketAddr,
        line: &str,
        headers: &[(&str, &str)],
        body: &str,
    ) -> Response {
        let (method, path) = line.split_once(' ').expect("a method and a path");
        let method: Method = method.parse().expect("a method");
        let mut request = self
            .client
            .request(method, format!("http://{address}{path}"));
        request = request.header("x-request-id", "test");
        let states_type = headers.iter().any(|(name, _)| *name == "content-type");
        if !body.is_empty() && !states_type {
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
        sent.unwrap_or_else(|error| panic!("{line}: {error}"))
    }

    /// Asks the public listener; `line` is a method and a path.
    pub(crate) async fn ask(&self, line: &str, headers: &[(&str, &str)], body: &str) -> Told {
        told(self.send(self.address, line, headers, body).await).await
    }

    /// Asks the admin listener.
    pub(crate) async fn ask_admin(&self, line: &str) -> Told {
        told(self.send(self.admin, line, &[], "").await).await
    }

    pub(crate) async fn get(&self, path: &str) -> Told {
        self.ask(&format!("GET {path}"), &[], "").await
    }

    pub(crate) async fn post(&self, path: &str, body: &Value) -> Told {
        self.ask(&format!("POST {path}"), &[], &body.to_string())
            .await
    }
}

impl Drop for Api {
    /// No test of the interface makes the engine wrong: every answer has passed the checker.
    fn drop(&mut self) {
        if !std::thread::panicking() {
            assert_eq!(self.edge.status().checker_cases, 0);
        }
    }
}

async fn listen(listener: Listener, services: impl Into<Services>, drain: &Drain) -> SocketAddr {
    let socket = TcpListener::bind("127.0.0.1:0").await.expect("a free port");
    let address = socket.local_addr().expect("an address");
    let metrics = Arc::new(RequestMetrics::new(&mut Registry::default()));
    let gate = GateConfig {
        daemon: Daemon::Edge,
        listener,
        authentication: Authentication::Loopback,
        slots: Slots::default(),
        queue_wait: Arc::new(QueueWait::unbounded()),
        body_bytes_max: 1024 * 1024,
        file_bytes_max: 1024 * 1024,
        deadline: WAIT_AT_MOST,
        follow_wait: Duration::ZERO,
    };
    let serving = serve(
        socket,
        services.into(),
        gate,
        ServerConfig::default(),
        metrics,
        drain.clone(),
    );
    tokio::spawn(serving);
    address
}

async fn told(response: Response) -> Told {
    let status = response.status().as_u16();
    let text = |value: &reqwest::header::HeaderValue| value.to_str().expect("text").to_owned();
    let headers = response.headers().iter();
    let headers = headers
        .map(|(name, value)| (name.to_string(), text(value)))
        .collect();
    let body = response.text().await.expect("a body");
    // The sum of nothing, as the standard library has it.
    let is_minus_nothing = |end: &str| body.contains(&format!(":-0.0{end}"));
    assert!(![",", "}", "]"].into_iter().any(is_minus_nothing), "{body}");
    if let Ok(json) = serde_json::from_str(&body) {
        let numbers = crate::ids::numbers_for_ids(&json);
        assert!(numbers.is_empty(), "numbers as ids: {numbers:?}");
    }
    Told {
        status,
        headers,
        body,
    }
}

/// Asks, and writes down what is said.
pub(crate) struct Story<'a> {
    api: &'a Api,
    pub(crate) text: String,
}

impl<'a> Story<'a> {
    pub(crate) fn of(api: &'a Api) -> Self {
        Self {
            api,
            text: String::new(),
        }
    }

    pub(crate) async fn ask(&mut self, line: &str, headers: &[(&str, &str)], body: &Value) -> Told {
        let sent = if body.is_null() {
            String::new()
        } else {
            body.to_string()
        };
        let told = self.api.ask(line, headers, &sent).await;
        let text = &mut self.text;
        // Writing to text cannot fail.
        let _ = writeln!(text, "{line}");
        for (name, value) in headers {
            let _ = writeln!(text, "{name}: {value}");
        }
        if !body.is_null() {
            let _ = writeln!(text, "{sent}");
        }
        let _ = writeln!(text, "-> {}", told.status);
        for name in SHOWN {
            if let Some(value) = told.header(name) {
                let _ = writeln!(text, "{name}: {value}");
            }
        }
        let _ = writeln!(text, "{}\n", shown(&told.body));
        told
    }

    pub(crate) async fn get(&mut self, path: &str) -> Told {
        self.ask(&format!("GET {path}"), &[], &Value::Null).await
    }

    pub(crate) async fn post(&mut self, path: &str, body: &Value) -> Told {
        self.ask(&format!("POST {path}"), &[], body).await
    }
}

/// A body on many lines, without what depends on which tables are there by now.
fn shown(body: &str) -> String {
    let Ok(mut json) = serde_json::from_str::<Value>(body) else {
        return body.to_owned();
    };
    without_efforts(&mut json);
    serde_json::to_string_pretty(&json).expect("JSON")
}

fn without_efforts(json: &mut Value) {
    match json {
        Value::Object(members) => {
            for (name, value) in members {
                if name == "settled_nodes" && value.is_number() {
                    *value = Value::from("any");
                }
                without_efforts(value);
            }
        }
        Value::Array(values) => values.iter_mut().for_each(without_efforts),
        _ => {}
    }
}

/// A circle around Customs House.
pub(crate) fn circle(radius_m: f64) -> Value {
    serde_json::json!({
        "type": "Feature",
        "geometry": {"type": "Point", "coordinates": [151.2108551, -33.862204]},
        "properties": {"name": "Concert", "radius_m": radius_m},
    })
}
