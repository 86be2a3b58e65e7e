//! A solver as the coupler sees it, in this process or in another.

use crate::diagnostic::{Diagnostic, code};
use crate::field::Layout;
use crate::header::{RequestHeader, Status};
use crate::message::{Fault, FaultKind, Hello, Plan, Ready, Statistics};
use crate::solver::OnProgress;
use std::fmt;

/// Why a participant did not answer as asked.
#[derive(Debug, Clone, PartialEq)]
pub enum Failure {
    /// It answered with a fault.
    Fault {
        /// Who.
        solver: String,
        /// Its reason.
        fault: Fault,
    },
    /// Its process ended.
    Lost {
        /// Who.
        solver: String,
        /// In the middle of what, and how it was noticed.
        during: String,
    },
    /// It lives and has not answered within the deadline.
    Silent {
        /// Who.
        solver: String,
        /// Waited for what.
        during: String,
        /// Seconds.
        waited: f64,
        /// Seconds.
        deadline: f64,
    },
    /// It has not come: it was never started, or not with the id of this run.
    Absent {
        /// Who.
        who: String,
        /// Seconds.
        waited: f64,
        /// Seconds.
        deadline: f64,
    },
    /// It broke the contract.
    Contract {
        /// Who.
        solver: String,
        /// What, with the numbers of both sides.
        what: String,
        /// Number of the clause of `PROTOCOL.md`, where it is about one.
        clause: Option<&'static str>,
    },
    /// The user has interrupted the run.
    Interrupted,
    /// The coupler has ended the run before its time, for this reason.
    Aborted(String),
    /// The transport itself failed.
    Transport(String),
}

impl Failure {
    /// `solver` breaks the contract: `what`, with the numbers of both sides.
    pub fn contract(solver: &str, what: impl Into<String>) -> Self {
        Self::Contract { solver: solver.into(), what: what.into(), clause: None }
    }

    /// The same of a clause of `PROTOCOL.md`.
    pub fn breach(solver: &str, clause: &'static str, what: impl Into<String>) -> Self {
        Self::Contract { solver: solver.into(), what: what.into(), clause: Some(clause) }
    }

    /// True where the failure is the user's input: exit code 2.
    pub fn is_input(&self) -> bool {
        matches!(self, Self::Fault { fault: Fault { kind: FaultKind::Input, .. }, .. })
    }
}

impl From<&Failure> for Diagnostic {
    /// A solver's own diagnostic, that names the solver where it has no place in a file; else one about `processes.NAME`.
    fn from(failure: &Failure) -> Self {
        let of =
            |code, solver: &str| Self::error(code, failure.to_string()).about(format!("processes.{solver}"));
        match failure {
            Failure::Fault { fault, .. } if fault.diagnostic.place.is_some() => (*fault.diagnostic).clone(),
            Failure::Fault { solver, fault } => {
                let message = format!("{solver}: {}", fault.diagnostic.message);
                Self { message, ..(*fault.diagnostic).clone() }
            }
            Failure::Lost { solver, .. }
            | Failure::Silent { solver, .. }
            | Failure::Absent { who: solver, .. } => of(code::PROCESS, solver),
            Failure::Contract { solver, .. } => of(code::CONTRACT, solver),
            Failure::Interrupted => Self::error(code::INTERRUPTED, failure.to_string()),
            Failure::Aborted(_) | Failure::Transport(_) => Self::error(code::PROCESS, failure.to_string()),
        }
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Self::Fault { solver, fault } if fault.kind == FaultKind::Interrupted => {
                write!(f, "{solver} was interrupted")
            }
            Self::Fault { solver, fault } => write!(f, "{solver}: {fault}"),
            Self::Lost { solver, during } => write!(f, "{solver} was lost: its process ended {during}"),
            Self::Silent { solver, during, waited, deadline } => write!(
                f,
                "no answer from {solver} {during}: waited {waited:.1} s of {deadline:.1} s; its process is alive; \
                 if it needs longer, raise processes.timeout"
            ),
            Self::Absent { who, waited, deadline } => write!(
                f,
                "no answer from {who} at the start of the run: waited {waited:.1} s of {deadline:.1} s, and it has not \
                 joined; was it started, with the id of this run, and does it use iceoryx2 0.10? in a container, does it share /tmp (or \
                 $XDG_RUNTIME_DIR) and the user id? if it needs longer, raise processes.timeout"
            ),
            Self::Contract { solver, what, clause } => {
                write!(f, "{solver} breaks the interface contract: {what}")?;
                clause.map_or(Ok(()), |clause| write!(f, " (PROTOCOL.md, clause {clause})"))
            }
            Self::Interrupted => f.write_str("interrupted"),
            Self::Aborted(reason) => write!(f, "the coupler has ended the run: {reason}"),
            Self::Transport(what) => f.write_str(what),
        }
    }
}

impl std::error::Error for Failure {}

/// A request: its header, and the lengths of both payloads.
#[derive(Debug, Clone, Copy, Default)]
pub struct Request {
    /// What is asked.
    pub header: RequestHeader,
    /// Numbers that are sent.
    pub sends: usize,
    /// Numbers of the answer's fields and gauges; what it lists comes on top. `None`: its list says how many they are.
    pub expects: Option<usize>,
}

/// Writes the payload of a request in place.
pub type Fill<'a> = &'a mut dyn FnMut(&mut [f64]);

/// A solver as the coupler sees it. Once prepared it has two verbs: send and receive.
pub trait Participant {
    /// Its name in this run (`dem`, `fem`).
    fn name(&self) -> &str;

    /// Wait until it is there.
    fn hello(&mut self) -> Result<Hello, Failure>;

    /// Let it build everything.
    fn prepare(&mut self, plan: &Plan, progress: OnProgress) -> Result<Ready, Failure>;

    /// Send a request; `fill` writes its payload in place. `header.run` and `.sequence` are set here.
    fn send(&mut self, request: Request, fill: Fill) -> Result<(), Failure>;

    /// Wait for the answer to the request sent last. [`Status::Failed`]: ask [`Participant::explain`].
    fn receive(&mut self) -> Result<Status, Failure>;

    /// Payload of the answer received last, as the solver wrote it, not copied: fields of the plan,
    /// then three numbers per gauge, then what it lists.
    fn answer(&self) -> &[f64];

    /// How many numbers at its end are a list.
    fn listed(&self) -> usize;

    /// Why the last solve failed.
    fn explain(&mut self) -> Result<Fault, Failure>;

    /// End the run, committing the last solve if `commit`.
    fn finish(&mut self, commit: bool) -> Result<Statistics, Failure>;

    /// Its committed state, after the commit of the last solve if `commit`; it is at rest, and stays in the run.
    fn save(&mut self, commit: bool) -> Result<Vec<u8>, Failure>;

    /// Before it is prepared: let it go on from a state that it gave.
    fn resume(&mut self, state: &[u8]) -> Result<(), Failure>;
}

/// Lengths of the payloads of request and answer that follow from plan and readiness.
pub fn payload_lengths(plan: &Plan, ready: &Ready) -> (usize, usize) {
    let takes = Layout::new(&plan.takes, &ready.mesh, 0).len();
    let gives = Layout::new(&plan.gives, &ready.mesh, ready.gauges.len()).len();
    (takes, gives)
}
