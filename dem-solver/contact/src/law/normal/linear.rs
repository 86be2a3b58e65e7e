//! Linear: constant `k`, `F = k d`, energy `1/2 F d`; from a modulus
//! `k = pi E* R sqrt(a (2 - a))` with a = 0.05, the contact area at 5 % indentation.
//!
//! Source: the linear law of the reference implementation (KratosMultiphysics), whose stiffness is that of Hertz at this indentation.

use super::{Load, NormalLaw, Powers};
use crate::law::elastic::Elastic;
use interface_defs::diagnostic::Diagnostic;
use schemars::JsonSchema;
use serde::Deserialize;
use std::f64::consts::PI;

/// Nominal indentation at which a modulus makes a stiffness.
const INDENTATION: f64 = 0.05;

/// What `law = "linear"` has beside what all laws have.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LinearKeys {
    /// Normal stiffness of a contact [N/m]. Exactly one of `stiffness` and `young`.
    pub stiffness: Option<f64>,
}

/// Force ~ overlap.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Linear {
    /// Stiffness: of every contact [N/m], or of the radius [N/m2].
    pub stiffness: f64,
    /// True if it is of the radius.
    pub per_radius: bool,
}

impl NormalLaw for Linear {
    type Keys = LinearKeys;

    fn new(keys: LinearKeys, sides: Option<&Elastic>) -> Result<Self, Diagnostic> {
        let wrong = |what: &str| Err(Diagnostic::new(what).about("stiffness"));
        match (keys.stiffness, sides) {
            (Some(_), Some(_)) => wrong("young and stiffness define one thing twice: keep one of them"),
            (None, None) => wrong("`linear` needs `stiffness` [N/m] or `young` [Pa]"),
            (Some(k), None) if k <= 0.0 => wrong(&format!("stiffness = {k}: it must lie above 0")),
            (Some(stiffness), None) => Ok(Self { stiffness, per_radius: false }),
            (None, Some(sides)) => {
                let area = (INDENTATION * (2.0 - INDENTATION)).sqrt();
                Ok(Self { stiffness: PI * sides.modulus() * area, per_radius: true })
            }
        }
    }

    #[inline(always)]
    fn load(&self, radius: f64, overlap: f64) -> Load {
        let stiffness = if self.per_radius { self.stiffness * radius } else { self.stiffness };
        Load::linear(stiffness, overlap)
    }

    fn powers(&self) -> Powers {
        Powers { radius: if self.per_radius { 1.0 } else { 0.0 }, ..Powers::LINEAR }
    }

    fn deepest(&self, radius: f64, mass: f64, speed: f64) -> f64 {
        (2.0 * (0.5 * mass * speed * speed) / self.load(radius, 1.0).stiffness).sqrt()
    }

    fn impact(&self, radius: f64, mass: f64, speed: f64) -> (f64, f64) {
        let duration = PI * (mass / self.load(radius, 1.0).stiffness).sqrt();
        (self.deepest(radius, mass, speed), duration)
    }

    fn describe(&self) -> String {
        let (k, unit) = (self.stiffness, if self.per_radius { "N/m2 times the radius" } else { "N/m" });
        format!("linear contact, k = {k:.4e} {unit}")
    }
}
