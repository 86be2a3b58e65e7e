//! What a mesh file or a generator gives: nodes, elements, named groups of both; no properties.

use super::tokens::error;
use interface_defs::diagnostic::Diagnostic;
use interface_defs::mesh::Group;
use nalgebra::Vector3;
use std::collections::{HashMap, HashSet};
use std::fmt;

/// Shape of an element. Nodes stand in the order of the file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Kind {
    /// One node.
    Point,
    /// A line between two nodes.
    Line2,
    /// A line with a node between its ends.
    Line3,
    /// A triangle of three corners.
    Tri3,
    /// A triangle with nodes on its sides.
    Tri6,
    /// A quadrilateral of four corners.
    Quad4,
    /// A row of any number of nodes, two at least; generators only.
    Row,
}

impl Kind {
    /// Number of nodes; `None` where each element has its own.
    pub fn node_count(self) -> Option<usize> {
        match self {
            Self::Point => Some(1),
            Self::Line2 => Some(2),
            Self::Line3 | Self::Tri3 => Some(3),
            Self::Quad4 => Some(4),
            Self::Tri6 => Some(6),
            Self::Row => None,
        }
    }

    /// Its name, in the plural.
    pub fn name(self) -> &'static str {
        match self {
            Self::Point => "points",
            Self::Line2 => "lines of 2 nodes",
            Self::Line3 => "lines of 3 nodes",
            Self::Tri3 => "triangles of 3 nodes",
            Self::Tri6 => "triangles of 6 nodes",
            Self::Quad4 => "quadrilaterals of 4 nodes",
            Self::Row => "rows of nodes",
        }
    }
}

/// An element of a mesh.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MeshElement {
    /// Its number in the file; its position, in a generated mesh.
    pub number: u64,
    /// Its shape.
    pub kind: Kind,
    start: u32,
    count: u32,
}

/// A named set of elements.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ElementGroup {
    /// Its name.
    pub name: String,
    /// Its elements by position, increasing.
    pub elements: Vec<u32>,
}

/// Nodes, elements, named groups of both.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Mesh {
    /// Nodes [m].
    pub nodes: Vec<Vector3<f64>>,
    /// Numbers of the nodes in the file; empty where the mesh is from no file.
    pub numbers: Vec<u64>,
    /// Elements.
    pub elements: Vec<MeshElement>,
    /// Nodes of all elements, one after the other.
    connectivity: Vec<u32>,
    /// Named sets of elements.
    pub element_groups: Vec<ElementGroup>,
    /// Named sets of nodes, increasing. Each element group has one of its name: the nodes of its
    /// elements, unless the file names other nodes so.
    pub node_groups: Vec<Group>,
    /// What was passed over and the user should know.
    pub warnings: Vec<String>,
}

impl Mesh {
    /// Nodes of an element.
    pub fn nodes_of(&self, element: &MeshElement) -> &[u32] {
        &self.connectivity[element.start as usize..][..element.count as usize]
    }

    /// Append an element, numbered by its position. For generators: its nodes are known to be there.
    pub fn push(&mut self, kind: Kind, nodes: &[usize]) -> u32 {
        let position = self.elements.len() as u32;
        self.push_numbered(u64::from(position), kind, nodes.iter().map(|n| *n as u32));
        position
    }

    fn push_numbered(&mut self, number: u64, kind: Kind, nodes: impl Iterator<Item = u32>) {
        let start = self.connectivity.len();
        self.connectivity.extend(nodes);
        let count = (self.connectivity.len() - start) as u32;
        self.elements.push(MeshElement { number, kind, start: start as u32, count });
    }

    /// Give every element group that has none the node group of its name.
    pub fn name_nodes(&mut self) {
        let known: HashSet<&str> = self.node_groups.iter().map(|g| g.name.as_str()).collect();
        let mut named = Vec::new();
        for group in &self.element_groups {
            if !known.contains(group.name.as_str()) {
                let of = |e: &u32| self.nodes_of(&self.elements[*e as usize]);
                let mut nodes: Vec<u32> = group.elements.iter().flat_map(of).copied().collect();
                nodes.sort_unstable();
                nodes.dedup();
                named.push(Group { name: group.name.clone(), nodes });
            }
        }
        self.node_groups.extend(named);
    }
}

/// Positions by number: an offset where numbers follow each other, as they mostly do.
#[derive(Debug, Default)]
struct Numbering {
    first: u64,
    run: u64,
    others: HashMap<u64, u32>,
}

impl Numbering {
    fn get(&self, number: u64) -> Option<u32> {
        match number.checked_sub(self.first) {
            Some(offset) if offset < self.run => Some(offset as u32),
            _ => self.others.get(&number).copied(),
        }
    }

    /// Number the next position; `false` if that number is taken.
    fn push(&mut self, number: u64, position: u32) -> bool {
        if self.run == 0 && self.others.is_empty() {
            self.first = number;
        }
        if self.others.is_empty() && number.checked_sub(self.first) == Some(self.run) {
            self.run += 1;
            return true;
        }
        self.get(number).is_none() && self.others.insert(number, position).is_none()
    }
}

/// Names of groups and their members.
#[derive(Debug, Default)]
struct Names {
    position: HashMap<String, usize>,
    groups: Vec<(String, Vec<u32>)>,
}

impl Names {
    fn group(&mut self, key: &str, name: &str) -> usize {
        if let Some(at) = self.position.get(key) {
            return *at;
        }
        self.groups.push((name.to_owned(), Vec::new()));
        self.position.insert(key.to_owned(), self.groups.len() - 1);
        self.groups.len() - 1
    }

    fn finish(self) -> impl Iterator<Item = (String, Vec<u32>)> {
        self.groups.into_iter().map(|(name, mut members)| {
            members.sort_unstable();
            members.dedup();
            (name, members)
        })
    }
}

/// A mesh while it is read: resolves numbers, and refuses what would not fit.
pub struct Builder<'a> {
    file: &'a str,
    mesh: Mesh,
    nodes: Numbering,
    elements: Numbering,
    node_groups: Names,
    element_groups: Names,
    /// How many members all groups together may still take. A few lines can say that a hundred
    /// groups hold a million nodes each; memory stays proportional to the file.
    members_left: usize,
}

impl<'a> Builder<'a> {
    /// An empty mesh, to be read from `file` of so many bytes.
    pub fn new(file: &'a str, bytes: usize) -> Self {
        Self {
            file,
            mesh: Mesh::default(),
            nodes: Numbering::default(),
            elements: Numbering::default(),
            node_groups: Names::default(),
            element_groups: Names::default(),
            members_left: (1 << 20) + 8 * bytes,
        }
    }

    /// Append the node `number` at `point` [m], stated on `line`.
    pub fn node(&mut self, line: usize, number: u64, point: [f64; 3]) -> Result<u32, Diagnostic> {
        let position = self.mesh.nodes.len() as u32;
        if !self.nodes.push(number, position) {
            return Err(error(self.file, line, format!("there is a node {number} already")));
        }
        self.mesh.nodes.push(point.into());
        self.mesh.numbers.push(number);
        Ok(position)
    }

    /// Position of the node `number`, named on `line` by `what`.
    pub fn node_at(&self, line: usize, number: u64, what: fmt::Arguments) -> Result<u32, Diagnostic> {
        self.nodes.get(number).ok_or_else(|| {
            error(self.file, line, format!("{what} names node {number}, which is not defined before"))
        })
    }

    /// Append the element `number` with nodes by position, stated on `line`.
    pub fn element(
        &mut self,
        line: usize,
        number: u64,
        kind: Kind,
        nodes: &[u32],
    ) -> Result<u32, Diagnostic> {
        let position = self.mesh.elements.len() as u32;
        if !self.elements.push(number, position) {
            return Err(error(self.file, line, format!("there is an element {number} already")));
        }
        self.mesh.push_numbered(number, kind, nodes.iter().copied());
        Ok(position)
    }

    /// Position of the element `number`, if there is one.
    pub fn element_at(&self, number: u64) -> Option<u32> {
        self.elements.get(number)
    }

    /// Nodes of the element at a position.
    pub fn nodes_of(&self, position: u32) -> &[u32] {
        self.mesh.nodes_of(&self.mesh.elements[position as usize])
    }

    /// Number of nodes and of elements so far.
    pub fn counts(&self) -> (usize, usize) {
        (self.mesh.nodes.len(), self.mesh.elements.len())
    }

    /// The node group that `key` stands for, called `name` where it is new.
    pub fn node_group(&mut self, key: &str, name: &str) -> usize {
        self.node_groups.group(key, name)
    }

    /// The element group that `key` stands for, called `name` where it is new.
    pub fn element_group(&mut self, key: &str, name: &str) -> usize {
        self.element_groups.group(key, name)
    }

    /// The node group that `key` stands for, if there is one.
    pub fn known_node_group(&self, key: &str) -> Option<usize> {
        self.node_groups.position.get(key).copied()
    }

    /// The element group that `key` stands for, if there is one.
    pub fn known_element_group(&self, key: &str) -> Option<usize> {
        self.element_groups.position.get(key).copied()
    }

    /// Put a node into a group.
    pub fn add_node(&mut self, line: usize, group: usize, node: u32) -> Result<(), Diagnostic> {
        self.take(line, 1)?;
        self.node_groups.groups[group].1.push(node);
        Ok(())
    }

    /// Put an element into a group.
    pub fn add_element(&mut self, line: usize, group: usize, element: u32) -> Result<(), Diagnostic> {
        self.take(line, 1)?;
        self.element_groups.groups[group].1.push(element);
        Ok(())
    }

    /// Put all of the node group `from` into the node group `to`.
    pub fn add_nodes_of_group(&mut self, line: usize, to: usize, from: usize) -> Result<(), Diagnostic> {
        self.take(line, self.node_groups.groups[from].1.len())?;
        let members = self.node_groups.groups[from].1.clone();
        self.node_groups.groups[to].1.extend(members);
        Ok(())
    }

    /// Put all of the element group `from` into the element group `to`.
    pub fn add_elements_of_group(&mut self, line: usize, to: usize, from: usize) -> Result<(), Diagnostic> {
        self.take(line, self.element_groups.groups[from].1.len())?;
        let members = self.element_groups.groups[from].1.clone();
        self.element_groups.groups[to].1.extend(members);
        Ok(())
    }

    /// Put the nodes of all elements of the element group `from` into the node group `to`.
    pub fn add_nodes_of_elements(&mut self, line: usize, to: usize, from: usize) -> Result<(), Diagnostic> {
        for i in 0..self.element_groups.groups[from].1.len() {
            let element = self.mesh.elements[self.element_groups.groups[from].1[i] as usize];
            self.take(line, element.count as usize)?;
            self.node_groups.groups[to].1.extend(self.mesh.nodes_of(&element));
        }
        Ok(())
    }

    fn take(&mut self, line: usize, members: usize) -> Result<(), Diagnostic> {
        match self.members_left.checked_sub(members) {
            Some(left) => {
                self.members_left = left;
                Ok(())
            }
            None => Err(error(
                self.file,
                line,
                "the groups of this file name far more members than it has nodes and elements",
            )
            .try_instead("remove groups that are not needed")),
        }
    }

    /// What the user should know.
    pub fn warn(&mut self, warning: String) {
        self.mesh.warnings.push(warning);
    }

    /// The mesh, or an error if there is no node in it.
    pub fn finish(self) -> Result<Mesh, Diagnostic> {
        let mut mesh = self.mesh;
        if mesh.nodes.is_empty() {
            return Err(Diagnostic::in_file(self.file, "there is no node in this file"));
        }
        mesh.node_groups = self.node_groups.finish().map(|(name, nodes)| Group { name, nodes }).collect();
        mesh.element_groups =
            self.element_groups.finish().map(|(name, elements)| ElementGroup { name, elements }).collect();
        mesh.name_nodes();
        Ok(mesh)
    }
}
