//! What is uncertain of a kit, varied one at a time.

use super::Arguments;
use super::layout::number as float;
use crate::stop::Stop;
use interface_defs::diagnostic::{Diagnostic, Place, code};
use toml::{Table, Value};
use toolkit::scene::at;

/// Where the block hits.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Hit {
    /// The middle of the middle field, as the test is defined.
    #[default]
    Middle,
    /// A post beside it, at half its height.
    Post,
    /// The middle of an outer field.
    EdgeField,
    /// The middle field, three quarters of the block's edge below the top rope.
    TopRope,
}

/// One thing changed.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Variation {
    /// As it was asked for: `brake_force=0.8`; [`NOTHING`]: nothing is changed.
    pub name: String,
    /// Where the block hits.
    pub hit: Hit,
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
/// Places of impact by their names.
const PLACES: [(&str, Hit); 3] =
    [("post", Hit::Post), ("edge_field", Hit::EdgeField), ("top_rope", Hit::TopRope)];
/// Values of keys that a scene leaves out: ropes slide without friction, and so do the wires of a ring.
const ABSENT: [(&str, &str); 2] = [(".friction", "0.0"), (".bundle_factor", "1.0")];

/// The test as it is defined, then every variation.
pub fn all(arguments: &Arguments, document: &Table) -> Result<Vec<Variation>, Stop> {
    let mut found = vec![Variation { name: NOTHING.into(), ..Variation::default() }];
    let asked: Vec<&str> = match (arguments.no_variations, &arguments.vary[..]) {
        (true, _) => Vec::new(),
        (false, []) => DEFAULT.to_vec(),
        (false, asked) => asked.iter().map(String::as_str).collect(),
    };
    for word in asked {
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
                let names = PLACES.map(|(name, _)| name).join(", ");
                let place = PLACES.iter().find(|(name, _)| *name == value);
                let (_, hit) = place.ok_or_else(|| refuse(format!("`{value}` is no place: {names}")))?;
                found.push(Variation { name, hit: *hit, sets: Vec::new() });
                continue;
            }
            let number: f64 = value.parse().ok().filter(|n: &f64| n.is_finite()).ok_or_else(|| {
                refuse(format!("`{value}` is no number")).try_instead("write KEY=A,B with numbers")
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
    let times = |value: &Value| Some(Value::Float(number * float(Some(value))?));
    let changed = |item: &Value, field: &str| match field {
        "stiffness" => times(item.get(field)?),
        "curve" => {
            let mut curve = item.get(field)?.clone();
            for force in curve.as_array_mut()?.iter_mut().filter_map(|row| row.get_mut(1)) {
                *force = times(force)?;
            }
            Some(curve)
        }
        _ => Some(Value::Float(number)),
    };
    let items = at(document, list).and_then(Value::as_array).into_iter().flatten().enumerate();
    let of = |item: &Value| element.is_none_or(|of| item.get("element").and_then(Value::as_str) == Some(of));
    let sets = items.filter(|(_, item)| of(item)).flat_map(|(i, item)| {
        fields.iter().filter_map(move |field| Some(format!("{list}.{i}.{field}={}", changed(item, field)?)))
    });
    sets.collect()
}
