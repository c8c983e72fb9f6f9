//! What is kept of a plan that is flown: times count from its departure, so that it means the same in every state of the edge.

use super::assumed::Assumed;
use skyway_engine::delivery::{FlightComposition, Hold};
use skyway_engine::flight::{FlownLeg, Reservation};
use skyway_engine::itinerary::{LegFigures, Value};
use skyway_engine::network::NodeIx;
use std::sync::Arc;

/// A stay on a pad of a contingency.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct DetourStop {
    /// The leg of the contingency's flight that follows, counted from 0.
    pub(crate) before_leg: usize,
    /// When it takes off, in seconds from the plan's departure.
    pub(crate) takes_off_s: f64,
    /// Battery at landing and at take-off, as fractions.
    pub(crate) battery: [f64; 2],
}

/// How a contingency ends, and where it lands before.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct DetourEnd {
    /// When, in seconds from the plan's departure.
    pub(crate) arrives_s: f64,
    /// Battery then, as a fraction.
    pub(crate) battery: f64,
    /// True where it draws on the reserve.
    pub(crate) reserve_used: bool,
    /// Where it lands before; `None` where a store of before has kept nothing of it.
    pub(crate) stops: Option<Arc<[DetourStop]>>,
}

/// How the contingencies of a leg end; `None` where there is no way.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct LegEnds {
    pub(crate) if_closed: Option<DetourEnd>,
    pub(crate) safe: Option<DetourEnd>,
}

/// A version of a plan that is flown with times, battery and pads. All seconds count from the version's departure.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct FlownVersion {
    /// The airframe's name.
    pub(crate) airframe: Arc<str>,
    /// Its full battery, in watt hours.
    pub(crate) battery_wh: f64,
    /// The payload that was reckoned with, in kilograms.
    pub(crate) payload_kg: f64,
    /// Legs and stops with all figures. Of its contingencies only the ends are kept.
    pub(crate) composition: FlightComposition,
    /// How the contingencies of each leg end.
    pub(crate) ends: Vec<LegEnds>,
    /// True where it draws on the reserve, to reach an alternate.
    pub(crate) reserve_used: bool,
    /// Where it waits first, where it is told so.
    pub(crate) hold: Option<Hold>,
    /// The pad of the alternate that it diverts to.
    pub(crate) alternate: Option<Reservation>,
    /// Whether its pads are surely its own: no other edge gives them away.
    pub(crate) is_confirmed: bool,
    /// False where it is unknown whether the battery suffices: its levels mean nothing then.
    pub(crate) is_energy_checked: bool,
    /// What of it is a default.
    pub(crate) assumed: Assumed,
}

impl FlownVersion {
    /// Its legs and stops, departing at so many seconds.
    pub(super) fn composition_at(&self, departs_s: f64) -> FlightComposition {
        later_by(&self.composition, departs_s)
    }

    /// The pads that it takes: those of its stops, and that of the node that it diverts to.
    pub(crate) fn reservations(&self) -> Vec<Reservation> {
        let mut reservations = self.composition.reservations();
        reservations.extend(self.alternate);
        reservations
    }

    /// The legs, counted from 0, at whose ends it lands on the way.
    pub(crate) fn landings(&self) -> impl Iterator<Item = usize> + '_ {
        let stops = self.composition.plan.stops.iter();
        stops.filter_map(|stop| stop.before_leg.checked_sub(1))
    }

    /// The nodes that it stops at, in order.
    pub(crate) fn stop_nodes(&self) -> impl Iterator<Item = NodeIx> + '_ {
        self.composition.plan.stops.iter().map(|stop| stop.node)
    }

    /// The energy that its drone draws from a place on a leg to the end, in watt hours; `remaining_m` lie ahead of it.
    pub(super) fn energy_ahead_wh(&self, leg: usize, remaining_m: f64) -> f64 {
        let (plan, figures) = (&self.composition.plan, &self.composition.figures);
        let length_m = |leg: &LegFigures| leg.length_m;
        let after_m: f64 = figures.legs.iter().skip(leg + 1).map(length_m).sum();
        let leg_m = figures.legs.get(leg).map_or(0.0, length_m);
        let left = match leg_m > 0.0 {
            true => ((remaining_m - after_m) / leg_m).clamp(0.0, 1.0),
            false => 1.0,
        };
        let draws = |leg: &FlownLeg| leg.battery_before - leg.battery_after;
        let later: f64 = plan.legs.iter().skip(leg + 1).map(draws).sum();
        let own = left * plan.legs.get(leg).map_or(0.0, draws);
        // A take-off draws what is missing between its stop and its leg.
        let ahead = plan.stops.iter().filter(|stop| stop.before_leg > leg);
        let climbs = ahead.filter_map(|stop| {
            let next = plan.legs.get(stop.before_leg)?;
            Some(stop.battery_after - next.battery_before)
        });
        (own + later + climbs.sum::<f64>()) * self.battery_wh
    }
}

/// A composition so many seconds later, but for its contingencies.
pub(super) fn later_by(composition: &FlightComposition, seconds: f64) -> FlightComposition {
    let mut later = composition.clone();
    later.plan.start.at_s += seconds;
    later.began_s += seconds;
    later.deadline_s += seconds;
    later.plan.arrives_s += seconds;
    for leg in &mut later.plan.legs {
        leg.enters_s += seconds;
        leg.leaves_s += seconds;
    }
    for stop in &mut later.plan.stops {
        stop.lands_s += seconds;
        stop.takes_off_s += seconds;
    }
    let shifted = |value: Value| Value {
        arrives_s: value.arrives_s + seconds,
        ..value
    };
    later.proof.value = shifted(later.proof.value);
    later.proof.lower_bound = shifted(later.proof.lower_bound);
    later
}
