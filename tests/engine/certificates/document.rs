//! The text of a certificate, on one small network: how it is written, what it must hold, and what a
//! verifier says of one that is wrong.

use serde_json::{Value, json};
use skyway::airspace::Airspace;
use skyway::flight::{FailureReport, FailureType, Location};
use skyway::geo::Point;
use skyway::network::{NetworkDraft, NodeDraft, SegmentDraft, Topology, sketch};
use skyway::recompose::Request;
use skyway::verify::{CertificateFault, NetworkFacts, Verdict, verify};

use super::case::{certificate, entries_mut, with, without};

/// A - B - C is the plan, A-B fails; over D and d it is 4 x 100 m to C. X is an island, and F, whose one
/// segment is closed, has become one.
fn detour() -> Airspace {
    let topology = sketch(
        "
        Dd F
        ABC X
        ",
        &[
            ("A", "B"),
            ("B", "C"),
            ("A", "D"),
            ("D", "d"),
            ("d", "B"),
            ("C", "F"),
        ],
    );
    airspace_of(topology, &[("C", "F")])
}

fn airspace_of(topology: Topology, closed: &[(&str, &str)]) -> Airspace {
    let node = |id: &str| topology.node(id).expect("a node");
    let closed = closed.iter().map(|(from, to)| {
        let segment = topology.segment_between(node(from), node(to));
        segment.expect("a segment")
    });
    let closed = closed.collect();
    super::case::airspace_of(topology, Vec::new(), closed)
}

fn request(airspace: &Airspace, leg: (&str, &str), destination: &str) -> Request {
    let node = |id: &str| airspace.topology().node(id).expect("a node");
    Request::exact(FailureReport {
        failure: FailureType::Navigational,
        leg: (node(leg.0), node(leg.1)),
        location: Location::LegStart,
        cause_location: None,
        destination: node(destination),
        remaining_path: None,
    })
}

/// The facts and the certificate of the failure of A-B on the way from A to C.
pub(super) fn proof() -> (NetworkFacts, Value) {
    let airspace = detour();
    let text = certificate(&airspace, &request(&airspace, ("A", "B"), "C"));
    let document = serde_json::from_str(&text).expect("JSON");
    (NetworkFacts::of(airspace.topology()), document)
}

#[test]
fn a_certificate_is_written_entry_by_entry_in_node_order() {
    let airspace = detour();
    let text = certificate(&airspace, &request(&airspace, ("A", "B"), "C"));
    let zeros = "0".repeat(64);
    let expected = format!(
        r#"{{
"network_sha256": "{zeros}",
"starts": [
  {{"node": "A", "offset_m": 0.0}}
],
"destination": "C",
"closed_nodes": [],
"closed_segments": [
  {{"id": "A-B", "from": "A", "to": "B"}},
  {{"id": "C-F", "from": "C", "to": "F"}}
],
"length_m": 400.0,
"settled": [
  {{"node": "A", "d_m": 0.0}}
],
"h_m": {{
  "A": 200.0,
  "B": 100.0,
  "C": 0.0,
  "D": 300.0,
  "F": 141.4213562373095,
  "X": null,
  "d": 200.0
}},
"path": {{"nodes": [
  "A",
  "D",
  "d",
  "B",
  "C"
],
"segments": [
  "A-D",
  "D-d",
  "B-d",
  "B-C"
]}}
}}
"#
    );
    assert_eq!(text, expected);
    let verdict = verify(&text, &NetworkFacts::of(airspace.topology()));
    assert_eq!(
        verdict.expect("a proof").to_string(),
        "proved: the path is 400 m long and no open way is shorter, from node 'A' after 0 m to node 'C'; \
         taken from the certificate, to be compared with the report: 0 nodes, 2 segments closed"
    );
}

#[test]
fn that_there_is_no_way_is_proved_by_what_can_be_reached() {
    let airspace = detour();
    let text = certificate(&airspace, &request(&airspace, ("A", "B"), "X"));
    assert!(
        text.contains("\"length_m\": null") && text.contains("\"nodes\": []"),
        "{text}"
    );
    let facts = NetworkFacts::of(airspace.topology());
    let verdict = verify(&text, &facts).expect("a proof");
    assert!(matches!(verdict, Verdict::ProvedNoWay { .. }), "{verdict}");
    let document: Value = serde_json::from_str(&text).expect("JSON");
    let says = |document: &Value| match verify(&document.to_string(), &facts) {
        Ok(verdict) => verdict.to_string(),
        Err(fault) => fault.to_string(),
    };
    let settled = document["settled"].as_array().expect("an array");
    assert_eq!(settled.len(), 5, "A, B, C, D and d");
    let at = |id: &str| {
        settled
            .iter()
            .position(|label| label["node"] == id)
            .expect("a label")
    };
    assert_eq!(
        says(&without(&document, "/settled", at("A"))),
        "settled: start 'A' is missing; that there is no way is proved by all that can be reached"
    );
    assert_eq!(
        says(&without(&document, "/settled", at("C"))),
        "settled: segment 'B-C' from node 'B' to 'C' is open and leads out of what can be reached, \
         yet no way is claimed"
    );
    let mut silent = document.clone();
    silent
        .as_object_mut()
        .expect("an object")
        .remove("length_m");
    assert!(says(&silent).starts_with("not a certificate: missing field `length_m`"));
    let mut reached = document.clone();
    entries_mut(&mut reached, "settled").push(json!({"node": "X", "d_m": 1.0}));
    assert_eq!(
        says(&reached),
        "settled: the destination 'X' is among what can be reached, yet no way is claimed"
    );
    for walked in [
        with(&document, "/path/nodes", json!(["A"])),
        with(&document, "/path/segments", json!(["A-D"])),
    ] {
        assert_eq!(
            says(&walked),
            "path: it has nodes or segments, yet length_m is null, which claims that there is no way"
        );
    }
}

/// Numbers that a proof does not need may be anything the conditions leave room for.
#[test]
fn what_a_proof_does_not_need_may_change() {
    let (facts, proof) = proof();
    let mut beside = proof.clone();
    entries_mut(&mut beside, "settled").push(json!({"node": "X", "d_m": 7.0}));
    for (harmless, why) in [
        (
            with(&proof, "/h_m/F", 5000.0),
            "all segments of F are closed: no path gets there",
        ),
        (with(&proof, "/h_m/X", 3.0), "X has no segments at all"),
        (beside, "nothing open leads from X to anywhere"),
        (with(&proof, "/settled/0/d_m", 0), "an integer is a number"),
        (
            with(
                &proof,
                "/closed_segments/0",
                json!({"to": "A", "from": "B", "id": "A-B"}),
            ),
            "a segment has no direction",
        ),
    ] {
        let verdict = verify(&harmless.to_string(), &facts);
        assert!(
            matches!(verdict, Ok(Verdict::Proved { .. })),
            "{why}: {verdict:?}"
        );
    }
    // A lower bound claims less, but not below what its neighbours' bounds and lengths leave.
    let lower = with(&proof, "/h_m/B", 99.5);
    let fault = verify(&lower.to_string(), &facts).expect_err("d at 200 m");
    assert!(
        matches!(fault, CertificateFault::BoundsDiffer { .. }),
        "{fault}"
    );
}

/// All places of a document, that of the document itself first.
fn places(value: &Value, pointer: &str, found: &mut Vec<String>) {
    found.push(pointer.to_owned());
    match value {
        Value::Array(array) => {
            for (entry, inner) in array.iter().enumerate() {
                places(inner, &format!("{pointer}/{entry}"), found);
            }
        }
        Value::Object(object) => {
            for (name, inner) in object {
                places(inner, &format!("{pointer}/{name}"), found);
            }
        }
        _ => {}
    }
}

#[test]
fn every_place_has_one_type_and_every_member_is_there_once() {
    let (facts, proof) = proof();
    let mut found = Vec::new();
    places(&proof, "", &mut found);
    let refuses = |document: &Value, what: &str| {
        let verdict = verify(&document.to_string(), &facts);
        assert!(verdict.is_err(), "{what}: {document}");
    };
    let alternatives = json!([
        null,
        true,
        "x",
        -1,
        0.5,
        1e300,
        [],
        {},
        ["A", 0.0],
        "A",
        "1e3"
    ]);
    for place in &found {
        let original = proof.pointer(place).expect("a place");
        for other in alternatives.as_array().expect("an array") {
            let same_type = std::mem::discriminant(original) == std::mem::discriminant(other);
            // An island is neither reachable nor unreachable by anything open; so is what F has become.
            let is_free = place == "/h_m/X" || place == "/h_m/F";
            if !same_type && !(is_free && (other.is_number() || other.is_null())) {
                refuses(&with(&proof, place, other.clone()), place);
            }
        }
        let Some(object) = original.as_object() else {
            continue;
        };
        let mut more = object.clone();
        more.insert("more".to_owned(), Value::Null);
        refuses(&with(&proof, place, more), "a member too many");
        for name in object.keys() {
            let mut fewer = object.clone();
            fewer.remove(name);
            refuses(&with(&proof, place, fewer), name);
        }
    }
    assert!(found.len() > 40, "{found:?}");
    for array in [
        json!(["A", 0.0]),
        json!(["A-B", "A", "B"]),
        json!([["A"], []]),
    ] {
        for place in ["/starts/0", "/settled/0", "/closed_segments/0", "/path"] {
            refuses(
                &with(&proof, place, array.clone()),
                "an array in place of an object",
            );
        }
    }
    for list in ["settled", "closed_segments"] {
        let mut twice = proof.clone();
        let first = twice[list][0].clone();
        entries_mut(&mut twice, list).push(first);
        refuses(&twice, "an entry listed twice");
    }
    refuses(
        &with(&proof, "/closed_nodes", json!(["X", "X"])),
        "a node listed twice",
    );
}

#[test]
fn text_that_is_no_certificate_is_refused_with_the_place() {
    let airspace = detour();
    let facts = NetworkFacts::of(airspace.topology());
    let text = certificate(&airspace, &request(&airspace, ("A", "B"), "C"));
    for end in 0..text.trim_end().len() {
        let verdict = verify(&text[..end], &facts);
        let is_unreadable = matches!(verdict, Err(CertificateFault::Unreadable { .. }));
        assert!(is_unreadable, "{end} bytes: {verdict:?}");
    }
    for (broken, expected) in [
        (
            text.clone() + "{}",
            "trailing characters at line 39 column 1",
        ),
        (
            text.replace(
                "\"destination\": \"C\"",
                "\"destination\": \"C\", \"destination\": \"C\"",
            ),
            "duplicate field `destination` at line 6 column 33",
        ),
        (
            text.replace("400.0", "1e999"),
            "number out of range at line 12 column 17",
        ),
        (
            text.replace("\"d\": 200.0", "\"d\": NaN"),
            "expected value at line 23 column 8",
        ),
    ] {
        let fault = verify(&broken, &facts).expect_err(expected);
        assert_eq!(fault.to_string(), format!("not a certificate: {expected}"));
    }
    let twice = text.replace("\"d\": 200.0", "\"d\": 200.0, \"d\": 200.0");
    let fault = verify(&twice, &facts).expect_err("twice");
    assert_eq!(fault.to_string(), "h_m: 'd' is listed twice");
}

/// Nodes whose ids are integers, one of them zero-padded: JSON has no such number.
#[test]
fn ids_are_text_and_integers_of_older_certificates_are_read() {
    let node = |id: &str, x: f64| NodeDraft {
        id: id.to_owned(),
        position: [x, 0.0],
        ..NodeDraft::default()
    };
    let draft = NetworkDraft {
        integer_ids: true,
        nodes: vec![
            node("007", 0.0),
            node("18446744073709551615", 30.0),
            node("-8", 70.0),
        ],
        segments: [
            ("007", "18446744073709551615"),
            ("18446744073709551615", "-8"),
        ]
        .map(|(from, to)| SegmentDraft {
            from: from.to_owned(),
            to: to.to_owned(),
            ..SegmentDraft::default()
        })
        .to_vec(),
        ..NetworkDraft::default()
    };
    let topology = Topology::build(draft, [7; 32]).expect("a network");
    let airspace = airspace_of(topology, &[]);
    let mut request = request(&airspace, ("007", "18446744073709551615"), "-8");
    request.report.failure = FailureType::ServiceLevel;
    request.report.location = Location::At(Point::new(7.5, 0.0));
    let text = certificate(&airspace, &request);
    let facts = NetworkFacts::of(airspace.topology());
    let verdict = verify(&text, &facts).expect("a proof");
    let starts = [
        ("007".to_owned(), 7.5),
        ("18446744073709551615".to_owned(), 22.5),
    ];
    assert_eq!(verdict.premises().starts, starts, "{verdict}");
    let document: Value = serde_json::from_str(&text).expect("JSON");
    assert_eq!(document["destination"], json!("-8"));
    let older = with(&document, "/destination", -8);
    let verdict = verify(&older.to_string(), &facts).expect("a proof");
    assert_eq!(verdict.premises().starts, starts, "{verdict}");
}
