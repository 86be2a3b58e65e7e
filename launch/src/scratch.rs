//! A directory for what programs hand to each other in files, which nobody else can write to.

use crate::stop::Stop;
use interface_defs::diagnostic::code;
use rustix::process::getuid;
use std::fs::Permissions;
use std::io;
use std::os::unix::fs::{MetadataExt, PermissionsExt};
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// It is removed with what is in it when this ends.
#[derive(Debug)]
pub struct Scratch {
    dir: TempDir,
    // Dropped after what lies in them.
    _made: Made,
}

/// Directories that were not there before, the innermost first.
#[derive(Debug)]
struct Made(Vec<PathBuf>);

impl Scratch {
    /// In the directory `home` of the results, which is made if it is not there; without one, or where others can write to it too,
    /// in that of this user for such files.
    pub fn new(home: Option<&Path>) -> Result<Self, Stop> {
        let place = home.map_or_else(of_user, Path::to_path_buf);
        Self::within(&place).map_err(|e| {
            Stop::input(code::FILE, format!("{}: nothing can be written here: {e}", place.display()))
        })
    }

    fn within(place: &Path) -> io::Result<Self> {
        let missing = place.ancestors().take_while(|dir| !dir.as_os_str().is_empty() && !dir.exists());
        let made = Made(missing.map(Path::to_path_buf).collect());
        std::fs::create_dir_all(place)?;
        // Whoever can write to it can put another directory in the place of this one.
        let place = if is_closed(place) { place.to_owned() } else { of_user() };
        let own = Permissions::from_mode(0o700);
        let dir = tempfile::Builder::new()
            .prefix(".rockfall-")
            .permissions(own)
            .tempdir_in(std::path::absolute(place)?)?;
        Ok(Self { dir, _made: made })
    }

    /// A file in it.
    pub fn file(&self, name: &str) -> PathBuf {
        self.dir.path().join(name)
    }
}

impl Drop for Made {
    fn drop(&mut self) {
        // One that holds something by now stays.
        self.0.iter().for_each(|dir| drop(std::fs::remove_dir(dir)));
    }
}

/// `$XDG_RUNTIME_DIR` if it is this user's, else the directory for temporary files.
fn of_user() -> PathBuf {
    let own = std::env::var_os("XDG_RUNTIME_DIR").map(PathBuf::from).filter(|dir| is_closed(dir));
    own.unwrap_or_else(std::env::temp_dir)
}

/// Whether a directory is this user's, and nobody else can write to it.
fn is_closed(dir: &Path) -> bool {
    let closed =
        |it: std::fs::Metadata| it.is_dir() && it.uid() == getuid().as_raw() && it.mode() & 0o022 == 0;
    dir.metadata().is_ok_and(closed)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_closed_to_others_and_leaves_nothing_behind() {
        let temp = tempfile::tempdir().expect("a directory");
        let home = temp.path().join("out/study");
        let scratch = Scratch::new(Some(&home)).expect("made");
        let file = scratch.file("member.toml");
        std::fs::write(&file, "x").expect("written");
        let dir = file.parent().expect("a directory").metadata().expect("there");
        assert_eq!((dir.mode() & 0o777, dir.uid()), (0o700, getuid().as_raw()));
        drop(scratch);
        assert!(!temp.path().join("out").exists());
        std::fs::create_dir(temp.path().join("out")).expect("made");
        let scratch = Scratch::new(Some(&home)).expect("made");
        std::fs::write(home.join("summary.json"), "x").expect("written");
        drop(scratch);
        let left: Vec<_> = std::fs::read_dir(&home).expect("kept").collect();
        assert_eq!(left.len(), 1, "{left:?}");
    }

    #[test]
    fn two_of_one_directory_are_two() {
        let temp = tempfile::tempdir().expect("a directory");
        std::fs::set_permissions(temp.path(), Permissions::from_mode(0o755)).expect("set");
        let [one, other] = [0; 2].map(|_| Scratch::new(Some(temp.path())).expect("made"));
        assert_ne!(one.file("a"), other.file("a"));
        assert!(one.file("a").starts_with(temp.path()));
        std::fs::set_permissions(temp.path(), Permissions::from_mode(0o777)).expect("set");
        let elsewhere = Scratch::new(Some(temp.path())).expect("made");
        assert!(!elsewhere.file("a").starts_with(temp.path()), "others could put something else there");
    }
}
