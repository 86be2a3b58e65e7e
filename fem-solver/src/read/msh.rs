//! Gmsh meshes, versions 2.2 and 4.1, ASCII.
//!
//! Physical groups become groups under their names; one without a name is called after its
//! dimension and number (`curve 3`). Sections that describe no mesh (`$NodeData`, `$Periodic`, ...)
//! are passed over with a warning.
//!
//! Source: Gmsh reference manual, section "MSH file format".

use super::mesh::{Builder, Kind, Mesh, Of};
use super::tokens::{Tokens, error, shown};
use interface_defs::diagnostic::Diagnostic;
use std::collections::HashMap;

/// What to do about a version that is not read.
const SAVE_AS: &str = "save it as 4.1 or 2.2, as in: gmsh -0 in.msh -format msh41 -o out.msh";

/// Programs that write it.
pub const PROGRAMS: &str = "Gmsh";

/// Refuse a binary file by its header, which is text in any case.
pub fn refuse_binary(file: &str, text: &str) -> Result<(), Diagnostic> {
    let mut t = Tokens::new(file, text);
    let words: [Option<&str>; 3] = std::array::from_fn(|_| t.next_word());
    if words[0] == Some("$MeshFormat") && words[2] == Some("1") {
        return Err(t.error("this is a binary mesh (file type 1), and only ASCII is read").try_instead(
            "save it as text: Mesh.Binary = 0 in Gmsh, or gmsh -0 in.msh -format msh41 -o out.msh",
        ));
    }
    Ok(())
}

/// Read a mesh from its text.
pub fn parse(file: &str, text: &str) -> Result<Mesh, Diagnostic> {
    let mut t = Tokens::new(file, text);
    let version = header(&mut t)?;
    let mut reader = MshReader {
        builder: Builder::new(file, text.len()),
        names: HashMap::new(),
        entities: HashMap::new(),
        written: HashMap::new(),
    };
    let mut passed: Vec<&str> = Vec::new();
    while let Some(section) = t.next_word() {
        match (section, version) {
            ("$PhysicalNames", _) => reader.physical_names(&mut t)?,
            ("$Entities", Version::V41) => reader.entities(&mut t)?,
            ("$Nodes", Version::V41) => reader.nodes_41(&mut t)?,
            ("$Elements", Version::V41) => reader.elements_41(&mut t)?,
            ("$Nodes", Version::V22) => reader.nodes_22(&mut t)?,
            ("$Elements", Version::V22) => reader.elements_22(&mut t)?,
            ("$PartitionedEntities", _) => {
                return Err(t
                    .error("this mesh is cut into partitions")
                    .try_instead("save it without them (in Gmsh: Mesh > Unpartition)"));
            }
            _ if !section.starts_with('$') || section.starts_with("$End") => {
                return Err(
                    t.error(format!("a section ($Nodes, ...) should begin here, found {}", shown(section)))
                );
            }
            _ => {
                skip(&mut t, file, section)?;
                if section != "$Comments" && !passed.contains(&section) && passed.len() < 10 {
                    passed.push(section);
                }
            }
        }
    }
    let passed: Vec<String> = passed.iter().map(ToString::to_string).collect();
    reader.builder.passed_over(&passed, None);
    reader.builder.finish()
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Version {
    V22,
    V41,
}

fn header(t: &mut Tokens) -> Result<Version, Diagnostic> {
    match t.next_word() {
        Some("$MeshFormat") => {}
        Some("$NOD") => return Err(t.error("this is a mesh of version 1").try_instead(SAVE_AS)),
        found => {
            let what =
                format!("a Gmsh mesh begins with $MeshFormat, this file with {}", shown(found.unwrap_or("")));
            return Err(t.error(what).try_instead(SAVE_AS));
        }
    }
    let version = match t.word("the version")? {
        "2.2" => Version::V22,
        "4.1" => Version::V41,
        other => {
            let what = format!("meshes of version 2.2 and 4.1 are read, this one says {}", shown(other));
            return Err(t.error(what).try_instead(SAVE_AS));
        }
    };
    if t.whole("the file type")? != 0 {
        return Err(t.error("only ASCII (file type 0) is read").try_instead(SAVE_AS));
    }
    t.whole("the data size")?;
    t.expect("$EndMeshFormat")?;
    Ok(version)
}

/// Pass over a section up to the line that ends it.
fn skip(t: &mut Tokens, file: &str, section: &str) -> Result<(), Diagnostic> {
    let begin = t.line();
    let end = format!("$End{}", &section[1..]);
    t.rest_of_line();
    while let Some(word) = t.next_word() {
        if word == end {
            return Ok(());
        }
        t.rest_of_line();
    }
    Err(error(file, begin, format!("the section {} that begins here has no end", shown(section))))
}

/// Name of a dimension.
fn dimension(dim: u64) -> Option<&'static str> {
    ["point", "curve", "surface", "volume"].get(usize::try_from(dim).ok()?).copied()
}

/// A shape that is read, by its number in Gmsh, and its dimension.
fn shape(number: u64) -> Option<(Kind, u64)> {
    Some(match number {
        15 => (Kind::Point, 0),
        1 => (Kind::Line2, 1),
        8 => (Kind::Line3, 1),
        2 => (Kind::Tri3, 2),
        9 => (Kind::Tri6, 2),
        3 => (Kind::Quad4, 2),
        _ => return None,
    })
}

fn known_shape(t: &Tokens, number: u64) -> Result<(Kind, u64), Diagnostic> {
    shape(number).ok_or_else(|| {
        let name = match number {
            4 | 11 => " (tetrahedron)",
            5 | 12 | 17 => " (hexahedron)",
            6 | 13 | 18 => " (prism)",
            7 | 14 | 19 => " (pyramid)",
            10 | 16 => " (quadrilateral of second order)",
            _ => "",
        };
        t.error(format!("elements of type {number}{name} are not read"))
            .try_instead("a structure is made of points, lines, triangles (both of order 1 and 2) and quadrilaterals of order 1; save only those, in physical groups")
    })
}

struct MshReader<'a> {
    builder: Builder<'a>,
    /// Names of physical groups by dimension and number.
    names: HashMap<(u64, i64), String>,
    /// Physical groups of an entity (4.1), by dimension and number.
    entities: HashMap<(u64, i64), Vec<i64>>,
    /// What version 2.2 says of entities, by shape and number.
    written: HashMap<(Kind, i64), Written>,
}

impl MshReader<'_> {
    fn physical_names(&mut self, t: &mut Tokens) -> Result<(), Diagnostic> {
        for _ in 0..t.whole("the number of physical names")? {
            let dim = t.whole("the dimension of a physical name")?;
            if dimension(dim).is_none() {
                return Err(t.error(format!("a physical group has the dimension {dim}, 0 to 3 exist")));
            }
            let number = t.signed("the number of a physical name")?;
            let text = t.rest_of_line();
            let name = text.strip_prefix('"').and_then(|n| n.strip_suffix('"')).unwrap_or_default().trim();
            if name.is_empty() {
                return Err(
                    t.error(format!("a physical name in quotes is expected here, found {}", shown(text)))
                );
            }
            self.names.insert((dim, number), name.to_owned());
        }
        t.expect("$EndPhysicalNames")
    }

    fn entities(&mut self, t: &mut Tokens) -> Result<(), Diagnostic> {
        let mut counts = [0; 4];
        for count in &mut counts {
            *count = t.whole("a number of entities")?;
        }
        for (dim, count) in (0..).zip(counts) {
            for _ in 0..count {
                let tag = t.signed("the number of an entity")?;
                for _ in 0..if dim == 0 { 3 } else { 6 } {
                    t.real("the box of an entity")?;
                }
                let mut groups = Vec::new();
                for _ in 0..t.whole("the number of physical groups of an entity")? {
                    groups.push(t.signed("a physical group of an entity")?);
                }
                if dim > 0 {
                    for _ in 0..t.whole("the number of boundaries of an entity")? {
                        t.signed("a boundary of an entity")?;
                    }
                }
                if !groups.is_empty() {
                    self.entities.insert((dim, tag), groups);
                }
            }
        }
        t.expect("$EndEntities")
    }

    fn nodes_22(&mut self, t: &mut Tokens) -> Result<(), Diagnostic> {
        for _ in 0..t.whole("the number of nodes")? {
            let number = t.whole("the number of a node")?;
            let line = t.line();
            let point = t.point()?;
            self.builder.node(line, number, point)?;
        }
        t.expect("$EndNodes")
    }

    fn nodes_41(&mut self, t: &mut Tokens) -> Result<(), Diagnostic> {
        let blocks = t.whole("the number of node blocks")?;
        for _ in 0..3 {
            t.whole("a count of nodes")?;
        }
        let mut numbers = Vec::new();
        for _ in 0..blocks {
            let dim = t.whole("the dimension of a node block")?;
            t.signed("the entity of a node block")?;
            let parametric = t.whole("whether nodes have parameters")?;
            let count = t.whole("the number of nodes of a block")?;
            numbers.clear();
            for _ in 0..count {
                numbers.push((t.whole("the number of a node")?, t.line()));
            }
            for (number, line) in &numbers {
                let point = t.point()?;
                for _ in 0..if parametric == 0 { 0 } else { dim.min(3) } {
                    t.real("a parameter of a node")?;
                }
                self.builder.node(*line, *number, point)?;
            }
        }
        t.expect("$EndNodes")
    }

    fn elements_41(&mut self, t: &mut Tokens) -> Result<(), Diagnostic> {
        let blocks = t.whole("the number of element blocks")?;
        for _ in 0..3 {
            t.whole("a count of elements")?;
        }
        let mut groups = Vec::new();
        for _ in 0..blocks {
            let dim = t.whole("the dimension of an element block")?;
            let tag = t.signed("the entity of an element block")?;
            let kind = t.whole("the type of an element block")?;
            let (kind, _) = known_shape(t, kind)?;
            groups.clear();
            for physical in self.entities.get(&(dim, tag)).into_iter().flatten() {
                groups.push(group(&mut self.builder, &self.names, dim, *physical));
            }
            for _ in 0..t.whole("the number of elements of a block")? {
                let number = t.whole("the number of an element")?;
                let line = t.line();
                let (nodes, count) = self.nodes_of(t, number, kind)?;
                let element = self.builder.element(line, number, kind, &nodes[..count])?;
                for group in &groups {
                    self.builder.add(line, Of::Elements, *group, element)?;
                }
            }
        }
        t.expect("$EndElements")
    }

    fn elements_22(&mut self, t: &mut Tokens) -> Result<(), Diagnostic> {
        for _ in 0..t.whole("the number of elements")? {
            let number = t.whole("the number of an element")?;
            let line = t.line();
            let kind = t.whole("the type of an element")?;
            let (kind, dim) = known_shape(t, kind)?;
            let (mut physical, mut entity) = (0, 0);
            for tag in 0..t.whole("the number of tags of an element")? {
                match (tag, t.signed("a tag of an element")?) {
                    (0, value) => physical = value,
                    (1, value) => entity = value,
                    _ => {}
                }
            }
            let (nodes, count) = self.nodes_of(t, number, kind)?;
            let written = self.written.entry((kind, entity)).or_default();
            let twin = if entity == 0 { None } else { written.twin(&self.builder, physical, &nodes) };
            let element = match twin {
                Some(element) => element,
                None => {
                    let element = self.builder.element(line, number, kind, &nodes[..count])?;
                    written.push(element, &nodes);
                    element
                }
            };
            if physical != 0 {
                let group = group(&mut self.builder, &self.names, dim, physical);
                self.builder.add(line, Of::Elements, group, element)?;
            }
        }
        t.expect("$EndElements")
    }

    fn nodes_of(&self, t: &mut Tokens, number: u64, kind: Kind) -> Result<([u32; 6], usize), Diagnostic> {
        let mut nodes = [u32::MAX; 6];
        let count = kind.node_count().expect("shapes of Gmsh have a fixed number of nodes");
        for node in &mut nodes[..count] {
            let named = t.whole("a node of an element")?;
            *node = self.builder.at(t.line(), Of::Nodes, named, format_args!("element {number}"))?;
        }
        Ok((nodes, count))
    }
}

/// The group of a physical number; a negative one stands for the same, run through backwards.
fn group(builder: &mut Builder, names: &HashMap<(u64, i64), String>, dim: u64, physical: i64) -> usize {
    let number = physical.saturating_abs();
    match names.get(&(dim, number)) {
        Some(name) => builder.group(Of::Elements, name, name),
        None => {
            let name = format!("{} {number}", dimension(dim).unwrap_or("entity"));
            builder.group(Of::Elements, &name, &name)
        }
    }
}

/// Elements of one entity and shape in version 2.2, which writes an element that is in two physical
/// groups twice.
#[derive(Default)]
struct Written {
    /// Physical group of the first.
    physical: i64,
    elements: Vec<u32>,
    /// Elements by their nodes, from where a second physical group appears.
    by_nodes: Option<HashMap<[u32; 6], u32>>,
}

impl Written {
    /// The element with these nodes that was written for another physical group.
    fn twin(&mut self, builder: &Builder, physical: i64, nodes: &[u32; 6]) -> Option<u32> {
        if self.elements.is_empty() {
            self.physical = physical;
        }
        if self.by_nodes.is_none() {
            if self.physical == physical {
                return None;
            }
            let key = |element: &u32| (padded(builder.nodes_of(*element)), *element);
            self.by_nodes = Some(self.elements.iter().map(key).collect());
        }
        self.by_nodes.as_ref()?.get(nodes).copied()
    }

    /// Append an element that has no twin.
    fn push(&mut self, element: u32, nodes: &[u32; 6]) {
        self.elements.push(element);
        if let Some(by_nodes) = &mut self.by_nodes {
            by_nodes.insert(*nodes, element);
        }
    }
}

/// Nodes of an element as a key of one size.
fn padded(nodes: &[u32]) -> [u32; 6] {
    let mut all = [u32::MAX; 6];
    all[..nodes.len()].copy_from_slice(nodes);
    all
}

#[cfg(test)]
mod tests {
    use super::super::{Format, parse as parse_bytes};
    use super::*;

    const V22: &str = r#"$MeshFormat
2.2 0 8
$EndMeshFormat
$PhysicalNames
2
0 1 "held end"
1 2 "rope"
$EndPhysicalNames
$Nodes
3
1 0 0 0
5 1 0 0
9 2 0 0
$EndNodes
$Elements
4
1 15 2 1 1 1
2 1 2 2 7 1 5
3 1 2 2 7 5 9
4 1 2 4 7 5 9
$EndElements
"#;
    const V41: &str = r#"$MeshFormat
4.1 0 8
$EndMeshFormat
$PhysicalNames
2
0 1 "held end"
1 2 "rope"
$EndPhysicalNames
$Entities
1 1 0 0
1 0 0 0 1 1
7 0 0 0 2 0 0 2 2 -4 2 1 -2
$EndEntities
$Nodes
2 3 1 9
0 1 0 1
1
0 0 0
1 7 1 2
5
9
1 0 0 0.5
2 0 0 1
$EndNodes
$Elements
2 3 1 3
0 1 15 1
1 1
1 7 1 2
2 1 5
3 5 9
$EndElements
$Periodic
0
$EndPeriodic
"#;

    fn read(text: &str) -> Result<Mesh, String> {
        parse_bytes("net.msh", Format::Msh, text.as_bytes()).map_err(|e| e.to_string())
    }

    #[test]
    fn both_versions_give_the_same_mesh_with_physical_names() {
        let old = read(V22).unwrap();
        let new = read(V41).unwrap();
        assert_eq!(new.warnings[0].to_string(), "net.msh: passed over: $Periodic");
        assert_eq!((&old.nodes, &old.numbers), (&new.nodes, &vec![1, 5, 9]));
        for (mesh, other_elements) in [(&old, vec![2]), (&new, vec![1, 2])] {
            assert_eq!(mesh.elements.len(), 3, "the element in two groups is one element");
            assert_eq!(mesh.nodes_of(&mesh.elements[2]), [1, 2]);
            let group =
                |name: &str| mesh.element_groups.iter().find(|g| g.name == name).unwrap().elements.clone();
            assert_eq!(group("held end"), [0]);
            assert_eq!(group("rope"), [1, 2]);
            assert_eq!(group("curve 4"), other_elements);
            let nodes = |name: &str| mesh.node_groups.iter().find(|g| g.name == name).unwrap().nodes.clone();
            assert_eq!((nodes("held end"), nodes("rope")), (vec![0], vec![0, 1, 2]));
        }
    }

    #[test]
    fn each_fault_is_told_with_file_and_line() {
        for (from, to, place, words) in [
            ("2.2 0 8", "2.2 1 8", "net.msh:2: ", "binary"),
            ("2.2 0 8", "4.0 0 8", "net.msh:2: ", "2.2 and 4.1 are read, this one says `4.0`"),
            ("$MeshFormat", "$NOD", "net.msh:1: ", "version 1"),
            ("$MeshFormat", "solid", "net.msh:1: ", "begins with $MeshFormat"),
            (
                "\n3\n1 0 0 0",
                "\n4\n1 0 0 0",
                "net.msh:14: ",
                "the number of a node should be a whole number, found `$EndNodes`",
            ),
            ("\n3\n1 0 0 0", "\n2\n1 0 0 0", "net.msh:13: ", "`$EndNodes` is expected here, found `9`"),
            (
                "\n3\n1 0 0 0",
                "\n99999999999999999999\n1 0 0 0",
                "net.msh:10: ",
                "the number of nodes should be",
            ),
            (
                "5 1 0 0",
                "5 1 nan 0",
                "net.msh:12: ",
                "a coordinate of a node should be a finite number, found `nan`",
            ),
            ("9 2 0 0", "5 2 0 0", "net.msh:13: ", "there is a node 5 already"),
            ("2 7 1 5", "2 7 1 6", "net.msh:18: ", "element 2 names node 6, which is not defined"),
            ("3 1 2 2 7 5 9", "3 4 2 2 7 5 9 1 2", "net.msh:19: ", "type 4 (tetrahedron) are not read"),
            ("3 1 2 2 7 5 9", "2 1 2 2 7 5 9", "net.msh:19: ", "there is an element 2 already"),
            ("\"rope\"", "rope", "net.msh:7: ", "a physical name in quotes"),
            ("$EndElements", "", "net.msh:22: ", "the file ends where `$EndElements` is expected"),
            (
                "$EndElements",
                "$EndElements\n$Blob\n1",
                "net.msh:22: ",
                "the section `$Blob` that begins here has no end",
            ),
        ] {
            assert!(V22.contains(from), "{from}");
            let message = read(&V22.replacen(from, to, 1)).expect_err(to);
            assert!(message.starts_with(place), "{to}: {message}");
            assert!(message.contains(words), "{to}: {message}");
        }
        assert!(read("").unwrap_err().contains("the file is empty"));
    }
}
