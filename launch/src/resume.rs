//! `rockfall run SCENE --resume`: whether the run in the directory is the one that was asked for, and from where it goes on.

use crate::ground::Ground;
use crate::plan::Member;
use crate::record;
use crate::stop::Stop;
use interface_defs::diagnostic::{Diagnostic, code};
use std::path::Path;
use std::time::{Duration, Instant};
use toml::Table;
use toolkit::checkpoint::Found;
use toolkit::files;
use toolkit::owner::holder;
use toolkit::provenance;
use toolkit::run_dir::{HISTORY, RECORD, SCENE};
use toolkit::scene::Scene;
use toolkit::summary::{RunStatus, Summary};

/// What `--resume` comes to.
#[derive(Debug)]
pub enum Resume {
    /// The run has come to its end before.
    Over(Box<Summary>),
    /// It goes on at this time [s], which it had reached.
    From(f64),
    /// There is nothing to go on from.
    Anew,
}

/// How long the processes of a run whose `rockfall` was killed may take to notice it and to end.
const LAST_WINDOW: Duration = Duration::from_secs(3);

/// Where a run was killed a moment ago, its processes may be at their last window: wait for them, unless `interrupted`.
pub fn await_end(out: &Path, mut interrupted: impl FnMut() -> bool) {
    let until = Instant::now() + LAST_WINDOW;
    while holder(out).is_some() && Instant::now() < until && !interrupted() {
        std::thread::sleep(Duration::from_millis(20));
    }
}

/// Look into `out`. Refused is a run of another scene, of other input files, or of another build of the program that `leads` it.
pub fn decide(
    out: &Path,
    scene: &Scene,
    resolved: &Table,
    ground: &Ground,
    leads: &Member,
) -> Result<Resume, Stop> {
    if holder(out).is_some() {
        // Who owns it is named where it is claimed.
        return Ok(Resume::Anew);
    }
    if !out.join(SCENE).exists() {
        let unknown = || refuse(out, format!("it holds rows of a run, and no {SCENE} that says of which"));
        return if out.join(HISTORY).exists() { Err(unknown()) } else { Ok(Resume::Anew) };
    }
    // Before the scene: another build may have other defaults.
    let newest = Found::of(out).usable(out)?;
    if let Some(newest) = newest.as_ref().filter(|_| !leads.foreign) {
        let now = provenance::program(&leads.program)
            .map_err(|e| Stop::input(code::FILE, format!("{}: {e}", leads.program.display())))?;
        newest.refuse_other_build(out, &now)?;
    }
    same_scene(out, resolved, ground)?;
    same_inputs(out, scene, resolved)?;
    if let Ok(summary) = Summary::read(out)
        && matches!(summary.status, RunStatus::Done | RunStatus::Unreliable)
    {
        return Ok(Resume::Over(Box::new(summary)));
    }
    Ok(newest.map_or(Resume::Anew, |newest| Resume::From(newest.time)))
}

fn refuse(out: &Path, what: String) -> Stop {
    Diagnostic::in_file(out.display().to_string(), what)
        .coded(code::RESULT_DIRECTORY)
        .try_instead("begin it anew with --force, or choose another directory with --out")
        .into()
}

/// The scene of the run, every default filled in, must be the one at hand.
fn same_scene(out: &Path, resolved: &Table, ground: &Ground) -> Result<(), Stop> {
    let path = out.join(SCENE);
    let read = files::read_text(&path).map_err(|e| refuse(out, format!("{SCENE} cannot be read: {e}")))?;
    let mut before: Table =
        read.parse().map_err(|e| refuse(out, format!("{SCENE} is none of a run: {e}")))?;
    let mut now = resolved.clone();
    // Made from the rest of the scene, and lies in this directory.
    [&mut before, &mut now].into_iter().for_each(|table| ground.forget(table));
    let keys = before.keys().chain(now.keys().filter(|key| !before.contains_key(*key)));
    let differs = |key: &&String| text(before.get(*key)) != text(now.get(*key));
    let differing: Vec<String> = keys.filter(differs).map(|key| format!("`{key}`")).collect();
    if differing.is_empty() {
        return Ok(());
    }
    Err(refuse(out, format!("it holds a run of another scene, which differs in {}", differing.join(", "))))
}

/// As it is written: a number that was given as a whole one is read as such.
fn text(value: Option<&toml::Value>) -> Option<String> {
    value.map(toml::Value::to_string)
}

/// The files that the scene names must be those that the run has read.
fn same_inputs(out: &Path, scene: &Scene, resolved: &Table) -> Result<(), Stop> {
    let Ok(text) = files::read_text(&out.join(RECORD)) else { return Ok(()) };
    let run: serde_json::Value = serde_json::from_str(&text).unwrap_or_default();
    let now = record::hashes(scene, resolved).map_err(|e| Stop::input(code::FILE, e.to_string()))?;
    let own = scene.path().display().to_string();
    for (path, hash) in now.iter().filter(|(path, _)| **path != own) {
        let before = &run["inputs"][path];
        if before.is_string() && before != hash {
            return Err(refuse(out, format!("{path} is not what it was when the run began")));
        }
    }
    Ok(())
}
