//! What others see of the loop: iterations, committed windows, and why it ended.

use crate::convergence::Residual;
use crate::energy::Balance;
use crate::interface::Moved;
use crate::schedule::Span;
use crate::side::Side;
use interface_defs::{Diagnostic, Failure};
use serde::{Deserialize, Serialize};
use std::fmt;

/// Why the run ended before its time.
#[derive(Debug, Clone, PartialEq)]
pub enum CouplingError {
    /// A participant failed, was lost, or broke the contract.
    Failed(Failure),
    /// A window could not be solved, and is not halved: not allowed, or as short as allowed.
    NotConverged(Box<Diagnostic>),
    /// The energy error has left its bound for good.
    Diverged(Box<Diagnostic>),
    /// The records could not be written.
    Output(Box<Diagnostic>),
}

impl CouplingError {
    /// The records could not be written.
    pub fn output(why: Diagnostic) -> Self {
        Self::Output(Box::new(why))
    }
}

impl fmt::Display for CouplingError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        Diagnostic::from(self).fmt(f)
    }
}

impl std::error::Error for CouplingError {}

impl From<&CouplingError> for Diagnostic {
    fn from(error: &CouplingError) -> Self {
        match error {
            CouplingError::Failed(failure) => failure.into(),
            CouplingError::NotConverged(why) | CouplingError::Diverged(why) | CouplingError::Output(why) => {
                (**why).clone()
            }
        }
    }
}

impl From<Failure> for CouplingError {
    fn from(failure: Failure) -> Self {
        Self::Failed(failure)
    }
}

/// One coupling iteration, as an observer sees it.
pub struct Iteration {
    /// The window.
    pub span: Span,
    /// Number of the iteration in it, from 1.
    pub iteration: u32,
    /// What is left.
    pub residual: Residual,
    /// Relaxation factor used for the iterate.
    pub factor: f64,
}

/// What was done.
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize)]
pub struct Counts {
    /// Committed windows.
    pub windows: u64,
    /// Coupling iterations, those of failed windows included.
    pub iterations: u64,
    /// Times that the nodes that cross the interface were selected.
    pub selections: u64,
    /// Windows that were solved again at half length.
    pub halved: u64,
    /// Those of them that were given up before `max_iterations`, since their residual grew or stayed.
    pub diverged: u64,
    /// Committed windows shorter than the scene's.
    pub short: u64,
    /// Windows accepted although they had not converged.
    pub unconverged: u64,
    /// Most iterations of a committed window.
    pub most_iterations: u32,
    /// Largest displacement residual of a committed window [m].
    pub largest_residual: f64,
}

/// One committed window, as an observer sees it.
pub struct Committed<'a> {
    /// The window.
    pub span: Span,
    /// Iterations that it took.
    pub iterations: u32,
    /// What was left.
    pub residual: Residual,
    /// Whether the residual passed (always true in weak coupling, where it is not judged).
    pub converged: bool,
    /// Whether the contact solver exerts a force.
    pub touches: bool,
    /// The contact solver's gauges, three numbers each.
    pub dem: &'a [f64],
    /// The structure's gauges, three numbers each.
    pub fem: &'a [f64],
    /// Mean force of the contact on the structure, all nodes together [N].
    pub contact: [f64; 3],
    /// Energy and work.
    pub balance: &'a Balance,
    /// What was done so far.
    pub counts: &'a Counts,
}

/// The state of a run between two windows: that of each solver in a form of its own, and that of the loop.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct KeptRun {
    /// The contact solver's.
    pub dem: Vec<u8>,
    /// The structure's.
    pub fem: Vec<u8>,
    /// The loop's.
    pub coupling: Vec<u8>,
}

/// Sees what happens; writes files, draws progress. The loop does neither.
pub trait Observer {
    /// Both solvers are prepared.
    fn prepared(&mut self, dem: &Side, fem: &Side, warnings: &[Diagnostic]) -> Result<(), Diagnostic>;
    /// A window is accepted, and not committed yet: where the interface is at its end.
    fn moved(&mut self, _moved: &Moved) -> Result<(), Diagnostic> {
        Ok(())
    }
    /// One iteration is done.
    fn iteration(&mut self, _iteration: &Iteration) -> Result<(), Diagnostic> {
        Ok(())
    }
    /// Whether the state of the run is to be kept now, between two windows; `interrupted`: the user ends it here.
    fn is_due(&mut self, _interrupted: bool) -> bool {
        false
    }
    /// The state of the run at `time` [s]: all windows so far have been reported.
    fn keep(&mut self, _time: f64, _kept: KeptRun) {}
    /// The state was asked for, and this solver cannot write its own down.
    fn cannot_keep(&mut self, _solver: &str) {}
    /// One window is committed. Called while the contact solver is at work on the next.
    fn committed(&mut self, committed: &Committed) -> Result<(), Diagnostic>;
}
