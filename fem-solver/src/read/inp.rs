//! CalculiX and Abaqus input files: nodes, elements, sets.
//!
//! Read are `*NODE`, `*ELEMENT`, `*NSET`, `*ELSET` (with `GENERATE`, and with names of sets that stand
//! before). What would create or move nodes behind the reader's back (`*INCLUDE`, `*NGEN`, `*SYSTEM`,
//! several parts, ...) is refused. All else - materials, steps, loads - is passed over with one
//! warning that lists it: sections, supports and loads are the scene's.
//!
//! Names of sets are those of their first appearance; the file itself may repeat them in capitals or
//! small letters.
//!
//! Source: CalculiX CrunchiX user's manual, "Input deck format".

use super::mesh::{Builder, Kind, Mesh, Of};
use super::tokens::{error, real, shown};
use interface_defs::diagnostic::Diagnostic;

/// Most nodes that an element has, of the shapes that are read.
const MOST_NODES: usize = 6;

/// Read a mesh from its text.
pub fn parse(file: &str, text: &str) -> Result<Mesh, Diagnostic> {
    let mut reader = InpReader {
        file,
        line: 0,
        builder: Builder::new(file, text.len()),
        block: Block::Skip,
        row: Vec::new(),
        row_line: 0,
        parts: 0,
    };
    let mut card = String::new();
    let mut card_line = 0;
    for (line, content) in (1..).zip(text.lines()) {
        let content = content.trim();
        if content.is_empty() || content.starts_with("**") {
            continue;
        }
        reader.line = line;
        // A keyword goes on in the next line where it ends with a comma.
        let goes_on = card.ends_with(',');
        if !content.starts_with('*') && !goes_on {
            reader.data(content)?;
            continue;
        }
        if !goes_on {
            card.clear();
            card_line = line;
        }
        card.push_str(content);
        reader.line = card_line;
        if !card.ends_with(',') {
            reader.keyword(&card)?;
        }
    }
    if card.ends_with(',') {
        return Err(reader.error("this keyword ends with a comma, and nothing follows"));
    }
    reader.complete()?;
    reader.builder.finish(Some("sections, supports and loads are those of the scene"))
}

/// The block that the data lines at hand belong to.
enum Block {
    /// Nothing that is read; they are passed over.
    Skip,
    /// Nothing: this keyword has none.
    NoData(&'static str),
    Nodes(Option<usize>),
    Elements(Kind, Option<usize>),
    Set {
        of: Of,
        group: usize,
        generate: bool,
    },
}

/// A keyword and its parameters.
struct Card<'a> {
    name: String,
    parameters: Vec<(String, &'a str)>,
}

impl<'a> Card<'a> {
    fn new(text: &'a str) -> Self {
        let mut fields = text.trim_start_matches('*').split(',').map(str::trim);
        let words: Vec<&str> = fields.next().unwrap_or_default().split_whitespace().collect();
        let parameters = fields.filter(|f| !f.is_empty()).map(|field| {
            let (key, value) = field.split_once('=').unwrap_or((field, ""));
            (key.trim().to_ascii_uppercase(), value.trim().trim_matches('"'))
        });
        Self { name: words.join(" ").to_ascii_uppercase(), parameters: parameters.collect() }
    }

    fn get(&self, key: &str) -> Option<&'a str> {
        self.parameters.iter().find(|(k, _)| k == key).map(|(_, value)| *value)
    }
}

/// Hint for what is refused.
const FLAT: &str = "write a flat file with all nodes and elements in it";

struct InpReader<'a> {
    file: &'a str,
    /// Line of the keyword, or of the data, at hand.
    line: usize,
    builder: Builder<'a>,
    block: Block,
    /// Numbers of an element so far: its own, then its nodes.
    row: Vec<u64>,
    /// Line on which that element begins.
    row_line: usize,
    parts: usize,
}

impl InpReader<'_> {
    fn keyword(&mut self, text: &str) -> Result<(), Diagnostic> {
        self.complete()?;
        let card = Card::new(text);
        let refused = match card.name.as_str() {
            "NODE" if card.get("SYSTEM").is_some_and(|s| !s.eq_ignore_ascii_case("R")) => {
                Some("coordinates that are not rectangular are not read")
            }
            "INCLUDE" => Some("other files are not followed; put its text here"),
            "NGEN" | "NCOPY" | "NFILL" | "NMAP" | "ELGEN" | "ELCOPY" | "SYSTEM" | "SUBMODEL" => {
                Some("nodes and elements are read only where they are written out")
            }
            "PART" if self.parts > 0 => Some("one part is read, this is the second"),
            _ => None,
        };
        if let Some(why) = refused {
            return Err(self.error(format!("*{} is refused: {why}", card.name)).try_instead(FLAT));
        }
        self.block = match card.name.as_str() {
            "NODE" => Block::Nodes(self.group(&card, Of::Nodes)?),
            "ELEMENT" => {
                let name = card.get("TYPE").ok_or_else(|| self.error("*ELEMENT has no TYPE"))?;
                let kind = shape(name).ok_or_else(|| {
                    self.error(format!("elements of type {} are not read", shown(name))).try_instead(
                        "a structure is made of points (MASS), lines (T3D2, B31, ...), triangles (S3, M3D3, S6, ...) \
                         and quadrilaterals (S4, M3D4, ...)",
                    )
                })?;
                Block::Elements(kind, self.group(&card, Of::Elements)?)
            }
            name @ ("NSET" | "ELSET") => {
                let of = if name == "NSET" { Of::Nodes } else { Of::Elements };
                let group = self.group(&card, of)?;
                let group = group.ok_or_else(|| self.error(format!("*{name} has no name ({name}=...)")))?;
                match card.get("ELSET").filter(|_| of == Of::Nodes) {
                    Some(from) => {
                        let from = self.builder.known_group(self.line, Of::Elements, &key(from))?;
                        self.builder.add_nodes_of_elements(self.line, group, from)?;
                        Block::NoData("*NSET with ELSET")
                    }
                    None => Block::Set { of, group, generate: card.get("GENERATE").is_some() },
                }
            }
            "PART" => {
                self.parts += 1;
                Block::NoData("*PART")
            }
            // A moved instance has data lines; they are refused there.
            "INSTANCE" => Block::NoData("*INSTANCE"),
            "END PART" | "END INSTANCE" | "ASSEMBLY" | "END ASSEMBLY" | "HEADING" => Block::Skip,
            name => {
                self.builder.pass_over(format!("*{}", shown(name).trim_matches('`')));
                Block::Skip
            }
        };
        Ok(())
    }

    /// An error at the line at hand.
    fn error(&self, what: impl Into<String>) -> Diagnostic {
        error(self.file, self.line, what)
    }

    /// The set that a keyword names, if it names one.
    fn group(&mut self, card: &Card, of: Of) -> Result<Option<usize>, Diagnostic> {
        let parameter = if of == Of::Nodes { "NSET" } else { "ELSET" };
        match card.get(parameter) {
            Some("") => Err(self.error(format!("{parameter} has no name"))),
            name => Ok(name.map(|name| self.builder.group(of, &key(name), name))),
        }
    }

    fn data(&mut self, content: &str) -> Result<(), Diagnostic> {
        match self.block {
            Block::Skip => Ok(()),
            Block::NoData(keyword) => {
                Err(self.error(format!("{keyword} takes no data here")).try_instead(FLAT))
            }
            Block::Nodes(group) => self.node(content, group),
            Block::Elements(kind, group) => self.element(content, kind, group),
            Block::Set { of, group, generate: true } => {
                // The first number that is not known ends it, whatever the range claims.
                let mut numbers = self.range(content)?;
                numbers.try_for_each(|number| self.builder.put(self.line, of, group, number, "the set"))
            }
            Block::Set { of, group, generate: false } => fields(content).try_for_each(|field| {
                if let Ok(number) = field.parse() {
                    return self.builder.put(self.line, of, group, number, "the set");
                }
                let from = self.builder.known_group(self.line, of, &key(field))?;
                self.builder.add_group(self.line, of, group, from)
            }),
        }
    }

    fn node(&mut self, content: &str, group: Option<usize>) -> Result<(), Diagnostic> {
        let mut fields = content.split(',').map(str::trim);
        let number = self.whole("the number of a node", fields.next().unwrap_or_default())?;
        let mut point = [0.0; 3];
        // A field that is left empty is 0.
        for (component, field) in point.iter_mut().zip(fields).filter(|(_, field)| !field.is_empty()) {
            *component = real(field).ok_or_else(|| {
                let what = format!("a coordinate of node {number} should be a finite number");
                self.error(format!("{what}, found {}", shown(field)))
            })?;
        }
        let node = self.builder.node(self.line, number, point)?;
        group.map_or(Ok(()), |group| self.builder.add(self.line, Of::Nodes, group, node))
    }

    fn element(&mut self, content: &str, kind: Kind, group: Option<usize>) -> Result<(), Diagnostic> {
        let (line, count) = (self.line, kind.node_count().unwrap_or(MOST_NODES));
        if self.row.is_empty() {
            self.row_line = line;
        }
        for field in fields(content) {
            if self.row.len() > count {
                let number = self.row[0];
                let what = format!("element {number} has more nodes than the {count} of its type");
                return Err(self.error(what));
            }
            self.row.push(self.whole("a number of an element", field)?);
        }
        if self.row.len() <= count {
            return Ok(());
        }
        let number = self.row[0];
        let mut nodes = [0; MOST_NODES];
        for (node, named) in nodes.iter_mut().zip(&self.row[1..]) {
            *node = self.builder.at(line, Of::Nodes, *named, format_args!("element {number}"))?;
        }
        let element = self.builder.element(self.row_line, number, kind, &nodes[..count])?;
        self.row.clear();
        group.map_or(Ok(()), |group| self.builder.add(line, Of::Elements, group, element))
    }

    /// No element may be left half read.
    fn complete(&self) -> Result<(), Diagnostic> {
        if let (Block::Elements(kind, _), Some(number)) = (&self.block, self.row.first()) {
            let (found, count) = (self.row.len() - 1, kind.node_count().unwrap_or(MOST_NODES));
            let what = format!("element {number} has {found} nodes, its type has {count}");
            return Err(error(self.file, self.row_line, what));
        }
        Ok(())
    }

    /// `first, last, step` of a set that is generated.
    fn range(&self, content: &str) -> Result<impl Iterator<Item = u64> + use<>, Diagnostic> {
        let names = ["the first number", "the last number", "the step"];
        let numbers = fields(content).zip(names.into_iter().chain(["a further number"]));
        let numbers = numbers.map(|(field, what)| self.whole(what, field)).collect::<Result<Vec<_>, _>>()?;
        let (first, last, step) = match numbers[..] {
            [first, last] => (first, last, 1),
            [first, last, step] => (first, last, step),
            _ => return Err(self.error("GENERATE needs the first number, the last, and the step")),
        };
        let wide = usize::try_from(step).unwrap_or(usize::MAX);
        if wide == 0 || last < first {
            return Err(self.error(format!("from {first} to {last} by {step} is no range")));
        }
        Ok((first..=last).step_by(wide))
    }

    fn whole(&self, what: &str, field: &str) -> Result<u64, Diagnostic> {
        field
            .parse()
            .map_err(|_| self.error(format!("{what} should be a whole number, found {}", shown(field))))
    }
}

/// Fields of a data line; empty ones, as behind a last comma, are left out.
fn fields(content: &str) -> impl Iterator<Item = &str> {
    content.split(',').map(str::trim).filter(|f| !f.is_empty())
}

/// Key of a name inside the file.
fn key(name: &str) -> String {
    name.trim_matches('"').to_ascii_uppercase()
}

/// The shape of a type of element; variants (reduced integration, hybrid) have that of their base.
fn shape(name: &str) -> Option<Kind> {
    let name = name.to_ascii_uppercase();
    Some(match name.trim_end_matches(['R', 'H', 'I']) {
        "MASS" | "ROTARY" | "SPRING1" | "DASHPOT1" => Kind::Point,
        "T2D2" | "T3D2" | "B21" | "B23" | "B31" | "B33" | "PIPE21" | "PIPE31" | "CONN2D2" | "CONN3D2"
        | "SPRING2" | "SPRINGA" | "DASHPOT2" | "DASHPOTA" | "R2D2" | "RB3D2" => Kind::Line2,
        "T2D3" | "T3D3" | "B22" | "B32" | "PIPE22" | "PIPE32" => Kind::Line3,
        "S3" | "STRI3" | "M3D3" | "CPS3" | "CPE3" | "CAX3" | "R3D3" | "SFM3D3" | "DS3" => Kind::Tri3,
        "S6" | "STRI65" | "M3D6" | "CPS6" | "CPE6" | "CAX6" | "SFM3D6" | "DS6" => Kind::Tri6,
        "S4" | "M3D4" | "CPS4" | "CPE4" | "CAX4" | "R3D4" | "SFM3D4" | "DS4" => Kind::Quad4,
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::super::{Format, parse as parse_bytes};
    use super::*;

    const NET: &str = r#"** a comment
*Heading
 anything at all
*NODE, NSET=All
1, 0., 0., 0.
2, 1.D0, 0
 3, 2.0, 0.0, 0.0,
*Element, type=T3D2,
 elset=Rope
10, 1,
2
11, 2, 3
*NSET, NSET=ends
1, 3,
*NSET, NSET=Both
ENDS, 2
*NSET, NSET=range, GENERATE
1, 3, 2
*ELSET, ELSET=last
11
*ELSET, ELSET=every
rope, LAST
*NSET, NSET=touched, ELSET=last
*MATERIAL, NAME=steel
*ELASTIC
2.1e11, 0.3
*STEP
*STATIC
*END STEP
"#;

    fn read(text: &str) -> Result<Mesh, String> {
        parse_bytes("net.inp", Format::Inp, text.as_bytes()).map_err(|e| e.to_string())
    }

    #[test]
    fn nodes_elements_and_sets_are_read_and_the_rest_is_listed() {
        let mesh = read(NET).unwrap();
        assert_eq!((mesh.nodes.len(), mesh.elements.len()), (3, 2));
        assert_eq!(mesh.nodes[1].x, 1.0);
        assert_eq!(mesh.nodes_of(&mesh.elements[0]), [0, 1]);
        let nodes = |name: &str| mesh.node_groups.iter().find(|g| g.name == name).unwrap().nodes.clone();
        assert_eq!((nodes("All"), nodes("ends"), nodes("Both")), (vec![0, 1, 2], vec![0, 2], vec![0, 1, 2]));
        assert_eq!(
            (nodes("range"), nodes("touched"), nodes("Rope")),
            (vec![0, 2], vec![1, 2], vec![0, 1, 2])
        );
        let elements =
            |name: &str| mesh.element_groups.iter().find(|g| g.name == name).unwrap().elements.clone();
        assert_eq!(
            (elements("Rope"), elements("last"), elements("every")),
            (vec![0, 1], vec![1], vec![0, 1])
        );
        let listed = "net.inp: passed over: *MATERIAL, *ELASTIC, *STEP, *STATIC, *END STEP;";
        assert!(mesh.warnings[0].to_string().starts_with(listed), "{:?}", mesh.warnings);
    }

    #[test]
    fn each_fault_is_told_with_file_and_line() {
        for (from, to, place, words) in [
            ("*Heading", "*INCLUDE, INPUT=/etc/passwd", "net.inp:2: ", "*INCLUDE is refused"),
            ("*Heading", "*SYSTEM", "net.inp:2: ", "*SYSTEM is refused"),
            ("*NODE, NSET=All", "*NODE, SYSTEM=C", "net.inp:4: ", "not rectangular"),
            ("1.D0", "one", "net.inp:6: ", "a coordinate of node 2 should be a finite number, found `one`"),
            ("2, 1.D0", "1, 1.D0", "net.inp:6: ", "there is a node 1 already"),
            (
                "2, 1.D0",
                "-2, 1.D0",
                "net.inp:6: ",
                "the number of a node should be a whole number, found `-2`",
            ),
            ("type=T3D2", "type=C3D8", "net.inp:8: ", "elements of type `C3D8` are not read"),
            ("type=T3D2,\n elset=Rope", "elset=Rope", "net.inp:8: ", "*ELEMENT has no TYPE"),
            ("11, 2, 3", "11, 2, 3, 4", "net.inp:12: ", "element 11 has more nodes than the 2"),
            ("11, 2, 3", "11, 2", "net.inp:12: ", "element 11 has 1 nodes, its type has 2"),
            ("11, 2, 3", "11, 2, 7", "net.inp:12: ", "element 11 names node 7"),
            ("11, 2, 3", "10, 2, 3", "net.inp:12: ", "there is an element 10 already"),
            ("ENDS, 2", "FINISH, 2", "net.inp:16: ", "there is no node set `FINISH` before"),
            ("1, 3, 2", "1, 18446744073709551615", "net.inp:18: ", "the set names node 4"),
            ("1, 3, 2", "1, 3, 0", "net.inp:18: ", "from 1 to 3 by 0 is no range"),
            ("*NSET, NSET=ends", "*NSET", "net.inp:13: ", "*NSET has no name"),
            ("*STEP", "*PART, NAME=a\n*END PART\n*PART, NAME=b", "net.inp:29: ", "one part is read"),
            (
                "*STEP",
                "*INSTANCE, NAME=a, PART=b\n1., 0., 0.",
                "net.inp:28: ",
                "*INSTANCE takes no data here",
            ),
            ("*END STEP", "*END STEP,", "net.inp:29: ", "ends with a comma"),
        ] {
            assert!(NET.contains(from), "{from}");
            let message = read(&NET.replacen(from, to, 1)).expect_err(to);
            assert!(message.starts_with(place), "{to}: {message}");
            assert!(message.contains(words), "{to}: {message}");
        }
        assert_eq!(read("*STEP\n").unwrap_err(), "net.inp: there is no node in this file");
    }
}
