//! Hertz: `k = 2 E* sqrt(R* d)`, `F = 2/3 k d`, energy `2/5 F d`, with
//! `1/E* = (1 - nu^2) / E + (1 - nu'^2) / E'`; the second term is that of the other side, 0 where it is rigid.
//!
//! Source: handbook 1.2, 1.5.

use super::{Load, NoKeys, NormalLaw, Powers};
use crate::law::elastic::Elastic;
use interface_defs::diagnostic::Diagnostic;

/// Force ~ overlap^1.5.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hertz {
    /// `E*` [Pa].
    pub modulus: f64,
}

impl NormalLaw for Hertz {
    type Keys = NoKeys;

    fn new(_: NoKeys, sides: Option<&Elastic>) -> Result<Self, Diagnostic> {
        let sides = sides.ok_or_else(|| Diagnostic::new("it needs `young` [Pa]").about("young"))?;
        Ok(Self { modulus: sides.modulus() })
    }

    #[inline(always)]
    fn load(&self, radius: f64, overlap: f64) -> Load {
        Load::hertz(self.modulus, radius, overlap)
    }

    fn powers(&self) -> Powers {
        Powers::HERTZ
    }

    fn deepest(&self, radius: f64, mass: f64, speed: f64) -> f64 {
        (0.5 * mass * speed * speed * 15.0 / (8.0 * self.modulus * radius.sqrt())).powf(0.4)
    }

    fn modulus(&self) -> Option<f64> {
        Some(self.modulus)
    }

    fn describe(&self) -> String {
        format!("Hertz contact, E* = {:.4e} Pa", self.modulus)
    }
}
