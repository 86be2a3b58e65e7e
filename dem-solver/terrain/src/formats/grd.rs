//! Surfer grid as text: `DSAA`, columns and rows, the limits of x, y and z, then the heights row by row from the south.
//! A height stands at a node: the limits of x and y are those of the first and the last one.
//!
//! Source: Golden Software, Surfer user's guide, "ASCII GRD Files"; the mark of nodes without height is Surfer's.

use super::format::{Content, Format, Holds, MOST_CELLS};
use super::text::{Words, comma, number, shown};
use crate::raster::Raster;
use interface_defs::diagnostic::Diagnostic;

/// This format.
pub const FORMAT: Format = Format {
    name: "a Surfer grid",
    extensions: &["grd"],
    also: &[],
    holds: Holds::Raster,
    begins: |head| head.begins(&[b"DSAA"]),
    read: |source| read(&source.bytes, source.file).map(Content::Raster),
};

/// From this on a height marks a node without one.
const BLANK: f64 = 1.701_41e38;

fn read(bytes: &[u8], file: &str) -> Result<Raster, Diagnostic> {
    let mut words = Words::new(bytes);
    if words.next() != Some(b"DSAA") {
        return Err(Diagnostic::in_file(
            file,
            "the file does not begin with `DSAA`; is this a Surfer grid as text?",
        ));
    }
    let [columns, rows] = [count(&mut words, file, "columns")?, count(&mut words, file, "rows")?];
    let mut limits = |axis: &str| -> Result<[f64; 2], Diagnostic> {
        let both =
            [value(&mut words, file, &format!("{axis}lo"))?, value(&mut words, file, &format!("{axis}hi"))?];
        match both {
            [low, high] if low < high || axis == "z" => Ok(both),
            [low, high] => Err(Diagnostic::in_file(
                format!("{file}:{}", words.line),
                format!("{axis} from {low} to {high}: it must rise"),
            )),
        }
    };
    let ([x0, x1], [y0, y1], _) = (limits("x")?, limits("y")?, limits("z")?);
    // A height and its separator are two bytes at least.
    let Some(cells) = columns.checked_mul(rows).filter(|n| n / 2 <= bytes.len()) else {
        let what =
            format!("the header promises {columns} x {rows} heights, and the file has {} bytes", bytes.len());
        return Err(Diagnostic::in_file(file, what));
    };
    if cells > MOST_CELLS {
        return Err(Diagnostic::in_file(file, format!("{cells} heights: up to {MOST_CELLS} are read")));
    }
    let mut heights = vec![f64::NAN; cells];
    // Rasters hold their rows from the north.
    for row in heights.chunks_exact_mut(columns).rev() {
        for height in row {
            let z = value(&mut words, file, "height")?;
            *height = if z >= BLANK { f64::NAN } else { z };
        }
    }
    if let Some(word) = words.next() {
        let what = format!("`{}` follows the last of {cells} heights", shown(word));
        return Err(Diagnostic::in_file(format!("{file}:{}", words.line), what));
    }
    let spacing = [(x1 - x0) / (columns - 1) as f64, (y1 - y0) / (rows - 1) as f64];
    Ok(Raster { corner: [x0, y0], spacing, counts: [columns, rows], heights })
}

/// The next word as a number of columns or rows: two at least, so that they have a distance.
fn count(words: &mut Words, file: &str, what: &str) -> Result<usize, Diagnostic> {
    let count = value(words, file, what)?;
    if count >= 2.0 && count.fract() == 0.0 && count <= 1e9 {
        return Ok(count as usize);
    }
    let what = format!("{count} {what}: it must be a whole number above 1");
    Err(Diagnostic::in_file(format!("{file}:{}", words.line), what))
}

/// The next word as a number.
fn value(words: &mut Words, file: &str, what: &str) -> Result<f64, Diagnostic> {
    let word = words.next();
    let at = format!("{file}:{}", words.line);
    let Some(word) = word else {
        return Err(Diagnostic::in_file(at, format!("the file ends where its {what} must stand: cut off?")));
    };
    let error = || Diagnostic::in_file(at, format!("`{}` is no number for its {what}", shown(word)));
    number(word).ok_or_else(|| comma(word, error()))
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEAD: &str = "DSAA\n3 2\n100 104\n50 55\n1 6\n";

    #[test]
    fn rows_come_from_the_south_and_nodes_without_height_are_holes() {
        let raster = read(format!("{HEAD}1 2 3\n4 1.70141e+38 6\n").as_bytes(), "t.grd").expect("a grid");
        assert_eq!((raster.corner, raster.spacing, raster.counts), ([100.0, 50.0], [2.0, 5.0], [3, 2]));
        assert_eq!([raster.nearest(100.0, 50.0), raster.nearest(104.0, 50.0)], [Some(1.0), Some(3.0)]);
        assert_eq!([raster.nearest(100.0, 55.0), raster.nearest(102.0, 55.0)], [Some(4.0), None]);
    }

    #[test]
    fn what_is_no_grid_is_refused_with_its_line() {
        for (text, expected) in [
            ("DSAB\n3 2\n".into(), "t.grd: the file does not begin with `DSAA`"),
            ("DSAA\n1 2\n".into(), "t.grd:2: 1 columns: it must be a whole number above 1"),
            ("DSAA\n3 2\n104 100\n".into(), "t.grd:3: x from 104 to 100: it must rise"),
            (format!("{HEAD}1 2 3\n4 5\n"), "t.grd:8: the file ends where its height must stand: cut off?"),
            (format!("{HEAD}1 2 3\n4 x 6\n"), "t.grd:7: `x` is no number for its height"),
            (format!("{HEAD}1 2 3\n4,5 5 6\n"), "a number is written with a point: 4.5"),
            (format!("{HEAD}1 2 3\n4 5 6\n7"), "t.grd:8: `7` follows the last of 6 heights"),
            (
                HEAD.replace("3 2", "90000 90000"),
                "the header promises 90000 x 90000 heights, and the file has",
            ),
        ] {
            let error = read(text.as_bytes(), "t.grd").expect_err(expected).to_string();
            assert!(error.contains(expected), "{error}");
        }
    }
}
