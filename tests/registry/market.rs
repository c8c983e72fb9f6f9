//! The directory of the market over HTTP: providers, drones, services, customers; and what is kept of each.

use crate::drafts::NETWORK;
use crate::harness::{Place, Served, Told};
use serde_json::{Value, json};
use skyway::registry::Settings;
use skyway::registry::documents::{Commit, Committed, Document, DocumentKind, DocumentQuery};
use skyway::registry::store::{KeptReply, ReplyKey};
/// The time of the registry.
pub(crate) const NOW_MS: i64 = 1_795_802_400_000;

pub(crate) async fn served(place: &Place) -> Served {
    Served::with_network(place, Settings::default()).await
}

pub(crate) async fn put(served: &Served, path: &str, etag: Option<&str>, body: &Value) -> Told {
    let headers: Vec<(&str, &str)> = etag.map(|etag| ("if-match", etag)).into_iter().collect();
    let line = format!("PUT {path}");
    served.ask(&line, &headers, &body.to_string()).await
}

async fn delete(served: &Served, path: &str, etag: &str) -> Told {
    let line = format!("DELETE {path}");
    served.ask(&line, &[("if-match", etag)], "").await
}

pub(crate) fn drone() -> Value {
    json!({"network": NETWORK, "home": "a", "payload_max_kg": 2.0})
}

fn service() -> Value {
    json!({
        "name": "Express", "network": NETWORK, "payload_max_kg": 2.0, "time_zone": "Australia/Sydney",
        "hours": [{"days": ["MON"], "from": "07:00", "until": "21:00"}],
        "tariff": {"currency": "AUD", "base": "4.50", "per_km": "1.20"},
        "area": {"type": "Polygon", "coordinates": [[[0, 0], [90, 0], [90, 90], [0, 90], [0, 0]]]},
    })
}

pub(crate) async fn delivery(served: &Served, id: &str, state: &str, body: Value) {
    let mut kept = json!({
        "id": id, "customer": "shop", "provider": "acme", "service_id": "acme:express", "network": NETWORK,
        "source": "a", "destination": "b", "payload_kg": 1.0, "status": state, "created_at": "2026-11-27T17:00:00Z",
        "start_time": "2026-11-27T17:00:00Z", "history": [], "recompositions": [],
    });
    for (name, value) in body.as_object().expect("members") {
        kept[name] = value.clone();
    }
    let document = |kind, body: &Value| Document {
        kind,
        id: id.to_owned(),
        tenant: "shop".to_owned(),
        party: "acme".to_owned(),
        state: state.to_owned(),
        version: 7,
        changed_ms: NOW_MS,
        body: body.to_string(),
    };
    let commit = Commit {
        puts: vec![
            document(DocumentKind::Delivery, &kept),
            document(DocumentKind::Recipient, &json!({"name": "Ada"})),
        ],
        ..Commit::default()
    };
    let committed = served.registry.documents().commit(&commit).await;
    assert_eq!(committed, Ok(Committed::Done));
}

#[tokio::test]
async fn what_tenants_put_has_versions() {
    let place = Place::new();
    let served = served(&place).await;
    for (path, body) in [
        (
            "/v1/providers/acme",
            json!({"name": "Acme", "contact": "a@acme.example"}),
        ),
        ("/v1/drones/acme:7", drone()),
        ("/v1/services/acme:express", service()),
        ("/v1/customers/shop", json!({"name": "Shop"})),
    ] {
        let made = put(&served, path, None, &body).await.is(201);
        let id = path.rsplit('/').next().expect("an id");
        assert_eq!(made.json()["id"], id);
        let location = format!("{}{}", path.trim_end_matches(id), id.replace(':', "%3A"));
        assert_eq!(made.header("location"), location);
        let read = served.ask(&format!("GET {path}"), &[], "").await.is(200);
        assert_eq!((read.json(), read.etag()), (made.json(), made.etag()));
        let unseen = put(&served, path, None, &body).await;
        unseen.refuses(428, "precondition_required");
        let stale = put(&served, path, Some("\"1-1\""), &body).await;
        assert_eq!(
            stale.refuses(412, "precondition_failed").etag(),
            made.etag()
        );
        let changed = put(&served, path, Some(&made.etag()), &body).await.is(200);
        assert_ne!(changed.etag(), made.etag());
        let known = [("if-none-match", changed.etag())];
        let known: Vec<(&str, &str)> = known.iter().map(|(name, tag)| (*name, &**tag)).collect();
        served.ask(&format!("GET {path}"), &known, "").await.is(304);
        let gone = served.ask(&format!("GET {path}x"), &[], "").await;
        gone.refuses(404, "not_found");
    }
    let provider = served.ask("GET /v1/providers/acme", &[], "").await.etag();
    delete(&served, "/v1/providers/acme", &provider)
        .await
        .refuses(409, "in_use");
    for path in ["/v1/drones/acme:7", "/v1/services/acme:express"] {
        delete(&served, path, "*").await.is(204);
        served
            .ask(&format!("GET {path}"), &[], "")
            .await
            .refuses(404, "not_found");
    }
    delete(&served, "/v1/providers/acme", &provider)
        .await
        .is(204);
    served.end().await;
}

/// What is wrong with a body: where it is put, the body, the place of the fault, and its code.
type Wrong = (&'static str, Value, &'static str, &'static str);

fn with(mut body: Value, name: &str, value: Value) -> Value {
    body[name] = value;
    body
}

async fn are_refused(wrong: Vec<Wrong>) {
    let place = Place::new();
    let served = served(&place).await;
    for (path, body, pointer, code) in wrong {
        let path = path.replace(' ', "%20");
        let told = put(&served, &path, None, &body).await.is(400);
        let fault = &told.json()["errors"][0];
        let found = (&fault["pointer"], &fault["code"]);
        assert_eq!(found, (&json!(pointer), &json!(code)), "{}", told.body);
    }
    served.end().await;
}

#[tokio::test]
async fn what_no_provider_and_no_drone_can_be_is_refused_with_its_place() {
    let (provider, id) = ("/v1/providers/acme", "/v1/drones/acme:7");
    let drone_with = |name, value| with(drone(), name, value);
    are_refused(vec![
        (
            "/v1/providers/a b",
            json!({"name": "A"}),
            "{id}",
            "id_invalid",
        ),
        (provider, json!({"name": " "}), "/name", "text_empty"),
        (
            provider,
            json!({"name": "A", "id": "other"}),
            "/id",
            "id_mismatch",
        ),
        ("/v1/drones/7", drone(), "{id}", "id_invalid"),
        (
            id,
            drone_with("network", json!("mars")),
            "/network",
            "unknown_network",
        ),
        (id, drone_with("home", json!("z")), "/home", "unknown_node"),
        (
            id,
            drone_with("payload_max_kg", json!(0)),
            "/payload_max_kg",
            "out_of_range",
        ),
        (
            id,
            drone_with("battery_health_fraction", json!(90)),
            "/battery_health_fraction",
            "out_of_range",
        ),
        (
            id,
            drone_with("maintenance_until", json!("soon")),
            "/maintenance_until",
            "time_invalid",
        ),
        (
            id,
            drone_with("state", json!("in_flight")),
            "/state",
            "state_read_only",
        ),
    ])
    .await;
}

#[tokio::test]
async fn what_no_service_can_be_is_refused_with_its_place() {
    let id = "/v1/services/acme:x";
    let service_with = |name, value| with(service(), name, value);
    let tariff_with = |name, value| {
        let tariff = with(service()["tariff"].clone(), name, value);
        service_with("tariff", tariff)
    };
    let on_no_day = json!([{"days": ["X"], "from": "07:00", "until": "08:00"}]);
    let point = json!({"type": "Point", "coordinates": [0, 0]});
    let percent = json!({"on_time_fraction": 95});
    are_refused(vec![
        (
            id,
            tariff_with("currency", json!("euro")),
            "/tariff/currency",
            "currency_invalid",
        ),
        (
            id,
            tariff_with("per_km", json!("-1")),
            "/tariff/per_km",
            "out_of_range",
        ),
        (
            id,
            service_with("time_zone", json!("Mars/Base")),
            "/time_zone",
            "time_zone_unknown",
        ),
        (
            id,
            service_with("hours", on_no_day),
            "/hours/0/days",
            "day_unknown",
        ),
        (id, service_with("area", point), "/area", "area_invalid"),
        (
            id,
            service_with("provider", json!("other")),
            "/provider",
            "id_mismatch",
        ),
        (
            id,
            service_with("quality", percent),
            "/quality/on_time_fraction",
            "out_of_range",
        ),
        (
            id,
            service_with("valid_until", json!("never")),
            "/valid_until",
            "time_invalid",
        ),
    ])
    .await;
}

#[tokio::test]
async fn what_an_open_delivery_needs_stays() {
    let place = Place::new();
    let served = served(&place).await;
    let flying = json!({"network": NETWORK, "home": "a", "payload_max_kg": 2.0, "state": "assigned", "delivery_id": "d1"});
    let document = Document {
        kind: DocumentKind::Drone,
        id: "acme:7".to_owned(),
        tenant: "acme".to_owned(),
        party: String::new(),
        state: "assigned".to_owned(),
        version: 1,
        changed_ms: NOW_MS,
        body: flying.to_string(),
    };
    let commit = Commit {
        puts: vec![document],
        ..Commit::default()
    };
    let committed = served.registry.documents().commit(&commit).await;
    assert_eq!(committed, Ok(Committed::Done));
    put(&served, "/v1/services/acme:express", None, &service())
        .await
        .is(201);
    put(
        &served,
        "/v1/customers/shop",
        None,
        &json!({"name": "Shop"}),
    )
    .await
    .is(201);
    delivery(&served, "d1", "in_flight", json!({})).await;
    delete(&served, "/v1/drones/acme:7", "*")
        .await
        .refuses(409, "in_use");
    delete(&served, "/v1/services/acme:express", "*")
        .await
        .refuses(409, "in_use");
    let out =
        json!({"network": NETWORK, "home": "a", "payload_max_kg": 2.0, "state": "out_of_service"});
    put(&served, "/v1/drones/acme:7", Some("*"), &out)
        .await
        .refuses(409, "in_use");
    let mut lighter = drone();
    lighter["payload_max_kg"] = json!(1.0);
    let kept = put(&served, "/v1/drones/acme:7", Some("*"), &lighter)
        .await
        .is(200)
        .json();
    assert_eq!(kept["state"], "assigned");
    assert_eq!(kept["delivery_id"], "d1");
    assert_eq!(kept["payload_max_kg"], 1.0);
    served
        .ask("DELETE /v1/customers/shop/data", &[], "")
        .await
        .refuses(409, "in_use");
    served.end().await;
}

#[tokio::test]
async fn data_are_deleted_in_the_version_of_the_customer_that_is_named() {
    let place = Place::new();
    let served = served(&place).await;
    let (customer, data) = ("/v1/customers/shop", "/v1/customers/shop/data");
    let stale = delete(&served, data, "\"1-1\"").await;
    stale.refuses(412, "precondition_failed");
    let made = put(&served, customer, None, &json!({"name": "Shop"})).await;
    let stale = delete(&served, data, "\"1-1\"").await;
    assert_eq!(
        stale.refuses(412, "precondition_failed").etag(),
        made.etag()
    );
    delete(&served, data, &made.etag()).await.is(204);
    let gone = delete(&served, data, &made.etag()).await;
    gone.refuses(412, "precondition_failed");
    served.ask(&format!("DELETE {data}"), &[], "").await.is(204);
    served.end().await;
}

async fn keep_quote(served: &Served, id: &str, tenant: &str, party: &str) {
    let quote = Document {
        kind: DocumentKind::Quote,
        id: id.to_owned(),
        tenant: tenant.to_owned(),
        party: party.to_owned(),
        state: String::new(),
        version: 1,
        changed_ms: NOW_MS,
        body: json!({
            "id": id, "customer": tenant, "provider": party, "network": NETWORK, "edge": "e",
            "request": {"service_id": "acme:express", "source": "a", "destination": "b", "payload_kg": 0.5},
            "price": {"amount": "7.50", "currency": "AUD"}, "length_m": 900.0,
            "pickup_at": "2026-11-27T17:30:00Z", "arrives_at": "2026-11-27T17:40:00Z",
            "expires_at": "2026-11-27T17:35:00Z",
        })
        .to_string(),
    };
    let commit = Commit {
        puts: vec![quote],
        ..Commit::default()
    };
    let committed = served.registry.documents().commit(&commit).await;
    assert_eq!(committed, Ok(Committed::Done));
}

/// Keeps what the order of a delivery was answered.
async fn keep_answer(served: &Served, id: &str) {
    let key = ReplyKey {
        subject: "shop/desk".to_owned(),
        key: "basket".to_owned(),
        fingerprint: "f".to_owned(),
        at_ms: NOW_MS,
    };
    let reply = KeptReply {
        created: true,
        etag: None,
        id: id.to_owned(),
        body: json!({"id": id, "reference": "order of Ada"}).to_string(),
    };
    let commit = Commit {
        reply: Some((key, reply)),
        ..Commit::default()
    };
    let committed = served.registry.documents().commit(&commit).await;
    assert_eq!(committed, Ok(Committed::Done));
}

#[tokio::test]
async fn what_is_kept_of_a_customer_is_told_and_deleted() {
    let place = Place::new();
    let served = served(&place).await;
    put(
        &served,
        "/v1/customers/shop",
        None,
        &json!({"name": "Shop"}),
    )
    .await
    .is(201);
    let over = json!({
        "reference": "order of Ada", "price": {"amount": "7.50", "currency": "AUD"},
        "proof": {"at": "2026-11-27T17:30:00Z", "photo": "ada.jpg", "code": "1234"},
    });
    delivery(&served, "d1", "delivered", over).await;
    keep_answer(&served, "d1").await;
    // Its own, and one for another customer of a provider with its id.
    let quotes = [("q1", "shop", "acme"), ("q2", "baker", "shop")];
    for (id, tenant, party) in quotes {
        keep_quote(&served, id, tenant, party).await;
    }
    let told = served
        .ask("GET /v1/customers/shop/data", &[], "")
        .await
        .is(200)
        .json();
    assert_eq!(told["customer"]["name"], "Shop");
    assert_eq!(told["deliveries"][0]["recipient"]["name"], "Ada");
    assert_eq!(told["deliveries"][0]["proof"]["code"], "1234");
    assert_eq!(told["quotes"].as_array().expect("quotes").len(), 1);
    assert_eq!(told["quotes"][0]["id"], "q1");
    assert_eq!(
        (&told["webhooks"], &told["is_cut_off"]),
        (&json!([]), &json!(false))
    );
    served
        .ask("DELETE /v1/customers/shop/data", &[], "")
        .await
        .is(204);
    served
        .ask("GET /v1/customers/shop", &[], "")
        .await
        .refuses(404, "not_found");
    let told = served
        .ask("GET /v1/customers/shop/data", &[], "")
        .await
        .is(200);
    for personal in ["Ada", "ada.jpg", "1234", "Shop"] {
        assert!(!told.body.contains(personal), "{}", told.body);
    }
    let left = &told.json()["deliveries"][0];
    assert_eq!(left["price"]["amount"], "7.50", "accounts are kept");
    let documents = served.registry.documents();
    let answered = documents.kept_reply("shop/desk", "basket").await;
    assert_eq!(answered, Ok(None));
    for (id, tenant, _) in quotes {
        let quote = documents.document(DocumentKind::Quote, id).await;
        assert_eq!(quote.expect("a store").is_some(), tenant != "shop", "{id}");
    }
    assert_eq!(left["proof"]["at"], "2026-11-27T17:30:00Z");
    let recipients = DocumentQuery {
        kind: DocumentKind::Recipient,
        of: None,
        states: Vec::new(),
        after: None,
        limit: 9,
        is_newest_first: false,
    };
    let found = served.registry.documents().documents(&recipients).await;
    assert_eq!(found, Ok(Vec::new()));
    served.end().await;
}
