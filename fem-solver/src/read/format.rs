//! What a reader of mesh files is.

use super::mesh::Mesh;
use interface_defs::diagnostic::Diagnostic;

/// A format of mesh files. Coordinates are in metres; cells and groups go into a [`super::mesh::Builder`].
pub trait MeshFormat {
    /// Programs that write it, for messages.
    const PROGRAMS: &str;

    /// Refuse what its first lines, which are text in any case, say not to be text.
    fn refuse_binary(_file: &str, _text: &str) -> Result<(), Diagnostic> {
        Ok(())
    }

    /// Read a mesh from its text; `file` is its name in errors.
    fn parse(file: &str, text: &str) -> Result<Mesh, Diagnostic>;
}
