//! Loads with a history and pressure, as a step needs them: at an instant, or their mean over the step.

use crate::linear_algebra::lanes::add_to;
use crate::model::Model;
use crate::model::pressure::{Motion, press};
use std::borrow::Cow;

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

    fn take(&mut self, model: &Model, factor: impl Fn(&Motion) -> f64) {
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

impl Model {
    /// The structure as form finding sees it: loads with a history are those of t = 0, and constant; supports let nothing go.
    pub fn at_start(&self) -> Cow<'_, Self> {
        if self.timed.is_empty() && self.until.is_empty() {
            return Cow::Borrowed(self);
        }
        let mut start = self.clone();
        self.released().into_iter().for_each(|dof| start.held[dof] = true);
        start.until.clear();
        for load in &mut start.timed {
            let factor = load.factor.at(0.0);
            for (dof, force) in load.forces.drain(..) {
                start.dead_load[dof] += factor * force;
            }
        }
        Cow::Owned(start)
    }

    /// Pressure of each load at t = 0 [Pa].
    pub fn pressures_at_start(&self) -> Vec<f64> {
        self.timed.iter().map(|load| load.pressure * load.factor.at(0.0)).collect()
    }

    /// Constant loads and the pressure at t = 0, on every degree of freedom [N].
    pub fn load_at_start(&self, u: &[f64]) -> Vec<f64> {
        let mut load = self.dead_load.clone();
        press(&self.timed, &self.pressures_at_start(), u, &mut load);
        load
    }

    /// Whether nothing that the scene prescribes changes from `start` to `end` [s].
    pub fn rests(&self, start: f64, end: f64) -> bool {
        self.moving.iter().all(|(_, m)| m.rests(start, end))
            && self.timed.iter().all(|load| load.factor.rests(start, end))
            && !self.until.iter().any(|time| time.is_finite() && *time < end)
    }
}
