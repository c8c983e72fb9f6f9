//! A recomposition in the words of the wire: the names every answer uses, on the command line and from the daemon.

use crate::airspace::Airspace;
use crate::area::area_geometry;
use crate::identifier::node_id;
use crate::network::{NodeIx, Topology};
use crate::recompose::{Recomposition, Repair, Severance, StageRecord, Warning};
use crate::report::problem::ReadWarning;
use crate::routing::Path;
use crate::safety::{first_stretch, flags, if_airborne, near, unsafe_way};
use crate::wire;
use crate::wire_terms::IntoTerm;
use std::borrow::Cow;

/// An answer as it is written, borrowing its ids and texts.
///
/// `read` are the warnings that reading the report gave; they come first in `warnings`.
pub fn answer<'a>(
    airspace: &'a Airspace,
    answer: &'a Recomposition,
    read: &'a [ReadWarning],
) -> wire::Answer<'a> {
    let topology: &Topology = airspace.topology();
    let repairs = answer.repairs.iter();
    let stages = answer.stages.iter();
    let fallback = answer.fallback.as_ref();
    wire::Answer {
        outcome: answer.outcome.into_term(),
        path: path(topology, &answer.path),
        first_stretch_m: answer.first_stretch_m,
        first_stretch: answer
            .reentry
            .as_ref()
            .map(|reentry| first_stretch(topology, reentry)),
        flags: flags(&answer.flags),
        unsafe_way: answer
            .unsafe_way
            .as_ref()
            .map(|way| unsafe_way(topology, way)),
        near: answer.near.iter().map(|one| near(topology, one)).collect(),
        if_airborne: if_airborne(topology, answer),
        recomposed_length_m: answer.recomposed_length_m,
        remaining_length_m: answer.remaining_length_m,
        strategy: answer.strategy.into_term(),
        strategy_used: answer.strategy_used.into_term(),
        fallback_reason: fallback.map(|reason| Cow::Owned(reason.to_string())),
        stage: answer.stage.into_term(),
        searches: answer.searches,
        area_nodes: answer.area_nodes,
        area_segments: answer.area_segments,
        settled_nodes: answer.settled_nodes,
        local_optimum_m: answer.local_optimum_m,
        global_optimum_m: answer.global_optimum_m,
        remaining_optimum_m: answer.remaining_optimum_m,
        repairs: repairs.map(|one| repair(topology, one)).collect(),
        severed_by: answer.severed_by.iter().map(severance).collect(),
        stages: stages.map(|one| stage(topology, one)).collect(),
        warnings: warnings(topology, &answer.warnings, read),
        energy: Cow::Borrowed("unchecked"),
        assumed: Vec::new(),
    }
}

pub(super) fn path<'a>(topology: &'a Topology, way: &Path) -> wire::Path<'a> {
    let segments = way.segments.iter();
    wire::Path {
        nodes: ids(topology, &way.nodes),
        segments: segments
            .map(|&segment| topology.segment_id(segment))
            .collect(),
    }
}

fn ids<'a>(topology: &'a Topology, nodes: &[NodeIx]) -> Vec<wire::Id<'a>> {
    nodes.iter().map(|&node| node_id(topology, node)).collect()
}

fn repair<'a>(topology: &'a Topology, repair: &Repair) -> wire::Repair<'a> {
    wire::Repair {
        from: node_id(topology, repair.from),
        to: node_id(topology, repair.to),
        recomposed_length_m: repair.length_m,
        stage: repair.stage.into_term(),
        searches: repair.searches,
        area_nodes: repair.area_nodes,
        area_segments: repair.area_segments,
        settled_nodes: repair.settled_nodes,
    }
}

fn severance(severance: &Severance) -> wire::Severance<'_> {
    match severance {
        Severance::Report => wire::Severance::Report,
        Severance::Closure(id) => wire::Severance::Closure {
            id: Cow::Borrowed(id),
        },
        Severance::Network => wire::Severance::Network,
    }
}

fn stage<'a>(topology: &'a Topology, stage: &StageRecord) -> wire::AreaStage<'a> {
    wire::AreaStage {
        stage: stage.stage.into_term(),
        skipped: stage.skipped,
        nodes: ids(topology, &stage.nodes),
        area: area_geometry(topology, &stage.shape),
        searched: stage.searched,
        path_found: stage.path_found,
    }
}

fn warnings<'a>(
    topology: &Topology,
    own: &[Warning],
    read: &'a [ReadWarning],
) -> Vec<wire::Warning<'a>> {
    let read = read.iter().map(|warning| wire::Warning {
        code: Cow::Borrowed(warning.code),
        message: Cow::Borrowed(&warning.message),
    });
    let own = own.iter().map(|warning| {
        let (code, message) = warning_text(topology, warning);
        wire::Warning {
            code: Cow::Borrowed(code),
            message: Cow::Owned(message),
        }
    });
    read.chain(own).collect()
}

/// A warning's stable code and its text for people.
pub fn warning_text(topology: &Topology, warning: &Warning) -> (&'static str, String) {
    match warning {
        Warning::StartClosed { node } => (
            "start_closed",
            format!("node '{}', where the path begins, is closed; it can only be left", topology.node_id(*node)),
        ),
        Warning::InsideZone => (
            "inside_zone",
            "the drone is inside an active zone and has to leave it".to_owned(),
        ),
        Warning::BetweenCauses => (
            "between_causes",
            "something lies before and behind the drone".to_owned(),
        ),
        Warning::Unverified { off_leg_m } => (
            "unverified",
            match *off_leg_m > 0.0 {
                true => format!("the drone is {off_leg_m:.0} m off its leg; buildings on the straight line to the first node are unknown"),
                false => "both ways along the leg are blocked; buildings on the straight line to the first node are unknown".to_owned(),
            },
        ),
        Warning::Unsafe { off_leg_m } => (
            "unsafe",
            format!("the drone is {off_leg_m:.0} m off its leg and every straight line to a near node crosses an active zone"),
        ),
        Warning::UnknownSegment => (
            "unknown_segment",
            "the network has no segment between the ends of the leg".to_owned(),
        ),
        Warning::Loop { node } => (
            "loop",
            format!("the path comes to node '{}' twice: the strategy keeps the old plan between repairs", topology.node_id(*node)),
        ),
        Warning::HoldsUntil { node, until } => (
            "holds_until",
            format!("node '{}' lies in a zone until {until}; a drone on the ground waits there",
                topology.node_id(*node)
            ),
        ),
        Warning::HoldsWithoutEnd { node } => (
            "holds_without_end",
            format!(
                "node '{}' lies in a zone whose end is unknown; a drone on the ground waits there",
                topology.node_id(*node)
            ),
        ),
        Warning::EndsAtStop { node } => (
            "ends_at_stop",
            format!("no plan leads on from stop '{}' yet; the drone is told more once it stands there", topology.node_id(*node)),
        ),
        Warning::NoAlternate => (
            "no_alternate",
            "no open node with a recharging pad can be reached".to_owned(),
        ),
        Warning::PadAssumedFree { node } => (
            "pad_assumed_free",
            format!("a pad at node '{}' counts as free: without the flight model reservations are not looked at", topology.node_id(*node)),
        ),
    }
}
