//! The structure's interface mesh as a contact partner.
//!
//! - [`element`]: its lines, faces and single nodes
//! - [`crossings`]: where its wires cross
//! - [`motion`]: where its nodes are within a window

pub mod crossings;
pub mod element;
pub mod local_net;
pub mod motion;

use crossings::Crossings;
use dem_solid::geometry::shared_nodes::{Unshared, first_fault};
pub use element::{Element, Kind};
use interface_defs::{Fault, InterfaceMesh};
use nalgebra::Vector3;

/// What measures need to know of the net at rest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AtRest {
    /// How far down its lowest node lies, along gravity [m].
    pub level: f64,
    /// Middle of its nodes [m].
    pub centre: Vector3<f64>,
    /// Distance of the furthest node from there [m].
    pub reach: f64,
}

/// The mesh at t = 0. An element's number is its place in [`ContactMesh::elements`].
#[derive(Debug, Clone, PartialEq)]
pub struct ContactMesh {
    /// Nodes at t = 0 [m].
    pub nodes: Vec<Vector3<f64>>,
    /// Lines, then faces, then points.
    pub elements: Vec<Element>,
    /// Inverse of the mass that a node shows to a contact [1/kg], 0 where it is held; `None`: not known.
    pub inverse_mass: Option<Vec<f64>>,
    /// Largest radius of a line [m].
    pub largest_radius: f64,
    /// Where wires cross, if their contacts are to be continuous there.
    pub crossings: Option<Crossings>,
    /// Which elements are broken and touch nothing any more; empty while none is.
    pub broken: Vec<bool>,
}

impl ContactMesh {
    /// Make the mesh of an interface mesh.
    pub fn new(mesh: &InterfaceMesh) -> Result<Self, Fault> {
        mesh.check().map_err(|what| Fault::broken(format!("the interface mesh cannot be used: {what}")))?;
        let nodes: Vec<_> =
            mesh.coordinates.chunks_exact(3).map(|c| Vector3::new(c[0], c[1], c[2])).collect();
        let mut held = vec![false; nodes.len()];
        let radii = mesh.line_radius.iter().copied().chain(std::iter::repeat(0.0));
        let line =
            |(&[a, b], radius): (&[u32; 2], f64)| Element { kind: Kind::Line, nodes: [a, b, a], radius };
        let face = |&nodes: &[u32; 3]| Element { kind: Kind::Face, nodes, radius: 0.0 };
        let mut elements: Vec<_> =
            mesh.lines.iter().zip(radii).map(line).chain(mesh.faces.iter().map(face)).collect();
        for node in elements.iter().flat_map(Element::own_nodes) {
            held[*node as usize] = true;
        }
        for node in (0..nodes.len()).filter(|n| !held[*n]) {
            elements.push(Element { kind: Kind::Point, nodes: [node as u32; 3], radius: 0.0 });
        }
        let inverse_mass = (!mesh.masses.is_empty()).then(|| mesh.masses.iter().map(|m| 1.0 / m).collect());
        let largest_radius = elements.iter().map(|e| e.radius).fold(0.0, f64::max);
        Ok(Self { nodes, elements, inverse_mass, largest_radius, crossings: None, broken: Vec::new() })
    }

    /// From now on the lines with a number other than 0 in `flags` are broken, and no others. Returns whether anything has
    /// changed. What a broken line held at its ends and nothing else does is gone with it.
    /// `lines` are the lines that `flags` speak of; `None`: all.
    pub fn tear(&mut self, flags: &[f64], lines: Option<&[u32]>) -> bool {
        // Without a way out in between, several at a time.
        if self.broken.is_empty() && !flags.iter().fold(false, |any, flag| any | (*flag != 0.0)) {
            return false;
        }
        self.broken.resize(self.elements.len(), false);
        let mut changed = false;
        for (at, flag) in flags.iter().enumerate() {
            let broken = &mut self.broken[lines.map_or(at, |lines| lines[at] as usize)];
            changed |= *broken != (*flag != 0.0);
            *broken = *flag != 0.0;
        }
        if changed {
            self.cross_again();
        }
        changed
    }

    /// True if it has faces.
    pub fn has_faces(&self) -> bool {
        self.elements.iter().any(|element| element.kind == Kind::Face)
    }

    /// Length of line number `element` at t = 0 [m].
    #[inline]
    pub fn length(&self, element: u32) -> f64 {
        let [a, b, _] = self.elements[element as usize].nodes;
        (self.nodes[b as usize] - self.nodes[a as usize]).norm()
    }

    /// Find the crossings of what is whole.
    fn cross_again(&mut self) {
        if self.crossings.is_some() {
            let whole = self.elements.iter().zip(&self.broken).filter(|(_, broken)| !**broken);
            self.crossings = Some(Crossings::new(&self.nodes, whole.map(|(element, _)| element)));
        }
    }

    /// Go on with these broken.
    pub fn go_on(&mut self, broken: Vec<bool>) {
        self.broken = broken;
        if !self.broken.is_empty() {
            self.cross_again();
        }
    }

    /// The same, seen from `origin` [m].
    pub fn from(mut self, origin: &Vector3<f64>) -> Self {
        self.nodes.iter_mut().for_each(|node| *node -= origin);
        self
    }

    /// Where two of its elements touch without a common node.
    pub fn unshared(&self) -> Option<Unshared> {
        let of = |kind| self.elements.iter().filter(move |e| e.kind == kind);
        let lines = of(Kind::Line).map(|line| [line.nodes[0], line.nodes[1]]).collect();
        let faces: Vec<_> = of(Kind::Face).map(|face| face.nodes).collect();
        first_fault(&self.nodes, lines, &faces)
    }

    /// What measures need to know of it at t = 0.
    pub fn at_rest(&self, down: &Vector3<f64>) -> AtRest {
        let centre = self.nodes.iter().sum::<Vector3<f64>>() / self.nodes.len().max(1) as f64;
        AtRest {
            level: self.nodes.iter().map(|n| n.dot(down)).fold(f64::NEG_INFINITY, f64::max),
            centre,
            reach: self.nodes.iter().map(|n| (n - centre).norm()).fold(0.0, f64::max),
        }
    }

    /// True if two elements hold a common node. Numbers beyond the elements, which are crossings, do not.
    pub fn share_a_node(&self, a: u32, b: u32) -> bool {
        let of = |key: u32| self.elements.get(key as usize);
        of(a).zip(of(b)).is_some_and(|(a, b)| a.shares_a_node(b))
    }

    /// `sum N_a^2 / m_a` of a point with these nodes and weights [1/kg]; 0 where masses are not known.
    #[inline]
    pub fn inverse_mass(&self, nodes: [u32; 3], [na, nb, nc]: [f64; 3]) -> f64 {
        let Some(inverse) = &self.inverse_mass else { return 0.0 };
        let [a, b, c] = nodes.map(|n| inverse[n as usize]);
        na * na * a + nb * nb * b + nc * nc * c
    }

    /// In words, with numbers.
    pub fn describe(&self) -> String {
        let count = |kind| self.elements.iter().filter(|e| e.kind == kind).count();
        let [lines, faces, points] = [Kind::Line, Kind::Face, Kind::Point].map(count);
        let nodes = self.nodes.len();
        format!("interface mesh of {nodes} nodes, {lines} lines, {faces} faces, {points} points")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_node_that_nothing_holds_is_a_point_of_its_own() {
        let mesh = InterfaceMesh {
            coordinates: vec![0.0; 18],
            lines: vec![[0, 1]],
            faces: vec![[1, 2, 3]],
            line_radius: vec![0.002],
            masses: vec![1.0, 2.0, 4.0, f64::INFINITY, 1.0, 1.0],
            ..Default::default()
        };
        let contact_mesh = ContactMesh::new(&mesh).expect("valid");
        assert_eq!(contact_mesh.elements[2], Element { kind: Kind::Point, nodes: [4; 3], radius: 0.0 });
        assert_eq!(contact_mesh.elements[3].own_nodes(), [5]);
        assert_eq!(contact_mesh.inverse_mass, Some(vec![1.0, 0.5, 0.25, 0.0, 1.0, 1.0]));
        assert_eq!(contact_mesh.largest_radius, 0.002);
        assert!(contact_mesh.elements[0].shares_a_node(&contact_mesh.elements[1]));
        assert!(!contact_mesh.elements[0].shares_a_node(&contact_mesh.elements[2]));
    }

    #[test]
    fn a_mesh_that_names_a_missing_node_is_refused() {
        let mesh = InterfaceMesh { coordinates: vec![0.0; 3], lines: vec![[0, 1]], ..Default::default() };
        assert!(ContactMesh::new(&mesh).expect_err("node 1 is missing").to_string().contains("names node 1"));
    }
}
