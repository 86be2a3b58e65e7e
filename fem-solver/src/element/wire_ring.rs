//! A ring of a ring net from what its catalogue states: so many turns of a wire, held at 2, 3 or 4 contacts.
//!
//! ```text
//! strand   e = sum |x_(i+1) - x_i| - l_0      N(e), the same in all sides: [`law`]
//! oval     o^2 = o_1^2 + o_2^2                W = (Q^2 / K) (sqrt(1 + (K o / Q)^2) - 1)
//! ```
//!
//! A strand runs freely through its contacts, so a slack ring would be a mechanism: any polygon of the same perimeter. What
//! holds its shape is bending. A round ring becomes an oval `r = R + a cos 2 (p - p_0)`; its parts along two axes, together `o = 2 a`,
//! follow from squares of distances of contacts: of four, those of the diagonals and of opposite sides; of three, those of the
//! sides. Squares, since free contacts at the flanks of a ring that is pulled flat must not hold it open. An oval is resisted elastically,
//! with the first stiffness `K` of a ring pulled at two points, up to the force `Q = 4 M_p / R` at which such a ring becomes plastic.
//! The plastic part of it is not followed: what it holds is stored and comes back. In a ring drawn evenly at its contacts it is 0.
//! Two contacts need no such thing.

pub mod formula;
pub mod law;
#[cfg(test)]
mod tests;

use self::formula::{Chord, Oval, WireConstants, chords};
use self::law::{Bundle, Strength, Tightening};
use super::part::{NewElements, PartCell, PartSettings, Surroundings, part};
use super::ring::formula::Formula;
use super::ring::places;
use super::segment::{Segment, add_pair, add_vector};
use super::{Answer, Constants, Element, Energy, Slack};
use crate::element::ring;
use interface_defs::diagnostic::Diagnostic;
use nalgebra::{Matrix3, Vector3};
use std::f64::consts::PI;

/// Numbers of its history: broken (0 or 1), energy lost at rupture [J], largest extension [m].
pub const BROKEN: usize = 0;
/// See [`BROKEN`].
pub const LOST: usize = 1;
/// See [`BROKEN`].
pub const MOST: usize = 2;

/// A ring.
#[derive(Debug, Clone)]
pub struct WireRing {
    /// Its 2 to 4 nodes, around.
    pub nodes: Vec<usize>,
    /// From each node to the next as modelled [m].
    pub spans: Vec<Vector3<f64>>,
    /// Strand tension by extension.
    pub law: Tightening,
    /// Stiffness [N/m] and largest force [N] against an oval.
    pub oval: (f64, f64),
    /// Section of a strand [m2].
    pub section: f64,
    /// Diameter of the ring [m].
    pub diameter: f64,
    /// Diameter of its bundle [m].
    pub thickness: f64,
    /// Mass [kg].
    pub mass: f64,
    /// Radius of its bundle that a contact sees [m].
    pub radius: f64,
    /// Strand force at which it breaks.
    pub strength: Strength,
}

/// Does the same with the formulas of a ring over 2, 3 or 4 nodes.
macro_rules! formulas {
    ($ring:expr, |$formulas:ident| $what:expr) => {
        match $ring.nodes.len() {
            2 => {
                let $formulas = $ring.constants::<2>();
                $what
            }
            3 => {
                let $formulas = $ring.constants::<3>();
                $what
            }
            _ => {
                let $formulas = $ring.constants::<4>();
                $what
            }
        }
    };
}

impl WireRing {
    /// What its formulas need, over its `N` nodes.
    pub fn constants<const N: usize>(&self) -> WireConstants<N> {
        let Self { law, oval, diameter, thickness, strength, .. } = *self;
        let spans = std::array::from_fn(|i| self.spans[i].into());
        WireConstants { spans, law, oval, diameter, thickness, strength }
    }

    /// How much longer its polygon is than that of the round ring [m].
    fn extension(&self, u: &[f64]) -> f64 {
        formulas!(self, |ring| ring.extension(&places(u)))
    }

    fn tension(&self, u: &[f64], history: &[f64]) -> f64 {
        formulas!(self, |ring| ring.tension(&places(u), 0.0, history[MOST]))
    }

    /// Energies at `u` from `history`, as long as it is not broken; 0 in the round ring.
    fn energies(&self, u: &[f64], history: &[f64]) -> (f64, f64) {
        formulas!(self, |ring| ring.energy(&places(u), &(history[MOST], [])))
    }

    /// Add the tangent of an unbroken ring to `k`.
    fn add_tangent<const N: usize>(&self, u: &[f64], history: &[f64], slack: Slack, k: &mut [f64]) {
        let (ring, n) = (self.constants::<N>(), 3 * N);
        let sides = ring.sides(&places(u));
        let pull = self.law.pull(sides.perimeter - self.law.round, history[MOST]);
        let mut gradient = [0.0; 12];
        for (i, span) in self.spans.iter().enumerate() {
            let next = (i + 1) % N;
            let side = Segment::new(span, u, i, next).blunted(self.thickness);
            let t = side.direction();
            add_vector(&mut gradient, 3 * i, &-t);
            add_vector(&mut gradient, 3 * next, &t);
            add_pair(k, n, 3 * i, 3 * next, &side.tangent(0.0, pull.force));
        }
        let slope = match slack {
            Slack::Taut => self.law.stiffest(),
            Slack::Regularised(part) if pull.slope == 0.0 => part * self.law.stiffest(),
            _ => pull.slope,
        };
        add_square(k, n, slope, &gradient, &gradient);
        let (Oval { chords: spans, parts, root }, mut gradients) = (ring.oval(&sides), [[0.0; 12]; 2]);
        let (stiffness, most) = self.oval;
        let first = stiffness / root;
        for (Chord { ends: [a, b], shares }, span) in chords::<N>().iter().zip(spans) {
            let across = 2.0 / self.diameter;
            for (gradient, share) in gradients.iter_mut().zip(shares) {
                let along = across * share * Vector3::from(span);
                add_vector(gradient, 3 * a, &-along);
                add_vector(gradient, 3 * b, &along);
            }
            let share = parts[0] * shares[0] + parts[1] * shares[1];
            add_pair(k, n, 3 * a, 3 * b, &Matrix3::from_diagonal_element(first * across * share));
        }
        for (i, a) in gradients.iter().enumerate() {
            for (j, b) in gradients.iter().enumerate() {
                let own = if i == j { 1.0 } else { 0.0 };
                let softer = (stiffness / most / root).powi(2) * parts[i] * parts[j];
                add_square(k, n, first * (own - softer), a, b);
            }
        }
    }
}

/// Add `factor a b^T` of the first `n` numbers of each to the square matrix `k` of order `n`, by rows.
fn add_square(k: &mut [f64], n: usize, factor: f64, a: &[f64; 12], b: &[f64; 12]) {
    for (row, x) in k.chunks_exact_mut(n).zip(a) {
        row.iter_mut().zip(b).for_each(|(k, y)| *k += factor * x * y);
    }
}

impl Element for WireRing {
    fn nodes(&self) -> &[usize] {
        &self.nodes
    }

    fn constants(&self) -> Constants {
        let (can_break, broken) = (self.strength.straight < f64::INFINITY, Some(BROKEN));
        // Both strands between two contacts lie on one line.
        let lines = if self.nodes.len() == 2 { 1 } else { self.nodes.len() };
        let (radius, section) = (self.radius, self.section);
        Constants { can_break, broken, lines, forces: 1, radius, section, ..Constants::default() }
    }

    fn start_history(&self) -> Vec<f64> {
        vec![0.0, 0.0, formulas!(self, |ring| ring.drawn())]
    }

    fn add_to(&self, u: &[f64], history: &[f64], answer: &mut Answer) {
        if history[BROKEN] > 0.0 {
            return;
        }
        let slack = answer.slack;
        formulas!(self, |ring| {
            let pull = ring.pull(&places(u), &(history[MOST], []));
            answer.force.copy_from_slice(pull.force.as_flattened());
            (answer.tension, answer.history[MOST]) = (pull.tension, pull.most.0);
        });
        if let Some(k) = &mut answer.tangent {
            match self.nodes.len() {
                2 => self.add_tangent::<2>(u, history, slack, k),
                3 => self.add_tangent::<3>(u, history, slack, k),
                _ => self.add_tangent::<4>(u, history, slack, k),
            }
        }
    }

    fn energy(&self, u: &[f64], history: &[f64]) -> Energy {
        let start = formulas!(self, |ring| ring.modelled());
        let lost = history[LOST] - start.1;
        if history[BROKEN] > 0.0 {
            let dissipated = lost + self.law.energy(0.0, history[MOST]).1;
            return Energy { stored: -start.0, dissipated };
        }
        let (stored, dissipated) = self.energies(u, history);
        Energy { stored: stored - start.0, dissipated: lost + dissipated }
    }

    fn utilisation_bound(&self, u: &[f64], history: &[f64]) -> f64 {
        formulas!(self, |ring| ring.share(&places(u), ring.tension(&places(u), 0.0, history[MOST])))
    }

    fn breaks(&self, u: &[f64], history: &mut [f64]) -> bool {
        let bears = || formulas!(self, |ring| ring.bears(&places(u)));
        if history[BROKEN] > 0.0 || self.tension(u, history) <= bears() {
            return false;
        }
        let (stored, dissipated) = self.energies(u, history);
        // What the history alone says it dissipated is told of it afterwards, too.
        history[LOST] += stored + dissipated - self.law.energy(0.0, history[MOST]).1;
        history[BROKEN] = 1.0;
        true
    }

    fn lump(&self, mass: &mut [f64], _inertia: &mut [f64]) {
        let share = self.mass / self.nodes.len() as f64;
        mass.iter_mut().for_each(|m| *m += share);
    }

    fn utilisation(&self, u: &[f64], force: f64) -> f64 {
        force / formulas!(self, |ring| ring.bears(&places(u)))
    }

    fn line_forces(&self, u: &[f64], history: &[f64], forces: &mut [f64]) {
        forces.fill(if history[BROKEN] > 0.0 { f64::NAN } else { self.tension(u, history) });
    }

    /// Its lengths are roots.
    fn coarseness(&self) -> f64 {
        self.law.round * self.law.stiffest()
    }

    fn elongation(&self, u: &[f64]) -> f64 {
        self.extension(u) - self.extension(&[0.0; 12])
    }
}

part! {
    /// Rings of a ring net by what their catalogue states, and by their 2 to 4 points of contact, around.
    WireRingPart: "rings", (2, 4) nodes, Line2 | Tri3 | Quad4 {
        /// Turns of the wire: so many lie side by side in the bundle.
        turns: u32,
        /// Diameter of the wire [m].
        wire_diameter: f64,
        /// Diameter of the ring within its bundle [m]. With its contacts on that circle it is round and without force.
        diameter: f64,
        /// Tensile strength of the wire [Pa]. With it a ring breaks where a contact turns its strand most. Not together with
        /// `rupture_force`, which is that of a strand however it is turned. Default: never.
        strength: Option<f64>,
        /// Shares of the strength that contacts leave which turn the strand by 90 and by 180 degrees. Default `0.55`, of rings with
        /// four neighbours, and `0.45 (1 - 1.35 / turns)`, fitted to chains of three rings of 3 to 19 turns.
        contact_strength: Option<[f64; 2]>,
        /// Stress at which the wire bends plastically [Pa]: that at 0.5 % of plastic strain. Default 0.96 of its strength, or 1.7e9:
        /// wire of 1 770 MPa.
        yield_stress: Option<f64>,
        /// Young's modulus of the wire [Pa]. Default 1.5e11.
        #[serde(default = "young")]
        young: f64,
        /// Density of the wire [kg/m3]. Default 7850.
        #[serde(default = "density")]
        density: f64,
        /// Plastic moment of the bundle over that of its wires one by one: 1, wires that slide, to 2.6, with friction and clips.
        /// Default 1.
        #[serde(default = "one")]
        bundle_factor: f64,
    }
}

/// Stress at 0.5 % of plastic strain, over the strength of a wire of 1 770 MPa, which is elastic up to 1 445 MPa and hardens to 1 880 at 5 %
/// (Guo, Net_panel_analysis, Zenodo 6482654).
const YIELDS: f64 = 0.96;
/// That stress [Pa].
const YIELD_STRESS: f64 = 1.7e9;
/// Share of the strength where a contact turns a strand by 90 degrees: five rings, 5, 7 and 9 turns (same source).
const AT_90: f64 = 0.55;

fn young() -> f64 {
    1.5e11
}

fn density() -> f64 {
    7850.0
}

fn one() -> f64 {
    1.0
}

impl WireRingPart {
    /// The strand force that it bears.
    fn strength(&self, cell: &PartCell, area: f64) -> Result<Strength, Diagnostic> {
        let key = cell.key;
        let force = key.rupture(self.rupture_force, None)?.force;
        let Some(strength) = self.strength else {
            if self.contact_strength.is_some() {
                let what = "shares of a strength, and there is no strength";
                return key.refuse("contact_strength", what, "write strength too, in pascals");
            }
            return Ok(Strength::even(force));
        };
        if self.rupture_force.is_some() {
            let what = "a ring breaks by the strength of its wire or by the force of its strand, not by both";
            return key.refuse("rupture_force", what, "leave out either strength or rupture_force");
        }
        if !(1e8..=1e10).contains(&strength) {
            let what = format!("the strength of the wire is {strength} Pa");
            return key.refuse("strength", what, "pascals: 1 770 MPa is 1.77e9");
        }
        let shares =
            self.contact_strength.unwrap_or_else(|| [AT_90, Strength::share_at_180(f64::from(self.turns))]);
        if !(0.0 < shares[1] && shares[1] <= shares[0] && shares[0] < 1.0) {
            let what = format!("{shares:?} must fall from 90 to 180 degrees, and lie between 0 and 1");
            return Err(key.invalid("contact_strength", what));
        }
        Ok(Strength::new(area * strength, shares))
    }

    /// The bundle, checked.
    fn bundle(&self, cell: &PartCell) -> Result<Bundle, Diagnostic> {
        let key = cell.key;
        let yields = self.yield_stress.or(self.strength.map(|s| YIELDS * s)).unwrap_or(YIELD_STRESS);
        key.positive(&[("turns", f64::from(self.turns), ""), ("wire_diameter", self.wire_diameter, "m")])?;
        key.positive(&[("diameter", self.diameter, "m"), ("yield_stress", yields, "Pa")])?;
        key.positive(&[("young", self.young, "Pa"), ("density", self.density, "kg/m3")])?;
        key.not_negative(&[("radius", self.radius.unwrap_or(0.0), "m")])?;
        if self.strength.is_some_and(|strength| yields > strength) {
            return Err(
                key.invalid("yield_stress", format!("a wire yields at {yields} Pa, above its strength"))
            );
        }
        if !(1.0..=2.6).contains(&self.bundle_factor) {
            let what = format!("it is {}, and must lie between 1 and 2.6", self.bundle_factor);
            return Err(key.invalid("bundle_factor", what));
        }
        let bundle = Bundle {
            turns: f64::from(self.turns),
            wire: self.wire_diameter,
            diameter: self.diameter,
            young: self.young,
            yields: self.bundle_factor * yields,
        };
        if bundle.thickness() > 0.25 * self.diameter {
            let what = format!("{} turns make a bundle {:.4} m thick", self.turns, bundle.thickness());
            let hint = format!("metres: 3 mm is 0.003; the ring is {} m wide", self.diameter);
            return key.refuse("wire_diameter", what, hint);
        }
        Ok(bundle)
    }
}

impl PartSettings for WireRingPart {
    fn build(&self, cell: &PartCell, made: &mut NewElements) -> Result<(), Diagnostic> {
        let (key, nodes) = (cell.key, cell.nodes);
        let bundle = self.bundle(cell)?;
        let side = |i: usize| cell.positions[nodes[(i + 1) % nodes.len()]] - cell.positions[nodes[i]];
        let spans: Vec<_> = (0..nodes.len()).map(side).collect();
        let polygon: f64 = spans.iter().map(Vector3::norm).sum();
        let (area, thickness, around) = (bundle.area(), bundle.thickness(), PI * self.diameter);
        let law = Tightening::new(&bundle, nodes.len());
        if polygon > around {
            let what = format!(
                "the wire of a ring is {around:.4} m long, and the perimeter of its contacts {polygon:.4} m"
            );
            let n = nodes.len() as f64;
            let narrower = n * (PI / n).sin() * self.diameter / polygon;
            let hint = format!(
                "a round ring needs cells {narrower:.2} times as wide: of its diameter, in diagonal rows of 0.71 of it"
            );
            return key.refuse("diameter", what, hint);
        }
        let ring = WireRing {
            nodes: nodes.to_vec(),
            spans,
            law,
            oval: (bundle.first_stiffness(), 8.0 * bundle.plastic_moment() / self.diameter),
            section: area,
            diameter: self.diameter,
            thickness,
            mass: area * around * self.density,
            radius: self.radius.unwrap_or(0.5 * thickness),
            strength: self.strength(cell, area)?,
        };
        made.elements.push(ring.into());
        Ok(())
    }

    fn judge(&self, at: &Surroundings) -> Result<Vec<Diagnostic>, Diagnostic> {
        ring::judge_diameter(self.diameter, at)
    }
}
