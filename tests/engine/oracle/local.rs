//! What every local strategy of the oracle has in common: areas tried one after the other.

use std::collections::BTreeSet;

use super::network::World;
use super::search::shortest;

/// One area that was considered.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct StageRecord {
    pub(crate) stage: &'static str,
    /// Left out because it holds too few nodes.
    pub(crate) skipped: bool,
    pub(crate) nodes: BTreeSet<usize>,
    pub(crate) searched: bool,
    pub(crate) path_found: bool,
}

/// What a local strategy answers for one pair of nodes.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct LocalAnswer {
    pub(crate) path: Option<Vec<usize>>,
    pub(crate) length_m: Option<f64>,
    /// The stage of the last search.
    pub(crate) stage: &'static str,
    /// How many areas were searched.
    pub(crate) searches: usize,
    /// The nodes of the last area searched.
    pub(crate) area: BTreeSet<usize>,
    /// The open segments with both ends in that area.
    pub(crate) area_segments: usize,
    /// Every area considered, in order.
    pub(crate) stages: Vec<StageRecord>,
}

/// A local strategy at work between `a` and `b`.
pub(super) struct Trial<'w> {
    world: &'w World<'w>,
    a: usize,
    b: usize,
    stages: Vec<StageRecord>,
    found: Option<(f64, Vec<usize>)>,
}

impl<'w> Trial<'w> {
    pub(super) fn new(world: &'w World<'w>, a: usize, b: usize) -> Self {
        Trial {
            world,
            a,
            b,
            stages: Vec::new(),
            found: None,
        }
    }

    /// Searches an area and tells whether it holds a path.
    pub(super) fn search(&mut self, stage: &'static str, nodes: BTreeSet<usize>) -> bool {
        self.found = shortest(self.world, self.a, self.b, Some(&nodes));
        let path_found = self.found.is_some();
        self.stages.push(StageRecord {
            stage,
            skipped: false,
            nodes,
            searched: true,
            path_found,
        });
        path_found
    }

    /// Searches everything that is open.
    pub(super) fn search_all(&mut self, stage: &'static str) -> bool {
        self.search(stage, self.world.counted_nodes(self.a, self.b))
    }

    pub(super) fn skip(&mut self, stage: &'static str, nodes: BTreeSet<usize>) {
        self.stages.push(StageRecord {
            stage,
            skipped: true,
            nodes,
            searched: false,
            path_found: false,
        });
    }

    /// The counted nodes that a shape holds; `a` and `b` belong to every area.
    pub(super) fn area(&self, holds: impl Fn(usize) -> bool) -> BTreeSet<usize> {
        let counted = self.world.counted_nodes(self.a, self.b);
        counted
            .into_iter()
            .filter(|&node| node == self.a || node == self.b || holds(node))
            .collect()
    }

    /// The answer: the path found last, with the figures of the last search.
    pub(super) fn finish(self) -> LocalAnswer {
        let searched: Vec<&StageRecord> = self
            .stages
            .iter()
            .filter(|record| record.searched)
            .collect();
        let last = searched
            .last()
            .expect("every strategy searches at least once");
        let (length_m, path) = self.found.unzip();
        LocalAnswer {
            path,
            length_m,
            stage: last.stage,
            searches: searched.len(),
            area: last.nodes.clone(),
            area_segments: self.world.count_area_segments(&last.nodes, self.a),
            stages: self.stages,
        }
    }
}

/// A baseline on the local problem: one search over everything that is open.
pub(crate) fn local_baseline(world: &World, a: usize, b: usize) -> LocalAnswer {
    let mut trial = Trial::new(world, a, b);
    trial.search_all("local");
    trial.finish()
}
