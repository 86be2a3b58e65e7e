//! From `[structure.ground]` to contacts of nodes with the ground, and what is certainly wrong there.

use super::Model;
use super::base::{Base, flat, needs_ground};
use super::generator::CELL;
use crate::config::Config;
use crate::config::structure::{FormFinding, GroundConfig, StructureConfig};
use crate::element::ground_contact::damping_ratio;
use crate::element::{AnyElement, GroundContact};
use crate::ground::Surface;
use crate::read::Key;
use crate::read::heights::Heights;
use interface_defs::diagnostic::{Diagnostic, code};
use nalgebra::Vector3;
use std::path::PathBuf;
use std::sync::Arc;
use toolkit::ground::Area;
use toolkit::scene::Scene;

/// Stiffness of a node over its mass where the scene does not say [1/s2].
const STIFFNESS: f64 = 1e6;
/// A node that is modelled deeper in the ground than this [m] is in the wrong place.
const DEEPEST: f64 = 1.0;
/// A node that is modelled deeper than this [m] is worth a word.
const DEEP: f64 = 0.05;
/// Friction beyond which no soil has any.
const ROUGHEST: f64 = 2.0;
/// How far around the structure the ground is known, in its extents, and at least [m].
const AROUND: f64 = 1.0;
const LEAST_AROUND: f64 = 2.0;
/// Heights on a side of a raster that is made, at most.
const MOST_CELLS: f64 = 2000.0;

impl Model {
    /// Contacts of nodes with the ground, where the scene has any; masses are known.
    pub(super) fn add_ground(&mut self, scene: &Scene, config: &Config) -> Result<(), Diagnostic> {
        let first = self.elements.len();
        self.ground = first..first;
        let table = &config.structure;
        let Some(ground) = &table.ground else { return Ok(()) };
        check(&Key { scene, key: "structure.ground".into() }, ground)?;
        let nodes = self.on_ground(scene, ground)?;
        let surface = self.surface(scene, table)?;
        let radii = self.radii();
        let typical = median(nodes.iter().map(|node| self.mass[*node]).collect());
        let ratio = damping_ratio(ground.restitution);
        for node in nodes {
            let stiffness = match ground.stiffness {
                Some(stiffness) => stiffness,
                None if self.mass[node] > 0.0 => STIFFNESS * self.mass[node].min(typical),
                None => {
                    let what = format!(
                        "node {} has no mass, of which its stiffness in the ground would follow",
                        self.node_name(node)
                    );
                    return scene.refuse("structure.ground", what, "write stiffness in N/m, as 1e5");
                }
            };
            let contact = GroundContact {
                node: [node],
                surface: Arc::clone(&surface),
                place: self.nodes[node] - surface.origin,
                radius: radii[node],
                stiffness,
                friction: ground.friction,
                restitution: ground.restitution,
                ratio,
                mass: self.mass[node],
            };
            if contact.depth().is_none() {
                let what = format!(
                    "the ground does not reach below node {}, or has a hole there",
                    self.node_name(node)
                );
                let hint = "a larger raster, in the coordinates of the structure; or `groups` of the nodes that touch the ground";
                return scene.refuse(&self.ground_key(table), what, hint);
            }
            self.elements.push(contact.into());
            self.element_numbers[0].push(None);
        }
        self.ground = first..self.elements.len();
        self.judge_depth(scene, config)
    }

    /// The contacts with the ground.
    pub fn ground_contacts(&self) -> impl Iterator<Item = &GroundContact> + '_ {
        self.elements[self.ground.clone()].iter().filter_map(|element| match element {
            AnyElement::GroundContact(contact) => Some(contact),
            _ => None,
        })
    }

    /// Nodes that take part.
    fn on_ground(&self, scene: &Scene, ground: &GroundConfig) -> Result<Vec<usize>, Diagnostic> {
        let mut takes = vec![ground.groups.is_none(); self.node_count()];
        let listed =
            ground.groups.iter().flatten().enumerate().map(|(i, name)| (format!("groups.{i}"), name, true));
        let left = ground.except.iter().enumerate().map(|(i, name)| (format!("except.{i}"), name, false));
        for (key, name, part) in listed.chain(left) {
            for node in self.group(scene, &format!("structure.ground.{key}.group"), name)? {
                takes[node] = part;
            }
        }
        let nodes: Vec<usize> =
            (0..self.node_count()).filter(|n| takes[*n] && !self.fully_held(*n)).collect();
        if nodes.is_empty() {
            let what = "no node takes part: those that are named are held, or none is named";
            return scene.refuse("structure.ground", what, "leave out groups and except");
        }
        Ok(nodes)
    }

    /// The surface around the structure.
    fn surface(&self, scene: &Scene, table: &StructureConfig) -> Result<Arc<Surface>, Diagnostic> {
        let key = self.ground_key(table);
        let Some(path) = ground_file(table) else {
            let what = "the heights of the ground are not known here";
            return scene.refuse("structure.ground", what, "name a raster with file = \"FILE.asc\"; in a scene with [terrain], `rockfall run` and `rockfall check` make it");
        };
        let heights = Heights::read(scene, &key, &path)?;
        let (low, high) = around(&self.nodes);
        Ok(Arc::new(Surface::new(&heights, low, high)))
    }

    /// The key that names the raster.
    fn ground_key(&self, table: &StructureConfig) -> String {
        let own = table.ground.as_ref().is_some_and(|ground| ground.file.is_some());
        if own { "structure.ground.file".into() } else { "structure.ground".into() }
    }

    /// For each node the largest radius of what ends there [m].
    fn radii(&self) -> Vec<f64> {
        let mut radii = vec![0.0_f64; self.node_count()];
        let faces = self.elements.iter().flat_map(|e| {
            let half = 0.5 * e.constants().thickness;
            e.nodes().iter().map(move |node| (*node, half))
        });
        let lines = self.lines().flat_map(|(line, radius)| line.map(|node| (node, radius)));
        for (node, radius) in lines.chain(faces) {
            radii[node] = radii[node].max(radius);
        }
        radii
    }

    /// Refuse nodes that are modelled far below the ground; a word on those that are a little.
    fn judge_depth(&mut self, scene: &Scene, config: &Config) -> Result<(), Diagnostic> {
        let all = self.ground_contacts().filter_map(|c| Some((c.depth()?, c.node[0], c.stiffness)));
        let in_it: Vec<_> = all.filter(|(depth, ..)| *depth > DEEP).collect();
        let deepest = in_it.iter().max_by(|a, b| a.0.total_cmp(&b.0));
        let Some((depth, node, _)) = deepest else { return Ok(()) };
        let node = self.node_name(*node);
        let count = |n: usize| if n == 1 { "1 node is".to_owned() } else { format!("{n} nodes are") };
        if *depth > DEEPEST {
            let far = count(in_it.iter().filter(|(depth, ..)| *depth > DEEPEST).count());
            let what = format!(
                "{far} modelled more than {DEEPEST} m below the ground, the deepest by {depth:.2} m: node {node}"
            );
            return scene.refuse(
                "structure.ground",
                what,
                "raise the structure, or is the raster that of another place? `except` leaves nodes out",
            );
        }
        let so = if config.structure.form_finding == FormFinding::None {
            let energy: f64 = in_it.iter().map(|(depth, _, k)| 0.5 * k * depth * depth).sum();
            format!("it throws them out with {energy:.3e} J, as no rest shape is looked for")
        } else {
            "form finding lifts them".to_owned()
        };
        let are = count(in_it.len());
        let what = format!("{are} modelled in the ground, the deepest by {depth:.3} m: node {node}; {so}");
        self.warnings.push(Diagnostic::warning(code::PLACE, what).about("structure.ground"));
        Ok(())
    }
}

/// The middle one of some numbers.
fn median(mut all: Vec<f64>) -> f64 {
    all.sort_by(f64::total_cmp);
    all[all.len() / 2]
}

/// The raster that the scene names.
pub(super) fn ground_file(table: &StructureConfig) -> Option<PathBuf> {
    let own = table.ground.as_ref().and_then(|ground| ground.file.clone());
    let stands = own.or_else(|| table.generator.as_ref().and_then(|generator| generator.ground().cloned()));
    stands.or_else(|| table.place.as_ref().and_then(|place| place.ground.clone()))
}

/// The part of the ground that a structure with these nodes may come to: x and y of two corners [m].
pub(super) fn around(nodes: &[Vector3<f64>]) -> ([f64; 2], [f64; 2]) {
    let least = nodes.iter().copied().reduce(|a, b| a.inf(&b)).unwrap_or_default();
    let most = nodes.iter().copied().reduce(|a, b| a.sup(&b)).unwrap_or_default();
    let reach = (AROUND * (most - least).norm()).max(LEAST_AROUND);
    ([least.x - reach, least.y - reach], [most.x + reach, most.y + reach])
}

/// Numbers of the table.
fn check(key: &Key, ground: &GroundConfig) -> Result<(), Diagnostic> {
    key.positive(&[("stiffness", ground.stiffness.unwrap_or(1.0), "N/m")])?;
    key.not_negative(&[("friction", ground.friction, "")])?;
    if ground.friction > ROUGHEST {
        let what = format!("friction = {}: it is a coefficient, of soils 0.3 to 1", ground.friction);
        let hint = "the tangent of the angle of friction: 30 degrees is 0.58";
        return key.refuse("friction", what, hint);
    }
    if !(ground.restitution > 0.0 && ground.restitution <= 1.0) {
        let what = format!("restitution = {}: it must lie above 0, and not above 1", ground.restitution);
        return Err(key.invalid("restitution", what));
    }
    Ok(())
}

/// The area in which heights are needed for the ground of `table` or its place, whose raster is not named.
pub fn area(scene: &Scene, table: &StructureConfig) -> Result<Option<Area>, Diagnostic> {
    let stands = needs_ground(table);
    if ground_file(table).is_some() || !(stands || table.ground.is_some()) {
        return Ok(None);
    }
    let nodes = Base::new(scene, &flat(table))?.mesh.nodes;
    let (low, high) = around(&nodes);
    let middle = [0, 1].map(|a: usize| 0.5 * (low[a] + high[a]));
    let margin = (0..2).map(|a| 0.5 * (high[a] - low[a])).fold(0.0, f64::max) + 2.0 * CELL;
    // A large structure takes a coarser raster.
    let cell = CELL.max(2.0 * margin / MOST_CELLS);
    let [wants, of] = if stands {
        ["structure.place.ground", "structure.place.origin"]
    } else {
        ["structure.ground.file", "structure.ground"]
    };
    Ok(Some(Area { wants: wants.into(), of: of.into(), line: vec![middle], epsg: None, margin, cell }))
}
