//! Plain Gauss-Seidel: the answer is the next iterate.

use super::{Acceleration, relax};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// No relaxation. Converges only where the product of the stiffness of the contact and the compliance of the
/// structure in a window is below 1.
#[derive(Debug, Clone, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct NoRelaxation {}

impl Acceleration for NoRelaxation {
    fn start_window(&mut self, _most: usize) {}

    fn update(&mut self, x: &mut [f64], residual: &[f64], _nodes: &[u32]) {
        relax(x, residual, 1.0);
    }

    fn factor(&self) -> f64 {
        1.0
    }
}
