//! Plans whose premises are forged, figure by figure: each is refused, or the reader is told what it rests on.

use crate::binary::{Workspace, skyway};
use serde_json::{Value, json};
use skyway::formats::{differing_premises, load_network, premises_lines, read_flight_document};
use skyway::network::{Topology, bundled};
use skyway::verify::verify_flight;

/// A plan past a zone, into wind, with a pad reserved and another plan elsewhere.
pub(crate) fn plan(desk: &Workspace) -> Value {
    let zone = json!({
        "type": "Feature",
        "id": "parade",
        "geometry": {"type": "Point", "coordinates": [-97.963_699_2, 29.866_454_8]},
        "properties": {
            "reason": "parade",
            "authority": "City of San Marcos",
            "radius_m": 150,
            "windows": [{"from": "2026-11-27T12:30:00Z", "until": "2026-11-27T13:00:00Z"}],
        },
    });
    let zones = json!({"type": "FeatureCollection", "features": [zone]});
    let zones = desk.write("zones.geojson", zones.to_string());
    let file = desk.path("plan.json");
    let arguments = [
        "compose",
        "--network=corridor",
        "--source=1",
        "--destination=36",
        "--payload-kg=0.25",
        "--wind=225/3",
        "--at=2026-11-27T11:40:00Z",
        "--start-time=2026-11-27T11:50:00Z",
        "--quiet",
        "--zones",
        &zones,
        "--certificate",
        &file,
    ];
    skyway(&arguments).exits(0);
    let mut plan: Value = serde_json::from_str(&desk.read("plan.json")).expect("JSON");
    plan["reservations"] = json!([{"node": 280, "pad": 0, "from_s": 10.0, "until_s": 20.0}]);
    let last = plan["plan"]["legs"].as_array().expect("legs").last();
    let last = last.expect("a leg").clone();
    plan["traffic"] = json!([{
        "segment": last["segment"], "from": last["from"], "enters_s": 10.0, "leaves_s": 60.0,
    }]);
    let later = json!({"from_s": 90_000.0, "until_s": 95_000.0, "east_mps": 2.0, "north_mps": 1.0});
    plan["wind"].as_array_mut().expect("winds").push(later);
    plan
}

/// What a reader of a verdict is told, or that there is none.
pub(crate) fn told(plan: &Value, topology: &Topology) -> Result<Vec<String>, String> {
    let document =
        read_flight_document(&plan.to_string(), topology).map_err(|fault| fault.to_string())?;
    let checked = verify_flight(&document.plan, &document.premises(topology));
    checked.map_err(|fault| fault.to_string())?;
    let differing = differing_premises(&document).map_err(|fault| fault.to_string())?;
    let differing = differing.iter().map(|premise| format!("{premise:?}"));
    let lines = premises_lines(&document, topology);
    Ok(lines.into_iter().chain(differing).collect())
}

/// The places of all numbers in a document, as JSON pointers.
pub(crate) fn numbers(value: &Value, pointer: &str, found: &mut Vec<String>) {
    match value {
        Value::Number(_) => found.push(pointer.to_owned()),
        Value::Array(entries) => {
            for (number, entry) in entries.iter().enumerate() {
                numbers(entry, &format!("{pointer}/{number}"), found);
            }
        }
        Value::Object(members) => {
            for (name, member) in members {
                numbers(member, &format!("{pointer}/{name}"), found);
            }
        }
        _ => {}
    }
}

#[test]
fn every_forged_premise_is_refused_or_told() {
    let desk = Workspace::new();
    let honest = plan(&desk);
    let network = load_network(bundled::CORRIDOR).expect("the corridor");
    let topology = network.topology;
    let said = told(&honest, &topology).expect("a plan that can be flown");
    let mut premises = honest.clone();
    premises.as_object_mut().expect("an object").remove("plan");
    let mut pointers = Vec::new();
    numbers(&premises, "", &mut pointers);
    // What has been forgotten would be tried by no case: rules, airframe, start, winds, windows, pads, traffic.
    assert!(pointers.len() >= 40, "{pointers:?}");
    let mut passed = Vec::new();
    for pointer in &pointers {
        let honest_value = honest.pointer(pointer).and_then(Value::as_f64);
        let value = honest_value.expect("a number");
        let forgeries = [
            -1.0,
            -value,
            -1e9,
            -1e300,
            0.0,
            1e-9,
            value * 1.01 + 0.01,
            1e6,
            1e9,
            1e300,
        ];
        for forgery in forgeries.into_iter().filter(|&forgery| forgery != value) {
            let mut forged = honest.clone();
            *forged.pointer_mut(pointer).expect("a place") = json!(forgery);
            match told(&forged, &topology) {
                Ok(lines) if lines == said => passed.push(format!("{pointer} = {forgery}")),
                Ok(_) | Err(_) => {}
            }
        }
        // What JSON has no word for is no number of it.
        for word in ["NaN", "Infinity", "1e999", "\"0\"", "null"] {
            let mut forged = honest.clone();
            *forged.pointer_mut(pointer).expect("a place") = json!("FORGED");
            let text = forged.to_string().replace("\"FORGED\"", word);
            let read = read_flight_document(&text, &topology);
            let is_open_end = word == "null"
                && [
                    "from_s",
                    "until_s",
                    "deadline_s",
                    "climb_mps",
                    "descent_mps",
                ]
                .iter()
                .any(|end| pointer.ends_with(end));
            assert!(read.is_err() || is_open_end, "{pointer} = {word}");
        }
    }
    assert!(passed.is_empty(), "passed without a word: {passed:#?}");
}

#[test]
fn forgeries_that_would_prove_anything_are_named_by_their_place() {
    let desk = Workspace::new();
    let honest = plan(&desk);
    let window_s = honest["closures"][0]["until_s"].as_f64().expect("an end");
    for (pointer, forgery, said) in [
        (
            "/began_s",
            json!(1e6),
            "began_s is 1000000, and has to be a number from 0 to",
        ),
        ("/began_s", json!(-1), "began_s is -1"),
        (
            "/rules/time_margin_s",
            json!(-1e9),
            "rules.time_margin_s is -1e9",
        ),
        (
            "/rules/time_margin_growth",
            json!(-1000),
            "rules.time_margin_growth is -1000",
        ),
        (
            "/rules/floor_fraction",
            json!(0.3),
            "rules.floor_fraction is 0.3",
        ),
        ("/reserve_fraction", json!(-1), "reserve_fraction is -1"),
        (
            "/closures/0/from_s",
            json!(window_s + 1.0),
            "closures[0].until_s is",
        ),
        ("/wind/1/until_s", json!(0), "wind[1].until_s is 0"),
        (
            "/reservations/0/until_s",
            json!(0),
            "reservations[0].until_s is 0",
        ),
        ("/traffic/0/leaves_s", json!(0), "traffic[0].leaves_s is 0"),
        ("/payload_kg", json!(-0.5), "payload_kg is -0.5"),
        (
            "/start/battery_fraction",
            json!(1.5),
            "start.battery_fraction is 1.5",
        ),
    ] {
        let mut forged = honest.clone();
        *forged.pointer_mut(pointer).expect("a place") = forgery;
        let file = desk.write("forged.json", forged.to_string());
        let run = skyway(&["verify", &file, "--network=corridor", "--quiet"]).exits(1);
        let begins = format!("cannot be flown as it says: {said}");
        assert!(run.stdout.starts_with(&begins), "{pointer}: {run:?}");
    }
    // Gusts weaker than the wind that they are gusts of, in a plan as in a file of an airframe.
    let mut forged = honest;
    forged["airframe"]["gust_factor"] = json!(0.1);
    let file = desk.write("forged.json", forged.to_string());
    let run = skyway(&["verify", &file, "--network=corridor", "--quiet"]).exits(1);
    assert!(
        run.stderr.contains(
            "gust_factor of airframe \"DJI Phantom 3\" is 0.1; give a number from 1 to 10"
        ),
        "{run:?}"
    );
}

#[test]
fn what_differs_from_the_bundled_airframe_and_the_default_rules_is_told() {
    let desk = Workspace::new();
    let mut plan = plan(&desk);
    plan["rules"]["time_margin_s"] = json!(0.0);
    plan["airframe"]["max_wind_mps"] = json!(25.0);
    let file = desk.write("other.json", plan.to_string());
    let verify = |rest: &[&str]| {
        let arguments = ["verify", &file, "--network=corridor", "--quiet"];
        skyway(&[&arguments[..], rest].concat()).exits(0)
    };
    insta::assert_snapshot!(verify(&[]).stdout);
    let verdict = verify(&["--json"]).json();
    assert_eq!(
        verdict["differing_premises"],
        json!([
            {"name": "airframe.max_wind_mps", "value": 25.0, "default": 10.0},
            {"name": "rules.time_margin_s", "value": 0.0, "default": 60.0},
        ])
    );
    assert_eq!(verdict["premises"]["closures"], plan["closures"]);
    assert!(verdict["premises"].get("plan").is_none(), "{verdict}");
}
