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

/// Hint for a version that is not read.
const SAVE_AS: &str = "save it as 4.1 or 2.2, as in: gmsh -0 in.msh -format msh41 -o out.msh";

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
    while let Some(section) = t.next_word() {
        match (section, version) {
            ("$PhysicalNames", _) => reader.physical_names(&mut t)?,
            ("$Entities", V41) => reader.entities(&mut t)?,
            ("$Nodes", V41) => reader.nodes_41(&mut t)?,
            ("$Elements", V41) => reader.elements_41(&mut t)?,
            ("$Nodes", _) => reader.nodes_22(&mut t)?,
            ("$Elements", _) => reader.elements_22(&mut t)?,
            ("$PartitionedEntities", _) => {
                let hint = "save it without them (in Gmsh: Mesh > Unpartition)";
                return Err(t.error("this mesh is cut into partitions").try_instead(hint));
            }
            _ if !section.starts_with('$') || section.starts_with("$End") => {
                let what = format!("a section ($Nodes, ...) should begin here, found {}", shown(section));
                return Err(t.error(what));
            }
            _ => {
                skip(&mut t, file, section)?;
                if section != "$Comments" {
                    reader.builder.pass_over(section);
                }
            }
        }
    }
    reader.builder.finish(None)
}

const V22: &str = "2.2";
const V41: &str = "4.1";

/// The version, one of those two.
fn header<'a>(t: &mut Tokens<'a>) -> Result<&'a str, Diagnostic> {
    let what = match t.next_word() {
        Some("$MeshFormat") => match t.word("the version")? {
            version @ (V22 | V41) if t.whole("the file type")? == 0 => {
                t.whole("the data size")?;
                t.expect("$EndMeshFormat")?;
                return Ok(version);
            }
            V22 | V41 => "only ASCII (file type 0) is read".into(),
            other => format!("meshes of version 2.2 and 4.1 are read, this one says {}", shown(other)),
        },
        Some("$NOD") => "this is a mesh of version 1".into(),
        found => {
            format!("a Gmsh mesh begins with $MeshFormat, this file with {}", shown(found.unwrap_or("")))
        }
    };
    Err(t.error(what).try_instead(SAVE_AS))
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

/// The shape with a number of Gmsh, and its dimension.
fn shape(t: &Tokens, number: u64) -> Result<(Kind, u64), Diagnostic> {
    let name = match number {
        15 => return Ok((Kind::Point, 0)),
        1 => return Ok((Kind::Line2, 1)),
        8 => return Ok((Kind::Line3, 1)),
        2 => return Ok((Kind::Tri3, 2)),
        9 => return Ok((Kind::Tri6, 2)),
        3 => return Ok((Kind::Quad4, 2)),
        4 | 11 => " (tetrahedron)",
        5 | 12 | 17 => " (hexahedron)",
        6 | 13 | 18 => " (prism)",
        7 | 14 | 19 => " (pyramid)",
        10 | 16 => " (quadrilateral of second order)",
        _ => "",
    };
    let hint = "a structure is made of points, lines, triangles (both of order 1 and 2) and quadrilaterals of order 1; \
                save only those, in physical groups";
    Err(t.error(format!("elements of type {number}{name} are not read")).try_instead(hint))
}

struct MshReader<'a> {
    builder: Builder<'a>,
    /// Names of physical groups by dimension and number.
    names: HashMap<(u64, i64), String>,
    /// Physical groups of an entity (4.1), by dimension and number.
    entities: HashMap<(u64, i64), Vec<i64>>,
    /// Elements of version 2.2 by shape, entity and nodes, with the physical group that they were first written for: one that
    /// is in two groups is written twice.
    written: HashMap<(Kind, i64, Vec<u32>), (u32, i64)>,
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
        for _ in 0..blocks {
            let dim = t.whole("the dimension of an element block")?;
            let tag = t.signed("the entity of an element block")?;
            let kind = t.whole("the type of an element block")?;
            let (kind, _) = shape(t, kind)?;
            let physical = self.entities.get(&(dim, tag)).cloned().unwrap_or_default();
            let groups: Vec<usize> = physical.into_iter().map(|number| self.group(dim, number)).collect();
            for _ in 0..t.whole("the number of elements of a block")? {
                let number = t.whole("the number of an element")?;
                let line = t.line();
                let nodes = self.nodes_of(t, number, kind)?;
                let element = self.builder.element(line, number, kind, &nodes)?;
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
            let (kind, dim) = shape(t, kind)?;
            let mut tags = [0, 0];
            for tag in 0..t.whole("the number of tags of an element")? {
                let value = t.signed("a tag of an element")?;
                tags.iter_mut().skip(tag as usize).take(1).for_each(|own| *own = value);
            }
            let [physical, entity] = tags;
            let nodes = self.nodes_of(t, number, kind)?;
            let key = (kind, entity, nodes);
            let element = match self.written.get(&key) {
                Some((element, other)) if entity != 0 && *other != physical => *element,
                _ => {
                    let element = self.builder.element(line, number, kind, &key.2)?;
                    self.written.insert(key, (element, physical));
                    element
                }
            };
            if physical != 0 {
                let group = self.group(dim, physical);
                self.builder.add(line, Of::Elements, group, element)?;
            }
        }
        t.expect("$EndElements")
    }

    fn nodes_of(&self, t: &mut Tokens, number: u64, kind: Kind) -> Result<Vec<u32>, Diagnostic> {
        let count = kind.node_count().expect("shapes of Gmsh have a fixed number of nodes");
        self.builder.nodes(t, count, "a node of an element", format_args!("element {number}"))
    }

    /// The group of a physical number; a negative one stands for the same, run through backwards.
    fn group(&mut self, dim: u64, physical: i64) -> usize {
        let number = physical.saturating_abs();
        let unnamed = || format!("{} {number}", dimension(dim).unwrap_or("entity"));
        let name = self.names.get(&(dim, number)).cloned().unwrap_or_else(unnamed);
        self.builder.group(Of::Elements, &name, &name)
    }
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
