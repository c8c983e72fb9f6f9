//! Any bytes as a zone: what is read closes a part of a network, and reads the same when it is written out.

use crate::networks::{airspaces, now};
use serde_json::Value;
use skyway::airspace::{Airspace, Change, Closure, Zone};
use skyway::formats::{MAX_ZONE_PROBLEMS, ZoneId, read_zones, zone_from_feature, zone_to_feature};
use std::sync::Arc;

/// Reads a zone, or a collection of them, and puts each into force.
///
/// # Panics
/// When a zone that can be read breaks a promise.
pub(crate) fn run(bytes: &[u8]) {
    for airspace in airspaces() {
        if let Ok(feature) = serde_json::from_slice(bytes) {
            one(&feature, airspace);
        }
        if let Ok(text) = std::str::from_utf8(bytes) {
            many(text, airspace);
        }
    }
}

fn one(feature: &Value, airspace: &Airspace) {
    let frame = airspace.topology().frame();
    match zone_from_feature(feature, ZoneId::StatedOr("nameless"), frame) {
        Ok(zone) => enforce(zone, airspace),
        Err(problems) => {
            assert!((1..=MAX_ZONE_PROBLEMS).contains(&problems.len()));
        }
    }
}

fn many(text: &str, airspace: &Airspace) {
    let zones = read_zones(text, airspace.topology().frame()).unwrap_or_default();
    for zone in zones {
        enforce(zone, airspace);
    }
}

fn enforce(zone: Zone, airspace: &Airspace) {
    let topology = airspace.topology();
    let written = zone_to_feature(&zone);
    let again = zone_from_feature(&written, ZoneId::Stated, topology.frame())
        .expect("what is written is a zone");
    assert_eq!(zone_to_feature(&again), written);

    let closure = Arc::new(Closure::of_zone(topology, Arc::new(zone)));
    let rewritten = Closure::of_zone(topology, Arc::new(again));
    assert_eq!(rewritten.hits, closure.hits, "{written}");
    let id = closure.id.clone();
    let closed = airspace.apply(&[Change::Put(closure)], now());
    let lifted = closed.apply(&[Change::Lift(id)], now());
    assert_eq!(lifted.closed().blocked_segment_count(), 0, "{written}");
    assert_eq!(lifted.closed().closed_node_count(), 0, "{written}");
}
