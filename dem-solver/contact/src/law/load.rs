//! What a normal law answers at an overlap.

/// What the normal law gives.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
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
    /// Duration of an elastic impact in deepest overlap over speed: the integral of `2 dx / sqrt(1 - x^n)` from 0 to 1, that is
    /// `2 sqrt(pi) G(1 + 1/n) / G(1/2 + 1/n)` with the gamma function G.
    pub rebound: f64,
}

impl Powers {
    /// Of a spring of constant stiffness.
    pub const LINEAR: Self = Self { overlap: 2.0, radius: 0.0, rebound: std::f64::consts::PI };
    /// Of a Hertz contact.
    pub const HERTZ: Self = Self { overlap: 2.5, radius: 0.5, rebound: 2.943_275_184_3 };
}

impl Load {
    /// Of a spring of constant stiffness [N/m].
    #[inline(always)]
    pub fn linear(stiffness: f64, overlap: f64) -> Self {
        let force = stiffness * overlap;
        Self { stiffness, force, energy: 0.5 * force * overlap }
    }

    /// Of a Hertz contact of `modulus` [Pa].
    #[inline(always)]
    pub fn hertz(modulus: f64, radius: f64, overlap: f64) -> Self {
        let stiffness = 2.0 * modulus * (radius * overlap).sqrt();
        let force = 2.0 / 3.0 * stiffness * overlap;
        Self { stiffness, force, energy: 0.4 * force * overlap }
    }
}
