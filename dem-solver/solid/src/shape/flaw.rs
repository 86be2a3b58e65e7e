//! What is wrong with triangles that are no closed surface, with its place.

use super::pieces::Pieces;
use nalgebra::Vector3;
use std::fmt;

/// Most triangles of a rock's surface.
pub const MOST_TRIANGLES: usize = 5_000_000;

/// Widest hole that is closed, as a share of the surface's size: what a larger one hides is not known.
pub const WIDEST_HOLE: f64 = 0.1;

/// Why triangles are not the surface of a solid. Triangles are counted from 1, in the file's order.
#[derive(Debug, Clone, PartialEq)]
pub enum Flaw {
    /// There is none, or fewer than 4 are left after corners were joined.
    TooFew(usize),
    /// More than [`MOST_TRIANGLES`].
    TooMany(usize),
    /// A coordinate that is no number.
    NotFinite(usize),
    /// A triangle whose corners lie on a line.
    Flat(usize, Vector3<f64>),
    /// An edge with a triangle on one side only.
    Open(usize, [Vector3<f64>; 2], usize),
    /// An edge of this many triangles.
    Branched(usize, [Vector3<f64>; 2], usize),
    /// Triangles that cannot be turned the same way.
    OneSided(usize),
    /// Several closed surfaces.
    Pieces(Pieces),
    /// A piece that was asked for, of so many.
    NoPiece(u32, usize),
    /// A name that was asked for, the numbers of the pieces with this name, and the names of all.
    NoName(String, Vec<usize>, Vec<String>),
    /// A hole that is not small.
    Hole {
        /// Edges around it.
        edges: usize,
        /// One of its corners [m].
        at: Vector3<f64>,
        /// How wide it is [m].
        widest: f64,
        /// How wide a hole may be [m].
        most: f64,
    },
    /// All triangles face inwards: the volume [m3] is negative.
    Inverted(f64),
    /// Two triangles that run through each other, near a point.
    Crossing(usize, usize, Vector3<f64>),
}

/// Open edges that are more than those of small holes.
const MANY: usize = 50;

impl fmt::Display for Flaw {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let at = |p: &Vector3<f64>| format!("({:.6}, {:.6}, {:.6})", p.x, p.y, p.z);
        match self {
            Self::TooFew(n) => write!(f, "{n} triangles enclose nothing: 4 are the fewest"),
            Self::TooMany(n) => {
                write!(f, "{n} triangles: up to {MOST_TRIANGLES} are possible; thin the surface out")
            }
            Self::NotFinite(t) => write!(f, "triangle {t} has a coordinate that is not a finite number"),
            Self::Flat(t, p) => {
                write!(f, "triangle {t} near {} is degenerate: its corners lie on a line", at(p))
            }
            Self::Open(t, [a, b], n) => write!(
                f,
                "the surface is open: {n} edges have a triangle on one side only, the first from {} to {}, of triangle {t}; \
                 small holes are closed with `--close-holes`, in a scene with `shape.close_holes = true`{}",
                at(a),
                at(b),
                if *n > MANY {
                    "; so many are those of a sheet, as a terrain is: [terrain] file = \"...\""
                } else {
                    ""
                }
            ),
            Self::Branched(t, [a, b], n) => write!(
                f,
                "{n} triangles share the edge from {} to {}, one of them triangle {t}: there must be two",
                at(a),
                at(b)
            ),
            Self::OneSided(t) => write!(
                f,
                "the triangles cannot be turned the same way (a surface with one side): the contradiction is at triangle {t}"
            ),
            Self::Pieces(pieces) => pieces.fmt(f),
            Self::NoPiece(asked, count) => {
                write!(f, "there is no piece {asked}: the surface has {count}, counted from 1")
            }
            Self::NoName(asked, same, _) if !same.is_empty() => write!(
                f,
                "{} pieces are called `{asked}`, numbers {same:?}: take one by its number",
                same.len()
            ),
            Self::NoName(asked, _, names) if names.is_empty() => {
                write!(
                    f,
                    "no piece is called `{asked}`: the file has no names; take one by its number, from 1"
                )
            }
            Self::NoName(asked, _, names) => {
                write!(f, "no piece is called `{asked}`: the file has `{}`", names.join("`, `"))
            }
            Self::Hole { edges, at: place, widest, most } => write!(
                f,
                "the hole with {edges} edges near {} is {widest:.3e} m wide: holes of up to {most:.3e} m, {:.0} % of the \
                 size, are closed; close it where the file comes from",
                at(place),
                100.0 * WIDEST_HOLE
            ),
            Self::Inverted(v) => write!(
                f,
                "the surface is inside out: its triangles face inwards (volume {v:.6e} m3); reverse the order of their corners"
            ),
            Self::Crossing(a, b, p) => {
                write!(f, "the surface runs through itself: triangles {a} and {b} cross near {}", at(p))
            }
        }
    }
}
