//! The interface contract between the coupler and a solver: protocol version 3.
//!
//! A solver is a function of (committed state, input) over one time window. Whoever implements
//! [`Solver`] and calls [`serve`] in `main` takes part in a co-simulation; nothing else is needed.
//! `PROTOCOL.md` beside this crate describes the same contract byte by byte, for other languages.
//!
//! # Where to begin
//!
//! A solver of your own: [`solver`] (the trait, in fewer than 60 lines in `examples/oscillator.rs`), then [`field`]. The coupler's side:
//! [`participant`]. What happens in a window, file by file: `ARCHITECTURE.md`.
//!
//! - [`field`]: which numbers cross the interface, and where they lie in the flat payload
//! - [`header`]: the plain-data headers of a request and its answer
//! - [`message`]: handshake, preparation, faults, statistics (bincode, apart from the field path)
//! - [`diagnostic`], [`verdict`]: what is wrong, and what became of rocks and structure, as data
//! - [`mesh`]: the interface mesh, on which a contact solver works
//! - [`selection`]: the nodes that are sent, where not all of them are
//! - [`solver`]: the trait of a solver
//! - [`participant`]: the trait at the coupler's side, [`clause`]: what it may say is broken
//! - [`exchange`]: what a request asks of a solver, the same for every transport
//! - [`ipc`]: the same over iceoryx2, in processes of their own
//!
//! What rockfall's own programs share beside the contract (scene text and its errors, result files, run directory, exit codes) is
//! not needed by a foreign solver.

/// Target of the spans that `--profile` shows; without that option they cost nothing.
pub const PROFILE: &str = "profile";

/// A span of the profile, from here to the end of the block that holds it.
#[macro_export]
macro_rules! profile {
    ($($what:tt)*) => {
        tracing::trace_span!(target: $crate::PROFILE, $($what)*).entered()
    };
}

/// Declares an enum each of whose variants has a word, and the method that says it.
///
/// ```
/// interface_defs::worded! {
///     /// How a run ended.
///     #[derive(Clone, Copy)]
///     pub enum Ending with word {
///         /// To its end.
///         Done = "done",
///         /// The user has ended it.
///         Stopped = "stopped by the user",
///     }
/// }
/// assert_eq!(Ending::Stopped.word(), "stopped by the user");
/// ```
#[macro_export]
macro_rules! worded {
    ($(#[$about:meta])* $vis:vis enum $name:ident with $say:ident {
        $($(#[$of:meta])* $variant:ident = $word:literal,)+
    }) => {
        $(#[$about])*
        $vis enum $name {
            $($(#[$of])* $variant,)+
        }

        impl $name {
            /// In words.
            $vis fn $say(self) -> &'static str {
                [$($word),+][self as usize]
            }
        }
    };
}

pub mod clause;
pub mod diagnostic;
pub mod exchange;
pub mod field;
pub mod header;
pub mod ipc;
pub mod mesh;
pub mod message;
#[cfg(test)]
mod message_golden;
pub mod part;
pub mod participant;
pub mod selection;
pub mod solver;
pub mod verdict;

pub use diagnostic::{Code, Diagnostic, Severity, code};
pub use field::{FieldSpec, Items, Layout, Place, Sampling, name};
pub use header::{AnswerHeader, Command, RequestHeader, Status};
pub use ipc::{RunId, serve::serve};
pub use mesh::{Group, InterfaceMesh};
pub use message::{
    Fault, FaultKind, Gauge, Hello, Measure, Plan, Progress, Ready, Role, Statistics, Worse, capability,
};
pub use part::{PartUse, ShareOf, Utilisation};
pub use participant::{Failure, Fill, Participant, Request};
pub use selection::Selection;
pub use solver::{OnProgress, Solver, Window};
pub use verdict::{Fate, Torn, Verdict};
