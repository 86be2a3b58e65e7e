//! Keys of `[[contact]]` that go together: one that nothing would use is refused.

use super::normal::LawName;
use super::settings::{ContactSettings, RollingName};
use interface_defs::diagnostic::Diagnostic;

impl ContactSettings {
    /// The other side's modulus.
    pub(super) fn check_sides(&self, invalid: &dyn Fn(&str, String) -> Diagnostic) -> Result<(), Diagnostic> {
        match (self.partner_young, self.partner_poisson) {
            (Some(_), _) if self.young.is_none() => Err(invalid(
                "partner_young",
                "partner_young is the partner of `young`, which is missing".into(),
            )),
            (Some(_), None) => Err(invalid(
                "partner_poisson",
                "Poisson's ratio of the partner is needed with `partner_young`".into(),
            )),
            (None, Some(_)) => {
                Err(invalid("partner_poisson", "partner_poisson without `partner_young`".into())
                    .try_instead("leave it out: the partner is rigid"))
            }
            (_, Some(nu)) if !(0.0..=0.5).contains(&nu) => {
                Err(invalid("partner_poisson", format!("a Poisson's ratio of {nu}: 0 to 0.5 is possible")))
            }
            _ => Ok(()),
        }
    }

    /// Keys of parts that are not built.
    pub(super) fn check_parts(&self, invalid: &dyn Fn(&str, String) -> Diagnostic) -> Result<(), Diagnostic> {
        let slides = self.friction > 0.0;
        let springs = self.rolling == Some(RollingName::Spring);
        let (grows, ploughs) = (self.friction_max.is_some(), self.scarring_drag.is_some());
        let as_a_whole = matches!(self.law, LawName::HertzRock | LawName::Ground);
        if let Some(most) = self.friction_max.filter(|most| *most < self.friction) {
            let what =
                format!("friction_max = {most} lies below friction = {}, from which it grows", self.friction);
            return Err(invalid("friction_max", what).try_instead("are the two exchanged?"));
        }
        let beside =
            [("friction_growth", self.friction_growth), ("friction_relaxation", self.friction_relaxation)];
        if let Some((key, _)) = beside.into_iter().find(|(_, value)| grows && value.is_none()) {
            let cure = "medium ground of RAMMS has friction_growth = 2.0 and friction_relaxation = 150.0";
            return Err(invalid("friction_max", format!("`friction_max` needs `{key}`")).try_instead(cure));
        }
        let rut = self.rolling == Some(RollingName::Rut);
        if rut && self.ground_pressure().is_none() {
            let what = "the rut is that of ground which resists with a pressure";
            return Err(invalid("rolling", what.into()).try_instead(
                "law = \"ground\" with ground_pressure; or rolling = \"constant\" with rolling_friction",
            ));
        }
        let idle = [
            ("friction_dynamic", self.friction_dynamic.is_some() && !slides, "without `friction`"),
            (
                "friction_decay",
                self.friction_decay.is_some() && self.friction_dynamic.is_none(),
                "without `friction_dynamic`",
            ),
            ("stiffness_ratio", self.stiffness_ratio.is_some() && !slides, "without `friction`"),
            ("friction_max", self.friction_max.is_some() && !slides, "without `friction`"),
            (
                "friction_max",
                self.friction_max.is_some() && self.friction_dynamic.is_some(),
                "beside `friction_dynamic`",
            ),
            ("friction_growth", self.friction_growth.is_some() && !grows, "without `friction_max`"),
            ("friction_relaxation", self.friction_relaxation.is_some() && !grows, "without `friction_max`"),
            (
                "scarring_drag",
                self.scarring_drag.is_some() && !as_a_whole,
                "without law = \"ground\" or \"hertz_rock\"",
            ),
            ("ground_density", self.ground_density.is_some() && !ploughs, "without `scarring_drag`"),
            ("rolling_friction", rut && self.rolling_friction > 0.0, "beside rolling = \"rut\""),
            (
                "rolling",
                self.rolling.is_some() && !rut && self.rolling_friction == 0.0,
                "without `rolling_friction`",
            ),
            ("rolling_damping", self.rolling_damping.is_some() && !springs, "without rolling = \"spring\""),
        ];
        match idle.into_iter().find(|(_, idle, _)| *idle) {
            Some((key, _, why)) => {
                Err(invalid(key, format!("`{key}` {why} does nothing")).try_instead("leave it out"))
            }
            None => Ok(()),
        }
    }
}
