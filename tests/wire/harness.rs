//! A server in this process, whose handlers do what a header of the request says.

use axum::Router;
use axum::body::{Body, to_bytes};
use axum::response::Response;
use http::Request;
use prometheus_client::registry::Registry;
use skyway::access::{Caller, Role};
use skyway::api::metrics::RequestMetrics;
use skyway::api::operations::{Daemon, Listener};
use skyway::api::server::{
    Authentication, Drain, Drained, GateConfig, KnownTokens, QueueWait, RequestContext,
    ServerConfig, Slots, serve,
};
use std::net::SocketAddr;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;
use tokio::net::TcpListener;
use tokio::sync::{Semaphore, watch};
use tokio::task::JoinHandle;
use tokio_util::task::AbortOnDropHandle;

/// Longer than anything takes, so that a test that hangs fails.
pub(crate) const WAIT_AT_MOST: Duration = Duration::from_secs(60);

/// How long a handler takes that computes.
pub(crate) const COMPUTES: Duration = Duration::from_millis(5);

/// The header that tells the handler what to do.
const BEHAVIOUR: &str = "x-behave";

/// What a test sees of its handlers.
pub(crate) struct Handlers {
    /// One permit for each handler that has been entered.
    pub(crate) entered: Semaphore,
    /// One permit for each waiting handler that may go on.
    pub(crate) released: Semaphore,
    /// How many waiting handlers were dropped before they answered.
    pub(crate) dropped: AtomicUsize,
}

pub(crate) struct Server {
    pub(crate) address: SocketAddr,
    pub(crate) handlers: Arc<Handlers>,
    pub(crate) drain: Drain,
    registry: Registry,
    serving: JoinHandle<std::io::Result<Drained>>,
    _probing: AbortOnDropHandle<()>,
}

/// What a test may choose.
#[derive(Clone)]
pub(crate) struct Options {
    pub(crate) daemon: Daemon,
    pub(crate) server: ServerConfig,
    pub(crate) slots: Slots,
    /// How long requests may wait for a worker where that stands; zero for as long as they do.
    pub(crate) queue_wait: Duration,
    pub(crate) authentication: Authentication,
    pub(crate) listener: Listener,
    pub(crate) body_bytes_max: usize,
    pub(crate) file_bytes_max: usize,
    pub(crate) deadline: Duration,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            daemon: Daemon::Edge,
            server: ServerConfig::default(),
            slots: Slots::default(),
            queue_wait: Duration::ZERO,
            authentication: Authentication::Loopback,
            listener: Listener::Main,
            body_bytes_max: 1024 * 1024,
            file_bytes_max: 1024 * 1024,
            deadline: WAIT_AT_MOST,
        }
    }
}

impl Options {
    pub(crate) fn of(server: ServerConfig) -> Self {
        Self {
            server,
            ..Self::default()
        }
    }

    /// Every role has its name as its token.
    pub(crate) fn with_tokens() -> Self {
        let tokens = KnownTokens {
            find: Arc::new(role_of),
            changed: watch::channel(0).1,
        };
        Self::with(tokens)
    }

    pub(crate) fn with(tokens: KnownTokens) -> Self {
        Self {
            authentication: Authentication::Tokens(tokens),
            ..Self::default()
        }
    }

    pub(crate) async fn start(self) -> Server {
        let listener = TcpListener::bind("127.0.0.1:0").await.expect("a free port");
        let address = listener.local_addr().expect("an address");
        let handlers = Arc::new(Handlers {
            entered: Semaphore::new(0),
            released: Semaphore::new(0),
            dropped: AtomicUsize::new(0),
        });
        let mut registry = Registry::default();
        let metrics = Arc::new(RequestMetrics::new(&mut registry));
        let drain = Drain::new();
        let queue_wait = Arc::new(QueueWait::new(self.queue_wait));
        let probed = Arc::clone(&queue_wait);
        let probing = AbortOnDropHandle::new(tokio::spawn(async move {
            probed.probe().await.expect("a socket");
        }));
        let gate = GateConfig {
            daemon: self.daemon,
            listener: self.listener,
            authentication: self.authentication,
            slots: self.slots,
            queue_wait,
            body_bytes_max: self.body_bytes_max,
            file_bytes_max: self.file_bytes_max,
            deadline: self.deadline,
            follow_wait: Duration::ZERO,
        };
        let shared = Arc::clone(&handlers);
        let router = Router::new().fallback(move |request| behave(Arc::clone(&shared), request));
        let serving = tokio::spawn(serve(
            listener,
            router,
            gate,
            self.server,
            metrics,
            drain.clone(),
        ));
        Server {
            address,
            handlers,
            drain,
            registry,
            serving,
            _probing: probing,
        }
    }
}

impl Server {
    pub(crate) fn url(&self, path: &str) -> String {
        format!("http://{}{path}", self.address)
    }

    /// Waits until a number of handlers has been entered since the last time.
    pub(crate) async fn entered(&self, count: u32) {
        let entered = tokio::time::timeout(WAIT_AT_MOST, self.handlers.entered.acquire_many(count));
        entered
            .await
            .expect("handlers are entered")
            .expect("open")
            .forget();
    }

    pub(crate) fn release(&self, count: usize) {
        self.handlers.released.add_permits(count);
    }

    /// The value of a metric, by its name and labels as Prometheus writes them.
    pub(crate) fn metric(&self, name: &str) -> Option<f64> {
        let mut text = String::new();
        prometheus_client::encoding::text::encode(&mut text, &self.registry).expect("encodes");
        let line = text
            .lines()
            .find_map(|line| line.strip_prefix(name)?.strip_prefix(' '));
        line.map(|value| value.parse().expect("a number"))
    }

    /// Drains to the end.
    pub(crate) async fn stopped(self) -> Drained {
        self.drain.begin();
        self.ended().await
    }

    /// Waits for the end of a drain that has begun.
    pub(crate) async fn ended(self) -> Drained {
        let ended = tokio::time::timeout(WAIT_AT_MOST, self.serving).await;
        ended
            .expect("the drain ends")
            .expect("no panic")
            .expect("no error")
    }
}

/// The caller whose role is its token.
pub(crate) fn role_of(token: &str) -> Option<Caller> {
    let role = Role::OF_TOKENS
        .into_iter()
        .find(|role| role.name() == token)?;
    Some(Caller::local(role, "*"))
}

/// Counts a handler that is dropped before it is done.
struct Bell {
    handlers: Arc<Handlers>,
    done: bool,
}

impl Drop for Bell {
    fn drop(&mut self) {
        if !self.done {
            self.handlers.dropped.fetch_add(1, Ordering::SeqCst);
        }
    }
}

#[expect(
    clippy::disallowed_methods,
    reason = "a handler that computes keeps its worker"
)]
async fn behave(handlers: Arc<Handlers>, request: Request<Body>) -> Response {
    let behaviour = request.headers().get(BEHAVIOUR).cloned();
    let behaviour = behaviour
        .as_ref()
        .map_or("", |text| text.to_str().expect("text"));
    handlers.entered.add_permits(1);
    match behaviour {
        "" => {
            let context = request
                .extensions()
                .get::<RequestContext>()
                .expect("from the gate");
            let text = format!(
                "{} {}",
                context.operation.row().name,
                context.caller.role.name()
            );
            Response::new(Body::from(text))
        }
        "echo" => match to_bytes(request.into_body(), usize::MAX).await {
            Ok(bytes) => Response::new(Body::from(bytes)),
            Err(error) => {
                let mut response = Response::new(Body::from(error.to_string()));
                *response.status_mut() = http::StatusCode::BAD_REQUEST;
                response
            }
        },
        "wait" => {
            let mut bell = Bell {
                handlers: Arc::clone(&handlers),
                done: false,
            };
            handlers.released.acquire().await.expect("open").forget();
            bell.done = true;
            Response::new(Body::from("waited"))
        }
        // Keeps its worker, as a computation does.
        "compute" => {
            std::thread::sleep(COMPUTES);
            Response::new(Body::from("computed"))
        }
        "panic" => panic!("as the test asked"),
        "stream" => Response::new(Body::from_stream(tokio_stream::pending::<
            std::io::Result<Vec<u8>>,
        >())),
        other => panic!("no behaviour '{other}'"),
    }
}

/// A client of REST, HTTP/1.1.
pub(crate) fn rest() -> reqwest::Client {
    reqwest::Client::builder()
        .http1_only()
        .no_proxy()
        .build()
        .expect("a client")
}

/// A client of HTTP/2 without TLS, as gRPC has it.
pub(crate) fn h2() -> reqwest::Client {
    reqwest::Client::builder()
        .http2_prior_knowledge()
        .no_proxy()
        .build()
        .expect("a client")
}

/// A call over gRPC with an empty message.
pub(crate) fn call(
    client: &reqwest::Client,
    server: &Server,
    path: &str,
    behaviour: &str,
) -> reqwest::RequestBuilder {
    client
        .post(server.url(path))
        .header("content-type", "application/grpc")
        .header("te", "trailers")
        .header(BEHAVIOUR, behaviour)
        .timeout(WAIT_AT_MOST)
        .body(vec![0, 0, 0, 0, 0])
}

/// A REST request.
pub(crate) fn ask(
    client: &reqwest::Client,
    method: http::Method,
    url: String,
    behaviour: &str,
) -> reqwest::RequestBuilder {
    client
        .request(method, url)
        .header(BEHAVIOUR, behaviour)
        .timeout(WAIT_AT_MOST)
}

/// The stable code of a problem document.
pub(crate) async fn code(response: reqwest::Response) -> String {
    assert_eq!(
        response.headers()["content-type"],
        "application/problem+json"
    );
    let id = response.headers()["x-request-id"]
        .to_str()
        .expect("text")
        .to_owned();
    let bytes = response.bytes().await.expect("a body");
    let problem: skyway::wire::Problem = serde_json::from_slice(&bytes).expect("a problem");
    assert_eq!(problem.request_id, Some(id));
    problem.code
}

/// The number of gRPC's status, and the stable code in its details.
pub(crate) fn grpc_refusal(response: &reqwest::Response) -> (i32, String) {
    assert_eq!(response.status(), 200);
    let status =
        tonic::Status::from_header_map(response.headers()).expect("a status in the headers");
    let refusal = skyway::api::problem::of_grpc_status(&status).expect("details");
    let name = skyway::api::problem::row(refusal.code).name;
    (status.code() as i32, name.to_owned())
}
