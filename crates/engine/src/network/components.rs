//! Connected components of a topology.

use super::identity::NodeIx;
use super::topology::Topology;
use petgraph::unionfind::UnionFind;

/// Which nodes can be reached from each other when everything is open.
#[derive(Clone, Debug, PartialEq)]
pub struct Components {
    /// Per node, the number of its component; numbers run from 0, the largest component first.
    pub of_node: Vec<u32>,
    /// Nodes per component, largest first; ties keep the component whose first node comes first.
    pub sizes: Vec<usize>,
}

impl Components {
    /// Finds the components of a topology.
    pub fn of(topology: &Topology) -> Self {
        let mut sets = UnionFind::<u32>::new(topology.node_count());
        for segment in topology.segments() {
            let ends = topology.segment(segment);
            sets.union(ends.from.0, ends.to.0);
        }
        let representative = sets.into_labeling();
        let mut size_of = vec![0_usize; representative.len()];
        for &root in &representative {
            size_of[root as usize] += 1;
        }
        let mut roots: Vec<u32> = (0..size_of.len() as u32)
            .filter(|&root| size_of[root as usize] > 0)
            .collect();
        roots.sort_by_key(|&root| std::cmp::Reverse(size_of[root as usize]));
        let mut number_of = vec![0_u32; size_of.len()];
        for (number, &root) in roots.iter().enumerate() {
            number_of[root as usize] = number as u32;
        }
        Self {
            of_node: representative
                .iter()
                .map(|&root| number_of[root as usize])
                .collect(),
            sizes: roots.iter().map(|&root| size_of[root as usize]).collect(),
        }
    }

    /// The nodes of the largest component, in index order.
    pub fn largest(&self) -> impl Iterator<Item = NodeIx> + '_ {
        self.of_node
            .iter()
            .enumerate()
            .filter(|&(_, &component)| component == 0)
            .map(|(index, _)| NodeIx(index as u32))
    }

    /// How many nodes have no segment at all.
    pub fn isolated_count(&self) -> usize {
        self.sizes.iter().filter(|&&size| size == 1).count()
    }
}
