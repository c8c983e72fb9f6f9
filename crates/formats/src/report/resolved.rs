//! A settled report written out: all that was looked up or assumed, in the words of the wire.

use super::known::CloseTarget;
use super::place::Written;
use super::resolve::ResolvedReport;
use crate::flight::{Aloft, DEFAULT_AIRSPEED_MPS};
use crate::identifier::node_id;
use crate::network::{NodeIx, Topology};
use crate::recompose::Parameters;
use crate::wire::{self, DroneFacts, FailureReport, Place, Service};
use crate::wire_terms::IntoTerm;
use crate::zones::zone_to_feature;
use serde_json::{Value, json};

/// The report with everything that was looked up or assumed put in.
///
/// By itself, with nothing known beside it, on the same airspace it settles to the same request, to the
/// last bit. Who reported what when is not in it, for that does not change the answer.
pub fn settled_report(settled: &ResolvedReport, topology: &Topology) -> FailureReport {
    let request = &settled.request;
    let report = &request.report;
    let circumstances = &request.circumstances;
    let is_of_speed = circumstances.speed_mps != DEFAULT_AIRSPEED_MPS;
    let id = |node: NodeIx| node_id(topology, node).into_owned();
    let place = |written: Written| match written {
        Written::Coordinates(pair) => Place::Pair(pair),
        Written::Node(node) => Place::Node(id(node)),
    };
    let ids = |nodes: &Vec<NodeIx>| nodes.iter().map(|&node| id(node)).collect();
    let close = settled.close.iter();
    let close: Vec<Value> = close.map(|&target| close_entry(topology, target)).collect();
    FailureReport {
        failure: Some(report.failure.into_term()),
        detail: circumstances.detail.map(IntoTerm::into_term),
        node: circumstances.failed_pads.map(|pads| id(pads.node)),
        pads: circumstances
            .failed_pads
            .and_then(|pads| pads.count)
            .map(u32::from),
        airborne: match circumstances.aloft {
            Aloft::Airborne => Some(true),
            Aloft::Grounded => Some(false),
            Aloft::Unknown => None,
        },
        location_age_s: (circumstances.place_age_s > 0.0).then_some(circumstances.place_age_s),
        drone: is_of_speed.then(|| DroneFacts {
            airspeed_mps: Some(circumstances.speed_mps),
            ..DroneFacts::default()
        }),
        service: Some(Service {
            from: Some(id(report.leg.0)),
            to: Some(id(report.leg.1)),
            ..Service::default()
        }),
        location: settled.location.map(place),
        location_unknown: settled.location.is_none().then_some(true),
        cause_location: settled.cause_location.map(place),
        zone: request
            .zone
            .as_ref()
            .map(|brought| zone_to_feature(&brought.zone)),
        remaining_path: report.remaining_path.as_ref().map(ids),
        destination: Some(id(report.destination)),
        strategy: Some(request.strategy.into_term()),
        scope: Some(request.scope.into_term()),
        parameters: parameters(&request.parameters),
        optimum: request.optimum.then_some(true),
        explain: request.explain.then_some(true),
        close: (!close.is_empty()).then_some(close),
        ..FailureReport::default()
    }
}

/// The parameters, where any is not at its default.
fn parameters(parameters: &Parameters) -> Option<wire::Parameters> {
    (*parameters != Parameters::default()).then_some(wire::Parameters {
        cell_size_m: parameters.cell_size_m,
        val_ratio: Some(parameters.val_ratio),
        stage_skipping: Some(parameters.stage_skipping),
        full_tree: Some(parameters.full_tree),
    })
}

fn close_entry(topology: &Topology, target: CloseTarget) -> Value {
    match target {
        CloseTarget::Node(node) => json!(node_id(topology, node)),
        CloseTarget::Segment(segment) => {
            let ends = topology.segment(segment);
            json!([node_id(topology, ends.from), node_id(topology, ends.to)])
        }
    }
}
