//! `of` in `[[structure.parts]]`: a part of the library, `library.toml`, which says where each of its numbers comes from.

use super::explain::suggestion;
use std::ops::Range;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// The key of a part.
pub const KEY: &str = "of";

const TEXT: &str = include_str!("library.toml");

fn library() -> DeTable<'static> {
    DeTable::parse(TEXT).expect("the library is TOML").into_inner()
}

fn names(library: &DeTable) -> Vec<String> {
    library.keys().map(|name| name.get_ref().clone().into_owned()).collect()
}

/// What it means, for the reference.
pub const MEANING: &str = "A part of the library, interface-defs/toolkit/src/library.toml, where the source of each number stands: what this part \
    does not state itself is that one's. `R12/3/300`, `rope 22/1770`, `post HE 160 B S235`, `brake 130 kN`, and more.";

/// Fill every part of a document that is `of` one of the library.
///
/// # Errors
/// What is wrong with a name that is none of it, where it stands, and what to try.
pub(crate) fn fill(document: &mut DeTable) -> Result<(), (Range<usize>, String, String)> {
    let structure = document.get_mut("structure").map(Spanned::get_mut);
    let Some(DeValue::Table(structure)) = structure else { return Ok(()) };
    let Some(DeValue::Array(parts)) = structure.get_mut("parts").map(Spanned::get_mut) else {
        return Ok(());
    };
    for part in parts.iter_mut() {
        let DeValue::Table(part) = part.get_mut() else { continue };
        let Some(of) = part.remove(KEY) else { continue };
        let (span, mut library) = (of.span(), library());
        let name = of.get_ref().as_str().unwrap_or_default();
        let Some(DeValue::Table(entry)) = library.remove(name).map(Spanned::into_inner) else {
            let names = names(&library);
            let cure = suggestion(name, &names).unwrap_or_else(|| format!("it has {}", names.join(", ")));
            return Err((span, format!("the library has no part `{name}`"), cure));
        };
        for (key, mut value) in entry {
            if !part.contains_key(key.get_ref().as_ref()) {
                put_at(&mut value, &span);
                part.insert(Spanned::new(span.clone(), key.into_inner()), value);
            }
        }
    }
    Ok(())
}

/// What is wrong with a value of the library is said where its name stands.
fn put_at(value: &mut Spanned<DeValue>, span: &Range<usize>) {
    let own = std::mem::replace(value.get_mut(), DeValue::Boolean(false));
    *value = Spanned::new(span.clone(), own);
    match value.get_mut() {
        DeValue::Array(items) => items.iter_mut().for_each(|item| put_at(item, span)),
        DeValue::Table(table) => table.iter_mut().for_each(|(_, item)| put_at(item, span)),
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use crate::scene::Scene;

    fn part(text: &str) -> Result<toml::Value, String> {
        let scene = Scene::from_text("s.toml", &format!("[[structure.parts]]\nname = \"p\"\n{text}\n"));
        let document = scene.and_then(|scene| scene.document()).map_err(|e| e.to_string())?;
        Ok(document["structure"]["parts"][0].clone())
    }

    #[test]
    fn a_part_has_what_the_library_says_and_it_does_not() {
        let rope =
            part("element = \"sliding_cable\"\nof = \"rope 22/1770\"\nprestress = 5e7").expect("known");
        let due = "name = \"p\"\nelement = \"sliding_cable\"\nprestress = 5e7\nrope = { diameter = 0.022, grade = 1.77e9 }";
        assert_eq!(rope, toml::Value::Table(due.parse().expect("TOML")));
        let ring = part("of = \"R12/3/300\"\ndiameter = 0.35").expect("known");
        assert_eq!((ring["turns"].as_integer(), ring["diameter"].as_float()), (Some(12), Some(0.35)));
    }

    #[test]
    fn a_name_that_is_not_in_it_is_refused_where_it_stands() {
        let typo = part("of = \"R12/3/30\"").expect_err("unknown");
        assert!(typo.starts_with("s.toml:3:6: the library has no part `R12/3/30`"), "{typo}");
        assert!(typo.contains("R12/3/300"), "{typo}");
        assert!(part("of = 12").expect_err("a number").contains("R3/2.2/300"));
    }
}
