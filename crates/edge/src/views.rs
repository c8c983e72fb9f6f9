//! The state of the edge in the words of the wire.

use crate::entries::{
    AlarmEntry, ClosureEntry, PendingReview, ProposalEntry, ProposedBy, ZoneEntry,
};
use crate::planner::{Assumed, DetourEnd, FlownVersion, Version, later};
use crate::plans::entry::PlanEntry;
use crate::plans::fleet::{self, Detour};
use crate::settings::Settings;
use crate::snapshot::Snapshot;
use crate::words::{
    NO_AIRFRAME, instant, node_id, node_ids, outcome_name, path, reference_name, segment_ids, text,
    warning,
};
use jiff::Timestamp;
use serde_json::Value;
use skyway_contract as wire;
use skyway_engine::airspace::{Cause, Closure};
use skyway_engine::compose::{Composition, Contingency};
use skyway_engine::flight::{LegCourse, Reentry};
use skyway_engine::network::Topology;
use skyway_engine::recompose::Outcome;
use skyway_formats::{IntoTerm, waypoint, zone_to_feature};
use skyway_service::intake::Page;
use skyway_service::refusal::Refusal;
use std::borrow::Cow;
use std::sync::Arc;

/// At most this many ids of segments or nodes, or affected plans, in one answer.
pub(super) const IDS_MAX: usize = 1_000;
/// At most this many plans are told in the answer to one write.
pub(super) const PLANS_TOLD_MAX: usize = 100;
/// At most this many causes of one alarm are told.
pub(crate) const CAUSES_MAX: usize = 100;
/// At most this many conflicts of one plan are told.
const CONFLICTS_MAX: usize = 100;

/// The zone as a GeoJSON feature.
pub(super) fn zone_feature(entry: &ZoneEntry) -> Value {
    zone_to_feature(&entry.zone)
}

/// A closure that no zone causes.
pub(super) fn closure(
    snapshot: &Snapshot,
    entry: &ClosureEntry,
    now: Timestamp,
) -> wire::Closure<'static> {
    let topology = snapshot.topology();
    let held = &entry.closure;
    let (cause, reason) = match &held.cause {
        Cause::Zone(zone) => (wire::ClosureCause::Zone, zone.reason().map(text)),
        Cause::Report { .. } => {
            let name = entry.failure.map(|failure| Cow::Borrowed(failure.name()));
            (wire::ClosureCause::Report, name)
        }
        Cause::Operator { reason } => {
            let reason = (!reason.is_empty()).then(|| text(reason));
            (wire::ClosureCause::Operator, reason)
        }
    };
    let told = |count: usize| count.min(IDS_MAX);
    let (segments, nodes) = (&held.hits.segments, &held.hits.nodes);
    wire::Closure {
        id: text(&held.id),
        cause,
        reason,
        reported_by: entry.reported_by.as_deref().map(text),
        confirmed: entry.confirmed,
        from: entry.from.map(instant),
        until: entry.until.map(instant),
        in_force: snapshot.airspace.is_active(held, now),
        closes_from: snapshot.airspace.closes_from(held, now).map(instant),
        segment_count: segments.len(),
        segments: segment_ids(topology, &segments[..told(segments.len())]),
        node_count: nodes.len(),
        nodes: node_ids(topology, &nodes[..told(nodes.len())]),
        pads: node_ids(topology, &held.pads),
        etag: Cow::Owned(snapshot.etag(entry.version)),
        effect: None,
    }
}

/// The closure that a zone causes.
pub(super) fn closure_of_zone(
    snapshot: &Snapshot,
    entry: &ZoneEntry,
    held: &Arc<Closure>,
    now: Timestamp,
) -> wire::Closure<'static> {
    let windows = entry.zone.windows();
    let only = match windows {
        [window] => Some(window),
        _ => None,
    };
    let as_closure = ClosureEntry {
        closure: held.clone(),
        version: entry.version,
        failure: None,
        reported_by: None,
        by: None,
        confirmed: true,
        from: only.and_then(skyway_engine::airspace::Window::from),
        until: only.and_then(skyway_engine::airspace::Window::until),
        upstream: None,
    };
    closure(snapshot, &as_closure, now)
}

pub(super) fn proposal_id(epoch: u64, number: u64) -> String {
    format!("proposal-{epoch}-{number}")
}

pub(super) fn hold_id(epoch: u64, number: u64) -> String {
    format!("hold-{epoch}-{number}")
}

/// The number in an id of a proposal or a hold of this start.
pub(super) fn number_in(id: &str, kind: &str, epoch: u64) -> Option<u64> {
    let rest = id.strip_prefix(kind)?.strip_prefix('-')?;
    let (stated, number) = rest.split_once('-')?;
    (stated.parse() == Ok(epoch))
        .then(|| number.parse().ok())
        .flatten()
}

/// The number of the entry after which a page begins, of a list of one kind.
pub(super) fn number_after(page: &Page, kind: &str, epoch: u64) -> Result<Option<u64>, Refusal> {
    page.after_as(|key| number_in(key, kind, epoch))
}

pub(super) fn proposal(snapshot: &Snapshot, entry: &ProposalEntry) -> wire::Proposal<'static> {
    let topology = snapshot.topology();
    let zone = entry.closure.zone();
    let segments = match zone {
        Some(_) => Vec::new(),
        None => segment_ids(topology, &entry.closure.hits.segments),
    };
    let (recomposition_id, drone_id, faults) = match &entry.by {
        ProposedBy::Report {
            recomposition_id,
            drone_id,
            ..
        } => {
            let drone_id = drone_id.as_deref().map(text);
            (Some(text(recomposition_id)), drone_id, Vec::new())
        }
        ProposedBy::Feed { faults } => (None, None, faults.to_vec()),
    };
    wire::Proposal {
        id: Cow::Owned(proposal_id(snapshot.lineage, entry.number)),
        subject: match zone {
            Some(_) => wire::ProposalSubject::Zone,
            None => wire::ProposalSubject::Closure,
        },
        reason: entry.reason.clone(),
        proposed_at: instant(entry.proposed_at),
        expires_at: instant(entry.expires_at),
        recomposition_id,
        drone_id,
        faults,
        zone: zone.map(|zone| zone_to_feature(zone)),
        segments,
        pads: node_ids(topology, &entry.closure.pads),
    }
}

pub(super) fn hold(snapshot: &Snapshot, entry: &PendingReview) -> wire::Hold<'static> {
    let told = entry.lifts.len().min(IDS_MAX);
    let contested = entry.contested.as_deref();
    let lifted = entry.lifts[..told].iter().map(|id| text(id));
    wire::Hold {
        id: Cow::Owned(hold_id(snapshot.lineage, entry.number)),
        origin: text(&entry.origin),
        reason: Cow::Borrowed(match contested {
            None => "mass_removal",
            Some(contested) if contested.is_refused => "refused_there",
            Some(_) => "changed_elsewhere",
        }),
        held_at: instant(entry.held_at),
        closure_count: entry.lifts.len() + usize::from(contested.is_some()),
        closures: lifted
            .chain(contested.map(|contested| text(&contested.id)))
            .collect(),
        ours: contested
            .and_then(|contested| contested.body.as_deref())
            .and_then(|body| serde_json::from_str(body).ok()),
        kept_as: contested
            .and_then(|contested| contested.aside.as_deref())
            .map(text),
    }
}

fn contingency(
    topology: &Topology,
    contingency: &Contingency,
    flight: Option<wire::DetourFlight<'static>>,
) -> wire::Contingency<'static> {
    wire::Contingency {
        outcome: contingency.outcome.into_term(),
        nodes: node_ids(topology, &contingency.nodes),
        rejoins: contingency.rejoins.map(|node| node_id(topology, node)),
        remaining_length_m: contingency.remaining_length_m,
        extra_m: contingency.extra_m,
        flight,
    }
}

/// A course by its corners.
fn geometry(topology: &Topology, course: &LegCourse) -> Vec<wire::Waypoint> {
    let corners = course.corners.iter();
    let waypoints = corners.map(|corner| waypoint(topology, corner.place, corner.height_m));
    waypoints.collect()
}

/// The legs of a composition that departs at an instant, with how they are flown where that was computed.
pub(super) fn legs(
    topology: &Topology,
    composition: &Composition,
    flown: Option<&FlownVersion>,
    departs_at: Timestamp,
) -> Vec<wire::Leg<'static>> {
    let legs = composition.legs.iter().enumerate().map(|(number, leg)| {
        let ends = flown.and_then(|flown| flown.ends.get(number)).cloned();
        let ends = ends.unwrap_or_default();
        let told = |end: Option<DetourEnd>| end.map(|end| end.told(departs_at));
        let course = LegCourse::of(topology, leg.from, leg.to, leg.segment);
        let time_s = leg.arrival_s - leg.departure_s;
        wire::Leg {
            from: node_id(topology, leg.from),
            to: node_id(topology, leg.to),
            segment: Cow::Owned(topology.segment_id(leg.segment).into_owned()),
            length_m: leg.length_m,
            length_air_m: course.length_air_m,
            geometry: geometry(topology, &course),
            height_reference: course.reference.map(reference_name),
            speed_mps: match time_s > 0.0 {
                true => leg.length_m / time_s,
                false => 0.0,
            },
            speed_limit_mps: topology.speed_limit_mps(leg.segment),
            climb_m: course.climb_m,
            departs_at: instant(later(departs_at, leg.departure_s)),
            arrives_at: instant(later(departs_at, leg.arrival_s)),
            if_closed: leg
                .if_closed
                .as_ref()
                .map(|detour| contingency(topology, detour, told(ends.if_closed))),
            alternate: leg.safe.as_ref().map(|safe| wire::Alternate {
                node: node_id(topology, safe.node),
                nodes: node_ids(topology, &safe.nodes),
                length_m: safe.length_m,
                flight: told(ends.safe),
            }),
            flight: flown.and_then(|flown| flown.leg(topology, number)),
        }
    });
    legs.collect()
}

fn first_stretch(topology: &Topology, reentry: &Reentry) -> wire::FirstStretch<'static> {
    let told = skyway_formats::first_stretch(topology, reentry);
    wire::FirstStretch {
        kind: told.kind,
        from: told.from.map(wire::Id::into_owned),
        to: told.to.map(wire::Id::into_owned),
        segment: told.segment.map(|id| Cow::Owned(id.into_owned())),
        fraction: told.fraction,
        enters: told.enters.into_owned(),
        length_m: told.length_m,
        overrun_m: told.overrun_m,
        geometry: told.geometry,
    }
}

/// How the drone of a version comes to its first node; of one without legs also that it is there, as nothing else says where.
fn beginning(topology: &Topology, version: &Version) -> Option<wire::FirstStretch<'static>> {
    if let Some(stretch) = &version.stretch {
        return Some(first_stretch(topology, &stretch.reentry));
    }
    let stays = version.composition.legs.is_empty();
    let node = version.last_node().filter(|_| stays)?;
    let there = Reentry::at_node(node, topology.position(node), None);
    Some(first_stretch(topology, &there))
}

/// A version of a plan.
pub(super) fn version(topology: &Topology, version: &Version) -> wire::PlanVersion<'static> {
    let composition = &version.composition;
    let flown = version.flight.as_deref();
    let warnings = version.warnings.iter();
    wire::PlanVersion {
        version: version.number,
        epoch: version.epoch,
        // No edge takes a plan over yet.
        token: 0,
        sent_at: instant(version.sent_at),
        outcome: Cow::Borrowed(outcome_name(version.outcome)),
        first_stretch: beginning(topology, version),
        path: path(topology, &composition.way),
        length_m: composition.length_m,
        flight_time_s: composition.flight_time_s,
        departs_at: instant(version.departs_at),
        arrives_at: instant(version.arrives_at()),
        legs: legs(topology, composition, flown, version.departs_at),
        recomposition_id: version.recomposition_id.as_deref().map(text),
        acknowledge_by: version.acknowledge_by.map(instant),
        flight: flown.and_then(|flown| flown.told(topology, version.departs_at)),
        flags: version.flags.clone(),
        warnings: warnings
            .map(|(code, message)| warning(code.clone(), message))
            .collect(),
    }
}

/// Other plans that come too near to any version of one.
fn conflicts(
    snapshot: &Snapshot,
    entry: &PlanEntry,
    settings: &Settings,
) -> Vec<wire::Conflict<'static>> {
    let topology = snapshot.topology();
    let found = match entry.is_active() {
        true => fleet::conflicts_of(snapshot, entry, settings.headway_s, CONFLICTS_MAX),
        false => Vec::new(),
    };
    let told = found.into_iter().map(|met| wire::Conflict {
        plan_id: text(&met.plan),
        segment: Cow::Owned(topology.segment_id(met.conflict.segment).into_owned()),
        leg: u32::try_from(met.conflict.leg).unwrap_or(u32::MAX),
        direction: Cow::Borrowed(met.conflict.direction.name()),
        gap_s: met.conflict.gap_s,
    });
    told.collect()
}

/// A plan.
pub(super) fn plan(
    snapshot: &Snapshot,
    entry: &PlanEntry,
    settings: &Settings,
    stamp: wire::Stamp<'static>,
) -> wire::Plan<'static> {
    let topology = snapshot.topology();
    let conflicts = conflicts(snapshot, entry, settings);
    let order = entry.order.as_ref();
    let flights: Vec<_> = entry.versions().map(|one| one.flight.as_deref()).collect();
    let is_flown = flights.iter().all(Option::is_some);
    let checked: Option<Vec<_>> = flights
        .iter()
        .map(|flight| flight.filter(|flight| flight.is_energy_checked))
        .collect();
    let assumed =
        checked.and_then(|all| all.iter().map(|flight| flight.assumed).reduce(Assumed::or));
    let unchecked = || (Cow::Borrowed("unchecked"), Vec::new());
    let (energy, assumed) = assumed.map_or_else(unchecked, Assumed::told);
    let by_distance = settings.flight.is_none().then_some(NO_AIRFRAME);
    let versions = entry.versions().map(|version| wire::SentVersion {
        version: version.number,
        sent_at: instant(version.sent_at),
        outcome: Cow::Borrowed(outcome_name(version.outcome)),
    });
    let stops = entry.reported.stops.iter().map(|stop| wire::ServiceStop {
        node: node_id(topology, stop.node),
        service_s: stop.service_s,
    });
    let affecting = snapshot.affecting(entry);
    let affecting = affecting.chain(snapshot.shut(entry));
    wire::Plan {
        id: text(&entry.id),
        state: entry.state,
        ended_as: entry.ended_as,
        flags: flags(snapshot, entry),
        drone_id: entry.drone_id.as_deref().map(text),
        source: node_id(topology, entry.source),
        destination: node_id(topology, entry.destination),
        stops: stops.collect(),
        payload_kg: entry.payload_kg,
        airspeed_mps: entry.airspeed_mps,
        airframe: order
            .map(|order| text(&order.airframe))
            .or(by_distance.map(Cow::Borrowed)),
        objective: order.map(|order| Cow::Borrowed(order.objective.name())),
        deadline: order.and_then(|order| order.deadline).map(instant),
        priority: entry.priority.into(),
        delivery_id: entry.flown_for.as_ref().map(|it| text(&it.delivery)),
        expires_at: entry.expires_at.map(instant),
        reported: version(topology, &entry.reported),
        wanted: entry
            .wanted
            .as_deref()
            .map(|wanted| version(topology, wanted)),
        versions: match entry.is_active() {
            true => versions.collect(),
            false => Vec::new(),
        },
        affected_by: affecting.map(text).collect(),
        conflicts,
        energy,
        assumed,
        times: Cow::Borrowed(if is_flown { "computed" } else { "nominal" }),
        stamp,
    }
}

fn flags(snapshot: &Snapshot, entry: &PlanEntry) -> Vec<wire::PlanFlag> {
    let flags = [
        (snapshot.is_affected(entry), wire::PlanFlag::Affected),
        (entry.flags.overdue, wire::PlanFlag::Overdue),
        (entry.flags.unacknowledged, wire::PlanFlag::Unacknowledged),
        (entry.flags.silent, wire::PlanFlag::Silent),
    ];
    let holding = flags.into_iter().filter(|(holds, _)| *holds);
    holding.map(|(_, flag)| flag).collect()
}

/// A plan in an event: what it flies and is to fly, without legs.
pub(super) fn plan_summary(snapshot: &Snapshot, entry: &PlanEntry) -> Value {
    let topology = snapshot.topology();
    let brief = |version: &Version| {
        serde_json::json!({
            "version": version.number,
            "outcome": outcome_name(version.outcome),
            "nodes": node_ids(topology, &version.composition.way.nodes),
            "length_m": version.composition.length_m,
            "departs_at": version.departs_at.to_string(),
            "arrives_at": version.arrives_at().to_string(),
        })
    };
    let mut summary = serde_json::json!({
        "id": &*entry.id,
        "state": entry.state,
        "drone_id": entry.drone_id.as_deref(),
        "reported": brief(&entry.reported),
        "wanted": entry.wanted.as_deref().map(brief),
        "affected_by": snapshot.affecting(entry).collect::<Vec<_>>(),
        "flags": flags(snapshot, entry),
    });
    if let Some(ended_as) = entry.ended_as {
        summary["ended_as"] = serde_json::json!(ended_as);
    }
    summary
}

/// What a plan's drone is told under a zone or closure.
pub(super) fn affected_plan(topology: &Topology, detour: &Detour) -> wire::AffectedPlan<'static> {
    wire::AffectedPlan {
        plan_id: text(&detour.plan.id),
        drone_id: detour.plan.drone_id.as_deref().map(text),
        outcome: match (detour.outcome(), detour.version) {
            (Outcome::Unaffected, Some(_)) => wire::Outcome::Rerouted,
            (told, _) => told.into_term(),
        },
        path: path(topology, detour.way()),
        extra_m: detour.extra_m,
        version: detour.version,
    }
}

/// The id of an alarm.
pub(super) fn alarm_id(lineage: u64, number: u64) -> String {
    format!("alarm-{lineage}-{number}")
}

/// An alarm in the words of the wire.
pub(super) fn alarm_view(lineage: u64, entry: &AlarmEntry) -> wire::Alarm<'static> {
    let draft = &entry.draft;
    let acknowledged = entry.acknowledged.as_ref();
    let causes = draft.causes.iter().take(CAUSES_MAX);
    wire::Alarm {
        id: Cow::Owned(alarm_id(lineage, entry.number)),
        kind: draft.kind,
        at: instant(entry.raised_at),
        renewed_at: instant(entry.renewed_at),
        count: entry.count,
        plan_id: draft.plan.as_deref().map(text),
        drone_id: draft.drone.as_deref().map(text),
        recomposition_id: draft.recomposition.as_deref().map(text),
        causes: causes.map(|id| text(id)).collect(),
        message: text(&draft.message),
        acknowledged_at: acknowledged.map(|(at, _)| instant(*at)),
        acknowledged_by: acknowledged.map(|(_, by)| text(by)),
        ended_at: entry.ended_at.map(instant),
    }
}
