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
use toolkit::explain::suggestion;
use toolkit::input_file;
use toolkit::scene::Scene;

/// Longest file that is read [bytes]: positions in a mesh are 32 bits wide.
const LONGEST: u64 = 4 << 30;

/// Format of a mesh file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// Gmsh.
    Msh,
    /// CalculiX, Abaqus.
    Inp,
    /// Kratos.
    Mdpa,
}

/// Reads the text of the file with a name.
type Parser = fn(&str, &str) -> Result<Mesh, Diagnostic>;

/// Each format, in the order of [`Format`]: its extension, programs that write it, and its reader.
const FORMATS: [(Format, &str, &str, Parser); 3] = [
    (Format::Msh, "msh", "Gmsh", msh::parse),
    (Format::Inp, "inp", "CalculiX, Abaqus", inp::parse),
    (Format::Mdpa, "mdpa", "Kratos", mdpa::parse),
];

impl Format {
    /// The format that the extension of `path` stands for.
    pub fn of(path: &Path) -> Option<Self> {
        let own = path.extension()?.to_str()?.to_ascii_lowercase();
        FORMATS.iter().find(|(_, extension, ..)| *extension == own).map(|format| format.0)
    }
}

/// The formats in words.
pub(crate) fn known() -> String {
    let words = FORMATS.map(|(_, extension, programs, _)| format!(".{extension} ({programs})"));
    let (last, others) = words.split_last().expect("there are formats");
    format!("{} and {last}", others.join(", "))
}

/// The path of the file that `key` of `scene` names, which must be there; `what` it is.
pub(crate) fn named(scene: &Scene, key: &str, what: &str, path: &Path) -> Result<PathBuf, Diagnostic> {
    let path = scene.resolve(path);
    if path.exists() {
        return Ok(path);
    }
    scene.refuse(
        key,
        format!("there is no {what} {}", path.display()),
        "the path counts from the directory of the scene file",
    )
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
    FORMATS[format as usize].3(file, &text)
}

/// Hint for `name`, which is none of the `known` ones; `none` where there are none.
pub(crate) fn nearest(name: &str, known: &[&str], none: &str) -> String {
    if known.is_empty() { none.into() } else { suggestion(name, known).unwrap_or_default() }
}

/// Key of a table in the scene, for messages.
pub struct Key<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// Its dotted path in it.
    pub key: String,
}

impl<'a> Key<'a> {
    /// The entries of a list of `[structure]`, each with its key.
    pub fn each<T>(scene: &'a Scene, list: &str, entries: &'a [T]) -> impl Iterator<Item = (Self, &'a T)> {
        let key = move |(i, entry)| (Self { scene, key: format!("structure.{list}.{i}") }, entry);
        entries.iter().enumerate().map(key)
    }
}

impl Key<'_> {
    /// The path of its key `name`.
    pub fn at(&self, name: &str) -> String {
        format!("{}.{name}", self.key)
    }

    /// Each of these numbers, by its key, must be finite and lie above 0; the last is its unit.
    pub fn positive(&self, numbers: &[(&str, f64, &str)]) -> Result<(), Diagnostic> {
        self.all(numbers, |value| value > 0.0, "lie above 0")
    }

    /// Each of these numbers must be finite and not below 0, likewise.
    pub fn not_negative(&self, numbers: &[(&str, f64, &str)]) -> Result<(), Diagnostic> {
        self.all(numbers, |value| value >= 0.0, "not lie below 0")
    }

    fn all(
        &self,
        numbers: &[(&str, f64, &str)],
        fits: fn(f64) -> bool,
        must: &str,
    ) -> Result<(), Diagnostic> {
        let wrong = numbers.iter().find(|(_, value, _)| !(fits(*value) && value.is_finite()));
        let Some((name, value, unit)) = wrong else { return Ok(()) };
        Err(self.invalid(name, format!("{} is {value} {unit}, it must {must}", self.at(name))))
    }

    /// The key `name` is at fault.
    pub fn invalid(&self, name: &str, what: impl Into<String>) -> Diagnostic {
        self.scene.invalid(&self.at(name), what)
    }

    /// The same, as an error with what to try instead.
    pub(crate) fn refuse<T>(
        &self,
        name: &str,
        what: impl Into<String>,
        hint: impl Into<String>,
    ) -> Result<T, Diagnostic> {
        self.scene.refuse(&self.at(name), what, hint)
    }
}
