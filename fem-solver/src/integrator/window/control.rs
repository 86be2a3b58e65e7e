//! How long the next load step is.

use crate::config::FemConfig;
use crate::config::fem::LoadSteps;
use crate::model::Model;
use crate::state::State;

/// Shares of the iterations that are allowed up to which the next load step is twice as long, and up to which it is as long.
const FAST: f64 = 0.3;
const SLOW: f64 = 0.5;
/// What load steps are controlled by.
pub(super) struct Control {
    pub(super) settings: LoadSteps,
    /// Most iterations of a step.
    most: f64,
    /// State at the start of the step at hand.
    pub(super) fallback: State,
}

impl Control {
    /// As the scene says; `state` is one of the structure.
    pub(super) fn new(fem: &FemConfig, state: &State, model: &Model) -> Option<Box<Self>> {
        let settings = fem.load_steps?;
        let most = f64::from(fem.newton.most_iterations());
        let fallback = State { events: Vec::with_capacity(model.elements.len()), ..state.clone() };
        Some(Box::new(Self { settings, most, fallback }))
    }

    /// How much longer the next step is than one of so many iterations.
    pub(super) fn growth(&self, iterations: u64) -> f64 {
        match iterations as f64 / self.most {
            share if share <= FAST => 2.0,
            share if share <= SLOW => 1.0,
            _ => 0.5,
        }
    }
}
