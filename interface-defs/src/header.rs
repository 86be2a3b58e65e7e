//! Headers of a request and of its answer: plain data, versioned by type name.

use crate::solver::Solver;
use iceoryx2::prelude::ZeroCopySend;
use serde::{Deserialize, Serialize};

/// What the coupler asks for. Sent before the payload of each request.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize, ZeroCopySend)]
#[type_name("rockfall.RequestHeader.v2")]
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
    /// Nodes for which the payload's fields are laid out: 0 = all of the interface mesh, 1 = those selected last.
    pub selection: u32,
    /// Numbers at the payload's end that select nodes from this request on: the nodes, then pairs of places among them, see
    /// `PROTOCOL.md`; 0 = as before.
    pub listed: u32,
    /// How many of these numbers are nodes.
    pub nodes: u32,
    /// Always 0.
    pub reserved: u32,
}

/// The answer's echo of the request, and how it went.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize, ZeroCopySend)]
#[type_name("rockfall.AnswerHeader.v2")]
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
    /// As in the request.
    pub selection: u32,
    /// Numbers at the payload's end that are no field and no gauge: nodes ([`Command::Reach`]) or pairs ([`Command::State`]).
    pub listed: u32,
    /// Always 0.
    pub reserved: [u32; 2],
}

/// What a request asks for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u32)]
pub enum Command {
    /// Solve this window from the committed state.
    Solve = 1,
    /// First commit the last solve (it was the accepted one), then solve this window.
    CommitAndSolve = 2,
    /// To a structure that can select: answer with the committed state, for the nodes that are selected; solve nothing.
    State = 3,
    /// First commit the last solve, then as [`Command::State`].
    CommitAndState = 4,
    /// To a contact solver that can select: list the nodes that it must see from the committed state on; solve nothing.
    Reach = 5,
    /// First commit the last solve, then as [`Command::Reach`].
    CommitAndReach = 6,
}

impl Command {
    /// By their numbers: each, and behind it the same after a commit.
    const ALL: [Self; 6] = [
        Self::Solve,
        Self::CommitAndSolve,
        Self::State,
        Self::CommitAndState,
        Self::Reach,
        Self::CommitAndReach,
    ];

    /// From its number.
    pub fn from_number(number: u32) -> Option<Self> {
        Self::ALL.into_iter().find(|command| *command as u32 == number)
    }

    /// Whether the last solve is committed first.
    pub fn commits(self) -> bool {
        self != self.without_commit()
    }

    /// The same without a commit.
    pub fn without_commit(self) -> Self {
        Self::ALL[(self as usize - 1) & !1]
    }

    /// The same after a commit.
    pub fn after_commit(self) -> Self {
        Self::ALL[(self as usize - 1) | 1]
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
    /// No answer: a contact solver must see nodes that are not selected. The coupler asks [`Command::Reach`].
    Beyond = 3,
    /// As [`Self::Done`], and this solver is at rest: nothing of it will move any more unless the other one moves it.
    Rest = 4,
}

impl Status {
    /// That of an answer of `solver`.
    pub fn of(solver: &dyn Solver) -> Self {
        if solver.is_at_rest() { Self::Rest } else { Self::Done }
    }

    /// From its number.
    pub fn from_number(number: u32) -> Option<Self> {
        [Self::Done, Self::Failed, Self::Beyond, Self::Rest]
            .into_iter()
            .find(|status| *status as u32 == number)
    }
}

impl AnswerHeader {
    /// Echo of `request`.
    pub fn echo(request: &RequestHeader, status: Status) -> Self {
        let RequestHeader { run, sequence, window, iteration, start, length, selection, .. } = *request;
        let status = status as u32;
        Self { run, sequence, window, iteration, status, start, length, selection, ..Self::default() }
    }

    /// The first thing in which this is not the answer to `request`, both values named.
    pub fn mismatch(&self, request: &RequestHeader) -> Option<String> {
        let numbers = [
            ("run", self.run, request.run),
            ("sequence", self.sequence, request.sequence),
            ("window", self.window, request.window),
            ("iteration", self.iteration.into(), request.iteration.into()),
            ("selection", self.selection.into(), request.selection.into()),
        ];
        if let Some((what, got, asked)) = numbers.into_iter().find(|(_, got, asked)| got != asked) {
            return Some(format!("answered {what} {got}, asked was {what} {asked}"));
        }
        let times = [("start", self.start, request.start), ("length", self.length, request.length)];
        if let Some((what, got, asked)) = times.into_iter().find(|(_, a, b)| a.to_bits() != b.to_bits()) {
            return Some(format!("answered a window with {what} {got} s, asked was {what} {asked} s"));
        }
        Status::from_number(self.status).is_none().then(|| {
            format!("status {} has no meaning; 1 = done, 2 = failed, 3 = beyond the selection", self.status)
        })
    }
}
