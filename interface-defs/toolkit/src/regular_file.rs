//! What stands at the path of an input file is a regular file, or an error says what else it is, or which name may be meant.

use super::explain::nearest;
use super::files;
use interface_defs::{Diagnostic, code, ipc::run_id::fnv1a};
use std::fs::Metadata;
use std::io::ErrorKind;
use std::path::Path;

/// Hash of a file's bytes, as records of what was computed have it.
pub fn hash(bytes: &[u8]) -> String {
    format!("fnv1a64:{:016x}", fnv1a(bytes))
}

/// What is known of the regular file at `path`; whoever opened a pipe in its place would wait for ever.
pub fn regular(path: &Path) -> Result<Metadata, Diagnostic> {
    let refuse = |what: String| Diagnostic::in_file(path.display(), what);
    let data = std::fs::metadata(path).map_err(|e| match e.kind() {
        ErrorKind::NotFound => refuse("there is no such file".into()).try_if(near(path)),
        _ => refuse(format!("the file cannot be read: {e}")),
    })?;
    if data.is_dir() && path.as_os_str().as_encoded_bytes().ends_with(b"/") {
        return Err(refuse("this is a directory: the path is empty, or ends with /".into())
            .try_instead("name the file in it"));
    }
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
        Diagnostic::in_file(path.display(), format!("the file cannot be read: {e}")).coded(code::FILE)
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
        assert!(
            of("").expect_err("itself").contains("the path is empty, or ends with /; name the file in it")
        );
        assert_eq!(read(&dir.path().join("slope.asc"), 1), Ok(b"x".to_vec()));
        assert_eq!(read(&dir.path().join("slope.asc"), 0).expect_err("too long").code, code::FILE);
        assert!(read(Path::new("/dev/zero"), 1).is_err());
        assert!(regular(Path::new("/dev/null")).expect_err("a device").to_string().contains("a device"));
    }
}
