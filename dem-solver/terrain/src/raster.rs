//! Heights, or numbers of zones, at the crossings of a grid.

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::Path;
use toolkit::files;

/// A raster.
#[derive(Debug, Clone, PartialEq)]
pub struct Raster {
    /// First column's x and last row's y [m].
    pub corner: [f64; 2],
    /// Distance of columns and of rows [m], above 0.
    pub spacing: [f64; 2],
    /// Columns, rows.
    pub counts: [usize; 2],
    /// Heights [m], row by row from the north (largest y), west to east; NaN where there is none.
    pub heights: Vec<f64>,
}

impl Raster {
    /// Value of the cell that holds a point, `None` outside or where there is none.
    pub fn nearest(&self, x: f64, y: f64) -> Option<f64> {
        let cell = |v: f64, from: f64, size: f64, count: usize| {
            let at = ((v - from) / size).round();
            (at >= 0.0 && at < count as f64).then_some(at as usize)
        };
        let column = cell(x, self.corner[0], self.spacing[0], self.counts[0])?;
        let row = self.counts[1] - 1 - cell(y, self.corner[1], self.spacing[1], self.counts[1])?;
        Some(self.heights[row * self.counts[0] + column]).filter(|v| !v.is_nan())
    }

    /// Write it as an ESRI grid.
    pub fn write_asc(&self, path: &Path) -> std::io::Result<()> {
        let [dx, dy] = self.spacing;
        let [nx, ny] = self.counts;
        let mut text =
            format!("ncols {nx}\nnrows {ny}\nxllcenter {}\nyllcenter {}\n", self.corner[0], self.corner[1]);
        let _ = if dx == dy { writeln!(text, "cellsize {dx}") } else { writeln!(text, "dx {dx}\ndy {dy}") };
        text += "NODATA_value -9999\n";
        let mut file = std::io::BufWriter::new(files::create(path)?);
        for row in self.heights.chunks(nx) {
            for (i, z) in row.iter().enumerate() {
                let z = if z.is_nan() { -9999.0 } else { *z };
                let _ = write!(text, "{}{z}", if i > 0 { " " } else { "" });
            }
            text.push('\n');
            file.write_all(text.as_bytes())?;
            text.clear();
        }
        file.flush()
    }
}
