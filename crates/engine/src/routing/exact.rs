//! The exact search: A* with the destination's table, stopped by the first untouched way down its tree.
//!
//! The key of the node taken is a lower bound of every way still possible. Where the way down the tree
//! from that node is open, the key is also the length of a real way, which therefore is the best one
//! (after MPAA*, Hernández, Asín and Baier 2014). One failure settles the detour alone.

use super::frontier::Entrance;
use super::searcher::{Arrival, Searcher};
use super::tree::{DestinationTree, Span};
use crate::airspace::Closed;
use crate::network::NodeIx;

/// More closed segments than this are looked for by walking down the tree.
const MAX_CUTS: usize = 8;

/// The branches of a tree that closed segments cut off, as spans of the tree's numbering.
struct Cuts {
    spans: [Span; MAX_CUTS],
    count: usize,
}

impl Cuts {
    /// The branches cut off; `None` where they are not told by spans: the tree has no numbering, something
    /// stands closed that the request did not close, or there are too many.
    fn of(closed: &Closed<'_>, tree: &DestinationTree) -> Option<Self> {
        let blocked = closed.blocked_by_request()?;
        // Without a numbering nothing can be told by spans, also where there is nothing to tell.
        if !tree.is_numbered() || blocked.len() > MAX_CUTS {
            return None;
        }
        let mut cuts = Self {
            spans: [Span::EMPTY; MAX_CUTS],
            count: 0,
        };
        for &segment in blocked {
            let ends = closed.topology().segment(segment);
            for (node, next) in [(ends.from, ends.to), (ends.to, ends.from)] {
                if tree.next(node) == Some((next, segment)) {
                    cuts.spans[cuts.count] = tree.span(node)?;
                    cuts.count += 1;
                }
            }
        }
        Some(cuts)
    }

    /// True when the way down the tree from a node is open.
    fn spare(&self, tree: &DestinationTree, node: NodeIx) -> bool {
        let Some(place) = tree.span(node) else {
            return false;
        };
        let cuts = &self.spans[..self.count];
        !cuts.iter().any(|cut| cut.holds(place))
    }
}

impl Searcher {
    /// The shortest open way from any start to the tree's destination; `None` when there is none.
    ///
    /// The tree is that of the intact network, or has only closures worked in that `closed` closes.
    pub fn exact(
        &mut self,
        closed: &Closed<'_>,
        starts: &[impl Entrance],
        tree: &DestinationTree,
    ) -> Option<Arrival> {
        self.begin(closed, starts, None, |node| tree.distance_m(node));
        if let Some(arrival) = self.at_closed_start(closed, starts, tree.destination()) {
            return Some(arrival);
        }
        if closed.closes_node(tree.destination()) {
            return None;
        }
        let cuts = Cuts::of(closed, tree);
        self.dead_ends.clear();
        while let Some((_, node)) = self.frontier.take() {
            let is_untouched = match &cuts {
                Some(cuts) => cuts.spare(tree, node),
                None => self.descends(closed, tree, node),
            };
            if is_untouched {
                let to_here_m = self.frontier.distance_m(node)?;
                return Some(Arrival {
                    length_m: to_here_m + tree.distance_m(node),
                    last_taken: node,
                    follows_tree: true,
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
        starts: &[impl Entrance],
        goal: NodeIx,
    ) -> Option<Arrival> {
        let at_goal = starts.iter().map(|entrance| entrance.start());
        let start = at_goal
            .filter(|start| start.node == goal)
            .min_by(|one, other| one.offset_m.total_cmp(&other.offset_m))?;
        closed.closes_node(goal).then_some(Arrival {
            length_m: start.offset_m,
            last_taken: goal,
            follows_tree: false,
        })
    }

    /// Walks down the tree; true when the way to the destination is open.
    ///
    /// A way found blocked is marked as far as it was walked, so that no way is walked twice.
    fn descends(&mut self, closed: &Closed<'_>, tree: &DestinationTree, from: NodeIx) -> bool {
        let mut node = from;
        while !self.dead_ends.contains(node) {
            let Some((next, segment)) = tree.next(node) else {
                return true;
            };
            if closed.blocks(segment) {
                break;
            }
            node = next;
        }
        let blocked_at = node;
        node = from;
        while self.dead_ends.insert(node) && node != blocked_at {
            let Some((next, _)) = tree.next(node) else {
                break;
            };
            node = next;
        }
        false
    }
}
