//! Terrain files: their formats, of which each registers itself here, and what a file holds. Surfaces ([`dem_solid::shape::formats`])
//! are read as triangles.
//!
//! A reader gives what the file holds, in the file's own coordinates, or an error with file and place; none trusts a
//! length that the file states before it has compared it with the file's size.

mod asc;
pub(crate) mod crs;
mod format;
mod grd;
mod heights;
mod las;
mod laz;
mod mesh;
mod sniff;
mod text;
mod tif;
mod xyz;

use super::raster::Raster;
use dem_solid::input::read_bytes;
use dem_solid::shape;
pub use format::{Content, Format, Holds, Source};
use interface_defs::diagnostic::Diagnostic;
use std::path::Path;
use toolkit::input_file;

/// All formats but those of surfaces. A new one is a file in this folder and two lines here.
const FORMATS: &[&Format] = &[&asc::FORMAT, &tif::FORMAT, &grd::FORMAT, &xyz::FORMAT, &las::FORMAT];

/// Largest file that is read [bytes].
const LARGEST: u64 = 16 << 30;

/// Read a terrain file; its extension says what it is. Of classified points those of `classes` are taken (all, if there is none);
/// heights that are `mark` [m] are those of cells without height.
pub fn terrain(path: &Path, classes: &[u8], mark: Option<f64>) -> Result<Content, Diagnostic> {
    let file = path.display().to_string();
    input_file::regular(path)?;
    let extension = extension(path);
    if kind(path).is_some() {
        sniff::check(path, &extension, FORMATS)?;
    }
    let mut content = if let Some(format) = FORMATS.iter().find(|format| format.has(&extension)) {
        let source = Source { bytes: bytes(path)?, file: &file, classes };
        (format.read)(source)?
    } else if let Some(format) = surface(&extension) {
        mesh::read(format, &bytes(path)?).map_err(|e| e.in_file(path))?
    } else {
        return Err(unknown(&file, &extension));
    };
    crs::beside(path)?;
    match &mut content {
        Content::Raster(raster) => {
            without(raster, mark);
            heights::of_raster(raster, &file)?;
        }
        Content::Points(points) => heights::of_points(points, &file)?,
        Content::Triangles { nodes, triangles, notices } => {
            notices.extend(heights::of_triangles(nodes, triangles, &file)?);
        }
    }
    Ok(content)
}

/// Read a raster file, of heights or of zone numbers.
pub fn raster(path: &Path) -> Result<Raster, Diagnostic> {
    let file = path.display().to_string();
    let extension = extension(path);
    let mut rasters = FORMATS.iter().filter(|format| format.holds == Holds::Raster);
    if let Some(format) = rasters.clone().find(|format| format.has(&extension))
        && let Content::Raster(raster) =
            (format.read)(Source { bytes: bytes(path)?, file: &file, classes: &[] })?
    {
        return Ok(raster);
    }
    let known: Vec<String> = rasters.by_ref().map(|format| format!(".{}", format.extensions[0])).collect();
    Err(Diagnostic::in_file(file, format!("`.{extension}` is no raster that can be read"))
        .try_instead(format!("known are {}", known.join(", "))))
}

/// What a file of this name holds, if it can be read.
pub fn kind(path: &Path) -> Option<Holds> {
    let extension = extension(path);
    let format = FORMATS.iter().find(|format| format.has(&extension)).map(|format| format.holds);
    format.or_else(|| surface(&extension).map(|_| Holds::Triangles))
}

/// All formats with their extensions, in words, for the reference.
pub fn described() -> String {
    let own = FORMATS.iter().map(|format| {
        let extensions: Vec<String> = format.extensions.iter().map(|e| format!("`.{e}`")).collect();
        format!("{} {}", format.name, extensions.join(", "))
    });
    let surfaces =
        shape::formats::FORMATS.iter().map(|format| format!("{} `.{}`", format.name, format.extension));
    own.chain(surfaces).collect::<Vec<_>>().join("; ")
}

fn surface(extension: &str) -> Option<&'static shape::formats::SurfaceFormat> {
    shape::formats::FORMATS.iter().find(|format| format.extension == extension).copied()
}

fn unknown(file: &str, extension: &str) -> Diagnostic {
    let mesh = matches!(extension, "msh" | "inp" | "mdpa");
    let more = if mesh { "; a mesh of a net is named with [structure] mesh = \"...\"" } else { "" };
    let what = if extension.is_empty() {
        "its name has no extension that says what kind of terrain it is".into()
    } else {
        format!("`.{extension}` is no terrain that can be read")
    };
    let own = FORMATS.iter().flat_map(|format| format.extensions.iter().map(|e| format!(".{e}")));
    let known: Vec<String> = own.chain([shape::formats::known(", ")]).collect();
    Diagnostic::in_file(file, what).try_instead(format!("known are {}{more}", known.join(", ")))
}

/// Take the heights that are `mark` out of a raster.
fn without(raster: &mut Raster, mark: Option<f64>) {
    let Some(mark) = mark else { return };
    // A height of single precision equals what is written in single precision.
    let is_mark = |z: f64| z == mark || z as f32 == mark as f32;
    raster.heights.iter_mut().filter(|z| is_mark(**z)).for_each(|z| *z = f64::NAN);
}

/// Extension in lower case.
fn extension(path: &Path) -> String {
    path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default()
}

/// The whole file, which must not be empty.
fn bytes(path: &Path) -> Result<Vec<u8>, Diagnostic> {
    let bytes = read_bytes(path, LARGEST)?;
    if bytes.is_empty() {
        return Err(Diagnostic::in_file(path.display().to_string(), "the file is empty"));
    }
    Ok(bytes)
}
