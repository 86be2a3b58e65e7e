//! Why a command ends without having done its work.

use interface_defs::diagnostic::Diagnostic;
use interface_defs::toolkit::exit::Exit;

/// The exit code, and the one message for the user.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Stop {
    /// Exit code.
    pub exit: Exit,
    /// Message.
    pub message: String,
}

impl Stop {
    /// Bad input: nothing was started.
    pub fn input(message: impl Into<String>) -> Self {
        Self { exit: Exit::BadInput, message: message.into() }
    }

    /// The run failed.
    pub fn failed(message: impl Into<String>) -> Self {
        Self { exit: Exit::Failed, message: message.into() }
    }
}

impl From<Diagnostic> for Stop {
    fn from(error: Diagnostic) -> Self {
        Self::input(error.to_string())
    }
}
