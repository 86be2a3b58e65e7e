//! From the table `[structure]` and its parts to a [`Model`], with every input error located.

use super::base::{Base, Cell, Made};
use super::contact::ContactLines;
use super::{Model, Part};
use crate::config::Config;
use crate::config::structure::{StructureConfig, Where};
use crate::element::PartConfig;
use crate::element::part::{NewElements, PartCell, PartHead};
use crate::read::Key;
use crate::read::mesh::{ElementGroup, MeshElement};
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
        let key = Key { scene, key: "structure".into() };
        key.not_negative(&[("damping", table.damping, "1/s")])?;
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
        model.contact = ContactLines::of(scene, config, &model)?;
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

    /// Refuse a path of equilibrium without loads that grow, and with supports that move or let go.
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
            return scene.refuse(key, "there are no loads that could grow", hint);
        }
        Ok(())
    }

    fn add_groups(&mut self, scene: &Scene, table: &StructureConfig) -> Result<(), Diagnostic> {
        for (key, group) in Key::each(scene, "groups", &table.groups) {
            if group.name == "supports" || self.groups.iter().any(|g| g.name == group.name) {
                let what = format!("there is a group `{}` already", group.name);
                return Err(key.invalid("name", what));
            }
            self.known(&key, &group.nodes)?;
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
        for cell in lines {
            let common =
                table.cable.as_ref().expect("lines in no part are there only with [structure.cable]");
            let first = self.cables.len();
            let ends = cell.nodes.windows(2).map(|pair| [pair[0], pair[1]]);
            self.cables.extend(ends.map(|ends| common.cable(&self.nodes, ends, None)));
            let own = Made { elements: 0..0, cables: first..self.cables.len() };
            cell.from.iter().for_each(|e| made[*e as usize] = own.clone());
        }
        for (key, entry) in Key::each(scene, "cables", &table.cables) {
            self.known(&key, &entry.nodes)?;
            key.positive(&[("length", entry.length.unwrap_or(1.0), "m")])?;
            let own = entry.stated().complete(&key, table.cable.as_ref())?;
            let built = own.cable(&self.nodes, entry.nodes, entry.length);
            let [a, b] = entry.nodes;
            if built.length == 0.0 || a == b {
                let what = format!("the cable between nodes {a} and {b} has no length");
                return Err(key.invalid("nodes", what));
            }
            self.cables.push(built);
        }
        Ok(())
    }

    fn add_elements(&mut self, scene: &Scene, table: &StructureConfig) -> Result<(), Diagnostic> {
        for (key, entry) in Key::each(scene, "springs", &table.springs) {
            key.not_negative(&entry.stiffness.map(|k| ("stiffness", k, "N/m")))?;
            let nodes = self.place(&key, entry.place())?;
            self.springs.extend(nodes.into_iter().map(|node| (node, entry.stiffness)));
        }
        for (key, entry) in Key::each(scene, "dampers", &table.dampers) {
            key.not_negative(&entry.viscosity.map(|c| ("viscosity", c, "N s/m")))?;
            for node in self.place(&key, entry.place())? {
                let own = [0, 1, 2].map(|c| (self.dof(node, c), entry.viscosity[c]));
                self.dashpots.extend(own.into_iter().filter(|(_, c)| *c > 0.0));
            }
        }
        for (key, entry) in Key::each(scene, "masses", &table.masses) {
            key.positive(&[("mass", entry.mass, "kg")])?;
            let nodes = self.place(&key, entry.place())?;
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
            return scene.refuse(&format!("structure.nodes.{node}"), what, hint);
        }
        if config.fem.integrator == crate::config::Integrator::Static {
            return Ok(());
        }
        let parts = &config.structure.parts;
        if let Some(i) = parts.iter().position(|part| part.turns_without_inertia()) {
            let PartHead { name, plural, .. } = parts[i].head();
            let what = format!("the {plural} `{name}` have no density: nothing resists their turning");
            let hint = "write density, for steel 7850; or choose integrator = \"static\"";
            return scene.refuse(&format!("structure.parts.{i}"), what, hint);
        }
        let without_mass = |n: &usize| self.mass[*n] <= 0.0 && !self.fully_held(*n);
        let Some(node) = (0..self.nodes.len()).find(without_mass) else { return Ok(()) };
        let what = format!("node {} is free to move and has no mass", self.node_name(node));
        let hint = "give its cables a density, or it a mass; or choose integrator = \"static\"";
        scene.refuse(&format!("structure.nodes.{node}"), what, hint)
    }

    /// Refuse nodes that are not there.
    fn known(&self, key: &Key, nodes: &[usize]) -> Result<(), Diagnostic> {
        let Some(node) = nodes.iter().find(|node| **node >= self.nodes.len()) else { return Ok(()) };
        let last = self.nodes.len() - 1;
        Err(key.invalid("nodes", format!("there is no node {node}; nodes are 0 to {last}")))
    }

    /// The nodes that an entry names.
    pub(crate) fn place(&self, key: &Key, place: Where) -> Result<Vec<usize>, Diagnostic> {
        let point = match place {
            Where { nodes: Some(nodes), group: None, at: None } => {
                return self.known(key, nodes).map(|()| nodes.to_vec());
            }
            Where { nodes: None, group: Some(name), at: None } => {
                return self.group(key.scene, &key.at("group"), name);
            }
            Where { nodes: None, group: None, at: Some(point) } => Vector3::from(point),
            _ => {
                let what = "name the nodes by exactly one of nodes, group and at";
                return Err(key.scene.invalid(&key.key, what));
            }
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
        key.refuse("at", what, hint)
    }

    /// Tolerance of a point that names a node [m]: half of its shortest cable.
    fn reach(&self, node: usize) -> f64 {
        let ends = self.lines().map(|(line, _)| line).filter(|line| line.contains(&node));
        let span = |line: [usize; 2]| (self.nodes[line[1]] - self.nodes[line[0]]).norm();
        let half = ends.map(|line| 0.5 * span(line)).fold(f64::INFINITY, f64::min);
        if half.is_finite() { half * (1.0 + SAME_POINT) } else { SAME_POINT * self.extent().max(1.0) }
    }
}

impl Model {
    /// Build the parts of the scene; `meshed` are the cells that a mesh gives to each. What becomes of its
    /// elements goes into `made`.
    fn add_parts(
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
                return key.refuse("name", format!("the part `{name}` has no cells"), hint);
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
    fn name_elements(&mut self, groups: Vec<ElementGroup>, made: &[Made]) {
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
    fn number_rotations(&mut self) {
        let mut turns = vec![false; self.nodes.len()];
        for element in self.elements.iter().filter(|e| e.constants().rotates) {
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
    fn number_elements(&mut self, elements: &[MeshElement], made: &[Made]) {
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
            _ if nodes.len() == 1 => format!("{head}, at {}", point(&self.nodes[nodes[0]])),
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
        let part = self.part_of(kind, own);
        let place = part.and_then(|p| members(p).iter().position(|e| *e == own));
        let number = self.element_numbers[kind].get(own).copied().flatten();
        let number = number.unwrap_or(place.unwrap_or(own) as u64);
        part.map_or_else(|| format!("element {number}"), |part| format!("element {number} of {}", part.name))
    }

    /// The named set that an element (`kind` 0) or a cable (1) is in first.
    pub(crate) fn part_of(&self, kind: usize, own: usize) -> Option<&Part> {
        let members = |part: &&Part| [&part.elements, &part.cables][kind].contains(&own);
        self.parts.iter().chain(&self.giving_groups).find(members)
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
