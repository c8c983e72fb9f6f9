//! The drain: what is in flight finishes, and no client can hold it up.

use crate::harness::{Options, ask, call, grpc_refusal, h2, rest};
use crate::raw::{PREFACE, Socket, frame};
use http::Method;
use skyway::api::server::{Drained, ServerConfig};
use std::time::Duration;
use tokio::time::Instant;

#[tokio::test]
async fn a_drain_finishes_requests_in_flight_whatever_else_is_open() {
    const SETTINGS: u8 = 4;
    let server = Options::default().start().await;
    let mut settled = PREFACE.to_vec();
    settled.extend(frame(SETTINGS, 0, 0, &[]));
    let head = format!("GET /livez HTTP/1.1\r\nhost: {}\r\n", server.address);
    let idle = format!("{head}\r\n");
    let mut sockets = Vec::new();
    for beginning in [
        b"",
        &PREFACE[..10],
        PREFACE,
        &settled,
        head.as_bytes(),
        idle.as_bytes(),
    ] {
        let mut socket = Socket::open(server.address).await;
        socket.send(beginning).await;
        sockets.push(socket);
    }
    if let Some(idle) = sockets.last_mut() {
        idle.read_until("live").await;
    }
    server.entered(1).await;
    let (first, second) = (rest(), h2());
    let waiting = [&first, &second].map(|client| {
        tokio::spawn(ask(client, Method::POST, server.url("/v1/failures"), "wait").send())
    });
    server.entered(2).await;

    server.drain.begin();
    server.drain.begun().await;
    assert!(server.drain.has_begun());
    let begun = Instant::now();
    // The listener is closed before anything else ends.
    while tokio::net::TcpStream::connect(server.address).await.is_ok() {
        assert!(begun.elapsed() < Duration::from_secs(5), "still accepting");
        tokio::task::yield_now().await;
    }
    server.release(2);
    for request in waiting {
        let response = request.await.expect("no panic").expect("an answer");
        assert_eq!(response.text().await.expect("a body"), "waited");
    }
    assert_eq!(server.ended().await, Drained { forced: 0 });
    assert!(
        begun.elapsed() < Duration::from_secs(5),
        "{:?}",
        begun.elapsed()
    );
}

#[tokio::test]
async fn a_request_that_does_not_end_is_cut_when_the_time_is_over() {
    let config = ServerConfig {
        drain_timeout: Duration::from_millis(500),
        ..ServerConfig::default()
    };
    let server = Options::of(config).start().await;
    let client = rest();
    let waiting = tokio::spawn(ask(&client, Method::GET, server.url("/livez"), "wait").send());
    server.entered(1).await;
    assert_eq!(server.stopped().await, Drained { forced: 1 });
    assert!(waiting.await.expect("no panic").is_err());
}

#[tokio::test]
async fn streams_end_with_the_drain() {
    let server = Options::default().start().await;
    let events = ask(&rest(), Method::GET, server.url("/v1/events"), "stream")
        .send()
        .await
        .expect("an answer");
    let grpc = h2();
    let watch = call(&grpc, &server, "/skyway.v1.Airspace/WatchEvents", "stream")
        .send()
        .await
        .expect("an answer");
    let begun = Instant::now();
    server.drain.begin();
    assert_eq!(events.text().await.expect("an orderly end"), "");
    assert!(watch.bytes().await.expect("an orderly end").is_empty());
    drop(grpc);
    assert_eq!(server.ended().await, Drained { forced: 0 });
    assert!(
        begun.elapsed() < Duration::from_secs(5),
        "{:?}",
        begun.elapsed()
    );
}

#[tokio::test]
async fn during_the_delay_everything_is_served() {
    let config = ServerConfig {
        drain_delay: Duration::from_secs(2),
        ..ServerConfig::default()
    };
    let server = Options::of(config).start().await;
    server.drain.begin();
    let response = ask(&rest(), Method::GET, server.url("/readyz"), "")
        .send()
        .await
        .expect("an answer");
    assert_eq!(response.status(), 200);
    let refused = call(&h2(), &server, "/skyway.v1.Plans/Nothing", "")
        .send()
        .await
        .expect("an answer");
    assert_eq!(grpc_refusal(&refused).0, 12);
    assert_eq!(server.ended().await, Drained { forced: 0 });
}
