//! Surface files: their formats, of which each registers itself here, and the surface in a file.

mod format;
pub mod obj;
pub mod stl;

use crate::input::{LARGEST, ReadError, read_bytes};
use crate::shape::closed::{MOST_TRIANGLES, Mend};
use crate::shape::surface::Surface;
pub use format::{Facets, SurfaceFormat};
use interface_defs::diagnostic::Diagnostic;
use std::path::Path;

/// All formats. A new one is a file in this folder and two lines here.
pub const FORMATS: &[&SurfaceFormat] = &[&stl::FORMAT, &obj::FORMAT];

/// The closed surface in a file, lengths times `scale`, mended as asked for; the second part says what was mended.
pub fn read_surface(path: &Path, scale: f64, mend: &Mend) -> Result<(Surface, Vec<String>), Diagnostic> {
    let bytes = read_bytes(path, LARGEST)?;
    let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase());
    let format = FORMATS.iter().find(|format| extension.as_deref() == Some(format.extension));
    let read = || -> Result<(Surface, Vec<String>), ReadError> {
        let format = format.ok_or_else(|| format!("a surface is read from {}", known(" or ")))?;
        let mut facets = (format.read)(&bytes, MOST_TRIANGLES)?;
        facets.points.iter_mut().for_each(|p| *p *= scale);
        let mend = Mend { names: std::mem::take(&mut facets.names), ..mend.clone() };
        let (points, triangles) = facets.indexed();
        Ok(Surface::mended(points, triangles, &mend)?)
    };
    read().map_err(|e| e.in_file(path))
}

/// Their extensions, for a message.
pub fn known(between: &str) -> String {
    let all: Vec<String> = FORMATS.iter().map(|format| format!(".{}", format.extension)).collect();
    all.join(between)
}
