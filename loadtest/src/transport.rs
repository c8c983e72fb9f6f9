//! Requests on their way and back: kept connections of HTTP/1.1, or a few of HTTP/2 with many streams.
//!
//! A request that finds no connection idle waits for one; its time counts from when it was meant to be sent.

use bytes::Bytes;
use http::{HeaderValue, Method, Request, Response, header};
use http_body_util::{BodyExt, Full};
use hyper::body::Incoming;
use hyper::client::conn::{http1, http2};
use hyper_util::rt::{TokioExecutor, TokioIo};
use std::cell::{Cell, RefCell};
use std::collections::VecDeque;
use std::fmt;
use std::net::SocketAddr;
use std::rc::Rc;
use std::time::Instant;
use thiserror::Error;
use tokio::net::TcpStream;
use tokio::sync::oneshot;

/// The windows of HTTP/2 (RFC 9113, 6.9) that answers fit into, so that none waits to be let through.
const STREAM_WINDOW_BYTES: u32 = 8 << 20;
const CONNECTION_WINDOW_BYTES: u32 = 1 << 30;
/// One byte of flags and four of length stand before a message of gRPC.
const MESSAGE_PREFIX_BYTES: usize = 5;
const GRPC_STATUS: &str = "grpc-status";
const LAST_EVENT_ID: &str = "last-event-id";

/// A connection could not be made, or broke.
#[derive(Debug, Error)]
pub(crate) enum Broken {
    #[error("{0}")]
    Socket(#[from] std::io::Error),
    #[error("{0}")]
    Http(#[from] hyper::Error),
    #[error("{0}")]
    Request(#[from] http::Error),
    #[error("the answer has no status of gRPC")]
    NoStatus,
}

/// A request as it goes over the wire.
#[derive(Clone, Debug)]
pub(crate) enum Wanted {
    Rest {
        method: Method,
        path: String,
        body: Bytes,
        if_match: Option<String>,
    },
    Grpc {
        path: &'static str,
        /// A message with its prefix.
        message: Bytes,
    },
}

/// What is asked for, without what is sent with it.
impl fmt::Display for Wanted {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Rest { method, path, .. } => write!(formatter, "{method} {path}"),
            Self::Grpc { path, .. } => formatter.write_str(path),
        }
    }
}

/// An answer as it came.
#[derive(Clone, Debug)]
pub(crate) struct Told {
    pub(crate) status: Status,
    /// The body of REST, the message of gRPC without its prefix.
    pub(crate) body: Bytes,
    pub(crate) etag: Option<String>,
}

/// The status of either dialect.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Status {
    Rest(u16),
    Grpc(u32),
}

impl Status {
    pub(crate) fn is_success(self) -> bool {
        match self {
            Self::Rest(status) => (200..300).contains(&status),
            Self::Grpc(code) => code == 0,
        }
    }

    /// Too many requests, and overloaded; in gRPC `RESOURCE_EXHAUSTED` and `UNAVAILABLE`.
    pub(crate) fn is_shed(self) -> bool {
        match self {
            Self::Rest(status) => matches!(status, 429 | 503),
            Self::Grpc(code) => matches!(code, 8 | 14),
        }
    }

    pub(crate) fn text(self) -> String {
        match self {
            Self::Rest(status) => status.to_string(),
            Self::Grpc(code) => format!("grpc {code}"),
        }
    }
}

/// A message of gRPC with its prefix.
pub(crate) fn framed(message: &impl prost::Message) -> Bytes {
    let mut bytes = vec![0];
    bytes.extend((message.encoded_len() as u32).to_be_bytes());
    bytes.extend(message.encode_to_vec());
    bytes.into()
}

type Sender1 = http1::SendRequest<Full<Bytes>>;
type Sender2 = http2::SendRequest<Full<Bytes>>;

/// The connections to one server.
pub(crate) struct Connections {
    address: SocketAddr,
    host: HeaderValue,
    rest: Rc<RestConnections>,
    grpc: RefCell<Vec<Sender2>>,
    grpc_most: usize,
    turn: Cell<usize>,
}

/// Those of HTTP/1.1.
struct RestConnections {
    idle: RefCell<Vec<Open>>,
    /// Requests that wait to be given a connection, or to be told to open one.
    waiting: RefCell<VecDeque<oneshot::Sender<Option<Open>>>>,
    open: Cell<usize>,
    most: usize,
}

impl Connections {
    pub(crate) fn new(address: SocketAddr, rest_most: usize, grpc_most: usize) -> Self {
        let host = HeaderValue::try_from(address.to_string());
        Self {
            address,
            host: host.expect("an address is a header's value"),
            rest: Rc::new(RestConnections {
                idle: RefCell::default(),
                waiting: RefCell::default(),
                open: Cell::new(0),
                most: rest_most,
            }),
            grpc: RefCell::default(),
            grpc_most,
            turn: Cell::new(0),
        }
    }

    /// Sends a request and waits for its whole answer.
    pub(crate) async fn ask(&self, wanted: &Wanted) -> Result<Told, Broken> {
        self.ask_telling(wanted, &Cell::new(Instant::now())).await
    }

    /// The same; also tells when it was sent, once it was.
    pub(crate) async fn ask_telling(
        &self,
        wanted: &Wanted,
        sent: &Cell<Instant>,
    ) -> Result<Told, Broken> {
        match wanted {
            Wanted::Rest {
                method,
                path,
                body,
                if_match,
            } => {
                let mut request = Request::builder()
                    .method(method.clone())
                    .uri(path.as_str())
                    .header(header::HOST, self.host.clone());
                if !body.is_empty() {
                    request = request.header(header::CONTENT_TYPE, "application/json");
                }
                if let Some(etag) = if_match {
                    request = request.header(header::IF_MATCH, etag);
                }
                let request = request.body(Full::new(body.clone()))?;
                self.ask_rest(request, sent).await
            }
            Wanted::Grpc { path, message } => {
                let request = Request::post(format!("http://{}{path}", self.address))
                    .header(header::CONTENT_TYPE, "application/grpc")
                    .header(header::TE, "trailers")
                    .body(Full::new(message.clone()))?;
                self.ask_grpc(request, sent).await
            }
        }
    }

    async fn ask_rest(
        &self,
        request: Request<Full<Bytes>>,
        sent: &Cell<Instant>,
    ) -> Result<Told, Broken> {
        let mut open = RestConnections::take(&self.rest, self.address).await?;
        sent.set(Instant::now());
        let response = open.sender.send_request(request).await?;
        let status = Status::Rest(response.status().as_u16());
        let etag = response.headers().get(header::ETAG);
        let etag = etag.and_then(|etag| etag.to_str().ok()).map(str::to_owned);
        let body = response.into_body().collect().await?.to_bytes();
        // The answer is whole, so the connection can be used again.
        if open.sender.ready().await.is_ok() {
            self.rest.give(open);
        }
        Ok(Told { status, body, etag })
    }

    async fn ask_grpc(
        &self,
        request: Request<Full<Bytes>>,
        sent: &Cell<Instant>,
    ) -> Result<Told, Broken> {
        let mut sender = self.stream().await?;
        sent.set(Instant::now());
        let response = sender.send_request(request).await?;
        let early = grpc_status(response.headers());
        let collected = response.into_body().collect().await?;
        let late = collected.trailers().and_then(grpc_status);
        let code = early.or(late).ok_or(Broken::NoStatus)?;
        let body = collected.to_bytes();
        Ok(Told {
            status: Status::Grpc(code),
            body: body.slice(MESSAGE_PREFIX_BYTES.min(body.len())..),
            etag: None,
        })
    }

    /// A connection for one more stream: all of them in turn.
    async fn stream(&self) -> Result<Sender2, Broken> {
        self.grpc.borrow_mut().retain(|sender| !sender.is_closed());
        if self.grpc.borrow().len() < self.grpc_most {
            let stream = connected(self.address).await?;
            let (sender, connection) = http2::Builder::new(TokioExecutor::new())
                .initial_stream_window_size(STREAM_WINDOW_BYTES)
                .initial_connection_window_size(CONNECTION_WINDOW_BYTES)
                .handshake(TokioIo::new(stream))
                .await?;
            // How it ended is told to those who ask over it.
            tokio::spawn(connection);
            self.grpc.borrow_mut().push(sender);
        }
        let senders = self.grpc.borrow();
        let turn = self.turn.get().wrapping_add(1);
        self.turn.set(turn);
        Ok(senders[turn % senders.len()].clone())
    }
}

impl Drop for Connections {
    fn drop(&mut self) {
        // Each knows the list that it is in, so that neither would go by itself.
        drop(self.rest.idle.take());
    }
}

/// What a path tells for as long as the server has something to tell, over a connection of its own: from after an event,
/// or from now on.
pub(crate) async fn stream(
    address: SocketAddr,
    path: &str,
    after: Option<&str>,
) -> Result<Response<Incoming>, Broken> {
    let stream = connected(address).await?;
    let (mut sender, connection) = http1::handshake(TokioIo::new(stream)).await?;
    tokio::spawn(connection);
    let mut request = Request::get(path).header(header::HOST, address.to_string());
    if let Some(after) = after {
        request = request.header(LAST_EVENT_ID, after);
    }
    let request = request.body(Full::<Bytes>::default())?;
    Ok(sender.send_request(request).await?)
}

pub(crate) async fn connected(address: SocketAddr) -> Result<TcpStream, Broken> {
    let stream = TcpStream::connect(address).await?;
    stream.set_nodelay(true)?;
    Ok(stream)
}

fn grpc_status(headers: &http::HeaderMap) -> Option<u32> {
    headers.get(GRPC_STATUS)?.to_str().ok()?.parse().ok()
}

/// A connection in use; dropped it is closed, and another one may be opened.
struct Open {
    sender: Sender1,
    _counted: Counted,
}

/// One of the connections that may be open.
struct Counted(Rc<RestConnections>);

impl Drop for Counted {
    fn drop(&mut self) {
        self.0.open.set(self.0.open.get() - 1);
        // The caller that has waited longest may open another; one that gave up waiting is passed over.
        while let Some(waiting) = self.0.next_waiting() {
            if waiting.send(None).is_ok() {
                return;
            }
        }
    }
}

impl RestConnections {
    async fn take(rest: &Rc<Self>, address: SocketAddr) -> Result<Open, Broken> {
        loop {
            let idle = rest.idle.borrow_mut().pop();
            match idle {
                Some(open) if !open.sender.is_closed() => return Ok(open),
                Some(closed) => drop(closed),
                None => break,
            }
        }
        if rest.open.get() >= rest.most {
            let (sender, receiver) = oneshot::channel();
            rest.waiting.borrow_mut().push_back(sender);
            if let Ok(Some(open)) = receiver.await {
                return Ok(open);
            }
        }
        rest.open.set(rest.open.get() + 1);
        let counted = Counted(rest.clone());
        let stream = connected(address).await?;
        let (sender, connection) = http1::handshake(TokioIo::new(stream)).await?;
        // How it ended is told to those who ask over it.
        tokio::spawn(connection);
        Ok(Open {
            sender,
            _counted: counted,
        })
    }

    fn next_waiting(&self) -> Option<oneshot::Sender<Option<Open>>> {
        self.waiting.borrow_mut().pop_front()
    }

    /// A connection that is idle goes to the caller that has waited longest; one that gave up waiting is passed over.
    fn give(&self, open: Open) {
        let mut offered = Some(open);
        while let Some(waiting) = self.next_waiting() {
            match waiting.send(offered) {
                Ok(()) => return,
                Err(returned) => offered = returned,
            }
        }
        self.idle.borrow_mut().extend(offered);
    }
}
