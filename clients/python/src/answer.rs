//! The answer to a failure report: what Python reads of it at once, and what it can ask of it later.

use crate::document::to_python;
use crate::ground::Ground;
use crate::picture::{Drawing, draw};
use crate::refusal::{Kind, Refusal, without_lock};
use crate::world::World;
use pyo3::intern;
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::{PyDict, PyString, PyTuple};
use skyway_engine::airspace::Airspace;
use skyway_engine::checked::{self, Alternatives, Known};
use skyway_engine::flight::FailureType;
use skyway_engine::recompose::{
    Recomposition, Request, Scratch, Severance, Strategy, certify, recompose,
};
use skyway_formats::{self as formats, warning_text, write_certificate};
use std::sync::Arc;

/// An answer with the question and the world that it belongs to.
#[pyclass(frozen, module = "skyway._skyway")]
pub(crate) struct Answer {
    world: Py<World>,
    airspace: Arc<Airspace>,
    request: Request,
    recomposition: Recomposition,
    /// What was wrong with the answer that this one stands in for.
    refused: Option<String>,
}

/// An answer that has passed the check, and what was wrong with the one that it stands in for.
pub(crate) struct Passed {
    pub(crate) recomposition: Recomposition,
    refused: Option<String>,
}

/// Answers a request, and lets the checker pass the answer, as every answer of Skyway.
pub(crate) fn answer(
    world: &World,
    airspace: &Airspace,
    request: &Request,
    scratch: &mut Scratch,
) -> Passed {
    world.prepare_if_asked_again(request.report.destination, scratch);
    let found = recompose(&world.engine(airspace), request, scratch);
    pass(airspace, request, found, scratch)
}

/// The same for an answer that has been found.
pub(crate) fn pass(
    airspace: &Airspace,
    request: &Request,
    found: Recomposition,
    scratch: &mut Scratch,
) -> Passed {
    let alternatives = Alternatives {
        reported: request.report.remaining_path.as_deref(),
        ..Alternatives::default()
    };
    let checked = checked::pass(
        airspace,
        request,
        &Known::default(),
        alternatives,
        found,
        scratch,
    );
    Passed {
        recomposition: checked.answer,
        refused: checked
            .case
            .map(|case| case.fault.text(airspace.topology())),
    }
}

/// The class of answers, and what makes an empty instance of it.
static RECOMPOSITION: PyOnceLock<(Py<PyAny>, Py<PyAny>)> = PyOnceLock::new();

/// An empty instance of the frozen dataclass, whose dictionary is filled here: its own constructor would take longer than the search.
fn empty_dataclass<'py>(py: Python<'py>) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyDict>)> {
    let (class, new) = RECOMPOSITION.get_or_try_init(py, || {
        let class = py.import("skyway.results")?.getattr("Recomposition")?;
        let new = class.getattr("__new__")?;
        Ok::<_, PyErr>((class.unbind(), new.unbind()))
    })?;
    let made = new.bind(py).call1((class.bind(py),))?;
    let fields = made
        .getattr(intern!(py, "__dict__"))?
        .cast_into::<PyDict>()?;
    Ok((made, fields))
}

impl Answer {
    /// The dataclass `skyway.Recomposition` of an answer.
    pub(crate) fn to_dataclass<'py>(
        py: Python<'py>,
        world: Py<World>,
        airspace: Arc<Airspace>,
        request: Request,
        passed: Passed,
    ) -> PyResult<Bound<'py, PyAny>> {
        let answer = Self {
            world,
            airspace,
            request,
            recomposition: passed.recomposition,
            refused: passed.refused,
        };
        let (made, fields) = empty_dataclass(py)?;
        answer.fill(py, &fields)?;
        fields.set_item(intern!(py, "_answer"), Py::new(py, answer)?)?;
        Ok(made)
    }

    fn fill(&self, py: Python<'_>, fields: &Bound<'_, PyDict>) -> PyResult<()> {
        let ground: &Ground = &self.world.get().ground;
        let found = &self.recomposition;
        fields.set_item(intern!(py, "nodes"), ground.ids(py, &found.path.nodes)?)?;
        if found.first_stretch_m != 0.0 {
            fields.set_item(intern!(py, "first_stretch_m"), found.first_stretch_m)?;
        }
        fields.set_item(intern!(py, "area_nodes"), found.area_nodes)?;
        fields.set_item(intern!(py, "area_segments"), found.area_segments)?;
        fields.set_item(intern!(py, "settled_nodes"), found.settled_nodes)?;
        let lengths = [
            (intern!(py, "remaining_length_m"), found.remaining_length_m),
            (
                intern!(py, "recomposed_length_m"),
                found.recomposed_length_m,
            ),
            (intern!(py, "local_optimum_m"), found.local_optimum_m),
            (intern!(py, "global_optimum_m"), found.global_optimum_m),
            (
                intern!(py, "remaining_optimum_m"),
                found.remaining_optimum_m,
            ),
        ];
        for (field, length_m) in lengths {
            if let Some(length_m) = length_m {
                fields.set_item(field, length_m)?;
            }
        }
        self.fill_rare(py, fields)
    }

    /// What most answers have in common: there the defaults of the class stand, and nothing is written.
    fn fill_rare(&self, py: Python<'_>, fields: &Bound<'_, PyDict>) -> PyResult<()> {
        let found = &self.recomposition;
        let names = [
            ("outcome", found.outcome.name(), "rerouted"),
            ("strategy", found.strategy.name(), "exact"),
            ("strategy_used", found.strategy_used.name(), "exact"),
            ("stage", found.stage.name(), "global"),
        ];
        for (field, name, most) in names {
            if name != most {
                fields.set_item(PyString::intern(py, field), PyString::intern(py, name))?;
            }
        }
        if found.searches != 1 {
            fields.set_item(intern!(py, "searches"), found.searches)?;
        }
        if let Some(fallback) = &found.fallback {
            fields.set_item(intern!(py, "fallback_reason"), fallback.to_string())?;
        }
        if !found.flags.is_empty() {
            let flags: Vec<&str> = found.flags.iter().map(|flag| flag.name()).collect();
            fields.set_item(intern!(py, "flags"), PyTuple::new(py, flags)?)?;
        }
        if !found.warnings.is_empty() {
            let topology = &self.world.get().ground.topology;
            let warnings = found
                .warnings
                .iter()
                .map(|warning| warning_text(topology, warning));
            fields.set_item(
                intern!(py, "warnings"),
                PyTuple::new(py, warnings.collect::<Vec<_>>())?,
            )?;
        }
        if !found.severed_by.is_empty() {
            let causes: Vec<String> = found.severed_by.iter().map(cause_text).collect();
            fields.set_item(intern!(py, "severed_by"), PyTuple::new(py, causes)?)?;
        }
        match &self.refused {
            Some(refused) => fields.set_item(intern!(py, "checker_case"), refused),
            None => Ok(()),
        }
    }
}

/// A cause as text: `report`, `network`, or the id of a closure.
fn cause_text(cause: &Severance) -> String {
    match cause {
        Severance::Report => "report".to_owned(),
        Severance::Network => "network".to_owned(),
        Severance::Closure(id) => format!("closure {id}"),
    }
}

#[pymethods]
impl Answer {
    /// The segments of the path, by their ids.
    fn segments<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        let ground = &self.world.get().ground;
        ground.segment_ids(py, &self.recomposition.path.segments)
    }

    /// The whole answer under the names of the API.
    fn document<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        to_python(
            py,
            &formats::answer(&self.airspace, &self.recomposition, &[]),
        )
    }

    /// The proof that the answer is the optimum, as text.
    fn certificate(&self, py: Python<'_>) -> PyResult<String> {
        check_that_a_proof_exists(&self.request)?;
        let world = self.world.get();
        Ok(without_lock(py, || {
            let engine = skyway_engine::recompose::World {
                airspace: &self.airspace,
                trees: None,
            };
            let proof = world.with_scratch(|scratch| certify(&engine, &self.request, scratch));
            write_certificate(&world.ground.topology, &proof)
        })?)
    }

    /// The picture of the answer on its network, as the text of an SVG.
    #[pyo3(signature = (width_px, title, labels, whole, buildings))]
    fn svg(
        &self,
        py: Python<'_>,
        width_px: u32,
        title: Option<String>,
        labels: &str,
        whole: bool,
        buildings: Option<&str>,
    ) -> PyResult<String> {
        let drawing = Drawing::of(width_px, title, labels, whole, buildings, &self.airspace)?;
        Ok(without_lock(py, || {
            draw(
                &self.airspace,
                Some((&self.request, &self.recomposition)),
                None,
                drawing,
            )
        })?)
    }
}

/// Only what the exact search answers can be proved.
fn check_that_a_proof_exists(request: &Request) -> Result<(), Refusal> {
    let refuse = |message: String| Refusal::new(Kind::Request, "no_proof", "strategy", message);
    if request.strategy != Strategy::Exact {
        let message = format!(
            "the answer of {} is no optimum to prove",
            request.strategy.name()
        );
        return Err(refuse(message).hint("ask with strategy='exact'"));
    }
    if request.report.failure == FailureType::Operational {
        let message =
            "an operational failure leads to the nearest alternate, which no certificate proves"
                .to_owned();
        return Err(refuse(message).hint("ask with another failure type"));
    }
    Ok(())
}
