//! One run's own place: names, liveness, cleaning.
//!
//! Everything of a run lies in the directory `<run id>` of its user's private directory (`home`) and under its prefix in
//! shared memory (`memory`). The coupler holds an exclusive lock on `<run id>.lock` for as long as it lives;
//! the kernel gives it up whatever ends the process, so a lock that can be had marks a dead run.

use super::home::{self, Home};
use super::memory::{self, Register};
use super::run_id::RunId;
use super::transport;
use crate::participant::Failure;
use iceoryx2::config::Config;
use iceoryx2::node::{Node, NodeState, NodeView};
use iceoryx2::prelude::{
    CallbackProgression, FileName, NodeBuilder, NodeName, Path as IoxPath, SemanticString,
};
use iceoryx2::prelude::{SignalHandlingMode, ipc};
use std::collections::BTreeSet;
use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Longer than an owner that ends needs from its first file in shared memory to its lock.
const ENDING: Duration = Duration::from_millis(100);

/// The place of one run that has an owner.
#[derive(Debug, Clone)]
pub struct Domain {
    /// The run.
    pub run: RunId,
    home: PathBuf,
    prefix: String,
    config: Config,
}

/// What the owner of a run holds: let go of, the run is dead.
#[derive(Debug)]
pub(crate) struct Ownership {
    lock: File,
    register: Register,
}

impl Domain {
    fn new(home: &Path, prefix: String, run: &RunId) -> Result<Self, Failure> {
        let mut config = Config::default();
        config.global.prefix =
            FileName::new(prefix.as_bytes()).map_err(transport("prefix of the run in shared memory"))?;
        let root = home.join(run.as_str());
        let root =
            IoxPath::new(root.as_os_str().as_encoded_bytes()).map_err(transport("place of the run"))?;
        config.global.set_root_path(&root);
        // A run ends with the first process that is lost. Nobody need clean up after another that may be just coming up.
        config.global.node.cleanup_dead_nodes_on_creation = false;
        config.global.node.cleanup_dead_nodes_on_destruction = false;
        config.global.service.cleanup_dead_nodes_on_open = false;
        Ok(Self { run: run.clone(), home: home.to_owned(), prefix, config })
    }

    /// The place of `run`, if a coupler owns it now. An error: no directory of this user's runs can be used, or the coupler's shared memory is
    /// not the one of this process.
    pub fn find(run: &RunId) -> Result<Option<Self>, Failure> {
        Self::find_in(&home::places(), run)
    }

    fn find_in(places: &[PathBuf], run: &RunId) -> Result<Option<Self>, Failure> {
        home::first(places, |place| {
            let Some(home) = Home::open(place)? else { return Ok(None) };
            let Some(text) = home.owner(run)? else { return Ok(None) };
            let prefix = if text.is_empty() { memory::usual_prefix(run) } else { text };
            // A run that is just ending removes it before it gives up its lock.
            let apart = |home: &Home| Ok(!memory::is_known(&prefix) && home.owner(run)?.is_some());
            let mut are_apart = apart(&home)?;
            if are_apart {
                std::thread::sleep(ENDING);
                are_apart = apart(&home)?;
            }
            if are_apart {
                return Err(Failure::Transport(format!(
                    "run {run} is alive, and its files in {0} are not there: coupler and solver have different {0}, as in containers of \
                     their own; share it (docker and podman: --ipc), or put `rockfall bridge` between them",
                    memory::SHARED_MEMORY
                )));
            }
            Self::new(place, prefix, run).map(Some)
        })
    }

    /// Become the owner of `run`. What a dead run of the same id left behind is removed first.
    pub(crate) fn own(run: &RunId) -> Result<(Self, Ownership), Failure> {
        Self::own_in(&home::places(), run)
    }

    fn own_in(places: &[PathBuf], run: &RunId) -> Result<(Self, Ownership), Failure> {
        let usable = home::first(places, |place| Home::create(place).map(|_| Some(place.to_owned())))?;
        let place = usable.expect("one is created, or refused");
        // Another coupler or a cleaner may be at work, or a waiting solver look at the lock for an instant: try for a while.
        for _ in 0..100 {
            // Anew each time: what is reserved is given back with it.
            let home = Home::create(&place)?;
            if home.reserve()
                && let Some(mut lock) = home.lock(run, true)?
                && lock.try_lock_shared().is_ok()
                && home.is_lock(run, &lock)
            {
                // Shared: nobody else owns the run, and no solver sees an owner yet, whose first files would be taken for
                // those of a dead run.
                if home.remove_remains(run) {
                    let place = place.join(run.as_str());
                    let what = format!("{} exists already and cannot be removed", place.display());
                    return Err(Failure::Transport(what));
                }
                let register = Register::create(run)?;
                lock.set_len(0)
                    .and_then(|()| lock.write_all(register.prefix.as_bytes()))
                    .map_err(transport("cannot write the lock of the run"))?;
                if lock.try_lock().is_ok() && home.is_lock(run, &lock) {
                    let domain = Self::new(&place, register.prefix.clone(), run)?;
                    return Ok((domain, Ownership { lock, register }));
                }
            }
            std::thread::sleep(Duration::from_millis(5));
        }
        Err(Failure::Transport(format!("run id {run} belongs to a run that is alive; choose another")))
    }

    /// Whether a coupler still owns the run.
    pub fn is_owned(&self) -> bool {
        let owner =
            Home::open(&self.home).and_then(|home| home.map_or(Ok(None), |home| home.owner(&self.run)));
        matches!(owner, Ok(Some(_)))
    }

    /// Remove all that the run has in shared memory and on disk.
    pub(crate) fn remove(&self, ownership: Ownership) {
        ownership.register.remove();
        if let Ok(Some(home)) = Home::open(&self.home) {
            home.remove_remains(&self.run);
            home.remove_lock(&self.run);
        }
        // The last of all, so that nobody takes what is removed here for the files of another run.
        drop(ownership.lock);
    }

    /// Have every page of the run's files in shared memory from now on.
    pub(crate) fn allocate(&self) -> Result<(), Failure> {
        memory::allocate(&self.prefix)
    }

    /// A node of this run, under the participant's name.
    pub fn node(&self, name: &str) -> Result<Node<ipc::Service>, Failure> {
        memory::end_with_a_word();
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
    clean_in(&home::places())
}

fn clean_in(places: &[PathBuf]) -> Result<Vec<String>, Failure> {
    let mut homes = Vec::new();
    home::first(places, |place| {
        homes.extend(Home::open(place)?);
        Ok(None::<()>)
    })?;
    // One that is reserved is left for the next time.
    homes.retain(Home::reserve);
    let mut ids: BTreeSet<String> = homes.iter().flat_map(Home::clean).collect();
    ids.extend(memory::clean(|id| homes.iter().any(|home| !matches!(home.owner(id), Ok(None)))));
    Ok(ids.into_iter().collect())
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
    fn an_owned_run_is_not_cleaned_and_a_dead_one_is() {
        let temp = tempfile::tempdir().unwrap();
        let places = [temp.path().join("h")];
        let run = RunId::new();
        let (domain, ownership) = Domain::own_in(&places, &run).unwrap();
        assert!(domain.is_owned() && Domain::find_in(&places, &run).unwrap().is_some());
        assert!(!clean_in(&places).unwrap().contains(&run.to_string()));
        assert!(Domain::own_in(&places, &run).is_err(), "two couplers must not share a run");
        drop(ownership);
        assert!(!domain.is_owned() && Domain::find_in(&places, &run).unwrap().is_none());
        assert!(clean_in(&places).unwrap().contains(&run.to_string()));
        assert_eq!(std::fs::read_dir(&places[0]).unwrap().count(), 0);
    }

    #[test]
    fn an_owner_whose_shared_memory_is_another_one_is_not_waited_for() {
        let temp = tempfile::tempdir().unwrap();
        let places = [temp.path().join("h")];
        let run = RunId::new();
        let (domain, ownership) = Domain::own_in(&places, &run).unwrap();
        // As it looks from a container with a /dev/shm of its own.
        ownership.register.remove();
        let refused = Domain::find_in(&places, &run).unwrap_err().to_string();
        assert!(refused.contains("different /dev/shm"), "{refused}");
        domain.remove(ownership);
        assert!(Domain::find_in(&places, &run).unwrap().is_none());
    }

    /// A solver that waits for its coupler makes its first files the moment it sees an owner: they are no remains.
    #[test]
    fn a_solver_that_joins_at_once_is_not_taken_for_a_dead_run() {
        let temp = tempfile::tempdir().unwrap();
        let places = [temp.path().join("h")];
        for turn in 0..100 {
            let run: RunId = format!("r{turn}").parse().unwrap();
            let files = places[0].join(run.as_str());
            let joined = std::thread::spawn({
                let (files, places, run) = (files.clone(), places.clone(), run.clone());
                move || {
                    while Domain::find_in(&places, &run).unwrap().is_none() {
                        std::thread::yield_now();
                    }
                    std::fs::create_dir(files)
                }
            });
            let (domain, ownership) = Domain::own_in(&places, &run).unwrap();
            joined.join().unwrap().unwrap();
            assert!(files.exists(), "turn {turn}");
            domain.remove(ownership);
        }
    }

    /// Where another user may have been first, a run ends with a message: it neither hangs nor removes anything.
    #[test]
    fn a_run_whose_places_are_taken_is_refused_by_name() {
        let temp = tempfile::tempdir().unwrap();
        let run: RunId = "r".parse().unwrap();
        let place = |home: &str| [temp.path().join(home)];
        std::os::unix::fs::symlink(temp.path(), temp.path().join("link")).unwrap();
        let refused = Domain::own_in(&place("link"), &run).unwrap_err().to_string();
        assert!(refused.contains("link must be a private place of your own"), "{refused}");
        assert!(Domain::find_in(&place("link"), &run).is_err() && clean_in(&place("link")).is_err());
        assert!(Domain::find_in(&place("none"), &run).unwrap().is_none());
        // A file where the directory of the run belongs.
        std::fs::create_dir(temp.path().join("home")).unwrap();
        std::fs::write(temp.path().join("home/r"), "kept").unwrap();
        let refused = Domain::own_in(&place("home"), &run).unwrap_err().to_string();
        assert!(refused.contains("home/r exists already"), "{refused}");
        assert_eq!(std::fs::read(temp.path().join("home/r")).unwrap(), b"kept");
        // Another place of ours serves.
        let places = [temp.path().join("link"), temp.path().join("own")];
        let (domain, ownership) = Domain::own_in(&places, &RunId::new()).unwrap();
        assert!(Domain::find_in(&places, &domain.run).unwrap().is_some());
        domain.remove(ownership);
    }

    /// The address of a socket has 107 bytes, and the longest directory that is used leaves room for its name.
    #[test]
    fn the_longest_place_leaves_room_for_the_names_of_a_run() {
        let temp = tempfile::Builder::new().prefix("x").rand_bytes(15).tempdir_in("/tmp").unwrap();
        let places = [temp.path().join("rockfall")];
        assert_eq!(places[0].as_os_str().len(), 30);
        let (domain, ownership) = Domain::own_in(&places, &RunId::new()).unwrap();
        let node = domain.node("coupler").unwrap();
        let wake = super::super::channel::create_wake(&node, "coupler").unwrap();
        drop(wake.listener_builder().create().unwrap());
        drop((wake, node));
        domain.remove(ownership);
    }
}
