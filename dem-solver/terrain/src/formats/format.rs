//! What a format of terrain is.

use crate::raster::Raster;
use dem_solid::input::Head;
use interface_defs::diagnostic::Diagnostic;
use nalgebra::Vector3;

/// Most cells of a raster: each takes some 90 bytes, with its two triangles and their tree.
pub const MOST_CELLS: usize = 250_000_000;

/// A way in which a file holds a terrain. One file each in this folder, and two lines in `mod.rs`.
pub struct Format {
    /// What it is called in messages.
    pub name: &'static str,
    /// Extensions of such files that messages list, in lower case, the usual one first.
    pub extensions: &'static [&'static str],
    /// Others under which it is read.
    pub also: &'static [&'static str],
    /// What such a file holds: some keys of `[terrain]` are for one kind alone.
    pub holds: Holds,
    /// Whether a file that begins so is one.
    pub begins: fn(&Head) -> bool,
    /// Read a file.
    pub read: fn(Source) -> Result<Content, Diagnostic>,
}

impl Format {
    /// Whether files of this extension are read so.
    pub fn has(&self, extension: &str) -> bool {
        self.extensions.contains(&extension) || self.also.contains(&extension)
    }
}

/// The kinds of content.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Holds {
    /// A raster of heights, perhaps with cells without height.
    Raster,
    /// Points.
    Points,
    /// Points, each of a class.
    ClassifiedPoints,
    /// Triangles.
    Triangles,
}

/// What a reader is given.
pub struct Source<'a> {
    /// The whole file.
    pub bytes: Vec<u8>,
    /// Its name, for messages.
    pub file: &'a str,
    /// Classes of points that are taken; none: all.
    pub classes: &'a [u8],
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
