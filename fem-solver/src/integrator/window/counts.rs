//! What a run did.

/// Work that was done, iterations of windows included, and windows that were skipped.
#[derive(Debug, Clone, Copy, Default)]
pub struct Counts {
    /// Steps of the integrator.
    pub steps: u64,
    /// Newton iterations, form finding included.
    pub newton: u64,
    /// Factorisations, form finding included.
    pub factorisations: u64,
    /// Factorisations that were spared: the factor at hand was that of the tangent asked for.
    pub kept_factors: u64,
    /// Windows begun anew with twice the steps, because Newton had failed.
    pub refined: u64,
    /// Steps along a path of equilibrium that were taken anew, shorter.
    pub refused: u64,
    /// Steps with a tangent that was not positive and had to be shifted.
    pub shifted: u64,
    /// Those of them whose last tangent was such.
    pub unstable: u64,
    /// Degree of freedom of the pivot that was not positive, in the first of them.
    pub unstable_at: Option<usize>,
    /// Most of its strength that anything carried as it broke in an implicit step, where that was too much; 0 where nothing did.
    pub late: f64,
    /// Committed windows in which nothing loaded or moved the structure.
    pub skipped: u64,
}
