//! Heights of the ground on a grid: an ESRI ASCII grid, as `dem-solver ground` and any GIS write it. Between four heights the
//! ground is bilinear.

use super::{LONGEST, named};
use interface_defs::diagnostic::Diagnostic;
use std::path::Path;
use toolkit::input_file;
use toolkit::raster::Raster;
use toolkit::scene::Scene;

/// Most heights that are read.
const MOST: usize = 20_000_000;

/// A raster of heights.
#[derive(Debug, Clone, PartialEq)]
pub struct Heights {
    /// x of the first column's and y of the last row's middles [m].
    pub corner: [f64; 2],
    /// Distance of columns and of rows [m].
    pub spacing: [f64; 2],
    /// Number of columns and rows, 2 of each at least.
    pub counts: [usize; 2],
    /// Row by row from the north; NaN where there is none [m].
    heights: Vec<f64>,
}

impl Heights {
    /// Read the file that `key` of `scene` names as `path`.
    pub fn read(scene: &Scene, key: &str, path: &Path) -> Result<Self, Diagnostic> {
        let path = &named(scene, key, "file", path)?;
        let file = path.display().to_string();
        Self::parse(&file, input_file::read(path, LONGEST)?)
    }

    /// From the text of `file`.
    pub fn parse(file: &str, text: impl AsRef<[u8]>) -> Result<Self, Diagnostic> {
        let read = Raster::read_asc(text.as_ref(), MOST).map_err(|e| e.in_file(Path::new(file)))?;
        let Raster { corner, spacing, counts, heights } = read;
        if counts.contains(&1) {
            let what =
                format!("{} columns and {} rows: 2 or more of each are required", counts[0], counts[1]);
            return Err(Diagnostic::in_file(file, what));
        }
        Ok(Self { corner, spacing, counts, heights })
    }

    /// Height of the ground [m]; `None` outside, and where one of the four around has none.
    pub fn at(&self, x: f64, y: f64) -> Option<f64> {
        let place = |v: f64, axis: usize| {
            let cells = self.counts[axis] - 1;
            let at = (v - self.corner[axis]) / self.spacing[axis];
            // A point on the border that is beyond it by rounding is on it.
            let rounding = 1e-9 * cells as f64;
            (at >= -rounding && at <= cells as f64 + rounding).then(|| {
                let at = at.clamp(0.0, cells as f64);
                let cell = (at as usize).min(cells - 1);
                (cell, at - cell as f64)
            })
        };
        let ((i, u), (j, v)) = (place(x, 0)?, place(y, 1)?);
        let [columns, rows] = self.counts;
        let node = |i: usize, j: usize, weight: f64| {
            // Without weight it may have no height.
            if weight == 0.0 { 0.0 } else { weight * self.heights[(rows - 1 - j) * columns + i] }
        };
        let low = node(i, j, (1.0 - u) * (1.0 - v)) + node(i + 1, j, u * (1.0 - v));
        let height = low + node(i, j + 1, (1.0 - u) * v) + node(i + 1, j + 1, u * v);
        height.is_finite().then_some(height)
    }

    /// The same, or that `what` stands where there is none.
    pub fn below(&self, x: f64, y: f64, what: &str) -> Result<f64, String> {
        self.at(x, y).ok_or_else(|| {
            format!(
                "{what} stands at x = {x:.2}, y = {y:.2} m, where there is no ground: its heights are known for {}, and may have \
                 holes",
                self.extent()
            )
        })
    }

    /// Height at a column from the west and a row from the south [m]; NaN where there is none.
    pub fn height(&self, column: usize, row: usize) -> f64 {
        self.heights[(self.counts[1] - 1 - row) * self.counts[0] + column]
    }

    /// Its extent in words.
    fn extent(&self) -> String {
        let to = |axis: usize| self.corner[axis] + (self.counts[axis] - 1) as f64 * self.spacing[axis];
        format!("x {:.2} to {:.2}, y {:.2} to {:.2} m", self.corner[0], to(0), self.corner[1], to(1))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grid(header: &str, heights: &str) -> Result<Heights, String> {
        Heights::parse("g.asc", format!("ncols 3\nnrows 2\n{header}\n{heights}\n")).map_err(|e| e.to_string())
    }

    #[test]
    fn a_plane_is_read_exactly_wherever_it_is_asked() {
        // z = 2 x + 3 y, x 10, 14, 18, y 1, 6.
        for header in ["xllcenter 10\nyllcenter 1\ndx 4\ndy 5", "XLLCORNER 8\nyllcorner -1.5\ndx 4\ndy 5"] {
            let grid = grid(header, "38 46 54\n23 31 39").expect("a grid");
            for (x, y) in [(10.0, 1.0), (18.0, 6.0), (14.0, 3.5), (17.9, 1.1), (11.0, 6.0)] {
                assert!((grid.at(x, y).expect("inside") - (2.0 * x + 3.0 * y)).abs() < 1e-13);
            }
            assert_eq!((grid.at(9.9, 2.0), grid.at(18.1, 2.0), grid.at(12.0, 0.9)), (None, None, None));
        }
    }

    #[test]
    fn beside_a_cell_without_height_there_is_none() {
        let grid =
            grid("xllcenter 0\nyllcenter 0\ncellsize 1\nNODATA_value -1", "5 6 -1\n1 2 3").expect("a grid");
        assert_eq!((grid.at(1.5, 0.5), grid.at(2.0, 0.0), grid.at(2.0, 0.1)), (None, Some(3.0), None));
        // On the edge of the cell the height that is missing has no weight.
        assert_eq!(grid.at(1.0, 0.5), Some(4.0));
    }

    #[test]
    fn a_grid_that_is_wrong_says_where() {
        for (header, heights, what) in [
            ("xllcenter 0\nyllcenter 0", "1 2 3\n4 5 6", "g.asc: the header has no `cellsize`"),
            ("xllcenter 0\nyllcenter 0\ncellsize 0", "1", "g.asc:5: cellsize = 0: it must lie above 0"),
            ("xllcenter 0\nyllcenter 0\ncellsize 1", "1 2 3\n4 5 x", "g.asc:7: `x` is no height"),
            (
                "xllcenter 0\nyllcenter 0\ncellsize 1",
                "1 2 3\n4 5",
                "g.asc:8: the file ends after 5 of 3 x 2 = 6 heights",
            ),
            ("xllcenter\nyllcenter 0\ncellsize 1", "1 2 3\n4 5 6", "g.asc:3: `xllcenter` has no value"),
            (
                "nrows 1\nxllcenter 0\nyllcenter 0\ncellsize 1",
                "1 2 3",
                "g.asc: 3 columns and 1 rows: 2 or more",
            ),
            ("cells 4", "1", "g.asc:3: `cells` is no line of the header"),
        ] {
            let fault = grid(header, heights).expect_err(what);
            assert!(fault.contains(what), "{fault}");
        }
    }
}
