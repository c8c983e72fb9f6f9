//! Zones as GeoJSON: what is accepted, under which id, and what comes back out.

use serde_json::{Value, json};
use skyway::airspace::{Zone, ZoneGeometry};
use skyway::formats::{
    ZoneId, ZoneProblem, read_zones, write_zones, zone_from_feature, zone_to_feature,
};
use skyway::geo::{AltitudeReference, Frame, LocalPlane};

fn with_properties(properties: Value) -> Value {
    let square = json!([[[0, 0], [9, 0], [9, 9], [0, 9], [0, 0]]]);
    let geometry = json!({"type": "Polygon", "coordinates": square});
    json!({"type": "Feature", "id": "z", "geometry": geometry, "properties": properties})
}

#[test]
fn limits_of_different_references_are_not_compared() {
    let zone = with_properties(json!({"lower_m": 120, "upper_m": 30, "upper_reference": "amsl"}));
    let zone = zone_from_feature(&zone, ZoneId::Stated, &Frame::Planar).expect("a zone");
    let references =
        [zone.band().lower, zone.band().upper].map(|limit| limit.map(|limit| limit.reference));
    assert_eq!(
        references,
        [Some(AltitudeReference::Agl), Some(AltitudeReference::Amsl)]
    );
}

#[test]
fn the_id_is_the_features_or_the_callers() {
    let named = with_properties(json!({}));
    let mut nameless = named.clone();
    nameless["id"] = Value::Null;
    let read = |feature: &Value, id| zone_from_feature(feature, id, &Frame::Planar);
    let code = |outcome: Result<Zone, Vec<ZoneProblem>>| outcome.expect_err("refused")[0].code;
    assert_eq!(code(read(&nameless, ZoneId::Stated)), "zone_missing_field");
    assert_eq!(
        code(read(&named, ZoneId::Fixed("other"))),
        "zone_id_mismatch"
    );
    assert_eq!(code(read(&nameless, ZoneId::Fixed(""))), "zone_id_empty");
    for (feature, rule, id) in [
        (&named, ZoneId::Stated, "z"),
        (&named, ZoneId::StatedOr("other"), "z"),
        (&nameless, ZoneId::StatedOr("other"), "other"),
        (&named, ZoneId::Fixed("z"), "z"),
        (&nameless, ZoneId::Fixed("z"), "z"),
    ] {
        assert_eq!(read(feature, rule).expect("a zone").id(), id);
    }
    let mut numbered = named.clone();
    numbered["id"] = json!(7);
    assert_eq!(code(read(&numbered, ZoneId::Stated)), "zone_wrong_type");
}

#[test]
fn what_is_written_reads_as_the_same_zones() {
    let zones = json!({"type": "FeatureCollection", "name": "test", "features": [
        {"type": "Feature", "id": "a", "geometry": {"type": "MultiPolygon", "coordinates": [
            [[[151.2, -33.87], [151.201, -33.87], [151.201, -33.869], [151.2, -33.87]]],
            [[[151.2005, -33.87], [151.2015, -33.87], [151.2015, -33.869], [151.2005, -33.87]]]
        ]}, "properties": {
            "name": "Concert", "reason": "crowd", "authority": "police",
            "lower_m": 0.0, "lower_reference": "wgs84", "upper_m": 120.5, "upper_reference": "amsl",
            "windows": [{"from": "2026-11-27T18:00:00Z", "until": "2026-11-27T23:00:00Z"}, {"until": "2026-01-01T00:00:00Z"}],
            "margin_m": 25.0
        }},
        {"type": "Feature", "id": "b", "geometry": {"type": "Point", "coordinates": [151.2093, -33.8688]},
         "properties": {"radius_m": 250.0, "margin_m": 10.0}}
    ]});
    let frame = Frame::Geographic(LocalPlane::about(151.2, -33.87));
    let read = read_zones(&zones.to_string(), &frame).expect("zones");
    assert!(matches!(
        read[1].geometry(),
        ZoneGeometry::Circle {
            radius_m: 250.0,
            ..
        }
    ));
    let features: Vec<Value> = read.iter().map(zone_to_feature).collect();
    assert_eq!(Value::Array(features), zones["features"]);
    assert_eq!(
        read_zones(&write_zones(&read), &frame).expect("zones"),
        read
    );
    assert_eq!(
        read_zones(&zone_to_feature(&read[0]).to_string(), &frame).expect("one"),
        read[..1]
    );

    let mut twice = zones.clone();
    twice["features"][1]["id"] = json!("a");
    let found = read_zones(&twice.to_string(), &frame).expect_err("refused");
    assert_eq!(
        (found[0].code, found[0].pointer.as_str()),
        ("zone_id_duplicate", "/features/1/id")
    );
    twice["features"][1]["geometry"]["coordinates"] = json!([151.2, -91]);
    let found = read_zones(&twice.to_string(), &frame).expect_err("refused");
    assert_eq!(found[0].pointer, "/features/1/geometry/coordinates");
}
