//! Certificates of exact answers: honest ones are proved, tampered ones refused, and whatever is
//! proved is true by the oracle.

mod case;
mod document;
mod faults;
mod premises;

use std::collections::{BTreeMap, BTreeSet};

use serde_json::{Value, json};
use skyway::flight::FailureType;
use skyway::network::NodeIx;
use skyway::recompose::{Outcome, Scratch, World, recompose};
use skyway::verify::{CertificateFault, Verdict, verify};

use crate::oracle::shortest;
use case::{Case, cases, entries, entries_mut, members, metres, with, without};

#[test]
fn certificates_of_random_requests_are_proved() {
    let mut seen: BTreeMap<&str, usize> = BTreeMap::new();
    for case in cases() {
        let seed = case.seed;
        let document = &case.document;
        let verdict = verify(&case.text, &case.facts);
        let verdict = verdict.unwrap_or_else(|fault| panic!("seed {seed}: {fault}\n{}", case.text));
        assert!(case.proves_only_truth(document, "nothing"), "seed {seed}");
        let premises = verdict.premises();
        let closed = (premises.closed_nodes, premises.closed_segments);
        let closures = (case.closures.nodes.len(), case.closures.segments.len());
        assert_eq!(closed, closures, "seed {seed}");

        let world = World {
            airspace: &case.airspace,
            trees: None,
        };
        let mut scratch = Scratch::new(case.airspace.topology());
        let answer = recompose(&world, &case.request, &mut scratch);
        let is_diverted = case.request.report.failure == FailureType::Operational;
        match &verdict {
            _ if is_diverted => {}
            Verdict::Proved { length_m, .. } => {
                let answered_m = answer.remaining_length_m.expect("a way");
                assert!(
                    (length_m - answered_m).abs() <= case.step_m(),
                    "seed {seed}"
                );
            }
            Verdict::ProvedNoWay { .. } => {
                let gave_up = matches!(answer.outcome, Outcome::Diverted | Outcome::NoRoute);
                assert!(gave_up, "seed {seed}");
            }
        }

        let starts = entries(document, "starts");
        let first_start = &starts[0]["node"];
        let is_closed = entries(document, "closed_nodes").contains(first_start);
        let has_way = !document["length_m"].is_null();
        let is_number = first_start
            .as_str()
            .is_some_and(|id| id.parse::<i64>().is_ok());
        for (what, applies) in [
            ("no way", !has_way),
            ("several starts", starts.len() > 1),
            ("a closed start", is_closed && has_way),
            ("a closed start without a way", is_closed && !has_way),
            ("at the destination", case.path_nodes().len() == 1),
            (
                "a detour",
                has_way && entries(document, "settled").len() > 1,
            ),
            ("unreachable nodes", case.text.contains(": null,")),
            ("ids of digits", is_number),
            ("ids of letters", !is_number),
        ] {
            *seen.entry(what).or_default() += usize::from(applies);
        }
    }
    assert!(seen.values().all(|&count| count >= 5), "{seen:?}");
}

#[test]
fn every_number_counts() {
    for case in cases() {
        let seed = case.seed;
        let (document, step_m) = (&case.document, case.step_m());
        let has_way = !document["length_m"].is_null();
        let lengths = match document["length_m"].as_f64() {
            Some(length_m) => vec![
                json!(length_m + step_m),
                json!(length_m - step_m),
                Value::Null,
            ],
            None => vec![json!(0.0), json!(step_m)],
        };
        for length in lengths {
            case.refuses(&with(document, "/length_m", length), "another length");
        }
        for (entry, start) in entries(document, "starts").iter().enumerate() {
            let pointer = format!("/starts/{entry}/offset_m");
            let offset_m = metres(&start["offset_m"]);
            let is_taken = case.path_nodes().first() == Some(&start["node"]);
            let lowered = with(document, &pointer, offset_m - step_m);
            let raised = with(document, &pointer, offset_m + step_m);
            case.refuses(
                &with(document, &pointer, -step_m),
                "a negative first stretch",
            );
            // Another start may lead here sooner than this one; then its own stretch is not what counts.
            let label = entries(document, "settled").iter();
            let mut label = label.filter(|label| label["node"] == start["node"]);
            let is_nearest = label.any(|label| label["d_m"] == start["offset_m"]);
            if is_taken || (!has_way && is_nearest) {
                case.refuses(&lowered, "a shorter first stretch");
            } else {
                case.proves_only_truth(&lowered, "a shorter first stretch not taken");
            }
            if is_taken {
                case.refuses(&raised, "a longer first stretch");
            } else {
                // The way not taken only becomes longer; with no way at all, no stretch matters.
                let still_proved = case.proves_only_truth(&raised, "a longer stretch not taken");
                assert!(still_proved, "seed {seed}");
            }
        }
        for (entry, label) in entries(document, "settled").iter().enumerate() {
            let pointer = format!("/settled/{entry}/d_m");
            let d_m = metres(&label["d_m"]);
            case.refuses(&with(document, &pointer, d_m + step_m), "a label too high");
            // A label too low may leave a proof: what leads on from the node is then bounded more loosely.
            let lowered = with(document, &pointer, d_m - step_m);
            case.proves_only_truth(&lowered, "a label too low");
        }
    }
}

#[test]
fn every_bound_counts() {
    for case in cases() {
        let seed = case.seed;
        let (document, step_m) = (&case.document, case.step_m());
        let world = case.world(document);
        let starts = entries(document, "starts").iter();
        let starts: Vec<usize> = starts.map(|start| case.node(&start["node"])).collect();
        for (id, bound) in members(document, "h_m") {
            let node = case.node(&json!(id));
            let pointer = format!("/h_m/{id}");
            let mut dropped = document.clone();
            let bounds = dropped["h_m"].as_object_mut().expect("an object");
            bounds.remove(id);
            case.refuses(&dropped, "a bound left out");
            case.refuses(&with(document, &pointer, -step_m), "a negative bound");
            if document["destination"].to_string().trim_matches('"') == id {
                case.refuses(
                    &with(document, &pointer, step_m),
                    "a bound at the destination",
                );
                case.refuses(&with(document, &pointer, Value::Null), "no bound there");
                continue;
            }
            let segments = case.network.segments.iter().enumerate();
            let open_m = segments.filter_map(|(index, segment)| {
                let is_here = segment.a == node || segment.b == node;
                let is_open = starts
                    .iter()
                    .any(|&start| world.segment_is_open(index, start));
                (is_here && is_open).then_some(segment.length_m)
            });
            let longest_m = open_m.max_by(f64::total_cmp);
            let Some(bound_m) = bound.as_f64() else {
                let reachable = with(document, &pointer, 0.0);
                let still_proved = case.proves_only_truth(&reachable, "reachable");
                // No open segment, no condition: the bound of a node that no path reaches is idle.
                assert!(
                    !still_proved || longest_m.is_none(),
                    "seed {seed}, node {id}"
                );
                continue;
            };
            let far = with(
                document,
                &pointer,
                bound_m + 2.0 * longest_m.unwrap_or(1.0) + step_m,
            );
            let unreachable = with(document, &pointer, Value::Null);
            for (changed, what) in [(far, "a bound too high"), (unreachable, "no bound")] {
                let still_proved = case.proves_only_truth(&changed, what);
                let is_idle = longest_m.is_none();
                assert_eq!(still_proved, is_idle, "seed {seed}: {what}, node {id}");
            }
            for changed_m in [bound_m + step_m, bound_m - step_m, bound_m / 2.0, 0.0] {
                // Within its neighbours' bounds a bound has room: a lower one claims less.
                let changed = with(document, &pointer, changed_m.max(0.0));
                case.proves_only_truth(&changed, "another bound");
            }
        }
    }
}

#[test]
fn the_path_is_walked() {
    let mut tampered = 0;
    for case in cases() {
        let document = &case.document;
        let nodes = case.path_nodes().len();
        for place in 0..nodes {
            case.refuses(&without(document, "/path/nodes", place), "a node left out");
            for segment in [place.checked_sub(1), Some(place)].into_iter().flatten() {
                if segment + 1 < nodes {
                    let shorter = without(document, "/path/nodes", place);
                    let shorter = without(&shorter, "/path/segments", segment);
                    let first = &shorter["path"]["nodes"][0];
                    let mut starts = entries(document, "starts").iter();
                    if place == 0 && starts.any(|start| start["node"] == *first) {
                        // A drone at one end of its leg flies back over it as a first stretch or as a
                        // segment; where the lengths agree, the path left is another shortest one.
                        case.proves_only_truth(&shorter, "the path from the next start");
                        continue;
                    }
                    case.refuses(&shorter, "a node and a segment left out");
                    tampered += 1;
                }
            }
            for other in place + 1..nodes {
                let mut swapped = document.clone();
                entries_mut(&mut swapped["path"], "nodes").swap(place, other);
                case.refuses(&swapped, "nodes swapped");
            }
        }
        leaps_are_refused(&case);
        loops_are_refused(&case);
    }
    assert!(tampered > 400, "{tampered}");
}

/// The way from the path's first node to its `place`-th, first stretch included.
fn walked_m(case: &Case, place: usize) -> f64 {
    let mut starts = entries(&case.document, "starts").iter();
    let start = starts.find(|start| start["node"] == case.path_nodes()[0]);
    let legs = case.path_nodes().windows(2).take(place).map(|pair| {
        let segments = case
            .network
            .segments_between(case.node(&pair[0]), case.node(&pair[1]));
        case.network.segments[segments[0]].length_m
    });
    metres(&start.expect("a start")["offset_m"]) + legs.sum::<f64>()
}

/// A length below the optimum has a proof that nothing is shorter; only the path can refute it.
#[track_caller]
fn leaps_are_refused(case: &Case) {
    let segments = entries(&case.document["path"], "segments");
    for place in 0..segments.len() {
        let mut nodes = case.path_nodes()[..=place].to_vec();
        nodes.push(case.document["destination"].clone());
        let mut leap = with(&case.document, "/length_m", walked_m(case, place));
        leap["path"] = json!({"nodes": nodes, "segments": segments[..place]});
        case.refuses(&leap, "a leap to the destination");
    }
}

/// There and back before the path begins, with the honest length of it all.
#[track_caller]
fn loops_are_refused(case: &Case) {
    let segments = entries(&case.document["path"], "segments");
    let Some(segment) = segments.first() else {
        return;
    };
    let nodes = &case.path_nodes()[..2];
    let length_m = metres(&case.document["length_m"]);
    let extra_m = 2.0 * (walked_m(case, 1) - walked_m(case, 0));
    let mut there_and_back = with(&case.document, "/length_m", length_m + extra_m);
    let path = &mut there_and_back["path"];
    entries_mut(path, "segments").splice(0..0, [segment.clone(), segment.clone()]);
    entries_mut(path, "nodes").splice(0..0, nodes.iter().cloned());
    case.refuses(&there_and_back, "a loop with its honest length");
}

/// A path that is open and as long as claimed, but not the shortest: the one thing a proof is for.
#[test]
fn a_longer_path_is_refused_whatever_its_honesty() {
    let mut faults = BTreeSet::new();
    let mut tampered = 0;
    for case in cases() {
        let seed = case.seed;
        let document = &case.document;
        let Some(length_m) = document["length_m"].as_f64() else {
            continue;
        };
        let walked: Vec<usize> = case.path_nodes().iter().map(|id| case.node(id)).collect();
        let offset_m = walked_m(&case, 0);
        for pair in walked.windows(2) {
            let mut world = case.world(document);
            let segment = case.network.segments_between(pair[0], pair[1])[0];
            world.closed_segments.insert(segment);
            let end = walked[walked.len() - 1];
            let Some((way_m, way)) = shortest(&world, walked[0], end, None) else {
                continue;
            };
            if offset_m + way_m <= length_m + case.step_m() {
                continue;
            }
            let topology = case.airspace.topology();
            let found =
                |&node: &usize| topology.node(&case.network.nodes[node].id).expect("a node");
            let way: Vec<NodeIx> = way.iter().map(found).collect();
            let mut longer = with(document, "/length_m", offset_m + way_m);
            let segment_id = |pair: &[NodeIx]| {
                let segment = topology.segment_between(pair[0], pair[1]);
                topology
                    .segment_id(segment.expect("a segment"))
                    .into_owned()
            };
            longer["path"] = json!({
                "nodes": way.iter().map(|&node| case.written(topology.node_id(node))).collect::<Vec<_>>(),
                "segments": way.windows(2).map(segment_id).collect::<Vec<_>>(),
            });
            let fault = case.refuses(&longer, "a longer path");
            faults.insert(match fault {
                CertificateFault::StartBelow { .. } => "start",
                CertificateFault::SegmentBelow { .. } => "segment",
                other => panic!("seed {seed}: {other}"),
            });
            tampered += 1;
        }
    }
    assert!(tampered > 100 && faults.len() == 2, "{tampered} {faults:?}");
}
