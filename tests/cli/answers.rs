//! Answers to failures: every strategy, zones and closures, certificates, plans, pictures.

use crate::binary::{Workspace, skyway};
use serde_json::{Value, json};

/// A leg of a plan through the middle of Sydney, where what is best locally is not best.
const FAILURE: [&str; 4] = ["--service", "379,406", "--destination", "450"];

fn with_failure<'a>(command: &[&'a str], rest: &[&'a str]) -> Vec<&'a str> {
    [command, &FAILURE, rest].concat()
}

/// The answer without what differs from run to run.
fn timeless(mut answer: Value) -> Value {
    let fields = answer.as_object_mut().expect("an object");
    let elapsed_us = fields.remove("elapsed_us").expect("a time");
    assert!(elapsed_us.as_f64().expect("a number") > 0.0);
    answer
}

fn reroute(rest: &[&str]) -> Value {
    let arguments = with_failure(&["reroute", "--json"], rest);
    timeless(skyway(&arguments).exits(0).json())
}

#[test]
fn an_answer_for_people() {
    let run = skyway(&with_failure(
        &["reroute", "--strategy", "two_phased", "--explain"],
        &[],
    ));
    let without_time: Vec<&str> = run
        .stdout
        .lines()
        .filter(|line| !line.starts_with(" time "))
        .collect();
    insta::assert_snapshot!(without_time.join("\n"));
    run.exits(0);
}

#[test]
fn an_answer_for_programs() {
    insta::assert_json_snapshot!(reroute(&["--optimum"]));
    let explained = reroute(&["--strategy", "radius", "--explain"]);
    let stages = explained["stages"].as_array().expect("stages");
    assert_eq!(stages.len() as u64, explained["searches"]);
    assert_eq!(stages[0]["area"]["type"], "Polygon");
    assert!(reroute(&["--strategy", "radius"]).get("stages").is_none());
}

#[test]
fn compare_measures_every_strategy_on_the_same_failure() {
    let compared = skyway(&with_failure(
        &["compare", "--json", "--repetitions", "2"],
        &[],
    ));
    let compared = compared.exits(0).json();
    let answers = compared["answers"].as_array().expect("answers");
    let names: Vec<&str> = answers
        .iter()
        .map(|answer| answer["name"].as_str().expect("a name"))
        .collect();
    insta::assert_json_snapshot!(names);
    let settled = |place: usize| answers[place]["settled_nodes"].as_u64().expect("a count");
    assert!(settled(0) < settled(1), "the table is of no use");
    let optimum_m = answers[0]["remaining_optimum_m"].as_f64().expect("a way");
    for answer in answers {
        let remaining_m = answer["remaining_length_m"].as_f64().expect("a way");
        assert!(answer["elapsed_us"].as_f64().expect("a time") > 0.0);
        assert!(remaining_m >= optimum_m - 1e-9, "{answer}");
        let is_global = answer["stage"] == "global" && answer["strategy_used"] != "two_phased";
        assert!(!is_global || remaining_m <= optimum_m + 1e-9, "{answer}");
    }
}

#[test]
fn compare_prints_every_figure_of_every_strategy() {
    let run = skyway(&with_failure(&["compare", "--repetitions", "1"], &[])).exits(0);
    let header = run
        .stdout
        .lines()
        .find(|line| line.contains("strategy"))
        .expect("a header");
    for column in [
        "recomposed",
        "remaining",
        "overhead",
        "area nodes",
        "settled",
        "time",
    ] {
        assert!(header.contains(column), "{header}");
    }
    let with_overhead = run.stdout.lines().filter(|line| line.contains(" %"));
    assert_eq!(with_overhead.count(), 11, "{}", run.stdout);
    let blank_ended = run.stdout.lines().filter(|line| line.ends_with(' '));
    assert_eq!(blank_ended.count(), 0, "{}", run.stdout);
}

#[test]
fn what_is_closed_is_not_flown() {
    let open = reroute(&[]);
    let nodes = open["path"]["nodes"].as_array().expect("nodes");
    let [second, third] = [&nodes[1], &nodes[2]].map(|node| node.as_str().expect("an id"));
    let without_node = reroute(&["--close", second]);
    assert_eq!(without_node["outcome"], "rerouted");
    let flown = without_node["path"]["nodes"].as_array().expect("nodes");
    assert!(!flown.contains(&nodes[1]));
    let by_ends = format!("{third},{second}");
    let by_id = open["path"]["segments"][1].as_str().expect("an id");
    let without_segment = reroute(&["--close", &by_ends]);
    assert_eq!(
        without_segment["path"],
        reroute(&["--close", by_id])["path"]
    );
    let flown = without_segment["path"]["segments"]
        .as_array()
        .expect("segments");
    assert!(!flown.contains(&json!(by_id)));
}

#[test]
fn a_zone_counts_while_its_window_is_open() {
    let info = skyway(&["network", "info", "--json"]).exits(0).json();
    let bounds = info["bbox"].as_array().expect("a box");
    let corner = |lon: usize, lat: usize| json!([bounds[lon], bounds[lat]]);
    let ring = [
        corner(0, 1),
        corner(2, 1),
        corner(2, 3),
        corner(0, 3),
        corner(0, 1),
    ];
    let zone = json!({
        "type": "Feature",
        "id": "everything",
        "geometry": {"type": "Polygon", "coordinates": [ring]},
        "properties": {
            "windows": [{"from": "2026-11-27T18:00:00Z", "until": "2026-11-27T20:00:00Z"}],
        },
    });
    let zones = json!({"type": "FeatureCollection", "features": [zone]});
    let desk = Workspace::new();
    let file = desk.write("zones.geojson", zones.to_string());
    let outcome = |at: &str, horizon: &str| {
        let answer = reroute(&["--zones", &file, "--at", at, "--horizon", horizon]);
        (
            answer["outcome"].clone(),
            answer["severed_by"][1]["id"].clone(),
        )
    };
    let closed = (json!("no_route"), json!("everything"));
    let open = (json!("rerouted"), Value::Null);
    assert_eq!(outcome("2026-11-27T19:00:00Z", "0"), closed);
    assert_eq!(outcome("2026-11-27T17:30:00Z", "60min"), closed);
    assert_eq!(outcome("2026-11-27T17:30:00Z", "600"), open);
    assert_eq!(outcome("2026-11-27T20:00:01Z", "60min"), open);
}

#[test]
fn an_exact_answer_can_be_proved_and_a_wrong_one_cannot() {
    let desk = Workspace::new();
    let proof = desk.path("proof.json");
    let run = skyway(&with_failure(&["reroute", "--certificate", &proof], &[])).exits(0);
    assert!(run.stderr.contains("wrote the certificate to"), "{run:?}");
    let verdict = skyway(&["verify", &proof]).exits(0).stdout;
    assert!(verdict.starts_with("proved: "), "{verdict}");

    let mut certificate: Value = serde_json::from_str(&desk.read("proof.json")).expect("JSON");
    certificate["length_m"] = json!(certificate["length_m"].as_f64().expect("a length") - 1.0);
    let wrong = desk.write("wrong.json", certificate.to_string());
    let verdict = skyway(&["verify", &wrong]).exits(1).stdout;
    assert!(verdict.starts_with("not proved: "), "{verdict}");
    let verdict = skyway(&["verify", &wrong, "--json"]).exits(1).json();
    assert_eq!(verdict["proved"], false);
    skyway(&["verify", &proof, "--network", "corridor"]).exits(1);
    skyway(&["verify", &desk.path("missing.json")]).exits(1);
}

#[test]
fn that_there_is_no_way_can_be_proved_too() {
    let desk = Workspace::new();
    let proof = desk.path("proof.json");
    let arguments = [
        "reroute",
        "--close",
        "450",
        "--certificate",
        &proof,
        "--quiet",
    ];
    let run = skyway(&with_failure(&arguments, &[])).exits(0);
    assert!(run.stdout.contains("diverted to"), "{run:?}");
    let verdict = skyway(&["verify", &proof]).exits(0).stdout;
    assert!(
        verdict.starts_with("proved: there is no open way"),
        "{verdict}"
    );
}

#[test]
fn what_is_no_optimum_has_no_certificate() {
    let desk = Workspace::new();
    let proof = desk.path("proof.json");
    for [option, value] in [["--strategy", "radius"], ["--type", "operational"]] {
        let arguments = ["reroute", "--certificate", &proof, option, value];
        let run = skyway(&with_failure(&arguments, &[])).exits(2);
        assert!(run.stderr.contains("--certificate proves"), "{run:?}");
    }
}

#[test]
fn a_plan_has_contingencies_for_every_leg() {
    let arguments = ["compose", "--source", "1", "--destination", "450"];
    let plan = skyway(&[&arguments[..], &["--json"]].concat())
        .exits(0)
        .json();
    assert_eq!(plan["energy"], "unchecked");
    assert_eq!(plan["times"], "nominal");
    let legs = plan["legs"].as_array().expect("legs");
    let length_m = plan["length_m"].as_f64().expect("a length");
    let sum_m: f64 = legs.iter().filter_map(|leg| leg["length_m"].as_f64()).sum();
    assert!((sum_m - length_m).abs() < 1e-9);
    assert_eq!(plan["flight_time_s"], legs[legs.len() - 1]["arrival_s"]);
    for leg in legs {
        assert_eq!(leg["if_closed"]["outcome"], "rerouted");
        assert!(leg["if_closed"]["extra_m"].as_f64().expect("metres") >= 0.0);
        let detour = leg["if_closed"]["nodes"].as_array().expect("nodes");
        assert_eq!(detour.first(), Some(&leg["from"]));
        assert_eq!(detour.last(), Some(&leg["if_closed"]["rejoins"]));
        assert!(!leg["alternate"]["node"].is_null());
    }
    insta::assert_snapshot!(skyway(&arguments).exits(0).stdout);
    let nowhere = [&arguments[..], &["--close", "450", "--json"]].concat();
    assert_eq!(skyway(&nowhere).exits(0).json()["outcome"], "no_route");
}

/// Two nodes in a street 100 m long, and a house beside it.
#[test]
fn pictures_have_buildings_under_the_network() {
    let desk = Workspace::new();
    let street = json!({
        "nodes": [{"id": "a", "lon": 151.2, "lat": -33.86}, {"id": "b", "lon": 151.201, "lat": -33.86}],
        "links": [{"source": "a", "target": "b"}]
    });
    let street = desk.write("street.json", street.to_string());
    let house = |height_m: Value| {
        let ring = [
            [151.2004, -33.8599],
            [151.2006, -33.8599],
            [151.2006, -33.8598],
            [151.2004, -33.8598],
            [151.2004, -33.8599],
        ];
        json!({
            "type": "FeatureCollection",
            "features": [{
                "type": "Feature",
                "properties": {"height_m": height_m},
                "geometry": {"type": "Polygon", "coordinates": [ring]}
            }]
        })
    };
    let draw = |network: &str, buildings: &Value| {
        let buildings = desk.write("buildings.geojson", buildings.to_string());
        skyway(&[
            "network",
            "draw",
            "-q",
            "-n",
            network,
            "--buildings",
            &buildings,
        ])
    };
    let without = skyway(&["network", "draw", "-q", "-n", &street]).exits(0);
    assert!(!without.stdout.contains("building"), "{}", without.stdout);
    let low = draw(&street, &house(json!(12.0))).exits(0);
    assert!(low.stdout.contains(">building &lt; "), "{}", low.stdout);
    let unknown = draw(&street, &house(Value::Null)).exits(0);
    assert!(
        unknown.stdout.contains(">building of unknown height<"),
        "{}",
        unknown.stdout
    );

    let broken = draw(&street, &house(json!("tall"))).exits(1);
    assert!(
        broken.stderr.contains("buildings.geojson: ") && broken.stderr.contains("height_m"),
        "{}",
        broken.stderr
    );
    let planar = json!({"nodes": [{"id": 1, "x": 0, "y": 0}], "links": []});
    let planar = desk.write("planar.json", planar.to_string());
    let refused = draw(&planar, &house(json!(12.0))).exits(2);
    assert!(
        refused.stderr.contains("leave them out"),
        "{}",
        refused.stderr
    );
}

#[test]
fn pictures_carry_the_attribution() {
    let desk = Workspace::new();
    let answer = desk.path("answer.svg");
    let runs = [
        vec!["network", "draw", "--output", &answer],
        with_failure(
            &["network", "draw", "--output", &answer],
            &["--strategy", "radius"],
        ),
        with_failure(&["reroute", "--svg", &answer], &[]),
        with_failure(&["compare", "--repetitions", "1", "--svg", &answer], &[]),
    ];
    for arguments in runs {
        skyway(&arguments).exits(0);
        let picture = desk.read("answer.svg");
        assert!(picture.starts_with("<svg "), "{arguments:?}");
        assert!(
            picture.contains("OpenStreetMap contributors"),
            "{arguments:?}"
        );
    }
}
