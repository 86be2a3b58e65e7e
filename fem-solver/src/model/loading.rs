//! What pulls and pushes: weight, nodal loads, pressure; and what moves at t = 0.

use super::Model;
use super::pressure::{Face, Motion, TimedLoad};
use crate::config::{Config, Integrator};
use crate::read::refuse;
use interface_defs::diagnostic::Diagnostic;
use nalgebra::Vector3;
use std::collections::HashMap;
use toolkit::explain::suggestion;
use toolkit::scene::Scene;

impl Model {
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
        for (i, entry) in config.structure.loads.iter().enumerate() {
            let key = format!("structure.loads.{i}");
            let mut forces = Vec::new();
            for node in self.place(scene, &key, entry.place())? {
                let own = self.vectors(scene, (&key, "moment"), node, [entry.force, entry.moment])?;
                forces.extend(own);
            }
            if let Some(factor) = history(scene, config, &key, &entry.history)? {
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
    /// name `key.1`.
    fn vectors(
        &self,
        scene: &Scene,
        key: (&str, &str),
        node: usize,
        [along, about]: [[f64; 3]; 2],
    ) -> Result<Vec<(usize, f64)>, Diagnostic> {
        let mut all: Vec<_> = (0..3).map(|c| (self.dof(node, c), along[c])).collect();
        for (c, value) in about.into_iter().enumerate() {
            match self.rotation(node, c) {
                Some(dof) => all.push((dof, value)),
                None if value != 0.0 => {
                    let what =
                        format!("node {} has no rotations: no {} acts on it", self.node_name(node), key.1);
                    return Err(scene.invalid(&format!("{}.{}", key.0, key.1), what));
                }
                None => {}
            }
        }
        Ok(all)
    }

    /// Pressure on faces.
    fn press(&mut self, scene: &Scene, config: &Config) -> Result<(), Diagnostic> {
        for (i, entry) in config.structure.pressures.iter().enumerate() {
            let key = format!("structure.pressures.{i}");
            let faces = self.faces_of(scene, &format!("{key}.group"), &entry.group)?;
            self.one_side(scene, &format!("{key}.group"), &entry.group, &faces)?;
            let factor = match history(scene, config, &key, &entry.history)? {
                Some(factor) => factor,
                None => Motion::new(&[(0.0, 1.0)]).expect("one row increases"),
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
    fn faces_of(&self, scene: &Scene, key: &str, name: &str) -> Result<Vec<Face>, Diagnostic> {
        let faced = |elements: &[usize]| elements.iter().any(|e| !self.elements[*e].faces().is_empty());
        let Some(part) = self.parts.iter().find(|p| p.name == name) else {
            let names = self.parts.iter().filter(|p| faced(&p.elements)).map(|p| p.name.as_str());
            let names: Vec<_> = names.collect();
            let none = "pressure acts on membranes and shells, and there are none here".to_owned();
            let cure = if names.is_empty() {
                none
            } else {
                suggestion(name, &names).unwrap_or_else(|| format!("one of: {}", names.join(", ")))
            };
            let what = format!("there is no part and no group of elements `{name}`");
            return Err(scene.invalid(key, what).try_instead(cure));
        };
        let nodes = part.elements.iter().flat_map(|e| self.elements[*e].faces());
        let faces: Vec<_> =
            nodes.map(|nodes| Face { nodes, corners: nodes.map(|node| self.nodes[node]) }).collect();
        if faces.is_empty() {
            let what = format!("`{name}` has no faces for a pressure to act on");
            return Err(scene.invalid(key, what).try_instead("a part of membranes or shells"));
        }
        Ok(faces)
    }

    /// Neighbouring faces must show the same side, or the pressure would turn round between them.
    fn one_side(&self, scene: &Scene, key: &str, name: &str, faces: &[Face]) -> Result<(), Diagnostic> {
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
        let what = format!(
            "two neighbouring faces of `{name}` have normals to opposite sides, at the edge from node {} to node {}: the \
             pressure would turn round there",
            self.node_name(edge[0]),
            self.node_name(edge[1])
        );
        Err(scene.invalid(key, what).try_instead(
            "let the nodes of all faces run the same way round (in Gmsh: Reverse Surface), or write a pressure for each side",
        ))
    }

    /// Velocities at t = 0.
    fn set_in_motion(&mut self, scene: &Scene, config: &Config) -> Result<(), Diagnostic> {
        let mut set: Vec<Option<f64>> = Vec::new();
        for (i, entry) in config.structure.velocities.iter().enumerate() {
            let key = format!("structure.velocities.{i}");
            if config.fem.integrator == Integrator::Static {
                let what = "statics has no inertia: a velocity at t = 0 changes nothing";
                return refuse(scene, &key, what, "an integrator with inertia, as generalized_alpha");
            }
            set.resize(self.dof_count(), None);
            for node in self.place(scene, &key, entry.place())? {
                let names = (&key[..], "angular_velocity");
                for (dof, v) in self.vectors(scene, names, node, [entry.velocity, entry.angular_velocity])? {
                    if set[dof].is_some_and(|before| before != v) {
                        let what = format!("{} has two velocities at t = 0", self.dof_name(dof));
                        return Err(scene.invalid(&key, what));
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

/// The table of factors of an entry; none where it is constant.
fn history(
    scene: &Scene,
    config: &Config,
    key: &str,
    rows: &[[f64; 2]],
) -> Result<Option<Motion>, Diagnostic> {
    if rows.is_empty() {
        return Ok(None);
    }
    let key = format!("{key}.history");
    if config.fem.path_speed.is_some() {
        let what = "along a path all loads grow by one factor, and time is the distance along it: there is no history";
        return Err(scene.invalid(&key, what).try_instead("leave out either history or fem.path_speed"));
    }
    let rows: Vec<_> = rows.iter().map(|row| (row[0], row[1])).collect();
    Motion::new(&rows).map(Some).map_err(|what| {
        scene.invalid(&key, what).try_instead("rows are [t, factor], as [[0.0, 0.0], [0.5, 1.0]]")
    })
}
