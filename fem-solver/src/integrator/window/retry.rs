//! Windows that are begun again with shorter steps: where Newton fails, and where something breaks.

use super::{Engine, WindowSolver};
use crate::model::Model;
use interface_defs::message::{Fault, FaultKind};
use interface_defs::solver::Window;

/// A window in which Newton fails is cut into at most so many times the steps before it is given up.
const FINEST: usize = 8;

/// An implicit step ends where something breaks: a window in which that used more of its strength than all of it and this
/// part is cut into more steps.
const BREAKS_WITHIN: f64 = 0.01;
/// At most so many times the steps.
const FINEST_TORN: usize = 64;

impl WindowSolver {
    /// Advance over the window; where Newton fails, again from its start with twice the steps. Where something breaks in it
    /// for the first time, again with the steps of a torn structure; where that is far beyond its strength, with more.
    pub(super) fn advance(
        &mut self,
        model: &Model,
        window: &Window,
        input: &[f64],
        output: &mut [f64],
    ) -> Result<(), Fault> {
        let mut finer = 1;
        let mut longest = self.longest_step(!self.committed.events.is_empty());
        loop {
            match self.advance_by(model, window, input, output, (longest, finer)) {
                Ok(()) => {
                    let torn = self.longest_step(!self.trial.events.is_empty());
                    let late = ((self.broke_under - 1.0) / BREAKS_WITHIN).clamp(0.0, FINEST_TORN as f64);
                    if torn < longest {
                        longest = torn;
                    } else if late > 1.0 && finer < FINEST_TORN && self.moves() {
                        finer = (finer * (late.ceil() as usize).next_power_of_two()).min(FINEST_TORN);
                    } else {
                        if late > 1.0 {
                            self.counts.late = self.counts.late.max(self.broke_under);
                        }
                        return Ok(());
                    }
                    self.begin_again();
                }
                Err(fault)
                    if fault.kind == FaultKind::Interrupted
                        || finer >= FINEST
                        || self.load_steps.is_some()
                        || !matches!(self.engine, Engine::Implicit(_)) =>
                {
                    return Err(fault);
                }
                Err(_) => {
                    finer *= 2;
                    self.counts.refined += 1;
                    self.begin_again();
                }
            }
        }
    }

    /// Whether there is inertia: in statics a step is what the scene makes it.
    fn moves(&self) -> bool {
        matches!(&self.engine, Engine::Implicit(implicit) if implicit.scheme.inertia)
    }

    /// The longest step of a structure that is torn or not [s].
    fn longest_step(&self, torn: bool) -> f64 {
        if torn { self.torn_step } else { self.time_step }
    }

    fn begin_again(&mut self) {
        self.trial.copy_from(&self.committed);
        self.trial.at_rest = false;
    }
}
