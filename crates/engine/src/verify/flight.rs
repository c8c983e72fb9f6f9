//! Checks a plan with times and battery against the world it was made for, leg by leg and stay by stay.
//!
//! Nothing here comes from the search: the plan is flown again from its start with the airframe's formulas, and every closure,
//! reservation and leg of another plan is looked at as it is stated. What is checked is that the plan can be flown and keeps every
//! rule; that none is better is not.

use super::flight_fault::{FlightFault, LegAt, StayAt};
use super::premises;
use super::separation::is_too_near;
use crate::flight::{
    Airframe, FlightPlan, FlightRules, FlightStart, FlownLeg, LegCost, Situation, Stop, StopKind,
    Vertical, WindField,
};
use crate::network::{NodeIx, SegmentIx, Topology};

/// Times this much apart, in seconds, count as equal.
const TIME_TOLERANCE_S: f64 = 1e-5;
/// Battery levels this much apart count as equal.
const BATTERY_TOLERANCE: f64 = 1e-7;
/// Lengths of a leg this much apart, in metres, count as equal.
const LENGTH_TOLERANCE_M: f64 = 1e-5;

/// What a plan is held against.
#[derive(Clone, Copy, Debug)]
pub struct FlightPremises<'a> {
    /// The network.
    pub topology: &'a Topology,
    /// The drone.
    pub airframe: &'a Airframe,
    /// Its payload, in kilograms.
    pub payload_kg: f64,
    /// The wind.
    pub wind: &'a WindField,
    /// Margins and overheads.
    pub rules: &'a FlightRules,
    /// What is in the way.
    pub situation: &'a Situation,
    /// Where the plan could begin.
    pub starts: &'a [FlightStart],
    /// Where it had to lead.
    pub destination: NodeIx,
    /// When the plan began, in seconds.
    pub began_s: f64,
    /// The latest landing, in seconds.
    pub deadline_s: f64,
    /// The least battery at every node, as a fraction.
    pub reserve: f64,
    /// Segments closed for this request alone.
    pub closed_segments: &'a [SegmentIx],
}

/// Checks that a plan can be flown as it says and keeps every rule, in a world that can be.
///
/// # Errors
/// The first thing found that does not hold; a premise that is out of its range before all else.
pub fn verify_flight(plan: &FlightPlan, premises: &FlightPremises<'_>) -> Result<(), FlightFault> {
    premises::check(plan, premises)?;
    let start = &plan.start;
    if !premises.starts.contains(start) {
        return Err(FlightFault::Start {
            node: premises.topology.node_id(start.node).to_owned(),
            at_s: start.at_s,
            level: start.battery,
        });
    }
    let vertical = Vertical::of(premises.topology, premises.rules.unknown_climb_m);
    let mut drone = Drone {
        premises,
        vertical: &vertical,
        plan,
        node: start.node,
        at_s: start.at_s,
        takes_off: false,
        battery: start.battery,
        distance_m: start.flown_m,
        energy: start.drawn,
    };
    let mut stops = plan.stops.iter().peekable();
    for (number, leg) in plan.legs.iter().enumerate() {
        let here = stops.next_if(|stop| stop.before_leg == number);
        let stands = number == 0 && start.on_ground;
        match here {
            Some(stop) => drone.stay(stop, stands)?,
            None if stands => drone.take_off(),
            None => {}
        }
        drone.takes_off = here.is_some() || stands;
        // Who has landed at the start has no exemption any more.
        let has_landed = here.is_some_and(|stop| stop.kind != StopKind::Start);
        drone.fly(number, leg, number == 0 && !has_landed)?;
    }
    if let Some(stop) = stops.next() {
        let before_leg = stop.before_leg;
        return Err(FlightFault::StayOutOfPlace { before_leg });
    }
    let has_flown = !plan.legs.is_empty() || !start.on_ground;
    drone.arrive(has_flown)
}

/// The drone on its way through the plan.
struct Drone<'a> {
    premises: &'a FlightPremises<'a>,
    vertical: &'a Vertical,
    plan: &'a FlightPlan,
    node: NodeIx,
    /// When it is there: at the crossing altitude, or on the ground before its first take-off.
    at_s: f64,
    /// Whether it takes off for its next leg.
    takes_off: bool,
    battery: f64,
    distance_m: f64,
    energy: f64,
}

impl Drone<'_> {
    fn id(&self, node: NodeIx) -> String {
        self.premises.topology.node_id(node).to_owned()
    }

    fn vertical_s(&self, node: NodeIx) -> f64 {
        self.vertical.crossing_m(node) / self.premises.airframe.vertical_speed_mps
    }

    fn take_off(&mut self) {
        let climb_m = self.vertical.crossing_m(self.node);
        let payload_kg = self.premises.payload_kg;
        let climb = self.premises.airframe.climb_energy(payload_kg, climb_m);
        self.battery -= climb;
        self.energy += climb;
        self.at_s += self.vertical_s(self.node);
    }

    fn stay(&mut self, stop: &Stop, stands: bool) -> Result<(), FlightFault> {
        let place = StayAt {
            node: self.id(stop.node),
            pad: stop.pad,
            lands_s: stop.lands_s,
        };
        if stop.node != self.node || (stop.kind == StopKind::Start && !stands) {
            return Err(FlightFault::StayElsewhere {
                place,
                drone: self.id(self.node),
            });
        }
        let lands_s = match stands {
            true => self.at_s,
            false => self.at_s + self.vertical_s(self.node),
        };
        if (stop.lands_s - lands_s).abs() > TIME_TOLERANCE_S {
            return Err(FlightFault::Landing { place, lands_s });
        }
        self.pad_is_free(stop, &place)?;
        let charged = self.level_after(stop, &place)?;
        for (stated, level) in [
            (stop.battery_before, self.battery),
            (stop.battery_after, charged),
        ] {
            if (stated - level).abs() > BATTERY_TOLERANCE {
                return Err(FlightFault::StayBattery {
                    place,
                    stated,
                    level,
                });
            }
        }
        self.battery = charged;
        self.at_s = stop.takes_off_s;
        self.take_off();
        Ok(())
    }

    /// The battery at take-off, if the stay is long enough for what it is for.
    fn level_after(&self, stop: &Stop, place: &StayAt) -> Result<f64, FlightFault> {
        let rules = self.premises.rules;
        let swap_stations = &self.premises.situation.swap_stations;
        let swaps = swap_stations.contains(&stop.node);
        let is_wrong_kind = (stop.kind == StopKind::Swap) != swaps && stop.kind != StopKind::Start;
        if is_wrong_kind {
            let place = place.clone();
            return Err(FlightFault::WrongKind { place });
        }
        let handling_s = match stop.kind {
            StopKind::Start => 0.0,
            StopKind::Charge => rules.stop_s,
            StopKind::Swap => rules.swap_s,
        };
        let stay_s = stop.takes_off_s - stop.lands_s;
        let charging_s = stay_s - handling_s;
        if charging_s < -TIME_TOLERANCE_S {
            return Err(FlightFault::StayTooShort {
                place: place.clone(),
                stay_s,
                handling_s,
            });
        }
        let frame = self.premises.airframe;
        let missing = (1.0 - self.battery) * (-charging_s.max(0.0) / frame.charge_tau_s).exp();
        Ok(match stop.kind {
            StopKind::Swap => frame.full_charge,
            StopKind::Start if swaps => self.battery,
            StopKind::Start | StopKind::Charge if self.battery > frame.full_charge => self.battery,
            StopKind::Start | StopKind::Charge => (1.0 - missing).min(frame.full_charge),
        })
    }

    fn pad_is_free(&self, stop: &Stop, place: &StayAt) -> Result<(), FlightFault> {
        let pads = self.premises.topology.pads(stop.node);
        if stop.pad >= pads {
            return Err(FlightFault::NoSuchPad {
                place: place.clone(),
                pads,
            });
        }
        let overlaps = |from_s: f64, until_s: f64| {
            from_s < stop.takes_off_s - TIME_TOLERANCE_S
                && until_s > stop.lands_s + TIME_TOLERANCE_S
        };
        let situation = self.premises.situation;
        let taken = situation.reservations.iter().find(|taken| {
            taken.node == stop.node
                && taken.pad == stop.pad
                && overlaps(taken.from_s, taken.until_s)
        });
        if let Some(taken) = taken {
            return Err(FlightFault::PadTaken {
                place: place.clone(),
                from_s: taken.from_s,
                until_s: taken.until_s,
            });
        }
        let closed = situation.closures.iter().find(|closure| {
            closure.pads.contains(&stop.node) && overlaps(closure.from_s, closure.until_s)
        });
        match closed {
            Some(closure) => Err(FlightFault::PadTaken {
                place: place.clone(),
                from_s: closure.from_s,
                until_s: closure.until_s,
            }),
            None => Ok(()),
        }
    }

    fn fly(
        &mut self,
        number: usize,
        leg: &FlownLeg,
        leaves_start: bool,
    ) -> Result<(), FlightFault> {
        let topology = self.premises.topology;
        let place = LegAt {
            leg: number,
            from: self.id(leg.from),
            to: self.id(leg.to),
            enters_s: leg.enters_s,
        };
        let ends = topology.segment(leg.segment);
        let is_segment = [(ends.from, ends.to), (ends.to, ends.from)].contains(&(leg.from, leg.to));
        if leg.from != self.node || !is_segment {
            return Err(FlightFault::LegElsewhere {
                place,
                drone: self.id(self.node),
            });
        }
        if (leg.enters_s - self.at_s).abs() > TIME_TOLERANCE_S {
            let drone_s = self.at_s;
            return Err(FlightFault::Entry { place, drone_s });
        }
        let cost = self.cost(leg).ok_or_else(|| FlightFault::Unflyable {
            place: place.clone(),
        })?;
        let leaves_s = leg.enters_s + cost.time_s;
        if (leg.leaves_s - leaves_s).abs() > TIME_TOLERANCE_S {
            return Err(FlightFault::Exit { place, leaves_s });
        }
        self.nothing_is_closed(leg, leaves_start, &place)?;
        self.keeps_apart(leg, &place)?;
        let after = self.battery - cost.energy;
        for (stated, level) in [
            (leg.battery_before, self.battery),
            (leg.battery_after, after),
        ] {
            if (stated - level).abs() > BATTERY_TOLERANCE {
                return Err(FlightFault::LegBattery {
                    place,
                    stated,
                    level,
                });
            }
        }
        if after < self.premises.reserve - BATTERY_TOLERANCE {
            return Err(FlightFault::BelowReserve {
                place,
                level: after,
                reserve: self.premises.reserve,
            });
        }
        self.node = leg.to;
        self.at_s = leg.leaves_s;
        self.battery = after;
        self.distance_m += ends.length_m;
        self.energy += cost.energy;
        Ok(())
    }

    /// What the leg takes; at the instant of a change of wind, within the tolerance, either wind will do.
    fn cost(&self, leg: &FlownLeg) -> Option<LegCost> {
        let premises = self.premises;
        let stated_s = leg.leaves_s - leg.enters_s;
        let nearby_s = [0.0, TIME_TOLERANCE_S, -TIME_TOLERANCE_S];
        let costs = nearby_s.into_iter().filter_map(|off_s| {
            let direction = (leg.from, leg.to, leg.segment);
            premises
                .airframe
                .leg(
                    premises.topology,
                    self.vertical,
                    premises.wind,
                    premises.payload_kg,
                    direction,
                    leg.enters_s + off_s,
                )
                .ok()
        });
        let off_s = |cost: &LegCost| (cost.time_s - stated_s).abs();
        costs.min_by(|one, other| off_s(one).total_cmp(&off_s(other)))
    }

    /// No closure meets the time from the start of a take-off to the end of a landing.
    fn nothing_is_closed(
        &self,
        leg: &FlownLeg,
        leaves_start: bool,
        place: &LegAt,
    ) -> Result<(), FlightFault> {
        let premises = self.premises;
        if premises.closed_segments.contains(&leg.segment) {
            let (from_s, until_s) = (f64::NEG_INFINITY, f64::INFINITY);
            let place = place.clone();
            return Err(FlightFault::Closed {
                place,
                from_s,
                until_s,
            });
        }
        let enters_s = leg.enters_s - self.vertical_s(leg.from);
        let leaves_s = leg.leaves_s + self.vertical_s(leg.to);
        for closure in &premises.situation.closures {
            // Who stands in a zone waits for its end; from what else is closed a drone that begins there is let out.
            let lets_out = leaves_start && !(self.plan.start.on_ground && closure.widened);
            let hits = closure.segments.contains(&leg.segment)
                || closure.nodes.contains(&leg.to)
                || (closure.nodes.contains(&leg.from) && !lets_out);
            let widening_s = match closure.widened {
                true => {
                    let rules = premises.rules;
                    // The longest that the drone can be in it.
                    let since_s = leaves_s - premises.began_s;
                    rules.time_margin_s + rules.time_margin_growth * since_s
                }
                false => 0.0,
            };
            let (from_s, until_s) = (closure.from_s - widening_s, closure.until_s + widening_s);
            let is_inside =
                leaves_s > from_s + TIME_TOLERANCE_S && enters_s < until_s - TIME_TOLERANCE_S;
            if hits && is_inside {
                return Err(FlightFault::Closed {
                    place: place.clone(),
                    from_s,
                    until_s,
                });
            }
        }
        Ok(())
    }

    fn keeps_apart(&self, leg: &FlownLeg, place: &LegAt) -> Result<(), FlightFault> {
        let (topology, rules) = (self.premises.topology, self.premises.rules);
        let mut others = self.premises.situation.traffic.iter();
        let near = others.find(|other| is_too_near(topology, rules, (leg, self.takes_off), other));
        match near {
            Some(other) => Err(FlightFault::Traffic {
                place: place.clone(),
                other_enters_s: other.enters_s,
                other_leaves_s: other.leaves_s,
            }),
            None => Ok(()),
        }
    }

    fn arrive(&self, has_flown: bool) -> Result<(), FlightFault> {
        let plan = self.plan;
        let destination = self.premises.destination;
        if self.node != destination {
            return Err(FlightFault::Destination {
                ends: self.id(self.node),
                destination: self.id(destination),
            });
        }
        let arrives_s = match has_flown {
            true => self.at_s + self.vertical_s(self.node),
            false => self.at_s,
        };
        let deadline_s = self.premises.deadline_s;
        if arrives_s > deadline_s + TIME_TOLERANCE_S {
            return Err(FlightFault::Late {
                arrives_s,
                deadline_s,
            });
        }
        let lengths_m = LENGTH_TOLERANCE_M * (plan.legs.len() + 1) as f64;
        let totals = [
            ("arrives_s", plan.arrives_s, arrives_s, TIME_TOLERANCE_S),
            (
                "battery_at_arrival",
                plan.battery_at_arrival,
                self.battery,
                BATTERY_TOLERANCE,
            ),
            ("distance_m", plan.distance_m, self.distance_m, lengths_m),
            ("energy", plan.energy, self.energy, BATTERY_TOLERANCE),
        ];
        for (field, stated, flown, tolerance) in totals {
            // What is not a number is not right either.
            let is_right = (stated - flown).abs() <= tolerance;
            if !is_right {
                return Err(FlightFault::Total {
                    field,
                    stated,
                    flown,
                });
            }
        }
        Ok(())
    }
}
