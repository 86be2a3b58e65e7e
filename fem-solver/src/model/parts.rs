//! From `[[structure.parts]]` to elements, with every input error located.

use super::base::{Cell, Made};
use super::{Model, Part};
use crate::config::structure::StructureConfig;
use crate::element::PartConfig;
use crate::element::part::{Key, NewElements, PartCell, PartHead};
use crate::read::mesh::{ElementGroup, MeshElement};
use interface_defs::diagnostic::Diagnostic;
use interface_defs::mesh::Group;
use nalgebra::Vector3;
use toolkit::scene::Scene;

impl Model {
    /// Build the parts of the scene; `meshed` are the cells that a mesh gives to each. What becomes of its
    /// elements goes into `made`.
    pub(super) fn add_parts(
        &mut self,
        scene: &Scene,
        table: &StructureConfig,
        meshed: &[Vec<Cell>],
        made: &mut [Made],
    ) -> Result<(), Diagnostic> {
        for (i, config) in table.parts.iter().enumerate() {
            let key = Key { scene, key: format!("structure.parts.{i}") };
            let PartHead { name, cells: own, .. } = config.head();
            if name.is_empty() || self.parts.iter().any(|p| p.name == name) {
                let what = format!("there is a part `{name}` already, or it has no name");
                return Err(key.invalid("name", what));
            }
            if own.is_empty() && made.is_empty() {
                let hint = "write cells = [[node, node, ...], ...], or use the name of a group of a mesh";
                return Err(key.invalid("name", format!("the part `{name}` has no cells")).try_instead(hint));
            }
            let first = (self.elements.len(), self.cables.len());
            let cells = own.iter().chain(meshed[i].iter().map(|cell| &cell.nodes));
            self.warnings.extend(config.remark(cells.filter(|cell| cell.len() == 4).count()));
            let common = table.cable.as_ref();
            let cell = PartCell { key: &key, place: "name", nodes: &[], positions: &[], common };
            for (at, nodes) in own.iter().enumerate() {
                self.add_cell(config, &PartCell { place: &format!("cells.{at}"), nodes, ..cell })?;
            }
            for Cell { nodes, from } in &meshed[i] {
                let (elements, cables) = (self.elements.len(), self.cables.len());
                self.add_cell(config, &PartCell { nodes, ..cell })?;
                let own = Made { elements: elements..self.elements.len(), cables: cables..self.cables.len() };
                from.iter().for_each(|e| made[*e as usize] = own.clone());
            }
            let new = !own.is_empty() && self.groups.iter().all(|g| g.name != name);
            if new && name != "supports" {
                let mut nodes: Vec<u32> = own.iter().flatten().map(|n| *n as u32).collect();
                nodes.sort_unstable();
                nodes.dedup();
                self.groups.push(Group { name: name.into(), nodes });
            }
            self.parts.push(Part {
                name: name.into(),
                elements: (first.0..self.elements.len()).collect(),
                cables: (first.1..self.cables.len()).collect(),
            });
        }
        Ok(())
    }

    /// Name what became of the groups of a mesh that are no parts.
    pub(super) fn name_elements(&mut self, groups: Vec<ElementGroup>, made: &[Made]) {
        for group in groups {
            if self.parts.iter().any(|p| p.name == group.name) {
                continue;
            }
            let made = || group.elements.iter().map(|e| made[*e as usize].clone());
            let mut elements: Vec<usize> = made().flat_map(|m| m.elements).collect();
            let mut cables: Vec<usize> = made().flat_map(|m| m.cables).collect();
            // Several lines of a mesh are one sliding rope.
            elements.sort_unstable();
            elements.dedup();
            cables.sort_unstable();
            if !elements.is_empty() || !cables.is_empty() {
                self.parts.push(Part { name: group.name, elements, cables });
            }
        }
    }

    fn check_cell(&self, config: &PartConfig, at: &PartCell) -> Result<(), Diagnostic> {
        let cell = at.nodes;
        let (fewest, most) = config.head().nodes;
        if cell.len() < fewest || cell.len() > most {
            let wanted = match most {
                usize::MAX => format!("{fewest} or more"),
                _ if most == fewest => fewest.to_string(),
                _ => format!("{fewest} to {most}"),
            };
            let what = format!("an element of this part has {} nodes, it takes {wanted}", cell.len());
            return Err(at.invalid(what));
        }
        if let Some(node) = cell.iter().find(|n| **n >= self.nodes.len()) {
            let what = format!("there is no node {node}; nodes are 0 to {}", self.nodes.len() - 1);
            return Err(at.invalid(what));
        }
        for pair in cell.windows(2) {
            if self.nodes[pair[0]] == self.nodes[pair[1]] {
                let [a, b] = [pair[0], pair[1]].map(|n| self.node_name(n));
                let what = format!("there is no distance between its nodes {a} and {b}");
                return Err(at.invalid(what));
            }
        }
        Ok(())
    }

    /// Make the elements of a cell.
    fn add_cell(&mut self, config: &PartConfig, cell: &PartCell) -> Result<(), Diagnostic> {
        self.check_cell(config, cell)?;
        let Self { nodes, elements, cables, .. } = self;
        config.build(&PartCell { positions: nodes, ..*cell }, &mut NewElements { elements, cables })
    }

    /// Number the nodes that have rotations, and set their memory aside.
    pub(super) fn number_rotations(&mut self) {
        let mut turns = vec![false; self.nodes.len()];
        for element in self.elements.iter().filter(|e| e.rotates()) {
            element.nodes().iter().for_each(|n| turns[*n] = true);
        }
        self.turning = (0..turns.len()).filter(|n| turns[*n]).collect();
        self.turning_number = vec![None; turns.len()];
        for (number, node) in self.turning.iter().enumerate() {
            self.turning_number[*node] = Some(number);
        }
        self.inertia = vec![0.0; self.turning.len()];
        self.held.resize(self.dof_count(), false);
        self.dead_load.resize(self.dof_count(), 0.0);
    }
}

impl Model {
    /// Remember what the mesh file calls its `elements`, where there is one; `made` says what became of each.
    pub(super) fn number_elements(&mut self, elements: &[MeshElement], made: &[Made]) {
        self.element_numbers = [vec![None; self.elements.len()], vec![None; self.cables.len()]];
        let mut twice = [vec![false; self.elements.len()], vec![false; self.cables.len()]];
        let filed = if self.numbers.is_empty() { &[] } else { elements };
        for (element, made) in filed.iter().zip(made) {
            for (kind, range) in [made.elements.clone(), made.cables.clone()].into_iter().enumerate() {
                for i in range {
                    twice[kind][i] |= self.element_numbers[kind][i].is_some();
                    self.element_numbers[kind][i] = Some(element.number).filter(|_| !twice[kind][i]);
                }
            }
        }
    }

    /// Element number `element` as a member of a group, or its line number `line`: `element 3 of posts, (x y z) to (x y z)`.
    /// Its number is that of the mesh file, else it counts from 0 in its part.
    pub fn member_name(&self, element: usize, line: Option<usize>) -> String {
        let nodes = self.elements[element].nodes();
        let head = self.numbered(0, element, |part| &part.elements);
        let lines = self.elements[element].lines();
        match line.and_then(|line| lines.get(line)) {
            Some(ends) => format!("{head}, its segment {}", self.ends_name(*ends)),
            // Closed: a ring.
            None if lines.len() == nodes.len() => {
                let sum: Vector3<f64> = nodes.iter().map(|n| self.nodes[*n]).sum();
                format!("{head}, around {}", point(&(sum / nodes.len() as f64)))
            }
            None => format!("{head}, {}", self.ends_name([nodes[0], nodes[nodes.len() - 1]])),
        }
    }

    /// The same of cable number `cable`.
    pub fn cable_name(&self, cable: usize) -> String {
        let head = self.numbered(1, cable, |part| &part.cables);
        format!("{head}, {}", self.ends_name(self.cables[cable].nodes))
    }

    fn numbered(&self, kind: usize, own: usize, members: impl Fn(&Part) -> &Vec<usize>) -> String {
        let part = self.parts.iter().find(|p| members(p).contains(&own));
        let place = part.and_then(|p| members(p).iter().position(|e| *e == own));
        let number = self.element_numbers[kind].get(own).copied().flatten();
        let number = number.unwrap_or(place.unwrap_or(own) as u64);
        part.map_or_else(|| format!("element {number}"), |part| format!("element {number} of {}", part.name))
    }

    fn ends_name(&self, ends: [usize; 2]) -> String {
        let [a, b] = ends.map(|node| point(&self.nodes[node]));
        format!("{a} to {b}")
    }
}

/// A point [m], to a tenth of a millimetre.
fn point(p: &Vector3<f64>) -> String {
    // Adding 0 makes 0 of -0.
    let [x, y, z] = [p.x, p.y, p.z].map(|c| (1e4 * c).round() / 1e4 + 0.0);
    format!("({x:?} {y:?} {z:?})")
}
