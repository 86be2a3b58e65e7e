//! Fibres along a beam that yield: stretch and bending of both planes at once, by the uniaxial law of each fibre.
//!
//! Sections stand at the three points of Lobatto's rule, `x` = 0, 1/2, 1 of the length. With `v` what of the strain the ends do
//! not say, the strains of a section (stretch, and curvature in each plane) are
//!
//! ```text
//! e = s / L + v_1 (1 - 2 x) + v_2 f(x)                          f = 2, -1, 2
//! k = ((6 x - 4) y_1 + (6 x - 2) y_2) / L + v f(x)              in each plane
//! W = min over v of L sum w sum A psi(e + a k_a + b k_b)        psi: work of the law from the history
//! ```
//!
//! Without `v` the ends bend it as an elastic beam. The sections decide `v` so that `W` is least: then the axial force is the same
//! in all of them and the moments run straight between the ends, as balance asks for, however far each has yielded. One element
//! bears its plastic moment exactly, where one without `v` bears a fifth of its length over the lever more. As `W` is least,
//! its derivatives are forces and a symmetric tangent.
//!
//! Source: Spacone, Filippou, Taucer (1996), Earthquake Eng. Struct. Dyn. 25, 711 (sections in balance with the ends).

use super::material::Law;
use super::section::{Fibre, Section};
use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

/// Deformations that the ends say: stretch [m], turn of each end in the first plane, in the second [rad].
pub const ENDS: usize = 5;
/// Those that the sections decide, and all.
const INNER: usize = 4;
const ALL: usize = ENDS + INNER;
/// Place along the beam, weight, and the two shapes of what the sections decide.
const POINTS: [(f64, f64, f64, f64); 3] =
    [(0.0, 1.0 / 6.0, 1.0, 2.0), (0.5, 4.0 / 6.0, 0.0, -1.0), (1.0, 1.0 / 6.0, -1.0, 2.0)];
/// Sections are in balance to this share of what the elastic section would bear at a strain of 1.
const BALANCED: f64 = 1e-15;
/// Most iterations; the energy is convex, and some three are taken.
const MOST: usize = 60;
/// Least slope of a fibre over its modulus: where all flow without hardening, there is a direction to go on.
const LEAST_SLOPE: f64 = 1e-8;
/// Numbers of a fibre in the history: plastic strain, and its accumulated magnitude.
const OF_FIBRE: usize = 2;

/// The fibres of a beam.
#[derive(Debug, Clone)]
pub struct Fibres {
    /// Its section.
    pub section: Section,
    /// The law of each fibre.
    pub law: Law,
    /// Stress up to which none flows, however far it has flowed: it hardens, or flows on [Pa].
    elastic_limit: f64,
    /// Their largest distance from the middle along each cross axis [m].
    reach: [f64; 2],
    /// Force and moments of the section by its strains while nothing flows [N, N m2].
    elastic: Matrix3<f64>,
}

/// First and second derivative of the work by all deformations.
struct Derivatives {
    force: SVector<f64, ALL>,
    stiffness: SMatrix<f64, ALL, ALL>,
    /// Whether any fibre flows on the way there.
    flows: bool,
}

/// Forces at the ends, and their derivative.
#[derive(Debug, Clone, Copy)]
pub struct Resultants {
    /// Axial force [N], moments at the ends in the first plane, in the second [N m].
    pub force: [f64; ENDS],
    /// Their derivative by the deformations.
    pub stiffness: [[f64; ENDS]; ENDS],
}

impl Fibres {
    /// The fibres of a section, all by one law.
    pub fn new(section: Section, law: Law) -> Self {
        let of = |fibre: &Fibre| fibre.area * fibre.place() * fibre.place().transpose();
        let (reach, elastic) =
            (section.reach(), law.modulus * section.fibres.iter().map(of).sum::<Matrix3<f64>>());
        let elastic_limit = law.yield_stress(0.0);
        Self { section, law, elastic_limit, reach, elastic }
    }

    /// Numbers in the history: the largest plastic strain of any fibre, what the sections decide, and those of each fibre.
    pub fn history_len(&self) -> usize {
        1 + INNER + POINTS.len() * OF_FIBRE * self.section.fibres.len()
    }

    /// Whether nothing flows at the deformations `ends` of a beam of the length `rest` [m], nor has flowed.
    pub fn is_elastic(&self, ends: &[f64; ENDS], rest: f64, history: &[f64]) -> bool {
        let strain = self.elastic_strain(ends, rest);
        history[0] == 0.0 && self.law.modulus * strain <= self.law.yield_stress(0.0)
    }

    /// An upper bound of the strain of its fibres at the deformations `ends` where none flows.
    fn elastic_strain(&self, ends: &[f64; ENDS], rest: f64) -> f64 {
        let [stretch, y1, y2, z1, z2] = *ends;
        let most = |a: f64, b: f64| (4.0 * a + 2.0 * b).abs().max((2.0 * a + 4.0 * b).abs());
        let [a, b] = self.reach;
        (stretch.abs() + a * most(y1, y2) + b * most(z1, z2)) / rest
    }

    /// Largest tensile strain of any fibre at the deformations `ends`; where nothing flows, an upper bound of it.
    pub fn largest_strain(&self, ends: &[f64; ENDS], rest: f64, history: &[f64]) -> f64 {
        if self.is_elastic(ends, rest, history) {
            return self.elastic_strain(ends, rest);
        }
        let (x, mut most) = (self.balance(ends, rest, history).0, 0.0);
        self.each(&x, rest, history, |_, strain, _| most = f64::max(most, strain));
        most
    }

    /// Forces at the deformations `ends`, and what the history becomes.
    pub fn respond(
        &self,
        ends: &[f64; ENDS],
        rest: f64,
        history: &[f64],
        after: Option<&mut [f64]>,
    ) -> Resultants {
        let (x, Derivatives { force, stiffness: k, flows }) = self.balance(ends, rest, history);
        if let Some(after) = after {
            after.copy_from_slice(history);
            after[1..][..INNER].copy_from_slice(&x.as_slice()[ENDS..]);
            if flows {
                after[0] = self.flow(&x, rest, history, &mut after[1 + INNER..]).max(history[0]);
            }
        }
        let inner = k.fixed_view::<INNER, INNER>(ENDS, ENDS).into_owned();
        let mixed = k.fixed_view::<INNER, ENDS>(ENDS, 0).into_owned();
        let ends = k.fixed_view::<ENDS, ENDS>(0, 0).into_owned();
        let stiffness = inner.cholesky().map_or(ends, |root| ends - mixed.transpose() * root.solve(&mixed));
        Resultants {
            force: std::array::from_fn(|i| force[i]),
            stiffness: std::array::from_fn(|i| std::array::from_fn(|j| stiffness[(i, j)])),
        }
    }

    /// Energy stored and dissipated at the deformations `ends` [J].
    pub fn energy(&self, ends: &[f64; ENDS], rest: f64, history: &[f64]) -> (f64, f64) {
        let (x, _) = self.balance(ends, rest, history);
        let (mut stored, mut dissipated) = (0.0, 0.0);
        self.each(&x, rest, history, |volume, strain, own| {
            let (kept, lost) = self.law.energy(strain, own);
            stored += volume * kept;
            dissipated += volume * lost;
        });
        (stored, dissipated)
    }

    /// The deformations with those that the sections decide, and the derivatives of the work there.
    fn balance(&self, ends: &[f64; ENDS], rest: f64, history: &[f64]) -> (SVector<f64, ALL>, Derivatives) {
        let mut x = SVector::<f64, ALL>::zeros();
        x.as_mut_slice()[..ENDS].copy_from_slice(ends);
        x.as_mut_slice()[ENDS..].copy_from_slice(&history[1..][..INNER]);
        let axial = self.elastic[(0, 0)] * rest;
        let [a, b] = self.reach;
        let scales = [axial, axial, axial * a, axial * b];
        let inner = |of: &SVector<f64, ALL>| of.fixed_rows::<INNER>(ENDS).into_owned();
        let mut sums = self.sums(&x, rest, history);
        for _ in 0..MOST {
            let (mut left, k) = (inner(&sums.force), &sums.stiffness);
            if left.iter().zip(scales).all(|(left, scale)| left.abs() <= BALANCED * scale) {
                break;
            }
            let Some(root) = k.fixed_view::<INNER, INNER>(ENDS, ENDS).into_owned().cholesky() else { break };
            let way = root.solve(&-left);
            let (before, start) = (way.dot(&left), inner(&x));
            let mut part = 1.0;
            loop {
                x.fixed_rows_mut::<INNER>(ENDS).copy_from(&(start + part * way));
                sums = self.sums(&x, rest, history);
                left = inner(&sums.force);
                // Convex: the least lies where the work along the way is 0, and less of the way is enough where it is far beyond.
                if way.dot(&left) <= -0.5 * before || part < 1e-6 {
                    break;
                }
                part *= 0.5;
            }
        }
        (x, sums)
    }

    /// First and second derivative of the work by all deformations.
    fn sums(&self, x: &SVector<f64, ALL>, rest: f64, history: &[f64]) -> Derivatives {
        let (mut force, mut stiffness, mut flows) = (SVector::zeros(), SMatrix::zeros(), false);
        let mut histories = history[1 + INNER..].chunks_exact(OF_FIBRE * self.section.fibres.len());
        let modulus = self.law.modulus;
        for (point, own) in POINTS.iter().zip(&mut histories) {
            let shape = strains(point, rest);
            let strain = shape * x;
            let (mut s, mut k) = (Vector3::zeros(), self.elastic);
            for (fibre, own) in self.section.fibres.iter().zip(own.as_chunks::<OF_FIBRE>().0) {
                let place = fibre.place();
                let strain = place.dot(&strain);
                let trial = modulus * (strain - own[0]);
                if trial.abs() <= self.elastic_limit {
                    s += fibre.area * trial * place;
                    continue;
                }
                let now = self.law.stress(strain, &[own[0], own[1], 0.0, 0.0]);
                s += fibre.area * now.stress * place;
                if now.modulus < modulus {
                    flows = true;
                    let less = modulus - now.modulus.max(LEAST_SLOPE * modulus);
                    k -= fibre.area * less * place * place.transpose();
                }
            }
            force += point.1 * rest * shape.transpose() * s;
            stiffness += point.1 * rest * shape.transpose() * (k * shape);
        }
        Derivatives { force, stiffness, flows }
    }

    /// Show `take` the volume [m3] of each fibre, its strain and its history.
    fn each(
        &self,
        x: &SVector<f64, ALL>,
        rest: f64,
        history: &[f64],
        mut take: impl FnMut(f64, f64, &[f64; 4]),
    ) {
        let mut fibres = history[1 + INNER..].chunks_exact(OF_FIBRE);
        for point in &POINTS {
            let strain = strains(point, rest) * x;
            for (fibre, own) in self.section.fibres.iter().zip(&mut fibres) {
                let strain = strain[0] + fibre.at[0] * strain[1] + fibre.at[1] * strain[2];
                take(point.1 * rest * fibre.area, strain, &[own[0], own[1], 0.0, 0.0]);
            }
        }
    }

    /// Write the histories of all fibres; returns the largest accumulated plastic strain.
    fn flow(&self, x: &SVector<f64, ALL>, rest: f64, history: &[f64], after: &mut [f64]) -> f64 {
        let (mut most, mut after) = (0.0, after.chunks_exact_mut(OF_FIBRE));
        self.each(x, rest, history, |_, strain, own| {
            let now = self.law.stress(strain, own).history;
            most = f64::max(most, now[1]);
            if let Some(after) = after.next() {
                after.copy_from_slice(&now[..OF_FIBRE]);
            }
        });
        most
    }
}

/// Stretch and curvatures of a section of a beam of the length `rest` [m], over all deformations.
fn strains(&(x, _, first, second): &(f64, f64, f64, f64), rest: f64) -> SMatrix<f64, 3, ALL> {
    let [start, end] = [(6.0 * x - 4.0) / rest, (6.0 * x - 2.0) / rest];
    let mut shape = SMatrix::<f64, 3, ALL>::zeros();
    let along = [(0, 0, 1.0 / rest), (0, 5, first), (0, 6, second)];
    let about = [(1, 1, start), (1, 2, end), (1, 7, second), (2, 3, start), (2, 4, end), (2, 8, second)];
    along.into_iter().chain(about).for_each(|(row, column, slope)| shape[(row, column)] = slope);
    shape
}
