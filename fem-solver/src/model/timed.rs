//! Loads that change in time or follow the structure: nodal forces with a table of factors, and pressure on faces.

use super::Model;
use super::support::Motion;
use nalgebra::Vector3;
use std::borrow::Cow;

/// One entry of loads with a history, or of pressures.
#[derive(Debug, Clone)]
pub struct TimedLoad {
    /// Factor of all of it over time.
    pub factor: Motion,
    /// Degrees of freedom and the force on each at the factor 1 [N, N m].
    pub forces: Vec<(usize, f64)>,
    /// Pressure on the faces at the factor 1 [Pa].
    pub pressure: f64,
    /// Faces that it acts on.
    pub faces: Vec<Face>,
    /// Number of nodes of the structure.
    pub node_count: usize,
}

/// A triangle under pressure.
#[derive(Debug, Clone)]
pub struct Face {
    /// Its nodes.
    pub nodes: [usize; 3],
    /// Where they are as modelled [m].
    pub corners: [Vector3<f64>; 3],
}

impl TimedLoad {
    /// Corners of a face [m] at the displacements `u`.
    pub fn corners(&self, face: &Face, u: &[f64]) -> [Vector3<f64>; 3] {
        let n = self.node_count;
        [0, 1, 2].map(|i| {
            let node = face.nodes[i];
            face.corners[i] + Vector3::new(u[node], u[n + node], u[2 * n + node])
        })
    }
}

impl Model {
    /// The same as form finding sees it: loads with a history are those of t = 0, and constant; supports let nothing go.
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
        crate::model::pressure::press(&self.timed, &self.pressures_at_start(), u, &mut load);
        load
    }

    /// Whether nothing that the scene prescribes changes from `start` to `end` [s].
    pub fn rests(&self, start: f64, end: f64) -> bool {
        self.moving.iter().all(|(_, m)| m.rests(start, end))
            && self.timed.iter().all(|load| load.factor.rests(start, end))
            && !self.until.iter().any(|time| time.is_finite() && *time < end)
    }
}
