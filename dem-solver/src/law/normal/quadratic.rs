//! `F = k d^2`, stiffness `2 k d`, energy `k d^3 / 3`.

use super::{Load, NormalLaw, Powers, Refusal};
use crate::law::elastic::Elastic;
use schemars::JsonSchema;
use serde::Deserialize;

/// What `law = "quadratic"` has beside what all laws have.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct QuadraticKeys {
    /// Force over the square of the overlap [N/m2].
    pub force_per_square: f64,
}

/// Force ~ overlap^2.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Quadratic {
    factor: f64,
}

impl NormalLaw for Quadratic {
    type Keys = QuadraticKeys;

    fn new(keys: QuadraticKeys, sides: Option<&Elastic>) -> Result<Self, Refusal> {
        let factor = keys.force_per_square;
        if sides.is_some() {
            return Err(
                Refusal::of("young", "it has `force_per_square` in its place").try_instead("leave it out")
            );
        }
        if factor <= 0.0 {
            return Err(Refusal::of(
                "force_per_square",
                format!("force_per_square = {factor}: it must lie above 0"),
            ));
        }
        Ok(Self { factor })
    }

    #[inline(always)]
    fn load(&self, _radius: f64, overlap: f64) -> Load {
        let force = self.factor * overlap * overlap;
        Load { stiffness: 2.0 * self.factor * overlap, force, energy: force * overlap / 3.0 }
    }

    fn powers(&self) -> Powers {
        Powers { overlap: 3.0, radius: 0.0 }
    }

    fn rebound(&self) -> f64 {
        2.804_364_210_650_9
    }

    fn describe(&self) -> String {
        format!("quadratic contact, F = {:.4e} N/m2 times the overlap squared", self.factor)
    }
}
