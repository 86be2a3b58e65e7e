//! What is uncertain of a kit, varied one at a time.

use super::Arguments;
use crate::stop::Stop;
use interface_defs::diagnostic::{Diagnostic, Place, code};
use toml::{Table, Value};
use toolkit::scene::at;

/// Where the block hits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Hit {
    /// The middle of the middle field, as the test is defined.
    Middle,
    /// A post beside it, at half its height.
    Post,
    /// The middle of an outer field.
    EdgeField,
    /// The middle field, three quarters of the block's edge below the top rope.
    TopRope,
}

/// One thing changed.
#[derive(Debug, Clone, PartialEq)]
pub struct Variation {
    /// As it was asked for: `brake_force=0.8`; empty: nothing is changed.
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

/// The test as it is defined, then every variation.
pub fn all(arguments: &Arguments, document: &Table) -> Result<Vec<Variation>, Stop> {
    let mut found = vec![Variation { name: String::new(), hit: Hit::Middle, sets: Vec::new() }];
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
            let none = Variation { name, hit: Hit::Middle, sets: Vec::new() };
            if key == "place" {
                let hit = match value {
                    "post" => Hit::Post,
                    "edge_field" => Hit::EdgeField,
                    "top_rope" => Hit::TopRope,
                    _ => {
                        return Err(
                            refuse(format!("`{value}` is no place: post, edge_field, top_rope")).into()
                        );
                    }
                };
                found.push(Variation { hit, ..none });
                continue;
            }
            let number: f64 = value.parse().ok().filter(|n: &f64| n.is_finite()).ok_or_else(|| {
                refuse(format!("`{value}` is no number")).try_instead("write KEY=A,B with numbers")
            })?;
            let sets = sets_of(document, key, number);
            let changes = |set: &String| {
                let (key, text) = set.split_once('=').unwrap_or_default();
                // A rope that says nothing of friction has none.
                let absent = || key.ends_with(".friction").then(|| "0.0".to_owned());
                at(document, key).map(Value::to_string).or_else(absent).as_deref() != Some(text)
            };
            if sets.iter().any(changes) {
                found.push(Variation { sets, ..none });
            } else if sets.is_empty() && !arguments.vary.is_empty() {
                return Err(refuse(format!("there is nothing in the kit that `{key}` changes")).into());
            }
        }
    }
    Ok(found)
}

/// What takes the place of what, in all parts that it concerns.
fn sets_of(document: &Table, key: &str, number: f64) -> Vec<String> {
    let value = |number: f64| Value::Float(number).to_string();
    let items = |key: &str| at(document, key).and_then(Value::as_array).cloned().unwrap_or_default();
    let parts = items("structure.parts");
    let numbered = parts.iter().enumerate();
    let of = |element: &'static str| {
        numbered.clone().filter(move |(_, part)| part.get("element").and_then(Value::as_str) == Some(element))
    };
    match key {
        "brake_force" => of("brake")
            .filter_map(|(i, part)| {
                let mut curve = part.get("curve")?.clone();
                for row in curve.as_array_mut()? {
                    let force = row.as_array_mut()?.get_mut(1)?;
                    *force =
                        (number * force.as_float().or_else(|| force.as_integer().map(|n| n as f64))?).into();
                }
                Some(format!("structure.parts.{i}.curve={curve}"))
            })
            .collect(),
        "rope_friction" => of("sliding_cable")
            .map(|(i, _)| format!("structure.parts.{i}.friction={}", value(number)))
            .collect(),
        "contact_friction" => {
            (0..items("contact").len()).map(|i| format!("contact.{i}.friction={}", value(number))).collect()
        }
        "bundle_factor" => of("ring")
            .filter(|(_, part)| part.get("turns").is_some())
            .map(|(i, _)| format!("structure.parts.{i}.bundle_factor={}", value(number)))
            .collect(),
        _ => vec![format!("{key}={}", value(number))],
    }
}
