//! Input files of Abaqus and CalculiX: a step of statics under weight, from the structure as modelled.
//!
//! Prestress is that of a rise of the temperature by 1, with an expansion of `-S/E`: both programs take it, for each material its
//! own. A beam is the rectangle of equal `E A` and `E I`. CalculiX reads 20 characters of a number, so none has an exponent.

use super::deck::Deck;
use super::section::{Form, Section};
use super::writer::{Writer, lines, numbers};
use crate::read::Format;
use crate::read::mesh::Kind;
use std::fmt::Write;

/// Numbers on a line.
const MOST: usize = 16;
/// Longest name.
const LONGEST: usize = 80;

/// The format.
pub const WRITER: Writer = Writer { format: Format::Inp, name, lost, write };

fn name(name: &str) -> Option<String> {
    let fits = name.len() <= LONGEST && !name.is_empty() && !name.contains([',', '=', '"', '*', '\n']);
    // A set of numbers alone would be a member of sets.
    let fits = fits && name.parse::<u64>().is_err();
    fits.then(|| name.split_whitespace().collect::<String>().to_ascii_uppercase())
}

fn lost(deck: &Deck) -> Vec<String> {
    let mut lost = Vec::new();
    for Section { name, form, .. } in &deck.sections {
        match form {
            Form::Truss { tension_only: true, .. } => {
                lost.push(format!("`{name}`: that it carries no compression"));
            }
            Form::Beam { .. } => lost.push(format!("`{name}`: its torsion; that of a rectangle counts")),
            _ => {}
        }
    }
    lost
}

fn write(deck: &Deck, head: &[String]) -> String {
    let mut text = String::new();
    lines(&mut text, head.iter().map(|line| format!("** {line}")));
    text += "*NODE\n";
    lines(&mut text, deck.nodes.iter().map(|(node, at)| format!("{node}, {}, {}, {}", at.x, at.y, at.z)));
    let mut last = "";
    for element in &deck.elements {
        let own = kind(element.kind, &deck.sections[element.section].form);
        if own != last {
            let _ = writeln!(text, "*ELEMENT, TYPE={own}");
            last = own;
        }
        numbers(&mut text, &[&[element.number], &element.nodes[..]].concat(), MOST, ", ");
    }
    for (keyword, sets) in [("NSET", &deck.node_sets), ("ELSET", &deck.element_sets)] {
        for (name, own) in sets {
            let _ = writeln!(text, "*{keyword}, {keyword}={name}");
            numbers(&mut text, own, MOST, ", ");
        }
    }
    deck.sections.iter().for_each(|section| material(&mut text, section));
    if deck.sections.iter().any(|section| prestress(section) != 0.0) {
        text += "*INITIAL CONDITIONS, TYPE=TEMPERATURE\n";
        lines(&mut text, deck.nodes.iter().map(|(node, _)| format!("{node}, 0")));
    }
    boundary(&mut text, deck);
    step(&mut text, deck);
    text
}

fn kind(kind: Kind, form: &Form) -> &'static str {
    match (kind, form) {
        (Kind::Tri3, Form::Sheet { bends: true, .. }) => "S3",
        (Kind::Tri3, _) => "M3D3",
        (Kind::Quad4, Form::Sheet { bends: true, .. }) => "S4",
        (Kind::Quad4, _) => "M3D4",
        (_, Form::Beam { .. }) => "B31",
        _ => "T3D2",
    }
}

fn prestress(section: &Section) -> f64 {
    if let Form::Truss { prestress, .. } = section.form { prestress } else { 0.0 }
}

fn material(text: &mut String, section: &Section) {
    let Section { name, young, density, form, .. } = section;
    // That of a rectangle with the same second moments, and so of its modulus and density.
    let scale = match form {
        Form::Beam { area, inertia, .. } => area * area / (12.0 * (inertia[0] * inertia[1]).sqrt()),
        _ => 1.0,
    };
    let poisson = if let Form::Sheet { poisson, .. } = form { *poisson } else { 0.0 };
    let _ = writeln!(text, "*MATERIAL, NAME={name}\n*ELASTIC\n{}, {poisson}", young * scale);
    if *density > 0.0 {
        let _ = writeln!(text, "*DENSITY\n{}", density * scale);
    }
    if prestress(section) != 0.0 {
        let _ = writeln!(text, "*EXPANSION\n{}", -prestress(section) / young);
    }
    let of = format!("ELSET={name}, MATERIAL={name}");
    let _ = match form {
        Form::Truss { area, .. } => writeln!(text, "*SOLID SECTION, {of}\n{area}"),
        Form::Beam { area, inertia, axis, .. } => {
            let [a, b] = inertia.map(|inertia| (12.0 * inertia / area).sqrt());
            writeln!(text, "*BEAM SECTION, {of}, SECTION=RECT\n{a}, {b}\n{}, {}, {}", axis.x, axis.y, axis.z)
        }
        Form::Sheet { thickness, bends, .. } => {
            writeln!(text, "*{} SECTION, {of}\n{thickness}", if *bends { "SHELL" } else { "MEMBRANE" })
        }
    };
}

/// Directions by sets; turns node by node, since only ends of beams have them.
fn boundary(text: &mut String, deck: &Deck) {
    if !deck.supports.is_empty() {
        *text += "*BOUNDARY\n";
    }
    for support in &deck.supports {
        for dof in &support.held {
            if *dof < 3 {
                let _ = writeln!(text, "{}, {}", support.set, dof + 1);
                continue;
            }
            let turning = support.nodes.iter().filter(|(_, turns)| *turns);
            lines(text, turning.map(|(node, _)| format!("{node}, {}", dof + 1)));
        }
    }
}

fn step(text: &mut String, deck: &Deck) {
    *text += "*STEP, NLGEOM, INC=1000\n*STATIC\n0.1, 1\n";
    if deck.sections.iter().any(|section| prestress(section) != 0.0) {
        *text += "*TEMPERATURE\n";
        lines(text, deck.nodes.iter().map(|(node, _)| format!("{node}, 1")));
    }
    if let Some(g) = deck.gravity {
        *text += "*DLOAD\n";
        let (size, along) = (g.norm(), g.normalize());
        for Section { name, .. } in deck.sections.iter().filter(|section| section.density > 0.0) {
            let _ = writeln!(text, "{name}, GRAV, {size}, {}, {}, {}", along.x, along.y, along.z);
        }
    }
    *text += "*NODE FILE\nU\n*END STEP\n";
}
