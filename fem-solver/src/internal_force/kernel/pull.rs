//! Pull of the cables of runs on their nodes, several at a time.
//!
//! Registers as wide as the path of this process has them: every cable and every sum at a node is the same arithmetic in the same
//! order whatever their width, so that every machine gives the same bytes.

use super::Run;
use pulp::{Scalar, Simd, WithSimd};

/// Cables that the widest registers hold.
pub const WIDEST: usize = 8;

/// Constants of all cables: `2 D` [m] by component, `D . D` [m2], `q_0` [N/m], `c` [N/m3].
pub type CableConstants<'a> = [&'a [f64]; 6];

/// The runs of one tile and what they need. Gives the largest tension, squared [N2]; what is not a number is passed over.
pub struct Pull<'a> {
    /// The runs.
    pub runs: &'a [Run],
    /// The constants of all cables.
    pub constants: CableConstants<'a>,
    /// Displacements, component-major [m].
    pub u: &'a [f64],
    /// Forces that the pulls are added to, component-major [N].
    pub force: &'a mut [f64],
    /// Number of nodes.
    pub nodes: usize,
    /// Memory for the pulls of a run, by component.
    pub spare: &'a mut [Vec<f64>; 3],
}

/// Some cables of a run, and their nodes: slices of one length, a multiple of what a register holds.
struct RunPiece<'a> {
    first: [&'a [f64]; 3],
    second: [&'a [f64]; 3],
    constants: CableConstants<'a>,
    floor: f64,
    /// Number of them that are there.
    len: usize,
}

impl WithSimd for Pull<'_> {
    type Output = f64;

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, simd: S) -> f64 {
        let lanes = size_of::<S::f64s>() / size_of::<f64>();
        let mut largest = 0.0;
        let runs = self.runs;
        for run in runs {
            // The last register reaches over the end if there are nodes; what is beyond is left as it is.
            let len = run.cables.len();
            let reaches = run.nodes[1] + len.next_multiple_of(lanes) <= self.nodes;
            let whole = if reaches { len } else { len / lanes * lanes };
            if whole > 0 {
                largest = self.piece(simd, run, 0, whole, largest);
            }
            if whole < len {
                largest = self.piece(Scalar::new(), run, whole, len - whole, largest);
            }
            // When all first nodes have theirs: first and second nodes of a run are often the same, and however many cables a
            // register holds, a node is to take them in one order.
            for (c, pulls) in self.spare.iter().enumerate() {
                subtract(simd, &mut self.force[c * self.nodes + run.nodes[1]..][..len], &pulls[..len]);
            }
        }
        largest
    }
}

impl<'a> Pull<'a> {
    /// The `len` cables of `run` from number `at` on, without what they pull on their second nodes. Returns the largest of
    /// their squared tensions and `largest`.
    #[inline(always)]
    fn piece<S: Simd>(&mut self, simd: S, run: &Run, at: usize, len: usize, largest: f64) -> f64 {
        let up = len.next_multiple_of(size_of::<S::f64s>() / size_of::<f64>());
        let (a, b, cable) = (run.nodes[0] + at, run.nodes[1] + at, run.cables.start + at);
        // Written out: `map` of an array is not always inlined, and runs may be short.
        let component = |c: usize, first: usize| &self.u[c * self.nodes + first..][..up];
        let nodes = |first: usize| [component(0, first), component(1, first), component(2, first)];
        let [sx, sy, sz, square, q0, slope] = self.constants;
        let own = |of: &'a [f64]| &of[cable..cable + up];
        let constants = [own(sx), own(sy), own(sz), own(square), own(q0), own(slope)];
        let piece = RunPiece { first: nodes(a), second: nodes(b), constants, floor: run.floor, len };
        let (fx, rest) = self.force.split_at_mut(self.nodes);
        let (fy, fz) = rest.split_at_mut(self.nodes);
        let first = [&mut fx[a..a + up], &mut fy[a..a + up], &mut fz[a..a + up]];
        let [px, py, pz] = &mut *self.spare;
        let pulls = [&mut px[at..at + up], &mut py[at..at + up], &mut pz[at..at + up]];
        if run.alike {
            piece.pull::<S, true>(simd, first, pulls, largest)
        } else {
            piece.pull::<S, false>(simd, first, pulls, largest)
        }
    }
}

impl RunPiece<'_> {
    /// Add the pulls to the forces on the first nodes, and write them to `pulls`. `ALIKE`: the constants are those of the
    /// first cable. Returns the largest of the squared tensions and `largest`.
    #[inline(always)]
    fn pull<S: Simd, const ALIKE: bool>(
        &self,
        simd: S,
        [fx, fy, fz]: [&mut [f64]; 3],
        [px, py, pz]: [&mut [f64]; 3],
        largest: f64,
    ) -> f64 {
        let ([x1, y1, z1], [x2, y2, z2]) = (self.first, self.second);
        let x1 = S::as_simd_f64s(x1).0;
        let n = x1.len();
        let x2 = &S::as_simd_f64s(x2).0[..n];
        let (y1, y2) = (&S::as_simd_f64s(y1).0[..n], &S::as_simd_f64s(y2).0[..n]);
        let (z1, z2) = (&S::as_simd_f64s(z1).0[..n], &S::as_simd_f64s(z2).0[..n]);
        let (fx, px) = (&mut S::as_mut_simd_f64s(fx).0[..n], &mut S::as_mut_simd_f64s(px).0[..n]);
        let (fy, py) = (&mut S::as_mut_simd_f64s(fy).0[..n], &mut S::as_mut_simd_f64s(py).0[..n]);
        let (fz, pz) = (&mut S::as_mut_simd_f64s(fz).0[..n], &mut S::as_mut_simd_f64s(pz).0[..n]);
        let [sx, sy, sz, square, q0, slope] = self.constants;
        let first = |of: &[f64]| simd.splat_f64s(of[0]);
        let alike = [first(sx), first(sy), first(sz), first(square), first(q0), first(slope)];
        let (sx, sy) = (&S::as_simd_f64s(sx).0[..n], &S::as_simd_f64s(sy).0[..n]);
        let (sz, square) = (&S::as_simd_f64s(sz).0[..n], &S::as_simd_f64s(square).0[..n]);
        let (q0, slope) = (&S::as_simd_f64s(q0).0[..n], &S::as_simd_f64s(slope).0[..n]);
        let floor = simd.splat_f64s(self.floor);
        let mut peak = simd.splat_f64s(largest);
        for i in 0..n - 1 {
            let w = [simd.sub_f64s(x2[i], x1[i]), simd.sub_f64s(y2[i], y1[i]), simd.sub_f64s(z2[i], z1[i])];
            let own = if ALIKE { alike } else { [sx[i], sy[i], sz[i], square[i], q0[i], slope[i]] };
            let (pull, squared) = law(simd, w, own, floor);
            peak = simd.select_f64s(simd.greater_than_f64s(squared, peak), squared, peak);
            [px[i], py[i], pz[i]] = pull;
            fx[i] = simd.add_f64s(fx[i], pull[0]);
            fy[i] = simd.add_f64s(fy[i], pull[1]);
            fz[i] = simd.add_f64s(fz[i], pull[2]);
        }
        // The last ones, of which not all need be there.
        let i = n - 1;
        let lanes = size_of::<S::f64s>() / size_of::<f64>();
        let flags: &[f64] = &FLAGS[WIDEST - (self.len - i * lanes)..][..lanes];
        let there = simd.greater_than_f64s(S::as_simd_f64s(flags).0[0], simd.splat_f64s(0.0));
        let w = [simd.sub_f64s(x2[i], x1[i]), simd.sub_f64s(y2[i], y1[i]), simd.sub_f64s(z2[i], z1[i])];
        let own = if ALIKE { alike } else { [sx[i], sy[i], sz[i], square[i], q0[i], slope[i]] };
        let (pull, squared) = law(simd, w, own, floor);
        let squared = simd.select_f64s(there, squared, peak);
        peak = simd.select_f64s(simd.greater_than_f64s(squared, peak), squared, peak);
        [px[i], py[i], pz[i]] = pull;
        fx[i] = simd.select_f64s(there, simd.add_f64s(fx[i], pull[0]), fx[i]);
        fy[i] = simd.select_f64s(there, simd.add_f64s(fy[i], pull[1]), fy[i]);
        fz[i] = simd.select_f64s(there, simd.add_f64s(fz[i], pull[2]), fz[i]);
        simd.reduce_max_f64s(peak)
    }
}

/// So many ones as cables are there stand before the middle, counted from it.
const FLAGS: [f64; 2 * WIDEST] =
    [1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];

/// Pulls, by component, and squared tensions at the relative displacements `w`: see [`crate::element::Cable`].
#[inline(always)]
fn law<S: Simd>(
    simd: S,
    w: [S::f64s; 3],
    [sx, sy, sz, square, q0, slope]: [S::f64s; 6],
    floor: S::f64s,
) -> ([S::f64s; 3], S::f64s) {
    let [wx, wy, wz] = w;
    let along = simd.mul_f64s(wx, simd.add_f64s(sx, wx));
    let along = simd.add_f64s(along, simd.mul_f64s(wy, simd.add_f64s(sy, wy)));
    let s = simd.add_f64s(along, simd.mul_f64s(wz, simd.add_f64s(sz, wz)));
    let elastic = simd.add_f64s(q0, simd.mul_f64s(slope, s));
    // Anything not a number stays so, and is found at the window's end.
    let q = simd.select_f64s(simd.less_than_f64s(elastic, floor), floor, elastic);
    let half = simd.splat_f64s(0.5);
    let pull = [
        simd.mul_f64s(q, simd.add_f64s(simd.mul_f64s(half, sx), wx)),
        simd.mul_f64s(q, simd.add_f64s(simd.mul_f64s(half, sy), wy)),
        simd.mul_f64s(q, simd.add_f64s(simd.mul_f64s(half, sz), wz)),
    ];
    (pull, simd.mul_f64s(simd.mul_f64s(q, q), simd.add_f64s(square, s)))
}

/// `to -= what`.
#[inline(always)]
fn subtract<S: Simd>(simd: S, to: &mut [f64], what: &[f64]) {
    let ((to, to_rest), (what, what_rest)) = (S::as_mut_simd_f64s(to), S::as_simd_f64s(what));
    for (to, what) in to.iter_mut().zip(what) {
        *to = simd.sub_f64s(*to, *what);
    }
    for (to, what) in to_rest.iter_mut().zip(what_rest) {
        *to -= what;
    }
}
