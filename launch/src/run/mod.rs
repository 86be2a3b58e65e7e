//! `rockfall run`, and how a run ended: one exit code, and why.

use crate::children::{self, End, Events, Goes, Job, Outcome, Rules, how};
use crate::ground;
use crate::plan::{Member, Part, Plan};
use crate::prepared::Prepared;
use crate::progress::{Progress, far};
use crate::record::{self, Resume};
use crate::refine;
use crate::report;
use crate::shell;
use crate::stop::Stop;
use clap::Args;
use interface_defs::RunId;
use interface_defs::diagnostic::{Diagnostic, code};
use interface_defs::ipc::{self, Wait};
use std::ffi::OsString;
use std::fmt::Write;
use std::io;
use std::path::{Path, PathBuf};
use std::process::Command;
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
    let Prepared { scene, plan, ground, reports, numbers, .. } = prepared;
    let (limits, output) = (Limits::of(&scene)?, Output::of(&scene)?);
    if request.record.is_some() && !plan.is_coupled() {
        return Err(Stop::input(code::ARGUMENT, "--record: nothing crosses in a run of one program"));
    }
    let out = home(&scene);
    if let Some(id) = &request.print_commands {
        screen::show(&by_hand(&plan, request, (&out, id)));
        return Ok(Exit::Done);
    }
    clean(&plan)?;
    if events.interrupted() {
        return Err(Stop::interrupted());
    }
    start_from::refuse_own(&scene, &out)?;
    // A run's own directory has its scene in it.
    let own = out.join(run_dir::RECORD).exists();
    let folder = scene.path().canonicalize().ok().and_then(|file| file.parent().map(Path::to_owned));
    if !own && folder.is_some() && out.canonicalize().ok() == folder {
        let what = format!(
            "--out {}: the scene itself lies here, and results would lie among its files",
            out.display()
        );
        let cure = "name a directory of its own, as in --out out/first";
        return Err(Stop::input(code::ARGUMENT, what).hinted(cure));
    }
    let resume = match request.results.resume {
        true => {
            record::await_end(&out, || events.interrupted());
            record::decide(&out, &scene, &resolved, &ground, &plan.members[0])?
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
    let mut progress = Progress::new(request.quiet, json, true);
    progress.begin("starting");
    let show = progress.moves();
    let commands: Vec<(&str, Vec<OsString>)> = (plan.members.iter())
        .map(|m| {
            let mut words = words(m, &plan, request, (owner.dir(), owner.run()));
            words.extend(["--supervisor".into(), std::process::id().to_string().into()]);
            let leads = m.part == plan.members[0].part;
            words.extend(
                (leads && show).then_some(["--progress", "json"]).into_iter().flatten().map(OsString::from),
            );
            words.extend((leads && goes_on).then(|| OsString::from("--resume")));
            (m.part.name(), words)
        })
        .collect();
    let log = out.join(run_dir::LOG);
    let mut clusters = reports.iter().flat_map(|(_, report)| &report.clusters);
    let recorded = ground.keep(&out.join(ground::FILE), &mut resolved).and_then(|()| match goes_on {
        // It may have other deadlines than before.
        true => keep_logs(&log, &commands).and_then(|()| {
            record::write_scene(&out.join(run_dir::SCENE), &scene, &resolved, Some(owner.run()))
        }),
        false => write_record(&owner, &scene, &resolved, &commands)
            .and_then(|()| clusters.try_for_each(|(rock, text)| record::write_cluster(&out, rock, text))),
    });
    recorded.map_err(|e| Stop::input(code::FILE, format!("{}: cannot be written to: {e}", out.display())))?;
    drop(ground);
    let profile = request.profiling.profile.as_deref().map(files::create).transpose();
    let profile =
        profile.map_err(|e| Stop::input(code::FILE, format!("--profile: it cannot be written: {e}")))?;
    owner.share_with_children();

    let jobs = commands.iter().enumerate().map(|(index, (name, words))| {
        let output = Goes::Log { file: children::log_file(&log, name), progress: index == 0 && show };
        let mut command = Command::new(&words[0]);
        command.args(&words[1..]);
        Job { name: (*name).into(), command, input: None, output }
    });
    let grace = Some(children::GRACE_OF_LEADER);
    let mut told = |line: &Line| progress.update(line);
    // Where there is no bar, a line now and then.
    let lines = Progress::new(request.quiet || show, json, false);
    let mut said = |spent| lines.say(&format!("{}, after {spent} s", far(&out)));
    let rules = Rules {
        together: true,
        grace,
        progress: Some(&mut told),
        seconds: Some(&mut said),
        ..Rules::default()
    };
    let outcome = children::watch(jobs.collect(), rules, &events);
    progress.finish();
    let outcome = outcome?;
    let parts = commands.iter().map(|(name, _)| profile::part(&log, name));
    if let Some(Err(e)) = profile.map(|file| profile::join(file, parts)) {
        tracing::error!("--profile: it cannot be written: {e}");
    }
    let mut judged = verdict(&outcome, commands[0].0, &log)
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
    let mut ended = with_warnings(summary(&owner, status, judged.as_ref().err()), &warnings, &out);
    if request.refine && matches!(ended.status, RunStatus::Done | RunStatus::Unreliable) {
        for member in plan.members.iter().filter(|member| member.foreign && member.part != Part::Coupler) {
            let what = format!(
                "--refine: {} keeps its own steps; windows alone were halved",
                member.program.display()
            );
            ended.warnings.push(Diagnostic::warning(code::TRUST, what));
        }
        let how = (!request.savings.no_shortcuts, request.quiet);
        refine::refine(&mut ended, &out, (&resolved, &numbers, &limits), how, &events)?;
        if let Err(what) = owner.write_summary(&mut ended) {
            tracing::error!("{what}");
        }
        judged = match ended.status {
            RunStatus::Done => Ok(()),
            _ => Err(Stop::of(ended.clone())),
        };
    }
    // What was interrupted goes on.
    if ended.status != RunStatus::Interrupted && owner.check().is_ok() {
        if output.report {
            report::close(&out);
        }
        manifest::seal(&out);
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
        let before = children::log_file(log, &format!("{name}.before"));
        let moved = std::fs::rename(children::log_file(log, name), before);
        files::if_there(moved)?;
    }
    Ok(())
}

/// A run that is to go on, and has come to its end before.
fn is_over(summary: &Summary, out: &Path, quiet: bool) -> Exit {
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

/// The command line of a member, program first: what the scene names, and what makes it take part. All get the resolved scene, in which
/// every default and `--set` is filled in, so that all compute the same.
fn words(member: &Member, plan: &Plan, request: &Arguments, (out, run): (&Path, &RunId)) -> Vec<OsString> {
    let mut words: Vec<OsString> = vec![member.program.clone().into()];
    words.extend(member.arguments.iter().map(OsString::from));
    let leads = !plan.is_coupled() || member.part == Part::Coupler;
    words.push(if leads { "run" } else { "serve" }.into());
    words.push(out.join(run_dir::SCENE).into());
    let mut option = |name: &str, value: OsString| words.extend([name.into(), value]);
    if plan.is_coupled() {
        option("--run", run.to_string().into());
        if !leads {
            option("--as", member.part.name().into());
        }
    }
    option("--out", out.into());
    if !leads {
        option("--timeout", plan.processes.timeout.to_string().into());
        // A solver of another make may not know how `auto` waits.
        if plan.processes.wait != Wait::Auto {
            option("--wait", plan.processes.wait.to_string().into());
        }
    }
    // A solver of another make may not know it.
    if request.profiling.profile.is_some() && !member.foreign {
        option("--profile", profile::part(&out.join(run_dir::LOG), member.part.name()).into());
    }
    if request.savings.no_shortcuts {
        words.push("--no-shortcuts".into());
    }
    if let Some(file) = request.record.as_ref().filter(|_| leads) {
        words.extend(["--record".into(), children::path(file).into()]);
    }
    words
}

/// What does the same as a run, a command a line, as a shell reads it: the resolved scene, then each program.
fn by_hand(plan: &Plan, request: &Arguments, (out, run): (&Path, &RunId)) -> String {
    let line = |words: &[OsString]| shell::join(words) + "\n";
    let mut check = vec!["rockfall".into(), "check".into()];
    check.extend(children::scene(&request.input));
    check.extend(["--resolved".into(), out.join(run_dir::SCENE).into()]);
    let force = request.results.force.then(|| OsString::from("--force"));
    let programs = plan.members.iter().enumerate().map(|(at, member)| {
        let mut words = words(member, plan, request, (out, run));
        words.extend(force.clone().filter(|_| at == 0));
        line(&words)
    });
    format!("mkdir -p {} && {}", shell::join([out]), line(&check)) + &programs.collect::<String>()
}

/// Lines of a log that are quoted.
const QUOTED: usize = 10;

/// What became of the run that `leader` led; `Ok` if it is done.
fn verdict(outcome: &Outcome, leader: &str, log: &Path) -> Result<(), Stop> {
    let at = outcome.ends.iter().position(|end| end.name == leader);
    let Some(at) = at else { return Err(Stop::failed(code::PROCESS, format!("{leader} was never started"))) };
    let lead = &outcome.ends[at];
    // Who ended first, before its time: the cause, unless the leader names another one.
    let first = outcome.ends[..at].first().filter(|end| !end.forced);
    if lead.status.success() {
        return Ok(());
    }
    if outcome.interrupted {
        return Err(Stop::interrupted());
    }
    if lead.forced {
        return Err(match first {
            Some(end) => lost(end, log),
            None => Stop::failed(code::PROCESS, format!("{leader} did not end and was ended")),
        });
    }
    if lead.status.code().is_none() || lead.errors.is_empty() {
        return Err(match lead.exit() {
            exit @ Exit::Unreliable => {
                let what = format!("{leader} ended with exit code 3: unreliable");
                Stop { exit, ..Stop::failed(code::TRUST, what) }
            }
            _ => lost(lead, log),
        });
    }
    let mut errors = lead.errors.clone();
    if let Some(end) = first {
        let key = about(end);
        let is_of = |error: &&mut Diagnostic| error.code == code::PROCESS && error.key.as_ref() == Some(&key);
        if let Some(error) = errors.iter_mut().find(is_of) {
            let _ =
                write!(error.message, "\n{} ended: {}{}", end.name, how(end.status), quote(log, &end.name));
        }
    }
    Err(Stop { exit: lead.exit(), errors })
}

/// The key of the scene that a process stands for.
fn about(end: &End) -> String {
    format!("processes.{}", end.name)
}

/// A process that ended without a word from the leader about it.
fn lost(end: &End, log: &Path) -> Stop {
    let name = &end.name;
    if end.errors.is_empty() {
        let what = match end.status.code() {
            Some(0) => format!("{name} ended before the run was over"),
            _ => format!("{name} was lost ({})", how(end.status)),
        };
        let error = Diagnostic::error(code::PROCESS, what + &quote(log, name)).about(about(end));
        let exit = if end.exit() == Exit::BadInput { Exit::BadInput } else { Exit::Failed };
        return Stop { exit, errors: vec![error] };
    }
    if end.exit() == Exit::BadInput {
        return Stop { exit: Exit::BadInput, errors: end.errors.clone() };
    }
    let mut errors = end.errors.clone();
    errors.iter_mut().for_each(|error| error.message = format!("{name} failed: {}", error.message));
    Stop { exit: Exit::Failed, errors }
}

/// The last lines of a log.
pub fn quote(log: &Path, name: &str) -> String {
    let path = children::log_file(log, name);
    let text = String::from_utf8_lossy(&files::read(&path, files::TEXT).unwrap_or_default()).into_owned();
    let lines: Vec<&str> = text.lines().collect();
    if lines.is_empty() {
        return format!("; it printed nothing ({})", path.display());
    }
    let mut out = format!("\nlast lines of {}:", path.display());
    for line in &lines[lines.len().saturating_sub(QUOTED)..] {
        let _ = write!(out, "\n  | {line}");
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::os::unix::process::ExitStatusExt;
    use std::process::ExitStatus;

    const KILLED: i32 = 9;

    fn status(code: i32) -> i32 {
        code << 8
    }

    /// `ends`: name, raw status, whether it was forced, what it said.
    fn judge(
        ends: &[(&str, i32, bool, Option<Diagnostic>)],
        interrupted: bool,
        logs: &[(&str, &str)],
    ) -> Result<(), Stop> {
        let temp = tempfile::tempdir().expect("a directory");
        let dir = temp.path();
        for (name, text) in logs {
            std::fs::write(children::log_file(dir, name), text).expect("written");
        }
        let end = |(index, (name, raw, forced, said)): (usize, &(&str, i32, bool, Option<Diagnostic>))| End {
            index,
            name: (*name).into(),
            status: ExitStatus::from_raw(*raw),
            forced: *forced,
            stdout: Vec::new(),
            stderr: Vec::new(),
            errors: said.iter().cloned().collect(),
        };
        let ends = ends.iter().enumerate().map(end).collect();
        verdict(&Outcome { ends, interrupted, too_slow: false }, "coupler", dir)
    }

    fn says(what: &str) -> Option<Diagnostic> {
        Some(Diagnostic::error(code::OTHER, what))
    }

    #[test]
    fn a_run_is_done_when_its_leader_says_so() {
        let fine = [("dem", 0, false, None), ("fem", 0, false, None), ("coupler", 0, false, None)];
        assert_eq!(judge(&fine, false, &[]), Ok(()));
        assert_eq!(judge(&[("coupler", 0, false, None), ("fem", KILLED, true, None)], true, &[]), Ok(()));
    }

    #[test]
    fn the_error_of_the_coupler_stays_and_the_log_of_the_lost_one_is_quoted() {
        let what = "fem was lost: its process ended in window 3";
        let of_process = |key: &str| Some(Diagnostic::error(code::PROCESS, what).about(key));
        let ends = |key| {
            let said = of_process(key);
            [
                ("fem", KILLED, false, None),
                ("dem", status(1), false, None),
                ("coupler", status(1), false, said),
            ]
        };
        let stop = judge(&ends("processes.fem"), false, &[("fem", "a\nb\n")]).expect_err("failed");
        assert_eq!((stop.exit, stop.errors.len()), (Exit::Failed, 1));
        let message = &stop.errors[0].message;
        assert!(
            message.starts_with(&format!("{what}\nfem ended: killed by signal 9\nlast lines of ")),
            "{message}"
        );
        assert!(message.ends_with("fem.log:\n  | a\n  | b"), "{message}");
        // It decides by the key, and not by the words.
        let other = judge(&ends("processes.dem"), false, &[("fem", "a\nb\n")]).expect_err("failed");
        assert_eq!(other.errors[0].message, what);
    }

    #[test]
    fn a_failure_of_the_coupling_itself_quotes_nobody() {
        let coupler = ("coupler", status(1), false, says("window 3: not converged"));
        let stop = judge(&[("dem", status(1), false, says("ended by the coupler")), coupler], false, &[]);
        assert_eq!(stop, Err(Stop::failed(code::OTHER, "window 3: not converged")));
        assert_eq!(
            judge(&[("coupler", status(2), false, says("no"))], false, &[]),
            Err(Stop::input(code::OTHER, "no"))
        );
    }

    #[test]
    fn a_run_beyond_a_bound_of_trust_is_unreliable_with_the_words_of_its_leader() {
        for (said, due) in [
            (says("unreliable: energy_error is 48 %"), "unreliable: energy_error is 48 %"),
            (None, "coupler ended with exit code 3: unreliable"),
        ] {
            let stop = judge(&[("coupler", status(3), false, said)], false, &[]).expect_err("unreliable");
            assert_eq!((stop.exit, stop.errors[0].message.as_str()), (Exit::Unreliable, due));
        }
    }

    /// What a program of others prints is quoted, and decides nothing.
    #[test]
    fn who_says_nothing_as_data_is_quoted() {
        let log = [("coupler", "error: s.toml:1:2: no such law\n")];
        let stop = judge(&[("coupler", status(1), false, None)], false, &log).expect_err("failed");
        assert!(
            stop.errors[0].message.starts_with("coupler was lost (exit code 1)\nlast lines of"),
            "{stop:?}"
        );
        assert!(stop.errors[0].message.ends_with("  | error: s.toml:1:2: no such law"), "{stop:?}");
    }

    #[test]
    fn a_coupler_that_is_killed_is_named() {
        let ends = [("coupler", KILLED, false, None), ("dem", status(1), false, None)];
        let stop = judge(&ends, false, &[]).expect_err("failed");
        assert!(stop.errors[0].message.starts_with("coupler was lost (killed by signal 9)"), "{stop:?}");
    }

    #[test]
    fn who_ended_before_the_coupler_could_see_it_is_named_with_its_own_words() {
        let coupler = || ("coupler", status(1), true, says("interrupted"));
        let stop = judge(&[("fem", status(2), false, says("no such law")), coupler()], false, &[]);
        assert_eq!(stop, Err(Stop::input(code::OTHER, "no such law")));
        let stop = judge(&[("fem", 0, false, None), coupler()], false, &[]).expect_err("failed");
        assert!(
            stop.errors[0].message.starts_with("fem ended before the run was over; it printed nothing"),
            "{stop:?}"
        );
    }

    #[test]
    fn an_interrupted_run_says_so_and_nothing_else() {
        let ends = [("coupler", status(1), false, says("interrupted")), ("dem", KILLED, true, None)];
        assert_eq!(judge(&ends, true, &[]), Err(Stop::interrupted()));
    }
}
