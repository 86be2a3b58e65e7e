//! What a format of terrain is, and what its readers need: words and numbers of a text.

use crate::raster::Raster;
use dem_solid::input::{Head, ReadError};
use dem_solid::shape::formats::Facets;
use interface_defs::diagnostic::Diagnostic;
use nalgebra::Vector3;

/// Most cells of a raster: each takes some 90 bytes, with its two triangles and their tree.
pub const MOST_CELLS: usize = 250_000_000;

/// A way in which a file holds a terrain. One file each in this folder, and two lines in `mod.rs`.
#[derive(Clone, Copy)]
pub struct Format {
    /// What it is called in messages.
    pub name: &'static str,
    /// Extensions of such files that messages list, in lower case, the usual one first.
    pub extensions: &'static [&'static str],
    /// Others under which it is read.
    pub also: &'static [&'static str],
    /// Whether a file that begins so is one.
    pub begins: fn(&Head) -> bool,
    /// Read a file.
    pub read: Reader,
}

impl Format {
    /// Whether files of this extension are read so.
    pub fn has(&self, extension: &str) -> bool {
        self.extensions.contains(&extension) || self.also.contains(&extension)
    }
}

/// Points of a file [m], or why it has none.
pub type ReadPoints = Result<Vec<[f64; 3]>, ReadError>;

/// What reads the bytes of a file, by what such a file holds: some keys of `[terrain]` are for one kind alone.
#[derive(Clone, Copy)]
pub enum Reader {
    /// A raster of heights, perhaps with cells without height.
    Raster(fn(&[u8]) -> Result<Raster, ReadError>),
    /// Points.
    Points(fn(&[u8]) -> ReadPoints),
    /// Points of these classes; none: all.
    ClassifiedPoints(fn(Vec<u8>, &[u8]) -> ReadPoints),
    /// At most so many triangles.
    Surface(fn(&[u8], usize) -> Result<Facets, ReadError>),
}

/// What a terrain file holds.
#[derive(Debug, Clone, PartialEq)]
pub enum Content {
    /// A raster of heights.
    Raster(Raster),
    /// Points [m].
    Points(Vec<[f64; 3]>),
    /// Triangles.
    Triangles {
        /// Corners [m].
        nodes: Vec<Vector3<f64>>,
        /// Triangles.
        triangles: Vec<[u32; 3]>,
        /// What the user should know.
        notices: Vec<Diagnostic>,
    },
}

/// Words of a text, and in which line they stand.
pub struct Words<'a> {
    text: &'a [u8],
    at: usize,
    /// Line of the word given last, from 1.
    pub line: usize,
    breaks: usize,
}

impl<'a> Words<'a> {
    /// Of `text`.
    pub fn new(text: &'a [u8]) -> Self {
        Self { text, at: 0, line: 1, breaks: 0 }
    }

    /// The next word, in whatever line.
    pub fn next(&mut self) -> Option<&'a [u8]> {
        while let Some(byte) = self.text.get(self.at) {
            if !byte.is_ascii_whitespace() {
                break;
            }
            self.breaks += usize::from(*byte == b'\n');
            self.at += 1;
        }
        self.line = self.breaks + 1;
        let rest = &self.text[self.at..];
        let length = rest.iter().position(u8::is_ascii_whitespace).unwrap_or(rest.len());
        self.at += length;
        (length > 0).then(|| &rest[..length])
    }

    /// The next word, left where it is.
    pub fn peek(&self) -> Option<&'a [u8]> {
        Self { ..*self }.next()
    }

    /// Something wrong in the line of the word given last.
    pub fn fault(&self, what: String) -> ReadError {
        ReadError::at(self.line, what)
    }

    /// The heights of a raster to the end of the text, those that `is_none` marks as no number; how many stand in the first of
    /// their lines, and in how many lines.
    pub fn heights(
        &mut self,
        [columns, rows]: [usize; 2],
        is_none: impl Fn(f64) -> bool,
    ) -> Result<(Vec<f64>, [usize; 2]), ReadError> {
        let bytes = self.text.len();
        // A height and its separator are two bytes at least.
        let Some(count) = columns.checked_mul(rows).filter(|n| n / 2 <= bytes) else {
            let what =
                format!("the header promises {columns} x {rows} heights, and the file has {bytes} bytes");
            return Err(what.into());
        };
        if count > MOST_CELLS {
            return Err(format!("{count} heights: up to {MOST_CELLS} are read").into());
        }
        let mut heights = Vec::with_capacity(count);
        let (mut first_line, mut in_first, mut last_line) = (None, 0, 0);
        while heights.len() < count {
            let read = heights.len();
            let Some(word) = self.next() else {
                let what = format!("the file ends after {read} of {columns} x {rows} = {count} heights");
                return Err(self.fault(what));
            };
            let Some(z) = number(word) else {
                let (row, column) = (read / columns + 1, read % columns + 1);
                let what = format!("`{}` is no height (row {row}, column {column})", shown(word));
                return Err(comma(word, self.fault(what)));
            };
            last_line = self.line;
            in_first += usize::from(*first_line.get_or_insert(last_line) == last_line);
            heights.push(if is_none(z) { f64::NAN } else { z });
        }
        if let Some(word) = self.next() {
            return Err(self.fault(format!("`{}` follows the last of {count} heights", shown(word))));
        }
        Ok((heights, [in_first, last_line + 1 - first_line.unwrap_or(last_line)]))
    }
}

/// A finite number, whose decimal separator is a point.
pub fn number(word: &[u8]) -> Option<f64> {
    std::str::from_utf8(word).ok()?.parse::<f64>().ok().filter(|v| v.is_finite())
}

/// The error with a hint, if `word` is a number with a decimal comma.
pub fn comma(word: &[u8], error: ReadError) -> ReadError {
    if !has_comma(word) {
        return error;
    }
    let text = String::from_utf8_lossy(word).replace(',', ".");
    error.try_instead(format!("a decimal comma? a number is written with a point: {text}"))
}

/// True for a number with a decimal comma.
pub fn has_comma(word: &[u8]) -> bool {
    let Some(at) = word.iter().position(|b| *b == b',') else { return false };
    let digit = |i: Option<usize>| i.and_then(|i| word.get(i)).is_some_and(u8::is_ascii_digit);
    let mut point = word.to_vec();
    point[at] = b'.';
    digit(at.checked_sub(1)) && digit(Some(at + 1)) && number(&point).is_some()
}

/// A word as an error shows it: readable and short.
pub fn shown(word: &[u8]) -> String {
    let text: String =
        String::from_utf8_lossy(word).chars().take(24).flat_map(char::escape_default).collect();
    if word.len() > 24 { text + "..." } else { text }
}
