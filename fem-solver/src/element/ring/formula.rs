//! Laws of rings over `N` nodes with `W` widths, for one ring or for each of several in wide registers.
//!
//! Plain arrays, no branches, no fused products, every sum in one fixed order: the compiler works on several rings at a
//! time, and each comes out to the same bytes as alone.

#![expect(
    clippy::needless_range_loop,
    reason = "iterators over components keep the compiler from wide registers"
)]

use crate::element::segment::{Segment, add_pair, add_vector};
use crate::element::{FAR, Slack};

/// A vector.
pub type Vector = [f64; 3];

/// Largest extensions so far [m]: of the perimeter, and of each width.
pub type Extensions<const W: usize> = (f64, [f64; W]);

/// A law of rings over `N` nodes whose history is a largest extension of the perimeter and `W` more, with the sides of one ring.
pub trait Formula<const N: usize, const W: usize>: Copy + PartialEq {
    /// The same over other sides as modelled [m].
    fn over(self, spans: [Vector; N]) -> Self;

    /// Its sides as modelled [m].
    fn spans(&self) -> [Vector; N];

    /// Largest extension of the perimeter as modelled [m]: what is drawn out then was so before.
    fn drawn(&self) -> f64 {
        0.0
    }

    /// Stored and dissipated energy as modelled [J], which do not count.
    fn modelled(&self) -> (f64, f64);

    /// Length of its perimeter where its nodes are displaced by `u` [m], counted from where the law says.
    fn length(&self, u: &[Vector; N]) -> f64;

    /// Force of a perimeter of that `length` [N], after its largest extension `most` [m].
    fn tension(&self, length: f64, most: f64) -> f64;

    /// Its answer where its nodes are displaced by `u` [m].
    fn pull(&self, u: &[Vector; N], most: &Extensions<W>) -> RingPull<N, W>;

    /// The same of one that may go slack gradually.
    fn pull_alone(&self, u: &[Vector; N], most: &Extensions<W>) -> RingPull<N, W> {
        self.pull(u, most)
    }

    /// Add its tangent there to `k`, square, by rows [N/m].
    fn add_tangent(&self, u: &[Vector; N], most: &Extensions<W>, slack: Slack, k: &mut [f64]);

    /// Stored and dissipated energy [J] there, ruptures apart.
    fn energy(&self, u: &[Vector; N], most: &Extensions<W>) -> (f64, f64);

    /// Force of the perimeter that it bears wherever its nodes are [N]; infinite = any.
    fn strength(&self) -> f64;

    /// Force of the perimeter that it bears where its nodes are displaced by `u` [N].
    fn bears(&self, _u: &[Vector; N]) -> f64 {
        self.strength()
    }

    /// Share of its strength there that the force `tension` [N] of the perimeter uses; or an upper bound below [`FAR`].
    #[inline(always)]
    fn share(&self, u: &[Vector; N], tension: f64) -> f64 {
        let most = tension / self.strength();
        if most < FAR { most } else { tension / self.bears(u) }
    }

    /// See [`crate::element::Element::coarseness`].
    fn coarseness(&self) -> f64;
}

/// The sides of a ring [m].
pub struct RingSides<const N: usize> {
    /// From each node to the next.
    pub spans: [Vector; N],
    /// Their lengths.
    pub lengths: [f64; N],
    /// Sum of the lengths.
    pub perimeter: f64,
}

/// Answer of a ring.
pub struct RingPull<const N: usize, const W: usize> {
    /// Internal force on each node [N].
    pub force: [Vector; N],
    /// Force of the perimeter [N].
    pub tension: f64,
    /// Largest extensions.
    pub most: Extensions<W>,
}

/// Length of a vector.
#[inline(always)]
pub fn norm([x, y, z]: Vector) -> f64 {
    (x * x + y * y + z * z).sqrt()
}

impl<const N: usize> RingSides<N> {
    /// Those that are `spans` [m] as modelled, where the nodes are displaced by `u` [m].
    #[inline(always)]
    pub fn new(spans: &[Vector; N], u: &[Vector; N]) -> Self {
        let mut sides = Self { spans: *spans, lengths: [0.0; N], perimeter: 0.0 };
        for i in 0..N {
            for c in 0..3 {
                sides.spans[i][c] += u[(i + 1) % N][c] - u[i][c];
            }
            sides.lengths[i] = norm(sides.spans[i]);
            sides.perimeter += sides.lengths[i];
        }
        sides
    }
}

/// Add to `k` the tangent of a perimeter whose sides are `spans` as modelled, each blunted below `least` [m], where its nodes are
/// displaced by `u` [m] and it pulls with `force` [N], by `slope` [N/m] more as it grows.
pub fn add_perimeter<const N: usize>(
    k: &mut [f64],
    (spans, least): (&[Vector; N], f64),
    u: &[Vector; N],
    (force, slope): (f64, f64),
) {
    let mut gradient = [0.0; 12];
    for (i, span) in spans.iter().enumerate() {
        let next = (i + 1) % N;
        let side = Segment::new(&(*span).into(), u.as_flattened(), i, next).blunted(least);
        let t = side.direction();
        add_vector(&mut gradient, 3 * i, &-t);
        add_vector(&mut gradient, 3 * next, &t);
        add_pair(k, 3 * N, 3 * i, 3 * next, &side.tangent(0.0, force));
    }
    add_square(k, 3 * N, slope, &gradient, &gradient);
}

/// Add `factor a b^T` of the first `n` numbers of each to the square matrix `k` of order `n`, by rows.
pub fn add_square(k: &mut [f64], n: usize, factor: f64, a: &[f64; 12], b: &[f64; 12]) {
    for (row, x) in k.chunks_exact_mut(n).zip(a) {
        row.iter_mut().zip(b).for_each(|(k, y)| *k += factor * x * y);
    }
}
