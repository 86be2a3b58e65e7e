//! `rockfall run`.

use crate::plan::{Member, Part, Plan};
use crate::progress::Bar;
use crate::record;
use crate::stop::Stop;
use crate::supervise::{Job, supervise};
use crate::validate::validate;
use crate::verdict::verdict;
use interface_defs::ipc::{self, RunId};
use interface_defs::toolkit::exit::Exit;
use interface_defs::toolkit::run_dir;
use interface_defs::toolkit::scene::Scene;
use interface_defs::toolkit::summary::{Status, Summary};
use std::io::IsTerminal;
use std::path::{Path, PathBuf};

/// What the command line asks for.
pub struct Request {
    /// Scene file.
    pub scene: PathBuf,
    /// `key=value`, as typed.
    pub sets: Vec<String>,
    /// Directory of the results.
    pub out: Option<PathBuf>,
    /// Overwrite an old run.
    pub force: bool,
    /// Use savings.
    pub shortcuts: bool,
    /// Print nothing but errors.
    pub quiet: bool,
    /// Draw a bar where there is a terminal.
    pub bar: bool,
}

/// Validate, start, watch; the summary on the screen at the end.
pub fn run(request: &Request) -> Result<Exit, Stop> {
    let scene = Scene::load(&request.scene, &request.sets)?;
    let plan = Plan::of(&scene)?;
    let reports = validate(&plan, &request.scene, &request.sets)?;
    let resolved = record::resolved(&scene, &plan, &reports)?;
    let out = run_dir::location(request.out.as_deref(), &scene);
    run_dir::prepare(&out, request.force)?;

    let run = plan.is_coupled().then(RunId::new);
    let show = request.bar && std::io::stderr().is_terminal();
    let jobs: Vec<Job> =
        plan.members.iter().map(|m| job(m, &plan, request, &out, run.as_ref(), show)).collect();
    let log = out.join(run_dir::LOG);
    let commands: Vec<_> = jobs.iter().map(|job| (job.name, job.words.clone())).collect();
    let id = run.as_ref().map(ToString::to_string);
    run_dir::remove_record(&out)
        .and_then(|()| std::fs::create_dir_all(&log))
        .and_then(|()| record::write_scene(&out, &scene, &resolved))
        .and_then(|()| record::write_run(&out, &scene, &resolved, id.as_deref(), &commands))
        .map_err(|e| Stop::input(format!("{}: cannot be written to: {e}", out.display())))?;
    match ipc::clean() {
        Ok(removed) => {
            for id in removed {
                tracing::info!("removed what the dead run {id} left behind");
            }
        }
        // A lone solver needs no shared memory.
        Err(failure) if run.is_none() => tracing::warn!("{failure}"),
        Err(failure) => return Err(Stop::failed(failure.to_string())),
    }

    let mut bar = Bar::new(show);
    let outcome = supervise(&jobs, &log, &mut bar, show).map_err(Stop::input);
    bar.finish();
    let outcome = outcome?;
    let judged = verdict(&outcome, jobs[0].name, &log);
    for end in outcome.ends.iter().filter(|end| end.forced && judged.is_ok()) {
        tracing::warn!("{} did not end by itself and was ended", end.name);
    }
    let status = match (&judged, outcome.interrupted) {
        (Ok(()), _) => Status::Done,
        (Err(stop), _) if stop.exit == Exit::Unreliable => Status::Unreliable,
        (Err(_), true) => Status::Interrupted,
        (Err(_), false) => Status::Failed,
    };
    // A foreign leader may keep no summary; one of ours that has left none has not done its work.
    let status = if status == Status::Done && !plan.members[0].foreign && !out.join(run_dir::SUMMARY).exists()
    {
        Status::Failed
    } else {
        status
    };
    let told = summary(&out, status, judged.as_ref().err());
    if !request.quiet {
        told.print_table(&out);
    }
    judged?;
    // The summary has the last word: a leader of another make may end with 0 whatever it wrote.
    match told.status {
        Status::Done => Ok(Exit::Done),
        status => {
            let message = told.message.unwrap_or_else(|| format!("the summary says: {}", status.word()));
            Err(Stop { exit: Exit::of(status), message })
        }
    }
}

/// The summary of the run. A leader that was lost has left none: then the outcome alone.
fn summary(out: &Path, status: Status, stop: Option<&Stop>) -> Summary {
    if let Ok(summary) = Summary::read(out) {
        return summary;
    }
    let mut summary = Summary::new(status);
    let lost = "the process that keeps the measures has ended without a summary";
    if status != Status::Done {
        summary.message = Some(stop.map_or_else(|| lost.into(), |stop| stop.message.clone()));
    }
    summary.warnings.push(format!("no measures: {lost}"));
    if let Err(e) = summary.write(out) {
        tracing::error!("{}: {e}", out.join(run_dir::SUMMARY).display());
    }
    summary
}

/// The command line of a member: what the scene names, and what makes it take part.
fn job(member: &Member, plan: &Plan, request: &Request, out: &Path, run: Option<&RunId>, show: bool) -> Job {
    let mut words = vec![member.program.display().to_string()];
    words.extend(member.arguments.iter().cloned());
    let leads = run.is_none() || member.part == Part::Coupler;
    words.push(if leads { "run" } else { "serve" }.into());
    words.push(request.scene.display().to_string());
    let mut option = |name: &str, value: String| words.extend([name.to_owned(), value]);
    if let Some(run) = run {
        option("--run", run.to_string());
        if !leads {
            option("--as", member.part.name().into());
        }
    }
    option("--out", out.display().to_string());
    for set in &request.sets {
        option("--set", set.clone());
    }
    if !leads {
        option("--timeout", plan.processes.timeout().to_string());
        option("--wait", plan.processes.waiting().into());
    }
    option("--supervisor", std::process::id().to_string());
    if leads && show {
        option("--progress", "json".into());
    }
    if !request.shortcuts && member.part != Part::Coupler {
        words.push("--no-shortcuts".into());
    }
    Job { name: member.part.name(), words }
}
