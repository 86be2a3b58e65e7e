//! Each contact node follows the point of the structure's faces and lines that is nearest at t = 0.
//!
//! Linear between the nodes of an element: motions that are affine in space are reproduced on it, and moments are kept. A node that is off
//! the mesh follows its foot point, so that its force acts there.

use super::elements::Elements;
use super::{Mapper, Matrix};
use interface_defs::InterfaceMesh;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Nearest point on the structure's faces and lines, linear between their nodes.
#[derive(Debug, Clone, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct NearestProjection {}

impl Mapper for NearestProjection {
    fn matrix(&self, structure: &InterfaceMesh, contact: &InterfaceMesh) -> Result<Matrix, String> {
        let elements = Elements::new(structure);
        let points = contact.coordinates.as_chunks::<3>().0.iter();
        let rows = points.map(|p| elements.nearest(*p).expect("there are nodes").shares);
        Ok(Matrix::from_rows(structure.node_count(), rows))
    }
}
