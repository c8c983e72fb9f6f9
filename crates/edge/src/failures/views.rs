//! The records behind answers, in the words of the wire.

use super::guard::case_view;
use super::records::AnswerRecord;
use crate::standing::Staleness;
use crate::store::ReportReply;
use crate::views;
use crate::words;
use serde_json::Value;
use skyway_contract as wire;
use skyway_engine::airspace::{Cause, Closure};
use skyway_engine::flight::Location;
use skyway_engine::network::Topology;
use skyway_formats::{IntoTerm, answer, settled_report, zone_to_feature};
use std::borrow::Cow;

/// An answer as it is sent, borrowing what it can.
pub(crate) fn recomposition(
    record: &AnswerRecord,
    replayed: bool,
    standing: Staleness,
) -> wire::Recomposition<'_> {
    let published = &record.published;
    let plan = record.plan.as_ref();
    let topology = record.airspace.topology();
    let told = record.answer.told();
    let flight = record.answer.flight();
    let flown = flight.and_then(|flight| {
        let (version, way) = flight.version.as_ref()?;
        Some((version, way, flight.departs_at))
    });
    let proposed = plan.and_then(|plan| plan.version.as_ref());
    let legs = match (flown, proposed) {
        (Some((version, way, departs_at)), _) => {
            views::legs(topology, way, Some(version), departs_at)
        }
        (None, Some(version)) => {
            views::legs(topology, &version.composition, None, version.departs_at)
        }
        (None, None) => Vec::new(),
    };
    let mut told = answer(&record.airspace, told, &record.read);
    if let Some(flight) = flight.filter(|flight| flight.is_energy_checked) {
        (told.energy, told.assumed) = flight.assumed().told();
    }
    wire::Recomposition {
        id: Cow::Owned(record.id()),
        answer: told,
        remaining_time_s: record.remaining_time_s,
        times: Cow::Borrowed(match flight {
            Some(_) => "computed",
            None => "nominal",
        }),
        airframe: record
            .by_distance
            .then_some(Cow::Borrowed(words::NO_AIRFRAME)),
        publication: wire::Publication {
            state: published.state,
            closure_id: published.closure_id.as_deref().map(Cow::Borrowed),
            proposal_ids: published
                .proposal_ids
                .iter()
                .map(|id| Cow::Borrowed(&**id))
                .collect(),
            reason: published.reason.map(Cow::Borrowed),
        },
        plan: plan.map(|plan| wire::PlanReference {
            id: Cow::Borrowed(&*plan.plan),
            version: plan.version.as_ref().map(|version| version.number),
        }),
        legs,
        flight: flown.and_then(|(version, _, departs_at)| version.told(topology, departs_at)),
        causes: flight.map_or_else(Vec::new, |flight| flight.causes.clone()),
        opens: flight.and_then(|flight| flight.opens.clone()),
        replayed,
        valid_until: Some(words::instant(record.valid_until)),
        stamp: wire::Stamp {
            revision: Cow::Borrowed(&*record.revision),
            topology_revision: record.airspace.topology_revision(),
            registry_revision: standing.registry_revision,
            registry_age_s: standing.registry_age_s,
            freshness: standing.freshness,
            clock: standing.clock,
            network: words::network_name(topology),
        },
    }
}

/// A line of the list of what was answered.
pub(crate) fn summary(record: &AnswerRecord) -> wire::RecordSummary<'static> {
    let topology = record.airspace.topology();
    let report = &record.settled.request.report;
    let (from, to) = report.leg;
    let old_path = report.remaining_path.as_deref();
    wire::RecordSummary {
        id: Cow::Owned(record.id()),
        answered_at: words::instant(record.answered_at),
        failure: report.failure.into_term(),
        drone_id: record.drone_id.as_deref().map(words::text),
        plan_id: record.plan.as_ref().map(|plan| words::text(&plan.plan)),
        leg: Some([from, to].map(|node| words::node_id(topology, node))),
        outcome: record.answer.told().outcome.into_term(),
        path: words::path(topology, &record.answer.told().path),
        old_path: words::node_ids(topology, old_path.unwrap_or(&[from, to])),
        remaining_length_m: record.answer.told().remaining_length_m,
        dry_run: record.dry_run,
        revision: words::text(&record.revision),
    }
}

/// A record as it is sent, with these closures of its world.
pub(crate) fn wire_record<'a>(
    record: &'a AnswerRecord,
    standing: Staleness,
    closures: Vec<wire::RecordedClosure<'a>>,
    certificate: Option<Value>,
) -> wire::Record<'a> {
    let airspace = &record.airspace;
    let topology = airspace.topology();
    wire::Record {
        id: Cow::Owned(record.id()),
        answered_at: words::instant(record.answered_at),
        report: record.report.clone(),
        settled_report: settled_report(&record.settled, topology),
        answer: recomposition(record, false, standing),
        world: wire::RecordedWorld {
            revision: Cow::Borrowed(&*record.revision),
            topology_revision: airspace.topology_revision(),
            network_sha256: Cow::Owned(topology.fingerprint_text().to_owned()),
            as_of: words::instant(airspace.as_of()),
            horizon_s: airspace.horizon().as_secs_f64(),
            closures,
            flight: record.flight_question(),
        },
        certificate,
        checker_case: record.case.as_ref().map(|case| case_view(topology, case)),
    }
}

/// What is to be answered when a report comes again in a later start.
pub(crate) fn report_reply(
    subject: &str,
    id: String,
    record: &AnswerRecord,
    standing: Staleness,
) -> ReportReply {
    let answer = recomposition(record, false, standing);
    ReportReply {
        subject: subject.to_owned(),
        id,
        report: record.report.clone(),
        // A map with text keys and finite numbers always has a JSON form.
        answer: serde_json::to_string(&answer).unwrap_or_default(),
        place: match record.settled.request.report.location {
            Location::At(place) => Some([place.x, place.y]),
            Location::LegStart | Location::Unknown => None,
        },
        network: record.airspace.topology().fingerprint_text().to_owned(),
    }
}

pub(crate) fn recorded_closure(
    topology: &Topology,
    closure: &Closure,
) -> wire::RecordedClosure<'static> {
    let zone = closure.zone();
    let hits = match zone {
        Some(_) => None,
        None => Some(&closure.hits),
    };
    let segments = hits.iter().flat_map(|hits| &hits.segments);
    let nodes = hits.iter().flat_map(|hits| &hits.nodes);
    wire::RecordedClosure {
        id: words::text(&closure.id),
        cause: Cow::Borrowed(match closure.cause {
            Cause::Zone(_) => "zone",
            Cause::Report { .. } => "report",
            Cause::Operator { .. } => "operator",
        }),
        zone: zone.map(|zone| zone_to_feature(zone)),
        segments: segments
            .map(|&segment| Cow::Owned(topology.segment_id(segment).into_owned()))
            .collect(),
        nodes: nodes.map(|&node| words::node_id(topology, node)).collect(),
        pads: words::node_ids(topology, &closure.pads),
    }
}
