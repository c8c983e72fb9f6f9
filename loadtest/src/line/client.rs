//! A client of sessions: connections of HTTP/2 with as many of them as wanted, and a token.

use crate::Result;
use crate::transport::{connected, framed};
use bytes::{Buf, Bytes, BytesMut};
use http::{Method, Request, StatusCode, header};
use http_body_util::combinators::BoxBody;
use http_body_util::{BodyExt, Full};
use hyper::body::{Body, Frame, Incoming};
use hyper::client::conn::http2;
use hyper_util::rt::{TokioExecutor, TokioIo};
use prost::Message;
use skyway::api::grpc::proto::session_request::Body as Said;
use skyway::api::grpc::proto::session_response::Body as Told;
use skyway::api::grpc::proto::{self, SessionRequest, SessionResponse};
use std::convert::Infallible;
use std::net::SocketAddr;
use std::pin::Pin;
use std::task::{Context, Poll};
use tokio::sync::mpsc::{UnboundedReceiver, UnboundedSender, unbounded_channel};

const SESSION: &str = "/skyway.v1.Drones/Session";
const TELEMETRY: &str = "/skyway.v1.Drones/ReportTelemetry";
/// One byte of flags and four of length stand before a message of gRPC.
const PREFIX_BYTES: usize = 5;

type Sender = http2::SendRequest<BoxBody<Bytes, Infallible>>;

/// A connection.
#[derive(Clone)]
pub(crate) struct Connection {
    address: SocketAddr,
    token: String,
    sender: Sender,
}

impl Connection {
    pub(crate) async fn open(address: SocketAddr, token: &str) -> Result<Self> {
        let stream = connected(address).await?;
        let handshake = http2::Builder::new(TokioExecutor::new()).handshake(TokioIo::new(stream));
        let (sender, connection) = handshake.await?;
        // How it ended is told to those who ask over it.
        tokio::spawn(connection);
        Ok(Self {
            address,
            token: token.to_owned(),
            sender,
        })
    }

    /// The beginning of a request: its headers are added to.
    pub(crate) fn request(
        &self,
        method: Method,
        path: &str,
        media: &str,
    ) -> http::request::Builder {
        let builder = Request::builder()
            .method(method)
            .uri(format!("http://{}{path}", self.address))
            .header(header::CONTENT_TYPE, media)
            .header(header::TE, "trailers");
        match self.token.is_empty() {
            true => builder,
            false => builder.header(header::AUTHORIZATION, format!("Bearer {}", self.token)),
        }
    }

    /// Asks over REST; gives the body of the answer.
    pub(crate) async fn ask(&self, method: Method, path: &str, body: Vec<u8>) -> Result<Bytes> {
        let request = self.request(method, path, "application/json");
        let (status, body) = self.send(request, body).await?;
        match status {
            StatusCode::OK | StatusCode::CREATED => Ok(body),
            _ => Err(format!("{path}: {status}: {}", String::from_utf8_lossy(&body)).into()),
        }
    }

    /// Sends a request; gives the status and the body of its answer, whatever it is.
    pub(crate) async fn send(
        &self,
        request: http::request::Builder,
        body: Vec<u8>,
    ) -> Result<(StatusCode, Bytes)> {
        let request = request.body(Full::from(body).boxed())?;
        let answer = self.sender.clone().send_request(request).await?;
        let status = answer.status();
        Ok((status, answer.into_body().collect().await?.to_bytes()))
    }

    /// Sends positions in a request of their own.
    pub(crate) async fn telemetry(&self, message: &proto::ReportTelemetryRequest) -> Result<()> {
        let request = self.request(Method::POST, TELEMETRY, "application/grpc");
        let request = request.body(Full::from(framed(message)).boxed())?;
        let answer = self.sender.clone().send_request(request).await?;
        let collected = answer.into_body().collect().await?;
        match collected.to_bytes().len() > PREFIX_BYTES {
            true => Ok(()),
            false => Err("telemetry was not answered".into()),
        }
    }

    /// Begins a session with drones that had none, and waits until they are welcome.
    pub(crate) async fn session(&self, drones: Vec<String>) -> Result<Session> {
        let drones = drones.into_iter().map(|drone_id| proto::HelloDrone {
            drone_id,
            ..proto::HelloDrone::default()
        });
        self.session_of(drones.collect()).await
    }

    /// Begins a session with drones, and waits until they are welcome.
    pub(crate) async fn session_of(&self, drones: Vec<proto::HelloDrone>) -> Result<Session> {
        let (said, requests) = unbounded_channel();
        let request = self.request(Method::POST, SESSION, "application/grpc");
        let request = request.body(Requests(requests).boxed())?;
        let expected = drones.len();
        let mut session = Session {
            id: String::new(),
            said,
            told: None,
            read: BytesMut::new(),
            _connection: self.clone(),
        };
        session.say(None, Said::Hello(proto::Hello { drones }));
        session.told = Some(self.sender.clone().send_request(request).await?.into_body());
        match session.next().await? {
            Told::Welcome(welcome) if welcome.drones.len() == expected => {
                session.id = welcome.session_id;
                Ok(session)
            }
            other => Err(format!("no welcome: {other:?}").into()),
        }
    }
}

/// A session.
pub(crate) struct Session {
    /// Named by a drone that comes back on another connection.
    pub(crate) id: String,
    said: UnboundedSender<Bytes>,
    told: Option<Incoming>,
    read: BytesMut,
    /// It lasts as long as somebody may ask over it.
    _connection: Connection,
}

impl Session {
    pub(crate) fn say(&self, request_id: Option<u64>, body: Said) {
        let body = Some(body);
        // A session that is gone says so where it is listened to.
        let _ = self.said.send(framed(&SessionRequest { request_id, body }));
    }

    /// What is told next.
    pub(crate) async fn next(&mut self) -> Result<Told> {
        Ok(self.next_answer().await?.1)
    }

    /// What is told next, and the request that it answers.
    pub(crate) async fn next_answer(&mut self) -> Result<(Option<u64>, Told)> {
        loop {
            if let Some(told) = self.whole()? {
                let body = told.body.ok_or("nothing was told")?;
                return Ok((told.request_id, body));
            }
            let told = self.told.as_mut().ok_or("the session has not begun")?;
            let Some(frame) = told.frame().await else {
                return Err("the session has ended".into());
            };
            if let Ok(data) = frame?.into_data() {
                self.read.extend_from_slice(&data);
            }
        }
    }

    /// The next message, once all of it is there.
    fn whole(&mut self) -> Result<Option<SessionResponse>> {
        let Some(prefix) = self.read.first_chunk::<PREFIX_BYTES>() else {
            return Ok(None);
        };
        let length = u32::from_be_bytes([prefix[1], prefix[2], prefix[3], prefix[4]]) as usize;
        if self.read.len() < PREFIX_BYTES + length {
            return Ok(None);
        }
        self.read.advance(PREFIX_BYTES);
        let message = self.read.split_to(length);
        Ok(Some(SessionResponse::decode(message)?))
    }
}

/// What a session says, as it is said.
struct Requests(UnboundedReceiver<Bytes>);

impl Body for Requests {
    type Data = Bytes;
    type Error = Infallible;

    fn poll_frame(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
    ) -> Poll<Option<std::result::Result<Frame<Bytes>, Infallible>>> {
        let next = self.0.poll_recv(context);
        next.map(|said| said.map(|bytes| Ok(Frame::data(bytes))))
    }
}
