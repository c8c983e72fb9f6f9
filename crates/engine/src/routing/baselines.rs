//! The textbook searches: what the paper compares with, and what local strategies run inside their areas.

use super::area::Area;
use super::frontier::Entrance;
use super::searcher::{Arrival, Searcher};
use crate::airspace::Closed;
use crate::network::NodeIx;

/// A search without preparation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Baseline {
    /// Dijkstra's algorithm, stopped at the goal, or settling everything it can reach.
    Dijkstra {
        /// True to settle everything.
        full_tree: bool,
    },
    /// A* with the straight line, scaled to stay a lower bound where stated lengths are shorter.
    AStar,
    /// Bellman-Ford, stopped by the first round that changes nothing.
    BellmanFord,
}

impl Searcher {
    /// The shortest open way from any start to `goal`, inside an area if one is given; `None` when there is none.
    pub fn shortest(
        &mut self,
        closed: &Closed<'_>,
        starts: &[impl Entrance],
        goal: NodeIx,
        baseline: Baseline,
        within: Option<&Area>,
    ) -> Option<Arrival> {
        match baseline {
            Baseline::Dijkstra { full_tree } => {
                let stop_at = (!full_tree).then_some(goal);
                self.best_first(closed, starts, goal, stop_at, within, |_| 0.0)
            }
            Baseline::AStar => {
                let topology = closed.topology();
                let scale = topology.straight_line_scale();
                let target = topology.position(goal);
                let bound_m = |node| scale * topology.position(node).distance_m(target);
                self.best_first(closed, starts, goal, Some(goal), within, bound_m)
            }
            Baseline::BellmanFord => self.bellman_ford(closed, starts, goal, within),
        }
    }

    /// The shortest open way from any start to the nearest node that is `wanted`; `None` when there is none.
    ///
    /// Then everything that can be reached is settled.
    pub fn nearest(
        &mut self,
        closed: &Closed<'_>,
        starts: &[impl Entrance],
        wanted: impl Fn(NodeIx) -> bool,
    ) -> Option<Arrival> {
        self.begin(closed, starts, None, |_| 0.0);
        while let Some((_, node)) = self.frontier.take() {
            if wanted(node) {
                return self.arrival_at(node);
            }
            self.frontier.relax(
                closed.topology(),
                node,
                |arc| !closed.blocks(arc.segment),
                |_| 0.0,
            );
        }
        None
    }

    fn best_first(
        &mut self,
        closed: &Closed<'_>,
        starts: &[impl Entrance],
        goal: NodeIx,
        stop_at: Option<NodeIx>,
        within: Option<&Area>,
        bound_m: impl Fn(NodeIx) -> f64,
    ) -> Option<Arrival> {
        self.begin(closed, starts, within, &bound_m);
        if let Some(arrival) = self.at_closed_start(closed, starts, goal) {
            return Some(arrival);
        }
        while let Some((_, node)) = self.frontier.take() {
            if Some(node) == stop_at {
                break;
            }
            match within {
                None => self.frontier.relax(
                    closed.topology(),
                    node,
                    |arc| !closed.blocks(arc.segment),
                    &bound_m,
                ),
                Some(area) => self.frontier.relax(
                    closed.topology(),
                    node,
                    |arc| area.contains(arc.to) && !closed.blocks(arc.segment),
                    &bound_m,
                ),
            }
        }
        self.arrival_at(goal)
    }

    fn bellman_ford(
        &mut self,
        closed: &Closed<'_>,
        starts: &[impl Entrance],
        goal: NodeIx,
        within: Option<&Area>,
    ) -> Option<Arrival> {
        self.begin(closed, starts, within, |_| 0.0);
        if let Some(arrival) = self.at_closed_start(closed, starts, goal) {
            return Some(arrival);
        }
        let topology = closed.topology();
        let may_enter = |node| within.is_none_or(|area| area.contains(node));
        let mut changed = true;
        while changed {
            changed = false;
            for segment in topology.segments() {
                if closed.blocks(segment) {
                    continue;
                }
                let ends = topology.segment(segment);
                for (from, to) in [(ends.from, ends.to), (ends.to, ends.from)] {
                    let Some(distance_m) = self.frontier.distance_m(from) else {
                        continue;
                    };
                    let through_m = distance_m + ends.length_m;
                    changed |= may_enter(to) && self.frontier.lower(to, through_m, from, segment);
                }
            }
        }
        self.frontier.settle_everything_seen();
        self.arrival_at(goal)
    }

    fn arrival_at(&self, goal: NodeIx) -> Option<Arrival> {
        self.frontier.is_settled(goal).then_some(())?;
        Some(Arrival {
            length_m: self.frontier.distance_m(goal)?,
            last_taken: goal,
            follows_tree: false,
        })
    }
}
