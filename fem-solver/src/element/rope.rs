//! A wire rope by what its catalogue states: diameter and grade.

use crate::read::Key;
use interface_defs::diagnostic::Diagnostic;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Section over the square of the diameter. 6x36 with a steel core, EN 12385-4: minimum breaking force 0.356 d^2 R, metallic
/// section 0.460 d^2, 0.409 kg/m for each 100 mm2 of d^2.
const SECTION: f64 = 0.460;
/// Minimum breaking force over diameter squared and grade.
const BREAKING: f64 = 0.356;
/// Mass per length over the square of the diameter [kg/m3].
const MASS: f64 = 4090.0;
/// Young's modulus of the section of a rope that has been stretched [Pa]: as in a published program for ring net panels (GUO-Liping,
/// Net_panel_analysis, Zenodo 6482654). New ropes are softer.
const YOUNG: f64 = 94.5e9;

/// A wire rope 6x36 with a steel core (EN 12385-4).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Rope {
    /// Nominal diameter [m].
    pub diameter: f64,
    /// Grade: nominal strength of its wires [Pa], 1.77e9 or 1.96e9.
    pub grade: f64,
    /// Share of the minimum breaking force that its terminations keep: 0.8 to 0.9 of clamped or swaged ones. Default 0.9.
    #[serde(default = "terminations")]
    pub terminations: f64,
}

fn terminations() -> f64 {
    0.9
}

impl Rope {
    /// Fill in what a part does not state itself of the modulus [Pa], the section [m2], its density [kg/m3], the radius for contact [m]
    /// and the axial force at which it breaks [N].
    pub fn complete(&self, [young, area, density, radius, rupture_force]: [&mut Option<f64>; 5]) {
        let square = self.diameter * self.diameter;
        let strength = self.terminations * BREAKING * square * self.grade;
        for (value, own) in [
            (young, YOUNG),
            (area, SECTION * square),
            (density, MASS / SECTION),
            (radius, 0.5 * self.diameter),
            (rupture_force, strength),
        ] {
            value.get_or_insert(own);
        }
    }

    /// Refuse what no rope has.
    pub fn check(&self, key: &Key) -> Result<(), Diagnostic> {
        key.positive(&[("rope.diameter", self.diameter, "m"), ("rope.grade", self.grade, "Pa")])?;
        if self.diameter > 0.2 {
            let what = format!("a rope of {} m", self.diameter);
            return key.refuse("rope.diameter", what, "metres: 22 mm is 0.022");
        }
        if !(1e9..=2.5e9).contains(&self.grade) {
            let what = format!("a grade of {} Pa: wires of ropes have 1.57e9 to 2.16e9 Pa", self.grade);
            return key.refuse("rope.grade", what, "pascals: grade 1770 is 1.77e9");
        }
        if !(self.terminations > 0.0 && self.terminations <= 1.0) {
            let what =
                format!("terminations keep a share above 0 and at most 1, it is {}", self.terminations);
            return key.refuse("rope.terminations", what, "0.9 is usual");
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Tables of EN 12385-4 as a maker prints them: diameter [mm], grade [MPa], minimum breaking force [kN].
    const TABLE: [(f64, f64, f64); 6] = [
        (16.0, 1770.0, 161.0),
        (18.0, 1770.0, 204.0),
        (22.0, 1770.0, 305.0),
        (24.0, 1770.0, 363.0),
        (16.0, 1960.0, 179.0),
        (22.0, 1960.0, 338.0),
    ];

    #[test]
    fn it_breaks_as_the_tables_say_and_what_a_part_states_goes_before() {
        for (diameter, grade, force) in TABLE {
            let rope = Rope { diameter: 1e-3 * diameter, grade: 1e6 * grade, terminations: 1.0 };
            let [mut area, mut density, mut radius, mut rupture] = [None; 4];
            let mut young = Some(1e11);
            rope.complete([&mut young, &mut area, &mut density, &mut radius, &mut rupture]);
            assert!(
                (rupture.unwrap_or(0.0) / (1e3 * force) - 1.0).abs() < 5e-3,
                "{rupture:?} for {force} kN"
            );
            assert_eq!((young, radius), (Some(1e11), Some(0.5e-3 * diameter)));
        }
    }
}
