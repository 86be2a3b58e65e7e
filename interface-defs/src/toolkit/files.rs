//! Files that are there as a whole or not at all.

use std::fs::File;
use std::io::{self, Write};
use std::path::Path;
use std::time::SystemTime;

/// Write `bytes` to `path`: beside it, synced, then renamed, then the directory synced. Nobody reads half of it, not
/// even after a power cut. A file that could not be written leaves the old one as it was.
pub fn write(path: &Path, bytes: &[u8]) -> io::Result<()> {
    by_way_of(".tmp", path, bytes)
}

/// The same where other processes, of other machines too, may write the same file at the same time: each goes by a name of its own. A
/// process that is killed in the middle leaves that behind.
pub fn write_among_others(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let time = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default();
    by_way_of(&format!(".{}-{}.tmp", std::process::id(), time.as_nanos()), path, bytes)
}

fn by_way_of(ending: &str, path: &Path, bytes: &[u8]) -> io::Result<()> {
    let mut name = path.file_name().unwrap_or_default().to_owned();
    name.push(ending);
    let beside = path.with_file_name(name);
    let written = synced(&beside, bytes).and_then(|()| std::fs::rename(&beside, path));
    if written.is_err() {
        let _ = std::fs::remove_file(&beside);
    }
    written?;
    sync_directory(path)
}

fn synced(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let mut file = File::create(path)?;
    file.write_all(bytes)?;
    file.sync_all()
}

fn sync_directory(path: &Path) -> io::Result<()> {
    let dir = path.parent().filter(|dir| !dir.as_os_str().is_empty()).unwrap_or(Path::new("."));
    match File::open(dir)?.sync_all() {
        // Some network file systems cannot sync a directory.
        Err(e) if e.kind() == io::ErrorKind::InvalidInput => Ok(()),
        other => other,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn many_may_write_one_file_at_once() {
        let temp = tempfile::tempdir().expect("a directory");
        let path = temp.path().join("study.json");
        std::thread::scope(|scope| {
            for _ in 0..8 {
                scope.spawn(|| {
                    (0..50).for_each(|_| write_among_others(&path, b"all the same").expect("written"))
                });
            }
        });
        assert_eq!(std::fs::read(&path).expect("there"), b"all the same");
        assert_eq!(std::fs::read_dir(temp.path()).expect("listed").count(), 1);
    }

    #[test]
    fn a_file_is_replaced_as_a_whole_and_nothing_is_left_beside_it() {
        let temp = tempfile::tempdir().expect("a directory");
        let path = temp.path().join("summary.json");
        write(&path, b"old").expect("written");
        write(&path, b"new").expect("written");
        assert_eq!(std::fs::read(&path).expect("there"), b"new");
        // A directory in the place of the file cannot be replaced: what was begun is removed.
        std::fs::create_dir(temp.path().join("taken")).expect("created");
        assert!(write(&temp.path().join("taken"), b"x").is_err());
        let mut names: Vec<_> = std::fs::read_dir(temp.path())
            .expect("listed")
            .map(|entry| entry.expect("an entry").file_name().into_string().expect("text"))
            .collect();
        names.sort();
        assert_eq!(names, ["summary.json", "taken"]);
    }
}
