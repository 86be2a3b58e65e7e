//! `rockfall run`.

use crate::children::{self, Goes, Job, Rules, Said};
use crate::events::Events;
use crate::ground;
use crate::logs;
use crate::plan::{Member, Part, Plan};
use crate::prepared::Prepared;
use crate::progress::Bar;
use crate::record;
use crate::resume::{self, Resume};
use crate::stop::Stop;
use crate::verdict::verdict;
use crate::verify;
use clap::Args;
use interface_defs::diagnostic::{Diagnostic, code};
use interface_defs::ipc::{self, Wait};
use std::ffi::OsString;
use std::io::{self, IsTerminal};
use std::path::Path;
use std::process::Command;
use toolkit::arguments::{Input, Results};
use toolkit::exit::Exit;
use toolkit::files::Dir;
use toolkit::owner::{Claim, Owner};
use toolkit::program::Savings;
use toolkit::run_dir;
use toolkit::scene::Scene;
use toolkit::screen;
use toolkit::start_from;
use toolkit::summary::{RunStatus, Summary};

/// What the command line asks for.
#[derive(Debug, Args)]
pub struct Arguments {
    /// The scene.
    #[command(flatten)]
    pub input: Input,
    /// Where the results go.
    #[command(flatten)]
    pub results: Results,
    /// Print nothing but errors
    #[arg(long, conflicts_with = "log_format", help_heading = "Results")]
    pub quiet: bool,
    /// Which savings are used.
    #[command(flatten)]
    pub savings: Savings,
}

/// Validate, start, watch; the summary on the screen at the end.
pub fn run(request: &Arguments, json: bool) -> Result<Exit, Stop> {
    let events = Events::watch()?;
    let home = |scene: &Scene| children::path(&request.results.dir.of(scene));
    let prepared = Prepared::of(&request.input, |scene| Some(home(scene)), &events)?;
    for choice in prepared.choices() {
        tracing::info!("chosen, as the scene does not say: {}", choice.text());
    }
    let warnings = prepared.warnings()?;
    for warning in warnings.iter().filter(|_| !request.quiet) {
        tracing::warn!("{warning}");
    }
    let mut resolved = prepared.resolved()?;
    let Prepared { scene, plan, ground, reports, .. } = prepared;
    let out = home(&scene);
    clean(&plan)?;
    if events.interrupted() {
        return Err(Stop::interrupted());
    }
    start_from::refuse_own(&scene, &out)?;
    let resume = match request.results.resume {
        true => {
            resume::await_end(&out, || events.interrupted());
            resume::decide(&out, &scene, &resolved, &ground, &plan.members[0])?
        }
        false => Resume::Anew,
    };
    if let Resume::Over(summary) = &resume {
        return Ok(is_over(summary, &out, request.quiet));
    }
    let goes_on = matches!(resume, Resume::From(_));
    let results = &request.results;
    let claim = Claim { force: results.force || results.resume, resume: goes_on, ..Claim::default() };
    let owner = Owner::claim(&out, &claim)?;
    if results.resume && !request.quiet {
        say(&resume, &out);
    }
    let show = !request.quiet && !json && io::stderr().is_terminal();
    let commands: Vec<(&str, Vec<OsString>)> = (plan.members.iter())
        .map(|m| (m.part.name(), words(m, &plan, request, &owner, (show, goes_on))))
        .collect();
    let log = out.join(run_dir::LOG);
    let mut clusters = reports.iter().flat_map(|(_, report)| &report.clusters);
    let recorded = match goes_on {
        true => keep_logs(&log, &commands),
        false => ground
            .keep(&out.join(ground::FILE), &mut resolved)
            .and_then(|()| write_record(&owner, &scene, &resolved, &commands))
            .and_then(|()| clusters.try_for_each(|(rock, text)| record::write_cluster(&out, rock, text))),
    };
    recorded.map_err(|e| Stop::input(code::FILE, format!("{}: cannot be written to: {e}", out.display())))?;
    drop(ground);
    owner.share_with_children();

    let mut bar = Bar::new(show);
    let jobs = commands.iter().enumerate().map(|(index, (name, words))| {
        let output = Goes::Log { file: logs::path(&log, name), progress: index == 0 && show };
        let mut command = Command::new(&words[0]);
        command.args(&words[1..]);
        Job { name: (*name).into(), command, input: None, output }
    });
    let grace = Some(children::GRACE_OF_LEADER);
    let mut say = |said: Said| match said {
        Said::Line(line) => bar.update(line),
        Said::Seconds(_) => {}
    };
    let rules = Rules { together: true, grace, limit: None, say: Some(&mut say) };
    let outcome = children::watch(jobs.collect(), rules, &events);
    bar.finish();
    let outcome = outcome?;
    let judged = verdict(&outcome, commands[0].0, &log)
        .and_then(|()| owner.check().map_err(|what| Stop::failed(code::RESULT_DIRECTORY, what)))
        .map_err(|stop| with_full_disk(stop, &out));
    for end in outcome.ends.iter().filter(|end| end.forced && judged.is_ok()) {
        tracing::warn!("{} did not end by itself and was ended", end.name);
    }
    let status = match (&judged, outcome.interrupted) {
        (Ok(()), _) => RunStatus::Done,
        (Err(stop), _) if stop.exit == Exit::Unreliable => RunStatus::Unreliable,
        (Err(_), true) => RunStatus::Interrupted,
        (Err(_), false) => RunStatus::Failed,
    };
    // A foreign leader may keep no summary; one of ours that has left none has not done its work.
    let kept = plan.members[0].foreign || out.join(run_dir::SUMMARY).exists();
    let status = if status == RunStatus::Done && !kept { RunStatus::Failed } else { status };
    let ended = with_warnings(summary(&owner, status, judged.as_ref().err()), &warnings, &out);
    // What was interrupted goes on.
    if ended.status != RunStatus::Interrupted && owner.check().is_ok() {
        verify::seal(&out);
    }
    if !request.quiet {
        ended.print_table(&out);
    }
    judged?;
    // The summary has the last word: a leader of another make may end with 0 whatever it wrote.
    match ended.status {
        RunStatus::Done => Ok(Exit::Done),
        _ => Err(Stop::of(ended)),
    }
}

/// What the processes of a run printed before it was killed stands beside what they print now.
fn keep_logs(log: &Path, commands: &[(&str, Vec<OsString>)]) -> io::Result<()> {
    Dir::create(log)?;
    for (name, _) in commands {
        match std::fs::rename(logs::path(log, name), logs::path(log, &format!("{name}.before"))) {
            Err(e) if e.kind() != io::ErrorKind::NotFound => return Err(e),
            _ => {}
        }
    }
    Ok(())
}

/// A run that is to go on, and has come to its end before.
fn is_over(summary: &Summary, out: &Path, quiet: bool) -> Exit {
    // It was killed between its summary and its manifest.
    if !out.join(run_dir::MANIFEST).exists() {
        verify::seal(out);
    }
    if !quiet {
        summary.print_table(out);
        let (out, status) = (out.display(), summary.status.word());
        screen::show(&format!("{out}: this run is {status}; there is nothing to resume\n"));
    }
    Exit::Done
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

/// What will run, on disk before it runs.
fn write_record(
    owner: &Owner,
    scene: &Scene,
    resolved: &toml::Table,
    commands: &[(&str, Vec<OsString>)],
) -> io::Result<()> {
    let out = owner.dir();
    run_dir::remove_record(out)?;
    Dir::create(&out.join(run_dir::LOG))?;
    record::write_scene(&out.join(run_dir::SCENE), scene, resolved, Some(owner.run()))?;
    record::write_run(out, scene, resolved, owner.run(), commands)
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

/// The same with what was warned of before the start, each once: with its place, which the solvers do not know.
fn with_warnings(mut summary: Summary, before: &[Diagnostic], out: &Path) -> Summary {
    let placed =
        |w: &Diagnostic| before.iter().any(|b| b != w && Diagnostic { place: None, ..b.clone() } == *w);
    summary.warnings.retain(|w| !placed(w));
    let missing: Vec<_> = before.iter().filter(|w| !summary.warnings.contains(w)).cloned().collect();
    if missing.is_empty() {
        return summary;
    }
    summary.warnings.splice(0..0, missing);
    if let Err(e) = summary.write(out) {
        tracing::error!("{}: {e}", out.join(run_dir::SUMMARY).display());
    }
    summary
}

/// The command line of a member, program first: what the scene names, and what makes it take part. All get the resolved scene, in which
/// every default and `--set` is filled in, so that all compute the same.
fn words(
    member: &Member,
    plan: &Plan,
    request: &Arguments,
    owner: &Owner,
    (show, goes_on): (bool, bool),
) -> Vec<OsString> {
    let mut words: Vec<OsString> = vec![member.program.clone().into()];
    words.extend(member.arguments.iter().map(OsString::from));
    let leads = !plan.is_coupled() || member.part == Part::Coupler;
    words.push(if leads { "run" } else { "serve" }.into());
    words.push(owner.dir().join(run_dir::SCENE).into());
    let mut option = |name: &str, value: OsString| words.extend([name.into(), value]);
    if plan.is_coupled() {
        option("--run", owner.run().to_string().into());
        if !leads {
            option("--as", member.part.name().into());
        }
    }
    option("--out", owner.dir().into());
    if !leads {
        option("--timeout", plan.processes.timeout.to_string().into());
        // A solver of another make may not know how `auto` waits.
        if plan.processes.wait != Wait::Auto {
            option("--wait", plan.processes.wait.to_string().into());
        }
    }
    option("--supervisor", std::process::id().to_string().into());
    if leads && show {
        option("--progress", "json".into());
    }
    if request.savings.no_shortcuts {
        words.push("--no-shortcuts".into());
    }
    if leads && goes_on {
        words.push("--resume".into());
    }
    words
}
