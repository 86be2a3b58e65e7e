//! The dashpot of a contact: `c = 2 g sqrt(m* k)`.
//!
//! Local mass: `1/m* = N_c / M + sum N_a^2 / m_a`, the rock's share among its N_c contacts and the
//! inertia that the mesh shows at the contact point. On a wire that is the wire's, on a rigid fixed surface
//! M / N_c, which keeps the damping ratio of the whole rock. With the rock's whole mass N contacts
//! damp sqrt(N) times as much, and a light wire gets c dt / m_node >> 1.
//!
//! Source: Tsuji, Tanaka and Ishida (1992), Powder Technology 71, 239, for the dashpot; the local mass is derived from the inertia
//! that each side shows at the contact.

use crate::settings::EffectiveMass;

/// Dashpot of a contact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Damping {
    /// Damping ratio g.
    pub ratio: f64,
    /// Which mass m* is.
    pub mass: EffectiveMass,
}

impl Damping {
    /// `2 g sqrt(m*)` [kg^(1/2)]; times `sqrt(k)` it is the dashpot's coefficient. `partner` is
    /// the inverse mass that the partner shows at the point, of a mesh `sum N_a^2 / m_a` [1/kg].
    #[inline]
    pub fn coefficient(&self, rock_mass: f64, contacts: usize, partner: f64) -> f64 {
        let inverse = match self.mass {
            EffectiveMass::Local => contacts as f64 / rock_mass + partner,
            EffectiveMass::Rock => 1.0 / rock_mass,
        };
        2.0 * self.ratio / inverse.sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_local_mass_is_the_wires_on_a_wire_and_the_rocks_share_on_a_fixed_wall() {
        let local = Damping { ratio: 0.5, mass: EffectiveMass::Local };
        let rock = Damping { ratio: 0.5, mass: EffectiveMass::Rock };
        assert!((local.coefficient(180.0, 4, 0.0) - 45.0_f64.sqrt()).abs() < 1e-14);
        assert!((local.coefficient(1e12, 1, 1.0 / 0.03) - 0.03_f64.sqrt()).abs() < 1e-10);
        assert!((rock.coefficient(180.0, 4, 1.0 / 0.03) - 180.0_f64.sqrt()).abs() < 1e-14);
    }
}
