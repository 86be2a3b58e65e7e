//! The `main` of a solver: `run` alone, `check`, `serve` to a coupler.

pub use super::check::CheckReport;
use super::check::{self, Format};
use super::counted::Counted;
use super::exit::Exit;
use super::input_error::InputError;
use super::limits::Limits;
use super::log::{self, LogFormat};
use super::owner::{self, Claim, Owner};
use super::progress::{self, Reporter};
use super::run_dir;
use super::scene::Scene;
pub use super::schema::Share;
use super::screen::{complain, tell};
use super::solo::{self, Stage};
use super::start_from;
use super::summary::{Status, Summary};
use crate::ipc::serve::{self, Connection};
use crate::ipc::wait::is_orphan;
use crate::ipc::{RunId, Wait, interrupt};
use crate::mesh::InterfaceMesh;
use crate::message::{Fault, Hello, Plan, Ready, Statistics};
use crate::participant::Failure;
use crate::solver::{OnProgress, Solver, Window};
use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Makes the solver of a scene.
pub type Build = fn(&Scene, &Options) -> Result<Box<dyn Solver>, InputError>;

/// Says what a solver would build of a scene.
pub type Check = fn(&Scene, Option<&InterfaceMesh>) -> Result<CheckReport, InputError>;

/// What a solver's program is made of.
pub struct Program {
    /// Its name: `dem-solver`.
    pub name: &'static str,
    /// Its part in a run: `dem`.
    pub role: &'static str,
    /// What it is, in one line.
    pub about: &'static str,
    /// Make the solver of a scene.
    pub build: Build,
    /// Say what it would build; with the mesh that the structure offers to contact, if that is known.
    pub check: Check,
    /// Say what it reads of a scene and what it writes.
    pub schema: fn() -> Share,
}

/// A subcommand of one program, beside those that all solvers have.
pub struct Extra {
    /// Its name, arguments and help.
    pub command: fn() -> clap::Command,
    /// Do it.
    pub run: fn(&clap::ArgMatches) -> Result<Exit, InputError>,
}

/// What the command line tells a solver beside the scene.
#[derive(Debug, Clone, Default)]
pub struct Options {
    /// Directory of the results; `None`: write no files.
    pub out: Option<PathBuf>,
    /// Whether savings may be used (flight in closed form, skipped structure, reused answers).
    pub shortcuts: bool,
}

#[derive(Parser)]
struct Cli {
    #[command(subcommand)]
    command: Command,
    /// Form of the log lines on stderr; RUST_LOG=debug prints more
    #[arg(long, global = true, value_enum, default_value_t, value_name = "FORM")]
    log_format: LogFormat,
}

#[derive(Subcommand)]
enum Command {
    /// Run the scene with this solver alone
    Run {
        #[command(flatten)]
        input: Input,
        /// Directory of the results [default: out/NAME for the scene NAME.toml]
        #[arg(long, value_name = "DIR", help_heading = "Results")]
        out: Option<PathBuf>,
        /// Overwrite the run that the directory holds
        #[arg(long, help_heading = "Results")]
        force: bool,
        /// Print nothing but errors
        #[arg(long)]
        quiet: bool,
        /// Print progress on stdout, five times a second
        #[arg(long, value_enum, value_name = "FORM")]
        progress: Option<progress::Form>,
        /// Number of the process that started this one: when it ends, this one ends too
        #[arg(long, value_name = "PID")]
        supervisor: Option<u32>,
        #[command(flatten)]
        savings: Savings,
    },
    /// Print what would be built, critical time steps [s] and cost; start nothing
    Check {
        #[command(flatten)]
        input: Input,
        /// Form of the answer
        #[arg(long, value_enum, default_value_t, value_name = "FORM")]
        format: Format,
        /// Interface mesh of the structure (JSON, `interface` of its own check), `-`: from stdin
        #[arg(long, value_name = "FILE")]
        interface: Option<PathBuf>,
    },
    /// Print the JSON schema of the tables that it reads: its share of `rockfall schema`
    #[command(hide = true)]
    Schema,
    /// Take part in a run that a coupler leads
    Serve {
        #[command(flatten)]
        input: Input,
        /// Directory of the results [default: out/NAME for the scene NAME.toml]
        #[arg(long, value_name = "DIR", help_heading = "Results")]
        out: Option<PathBuf>,
        #[command(flatten)]
        savings: Savings,
        /// Name of the run, the same for all its programs: 1 to 16 letters, digits, dashes
        #[arg(long, value_name = "ID", help_heading = "Connection")]
        run: RunId,
        /// This solver's name in the run: `dem` or `fem` [default: its own]
        #[arg(long = "as", value_name = "NAME", help_heading = "Connection")]
        part: Option<String>,
        /// Longest time without a sign of life from the coupler [s]
        #[arg(long, value_name = "S", default_value_t = 60.0, value_parser = seconds, help_heading = "Connection")]
        timeout: f64,
        /// How to wait for a request; `yield` and `event` are kept for one version: `auto` is as fast as the better of them
        #[arg(long, value_name = "HOW", default_value_t, help_heading = "Connection")]
        wait: Wait,
        /// Number of the process that started this one: when it ends, this one ends too
        #[arg(long, value_name = "PID", help_heading = "Connection")]
        supervisor: Option<u32>,
    },
}

#[derive(clap::Args)]
struct Input {
    /// Scene file (TOML, SI units)
    scene: PathBuf,
    /// Set a value of the scene, as in --set end_time=0.5; may be repeated
    #[arg(long = "set", value_name = "KEY=VALUE")]
    sets: Vec<String>,
}

impl Input {
    fn load(&self) -> Result<Scene, InputError> {
        Scene::load(&self.scene, &self.sets)
    }
}

#[derive(clap::Args)]
struct Savings {
    /// Switch off every shortcut (flight in closed form, skipped structure), to prove that it is harmless
    #[arg(long)]
    no_shortcuts: bool,
}

/// Seconds on a command line: finite, above 0.
pub fn seconds(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(s) if s > 0.0 && Duration::try_from_secs_f64(s).is_ok() => Ok(s),
        _ => Err("it must be a number of seconds above 0".into()),
    }
}

/// The whole program: parse the command line, do it, print an error once, choose the exit code.
pub fn main(program: &Program) -> ExitCode {
    main_with(program, &[])
}

/// The same for a program with subcommands of its own.
pub fn main_with(program: &Program, extras: &[Extra]) -> ExitCode {
    let mut command =
        Cli::command().name(program.name).about(program.about).version(env!("CARGO_PKG_VERSION"));
    for extra in extras {
        command = command.subcommand((extra.command)());
    }
    let matches = command.get_matches();
    if let Some((name, own)) = matches.subcommand()
        && let Some(extra) = extras.iter().find(|e| (e.command)().get_name() == name)
    {
        let form = matches.get_one("log_format").copied().unwrap_or_default();
        log::init(form, true);
        return guarded(|| (extra.run)(own));
    }
    let cli = match Cli::from_arg_matches(&matches) {
        Ok(cli) => cli,
        Err(e) => e.exit(),
    };
    let hint =
        !matches!(cli.command, Command::Run { quiet: true, .. } | Command::Check { .. } | Command::Schema);
    log::init(cli.log_format, hint);
    guarded(|| execute(program, &cli.command))
}

/// Do it, print an error once, choose the exit code.
fn guarded(work: impl FnOnce() -> Result<Exit, InputError>) -> ExitCode {
    // A broken invariant has told its story on stderr by then; the exit code is that of a failed run.
    match std::panic::catch_unwind(std::panic::AssertUnwindSafe(work)) {
        Ok(Ok(exit)) => exit.into(),
        Ok(Err(error)) => {
            complain(&error.to_string());
            Exit::BadInput.into()
        }
        Err(_) => Exit::Failed.into(),
    }
}

fn execute(program: &Program, command: &Command) -> Result<Exit, InputError> {
    match command {
        Command::Check { input, format, interface } => {
            let mesh = interface.as_deref().map(check::read_interface).transpose()?;
            let scene = input.load()?;
            Limits::of(&scene)?;
            (program.check)(&scene, mesh.as_ref())?.print(*format);
            Ok(Exit::Done)
        }
        Command::Schema => {
            tell(&((program.schema)().to_json() + "\n"));
            Ok(Exit::Done)
        }
        Command::Run { input, out, force, quiet, progress, supervisor, savings } => {
            let scene = input.load()?;
            let limits = Limits::of(&scene)?;
            let out = run_dir::location(out.as_deref(), &scene);
            start_from::refuse_own(&scene, &out)?;
            let options = Options { out: Some(out.clone()), shortcuts: !savings.no_shortcuts };
            let mut solver = (program.build)(&scene, &options)?;
            let claim = Claim { force: *force, run: None, supervisor: *supervisor };
            let owner = Arc::new(Owner::claim(&out, &claim)?);
            owner
                .write_record()
                .map_err(|e| InputError::in_file(out.display().to_string(), e.to_string()))?;
            interrupt::install();
            end_in_time(&owner, *supervisor);
            let reporter = Reporter::new(*progress);
            let mut stage =
                Stage { role: program.role, owner: &owner, supervisor: *supervisor, limits, reporter };
            let summary = solo::run(&mut stage, solver.as_mut(), &scene)?;
            if !quiet {
                summary.print_table(&out);
            }
            if summary.status != Status::Done {
                complain(summary.message.as_deref().unwrap_or("the run failed"));
            }
            Ok(Exit::of(summary.status))
        }
        Command::Serve { input, out, savings, run, part, timeout, wait, supervisor } => {
            interrupt::install();
            let connection = Connection {
                run: run.clone(),
                name: part.clone().unwrap_or_else(|| program.role.into()),
                timeout: Duration::from_secs_f64(*timeout),
                wait: *wait,
                supervisor: *supervisor,
            };
            let built = input.load().and_then(|scene| {
                let out = run_dir::location(out.as_deref(), &scene);
                let options = Options { out: Some(out.clone()), shortcuts: !savings.no_shortcuts };
                let solver = Counted::new((program.build)(&scene, &options)?);
                Ok(Guest { solver, out, run: run.clone(), scene: scene.fingerprint() })
            });
            match built {
                Ok(mut solver) => Ok(ended(serve::serve(&mut solver, &connection))),
                Err(error) => {
                    complain(&error.to_string());
                    // The coupler would wait for a solver that never comes: tell it why.
                    let _ = serve::refuse(&error.into(), &connection);
                    Ok(Exit::BadInput)
                }
            }
        }
    }
}

/// A solver that takes part in a run: it writes only into a directory that no other run owns.
struct Guest {
    solver: Counted<Box<dyn Solver>>,
    out: PathBuf,
    run: RunId,
    /// Fingerprint of the scene, which all programs of the run compare.
    scene: String,
}

impl Solver for Guest {
    fn hello(&self) -> Hello {
        let mut hello = self.solver.hello();
        hello.capabilities.push(self.scene.clone());
        hello
    }

    fn prepare(&mut self, plan: &Plan, progress: OnProgress) -> Result<Ready, Fault> {
        owner::refuse_stranger(&self.out, &self.run).map_err(Fault::input)?;
        self.solver.prepare(plan, progress)
    }

    fn solve(&mut self, window: &Window, input: &[f64], output: &mut [f64]) -> Result<(), Fault> {
        self.solver.solve(window, input, output)
    }

    fn commit(&mut self) -> Result<(), Fault> {
        self.solver.commit()
    }

    fn finish(&mut self) -> Result<Statistics, Fault> {
        self.solver.finish()
    }
}

/// What a solver at work is given to end by itself after a signal, or without its launcher.
const LAST_WORDS: Duration = Duration::from_secs(1);

/// From now on a run of this process alone ends in time, in the middle of a window too, which may compute for hours and
/// looks at nothing else meanwhile. Between windows the run ends by itself, and with all its measures.
fn end_in_time(owner: &Arc<Owner>, supervisor: Option<u32>) {
    // Weak: the directory is given up where the run ends, and not with the process.
    let owner = Arc::downgrade(owner);
    std::thread::spawn(move || {
        let mut since: Option<Instant> = None;
        loop {
            std::thread::sleep(Duration::from_millis(100));
            let lost = supervisor.is_some_and(is_orphan);
            if !lost && !interrupt::requested() {
                continue;
            }
            if since.get_or_insert_with(Instant::now).elapsed() < LAST_WORDS {
                continue;
            }
            let Some(owner) = owner.upgrade() else { return };
            let (status, message) = if lost {
                (Status::Failed, "the launcher was lost")
            } else {
                (Status::Interrupted, "interrupted")
            };
            let mut summary = Summary { message: Some(message.into()), ..Summary::new(status) };
            summary.warnings.push("no measures: the run ended in the middle of a window".into());
            if !owner.dir().join(run_dir::SUMMARY).exists()
                && let Err(what) = owner.write_summary(&mut summary)
            {
                complain(&what);
            }
            owner.release();
            complain(message);
            std::process::exit(Exit::Failed as i32);
        }
    });
}

/// The exit code of a served run, its failure printed once.
fn ended(outcome: Result<(), Failure>) -> Exit {
    match outcome {
        Ok(()) => Exit::Done,
        Err(failure) => {
            complain(&failure.to_string());
            if failure.is_input() { Exit::BadInput } else { Exit::Failed }
        }
    }
}
