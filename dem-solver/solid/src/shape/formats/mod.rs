//! Surface files: their formats, of which each registers itself here, and the surface in a file.

mod format;
pub mod obj;
pub mod stl;

use crate::input::{LARGEST, ReadError, read_bytes};
use crate::shape::closed::Mend;
use crate::shape::flaw::{Flaw, MOST_TRIANGLES};
use crate::shape::surface::Surface;
pub use format::{Facets, Indexed, SurfaceFormat};
use interface_defs::diagnostic::Diagnostic;
use std::path::Path;

/// All formats. A new one is a file in this folder and two lines here.
pub const FORMATS: &[&SurfaceFormat] = &[&stl::FORMAT, &obj::FORMAT];

/// The closed surface in a file, lengths times `scale`, mended as asked for; the second part says what was mended.
pub fn read_surface(path: &Path, scale: f64, mend: &Mend) -> Result<(Surface, Vec<String>), Diagnostic> {
    let bytes = read_bytes(path, LARGEST)?;
    let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase());
    let format = FORMATS.iter().find(|format| extension.as_deref() == Some(format.extension));
    let read = match format {
        Some(format) => closed(format, &bytes, scale, mend),
        None => Err(ReadError::new(format!("a surface is read from {}", known(" or ")))),
    };
    read.map_err(|e| e.in_file(path))
}

/// Their extensions, for a message.
pub fn known(between: &str) -> String {
    let all: Vec<String> = FORMATS.iter().map(|format| format!(".{}", format.extension)).collect();
    all.join(between)
}

/// The closed surface of a file that gives its parts names.
fn closed(
    format: &SurfaceFormat,
    bytes: &[u8],
    scale: f64,
    mend: &Mend,
) -> Result<(Surface, Vec<String>), ReadError> {
    let (points, triangles) = (format.read)(bytes, MOST_TRIANGLES)?.scaled(scale).indexed();
    let names_asked = if mend.piece.is_some() { (format.names)(bytes) } else { Vec::new() };
    let mend = Mend { names: names_asked, ..mend.clone() };
    let found = Surface::mended(points, triangles, &mend).map_err(|mut flaw| {
        if let Flaw::Pieces(pieces) = &mut flaw {
            pieces.name(&(format.names)(bytes));
        }
        flaw
    });
    Ok(found?)
}
