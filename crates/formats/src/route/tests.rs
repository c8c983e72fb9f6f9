//! What a plan of QGroundControl says of alternates and zones.

use super::{Route, RouteFormat, RouteLeg, WrittenRoute, write_route};
use crate::airspace::{Airspace, Change, Closure};
use crate::networks::load::load_network;
use crate::zones::{ZoneId, zone_from_feature};
use jiff::{SignedDuration, Timestamp};
use serde_json::{Value, json};
use std::sync::Arc;

/// A leg of about 9 km from `a` to `b`; `safe` and `other` are alternates.
fn airspace(reference: &str, other_reference: &str) -> Airspace {
    let node = |id: &str, lon: f64, altitude_m: f64, reference: &str| {
        json!({"type": "Feature", "id": id, "geometry": {"type": "Point", "coordinates": [lon, -33.86]},
            "properties": {"altitude_m": altitude_m, "altitude_reference": reference}})
    };
    let segment = json!({"type": "Feature",
        "geometry": {"type": "LineString", "coordinates": [[151.2, -33.86], [151.3, -33.86]]},
        "properties": {"from": "a", "to": "b"}});
    let features = [
        node("a", 151.2, 30.0, reference),
        node("b", 151.3, 40.0, reference),
        node("safe", 151.25, 75.0, reference),
        node("other", 151.26, 20.0, other_reference),
        segment,
    ];
    let network = json!({"type": "FeatureCollection", "features": features,
        "skyway": {"format": 1, "coordinates": "geographic"}});
    let network = load_network(&network.to_string()).expect("a network");
    let noon: Timestamp = "2026-11-25T12:00:00Z".parse().expect("an instant");
    Airspace::open(Arc::new(network.topology), 1, noon, SignedDuration::ZERO)
}

fn plan(airspace: &Airspace) -> (Value, Vec<String>) {
    let topology = airspace.topology();
    let [from, to, safe, other] =
        ["a", "b", "safe", "other"].map(|id| topology.node(id).expect("a node"));
    let departs = airspace.as_of();
    let leg = |alternate| RouteLeg {
        from,
        to,
        segment: topology.segment_between(from, to).expect("a segment"),
        departs,
        arrives: departs + SignedDuration::from_mins(10),
        lands: true,
        alternate: Some(alternate),
    };
    let route = Route {
        name: "r".to_owned(),
        legs: vec![leg(safe), leg(other)],
        speed_mps: 15.0,
        lead_in: Vec::new(),
    };
    let WrittenRoute { text, notes } =
        write_route(&route, airspace, RouteFormat::QgcPlan).expect("a plan");
    (serde_json::from_str(&text).expect("JSON"), notes)
}

#[test]
fn rally_points_are_above_home_whatever_heights_are_measured_from() {
    for reference in ["agl", "amsl"] {
        let (told, notes) = plan(&airspace(reference, reference));
        let points = json!([[-33.86, 151.25, 45.0], [-33.86, 151.26, -10.0]]);
        assert_eq!(told["rallyPoints"]["points"], points, "{reference}");
        assert!(
            !notes.iter().any(|note| note.contains("alternate")),
            "{notes:?}"
        );
    }
}

#[test]
fn an_alternate_whose_height_above_home_is_unknown_is_left_out_with_a_note() {
    let (told, notes) = plan(&airspace("amsl", "agl"));
    let points = json!([[-33.86, 151.25, 45.0]]);
    assert_eq!(told["rallyPoints"]["points"], points);
    let mut told = notes.iter();
    assert!(
        told.any(|note| note.contains("alternate 'other'")),
        "{notes:?}"
    );
}

#[test]
fn a_fence_has_the_zones_within_a_kilometre_of_the_line_and_no_others() {
    let airspace = airspace("agl", "agl");
    let topology = airspace.topology().clone();
    let zones = [
        ("over-the-middle", 151.25, -33.86, 50.0),
        ("beside-the-middle", 151.25, -33.866, 50.0),
        ("beyond", 151.25, -33.88, 50.0),
    ];
    let changes = zones.map(|(id, lon, lat, radius_m)| {
        let feature = json!({"type": "Feature", "id": id,
            "geometry": {"type": "Point", "coordinates": [lon, lat]},
            "properties": {"radius_m": radius_m, "margin_m": 0}});
        let zone = zone_from_feature(&feature, ZoneId::Stated, topology.frame()).expect("a zone");
        Change::Put(Arc::new(Closure::of_zone(&topology, Arc::new(zone))))
    });
    let airspace = airspace.apply(&changes, airspace.as_of());
    let (told, notes) = plan(&airspace);
    let circles = told["geoFence"]["circles"].as_array().expect("circles");
    let mut centres: Vec<&Value> = circles
        .iter()
        .map(|circle| &circle["circle"]["center"][0])
        .collect();
    centres.sort_by_key(|latitude| latitude.to_string());
    assert_eq!(centres, [&json!(-33.86), &json!(-33.866)]);
    let mut met = notes
        .iter()
        .filter(|note| note.contains("lies in the fence"));
    assert!(
        met.next()
            .is_some_and(|note| note.contains("'over-the-middle'")),
        "{notes:?}"
    );
    assert_eq!(met.next(), None);
}
