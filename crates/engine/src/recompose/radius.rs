//! Radius-based recomposition (paper, Algorithm 1).
//!
//! A circle about the middle of A - B with radius `|AB|`, grown by 0.2 of the network size until a path is
//! found; where the radius exceeds half the network size, the whole network.

use super::explanation::{AreaShape, Stage};
use super::local::{LocalProblem, LocalResult};
use super::request::Parameters;
use crate::geo::{Bounds, Point, TOLERANCE_M};

/// What the radius grows by, as a share of the network size (Algorithm 1, line 9).
const GROWTH: f64 = 0.2;
/// The largest radius, as a share of the network size (Algorithm 1, line 10).
const LIMIT: f64 = 0.5;

pub(super) fn recompose(problem: &mut LocalProblem<'_>, parameters: &Parameters) -> LocalResult {
    if parameters.passes_over(Stage::Circle) {
        return problem.resort_to_everything();
    }
    let gap = problem.gap;
    let (from, to) = (gap.position(gap.from), gap.position(gap.to));
    let size_m = gap.topology().size_m();
    let centre = Bounds::around([from, to]).map_or(from, Bounds::centre);
    let mut radius_m = from.distance_m(to);
    loop {
        fill_circle(problem, centre, radius_m);
        let arrival = problem.search_area();
        let shape = || AreaShape::Circle { centre, radius_m };
        problem.record(
            Stage::Circle,
            false,
            arrival.is_some(),
            shape,
            |area, node| area.contains(node),
        );
        if arrival.is_some() {
            return problem.result(arrival, Stage::Circle, false);
        }
        radius_m += GROWTH * size_m;
        if radius_m > LIMIT * size_m {
            return problem.resort_to_everything();
        }
    }
}

fn fill_circle(problem: &mut LocalProblem<'_>, centre: Point, radius_m: f64) {
    problem.restart_area();
    let reach_m = radius_m + TOLERANCE_M;
    let middle = Bounds {
        min: centre,
        max: centre,
    };
    let area = &mut *problem.area;
    problem
        .gap
        .visit_nodes_in(middle.grown(radius_m), |node, position| {
            if centre.distance_m(position) <= reach_m {
                area.insert(node);
            }
        });
}
