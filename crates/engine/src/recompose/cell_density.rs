//! Cell density-based recomposition (paper, Algorithm 2).
//!
//! Around A, B and each of their neighbours lies a square, the larger the sparser the cell that the node
//! is in. Their union is searched, and all squares grow by a cell until a path is found or the area is
//! everything.

use super::connectivity::Connectivity;
use super::explanation::{AreaShape, Stage};
use super::local::{LocalProblem, LocalResult};
use super::request::Parameters;
use crate::geo::{Bounds, Point, TOLERANCE_M};
use crate::network::{DensityGrid, NodeIx};

/// What the strategy keeps between requests.
#[derive(Debug, Default)]
pub(super) struct CellMemory {
    /// A, B and their neighbours, with the factor of each one's cell.
    squares: Vec<(Point, f64)>,
    /// Nodes outside the area with the smallest half-side, per unit of factor, that brings them in; the last is the nearest.
    waiting: Vec<(f64, NodeIx)>,
}

pub(super) fn recompose(
    problem: &mut LocalProblem<'_>,
    parameters: &Parameters,
    grid: &DensityGrid,
    memory: &mut CellMemory,
    connectivity: &mut Connectivity,
) -> LocalResult {
    if parameters.passes_over(Stage::Cells) {
        return problem.resort_to_everything();
    }
    collect_squares(problem, grid, memory);
    let step_m = grid.cell_size_m();
    let mut side_m = step_m;
    fill_squares(problem, memory, side_m);
    let mut arrival = problem.search_area();
    record(problem, memory, side_m, arrival.is_some());
    let all_nodes = problem.gap.all_nodes();
    if arrival.is_none() && problem.area.len() < all_nodes {
        collect_waiting(problem, memory);
        connectivity.restart(problem);
    }
    while arrival.is_none() && problem.area.len() < all_nodes {
        side_m += step_m;
        admit_waiting(problem, memory, connectivity, side_m);
        match connectivity.connects(problem) {
            true => arrival = problem.search_area(),
            false => problem.search_in_vain(),
        }
        record(problem, memory, side_m, arrival.is_some());
    }
    problem.result(arrival, Stage::Cells, false)
}

/// A, B and their neighbours in the topology; closed ones are left out, those across closed segments are not.
fn collect_squares(problem: &LocalProblem<'_>, grid: &DensityGrid, memory: &mut CellMemory) {
    let gap = problem.gap;
    let square = |node: NodeIx| {
        let position = gap.position(node);
        (position, grid.density_at(position).factor())
    };
    memory.squares.clear();
    for end in [gap.from, gap.to] {
        memory.squares.push(square(end));
        let neighbours = gap.topology().arcs(end).iter().map(|arc| arc.to);
        let admitted = neighbours.filter(|&node| gap.admits(node));
        memory.squares.extend(admitted.map(square));
    }
}

fn fill_squares(problem: &mut LocalProblem<'_>, memory: &CellMemory, side_m: f64) {
    problem.restart_area();
    let area = &mut *problem.area;
    for &(centre, factor) in &memory.squares {
        let middle = Bounds {
            min: centre,
            max: centre,
        };
        let half_side_m = factor * side_m;
        problem
            .gap
            .visit_nodes_in(middle.grown(half_side_m), |node, position| {
                if off_centre_m(centre, position) <= half_side_m + TOLERANCE_M {
                    area.insert(node);
                }
            });
    }
}

/// Lists the nodes outside the area by the side that will bring them in, farthest first.
fn collect_waiting(problem: &LocalProblem<'_>, memory: &mut CellMemory) {
    let gap = problem.gap;
    memory.waiting.clear();
    for node in gap.topology().nodes() {
        if problem.area.contains(node) || !gap.admits(node) {
            continue;
        }
        let position = gap.position(node);
        let needed = memory
            .squares
            .iter()
            .map(|&(centre, factor)| (off_centre_m(centre, position) - TOLERANCE_M) / factor);
        memory
            .waiting
            .push((needed.fold(f64::INFINITY, f64::min), node));
    }
    memory
        .waiting
        .sort_unstable_by(|one, other| other.0.total_cmp(&one.0));
}

fn admit_waiting(
    problem: &mut LocalProblem<'_>,
    memory: &mut CellMemory,
    connectivity: &mut Connectivity,
    side_m: f64,
) {
    while let Some(&(needed_m, node)) = memory.waiting.last() {
        if needed_m > side_m {
            return;
        }
        memory.waiting.pop();
        problem.area.insert(node);
        connectivity.add(problem, node);
    }
}

/// The half-side of the smallest square about `centre` that holds a position, in metres.
fn off_centre_m(centre: Point, position: Point) -> f64 {
    (position.x - centre.x)
        .abs()
        .max((position.y - centre.y).abs())
}

fn record(problem: &mut LocalProblem<'_>, memory: &CellMemory, side_m: f64, found: bool) {
    let shape = || AreaShape::Squares {
        squares: memory
            .squares
            .iter()
            .map(|&(centre, factor)| (centre, factor * side_m))
            .collect(),
    };
    problem.record(Stage::Cells, false, found, shape, |area, node| {
        area.contains(node)
    });
}
