//! Kratos meshes: nodes, elements, conditions, sub model parts.
//!
//! A sub model part becomes a group of nodes and one of elements, called by its name; one inside
//! another by both (`Outer.inner`). Conditions are loads and no structure: what they add is their
//! nodes, to the groups that name them. The shape of an element follows from its name
//! (`TrussElement3D2N`: two nodes). Properties and data are passed over; the scene has its own.
//!
//! Source: Kratos documentation, "Input files and IO".

use super::mesh::{Builder, Kind, Mesh, Of};
use super::tokens::{Tokens, error, shown, without_comments};
use interface_defs::diagnostic::Diagnostic;
use std::collections::HashMap;

/// Largest depth of sub model parts in each other.
const DEEPEST: usize = 16;
/// Blocks that say nothing about the mesh and that every file has.
const EXPECTED: [&str; 2] = ["ModelPartData", "Properties"];

/// Read a mesh from its text.
pub fn parse(file: &str, text: &str) -> Result<Mesh, Diagnostic> {
    let text = without_comments(text);
    let mut reader = MdpaReader {
        file,
        t: Tokens::new(file, &text),
        builder: Builder::new(file, text.len()),
        conditions: HashMap::new(),
    };
    while let Some(word) = reader.t.next_word() {
        if word != "Begin" {
            let what = format!("a block should begin here (`Begin ...`), found {}", shown(word));
            return Err(reader.t.error(what));
        }
        match reader.t.word("the kind of a block")? {
            "Nodes" => reader.nodes()?,
            "Elements" => reader.elements()?,
            "Conditions" => reader.conditions()?,
            "SubModelPart" => reader.part(&mut Vec::new())?,
            other => {
                reader.skip(other)?;
                if !EXPECTED.contains(&other) {
                    reader.builder.pass_over(shown(other));
                }
            }
        }
    }
    reader.builder.finish(None)
}

struct MdpaReader<'a> {
    file: &'a str,
    t: Tokens<'a>,
    builder: Builder<'a>,
    /// Nodes of each condition, by its number.
    conditions: HashMap<u64, Vec<u32>>,
}

impl<'a> MdpaReader<'a> {
    /// The next number of a block, or `None` at its end.
    fn number(&mut self, block: &str) -> Result<Option<u64>, Diagnostic> {
        let word = self.t.word(&format!("a number, or `End {block}`"))?;
        if word == "End" {
            self.t.expect(block)?;
            return Ok(None);
        }
        word.parse().map(Some).map_err(|_| {
            self.t.error(format!("a whole number or `End {block}` is expected here, found {}", shown(word)))
        })
    }

    fn nodes(&mut self) -> Result<(), Diagnostic> {
        while let Some(number) = self.number("Nodes")? {
            let line = self.t.line();
            let point = self.t.point()?;
            self.builder.node(line, number, point)?;
        }
        Ok(())
    }

    fn elements(&mut self) -> Result<(), Diagnostic> {
        let name = self.t.word("the name of an element")?;
        let kind = shape(name).ok_or_else(|| {
            self.t.error(format!("elements called {} are not read", shown(name))).try_instead(
                "a structure is made of elements whose names end in 1N (points), 2N (lines), 3N (triangles; lines, if \
                 it is a line, truss, beam or cable), and of membranes, shells and rings",
            )
        })?;
        let count = kind.node_count().expect("shapes of files have a fixed number of nodes");
        while let Some(number) = self.number("Elements")? {
            let line = self.t.line();
            self.t.whole("the properties of an element")?;
            let by = format_args!("element {number}");
            let nodes = self.builder.nodes(&mut self.t, count, "a node of an element", by)?;
            self.builder.element(line, number, kind, &nodes)?;
        }
        Ok(())
    }

    fn conditions(&mut self) -> Result<(), Diagnostic> {
        let name = self.t.word("the name of a condition")?;
        let count = node_count(name).ok_or_else(|| {
            self.t.error(format!("the condition {} does not say how many nodes it has", shown(name)))
        })?;
        while let Some(number) = self.number("Conditions")? {
            let line = self.t.line();
            self.t.whole("the properties of a condition")?;
            let by = format_args!("condition {number}");
            let nodes = self.builder.nodes(&mut self.t, count, "a node of a condition", by)?;
            if self.conditions.insert(number, nodes).is_some() {
                return Err(error(self.file, line, format!("there is a condition {number} already")));
            }
        }
        Ok(())
    }

    /// A sub model part inside those of `outer`.
    fn part(&mut self, outer: &mut Vec<&'a str>) -> Result<(), Diagnostic> {
        outer.push(self.t.word("the name of a sub model part")?);
        if outer.len() > DEEPEST {
            return Err(self.t.error(format!("more than {DEEPEST} sub model parts are nested")));
        }
        let name = outer.join(".");
        let nodes = self.builder.group(Of::Nodes, &name, &name);
        loop {
            match self.t.word("`End SubModelPart`")? {
                "Begin" => {}
                "End" => {
                    outer.pop();
                    return self.t.expect("SubModelPart");
                }
                other => {
                    let what = format!("`Begin` or `End` is expected here, found {}", shown(other));
                    return Err(self.t.error(what));
                }
            }
            match self.t.word("the kind of a block")? {
                "SubModelPart" => self.part(outer)?,
                block @ ("SubModelPartNodes" | "SubModelPartElements") => {
                    let of = if block == "SubModelPartNodes" { Of::Nodes } else { Of::Elements };
                    while let Some(number) = self.number(block)? {
                        let group = self.builder.group(of, &name, &name);
                        self.builder.put(self.t.line(), of, group, number, "the sub model part")?;
                    }
                }
                block @ "SubModelPartConditions" => {
                    while let Some(number) = self.number(block)? {
                        let nodes_of = self.conditions.get(&number).ok_or_else(|| {
                            let by = "the sub model part";
                            self.t
                                .error(format!("{by} names condition {number}, which is not defined before"))
                        })?;
                        for node in nodes_of {
                            self.builder.add(self.t.line(), Of::Nodes, nodes, *node)?;
                        }
                    }
                }
                other => self.skip(other)?,
            }
        }
    }

    /// Pass over a block and those inside it.
    fn skip(&mut self, block: &str) -> Result<(), Diagnostic> {
        let begin = self.t.clone();
        let mut depth = 1_usize;
        while depth > 0 {
            match self.t.next_word() {
                Some("Begin") => depth += 1,
                Some("End") => {
                    depth -= 1;
                    let word = self.t.word("the kind of the block that ends")?;
                    if depth == 0 && word != block {
                        let what = format!("here ends {}, and {} has begun", shown(word), shown(block));
                        return Err(self.t.error(what));
                    }
                }
                Some(_) => {}
                None => {
                    let what = format!("the block {} that begins here has no end", shown(block));
                    return Err(begin.error(what));
                }
            }
        }
        Ok(())
    }
}

/// The `2` of `TrussElement3D2N`.
fn node_count(name: &str) -> Option<usize> {
    let (_, digits) = name.strip_suffix('N')?.rsplit_once('D')?;
    digits.parse().ok().filter(|n| (1..=27).contains(n))
}

/// Shape of an element, by its name.
fn shape(name: &str) -> Option<Kind> {
    let any = |parts: &[&str]| parts.iter().any(|part| name.contains(part));
    let flat =
        name.contains("2D") || any(&["Membrane", "Shell", "Surface", "Plate", "Ring", "Triangle", "Quad"]);
    match node_count(name)? {
        1 => Some(Kind::Point),
        2 => Some(Kind::Line2),
        3 if any(&["Line", "Truss", "Cable", "Beam", "Sliding"]) => Some(Kind::Line3),
        3 => Some(Kind::Tri3),
        4 if flat => Some(Kind::Quad4),
        6 if flat => Some(Kind::Tri6),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Format, parse as parse_bytes};
    use super::*;

    const NET: &str = r#"Begin ModelPartData
//  VARIABLE_NAME value
End ModelPartData
Begin Properties 0
  Begin Table 1 TIME DISPLACEMENT_X
  End Table
End Properties
Begin Nodes
  1  0.0  0.0  0.0
  2  1.0  0.0  0.0
  4  2.0  0.0  0.0
End Nodes
Begin Elements CableElement3D2N// GUI group identifier: rope
  7 0 1 2
  8 0 2 4
End Elements
Begin Conditions PointLoadCondition3D1N
  1 0 2
End Conditions
Begin NodalData DISPLACEMENT_X
  1 1 0.0
End NodalData
Begin SubModelPart Rope /* named
 by the user */
  Begin SubModelPartData
  End SubModelPartData
  Begin SubModelPartNodes
    1
    2
    4
  End SubModelPartNodes
  Begin SubModelPartElements
    7
    8
  End SubModelPartElements
  Begin SubModelPart load
    Begin SubModelPartConditions
    1
    End SubModelPartConditions
  End SubModelPart
End SubModelPart
"#;

    fn read(text: &str) -> Result<Mesh, String> {
        parse_bytes("net.mdpa", Format::Mdpa, text.as_bytes()).map_err(|e| e.to_string())
    }

    #[test]
    fn sub_model_parts_are_groups_and_conditions_are_no_elements() {
        let mesh = read(NET).unwrap();
        assert_eq!((mesh.nodes.len(), mesh.elements.len()), (3, 2));
        assert_eq!(mesh.nodes_of(&mesh.elements[1]), [1, 2]);
        let nodes = |name: &str| mesh.node_groups.iter().find(|g| g.name == name).unwrap().nodes.clone();
        assert_eq!((nodes("Rope"), nodes("Rope.load")), (vec![0, 1, 2], vec![1]));
        assert_eq!(mesh.element_groups.len(), 1);
        assert_eq!(mesh.element_groups[0].elements, [0, 1]);
        assert_eq!(mesh.warnings[0].to_string(), "net.mdpa: passed over: `NodalData`");
    }

    #[test]
    fn shapes_follow_from_names() {
        for (name, kind) in [
            ("TrussElement3D2N", Some(Kind::Line2)),
            ("CrLinearBeamElement3D2N", Some(Kind::Line2)),
            ("SlidingCableElement3D3N", Some(Kind::Line3)),
            ("RingElement3D4N", Some(Kind::Quad4)),
            ("MembraneElement3D3N", Some(Kind::Tri3)),
            ("ShellThinElementCorotational3D3N", Some(Kind::Tri3)),
            ("SmallDisplacementElement3D4N", None),
            ("NodalConcentratedElement3D1N", Some(Kind::Point)),
            ("Cable", None),
        ] {
            assert_eq!(shape(name), kind, "{name}");
        }
    }

    #[test]
    fn each_fault_is_told_with_file_and_line() {
        for (from, to, place, words) in [
            ("Begin Nodes", "Nodes", "net.mdpa:8: ", "a block should begin here"),
            (
                "2  1.0",
                "2  one",
                "net.mdpa:10: ",
                "a coordinate of a node should be a finite number, found `one`",
            ),
            ("  2  1.0", "  1  1.0", "net.mdpa:10: ", "there is a node 1 already"),
            ("End Nodes", "End Elements", "net.mdpa:12: ", "`Nodes` is expected here, found `Elements`"),
            (
                "End Nodes\n",
                "",
                "net.mdpa:12: ",
                "a whole number or `End Nodes` is expected here, found `Begin`",
            ),
            (
                "CableElement3D2N",
                "SolidElement3D8N",
                "net.mdpa:13: ",
                "called `SolidElement3D8N` are not read",
            ),
            ("8 0 2 4", "8 0 2 3", "net.mdpa:15: ", "element 8 names node 3"),
            ("8 0 2 4", "7 0 2 4", "net.mdpa:15: ", "there is an element 7 already"),
            ("    8\n", "    9\n", "net.mdpa:34: ", "names element 9, which is not defined"),
            (
                "    1\n    End SubModelPartC",
                "    2\n    End SubModelPartC",
                "net.mdpa:38: ",
                "names condition 2",
            ),
            (
                "  End SubModelPart\nEnd SubModelPart\n",
                "",
                "net.mdpa:40: ",
                "the file ends where `End SubModelPart`",
            ),
            ("End NodalData", "", "net.mdpa:20: ", "the block `NodalData` that begins here has no end"),
        ] {
            assert!(NET.contains(from), "{from}");
            let message = read(&NET.replacen(from, to, 1)).expect_err(to);
            assert!(message.starts_with(place), "{to}: {message}");
            assert!(message.contains(words), "{to}: {message}");
        }
        let deep = format!("Begin Nodes\n1 0 0 0\nEnd Nodes\n{}", "Begin SubModelPart a\n".repeat(10_000));
        assert!(read(&deep).unwrap_err().contains("are nested"));
    }
}
