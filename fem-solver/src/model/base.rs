//! Nodes, groups and cells from a mesh: that of a file, or a generated one. The parts of the scene say
//! what the elements of a group become.

use super::cell::Cell;
use super::generator::{Generated, MadeFor, generate};
use super::numbering::neighbours_together;
use super::place;
use super::ropes::join;
use crate::config::structure::StructureConfig;
use crate::element::PartConfig;
use crate::read::mesh::{ElementGroup, Kind, Mesh, MeshElement};
use crate::read::{named, read, refuse};
use interface_defs::diagnostic::{Diagnostic, code};
use interface_defs::mesh::Group;
use nalgebra::Vector3;
use toolkit::explain::suggestion;
use toolkit::scene::Scene;

/// What a model begins with.
#[derive(Debug, Default)]
pub struct Base {
    /// Nodes [m].
    pub nodes: Vec<Vector3<f64>>,
    /// Numbers of the nodes in the mesh file; empty where there is none.
    pub numbers: Vec<u64>,
    /// Lines in no part: cables of `[structure.cable]`.
    pub lines: Vec<Cell>,
    /// For each part of the scene the cells that the mesh gives it.
    pub cells: Vec<Vec<Cell>>,
    /// Number of elements of the mesh, and named sets of them.
    pub elements: (usize, Vec<ElementGroup>),
    /// Numbers of the elements in the mesh file; empty where there is none.
    pub element_numbers: Vec<u64>,
    /// Named sets of nodes.
    pub groups: Vec<Group>,
    /// Nodes that are held in all directions.
    pub held: Vec<usize>,
    /// Whether nodes without an element may stay where they are held: a frame.
    pub framed: bool,
    /// What the user should know.
    pub warnings: Vec<Diagnostic>,
}

/// In no part.
const NONE: u32 = u32::MAX;

impl Base {
    /// The nodes of the scene, of its mesh file or of its generator, in their place.
    pub fn new(scene: &Scene, table: &StructureConfig) -> Result<Self, Diagnostic> {
        let mut base = Self::in_own_axes(scene, table)?;
        place::put(scene, table, &mut base.nodes)?;
        Ok(base)
    }

    fn in_own_axes(scene: &Scene, table: &StructureConfig) -> Result<Self, Diagnostic> {
        let generated = match (&table.mesh, &table.generator) {
            (Some(_), Some(_)) => {
                let hint = "keep either `mesh` or `generator`";
                return refuse(scene, "structure.mesh", "state either a mesh file or a generator", hint);
            }
            (Some(path), None) => {
                let path = named(scene, "structure.mesh", "mesh file", path)?;
                if let Some(key) = counts_nodes(table) {
                    let hint = "name the nodes in the mesh and write group = \"name\", or at = [x, y, z]";
                    return refuse(scene, &key, "a mesh file is bound by names, not by node numbers", hint);
                }
                Generated { mesh: read(&path)?, held: Vec::new(), parts: Vec::new() }
            }
            (None, Some(generator)) => generate(scene, generator)?,
            (None, None) => return Self::listed(scene, table),
        };
        if !table.nodes.is_empty() || !table.cables.is_empty() {
            let key = if table.nodes.is_empty() { "structure.cables" } else { "structure.nodes" };
            let what =
                if table.mesh.is_some() { "the structure of a mesh file" } else { "a generated structure" };
            return Err(scene.invalid(key, format!("{what} takes no further nodes or cables")));
        }
        Self::bound(scene, table, generated)
    }

    fn listed(scene: &Scene, table: &StructureConfig) -> Result<Self, Diagnostic> {
        if table.nodes.is_empty() {
            return Err(scene.invalid("structure", "the structure has no nodes").try_instead(
                "write mesh = \"file\", a generator, or nodes = [[x, y, z], ...] and cables between them",
            ));
        }
        let nodes = table.nodes.iter().map(|p| Vector3::from(*p)).collect();
        Ok(Self { nodes, cells: vec![Vec::new(); table.parts.len()], ..Self::default() })
    }

    /// The cells of a mesh by the parts of the scene, without the nodes that nothing uses.
    fn bound(scene: &Scene, table: &StructureConfig, generated: Generated) -> Result<Self, Diagnostic> {
        let Generated { mesh, held, parts } = generated;
        if let Some(common) = &table.cable {
            common.check(scene, "structure.cable")?;
        }
        let owners = owners(scene, table, &mesh, &parts)?;
        let mut base = Self {
            framed: true,
            warnings: mesh.warnings.clone(),
            cells: vec![Vec::new(); table.parts.len()],
            ..Self::default()
        };
        for (position, element) in mesh.elements.iter().enumerate() {
            let owner = table.parts.get(owners[position] as usize);
            let Some(nodes) = cell(scene, table, &mesh, position, element, owner, owners[position])? else {
                continue;
            };
            let list = match owner {
                Some(_) => &mut base.cells[owners[position] as usize],
                None => &mut base.lines,
            };
            list.push(Cell { nodes, from: vec![position as u32] });
        }
        for (i, part) in table.parts.iter().enumerate() {
            if part.joins_lines() {
                base.cells[i] = join(std::mem::take(&mut base.cells[i])).map_err(|fault| {
                    let what =
                        format!("the lines of `{}` make no ropes: {}", part.name(), fault.words(&mesh));
                    scene
                        .invalid(&format!("structure.parts.{i}.name"), what)
                        .try_instead("put ropes that share nodes into groups of their own")
                })?;
            }
        }
        if table.mesh.is_some() {
            base.element_numbers = mesh.elements.iter().map(|e| e.number).collect();
        }
        base.elements = (mesh.elements.len(), mesh.element_groups);
        base.nodes = mesh.nodes;
        base.numbers = mesh.numbers;
        base.groups = mesh.node_groups;
        base.held = held;
        if counts_nodes(table).is_none() {
            base.leave_out(table);
            if table.mesh.is_some() {
                base.bring_neighbours_together();
            }
        }
        Ok(base)
    }

    /// Leave out the nodes that no element, no support and no entry with a group uses.
    fn leave_out(&mut self, table: &StructureConfig) {
        let mut used = vec![false; self.nodes.len()];
        let cells = self.lines.iter().chain(self.cells.iter().flatten());
        cells.flat_map(|c| &c.nodes).chain(&self.held).for_each(|n| used[*n] = true);
        let supports = table.supports.iter().map(|e| &e.group);
        let entries = supports.chain(table.springs.iter().map(|e| &e.group));
        let entries = entries.chain(table.masses.iter().map(|e| &e.group));
        let entries = entries.chain(table.loads.iter().map(|e| &e.group));
        let entries = entries.chain(table.velocities.iter().map(|e| &e.group));
        for name in entries.chain(table.dampers.iter().map(|e| &e.group)).flatten() {
            let group = self.groups.iter().find(|g| g.name == *name);
            group.into_iter().flat_map(|g| &g.nodes).for_each(|n| used[*n as usize] = true);
        }
        let unused = used.iter().filter(|u| !**u).count();
        if unused == 0 {
            return;
        }
        let kept: Vec<usize> = (0..used.len()).filter(|n| used[*n]).collect();
        self.put_in_order(&kept);
        let what = format!(
            "{unused} nodes of the mesh belong to no element and to no support, spring, mass or load: left out"
        );
        self.warnings.push(Diagnostic::warning(code::GEOMETRY, what));
    }

    /// Number the nodes anew, neighbours close to each other, if that halves their distances: steps then walk through
    /// memory from end to end. Messages call nodes by the numbers of the mesh.
    fn bring_neighbours_together(&mut self) {
        let cells = self.lines.iter().chain(self.cells.iter().flatten());
        let pairs: Vec<[usize; 2]> =
            cells.flat_map(|c| c.nodes.windows(2).map(|two| [two[0], two[1]])).collect();
        let order = neighbours_together(&pairs, self.nodes.len());
        let mut place = vec![0; order.len()];
        order.iter().enumerate().for_each(|(new, old)| place[*old] = new);
        let now: usize = pairs.iter().map(|[a, b]| a.abs_diff(*b)).sum();
        let then: usize = pairs.iter().map(|[a, b]| place[*a].abs_diff(place[*b])).sum();
        if 2 * then < now {
            self.put_in_order(&order);
        }
    }

    /// Keep the nodes of `order` alone, in that order.
    fn put_in_order(&mut self, order: &[usize]) {
        let mut place = vec![None; self.nodes.len()];
        order.iter().enumerate().for_each(|(new, old)| place[*old] = Some(new));
        self.nodes = order.iter().map(|n| self.nodes[*n]).collect();
        if !self.numbers.is_empty() {
            self.numbers = order.iter().map(|n| self.numbers[*n]).collect();
        }
        let cells = self.lines.iter_mut().chain(self.cells.iter_mut().flatten());
        for node in cells.flat_map(|c| &mut c.nodes).chain(&mut self.held) {
            *node = place[*node].expect("a node that is used is kept");
        }
        for group in &mut self.groups {
            group.nodes = group.nodes.iter().filter_map(|n| place[*n as usize]).map(|n| n as u32).collect();
            group.nodes.sort_unstable();
        }
        self.groups.retain(|g| !g.nodes.is_empty());
    }
}

/// The key of the first entry that counts nodes instead of naming them, if there is one.
fn counts_nodes(table: &StructureConfig) -> Option<String> {
    let by_number = [
        ("supports", "nodes", table.supports.iter().position(|e| e.nodes.is_some())),
        ("springs", "nodes", table.springs.iter().position(|e| e.nodes.is_some())),
        ("dampers", "nodes", table.dampers.iter().position(|e| e.nodes.is_some())),
        ("masses", "nodes", table.masses.iter().position(|e| e.nodes.is_some())),
        ("loads", "nodes", table.loads.iter().position(|e| e.nodes.is_some())),
        ("velocities", "nodes", table.velocities.iter().position(|e| e.nodes.is_some())),
        ("groups", "nodes", (!table.groups.is_empty()).then_some(0)),
        ("parts", "cells", table.parts.iter().position(|p| !p.cells().is_empty())),
    ];
    by_number.into_iter().find_map(|(name, key, at)| Some(format!("structure.{name}.{}.{key}", at?)))
}

/// For each element of the mesh the part of the scene that it is in, or `NONE`.
fn owners(
    scene: &Scene,
    table: &StructureConfig,
    mesh: &Mesh,
    made: &[MadeFor],
) -> Result<Vec<u32>, Diagnostic> {
    let mut owners = vec![NONE; mesh.elements.len()];
    for (i, part) in table.parts.iter().enumerate() {
        let key = format!("structure.parts.{i}.name");
        let (name, own) = (part.name(), part.cells());
        let group = mesh.element_groups.iter().find(|g| g.name == name);
        let group = match (group, own.is_empty()) {
            (None, false) => continue,
            (Some(group), true) => group,
            (Some(_), false) => {
                let what =
                    format!("the part `{name}` has cells, and the mesh has a group of elements of that name");
                return refuse(scene, &key, what, "leave out `cells`, or choose another name");
            }
            (None, true) => {
                let names: Vec<_> = mesh.element_groups.iter().map(|g| g.name.as_str()).collect();
                let known = suggestion(name, &names).unwrap_or_default();
                let none = "the mesh has no groups of elements: name them in the program that made it".into();
                let hint = if names.is_empty() { none } else { known };
                return refuse(scene, &key, format!("there is no group of elements `{name}`"), hint);
            }
        };
        for element in &group.elements {
            let owner = &mut owners[*element as usize];
            if *owner != NONE {
                let what = format!(
                    "element {} is in the parts `{}` and `{name}`",
                    mesh.elements[*element as usize].number,
                    table.parts[*owner as usize].name(),
                );
                return Err(scene.invalid(&key, what));
            }
            *owner = i as u32;
        }
    }
    for part in made.iter().filter(|p| p.element != "cable") {
        let group = mesh.element_groups.iter().find(|g| g.name == part.group);
        let elements = group.into_iter().flat_map(|g| &g.elements);
        if elements.into_iter().any(|e| owners[*e as usize] == NONE) {
            let what = format!(
                "the generated group `{}` is made for element = \"{}\", and no part says what becomes of it",
                part.group, part.element
            );
            return Err(scene.invalid("structure.generator", what).try_instead(format!(
                "write [[structure.parts]] with name = \"{}\" and an element; \"none\" makes nothing of it",
                part.group
            )));
        }
    }
    Ok(owners)
}

/// Whether an element of the part can be made of that shape; lines in no part are cables.
fn takes(part: Option<&PartConfig>, kind: Kind) -> bool {
    part.map_or(matches!(kind, Kind::Line2 | Kind::Row), |part| part.takes(kind))
}

/// Nodes of the cell that an element of the mesh is; `None` where nothing becomes of it.
fn cell(
    scene: &Scene,
    table: &StructureConfig,
    mesh: &Mesh,
    position: usize,
    element: &MeshElement,
    part: Option<&PartConfig>,
    number: u32,
) -> Result<Option<Vec<usize>>, Diagnostic> {
    let key = if part.is_some() { format!("structure.parts.{number}.name") } else { "structure".into() };
    if part.is_some_and(|part| part.makes_nothing()) {
        return Ok(None);
    }
    if !takes(part, element.kind) {
        // A point says where something is, and is nothing.
        if part.is_none() && element.kind == Kind::Point {
            return Ok(None);
        }
        let what = format!(
            "{} cannot be made of {}, and {} is one of them",
            part.map_or("cables", |part| part.plural()),
            element.kind.name(),
            describe(mesh, position)
        );
        return Err(scene.invalid(&key, what).try_instead(match element.kind {
            Kind::Line3 | Kind::Tri6 => {
                "save the mesh with elements of first order, or write a part with element = \"none\" for the group"
            }
            Kind::Tri3 | Kind::Quad4 => {
                "write a part for the group: element = \"membrane\", \"shell\" or \"ring\", \"cable\" for a closed polygon of cables, \"none\" for nothing"
            }
            _ => "write a part with another element for the group; \"none\" makes nothing of it",
        }));
    }
    if part.is_none() && table.cable.is_none() {
        let what =
            format!("{} is in no part, and there is no table [structure.cable]", describe(mesh, position));
        let hint = "write parts for the groups of the mesh, or [structure.cable] for all of its lines";
        return refuse(scene, &key, what, hint);
    }
    let mut nodes: Vec<usize> = mesh.nodes_of(element).iter().map(|n| *n as usize).collect();
    if part.is_some_and(|part| part.closes(element.kind)) {
        nodes.push(nodes[0]);
    }
    for pair in nodes.windows(2) {
        let length = (mesh.nodes[pair[1]] - mesh.nodes[pair[0]]).norm();
        if !(length > 0.0 && length.is_finite()) {
            let what = format!("{} has the length {length} m", describe(mesh, position));
            return Err(scene.invalid(&key, what));
        }
    }
    Ok(Some(nodes))
}

/// An element in words, with its groups.
fn describe(mesh: &Mesh, position: usize) -> String {
    let groups = mesh.element_groups.iter().filter(|g| g.elements.binary_search(&(position as u32)).is_ok());
    let names: Vec<_> = groups.map(|g| format!("`{}`", g.name)).collect();
    let number = mesh.elements[position].number;
    match names.len() {
        0 => format!("element {number} (in no group)"),
        1 => format!("element {number} of the group {}", names[0]),
        _ => format!("element {number} of the groups {}", names.join(", ")),
    }
}
