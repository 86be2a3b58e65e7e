//! A ring of a ring net over its points of contact: one element, by the law of its mechanisms ([`mechanisms`], `ring` in a scene) or
//! by that of its wire ([`wire`], `wire_ring`).
//!
//! - [`formula`]: what a law answers, for one ring and for several at a time
//! - [`tightening`]: the force in a strand of wire, and the share of its strength that bends at contacts leave

pub mod formula;
pub mod mechanisms;
#[cfg(test)]
mod tests;
pub mod tightening;
pub mod wire;

use self::formula::{Extensions, Formula, RingPull, Vector};
use self::mechanisms::Mechanisms;
use self::wire::Wire;
use super::part::{PartCell, Surroundings};
use super::{Answer, AnyElement, Constants, Element, Energy, Pace};
use interface_defs::diagnostic::{Diagnostic, code};
use std::array::from_fn;

/// A ring.
#[derive(Debug, Clone)]
pub struct Ring {
    /// Its 2 to 4 nodes, around.
    pub nodes: Vec<usize>,
    /// Its law, with its sides.
    pub law: RingLaw,
    /// Section of a strand [m2]; 0 where its law knows none.
    pub section: f64,
    /// Mass [kg].
    pub mass: f64,
    /// Radius of its bundle that a contact sees [m].
    pub radius: f64,
}

/// The law of a ring, by its number of nodes.
#[derive(Debug, Clone, Copy, PartialEq)]
#[allow(missing_docs)] // Each is what its own doc comment says.
pub enum RingLaw {
    Three(Mechanisms<3, 3>),
    Four(Mechanisms<4, 2>),
    WireTwo(Wire<2>),
    WireThree(Wire<3>),
    WireFour(Wire<4>),
}

/// Numbers of its history: broken (0 or 1), energy lost at rupture [J], largest extension of its perimeter and of each width [m].
pub const BROKEN: usize = 0;
/// See [`BROKEN`].
pub const LOST: usize = 1;
/// See [`BROKEN`].
pub const PERIMETER: usize = 2;
/// See [`BROKEN`].
pub const WIDTHS: usize = 3;

/// As modelled: no displacements, and nothing was ever drawn out.
const STILL: [f64; 12] = [0.0; 12];

/// Does the same with a law over any number of nodes.
macro_rules! with_law {
    ($ring:expr, |$law:ident| $what:expr) => {
        with_law!($ring, |$law| $what; Three, Four, WireTwo, WireThree, WireFour)
    };
    ($ring:expr, |$law:ident| $what:expr; $($kind:ident),*) => {
        match &$ring.law {
            $(RingLaw::$kind($law) => $what,)*
        }
    };
}

/// A vector of each of `N` nodes out of the local `u`.
fn places<const N: usize>(u: &[f64]) -> [Vector; N] {
    from_fn(|a| [u[3 * a], u[3 * a + 1], u[3 * a + 2]])
}

/// Largest extensions of the perimeter and of each width.
fn most<const W: usize>(history: &[f64]) -> Extensions<W> {
    (history[PERIMETER], from_fn(|j| history[WIDTHS + j]))
}

/// The sides of a ring as modelled [m].
fn sides<const N: usize>(cell: &PartCell) -> [Vector; N] {
    let at = |i: usize| cell.positions[cell.nodes[i % N]];
    from_fn(|i| (at(i + 1) - at(i)).into())
}

impl Ring {
    /// Whether it goes slack gradually.
    pub fn is_eased(&self) -> bool {
        match &self.law {
            RingLaw::Three(law) => law.ease > 0.0,
            RingLaw::Four(law) => law.ease > 0.0,
            _ => false,
        }
    }

    /// Length of its perimeter, counted from where its law says [m].
    fn length(&self, u: &[f64]) -> f64 {
        with_law!(self, |law| law.length(&places(u)))
    }

    fn tension(&self, u: &[f64], history: &[f64]) -> f64 {
        with_law!(self, |law| law.tension(law.length(&places(u)), history[PERIMETER]))
    }

    /// Energies at `u` from `history`, as long as it is not broken.
    fn energies(&self, u: &[f64], history: &[f64]) -> (f64, f64) {
        with_law!(self, |law| law.energy(&places(u), &most(history)))
    }

    /// Force of its perimeter that it bears at `u` [N].
    fn bears(&self, u: &[f64]) -> f64 {
        with_law!(self, |law| law.bears(&places(u)))
    }
}

impl Element for Ring {
    fn regularised(&self, range: f64) -> Option<AnyElement> {
        let law = match self.law {
            RingLaw::Three(law) => RingLaw::Three(Mechanisms { ease: range, ..law }),
            RingLaw::Four(law) => RingLaw::Four(Mechanisms { ease: range, ..law }),
            _ => return None,
        };
        Some(Self { law, ..self.clone() }.into())
    }

    fn nodes(&self) -> &[usize] {
        &self.nodes
    }

    fn constants(&self) -> Constants {
        let (can_break, broken) = (with_law!(self, |law| law.strength()) < f64::INFINITY, Some(BROKEN));
        // Both strands between two contacts lie on one line.
        let lines = if self.nodes.len() == 2 { 1 } else { self.nodes.len() };
        let (radius, section) = (self.radius, self.section);
        Constants { can_break, broken, lines, forces: 1, radius, section, ..Constants::default() }
    }

    fn start_history(&self) -> Vec<f64> {
        fn of<const N: usize, const W: usize>(law: &impl Formula<N, W>) -> Vec<f64> {
            [&[0.0, 0.0, law.drawn()][..], &[0.0; W]].concat()
        }
        with_law!(self, |law| of(law))
    }

    fn add_to(&self, _pace: Pace, u: &[f64], history: &[f64], answer: &mut Answer) {
        if history[BROKEN] > 0.0 {
            return;
        }
        with_law!(self, |law| {
            let (u, most) = (places(u), most(history));
            let RingPull { force, tension, most: (stretched, bent) } = law.pull_alone(&u, &most);
            answer.force.copy_from_slice(force.as_flattened());
            answer.tension = tension;
            answer.history[PERIMETER] = stretched;
            answer.history[WIDTHS..].copy_from_slice(&bent);
            if let Some(k) = &mut answer.tangent {
                law.add_tangent(&u, &most, answer.slack, k);
            }
        });
    }

    fn energy(&self, u: &[f64], history: &[f64]) -> Energy {
        let start = with_law!(self, |law| law.modelled());
        let lost = history[LOST] - start.1;
        if history[BROKEN] > 0.0 {
            let (_, dissipated) = self.energies(&STILL, history);
            return Energy { stored: -start.0, dissipated: lost + dissipated };
        }
        let (stored, dissipated) = self.energies(u, history);
        Energy { stored: stored - start.0, dissipated: lost + dissipated }
    }

    fn utilisation_bound(&self, u: &[f64], history: &[f64]) -> f64 {
        with_law!(self, |law| law.share(&places(u), self.tension(u, history)))
    }

    fn breaks(&self, u: &[f64], history: &mut [f64]) -> bool {
        if history[BROKEN] > 0.0 || self.tension(u, history) <= self.bears(u) {
            return false;
        }
        let (stored, dissipated) = self.energies(u, history);
        // What the history alone says it dissipated is told of it afterwards, too.
        history[LOST] += stored + dissipated - self.energies(&STILL, history).1;
        history[BROKEN] = 1.0;
        true
    }

    fn lump(&self, mass: &mut [f64], _inertia: &mut [f64]) {
        let share = self.mass / self.nodes.len() as f64;
        mass.iter_mut().for_each(|m| *m += share);
    }

    fn force_utilisation(&self, u: &[f64], force: f64) -> f64 {
        force / self.bears(u)
    }

    fn line_forces(&self, u: &[f64], history: &[f64], forces: &mut [f64]) {
        forces.fill(if history[BROKEN] > 0.0 { f64::NAN } else { self.tension(u, history) });
    }

    fn coarseness(&self) -> f64 {
        with_law!(self, |law| law.coarseness())
    }

    fn elongation(&self, u: &[f64]) -> f64 {
        self.length(u) - self.length(&STILL)
    }
}

/// Refuse a `diameter` [m] far beyond where the contacts of its ring lie; a warning where it is unusual.
pub(super) fn judge_diameter(diameter: f64, at: &Surroundings) -> Result<Vec<Diagnostic>, Diagnostic> {
    let size = at.size;
    if size > 0.0 && diameter > 20.0 * size {
        return Err(at.too_long("diameter", diameter, "its nodes lie within", size));
    }
    if size > 0.0 && !(0.5..=2.0).contains(&(diameter / size)) {
        let what = format!("{diameter} m, and its nodes lie {size:.4} m apart");
        return Ok(vec![Diagnostic::warning(code::UNUSUAL_VALUE, what).about(at.key.at("diameter"))]);
    }
    Ok(Vec::new())
}
