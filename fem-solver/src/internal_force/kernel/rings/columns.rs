//! The formulas of rings over the columns of a block, in wide registers.

use super::{Column, WIDTH};
use crate::element::ring::formula::{Constants, Pull, Stiffness, Triple};
use crate::linear_algebra::lanes::wide;

/// A vector at each of `N` nodes.
pub type Vectors<const N: usize> = [[Column; 3]; N];

const ZERO: Column = [0.0; WIDTH];

/// Constants of each ring.
#[derive(Debug, Clone)]
pub struct Columns<const N: usize> {
    spans: Vectors<N>,
    perimeter: [Column; 4],
    width: [Column; 4],
}

/// What goes in.
#[derive(Debug, Clone)]
pub struct State<const N: usize, const W: usize> {
    pub u: Vectors<N>,
    /// Displacements at the start of an explicit step, of which `u` is the middle.
    pub start: Vectors<N>,
    pub most: [Column; W],
    pub most_perimeter: Column,
    pub broken: Column,
}

/// What comes out.
#[derive(Debug, Clone)]
pub struct Found<const N: usize, const W: usize> {
    pub force: Vectors<N>,
    pub tension: Column,
    pub most: [Column; W],
    pub most_perimeter: Column,
    /// Tension at the end of an explicit step if nothing held it up.
    pub ahead: Column,
    pub stored: Column,
    pub dissipated: Column,
}

impl<const N: usize> Default for Columns<N> {
    fn default() -> Self {
        Self { spans: [[ZERO; 3]; N], perimeter: [ZERO; 4], width: [ZERO; 4] }
    }
}

impl<const N: usize, const W: usize> Default for State<N, W> {
    fn default() -> Self {
        Self { u: [[ZERO; 3]; N], start: [[ZERO; 3]; N], most: [ZERO; W], most_perimeter: ZERO, broken: ZERO }
    }
}

impl<const N: usize, const W: usize> Default for Found<N, W> {
    fn default() -> Self {
        Self {
            force: [[ZERO; 3]; N],
            tension: ZERO,
            most: [ZERO; W],
            most_perimeter: ZERO,
            ahead: ZERO,
            stored: ZERO,
            dissipated: ZERO,
        }
    }
}

impl<const N: usize> Columns<N> {
    /// Put the constants of a ring in its place.
    pub fn put(&mut self, l: usize, ring: &Constants<N>) {
        for a in 0..N {
            for c in 0..3 {
                self.spans[a][c][l] = ring.spans[a][c];
            }
        }
        for (columns, of) in [(&mut self.perimeter, ring.perimeter), (&mut self.width, ring.width)] {
            for (column, value) in columns.iter_mut().zip([of.start, of.loading, of.unloading, of.lost]) {
                column[l] = value;
            }
        }
    }

    /// The constants of one of them.
    #[inline(always)]
    fn ring(&self, l: usize) -> Constants<N> {
        let mechanism = |of: &[Column; 4]| Stiffness {
            start: of[0][l],
            loading: of[1][l],
            unloading: of[2][l],
            lost: of[3][l],
        };
        Constants {
            spans: lane(&self.spans, l),
            perimeter: mechanism(&self.perimeter),
            width: mechanism(&self.width),
        }
    }
}

/// The vectors of one ring.
#[inline(always)]
fn lane<const N: usize>(columns: &Vectors<N>, l: usize) -> [Triple; N] {
    let mut own = [[0.0; 3]; N];
    for a in 0..N {
        for c in 0..3 {
            own[a][c] = columns[a][c][l];
        }
    }
    own
}

impl<const N: usize, const W: usize> State<N, W> {
    /// Largest extensions of one ring.
    #[inline(always)]
    fn most(&self, l: usize) -> (f64, [f64; W]) {
        let mut own = [0.0; W];
        for j in 0..W {
            own[j] = self.most[j][l];
        }
        (self.most_perimeter[l], own)
    }
}

/// The formulas of all rings of a block.
pub trait Formulas<const N: usize, const W: usize> {
    /// Force, history and tension.
    fn pull(&mut self, columns: &Columns<N>, state: &State<N, W>);
    /// What each perimeter would carry at the end of the step.
    fn ahead(&mut self, columns: &Columns<N>, state: &State<N, W>);
    /// What each perimeter carries.
    fn carry(&mut self, columns: &Columns<N>, state: &State<N, W>);
    /// Energies.
    fn measure(&mut self, columns: &Columns<N>, state: &State<N, W>);
}

#[inline(always)]
fn pull_each<const N: usize, const W: usize>(
    columns: &Columns<N>,
    state: &State<N, W>,
    found: &mut Found<N, W>,
) {
    for l in 0..WIDTH {
        let (u, most) = (lane(&state.u, l), state.most(l));
        let Pull { force, tension, most: now } = columns.ring(l).pull::<W>(&u, &most);
        let broken = state.broken[l] > 0.0;
        found.tension[l] = if broken { 0.0 } else { tension };
        for a in 0..N {
            for c in 0..3 {
                found.force[a][c][l] = if broken { 0.0 } else { force[a][c] };
            }
        }
        found.most_perimeter[l] = if broken { most.0 } else { now.0 };
        for j in 0..W {
            found.most[j][l] = if broken { most.1[j] } else { now.1[j] };
        }
    }
}

#[inline(always)]
fn ahead_each<const N: usize, const W: usize>(
    columns: &Columns<N>,
    state: &State<N, W>,
    found: &mut Found<N, W>,
) {
    for l in 0..WIDTH {
        let (start, mut u) = (lane(&state.start, l), lane(&state.u, l));
        for a in 0..N {
            for c in 0..3 {
                u[a][c] = start[a][c] + 2.0 * (u[a][c] - start[a][c]);
            }
        }
        let ring = columns.ring(l);
        let (tension, _) = ring.perimeter.force(ring.sides(&u).perimeter, state.most_perimeter[l]);
        found.ahead[l] = if state.broken[l] > 0.0 { 0.0 } else { tension };
    }
}

#[inline(always)]
fn measure_each<const N: usize, const W: usize>(
    columns: &Columns<N>,
    state: &State<N, W>,
    found: &mut Found<N, W>,
) {
    for l in 0..WIDTH {
        let (u, most) = (lane(&state.u, l), state.most(l));
        let ring = columns.ring(l);
        (found.stored[l], found.dissipated[l]) = ring.energy::<W>(&u, &most);
    }
}

#[inline(always)]
fn carry_each<const N: usize, const W: usize>(
    columns: &Columns<N>,
    state: &State<N, W>,
    found: &mut Found<N, W>,
) {
    for l in 0..WIDTH {
        let (ring, u) = (columns.ring(l), lane(&state.u, l));
        let (tension, _) = ring.perimeter.force(ring.sides(&u).perimeter, state.most_perimeter[l]);
        found.tension[l] = if state.broken[l] > 0.0 { 0.0 } else { tension };
    }
}

/// Declares [`Formulas`] for one number of nodes and widths, with each function in wide registers.
macro_rules! formulas {
    ($nodes:literal, $widths:literal) => {
        impl Formulas<$nodes, $widths> for Found<$nodes, $widths> {
            formulas!($nodes, $widths, pull, pull_each);
            formulas!($nodes, $widths, ahead, ahead_each);
            formulas!($nodes, $widths, carry, carry_each);
            formulas!($nodes, $widths, measure, measure_each);
        }
    };
    ($nodes:literal, $widths:literal, $name:ident, $each:ident) => {
        fn $name(&mut self, columns: &Columns<$nodes>, state: &State<$nodes, $widths>) {
            wide! {
                fn all(columns: &Columns<$nodes>, state: &State<$nodes, $widths>, found: &mut Found<$nodes, $widths>) {
                    $each(columns, state, found)
                }
            }
            all(columns, state, self);
        }
    };
}

formulas!(3, 3);
formulas!(4, 2);
