//! Words and numbers of a text, as messages and readers need them.

use interface_defs::diagnostic::Diagnostic;

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
}

/// A finite number, whose decimal separator is a point.
pub fn number(word: &[u8]) -> Option<f64> {
    std::str::from_utf8(word).ok()?.parse::<f64>().ok().filter(|v| v.is_finite())
}

/// The error with a hint, if `word` is a number with a decimal comma.
pub fn comma(word: &[u8], error: Diagnostic) -> Diagnostic {
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
