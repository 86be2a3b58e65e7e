//! Loads with a history and pressure, as a step needs them: at an instant, or their mean over the step.

use crate::linear_algebra::lanes::add_to;
use crate::model::Model;
use crate::model::pressure::press;

/// The loads of a structure that change in time or follow it. Empty where the scene has none.
#[derive(Debug, Clone, Default)]
pub struct Applied {
    /// Force on every degree of freedom [N]: what acts at nodes, then with [`Applied::press`] that on faces, too.
    pub force: Vec<f64>,
    /// Pressure of each load [Pa]; 0 for those at nodes.
    pub pressures: Vec<f64>,
    pressed: Vec<f64>,
}

impl Applied {
    /// For `model`.
    pub fn new(model: &Model) -> Self {
        let memory = |needed: bool| vec![0.0; if needed { model.dof_count() } else { 0 }];
        let presses = model.timed.iter().any(|load| !load.faces.is_empty());
        Self {
            force: memory(!model.timed.is_empty()),
            pressures: vec![0.0; if presses { model.timed.len() } else { 0 }],
            pressed: memory(presses),
        }
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.force.is_empty()
    }

    /// Become what acts at `time` [s].
    pub fn at(&mut self, model: &Model, time: f64) {
        self.take(model, |load| load.at(time));
    }

    /// Become the mean of what acts from `start` to `end` [s].
    pub fn mean(&mut self, model: &Model, start: f64, end: f64) {
        self.take(model, |load| load.mean(start, end));
    }

    fn take(&mut self, model: &Model, factor: impl Fn(&crate::model::support::Motion) -> f64) {
        self.force.fill(0.0);
        for (i, load) in model.timed.iter().enumerate() {
            let factor = factor(&load.factor);
            load.forces.iter().for_each(|(dof, force)| self.force[*dof] += factor * force);
            if let Some(pressure) = self.pressures.get_mut(i) {
                *pressure = factor * load.pressure;
            }
        }
    }

    /// Add the force on faces at the displacements `u` to what acts at nodes.
    pub fn press(&mut self, model: &Model, u: &[f64]) {
        if !self.pressures.is_empty() {
            press(&model.timed, &self.pressures, u, &mut self.force);
        }
    }

    /// The same, and to `force`.
    pub fn press_on(&mut self, model: &Model, u: &[f64], force: &mut [f64]) {
        if !self.pressures.is_empty() {
            self.pressed.fill(0.0);
            press(&model.timed, &self.pressures, u, &mut self.pressed);
            add_to(&mut self.force, &self.pressed);
            add_to(force, &self.pressed);
        }
    }
}
