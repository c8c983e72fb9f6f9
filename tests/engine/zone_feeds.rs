//! Feeds of zones as the field publishes them, and schedules as time goes on.

use jiff::{SignedDuration, Timestamp, tz::Offset};
use skyway::airspace::{Airspace, Change, Closure, Zone, ZoneKind};
use skyway::formats::{FeedTerms, ZoneFeed, load_network, read_feed, write_ed318};
use skyway::geo::AltitudeBand;
use skyway::network::bundled;
use std::sync::Arc;

const ED269: &str = include_str!("../formats/data/be-brussels-early-ed269.json");
const ED318: &str = include_str!("../formats/data/ed318-official-collection.json");
const PLAN: &str = include_str!("../formats/data/px4-geofence-avoid.plan");

fn sydney() -> Airspace {
    let network = load_network(bundled::SYDNEY_CBD).expect("a network");
    let noon: Timestamp = "2026-11-25T12:00:00Z".parse().expect("an instant");
    Airspace::open(Arc::new(network.topology), 1, noon, SignedDuration::ZERO)
}

fn read(text: &str, airspace: &Airspace) -> ZoneFeed {
    let terms = FeedTerms {
        feed: "test",
        prefix: "",
        margin_m: 10.0,
    };
    read_feed(text, &terms, airspace.topology().frame()).expect("a feed")
}

fn zones(feed: &ZoneFeed) -> Vec<&Zone> {
    let outcomes = feed.zones.iter().map(|zone| &zone.outcome);
    outcomes.flatten().flatten().collect()
}

#[test]
fn samples_are_imported_as_written_or_refused_with_the_reason() {
    let airspace = sydney();
    let brussels = read(ED269, &airspace);
    let imported = zones(&brussels);
    assert_eq!(imported.len(), 11);
    assert!(
        imported
            .iter()
            .all(|zone| zone.terms().kind == ZoneKind::NoRestriction && zone.recurs())
    );
    assert_eq!(imported[1].id(), "c7b19b1~1");
    assert_eq!(imported[1].name(), Some("Tervuren"));
    let told = |feed: &ZoneFeed, part: &str| feed.notes.iter().any(|it| it.message.contains(part));
    assert!(told(&brussels, "not used, as the zone is permanent"));

    let collection = read(ED318, &airspace);
    let imported = zones(&collection);
    assert_eq!(
        imported[0].reason(),
        Some("AIR_TRAFFIC, OTHER, Flying Whales - part 2")
    );
    assert_eq!(imported[0].authority(), Some("LFPG-UASZoneManager"));
    let written = write_ed318(imported.iter().copied(), airspace.topology().frame());
    let again = read(&written.expect("ED-318"), &airspace);
    let times = |feed: &ZoneFeed| -> Vec<_> {
        let all = zones(feed).into_iter();
        all.map(|zone| (zone.id().to_owned(), zone.terms().schedules.clone()))
            .collect()
    };
    assert_eq!(times(&again), times(&collection));

    let plan = read(PLAN, &airspace);
    assert_eq!(zones(&plan).len(), 2);
    let refused = plan
        .zones
        .iter()
        .find_map(|zone| zone.outcome.as_ref().err());
    let problem = &refused.expect("one is refused")[0];
    assert_eq!(problem.code, "zone_fence_keeps_in");
    assert_eq!(problem.pointer, "/geoFence/polygons/1/inclusion");
}

/// From Monday to Friday, 22:00 to 06:00 two hours east, as long as it is November.
#[test]
fn a_schedule_is_followed_for_weeks_from_one_change_to_the_next() {
    let mut airspace = sydney();
    let feature = r#"{"type": "Feature", "id": "z", "geometry": {"type": "Point", "coordinates": [151.2093, -33.8688]},
        "properties": {"radius_m": 400, "windows": [{"until": "2027-01-15T00:00:00Z", "schedule":
        [{"days": ["mon", "tue", "wed", "thu", "fri"], "from": "22:00+02:00", "until": "06:00+02:00"}]}]}}"#;
    let feed = read(feature, &airspace);
    let zone = Arc::new(zones(&feed)[0].clone());
    let closure = Arc::new(Closure::of_zone(airspace.topology(), zone));
    let begin = airspace.as_of();
    airspace = airspace.apply(&[Change::Put(closure)], begin);
    let mut now = begin;
    for hour in 0..24 * 60 {
        let at = begin + SignedDuration::from_hours(hour) + SignedDuration::from_mins(30);
        // What an edge does: it looks again when the next window turns, and at nothing between.
        while let Some(turns) = airspace.next_change().filter(|turns| *turns <= at) {
            assert!(turns > now, "{turns} is not after {now}");
            now = turns;
            airspace = airspace.apply(&[], now);
        }
        let local = Offset::constant(2).to_datetime(at);
        let belongs_to = match local.hour() < 6 {
            true => local.date().yesterday().expect("a day"),
            false => local.date(),
        };
        let is_night = local.hour() >= 22 || local.hour() < 6;
        let ends: Timestamp = "2027-01-15T00:00:00Z".parse().expect("an instant");
        let expected = is_night && belongs_to.weekday().to_monday_zero_offset() < 5 && at <= ends;
        assert_eq!(airspace.is_in_force("z"), expected, "{at}");
    }
    assert!(now > begin + SignedDuration::from_hours(24 * 40));
}

/// From a Monday to a Friday, on Saturdays only.
#[test]
fn a_schedule_that_never_counts_closes_at_no_time() {
    let airspace = sydney();
    let feature = r#"{"type": "Feature", "id": "z", "geometry": {"type": "Point", "coordinates": [151.2093, -33.8688]},
        "properties": {"radius_m": 400, "windows": [{"from": "2026-11-30T00:00:00Z", "until": "2026-12-04T23:00:00Z",
        "schedule": [{"days": ["sat"], "from": "10:00+02:00", "until": "12:00+02:00"}]}]}}"#;
    let feed = read(feature, &airspace);
    let zone = Arc::new(zones(&feed)[0].clone());
    let closure = Arc::new(Closure::of_zone(airspace.topology(), zone.clone()));
    for day in [29, 30] {
        let now = format!("2026-11-{day}T12:00:00Z");
        let now: Timestamp = now.parse().expect("an instant");
        let airspace = airspace.apply(&[Change::Put(closure.clone())], now);
        assert!(!airspace.is_in_force("z"), "{now}");
        assert!(!zone.counts_at(now, SignedDuration::from_hours(1)), "{now}");
        let held = airspace.closure("z").expect("it is held");
        assert_eq!(airspace.closes_from(held, now), None);
    }
}

/// A volume as ED-269 has it.
fn volume(upper: &str, projection: &str) -> String {
    format!(
        r#"{{"uomDimensions": "M", "lowerLimit": 50, "lowerVerticalReference": "AGL", "upperLimit": {upper},
            "upperVerticalReference": "AGL", "horizontalProjection": {projection}}}"#
    )
}

fn ed269(restriction: &str, volumes: &[String]) -> String {
    let volumes = volumes.join(",");
    format!(
        r#"{{"features": [{{"identifier": "z", "restriction": "{restriction}", "geometry": [{volumes}],
            "applicability": [{{"permanent": "YES"}}]}}]}}"#
    )
}

#[test]
fn what_can_be_read_of_a_refused_zone_is_closed_at_all_heights_and_always() {
    let airspace = sydney();
    let circle = r#"{"type": "Circle", "center": [151.21, -33.86], "radius": 100}"#;
    let bent = r#"{"type": "Polygon", "coordinates": [[[151.2, -33.86], [151.21, -33.87], [151.2, -33.87], [151.21, -33.86]]]}"#;
    let feature = |kind: &str| {
        format!(
            r#"{{"type": "FeatureCollection", "features": [{{"type": "Feature", "id": "z",
                "geometry": {{"type": "Point", "coordinates": [151.21, -33.86]}},
                "properties": {{"kind": "{kind}", "radius_m": 100, "margin_m": 30, "upper_m": "high",
                    "windows": [{{"from": "2026-11-25T12:00:00Z", "until": "2026-11-25T13:00:00Z"}}]}}}}]}}"#
        )
    };
    let read_kinds = |text: &str| -> Vec<(String, ZoneKind)> {
        let feed = read(text, &airspace);
        let [zone] = &feed.zones[..] else {
            panic!("one zone in {text}");
        };
        assert!(zone.outcome.is_err(), "{text}");
        for outline in &zone.outlines {
            assert_eq!(outline.band(), &AltitudeBand::UNLIMITED, "{text}");
            assert!(outline.windows().is_empty() && !outline.recurs(), "{text}");
            let source = outline.terms().source.as_ref().expect("a source");
            assert_eq!((&*source.feed, &*source.id), ("test", "z"), "{text}");
        }
        let outlines = zone.outlines.iter();
        outlines
            .map(|zone| (zone.id().to_owned(), zone.terms().kind))
            .collect()
    };
    let closed = |id: &str, kind| (id.to_owned(), kind);
    let odd = volume("\"high\"", circle);
    let sound = volume("100", circle);
    for (text, outlines) in [
        (
            ed269("REQ_AUTHORISATION", std::slice::from_ref(&odd)),
            vec![closed("z", ZoneKind::ReqAuthorization)],
        ),
        // A type that nobody knows closes.
        (
            ed269("SECRET", &[odd.clone(), sound]),
            vec![
                closed("z~1", ZoneKind::Prohibited),
                closed("z~2", ZoneKind::Prohibited),
            ],
        ),
        // What closes nothing would close nothing if it could be read.
        (ed269("NO_RESTRICTION", std::slice::from_ref(&odd)), vec![]),
        // A shape that is none.
        (ed269("PROHIBITED", &[volume("100", bent)]), vec![]),
        (ed269("PROHIBITED", &[odd, volume("100", bent)]), vec![]),
        (
            feature("conditional"),
            vec![closed("z", ZoneKind::Conditional)],
        ),
        (feature("uspace"), vec![]),
    ] {
        assert_eq!(read_kinds(&text), outlines, "{text}");
    }
    let drawn = read(&feature("prohibited"), &airspace);
    assert_eq!(drawn.zones[0].outlines[0].margin_m(), 30.0);
    let negative = feature("prohibited").replace("\"margin_m\": 30", "\"margin_m\": -1");
    let drawn = read(&negative, &airspace);
    assert_eq!(drawn.zones[0].outlines[0].margin_m(), 10.0);
}

#[test]
fn no_fence_that_keeps_drones_in_is_closed() {
    let airspace = sydney();
    let plan = PLAN.replace("\"inclusion\": false", "\"inclusion\": true");
    assert_ne!(plan, PLAN);
    let feed = read(&plan, &airspace);
    let refused = feed.zones.iter().filter(|zone| zone.outcome.is_err());
    let outlines: Vec<usize> = refused.map(|zone| zone.outlines.len()).collect();
    assert!(
        !outlines.is_empty() && outlines.iter().all(|&count| count == 0),
        "{outlines:?}"
    );
}
