//! Words of a text and the lines on which they stand.

use interface_defs::diagnostic::Diagnostic;

/// An error at a line of a file.
pub fn error(file: &str, line: usize, what: impl Into<String>) -> Diagnostic {
    Diagnostic::in_file(format!("{file}:{line}"), what)
}

/// A word as an error shows it: not longer than a line can bear.
pub fn shown(word: &str) -> String {
    const MOST: usize = 40;
    let short: String = word.chars().take(MOST).flat_map(char::escape_default).collect();
    if word.chars().nth(MOST).is_some() { format!("`{short}...`") } else { format!("`{short}`") }
}

/// A finite number, also as Fortran writes it (`1.5D-3`).
pub fn real(word: &str) -> Option<f64> {
    let value = word.parse().or_else(|_| word.replace(['d', 'D'], "e").parse());
    value.ok().filter(|v: &f64| v.is_finite())
}

/// A text with blanks in place of comments as C++ has them, `//` and `/* */`; lines stay where they are.
pub fn without_comments(text: &str) -> String {
    let (mut kept, mut rest) = (String::with_capacity(text.len()), text);
    while let Some(begin) = rest.as_bytes().windows(2).position(|mark| matches!(mark, b"//" | b"/*")) {
        let (before, comment) = rest.split_at(begin);
        let end = match comment.starts_with("//") {
            true => comment.find('\n'),
            false => comment[2..].find("*/").map(|end| end + 4),
        };
        let (comment, behind) = comment.split_at(end.unwrap_or(comment.len()));
        kept.push_str(before);
        kept.extend(comment.chars().map(|c| if c == '\n' { c } else { ' ' }));
        rest = behind;
    }
    kept + rest
}

fn lines(text: &str) -> usize {
    text.bytes().filter(|b| *b == b'\n').count()
}

/// The words of a text, one after the other.
#[derive(Debug, Clone)]
pub struct Tokens<'a> {
    file: &'a str,
    /// Text that is left.
    rest: &'a str,
    /// Line of the last word, from 1.
    line: usize,
}

impl<'a> Tokens<'a> {
    /// Words between white space.
    pub fn new(file: &'a str, text: &'a str) -> Self {
        Self { file, rest: text, line: 1 }
    }

    /// The next word, or `None` at the end of the file.
    pub fn next_word(&mut self) -> Option<&'a str> {
        let found = self.rest.trim_ascii_start();
        if found.is_empty() {
            return None;
        }
        self.line += lines(&self.rest[..self.rest.len() - found.len()]);
        let end = found.bytes().position(|b| b.is_ascii_whitespace()).unwrap_or(found.len());
        let (word, rest) = found.split_at(end);
        self.rest = rest;
        Some(word)
    }

    /// The rest of the line at hand; the next word is on a later one.
    pub fn rest_of_line(&mut self) -> &'a str {
        let (line, rest) = self.rest.split_at(self.rest.find('\n').unwrap_or(self.rest.len()));
        self.rest = rest;
        line.trim()
    }

    /// The next word; at the end of the file an error that says `what` was expected.
    pub fn word(&mut self, what: &str) -> Result<&'a str, Diagnostic> {
        self.next_word().ok_or_else(|| {
            let end = self.line + lines(self.rest);
            error(self.file, end, format!("the file ends where {what} is expected"))
                .try_instead("it seems to be cut off: save it anew")
        })
    }

    fn parsed<T>(
        &mut self,
        what: &str,
        kind: &str,
        parse: impl Fn(&str) -> Option<T>,
    ) -> Result<T, Diagnostic> {
        let word = self.word(what)?;
        parse(word).ok_or_else(|| self.error(format!("{what} should be {kind}, found {}", shown(word))))
    }

    /// The next word as a whole number, not negative.
    pub fn whole(&mut self, what: &str) -> Result<u64, Diagnostic> {
        self.parsed(what, "a whole number", |word| word.parse().ok())
    }

    /// The next word as a whole number of either sign.
    pub fn signed(&mut self, what: &str) -> Result<i64, Diagnostic> {
        self.parsed(what, "a whole number", |word| word.parse().ok())
    }

    /// The next word as a finite number.
    pub fn real(&mut self, what: &str) -> Result<f64, Diagnostic> {
        self.parsed(what, "a finite number", real)
    }

    /// The next three words as the place of a node [m].
    pub fn point(&mut self) -> Result<[f64; 3], Diagnostic> {
        let what = "a coordinate of a node";
        Ok([self.real(what)?, self.real(what)?, self.real(what)?])
    }

    /// Read the word `word`, or fail.
    pub fn expect(&mut self, word: &str) -> Result<(), Diagnostic> {
        let found = self.word(&format!("`{word}`"))?;
        if found == word {
            return Ok(());
        }
        Err(self.error(format!("`{word}` is expected here, found {}", shown(found))))
    }

    /// An error at the last word.
    pub fn error(&self, what: impl Into<String>) -> Diagnostic {
        error(self.file, self.line, what)
    }

    /// Line of the last word.
    pub fn line(&self) -> usize {
        self.line
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_know_their_lines_across_comments() {
        let text = without_comments("a// b\n /* c\nd */ e/f g//\nh");
        let mut t = Tokens::new("f", &text);
        let mut seen = Vec::new();
        while let Some(word) = t.next_word() {
            seen.push((word, t.line()));
        }
        assert_eq!(seen, [("a", 1), ("e/f", 3), ("g", 3), ("h", 4)]);
    }

    #[test]
    fn numbers_of_fortran_are_read_and_infinity_is_not() {
        assert_eq!(real("1.5D-3"), Some(1.5e-3));
        assert_eq!((real("inf"), real("1e999"), real("nan"), real("x")), (None, None, None, None));
    }

    #[test]
    fn the_end_of_the_file_is_told_with_its_line() {
        let mut t = Tokens::new("f.msh", "1\n2\n");
        assert_eq!((t.whole("a").unwrap(), t.whole("b").unwrap()), (1, 2));
        let message = t.whole("the third number").unwrap_err().to_string();
        assert!(
            message.starts_with("f.msh:3: the file ends where the third number is expected"),
            "{message}"
        );
    }
}
