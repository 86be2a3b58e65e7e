//! Nodes, cables and groups from a mesh: that of a file, or a generated one. Sections say what the
//! elements of a group become.

use super::build::{cable, check_cable, properties};
use super::generator::{Generated, Part, generate};
use crate::config::structure::{CableConfig, ElementKind, StructureConfig};
use crate::element::Cable;
use crate::read::mesh::{Element, Kind, Mesh};
use crate::read::read;
use interface_defs::mesh::Group;
use interface_defs::toolkit::input_error::InputError;
use interface_defs::toolkit::scene::Scene;
use nalgebra::Vector3;

/// What a model begins with.
#[derive(Debug, Default)]
pub struct Base {
    /// Nodes [m].
    pub nodes: Vec<Vector3<f64>>,
    /// Numbers of the nodes in the mesh file; empty where there is none.
    pub numbers: Vec<u64>,
    /// Cables.
    pub cables: Vec<Cable>,
    /// Named sets of cables.
    pub cable_groups: Vec<CableGroup>,
    /// Named sets of nodes.
    pub groups: Vec<Group>,
    /// Nodes that are held in all directions.
    pub held: Vec<usize>,
    /// Whether nodes without an element may stay where they are held: a frame.
    pub framed: bool,
    /// What the user should know.
    pub warnings: Vec<String>,
}

/// A named set of cables.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CableGroup {
    /// Its name.
    pub name: String,
    /// Its cables by position.
    pub cables: Vec<u32>,
}

impl Base {
    /// The nodes of the scene, of its mesh file or of its generator.
    pub fn new(scene: &Scene, table: &StructureConfig) -> Result<Self, InputError> {
        let generated = match (&table.mesh, &table.generator) {
            (Some(_), Some(_)) => {
                return Err(scene.invalid("structure.mesh", "state either a mesh file or a generator"));
            }
            (Some(path), None) => {
                let path = scene.resolve(path);
                if !path.exists() {
                    let what = format!("there is no mesh file {}", path.display());
                    return Err(scene
                        .invalid("structure.mesh", what)
                        .try_instead("the path counts from the directory of the scene file"));
                }
                check_names(scene, table)?;
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

    fn listed(scene: &Scene, table: &StructureConfig) -> Result<Self, InputError> {
        if table.nodes.is_empty() {
            return Err(scene.invalid("structure", "the structure has no nodes").try_instead(
                "write mesh = \"file\", a generator, or nodes = [[x, y, z], ...] and cables between them",
            ));
        }
        if !table.sections.is_empty() {
            let what = "sections belong to the groups of a mesh file or a generated structure";
            return Err(scene
                .invalid("structure.sections", what)
                .try_instead("write properties into `cables`"));
        }
        let nodes = table.nodes.iter().map(|p| Vector3::from(*p)).collect();
        Ok(Self { nodes, ..Self::default() })
    }

    /// The cables of a mesh by its sections, without the nodes that nothing uses.
    fn bound(scene: &Scene, table: &StructureConfig, generated: Generated) -> Result<Self, InputError> {
        let Generated { mesh, held, parts } = generated;
        if let Some(common) = &table.cable {
            check_cable(scene, "structure.cable", common)?;
        }
        let sections = Sections::new(scene, table, &mesh, &parts)?;
        let mut base = Self { framed: true, warnings: mesh.warnings.clone(), ..Self::default() };
        // First cable of each element, and one more: elements become any number of cables.
        let mut first = Vec::with_capacity(mesh.elements.len() + 1);
        for (position, element) in mesh.elements.iter().enumerate() {
            first.push(base.cables.len() as u32);
            sections.build(scene, table, &mesh, position, element, &mut base.cables)?;
        }
        first.push(base.cables.len() as u32);
        for group in &mesh.element_groups {
            let cables = group.elements.iter().flat_map(|e| first[*e as usize]..first[*e as usize + 1]);
            let cables: Vec<u32> = cables.collect();
            if !cables.is_empty() {
                base.cable_groups.push(CableGroup { name: group.name.clone(), cables });
            }
        }
        base.nodes = mesh.nodes;
        base.numbers = mesh.numbers;
        base.groups = mesh.node_groups;
        base.held = held;
        base.leave_out(table);
        Ok(base)
    }

    /// Leave out the nodes that no cable, no support and no entry with a group uses.
    fn leave_out(&mut self, table: &StructureConfig) {
        let mut used = vec![false; self.nodes.len()];
        self.cables
            .iter()
            .flat_map(|c| c.nodes)
            .chain(self.held.iter().copied())
            .for_each(|n| used[n] = true);
        let entries = table.supports.iter().map(|e| &e.group).chain(table.springs.iter().map(|e| &e.group));
        let entries =
            entries.chain(table.masses.iter().map(|e| &e.group)).chain(table.loads.iter().map(|e| &e.group));
        for name in entries.flatten() {
            let group = self.groups.iter().find(|g| g.name == *name);
            group.into_iter().flat_map(|g| &g.nodes).for_each(|n| used[*n as usize] = true);
        }
        let unused = used.iter().filter(|u| !**u).count();
        if unused == 0 {
            return;
        }
        let mut place = vec![0; used.len()];
        let mut next = 0;
        for (to, used) in place.iter_mut().zip(&used) {
            *to = next;
            next += usize::from(*used);
        }
        let mut flags = used.iter();
        self.nodes.retain(|_| *flags.next().expect("there is a flag for each node"));
        let mut flags = used.iter();
        self.numbers.retain(|_| *flags.next().expect("there is a flag for each node"));
        self.cables.iter_mut().for_each(|c| c.nodes = c.nodes.map(|n| place[n]));
        self.held.iter_mut().for_each(|n| *n = place[*n]);
        for group in &mut self.groups {
            group.nodes.retain(|n| used[*n as usize]);
            group.nodes.iter_mut().for_each(|n| *n = place[*n as usize] as u32);
        }
        self.groups.retain(|g| !g.nodes.is_empty());
        self.warnings.push(format!(
            "{unused} nodes of the mesh belong to no cable and to no support, spring, mass or load: left out"
        ));
    }
}

/// Numbers of nodes are those of a mesh file, not of the scene: a mesh is bound by names.
fn check_names(scene: &Scene, table: &StructureConfig) -> Result<(), InputError> {
    let by_number = [
        ("supports", table.supports.iter().position(|e| e.nodes.is_some())),
        ("springs", table.springs.iter().position(|e| e.nodes.is_some())),
        ("masses", table.masses.iter().position(|e| e.nodes.is_some())),
        ("loads", table.loads.iter().position(|e| e.nodes.is_some())),
        ("groups", (!table.groups.is_empty()).then_some(0)),
    ];
    match by_number.into_iter().find_map(|(name, at)| Some((name, at?))) {
        Some((name, at)) => Err(scene
            .invalid(
                &format!("structure.{name}.{at}.nodes"),
                "a mesh file is bound by names, not by node numbers",
            )
            .try_instead("name the nodes in the mesh and write group = \"name\", or at = [x, y, z]")),
        None => Ok(()),
    }
}

/// Which section each element has.
struct Sections {
    /// For each section what its elements become, and their properties; then the same for the parts
    /// of a generated structure that no section names.
    kinds: Vec<(ElementKind, Option<CableConfig>)>,
    /// For each element the position of its section in `kinds`, or `NONE`.
    of: Vec<u32>,
    /// Properties of lines without a section.
    common: Option<CableConfig>,
}

/// No section.
const NONE: u32 = u32::MAX;

impl Sections {
    fn new(scene: &Scene, table: &StructureConfig, mesh: &Mesh, parts: &[Part]) -> Result<Self, InputError> {
        let common = table.cable.clone();
        let mut sections = Self { kinds: Vec::new(), of: vec![NONE; mesh.elements.len()], common };
        for (i, entry) in table.sections.iter().enumerate() {
            let key = format!("structure.sections.{i}");
            let group = mesh.element_groups.iter().find(|g| g.name == entry.group).ok_or_else(|| {
                let names: Vec<_> = mesh.element_groups.iter().map(|g| format!("`{}`", g.name)).collect();
                let known = if names.is_empty() { "there are none".into() } else { names.join(", ") };
                scene
                    .invalid(
                        &format!("{key}.group"),
                        format!("there is no group of elements `{}`", entry.group),
                    )
                    .try_instead(format!("groups of elements here: {known}"))
            })?;
            let own = match entry.element {
                ElementKind::None => None,
                ElementKind::Cable | ElementKind::Polygon => {
                    let own = properties(scene, &key, &entry.stated(), table.cable.as_ref())?;
                    check_cable(scene, &key, &own)?;
                    Some(own)
                }
            };
            sections.kinds.push((entry.element, own));
            for element in &group.elements {
                let of = &mut sections.of[*element as usize];
                if *of != NONE {
                    let what = format!(
                        "element {} is in the groups `{}` and `{}`, and both have a section",
                        mesh.elements[*element as usize].number,
                        table.sections[*of as usize].group,
                        entry.group
                    );
                    return Err(scene.invalid(&format!("{key}.group"), what));
                }
                *of = i as u32;
            }
        }
        for part in parts {
            let group = mesh.element_groups.iter().find(|g| g.name == part.group);
            let elements = group.into_iter().flat_map(|g| &g.elements).copied();
            let free: Vec<u32> = elements.filter(|e| sections.of[*e as usize] == NONE).collect();
            if free.is_empty() {
                continue;
            }
            let Some(element) = part.made.element() else {
                let what = format!(
                    "the generated part `{}` is made of {}, and this program makes none of them unasked",
                    part.group,
                    part.made.name()
                );
                return Err(scene.invalid("structure.generator", what).try_instead(
                    "write a section for it: element = \"cable\" makes cables of them, \"none\" nothing",
                ));
            };
            if table.cable.is_none() {
                let what = format!(
                    "the generated part `{}` has no section, and there is no table [structure.cable]",
                    part.group
                );
                return Err(scene.invalid("structure", what).try_instead(
                    "write [structure.cable] with young, area and density of its cables, or a section",
                ));
            }
            free.iter().for_each(|e| sections.of[*e as usize] = sections.kinds.len() as u32);
            sections.kinds.push((element, table.cable.clone()));
        }
        Ok(sections)
    }

    /// Append the cables of one element.
    fn build(
        &self,
        scene: &Scene,
        table: &StructureConfig,
        mesh: &Mesh,
        position: usize,
        element: &Element,
        cables: &mut Vec<Cable>,
    ) -> Result<(), InputError> {
        let section = self.of[position];
        let (becomes, own) = match self.kinds.get(section as usize) {
            Some((becomes, own)) => (*becomes, own),
            // A point says where something is, and is nothing.
            None if element.kind == Kind::Point => return Ok(()),
            None => (ElementKind::Cable, &self.common),
        };
        let nodes = mesh.nodes_of(element);
        let refused = |what: String| {
            let at = (section as usize) < table.sections.len();
            let key = if at { format!("structure.sections.{section}.element") } else { "structure".into() };
            scene.invalid(&key, what)
        };
        let closed = match (becomes, element.kind) {
            (ElementKind::None, _) => return Ok(()),
            (ElementKind::Cable, Kind::Line2 | Kind::Row) => false,
            (ElementKind::Polygon, Kind::Tri3 | Kind::Quad4) => true,
            (ElementKind::Cable | ElementKind::Polygon, kind) => {
                let what = format!(
                    "{} cannot be made of {}, and {} is one of them",
                    if becomes == ElementKind::Cable { "cables" } else { "polygons of cables" },
                    kind.name(),
                    describe(mesh, position)
                );
                return Err(refused(what).try_instead(match kind {
                    Kind::Line3 => "save the mesh with elements of first order, or write a section with element = \"none\" for the group",
                    Kind::Tri3 | Kind::Quad4 => "write a section for the group: element = \"polygon\" makes a ring of cables of each, \"none\" nothing",
                    _ => "write a section with element = \"none\" for the group",
                }));
            }
        };
        let Some(own) = own else {
            return Err(refused(format!(
                "{} has no section, and there is no [structure.cable]",
                describe(mesh, position)
            ))
            .try_instead(
                "write sections for the groups of the mesh, or [structure.cable] for all of its lines",
            ));
        };
        let ends = nodes.windows(2).map(|pair| [pair[0], pair[1]]);
        let last = closed.then(|| [nodes[nodes.len() - 1], nodes[0]]);
        for ends in ends.chain(last) {
            let built = cable(&mesh.nodes, ends.map(|n| n as usize), own, None);
            if !(built.length > 0.0 && built.length.is_finite()) {
                return Err(refused(format!(
                    "{} has the length {} m",
                    describe(mesh, position),
                    built.length
                )));
            }
            cables.push(built);
        }
        Ok(())
    }
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
