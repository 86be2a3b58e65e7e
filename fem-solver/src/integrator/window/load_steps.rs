//! Statics by load steps that adapt: within a window as many as it takes, whatever the output.

use super::WindowSolver;
use crate::config::FemConfig;
use crate::config::fem::LoadSteps;
use crate::model::Model;
use crate::state::State;

/// Steps that are longer than what is left by less than this share are as long.
const SAME: f64 = 1e-9;

/// Shares of the iterations that are allowed up to which the next load step is twice as long, and up to which it is as long.
const FAST: f64 = 0.3;
const SLOW: f64 = 0.5;
/// What load steps are controlled by.
pub(super) struct Control {
    settings: LoadSteps,
    /// Most iterations of a step.
    most: f64,
    /// State at the start of the step at hand.
    fallback: State,
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
    fn growth(&self, iterations: u64) -> f64 {
        match iterations as f64 / self.most {
            share if share <= FAST => 2.0,
            share if share <= SLOW => 1.0,
            _ => 0.5,
        }
    }
}

impl WindowSolver {
    /// Statics from `start` to `end` [s], part number `place.0` of `place.1` of what one load covers, by load steps as long as
    /// Newton is fast; those that fail are halved.
    pub(super) fn by_load_steps(
        &mut self,
        (start, end): (f64, f64),
        (part, parts): (usize, usize),
    ) -> Result<(), String> {
        let Some(mut control) = self.load_steps.take() else { return Ok(()) };
        let settings = control.settings;
        let place = |time: f64| (part as f64 + (time - start) / (end - start)) / parts as f64;
        let (mut time, mut outcome) = (start, Ok(()));
        while time < end && outcome.is_ok() {
            let remaining = end - time;
            let stride = match self.trial.along.stride {
                0.0 => settings.first,
                stride => stride,
            }
            .min(self.time_step);
            let h = match remaining / stride {
                steps if steps <= 1.0 + SAME => remaining,
                // Two halves rather than a whole step and a very short one.
                steps if steps < 2.0 => 0.5 * remaining,
                _ => stride,
            };
            let next = if h >= remaining { end } else { time + h };
            control.fallback.copy_from(&self.trial);
            match self.implicit_step(time, h, |x| place(time) + x * (place(next) - place(time))) {
                Ok((tension, info)) => {
                    let growth = control.growth(info.iterations);
                    // A row of output that cuts a step short leaves the length of the next.
                    let longest = if growth >= 1.0 && h < stride { stride } else { growth * h };
                    self.trial.along.stride = longest.max(settings.shortest());
                    self.counts.steps += 1;
                    self.record(next, h, Some(tension));
                    time = next;
                }
                Err(failure) => {
                    self.trial.copy_from(&control.fallback);
                    self.counts.refused += 1;
                    let half = 0.5 * h;
                    self.trial.along.stride = half;
                    if half < settings.shortest() {
                        outcome = Err(format!(
                            "statics ends at t = {time:.6e} s, the last equilibrium: from there no load step of {h:.3e} s, and \
                             fem.load_steps allows none below {:.3e} s. {}; where the structure snaps or buckles, \
                             fem.path_speed follows it",
                            settings.shortest(),
                            failure.describe(&self.model)
                        ));
                    }
                }
            }
        }
        self.load_steps = Some(control);
        outcome
    }
}
