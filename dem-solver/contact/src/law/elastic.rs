//! Two elastic sides as one: `E*` and `G*`.
//!
//! `1/E* = (1 - nu^2) / E + (1 - nu'^2) / E'`, `1/G* = (2 - nu) / G + (2 - nu') / G'` with
//! `G = E / (2 (1 + nu))`; a rigid side has no term. The tangential stiffness is `4 G* / E*` times the
//! normal one: for a rigid mesh and for two equal sides `2 (1 - nu) / (2 - nu)`.
//!
//! Source: Johnson (1985), Contact Mechanics, 4.2 (E*), 7.2 (G*, after Mindlin).

/// Young's modulus [Pa] and Poisson's ratio.
pub type Side = (f64, f64);

/// The two sides of a contact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Elastic {
    /// The first.
    pub own: Side,
    /// The other; `None`: rigid.
    pub other: Option<Side>,
}

impl Elastic {
    /// `E*` [Pa].
    pub fn modulus(&self) -> f64 {
        let plane = |(young, poisson): Side| young / (1.0 - poisson * poisson);
        match self.other {
            None => plane(self.own),
            Some(other) if other == self.own => 0.5 * plane(self.own),
            Some(other) => 1.0 / (1.0 / plane(self.own) + 1.0 / plane(other)),
        }
    }

    /// Tangential over normal stiffness.
    pub fn stiffness_ratio(&self) -> f64 {
        match self.other.filter(|other| *other != self.own) {
            None => stiffness_ratio(self.own.1),
            Some(other) => {
                let shear = |(young, poisson): Side| 0.5 * young / ((1.0 + poisson) * (2.0 - poisson));
                let both = 1.0 / (1.0 / shear(self.own) + 1.0 / shear(other));
                4.0 * both / self.modulus()
            }
        }
    }
}

/// Tangential over normal stiffness with Poisson's ratio `poisson` of both sides, or of one and a rigid
/// other.
pub fn stiffness_ratio(poisson: f64) -> f64 {
    2.0 * (1.0 - poisson) / (2.0 - poisson)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_far_stiffer_side_is_a_rigid_one_and_equal_sides_halve_the_modulus() {
        let rigid = Elastic { own: (2e9, 0.3), other: None };
        let stiff = Elastic { own: (2e9, 0.3), other: Some((2e21, 0.1)) };
        // The other side has 1e-12 of the compliance.
        assert!((stiff.modulus() / rigid.modulus() - 1.0).abs() < 2e-12);
        assert!((stiff.stiffness_ratio() / rigid.stiffness_ratio() - 1.0).abs() < 4e-12);
        let equal = Elastic { own: (2e9, 0.3), other: Some((2e9, 0.3)) };
        assert!((2.0 * equal.modulus() / rigid.modulus() - 1.0).abs() < 1e-15);
        assert_eq!(equal.stiffness_ratio(), rigid.stiffness_ratio());
        let nearly = Elastic { own: (2e9, 0.3), other: Some((2e9 * (1.0 + 1e-12), 0.3)) };
        assert!((nearly.stiffness_ratio() / rigid.stiffness_ratio() - 1.0).abs() < 1e-11);
    }
}
