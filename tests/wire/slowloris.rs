//! Many sockets that say nothing, or too slowly: other clients are served all the while.

use crate::harness::{Options, ask, rest};
use crate::raw::Socket;
use http::Method;
use std::time::Duration;
use tokio::io::AsyncWriteExt;
use tokio::task::JoinSet;
use tokio::time::{Instant, interval};

/// How many of each kind; `SKYWAY_CASES` asks for more.
#[expect(clippy::disallowed_methods, reason = "the one knob of long test runs")]
fn cases() -> usize {
    let asked = std::env::var("SKYWAY_CASES")
        .ok()
        .and_then(|text| text.parse().ok());
    asked.unwrap_or(200)
}

async fn silent(mut socket: Socket) -> Duration {
    socket.read_to_end().await;
    socket.open_for()
}

/// A byte of a header every quarter of a second, until the server has enough.
async fn dribbling(mut socket: Socket) -> Duration {
    socket.send(b"POST /v1/failures HTTP/1.1\r\nx: ").await;
    let mut pace = interval(Duration::from_millis(250));
    let (mut reading, mut writing) = socket.stream.split();
    let mut rest = Vec::new();
    let dribble = async {
        loop {
            pace.tick().await;
            if writing.write_all(b"y").await.is_err() {
                return;
            }
        }
    };
    tokio::select! {
        () = dribble => {}
        _ = tokio::io::AsyncReadExt::read_to_end(&mut reading, &mut rest) => {}
    }
    socket.open_for()
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn slow_sockets_are_closed_while_others_are_served() {
    let count = cases();
    let server = Options::default().start().await;
    let mut slow = JoinSet::new();
    for _ in 0..count {
        slow.spawn(silent(Socket::open(server.address).await));
        slow.spawn(dribbling(Socket::open(server.address).await));
    }
    let client = rest();
    let mut served = 0;
    let mut closed = Vec::new();
    let begun = Instant::now();
    while closed.len() < 2 * count {
        let response = ask(&client, Method::POST, server.url("/v1/failures"), "")
            .send()
            .await;
        assert_eq!(response.expect("an answer").status(), 200);
        served += 1;
        while let Some(ended) = slow.try_join_next() {
            closed.push(ended.expect("no panic"));
        }
        assert!(
            begun.elapsed() < Duration::from_secs(60),
            "{} of {} closed",
            closed.len(),
            2 * count
        );
    }
    let longest = closed.iter().max().expect("some");
    assert!(*longest <= Duration::from_secs(15), "{longest:?}");
    assert!(served > 100, "only {served} requests were served meanwhile");
}
