//! The separate closed surfaces among triangles: which they are, and one of them alone.

use super::integrals::SolidIntegrals;
use super::surface::Surface;
use crate::geometry::bounds;
use schemars::JsonSchema;
use serde::de::{Error, Unexpected};
use serde::{Deserialize, Deserializer, Serialize};

/// Most pieces that a message names.
const NAMED: usize = 6;

/// A piece that is asked for.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(untagged)]
pub enum PieceChoice {
    /// Its number, from 1 in the order of the first triangles.
    Number(u32),
    /// What the file calls it.
    Name(String),
}

impl<'de> Deserialize<'de> for PieceChoice {
    fn deserialize<D: Deserializer<'de>>(value: D) -> Result<Self, D::Error> {
        let due = &"the number of a piece, from 1, or its name";
        match toml::Value::deserialize(value)? {
            toml::Value::String(name) => Ok(Self::Name(name)),
            toml::Value::Integer(n) => {
                let refuse = |_| D::Error::invalid_value(Unexpected::Signed(n), due);
                n.try_into().map(Self::Number).map_err(refuse)
            }
            other => Err(D::Error::invalid_type(Unexpected::Other(&other.to_string()), due)),
        }
    }
}

impl From<&str> for PieceChoice {
    fn from(text: &str) -> Self {
        text.parse().map_or_else(|_| Self::Name(text.to_owned()), Self::Number)
    }
}

/// The last name that a file has given before a triangle (number from 1).
fn name_at(names: &[(usize, String)], triangle: usize) -> Option<&String> {
    names.iter().rev().find(|(before, _)| *before < triangle).map(|(_, name)| name)
}

/// The piece of each triangle, from 0 in the order of their first triangles, and how many there are.
fn of_triangles(surface: &Surface) -> (Vec<usize>, usize) {
    // Corners that share a triangle belong together: a forest of corners, the root the least of each tree.
    let mut parent: Vec<u32> = (0..surface.points.len() as u32).collect();
    fn root(parent: &mut [u32], mut at: u32) -> u32 {
        while parent[at as usize] != at {
            parent[at as usize] = parent[parent[at as usize] as usize];
            at = parent[at as usize];
        }
        at
    }
    for [a, b, c] in &surface.triangles {
        for other in [b, c] {
            let (x, y) = (root(&mut parent, *a), root(&mut parent, *other));
            parent[x.max(y) as usize] = x.min(y);
        }
    }
    let mut number = std::collections::HashMap::new();
    let mut of = Vec::with_capacity(surface.triangles.len());
    for [a, _, _] in &surface.triangles {
        let next = number.len();
        of.push(*number.entry(root(&mut parent, *a)).or_insert(next));
    }
    (of, number.len())
}

/// The triangles of the piece that is asked for. `numbers` are those of the triangles in the file, `names` what it calls its
/// parts, in its order, with the number of triangles before each.
pub fn chosen(
    choice: &PieceChoice,
    surface: &Surface,
    numbers: &[usize],
    names: &[(usize, String)],
) -> Result<Vec<usize>, String> {
    let (of, count) = of_triangles(surface);
    let number = match choice {
        PieceChoice::Number(number) => *number as usize,
        PieceChoice::Name(asked) => {
            let name = |k: usize| of.iter().position(|p| *p == k).and_then(|t| name_at(names, numbers[t]));
            let same: Vec<usize> = (0..count).filter(|k| name(*k) == Some(asked)).map(|k| k + 1).collect();
            let mut all: Vec<&str> = (0..count).filter_map(name).map(String::as_str).collect();
            all.dedup();
            let why = match same.len() {
                1 => return Ok(of_piece(&of, same[0])),
                0 if all.is_empty() => "the file has no names; take one by its number, from 1".into(),
                0 => format!("the file has `{}`", all.join("`, `")),
                n => {
                    return Err(format!(
                        "{n} pieces are called `{asked}`, numbers {same:?}: take one by its number"
                    ));
                }
            };
            return Err(format!("no piece is called `{asked}`: {why}"));
        }
    };
    if !(1..=count).contains(&number) {
        return Err(format!("there is no piece {number}: the surface has {count}, counted from 1"));
    }
    Ok(of_piece(&of, number))
}

/// The triangles of piece `number`, from 1.
fn of_piece(of: &[usize], number: usize) -> Vec<usize> {
    (0..of.len()).filter(|t| of[*t] + 1 == number).collect()
}

/// All pieces, for a message; the same arguments.
pub fn describe(surface: &Surface, numbers: &[usize], names: &[(usize, String)]) -> String {
    let (of, count) = of_triangles(surface);
    let piece = |piece: usize| {
        let own = of_piece(&of, piece + 1);
        let first = numbers[own[0]];
        let triangles = own.iter().map(|t| surface.triangles[*t]).collect();
        let alone = Surface { points: surface.points.clone(), triangles };
        let [low, high] = bounds((0..own.len()).flat_map(|t| alone.corners(t)));
        let p = (low + high) / 2.0;
        // Negative where it is inside out, as the mesh of a hollow is.
        let volume = SolidIntegrals::of(&alone).volume;
        let hollow = if volume < 0.0 { " (a hollow: it faces inwards)" } else { "" };
        let name = name_at(names, first).map_or(String::new(), |name| format!(" `{name}`"));
        let (number, count, [x, y, z]): (usize, usize, [f64; 3]) = (piece + 1, own.len(), p.into());
        format!(
            " Piece {number}{name}: {count} triangles from number {first}, {volume:.3e} m3{hollow} around ({x:.3}, {y:.3}, {z:.3});"
        )
    };
    let mut all: String = (0..count.min(NAMED)).map(piece).collect();
    if count > NAMED {
        all += &format!(" and {} more;", count - NAMED);
    }
    format!(
        "the surface is {count} separate pieces: a rock is one.{all} take one by its number or name (`--piece 1`, in a scene \
         `shape.piece = 1`), or join them where the file comes from"
    )
}
