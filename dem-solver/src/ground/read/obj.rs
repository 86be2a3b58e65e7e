//! Wavefront OBJ: `v x y z` and `f a b c ...`, whose corners may carry `/texture/normal` and count from
//! the end where negative. Faces of more corners are cut into triangles from their first; other lines are
//! not looked at.

use super::{Content, number, shown};
use interface_defs::toolkit::input_error::InputError;
use nalgebra::Vector3;

/// Read the bytes of `file`.
pub fn read(bytes: &[u8], file: &str) -> Result<Content, InputError> {
    let mut nodes: Vec<Vector3<f64>> = Vec::new();
    let mut triangles = Vec::new();
    let mut corners: Vec<u32> = Vec::new();
    for (line, text) in (1..).zip(bytes.split(|b| *b == b'\n')) {
        let fault = |what: String| InputError::in_file(format!("{file}:{line}"), what);
        let mut words = text.split(u8::is_ascii_whitespace).filter(|w| !w.is_empty());
        match words.next() {
            Some(b"v") => {
                let mut at = Vector3::zeros();
                for axis in 0..3 {
                    let Some(word) = words.next() else {
                        return Err(fault("a vertex needs three coordinates".into()));
                    };
                    at[axis] =
                        number(word).ok_or_else(|| fault(format!("`{}` is no coordinate", shown(word))))?;
                }
                nodes.push(at);
            }
            Some(b"f") => {
                corners.clear();
                for word in words {
                    let first = word.split(|b| *b == b'/').next().unwrap_or_default();
                    let place = std::str::from_utf8(first).ok().and_then(|t| t.parse::<i64>().ok());
                    let count = nodes.len() as i64;
                    let node = match place {
                        Some(n) if n > 0 && n <= count => n - 1,
                        Some(n) if n < 0 && -n <= count => count + n,
                        _ => {
                            return Err(fault(format!(
                                "`{}` is none of the {count} vertices so far",
                                shown(word)
                            )));
                        }
                    };
                    corners.push(node as u32);
                }
                if corners.len() < 3 {
                    return Err(fault(format!("a face of {} corners; 3 are needed", corners.len())));
                }
                triangles.extend(corners.windows(2).skip(1).map(|w| [corners[0], w[0], w[1]]));
            }
            _ => {}
        }
    }
    if triangles.is_empty() {
        return Err(InputError::in_file(file, "the file has no face (`f a b c`); is this an OBJ?"));
    }
    Ok(Content::Triangles { nodes, triangles, notices: Vec::new() })
}
