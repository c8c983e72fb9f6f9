//! Building footprints: outlines checked before anything computes with them, and laid on the plane.

use crate::geo::{Bounds, LocalPlane, Point};
use crate::network::survey::plane_about;
use geo::{Coord, LineString, MapCoords, MultiPolygon, Polygon, Validation};
use thiserror::Error;

/// Rings longer than this are refused: checking a ring takes the square of its length.
const MAX_RING_POSITIONS: usize = 10_000;

/// A building, or a part of one that is drawn by itself (a tower on its podium).
#[derive(Clone, Debug, PartialEq)]
pub struct Building {
    /// Id in the source, such as `way/197801072`.
    pub id: String,
    /// A name for people.
    pub name: Option<String>,
    /// The ground it stands on.
    pub outline: Outline,
    /// Height of its top above ground, in metres; `None` when unknown.
    pub height_m: Option<f64>,
    /// Height above ground at which it begins, in metres; `None` for the ground.
    pub min_height_m: Option<f64>,
    /// Which of the source's extracts it comes from, where there are several.
    pub extract: Option<String>,
}

/// The outline of a building in longitude and latitude: polygons, with holes where there are
/// courtyards.
///
/// Valid by construction: rings closed and simple, coordinates finite, holes inside, parts apart.
#[derive(Clone, Debug, PartialEq)]
pub struct Outline(MultiPolygon<f64>);

/// What is wrong with an outline, and in which ring; polygons and rings count from 0, the outer
/// ring first.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum OutlineFault {
    /// There is no polygon, or one without rings.
    #[error("has no outer ring")]
    Empty,
    /// A ring needs three corners and its first position again.
    #[error("ring {ring} of polygon {polygon} has fewer than three corners")]
    TooFewCorners {
        /// Place of the polygon.
        polygon: usize,
        /// Place of the ring.
        ring: usize,
    },
    /// A ring is longer than can be checked in reasonable time.
    #[error(
        "ring {ring} of polygon {polygon} has {count} positions, more than {limit}; simplify it"
    )]
    TooManyPositions {
        /// Place of the polygon.
        polygon: usize,
        /// Place of the ring.
        ring: usize,
        /// How many positions it has.
        count: usize,
        /// How many it may have.
        limit: usize,
    },
    /// A ring does not end where it starts.
    #[error("ring {ring} of polygon {polygon} is not closed; repeat its first position at its end")]
    Open {
        /// Place of the polygon.
        polygon: usize,
        /// Place of the ring.
        ring: usize,
    },
    /// A coordinate is not a number of degrees on Earth.
    #[error("ring {ring} of polygon {polygon} has the position [{}, {}], which is not a longitude and latitude", .position[0], .position[1])]
    NotOnEarth {
        /// Place of the polygon.
        polygon: usize,
        /// Place of the ring.
        ring: usize,
        /// The position as stated.
        position: [f64; 2],
    },
    /// A ring crosses itself.
    #[error("ring {ring} of polygon {polygon} crosses itself")]
    CrossesItself {
        /// Place of the polygon.
        polygon: usize,
        /// Place of the ring.
        ring: usize,
    },
    /// The holes of a polygon are not inside it, or meet one another.
    #[error("the holes of polygon {polygon} are not inside it and apart")]
    Holes {
        /// Place of the polygon.
        polygon: usize,
    },
    /// The polygons of an outline overlap.
    #[error("its polygons overlap")]
    Overlap,
}

impl Outline {
    /// Checks the polygons of a GeoJSON `MultiPolygon`: for each its outer ring, then its holes.
    ///
    /// # Errors
    /// The first [`OutlineFault`]: `geo` panics on some invalid polygons, so none is ever handed to
    /// it.
    pub fn new(polygons: &[Vec<Vec<[f64; 2]>>]) -> Result<Self, OutlineFault> {
        if polygons.is_empty() {
            return Err(OutlineFault::Empty);
        }
        let checked = polygons
            .iter()
            .enumerate()
            .map(|(polygon, rings)| checked_polygon(polygon, rings))
            .collect::<Result<Vec<_>, _>>()?;
        let outline = MultiPolygon(checked);
        if outline.0.len() > 1 && !outline.is_valid() {
            return Err(OutlineFault::Overlap);
        }
        Ok(Self(outline))
    }

    /// The polygons as [`Outline::new`] takes them: for each its outer ring, then its holes, all
    /// closed; longitude and latitude in degrees.
    pub fn polygons(&self) -> Vec<Vec<Vec<[f64; 2]>>> {
        let positions = |ring: &LineString<f64>| -> Vec<[f64; 2]> {
            ring.coords().map(|corner| [corner.x, corner.y]).collect()
        };
        let rings = |polygon: &Polygon<f64>| -> Vec<Vec<[f64; 2]>> {
            std::iter::once(polygon.exterior())
                .chain(polygon.interiors())
                .map(positions)
                .collect()
        };
        self.0.iter().map(rings).collect()
    }

    /// All positions, as longitude and latitude in degrees.
    pub(super) fn positions(&self) -> impl Iterator<Item = [f64; 2]> {
        self.0
            .iter()
            .flat_map(|polygon| polygon.exterior().coords())
            .map(|corner| [corner.x, corner.y])
    }
}

fn checked_polygon(polygon: usize, rings: &[Vec<[f64; 2]>]) -> Result<Polygon<f64>, OutlineFault> {
    let mut checked = rings
        .iter()
        .enumerate()
        .map(|(ring, positions)| checked_ring(polygon, ring, positions))
        .collect::<Result<Vec<_>, _>>()?
        .into_iter();
    let outer = checked.next().ok_or(OutlineFault::Empty)?;
    let whole = Polygon::new(outer, checked.collect());
    if !whole.interiors().is_empty() && !whole.is_valid() {
        return Err(OutlineFault::Holes { polygon });
    }
    Ok(whole)
}

fn checked_ring(
    polygon: usize,
    ring: usize,
    positions: &[[f64; 2]],
) -> Result<LineString<f64>, OutlineFault> {
    if positions.len() > MAX_RING_POSITIONS {
        return Err(OutlineFault::TooManyPositions {
            polygon,
            ring,
            count: positions.len(),
            limit: MAX_RING_POSITIONS,
        });
    }
    let on_earth = |&[lon, lat]: &[f64; 2]| {
        lon.is_finite() && lat.is_finite() && lon.abs() <= 180.0 && lat.abs() <= 90.0
    };
    if let Some(&position) = positions.iter().find(|position| !on_earth(position)) {
        return Err(OutlineFault::NotOnEarth {
            polygon,
            ring,
            position,
        });
    }
    if positions.first() != positions.last() {
        return Err(OutlineFault::Open { polygon, ring });
    }
    let mut corners: Vec<Coord<f64>> = positions.iter().map(|&[x, y]| Coord { x, y }).collect();
    corners.dedup();
    if corners.len() < 4 {
        return Err(OutlineFault::TooFewCorners { polygon, ring });
    }
    let alone = Polygon::new(LineString(corners), Vec::new());
    if !alone.is_valid() {
        return Err(OutlineFault::CrossesItself { polygon, ring });
    }
    Ok(alone.into_inner().0)
}

/// The plane on which line of sight between these buildings is decided; `None` without buildings.
///
/// Zones that shall be kept clear of have to be laid on this plane.
pub fn plane_of(buildings: &[Building]) -> Option<LocalPlane> {
    plane_about(
        buildings
            .iter()
            .flat_map(|building| building.outline.positions()),
    )
}

/// An outline on the plane, in metres.
#[derive(Clone, Debug)]
pub(super) struct Footprint {
    pub(super) polygons: MultiPolygon<f64>,
    pub(super) bounds: Bounds,
    /// Sides of all rings; a point is inside when a ray from it crosses an odd number of them.
    sides: Vec<(Point, Point)>,
}

/// The first and the last moment at which a flight is near a footprint, as fractions of its line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Passage {
    pub(super) first: f64,
    pub(super) last: f64,
}

impl Passage {
    fn hull(self, other: Self) -> Self {
        Self {
            first: self.first.min(other.first),
            last: self.last.max(other.last),
        }
    }
}

impl Footprint {
    /// Lays an outline on the plane.
    pub(super) fn on(plane: &LocalPlane, outline: &Outline) -> Self {
        let polygons = outline.0.map_coords(|corner| {
            let Point { x, y } = plane.project(corner.x, corner.y);
            Coord { x, y }
        });
        let point = |corner: Coord<f64>| Point::new(corner.x, corner.y);
        let sides: Vec<(Point, Point)> = polygons
            .iter()
            .flat_map(|polygon| std::iter::once(polygon.exterior()).chain(polygon.interiors()))
            .flat_map(LineString::lines)
            .map(|side| (point(side.start), point(side.end)))
            .collect();
        let corners = sides.iter().map(|&(start, _)| start);
        let bounds = Bounds::around(corners).expect("a valid outline has corners");
        Self {
            polygons,
            bounds,
            sides,
        }
    }

    /// True when the point lies inside; the boundary may fall either way.
    pub(super) fn contains(&self, point: Point) -> bool {
        let crossings = self.sides.iter().filter(|(start, end)| {
            let straddles = (start.y > point.y) != (end.y > point.y);
            straddles && {
                let along = (point.y - start.y) / (end.y - start.y);
                point.x < start.x + (end.x - start.x) * along
            }
        });
        crossings.count() % 2 == 1
    }

    /// When the flight from one point straight to another is within `margin_m` (above 0) of the
    /// footprint.
    ///
    /// The footprint widened by the margin is the union of its inside, of a strip along each side
    /// and of a disc about each corner, so the first and last moment are exact: no sampling, no
    /// polygon in place of round corners.
    pub(super) fn passage(&self, from: Point, to: Point, margin_m: f64) -> Option<Passage> {
        let flight = Bounds::around([from, to])?.grown(margin_m);
        if !flight.meets(self.bounds) {
            return None;
        }
        let ends = [(from, 0.0), (to, 1.0)];
        let inside = ends
            .into_iter()
            .filter(|&(end, _)| self.contains(end))
            .map(|(_, moment)| Passage {
                first: moment,
                last: moment,
            });
        let beside = self
            .sides
            .iter()
            .filter_map(|&side| side_passage(from, to, side, margin_m, flight));
        inside.chain(beside).reduce(Passage::hull)
    }
}

/// When the flight is within `radius_m` of a side or of its start; its end is the start of the next
/// one.
///
/// `flight` is the box of the flight grown by the radius.
fn side_passage(
    from: Point,
    to: Point,
    side: (Point, Point),
    radius_m: f64,
    flight: Bounds,
) -> Option<Passage> {
    if !Bounds::around([side.0, side.1])?.meets(flight) {
        return None;
    }
    let around_start = disc_passage(from, to, side.0, radius_m);
    let beside = strip_passage(from, to, side, radius_m);
    around_start.into_iter().chain(beside).reduce(Passage::hull)
}

/// When the flight is within `radius_m` of a point: the quadratic `|from + t (to - from) - centre|
/// = radius`.
fn disc_passage(from: Point, to: Point, centre: Point, radius_m: f64) -> Option<Passage> {
    let (dx, dy) = (to.x - from.x, to.y - from.y);
    let (cx, cy) = (from.x - centre.x, from.y - centre.y);
    let squared_length = dx * dx + dy * dy;
    let excess = cx * cx + cy * cy - radius_m * radius_m;
    if squared_length == 0.0 {
        return (excess <= 0.0).then_some(Passage {
            first: 0.0,
            last: 1.0,
        });
    }
    let half_linear = cx * dx + cy * dy;
    let discriminant = half_linear * half_linear - squared_length * excess;
    if discriminant < 0.0 {
        return None;
    }
    let root = discriminant.sqrt();
    let first = ((-half_linear - root) / squared_length).max(0.0);
    let last = ((-half_linear + root) / squared_length).min(1.0);
    (first <= last).then_some(Passage { first, last })
}

/// When the flight is in the rectangle that has the side as its middle line and reaches `radius_m`
/// to either hand.
fn strip_passage(
    from: Point,
    to: Point,
    (start, end): (Point, Point),
    radius_m: f64,
) -> Option<Passage> {
    let length_m = start.distance_m(end);
    let (east, north) = ((end.x - start.x) / length_m, (end.y - start.y) / length_m);
    let along = |point: Point| (point.x - start.x) * east + (point.y - start.y) * north;
    let across = |point: Point| (point.y - start.y) * east - (point.x - start.x) * north;
    let whole = Passage {
        first: 0.0,
        last: 1.0,
    };
    let beside = clip(whole, along(from), along(to), 0.0, length_m)?;
    clip(beside, across(from), across(to), -radius_m, radius_m)
}

/// The part of a passage during which a value that goes evenly from `at_start` to `at_end` is
/// within limits.
fn clip(passage: Passage, at_start: f64, at_end: f64, lower: f64, upper: f64) -> Option<Passage> {
    let change = at_end - at_start;
    if change == 0.0 {
        return (lower <= at_start && at_start <= upper).then_some(passage);
    }
    let (one, other) = ((lower - at_start) / change, (upper - at_start) / change);
    let first = passage.first.max(one.min(other));
    let last = passage.last.min(one.max(other));
    (first <= last).then_some(Passage { first, last })
}

#[cfg(test)]
mod tests;
