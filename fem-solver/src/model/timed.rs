//! Loads that change in time or follow the structure: nodal forces with a table of factors, and pressure on faces.

use super::support::Motion;
use nalgebra::Vector3;

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
