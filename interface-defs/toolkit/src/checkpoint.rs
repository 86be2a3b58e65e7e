//! Checkpoints: what a run that was killed goes on from, to the same bytes.
//!
//! The leader of a run asks every solver for its state at the end of a committed window and writes all of them, with its own,
//! into one file of `checkpoint/`. Two files take turns, and each is there as a whole or not at all
//! ([`super::state_file`]): a kill at any moment leaves the one before. Files of results are written on all the time;
//! a checkpoint says how long they were, and who goes on cuts them back to that.

use super::files::{self, Dir};
use super::input_file::{hash, named_files, with_absolute_files};
use super::processes::without_waiting;
use super::provenance::{self, BuildId, build_id};
use super::run_dir::CHECKPOINT;
use super::scene::Scene;
use super::state_file::{self, Unreadable};
use interface_defs::{Diagnostic, Fault, Severity, code};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use std::io;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant, SystemTime};

/// Version of [`Checkpoint`], written and read.
const VERSION: u32 = 2;
/// The two files.
const FILES: [&str; 2] = ["1.state", "2.state"];

/// States by the names of those that they are of.
pub type Parts = Vec<(String, Vec<u8>)>;

/// A run at the end of a committed window.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Checkpoint {
    /// Which of the run's checkpoints it is, from 1.
    pub number: u64,
    /// The program that wrote it.
    pub build: BuildId,
    /// What the run computes.
    pub subject: Subject,
    /// End of the window [s].
    pub time: f64,
    /// Times that the run has been resumed.
    pub resumed: u64,
    /// States by the names of those that they are of.
    pub parts: Parts,
}

impl Checkpoint {
    /// The state of `name`.
    pub fn part(&self, name: &str) -> Result<&[u8], Fault> {
        let part = self.parts.iter().find(|(own, _)| own == name);
        part.map(|(_, state)| &state[..])
            .ok_or_else(|| Fault::input(format!("the checkpoint has no state of {name}")))
    }

    /// Refuse to go on in `out` with the program of hash `now`, which leads the run, if another one wrote this.
    pub fn refuse_other_build(&self, out: &Path, now: &str) -> Result<(), Diagnostic> {
        if self.build.program == now {
            return Ok(());
        }
        let what = format!("the checkpoint was written by {}, and this is program {now}", self.build);
        Err(refused(out, what))
    }
}

/// What a run computes: it goes on only with the same.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Subject {
    /// Hash of the scene, whose deadlines do not count.
    scene: String,
    /// The files that it names, and the hashes of their content.
    inputs: Vec<(PathBuf, String)>,
}

impl Subject {
    /// That of `scene`. Reads every file that it names.
    pub fn of(scene: &Scene) -> Result<Self, Diagnostic> {
        let mut table = without_waiting(scene.document()?);
        let own = hash(table.to_string().as_bytes());
        with_absolute_files(&mut table, scene)?;
        let hashed = |path: PathBuf| -> Result<_, Diagnostic> {
            let hash = files::input(&path).and_then(provenance::hash_of);
            let (hash, _) = hash
                .map_err(|e| Diagnostic::in_file(path.display(), format!("the file cannot be read: {e}")))?;
            Ok((path, hash.text()))
        };
        let inputs = named_files(&table).into_iter().map(hashed).collect::<Result<_, _>>()?;
        Ok(Self { scene: own, inputs })
    }

    /// What is not as it was; `None`: all is.
    fn differs(&self, now: &Self) -> Option<String> {
        if self.scene != now.scene {
            return Some("the checkpoint is of a run of another scene, or of another version of it".into());
        }
        // By their hashes alone: scene and files may lie elsewhere now.
        let changed = self.inputs.iter().zip(&now.inputs).find(|((_, before), (_, now))| before != now);
        if let Some((_, (path, _))) = changed {
            return Some(format!("{} is not the file that the run began with", path.display()));
        }
        (self.inputs.len() != now.inputs.len()).then(|| "a file that the scene names is new or gone".into())
    }
}

/// What a solver or coupler keeps, as bytes that say which program wrote them, and as what.
pub fn pack<S: Serialize>(state: &S) -> Vec<u8> {
    let mut bytes = provenance::head();
    interface_defs::message::append(state, &mut bytes);
    bytes
}

/// What [`pack`] made in this build of this program.
pub fn unpack<S: DeserializeOwned>(bytes: &[u8]) -> Result<S, Fault> {
    interface_defs::message::unpack(provenance::open(bytes)?)
        .map_err(|e| Fault::broken(format!("a state that was kept cannot be read: {e}")))
}

/// The checkpoints in a directory of results.
#[derive(Debug, Default)]
pub struct Found {
    /// The newest that can be read.
    pub newest: Option<Checkpoint>,
    /// Files that cannot be used, and why.
    pub unusable: Vec<String>,
    /// Whether one of these is whole, and of another build.
    foreign: bool,
}

impl Found {
    /// Those of the run in `out`.
    pub fn of(out: &Path) -> Self {
        let mut found = Self::default();
        for file in FILES {
            let path = out.join(CHECKPOINT).join(file);
            match state_file::read::<Checkpoint>(&path, VERSION) {
                Ok(one) if found.newest.as_ref().is_none_or(|known| known.number < one.number) => {
                    found.newest = Some(one);
                }
                Ok(_) => {}
                Err(Unreadable::File(e)) if e.kind() == io::ErrorKind::NotFound => {}
                Err(why) => {
                    found.foreign |= matches!(why, Unreadable::Foreign(_));
                    found.unusable.push(format!("{}: {why}", path.display()));
                }
            }
        }
        found
    }

    /// The newest; `None`: a run begins anew. An error where one is there, and of another build: it is not lost unasked.
    pub fn usable(self, out: &Path) -> Result<Option<Checkpoint>, Diagnostic> {
        if self.newest.is_none() && self.foreign {
            return Err(refused(out, self.unusable.join("; ")));
        }
        for unusable in &self.unusable {
            tracing::warn!("{unusable}");
        }
        Ok(self.newest)
    }
}

/// Wall-clock time since the last checkpoint of the run in `out` was written; `None`: there is none.
pub fn age(out: &Path) -> Option<Duration> {
    let about = FILES.iter().filter_map(|file| out.join(CHECKPOINT).join(file).symlink_metadata().ok());
    let newest = about.filter_map(|about| about.modified().ok()).max()?;
    SystemTime::now().duration_since(newest).ok()
}

/// Writes the checkpoints of a run, not more often than asked for. One that cannot be written is missed: the run goes on, and the
/// next is tried an interval later.
#[derive(Debug)]
pub struct Store {
    dir: PathBuf,
    subject: Subject,
    /// Time between two of them; zero: none are written.
    interval: Duration,
    last: Instant,
    number: u64,
    resumed: u64,
    /// Whether the last one could not be written.
    failed: bool,
}

impl Store {
    /// For the run that computes `subject` in `out`, one each `interval` [s] of wall time, 0: none; after the checkpoint
    /// `before`, if the run goes on from one.
    pub fn new(out: &Path, subject: Subject, interval: f64, before: Option<&Checkpoint>) -> Self {
        Self {
            dir: out.join(CHECKPOINT),
            subject,
            interval: Duration::try_from_secs_f64(interval).unwrap_or(Duration::MAX),
            last: Instant::now(),
            number: before.map_or(0, |before| before.number),
            resumed: before.map_or(0, |before| before.resumed + 1),
            failed: false,
        }
    }

    /// Without any, ever.
    pub fn none() -> Self {
        Self::new(Path::new(""), Subject::default(), 0.0, None)
    }

    /// Whether it is time for one, between two windows; a run that the user has `interrupted` writes a last one.
    pub fn is_due(&self, interrupted: bool) -> bool {
        !self.interval.is_zero() && (interrupted || self.last.elapsed() >= self.interval)
    }

    /// Write one: of the end of a window at `time` [s]. Where that fails the one before is left, and the next is due after the
    /// usual time.
    pub fn write(&mut self, time: f64, parts: Parts) -> io::Result<()> {
        self.last = Instant::now();
        Dir::create(&self.dir)?;
        let checkpoint = Checkpoint {
            number: self.number + 1,
            build: build_id().clone(),
            subject: self.subject.clone(),
            time,
            resumed: self.resumed,
            parts,
        };
        let file = FILES[(self.number % 2) as usize];
        state_file::write(&self.dir.join(file), VERSION, &checkpoint)?;
        self.number += 1;
        Ok(())
    }

    /// [`write`](Self::write) one as far as possible. The first failure of a series is a warning of the log.
    pub fn keep(&mut self, time: f64, parts: impl FnOnce() -> Result<Parts, Diagnostic>) {
        self.last = Instant::now();
        let _span = interface_defs::profile!("write checkpoint");
        let written = parts().map_err(|e| e.to_string());
        let written = written.and_then(|parts| self.write(time, parts).map_err(|e| e.to_string()));
        let failed_before = std::mem::replace(&mut self.failed, written.is_err());
        match written {
            Ok(()) if failed_before => {
                tracing::info!("checkpoints are written again, from t = {time} s on");
            }
            Err(what) if !failed_before => {
                let seconds = self.interval.as_secs_f64();
                tracing::warn!("no checkpoint at t = {time} s: {what}; it is tried again each {seconds} s");
            }
            _ => {}
        }
    }
}

/// The checkpoint from which the run of `scene` in `out` goes on; `None`: there is none, and it begins anew.
pub fn to_go_on(scene: &Scene, out: &Path) -> Result<Option<Checkpoint>, Diagnostic> {
    let Some(newest) = Found::of(out).usable(out)? else {
        tracing::warn!("{}: there is no checkpoint to go on from; the run begins anew", out.display());
        return Ok(None);
    };
    newest.refuse_other_build(out, &build_id().program)?;
    match newest.subject.differs(&Subject::of(scene)?) {
        Some(what) => Err(refused(out, what)),
        None => Ok(Some(newest)),
    }
}

fn refused(out: &Path, what: String) -> Diagnostic {
    Diagnostic::in_file(out.display(), what).coded(code::PROVENANCE).try_instead(
        "use the programs that wrote it, or run it anew with --force or into another directory with --out",
    )
}

/// What is said of a run that went on at `time` [s].
pub fn of_last_part(time: f64) -> Diagnostic {
    let what = format!(
        "the run went on at t = {time:.6} s from a checkpoint: its cost is that of the part since then"
    );
    Diagnostic::of(Severity::Note, code::INTERRUPTED, what)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parts(of: u8) -> Vec<(String, Vec<u8>)> {
        vec![("dem".into(), vec![of; 5])]
    }

    #[test]
    fn the_newest_of_two_is_found_and_the_one_before_where_it_is_damaged() {
        let temp = tempfile::tempdir().expect("a directory");
        let out = temp.path();
        assert!(Found::of(out).newest.is_none());
        let mut store = Store::new(out, Subject::default(), 1e-9, None);
        for number in 1..=3 {
            store.write(f64::from(number), parts(number)).expect("written");
        }
        let newest = Found::of(out).newest.expect("one");
        assert_eq!((newest.number, newest.time, newest.part("dem")), (3, 3.0, Ok(&[3; 5][..])));
        assert!(newest.part("fem").is_err());
        // The third has taken the place of the first.
        let third = out.join(CHECKPOINT).join(FILES[0]);
        let bytes = std::fs::read(&third).expect("there");
        for cut in [0, 7, 19, 20, bytes.len() / 2, bytes.len() - 1] {
            std::fs::write(&third, &bytes[..cut]).expect("written");
            let found = Found::of(out);
            assert_eq!(found.newest.expect("the one before").number, 2, "{cut}");
            assert_eq!(found.unusable.len(), 1, "{cut}");
            assert!(found.unusable[0].contains("1.state: it is damaged"), "{}", found.unusable[0]);
        }
        std::fs::write(out.join(CHECKPOINT).join(FILES[1]), "").expect("written");
        let found = Found::of(out);
        assert!(found.newest.is_none() && found.unusable.len() == 2);
    }

    #[test]
    fn a_checkpoint_of_another_build_or_of_other_files_is_refused_and_never_passed_over() {
        let temp = tempfile::tempdir().expect("a directory");
        let (out, text) = (temp.path().join("out"), temp.path().join("s.toml"));
        std::fs::write(temp.path().join("slope.asc"), "1").expect("written");
        std::fs::write(&text, "end_time = 1.0\n[terrain]\nfile = \"slope.asc\"\n").expect("written");
        let scene = Scene::load(&text, &[]).expect("valid");
        assert_eq!(to_go_on(&scene, &out), Ok(None));
        let mut store = Store::new(&out, Subject::of(&scene).expect("readable"), 1.0, None);
        store.write(1.0, parts(1)).expect("written");
        let there = to_go_on(&scene, &out).expect("accepted").expect("one");
        assert_eq!(there.time, 1.0);
        let with = |set: &str| Scene::load(&text, &[set.into()]).expect("valid");
        assert!(to_go_on(&with("processes.timeout=9.0"), &out).is_ok(), "a deadline changes no result");
        for set in ["end_time=2.0", "processes.dem=other"] {
            let other = to_go_on(&with(set), &out).expect_err("another scene");
            assert!(other.message.contains("of another scene"), "{set}: {other}");
        }
        std::fs::write(temp.path().join("slope.asc"), "2").expect("written");
        let other = to_go_on(&scene, &out).expect_err("another file");
        assert!(other.code == code::PROVENANCE && other.message.contains("slope.asc"), "{other}");
        std::fs::write(temp.path().join("slope.asc"), "1").expect("written");
        let file = out.join(CHECKPOINT).join(FILES[0]);
        let mut foreign = there;
        foreign.build.program = "another".into();
        state_file::write(&file, VERSION, &foreign).expect("written");
        let other = to_go_on(&scene, &out).expect_err("another build");
        assert!(other.message.contains("another") && other.message.contains(&build_id().program), "{other}");
        for layout in [VERSION, VERSION + 1] {
            state_file::write(&file, layout, &7_u8).expect("written");
            assert_eq!(to_go_on(&scene, &out).expect_err("another layout").code, code::PROVENANCE);
        }
    }

    #[test]
    fn a_run_that_goes_on_counts_on_and_spares_the_checkpoint_that_it_goes_on_from() {
        let temp = tempfile::tempdir().expect("a directory");
        let mut store = Store::new(temp.path(), Subject::default(), 1e-9, None);
        (1..=2).for_each(|number| store.write(f64::from(number), parts(number)).expect("written"));
        let before = Found::of(temp.path()).newest.expect("one");
        let mut store = Store::new(temp.path(), Subject::default(), 1e-9, Some(&before));
        assert!(store.is_due(false) && store.resumed == 1);
        store.write(3.0, parts(3)).expect("written");
        assert_eq!(Found::of(temp.path()).newest.map(|one| (one.number, one.resumed)), Some((3, 1)));
        let second = state_file::read::<Checkpoint>(&temp.path().join(CHECKPOINT).join(FILES[1]), VERSION);
        assert_eq!(second.expect("still there"), before);
        assert!(!Store::new(temp.path(), Subject::default(), 0.0, None).is_due(true));
    }

    #[test]
    fn a_checkpoint_that_fails_is_tried_again_at_the_next_due_time() {
        let dir = tempfile::tempdir().expect("a directory");
        let parts = || Ok(vec![("dem".to_owned(), vec![1, 2])]);
        let mut checkpoints = Store::new(dir.path(), Subject::default(), 0.05, None);
        // A file stands where their directory belongs.
        std::fs::write(dir.path().join(CHECKPOINT), "").expect("written");
        std::thread::sleep(Duration::from_millis(60));
        assert!(checkpoints.is_due(false));
        checkpoints.keep(1.0, parts);
        checkpoints.keep(1.5, || Err(Diagnostic::error(code::OTHER, "no state")));
        assert!(
            !checkpoints.is_due(false) && checkpoints.is_due(true),
            "not at once, but where the run ends"
        );
        assert!(Found::of(dir.path()).newest.is_none());
        std::fs::remove_file(dir.path().join(CHECKPOINT)).expect("removed");
        std::thread::sleep(Duration::from_millis(60));
        assert!(checkpoints.is_due(false));
        checkpoints.keep(2.0, parts);
        assert_eq!(Found::of(dir.path()).newest.map(|one| one.time), Some(2.0));
        assert!(!checkpoints.is_due(false) && !checkpoints.failed);
        assert!(!Store::none().is_due(true));
        assert!(!Store::new(dir.path(), Subject::default(), 0.0, None).is_due(true));
    }
}
