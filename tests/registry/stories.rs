//! Writes over HTTP: versions, keys, checks, and networks that change under what stands on them.

use crate::drafts::{NETWORK, square};
use crate::harness::{Place, Served, circle};
use jiff::SignedDuration;
use serde_json::{Value, json};
use skyway::registry::Settings;

#[tokio::test]
async fn a_zone_is_changed_only_by_who_has_seen_its_version() {
    let place = Place::new();
    let served = Served::with_network(&place, Settings::default()).await;
    let made = served.post_zone("z").await;
    assert_eq!(
        made.header("location"),
        format!("/v1/networks/{NETWORK}/zones/z")
    );
    assert_eq!(made.etag(), "\"1-2\"");
    assert_eq!(made.json()["revision"], 2);
    assert_eq!(made.json()["object"]["properties"]["margin_m"], 10.0);
    served
        .write("POST /zones", &[], &circle("z", 5.0))
        .await
        .refuses(409, "already_exists");
    let wider = circle("z", 20.0);
    let unseen = served.write("PUT /zones/z", &[], &wider).await;
    let unseen = unseen.refuses(428, "precondition_required");
    assert_eq!(unseen.json()["current_etag"], made.etag());
    let stale = [("if-match", "\"1-1\"")];
    let refused = served.write("PUT /zones/z", &stale, &wider).await;
    assert_eq!(
        refused.refuses(412, "precondition_failed").etag(),
        made.etag()
    );
    let seen = made.etag();
    let changed = served
        .write("PUT /zones/z", &[("if-match", &seen)], &wider)
        .await
        .is(200);
    assert_eq!(changed.etag(), "\"1-3\"");
    served
        .write("DELETE /zones/z", &[], &Value::Null)
        .await
        .refuses(428, "precondition_required");
    let gone = served
        .write("DELETE /zones/z", &[("if-match", &seen)], &Value::Null)
        .await;
    gone.refuses(412, "precondition_failed");
    let current = changed.etag();
    let gone = served
        .write("DELETE /zones/z", &[("if-match", &current)], &Value::Null)
        .await;
    assert_eq!((gone.is(200).json()["revision"]).as_u64(), Some(4));
    served.get("/zones/z").await.refuses(404, "not_found");
    let gone = served
        .write("DELETE /zones/z", &[("if-match", "*")], &Value::Null)
        .await;
    gone.refuses(404, "not_found");
    // The version of an object that was there before is that of no other.
    served
        .write("PUT /zones/z", &[("if-match", &current)], &wider)
        .await
        .is(412);
    assert_eq!(
        served
            .write("PUT /zones/z", &[], &wider)
            .await
            .is(201)
            .etag(),
        "\"1-5\""
    );
    served.end().await;
}

#[tokio::test]
async fn the_same_request_gets_the_same_bytes_also_after_a_restart() {
    let place = Place::new();
    let served = Served::with_network(&place, Settings::default()).await;
    let key = [("idempotency-key", "k-1")];
    let nameless = json!({
        "type": "Feature",
        "geometry": {"type": "Point", "coordinates": [50.0, 50.0]},
        "properties": {"radius_m": 5.0},
    });
    let first = served.write("POST /zones", &key, &nameless).await.is(201);
    let again = served.write("POST /zones", &key, &nameless).await.is(201);
    let same =
        |told: &crate::harness::Told| (told.body.clone(), told.etag(), told.header("location"));
    assert_eq!(same(&first), same(&again));
    let other = served
        .write("POST /zones", &key, &circle("other", 5.0))
        .await;
    other.refuses(422, "idempotency_mismatch");
    let elsewhere = served.write("POST /closures", &key, &nameless).await;
    elsewhere.refuses(400, "body_invalid");
    // What is refused is not kept.
    let key_2 = [("idempotency-key", "k-2")];
    served
        .write("POST /zones", &key_2, &circle("bad", -5.0))
        .await
        .refuses(422, "zone_invalid");
    served
        .write("POST /zones", &key_2, &circle("good", 5.0))
        .await
        .is(201);
    // Nor is a check without effect.
    let checked = served
        .write("POST /zones?validate_only=true", &key, &circle("c", 5.0))
        .await;
    assert_eq!(checked.is(200).json().get("etag"), None);
    served.end().await;
    let served = place.open(Settings::default(), false).await;
    let after = served.write("POST /zones", &key, &nameless).await.is(201);
    assert_eq!(same(&first), same(&after));
    let list = served.get("/zones").await.is(200).json();
    assert_eq!(list["objects"].as_array().map(Vec::len), Some(2));
    assert_eq!(list["revision"], 3);
    // Too old, it is a new request.
    served.hand.advance(SignedDuration::from_hours(25));
    served.registry.compact().await.expect("compacts");
    served.write("POST /zones", &key, &nameless).await.is(201);
    assert_eq!(served.get("/zones").await.json()["revision"], 4);
    served.end().await;
}

#[tokio::test]
async fn a_segment_is_kept_by_its_id_however_it_was_named() {
    let place = Place::new();
    let served = Served::with_network(&place, Settings::default()).await;
    let closure = json!({"id": "c", "segments": ["b-a"]});
    served.write("POST /closures", &[], &closure).await.is(201);
    let kept = served.get("/closures/c").await.json();
    assert_eq!(kept["segments"], json!(["a-b"]));
    served.end().await;
}

#[tokio::test]
async fn what_is_not_valid_is_refused_with_its_place() {
    let place = Place::new();
    let served = Served::with_network(&place, Settings::default()).await;
    let told = served.write("POST /zones", &[], &circle("z", -1.0)).await;
    let told = told.refuses(422, "zone_invalid").json();
    assert_eq!(told["errors"][0]["pointer"], "/properties/radius_m");
    let closure = json!({"segments": ["a-b", "a-c"], "nodes": ["x"]});
    let told = served.write("POST /closures", &[], &closure).await;
    let told = told.refuses(422, "closure_invalid").json();
    assert_eq!(told["errors"][0]["pointer"], "/segments/1");
    assert_eq!(told["errors"][1]["pointer"], "/nodes/0");
    let report = json!({"cause": "report", "id": "report:a-b", "segments": ["a-b"]});
    let told = served.write("POST /closures", &[], &report).await;
    let told = told.refuses(422, "closure_invalid").json();
    assert_eq!(told["errors"][0]["pointer"], "/until");
    let wind = json!({"from": "2026-11-27T12:00:00Z", "until": "2026-11-27T06:00:00Z", "speed_mps": 500, "from_deg": 7});
    let told = served
        .write("PUT /weather", &[], &json!({"wind": [wind]}))
        .await;
    let told = told.refuses(422, "weather_invalid").json();
    let places: Vec<&Value> = told["errors"]
        .as_array()
        .expect("errors")
        .iter()
        .map(|error| &error["pointer"])
        .collect();
    assert_eq!(places, ["/wind/0/speed_mps", "/wind/0/until"]);
    let area = json!({"type": "Polygon", "coordinates": [[[0, 0], [1, 0], [0, 1]]]});
    let wind = json!({"area": area, "from": "2026-11-27T06:00:00Z", "until": "2026-11-27T12:00:00Z", "speed_mps": 5, "from_deg": 7});
    let told = served
        .write("PUT /weather", &[], &json!({"wind": [wind]}))
        .await;
    let told = told.refuses(422, "weather_invalid").json();
    let pointer = told["errors"][0]["pointer"].as_str().expect("a pointer");
    assert!(
        pointer.starts_with("/wind/0/area/coordinates/0"),
        "{pointer}"
    );
    let broken = square().replace("\"to\":\"b\"", "\"to\":\"x\"");
    let told = served.ask("PUT /v1/networks/broken", &[], &broken).await;
    told.refuses(422, "network_invalid");
    served
        .ask("GET /v1/networks/broken", &[], "")
        .await
        .refuses(404, "not_found");
    served
        .ask("GET /v1/networks/none/changes?after=0", &[], "")
        .await
        .refuses(404, "not_found");
    let status = served.ask_admin("GET /status").await.is(200).json();
    assert_eq!(
        (&status["networks"], &status["zones"], &status["commits"]),
        (&json!(1), &json!(0), &json!(1))
    );
    served.end().await;
}

#[tokio::test]
async fn zones_and_closures_have_one_roof_of_ids_and_weather_is_one_document() {
    let place = Place::new();
    let served = Served::with_network(&place, Settings::default()).await;
    served.post_zone("x").await;
    let closure = json!({"id": "x", "segments": ["a-b"]});
    served
        .write("POST /closures", &[], &closure)
        .await
        .refuses(409, "already_exists");
    let report = json!({
        "cause": "report", "reason": "environmental", "reported_by": "d-1", "segments": ["a-b"],
        "until": "2026-11-27T18:30:00Z",
    });
    let told = served
        .write("PUT /closures/report:a-b", &[], &report)
        .await
        .is(201);
    assert_eq!(told.json()["object"]["from"], "2026-11-27T18:00:00Z");
    assert_eq!(told.json()["object"]["confirmed"], false);
    let wind = json!({"wind": [{"from": "2026-11-27T06:00:00Z", "until": "2026-11-27T12:00:00Z", "speed_mps": 6.5, "from_deg": 225.0}]});
    served.get("/weather").await.refuses(404, "not_found");
    let stated = served.write("PUT /weather", &[], &wind).await.is(201);
    served
        .write("PUT /weather", &[], &wind)
        .await
        .refuses(428, "precondition_required");
    let tag = stated.etag();
    let calm = json!({"wind": []});
    served
        .write("PUT /weather", &[("if-match", &tag)], &calm)
        .await
        .is(200);
    assert_eq!(served.get("/weather").await.is(200).json(), calm);
    served.end().await;
}

#[tokio::test]
async fn a_network_does_not_lose_the_ground_under_what_stands_on_it() {
    let place = Place::new();
    let served = Served::with_network(&place, Settings::default()).await;
    let network = served.get("").await.is(200);
    assert_eq!(network.body, square());
    let closure = json!({"id": "crane", "segments": ["a-b"], "pads": ["c"]});
    served.write("POST /closures", &[], &closure).await.is(201);
    let seen = network.etag();
    let version = [("if-match", seen.as_str())];
    let without = json!({"removed_segments": ["b-a"]});
    served
        .write("PATCH ", &[], &without)
        .await
        .refuses(428, "precondition_required");
    let told = served.write("PATCH ", &version, &without).await;
    let told = told.refuses(409, "network_in_use").json();
    assert_eq!(told["errors"][0]["pointer"], "/closures/crane");
    let smaller = square()
        .replace("\"id\":\"c\"", "\"id\":\"e\"")
        .replace("\"to\":\"c\"", "\"to\":\"e\"");
    let smaller = smaller.replace("\"from\":\"c\"", "\"from\":\"e\"");
    let told = served
        .ask(&format!("PUT /v1/networks/{NETWORK}"), &version, &smaller)
        .await;
    told.refuses(409, "network_in_use");
    let diagonal = json!({
        "type": "Feature",
        "geometry": {"type": "LineString", "coordinates": [[0, 0], [100, 100]]},
        "properties": {"kind": "segment", "from": "a", "to": "c"},
    });
    let patch = json!({"added": [diagonal], "removed_segments": ["c-d"]});
    let patched = served.write("PATCH ", &version, &patch).await.is(200);
    assert_eq!(patched.etag(), "\"1-3\"");
    let told = served.get("").await.is(200);
    assert_eq!(told.etag(), patched.etag());
    assert!(
        told.body.contains("\"from\":\"a\",\"to\":\"c\""),
        "{}",
        told.body
    );
    assert!(
        !told.body.contains("\"from\":\"c\",\"to\":\"d\""),
        "{}",
        told.body
    );
    // What was patched away can no longer be closed, what was patched in can.
    let gone = json!({"segments": ["c-d"]});
    served
        .write("POST /closures", &[], &gone)
        .await
        .refuses(422, "closure_invalid");
    served
        .write("POST /closures", &[], &json!({"segments": ["a-c"]}))
        .await
        .is(201);
    let tag = patched.etag();
    let told = served.write("PATCH ", &[("if-match", &tag)], &patch).await;
    let told = told.refuses(422, "network_invalid").json();
    assert_eq!(told["errors"][0]["pointer"], "/removed_segments/0");
    assert_eq!(told["errors"][1]["pointer"], "/added/0");
    served.end().await;
}

#[tokio::test]
async fn a_closure_that_is_over_is_lifted_after_a_while() {
    let place = Place::new();
    let served = Served::with_network(&place, Settings::default()).await;
    let closure = |id: &str, until: &str| json!({"id": id, "segments": ["a-b"], "until": until});
    for (id, until) in [
        ("short", "2026-11-27T18:30:00Z"),
        ("long", "2026-11-28T18:30:00Z"),
    ] {
        served
            .write("POST /closures", &[], &closure(id, until))
            .await
            .is(201);
    }
    served
        .write(
            "POST /closures",
            &[],
            &json!({"id": "open", "segments": ["a-b"]}),
        )
        .await
        .is(201);
    served.hand.advance(SignedDuration::from_mins(89));
    served.registry.compact().await.expect("compacts");
    assert_eq!(
        served.get("/closures").await.json()["objects"]
            .as_array()
            .map(Vec::len),
        Some(3)
    );
    served.hand.advance(SignedDuration::from_mins(2));
    served.registry.compact().await.expect("compacts");
    let left = served.get("/closures").await.json();
    assert_eq!(
        (&left["objects"][0]["id"], &left["objects"][1]["id"]),
        (&json!("long"), &json!("open"))
    );
    let page = served.get("/changes?after=4").await.json();
    let tombstone = &page["changes"][0];
    assert_eq!(
        (&tombstone["id"], &tombstone["operation"]),
        (&json!("short"), &json!("delete"))
    );
    assert_eq!(tombstone["subject"], "registry");
    served.end().await;
}

#[tokio::test]
async fn bounds_of_the_configuration_are_kept() {
    let place = Place::new();
    let settings = Settings {
        networks_max: 1,
        zones_max: 2,
        ..Settings::default()
    };
    let served = Served::with_network(&place, settings).await;
    served.post_zone("a").await;
    let second = served.post_zone("b").await.etag();
    served
        .write("POST /zones", &[], &circle("c", 5.0))
        .await
        .refuses(429, "limit_reached");
    served
        .write("PUT /zones/b", &[("if-match", &second)], &circle("b", 5.0))
        .await
        .is(200);
    served
        .ask("PUT /v1/networks/second", &[], &square())
        .await
        .refuses(429, "limit_reached");
    served.end().await;
}

#[tokio::test]
async fn what_has_ended_is_in_nobodys_way() {
    let place = Place::new();
    let served = Served::with_network(&place, Settings::default()).await;
    let closure = |until: &str| json!({"cause": "report", "reason": "navigational", "segments": ["a-b"], "until": until});
    let put = async |headers: &[(&str, &str)], until: &str| {
        served
            .write("PUT /closures/report:a-b", headers, &closure(until))
            .await
    };
    put(&[], "2026-11-27T18:30:00Z").await.is(201);
    put(&[], "2026-11-27T18:40:00Z")
        .await
        .refuses(428, "precondition_required");
    served.hand.advance(SignedDuration::from_mins(40));
    // An edge whose clock is behind still knows its version.
    let renewed = put(&[], "2026-11-27T19:00:00Z").await.is(201);
    assert_eq!(renewed.json()["object"]["until"], "2026-11-27T19:00:00Z");
    put(&[], "2026-11-27T19:10:00Z")
        .await
        .refuses(428, "precondition_required");
    let tag = renewed.etag();
    served.hand.advance(SignedDuration::from_mins(40));
    put(&[("if-match", "\"1-99\"")], "2026-11-27T20:00:00Z")
        .await
        .refuses(412, "precondition_failed");
    put(&[("if-match", &tag)], "2026-11-27T20:00:00Z")
        .await
        .is(200);
    served.end().await;
}

#[tokio::test]
async fn a_zone_takes_the_id_of_a_closure_that_has_ended() {
    let place = Place::new();
    let served = Served::with_network(&place, Settings::default()).await;
    let closure = json!({"id": "works", "segments": ["a-b"], "until": "2026-11-27T18:30:00Z"});
    served.write("POST /closures", &[], &closure).await.is(201);
    let zone = circle("works", 5.0);
    let put = async || served.write("PUT /zones/works", &[], &zone).await;
    put().await.refuses(409, "already_exists");
    served.hand.advance(SignedDuration::from_mins(40));
    let taken = put().await.is(201);
    assert_eq!(taken.json()["object"]["id"], "works");
    // Who follows is told both at once.
    let page = served.get("/changes?after=2").await.json();
    let told: Vec<_> = ["kind", "operation", "revision"]
        .map(|member| (&page["changes"][0][member], &page["changes"][1][member]))
        .to_vec();
    let (closure, zone) = (json!("closure"), json!("zone"));
    let (delete, put) = (json!("delete"), json!("put"));
    assert_eq!(
        told,
        [(&closure, &zone), (&delete, &put), (&json!(3), &json!(3))]
    );
    served.get("/closures/works").await.is(404);
    served.end().await;
}

#[tokio::test]
async fn an_edge_says_for_whom_it_writes() {
    let place = Place::new();
    let served = Served::with_network(&place, Settings::default()).await;
    let closure = json!({"id": "works", "segments": ["a-b"]});
    let author = [("skyway-on-behalf-of", "operator:mira")];
    served
        .write("POST /closures", &author, &closure)
        .await
        .is(201);
    let page = served.get("/changes?after=1").await.json();
    assert_eq!(page["changes"][0]["subject"], "operator:mira@*", "{page}");
    let long = "x".repeat(600);
    let refused = served
        .write(
            "POST /closures",
            &[("skyway-on-behalf-of", &long)],
            &closure,
        )
        .await;
    refused.refuses(400, "parameter_invalid");
    served.end().await;
}
