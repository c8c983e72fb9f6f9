//! Feeds of zones by REST: KML by its media type or as it comes, what is sent back as no feed, and zones that are refused and
//! wait for an operator as proposals.

use crate::harness::Api;
use serde_json::{Value, json};
use skyway::edge::Settings;
use skyway::formats::load_network;
use std::sync::Arc;

const KML: &str = "application/vnd.google-earth.kml+xml";
const PATH: &str = "/v1/zones:import?feed=drawn";

/// A pier, and a line that closes nothing.
const DRAWN: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<kml xmlns="http://www.opengis.net/kml/2.2"><Document>
<Placemark id="pier"><Polygon><outerBoundaryIs><LinearRing><coordinates>
151.2105,-33.8625 151.2115,-33.8625 151.2115,-33.8615 151.2105,-33.8615 151.2105,-33.8625
</coordinates></LinearRing></outerBoundaryIs></Polygon></Placemark>
<Placemark id="line"><LineString><coordinates>151.2,-33.9 151.3,-33.9</coordinates></LineString></Placemark>
</Document></kml>"#;

#[tokio::test]
async fn kml_is_imported_by_its_media_type_and_by_what_is_in_it() {
    let api = Api::start().await;
    let line = format!("POST {PATH}");
    let kinds = ["Application/vnd.google-earth.KML+xml; charset=utf-8", KML];
    for (kind, action) in kinds.into_iter().zip(["created", "unchanged"]) {
        let told = api.ask(&line, &[("content-type", kind)], DRAWN).await;
        let told = told.is(200).json();
        assert_eq!(told["format"], "kml", "{told}");
        assert_eq!(told["counts"][action], 1, "{told}");
        assert_eq!(told["zones"][0]["in_force"], true, "{told}");
        let refused = &told["refused"][0];
        assert_eq!(refused["identifier"], "line", "{told}");
        let place = "/kml/Document/0/Placemark/1/LineString";
        assert_eq!(refused["faults"][0]["pointer"], place, "{told}");
    }
    for headers in [&[("content-type", "application/json")][..], &[]] {
        let told = api.ask(&line, headers, DRAWN).await.is(200).json();
        assert_eq!(told["counts"]["unchanged"], 1, "{told}");
    }
    let zone = api.get("/v1/zones/pier").await.is(200).json();
    let source = json!({"feed": "drawn", "id": "pier"});
    assert_eq!(zone["properties"]["source"], source, "{zone}");
}

#[tokio::test]
async fn what_is_no_feed_is_refused_with_what_to_send() {
    let api = Api::start().await;
    let line = format!("POST {PATH}");
    for (kind, body, status, remedy) in [
        ("application/vnd.google-earth.kmz", "", 415, "unpack it"),
        ("text/csv", "id,lon,lat", 415, KML),
        (KML, "PK\u{3}\u{4}\u{14}", 400, "unpack it"),
        (KML, "<kml><Document></kml>", 422, "export it again"),
        (KML, "<gpx/>", 422, "ogr2ogr"),
    ] {
        let told = api.ask(&line, &[("content-type", kind)], body).await;
        assert_eq!(told.status, status, "{kind} {body}: {}", told.body);
        assert!(told.body.contains(remedy), "{kind} {body}: {}", told.body);
    }
    // Elsewhere a body is JSON.
    let told = api.ask("POST /v1/zones", &[("content-type", KML)], DRAWN);
    assert_eq!(told.await.status, 415);
}

/// Two roofs, in metres.
const PLANE: &str = r#"{"type": "FeatureCollection", "skyway": {"format": 1, "coordinates": "planar"}, "features": [
{"type": "Feature", "id": "a", "geometry": {"type": "Point", "coordinates": [0, 0]}, "properties": {"pads": 1}},
{"type": "Feature", "id": "b", "geometry": {"type": "Point", "coordinates": [500, 0]}, "properties": {"pads": 1}},
{"type": "Feature", "geometry": {"type": "LineString", "coordinates": [[0, 0], [500, 0]]},
"properties": {"from": "a", "to": "b"}}]}"#;

#[tokio::test]
async fn metres_of_a_plane_are_not_told_as_degrees() {
    let network = load_network(PLANE).expect("a network");
    let api = Api::on(Arc::new(network.topology), PLANE, Settings::default()).await;
    let zone = json!({
        "type": "Feature", "id": "crane", "geometry": {"type": "Point", "coordinates": [250, 60]},
        "properties": {"radius_m": 50},
    });
    api.post("/v1/zones", &zone).await.is(201);
    let accept = [("accept", "application/vnd.eurocae.ed318+json")];
    let refused = api.ask("GET /v1/zones", &accept, "").await.is(400).json();
    let fault = &refused["errors"][0];
    assert_eq!(fault["pointer"], "accept", "{refused}");
    let hint = fault["hint"].as_str().expect("a remedy");
    assert!(hint.contains("GeoJSON"), "{refused}");
}

/// A round zone of a feed, which is refused where its upper limit is text.
fn round(id: &str, upper: Value) -> Value {
    json!({
        "type": "Feature", "id": id, "geometry": {"type": "Point", "coordinates": [151.211, -33.862]},
        "properties": {"radius_m": 40, "lower_m": 20, "lower_reference": "agl", "upper_m": upper, "upper_reference": "agl"},
    })
}

async fn import(api: &Api, query: &str, features: &[Value]) -> Value {
    let feed = json!({"type": "FeatureCollection", "features": features});
    let path = format!("/v1/zones:import?feed=city{query}");
    api.post(&path, &feed).await.is(200).json()
}

async fn proposals(api: &Api) -> Vec<Value> {
    let told = api.get("/v1/proposals?page_size=1000").await.is(200).json();
    told["proposals"].as_array().expect("a list").clone()
}

/// Who is authorized for what changes with each import.
#[tokio::test]
async fn drones_fly_through_zones_that_they_are_authorized_for() {
    let api = Api::start().await;
    let of_kind = |id: &str, kind: &str| {
        let mut zone = round(id, json!(80));
        zone["properties"]["kind"] = json!(kind);
        zone
    };
    let feed = [
        of_kind("ctr", "req_authorization"),
        of_kind("park", "conditional"),
        of_kind("base", "prohibited"),
    ];
    let in_force = |told: &Value| {
        let zones = told["zones"].as_array().expect("a list").iter();
        let mut closing: Vec<String> = zones
            .filter(|zone| zone["in_force"] == true)
            .map(|zone| zone["id"].as_str().expect("an id").to_owned())
            .collect();
        closing.sort();
        closing
    };
    let cases = [
        ("", &["base", "ctr", "park"][..]),
        ("&authorized=conditional", &["base", "ctr"]),
        ("&authorized=ctr,conditional", &["base"]),
        ("&authorized=park", &["base", "ctr"]),
        ("", &["base", "ctr", "park"]),
    ];
    for (query, closing) in cases {
        let seen = import(&api, &format!("{query}&validate_only=true"), &feed).await;
        let told = import(&api, query, &feed).await;
        assert_eq!(in_force(&seen), closing, "{query}: {seen}");
        assert_eq!(in_force(&told), closing, "{query}: {told}");
        for id in ["base", "ctr", "park"] {
            let zone = api.get(&format!("/v1/zones/{id}")).await.is(200).json();
            let path = format!("/v1/closures/{id}");
            let closure = api.get(&path).await.is(200).json();
            let closes = closure["segment_count"] != 0;
            assert_eq!(closes, closing.contains(&id), "{query}: {closure}");
            let is_authorized = zone["properties"]["authorized"] == true;
            assert_eq!(is_authorized, !closes, "{query} {id}: {zone}");
        }
    }

    // What cannot be authorized stays closed, and a name without a zone is told.
    let told = import(&api, "&authorized=prohibited,base,nowhere", &feed).await;
    assert_eq!(in_force(&told), ["base", "ctr", "park"], "{told}");
    let notes = told["notes"].to_string();
    for word in ["'prohibited'", "'base'", "'nowhere'"] {
        assert!(notes.contains(word), "{word}: {notes}");
    }
    let path = "/v1/zones:import?feed=city&authorized=ctr,,park";
    let features = json!({"type": "FeatureCollection", "features": feed});
    let refused = api.post(path, &features).await;
    assert_eq!(refused.status, 400, "{}", refused.body);
    assert!(
        refused.body.contains("?authorized=req_authorization"),
        "{}",
        refused.body
    );

    let mut base = of_kind("other-base", "prohibited");
    base["properties"]["authorized"] = json!(true);
    let refused = api.post("/v1/zones", &base).await.is(422).json();
    let fault = &refused["errors"][0];
    assert_eq!(fault["code"], "zone_not_authorizable", "{refused}");
    assert_eq!(fault["pointer"], "/properties/authorized", "{refused}");
}

#[tokio::test]
async fn a_refused_zone_waits_for_an_operator_by_its_shape() {
    let api = Api::start().await;
    let odd = [round("pier", json!(80)), round("tower", json!("high"))];
    let seen = import(&api, "&validate_only=true", &odd).await;
    assert_eq!(seen["counts"]["proposed"], 1, "{seen}");
    assert!(proposals(&api).await.is_empty(), "a preview has no effect");

    let told = import(&api, "", &odd).await;
    assert_eq!(told["counts"]["proposed"], 1, "{told}");
    assert_eq!(told["refused"][0]["is_proposed"], true, "{told}");
    let made = proposals(&api).await;
    let [proposal] = &made[..] else {
        panic!("{made:?}");
    };
    assert_eq!(proposal["reason"], "refused_in_feed", "{proposal}");
    assert_eq!(proposal["recomposition_id"], Value::Null, "{proposal}");
    assert_eq!(
        proposal["faults"][0]["pointer"], "/features/1/properties/upper_m",
        "{proposal}"
    );
    let zone = &proposal["zone"]["properties"];
    assert_eq!(
        zone["source"],
        json!({"feed": "city", "id": "tower"}),
        "{zone}"
    );
    assert!(
        zone["lower_m"].is_null() && zone["upper_m"].is_null(),
        "{zone}"
    );
    api.get("/v1/zones/tower").await.is(404);

    // The same again is no second proposal; what is wrong elsewhere is another.
    import(&api, "", &odd).await;
    assert_eq!(proposals(&api).await, made);
    import(&api, "", &[odd[0].clone(), round("tower", json!([1]))]).await;
    let other = proposals(&api).await;
    assert_eq!(other.len(), 1, "{other:?}");
    assert_ne!(other[0]["id"], proposal["id"]);

    // Accepted, it is the feed's zone: kept while it is refused, changed once it can be read.
    let path = format!(
        "/v1/proposals/{}/accept",
        other[0]["id"].as_str().expect("an id")
    );
    api.post(&path, &json!({})).await.is(200);
    api.get("/v1/zones/tower").await.is(200);
    let told = import(&api, "", &odd).await;
    assert_eq!(told["counts"]["kept"], 1, "{told}");
    assert_eq!(told["counts"]["proposed"], 0, "{told}");
    assert!(proposals(&api).await.is_empty());
    let told = import(&api, "", &[odd[0].clone(), round("tower", json!(90))]).await;
    assert_eq!(told["counts"]["changed"], 1, "{told}");
}

#[tokio::test]
async fn a_proposal_of_a_feed_goes_with_what_it_was_made_for() {
    let api = Api::start().await;
    let pier = round("pier", json!(80));
    import(&api, "", &[pier.clone(), round("tower", json!("high"))]).await;
    assert_eq!(proposals(&api).await.len(), 1);
    // It can be read now.
    import(&api, "", &[pier.clone(), round("tower", json!(90))]).await;
    assert!(proposals(&api).await.is_empty());
    // Another zone, which the feed has no more the next time.
    import(&api, "", &[pier.clone(), round("mast", json!("high"))]).await;
    assert_eq!(proposals(&api).await.len(), 1);
    import(&api, "", std::slice::from_ref(&pier)).await;
    assert!(proposals(&api).await.is_empty());
}

#[tokio::test]
async fn a_feed_proposes_a_hundred_zones_at_most() {
    let api = Api::start().await;
    let odd: Vec<Value> = (0..120)
        .map(|n| round(&format!("z{n}"), json!("high")))
        .collect();
    for _ in 0..2 {
        let told = import(&api, "", &odd).await;
        assert_eq!(told["counts"]["refused"], 120, "{}", told["counts"]);
        assert_eq!(told["counts"]["proposed"], 100, "{}", told["counts"]);
        assert_eq!(proposals(&api).await.len(), 100);
    }
}

#[tokio::test]
async fn nothing_is_proposed_of_a_zone_whose_last_version_is_in_force() {
    let api = Api::start().await;
    let volume = |upper: Value| {
        json!({
            "uomDimensions": "M", "lowerLimit": 0, "lowerVerticalReference": "AGL", "upperLimit": upper, "upperVerticalReference": "AGL",
            "horizontalProjection": {"type": "Circle", "center": [151.211, -33.862], "radius": 40},
        })
    };
    let feed = |volumes: &[Value]| {
        json!({"features": [{
            "identifier": "z", "restriction": "PROHIBITED", "geometry": volumes, "applicability": [{"permanent": "YES"}],
        }]})
    };
    let import = async |volumes: &[Value]| {
        let feed = feed(volumes);
        let told = api.post("/v1/zones:import?feed=national", &feed).await;
        told.is(200).json()["counts"].clone()
    };
    assert_eq!(import(&[volume(json!(80))]).await["created"], 1);
    // With two volumes its parts would have ids of their own.
    let counts = import(&[volume(json!(80)), volume(json!("high"))]).await;
    assert_eq!(
        (&counts["kept"], &counts["proposed"]),
        (&json!(1), &json!(0)),
        "{counts}"
    );
}
