//! What is wrong, or worth a second look, as data: severity, code, key, place, message, hint.
//!
//! Every program reports with these: errors of input, warnings of a check and of a run, faults of a solver. Texts are for people
//! alone: who decides by a diagnostic compares its [`Code`] or its key.

use serde::{Deserialize, Serialize};
use std::borrow::Cow;
use std::fmt;

/// How bad it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Severity {
    /// Worth knowing.
    Note,
    /// Possible, but unusual; or a result that is absent or of less worth than it seems.
    Warning,
    /// Certainly wrong: nothing was started, or the run failed.
    Error,
}

/// What kind of diagnostic it is: stable over versions, listed in [`code::ALL`] and in the reference. A program of others may have
/// codes of its own.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Code(Cow<'static, str>);

impl Code {
    /// As text.
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

impl From<String> for Code {
    fn from(code: String) -> Self {
        Self(Cow::Owned(code))
    }
}

impl fmt::Display for Code {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.pad(&self.0)
    }
}

/// The codes of this project.
pub mod code {
    use super::Code;
    use std::borrow::Cow;

    macro_rules! codes {
        ($($(#[doc = $about:literal])+ $name:ident = $text:literal;)*) => {
            $($(#[doc = $about])+ pub const $name: Code = Code(Cow::Borrowed($text));)*
            /// Every code with what it stands for.
            pub const ALL: &[(&str, &str)] = &[$(($text, concat!($($about),+))),*];
        };
    }

    codes! {
        /// The text is not TOML, or not UTF-8.
        SYNTAX = "syntax";
        /// A key that the table does not have.
        UNKNOWN_KEY = "unknown-key";
        /// A name that is none of those that the key takes.
        UNKNOWN_NAME = "unknown-name";
        /// A key that is needed is missing.
        MISSING_KEY = "missing-key";
        /// A value of another type than the key takes.
        WRONG_TYPE = "wrong-type";
        /// A list with more or fewer values than the key takes.
        WRONG_LENGTH = "wrong-length";
        /// A value that is certainly wrong: outside the range in which it has a meaning.
        INVALID_VALUE = "invalid-value";
        /// A value that is possible, but unusual.
        UNUSUAL_VALUE = "unusual-value";
        /// A value that looks as if it were written in another unit.
        LIKELY_UNIT = "likely-unit";
        /// Keys or tables that contradict each other.
        CONTRADICTION = "contradiction";
        /// A key or table that nothing uses.
        UNUSED_KEY = "unused-key";
        /// A file or directory that cannot be read or written.
        FILE = "file";
        /// The content of a file is not what it should be.
        FILE_CONTENT = "file-content";
        /// Coordinates, places or coordinate systems that do not fit together.
        PLACE = "place";
        /// Bodies that overlap, surfaces that are not closed, elements without size, parts that are not connected.
        GEOMETRY = "geometry";
        /// A time step or window at or above the critical one.
        TIME_STEP = "time-step";
        /// Too much for memory, disk or the time that is left.
        SIZE = "size";
        /// An argument of the command line.
        ARGUMENT = "argument";
        /// The directory of results belongs to another run, or holds other results.
        RESULT_DIRECTORY = "result-directory";
        /// A kept state, checkpoint, journal or record that another build, scene or study wrote.
        PROVENANCE = "provenance";
        /// A process that could not be started, was lost, or did not answer in time.
        PROCESS = "process";
        /// A program that broke the interface contract.
        CONTRACT = "contract";
        /// A gauge or measure whose name another program has already given.
        NAME_TAKEN = "name-taken";
        /// No convergence: of a window, of Newton's method, of form finding.
        NOT_CONVERGED = "not-converged";
        /// A number that is not finite.
        NOT_FINITE = "not-finite";
        /// Something of the structure tore.
        RUPTURE = "rupture";
        /// Something of the structure yielded, and is bent for good.
        YIELD = "yield";
        /// Something of the structure came so close to its strength that small differences decide whether it tears.
        NEAR_RUPTURE = "near-rupture";
        /// A landing is expected to overlap deeper than a contact law holds; what a run has measured takes its place.
        DEPTH_EXPECTED = "depth-expected";
        /// A measure that is absent, and why.
        ABSENT_MEASURE = "absent-measure";
        /// A bound of `[limits]` was passed, or nearly.
        LIMIT = "limit";
        /// A result that is worth less than it seems.
        TRUST = "trust";
        /// Too few samples for what is asked.
        FEW_SAMPLES = "few-samples";
        /// A result file that could not be written.
        NOT_WRITTEN = "not-written";
        /// The run was interrupted, or went on from a checkpoint.
        INTERRUPTED = "interrupted";
        /// A diagnostic of a program that gives no codes.
        OTHER = "other";
    }

    /// Codes and what they stand for, as a table of the reference.
    pub fn reference() -> String {
        let rows = ALL.iter().map(|(code, about)| format!("| `{code}` | {} |\n", about.trim()));
        "| code | what it stands for |\n|---|---|\n".to_owned() + &rows.collect::<String>()
    }
}

/// One position in a text.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Place {
    /// The file, or the argument of a command line.
    pub file: String,
    /// Line and column, from 1, both; `None`: the file as a whole, or an argument.
    pub position: Option<(u32, u32)>,
    /// The line or argument in which it is, and how many characters from the column on are meant.
    pub excerpt: Option<Excerpt>,
}

/// The line of a text in which a position is.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Excerpt {
    /// The whole line.
    pub line: String,
    /// Characters before the position.
    pub before: u32,
    /// Characters to underline, at least 1.
    pub width: u32,
}

impl fmt::Display for Place {
    /// `file:line:column`, or the file or argument alone.
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self.position {
            Some((line, column)) => write!(f, "{}:{line}:{column}", self.file),
            None => f.write_str(&self.file),
        }
    }
}

impl Place {
    /// A file as a whole.
    pub fn file(file: impl fmt::Display) -> Self {
        Self { file: file.to_string(), position: None, excerpt: None }
    }

    /// Bytes `span` of `text`; a span over several lines ends with the first.
    pub fn in_text(file: &str, text: &str, span: std::ops::Range<usize>) -> Self {
        let start = text.floor_char_boundary(span.start);
        let end = text.floor_char_boundary(span.end.max(start));
        let line_start = text[..start].rfind('\n').map_or(0, |at| at + 1);
        let line = text[line_start..].lines().next().unwrap_or_default().to_owned();
        let number = text[..line_start].matches('\n').count() as u32 + 1;
        let before = text[line_start..start].chars().count() as u32;
        let shown = text[start..end].lines().next().map_or(0, |first| first.trim_end().chars().count());
        let excerpt = Some(Excerpt { line, before, width: (shown as u32).max(1) });
        Self { file: file.to_owned(), position: Some((number, before + 1)), excerpt }
    }

    /// Bytes `span` of the argument `--set text`.
    pub fn in_argument(text: &str, span: std::ops::Range<usize>) -> Self {
        Self { file: format!("--set {text}"), position: None, ..Self::in_text("", text, span) }
    }
}

/// What is wrong, or worth a second look. As an error of input it means exit code 2:
///
/// ```text
/// drop.toml:12:1: unknown key `yuong`
///    |
/// 12 | yuong = 1e9
///    | ^^^^^
///    = did you mean `young`? known here: `density`, `young`
/// ```
#[derive(Debug, Clone, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[must_use]
pub struct Diagnostic {
    /// How bad it is.
    pub severity: Severity,
    /// What kind it is.
    pub code: Code,
    /// Dotted key of the scene or study that it is about, as in `rock.0.mass`.
    pub key: Option<String>,
    /// Where that is written.
    pub place: Option<Box<Place>>,
    /// What is the matter, with its numbers.
    pub message: String,
    /// What to try.
    pub hint: Option<String>,
}

impl Diagnostic {
    /// One of this severity and kind.
    pub fn of(severity: Severity, code: Code, message: impl Into<String>) -> Self {
        Self { severity, code, key: None, place: None, message: message.into(), hint: None }
    }

    /// Wrong input that has no place in a text.
    pub fn new(message: impl Into<String>) -> Self {
        Self::of(Severity::Error, code::INVALID_VALUE, message)
    }

    /// An error of this kind.
    pub fn error(code: Code, message: impl Into<String>) -> Self {
        Self::of(Severity::Error, code, message)
    }

    /// A warning of this kind.
    pub fn warning(code: Code, message: impl Into<String>) -> Self {
        Self::of(Severity::Warning, code, message)
    }

    /// That a measure is absent, and why; its key is the name of the measure.
    pub fn absent(measure: &str, why: &str) -> Self {
        Self::warning(code::ABSENT_MEASURE, format!("{measure} is absent: {why}")).about(measure)
    }

    /// Wrong input in `file` as a whole.
    pub fn in_file(file: impl fmt::Display, message: impl Into<String>) -> Self {
        Self::error(code::FILE_CONTENT, message).at(Place::file(file))
    }

    /// The same at a place.
    pub fn at(mut self, place: Place) -> Self {
        self.place = Some(Box::new(place));
        self
    }

    /// The same about this dotted key.
    pub fn about(mut self, key: impl Into<String>) -> Self {
        self.key = Some(key.into());
        self
    }

    /// The same of this kind.
    pub fn coded(mut self, code: Code) -> Self {
        self.code = code;
        self
    }

    /// The same, saying what to try.
    pub fn try_instead(mut self, hint: impl Into<String>) -> Self {
        self.hint = Some(hint.into());
        self
    }

    /// The same, saying what to try where there is something.
    pub fn try_if(mut self, hint: Option<String>) -> Self {
        self.hint = hint.or(self.hint);
        self
    }

    /// Position, key and message alone, in one line, without what to try.
    pub fn headline(&self) -> String {
        let mut line = self.place.as_ref().map_or(String::new(), |place| format!("{place}: "));
        // That of an absent measure is the first word of the message.
        let shown = self.severity < Severity::Error && self.code != code::ABSENT_MEASURE;
        if let Some(key) = self.key.as_ref().filter(|_| shown) {
            line += key;
            line += ": ";
        }
        line + &self.message
    }
}

impl fmt::Display for Diagnostic {
    /// An error with the line in which it is and a caret; a warning in one line that begins with its place and key.
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(&self.headline())?;
        let excerpt = self.place.as_ref().and_then(|place| Some((place.position, place.excerpt.as_ref()?)));
        let Some((position, excerpt)) = excerpt.filter(|_| self.severity == Severity::Error) else {
            return self.hint.as_ref().map_or(Ok(()), |hint| write!(f, "; {hint}"));
        };
        let number = position.map_or(String::new(), |(line, _)| line.to_string());
        let gutter = " ".repeat(number.len().max(2));
        // A tab stays a tab, so that the caret stands under what it means.
        let before = excerpt.line.chars().take(excerpt.before as usize);
        let indent: String = before.map(|c| if c == '\t' { c } else { ' ' }).collect();
        writeln!(f, "\n{gutter} |")?;
        writeln!(f, "{number:>2} | {}", excerpt.line)?;
        write!(f, "{gutter} | {indent}{}", "^".repeat(excerpt.width as usize))?;
        self.hint.as_ref().map_or(Ok(()), |hint| write!(f, "\n{gutter} = {hint}"))
    }
}

impl std::error::Error for Diagnostic {}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_caret_stands_under_the_value_behind_tabs_and_wide_text() {
        let text = "a = 1\n\tü = 'x'\n";
        let at = text.find("'x'").expect("is there");
        let error = Diagnostic::new("wrong").at(Place::in_text("s.toml", text, at..at + 3));
        assert_eq!(error.to_string(), "s.toml:2:6: wrong\n   |\n 2 | \tü = 'x'\n   | \t    ^^^");
    }

    #[test]
    fn the_end_of_the_file_is_a_position() {
        let place = Place::in_text("s.toml", "a = ", 4..4);
        assert_eq!((place.to_string().as_str(), place.excerpt.expect("a line").width), ("s.toml:1:5", 1));
        assert_eq!(Place::in_text("s.toml", "", 9..12).to_string(), "s.toml:1:1");
    }

    #[test]
    fn a_warning_is_one_line_with_place_key_and_hint() {
        let warning = Diagnostic::warning(code::LIKELY_UNIT, "2.6 kg/m3").about("rock.0.density");
        let warning = warning.try_instead("write 2600.0").at(Place::in_text("s.toml", "density = 2.6", 0..7));
        assert_eq!(warning.to_string(), "s.toml:1:1: rock.0.density: 2.6 kg/m3; write 2600.0");
        let absent = Diagnostic::absent("sag", "no weight acts");
        assert_eq!(
            (absent.key.as_deref(), absent.headline().as_str()),
            (Some("sag"), "sag is absent: no weight acts")
        );
    }

    #[test]
    fn codes_are_short_words_that_stand_once() {
        let mut names: Vec<_> = code::ALL.iter().map(|(name, _)| *name).collect();
        assert!(names.iter().all(|n| n.bytes().all(|b| b.is_ascii_lowercase() || b == b'-')), "{names:?}");
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), code::ALL.len());
        assert!(code::ALL.iter().all(|(_, about)| about.trim_end().ends_with('.')));
        let table = code::reference();
        assert!(
            table.starts_with("| code | what it stands for |\n|---|---|\n| `syntax` | The text is not TOML"),
            "{table}"
        );
        assert_eq!(table.lines().count(), 2 + code::ALL.len());
        let page = include_str!("../PROTOCOL.md");
        assert!(names.iter().all(|name| page.contains(&format!("`{name}`"))), "PROTOCOL.md lists all codes");
    }
}
