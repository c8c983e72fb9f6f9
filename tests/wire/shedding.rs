//! Under load each class has its own places: a flood of one leaves the others served.

use crate::harness::{Options, Server, ask, call, code, grpc_refusal, h2, rest};
use http::Method;
use skyway::api::server::Slots;

/// Method and path of REST, and the method of gRPC where there is one.
type Asked = (Method, &'static str, Option<&'static str>);

const READ: Asked = (Method::GET, "/v1/plans", Some("/skyway.v1.Plans/ListPlans"));
const FAILURE: Asked = (
    Method::POST,
    "/v1/failures",
    Some("/skyway.v1.Recomposition/ReportFailure"),
);
const ZONE_WRITE: Asked = (Method::POST, "/v1/zones", None);
const OTHER: Asked = (
    Method::POST,
    "/v1/plans",
    Some("/skyway.v1.Plans/CreatePlan"),
);

async fn small() -> Server {
    let slots = Slots {
        failures: 2,
        zone_writes: 2,
        reads: 2,
        other: 2,
        follows: 2,
        streams: 2,
        sessions: 2,
        watches: 2,
    };
    Options {
        slots,
        ..Options::default()
    }
    .start()
    .await
}

async fn is_served(server: &Server, (method, path, rpc): &Asked) -> bool {
    let rest = ask(&rest(), method.clone(), server.url(path), "")
        .send()
        .await
        .expect("an answer");
    let is_served = rest.status() == 200;
    if !is_served {
        assert_eq!(rest.status(), 503, "{path}");
        assert_eq!(rest.headers()["retry-after"], "1");
        assert_eq!(code(rest).await, "overloaded");
    }
    let Some(rpc) = rpc else {
        return is_served;
    };
    let grpc = call(&h2(), server, rpc, "")
        .send()
        .await
        .expect("an answer");
    if is_served {
        assert!(
            !grpc.headers().contains_key("grpc-status"),
            "{rpc}: the dialects differ"
        );
    } else {
        assert_eq!(grpc_refusal(&grpc), (8, "overloaded".to_owned()));
        assert_eq!(grpc.headers()["grpc-retry-pushback-ms"], "1000");
    }
    is_served
}

#[tokio::test]
async fn a_saturated_class_leaves_the_others_served() {
    let all = [READ, FAILURE, ZONE_WRITE, OTHER];
    for saturated in &all {
        let server = small().await;
        let client = rest();
        let waiting = [(); 2].map(|()| {
            tokio::spawn(
                ask(
                    &client,
                    saturated.0.clone(),
                    server.url(saturated.1),
                    "wait",
                )
                .send(),
            )
        });
        server.entered(2).await;
        for class in &all {
            assert_eq!(
                is_served(&server, class).await,
                class != saturated,
                "{} while {}",
                class.1,
                saturated.1
            );
        }
        assert_eq!(
            ask(&client, Method::GET, server.url("/livez"), "")
                .send()
                .await
                .expect("an answer")
                .status(),
            200
        );

        server.release(2);
        for request in waiting {
            let response = request.await.expect("no panic").expect("an answer");
            assert_eq!(response.text().await.expect("a body"), "waited");
        }
        assert!(
            is_served(&server, saturated).await,
            "{} after the flood",
            saturated.1
        );
    }
}

#[tokio::test]
async fn what_is_shed_is_counted() {
    let server = small().await;
    let client = rest();
    let waiting = [(); 2]
        .map(|()| tokio::spawn(ask(&client, Method::GET, server.url("/v1/plans"), "wait").send()));
    server.entered(2).await;
    assert!(!is_served(&server, &READ).await);
    assert_eq!(
        server.metric("shed_total{class=\"read\",reason=\"slots\"}"),
        Some(2.0)
    );
    assert_eq!(
        server.metric("refusals_total{code=\"overloaded\"}"),
        Some(2.0)
    );
    assert_eq!(server.metric("in_flight{class=\"read\"}"), Some(2.0));
    let shed = "requests_total{operation=\"list_plans\",dialect=\"rest\",status=\"503\"}";
    assert_eq!(server.metric(shed), Some(1.0));
    let shed = "requests_total{operation=\"list_plans\",dialect=\"grpc\",status=\"8\"}";
    assert_eq!(server.metric(shed), Some(1.0));
    server.release(2);
    for request in waiting {
        request.await.expect("no panic").expect("an answer");
    }
}

#[tokio::test]
async fn streams_keep_their_places_until_they_end() {
    let server = small().await;
    let open = || async {
        ask(&rest(), Method::GET, server.url("/v1/events"), "stream")
            .send()
            .await
            .expect("an answer")
    };
    let first = open().await;
    let _second = open().await;
    let refused = open().await;
    assert_eq!(refused.status(), 429);
    assert_eq!(code(refused).await, "limit_reached");
    let refused = call(&h2(), &server, "/skyway.v1.Airspace/WatchEvents", "stream")
        .send()
        .await
        .expect("an answer");
    assert_eq!(grpc_refusal(&refused), (8, "limit_reached".to_owned()));

    drop(first);
    // The server sees the close a moment later.
    for _ in 0..1000 {
        if open().await.status() == 200 {
            return;
        }
    }
    panic!("the place of a stream that ended stays taken");
}

#[tokio::test]
async fn one_caller_leaves_half_of_a_class_to_others() {
    let slots = Slots {
        reads: 4,
        ..Slots::default()
    };
    let server = Options {
        slots,
        ..Options::with_tokens()
    };
    let server = server.start().await;
    let client = rest();
    let read = |token: &str, mode: &str| {
        ask(&client, Method::GET, server.url("/v1/plans"), mode)
            .bearer_auth(token)
            .send()
    };
    let waiting = [(); 2].map(|()| tokio::spawn(read("drone", "wait")));
    server.entered(2).await;
    let third = read("drone", "").await.expect("an answer");
    assert_eq!(third.status(), 429);
    assert_eq!(code(third).await, "limit_reached");
    let other = read("operator", "").await.expect("an answer");
    assert_eq!(other.status(), 200, "half of the slots is left to others");
    assert_eq!(
        server.metric("shed_total{class=\"read\",reason=\"subject\"}"),
        Some(1.0)
    );

    server.release(2);
    for request in waiting {
        request.await.expect("no panic").expect("an answer");
    }
    let again = read("drone", "").await.expect("an answer");
    assert_eq!(again.status(), 200);
}
