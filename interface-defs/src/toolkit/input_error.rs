//! Bad input as one message: where, what, the line with a caret, what to try.

use crate::message::Fault;
use std::fmt;

/// The user's input is wrong: exit code 2.
///
/// ```text
/// drop.toml:12:1: unknown key `yuong`
///    |
/// 12 | yuong = 1e9
///    | ^^^^^
///    = did you mean `young`? known here: `density`, `young`
/// ```
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct InputError {
    place: Position,
    message: String,
    hint: Option<String>,
}

/// Where the input is wrong.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Position {
    /// Not in a text.
    Nowhere,
    /// In this file or argument, as a whole.
    Whole(String),
    /// At one position.
    Spot(Box<Spot>),
}

/// One position in a text.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Spot {
    /// `file:line:column`, or the argument.
    pub label: String,
    /// Number of the line, from 1; none in an argument.
    pub number: Option<usize>,
    /// The whole line.
    pub line: String,
    /// Characters before the position.
    pub before: usize,
    /// Characters to underline, at least 1.
    pub width: usize,
}

impl Spot {
    /// Bytes `span` of `text`; a span over several lines ends with the first. `label` gets line and column.
    pub fn in_file(file: &str, text: &str, span: std::ops::Range<usize>) -> Self {
        let start = floor_boundary(text, span.start.min(text.len()));
        let end = floor_boundary(text, span.end.clamp(start, text.len()));
        let line_start = text[..start].rfind('\n').map_or(0, |at| at + 1);
        let line = text[line_start..].lines().next().unwrap_or_default();
        let number = text[..line_start].matches('\n').count() + 1;
        let before = text[line_start..start].chars().count();
        let shown = text[start..end].lines().next().map_or(0, |first| first.trim_end().chars().count());
        Self {
            label: format!("{file}:{number}:{}", before + 1),
            number: Some(number),
            line: line.to_owned(),
            before,
            width: shown.max(1),
        }
    }

    /// Bytes `span` of the argument `--set text`.
    pub fn in_argument(text: &str, span: std::ops::Range<usize>) -> Self {
        let spot = Self::in_file("", text, span);
        Self { label: format!("--set {text}"), number: None, ..spot }
    }
}

fn floor_boundary(text: &str, mut at: usize) -> usize {
    while !text.is_char_boundary(at) {
        at -= 1;
    }
    at
}

impl InputError {
    /// Wrong input that has no place in a text.
    pub fn new(message: impl Into<String>) -> Self {
        Self { place: Position::Nowhere, message: message.into(), hint: None }
    }

    /// Wrong input in `file` as a whole.
    pub fn in_file(file: impl Into<String>, message: impl Into<String>) -> Self {
        Self { place: Position::Whole(file.into()), message: message.into(), hint: None }
    }

    /// Wrong input at a position.
    pub(crate) fn at(spot: Spot, message: impl Into<String>) -> Self {
        Self { place: Position::Spot(Box::new(spot)), message: message.into(), hint: None }
    }

    /// Position and message alone, in one line.
    pub fn headline(&self) -> String {
        match &self.place {
            Position::Nowhere => self.message.clone(),
            Position::Whole(file) => format!("{file}: {}", self.message),
            Position::Spot(spot) => format!("{}: {}", spot.label, self.message),
        }
    }

    /// What to try.
    pub fn hint(&self) -> Option<&str> {
        self.hint.as_deref()
    }

    /// The same, saying what to try.
    #[must_use]
    pub fn try_instead(mut self, hint: impl Into<String>) -> Self {
        self.hint = Some(hint.into());
        self
    }

    /// The same, saying what to try where there is something.
    #[must_use]
    pub(crate) fn try_if(mut self, hint: Option<String>) -> Self {
        self.hint = hint.or(self.hint);
        self
    }
}

impl fmt::Display for InputError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let mut gutter = String::new();
        match &self.place {
            Position::Nowhere => f.write_str(&self.message)?,
            Position::Whole(file) => write!(f, "{file}: {}", self.message)?,
            Position::Spot(spot) => {
                let number = spot.number.map_or(String::new(), |n| n.to_string());
                gutter = " ".repeat(number.len().max(2));
                // A tab stays a tab, so that the caret stands under what it means.
                let indent: String =
                    spot.line.chars().take(spot.before).map(|c| if c == '\t' { c } else { ' ' }).collect();
                writeln!(f, "{}: {}", spot.label, self.message)?;
                writeln!(f, "{gutter} |")?;
                writeln!(f, "{number:>2} | {}", spot.line)?;
                write!(f, "{gutter} | {indent}{}", "^".repeat(spot.width))?;
            }
        }
        match &self.hint {
            Some(hint) if gutter.is_empty() => write!(f, "; {hint}"),
            Some(hint) => write!(f, "\n{gutter} = {hint}"),
            None => Ok(()),
        }
    }
}

impl std::error::Error for InputError {}

impl From<InputError> for Fault {
    fn from(error: InputError) -> Self {
        Fault::input(error.to_string())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_caret_stands_under_the_value_behind_tabs_and_wide_text() {
        let text = "a = 1\n\tü = 'x'\n";
        let at = text.find("'x'").expect("is there");
        let error = InputError::at(Spot::in_file("s.toml", text, at..at + 3), "wrong");
        assert_eq!(error.to_string(), "s.toml:2:6: wrong\n   |\n 2 | \tü = 'x'\n   | \t    ^^^");
    }

    #[test]
    fn the_end_of_the_file_is_a_position() {
        let spot = Spot::in_file("s.toml", "a = ", 4..4);
        assert_eq!((spot.label.as_str(), spot.width), ("s.toml:1:5", 1));
        let spot = Spot::in_file("s.toml", "", 9..12);
        assert_eq!(spot.label, "s.toml:1:1");
    }

    #[test]
    fn an_error_is_a_fault_of_kind_input() {
        let fault = Fault::from(InputError::in_file("s.toml", "is empty").try_instead("write one"));
        assert_eq!(fault, Fault::input("s.toml: is empty; write one"));
    }
}
