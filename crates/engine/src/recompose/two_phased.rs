//! Two-phased recomposition (paper, Algorithm 3).
//!
//! First a triangle, a rhombus and a rectangle along A - B, each searched unless it has too few nodes to
//! be worth it; then the rectangle grown, round by round, by the nearest neighbour of each of its nodes.

use super::connectivity::Connectivity;
use super::explanation::{AreaShape, Stage};
use super::local::{Gap, LocalProblem, LocalResult};
use super::polygons::{LegPolygons, holds, polygon_of};
use super::request::{AreaTest, Parameters};
use crate::geo::{Bounds, Point, TOLERANCE_M};
use crate::network::NodeIx;

/// What the strategy keeps between requests.
#[derive(Debug, Default)]
pub(super) struct GrowthMemory {
    /// Nodes of the rectangle, each with where it lies.
    classified: Vec<(NodeIx, Place)>,
    /// Nodes of the area that had a neighbour outside when last looked at.
    active: Vec<NodeIx>,
    /// What this round adds.
    added: Vec<NodeIx>,
}

impl GrowthMemory {
    /// The nodes of an area, A and B included.
    fn count(&self, belongs: impl Fn(&Place) -> bool) -> usize {
        let ends = 2;
        let nodes = self.classified.iter();
        ends + nodes.filter(|(_, place)| belongs(place)).count()
    }
}

/// In which of the shapes a node lies.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    pub(super) rectangle: bool,
    pub(super) rhombus: bool,
    pub(super) left: bool,
    pub(super) right: bool,
    /// Only where polygons decide, and once the half is chosen; else it follows from the others.
    pub(super) triangle: bool,
}

/// The frame along A - B: `s` metres from A towards B, `t` metres to the left of it.
pub(super) struct LegFrame {
    from: Point,
    along: Point,
    length_m: f64,
    half_height_m: f64,
}

impl LegFrame {
    fn new(gap: &Gap<'_>, val_ratio: f64) -> Self {
        let (from, to) = (gap.position(gap.from), gap.position(gap.to));
        let length_m = from.distance_m(to);
        Self {
            from,
            along: Point::new(to.x - from.x, to.y - from.y),
            length_m,
            half_height_m: val_ratio * length_m,
        }
    }

    fn place(&self, position: Point) -> Place {
        let (dx, dy) = (position.x - self.from.x, position.y - self.from.y);
        let s = (dx * self.along.x + dy * self.along.y) / self.length_m;
        let t = (self.along.x * dy - self.along.y * dx) / self.length_m;
        let (length_m, val) = (self.length_m, self.half_height_m);
        let e = TOLERANCE_M;
        let slack = e * (val * val + length_m * length_m / 4.0).sqrt();
        let off_middle = (s - length_m / 2.0).abs() * val + t.abs() * length_m / 2.0;
        Place {
            rectangle: -e <= s && s <= length_m + e && t.abs() <= val + e,
            rhombus: off_middle <= val * length_m / 2.0 + slack,
            left: t >= -e,
            right: t <= e,
            triangle: false,
        }
    }

    /// The point at a share of the way from A to B, and a number of metres to the left of it.
    pub(super) fn point(&self, s_share: f64, t_m: f64) -> Point {
        let unit = Point::new(self.along.x / self.length_m, self.along.y / self.length_m);
        Point::new(
            self.from.x + self.along.x * s_share - unit.y * t_m,
            self.from.y + self.along.y * s_share + unit.x * t_m,
        )
    }

    /// Half the height of rectangle and rhombus, in metres.
    pub(super) fn half_height_m(&self) -> f64 {
        self.half_height_m
    }

    /// The corners of a stage's shape; the triangle lies on the left or on the right.
    pub(super) fn corners(&self, stage: Stage, on_left: bool) -> Vec<Point> {
        let val = self.half_height_m;
        let (start, end) = (self.point(0.0, 0.0), self.point(1.0, 0.0));
        let (left, right) = (self.point(0.5, val), self.point(0.5, -val));
        match stage {
            Stage::Triangle if on_left => vec![start, end, left],
            Stage::Triangle => vec![start, right, end],
            Stage::Rhombus => vec![start, right, end, left],
            _ => vec![
                self.point(0.0, -val),
                self.point(1.0, -val),
                self.point(1.0, val),
                self.point(0.0, val),
            ],
        }
    }

    /// A box around rectangle and rhombus, the latter with its tolerance, which is not cut by the rectangle.
    fn bounds(&self) -> Bounds {
        let (half_length_m, val) = (self.length_m / 2.0, self.half_height_m);
        let slack_m = TOLERANCE_M * (val * val + half_length_m * half_length_m).sqrt()
            / val.min(half_length_m);
        let (start, end) = (self.point(0.0, 0.0), self.point(1.0, 0.0));
        let (tip_x, tip_y) = (
            self.along.y.abs() / self.length_m,
            self.along.x.abs() / self.length_m,
        );
        Bounds {
            min: Point::new(
                start.x.min(end.x) - tip_x * val,
                start.y.min(end.y) - tip_y * val,
            ),
            max: Point::new(
                start.x.max(end.x) + tip_x * val,
                start.y.max(end.y) + tip_y * val,
            ),
        }
        .grown(slack_m)
    }
}

pub(super) fn recompose(
    problem: &mut LocalProblem<'_>,
    parameters: &Parameters,
    memory: &mut GrowthMemory,
    connectivity: &mut Connectivity,
) -> LocalResult {
    let frame = LegFrame::new(&problem.gap, parameters.val_ratio);
    let polygons = match parameters.area_test {
        AreaTest::Frame => None,
        AreaTest::Polygon => Some(LegPolygons::new(&frame)),
    };
    match &polygons {
        None => classify(problem, &frame, memory, |position| frame.place(position)),
        Some(polygons) => classify(problem, &frame, memory, |position| polygons.place(position)),
    }
    let rectangle = memory.count(|place| place.rectangle);
    let on_left = memory.count(|place| place.rectangle && place.left)
        >= memory.count(|place| place.rectangle && place.right);
    let in_triangle: fn(&Place) -> bool = match (&polygons, on_left) {
        (Some(_), _) => |place| place.triangle,
        (None, true) => |place| place.rhombus && place.rectangle && place.left,
        (None, false) => |place| place.rhombus && place.rectangle && place.right,
    };
    if polygons.is_some() {
        place_in_triangle(&problem.gap, &frame, on_left, memory);
    }
    let in_rhombus: fn(&Place) -> bool = |place| place.rhombus;
    let in_rectangle: fn(&Place) -> bool = |place| place.rectangle;
    let stages = [
        (
            Stage::Triangle,
            in_triangle,
            4 * memory.count(in_triangle) < rectangle,
        ),
        (
            Stage::Rhombus,
            in_rhombus,
            2 * memory.count(in_rhombus) < rectangle,
        ),
        (Stage::Rectangle, in_rectangle, false),
    ];
    for (stage, belongs, has_few) in stages {
        fill(problem, memory, belongs);
        let skipped = (parameters.stage_skipping && has_few) || parameters.passes_over(stage);
        let arrival = match skipped {
            true => None,
            false => problem.search_area(),
        };
        let shape = || AreaShape::Polygon {
            corners: frame.corners(stage, on_left),
        };
        let found = arrival.is_some();
        problem.record(stage, skipped, found, shape, |area, node| {
            area.contains(node)
        });
        if found {
            return problem.result(arrival, stage, false);
        }
    }
    if parameters.passes_over(Stage::Grown) {
        return problem.resort_to_everything();
    }
    grow(problem, &frame, memory, connectivity)
}

/// Finds the nodes of rectangle and rhombus; A and B belong to every area and are not listed.
fn classify(
    problem: &LocalProblem<'_>,
    frame: &LegFrame,
    memory: &mut GrowthMemory,
    place_of: impl Fn(Point) -> Place,
) {
    let gap = problem.gap;
    memory.classified.clear();
    gap.visit_nodes_in(frame.bounds(), |node, position| {
        if node == gap.from || node == gap.to {
            return;
        }
        let place = place_of(position);
        if place.rectangle || place.rhombus {
            memory.classified.push((node, place));
        }
    });
}

/// Tests the nodes of the rhombus against the triangle of the taken half.
fn place_in_triangle(gap: &Gap<'_>, frame: &LegFrame, on_left: bool, memory: &mut GrowthMemory) {
    let triangle = polygon_of(&frame.corners(Stage::Triangle, on_left));
    for (node, place) in &mut memory.classified {
        place.triangle = place.rhombus && holds(&triangle, gap.position(*node));
    }
}

fn fill(problem: &mut LocalProblem<'_>, memory: &GrowthMemory, belongs: fn(&Place) -> bool) {
    problem.restart_area();
    for (node, place) in &memory.classified {
        if belongs(place) {
            problem.area.insert(*node);
        }
    }
}

/// Phase 2: the rectangle, grown in rounds.
fn grow(
    problem: &mut LocalProblem<'_>,
    frame: &LegFrame,
    memory: &mut GrowthMemory,
    connectivity: &mut Connectivity,
) -> LocalResult {
    let all_nodes = problem.gap.all_nodes();
    let rectangle_nodes = problem.area.len();
    memory.active.clear();
    memory.active.extend_from_slice(problem.area.nodes());
    connectivity.restart(problem);
    loop {
        choose_nearest(problem, memory);
        let before = problem.area.len();
        for &node in &memory.added {
            if problem.area.insert(node) {
                connectivity.add(problem, node);
                memory.active.push(node);
            }
        }
        if problem.area.len() == before || 2 * problem.area.len() >= all_nodes {
            return problem.resort_to_everything();
        }
        let arrival = match connectivity.connects(problem) {
            true => problem.search_area(),
            false => {
                problem.search_in_vain();
                None
            }
        };
        let added = match problem.stages {
            Some(_) => problem.area.nodes()[rectangle_nodes..].to_vec(),
            None => Vec::new(),
        };
        let shape = || AreaShape::Grown {
            corners: frame.corners(Stage::Rectangle, true),
            added,
        };
        let found = arrival.is_some();
        problem.record(Stage::Grown, false, found, shape, |area, node| {
            area.contains(node)
        });
        if found {
            return problem.result(arrival, Stage::Grown, false);
        }
    }
}

/// Chooses, for every node of the area, its nearest neighbour outside; drops nodes that have none left.
fn choose_nearest(problem: &LocalProblem<'_>, memory: &mut GrowthMemory) {
    let gap = problem.gap;
    let topology = gap.topology();
    let GrowthMemory { active, added, .. } = memory;
    added.clear();
    active.retain(|&node| {
        let outside = gap
            .open_arcs(node)
            .filter(|arc| !problem.area.contains(arc.to));
        let nearest = outside.min_by(|one, other| {
            let by_length = one.length_m.total_cmp(&other.length_m);
            by_length.then_with(|| topology.rank(one.to).cmp(&topology.rank(other.to)))
        });
        added.extend(nearest.map(|arc| arc.to));
        nearest.is_some()
    });
}
