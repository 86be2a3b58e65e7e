//! Energy-dissipating devices between two nodes: force over elongation by a table, plastic, with an end stop. As an element each
//! is a [`Bar`] without a section.

use super::Bar;
use super::part::{Key, NewElements, PartCell, PartSettings, Surroundings, is_zero, part};
use crate::element::material::Law;
use interface_defs::diagnostic::{Diagnostic, code};

part! {
    /// Energy-dissipating devices between two nodes.
    BrakePart: "brakes", (2, 2) nodes, Line2 {
        /// Stiffness before it yields, on unloading, and beyond its stroke [N/m].
        stiffness: f64,
        /// Curve of a slow test: rows `[elongation, force]` [m, N], the first where it yields, at
        /// `force / stiffness` or more; constant beyond the last. Empty: elastic.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        curve: Vec<[f64; 2]>,
        /// Plastic travel at which it comes to its end stop [m]. Default: none.
        stroke: Option<f64>,
        /// Mass of each [kg]. Default 0.
        #[serde(default, skip_serializing_if = "is_zero")]
        mass: f64,
        /// Length at which its force begins [m]. Default the distance of its nodes.
        length: Option<f64>,
        /// Whether it carries no compression. Default true.
        #[serde(default = "crate::element::part::yes")]
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
                let what = format!(
                    "under {} N the stiffness alone gives an elongation of {} m, the curve says {} m: its travel must grow",
                    row[1],
                    row[1] / self.stiffness,
                    row[0]
                );
                return Err(key.invalid("curve", what).try_instead("a larger stiffness"));
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
        let limit = self.stroke.unwrap_or(f64::INFINITY);
        let span = cell.spans()[0];
        let brake = Bar {
            nodes: cell.ends(),
            span,
            length: self.length.unwrap_or(span.norm()),
            section: None,
            mass: self.mass,
            radius: self.radius.unwrap_or(0.0),
            law: Law { hardening, limit, ..Law::elastic(self.stiffness, 0.0, self.tension_only) },
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
        self.judge_curve(at)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::element::bar::Rupture;
    use crate::element::tests::checks::{Case, random};
    use crate::element::{Answer, Element, Slack};
    use nalgebra::Vector3;

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
            brake.respond(&pulled(u), &[0.0; 4], &mut answer);
            (answer.tension, answer.history[1])
        };
        // Travel ends at 0.5 m under 1e5 N: elongation 0.5 + 1e5 / 5e6. Beyond, k again.
        let (force, travel) = answer(0.52 + 0.01);
        assert!((travel - 0.5).abs() < 1e-15 && (force - 1.5e5).abs() < 1e-6, "{force} {travel}");
        let energy = brake.energy(&pulled(0.53), &[0.0; 4]);
        assert!((energy.dissipated - 0.5 * 7.5e4).abs() < 1e-8, "{energy:?}");
    }
}
