//! The structure as numbers: nodes, elements, supports, loads, lumped masses.
//!
//! Vectors over all degrees of freedom are component-major: the x of all nodes, then y, then z
//! (`dof = component * nodes + node`), so that loops over neighbouring nodes run over slices; after them the
//! rotations of the nodes that have any, in the same manner.
//! At the interface they are node-major.

pub mod applied;
pub(crate) mod base;
mod boundary;
mod build;
pub mod contact;
pub(crate) mod generator;
pub(crate) mod ground;
pub mod numbering;
pub mod pressure;
pub mod rope_ends;
pub mod validation;

use crate::element::{AnyElement, Cable, SupportSpring};
use crate::read::nearest;
use contact::ContactLines;
use interface_defs::diagnostic::Diagnostic;
use interface_defs::mesh::{Group, InterfaceMesh};
use nalgebra::Vector3;
use pressure::{Motion, TimedLoad};
use std::ops::Range;
use toolkit::scene::Scene;

/// A structure, ready to be computed.
#[derive(Debug, Clone, Default)]
pub struct Model {
    /// Nodes as modelled [m].
    pub nodes: Vec<Vector3<f64>>,
    /// Cables, in the order of the scene.
    pub cables: Vec<Cable>,
    /// Everything else: elements that go through [`crate::element::Element`].
    pub elements: Vec<AnyElement>,
    /// Those of them that are contacts with the ground: the last ones.
    pub ground: Range<usize>,
    /// Those of them that are supports which give way: the last ones before the ground.
    pub giving: Range<usize>,
    /// The same by the groups that the scene supports so.
    pub giving_groups: Vec<Part>,
    /// Lines that touch each other, where the scene has any.
    pub contact: Option<ContactLines>,
    /// Named sets of elements: the parts of the scene, then the other groups of the mesh.
    pub parts: Vec<Part>,
    /// Number of those that are parts of the scene.
    pub part_count: usize,
    /// Nodes that have rotations, in order.
    pub turning: Vec<usize>,
    /// Number of each node among those that have rotations.
    pub turning_number: Vec<Option<usize>>,
    /// Lumped rotary inertia of each node that has rotations [kg m2].
    pub inertia: Vec<f64>,
    /// Grounded dashpots: degree of freedom and viscosity [N s/m].
    pub dashpots: Vec<(usize, f64)>,
    /// Grounded springs, without force where they are modelled: node, and stiffness in x, y and z [N/m]. Their feet are supports.
    pub springs: Vec<(usize, [f64; 3])>,
    /// Point masses: node and mass [kg].
    pub point_masses: Vec<(usize, f64)>,
    /// Lumped mass of each node [kg].
    pub mass: Vec<f64>,
    /// For each degree of freedom, whether a support holds it.
    pub held: Vec<bool>,
    /// Degrees of freedom with a prescribed motion; they are held too.
    pub moving: Vec<(usize, Motion)>,
    /// Until when a support holds a degree of freedom that it lets go later [s], minus infinity where none does; empty where
    /// no support lets go. These are not [`Model::held`].
    pub until: Vec<f64>,
    /// Weight and constant loads on every degree of freedom [N].
    pub dead_load: Vec<f64>,
    /// Loads that grow along a path of equilibrium, at the factor 1 [N]; empty without a path.
    pub live_load: Vec<f64>,
    /// Pressures that grow along a path of equilibrium, at the factor 1.
    pub live_pressures: Vec<TimedLoad>,
    /// Loads with a history, and pressures.
    pub timed: Vec<TimedLoad>,
    /// Velocity of every degree of freedom at t = 0 [m/s, rad/s]; empty where all is at rest.
    pub start_velocity: Vec<f64>,
    /// Whether weight is part of the dead load, and its direction: the unit vector of gravity.
    pub down: Option<Vector3<f64>>,
    /// Mass-proportional damping alpha [1/s].
    pub damping: f64,
    /// Mass added for the sake of longer steps [kg].
    pub added_mass: f64,
    /// Named sets of nodes.
    pub groups: Vec<Group>,
    /// Numbers of the nodes in the mesh file, by which messages call them; empty where there is none.
    pub numbers: Vec<u64>,
    /// Numbers of the elements in the mesh file, of [`Model::elements`] and of [`Model::cables`]; none without a file, or
    /// where one is of several elements of the file.
    pub element_numbers: [Vec<Option<u64>>; 2],
    /// Remarks for the user on how it was built.
    pub warnings: Vec<Diagnostic>,
}

/// A named set of elements.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Part {
    /// Its name.
    pub name: String,
    /// Its elements, by their numbers in [`Model::elements`].
    pub elements: Vec<usize>,
    /// Its cables, by their numbers in [`Model::cables`].
    pub cables: Vec<usize>,
}

impl Model {
    /// Number of nodes.
    pub fn node_count(&self) -> usize {
        self.nodes.len()
    }

    /// Number of degrees of freedom, held ones included.
    pub fn dof_count(&self) -> usize {
        3 * (self.nodes.len() + self.turning.len())
    }

    /// Degree of freedom of the rotation of a node about axis `component`, where it has one.
    pub fn rotation(&self, node: usize, component: usize) -> Option<usize> {
        let number = self.turning_number[node]?;
        Some(3 * self.nodes.len() + component * self.turning.len() + number)
    }

    /// Lumped mass [kg] or rotary inertia [kg m2] of a degree of freedom.
    pub fn dof_mass(&self, dof: usize) -> f64 {
        let n = self.nodes.len();
        if dof < 3 * n { self.mass[dof % n] } else { self.inertia[(dof - 3 * n) % self.turning.len()] }
    }

    /// Mass of each degree of freedom [kg, kg m2], 0 where held: what takes part in the kinetic energy.
    pub fn free_masses(&self) -> Vec<f64> {
        (0..self.dof_count()).map(|dof| if self.held[dof] { 0.0 } else { self.dof_mass(dof) }).collect()
    }

    /// Stiffness of the grounded springs [N/m] by degree of freedom, those without left out.
    pub fn spring_dofs(&self) -> Vec<(usize, f64)> {
        let all = self.springs.iter().flat_map(|(node, k)| (0..3).map(|c| (self.dof(*node, c), k[c])));
        all.filter(|(_, k)| *k > 0.0).collect()
    }

    /// Viscosity of the grounded dashpots at each degree of freedom that moves [N s/m]; empty without any.
    pub fn viscosities(&self) -> Vec<f64> {
        if self.dashpots.is_empty() {
            return Vec::new();
        }
        let mut all = vec![0.0; self.dof_count()];
        self.dashpots.iter().filter(|(dof, _)| !self.held[*dof]).for_each(|(dof, c)| all[*dof] += c);
        all
    }

    /// Range of the history of each element in that of all.
    pub fn histories(&self) -> impl Iterator<Item = Range<usize>> + '_ {
        self.elements.iter().scan(0, |end, element| {
            let first = std::mem::replace(end, *end + element.start_history().len());
            Some(first..*end)
        })
    }

    /// History of all elements as modelled.
    pub fn start_history(&self) -> Vec<f64> {
        self.elements.iter().flat_map(|e| e.start_history()).collect()
    }

    /// For each node whether an element ends at it, a spring, or a point mass.
    pub(crate) fn used(&self) -> Vec<bool> {
        let mut used = vec![false; self.node_count()];
        let ends = self.cables.iter().map(|c| &c.nodes[..]).chain(self.elements.iter().map(|e| e.nodes()));
        let others = self.springs.iter().map(|s| &s.0).chain(self.point_masses.iter().map(|m| &m.0));
        ends.flatten().chain(others).for_each(|node| used[*node] = true);
        used
    }

    /// The group of nodes of this name, or where `key` of `scene` is wrong.
    pub(crate) fn group(&self, scene: &Scene, key: &str, name: &str) -> Result<Vec<usize>, Diagnostic> {
        let group = self.groups.iter().find(|g| g.name == name).ok_or_else(|| {
            let names: Vec<_> = self.groups.iter().map(|g| g.name.as_str()).collect();
            let hint = nearest(name, &names, "there are no groups here");
            scene.invalid(key, format!("there is no group `{name}`")).try_instead(hint)
        })?;
        Ok(group.nodes.iter().map(|n| *n as usize).collect())
    }

    /// Degree of freedom of a node in direction `component` (0, 1, 2).
    pub fn dof(&self, node: usize, component: usize) -> usize {
        component * self.nodes.len() + node
    }

    /// The node of a degree of freedom and its direction, in words.
    pub fn dof_name(&self, dof: usize) -> String {
        let n = self.nodes.len();
        if dof < 3 * n {
            return format!("node {} in {}", self.node_name(dof % n), ["x", "y", "z"][dof / n]);
        }
        let (turning, number) = (self.turning.len(), dof - 3 * n);
        let node = self.turning[number % turning];
        format!("node {} turning about {}", self.node_name(node), ["x", "y", "z"][number / turning])
    }

    /// A node and where it stands, in words.
    pub fn node_name(&self, node: usize) -> String {
        let p = self.nodes[node];
        let number = self.numbers.get(node).copied().unwrap_or(node as u64);
        format!("{number} at ({}, {}, {})", p.x, p.y, p.z)
    }

    /// Vector of a node out of a vector over all degrees of freedom.
    pub fn vector(&self, of: &[f64], node: usize) -> Vector3<f64> {
        let n = self.nodes.len();
        Vector3::new(of[node], of[n + node], of[2 * n + node])
    }

    /// Displacement of a cable's second node relative to its first.
    pub fn relative(&self, u: &[f64], cable: &Cable) -> Vector3<f64> {
        self.vector(u, cable.nodes[1]) - self.vector(u, cable.nodes[0])
    }

    /// A node of the first connected part of the structure that no support and no spring holds, and how many nodes that part
    /// has.
    pub fn adrift(&self) -> Option<(usize, usize)> {
        let ends = self.cables.iter().map(|c| &c.nodes[..]).chain(self.elements.iter().map(|e| e.nodes()));
        let pairs: Vec<[usize; 2]> = ends.flat_map(|nodes| nodes.array_windows().copied()).collect();
        let safe = |node: &usize| {
            let held = (0..3).any(|c| self.held_first(self.dof(*node, c)));
            held || self.gives_way(*node) || self.springs.iter().any(|s| s.0 == *node)
        };
        let parts = numbering::connected(&pairs, self.node_count());
        parts.iter().find(|part| !part.iter().any(safe)).map(|part| (part[0], part.len()))
    }

    /// The supports that give way, with where their histories begin in that of all elements.
    pub fn support_springs(&self) -> impl Iterator<Item = (usize, &SupportSpring)> + '_ {
        let giving = self.histories().zip(&self.elements).take(self.giving.end).skip(self.giving.start);
        giving.filter_map(|(own, element)| match element {
            AnyElement::SupportSpring(spring) => Some((own.start, spring)),
            _ => None,
        })
    }

    /// Whether a support holds a node that gives way.
    pub fn gives_way(&self, node: usize) -> bool {
        self.elements[self.giving.clone()].iter().any(|spring| spring.nodes() == [node])
    }

    /// The sets of which utilisation and energy are reported: the parts of the scene, and groups of supports that give way.
    pub fn accounted(&self) -> impl Iterator<Item = &Part> {
        self.parts[..self.part_count].iter().chain(&self.giving_groups)
    }

    /// For each element which of these it is in; their number where it is in none.
    pub fn accounts(&self) -> Vec<u32> {
        let mut accounts = vec![self.accounted().count() as u32; self.elements.len()];
        for (number, part) in self.accounted().enumerate() {
            part.elements.iter().for_each(|element| accounts[*element] = number as u32);
        }
        accounts
    }

    /// Whether anything holds the structure, if not for ever.
    pub fn is_supported(&self) -> bool {
        let springs = self.springs.is_empty() && self.giving.is_empty();
        self.held.contains(&true) || !self.until.is_empty() || !springs
    }

    /// Whether reactions swing with parts that hardly anything damps, so that small differences decide how large a peak is: posts,
    /// and ropes that slide.
    pub fn vibrates(&self) -> bool {
        self.elements.iter().any(|of| matches!(of, AnyElement::Beam(_) | AnyElement::SlidingCable(_)))
    }

    /// Whether a node is held in all directions.
    pub fn fully_held(&self, node: usize) -> bool {
        (0..3).all(|c| self.held[self.dof(node, c)])
    }

    /// Put the prescribed displacements of t = 0 into `u`.
    pub fn prescribe_first(&self, u: &mut [f64]) {
        self.moving.iter().for_each(|(dof, motion)| u[*dof] = motion.at(0.0));
    }

    /// Put the prescribed displacements of `time` [s], within the step of `h` from `start`, into `u`.
    pub fn prescribe(&self, time: f64, (start, h): (f64, f64), u: &mut [f64]) {
        for (dof, motion) in self.moving.iter().filter(|(dof, _)| self.holds(*dof, start, h)) {
            u[*dof] = motion.at(time);
        }
    }

    /// Largest extent of the structure as modelled [m]; 0 for a single node.
    pub fn extent(&self) -> f64 {
        let Some(first) = self.nodes.first() else { return 0.0 };
        let low = self.nodes.iter().fold(*first, |a, b| a.inf(b));
        let high = self.nodes.iter().fold(*first, |a, b| a.sup(b));
        (high - low).norm()
    }

    /// Lines and their radii: the cables, then those of the other elements.
    pub fn lines(&self) -> impl Iterator<Item = ([usize; 2], f64)> + '_ {
        let cables = self.cables.iter().map(|c| (c.nodes, c.of.radius));
        let others = self.elements.iter().flat_map(|e| {
            let radius = e.constants().radius;
            e.lines().into_iter().map(move |line| (line, radius))
        });
        cables.chain(others)
    }

    /// The interface mesh with the nodes displaced by `u`.
    pub fn interface_mesh(&self, u: &[f64]) -> InterfaceMesh {
        let node = |i: usize| self.nodes[i] + self.vector(u, i);
        InterfaceMesh {
            coordinates: (0..self.nodes.len()).flat_map(|i| <[f64; 3]>::from(node(i))).collect(),
            lines: self.lines().map(|(line, _)| line.map(|n| n as u32)).collect(),
            faces: self.elements.iter().flat_map(|e| e.faces()).map(|f| f.map(|n| n as u32)).collect(),
            line_radius: self.lines().map(|(_, radius)| radius).collect(),
            masses: (0..self.nodes.len())
                .map(|i| if self.fully_held(i) { f64::INFINITY } else { self.mass[i] })
                .collect(),
            groups: self.groups.clone(),
            ..InterfaceMesh::default()
        }
    }

    /// Depth of the lowest node below the lowest support [m], displaced by `u`; `None` without
    /// weight or supports.
    pub fn sag(&self, u: &[f64]) -> Option<f64> {
        let down = self.down?;
        let depth = |i: usize| down.dot(&(self.nodes[i] + self.vector(u, i)));
        let lowest = (0..self.nodes.len()).map(depth).reduce(f64::max)?;
        let supports =
            (0..self.nodes.len()).filter(|i| self.held_at_first(*i)).map(depth).reduce(f64::max)?;
        Some(lowest - supports)
    }
}
