//! What is closed, what is settled and where to start from: changed in random certificates, left out,
//! borrowed from another day, and always held against the oracle.

use serde_json::{Value, json};
use skyway::airspace::{Change, Closure};
use skyway::network::{NodeIx, SegmentIx};
use std::sync::Arc;

use super::case::{cases, certificate, entries, entries_mut, metres, with, without};
use crate::oracle::generate::Draw;

#[test]
fn a_closure_left_out_is_refused_where_it_matters() {
    let (mut refused, mut idle) = (0, 0);
    for case in cases() {
        let seed = case.seed;
        for list in ["closed_nodes", "closed_segments"] {
            for entry in 0..entries(&case.document, list).len() {
                let opened = without(&case.document, &format!("/{list}"), entry);
                // What stays proved has no use for the opened way; the oracle agrees.
                let still_proved = case.proves_only_truth(&opened, "a closure left out");
                idle += usize::from(still_proved);
                refused += usize::from(!still_proved);
                let claimed_m = case.document["length_m"].as_f64();
                let true_m = case.truth(&opened);
                let matters = match (claimed_m, true_m) {
                    (Some(claimed_m), Some(true_m)) => true_m < claimed_m - case.step_m(),
                    (claimed_m, true_m) => claimed_m.is_some() != true_m.is_some(),
                };
                assert!(!(matters && still_proved), "seed {seed}: {list} {entry}");
            }
        }
    }
    assert!(refused > 100 && idle > 100, "{refused} {idle}");
}

#[test]
fn a_closure_made_up_is_told_and_never_proves_an_untruth() {
    let (mut proved, mut refused) = (0, 0);
    for case in cases() {
        let seed = case.seed;
        let topology = case.airspace.topology();
        for segment in topology.segments() {
            let ends = topology.segment(segment);
            let [from, to] = [ends.from, ends.to].map(|node| case.written(topology.node_id(node)));
            let closed = json!({"id": topology.segment_id(segment), "from": from, "to": to});
            let listed = entries(&case.document, "closed_segments");
            if listed.iter().any(|other| other["id"] == closed["id"]) {
                continue;
            }
            let mut more = case.document.clone();
            entries_mut(&mut more, "closed_segments").push(closed.clone());
            let on_path = entries(&case.document["path"], "segments").contains(&closed["id"]);
            if on_path {
                case.refuses(&more, "a path over a closed segment");
                refused += 1;
                continue;
            }
            // The proof holds in a world that is closed further; the verdict counts what was closed.
            assert!(
                case.proves_only_truth(&more, "a closure made up"),
                "seed {seed}"
            );
            let verdict = case.verdict(&more).expect("a proof");
            let counted = verdict.premises().closed_segments;
            assert_eq!(counted, case.closures.segments.len() + 1, "seed {seed}");
            proved += 1;
        }
        for closed in entries(&case.document["path"], "nodes").iter().skip(1) {
            let mut more = case.document.clone();
            entries_mut(&mut more, "closed_nodes").push(closed.clone());
            case.refuses(&more, "a path into a closed node");
        }
    }
    assert!(proved > 1000 && refused > 100, "{proved} {refused}");
}

#[test]
fn a_settled_node_left_out_is_refused_unless_it_lies_on_a_shortest_way() {
    let (mut refused, mut idle) = (0, 0);
    for case in cases() {
        let seed = case.seed;
        for (entry, label) in entries(&case.document, "settled").iter().enumerate() {
            let fewer = without(&case.document, "/settled", entry);
            let id = label["node"].to_string();
            let bound_m = case.document["h_m"][id.trim_matches('"')].as_f64();
            let through_m = metres(&label["d_m"]) + bound_m.unwrap_or(f64::INFINITY);
            let claimed_m = case.document["length_m"].as_f64();
            // Entered at `d` and left by `h`, such a node bounds the way by what is claimed all the same.
            let is_idle = claimed_m.is_some_and(|claimed_m| through_m > claimed_m - 1e-9);
            if is_idle {
                assert!(
                    case.proves_only_truth(&fewer, "a settled node left out"),
                    "seed {seed}"
                );
                idle += 1;
            } else {
                case.refuses(&fewer, "a settled node left out");
                refused += 1;
            }
        }
    }
    assert!(refused > 500 && idle > 5, "{refused} {idle}");
}

/// Proofs of a world with other closures, under the closures, starts or numbers of this one.
#[test]
fn a_proof_of_another_day_proves_only_what_is_true_today() {
    let (mut proved, mut refused) = (0, 0);
    for case in cases() {
        let seed = case.seed;
        let topology = case.airspace.topology();
        let mut draw = Draw::new(seed ^ 0xda7);
        for _ in 0..6 {
            let nodes: Vec<NodeIx> = topology.nodes().filter(|_| draw.chance(0.1)).collect();
            let segments: Vec<SegmentIx> =
                topology.segments().filter(|_| draw.chance(0.1)).collect();
            let id = "test".to_owned();
            let closure = Closure::of_operator(id, "another day".to_owned(), nodes, segments);
            let change = Change::Put(Arc::new(closure));
            let another_day = case.airspace.apply(&[change], case.airspace.as_of());
            let text = certificate(&another_day, &case.request);
            let other: Value = serde_json::from_str(&text).expect("JSON");
            for borrowed in [
                vec!["closed_nodes", "closed_segments"],
                vec!["closed_nodes", "closed_segments", "starts"],
                vec!["settled"],
                vec!["settled", "length_m", "path"],
                vec!["length_m", "path"],
            ] {
                let mut forged = other.clone();
                for member in borrowed {
                    forged[member] = case.document[member].clone();
                }
                let still_proved = case.proves_only_truth(&forged, "a proof of another day");
                proved += usize::from(still_proved);
                refused += usize::from(!still_proved);
            }
        }
    }
    assert!(proved > 100 && refused > 1000, "{proved} {refused}");
}

/// The places of all numbers in metres.
fn numbers(document: &Value) -> Vec<String> {
    let mut found = vec!["/length_m".to_owned()];
    for (list, name) in [("starts", "offset_m"), ("settled", "d_m")] {
        let count = entries(document, list).len();
        found.extend((0..count).map(|entry| format!("/{list}/{entry}/{name}")));
    }
    let bounds = document["h_m"].as_object().expect("an object");
    found.extend(bounds.keys().map(|id| format!("/h_m/{id}")));
    found
}

#[test]
fn whatever_is_changed_what_verifies_is_true() {
    let (mut proved, mut refused) = (0, 0);
    for case in cases() {
        let seed = case.seed;
        let mut draw = Draw::new(seed ^ 0x7a3);
        let places = numbers(&case.document);
        let nodes = case.network.nodes.len();
        for _ in 0..100 {
            let mut changed = case.document.clone();
            for _ in 0..1 + draw.below(3) {
                let number = |draw: &mut Draw| places[draw.below(places.len())].clone();
                let (place, other) = (number(&mut draw), number(&mut draw));
                let metres = changed.pointer(&other).and_then(Value::as_f64);
                let factor = [1.0, 0.5, 2.0, 0.0, draw.unit()][draw.below(5)];
                let settled = entries(&changed, "settled").len();
                let node = case.written(&case.network.nodes[draw.below(nodes)].id);
                changed = match draw.below(6) {
                    0 if settled > 0 => without(&changed, "/settled", draw.below(settled)),
                    1 => {
                        let label = json!({"node": node, "d_m": metres.unwrap_or(0.0) * factor});
                        entries_mut(&mut changed, "settled").push(label);
                        changed
                    }
                    2 => {
                        let start = json!({"node": node, "offset_m": metres.unwrap_or(0.0)});
                        entries_mut(&mut changed, "starts").push(start);
                        changed
                    }
                    3 => with(&changed, "/destination", node),
                    _ if changed.pointer(&place).is_none() => changed,
                    _ => with(&changed, &place, metres.map(|metres| metres * factor)),
                };
            }
            let still_proved = case.proves_only_truth(&changed, "random changes");
            proved += usize::from(still_proved);
            refused += usize::from(!still_proved);
        }
    }
    assert!(proved > 500 && refused > 5000, "{proved} {refused}");
}
