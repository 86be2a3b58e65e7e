//! `rockfall run`: prepare, start, watch, conclude.
//!
//! - [`command`]: the command line of each process; [`verdict`](mod@verdict): what their ends mean: one exit code, and why
//! - [`record`]: on disk before it runs: `scene.toml` with every default, `run.json`; whether a run that was killed can go on there
//! - [`children`]: start programs, watch them, end them ([`progress`]), logs of bounded length
//! - [`sweep`]: many runs, each kept; [`refine`]: one more with half the steps

pub mod children;
mod command;
pub mod progress;
pub mod record;
mod refine;
pub mod sweep;
pub mod verdict;

use crate::check::ground;
use crate::check::numbers::Numbers;
use crate::check::plan::{Part, Plan};
use crate::check::prepared::Prepared;
use crate::front::stop::Stop;
use crate::report;
use children::{Destination, Events, Job, Outcome, Rules};
use clap::Args;
use command::{by_hand, commands};
use interface_defs::RunId;
use interface_defs::diagnostic::{Diagnostic, code};
use interface_defs::ipc;
use progress::{Progress, far};
use record::Resume;
use std::ffi::OsString;
use std::io;
use std::path::{Path, PathBuf};
use std::process::Command;
use toml::Table;
use toolkit::arguments::{Input, Profiling, Results};
use toolkit::exit::Exit;
use toolkit::files::{self, Dir};
use toolkit::limits::Limits;
use toolkit::output::Output;
use toolkit::owner::{Claim, Owner};
use toolkit::program::Savings;
use toolkit::progress::Line;
use toolkit::scene::Scene;
use toolkit::summary::{RunStatus, Summary};
use toolkit::{manifest, profile, run_dir, screen, start_from};
use verdict::verdict;

/// What the command line asks for.
#[derive(Debug, Args)]
pub struct RunArguments {
    /// The scene.
    #[command(flatten)]
    pub input: Input,
    /// Where the results go.
    #[command(flatten)]
    pub results: Results,
    /// Print nothing but errors
    #[arg(long, conflicts_with = "log_format", help_heading = "Results")]
    pub quiet: bool,
    /// Where the times of its processes go.
    #[command(flatten)]
    pub profiling: Profiling,
    /// Which savings are used.
    #[command(flatten)]
    pub savings: Savings,
    /// Run the scene once more with half the windows and steps, into DIR/refined, and state by how much each measure may be off
    #[arg(long, help_heading = "Results")]
    pub refine: bool,
    /// Write everything that crosses between the programs of a coupled run to this file, for `rockfall replay`
    #[arg(long, value_name = "FILE", help_heading = "Results", conflicts_with = "resume")]
    pub record: Option<PathBuf>,
    /// Print the commands that do the same by hand, to be started in any order once the first has ended; start nothing
    #[arg(
        long,
        value_name = "RUN_ID",
        num_args = 0..=1,
        require_equals = true,
        default_missing_value = "by-hand",
        conflicts_with_all = ["resume", "refine", "profile"]
    )]
    pub print_commands: Option<RunId>,
}

/// Prepare, start, watch, conclude.
pub fn run(request: &RunArguments, json: bool) -> Result<Exit, Stop> {
    let events = Events::watch()?;
    let Some(mut run) = Run::prepare(request, json, &events)? else { return Ok(Exit::Done) };
    let jobs = run.start()?;
    let outcome = run.watch(jobs, json, &events)?;
    run.conclude(&outcome, &events)
}

/// A run that is on disk, and owns its directory.
struct Run<'a> {
    request: &'a RunArguments,
    plan: Plan,
    numbers: Numbers,
    limits: Limits,
    output: Output,
    /// What the user was warned of before the start.
    warnings: Vec<Diagnostic>,
    /// The scene with every default filled in.
    resolved: Table,
    out: PathBuf,
    owner: Owner,
    /// Program and arguments of each process by its name, the leader's first.
    commands: Vec<(&'static str, Vec<OsString>)>,
    progress: Progress,
    /// Where the times of all processes go together.
    profile: Option<files::Stream>,
}

impl<'a> Run<'a> {
    /// All up to the record on disk; nothing is started where it is refused. `None`: there is nothing to start.
    fn prepare(request: &'a RunArguments, json: bool, events: &Events) -> Result<Option<Self>, Stop> {
        let (results, quiet) = (&request.results, request.quiet);
        let home = |scene: &Scene| children::path(&results.dir.of(scene));
        let prepared = Prepared::of(&request.input, |scene| Some(home(scene)), events)?;
        for choice in prepared.choices() {
            tracing::info!("chosen, as the scene does not say: {}", choice.text());
        }
        let warnings = prepared.warnings()?;
        for warning in warnings.iter().filter(|_| !quiet) {
            tracing::warn!("{warning}");
        }
        let resolved = prepared.resolved()?;
        let Prepared { scene, plan, ground, reports, numbers, .. } = prepared;
        let (limits, output) = (Limits::of(&scene)?, Output::of(&scene)?);
        if request.record.is_some() && !plan.is_coupled() {
            return Err(Stop::input(code::ARGUMENT, "--record: nothing crosses in a run of one program"));
        }
        let out = home(&scene);
        if let Some(id) = &request.print_commands {
            screen::show(&by_hand(&plan, request, (&out, id)));
            return Ok(None);
        }
        clean(&plan)?;
        if events.interrupted() {
            return Err(Stop::interrupted());
        }
        start_from::refuse_own(&scene, &out)?;
        refuse_home_of(&scene, &out)?;
        let resume = if results.resume {
            record::await_end(&out, || events.interrupted());
            record::decide(&out, &scene, &resolved, &ground, &plan.members[0])?
        } else {
            Resume::Anew
        };
        if let Resume::Over(summary) = &resume {
            is_over(summary, &out, quiet);
            return Ok(None);
        }
        let goes_on = matches!(resume, Resume::From(_));
        let claim = Claim { force: results.force || results.resume, resume: goes_on, ..Claim::default() };
        let owner = Owner::claim(&out, &claim)?;
        if results.resume && !quiet {
            say(&resume, &out);
        }
        let progress = Progress::new(quiet, json, true);
        progress.begin("starting");
        let commands = commands(&plan, request, &owner, (progress.moves(), goes_on));
        let profile = None;
        let mut run = Self {
            request,
            plan,
            numbers,
            limits,
            output,
            warnings,
            resolved,
            out,
            owner,
            commands,
            progress,
            profile,
        };
        let mut clusters = reports.iter().flat_map(|(_, report)| &report.clusters);
        let recorded =
            ground.keep(&run.out.join(ground::FILE), &mut run.resolved).and_then(|()| match goes_on {
                // It may have other deadlines than before.
                true => run.keep_logs().and_then(|()| run.write_scene(&scene)),
                false => run.write_record(&scene).and_then(|()| {
                    clusters.try_for_each(|(rock, text)| record::write_cluster(&run.out, rock, text))
                }),
            });
        recorded.map_err(|e| {
            Stop::input(code::FILE, format!("{}: cannot be written to: {e}", run.out.display()))
        })?;
        let profile = request.profiling.profile.as_deref().map(files::create).transpose();
        run.profile =
            profile.map_err(|e| Stop::input(code::FILE, format!("--profile: it cannot be written: {e}")))?;
        Ok(Some(run))
    }

    /// Directory of the logs.
    fn log(&self) -> PathBuf {
        self.out.join(run_dir::LOG)
    }

    fn write_scene(&self, scene: &Scene) -> io::Result<()> {
        record::write_scene(&self.out.join(run_dir::SCENE), scene, &self.resolved, Some(self.owner.run()))
    }

    /// What will run, on disk before it runs.
    fn write_record(&self, scene: &Scene) -> io::Result<()> {
        run_dir::remove_record(&self.out)?;
        Dir::create(&self.log())?;
        self.write_scene(scene)?;
        record::write_run(&self.out, scene, &self.resolved, self.owner.run(), &self.commands)
    }

    /// What the processes of a run printed before it was killed stands beside what they print now.
    fn keep_logs(&self) -> io::Result<()> {
        let log = self.log();
        Dir::create(&log)?;
        for (name, _) in &self.commands {
            let before = children::log_file(&log, &format!("{name}.before"));
            files::if_there(std::fs::rename(children::log_file(&log, name), before))?;
        }
        Ok(())
    }

    /// The processes, which inherit the lock of the directory.
    fn start(&self) -> Result<Vec<Job>, Stop> {
        self.owner.share_with_children();
        let (log, show) = (self.log(), self.progress.moves());
        let jobs = self.commands.iter().enumerate().map(|(index, (name, words))| {
            let output =
                Destination::Log { file: children::log_file(&log, name), progress: index == 0 && show };
            let mut command = Command::new(&words[0]);
            command.args(&words[1..]);
            Job { name: (*name).into(), command, input: None, output }
        });
        Ok(jobs.collect())
    }

    /// Until all processes have ended.
    fn watch(&mut self, jobs: Vec<Job>, json: bool, events: &Events) -> Result<Outcome, Stop> {
        // Where there is no bar, a line now and then.
        let lines = Progress::new(self.request.quiet || self.progress.moves(), json, false);
        let out = &self.out;
        let mut said = |spent| lines.say(&format!("{}, after {spent} s", far(out)));
        let progress = &mut self.progress;
        let mut told = |line: &Line| progress.update(line);
        let rules = Rules {
            together: true,
            grace: Some(children::GRACE_OF_LEADER),
            progress: Some(&mut told),
            seconds: Some(&mut said),
            ..Rules::default()
        };
        let outcome = children::watch(jobs, rules, events);
        self.progress.finish();
        outcome
    }

    /// Judge how they ended, complete the summary, write the report; the summary on the screen.
    fn conclude(mut self, outcome: &Outcome, events: &Events) -> Result<Exit, Stop> {
        let log = self.log();
        let parts = self.commands.iter().map(|(name, _)| profile::part(&log, name));
        if let Some(Err(e)) = self.profile.take().map(|file| profile::join(file, parts)) {
            tracing::error!("--profile: it cannot be written: {e}");
        }
        let mut judged = verdict(outcome, self.commands[0].0, &log)
            .and_then(|()| self.owner.check().map_err(|what| Stop::failed(code::RESULT_DIRECTORY, what)))
            .map_err(|stop| with_full_disk(stop, &self.out));
        for end in outcome.ends.iter().filter(|end| end.forced && judged.is_ok()) {
            tracing::warn!("{} did not end by itself and was ended", end.name);
        }
        let status = self.status(&judged, outcome.interrupted);
        let summary = summary(&self.owner, status, judged.as_ref().err());
        let mut ended = with_warnings(summary, &self.warnings, &self.out);
        if self.request.refine && matches!(ended.status, RunStatus::Done | RunStatus::Unreliable) {
            self.refine(&mut ended, events)?;
            judged = Ok(());
        }
        // What was interrupted goes on.
        if ended.status != RunStatus::Interrupted && self.owner.check().is_ok() {
            if self.output.report {
                report::close(&self.out);
            }
            manifest::seal(&self.out);
        }
        if !self.request.quiet {
            ended.print_table(&self.out);
        }
        judged?;
        // The summary has the last word: a leader of another make may end with 0 whatever it wrote.
        match ended.status {
            RunStatus::Done => Ok(Exit::Done),
            _ => Err(Stop::of(ended)),
        }
    }

    /// The status of a run whose leader has left no summary.
    fn status(&self, judged: &Result<(), Stop>, interrupted: bool) -> RunStatus {
        // A foreign leader may keep no summary; one of ours that has left none has not done its work.
        let kept = self.plan.members[0].foreign || self.out.join(run_dir::SUMMARY).exists();
        match judged {
            Ok(()) if kept => RunStatus::Done,
            Err(stop) if stop.exit == Exit::Unreliable => RunStatus::Unreliable,
            Err(_) if interrupted => RunStatus::Interrupted,
            _ => RunStatus::Failed,
        }
    }

    /// Run the scene once more with half the steps, and say what that changes.
    fn refine(&self, ended: &mut Summary, events: &Events) -> Result<(), Stop> {
        let foreign =
            self.plan.members.iter().filter(|member| member.foreign && member.part != Part::Coupler);
        for member in foreign {
            let what = format!(
                "--refine: {} keeps its own steps; windows alone were halved",
                member.program.display()
            );
            ended.warnings.push(Diagnostic::warning(code::TRUST, what));
        }
        let how = (!self.request.savings.no_shortcuts, self.request.quiet);
        refine::refine(ended, &self.out, (&self.resolved, &self.numbers, &self.limits), how, events)?;
        if let Err(what) = self.owner.write_summary(ended) {
            tracing::error!("{what}");
        }
        Ok(())
    }
}

/// Refuse to write results among the files of the scene; a run's own directory has its scene in it.
fn refuse_home_of(scene: &Scene, out: &Path) -> Result<(), Stop> {
    let folder = scene.path().canonicalize().ok().and_then(|file| file.parent().map(Path::to_owned));
    if out.join(run_dir::RECORD).exists() || folder.is_none() || out.canonicalize().ok() != folder {
        return Ok(());
    }
    let what =
        format!("--out {}: the scene itself lies here, and results would lie among its files", out.display());
    Err(Stop::input(code::ARGUMENT, what).hinted("name a directory of its own, as in --out out/first"))
}

/// A run that is to go on, and has come to its end before.
fn is_over(summary: &Summary, out: &Path, quiet: bool) {
    // It was killed between its summary and its manifest: its checkpoints may be there.
    if !out.join(run_dir::MANIFEST).exists() {
        if let Err(e) = run_dir::remove_checkpoints(out) {
            tracing::warn!("{}: the checkpoints cannot be removed: {e}", out.display());
        }
        manifest::seal(out);
    }
    if !quiet {
        summary.print_table(out);
        let (out, status) = (out.display(), summary.status.word());
        screen::show(&format!("{out}: this run is {status}; there is nothing to resume\n"));
    }
}

/// From where a run goes on.
fn say(resume: &Resume, out: &Path) {
    let out = out.display();
    screen::show(&match resume {
        Resume::From(time) => format!("{out}: the run goes on at t = {time:.6} s\n"),
        _ => format!("{out}: there is no checkpoint to go on from; the run begins anew\n"),
    });
}

/// Remove what dead runs left in shared memory. A lone solver needs none of it.
fn clean(plan: &Plan) -> Result<(), Stop> {
    match ipc::clean() {
        Ok(removed) => {
            removed.iter().for_each(|id| tracing::info!("removed what the dead run {id} left behind"));
        }
        Err(failure) if plan.is_coupled() => return Err(Stop::failed(code::PROCESS, failure.to_string())),
        Err(failure) => tracing::warn!("{failure}"),
    }
    Ok(())
}

/// Less than this free on a disk explains why a process could not say what has happened [bytes].
const FULL: u64 = 64 * 1024;

/// A process whose log could not be written either ends without a word: the disk is looked at.
fn with_full_disk(mut stop: Stop, out: &Path) -> Stop {
    let free = rustix::fs::statvfs(out).map(|disk| disk.f_bavail * disk.f_frsize);
    if free.is_ok_and(|free| free < FULL) {
        let what = format!("no space is left on the disk of {}", out.display());
        stop.errors.push(Diagnostic::error(code::NOT_WRITTEN, what));
    }
    stop
}

/// The summary of the run. A leader that was lost has left none: then the outcome alone.
fn summary(owner: &Owner, status: RunStatus, stop: Option<&Stop>) -> Summary {
    if owner.check().is_ok()
        && let Ok(summary) = Summary::read(owner.dir())
    {
        return summary;
    }
    let lost = "the process that keeps the measures has ended without a summary";
    let mut summary = Summary::new(status);
    if status != RunStatus::Done {
        let unsaid = vec![Diagnostic::error(code::PROCESS, lost)];
        summary.reasons = stop.map_or(unsaid, |stop| stop.errors.clone());
        let all: Vec<String> = summary.reasons.iter().map(Diagnostic::to_string).collect();
        summary.message = Some(all.join("\n"));
    }
    summary.warnings.push(Diagnostic::absent("every measure", lost));
    if let Err(what) = owner.write_summary(&mut summary) {
        tracing::error!("{what}");
    }
    summary
}

/// The same with what was warned of before the start, each once: with its place, which the solvers do not know. What was expected
/// and is measured by now is left out.
fn with_warnings(mut summary: Summary, before: &[Diagnostic], out: &Path) -> Summary {
    let is_known = summary.measures.iter().any(|measure| measure.name.contains("max_penetration"));
    let is_over = |w: &Diagnostic| is_known && w.code == code::DEPTH_EXPECTED;
    let placed =
        |w: &Diagnostic| before.iter().any(|b| b != w && Diagnostic { place: None, ..b.clone() } == *w);
    let all = summary.warnings.len();
    summary.warnings.retain(|w| !placed(w) && !is_over(w));
    let missing = before.iter().filter(|w| !summary.warnings.contains(w) && !is_over(w));
    let missing: Vec<_> = missing.cloned().collect();
    if missing.is_empty() && summary.warnings.len() == all {
        return summary;
    }
    summary.warnings.splice(0..0, missing);
    if let Err(e) = summary.write(out) {
        tracing::error!("{}: {e}", out.join(run_dir::SUMMARY).display());
    }
    summary
}
