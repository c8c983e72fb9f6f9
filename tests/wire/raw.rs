//! A client that writes bytes, to say what no library would.

use crate::harness::WAIT_AT_MOST;
use std::net::SocketAddr;
use std::time::Duration;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::{TcpSocket, TcpStream};
use tokio::time::{Instant, timeout};

pub(crate) const PREFACE: &[u8] = b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n";

pub(crate) struct Socket {
    pub(crate) stream: TcpStream,
    opened: Instant,
}

impl Socket {
    pub(crate) async fn open(address: SocketAddr) -> Self {
        let stream = TcpStream::connect(address).await.expect("connects");
        Self {
            stream,
            opened: Instant::now(),
        }
    }

    /// From an address of this machine.
    pub(crate) async fn open_from(address: SocketAddr, from: &str) -> Self {
        let socket = TcpSocket::new_v4().expect("a socket");
        let from = format!("{from}:0").parse().expect("an address");
        socket.bind(from).expect("an address of this machine");
        let stream = socket.connect(address).await.expect("connects");
        Self {
            stream,
            opened: Instant::now(),
        }
    }

    /// Whether a request for `/livez` is answered, rather than its connection closed.
    pub(crate) async fn is_answered(&mut self, request: &str) -> bool {
        // The server may close before it has read anything.
        let _ = self.stream.write_all(request.as_bytes()).await;
        let mut first = [0; 8];
        let read = timeout(WAIT_AT_MOST, self.stream.read_exact(&mut first)).await;
        match read.expect("an answer or an end") {
            Ok(_) => first == *b"HTTP/1.1",
            Err(_) => false,
        }
    }

    pub(crate) async fn send(&mut self, bytes: &[u8]) {
        self.stream.write_all(bytes).await.expect("writes");
    }

    /// Everything until the server closes; a reset counts as a close.
    pub(crate) async fn read_to_end(&mut self) -> Vec<u8> {
        let mut bytes = Vec::new();
        let read = timeout(WAIT_AT_MOST, self.stream.read_to_end(&mut bytes)).await;
        let _ = read.expect("the server closes");
        bytes
    }

    pub(crate) async fn text_to_end(&mut self) -> String {
        String::from_utf8_lossy(&self.read_to_end().await).into_owned()
    }

    /// Reads until a text has come.
    pub(crate) async fn read_until(&mut self, text: &str) -> String {
        let mut bytes = Vec::new();
        loop {
            let read = timeout(WAIT_AT_MOST, self.stream.read_buf(&mut bytes)).await;
            let count = read.expect("bytes come").expect("reads");
            let so_far = String::from_utf8_lossy(&bytes).into_owned();
            if so_far.contains(text) {
                return so_far;
            }
            assert!(count > 0, "closed before '{text}' came: {so_far}");
        }
    }

    pub(crate) fn open_for(&self) -> Duration {
        self.opened.elapsed()
    }
}

/// A frame of HTTP/2 (RFC 9113, 4.1).
pub(crate) fn frame(kind: u8, flags: u8, stream: u32, payload: &[u8]) -> Vec<u8> {
    let length = u32::try_from(payload.len()).expect("short").to_be_bytes();
    let mut bytes = length[1..].to_vec();
    bytes.extend([kind, flags]);
    bytes.extend(stream.to_be_bytes());
    bytes.extend(payload);
    bytes
}

/// The frames in what was read, as kind and payload; a last one that is cut off is left out.
pub(crate) fn frames(mut bytes: &[u8]) -> Vec<(u8, Vec<u8>)> {
    let mut found = Vec::new();
    while let Some((head, rest)) = bytes.split_first_chunk::<9>() {
        let length = u32::from_be_bytes([0, head[0], head[1], head[2]]) as usize;
        let Some((payload, rest)) = rest.split_at_checked(length) else {
            break;
        };
        found.push((head[3], payload.to_vec()));
        bytes = rest;
    }
    found
}

/// The headers of `GET /livez` in HPACK (RFC 7541): indexed fields, then literals without indexing.
pub(crate) fn get_livez(address: SocketAddr) -> Vec<u8> {
    const METHOD_GET: u8 = 0x82;
    const SCHEME_HTTP: u8 = 0x86;
    const PATH_LITERAL: u8 = 0x04;
    const AUTHORITY_LITERAL: u8 = 0x01;
    let mut block = vec![METHOD_GET, SCHEME_HTTP];
    for (name, value) in [
        (PATH_LITERAL, "/livez".to_owned()),
        (AUTHORITY_LITERAL, address.to_string()),
    ] {
        block.extend([name, u8::try_from(value.len()).expect("short")]);
        block.extend(value.as_bytes());
    }
    block
}
