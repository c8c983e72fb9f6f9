//! How a drone enters a leg.

use crate::flight::{FlightPlan, StopKind};
use crate::network::NodeIx;

/// A leg that a drone may want to enter.
#[derive(Clone, Copy, Debug)]
pub(super) struct Entry {
    pub(super) segment: u32,
    pub(super) from: NodeIx,
    pub(super) to: NodeIx,
    pub(super) time_s: f64,
    pub(super) leaving: Leaving,
    /// Whether the drone takes off for it.
    pub(super) takes_off: bool,
}

impl Entry {
    /// When a plan enters its legs, and how.
    pub(super) fn all_of(plan: &FlightPlan) -> impl Iterator<Item = (f64, Self)> {
        let has_landed_first = plan
            .stops
            .first()
            .is_some_and(|stop| stop.before_leg == 0 && stop.kind != StopKind::Start);
        plan.legs.iter().enumerate().map(move |(number, leg)| {
            let leaving = match number == 0 && !has_landed_first {
                true if plan.start.on_ground => Leaving::FromTheGround,
                true => Leaving::FromTheAir,
                false => Leaving::OnItsWay,
            };
            let has_stopped = plan.stops.iter().any(|stop| stop.before_leg == number);
            let entry = Self {
                segment: leg.segment.0,
                from: leg.from,
                to: leg.to,
                time_s: leg.leaves_s - leg.enters_s,
                leaving,
                takes_off: has_stopped || leaving == Leaving::FromTheGround,
            };
            (leg.enters_s, entry)
        })
    }
}

/// How a drone comes to the node that a leg starts from, and so what of that node's closures binds it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Leaving {
    /// It has come by a leg or a stop: all of them.
    OnItsWay,
    /// Its plan begins there in the air: none of them.
    FromTheAir,
    /// Its plan begins there on the ground: zones, which it waits for.
    FromTheGround,
}
