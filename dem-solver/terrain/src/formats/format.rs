//! What a format of terrain is, and what its readers give.

use crate::raster::Raster;
use dem_solid::input::{Head, ReadError};
use dem_solid::shape::formats::Facets;
use interface_defs::diagnostic::Diagnostic;
use nalgebra::Vector3;

/// Most cells of a raster: each takes some 90 bytes, with its two triangles and their tree.
pub const MOST_CELLS: usize = 250_000_000;

/// A way in which a file holds a terrain. One file each in this folder, and two lines in `mod.rs`.
#[derive(Clone, Copy)]
pub struct Format {
    /// What it is called in messages.
    pub name: &'static str,
    /// Extensions of such files that messages list, in lower case, the usual one first.
    pub extensions: &'static [&'static str],
    /// Others under which it is read.
    pub also: &'static [&'static str],
    /// True of the first bytes of a file of this format.
    pub begins: fn(&Head) -> bool,
    /// Read a file.
    pub read: Reader,
}

impl Format {
    /// True of extensions of this format.
    pub fn has(&self, extension: &str) -> bool {
        self.extensions.contains(&extension) || self.also.contains(&extension)
    }
}

/// Points of a file [m], or why it has none.
pub type ReadPoints = Result<Vec<[f64; 3]>, ReadError>;

/// What reads the bytes of a file, by what such a file holds: some keys of `[terrain]` are for one kind alone.
#[derive(Clone, Copy)]
pub enum Reader {
    /// A raster of heights, perhaps with cells without height.
    Raster(fn(&[u8]) -> Result<Raster, ReadError>),
    /// Points.
    Points(fn(&[u8]) -> ReadPoints),
    /// Points of these classes; none: all.
    ClassifiedPoints(fn(Vec<u8>, &[u8]) -> ReadPoints),
    /// At most so many triangles.
    Surface(fn(&[u8], usize) -> Result<Facets, ReadError>),
}

/// What a terrain file holds.
#[derive(Debug, Clone, PartialEq)]
pub enum Content {
    /// A raster of heights.
    Raster(Raster),
    /// Points [m].
    Points(Vec<[f64; 3]>),
    /// Triangles.
    Triangles {
        /// Corners [m].
        nodes: Vec<Vector3<f64>>,
        /// Triangles.
        triangles: Vec<[u32; 3]>,
        /// What the user should know.
        notices: Vec<Diagnostic>,
    },
}
