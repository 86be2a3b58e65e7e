//! Equal meshes: node to node.

use super::{Mapper, Matrix};
use interface_defs::InterfaceMesh;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The meshes are equal, compared by coordinates.
#[derive(Debug, Clone, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Identity {}

impl Mapper for Identity {
    fn matrix(&self, structure: &InterfaceMesh, contact: &InterfaceMesh) -> Result<Matrix, String> {
        if structure.same_nodes(contact) {
            return Ok(Matrix::identity(structure.node_count()));
        }
        Err(format!(
            "the identity needs equal meshes; the structure has {} nodes, the interface mesh of the contact solver {}, or their coordinates \
             differ; try type = \"nearest_projection\"",
            structure.node_count(),
            contact.node_count()
        ))
    }
}
