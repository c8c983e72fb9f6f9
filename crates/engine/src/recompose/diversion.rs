//! Where a drone goes that cannot reach its destination: the nearest node that will do.

use super::answer::{Fallback, Outcome, Warning};
use super::recomposition::Task;
use super::request::Strategy;
use crate::flight::OperationalDetail;
use crate::network::NodeIx;
use crate::routing::Arrival;

/// A drone that has to land prefers a node with pads that costs at most so much as the nearest one.
const PADS_AT_MOST_FARTHER: f64 = 1.2;

impl Task<'_> {
    /// The destination cannot be reached: the nearest alternate, or the causes that cut the drone off.
    pub(super) fn divert_or_give_up(&mut self) {
        if let Some(arrival) = self.nearest_alternate() {
            self.take_diversion(arrival);
            self.tell_what_severed();
            return;
        }
        let Some(spare) = self.starts.spare.take() else {
            self.give_up();
            return;
        };
        // The shorter way out of the zone leads nowhere: the longer one may.
        self.starts.ways.clear();
        self.starts.ways.push(spare);
        let arrival = self.search_exactly();
        self.answer.settled_nodes += self.searcher.settled();
        match arrival {
            Some(arrival) => self.take_path(arrival, Outcome::Rerouted),
            None => self.divert_or_give_up(),
        }
    }

    /// A drone whose battery or payload fails goes to the nearest alternate, whatever lies ahead.
    pub(super) fn divert_drone_in_need(&mut self) {
        let detail = self.request.circumstances.detail;
        let lands_anywhere = detail.is_some_and(OperationalDetail::lands_anywhere);
        let safe = self.nearest_alternate();
        let arrival = match lands_anywhere {
            true => self.nearest_landing(safe),
            false => safe,
        };
        self.answer.strategy_used = Strategy::Exact;
        if self.answer.strategy != Strategy::Exact {
            self.answer.fallback = Some(Fallback::NothingClosed);
        }
        self.count_global_search();
        match arrival {
            Some(arrival) => self.take_diversion(arrival),
            None => self.give_up(),
        }
    }

    /// The nearest node that is not closed; the one with pads where that costs little more.
    fn nearest_landing(&mut self, with_pads: Option<Arrival>) -> Option<Arrival> {
        let closed = self.closed;
        let is_open = |node: NodeIx| !closed.closes_node(node);
        let ways = &self.starts.ways;
        let any = self.searcher.nearest(&closed, ways, is_open)?;
        let is_near_enough = |safe: &Arrival| safe.length_m <= any.length_m * PADS_AT_MOST_FARTHER;
        match with_pads.filter(is_near_enough) {
            Some(_) => self.nearest_alternate(),
            None => Some(any),
        }
    }

    fn nearest_alternate(&mut self) -> Option<Arrival> {
        let topology = self.closed.topology();
        let failed = self.request.failed_pads();
        let failed = failed.filter(|pads| {
            let count = pads.count;
            count.is_none_or(|count| count >= topology.pads(pads.node))
        });
        let pads_failed = failed.map(|pads| pads.node);
        let (airspace, closed) = (self.airspace, self.closed);
        let is_safe = |node: NodeIx| {
            topology.pads(node) > 0
                && !airspace.closes_pads(node)
                && !closed.closes_node(node)
                && Some(node) != pads_failed
        };
        self.searcher.nearest(&closed, &self.starts.ways, is_safe)
    }

    fn take_diversion(&mut self, arrival: Arrival) {
        self.take_path(arrival, Outcome::Diverted);
        let topology = self.closed.topology();
        let end = self.answer.path.nodes.last().copied();
        if let Some(node) = end.filter(|&node| topology.pads(node) > 0) {
            self.answer.warnings.push(Warning::PadAssumedFree { node });
        }
    }
}
