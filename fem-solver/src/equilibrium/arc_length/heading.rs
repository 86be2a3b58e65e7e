//! Directions along a path of equilibrium, and the angles between them.

/// The direction of a path: its displacements, and its load in units of the steepest that there was.
#[derive(Clone, Copy)]
pub struct Heading {
    size: f64,
    pub load: f64,
}

impl Heading {
    /// Of displacements per way, and of the load per way [1/m]; `steepest` is its largest per norm of all displacements.
    pub fn new(displacement: &[f64], rate: f64, steepest: f64) -> Self {
        let size = norm(displacement);
        let load = if steepest > 0.0 { rate / (size * steepest) } else { 0.0 };
        Self { size, load }
    }

    /// Product of two directions, `inner` being that of their displacements.
    pub fn dot(&self, other: &Self, inner: f64) -> f64 {
        inner / (self.size * other.size) + self.load * other.load
    }

    /// Of the angle between two directions.
    pub fn cosine(&self, other: &Self, inner: f64) -> f64 {
        self.dot(other, inner) / (1.0 + self.load * self.load).sqrt() / (1.0 + other.load * other.load).sqrt()
    }

    /// Of the displacements alone.
    pub fn cosine_of_shapes(&self, other: &Self, inner: f64) -> f64 {
        inner / (self.size * other.size)
    }
}

/// Whose cosine it is, as far as rounding lets it be one [rad].
pub fn angle(cosine: f64) -> f64 {
    cosine.clamp(-1.0, 1.0).acos()
}

/// Product of two vectors.
pub fn inner(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Length of a vector.
pub fn norm(x: &[f64]) -> f64 {
    inner(x, x).sqrt()
}
