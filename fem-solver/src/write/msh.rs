//! Meshes of Gmsh, version 2.2: names of sets as physical groups, sets of nodes as groups of points; nothing of what they are made.

use super::deck::{Deck, DeckElement, Set};
use super::writer::{Writer, lines};
use crate::read::Format;
use crate::read::mesh::Kind;
use std::collections::{BTreeMap, HashMap};
use std::fmt::Write;

/// The format.
pub const WRITER: Writer = Writer { format: Format::Msh, name, lost, write };

fn name(name: &str) -> Option<String> {
    let fits = !name.trim().is_empty() && name.trim() == name && !name.contains(['"', '\n']);
    fits.then(|| name.to_owned())
}

fn lost(deck: &Deck) -> Vec<String> {
    let what =
        "what parts are made of, prestress, supports and loads: names of sets are all that the format has";
    let own = own_nodes(deck);
    let differs =
        deck.node_sets.iter().filter(|(name, nodes)| own.get(&name[..]).is_some_and(|own| own != nodes));
    let differs = differs
        .map(|(name, _)| format!("the nodes of `{name}` that are no nodes of its elements, or not all"));
    std::iter::once(what.to_owned()).chain(differs).collect()
}

/// For each set of elements their nodes, in the order of the file.
fn own_nodes(deck: &Deck) -> HashMap<&str, Vec<u64>> {
    let place: HashMap<u64, usize> = deck.nodes.iter().map(|(number, _)| *number).zip(0..).collect();
    let nodes_of: HashMap<u64, &[u64]> = deck.elements.iter().map(|e| (e.number, &e.nodes[..])).collect();
    let sets = deck.element_sets.iter().map(|(name, own)| {
        let mut nodes: Vec<u64> = own.iter().flat_map(|e| nodes_of[e]).copied().collect();
        nodes.sort_unstable_by_key(|node| place[node]);
        nodes.dedup();
        (&name[..], nodes)
    });
    sets.collect()
}

fn write(deck: &Deck, head: &[String]) -> String {
    let own = own_nodes(deck);
    let mut points: Vec<&Set> =
        deck.node_sets.iter().filter(|(name, _)| !own.contains_key(&name[..])).collect();
    points.sort();
    let mut of_elements: Vec<&Set> = deck.element_sets.iter().collect();
    of_elements.sort();
    let kinds: HashMap<u64, u8> = deck.elements.iter().map(|e| (e.number, dimension(e))).collect();
    // A group is of one dimension: a set of both is two of one name.
    let mut groups: BTreeMap<(u8, &str), usize> = BTreeMap::new();
    let mut groups_of: HashMap<u64, Vec<usize>> = HashMap::new();
    for (name, _) in &points {
        let next = groups.len() + 1;
        groups.insert((0, name), next);
    }
    for (name, own) in of_elements {
        for element in own {
            let next = groups.len() + 1;
            let group = *groups.entry((kinds[element], name)).or_insert(next);
            groups_of.entry(*element).or_default().push(group);
        }
    }
    let mut text = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Comments\n".to_owned();
    lines(&mut text, head.iter().cloned());
    let _ = writeln!(text, "$EndComments\n$PhysicalNames\n{}", groups.len());
    lines(
        &mut text,
        groups.iter().map(|((dimension, name), group)| format!("{dimension} {group} \"{name}\"")),
    );
    let _ = writeln!(text, "$EndPhysicalNames\n$Nodes\n{}", deck.nodes.len());
    lines(&mut text, deck.nodes.iter().map(|(node, at)| format!("{node} {} {} {}", at.x, at.y, at.z)));
    // An element in several groups is written once for each, and points are behind all others.
    let mut next = deck.elements.iter().map(|element| element.number).max().unwrap_or(0);
    let (mut rows, mut again) = (Vec::new(), Vec::new());
    for element in &deck.elements {
        let nodes: String = element.nodes.iter().map(|node| format!(" {node}")).collect();
        let groups = groups_of.get(&element.number).map_or(&[0][..], |groups| groups);
        let entity = element.section + 1;
        rows.push(format!("{} {} 2 {} {entity}{nodes}", element.number, code(element.kind), groups[0]));
        for group in &groups[1..] {
            next += 1;
            again.push(format!("{next} {} 2 {group} {entity}{nodes}", code(element.kind)));
        }
    }
    for (name, nodes) in points {
        let group = groups[&(0, &name[..])];
        for node in nodes {
            next += 1;
            again.push(format!("{next} 15 2 {group} {group} {node}"));
        }
    }
    rows.extend(again);
    let _ = writeln!(text, "$EndNodes\n$Elements\n{}", rows.len());
    lines(&mut text, rows.into_iter());
    text + "$EndElements\n"
}

fn dimension(element: &DeckElement) -> u8 {
    if matches!(element.kind, Kind::Line2 | Kind::Line3) { 1 } else { 2 }
}

/// The number of a shape.
fn code(kind: Kind) -> u8 {
    match kind {
        Kind::Point => 15,
        Kind::Line2 | Kind::Row => 1,
        Kind::Tri3 => 2,
        Kind::Quad4 => 3,
        Kind::Line3 => 8,
        Kind::Tri6 => 9,
    }
}
