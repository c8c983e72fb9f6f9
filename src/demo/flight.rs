//! Flying along a path: where the drone is after a given length.

use super::map::Map;
use crate::geo::Point;
use crate::wire;

/// A drone on its way along a path.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Flight {
    /// Where the path bends; the first is where it was begun.
    points: Vec<Point>,
    /// How many of the points come before the first node of the path: 0, or 1 with a first stretch.
    before_nodes: usize,
    /// The part of the path that is being flown: from this point to the next.
    part: usize,
    /// Metres flown on it.
    flown_m: f64,
    /// The node at the end, by the map.
    end: usize,
}

impl Flight {
    /// A flight from a place along a path of nodes; `None` where the map does not have them all.
    pub(super) fn along(map: &Map, from: Point, nodes: &[wire::Id<'static>]) -> Option<Self> {
        let known: Option<Vec<usize>> = nodes.iter().map(|id| map.node(id)).collect();
        let known = known?;
        let (first, end) = (*known.first()?, *known.last()?);
        let has_stretch = from != map.position(first);
        let mut points = Vec::with_capacity(known.len() + 1);
        if has_stretch {
            points.push(from);
        }
        points.extend(known.iter().map(|&node| map.position(node)));
        Some(Self {
            points,
            before_nodes: usize::from(has_stretch),
            part: 0,
            flown_m: 0.0,
            end,
        })
    }

    /// Flies on, to the end at most.
    pub(super) fn advance(&mut self, metres: f64) {
        let mut left_m = metres.max(0.0);
        while let Some(part_m) = self.part_m() {
            let ahead_m = part_m - self.flown_m;
            if left_m < ahead_m {
                self.flown_m += left_m;
                return;
            }
            left_m -= ahead_m;
            self.part += 1;
            self.flown_m = 0.0;
        }
    }

    /// True at the end of the path.
    pub(super) fn is_over(&self) -> bool {
        self.part_m().is_none()
    }

    /// The node at the end, by the map.
    pub(super) fn end(&self) -> usize {
        self.end
    }

    pub(super) fn place(&self) -> Point {
        let from = self.points[self.part];
        let (Some(part_m), Some(&to)) = (self.part_m(), self.points.get(self.part + 1)) else {
            return from;
        };
        let fraction = match part_m > 0.0 {
            true => self.flown_m / part_m,
            false => 0.0,
        };
        from.towards(to, fraction)
    }

    /// Course over ground in degrees, clockwise from north; `None` at the end.
    pub(super) fn heading_deg(&self) -> Option<f64> {
        let (from, to) = (self.points[self.part], self.points.get(self.part + 1)?);
        let heading_deg = (to.x - from.x).atan2(to.y - from.y).to_degrees();
        Some(heading_deg.rem_euclid(360.0))
    }

    /// Which leg of the path is being flown, counted from 0; `None` before the first node and at the end.
    pub(super) fn leg(&self) -> Option<u32> {
        self.part_m()?;
        let leg = self.part.checked_sub(self.before_nodes)?;
        u32::try_from(leg).ok()
    }

    /// What lies ahead, in metres.
    pub(super) fn remaining_m(&self) -> f64 {
        let ahead = &self.points[self.part..];
        let all_m: f64 = ahead
            .windows(2)
            .map(|ends| ends[0].distance_m(ends[1]))
            .sum();
        all_m - self.flown_m
    }

    fn part_m(&self) -> Option<f64> {
        let to = self.points.get(self.part + 1)?;
        Some(self.points[self.part].distance_m(*to))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::demo::map::tests::network;
    use crate::wire::Id;

    fn nodes(ids: &[i64]) -> Vec<Id<'static>> {
        ids.iter().map(|&id| Id::from(id)).collect()
    }

    #[test]
    fn a_flight_passes_its_nodes_and_ends_at_the_last() {
        let map = Map::of(&network()).expect("a map");
        let mut flight =
            Flight::along(&map, map.position(0), &nodes(&[0, 1, 2])).expect("a flight");
        assert_eq!(
            (flight.leg(), flight.remaining_m(), flight.end()),
            (Some(0), 200.0, 2)
        );
        flight.advance(130.0);
        assert_eq!((flight.leg(), flight.remaining_m()), (Some(1), 70.0));
        assert_eq!(flight.place(), Point::new(130.0, 0.0));
        assert_eq!(flight.heading_deg(), Some(90.0));
        flight.advance(-5.0);
        assert_eq!(flight.place(), Point::new(130.0, 0.0));
        flight.advance(1e9);
        assert!(flight.is_over());
        assert_eq!(
            (flight.leg(), flight.heading_deg(), flight.remaining_m()),
            (None, None, 0.0)
        );
        assert_eq!(flight.place(), map.position(2));
    }

    #[test]
    fn the_first_stretch_is_no_leg() {
        let map = Map::of(&network()).expect("a map");
        let from = Point::new(160.0, 0.0);
        let mut flight = Flight::along(&map, from, &nodes(&[1, 2])).expect("a flight");
        assert_eq!((flight.leg(), flight.remaining_m()), (None, 160.0));
        assert_eq!(flight.heading_deg(), Some(270.0));
        flight.advance(60.0);
        assert_eq!((flight.leg(), flight.place()), (Some(0), map.position(1)));
    }

    #[test]
    fn a_path_of_one_node_or_of_unknown_ones_is_no_way() {
        let map = Map::of(&network()).expect("a map");
        let stay = Flight::along(&map, map.position(3), &nodes(&[3])).expect("a flight");
        assert!(stay.is_over());
        assert_eq!(stay.place(), map.position(3));
        assert_eq!(Flight::along(&map, map.position(3), &[]), None);
        assert_eq!(Flight::along(&map, map.position(3), &nodes(&[3, 77])), None);
    }
}
