//! A straight piece between two nodes: what all line elements share.

use nalgebra::{Matrix3, Vector3};

/// A straight piece at given displacements.
#[derive(Debug, Clone, Copy)]
pub struct Segment {
    /// From its first node to its second [m].
    pub span: Vector3<f64>,
    /// Its length [m].
    pub length: f64,
    /// Its length squared less that as modelled [m2], without the cancellation of two large squares.
    pub growth: f64,
    /// Below this distance of its nodes the length is blunted [m]; 0 = it is not.
    blunt: f64,
}

impl Segment {
    /// The piece that spans `modelled` as modelled, where its nodes `first` and `second` (numbers in the
    /// element) are displaced by `u`.
    pub fn new(modelled: &Vector3<f64>, u: &[f64], first: usize, second: usize) -> Self {
        let w = vector(u, 3 * second) - vector(u, 3 * first);
        let span = modelled + w;
        Self { span, length: span.norm(), growth: w.dot(&(2.0 * modelled + w)), blunt: 0.0 }
    }

    /// The same where two nodes may run up to each other: closer than `least` [m] the length is `d^2 / (2 least) + least / 2`
    /// in place of the distance `d`.
    ///
    /// The distance itself has a kink at 0: a rope that pulls two nodes together ends there, with a tangent that grows
    /// without bound and a direction that says nothing. The blunted one is smooth, convex and exact from `least` on, as two
    /// shackles of that size are.
    pub fn blunted(mut self, least: f64) -> Self {
        if self.length < least {
            self.length = self.length * self.length / (2.0 * least) + 0.5 * least;
            self.blunt = least;
        }
        self
    }

    /// Derivative of the length by the place of the second node: the unit vector along it, shorter where it is blunted; 0
    /// where the nodes lie on each other.
    pub fn direction(&self) -> Vector3<f64> {
        let reach = if self.blunt > 0.0 { self.blunt } else { self.length };
        if reach > 0.0 { self.span / reach } else { Vector3::zeros() }
    }

    /// Distance of its nodes [m].
    pub fn distance(&self) -> f64 {
        if self.blunt > 0.0 { self.span.norm() } else { self.length }
    }

    /// Unit vector along it; 0 where the nodes lie on each other.
    pub fn unit(&self) -> Vector3<f64> {
        let distance = self.distance();
        if distance > 0.0 { self.span / distance } else { Vector3::zeros() }
    }

    /// Green-Lagrange strain against the unstretched `rest`, where `modelled` is the span as modelled.
    pub fn strain(&self, modelled: &Vector3<f64>, rest: f64) -> f64 {
        (modelled.norm_squared() - rest * rest + self.growth) / (2.0 * rest * rest)
    }

    /// Tangent block of a force `N` along it that grows with its length by `axial`:
    /// `axial t t^T + N/l (I - t t^T)`.
    pub fn tangent(&self, axial: f64, force: f64) -> Matrix3<f64> {
        let t = self.direction();
        if self.blunt > 0.0 {
            return axial * t * t.transpose() + Matrix3::from_diagonal_element(force / self.blunt);
        }
        let across = if self.length > 0.0 { force / self.length } else { 0.0 };
        (axial - across) * t * t.transpose() + Matrix3::from_diagonal_element(across)
    }
}

/// Three numbers of `u` from `at` on.
pub fn vector(u: &[f64], at: usize) -> Vector3<f64> {
    Vector3::new(u[at], u[at + 1], u[at + 2])
}

/// Add a vector to three numbers of `f` from `at` on.
pub fn add_vector(f: &mut [f64], at: usize, v: &Vector3<f64>) {
    f[at..at + 3].iter_mut().zip(v.iter()).for_each(|(f, v)| *f += v);
}

/// Add a block to the square matrix `k` of order `n`, by rows, from `(row, column)` on.
pub fn add_block(k: &mut [f64], n: usize, row: usize, column: usize, block: &Matrix3<f64>) {
    for r in 0..3 {
        for c in 0..3 {
            k[(row + r) * n + column + c] += block[(r, c)];
        }
    }
}

/// Add the four blocks of a force between two nodes.
pub fn add_pair(k: &mut [f64], n: usize, first: usize, second: usize, block: &Matrix3<f64>) {
    add_block(k, n, first, first, block);
    add_block(k, n, second, second, block);
    add_block(k, n, first, second, &-block);
    add_block(k, n, second, first, &-block);
}

/// Add `factor g` to `f`.
pub fn add_scaled(f: &mut [f64], factor: f64, g: &[f64]) {
    f.iter_mut().zip(g).for_each(|(f, g)| *f += factor * g);
}

/// Add `factor a b^T` to a square matrix, by rows.
pub fn add_product<const N: usize>(k: &mut [f64], factor: f64, a: &[f64; N], b: &[f64; N]) {
    for (row, x) in k.chunks_exact_mut(N).zip(a) {
        row.iter_mut().zip(b).for_each(|(k, y)| *k += factor * x * y);
    }
}
