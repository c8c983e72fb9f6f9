//! Whether what was answered before may be answered again: never an outdated answer.

use super::records::AnswerRecord;
use super::snapshot::Snapshot;
use crate::flight::Location;
use crate::recompose::Outcome;
use jiff::Timestamp;

/// Whether a stored answer may be given again: its path is open, or without a path nothing has changed.
pub(super) fn still_holds(record: &AnswerRecord, snapshot: &Snapshot, now: Timestamp) -> bool {
    let airspace = &snapshot.airspace;
    if record.airspace.topology_revision() != airspace.topology_revision() {
        return false;
    }
    let deadline = record
        .report
        .deadline
        .as_deref()
        .and_then(|text| text.parse::<Timestamp>().ok());
    if deadline.is_some_and(|deadline| deadline < now) {
        return false;
    }
    let path = &record.answer.path;
    let Some(&last) = path.nodes.last() else {
        return record.airspace.revision() == airspace.revision();
    };
    let closed = airspace.closed();
    let is_open =
        path.segments.iter().all(|&segment| !closed.blocks(segment)) && !closed.closes_node(last);
    let is_safe = record.answer.outcome != Outcome::Diverted || !airspace.closes_pads(last);
    is_open && is_safe && first_stretch_is_clear(record, snapshot)
}

/// A zone that has come over the drone or its first stretch since makes the way onto the path another one.
fn first_stretch_is_clear(record: &AnswerRecord, snapshot: &Snapshot) -> bool {
    let request = &record.settled.request;
    let (Location::At(place), Some(&first)) =
        (request.report.location, record.answer.path.nodes.first())
    else {
        return true;
    };
    let first = snapshot.topology().position(first);
    let fresh = snapshot
        .airspace
        .in_force()
        .filter(|closure| !record.airspace.is_in_force(&closure.id));
    let mut zones = fresh.filter_map(|closure| closure.zone());
    zones.all(|zone| zone.coverage(place, first).is_empty())
}
