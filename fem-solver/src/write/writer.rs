//! What a format is, and lines of its text.

use super::deck::Deck;
use crate::read::Format;

/// A format that is written.
pub struct Writer {
    /// Which one it is.
    pub format: Format,
    /// By what it knows a set of this name; `None`: it can have no such name.
    pub name: fn(&str) -> Option<String>,
    /// What of the deck it cannot hold.
    pub lost: fn(&Deck) -> Vec<String>,
    /// The text of the file, with these remarks at its head.
    pub write: fn(&Deck, &[String]) -> String,
}

/// Append lines.
pub fn lines(text: &mut String, rows: impl Iterator<Item = String>) {
    for row in rows {
        *text += &row;
        text.push('\n');
    }
}

/// A list of numbers, `most` to a line, with `between`.
pub fn numbers(text: &mut String, of: &[u64], most: usize, between: &str) {
    lines(text, of.chunks(most).map(|row| row.iter().map(u64::to_string).collect::<Vec<_>>().join(between)));
}
