//! What is said where nothing can be reached: causes, what is near, and the least bad way.

use super::answer::{Outcome, Warning};
use super::recomposition::Task;
use super::safety::{Near, UnsafeWay, WhyNot};
use super::severance::{causes_of_leg, severances};
use crate::flight::Location;
use crate::geo::Point;
use crate::network::NodeIx;

/// The most near nodes told.
const NEAR_TOLD: usize = 5;
/// How many of the nearest nodes are looked at for pads.
const NEAR_LOOKED_AT: usize = 256;

impl Task<'_> {
    /// Nothing can be reached.
    pub(super) fn give_up(&mut self) {
        self.answer.outcome = Outcome::NoRoute;
        self.answer.warnings.push(Warning::NoAlternate);
        self.answer.unsafe_way = self.least_bad_way();
        self.tell_what_is_near();
        self.tell_what_severed();
    }

    pub(super) fn tell_what_severed(&mut self) {
        self.answer.severed_by = match self.starts.ways.is_empty() {
            true => causes_of_leg(self.airspace, self.request),
            false => {
                let (airspace, closed, ways) = (self.airspace, &self.closed, &self.starts.ways);
                severances(airspace, closed, ways, self.searcher)
            }
        };
    }

    fn least_bad_way(&mut self) -> Option<UnsafeWay> {
        if let Some(way) = self.starts.least_bad.take() {
            return Some(way);
        }
        let way = self.starts.ways.first()?;
        Some(UnsafeWay::along(self.closed.topology(), way))
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

    /// Where the drone is; the start of its leg where that is unknown.
    fn place(&self) -> Point {
        match self.request.report.location {
            Location::At(place) => place,
            Location::LegStart | Location::Unknown => {
                self.closed.topology().position(self.leg.from)
            }
        }
    }
}
