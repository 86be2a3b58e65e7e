//! The program `coupler`: run, check.

use crate::coupling::{Coupling, CouplingError};
use crate::records::{Records, describe};
use crate::schedule::Schedule;
use crate::settings::{self, Processes, Scheme, WaitSetting};
use clap::{Parser, Subcommand};
use interface_defs::ipc::remote::{Host, HostOptions, Remote};
use interface_defs::ipc::serve::{cpu_seconds, peak_memory};
use interface_defs::ipc::{self, RunId, Wait, interrupt};
use interface_defs::toolkit::check::{CheckReport, Format};
use interface_defs::toolkit::exit::Exit;
use interface_defs::toolkit::input_error::InputError;
use interface_defs::toolkit::limits::Limits;
use interface_defs::toolkit::log::{self, LogFormat};
use interface_defs::toolkit::output::Output;
use interface_defs::toolkit::owner::{Claim, Owner};
use interface_defs::toolkit::progress::{Form, Line, Reporter};
use interface_defs::toolkit::run_dir;
use interface_defs::toolkit::scene::Scene;
use interface_defs::toolkit::screen::{complain, tell};
use interface_defs::toolkit::start_from;
use interface_defs::toolkit::summary::{Status, Summary, totals};
use interface_defs::{Failure, Participant, Progress, Statistics};
use serde_json::json;
use std::path::PathBuf;
use std::time::{Duration, Instant};

/// Names of the two solvers in a run.
const SOLVERS: [&str; 2] = ["dem", "fem"];

/// Couples a contact solver and a structure's solver over shared memory
#[derive(Parser)]
#[command(name = "coupler", version, about)]
struct Cli {
    #[command(subcommand)]
    command: Command,
    /// Form of the log lines on stderr; RUST_LOG=debug prints more
    #[arg(long, global = true, value_enum, default_value_t, value_name = "FORM")]
    log_format: LogFormat,
}

#[derive(Subcommand)]
enum Command {
    /// Lead a run: create the channels, wait for `dem` and `fem`, couple them to the end
    Run(RunArgs),
    /// Print how the scene would be coupled; start nothing
    Check {
        #[command(flatten)]
        input: Input,
        /// Form of the answer
        #[arg(long, value_enum, default_value_t, value_name = "FORM")]
        format: Format,
    },
    /// Print the JSON schema of the table that it reads: its share of `rockfall schema`
    #[command(hide = true)]
    Schema,
}

#[derive(clap::Args)]
struct Input {
    /// Scene file (TOML, SI units)
    scene: PathBuf,
    /// Set a value of the scene, as in --set coupling.scheme=weak; may be repeated
    #[arg(long = "set", value_name = "KEY=VALUE")]
    sets: Vec<String>,
}

#[derive(clap::Args)]
struct RunArgs {
    #[command(flatten)]
    input: Input,
    /// Directory of the results [default: out/NAME for the scene NAME.toml]
    #[arg(long, value_name = "DIR", help_heading = "Results")]
    out: Option<PathBuf>,
    /// Overwrite the run that the directory holds
    #[arg(long, help_heading = "Results")]
    force: bool,
    /// Print no summary
    #[arg(long, help_heading = "Results")]
    quiet: bool,
    /// Print progress on stdout, five times a second
    #[arg(long, value_enum, value_name = "FORM", help_heading = "Results")]
    progress: Option<Form>,
    /// Name of the run, the same for all its programs: 1 to 16 letters, digits, dashes
    #[arg(long, value_name = "ID", help_heading = "Connection")]
    run: RunId,
    /// Number of the process that started this one: when it ends, this one ends too
    #[arg(long, value_name = "PID", help_heading = "Connection")]
    supervisor: Option<u32>,
}

/// The whole program.
pub fn main() -> Exit {
    let cli = Cli::parse();
    let hints = matches!(&cli.command, Command::Run(args) if !args.quiet);
    log::init(cli.log_format, hints);
    let outcome = match &cli.command {
        Command::Run(args) => run(args),
        Command::Schema => {
            tell(&(crate::reference::share().to_json() + "\n"));
            Ok(Exit::Done)
        }
        Command::Check { input, format } => {
            Scene::load(&input.scene, &input.sets).and_then(|scene| check(&scene)).map(|report| {
                report.print(*format);
                Exit::Done
            })
        }
    };
    outcome.unwrap_or_else(|error| {
        complain(&error.to_string());
        Exit::BadInput
    })
}

fn run(args: &RunArgs) -> Result<Exit, InputError> {
    let started = Instant::now();
    let scene = Scene::load(&args.input.scene, &args.input.sets)?;
    let settings = settings::Coupling::of(&scene)?;
    let processes = Processes::of(&scene)?;
    let output = Output::of(&scene)?;
    let limits = Limits::of(&scene)?;
    let end_time = scene.end_time()?;
    let out = run_dir::location(args.out.as_deref(), &scene);
    start_from::refuse_own(&scene, &out)?;
    let claim = Claim { force: args.force, run: Some(args.run.clone()), supervisor: args.supervisor };
    let owner = Owner::claim(&out, &claim)?;
    owner.write_record().map_err(|e| InputError::in_file(out.display().to_string(), e.to_string()))?;
    interrupt::install();
    if let Err(failure) = ipc::clean() {
        complain(&failure.to_string());
        return Ok(Exit::Failed);
    }

    let options = HostOptions {
        run: args.run.clone(),
        timeout: Duration::from_secs_f64(processes.timeout),
        wait: match processes.wait {
            WaitSetting::Auto => Wait::Auto,
            WaitSetting::Yield => Wait::Yield,
            WaitSetting::Event => Wait::Event,
        },
        supervisor: args.supervisor,
    };
    let (host, mut remotes) = match Host::create(options, &SOLVERS) {
        Ok(created) => created,
        Err(failure) => {
            complain(&failure.to_string());
            return Ok(Exit::Failed);
        }
    };
    let [dem, fem] = &mut remotes[..] else { unreachable!("as many as names") };
    let mut records = Records::new(&out, end_time, &output, args.progress);
    let mut coupling = Coupling::new(settings, end_time, dem, fem);
    coupling.limits = limits;
    let mut reporter = Reporter::new(args.progress);
    let mut preparing = |progress: Progress| {
        tracing::debug!("{}", progress.what);
        reporter.report(|| Line { end: end_time, what: progress.what, ..Line::default() });
        Ok(())
    };
    let mut outcome = coupling.run(&mut records, &mut preparing);
    let synced = records.sync().map_err(CouplingError::Output);
    outcome = outcome.and(synced);
    let loop_ended = Instant::now();

    // An interrupted run and one that did not converge have solvers that can still tell what they did.
    let orderly = match &outcome {
        Ok(())
        | Err(CouplingError::NotConverged { .. } | CouplingError::Diverged(_) | CouplingError::Output(_)) => {
            true
        }
        Err(CouplingError::Failed(failure)) => *failure == Failure::Interrupted && coupling.is_idle(),
    };
    let mut statistics = None;
    if orderly && records.prepared_at().is_some() {
        match coupling.finish() {
            Ok(told) => statistics = Some(told),
            Err(failure) => outcome = outcome.and(Err(failure.into())),
        }
    }
    let status = match &outcome {
        Ok(()) => Status::Done,
        Err(CouplingError::Failed(Failure::Interrupted)) => Status::Interrupted,
        Err(_) => Status::Failed,
    };
    let mut summary = Summary::new(status);
    summary.message = outcome.as_ref().err().map(|error| explained(error, &coupling));
    describe(&mut summary, &coupling, &records, statistics.as_ref());
    drop(coupling);
    describe_cost(&mut summary, &records, started, loop_ended, statistics.as_ref(), dem, fem);
    if let Err(failure) = &outcome
        && statistics.is_none()
    {
        for remote in &mut remotes {
            remote.abort(&failure.to_string());
        }
    }
    for remote in &remotes {
        remote.wait_gone();
    }
    drop(remotes);
    host.close();
    if let Err(what) = owner.write_summary(&mut summary) {
        let before = summary.message.map_or(String::new(), |message| format!("{message}\n"));
        complain(&format!("{before}{what}"));
        return Ok(Exit::Failed);
    }
    if !args.quiet {
        summary.print_table(&out);
    }
    if let Some(message) = &summary.message {
        complain(message);
    }
    Ok(match outcome {
        Err(CouplingError::Failed(failure)) if failure.is_input() => Exit::BadInput,
        _ => Exit::of(summary.status),
    })
}

/// An error, with what the balance of energy says of its cause.
fn explained(error: &CouplingError, coupling: &Coupling) -> String {
    let told = match error {
        CouplingError::NotConverged { .. } => coupling.causes().beyond(&coupling.limits),
        CouplingError::Failed(Failure::Fault { .. } | Failure::Contract { .. }) => {
            coupling.causes().beyond(&coupling.limits)
        }
        _ => None,
    };
    told.map_or_else(|| error.to_string(), |cause| format!("{error}\n{cause}"))
}

fn describe_cost(
    summary: &mut Summary,
    records: &Records,
    started: Instant,
    loop_ended: Instant,
    statistics: Option<&(Statistics, Statistics)>,
    dem: &Remote,
    fem: &Remote,
) {
    let prepared = records.prepared_at().unwrap_or(loop_ended);
    let preparing = (prepared - started).as_secs_f64();
    let looping = (loop_ended - prepared).as_secs_f64();
    let exchanges = dem.exchanges() + fem.exchanges();
    let cost = &mut summary.cost;
    cost.insert("wall_s".into(), json!(started.elapsed().as_secs_f64()));
    cost.insert("loop_s".into(), json!(looping));
    cost.insert("stages".into(), json!({ "prepare_s": preparing, "loop_s": looping }));
    cost.insert("exchanges".into(), json!(exchanges));
    if let Some((dem_told, fem_told)) = statistics {
        let inside = [dem_told.solve_seconds, fem_told.solve_seconds];
        let waited = dem.waited() + fem.waited();
        if inside.iter().all(|seconds| *seconds > 0.0) && exchanges > 0 {
            let each = (waited - inside.iter().sum::<f64>()) / exchanges as f64;
            cost.insert("exchange_microseconds".into(), json!(1e6 * each));
        } else {
            let what = "exchange_microseconds is absent: a solver does not report its seconds inside solve";
            summary.warnings.push(what.into());
        }
    }
    let mut processes = serde_json::Map::new();
    // A run that ended before its second window has none to count.
    let counts: serde_json::Map<_, _> = records
        .allocations()
        .map(|n| ("allocations_after_first_window".into(), json!(n)))
        .into_iter()
        .collect();
    processes.insert(
        "coupler".into(),
        json!({
            "cpu_s": cpu_seconds(),
            "peak_memory_bytes": peak_memory(),
            "counts": counts,
        }),
    );
    for (name, told) in statistics.iter().flat_map(|(dem, fem)| [("dem", dem), ("fem", fem)]) {
        let counts: serde_json::Map<_, _> = told.counts.iter().map(|(k, v)| (k.clone(), json!(v))).collect();
        processes.insert(
            name.into(),
            json!({
                "cpu_s": told.cpu_seconds,
                "solve_s": told.solve_seconds,
                "peak_memory_bytes": told.peak_memory,
                "counts": counts,
            }),
        );
    }
    let told: Vec<&Statistics> = statistics.iter().flat_map(|(dem, fem)| [dem, fem]).collect();
    cost.insert("windows".into(), summary.coupling.get("windows").cloned().unwrap_or_default());
    cost.insert("iterations".into(), summary.coupling.get("iterations").cloned().unwrap_or_default());
    totals(cost, &told);
    cost.insert("processes".into(), processes.into());
}

/// What the coupler would do with a scene.
pub fn check(scene: &Scene) -> Result<CheckReport, InputError> {
    let settings = settings::Coupling::open(scene)?;
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
fn typical_exchange(wait: WaitSetting) -> f64 {
    match wait {
        WaitSetting::Auto | WaitSetting::Yield => 6e-6,
        WaitSetting::Event => 30e-6,
    }
}
