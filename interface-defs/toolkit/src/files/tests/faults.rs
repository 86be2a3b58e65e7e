//! Faults that tests inject below a directory, and what a power cut may leave of what was done there.

use crate::files::Step;
use rustix::io::Errno;
use std::collections::BTreeMap;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Fault {
    /// The disk is full from here on.
    Full,
    /// The same, after half of what is written here.
    Torn,
    /// The disk fails once.
    Io,
    /// The system takes half of what is written, once.
    Short,
}

/// A step that was done.
#[derive(Debug, Clone)]
enum Done {
    Create(PathBuf),
    Write(PathBuf, Vec<u8>),
    Cut(PathBuf, u64),
    Sync(PathBuf),
    Rename(PathBuf, PathBuf),
    Remove(PathBuf),
    SyncDir(PathBuf),
}

struct Plan {
    root: PathBuf,
    fault: Option<(usize, Fault)>,
    steps: usize,
    full: bool,
    done: Vec<Done>,
}

static PLANS: Mutex<Vec<Plan>> = Mutex::new(Vec::new());

fn plans() -> MutexGuard<'static, Vec<Plan>> {
    PLANS.lock().unwrap_or_else(PoisonError::into_inner)
}

pub(in crate::files) fn allow(step: Step, path: &Path) -> io::Result<usize> {
    let mut plans = plans();
    let Some(plan) = plans.iter_mut().find(|plan| path.starts_with(&plan.root)) else {
        return Ok(usize::MAX);
    };
    let hit = plan.fault.filter(|(at, _)| *at == plan.steps).map(|(_, fault)| fault);
    plan.steps += 1;
    let takes_space = matches!(step, Step::Create | Step::Write(_) | Step::Sync);
    if hit == Some(Fault::Io) {
        return Err(Errno::IO.into());
    }
    plan.full |= hit == Some(Fault::Full);
    if plan.full && takes_space {
        return Err(Errno::NOSPC.into());
    }
    plan.full |= hit == Some(Fault::Torn);
    let half = matches!(hit, Some(Fault::Torn | Fault::Short));
    let path = path.to_owned();
    let (done, most) = match step {
        Step::Write(bytes) if half && bytes.len() > 1 => {
            let most = bytes.len() / 2;
            (Done::Write(path, bytes[..most].to_vec()), most)
        }
        Step::Write(bytes) => (Done::Write(path, bytes.to_vec()), usize::MAX),
        Step::Create => (Done::Create(path), usize::MAX),
        Step::Cut(length) => (Done::Cut(path, length), usize::MAX),
        Step::Sync => (Done::Sync(path), usize::MAX),
        Step::Rename(to) => (Done::Rename(path, to.to_owned()), usize::MAX),
        Step::Remove => (Done::Remove(path), usize::MAX),
        Step::SyncDir => (Done::SyncDir(path), usize::MAX),
    };
    plan.done.push(done);
    Ok(most)
}

/// Everything that is done below a directory goes through it as long as it lives.
pub(crate) struct Injected(PathBuf);

impl Injected {
    pub(crate) fn new(root: &Path, fault: Option<(usize, Fault)>) -> Self {
        plans().push(Plan { root: root.to_owned(), fault, steps: 0, full: false, done: Vec::new() });
        Self(root.to_owned())
    }

    /// Steps so far.
    pub(crate) fn steps(&self) -> usize {
        plans().iter().find(|plan| plan.root == self.0).map_or(0, |plan| plan.steps)
    }

    /// End it: every content that the directory, which held `before`, may have after a power cut, with the number of steps that
    /// were done until then.
    pub(crate) fn power_cuts(self, before: &Tree) -> Vec<(usize, Tree)> {
        let done =
            plans().iter().find(|plan| plan.root == self.0).map_or(Vec::new(), |plan| plan.done.clone());
        let mut disk = Disk::default();
        for (path, bytes) in before {
            disk.names.insert(path.clone(), disk.files.len());
            disk.files.push((bytes.clone(), bytes.clone()));
        }
        disk.seen = disk.names.clone();
        let mut cuts: Vec<_> = disk.left().into_iter().map(|tree| (0, tree)).collect();
        for (i, step) in done.iter().enumerate() {
            disk.take(step);
            cuts.extend(disk.left().into_iter().map(|tree| (i + 1, tree)));
        }
        cuts
    }
}

impl Drop for Injected {
    fn drop(&mut self) {
        plans().retain(|plan| plan.root != self.0);
    }
}

/// Files with their content.
pub(crate) type Tree = BTreeMap<PathBuf, Vec<u8>>;

/// A name that a change gives to a file, or takes from it.
type Change = Vec<(PathBuf, Option<usize>)>;

/// A disk that keeps what was synced, and perhaps more.
#[derive(Default)]
struct Disk {
    /// Content on the disk, and as programs see it.
    files: Vec<(Vec<u8>, Vec<u8>)>,
    /// Names on the disk, and as programs see them.
    names: BTreeMap<PathBuf, usize>,
    seen: BTreeMap<PathBuf, usize>,
    /// Changes of names that are not on the disk for certain.
    pending: Vec<Change>,
}

impl Disk {
    fn take(&mut self, step: &Done) {
        let change = |change: Change, disk: &mut Self| {
            apply(&change, &mut disk.seen);
            disk.pending.push(change);
        };
        match step {
            Done::Create(path) => {
                self.files.push(Default::default());
                change(vec![(path.clone(), Some(self.files.len() - 1))], self);
            }
            Done::Write(path, bytes) => self.files[self.seen[path]].1.extend(bytes),
            Done::Cut(path, length) => self.files[self.seen[path]].1.truncate(*length as usize),
            Done::Sync(path) => {
                let (kept, now) = &mut self.files[self.seen[path]];
                kept.clone_from(now);
            }
            Done::Rename(from, to) => {
                change(vec![(to.clone(), Some(self.seen[from])), (from.clone(), None)], self);
            }
            Done::Remove(path) if self.seen.contains_key(path) => change(vec![(path.clone(), None)], self),
            Done::Remove(_) => {}
            Done::SyncDir(dir) => {
                let here = |change: &Change| change[0].0.parent() == Some(dir);
                self.pending
                    .iter()
                    .filter(|change| here(change))
                    .for_each(|change| apply(change, &mut self.names));
                self.pending.retain(|change| !here(change));
            }
        }
    }

    /// Any number of the changes of names, in order, or one alone; of the content that was synced nothing, half or all of the rest.
    fn left(&self) -> Vec<Tree> {
        let first = (0..=self.pending.len()).map(|count| &self.pending[..count]);
        let alone = (0..self.pending.len()).map(|at| &self.pending[at..=at]);
        let mut trees = Vec::new();
        for changes in first.chain(alone) {
            let mut names = self.names.clone();
            changes.iter().for_each(|change| apply(change, &mut names));
            for share in 0..3 {
                let content = |file: &usize| {
                    let (kept, now) = &self.files[*file];
                    match share {
                        0 => kept.clone(),
                        1 => now[..kept.len().midpoint(now.len()).min(now.len())].to_vec(),
                        _ => now.clone(),
                    }
                };
                trees.push(names.iter().map(|(path, file)| (path.clone(), content(file))).collect());
            }
        }
        trees.dedup();
        trees
    }
}

fn apply(change: &Change, names: &mut BTreeMap<PathBuf, usize>) {
    for (path, file) in change {
        match file {
            Some(file) => names.insert(path.clone(), *file),
            None => names.remove(path),
        };
    }
}

/// All files below `dir`.
pub(crate) fn tree(dir: &Path) -> Tree {
    let mut tree = Tree::new();
    for entry in std::fs::read_dir(dir).expect("listed") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            tree.extend(self::tree(&path));
        } else {
            tree.insert(path.clone(), std::fs::read(&path).expect("read"));
        }
    }
    tree
}

/// Make `dir`, with the directories that are in it, hold `tree` and no other file.
pub(crate) fn restore(dir: &Path, tree: &Tree) {
    let now = self::tree(dir);
    now.keys()
        .filter(|path| !tree.contains_key(*path))
        .for_each(|path| std::fs::remove_file(path).expect("removed"));
    let changed = tree.iter().filter(|(path, bytes)| now.get(*path) != Some(bytes));
    changed.for_each(|(path, bytes)| std::fs::write(path, bytes).expect("written"));
}
