//! How a structure moves at t = 0.

use crate::model::Model;

/// Motion with which a structure starts.
#[derive(Debug, Clone)]
pub struct StartMotion {
    /// Velocity [m/s].
    pub velocity: Vec<f64>,
    /// Acceleration [m/s2]; empty where only a balance of forces gives it.
    pub acceleration: Vec<f64>,
}

impl StartMotion {
    /// Add it to velocities that the scene gives [m/s].
    pub fn add_to(&self, velocity: &mut [f64]) {
        velocity.iter_mut().zip(&self.velocity).for_each(|(v, own)| *v += own);
    }

    /// Keep its accelerations [m/s2], if they are known.
    pub fn keep(&self, acceleration: &mut [f64]) {
        if self.acceleration.len() == acceleration.len() {
            acceleration.copy_from_slice(&self.acceleration);
        }
    }

    /// Nothing moves where the supports of `model` hold it, whatever it did before; those that move go on.
    pub fn held(mut self, model: &Model) -> Self {
        for dof in (0..model.dof_count()).filter(|dof| model.held_first(*dof)) {
            if model.moving.iter().all(|(moving, _)| *moving != dof) {
                self.velocity.iter_mut().skip(dof).take(1).for_each(|v| *v = 0.0);
                self.acceleration.iter_mut().skip(dof).take(1).for_each(|a| *a = 0.0);
            }
        }
        self
    }
}
