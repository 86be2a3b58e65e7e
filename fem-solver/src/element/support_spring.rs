//! A support that gives way: a node held by a spring to where it stands as modelled, the same in all directions, until it tears.
//!
//! `f = k u` in the directions that are supported, up to its strength `|f|`; behind that nothing.

use super::material::Rupture;
use super::segment::vector;
use super::{Answer, Constants, Element, Energy, Pace};
use nalgebra::Vector3;

/// The spring of one node.
#[derive(Debug, Clone)]
pub struct SupportSpring {
    /// The node.
    pub node: [usize; 1],
    /// 1 in each direction that is supported, else 0.
    pub directions: Vector3<f64>,
    /// Stiffness [N/m].
    pub stiffness: f64,
    /// When it tears.
    pub rupture: Rupture,
}

/// Its history: 1 once it is torn, and the energy lost then [J].
const BROKEN: usize = 0;
const LOST: usize = 1;
/// Numbers of its history.
const HISTORY: usize = 2;

impl SupportSpring {
    /// Force that stretches it where its node is displaced by `u` [m], from `history` [N].
    pub fn pull(&self, u: &Vector3<f64>, history: &[f64]) -> Vector3<f64> {
        if history[BROKEN] > 0.0 {
            return Vector3::zeros();
        }
        self.stiffness * self.directions.component_mul(u)
    }

    /// The same while it holds.
    fn trial(&self, u: &[f64]) -> Vector3<f64> {
        self.pull(&vector(u, 0), &[0.0; HISTORY])
    }
}

impl Element for SupportSpring {
    fn nodes(&self) -> &[usize] {
        &self.node
    }

    fn constants(&self) -> Constants {
        let can_break = self.rupture != Rupture::NEVER;
        Constants { can_break, broken: Some(BROKEN), ..Constants::default() }
    }

    fn start_history(&self) -> Vec<f64> {
        vec![0.0; HISTORY]
    }

    fn add_to(&self, _pace: Pace, u: &[f64], history: &[f64], answer: &mut Answer) {
        let pull = self.pull(&vector(u, 0), history);
        answer.force.copy_from_slice(pull.as_slice());
        answer.tension = pull.norm();
        let Some(k) = &mut answer.tangent else { return };
        if history[BROKEN] == 0.0 {
            (0..3).for_each(|c| k[4 * c] = self.stiffness * self.directions[c]);
        }
    }

    fn energy(&self, u: &[f64], history: &[f64]) -> Energy {
        let stored = 0.5 * self.pull(&vector(u, 0), history).dot(&vector(u, 0));
        Energy { stored, dissipated: history[LOST] }
    }

    fn utilisation_bound(&self, u: &[f64], _history: &[f64]) -> f64 {
        self.force_utilisation(u, self.trial(u).norm())
    }

    fn breaks(&self, u: &[f64], history: &mut [f64]) -> bool {
        let breaks = history[BROKEN] == 0.0 && self.rupture.at(self.trial(u).norm(), 0.0);
        if breaks {
            history[LOST] = self.energy(u, history).stored;
            history[BROKEN] = 1.0;
        }
        breaks
    }

    fn lump(&self, _mass: &mut [f64], _inertia: &mut [f64]) {}

    fn force_utilisation(&self, _u: &[f64], force: f64) -> f64 {
        self.rupture.share(force, 0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::element::tests::checks::Case;

    #[test]
    fn it_is_a_spring_in_its_directions_until_its_strength() {
        let rupture = Rupture { force: 5e3, ..Rupture::NEVER };
        let spring =
            SupportSpring { node: [0], directions: Vector3::new(1.0, 1.0, 0.0), stiffness: 1e6, rupture };
        let places = [Vector3::zeros()];
        Case::new(&spring, &places, &[2e-3, -1e-3, 4e-3]).derivatives();
        let mut history = spring.start_history();
        assert!(!spring.breaks(&[3e-3, 3.99e-3, 1.0], &mut history));
        assert_eq!(spring.utilisation_bound(&[3e-3, 4e-3, 1.0], &history), 1.0);
        let u = [6e-3, 8e-3, 1.0];
        assert!(spring.breaks(&u, &mut history) && !spring.breaks(&u, &mut history));
        let after = spring.energy(&u, &history);
        assert_eq!(after, Energy { stored: 0.0, dissipated: 0.5 * 1e6 * 1e-2_f64.powi(2) });
        assert_eq!(spring.pull(&Vector3::from(u), &history), Vector3::zeros());
    }
}
