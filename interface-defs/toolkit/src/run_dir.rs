//! The directory of a run: where it lies, and that no older run is lost unasked. See [`super::owner`] for who owns it.

use super::files::{self, Dir};
use super::scene::Scene;
use interface_defs::diagnostic::{Diagnostic, code};
use rustix::fs::FileType;
use std::io;
use std::path::{Path, PathBuf};

/// Rows of the run.
pub const HISTORY: &str = "history.csv";
/// Outcome and measures; the last of the results.
pub const SUMMARY: &str = "summary.json";
/// Of a test for approval: everything.
pub const APPROVAL: &str = "approval.json";
/// Of `rockfall trade`: the pages of its two questions, and the picture of the first.
pub const TRADE: [&str; 2] = ["trade.md", "atlas.md"];
/// The picture.
pub const TRADE_PICTURE: &str = "trade.svg";
/// All of it as one page.
pub const REPORT: &str = "report.html";
/// What the run wrote, file by file: see [`super::manifest`].
pub const MANIFEST: &str = "manifest.json";
/// Rows per coupling iteration.
pub const ITERATIONS: &str = "iterations.csv";
/// Trajectories of rocks over terrain.
pub const TRAJECTORY: &str = "trajectory.csv";
/// A picture of them.
pub const PICTURE: &str = "trajectory.svg";
/// Fields for ParaView.
pub const FIELDS: &str = "fields";
/// The scene with every default filled in.
pub const SCENE: &str = "scene.toml";
/// Version, command lines, hashes.
pub const RECORD: &str = "run.json";
/// The spheres that were made for rocks before the start.
pub const CLUSTERS: &str = "clusters";
/// Of a study with a barrier: its worst members, coupled.
pub const BARRIER: &str = "barrier";
/// The members that were chosen to run against it, and what they bring to its line.
pub const CHOSEN: &str = "chosen.json";
/// Of a study: what it was computed from, a row for each member, its journals and chunks.
pub const STUDY_RECORD: &str = "study.json";
/// Its rows.
pub const MEMBERS: &str = "members.csv";
/// Journals and chunks of members.
pub const CHUNKS: &str = "chunks";
/// The journal of a run over all members.
pub const JOURNAL: &str = "main.journal";
/// What ends the name of a chunk that is complete, and of one at work.
pub const CHUNK_ENDS: [&str; 2] = ["chunk", "part"];
/// State of the structure at the end of the run, for another run that starts from it.
pub const STRUCTURE_STATE: &str = "structure.state";
/// Checkpoints, from which a run that was killed goes on.
pub const CHECKPOINT: &str = "checkpoint";
/// What each process printed.
pub const LOG: &str = "log";

/// Where the results of `scene` go: `out`, or by default `out/<scene name>`.
pub fn location(out: Option<&Path>, scene: &Scene) -> PathBuf {
    out.map_or_else(|| Path::new("out").join(scene.name()), Path::to_path_buf)
}

/// Make the directory `dir` free for results. One that holds a run is refused, or with `force` freed of it: only
/// files that a run wrote are removed.
pub(crate) fn make_free(dir: &Path, force: bool) -> Result<(), Diagnostic> {
    let held = [HISTORY, SUMMARY].into_iter().find(|name| dir.join(name).symlink_metadata().is_ok());
    if let Some(old) = held.filter(|_| !force) {
        let what = format!("this directory holds a run already ({old})");
        return Err(Diagnostic::in_file(dir.display(), what)
            .coded(code::RESULT_DIRECTORY)
            .try_instead("choose another with --out, or overwrite it with --force"));
    }
    remove_results(dir).map_err(|e| unwritable(dir, &e))
}

/// Make the directory of a run that was killed ready to go on: what says that it has ended is removed, and what its processes had
/// begun to write.
pub(crate) fn make_ready_to_go_on(dir: &Path) -> Result<(), Diagnostic> {
    let ready = [SUMMARY, REPORT, MANIFEST].iter().try_for_each(|name| files::remove(&dir.join(name)));
    let sweep = |name: &str| files::if_there(Dir::open(&dir.join(name)))?.map_or(Ok(()), |open| open.sweep());
    let swept = ["", FIELDS, CLUSTERS, CHECKPOINT, LOG].into_iter().try_for_each(sweep);
    ready.and(swept).map_err(|e| unwritable(dir, &e))
}

/// That nothing can be written into `dir`.
pub(crate) fn unwritable(dir: &Path, error: &io::Error) -> Diagnostic {
    Diagnostic::in_file(dir.display(), format!("no results can be written here: {error}"))
        .coded(code::RESULT_DIRECTORY)
}

/// Remove the checkpoints of a run.
pub fn remove_checkpoints(dir: &Path) -> io::Result<()> {
    remove_all(&dir.join(CHECKPOINT), |name| name.ends_with(".state"))
}

/// Remove results of an older run.
fn remove_results(dir: &Path) -> io::Result<()> {
    for name in [HISTORY, SUMMARY, REPORT, MANIFEST, ITERATIONS, TRAJECTORY, PICTURE, STRUCTURE_STATE] {
        files::remove(&dir.join(name))?;
    }
    Dir::open(dir)?.sweep()?;
    remove_checkpoints(dir)?;
    remove_all(&dir.join(FIELDS), is_field_file)
}

/// Remove what the launcher of an older run wrote: scene, record, clusters, logs.
pub fn remove_record(dir: &Path) -> io::Result<()> {
    files::remove(&dir.join(SCENE))?;
    files::remove(&dir.join(RECORD))?;
    remove_all(&dir.join(CLUSTERS), |name| name.ends_with(".xyzr"))?;
    remove_all(&dir.join(LOG), |name| name.ends_with(".log"))
}

/// Remove the files of `dir` whose name is `ours`, and then `dir` itself if nothing else is in it.
fn remove_all(dir: &Path, ours: impl Fn(&str) -> bool) -> io::Result<()> {
    let Some(open) = files::if_there(Dir::open(dir))? else { return Ok(()) };
    open.sweep()?;
    let mut others = false;
    for (name, kind) in open.entries()? {
        if kind != FileType::Directory && name.to_str().is_some_and(&ours) {
            open.remove(&name)?;
        } else {
            others = true;
        }
    }
    // A link to a directory of the user stays.
    if others || dir.is_symlink() { Ok(()) } else { std::fs::remove_dir(dir) }
}

/// `name.pvd`, or `name_000001.vtu` with six digits or more.
fn is_field_file(name: &str) -> bool {
    let numbered = |stem: &str| {
        stem.rsplit_once('_').is_some_and(|(_, n)| n.len() >= 6 && n.bytes().all(|b| b.is_ascii_digit()))
    };
    name.ends_with(".pvd") || name.strip_suffix(".vtu").is_some_and(numbered)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::owner::{Claim, Owner};

    fn touch(path: PathBuf) {
        std::fs::create_dir_all(path.parent().expect("a parent")).expect("created");
        std::fs::write(path, "x").expect("written");
    }

    #[test]
    fn a_directory_that_holds_a_run_is_refused_and_force_removes_only_what_a_run_wrote() {
        let temp = tempfile::tempdir().expect("a directory");
        let dir = temp.path().join("out/drop");
        let prepare = |force| Owner::claim(&dir, &Claim { force, ..Claim::default() });
        prepare(false).expect("a new directory");
        prepare(false).expect("an empty directory");
        for name in ["history.csv", "summary.json", "fields/rock_000001.vtu", "fields/rock.pvd"] {
            touch(dir.join(name));
        }
        for name in ["notes.txt", "fields/state.pvsm", "fields/mine.vtu"] {
            touch(dir.join(name));
        }
        let refused = prepare(false).expect_err("holds a run").to_string();
        assert!(refused.contains("holds a run already (history.csv)"), "{refused}");
        assert!(refused.contains("--force"), "{refused}");
        prepare(true).expect("forced");
        for gone in ["history.csv", "summary.json", "fields/rock_000001.vtu", "fields/rock.pvd"] {
            assert!(!dir.join(gone).exists(), "{gone}");
        }
        for kept in ["notes.txt", "fields/state.pvsm", "fields/mine.vtu"] {
            assert!(dir.join(kept).exists(), "{kept}");
        }
    }

    #[test]
    fn a_file_in_the_place_of_the_directory_is_refused() {
        let temp = tempfile::tempdir().expect("a directory");
        touch(temp.path().join("out"));
        for place in ["out", "out/drop"] {
            let claim = Claim { force: true, ..Claim::default() };
            assert!(Owner::claim(&temp.path().join(place), &claim).is_err(), "{place}");
        }
    }

    #[test]
    fn results_go_by_default_to_a_directory_named_after_the_scene() {
        let scene = Scene::from_text("scenes/free-fall.toml", "").expect("a scene");
        assert_eq!(location(None, &scene), Path::new("out/free-fall"));
        assert_eq!(location(Some(Path::new("here")), &scene), Path::new("here"));
    }
}
