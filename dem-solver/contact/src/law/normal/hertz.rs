//! Hertz: `k = 2 E* sqrt(R* d)`, `F = 2/3 k d`, energy `2/5 F d`, with
//! `1/E* = (1 - nu^2) / E + (1 - nu'^2) / E'`; the second term is that of the other side, 0 where it is rigid.
//!
//! Source: handbook 1.2, 1.5.

use super::{Load, NoKeys, NormalLaw, Powers, Refusal};
use crate::law::elastic::Elastic;

/// Force ~ overlap^1.5.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hertz {
    /// `E*` [Pa].
    pub modulus: f64,
}

impl NormalLaw for Hertz {
    type Keys = NoKeys;

    fn new(_: NoKeys, sides: Option<&Elastic>) -> Result<Self, Refusal> {
        let sides = sides.ok_or_else(|| Refusal::of("young", "it needs `young` [Pa]"))?;
        Ok(Self { modulus: sides.modulus() })
    }

    #[inline(always)]
    fn load(&self, radius: f64, overlap: f64) -> Load {
        let stiffness = 2.0 * self.modulus * (radius * overlap).sqrt();
        let force = 2.0 / 3.0 * stiffness * overlap;
        Load { stiffness, force, energy: 0.4 * force * overlap }
    }

    fn powers(&self) -> Powers {
        Powers { overlap: 2.5, radius: 0.5 }
    }

    fn deepest(&self, radius: f64, energy: f64) -> f64 {
        (energy * 15.0 / (8.0 * self.modulus * radius.sqrt())).powf(0.4)
    }

    fn rebound(&self) -> f64 {
        2.943_275_184_3
    }

    fn modulus(&self) -> Option<f64> {
        Some(self.modulus)
    }

    fn describe(&self) -> String {
        format!("Hertz contact, E* = {:.4e} Pa", self.modulus)
    }
}
