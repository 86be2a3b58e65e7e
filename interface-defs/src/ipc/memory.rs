//! What a run has in shared memory: its register, its pages, and what dead runs have left there.
//!
//! `/dev/shm` is everyone's, like `/tmp`. Whatever a run has there begins with its prefix, belongs to its user and is
//! closed to others. The first of these files is its register: the coupler creates it before anything else and holds an
//! exclusive lock on it for as long as it lives. So the files of a dead run are known by themselves, whatever became of
//! the directory of the run.

use super::home::{ENTRY, user};
use super::run_id::RunId;
use super::transport;
use crate::participant::Failure;
use rustix::fs::{AtFlags, FallocateFlags, FileType, Mode, OFlags};
use rustix::io::Errno;
use signal_hook::consts::SIGBUS;
use std::collections::BTreeSet;
use std::fs::File;
use std::io::{self, Write};
use std::os::fd::OwnedFd;
use std::os::unix::fs::MetadataExt;
use std::sync::Once;

/// Where iceoryx2 keeps payloads.
pub(crate) const SHARED_MEMORY: &str = "/dev/shm";

/// The register's name behind the prefix: iceoryx2's count of nodes. It would create this one file open to all users, and
/// takes the one that is there.
const REGISTER: &str = "9204dd183d1c4d8e1ff592a30766ffa6765aa8b5_node.0_10_0.global_mgmt";

/// What stands in it: the version of iceoryx2 (0.10.0), and no node yet.
const NO_NODE: [u64; 2] = [10 << 16, 0];

/// What must stay free beside payloads [bytes].
const MARGIN: u64 = 1 << 20;

/// The lock that says that a run lives, on its register.
#[derive(Debug)]
pub(crate) struct Register {
    /// What the names of the run's files begin with.
    pub prefix: String,
    _lock: File,
}

/// The prefix of a run whose register nobody else has taken.
pub(crate) fn usual_prefix(id: &RunId) -> String {
    format!("rf_{id}_")
}

impl Register {
    /// Create that of run `id`. What a dead run of the same id has left is removed. Where another user sits on the name, the run gets a prefix
    /// that nobody can guess.
    pub fn create(id: &RunId) -> Result<Self, Failure> {
        let shared = open_all()?;
        let mut prefix = usual_prefix(id);
        for _ in 0..8 {
            remove_if_dead(&shared, &prefix);
            match create(&shared, &prefix) {
                Ok(Some(lock)) => return Ok(Self { prefix, _lock: lock }),
                Ok(None) => prefix = usual_prefix(&RunId::new()),
                Err(e) if e.kind() == io::ErrorKind::StorageFull => return Err(full()),
                Err(e) => return Err(transport(format!("cannot create a file in {SHARED_MEMORY}"))(e)),
            }
        }
        Err(Failure::Transport(format!("no name in {SHARED_MEMORY} is free for the run")))
    }

    /// Remove all that the run has in shared memory.
    pub fn remove(&self) {
        if let Ok(shared) = open_all() {
            remove(&shared, &self.prefix);
        }
    }
}

/// A register, locked; `None` if the name is taken.
fn create(shared: &OwnedFd, prefix: &str) -> io::Result<Option<File>> {
    let flags = OFlags::RDWR | OFlags::CREATE | OFlags::EXCL | ENTRY;
    let name = register(prefix);
    let mut file: File = match rustix::fs::openat(shared, &name, flags, Mode::RUSR | Mode::WUSR) {
        Ok(file) => file.into(),
        Err(Errno::EXIST) => return Ok(None),
        Err(e) => return Err(e.into()),
    };
    let locked = file.try_lock().is_ok();
    if let Err(e) = file.write_all(&NO_NODE.map(u64::to_ne_bytes).concat()) {
        let _ = rustix::fs::unlinkat(shared, &name, AtFlags::empty());
        return Err(e);
    }
    // A cleaner may have had it first, and removed it.
    let named = rustix::fs::statat(shared, &name, AtFlags::SYMLINK_NOFOLLOW);
    let still = named.is_ok_and(|named| file.metadata().is_ok_and(|f| f.ino() == named.st_ino));
    Ok((locked && still).then_some(file))
}

fn register(prefix: &str) -> String {
    format!("{prefix}{REGISTER}")
}

/// Whether the register of a run is in the shared memory that this process sees.
pub(crate) fn is_known(prefix: &str) -> bool {
    open_all()
        .is_ok_and(|shared| rustix::fs::statat(&shared, register(prefix), AtFlags::SYMLINK_NOFOLLOW).is_ok())
}

fn open_all() -> Result<OwnedFd, Failure> {
    let flags = OFlags::RDONLY | OFlags::DIRECTORY | OFlags::CLOEXEC;
    rustix::fs::open(SHARED_MEMORY, flags, Mode::empty())
        .map_err(transport(format!("cannot open {SHARED_MEMORY}")))
}

/// Names of this user's files in shared memory that begin with `prefix`. Links and what is not ours are left out.
fn ours(prefix: &str) -> impl Iterator<Item = String> {
    let entries = std::fs::read_dir(SHARED_MEMORY).into_iter().flatten().flatten();
    // Of the entry itself, not of what a link points at.
    let ours = |entry: &std::fs::DirEntry| entry.metadata().is_ok_and(|m| m.is_file() && m.uid() == user());
    let named = entries.filter_map(move |entry| {
        let name = entry.file_name().into_string().ok()?;
        ours(&entry).then_some(name)
    });
    named.filter(move |name| name.starts_with(prefix))
}

/// Remove all that begins with `prefix` unless its run lives; whether anything was removed. The register goes last.
fn remove_if_dead(shared: &OwnedFd, prefix: &str) -> bool {
    let register = register(prefix);
    let lock = match rustix::fs::openat(shared, &register, OFlags::RDONLY | ENTRY, Mode::empty()) {
        Ok(file) => Some(File::from(file)),
        Err(Errno::NOENT) => None,
        Err(_) => return false,
    };
    if lock.as_ref().is_some_and(|lock| lock.try_lock().is_err()) {
        return false;
    }
    remove(shared, prefix)
}

/// Remove all that begins with `prefix`. Only who holds its register may.
fn remove(shared: &OwnedFd, prefix: &str) -> bool {
    let register = register(prefix);
    let (mut last, others): (Vec<_>, Vec<_>) = ours(prefix).partition(|name| *name == register);
    let mut removed = false;
    for name in others.into_iter().chain(last.drain(..)) {
        removed |= rustix::fs::unlinkat(shared, name, AtFlags::empty()).is_ok();
    }
    removed
}

/// Remove what dead runs of this user have left; returns what stands for a run in their names. `lives` knows of runs whose registers
/// have no lock.
pub(crate) fn clean(lives: impl Fn(&RunId) -> bool) -> BTreeSet<String> {
    let Ok(shared) = open_all() else { return BTreeSet::new() };
    let word = |name: String| Some(name.strip_prefix("rf_")?.split_once('_')?.0.to_owned());
    let mut words: BTreeSet<String> = ours("rf_").filter_map(word).collect();
    words.retain(|word| {
        word.parse().is_ok_and(|id| !lives(&id) && remove_if_dead(&shared, &usual_prefix(&id)))
    });
    words
}

/// Have every page of the run's files from now on: one that cannot be had is SIGBUS at first touch, and no error.
pub(crate) fn allocate(prefix: &str) -> Result<(), Failure> {
    let shared = open_all()?;
    for name in ours(prefix) {
        // A file that is gone again, or that its maker has not opened yet, is none of those that carry payloads now.
        let Ok(file) = rustix::fs::openat(&shared, &name, OFlags::RDWR | ENTRY, Mode::empty()) else {
            continue;
        };
        let stat = rustix::fs::fstat(&file).map_err(transport("cannot look at shared memory"))?;
        if stat.st_size == 0 || !FileType::from_raw_mode(stat.st_mode).is_file() {
            continue;
        }
        match rustix::fs::fallocate(&file, FallocateFlags::KEEP_SIZE, 0, stat.st_size as u64) {
            Ok(()) | Err(Errno::OPNOTSUPP) => {}
            Err(Errno::NOSPC) => return Err(full()),
            Err(e) => return Err(transport("cannot allocate shared memory")(e)),
        }
    }
    Ok(())
}

/// Refuse a run whose payloads do not fit: before anything is created, since a page that cannot be had is SIGBUS.
pub(crate) fn check_space(needed: u64) -> Result<(), Failure> {
    let stat =
        rustix::fs::statvfs(SHARED_MEMORY).map_err(transport("cannot read the size of shared memory"))?;
    fits(needed + MARGIN, stat.f_bavail * stat.f_frsize)
}

fn fits(needed: u64, free: u64) -> Result<(), Failure> {
    if needed <= free {
        return Ok(());
    }
    let [needed, free] = [needed, free].map(|bytes| bytes as f64 / 1e6);
    Err(Failure::Transport(format!(
        "the interface needs {needed:.1} MB of shared memory, {SHARED_MEMORY} has {free:.1} MB free; \
         run `rockfall clean`, or enlarge it (docker: --shm-size)"
    )))
}

fn full() -> Failure {
    Failure::Transport(format!(
        "shared memory is full: {SHARED_MEMORY} has no page left for the interface; run `rockfall clean`, or enlarge it \
         (docker: --shm-size)"
    ))
}

/// What a process says that touches a page that cannot be had. It is written in a signal handler, hence no more than bytes.
const LAST_WORD: &[u8] = b"error: shared memory is full: a page of /dev/shm could not be had; run `rockfall clean`, or enlarge it \
(docker: --shm-size)\n";

/// From now on a page that cannot be had ends this process with one sentence and exit code 1, and not without a word.
pub(crate) fn end_with_a_word() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        let end = || {
            let _ = rustix::io::write(std::io::stderr(), LAST_WORD);
            signal_hook::low_level::exit(1);
        };
        // SAFETY: a write and an exit are what a signal handler may do.
        let _ = unsafe { signal_hook::low_level::register(SIGBUS, end) };
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use rustix::fs::Uid;
    use std::os::unix::fs::PermissionsExt;
    use std::path::PathBuf;

    fn path(name: &str) -> PathBuf {
        PathBuf::from(SHARED_MEMORY).join(name)
    }

    fn put(name: &str) -> PathBuf {
        std::fs::write(path(name), "x").expect("written");
        path(name)
    }

    /// Of no run that anybody else's register stands for.
    fn dead(_: &RunId) -> bool {
        false
    }

    #[test]
    fn a_payload_that_does_not_fit_is_refused_with_both_numbers() {
        assert!(fits(10, 10).is_ok());
        let message = fits(3_000_000, 2_000_000).expect_err("too large").to_string();
        assert!(message.contains("3.0 MB") && message.contains("2.0 MB free"), "{message}");
    }

    #[test]
    fn what_a_dead_run_left_is_found_by_its_name_alone() {
        let id = RunId::new();
        let register = Register::create(&id).expect("created");
        let left = put(&format!("rf_{id}_left"));
        assert!(!clean(dead).contains(id.as_str()) && left.exists(), "it lives");
        drop(register);
        // Another process may clean, too: gone is gone.
        clean(|_| true);
        clean(dead);
        assert!(!left.exists() && ours(&usual_prefix(&id)).next().is_none());
        // Without a register: of a run that a process of another version owns, or of none.
        let left = put(&format!("rf_{id}_left"));
        assert!(!clean(|_| true).contains(id.as_str()));
        let _ = std::fs::remove_file(left);
    }

    #[test]
    fn files_of_others_and_links_are_left_alone() {
        let shared = open_all().expect("there");
        let id = RunId::new();
        let beside = put(&format!("kept-{id}"));
        let link = path(&format!("rf_{id}_link"));
        std::os::unix::fs::symlink(&beside, &link).expect("linked");
        let theirs = put(&format!("rf_{id}_theirs"));
        let given = rustix::fs::chown(&theirs, Some(Uid::from_raw(65534)), None).is_ok();
        let own = put(&format!("rf_{id}_own"));
        remove_if_dead(&shared, &usual_prefix(&id));
        let left = [&own, &link, &theirs, &beside].map(|path| std::fs::symlink_metadata(path).is_ok());
        for path in [&link, &theirs, &beside] {
            let _ = std::fs::remove_file(path);
        }
        assert_eq!(left, [false, true, given, true]);
    }

    #[test]
    fn a_register_whose_name_is_taken_gets_another_that_cannot_be_guessed() {
        if user() != 0 {
            return; // Only root can give a file away.
        }
        let id = RunId::new();
        let squatted = put(&register(&usual_prefix(&id)));
        rustix::fs::chown(&squatted, Some(Uid::from_raw(65534)), None).expect("given away");
        let register = Register::create(&id).expect("sidestepped");
        assert_ne!(register.prefix, usual_prefix(&id));
        register.remove();
        assert_eq!(std::fs::read(&squatted).expect("left alone"), b"x");
        std::fs::remove_file(squatted).expect("removed");
    }

    #[test]
    fn pages_are_had_from_the_start() {
        let id = RunId::new();
        let sparse = put(&format!("rf_{id}_sparse"));
        let file = File::options().write(true).open(&sparse).expect("opened");
        file.set_len(1 << 20).expect("sparse");
        let blocks = || std::fs::metadata(&sparse).expect("there").blocks() * 512;
        assert!(blocks() < 1 << 20);
        allocate(&usual_prefix(&id)).expect("there is space");
        assert_eq!(blocks(), 1 << 20);
        assert_eq!(std::fs::read(&sparse).expect("read")[0], b'x');
        std::fs::remove_file(sparse).expect("removed");
    }

    /// The name of the register and what stands in it are iceoryx2's: it would create the file open to all.
    #[test]
    fn no_file_of_a_run_is_open_to_others() {
        let id = RunId::new();
        let (domain, ownership) = crate::ipc::domain::Domain::own(&id).expect("owned");
        let node = domain.node("coupler").expect("joined");
        let files: Vec<_> = ours(&usual_prefix(&id)).collect();
        assert_eq!(files, [register(&usual_prefix(&id))]);
        for name in files {
            let mode = std::fs::metadata(path(&name)).expect("there").permissions().mode();
            assert_eq!(mode & 0o077, 0, "{name}");
        }
        drop(node);
        domain.remove(ownership);
        assert!(ours(&usual_prefix(&id)).next().is_none());
    }

    #[test]
    fn a_page_that_cannot_be_had_ends_the_process_with_a_word() {
        const CHILD: &str = "ROCKFALL_TEST_BUS";
        if std::env::var_os(CHILD).is_some() {
            end_with_a_word();
            let _ = rustix::process::kill_process(rustix::process::getpid(), rustix::process::Signal::BUS);
            return;
        }
        let name = std::thread::current().name().expect("tests have names").to_owned();
        let mut child = std::process::Command::new(std::env::current_exe().expect("a program"));
        let output = child.args(["--exact", &name, "--nocapture"]).env(CHILD, "1").output().expect("started");
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.code() == Some(1) && said.contains("shared memory is full"), "{output:?}");
    }
}
