//! The base of `skyway.Network`: what is asked of a network, with the arguments as Python gives them.

use crate::answer::{self, Answer};
use crate::composed;
use crate::document::to_python;
use crate::flown::{self, Drone};
use crate::many::{Answers, OUTCOMES, Query, answer_all};
use crate::picture::{Drawing, draw};
use crate::question::{Circumstances, How, parameters};
use crate::refusal::{Kind, Refusal, guarded, without_lock};
use crate::world::World;
use pyo3::buffer::PyBuffer;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};
use skyway_engine::flight::ServiceStop;
use skyway_engine::network::NodeIx;
use skyway_formats::write_node_link;

/// A network that can be asked; `skyway.Network` is made of it.
#[pyclass(frozen, subclass, module = "skyway._skyway")]
pub(crate) struct Core {
    world: Py<World>,
}

#[pymethods]
impl Core {
    #[new]
    fn new(world: Py<World>) -> Self {
        Self { world }
    }

    /// What this network stands on, for another one of it.
    #[getter(_world)]
    fn world(&self, py: Python<'_>) -> Py<World> {
        self.world.clone_ref(py)
    }

    #[getter]
    fn name(&self) -> &str {
        self.world.get().ground.topology.name()
    }

    #[getter]
    fn attribution(&self) -> &str {
        self.world.get().ground.topology.attribution()
    }

    #[getter]
    fn node_count(&self) -> usize {
        self.world.get().ground.topology.node_count()
    }

    #[getter]
    fn segment_count(&self) -> usize {
        self.world.get().ground.topology.segment_count()
    }

    #[getter]
    fn is_geographic(&self) -> bool {
        self.world.get().ground.topology.frame().is_geographic()
    }

    #[getter]
    fn has_integer_ids(&self) -> bool {
        self.world.get().ground.topology.has_integer_ids()
    }

    #[getter]
    fn sha256(&self) -> &str {
        self.world.get().ground.topology.fingerprint_text()
    }

    #[getter]
    fn repairs(&self) -> Vec<String> {
        self.world.get().ground.repairs.clone()
    }

    #[getter]
    fn node_ids<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let ground = &self.world.get().ground;
        Ok(ground.ids(py, &ground.in_order)?.into_any())
    }

    /// The ids of what is closed: nodes, and segments that are closed themselves or at an end.
    #[getter]
    fn closed<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyAny>)> {
        let world = self.world.get();
        let closed = world.airspace.closed();
        let nodes: Vec<NodeIx> = world
            .ground
            .in_order
            .iter()
            .copied()
            .filter(|&node| closed.closes_node(node))
            .collect();
        let segments: Vec<_> = closed.blocked_segments().collect();
        let nodes = world.ground.ids(py, &nodes)?.into_any();
        Ok((nodes, world.ground.segment_ids(py, &segments)?.into_any()))
    }

    /// The network as node-link JSON of NetworkX.
    fn node_link(&self, py: Python<'_>) -> PyResult<String> {
        let topology = &self.world.get().ground.topology;
        Ok(without_lock(py, || write_node_link(topology))?)
    }

    #[pyo3(signature = (
        service, destination=None, *, failure="navigational", location=None, cause_location=None, remaining_path=None,
        zone=None, strategy="exact", scope="global", close=None, flight=None, cell_size_m=None, val_ratio=None,
        stage_skipping=true, full_tree=false, optimum=false, explain=false
    ))]
    #[expect(
        clippy::too_many_arguments,
        reason = "each is a keyword of the call in Python"
    )]
    fn recompose<'py>(
        &self,
        py: Python<'py>,
        service: &Bound<'py, PyAny>,
        destination: Option<&Bound<'py, PyAny>>,
        failure: &str,
        location: Option<&Bound<'py, PyAny>>,
        cause_location: Option<&Bound<'py, PyAny>>,
        remaining_path: Option<&Bound<'py, PyAny>>,
        zone: Option<&Bound<'py, PyAny>>,
        strategy: &str,
        scope: &str,
        close: Option<&Bound<'py, PyAny>>,
        flight: Option<&Bound<'py, PyAny>>,
        cell_size_m: Option<f64>,
        val_ratio: Option<f64>,
        stage_skipping: bool,
        full_tree: bool,
        optimum: bool,
        explain: bool,
    ) -> PyResult<Bound<'py, PyAny>> {
        let world = self.world.get();
        let ground = &world.ground;
        let leg = ground.leg(service)?;
        let destination = match destination {
            Some(id) => ground.node(id, "destination")?,
            None => leg.1,
        };
        let numbers = parameters(cell_size_m, val_ratio, stage_skipping, full_tree)?;
        let mut request = How::of(failure, strategy, scope, numbers)?.request(leg, destination);
        request.optimum = optimum;
        request.explain = explain;
        let airspace = world.closing(&world.targets(close)?);
        let circumstances = Circumstances {
            location,
            cause_location,
            remaining_path,
            zone,
        };
        circumstances.fill(&mut request, ground, &airspace)?;
        if let Some(given) = flight {
            let drone = Drone::of(given)?;
            let plan = flown::recompose(py, world, &airspace, &request, &drone)?;
            return results(py, "FlownRecomposition", plan, world);
        }
        let find =
            || world.with_scratch(|scratch| answer::answer(world, &airspace, &request, scratch));
        // A search by a table takes less time than another thread needs to take the lock and give it back.
        let passed = match world.has_table(destination) && strategy == "exact" {
            true => guarded(find)?,
            false => without_lock(py, find)?,
        };
        Answer::to_dataclass(py, self.world.clone_ref(py), airspace, request, passed)
    }

    #[pyo3(signature = (source, destination, *, airspeed_mps=16.0, flight=None, stops=None, close=None))]
    #[expect(
        clippy::too_many_arguments,
        reason = "each is a keyword of the call in Python"
    )]
    fn compose<'py>(
        &self,
        py: Python<'py>,
        source: &Bound<'py, PyAny>,
        destination: &Bound<'py, PyAny>,
        airspeed_mps: f64,
        flight: Option<&Bound<'py, PyAny>>,
        stops: Option<Vec<(Bound<'py, PyAny>, f64)>>,
        close: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let world = self.world.get();
        let ends = (
            world.ground.node(source, "source")?,
            world.ground.node(destination, "destination")?,
        );
        let airspace = world.closing(&world.targets(close)?);
        let stops = self.stops(stops.unwrap_or_default())?;
        match flight {
            Some(given) => {
                let drone = Drone::of(given)?;
                let plan = flown::compose(py, world, &airspace, ends, &stops, &drone)?;
                results(py, "Composition", plan, world)
            }
            None if !stops.is_empty() => {
                let refusal = Refusal::new(
                    Kind::Flight,
                    "no_flight",
                    "stops",
                    "stops take a plan that is flown",
                );
                Err(refusal.hint("give flight=skyway.Flight()").into())
            }
            None => {
                let plan = composed::compose(py, world, airspace, ends, airspeed_mps)?;
                results(py, "Composition", plan, world)
            }
        }
    }

    /// The columns of many answers, each as bytes; the nodes are those of this network by their numbers.
    #[pyo3(signature = (
        from_nodes, to_nodes, destinations, by_id, failure, strategy, scope, close, threads, cell_size_m, val_ratio, stage_skipping,
        full_tree
    ))]
    #[expect(
        clippy::too_many_arguments,
        reason = "each is a keyword of the call in Python"
    )]
    fn answer_many<'py>(
        &self,
        py: Python<'py>,
        from_nodes: &Bound<'py, PyAny>,
        to_nodes: &Bound<'py, PyAny>,
        destinations: &Bound<'py, PyAny>,
        by_id: bool,
        failure: &str,
        strategy: &str,
        scope: &str,
        close: Option<&Bound<'py, PyAny>>,
        threads: usize,
        cell_size_m: Option<f64>,
        val_ratio: Option<f64>,
        stage_skipping: bool,
        full_tree: bool,
    ) -> PyResult<Bound<'py, PyDict>> {
        let world = self.world.get();
        let numbers = parameters(cell_size_m, val_ratio, stage_skipping, full_tree)?;
        let how = How::of(failure, strategy, scope, numbers)?;
        let airspace = world.closing(&world.targets(close)?);
        let columns = [
            ("service_from", column(py, from_nodes, "service_from")?),
            ("service_to", column(py, to_nodes, "service_to")?),
            ("destination", column(py, destinations, "destination")?),
        ];
        let answers = without_lock(py, || {
            let queries = self.queries(&columns, by_id)?;
            answer_all(world, &airspace, &queries, &how, threads)
        })??;
        bytes_of(py, &answers)
    }

    /// The picture of the network and what is closed on it, as the text of an SVG.
    fn svg(
        &self,
        py: Python<'_>,
        width_px: u32,
        title: Option<String>,
        labels: &str,
        whole: bool,
        buildings: Option<&str>,
    ) -> PyResult<String> {
        let airspace = &self.world.get().airspace;
        let drawing = Drawing::of(width_px, title, labels, whole, buildings, airspace)?;
        Ok(without_lock(py, || draw(airspace, None, None, drawing))?)
    }

    /// Checks a certificate with code that shares nothing with the searches.
    fn verdict<'py>(&self, py: Python<'py>, certificate: &str) -> PyResult<Bound<'py, PyAny>> {
        to_python(
            py,
            &composed::verdict(certificate, &self.world.get().ground.topology)?,
        )
    }
}

impl Core {
    fn stops(&self, given: Vec<(Bound<'_, PyAny>, f64)>) -> PyResult<Vec<ServiceStop>> {
        let ground = &self.world.get().ground;
        let mut stops = Vec::with_capacity(given.len());
        for (number, (id, service_s)) in given.into_iter().enumerate() {
            let place = format!("stops[{number}]");
            let node = ground.node(&id, &place)?;
            let refuse = |message: String, hint: &str| {
                Refusal::new(Kind::Flight, "not_a_stop", place.as_str(), message).hint(hint)
            };
            if ground.topology.pads(node) == 0 {
                return Err(refuse(
                    format!("node {id} has no pad to stop on"),
                    "name a node with pads",
                )
                .into());
            }
            if !(service_s.is_finite() && service_s >= 0.0) {
                return Err(refuse(
                    format!("the service takes {service_s} s"),
                    "give seconds, 0 or more",
                )
                .into());
            }
            stops.push(ServiceStop { node, service_s });
        }
        Ok(stops)
    }

    /// The queries of three columns, by the ids of nodes or by their numbers.
    fn queries(&self, columns: &[(&str, Vec<i64>); 3], by_id: bool) -> Result<Vec<Query>, Refusal> {
        let ground = &self.world.get().ground;
        let count = columns[0].1.len();
        for (place, column) in columns {
            if column.len() != count {
                let message = format!(
                    "it has {} entries, and the first column has {count}",
                    column.len()
                );
                let refusal = Refusal::new(Kind::Request, "columns_differ", *place, message);
                return Err(refusal.hint("give columns of one length"));
            }
        }
        let node = |row: usize, which: usize| {
            let (place, column) = &columns[which];
            let value = column[row];
            let found = match by_id {
                true => ground.by_integer(value),
                false => usize::try_from(value)
                    .ok()
                    .and_then(|number| ground.in_order.get(number).copied()),
            };
            found.ok_or_else(|| ground.unknown_node(&value.to_string(), format!("{place}[{row}]")))
        };
        let query = |row| {
            Ok(Query {
                leg: (node(row, 0)?, node(row, 1)?),
                destination: node(row, 2)?,
            })
        };
        (0..count).map(query).collect()
    }
}

fn column(py: Python<'_>, given: &Bound<'_, PyAny>, place: &str) -> PyResult<Vec<i64>> {
    let buffer = PyBuffer::<i64>::get(given).map_err(|error| {
        let refusal = Refusal::new(Kind::Request, "not_a_column", place, error.to_string());
        refusal.hint("give an array of 64-bit integers, or a list")
    })?;
    buffer.to_vec(py)
}

/// Wraps what was computed in a class of `skyway.results`.
fn results<'py, T: pyo3::PyClass>(
    py: Python<'py>,
    class: &str,
    made: impl Into<pyo3::PyClassInitializer<T>>,
    world: &World,
) -> PyResult<Bound<'py, PyAny>> {
    let plan = Py::new(py, made)?;
    py.import("skyway.results")?
        .getattr(class)?
        .call_method1("_of", (plan, world.ground.topology.has_integer_ids()))
}

fn bytes_of<'py>(py: Python<'py>, answers: &Answers) -> PyResult<Bound<'py, PyDict>> {
    fn column<'py, T: Copy, const SIZE: usize>(
        py: Python<'py>,
        values: &[T],
        bytes: impl Fn(T) -> [u8; SIZE],
    ) -> PyResult<Bound<'py, PyBytes>> {
        PyBytes::new_with(py, values.len() * SIZE, |room| {
            for (place, &value) in room.chunks_exact_mut(SIZE).zip(values) {
                place.copy_from_slice(&bytes(value));
            }
            Ok(())
        })
    }
    let columns = PyDict::new(py);
    columns.set_item("outcome", PyBytes::new(py, &answers.outcome))?;
    columns.set_item(
        "remaining_length_m",
        column(py, &answers.remaining_length_m, f64::to_ne_bytes)?,
    )?;
    columns.set_item(
        "recomposed_length_m",
        column(py, &answers.recomposed_length_m, f64::to_ne_bytes)?,
    )?;
    columns.set_item(
        "settled_nodes",
        column(py, &answers.settled_nodes, u32::to_ne_bytes)?,
    )?;
    columns.set_item("offsets", column(py, &answers.offsets, u64::to_ne_bytes)?)?;
    columns.set_item("nodes", column(py, &answers.nodes, u32::to_ne_bytes)?)?;
    columns.set_item("outcomes", OUTCOMES.map(|outcome| outcome.name()))?;
    Ok(columns)
}
