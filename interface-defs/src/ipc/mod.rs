//! The contract over iceoryx2: processes of their own, shared memory in between.
//!
//! The coupler creates every channel, a solver opens them. Per solver `NAME` there are two
//! request-response services and one event, each request is answered by exactly one response:
//!
//! - `NAME/control`: [`message`](crate::message)s in frames of bytes ([`control`])
//! - `NAME/field`: the payloads of windows as `[f64]` behind the [`header`](crate::header)s
//! - `NAME/wake` and `coupler/wake`: "look, there is something", and the coupler's sign of life
//!
//! Files: [`run_id`] (its name), [`domain`] (one run's own place, liveness, cleaning), `home` (the private directory of a
//! user's runs), `memory` (what a run has in shared memory), [`wait`] (how to wait, and for how long), [`channel`] (the
//! services), [`control`] (frames), [`remote`] (the coupler's side), [`serve`] (the solver's side), [`interrupt`] (Ctrl-C), [`link`]
//! and [`bridge`] (the same over TCP, to a solver that is elsewhere).

pub mod bridge;
pub mod channel;
pub mod control;
pub mod domain;
mod home;
pub mod interrupt;
pub mod link;
mod memory;
pub mod remote;
pub mod run_id;
pub mod serve;
pub mod wait;

pub use domain::clean;
pub use remote::{Host, Remote};
pub use run_id::RunId;
pub use serve::Connection;
pub use wait::{TIMEOUT, Wait};

use crate::participant::Failure;

/// A failure of the transport itself, in words.
pub(crate) fn transport<E: std::fmt::Debug>(what: impl std::fmt::Display) -> impl FnOnce(E) -> Failure {
    move |e| Failure::Transport(format!("{what}: {e:?}"))
}
