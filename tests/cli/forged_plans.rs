//! Plans that are forged in themselves: every number and every member of a plan is bent, alone and together, and what still
//! passes has to be a plan that a plain reading finds as good, on premises that the reader is told.

use crate::binary::{Workspace, skyway};
use crate::forged::{numbers, plan, told};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use serde_json::{Value, json};
use skyway::formats::load_network;
use skyway::network::{Topology, bundled};

/// A plan that stops to charge on its way, four pads and a deadline far off.
fn with_stays(desk: &Workspace) -> Value {
    let file = desk.path("far.json");
    let arguments = [
        "compose",
        "--network=corridor",
        "--source=1",
        "--destination=280",
        "--payload-kg=0.25",
        "--at=2026-11-27T11:40:00Z",
        "--deadline=10h",
        "--quiet",
        "--certificate",
        &file,
    ];
    skyway(&arguments).exits(0);
    serde_json::from_str(&desk.read("far.json")).expect("JSON")
}

fn corridor() -> Topology {
    let network = load_network(bundled::CORRIDOR);
    network.expect("the corridor").topology
}

fn number(value: &Value, name: &str) -> f64 {
    value[name].as_f64().expect("a number")
}

/// A number, or where it is null so far away that it never comes.
fn instant(value: &Value, name: &str, never: f64) -> f64 {
    value[name].as_f64().unwrap_or(never)
}

/// What a plain reading has against a plan: whether its legs join, are open, in order and within the battery.
fn objections(document: &Value, topology: &Topology) -> Vec<String> {
    let mut found = Vec::new();
    let plan = &document["plan"];
    let rules = &document["rules"];
    let text = |id: &Value| id.as_str().map_or_else(|| id.to_string(), str::to_owned);
    let mut at = text(&document["start"]["node"]);
    let mut clock_s = number(&document["start"], "at_s");
    let reserve = number(document, "reserve_fraction");
    let legs = plan["legs"].as_array().expect("legs");
    for (place, leg) in legs.iter().enumerate() {
        let (from, to) = (text(&leg["from"]), text(&leg["to"]));
        let segment = text(&leg["segment"]);
        let ends = [&from, &to].map(|id| topology.node(id).expect("a node"));
        let between = topology.segment_between(ends[0], ends[1]);
        let is_joined = between.is_some_and(|found| topology.segment_id(found) == segment);
        let (enters_s, leaves_s) = (number(leg, "enters_s"), number(leg, "leaves_s"));
        let is_ordered = enters_s >= clock_s - 1e-4 && leaves_s > enters_s;
        let (before, after) = (
            number(leg, "battery_before_fraction"),
            number(leg, "battery_after_fraction"),
        );
        let is_flown = before > after && before <= 1.0 && after >= reserve - 1e-6;
        if from != at || !is_joined || !is_ordered || !is_flown {
            found.push(format!("leg {place}: {leg}"));
        }
        for closure in document["closures"].as_array().expect("closures") {
            let names = |list: &str, id: &str| {
                let list = closure[list].as_array().expect("a list");
                list.iter().any(|entry| text(entry) == id)
            };
            let since_s = leaves_s - number(document, "began_s");
            let growth = number(rules, "time_margin_growth");
            let margin_s = match closure["widened"] == json!(true) {
                true => number(rules, "time_margin_s") + growth * since_s.max(0.0),
                false => 0.0,
            };
            let meets = leaves_s > instant(closure, "from_s", -1e12) - margin_s + 1e-4
                && enters_s < instant(closure, "until_s", 1e12) + margin_s - 1e-4;
            if meets && (names("segments", &segment) || names("nodes", &to)) {
                found.push(format!("leg {place} is closed"));
            }
        }
        (at, clock_s) = (to, leaves_s);
    }
    for stop in plan["stops"].as_array().expect("stops") {
        let node = topology.node(&text(&stop["node"])).expect("a node");
        let pad = stop["pad"].as_u64().expect("a number");
        let is_there = pad < u64::from(topology.pads(node));
        if !is_there || number(stop, "takes_off_s") < number(stop, "lands_s") {
            found.push(format!("stop {stop}"));
        }
        for stay in document["reservations"].as_array().expect("reservations") {
            let is_same = stay["node"] == stop["node"] && stay["pad"] == stop["pad"];
            let meets = number(stay, "from_s") < number(stop, "takes_off_s")
                && instant(stay, "until_s", 1e12) > number(stop, "lands_s");
            if is_same && meets {
                found.push(format!("the pad of {stop} is taken"));
            }
        }
    }
    let lands_s = number(plan, "arrives_s");
    let is_in_time = lands_s <= instant(document, "deadline_s", 1e12) + 1e-4;
    if at != text(&document["destination"]) || !is_in_time || lands_s < clock_s - 1e-4 {
        found.push(format!("it ends at {at}, {lands_s}"));
    }
    found
}

/// All members, by their places: `(parent, name)` as JSON pointers.
fn members(value: &Value, pointer: &str, found: &mut Vec<(String, String)>) {
    if let Value::Object(entries) = value {
        for (name, entry) in entries {
            found.push((pointer.to_owned(), name.clone()));
            members(entry, &format!("{pointer}/{name}"), found);
        }
    } else if let Value::Array(entries) = value {
        for (number, entry) in entries.iter().enumerate() {
            members(entry, &format!("{pointer}/{number}"), found);
        }
    }
}

#[test]
fn every_bent_number_of_a_plan_is_refused() {
    let desk = Workspace::new();
    let topology = corridor();
    for honest in [plan(&desk), with_stays(&desk)] {
        assert_eq!(objections(&honest, &topology), [""; 0]);
        let said = told(&honest, &topology).expect("a plan that can be flown");
        let mut pointers = Vec::new();
        numbers(&honest["plan"], "/plan", &mut pointers);
        assert!(pointers.len() > 15, "{pointers:?}");
        let mut as_good = Vec::new();
        for pointer in &pointers {
            let value = honest.pointer(pointer).and_then(Value::as_f64);
            let value = value.expect("a number");
            let whole = [-1.0, 0.0, 1.0, 2.0, 65_536.0];
            let bent = [
                -value,
                value * 1.01 + 0.01,
                value * 0.99 - 0.01,
                1e9,
                1e300,
                f64::MIN,
            ];
            let near = [value - 1e-3, value + 1e-3];
            for forgery in whole.into_iter().chain(bent).chain(near) {
                let is_whole = honest.pointer(pointer).is_some_and(Value::is_u64);
                let written = match is_whole && forgery.fract() == 0.0 && forgery.abs() < 1e9 {
                    true => json!(forgery as i64),
                    false => json!(forgery),
                };
                if written.as_f64() == Some(value) {
                    continue;
                }
                let mut forged = honest.clone();
                *forged.pointer_mut(pointer).expect("a place") = written;
                let Ok(lines) = told(&forged, &topology) else {
                    continue;
                };
                assert_eq!(lines, said, "{pointer} = {forgery}");
                assert_eq!(
                    objections(&forged, &topology),
                    [""; 0],
                    "{pointer} = {forgery}"
                );
                as_good.push(pointer.clone());
            }
        }
        // Another free pad is as good as the one that was chosen; nothing else is.
        assert!(
            as_good.iter().all(|pointer| pointer.ends_with("/pad")),
            "{as_good:?}"
        );
    }
}

#[test]
fn a_plan_with_a_member_less_or_more_or_elsewhere_is_refused() {
    let desk = Workspace::new();
    let topology = corridor();
    for honest in [plan(&desk), with_stays(&desk)] {
        let said = told(&honest, &topology).expect("a plan that can be flown");
        let mut places = Vec::new();
        members(&honest, "", &mut places);
        for (parent, name) in &places {
            let mut forged = honest.clone();
            let entries = forged.pointer_mut(parent).and_then(Value::as_object_mut);
            let entries = entries.expect("an object");
            let taken = entries.remove(name).expect("a member");
            let without = forged.clone();
            let lines = told(&without, &topology);
            // Airframes have figures with defaults; which they are is told.
            let has_default = lines.is_ok() && parent.starts_with("/airframe");
            // An end of a window that is left out is an open one, which is told.
            let is_told = lines.as_ref().is_ok_and(|lines| *lines != said);
            let is_same = taken.is_null() && !parent.starts_with("/plan");
            assert!(
                lines.is_err() || has_default || is_told || is_same,
                "{parent} without {name}"
            );
            let entries = forged.pointer_mut(parent).and_then(Value::as_object_mut);
            let entries = entries.expect("an object");
            entries.insert(name.clone(), taken);
            entries.insert("more".to_owned(), json!(1));
            assert!(told(&forged, &topology).is_err(), "{parent} with more");
        }
        for list in ["legs", "stops"] {
            let count = honest["plan"][list].as_array().map_or(0, Vec::len);
            for place in 0..count {
                let change = |work: &dyn Fn(&mut Vec<Value>)| {
                    let mut forged = honest.clone();
                    work(forged["plan"][list].as_array_mut().expect("a list"));
                    let is_changed = forged != honest;
                    assert!(
                        !is_changed || told(&forged, &topology).is_err(),
                        "{list} {place}"
                    );
                };
                change(&|entries| drop(entries.remove(place)));
                change(&|entries| entries.insert(place, entries[place].clone()));
                change(&|entries| entries.swap(place, (place + 1) % count));
                change(&|entries| entries.truncate(place));
            }
        }
    }
}

#[test]
fn texts_switches_and_lists_of_the_premises_are_refused_or_told() {
    let desk = Workspace::new();
    let topology = corridor();
    let honest = plan(&desk);
    let said = told(&honest, &topology).expect("a plan that can be flown");
    let mut places = Vec::new();
    members(&honest, "", &mut places);
    let premises = places
        .iter()
        .filter(|(parent, _)| !parent.starts_with("/plan"));
    for (parent, name) in premises {
        let pointer = format!("{parent}/{name}");
        let value = honest.pointer(&pointer).expect("a place");
        let forgeries: Vec<Value> = match value {
            Value::Bool(switch) => vec![json!(!switch)],
            Value::String(_) => vec![json!("33-34"), json!(""), json!("2026-11-27T00:00:00Z")],
            Value::Array(entries) => (0..entries.len())
                .map(|place| {
                    let mut fewer = entries.clone();
                    fewer.remove(place);
                    json!(fewer)
                })
                .collect(),
            _ => Vec::new(),
        };
        for forgery in forgeries.into_iter().filter(|forgery| forgery != value) {
            let mut forged = honest.clone();
            *forged.pointer_mut(&pointer).expect("a place") = forgery.clone();
            let passes = told(&forged, &topology).is_ok_and(|lines| lines == said);
            assert!(!passes, "{pointer} = {forgery} passed without a word");
        }
    }
}

#[test]
fn bent_in_several_places_at_once_only_plans_as_good_pass() {
    let desk = Workspace::new();
    let topology = corridor();
    let mut passed = 0;
    for honest in [plan(&desk), with_stays(&desk)] {
        let mut pointers = Vec::new();
        numbers(&honest, "", &mut pointers);
        for seed in 0..1_500 {
            let mut random = ChaCha8Rng::seed_from_u64(seed);
            let mut draw = |count: usize| (random.next_u64() % count as u64) as usize;
            let mut forged = honest.clone();
            for _ in 0..=draw(4) {
                let one = pointers[draw(pointers.len())].clone();
                let other = pointers[draw(pointers.len())].clone();
                let value = forged
                    .pointer(&one)
                    .and_then(Value::as_f64)
                    .unwrap_or_default();
                let bent = match draw(6) {
                    0 => json!(-value),
                    1 => json!(value * 1.000_001),
                    2 => json!(value * 2.0),
                    3 => json!(value - 1.0),
                    4 => json!(1e12),
                    _ => forged.pointer(&other).cloned().unwrap_or_default(),
                };
                *forged.pointer_mut(&one).expect("a place") = bent;
            }
            if told(&forged, &topology).is_ok() {
                let found = objections(&forged, &topology);
                assert!(found.is_empty(), "seed {seed}: {found:?} in {forged}");
                passed += 1;
            }
        }
    }
    assert!(passed > 20, "only {passed} passed: nothing was judged");
}
