//! Meshes of Kratos, for its structural mechanics: properties with their laws, weight and what is held as data of nodes.

use super::deck::Deck;
use super::section::{Form, Section};
use super::writer::{Writer, lines, numbers};
use crate::read::Format;
use crate::read::mesh::Kind;
use std::collections::BTreeSet;
use std::fmt::Write;

/// The format.
pub const WRITER: Writer = Writer { format: Format::Mdpa, name, lost: |_| Vec::new(), write };

/// Poisson's ratio of beams [1]: only their torsion knows it, which is stated as `G J`.
const POISSON: f64 = 0.3;

fn name(name: &str) -> Option<String> {
    let fits = !name.is_empty()
        && !name.contains(char::is_whitespace)
        && !name.contains("//")
        && !name.contains("/*");
    fits.then(|| name.to_owned())
}

fn write(deck: &Deck, head: &[String]) -> String {
    let mut text = String::new();
    lines(&mut text, head.iter().map(|line| format!("// {line}")));
    for (i, section) in (1..).zip(&deck.sections) {
        let _ = writeln!(text, "Begin Properties {i} // {}", section.name);
        properties(&mut text, section);
        text += "End Properties\n";
    }
    block(
        &mut text,
        "Nodes",
        deck.nodes.iter().map(|(node, at)| format!("{node} {} {} {}", at.x, at.y, at.z)),
    );
    let mut last = "";
    for element in &deck.elements {
        let own = kind(element.kind, &deck.sections[element.section].form);
        if own != last {
            let end = if last.is_empty() { "" } else { "End Elements\n" };
            let _ = writeln!(text, "{end}Begin Elements {own}");
            last = own;
        }
        let head = [element.number, element.section as u64 + 1];
        numbers(&mut text, &[&head, &element.nodes[..]].concat(), usize::MAX, " ");
    }
    text += if last.is_empty() { "" } else { "End Elements\n" };
    axes(&mut text, deck);
    for (dof, variable) in
        ["DISPLACEMENT", "ROTATION"].into_iter().flat_map(|v| ["X", "Y", "Z"].map(|c| (v, c))).enumerate()
    {
        let supports = deck.supports.iter().filter(|support| support.held.contains(&dof));
        let nodes = supports.flat_map(|support| &support.nodes).filter(|(_, turns)| dof < 3 || *turns);
        let nodes: BTreeSet<u64> = nodes.map(|(node, _)| *node).collect();
        let (vector, component) = variable;
        block(
            &mut text,
            &format!("NodalData {vector}_{component}"),
            nodes.iter().map(|node| format!("{node} 1 0")),
        );
    }
    if let Some(g) = deck.gravity {
        for (component, g) in ["X", "Y", "Z"].into_iter().zip(&g).filter(|(_, g)| **g != 0.0) {
            let rows = deck.nodes.iter().map(|(node, _)| format!("{node} 0 {g}"));
            block(&mut text, &format!("NodalData VOLUME_ACCELERATION_{component}"), rows);
        }
    }
    for (name, nodes) in &deck.node_sets {
        let _ = writeln!(text, "Begin SubModelPart {name}");
        block(&mut text, "SubModelPartNodes", nodes.iter().map(u64::to_string));
        let own = deck.element_sets.iter().filter(|(set, _)| set == name).flat_map(|(_, own)| own);
        block(&mut text, "SubModelPartElements", own.map(u64::to_string));
        text += "End SubModelPart\n";
    }
    text
}

/// A block of rows, unless there are none.
fn block(text: &mut String, head: &str, rows: impl Iterator<Item = String>) {
    let mut rows = rows.peekable();
    if rows.peek().is_some() {
        let _ = writeln!(text, "Begin {head}");
        lines(text, rows);
        let _ = writeln!(text, "End {}", head.split(' ').next().unwrap_or(head));
    }
}

fn kind(kind: Kind, form: &Form) -> &'static str {
    match (kind, form) {
        (Kind::Tri3, Form::Sheet { bends: true, .. }) => "ShellThinElementCorotational3D3N",
        (Kind::Tri3, _) => "MembraneElement3D3N",
        (Kind::Quad4, Form::Sheet { bends: true, .. }) => "ShellThinElementCorotational3D4N",
        (Kind::Quad4, _) => "MembraneElement3D4N",
        (_, Form::Beam { .. }) => "CrBeamElement3D2N",
        (_, Form::Truss { tension_only: false, .. }) => "TrussElement3D2N",
        _ => "CableElement3D2N",
    }
}

fn properties(text: &mut String, section: &Section) {
    let _ = writeln!(text, "YOUNG_MODULUS {}\nDENSITY {}", section.young, section.density);
    let _ = match section.form {
        Form::Truss { area, prestress, .. } => writeln!(
            text,
            "CROSS_AREA {area}\nTRUSS_PRESTRESS_PK2 {prestress}\nCONSTITUTIVE_LAW TrussConstitutiveLaw"
        ),
        Form::Beam { area, inertia: [first, second], torsion, .. } => writeln!(
            text,
            "CROSS_AREA {area}\nI33 {first}\nI22 {second}\nTORSIONAL_INERTIA {}\nPOISSON_RATIO {POISSON}\n\
             CONSTITUTIVE_LAW BeamConstitutiveLaw",
            torsion * 2.0 * (1.0 + POISSON)
        ),
        Form::Sheet { thickness, poisson, .. } => writeln!(
            text,
            "THICKNESS {thickness}\nPOISSON_RATIO {poisson}\nCONSTITUTIVE_LAW LinearElasticPlaneStress2DLaw"
        ),
    };
}

/// The first cross axis of each beam.
fn axes(text: &mut String, deck: &Deck) {
    let rows = deck.elements.iter().filter_map(|element| match deck.sections[element.section].form {
        Form::Beam { axis, .. } => {
            Some(format!("{} [3] ({}, {}, {})", element.number, axis.x, axis.y, axis.z))
        }
        _ => None,
    });
    block(text, "ElementalData LOCAL_AXIS_2", rows);
}
