//! What a format of surfaces is.

use crate::input::{Head, ReadError};
use crate::shape::flaw::Flaw;
use crate::shape::surface::joined;
use nalgebra::Vector3;

/// A way in which a file holds a surface. One file each in this folder, and two lines in `mod.rs`.
pub struct SurfaceFormat {
    /// What it is called in messages.
    pub name: &'static str,
    /// Extension of such files, in lower case.
    pub extension: &'static str,
    /// Whether a file that begins so is one.
    pub begins: fn(&Head) -> bool,
    /// Read the bytes of a file with at most so many triangles.
    pub read: fn(&[u8], usize) -> Result<Facets, ReadError>,
    /// What a file that has been read calls its parts, in its order, with the number of triangles before each.
    pub names: fn(&[u8]) -> Vec<(usize, String)>,
}

/// Corners, and the numbers of those of each triangle.
pub type Indexed = (Vec<Vector3<f64>>, Vec<[u32; 3]>);

/// The triangles of a file [file's unit].
#[derive(Debug, Clone, PartialEq)]
pub enum Facets {
    /// Three corners of each; corners that triangles share are repeated.
    Loose(Vec<[Vector3<f64>; 3]>),
    /// The same in single precision.
    LooseSingle(Vec<[Vector3<f64>; 3]>),
    /// Corners, and triangles by their numbers.
    Indexed(Indexed),
}

impl Facets {
    /// With all lengths times `scale`.
    #[must_use]
    pub fn scaled(mut self, scale: f64) -> Self {
        let points = match &mut self {
            Self::Loose(corners) | Self::LooseSingle(corners) => corners.as_flattened_mut(),
            Self::Indexed((points, _)) => points.as_mut_slice(),
        };
        points.iter_mut().for_each(|p| *p *= scale);
        self
    }

    /// Corners of equal coordinates made one.
    pub fn indexed(self) -> Indexed {
        match self {
            Self::Loose(corners) | Self::LooseSingle(corners) => joined(&corners),
            Self::Indexed(indexed) => indexed,
        }
    }
}

/// An error if there are more triangles than `most`.
pub fn too_many(count: usize, most: usize) -> Result<(), ReadError> {
    if count > most {
        return Err(ReadError::new(format!(
            "{count} triangles: up to {most} are read; thin the surface out"
        )));
    }
    Ok(())
}

impl From<Flaw> for ReadError {
    fn from(flaw: Flaw) -> Self {
        Self::new(flaw.to_string())
    }
}
