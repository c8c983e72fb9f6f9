//! What the local strategies share: an area, searches inside it, and what is reported of both.

use super::explanation::{AreaShape, Stage, StageRecord};
use crate::airspace::Closed;
use crate::geo::{Bounds, Point, TOLERANCE_M};
use crate::network::{Arc, NodeIx, Topology, outer_box};
use crate::routing::{Area, Arrival, Baseline, Searcher, Start};
use std::ops::ControlFlow;

/// At most this many stages are recorded for one request: growth can take as many rounds as there are nodes.
pub(super) const MAX_STAGES: usize = 200;

/// What a local strategy did for one pair of nodes.
#[derive(Clone, Copy, Debug)]
pub(super) struct LocalResult {
    /// The way from A to B; the searcher tells it until the next search.
    pub(super) arrival: Option<Arrival>,
    /// Where the last search looked.
    pub(super) stage: Stage,
    /// True when that was the whole network rather than the area.
    pub(super) everywhere: bool,
    /// Areas examined.
    pub(super) searches: u32,
    /// Nodes settled by all searches.
    pub(super) settled: usize,
}

/// Two nodes A and B to reconnect, under what is closed.
#[derive(Clone, Copy)]
pub(super) struct Gap<'a> {
    pub(super) closed: Closed<'a>,
    pub(super) from: NodeIx,
    pub(super) to: NodeIx,
}

/// A gap, and the means to search for a way across it.
pub(super) struct LocalProblem<'a> {
    pub(super) gap: Gap<'a>,
    pub(super) inside: Baseline,
    pub(super) searcher: &'a mut Searcher,
    pub(super) area: &'a mut Area,
    /// Where stages are recorded, if anybody asked.
    pub(super) stages: Option<&'a mut Vec<StageRecord>>,
    searches: u32,
    settled: usize,
}

impl<'a> Gap<'a> {
    pub(super) fn topology(&self) -> &'a Topology {
        self.closed.topology()
    }

    pub(super) fn position(&self, node: NodeIx) -> Point {
        self.topology().position(node)
    }

    /// `N`: the open nodes plus A and B, those two closed or not.
    pub(super) fn all_nodes(&self) -> usize {
        let closed_ends = [self.from, self.to]
            .into_iter()
            .filter(|&end| self.closed.closes_node(end));
        self.closed.open_nodes() + closed_ends.count()
    }

    /// True for nodes that can be in an area: open, or one of the two ends.
    pub(super) fn admits(&self, node: NodeIx) -> bool {
        node == self.from || node == self.to || !self.closed.closes_node(node)
    }

    /// Hands every node to `visit` that can be in an area and lies in a box or within tolerance of it.
    pub(super) fn visit_nodes_in(&self, bounds: Bounds, mut visit: impl FnMut(NodeIx, Point)) {
        let topology = self.topology();
        let grown = outer_box(bounds.grown(2.0 * TOLERANCE_M));
        let _ = topology
            .node_tree()
            .locate_in_envelope_intersecting_int(&grown, |found| {
                if self.admits(found.node) {
                    visit(found.node, topology.position(found.node));
                }
                ControlFlow::<()>::Continue(())
            });
    }

    /// The arcs a drone can fly from a node of an area; from a closed A those to open nodes.
    pub(super) fn open_arcs(&self, node: NodeIx) -> impl Iterator<Item = &'a Arc> + use<'a> {
        let (closed, is_start) = (self.closed, node == self.from);
        let arcs = self.topology().arcs(node).iter();
        arcs.filter(move |arc| match is_start {
            true => closed.lets_pass(node, arc),
            false => !closed.blocks(arc.segment),
        })
    }
}

impl<'a> LocalProblem<'a> {
    pub(super) fn new(
        gap: Gap<'a>,
        inside: Baseline,
        searcher: &'a mut Searcher,
        area: &'a mut Area,
        stages: Option<&'a mut Vec<StageRecord>>,
    ) -> Self {
        Self {
            gap,
            inside,
            searcher,
            area,
            stages,
            searches: 0,
            settled: 0,
        }
    }

    /// Empties the area and puts the two ends in.
    pub(super) fn restart_area(&mut self) {
        self.area.clear();
        self.area.insert(self.gap.from);
        self.area.insert(self.gap.to);
    }

    /// Searches from A to B inside the area.
    pub(super) fn search_area(&mut self) -> Option<Arrival> {
        self.search(true)
    }

    /// Searches from A to B everywhere.
    pub(super) fn search_everywhere(&mut self) -> Option<Arrival> {
        self.search(false)
    }

    /// Counts a search that need not be run, as its outcome is known: there is no path.
    pub(super) fn search_in_vain(&mut self) {
        self.searches += 1;
    }

    fn search(&mut self, in_area: bool) -> Option<Arrival> {
        let start = Start {
            node: self.gap.from,
            offset_m: 0.0,
        };
        let within = in_area.then_some(&*self.area);
        let found =
            self.searcher
                .shortest(&self.gap.closed, &[start], self.gap.to, self.inside, within);
        self.searches += 1;
        self.settled += self.searcher.settled();
        found
    }

    /// Records a stage, if anybody asked: its area is the nodes that `belongs` admits.
    pub(super) fn record(
        &mut self,
        stage: Stage,
        skipped: bool,
        path_found: bool,
        shape: impl FnOnce() -> AreaShape,
        belongs: impl Fn(&Area, NodeIx) -> bool,
    ) {
        let Some(stages) = self.stages.as_deref_mut() else {
            return;
        };
        if stages.len() == MAX_STAGES {
            // The last stage is the one that tells how it ended: it takes the place of the one before.
            stages.pop();
        }
        let gap = self.gap;
        let topology = gap.topology();
        let mut nodes: Vec<NodeIx> = topology
            .nodes()
            .filter(|&node| gap.admits(node) && belongs(self.area, node))
            .collect();
        nodes.sort_by_key(|&node| topology.rank(node));
        stages.push(StageRecord {
            stage,
            skipped,
            nodes,
            shape: shape(),
            searched: !skipped,
            path_found,
        });
    }

    /// Sums up, the last search having looked in `stage`.
    pub(super) fn result(
        &self,
        arrival: Option<Arrival>,
        stage: Stage,
        everywhere: bool,
    ) -> LocalResult {
        LocalResult {
            arrival,
            stage,
            everywhere,
            searches: self.searches,
            settled: self.settled,
        }
    }

    /// Searches the whole network as stage `local`: a baseline from A to B.
    pub(super) fn search_as_baseline(&mut self) -> LocalResult {
        let arrival = self.search_everywhere();
        let found = arrival.is_some();
        let shape = || AreaShape::Everything;
        self.record(Stage::Local, false, found, shape, |_, _| true);
        self.result(arrival, Stage::Local, true)
    }

    /// Searches the whole network as stage `global`, the last resort of a strategy.
    pub(super) fn resort_to_everything(&mut self) -> LocalResult {
        let arrival = self.search_everywhere();
        let found = arrival.is_some();
        let shape = || AreaShape::Everything;
        self.record(Stage::Global, false, found, shape, |_, _| true);
        self.result(arrival, Stage::Global, true)
    }
}
