//! A set of nodes that a local strategy searches, cleared in O(1).

use crate::network::{NodeIx, Topology};

/// A search area: some nodes of a topology, in the order they were added.
#[derive(Debug)]
pub struct Area {
    marks: Vec<u32>,
    generation: u32,
    members: Vec<NodeIx>,
}

impl Area {
    /// An empty area that can hold all nodes of a topology without allocating again.
    pub fn new(topology: &Topology) -> Self {
        Self {
            marks: vec![0; topology.node_count()],
            generation: 1,
            members: Vec::with_capacity(topology.node_count()),
        }
    }

    /// Takes all nodes out.
    pub fn clear(&mut self) {
        self.members.clear();
        self.generation = self.generation.wrapping_add(1);
        if self.generation == 0 {
            self.marks.fill(0);
            self.generation = 1;
        }
    }

    /// Adds a node; true when it was not there.
    #[inline]
    pub fn insert(&mut self, node: NodeIx) -> bool {
        let mark = &mut self.marks[node.at()];
        if *mark == self.generation {
            return false;
        }
        *mark = self.generation;
        self.members.push(node);
        true
    }

    /// True when the node is in the area.
    #[inline]
    pub fn contains(&self, node: NodeIx) -> bool {
        self.marks[node.at()] == self.generation
    }

    /// The nodes of the area, in the order they were added.
    pub fn nodes(&self) -> &[NodeIx] {
        &self.members
    }

    /// How many nodes there are.
    pub fn len(&self) -> usize {
        self.members.len()
    }

    /// True when there are none.
    pub fn is_empty(&self) -> bool {
        self.members.is_empty()
    }
}
