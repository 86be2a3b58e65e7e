//! Mappings without settings: node to node of equal meshes, the nearest node, the nearest point, each at t = 0.
//!
//! The nearest point lies on faces and lines, linear between the nodes of an element: motions that are affine in space are reproduced on
//! it, and moments are kept. A node that is off the mesh follows its foot point, so that its force acts there.

use super::elements::Elements;
use super::{Mapper, Matrix};
use interface_defs::InterfaceMesh;
use rstar::{RTree, primitives::GeomWithData};
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
        let [own, of_contact] = [structure, contact].map(InterfaceMesh::node_count);
        Err(format!(
            "the identity needs equal meshes; the structure has {own} nodes, the interface mesh of the contact solver {of_contact}, or \
             their coordinates differ; try type = \"nearest_projection\""
        ))
    }
}

/// Nearest structure node; of several at one distance the one with the lowest number.
#[derive(Debug, Clone, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct NearestNeighbor {}

impl Mapper for NearestNeighbor {
    fn matrix(&self, structure: &InterfaceMesh, contact: &InterfaceMesh) -> Result<Matrix, String> {
        let nodes = structure.coordinates.as_chunks::<3>().0.iter().zip(0_u32..);
        let tree = RTree::bulk_load(nodes.map(|(p, node)| GeomWithData::new(*p, node)).collect());
        let nearest = |point: &[f64; 3]| {
            let nodes = tree.nearest_neighbors(point).into_iter().map(|node| node.data);
            nodes.min().expect("there are nodes")
        };
        let rows = contact.coordinates.as_chunks::<3>().0.iter().map(|point| vec![(nearest(point), 1.0)]);
        Ok(Matrix::from_rows(structure.node_count(), rows))
    }
}

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

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// Places on a coarse grid, so that many are at one distance.
        #[test]
        fn it_is_the_first_that_a_search_through_all_nodes_finds(
            nodes in prop::collection::vec((-4..4i32, -2..2i32, -1..1i32), 1..60),
            points in prop::collection::vec((-6..6i32, -6..6i32, -2..2i32), 1..20),
        ) {
            let mesh = |places: &[(i32, i32, i32)]| InterfaceMesh {
                coordinates: places.iter().flat_map(|p| [p.0, p.1, p.2].map(|x| 0.5 * f64::from(x))).collect(),
                ..Default::default()
            };
            let matrix = NearestNeighbor {}.matrix(&mesh(&nodes), &mesh(&points)).expect("there are nodes");
            for (row, p) in points.iter().enumerate() {
                let d = |n: &(i32, i32, i32)| (p.0 - n.0).pow(2) + (p.1 - n.1).pow(2) + (p.2 - n.2).pow(2);
                let first = nodes.iter().enumerate().min_by_key(|(i, n)| (d(n), *i)).expect("one").0;
                prop_assert_eq!(matrix.row(row), &[(first as u32, 1.0)]);
            }
        }
    }
}
