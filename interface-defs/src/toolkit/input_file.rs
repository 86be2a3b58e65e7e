//! Input files: what stands at a path is a file, or an error says what else it is, or which name may be meant; which files a
//! scene names, and their hashes.

use super::explain::nearest;
use super::files;
use super::scene::Scene;
use crate::diagnostic::{Diagnostic, code};
use crate::ipc::run_id::fnv1a;
use std::fs::Metadata;
use std::io::ErrorKind;
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

/// Hash of a file's bytes, as records of what was computed have it.
pub fn hash(bytes: &[u8]) -> String {
    format!("fnv1a64:{:016x}", fnv1a(bytes))
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

/// What is known of the regular file at `path`; whoever opened a pipe in its place would wait for ever.
pub fn regular(path: &Path) -> Result<Metadata, Diagnostic> {
    let refuse = |what: String| Diagnostic::in_file(path.display().to_string(), what);
    let data = std::fs::metadata(path).map_err(|e| match e.kind() {
        ErrorKind::NotFound => refuse("there is no such file".into()).try_if(near(path)),
        _ => refuse(format!("the file cannot be read: {e}")),
    })?;
    if data.is_dir() {
        return Err(refuse("this is a directory".into()).try_instead("name the file in it"));
    }
    if !data.is_file() {
        return Err(refuse("this is no file: a device, a pipe or a socket".into()));
    }
    Ok(data)
}

/// All of the file of a user at `path`, which may have `limit` bytes.
pub fn read(path: &Path, limit: u64) -> Result<Vec<u8>, Diagnostic> {
    regular(path)?;
    files::read_input(path, limit).map_err(|e| {
        Diagnostic::in_file(path.display().to_string(), format!("the file cannot be read: {e}"))
            .coded(code::FILE)
    })
}

/// The name in the same directory that is nearest to that of `path`.
fn near(path: &Path) -> Option<String> {
    let name = path.file_name()?.to_string_lossy().into_owned();
    if cfg!(unix) && name.contains('\\') {
        return Some(format!("write directories with /: {}", path.display().to_string().replace('\\', "/")));
    }
    let dir = path.parent().filter(|d| !d.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let Ok(entries) = std::fs::read_dir(dir) else {
        return Some(format!("there is no directory {} either", dir.display()));
    };
    let mut names: Vec<_> = entries.flatten().map(|e| e.file_name().to_string_lossy().into_owned()).collect();
    names.sort_unstable();
    nearest(&name, &names).map(|near| format!("did you mean {near}, which lies there?"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_file_is_named_and_what_is_missing_gets_the_nearest_name() {
        let dir = tempfile::tempdir().expect("a directory");
        let of = |name: &str| regular(&dir.path().join(name)).map(|_| ()).map_err(|e| e.to_string());
        std::fs::write(dir.path().join("slope.asc"), "x").expect("written");
        assert_eq!(of("slope.asc"), Ok(()));
        assert!(of("slop.asc").expect_err("missing").ends_with("did you mean slope.asc, which lies there?"));
        assert!(of("other.tif").expect_err("missing").ends_with("there is no such file"));
        #[cfg(unix)]
        assert!(of("data\\slope.asc").expect_err("missing").ends_with("data/slope.asc"));
        assert!(of("no/slope.asc").expect_err("missing").contains("there is no directory"));
        assert!(of("").expect_err("itself").ends_with("this is a directory; name the file in it"));
        assert_eq!(read(&dir.path().join("slope.asc"), 1), Ok(b"x".to_vec()));
        assert_eq!(read(&dir.path().join("slope.asc"), 0).expect_err("too long").code, code::FILE);
        assert!(read(Path::new("/dev/zero"), 1).is_err());
        assert!(regular(Path::new("/dev/null")).expect_err("a device").to_string().contains("a device"));
    }
}
