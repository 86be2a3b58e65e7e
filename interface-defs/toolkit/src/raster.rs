//! Heights, or numbers of zones, at the crossings of a grid; and ESRI ASCII grids of them.
//!
//! Such a grid is `ncols`, `nrows`, `xllcorner` or `xllcenter`, `yll..`, `cellsize` (or `dx`, `dy`), `NODATA_value`, then the
//! heights row by row from the north. A height stands in the middle of its cell.

use super::files;
use super::words::{ReadError, Words, comma, has_comma, number, shown};
use std::fmt::Write as _;
use std::io::Write as _;
use std::path::Path;

/// Height of a cell without height where the file does not say.
const NODATA: f64 = -9999.0;

/// What the header states: columns, rows, x and y of the lower left cell, its size along x and y, the mark of cells without
/// height; and whether x and y are those of its middle.
type Header = ([Option<f64>; 7], [bool; 2]);

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

    /// Read an ESRI ASCII grid of at most `most` heights.
    pub fn read_asc(bytes: &[u8], most: usize) -> Result<Self, ReadError> {
        let mut words = Words::new(bytes);
        let (values, middle) = header(&mut words)?;
        let stated = |at: usize, name: &str| {
            values[at].ok_or_else(|| format!("the header has no `{name}`; is this an ESRI grid?"))
        };
        let [columns, rows] = [stated(0, "ncols")? as usize, stated(1, "nrows")? as usize];
        let corner = [stated(2, "xllcorner")?, stated(3, "yllcorner")?];
        let spacing = [stated(4, "cellsize")?, stated(5, "cellsize")?];
        let nodata = values[6].unwrap_or(NODATA);
        let (heights, [in_first, lines]) = words.heights([columns, rows], most, |z| z == nodata)?;
        // Lines show whether columns and rows are exchanged.
        if columns != rows && in_first == rows && lines == columns {
            let what = format!(
                "{lines} lines of {in_first} heights each, and the header says {columns} columns in {rows} rows: they are exchanged"
            );
            return Err(ReadError::new(what).try_instead(format!("write ncols {rows} and nrows {columns}")));
        }
        let corner = [0, 1].map(|k| corner[k] + if middle[k] { 0.0 } else { 0.5 * spacing[k] });
        Ok(Self { corner, spacing, counts: [columns, rows], heights })
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

fn header(words: &mut Words) -> Result<Header, ReadError> {
    let (mut values, mut middle) = Header::default();
    // The header ends where a line begins with a number.
    while let Some(word) = words.peek().filter(|word| number(word).is_none()) {
        words.next_word();
        if has_comma(word) {
            let what = format!("`{}` is no height (row 1, column 1)", shown(word));
            return Err(comma(word, words.fault(what)));
        }
        let name = String::from_utf8_lossy(word).to_lowercase();
        let places = match name.as_str() {
            "ncols" => 0..1,
            "nrows" => 1..2,
            "xllcorner" | "xllcenter" => 2..3,
            "yllcorner" | "yllcenter" => 3..4,
            "cellsize" => 4..6,
            "dx" => 4..5,
            "dy" => 5..6,
            "nodata_value" => 6..7,
            _ => {
                let what = format!("`{}` is no line of the header of an ESRI grid", shown(name.as_bytes()));
                return Err(words.fault(what));
            }
        };
        let line = words.line;
        let value = words.next_word().filter(|word| words.line == line || number(word).is_some());
        let Some(word) = value else { return Err(ReadError::at(line, format!("`{name}` has no value"))) };
        if places.start == 6 && word.eq_ignore_ascii_case(b"nan") {
            let what = "`nan` as mark of cells without height cannot be read; write a number";
            return Err(words.fault(what.into()));
        }
        let Some(value) = number(word) else {
            let what = format!("`{}` is no number for `{name}`", shown(word));
            return Err(comma(word, words.fault(what)));
        };
        let due = match places.start {
            0 | 1 if !(value >= 1.0 && value.fract() == 0.0 && value <= 1e9) => "be a whole number above 0",
            4 | 5 if value <= 0.0 => "lie above 0",
            _ => "",
        };
        if !due.is_empty() {
            return Err(words.fault(format!("{name} = {value}: it must {due}")));
        }
        if let corner @ 2..4 = places.start {
            middle[corner - 2] = name.ends_with("center");
        }
        values[places].fill(Some(value));
    }
    Ok((values, middle))
}
