//! From the table `[structure]` to a [`Model`], with every input error located.

use super::Model;
use super::base::{Base, Cell, Made};
use crate::config::Config;
use crate::config::structure::{StructureConfig, Where};
use crate::read::{not_negative, positive, refuse};
use interface_defs::diagnostic::Diagnostic;
use interface_defs::mesh::Group;
use nalgebra::Vector3;
use toolkit::explain::suggestion;
use toolkit::scene::Scene;

/// A point is taken for the node that is not farther away than this, relative to the extent.
const SAME_POINT: f64 = 1e-6;

impl Model {
    /// Build the structure of a scene.
    pub fn build(scene: &Scene, config: &Config) -> Result<Self, Diagnostic> {
        let table = &config.structure;
        let base = Base::new(scene, table)?;
        let mut model = Self {
            cables: Vec::new(),
            elements: Vec::new(),
            ground: 0..0,
            parts: Vec::new(),
            part_count: table.parts.len(),
            turning: Vec::new(),
            turning_number: Vec::new(),
            inertia: Vec::new(),
            dashpots: Vec::new(),
            springs: Vec::new(),
            point_masses: Vec::new(),
            mass: vec![0.0; base.nodes.len()],
            held: vec![false; 3 * base.nodes.len()],
            moving: Vec::new(),
            until: Vec::new(),
            dead_load: vec![0.0; 3 * base.nodes.len()],
            live_load: Vec::new(),
            live_pressures: Vec::new(),
            timed: Vec::new(),
            start_velocity: Vec::new(),
            down: None,
            damping: table.damping,
            added_mass: 0.0,
            groups: base.groups,
            nodes: base.nodes,
            numbers: base.numbers,
            element_numbers: Default::default(),
            warnings: base.warnings,
        };
        not_negative(scene, "structure.damping", table.damping, "1/s")?;
        model.add_groups(scene, table)?;
        let mut made = vec![Made::default(); base.elements.0];
        model.add_cables(scene, table, &base.lines, &mut made)?;
        model.add_parts(scene, table, &base.cells, &mut made)?;
        model.number_elements(&base.element_numbers, &made);
        model.name_elements(base.elements.1, &made);
        model.number_rotations();
        for dof in
            base.held.iter().flat_map(|node| [0, 1, 2].map(|c| model.dof(*node, c))).collect::<Vec<_>>()
        {
            model.held[dof] = true;
        }
        model.add_elements(scene, table)?;
        model.add_supports(scene, table)?;
        model.lump();
        model.add_ground(scene, config)?;
        model.load(scene, config)?;
        model.check_path(scene, config)?;
        model.check_held_together(scene, config, base.framed)?;
        // A mesh file may have a group of that name; then it is the user's.
        if model.groups.iter().all(|g| g.name != "supports") {
            let held: Vec<u32> =
                (0..model.nodes.len()).filter(|n| model.held_at_first(*n)).map(|n| n as u32).collect();
            model.groups.push(Group { name: "supports".into(), nodes: held });
        }
        crate::model::validation::judge(scene, config, &mut model)?;
        Ok(model)
    }

    /// What grows along a path of equilibrium, and what a path takes not.
    fn check_path(&self, scene: &Scene, config: &Config) -> Result<(), Diagnostic> {
        if config.fem.path_speed.is_none() {
            return Ok(());
        }
        if !self.moving.is_empty() {
            return Err(scene.invalid("fem.path_speed", "a path under loads takes no supports that move"));
        }
        if !self.until.is_empty() {
            return Err(scene.invalid("fem.path_speed", "a path under loads takes no supports that let go"));
        }
        if self.live_load.iter().all(|p| *p == 0.0) && self.live_pressures.is_empty() {
            let hint = "write [[structure.loads]] or [[structure.pressures]] as they are at the factor 1";
            return refuse(scene, "fem.path_speed", "there are no loads that could grow", hint);
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
            for node in &group.nodes {
                self.known(scene, &format!("{key}.nodes"), *node)?;
            }
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
            for node in entry.nodes {
                self.known(scene, &format!("{key}.nodes"), node)?;
            }
            if let Some(length) = entry.length {
                positive(scene, &format!("{key}.length"), length, "m")?;
            }
            let own = entry.stated().complete(scene, &key, table.cable.as_ref())?;
            let built = own.cable(&self.nodes, entry.nodes, entry.length);
            if built.length == 0.0 || entry.nodes[0] == entry.nodes[1] {
                let what = format!(
                    "the cable between nodes {} and {} has no length",
                    entry.nodes[0], entry.nodes[1]
                );
                return Err(scene.invalid(&format!("{key}.nodes"), what));
            }
            self.cables.push(built);
        }
        Ok(())
    }

    fn add_elements(&mut self, scene: &Scene, table: &StructureConfig) -> Result<(), Diagnostic> {
        for (i, entry) in table.springs.iter().enumerate() {
            let key = format!("structure.springs.{i}");
            for stiffness in entry.stiffness {
                not_negative(scene, &format!("{key}.stiffness"), stiffness, "N/m")?;
            }
            for node in self.place(scene, &key, entry.place())? {
                self.springs.push((node, entry.stiffness));
            }
        }
        for (i, entry) in table.dampers.iter().enumerate() {
            let key = format!("structure.dampers.{i}");
            for viscosity in entry.viscosity {
                not_negative(scene, &format!("{key}.viscosity"), viscosity, "N s/m")?;
            }
            for node in self.place(scene, &key, entry.place())? {
                let own = (0..3).map(|c| (self.dof(node, c), entry.viscosity[c])).filter(|(_, c)| *c > 0.0);
                let own: Vec<_> = own.collect();
                self.dashpots.extend(own);
            }
        }
        for (i, entry) in table.masses.iter().enumerate() {
            let key = format!("structure.masses.{i}");
            positive(scene, &format!("{key}.mass"), entry.mass, "kg")?;
            for node in self.place(scene, &key, entry.place())? {
                self.point_masses.push((node, entry.mass));
            }
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
        let mut used = vec![false; self.nodes.len()];
        let ends = self.cables.iter().flat_map(|c| c.nodes);
        let ends = ends.chain(self.elements.iter().flat_map(|e| e.nodes().to_vec()));
        let others = self.springs.iter().map(|s| s.0).chain(self.point_masses.iter().map(|m| m.0));
        ends.chain(others).for_each(|node| used[node] = true);
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
            let (key, part) = (format!("structure.parts.{i}"), &parts[i]);
            let what = format!(
                "the {} `{}` have no density: nothing resists their turning",
                part.plural(),
                part.name()
            );
            let hint = "write density, for steel 7850; or choose integrator = \"static\"";
            return refuse(scene, &key, what, hint);
        }
        match (0..self.nodes.len()).find(|n| self.mass[*n] <= 0.0 && !self.fully_held(*n)) {
            Some(node) => Err(scene
                .invalid(
                    &format!("structure.nodes.{node}"),
                    format!("node {} is free to move and has no mass", self.node_name(node)),
                )
                .try_instead("give its cables a density, or it a mass; or choose integrator = \"static\"")),
            None => Ok(()),
        }
    }

    fn known(&self, scene: &Scene, key: &str, node: usize) -> Result<(), Diagnostic> {
        if node < self.nodes.len() {
            return Ok(());
        }
        Err(scene.invalid(key, format!("there is no node {node}; nodes are 0 to {}", self.nodes.len() - 1)))
    }

    /// The nodes that an entry names.
    pub(crate) fn place(&self, scene: &Scene, key: &str, place: Where) -> Result<Vec<usize>, Diagnostic> {
        match place {
            Where { nodes: Some(nodes), group: None, at: None } => {
                for node in nodes {
                    self.known(scene, &format!("{key}.nodes"), *node)?;
                }
                Ok(nodes.to_vec())
            }
            Where { nodes: None, group: Some(name), at: None } => {
                let group = self.groups.iter().find(|g| g.name == name).ok_or_else(|| {
                    let names: Vec<_> = self.groups.iter().map(|g| g.name.as_str()).collect();
                    let known = suggestion(name, &names).unwrap_or_default();
                    scene
                        .invalid(&format!("{key}.group"), format!("there is no group `{name}`"))
                        .try_instead(if names.is_empty() { "there are no groups here".into() } else { known })
                })?;
                Ok(group.nodes.iter().map(|n| *n as usize).collect())
            }
            Where { nodes: None, group: None, at: Some(point) } => {
                let point = Vector3::from(point);
                let distance = |n: &usize| (self.nodes[*n] - point).norm();
                let nearest = (0..self.nodes.len()).min_by(|a, b| distance(a).total_cmp(&distance(b)));
                match nearest {
                    Some(node) if distance(&node) <= self.reach(node) => Ok(vec![node]),
                    _ => {
                        let near = nearest.map_or_else(String::new, |n| {
                            format!(
                                "; the nearest, node {}, is {:.4} m away",
                                self.node_name(n),
                                distance(&n)
                            )
                        });
                        let [x, y, z] = [point.x, point.y, point.z];
                        let what = format!("no node of the structure lies at ({x}, {y}, {z}){near}");
                        Err(scene.invalid(&format!("{key}.at"), what).try_instead(
                            "points count in the structure as modelled, before form finding; half a cable's length is tolerated",
                        ))
                    }
                }
            }
            _ => Err(scene.invalid(key, "name the nodes by exactly one of nodes, group and at")),
        }
    }

    /// How far a point may lie from a node that it names [m]: half of its shortest cable.
    fn reach(&self, node: usize) -> f64 {
        let ends = self.lines().map(|(line, _)| line).filter(|line| line.contains(&node));
        let span = |line: [usize; 2]| (self.nodes[line[1]] - self.nodes[line[0]]).norm();
        let half = ends.map(|line| 0.5 * span(line)).fold(f64::INFINITY, f64::min);
        if half.is_finite() { half * (1.0 + SAME_POINT) } else { SAME_POINT * self.extent().max(1.0) }
    }
}
