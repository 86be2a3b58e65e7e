//! The formulas of a ring over `N` nodes with `W` widths, for one ring or for each of several in wide registers.
//!
//! Plain arrays, no branches, no fused products, every sum in one fixed order: the compiler works on several rings at a
//! time, and each comes out to the same bytes as alone.

#![expect(
    clippy::needless_range_loop,
    reason = "iterators over components keep the compiler from wide registers"
)]

use super::Mechanism;

/// A vector.
pub type Vector = [f64; 3];

/// A law of rings over `N` nodes whose history is a largest extension of the perimeter and `W` more, with the sides of one ring.
pub trait Formula<const N: usize, const W: usize>: Copy + PartialEq {
    /// The same over other sides as modelled [m].
    fn over(self, spans: [Vector; N]) -> Self;

    /// Its sides as modelled [m].
    fn spans(&self) -> [Vector; N];

    /// Stored and dissipated energy as modelled [J], which do not count.
    fn modelled(&self) -> (f64, f64);

    /// Its answer where its nodes are displaced by `u` [m], after the largest extensions `most` [m].
    fn pull(&self, u: &[Vector; N], most: &(f64, [f64; W])) -> RingPull<N, W>;

    /// Force of the perimeter [N] where that is so much `longer` [m] than there.
    fn tension(&self, u: &[Vector; N], longer: f64, most: f64) -> f64;

    /// Stored and dissipated energy [J] there, ruptures apart.
    fn energy(&self, u: &[Vector; N], most: &(f64, [f64; W])) -> (f64, f64);

    /// Force of the perimeter that it bears wherever its nodes are [N]; infinite = any.
    fn strength(&self) -> f64;

    /// Share of its strength there that the force `tension` [N] of the perimeter uses; or an upper bound below
    /// [`crate::element::FAR`].
    fn share(&self, u: &[Vector; N], tension: f64) -> f64;
}

/// What a mechanism needs without easing.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Stiffnesses {
    /// Length beyond which it acts [m].
    pub start: f64,
    /// Stiffness of loading [N/m].
    pub loading: f64,
    /// Stiffness of unloading [N/m].
    pub unloading: f64,
    /// Share of the work of loading that is dissipated.
    pub lost: f64,
}

impl From<&Mechanism> for Stiffnesses {
    fn from(mechanism: &Mechanism) -> Self {
        let Mechanism { start, stiffness, unloading, .. } = *mechanism;
        Self { start, loading: stiffness, unloading: stiffness * unloading, lost: 1.0 - 1.0 / unloading }
    }
}

impl Stiffnesses {
    /// Force [N] and largest extension [m] at the length `l` [m] after the largest extension `most` [m], which is 0 or more.
    #[inline(always)]
    pub fn force(&self, l: f64, most: f64) -> (f64, f64) {
        let u = l - self.start;
        let loads = u >= most;
        let back = self.loading * most - self.unloading * (most - u);
        let back = if back > 0.0 { back } else { 0.0 };
        (if loads { self.loading * u } else { back }, if loads { u } else { most })
    }

    /// Stored and dissipated energy [J] there.
    #[inline(always)]
    pub fn energy(&self, l: f64, most: f64) -> (f64, f64) {
        let (force, most) = self.force(l, most);
        (force * force / (2.0 * self.unloading), 0.5 * self.loading * most * most * self.lost)
    }
}

/// A ring: its sides as modelled [m] and its mechanisms.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RingConstants<const N: usize> {
    /// From each node to the next.
    pub spans: [Vector; N],
    /// The perimeter.
    pub perimeter: Stiffnesses,
    /// Each width.
    pub width: Stiffnesses,
    /// Force of the perimeter at which it breaks [N]; infinite = never.
    pub rupture: f64,
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

/// What a ring answers.
pub struct RingPull<const N: usize, const W: usize> {
    /// Internal force on each node [N].
    pub force: [Vector; N],
    /// Force of the perimeter [N].
    pub tension: f64,
    /// Largest extensions, of the perimeter and of each width [m].
    pub most: (f64, [f64; W]),
}

/// Coefficient of node `a` in width number `j` of a ring of `N` nodes: diagonals of four, medians of three.
#[inline(always)]
pub const fn coefficient<const N: usize>(j: usize, a: usize) -> f64 {
    match (N, (a + N - j) % N) {
        (_, 0) => -1.0,
        (3, _) => 0.5,
        (_, 2) => 1.0,
        _ => 0.0,
    }
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

impl<const N: usize> RingConstants<N> {
    /// The widths as vectors [m].
    #[inline(always)]
    pub fn widths<const W: usize>(&self, u: &[Vector; N]) -> [Vector; W] {
        let (mut widths, mut place) = ([[0.0; 3]; W], [0.0; 3]);
        for a in 0..N {
            for c in 0..3 {
                let position = place[c] + u[a][c];
                for (j, width) in widths.iter_mut().enumerate() {
                    if coefficient::<N>(j, a) != 0.0 {
                        width[c] += coefficient::<N>(j, a) * position;
                    }
                }
                place[c] += self.spans[a][c];
            }
        }
        widths
    }
}

impl<const N: usize, const W: usize> Formula<N, W> for RingConstants<N> {
    #[inline(always)]
    fn over(self, spans: [Vector; N]) -> Self {
        Self { spans, ..self }
    }

    fn spans(&self) -> [Vector; N] {
        self.spans
    }

    fn modelled(&self) -> (f64, f64) {
        (self.energy(&[[0.0; 3]; N], &(0.0, [0.0; W])).0, 0.0)
    }

    #[inline(always)]
    fn pull(&self, u: &[Vector; N], most: &(f64, [f64; W])) -> RingPull<N, W> {
        let sides = RingSides::new(&self.spans, u);
        let (tension, stretched) = self.perimeter.force(sides.perimeter, most.0);
        let mut pull = RingPull { force: [[0.0; 3]; N], tension, most: (stretched, most.1) };
        let mut along = sides.spans;
        for i in 0..N {
            for c in 0..3 {
                let unit = along[i][c] / sides.lengths[i];
                along[i][c] = if sides.lengths[i] > 0.0 { unit } else { 0.0 };
            }
        }
        for i in 0..N {
            for c in 0..3 {
                pull.force[i][c] = tension * (along[(i + N - 1) % N][c] - along[i][c]);
            }
        }
        for (j, width) in self.widths::<W>(u).into_iter().enumerate() {
            let length = norm(width);
            let (force, stretched) = self.width.force(length, most.1[j]);
            pull.most.1[j] = stretched;
            for c in 0..3 {
                let unit = width[c] / length;
                for a in 0..N {
                    if coefficient::<N>(j, a) != 0.0 {
                        pull.force[a][c] += coefficient::<N>(j, a) * force * unit;
                    }
                }
            }
        }
        pull
    }

    #[inline(always)]
    fn tension(&self, u: &[Vector; N], longer: f64, most: f64) -> f64 {
        self.perimeter.force(RingSides::new(&self.spans, u).perimeter + longer, most).0
    }

    #[inline(always)]
    fn energy(&self, u: &[Vector; N], most: &(f64, [f64; W])) -> (f64, f64) {
        let perimeter = RingSides::new(&self.spans, u).perimeter;
        let (mut stored, mut dissipated) = self.perimeter.energy(perimeter, most.0);
        for (j, width) in self.widths::<W>(u).into_iter().enumerate() {
            let own = self.width.energy(norm(width), most.1[j]);
            stored += own.0;
            dissipated += own.1;
        }
        (stored, dissipated)
    }
    #[inline(always)]
    fn strength(&self) -> f64 {
        self.rupture
    }

    #[inline(always)]
    fn share(&self, _u: &[Vector; N], tension: f64) -> f64 {
        tension / self.rupture
    }
}
