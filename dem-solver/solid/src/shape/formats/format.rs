//! What a format of surfaces is.

use crate::input::{Head, ReadError};
use crate::shape::surface::joined;
use nalgebra::Vector3;

/// A way in which a file holds a surface. One file each in this folder, and two lines in `mod.rs`.
pub struct SurfaceFormat {
    /// What it is called in messages.
    pub name: &'static str,
    /// Extension of such files, in lower case.
    pub extension: &'static str,
    /// True of the first bytes of a file of this format.
    pub begins: fn(&Head) -> bool,
    /// Read the bytes of a file with at most so many triangles.
    pub read: fn(&[u8], usize) -> Result<Facets, ReadError>,
}

/// The triangles of a file [file's unit].
#[derive(Debug, Clone, PartialEq)]
pub struct Facets {
    /// Corners [m].
    pub points: Vec<Vector3<f64>>,
    /// Triangles by the numbers of their corners; none: three corners each, those that triangles share repeated.
    pub triangles: Option<Vec<[u32; 3]>>,
    /// What the file calls its parts, in its order, with the number of triangles before each.
    pub names: Vec<(usize, String)>,
    /// True if the coordinates are of single precision.
    pub single: bool,
}

impl Facets {
    /// Corners and triangles; corners of equal coordinates made one where they are repeated.
    pub fn indexed(self) -> (Vec<Vector3<f64>>, Vec<[u32; 3]>) {
        match self.triangles {
            Some(triangles) => (self.points, triangles),
            None => joined(self.points.as_chunks().0),
        }
    }
}

/// An error if there are more triangles than `most`.
pub fn too_many(count: usize, most: usize) -> Result<(), ReadError> {
    if count > most {
        return Err(format!("{count} triangles: up to {most} are read; thin the surface out").into());
    }
    Ok(())
}
