//! Hertz: `k = 2 E* sqrt(R* d)`, `F = 2/3 k d`, energy `2/5 F d`, with
//! `1/E* = (1 - nu^2) / E + (1 - nu'^2) / E'`; the second term is that of the other side, 0 where it is rigid.
//!
//! Source: Johnson (1985), Contact Mechanics, 4.2, eqs. 4.22 to 4.24.

use super::{LawKind, Load, NoKeys, NormalLaw, Powers};
use crate::law::elastic::Elastic;
use interface_defs::diagnostic::Diagnostic;

/// Force ~ overlap^1.5, of the rock as a whole or of each of its spheres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hertz<const WHOLE: bool> {
    /// `E*` [Pa].
    pub modulus: f64,
}

/// `hertz_mindlin`: each sphere by its own radius.
pub type HertzMindlin = Hertz<false>;

/// `hertz_rock`: the rock by its own radius, whatever spheres cover it.
pub type HertzRock = Hertz<true>;

impl<const WHOLE: bool> NormalLaw for Hertz<WHOLE> {
    type Keys = NoKeys;

    fn kind() -> LawKind {
        LawKind { whole: WHOLE, as_whole: Some("hertz_rock") }
    }

    fn new(_: NoKeys, sides: Option<&Elastic>) -> Result<Self, Diagnostic> {
        let sides = sides.ok_or_else(|| Diagnostic::new("Hertz's law needs `young` [Pa]").about("young"))?;
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
