//! What a window takes from the one before, for a run that goes on.

use super::report::Booked;
use super::{Counts, WindowSolver};
use crate::results::moving_mean::Sample;
use crate::state::State;
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
    pub fn go_on(&mut self, kept: KeptWindows) {
        self.committed.copy_from(&kept.committed);
        self.trial.copy_from(&kept.committed);
        self.booked = [kept.booked.clone(), kept.booked];
        self.recorder.go_on(kept.impulse);
        self.counts = kept.counts;
    }
}
