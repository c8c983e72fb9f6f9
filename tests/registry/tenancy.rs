//! No one reads or changes another tenant's things: every operation of the market, asked by everyone about what is not
//! theirs, as the table of operations has them.

use crate::drafts::NETWORK;
use crate::harness::{Place, Served, Told};
use http::Method;
use serde_json::{Value, json};
use skyway::access::Role;
use skyway::api::operations::{Class, Daemon, TABLE};
use skyway::registry::Settings;
use skyway::registry::documents::{
    Commit, Committed, Document, DocumentKind, DocumentQuery, Documents, Message, PositionRow,
};

/// Whose things are asked for.
const OWNERS: [&str; 2] = ["acme", "shop"];
/// Paths of the market begin so.
const MARKET: [&str; 7] = [
    "/v1/providers",
    "/v1/drones",
    "/v1/services",
    "/v1/quotes",
    "/v1/deliveries",
    "/v1/webhooks",
    "/v1/customers",
];
const NOW_MS: i64 = 1_795_802_400_000;

#[tokio::test]
async fn an_edge_that_is_kept_to_a_network_speaks_of_no_other() {
    let place = Place::new();
    let mut served = Served::with_network(&place, Settings::default()).await;
    served.post_zone("z").await;
    served.ask_only_with_tokens().await;
    let bearer = |token: &str| format!("Bearer {token}");
    let own = bearer(&format!("edge/local@{NETWORK}"));
    let others = bearer("edge/local@elsewhere");
    let zone = |network: &str| format!("/v1/networks/{network}/zones/z");
    let report = format!("/v1/networks/{NETWORK}/edges/local%2Fdesk");
    let told = json!({"epoch": 1, "revision": 1}).to_string();
    for (line, body) in [
        (format!("DELETE {}", zone(NETWORK)), ""),
        (format!("GET /v1/networks/{NETWORK}/snapshot"), ""),
        (format!("PUT {report}"), &*told),
    ] {
        let headers = [("authorization", &*others), ("if-match", "*")];
        let refused = served.ask(&line, &headers, body).await;
        refused.refuses(403, "forbidden");
    }
    for (token, listed) in [(&own, 1), (&others, 0)] {
        let headers = [("authorization", &**token)];
        let told = served.ask("GET /v1/networks", &headers, "").await.is(200);
        let networks = told.json()["networks"].as_array().map(Vec::len);
        assert_eq!(networks, Some(listed), "{token}: {}", told.body);
    }
    let headers = [("authorization", &*own), ("if-match", "*")];
    let lifted = format!("DELETE {}", zone(NETWORK));
    served.ask(&lifted, &headers, "").await.is(200);
    served.end().await;
}

#[tokio::test]
async fn an_edge_that_is_kept_to_a_network_places_no_drone_of_another() {
    let place = Place::new();
    let mut served = Served::with_network(&place, Settings::default()).await;
    let mut things = things();
    things.retain(|thing| thing.kind == DocumentKind::Drone);
    let mut elsewhere = things[0].clone();
    elsewhere.id = "acme:8".to_owned();
    elsewhere.body = elsewhere.body.replace(NETWORK, "elsewhere");
    things.push(elsewhere);
    let commit = Commit {
        puts: things,
        ..Commit::default()
    };
    let committed = served.registry.documents().commit(&commit).await;
    assert_eq!(committed, Ok(Committed::Done));
    served.ask_only_with_tokens().await;
    let line = format!("POST /v1/networks/{NETWORK}/edges/local%2Fdesk/positions");
    let entry =
        |drone: &str| json!({"drone_id": drone, "at_ms": NOW_MS - 1000, "lon": 1, "lat": 2});
    let batch = json!({"positions": [entry("acme:7"), entry("acme:8"), entry("unknown")]});
    for (token, stored) in [
        (format!("edge/local@{NETWORK}"), 2),
        ("edge/local".to_owned(), 1),
    ] {
        let token = format!("Bearer {token}");
        let headers = [("authorization", &*token)];
        let told = served
            .ask(&line, &headers, &batch.to_string())
            .await
            .is(200);
        assert_eq!(told.json()["stored"], stored, "{token}");
    }
    served.end().await;
}

fn tariff() -> Value {
    json!({"currency": "AUD", "base": "7771.77"})
}

fn drone() -> Value {
    json!({"network": NETWORK, "home": "a", "payload_max_kg": 2.0, "airframe": "SECRET-drone"})
}

fn service() -> Value {
    json!({
        "id": "acme:express", "provider": "acme", "name": "OFFERED-service", "network": NETWORK, "payload_max_kg": 2.0,
        "time_zone": "UTC", "tariff": tariff(),
    })
}

fn delivery() -> Value {
    json!({
        "id": "d1", "customer": "shop", "provider": "acme", "service_id": "acme:express", "reference": "SECRET-delivery",
        "network": NETWORK, "source": "a", "destination": "b", "payload_kg": 1.0, "status": "created",
        "created_at": "2026-11-27T18:00:00Z", "start_time": "2026-11-27T18:00:00Z",
        "price": {"amount": "7771.77", "currency": "AUD"}, "history": [], "recompositions": [],
    })
}

fn quote() -> Value {
    json!({
        "id": "q1", "customer": "shop", "provider": "acme", "network": NETWORK, "edge": "SECRET-quote", "length_m": 1.0,
        "request": {"service_id": "acme:express", "source": "a", "destination": "b", "payload_kg": 1.0},
        "price": {"amount": "7771.77", "currency": "AUD"}, "pickup_at": "2026-11-27T18:00:00Z",
        "arrives_at": "2026-11-27T18:10:00Z", "expires_at": "2026-11-27T18:05:00Z",
    })
}

/// One thing of each kind.
fn things() -> Vec<Document> {
    let webhook = json!({
        "url": "https://SECRET-webhook.example", "events": [], "state": "active",
        "secret": "whsec_MfKQ9r8GKYqrTwjUPD8ILPZIo2LaLaSw",
    });
    let all = [
        (
            DocumentKind::Provider,
            "acme",
            "acme",
            "",
            json!({"name": "OFFERED-provider", "contact": "SECRET-contact"}),
        ),
        (DocumentKind::Drone, "acme:7", "acme", "available", drone()),
        (DocumentKind::Service, "acme:express", "acme", "", service()),
        (
            DocumentKind::Customer,
            "shop",
            "shop",
            "",
            json!({"name": "SECRET-customer"}),
        ),
        (DocumentKind::Quote, "q1", "shop", "", quote()),
        (DocumentKind::Delivery, "d1", "shop", "created", delivery()),
        (
            DocumentKind::Recipient,
            "d1",
            "shop",
            "",
            json!({"name": "SECRET-recipient"}),
        ),
        (
            DocumentKind::Webhook,
            "shop:main",
            "shop",
            "active",
            webhook,
        ),
    ];
    let document =
        |(kind, id, tenant, state, body): (DocumentKind, &str, &str, &str, Value)| Document {
            kind,
            id: id.to_owned(),
            tenant: tenant.to_owned(),
            party: match kind {
                DocumentKind::Quote | DocumentKind::Delivery => "acme".to_owned(),
                _ => String::new(),
            },
            state: state.to_owned(),
            version: 1,
            changed_ms: NOW_MS,
            body: body.to_string(),
        };
    all.map(document).to_vec()
}

async fn fill(documents: &dyn Documents) {
    let message = Message {
        id: "m1".to_owned(),
        webhook: "shop:main".to_owned(),
        subject: "d1".to_owned(),
        number: 1,
        event: "delivery.SECRET-message".to_owned(),
        body: "{}".to_owned(),
        created_ms: NOW_MS,
        // Nothing is sent in this test.
        due_ms: i64::MAX,
        attempts: 0,
        state: "pending".to_owned(),
        last_outcome: None,
    };
    let commit = Commit {
        puts: things(),
        messages: vec![message],
        ..Commit::default()
    };
    let committed = documents.commit(&commit).await.expect("answers");
    assert_eq!(committed, Committed::Done);
    let position = PositionRow {
        drone: "acme:7".to_owned(),
        at_ms: NOW_MS - 1000,
        lon: 77.5,
        lat: 1.0,
        altitude_m: None,
        battery_fraction: None,
        speed_mps: None,
    };
    let kept = documents.keep_positions(&[position]).await;
    assert_eq!(kept, Ok(1));
}

/// All that is kept of the owners, and that names them as parties.
async fn kept(documents: &dyn Documents) -> (Vec<Document>, Option<Message>) {
    let mut all = Vec::new();
    for kind in DocumentKind::ALL {
        for owner in OWNERS {
            let query = DocumentQuery {
                kind,
                of: Some(owner.to_owned()),
                states: Vec::new(),
                after: None,
                limit: 100,
                is_newest_first: false,
            };
            all.extend(documents.documents(&query).await.expect("answers"));
        }
    }
    (all, documents.message("m1").await.expect("answers"))
}

/// The path of the owners' thing.
fn filled(path: &str) -> String {
    let id = match path {
        path if path.starts_with("/v1/providers") => "acme",
        path if path.starts_with("/v1/drones") => "acme:7",
        path if path.starts_with("/v1/services") => "acme:express",
        path if path.starts_with("/v1/quotes") => "q1",
        path if path.starts_with("/v1/webhooks") => "shop:main",
        path if path.starts_with("/v1/customers") => "shop",
        _ => "d1",
    };
    path.replace("{id}", id).replace("{message}", "m1")
}

/// What would change or make something of the owners, were it let.
fn body(method: &Method, path: &str) -> Value {
    match (method.as_str(), path) {
        ("PUT", "/v1/providers/{id}" | "/v1/customers/{id}") => json!({"name": "changed"}),
        ("PUT", "/v1/drones/{id}") => drone(),
        ("PUT", "/v1/services/{id}") => service(),
        ("PUT", "/v1/webhooks/{id}") => json!({"url": "https://example.com/changed"}),
        ("POST", "/v1/deliveries") => json!({"quote_id": "q1", "customer": "shop"}),
        ("POST", "/v1/deliveries/{id}/proof") => {
            json!({"at": "2026-11-27T18:10:00Z", "code": "changed"})
        }
        ("POST", "/v1/quotes") => {
            json!({"service_id": "acme:express", "source": "a", "destination": "b"})
        }
        ("POST", "/v1/services:search") => {
            json!({"network": NETWORK, "source": "a", "destination": "b"})
        }
        _ => Value::Null,
    }
}

async fn ask(served: &Served, method: &Method, path: &str, token: &str) -> Told {
    let sent = body(method, path);
    let text = match sent.is_null() {
        true => String::new(),
        false => sent.to_string(),
    };
    let token = format!("Bearer {token}");
    // A write that names any version is stopped by nothing but whose the thing is.
    let headers = [("authorization", &*token), ("if-match", "*")];
    let headers = match method.as_str() {
        "GET" | "POST" => &headers[..1],
        _ => &headers[..],
    };
    let line = format!("{method} {}", filled(path));
    served.ask(&line, headers, &text).await
}

#[tokio::test]
async fn nobody_reads_or_changes_what_is_anothers() {
    let place = Place::new();
    let mut served = Served::with_network(&place, Settings::default()).await;
    let documents = served.registry.documents();
    fill(&*documents).await;
    served.ask_only_with_tokens().await;
    let before = kept(&*documents).await;
    let rows = TABLE
        .iter()
        .filter(|row| row.operation.is_of(Daemon::Registry));
    let mut checked = 0;
    for row in rows {
        for (method, path) in row.rest {
            if !MARKET.iter().any(|market| path.starts_with(market)) {
                continue;
            }
            for role in Role::OF_TOKENS {
                // Operators act for all, and look at the flights of all.
                let looks = method == Method::GET && row.class != Class::Stream;
                if role == Role::Operator && !looks {
                    continue;
                }
                let told = ask(&served, method, path, &format!("{}/rival", role.name())).await;
                check(&told, (role, row.name), path, row.operation.allows(role));
                checked += 1;
            }
        }
    }
    assert!(checked > 150, "only {checked}");
    assert_eq!(kept(&*documents).await, before);
    served.end().await;
}

#[track_caller]
fn check(told: &Told, (role, name): (Role, &str), path: &str, may: bool) {
    let what = format!("{name} as {}: {} {}", role.name(), told.status, told.body);
    assert_ne!(told.status, 401, "{what}");
    if !may {
        assert_eq!(told.status, 403, "{what}");
    }
    // Operators see flights, drones and contacts of providers; customers what is offered, which has its tariff.
    let is_offer = path.starts_with("/v1/services") || path.starts_with("/v1/providers");
    let sees_offers = role == Role::Customer && is_offer;
    if role != Role::Operator {
        assert!(!told.body.contains("SECRET"), "{what}");
        if path.contains("{id}") && !sees_offers {
            assert!(told.status >= 400, "{what}");
        }
    }
    if !sees_offers {
        assert!(!told.body.contains("7771.77"), "{what}");
    }
    if role == Role::Provider {
        assert!(!told.body.contains("OFFERED"), "{what}");
    }
    assert!(!told.body.contains("SECRET-recipient"), "{what}");
}

#[tokio::test]
async fn what_an_operator_has_suspended_its_provider_does_not_lift() {
    let place = Place::new();
    let mut served = Served::with_network(&place, Settings::default()).await;
    served.ask_only_with_tokens().await;
    let path = "/v1/providers/acme";
    let steps = [
        ("provider/acme", "PUT", "suspended", 201),
        ("provider/acme", "PUT", "active", 200),
        ("operator/air", "PUT", "suspended", 200),
        ("provider/acme", "PUT", "suspended", 200),
        ("provider/acme", "PUT", "active", 403),
        ("provider/acme", "DELETE", "", 403),
        ("operator/air", "PUT", "active", 200),
        ("provider/acme", "DELETE", "", 204),
    ];
    for (number, (token, method, state, status)) in steps.into_iter().enumerate() {
        let token = format!("Bearer {token}");
        let headers = [("authorization", &*token), ("if-match", "*")];
        let headers = if number == 0 { &headers[..1] } else { &headers };
        let body = json!({"name": "Acme", "state": state}).to_string();
        let body = if method == "PUT" { &*body } else { "" };
        let told = served.ask(&format!("{method} {path}"), headers, body).await;
        assert_eq!(told.status, status, "step {number}: {}", told.body);
    }
    served.end().await;
}

/// What the others are refused for is whose it is, and nothing else.
#[tokio::test]
async fn owners_read_what_is_theirs() {
    let place = Place::new();
    let mut served = Served::with_network(&place, Settings::default()).await;
    fill(&*served.registry.documents()).await;
    served.ask_only_with_tokens().await;
    let owned = [
        ("provider/acme", "/v1/providers/{id}", "SECRET-contact"),
        ("operator/air", "/v1/providers/{id}", "SECRET-contact"),
        ("customer/rival", "/v1/providers/{id}", "OFFERED-provider"),
        ("provider/acme", "/v1/drones/{id}", "SECRET-drone"),
        ("operator/air", "/v1/drones/{id}", "SECRET-drone"),
        ("provider/acme", "/v1/drones/{id}/positions", "77.5"),
        ("provider/acme", "/v1/services/{id}", "7771.77"),
        ("customer/rival", "/v1/services/{id}", "7771.77"),
        ("customer/shop", "/v1/customers/{id}", "SECRET-customer"),
        (
            "customer/shop",
            "/v1/customers/{id}/data",
            "SECRET-recipient",
        ),
    ];
    for (token, path, wanted) in owned {
        let told = ask(&served, &Method::GET, path, token).await.is(200);
        assert!(told.body.contains(wanted), "{token} {path}: {}", told.body);
    }
    let lists = [
        ("provider/acme", "/v1/drones", 1),
        ("provider/rival", "/v1/drones", 0),
        ("operator/air", "/v1/drones", 1),
        ("provider/rival", "/v1/services", 0),
        ("customer/rival", "/v1/services", 1),
        ("provider/rival", "/v1/providers", 0),
        ("customer/shop", "/v1/providers", 1),
    ];
    for (token, path, count) in lists {
        let told = ask(&served, &Method::GET, path, token).await.is(200).json();
        let member = path.trim_start_matches("/v1/");
        let listed = told[member].as_array().map(Vec::len);
        assert_eq!(listed, Some(count), "{token} {path}: {told}");
    }
    served.end().await;
}
