//! What the cables of runs pull on their nodes, several at a time.
//!
//! Every cable and every sum at a node is the same arithmetic in the same order whatever the width of the registers, and
//! nothing is fused, so that every machine gives the same bytes.

use super::Run;
use crate::linear_algebra::lanes::{LANES, wide};
use std::array::from_fn;

/// Constants of all cables: `2 D` [m] by component, `D . D` [m2], `q_0` [N/m], `c` [N/m3].
pub type Constants<'a> = [&'a [f64]; 6];

wide! {
    /// Add what the cables of `runs` pull on their `nodes` nodes at the displacements `u` [m] to `force` [N], both
    /// component-major. `spare` is memory for the pulls of a run. Returns the largest tension, squared [N2]; what is not a
    /// number is passed over.
    pub fn pull_runs(
        runs: &[Run],
        constants: Constants<'_>,
        u: &[f64],
        force: &mut [f64],
        nodes: usize,
        spare: &mut [Vec<f64>; 3],
    ) -> f64 {
        let mut largest = [0.0; LANES];
        for run in runs {
            // At the end of the nodes the last few cables are dealt with after the others, so that sums keep their order.
            let len = run.cables.len();
            let reaches = run.nodes[1] + len.next_multiple_of(LANES) <= nodes;
            let whole = if reaches { len } else { len / LANES * LANES };
            for part in [0..whole, whole..len].into_iter().filter(|part| !part.is_empty()) {
                let ([a, b], len) = (run.nodes.map(|node| node + part.start), part.len());
                let cables = run.cables.start + part.start..run.cables.start + part.end;
                let piece = Piece {
                    first: from_fn(|c| &u[c * nodes + a..][..len]),
                    second: from_fn(|c| &u[c * nodes + b..][..len]),
                    constants: constants.map(|of| &of[cables.clone()]),
                    floor: run.floor,
                };
                let (x, rest) = force.split_at_mut(nodes);
                let (y, z) = rest.split_at_mut(nodes);
                let mut pulls = spare.each_mut().map(|pulls| &mut pulls[..len]);
                let mut first = [&mut x[a..a + len], &mut y[a..a + len], &mut z[a..a + len]];
                if run.alike {
                    piece.pull::<true>(&mut first, &mut pulls, &mut largest);
                } else {
                    piece.pull::<false>(&mut first, &mut pulls, &mut largest);
                }
                // Later, in a loop of its own: first and second nodes of a run are often the same.
                for (force, pulls) in [x, y, z].into_iter().zip(pulls) {
                    force[b..b + len].iter_mut().zip(pulls).for_each(|(to, pull)| *to -= *pull);
                }
            }
        }
        largest.into_iter().fold(0.0, f64::max)
    }
}

/// The cables of a run and their nodes: slices of one length.
struct Piece<'a> {
    first: [&'a [f64]; 3],
    second: [&'a [f64]; 3],
    constants: Constants<'a>,
    floor: f64,
}

impl Piece<'_> {
    /// Add the pulls to the forces on the first nodes, and write them to `pulls`. `ALIKE`: the constants are those of the
    /// first cable.
    #[inline(always)]
    fn pull<const ALIKE: bool>(
        &self,
        first: &mut [&mut [f64]; 3],
        pulls: &mut [&mut [f64]; 3],
        largest: &mut [f64; LANES],
    ) {
        let len = self.first[0].len();
        let mut at = 0;
        while at + LANES <= len {
            self.some::<LANES, ALIKE>(at, first, pulls, largest);
            at += LANES;
        }
        if at + LANES / 2 <= len {
            self.some::<{ LANES / 2 }, ALIKE>(at, first, pulls, largest);
            at += LANES / 2;
        }
        while at < len {
            self.some::<1, ALIKE>(at, first, pulls, largest);
            at += 1;
        }
    }

    /// The same of the `W` cables from number `at` on: see [`crate::element::Cable`].
    #[inline(always)]
    fn some<const W: usize, const ALIKE: bool>(
        &self,
        at: usize,
        first: &mut [&mut [f64]; 3],
        pulls: &mut [&mut [f64]; 3],
        largest: &mut [f64; LANES],
    ) {
        let of = |all: &[f64]| -> [f64; W] { all[at..at + W].try_into().expect("so many") };
        let constant = |of_all: &[f64]| if ALIKE { [of_all[0]; W] } else { of(of_all) };
        let [sx, sy, sz, square, q0, slope] = self.constants.map(constant);
        let [wx, wy, wz]: [[f64; W]; 3] = from_fn(|c| {
            let (from, to) = (of(self.first[c]), of(self.second[c]));
            from_fn(|l| to[l] - from[l])
        });
        let mut q = [0.0; W];
        for l in 0..W {
            let along = wx[l] * (sx[l] + wx[l]) + wy[l] * (sy[l] + wy[l]);
            let s = along + wz[l] * (sz[l] + wz[l]);
            let elastic = q0[l] + slope[l] * s;
            // Anything not a number stays so, and is found at the window's end.
            q[l] = if elastic < self.floor { self.floor } else { elastic };
            let squared = q[l] * q[l] * (square[l] + s);
            largest[l] = if squared > largest[l] { squared } else { largest[l] };
        }
        for (c, (span, w)) in [(sx, wx), (sy, wy), (sz, wz)].into_iter().enumerate() {
            let (force, pulls) = (&mut first[c][at..at + W], &mut pulls[c][at..at + W]);
            for l in 0..W {
                let pull = q[l] * (0.5 * span[l] + w[l]);
                pulls[l] = pull;
                force[l] += pull;
            }
        }
    }
}
