//! Relaxation by one factor for all iterations, or by none. A constant one converges while the factor is below 2/(1 + k S), with the stiffness k of the contact and the flexibility S of
//! the structure, since each iteration multiplies the error by 1 - factor (1 + k S).

use super::{Acceleration, Checked, relax};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// `x <- x + factor r`.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Constant {
    /// Relaxation factor in (0, 1]; smaller converges for stiffer contacts, and more slowly.
    pub factor: f64,
}

impl Default for Constant {
    fn default() -> Self {
        Self { factor: 0.5 }
    }
}

impl Acceleration for Constant {
    fn update(&mut self, x: &mut [f64], residual: &[f64], _nodes: &[u32]) {
        relax(x, residual, self.factor);
    }

    fn factor(&self) -> f64 {
        self.factor
    }

    fn check(&self) -> Checked {
        if self.factor > 0.0 && self.factor <= 1.0 {
            return Ok(());
        }
        Err(("factor", format!("the relaxation factor must lie in (0, 1], it is {}", self.factor)))
    }
}

/// No relaxation. Converges only where the product of the stiffness of the contact and the compliance of the
/// structure in a window is below 1.
#[derive(Debug, Clone, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct NoRelaxation {}

impl Acceleration for NoRelaxation {
    fn update(&mut self, x: &mut [f64], residual: &[f64], _nodes: &[u32]) {
        relax(x, residual, self.factor());
    }

    fn factor(&self) -> f64 {
        1.0
    }
}
