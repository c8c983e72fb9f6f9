//! Flying a version of a plan by its times: where the drone is, and what is left in its battery.

use super::map::Map;
use crate::geo::Point;
use crate::wire;
use jiff::{SignedDuration, Timestamp};
use std::collections::BTreeMap;

/// What a metre takes of a battery where a plan tells no energy: 3.95 Wh/km of 68.1 Wh, a DJI Phantom 3
/// without payload at 16 m/s.
const BATTERY_PER_M: f64 = 3.95e-3 / 68.1;
/// And a second in the air on the spot: as much as flying on.
const BATTERY_PER_S: f64 = BATTERY_PER_M * 16.0;

/// What a drone does from one instant of its plan to the next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Doing {
    /// On its way to the first node of the path.
    Stretch,
    /// On a leg, counted from 0.
    Leg(u32),
    /// On a pad.
    Pad,
}

/// An instant of a plan.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Knot {
    at: Timestamp,
    place: Point,
    battery: f64,
    /// What begins here.
    doing: Doing,
}

/// A version of a plan that is flown.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Flight {
    /// In the order of time; the last is the end.
    knots: Vec<Knot>,
    /// By how much the drone is later than its plan.
    delay: SignedDuration,
    /// What hovering has drawn.
    hovered: f64,
    /// Whether it begins on the ground.
    takes_off: bool,
    /// The node at the end, by the map.
    end: usize,
}

impl Flight {
    /// A flight from a place with a battery by a version; `None` where the map does not have its nodes, or
    /// its times cannot be read.
    pub(super) fn along(
        map: &Map,
        (from, battery): (Point, f64),
        version: &wire::PlanVersion<'static>,
    ) -> Option<Self> {
        let end = map.node(version.path.nodes.last()?)?;
        let stops = version.flight.as_ref().map(|flight| &flight.stops[..]);
        let mut before: BTreeMap<u32, Vec<&wire::Stop<'static>>> = BTreeMap::new();
        for stop in stops.unwrap_or_default() {
            before.entry(stop.before_leg).or_default().push(stop);
        }
        let holds = version.outcome == "hold" && version.legs.is_empty();
        let mut knots = vec![Knot {
            at: instant(&version.departs_at)?,
            place: from,
            battery,
            doing: if holds { Doing::Pad } else { Doing::Stretch },
        }];
        for (number, leg) in (0..).zip(&version.legs) {
            for stop in before.remove(&number).unwrap_or_default() {
                rest(&mut knots, map, stop)?;
            }
            let ends = [map.node(&leg.from)?, map.node(&leg.to)?].map(|node| map.position(node));
            let flown = leg.flight.as_ref();
            let drawn = flown.map_or(leg.length_m * BATTERY_PER_M, |flown| {
                flown.battery_before_fraction - flown.battery_after_fraction
            });
            let times = [instant(&leg.departs_at)?, instant(&leg.arrives_at)?];
            add(&mut knots, times[0], ends[0], 0.0, Doing::Leg(number));
            add(&mut knots, times[1], ends[1], -drawn, Doing::Stretch);
        }
        for stop in before.into_values().flatten() {
            rest(&mut knots, map, stop)?;
        }
        // One that holds without a way on is told when there is one.
        let arrives_at = match holds {
            true => Timestamp::MAX,
            false => instant(&version.arrives_at)?,
        };
        add(&mut knots, arrives_at, map.position(end), 0.0, Doing::Pad);
        Some(Self {
            knots,
            delay: SignedDuration::ZERO,
            hovered: 0.0,
            takes_off: false,
            end,
        })
    }

    /// Begins on the ground: at an instant where that is later than planned, as the plan was told late.
    pub(super) fn take_off_at(&mut self, now: Timestamp) {
        self.takes_off = true;
        let late = self.knots.first().map(|first| first.at.duration_until(now));
        self.delay = late.unwrap_or_default().max(SignedDuration::ZERO);
    }

    /// Waits on the spot, in the air or on a pad: all that is left happens that much later.
    pub(super) fn wait(&mut self, now: Timestamp, time: SignedDuration) {
        if !self.is_on_pad(now) {
            self.hovered += time.as_secs_f64() * BATTERY_PER_S;
        }
        self.delay += time;
    }

    /// True once it has begun.
    pub(super) fn has_begun(&self, now: Timestamp) -> bool {
        self.knots
            .first()
            .is_none_or(|first| first.at.duration_until(now) >= self.delay)
    }

    /// True at the end of the path.
    pub(super) fn is_over(&self, now: Timestamp) -> bool {
        self.knots
            .last()
            .is_none_or(|end| end.at.duration_until(now) >= self.delay)
    }

    /// The node at the end, by the map.
    pub(super) fn end(&self) -> usize {
        self.end
    }

    /// When a share of the flight is over.
    pub(super) fn after(&self, share: f64) -> Timestamp {
        let (Some(first), Some(last)) = (self.knots.first(), self.knots.last()) else {
            return Timestamp::MAX;
        };
        let whole_s = first.at.duration_until(last.at).as_secs_f64();
        let after = SignedDuration::from_millis((whole_s * share * 1e3) as i64);
        first.at.saturating_add(after).unwrap_or(Timestamp::MAX)
    }

    pub(super) fn place(&self, now: Timestamp) -> Point {
        let (from, to, share) = self.part(now);
        from.place.towards(to.place, share)
    }

    /// What is in the battery, from 0 to 1.
    pub(super) fn battery(&self, now: Timestamp) -> f64 {
        let (from, to, share) = self.part(now);
        let planned = match to.battery > from.battery && from.doing == Doing::Pad {
            // What is missing falls off exponentially while a battery is charged.
            true => {
                let (missing, left) = (1.0 - from.battery, 1.0 - to.battery);
                1.0 - missing * (left / missing).powf(share)
            }
            false => from.battery + (to.battery - from.battery) * share,
        };
        (planned - self.hovered).clamp(0.0, 1.0)
    }

    /// Whether the drone stands on a pad.
    pub(super) fn is_on_pad(&self, now: Timestamp) -> bool {
        (self.takes_off && !self.has_begun(now)) || self.part(now).0.doing == Doing::Pad
    }

    /// Metres per second over ground.
    pub(super) fn ground_speed_mps(&self, now: Timestamp) -> f64 {
        let (from, to, _) = self.part(now);
        let seconds = from.at.duration_until(to.at).as_secs_f64();
        match seconds > 0.0 {
            true => from.place.distance_m(to.place) / seconds,
            false => 0.0,
        }
    }

    /// Course over ground in degrees, clockwise from north; `None` on the spot.
    pub(super) fn heading_deg(&self, now: Timestamp) -> Option<f64> {
        let (from, to, _) = self.part(now);
        let (east, north) = (to.place.x - from.place.x, to.place.y - from.place.y);
        let moves = from.place != to.place;
        moves.then(|| east.atan2(north).to_degrees().rem_euclid(360.0))
    }

    /// Which leg of the path is being flown, counted from 0; `None` elsewhere.
    pub(super) fn leg(&self, now: Timestamp) -> Option<u32> {
        match self.part(now).0.doing {
            Doing::Leg(leg) => Some(leg),
            Doing::Stretch | Doing::Pad => None,
        }
    }

    /// The knots before and after an instant, and the share of the time between them that is over.
    fn part(&self, now: Timestamp) -> (Knot, Knot, f64) {
        let now = now.saturating_sub(self.delay).unwrap_or(now);
        let next = self.knots.partition_point(|knot| knot.at <= now);
        let from = self.knots[next.saturating_sub(1)];
        let to = self.knots[next.min(self.knots.len() - 1)];
        let whole_s = from.at.duration_until(to.at).as_secs_f64();
        let share = match whole_s > 0.0 {
            true => (from.at.duration_until(now).as_secs_f64() / whole_s).clamp(0.0, 1.0),
            false => 0.0,
        };
        (from, to, share)
    }
}

/// Adds a stay on a pad.
fn rest(knots: &mut Vec<Knot>, map: &Map, stop: &wire::Stop<'static>) -> Option<()> {
    let place = map.position(map.node(&stop.node)?);
    add(knots, instant(&stop.lands_at)?, place, 0.0, Doing::Pad);
    let charged = stop.battery_after_fraction - knots.last()?.battery;
    let until = instant(&stop.takes_off_at)?;
    add(knots, until, place, charged.max(0.0), Doing::Stretch);
    Some(())
}

/// Adds an instant, never before the last, with what the battery gains until then.
fn add(knots: &mut Vec<Knot>, at: Timestamp, place: Point, gained: f64, doing: Doing) {
    let last = knots
        .last()
        .map_or((at, 0.0), |last| (last.at, last.battery));
    knots.push(Knot {
        at: at.max(last.0),
        place,
        battery: last.1 + gained,
        doing,
    });
}

fn instant(text: &str) -> Option<Timestamp> {
    text.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::demo::map::tests::network;
    use serde_json::{Value, json};

    fn at(second: i64) -> Timestamp {
        Timestamp::from_second(1_800_000_000 + second).expect("an instant")
    }

    fn leg(from: i64, to: i64, times: [i64; 2], battery: Option<[f64; 2]>) -> Value {
        let flight = battery.map(|[before, after]| {
            json!({
                "service_id": "s", "time_s": 10.0, "airspeed_mps": 16.0, "ground_speed_mps": 10.0,
                "energy_wh": 1.0, "battery_before_fraction": before, "battery_after_fraction": after,
                "payload_kg": 0.0, "cost_usd": 0.0,
            })
        });
        let mut leg = json!({
            "from": from.to_string(), "to": to.to_string(), "segment": format!("{from}-{to}"),
            "length_m": 100.0, "departs_at": at(times[0]).to_string(), "arrives_at": at(times[1]).to_string(),
            "if_closed": {"outcome": "no_route", "nodes": []}, "alternate": null,
        });
        if let Some(flight) = flight {
            leg["flight"] = flight;
        }
        leg
    }

    /// From node 0 over 1, where it charges, to 2.
    fn version(is_flown: bool) -> wire::PlanVersion<'static> {
        let battery = |ends: [f64; 2]| is_flown.then_some(ends);
        let mut version = json!({
            "version": 1, "epoch": 1, "token": 0, "sent_at": at(0).to_string(), "outcome": "rerouted",
            "path": {"nodes": ["0", "1", "2"], "segments": ["0-1", "1-2"]}, "length_m": 200.0,
            "flight_time_s": 400.0, "departs_at": at(0).to_string(), "arrives_at": at(400).to_string(),
            "legs": [leg(0, 1, [0, 100], battery([0.9, 0.5])), leg(1, 2, [300, 400], battery([0.8, 0.6]))],
            "warnings": [],
        });
        if is_flown {
            version["flight"] = json!({
                "airframe": "a", "objective": "distance", "battery_at_departure_fraction": 0.9,
                "battery_at_arrival_fraction": 0.6, "energy_wh": 1.0, "cost_usd": 0.0, "reserve_fraction": 0.2,
                "reserve_used": false, "proved": true, "value": 1.0, "lower_bound": 1.0,
                "stops": [{
                    "node": "1", "pad": 0, "kind": "charge", "before_leg": 1, "lands_at": at(100).to_string(),
                    "takes_off_at": at(300).to_string(), "waits_s": 0.0, "battery_before_fraction": 0.5,
                    "battery_after_fraction": 0.8, "reservation": "confirmed",
                }],
            });
        }
        serde_json::from_value(version).expect("a version")
    }

    #[test]
    fn a_flight_keeps_its_times_and_charges_on_its_pads() {
        let map = Map::of(&network()).expect("a map");
        let flight = Flight::along(&map, (map.position(0), 0.9), &version(true)).expect("a flight");
        assert_eq!(
            (flight.leg(at(50)), flight.place(at(50))),
            (Some(0), Point::new(50.0, 0.0))
        );
        assert_eq!(
            (flight.heading_deg(at(50)), flight.ground_speed_mps(at(50))),
            (Some(90.0), 1.0)
        );
        assert!((flight.battery(at(50)) - 0.7).abs() < 1e-9);
        assert!(flight.is_on_pad(at(200)) && !flight.is_on_pad(at(350)));
        // Half of the time is worth more than half of the charge.
        assert!(
            (0.66..0.70).contains(&flight.battery(at(200))),
            "{}",
            flight.battery(at(200))
        );
        assert!((flight.battery(at(300)) - 0.8).abs() < 1e-9);
        assert_eq!(
            (flight.leg(at(350)), flight.is_over(at(399))),
            (Some(1), false)
        );
        assert!(flight.is_over(at(400)));
        assert_eq!((flight.place(at(500)), flight.end()), (map.position(2), 2));
        assert!((flight.battery(at(500)) - 0.6).abs() < 1e-9);
    }

    #[test]
    fn who_is_to_take_off_later_stands_until_then() {
        let map = Map::of(&network()).expect("a map");
        let mut flight =
            Flight::along(&map, (map.position(0), 0.9), &version(true)).expect("a flight");
        flight.take_off_at(at(-30));
        assert!(flight.is_on_pad(at(-1)) && !flight.has_begun(at(-1)));
        assert!(!flight.is_on_pad(at(1)) && flight.has_begun(at(1)));
        flight.take_off_at(at(20));
        assert!(flight.is_on_pad(at(19)) && !flight.is_on_pad(at(21)));
        assert_eq!(flight.place(at(70)), Point::new(50.0, 0.0));
    }

    #[test]
    fn who_hovers_is_later_and_emptier() {
        let map = Map::of(&network()).expect("a map");
        let mut flight =
            Flight::along(&map, (map.position(0), 0.9), &version(true)).expect("a flight");
        flight.wait(at(50), SignedDuration::from_secs(20));
        assert_eq!(flight.place(at(70)), Point::new(50.0, 0.0));
        assert!(flight.battery(at(70)) < 0.69);
        assert!(!flight.is_over(at(410)) && flight.is_over(at(420)));
    }

    #[test]
    fn a_flight_without_energy_draws_by_its_length() {
        let map = Map::of(&network()).expect("a map");
        let from = Point::new(0.0, 40.0);
        let flight = Flight::along(&map, (from, 0.9), &version(false)).expect("a flight");
        assert_eq!(flight.place(at(-5)), from);
        let left = 0.9 - 200.0 * BATTERY_PER_M;
        assert!((flight.battery(at(400)) - left).abs() < 1e-9);
    }

    #[test]
    fn who_holds_without_a_way_on_stays_on_its_pad() {
        let map = Map::of(&network()).expect("a map");
        let mut hold = version(false);
        hold.outcome = "hold".into();
        hold.path.nodes.truncate(1);
        hold.legs.clear();
        let flight = Flight::along(&map, (map.position(0), 0.9), &hold).expect("a flight");
        let much_later = at(1_000_000);
        assert!(flight.is_on_pad(much_later) && !flight.is_over(much_later));
        assert_eq!(flight.place(much_later), map.position(0));
        assert_eq!(flight.battery(much_later), 0.9);
    }

    #[test]
    fn a_path_over_unknown_nodes_is_no_way() {
        let map = Map::of(&network()).expect("a map");
        let mut unknown = version(false);
        unknown.path.nodes[2] = wire::Id::from(77);
        assert_eq!(Flight::along(&map, (map.position(0), 0.9), &unknown), None);
    }
}
