//! Deliveries that are flown: the corridor from pad to pad, wind, zones with times, answers in flight, plans that are checked.

use crate::binary::{Run, Workspace, skyway};
use serde_json::{Value, json};

const CORRIDOR: [&str; 4] = ["--network", "corridor", "--source", "1"];
/// The whole corridor with a quarter of a kilogram.
const DELIVERY: [&str; 8] = [
    "--destination",
    "280",
    "--payload-kg",
    "0.25",
    "--start-time",
    "2026-11-27T10:00:00Z",
    "--deadline",
    "14h",
];

fn compose(rest: &[&str]) -> Run {
    skyway(&[&["compose"][..], &CORRIDOR[..], rest].concat()).exits(0)
}

fn delivery(rest: &[&str]) -> Run {
    compose(&[&DELIVERY[..], rest].concat())
}

fn stops(plan: &Value) -> Vec<&Value> {
    let stops = plan["stops"].as_array().expect("stops").iter();
    stops.filter(|stop| stop["kind"] == "charge").collect()
}

fn charged_wh(plan: &Value) -> f64 {
    let stops = stops(plan).into_iter();
    stops
        .map(|stop| stop["charged_wh"].as_f64().expect("energy"))
        .sum()
}

/// What is done to a written plan, and what that is called.
type Mutation = (&'static str, fn(&mut Value));

#[test]
fn the_corridor_is_flown_from_pad_to_pad() {
    insta::assert_snapshot!(delivery(&[]).stdout);
    let plan = delivery(&["--json"]).json();
    assert_eq!(plan["outcome"], "composed");
    assert_eq!(plan["proved"], true);
    assert!(stops(&plan).len() >= 8);
    let first = &plan["legs"][0];
    let names: Vec<&str> = first
        .as_object()
        .expect("a leg")
        .keys()
        .map(String::as_str)
        .collect();
    insta::assert_json_snapshot!(names);
}

#[test]
fn into_the_wind_it_recharges_more_and_elsewhere() {
    let headwind = ["--wind", "225/7"];
    insta::assert_snapshot!(delivery(&headwind).stdout);
    let calm = delivery(&["--json"]).json();
    let windy = delivery(&["--json", "--wind", "225/7"]).json();
    assert!(charged_wh(&windy) > charged_wh(&calm) + 68.0);
    let nodes = |plan: &Value| -> Vec<Value> {
        let stops = stops(plan).into_iter();
        stops.map(|stop| stop["node"].clone()).collect()
    };
    assert_ne!(nodes(&windy), nodes(&calm));
}

/// The one node that leads out of San Marcos, 2.9 km down the corridor.
const GATE: [f64; 2] = [-97.963_699_2, 29.866_454_8];
/// Node 35, 5.7 km down, which can be flown around by node 34.
const SHORT_CUT: [f64; 2] = [-97.984_137_6, 29.847_983_2];

/// A no-fly zone of 150 m about a place, from 12:00 to 12:30.
fn parade(desk: &Workspace, centre: [f64; 2]) -> String {
    let zone = json!({
        "type": "Feature",
        "id": "parade",
        "geometry": {"type": "Point", "coordinates": centre},
        "properties": {
            "radius_m": 150,
            "windows": [{"from": "2026-11-27T12:00:00Z", "until": "2026-11-27T12:30:00Z"}],
        },
    });
    let zones = json!({"type": "FeatureCollection", "features": [zone]});
    desk.write("zones.geojson", zones.to_string())
}

/// A delivery to node 36, 7.2 km down the corridor, that starts at a time of day.
fn fly_past(at: &str, zones: &str, rest: &[&str]) -> Run {
    let when = format!("2026-11-27T{at}:00Z");
    let with = [
        "--destination",
        "36",
        "--start-time",
        &when,
        "--zones",
        zones,
    ];
    compose(&[&with[..], rest].concat())
}

#[test]
fn a_zone_of_half_an_hour_is_flown_through_before_it_and_avoided_in_it() {
    let desk = Workspace::new();
    let zones = parade(&desk, SHORT_CUT);
    let plan = |at: &str| fly_past(at, &zones, &["--json"]).json();
    let nodes = |plan: &Value| plan["path"]["nodes"].as_array().expect("nodes").clone();
    let before = plan("11:50");
    assert!(nodes(&before).contains(&json!("35")), "{before}");
    let quickest = ["--json", "--objective", "time"];
    let around = fly_past("12:10", &zones, &quickest).json();
    assert!(!nodes(&around).contains(&json!("35")), "{around}");
    assert!(nodes(&around).contains(&json!("34")), "{around}");
    assert!(around["stops"].as_array().expect("stops").is_empty());
    // By distance the short cut is worth waiting for, as long as there is time.
    let waiting = plan("12:10");
    assert!(nodes(&waiting).contains(&json!("35")), "{waiting}");
    assert!(waiting["stops"][0]["waits_s"].as_f64() > Some(600.0));
    let hurried = fly_past("12:10", &zones, &["--json", "--deadline", "15min"]).json();
    assert_eq!(nodes(&hurried), nodes(&around));
}

#[test]
fn a_zone_that_leaves_no_way_around_is_waited_out_on_a_pad() {
    let desk = Workspace::new();
    let zones = parade(&desk, GATE);
    let before = fly_past("11:50", &zones, &["--json"]).json();
    assert!(before["stops"].as_array().expect("stops").is_empty());
    let waiting = fly_past("12:10", &zones, &["--json"]).json();
    let stay = &waiting["stops"][0];
    assert_eq!(
        (&stay["kind"], &stay["node"]),
        (&json!("start"), &json!("1"))
    );
    let waits_s = stay["waits_s"].as_f64().expect("a wait");
    assert!(waits_s > 600.0, "{waiting}");
    insta::assert_snapshot!(fly_past("12:10", &zones, &[]).stdout);
    // Who has no time to wait is told what is in the way, and from when on it would not be.
    let late = fly_past("12:10", &zones, &["--deadline", "15min"]).stdout;
    let in_seconds = fly_past("12:10", &zones, &["--deadline", "900"]).stdout;
    assert_eq!(in_seconds, late);
    assert!(late.starts_with("no route: "), "{late}");
    assert!(late.contains(" by 2026-11-27T12:25:00Z\n"), "{late}");
    assert!(late.contains("closure 'parade'"), "{late}");
    assert!(
        late.contains("without the deadline a plan would leave at 2026-11-27T12:"),
        "{late}"
    );
}

#[test]
fn a_written_plan_is_checked_and_a_mutated_one_rejected() {
    let desk = Workspace::new();
    let file = desk.path("plan.json");
    delivery(&["--certificate", &file, "--quiet"]);
    let verify = |file: &str| skyway(&["verify", file, "--network", "corridor", "--quiet"]);
    insta::assert_snapshot!(verify(&file).exits(0).stdout);
    let plan: Value = serde_json::from_str(&desk.read("plan.json")).expect("JSON");
    let mutations: [Mutation; 6] = [
        ("a battery raised", |plan| {
            plan["plan"]["legs"][0]["battery_after_fraction"] = json!(0.97);
        }),
        ("a time shifted", |plan| {
            shift(&mut plan["plan"]["legs"][1]["enters_s"], 5.0)
        }),
        ("a stay cut short", |plan| {
            shift(&mut plan["plan"]["stops"][0]["takes_off_s"], -30.0);
        }),
        ("a pad that is not there", |plan| {
            plan["plan"]["stops"][0]["pad"] = json!(99);
        }),
        ("a pad booked twice", |plan| {
            let stay = plan["plan"]["stops"][0].clone();
            plan["reservations"] = json!([{
                "node": stay["node"], "pad": stay["pad"],
                "from_s": stay["lands_s"], "until_s": stay["takes_off_s"],
            }]);
        }),
        ("something closed", |plan| {
            let segment = plan["plan"]["legs"][3]["segment"].clone();
            plan["closed_segments"] = json!([segment]);
        }),
    ];
    for (what, mutate) in mutations {
        let mut mutated = plan.clone();
        mutate(&mut mutated);
        let file = desk.write("mutated.json", mutated.to_string());
        let run = verify(&file).exits(1);
        assert!(
            run.stdout.starts_with("cannot be flown as it says: "),
            "{what}: {run:?}"
        );
    }
    let elsewhere = skyway(&["verify", &file]).exits(1);
    assert!(
        elsewhere.stderr.contains("another network"),
        "{elsewhere:?}"
    );
}

fn shift(number: &mut Value, by: f64) {
    let shifted = number.as_f64().expect("a number") + by;
    *number = json!(shifted);
}

fn reroute(rest: &[&str]) -> Run {
    let failure = [
        "reroute",
        "--network",
        "corridor",
        "--service",
        "33,35",
        "--destination",
        "37",
        "--start-time",
        "2026-11-27T10:00:00Z",
    ];
    skyway(&[&failure[..], rest].concat()).exits(0)
}

#[test]
fn a_drone_in_flight_is_told_what_its_battery_allows() {
    insta::assert_snapshot!(reroute(&["--battery", "0.6"]).stdout);
    let told = |rest: &[&str]| reroute(&[rest, &["--json"]].concat()).json();
    let rerouted = told(&["--battery", "0.6"]);
    assert_eq!(rerouted["outcome"], "rerouted");
    assert_eq!(rerouted["plan"]["energy"], "computed");
    let on_plan = told(&["--battery", "0.9", "--type", "service_level"]);
    assert_eq!(on_plan["outcome"], "unaffected");
    let low = told(&[
        "--battery",
        "0.25",
        "--type",
        "operational",
        "--location",
        "35",
    ]);
    assert_eq!(low["outcome"], "diverted", "{low}");
    assert_eq!(low["reserve_used"], true, "{low}");
    let empty = told(&[
        "--battery",
        "0.05",
        "--type",
        "operational",
        "--location",
        "35",
    ]);
    assert_eq!(empty["outcome"], "no_route", "{empty}");
    assert!(!empty["causes"].as_array().expect("causes").is_empty());
}

/// A place on the leg of [`reroute`], as the command line reads it.
fn on_the_leg(flown: f64) -> String {
    let network: Value = serde_json::from_str(include_str!(
        "../../data/corridor-san-marcos-san-antonio.geojson"
    ))
    .expect("JSON");
    let features = network["features"].as_array().expect("features");
    let place = |id: u64| {
        let is_node =
            |feature: &&Value| feature["geometry"]["type"] == "Point" && feature["id"] == id;
        let node = features.iter().find(is_node).expect("a node");
        let at = &node["geometry"]["coordinates"];
        [0, 1].map(|axis| at[axis].as_f64().expect("a number"))
    };
    let (from, to) = (place(33), place(35));
    let at = [0, 1].map(|axis: usize| from[axis] + flown * (to[axis] - from[axis]));
    format!("--location={},{}", at[0], at[1])
}

#[test]
fn the_figures_of_an_answer_are_those_of_its_path_wherever_the_drone_is() {
    let desk = Workspace::new();
    for place in 1..=24 {
        let flown = f64::from(place) / 25.0;
        let file = desk.path(&format!("{place}.json"));
        let location = on_the_leg(flown);
        let answer = reroute(&[
            "--type",
            "operational",
            "--payload-kg",
            ".25",
            "--battery",
            ".34",
            &location,
            "--json",
            "--certificate",
            &file,
        ])
        .json();
        let nodes = &answer["plan"]["path"]["nodes"];
        let first_m = &answer["first_stretch_m"];
        let length_m = 2_847.5;
        let expected_m = match nodes[0].as_str() {
            Some("33") => flown * length_m,
            _ => (1.0 - flown) * length_m,
        };
        let first_m = first_m.as_f64().expect("a length");
        assert!((first_m - expected_m).abs() < 3.0, "{flown}: {answer}");
        let verified = skyway(&["verify", &file, "--network", "corridor"]);
        verified.exits(0);
    }
}

#[test]
fn pictures_show_battery_stops_and_wind() {
    let desk = Workspace::new();
    let file = desk.path("plan.svg");
    delivery(&["--wind", "225/7", "--svg", &file, "--quiet"]);
    let picture = desk.read("plan.svg");
    for words in [
        "battery below 25 %",
        "stop, with the battery",
        "wind 7.0 m/s",
        "→",
    ] {
        assert!(picture.contains(words), "{words}");
    }
    let file = desk.path("answer.svg");
    reroute(&["--battery", "0.6", "--svg", &file, "--quiet"]);
    assert!(desk.read("answer.svg").contains("failed leg"));
}

/// An older file of that name would pass for the plan.
#[test]
fn a_file_that_has_no_plan_is_named_and_fails() {
    let desk = Workspace::new();
    let [plan, picture] = ["plan.json", "plan.svg"].map(|name| desk.path(name));
    let files = ["--certificate", &plan, "--svg", &picture];
    let fails = |question: &[&str]| {
        let run = skyway(&[question, &files].concat()).exits(1);
        assert!(run.stdout.contains("no route"), "{run:?}");
        for file in [&plan, &picture] {
            assert!(run.stderr.contains(file.as_str()), "{run:?}");
        }
    };
    let heavy = ["--destination", "37", "--payload-kg", "3"];
    fails(&[&["compose"][..], &CORRIDOR, &heavy].concat());
    let failure = ["--network=corridor", "--service=33,35", "--destination=37"];
    let empty = [
        "--type",
        "operational",
        "--location",
        "35",
        "--battery",
        "0.05",
    ];
    fails(&[&["reroute"][..], &failure, &empty].concat());
}

#[test]
fn flights_that_make_no_sense_are_refused_with_what_to_write() {
    let refused = |rest: &[&str]| {
        let run = skyway(
            &[
                &["compose"][..],
                &CORRIDOR[..],
                &["--destination", "37"],
                rest,
            ]
            .concat(),
        );
        run.exits(2).stderr
    };
    assert!(refused(&["--battery", "87"]).contains("did you mean 0.87?"));
    assert!(refused(&["--wind", "7"]).contains("such as 225/7"));
    assert!(refused(&["--deadline", "soon"]).contains("such as 6h"));
    assert!(refused(&["--payload-kg=-1"]).contains("0 or more"));
    assert!(refused(&["--reserve", "0.95"]).contains("from 0 to 0.9"));
    assert!(refused(&["--certificate", "plan.json"]).contains("name a drone"));
    assert!(refused(&["--airspeed", "12", "--battery", "0.9"]).contains("without a drone"));
    for flag in ["--explain", "--optimum"] {
        let run = skyway(&["reroute", "--service=379,406", "--battery=0.9", flag]).exits(2);
        assert!(run.stderr.contains("without a drone"), "{run:?}");
    }
    let heavy = compose(&["--destination", "37", "--payload-kg", "3"]);
    assert!(heavy.stdout.contains("payload of 3 kg"), "{heavy:?}");
    let early = [
        "--start-time",
        "2026-11-27T10:00:00Z",
        "--at",
        "2026-11-27T11:00:00Z",
    ];
    assert!(refused(&early).contains("--start-time is before --at"));
}
