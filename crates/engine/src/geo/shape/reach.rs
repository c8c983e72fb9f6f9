//! Distances between points and straight lines, and which part of a line comes within reach of what.
//!
//! "Within reach" means no farther than a given distance. Both the yes-or-no question and the question
//! of where are answered by the same arithmetic here, so that they never contradict each other.

use crate::geo::{Bounds, Point, TOLERANCE_M};
use rstar::{AABB, RTreeObject};

/// The distance from a point to the straight line between two others, ends included, in metres.
pub(super) fn distance_to_segment_m(point: Point, from: Point, to: Point) -> f64 {
    let (along_x, along_y) = (to.x - from.x, to.y - from.y);
    let length_squared = along_x * along_x + along_y * along_y;
    if length_squared <= 0.0 {
        return point.distance_m(from);
    }
    let (off_x, off_y) = (point.x - from.x, point.y - from.y);
    let fraction = (off_x * along_x + off_y * along_y) / length_squared;
    if fraction <= 0.0 {
        return point.distance_m(from);
    }
    if fraction >= 1.0 {
        return point.distance_m(to);
    }
    (along_x * off_y - along_y * off_x).abs() / length_squared.sqrt()
}

/// A side of a shape.
#[derive(Clone, Copy, Debug)]
pub(super) struct Edge {
    pub(super) from: Point,
    pub(super) to: Point,
    length_m: f64,
}

impl RTreeObject for Edge {
    type Envelope = AABB<[f64; 2]>;

    fn envelope(&self) -> Self::Envelope {
        AABB::from_corners([self.from.x, self.from.y], [self.to.x, self.to.y])
    }
}

impl Edge {
    pub(super) fn new(from: Point, to: Point) -> Self {
        Self {
            from,
            to,
            length_m: from.distance_m(to),
        }
    }

    pub(super) fn distance_m(&self, point: Point) -> f64 {
        distance_to_segment_m(point, self.from, self.to)
    }

    /// How far to the left of this edge's line a point lies, times the edge's length.
    pub(super) fn leftness(&self, point: Point) -> f64 {
        (self.to.x - self.from.x) * (point.y - self.from.y)
            - (self.to.y - self.from.y) * (point.x - self.from.x)
    }

    /// False only when the edge surely stays farther than `reach_m` from a box: their boxes are known to
    /// come near, so what is left to try is whether the edge's own line has the box to one side.
    pub(super) fn comes_near_box(&self, bounds: Bounds, reach_m: f64) -> bool {
        let half_extent = bounds.width_m() / 2.0 * (self.to.y - self.from.y).abs()
            + bounds.height_m() / 2.0 * (self.to.x - self.from.x).abs();
        self.leftness(bounds.centre()).abs() <= half_extent + reach_m * self.length_m
    }
}

/// True when both numbers lie beyond the limit, to the same side.
fn both_beyond(first: f64, second: f64, limit: f64) -> bool {
    (first > limit && second > limit) || (first < -limit && second < -limit)
}

/// A part of a line as fractions of its length, smallest first; empty until something is included.
#[derive(Clone, Copy)]
struct Part {
    first: f64,
    last: f64,
}

impl Part {
    const EMPTY: Self = Self {
        first: f64::INFINITY,
        last: f64::NEG_INFINITY,
    };

    /// Includes the fractions of the line from `first` to `last`, cut to 0..1.
    fn include(&mut self, first: f64, last: f64) {
        let (first, last) = (first.max(0.0), last.min(1.0));
        if first <= last {
            self.first = self.first.min(first);
            self.last = self.last.max(last);
        }
    }

    fn found(self) -> Option<(f64, f64)> {
        (self.first <= self.last).then_some((self.first, self.last))
    }
}

/// A directed straight line that is asked about again and again.
#[derive(Clone, Copy)]
pub(super) struct Ray {
    from: Point,
    to: Point,
    along_x: f64,
    along_y: f64,
    length_squared: f64,
    length_m: f64,
}

impl Ray {
    pub(super) fn new(from: Point, to: Point) -> Self {
        let (along_x, along_y) = (to.x - from.x, to.y - from.y);
        let length_squared = along_x * along_x + along_y * along_y;
        Self {
            from,
            to,
            along_x,
            along_y,
            length_squared,
            length_m: length_squared.sqrt(),
        }
    }

    /// True when the line is so short that only its ends can be told apart from nothing.
    fn is_point(&self) -> bool {
        self.length_squared <= TOLERANCE_M * TOLERANCE_M
    }

    /// The part of this line that is within reach of a point.
    pub(super) fn part_near_point(&self, centre: Point, reach_m: f64) -> Option<(f64, f64)> {
        let from_near = self.from.distance_m(centre) <= reach_m;
        let to_near = self.to.distance_m(centre) <= reach_m;
        let mut part = Part::EMPTY;
        if !self.include_ends(from_near, to_near, &mut part) {
            self.include_disc(centre, reach_m, &mut part);
        }
        part.found()
    }

    /// The part of this line that is within reach of an edge; what is within reach is convex, so it is one part.
    pub(super) fn part_near_edge(&self, edge: &Edge, reach_m: f64) -> Option<(f64, f64)> {
        if self.is_beside(edge, reach_m) {
            return None;
        }
        let from_near = edge.distance_m(self.from) <= reach_m;
        let to_near = edge.distance_m(self.to) <= reach_m;
        let mut part = Part::EMPTY;
        if !self.include_ends(from_near, to_near, &mut part) {
            self.include_disc(edge.from, reach_m, &mut part);
            self.include_disc(edge.to, reach_m, &mut part);
            self.include_strip(edge, reach_m, &mut part);
        }
        part.found()
    }

    /// True only when line and edge surely are out of reach, as the line of one has the other to one side.
    ///
    /// This is only for speed; the tolerance keeps rounding from deciding otherwise than the exact tests do.
    pub(super) fn is_beside(&self, edge: &Edge, reach_m: f64) -> bool {
        let certain_m = reach_m + TOLERANCE_M;
        let (from_side, to_side) = (edge.leftness(self.from), edge.leftness(self.to));
        if both_beyond(from_side, to_side, certain_m * edge.length_m) {
            return true;
        }
        let leftness = |point: Point| {
            self.along_x * (point.y - self.from.y) - self.along_y * (point.x - self.from.x)
        };
        let (from_side, to_side) = (leftness(edge.from), leftness(edge.to));
        both_beyond(from_side, to_side, certain_m * self.length_m)
    }

    /// Includes the ends that are near; true when that settles it.
    fn include_ends(&self, from_near: bool, to_near: bool, part: &mut Part) -> bool {
        if from_near {
            part.include(0.0, 0.0);
        }
        if to_near {
            part.include(1.0, 1.0);
        }
        if self.is_point() && (from_near || to_near) {
            part.include(0.0, 1.0);
        }
        self.is_point() || (from_near && to_near)
    }

    /// Includes what lies in the disc of radius `reach_m` around a point.
    fn include_disc(&self, centre: Point, reach_m: f64, part: &mut Part) {
        let (off_x, off_y) = (centre.x - self.from.x, centre.y - self.from.y);
        let cross = self.along_x * off_y - self.along_y * off_x;
        let gap_squared = cross * cross / self.length_squared;
        let half_chord_squared = reach_m * reach_m - gap_squared;
        if half_chord_squared >= 0.0 {
            let nearest = (self.along_x * off_x + self.along_y * off_y) / self.length_squared;
            let half_chord = (half_chord_squared / self.length_squared).sqrt();
            part.include(nearest - half_chord, nearest + half_chord);
        }
    }

    /// Includes what lies beside an edge, between the perpendiculars at its ends, no farther than `reach_m`.
    fn include_strip(&self, edge: &Edge, reach_m: f64, part: &mut Part) {
        let (start, end) = (edge.from, edge.to);
        let (edge_x, edge_y) = (end.x - start.x, end.y - start.y);
        let edge_squared = edge_x * edge_x + edge_y * edge_y;
        let (off_x, off_y) = (self.from.x - start.x, self.from.y - start.y);
        let beside = LinearRange {
            at_start: edge_x * off_x + edge_y * off_y,
            change: edge_x * self.along_x + edge_y * self.along_y,
            low: 0.0,
            high: edge_squared,
        };
        let aside = LinearRange {
            at_start: edge_x * off_y - edge_y * off_x,
            change: edge_x * self.along_y - edge_y * self.along_x,
            low: -reach_m * edge.length_m,
            high: reach_m * edge.length_m,
        };
        let (Some(beside), Some(aside)) = (beside.fractions(), aside.fractions()) else {
            return;
        };
        part.include(beside.0.max(aside.0), beside.1.min(aside.1));
    }
}

/// A quantity that changes linearly along a line, and the range it should be in.
struct LinearRange {
    at_start: f64,
    change: f64,
    low: f64,
    high: f64,
}

impl LinearRange {
    /// Between which fractions (beyond 0..1, too) the quantity is in its range.
    fn fractions(&self) -> Option<(f64, f64)> {
        if self.change == 0.0 {
            let always = self.at_start >= self.low && self.at_start <= self.high;
            return always.then_some((f64::NEG_INFINITY, f64::INFINITY));
        }
        let at_low = (self.low - self.at_start) / self.change;
        let at_high = (self.high - self.at_start) / self.change;
        Some((at_low.min(at_high), at_low.max(at_high)))
    }
}
