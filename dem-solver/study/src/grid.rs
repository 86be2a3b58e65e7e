//! The cells of the maps: squares over the box around the terrain, counted row by row from the north-west.

use dem_rocks::results::map::sheet::round_step;
use dem_terrain::Terrain;

/// Cells along the longer side where the study does not say how large they are, about.
const CELLS: f64 = 300.0;
/// Most cells.
pub const MAX_CELLS: f64 = 16e6;

/// The cells.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Grid {
    /// West and north edge, local [m].
    pub corner: [f64; 2],
    /// Edge of a cell [m].
    pub cell: f64,
    /// Columns, rows.
    pub counts: [usize; 2],
}

impl Grid {
    /// Over a terrain. Edges lie at whole multiples of the cell in the terrain's coordinates.
    pub fn new(ground: &Terrain, cell: Option<f64>) -> Self {
        let size = ground.highest - ground.lowest;
        let cell = cell.unwrap_or_else(|| round_step(size.x.max(size.y) / CELLS));
        let edge = |value: f64, axis: usize, up: bool| {
            let at = (value + ground.origin[axis]) / cell;
            (if up { at.ceil() } else { at.floor() }) * cell - ground.origin[axis]
        };
        let west = edge(ground.lowest.x, 0, false);
        let north = edge(ground.highest.y, 1, true);
        let columns = ((ground.highest.x - west) / cell).ceil().max(1.0) as usize;
        let rows = ((north - ground.lowest.y) / cell).ceil().max(1.0) as usize;
        Self { corner: [west, north], cell, counts: [columns, rows] }
    }

    /// Number of cells.
    pub fn cells(&self) -> usize {
        self.counts[0] * self.counts[1]
    }

    /// The cell of a place, local [m].
    pub fn at(&self, [x, y]: [f64; 2]) -> Option<u32> {
        let column = (x - self.corner[0]) / self.cell;
        let row = (self.corner[1] - y) / self.cell;
        let inside =
            column >= 0.0 && row >= 0.0 && column < self.counts[0] as f64 && row < self.counts[1] as f64;
        inside.then(|| (row as usize * self.counts[0] + column as usize) as u32)
    }

    /// Middle of a cell, local [m].
    pub fn middle(&self, cell: usize) -> [f64; 2] {
        let (column, row) = (cell % self.counts[0], cell / self.counts[0]);
        [self.corner[0] + (column as f64 + 0.5) * self.cell, self.corner[1] - (row as f64 + 0.5) * self.cell]
    }

    /// Shares (0 to 1) of the straight line from `a` to `b` at which it comes into another cell, in order.
    pub fn cuts(&self, a: [f64; 2], b: [f64; 2], found: &mut Vec<f64>) {
        found.clear();
        for axis in 0..2 {
            let sign = if axis == 0 { 1.0 } else { -1.0 };
            let at = |p: [f64; 2]| sign * (p[axis] - self.corner[axis]) / self.cell;
            let (from, to) = (at(a), at(b));
            let (low, high) = (from.min(to).floor() + 1.0, from.max(to).ceil() - 1.0);
            let mut line = low;
            while line <= high {
                found.push((line - from) / (to - from));
                line += 1.0;
            }
        }
        found.retain(|s| *s > 0.0 && *s < 1.0);
        found.sort_by(f64::total_cmp);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_way_is_cut_where_it_comes_into_another_cell() {
        let grid = Grid { corner: [0.0, 10.0], cell: 2.0, counts: [5, 5] };
        assert_eq!(grid.at([0.5, 9.5]), Some(0));
        assert_eq!(grid.at([9.9, 0.1]), Some(24));
        assert_eq!((grid.at([-0.1, 5.0]), grid.at([5.0, 10.1])), (None, None));
        assert_eq!(grid.middle(6), [3.0, 7.0]);
        let mut cuts = Vec::new();
        grid.cuts([1.0, 9.0], [5.0, 7.0], &mut cuts);
        assert_eq!(cuts, [0.25, 0.5, 0.75]);
        grid.cuts([1.0, 9.0], [1.5, 9.0], &mut cuts);
        assert!(cuts.is_empty());
        assert_eq!([0.11, 0.4, 2.0, 3.1].map(round_step), [0.2, 0.5, 2.0, 5.0]);
    }
}
