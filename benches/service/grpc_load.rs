//! The load in gRPC: frames of HTTP/2 written by hand (RFC 9113), as a library would keep a core of its own busy.
//!
//! A connection keeps a fixed number of streams under way. Its first request puts its header fields into the
//! table of the connection and later ones name them by their place (RFC 7541), as clients do. Headers of answers
//! are not decoded: a call that failed has no message, and messages are read.

use crate::load::Tally;
use prost::Message;
use rustc_hash::FxHashMap;
use skyway::api::grpc::IntoProto;
use skyway::api::grpc::proto::{self, RecompositionAnswer};
use skyway::wire::{FailureReport, Outcome};
use std::convert::Infallible;
use std::io;
use std::net::SocketAddr;
use std::rc::Rc;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;

/// Connections at once.
pub(crate) const CONNECTIONS: usize = 4;
/// Requests under way on each.
pub(crate) const STREAMS: usize = 32;

const PREFACE: &[u8] = b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n";
const PATH: &str = "/skyway.v1.Recomposition/ReportFailure";
const HEAD_BYTES: usize = 9;
/// One byte of flags and four of length stand before a message.
const MESSAGE_PREFIX_BYTES: usize = 5;

const DATA: u8 = 0;
const HEADERS: u8 = 1;
const RST_STREAM: u8 = 3;
const SETTINGS: u8 = 4;
const PING: u8 = 6;
const GOAWAY: u8 = 7;
const WINDOW_UPDATE: u8 = 8;
const ACK: u8 = 1;
const END_STREAM: u8 = 1;
const END_HEADERS: u8 = 4;

/// The largest window there is (RFC 9113, 6.9.1).
const WINDOW_MAX: u32 = (1 << 31) - 1;
/// The window of a connection before anything is said.
const WINDOW_FIRST: u32 = 65_535;
/// So much is read before the server is told that there is room again.
const WINDOW_STEP: u32 = 1 << 29;

/// The reports as messages of gRPC.
pub(crate) fn requests(reports: &[FailureReport]) -> Vec<Vec<u8>> {
    let request = |report: &FailureReport| {
        let message: proto::FailureReport = report.clone().into_proto();
        let encoded = message.encode_to_vec();
        let mut bytes = vec![0];
        bytes.extend((encoded.len() as u32).to_be_bytes());
        bytes.extend(encoded);
        bytes
    };
    reports.iter().map(request).collect()
}

/// Keeps all streams of a connection busy.
pub(crate) async fn drive(
    address: SocketAddr,
    requests: Rc<Vec<Vec<u8>>>,
    first: usize,
    tally: Rc<Tally>,
) -> io::Result<Infallible> {
    let mut stream = TcpStream::connect(address).await?;
    stream.set_nodelay(true)?;
    let mut connection = Connection::new(address, requests, first, tally);
    connection.open();
    let mut received = Vec::with_capacity(256 * 1024);
    loop {
        stream.write_all(&connection.to_send).await?;
        connection.to_send.clear();
        if stream.read_buf(&mut received).await? == 0 {
            return Err(io::ErrorKind::UnexpectedEof.into());
        }
        let taken = connection.take(&received)?;
        received.drain(..taken);
    }
}

/// One connection, without its socket.
struct Connection {
    address: SocketAddr,
    requests: Rc<Vec<Vec<u8>>>,
    tally: Rc<Tally>,
    to_send: Vec<u8>,
    next_request: usize,
    next_stream: u32,
    /// How many bytes of messages the server still takes.
    send_window: i64,
    /// How many bytes came since the server was told that there is room.
    unreported: u32,
    /// Messages so far, by stream.
    messages: FxHashMap<u32, Vec<u8>>,
    /// Vectors of messages that are done, to be filled again.
    spare: Vec<Vec<u8>>,
}

impl Connection {
    fn new(
        address: SocketAddr,
        requests: Rc<Vec<Vec<u8>>>,
        first: usize,
        tally: Rc<Tally>,
    ) -> Self {
        Self {
            address,
            requests,
            tally,
            to_send: Vec::with_capacity(64 * 1024),
            next_request: first,
            next_stream: 1,
            send_window: i64::from(WINDOW_FIRST),
            unreported: 0,
            messages: FxHashMap::default(),
            spare: Vec::new(),
        }
    }

    /// Says how it is spoken here, and begins all streams.
    fn open(&mut self) {
        const ENABLE_PUSH: u16 = 2;
        const INITIAL_WINDOW_SIZE: u16 = 4;
        self.to_send.extend(PREFACE);
        let mut settings = Vec::new();
        for (name, value) in [(ENABLE_PUSH, 0), (INITIAL_WINDOW_SIZE, WINDOW_MAX)] {
            settings.extend(name.to_be_bytes());
            settings.extend(value.to_be_bytes());
        }
        self.frame(SETTINGS, 0, 0, &settings);
        self.frame(
            WINDOW_UPDATE,
            0,
            0,
            &(WINDOW_MAX - WINDOW_FIRST).to_be_bytes(),
        );
        for _ in 0..STREAMS {
            self.ask();
        }
    }

    /// The next request, on a stream of its own.
    fn ask(&mut self) {
        let stream = self.next_stream;
        self.next_stream += 2;
        let headers = match stream {
            1 => first_headers(self.address),
            _ => later_headers().to_vec(),
        };
        self.frame(HEADERS, END_HEADERS, stream, &headers);
        let requests = self.requests.clone();
        let message = &requests[self.next_request % requests.len()];
        self.next_request += 1;
        self.send_window -= message.len() as i64;
        self.frame(DATA, END_STREAM, stream, message);
        let message = self.spare.pop().unwrap_or_default();
        self.messages.insert(stream, message);
    }

    fn frame(&mut self, kind: u8, flags: u8, stream: u32, payload: &[u8]) {
        let length = (payload.len() as u32).to_be_bytes();
        self.to_send.extend(&length[1..]);
        self.to_send.extend([kind, flags]);
        self.to_send.extend(stream.to_be_bytes());
        self.to_send.extend(payload);
    }

    /// Takes all whole frames; answers how many bytes they are.
    fn take(&mut self, received: &[u8]) -> io::Result<usize> {
        let mut taken = 0;
        while let Some((head, rest)) = received[taken..].split_first_chunk::<HEAD_BYTES>() {
            let length = u32::from_be_bytes([0, head[0], head[1], head[2]]) as usize;
            let Some(payload) = rest.get(..length) else {
                break;
            };
            let stream = u32::from_be_bytes([head[5] & 0x7f, head[6], head[7], head[8]]);
            self.take_frame(head[3], head[4], stream, payload)?;
            taken += HEAD_BYTES + length;
        }
        if self.send_window < 0 {
            return Err(io::Error::other("the server takes in less than is sent"));
        }
        Ok(taken)
    }

    fn take_frame(&mut self, kind: u8, flags: u8, stream: u32, payload: &[u8]) -> io::Result<()> {
        match kind {
            DATA => {
                if let Some(message) = self.messages.get_mut(&stream) {
                    message.extend(payload);
                }
                self.unreported += payload.len() as u32;
                if self.unreported >= WINDOW_STEP {
                    let room = self.unreported.to_be_bytes();
                    self.frame(WINDOW_UPDATE, 0, 0, &room);
                    self.unreported = 0;
                }
            }
            SETTINGS if flags & ACK == 0 => self.frame(SETTINGS, ACK, 0, &[]),
            PING if flags & ACK == 0 => self.frame(PING, ACK, 0, payload),
            WINDOW_UPDATE if stream == 0 => {
                let room = payload.first_chunk().copied().unwrap_or_default();
                self.send_window += i64::from(u32::from_be_bytes(room));
            }
            RST_STREAM | GOAWAY => {
                return Err(io::Error::other("the server broke off a stream"));
            }
            _ => {}
        }
        if matches!(kind, DATA | HEADERS) && flags & END_STREAM != 0 {
            self.end(stream);
        }
        Ok(())
    }

    /// A call is over; another one takes its place.
    fn end(&mut self, stream: u32) {
        let mut message = self.messages.remove(&stream).unwrap_or_default();
        match message.get(MESSAGE_PREFIX_BYTES..) {
            Some(body) => self.tally.answer(|| outcome(body)),
            None => self.tally.refuse(),
        }
        message.clear();
        self.spare.push(message);
        self.ask();
    }
}

/// Header fields with incremental indexing, names of the static table by their place there (RFC 7541, 6.2.1).
fn first_headers(address: SocketAddr) -> Vec<u8> {
    const PATH_NAME: u8 = 0x44;
    const AUTHORITY_NAME: u8 = 0x41;
    const CONTENT_TYPE_NAME: u8 = 0x5f;
    const NEW_NAME: u8 = 0x40;
    let mut block = METHOD_AND_SCHEME.to_vec();
    let authority = address.to_string();
    for (name, value) in [
        (PATH_NAME, PATH),
        (AUTHORITY_NAME, &authority),
        (CONTENT_TYPE_NAME, "application/grpc"),
    ] {
        block.extend([name, value.len() as u8]);
        block.extend(value.as_bytes());
    }
    block.push(NEW_NAME);
    for text in ["te", "trailers"] {
        block.push(text.len() as u8);
        block.extend(text.as_bytes());
    }
    block
}

/// `:method: POST` and `:scheme: http` by their places in the static table.
const METHOD_AND_SCHEME: [u8; 2] = [0x83, 0x86];

/// The same fields by their places: the static table has 61, and the last one that was put in comes next.
const fn later_headers() -> [u8; 6] {
    const INDEXED: u8 = 0x80;
    const LAST: u8 = INDEXED | 62;
    let [method, scheme] = METHOD_AND_SCHEME;
    [method, scheme, LAST + 3, LAST + 2, LAST + 1, LAST]
}

/// What a message tells a drone to do.
fn outcome(body: &[u8]) -> Option<Outcome> {
    let answer = RecompositionAnswer::decode(body).ok()?.answer?;
    match answer.outcome() {
        proto::Outcome::Rerouted => Some(Outcome::Rerouted),
        proto::Outcome::Unaffected => Some(Outcome::Unaffected),
        proto::Outcome::Hold => Some(Outcome::Hold),
        proto::Outcome::Diverted => Some(Outcome::Diverted),
        proto::Outcome::NoRoute => Some(Outcome::NoRoute),
        proto::Outcome::Unspecified => None,
    }
}
