//! What a run of the loop has done, in numbers.

use serde::{Deserialize, Serialize};

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
