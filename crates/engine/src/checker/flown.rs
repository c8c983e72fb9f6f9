//! That a flight keeps its times, its battery and its pads: flown again from its start, leg by leg and stay by stay.

use super::claim::{Claim, Drone, FlightClaim, FlightSky, Need, Sky, StretchKind, Told};
use super::fault::{Fault, Place, Rule};
use super::path;
use super::timed::ClosedTime;
use crate::flight::{FlownLeg, LegCost, Stop, StopKind};
use crate::network::{NodeIx, SegmentIx};

/// Times this much apart, in seconds, count as equal: instants that were stored are rounded.
const SAME_S: f64 = 2e-3;
/// Battery levels this much apart count as equal.
const SAME_BATTERY: f64 = 1e-6;
/// Lengths this much apart, in metres, count as equal.
const SAME_M: f64 = 1e-2;

impl FlightClaim<'_> {
    /// The least battery at a node that it comes to, as a fraction.
    pub(super) fn lowest_battery(&self) -> f64 {
        let legs = self.plan.legs.iter().map(|leg| leg.battery_after);
        legs.fold(self.plan.battery_at_arrival, f64::min)
    }
}

pub(super) fn check(
    claim: &Claim<'_>,
    flight: &FlightClaim<'_>,
    drone: &Drone<'_>,
    sky: &Sky<'_>,
) -> Result<(), Fault> {
    let Some(world) = sky.flight else {
        return path::is_open(claim, sky);
    };
    begins(claim, flight, drone)?;
    let mut flyer = Flyer {
        flight,
        drone,
        sky,
        world,
        node: flight.start.node,
        at_s: flight.start.at_s,
        battery: flight.start.battery,
    };
    let mut stops = flight.plan.stops.iter().enumerate().peekable();
    for (number, leg) in flight.plan.legs.iter().enumerate() {
        let here = stops.next_if(|(_, stop)| stop.before_leg == number);
        let stands = number == 0 && flight.start.on_ground;
        match here {
            Some((place, stop)) => flyer.stay(place, stop, stands)?,
            None if stands => flyer.take_off(),
            None => {}
        }
        // Who has landed at the start has no exemption any more.
        let has_landed = here.is_some_and(|(_, stop)| stop.kind != StopKind::Start);
        flyer.fly(number, leg, number == 0 && !has_landed, claim)?;
    }
    if let Some((place, stop)) = stops.next() {
        // A hold may end where it waits.
        let waits_last = flight.plan.legs.is_empty() && stop.before_leg == 0;
        if !waits_last || stops.len() > 0 {
            return Err(Fault::new(Rule::Joins, Place::Stop(place)));
        }
        return flyer.pad_is_free(place, stop);
    }
    flyer.arrive(claim)
}

/// The figures at the start are those of the drone, and of the first stretch.
fn begins(claim: &Claim<'_>, flight: &FlightClaim<'_>, drone: &Drone<'_>) -> Result<(), Fault> {
    let start = &flight.start;
    let stretch_m = claim.stretch.map_or(0.0, |stretch| stretch.length_m);
    if claim.nodes.first() != Some(&start.node) || claim.segments.len() != flight.plan.legs.len() {
        return Err(Fault::new(Rule::Joins, Place::FirstStretch));
    }
    if (start.flown_m - stretch_m).abs() > SAME_M {
        let place = Place::FirstStretch;
        return Err(Fault::figures(
            Rule::Length,
            place,
            start.flown_m,
            stretch_m,
        ));
    }
    let is_early = start.at_s < drone.at_s - SAME_S;
    let is_on_the_spot = stretch_m > SAME_M && start.at_s <= drone.at_s;
    if is_early || is_on_the_spot || flight.began_s > start.at_s + SAME_S {
        let place = Place::FirstStretch;
        return Err(Fault::figures(Rule::Time, place, start.at_s, drone.at_s));
    }
    if start.on_ground
        && claim
            .stretch
            .is_some_and(|it| it.kind != StretchKind::None && stretch_m > SAME_M)
    {
        return Err(Fault::new(Rule::BeginsAtDrone, Place::FirstStretch));
    }
    let Some(battery) = drone.battery else {
        return Ok(());
    };
    let stated = start.battery + start.drawn;
    let draws = stretch_m <= SAME_M || start.drawn > 0.0;
    if (stated - battery).abs() > SAME_BATTERY || !draws || start.drawn < 0.0 {
        let place = Place::FirstStretch;
        return Err(Fault::figures(Rule::Battery, place, stated, battery));
    }
    Ok(())
}

/// The drone on its way through the plan.
struct Flyer<'a> {
    flight: &'a FlightClaim<'a>,
    drone: &'a Drone<'a>,
    sky: &'a Sky<'a>,
    world: &'a FlightSky<'a>,
    node: NodeIx,
    /// When it is there: at the crossing altitude, or on the ground before its first take-off.
    at_s: f64,
    battery: f64,
}

fn same(rule: Rule, place: Place, stated: f64, found: f64, tolerance: f64) -> Result<(), Fault> {
    match (stated - found).abs() <= tolerance {
        true => Ok(()),
        false => Err(Fault::figures(rule, place, stated, found)),
    }
}

impl Flyer<'_> {
    fn take_off(&mut self) {
        self.battery -= self.world.legs.climb_energy(self.node);
        self.at_s += self.world.legs.vertical_s(self.node);
    }

    fn stay(&mut self, number: usize, stop: &Stop, stands: bool) -> Result<(), Fault> {
        let place = Place::Stop(number);
        if stop.node != self.node || (stop.kind == StopKind::Start && !stands) {
            return Err(Fault::new(Rule::Joins, place));
        }
        let lands_s = match stands {
            true => self.at_s,
            false => self.at_s + self.world.legs.vertical_s(self.node),
        };
        same(Rule::Time, place, stop.lands_s, lands_s, SAME_S)?;
        self.pad_is_free(number, stop)?;
        let level = self.level_after(stop, place)?;
        let (before, after) = (stop.battery_before, stop.battery_after);
        same(Rule::Battery, place, before, self.battery, SAME_BATTERY)?;
        same(Rule::Battery, place, after, level, SAME_BATTERY)?;
        self.battery = level;
        self.at_s = stop.takes_off_s;
        self.take_off();
        Ok(())
    }

    /// The battery at take-off, if the stay is long enough for what it is for.
    fn level_after(&self, stop: &Stop, place: Place) -> Result<f64, Fault> {
        let swaps = (self.world.swaps)(stop.node);
        let is_start = stop.kind == StopKind::Start;
        if !is_start && (stop.kind == StopKind::Swap) != swaps {
            return Err(Fault::new(Rule::Pad, place));
        }
        let rules = self.world.rules;
        let handling_s = match stop.kind {
            StopKind::Start => 0.0,
            StopKind::Charge => rules.stop_s,
            StopKind::Swap => rules.swap_s,
        };
        let charging_s = stop.takes_off_s - stop.lands_s - handling_s;
        if charging_s < -SAME_S {
            let stay_s = stop.takes_off_s - stop.lands_s;
            return Err(Fault::figures(Rule::Time, place, stay_s, handling_s));
        }
        let frame = self.world.airframe;
        let is_full = self.battery > frame.full_charge;
        Ok(match stop.kind {
            StopKind::Swap => frame.full_charge,
            StopKind::Start if swaps || is_full => self.battery,
            StopKind::Charge if is_full => self.battery,
            StopKind::Start | StopKind::Charge => {
                let missing =
                    (1.0 - self.battery) * (-charging_s.max(0.0) / frame.charge_tau_s).exp();
                (1.0 - missing).min(frame.full_charge)
            }
        })
    }

    /// The pad is there, open and no other drone's. A drone on the ground keeps its pad against every reservation.
    fn pad_is_free(&self, number: usize, stop: &Stop) -> Result<(), Fault> {
        let place = Place::Stop(number);
        let pads = self.sky.airspace.topology().pads(stop.node);
        if stop.pad >= pads {
            let (stated, found) = (f64::from(stop.pad), f64::from(pads));
            return Err(Fault::figures(Rule::Pad, place, stated, found));
        }
        if stop.kind == StopKind::Start && self.drone.stands_at == Some(stop.node) {
            return Ok(());
        }
        let overlaps = |time: &ClosedTime| {
            time.from_s < stop.takes_off_s - SAME_S && time.until_s > stop.lands_s + SAME_S
        };
        let mut closed = self.world.closed.of_pads(stop.node);
        let is_closed = self.sky.own.pads == Some(stop.node) || closed.any(overlaps);
        let is_taken = (self.world.is_taken)(
            stop.node,
            stop.pad,
            stop.lands_s + SAME_S,
            stop.takes_off_s - SAME_S,
        );
        match is_closed || is_taken {
            true => Err(Fault::new(Rule::Pad, place)),
            false => Ok(()),
        }
    }

    fn fly(
        &mut self,
        number: usize,
        leg: &FlownLeg,
        leaves_start: bool,
        claim: &Claim<'_>,
    ) -> Result<(), Fault> {
        let place = Place::Leg(number, leg.segment);
        let (segment, to) = (claim.segments.get(number), claim.nodes.get(number + 1));
        if leg.from != self.node || segment != Some(&leg.segment) || to != Some(&leg.to) {
            return Err(Fault::new(Rule::Joins, place));
        }
        same(Rule::Time, place, leg.enters_s, self.at_s, SAME_S)?;
        let stated_s = leg.leaves_s - leg.enters_s;
        let cost = self.cost(leg, stated_s);
        if !cost.is_flyable() {
            return Err(Fault::new(Rule::Time, place));
        }
        same(Rule::Time, place, stated_s, cost.time_s, SAME_S)?;
        let after = self.battery - cost.energy;
        same(
            Rule::Battery,
            place,
            leg.battery_before,
            self.battery,
            SAME_BATTERY,
        )?;
        same(Rule::Battery, place, leg.battery_after, after, SAME_BATTERY)?;
        self.keeps_reserve(claim, place, after)?;
        self.nothing_is_closed(number, leg, leaves_start)?;
        self.node = leg.to;
        self.at_s = leg.leaves_s;
        self.battery = after;
        Ok(())
    }

    /// The reserve may be drawn on only to land elsewhere, and the floor only by who has to come down.
    fn keeps_reserve(&self, claim: &Claim<'_>, place: Place, level: f64) -> Result<(), Fault> {
        let rules = self.world.rules;
        let least = match (claim.told, self.drone.need) {
            // What is left is unknown: it lands whatever that is.
            (Told::Diverted, Need::Ground | Need::Pad { shown: false }) => f64::NEG_INFINITY,
            (Told::Diverted, _) => rules.floor,
            _ => rules.reserve,
        };
        match self.flight.is_energy_checked && level < least - SAME_BATTERY {
            true => Err(Fault::figures(Rule::Reserve, place, level, least)),
            false => Ok(()),
        }
    }

    /// What the leg takes; near a change of wind either wind will do.
    fn cost(&self, leg: &FlownLeg, stated_s: f64) -> LegCost {
        let legs = self.world.legs;
        let mut there = legs.from(leg.from).filter(|&row| {
            let row = legs.leg(row);
            row.segment == leg.segment && row.to == leg.to
        });
        let Some(row) = there.next() else {
            return LegCost::UNFLYABLE;
        };
        let changes_s = legs.changes_s();
        let period = |at_s: f64| changes_s.partition_point(|&change_s| change_s <= at_s);
        let here = legs.cost(row, period(leg.enters_s));
        if changes_s.is_empty() || (here.time_s - stated_s).abs() <= SAME_S {
            return here;
        }
        let beside = [-SAME_S, SAME_S].map(|off_s| legs.cost(row, period(leg.enters_s + off_s)));
        let off_s = |cost: &LegCost| (cost.time_s - stated_s).abs();
        match off_s(&beside[0]) < off_s(&beside[1]) {
            true => beside[0],
            false => beside[1],
        }
    }

    /// No closure meets the time from the start of a take-off to the end of a landing.
    fn nothing_is_closed(
        &self,
        number: usize,
        leg: &FlownLeg,
        leaves_start: bool,
    ) -> Result<(), Fault> {
        let closed = self.world.closed;
        let closed_segment = Fault::new(Rule::ClosedSegment, Place::Leg(number, leg.segment));
        if self.sky.own.segment == Some(leg.segment) {
            return Err(closed_segment);
        }
        if closed
            .of_segment(leg.segment)
            .any(|time| self.meets(leg, time))
        {
            return Err(closed_segment);
        }
        let mut nodes = closed.of_node(leg.to);
        if nodes.any(|time| self.meets(leg, time)) {
            return Err(Fault::new(Rule::ClosedNode, Place::Node(leg.to)));
        }
        // Who stands on a pad in a zone stays until it is over; anything else that closes its node lets it go.
        let stands = leaves_start && self.drone.stands_at == Some(leg.from);
        let binds = |time: &ClosedTime| !leaves_start || (stands && time.widened);
        let mut left = closed.of_node(leg.from);
        if left.any(|time| binds(time) && self.meets(leg, time)) {
            let rule = if stands {
                Rule::SentUp
            } else {
                Rule::ClosedNode
            };
            return Err(Fault::new(rule, Place::Node(leg.from)));
        }
        self.passes_brought_zone(number, leg, leaves_start)
    }

    fn passes_brought_zone(
        &self,
        number: usize,
        leg: &FlownLeg,
        leaves_start: bool,
    ) -> Result<(), Fault> {
        let Some((zone, hits)) = self.sky.own.zone else {
            return Ok(());
        };
        let closes_segment = |segment: SegmentIx| hits.segments.binary_search(&segment).is_ok();
        let closes_node = |node: NodeIx| hits.nodes.binary_search(&node).is_ok();
        let is_hit = closes_segment(leg.segment)
            || closes_node(leg.to)
            || (!leaves_start && closes_node(leg.from));
        let times = self.world.closed.of_windows(zone.windows(), true);
        match is_hit && times.iter().any(|time| self.meets(leg, time)) {
            true => Err(Fault::new(
                Rule::ClosedSegment,
                Place::Leg(number, leg.segment),
            )),
            false => Ok(()),
        }
    }

    /// Whether the drone is on the leg while something is closed; windows of zones are widened at both ends by a margin that
    /// grows with the time flown until then.
    fn meets(&self, leg: &FlownLeg, time: &ClosedTime) -> bool {
        let legs = self.world.legs;
        let enters_s = leg.enters_s - legs.vertical_s(leg.from);
        let leaves_s = leg.leaves_s + legs.vertical_s(leg.to);
        let margin_s = |at_s: f64| match time.widened {
            true => {
                let rules = self.world.rules;
                let flown_s = (at_s - self.flight.began_s).max(0.0);
                rules.time_margin_s + rules.time_margin_growth * flown_s
            }
            false => 0.0,
        };
        // The widening is greatest where the drone leaves, for what begins, and least where it enters, for what has ended.
        let (begins, ends) = (
            leaves_s + margin_s(leg.leaves_s),
            enters_s - margin_s(leg.enters_s),
        );
        begins > time.from_s + SAME_S && ends < time.until_s - SAME_S
    }

    fn arrive(&self, claim: &Claim<'_>) -> Result<(), Fault> {
        let plan = self.flight.plan;
        let place = Place::Node(self.node);
        let has_flown = !plan.legs.is_empty() || !self.flight.start.on_ground;
        let lands_s = match has_flown {
            true => self.at_s + self.world.legs.vertical_s(self.node),
            false => self.at_s,
        };
        same(Rule::Time, place, plan.arrives_s, lands_s, SAME_S)?;
        same(
            Rule::Battery,
            place,
            plan.battery_at_arrival,
            self.battery,
            SAME_BATTERY,
        )?;
        if claim.told == Told::Diverted && self.drone.need != Need::Ground {
            return self.finds_a_pad(place);
        }
        Ok(())
    }

    /// Who lands elsewhere has a pad there.
    fn finds_a_pad(&self, place: Place) -> Result<(), Fault> {
        let pads = self.sky.airspace.topology().pads(self.node);
        let keeps_its_own = self.drone.stands_at == Some(self.node);
        let lands_s = self.flight.plan.arrives_s;
        let mut closed = self.world.closed.of_pads(self.node);
        let is_closed = closed.any(|time| time.from_s < lands_s && time.until_s > lands_s + SAME_S);
        let has_one = match self.flight.alternate {
            Some(alternate) => {
                let is_there = alternate.node == self.node && alternate.pad < pads;
                let (from_s, until_s) = (alternate.from_s + SAME_S, alternate.until_s - SAME_S);
                is_there && !(self.world.is_taken)(self.node, alternate.pad, from_s, until_s)
            }
            None => {
                let from_s = self.flight.plan.arrives_s;
                (0..pads).any(|pad| !(self.world.is_taken)(self.node, pad, from_s, from_s + 1.0))
            }
        };
        match (has_one && !is_closed) || keeps_its_own {
            true => Ok(()),
            false => Err(Fault::new(Rule::Pad, place)),
        }
    }
}
