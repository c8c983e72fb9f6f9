//! What opens where, and when.

use super::expander::Expander;
use super::request::{Objective, Value};
use crate::geo::Point;
use crate::network::NodeIx;

/// Lengths are rounded in the table of legs; straight lines are shortened by this, in metres, to
/// stay below them.
pub(super) const ROUNDING_M: f64 = 1e-3;
/// Sums of times in another order differ by less than this, in seconds.
pub(super) const ROUNDING_S: f64 = 1e-3;
/// Something opens at a node: a leg from it, a pad, or everything where the wind changes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Opening {
    /// Who is there at this instant or before finds it open, too; minus infinity for pads and the
    /// wind.
    pub(super) shuts_s: f64,
    pub(super) at_s: f64,
    /// `None` for everywhere.
    pub(super) there: Option<There>,
}

/// Where something opens.
#[derive(Clone, Copy, Debug)]
pub(super) struct There {
    pub(super) place: Point,
    /// What is left from there at least.
    pub(super) weight: f64,
    pub(super) time_s: f64,
    pub(super) energy: f64,
    /// What a stop there takes at least, in seconds; 0 for a leg.
    pub(super) stop_s: f64,
}

/// A node at which something may open.
pub(super) struct At {
    pub(super) node: NodeIx,
    pub(super) is_start: bool,
    /// Nobody is there earlier.
    pub(super) earliest_s: f64,
    /// Until then all that opens is known.
    pub(super) known_until_s: f64,
    /// Of no use later, for a stop of no time.
    latest_s: f64,
    there: There,
}

impl At {
    /// `None` where nothing better could come by the node.
    pub(super) fn of(
        terms: &Expander<'_>,
        best: Value,
        node: NodeIx,
        known_until_s: f64,
    ) -> Option<Self> {
        let request = terms.request;
        if !may_lead_on(terms, best, node) {
            return None;
        }
        let there = there(terms, node);
        let by_s = request.starts.iter().map(|start| {
            let straight_m = terms
                .world
                .topology
                .position(start.node)
                .distance_m(there.place);
            start.at_s + (straight_m - ROUNDING_M).max(0.0) / terms.world.legs.fastest_mps()
        });
        let latest_s = request.deadline_s.min(match request.objective {
            Objective::Time => best.arrives_s,
            Objective::Distance | Objective::Energy => f64::INFINITY,
        });
        Some(Self {
            node,
            is_start: request.starts.iter().any(|start| start.node == node),
            earliest_s: by_s.fold(f64::INFINITY, f64::min),
            known_until_s,
            latest_s: latest_s - there.time_s,
            there,
        })
    }

    /// An opening that can be reached before the deadline.
    pub(super) fn opening(&self, (shuts_s, at_s): (f64, f64), stop_s: f64) -> Option<Opening> {
        let is_known = at_s.is_finite() && at_s <= self.known_until_s;
        let is_in_time = is_known && at_s + stop_s <= self.latest_s;
        (is_in_time && self.earliest_s <= at_s).then_some(Opening {
            shuts_s,
            at_s,
            there: Some(There {
                stop_s,
                ..self.there
            }),
        })
    }
}

/// A node with what is left from there at least.
pub(super) fn there(terms: &Expander<'_>, node: NodeIx) -> There {
    let remaining = terms.potentials.from(node);
    There {
        place: terms.world.topology.position(node),
        weight: remaining.weight,
        time_s: remaining.time_s,
        energy: remaining.energy,
        stop_s: 0.0,
    }
}

/// True where something better could come by a node: by the straight line from a start and the
/// tables.
fn may_lead_on(terms: &Expander<'_>, best: Value, node: NodeIx) -> bool {
    let remaining = terms.potentials.from(node);
    let place = terms.world.topology.position(node);
    terms.request.starts.iter().any(|start| {
        let straight_m = terms.world.topology.position(start.node).distance_m(place) - ROUNDING_M;
        straight_m * terms.weight_per_m() + remaining.weight <= best.weight
    })
}
