//! The program `coupler`: run, check.

use crate::conform::{Load, conform, text};
use crate::coupling::{Coupling, CouplingError};
use crate::guard::Outcome;
use crate::records::{Clock, Records, describe, describe_cost};
use crate::replay;
use crate::schedule::Schedule;
use crate::settings::{self, CouplingSettings, Scheme};
use clap::{Parser, Subcommand};
use interface_defs::{
    Diagnostic, Failure, Participant, Progress, code,
    ipc::{self, Wait, interrupt, remote::Host, remote::HostOptions, remote::Remote},
};
use serde_json::json;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::{Duration, Instant};
use toolkit::arguments::{AnswerForm, Input, Leader, Logging, Membership};
use toolkit::check::{CheckReport, Format};
use toolkit::checkpoint::{self, Checkpoint, Store, Subject};
use toolkit::exit::Exit;
use toolkit::limits::Limits;
use toolkit::log;
use toolkit::output::Output;
use toolkit::owner::{Claim, Owner};
use toolkit::processes::Processes;
use toolkit::program::{Savings, claim_results, guarded};
use toolkit::progress::{Line, Reporter};
use toolkit::provenance;
use toolkit::recording::{self, Recorded};
use toolkit::scene::Scene;
use toolkit::screen::{complain, show};
use toolkit::summary::{RunStatus, Summary};

/// Names of the two solvers in a run.
const SOLVERS: [&str; 2] = ["dem", "fem"];

/// Couples a contact solver and a structure's solver over shared memory
#[derive(Parser)]
#[command(name = "coupler", version, long_version = provenance::long_version(), about)]
struct Cli {
    #[command(subcommand)]
    command: Command,
    #[command(flatten)]
    logging: Logging,
}

#[derive(Subcommand)]
enum Command {
    /// Lead a run: create the channels, wait for `dem` and `fem`, couple them to the end
    Run(RunArguments),
    /// Print how the scene would be coupled; start nothing
    Check {
        #[command(flatten)]
        input: Input,
        #[command(flatten)]
        answer: AnswerForm,
    },
    /// Lead a run that examines one of its solvers: which clauses of the interface contract it keeps
    Conform(ConformArguments),
    /// Ask one solver again what a recording says that it was asked, and compare its answers: the end of `rockfall replay`
    #[command(hide = true)]
    Replay(ReplayArguments),
    /// Print the JSON schema of the table that it reads: its share of `rockfall schema`
    #[command(hide = true)]
    Schema,
}

#[derive(clap::Args)]
struct RunArguments {
    #[command(flatten)]
    input: Input,
    #[command(flatten)]
    leader: Leader,
    #[command(flatten)]
    savings: Savings,
    #[command(flatten)]
    membership: Membership,
    /// Write everything that crosses to this file, for `rockfall replay`; no checkpoints are kept then
    #[arg(long, value_name = "FILE", help_heading = "Results", conflicts_with = "resume")]
    record: Option<PathBuf>,
}

#[derive(clap::Args)]
struct ReplayArguments {
    /// Recording of a run
    file: PathBuf,
    /// Part of the solver in the run: dem or fem
    #[arg(long = "as", value_name = "NAME")]
    solver: String,
    /// Largest difference, as a share of the largest number of a field so far; 0: equal to the byte
    #[arg(long, default_value_t = 0.0, value_name = "SHARE")]
    tolerance: f64,
    /// Seconds that an answer may take
    #[arg(long, default_value_t = 60.0, value_name = "S")]
    timeout: f64,
    #[command(flatten)]
    membership: Membership,
    #[command(flatten)]
    answer: AnswerForm,
}

#[derive(clap::Args)]
struct ConformArguments {
    #[command(flatten)]
    input: Input,
    /// Solver that is examined
    #[arg(long, value_parser = SOLVERS)]
    role: String,
    /// Press on the structure in the place of a contact solver
    #[arg(long)]
    alone: bool,
    #[command(flatten)]
    answer: AnswerForm,
    #[command(flatten)]
    membership: Membership,
}

/// The whole program.
pub fn main() -> ExitCode {
    let cli = Cli::parse();
    let leader = if let Command::Run(arguments) = &cli.command { Some(&arguments.leader) } else { None };
    let hints = leader.is_some_and(|leader| !leader.quiet);
    let profile = leader.and_then(|leader| leader.profiling.profile.as_deref());
    guarded(|| {
        log::init(cli.logging.log_format, hints, (profile, "coupler"))?;
        match &cli.command {
            Command::Run(arguments) => return run(arguments),
            Command::Conform(arguments) => return examine(arguments),
            Command::Replay(arguments) => return replay(arguments),
            Command::Schema => show(&(crate::reference::share().to_json() + "\n")),
            Command::Check { input, answer } => check(&input.load()?)?.print(answer.format),
        }
        Ok(Exit::Done)
    })
}

/// What a scene says of a run, checked before anything is started.
struct Prepared {
    settings: CouplingSettings,
    processes: Processes,
    output: Output,
    limits: Limits,
    end_time: f64,
    owner: Owner,
    subject: Subject,
    resume: Option<Checkpoint>,
    recording: Option<recording::Writer>,
}

impl Prepared {
    fn new(arguments: &RunArguments) -> Result<Self, Diagnostic> {
        let scene = arguments.input.load()?;
        let mut settings = CouplingSettings::of(&scene)?;
        let processes = Processes::of(&scene)?;
        let mut output = Output::of(&scene)?;
        if arguments.savings.no_shortcuts {
            (settings.flight_window, settings.ends_at_rest) = (0.0, false);
        }
        let limits = Limits::of(&scene)?;
        let end_time = scene.end_time()?;
        let Membership { run, supervised } = &arguments.membership;
        let claim = Claim { run: Some(run.clone()), supervisor: supervised.supervisor, ..Claim::default() };
        let (owner, resume) = claim_results(&scene, &arguments.leader.results, claim)?;
        owner.write_record("coupler", "coupler")?;
        let subject = Subject::of(&scene)?;
        let record = |path: &PathBuf| {
            let unwritable = |e| Diagnostic::error(code::FILE, format!("--record {}: {e}", path.display()));
            recording::Writer::create(path, scene.text()).map_err(unwritable)
        };
        let recording = arguments.record.as_ref().map(record).transpose()?;
        if recording.is_some() {
            output.checkpoint = 0.0;
        }
        Ok(Self { settings, processes, output, limits, end_time, owner, subject, resume, recording })
    }
}

fn run(arguments: &RunArguments) -> Result<Exit, Diagnostic> {
    let started = Instant::now();
    let prepared = Prepared::new(arguments)?;
    interrupt::install();
    let Processes { timeout, wait, .. } = prepared.processes;
    let (host, mut remotes) = match host(&arguments.membership, timeout, wait, &SOLVERS) {
        Ok(created) => created,
        Err(failure) => return Ok(ended(&Diagnostic::from(&failure), false)),
    };
    let (mut summary, outcome) = couple(&prepared, arguments, started, &mut remotes);
    close(host, remotes);
    prepared.owner.conclude(&mut summary);
    let exit = summary.present(prepared.owner.dir(), arguments.leader.quiet);
    Ok(match outcome {
        Err(CouplingError::Failed(failure)) if failure.is_input() => Exit::BadInput,
        _ => exit,
    })
}

/// Channels of a run with these solvers; what dead runs left behind is removed.
fn host(of: &Membership, timeout: f64, wait: Wait, names: &[&str]) -> Result<(Host, Vec<Remote>), Failure> {
    ipc::clean()?;
    let (run, supervisor) = (of.run.clone(), of.supervised.supervisor);
    Host::create(HostOptions { run, timeout: Duration::from_secs_f64(timeout), wait, supervisor }, names)
}

/// Close the channels once the solvers are gone.
fn close(host: Host, remotes: Vec<Remote>) {
    remotes.iter().for_each(Remote::wait_gone);
    drop(remotes);
    host.close();
}

/// Say why a run has failed; its exit code.
fn ended(why: &Diagnostic, is_input: bool) -> Exit {
    complain(why);
    if is_input { Exit::BadInput } else { Exit::Failed }
}

/// Lead a run that examines a solver, and print what was found.
fn examine(arguments: &ConformArguments) -> Result<Exit, Diagnostic> {
    let scene = arguments.input.load()?;
    let settings = CouplingSettings::of(&scene)?;
    let (Processes { timeout, wait, .. }, end_time) = (Processes::of(&scene)?, scene.end_time()?);
    interrupt::install();
    let names = if arguments.alone { &SOLVERS[1..] } else { &SOLVERS };
    let created = host(&arguments.membership, timeout, wait, names);
    let (host, mut remotes) = created.map_err(|failure| Diagnostic::from(&failure))?;
    let judged = match &mut remotes[..] {
        [dem, fem] => conform(&arguments.role, (settings, end_time), (dem, fem)),
        [fem] => conform(&arguments.role, (settings, end_time), (&mut Load::default(), fem)),
        _ => unreachable!("as many as names"),
    };
    remotes.iter_mut().for_each(|remote| remote.abort("the examination is over"));
    close(host, remotes);
    let judged = match judged {
        Ok(judged) => judged,
        Err(error) => {
            let is_input = matches!(&error, CouplingError::Failed(failure) if failure.is_input());
            return Ok(ended(&Diagnostic::from(&error), is_input));
        }
    };
    let broken = judged.iter().any(|judged| judged.outcome == Outcome::Broken);
    show(&match arguments.answer.format {
        Format::Text => text(&judged),
        Format::Json => {
            let answer = json!({ "role": arguments.role, "conforms": !broken, "clauses": judged });
            format!("{answer}\n")
        }
    });
    Ok(if broken { Exit::Failed } else { Exit::Done })
}

fn replay(arguments: &ReplayArguments) -> Result<Exit, Diagnostic> {
    let mut recording = recording::Reader::open(&arguments.file)?;
    let known = SOLVERS.contains(&arguments.solver.as_str());
    let good = known && arguments.tolerance >= 0.0 && arguments.timeout > 0.0;
    if !good {
        let what = "--as is dem or fem, --tolerance 0 or above, --timeout above 0";
        return Err(Diagnostic::error(code::ARGUMENT, what));
    }
    interrupt::install();
    let created = host(&arguments.membership, arguments.timeout, Wait::default(), &[&arguments.solver]);
    let (host, mut remotes) = created.map_err(|failure| Diagnostic::from(&failure))?;
    let outcome = replay::replay(&mut remotes[0], &mut recording, arguments.tolerance);
    if let Err(failure) = &outcome {
        remotes[0].abort(&failure.to_string());
    }
    close(host, remotes);
    match outcome {
        Ok(report) => {
            let json = || serde_json::to_string_pretty(&report).expect("plain data") + "\n";
            show(&if arguments.answer.format == Format::Json { json() } else { report.to_text() });
            Ok(if report.first.is_none() && !report.cut { Exit::Done } else { Exit::Failed })
        }
        Err(failure) => Ok(ended(&Diagnostic::from(&failure), failure.is_input())),
    }
}

/// The loop from the first agreement to the last window, and the summary of it, whatever has come. Solvers that cannot end in
/// order are given the reason.
fn couple(
    prepared: &Prepared,
    arguments: &RunArguments,
    started: Instant,
    remotes: &mut [Remote],
) -> (Summary, Result<(), CouplingError>) {
    let (end_time, form) = (prepared.end_time, arguments.leader.progress);
    let mut records = Records::new(prepared.owner.dir(), end_time, &prepared.output, form);
    records.with_fields(prepared.output.fields.filter(|_| prepared.processes.fem.is_some()));
    let from = prepared.resume.as_ref();
    let dir = prepared.owner.dir();
    let checkpoints = Store::new(dir, prepared.subject.clone(), prepared.output.checkpoint, from);
    let kept = records.keep_in(checkpoints, from);
    let [dem, fem] = &mut *remotes else { unreachable!("as many as names") };
    let mut recorded;
    let (dem, fem): (&mut dyn Participant, &mut dyn Participant) = match &prepared.recording {
        None => (dem, fem),
        Some(file) => {
            recorded = [Recorded::new(dem, file), Recorded::new(fem, file)];
            let [dem, fem] = &mut recorded;
            (dem, fem)
        }
    };
    let mut coupling = Coupling::new(prepared.settings.clone(), end_time, dem, fem);
    coupling.limits = prepared.limits;
    let mut reporter = Reporter::new(form);
    let mut preparing = |progress: Progress| {
        tracing::debug!("{}", progress.what);
        reporter.report(|| Line { end: end_time, what: progress.what, ..Line::default() });
        Ok(())
    };
    let mut outcome = match kept {
        Ok(kept) => {
            coupling.resume = kept;
            coupling.run(&mut records, &mut preparing)
        }
        Err(fault) => Err(Failure::Fault { solver: "coupler".into(), fault }.into()),
    };
    let synced = records.sync().map_err(CouplingError::output);
    outcome = outcome.and(synced);
    let clock = Clock { started, loop_ended: Instant::now() };
    let mut statistics = None;
    if ends_in_order(&outcome, &coupling) && records.have_begun() {
        match coupling.finish() {
            Ok(both) => statistics = Some(both),
            Err(failure) => outcome = outcome.and(Err(failure.into())),
        }
    }
    if let Some(Err(e)) = prepared.recording.as_ref().map(recording::Writer::flush) {
        let why = Diagnostic::error(code::NOT_WRITTEN, format!("--record: it cannot be written: {e}"));
        outcome = outcome.and(Err(CouplingError::output(why)));
    }
    let status = match &outcome {
        Ok(()) => RunStatus::Done,
        Err(CouplingError::Failed(Failure::Interrupted)) => RunStatus::Interrupted,
        Err(_) => RunStatus::Failed,
    };
    let mut summary = match &outcome {
        Ok(()) => Summary::new(status),
        Err(error) => Summary::ended(status, error.into()),
    };
    if let Some(cause) = outcome.as_ref().err().and_then(|error| cause(error, &coupling)) {
        summary.fail(cause);
    }
    describe(&mut summary, &coupling, &records, statistics.as_ref());
    summary.warnings.extend(from.map(|from| checkpoint::of_last_part(from.time)));
    drop(coupling);
    describe_cost(&mut summary, &records, &clock, statistics.as_ref(), remotes);
    if let (Err(failure), None) = (&outcome, &statistics) {
        remotes.iter_mut().for_each(|remote| remote.abort(&failure.to_string()));
    }
    (summary, outcome)
}

/// Whether the solvers can still report what they did: after an interrupt between two requests, and where a window did not
/// converge.
fn ends_in_order(outcome: &Result<(), CouplingError>, coupling: &Coupling) -> bool {
    match outcome {
        Ok(())
        | Err(CouplingError::NotConverged(_) | CouplingError::Diverged(_) | CouplingError::Output(_)) => true,
        Err(CouplingError::Failed(failure)) => *failure == Failure::Interrupted && coupling.is_idle(),
    }
}

/// What the balance of energy says of the cause of an error.
fn cause(error: &CouplingError, coupling: &Coupling) -> Option<Diagnostic> {
    match error {
        CouplingError::NotConverged(_)
        | CouplingError::Failed(Failure::Fault { .. } | Failure::Contract { .. }) => {
            coupling.causes().beyond(&coupling.limits)
        }
        _ => None,
    }
}

/// What the coupler would do with a scene.
pub fn check(scene: &Scene) -> Result<CheckReport, Diagnostic> {
    let settings = CouplingSettings::open(scene)?;
    let processes = Processes::of(scene)?;
    let output = Output::of(scene)?;
    let end_time = scene.end_time()?;
    let mut report = CheckReport::default();
    let mut report_number = |name: &str, value: f64| report.numbers.insert(name.to_string(), value);
    report_number("seconds_per_exchange", typical_exchange(processes.wait));
    if settings.time_window.is_nan() {
        report.builds.push("coupling: scheme and window are not given; `rockfall` chooses them".into());
    } else {
        let shortest = settings.shortest_window();
        let windows = Schedule::new(settings.time_window, end_time, shortest).full_windows();
        report_number("time_window_s", settings.time_window);
        report_number("windows", windows as f64);
        report_number("min_window_s", shortest);
        let scheme = match settings.scheme {
            _ if !settings::names(scene, "scheme") => {
                "without a scheme, which `rockfall` chooses (alone: weak)"
            }
            Scheme::Weak => "weak: one pass per window",
            Scheme::Strong => "strong: until both agree",
        };
        report.builds.push(format!("coupling {scheme}, {windows} windows of {} s", settings.time_window));
    }
    let table = |value: Result<toml::Table, toml::ser::Error>| {
        value.map_err(|e| scene.invalid("coupling", format!("cannot be written out: {e}")))
    };
    report.resolved.insert("coupling".into(), table(toml::Table::try_from(&settings))?.into());
    report.resolved.insert("processes".into(), table(toml::Table::try_from(&processes))?.into());
    let limits = Limits::of(scene)?;
    report.warnings = settings.warnings(scene)?;
    report.resolved.insert("limits".into(), table(toml::Table::try_from(limits))?.into());
    report.resolved.insert("output".into(), table(toml::Table::try_from(&output))?.into());
    Ok(report)
}

/// What one exchange costs on a free machine [s], as measured by the benchmark `exchange`.
fn typical_exchange(wait: Wait) -> f64 {
    match wait {
        Wait::Auto => 6e-6,
        Wait::Event => 30e-6,
    }
}
