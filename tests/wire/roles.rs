//! Who may do what: every operation, role and dialect through the gate, against a list written down here.

use crate::harness::{
    Options, Server, WAIT_AT_MOST, ask, call, code, grpc_refusal, h2, rest, role_of,
};
use skyway::api::operations::{Daemon, Listener, Row, TABLE};
use skyway::api::server::KnownTokens;
use std::sync::{Arc, Mutex};
use std::time::Duration;
use tokio::sync::watch;

const ROLES: [&str; 6] = [
    "drone", "operator", "edge", "metrics", "provider", "customer",
];

/// What each role may do besides what needs no token.
fn may(role: &str) -> Vec<&'static str> {
    let drone = "report_failure report_failures list_recompositions get_recomposition create_plan list_plans get_plan get_pack \
                 cancel_plan acknowledge_plan decline_plan complete_plan post_telemetry \
                 drone_session watch_mail receive_mail";
    let airspace = "get_zone list_zones list_closures get_closure get_weather get_network get_node nearest get_clock list_failure_rates list_keys list_revoked_keys";
    let operator = "release_plan create_zone put_zone delete_zone preview_zone import_zones create_closure change_closure delete_closure \
                    list_proposals decide_proposal list_alarms acknowledge_alarm list_holds decide_hold advance_clock confirm_clock put_weather list_drones \
                    watch_events";
    let own_flights = "list_recompositions get_recomposition list_plans get_plan";
    let seen_airspace = "get_zone list_zones list_closures get_closure get_weather get_network get_node nearest get_clock list_failure_rates";
    let map = "registry_list_networks registry_get_network registry_get_clock";
    let follower = "registry_follow registry_snapshot registry_list_zones \
                    registry_create_zone registry_get_zone registry_put_zone registry_delete_zone \
                    registry_list_closures registry_create_closure registry_get_closure registry_put_closure \
                    registry_delete_closure registry_get_weather";
    let keeper = "registry_put_network registry_patch_network registry_put_weather registry_list_edges revoke_key";
    let admin = "metrics status";
    let told = "take_news take_positions registry_report_edge";
    let enroller = "put_provider delete_provider list_fleet_drones get_fleet_drone list_positions";
    let provider = "put_fleet_drone delete_fleet_drone put_service delete_service prove_delivery";
    let customer = "search_services create_quote create_delivery cancel_delivery get_customer put_customer get_customer_data \
                    delete_customer_data";
    let party = "list_providers get_provider list_deliveries get_delivery track_delivery";
    let tenant = "list_services get_service get_quote list_webhooks get_webhook put_webhook delete_webhook rotate_webhook \
                  list_messages resend_message";
    let lists = match role {
        "drone" => vec![drone, airspace],
        "operator" => vec![
            drone,
            airspace,
            operator,
            map,
            follower,
            keeper,
            admin,
            enroller,
            party,
            "get_statistics",
        ],
        "edge" => vec![
            airspace,
            "watch_events",
            map,
            follower,
            told,
            "get_statistics",
        ],
        "provider" => vec![
            own_flights,
            seen_airspace,
            map,
            enroller,
            provider,
            party,
            tenant,
            "get_statistics",
        ],
        "customer" => vec![map, customer, party, tenant],
        "metrics" => vec![admin],
        other => panic!("no role '{other}'"),
    };
    lists.into_iter().flat_map(str::split_whitespace).collect()
}

const NEEDS_NO_TOKEN: &str =
    "live ready health_check health_watch reflection reflection_alpha openapi docs page";

fn expected(row: &Row, token: Option<&str>) -> u16 {
    let is_open = NEEDS_NO_TOKEN.split(' ').any(|name| name == row.name);
    match token {
        _ if is_open => 200,
        Some(role) if ROLES.contains(&role) && may(role).contains(&row.name) => 200,
        Some(role) if ROLES.contains(&role) => 403,
        _ => 401,
    }
}

async fn rest_status(
    server: &Server,
    client: &reqwest::Client,
    row: &Row,
    token: Option<&str>,
) -> Vec<u16> {
    let mut found = Vec::new();
    for (method, path) in row.rest {
        let path = path
            .replace("{network}", "n")
            .replace("{id}", "7")
            .replace("{message}", "7")
            .replace("{*file}", "a.js");
        let mut request = ask(client, method.clone(), server.url(&path), "");
        if let Some(token) = token {
            request = request.header("authorization", format!("Bearer {token}"));
        }
        let response = request.send().await.expect("an answer");
        let status = response.status().as_u16();
        match status {
            200 => assert!(
                response.text().await.expect("a body").starts_with(row.name),
                "{path}"
            ),
            401 => assert_eq!(code(response).await, "unauthenticated"),
            403 => assert_eq!(code(response).await, "forbidden"),
            _ => {}
        }
        found.push(status);
    }
    found
}

async fn grpc_status(
    server: &Server,
    client: &reqwest::Client,
    row: &Row,
    token: Option<&str>,
) -> Option<u16> {
    let mut request = call(client, server, row.grpc?, "");
    if let Some(token) = token {
        request = request.header("authorization", format!("bearer {token}"));
    }
    let response = request.send().await.expect("an answer");
    if !response.headers().contains_key("grpc-status") {
        assert!(
            response.text().await.expect("a body").starts_with(row.name),
            "{}",
            row.name
        );
        return Some(200);
    }
    match grpc_refusal(&response) {
        (16, code) if code == "unauthenticated" => Some(401),
        (7, code) if code == "forbidden" => Some(403),
        other => panic!("{}: {other:?}", row.name),
    }
}

#[tokio::test]
async fn every_operation_is_allowed_or_refused_as_the_list_says() {
    let (rest, h2) = (rest(), h2());
    let mut checked = 0;
    for daemon in [Daemon::Edge, Daemon::Registry] {
        let options = || Options {
            daemon,
            ..Options::with_tokens()
        };
        let main = options().start().await;
        let admin = Options {
            listener: Listener::Admin,
            ..options()
        };
        let admin = admin.start().await;
        for row in TABLE.iter().filter(|row| row.operation.is_of(daemon)) {
            let server = match row.listener {
                Some(Listener::Admin) => &admin,
                _ => &main,
            };
            let tokens = ROLES
                .map(Some)
                .into_iter()
                .chain([None, Some("anyone"), Some("")]);
            for token in tokens {
                let wanted = expected(row, token);
                for status in rest_status(server, &rest, row, token).await {
                    assert_eq!(status, wanted, "{} as {token:?} over REST", row.name);
                    checked += 1;
                }
                if let Some(status) = grpc_status(server, &h2, row, token).await {
                    assert_eq!(status, wanted, "{} as {token:?} over gRPC", row.name);
                    checked += 1;
                }
            }
        }
    }
    assert!(checked > 500, "only {checked} were checked");
}

#[tokio::test]
async fn without_tokens_anyone_may_do_everything() {
    let main = Options::default().start().await;
    let (rest, h2) = (rest(), h2());
    for row in TABLE
        .iter()
        .filter(|row| row.operation.is_of(Daemon::Edge))
        .filter(|row| row.listener != Some(Listener::Admin))
    {
        let statuses = rest_status(&main, &rest, row, None).await;
        assert!(statuses.iter().all(|status| *status == 200), "{}", row.name);
        assert_ne!(
            grpc_status(&main, &h2, row, None).await,
            Some(401),
            "{}",
            row.name
        );
    }
}

#[tokio::test]
async fn the_admin_listener_has_nothing_but_its_own() {
    let options = Options {
        listener: Listener::Admin,
        ..Options::default()
    };
    let admin = options.start().await;
    for row in TABLE {
        let is_here = row.operation.is_of(Daemon::Edge) && row.listener != Some(Listener::Main);
        for status in rest_status(&admin, &rest(), row, None).await {
            assert_eq!(status == 200, is_here, "{}", row.name);
        }
    }
}

#[tokio::test]
async fn two_tokens_in_one_request_are_none() {
    let main = Options::with_tokens().start().await;
    let row = TABLE.iter().find(|row| row.name == "list_zones");
    let (method, path) = &row.expect("a row").rest[0];
    for tokens in [
        ["operator", "drone"],
        ["operator", "operator"],
        ["nobody", "operator"],
    ] {
        let mut request = ask(&rest(), method.clone(), main.url(path), "");
        for token in tokens {
            request = request.header("authorization", format!("Bearer {token}"));
        }
        let response = request.send().await.expect("an answer");
        assert_eq!(response.status().as_u16(), 401, "{tokens:?}");
        let problem = response.text().await.expect("a body");
        assert!(
            problem.contains("more than one Authorization header"),
            "{problem}"
        );
        assert!(problem.contains("send one"), "{problem}");
    }
}

#[tokio::test]
async fn a_stream_ends_with_its_token_and_no_other_one_does() {
    let revoked: Arc<Mutex<Option<&str>>> = Arc::default();
    let (changed, changes) = watch::channel(0);
    let counts = revoked.clone();
    let find = move |token: &str| {
        let revoked = *counts.lock().expect("not poisoned");
        role_of(token).filter(|_| revoked != Some(token))
    };
    let tokens = KnownTokens {
        find: Arc::new(find),
        changed: changes,
    };
    let server = Options::with(tokens).start().await;
    let client = h2();
    let mut streams = Vec::new();
    for (path, token) in [
        ("/skyway.v1.Drones/Session", "drone"),
        ("/skyway.v1.Drones/Session", "operator"),
    ] {
        let call = call(&client, &server, path, "stream").bearer_auth(token);
        streams.push(call.send().await.expect("a stream"));
    }
    let rest = ask(
        &rest(),
        http::Method::GET,
        server.url("/v1/drones/d/events"),
        "stream",
    );
    let events = rest.bearer_auth("drone").send().await.expect("a stream");
    // Something else has changed: all go on.
    changed.send_replace(1);
    assert!(
        tokio::time::timeout(Duration::from_millis(50), streams[0].chunk())
            .await
            .is_err()
    );

    *revoked.lock().expect("not poisoned") = Some("drone");
    changed.send_replace(2);
    let ended = tokio::time::timeout(WAIT_AT_MOST, streams[0].chunk()).await;
    assert_eq!(ended.expect("in time").expect("an end"), None);
    let ended = tokio::time::timeout(WAIT_AT_MOST, events.bytes()).await;
    assert!(ended.expect("in time").expect("an end").is_empty());
    assert!(
        tokio::time::timeout(Duration::from_millis(50), streams[1].chunk())
            .await
            .is_err()
    );
}
