//! Where a drone under way can begin: along its leg to one of the ends, or by a straight line to any node.

use super::setting::FlightSetting;
use crate::flight::{FlightStart, LegCost, Reentry, StretchKind, StretchLeg, Unflyable};
use crate::geo::Point;
use crate::network::{NodeIx, SegmentIx};

impl FlightSetting {
    /// The start at the end of a way back into the network, begun with a battery at an instant: its metres, its time and what it draws in
    /// the wind of then.
    ///
    /// Part of a leg takes that part of its time and energy, and so does as much that is flown from past its end. An overrun is
    /// flown on along the leg and back. What is no part of a segment is flown level.
    ///
    /// # Errors
    /// Where it cannot be flown.
    pub fn start_by(
        &self,
        reentry: &Reentry,
        battery: f64,
        at_s: f64,
    ) -> Result<FlightStart, Unflyable> {
        let stretch = reentry.stretch;
        let mut start = FlightStart {
            node: reentry.node,
            at_s,
            battery,
            on_ground: false,
            pad: None,
            flown_m: stretch.length_m,
            drawn: 0.0,
            stretch: Some(stretch),
        };
        if stretch.kind == StretchKind::None {
            return Ok(start);
        }
        let on_leg = stretch.leg.and_then(|leg| Some((leg, leg.segment?)));
        let segment_m = |segment: SegmentIx| self.topology().segment(segment).length_m;
        match on_leg.filter(|(_, segment)| segment_m(*segment) > 0.0) {
            Some((leg, segment)) => {
                let share = |metres: f64| metres / segment_m(segment);
                let shares = (share(stretch.length_m), share(stretch.overrun_m));
                self.fly_along(&mut start, leg, segment, shares)?;
            }
            None => {
                let end = self.topology().position(reentry.node);
                let turn = self.turning_point(reentry);
                self.fly_straight(&mut start, stretch.begin, turn)?;
                self.fly_straight(&mut start, turn, end)?;
            }
        }
        Ok(start)
    }

    /// Whether something closes on the way of a drone along its leg that is open when it sets out at an instant.
    pub fn closes_on_stretch(&self, start: &FlightStart, at_s: f64) -> bool {
        let leg = start.stretch.and_then(|stretch| stretch.leg);
        let Some(segment) = leg.and_then(|leg| leg.segment) else {
            return false;
        };
        let world = self.world();
        let way = (segment.0, start.node);
        let obstacles = world.obstacles;
        obstacles.closes_meanwhile(&world, way, at_s, start.at_s)
    }

    /// Flies a drone a share of its leg to one of the ends, with a share too far ahead first and back again.
    fn fly_along(
        &self,
        start: &mut FlightStart,
        leg: StretchLeg,
        segment: SegmentIx,
        (share, overrun): (f64, f64),
    ) -> Result<(), Unflyable> {
        let ahead = (leg.from, leg.to, segment);
        let back = (leg.to, leg.from, segment);
        if start.node == leg.to {
            return self.fly_share(start, ahead, share);
        }
        self.fly_share(start, ahead, overrun)?;
        self.fly_share(start, back, share - overrun)
    }

    fn fly_share(
        &self,
        start: &mut FlightStart,
        direction: (NodeIx, NodeIx, SegmentIx),
        share: f64,
    ) -> Result<(), Unflyable> {
        if share <= 0.0 {
            return Ok(());
        }
        let cost = self.airframe().leg(
            self.topology(),
            self.vertical(),
            self.wind(),
            self.payload_kg(),
            direction,
            start.at_s,
        )?;
        start.at_s += share * cost.time_s;
        start.battery -= share * cost.energy;
        start.drawn += share * cost.energy;
        Ok(())
    }

    /// Where a drone turns that flies on along its leg first; where it is if it does not.
    fn turning_point(&self, reentry: &Reentry) -> Point {
        let stretch = reentry.stretch;
        let ahead = stretch.leg.map(|leg| self.topology().position(leg.to));
        let Some(ahead) = ahead.filter(|_| stretch.overrun_m > 0.0) else {
            return stretch.begin;
        };
        let left_m = stretch.begin.distance_m(ahead).max(stretch.overrun_m);
        stretch.begin.towards(ahead, stretch.overrun_m / left_m)
    }

    /// Flies a drone level and straight from one place to another.
    fn fly_straight(
        &self,
        start: &mut FlightStart,
        place: Point,
        end: Point,
    ) -> Result<(), Unflyable> {
        let straight_m = place.distance_m(end);
        if straight_m <= 0.0 {
            return Ok(());
        }
        let course = Point::new(
            (end.x - place.x) / straight_m,
            (end.y - place.y) / straight_m,
        );
        let (airframe, payload_kg) = (self.airframe(), self.payload_kg());
        let mut worst = LegCost {
            time_s: 0.0,
            energy: 0.0,
        };
        for wind in self.wind().on_leg(place, end, start.at_s) {
            airframe.within_limits(payload_kg, wind)?;
            let cost = airframe.level_leg(payload_kg, straight_m, course, wind, None)?;
            if cost.energy >= worst.energy {
                worst = cost;
            }
        }
        start.at_s += worst.time_s;
        start.drawn += worst.energy;
        start.battery -= worst.energy;
        Ok(())
    }
}
