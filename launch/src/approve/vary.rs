//! What is uncertain of a kit, varied one at a time.

use super::ApproveArguments;
use crate::front::stop::Stop;
use interface_defs::diagnostic::{Diagnostic, Place, code};
use toml::{Table, Value};
use toolkit::scene::at;

/// One thing changed.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Variation {
    /// As it was asked for: `brake_force=0.8`; [`NOTHING`]: nothing is changed.
    pub name: String,
    /// Where the block hits: one of [`PLACES`]; empty: in the middle of the middle field, as the test is defined.
    pub place: &'static str,
    /// `--set`s of the scene.
    pub sets: Vec<String>,
}

/// Chosen within what is known: brakes under impact give 10 to 30 % more than slowly pulled ones; wire ropes slide with 0.1 to 0.3;
/// a bundle of wires bends as 1 to 2.6 times its wires (docs/approval.md).
const DEFAULT: [&str; 5] = [
    "brake_force=0.8,1.2",
    "rope_friction=0,0.1,0.3",
    "contact_friction=0.2,0.4,0.6",
    "bundle_factor=1,2.6",
    "place=post,edge_field,top_rope",
];

/// The name of the test as it is defined.
pub const NOTHING: &str = "as defined";
/// Places of impact: a post beside the middle field at half its height; the middle of an outer field; in the middle field three
/// quarters of the block's edge below the top rope.
pub const PLACES: [&str; 3] = ["post", "edge_field", "top_rope"];
/// Values of keys that a scene leaves out: ropes slide without friction, and so do the wires of a ring.
const ABSENT: [(&str, &str); 2] = [(".friction", "0.0"), (".bundle_factor", "1.0")];

/// The test as it is defined, then every variation.
pub fn all(arguments: &ApproveArguments, document: &Table) -> Result<Vec<Variation>, Stop> {
    let mut found = vec![Variation { name: NOTHING.into(), ..Variation::default() }];
    let asked = if arguments.vary.is_empty() { &DEFAULT.map(str::to_owned)[..] } else { &arguments.vary };
    for word in asked.iter().filter(|_| !arguments.no_variations) {
        let refuse =
            |what: String| Diagnostic::error(code::ARGUMENT, what).at(Place::file(format!("--vary {word}")));
        let (key, values) = word.split_once('=').ok_or_else(|| {
            refuse("there is no `=`".into()).try_instead("write KEY=A,B, as in --vary brake_force=0.8,1.2")
        })?;
        for value in values.split(',').map(str::trim) {
            let name = format!("{key}={value}");
            if found.iter().any(|known| known.name == name) {
                continue;
            }
            if key == "place" {
                let place = PLACES.into_iter().find(|place| *place == value);
                let other = || refuse(format!("`{value}` is not a place: {}", PLACES.join(", ")));
                found.push(Variation { name, place: place.ok_or_else(other)?, sets: Vec::new() });
                continue;
            }
            let number: f64 = value.parse().ok().filter(|n: &f64| n.is_finite()).ok_or_else(|| {
                refuse(format!("`{value}` is not a number")).try_instead("write KEY=A,B with numbers")
            })?;
            let sets = sets_of(document, key, number);
            let changes = |set: &String| {
                let (key, text) = set.split_once('=').unwrap_or_default();
                let absent = || ABSENT.iter().find(|(of, _)| key.ends_with(of)).map(|of| of.1.to_owned());
                at(document, key).map(Value::to_string).or_else(absent).as_deref() != Some(text)
            };
            if sets.iter().any(changes) {
                found.push(Variation { name, sets, ..Variation::default() });
            } else if sets.is_empty() && !arguments.vary.is_empty() {
                return Err(refuse(format!("there is nothing in the kit that `{key}` changes")).into());
            }
        }
    }
    Ok(found)
}

/// What takes the place of what, in all parts that it concerns.
fn sets_of(document: &Table, key: &str, number: f64) -> Vec<String> {
    let (list, element, fields): (_, _, &[&str]) = match key {
        // The elastic beginning, too: its stiffness is a force over an elongation.
        "brake_force" => ("structure.parts", Some("brake"), &["stiffness", "curve"]),
        "rope_friction" => ("structure.parts", Some("sliding_cable"), &["friction"]),
        "contact_friction" => ("contact", None, &["friction"]),
        "bundle_factor" => ("structure.parts", Some("wire_ring"), &["bundle_factor"]),
        _ => return vec![format!("{key}={}", Value::Float(number))],
    };
    let times = |value: &Value| Some(Value::Float(number * toolkit::scene::number(value)?));
    let changed = |item: &Value, field: &str| match item.get(field) {
        Some(Value::Array(rows)) => {
            let scaled = |row: &Value| Some(Value::Array(vec![row.get(0)?.clone(), times(row.get(1)?)?]));
            rows.iter().map(scaled).collect::<Option<Vec<_>>>().map(Value::Array)
        }
        own if element == Some("brake") => times(own?),
        _ => Some(Value::Float(number)),
    };
    let items = at(document, list).and_then(Value::as_array).into_iter().flatten().enumerate();
    let of = |item: &Value| element.is_none_or(|of| item.get("element").and_then(Value::as_str) == Some(of));
    let sets = items.filter(|(_, item)| of(item)).flat_map(|(i, item)| {
        fields.iter().filter_map(move |field| Some(format!("{list}.{i}.{field}={}", changed(item, field)?)))
    });
    sets.collect()
}
