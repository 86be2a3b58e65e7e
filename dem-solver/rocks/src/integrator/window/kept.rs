//! What an integrator takes from one window to the next beside the state, for a run that goes on.
//!
//! No answer of a window depends on these lists but for its last bits: by them the order of sums, the ends of flights and the
//! nodes that are selected are the same as in a run that nobody killed.

use super::RockIntegrator;
use crate::integrator::mesh_stage::MeshStage;
use crate::model::Counts;
use crate::model::state::State;
use dem_contact::contact::broad_phase::terrain_pairs::TerrainPairs;
use serde::{Deserialize, Serialize};

/// The lists, and what was counted.
#[derive(Debug, Serialize, Deserialize)]
pub struct KeptIntegrator {
    mesh: Vec<MeshStage>,
    terrain: Vec<TerrainPairs>,
    /// Which elements of the mesh are broken.
    broken: Vec<bool>,
    half_acceleration: f64,
    coarseness: f64,
    counts: Counts,
}

impl RockIntegrator {
    /// What the next window follows from, and `state` as it is with all nodes selected.
    pub fn kept(&self, state: &State) -> (KeptIntegrator, State) {
        let kept = KeptIntegrator {
            mesh: self.mesh_stages.clone(),
            terrain: self.terrain.as_ref().map_or(Vec::new(), |terrain| terrain.around.clone()),
            broken: self.contact_mesh.as_ref().map_or(Vec::new(), |mesh| mesh.broken.clone()),
            half_acceleration: self.half_acceleration,
            coarseness: self.net.coarseness,
            counts: self.counts,
        };
        let mut state = state.clone();
        for (vector, unknown) in [(&mut state.predicted, f64::NAN), (&mut state.pushed, 0.0)] {
            if vector.is_empty() || !self.fields.is_partial() {
                continue;
            }
            let mut all = vec![unknown; 3 * self.all.nodes];
            for (node, own) in self.fields.nodes().iter().zip(vector.chunks_exact(3)) {
                all[3 * *node as usize..][..3].copy_from_slice(own);
            }
            *vector = all;
        }
        (kept, state)
    }

    /// Go on from there.
    pub fn go_on(&mut self, kept: KeptIntegrator) {
        self.mesh_stages.iter_mut().zip(kept.mesh).for_each(|(stage, kept)| stage.go_on(kept));
        if let Some(terrain) = &mut self.terrain {
            terrain.around.clone_from(&kept.terrain);
        }
        if let Some(mesh) = &mut self.contact_mesh {
            mesh.go_on(kept.broken);
        }
        (self.half_acceleration, self.net.coarseness, self.counts) =
            (kept.half_acceleration, kept.coarseness, kept.counts);
    }
}
