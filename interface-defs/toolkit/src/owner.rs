//! One run at a time owns a directory of results.
//!
//! The owner holds a kernel lock on `.rockfall.lock` in it, which names the run and the process that took it. The
//! launcher lets the processes that it starts inherit the lock: it lasts until the last of them has ended, whatever ends
//! them, and a solver knows its launcher by its number.

use super::files::{self, Dir, Exposed};
use super::manifest;
use super::provenance::build_id;
use super::run_dir::{self, RECORD, SUMMARY, unwritable};
use super::simd;
use super::summary::{RunStatus, Summary};
use interface_defs::{Diagnostic, RunId, code};
use rustix::fs::{Mode, OFlags};
use rustix::io::FdFlags;
use serde_json::{Map, Value, json};
use std::fs::{File, TryLockError};
use std::io::{self, Read, Seek, Write};
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};

/// Name of the lock in the directory.
const LOCK: &str = ".rockfall.lock";

/// How a process comes to write into a directory of results.
#[derive(Debug, Clone, Default)]
pub struct Claim {
    /// Free the directory of an older run.
    pub force: bool,
    /// Go on with the run that the directory holds: its results are kept.
    pub resume: bool,
    /// Id of the run; `None`: that of the launcher's, else a new one.
    pub run: Option<RunId>,
    /// The process that has started this one, and may hold the directory for it.
    pub supervisor: Option<u32>,
}

/// The right to write into a directory, for as long as it lives.
#[derive(Debug)]
pub struct Owner {
    dir: PathBuf,
    run: RunId,
    lock: File,
    /// Whether the lock was taken here, and not by the launcher.
    first: bool,
    place: Identity,
}

/// Device and number of a file.
type Identity = (u64, u64);

fn identity(metadata: &std::fs::Metadata) -> Identity {
    (metadata.dev(), metadata.ino())
}

impl Owner {
    /// Create `dir` if it is not there and own it. One that another run writes to is refused, and so is one that holds
    /// results, unless `claim.force`: then files that a run wrote are removed, and no others.
    pub fn claim(dir: &Path, claim: &Claim) -> Result<Self, Diagnostic> {
        let shown = dir.display().to_string();
        let fault = |e: io::Error| unwritable(dir, &e);
        if dir.exists() && !dir.is_dir() {
            return Err(Diagnostic::in_file(shown.as_str(), "this is a file, and results need a directory"));
        }
        refuse_exposed(&Dir::create(dir).map_err(fault)?)?;
        let mut lock = open(dir, OFlags::RDWR | OFlags::CREATE).map_err(fault)?;
        let place = identity(&std::fs::metadata(dir).map_err(fault)?);
        match lock.try_lock() {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => {
                let (run, process) = read(&mut lock);
                return match run {
                    Some(run) if claim.supervisor.is_some_and(|pid| Some(pid) == process) => {
                        Ok(Self { dir: dir.to_owned(), run, lock, first: false, place })
                    }
                    _ => Err(taken(&shown, run.as_ref(), process)),
                };
            }
            // A file system without locks: the run goes on, as it did before there were any.
            Err(TryLockError::Error(e)) => {
                tracing::warn!("{shown}: two runs at once cannot be distinguished here: {e}")
            }
        }
        let run = claim.run.clone().unwrap_or_default();
        let owner = Self { dir: dir.to_owned(), run, lock, first: true, place };
        owner.check().map_err(|what| Diagnostic::in_file(shown.as_str(), what))?;
        match claim.resume {
            true => run_dir::make_ready_to_go_on(dir)?,
            false => run_dir::make_free(dir, claim.force)?,
        }
        owner.sign().map_err(fault)?;
        Ok(owner)
    }

    /// Who the owner is, for those who find the directory taken. A directory that cannot be written to is found here.
    fn sign(&self) -> io::Result<()> {
        let mut file = &self.lock;
        file.set_len(0)?;
        file.rewind()?;
        writeln!(file, "{} {}", self.run, std::process::id())
    }

    /// The run.
    pub fn run(&self) -> &RunId {
        &self.run
    }

    /// The directory.
    pub fn dir(&self) -> &Path {
        &self.dir
    }

    /// Processes that are started from now on keep the directory until they have ended, even without this one.
    pub fn share_with_children(&self) {
        // Without it a child that outlives this process does not keep a second run out: nothing else is lost.
        let _ = rustix::io::fcntl_setfd(&self.lock, FdFlags::empty());
    }

    /// An error: the directory was removed or replaced meanwhile, and what was written is lost with it.
    pub fn check(&self) -> Result<(), String> {
        let same_place = std::fs::metadata(&self.dir).is_ok_and(|m| identity(&m) == self.place);
        let named = std::fs::symlink_metadata(self.dir.join(LOCK)).map(|m| identity(&m));
        let held = self.lock.metadata().map(|m| identity(&m));
        if same_place && named.is_ok() && named.ok() == held.ok() {
            return Ok(());
        }
        let (dir, run) = (self.dir.display(), &self.run);
        Err(format!(
            "{dir}: the directory of the results was removed or replaced while run {run} wrote to it"
        ))
    }

    /// Write `run.json`, where no launcher has written a fuller one, and into it that `program` of this project leads as `part`.
    pub fn write_record(&self, part: &str, program: &str) -> Result<(), Diagnostic> {
        let build = build_id();
        let words: Vec<_> = std::env::args_os().map(|word| word.to_string_lossy().into_owned()).collect();
        let run = self.run.to_string();
        let simd = simd::path().name();
        let record = json!({ "version": build.version, "build": build, "simd": simd, "command_line": words, "run": run });
        let begun = if self.first { files::write_json(&self.dir.join(RECORD), &record) } else { Ok(()) };
        let (name, build) = (format!("{program} {}", build.version), build.to_string());
        begun
            .and_then(|()| note_programs(&self.dir, [(part, name.as_str(), Some(build.as_str()))]))
            .map_err(|e| unwritable(&self.dir, &e))
    }

    /// Give the directory up, before the process ends at once.
    pub fn release(&self) {
        // Held until it is gone: nobody else can have taken it.
        if self.first && self.check().is_ok() {
            let _ = files::remove(&self.dir.join(LOCK));
        }
    }

    /// End the run: write its summary, in which it stands where that fails, remove checkpoints that nobody needs, and write
    /// `manifest.json`, after the last file, where no launcher will do so.
    pub fn conclude(&self, summary: &mut Summary) {
        if let Err(what) = self.write_summary(summary) {
            summary.fail(Diagnostic::error(code::NOT_WRITTEN, what));
            return;
        }
        // A run that has come to its end needs its checkpoints no more.
        if matches!(summary.status, RunStatus::Done | RunStatus::Unreliable)
            && let Err(e) = run_dir::remove_checkpoints(&self.dir)
        {
            tracing::warn!("{}: the checkpoints cannot be removed: {e}", self.dir.display());
        }
        // What was interrupted goes on, and must end at once.
        if self.first && summary.status != RunStatus::Interrupted {
            manifest::seal(&self.dir);
        }
    }

    /// Write `summary.json`, the last file of a run, if the directory is still the run's own.
    pub fn write_summary(&self, summary: &mut Summary) -> Result<(), String> {
        self.check()?;
        summary.run = Some(self.run.to_string());
        summary
            .write(&self.dir)
            .map_err(|e| format!("cannot write {}: {e}", self.dir.join(SUMMARY).display()))
    }
}

/// Add to `run.json` of `dir` what these parts of the run say of themselves: name with version, and build.
pub fn note_programs<'p>(
    dir: &Path,
    programs: impl IntoIterator<Item = (&'p str, &'p str, Option<&'p str>)>,
) -> io::Result<()> {
    let text = files::if_there(files::read_text(&dir.join(RECORD)))?;
    let mut record = text.map_or(Ok(Map::new()), |text| serde_json::from_str(&text))?;
    for (part, name, build) in programs {
        let program = below(below(&mut record, "programs")?, part)?;
        program.insert("name".into(), name.into());
        program.extend(build.map(|build| ("build".into(), build.into())));
    }
    files::write_json(&dir.join(RECORD), &record)
}

/// The object at this key, which is made where there is nothing.
fn below<'m>(map: &'m mut Map<String, Value>, key: &str) -> io::Result<&'m mut Map<String, Value>> {
    let value = map.entry(key).or_insert_with(|| json!({}));
    value
        .as_object_mut()
        .ok_or_else(|| io::Error::new(io::ErrorKind::InvalidData, format!("`{key}` is no object")))
}

impl Drop for Owner {
    fn drop(&mut self) {
        self.release();
    }
}

/// Refuse a directory of another user, who can exchange what a run wrote and reads again; warn where one above it is theirs or open
/// to all. The administrator works in directories of others on purpose.
fn refuse_exposed(dir: &Dir) -> Result<(), Diagnostic> {
    // What cannot be seen is not judged: a directory above may be closed to this user.
    match dir.exposed() {
        _ if rustix::process::geteuid().is_root() => {}
        Ok(Some(Exposed::ToOwner)) => {
            return Err(Diagnostic::in_file(dir.path().display(), "this directory belongs to another user")
                .coded(code::RESULT_DIRECTORY)
                .try_instead("choose one of your own with --out"));
        }
        Ok(Some(Exposed::Above(path))) => {
            tracing::warn!("{}: other users can exchange what lies in this directory", path.display());
        }
        Ok(None) | Err(_) => {}
    }
    Ok(())
}

/// Refuse to write into `dir` as part of `run` while another run owns it.
pub fn refuse_stranger(dir: &Path, run: &RunId) -> Result<(), Diagnostic> {
    match holder(dir) {
        Some((Some(owner), process)) if owner != *run => {
            Err(taken(&dir.display().to_string(), Some(&owner), process))
        }
        _ => Ok(()),
    }
}

/// The run, and the process, that writes into `dir` on this machine now; `None`: there is none.
pub fn holder(dir: &Path) -> Option<(Option<RunId>, Option<u32>)> {
    let mut lock = open(dir, OFlags::RDONLY).ok()?;
    matches!(lock.try_lock_shared(), Err(TryLockError::WouldBlock)).then(|| read(&mut lock))
}

fn taken(dir: &str, run: Option<&RunId>, process: Option<u32>) -> Diagnostic {
    let run = run.map_or("another run".into(), |run| format!("run {run}"));
    let process = process.map_or(String::new(), |pid| format!(" (process {pid})"));
    Diagnostic::in_file(dir, format!("{run}{process} is writing its results here"))
        .try_instead("choose another directory with --out, or wait until it has ended")
}

/// A link is not followed, and a pipe blocks nobody.
fn open(dir: &Path, access: OFlags) -> io::Result<File> {
    let flags = access | OFlags::NOFOLLOW | OFlags::NONBLOCK | OFlags::CLOEXEC;
    let mode = Mode::from_raw_mode(0o644);
    let named = |e: io::Error| io::Error::new(e.kind(), format!("{LOCK}: {e}"));
    let file = rustix::fs::open(dir.join(LOCK), flags, mode).map_err(|e| named(e.into()))?.into();
    files::sole(file).map_err(named)
}

/// Run and process that the lock names.
fn read(lock: &mut File) -> (Option<RunId>, Option<u32>) {
    let mut text = String::new();
    let _ = lock.take(64).read_to_string(&mut text);
    let mut words = text.split_whitespace();
    let run = words.next().and_then(|word| word.parse().ok());
    (run, words.next().and_then(|word| word.parse().ok()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn claim(dir: &Path) -> Result<Owner, Diagnostic> {
        Owner::claim(dir, &Claim::default())
    }

    #[test]
    fn a_second_run_into_one_directory_is_refused_and_the_first_is_not_disturbed() {
        let temp = tempfile::tempdir().expect("a directory");
        let first = claim(temp.path()).expect("free");
        std::fs::write(temp.path().join("history.csv"), "rows").expect("written");
        for force in [false, true] {
            let second = Owner::claim(temp.path(), &Claim { force, ..Claim::default() });
            let message = second.expect_err("taken").to_string();
            let expected =
                format!("run {} (process {}) is writing its results here", first.run, std::process::id());
            assert!(message.contains(&expected) && message.contains("--out"), "{message}");
        }
        assert!(
            refuse_stranger(temp.path(), &RunId::new()).expect_err("taken").message.contains("is writing")
        );
        assert_eq!(refuse_stranger(temp.path(), &first.run), Ok(()));
        assert_eq!(std::fs::read_to_string(temp.path().join("history.csv")).expect("kept"), "rows");
        assert_eq!(first.check(), Ok(()));
        drop(first);
        assert!(!temp.path().join(LOCK).exists());
        assert!(claim(temp.path()).expect_err("it holds rows").to_string().contains("holds a run already"));
        assert!(!temp.path().join(LOCK).exists(), "who is refused leaves nothing");
    }

    #[test]
    fn a_process_of_the_launcher_that_owns_the_directory_shares_it() {
        let temp = tempfile::tempdir().expect("a directory");
        let launcher = claim(temp.path()).expect("free");
        std::fs::write(temp.path().join("summary.json"), "{}").expect("written");
        let of = |pid| Claim { supervisor: Some(pid), ..Claim::default() };
        let member = Owner::claim(temp.path(), &of(std::process::id())).expect("its own launcher");
        assert_eq!(member.run, launcher.run);
        assert!(Owner::claim(temp.path(), &of(1)).is_err(), "another launcher");
        assert!(temp.path().join("summary.json").exists(), "the launcher has made the directory free");
        drop(member);
        assert_eq!(launcher.check(), Ok(()));
    }

    #[test]
    fn a_directory_that_was_removed_or_replaced_is_named_and_gets_no_summary() {
        let temp = tempfile::tempdir().expect("a directory");
        let dir = temp.path().join("out");
        let owner = claim(&dir).expect("free");
        owner.write_record("fem", "fem-solver").expect("written");
        note_programs(&dir, [("dem", "weight 1.0", None)]).expect("written");
        let record: Value =
            serde_json::from_slice(&std::fs::read(dir.join(RECORD)).expect("there")).expect("JSON");
        assert_eq!(record["programs"]["fem"]["build"], build_id().to_string());
        assert_eq!(record["programs"]["dem"], json!({ "name": "weight 1.0" }));
        owner.write_summary(&mut Summary::new(RunStatus::Done)).expect("written");
        let written = Summary::read(&dir).expect("a summary");
        assert_eq!(written.run, Some(owner.run.to_string()));
        std::fs::remove_dir_all(&dir).expect("removed");
        let message = owner.write_summary(&mut Summary::new(RunStatus::Done)).expect_err("gone");
        assert!(message.contains("was removed or replaced"), "{message}");
        std::fs::create_dir(&dir).expect("created");
        let another = claim(&dir).expect("free");
        assert!(owner.write_summary(&mut Summary::new(RunStatus::Done)).is_err());
        assert!(!dir.join("summary.json").exists());
        drop(owner);
        assert_eq!(another.check(), Ok(()), "the lock of the other is left alone");
    }

    #[test]
    fn a_pipe_or_a_link_in_the_place_of_the_lock_is_refused() {
        let temp = tempfile::tempdir().expect("a directory");
        let lock = temp.path().join(LOCK);
        std::fs::write(temp.path().join("beside"), "precious").expect("written");
        std::os::unix::fs::symlink(temp.path().join("beside"), &lock).expect("linked");
        assert!(claim(temp.path()).expect_err("a link").to_string().contains(LOCK));
        std::fs::remove_file(&lock).expect("removed");
        rustix::fs::mknodat(rustix::fs::CWD, &lock, rustix::fs::FileType::Fifo, Mode::RUSR | Mode::WUSR, 0)
            .expect("a pipe");
        assert!(claim(temp.path()).expect_err("a pipe").to_string().contains(LOCK));
        assert_eq!(std::fs::read_to_string(temp.path().join("beside")).expect("kept"), "precious");
    }
}
