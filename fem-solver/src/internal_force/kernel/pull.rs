//! What the cables of runs pull on their nodes, several at a time.
//!
//! Every cable and every sum at a node is the same arithmetic in the same order whatever the width of the registers, and
//! nothing is fused, so that every machine gives the same bytes.

use super::Run;
use crate::linear_algebra::lanes::{LANES, wide};

/// Constants of all cables: `2 D` [m] by component, `D . D` [m2], `q_0` [N/m], `c` [N/m3].
pub type Constants<'a> = [&'a [f64]; 6];

wide! {
    /// Add what the cables of `runs` pull at the displacements `u` [m] to `force` [N], both component-major over `nodes` nodes;
    /// `spare` is memory for the pulls of a run. Gives the largest tension, squared [N2]; what is not a number is passed over.
    pub fn pull(
        runs: &[Run],
        constants: Constants,
        u: &[f64],
        force: &mut [f64],
        nodes: usize,
        spare: &mut [Vec<f64>; 3],
    ) -> f64 {
        let (x, rest) = u.split_at(nodes);
        let (y, z) = rest.split_at(nodes);
        let (fx, rest) = force.split_at_mut(nodes);
        let (fy, fz) = rest.split_at_mut(nodes);
        let mut largest = [0.0; LANES];
        for run in runs {
            let (len, [a, b], cable) = (run.cables.len(), run.nodes, run.cables.start);
            // The last block reaches over the end; what is beyond is left as it is.
            let up = len.next_multiple_of(LANES).min(nodes - b);
            let [px, py, pz] = &mut *spare;
            let piece = Piece {
                first: [&x[a..a + up], &y[a..a + up], &z[a..a + up]],
                second: [&x[b..b + up], &y[b..b + up], &z[b..b + up]],
                constants: constants.map(|of| &of[cable..cable + up]),
                floor: run.floor,
            };
            let force = [&mut fx[a..a + up], &mut fy[a..a + up], &mut fz[a..a + up]];
            let pulls = [&mut px[..up], &mut py[..up], &mut pz[..up]];
            if run.alike {
                piece.pull::<true>(force, pulls, len, &mut largest);
            } else {
                piece.pull::<false>(force, pulls, len, &mut largest);
            }
            // Later, in a loop of its own: first and second nodes of a run are often the same.
            for (to, pulls) in [(&mut *fx, px), (&mut *fy, py), (&mut *fz, pz)] {
                to[b..b + len].iter_mut().zip(&pulls[..len]).for_each(|(to, pull)| *to -= pull);
            }
        }
        largest.into_iter().fold(0.0, f64::max)
    }
}

/// The cables of a run, and their nodes: slices of one length, no less than the number of cables.
struct Piece<'a> {
    first: [&'a [f64]; 3],
    second: [&'a [f64]; 3],
    constants: Constants<'a>,
    floor: f64,
}

impl Piece<'_> {
    /// Add the pulls of `len` cables to the forces on the first nodes, and write them to `pulls`. `ALIKE`: the constants are
    /// those of the first cable.
    #[inline(always)]
    fn pull<const ALIKE: bool>(
        &self,
        [fx, fy, fz]: [&mut [f64]; 3],
        [px, py, pz]: [&mut [f64]; 3],
        len: usize,
        largest: &mut [f64; LANES],
    ) {
        let [x1, y1, z1] = self.first.map(|of| of.as_chunks::<LANES>().0);
        let n = x1.len();
        let (y1, z1) = (&y1[..n], &z1[..n]);
        let [x2, y2, z2] = self.second.map(|of| &of.as_chunks::<LANES>().0[..n]);
        let [sx, sy, sz, square, q0, slope] = self.constants.map(|of| &of.as_chunks::<LANES>().0[..n]);
        let [fxs, fys, fzs] =
            [&mut *fx, &mut *fy, &mut *fz].map(|of| &mut of.as_chunks_mut::<LANES>().0[..n]);
        let [pxs, pys, pzs] =
            [&mut *px, &mut *py, &mut *pz].map(|of| &mut of.as_chunks_mut::<LANES>().0[..n]);
        let alike = self.constants.map(|of| of[0]);
        let whole = (len / LANES).min(n);
        for i in 0..whole {
            for l in 0..LANES {
                let w = [x2[i][l] - x1[i][l], y2[i][l] - y1[i][l], z2[i][l] - z1[i][l]];
                let own = [sx[i][l], sy[i][l], sz[i][l], square[i][l], q0[i][l], slope[i][l]];
                let (pull, squared) = law(w, if ALIKE { alike } else { own }, self.floor);
                largest[l] = if squared > largest[l] { squared } else { largest[l] };
                [pxs[i][l], pys[i][l], pzs[i][l]] = pull;
                fxs[i][l] += pull[0];
                fys[i][l] += pull[1];
                fzs[i][l] += pull[2];
            }
        }
        if whole < n {
            // The last ones, of which not all need be there.
            let (i, there) = (whole, len - whole * LANES);
            for l in 0..LANES {
                let w = [x2[i][l] - x1[i][l], y2[i][l] - y1[i][l], z2[i][l] - z1[i][l]];
                let own = [sx[i][l], sy[i][l], sz[i][l], square[i][l], q0[i][l], slope[i][l]];
                let (pull, squared) = law(w, if ALIKE { alike } else { own }, self.floor);
                largest[l] = if l < there && squared > largest[l] { squared } else { largest[l] };
                [pxs[i][l], pys[i][l], pzs[i][l]] = pull;
                fxs[i][l] = if l < there { fxs[i][l] + pull[0] } else { fxs[i][l] };
                fys[i][l] = if l < there { fys[i][l] + pull[1] } else { fys[i][l] };
                fzs[i][l] = if l < there { fzs[i][l] + pull[2] } else { fzs[i][l] };
            }
        }
        for i in n * LANES..len {
            let w = [0, 1, 2].map(|c| self.second[c][i] - self.first[c][i]);
            let (pull, squared) = law(w, self.constants.map(|of| of[i]), self.floor);
            largest[0] = if squared > largest[0] { squared } else { largest[0] };
            [px[i], py[i], pz[i]] = pull;
            fx[i] += pull[0];
            fy[i] += pull[1];
            fz[i] += pull[2];
        }
    }
}

/// Pull, by component, and squared tension at the relative displacement `w`: see [`crate::element::Cable`].
#[inline(always)]
fn law([wx, wy, wz]: [f64; 3], [sx, sy, sz, square, q0, slope]: [f64; 6], floor: f64) -> ([f64; 3], f64) {
    let s = wx * (sx + wx) + wy * (sy + wy) + wz * (sz + wz);
    let elastic = q0 + slope * s;
    // Anything not a number stays so, and is found at the window's end.
    let q = if elastic < floor { floor } else { elastic };
    ([q * (0.5 * sx + wx), q * (0.5 * sy + wy), q * (0.5 * sz + wz)], q * q * (square + s))
}
