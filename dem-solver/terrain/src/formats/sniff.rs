//! What a file is by its first bytes, where its name says something else.

use super::format::Format;
use dem_solid::input::Head;
use dem_solid::shape;
use interface_defs::diagnostic::Diagnostic;
use std::io::Read;
use std::path::Path;
use toolkit::files;

/// A kind of file.
struct FileKind {
    /// What it is called.
    name: &'static str,
    /// Extensions under which it is read.
    extensions: Vec<&'static str>,
    /// What to try where there are none.
    cure: &'static str,
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

/// The kind of a file that begins with `head`, if it shows.
fn of(head: &Head, formats: &[&Format]) -> Option<FileKind> {
    if let Some((_, name, cure)) = FOREIGN.into_iter().find(|(mark, ..)| head.begins(&[mark])) {
        return Some(FileKind { name, extensions: Vec::new(), cure });
    }
    let own = formats.iter().find(|format| (format.begins)(head)).map(|format| {
        let extensions = [format.extensions, format.also].concat();
        FileKind { name: format.name, extensions, cure: "" }
    });
    own.or_else(|| {
        let surface = shape::formats::FORMATS.iter().find(|format| (format.begins)(head))?;
        Some(FileKind { name: surface.name, extensions: vec![surface.extension], cure: "" })
    })
}

/// Refuse a file whose first bytes are of another kind than its `extension` says; `formats` are those of terrain.
pub fn check(path: &Path, extension: &str, formats: &[&Format]) -> Result<(), Diagnostic> {
    let mut head = Vec::new();
    // What cannot be read is the reader's complaint.
    if files::input(path).and_then(|file| file.take(Head::LENGTH).read_to_end(&mut head)).is_err() {
        return Ok(());
    }
    let kind = of(&Head::new(head), formats).filter(|kind| !kind.extensions.contains(&extension));
    let Some(kind) = kind else { return Ok(()) };
    let cure = kind.extensions.first().map_or_else(
        || kind.cure.into(),
        |right| format!("name it {}", path.with_extension(right).file_name().unwrap_or_default().display()),
    );
    let what = format!("its name says .{extension}, and it is {}", kind.name);
    Err(Diagnostic::in_file(path.display().to_string(), what).try_instead(cure))
}

#[cfg(test)]
mod tests {
    use super::super::FORMATS;
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
            let extension = path.extension().expect("one").to_string_lossy().into_owned();
            let said = check(&path, &extension, FORMATS).expect_err(what).to_string();
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
            assert_eq!(check(&path, &name[2..], FORMATS), Ok(()), "{name}");
        }
    }
}
