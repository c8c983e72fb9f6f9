//! A plan by distance as JSON.

use crate::compose::{Composition, Leg};
use crate::identifier::{node_id_json, segment_id_json};
use crate::network::{NodeIx, Topology};
use serde_json::{Value, json};

/// The shortest open way between two nodes with its contingencies, as `skyway compose --json` writes it, or that there is none.
///
/// Times are nominal, in seconds from the departure at the airspeed, and energy is unchecked.
pub fn composition_json(
    topology: &Topology,
    (source, destination): (NodeIx, NodeIx),
    airspeed_mps: f64,
    plan: Option<&Composition>,
) -> Value {
    let id = |node| node_id_json(topology, node);
    let Some(plan) = plan else {
        return json!({"outcome": "no_route", "source": id(source), "destination": id(destination)});
    };
    let segments = plan.way.segments.iter();
    let segments: Vec<Value> = segments
        .map(|&segment| segment_id_json(topology, segment))
        .collect();
    let legs: Vec<Value> = plan
        .legs
        .iter()
        .map(|leg| leg_json(topology, leg))
        .collect();
    json!({
        "outcome": "composed",
        "source": id(source),
        "destination": id(destination),
        "path": {"nodes": ids(topology, &plan.way.nodes), "segments": segments},
        "length_m": plan.length_m,
        "flight_time_s": plan.flight_time_s,
        "airspeed_mps": airspeed_mps,
        "times": "nominal",
        "energy": "unchecked",
        "legs": legs,
    })
}

fn leg_json(topology: &Topology, leg: &Leg) -> Value {
    let id = |node| node_id_json(topology, node);
    let detour = leg.if_closed.as_ref().map(|detour| {
        json!({
            "outcome": detour.outcome,
            "nodes": ids(topology, &detour.nodes),
            "rejoins": detour.rejoins.map(id),
            "remaining_length_m": detour.remaining_length_m,
            "extra_m": detour.extra_m,
        })
    });
    let safe = leg.safe.as_ref().map(|safe| {
        json!({
            "node": id(safe.node),
            "nodes": ids(topology, &safe.nodes),
            "length_m": safe.length_m,
        })
    });
    json!({
        "from": id(leg.from),
        "to": id(leg.to),
        "segment": segment_id_json(topology, leg.segment),
        "length_m": leg.length_m,
        "departure_s": leg.departure_s,
        "arrival_s": leg.arrival_s,
        "if_closed": detour,
        "alternate": safe,
    })
}

fn ids(topology: &Topology, nodes: &[NodeIx]) -> Vec<Value> {
    let nodes = nodes.iter();
    nodes.map(|&node| node_id_json(topology, node)).collect()
}
