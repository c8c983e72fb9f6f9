//! Shapes survive the way through messages, and what is wrong in a message is told as it is in JSON.

use crate::api::grpc::convert::{FromProto, IntoProto, instant_text, timestamp};
use crate::api::grpc::convert_plan::telemetry_value;
use crate::api::grpc::convert_report::parsed_report;
use crate::api::grpc::convert_zone::{feature_of, zone_of};
use crate::api::grpc::plans::{acknowledgement, delivery_request};
use crate::api::grpc::proto::{self, zone::Geometry};
use crate::api::grpc::sample::{Sample, Sampler};
use crate::edge::Code;
use crate::formats::{ZoneId, zone_from_feature, zone_to_feature};
use crate::geo::Frame;
use crate::wire;
use prost::Message;
use serde_json::json;
use std::fmt::Debug;

const CASES: u64 = 200;

/// Through a message, its bytes and back, nothing is lost.
fn survives<T, P>(what: &str)
where
    T: Sample + IntoProto<P> + FromProto<P> + Clone + Debug + PartialEq,
    P: Message + Default,
{
    for seed in 0..CASES {
        let mut sampler = Sampler::new(seed);
        let shape = T::sample(&mut sampler);
        let bytes = shape.clone().into_proto().encode_to_vec();
        let message = P::decode(bytes.as_slice()).expect("what was encoded is decoded");
        let back = T::from_proto(message);
        assert_eq!(back.as_ref(), Ok(&shape), "{what}, seed {seed}");
    }
}

#[test]
fn every_shape_survives_the_way_through_messages() {
    // What these contain is tested with them.
    survives::<wire::FailureReport, proto::FailureReport>("FailureReport");
    survives::<wire::Recomposition<'static>, proto::RecompositionAnswer>("Recomposition");
    survives::<wire::BatchAnswer<'static>, proto::ReportFailuresResponse>("BatchAnswer");
    survives::<wire::Plan<'static>, proto::Plan>("Plan");
    survives::<wire::Plans<'static>, proto::ListPlansResponse>("Plans");
    survives::<wire::Event<'static>, proto::Event>("Event");
    survives::<wire::Nearest<'static>, proto::NearestResponse>("Nearest");
    survives::<wire::DroneMessage<'static>, proto::DroneMessage>("DroneMessage");
    survives::<wire::Welcome<'static>, proto::Welcome>("Welcome");
    survives::<wire::TelemetryAnswer<'static>, proto::ReportTelemetryResponse>("TelemetryAnswer");
}

#[test]
fn requests_say_what_their_bodies_say() {
    let at = || timestamp("2026-11-27T18:00:00Z");
    let delivery = proto::CreatePlanRequest {
        id: Some("p-1".to_owned()),
        source: "12".to_owned(),
        destination: Some("north".to_owned()),
        start_time: at(),
        payload_kg: Some(1.5),
        drone_id: Some("d-1".to_owned()),
        airspeed_mps: Some(14.0),
        idempotency_key: Some("k".to_owned()),
        airframe: Some("m100".to_owned()),
        battery_fraction: Some(0.9),
        objective: Some("time".to_owned()),
        deadline: timestamp("2026-11-27T19:30:00Z"),
        priority: Some(90),
        stops: vec![proto::ServiceStop {
            node: "14".to_owned(),
            service_s: 90.0,
        }],
        delivery_id: Some("o-1".to_owned()),
    };
    let body = json!({
        "id": "p-1", "source": "12", "destination": "north", "start_time": "2026-11-27T18:00:00Z",
        "payload_kg": 1.5, "drone_id": "d-1", "airspeed_mps": 14.0,
        "airframe": "m100", "battery_fraction": 0.9, "objective": "time", "deadline": "2026-11-27T19:30:00Z",
        "priority": 90, "stops": [{"node": "14", "service_s": 90.0}], "delivery_id": "o-1",
    });
    let read = delivery_request(delivery).map(|read| json!(read));
    assert_eq!(read, Ok(body));
}

#[test]
fn other_requests_say_what_their_bodies_say() {
    let at = || timestamp("2026-11-27T18:00:00Z");
    let acknowledged = proto::AcknowledgePlanRequest {
        id: "p-1".to_owned(),
        version: 2,
        location: Some(wire::Place::Pair([151.2, -33.8]).into_proto()),
        ..Default::default()
    };
    let read = acknowledgement(acknowledged).map(|read| json!(read));
    assert_eq!(read, Ok(json!({"version": 2, "location": [151.2, -33.8]})));

    let entry = proto::TelemetryEntry {
        drone_id: "d-1".to_owned(),
        location: Some(wire::Place::Node(wire::Id::from(7)).into_proto()),
        timestamp: at(),
        altitude_m: Some(80.0),
        battery_fraction: Some(f64::NAN),
        ..Default::default()
    };
    let body = json!({
        "drone_id": "d-1", "location": {"node": "7"}, "timestamp": "2026-11-27T18:00:00Z",
        "altitude_m": 80.0, "battery_fraction": "not finite",
    });
    assert_eq!(telemetry_value(entry), body);
}

#[test]
fn numbers_that_json_cannot_have_are_refused_with_their_place() {
    let delivery = proto::CreatePlanRequest {
        payload_kg: Some(f64::INFINITY),
        ..Default::default()
    };
    let refusal = delivery_request(delivery).expect_err("infinite");
    assert_eq!(refusal.code, Code::BodyInvalid);
    assert_eq!(refusal.faults[0].pointer, "/payload_kg");

    let acknowledged = |place| proto::AcknowledgePlanRequest {
        version: 1,
        location: Some(proto::Place { place }),
        ..Default::default()
    };
    let (x, y) = (f64::NAN, 0.0);
    let planar = proto::place::Place::Planar(proto::PlanarPosition { x, y });
    for place in [None, Some(planar)] {
        let refusal = acknowledgement(acknowledged(place)).expect_err("no place");
        assert_eq!(refusal.faults[0].pointer, "/location");
    }
}

#[test]
fn a_report_that_says_what_nobody_knows_is_read_with_warnings() {
    let report = proto::FailureReport {
        r#type: 99,
        strategy: -1,
        scope: 3,
        location: Some(proto::Place { place: None }),
        drone: Some(proto::DroneFacts {
            payload_kg: Some(f64::NAN),
            ..Default::default()
        }),
        remaining_path: vec!["1".to_owned(), "2".to_owned()],
        timestamp: Some(proto::Timestamp {
            seconds: i64::MAX,
            nanos: -1,
        }),
        ..Default::default()
    };
    let parsed = parsed_report(report);
    let codes: Vec<&str> = parsed.warnings.iter().map(|warning| warning.code).collect();
    let expected = [
        "location_ignored",
        "unknown_failure_type",
        "wrong_type",
        "unknown_value",
        "unknown_value",
    ];
    assert_eq!(codes, expected);
    assert_eq!(parsed.report.failure, None);
    assert_eq!(parsed.report.location, None);
    assert_eq!(parsed.report.location_unknown, Some(true));
    let path = [1, 2].map(wire::Id::from).to_vec();
    assert_eq!(parsed.report.remaining_path, Some(path));
    // The one who looks things up passes over a time that is none, as over any other.
    let time = parsed.report.timestamp.expect("is handed on");
    assert!(time.parse::<jiff::Timestamp>().is_err(), "{time}");

    let nothing = parsed_report(proto::FailureReport::default());
    assert_eq!(nothing.report, wire::FailureReport::default());
    assert_eq!(nothing.warnings, []);
}

#[test]
fn any_bytes_are_a_message_or_none_and_no_message_panics() {
    for seed in 0..CASES {
        let mut sampler = Sampler::new(seed);
        let report = wire::FailureReport::sample(&mut sampler);
        let mut bytes = report.into_proto().encode_to_vec();
        for _ in 0..1 + sampler.below(6) {
            let place = sampler.below(bytes.len().max(1) as u64) as usize;
            if let Some(byte) = bytes.get_mut(place) {
                *byte = sampler.below(256) as u8;
            }
        }
        if let Ok(message) = proto::FailureReport::decode(bytes.as_slice()) {
            let parsed = parsed_report(message);
            let _ = parsed.report.into_proto();
        }
    }
}

#[test]
fn instants_keep_their_nanoseconds_on_both_sides_of_1970() {
    for text in [
        "1969-12-31T23:59:59.999999999Z",
        "1969-12-31T23:59:59Z",
        "1970-01-01T00:00:00Z",
        "2026-11-27T18:00:00.5Z",
        "-009999-01-02T01:59:59Z",
    ] {
        let message = timestamp(text).expect("an instant");
        assert!((0..1_000_000_000).contains(&message.nanos), "{text}");
        assert_eq!(instant_text(&message), text);
    }
    assert_eq!(timestamp("tomorrow"), None);
    for (seconds, nanos) in [(i64::MIN, 0), (0, -1), (0, 1_000_000_000), (i64::MAX, 7)] {
        let text = instant_text(&proto::Timestamp { seconds, nanos });
        assert_eq!(timestamp(&text), None, "{text}");
    }
}

fn square() -> proto::Polygon {
    let corners = [
        [0.0, 0.0],
        [90.0, 0.0],
        [90.0, 90.0],
        [0.0, 90.0],
        [0.0, 0.0],
    ];
    let positions = corners.map(|[x, y]| proto::Coordinates { x, y }).to_vec();
    let rings = vec![proto::Ring { positions }];
    proto::Polygon { rings }
}

fn zone() -> proto::Zone {
    proto::Zone {
        id: "harbour".to_owned(),
        reason: Some("crowd".to_owned()),
        geometry: Some(Geometry::Polygon(square())),
        upper: Some(proto::Altitude {
            value_m: 120.0,
            reference: proto::AltitudeReference::Amsl as i32,
        }),
        windows: vec![proto::Window {
            from: timestamp("2026-11-27T18:00:00Z"),
            until: timestamp("2026-11-27T23:00:00Z"),
        }],
        margin_m: Some(5.0),
        ..Default::default()
    }
}

#[test]
fn a_zone_is_the_same_after_the_reader_of_features_has_checked_it() {
    let circle = Geometry::Circle(proto::Circle {
        centre: Some(proto::Coordinates { x: 1.0, y: 2.0 }),
        radius_m: 30.0,
    });
    let multi = Geometry::MultiPolygon(proto::MultiPolygon {
        polygons: vec![square()],
    });
    for geometry in [Geometry::Polygon(square()), multi, circle] {
        let sent = proto::Zone {
            geometry: Some(geometry),
            ..zone()
        };
        let read = zone_from_feature(&feature_of(&sent), ZoneId::Stated, &Frame::Planar);
        let told = zone_of(&zone_to_feature(&read.expect("a valid zone")));
        assert_eq!(told, sent);
    }
}

#[test]
fn the_reader_of_features_finds_what_is_wrong_with_a_zone() {
    type Spoil = fn(&mut proto::Zone);
    let spoilt: [(Spoil, &str, &str); 7] = [
        (|zone| zone.geometry = None, "/geometry", "is missing"),
        (
            |zone| zone.margin_m = Some(f64::NAN),
            "/properties/margin_m",
            "not a number",
        ),
        (
            |zone| {
                zone.upper = Some(proto::Altitude {
                    value_m: 1.0,
                    reference: 9,
                })
            },
            "/properties/upper_reference",
            "nothing is known of the reference '9'",
        ),
        (
            |zone| {
                zone.lower = Some(proto::Altitude {
                    value_m: f64::INFINITY,
                    reference: 0,
                })
            },
            "/properties/lower_m",
            "not a number",
        ),
        (
            |zone| {
                zone.windows[0].until = Some(proto::Timestamp {
                    seconds: i64::MAX,
                    nanos: 0,
                })
            },
            "/properties/windows/0/until",
            "is no instant",
        ),
        (
            |zone| zone.geometry = Some(Geometry::Circle(proto::Circle::default())),
            "/geometry/coordinates",
            "is missing",
        ),
        (
            |zone| {
                let mut open = square();
                open.rings[0].positions.pop();
                zone.geometry = Some(Geometry::Polygon(open));
            },
            "/geometry/coordinates/0",
            "",
        ),
    ];
    for (spoil, pointer, words) in spoilt {
        let mut zone = zone();
        spoil(&mut zone);
        let read = zone_from_feature(&feature_of(&zone), ZoneId::Stated, &Frame::Planar);
        let problems = read.expect_err(pointer);
        let found = problems
            .iter()
            .any(|problem| problem.pointer.starts_with(pointer) && problem.message.contains(words));
        assert!(found, "{pointer} {words}: {problems:?}");
    }
}
