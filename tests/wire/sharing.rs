//! What one client may hold of what all share: connections of an address, streams of a kind.

use crate::harness::{Options, ask, call, h2, rest};
use crate::raw::Socket;
use http::Method;
use skyway::api::server::ServerConfig;
use std::net::SocketAddr;

/// More than all places for streams, on connections that hold a hundred each.
const WATCHES: usize = 300;
const ON_A_CONNECTION: usize = 100;

#[tokio::test]
async fn watching_the_health_takes_no_stream_of_events() {
    let server = Options::with_tokens().start().await;
    let clients: Vec<reqwest::Client> = (0..WATCHES / ON_A_CONNECTION).map(|_| h2()).collect();
    let mut open = Vec::new();
    for number in 0..WATCHES {
        let client = &clients[number / ON_A_CONNECTION];
        let watch = call(client, &server, "/grpc.health.v1.Health/Watch", "stream");
        open.push(watch.send().await.expect("an answer"));
    }
    let refused = open
        .iter()
        .filter(|response| response.headers().contains_key("grpc-status"));
    assert!(refused.count() > 0, "watches have a bound too");
    let events = ask(&rest(), Method::GET, server.url("/v1/events"), "stream");
    let events = events.bearer_auth("operator").send().await;
    assert_eq!(events.expect("an answer").status(), 200);
}

fn livez(address: SocketAddr) -> String {
    format!("GET /livez HTTP/1.1\r\nhost: {address}\r\n\r\n")
}

/// Opens connections from an address and asks on each, until one is not answered.
async fn open_all(server: SocketAddr, from: &str) -> Vec<Socket> {
    let mut open = Vec::new();
    loop {
        let mut socket = Socket::open_from(server, from).await;
        if !socket.is_answered(&livez(server)).await {
            return open;
        }
        open.push(socket);
        assert!(open.len() < 100, "connections of one address have no bound");
    }
}

#[tokio::test]
async fn one_address_does_not_hold_all_connections() {
    let server = Options {
        server: ServerConfig {
            connections_max: 8,
            connections_per_address: 5,
            connections_for_probes: 0,
            ..ServerConfig::default()
        },
        ..Options::default()
    };
    let server = server.start().await;
    let held = open_all(server.address, "127.0.0.2").await;
    assert_eq!(held.len(), 5);
    let mut other = Socket::open_from(server.address, "127.0.0.3").await;
    assert!(other.is_answered(&livez(server.address)).await);
    drop(held);
}

#[tokio::test]
async fn probes_are_answered_when_all_connections_are_taken() {
    let server = Options {
        server: ServerConfig {
            connections_max: 3,
            ..ServerConfig::default()
        },
        ..Options::default()
    };
    let server = server.start().await;
    let mut held = Vec::new();
    for number in 2..5 {
        let from = format!("127.0.0.{number}");
        let mut socket = Socket::open_from(server.address, &from).await;
        assert!(socket.is_answered(&livez(server.address)).await);
        held.push(socket);
    }
    for path in ["/livez", "/readyz"] {
        let mut probe = Socket::open_from(server.address, "127.0.0.9").await;
        let request = format!("GET {path} HTTP/1.1\r\nhost: {}\r\n\r\n", server.address);
        probe.send(request.as_bytes()).await;
        // Its place is for the next probe.
        let answer = probe.text_to_end().await;
        assert!(answer.starts_with("HTTP/1.1 200 "), "{answer}");
        assert!(answer.contains("connection: close"), "{answer}");
    }
    let mut other = Socket::open_from(server.address, "127.0.0.9").await;
    let request = format!("GET /v1/zones HTTP/1.1\r\nhost: {}\r\n\r\n", server.address);
    other.send(request.as_bytes()).await;
    let answer = other.text_to_end().await;
    assert!(answer.starts_with("HTTP/1.1 503 "), "{answer}");
    assert!(answer.contains("\"overloaded\""), "{answer}");
    drop(held);
}
