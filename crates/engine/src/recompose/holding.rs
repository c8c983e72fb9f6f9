//! A drone on the ground inside an active zone waits on its pad until the zone ends.

use super::answer::{Outcome, Warning};
use super::plan::to_destination;
use super::recomposition::{Scratch, Task, close_for_request};
use super::request::Request;
use super::starts::{AT_NODE_WITHIN_M, Leg};
use crate::airspace::{Airspace, Change, Closed, Closure, counts_until};
use crate::flight::{Aloft, FailureType, Location, Reentry, StretchLeg};
use crate::network::NodeIx;
use crate::routing::Path;
use std::sync::Arc;

/// The node at which a drone that stands, or may stand, is inside an active zone.
pub(super) fn held_at(request: &Request, airspace: &Airspace, leg: &Leg) -> Option<NodeIx> {
    if request.circumstances.aloft == Aloft::Airborne {
        return None;
    }
    let topology = airspace.topology();
    let node = match request.report.location {
        Location::LegStart => leg.from,
        Location::Unknown => return None,
        Location::At(place) => {
            let ends = [leg.from, leg.to].into_iter();
            let off_m = |node: NodeIx| topology.position(node).distance_m(place);
            let near = ends.map(|node| (off_m(node), node));
            let at = near.filter(|(off_m, _)| *off_m <= AT_NODE_WITHIN_M);
            at.min_by(|one, other| one.0.total_cmp(&other.0))?.1
        }
    };
    let by_brought = request
        .zone
        .as_ref()
        .is_some_and(|zone| zone.hits.nodes.binary_search(&node).is_ok());
    let is_over = by_brought || zones_over(airspace, node).next().is_some();
    is_over.then_some(node)
}

/// The standing zones that close a node.
fn zones_over(airspace: &Airspace, node: NodeIx) -> impl Iterator<Item = &Arc<Closure>> {
    let closes_node = airspace.closed().closes_node(node);
    let in_force = airspace.in_force().filter(move |_| closes_node);
    in_force.filter(move |closure| {
        closure.zone().is_some() && closure.hits.nodes.binary_search(&node).is_ok()
    })
}

impl Task<'_> {
    /// Tells the drone to wait where it stands, and what it flies once the zones over it have ended.
    pub(super) fn hold(&mut self, node: NodeIx) {
        let over: Vec<Change> = zones_over(self.airspace, node)
            .map(|closure| Change::Lift(closure.id.clone()))
            .collect();
        let (now, horizon) = (self.airspace.as_of(), self.airspace.horizon());
        let ends = zones_over(self.airspace, node)
            .map(|closure| counts_until(&closure.windows, now, horizon));
        let ends: Vec<Option<jiff::Timestamp>> = ends.collect();
        let until = ends.iter().copied().flatten().max();
        let is_endless = ends.iter().any(Option::is_none) || ends.is_empty();
        self.answer
            .warnings
            .push(match until.filter(|_| !is_endless) {
                Some(until) => Warning::HoldsUntil { node, until },
                None => Warning::HoldsWithoutEnd { node },
            });
        let leg = StretchLeg {
            from: self.leg.from,
            to: self.leg.to,
            segment: self.leg.segment,
            fraction: if node == self.leg.from { 0.0 } else { 1.0 },
        };
        let place = self.closed.topology().position(node);
        let stands = Reentry::at_node(node, place, Some(leg));
        let brings = self.request.zone.is_some();
        let may_not_fly_on = self.request.report.failure == FailureType::Operational;
        let way = match is_endless || brings || may_not_fly_on {
            // What is flown then is not known.
            true => Path {
                nodes: vec![node],
                segments: Vec::new(),
            },
            false => self.way_afterwards(&over, stands),
        };
        let length_m = way.length_m(self.closed.topology());
        self.count_global_search();
        self.answer.outcome = Outcome::Hold;
        self.answer.path = way;
        self.answer.reentry = Some(stands);
        self.answer.recomposed_length_m = Some(length_m);
        self.answer.remaining_length_m = Some(length_m);
    }

    /// The way from a node once some zones have ended; the node alone where there is none.
    fn way_afterwards(&mut self, over: &[Change], stands: Reentry) -> Path {
        let node = stands.node;
        let open = self.airspace.apply(over, self.airspace.as_of());
        let mut scratch = Scratch::new(open.topology());
        let Scratch {
            searcher, closures, ..
        } = &mut scratch;
        close_for_request(self.request, &open, closures);
        let closed = Closed::new(open.topology(), open.closed(), closures);
        let destination = self.request.report.destination;
        let arrival = to_destination(&closed, &[stands], destination, None, searcher);
        let mut way = Path::default();
        match arrival {
            Some(arrival) => {
                searcher.append_way(arrival, None, &mut way);
            }
            None => way.nodes.push(node),
        }
        way
    }
}
