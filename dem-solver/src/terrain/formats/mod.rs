//! Readers of terrain files, one module per format; STL and OBJ are read by those of [`crate::shape`]. Each gives what the file holds, in the file's own
//! coordinates, or an error with file and place; none trusts a length that the file states before it has
//! compared it with the file's size.

pub mod asc;
pub mod crs;
mod heights;
pub mod las;
mod laz;
pub mod mesh;
mod sniff;
pub mod tif;
pub mod xyz;

use crate::settings::TerrainSettings;
use crate::terrain::triangulation::Raster;
use interface_defs::toolkit::input_error::InputError;
use interface_defs::toolkit::input_file;
use nalgebra::Vector3;
use std::path::Path;

/// What a terrain file holds.
#[derive(Debug, Clone, PartialEq)]
pub enum Content {
    /// A raster of heights.
    Raster(Raster),
    /// Points [m].
    Points(Vec<[f64; 3]>),
    /// Triangles.
    Triangles {
        /// Corners [m].
        nodes: Vec<Vector3<f64>>,
        /// Triangles.
        triangles: Vec<[u32; 3]>,
        /// What the user should know.
        notices: Vec<String>,
    },
}

/// Read a terrain file; its extension says what it is.
pub fn terrain(path: &Path, settings: &TerrainSettings) -> Result<Content, InputError> {
    let file = path.display().to_string();
    let mark = settings.nodata_value;
    input_file::regular(path)?;
    let extension = extension(path);
    if ["asc", "tif", "tiff", "xyz", "txt", "csv", "las", "laz", "stl", "obj"].contains(&extension.as_str()) {
        sniff::check(path, &extension)?;
    }
    let mut content = match extension.as_str() {
        "asc" => asc::read(&bytes(path)?, &file).map(|raster| Content::Raster(without(raster, mark))),
        "tif" | "tiff" => {
            tif::read(&bytes(path)?, &file).map(|raster| Content::Raster(without(raster, mark)))
        }
        "xyz" | "txt" | "csv" => xyz::read(&bytes(path)?, &file).map(Content::Points),
        "las" | "laz" => las::read(bytes(path)?, &settings.classes, &file).map(Content::Points),
        "stl" => mesh::stl(&bytes(path)?).map_err(|e| e.in_file(path)),
        "obj" => mesh::obj(&bytes(path)?).map_err(|e| e.in_file(path)),
        other => {
            let mesh = matches!(other, "msh" | "inp" | "mdpa");
            let more = if mesh { "; a mesh of a net is named with [structure] mesh = \"...\"" } else { "" };
            let what = if other.is_empty() {
                "its name has no extension that says what kind of terrain it is".into()
            } else {
                format!("`.{other}` is no terrain that can be read")
            };
            Err(InputError::in_file(file.as_str(), what)
                .try_instead(format!("known are .asc, .tif, .xyz, .las, .laz, .stl, .obj{more}")))
        }
    }?;
    crs::beside(path)?;
    match &mut content {
        Content::Raster(raster) => heights::of_raster(raster, &file)?,
        Content::Points(points) => heights::of_points(points, &file)?,
        Content::Triangles { nodes, triangles, notices } => {
            notices.extend(heights::of_triangles(nodes, triangles, &file)?);
        }
    }
    Ok(content)
}

/// The raster without the cells whose height is `mark`.
fn without(mut raster: Raster, mark: Option<f64>) -> Raster {
    if let Some(mark) = mark {
        // A height of single precision meets what is written in single precision.
        let is_mark = |z: f64| z == mark || z as f32 == mark as f32;
        raster.heights.iter_mut().filter(|z| is_mark(**z)).for_each(|z| *z = f64::NAN);
    }
    raster
}

/// Extension in lower case.
pub fn extension(path: &Path) -> String {
    path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default()
}

/// Largest file that is read [bytes].
const LARGEST: u64 = 16 << 30;

/// Most cells of a raster: each takes some 90 bytes, with its two triangles and their tree.
pub(crate) const MOST_CELLS: usize = 250_000_000;

/// The whole file.
pub fn bytes(path: &Path) -> Result<Vec<u8>, InputError> {
    let file = path.display().to_string();
    let length = input_file::regular(path)?.len();
    if length > LARGEST {
        return Err(InputError::in_file(file, format!("{length} bytes: up to {LARGEST} are read")));
    }
    let bytes = std::fs::read(path)
        .map_err(|e| InputError::in_file(file.as_str(), format!("the file cannot be read: {e}")))?;
    if bytes.is_empty() {
        return Err(InputError::in_file(file, "the file is empty"));
    }
    Ok(bytes)
}

/// Words of a text, and in which line they stand.
pub(crate) struct Words<'a> {
    text: &'a [u8],
    at: usize,
    /// Line of the word given last, from 1.
    pub line: usize,
    breaks: usize,
}

impl<'a> Words<'a> {
    /// Of `text`.
    pub fn new(text: &'a [u8]) -> Self {
        Self { text, at: 0, line: 1, breaks: 0 }
    }

    /// The next word, in whatever line.
    pub fn next(&mut self) -> Option<&'a [u8]> {
        while let Some(byte) = self.text.get(self.at) {
            if !byte.is_ascii_whitespace() {
                break;
            }
            self.breaks += usize::from(*byte == b'\n');
            self.at += 1;
        }
        self.line = self.breaks + 1;
        let rest = &self.text[self.at..];
        let length = rest.iter().position(u8::is_ascii_whitespace).unwrap_or(rest.len());
        self.at += length;
        (length > 0).then(|| &rest[..length])
    }

    /// The next word, left where it is.
    pub fn peek(&self) -> Option<&'a [u8]> {
        Self { ..*self }.next()
    }
}

/// A finite number, whose decimal separator is a point.
pub(crate) fn number(word: &[u8]) -> Option<f64> {
    std::str::from_utf8(word).ok()?.parse::<f64>().ok().filter(|v| v.is_finite())
}

/// The error with a hint, if `word` is a number with a decimal comma.
pub(crate) fn comma(word: &[u8], error: InputError) -> InputError {
    if !has_comma(word) {
        return error;
    }
    let text = String::from_utf8_lossy(word).replace(',', ".");
    error.try_instead(format!("a decimal comma? a number is written with a point: {text}"))
}

/// True for a number with a decimal comma.
pub(crate) fn has_comma(word: &[u8]) -> bool {
    let Some(at) = word.iter().position(|b| *b == b',') else { return false };
    let digit = |i: Option<usize>| i.and_then(|i| word.get(i)).is_some_and(u8::is_ascii_digit);
    let mut point = word.to_vec();
    point[at] = b'.';
    digit(at.checked_sub(1)) && digit(Some(at + 1)) && number(&point).is_some()
}

/// A word as an error shows it: readable and short.
pub(crate) fn shown(word: &[u8]) -> String {
    let text: String =
        String::from_utf8_lossy(word).chars().take(24).flat_map(char::escape_default).collect();
    if word.len() > 24 { text + "..." } else { text }
}

/// Read a raster file, of heights or of zone numbers.
pub fn raster(path: &Path) -> Result<Raster, InputError> {
    let file = path.display().to_string();
    match extension(path).as_str() {
        "asc" => asc::read(&bytes(path)?, &file),
        "tif" | "tiff" => tif::read(&bytes(path)?, &file),
        other => Err(InputError::in_file(file, format!("`.{other}` is no raster that can be read"))
            .try_instead("known are .asc and .tif")),
    }
}
