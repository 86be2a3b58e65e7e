//! What a run of the loop has done, in numbers.

/// What was done.
#[derive(Debug, Clone, Copy, Default)]
pub struct Counts {
    /// Committed windows.
    pub windows: u64,
    /// Coupling iterations, those of failed windows included.
    pub iterations: u64,
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
