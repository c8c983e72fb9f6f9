//! Plans by distance, and certificates judged.

use crate::document::to_python;
use crate::refusal::{Kind, Refusal, without_lock};
use crate::world::World;
use pyo3::prelude::*;
use serde_json::{Value, json};
use skyway_engine::airspace::Airspace;
use skyway_engine::compose::{self, Composition, Leg};
use skyway_engine::network::{NodeIx, Topology};
use skyway_engine::verify::{self, FlightPremises, NetworkFacts, verify_flight};
use skyway_formats::{is_flight_document, node_id_json, read_flight_document, segment_id_json};
use std::sync::Arc;

/// A plan by distance.
#[pyclass(frozen, module = "skyway._skyway")]
pub(crate) struct ShortestPlan {
    fields: Value,
}

#[pymethods]
impl ShortestPlan {
    /// The plan under the names of the command line.
    fn document<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        to_python(py, &self.fields)
    }

    /// A plan by distance alone has none: refused with the remedy.
    fn certificate(&self) -> PyResult<String> {
        Err(takes_a_flight("no_proof", "a certificate takes a plan that is flown").into())
    }

    /// Refused likewise: what is drawn of a plan are its battery, its stops and the wind.
    #[expect(
        unused_variables,
        reason = "all that can be drawn takes these arguments"
    )]
    fn svg(
        &self,
        width_px: u32,
        title: Option<String>,
        labels: &str,
        whole: bool,
        buildings: Option<&str>,
    ) -> PyResult<String> {
        Err(takes_a_flight("no_map", "a map takes a plan that is flown").into())
    }
}

fn takes_a_flight(code: &'static str, message: &str) -> Refusal {
    let refusal = Refusal::new(Kind::Flight, code, "flight", message);
    refusal.hint("compose with flight=skyway.Flight()")
}

/// Composes the shortest open way, with what to do on each leg that closes.
pub(crate) fn compose(
    py: Python<'_>,
    world: &World,
    airspace: Arc<Airspace>,
    (source, destination): (NodeIx, NodeIx),
    airspeed_mps: f64,
) -> Result<ShortestPlan, Refusal> {
    if !(airspeed_mps.is_finite() && airspeed_mps > 0.0) {
        let refusal = Refusal::new(
            Kind::Request,
            "out_of_range",
            "airspeed_mps",
            format!("it is {airspeed_mps}"),
        );
        return Err(refusal.hint("give metres per second above 0"));
    }
    let fields = without_lock(py, || {
        let plan = world.with_scratch(|scratch| {
            compose::compose(
                &world.engine(&airspace),
                source,
                destination,
                airspeed_mps,
                scratch,
            )
        });
        document(
            &world.ground.topology,
            (source, destination),
            airspeed_mps,
            plan.as_ref(),
        )
    })?;
    Ok(ShortestPlan { fields })
}

fn document(
    topology: &Topology,
    (source, destination): (NodeIx, NodeIx),
    airspeed_mps: f64,
    plan: Option<&Composition>,
) -> Value {
    let id = |node| node_id_json(topology, node);
    let Some(plan) = plan else {
        return json!({"outcome": "no_route", "source": id(source), "destination": id(destination)});
    };
    let segments = plan
        .way
        .segments
        .iter()
        .map(|&segment| segment_id_json(topology, segment));
    json!({
        "outcome": "composed",
        "source": id(source),
        "destination": id(destination),
        "path": {"nodes": ids(topology, &plan.way.nodes), "segments": segments.collect::<Vec<_>>()},
        "length_m": plan.length_m,
        "duration_s": plan.flight_time_s,
        "airspeed_mps": airspeed_mps,
        "times": "nominal",
        "energy": "unchecked",
        "legs": plan.legs.iter().map(|leg| leg_document(topology, leg)).collect::<Vec<_>>(),
    })
}

fn leg_document(topology: &Topology, leg: &Leg) -> Value {
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
        json!({"node": id(safe.node), "nodes": ids(topology, &safe.nodes), "length_m": safe.length_m})
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
    nodes
        .iter()
        .map(|&node| node_id_json(topology, node))
        .collect()
}

/// What a certificate, or a plan with times and battery, is worth.
pub(crate) fn verdict(text: &str, topology: &Topology) -> Result<Value, Refusal> {
    if !is_flight_document(text) {
        return Ok(match verify::verify(text, &NetworkFacts::of(topology)) {
            Ok(verdict) => {
                let length_m = match &verdict {
                    verify::Verdict::Proved { length_m, .. } => Some(*length_m),
                    verify::Verdict::ProvedNoWay { .. } => None,
                };
                json!({"holds": true, "text": verdict.to_string(), "length_m": length_m})
            }
            Err(fault) => json!({"holds": false, "text": fault.to_string(), "length_m": null}),
        });
    }
    let document = read_flight_document(text, topology).map_err(|fault| {
        Refusal::new(
            Kind::Request,
            "certificate_unreadable",
            "certificate",
            fault.to_string(),
        )
    })?;
    let starts = [document.start];
    let checked = verify_flight(
        &document.plan,
        &FlightPremises {
            topology,
            airframe: &document.airframe,
            payload_kg: document.payload_kg,
            wind: &document.wind,
            rules: &document.rules,
            situation: &document.situation,
            starts: &starts,
            destination: document.destination,
            began_s: document.began_s,
            deadline_s: document.deadline_s,
            reserve: document.reserve,
            closed_segments: &document.closed_segments,
        },
    );
    Ok(match checked {
        Ok(()) => {
            json!({"holds": true, "text": "the plan can be flown", "length_m": document.plan.distance_m})
        }
        Err(fault) => {
            json!({"holds": false, "text": fault.to_string(), "length_m": document.plan.distance_m})
        }
    })
}
