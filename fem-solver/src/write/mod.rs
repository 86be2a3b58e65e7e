//! The structure of a scene as a file of another program: what [`crate::read`] reads, written.
//!
//! - [`deck`]: what is written, whatever the format: nodes, elements, sets, sections, supports
//! - [`section`]: what other programs can hold of a part, and what not
//! - [`inp`]: Abaqus and CalculiX
//! - [`mdpa`]: meshes of Kratos
//! - [`msh`]: meshes of Gmsh
//! - [`writer`]: what a format is, and lines of its text
//!
//! A format is one file here, and its line in `FORMATS`. What it cannot hold stands at the head of the file.

pub mod deck;
pub mod inp;
pub mod mdpa;
pub mod msh;
pub mod section;
pub mod writer;

use crate::read::{Format, known};
use deck::Deck;
use interface_defs::diagnostic::{Diagnostic, code};
use std::collections::HashMap;
use std::path::Path;
use writer::Writer;

/// Each format.
const FORMATS: [Writer; 3] = [inp::WRITER, mdpa::WRITER, msh::WRITER];

/// The text of `deck` in the format that the extension of `path` says, and what it cannot hold.
pub fn write(deck: &Deck, path: &Path) -> Result<(String, Vec<String>), Diagnostic> {
    let file = path.display().to_string();
    let writer = Format::of(path).and_then(|format| FORMATS.iter().find(|writer| writer.format == format));
    let Some(writer) = writer else {
        let what = "its name does not say what kind of file to write";
        return Err(Diagnostic::in_file(file, what).try_instead(format!("known are {}", known())));
    };
    for sets in [&deck.node_sets, &deck.element_sets] {
        let mut names: HashMap<String, &str> = HashMap::new();
        for (name, _) in sets {
            let known = (writer.name)(name);
            let taken = known.clone().and_then(|known| names.insert(known, name));
            if known.is_some() && taken.is_none() {
                continue;
            }
            let what = match taken {
                Some(other) => format!("the sets `{other}` and `{name}` have one name in this format"),
                None => format!("the set `{name}` can have no such name in this format"),
            };
            let hint = "rename it in the scene or its mesh, or write another format";
            return Err(Diagnostic::in_file(file, what).coded(code::UNKNOWN_NAME).try_instead(hint));
        }
    }
    let mut lost = deck.lost.clone();
    lost.extend((writer.lost)(deck));
    let state = if deck.at_rest { "at rest at t = 0" } else { "as modelled" };
    let mut head = vec![
        format!("structure of a rockfall scene, {state}; m, kg, s, N"),
        format!(
            "rockfall reads it with mesh = \"FILE\" in [structure], in place of generator, place, nodes and cells, and renumber = false for the same numbers to the last bit; {}",
            supported(deck)
        ),
    ];
    head.extend(lost.iter().map(|what| format!("not in this file: {what}")));
    Ok(((writer.write)(deck, &head), lost))
}

/// What the scene has to say of the supports.
fn supported(deck: &Deck) -> String {
    let sets: Vec<String> = deck.supports.iter().map(|support| format!("`{}`", support.set)).collect();
    if sets.is_empty() { "nothing is held".into() } else { format!("held are {}", sets.join(", ")) }
}
