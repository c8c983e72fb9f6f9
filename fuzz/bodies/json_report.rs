//! Any bytes as a failure report: what is read is settled, answered, and means the same when it is written out.

use crate::networks::{airspaces, now};
use serde_json::json;
use skyway::airspace::Airspace;
use skyway::formats::{Known, parse_report, resolve_report, settled_report};
use skyway::recompose::{Outcome, Scratch, World, recompose};
use skyway::wire::FailureReport;

/// Reads a report, and follows it to its answer.
///
/// # Panics
/// When a report that can be read breaks a promise.
pub(crate) fn run(bytes: &[u8]) {
    let Ok(parsed) = parse_report(bytes) else {
        return;
    };
    for airspace in airspaces() {
        answer(&parsed.report, airspace);
    }
}

/// Settles a report and answers it; a settled report written out settles to the same request.
///
/// # Panics
/// When it does not.
fn answer(report: &FailureReport, airspace: &Airspace) {
    let topology = airspace.topology();
    let known = Known {
        now: Some(now()),
        ..Known::nothing()
    };
    let Ok(first) = resolve_report(report, &known, airspace, &mut Vec::new()) else {
        return;
    };
    let written = json!(settled_report(&first, topology)).to_string();
    let read = parse_report(written.as_bytes()).expect("what is written is an object");
    assert_eq!(read.warnings, [], "{written}");
    let again = resolve_report(&read.report, &Known::nothing(), airspace, &mut Vec::new())
        .expect("what is written is located");
    assert_eq!(again.request, first.request, "{written}");

    let world = World {
        airspace,
        trees: None,
    };
    let answer = recompose(&world, &first.request, &mut Scratch::new(topology));
    let has_path = !answer.path.nodes.is_empty();
    assert_eq!(has_path, answer.outcome != Outcome::NoRoute, "{written}");
}
