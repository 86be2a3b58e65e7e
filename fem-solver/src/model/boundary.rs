//! Boundary conditions: supports, which hold, until when, and which move; weight, nodal loads, pressure; and what moves at t = 0.

use super::pressure::{Face, Motion, TimedLoad};
use super::{Model, Part};
use crate::config::structure::{StructureConfig, SupportEntry, TurningConfig};
use crate::config::{Config, Integrator};
use crate::element::SupportSpring;
use crate::element::material::Rupture;
use crate::read::Key;
use interface_defs::diagnostic::Diagnostic;
use nalgebra::Vector3;
use std::collections::HashMap;
use toolkit::explain::suggestion;
use toolkit::scene::Scene;

/// Part of the extent of the structure below which a motion is rounding.
const ROUNDING: f64 = 1e-12;

impl Model {
    /// All supports of the scene.
    pub(super) fn add_supports(&mut self, scene: &Scene, table: &StructureConfig) -> Result<(), Diagnostic> {
        self.giving = self.elements.len()..self.elements.len();
        let mut until = vec![f64::NEG_INFINITY; self.dof_count()];
        for (key, entry) in Key::each(scene, "supports", &table.supports) {
            check_support(&key, entry)?;
            let mut moves = false;
            let nodes = self.place(&key, entry.place())?;
            self.add_springs(&nodes, entry);
            for node in nodes {
                for dof in self.supported(node, entry) {
                    match entry.released_at {
                        Some(time) => until[dof] = until[dof].max(time),
                        None => self.held[dof] = true,
                    }
                }
                moves |= self.move_support(&key, node, entry)?;
            }
            let angles = entry.turning.iter().flat_map(|turning| &turning.angles);
            if !moves && angles.into_iter().any(|row| row[1] != 0.0) {
                let what = "nothing turns: its nodes lie on the axis, or it holds them in no direction in which they would move";
                let hint = "rotations = \"xyz\" turns the ends of beams at the nodes as well";
                return key.refuse("turning", what, hint);
            }
        }
        // What another support holds for ever is not let go.
        until.iter_mut().zip(&self.held).filter(|(_, held)| **held).for_each(|(t, _)| *t = f64::NEG_INFINITY);
        if until.iter().any(|t| t.is_finite()) {
            self.until = until;
        }
        self.check_springs(scene, table)
    }

    /// A spring at each of these nodes, where the entry says that it gives way.
    fn add_springs(&mut self, nodes: &[usize], entry: &SupportEntry) {
        let Some(stiffness) = entry.stiffness else { return };
        let rupture = Rupture { force: entry.strength.unwrap_or(f64::INFINITY), ..Rupture::NEVER };
        let directions = Vector3::from(['x', 'y', 'z'].map(|c| f64::from(entry.directions.contains(c))));
        let first = self.elements.len();
        for node in nodes {
            self.elements.push(SupportSpring { node: [*node], directions, stiffness, rupture }.into());
            self.element_numbers[0].push(None);
        }
        self.giving.end = self.elements.len();
        let name = entry.group.clone().unwrap_or_else(|| "supports".into());
        let elements = (first..self.giving.end).collect();
        self.giving_groups.push(Part { name, elements, cables: Vec::new() });
    }

    /// Refuse a spring where another support holds its node.
    fn check_springs(&self, scene: &Scene, table: &StructureConfig) -> Result<(), Diagnostic> {
        let rows = table.supports.iter().enumerate().filter(|(_, entry)| entry.stiffness.is_some());
        for ((i, _), group) in rows.zip(&self.giving_groups) {
            let nodes = group.elements.iter().map(|element| self.elements[*element].nodes()[0]);
            for node in nodes {
                let springs = self.elements[self.giving.clone()].iter().filter(|s| s.nodes() == [node]);
                if springs.count() > 1 || (0..3).any(|c| self.held_first(self.dof(node, c))) {
                    let what =
                        format!("another support holds node {}: it cannot give way", self.node_name(node));
                    let hint =
                        "name each node in one row of supports, with all of its directions and rotations";
                    return scene.refuse(&format!("structure.supports.{i}.stiffness"), what, hint);
                }
            }
        }
        Ok(())
    }

    /// Degrees of freedom of a node that an entry supports.
    fn supported(&self, node: usize, entry: &SupportEntry) -> Vec<usize> {
        let letters = |of: &str| ['x', 'y', 'z'].map(|c| of.contains(c));
        let (along, about) = (letters(&entry.directions), letters(&entry.rotations));
        let along = if entry.stiffness.is_some() { [false; 3] } else { along };
        let directions = (0..3).filter(|c| along[*c]).map(|c| self.dof(node, c));
        directions.chain((0..3).filter(|c| about[*c]).filter_map(|c| self.rotation(node, c))).collect()
    }

    /// The motion that an entry prescribes for a node, if any. Whether it moves anything.
    fn move_support(&mut self, key: &Key, node: usize, entry: &SupportEntry) -> Result<bool, Diagnostic> {
        let supported = self.supported(node, entry);
        let (name, rows, motions) = match &entry.turning {
            Some(turning) => ("turning", "turning.angles", self.turns(node, turning)),
            None if entry.motion.is_empty() => return Ok(false),
            None => ("motion", "motion", self.moves(node, &entry.motion)),
        };
        let mut moves = false;
        for (dof, motion) in motions.map_err(|what| key.invalid(rows, what))? {
            let direction = self.dof_name(dof);
            if !supported.contains(&dof) {
                if entry.turning.is_none() && motion.size() > 0.0 {
                    let (size, directions) = (motion.size(), &entry.directions);
                    let what = format!(
                        "{direction} is to move by up to {size} m, and directions = \"{directions}\" does not hold it there"
                    );
                    let hint = "name all directions of the motion, or write 0.0 for this one";
                    return key.refuse(name, what, hint);
                }
                continue;
            }
            if self.moving.iter().any(|(other, _)| *other == dof) {
                return Err(key.invalid(name, format!("{direction} has two motions")));
            }
            moves |= motion.size() > ROUNDING * self.extent();
            self.moving.push((dof, motion));
        }
        Ok(moves)
    }

    /// Straight motions of a node by rows of displacements.
    fn moves(&self, node: usize, rows: &[[f64; 4]]) -> Result<Vec<(usize, Motion)>, String> {
        let along =
            |c: usize| Ok((self.dof(node, c), Motion::new(rows.iter().map(|row| [row[0], row[1 + c]]))?));
        (0..3).map(along).collect()
    }

    /// Motions of a node that turns about an axis: its place on a circle, its rotation by the angle.
    fn turns(&self, node: usize, turning: &TurningConfig) -> Result<Vec<(usize, Motion)>, String> {
        let axis = Vector3::from(turning.axis).try_normalize(0.0).unwrap_or_default();
        let arm = self.nodes[node] - Vector3::from(turning.through);
        let radius = arm - axis * axis.dot(&arm);
        let ahead = axis.cross(&radius);
        let rows = |factor: f64| turning.angles.iter().map(move |[time, angle]| [*time, factor * angle]);
        let mut all = Vec::new();
        for c in 0..3 {
            all.push((self.dof(node, c), Motion::new(rows(1.0))?.on_circle(radius[c], ahead[c])));
            if let Some(dof) = self.rotation(node, c) {
                all.push((dof, Motion::new(rows(axis[c]))?));
            }
        }
        Ok(all)
    }

    /// Whether a support holds a degree of freedom in the step of `h` from `start` [s]: one that lets go does so at the end
    /// of a step that is nearest.
    pub fn holds(&self, dof: usize, start: f64, h: f64) -> bool {
        self.held[dof] || self.until.get(dof).is_some_and(|until| *until > start + 0.5 * h)
    }

    /// Whether a support holds a degree of freedom, if not for ever.
    pub fn held_first(&self, dof: usize) -> bool {
        self.held[dof] || self.until.get(dof).is_some_and(|until| *until > 0.0)
    }

    /// Whether a node is held in all directions, or by a support that gives way, if not for ever.
    pub fn held_at_first(&self, node: usize) -> bool {
        (0..3).all(|c| self.held_first(self.dof(node, c))) || self.gives_way(node)
    }

    /// Degrees of freedom that supports let go.
    pub fn released(&self) -> Vec<usize> {
        (0..self.until.len()).filter(|dof| self.until[*dof].is_finite()).collect()
    }

    /// Weight and all loads of the scene.
    pub(super) fn load(&mut self, scene: &Scene, config: &Config) -> Result<(), Diagnostic> {
        let gravity = Vector3::from(config.gravity);
        if config.structure.dead_load && gravity.norm() > 0.0 {
            self.down = Some(gravity.normalize());
            for node in 0..self.nodes.len() {
                for c in 0..3 {
                    let dof = self.dof(node, c);
                    self.dead_load[dof] += self.mass[node] * gravity[c];
                }
            }
        }
        if config.fem.path_speed.is_some() {
            self.live_load = vec![0.0; self.dof_count()];
        }
        for (key, entry) in Key::each(scene, "loads", &config.structure.loads) {
            let mut forces = Vec::new();
            for node in self.place(&key, entry.place())? {
                let own = self.vectors(&key, "moment", node, [entry.force, entry.moment])?;
                forces.extend(own);
            }
            if let Some(factor) = history(config, &key, &entry.history)? {
                let node_count = self.node_count();
                self.timed.push(TimedLoad { factor, forces, pressure: 0.0, faces: Vec::new(), node_count });
                continue;
            }
            let to = if config.fem.path_speed.is_some() { &mut self.live_load } else { &mut self.dead_load };
            forces.iter().for_each(|(dof, force)| to[*dof] += force);
        }
        self.press(scene, config)?;
        self.set_in_motion(scene, config)
    }

    /// Degrees of freedom of a node with the entries of two vectors: along the axes, and about them. The second one has the
    /// key `name`.
    fn vectors(
        &self,
        key: &Key,
        name: &str,
        node: usize,
        [along, about]: [[f64; 3]; 2],
    ) -> Result<Vec<(usize, f64)>, Diagnostic> {
        let mut all: Vec<_> = (0..3).map(|c| (self.dof(node, c), along[c])).collect();
        for (c, value) in about.into_iter().enumerate() {
            match self.rotation(node, c) {
                Some(dof) => all.push((dof, value)),
                None if value != 0.0 => {
                    let what =
                        format!("node {} has no rotations: no {name} acts on it", self.node_name(node));
                    return Err(key.invalid(name, what));
                }
                None => {}
            }
        }
        Ok(all)
    }

    /// Pressure on faces.
    fn press(&mut self, scene: &Scene, config: &Config) -> Result<(), Diagnostic> {
        for (key, entry) in Key::each(scene, "pressures", &config.structure.pressures) {
            let faces = self.faces_of(&key, &entry.group)?;
            self.one_side(&key, &entry.group, &faces)?;
            let factor = match history(config, &key, &entry.history)? {
                Some(factor) => factor,
                None => Motion::new([[0.0, 1.0]]).expect("one row increases"),
            };
            let node_count = self.node_count();
            let pressure = entry.pressure;
            let path = config.fem.path_speed.is_some();
            let to = if path { &mut self.live_pressures } else { &mut self.timed };
            to.push(TimedLoad { factor, forces: Vec::new(), pressure, faces, node_count });
        }
        Ok(())
    }

    /// Faces of the part, or the group of elements, of that name.
    fn faces_of(&self, key: &Key, name: &str) -> Result<Vec<Face>, Diagnostic> {
        let faced = |elements: &[usize]| elements.iter().any(|e| !self.elements[*e].faces().is_empty());
        let Some(part) = self.parts.iter().find(|p| p.name == name) else {
            let names = self.parts.iter().filter(|p| faced(&p.elements)).map(|p| p.name.as_str());
            let names: Vec<_> = names.collect();
            let near = suggestion(name, &names).unwrap_or_else(|| format!("one of: {}", names.join(", ")));
            let none = "pressure acts on membranes and shells, and there are none here";
            let cure = if names.is_empty() { none.into() } else { near };
            let what = format!("there is no part and no group of elements `{name}`");
            return key.refuse("group", what, cure);
        };
        let nodes = part.elements.iter().flat_map(|e| self.elements[*e].faces());
        let faces: Vec<_> =
            nodes.map(|nodes| Face { nodes, corners: nodes.map(|node| self.nodes[node]) }).collect();
        if faces.is_empty() {
            let what = format!("`{name}` has no faces for a pressure to act on");
            return key.refuse("group", what, "a part of membranes or shells");
        }
        Ok(faces)
    }

    /// Neighbouring faces must show the same side, or the pressure would turn round between them.
    fn one_side(&self, key: &Key, name: &str, faces: &[Face]) -> Result<(), Diagnostic> {
        // How often an edge is there, and its faces by the direction in which they run along it.
        let mut edges: HashMap<[usize; 2], [Vec<usize>; 2]> = HashMap::new();
        for (i, face) in faces.iter().enumerate() {
            for corner in 0..3 {
                let (a, b) = (face.nodes[corner], face.nodes[(corner + 1) % 3]);
                edges.entry([a.min(b), a.max(b)]).or_default()[usize::from(a > b)].push(i);
            }
        }
        let turned =
            edges.iter().filter(|(_, [ahead, back])| ahead.len() + back.len() == 2 && ahead.len() != 1);
        let Some(edge) = turned.map(|(edge, _)| *edge).min() else { return Ok(()) };
        let [from, to] = [edge[0], edge[1]].map(|node| self.node_name(node));
        let what = format!(
            "two neighbouring faces of `{name}` have normals to opposite sides, at the edge from node {from} to node {to}: the \
             pressure would turn round there"
        );
        let hint = "let the nodes of all faces run the same way round (in Gmsh: Reverse Surface), or write a pressure for each side";
        key.refuse("group", what, hint)
    }

    /// Velocities at t = 0.
    fn set_in_motion(&mut self, scene: &Scene, config: &Config) -> Result<(), Diagnostic> {
        let mut set: Vec<Option<f64>> = Vec::new();
        for (key, entry) in Key::each(scene, "velocities", &config.structure.velocities) {
            if config.fem.integrator == Integrator::Static {
                let what = "statics has no inertia: a velocity at t = 0 changes nothing";
                return scene.refuse(&key.key, what, "an integrator with inertia, as generalized_alpha");
            }
            set.resize(self.dof_count(), None);
            for node in self.place(&key, entry.place())? {
                let own = [entry.velocity, entry.angular_velocity];
                for (dof, v) in self.vectors(&key, "angular_velocity", node, own)? {
                    if set[dof].is_some_and(|before| before != v) {
                        let what = format!("{} has two velocities at t = 0", self.dof_name(dof));
                        return Err(scene.invalid(&key.key, what));
                    }
                    set[dof] = Some(v);
                }
            }
        }
        let velocity = |dof: usize| if self.held_first(dof) { 0.0 } else { set[dof].unwrap_or(0.0) };
        self.start_velocity = (0..set.len()).map(velocity).collect();
        Ok(())
    }
}

/// Letters, axes and times of an entry.
fn check_support(key: &Key, entry: &SupportEntry) -> Result<(), Diagnostic> {
    let no_axis = |letters: &str| letters.chars().any(|c| !"xyz".contains(c));
    if no_axis(&entry.rotations) {
        let what = format!("`{}` is no set of axes, write letters of xyz", entry.rotations);
        return Err(key.invalid("rotations", what));
    }
    if (entry.directions.is_empty() && entry.rotations.is_empty()) || no_axis(&entry.directions) {
        let what = format!("`{}` is no set of directions, write letters of xyz", entry.directions);
        let hint = "directions = \"xyz\" holds all, which is the default; \"z\" holds z alone";
        return key.refuse("directions", what, hint);
    }
    if let Some(time) = entry.released_at.filter(|time| *time < 0.0) {
        let what = format!("a support lets go at {time} s, before the run begins");
        return key.refuse("released_at", what, "leave out the support");
    }
    check_giving(key, entry)?;
    let Some(turning) = &entry.turning else { return Ok(()) };
    if !entry.motion.is_empty() {
        return Err(key.invalid("turning", "a support has either motion or turning"));
    }
    // Squares of tiny numbers are 0.
    if Vector3::from(turning.axis).try_normalize(0.0).is_none() {
        return Err(key.invalid("turning.axis", "the axis has no direction"));
    }
    if turning.angles.is_empty() {
        let what = "there are no angles: nothing turns";
        let hint = "rows are [t, angle] in s and rad, as [[0.0, 0.0], [1.0, 1.57]]";
        return key.refuse("turning.angles", what, hint);
    }
    Ok(())
}

/// Refuse keys that contradict a support which gives way.
fn check_giving(key: &Key, entry: &SupportEntry) -> Result<(), Diagnostic> {
    let or_one = |stated: Option<f64>| stated.unwrap_or(1.0);
    key.positive(&[
        ("stiffness", or_one(entry.stiffness), "N/m"),
        ("strength", or_one(entry.strength), "N"),
    ])?;
    if entry.stiffness.is_none() {
        let what = "a support tears by the force of its spring, and stiffness does not say of which";
        let hint = "stiffness = 2e7 [N/m] beside it gives 1.5 cm under 300 kN";
        return if entry.strength.is_some() { key.refuse("strength", what, hint) } else { Ok(()) };
    }
    if entry.directions.is_empty() {
        let what = "directions = \"\" leaves nothing for a spring to hold: rotations stay rigid";
        return key.refuse(
            "stiffness",
            what,
            "name the directions in which it holds, or leave stiffness out",
        );
    }
    let moves = entry.turning.is_some() || !entry.motion.is_empty() || entry.released_at.is_some();
    if moves {
        let what =
            "a support that gives way stands where it is modelled: it has no motion, turning or released_at";
        return key.refuse("stiffness", what, "leave out either");
    }
    Ok(())
}

/// The table of factors of an entry; none where it is constant.
fn history(config: &Config, key: &Key, rows: &[[f64; 2]]) -> Result<Option<Motion>, Diagnostic> {
    if rows.is_empty() {
        return Ok(None);
    }
    if config.fem.path_speed.is_some() {
        let what = "along a path all loads grow by one factor, and time is the distance along it: there is no history";
        return key.refuse("history", what, "leave out either history or fem.path_speed");
    }
    Motion::new(rows.iter().copied()).map(Some).map_err(|what| {
        key.invalid("history", what).try_instead("rows are [t, factor], as [[0.0, 0.0], [0.5, 1.0]]")
    })
}
