//! How many nodes and segments an area holds.

use super::local::Gap;
use crate::airspace::Closed;
use crate::network::NodeIx;
use crate::routing::Area;

/// Nodes of an area and open segments with both ends in it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Extent {
    pub(super) nodes: usize,
    pub(super) segments: usize,
}

impl Extent {
    /// The whole network: the open nodes plus A and B, and what is open between them.
    pub(super) fn everything(gap: &Gap<'_>) -> Self {
        Self {
            nodes: gap.all_nodes(),
            segments: gap.closed.open_segments() + arcs_out_of_closed(&gap.closed, gap.from),
        }
    }

    /// An area. Of closed nodes only A has segments that count: it is left, and no other is.
    pub(super) fn of(area: &Area, gap: &Gap<'_>) -> Self {
        let closed = &gap.closed;
        let mut both_ways = 0;
        let mut one_way = 0;
        for &node in area.nodes() {
            let arcs = closed.topology().arcs(node).iter();
            let inside = arcs.filter(|arc| area.contains(arc.to));
            if !closed.closes_node(node) {
                both_ways += inside.filter(|arc| !closed.blocks(arc.segment)).count();
            } else if node == gap.from {
                one_way += inside.filter(|arc| closed.lets_out(arc)).count();
            }
        }
        Self {
            nodes: area.len(),
            segments: both_ways / 2 + one_way,
        }
    }
}

/// Segments from a closed node to open ones; none from an open node, whose segments are counted already.
fn arcs_out_of_closed(closed: &Closed<'_>, node: NodeIx) -> usize {
    if !closed.closes_node(node) {
        return 0;
    }
    let arcs = closed.topology().arcs(node).iter();
    arcs.filter(|arc| closed.lets_out(arc)).count()
}
