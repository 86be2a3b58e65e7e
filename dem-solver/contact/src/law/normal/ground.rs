//! Ground that gives way, as it is pressed for the first time. How it unloads: [`crate::law::yielding`].
//!
//! - `ground_stiffness` k: `F = k d`;
//! - `ground_pressure` p: `F = 2 pi R p d`, a sphere that the ground resists with a constant pressure on the circle
//!   `pi a^2 = 2 pi R d` in its surface;
//! - `ground_modulus` M: Hertz with `E* = 1.405 M`. A rock of 2 700 kg/m3 that comes down with v then goes in by
//!   `d = 0.1 m^(1/3) M^-0.4 v^0.8` (M in kN/m2), the formula of Gerber with the modulus of a plate test.
//!
//! Source: Lu et al. (2019), Rock Mech. Rock Eng. 52, 2343 (the formula of Gerber); the rest is derived in docs/ground.md.

use super::{LawKind, Load, NormalLaw, Powers};
use crate::law::elastic::Elastic;
use interface_defs::diagnostic::Diagnostic;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

/// Density of the rocks that Gerber's formula is compared with [kg/m3].
const DENSITY: f64 = 2700.0;

/// What `law = "ground"` has beside what all laws have.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GroundKeys {
    /// Force of the ground over the depth of the rock as a whole [N/m]. Exactly one of `ground_stiffness`, `ground_pressure` and
    /// `ground_modulus`.
    pub ground_stiffness: Option<f64>,
    /// Pressure with which the ground resists, whatever the depth [Pa].
    pub ground_pressure: Option<f64>,
    /// Modulus of the ground in a plate test, M_E [Pa]: the depth is that of Gerber's formula.
    pub ground_modulus: Option<f64>,
    /// How restitution depends on the impact: `constant` (default), `pfeiffer_bowen`, `bourrier` or `walton`.
    pub restitution_law: Option<RuleName>,
    /// Speed at which `pfeiffer_bowen` (default 9.144) and `bourrier` (default 10) have halved it [m/s].
    pub restitution_speed: Option<f64>,
    /// How fast it falls with depth under `walton` [1/m].
    pub restitution_softening: Option<f64>,
}

/// How restitution depends on the impact, by its name in a scene.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum RuleName {
    /// It does not.
    #[default]
    Constant,
    /// `e / (1 + (v / K)^2)`.
    PfeifferBowen,
    /// `e vh / (vh + v)`.
    Bourrier,
    /// `e / sqrt(1 + S Y)` with the depth Y.
    Walton,
}

/// The same with its parameter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Rule {
    /// It does not.
    Constant,
    /// K [m/s].
    PfeifferBowen(f64),
    /// vh [m/s].
    Bourrier(f64),
    /// S [1/m].
    Walton(f64),
}

/// Force with depth in ground that is pressed for the first time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Loading {
    /// Stiffness [N/m].
    Stiffness(f64),
    /// Pressure [Pa].
    Pressure(f64),
    /// `E*` [Pa].
    Modulus(f64),
}

/// Ground that gives way.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ground {
    /// What the force goes with.
    pub loading: Loading,
    /// How restitution depends on the impact.
    pub rule: Rule,
}

/// `E*` over M_E so that Hertz goes as deep as Gerber's formula: `d^2.5 = 15 m v^2 / (16 E* sqrt(R))` with `m = 4/3 pi rho R^3`
/// against `d = 0.1 m^(1/3) (M / 1000)^-0.4 v^0.8`.
pub fn hertz_over_plate() -> f64 {
    let of_hertz = (15.0_f64 / 16.0).powf(0.4) * (4.0 / 3.0 * PI * DENSITY).powf(1.0 / 15.0);
    (of_hertz / (0.1 * 1e3_f64.powf(0.4))).powf(2.5)
}

impl NormalLaw for Ground {
    type Keys = GroundKeys;

    fn kind() -> LawKind {
        LawKind { whole: true, as_whole: None }
    }

    fn new(keys: GroundKeys, sides: Option<&Elastic>) -> Result<Self, Diagnostic> {
        let wrong = |key: &str, what: String| Diagnostic::new(what).about(key);
        if sides.is_some() {
            return Err(wrong("young", "`ground` is not elastic: it takes no `young`".into())
                .try_instead("write ground_modulus, the modulus of the ground in a plate test [Pa]"));
        }
        let loadings = [
            ("ground_stiffness", keys.ground_stiffness),
            ("ground_pressure", keys.ground_pressure),
            ("ground_modulus", keys.ground_modulus),
        ];
        let (speed, softening) = (keys.restitution_speed, keys.restitution_softening);
        let others = [("restitution_speed", speed), ("restitution_softening", softening)];
        let mut named = loadings.iter().filter_map(|(key, value)| Some((*key, (*value)?)));
        let Some((key, value)) = named.next() else {
            let what =
                "`ground` needs `ground_modulus` [Pa], `ground_pressure` [Pa] or `ground_stiffness` [N/m]";
            return Err(wrong("law", what.into()).try_instead("pasture soil: ground_modulus = 15e6"));
        };
        if let Some((other, _)) = named.next() {
            let what = format!("{key} and {other} define one thing twice");
            return Err(wrong(other, what).try_instead("keep one of them"));
        }
        for (key, value) in loadings.into_iter().chain(others) {
            if let Some(v) = value.filter(|v| *v <= 0.0) {
                return Err(wrong(key, format!("{key} = {v}: it must lie above 0")));
            }
        }
        let name = keys.restitution_law.unwrap_or_default();
        let (fast, walton) =
            (matches!(name, RuleName::PfeifferBowen | RuleName::Bourrier), name == RuleName::Walton);
        for (key, idle, owner) in [
            ("restitution_speed", speed.is_some() && !fast, "\"pfeiffer_bowen\" or \"bourrier\""),
            ("restitution_softening", softening.is_some() && !walton, "\"walton\""),
        ] {
            if idle {
                let what = format!("`{key}` does nothing without restitution_law = {owner}");
                return Err(wrong(key, what).try_instead("leave it out"));
            }
        }
        let needed = || wrong("restitution_law", "\"walton\" needs `restitution_softening` [1/m]".into());
        let rule = match name {
            RuleName::Constant => Rule::Constant,
            RuleName::PfeifferBowen => Rule::PfeifferBowen(speed.unwrap_or(9.144)),
            RuleName::Bourrier => Rule::Bourrier(speed.unwrap_or(10.0)),
            RuleName::Walton => Rule::Walton(softening.ok_or_else(needed)?),
        };
        let loading = match key {
            "ground_stiffness" => Loading::Stiffness(value),
            "ground_pressure" => Loading::Pressure(value),
            _ => Loading::Modulus(hertz_over_plate() * value),
        };
        Ok(Self { loading, rule })
    }

    #[inline(always)]
    fn load(&self, radius: f64, overlap: f64) -> Load {
        match self.loading {
            Loading::Stiffness(k) => Load::linear(k, overlap),
            Loading::Pressure(p) => Load::linear(2.0 * PI * radius * p, overlap),
            Loading::Modulus(modulus) => Load::hertz(modulus, radius, overlap),
        }
    }

    fn powers(&self) -> Powers {
        match self.loading {
            Loading::Stiffness(_) => Powers::LINEAR,
            Loading::Pressure(_) => Powers { radius: 1.0, ..Powers::LINEAR },
            Loading::Modulus(_) => Powers::HERTZ,
        }
    }

    fn pressure(&self) -> Option<f64> {
        match self.loading {
            Loading::Pressure(pressure) => Some(pressure),
            _ => None,
        }
    }

    fn rule(&self) -> Option<Rule> {
        Some(self.rule)
    }

    fn describe(&self) -> String {
        let loading = match self.loading {
            Loading::Stiffness(k) => format!("k = {k:.4e} N/m"),
            Loading::Pressure(p) => format!("pressure {p:.4e} Pa"),
            Loading::Modulus(modulus) => format!("plate modulus {:.4e} Pa", modulus / hertz_over_plate()),
        };
        format!("ground that gives way, {loading}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Lu et al. (2019), table 2: 780 kg on ground of 15 MN/m2; their depths are rounded to millimetres.
    #[test]
    fn the_depth_is_that_of_gerbers_formula() {
        let keys = GroundKeys { ground_modulus: Some(15e6), ..GroundKeys::default() };
        let law = Ground::new(keys, None).expect("a law");
        let mass = 780.0_f64;
        let radius = (0.75 / PI * mass / DENSITY).cbrt();
        for speed in [2.0_f64, 8.7, 25.0] {
            let gerber = 0.1 * mass.cbrt() * 15e3_f64.powf(-0.4) * speed.powf(0.8);
            let found = law.deepest(radius, mass, speed);
            assert!((found / gerber - 1.0).abs() < 1e-12, "{speed}: {found} {gerber}");
        }
        assert!((hertz_over_plate() - 1.405).abs() < 5e-4, "{}", hertz_over_plate());
    }
}
