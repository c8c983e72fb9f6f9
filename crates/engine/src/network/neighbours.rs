//! Joining points with others within reach, with a hard limit on the segments of each.
//!
//! Nearest neighbours: a pair is a candidate when either point is among the other's K nearest within reach. Candidates
//! are taken shortest first (then in point order), each as long as both its points have fewer than
//! K segments. So K is the largest degree, and the short links that hold a neighbourhood together
//! are never crowded out by long ones. Asking that both choose each other would leave a point
//! beside a cluster alone, since the members of the cluster have nearer ones to choose; that either
//! does gives it its links as long as they have room.

use super::seeded::Seeded;
use crate::geo::{Bounds, Point};
use rustc_hash::FxHashSet;
use spade::{DelaunayTriangulation, HasPosition, Point2, Triangulation};

/// Points per cell of the grid, on average: a ring or two of cells holds the neighbours of most
/// points.
const POINTS_PER_CELL: f64 = 2.0;

/// The joined pairs, each with the lower place first, sorted. `joined` are pairs that are there
/// already: they count towards the limit and are not returned again.
pub(super) fn join_nearest(
    points: &[Point],
    max_neighbours: usize,
    reach_m: f64,
    joined: &[(u32, u32)],
) -> Vec<(u32, u32)> {
    shortest_first(
        points.len(),
        candidates(points, max_neighbours, reach_m),
        max_neighbours,
        joined,
    )
}

/// The edges of a Delaunay triangulation within reach, shortest first while both ends have room; sorted.
pub(super) fn join_delaunay(
    points: &[Point],
    max_neighbours: usize,
    reach_m: f64,
) -> Vec<(u32, u32)> {
    let places = (0..)
        .zip(points)
        .map(|(place, &point)| Place { place, point });
    // Coordinates of a network are finite, so that all points can be inserted.
    let triangulation =
        DelaunayTriangulation::<Place>::bulk_load(places.collect()).unwrap_or_default();
    let edges = triangulation.undirected_edges().map(|edge| {
        let [one, other] = edge.vertices().map(|vertex| vertex.data().place);
        Candidate {
            length_m: points[one as usize].distance_m(points[other as usize]),
            ends: (one.min(other), one.max(other)),
        }
    });
    let within = edges.filter(|edge| edge.length_m <= reach_m).collect();
    shortest_first(points.len(), within, max_neighbours, &[])
}

/// A point of a triangulation.
struct Place {
    place: u32,
    point: Point,
}

impl HasPosition for Place {
    type Scalar = f64;

    fn position(&self) -> Point2<f64> {
        Point2::new(self.point.x, self.point.y)
    }
}

/// Pairs within reach at random: point by point, in an order that is drawn, each joins others with room that
/// are drawn, until it has no room itself; sorted.
pub(super) fn join_at_random(
    points: &[Point],
    max_neighbours: usize,
    reach_m: f64,
    seeded: &mut Seeded,
) -> Vec<(u32, u32)> {
    let Some(grid) = Grid::over(points) else {
        return Vec::new();
    };
    let mut order: Vec<u32> = (0..points.len() as u32).collect();
    shuffle(&mut order, seeded);
    let mut degrees = vec![0_usize; points.len()];
    let mut pairs = FxHashSet::default();
    let mut within = Vec::new();
    for point in order {
        within.clear();
        grid.within(points, point, reach_m, &mut within);
        while degrees[point as usize] < max_neighbours && !within.is_empty() {
            let other = within.swap_remove(draw(within.len(), seeded));
            let pair = (point.min(other), point.max(other));
            if degrees[other as usize] < max_neighbours && pairs.insert(pair) {
                degrees[point as usize] += 1;
                degrees[other as usize] += 1;
            }
        }
    }
    let mut pairs: Vec<(u32, u32)> = pairs.into_iter().collect();
    pairs.sort_unstable();
    pairs
}

/// A whole number below `count`, which is above 0.
fn draw(count: usize, seeded: &mut Seeded) -> usize {
    ((seeded.unit() * count as f64) as usize).min(count - 1)
}

/// Fisher and Yates.
fn shuffle(places: &mut [u32], seeded: &mut Seeded) {
    for last in (1..places.len()).rev() {
        places.swap(last, draw(last + 1, seeded));
    }
}

/// Takes candidates, shortest first, while both ends have room; sorted.
fn shortest_first(
    points: usize,
    mut candidates: Vec<Candidate>,
    max_neighbours: usize,
    joined: &[(u32, u32)],
) -> Vec<(u32, u32)> {
    candidates.sort_unstable_by(|left, right| {
        let by_length = left.length_m.total_cmp(&right.length_m);
        by_length.then_with(|| left.ends.cmp(&right.ends))
    });
    candidates.dedup_by(|left, right| left.ends == right.ends);

    let mut degrees = vec![0_usize; points];
    for &(from, to) in joined {
        degrees[from as usize] += 1;
        degrees[to as usize] += 1;
    }
    let mut pairs = Vec::new();
    for Candidate { ends, .. } in candidates {
        let (from, to) = (ends.0 as usize, ends.1 as usize);
        let has_room = degrees[from] < max_neighbours && degrees[to] < max_neighbours;
        if has_room && !joined.contains(&ends) {
            degrees[from] += 1;
            degrees[to] += 1;
            pairs.push(ends);
        }
    }
    pairs.sort_unstable();
    pairs
}

/// A pair that may be joined, the lower place first.
struct Candidate {
    length_m: f64,
    ends: (u32, u32),
}

/// Every point with each of its nearest; a pair that choose each other comes twice.
fn candidates(points: &[Point], max_neighbours: usize, reach_m: f64) -> Vec<Candidate> {
    let Some(grid) = Grid::over(points) else {
        return Vec::new();
    };
    let mut found = Vec::new();
    let mut nearest = Vec::with_capacity(max_neighbours + 1);
    // In the order of the cells, so that one search finds in the cache what the last one read.
    for &point in &grid.members {
        grid.nearest(points, point, max_neighbours, reach_m, &mut nearest);
        found.extend(nearest.iter().map(|&(length_m, other)| Candidate {
            length_m,
            ends: (point.min(other), point.max(other)),
        }));
    }
    found
}

/// A square grid over the points; each cell lists its points.
struct Grid {
    origin: Point,
    side_m: f64,
    columns: usize,
    rows: usize,
    /// Where each cell's points begin in `members`.
    first: Vec<u32>,
    members: Vec<u32>,
}

impl Grid {
    fn over(points: &[Point]) -> Option<Self> {
        let bounds = Bounds::around(points.iter().copied())?;
        let cells_across = (points.len() as f64 / POINTS_PER_CELL)
            .sqrt()
            .ceil()
            .max(1.0);
        let side_m = match bounds.longer_side_m() / cells_across {
            // All points coincide; one cell of any size holds them.
            0.0 => 1.0,
            side_m => side_m,
        };
        let mut grid = Self {
            origin: bounds.min,
            side_m,
            columns: (bounds.width_m() / side_m) as usize + 1,
            rows: (bounds.height_m() / side_m) as usize + 1,
            first: Vec::new(),
            members: vec![0; points.len()],
        };
        let mut ends = vec![0_u32; grid.columns * grid.rows + 1];
        for &point in points {
            ends[grid.cell_of(point) + 1] += 1;
        }
        for cell in 1..ends.len() {
            ends[cell] += ends[cell - 1];
        }
        grid.first.clone_from(&ends);
        for (place, &point) in points.iter().enumerate() {
            let next = &mut ends[grid.cell_of(point)];
            grid.members[*next as usize] = place as u32;
            *next += 1;
        }
        Some(grid)
    }

    fn column_and_row(&self, point: Point) -> (usize, usize) {
        let column = ((point.x - self.origin.x) / self.side_m) as usize;
        let row = ((point.y - self.origin.y) / self.side_m) as usize;
        (column.min(self.columns - 1), row.min(self.rows - 1))
    }

    fn cell_of(&self, point: Point) -> usize {
        let (column, row) = self.column_and_row(point);
        row * self.columns + column
    }

    /// The other points no farther from one than the reach, without those that coincide with it.
    fn within(&self, points: &[Point], centre: u32, reach_m: f64, found: &mut Vec<u32>) {
        let position = points[centre as usize];
        let (column, row) = self.column_and_row(position);
        let rings = ((reach_m / self.side_m) as usize).saturating_add(2);
        for ring in 0..rings.min(self.columns.max(self.rows)) {
            self.for_ring(column, row, ring, |other| {
                let length_m = position.distance_m(points[other as usize]);
                if length_m > 0.0 && length_m <= reach_m {
                    found.push(other);
                }
            });
        }
    }

    /// The `count` points nearest to one, no farther than the reach, by distance and then by place.
    ///
    /// Points that coincide with it are left out: no segment has length 0.
    fn nearest(
        &self,
        points: &[Point],
        centre: u32,
        count: usize,
        reach_m: f64,
        nearest: &mut Vec<(f64, u32)>,
    ) {
        nearest.clear();
        let position = points[centre as usize];
        let (column, row) = self.column_and_row(position);
        for ring in 0..self.columns.max(self.rows) {
            // Everything in this ring is at least this far away, less the rounding of the cell's
            // edge.
            let ring_m = (ring as f64 - 1.0).max(0.0) * self.side_m;
            let is_full = nearest.len() == count;
            let enough = is_full
                && nearest
                    .last()
                    .is_some_and(|&(farthest_m, _)| farthest_m < ring_m);
            if enough || ring_m > reach_m {
                return;
            }
            self.for_ring(column, row, ring, |other| {
                let length_m = position.distance_m(points[other as usize]);
                if other == centre || length_m > reach_m || length_m == 0.0 {
                    return;
                }
                let entry = (length_m, other);
                let place = nearest.partition_point(|kept| is_nearer(kept, &entry));
                if place < count {
                    nearest.truncate(count - 1);
                    nearest.insert(place, entry);
                }
            });
        }
    }

    /// Visits the points of the cells that lie `ring` cells from the one given.
    fn for_ring(&self, column: usize, row: usize, ring: usize, mut visit: impl FnMut(u32)) {
        let columns = column.saturating_sub(ring)..=(column + ring).min(self.columns - 1);
        let rows = row.saturating_sub(ring)..=(row + ring).min(self.rows - 1);
        for y in rows {
            let is_edge_row = y.abs_diff(row) == ring;
            let (mut x, end) = (*columns.start(), *columns.end());
            while x <= end {
                if is_edge_row || x.abs_diff(column) == ring {
                    let cell = y * self.columns + x;
                    let members = self.first[cell] as usize..self.first[cell + 1] as usize;
                    self.members[members].iter().for_each(|&other| visit(other));
                    x += 1;
                } else {
                    // From the left side of the ring to its right side.
                    x = column + ring;
                }
            }
        }
    }
}

fn is_nearer(left: &(f64, u32), right: &(f64, u32)) -> bool {
    left.0
        .total_cmp(&right.0)
        .then_with(|| left.1.cmp(&right.1))
        .is_lt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::network::seeded::Seeded;

    #[test]
    fn the_grid_finds_the_same_nearest_points_as_a_full_search() {
        for seed in 0..20 {
            let mut seeded = Seeded::new(seed);
            let spread_m = [1000.0, 30.0][usize::from(seeded.below(2))];
            let points: Vec<Point> = (0..150)
                .map(|_| {
                    Point::new(
                        seeded.between(0.0, 1000.0),
                        seeded.between(0.0, spread_m).round(),
                    )
                })
                .collect();
            let grid = Grid::over(&points).expect("there are points");
            let (count, reach_m) = (
                1 + usize::from(seeded.below(12)),
                seeded.between(10.0, 400.0),
            );
            let mut found = Vec::new();
            for centre in 0..points.len() as u32 {
                grid.nearest(&points, centre, count, reach_m, &mut found);
                let mut expected: Vec<(f64, u32)> = (0..points.len() as u32)
                    .map(|other| {
                        (
                            points[centre as usize].distance_m(points[other as usize]),
                            other,
                        )
                    })
                    .filter(|&(length_m, other)| {
                        other != centre && length_m > 0.0 && length_m <= reach_m
                    })
                    .collect();
                expected.sort_by(|left, right| left.partial_cmp(right).expect("finite lengths"));
                expected.truncate(count);
                assert_eq!(found, expected, "seed {seed}, point {centre}");
            }
        }
    }

    #[test]
    fn points_that_coincide_are_not_joined() {
        let here = Point::new(1.0, 1.0);
        assert_eq!(join_nearest(&[here, here], 3, 10.0, &[]), []);
        let there = Point::new(2.0, 1.0);
        assert_eq!(join_nearest(&[here, here, there], 1, 10.0, &[]), [(0, 2)]);
    }
}
