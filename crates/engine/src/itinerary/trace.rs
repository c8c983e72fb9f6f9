//! From the steps of a search to a plan with times: every departure as early as the next thing needs it.

use super::expander::Expander;
use super::label::How;
use super::request::{TIME_TOLERANCE_S, Value};
use crate::flight::{FlightPlan, FlownLeg, LegCost, Stop, StopKind};
use crate::network::NodeIx;

/// A step that has its times.
struct Timed {
    leg: u32,
    cost: LegCost,
    enters_s: f64,
}

/// The plan of some steps that land as a value says.
pub(super) fn plan(terms: &Expander<'_>, steps: &[How], value: Value) -> FlightPlan {
    let legs = terms.world.legs;
    let start_number = match steps.first() {
        Some(&How::Start(number)) => usize::from(number),
        _ => 0,
    };
    let start = &terms.request.starts[start_number];
    let flies = steps.iter().any(|how| !matches!(how, How::Start(_)));
    let landing_s = match flies || !start.on_ground {
        true => legs.vertical_s(terms.request.destination),
        false => 0.0,
    };
    let timed = entries(terms, steps, value.arrives_s - landing_s);
    let mut plan = FlightPlan {
        start: *start,
        legs: Vec::with_capacity(timed.len()),
        stops: Vec::new(),
        arrives_s: value.arrives_s,
        battery_at_arrival: start.battery,
        distance_m: start.flown_m,
        energy: start.drawn,
    };
    let mut node = start.node;
    let mut timed = timed.into_iter().peekable();
    for (place, &how) in steps.iter().enumerate() {
        match how {
            How::Start(_) if !start.on_ground => {}
            How::Start(_) | How::Stop { .. } => {
                // A battery that is swapped where the plan begins takes one stay, not two.
                let is_swapped_at_once = matches!(steps.get(place + 1), Some(How::Stop { .. }));
                if let Some(next) = timed.peek()
                    && !is_swapped_at_once
                {
                    let arrived_s = match how {
                        How::Stop { arrived_s } => Some(arrived_s),
                        How::Start(_) | How::Leg { .. } => None,
                    };
                    stay(terms, node, arrived_s, start.at_s, next.enters_s, &mut plan);
                }
            }
            How::Leg { .. } => {
                let Some(next) = timed.next() else {
                    continue;
                };
                node = fly(terms, node, &next, &mut plan);
            }
        }
    }
    plan
}

/// The legs with their entry times: backwards from the next stop, or from the landing.
fn entries(terms: &Expander<'_>, steps: &[How], arrives_s: f64) -> Vec<Timed> {
    let mut entries = Vec::with_capacity(steps.len());
    let mut leaves_s = arrives_s;
    for &how in steps.iter().rev() {
        match how {
            How::Start(_) => {}
            How::Stop { arrived_s } => leaves_s = arrived_s,
            How::Leg { leg, period } => {
                let cost = terms.world.legs.cost(leg, usize::from(period));
                leaves_s -= cost.time_s;
                entries.push(Timed {
                    leg,
                    cost,
                    enters_s: leaves_s,
                });
            }
        }
    }
    entries.reverse();
    entries
}

fn fly(terms: &Expander<'_>, from: NodeIx, timed: &Timed, plan: &mut FlightPlan) -> NodeIx {
    let leg = terms.world.legs.leg(timed.leg);
    let battery_before = plan.battery_at_arrival;
    plan.battery_at_arrival -= timed.cost.energy;
    plan.energy += timed.cost.energy;
    plan.distance_m += leg.length_m;
    plan.legs.push(FlownLeg {
        from,
        to: leg.to,
        segment: leg.segment,
        enters_s: timed.enters_s,
        leaves_s: timed.enters_s + timed.cost.time_s,
        battery_before,
        battery_after: plan.battery_at_arrival,
    });
    leg.to
}

/// A stay on a pad, or where the plan begins a take-off from a node without one.
fn stay(
    terms: &Expander<'_>,
    node: NodeIx,
    arrived_s: Option<f64>,
    began_s: f64,
    enters_s: f64,
    plan: &mut FlightPlan,
) {
    let world = terms.world;
    let vertical_s = world.legs.vertical_s(node);
    let lands_s = arrived_s.map_or(began_s, |arrived_s| arrived_s + vertical_s);
    let takes_off_s = (enters_s - vertical_s).max(lands_s);
    let swaps = world.pads.swaps(node);
    let kind = match (arrived_s, swaps) {
        (None, _) => StopKind::Start,
        (Some(_), true) => StopKind::Swap,
        (Some(_), false) => StopKind::Charge,
    };
    let battery_before = plan.battery_at_arrival;
    let charging = world.charging;
    let stay_s = takes_off_s - lands_s;
    let charge = |time_s: f64| charging.level_after(battery_before, time_s.max(0.0));
    let own = plan.start.pad.filter(|_| arrived_s.is_none());
    let own = own.filter(|&pad| world.pads.is_free((node, pad), lands_s, takes_off_s));
    let pad = own.or_else(|| world.pads.free_pad(node, lands_s, takes_off_s));
    let battery_after = match kind {
        StopKind::Swap => charging.full,
        StopKind::Charge => charge(stay_s - world.rules.stop_s),
        StopKind::Start if swaps || pad.is_none() => battery_before,
        StopKind::Start => charge(stay_s),
    };
    let climb = world.legs.climb_energy(node);
    plan.battery_at_arrival = battery_after - climb;
    plan.energy += climb;
    // Who takes off at once has needed no pad.
    let is_stay = kind != StopKind::Start || stay_s > TIME_TOLERANCE_S;
    if let Some(pad) = pad.filter(|_| is_stay) {
        plan.stops.push(Stop {
            kind,
            before_leg: plan.legs.len(),
            node,
            pad,
            lands_s,
            takes_off_s,
            battery_before,
            battery_after,
            service_s: None,
        });
    }
}
