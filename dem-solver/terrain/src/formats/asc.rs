//! ESRI ASCII grid: `ncols`, `nrows`, `xllcorner` or `xllcenter`, `yll..`, `cellsize` (or `dx`, `dy`),
//! `NODATA_value`, then the heights row by row from the north. A height stands in the middle of its cell.

use super::format::{Format, Reader, Words, comma, has_comma, number, shown};
use crate::raster::Raster;
use dem_solid::input::ReadError;

/// This format.
pub const FORMAT: Format = Format {
    name: "an ESRI grid",
    extensions: &["asc"],
    also: &[],
    begins: |head| matches!(head.word(), "ncols" | "nrows"),
    read: Reader::Raster(read),
};

/// Height of a cell without height where the file does not say.
const NODATA: f64 = -9999.0;

/// What the header states: columns, rows, x and y of the lower left cell, its size along x and y, the mark of cells without
/// height; and whether x and y are those of its middle.
type Header = ([Option<f64>; 7], [bool; 2]);

fn read(bytes: &[u8]) -> Result<Raster, ReadError> {
    let mut words = Words::new(bytes);
    let (values, middle) = header(&mut words)?;
    let stated = |at: usize, name: &str| {
        values[at].ok_or_else(|| format!("the header has no `{name}`; is this an ESRI grid?"))
    };
    let [columns, rows] = [stated(0, "ncols")? as usize, stated(1, "nrows")? as usize];
    let corner = [stated(2, "xllcorner")?, stated(3, "yllcorner")?];
    let spacing = [stated(4, "cellsize")?, stated(5, "cellsize")?];
    let nodata = values[6].unwrap_or(NODATA);
    let (heights, [in_first, lines]) = words.heights([columns, rows], |z| z == nodata)?;
    // Lines show whether columns and rows are exchanged.
    if columns != rows && in_first == rows && lines == columns {
        let what = format!(
            "{lines} lines of {in_first} heights each, and the header says {columns} columns in {rows} rows: they are exchanged"
        );
        return Err(ReadError::new(what).try_instead(format!("write ncols {rows} and nrows {columns}")));
    }
    let corner = [0, 1].map(|k| corner[k] + if middle[k] { 0.0 } else { 0.5 * spacing[k] });
    Ok(Raster { corner, spacing, counts: [columns, rows], heights })
}

fn header(words: &mut Words) -> Result<Header, ReadError> {
    let (mut values, mut middle) = Header::default();
    // The header ends where a line begins with a number.
    while let Some(word) = words.peek().filter(|word| number(word).is_none()) {
        words.next();
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
        let Some(word) = words.next() else { return Err(words.fault(format!("`{name}` has no value"))) };
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
