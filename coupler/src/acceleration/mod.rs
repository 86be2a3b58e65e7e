//! Acceleration: the residual of one coupling iteration becomes the next iterate.

mod aitken;
mod constant;
mod none;

pub use aitken::Aitken;
pub use constant::Constant;
pub use none::NoRelaxation;

use crate::registry::registry;

/// Turns the residual of one coupling iteration into the next iterate.
pub trait Acceleration {
    /// Forget the iterations of the window before; the next has `most` unknowns at most.
    fn start_window(&mut self, most: usize);

    /// Overwrite `x` with the next iterate, given `residual = H(x) - x` (same length, one unit: metres).
    fn update(&mut self, x: &mut [f64], residual: &[f64]);

    /// Relaxation factor used last.
    fn factor(&self) -> f64;

    /// What is wrong with its settings, as key and reason.
    fn check(&self) -> Result<(), (&'static str, String)>;
}

registry! {
    /// Every acceleration that `[coupling.acceleration] type` may name.
    pub enum AnyAcceleration: Acceleration {
        "none" => NoRelaxation,
        "constant" => Constant,
        "aitken" => Aitken,
    }
}

impl Default for AnyAcceleration {
    fn default() -> Self {
        Self::Aitken(Aitken::default())
    }
}

/// `x <- x + factor residual`.
fn relax(x: &mut [f64], residual: &[f64], factor: f64) {
    for (x, r) in x.iter_mut().zip(residual) {
        *x += factor * r;
    }
}
