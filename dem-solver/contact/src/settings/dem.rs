//! `[dem]`: the solver's own step.

use crate::keys::{Checked, Keys};
use dem_solid::geometry::shared_nodes::Unshared;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use toolkit::scene::Scene;

/// More steps in a contact than anything needs.
const MOST_STEPS: f64 = 1e4;

/// The time step of the contact solver, and how rocks rotate. The step is given, or follows from the duration of a contact.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DemSettings {
    /// The solver's own step [s]. Excludes `steps_per_contact`.
    pub time_step: Option<f64>,
    /// Steps in the shortest contact that is expected; of one rock on terrain without a structure, in the contact at
    /// hand, which is longer where fewer spheres touch or the rock is slower. More: more accurate, as its
    /// square, and more costly. Default 50.
    pub steps_per_contact: Option<f64>,
    /// A step that follows from `steps_per_contact` is shortened to this fraction of the critical one, above 0 to 1.
    /// Default: 0.5 where the scene does not name `steps_per_contact`; else it is not shortened, and refused above the
    /// critical one. Excludes `time_step`.
    pub time_step_scale: Option<f64>,
    /// How rocks rotate between two steps. Default `exact`; of separate spheres always `exact`.
    #[serde(default)]
    pub rotation: Rotation,
    /// Which of several lines and faces that a sphere touches are contacts. Default `automatic`. Rocks on a net or on
    /// terrain only.
    #[serde(default)]
    pub contact_selection: ContactSelection,
    /// Whether a step above the critical one is taken all the same. Default false.
    #[serde(default)]
    pub allow_unstable: bool,
}

/// Which of several elements that a sphere touches are contacts.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ContactSelection {
    /// `continuous` where the elements of the mesh share the nodes at which they touch, else `nearest`.
    #[default]
    Automatic,
    /// Nearer ones discard those on or behind their tangent plane (double hierarchy, as the reference
    /// implementation). At kinks towards the sphere the force jumps, which makes or loses energy.
    Nearest,
    /// Every line and every face pushes, and the nodes and edges that they share pull, so that force and energy are
    /// continuous over kinks and crossings.
    Continuous,
}

impl ContactSelection {
    /// Whether it is `continuous` on a mesh, and why, in words: `unshared` says where its elements touch without a common node.
    pub fn choose(self, mesh: &str, unshared: impl FnOnce() -> Option<Unshared>) -> (bool, String) {
        let (continuous, why) = match self {
            Self::Nearest => (false, "as the scene says".into()),
            Self::Continuous => (true, "as the scene says".into()),
            Self::Automatic => match unshared() {
                None => (true, "its elements share their nodes".into()),
                Some(place) => (false, format!("because {place}")),
            },
        };
        let name = if continuous { "continuous" } else { "nearest" };
        (continuous, format!("contact selection on the {mesh}: {name}, {why}"))
    }
}

/// How a rock turns freely ([`crate::rock::rotation`]). There is one scheme.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Rotation {
    /// Taylor series of the free motion: no error but rounding. Flights cost what they turn, not their steps.
    #[default]
    Exact,
}

impl DemSettings {
    /// Steps in the shortest contact where the scene does not say.
    pub const STEPS_PER_CONTACT: f64 = 50.0;

    /// Largest fraction of the critical step where the scene does not name the step.
    pub const TIME_STEP_SCALE: f64 = 0.5;

    /// The fraction of the critical step to which a step that follows from the contact is shortened, if it is.
    pub fn scale(&self) -> Option<f64> {
        self.time_step_scale.or(self.steps_per_contact.is_none().then_some(Self::TIME_STEP_SCALE))
    }

    /// The same with the defaults of a scene with contact filled in: it gives the same step.
    pub fn filled_in(&self) -> Self {
        let mut all = self.clone();
        if self.time_step.is_none() {
            all.time_step_scale = self.scale();
            all.steps_per_contact = self.steps_per_contact.or(Some(Self::STEPS_PER_CONTACT));
        }
        all
    }

    /// Refuse what makes no sense.
    pub(super) fn check(&self, scene: &Scene) -> Checked {
        let keys = Keys::of(scene, "dem");
        let given = self.time_step.is_some();
        keys.twice(["time_step", "steps_per_contact"], given && self.steps_per_contact.is_some())?;
        let what = "a given time_step is not shortened to a fraction of the critical one";
        let cure = "keep one of time_step and time_step_scale";
        keys.refuse(given && self.time_step_scale.is_some(), "time_step_scale", what, cure)?;
        let scale = self.time_step_scale.unwrap_or(1.0);
        let what = format!("a fraction of {scale} of the critical step: it must be above 0 and at most 1");
        keys.refuse(!(scale > 0.0 && scale <= 1.0), "time_step_scale", what, "")?;
        keys.above_zero(&[("time_step", self.time_step, " s")])?;
        let steps = self.steps_per_contact.unwrap_or(1.0);
        let what = format!("{steps} steps per contact: at least 1 is needed");
        keys.refuse(steps < 1.0, "steps_per_contact", what, "")?;
        let what = format!("{steps} steps per contact: more than {MOST_STEPS} change nothing");
        keys.refuse(steps > MOST_STEPS, "steps_per_contact", what, "20 to 50 are usual")
    }
}
