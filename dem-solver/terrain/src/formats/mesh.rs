//! Terrain that comes as triangles, by the readers of surfaces. Text is read in double precision; binary
//! STL holds single precision, to which survey coordinates of 2.6e6 m are steps of 0.25 m.

use super::super::notice;
use super::format::Content;
use dem_solid::input::ReadError;
use dem_solid::shape::formats::{Facets, SurfaceFormat};

/// Most triangles: tree, nodes and file of as many fill 24 GiB.
const MOST: usize = 100_000_000;

/// Coordinates from which on single precision is coarser than a tenth of a millimetre [m].
const COARSE: f64 = 1024.0;

/// The bytes of a file of this format.
pub fn read(format: &SurfaceFormat, bytes: &[u8]) -> Result<Content, ReadError> {
    let facets = (format.read)(bytes, MOST)?;
    let single = matches!(facets, Facets::LooseSingle(_));
    let (nodes, triangles) = facets.indexed();
    let largest = nodes.iter().map(|n| n.amax()).fold(0.0, f64::max);
    let mut notices = Vec::new();
    if single && largest > COARSE {
        let step = largest * f64::from(f32::EPSILON);
        let what = format!("a binary STL holds coordinates of {largest:.0} m in steps of {step:.1e} m");
        notices.push(notice(what).try_instead("write it with a local origin, or as text"));
    }
    Ok(Content::Triangles { nodes, triangles, notices })
}
