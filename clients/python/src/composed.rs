//! Plans by distance, and certificates judged.

use crate::document::to_python;
use crate::refusal::{Kind, Refusal, without_lock};
use crate::world::World;
use pyo3::prelude::*;
use serde_json::{Value, json};
use skyway_engine::airspace::Airspace;
use skyway_engine::compose;
use skyway_engine::network::{NodeIx, Topology};
use skyway_engine::verify::{self, NetworkFacts, verify_flight};
use skyway_formats::{composition_json, is_flight_document, read_flight_document};
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
        composition_json(
            &world.ground.topology,
            (source, destination),
            airspeed_mps,
            plan.as_ref(),
        )
    })?;
    Ok(ShortestPlan { fields })
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
    let checked = verify_flight(&document.plan, &document.premises(topology));
    Ok(match checked {
        Ok(()) => {
            json!({"holds": true, "text": "the plan can be flown", "length_m": document.plan.distance_m})
        }
        Err(fault) => {
            json!({"holds": false, "text": fault.to_string(), "length_m": document.plan.distance_m})
        }
    })
}
