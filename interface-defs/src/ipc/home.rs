//! The private directory of this user's runs: locks, and what iceoryx2 keeps on disk.
//!
//! It is `$XDG_RUNTIME_DIR/rockfall` where that directory is there and ours alone, else `/tmp/rockfall-<uid>`. `/tmp` is
//! everyone's, and the name can be guessed: another user may have put a directory, a link or a pipe there first. So the
//! directory is looked at anew at every use (a real directory, ours, closed to others), and so is every entry. Nothing is
//! removed whose name is not the id of a run, and no link is followed.

use super::run_id::RunId;
use crate::participant::Failure;
use rustix::fs::{AtFlags, FileType, FlockOperation, Mode, OFlags, Stat};
use rustix::io::Errno;
use std::collections::BTreeSet;
use std::ffi::OsString;
use std::fmt::Display;
use std::fs::{File, TryLockError};
use std::io::Read;
use std::os::fd::OwnedFd;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};

/// Closed to everyone else.
const PRIVATE: Mode = Mode::RWXU;

/// Flags of every entry that is opened: a link is refused, a pipe does not block, no child inherits it.
pub(crate) const ENTRY: OFlags = OFlags::NOFOLLOW.union(OFlags::NONBLOCK).union(OFlags::CLOEXEC);

/// Longest path of the directory [bytes]: with the names of a run behind it, a socket's address (107) is full.
const LONGEST: usize = 30;

/// The directory, open and checked.
#[derive(Debug)]
pub(crate) struct Home {
    path: PathBuf,
    directory: OwnedFd,
}

/// Where the directory of this user may lie, the best place first.
pub(crate) fn places() -> Vec<PathBuf> {
    // Not the temporary directory of the environment: its path may be too long.
    let shared = PathBuf::from(format!("/tmp/rockfall-{}", user()));
    runtime(std::env::var_os("XDG_RUNTIME_DIR")).into_iter().chain([shared]).collect()
}

/// The place in the runtime directory, if that is a directory of ours that lets nobody else in.
fn runtime(directory: Option<OsString>) -> Option<PathBuf> {
    let directory = PathBuf::from(directory?);
    let stat = rustix::fs::lstat(&directory).ok()?;
    let ours = stat.st_uid == user() && FileType::from_raw_mode(stat.st_mode).is_dir();
    let closed = Mode::from_raw_mode(stat.st_mode).intersection(Mode::RWXG | Mode::RWXO).is_empty();
    let place = directory.join("rockfall");
    let fits = place.is_absolute() && place.as_os_str().len() <= LONGEST;
    (ours && closed && fits).then_some(place)
}

/// The first of `places` where `work` finds what it looks for. An error: there is none that could be used.
pub(crate) fn first<T>(
    places: &[PathBuf],
    mut work: impl FnMut(&Path) -> Result<Option<T>, Failure>,
) -> Result<Option<T>, Failure> {
    let mut outcome = Ok(None);
    let mut usable = false;
    for place in places {
        match work(place) {
            Ok(Some(found)) => return Ok(Some(found)),
            Ok(None) => usable = true,
            Err(e) if outcome.is_ok() => outcome = Err(e),
            Err(_) => {}
        }
    }
    if usable { Ok(None) } else { outcome }
}

impl Home {
    /// The directory at `path`, if there is one. A mode that lets others in is repaired; what is no directory of ours
    /// is refused.
    pub fn open(path: &Path) -> Result<Option<Self>, Failure> {
        let flags = OFlags::RDONLY | OFlags::DIRECTORY | OFlags::NOFOLLOW | OFlags::CLOEXEC;
        let directory = match rustix::fs::open(path, flags, Mode::empty()) {
            Ok(directory) => directory,
            Err(Errno::NOENT) => return Ok(None),
            Err(Errno::NOTDIR | Errno::LOOP) => return Err(refused(path, "it is a file or a link")),
            Err(e) => return Err(refused(path, format!("it cannot be opened: {e}"))),
        };
        let stat = rustix::fs::fstat(&directory).map_err(|e| refused(path, e))?;
        owned(path, &stat)?;
        if Mode::from_raw_mode(stat.st_mode) != PRIVATE {
            rustix::fs::fchmod(&directory, PRIVATE).map_err(|e| {
                refused(path, format!("its mode {:o} cannot be changed to 700: {e}", stat.st_mode & 0o7777))
            })?;
        }
        Ok(Some(Self { path: path.to_owned(), directory }))
    }

    /// The same, created if it is not there.
    pub fn create(path: &Path) -> Result<Self, Failure> {
        match rustix::fs::mkdir(path, PRIVATE) {
            Ok(()) | Err(Errno::EXIST) => {}
            Err(e) => return Err(refused(path, format!("it cannot be created: {e}"))),
        }
        Self::open(path)?.ok_or_else(|| refused(path, "it was removed this moment"))
    }

    /// Whether nobody else begins or removes a run here, for as long as this lives.
    pub fn reserve(&self) -> bool {
        rustix::fs::flock(&self.directory, FlockOperation::NonBlockingLockExclusive).is_ok()
    }

    /// The lock of run `id`, created if asked for; `None` if there is none.
    pub fn lock(&self, id: &RunId, create: bool) -> Result<Option<File>, Failure> {
        let access = if create { OFlags::RDWR | OFlags::CREATE } else { OFlags::RDONLY };
        let name = lock_name(id);
        let path = self.path.join(&name);
        let file = match rustix::fs::openat(&self.directory, &name, access | ENTRY, Mode::RUSR | Mode::WUSR) {
            Ok(file) => file,
            Err(Errno::NOENT) => return Ok(None),
            Err(Errno::LOOP) => return Err(refused(&path, "it is a link")),
            Err(e) => return Err(refused(&path, e)),
        };
        let stat = rustix::fs::fstat(&file).map_err(|e| refused(&path, e))?;
        owned(&path, &stat)?;
        if !FileType::from_raw_mode(stat.st_mode).is_file() {
            return Err(refused(&path, "it is no regular file"));
        }
        Ok(Some(file.into()))
    }

    /// What the owner of run `id` has written into its lock; `None` if nobody owns it.
    pub fn owner(&self, id: &RunId) -> Result<Option<String>, Failure> {
        let Some(lock) = self.lock(id, false)? else { return Ok(None) };
        if !matches!(lock.try_lock_shared(), Err(TryLockError::WouldBlock)) {
            return Ok(None);
        }
        let mut text = String::new();
        // Nothing longer was written: a name in shared memory.
        lock.take(64).read_to_string(&mut text).map_err(|e| refused(&self.path.join(lock_name(id)), e))?;
        Ok(Some(text))
    }

    /// Whether `file` is still the lock of run `id`: a cleaner may have removed it between opening and locking.
    pub fn is_lock(&self, id: &RunId, file: &File) -> bool {
        let named = rustix::fs::statat(&self.directory, lock_name(id), AtFlags::SYMLINK_NOFOLLOW);
        let same =
            |named: Stat| file.metadata().is_ok_and(|f| (f.dev(), f.ino()) == (named.st_dev, named.st_ino));
        named.is_ok_and(same)
    }

    /// Remove the directory of run `id`, if it is ours; its lock stays. Only who holds the lock may. Returns whether something of
    /// that name is left.
    pub fn remove_remains(&self, id: &RunId) -> bool {
        let stat = || rustix::fs::statat(&self.directory, id.as_str(), AtFlags::SYMLINK_NOFOLLOW);
        if stat().is_ok_and(|s| s.st_uid == user() && FileType::from_raw_mode(s.st_mode).is_dir()) {
            // Follows no link below it either.
            let _ = std::fs::remove_dir_all(self.path.join(id.as_str()));
        }
        stat().is_ok()
    }

    /// Remove the lock of run `id`. Only who holds it may.
    pub fn remove_lock(&self, id: &RunId) {
        let _ = rustix::fs::unlinkat(&self.directory, lock_name(id), AtFlags::empty());
    }

    /// Remove what dead runs left behind here; returns their ids. Only who has reserved it may.
    pub fn clean(&self) -> BTreeSet<String> {
        let mut ids = BTreeSet::new();
        for entry in std::fs::read_dir(&self.path).into_iter().flatten().flatten() {
            let name = entry.file_name();
            let Some(name) = name.to_str() else { continue };
            let id = match name.strip_suffix(".lock") {
                Some(stem) => stem,
                None if entry.file_type().is_ok_and(|kind| kind.is_dir()) => name,
                None => continue,
            };
            // What is no id of a run is none of ours, and may be a path: `..` would lead out of here.
            if id.parse::<RunId>().is_ok() {
                ids.insert(id.to_owned());
            }
        }
        ids.retain(|id| id.parse().is_ok_and(|id| self.remove_if_dead(&id)));
        ids
    }

    /// The lock is held meanwhile, so that no coupler takes the id over; shared, since a waiting solver takes who holds it alone
    /// for the coupler.
    fn remove_if_dead(&self, id: &RunId) -> bool {
        let Ok(Some(lock)) = self.lock(id, true) else { return false };
        let dead = lock.try_lock_shared().is_ok() && self.is_lock(id, &lock);
        if dead {
            self.remove_remains(id);
            self.remove_lock(id);
        }
        dead
    }
}

fn lock_name(id: &RunId) -> String {
    format!("{id}.lock")
}

pub(crate) fn user() -> u32 {
    rustix::process::getuid().as_raw()
}

fn owned(path: &Path, stat: &Stat) -> Result<(), Failure> {
    if stat.st_uid == user() {
        return Ok(());
    }
    Err(refused(path, format!("it belongs to user {}, and you are user {}", stat.st_uid, user())))
}

/// Something that is not ours lies where ours must be: the run ends with this message, and nothing is removed.
fn refused(path: &Path, why: impl Display) -> Failure {
    Failure::Transport(format!(
        "{} must be a private place of your own: {why}; remove it, or have its owner remove it, or set $XDG_RUNTIME_DIR \
         to a short path of a directory of yours with mode 700",
        path.display()
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use rustix::fs::CWD;
    use std::os::unix::fs::{PermissionsExt, symlink};

    /// A directory of its own, and a file beside it that must survive everything.
    struct Bench(tempfile::TempDir);

    impl Bench {
        fn new() -> Self {
            let place = Self(tempfile::tempdir().expect("a directory"));
            std::fs::write(place.0.path().join("beside"), "precious").expect("written");
            place
        }

        fn path(&self) -> PathBuf {
            self.0.path().join("home")
        }

        fn home(&self) -> Home {
            Home::create(&self.path()).expect("created")
        }

        fn nothing_lost(&self) {
            assert_eq!(std::fs::read_to_string(self.0.path().join("beside")).expect("kept"), "precious");
        }
    }

    fn pipe(path: &Path) {
        rustix::fs::mknodat(CWD, path, FileType::Fifo, Mode::RUSR | Mode::WUSR, 0).expect("a pipe");
    }

    fn message(failure: Failure) -> String {
        failure.to_string()
    }

    #[test]
    fn a_lock_whose_stem_leads_out_removes_nothing() {
        let place = Bench::new();
        let home = place.home();
        for name in ["...lock", "..lock", ".lock", "a.b.lock", "12345678901234567.lock"] {
            std::fs::write(place.path().join(name), "").expect("written");
        }
        std::fs::create_dir(place.path().join("not.an.id")).expect("created");
        assert!(home.clean().is_empty());
        place.nothing_lost();
        assert!(place.path().join("not.an.id").exists() && place.path().join("...lock").exists());
    }

    #[test]
    fn what_dead_runs_left_is_removed_and_links_are_not_followed() {
        let place = Bench::new();
        let home = place.home();
        std::fs::create_dir_all(place.path().join("dead/nodes")).expect("created");
        symlink(place.0.path(), place.path().join("dead/nodes/out")).expect("linked");
        std::fs::create_dir(place.path().join("orphan")).expect("created");
        std::fs::write(place.path().join("dead.lock"), "").expect("written");
        // A directory and a lock that are links to what is precious.
        symlink(place.0.path(), place.path().join("linked")).expect("linked");
        symlink(place.0.path().join("beside"), place.path().join("link.lock")).expect("linked");
        assert_eq!(home.clean().into_iter().collect::<Vec<_>>(), ["dead", "orphan"]);
        assert!(!place.path().join("dead").exists() && !place.path().join("dead.lock").exists());
        place.nothing_lost();
        let id = "link".parse().expect("an id");
        assert!(
            message(home.lock(&id, true).expect_err("a link")).contains("link.lock must be a private place")
        );
    }

    #[test]
    fn a_pipe_in_the_place_of_a_lock_blocks_nobody() {
        let place = Bench::new();
        let home = place.home();
        pipe(&place.path().join("pipe.lock"));
        let id = "pipe".parse().expect("an id");
        for create in [false, true] {
            let text = message(home.lock(&id, create).expect_err("a pipe"));
            assert!(text.contains("pipe.lock") && text.contains("no regular file"), "{text}");
        }
        assert!(home.clean().is_empty());
    }

    #[test]
    fn a_link_a_file_or_a_pipe_in_the_place_of_the_directory_is_refused() {
        let put: [fn(&Path); 3] = [
            |path| symlink(path.parent().expect("a parent"), path).expect("linked"),
            |path| std::fs::write(path, "").expect("written"),
            pipe,
        ];
        for put in put {
            let place = Bench::new();
            put(&place.path());
            let text = message(Home::create(&place.path()).expect_err("refused"));
            assert!(
                text.contains("home must be a private place") && text.contains("a file or a link"),
                "{text}"
            );
            assert!(Home::open(&place.path()).is_err());
            place.nothing_lost();
        }
    }

    #[test]
    fn a_mode_that_lets_others_in_is_repaired() {
        let place = Bench::new();
        std::fs::create_dir(place.path()).expect("created");
        for mode in [0o777, 0o1777, 0o755, 0o500] {
            std::fs::set_permissions(place.path(), std::fs::Permissions::from_mode(mode)).expect("changed");
            Home::open(&place.path()).expect("repaired").expect("there");
            let now = std::fs::metadata(place.path()).expect("there").permissions().mode();
            assert_eq!(now & 0o7777, 0o700, "{mode:o}");
        }
    }

    #[test]
    fn what_belongs_to_someone_else_is_refused_and_left_alone() {
        if user() != 0 {
            return; // Only root can give a file away.
        }
        let stranger = Some(rustix::fs::Uid::from_raw(65534));
        let place = Bench::new();
        let home = place.home();
        let lock = place.path().join("theirs.lock");
        let dir = place.path().join("theirs");
        std::fs::write(&lock, "").expect("written");
        std::fs::create_dir(&dir).expect("created");
        for path in [&lock, &dir] {
            rustix::fs::chown(path, stranger, None).expect("given away");
        }
        let id = "theirs".parse().expect("an id");
        let text = message(home.lock(&id, true).expect_err("theirs"));
        assert!(text.contains("belongs to user 65534"), "{text}");
        home.remove_remains(&id);
        assert!(home.clean().is_empty() && lock.exists() && dir.exists());
        rustix::fs::chown(place.path(), stranger, None).expect("given away");
        let text = message(Home::create(&place.path()).expect_err("theirs"));
        assert!(text.contains("home must be") && text.contains("belongs to user 65534"), "{text}");
    }

    #[test]
    fn the_runtime_directory_is_used_where_it_is_ours_alone() {
        let place = Bench::new();
        let short =
            tempfile::Builder::new().prefix("x").rand_bytes(4).tempdir_in("/tmp").expect("a directory");
        let used = || runtime(Some(short.path().into()));
        let mode = |mode| {
            std::fs::set_permissions(short.path(), std::fs::Permissions::from_mode(mode)).expect("changed");
        };
        mode(0o700);
        assert_eq!(used(), Some(short.path().join("rockfall")));
        for open in [0o755, 0o770, 0o702] {
            mode(open);
            assert_eq!(used(), None, "{open:o}");
        }
        mode(0o700);
        let link = place.0.path().join("l");
        symlink(short.path(), &link).expect("linked");
        let long = short.path().join("a-directory-of-a-long-name");
        std::fs::create_dir(&long).expect("created");
        std::fs::set_permissions(&long, std::fs::Permissions::from_mode(0o700)).expect("changed");
        for refused in [link, long, "no-such".into(), "".into(), place.0.path().join("beside")] {
            assert_eq!(runtime(Some(refused.clone().into())), None, "{}", refused.display());
        }
        assert_eq!(runtime(None), None);
        if user() == 0 {
            rustix::fs::chown(short.path(), Some(rustix::fs::Uid::from_raw(65534)), None)
                .expect("given away");
            assert_eq!(used(), None);
            rustix::fs::chown(short.path(), Some(rustix::fs::Uid::from_raw(0)), None).expect("taken back");
        }
    }

    #[test]
    fn a_place_that_is_not_ours_is_passed_over_for_one_that_is() {
        let place = Bench::new();
        let places = [place.0.path().join("beside"), place.path()];
        let created = |path: &Path| Home::create(path).map(|_| Some(path.to_owned()));
        assert_eq!(first(&places, created).expect("the second"), Some(place.path()));
        let text = message(first(&places[..1], created).expect_err("refused"));
        assert!(
            text.contains("beside must be a private place") && text.contains("$XDG_RUNTIME_DIR"),
            "{text}"
        );
        assert_eq!(first(&places, |path| Home::open(path).map(|_| None::<()>)).expect("one is usable"), None);
    }

    #[test]
    fn one_begins_or_cleans_at_a_time() {
        let place = Bench::new();
        let (one, other) = (place.home(), place.home());
        assert!(one.reserve() && !other.reserve());
        drop(one);
        assert!(other.reserve());
    }
}
