//! What in a failure report is not believed or not understood: warnings, doubts, and bodies that are no report.

use super::{NOTHING, NOW, Told, airspace, nodes, settle, story};
use jiff::Timestamp;
use serde_json::{Value, json};
use skyway::formats::{CloseTarget, Known, lenient_report, parse_report, resolve_report};

#[test]
fn what_cannot_be_believed_is_told_and_some_of_it_makes_a_report_doubtful() {
    let with = |name: &str, value: Value| json!({"service": {"from": "A", "to": "B"}, name: value});
    let at = |time: &str| with("timestamp", json!(time));
    let told = Told {
        now: Some(NOW),
        ..NOTHING
    };
    let calm = "AB start to B navigational;";
    let ok = |codes: &str| format!("{calm} {codes}").trim_end().to_owned();
    let doubtful = |codes: &str| format!("{calm} doubtful: {codes}");
    let drone = |name: &str, value: f64| with("drone", json!({name: value}));
    let named = |id: &str| {
        let place = json!({"type": "Point", "coordinates": [900, 900]});
        json!({"type": "Feature", "id": id, "geometry": place, "properties": {"radius_m": 1}})
    };
    let cases = [
        (at("2026-11-27T18:00:05Z"), ok("")),
        (at("2026-11-27T18:00:06Z"), doubtful("timestamp_doubtful")),
        (at("2026-11-27T17:55:00Z"), ok("")),
        (at("2026-11-27T17:54:59Z"), doubtful("timestamp_doubtful")),
        (at("noon"), ok("timestamp_ignored")),
        (
            with("timestamp", json!(1_795_802_400)),
            ok("timestamp_ignored"),
        ),
        (with("deadline", json!("soon")), ok("deadline_ignored")),
        (with("deadline", json!("2026-11-27T19:00:00Z")), ok("")),
        (with("objective", json!("distance")), ok("")),
        (
            with("objective", json!("time")),
            ok("objective_unsupported"),
        ),
        (with("objective", json!(5)), ok("objective_unsupported")),
        (drone("airspeed_mps", 100.0), ok("")),
        (drone("airspeed_mps", 100.1), ok("airspeed_ignored")),
        (drone("airspeed_mps", 0.0), ok("airspeed_ignored")),
        (drone("battery_fraction", 1.0), ok("")),
        (drone("battery_fraction", 87.0), ok("battery_ignored")),
        (drone("battery_fraction", -0.1), ok("battery_ignored")),
        (
            with("type", json!("gremlins")),
            doubtful("unknown_failure_type"),
        ),
        (with("type", Value::Null), ok("missing_failure_type")),
        (with("zone", json!({})), ok("zone_ignored")),
        (with("zone", named("..")), ok("zone_ignored")),
        (with("zone", named("...")), ok("")),
        (
            with("close", json!(["Q", "A", ["A", "B"], ["A", "E"]])),
            ok("close_ignored"),
        ),
        (with("close", json!(5)), ok("wrong_type")),
        (with("certificate", json!(true)), ok("")),
    ];
    for (report, expected) in cases {
        // A zone that cannot be read has a warning for each of its faults.
        let mut report = report;
        if report.get("type").is_none() {
            report["type"] = json!("navigational");
        }
        let story = story(&report, told);
        let story = story.replace(" zone_ignored zone_ignored", " zone_ignored");
        assert_eq!(story, expected, "{report}");
    }
}

#[test]
fn warnings_say_what_was_meant() {
    let message = |fields: Value| {
        let mut parsed = lenient_report(fields).expect("an object");
        let known = Known::nothing();
        resolve_report(&parsed.report, &known, &airspace(), &mut parsed.warnings).expect("settled");
        parsed.warnings[0].message.clone()
    };
    let leg = json!({"from": "A", "to": "B"});
    let drone = json!({"battery_fraction": 87});
    let percent = message(json!({"service": leg, "type": "operational", "drone": drone}));
    assert!(percent.ends_with("did you mean 0.87?"), "{percent}");
    let slip = message(json!({"service": leg, "destinaton": "E"}));
    assert!(slip.ends_with("was 'destination' meant?"), "{slip}");
    let long = message(json!({"service": leg, "strategy": "x".repeat(100_000)}));
    assert!(long.len() < 200, "{} bytes", long.len());
    let many: Value = (0..10_000)
        .map(|number| (number.to_string(), json!(0)))
        .collect();
    let warnings = lenient_report(many).expect("an object").warnings;
    assert_eq!(warnings.len(), 9);
    assert!(
        warnings[8].message.starts_with("9992 more"),
        "{:?}",
        warnings[8]
    );
}

#[test]
fn what_is_closed_beforehand_is_found() {
    let report = json!({"service": {"from": "A", "to": "B"}, "close": ["E", ["D", "C"], "A-C"]});
    let (settled, _) = settle(&report, NOTHING);
    let airspace = airspace();
    let topology = airspace.topology();
    let segment = |letters: &str| {
        let ends = nodes(topology, letters);
        let found = topology.segment_between(ends[0], ends[1]);
        CloseTarget::Segment(found.expect("a line of the drawing"))
    };
    let node = CloseTarget::Node(nodes(topology, "E")[0]);
    let expected = [node, segment("CD"), segment("AC")];
    assert_eq!(settled.expect("settled").close, expected);
}

#[test]
fn a_body_that_is_no_object_is_a_problem_with_its_place() {
    let told = |body: &str| {
        let problem = parse_report(body.as_bytes()).expect_err("a problem");
        (problem.code(), problem.to_string())
    };
    assert_eq!(told("[1, \"navigational\"]").0, "report_not_an_object");
    assert_eq!(told(" null").0, "report_not_an_object");
    assert_eq!(told("").0, "report_not_json");
    let (code, message) = told("{\"drone\":\n {\"payload_kg\": 1e999}}");
    assert_eq!(code, "report_not_json");
    assert!(message.contains("line 2, column "), "{message}");
    assert!(message.ends_with("leave the field out"), "{message}");
    let deep = "[".repeat(100_000);
    assert_eq!(told(&format!("{{\"zone\": {deep}")).0, "report_not_json");
}

/// `now` of the daemon and the time of the snapshot are one.
#[test]
fn nothing_known_believes_any_time() {
    let report = json!({"service": {"from": "A", "to": "B"}, "type": "navigational",
        "timestamp": Timestamp::UNIX_EPOCH.to_string()});
    assert_eq!(story(&report, NOTHING), "AB start to B navigational;");
}
