//! Input files: which of them a scene names, and what stands at their paths.

pub use super::regular_file::{hash, read, regular};
use super::scene::Scene;
use interface_defs::diagnostic::Diagnostic;
use std::path::{Path, PathBuf};
use toml::{Table, Value};

/// Keys of a scene whose text is never the path of an input file.
pub const NO_FILES: [&str; 2] = ["title", "processes"];

/// Make every path in `table` absolute that names a file from where `scene` lies: then it can be read from anywhere.
pub fn with_absolute_files(table: &mut Table, scene: &Scene) -> Result<(), Diagnostic> {
    let mut unnamed = None;
    for (_, value) in table.iter_mut().filter(|(key, _)| !NO_FILES.contains(&key.as_str())) {
        texts(value, &mut |text| {
            let path = scene.resolve(Path::new(text));
            // A rock that is named `rock` is no file, even where one of that name lies beside the scene.
            if text.contains(['.', '/'])
                && path.is_file()
                && let Ok(absolute) = std::path::absolute(path)
            {
                match absolute.to_str() {
                    Some(path) => *text = path.to_owned(),
                    None => unnamed = Some(absolute),
                }
            }
        });
    }
    match unnamed {
        None => Ok(()),
        Some(path) => {
            let what = format!("the path {} is not UTF-8 text, and a scene cannot name it", path.display());
            Err(Diagnostic::new(what).try_instead("rename the directory, or move the scene and its files"))
        }
    }
}

/// The files that a table names by their absolute paths, as [`with_absolute_files`] leaves it.
pub fn named_files(table: &Table) -> Vec<PathBuf> {
    let mut files = Vec::new();
    for (_, value) in table.iter().filter(|(key, _)| !NO_FILES.contains(&key.as_str())) {
        texts(&mut value.clone(), &mut |text| {
            let path = Path::new(text.as_str());
            if path.is_absolute() && path.is_file() {
                files.push(path.to_owned());
            }
        });
    }
    files
}

/// Every text below `value`.
pub fn texts(value: &mut Value, visit: &mut impl FnMut(&mut String)) {
    match value {
        Value::String(text) => visit(text),
        Value::Array(items) => items.iter_mut().for_each(|item| texts(item, visit)),
        Value::Table(table) => table.iter_mut().for_each(|(_, inner)| texts(inner, visit)),
        _ => {}
    }
}
