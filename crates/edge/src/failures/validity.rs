//! Whether what was answered before may be answered again: never an outdated answer.

use super::records::AnswerRecord;
use crate::drones::progress;
use crate::planner::Planner;
use crate::plans::stretches::Stretch;
use crate::snapshot::Snapshot;
use jiff::Timestamp;
use skyway_engine::airspace::Airspace;
use skyway_engine::flight::Location;
use skyway_engine::routing::Path;

/// Whether a stored answer may be given again: it is still valid and its path is open, or without a path nothing has changed.
pub(crate) fn still_holds(
    record: &AnswerRecord,
    planner: &dyn Planner,
    snapshot: &Snapshot,
    now: Timestamp,
) -> bool {
    let airspace = &snapshot.airspace;
    if now > record.valid_until {
        return false;
    }
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
    let scene = snapshot.scene(now);
    if !planner.still_valid(scene, &record.answer, record.answered_at) {
        return false;
    }
    let way = &record.answer.told().path;
    if way.nodes.is_empty() {
        return record.airspace.revision() == airspace.revision();
    }
    let report = &record.settled.request.report;
    let location = report.location;
    let stretch = Stretch::of_answer(&record.airspace, report, record.answer.told());
    let ahead = stretch.as_ref().map(|stretch| (stretch, stretch.begin()));
    if !progress::closures_on(ahead, airspace).is_empty() {
        return false;
    }
    first_stretch_is_clear(location, way, Some(&record.airspace), snapshot)
}

/// A zone that has come over the drone or its first stretch since makes the way onto the path another one. Where
/// it is unknown which zones there were, all count as come since.
pub(crate) fn first_stretch_is_clear(
    location: Location,
    way: &Path,
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
