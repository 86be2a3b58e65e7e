//! ESRI ASCII grid: `ncols`, `nrows`, `xllcorner` or `xllcenter`, `yll..`, `cellsize` (or `dx`, `dy`),
//! `NODATA_value`, then the heights row by row from the north. A height stands in the middle of its cell.

use super::format::{Content, Format, Holds, MOST_CELLS};
use super::text::{Words, comma, has_comma, number, shown};
use crate::raster::Raster;
use interface_defs::diagnostic::Diagnostic;

/// This format.
pub const FORMAT: Format = Format {
    name: "an ESRI grid",
    extensions: &["asc"],
    also: &[],
    holds: Holds::Raster,
    begins: |head| matches!(head.word(), "ncols" | "nrows"),
    read: |source| read(&source.bytes, source.file).map(Content::Raster),
};

/// Height of a cell without height where the file does not say.
const NODATA: f64 = -9999.0;

#[derive(Default)]
struct Header {
    columns: Option<usize>,
    rows: Option<usize>,
    /// x and y of the lower left cell, and whether its middle is meant.
    west: Option<(f64, bool)>,
    south: Option<(f64, bool)>,
    size: [Option<f64>; 2],
    nodata: Option<f64>,
}

/// Read the bytes of `file`.
fn read(bytes: &[u8], file: &str) -> Result<Raster, Diagnostic> {
    let mut words = Words::new(bytes);
    let header = header(&mut words, file)?;
    let missing =
        |name: &str| Diagnostic::in_file(file, format!("the header has no `{name}`; is this an ESRI grid?"));
    let columns = header.columns.ok_or_else(|| missing("ncols"))?;
    let rows = header.rows.ok_or_else(|| missing("nrows"))?;
    let (west, middle_x) = header.west.ok_or_else(|| missing("xllcorner"))?;
    let (south, middle_y) = header.south.ok_or_else(|| missing("yllcorner"))?;
    let [Some(dx), Some(dy)] = header.size else { return Err(missing("cellsize")) };
    let nodata = header.nodata.unwrap_or(NODATA);
    // A height and its separator are two bytes at least.
    let count = columns.checked_mul(rows).filter(|n| n / 2 <= bytes.len());
    let Some(count) = count else {
        return Err(Diagnostic::in_file(
            file,
            format!("the header promises {columns} x {rows} heights, and the file has {} bytes", bytes.len()),
        ));
    };
    if count > MOST_CELLS {
        return Err(Diagnostic::in_file(file, format!("{count} heights: up to {MOST_CELLS} are read")));
    }
    let mut heights = Vec::with_capacity(count);
    // Heights in the first line, and the lines that hold heights: they show whether columns and rows are exchanged.
    let (mut first_line, mut in_first, mut last_line) = (None, 0, 0);
    while heights.len() < count {
        let Some(word) = words.next() else {
            let what =
                format!("the file ends after {} of {columns} x {rows} = {count} heights", heights.len());
            return Err(Diagnostic::in_file(format!("{file}:{}", words.line), what));
        };
        let Some(z) = number(word) else {
            let (row, column) = (heights.len() / columns + 1, heights.len() % columns + 1);
            let what = format!("`{}` is no height (row {row}, column {column})", shown(word));
            return Err(comma(word, Diagnostic::in_file(format!("{file}:{}", words.line), what)));
        };
        in_first += usize::from(*first_line.get_or_insert(words.line) == words.line);
        last_line = words.line;
        heights.push(if z == nodata { f64::NAN } else { z });
    }
    if let Some(word) = words.next() {
        let what = format!("`{}` follows the last of {count} heights", shown(word));
        return Err(Diagnostic::in_file(format!("{file}:{}", words.line), what));
    }
    let lines = last_line + 1 - first_line.unwrap_or(last_line);
    if columns != rows && in_first == rows && lines == columns {
        let what = format!(
            "{lines} lines of {in_first} heights each, and the header says {columns} columns in {rows} rows: they are exchanged"
        );
        return Err(
            Diagnostic::in_file(file, what).try_instead(format!("write ncols {rows} and nrows {columns}"))
        );
    }
    let half = |middle: bool, size: f64| if middle { 0.0 } else { 0.5 * size };
    Ok(Raster {
        corner: [west + half(middle_x, dx), south + half(middle_y, dy)],
        spacing: [dx, dy],
        counts: [columns, rows],
        heights,
    })
}

fn header(words: &mut Words, file: &str) -> Result<Header, Diagnostic> {
    let mut header = Header::default();
    // The header ends where a line begins with a number.
    while let Some(name) = words.peek().filter(|word| number(word).is_none()) {
        words.next();
        let line = words.line;
        let fault = |what: String| Diagnostic::in_file(format!("{file}:{line}"), what);
        if has_comma(name) {
            return Err(comma(name, fault(format!("`{}` is no height (row 1, column 1)", shown(name)))));
        }
        let name = String::from_utf8_lossy(name).to_lowercase();
        let known = [
            "ncols",
            "nrows",
            "xllcorner",
            "xllcenter",
            "yllcorner",
            "yllcenter",
            "cellsize",
            "dx",
            "dy",
            "nodata_value",
        ];
        if !known.contains(&name.as_str()) {
            return Err(fault(format!(
                "`{}` is no line of the header of an ESRI grid",
                shown(name.as_bytes())
            )));
        }
        let Some(word) = words.next() else { return Err(fault(format!("`{name}` has no value"))) };
        if name == "nodata_value" && word.eq_ignore_ascii_case(b"nan") {
            return Err(fault("`nan` as mark of cells without height cannot be read; write a number".into()));
        }
        let value = number(word)
            .ok_or_else(|| comma(word, fault(format!("`{}` is no number for `{name}`", shown(word)))))?;
        let count = || {
            let whole = value >= 1.0 && value.fract() == 0.0 && value <= 1e9;
            if whole {
                Ok(value as usize)
            } else {
                Err(fault(format!("{name} = {value}: it must be a whole number above 0")))
            }
        };
        let size = || {
            if value > 0.0 {
                Ok(Some(value))
            } else {
                Err(fault(format!("{name} = {value}: it must lie above 0")))
            }
        };
        match name.as_str() {
            "ncols" => header.columns = Some(count()?),
            "nrows" => header.rows = Some(count()?),
            "xllcorner" => header.west = Some((value, false)),
            "xllcenter" => header.west = Some((value, true)),
            "yllcorner" => header.south = Some((value, false)),
            "yllcenter" => header.south = Some((value, true)),
            "cellsize" => header.size = [size()?; 2],
            "dx" => header.size[0] = size()?,
            "dy" => header.size[1] = size()?,
            _ => header.nodata = Some(value),
        }
    }
    Ok(header)
}
