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
    numbers: Option<Numbers>,
}

/// Ids that are integers, so that none is read or written as text on the way of a request.
#[derive(Debug)]
struct Numbers {
    by_index: Vec<i64>,
    /// Nodes by their number; empty where the numbers lie too far apart for a table.
    by_number: Vec<Option<NodeIx>>,
}

impl Numbers {
    /// A table may have this many places for each node.
    const PLACES_PER_NODE: usize = 4;

    /// The numbers of ids that are all integers; `None` where one is too large for 64 bits, or would not be written
    /// as it is (`007`).
    fn of(ids: &[Box<str>]) -> Option<Self> {
        let number = |id: &str| -> Option<i64> {
            let number = id.parse().ok()?;
            (itoa::Buffer::new().format(number) == id).then_some(number)
        };
        let by_index: Vec<i64> = ids.iter().map(|id| number(id)).collect::<Option<_>>()?;
        let room = (ids.len() + 1).saturating_mul(Self::PLACES_PER_NODE);
        let places = by_index.iter().map(|&number| usize::try_from(number).ok());
        let last = places.collect::<Option<Vec<usize>>>();
        let last = last.and_then(|places| places.into_iter().max());
        let mut by_number = Vec::new();
        if let Some(last) = last.filter(|&last| last < room) {
            by_number.resize(last + 1, None);
            for (index, &number) in by_index.iter().enumerate() {
                by_number[number as usize] = Some(NodeIx(index as u32));
            }
        }
        Some(Self {
            by_index,
            by_number,
        })
    }

    fn find(&self, number: i64) -> Option<NodeIx> {
        let place = usize::try_from(number).ok()?;
        self.by_number.get(place).copied().flatten()
    }
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
        let numbers = integers.then(|| Numbers::of(&by_index)).flatten();
        Self {
            by_index,
            by_id,
            rank,
            integers,
            numbers,
        }
    }

    pub(super) fn id(&self, node: NodeIx) -> &str {
        &self.by_index[node.at()]
    }

    pub(super) fn find(&self, id: &str) -> Option<NodeIx> {
        self.by_id.get(id).copied()
    }

    /// The number of a node's id, where ids are integers.
    pub(super) fn number(&self, node: NodeIx) -> Option<i64> {
        let numbers = self.numbers.as_ref()?;
        Some(numbers.by_index[node.at()])
    }

    pub(super) fn find_number(&self, number: i64) -> Option<NodeIx> {
        let known = self
            .numbers
            .as_ref()
            .and_then(|numbers| numbers.find(number));
        // Numbers beyond the table, and those of nodes that were merged away.
        known.or_else(|| self.find(itoa::Buffer::new().format(number)))
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
