//! A bar, cable or device with a law of its own: hardening, rupture. Elastic cables without rupture are in the fast kernel.

use super::segment::{Segment, add_pair, add_vector};
use super::{Answer, Element, Energy};
use crate::element::Slack;
use crate::element::material::{HISTORY, Law};
use nalgebra::{Matrix3, Vector3};

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

/// A bar, a cable or a brake: two nodes, and a force along the line between them by a [`Law`].
///
/// Over a section, with the kinematics of [`super::Cable`]: `e = (l^2 - L^2) / (2 L^2)`, `f_2 = (S A / L) d`,
/// `K_22 = (C A / L^3) d d^T + (S A / L) I`. Without one, as a device, its law has forces [N] over elongations [m]: `e = l - L`,
/// `f_2 = N t`, `K_22 = N' t t^T + N/l (I - t t^T)`; what flows is its travel. Handbook 2.6.
#[derive(Debug, Clone)]
pub struct Bar {
    /// Its two nodes.
    pub nodes: [usize; 2],
    /// From the first to the second as modelled [m].
    pub span: Vector3<f64>,
    /// Unstretched length `L`; of a device that at which its force begins [m].
    pub length: f64,
    /// Section `A` [m2]; none of a device.
    pub section: Option<f64>,
    /// Mass [kg].
    pub mass: f64,
    /// Radius that a contact sees [m].
    pub radius: f64,
    /// Stress [Pa] over Green-Lagrange strain, or force [N] over elongation [m].
    pub law: Law,
    /// When it breaks; the strain of a device is its elongation [m].
    pub rupture: Rupture,
}

impl Bar {
    /// Where its nodes are displaced by `u`, and its strain or elongation there.
    fn segment(&self, u: &[f64]) -> (Segment, f64) {
        let (segment, rest) = (Segment::new(&self.span, u, 0, 1, 3), self.length);
        if self.section.is_some() {
            return (segment, segment.strain(&self.span, rest));
        }
        // (l^2 - L^2) / (l + L): l - L without its cancellation.
        let square = self.span.norm_squared() - rest * rest + segment.growth;
        (segment, square / (segment.length + rest))
    }

    /// Axial force under what its law answers, at the length `l` [N].
    fn axial(&self, stress: f64, l: f64) -> f64 {
        self.section.map_or(stress, |area| stress * area * l / self.length)
    }

    fn force(&self, u: &[f64], history: &[f64]) -> f64 {
        let (segment, strain) = self.segment(u);
        self.axial(self.law.stress(strain, history).stress, segment.length)
    }
}

impl Element for Bar {
    fn nodes(&self) -> &[usize] {
        &self.nodes
    }

    fn start_history(&self) -> Vec<f64> {
        vec![0.0; HISTORY]
    }

    fn add_to(&self, u: &[f64], history: &[f64], answer: &mut Answer) {
        let (segment, strain) = self.segment(u);
        let now = self.law.stress(strain, history);
        let pull = match self.section {
            Some(area) => {
                let q = now.stress * area / self.length;
                answer.tension = q * segment.length;
                q * segment.span
            }
            None => {
                answer.tension = now.stress;
                now.stress * segment.direction()
            }
        };
        answer.history.copy_from_slice(&now.history);
        add_vector(answer.force, 0, &-pull);
        add_vector(answer.force, 3, &pull);
        let Some(k) = &mut answer.tangent else { return };
        let taut = answer.slack == Slack::Taut && now.history[2] == 0.0;
        // The step must stay below the critical one when plastic flow ends, too.
        let modulus = if taut { self.law.modulus } else { now.modulus };
        let axial = self.section.map_or(modulus, |area| {
            let growth = modulus * area * (segment.length * segment.length) / self.length.powi(3);
            growth + now.stress * area / self.length
        });
        let mut block = segment.tangent(axial, answer.tension);
        if let Slack::Regularised(part) = answer.slack
            && now.slack
        {
            let soft = part * self.law.modulus;
            block +=
                Matrix3::from_diagonal_element(self.section.map_or(soft, |area| soft * area / self.length));
        }
        add_pair(k, 6, 0, 3, &block);
    }

    fn energy(&self, u: &[f64], history: &[f64]) -> Energy {
        let (stored, dissipated) = self.law.energy(self.segment(u).1, history);
        let modelled = self.law.energy(self.segment(&[0.0; 6]).1, &[0.0; HISTORY]).0;
        let volume = self.section.map_or(1.0, |area| area * self.length);
        Energy { stored: volume * (stored - modelled), dissipated: volume * dissipated }
    }

    fn can_break(&self) -> bool {
        self.rupture != Rupture::NEVER
    }

    fn utilisation_bound(&self, u: &[f64], history: &[f64]) -> f64 {
        let (segment, strain) = self.segment(u);
        self.rupture.share(self.axial(self.law.trial(strain, history), segment.length), strain)
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
        mass.iter_mut().for_each(|m| *m += 0.5 * self.mass);
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
        self.section.unwrap_or(0.0)
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
            section: Some(1.25e-5),
            mass: 7850.0 * 1.25e-5 * 0.13,
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
                Case::new(&bar, &positions, &u).check_all(7850.0 * 1.25e-5 * 0.13);
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
            of: crate::element::cable_properties::CableConfig {
                young: 8e9,
                area: 1.25e-5,
                density: 7850.0,
                prestress: 1e7,
                tension_only: true,
                radius: 0.0,
            },
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
