//! An answer in the terms that those without a flight have, too.

use super::Ground;
use skyway_engine::delivery::{FlightRecomposition, severance};
use skyway_engine::recompose::{Recomposition, Severance};
use skyway_engine::routing::Path;

/// An answer in the terms that those without a flight have, too.
pub(super) fn without_flight(ground: &Ground, told: &FlightRecomposition) -> Recomposition {
    let airborne = told.if_airborne.as_deref();
    let airborne = airborne.map(|airborne| Box::new(without_flight(ground, airborne)));
    let topology = ground.skies.topology();
    let plan = told.composition.as_ref();
    let path = plan.map(|plan| Path {
        nodes: plan.nodes(),
        segments: plan.plan.legs.iter().map(|leg| leg.segment).collect(),
    });
    let remaining_length_m = plan.map(|plan| plan.plan.distance_m);
    let causes = told.causes.iter();
    let severed_by = causes.filter_map(|cause| severance(&ground.skies, cause));
    let mut severed_by: Vec<Severance> = severed_by.collect();
    severed_by.sort();
    severed_by.dedup();
    Recomposition {
        outcome: told.outcome,
        path: path.unwrap_or_default(),
        recomposed_length_m: remaining_length_m.map(|length_m| length_m - told.first_stretch_m),
        remaining_length_m,
        first_stretch_m: told.first_stretch_m,
        reentry: plan.and_then(|plan| plan.plan.start.reentry()),
        flags: told.flags.clone(),
        unsafe_way: told.unsafe_way.clone(),
        near: told.near.clone(),
        if_airborne: airborne,
        strategy: told.strategy,
        strategy_used: told.strategy_used,
        fallback: told.fallback.clone(),
        stage: told.stage,
        searches: 1,
        area_nodes: topology.node_count(),
        area_segments: topology.segment_count(),
        settled_nodes: told.proof.effort.labels,
        local_optimum_m: None,
        global_optimum_m: None,
        remaining_optimum_m: None,
        repairs: Vec::new(),
        warnings: told.warnings.clone(),
        severed_by,
        stages: Vec::new(),
    }
}
