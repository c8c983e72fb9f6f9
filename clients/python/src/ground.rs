//! A network with what Python calls its nodes and segments, made once, so that an answer only counts references.

use crate::refusal::{Kind, Refusal};
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::{PyString, PyTuple};
use rustc_hash::FxHashMap;
use skyway_engine::geo::Point;
use skyway_engine::network::{NodeIx, SegmentIx, Topology};
use skyway_formats::{CloseTarget, LoadedNetwork, nearest};
use std::sync::Arc;

/// The most ids that an error suggests.
const SUGGESTIONS_MAX: usize = 3;

/// The network and its ids as objects of Python: integers where the file writes integers, else text.
pub(crate) struct Ground {
    pub(crate) topology: Arc<Topology>,
    /// What was repaired in foreign data.
    pub(crate) repairs: Vec<String>,
    /// The nodes in the order of their ids: a node's number is its place here.
    pub(crate) in_order: Vec<NodeIx>,
    ids: Vec<Py<PyAny>>,
    /// For integers, without a detour by text.
    by_integer: FxHashMap<i64, NodeIx>,
    segment_ids: Vec<PyOnceLock<Py<PyString>>>,
}

impl Ground {
    pub(crate) fn new(py: Python<'_>, loaded: LoadedNetwork) -> PyResult<Self> {
        let topology = Arc::new(loaded.topology);
        let mut in_order: Vec<NodeIx> = topology.nodes().collect();
        in_order.sort_unstable_by_key(|&node| topology.rank(node));
        let mut ids = Vec::with_capacity(topology.node_count());
        let mut by_integer = FxHashMap::default();
        for node in topology.nodes() {
            let id = topology.node_id(node);
            let integer = id
                .parse::<i64>()
                .ok()
                .filter(|_| topology.has_integer_ids());
            ids.push(match integer {
                Some(integer) => {
                    by_integer.insert(integer, node);
                    integer.into_pyobject(py)?.into_any().unbind()
                }
                None => PyString::new(py, id).into_any().unbind(),
            });
        }
        let segments = topology.segment_count();
        Ok(Self {
            repairs: loaded.repairs.iter().map(ToString::to_string).collect(),
            in_order,
            ids,
            by_integer,
            segment_ids: (0..segments).map(|_| PyOnceLock::new()).collect(),
            topology,
        })
    }

    /// The id of a node, as Python has it.
    pub(crate) fn id(&self, py: Python<'_>, node: NodeIx) -> Py<PyAny> {
        self.ids[node.0 as usize].clone_ref(py)
    }

    pub(crate) fn ids<'py>(
        &self,
        py: Python<'py>,
        nodes: &[NodeIx],
    ) -> PyResult<Bound<'py, PyTuple>> {
        PyTuple::new(py, nodes.iter().map(|&node| self.id(py, node)))
    }

    pub(crate) fn segment_ids<'py>(
        &self,
        py: Python<'py>,
        segments: &[SegmentIx],
    ) -> PyResult<Bound<'py, PyTuple>> {
        let id = |segment: &SegmentIx| {
            let made = || PyString::new(py, &self.topology.segment_id(*segment)).unbind();
            self.segment_ids[segment.0 as usize]
                .get_or_init(py, made)
                .clone_ref(py)
        };
        PyTuple::new(py, segments.iter().map(id))
    }

    /// The node of an id written as an integer.
    pub(crate) fn by_integer(&self, id: i64) -> Option<NodeIx> {
        let found = self.by_integer.get(&id).copied();
        found.or_else(|| self.topology.node(&id.to_string()))
    }

    fn find(&self, given: &Bound<'_, PyAny>) -> PyResult<Option<NodeIx>> {
        if let Ok(integer) = given.extract::<i64>() {
            return Ok(self.by_integer(integer));
        }
        match given.cast::<PyString>() {
            Ok(text) => Ok(self.topology.node(text.to_cow()?.as_ref())),
            Err(_) => Ok(None),
        }
    }

    /// The node that an id names; `place` says which argument that was.
    pub(crate) fn node(&self, given: &Bound<'_, PyAny>, place: &str) -> PyResult<NodeIx> {
        match self.find(given)? {
            Some(node) => Ok(node),
            None => Err(self.unknown_node(&given.str()?.to_cow()?, place).into()),
        }
    }

    pub(crate) fn unknown_node(&self, id: &str, place: impl Into<String>) -> Refusal {
        let network = self.topology.name();
        let message = format!("the network '{network}' has no node '{id}'");
        let known = || {
            self.in_order
                .iter()
                .map(|&node| self.topology.node_id(node))
        };
        // Every number is near to some other.
        let near = match self.topology.has_integer_ids() {
            true => Vec::new(),
            false => nearest(id, known(), SUGGESTIONS_MAX),
        };
        let hint = match (near.is_empty(), known().next(), known().next_back()) {
            (false, ..) => format!("near to it are {}", near.join(", ")),
            (true, Some(first), Some(last)) => format!("its ids go from '{first}' to '{last}'"),
            _ => "the network has no nodes".to_owned(),
        };
        Refusal::new(Kind::Request, "unknown_node", place, message).hint(hint)
    }

    /// The two ends of a leg.
    pub(crate) fn leg(&self, given: &Bound<'_, PyAny>) -> PyResult<(NodeIx, NodeIx)> {
        if let Ok((from, to)) = given.extract::<(Bound<'_, PyAny>, Bound<'_, PyAny>)>()
            && !given.is_instance_of::<PyString>()
        {
            return Ok((
                self.node(&from, "service[0]")?,
                self.node(&to, "service[1]")?,
            ));
        }
        let message = format!("{} is no leg", given.repr()?);
        let refusal = Refusal::new(Kind::Request, "not_a_leg", "service", message);
        Err(refusal
            .hint("give the node behind the drone and the node ahead of it, as (379, 406)")
            .into())
    }

    /// A node, a segment by its id, or a segment by its ends.
    pub(crate) fn close_target(
        &self,
        given: &Bound<'_, PyAny>,
        place: &str,
    ) -> PyResult<CloseTarget> {
        if let Some(node) = self.find(given)? {
            return Ok(CloseTarget::Node(node));
        }
        let segment = match given.cast::<PyString>() {
            Ok(text) => self.topology.find_segment(text.to_cow()?.as_ref()),
            Err(_) => match given.extract::<(Bound<'_, PyAny>, Bound<'_, PyAny>)>() {
                Ok((from, to)) => {
                    let (from, to) = (self.node(&from, place)?, self.node(&to, place)?);
                    self.topology.segment_between(from, to)
                }
                Err(_) => None,
            },
        };
        if let Some(segment) = segment {
            return Ok(CloseTarget::Segment(segment));
        }
        let message = format!("{} names neither a node nor a segment", given.repr()?);
        let refusal = Refusal::new(Kind::Request, "cannot_close", place, message);
        Err(refusal.hint("give the id of a node or of a segment, or the two nodes of a segment as (379, 406)").into())
    }

    /// A place: the id of a node, or two coordinates as the network's file has them.
    pub(crate) fn place(&self, given: &Bound<'_, PyAny>, name: &str) -> PyResult<Point> {
        if let Some(node) = self.find(given)? {
            return Ok(self.topology.position(node));
        }
        let geographic = self.topology.frame().is_geographic();
        let form = match geographic {
            true => "give (longitude, latitude) in degrees, or the id of a node",
            false => "give (x, y) in metres, or the id of a node",
        };
        let wrong =
            |message: String| Refusal::new(Kind::Request, "not_a_place", name, message).hint(form);
        let Ok((first, second)) = given.extract::<(f64, f64)>() else {
            return Err(wrong(format!("{} is no place", given.repr()?)).into());
        };
        if geographic && (first.abs() > 180.0 || second.abs() > 90.0) {
            let message = format!("({first}, {second}) is not on Earth");
            return Err(wrong(message)
                .hint("longitude comes first: were they swapped?")
                .into());
        }
        let point = self.topology.frame().to_plane([first, second]);
        match point.is_finite() {
            true => Ok(point),
            false => Err(wrong(format!("({first}, {second}) is not finite")).into()),
        }
    }
}
