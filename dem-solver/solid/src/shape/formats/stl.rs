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
};

const HEADER: usize = 84;
const RECORD: usize = 50;

/// The corners of all triangles, of which `most` are read.
pub fn read(bytes: &[u8], most: usize) -> Result<Facets, ReadError> {
    if bytes.is_empty() {
        return Err("the file is empty".into());
    }
    // A binary file may begin with `solid` too; the length decides.
    if let Some(field) = bytes.get(80..HEADER).and_then(<[u8]>::first_chunk) {
        let count = u32::from_le_bytes(*field) as usize;
        let size = HEADER + RECORD * count;
        if size == bytes.len() {
            too_many(count, most)?;
            return binary(bytes);
        }
        if !bytes.starts_with(b"solid") {
            let what = format!(
                "the header claims {count} triangles, which take {size} bytes; the file has {}: cut off, or not STL",
                bytes.len()
            );
            return Err(what.into());
        }
    }
    text(bytes, most)
}

fn binary(bytes: &[u8]) -> Result<Facets, ReadError> {
    let corners = bytes[HEADER..].chunks_exact(RECORD).flat_map(|record| record[12..48].as_chunks::<12>().0);
    let mut points = Vec::with_capacity(3 * (bytes.len() / RECORD));
    for (i, corner) in corners.enumerate() {
        let mut point = Vector3::zeros();
        for (value, single) in point.iter_mut().zip(corner.as_chunks().0) {
            *value = reasonable(f32::from_le_bytes(*single).into())
                .map_err(|what| format!("triangle {}: {what}", i / 3 + 1))?;
        }
        points.push(point);
    }
    resolved(&points)?;
    Ok(Facets { points, triangles: None, names: Vec::new(), single: true })
}

/// Single precision rounds coordinates of a survey to decimetres: refuse where corners move by more than a thousandth of the size.
fn resolved(points: &[Vector3<f64>]) -> Result<(), ReadError> {
    let far = points.iter().map(Vector3::amax).fold(0.0, f64::max);
    let low = points.iter().fold(Vector3::repeat(f64::INFINITY), |a, p| a.inf(p));
    let size = points.iter().map(|p| (p - low).amax()).fold(0.0, f64::max);
    let rounding = 0.5 * f64::from(f32::EPSILON) * far;
    if rounding > 1e-3 * size {
        return Err(format!(
            "a binary STL rounds coordinates of {far:.0} by up to {rounding:.2}, and the surface is {size:.2} across: its volume would be \
             wrong. Export it about an origin near it, or as text STL or OBJ"
        )
        .into());
    }
    Ok(())
}

fn text(bytes: &[u8], most: usize) -> Result<Facets, ReadError> {
    let (mut points, mut names) = (Vec::new(), Vec::new());
    // Corners of a loop that has begun.
    let mut open = 0;
    let (mut begun, mut ended, mut last) = (false, false, 0);
    for line in lines(bytes) {
        let (at, line) = line?;
        last = at;
        let mut words = line.split_ascii_whitespace();
        let Some(keyword) = words.next() else { continue };
        match keyword.to_ascii_lowercase().as_str() {
            "solid" => {
                begun = true;
                names.extend(words.next().map(|name| (points.len() / 3, shown(name))));
            }
            "endsolid" => ended = true,
            _ if !begun => return Err(ReadError::at(at, "a text STL begins with `solid`")),
            "facet" | "outer" => {}
            "vertex" if open == 3 => return Err(ReadError::at(at, "a fourth `vertex` in one loop")),
            "vertex" => {
                points.push(point(&mut words, at)?);
                open += 1;
            }
            "endfacet" if open == 0 => {}
            "endfacet" => return Err(ReadError::at(at, "`endfacet` before `endloop`")),
            "endloop" if open != 3 => {
                return Err(ReadError::at(at, format!("a loop of {open} corners: there must be 3")));
            }
            "endloop" => {
                open = 0;
                too_many(points.len() / 3, most)?;
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
    Ok(Facets { points, triangles: None, names, single: false })
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
    fn a_binary_file_in_coordinates_of_a_survey_is_refused_with_its_rounding() {
        let mut rock = builtin::cuboid(Vector3::repeat(1.2));
        rock.points.iter_mut().for_each(|p| *p += Vector3::new(2.6e6, 1.2e6, 500.0));
        let error = read(&as_binary(&rock), 1000).expect_err("rounded").message;
        assert!(error.contains("2600000 by up to 0.15") && error.contains("origin near it"), "{error}");
        assert!(read(as_text(&rock).as_bytes(), 1000).is_ok());
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
        assert_eq!((bad.line, bad.message.as_str()), (Some(4), "`O.5` is not a number"));
        let bad = refused(&good.replacen("vertex -0.5", "vertex 1e10", 1));
        assert!(bad.message.contains("1e10"), "{bad:?}");
        assert!(refused(&good.replacen("  endloop\n", "", 1)).message.contains("before `endloop`"));
        assert!(read(b"solid x\n\xff\xfe\n", 1000).expect_err("binary").message.contains("no text"));
    }
}
