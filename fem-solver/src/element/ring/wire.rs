//! A ring of a ring net from what its catalogue states: so many turns of a wire, held at 2, 3 or 4 contacts.
//!
//! ```text
//! strand   e = sum |x_(i+1) - x_i| - l_0      N(e), the same in all sides: [`super::tightening`]
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
//!
//! Plain arrays in [`Formula`], as it says.

#![expect(
    clippy::needless_range_loop,
    reason = "iterators over components keep the compiler from wide registers"
)]

use super::formula::{Extensions, Formula, RingPull, RingSides, Vector, add_perimeter, add_square};
use super::tightening::{Bundle, Strength, Tightening};
use super::{Ring, RingLaw, judge_diameter, sides};
use crate::element::Slack;
use crate::element::part::{NewElements, PartCell, PartSettings, Surroundings, part};
use crate::element::segment::{add_pair, add_vector};
use interface_defs::diagnostic::Diagnostic;
use nalgebra::{Matrix3, Vector3};
use std::f64::consts::PI;

/// The law of a ring over `N` nodes by its wire and its bundle, with its sides.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wire<const N: usize> {
    /// From each node to the next as modelled [m].
    pub spans: [Vector; N],
    /// Strand tension by extension.
    pub law: Tightening,
    /// Stiffness [N/m] and largest force [N] against an oval.
    pub oval: (f64, f64),
    /// Diameter of the ring [m].
    pub diameter: f64,
    /// Diameter of its bundle [m], above 0: closer than this the distance of two contacts is blunted.
    pub thickness: f64,
    /// Strand force at which it breaks.
    pub strength: Strength,
}

/// A distance of contacts that says how oval a ring is.
pub struct Chord {
    /// Places of its contacts in the ring: neighbours, or the second is behind the next of the first.
    pub ends: [usize; 2],
    /// Share of its square, over the diameter, in both parts of the oval.
    pub shares: [f64; 2],
}

/// An oval.
pub struct Oval {
    /// Its chords [m]; 0 where there are fewer.
    pub chords: [Vector; MOST_CHORDS],
    /// Its parts [m].
    pub parts: [f64; 2],
    /// `sqrt(1 + (K o / Q)^2)`.
    pub root: f64,
}

/// Chords of four contacts.
const MOST_CHORDS: usize = 6;
/// Root of a third.
const THIRD: f64 = 0.577_350_269_189_625_8;

const fn chord(ends: [usize; 2], shares: [f64; 2]) -> Chord {
    Chord { ends, shares }
}

/// Of four contacts: diagonals, sides.
const OF_FOUR: [Chord; MOST_CHORDS] = [
    chord([0, 2], [0.25, 0.0]),
    chord([1, 3], [-0.25, 0.0]),
    chord([0, 1], [0.0, 0.5]),
    chord([1, 2], [0.0, -0.5]),
    chord([2, 3], [0.0, 0.5]),
    chord([3, 0], [0.0, -0.5]),
];
/// Of three: sides.
const OF_THREE: [Chord; 3] = [
    chord([0, 1], [8.0 / 9.0 * THIRD, 8.0 / 27.0]),
    chord([1, 2], [-8.0 / 9.0 * THIRD, 8.0 / 27.0]),
    chord([2, 0], [0.0, -16.0 / 27.0]),
];

/// Of a ring of `N` contacts; two of them need none.
#[inline(always)]
pub const fn chords<const N: usize>() -> &'static [Chord] {
    match N {
        4 => &OF_FOUR,
        3 => &OF_THREE,
        _ => &[],
    }
}

impl<const N: usize> Wire<N> {
    /// Of a bundle over sides as modelled [m].
    pub fn new(bundle: &Bundle, spans: [Vector; N], strength: Strength) -> Self {
        Self {
            spans,
            law: Tightening::new(bundle, N),
            oval: (bundle.first_stiffness(), 8.0 * bundle.plastic_moment() / bundle.diameter),
            diameter: bundle.diameter,
            thickness: bundle.thickness(),
            strength,
        }
    }

    /// Its sides where its nodes are displaced by `u` [m]: contacts come no closer in the perimeter than the bundle is thick.
    #[inline(always)]
    pub fn sides(&self, u: &[Vector; N]) -> RingSides<N> {
        let mut sides = RingSides::new(&self.spans, u);
        sides.perimeter = 0.0;
        for i in 0..N {
            let d = sides.lengths[i];
            let blunted = d * d * (0.5 / self.thickness) + 0.5 * self.thickness;
            sides.perimeter += if d < self.thickness { blunted } else { d };
        }
        sides
    }

    /// Its oval with these sides.
    #[inline(always)]
    pub fn oval(&self, sides: &RingSides<N>) -> Oval {
        let mut oval = Oval { chords: [[0.0; 3]; MOST_CHORDS], parts: [0.0; 2], root: 1.0 };
        for j in 0..chords::<N>().len() {
            let Chord { ends: [a, b], shares } = chords::<N>()[j];
            let mut square = 0.0;
            for c in 0..3 {
                let next = if (a + 2) % N == b { sides.spans[(a + 1) % N][c] } else { 0.0 };
                oval.chords[j][c] = sides.spans[a][c] + next;
                square += oval.chords[j][c] * oval.chords[j][c];
            }
            let square = square * (1.0 / self.diameter);
            for i in 0..2 {
                oval.parts[i] += shares[i] * square;
            }
        }
        let (stiffness, most) = self.oval;
        let [a, b] = oval.parts;
        oval.root = (1.0 + (stiffness / most) * (stiffness / most) * (a * a + b * b)).sqrt();
        oval
    }
}

impl<const N: usize> Formula<N, 0> for Wire<N> {
    #[inline(always)]
    fn over(self, spans: [Vector; N]) -> Self {
        Self { spans, ..self }
    }

    fn spans(&self) -> [Vector; N] {
        self.spans
    }

    fn drawn(&self) -> f64 {
        self.length(&[[0.0; 3]; N]).max(0.0)
    }

    fn modelled(&self) -> (f64, f64) {
        self.energy(&[[0.0; 3]; N], &(self.drawn(), []))
    }

    /// Elongation of its polygon over that of the round ring.
    #[inline(always)]
    fn length(&self, u: &[Vector; N]) -> f64 {
        self.sides(u).perimeter - self.law.round
    }

    #[inline(always)]
    fn tension(&self, length: f64, most: f64) -> f64 {
        self.law.pull(length, most).force
    }

    #[inline(always)]
    fn pull(&self, u: &[Vector; N], most: &Extensions<0>) -> RingPull<N, 0> {
        let sides = self.sides(u);
        let strand = self.law.pull(sides.perimeter - self.law.round, most.0);
        let mut pull = RingPull { force: [[0.0; 3]; N], tension: strand.force, most: (strand.most, []) };
        for i in 0..N {
            let d = sides.lengths[i];
            let along = strand.force / if d < self.thickness { self.thickness } else { d };
            for c in 0..3 {
                let force = along * sides.spans[i][c];
                pull.force[i][c] -= force;
                pull.force[(i + 1) % N][c] += force;
            }
        }
        let Oval { chords: spans, parts, root } = self.oval(&sides);
        let against = 2.0 * self.oval.0 * (1.0 / self.diameter) / root;
        for j in 0..chords::<N>().len() {
            let Chord { ends: [a, b], shares } = chords::<N>()[j];
            let along = against * (parts[0] * shares[0] + parts[1] * shares[1]);
            for c in 0..3 {
                let force = along * spans[j][c];
                pull.force[a][c] -= force;
                pull.force[b][c] += force;
            }
        }
        pull
    }

    fn add_tangent(&self, u: &[Vector; N], most: &Extensions<0>, slack: Slack, k: &mut [f64]) {
        let sides = self.sides(u);
        let pull = self.law.pull(sides.perimeter - self.law.round, most.0);
        let slope = match slack {
            Slack::Taut => self.law.stiffest(),
            Slack::Regularised(part) if pull.slope == 0.0 => part * self.law.stiffest(),
            _ => pull.slope,
        };
        add_perimeter(k, (&self.spans, self.thickness), u, (pull.force, slope));
        let (Oval { chords: spans, parts, root }, mut gradients) = (self.oval(&sides), [[0.0; 12]; 2]);
        let (stiffness, most) = self.oval;
        let (n, first) = (3 * N, stiffness / root);
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

    #[inline(always)]
    fn energy(&self, u: &[Vector; N], most: &Extensions<0>) -> (f64, f64) {
        let sides = self.sides(u);
        let (stored, dissipated) = self.law.energy(sides.perimeter - self.law.round, most.0);
        let (stiffness, largest) = self.oval;
        (stored + largest * largest / stiffness * (self.oval(&sides).root - 1.0), dissipated)
    }

    /// That of a strand that is turned by 180 degrees.
    #[inline(always)]
    fn strength(&self) -> f64 {
        self.strength.turned_back()
    }

    /// That of the contact which turns it most.
    fn bears(&self, u: &[Vector; N]) -> f64 {
        let RingSides { spans, lengths, .. } = self.sides(u);
        let unit = |i: usize| spans[i].map(|x| if lengths[i] > 0.0 { x / lengths[i] } else { 0.0 });
        let mut least = 1.0_f64;
        for i in 0..N {
            let ([x, y, z], [along_x, along_y, along_z]) = (unit(i), unit((i + 1) % N));
            least = least.min(x * along_x + y * along_y + z * along_z);
        }
        self.strength.at(least.max(-1.0).acos())
    }

    /// Its lengths are roots.
    fn coarseness(&self) -> f64 {
        self.law.round * self.law.stiffest()
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
        let at = |i: usize| cell.positions[nodes[i % nodes.len()]];
        let polygon: f64 = (0..nodes.len()).map(|i| (at(i + 1) - at(i)).norm()).sum();
        let (area, around) = (bundle.area(), PI * self.diameter);
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
        let strength = self.strength(cell, area)?;
        let ring = Ring {
            nodes: nodes.to_vec(),
            law: match nodes.len() {
                2 => RingLaw::WireTwo(Wire::new(&bundle, sides(cell), strength)),
                3 => RingLaw::WireThree(Wire::new(&bundle, sides(cell), strength)),
                _ => RingLaw::WireFour(Wire::new(&bundle, sides(cell), strength)),
            },
            section: area,
            mass: area * around * self.density,
            radius: self.radius.unwrap_or(0.5 * bundle.thickness()),
        };
        made.elements.push(ring.into());
        Ok(())
    }

    fn judge(&self, at: &Surroundings) -> Result<Vec<Diagnostic>, Diagnostic> {
        judge_diameter(self.diameter, at)
    }
}
