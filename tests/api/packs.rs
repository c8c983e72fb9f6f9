//! Packs and keys over HTTP: their media type, entity tags, and how they are refused.

use crate::harness::Api;
use serde_json::json;
use skyway::pack::Pack;

async fn with_plan() -> Api {
    let api = Api::start().await;
    let plan = json!({"id": "p1", "source": "379", "destination": "450", "drone_id": "d1"});
    api.post("/v1/plans", &plan).await.is(201);
    api.settled().await;
    api
}

async fn bytes(api: &Api) -> (Vec<u8>, String) {
    let response = api.open("GET /v1/plans/p1/pack", &[], "").await;
    assert_eq!(response.status(), 200);
    assert_eq!(
        response.headers()["content-type"],
        "application/vnd.skyway.pack"
    );
    assert_eq!(response.headers()["skyway-clock"], "simulated");
    let etag = response.headers()["etag"]
        .to_str()
        .expect("text")
        .to_owned();
    (response.bytes().await.expect("a body").to_vec(), etag)
}

#[tokio::test]
async fn a_pack_is_told_once_until_it_changes() {
    let api = with_plan().await;
    let (pack, etag) = bytes(&api).await;
    assert_eq!(Pack::read_unverified(&pack).expect("a pack").plan(), "p1");
    let known = [("if-none-match", etag.as_str())];
    let same = api.ask("GET /v1/plans/p1/pack", &known, "").await.is(304);
    assert_eq!(same.header("etag"), Some(etag.as_str()));
    // Over the plan's detours, and not over the plan.
    let zone = json!({"type": "Feature", "geometry": {"type": "Point", "coordinates": [151.2085, -33.8622]},
        "properties": {"radius_m": 300}});
    api.post("/v1/zones", &zone).await.is(201);
    api.settled().await;
    let (_, another) = bytes(&api).await;
    assert_ne!(another, etag);
    api.ask("GET /v1/plans/p1/pack", &known, "").await.is(200);
}

#[tokio::test]
async fn what_has_no_pack_is_refused() {
    let api = with_plan().await;
    assert_eq!(
        api.get("/v1/plans/none/pack").await.is(404).code(),
        "not_found"
    );
    let refused = api.get("/v1/plans/p1/pack?version=7").await.is(409);
    assert_eq!(refused.code(), "plan_state_conflict");
    let refused = api.get("/v1/plans/p1/pack?version=one").await.is(400);
    assert_eq!(refused.code(), "parameter_invalid");
    api.ask("DELETE /v1/plans/p1?node=379", &[], "")
        .await
        .is(200);
    let refused = api.get("/v1/plans/p1/pack").await.is(409);
    assert_eq!(refused.code(), "plan_state_conflict");
}

#[tokio::test]
async fn the_key_that_signs_is_listed() {
    let api = with_plan().await;
    let listed = api.get("/v1/keys").await.is(200).json();
    let key = &listed["keys"][0];
    let (pack, _) = bytes(&api).await;
    let pack = Pack::read_unverified(&pack).expect("a pack");
    assert_eq!(key["id"], pack.key_id().to_string());
    assert_eq!(key["algorithm"], "ed25519");
    assert_eq!(key["state"], "active");
    assert_eq!(key["valid_from"], "2026-11-27T18:00:00Z");
    assert!(key.get("valid_until").is_none(), "{key}");
}
