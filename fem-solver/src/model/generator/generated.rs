//! What a generator makes.

use crate::read::mesh::{ElementGroup, Mesh};
use interface_defs::mesh::Group;

/// A generated structure.
#[derive(Debug, Clone)]
pub struct Generated {
    /// Nodes, elements, named groups.
    pub mesh: Mesh,
    /// Nodes that are held in all directions.
    pub held: Vec<usize>,
    /// What the elements of each group are made for.
    pub parts: Vec<MadeFor>,
}

/// A named part of a generated structure.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MadeFor {
    /// The group of its elements.
    pub group: &'static str,
    /// The element that they are made for, as `[[structure.parts]]` calls it.
    pub element: &'static str,
}

impl Generated {
    /// A structure whose elements are all one part.
    pub(super) fn of_one_part(
        mut mesh: Mesh,
        group: &'static str,
        element: &'static str,
        held: Vec<usize>,
    ) -> Self {
        let elements = (0..mesh.elements.len() as u32).collect();
        mesh.element_groups.push(ElementGroup { name: group.into(), elements });
        mesh.name_nodes();
        Self { mesh, held, parts: vec![MadeFor { group, element }] }
    }
}

/// A named set of nodes.
pub(super) fn named(name: &str, nodes: &[usize]) -> Group {
    Group { name: name.into(), nodes: nodes.iter().map(|n| *n as u32).collect() }
}
