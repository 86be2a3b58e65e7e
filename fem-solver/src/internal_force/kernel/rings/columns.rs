//! The formulas of rings over the columns of a block, in wide registers.
//!
//! What a loop over rings reads beside the memory it writes to is a copy of its own: so short a loop is left as it is if it would have
//! to find out first whether both overlap.

#![expect(
    clippy::needless_range_loop,
    reason = "iterators over components keep the compiler from wide registers"
)]

use super::{Lanes, WIDTH};
use crate::element::ring::formula::{Formula, RingPull, Vector};
use toolkit::simd::widely;

/// A vector at each of `N` nodes.
pub type NodeLanes<const N: usize> = [[Lanes; 3]; N];

const ZERO: Lanes = [0.0; WIDTH];

/// The sides of each ring as modelled, and the law that they share.
#[derive(Debug, Clone, Copy)]
pub struct BlockConstants<const N: usize, F> {
    pub spans: NodeLanes<N>,
    pub law: F,
}

/// Input and answers of the rings of a block.
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
    /// Upper bound of each tension by the end of an explicit step if nothing holds the nodes up.
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

impl<const N: usize, F> BlockConstants<N, F> {
    /// The formulas of one of the rings.
    #[inline(always)]
    fn ring<const W: usize>(&self, l: usize) -> F
    where
        F: Formula<N, W>,
    {
        self.law.over(lane(&self.spans, l))
    }
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

/// The formulas of all rings of a block.
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
    pub fn pull<F: Formula<N, W>>(&mut self, constants: &BlockConstants<N, F>, farthest: f64) {
        widely(
            #[inline(always)]
            || {
                let (constants, longer) = (*constants, 2.0 * N as f64 * farthest);
                for l in 0..WIDTH {
                    let (ring, u, had) = (constants.ring(l), lane(&self.u, l), self.had(l));
                    let RingPull { force, tension, most } = ring.pull(&u, &had);
                    let bound = ring.tension(ring.length(&u) + longer, had.0);
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

    /// Upper bound of the shares of the first `count` rings by the end of the explicit step.
    pub fn share_bound<F: Formula<N, W>>(&self, constants: &BlockConstants<N, F>, count: usize) -> f64 {
        self.bound[..count].iter().copied().fold(0.0, f64::max) / constants.law.strength()
    }

    /// Largest share of its strength that any of the first `count` rings uses, the most drawn one with `tension` [N]; or an upper
    /// bound that is not above `most`.
    pub fn share_above<F: Formula<N, W>>(
        &self,
        constants: &BlockConstants<N, F>,
        count: usize,
        (tension, most): (f64, f64),
    ) -> f64 {
        let bound = tension / constants.law.strength();
        if bound > most { self.share_at(constants, &self.u, count) } else { bound }
    }

    /// Largest share of its strength that any of the first `count` rings uses at the displacements in `ahead`, or an upper bound below
    /// [`crate::element::FAR`].
    pub fn share_ahead<F: Formula<N, W>>(&self, constants: &BlockConstants<N, F>, count: usize) -> f64 {
        self.share_at(constants, &self.ahead, count)
    }

    /// The same at the displacements `u`.
    pub fn share_at<F: Formula<N, W>>(
        &self,
        constants: &BlockConstants<N, F>,
        u: &NodeLanes<N>,
        count: usize,
    ) -> f64 {
        let tensions = self.tensions(constants, u);
        let share = |l: usize| constants.ring(l).share(&lane(u, l), tensions[l]);
        (0..count).map(share).fold(0.0, f64::max)
    }

    /// Tension of each perimeter at the displacements `u`, 0 where it is broken.
    pub fn tensions<F: Formula<N, W>>(&self, constants: &BlockConstants<N, F>, u: &NodeLanes<N>) -> Lanes {
        widely(
            #[inline(always)]
            || {
                let (constants, u, most, broken) = (*constants, *u, self.had.1, self.broken);
                let mut tensions = ZERO;
                for l in 0..WIDTH {
                    let ring = constants.ring(l);
                    let tension = ring.tension(ring.length(&lane(&u, l)), most[l]);
                    tensions[l] = if broken[l] > 0.0 { 0.0 } else { tension };
                }
                tensions
            },
        )
    }

    /// Energies and tensions.
    pub fn measure<F: Formula<N, W>>(&mut self, constants: &BlockConstants<N, F>) {
        widely(
            #[inline(always)]
            || {
                let constants = *constants;
                for l in 0..WIDTH {
                    let (ring, u, had) = (constants.ring(l), lane(&self.u, l), self.had(l));
                    (self.stored[l], self.dissipated[l]) = ring.energy(&u, &had);
                    let tension = ring.tension(ring.length(&u), had.0);
                    self.tension[l] = if self.broken[l] > 0.0 { 0.0 } else { tension };
                }
            },
        );
    }
}
