//! How long an answer may take.

use crate::harness::{Options, WAIT_AT_MOST, ask, call, code, grpc_refusal, h2, rest};
use http::Method;
use std::sync::atomic::Ordering;
use std::time::Duration;
use tokio::time::Instant;

const REPORT: &str = "/skyway.v1.Recomposition/ReportFailure";

#[tokio::test]
async fn a_grpc_timeout_ends_the_call_and_its_handler() {
    let server = Options::default().start().await;
    let begun = Instant::now();
    let response = call(&h2(), &server, REPORT, "wait")
        .header("grpc-timeout", "200m")
        .send()
        .await;
    let response = response.expect("an answer");
    assert_eq!(grpc_refusal(&response), (4, "deadline_exceeded".to_owned()));
    assert!(
        begun.elapsed() < Duration::from_secs(2),
        "{:?}",
        begun.elapsed()
    );
    assert_eq!(server.handlers.dropped.load(Ordering::SeqCst), 1);
    assert_eq!(server.metric("deadline_exceeded_total"), Some(1.0));
    assert_eq!(server.metric("in_flight{class=\"failure\"}"), Some(0.0));
}

#[tokio::test]
async fn the_configured_deadline_holds_in_both_dialects() {
    let options = Options {
        deadline: Duration::from_millis(300),
        ..Options::default()
    };
    let server = options.start().await;
    let response = ask(&rest(), Method::POST, server.url("/v1/failures"), "wait")
        .send()
        .await;
    let response = response.expect("an answer");
    assert_eq!(response.status(), 504);
    assert_eq!(code(response).await, "deadline_exceeded");
    let response = call(&h2(), &server, REPORT, "wait")
        .header("grpc-timeout", "1H")
        .send()
        .await;
    assert_eq!(
        grpc_refusal(&response.expect("an answer")),
        (4, "deadline_exceeded".to_owned())
    );
    assert_eq!(server.handlers.dropped.load(Ordering::SeqCst), 2);
}

#[tokio::test]
async fn a_timeout_that_cannot_be_read_is_as_if_it_were_not_there() {
    let server = Options::default().start().await;
    let response = call(&h2(), &server, REPORT, "")
        .header("grpc-timeout", "soon")
        .send()
        .await;
    assert_eq!(
        response.expect("an answer").text().await.expect("a body"),
        "report_failure anyone"
    );
}

#[tokio::test]
async fn a_stream_outlives_the_deadline() {
    let options = Options {
        deadline: Duration::from_millis(100),
        ..Options::default()
    };
    let server = options.start().await;
    let response = ask(&rest(), Method::GET, server.url("/v1/events"), "stream")
        .send()
        .await;
    let mut response = response.expect("an answer");
    let beyond = tokio::time::timeout(Duration::from_secs(1), response.chunk()).await;
    assert!(beyond.is_err(), "the stream ended: {beyond:?}");
    assert_eq!(server.metric("in_flight{class=\"stream\"}"), Some(1.0));
}

#[tokio::test]
async fn a_client_that_leaves_takes_its_handler_along() {
    let server = Options::default().start().await;
    for client in [rest(), h2()] {
        let waiting = tokio::spawn(ask(&client, Method::GET, server.url("/livez"), "wait").send());
        server.entered(1).await;
        waiting.abort();
        drop(client);
        let _ = waiting.await;
    }
    let both_dropped = async {
        while server.handlers.dropped.load(Ordering::SeqCst) < 2 {
            tokio::task::yield_now().await;
        }
    };
    tokio::time::timeout(WAIT_AT_MOST, both_dropped)
        .await
        .expect("handlers are dropped");
}
