//! `[dem]`: the solver's own step.

use interface_defs::toolkit::input_error::InputError;
use interface_defs::toolkit::scene::Scene;
use serde::{Deserialize, Serialize};

/// `[dem]`. The step is given, or follows from the duration of a contact.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DemSettings {
    /// The solver's own step [s]. Excludes `steps_per_contact`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub time_step: Option<f64>,
    /// Steps in the shortest contact that is expected; of one rock on terrain without a structure, in the contact at
    /// hand, which is longer where fewer spheres touch or the rock is slower. More: more accurate, as its
    /// square, and dearer. Default 50, and never a step above half the critical one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub steps_per_contact: Option<f64>,
    /// How rocks turn between two kicks. Default `exact`; separate spheres turn exactly whatever it says.
    #[serde(default)]
    pub rotation: Rotation,
    /// Threads for many separate spheres; the results do not depend on it. Default 1.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub threads: Option<usize>,
    /// Whether a step above the critical one is taken all the same. Default false.
    #[serde(default)]
    pub allow_unstable: bool,
}

/// How a rock turns freely. Each keeps the angular momentum to the last bit ([`crate::rock::rotation`], with what each errs
/// and costs).
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Rotation {
    /// Taylor series of the free motion: no error but rounding. Flights cost what they turn, not their steps.
    #[default]
    Exact,
    /// Implicit midpoint rule: second order, no drift of energy.
    Midpoint,
    /// Turns about the principal axes one after the other: second order, no drift of energy.
    Splitting,
    /// Runge-Kutta of fourth order on the quaternion; the energy drifts.
    RungeKutta,
}

impl DemSettings {
    /// Steps in the shortest contact where the scene does not say.
    pub const STEPS_PER_CONTACT: f64 = 50.0;

    /// Refuse what makes no sense.
    pub(super) fn check(&self, scene: &Scene) -> Result<(), InputError> {
        if let (Some(_), Some(_)) = (self.time_step, self.steps_per_contact) {
            return Err(scene
                .invalid("dem.steps_per_contact", "time_step and steps_per_contact say one thing twice")
                .try_instead("keep one of them"));
        }
        if let Some(step) = self.time_step.filter(|s| *s <= 0.0) {
            return Err(scene.invalid("dem.time_step", format!("a step of {step} s: it must lie above 0")));
        }
        if let Some(threads) = self.threads.filter(|t| !(1..=256).contains(t)) {
            return Err(scene.invalid("dem.threads", format!("{threads} threads: 1 to 256 are possible")));
        }
        if let Some(steps) = self.steps_per_contact.filter(|s| *s < 1.0) {
            let what = format!("{steps} steps per contact: at least 1 is needed");
            return Err(scene.invalid("dem.steps_per_contact", what));
        }
        Ok(())
    }
}
