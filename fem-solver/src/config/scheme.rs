//! The implicit scheme that a scene asks for.
//!
//! Source: Chung and Hulbert (1993), J. Appl. Mech. 60, 371; Bossak: Wood, Bossak and Zienkiewicz (1980), IJNME 15, 1562.

use super::fem::{FemConfig, Integrator};

/// Parameters of the family.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scheme {
    /// Where inertia balances, `am`.
    pub alpha_m: f64,
    /// Where forces balance, `af`.
    pub alpha_f: f64,
    /// `b`.
    pub beta: f64,
    /// `g`.
    pub gamma: f64,
    /// Without inertia: statics.
    pub inertia: bool,
}

impl Scheme {
    /// The scheme that a scene asks for; `None` where it is explicit.
    pub fn of(fem: &FemConfig) -> Option<Self> {
        let fem = fem.resolved();
        let dynamic = |alpha_m: f64, alpha_f: f64| Self {
            alpha_m,
            alpha_f,
            beta: 0.25 * (1.0 - alpha_m + alpha_f).powi(2),
            gamma: 0.5 - alpha_m + alpha_f,
            inertia: true,
        };
        match fem.integrator {
            Integrator::CentralDifference => None,
            Integrator::Static => Some(Self { inertia: false, ..dynamic(0.0, 0.0) }),
            Integrator::GeneralizedAlpha => {
                let r = fem.rho_inf.unwrap_or(1.0);
                Some(dynamic((2.0 * r - 1.0) / (r + 1.0), r / (r + 1.0)))
            }
            Integrator::Bossak => Some(dynamic(fem.alpha.unwrap_or(-0.3), 0.0)),
            Integrator::Newmark => {
                let (beta, gamma) = (fem.beta.unwrap_or(0.25), fem.gamma.unwrap_or(0.5));
                Some(Self { beta, gamma, ..dynamic(0.0, 0.0) })
            }
        }
    }

    /// Whether its load is the mean over the step alone.
    pub fn takes_mean_only(&self) -> bool {
        self.alpha_f == 0.5
    }

    /// Whether its load is that at the step's end alone.
    pub fn takes_end_only(&self) -> bool {
        self.alpha_f == 0.0
    }
}
