//! A bar or cable with a law of its own: hardening, rupture. Elastic cables without rupture are in the fast kernel.

use super::segment::{Segment, add_consistent_mass, add_pair, add_vector};
use super::{Answer, Element, Energy};
use crate::element::Slack;
use crate::element::material::{HISTORY, Law};
use nalgebra::Vector3;

/// Where something breaks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rupture {
    /// Axial force [N]; infinite = never.
    pub force: f64,
    /// Strain, of the measure of the element; infinite = never.
    pub strain: f64,
}

impl Rupture {
    /// Never.
    pub const NEVER: Self = Self { force: f64::INFINITY, strain: f64::INFINITY };

    /// Whether it breaks under `force` at `strain`.
    pub fn at(&self, force: f64, strain: f64) -> bool {
        force > self.force || strain > self.strain
    }

    /// The larger of both over its limit; 0 where there is none.
    pub fn share(&self, force: f64, strain: f64) -> f64 {
        (force / self.force).max(strain / self.strain).max(0.0)
    }
}

/// A bar between two nodes, with the kinematics of [`super::Cable`]:
/// `e = (l^2 - L^2) / (2 L^2)`, `S` by its [`Law`], `f_2 = (S A / L) d`, `K_22 = (C A / L^3) d d^T + (S A / L) I`.
#[derive(Debug, Clone)]
pub struct Bar {
    /// Its two nodes.
    pub nodes: [usize; 2],
    /// From the first to the second as modelled [m].
    pub span: Vector3<f64>,
    /// Unstretched length `L` [m].
    pub length: f64,
    /// Section `A` [m2].
    pub area: f64,
    /// Density [kg/m3].
    pub density: f64,
    /// Radius that a contact sees [m].
    pub radius: f64,
    /// Stress [Pa] over Green-Lagrange strain.
    pub law: Law,
    /// When it breaks.
    pub rupture: Rupture,
}

impl Bar {
    fn segment(&self, u: &[f64]) -> (Segment, f64) {
        let segment = Segment::new(&self.span, u, 0, 1, 3);
        let strain = segment.strain(&self.span, self.length);
        (segment, strain)
    }

    fn force(&self, u: &[f64], history: &[f64]) -> f64 {
        let (segment, strain) = self.segment(u);
        self.law.stress(strain, history).stress * self.area * segment.length / self.length
    }

    fn mass(&self) -> f64 {
        self.density * self.area * self.length
    }
}

impl Element for Bar {
    fn nodes(&self) -> &[usize] {
        &self.nodes
    }

    fn start_history(&self) -> Vec<f64> {
        vec![0.0; HISTORY]
    }

    fn respond(&self, u: &[f64], history: &[f64], answer: &mut Answer) {
        let (segment, strain) = self.segment(u);
        let now = self.law.stress(strain, history);
        let q = now.stress * self.area / self.length;
        let pull = q * segment.span;
        answer.tension = q * segment.length;
        answer.history.copy_from_slice(&now.history);
        answer.force.fill(0.0);
        add_vector(answer.force, 0, &-pull);
        add_vector(answer.force, 3, &pull);
        let Some(k) = &mut answer.tangent else { return };
        k.fill(0.0);
        let (l2, rest) = (segment.length * segment.length, self.length);
        let growth = |modulus: f64| modulus * self.area * l2 / rest.powi(3);
        let gone = now.history[2] > 0.0;
        let axial = match answer.slack {
            Slack::Taut if now.slack && !gone => growth(self.law.modulus),
            // The step must stay below the critical one when plastic flow ends, too.
            Slack::Taut if !gone => growth(self.law.modulus) + q,
            _ => growth(now.modulus) + q,
        };
        let mut block = segment.tangent(axial, q * segment.length);
        if let Slack::Regularised(part) = answer.slack
            && now.slack
        {
            block += nalgebra::Matrix3::from_diagonal_element(part * self.law.modulus * self.area / rest);
        }
        add_pair(k, 6, 0, 3, &block);
    }

    fn energy(&self, u: &[f64], history: &[f64]) -> Energy {
        let (_, strain) = self.segment(u);
        let (stored, dissipated) = self.law.energy(strain, history);
        let volume = self.area * self.length;
        Energy {
            stored: volume * (stored - self.law.energy(self.segment(&[0.0; 6]).1, &[0.0; HISTORY]).0),
            dissipated: volume * dissipated,
        }
    }

    fn can_break(&self) -> bool {
        self.rupture != Rupture::NEVER
    }

    fn utilisation_bound(&self, u: &[f64], history: &[f64]) -> f64 {
        let (segment, strain) = self.segment(u);
        let elastic = self.law.trial(strain, history) * self.area * segment.length / self.length;
        self.rupture.share(elastic, strain)
    }

    fn breaks(&self, u: &[f64], history: &mut [f64]) -> bool {
        let (_, strain) = self.segment(u);
        let breaks = history[2] == 0.0 && self.rupture.at(self.force(u, history), strain);
        if breaks {
            self.law.break_off(strain, history);
        }
        breaks
    }

    fn lump(&self, mass: &mut [f64], _inertia: &mut [f64]) {
        mass.iter_mut().for_each(|m| *m += 0.5 * self.mass());
    }

    fn consistent_mass(&self, mass: &mut [f64]) {
        mass.fill(0.0);
        add_consistent_mass(mass, 2, 0, 1, self.mass());
    }

    fn lines(&self) -> Vec<[usize; 2]> {
        vec![self.nodes]
    }

    fn line_count(&self) -> usize {
        1
    }

    fn radius(&self) -> f64 {
        self.radius
    }

    fn is_broken(&self, history: &[f64]) -> bool {
        history[2] > 0.0
    }

    fn line_forces(&self, u: &[f64], history: &[f64], forces: &mut [f64]) {
        forces[0] = if history[2] > 0.0 { f64::NAN } else { self.force(u, history) };
    }

    fn utilisation(&self, u: &[f64], force: f64) -> f64 {
        self.rupture.share(force, self.segment(u).1)
    }

    fn section(&self) -> f64 {
        self.area
    }

    fn elongation(&self, u: &[f64]) -> f64 {
        self.segment(u).0.length - self.span.norm()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::element::tests::checks::{Case, random};

    fn bar(law: Law) -> Bar {
        Bar {
            nodes: [0, 1],
            span: Vector3::new(0.1, -0.07, 0.05),
            length: 0.13,
            area: 1.25e-5,
            density: 7850.0,
            radius: 0.0,
            law,
            rupture: Rupture::NEVER,
        }
    }

    fn laws() -> Vec<Law> {
        let elastic = Law::elastic(8e9, 1e7, true);
        let plastic = Law { hardening: vec![(0.0, 1e8), (0.05, 2e8)], ..elastic.clone() };
        let both_ways = Law { tension_only: false, ..plastic.clone() };
        vec![elastic, plastic, both_ways]
    }

    #[test]
    fn derivatives_rigid_motions_and_mass_are_consistent() {
        for law in laws() {
            let bar = bar(law);
            let positions = [Vector3::zeros(), bar.span];
            let mut noise = random(3);
            for _ in 0..20 {
                let u: Vec<f64> = (0..6).map(|_| 0.03 * noise()).collect();
                Case::new(&bar, &positions, &u).check_all();
            }
        }
    }

    #[test]
    fn it_pulls_like_the_cable_of_the_fast_kernel() {
        let bar = bar(Law::elastic(8e9, 1e7, true));
        let cable = crate::element::Cable {
            nodes: [0, 1],
            span: bar.span,
            length: bar.length,
            young: 8e9,
            area: bar.area,
            density: bar.density,
            prestress: 1e7,
            tension_only: true,
            radius: 0.0,
        };
        let u = [0.0, 0.0, 0.0, 0.004, -0.003, 0.002];
        let case = Case::new(&bar, &[], &u);
        let exact = cable.response(&Vector3::new(0.004, -0.003, 0.002));
        for c in 0..3 {
            assert!((case.force()[3 + c] - exact.pull[c]).abs() < 1e-12 * exact.pull.norm());
        }
        assert!((bar.energy(&u, &bar.start_history()).stored / exact.energy - 1.0).abs() < 1e-12);
    }

    #[test]
    fn it_breaks_at_its_force_and_not_before_and_loses_its_energy() {
        let mut bar = bar(Law::elastic(8e9, 0.0, true));
        let stretched = |u: f64| [0.0, 0.0, 0.0, u, 0.0, 0.0];
        bar.rupture.force =
            0.5 * (bar.force(&stretched(0.01), &[0.0; 4]) + bar.force(&stretched(0.011), &[0.0; 4]));
        let mut history = bar.start_history();
        assert!(!bar.breaks(&stretched(0.01), &mut history));
        let before = bar.energy(&stretched(0.011), &history);
        assert!(bar.breaks(&stretched(0.011), &mut history));
        let after = bar.energy(&stretched(0.02), &history);
        let (had, has) = (before.stored + before.dissipated, after.stored + after.dissipated);
        assert!((had - has).abs() < 1e-13 * had && after.dissipated > before.stored, "{before:?} {after:?}");
        assert_eq!(bar.force(&stretched(0.02), &history), 0.0);
    }
}
