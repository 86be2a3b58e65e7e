//! A bar, cable or device with a law of its own: hardening, rupture. And parts of them: energy-dissipating devices, force over
//! elongation by a table, plastic, with an end stop, are [`Bar`]s without a section; cables are [`Bar`]s, or [`Cable`]s of the
//! fast kernel where they are elastic and never break.

use super::cable::{Cable, CableConfig, Stated};
use super::part::{Key, NewElements, PartCell, PartSettings, Surroundings, is_zero, part};
use super::rope::Rope;
use super::segment::{Segment, add_pair, add_vector};
use super::{Answer, Constants, Element, Energy, Pace};
use crate::element::Slack;
use crate::element::material::{HISTORY, Law, Rupture};
use crate::read::mesh::Kind;
use interface_defs::ShareOf;
use interface_defs::diagnostic::{Diagnostic, code};
use nalgebra::{Matrix3, Vector3};

/// A bar, a cable or a brake: two nodes, and a force along the line between them by a [`Law`].
///
/// Over a section, with the kinematics of [`super::Cable`]: `e = (l^2 - L^2) / (2 L^2)`, `f_2 = (S A / L) d`,
/// `K_22 = (C A / L^3) d d^T + (S A / L) I`. Without one, as a device, its law has forces [N] over elongations [m]: `e = l - L`,
/// `f_2 = N t`, `K_22 = N' t t^T + N/l (I - t t^T)`; what flows is its travel.
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

/// Mass of a brake from which on something is said [kg].
const HEAVIEST_BRAKE: f64 = 500.0;

impl Bar {
    /// The line between its nodes displaced by `u`, and its strain or elongation there.
    fn segment(&self, u: &[f64]) -> (Segment, f64) {
        let (segment, rest) = (Segment::new(&self.span, u, 0, 1), self.length);
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

    /// Whether it is a brake that gives way.
    pub fn is_brake(&self) -> bool {
        self.section.is_none() && !self.law.hardening.is_empty()
    }

    fn force(&self, u: &[f64], history: &[f64]) -> f64 {
        let (segment, strain) = self.segment(u);
        self.axial(self.law.held(strain, history), segment.length)
    }
}

impl Element for Bar {
    fn nodes(&self) -> &[usize] {
        &self.nodes
    }

    fn constants(&self) -> Constants {
        let (can_break, broken) = (self.rupture != Rupture::NEVER, Some(2));
        let (radius, section) = (self.radius, self.section.unwrap_or(0.0));
        Constants { can_break, broken, lines: 1, forces: 1, radius, section, ..Constants::default() }
    }

    fn start_history(&self) -> Vec<f64> {
        vec![0.0; HISTORY]
    }

    fn add_to(&self, pace: Pace, u: &[f64], history: &[f64], answer: &mut Answer) {
        let (segment, strain) = self.segment(u);
        let now = self.law.stress_at(pace.rate, strain, history);
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

    fn line_forces(&self, u: &[f64], history: &[f64], forces: &mut [f64]) {
        forces[0] = if history[2] > 0.0 { f64::NAN } else { self.force(u, history) };
    }

    fn force_utilisation(&self, u: &[f64], force: f64) -> f64 {
        // A strain for nothing, where it is no matter.
        self.rupture.share(force, if self.rupture.strain.is_finite() { self.segment(u).1 } else { 0.0 })
    }

    fn utilisation(&self, u: &[f64], force: f64, history: &[f64]) -> (f64, ShareOf) {
        let (of_force, of_travel) = (self.force_utilisation(u, force), history[1] / self.law.limit);
        if of_travel > of_force { (of_travel, ShareOf::Travel) } else { (of_force, ShareOf::Force) }
    }

    fn elongation(&self, u: &[f64]) -> f64 {
        self.segment(u).0.length - self.span.norm()
    }
}

part! {
    /// Energy-dissipating devices between two nodes.
    BrakePart: "brakes", (2, 2) nodes, Line2 {
        /// Stiffness before it yields, on unloading, and beyond its stroke [N/m].
        stiffness: f64,
        /// Curve of a slow test: rows `[elongation, force]` [m, N], the first where it yields, at
        /// `force / stiffness` or more; constant beyond the last. Empty: elastic.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        curve: Vec<[f64; 2]>,
        /// What speed does: rows `[speed of the travel, force over that of the curve]` [m/s, -], both increasing, straight from
        /// `[0.0, 1.0]` on and between, constant beyond the last. Default: nothing.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        speed: Vec<[f64; 2]>,
        /// Plastic travel at which it comes to its end stop [m]. Default: none.
        stroke: Option<f64>,
        /// Mass of each [kg]. Default 0.
        #[serde(default, skip_serializing_if = "is_zero")]
        mass: f64,
        /// Length at which its force begins [m]. Default the distance of its nodes.
        length: Option<f64>,
        /// Whether it carries no compression. Default true.
        #[serde(default = "crate::element::cable::yes")]
        tension_only: bool,
    }
}

impl BrakePart {
    /// Force [N] over plastic travel [m]: the curve less the elastic share of its elongations, which is given back on
    /// unloading.
    fn hardening(&self, key: &Key) -> Result<Vec<(f64, f64)>, Diagnostic> {
        let mut hardening: Vec<(f64, f64)> = Vec::new();
        for row in &self.curve {
            let travel = row[0] - row[1] / self.stiffness;
            let before = hardening.last().map_or(0.0, |(a, _)| *a);
            let least = -1e-9 * row[0].abs();
            if travel < before + least || (!hardening.is_empty() && travel <= before) {
                let ([length, force], elastic) = (*row, row[1] / self.stiffness);
                let what = format!(
                    "under {force} N the stiffness alone gives an elongation of {elastic} m, the curve says {length} m: its travel must grow"
                );
                return key.refuse("curve", what, "a larger stiffness");
            }
            if hardening.is_empty() {
                hardening.push((0.0, row[1]));
                if travel <= 1e-9 * row[0] {
                    continue;
                }
            }
            hardening.push((travel, row[1]));
        }
        Ok(hardening)
    }

    /// Refuse speeds that do not grow, and forces that fall with them.
    fn check_speed(&self, key: &Key) -> Result<(), Diagnostic> {
        let mut before = [0.0, 1.0];
        for row in &self.speed {
            if !(row[0] > before[0] && row[1] >= before[1] && row[1].is_finite()) {
                let what = format!(
                    "the row [{}, {}] follows [{}, {}]: speeds must grow from above 0, factors from 1 without falling",
                    row[0], row[1], before[0], before[1]
                );
                return key.refuse(
                    "speed",
                    what,
                    "rows are [speed in m/s, force over the slow one]: [[5.0, 1.2]]",
                );
            }
            before = *row;
        }
        if !self.speed.is_empty() && self.curve.is_empty() {
            return key.refuse(
                "speed",
                "speed acts on the curve, and there is none",
                "add `curve`, or leave `speed` out",
            );
        }
        Ok(())
    }

    /// Refuse a curve that the prestress of a rope at the brake exceeds from the start; what its forces may not have meant.
    fn judge_curve(&self, at: &Surroundings) -> Result<Vec<Diagnostic>, Diagnostic> {
        let (key, most) = (&at.key.key, self.curve.iter().map(|row| row[1]).fold(0.0, f64::max));
        if let Some((rope, pull)) = (at.pulled)().filter(|(_, pull)| most > 0.0 && most <= *pull) {
            let what = format!(
                "curve: the brake gives way under {most} N at most, and the prestress of `{rope}`, which ends at it, \
                 alone is {pull:.4e} N"
            );
            return Err(at
                .key
                .invalid("curve", what)
                .try_instead("rows are [elongation in m, force in N]: 120 kN is 1.2e5; or less prestress"));
        }
        let mut warnings = Vec::new();
        if most > 0.0 && most < 1e3 {
            let what = format!("the brake gives way under {most} N at most");
            let about = Diagnostic::warning(code::LIKELY_UNIT, what).about(format!("{key}.curve"));
            warnings.push(about.try_instead("120 kN is 1.2e5"));
        }
        if let (Some(force), Some(first)) = (self.rupture_force, self.curve.first())
            && force <= first[1]
        {
            let what = format!("the brake breaks under {force} N, before it gives way under {} N", first[1]);
            let about = Diagnostic::warning(code::UNUSUAL_VALUE, what);
            warnings.push(about.about(format!("{key}.rupture_force")));
        }
        Ok(warnings)
    }
}

impl PartSettings for BrakePart {
    fn build(&self, cell: &PartCell, made: &mut NewElements) -> Result<(), Diagnostic> {
        let key = cell.key;
        let or_one = |stated: Option<f64>| stated.unwrap_or(1.0);
        let (length, stroke) = (or_one(self.length), or_one(self.stroke));
        key.positive(&[
            ("stiffness", self.stiffness, "N/m"),
            ("length", length, "m"),
            ("stroke", stroke, "m"),
        ])?;
        key.not_negative(&[("mass", self.mass, "kg"), ("radius", self.radius.unwrap_or(0.0), "m")])?;
        key.check_table("curve", &self.curve)?;
        let hardening = self.hardening(key)?;
        self.check_speed(key)?;
        let speeds = self.speed.iter().map(|row| (row[0], row[1])).collect();
        let limit = self.stroke.unwrap_or(f64::INFINITY);
        let span = cell.spans()[0];
        let brake = Bar {
            nodes: cell.ends(),
            span,
            length: self.length.unwrap_or(span.norm()),
            section: None,
            mass: self.mass,
            radius: self.radius.unwrap_or(0.0),
            law: Law { hardening, limit, speeds, ..Law::elastic(self.stiffness, 0.0, self.tension_only) },
            rupture: key.rupture(self.rupture_force, None)?,
        };
        made.elements.push(brake.into());
        Ok(())
    }

    fn judge(&self, at: &Surroundings) -> Result<Vec<Diagnostic>, Diagnostic> {
        let travel = self.curve.last().map_or(0.0, |row| row[0]);
        for (name, value) in [("stroke", self.stroke.unwrap_or(0.0)), ("curve", travel)] {
            if value > 10.0 * at.extent {
                return Err(at.too_long(name, value, "the whole structure has an extent of", at.extent));
            }
        }
        let mut warnings = self.judge_curve(at)?;
        if self.mass > HEAVIEST_BRAKE {
            let what = format!("a brake of {} kg: those of barriers have 5 to 50 kg", self.mass);
            let about = Diagnostic::warning(code::UNUSUAL_VALUE, what).about(at.key.at("mass"));
            warnings.push(about.try_instead("it is written in kg"));
        }
        Ok(warnings)
    }
}

part! {
    /// Cables or bars, one after the other along each cell, with hardening and rupture where stated. A triangle
    /// or quadrilateral of a mesh is a closed polygon of them, the wire of a ring; so is a cell whose last
    /// node is its first. Neighbours share nodes, never cables. `young` to `tension_only`, and `radius`: default what
    /// `[structure.cable]` says.
    CablePart: "cables", (2, usize::MAX) nodes, Line2 | Row | Tri3 | Quad4 {
        /// A wire rope from its catalogue, in place of `young`, `area`, `density`, `radius` and `rupture_force`; those of them that are
        /// stated go before.
        rope: Option<Rope>,
        /// Young's modulus [Pa].
        young: Option<f64>,
        /// Section [m2].
        area: Option<f64>,
        /// Density [kg/m3].
        density: Option<f64>,
        /// Second Piola-Kirchhoff stress at the unstretched length [Pa]; below 0: slack.
        prestress: Option<f64>,
        /// Whether they carry no compression.
        tension_only: Option<bool>,
        /// Unstretched length of each [m]. Default the distance of its nodes.
        length: Option<f64>,
        /// Hardening: rows `[plastic strain, yield stress]` [-, Pa], the first at 0, constant beyond the
        /// last. Default none: elastic.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        hardening: Vec<[f64; 2]>,
        /// Green-Lagrange strain at which one breaks. Default: never.
        rupture_strain: Option<f64>,
    }
}

impl CablePart {
    /// Fill in what its rope says.
    pub fn complete(&mut self) {
        let Self { rope, young, area, density, radius, rupture_force, .. } = self;
        if let Some(rope) = rope {
            rope.complete([young, area, density, radius, rupture_force]);
        }
    }

    /// The properties of each that it states itself.
    pub fn stated(&self) -> Stated {
        let Self { young, area, density, prestress, tension_only, radius, .. } = *self;
        Stated { young, area, density, prestress, tension_only, radius }
    }

    /// Properties and rupture of its cables, checked.
    fn check(&self, key: &Key, common: Option<&CableConfig>) -> Result<(CableConfig, Rupture), Diagnostic> {
        self.rope.map_or(Ok(()), |rope| rope.check(key))?;
        let own = self.stated().complete(key, common)?;
        key.positive(&[("length", self.length.unwrap_or(1.0), "m")])?;
        key.check_table("hardening", &self.hardening)?;
        if self.hardening.first().is_some_and(|row| row[0] != 0.0) {
            return Err(key.invalid("hardening", "the first row must be at the plastic strain 0"));
        }
        if let Some([_, yields]) =
            self.hardening.first().filter(|row| row[1] < LEAST_YIELD_STRAIN * own.young)
        {
            let what = format!(
                "it yields at {yields} Pa, stretched by {:.1e}: nothing made of wire does",
                yields / own.young
            );
            let hint = format!("stresses in Pa; were it in MPa, it would be {:e} Pa", 1e6 * yields);
            return Err(key.invalid("hardening", what).try_instead(hint));
        }
        Ok((own, key.rupture(self.rupture_force, self.rupture_strain)?))
    }
}

/// No wire, rope or strand yields below that strain; soft copper does at some 3e-4.
const LEAST_YIELD_STRAIN: f64 = 1e-6;

impl PartSettings for CablePart {
    fn closes(&self, kind: Kind) -> bool {
        matches!(kind, Kind::Tri3 | Kind::Quad4)
    }

    fn build(&self, cell: &PartCell, made: &mut NewElements) -> Result<(), Diagnostic> {
        let (own, rupture) = self.check(cell.key, cell.common)?;
        for pair in cell.nodes.windows(2) {
            let cable = own.cable(cell.positions, [pair[0], pair[1]], self.length);
            if self.hardening.is_empty() && rupture == Rupture::NEVER {
                made.cables.push(cable);
                continue;
            }
            let hardening = self.hardening.iter().map(|row| (row[0], row[1])).collect();
            let law = Law { hardening, ..Law::elastic(own.young, own.prestress, own.tension_only) };
            let Cable { nodes, span, length, of: CableConfig { area, density, radius, .. } } = cable;
            let (section, mass) = (Some(area), density * area * length);
            made.elements.push(Bar { nodes, span, length, section, mass, radius, law, rupture }.into());
        }
        Ok(())
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
            of: CableConfig {
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

#[cfg(test)]
mod brake_tests {
    use super::*;
    use crate::element::tests::checks::{Case, random};

    fn brake() -> Bar {
        Bar {
            nodes: [0, 1],
            span: Vector3::new(0.6, 0.0, 0.8),
            length: 1.0,
            section: None,
            mass: 5.0,
            radius: 0.0,
            law: Law { hardening: vec![(0.0, 5e4), (0.5, 1e5)], limit: 0.5, ..Law::elastic(5e6, 0.0, true) },
            rupture: Rupture::NEVER,
        }
    }

    #[test]
    fn derivatives_rigid_motions_and_mass_are_consistent() {
        let brake = brake();
        let mut noise = random(5);
        for _ in 0..40 {
            let size = if noise() > 0.0 { 0.4 } else { 0.01 };
            let u: Vec<f64> = (0..6).map(|_| size * noise()).collect();
            Case::new(&brake, &[Vector3::zeros(), brake.span], &u).check_all(5.0);
        }
    }

    #[test]
    fn it_dissipates_its_table_and_stiffens_at_its_stop() {
        let brake = brake();
        let pulled = |u: f64| [0.0, 0.0, 0.0, 0.6 * u, 0.0, 0.8 * u];
        let answer = |u: f64| {
            let (mut force, mut history) = (vec![0.0; 6], brake.start_history());
            let mut answer = Answer {
                force: &mut force,
                tangent: None,
                slack: Slack::Exact,
                history: &mut history,
                tension: 0.0,
            };
            brake.respond(Pace::default(), &pulled(u), &[0.0; 4], &mut answer);
            (answer.tension, answer.history[1])
        };
        // Travel ends at 0.5 m under 1e5 N: elongation 0.5 + 1e5 / 5e6. Beyond, k again.
        let (force, travel) = answer(0.52 + 0.01);
        assert!((travel - 0.5).abs() < 1e-15 && (force - 1.5e5).abs() < 1e-6, "{force} {travel}");
        let energy = brake.energy(&pulled(0.53), &[0.0; 4]);
        assert!((energy.dissipated - 0.5 * 7.5e4).abs() < 1e-8, "{energy:?}");
    }
}
