//! A recomposition as JSON: the names every answer uses, on the command line and on the wire.

use super::area::area_geometry;
use super::identifier::{node_id_json, segment_id_json};
use super::report_problem::ReadWarning;
use crate::airspace::Airspace;
use crate::network::Topology;
use crate::recompose::{Recomposition, Repair, Severance, StageRecord, Warning};
use crate::routing::Way;
use serde_json::{Map, Value, json};

/// An answer as JSON, without what only the caller knows (`id`, `elapsed_us`).
///
/// `read` are the warnings that reading the report gave; they come first in `warnings`.
pub fn answer_json(
    airspace: &Airspace,
    answer: &Recomposition,
    read: &[ReadWarning],
) -> Map<String, Value> {
    let topology = airspace.topology();
    let read = read
        .iter()
        .map(|warning| warning_entry(warning.code, warning.message.clone()));
    let own = answer
        .warnings
        .iter()
        .map(|warning| warning_json(topology, warning));
    let mut fields = Map::new();
    let mut put = |name: &str, value: Value| fields.insert(name.to_owned(), value);
    put("outcome", json!(answer.outcome));
    put("path", path_json(topology, &answer.path));
    put("first_stretch_m", json!(answer.first_stretch_m));
    put("recomposed_length_m", json!(answer.recomposed_length_m));
    put("remaining_length_m", json!(answer.remaining_length_m));
    put("strategy", json!(answer.strategy));
    put("strategy_used", json!(answer.strategy_used));
    if let Some(fallback) = &answer.fallback {
        put("fallback_reason", json!(fallback.to_string()));
    }
    put("stage", json!(answer.stage));
    put("searches", json!(answer.searches));
    put("area_nodes", json!(answer.area_nodes));
    put("area_segments", json!(answer.area_segments));
    put("settled_nodes", json!(answer.settled_nodes));
    let optima = [
        ("local_optimum_m", answer.local_optimum_m),
        ("global_optimum_m", answer.global_optimum_m),
        ("remaining_optimum_m", answer.remaining_optimum_m),
    ];
    for (name, optimum_m) in optima {
        if let Some(optimum_m) = optimum_m {
            put(name, json!(optimum_m));
        }
    }
    if !answer.repairs.is_empty() {
        let repairs = answer
            .repairs
            .iter()
            .map(|repair| repair_json(topology, repair));
        put("repairs", repairs.collect());
    }
    if !answer.severed_by.is_empty() {
        put(
            "severed_by",
            answer.severed_by.iter().map(severance_json).collect(),
        );
    }
    if !answer.stages.is_empty() {
        let stages = answer
            .stages
            .iter()
            .map(|stage| stage_json(topology, stage));
        put("stages", stages.collect());
    }
    put("warnings", read.chain(own).collect());
    put("energy", json!("unchecked"));
    put("topology_revision", json!(airspace.topology_revision()));
    put("revision", json!(airspace.revision()));
    fields
}

fn path_json(topology: &Topology, way: &Way) -> Value {
    let nodes: Vec<Value> = way
        .nodes
        .iter()
        .map(|&node| node_id_json(topology, node))
        .collect();
    let segments: Vec<Value> = way
        .segments
        .iter()
        .map(|&segment| segment_id_json(topology, segment))
        .collect();
    json!({"nodes": nodes, "segments": segments})
}

fn repair_json(topology: &Topology, repair: &Repair) -> Value {
    json!({
        "from": node_id_json(topology, repair.from),
        "to": node_id_json(topology, repair.to),
        "recomposed_length_m": repair.length_m,
        "stage": repair.stage,
        "searches": repair.searches,
        "area_nodes": repair.area_nodes,
        "area_segments": repair.area_segments,
        "settled_nodes": repair.settled_nodes,
    })
}

fn severance_json(severance: &Severance) -> Value {
    match severance {
        Severance::Report => json!({"cause": "report"}),
        Severance::Closure(id) => json!({"cause": "closure", "id": id}),
        Severance::Network => json!({"cause": "network"}),
    }
}

fn stage_json(topology: &Topology, stage: &StageRecord) -> Value {
    let nodes: Vec<Value> = stage
        .nodes
        .iter()
        .map(|&node| node_id_json(topology, node))
        .collect();
    json!({
        "stage": stage.stage,
        "skipped": stage.skipped,
        "nodes": nodes,
        "area": area_geometry(topology, &stage.shape),
        "searched": stage.searched,
        "path_found": stage.path_found,
    })
}

fn warning_entry(code: &str, message: String) -> Value {
    json!({"code": code, "message": message})
}

fn warning_json(topology: &Topology, warning: &Warning) -> Value {
    let (code, message) = warning_text(topology, warning);
    warning_entry(code, message)
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
            "the drone is inside an active zone and leaves it along its leg".to_owned(),
        ),
        Warning::BetweenCauses => (
            "between_causes",
            "something lies before and behind the drone; the path leads back to the start of the leg".to_owned(),
        ),
        Warning::Unverified { off_leg_m } => (
            "unverified",
            format!("the drone is {off_leg_m:.0} m off its leg; buildings on the straight line to the first node are unknown"),
        ),
        Warning::Unsafe { off_leg_m } => (
            "unsafe",
            format!("the drone is {off_leg_m:.0} m off its leg and the straight line to the first node crosses an active zone"),
        ),
        Warning::UnknownSegment => (
            "unknown_segment",
            "the network has no segment between the ends of the leg".to_owned(),
        ),
        Warning::Loop { node } => (
            "loop",
            format!("the path comes to node '{}' twice: the strategy keeps the old plan between repairs", topology.node_id(*node)),
        ),
        Warning::NoSafeNode => (
            "no_safe_node",
            "no open node with a recharging pad can be reached".to_owned(),
        ),
        Warning::PadAssumedFree { node } => (
            "pad_assumed_free",
            format!("a pad at node '{}' counts as free: there are no reservations yet", topology.node_id(*node)),
        ),
    }
}
