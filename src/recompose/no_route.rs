//! What is said where nothing can be reached: causes, what is near, and the least bad way.

use super::answer::{Outcome, Severance, Warning};
use super::recomposition::Task;
use super::safety::{Near, UnsafeCode, UnsafeWay, WhyNot};
use super::severance::severances;
use crate::flight::{Location, StretchKind};
use crate::geo::Point;
use crate::network::NodeIx;

/// So many near nodes are told at most.
const NEAR_TOLD: usize = 5;
/// How many of the nearest nodes are looked at for pads.
const NEAR_LOOKED_AT: usize = 256;

impl Task<'_> {
    /// Nothing can be reached.
    pub(super) fn give_up(&mut self) {
        self.answer.outcome = Outcome::NoRoute;
        self.answer.warnings.push(Warning::NoSafeNode);
        self.answer.unsafe_way = self.least_bad_way();
        self.tell_what_is_near();
        self.tell_what_severed();
    }

    pub(super) fn tell_what_severed(&mut self) {
        self.answer.severed_by = match self.starts.ways.is_empty() {
            true => self.causes_of_the_leg(),
            false => {
                let (airspace, closed, ways) = (self.airspace, &self.closed, &self.starts.ways);
                severances(airspace, closed, ways, self.searcher)
            }
        };
    }

    /// All that closes the leg or its ends.
    fn causes_of_the_leg(&self) -> Vec<Severance> {
        let mut causes = Vec::new();
        if self.request.report.failure.closes_leg() || self.request.zone.is_some() {
            causes.push(Severance::Report);
        }
        let leg = &self.leg;
        let hits_leg = |segments: &[_]| {
            leg.segment
                .is_some_and(|segment| segments.binary_search(&segment).is_ok())
        };
        let hits_end = |nodes: &[NodeIx]| {
            [leg.from, leg.to]
                .iter()
                .any(|end| nodes.binary_search(end).is_ok())
        };
        let in_force = self.airspace.in_force();
        let cutting = in_force
            .filter(|closure| hits_leg(&closure.hits.segments) || hits_end(&closure.hits.nodes));
        causes.extend(cutting.map(|closure| Severance::Closure(closure.id.clone())));
        if causes.is_empty() || leg.segment.is_none() {
            causes.push(Severance::Network);
        }
        causes
    }

    fn least_bad_way(&mut self) -> Option<UnsafeWay> {
        if let Some(way) = self.starts.least_bad.take() {
            return Some(way);
        }
        let way = self.starts.ways.first()?;
        let node = self.closed.topology().position(way.node);
        let mut line = vec![way.stretch.begin];
        if way.stretch.kind != StretchKind::None {
            line.push(node);
        }
        Some(UnsafeWay {
            code: UnsafeCode::NoSafeNode,
            nodes: vec![way.node],
            line,
            length_m: way.stretch.length_m,
            battery: None,
        })
    }

    /// The nearest nodes with pads, and why the path does not lead there; nodes without pads where there are none.
    fn tell_what_is_near(&mut self) {
        let (topology, closed) = (self.closed.topology(), self.closed);
        let place = self.place();
        let around = [place.x as f32, place.y as f32];
        let nodes = topology.node_tree().nearest_neighbor_iter(&around);
        let nodes: Vec<NodeIx> = nodes.take(NEAR_LOOKED_AT).map(|near| near.node).collect();
        let with_pads = nodes.iter().filter(|node| topology.pads(**node) > 0);
        let mut told: Vec<NodeIx> = with_pads.copied().take(NEAR_TOLD).collect();
        if told.is_empty() {
            told.extend(nodes.iter().take(NEAR_TOLD));
        }
        let why_not = |node: NodeIx| match topology.pads(node) {
            _ if closed.closes_node(node) => WhyNot::Closed,
            0 => WhyNot::NoPads,
            _ if self.airspace.closes_pads(node) => WhyNot::NoPads,
            _ => WhyNot::CutOff,
        };
        let near = told.into_iter().map(|node| Near {
            node,
            length_m: topology.position(node).distance_m(place),
            pads: topology.pads(node),
            battery: None,
            why_not: why_not(node),
        });
        let near: Vec<Near> = near.collect();
        self.answer.near = near;
    }

    /// Where the drone is; the start of its leg where nobody knows.
    fn place(&self) -> Point {
        match self.request.report.location {
            Location::At(place) => place,
            Location::LegStart | Location::Unknown => {
                self.closed.topology().position(self.leg.from)
            }
        }
    }
}
