//! Why a command ends without having done its work.

use interface_defs::diagnostic::{Code, Diagnostic, code};
use std::fmt::Display;
use std::path::Path;
use toolkit::exit::Exit;
use toolkit::files;
use toolkit::summary::Summary;

/// The exit code, and what is wrong: at least one error.
#[derive(Debug, Clone, PartialEq, Eq)]
#[must_use]
pub struct Stop {
    /// Exit code.
    pub exit: Exit,
    /// What is wrong.
    pub errors: Vec<Diagnostic>,
}

impl Stop {
    /// Bad input: nothing was started.
    pub fn input(code: Code, message: impl Into<String>) -> Self {
        Diagnostic::error(code, message).into()
    }

    /// The run failed.
    pub fn failed(code: Code, message: impl Into<String>) -> Self {
        Self { exit: Exit::Failed, ..Self::input(code, message) }
    }

    /// The user has interrupted it.
    pub fn interrupted() -> Self {
        Self::failed(code::INTERRUPTED, "interrupted")
    }

    /// Of a run that has ended without being done.
    pub fn of(summary: Summary) -> Self {
        let all = summary.message.unwrap_or_else(|| format!("the run is {}", summary.status.word()));
        let first = summary.reasons.into_iter().next();
        let first = first.unwrap_or_else(|| Diagnostic::error(code::OTHER, ""));
        Self {
            exit: Exit::of(summary.status),
            errors: vec![Diagnostic { message: all, hint: None, place: None, ..first }],
        }
    }

    /// The same, with one more thing to try, or to look at, about each error.
    pub fn hinted(mut self, cure: &str) -> Self {
        for error in &mut self.errors {
            error.hint =
                Some(error.hint.take().map_or_else(|| cure.into(), |hint| format!("{hint}; {cure}")));
        }
        self
    }

    /// The same, with more behind the last of its errors.
    pub fn and(mut self, more: &str) -> Self {
        if let Some(last) = self.errors.last_mut() {
            last.message += more;
        }
        self
    }
}

/// A file or directory that cannot be written, and why.
pub fn unwritten<E: Display>(place: &Path) -> impl Fn(E) -> Stop {
    move |why| Stop::failed(code::NOT_WRITTEN, format!("{}: cannot be written: {why}", place.display()))
}

/// Write a text.
pub fn write(place: &Path, text: &str) -> Result<(), Stop> {
    files::write(place, text.as_bytes()).map_err(unwritten(place))
}

impl From<Diagnostic> for Stop {
    fn from(error: Diagnostic) -> Self {
        Self { exit: Exit::BadInput, errors: vec![error] }
    }
}
