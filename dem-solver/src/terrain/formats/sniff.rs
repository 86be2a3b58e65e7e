//! What a file is by its first bytes, where its name says something else.

use interface_defs::toolkit::input_error::InputError;
use std::io::Read;
use std::path::Path;

/// Bytes that are looked at.
const HEAD: u64 = 512;

/// A kind of file: what it is called, extensions under which it is read, what to try where there are none.
struct Kind {
    name: &'static str,
    extensions: &'static [&'static str],
    cure: &'static str,
}

const fn kind(name: &'static str, extensions: &'static [&'static str], cure: &'static str) -> Kind {
    Kind { name, extensions, cure }
}

const PACKED: &str = "unpack it first";
const PICTURE: &str = "a terrain has heights: a raster, points or triangles";

/// The kind of a file that begins with `head`, if it shows.
fn of(head: &[u8]) -> Option<Kind> {
    let binary: [(&[u8], Kind); 10] = [
        (b"II*\0", kind("a GeoTIFF", &["tif", "tiff"], "")),
        (b"MM\0*", kind("a GeoTIFF", &["tif", "tiff"], "")),
        (b"II+\0", kind("a GeoTIFF", &["tif", "tiff"], "")),
        (b"LASF", kind("LAS or LAZ", &["las", "laz"], "")),
        (b"PK\x03\x04", kind("a ZIP archive", &[], PACKED)),
        (b"\x1f\x8b", kind("packed by gzip", &[], PACKED)),
        (b"\x89PNG", kind("a picture (PNG)", &[], PICTURE)),
        (b"\xff\xd8\xff", kind("a picture (JPEG)", &[], PICTURE)),
        (b"%PDF", kind("a document (PDF)", &[], PICTURE)),
        (b"\0\0\x27\x0a", kind("a shapefile", &[], "export its heights as raster or points")),
    ];
    if let Some((_, kind)) = binary.into_iter().find(|(start, _)| head.starts_with(start)) {
        return Some(kind);
    }
    let text = std::str::from_utf8(head).or_else(|e| std::str::from_utf8(&head[..e.valid_up_to()])).ok()?;
    let lower = text.trim_start().to_lowercase();
    let line = lower.lines().next().unwrap_or_default();
    let numbers =
        line.split([' ', '\t', ',', ';']).filter(|w| !w.is_empty()).map(|w| w.parse::<f64>().is_ok());
    Some(match line.split_whitespace().next()? {
        "ncols" | "nrows" => kind("an ESRI grid", &["asc"], ""),
        "solid" if lower.contains("facet") => kind("a surface (STL)", &["stl"], ""),
        "v" => kind("a surface (OBJ)", &["obj"], ""),
        "$meshformat" => {
            kind("a mesh of Gmsh", &[], "a mesh of a net is named with [structure] mesh = \"...\"")
        }
        _ if numbers.clone().count() >= 3 && numbers.into_iter().all(|number| number) => {
            kind("a list of points", &["xyz", "txt", "csv"], "")
        }
        _ => return None,
    })
}

/// Refuse a file whose first bytes are of another kind than its `extension` says.
pub fn check(path: &Path, extension: &str) -> Result<(), InputError> {
    let mut head = Vec::new();
    // What cannot be read is the reader's complaint.
    if std::fs::File::open(path).and_then(|file| file.take(HEAD).read_to_end(&mut head)).is_err() {
        return Ok(());
    }
    let Some(kind) = of(&head).filter(|kind| !kind.extensions.contains(&extension)) else { return Ok(()) };
    let cure = kind.extensions.first().map_or_else(
        || kind.cure.into(),
        |right| format!("name it {}", path.with_extension(right).file_name().unwrap_or_default().display()),
    );
    let what = format!("its name says .{extension}, and it is {}", kind.name);
    Err(InputError::in_file(path.display().to_string(), what).try_instead(cure))
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
        ] {
            let path = dir.path().join(name);
            std::fs::write(&path, content).expect("written");
            let extension = path.extension().expect("one").to_string_lossy().into_owned();
            let said = check(&path, &extension).expect_err(what).to_string();
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
            assert_eq!(check(&path, &name[2..]), Ok(()), "{name}");
        }
    }
}
