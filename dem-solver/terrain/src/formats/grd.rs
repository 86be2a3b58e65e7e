//! Surfer grid as text: `DSAA`, columns and rows, the limits of x, y and z, then the heights row by row from the south.
//! A height stands at a node: the limits of x and y are those of the first and the last one.
//!
//! Source: Golden Software, Surfer user's guide, "ASCII GRD Files"; the mark of nodes without height is Surfer's.

use super::format::{Format, MOST_CELLS, Reader};
use crate::raster::Raster;
use toolkit::words::{ReadError, Words, comma, number, shown};

/// This format.
pub const FORMAT: Format = Format {
    name: "a Surfer grid",
    extensions: &["grd"],
    also: &[],
    begins: |head| head.begins(&[b"DSAA"]),
    read: Reader::Raster(read),
};

/// From this on a height marks a node without one.
const BLANK: f64 = 1.701_41e38;

fn read(bytes: &[u8]) -> Result<Raster, ReadError> {
    let mut words = Words::new(bytes);
    if words.next_word() != Some(b"DSAA") {
        return Err("the file does not begin with `DSAA`; is this a Surfer grid as text?".into());
    }
    let counts = [count(&mut words, "columns")?, count(&mut words, "rows")?];
    let mut limits = [[0.0; 2]; 3];
    for ([low, high], axis) in limits.iter_mut().zip(["x", "y", "z"]) {
        (*low, *high) = (value(&mut words, &format!("{axis}lo"))?, value(&mut words, &format!("{axis}hi"))?);
        if *low >= *high && axis != "z" {
            return Err(words.fault(format!("{axis} from {low} to {high}: it must rise")));
        }
    }
    let (from_south, _) = words.heights(counts, MOST_CELLS, |z| z >= BLANK)?;
    let heights = from_south.chunks_exact(counts[0]).rev().flatten().copied().collect();
    let spacing = [0, 1].map(|k| (limits[k][1] - limits[k][0]) / (counts[k] - 1) as f64);
    Ok(Raster { corner: [limits[0][0], limits[1][0]], spacing, counts, heights })
}

/// The next word as a number of columns or rows: two at least, so that they have a distance.
fn count(words: &mut Words, what: &str) -> Result<usize, ReadError> {
    let count = value(words, what)?;
    if count >= 2.0 && count.fract() == 0.0 && count <= 1e9 {
        return Ok(count as usize);
    }
    Err(words.fault(format!("{count} {what}: it must be a whole number above 1")))
}

/// The next word as a number.
fn value(words: &mut Words, what: &str) -> Result<f64, ReadError> {
    let word = words.next_word();
    let word =
        word.ok_or_else(|| words.fault(format!("the file ends where its {what} must stand: cut off?")))?;
    let error = || words.fault(format!("`{}` is not a number for its {what}", shown(word)));
    number(word).ok_or_else(|| comma(word, error()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    const HEAD: &str = "DSAA\n3 2\n100 104\n50 55\n1 6\n";

    #[test]
    fn rows_come_from_the_south_and_nodes_without_height_are_holes() {
        let raster = read(format!("{HEAD}1 2 3\n4 1.70141e+38 6\n").as_bytes()).expect("a grid");
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
            (format!("{HEAD}1 2 3\n4 5\n"), "t.grd:8: the file ends after 5 of 3 x 2 = 6 heights"),
            (format!("{HEAD}1 2 3\n4 x 6\n"), "t.grd:7: `x` is no height (row 2, column 2)"),
            (HEAD.replace("55", "y"), "t.grd:4: `y` is not a number for its yhi"),
            ("DSAA\n3 2\n0".into(), "t.grd:3: the file ends where its xhi must stand: cut off?"),
            (format!("{HEAD}1 2 3\n4,5 5 6\n"), "a number is written with a point: 4.5"),
            (format!("{HEAD}1 2 3\n4 5 6\n7"), "t.grd:8: `7` follows the last of 6 heights"),
            (
                HEAD.replace("3 2", "90000 90000"),
                "the header promises 90000 x 90000 heights, and the file has",
            ),
        ] {
            let error = read(text.as_bytes()).expect_err(expected).in_file(Path::new("t.grd")).to_string();
            assert!(error.contains(expected), "{error}");
        }
    }
}
