//! Where a drone in the middle of a leg can begin: the two ends of the leg, or any node by a straight line.

use super::setting::FlightSetting;
use crate::flight::{FlightStart, Unflyable};
use crate::geo::Point;
use crate::network::{NodeIx, SegmentIx};

/// A drone on a leg.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UnderWay {
    /// The node behind it.
    pub from: NodeIx,
    /// The node ahead.
    pub to: NodeIx,
    /// The segment.
    pub segment: SegmentIx,
    /// The fraction of the leg that is flown, 0 to 1.
    pub flown: f64,
    /// Its battery, as a fraction.
    pub battery: f64,
    /// When that is, in seconds.
    pub at_s: f64,
}

impl FlightSetting {
    /// The start at the node ahead: the rest of the leg in the wind of now.
    ///
    /// # Errors
    /// Where the rest cannot be flown.
    pub fn start_ahead(&self, drone: &UnderWay) -> Result<FlightStart, Unflyable> {
        let direction = (drone.from, drone.to, drone.segment);
        self.start_by_share(drone, direction, 1.0 - drone.flown)
    }

    /// The start at the node behind: back along the leg, against the wind that was behind.
    ///
    /// # Errors
    /// Where the way back cannot be flown.
    pub fn start_behind(&self, drone: &UnderWay) -> Result<FlightStart, Unflyable> {
        let direction = (drone.to, drone.from, drone.segment);
        self.start_by_share(drone, direction, drone.flown)
    }

    /// A share of a leg takes that share of its time and energy.
    fn start_by_share(
        &self,
        drone: &UnderWay,
        direction: (NodeIx, NodeIx, SegmentIx),
        share: f64,
    ) -> Result<FlightStart, Unflyable> {
        let share = share.clamp(0.0, 1.0);
        let length_m = self.topology().segment(drone.segment).length_m;
        let mut start = FlightStart {
            node: direction.1,
            at_s: drone.at_s,
            battery: drone.battery,
            on_ground: false,
            flown_m: share * length_m,
            drawn: 0.0,
        };
        if share > 0.0 {
            let cost = self.airframe().leg(
                self.topology(),
                self.vertical(),
                self.wind(),
                self.payload_kg(),
                direction,
                drone.at_s,
            )?;
            start.at_s += share * cost.time_s;
            start.battery -= share * cost.energy;
            start.drawn = share * cost.energy;
        }
        Ok(start)
    }

    /// The start at a node by a straight line from anywhere, level, in the wind of now: for a drone that is off its leg.
    ///
    /// # Errors
    /// Where the line cannot be flown.
    pub fn start_straight(
        &self,
        place: Point,
        node: NodeIx,
        battery: f64,
        at_s: f64,
    ) -> Result<FlightStart, Unflyable> {
        let end = self.topology().position(node);
        let straight_m = place.distance_m(end);
        let mut start = FlightStart {
            node,
            at_s,
            battery,
            on_ground: false,
            flown_m: straight_m,
            drawn: 0.0,
        };
        if straight_m > 0.0 {
            let course = Point::new(
                (end.x - place.x) / straight_m,
                (end.y - place.y) / straight_m,
            );
            let (airframe, payload_kg) = (self.airframe(), self.payload_kg());
            for wind in self.wind().on_leg(place, end, at_s) {
                airframe.within_limits(payload_kg, wind)?;
                let cost = airframe.level_leg(payload_kg, straight_m, course, wind, None)?;
                if cost.energy >= start.drawn {
                    start.drawn = cost.energy;
                    start.at_s = at_s + cost.time_s;
                }
            }
            start.battery -= start.drawn;
        }
        Ok(start)
    }
}
