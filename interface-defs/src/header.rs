//! Headers of a request and of its answer: plain data, versioned by type name.

use iceoryx2::prelude::ZeroCopySend;

/// What the coupler asks for. Sent before the payload of each request.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, PartialEq, ZeroCopySend)]
#[type_name("rockfall.RequestHeader.v1")]
pub struct RequestHeader {
    /// Number of the run (hash of its id).
    pub run: u64,
    /// Number of this exchange with this solver, from 1, without gaps.
    pub sequence: u64,
    /// Number of the window, from 1; each half of a halved window has its own.
    pub window: u64,
    /// Coupling iteration in the window, from 1.
    pub iteration: u32,
    /// A [`Command`], as number.
    pub command: u32,
    /// Start of the window [s].
    pub start: f64,
    /// Length of the window [s].
    pub length: f64,
}

/// The answer's echo of the request, and how it went.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, PartialEq, ZeroCopySend)]
#[type_name("rockfall.AnswerHeader.v1")]
pub struct AnswerHeader {
    /// As in the request.
    pub run: u64,
    /// As in the request.
    pub sequence: u64,
    /// As in the request.
    pub window: u64,
    /// As in the request.
    pub iteration: u32,
    /// A [`Status`], as number.
    pub status: u32,
    /// As in the request.
    pub start: f64,
    /// As in the request.
    pub length: f64,
}

/// What a request asks for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u32)]
pub enum Command {
    /// Solve this window from the committed state.
    Solve = 1,
    /// First commit the last solve (it was the accepted one), then solve this window.
    CommitAndSolve = 2,
}

impl Command {
    /// From its number.
    pub fn from_number(number: u32) -> Option<Self> {
        match number {
            1 => Some(Self::Solve),
            2 => Some(Self::CommitAndSolve),
            _ => None,
        }
    }
}

/// How a solve went.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u32)]
pub enum Status {
    /// The payload holds the answer.
    Done = 1,
    /// No answer for this window; a shorter one may succeed. The reason is asked for by message.
    Failed = 2,
}

impl AnswerHeader {
    /// Echo of `request`.
    pub fn echo(request: &RequestHeader, status: Status) -> Self {
        Self {
            run: request.run,
            sequence: request.sequence,
            window: request.window,
            iteration: request.iteration,
            status: status as u32,
            start: request.start,
            length: request.length,
        }
    }

    /// The first thing in which this is not the answer to `request`, both values named.
    pub fn mismatch(&self, request: &RequestHeader) -> Option<String> {
        let numbers = [
            ("run", self.run, request.run),
            ("sequence", self.sequence, request.sequence),
            ("window", self.window, request.window),
            ("iteration", self.iteration.into(), request.iteration.into()),
        ];
        if let Some((what, got, asked)) = numbers.into_iter().find(|(_, got, asked)| got != asked) {
            return Some(format!("answered {what} {got}, asked was {what} {asked}"));
        }
        let times = [("start", self.start, request.start), ("length", self.length, request.length)];
        if let Some((what, got, asked)) = times.into_iter().find(|(_, a, b)| a.to_bits() != b.to_bits()) {
            return Some(format!("answered a window with {what} {got} s, asked was {what} {asked} s"));
        }
        (self.status != Status::Done as u32 && self.status != Status::Failed as u32)
            .then(|| format!("status {} has no meaning; 1 = done, 2 = failed", self.status))
    }
}
