//! Files that a user gives: their bytes, lines and numbers, what they are by their beginning, errors with file and line.

use nalgebra::Vector3;
pub use toolkit::input_file::read as read_bytes;
pub use toolkit::words::ReadError;

/// Largest file of a surface or of spheres that is read [bytes].
pub const LARGEST: u64 = 1 << 30;

/// Largest coordinate [m]: beyond it products of lengths lose their meaning long before they overflow.
const FURTHEST: f64 = 1e9;
/// Lengths that a shape may have, and factors of them [m].
pub const LENGTHS: std::ops::RangeInclusive<f64> = 1e-9..=FURTHEST;

/// The lines of a text, numbered from 1; a line that is not text is an error.
pub fn lines(bytes: &[u8]) -> impl Iterator<Item = Result<(usize, &str), ReadError>> {
    bytes.split(|b| *b == b'\n').enumerate().map(|(i, line)| match std::str::from_utf8(line) {
        Ok(text) => Ok((i + 1, text.trim())),
        Err(_) => Err(ReadError::at(i + 1, "this is no text: a binary file?")),
    })
}

/// A finite number of reasonable size from a word of a line.
pub fn number(word: Option<&str>, line: usize) -> Result<f64, ReadError> {
    let word = word.ok_or_else(|| ReadError::at(line, "a number is missing at the end of the line"))?;
    let value: f64 =
        word.parse().map_err(|_| ReadError::at(line, format!("`{}` is not a number", shown(word))))?;
    reasonable(value).map_err(|what| ReadError::at(line, what))
}

/// Three numbers.
pub fn point<'a>(words: &mut impl Iterator<Item = &'a str>, line: usize) -> Result<Vector3<f64>, ReadError> {
    Ok(Vector3::new(number(words.next(), line)?, number(words.next(), line)?, number(words.next(), line)?))
}

/// The value, if it is finite and below 1e9.
pub fn reasonable(value: f64) -> Result<f64, String> {
    if value.is_finite() && value.abs() <= FURTHEST {
        Ok(value)
    } else {
        Err(format!("a coordinate of {value:e}: finite ones up to {FURTHEST:e} are possible"))
    }
}

/// The beginning of a word, for a message.
pub fn shown(word: &str) -> String {
    word.chars().take(24).collect()
}

/// The beginning of a file, by which its kind shows whatever its name says.
pub struct Head {
    bytes: Vec<u8>,
    text: String,
}

impl Head {
    /// Bytes by which it is recognised.
    pub const LENGTH: u64 = 512;

    /// Of the first bytes of a file.
    pub fn new(bytes: Vec<u8>) -> Self {
        let text = std::str::from_utf8(&bytes);
        let text = text.or_else(|e| std::str::from_utf8(&bytes[..e.valid_up_to()])).unwrap_or_default();
        let text = text.trim_start().to_lowercase();
        Self { bytes, text }
    }

    /// True if it begins with one of these.
    pub fn begins(&self, marks: &[&[u8]]) -> bool {
        marks.iter().any(|mark| self.bytes.starts_with(mark))
    }

    /// The first word, in lower case.
    pub fn word(&self) -> &str {
        self.text.split_whitespace().next().unwrap_or_default()
    }

    /// What of it is text, in lower case.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// Words of the first line, between blanks, commas and semicolons.
    pub fn line(&self) -> impl Iterator<Item = &str> + Clone {
        let line = self.text.lines().next().unwrap_or_default();
        line.split([' ', '\t', ',', ';']).filter(|word| !word.is_empty())
    }
}
