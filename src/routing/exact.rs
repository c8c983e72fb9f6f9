//! The exact search: A* with the destination's table, stopped by the first untouched way down its tree.
//!
//! The key of the node taken is a lower bound of every way still possible. Where the way down the tree
//! from that node is open, the key is also the length of a real way, which therefore is the best one
//! (after MPAA*, Hernández, Asín and Baier 2014). One failure settles the detour alone.

use super::frontier::Start;
use super::searcher::{Arrival, Searcher};
use super::tree::DestinationTree;
use crate::airspace::Closed;
use crate::network::NodeIx;

impl Searcher {
    /// The shortest open way from any start to the tree's destination; `None` when there is none.
    ///
    /// The tree is that of the intact network, or has only closures worked in that `closed` closes.
    pub fn exact(
        &mut self,
        closed: &Closed<'_>,
        starts: &[Start],
        tree: &DestinationTree,
    ) -> Option<Arrival> {
        self.dead_ends.clear();
        self.begin(closed, starts, None, |node| tree.distance_m(node));
        if let Some(arrival) = self.at_closed_start(closed, starts, tree.destination()) {
            return Some(arrival);
        }
        if closed.closes_node(tree.destination()) {
            return None;
        }
        while let Some((_, node)) = self.frontier.take() {
            if self.descends(closed, tree, node) {
                let to_here_m = self.frontier.distance_m(node)?;
                return Some(Arrival {
                    length_m: to_here_m + tree.distance_m(node),
                    last_taken: node,
                });
            }
            self.frontier.relax(
                closed.topology(),
                node,
                |arc| !closed.blocks(arc.segment),
                |next| tree.distance_m(next),
            );
        }
        None
    }

    /// A goal that is itself a closed start has been reached: the drone is there.
    pub(super) fn at_closed_start(
        &self,
        closed: &Closed<'_>,
        starts: &[Start],
        goal: NodeIx,
    ) -> Option<Arrival> {
        let start = starts.iter().find(|start| start.node == goal)?;
        closed.closes_node(goal).then_some(Arrival {
            length_m: start.offset_m,
            last_taken: goal,
        })
    }

    /// Walks down the tree; true when the way to the destination is open, and then [`Self::descent`] is that way.
    ///
    /// A way found blocked is marked as it was walked, so that no way is walked twice.
    fn descends(&mut self, closed: &Closed<'_>, tree: &DestinationTree, from: NodeIx) -> bool {
        self.descent.clear();
        let mut node = from;
        while !self.dead_ends.contains(node) {
            let Some((next, segment)) = tree.next(node) else {
                return true;
            };
            if closed.blocks(segment) {
                break;
            }
            self.descent.push((segment, next));
            node = next;
        }
        self.dead_ends.insert(from);
        for &(_, passed) in &self.descent {
            self.dead_ends.insert(passed);
        }
        self.descent.clear();
        false
    }
}
