//! One run's own place in shared memory: names, liveness, cleaning, free space.
//!
//! Everything of a run lies under `/tmp/rockfall-<uid>/<run id>` and `/dev/shm/rf_<run id>_*`. The
//! coupler holds an exclusive lock on `/tmp/rockfall-<uid>/<run id>.lock` for as long as it lives;
//! the kernel gives it up whatever ends the process, so a lock that can be had marks a dead run.

use super::home::{self, Home, SHARED_MEMORY};
use super::run_id::RunId;
use super::transport;
use crate::participant::Failure;
use iceoryx2::config::Config;
use iceoryx2::node::{Node, NodeState, NodeView};
use iceoryx2::prelude::{
    CallbackProgression, FileName, NodeBuilder, NodeName, Path as IoxPath, SemanticString,
};
use iceoryx2::prelude::{SignalHandlingMode, ipc};
use std::fs::{File, TryLockError};
use std::path::PathBuf;
use std::time::Duration;

/// The place of one run.
#[derive(Debug, Clone)]
pub struct Domain {
    /// The run.
    pub run: RunId,
    home: PathBuf,
    config: Config,
}

impl Domain {
    /// The place of `run`. Nothing is created yet.
    pub fn new(run: &RunId) -> Result<Self, Failure> {
        Self::within(home::location(), run)
    }

    fn within(home: PathBuf, run: &RunId) -> Result<Self, Failure> {
        let mut config = Config::default();
        let prefix = home::prefix(run);
        config.global.prefix =
            FileName::new(prefix.as_bytes()).map_err(transport("prefix of the run in shared memory"))?;
        let root = home.join(run.as_str());
        let root =
            IoxPath::new(root.as_os_str().as_encoded_bytes()).map_err(transport("place of the run"))?;
        config.global.set_root_path(&root);
        Ok(Self { run: run.clone(), home, config })
    }

    /// Become the run's owner; the lock lasts as long as the returned file. What a dead run of the
    /// same id left behind is removed first.
    pub fn own(&self) -> Result<File, Failure> {
        let home = Home::create(&self.home)?;
        // A cleaner or a waiting solver may look at the lock for an instant: try for a while.
        for _ in 0..100 {
            if let Some(lock) = home.lock(&self.run, true)?
                && lock.try_lock_shared().is_ok()
                && home.is_lock(&self.run, &lock)
            {
                // Shared: nobody else owns the run, and no solver sees an owner yet, whose first files would be taken for
                // those of a dead run.
                home.remove_remains(&self.run);
                if home.has_remains(&self.run) {
                    let place = self.home.join(self.run.as_str());
                    return Err(Failure::Transport(format!(
                        "{} exists already and cannot be removed",
                        place.display()
                    )));
                }
                if lock.try_lock().is_ok() && home.is_lock(&self.run, &lock) {
                    return Ok(lock);
                }
            }
            std::thread::sleep(Duration::from_millis(5));
        }
        Err(Failure::Transport(format!("run id {} belongs to a run that is alive; choose another", self.run)))
    }

    /// Refuse to go on if someone else's directory lies in the place of this user's. One that is not there yet is none.
    pub fn check(&self) -> Result<(), Failure> {
        Home::open(&self.home).map(|_| ())
    }

    /// Whether a coupler owns the run now.
    pub fn is_owned(&self) -> bool {
        match Home::open(&self.home)
            .and_then(|home| home.map_or(Ok(None), |home| home.lock(&self.run, false)))
        {
            Ok(Some(lock)) => matches!(lock.try_lock_shared(), Err(TryLockError::WouldBlock)),
            _ => false,
        }
    }

    /// Remove all that the run has in shared memory and on disk. Only its owner may.
    pub fn remove(&self) {
        if let Ok(Some(home)) = Home::open(&self.home) {
            home.remove_remains(&self.run);
            home.remove_lock(&self.run);
        }
    }

    /// A node of this run, under the participant's name.
    pub(crate) fn node(&self, name: &str) -> Result<Node<ipc::Service>, Failure> {
        let node_name = NodeName::new(name).map_err(transport("name of the participant"))?;
        NodeBuilder::new()
            .name(&node_name)
            .config(&self.config)
            .signal_handling_mode(SignalHandlingMode::Disabled)
            .create::<ipc::Service>()
            .map_err(transport(format!("cannot join run {} as {name}", self.run)))
    }

    /// Whether a process of this name lives in the run. Takes about a millisecond.
    pub fn is_alive(&self, name: &str) -> bool {
        let mut alive = false;
        let _ = Node::<ipc::Service>::list(&self.config, |state| {
            if let NodeState::Alive(node) = state
                && node.details().as_ref().is_some_and(|d| d.name().as_str() == name)
            {
                alive = true;
                return CallbackProgression::Stop;
            }
            CallbackProgression::Continue
        });
        alive
    }
}

/// Remove what dead runs left behind; returns the ids of the runs removed. An error: what lies in the place of this
/// user's directory is not this user's.
pub fn clean() -> Result<Vec<String>, Failure> {
    Ok(Home::open(&home::location())?.map_or_else(Vec::new, |home| home.clean()))
}

/// Refuse a run whose payloads do not fit: a full `/dev/shm` is a SIGBUS at first touch, never an error.
pub fn check_space(needed: u64) -> Result<(), Failure> {
    let stat =
        rustix::fs::statvfs(SHARED_MEMORY).map_err(transport("cannot read the list of shared memory"))?;
    fits(needed, stat.f_bavail * stat.f_frsize)
}

fn fits(needed: u64, free: u64) -> Result<(), Failure> {
    if needed <= free {
        return Ok(());
    }
    let mb = |bytes: u64| bytes as f64 / 1e6;
    Err(Failure::Transport(format!(
        "the interface needs {:.1} MB of shared memory, {SHARED_MEMORY} has {:.1} MB free; \
         run `rockfall clean`, or enlarge it (docker: --shm-size)",
        mb(needed),
        mb(free)
    )))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_run_id_is_short_and_plain() {
        assert!("abc-1".parse::<RunId>().is_ok());
        for bad in ["", "a b", "../x", "12345678901234567"] {
            assert!(bad.parse::<RunId>().is_err(), "{bad}");
        }
        assert_ne!(RunId::new(), RunId::new());
    }

    #[test]
    fn a_payload_that_does_not_fit_is_refused_with_both_numbers() {
        assert!(fits(10, 10).is_ok());
        let message = fits(3_000_000, 2_000_000).unwrap_err().to_string();
        assert!(message.contains("3.0 MB") && message.contains("2.0 MB free"), "{message}");
    }

    #[test]
    fn an_owned_run_is_not_cleaned_and_a_dead_one_is() {
        let domain = Domain::new(&RunId::new()).unwrap();
        let lock = domain.own().unwrap();
        assert!(domain.is_owned());
        assert!(!clean().unwrap().contains(&domain.run.to_string()));
        assert!(domain.own().is_err(), "two couplers must not share a run");
        drop(lock);
        assert!(!domain.is_owned());
        // Another test's cleaning may have been faster.
        clean().unwrap();
        let home = Home::open(&home::location()).unwrap().unwrap();
        assert!(home.lock(&domain.run, false).unwrap().is_none());
    }

    /// A solver that waits for its coupler makes its first files the moment it sees an owner: they are no remains.
    #[test]
    fn a_solver_that_joins_at_once_is_not_taken_for_a_dead_run() {
        let temp = tempfile::tempdir().unwrap();
        for turn in 0..100 {
            let id: RunId = format!("r{turn}").parse().unwrap();
            let domain = Domain::within(temp.path().join("home"), &id).unwrap();
            let solver = domain.clone();
            let files = temp.path().join("home").join(id.as_str());
            let joined = std::thread::spawn({
                let files = files.clone();
                move || {
                    while !solver.is_owned() {
                        std::thread::yield_now();
                    }
                    std::fs::create_dir(files)
                }
            });
            let lock = domain.own().unwrap();
            joined.join().unwrap().unwrap();
            assert!(files.exists(), "turn {turn}");
            drop(lock);
        }
    }

    /// Where another user may have been first, a run ends with a message: it neither hangs nor removes anything.
    #[test]
    fn a_run_whose_places_are_taken_is_refused_by_name() {
        let temp = tempfile::tempdir().unwrap();
        let domain = |home: &str| Domain::within(temp.path().join(home), &"r".parse().unwrap()).unwrap();
        std::os::unix::fs::symlink(temp.path(), temp.path().join("link")).unwrap();
        let refused = domain("link").own().unwrap_err().to_string();
        assert!(refused.contains("link must be a private place of your own"), "{refused}");
        assert!(domain("link").check().is_err() && !domain("link").is_owned());
        domain("link").remove();
        assert!(domain("none").check().is_ok() && !domain("none").is_owned());
        // A file where the directory of the run belongs.
        drop(domain("home").own().unwrap());
        std::fs::write(temp.path().join("home/r"), "kept").unwrap();
        let refused = domain("home").own().unwrap_err().to_string();
        assert!(refused.contains("home/r exists already"), "{refused}");
        assert_eq!(std::fs::read(temp.path().join("home/r")).unwrap(), b"kept");
    }
}
