//! What every element must pass: derivatives, rigid motions, mass, patch.

use crate::element::Slack;
use crate::element::turn::{self, TURN};
use crate::element::{Answer, Element, Pace};
use nalgebra::{UnitQuaternion, Vector3};

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
        self.answer_from(u, &self.history, Slack::Exact)
    }

    fn answer_from(&self, u: &[f64], history: &[f64], slack: Slack) -> (Vec<f64>, Vec<f64>) {
        let n = u.len();
        let (mut force, mut tangent) = (vec![f64::NAN; n], vec![f64::NAN; n * n]);
        let mut after = history.to_vec();
        let mut answer = Answer {
            force: &mut force,
            tangent: Some(&mut tangent),
            slack,
            history: &mut after,
            tension: 0.0,
        };
        self.element.respond(Pace::default(), u, history, &mut answer);
        (force, tangent)
    }

    /// Internal force.
    pub fn force(&self) -> Vec<f64> {
        self.answer(&self.u).0
    }

    fn work_function(&self, u: &[f64]) -> f64 {
        self.work_function_from(u, &self.history)
    }

    fn work_function_from(&self, u: &[f64], history: &[f64]) -> f64 {
        let energy = self.element.energy(u, history);
        energy.stored + energy.dissipated
    }

    /// Every check of an element of so much mass [kg].
    pub fn check_all(&self, mass: f64) {
        self.derivatives();
        self.rigid_motion();
        self.mass(mass);
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
                let mirrored = [2.0, 1.0].map(|part| self.slope(j, i, part * size));
                if self.symmetric() && (mirrored[0] - mirrored[1]).abs() > 1e-5 * stiffness {
                    continue;
                }
                let slope = if self.symmetric() { 0.5 * (forces[i] + mirrored[1]) } else { *slope };
                assert!((slope - k).abs() <= 2e-5 * stiffness, "df_{i}/du_{j} = {slope}, tangent {k}");
            }
        }
    }

    /// Rotations: moments are those in space, whose derivative is symmetric but for half a moment.
    fn symmetric(&self) -> bool {
        self.element.constants().rotates
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

    /// A rigid motion changes no energy and turns forces and moments, which are in balance.
    pub fn rigid_motion(&self) {
        let turn = UnitQuaternion::new(Vector3::new(0.7, -1.1, 0.4));
        let shift = Vector3::new(3.0, -2.0, 1.0) * self.size();
        let per_node = if self.element.constants().rotates { 6 } else { 3 };
        let (mut moved, mut history) = (self.u.clone(), self.history.clone());
        for (node, x) in self.positions.iter().enumerate() {
            let to = turn * (x + vector(&self.u, per_node * node)) + shift - x;
            moved[per_node * node..][..3].copy_from_slice(to.as_slice());
            if self.element.constants().rotates {
                // What was turned since the last commit, and then as a whole.
                let q = turn * turn::rotation(&self.u, &self.history, node);
                let own = &mut history[node * TURN..][..TURN];
                own[..3].copy_from_slice(&self.u[6 * node + 3..6 * node + 6]);
                own[3..].copy_from_slice(&[q.w, q.i, q.j, q.k]);
            }
        }
        let (before, k) = self.answer(&self.u);
        let (after, _) = self.answer_from(&moved, &history, Slack::Exact);
        let stiffness = k.iter().fold(0.0, |a, k| f64::max(a, k.abs()));
        // Displacements of some sizes of the element are rounded to eps, which stiffness turns into force; so are the
        // terms whose differences an element takes.
        let slip = 64.0 * f64::EPSILON * self.size().max(1.0);
        let force = before.iter().fold(self.element.coarseness(), |a: f64, f| a.max(f.abs()));
        let rounding = stiffness * slip + 64.0 * f64::EPSILON * force;
        for (b, a) in before.chunks(3).zip(after.chunks(3)) {
            let off = (turn * vector(b, 0) - vector(a, 0)).norm();
            assert!(off <= rounding, "{off} of {force}");
        }
        let change = self.work_function_from(&moved, &history) - self.work_function(&self.u);
        let scale = self.work_function(&self.u).abs() + stiffness * self.size() * self.size() * 1e-3;
        assert!(change.abs() <= rounding * slip * 64.0 + 1e-12 * scale, "{change} J");
        let (mut total, mut moment) = (Vector3::zeros(), Vector3::zeros());
        for (node, x) in self.positions.iter().enumerate() {
            let (at, f) = (x + vector(&self.u, per_node * node), vector(&before, per_node * node));
            total += f;
            moment += at.cross(&f);
            if self.element.constants().rotates {
                moment += vector(&before, 6 * node + 3);
            }
        }
        assert!(
            total.norm() <= 64.0 * f64::EPSILON * force.max(1e-300),
            "forces do not add up to 0: {total}"
        );
        let arms = 4.0 * self.size().max(1.0);
        assert!(
            moment.norm() <= rounding * arms + 1e-300,
            "moments do not add up to 0: {moment}, {rounding}"
        );
    }

    /// Nodes carry the whole mass, and each a part of it.
    pub fn mass(&self, whole: f64) {
        let n = self.element.nodes().len();
        let (mut lumped, mut inertia) = (vec![0.0; n], vec![0.0; n]);
        self.element.lump(&mut lumped, &mut inertia);
        let sum: f64 = lumped.iter().sum();
        assert!((sum - whole).abs() <= 8.0 * f64::EPSILON * whole, "{sum} kg lumped of {whole} kg");
        assert!(lumped.iter().all(|m| *m > 0.0));
    }
}

fn vector(of: &[f64], at: usize) -> Vector3<f64> {
    Vector3::new(of[at], of[at + 1], of[at + 2])
}

/// Patch test: elements of any shape under displacements `u` of all nodes, from their first histories, with every node's
/// rotation as it says. Nodes of `inner` are in balance where that is a state of constant strain. Returns the largest force or
/// moment there over the largest one of any element.
pub fn patch(elements: &[&dyn Element], u: &[f64], turns: &[UnitQuaternion<f64>], inner: &[usize]) -> f64 {
    let per_node = if elements[0].constants().rotates { 6 } else { 3 };
    let mut sum = vec![0.0; u.len()];
    let mut largest = 0.0_f64;
    for element in elements {
        let nodes = element.nodes();
        let own: Vec<f64> = nodes.iter().flat_map(|n| u[per_node * n..][..per_node].to_vec()).collect();
        let mut history = element.start_history();
        if element.constants().rotates {
            for (place, node) in nodes.iter().enumerate() {
                let q = turns[*node];
                history[place * TURN + 3..][..4].copy_from_slice(&[q.w, q.i, q.j, q.k]);
            }
        }
        let mut after = history.clone();
        let mut force = vec![0.0; own.len()];
        let mut answer = Answer {
            force: &mut force,
            tangent: None,
            slack: Slack::Exact,
            history: &mut after,
            tension: 0.0,
        };
        element.respond(Pace::default(), &own, &history, &mut answer);
        largest = force.iter().fold(largest, |a, f| a.max(f.abs()));
        for (place, node) in nodes.iter().enumerate() {
            for c in 0..per_node {
                sum[per_node * node + c] += force[per_node * place + c];
            }
        }
    }
    assert!(largest > 0.0, "nothing is strained");
    let left = inner.iter().flat_map(|n| &sum[per_node * n..][..per_node]);
    left.fold(0.0_f64, |a, f| a.max(f.abs())) / largest
}
