//! Surface files: which reader, limits, and errors with file and line.

pub mod obj;
pub mod stl;

use crate::shape::Surface;
use crate::shape::surface::{Flaw, MOST_TRIANGLES, Mend, joined};
use interface_defs::toolkit::input_error::InputError;
use interface_defs::toolkit::input_file;
use nalgebra::Vector3;
use std::path::Path;

/// Largest file that is read [bytes].
const LARGEST: u64 = 1 << 30;

/// Largest coordinate [m]: beyond it products of lengths lose their meaning long before they overflow.
const FURTHEST: f64 = 1e9;

/// What is wrong in a file, and at which line (from 1) if it has lines.
#[derive(Debug, Clone, PartialEq)]
pub struct ReadError {
    /// The line.
    pub line: Option<usize>,
    /// What is wrong.
    pub message: String,
}

impl ReadError {
    /// Something wrong with the file as a whole.
    pub fn new(message: impl Into<String>) -> Self {
        Self { line: None, message: message.into() }
    }

    /// Something wrong at a line (from 1).
    pub fn at(line: usize, message: impl Into<String>) -> Self {
        Self { line: Some(line), message: message.into() }
    }

    /// With the file's name in front.
    pub fn in_file(self, path: &Path) -> InputError {
        let place = match self.line {
            Some(line) => format!("{}:{line}", path.display()),
            None => path.display().to_string(),
        };
        InputError::in_file(place, self.message)
    }
}

impl From<Flaw> for ReadError {
    fn from(flaw: Flaw) -> Self {
        Self::new(flaw.to_string())
    }
}

/// The closed surface in an STL or OBJ file, lengths times `scale`, mended as asked for; the second part says what was
/// mended.
pub fn read_surface(path: &Path, scale: f64, mend: &Mend) -> Result<(Surface, Vec<String>), InputError> {
    let bytes = read_bytes(path)?;
    let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase());
    let read = match extension.as_deref() {
        Some("stl") => stl::read(&bytes, MOST_TRIANGLES).and_then(|mut soup| {
            soup.corners.as_flattened_mut().iter_mut().for_each(|p| *p *= scale);
            let (points, triangles) = joined(&soup.corners);
            let names = || if soup.binary { Vec::new() } else { stl::names(&bytes) };
            mended(points, triangles, mend, names)
        }),
        Some("obj") => obj::read(&bytes, MOST_TRIANGLES).and_then(|(mut points, triangles)| {
            points.iter_mut().for_each(|p| *p *= scale);
            mended(points, triangles, mend, || obj::names(&bytes))
        }),
        _ => Err(ReadError::new("a surface is read from .stl or .obj")),
    };
    read.map_err(|e| e.in_file(path))
}

/// The closed surface of a file that gives its parts names.
fn mended(
    points: Vec<Vector3<f64>>,
    triangles: Vec<[u32; 3]>,
    mend: &Mend,
    names: impl Fn() -> Vec<(usize, String)>,
) -> Result<(Surface, Vec<String>), ReadError> {
    let names_asked = if mend.piece.is_some() { names() } else { Vec::new() };
    let mend = Mend { names: names_asked, ..mend.clone() };
    let found = Surface::mended(points, triangles, &mend).map_err(|mut flaw| {
        if let Flaw::Pieces(pieces) = &mut flaw {
            pieces.name(&names());
        }
        flaw
    });
    Ok(found?)
}

/// The bytes of a file of reasonable size.
pub fn read_bytes(path: &Path) -> Result<Vec<u8>, InputError> {
    let refuse = |what: String| InputError::in_file(path.display().to_string(), what);
    let data = input_file::regular(path)?;
    if data.len() > LARGEST {
        return Err(refuse(format!("{} bytes: up to {LARGEST} are read", data.len())));
    }
    std::fs::read(path).map_err(|e| refuse(format!("the file cannot be read: {e}")))
}

/// The lines of a text, numbered from 1; a line that is not text is an error.
pub fn lines(bytes: &[u8]) -> impl Iterator<Item = Result<(usize, &str), ReadError>> {
    bytes.split(|b| *b == b'\n').enumerate().map(|(i, line)| match std::str::from_utf8(line) {
        Ok(text) => Ok((i + 1, text.trim())),
        Err(_) => Err(ReadError::at(i + 1, "this is no text: a binary file?")),
    })
}

/// A finite number of reasonable size from a word of a line.
pub fn number(word: Option<&str>, line: usize) -> Result<f64, ReadError> {
    let word = word.ok_or_else(|| ReadError::at(line, "a number is missing at the end of the line"))?;
    let value: f64 =
        word.parse().map_err(|_| ReadError::at(line, format!("`{}` is no number", shown(word))))?;
    reasonable(value).map_err(|what| ReadError::at(line, what))
}

/// Three numbers.
pub fn point<'a>(words: &mut impl Iterator<Item = &'a str>, line: usize) -> Result<Vector3<f64>, ReadError> {
    Ok(Vector3::new(number(words.next(), line)?, number(words.next(), line)?, number(words.next(), line)?))
}

/// The value, if it is finite and below 1e9.
pub fn reasonable(value: f64) -> Result<f64, String> {
    if value.is_finite() && value.abs() <= FURTHEST {
        Ok(value)
    } else {
        Err(format!("a coordinate of {value:e}: finite ones up to {FURTHEST:e} are possible"))
    }
}

/// An error if there are more triangles than `most`.
pub fn too_many(count: usize, most: usize) -> Result<(), ReadError> {
    if count > most {
        return Err(ReadError::new(format!(
            "{count} triangles: up to {most} are read; thin the surface out"
        )));
    }
    Ok(())
}

/// The beginning of a word, for a message.
pub fn shown(word: &str) -> String {
    word.chars().take(24).collect()
}
