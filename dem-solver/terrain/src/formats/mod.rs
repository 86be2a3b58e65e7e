//! Terrain files: their formats, of which each registers itself here, and what a file holds. Surfaces ([`dem_solid::shape::formats`])
//! are read as triangles.
//!
//! A reader gives what the file holds, in the file's own coordinates, or an error with file and place; none trusts a
//! length that the file states before it has compared it with the file's size.

mod asc;
mod format;
mod grd;
mod heights;
mod las;
mod tif;
mod xyz;

use super::raster::Raster;
use super::{notice, system};
use dem_solid::input::{Head, ReadError, read_bytes};
use dem_solid::shape;
use dem_solid::shape::formats::Facets;
pub use format::{Content, Format, Reader};
use interface_defs::diagnostic::Diagnostic;
use std::io::Read;
use std::path::Path;
use toolkit::{files, input_file};

/// All formats but those of surfaces. A new one is a file in this folder and two lines here.
const FORMATS: &[&Format] = &[&asc::FORMAT, &tif::FORMAT, &grd::FORMAT, &xyz::FORMAT, &las::FORMAT];

/// Largest file that is read [bytes].
const LARGEST: u64 = 16 << 30;

/// Most triangles: tree, nodes and file of as many fill 24 GiB.
const MOST_TRIANGLES: usize = 100_000_000;

/// Coordinates from which on single precision is coarser than a tenth of a millimetre [m].
const COARSE: f64 = 1024.0;

/// All formats, those of surfaces too.
fn all() -> impl Iterator<Item = Format> {
    let surfaces = shape::formats::FORMATS.iter().map(|surface| Format {
        name: surface.name,
        extensions: std::slice::from_ref(&surface.extension),
        also: &[],
        begins: surface.begins,
        read: Reader::Surface(surface.read),
    });
    FORMATS.iter().map(|format| **format).chain(surfaces)
}

/// The format of files of this name, if there is one.
fn of(path: &Path) -> Option<Format> {
    let extension = extension(path);
    all().find(|format| format.has(&extension))
}

/// Read a terrain file; its extension says what it is. Of classified points those of `classes` are taken (all, if there is none);
/// heights that are `mark` [m] are those of cells without height.
pub fn terrain(path: &Path, classes: &[u8], mark: Option<f64>) -> Result<Content, Diagnostic> {
    input_file::regular(path)?;
    let format = of(path).ok_or_else(|| unknown(path))?;
    check_kind(path)?;
    let bytes = bytes(path)?;
    let read = || -> Result<Content, ReadError> {
        let mut content = match format.read {
            Reader::Raster(read) => Content::Raster(read(&bytes)?),
            Reader::Points(read) => Content::Points(read(&bytes)?),
            Reader::ClassifiedPoints(read) => Content::Points(read(bytes, classes)?),
            Reader::Surface(read) => triangles(read(&bytes, MOST_TRIANGLES)?),
        };
        system::check_beside(path)?;
        match &mut content {
            Content::Raster(raster) => {
                without(raster, mark);
                heights::of_raster(raster)?;
            }
            Content::Points(points) => heights::of_points(points)?,
            Content::Triangles { nodes, triangles, notices } => {
                notices.extend(heights::of_triangles(nodes, triangles)?);
            }
        }
        Ok(content)
    };
    read().map_err(|e| e.in_file(path))
}

/// Read a raster file, of heights or of zone numbers.
pub fn raster(path: &Path) -> Result<Raster, Diagnostic> {
    if let Some(Format { read: Reader::Raster(read), .. }) = of(path) {
        return read(&bytes(path)?).map_err(|e| e.in_file(path));
    }
    let rasters = FORMATS.iter().filter(|format| matches!(format.read, Reader::Raster(_)));
    let known: Vec<String> = rasters.map(|format| format!(".{}", format.extensions[0])).collect();
    let error = ReadError::new(format!("`.{}` is no raster that can be read", extension(path)));
    Err(error.try_instead(format!("known are {}", known.join(", "))).in_file(path))
}

/// What reads a file of this name, if it can be read.
pub fn reader(path: &Path) -> Option<Reader> {
    of(path).map(|format| format.read)
}

/// All formats with their extensions, in words, for the reference.
pub fn described() -> String {
    let described = all().map(|format| {
        let extensions: Vec<String> = format.extensions.iter().map(|e| format!("`.{e}`")).collect();
        format!("{} {}", format.name, extensions.join(", "))
    });
    described.collect::<Vec<_>>().join("; ")
}

fn unknown(path: &Path) -> Diagnostic {
    let extension = extension(path);
    let mesh = matches!(extension.as_str(), "msh" | "inp" | "mdpa");
    let more = if mesh { "; a mesh of a net is named with [structure] mesh = \"...\"" } else { "" };
    let what = if extension.is_empty() {
        "its name has no extension that says what kind of terrain it is".into()
    } else {
        format!("`.{extension}` is no terrain that can be read")
    };
    let known: Vec<String> =
        all().flat_map(|format| format.extensions.iter().map(|e| format!(".{e}"))).collect();
    ReadError::new(what).try_instead(format!("known are {}{more}", known.join(", "))).in_file(path)
}

/// Text is read in double precision; binary STL holds single precision, to which survey coordinates of 2.6e6 m are steps of
/// 0.25 m.
fn triangles(facets: Facets) -> Content {
    let single = facets.single;
    let (nodes, triangles) = facets.indexed();
    let largest = nodes.iter().map(|n| n.amax()).fold(0.0, f64::max);
    let mut notices = Vec::new();
    if single && largest > COARSE {
        let step = largest * f64::from(f32::EPSILON);
        let what = format!("a binary STL holds coordinates of {largest:.0} m in steps of {step:.1e} m");
        notices.push(notice(what).try_instead("write it with a local origin, or as text"));
    }
    Content::Triangles { nodes, triangles, notices }
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
        return Err(Diagnostic::in_file(path.display(), "the file is empty"));
    }
    Ok(bytes)
}

const PACKED: &str = "unpack it first";
const PICTURE: &str = "a terrain has heights: a raster, points or triangles";
const SURFER: &str = "save it as an ASCII grid (Surfer 6 text)";

/// Files that are no terrain which can be read: how they begin, what they are called, what to try.
const FOREIGN: [(&[u8], &str, &str); 9] = [
    (b"PK\x03\x04", "a ZIP archive", PACKED),
    (b"\x1f\x8b", "packed by gzip", PACKED),
    (b"\x89PNG", "a picture (PNG)", PICTURE),
    (b"\xff\xd8\xff", "a picture (JPEG)", PICTURE),
    (b"%PDF", "a document (PDF)", PICTURE),
    (b"\0\0\x27\x0a", "a shapefile", "export its heights as raster or points"),
    (b"$MeshFormat", "a mesh of Gmsh", "a mesh of a net is named with [structure] mesh = \"...\""),
    (b"DSBB", "a binary Surfer grid", SURFER),
    (b"DSRB", "a binary Surfer grid", SURFER),
];

/// Refuse a file whose first bytes are of another kind than its name says.
fn check_kind(path: &Path) -> Result<(), Diagnostic> {
    let mut head = Vec::new();
    // What cannot be read is the reader's complaint.
    if files::input(path).and_then(|file| file.take(Head::LENGTH).read_to_end(&mut head)).is_err() {
        return Ok(());
    }
    let (head, extension) = (Head::new(head), extension(path));
    let foreign = FOREIGN.into_iter().find(|(mark, ..)| head.begins(&[mark]));
    let (name, cure) = match (foreign, all().find(|format| (format.begins)(&head))) {
        (Some((_, name, cure)), _) => (name, cure.to_owned()),
        (None, Some(format)) if !format.has(&extension) => {
            let right = path.with_extension(format.extensions[0]);
            (format.name, format!("name it {}", right.file_name().unwrap_or_default().display()))
        }
        _ => return Ok(()),
    };
    let wrong = ReadError::new(format!("its name says .{extension}, and it is {name}"));
    Err(wrong.try_instead(cure).in_file(path))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_of_another_kind_than_its_name_says_is_named_with_the_name_that_it_should_have() {
        let dir = tempfile::tempdir().expect("a directory");
        for (name, content, what, cure) in [
            ("t.tif", &b"ncols 2\nnrows 2\n"[..], "an ESRI grid", "name it t.asc"),
            ("t.asc", b"II*\0\x08\0\0\0", "a GeoTIFF", "name it t.tif"),
            ("t.xyz", b"LASF\0\0\0\0", "LAS or LAZ", "name it t.las"),
            ("t.las", b"2683000.0 1247000.0 1200.5\n", "a list of points", "name it t.xyz"),
            ("t.asc", b"solid hill\nfacet normal 0 0 1\n", "a surface (STL)", "name it t.stl"),
            ("t.asc", b"$MeshFormat\n4.1 0 8\n", "a mesh of Gmsh", "[structure] mesh"),
            ("t.tif", b"PK\x03\x04\0\0", "a ZIP archive", "unpack it"),
            ("t.xyz", b"\x89PNG\r\n", "a picture", "has heights"),
            ("t.asc", b"DSAA\n2 2\n", "a Surfer grid", "name it t.grd"),
            ("t.grd", b"DSRB\x04\0\0\0", "a binary Surfer grid", "ASCII"),
        ] {
            let path = dir.path().join(name);
            std::fs::write(&path, content).expect("written");
            let said = check_kind(&path).expect_err(what).to_string();
            assert!(said.contains(name) && said.contains(what) && said.contains(cure), "{said}");
        }
        for (name, content) in [
            ("t.asc", &b"ncols 2\n"[..]),
            ("t.xyz", b"x y z\n1 2 3\n"),
            ("t.csv", b"1,2,3\n"),
            ("t.stl", b"solid x\nfacet"),
            ("t.stl", b"solid made by a program, in binary\0\0"),
        ] {
            let path = dir.path().join(name);
            std::fs::write(&path, content).expect("written");
            assert_eq!(check_kind(&path), Ok(()), "{name}");
        }
    }
}
