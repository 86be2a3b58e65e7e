//! Mesh files that are cut, garbled, mixed up or lie about their size: a mesh that is sound, or one
//! error with a place. Deterministic: the same mutations each time.

use fem_solver::read::mesh::Mesh;
use fem_solver::read::{Format, parse};

const FILES: [(&str, Format); 4] = [
    ("net-5x5.msh", Format::Msh),
    ("net-5x5-v22.msh", Format::Msh),
    ("net-5x5.inp", Format::Inp),
    ("net-5x5.mdpa", Format::Mdpa),
];
/// Mutated files of each kind of mutation and format.
const EACH: usize = 600;

fn content(file: &str) -> Vec<u8> {
    std::fs::read(format!("{}/../launch/scenes/data/{file}", env!("CARGO_MANIFEST_DIR"))).unwrap()
}

/// Everything in the mesh points to something that is there, and it is not larger than the file allows.
fn assert_sound(mesh: &Mesh, bytes: usize, what: &str) {
    let nodes = mesh.nodes.len() as u32;
    assert!(nodes > 0 && mesh.nodes.iter().all(|n| n.iter().all(|x| x.is_finite())), "{what}");
    assert_eq!(mesh.numbers.len(), mesh.nodes.len(), "{what}");
    for element in &mesh.elements {
        assert_eq!(Some(mesh.nodes_of(element).len()), element.kind.node_count(), "{what}");
        assert!(mesh.nodes_of(element).iter().all(|n| *n < nodes), "{what}");
    }
    let elements = mesh.elements.len() as u32;
    assert!(mesh.element_groups.iter().flat_map(|g| &g.elements).all(|e| *e < elements), "{what}");
    assert!(mesh.node_groups.iter().flat_map(|g| &g.nodes).all(|n| *n < nodes), "{what}");
    // A node takes 4 bytes at least, an element 6.
    assert!(4 * mesh.nodes.len() <= bytes && 6 * mesh.elements.len() <= bytes, "{what}");
}

/// Read what became of a file: sound, or refused with the file's name and a line (unless the file as
/// a whole is at fault). Whether it was accepted.
fn survives(file: &str, format: Format, bytes: &[u8], what: &str) -> bool {
    match parse(file, format, bytes) {
        Ok(mesh) => {
            assert_sound(&mesh, bytes.len(), what);
            true
        }
        Err(error) => {
            let message = error.to_string();
            let rest = message.strip_prefix(file).unwrap_or_else(|| panic!("{what}: {message}"));
            let whole = ["the file is empty", "there is no node"].iter().any(|w| rest.contains(w));
            let line = rest[1..].split(':').next().and_then(|n| n.parse::<usize>().ok());
            let lines = bytes.iter().filter(|b| **b == b'\n').count() + 1;
            assert!(whole || line.is_some_and(|n| (1..=lines).contains(&n)), "{what}: {message}");
            assert!(message.len() < 1000, "{what}: {message}");
            false
        }
    }
}

/// Whole numbers below a bound, the same each time.
struct Dice(u64);

impl Dice {
    fn below(&mut self, bound: usize) -> usize {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 33) as usize) % bound.max(1)
    }

    /// A piece of `of`, not longer than `most`.
    fn piece(&mut self, of: &[u8], most: usize) -> std::ops::Range<usize> {
        let start = self.below(of.len());
        start..(start + 1 + self.below(most)).min(of.len())
    }
}

/// Words that parsers stumble over.
const WORDS: [&str; 20] = [
    "0",
    "-1",
    "18446744073709551615",
    "9223372036854775807",
    "-9223372036854775808",
    "4294967296",
    "1e999",
    "nan",
    "-inf",
    "\"",
    "$End",
    "$EndNodes",
    "*",
    "**",
    "End",
    "Begin",
    "//",
    "/*",
    ",",
    "\u{e9}\u{1F9D7}",
];

#[test]
fn a_file_that_is_cut_anywhere_is_refused_or_sound() {
    for (file, format) in FILES {
        let bytes = content(file);
        for end in 0..bytes.len() {
            survives(file, format, &bytes[..end], &format!("{file} cut at {end}"));
        }
    }
}

#[test]
fn mutated_files_are_refused_with_a_place_or_sound() {
    type Mutation = fn(&mut Vec<u8>, &mut Dice);
    let mutations: [(&str, Mutation); 7] = [
        ("a byte", |b, d| {
            let at = d.below(b.len());
            b[at] = d.below(256) as u8;
        }),
        ("a bit", |b, d| {
            let at = d.below(b.len());
            b[at] ^= 1 << d.below(8);
        }),
        ("a piece removed", |b, d| {
            let piece = d.piece(b, 60);
            b.drain(piece);
        }),
        ("a piece repeated", |b, d| {
            let piece = d.piece(b, 200);
            let copy = b[piece].to_vec();
            let at = d.below(b.len());
            b.splice(at..at, copy);
        }),
        ("a digit", |b, d| {
            let digits: Vec<usize> = (0..b.len()).filter(|i| b[*i].is_ascii_digit()).collect();
            let at = digits[d.below(digits.len())];
            b[at] = b'0' + d.below(10) as u8;
        }),
        ("a word", |b, d| {
            let at = d.below(b.len());
            let end = b[at..].iter().position(u8::is_ascii_whitespace).map_or(b.len(), |n| at + n);
            let start = b[..at].iter().rposition(u8::is_ascii_whitespace).map_or(0, |n| n + 1);
            b.splice(start..end.max(start), WORDS[d.below(WORDS.len())].bytes());
        }),
        ("lines swapped", |b, d| {
            let mut lines: Vec<Vec<u8>> = b.split(|c| *c == b'\n').map(<[u8]>::to_vec).collect();
            let (i, j) = (d.below(lines.len()), d.below(lines.len()));
            lines.swap(i, j);
            *b = lines.join(&b'\n');
        }),
    ];
    let mut dice = Dice(2026);
    let (mut accepted, mut refused) = (0, 0);
    for (file, format) in FILES {
        let original = content(file);
        for (name, mutation) in &mutations {
            for round in 0..EACH {
                let mut bytes = original.clone();
                // Later rounds do it more than once.
                for _ in 0..=round / 200 {
                    mutation(&mut bytes, &mut dice);
                    if bytes.is_empty() {
                        break;
                    }
                }
                match survives(file, format, &bytes, &format!("{file}, {name}, round {round}")) {
                    true => accepted += 1,
                    false => refused += 1,
                }
            }
        }
    }
    assert_eq!(accepted + refused, FILES.len() * mutations.len() * EACH);
    // The mutations reach both: what still is a mesh, and what is none.
    assert!(accepted > 1000 && refused > 5000, "{accepted} accepted, {refused} refused");
}

#[test]
fn noise_and_files_of_another_format_are_refused() {
    let mut dice = Dice(7);
    for (file, format) in FILES {
        for length in 1..400 {
            let noise: Vec<u8> = (0..length).map(|_| dice.below(256) as u8).collect();
            survives(file, format, &noise, "noise");
            let text: Vec<u8> =
                (0..length).map(|_| b" \n\t0123456789.-*$,/BeginEndNodes"[dice.below(32)]).collect();
            survives(file, format, &text, "noise as text");
        }
        for (other, of) in FILES {
            if of != format {
                assert!(
                    !survives(file, format, &content(other), "another format"),
                    "{other} read as {format:?}"
                );
            }
        }
    }
}

#[test]
fn counts_that_no_file_could_hold_cost_nothing() {
    let head = "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n";
    let many = u64::MAX;
    for (format, text) in [
        (Format::Msh, format!("{head}$Nodes\n{many} {many} {many} {many}\n0 1 0 {many}\n1\n")),
        (Format::Msh, format!("{head}$Entities\n{many} {many} {many} {many}\n1 0 0 0 {many} 1")),
        (Format::Msh, format!("{head}$PhysicalNames\n{many}\n0 1 \"a\"\n")),
        (
            Format::Msh,
            format!(
                "{}$Nodes\n1\n1 0 0 0\n$EndNodes\n$Elements\n{many}\n1 15 {many} 1 1 1",
                head.replace("4.1", "2.2")
            ),
        ),
        (Format::Inp, format!("*NODE\n1\n*NSET, NSET=a, GENERATE\n1, {many}")),
        (Format::Inp, format!("*NODE\n1\n*NSET, NSET=a, GENERATE\n1, {many}, {many}\n0, {many}")),
        (Format::Mdpa, format!("Begin Nodes\n1 0 0 0\nEnd Nodes\nBegin Elements Element2D{many}N\n1 0 1")),
        (Format::Mdpa, "Begin Nodes\n1 0 0 0\nEnd Nodes\nBegin Conditions C3D27N\n1 0 1 1".to_owned()),
    ] {
        assert!(!survives("file", format, text.as_bytes(), &text), "{text}");
    }
}

#[test]
fn groups_of_groups_cannot_grow_without_bound() {
    // 30 sets, each twice the one before: 2^30 members, if nobody counted.
    let mut text = "*NODE\n1\n2\n*NSET, NSET=S0\n1, 2\n".to_owned();
    for i in 1..=30 {
        text += &format!("*NSET, NSET=S{i}\nS{0}, S{0}\n", i - 1);
    }
    let message = parse("a.inp", Format::Inp, text.as_bytes()).unwrap_err().to_string();
    assert!(message.contains("far more members"), "{message}");
    // A thousand sets of all nodes are too many, ten are not.
    let nodes: String = (1..=20_000).map(|i| format!("{i}\n")).collect();
    let sets =
        |n: usize| -> String { (0..n).map(|i| format!("*NSET, NSET=S{i}, GENERATE\n1, 20000\n")).collect() };
    let read = |n: usize| parse("a.inp", Format::Inp, format!("*NODE\n{nodes}{}", sets(n)).as_bytes());
    assert_eq!(read(10).unwrap().node_groups.len(), 10);
    assert!(read(1000).unwrap_err().to_string().contains("far more members"));
}
