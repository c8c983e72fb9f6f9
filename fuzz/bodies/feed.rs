//! Any bytes as a feed of zones: what is imported has a place and an identifier, recurs as it is
//! written, and reads the same when it is written out; what is refused says where.

use crate::networks::{airspaces, now};
use skyway::airspace::{Airspace, Change, Closure, Zone};
use skyway::formats::{
    FeedTerms, ZoneFeed, ZoneId, read_feed, write_ed318, zone_from_feature, zone_to_feature,
};
use std::sync::Arc;

/// Reads a feed and puts its zones into force.
///
/// # Panics
/// When a feed that can be read breaks a promise.
pub(crate) fn run(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else {
        return;
    };
    for airspace in airspaces() {
        if let Ok(feed) = read(text, airspace) {
            hold(&feed, airspace);
        }
    }
}

fn read(text: &str, airspace: &Airspace) -> Result<ZoneFeed, skyway::formats::ZoneProblem> {
    let terms = FeedTerms {
        feed: "fuzz",
        prefix: "",
        margin_m: 10.0,
    };
    read_feed(text, &terms, airspace.topology().frame())
}

fn hold(feed: &ZoneFeed, airspace: &Airspace) {
    let topology = airspace.topology();
    let frame = topology.frame();
    let mut zones: Vec<&Zone> = Vec::new();
    for entry in &feed.zones {
        match &entry.outcome {
            Ok(imported) => zones.extend(imported),
            Err(problems) => assert!(!problems.is_empty(), "refused without a reason"),
        }
    }
    for zone in &zones {
        let source = zone.terms().source.as_ref();
        assert!(source.is_some_and(|source| source.feed == "fuzz"));
        let written = zone_to_feature(zone);
        let again = zone_from_feature(&written, ZoneId::Stated, frame).expect("a zone is read");
        assert_eq!(zone_to_feature(&again), written);
        let closure = Arc::new(Closure::of_zone(topology, Arc::new((*zone).clone())));
        let closed = airspace.apply(&[Change::Put(closure.clone())], now());
        let same = closed.apply(&[Change::Put(closure)], now());
        assert_eq!(closed.revision(), same.revision(), "{written}");
        let lifted = closed.apply(&[Change::Lift(zone.id().to_owned())], now());
        assert_eq!(lifted.closed().blocked_segment_count(), 0, "{written}");
    }
    if frame.is_geographic() && !zones.is_empty() {
        let written = write_ed318(zones.iter().copied(), frame).expect("longitudes and latitudes");
        let back = read(&written, airspace).expect("what is exported is a feed");
        let refused = back.zones.iter().filter(|zone| zone.outcome.is_err());
        assert_eq!(refused.count(), 0, "{written}");
    }
}
