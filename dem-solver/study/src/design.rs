//! `[line.design]`: what a barrier on a line must be able to do, by the checks of UNI 11211-4 and ONR 24810.
//!
//! Both take quantiles of what passes the line and multiply them by factors. The factors depend on how well block and slope are
//! known, and on what is at risk: the study states them. Only two have a default, which is in the standard itself.

use interface_defs::diagnostic::Diagnostic;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use toolkit::ranges::Gate;
use toolkit::scene::{Scene, at, number};

/// What a barrier there must be able to do: the barrier, as far as it is known, and by which standards it is judged.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Design {
    /// Energy that the barrier was tested for [J]: at the level that is judged (MEL or SEL).
    pub barrier_energy: Option<f64>,
    /// Nominal height of the barrier [m].
    pub barrier_height: Option<f64>,
    /// Its largest elongation in the test [m].
    pub barrier_elongation: Option<f64>,
    /// Its number of fields.
    pub barrier_fields: Option<u32>,
    /// Distance from the barrier down to what it protects [m].
    pub distance: Option<f64>,
    /// Judge by UNI 11211-4.
    pub uni_11211_4: Option<Uni>,
    /// Judge by ONR 24810.
    pub onr_24810: Option<Onr>,
}

/// Which of the two tested energies a design relies on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum Level {
    /// Maximum energy level: one impact.
    #[serde(rename = "MEL")]
    Maximum,
    /// Service energy level: several impacts.
    #[serde(rename = "SEL")]
    Service,
}

/// Factors of UNI 11211-4.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Uni {
    /// Mass of the design block [kg].
    pub block_mass: f64,
    /// Factor of the trajectories: 1.02 (back analysis) to 1.10.
    pub trajectories: f64,
    /// Factor of the topography: 1.02 to 1.10.
    pub topography: f64,
    /// Factor of the survey of the blocks: 1.02 to 1.10.
    pub block_survey: f64,
    /// Factor of the weight of the rock: 1 or more.
    pub weight: f64,
    /// Free border above the design height [m]: 0.5 or more.
    pub free_border: f64,
    /// Which tested energy.
    pub level: Level,
    /// Safety factor of that energy. Default 1.2 with MEL, 1 with SEL.
    pub energy_factor: Option<f64>,
    /// Distance to what is protected over the elongation. Default with MEL 1.3, or 1.5 with fewer than 3 fields; with SEL it is
    /// required where an elongation is given.
    pub distance_factor: Option<f64>,
}

/// Quantiles and factors of ONR 24810.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Onr {
    /// Quantile of the energy [%].
    pub energy_quantile: f64,
    /// Quantile of the height [%].
    pub height_quantile: f64,
    /// Factor of the energy.
    pub energy_factor: f64,
    /// Factor of the height.
    pub height_factor: f64,
}

/// Quantile that UNI 11211-4 takes [%].
pub const UNI_QUANTILE: f64 = 95.0;

impl Uni {
    /// Safety factor of the barrier's energy.
    pub fn energy_factor(&self) -> f64 {
        self.energy_factor.unwrap_or(match self.level {
            Level::Maximum => 1.2,
            Level::Service => 1.0,
        })
    }

    /// Distance to what is protected over the elongation, for a barrier with so many fields.
    pub fn distance_factor(&self, fields: Option<u32>) -> Option<f64> {
        let stated = match (self.level, fields) {
            (Level::Maximum, Some(fields)) if fields < 3 => Some(1.5),
            (Level::Maximum, _) => Some(1.3),
            (Level::Service, _) => None,
        };
        self.distance_factor.or(stated)
    }
}

const PERCENT: &str = "a factor of safety is 1 or more; 5 % are 1.05";
const OF_UNI: &str = "UNI 11211-4 has 1.02 to 1.10; 5 % are 1.05";
/// Least number above 0.
const ABOVE: f64 = f64::MIN_POSITIVE;

const fn length(key: &'static str, usual: [f64; 2], most: f64, hint: &'static str) -> Gate {
    let units = &[("cm", 1e-2), ("mm", 1e-3)];
    Gate { key, unit: "m", possible: [ABOVE, most], usual, units, hint, ..Gate::ANY }
}

const fn factor(key: &'static str, usual: [f64; 2], hint: &'static str) -> Gate {
    Gate { key, possible: [1.0, 3.0], usual, hint, ..Gate::ANY }
}

/// All numbers of a design.
pub const NUMBERS: [Gate; 14] = [
    Gate {
        key: "barrier_energy",
        unit: "J",
        possible: [1e4, 1e8],
        usual: [5e4, 2e7],
        units: &[("kJ", 1e3), ("MJ", 1e6)],
        hint: "barriers are tested for 1e5 to 1e7 J",
        ..Gate::ANY
    },
    length("barrier_height", [1.0, 15.0], 100.0, "barriers are 2 to 10 m high"),
    length("barrier_elongation", [0.2, 15.0], 30.0, "in tests barriers elongate by 1 to 10 m"),
    length("distance", [ABOVE, 1e4], 1e6, "it is that from the barrier down to what it protects"),
    Gate {
        key: "uni_11211_4.block_mass",
        unit: "kg",
        possible: [1.0, 1e6],
        usual: [20.0, 1e5],
        units: &[("tonnes", 1e3), ("grams", 1e-3)],
        hint: "the blocks that barriers are made for have 100 to 50000 kg",
        ..Gate::ANY
    },
    length("uni_11211_4.free_border", [0.5, 5.0], 30.0, "free borders are 0.5 to 2 m"),
    factor("uni_11211_4.trajectories", [1.02, 1.10], OF_UNI),
    factor("uni_11211_4.topography", [1.02, 1.10], OF_UNI),
    factor("uni_11211_4.block_survey", [1.02, 1.10], OF_UNI),
    factor("uni_11211_4.weight", [1.0, 2.0], PERCENT),
    factor("uni_11211_4.energy_factor", [1.0, 2.0], PERCENT),
    factor("uni_11211_4.distance_factor", [1.0, 2.0], PERCENT),
    factor("onr_24810.energy_factor", [1.0, 1.5], PERCENT),
    factor("onr_24810.height_factor", [1.0, 1.5], PERCENT),
];

impl Design {
    /// Refuse what is certainly wrong, and warn of what is unusual; `key` is that of the table.
    pub fn check(&self, key: &str, study: &Scene) -> Result<Vec<Diagnostic>, Diagnostic> {
        if self.uni_11211_4.is_none() && self.onr_24810.is_none() {
            let what = "no standard says what the barrier must be able to do";
            let cure = "add a table [line.design.uni_11211_4] or [line.design.onr_24810]";
            return study.refuse(key, what, cure);
        }
        if self.barrier_fields == Some(0) {
            let what = "barrier_fields = 0: a barrier has one field at least";
            let cure = "write the number of spans between its posts, or leave it out";
            return study.refuse(&format!("{key}.barrier_fields"), what, cure);
        }
        if let Some(uni) = &self.uni_11211_4 {
            let key = format!("{key}.uni_11211_4");
            if uni.free_border < 0.5 {
                let what =
                    format!("free_border = {} m: UNI 11211-4 asks for 0.5 m at least", uni.free_border);
                return Err(study.invalid(&format!("{key}.free_border"), what));
            }
            if self.barrier_elongation.is_some() && uni.distance_factor(self.barrier_fields).is_none() {
                let what = "with SEL the distance over the elongation has no default";
                return study.refuse(&key, what, "add distance_factor");
            }
        }
        let mut quantiles = self.onr_24810.iter().flat_map(|onr| {
            [("energy_quantile", onr.energy_quantile), ("height_quantile", onr.height_quantile)]
        });
        if let Some((name, value)) = quantiles.find(|(_, value)| !(50.0..100.0).contains(value)) {
            let what = format!("{name} = {value}: a quantile in %, from 50 to less than 100");
            return study.refuse(&format!("{key}.onr_24810.{name}"), what, "95 or 99");
        }
        let document = study.document()?;
        let mut said = Vec::new();
        for gate in &NUMBERS {
            if let Some(value) = at(&document, &format!("{key}.{}", gate.key)).and_then(number) {
                gate.pass(study, key, value, &mut said)?;
            }
        }
        Ok(said.into_iter().map(|found| study.placed(found)).collect())
    }
}
