//! Many runs, one after the other: each is `rockfall run`, as a user would call it, into a directory of its own. What has ended
//! is kept there, so that the same command goes on where it was left.

use crate::children::{self, Goes, Job, Rules, Said};
use crate::command_line::own_program;
use crate::events::Events;
use crate::stop::Stop;
use indicatif::ProgressBar;
use interface_defs::diagnostic::{Diagnostic, Place, code};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::io::{self, IsTerminal};
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
        let mut said = |what: Said| match what {
            Said::Seconds(seconds) => say(seconds),
            Said::Line(_) => {}
        };
        let grace = Some(children::GRACE_OF_RUN);
        let rules = Rules { together: false, grace, limit, say: Some(&mut said) };
        let job = Job { name: "rockfall run".into(), command, input: None, output: Goes::Kept };
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
    let text = serde_json::to_string_pretty(&kept).map_err(io::Error::from);
    text.and_then(|text| Dir::create(dir)?.write(RECORD.as_ref(), (text + "\n").as_bytes()))
        .map_err(|e| Stop::failed(code::NOT_WRITTEN, format!("{}: cannot be written: {e}", dir.display())))
}

/// What was kept of the run in `dir`, with what it was of; `None`: nothing that can be read. An error: programs of another build
/// computed it.
pub fn kept<T: DeserializeOwned>(dir: &Path) -> Result<Option<(String, T)>, Diagnostic> {
    let text = files::read_text(&dir.join(RECORD)).ok();
    let Some(kept) = text.and_then(|text| serde_json::from_str::<Kept<T>>(&text).ok()) else {
        return Ok(None);
    };
    match of_other_build(&kept.build, build()) {
        Some(other) => Err(other.at(Place::file(dir.display().to_string()))),
        None => Ok(Some((kept.of, kept.run))),
    }
}

/// Whether anything was kept of a run in `dir`.
pub fn is_kept(dir: &Path) -> bool {
    dir.join(RECORD).exists()
}

/// What is shown while runs are at work.
pub struct Progress {
    quiet: bool,
    json: bool,
    spinner: Option<ProgressBar>,
}

impl Progress {
    /// Lines on stderr, or with `json` in the log; `spins`: and on a terminal what is at work.
    pub fn new(quiet: bool, json: bool, spins: bool) -> Self {
        let show = spins && !quiet && !json && io::stderr().is_terminal();
        let spinner = show.then(ProgressBar::new_spinner);
        if let Some(spinner) = &spinner {
            spinner.enable_steady_tick(Duration::from_millis(200));
        }
        Self { quiet, json, spinner }
    }

    /// A line that stays.
    pub fn say(&self, line: &str) {
        match &self.spinner {
            _ if self.json => tracing::info!("{line}"),
            _ if self.quiet => {}
            Some(spinner) => spinner.println(line),
            None => eprintln!("{line}"),
        }
    }

    /// What is at work.
    pub fn begin(&self, what: &str) {
        if let Some(spinner) = &self.spinner {
            spinner.set_message(what.to_owned());
        }
    }

    /// Take it off the screen.
    pub fn finish(&self) {
        if let Some(spinner) = &self.spinner {
            spinner.finish_and_clear();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_kept_is_there_with_what_it_is_of_and_nothing_is_read_of_what_is_damaged() {
        let temp = tempfile::tempdir().expect("a directory");
        let dir = temp.path().join("runs/001");
        let of = |dir: &Path| kept::<f64>(dir).expect("of this build");
        assert!(!is_kept(&dir) && of(&dir).is_none());
        keep(&dir, "window 1e-4", 2.5).expect("written");
        assert_eq!(of(&dir), Some(("window 1e-4".into(), 2.5)));
        assert!(is_kept(&dir) && kept::<Vec<String>>(&dir).expect("of this build").is_none());
        let text = std::fs::read_to_string(dir.join(RECORD)).expect("there");
        for damaged in [&text[..text.len() / 2], ""] {
            std::fs::write(dir.join(RECORD), damaged).expect("written");
            assert!(of(&dir).is_none(), "{damaged}");
        }
        let mut record: serde_json::Value = serde_json::from_str(&text).expect("JSON");
        record["build"]["coupler"] = "another".into();
        std::fs::write(dir.join(RECORD), record.to_string()).expect("written");
        let refused = kept::<f64>(&dir).expect_err("of another build");
        assert!(refused.code == code::PROVENANCE && refused.message.contains("coupler another"), "{refused}");
    }
}
