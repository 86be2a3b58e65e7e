//! The formulas of rings over the columns of a block, in wide registers.

#![expect(
    clippy::needless_range_loop,
    reason = "iterators over components keep the compiler from wide registers"
)]

use super::{Lanes, WIDTH};
use crate::element::ring::formula::{RingConstants, RingPull, Stiffnesses, Vector};
use pulp::Arch;

/// A vector at each of `N` nodes.
pub type NodeLanes<const N: usize> = [[Lanes; 3]; N];

const ZERO: Lanes = [0.0; WIDTH];

/// Constants of each ring.
#[derive(Debug, Clone, Copy)]
pub struct BlockConstants<const N: usize> {
    spans: NodeLanes<N>,
    perimeter: [Lanes; 4],
    width: [Lanes; 4],
}

/// What the rings of a block are given, and what they answer.
#[derive(Debug, Clone)]
pub struct BlockMemory<const N: usize, const W: usize> {
    pub u: NodeLanes<N>,
    /// Displacements at the end of an explicit step if nothing held the nodes up.
    pub ahead: NodeLanes<N>,
    pub broken: Lanes,
    /// Largest extensions so far, of the perimeter and of the widths, and those with the answer.
    pub had: ([Lanes; W], Lanes),
    pub most: ([Lanes; W], Lanes),
    pub force: NodeLanes<N>,
    pub tension: Lanes,
    /// What no perimeter exceeds by the end of an explicit step if nothing holds the nodes up.
    pub bound: Lanes,
    pub stored: Lanes,
    pub dissipated: Lanes,
}

impl<const N: usize, const W: usize> Default for BlockMemory<N, W> {
    fn default() -> Self {
        let (nodes, extensions) = ([[ZERO; 3]; N], ([ZERO; W], ZERO));
        Self {
            u: nodes,
            ahead: nodes,
            broken: ZERO,
            had: extensions,
            most: extensions,
            force: nodes,
            tension: ZERO,
            bound: ZERO,
            stored: ZERO,
            dissipated: ZERO,
        }
    }
}

impl<const N: usize> BlockConstants<N> {
    /// Of these rings.
    pub fn new(rings: &[RingConstants<N>; WIDTH]) -> Self {
        let span = |a: usize, c: usize| rings.map(|ring| ring.spans[a][c]);
        let columns = |of: [Stiffnesses; WIDTH]| {
            [of.map(|m| m.start), of.map(|m| m.loading), of.map(|m| m.unloading), of.map(|m| m.lost)]
        };
        Self {
            spans: std::array::from_fn(|a| [0, 1, 2].map(|c| span(a, c))),
            perimeter: columns(rings.map(|ring| ring.perimeter)),
            width: columns(rings.map(|ring| ring.width)),
        }
    }

    /// The constants of one of them.
    #[inline(always)]
    fn ring(&self, l: usize) -> RingConstants<N> {
        let mechanism = |of: &[Lanes; 4]| Stiffnesses {
            start: of[0][l],
            loading: of[1][l],
            unloading: of[2][l],
            lost: of[3][l],
        };
        RingConstants {
            spans: lane(&self.spans, l),
            perimeter: mechanism(&self.perimeter),
            width: mechanism(&self.width),
        }
    }
}

/// Compute this in the widest registers of the processor.
///
/// The bound makes closures such that they are called once: one that could be called again is called through a function of its own,
/// which is compiled for the narrowest registers. What a loop over rings reads beside the memory it writes to is a copy of its own:
/// so short a loop is left as it is if it would have to find out first whether both overlap.
#[inline(always)]
fn wide<R>(what: impl FnOnce() -> R) -> R {
    Arch::new().dispatch(what)
}

/// The vectors of one ring.
#[inline(always)]
fn lane<const N: usize>(columns: &NodeLanes<N>, l: usize) -> [Vector; N] {
    let mut own = [[0.0; 3]; N];
    for a in 0..N {
        for c in 0..3 {
            own[a][c] = columns[a][c][l];
        }
    }
    own
}

/// The formulas of all rings of a block, in wide registers: products are never fused with sums.
impl<const N: usize, const W: usize> BlockMemory<N, W> {
    /// Largest extensions of one ring so far.
    #[inline(always)]
    fn had(&self, l: usize) -> (f64, [f64; W]) {
        let mut own = [0.0; W];
        for j in 0..W {
            own[j] = self.had.0[j][l];
        }
        (self.had.1[l], own)
    }

    /// Force, history and tension, where each node goes `farthest` [m] on: a side changes by at most twice that, and the force of a
    /// perimeter grows with its length.
    pub fn pull(&mut self, constants: &BlockConstants<N>, farthest: f64) {
        wide(
            #[inline(always)]
            || {
                let (constants, longer) = (*constants, 2.0 * N as f64 * farthest);
                for l in 0..WIDTH {
                    let (ring, u, had) = (constants.ring(l), lane(&self.u, l), self.had(l));
                    let RingPull { force, tension, most } = ring.pull::<W>(&u, &had);
                    let (bound, _) = ring.perimeter.force(ring.sides(&u).perimeter + longer, had.0);
                    let broken = self.broken[l] > 0.0;
                    self.tension[l] = if broken { 0.0 } else { tension };
                    self.bound[l] = if broken { 0.0 } else { bound };
                    for a in 0..N {
                        for c in 0..3 {
                            self.force[a][c][l] = if broken { 0.0 } else { force[a][c] };
                        }
                    }
                    self.most.1[l] = if broken { had.0 } else { most.0 };
                    for j in 0..W {
                        self.most.0[j][l] = if broken { had.1[j] } else { most.1[j] };
                    }
                }
            },
        );
    }

    /// What each perimeter carries at the displacements `u`, 0 where it is broken.
    pub fn tensions(&self, constants: &BlockConstants<N>, u: &NodeLanes<N>) -> Lanes {
        wide(
            #[inline(always)]
            || {
                let (constants, u, most, broken) = (*constants, *u, self.had.1, self.broken);
                let mut tensions = ZERO;
                for l in 0..WIDTH {
                    let ring = constants.ring(l);
                    let (tension, _) = ring.perimeter.force(ring.sides(&lane(&u, l)).perimeter, most[l]);
                    tensions[l] = if broken[l] > 0.0 { 0.0 } else { tension };
                }
                tensions
            },
        )
    }

    /// Energies and tensions.
    pub fn measure(&mut self, constants: &BlockConstants<N>) {
        wide(
            #[inline(always)]
            || {
                let constants = *constants;
                for l in 0..WIDTH {
                    let (ring, u, had) = (constants.ring(l), lane(&self.u, l), self.had(l));
                    (self.stored[l], self.dissipated[l]) = ring.energy::<W>(&u, &had);
                    let (tension, _) = ring.perimeter.force(ring.sides(&u).perimeter, had.0);
                    self.tension[l] = if self.broken[l] > 0.0 { 0.0 } else { tension };
                }
            },
        );
    }
}
