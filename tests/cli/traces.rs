//! Traces of requests: what a collector gets, and that no request waits for one that is away.

#![expect(
    clippy::disallowed_methods,
    clippy::disallowed_types,
    reason = "a collector of one's own, and an edge as a child process"
)]

use crate::binary::{Server, Workspace};
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
    let headers = format!(
        "content-type: application/json\r\nx-request-id: drone-7-report-1\r\ntraceparent: {TRACEPARENT}\r\n"
    );
    Server::ask(address, "POST /v1/failures", &headers, body)
}

/// The metrics for who accepts these types, head and body.
fn metrics(edge: &Server, accept: &str) -> String {
    Server::ask(
        edge.admin,
        "GET /metrics",
        &format!("accept: {accept}\r\n"),
        "",
    )
}

#[test]
fn a_collector_gets_the_drones_request_down_to_the_search() {
    let collector = Collector::open();
    let desk = Workspace::new();
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
        // Outcome, stage and publication, as the wire calls them.
        "rerouted",
        "global",
        "none",
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
    let desk = Workspace::new();
    // Nothing listens on the port of a listener that is gone.
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
    let desk = Workspace::new();
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

/// An exemplar, as `OpenMetrics` writes it behind the sample of a bucket.
const EXEMPLAR: &str = "# {trace_id=\"4bf92f3577b34da6a3ce929d0e0e4736\"} ";

#[test]
fn a_bucket_names_the_trace_of_a_request_that_is_sent() {
    let desk = Workspace::new();
    let collector = Collector::open();
    let setting = format!("traces.endpoint={}", collector.endpoint);
    let edge = Server::start(&desk, &["edge", "--no-store", "--set", &setting]);
    report(edge.address);
    let prometheus = "application/openmetrics-text;version=1.0.0,text/plain;version=0.0.4;q=0.5";
    for accept in [prometheus, "*/*"] {
        let page = metrics(&edge, accept);
        assert!(page.contains("content-type: application/openmetrics-text; version=1.0.0"));
        let named: Vec<&str> = page
            .lines()
            .filter(|line| line.contains(EXEMPLAR))
            .collect();
        let [bucket] = *named else {
            panic!("one request fell into one bucket, and these name it: {named:?}");
        };
        assert!(bucket.starts_with("skyway_request_duration_seconds_bucket{"));
        assert!(bucket.contains("operation=\"report_failure\""), "{bucket}");
    }
    // Who reads the older format alone would take an exemplar for a fault of the page.
    let page = metrics(&edge, "text/plain;version=0.0.4,*/*;q=0.1");
    assert!(page.contains("content-type: text/plain; version=0.0.4"));
    assert!(page.contains("skyway_request_duration_seconds_bucket{"));
    assert!(!page.contains("trace_id"), "{page}");
    assert_eq!(edge.end(), 0);
    collector.close();
}

#[test]
fn what_is_not_sent_is_not_named() {
    let collector = Collector::open();
    let endpoint = format!("traces.endpoint={}", collector.endpoint);
    let none_by_chance = [
        "edge",
        "--no-store",
        "--set",
        &endpoint,
        "--set",
        "traces.share=0",
    ];
    for arguments in [&["edge", "--no-store"][..], &none_by_chance] {
        let desk = Workspace::new();
        let edge = Server::start(&desk, arguments);
        // Without a trace of the drone's own chance decides.
        let body = r#"{"service":{"from":379,"to":406},"destination":450,"dry_run":true}"#;
        let headers = "content-type: application/json\r\n";
        Server::ask(edge.address, "POST /v1/failures", headers, body);
        let page = metrics(&edge, "application/openmetrics-text");
        assert!(page.contains("skyway_request_duration_seconds_bucket{"));
        assert!(!page.contains("trace_id"), "{arguments:?}: {page}");
        assert_eq!(edge.end(), 0);
    }
    collector.close();
}
