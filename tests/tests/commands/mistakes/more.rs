//! The table of mistakes beside this file: a line each, its columns apart by tabs.
//!
//! Columns: E (refused) or W (warned of), scene, what the mistake is, what is replaced in the scene (`+`: added at its end),
//! by what, place, cause, cure; then further replacements, in pairs. `\n` is a new line, `\\` a backslash.

use super::scenes::ALL;
use super::{Mistake, beside};

/// The mistakes of the table.
pub fn of_table() -> impl Iterator<Item = Mistake> {
    include_str!("more.tsv").lines().map(mistake)
}

fn mistake(line: &'static str) -> Mistake {
    let columns: Vec<&'static str> = line.split('\t').collect();
    let [class, scene, what, from, to, place, cause, cure, others @ ..] = &columns[..] else {
        panic!("eight columns: {line}")
    };
    let base = scene_of(scene);
    let mut text = match plain(from).as_str() {
        "+" => base.to_owned() + &plain(to),
        from => replaced(base, from, &plain(to)),
    };
    for pair in others.chunks_exact(2) {
        text = replaced(&text, &plain(pair[0]), &plain(pair[1]));
    }
    let refused = *class == "E";
    Mistake { what, scene: text, files: beside(base), set: None, refused, place, cause, cure }
}

fn replaced(text: &str, from: &str, to: &str) -> String {
    assert!(text.contains(from), "{from}");
    text.replacen(from, to, 1)
}

fn scene_of(name: &str) -> &'static str {
    ALL.iter().find(|(known, _)| *known == name).expect("a scene").1
}

/// Without escapes.
fn plain(text: &str) -> String {
    text.replace("\\\\", "\0").replace("\\n", "\n").replace('\0', "\\")
}
