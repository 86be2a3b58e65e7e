//! From the table `[structure]` to a [`Model`], with every input error located.

use super::Model;
use super::base::{Base, Cell, Made};
use crate::config::Config;
use crate::config::structure::{StructureConfig, Where};
use crate::element::part::PartHead;
use crate::read::{not_negative, positive, refuse};
use interface_defs::diagnostic::Diagnostic;
use interface_defs::mesh::Group;
use nalgebra::Vector3;
use toolkit::scene::Scene;

/// A point is taken for the node that is not farther away than this, relative to the extent.
const SAME_POINT: f64 = 1e-6;

impl Model {
    /// Build the structure of a scene.
    pub fn build(scene: &Scene, config: &Config) -> Result<Self, Diagnostic> {
        let table = &config.structure;
        let Base { mesh, lines, cells, held, framed } = Base::new(scene, table)?;
        let mut model = Self {
            part_count: table.parts.len(),
            mass: vec![0.0; mesh.nodes.len()],
            held: vec![false; 3 * mesh.nodes.len()],
            dead_load: vec![0.0; 3 * mesh.nodes.len()],
            damping: table.damping,
            groups: mesh.node_groups,
            nodes: mesh.nodes,
            numbers: mesh.numbers,
            warnings: mesh.warnings,
            ..Self::default()
        };
        not_negative(scene, "structure.damping", table.damping, "1/s")?;
        model.add_groups(scene, table)?;
        let mut made = vec![Made::default(); mesh.elements.len()];
        model.add_cables(scene, table, &lines, &mut made)?;
        model.add_parts(scene, table, &cells, &mut made)?;
        model.number_elements(&mesh.elements, &made);
        model.name_elements(mesh.element_groups, &made);
        model.number_rotations();
        for (node, c) in held.iter().flat_map(|node| [0, 1, 2].map(|c| (*node, c))) {
            let dof = model.dof(node, c);
            model.held[dof] = true;
        }
        model.add_elements(scene, table)?;
        model.add_supports(scene, table)?;
        model.lump();
        model.add_ground(scene, config)?;
        model.load(scene, config)?;
        model.check_path(scene, config)?;
        model.check_held_together(scene, config, framed)?;
        // A mesh file may have a group of that name; then it is the user's.
        if model.groups.iter().all(|g| g.name != "supports") {
            let held = (0..model.nodes.len()).filter(|n| model.held_at_first(*n)).map(|n| n as u32);
            let nodes = held.collect();
            model.groups.push(Group { name: "supports".into(), nodes });
        }
        crate::model::validation::judge(scene, config, &mut model)?;
        Ok(model)
    }

    /// What grows along a path of equilibrium, and what a path takes not.
    fn check_path(&self, scene: &Scene, config: &Config) -> Result<(), Diagnostic> {
        let key = "fem.path_speed";
        if config.fem.path_speed.is_none() {
            return Ok(());
        }
        if !self.moving.is_empty() {
            return Err(scene.invalid(key, "a path under loads takes no supports that move"));
        }
        if !self.until.is_empty() {
            return Err(scene.invalid(key, "a path under loads takes no supports that let go"));
        }
        if self.live_load.iter().all(|p| *p == 0.0) && self.live_pressures.is_empty() {
            let hint = "write [[structure.loads]] or [[structure.pressures]] as they are at the factor 1";
            return refuse(scene, key, "there are no loads that could grow", hint);
        }
        Ok(())
    }

    fn add_groups(&mut self, scene: &Scene, table: &StructureConfig) -> Result<(), Diagnostic> {
        for (i, group) in table.groups.iter().enumerate() {
            let key = format!("structure.groups.{i}");
            if group.name == "supports" || self.groups.iter().any(|g| g.name == group.name) {
                let what = format!("there is a group `{}` already", group.name);
                return Err(scene.invalid(&format!("{key}.name"), what));
            }
            self.known(scene, &format!("{key}.nodes"), &group.nodes)?;
            let nodes = group.nodes.iter().map(|n| *n as u32).collect();
            self.groups.push(Group { name: group.name.clone(), nodes });
        }
        Ok(())
    }

    fn add_cables(
        &mut self,
        scene: &Scene,
        table: &StructureConfig,
        lines: &[Cell],
        made: &mut [Made],
    ) -> Result<(), Diagnostic> {
        if let Some(common) = &table.cable {
            common.check(scene, "structure.cable")?;
        }
        for cell in lines {
            let common =
                table.cable.as_ref().expect("lines in no part are there only with [structure.cable]");
            let first = self.cables.len();
            let ends = cell.nodes.windows(2).map(|pair| [pair[0], pair[1]]);
            self.cables.extend(ends.map(|ends| common.cable(&self.nodes, ends, None)));
            let own = Made { elements: 0..0, cables: first..self.cables.len() };
            cell.from.iter().for_each(|e| made[*e as usize] = own.clone());
        }
        for (i, entry) in table.cables.iter().enumerate() {
            let key = format!("structure.cables.{i}");
            let nodes_key = format!("{key}.nodes");
            self.known(scene, &nodes_key, &entry.nodes)?;
            if let Some(length) = entry.length {
                positive(scene, &format!("{key}.length"), length, "m")?;
            }
            let own = entry.stated().complete(scene, &key, table.cable.as_ref())?;
            let built = own.cable(&self.nodes, entry.nodes, entry.length);
            let [a, b] = entry.nodes;
            if built.length == 0.0 || a == b {
                let what = format!("the cable between nodes {a} and {b} has no length");
                return Err(scene.invalid(&nodes_key, what));
            }
            self.cables.push(built);
        }
        Ok(())
    }

    fn add_elements(&mut self, scene: &Scene, table: &StructureConfig) -> Result<(), Diagnostic> {
        for (i, entry) in table.springs.iter().enumerate() {
            let key = format!("structure.springs.{i}");
            let own = format!("{key}.stiffness");
            entry.stiffness.iter().try_for_each(|k| not_negative(scene, &own, *k, "N/m"))?;
            let nodes = self.place(scene, &key, entry.place())?;
            self.springs.extend(nodes.into_iter().map(|node| (node, entry.stiffness)));
        }
        for (i, entry) in table.dampers.iter().enumerate() {
            let key = format!("structure.dampers.{i}");
            let own = format!("{key}.viscosity");
            entry.viscosity.iter().try_for_each(|c| not_negative(scene, &own, *c, "N s/m"))?;
            for node in self.place(scene, &key, entry.place())? {
                let own = [0, 1, 2].map(|c| (self.dof(node, c), entry.viscosity[c]));
                self.dashpots.extend(own.into_iter().filter(|(_, c)| *c > 0.0));
            }
        }
        for (i, entry) in table.masses.iter().enumerate() {
            let key = format!("structure.masses.{i}");
            positive(scene, &format!("{key}.mass"), entry.mass, "kg")?;
            let nodes = self.place(scene, &key, entry.place())?;
            self.point_masses.extend(nodes.into_iter().map(|node| (node, entry.mass)));
        }
        Ok(())
    }

    fn lump(&mut self) {
        for cable in &self.cables {
            for node in cable.nodes {
                self.mass[node] += cable.nodal_mass();
            }
        }
        for element in &self.elements {
            let nodes = element.nodes();
            let (mut mass, mut inertia) = (vec![0.0; nodes.len()], vec![0.0; nodes.len()]);
            element.lump(&mut mass, &mut inertia);
            for (i, node) in nodes.iter().enumerate() {
                self.mass[*node] += mass[i];
                if let Some(number) = self.turning_number[*node] {
                    self.inertia[number] += inertia[i];
                }
            }
        }
        for (node, mass) in &self.point_masses {
            self.mass[*node] += mass;
        }
    }

    /// Every node must be part of an element, except those of a frame (`framed`) that are held; every
    /// one that moves must have a mass, unless only statics is asked for.
    fn check_held_together(&self, scene: &Scene, config: &Config, framed: bool) -> Result<(), Diagnostic> {
        let used = self.used();
        let lonely = |node: &usize| !(used[*node] || framed && self.held_at_first(*node));
        if let Some(node) = (0..self.nodes.len()).find(lonely) {
            let what = format!("node {} is held by no element", self.node_name(node));
            let hint = "connect it with a cable, give it a mass or a spring, or remove it";
            return refuse(scene, &format!("structure.nodes.{node}"), what, hint);
        }
        if config.fem.integrator == crate::config::Integrator::Static {
            return Ok(());
        }
        let parts = &config.structure.parts;
        if let Some(i) = parts.iter().position(|part| part.turns_without_inertia()) {
            let PartHead { name, plural, .. } = parts[i].head();
            let what = format!("the {plural} `{name}` have no density: nothing resists their turning");
            let hint = "write density, for steel 7850; or choose integrator = \"static\"";
            return refuse(scene, &format!("structure.parts.{i}"), what, hint);
        }
        let without_mass = |n: &usize| self.mass[*n] <= 0.0 && !self.fully_held(*n);
        let Some(node) = (0..self.nodes.len()).find(without_mass) else { return Ok(()) };
        let what = format!("node {} is free to move and has no mass", self.node_name(node));
        let hint = "give its cables a density, or it a mass; or choose integrator = \"static\"";
        refuse(scene, &format!("structure.nodes.{node}"), what, hint)
    }

    fn known(&self, scene: &Scene, key: &str, nodes: &[usize]) -> Result<(), Diagnostic> {
        match nodes.iter().find(|node| **node >= self.nodes.len()) {
            None => Ok(()),
            Some(node) => {
                let last = self.nodes.len() - 1;
                Err(scene.invalid(key, format!("there is no node {node}; nodes are 0 to {last}")))
            }
        }
    }

    /// The nodes that an entry names.
    pub(crate) fn place(&self, scene: &Scene, key: &str, place: Where) -> Result<Vec<usize>, Diagnostic> {
        let point = match place {
            Where { nodes: Some(nodes), group: None, at: None } => {
                return self.known(scene, &format!("{key}.nodes"), nodes).map(|()| nodes.to_vec());
            }
            Where { nodes: None, group: Some(name), at: None } => {
                return self.group(scene, &format!("{key}.group"), name);
            }
            Where { nodes: None, group: None, at: Some(point) } => Vector3::from(point),
            _ => return Err(scene.invalid(key, "name the nodes by exactly one of nodes, group and at")),
        };
        let distance = |n: usize| (self.nodes[n] - point).norm();
        let nearest = (0..self.nodes.len()).min_by(|a, b| distance(*a).total_cmp(&distance(*b)));
        if let Some(node) = nearest.filter(|node| distance(*node) <= self.reach(*node)) {
            return Ok(vec![node]);
        }
        let near = nearest.map_or_else(String::new, |n| {
            format!("; the nearest, node {}, is {:.4} m away", self.node_name(n), distance(n))
        });
        let [x, y, z] = point.into();
        let what = format!("no node of the structure lies at ({x}, {y}, {z}){near}");
        let hint = "points count in the structure as modelled, before form finding; half a cable's length is tolerated";
        refuse(scene, &format!("{key}.at"), what, hint)
    }

    /// How far a point may lie from a node that it names [m]: half of its shortest cable.
    fn reach(&self, node: usize) -> f64 {
        let ends = self.lines().map(|(line, _)| line).filter(|line| line.contains(&node));
        let span = |line: [usize; 2]| (self.nodes[line[1]] - self.nodes[line[0]]).norm();
        let half = ends.map(|line| 0.5 * span(line)).fold(f64::INFINITY, f64::min);
        if half.is_finite() { half * (1.0 + SAME_POINT) } else { SAME_POINT * self.extent().max(1.0) }
    }
}
