//! Loads and supports as they are at t = 0, and whether they change later.

use super::Model;
use super::pressure::press;
use std::borrow::Cow;

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
