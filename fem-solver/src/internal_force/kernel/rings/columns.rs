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

/// RingConstants of each ring.
#[derive(Debug, Clone)]
pub struct BlockConstants<const N: usize> {
    spans: NodeLanes<N>,
    perimeter: [Lanes; 4],
    width: [Lanes; 4],
}

/// What goes in.
#[derive(Debug, Clone)]
pub struct BlockInputs<const N: usize, const W: usize> {
    pub u: NodeLanes<N>,
    /// Displacements at the start of an explicit step, of which `u` is the middle.
    pub start: NodeLanes<N>,
    pub most: [Lanes; W],
    pub most_perimeter: Lanes,
    pub broken: Lanes,
}

/// What comes out.
#[derive(Debug, Clone)]
pub struct BlockAnswers<const N: usize, const W: usize> {
    pub force: NodeLanes<N>,
    pub tension: Lanes,
    pub most: [Lanes; W],
    pub most_perimeter: Lanes,
    /// Tension at the end of an explicit step if nothing held it up.
    pub ahead: Lanes,
    pub stored: Lanes,
    pub dissipated: Lanes,
}

impl<const N: usize> Default for BlockConstants<N> {
    fn default() -> Self {
        Self { spans: [[ZERO; 3]; N], perimeter: [ZERO; 4], width: [ZERO; 4] }
    }
}

impl<const N: usize, const W: usize> Default for BlockInputs<N, W> {
    fn default() -> Self {
        Self { u: [[ZERO; 3]; N], start: [[ZERO; 3]; N], most: [ZERO; W], most_perimeter: ZERO, broken: ZERO }
    }
}

impl<const N: usize, const W: usize> Default for BlockAnswers<N, W> {
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

impl<const N: usize> BlockConstants<N> {
    /// Put the constants of a ring in its place.
    pub fn put(&mut self, l: usize, ring: &RingConstants<N>) {
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

impl<const N: usize, const W: usize> BlockInputs<N, W> {
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

/// The formulas of all rings of a block, in wide registers: products are never fused with sums.
impl<const N: usize, const W: usize> BlockAnswers<N, W> {
    /// Force, history and tension.
    pub fn pull(&mut self, constants: &BlockConstants<N>, inputs: &BlockInputs<N, W>) {
        Arch::new().dispatch(
            #[inline(always)]
            || {
                for l in 0..WIDTH {
                    let (u, most) = (lane(&inputs.u, l), inputs.most(l));
                    let RingPull { force, tension, most: now } = constants.ring(l).pull::<W>(&u, &most);
                    let broken = inputs.broken[l] > 0.0;
                    self.tension[l] = if broken { 0.0 } else { tension };
                    for a in 0..N {
                        for c in 0..3 {
                            self.force[a][c][l] = if broken { 0.0 } else { force[a][c] };
                        }
                    }
                    self.most_perimeter[l] = if broken { most.0 } else { now.0 };
                    for j in 0..W {
                        self.most[j][l] = if broken { most.1[j] } else { now.1[j] };
                    }
                }
            },
        );
    }

    /// What each perimeter would carry at the end of the step.
    pub fn ahead(&mut self, constants: &BlockConstants<N>, inputs: &BlockInputs<N, W>) {
        Arch::new().dispatch(
            #[inline(always)]
            || {
                for l in 0..WIDTH {
                    let (start, mut u) = (lane(&inputs.start, l), lane(&inputs.u, l));
                    for a in 0..N {
                        for c in 0..3 {
                            u[a][c] = start[a][c] + 2.0 * (u[a][c] - start[a][c]);
                        }
                    }
                    let ring = constants.ring(l);
                    let (tension, _) =
                        ring.perimeter.force(ring.sides(&u).perimeter, inputs.most_perimeter[l]);
                    self.ahead[l] = if inputs.broken[l] > 0.0 { 0.0 } else { tension };
                }
            },
        );
    }

    /// What each perimeter carries.
    pub fn carry(&mut self, constants: &BlockConstants<N>, inputs: &BlockInputs<N, W>) {
        Arch::new().dispatch(
            #[inline(always)]
            || {
                for l in 0..WIDTH {
                    let (ring, u) = (constants.ring(l), lane(&inputs.u, l));
                    let (tension, _) =
                        ring.perimeter.force(ring.sides(&u).perimeter, inputs.most_perimeter[l]);
                    self.tension[l] = if inputs.broken[l] > 0.0 { 0.0 } else { tension };
                }
            },
        );
    }

    /// Energies.
    pub fn measure(&mut self, constants: &BlockConstants<N>, inputs: &BlockInputs<N, W>) {
        Arch::new().dispatch(
            #[inline(always)]
            || {
                for l in 0..WIDTH {
                    let (u, most) = (lane(&inputs.u, l), inputs.most(l));
                    let ring = constants.ring(l);
                    (self.stored[l], self.dissipated[l]) = ring.energy::<W>(&u, &most);
                }
            },
        );
    }
}
