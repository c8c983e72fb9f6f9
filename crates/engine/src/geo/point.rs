//! Points of the plane and the boxes around them.

/// A position in the network's plane, in metres: `x` to the east, `y` to the north.
///
/// Files of a geographic network hold degrees instead; they become metres in
/// [`Frame::to_plane`](crate::geo::Frame::to_plane) and nowhere else.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// Metres to the east of the plane's origin.
    pub x: f64,
    /// Metres to the north of the plane's origin.
    pub y: f64,
}

impl Point {
    /// A point from its coordinates, in metres.
    pub const fn new(x: f64, y: f64) -> Self {
        Self { x, y }
    }

    /// The straight line to `other`, in metres: `sqrt(dx*dx + dy*dy)` in IEEE doubles.
    ///
    /// Not `hypot` and no fused multiply-add: two implementations must agree on ties to the last bit.
    pub fn distance_m(self, other: Self) -> f64 {
        let dx = other.x - self.x;
        let dy = other.y - self.y;
        (dx * dx + dy * dy).sqrt()
    }

    /// The point at `fraction` of the way to `other`.
    pub fn towards(self, other: Self, fraction: f64) -> Self {
        Self::new(
            self.x + (other.x - self.x) * fraction,
            self.y + (other.y - self.y) * fraction,
        )
    }

    /// The fraction of the way from one point to another, from 0 to 1, at which this one is nearest; 0 where they are the
    /// same.
    pub fn fraction_along(self, from: Self, to: Self) -> f64 {
        let (dx, dy) = (to.x - from.x, to.y - from.y);
        let length_m2 = dx * dx + dy * dy;
        match length_m2 > 0.0 {
            true => (((self.x - from.x) * dx + (self.y - from.y) * dy) / length_m2).clamp(0.0, 1.0),
            false => 0.0,
        }
    }

    /// How far this point is from the straight line between two others, ends included, in metres.
    pub fn distance_to_line_m(self, from: Self, to: Self) -> f64 {
        self.distance_m(from.towards(to, self.fraction_along(from, to)))
    }

    /// True when both coordinates are finite.
    pub fn is_finite(self) -> bool {
        self.x.is_finite() && self.y.is_finite()
    }
}

/// An axis-aligned box, boundary included.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// The corner with the smallest coordinates.
    pub min: Point,
    /// The corner with the largest coordinates.
    pub max: Point,
}

impl Bounds {
    /// The smallest box around the points; `None` when there are none.
    pub fn around(points: impl IntoIterator<Item = Point>) -> Option<Self> {
        let mut points = points.into_iter();
        let first = points.next()?;
        let mut bounds = Self {
            min: first,
            max: first,
        };
        for point in points {
            bounds.min.x = bounds.min.x.min(point.x);
            bounds.min.y = bounds.min.y.min(point.y);
            bounds.max.x = bounds.max.x.max(point.x);
            bounds.max.y = bounds.max.y.max(point.y);
        }
        Some(bounds)
    }

    /// The box grown by `margin_m` on every side.
    pub fn grown(self, margin_m: f64) -> Self {
        Self {
            min: Point::new(self.min.x - margin_m, self.min.y - margin_m),
            max: Point::new(self.max.x + margin_m, self.max.y + margin_m),
        }
    }

    /// The extent along x, in metres.
    pub fn width_m(self) -> f64 {
        self.max.x - self.min.x
    }

    /// The extent along y, in metres.
    pub fn height_m(self) -> f64 {
        self.max.y - self.min.y
    }

    /// The longer side, in metres: the paper's *network size* when the box is that of all nodes.
    pub fn longer_side_m(self) -> f64 {
        self.width_m().max(self.height_m())
    }

    /// The middle of the box.
    pub fn centre(self) -> Point {
        Point::new(
            (self.min.x + self.max.x) / 2.0,
            (self.min.y + self.max.y) / 2.0,
        )
    }

    /// True when the point lies in the box or on its boundary.
    pub fn contains(self, point: Point) -> bool {
        point.x >= self.min.x
            && point.x <= self.max.x
            && point.y >= self.min.y
            && point.y <= self.max.y
    }

    /// True when the two boxes share at least one point.
    pub fn meets(self, other: Self) -> bool {
        self.min.x <= other.max.x
            && other.min.x <= self.max.x
            && self.min.y <= other.max.y
            && other.min.y <= self.max.y
    }
}
