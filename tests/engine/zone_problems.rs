//! Zones as GeoJSON: what is refused, with which code and at which place.

use serde_json::{Value, json};
use skyway::formats::{
    MAX_ZONE_PROBLEMS, ZoneCode, ZoneId, ZoneProblem, read_zones, zone_from_feature,
};
use skyway::geo::{Frame, LocalPlane};
use std::collections::BTreeSet;

/// A plane about Sydney.
fn geographic() -> Frame {
    Frame::Geographic(LocalPlane::about(151.2, -33.87))
}

fn parsed(json: &str) -> Value {
    serde_json::from_str(json).expect(json)
}

fn feature(geometry: Value, properties: Value) -> Value {
    json!({"type": "Feature", "id": "z", "geometry": geometry, "properties": properties})
}

fn polygon(rings: Value) -> Value {
    feature(json!({"type": "Polygon", "coordinates": rings}), json!({}))
}

fn with_properties(properties: Value) -> Value {
    let square = json!([[[0, 0], [9, 0], [9, 9], [0, 9], [0, 0]]]);
    feature(
        json!({"type": "Polygon", "coordinates": square}),
        properties,
    )
}

fn problems(feature: &Value, frame: &Frame) -> Vec<ZoneProblem> {
    zone_from_feature(feature, ZoneId::Stated, frame).expect_err("refused")
}

/// Asserts that a feature has this one problem.
fn assert_refused(feature: &Value, frame: &Frame, code: &str, pointer: &str) {
    let found = problems(feature, frame);
    let places: Vec<(&str, &str)> = found
        .iter()
        .map(|problem| (problem.code, problem.pointer.as_str()))
        .collect();
    assert_eq!(places, [(code, pointer)], "{feature}: {found:?}");
}

fn regular(corners: usize) -> Value {
    let corner = |index: usize| {
        let angle = std::f64::consts::TAU * (index % corners) as f64 / corners as f64;
        json!([900.0 * angle.cos(), 900.0 * angle.sin()])
    };
    Value::Array((0..=corners).map(corner).collect())
}

#[test]
fn rings_that_bound_nothing_are_refused() {
    let cases = [
        ("[]", "zone_geometry_empty", ""),
        ("[[]]", "zone_too_few_points", "/0"),
        ("[[[0,0],[9,0],[0,0]]]", "zone_too_few_points", "/0"),
        (
            "[[[0,0],[0,0],[9,0],[9,0],[0,0]]]",
            "zone_too_few_points",
            "/0",
        ),
        ("[[[0,0],[9,0],[9,9],[0,9]]]", "zone_ring_unclosed", "/0/3"),
        ("[[[0,0],[9,9],[4,4],[0,0]]]", "zone_zero_area", "/0"),
        (
            "[[[0,0],[9,9],[9,0],[0,9],[0,0]]]",
            "zone_self_intersection",
            "/0/2",
        ),
        (
            "[[[0,0],[9,0],[9,9],[9,20],[9,9],[0,9],[0,0]]]",
            "zone_spike",
            "/0/3",
        ),
        (
            "[[[0,0],[1e300,0],[9,9],[0,0]]]",
            "zone_coordinate_out_of_range",
            "/0/1",
        ),
        (
            "[[[0,0],[9,\"0\"],[9,9],[0,0]]]",
            "zone_wrong_type",
            "/0/1/1",
        ),
        (
            "[[[0,0],[9],[9,9],[0,0]]]",
            "zone_position_not_pair",
            "/0/1",
        ),
        (
            "[[[0,0],[9,0,30],[9,9],[0,0]]]",
            "zone_position_not_pair",
            "/0/1",
        ),
        ("[[0,0]]", "zone_wrong_type", "/0/0"),
    ];
    for (rings, code, place) in cases {
        let found = problems(&polygon(parsed(rings)), &Frame::Planar);
        let pointer = format!("/geometry/coordinates{place}");
        assert_eq!(
            (found[0].code, &found[0].pointer),
            (code, &pointer),
            "{rings}: {found:?}"
        );
    }
    let too_many = polygon(json!([regular(1_001)]));
    let pointer = "/geometry/coordinates";
    assert_refused(&too_many, &Frame::Planar, "zone_too_many_vertices", pointer);
    let enough = polygon(json!([regular(1_000)]));
    assert!(zone_from_feature(&enough, ZoneId::Stated, &Frame::Planar).is_ok());
}

#[test]
fn holes_belong_inside_and_apart() {
    let cases = [
        (
            "[[100,0],[110,0],[110,9],[100,0]]",
            "zone_hole_outside",
            "/1",
        ),
        (
            "[[-5,-5],[200,-5],[200,200],[-5,200],[-5,-5]]",
            "zone_hole_outside",
            "/1",
        ),
        ("[[45,0],[50,9],[40,9],[45,0]]", "zone_rings_meet", "/1/2"),
        (
            "[[80,10],[99,10],[80,20],[80,10]]",
            "zone_rings_meet",
            "/1/0",
        ),
        (
            "[[10,10],[50,10],[50,50],[10,10]],[[30,20],[40,20],[40,30],[30,20]]",
            "zone_hole_in_hole",
            "/2",
        ),
    ];
    for (holes, code, place) in cases {
        let rings = format!("[[[0,0],[90,0],[90,90],[0,90],[0,0]],{holes}]");
        let pointer = format!("/geometry/coordinates{place}");
        assert_refused(&polygon(parsed(&rings)), &Frame::Planar, code, &pointer);
    }
    let good = "[[[[0,0],[9,0],[9,9],[0,0]]],[[[0,0],[9,0],[9,9]]]]";
    let several = feature(
        json!({"type": "MultiPolygon", "coordinates": parsed(good)}),
        json!({}),
    );
    let pointer = "/geometry/coordinates/1/0/2";
    assert_refused(&several, &Frame::Planar, "zone_ring_unclosed", pointer);
}

#[test]
fn a_point_has_a_radius_and_nothing_else_has() {
    let circle = |properties| {
        let geometry = json!({"type": "Point", "coordinates": [0, 0]});
        feature(geometry, parsed(properties))
    };
    let pointer = "/properties/radius_m";
    let refused = |properties, code| {
        assert_refused(&circle(properties), &Frame::Planar, code, pointer);
    };
    refused("{}", "zone_missing_field");
    refused("{\"radius_m\": null}", "zone_missing_field");
    refused("{\"radius_m\": 0}", "zone_radius_invalid");
    refused("{\"radius_m\": 100001}", "zone_radius_invalid");
    refused("{\"radius_m\": \"50\"}", "zone_wrong_type");
    let polygon = with_properties(json!({"radius_m": 5}));
    assert_refused(&polygon, &Frame::Planar, "zone_radius_invalid", pointer);
}

#[test]
fn positions_not_on_earth_are_refused() {
    let cases = [
        ("[-33.9,151.2]", "zone_latitude_out_of_range"),
        ("[151.2,90.001]", "zone_latitude_out_of_range"),
        ("[180.001,-33]", "zone_longitude_out_of_range"),
        ("[-150,-33.5]", "zone_crosses_antimeridian"),
    ];
    let around = |position: &str| {
        polygon(parsed(&format!(
            "[[[151,-33],{position},[151,-34],[151,-33]]]"
        )))
    };
    for (position, code) in cases {
        let found = problems(&around(position), &geographic());
        let place = (found[0].code, found[0].pointer.as_str());
        assert_eq!(place, (code, "/geometry/coordinates/0/1"), "{position}");
    }
    let hint = |position| problems(&around(position), &geographic())[0].hint.clone();
    assert!(hint("[-33.9,151.2]").is_some_and(|hint| hint.contains("swapped")));
    assert_eq!(hint("[151.2,90.001]"), None);

    let circles = [
        (
            "[179.9999,-33.9]",
            "zone_crosses_antimeridian",
            "/properties/radius_m",
        ),
        ("[0,89.9999]", "zone_crosses_pole", "/properties/radius_m"),
        (
            "[0,91]",
            "zone_latitude_out_of_range",
            "/geometry/coordinates",
        ),
    ];
    for (centre, code, pointer) in circles {
        let geometry = json!({"type": "Point", "coordinates": parsed(centre)});
        let circle = feature(geometry, json!({"radius_m": 500}));
        assert_refused(&circle, &geographic(), code, pointer);
    }
}

/// Whatever the projection rounds.
#[test]
fn what_touches_in_degrees_touches_in_metres() {
    let cases = [
        (
            "[[[151,-34],[151.3,-33.7],[151.3,-34],[151.1,-33.9],[151.05,-34],[151,-34]]]",
            "zone_self_intersection",
        ),
        (
            "[[[151,-34],[151.3,-33.7],[151.1,-33.9],[151,-34]]]",
            "zone_zero_area",
        ),
        (
            "[[[151,-34],[151.3,-33.7],[151.1,-33.9],[151.1,-34],[151,-34]]]",
            "zone_spike",
        ),
        (
            "[[[151,-34],[151.3,-33.7],[151,-33.7],[151,-34]],[[151.1,-33.9],[151.1,-33.8],[151.05,-33.8],[151.1,-33.9]]]",
            "zone_rings_meet",
        ),
    ];
    for (rings, code) in cases {
        let found = problems(&polygon(parsed(rings)), &geographic());
        assert_eq!(found[0].code, code, "{rings}: {found:?}");
    }
}

#[test]
fn properties_are_read_strictly() {
    let cases = [
        (r#"{"uper_m": 5}"#, "zone_unknown_field", "/uper_m"),
        (r#"{"a/b~c": 5}"#, "zone_unknown_field", "/a~1b~0c"),
        (r#"{"upper_m": "120"}"#, "zone_wrong_type", "/upper_m"),
        (r#"{"name": 7}"#, "zone_wrong_type", "/name"),
        (
            r#"{"upper_m": 9, "upper_reference": "msl"}"#,
            "zone_unknown_value",
            "/upper_reference",
        ),
        (
            r#"{"lower_reference": "agl"}"#,
            "zone_missing_field",
            "/lower_m",
        ),
        (
            r#"{"lower_m": 120, "upper_m": 30}"#,
            "zone_band_reversed",
            "/lower_m",
        ),
        (r#"{"margin_m": -1}"#, "zone_margin_invalid", "/margin_m"),
        (r#"{"margin_m": 1e300}"#, "zone_margin_invalid", "/margin_m"),
        (r#"{"windows": {}}"#, "zone_wrong_type", "/windows"),
        (r#"{"windows": [{}, 5]}"#, "zone_wrong_type", "/windows/1"),
        (
            r#"{"windows": [{"to": null}]}"#,
            "zone_unknown_field",
            "/windows/0/to",
        ),
        (
            r#"{"windows": [{"from": "2026-01-02"}]}"#,
            "zone_time_invalid",
            "/windows/0/from",
        ),
        (
            r#"{"windows": [{"from": "2026-01-02T00:00:00"}]}"#,
            "zone_time_invalid",
            "/windows/0/from",
        ),
        (
            r#"{"windows": [{"from": "2026-01-02T00:00:00Z", "until": "2026-01-02T00:00:00Z"}]}"#,
            "zone_window_reversed",
            "/windows/0/until",
        ),
    ];
    for (properties, code, place) in cases {
        let pointer = format!("/properties{place}");
        assert_refused(
            &with_properties(parsed(properties)),
            &Frame::Planar,
            code,
            &pointer,
        );
    }
    let long = with_properties(json!({"reason": "x".repeat(10_001)}));
    assert_refused(
        &long,
        &Frame::Planar,
        "zone_text_too_long",
        "/properties/reason",
    );
    let windows = with_properties(json!({"windows": vec![json!({}); 1_001]}));
    assert_refused(
        &windows,
        &Frame::Planar,
        "zone_too_many_windows",
        "/properties/windows",
    );
    let nested = |depth: usize| {
        let record = (1..depth).fold(json!({}), |record, _| json!({"a": record}));
        with_properties(json!({"record": record}))
    };
    assert_refused(
        &nested(33),
        &Frame::Planar,
        "zone_text_too_long",
        "/properties/record",
    );
    zone_from_feature(&nested(32), ZoneId::Stated, &Frame::Planar).expect("a zone");
    let found = problems(&with_properties(json!({"uper_m": 5})), &Frame::Planar);
    let text = "properties/uper_m: nothing is known of a field 'uper_m' (zone_unknown_field); \
                did you mean 'upper_m'?";
    assert_eq!(found[0].to_string(), text);
}

#[test]
fn features_and_geometries_are_read_strictly() {
    let cases = [
        (
            r#"{"type": "LineString", "coordinates": []}"#,
            "zone_geometry_unsupported",
            "/type",
        ),
        (
            r#"{"type": "polygon", "coordinates": []}"#,
            "zone_geometry_unsupported",
            "/type",
        ),
        (
            r#"{"type": "Polygon"}"#,
            "zone_missing_field",
            "/coordinates",
        ),
        (r#"{"coordinates": []}"#, "zone_missing_field", "/type"),
        (
            r#"{"type": "MultiPolygon", "coordinates": []}"#,
            "zone_geometry_empty",
            "/coordinates",
        ),
        ("null", "zone_missing_field", ""),
        (r#""POLYGON EMPTY""#, "zone_wrong_type", ""),
    ];
    for (geometry, code, place) in cases {
        let feature = feature(parsed(geometry), json!({}));
        assert_refused(&feature, &Frame::Planar, code, &format!("/geometry{place}"));
    }
    let mut misspelt = with_properties(json!({}));
    misspelt["propertys"] = json!({});
    assert_refused(
        &misspelt,
        &Frame::Planar,
        "zone_unknown_field",
        "/propertys",
    );
    let bare = json!({"type": "Feature", "id": "z", "geometry": [], "properties": 5});
    assert_eq!(problems(&bare, &Frame::Planar).len(), 2);
    assert_refused(&json!(5), &Frame::Planar, "zone_wrong_type", "");
}

#[test]
fn several_problems_are_told_at_once_up_to_a_bound() {
    let feature = json!({
        "type": "feature",
        "geometry": {"type": "Polygon", "coordinates": [[[0, 99], [200, 0], [9, 9], [0, 99]]]},
        "properties": {"upper_m": true, "margin_m": -4, "windows": [{"from": "yesterday"}]}
    });
    let found = problems(&feature, &geographic());
    let places: BTreeSet<&str> = found
        .iter()
        .map(|problem| problem.pointer.as_str())
        .collect();
    // Without an id there is no zone to check any further.
    let without_checks = [
        "/id",
        "/properties/upper_m",
        "/properties/windows/0/from",
        "/type",
    ];
    assert_eq!(places.into_iter().collect::<Vec<_>>(), without_checks);
    let mut named = feature.clone();
    named["id"] = json!("z");
    let found = problems(&named, &geographic());
    let places: BTreeSet<&str> = found
        .iter()
        .map(|problem| problem.pointer.as_str())
        .collect();
    let expected = [
        "/geometry/coordinates/0/0",
        "/geometry/coordinates/0/1",
        "/geometry/coordinates/0/3",
        "/properties/margin_m",
        "/properties/upper_m",
        "/properties/windows/0/from",
        "/type",
    ];
    assert_eq!(places.into_iter().collect::<Vec<_>>(), expected);

    let strange: serde_json::Map<String, Value> = (0..100)
        .map(|index| (format!("field-{index}"), json!(1)))
        .collect();
    let found = problems(&with_properties(Value::Object(strange)), &Frame::Planar);
    assert_eq!(found.len(), MAX_ZONE_PROBLEMS);
}

#[test]
fn text_that_is_no_json_or_holds_no_double_is_refused() {
    let code = |text: &str| read_zones(text, &Frame::Planar).expect_err("refused")[0].code;
    assert_eq!(code("{"), "zone_not_json");
    assert_eq!(code("{\"type\": NaN}"), "zone_not_json");
    assert_eq!(code(&"[".repeat(100_000)), "zone_not_json");
    let overflow = with_properties(json!({}))
        .to_string()
        .replace("[9,9]", "[9,1e999]");
    assert_eq!(code(&overflow), "zone_number_out_of_range");
    assert_eq!(code("[]"), "zone_wrong_type");
}

#[test]
fn every_code_is_stable_snake_case_and_its_own() {
    let codes: BTreeSet<&str> = ZoneCode::ALL.iter().map(|code| code.code()).collect();
    assert_eq!(codes.len(), ZoneCode::ALL.len());
    let snake_case = |code: &str| {
        code.chars()
            .all(|letter| letter.is_ascii_lowercase() || letter == '_')
    };
    assert!(
        codes
            .iter()
            .all(|code| code.starts_with("zone_") && snake_case(code))
    );
}
