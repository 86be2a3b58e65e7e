//! The separate closed surfaces among triangles: which they are, and one of them alone.

use super::integrals::SolidIntegrals;
use super::surface::Surface;
use nalgebra::Vector3;
use schemars::JsonSchema;
use serde::de::{Error, Unexpected, Visitor};
use serde::{Deserialize, Deserializer, Serialize};
use std::fmt;

/// Most pieces that a message names.
const NAMED: usize = 6;

/// A closed surface among several.
#[derive(Debug, Clone, PartialEq)]
pub struct Piece {
    /// What the file calls it.
    pub name: Option<String>,
    /// Its first triangle, from 1, in the file's order, and their number.
    pub first: usize,
    /// Number of its triangles.
    pub triangles: usize,
    /// Volume [m3]; negative where it is inside out, as the mesh of a hollow is.
    pub volume: f64,
    /// Middle of the box around it [m].
    pub middle: Vector3<f64>,
}

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
        struct Either;
        impl Visitor<'_> for Either {
            type Value = PieceChoice;

            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("the number of a piece, from 1, or its name")
            }
            fn visit_str<E>(self, name: &str) -> Result<PieceChoice, E> {
                Ok(PieceChoice::Name(name.into()))
            }
            fn visit_u64<E: Error>(self, number: u64) -> Result<PieceChoice, E> {
                let refuse = |_| E::invalid_value(Unexpected::Unsigned(number), &self);
                number.try_into().map(PieceChoice::Number).map_err(refuse)
            }
            fn visit_i64<E: Error>(self, number: i64) -> Result<PieceChoice, E> {
                let refuse = |_| E::invalid_value(Unexpected::Signed(number), &self);
                number.try_into().map(PieceChoice::Number).map_err(refuse)
            }
        }
        value.deserialize_any(Either)
    }
}

impl From<&str> for PieceChoice {
    fn from(text: &str) -> Self {
        text.parse().map_or_else(|_| Self::Name(text.to_owned()), Self::Number)
    }
}

/// The last name that a file has given before a triangle (number from 1).
pub fn name_at(names: &[(usize, String)], triangle: usize) -> Option<&String> {
    names.iter().rev().find(|(before, _)| *before < triangle).map(|(_, name)| name)
}

/// All pieces, for a message.
#[derive(Debug, Clone, PartialEq)]
pub struct Pieces(pub Vec<Piece>);

impl Pieces {
    /// Give each the last name that the file has given before its first triangle. `names` are in the file's order,
    /// with the number of triangles before each.
    pub fn name(&mut self, names: &[(usize, String)]) {
        for piece in &mut self.0 {
            piece.name = name_at(names, piece.first).cloned();
        }
    }
}

impl fmt::Display for Pieces {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "the surface is {} separate pieces: a rock is one.", self.0.len())?;
        for (k, piece) in self.0.iter().take(NAMED).enumerate() {
            let name = piece.name.as_ref().map_or(String::new(), |name| format!(" `{name}`"));
            let p = piece.middle;
            write!(
                f,
                " Piece {}{name}: {} triangles from number {}, {:.3e} m3{} around ({:.3}, {:.3}, {:.3});",
                k + 1,
                piece.triangles,
                piece.first,
                piece.volume,
                if piece.volume < 0.0 { " (a hollow: it faces inwards)" } else { "" },
                p.x,
                p.y,
                p.z
            )?;
        }
        if self.0.len() > NAMED {
            write!(f, " and {} more;", self.0.len() - NAMED)?;
        }
        write!(
            f,
            " take one by its number or name (`--piece 1`, in a scene `shape.piece = 1`), or join them where the file comes from"
        )
    }
}

/// The piece of each triangle, from 0 in the order of their first triangles, and how many there are.
pub fn of_triangles(surface: &Surface) -> (Vec<usize>, usize) {
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

/// What the pieces are; `numbers` are those of the triangles in the file.
pub fn describe(surface: &Surface, numbers: &[usize]) -> Pieces {
    let (of, count) = of_triangles(surface);
    let mut pieces = Vec::with_capacity(count);
    for piece in 0..count {
        let own: Vec<usize> = (0..of.len()).filter(|t| of[*t] == piece).collect();
        let alone = Surface {
            points: surface.points.clone(),
            triangles: own.iter().map(|t| surface.triangles[*t]).collect(),
        };
        let nowhere = (Vector3::repeat(f64::INFINITY), Vector3::repeat(f64::NEG_INFINITY));
        let corners = (0..own.len()).flat_map(|t| alone.corners(t));
        let (low, high) = corners.fold(nowhere, |(l, h), p| (l.inf(&p), h.sup(&p)));
        pieces.push(Piece {
            name: None,
            first: numbers[own[0]],
            triangles: own.len(),
            volume: SolidIntegrals::of(&alone).volume,
            middle: (low + high) / 2.0,
        });
    }
    Pieces(pieces)
}
