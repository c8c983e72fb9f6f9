//! Ids of nodes and segments: what people and files call them, against the indices that searches use.

use super::order::NodeOrder;
use rustc_hash::FxHashMap;

/// Index of a node in its topology; meaningless in any other.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct NodeIx(pub u32);

/// Index of a segment in its topology; meaningless in any other.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct SegmentIx(pub u32);

impl NodeIx {
    /// The index as a position in a slice.
    pub fn at(self) -> usize {
        self.0 as usize
    }
}

impl SegmentIx {
    /// The index as a position in a slice.
    pub fn at(self) -> usize {
        self.0 as usize
    }
}

/// The ids of all nodes, both ways, with their order.
#[derive(Debug)]
pub(super) struct NodeIds {
    by_index: Vec<Box<str>>,
    by_id: FxHashMap<Box<str>, NodeIx>,
    rank: Vec<u32>,
    integers: bool,
}

impl NodeIds {
    /// Takes ids in index order; they are unique, which the builder has checked.
    pub(super) fn new(by_index: Vec<Box<str>>, integers: bool) -> Self {
        let order = NodeOrder::of(by_index.iter().map(|id| &**id));
        let mut sorted: Vec<u32> = (0..by_index.len() as u32).collect();
        sorted.sort_by(|&left, &right| {
            order.compare(&by_index[left as usize], &by_index[right as usize])
        });
        let mut rank = vec![0; by_index.len()];
        for (place, &node) in sorted.iter().enumerate() {
            rank[node as usize] = place as u32;
        }
        let by_id = by_index
            .iter()
            .enumerate()
            .map(|(index, id)| (id.clone(), NodeIx(index as u32)))
            .collect();
        Self {
            by_index,
            by_id,
            rank,
            integers,
        }
    }

    pub(super) fn id(&self, node: NodeIx) -> &str {
        &self.by_index[node.at()]
    }

    pub(super) fn find(&self, id: &str) -> Option<NodeIx> {
        self.by_id.get(id).copied()
    }

    /// The id of a segment between two nodes that has none of its own: `"A-B"`, the node first in node order first.
    pub(super) fn pair(&self, from: NodeIx, to: NodeIx) -> String {
        let (first, second) = match self.rank(from) < self.rank(to) {
            true => (from, to),
            false => (to, from),
        };
        let [first, second] = [first, second].map(|node| self.id(node));
        // Every answer writes these ids: formatting would take three times as long.
        let mut id = String::with_capacity(first.len() + 1 + second.len());
        id.push_str(first);
        id.push('-');
        id.push_str(second);
        id
    }

    pub(super) fn alias(&mut self, id: String, node: NodeIx) {
        self.by_id.entry(id.into_boxed_str()).or_insert(node);
    }

    pub(super) fn rank(&self, node: NodeIx) -> u32 {
        self.rank[node.at()]
    }

    pub(super) fn are_integers(&self) -> bool {
        self.integers
    }
}

/// The ids of all segments; nothing is stored where they all derive from their nodes.
#[derive(Debug)]
pub(super) enum SegmentIds {
    /// `"A-B"`, the node first in node order first.
    Derived,
    /// As the file states them.
    Stated {
        by_index: Vec<Box<str>>,
        by_id: FxHashMap<Box<str>, SegmentIx>,
    },
}

impl SegmentIds {
    pub(super) fn stated(by_index: Vec<Box<str>>) -> Self {
        let by_id = by_index
            .iter()
            .enumerate()
            .map(|(index, id)| (id.clone(), SegmentIx(index as u32)))
            .collect();
        Self::Stated { by_index, by_id }
    }
}
