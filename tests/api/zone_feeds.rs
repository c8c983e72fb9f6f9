//! Feeds of zones by REST: KML by its media type or as it comes, and what is sent back as no feed.

use crate::harness::Api;
use serde_json::json;

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
