//! From a scene to the document of its structure.

use super::deck::{Deck, DeckElement, DeckNode, Set, Support, VERSION};
use super::section::Section;
use crate::config::Config;
use crate::config::structure::{StructureConfig, Where};
use crate::element::PartConfig;
use crate::element::part::PartHead;
use crate::integrator::start::Start;
use crate::model::Model;
use crate::model::base::Base;
use crate::model::generator::Generated;
use crate::read::Key;
use crate::read::mesh::{ElementGroup, Kind, Mesh};
use interface_defs::diagnostic::Diagnostic;
use nalgebra::Vector3;
use std::collections::HashMap;
use toolkit::scene::Scene;

/// The set of lines in no part.
const REST: &str = "in_no_part";
/// The set of what a generator holds, where no group is that.
const HELD: &str = "held";

/// A scene on the way into a document.
struct Making<'a> {
    scene: &'a Scene,
    config: &'a Config,
    model: &'a Model,
    mesh: &'a Mesh,
    /// Number of each node of the model.
    numbers: &'a [u64],
    /// Position of each node of the mesh, by its number.
    place: HashMap<u64, usize>,
    deck: Deck,
    /// Sections by part and by whether their elements are faces.
    sections: HashMap<(Option<usize>, bool), usize>,
}

impl Deck {
    /// The structure of `scene`, as modelled or where it comes to rest.
    pub fn of(scene: &Scene, at_rest: bool) -> Result<Self, Diagnostic> {
        let config = Config::of(scene)?;
        let model = Model::build(scene, &config)?;
        let (Generated { mut mesh, held, .. }, numbers) = Base::whole(scene, &config.structure)?;
        add_listed(&mut mesh, &config.structure);
        let place: HashMap<u64, usize> = mesh.numbers.iter().copied().zip(0..).collect();
        let mut places = mesh.nodes.clone();
        let mut warnings = model.warnings.clone();
        if at_rest {
            let progress = &mut |what: String| {
                tracing::info!("{what}");
                Ok(())
            };
            let start = Start::new(scene, &config, &model, None, None, progress);
            let start = start.map_err(|fault| *fault.diagnostic)?;
            let moved = numbers.iter().enumerate();
            moved.for_each(|(i, number)| places[place[number]] += model.vector(&start.form.displacement, i));
            warnings = start.warnings;
        }
        let nodes = mesh
            .numbers
            .iter()
            .zip(&places)
            .map(|(number, at)| DeckNode { number: *number, at: (*at).into() });
        let deck = Self {
            version: VERSION,
            units: "SI",
            at_rest,
            nodes: nodes.collect(),
            warnings: warnings.iter().map(ToString::to_string).collect(),
            ..Self::default()
        };
        let (config, model, mesh, numbers) = (&config, &model, &mesh, &numbers[..]);
        let mut making =
            Making { scene, config, model, mesh, numbers, place, deck, sections: HashMap::new() };
        making.elements();
        making.sets()?;
        making.held(&held)?;
        making.rest();
        Ok(making.deck)
    }
}

/// Cells of parts and cables that the scene lists, as elements of its mesh.
fn add_listed(mesh: &mut Mesh, table: &StructureConfig) {
    for PartHead { name, cells, kinds, .. } in table.parts.iter().map(|part| part.head()) {
        let kind = |nodes: usize| match nodes {
            3 if kinds.contains(&Kind::Tri3) && !kinds.contains(&Kind::Row) => Kind::Tri3,
            4 if kinds.contains(&Kind::Quad4) && !kinds.contains(&Kind::Row) => Kind::Quad4,
            _ => Kind::Row,
        };
        let elements: Vec<u32> = cells.iter().map(|cell| mesh.push(kind(cell.len()), cell)).collect();
        if !elements.is_empty() {
            mesh.element_groups.push(ElementGroup { name: name.into(), elements });
        }
    }
    for cable in &table.cables {
        mesh.push(Kind::Row, &cable.nodes);
    }
    mesh.name_nodes();
}

impl Making<'_> {
    fn table(&self) -> &StructureConfig {
        &self.config.structure
    }

    /// The elements of the mesh, then those that the scene lists; and their sets.
    fn elements(&mut self) {
        let (mesh, parts) = (self.mesh, &self.config.structure.parts);
        let group = |name: &str| mesh.element_groups.iter().find(|group| group.name == name);
        let mut owners = vec![None; mesh.elements.len()];
        for (i, part) in parts.iter().enumerate() {
            let own = group(part.head().name).into_iter().flat_map(|group| &group.elements);
            own.for_each(|element| owners[*element as usize] = Some(i));
        }
        // A row becomes a line for each two of its nodes, and an element keeps its number where no row is: in a file.
        let rows = mesh.elements.iter().any(|element| element.kind == Kind::Row);
        let keeps = !rows && mesh.elements.first().is_some_and(|element| element.number > 0);
        let mut made: Vec<Vec<u64>> = Vec::new();
        for (element, owner) in mesh.elements.iter().zip(&owners) {
            let nothing = owner.is_some_and(|part: usize| parts[part].head().kinds.is_empty());
            if nothing || element.kind == Kind::Point {
                made.push(Vec::new());
                continue;
            }
            let nodes: Vec<u64> = mesh.nodes_of(element).iter().map(|n| mesh.numbers[*n as usize]).collect();
            made.push(self.push(*owner, element.kind, &nodes, keeps.then_some(element.number)));
        }
        let sets = mesh.element_groups.iter().map(|group| {
            let own = group.elements.iter().flat_map(|e| made[*e as usize].iter().copied());
            Set { name: group.name.clone(), members: own.collect() }
        });
        self.deck.element_sets = sets.filter(|set| !set.members.is_empty()).collect();
        self.name_sections();
    }

    /// Append an element, of a row a line for each two of its nodes; their numbers.
    fn push(&mut self, part: Option<usize>, kind: Kind, nodes: &[u64], number: Option<u64>) -> Vec<u64> {
        let face = !matches!(kind, Kind::Row | Kind::Line2 | Kind::Line3);
        let section = match self.sections.get(&(part, face)) {
            Some(section) => *section,
            None => {
                let made = match part {
                    Some(part) => Section::of(&self.table().parts[part], self.model, part, face),
                    None => self.model.cables.first().map(|cable| Section::cable(REST.into(), &cable.of)),
                };
                // A structure without any is refused where it is built.
                self.deck.sections.extend(made);
                let section = self.deck.sections.len() - 1;
                self.sections.insert((part, face), section);
                section
            }
        };
        let pieces: Vec<Vec<u64>> = match kind {
            Kind::Row => nodes.windows(2).map(<[u64]>::to_vec).collect(),
            _ => vec![nodes.to_vec()],
        };
        let kind = if kind == Kind::Row { Kind::Line2 } else { kind };
        let mut numbers = Vec::new();
        for nodes in pieces {
            let number = number.unwrap_or(self.deck.elements.len() as u64 + 1);
            self.deck.elements.push(DeckElement { number, kind, nodes, section });
            numbers.push(number);
        }
        numbers
    }

    /// Give each section the name of a set that is its elements, a new one if there is none.
    fn name_sections(&mut self) {
        let Deck { elements, sections, element_sets, left_out, .. } = &mut self.deck;
        for (i, section) in sections.iter_mut().enumerate() {
            let own: Vec<u64> = elements.iter().filter(|e| e.section == i).map(|e| e.number).collect();
            let same = |set: &&Set| set.members == own;
            let named = element_sets.iter().find(|set| set.name == section.name && set.members == own);
            if let Some(set) = named.or_else(|| element_sets.iter().find(same)) {
                section.name = set.name.clone();
            } else {
                while element_sets.iter().any(|set| set.name == section.name) {
                    section.name += "_faces";
                }
                element_sets.push(Set { name: section.name.clone(), members: own });
            }
            left_out.extend(section.lost.iter().map(|what| format!("`{}`: {what}", section.name)));
        }
    }

    /// Sets of nodes: those of the mesh and of the scene, and one for each entry that stands at nodes without a name.
    fn sets(&mut self) -> Result<(), Diagnostic> {
        let table = &self.config.structure;
        let of_mesh = self.mesh.node_groups.iter().map(|group| {
            let nodes = group.nodes.iter().map(|n| self.mesh.numbers[*n as usize]).collect();
            Set { name: group.name.clone(), members: nodes }
        });
        let mut sets: Vec<Set> = of_mesh.collect();
        let listed = |nodes: &[usize]| nodes.iter().map(|n| self.numbers[*n]).collect::<Vec<_>>();
        sets.extend(
            table.groups.iter().map(|group| Set { name: group.name.clone(), members: listed(&group.nodes) }),
        );
        for (name, i, place) in table.places() {
            let named = place.nodes.is_some() || place.at.is_some() && name == "supports";
            let set = format!("{name}_{i}");
            if named && sets.iter().all(|known| known.name != set) {
                sets.push(Set { name: set, members: listed(&self.nodes(name, i, place)?) });
            }
        }
        let nodes_of: HashMap<u64, &[u64]> =
            self.deck.elements.iter().map(|element| (element.number, &element.nodes[..])).collect();
        for Set { name, members } in &self.deck.element_sets {
            if sets.iter().all(|known| known.name != *name) {
                let members = members.iter().flat_map(|e| nodes_of[e]).copied().collect();
                sets.push(Set { name: name.clone(), members });
            }
        }
        sets.iter_mut().for_each(|set| self.in_order(&mut set.members));
        sets.retain(|set| !set.members.is_empty());
        self.deck.node_sets = sets;
        Ok(())
    }

    /// Sort nodes as they stand in the document, each once.
    fn in_order(&self, nodes: &mut Vec<u64>) {
        nodes.sort_unstable_by_key(|number| self.place[number]);
        nodes.dedup();
    }

    fn nodes(&self, name: &str, i: usize, place: Where) -> Result<Vec<usize>, Diagnostic> {
        self.model.place(&Key { scene: self.scene, key: format!("structure.{name}.{i}") }, place)
    }

    /// What supports and a generator hold.
    fn held(&mut self, generated: &[usize]) -> Result<(), Diagnostic> {
        let table = &self.config.structure;
        if !generated.is_empty() {
            let mut nodes: Vec<u64> = generated.iter().map(|n| self.mesh.numbers[*n]).collect();
            self.in_order(&mut nodes);
            let set = self.deck.node_sets.iter().find(|set| set.members == nodes).map(|set| set.name.clone());
            let set = set.unwrap_or_else(|| {
                self.deck.node_sets.push(Set { name: HELD.into(), members: nodes.clone() });
                HELD.into()
            });
            self.deck.supports.push(Support { set, nodes, turning: Vec::new(), held: vec!["x", "y", "z"] });
        }
        for (i, entry) in table.supports.iter().enumerate() {
            let nodes = self.nodes("supports", i, entry.place())?;
            let listed = |nodes: &mut dyn Iterator<Item = &usize>| nodes.map(|n| self.numbers[*n]).collect();
            let turning = listed(&mut nodes.iter().filter(|n| self.model.turning_number[**n].is_some()));
            let nodes = listed(&mut nodes.iter());
            let held = ["x", "y", "z"].into_iter().filter(|axis| entry.directions.contains(axis));
            let turns = ["rx", "ry", "rz"].into_iter().filter(|axis| entry.rotations.contains(&axis[1..]));
            let held = held.chain(turns).collect();
            let set = entry.group.clone().unwrap_or_else(|| format!("supports_{i}"));
            let lost = [
                (!entry.motion.is_empty() || entry.turning.is_some(), "its motion: it is held where it is"),
                (entry.released_at.is_some(), "when it lets go: it holds on"),
                (
                    entry.stiffness.is_some(),
                    "the spring by which it gives way, and its strength: it is rigid",
                ),
            ];
            let lost = lost.into_iter().filter(|(is, _)| *is);
            self.deck.left_out.extend(lost.map(|(_, what)| format!("support `{set}`: {what}")));
            self.deck.supports.push(Support { set, nodes, turning, held });
        }
        Ok(())
    }

    /// Weight; and what else there is and is not written.
    fn rest(&mut self) {
        let table = &self.config.structure;
        self.deck.gravity =
            Some(self.config.gravity).filter(|g| table.dead_load && Vector3::from(*g).norm() > 0.0);
        let first = self.model.cables.first().map(|cable| &cable.of);
        let own = table.cables.iter().zip(&self.model.cables);
        let own = own.filter(|(entry, cable)| entry.length.is_some() || Some(&cable.of) != first);
        let others = [
            ("springs to the ground", table.springs.len()),
            ("dashpots to the ground", table.dampers.len()),
            ("point masses", table.masses.len()),
            ("loads", table.loads.len()),
            ("what cables state themselves, but the first", own.count()),
            ("pressures", table.pressures.len()),
            ("velocities at the start", table.velocities.len()),
            ("contact with the ground", usize::from(table.ground.is_some())),
            ("contact of lines", usize::from(table.contact.is_some())),
            ("damping", usize::from(table.damping > 0.0)),
        ];
        let there = others.into_iter().filter(|(_, count)| *count > 0);
        self.deck.left_out.extend(there.map(|(what, _)| what.to_owned()));
        let nothing = table.parts.iter().filter(|part| matches!(part, PartConfig::NoPart(_)));
        self.deck.left_out.extend(nothing.map(|part| {
            format!("elements of `{}`, of which nothing is made: its nodes are a set", part.head().name)
        }));
        if self.deck.at_rest {
            self.deck.left_out.push("forces at rest: prestress is that of the structure as modelled".into());
        }
    }
}
