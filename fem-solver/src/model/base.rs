//! Nodes, groups and cells from a mesh: that of a file, or a generated one. The parts of the scene say
//! what the elements of a group become.

use super::generator::{Generated, MadeFor, check_point, generate};
use super::numbering::neighbours_together;
use crate::config::structure::{PlaceConfig, StructureConfig};
use crate::element::part::PartHead;
use crate::read::heights::Heights;
use crate::read::mesh::{Kind, Mesh};
use crate::read::{Key, named, nearest, read};
use interface_defs::diagnostic::{Diagnostic, code};
use nalgebra::Vector3;
use std::collections::HashMap;
use std::ops::Range;
use toolkit::scene::Scene;

/// Nodes, cells and groups of which a model is built.
#[derive(Debug, Default)]
pub struct Base {
    /// Nodes, groups, elements; of a scene that lists its nodes, the nodes alone.
    pub mesh: Mesh,
    /// Lines in no part: cables of `[structure.cable]`.
    pub lines: Vec<Cell>,
    /// For each part of the scene the cells that the mesh gives it.
    pub cells: Vec<Vec<Cell>>,
    /// Nodes that are held in all directions.
    pub held: Vec<usize>,
    /// Whether nodes without an element may stay where they are held: a frame.
    pub framed: bool,
}

impl Base {
    /// The nodes of the scene, of its mesh file or of its generator, in their place.
    pub fn new(scene: &Scene, table: &StructureConfig) -> Result<Self, Diagnostic> {
        if let Some(common) = &table.cable {
            common.check(&Key { scene, key: "structure.cable".into() })?;
        }
        let mut base = Self::in_own_axes(scene, table)?;
        put(scene, table, &mut base.mesh.nodes)?;
        Ok(base)
    }

    fn in_own_axes(scene: &Scene, table: &StructureConfig) -> Result<Self, Diagnostic> {
        match given(scene, table)? {
            Some(generated) => Self::bound(scene, table, generated),
            None => Self::listed(scene, table),
        }
    }

    /// The mesh of a scene's file or generator as a whole, in its place, its nodes numbered as in the file or from 1; and the number
    /// of each node of the model in its order. Of a scene that lists its nodes these alone.
    pub fn whole(scene: &Scene, table: &StructureConfig) -> Result<(Generated, Vec<u64>), Diagnostic> {
        let nothing = || Generated { mesh: Mesh::default(), held: Vec::new(), parts: Vec::new() };
        let given = given(scene, table)?;
        let (listed, mut given) = (given.is_none(), given.unwrap_or_else(nothing));
        if listed {
            given.mesh.nodes = Self::listed(scene, table)?.mesh.nodes;
        }
        if given.mesh.numbers.is_empty() {
            given.mesh.numbers = (1..=given.mesh.nodes.len() as u64).collect();
        }
        let numbers = match listed {
            true => given.mesh.numbers.clone(),
            false => Self::bound(scene, table, given.clone())?.mesh.numbers,
        };
        put(scene, table, &mut given.mesh.nodes)?;
        Ok((given, numbers))
    }

    fn listed(scene: &Scene, table: &StructureConfig) -> Result<Self, Diagnostic> {
        if table.nodes.is_empty() {
            return scene.refuse(
                "structure",
                "the structure has no nodes",
                "write mesh = \"file\", a generator, or nodes = [[x, y, z], ...] and cables between them",
            );
        }
        let mut base = Self { cells: vec![Vec::new(); table.parts.len()], ..Self::default() };
        base.mesh.nodes.extend(table.nodes.iter().map(|p| Vector3::from(*p)));
        Ok(base)
    }

    /// The cells of a mesh by the parts of the scene, without the nodes that nothing uses.
    fn bound(scene: &Scene, table: &StructureConfig, generated: Generated) -> Result<Self, Diagnostic> {
        let Generated { mesh, held, parts } = generated;
        let binding = Binding { scene, table, mesh: &mesh };
        let (mut cells, mut lines) = (vec![Vec::new(); table.parts.len()], Vec::new());
        for (position, owner) in binding.owners(&parts)?.into_iter().enumerate() {
            let Some(nodes) = binding.cell(position, owner)? else { continue };
            let list = owner.map_or(&mut lines, |part| &mut cells[part]);
            list.push(Cell { nodes, from: vec![position as u32] });
        }
        for (i, part) in table.parts.iter().enumerate() {
            if part.joins_lines() {
                let number = |node: usize| mesh.numbers.get(node).copied().unwrap_or(node as u64);
                cells[i] = join(std::mem::take(&mut cells[i]), number).or_else(|why| {
                    let what = format!("the lines of `{}` make no ropes: {why}", part.head().name);
                    let hint = "put ropes that share nodes into groups of their own";
                    scene.refuse(&format!("structure.parts.{i}.name"), what, hint)
                })?;
            }
        }
        let mut base = Self { mesh, lines, cells, held, framed: true };
        if counts_nodes(table).is_none() {
            base.leave_out(table);
            if table.mesh.is_some() && table.renumber != Some(false) {
                base.bring_neighbours_together();
            }
        }
        Ok(base)
    }

    /// Leave out the nodes that no element, no support and no entry with a group uses.
    fn leave_out(&mut self, table: &StructureConfig) {
        let mut used = vec![false; self.mesh.nodes.len()];
        let cells = self.lines.iter().chain(self.cells.iter().flatten());
        cells.flat_map(|c| &c.nodes).chain(&self.held).for_each(|n| used[*n] = true);
        for name in table.places().filter_map(|(.., place)| place.group) {
            let group = self.mesh.node_groups.iter().find(|g| g.name == name);
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
        self.mesh.warnings.push(Diagnostic::warning(code::GEOMETRY, what));
    }

    /// Number the nodes anew, neighbours close to each other, if that halves their distances: steps then walk through
    /// memory from end to end. Messages call nodes by the numbers of the mesh.
    fn bring_neighbours_together(&mut self) {
        let cells = self.lines.iter().chain(self.cells.iter().flatten());
        let pairs: Vec<[usize; 2]> = cells.flat_map(|c| c.nodes.array_windows().copied()).collect();
        let order = neighbours_together(&pairs, self.mesh.nodes.len());
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
        let mesh = &mut self.mesh;
        let mut place = vec![None; mesh.nodes.len()];
        order.iter().enumerate().for_each(|(new, old)| place[*old] = Some(new));
        mesh.nodes = order.iter().map(|n| mesh.nodes[*n]).collect();
        mesh.numbers = order.iter().filter_map(|n| mesh.numbers.get(*n).copied()).collect();
        let cells = self.lines.iter_mut().chain(self.cells.iter_mut().flatten());
        for node in cells.flat_map(|c| &mut c.nodes).chain(&mut self.held) {
            *node = place[*node].expect("a node that is used is kept");
        }
        for group in &mut mesh.node_groups {
            group.nodes = group.nodes.iter().filter_map(|n| place[*n as usize]).map(|n| n as u32).collect();
            group.nodes.sort_unstable();
        }
        mesh.node_groups.retain(|g| !g.nodes.is_empty());
    }
}

/// The mesh of a scene's file or generator in axes of its own; `None` where the scene lists its nodes.
fn given(scene: &Scene, table: &StructureConfig) -> Result<Option<Generated>, Diagnostic> {
    let generated = match (&table.mesh, &table.generator) {
        (Some(_), Some(_)) => {
            let hint = "keep either `mesh` or `generator`";
            return scene.refuse("structure.mesh", "state either a mesh file or a generator", hint);
        }
        (Some(path), None) => {
            let path = named(scene, "structure.mesh", "mesh file", path)?;
            if let Some(key) = counts_nodes(table) {
                let hint = "name the nodes in the mesh and write group = \"name\", or at = [x, y, z]";
                return scene.refuse(&key, "a mesh file is bound by names, not by node numbers", hint);
            }
            Generated { mesh: read(&path)?, held: Vec::new(), parts: Vec::new() }
        }
        (None, Some(generator)) => generate(scene, generator)?,
        (None, None) => return Ok(None),
    };
    if !table.nodes.is_empty() || !table.cables.is_empty() {
        let key = if table.nodes.is_empty() { "structure.cables" } else { "structure.nodes" };
        let of = if table.mesh.is_some() { "the structure of a mesh file" } else { "a generated structure" };
        return Err(scene.invalid(key, format!("{of} takes no further nodes or cables")));
    }
    Ok(Some(generated))
}

/// The key of the first entry that counts nodes instead of naming them, if there is one.
fn counts_nodes(table: &StructureConfig) -> Option<String> {
    let place = table.places().find(|(.., place)| place.nodes.is_some());
    let entry = place.map(|(name, i, _)| format!("structure.{name}.{i}.nodes"));
    let group = || (!table.groups.is_empty()).then(|| "structure.groups.0.nodes".into());
    let part = || table.parts.iter().position(|p| !p.head().cells.is_empty());
    entry.or_else(group).or_else(|| part().map(|i| format!("structure.parts.{i}.cells")))
}

/// A mesh and the scene to whose parts its elements go.
struct Binding<'a> {
    scene: &'a Scene,
    table: &'a StructureConfig,
    mesh: &'a Mesh,
}

impl Binding<'_> {
    /// For each element of the mesh the part of the scene that it is in, if it is in any.
    fn owners(&self, made: &[MadeFor]) -> Result<Vec<Option<usize>>, Diagnostic> {
        let Self { scene, table, mesh } = *self;
        let mut owners: Vec<Option<usize>> = vec![None; mesh.elements.len()];
        for (i, part) in table.parts.iter().enumerate() {
            let key = format!("structure.parts.{i}.name");
            let PartHead { name, cells, .. } = part.head();
            let group = mesh.element_groups.iter().find(|g| g.name == name);
            let group = match (group, cells.is_empty()) {
                (None, false) => continue,
                (Some(group), true) => group,
                (Some(_), false) => {
                    let what = format!(
                        "the part `{name}` has cells, and the mesh has a group of elements of that name"
                    );
                    return scene.refuse(&key, what, "leave out `cells`, or choose another name");
                }
                // Nothing is made of it: its nodes do.
                (None, true) if part.head().kinds.is_empty() && has_nodes(mesh, name) => continue,
                (None, true) => {
                    let names: Vec<_> = mesh.element_groups.iter().map(|g| g.name.as_str()).collect();
                    let none = "the mesh has no groups of elements: name them in the program that made it";
                    let hint = nearest(name, &names, none);
                    return scene.refuse(&key, format!("there is no group of elements `{name}`"), hint);
                }
            };
            for element in &group.elements {
                if let Some(other) = owners[*element as usize].replace(i) {
                    let (number, other) =
                        (mesh.elements[*element as usize].number, table.parts[other].head().name);
                    let what = format!("element {number} is in the parts `{other}` and `{name}`");
                    return Err(scene.invalid(&key, what));
                }
            }
        }
        for MadeFor { group, element } in made.iter().filter(|p| p.element != "cable") {
            let own = mesh.element_groups.iter().find(|g| g.name == *group);
            if own.into_iter().flat_map(|g| &g.elements).any(|e| owners[*e as usize].is_none()) {
                let what = format!(
                    "the generated group `{group}` is made for element = \"{element}\", and no part says what becomes of it"
                );
                let hint = format!(
                    "write [[structure.parts]] with name = \"{group}\" and an element; \"none\" makes nothing of it"
                );
                return scene.refuse("structure.generator", what, hint);
            }
        }
        Ok(owners)
    }

    /// Nodes of the cell that an element of the mesh is; `None` where nothing becomes of it.
    fn cell(&self, position: usize, owner: Option<usize>) -> Result<Option<Vec<usize>>, Diagnostic> {
        let Self { scene, table, mesh } = *self;
        let (element, part) = (&mesh.elements[position], owner.map(|part| &table.parts[part]));
        let key = owner.map_or("structure".into(), |part| format!("structure.parts.{part}.name"));
        // Lines in no part are cables; a point says where something is, and is nothing.
        let head = part.map(|part| part.head());
        let (plural, kinds) =
            head.map_or(("cables", &[Kind::Line2, Kind::Row][..]), |head| (head.plural, head.kinds));
        if kinds.is_empty() || part.is_none() && element.kind == Kind::Point {
            return Ok(None);
        }
        let one = || describe(mesh, position);
        if !kinds.contains(&element.kind) {
            let what =
                format!("{plural} cannot be made of {}, and {} is one of them", element.kind.name(), one());
            let hint = match element.kind {
                Kind::Line3 | Kind::Tri6 => {
                    "save the mesh with elements of first order, or write a part with element = \"none\" for the group"
                }
                Kind::Tri3 | Kind::Quad4 => {
                    "write a part for the group: element = \"membrane\", \"shell\", \"ring\" or \"wire_ring\", \"cable\" for a closed polygon of cables, \"none\" for nothing"
                }
                _ => "write a part with another element for the group; \"none\" makes nothing of it",
            };
            return scene.refuse(&key, what, hint);
        }
        if part.is_none() && table.cable.is_none() {
            let what = format!("{} is in no part, and there is no table [structure.cable]", one());
            let mut groups = mesh.element_groups.iter();
            let group = groups.find(|g| g.elements.binary_search(&(position as u32)).is_ok());
            let hint = format!(
                "write [[structure.parts]] with name = \"{}\", element = \"cable\" and of = \"rope 20/1770\" (or young and area); \
                 or [structure.cable] with young, area and density for all lines that are in no part",
                group.map_or("GROUP", |group| &group.name)
            );
            return scene.refuse(&key, what, hint);
        }
        let mut nodes: Vec<usize> = mesh.nodes_of(element).iter().map(|n| *n as usize).collect();
        if part.is_some_and(|part| part.closes(element.kind)) {
            nodes.push(nodes[0]);
        }
        for pair in nodes.windows(2) {
            let length = (mesh.nodes[pair[1]] - mesh.nodes[pair[0]]).norm();
            if !(length > 0.0 && length.is_finite()) {
                return Err(scene.invalid(&key, format!("{} has the length {length} m", one())));
            }
        }
        Ok(Some(nodes))
    }
}

/// Whether a group of nodes has that name.
fn has_nodes(mesh: &Mesh, name: &str) -> bool {
    mesh.node_groups.iter().any(|group| group.name == name)
}

/// An element in words, with its groups.
fn describe(mesh: &Mesh, position: usize) -> String {
    let groups = mesh.element_groups.iter().filter(|g| g.elements.binary_search(&(position as u32)).is_ok());
    let names = groups.map(|g| format!("`{}`", g.name)).collect::<Vec<_>>();
    let within = match names.len() {
        0 => "(in no group)".into(),
        1 => format!("of the group {}", names[0]),
        _ => format!("of the groups {}", names.join(", ")),
    };
    format!("element {} {within}", mesh.elements[position].number)
}

/// A cell of a mesh, of which elements are made.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Cell {
    /// Its nodes.
    pub nodes: Vec<usize>,
    /// The elements of the mesh that it is, by position.
    pub from: Vec<u32>,
}

/// Elements made of an element of a mesh, by numbers in [`Model::elements`] and [`Model::cables`].
#[derive(Debug, Clone, Default)]
pub struct Made {
    /// Elements.
    pub elements: Range<usize>,
    /// Cables.
    pub cables: Range<usize>,
}

/// Join the lines that share an end: one cell for each rope, in the order and direction of its first line. An error says why lines
/// make no ropes; `number` is what it calls a node.
pub fn join(lines: Vec<Cell>, number: impl Fn(usize) -> u64) -> Result<Vec<Cell>, String> {
    let mut at: HashMap<usize, Vec<usize>> = HashMap::new();
    for (i, line) in lines.iter().enumerate() {
        for end in [line.nodes[0], line.nodes[line.nodes.len() - 1]] {
            let there = at.entry(end).or_default();
            there.push(i);
            if there.len() > 2 {
                return Err(format!("more than two of them end at node {}", number(end)));
            }
        }
    }
    let mut used = vec![false; lines.len()];
    let mut ropes = Vec::new();
    for (first, line) in lines.iter().enumerate() {
        if std::mem::replace(&mut used[first], true) {
            continue;
        }
        let mut rope = line.clone();
        // Onwards from its last node; then the same from its first.
        for _ in 0..2 {
            loop {
                let end = rope.nodes[rope.nodes.len() - 1];
                let Some(next) = at[&end].iter().copied().find(|i| !used[*i]) else { break };
                used[next] = true;
                let mut nodes = lines[next].nodes.clone();
                if nodes[0] != end {
                    nodes.reverse();
                }
                rope.nodes.extend(&nodes[1..]);
                rope.from.extend(&lines[next].from);
            }
            rope.nodes.reverse();
        }
        if rope.nodes[0] == rope.nodes[rope.nodes.len() - 1] {
            return Err(format!("that through node {} has no ends", number(rope.nodes[0])));
        }
        ropes.push(rope);
    }
    Ok(ropes)
}

/// Turn and move `nodes` [m] to the place of `table`, if it names one.
pub(super) fn put(
    scene: &Scene,
    table: &StructureConfig,
    nodes: &mut [Vector3<f64>],
) -> Result<(), Diagnostic> {
    let Some(place) = &table.place else { return Ok(()) };
    check(scene, table, place)?;
    let (sine, cosine) = place.azimuth.to_radians().sin_cos();
    let origin = Vector3::new(place.origin[0], place.origin[1], 0.0);
    for node in nodes.iter_mut() {
        // Along the azimuth, and to its left.
        let (x, y) = (node.x * sine - node.y * cosine, node.x * cosine + node.y * sine);
        *node = origin + Vector3::new(x, y, node.z);
    }
    if let Some(z) = place.origin.get(2) {
        nodes.iter_mut().for_each(|node| node.z += z);
        return Ok(());
    }
    let ground = ground(scene, table, place)?;
    let height = |at: &Vector3<f64>, what: &str| {
        let hint = "origin is in the coordinates of the terrain, azimuth in degrees from y, clockwise";
        let below = ground.below(at.x, at.y, what);
        below.or_else(|what| scene.refuse("structure.place.origin", what, hint))
    };
    if place.draped {
        for (number, node) in nodes.iter_mut().enumerate() {
            node.z += height(node, &format!("node {number}"))?;
        }
    } else {
        let below = height(&origin, "the origin")?;
        nodes.iter_mut().for_each(|node| node.z += below);
    }
    Ok(())
}

/// The same table with heights that need no ground, for who asks where it stands as seen from above.
pub(super) fn flat(table: &StructureConfig) -> StructureConfig {
    let mut flat = table.clone();
    if let Some(place) = &mut flat.place {
        place.origin.resize(3, 0.0);
        place.draped = false;
    }
    flat
}

/// Whether the heights of a raster are asked for.
pub(super) fn needs_ground(table: &StructureConfig) -> bool {
    table.place.as_ref().is_some_and(|place| place.origin.len() == 2)
}

fn check(scene: &Scene, table: &StructureConfig, place: &PlaceConfig) -> Result<(), Diagnostic> {
    if table.generator.as_ref().is_some_and(|generator| generator.is_placed()) {
        let what = "the line or position of the barrier says where it stands, and place says it again";
        return scene.refuse("structure.place", what, "leave out [structure.place]");
    }
    check_point(scene, "structure.place", ("origin", &place.origin), place.azimuth)?;
    let idle = |key: &str| {
        let what = format!("`{key}`: origin has a height of its own, and nothing will use the ground");
        scene
            .invalid(&format!("structure.place.{key}"), what)
            .try_instead(format!("leave out the third number of origin, or `{key}`"))
    };
    match place.origin.len() {
        3 if place.draped => Err(idle("draped")),
        3 if place.ground.is_some() => Err(idle("ground")),
        _ => Ok(()),
    }
}

fn ground(scene: &Scene, table: &StructureConfig, place: &PlaceConfig) -> Result<Heights, Diagnostic> {
    let of_contact = table.ground.as_ref().and_then(|ground| ground.file.as_ref());
    let Some(path) = place.ground.as_ref().or(of_contact) else {
        let what = "an origin of two numbers is on the ground, and its heights are not known here";
        return scene.refuse("structure.place.origin", what, "name a raster with ground = \"FILE.asc\", or write [x, y, z]; in a scene with [terrain], `rockfall run` and `rockfall \
             check` make the raster");
    };
    Heights::read(scene, "structure.place.ground", path)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lines(nodes: &[[usize; 2]]) -> Vec<Cell> {
        let cell = |(i, n): (usize, &[usize; 2])| Cell { nodes: n.to_vec(), from: vec![i as u32] };
        nodes.iter().enumerate().map(cell).collect()
    }

    fn number(node: usize) -> u64 {
        node as u64
    }

    #[test]
    fn lines_in_any_order_and_direction_are_one_rope_for_each_chain() {
        let ropes = join(lines(&[[2, 3], [1, 2], [7, 8], [4, 3], [9, 8]]), number).unwrap();
        assert_eq!(ropes.iter().map(|r| &r.nodes[..]).collect::<Vec<_>>(), [&[1, 2, 3, 4][..], &[7, 8, 9]]);
        assert_eq!(ropes[0].from, [0, 3, 1]);
    }

    #[test]
    fn branches_and_loops_are_no_ropes() {
        let why = |of: &[[usize; 2]]| join(lines(of), number).unwrap_err();
        assert_eq!(why(&[[0, 1], [1, 2], [1, 3]]), "more than two of them end at node 1");
        assert_eq!(why(&[[0, 1], [1, 2], [2, 0]]), "that through node 0 has no ends");
    }
}

#[cfg(test)]
mod place_tests {
    use super::*;
    use toolkit::scene::read_value;

    fn put_at(place: &str, mut nodes: Vec<Vector3<f64>>) -> Result<Vec<Vector3<f64>>, String> {
        let table: toml::Table = place.parse().expect("TOML");
        let table: StructureConfig = read_value("structure", &table.into()).map_err(|e| e.to_string())?;
        let scene = Scene::from_text("s.toml", "title = \"x\"").expect("valid");
        put(&scene, &table, &mut nodes).map_err(|e| e.to_string())?;
        Ok(nodes)
    }

    #[test]
    fn x_points_along_the_azimuth_and_y_to_its_left() {
        let axes = vec![Vector3::zeros(), Vector3::x(), Vector3::y(), Vector3::z()];
        for (azimuth, x, y) in [
            (90.0, Vector3::x(), Vector3::y()),
            (0.0, Vector3::y(), -Vector3::x()),
            (225.0, Vector3::new(-1.0, -1.0, 0.0).normalize(), Vector3::new(1.0, -1.0, 0.0).normalize()),
        ] {
            let origin = Vector3::new(2.6e6, 1.2e6, 1500.0);
            let text = format!("place = {{ origin = [2.6e6, 1.2e6, 1500.0], azimuth = {azimuth:?} }}");
            let put = put_at(&text, axes.clone()).expect("valid");
            for (is, exact) in put.iter().zip([Vector3::zeros(), x, y, Vector3::z()]) {
                assert!((is - origin - exact).norm() < 1e-9, "{azimuth}: {is}");
            }
        }
    }

    #[test]
    fn heights_count_from_the_ground_below_the_origin_or_below_each_node() {
        let dir = tempfile::tempdir().expect("a directory");
        let file = dir.path().join("g.asc");
        // z = 100 + 2 x + y from 0 to 20.
        let text = "ncols 2\nnrows 2\nxllcenter 0\nyllcenter 0\ncellsize 20\n120 160\n100 140\n";
        std::fs::write(&file, text).expect("written");
        let nodes = vec![Vector3::zeros(), Vector3::new(3.0, 0.0, 0.5)];
        let place =
            |more: &str| format!("place = {{ origin = [10, 5], azimuth = 0.0, ground = {file:?}, {more} }}");
        let put = put_at(&place(""), nodes.clone()).expect("valid");
        assert!((put[1] - Vector3::new(10.0, 8.0, 125.5)).norm() < 1e-12, "{put:?}");
        let draped = put_at(&place("draped = true"), nodes.clone()).expect("valid");
        assert!((draped[1] - Vector3::new(10.0, 8.0, 128.5)).norm() < 1e-12, "{draped:?}");
        let beside =
            put_at(&place("draped = true"), vec![Vector3::new(-6.0, 0.0, 0.0)]).expect_err("refused");
        assert!(
            beside.contains("node 0 stands at x = 10.00, y = -1.00 m, where there is no ground"),
            "{beside}"
        );
        for (text, words) in [
            ("place = { origin = [1.0] }", "a point of 1 numbers"),
            ("place = { origin = [1.0, 2.0] }", "its heights are not known here"),
            ("place = { origin = [1.0, 2.0, 3.0], draped = true }", "origin has a height of its own"),
            ("place = { origin = [1.0, 2.0, 3.0], azimuth = 400.0 }", "between -360 and 360"),
            (
                "place = { origin = [1.0, 2.0, 3.0] }\ngenerator = { type = \"barrier\", position = [0, 0], azimuth = 0.0, length = 9.0 }",
                "says it again",
            ),
        ] {
            let message = put_at(text, nodes.clone()).expect_err("refused");
            assert!(message.contains(words), "{message}");
        }
    }
}
