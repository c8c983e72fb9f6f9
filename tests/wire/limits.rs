//! What a request may carry, and what happens when its handler breaks.

use crate::harness::{Options, ask, call, code, grpc_refusal, h2, rest};
use crate::raw::Socket;
use http::Method;

const LIMIT: usize = 64 * 1024;

fn bounded() -> Options {
    Options {
        body_bytes_max: LIMIT,
        ..Options::default()
    }
}

#[tokio::test]
async fn a_body_within_the_limit_comes_whole() {
    let server = bounded().start().await;
    for client in [rest(), h2()] {
        let body = vec![b'x'; LIMIT];
        let response =
            ask(&client, Method::POST, server.url("/v1/zones"), "echo").body(body.clone());
        let response = response.send().await.expect("an answer");
        assert_eq!(response.headers()["x-content-type-options"], "nosniff");
        assert_eq!(response.bytes().await.expect("a body"), body);
    }
}

#[tokio::test]
async fn a_body_that_says_it_is_too_large_is_refused_before_it_comes() {
    let server = bounded().start().await;
    let mut socket = Socket::open(server.address).await;
    let head = format!(
        "POST /v1/zones HTTP/1.1\r\nhost: {}\r\ncontent-length: {}\r\n\r\n",
        server.address,
        LIMIT + 1
    );
    socket.send(head.as_bytes()).await;
    let answer = socket.text_to_end().await;
    assert!(answer.starts_with("HTTP/1.1 413 "), "{answer}");
    assert!(answer.contains("\"code\":\"body_too_large\""), "{answer}");
    assert_eq!(server.handlers.entered.available_permits(), 0);
}

#[tokio::test]
async fn a_body_that_grows_too_large_is_refused_when_it_does() {
    let server = bounded().start().await;
    for client in [rest(), h2()] {
        let chunks = (0..16).map(|_| Ok::<_, std::io::Error>(vec![b'x'; LIMIT / 8]));
        let body = reqwest::Body::wrap_stream(tokio_stream::iter(chunks));
        let response = ask(&client, Method::POST, server.url("/v1/zones"), "echo").body(body);
        let response = response.send().await.expect("an answer");
        assert_eq!(response.status(), 413);
        assert_eq!(code(response).await, "body_too_large");
    }
    let chunks = (0..16).map(|_| Ok::<_, std::io::Error>(vec![0; LIMIT / 8]));
    let body = reqwest::Body::wrap_stream(tokio_stream::iter(chunks));
    let path = "/skyway.v1.Plans/CreatePlan";
    let response = call(&h2(), &server, path, "echo")
        .body(body)
        .send()
        .await
        .expect("an answer");
    assert_eq!(grpc_refusal(&response), (8, "body_too_large".to_owned()));
}

#[tokio::test]
async fn a_feed_has_a_limit_of_its_own_however_it_comes() {
    let options = Options {
        file_bytes_max: 8 * LIMIT,
        ..bounded()
    };
    let server = options.start().await;
    let feed = "/v1/zones:import";
    for (path, parts, status) in [(feed, 8, 200), (feed, 9, 413), ("/v1/zones", 8, 413)] {
        let announced = reqwest::Body::from(vec![b'x'; parts * LIMIT]);
        let chunks = (0..parts).map(|_| Ok::<_, std::io::Error>(vec![b'x'; LIMIT]));
        let streamed = reqwest::Body::wrap_stream(tokio_stream::iter(chunks));
        for body in [announced, streamed] {
            let request = ask(&h2(), Method::POST, server.url(path), "echo").body(body);
            let response = request.send().await.expect("an answer");
            assert_eq!(response.status(), status, "{path} {parts}");
        }
    }
}

#[tokio::test]
async fn compressed_bodies_are_refused() {
    let server = bounded().start().await;
    let request = ask(&rest(), Method::POST, server.url("/v1/failures"), "echo");
    let response = request
        .header("content-encoding", "gzip")
        .body("x")
        .send()
        .await;
    let response = response.expect("an answer");
    assert_eq!(response.status(), 415);
    assert_eq!(code(response).await, "media_type_unsupported");
}

#[tokio::test]
async fn floods_of_headers_and_rubbish_are_refused() {
    let server = bounded().start().await;
    let large = format!(
        "GET /livez HTTP/1.1\r\nhost: {}\r\nx: {}\r\n\r\n",
        server.address,
        "y".repeat(100_000)
    );
    let many = format!("GET /livez HTTP/1.1\r\n{}\r\n", "x: y\r\n".repeat(1000));
    let rubbish = "\u{0}\u{1}\u{2} rubbish\r\n\r\n".to_owned();
    for (text, status) in [(large, "431"), (many, "431"), (rubbish, "400")] {
        let mut socket = Socket::open(server.address).await;
        // The server may close before it has read everything.
        let _ = tokio::io::AsyncWriteExt::write_all(&mut socket.stream, text.as_bytes()).await;
        let answer = socket.text_to_end().await;
        // Bytes that are never read can reset the connection before its answer is read.
        let was_answered = answer.starts_with(&format!("HTTP/1.1 {status} "));
        assert!(was_answered || answer.is_empty(), "{answer}");
    }
    assert_eq!(server.handlers.entered.available_permits(), 0);
    let response = ask(&rest(), Method::GET, server.url("/livez"), "")
        .send()
        .await;
    assert_eq!(response.expect("an answer").status(), 200);
}

#[tokio::test]
async fn a_large_head_over_http_2_is_refused() {
    let server = bounded().start().await;
    let request =
        ask(&h2(), Method::GET, server.url("/livez"), "").header("x", "y".repeat(100_000));
    match request.send().await {
        Ok(response) => assert_eq!(response.status(), 431),
        Err(error) => assert!(error.is_request(), "{error:?}"),
    }
    assert_eq!(server.handlers.entered.available_permits(), 0);
}

#[tokio::test]
async fn a_panic_is_an_internal_error_and_nothing_else() {
    let server = bounded().start().await;
    let client = rest();
    let response = ask(&client, Method::POST, server.url("/v1/failures"), "panic")
        .send()
        .await;
    let response = response.expect("an answer");
    assert_eq!(response.status(), 500);
    assert_eq!(code(response).await, "internal");
    let grpc = h2();
    let path = "/skyway.v1.Recomposition/ReportFailure";
    let response = call(&grpc, &server, path, "panic")
        .send()
        .await
        .expect("an answer");
    assert_eq!(grpc_refusal(&response), (13, "internal".to_owned()));
    assert_eq!(server.metric("handler_panics_total"), Some(2.0));
    assert_eq!(server.metric("in_flight{class=\"failure\"}"), Some(0.0));

    let response = ask(&client, Method::POST, server.url("/v1/failures"), "")
        .send()
        .await;
    assert_eq!(response.expect("an answer").status(), 200);
    let response = call(&grpc, &server, path, "")
        .send()
        .await
        .expect("an answer");
    assert_eq!(
        response.text().await.expect("a body"),
        "report_failure anyone"
    );
}

#[tokio::test]
async fn what_leads_nowhere_is_a_problem_in_its_dialect() {
    let server = bounded().start().await;
    let client = rest();
    let response = ask(&client, Method::GET, server.url("/v1/nowhere"), "")
        .send()
        .await
        .expect("an answer");
    assert_eq!(
        (response.status().as_u16(), code(response).await.as_str()),
        (404, "not_found")
    );
    let response = ask(&client, Method::PUT, server.url("/v1/zones"), "")
        .send()
        .await
        .expect("an answer");
    assert_eq!(response.headers()["allow"], "POST, GET");
    assert_eq!(
        (response.status().as_u16(), code(response).await.as_str()),
        (405, "method_not_allowed")
    );
    let response = call(&h2(), &server, "/skyway.v1.Plans/Nothing", "")
        .send()
        .await
        .expect("an answer");
    assert_eq!(
        grpc_refusal(&response),
        (12, "method_not_allowed".to_owned())
    );
    // What the admin listener has is not here.
    let response = ask(&client, Method::GET, server.url("/metrics"), "")
        .send()
        .await
        .expect("an answer");
    assert_eq!(code(response).await, "not_found");
}

#[tokio::test]
async fn a_request_id_is_echoed_or_made() {
    let server = bounded().start().await;
    let request = || ask(&rest(), Method::GET, server.url("/livez"), "");
    let echoed = request()
        .header("x-request-id", "drone-7.a")
        .send()
        .await
        .expect("an answer");
    assert_eq!(echoed.headers()["x-request-id"], "drone-7.a");
    let made = request()
        .header("x-request-id", "<script>")
        .send()
        .await
        .expect("an answer");
    assert!(made.headers()["x-request-id"] != "<script>");
    let other = request().send().await.expect("an answer");
    assert!(made.headers()["x-request-id"] != other.headers()["x-request-id"]);
}

#[tokio::test]
async fn only_own_names_are_answered_without_tokens() {
    let server = bounded().start().await;
    for (header, value) in [
        ("host", "evil.example"),
        ("origin", "http://evil.example"),
        ("origin", "null"),
    ] {
        let response = ask(&rest(), Method::GET, server.url("/v1/zones"), "")
            .header(header, value)
            .send()
            .await;
        let response = response.expect("an answer");
        assert_eq!(response.status(), 421, "{header}: {value}");
        assert_eq!(code(response).await, "host_refused");
    }
    let origin = format!("http://{}", server.address);
    let response = ask(&rest(), Method::GET, server.url("/v1/zones"), "")
        .header("origin", origin)
        .send()
        .await;
    assert_eq!(response.expect("an answer").status(), 200);
}
