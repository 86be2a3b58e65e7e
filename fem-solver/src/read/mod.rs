//! Structures as users bring them: mesh files of other programs.
//!
//! - [`mesh`]: what every reader gives: nodes, elements, named groups
//! - [`msh`]: Gmsh, versions 2.2 and 4.1, ASCII
//! - [`inp`]: CalculiX and Abaqus
//! - [`mdpa`]: the meshes of Kratos
//! - [`heights`]: heights of the ground on a grid
//! - [`tokens`]: words of a text and the lines on which they stand
//!
//! Coordinates are taken as metres. A file is read in time and memory proportional to its length, whatever
//! the counts in it claim; what is wrong with it is one error with file and line.
//!
//! Readers of our own: the crates that there are for `.msh` read one of the two versions or lose the
//! physical names, and for the other two formats there are none.

pub mod heights;
pub mod inp;
pub mod mdpa;
pub mod mesh;
pub mod msh;
pub mod tokens;

use interface_defs::diagnostic::Diagnostic;
use mesh::Mesh;
use std::borrow::Cow;
use std::path::{Path, PathBuf};
use toolkit::input_file;
use toolkit::scene::Scene;

/// Longest file that is read [bytes]: positions in a mesh are 32 bits wide.
const LONGEST: u64 = 4 << 30;

/// Declares the formats: the extension of each, and its reader.
macro_rules! formats {
    ($($extension:literal => $module:ident as $format:ident,)*) => {
        /// Format of a mesh file.
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        #[allow(missing_docs)] // Each is described where its reader is.
        pub enum Format {
            $($format,)*
        }

        impl Format {
            /// The format that the extension of `path` stands for.
            pub fn of(path: &Path) -> Option<Self> {
                match path.extension()?.to_str()?.to_ascii_lowercase().as_str() {
                    $($extension => Some(Self::$format),)*
                    _ => None,
                }
            }

            fn parse(self, file: &str, text: &str) -> Result<Mesh, Diagnostic> {
                match self {
                    $(Self::$format => $module::parse(file, text),)*
                }
            }
        }

        /// Extension of each format, and programs that write it.
        const KNOWN: &[(&str, &str)] = &[$(($extension, $module::PROGRAMS),)*];
    };
}

formats! {
    "msh" => msh as Msh,
    "inp" => inp as Inp,
    "mdpa" => mdpa as Mdpa,
}

/// The formats in words.
fn known() -> String {
    let words: Vec<String> =
        KNOWN.iter().map(|(extension, programs)| format!(".{extension} ({programs})")).collect();
    let (last, others) = words.split_last().expect("there are formats");
    format!("{} and {last}", others.join(", "))
}

/// The path of the file that `key` of `scene` names, which must be there; `what` it is.
pub(crate) fn named(scene: &Scene, key: &str, what: &str, path: &Path) -> Result<PathBuf, Diagnostic> {
    let path = scene.resolve(path);
    if path.exists() {
        return Ok(path);
    }
    Err(scene
        .invalid(key, format!("there is no {what} {}", path.display()))
        .try_instead("the path counts from the directory of the scene file"))
}

/// Read the mesh file at `path`; its extension says the format.
pub fn read(path: &Path) -> Result<Mesh, Diagnostic> {
    let file = path.display().to_string();
    let Some(format) = Format::of(path) else {
        let what = "its name does not say what kind of mesh this is";
        return Err(Diagnostic::in_file(file, what).try_instead(format!("known are {}", known())));
    };
    parse(&file, format, &input_file::read(path, LONGEST)?)
}

/// Read a mesh from the bytes of a file; `file` is its name in errors.
pub fn parse(file: &str, format: Format, bytes: &[u8]) -> Result<Mesh, Diagnostic> {
    if bytes.trim_ascii().is_empty() {
        return Err(Diagnostic::in_file(file, "the file is empty"));
    }
    // Text in an older encoding is fine where it is a comment; elsewhere it will not parse.
    let text: Cow<str> = String::from_utf8_lossy(bytes);
    if format == Format::Msh {
        msh::refuse_binary(file, &text)?;
    }
    if let Some(at) = bytes.iter().position(|b| *b == 0) {
        let line = bytes[..at].iter().filter(|b| **b == b'\n').count() + 1;
        return Err(tokens::error(file, line, "a zero byte: this is no text file")
            .try_instead("save the mesh as text (ASCII)"));
    }
    format.parse(file, &text)
}

/// An error about `key` of `scene`: what is wrong there, and what to try instead.
pub(crate) fn refuse<T>(
    scene: &Scene,
    key: &str,
    what: impl Into<String>,
    hint: impl Into<String>,
) -> Result<T, Diagnostic> {
    Err(scene.invalid(key, what).try_instead(hint))
}

/// `value` must be finite and lie above 0.
pub(crate) fn positive(scene: &Scene, key: &str, value: f64, unit: &str) -> Result<(), Diagnostic> {
    if value > 0.0 && value.is_finite() {
        return Ok(());
    }
    Err(scene.invalid(key, format!("{key} is {value} {unit}, it must lie above 0")))
}

/// `value` must be finite and not below 0.
pub(crate) fn not_negative(scene: &Scene, key: &str, value: f64, unit: &str) -> Result<(), Diagnostic> {
    if value >= 0.0 && value.is_finite() {
        return Ok(());
    }
    Err(scene.invalid(key, format!("{key} is {value} {unit}, it must not lie below 0")))
}
