//! Many runs, one after the other: each is `rockfall run`, as a user would call it, into a directory of its own. What has ended
//! is kept there, so that the same command goes on where it was left.

use crate::check::plan::own_program;
use crate::front::stop::{Stop, unwritten};
use crate::run::children::{self, Destination, Events, Job, Rules};
use interface_defs::diagnostic::{Diagnostic, Place, code};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;
use std::process::Command;
use std::sync::OnceLock;
use std::time::{Duration, Instant};
use toolkit::exit::Exit;
use toolkit::files::{self, Dir};
use toolkit::provenance;
use toolkit::summary::Summary;

/// What is kept of a run that has ended, in its directory.
const RECORD: &str = "task.json";
/// Who takes part in a run.
const PROGRAMS: [&str; 4] = ["rockfall", "coupler", "dem-solver", "fem-solver"];
/// Longest limit that is one [s].
const NO_LIMIT: f64 = 1e7;

/// A run to make.
pub struct Task<'a> {
    /// The scene.
    pub scene: &'a Path,
    /// Its `--set`s.
    pub sets: Vec<&'a str>,
    /// Where its results go; what is there is overwritten.
    pub dir: &'a Path,
    /// Use savings.
    pub shortcuts: bool,
    /// It is ended after this time [s].
    pub limit: f64,
}

/// How a run has ended.
pub struct Ran {
    /// Wall time of the whole command [s].
    pub seconds: f64,
    /// Its exit code.
    pub exit: Exit,
    /// Whether it was ended from here because it took too long.
    pub too_slow: bool,
    /// What it said to be wrong, where it is not done.
    pub errors: Vec<Diagnostic>,
    /// What it came to, where it was not refused.
    pub summary: Option<Summary>,
}

impl Task<'_> {
    /// Make it; a signal ends both. `say` gets now and then the seconds since the start.
    pub fn run(&self, events: &Events, say: &mut dyn FnMut(u64)) -> Result<Ran, Stop> {
        let program = std::env::current_exe()
            .map_err(|e| Stop::failed(code::PROCESS, format!("rockfall itself is not found: {e}")))?;
        let mut command = Command::new(program);
        command.arg("run").arg(children::path(self.scene)).arg("--out").arg(children::path(self.dir));
        command.args(["--force", "--quiet"]).args(self.sets.iter().map(|set| format!("--set={set}")));
        if !self.shortcuts {
            command.arg("--no-shortcuts");
        }
        let begin = Instant::now();
        let limit = Some(Duration::from_secs_f64(self.limit.clamp(0.0, NO_LIMIT)));
        let grace = Some(children::GRACE_OF_RUN);
        let rules = Rules { grace, limit, seconds: Some(say), ..Rules::default() };
        let job = Job { name: "rockfall run".into(), command, input: None, output: Destination::Captured };
        let (end, too_slow) = children::one(job, rules, events)?;
        let exit = end.exit();
        // What is there of a run that was refused is of another one.
        let summary = Summary::read(self.dir).ok().filter(|_| exit != Exit::BadInput && !too_slow);
        let errors = if exit == Exit::Done { Vec::new() } else { end.reasons() };
        Ok(Ran { seconds: begin.elapsed().as_secs_f64(), exit, too_slow, errors, summary })
    }
}

/// What is kept of a run.
#[derive(Serialize, Deserialize)]
struct Kept<T> {
    /// The programs that computed it.
    build: Build,
    /// What was run: a hash of it, or its settings.
    of: String,
    run: T,
}

/// The programs that compute the runs of a scene: hashes by their names. `None` for one that cannot be read.
pub type Build = BTreeMap<String, Option<String>>;

/// The programs as they are now, beside this one.
pub fn build() -> &'static Build {
    static NOW: OnceLock<Build> = OnceLock::new();
    let hash = |name: &str| provenance::program(&own_program(name).ok()?).ok();
    NOW.get_or_init(|| PROGRAMS.map(|name| (name.to_owned(), hash(name))).into())
}

/// Why runs that the programs `there` computed do not count beside those of the programs `now`; `None`: they do.
pub fn of_other_build(there: &Build, now: &Build) -> Option<Diagnostic> {
    let name = now.keys().find(|name| there.get(*name) != now.get(*name))?;
    let hash = |build: &Build| build.get(name).cloned().flatten().unwrap_or("unknown".into());
    let what = format!("its runs were computed by {name} {}, and this is {name} {}", hash(there), hash(now));
    Some(Diagnostic::error(code::PROVENANCE, what).try_instead(
        "use the programs that computed them, begin anew with --force, or choose another directory with --out",
    ))
}

/// Keep that the run in `dir` has ended, what it was of, and what came of it.
pub fn keep<T: Serialize>(dir: &Path, of: &str, run: T) -> Result<(), Stop> {
    let kept = Kept { build: build().clone(), of: of.into(), run };
    Dir::create(dir).and_then(|_| files::write_json(&dir.join(RECORD), &kept)).map_err(unwritten(dir))
}

/// What was kept of the run in `dir`, with what it was of; `None`: nothing that can be read. An error: programs of another build
/// computed it.
pub fn kept<T: DeserializeOwned>(dir: &Path) -> Result<Option<(String, T)>, Diagnostic> {
    let Ok(kept) = files::read_json::<Kept<T>>(&dir.join(RECORD)) else { return Ok(None) };
    match of_other_build(&kept.build, build()) {
        Some(other) => Err(other.at(Place::file(dir.display()))),
        None => Ok(Some((kept.of, kept.run))),
    }
}

/// Whether anything was kept of a run in `dir`.
pub fn is_kept(dir: &Path) -> bool {
    dir.join(RECORD).exists()
}
