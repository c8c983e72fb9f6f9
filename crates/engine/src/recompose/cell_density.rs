//! Cell density-based recomposition (paper, Algorithm 2).
//!
//! Around A, B and each of their neighbours lies a square, the larger the sparser the cell that the node
//! is in. Their union is searched, and all squares grow by a cell until a path is found or the area is
//! everything. The nodes of the area are read from the cells' own lists.

use super::connectivity::Connectivity;
use super::explanation::{AreaShape, Stage};
use super::local::{LocalProblem, LocalResult};
use super::request::{CellArea, Parameters};
use crate::geo::{Bounds, Point, TOLERANCE_M};
use crate::network::{CellPlace, DensityGrid, NodeIx};

/// What the strategy keeps between requests.
#[derive(Debug, Default)]
pub(super) struct CellMemory {
    /// A, B and their neighbours, with the factor of each one's cell.
    squares: Vec<(Point, f64)>,
    /// By cell, the last area that it was taken into as a whole.
    taken: Vec<u32>,
    /// Counts the areas.
    areas: u32,
    /// Nodes outside the area with the smallest half-side, per unit of factor, that brings them in; the last is the nearest.
    waiting: Vec<(f64, NodeIx)>,
}

/// The grid, and what of it is searched about a node.
#[derive(Clone, Copy)]
struct Cells<'a> {
    grid: &'a DensityGrid,
    area: CellArea,
}

impl Cells<'_> {
    /// Where a position counts as lying: at itself, or with every other of its cell.
    fn place(&self, position: Point) -> Point {
        match self.area {
            CellArea::Squares => position,
            CellArea::Slices => {
                let (column, row) = self.grid.cell_at(position);
                let side_m = self.grid.cell_size_m();
                Point::new(column as f64 * side_m, row as f64 * side_m)
            }
        }
    }

    /// Hands every cell that may hold nodes of a square to `visit`, and whether the square holds all of it.
    fn visit(&self, centre: Point, half_side_m: f64, mut visit: impl FnMut(CellPlace, bool)) {
        let grid = self.grid;
        let middle = Bounds {
            min: centre,
            max: centre,
        };
        let (square, reach_m) = (middle.grown(half_side_m), half_side_m + TOLERANCE_M);
        let (columns, rows) = match self.area {
            CellArea::Squares => grid.cells_in(middle.grown(reach_m)),
            CellArea::Slices => {
                let cells = |length_m: f64| (length_m / grid.cell_size_m()).round() as usize;
                let reach = (reach_m / grid.cell_size_m()).floor() as usize;
                grid.cells_around((cells(centre.x), cells(centre.y)), reach)
            }
        };
        for row in rows {
            for column in columns.clone() {
                let cell = grid.bounds_of((column, row));
                let is_whole = self.area == CellArea::Slices
                    || square.contains(cell.min) && square.contains(cell.max);
                visit((column, row), is_whole);
            }
        }
    }
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
    let cells = Cells {
        grid,
        area: parameters.cell_area,
    };
    collect_squares(problem, cells, memory);
    let step_m = grid.cell_size_m();
    let mut side_m = step_m;
    fill_squares(problem, cells, memory, side_m);
    let mut arrival = problem.search_area();
    record(problem, cells, memory, side_m, arrival.is_some());
    let all_nodes = problem.gap.all_nodes();
    if arrival.is_none() && problem.area.len() < all_nodes {
        collect_waiting(problem, cells, memory);
        connectivity.restart(problem);
    }
    while arrival.is_none() && problem.area.len() < all_nodes {
        side_m += step_m;
        admit_waiting(problem, memory, connectivity, side_m);
        match connectivity.connects(problem) {
            true => arrival = problem.search_area(),
            false => problem.search_in_vain(),
        }
        record(problem, cells, memory, side_m, arrival.is_some());
    }
    problem.result(arrival, Stage::Cells, false)
}

/// A, B and their neighbours in the topology; closed ones are left out, those across closed segments are not.
fn collect_squares(problem: &LocalProblem<'_>, cells: Cells<'_>, memory: &mut CellMemory) {
    let gap = problem.gap;
    let square = |node: NodeIx| {
        let position = gap.position(node);
        (
            cells.place(position),
            cells.grid.density_at(position).factor(),
        )
    };
    memory.squares.clear();
    for end in [gap.from, gap.to] {
        memory.squares.push(square(end));
        let neighbours = gap.topology().arcs(end).iter().map(|arc| arc.to);
        let admitted = neighbours.filter(|&node| gap.admits(node));
        memory.squares.extend(admitted.map(square));
    }
}

/// Fills the area from the cells' own lists of nodes; a cell that lies within one square is taken once.
fn fill_squares(
    problem: &mut LocalProblem<'_>,
    cells: Cells<'_>,
    memory: &mut CellMemory,
    side_m: f64,
) {
    problem.restart_area();
    let CellMemory {
        squares,
        taken,
        areas,
        ..
    } = memory;
    *areas = areas.wrapping_add(1);
    if taken.len() != cells.grid.cell_count() || *areas == 0 {
        taken.clear();
        taken.resize(cells.grid.cell_count(), 0);
        *areas = 1;
    }
    let (gap, area) = (problem.gap, &mut *problem.area);
    for &(centre, factor) in squares.iter() {
        let half_side_m = factor * side_m;
        cells.visit(centre, half_side_m, |place, is_whole| {
            let cell = cells.grid.number(place);
            if taken[cell] == *areas {
                return;
            }
            if is_whole {
                taken[cell] = *areas;
            }
            for &node in cells.grid.nodes(cell) {
                let is_inside =
                    || off_centre_m(centre, gap.position(node)) <= half_side_m + TOLERANCE_M;
                if (is_whole || is_inside()) && gap.admits(node) {
                    area.insert(node);
                }
            }
        });
    }
}

/// Lists the nodes outside the area by the side that will bring them in, farthest first.
fn collect_waiting(problem: &LocalProblem<'_>, cells: Cells<'_>, memory: &mut CellMemory) {
    let gap = problem.gap;
    memory.waiting.clear();
    for node in gap.topology().nodes() {
        if problem.area.contains(node) || !gap.admits(node) {
            continue;
        }
        let position = cells.place(gap.position(node));
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

fn record(
    problem: &mut LocalProblem<'_>,
    cells: Cells<'_>,
    memory: &CellMemory,
    side_m: f64,
    found: bool,
) {
    let square = |&(centre, factor): &(Point, f64)| match cells.area {
        CellArea::Squares => (centre, factor * side_m),
        CellArea::Slices => {
            // Whole cells: half a cell beyond the middle of the outermost ones.
            let half_m = cells.grid.cell_size_m() / 2.0;
            let corner = cells.grid.bounds_of((0, 0)).min;
            let middle = Point::new(corner.x + centre.x + half_m, corner.y + centre.y + half_m);
            (middle, factor * side_m + half_m)
        }
    };
    let shape = || AreaShape::Squares {
        squares: memory.squares.iter().map(square).collect(),
    };
    problem.record(Stage::Cells, false, found, shape, |area, node| {
        area.contains(node)
    });
}
