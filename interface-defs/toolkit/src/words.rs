//! Words and numbers of a text file, and errors with the line.

use interface_defs::diagnostic::Diagnostic;
use std::path::Path;

/// What is wrong in a file, at which line (from 1) if it has lines, and what to try.
#[derive(Debug, Clone, PartialEq)]
pub struct ReadError {
    /// The line.
    pub line: Option<usize>,
    /// What is wrong.
    pub message: String,
    /// What to try.
    pub hint: Option<String>,
}

impl<M: Into<String>> From<M> for ReadError {
    /// Something wrong with the file as a whole.
    fn from(message: M) -> Self {
        Self { line: None, message: message.into(), hint: None }
    }
}

impl ReadError {
    /// Something wrong with the file as a whole.
    pub fn new(message: impl Into<String>) -> Self {
        message.into().into()
    }

    /// Something wrong at a line (from 1).
    pub fn at(line: usize, message: impl Into<String>) -> Self {
        Self { line: Some(line), ..Self::new(message) }
    }

    /// The same, saying what to try.
    #[must_use]
    pub fn try_instead(self, hint: impl Into<String>) -> Self {
        Self { hint: Some(hint.into()), ..self }
    }

    /// With the file's name in front.
    pub fn in_file(self, path: &Path) -> Diagnostic {
        let line = self.line.map_or(String::new(), |line| format!(":{line}"));
        Diagnostic::in_file(format!("{}{line}", path.display()), self.message).try_if(self.hint)
    }
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
    pub fn next_word(&mut self) -> Option<&'a [u8]> {
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
        Self { ..*self }.next_word()
    }

    /// Something wrong in the line of the word given last.
    pub fn fault(&self, what: String) -> ReadError {
        ReadError::at(self.line, what)
    }

    /// The heights of a raster, at most `most`, to the end of the text, those that `is_none` marks as no number; how many stand in the first of
    /// their lines, and in how many lines.
    pub fn heights(
        &mut self,
        [columns, rows]: [usize; 2],
        most: usize,
        is_none: impl Fn(f64) -> bool,
    ) -> Result<(Vec<f64>, [usize; 2]), ReadError> {
        let bytes = self.text.len();
        // A height and its separator are two bytes at least.
        let Some(count) = columns.checked_mul(rows).filter(|n| n / 2 <= bytes) else {
            let what =
                format!("the header promises {columns} x {rows} heights, and the file has {bytes} bytes");
            return Err(what.into());
        };
        if count > most {
            let error = ReadError::new(format!("{count} heights: up to {most} are read"));
            return Err(error.try_instead("cut the grid to what is needed"));
        }
        let mut heights = Vec::with_capacity(count);
        let (mut first_line, mut in_first, mut last_line) = (None, 0, 0);
        while heights.len() < count {
            let read = heights.len();
            let Some(word) = self.next_word() else {
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
        if let Some(word) = self.next_word() {
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
