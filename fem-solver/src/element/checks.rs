//! What every element must pass: derivatives, rigid motions, mass.

use super::{Answer, Element};
use crate::tangent::Slack;
use nalgebra::{Rotation3, Vector3};

/// Numbers between -1/2 and 1/2, the same each time.
pub fn random(seed: u64) -> impl FnMut() -> f64 {
    let mut state = seed;
    move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as f64 / (1_u64 << 31) as f64 - 0.5
    }
}

/// An element at given displacements.
pub struct Case<'a> {
    element: &'a dyn Element,
    positions: &'a [Vector3<f64>],
    u: Vec<f64>,
    history: Vec<f64>,
    /// Whether the force is the slope of an energy.
    pub conservative: bool,
}

/// Relative step of the differences: the cube root of the rounding of one.
const STEP: f64 = 6e-6;

impl<'a> Case<'a> {
    /// `element`, whose nodes stand at `positions` as modelled, displaced by `u` from its first history.
    pub fn new(element: &'a dyn Element, positions: &'a [Vector3<f64>], u: &[f64]) -> Self {
        let history = element.start_history();
        Self { element, positions, u: u.to_vec(), history, conservative: true }
    }

    /// From a history of one's own.
    pub fn with_history(mut self, history: &[f64]) -> Self {
        self.history = history.to_vec();
        self
    }

    fn answer(&self, u: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let n = u.len();
        let (mut force, mut tangent) = (vec![f64::NAN; n], vec![f64::NAN; n * n]);
        let mut history = self.history.clone();
        self.element.respond(
            u,
            &self.history,
            &mut Answer {
                force: &mut force,
                tangent: Some(&mut tangent),
                slack: Slack::Exact,
                history: &mut history,
                tension: 0.0,
            },
        );
        (force, tangent)
    }

    /// Internal force.
    pub fn force(&self) -> Vec<f64> {
        self.answer(&self.u).0
    }

    fn work_function(&self, u: &[f64]) -> f64 {
        let energy = self.element.energy(u, &self.history);
        energy.stored + energy.dissipated
    }

    /// Every check.
    pub fn check_all(&self) {
        self.derivatives();
        self.rigid_motion();
        self.mass();
        let step = self.element.critical_step(&self.u, &self.history);
        assert!(step > 0.0, "{step}");
    }

    /// The force is the slope of the energy, and the tangent that of the force; by central differences.
    ///
    /// Steps are [`STEP`] times the size of the element: truncation `STEP^2` of what is differentiated, but for
    /// the kinks of a law inside a step, which are left out by comparing two lengths of step.
    pub fn derivatives(&self) {
        let size = self.size();
        let n = self.u.len();
        let (force, tangent) = self.answer(&self.u);
        let stiffness = tangent.iter().fold(1e-300, |a, k| f64::max(a, k.abs()));
        let largest = force.iter().fold(stiffness * size * 1e-3, |a, f| f64::max(a, f.abs()));
        for j in 0..n {
            let slopes = [1.0, 0.5].map(|part| {
                let h = part * STEP * size;
                let at = |sign: f64| {
                    let mut u = self.u.clone();
                    u[j] += sign * h;
                    u
                };
                let (plus, minus) = (at(1.0), at(-1.0));
                let energy = (self.work_function(&plus) - self.work_function(&minus)) / (2.0 * h);
                let (up, down) = (self.answer(&plus).0, self.answer(&minus).0);
                let forces: Vec<f64> = up.iter().zip(&down).map(|(a, b)| (a - b) / (2.0 * h)).collect();
                (energy, forces)
            });
            let [(coarse, coarse_k), (energy, forces)] = slopes;
            let smooth = (coarse - energy).abs() <= 1e-6 * largest
                && coarse_k.iter().zip(&forces).all(|(a, b)| (a - b).abs() <= 1e-5 * stiffness);
            if !smooth {
                continue;
            }
            if self.conservative {
                assert!(
                    (energy - force[j]).abs() <= 1e-6 * largest,
                    "dW/du_{j} = {energy}, force {}",
                    force[j]
                );
            }
            for (i, slope) in forces.iter().enumerate() {
                let k = self.compared(&tangent, i, j, n);
                // Both sides of a pair with rotations are compared by their mean: see `symmetric`.
                let slope =
                    if self.symmetric() { 0.5 * (forces[i] + self.slope(j, i, size)) } else { *slope };
                assert!((slope - k).abs() <= 2e-5 * stiffness, "df_{i}/du_{j} = {slope}, tangent {k}");
            }
        }
    }

    /// Rotations: moments are those in space, whose derivative is symmetric but for half a moment.
    fn symmetric(&self) -> bool {
        self.element.rotates()
    }

    fn compared(&self, k: &[f64], i: usize, j: usize, n: usize) -> f64 {
        if self.symmetric() { 0.5 * (k[i * n + j] + k[j * n + i]) } else { k[i * n + j] }
    }

    fn slope(&self, i: usize, j: usize, size: f64) -> f64 {
        let h = 0.5 * STEP * size;
        let at = |sign: f64| {
            let mut u = self.u.clone();
            u[j] += sign * h;
            self.answer(&u).0[i]
        };
        (at(1.0) - at(-1.0)) / (2.0 * h)
    }

    fn size(&self) -> f64 {
        let first = self.positions.first().copied().unwrap_or_default();
        let extent = self.positions.iter().map(|p| (p - first).norm()).fold(0.0, f64::max);
        if extent > 0.0 { extent } else { 1.0 }
    }

    /// A rigid motion changes no energy and turns the force. Only for elements without rotations; those with
    /// them have a test of their own.
    pub fn rigid_motion(&self) {
        if self.element.rotates() || self.positions.is_empty() {
            return;
        }
        let turn = Rotation3::new(Vector3::new(0.7, -1.1, 0.4));
        let shift = Vector3::new(3.0, -2.0, 1.0) * self.size();
        let mut moved = self.u.clone();
        for (node, x) in self.positions.iter().enumerate() {
            let u = Vector3::from_column_slice(&self.u[3 * node..3 * node + 3]);
            let to = turn * (x + u) + shift - x;
            moved[3 * node..3 * node + 3].copy_from_slice(to.as_slice());
        }
        let ((before, k), (after, _)) = (self.answer(&self.u), self.answer(&moved));
        let stiffness = k.iter().fold(0.0, |a, k| f64::max(a, k.abs()));
        // Displacements of some sizes of the element are rounded to eps, which stiffness turns into force.
        let slip = 64.0 * f64::EPSILON * self.size();
        let force = before.iter().fold(0.0, |a: f64, f| a.max(f.abs()));
        for (b, a) in before.chunks(3).zip(after.chunks(3)) {
            let turned = turn * Vector3::from_column_slice(b);
            let off = (turned - Vector3::from_column_slice(a)).norm();
            assert!(off <= stiffness * slip + 64.0 * f64::EPSILON * force, "{off} of {force}");
        }
        let change = self.work_function(&moved) - self.work_function(&self.u);
        let scale = self.work_function(&self.u).abs() + stiffness * self.size() * self.size() * 1e-3;
        assert!(change.abs() <= (force + stiffness * slip) * slip * 64.0 + 1e-12 * scale, "{change} J");
        let total: Vector3<f64> = before.chunks(3).map(Vector3::from_column_slice).sum();
        assert!(
            total.norm() <= 64.0 * f64::EPSILON * force.max(1e-300),
            "the forces do not add up to 0: {total}"
        );
    }

    /// Lumped and consistent mass are of one sum, and the consistent one is symmetric and positive.
    pub fn mass(&self) {
        let n = self.element.nodes().len();
        let (mut lumped, mut inertia, mut consistent) = (vec![0.0; n], vec![0.0; n], vec![0.0; n * n]);
        self.element.lump(&mut lumped, &mut inertia);
        self.element.consistent_mass(&mut consistent);
        let (a, b): (f64, f64) = (lumped.iter().sum(), consistent.iter().sum());
        assert!((a - b).abs() <= 8.0 * f64::EPSILON * a, "{a} kg lumped, {b} kg consistent");
        let matrix = nalgebra::DMatrix::from_row_slice(n, n, &consistent);
        assert!(matrix.clone().cholesky().is_some() && matrix == matrix.transpose());
        assert!(lumped.iter().all(|m| *m > 0.0));
    }
}
