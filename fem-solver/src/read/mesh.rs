//! A mesh of a file or a generator: nodes, elements, named groups of both; no properties.

use super::tokens::{Tokens, error, shown};
use indexmap::IndexMap;
use interface_defs::diagnostic::{Diagnostic, Place, code};
use interface_defs::mesh::Group;
use nalgebra::Vector3;
use serde::Serialize;
use std::collections::{HashMap, HashSet};
use std::fmt;

/// Most parts of a file that a warning lists.
const MOST_LISTED: usize = 20;

/// Shape of an element. Nodes stand in the order of the file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "lowercase")]
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
        Some(self.about().0).filter(|count| *count > 0)
    }

    /// Its name, in the plural.
    pub fn name(self) -> &'static str {
        self.about().1
    }

    fn about(self) -> (usize, &'static str) {
        match self {
            Self::Point => (1, "points"),
            Self::Line2 => (2, "lines of 2 nodes"),
            Self::Line3 => (3, "lines of 3 nodes"),
            Self::Tri3 => (3, "triangles of 3 nodes"),
            Self::Tri6 => (6, "triangles of 6 nodes"),
            Self::Quad4 => (4, "quadrilaterals of 4 nodes"),
            Self::Row => (0, "rows of nodes"),
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
    /// Warnings about what was passed over.
    pub warnings: Vec<Diagnostic>,
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

/// Name and members of each group, by what the file knows it by.
type Groups = IndexMap<String, (String, Vec<u32>)>;

/// Names and members in the order of the file, members increasing.
fn in_order(groups: Groups) -> impl Iterator<Item = (String, Vec<u32>)> {
    groups.into_values().map(|(name, mut members)| {
        members.sort_unstable();
        members.dedup();
        (name, members)
    })
}

interface_defs::worded! {
    /// Kind of what a number or a group of a mesh file stands for.
    #[derive(Debug, Clone, Copy, PartialEq, Eq)]
    pub enum Of with word {
        /// Nodes.
        Nodes = "node",
        /// Elements.
        Elements = "element",
    }
}

/// A mesh while it is read: resolves numbers, and refuses what would not fit.
pub struct Builder<'a> {
    file: &'a str,
    mesh: Mesh,
    /// Position of each number, of nodes and of elements.
    numbers: [HashMap<u64, u32>; 2],
    /// Of nodes and of elements.
    groups: [Groups; 2],
    /// Parts of the file that are not read.
    passed: Vec<String>,
    /// Number of members that all groups together may still take. A few lines can say that a hundred
    /// groups hold a million nodes each; memory stays proportional to the file.
    members_left: usize,
}

impl<'a> Builder<'a> {
    /// An empty mesh, to be read from `file` of so many bytes.
    pub fn new(file: &'a str, bytes: usize) -> Self {
        Self {
            file,
            mesh: Mesh::default(),
            numbers: Default::default(),
            groups: Default::default(),
            passed: Vec::new(),
            members_left: (1 << 20) + 8 * bytes,
        }
    }

    /// Append the node `number` at `point` [m], stated on `line`.
    pub fn node(&mut self, line: usize, number: u64, point: [f64; 3]) -> Result<u32, Diagnostic> {
        let position = self.number(line, Of::Nodes, number, self.mesh.nodes.len())?;
        self.mesh.nodes.push(point.into());
        self.mesh.numbers.push(number);
        Ok(position)
    }

    /// Append the element `number` with nodes by position, stated on `line`.
    pub fn element(
        &mut self,
        line: usize,
        number: u64,
        kind: Kind,
        nodes: &[u32],
    ) -> Result<u32, Diagnostic> {
        let position = self.number(line, Of::Elements, number, self.mesh.elements.len())?;
        self.mesh.push_numbered(number, kind, nodes.iter().copied());
        Ok(position)
    }

    fn number(&mut self, line: usize, of: Of, number: u64, position: usize) -> Result<u32, Diagnostic> {
        if self.numbers[of as usize].insert(number, position as u32).is_none() {
            return Ok(position as u32);
        }
        let article = if of == Of::Nodes { "a" } else { "an" };
        Err(error(self.file, line, format!("there is {article} {} {number} already", of.word())))
    }

    /// Position of the node or element `number`, named on `line` by `what`.
    pub fn at(&self, line: usize, of: Of, number: u64, what: fmt::Arguments) -> Result<u32, Diagnostic> {
        self.numbers[of as usize].get(&number).copied().ok_or_else(|| {
            let what = format!("{what} names {} {number}, which is not defined before", of.word());
            error(self.file, line, what)
        })
    }

    /// The group that `key` stands for, called `name` where it is new.
    pub fn group(&mut self, of: Of, key: &str, name: &str) -> usize {
        let groups = &mut self.groups[of as usize];
        let new = || (name.to_owned(), Vec::new());
        groups.get_index_of(key).unwrap_or_else(|| groups.insert_full(key.to_owned(), new()).0)
    }

    /// The group that `key` stands for, which `line` says is there.
    pub fn known_group(&self, line: usize, of: Of, key: &str) -> Result<usize, Diagnostic> {
        self.groups[of as usize].get_index_of(key).ok_or_else(|| {
            let what = format!("there is no {} set {} before this line", of.word(), shown(key));
            error(self.file, line, what)
        })
    }

    /// Put a node or an element into a group.
    pub fn add(&mut self, line: usize, of: Of, group: usize, member: u32) -> Result<(), Diagnostic> {
        self.take(line, 1)?;
        self.groups[of as usize][group].1.push(member);
        Ok(())
    }

    /// Put the node or element `number`, named by `by`, into a group.
    pub fn put(
        &mut self,
        line: usize,
        of: Of,
        group: usize,
        number: u64,
        by: &str,
    ) -> Result<(), Diagnostic> {
        let member = self.at(line, of, number, format_args!("{by}"))?;
        self.add(line, of, group, member)
    }

    /// Put all of the group `from` into the group `to`.
    pub fn add_group(&mut self, line: usize, of: Of, to: usize, from: usize) -> Result<(), Diagnostic> {
        let members = self.groups[of as usize][from].1.clone();
        self.take(line, members.len())?;
        self.groups[of as usize][to].1.extend(members);
        Ok(())
    }

    /// Put the nodes of all elements of the element group `from` into the node group `to`.
    pub fn add_nodes_of_elements(&mut self, line: usize, to: usize, from: usize) -> Result<(), Diagnostic> {
        for i in 0..self.groups[1][from].1.len() {
            let element = self.mesh.elements[self.groups[1][from].1[i] as usize];
            self.take(line, element.count as usize)?;
            self.groups[0][to].1.extend(self.mesh.nodes_of(&element));
        }
        Ok(())
    }

    fn take(&mut self, line: usize, members: usize) -> Result<(), Diagnostic> {
        let left = self.members_left.checked_sub(members).ok_or_else(|| {
            let what = "the groups of this file name far more members than it has nodes and elements";
            error(self.file, line, what).try_instead("remove groups that are not needed")
        });
        self.members_left = left?;
        Ok(())
    }

    /// The nodes with the numbers that follow in `t`, so many; `what` each is, and who names them.
    pub fn nodes(
        &self,
        t: &mut Tokens,
        count: usize,
        what: &str,
        by: fmt::Arguments,
    ) -> Result<Vec<u32>, Diagnostic> {
        (0..count).map(|_| t.whole(what).and_then(|node| self.at(t.line(), Of::Nodes, node, by))).collect()
    }

    /// A part of the file that is not read: a warning says so.
    pub fn pass_over(&mut self, what: impl Into<String>) {
        let what = what.into();
        if self.passed.len() < MOST_LISTED && !self.passed.contains(&what) {
            self.passed.push(what);
        }
    }

    /// The mesh, or an error if there is no node in it; `hint` says where else that is stated which is passed over.
    pub fn finish(self, hint: Option<&str>) -> Result<Mesh, Diagnostic> {
        let mut mesh = self.mesh;
        if mesh.nodes.is_empty() {
            return Err(Diagnostic::in_file(self.file, "there is no node in this file"));
        }
        if !self.passed.is_empty() {
            let what = format!("passed over: {}", self.passed.join(", "));
            let about = Diagnostic::warning(code::FILE_CONTENT, what).at(Place::file(self.file));
            mesh.warnings.push(about.try_if(hint.map(str::to_owned)));
        }
        let [nodes, elements] = self.groups;
        mesh.node_groups = in_order(nodes).map(|(name, nodes)| Group { name, nodes }).collect();
        let elements = in_order(elements).map(|(name, elements)| ElementGroup { name, elements });
        mesh.element_groups = elements.collect();
        mesh.name_nodes();
        Ok(mesh)
    }
}
