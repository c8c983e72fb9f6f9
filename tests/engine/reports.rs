//! What a failure report settles to, rule by rule, on a small map.
//!
//! ```text
//! C . . . D        A - B is 400 m long; C - D the way around it.
//! . . . . .        A - C, B - D and C - D are open; E hangs on B, and Z on nothing.
//! A . . . B . E . . Z
//! ```

mod doubts;

use jiff::SignedDuration;
use serde_json::{Value, json};
use skyway::airspace::Airspace;
use skyway::flight::Location;
use skyway::formats::{
    Known, KnownPlan, ReportProblem, ResolvedReport, parse_report, resolve_report,
};
use skyway::geo::Point;
use skyway::network::{NodeIx, Topology, sketch};
use std::sync::Arc;

const NOW: &str = "2026-11-27T18:00:00Z";

fn airspace() -> Airspace {
    let drawing = "
C...D
.....
A...B.E..Z";
    let segments = [("A", "B"), ("A", "C"), ("C", "D"), ("D", "B"), ("B", "E")];
    let topology = Arc::new(sketch(drawing, &segments));
    let now = NOW.parse().expect("a time");
    Airspace::open(topology, 1, now, SignedDuration::from_mins(60))
}

fn nodes(topology: &Topology, letters: &str) -> Vec<NodeIx> {
    let node = |letter: char| topology.node(&letter.to_string());
    letters
        .chars()
        .map(|letter| node(letter).expect("a letter of the drawing"))
        .collect()
}

/// What is known of the drone, in letters.
#[derive(Clone, Copy, Default)]
struct Told<'a> {
    plan: Option<(&'a str, Option<usize>)>,
    position: Option<(f64, f64)>,
    age_s: f64,
    now: Option<&'a str>,
}

fn settle(
    report: &Value,
    told: Told<'_>,
) -> (Result<ResolvedReport, ReportProblem>, Vec<&'static str>) {
    let airspace = airspace();
    let plan = told
        .plan
        .map(|(letters, leg)| (nodes(airspace.topology(), letters), leg));
    let known = Known {
        plan: plan.as_ref().map(|(nodes, leg)| KnownPlan {
            nodes,
            leg: *leg,
            before: None,
            is_meant: true,
        }),
        position: told.position.map(|(x, y)| Point::new(x, y)),
        position_age_s: told.age_s,
        now: told.now.map(|now| now.parse().expect("a time")),
        ..Known::nothing()
    };
    let mut parsed = parse_report(report.to_string().as_bytes()).expect("an object");
    let settled = resolve_report(&parsed.report, &known, &airspace, &mut parsed.warnings);
    let codes = parsed.warnings.iter().map(|warning| warning.code);
    (settled, codes.collect())
}

/// A report settled, in one line: `AB start to E by ABE navigational; doubtful: codes`.
fn story(report: &Value, told: Told<'_>) -> String {
    let (settled, codes) = settle(report, told);
    let codes = codes.join(" ");
    let settled = match settled {
        Ok(settled) => settled,
        Err(problem) => {
            let told = format!("{} at '{}': {codes}", problem.code(), problem.pointer());
            return told.trim_end().to_owned();
        }
    };
    let airspace = airspace();
    let letter = |&node: &NodeIx| airspace.topology().node_id(node).to_owned();
    let report = &settled.request.report;
    let place = match report.location {
        Location::LegStart => "start".to_owned(),
        Location::Unknown => "anywhere".to_owned(),
        Location::At(point) => format!("({}, {})", point.x, point.y),
    };
    let path = report
        .remaining_path
        .as_ref()
        .map_or_else(String::new, |path| {
            format!(" by {}", path.iter().map(letter).collect::<String>())
        });
    let leg = letter(&report.leg.0) + &letter(&report.leg.1);
    let destination = letter(&report.destination);
    let failure = report.failure.name();
    let doubtful = if settled.doubts { " doubtful:" } else { "" };
    let told = format!("{leg} {place} to {destination}{path} {failure};{doubtful} {codes}");
    told.trim_end().to_owned()
}

fn check(cases: &[(Value, Told<'_>, &str)]) {
    for (fields, told, expected) in cases {
        let mut report = json!({"type": "navigational"});
        for (name, value) in fields.as_object().expect("fields") {
            report[name] = value.clone();
        }
        assert_eq!(story(&report, *told), *expected, "{report}");
    }
}

const NOTHING: Told<'static> = Told {
    plan: None,
    position: None,
    age_s: 0.0,
    now: None,
};

fn plan(letters: &str, leg: Option<usize>) -> Told<'_> {
    Told {
        plan: Some((letters, leg)),
        ..NOTHING
    }
}

fn seen(x: f64, y: f64) -> Told<'static> {
    Told {
        position: Some((x, y)),
        ..NOTHING
    }
}

#[test]
fn the_leg_is_the_first_that_anything_tells() {
    let by_plan = |leg: i64| json!({"service": {"plan_id": "p", "leg": leg}});
    let ends = json!({"from": "A", "to": "B"});
    let both = json!({"plan_id": "p", "leg": 1, "from": "A", "to": "B"});
    let acdbe = |leg| plan("ACDBE", leg);
    check(&[
        (
            by_plan(1),
            acdbe(None),
            "CD anywhere to E by CDBE navigational;",
        ),
        (
            json!({"service": both}),
            acdbe(None),
            "CD anywhere to E by CDBE navigational;",
        ),
        (
            by_plan(9),
            acdbe(Some(2)),
            "DB anywhere to E by DBE navigational; doubtful: unknown_leg",
        ),
        (
            by_plan(9),
            acdbe(Some(9)),
            "BE anywhere to E by BE navigational; doubtful: unknown_leg",
        ),
        (
            by_plan(9),
            acdbe(None),
            "BE anywhere to E by BE navigational; doubtful: unknown_leg",
        ),
        (
            json!({"service": both}),
            NOTHING,
            "AB start to B navigational; unknown_plan",
        ),
        (
            json!({"service": ends}),
            acdbe(Some(1)),
            "AB start to E navigational;",
        ),
        (
            json!({"service": ends, "remaining_path": ["A", "C"]}),
            NOTHING,
            "AB start to B navigational; remaining_path_ignored",
        ),
        (
            json!({"remaining_path": ["A", "B", "E"]}),
            acdbe(Some(1)),
            "AB start to E by ABE navigational;",
        ),
        (
            json!({"service": {"plan_id": "p"}, "remaining_path": ["A", "B"]}),
            NOTHING,
            "AB anywhere to B by AB navigational; unknown_plan",
        ),
        (
            json!({}),
            acdbe(Some(1)),
            "CD anywhere to E by CDBE navigational;",
        ),
        (
            json!({}),
            acdbe(None),
            "AC anywhere to E by ACDBE navigational; doubtful: leg_assumed",
        ),
        (
            json!({"location": {"x": 390, "y": 150}}),
            acdbe(None),
            "DB (390, 150) to E by DBE navigational; doubtful: leg_assumed",
        ),
        (
            json!({"location": {"x": 390, "y": 150}}),
            acdbe(Some(0)),
            "AC (390, 150) to E by ACDBE navigational;",
        ),
        (json!({}), plan("A", Some(0)), "report_not_located at '':"),
        (json!({}), NOTHING, "report_not_located at '':"),
    ]);
}

#[test]
fn a_place_alone_tells_the_nearest_leg_toward_the_destination() {
    let at = |x: f64, y: f64| json!({"location": {"x": x, "y": y}, "destination": "E"});
    let away = json!({"location": [100, 20], "destination": "C"});
    let node = |destination: &str| json!({"location": {"node": "B"}, "destination": destination});
    check(&[
        (
            at(100.0, 20.0),
            NOTHING,
            "AB (100, 20) to E navigational; doubtful: leg_assumed",
        ),
        (
            away,
            NOTHING,
            "BA (100, 20) to C navigational; doubtful: leg_assumed",
        ),
        (
            at(200.0, 290.0),
            NOTHING,
            "CD (200, 290) to E navigational; doubtful: leg_assumed",
        ),
        (
            json!({"destination": "E"}),
            seen(100.0, 20.0),
            "AB (100, 20) to E navigational; doubtful: leg_assumed",
        ),
        (
            json!({"location": [1, 2, 3, 4], "destination": "E"}),
            seen(100.0, 20.0),
            "AB (100, 20) to E navigational; doubtful: location_ignored leg_assumed",
        ),
        (
            node("E"),
            NOTHING,
            "BE start to E navigational; doubtful: leg_assumed",
        ),
        (
            node("C"),
            NOTHING,
            "BA start to C navigational; doubtful: leg_assumed",
        ),
        (
            json!({"location": [100, 20]}),
            NOTHING,
            "AB (100, 20) to B operational; doubtful: leg_assumed destination_unknown",
        ),
    ]);
}

#[test]
fn a_node_that_nobody_knows_is_passed_over_while_anything_else_locates_the_drone() {
    let half = json!({"service": {"from": "B", "to": "Q"}, "destination": "E"});
    let mut with_place = half.clone();
    with_place["location"] = json!([20, 100]);
    let mut with_path = half.clone();
    with_path["remaining_path"] = json!(["D", "B", "E"]);
    let unknown = json!({"service": {"from": "Q", "to": "R"}});
    check(&[
        (
            half,
            NOTHING,
            "BE start to E navigational; doubtful: unknown_node leg_assumed",
        ),
        (
            with_place,
            NOTHING,
            "CA (20, 100) to E navigational; doubtful: unknown_node leg_assumed",
        ),
        (
            with_path,
            NOTHING,
            "DB start to E by DBE navigational; doubtful: unknown_node",
        ),
        (
            unknown.clone(),
            NOTHING,
            "report_unknown_node at '/service/from': unknown_node unknown_node",
        ),
        (
            unknown,
            seen(20.0, 10.0),
            "AB (20, 10) to B operational; doubtful: unknown_node unknown_node leg_assumed destination_unknown",
        ),
        (
            json!({"service": {"from": "B"}, "destination": "D"}),
            NOTHING,
            "BD start to D navigational; doubtful: leg_assumed",
        ),
        (
            json!({"service": {"from": "Z", "to": "Q"}}),
            NOTHING,
            "ZZ start to Z operational; doubtful: unknown_node leg_assumed destination_unknown",
        ),
        (
            json!({"service": {"from": "A", "to": "D"}}),
            NOTHING,
            "AD start to D navigational; doubtful:",
        ),
        (
            json!({"remaining_path": ["A", "B", "Q", "E"]}),
            NOTHING,
            "AB start to E navigational; remaining_path_ignored",
        ),
        (
            json!({"remaining_path": ["A", null, "E"]}),
            NOTHING,
            "AB start to E navigational; doubtful: remaining_path_ignored leg_assumed",
        ),
    ]);
}

#[test]
fn the_destination_is_the_first_that_anything_tells() {
    let leg = json!({"from": "A", "to": "B"});
    let to = |destination: &str| json!({"service": leg, "destination": destination});
    let path = json!(["A", "B", "D", "C"]);
    let on_path = |destination: &str| json!({"remaining_path": path, "destination": destination});
    check(&[
        (to("E"), plan("ABD", Some(0)), "AB start to E navigational;"),
        (
            to("Q"),
            plan("ABD", Some(0)),
            "AB start to D by ABD navigational; unknown_destination",
        ),
        (
            to("Q"),
            NOTHING,
            "AB start to B navigational; unknown_destination",
        ),
        (on_path("D"), NOTHING, "AB start to D by ABD navigational;"),
        (
            on_path("E"),
            NOTHING,
            "AB start to E navigational; remaining_path_ignored",
        ),
        (
            on_path("Q"),
            plan("ABE", Some(0)),
            "AB start to C by ABDC navigational; unknown_destination",
        ),
    ]);
}

#[test]
fn a_place_of_telemetry_off_the_leg_counts_while_the_drone_cannot_have_come_to_the_leg_since() {
    let by_plan = json!({"service": {"plan_id": "p", "leg": 0}});
    let seen_for_s = |age_s: f64, (x, y): (f64, f64)| Told {
        position: Some((x, y)),
        age_s,
        ..plan("ABE", None)
    };
    let (at_c, on_leg) = ((0.0, 200.0), (120.0, 7.0));
    let on_leg_told = "AB (120, 7) to E by ABE navigational;";
    check(&[
        (
            by_plan.clone(),
            seen_for_s(5.0, at_c),
            "AB (0, 200) to E by ABE navigational;",
        ),
        (
            by_plan.clone(),
            seen_for_s(120.0, at_c),
            "AB anywhere to E by ABE navigational; position_outdated",
        ),
        (by_plan, seen_for_s(120.0, on_leg), on_leg_told),
    ]);
}

#[test]
fn a_missing_place_is_that_of_telemetry_and_else_the_start_of_a_leg_by_nodes() {
    let leg = json!({"from": "A", "to": "B"});
    let with = |name: &str, value: Value| json!({"service": leg, name: value});
    let by_plan = json!({"service": {"plan_id": "p", "leg": 0}});
    let known = Told {
        position: Some((120.0, 7.0)),
        ..plan("ABE", None)
    };
    check(&[
        (
            json!({"service": leg}),
            known,
            "AB (120, 7) to E by ABE navigational;",
        ),
        (by_plan, known, "AB (120, 7) to E by ABE navigational;"),
        (
            with("location", json!({"node": "A"})),
            NOTHING,
            "AB start to B navigational;",
        ),
        (
            with("location", json!({"node": "B"})),
            NOTHING,
            "AB (400, 0) to B navigational;",
        ),
        (
            with("location", json!([50, 0])),
            NOTHING,
            "AB (50, 0) to B navigational;",
        ),
        (
            with("location", Value::Null),
            NOTHING,
            "AB start to B navigational;",
        ),
        (
            with("location_unknown", json!(true)),
            NOTHING,
            "AB anywhere to B navigational;",
        ),
        (
            with("location", json!("here")),
            NOTHING,
            "AB anywhere to B navigational; doubtful: location_ignored",
        ),
        (
            with("location", json!({"node": "Q"})),
            NOTHING,
            "AB anywhere to B navigational; doubtful: location_ignored",
        ),
        (
            with("location", json!([1e300, 0])),
            NOTHING,
            "AB anywhere to B navigational; doubtful: location_ignored",
        ),
        (
            with("location", json!([99_000, 0])),
            NOTHING,
            "AB anywhere to B navigational; doubtful: location_doubtful",
        ),
        (
            with("location", json!([102_000, 0])),
            NOTHING,
            "AB anywhere to B navigational; doubtful: location_doubtful",
        ),
        (
            with("cause_location", json!([])),
            NOTHING,
            "AB start to B navigational; doubtful: location_ignored",
        ),
    ]);
}
