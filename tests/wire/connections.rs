//! What a connection may take before, between and after requests.

use crate::harness::{Options, ask, h2, rest};
use crate::raw::{PREFACE, Socket, frame, frames, get_livez};
use http::Method;
use skyway::api::server::ServerConfig;
use std::time::Duration;

fn seconds(from_s: f64, to_s: f64, took: Duration) {
    let took_s = took.as_secs_f64();
    assert!(
        (from_s..to_s).contains(&took_s),
        "took {took_s} s, not {from_s} to {to_s} s"
    );
}

#[tokio::test]
async fn silence_and_half_a_preface_are_cut_at_the_preface_deadline() {
    let server = Options::default().start().await;
    for beginning in [&b""[..], b"P", b"PRI * HTTP/2.0\r\n\r\nS"] {
        let mut socket = Socket::open(server.address).await;
        socket.send(beginning).await;
        assert!(socket.read_to_end().await.is_empty());
        seconds(2.5, 6.0, socket.open_for());
    }
    let closed = server.metric("connections_closed_total{reason=\"preface\"}");
    assert_eq!(closed, Some(3.0));
}

#[tokio::test]
async fn half_a_head_is_cut_at_the_header_deadline() {
    let server = Options::default().start().await;
    let mut socket = Socket::open(server.address).await;
    socket.send(b"GET /livez HTTP/1.1\r\nhost: localh").await;
    assert!(socket.read_to_end().await.is_empty());
    seconds(4.5, 9.0, socket.open_for());
    let closed = server.metric("connections_closed_total{reason=\"header\"}");
    assert_eq!(closed, Some(1.0));
}

#[tokio::test]
async fn a_preface_without_settings_is_cut_for_want_of_a_ping() {
    let config = ServerConfig {
        ping_interval: Duration::from_secs(1),
        ping_timeout: Duration::from_secs(1),
        ..ServerConfig::default()
    };
    let server = Options::of(config).start().await;
    let mut socket = Socket::open(server.address).await;
    socket.send(PREFACE).await;
    socket.read_to_end().await;
    seconds(1.5, 10.0, socket.open_for());
}

#[tokio::test]
async fn a_connection_in_use_outlives_every_deadline_of_connections() {
    let short = Duration::from_millis(500);
    let config = ServerConfig {
        preface_deadline: short,
        header_deadline: short,
        write_deadline: short,
        idle_deadline: Duration::from_secs(20),
        ..ServerConfig::default()
    };
    let server = Options::of(config).start().await;
    let clients = [rest(), h2()];
    for client in &clients {
        let waiting = tokio::spawn(ask(client, Method::GET, server.url("/livez"), "wait").send());
        server.entered(1).await;
        // Several looks of the watch.
        tokio::time::sleep(Duration::from_secs(4)).await;
        server.release(1);
        let response = waiting.await.expect("no panic").expect("an answer");
        assert_eq!(response.text().await.expect("a body"), "waited");
        // The same connection, idle for longer than a head may take.
        tokio::time::sleep(Duration::from_secs(2)).await;
        let again = ask(client, Method::GET, server.url("/livez"), "")
            .send()
            .await;
        assert_eq!(again.expect("an answer").status(), 200);
    }
    // One each: no client had to connect again.
    assert_eq!(server.metric("connections"), Some(2.0));
    let closed = ["idle", "header", "stalled"]
        .map(|reason| server.metric(&format!("connections_closed_total{{reason=\"{reason}\"}}")));
    assert_eq!(closed, [None, None, None]);
}

#[tokio::test]
async fn an_idle_connection_is_let_go() {
    let config = ServerConfig {
        idle_deadline: Duration::from_secs(1),
        ..ServerConfig::default()
    };
    let server = Options::of(config).start().await;
    let mut socket = Socket::open(server.address).await;
    let request = format!("GET /livez HTTP/1.1\r\nhost: {}\r\n\r\n", server.address);
    socket.send(request.as_bytes()).await;
    assert!(socket.text_to_end().await.starts_with("HTTP/1.1 200"));
    seconds(0.9, 8.0, socket.open_for());
}

#[tokio::test]
async fn beyond_the_cap_connections_are_closed_at_once() {
    let config = ServerConfig {
        connections_max: 3,
        connections_for_probes: 0,
        ..ServerConfig::default()
    };
    let server = Options::of(config).start().await;
    let request = format!("GET /livez HTTP/1.1\r\nhost: {}\r\n\r\n", server.address);
    let mut open = Vec::new();
    for _ in 0..3 {
        let mut socket = Socket::open(server.address).await;
        socket.send(request.as_bytes()).await;
        socket.read_until("live").await;
        open.push(socket);
    }
    let mut refused = Socket::open(server.address).await;
    assert!(refused.read_to_end().await.is_empty());
    seconds(0.0, 2.0, refused.open_for());
    assert_eq!(
        server.metric("connections_closed_total{reason=\"cap\"}"),
        Some(1.0)
    );

    open.pop();
    // The server sees the close a moment later.
    for _ in 0..1000 {
        let mut socket = Socket::open(server.address).await;
        let _ = tokio::io::AsyncWriteExt::write_all(&mut socket.stream, request.as_bytes()).await;
        let mut first = [0; 8];
        let read = tokio::io::AsyncReadExt::read_exact(&mut socket.stream, &mut first).await;
        if read.is_ok() {
            assert_eq!(&first, b"HTTP/1.1");
            return;
        }
    }
    panic!("the place of a closed connection stays taken");
}

#[tokio::test]
async fn streams_and_headers_are_bounded_by_settings() {
    const SETTINGS: u8 = 4;
    let server = Options::default().start().await;
    let mut socket = Socket::open(server.address).await;
    socket.send(PREFACE).await;
    socket.send(&frame(SETTINGS, 0, 0, &[])).await;
    server.drain.begin();
    let read = frames(&socket.read_to_end().await);
    let (_, settings) = read
        .iter()
        .find(|(kind, _)| *kind == SETTINGS)
        .expect("settings");
    let value = |id: u8| {
        let setting = settings.chunks(6).find(|setting| setting[..2] == [0, id]);
        setting.map(|setting| u32::from_be_bytes([setting[2], setting[3], setting[4], setting[5]]))
    };
    assert_eq!(value(3), Some(128), "MAX_CONCURRENT_STREAMS");
    assert_eq!(value(6), Some(16 * 1024), "MAX_HEADER_LIST_SIZE");
}

#[tokio::test]
async fn a_rapid_reset_ends_the_connection() {
    const HEADERS: u8 = 1;
    const RST_STREAM: u8 = 3;
    const SETTINGS: u8 = 4;
    const GOAWAY: u8 = 7;
    const END_STREAM_AND_HEADERS: u8 = 5;
    const CANCEL: [u8; 4] = [0, 0, 0, 8];
    const ENHANCE_YOUR_CALM: [u8; 4] = [0, 0, 0, 11];
    let server = Options::default().start().await;
    let mut bytes = PREFACE.to_vec();
    bytes.extend(frame(SETTINGS, 0, 0, &[]));
    for request in 0..2000 {
        let stream = 2 * request + 1;
        bytes.extend(frame(
            HEADERS,
            END_STREAM_AND_HEADERS,
            stream,
            &get_livez(server.address),
        ));
        bytes.extend(frame(RST_STREAM, 0, stream, &CANCEL));
    }
    let mut socket = Socket::open(server.address).await;
    // The server may close before it has read everything.
    let _ = tokio::io::AsyncWriteExt::write_all(&mut socket.stream, &bytes).await;
    let read = frames(&socket.read_to_end().await);
    let goaway = read.iter().find(|(kind, _)| *kind == GOAWAY);
    if let Some((_, payload)) = goaway {
        assert_eq!(payload[4..8], ENHANCE_YOUR_CALM);
    }
    // A client that resets nothing is served as before.
    let response = ask(&h2(), Method::GET, server.url("/livez"), "")
        .send()
        .await;
    assert_eq!(response.expect("an answer").status(), 200);
}
