//! Square cells over a network and the nodes in each (paper, Algorithm 2, lines 1-3).

use super::identity::NodeIx;
use crate::geo::{Bounds, Point};
use std::ops::RangeInclusive;
use thiserror::Error;

/// More cells than this are refused.
pub const MAX_CELLS: u64 = 1_000_000;
/// Without a cell size, the network's longer side is cut into this many.
const DEFAULT_CELLS_PER_SIDE: f64 = 16.0;

/// How full a cell is, against the spread of all cells.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Density {
    /// More than two thirds of the spread.
    Dense,
    /// Up to two thirds of the spread.
    Average,
    /// Up to a third of the spread.
    Sparse,
}

impl Density {
    /// The paper's factor: a sparse cell reaches three times as far as a dense one.
    pub fn factor(self) -> f64 {
        match self {
            Self::Dense => 1.0,
            Self::Average => 2.0,
            Self::Sparse => 3.0,
        }
    }
}

/// Why a cell size is refused.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
pub enum CellSizeError {
    /// Not a finite number above 0.
    #[error("the cell size is {cell_size_m} m; it must be finite and above 0")]
    NotPositive {
        /// The size asked for, in metres.
        cell_size_m: f64,
    },
    /// Too many cells.
    #[error("a cell size of {cell_size_m} m gives more than {MAX_CELLS} cells; take larger cells")]
    TooManyCells {
        /// The size asked for, in metres.
        cell_size_m: f64,
    },
}

/// A column and a row of cells.
pub type CellPlace = (usize, usize);

/// The nodes on a grid of square cells from the lower corner of the network's bounding box.
#[derive(Clone, Debug, PartialEq)]
pub struct DensityGrid {
    corner: Point,
    cell_size_m: f64,
    columns: usize,
    rows: usize,
    /// Where each cell's nodes begin in `members`, row by row, and the end of the last.
    first: Vec<u32>,
    members: Vec<NodeIx>,
    spread: u64,
}

impl DensityGrid {
    /// Counts all nodes of a topology, closed or not, in cells of `cell_size_m`.
    ///
    /// # Errors
    /// A size that is not finite and above 0, or that gives more than [`MAX_CELLS`] cells.
    pub fn count(
        positions: &[Point],
        bounds: Bounds,
        cell_size_m: f64,
    ) -> Result<Self, CellSizeError> {
        if !(cell_size_m.is_finite() && cell_size_m > 0.0) {
            return Err(CellSizeError::NotPositive { cell_size_m });
        }
        let columns_wanted = (bounds.width_m() / cell_size_m).ceil().max(1.0);
        let rows_wanted = (bounds.height_m() / cell_size_m).ceil().max(1.0);
        if columns_wanted * rows_wanted > MAX_CELLS as f64 {
            return Err(CellSizeError::TooManyCells { cell_size_m });
        }
        let shape = (columns_wanted as usize, rows_wanted as usize);
        Ok(Self::arrange(positions, bounds.min, cell_size_m, shape))
    }

    /// The grid of the default cell size: the network size / 16; one cell where the network has no extent.
    pub(super) fn by_default(positions: &[Point], bounds: Bounds) -> Self {
        let cell_size_m = match bounds.longer_side_m() {
            size_m if size_m > 0.0 => size_m / DEFAULT_CELLS_PER_SIDE,
            _ => 1.0,
        };
        Self::count(positions, bounds, cell_size_m)
            .unwrap_or_else(|_| Self::arrange(positions, bounds.min, cell_size_m, (1, 1)))
    }

    /// Sorts the nodes into cells, by columns and rows.
    fn arrange(
        positions: &[Point],
        corner: Point,
        cell_size_m: f64,
        (columns, rows): (usize, usize),
    ) -> Self {
        let mut grid = Self {
            corner,
            cell_size_m,
            columns,
            rows,
            first: Vec::new(),
            members: vec![NodeIx(0); positions.len()],
            spread: 0,
        };
        let mut ends = vec![0_u32; columns * rows + 1];
        let cells: Vec<usize> = positions
            .iter()
            .map(|&position| grid.number(grid.cell_at(position)))
            .collect();
        for &cell in &cells {
            ends[cell + 1] += 1;
        }
        let counts = &ends[1..];
        let fullest = counts.iter().copied().max().unwrap_or(0);
        let emptiest = counts.iter().copied().min().unwrap_or(0);
        grid.spread = u64::from(fullest - emptiest);
        for cell in 1..ends.len() {
            ends[cell] += ends[cell - 1];
        }
        grid.first.clone_from(&ends);
        for (node, cell) in (0..).zip(cells) {
            grid.members[ends[cell] as usize] = NodeIx(node);
            ends[cell] += 1;
        }
        grid
    }

    /// The side of a cell, in metres.
    pub fn cell_size_m(&self) -> f64 {
        self.cell_size_m
    }

    /// How many cells there are.
    pub fn cell_count(&self) -> usize {
        self.columns * self.rows
    }

    /// How full the cell is that a position lies in.
    pub fn density_at(&self, position: Point) -> Density {
        let nodes = self.nodes(self.number(self.cell_at(position))).len() as u64;
        if 3 * nodes <= self.spread {
            Density::Sparse
        } else if 3 * nodes <= 2 * self.spread {
            Density::Average
        } else {
            Density::Dense
        }
    }

    /// The nodes in a cell, by its number.
    pub fn nodes(&self, cell: usize) -> &[NodeIx] {
        &self.members[self.first[cell] as usize..self.first[cell + 1] as usize]
    }

    /// The cell that a position lies in, the nearest one for a position outside.
    pub fn cell_at(&self, position: Point) -> CellPlace {
        let place = |offset_m: f64, cells: usize| {
            ((offset_m / self.cell_size_m).floor().max(0.0) as usize).min(cells - 1)
        };
        (
            place(position.x - self.corner.x, self.columns),
            place(position.y - self.corner.y, self.rows),
        )
    }

    /// The number of a cell.
    pub fn number(&self, (column, row): CellPlace) -> usize {
        row * self.columns + column
    }

    /// The columns and rows of the cells that may hold a node in a box.
    pub fn cells_in(&self, bounds: Bounds) -> (RangeInclusive<usize>, RangeInclusive<usize>) {
        let (low, high) = (self.cell_at(bounds.min), self.cell_at(bounds.max));
        (low.0..=high.0, low.1..=high.1)
    }

    /// The columns and rows up to a number of cells from one.
    pub fn cells_around(
        &self,
        (column, row): CellPlace,
        cells: usize,
    ) -> (RangeInclusive<usize>, RangeInclusive<usize>) {
        let reach = |place: usize, count: usize| {
            place.saturating_sub(cells)..=place.saturating_add(cells).min(count - 1)
        };
        (reach(column, self.columns), reach(row, self.rows))
    }

    /// The square of a cell.
    pub fn bounds_of(&self, (column, row): CellPlace) -> Bounds {
        let corner = |column: usize, row: usize| {
            Point::new(
                self.corner.x + column as f64 * self.cell_size_m,
                self.corner.y + row as f64 * self.cell_size_m,
            )
        };
        Bounds {
            min: corner(column, row),
            max: corner(column + 1, row + 1),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_are_classed_by_a_third_of_the_spread() {
        // Four cells of 10 m in a row with 6, 4, 2 and 1 nodes (the one on the upper edge counts in the last): the spread is 5.
        let at = |x: f64| Point::new(x, 0.0);
        let mut positions = vec![at(0.0), at(40.0)];
        positions.extend([at(1.0); 5]);
        positions.extend([at(11.0); 4]);
        positions.extend([at(21.0); 2]);
        let bounds = Bounds::around(positions.iter().copied()).unwrap();
        let grid = DensityGrid::count(&positions, bounds, 10.0).unwrap();
        assert_eq!(grid.density_at(at(5.0)), Density::Dense);
        assert_eq!(grid.density_at(at(15.0)), Density::Dense);
        assert_eq!(grid.density_at(at(25.0)), Density::Average);
        assert_eq!(grid.density_at(at(35.0)), Density::Sparse);
        let cell = grid.number(grid.cell_at(at(35.0)));
        assert_eq!(grid.nodes(cell), [NodeIx(1)]);
    }

    #[test]
    fn cell_sizes_that_make_no_grid_are_refused() {
        let positions = [Point::new(0.0, 0.0), Point::new(1000.0, 1000.0)];
        let bounds = Bounds::around(positions).unwrap();
        for size in [0.0, -1.0, f64::NAN, f64::INFINITY, 0.5] {
            assert!(
                DensityGrid::count(&positions, bounds, size).is_err(),
                "{size}"
            );
        }
    }
}
