//! Many requests from NDJSON: order, ids, problems in their place, and answers that are those of one request.

use crate::binary::{Workspace, skyway, skyway_with_input};
use serde_json::{Value, json};

fn request(id: Value) -> Value {
    json!({
        "id": id,
        "type": "navigational",
        "service": {"from": 379, "to": 406},
        "destination": 450,
    })
}

fn lines(requests: &[Value]) -> String {
    requests
        .iter()
        .map(|request| format!("{request}\n"))
        .collect()
}

#[test]
fn answers_come_in_order_with_their_ids() {
    let ids = [
        json!("first"),
        json!(2),
        json!("third"),
        json!({"any": "thing"}),
    ];
    let desk = Workspace::new();
    let file = desk.write("requests.ndjson", lines(&ids.clone().map(request)));
    let run = skyway(&["reroute", "--requests", &file, "--quiet"]).exits(0);
    assert_eq!(run.stderr, "");
    let answers = run.json_lines();
    let answered: Vec<&Value> = answers.iter().map(|answer| &answer["id"]).collect();
    assert_eq!(answered, ids.iter().collect::<Vec<_>>());
    // From the second on they come from the table of the destination.
    for answer in &answers[1..] {
        assert_eq!(answer["path"], answers[0]["path"]);
        assert!(answer["settled_nodes"].as_u64() <= answers[0]["settled_nodes"].as_u64());
    }
}

#[test]
fn a_line_is_answered_like_the_same_request_alone() {
    let mut body = request(json!("x"));
    body["close"] = json!([[353, 404], 408]);
    body["optimum"] = json!(true);
    let input = lines(&[body.clone(), request(json!("between")), body]);
    let run = skyway_with_input(&["reroute", "--requests", "-"], input.as_bytes()).exits(0);
    let alone = skyway(&[
        "reroute",
        "--service",
        "379,406",
        "--destination",
        "450",
        "--close",
        "353,404",
        "--close",
        "408",
        "--optimum",
        "--json",
    ]);
    let mut alone = alone.exits(0).json();
    let answers = run.json_lines();
    for place in [0, 2] {
        let mut answer = answers[place].clone();
        for field in ["elapsed_us", "id"] {
            answer.as_object_mut().expect("an object").remove(field);
            alone.as_object_mut().expect("an object").remove(field);
        }
        assert_eq!(answer["path"], alone["path"]);
        assert_eq!(answer["remaining_optimum_m"], alone["remaining_optimum_m"]);
        assert_eq!(answer["area_segments"], alone["area_segments"]);
    }
    // What a line closes is open again for the next one.
    assert_ne!(answers[1]["area_nodes"], answers[0]["area_nodes"]);
    assert!(answers[1].get("remaining_optimum_m").is_none());
}

#[test]
fn a_line_that_is_no_report_has_its_problem_in_its_place() {
    let not_located = json!({"id": "b", "type": "navigational"});
    let unknown = json!({"id": "c", "service": {"from": 99_998, "to": 99_999}});
    let wrong_close = json!({"id": "d", "service": {"from": 1, "to": 2}, "close": ["nothing"]});
    let too_long = json!({"id": "e", "note": "x".repeat(1 << 20)});
    let mut input = lines(&[request(json!("a"))]);
    input.push_str("\n   \n{\"id\": \"broken\"\n[1, 2]\n");
    input.push_str(&lines(&[not_located, unknown, wrong_close, too_long]));
    input.push_str(lines(&[request(json!("last"))]).trim_end());
    let run = skyway_with_input(&["reroute", "--requests", "-"], input.as_bytes()).exits(1);
    let answers = run.json_lines();
    let told: Vec<[&Value; 3]> = answers
        .iter()
        .map(|line| {
            let problem = &line["problem"];
            [&line["id"], &problem["code"], &problem["pointer"]]
        })
        .collect();
    let null = || Value::Null;
    let expected = [
        [json!("a"), null(), null()],
        [null(), json!("report_not_json"), json!("")],
        [null(), json!("report_not_an_object"), json!("")],
        [json!("b"), json!("report_not_located"), json!("")],
        [
            json!("c"),
            json!("report_unknown_node"),
            json!("/service/from"),
        ],
        [json!("d"), json!("report_cannot_close"), json!("/close/0")],
        [null(), json!("report_too_long"), json!("")],
        [json!("last"), null(), null()],
    ];
    assert_eq!(told, expected.each_ref().map(|line| line.each_ref()));
    assert_eq!(answers[7]["outcome"], "rerouted");
    assert!(run.stderr.contains("warning: line 4: "), "{}", run.stderr);
}

#[test]
fn standing_closures_hold_for_every_line() {
    let input = lines(&[request(json!(1)), request(json!(2)), request(json!(3))]);
    let arguments = ["reroute", "--requests", "-", "--close", "450"];
    let run = skyway_with_input(&arguments, input.as_bytes()).exits(0);
    for answer in run.json_lines() {
        assert_eq!(answer["outcome"], "diverted");
    }
}

#[test]
fn what_a_report_says_too_much_is_a_warning() {
    let mut body = request(json!("a"));
    body["colour"] = json!("blue");
    body["strategy"] = json!("fastest");
    let run = skyway_with_input(&["reroute", "--requests", "-"], lines(&[body]).as_bytes());
    let answer = &run.exits(0).json_lines()[0];
    let warnings = answer["warnings"].as_array().expect("warnings");
    let codes: Vec<&Value> = warnings.iter().map(|warning| &warning["code"]).collect();
    assert_eq!(codes, ["unknown_field", "unknown_value"]);
    assert_eq!(answer["strategy"], "exact");
}
