//! What a window takes from the one before, for a run that goes on.

use super::report::Booked;
use super::{Counts, WindowSolver};
use crate::model::Model;
use crate::results::moving_mean::Sample;
use crate::state::State;
use interface_defs::diagnostic::{Diagnostic, code};
use interface_defs::message::Fault;
use serde::{Deserialize, Serialize};

/// The committed state, and what was booked and counted by then.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct KeptWindows {
    committed: State,
    booked: Booked,
    /// Impulse of the supports within the last 1 ms.
    impulse: Vec<Sample>,
    counts: Counts,
}

impl WindowSolver {
    /// What the next window follows from.
    pub fn kept(&self) -> KeptWindows {
        KeptWindows {
            committed: self.committed.clone(),
            booked: self.booked[1].clone(),
            impulse: self.recorder.kept(),
            counts: self.counts,
        }
    }

    /// Go on from there.
    ///
    /// # Errors
    ///
    /// If that is of another structure.
    pub fn go_on(&mut self, model: &Model, kept: KeptWindows) -> Result<(), Fault> {
        let sizes = |state: &State, gauges: usize| {
            let State { displacement: u, velocity: v, acceleration: a, force: f, load, .. } = state;
            ([u, v, a, f, load, &state.history].map(Vec::len), state.groups.len(), gauges)
        };
        let own = sizes(&self.committed, self.booked[1].gauges.len());
        let torn = kept.committed.events.iter().all(|event| (event.element as usize) < model.elements.len());
        if own != sizes(&kept.committed, kept.booked.gauges.len()) || kept.impulse.is_empty() || !torn {
            return Err(other_structure());
        }
        self.committed.copy_from(&kept.committed);
        self.trial.copy_from(&kept.committed);
        self.booked = [kept.booked.clone(), kept.booked];
        self.recorder.go_on(kept.impulse);
        self.counts = kept.counts;
        Ok(())
    }
}

/// That what was kept is of another structure.
pub fn other_structure() -> Fault {
    let what = "the state that was kept is of another structure";
    Diagnostic::error(code::PROVENANCE, what).into()
}
