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
    let value = match word.parse::<f64>() {
        Ok(value) => Ok(value),
        Err(_) => word.replace(['d', 'D'], "e").parse(),
    };
    value.ok().filter(|v| v.is_finite())
}

/// The words of a text, one after the other.
#[derive(Debug, Clone)]
pub struct Tokens<'a> {
    file: &'a str,
    text: &'a str,
    at: usize,
    /// Line at `at`, from 1.
    here: usize,
    /// Line of the last word.
    line: usize,
    /// Whether `//` and `/* */` are comments.
    comments: bool,
}

impl<'a> Tokens<'a> {
    /// Words between white space.
    pub fn new(file: &'a str, text: &'a str) -> Self {
        Self { file, text, at: 0, here: 1, line: 1, comments: false }
    }

    /// The same, without comments as C++ has them.
    pub fn without_comments(file: &'a str, text: &'a str) -> Self {
        Self { comments: true, ..Self::new(file, text) }
    }

    /// The next word, or `None` at the end of the file.
    pub fn next_word(&mut self) -> Option<&'a str> {
        let bytes = self.text.as_bytes();
        loop {
            match bytes.get(self.at)? {
                b'\n' => {
                    self.here += 1;
                    self.at += 1;
                }
                b if b.is_ascii_whitespace() => self.at += 1,
                b'/' if self.comments && self.comment_starts(self.at) => self.skip_comment(),
                _ => break,
            }
        }
        let start = self.at;
        while let Some(b) = bytes.get(self.at)
            && !b.is_ascii_whitespace()
            && !(self.comments && self.comment_starts(self.at))
        {
            self.at += 1;
        }
        self.line = self.here;
        Some(&self.text[start..self.at])
    }

    fn comment_starts(&self, at: usize) -> bool {
        let bytes = self.text.as_bytes();
        bytes[at] == b'/' && matches!(bytes.get(at + 1), Some(b'/' | b'*'))
    }

    fn skip_comment(&mut self) {
        let rest = &self.text[self.at..];
        let length = if rest.starts_with("//") {
            rest.find('\n').unwrap_or(rest.len())
        } else {
            rest[2..].find("*/").map_or(rest.len(), |end| end + 4)
        };
        self.here += rest.as_bytes()[..length].iter().filter(|b| **b == b'\n').count();
        self.at += length;
    }

    /// The rest of the line at hand; the next word is on a later one.
    pub fn rest_of_line(&mut self) -> &'a str {
        let rest = &self.text[self.at..];
        let end = rest.find('\n').unwrap_or(rest.len());
        self.at += end;
        rest[..end].trim()
    }

    /// The next word; at the end of the file an error that says `what` was expected.
    pub fn word(&mut self, what: &str) -> Result<&'a str, Diagnostic> {
        self.next_word().ok_or_else(|| {
            error(self.file, self.here, format!("the file ends where {what} is expected"))
                .try_instead("it seems to be cut off: save it anew")
        })
    }

    /// The next word as a whole number, not negative.
    pub fn whole(&mut self, what: &str) -> Result<u64, Diagnostic> {
        let word = self.word(what)?;
        word.parse().map_err(|_| self.expected(what, "a whole number", word))
    }

    /// The next word as a whole number of either sign.
    pub fn signed(&mut self, what: &str) -> Result<i64, Diagnostic> {
        let word = self.word(what)?;
        word.parse().map_err(|_| self.expected(what, "a whole number", word))
    }

    /// The next word as a finite number.
    pub fn real(&mut self, what: &str) -> Result<f64, Diagnostic> {
        let word = self.word(what)?;
        real(word).ok_or_else(|| self.expected(what, "a finite number", word))
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

    fn expected(&self, what: &str, kind: &str, found: &str) -> Diagnostic {
        self.error(format!("{what} should be {kind}, found {}", shown(found)))
    }

    /// An error at the last word.
    pub fn error(&self, what: impl Into<String>) -> Diagnostic {
        error(self.file, self.line, what)
    }

    /// Name of the file.
    pub fn file(&self) -> &'a str {
        self.file
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
        let mut t = Tokens::without_comments("f", "a// b\n /* c\nd */ e/f g//\nh");
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
