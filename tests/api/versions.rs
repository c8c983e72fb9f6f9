//! Entity tags of zones and closures: who has not seen the current version changes nothing.

use crate::harness::{Api, Story, circle};
use insta::assert_snapshot;
use serde_json::{Value, json};

#[tokio::test]
async fn a_zone_is_changed_only_by_who_has_seen_its_version() {
    let api = Api::start().await;
    let mut story = Story::of(&api);
    let zone = circle(30.0);
    let new = story.ask("PUT /v1/zones/z1", &[], &zone).await.is(201);
    let first = new.header("etag").expect("an entity tag").to_owned();
    story.ask("PUT /v1/zones/z1", &[], &zone).await.is(428);
    story
        .ask("DELETE /v1/zones/z1", &[], &Value::Null)
        .await
        .is(428);
    let wider = circle(50.0);
    let stale = [("if-match", "\"1-1\"")];
    story.ask("PUT /v1/zones/z1", &stale, &wider).await.is(412);
    for unquoted in [first.trim_matches('"'), "\"1-1\", 1-2", "\""] {
        let unquoted = [("if-match", unquoted)];
        let told = api
            .ask("PUT /v1/zones/z1", &unquoted, &wider.to_string())
            .await;
        let told = told.is(400).json();
        assert_eq!(told["errors"][0]["pointer"], "if-match", "{told}");
        assert!(told["errors"][0]["hint"].is_string(), "{told}");
    }
    for other in ["W/\"b,RY`\"", "\"a\" , W/\"b\""] {
        let other = [("if-match", other)];
        let told = api
            .ask("PUT /v1/zones/z1", &other, &wider.to_string())
            .await;
        told.is(412);
    }
    let seen = [("if-match", first.as_str())];
    let second = story.ask("PUT /v1/zones/z1", &seen, &wider).await.is(200);
    let second = second.header("etag").expect("an entity tag").to_owned();
    assert_ne!(first, second);
    story
        .ask("DELETE /v1/zones/z1", &seen, &Value::Null)
        .await
        .is(412);
    story.get("/v1/zones/z1").await.is(200);
    let known = [("if-none-match", second.as_str())];
    story
        .ask("GET /v1/zones/z1", &known, &Value::Null)
        .await
        .is(304);
    story.get("/v1/zones").await.is(200);
    let seen = [("if-match", second.as_str())];
    story
        .ask("DELETE /v1/zones/z1", &seen, &Value::Null)
        .await
        .is(200);
    story.get("/v1/zones/z1").await.is(404);
    assert_snapshot!(story.text);
}

#[tokio::test]
async fn a_zone_has_a_path_of_its_own_and_an_id_once() {
    let api = Api::start().await;
    let mut zone = circle(30.0);
    zone["id"] = json!("näher am Hafen?");
    let new = api.post("/v1/zones", &zone).await.is(201);
    let location = new.header("location").expect("a location").to_owned();
    assert_eq!(location, "/v1/zones/n%C3%A4her%20am%20Hafen%3F");
    assert_eq!(api.get(&location).await.is(200).json()["id"], zone["id"]);
    assert_eq!(
        api.post("/v1/zones", &zone).await.is(409).code(),
        "already_exists"
    );
}

#[tokio::test]
async fn checks_and_previews_change_nothing() {
    let api = Api::start().await;
    let revision = |told: &Value| told["revision"].clone();
    let before = revision(&api.get("/v1/zones").await.is(200).json());
    let preview = api
        .post("/v1/zones:preview", &circle(40.0))
        .await
        .is(200)
        .json();
    assert!(
        preview["effect"]["segment_count"].as_u64() > Some(0),
        "{preview}"
    );
    let checked = api
        .post("/v1/zones?validate_only=true", &circle(40.0))
        .await
        .is(200);
    assert_eq!(
        (
            checked.header("location"),
            checked.json()["enforced"].clone()
        ),
        (None, json!(false))
    );
    api.ask(
        "PUT /v1/zones/z1?validate_only=true",
        &[],
        &circle(40.0).to_string(),
    )
    .await
    .is(200);
    let after = api.get("/v1/zones").await.is(200).json();
    assert_eq!(
        (revision(&after), after["features"].clone()),
        (before, json!([]))
    );
}

#[tokio::test]
async fn closures_take_a_version_but_do_not_need_one() {
    let api = Api::start().await;
    let draft = json!({"id": "c1", "nodes": [406]});
    let new = api.post("/v1/closures", &draft).await.is(201);
    let etag = new.header("etag").expect("an entity tag").to_owned();
    let change = r#"{"confirmed": true}"#;
    let stale = api
        .ask("PATCH /v1/closures/c1", &[("if-match", "\"1-1\"")], change)
        .await
        .is(412);
    assert_eq!(stale.header("etag"), Some(etag.as_str()));
    assert_eq!(stale.json()["current_etag"], etag);
    api.ask("PATCH /v1/closures/c1", &[("if-match", &etag)], change)
        .await
        .is(200);
    api.ask("DELETE /v1/closures/c1", &[("if-match", "\"1-1\"")], "")
        .await
        .is(412);
    api.ask("DELETE /v1/closures/c1", &[], "").await.is(200);

    api.ask("PUT /v1/zones/z1", &[], &circle(30.0).to_string())
        .await
        .is(201);
    for (line, body) in [
        ("DELETE /v1/closures/z1", ""),
        ("PATCH /v1/closures/z1", change),
    ] {
        assert_eq!(
            api.ask(line, &[], body).await.is(409).code(),
            "closure_of_zone"
        );
    }
}
