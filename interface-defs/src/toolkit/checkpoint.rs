//! Checkpoints: what a run that was killed goes on from, to the same bytes.
//!
//! The leader of a run asks every solver for its state at the end of a committed window and writes all of them, with its own,
//! into one file of `checkpoint/`. Two files take turns, and each is there as a whole or not at all
//! ([`super::state_file`]): a kill at any moment leaves the one before. Files of results are written on all the time;
//! a checkpoint says how long they were, and who goes on cuts them back to that.

use super::run_dir::{self, CHECKPOINT};
use super::scene::Scene;
use super::state_file::{self, Unreadable};
use super::summary::{RunStatus, Summary};
use crate::diagnostic::{Diagnostic, Severity, code};
use crate::message::Fault;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use std::io;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Version of [`Checkpoint`], written and read.
const VERSION: u32 = 1;
/// The two files.
const FILES: [&str; 2] = ["1.state", "2.state"];

/// A run at the end of a committed window.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Checkpoint {
    /// Which of the run's checkpoints it is, from 1.
    pub number: u64,
    /// Version of the programs that wrote it.
    pub version: String,
    /// Fingerprint of the resolved scene.
    pub scene: String,
    /// End of the window [s].
    pub time: f64,
    /// Times that the run has been resumed.
    pub resumed: u64,
    /// States by the names of those that they are of.
    pub parts: Vec<(String, Vec<u8>)>,
}

impl Checkpoint {
    /// The state of `name`.
    pub fn part(&self, name: &str) -> Result<&[u8], Fault> {
        let part = self.parts.iter().find(|(own, _)| own == name);
        part.map(|(_, state)| &state[..])
            .ok_or_else(|| Fault::input(format!("the checkpoint has no state of {name}")))
    }
}

/// What a solver or coupler keeps, as bytes.
pub fn pack<S: Serialize>(state: &S) -> Vec<u8> {
    crate::message::pack(state)
}

/// What [`pack`] made.
pub fn unpack<S: DeserializeOwned>(bytes: &[u8]) -> Result<S, Fault> {
    crate::message::unpack(bytes)
        .map_err(|e| Fault::broken(format!("a state that was kept cannot be read: {e}")))
}

/// The checkpoints in a directory of results.
#[derive(Debug, Default)]
pub struct Found {
    /// The newest that can be read.
    pub newest: Option<Checkpoint>,
    /// Files that cannot be used, and why.
    pub unusable: Vec<String>,
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
                Err(why) => found.unusable.push(format!("{}: {why}", path.display())),
            }
        }
        found
    }
}

/// Writes the checkpoints of a run, not more often than asked for.
#[derive(Debug)]
pub struct Store {
    dir: PathBuf,
    scene: String,
    /// Time between two of them; zero: none are written.
    interval: Duration,
    last: Instant,
    number: u64,
    resumed: u64,
}

impl Store {
    /// For the run of the scene with this fingerprint in `out`, one each `interval` [s] of wall time, 0: none; after the checkpoint
    /// `before`, if the run goes on from one.
    pub fn new(out: &Path, scene: String, interval: f64, before: Option<&Checkpoint>) -> Self {
        Self {
            dir: out.join(CHECKPOINT),
            scene,
            interval: Duration::try_from_secs_f64(interval).unwrap_or(Duration::MAX),
            last: Instant::now(),
            number: before.map_or(0, |before| before.number),
            resumed: before.map_or(0, |before| before.resumed + 1),
        }
    }

    /// Whether it is time for one.
    pub fn is_due(&self) -> bool {
        self.is_wanted() && self.last.elapsed() >= self.interval
    }

    /// Whether any are to be written.
    pub fn is_wanted(&self) -> bool {
        !self.interval.is_zero()
    }

    /// Write one: of the end of a window at `time` [s].
    pub fn write(&mut self, time: f64, parts: Vec<(String, Vec<u8>)>) -> io::Result<()> {
        std::fs::create_dir_all(&self.dir)?;
        let checkpoint = Checkpoint {
            number: self.number + 1,
            version: env!("CARGO_PKG_VERSION").into(),
            scene: self.scene.clone(),
            time,
            resumed: self.resumed,
            parts,
        };
        let file = FILES[(self.number % 2) as usize];
        state_file::write(&self.dir.join(file), VERSION, &checkpoint)?;
        self.number += 1;
        self.last = Instant::now();
        Ok(())
    }

    /// Times that the run has been resumed.
    pub fn resumed(&self) -> u64 {
        self.resumed
    }
}

/// The checkpoint from which the run of `scene` in `out` goes on; `None`: there is none, and it begins anew.
pub fn to_go_on(scene: &Scene, out: &Path) -> Result<Option<Checkpoint>, Diagnostic> {
    let found = Found::of(out);
    for unusable in &found.unusable {
        tracing::warn!("{unusable}");
    }
    let Some(newest) = found.newest else {
        tracing::warn!("{}: there is no checkpoint to go on from; the run begins anew", out.display());
        return Ok(None);
    };
    let refuse = |what: String| {
        Diagnostic::in_file(out.display().to_string(), what)
            .try_instead("run it anew with --force, or into another directory with --out")
    };
    let own = env!("CARGO_PKG_VERSION");
    if newest.version != own {
        let theirs = &newest.version;
        return Err(refuse(format!(
            "the checkpoint is of version {theirs} of the programs, these are {own}"
        )));
    }
    if newest.scene != scene.fingerprint() {
        return Err(refuse(
            "the checkpoint is of a run of another scene, or of another version of it".into(),
        ));
    }
    Ok(Some(newest))
}

/// What is said of a run that went on at `time` [s].
pub fn of_last_part(time: f64) -> Diagnostic {
    let what = format!(
        "the run went on at t = {time:.6} s from a checkpoint: its cost is that of the part since then"
    );
    Diagnostic::of(Severity::Note, code::INTERRUPTED, what)
}

/// A run that has come to its end needs its checkpoints no more.
pub fn remove_if_over(summary: &Summary, out: &Path) {
    if matches!(summary.status, RunStatus::Done | RunStatus::Unreliable)
        && let Err(e) = run_dir::remove_checkpoints(out)
    {
        tracing::warn!("{}: the checkpoints cannot be removed: {e}", out.display());
    }
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
        let mut store = Store::new(out, "s".into(), 1e-9, None);
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
    fn a_run_that_goes_on_counts_on_and_spares_the_checkpoint_that_it_goes_on_from() {
        let temp = tempfile::tempdir().expect("a directory");
        let mut store = Store::new(temp.path(), "s".into(), 1e-9, None);
        (1..=2).for_each(|number| store.write(f64::from(number), parts(number)).expect("written"));
        let before = Found::of(temp.path()).newest.expect("one");
        let mut store = Store::new(temp.path(), "s".into(), 1e-9, Some(&before));
        assert!(store.is_due() && store.resumed() == 1);
        store.write(3.0, parts(3)).expect("written");
        assert_eq!(Found::of(temp.path()).newest.map(|one| (one.number, one.resumed)), Some((3, 1)));
        let second = state_file::read::<Checkpoint>(&temp.path().join(CHECKPOINT).join(FILES[1]), VERSION);
        assert_eq!(second.expect("still there"), before);
        assert!(!Store::new(temp.path(), "s".into(), 0.0, None).is_due());
    }
}
