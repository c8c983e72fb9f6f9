//! What a plan amounts to, for people and for the wire: speeds, energy in watt hours, waiting, cost.

use super::setting::FlightSetting;
use crate::flight::{FlightPlan, Stop, StopKind, Tariff};

/// Less is the rounding of its instants, in seconds.
const LEAST_WAIT_S: f64 = 1e-6;

/// A leg of a plan in numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LegFigures {
    /// Metres, as the network states them.
    pub length_m: f64,
    /// Seconds from crossing altitude to crossing altitude.
    pub time_s: f64,
    /// The airspeed of the model; where a limit on the ground speed binds, an upper bound.
    pub airspeed_mps: f64,
    /// Metres of the segment per second of the leg, changes of altitude included.
    pub ground_speed_mps: f64,
    /// Energy drawn, in watt hours.
    pub energy_wh: f64,
}

/// A stay of a plan in numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StopFigures {
    /// Seconds on the pad.
    pub stay_s: f64,
    /// What the stay adds to the battery, as a fraction.
    pub charged: f64,
    /// Seconds of the stay that neither handling nor the charge up to the next stop takes: waiting for a window, a pad, a wind or
    /// another plan.
    pub waits_s: f64,
}

/// A plan in numbers.
#[derive(Clone, Debug, PartialEq)]
pub struct PlanFigures {
    /// By leg.
    pub legs: Vec<LegFigures>,
    /// By stay.
    pub stops: Vec<StopFigures>,
    /// Metres flown, those before the start included.
    pub distance_m: f64,
    /// Seconds from the start of the plan to the landing.
    pub time_s: f64,
    /// Energy drawn, in watt hours, that before the start and the climbs of take-offs included.
    pub energy_wh: f64,
    /// By the tariff, in US dollars.
    pub cost_usd: f64,
}

impl FlightSetting {
    /// What a plan amounts to; `began_s` and `reserve` are those of its request.
    pub fn figures(
        &self,
        plan: &FlightPlan,
        began_s: f64,
        reserve: f64,
        tariff: Tariff,
    ) -> PlanFigures {
        let battery_wh = self.airframe().battery_wh;
        let legs = plan.legs.iter().map(|leg| {
            let length_m = self.topology().segment(leg.segment).length_m;
            let time_s = leg.leaves_s - leg.enters_s;
            LegFigures {
                length_m,
                time_s,
                airspeed_mps: self.airframe().airspeed_mps,
                ground_speed_mps: length_m / time_s,
                energy_wh: (leg.battery_before - leg.battery_after) * battery_wh,
            }
        });
        let stops = 0..plan.stops.len();
        PlanFigures {
            legs: legs.collect(),
            stops: stops
                .map(|place| self.stop_figures(plan, place, reserve))
                .collect(),
            distance_m: plan.distance_m,
            time_s: plan.arrives_s - began_s,
            energy_wh: plan.energy * battery_wh,
            cost_usd: tariff.cost_usd(self.payload_kg(), plan.distance_m),
        }
    }

    fn stop_figures(&self, plan: &FlightPlan, place: usize, reserve: f64) -> StopFigures {
        let stop = &plan.stops[place];
        let stay_s = stop.takes_off_s - stop.lands_s;
        let charged = stop.battery_after - stop.battery_before;
        let needed_s = self.needed_stay_s(plan, stop, place, reserve);
        let waits_s = stay_s - needed_s;
        StopFigures {
            stay_s,
            charged,
            waits_s: if waits_s < LEAST_WAIT_S { 0.0 } else { waits_s },
        }
    }

    /// Seconds that a stay has to take: for what is served, and for the flight up to the next stop or the end.
    fn needed_stay_s(&self, plan: &FlightPlan, stop: &Stop, place: usize, reserve: f64) -> f64 {
        let rules = self.rules();
        let service_s = stop.service_s.unwrap_or(0.0);
        if stop.kind == StopKind::Swap {
            return rules.swap_s.max(service_s);
        }
        let next = plan.stops.get(place + 1);
        let end = next.map_or(plan.legs.len(), |next| next.before_leg);
        let flown = plan.legs.get(stop.before_leg..end).unwrap_or_default();
        let lowest = flown.last().map_or(0.0, |leg| leg.battery_after);
        let needed = reserve + stop.battery_after - lowest;
        let charging = self.airframe().charging();
        let charging_s = charging.time_s(stop.battery_before, needed.min(charging.full));
        let handling_s = match stop.kind {
            StopKind::Charge => rules.stop_s,
            StopKind::Start | StopKind::Swap => 0.0,
        };
        (handling_s + charging_s.unwrap_or(0.0)).max(service_s)
    }
}
