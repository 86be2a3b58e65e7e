//! Exit codes, the same in every program.

use std::process::{ExitCode, Termination};

/// How a program ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum Exit {
    /// Done.
    Done = 0,
    /// The run failed or was interrupted; what was computed until then is on disk.
    Failed = 1,
    /// Bad input; nothing was computed.
    BadInput = 2,
    /// Computed to the end, but a bound of `[limits]` was passed.
    Unreliable = 3,
}

impl From<Exit> for ExitCode {
    fn from(exit: Exit) -> Self {
        ExitCode::from(exit as u8)
    }
}

impl Termination for Exit {
    fn report(self) -> ExitCode {
        self.into()
    }
}
