//! STL, text or binary. Corners of equal coordinates become one node. Text is read in double precision;
//! binary files hold single precision, to which survey coordinates of 2.6e6 m are steps of 0.25 m.

use super::{Content, Words, number, shown};
use interface_defs::toolkit::input_error::InputError;
use nalgebra::Vector3;
use std::collections::HashMap;

/// Bytes before the triangles of a binary file, and of each of them.
const HEAD: usize = 84;
const EACH: usize = 50;

/// Coordinates from which on single precision is coarser than a tenth of a millimetre [m].
const COARSE: f64 = 1024.0;

/// Read the bytes of `file`.
pub fn read(bytes: &[u8], file: &str) -> Result<Content, InputError> {
    // Binary files may begin with `solid` too: their length is what tells.
    let count = bytes.get(80..HEAD).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]) as usize);
    let fits = count.is_some_and(|n| n > 0 && n.checked_mul(EACH).is_some_and(|l| l == bytes.len() - HEAD));
    if fits {
        return binary(bytes, file);
    }
    if bytes.trim_ascii_start().starts_with(b"solid") && !bytes.iter().take(512).any(|b| *b == 0) {
        return text(bytes, file);
    }
    Err(match count {
        Some(n) => InputError::in_file(
            file,
            format!(
                "{n} triangles of a binary STL are {EACH} bytes each, and the file has {} bytes",
                bytes.len()
            ),
        ),
        None => InputError::in_file(file, format!("{} bytes are too few for an STL", bytes.len())),
    })
}

#[derive(Default)]
struct Weld {
    nodes: Vec<Vector3<f64>>,
    triangles: Vec<[u32; 3]>,
    places: HashMap<[u64; 3], u32>,
}

impl Weld {
    fn place(&mut self, at: Vector3<f64>) -> u32 {
        // Both zeros are one place.
        let key = [at.x + 0.0, at.y + 0.0, at.z + 0.0].map(f64::to_bits);
        *self.places.entry(key).or_insert_with(|| {
            self.nodes.push(at);
            self.nodes.len() as u32 - 1
        })
    }

    fn content(self, notices: Vec<String>) -> Content {
        Content::Triangles { nodes: self.nodes, triangles: self.triangles, notices }
    }
}

fn binary(bytes: &[u8], file: &str) -> Result<Content, InputError> {
    let mut weld = Weld::default();
    for (number, triangle) in (1..).zip(bytes[HEAD..].chunks_exact(EACH)) {
        // The normal, of 12 bytes, follows from the corners.
        let value = |i: usize| {
            let at = 12 + 4 * i;
            f64::from(f32::from_le_bytes([
                triangle[at],
                triangle[at + 1],
                triangle[at + 2],
                triangle[at + 3],
            ]))
        };
        let corners = [0, 3, 6].map(|i| Vector3::new(value(i), value(i + 1), value(i + 2)));
        if !corners.iter().all(|c| c.iter().all(|v| v.is_finite())) {
            return Err(InputError::in_file(
                file,
                format!("triangle {number} has a corner that is not finite"),
            ));
        }
        let nodes = corners.map(|c| weld.place(c));
        weld.triangles.push(nodes);
    }
    let largest = weld.nodes.iter().map(|n| n.amax()).fold(0.0, f64::max);
    let coarse = largest * f64::from(f32::EPSILON);
    let notices = if largest > COARSE {
        vec![format!(
            "terrain: a binary STL holds coordinates of {largest:.0} m in steps of {coarse:.1e} m; write it with a local \
             origin, or as text"
        )]
    } else {
        Vec::new()
    };
    Ok(weld.content(notices))
}

fn text(bytes: &[u8], file: &str) -> Result<Content, InputError> {
    let mut words = Words::new(bytes);
    let mut weld = Weld::default();
    let mut corners: Vec<u32> = Vec::with_capacity(3);
    while let Some(word) = words.next() {
        let line = words.line;
        let fault = |what: String| InputError::in_file(format!("{file}:{line}"), what);
        match word {
            b"vertex" => {
                let mut at = Vector3::zeros();
                for axis in 0..3 {
                    let Some(word) = words.next() else {
                        return Err(fault("the file ends within a vertex".into()));
                    };
                    at[axis] =
                        number(word).ok_or_else(|| fault(format!("`{}` is no coordinate", shown(word))))?;
                }
                corners.push(weld.place(at));
            }
            b"endfacet" => {
                let Ok(triangle) = <[u32; 3]>::try_from(corners.as_slice()) else {
                    return Err(fault(format!("a facet of {} corners; 3 are due", corners.len())));
                };
                weld.triangles.push(triangle);
                corners.clear();
            }
            _ => {}
        }
    }
    if !corners.is_empty() {
        return Err(InputError::in_file(format!("{file}:{}", words.line), "the file ends within a facet"));
    }
    Ok(weld.content(Vec::new()))
}
