//! ED-318 in both directions: limits in either spelling, and what is written comes back as it was.

use super::{FeedTerms, ZoneFeed, read_feed, write_ed318};
use crate::airspace::Zone;
use crate::geo::{Frame, LocalPlane};
use crate::zones::{ZoneId, zone_from_feature};
use serde_json::{Value, json};

const MARGIN_M: f64 = 10.0;

fn frame() -> Frame {
    Frame::Geographic(LocalPlane::about(151.2, -33.87))
}

fn read(text: &str) -> ZoneFeed {
    let terms = FeedTerms {
        feed: "back",
        prefix: "",
        margin_m: MARGIN_M,
    };
    read_feed(text, &terms, &frame()).expect("a feed")
}

fn zones(feed: &ZoneFeed) -> Vec<&Zone> {
    let outcomes = feed.zones.iter().map(|zone| &zone.outcome);
    outcomes
        .flat_map(|zones| zones.as_ref().expect("zones"))
        .collect()
}

/// A zone of ED-318 with this layer and these extended properties.
fn feature(layer: &Value, extended: &Value) -> String {
    let geometry = json!({"type": "Point", "coordinates": [151.2, -33.87], "layer": layer,
        "extent": {"subType": "Circle", "radius": 100}});
    let properties = json!({"identifier": "LPR12", "country": "PRT", "type": "PROHIBITED", "variant": "COMMON",
        "zoneAuthority": [{"purpose": "INFORMATION"}], "extendedProperties": extended});
    let feature = json!({"type": "Feature", "geometry": geometry, "properties": properties});
    json!({"type": "FeatureCollection", "features": [feature]}).to_string()
}

#[test]
fn each_limit_and_the_unit_is_read_under_either_name() {
    let layer = json!({"lower": 100, "lowerVerticalReference": "AGL", "upperLimit": 400, "upperReference": "AMSL",
        "uomDimensions": "FT"});
    let feed = read(&feature(&layer, &json!({})));
    let band = zones(&feed)[0].band();
    let [lower_m, upper_m] = [band.lower, band.upper].map(|limit| limit.expect("a limit").value_m);
    assert!(
        (lower_m - 30.48).abs() < 1e-9 && (upper_m - 121.92).abs() < 1e-9,
        "{band:?}"
    );
    let told = |part: &str| feed.notes.iter().any(|note| note.message.contains(part));
    for usual in ["lowerReference", "upper", "uom"] {
        assert!(
            told(&format!("was read as the {usual}")),
            "{usual}: {:?}",
            feed.notes
        );
    }
}

#[test]
fn a_limit_with_two_values_is_refused_and_one_told_twice_is_not() {
    let mut layer = json!({"lower": 0, "lowerReference": "AGL", "upper": 120, "upperReference": "AGL", "uom": "m",
        "upperLimit": 120.0, "uomDimensions": "M"});
    assert_eq!(zones(&read(&feature(&layer, &json!({})))).len(), 1);
    layer["upperLimit"] = json!(60);
    let feed = read(&feature(&layer, &json!({})));
    let problems = feed.zones[0].outcome.as_ref().expect_err("two values");
    let place = "/features/0/geometry/layer/upperLimit";
    assert_eq!(
        (problems[0].code, problems[0].pointer.as_str()),
        ("zone_unknown_field", place)
    );
    assert!(problems[0].hint.is_some());
}

#[test]
fn a_margin_is_read_back_where_it_can_be_one() {
    let layer = json!({"uom": "m"});
    for (margin, expected_m, is_told) in [
        (json!(250.5), 250.5, false),
        (json!(0), 0.0, false),
        (json!(-1), MARGIN_M, true),
        (json!("wide"), MARGIN_M, true),
    ] {
        let feed = read(&feature(&layer, &json!({"margin_m": margin})));
        assert_eq!(zones(&feed)[0].margin_m(), expected_m, "{margin}");
        let told = feed
            .notes
            .iter()
            .any(|note| note.pointer.ends_with("/margin_m"));
        assert_eq!(told, is_told, "{margin}: {:?}", feed.notes);
    }
    // A zone that is refused is proposed as wide as it says.
    let refused = read(&feature(
        &json!({"lower": "low"}),
        &json!({"margin_m": 250}),
    ));
    assert_eq!(refused.zones[0].outlines[0].margin_m(), 250.0);
}

/// A zone of a feed here.
fn zone(id: &str, feed: &str, identifier: &str) -> Zone {
    let feature = json!({"type": "Feature", "id": id, "geometry": {"type": "Point", "coordinates": [151.2, -33.87]},
        "properties": {"radius_m": 40, "margin_m": 25, "source": {"feed": feed, "id": identifier}}});
    zone_from_feature(&feature, ZoneId::Stated, &frame()).expect("a zone")
}

#[test]
fn identifiers_differ_in_a_collection_and_come_back_as_they_were() {
    let written = [
        zone("LPR12", "national", "LPR12"),
        zone("national-park", "national", "national-park"),
        // Two plans whose fences count from 1, and a feed that calls its zone as one here is called.
        zone("a-polygon-1", "a", "polygon-1"),
        zone("b-polygon-1", "b", "polygon-1"),
        zone("x-LPR12", "x", "LPR12"),
        // The second is called as the first seven digits of the first.
        zone("zones/1", "y", "zones/1"),
        zone("c", "z", "331bd3e"),
        zone("d", "z", " blanks "),
    ];
    let text = write_ed318(&written, &frame()).expect("ED-318");
    let told: Value = serde_json::from_str(&text).expect("JSON");
    let features = told["features"].as_array().expect("features").iter();
    let mut identifiers: Vec<&str> = features
        .map(|feature| feature["properties"]["identifier"].as_str().expect("text"))
        .collect();
    assert!(
        identifiers.iter().all(|identifier| identifier.len() <= 7),
        "{identifiers:?}"
    );
    identifiers.sort_unstable();
    identifiers.dedup();
    assert_eq!(identifiers.len(), written.len(), "{text}");

    let feed = read(&text);
    let read = zones(&feed);
    let ids: Vec<&str> = read.iter().map(|zone| zone.id()).take(7).collect();
    let expected = [
        "LPR12",
        "national-park",
        "a-polygon-1",
        "b-polygon-1",
        "x-LPR12",
        "zones/1",
        "331bd3e",
    ];
    assert_eq!(ids, expected);
    assert!(read.iter().all(|zone| zone.margin_m() == 25.0));
}

#[test]
fn metres_of_a_plane_are_not_written_as_degrees() {
    let problem = write_ed318(&[], &Frame::Planar).expect_err("a plane");
    assert_eq!(problem.code, "zone_format_foreign");
    assert!(problem.hint.is_some());
}

#[test]
fn an_id_that_cannot_stand_in_an_address_is_refused_and_keeps_no_other_out() {
    let read = |text: &str, prefix| {
        let terms = FeedTerms {
            feed: "city",
            prefix,
            margin_m: 10.0,
        };
        read_feed(text, &terms, &frame()).expect("a feed")
    };
    let mut dots: Value =
        serde_json::from_str(&feature(&json!({"uom": "m"}), &json!({}))).expect("JSON");
    dots["features"][0]["properties"]["identifier"] = json!("..");
    let dots = dots.to_string();
    let crane = |id: &str, properties: &str| {
        format!(
            r#"{{"type": "Feature", "id": "{id}", "geometry": {{"type": "Point", "coordinates": [151.2, -33.87]}},
                "properties": {{"radius_m": 40{properties}}}}}"#
        )
    };
    let features = [
        crane(".", ""),
        crane("crane", ""),
        crane("..", r#", "upper_m": "high""#),
        crane(r"a\u0007b", ""),
    ];
    let collection = format!(
        r#"{{"type": "FeatureCollection", "features": [{}]}}"#,
        features.join(",")
    );
    let ids = |feed: &ZoneFeed| -> Vec<String> {
        let zones = feed.zones.iter().flat_map(|zone| zone.outcome.iter());
        zones.flatten().map(|zone| zone.id().to_owned()).collect()
    };
    let feed = read(&collection, "");
    assert_eq!(ids(&feed), ["crane"]);
    let refused = |feed: &ZoneFeed, place: usize| {
        let problems = feed.zones[place].outcome.as_ref().expect_err("refused");
        (problems[0].code, problems[0].to_string())
    };
    for (place, id) in [(0, r#"".""#), (3, r#""a\u{7}b""#)] {
        let (code, told) = refused(&feed, place);
        assert_eq!(code, "zone_id_invalid");
        for part in ["'city'", id, &format!("features/{place}"), "prefix"] {
            assert!(told.contains(part), "{part}: {told}");
        }
    }
    // Nor is it proposed, as it would be accepted under such an id.
    assert!(refused(&feed, 2).0 != "zone_id_invalid" && feed.zones[2].outlines.is_empty());
    assert_eq!(refused(&read(&dots, ""), 0).0, "zone_id_invalid");
    assert_eq!(ids(&read(&dots, "be:")), ["be:.."]);
    assert_eq!(ids(&read(&collection, "be:")), ["be:.", "be:crane"]);
}
