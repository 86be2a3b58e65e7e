//! `[line.design]`: what a barrier on a line must be able to do, by the checks of UNI 11211-4 and ONR 24810.
//!
//! Both take quantiles of what passes the line and multiply them by factors. The factors depend on how well block and slope are
//! known, and on what is at risk: the study states them. Only two have a default, which is in the standard itself.

use interface_defs::toolkit::input_error::InputError;
use interface_defs::toolkit::scene::Scene;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

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

impl Design {
    /// Refuse what no one can mean; `key` is that of the table.
    pub fn check(&self, key: &str, study: &Scene) -> Result<(), InputError> {
        if self.uni_11211_4.is_none() && self.onr_24810.is_none() {
            let what = "no standard says what the barrier must be able to do";
            return Err(study
                .invalid(key, what)
                .try_instead(format!("add a table [{}.uni_11211_4] or [{0}.onr_24810]", "line.design")));
        }
        for (name, value) in [
            ("barrier_energy", self.barrier_energy),
            ("barrier_height", self.barrier_height),
            ("barrier_elongation", self.barrier_elongation),
            ("distance", self.distance),
        ] {
            if let Some(value) = value.filter(|value| *value <= 0.0) {
                return Err(
                    study.invalid(&format!("{key}.{name}"), format!("{name} = {value}: it must lie above 0"))
                );
            }
        }
        if let Some(uni) = &self.uni_11211_4 {
            uni.check(&format!("{key}.uni_11211_4"), study)?;
            if self.barrier_elongation.is_some() && uni.distance_factor(self.barrier_fields).is_none() {
                let what = "with SEL the distance over the elongation has no default";
                return Err(study
                    .invalid(&format!("{key}.uni_11211_4"), what)
                    .try_instead("add distance_factor"));
            }
        }
        self.onr_24810.as_ref().map_or(Ok(()), |onr| onr.check(&format!("{key}.onr_24810"), study))
    }
}

/// Refuse a factor below 1: it would take safety away.
fn at_least_one(all: &[(&str, f64)], key: &str, study: &Scene) -> Result<(), InputError> {
    match all.iter().find(|(_, factor)| *factor < 1.0) {
        None => Ok(()),
        Some((name, factor)) => {
            let what = format!("{name} = {factor}: a factor of safety is 1 or more");
            Err(study.invalid(&format!("{key}.{name}"), what).try_instead("5 % are 1.05"))
        }
    }
}

impl Uni {
    fn check(&self, key: &str, study: &Scene) -> Result<(), InputError> {
        if self.block_mass <= 0.0 {
            let what = format!("a mass of {} kg: it must lie above 0", self.block_mass);
            return Err(study.invalid(&format!("{key}.block_mass"), what));
        }
        if self.free_border < 0.5 {
            let what = format!("free_border = {} m: UNI 11211-4 asks for 0.5 m at least", self.free_border);
            return Err(study.invalid(&format!("{key}.free_border"), what));
        }
        let mut all = vec![
            ("trajectories", self.trajectories),
            ("topography", self.topography),
            ("block_survey", self.block_survey),
            ("weight", self.weight),
        ];
        all.extend(self.energy_factor.map(|factor| ("energy_factor", factor)));
        all.extend(self.distance_factor.map(|factor| ("distance_factor", factor)));
        at_least_one(&all, key, study)
    }
}

impl Onr {
    fn check(&self, key: &str, study: &Scene) -> Result<(), InputError> {
        for (name, value) in
            [("energy_quantile", self.energy_quantile), ("height_quantile", self.height_quantile)]
        {
            if !(50.0..100.0).contains(&value) {
                let what = format!("{name} = {value}: a quantile in %, from 50 to less than 100");
                return Err(study.invalid(&format!("{key}.{name}"), what).try_instead("95 or 99"));
            }
        }
        at_least_one(
            &[("energy_factor", self.energy_factor), ("height_factor", self.height_factor)],
            key,
            study,
        )
    }
}
