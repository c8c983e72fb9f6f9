//! What a verifier says of a certificate that is wrong: what fails, and where.

use serde_json::{Value, json};
use skyway::verify::verify;

use super::case::{entries_mut, with, without};
use super::document::proof;

#[track_caller]
fn says(document: &Value, expected: &str) {
    let fault = verify(&document.to_string(), &proof().0).expect_err(expected);
    assert_eq!(fault.to_string(), expected);
}

#[test]
fn a_condition_that_fails_is_named_with_its_place() {
    let (_, proof) = proof();
    let no_start = with(&proof, "/starts", json!([]));
    let mut labelled = proof.clone();
    entries_mut(&mut labelled, "settled").push(json!({"node": "C", "d_m": 399.0}));
    let mut far = proof.clone();
    entries_mut(&mut far, "settled").push(json!({"node": "D", "d_m": 101.0}));
    for (document, expected) in [
        (
            no_start,
            "starts: there are none; without a start nothing is claimed",
        ),
        (
            with(&proof, "/h_m/C", 1.0),
            "h_m: the destination 'C' has 1 m, not 0",
        ),
        (
            with(&proof, "/h_m/C", Value::Null),
            "h_m: the destination 'C' has null, not 0",
        ),
        (
            with(&proof, "/h_m/D", 301.0),
            "h_m: segment 'A-D' from node 'A' to 'D', 100 m long, bridges a difference of 101 m",
        ),
        (
            with(&proof, "/h_m/d", Value::Null),
            "h_m: segment 'D-d' from node 'D' to 'd' is open, yet one of its nodes is unreachable (null) \
             and the other is not",
        ),
        (
            with(&proof, "/settled/0/d_m", 1.0),
            "settled: start 'A' has 1 m, above its first stretch of 0 m",
        ),
        (
            with(&proof, "/settled", json!([])),
            "starts: from node 'A' 200 m may do, below the 400 m claimed",
        ),
        (
            with(&proof, "/h_m/D", 299.0),
            "segment 'A-D' from node 'A' to 'D' leads from a settled node below the length claimed: \
             399 m may do, 400 m are claimed",
        ),
        (
            labelled,
            "settled: the destination 'C' has 399 m, below the 400 m claimed",
        ),
        (
            far,
            "settled: segment 'A-D' from node 'A' to 'D' leads there in 100 m, but node 'D' has 101 m",
        ),
        (
            without(&proof, "/closed_segments", 0),
            "segment 'A-B' from node 'A' to 'B' leads from a settled node below the length claimed: \
             200 m may do, 400 m are claimed",
        ),
    ] {
        says(&document, expected);
    }
}

#[test]
fn a_path_or_a_name_that_is_wrong_is_named_with_its_place() {
    let (_, proof) = proof();
    let other = with(&proof, "/network_sha256", "f".repeat(64));
    let ends = with(&proof, "/closed_segments/0/to", "D");
    for (document, expected) in [
        (
            with(
                &proof,
                "/path",
                json!({"nodes": ["A", "B", "C"], "segments": ["A-B", "B-C"]}),
            ),
            "path: segment 'A-B' from node 'A' to 'B' is closed, or leads to a closed node",
        ),
        (
            with(&proof, "/path/segments/1", "B-C"),
            "path: the network has no segment 'B-C' from node 'D' to 'd'",
        ),
        (
            with(&proof, "/path/nodes/0", "B"),
            "path: it begins at node 'B', which is no start",
        ),
        (
            with(&proof, "/path/nodes/4", "F"),
            "path: it ends at node 'F', not at the destination 'C'",
        ),
        (
            with(&proof, "/path/nodes", json!([])),
            "path: 0 nodes and 4 segments are no path; it has one node more than segments",
        ),
        (
            with(&proof, "/destination", "Y"),
            "destination: the network has no node 'Y'",
        ),
        (
            with(&proof, "/destination", 3),
            "destination: the network has no node '3'",
        ),
        (
            with(&proof, "/path/segments/0", "A-X"),
            "path: the network has no segment 'A-X'",
        ),
        (
            ends,
            "closed_segments: the network has no segment 'A-B' from node 'A' to 'D'",
        ),
        (
            other,
            &format!(
                "network_sha256: the certificate is about network {}, this one is {}; take the file that \
                 the answer was computed on",
                "f".repeat(64),
                "0".repeat(64)
            ),
        ),
    ] {
        says(&document, expected);
    }
}
