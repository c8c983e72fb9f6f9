//! Traces of requests: what a collector gets, and that nobody waits for one that is away.

#![expect(
    clippy::disallowed_methods,
    clippy::disallowed_types,
    reason = "a collector of one's own, and an edge as a child process"
)]

use crate::binary::{Desk, Server};
use std::io::{Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::thread::JoinHandle;

/// The trace of a drone's own, in its form on the wire and as it comes in a header.
const TRACE: [u8; 16] = *b"\x4b\xf9\x2f\x35\x77\xb3\x4d\xa6\xa3\xce\x92\x9d\x0e\x0e\x47\x36";
const TRACEPARENT: &str = "00-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-01";

/// What a collector is sent until an edge ends, head and body.
struct Collector {
    endpoint: String,
    address: SocketAddr,
    taking: JoinHandle<Vec<Vec<u8>>>,
}

impl Collector {
    fn open() -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
        let address = listener.local_addr().expect("an address");
        let taking = std::thread::spawn(move || {
            let mut taken = Vec::new();
            for stream in listener.incoming() {
                let mut stream = stream.expect("a connection");
                let request = whole_request(&mut stream);
                // A connection that says nothing ends the collector.
                if request.is_empty() {
                    break;
                }
                taken.push(request);
                let answer = b"HTTP/1.1 200 OK\r\ncontent-length: 0\r\nconnection: close\r\n\r\n";
                stream.write_all(answer).expect("a reader");
            }
            taken
        });
        Self {
            endpoint: format!("http://{address}/v1/traces"),
            address,
            taking,
        }
    }

    fn close(self) -> Vec<Vec<u8>> {
        drop(TcpStream::connect(self.address).expect("the collector"));
        self.taking.join().expect("a collector that ends")
    }
}

fn whole_request(stream: &mut TcpStream) -> Vec<u8> {
    let mut request = Vec::new();
    let mut part = [0; 16 * 1024];
    loop {
        let count = stream.read(&mut part).expect("bytes");
        request.extend(&part[..count]);
        let head_end = request.windows(4).position(|four| four == b"\r\n\r\n");
        let whole = head_end.is_some_and(|end| {
            let head = String::from_utf8_lossy(&request[..end]).to_ascii_lowercase();
            let length = head.split("content-length: ").nth(1);
            let length = length.and_then(|rest| rest.lines().next()?.trim().parse::<usize>().ok());
            request.len() >= end + 4 + length.unwrap_or(0)
        });
        if whole || count == 0 {
            return request;
        }
    }
}

fn has(bytes: &[u8], part: &[u8]) -> bool {
    bytes.windows(part.len()).any(|window| window == part)
}

/// Reports a failure as a drone that traces, and gives the answer.
fn report(address: SocketAddr) -> String {
    let body = r#"{"service":{"from":379,"to":406},"destination":450,"dry_run":true}"#;
    let mut stream = TcpStream::connect(address).expect("the edge");
    let request = format!(
        "POST /v1/failures HTTP/1.1\r\nhost: {address}\r\ncontent-type: application/json\r\ncontent-length: {}\r\n\
         x-request-id: drone-7-report-1\r\ntraceparent: {TRACEPARENT}\r\nconnection: close\r\n\r\n{body}",
        body.len()
    );
    stream.write_all(request.as_bytes()).expect("a reader");
    let mut answer = String::new();
    stream.read_to_string(&mut answer).expect("an answer");
    assert!(answer.starts_with("HTTP/1.1 200"), "{answer}");
    answer
}

#[test]
fn a_collector_gets_the_drones_request_down_to_the_search() {
    let collector = Collector::open();
    let desk = Desk::new();
    let setting = format!("traces.endpoint={}", collector.endpoint);
    let edge = Server::start(&desk, &["edge", "--no-store", "--set", &setting]);
    let answer = report(edge.address);
    assert_eq!(edge.end(), 0);
    let taken = collector.close().concat();
    assert!(has(&taken, b"POST /v1/traces"), "nothing was sent");
    for name in [
        "skyway-edge",
        "recompose",
        "settle",
        "search",
        "drone-7-report-1",
    ] {
        assert!(has(&taken, name.as_bytes()), "no '{name}' was sent");
    }
    assert!(
        has(&taken, &TRACE),
        "the span is no part of the drone's trace"
    );
    let (_, id) = answer.split_once(r#""id":""#).expect("an id");
    let id = id.split('"').next().expect("an id");
    assert!(
        has(&taken, id.as_bytes()),
        "the recomposition {id} is not named"
    );
}

#[test]
fn nobody_waits_for_a_collector_that_is_away() {
    let desk = Desk::new();
    // Nobody listens on the port of a listener that is gone.
    let gone = TcpListener::bind("127.0.0.1:0").expect("a port");
    let setting = format!(
        "traces.endpoint=http://{}/v1/traces",
        gone.local_addr().expect("an address")
    );
    drop(gone);
    let edge = Server::start(&desk, &["edge", "--no-store", "--set", &setting]);
    for _ in 0..3 {
        report(edge.address);
    }
    assert_eq!(edge.end(), 0);
}

#[test]
fn an_endpoint_that_is_no_address_keeps_the_edge_from_starting() {
    let desk = Desk::new();
    let ports = desk.path("ports.json");
    let run = crate::binary::skyway(&[
        "edge",
        "--no-store",
        "--listen",
        "127.0.0.1:0",
        "--admin-listen",
        "127.0.0.1:0",
        "--ports-file",
        &ports,
        "--set",
        "traces.endpoint=over there",
    ])
    .exits(78);
    assert!(run.stderr.contains("traces.endpoint"), "{}", run.stderr);
}
