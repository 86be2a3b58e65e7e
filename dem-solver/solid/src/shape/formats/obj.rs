//! Wavefront OBJ: corners and faces; everything else of the format is passed over. Faces with more than
//! three corners are cut into a fan.
//!
//! Own code: the crate for it works in single precision unless set otherwise and names no line.

use super::format::{Facets, SurfaceFormat, too_many};
use crate::input::{ReadError, lines, point, shown};
use nalgebra::Vector3;

/// This format.
pub const FORMAT: SurfaceFormat =
    SurfaceFormat { name: "a surface (OBJ)", extension: "obj", begins: |head| head.word() == "v", read };

/// Most corners of one face.
const MOST_CORNERS: usize = 1000;

/// Words of the format that say nothing about the surface.
const PASSED: &str = "vt vn vp s l p usemtl mtllib mg lod bevel usemap shadow_obj trace_obj";

/// Corners and triangles, of which `most` are read.
pub fn read(bytes: &[u8], most: usize) -> Result<Facets, ReadError> {
    let mut points: Vec<Vector3<f64>> = Vec::new();
    let mut faces: Vec<(usize, [i64; 3])> = Vec::new();
    let mut names = Vec::new();
    for line in lines(bytes) {
        let (at, line) = line?;
        let mut words = line.split('#').next().unwrap_or_default().split_ascii_whitespace();
        match words.next() {
            None => {}
            Some("v") => points.push(point(&mut words, at)?),
            Some("f") => {
                let mut corners = Vec::with_capacity(4);
                for word in words {
                    if corners.len() == MOST_CORNERS {
                        return Err(ReadError::at(at, format!("a face of more than {MOST_CORNERS} corners")));
                    }
                    corners.push(corner(word, points.len(), at)?);
                }
                if corners.len() < 3 {
                    return Err(ReadError::at(at, format!("a face of {} corners", corners.len())));
                }
                faces.extend((2..corners.len()).map(|k| (at, [corners[0], corners[k - 1], corners[k]])));
                too_many(faces.len(), most)?;
            }
            Some("g" | "o") => names.extend(words.next().map(|name| (faces.len(), shown(name)))),
            Some(word) if PASSED.split(' ').any(|passed| passed == word) => {}
            Some(word) => {
                return Err(ReadError::at(at, format!("`{}` is no word of an OBJ file", shown(word))));
            }
        }
    }
    if faces.is_empty() {
        let count = points.len();
        let what = format!(
            "the file has {count} corners (`v x y z`) and no faces (`f a b c`): cut off, or not OBJ?"
        );
        return Err(what.into());
    }
    let count = points.len() as i64;
    if let Some((at, number)) = faces.iter().find_map(|(at, f)| Some((*at, f.iter().find(|n| **n >= count)?)))
    {
        return Err(ReadError::at(at, format!("corner {} of a file of {count} corners", number + 1)));
    }
    let triangles = faces.into_iter().map(|(_, face)| face.map(|number| number as u32)).collect();
    Ok(Facets { points, triangles: Some(triangles), names, single: false })
}

/// The number of a corner, from 0; a negative one counts back from the last corner so far.
fn corner(word: &str, so_far: usize, line: usize) -> Result<i64, ReadError> {
    let number = word.split('/').next().unwrap_or_default();
    match number.parse::<i64>() {
        Ok(n) if n > 0 => Ok(n - 1),
        Ok(n) if n < 0 && n.unsigned_abs() <= so_far as u64 => Ok(so_far as i64 + n),
        _ => Err(ReadError::at(line, format!("`{}` is not the number of a corner", shown(word)))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shape::{SolidIntegrals, Surface};

    const CUBE: &str = "# a cube\nmtllib none.mtl\no cube\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\n\
                        v 1 1 1\nv 0 1 1\nvn 0 0 1\nf 4//1 3//1 2//1 1//1\nf 5 6 7 8\nf 1/1/1 2/2/1 6/3/1 5/4/1\n\
                        f -7 -6 -2 -3 # from the end\nf 3 4 8 7\nf 1 5 8 4\n";

    #[test]
    fn faces_of_four_corners_and_numbers_from_the_end_make_a_cube() {
        let (points, triangles) = read(CUBE.as_bytes(), 12).expect("OBJ").indexed();
        let (surface, notes) = Surface::from_indexed(points, triangles).expect("closed");
        assert!(notes.is_empty());
        assert!((SolidIntegrals::of(&surface).volume - 1.0).abs() < 1e-15);
    }

    #[test]
    fn what_is_no_obj_is_refused_with_its_line() {
        let refused = |text: &str| read(text.as_bytes(), 12).expect_err("refused");
        assert!(refused("").message.starts_with("the file has 0 corners (`v x y z`) and no faces"));
        assert_eq!(refused("v 0 0\n").message, "a number is missing at the end of the line");
        assert_eq!(refused(&CUBE.replace("f 5 6 7 8", "f 5 6 7 9")).line, Some(14));
        assert_eq!(
            refused(&CUBE.replace("f 5 6 7 8", "f 5 6 0 8")).message,
            "`0` is not the number of a corner"
        );
        assert_eq!(refused(&CUBE.replace("f -7", "f -9")).line, Some(16));
        assert!(refused("solid x\n").message.contains("`solid` is no word"));
        assert!(read(CUBE.as_bytes(), 11).expect_err("12").message.contains("up to 11"));
        let endless = format!("v 0 0 0\nf{}", " 1".repeat(1001));
        assert!(refused(&endless).message.contains("more than 1000 corners"));
    }
}
