//! STL, text and binary. The facets' normals are not used: the order of the corners tells more.
//!
//! Own code: the crate for it keeps single precision in text files too, believes the header's number
//! of triangles, and names no line. Source: the format as described by the Library of Congress, fdd000505 and fdd000506.

use super::format::{Facets, SurfaceFormat, too_many};
use crate::input::{ReadError, lines, point, reasonable, shown};
use nalgebra::Vector3;

/// This format.
pub const FORMAT: SurfaceFormat = SurfaceFormat {
    name: "a surface (STL)",
    extension: "stl",
    begins: |head| head.word() == "solid" && head.text().contains("facet"),
    read,
    names,
};

const HEADER: usize = 84;
const RECORD: usize = 50;

/// The corners of all triangles, of which `most` are read.
pub fn read(bytes: &[u8], most: usize) -> Result<Facets, ReadError> {
    if bytes.is_empty() {
        return Err(ReadError::new("the file is empty"));
    }
    // A binary file may begin with `solid` too; the length decides.
    if let Some(count) = claimed(bytes) {
        if HEADER + RECORD * count == bytes.len() {
            return Ok(Facets::LooseSingle(binary(bytes, count, most)?));
        }
        if !bytes.starts_with(b"solid") {
            return Err(ReadError::new(format!(
                "the header claims {count} triangles, which take {} bytes; the file has {}: cut off, or not STL",
                HEADER + RECORD * count,
                bytes.len()
            )));
        }
    }
    Ok(Facets::Loose(text(bytes, most)?))
}

/// The number of triangles in a binary header.
fn claimed(bytes: &[u8]) -> Option<usize> {
    let field = bytes.get(80..HEADER)?;
    Some(u32::from_le_bytes(field.try_into().ok()?) as usize)
}

/// Names of solids in a text file that has been read, with the number of triangles before each; a binary one has none.
pub fn names(bytes: &[u8]) -> Vec<(usize, String)> {
    if claimed(bytes).is_some_and(|count| HEADER + RECORD * count == bytes.len()) {
        return Vec::new();
    }
    let (mut before, mut names) = (0, Vec::new());
    for (_, line) in lines(bytes).filter_map(Result::ok) {
        let mut words = line.split_ascii_whitespace();
        match words.next().map(str::to_lowercase).as_deref() {
            Some("endfacet") => before += 1,
            Some("solid") => names.extend(words.next().map(|name| (before, shown(name)))),
            _ => {}
        }
    }
    names
}

fn binary(bytes: &[u8], count: usize, most: usize) -> Result<Vec<[Vector3<f64>; 3]>, ReadError> {
    too_many(count, most)?;
    let mut corners = Vec::with_capacity(count);
    for (i, record) in bytes[HEADER..].chunks_exact(RECORD).enumerate() {
        let mut triangle = [Vector3::zeros(); 3];
        for (k, value) in record[12..48].chunks_exact(4).enumerate() {
            let single = f32::from_le_bytes([value[0], value[1], value[2], value[3]]);
            triangle[k / 3][k % 3] = reasonable(f64::from(single))
                .map_err(|what| ReadError::new(format!("triangle {}: {what}", i + 1)))?;
        }
        corners.push(triangle);
    }
    Ok(corners)
}

fn text(bytes: &[u8], most: usize) -> Result<Vec<[Vector3<f64>; 3]>, ReadError> {
    let mut corners: Vec<[Vector3<f64>; 3]> = Vec::new();
    let mut open: Vec<Vector3<f64>> = Vec::with_capacity(3);
    let (mut begun, mut ended, mut last) = (false, false, 0);
    for line in lines(bytes) {
        let (at, line) = line?;
        last = at;
        let mut words = line.split_ascii_whitespace();
        let Some(keyword) = words.next() else { continue };
        match keyword.to_ascii_lowercase().as_str() {
            "solid" => begun = true,
            "endsolid" => ended = true,
            _ if !begun => return Err(ReadError::at(at, "a text STL begins with `solid`")),
            "facet" | "outer" => {}
            "vertex" if open.len() == 3 => return Err(ReadError::at(at, "a fourth `vertex` in one loop")),
            "vertex" => open.push(point(&mut words, at)?),
            "endfacet" if open.is_empty() => {}
            "endfacet" => return Err(ReadError::at(at, "`endfacet` before `endloop`")),
            "endloop" => {
                let triangle = open.as_slice().try_into().map_err(|_| {
                    ReadError::at(at, format!("a loop of {} corners: there must be 3", open.len()))
                })?;
                corners.push(triangle);
                open.clear();
                too_many(corners.len(), most)?;
            }
            _ => {
                let last = bytes.iter().filter(|b| **b == b'\n').count() < at;
                let cut = if last { ", and the file ends with it: cut off? Save it anew" } else { "" };
                return Err(ReadError::at(at, format!("`{}` is no word of a text STL{cut}", shown(keyword))));
            }
        }
    }
    if !ended {
        return Err(ReadError::at(last, "the file ends before `endsolid`: cut off?"));
    }
    Ok(corners)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shape::{Surface, builtin};
    use std::fmt::Write;

    /// The surface as an STL file in text.
    pub fn as_text(surface: &Surface) -> String {
        let mut text = String::from("solid rock\n");
        for t in 0..surface.triangles.len() {
            text += "facet normal 0 0 0\n  outer loop\n";
            for p in surface.corners(t) {
                let _ = writeln!(text, "    vertex {} {} {:e}", p.x, p.y, p.z);
            }
            text += "  endloop\nendfacet\n";
        }
        text + "endsolid rock\n"
    }

    pub fn as_binary(surface: &Surface) -> Vec<u8> {
        let mut bytes = b"solid, says a binary file".to_vec();
        bytes.resize(80, b' ');
        bytes.extend((surface.triangles.len() as u32).to_le_bytes());
        for t in 0..surface.triangles.len() {
            bytes.extend([0; 12]);
            for p in surface.corners(t) {
                bytes.extend(p.iter().flat_map(|c| (*c as f32).to_le_bytes()));
            }
            bytes.extend([0; 2]);
        }
        bytes
    }

    #[test]
    fn text_keeps_every_bit_and_binary_what_single_precision_holds() {
        let rock = builtin::random_convex(Vector3::new(0.3, 0.5, 0.7), 30, 1).expect("a hull");
        let read_back = |bytes: &[u8]| {
            let (points, triangles) = read(bytes, 1000).expect("STL").indexed();
            Surface::from_indexed(points, triangles).expect("closed").0
        };
        let text = read_back(as_text(&rock).as_bytes());
        assert!(text.points.iter().all(|p| rock.points.contains(p)));
        let binary = read_back(&as_binary(&rock));
        assert_eq!(binary.triangles.len(), rock.triangles.len());
        for p in &binary.points {
            assert!(rock.points.iter().any(|q| (p - q).norm() < 1e-7));
        }
    }

    #[test]
    fn a_header_that_promises_too_much_allocates_nothing() {
        let mut bytes = as_binary(&builtin::cuboid(Vector3::repeat(1.0)));
        bytes[80..84].copy_from_slice(&4_000_000_000_u32.to_le_bytes());
        bytes[0] = b'x';
        let error = read(&bytes, 1000).expect_err("a lie").message;
        assert!(error.contains("4000000000 triangles") && error.contains("cut off"), "{error}");
    }

    #[test]
    fn what_is_no_stl_is_refused_with_its_line() {
        let good = as_text(&builtin::cuboid(Vector3::repeat(1.0)));
        let refused = |text: &str| read(text.as_bytes(), 1000).expect_err("refused");
        assert_eq!(refused("").message, "the file is empty");
        assert_eq!(refused("hello").line, Some(1));
        for bytes in [good.as_bytes(), &as_binary(&builtin::cuboid(Vector3::repeat(1.0)))] {
            assert!(read(bytes, 11).expect_err("12").message.contains("up to 11"));
        }
        assert!(refused(&good[..good.len() - "endsolid rock\n".len()]).message.contains("endsolid"));
        let bad = refused(&good.replacen("vertex -0.5", "vertex O.5", 1));
        assert_eq!((bad.line, bad.message.as_str()), (Some(4), "`O.5` is no number"));
        let bad = refused(&good.replacen("vertex -0.5", "vertex 1e10", 1));
        assert!(bad.message.contains("1e10"), "{bad:?}");
        assert!(refused(&good.replacen("  endloop\n", "", 1)).message.contains("before `endloop`"));
        assert!(read(b"solid x\n\xff\xfe\n", 1000).expect_err("binary").message.contains("no text"));
    }
}
