//! The formulas of a wire ring over `N` contacts, for one ring or for each of several in wide registers: like those of
//! [`crate::element::ring::formula`], plain arrays, no branches, no fused products, every sum in one fixed order.

#![expect(
    clippy::needless_range_loop,
    reason = "iterators over components keep the compiler from wide registers"
)]

use super::law::{Strength, Tightening};
use crate::element::FAR;
use crate::element::ring::formula::{Formula, RingPull, RingSides, Vector};

/// A ring: its sides as modelled [m], and what its wire and its bundle say.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WireConstants<const N: usize> {
    /// From each node to the next.
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

impl<const N: usize> WireConstants<N> {
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

    /// How much longer its polygon is there than that of the round ring [m].
    #[inline(always)]
    pub fn extension(&self, u: &[Vector; N]) -> f64 {
        self.sides(u).perimeter - self.law.round
    }

    /// Its largest extension as modelled [m]: what is drawn out then was so before.
    pub fn drawn(&self) -> f64 {
        self.extension(&[[0.0; 3]; N]).max(0.0)
    }

    /// How oval it is with these sides.
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

    /// Strand force that it bears where its nodes are displaced by `u` [N]: that of the contact which turns it most.
    pub fn bears(&self, u: &[Vector; N]) -> f64 {
        let RingSides { spans, lengths, .. } = self.sides(u);
        let unit = |i: usize| spans[i].map(|x| if lengths[i] > 0.0 { x / lengths[i] } else { 0.0 });
        let mut least = 1.0_f64;
        for i in 0..N {
            let ([x, y, z], [along_x, along_y, along_z]) = (unit(i), unit((i + 1) % N));
            least = least.min(x * along_x + y * along_y + z * along_z);
        }
        self.strength.at(least.max(-1.0).acos())
    }
}

impl<const N: usize> Formula<N, 0> for WireConstants<N> {
    #[inline(always)]
    fn over(self, spans: [Vector; N]) -> Self {
        Self { spans, ..self }
    }

    fn spans(&self) -> [Vector; N] {
        self.spans
    }

    fn modelled(&self) -> (f64, f64) {
        self.energy(&[[0.0; 3]; N], &(self.drawn(), []))
    }

    #[inline(always)]
    fn pull(&self, u: &[Vector; N], most: &(f64, [f64; 0])) -> RingPull<N, 0> {
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

    #[inline(always)]
    fn tension(&self, u: &[Vector; N], longer: f64, most: f64) -> f64 {
        self.law.pull(self.extension(u) + longer, most).force
    }

    #[inline(always)]
    fn energy(&self, u: &[Vector; N], most: &(f64, [f64; 0])) -> (f64, f64) {
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

    /// Far from breaking that of a strand that is turned by 180 degrees.
    fn share(&self, u: &[Vector; N], tension: f64) -> f64 {
        let most = tension / self.strength();
        if most < FAR { most } else { tension / self.bears(u) }
    }
}
