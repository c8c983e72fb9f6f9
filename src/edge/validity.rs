//! Whether what was answered before may be answered again: never an outdated answer.

use super::planner::Scene;
use super::records::AnswerRecord;
use super::snapshot::Snapshot;
use crate::airspace::Airspace;
use crate::flight::Location;
use crate::recompose::Outcome;
use crate::routing::Way;
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
    if let Some(flown) = &record.flown {
        let scene = Scene {
            snapshot,
            airspace,
            now,
        };
        let answered = (record.answered_at, flown.snapshot.weather.as_ref());
        let told = (&flown.drone, &flown.flight);
        if !flown.flights.still_holds(scene, told, answered) {
            return false;
        }
    }
    let way = &record.answer.path;
    if way.nodes.is_empty() {
        return record.airspace.revision() == airspace.revision();
    }
    let location = record.settled.request.report.location;
    let is_diversion = record.answer.outcome == Outcome::Diverted;
    let is_open = match &record.flown {
        // When what is closed opens has been looked at.
        Some(_) => {
            let end = way.nodes.last().filter(|_| is_diversion);
            end.is_none_or(|&end| !airspace.closes_pads(end))
        }
        None => way_is_open(way, is_diversion, snapshot),
    };
    is_open && first_stretch_is_clear(location, way, Some(&record.airspace), snapshot)
}

/// Whether a way can be flown now; a diversion also needs the pads at its end.
pub(super) fn way_is_open(way: &Way, is_diversion: bool, snapshot: &Snapshot) -> bool {
    let airspace = &snapshot.airspace;
    let closed = airspace.closed();
    let Some(&last) = way.nodes.last() else {
        return false;
    };
    let is_open =
        way.segments.iter().all(|&segment| !closed.blocks(segment)) && !closed.closes_node(last);
    is_open && (!is_diversion || !airspace.closes_pads(last))
}

/// A zone that has come over the drone or its first stretch since makes the way onto the path another one. Where
/// nobody knows which zones there were, all count as come since.
pub(super) fn first_stretch_is_clear(
    location: Location,
    way: &Way,
    before: Option<&Airspace>,
    snapshot: &Snapshot,
) -> bool {
    let (Location::At(place), Some(&first)) = (location, way.nodes.first()) else {
        return true;
    };
    let first = snapshot.topology().position(first);
    let closures = snapshot.airspace.in_force();
    let fresh =
        closures.filter(|closure| before.is_none_or(|before| !before.is_in_force(&closure.id)));
    let mut zones = fresh.filter_map(|closure| closure.zone());
    zones.all(|zone| zone.coverage(place, first).is_empty())
}
