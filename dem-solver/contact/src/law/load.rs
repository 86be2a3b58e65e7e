//! What a normal law answers at an overlap.

/// What the normal law gives.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Load {
    /// Tangent stiffness [N/m].
    pub stiffness: f64,
    /// Elastic force [N].
    pub force: f64,
    /// Stored energy [J].
    pub energy: f64,
}

/// With which powers the energy of a contact grows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Powers {
    /// Of the overlap, n: force ~ overlap^(n-1), stiffness ~ overlap^(n-2).
    pub overlap: f64,
    /// Of the radius, at equal overlap.
    pub radius: f64,
}
