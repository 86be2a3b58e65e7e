//! From `[[structure.parts]]` to elements, with every input error located.

use super::base::Cell;
use super::build::{cable, check_cable, properties};
use super::surfaces::{membrane, shell, triangles};
use super::{Model, Part};
use crate::config::part::{BeamPart, BrakePart, CablePart, PartConfig, RingPart, SlidingCablePart};
use crate::config::structure::{CableConfig, StructureConfig};
use crate::config::{not_negative, positive};
use crate::element::bar::Rupture;
use crate::element::material::Law;
use crate::element::ring::{Mechanism, Ring};
use crate::element::sliding_cable::Memory;
use crate::element::{AnyElement, Bar, Beam, Brake, Cable, SlidingCable};
use crate::read::mesh::ElementGroup;
use interface_defs::mesh::Group;
use interface_defs::toolkit::input_error::InputError;
use interface_defs::toolkit::scene::Scene;
use nalgebra::Vector3;
use std::ops::Range;

/// What became of an element of a mesh, by numbers in [`Model::elements`] and [`Model::cables`].
#[derive(Debug, Clone, Default)]
pub struct Made {
    /// Elements.
    pub elements: Range<usize>,
    /// Cables.
    pub cables: Range<usize>,
}

/// Where a part stands in the scene, for messages.
pub(super) struct Key<'a> {
    scene: &'a Scene,
    key: String,
}

impl Key<'_> {
    pub(super) fn positive(&self, name: &str, value: f64, unit: &str) -> Result<(), InputError> {
        positive(self.scene, &format!("{}.{name}", self.key), value, unit)
    }

    pub(super) fn not_negative(&self, name: &str, value: f64, unit: &str) -> Result<(), InputError> {
        not_negative(self.scene, &format!("{}.{name}", self.key), value, unit)
    }

    pub(super) fn invalid(&self, name: &str, what: impl Into<String>) -> InputError {
        self.scene.invalid(&format!("{}.{name}", self.key), what)
    }
}

impl Model {
    /// Build the parts of the scene; `meshed` are the cells that a mesh gives to each. What becomes of its
    /// elements goes into `made`.
    pub(super) fn add_parts(
        &mut self,
        scene: &Scene,
        table: &StructureConfig,
        meshed: &[Vec<Cell>],
        made: &mut [Made],
    ) -> Result<(), InputError> {
        for (i, config) in table.parts.iter().enumerate() {
            let key = Key { scene, key: format!("structure.parts.{i}") };
            let (name, own) = config.head();
            if name.is_empty() || self.parts.iter().any(|p| p.name == name) {
                return Err(
                    key.invalid("name", format!("there is a part `{name}` already, or it has no name"))
                );
            }
            if own.is_empty() && made.is_empty() {
                return Err(key.invalid("name", format!("the part `{name}` has no cells")).try_instead(
                    "write cells = [[node, node, ...], ...], or use the name of a group of a mesh",
                ));
            }
            let first = (self.elements.len(), self.cables.len());
            self.note_split(config, own.iter().chain(meshed[i].iter().map(|cell| &cell.nodes)));
            for (at, cell) in own.iter().enumerate() {
                self.add_cell(&key, &format!("cells.{at}"), config, table.cable.as_ref(), cell)?;
            }
            for cell in &meshed[i] {
                let before = (self.elements.len(), self.cables.len());
                self.add_cell(&key, "name", config, table.cable.as_ref(), &cell.nodes)?;
                let own =
                    Made { elements: before.0..self.elements.len(), cables: before.1..self.cables.len() };
                cell.from.iter().for_each(|e| made[*e as usize] = own.clone());
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

    /// Say how many quadrilaterals of shell become triangles.
    fn note_split<'a>(&mut self, config: &PartConfig, cells: impl Iterator<Item = &'a Vec<usize>>) {
        let count = cells.filter(|cell| cell.len() == 4).count();
        if matches!(config, PartConfig::Shell(_)) && count > 0 {
            self.warnings.push(format!(
                "part `{}`: {count} quadrilaterals of shell are split into two triangles each, along the shorter diagonal",
                config.head().0
            ));
        }
    }

    fn check_cell(
        &self,
        key: &Key,
        place: &str,
        config: &PartConfig,
        cell: &[usize],
    ) -> Result<(), InputError> {
        let (fewest, most) = config.nodes();
        if cell.len() < fewest || cell.len() > most {
            let wanted = match most {
                usize::MAX => format!("{fewest} or more"),
                _ if most == fewest => fewest.to_string(),
                _ => format!("{fewest} to {most}"),
            };
            let what = format!("an element of this part has {} nodes, it takes {wanted}", cell.len());
            return Err(key.invalid(place, what));
        }
        if let Some(node) = cell.iter().find(|n| **n >= self.nodes.len()) {
            let what = format!("there is no node {node}; nodes are 0 to {}", self.nodes.len() - 1);
            return Err(key.invalid(place, what));
        }
        for pair in cell.windows(2) {
            if self.nodes[pair[0]] == self.nodes[pair[1]] {
                let [a, b] = [pair[0], pair[1]].map(|n| self.node_name(n));
                let what = format!("there is no distance between its nodes {a} and {b}");
                return Err(key.invalid(place, what));
            }
        }
        Ok(())
    }

    fn add_cell(
        &mut self,
        key: &Key,
        place: &str,
        config: &PartConfig,
        common: Option<&CableConfig>,
        cell: &[usize],
    ) -> Result<(), InputError> {
        self.check_cell(key, place, config, cell)?;
        let spans: Vec<_> = cell.windows(2).map(|p| self.nodes[p[1]] - self.nodes[p[0]]).collect();
        let element: AnyElement = match config {
            PartConfig::Cable(part) => {
                for pair in cell.windows(2) {
                    match line(key, part, common, [pair[0], pair[1]], &self.nodes)? {
                        Line::Fast(cable) => self.cables.push(cable),
                        Line::Other(bar) => self.elements.push(bar.into()),
                    }
                }
                return Ok(());
            }
            PartConfig::SlidingCable(part) => sliding_cable(key, part, cell, spans)?.into(),
            PartConfig::Brake(part) => brake(key, part, [cell[0], cell[1]], spans[0])?.into(),
            PartConfig::Beam(part) => beam(key, place, part, [cell[0], cell[1]], spans[0])?.into(),
            PartConfig::Ring(part) => ring(key, part, cell, &self.nodes)?.into(),
            PartConfig::Membrane(part) => membrane(key, place, part, cell, &self.nodes)?,
            PartConfig::Shell(part) => {
                for corners in triangles(cell, &self.nodes) {
                    self.elements.push(shell(key, place, part, corners, &self.nodes)?.into());
                }
                return Ok(());
            }
            PartConfig::None(_) => return Ok(()),
        };
        self.elements.push(element);
        Ok(())
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

enum Line {
    Fast(Cable),
    Other(Bar),
}

fn rupture(key: &Key, force: Option<f64>, strain: Option<f64>) -> Result<Rupture, InputError> {
    if let Some(force) = force {
        key.positive("rupture_force", force, "N")?;
    }
    if let Some(strain) = strain {
        key.positive("rupture_strain", strain, "")?;
    }
    Ok(Rupture { force: force.unwrap_or(f64::INFINITY), strain: strain.unwrap_or(f64::INFINITY) })
}

/// Rows of a table: abscissae that increase, ordinates above 0.
fn check_table(key: &Key, name: &str, rows: &[[f64; 2]]) -> Result<(), InputError> {
    if let Some(row) = rows.iter().find(|row| !(row[1] > 0.0 && row.iter().all(|x| x.is_finite()))) {
        let what = format!("the row [{}, {}] must be finite, its second above 0", row[0], row[1]);
        return Err(key.invalid(name, what).try_instead("forces and stresses in tension count upward"));
    }
    if let Some(row) = rows.iter().find(|row| row[0] < 0.0) {
        let what = format!(
            "the row [{}, {}] must not begin below 0: elongations and strains count upward",
            row[0], row[1]
        );
        return Err(key.invalid(name, what).try_instead("turn its sign round"));
    }
    match rows.windows(2).find(|pair| pair[1][0] <= pair[0][0]) {
        Some(pair) => Err(key
            .invalid(name, format!("the first column must increase, {} follows {}", pair[1][0], pair[0][0]))),
        None => Ok(()),
    }
}

fn line(
    key: &Key,
    part: &CablePart,
    common: Option<&CableConfig>,
    nodes: [usize; 2],
    positions: &[Vector3<f64>],
) -> Result<Line, InputError> {
    let own = properties(key.scene, &key.key, &part.stated(), common)?;
    check_cable(key.scene, &key.key, &own)?;
    if let Some(length) = part.length {
        key.positive("length", length, "m")?;
    }
    check_table(key, "hardening", &part.hardening)?;
    if part.hardening.first().is_some_and(|row| row[0] != 0.0) {
        return Err(key.invalid("hardening", "the first row must be at the plastic strain 0"));
    }
    let rupture = rupture(key, part.rupture_force, part.rupture_strain)?;
    let cable = cable(positions, nodes, &own, part.length);
    if part.hardening.is_empty() && rupture == Rupture::NEVER {
        return Ok(Line::Fast(cable));
    }
    let hardening = part.hardening.iter().map(|row| (row[0], row[1])).collect();
    let law = Law { hardening, ..Law::elastic(own.young, own.prestress, own.tension_only) };
    let Cable { span, length, area, density, radius, .. } = cable;
    Ok(Line::Other(Bar { nodes, span, length, area, density, radius, law, rupture }))
}

fn sliding_cable(
    key: &Key,
    part: &SlidingCablePart,
    cell: &[usize],
    spans: Vec<Vector3<f64>>,
) -> Result<SlidingCable, InputError> {
    key.positive("young", part.young, "Pa")?;
    key.positive("area", part.area, "m2")?;
    key.not_negative("density", part.density, "kg/m3")?;
    key.not_negative("radius", part.radius.unwrap_or(0.0), "m")?;
    key.not_negative("friction", part.friction, "")?;
    if let Some(length) = part.length {
        key.positive("length", length, "m")?;
    }
    let polygon: f64 = spans.iter().map(Vector3::norm).sum();
    let share = part.length.unwrap_or(polygon) / polygon;
    Ok(SlidingCable {
        nodes: cell.to_vec(),
        lengths: spans.iter().map(|s| share * s.norm()).collect(),
        spans,
        young: part.young,
        area: part.area,
        density: part.density,
        prestress: part.prestress,
        friction: part.friction,
        radius: part.radius.unwrap_or(0.0),
        rupture: rupture(key, part.rupture_force, part.rupture_strain)?,
        memory: Memory::default(),
    })
}

fn brake(key: &Key, part: &BrakePart, nodes: [usize; 2], span: Vector3<f64>) -> Result<Brake, InputError> {
    key.positive("stiffness", part.stiffness, "N/m")?;
    key.not_negative("mass", part.mass, "kg")?;
    key.not_negative("radius", part.radius.unwrap_or(0.0), "m")?;
    if let Some(length) = part.length {
        key.positive("length", length, "m")?;
    }
    if let Some(stroke) = part.stroke {
        key.positive("stroke", stroke, "m")?;
    }
    check_table(key, "curve", &part.curve)?;
    let mut hardening: Vec<(f64, f64)> = Vec::new();
    for row in &part.curve {
        // The elastic share of the elongation is given back on unloading; what is left is travel.
        let travel = row[0] - row[1] / part.stiffness;
        let before = hardening.last().map_or(0.0, |(a, _)| *a);
        let least = -1e-9 * row[0].abs();
        if travel < before + least || (!hardening.is_empty() && travel <= before) {
            let what = format!(
                "under {} N the stiffness alone gives an elongation of {} m, the curve says {} m: its travel must grow",
                row[1],
                row[1] / part.stiffness,
                row[0]
            );
            return Err(key.invalid("curve", what).try_instead("a larger stiffness"));
        }
        if hardening.is_empty() {
            hardening.push((0.0, row[1]));
            if travel > 1e-9 * row[0] {
                hardening.push((travel, row[1]));
            }
        } else {
            hardening.push((travel, row[1]));
        }
    }
    let limit = part.stroke.unwrap_or(f64::INFINITY);
    Ok(Brake {
        nodes,
        span,
        length: part.length.unwrap_or(span.norm()),
        mass: part.mass,
        radius: part.radius.unwrap_or(0.0),
        law: Law { hardening, limit, ..Law::elastic(part.stiffness, 0.0, part.tension_only) },
        rupture: rupture(key, part.rupture_force, None)?,
    })
}

fn beam(
    key: &Key,
    place: &str,
    part: &BeamPart,
    nodes: [usize; 2],
    span: Vector3<f64>,
) -> Result<Beam, InputError> {
    key.positive("young", part.young, "Pa")?;
    key.positive("area", part.area, "m2")?;
    key.positive("inertia", part.inertia[0].min(part.inertia[1]), "m4")?;
    key.not_negative("density", part.density, "kg/m3")?;
    key.not_negative("radius", part.radius.unwrap_or(0.0), "m")?;
    let shear = part.shear.unwrap_or(part.young / 2.6);
    key.positive("shear", shear, "Pa")?;
    let torsion = part.torsion.unwrap_or(part.inertia[0] + part.inertia[1]);
    key.positive("torsion", torsion, "m4")?;
    let along = span.normalize();
    let default = if along.z.abs() > 0.9 { Vector3::x() } else { Vector3::z() };
    let up = part.up.map_or(default, Vector3::from);
    let first = up - along * along.dot(&up);
    if first.norm() <= 1e-6 * up.norm() || up.norm() == 0.0 {
        let what = format!("`up` lies along the beam between nodes {} and {}", nodes[0], nodes[1]);
        return Err(key.invalid(place, what));
    }
    let first = first.normalize();
    Ok(Beam {
        nodes,
        span,
        axes: [first, along.cross(&first)],
        area: part.area,
        axial: part.young * part.area,
        bending: part.inertia.map(|i| part.young * i),
        torsion: shear * torsion,
        line_mass: part.density * part.area,
        gyration: (torsion.max(part.inertia[0] + part.inertia[1]) / part.area).sqrt(),
        radius: part.radius.unwrap_or(0.0),
        rupture: rupture(key, part.rupture_force, None)?,
    })
}

fn ring(key: &Key, part: &RingPart, cell: &[usize], nodes: &[Vector3<f64>]) -> Result<Ring, InputError> {
    key.positive("diameter", part.diameter, "m")?;
    key.positive("perimeter_stiffness", part.perimeter_stiffness, "N/m")?;
    key.positive("bending_stiffness", part.bending_stiffness, "N/m")?;
    key.not_negative("mass", part.mass, "kg")?;
    key.not_negative("radius", part.radius.unwrap_or(0.0), "m")?;
    if let Some(factor) = part.unloading.iter().find(|f| !(**f >= 1.0 && f.is_finite())) {
        return Err(key.invalid(
            "unloading",
            format!("it unloads with {factor} of its stiffness, it must be 1 or more"),
        ));
    }
    let perimeter = part.perimeter.unwrap_or(std::f64::consts::PI * part.diameter);
    key.positive("perimeter", perimeter, "m")?;
    let share = if cell.len() == 4 { 1.0 } else { 0.75 };
    let mechanism = |start, stiffness, unloading| Mechanism { start, stiffness, unloading, ease: 0.0 };
    Ok(Ring {
        nodes: cell.to_vec(),
        spans: (0..cell.len()).map(|i| nodes[cell[(i + 1) % cell.len()]] - nodes[cell[i]]).collect(),
        perimeter: mechanism(perimeter, part.perimeter_stiffness, part.unloading[0]),
        width: mechanism(share * part.diameter, part.bending_stiffness, part.unloading[1]),
        mass: part.mass,
        radius: part.radius.unwrap_or(0.0),
        rupture: rupture(key, part.rupture_force, None)?.force,
    })
}
