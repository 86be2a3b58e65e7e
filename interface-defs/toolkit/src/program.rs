//! The `main` of a solver: `run` alone, `check`, `serve` to a coupler.

use super::alloc::allocations;
pub use super::arguments::Savings;
use super::arguments::{
    AnswerForm, Input, Leader, Logging, Membership, Profiling, ResultDir, Results, Supervised,
};
use super::check;
pub use super::check::CheckReport;
use super::checkpoint::{self, Checkpoint};
use super::exit::Exit;
use super::limits::Limits;
use super::log;
use super::owner::{Claim, Owner, refuse_stranger};
use super::profile;
use super::progress::Reporter;
use super::provenance::{self, build_id};
use super::run_dir;
use super::scene::Scene;
pub use super::schema::Share;
use super::screen::{complain, show};
use super::simd;
use super::solo::{self, Stage};
use super::start_from;
use super::summary::{RunStatus, Summary};
use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};
use interface_defs::{
    Diagnostic, Fault, Hello, InterfaceMesh, OnProgress, Plan, Ready, RunId, Selection, Solver, Statistics,
    Window, code,
    ipc::{TIMEOUT, Wait, interrupt, serve, serve::Connection, wait::is_orphan},
    message::option,
};
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;
use std::time::Duration;

/// Makes the solver of a scene.
pub type Build = fn(&Scene, &Options) -> Result<Box<dyn Solver>, Diagnostic>;

/// Says what a solver would build of a scene; tries the run for so long where that tells its cost.
pub type Check = fn(&Scene, Option<&InterfaceMesh>, Option<Duration>) -> Result<CheckReport, Diagnostic>;

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
    pub run: fn(&clap::ArgMatches) -> Result<Exit, Diagnostic>,
}

/// What the command line says to a solver beside the scene.
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
    command: SolverCommand,
    #[command(flatten)]
    logging: Logging,
}

#[derive(Subcommand)]
enum SolverCommand {
    /// Run the scene with this solver alone
    Run(RunArguments),
    /// Print what would be built, critical time steps [s] and cost; start nothing
    Check {
        #[command(flatten)]
        input: Input,
        #[command(flatten)]
        answer: AnswerForm,
        /// Interface mesh of the structure (JSON, `interface` of its own check), `-`: from stdin
        #[arg(long, value_name = "FILE")]
        interface: Option<PathBuf>,
        /// Wall time for which the run is tried, where that tells its cost [s]
        #[arg(long = "try", value_name = "S", value_parser = seconds, hide = true)]
        trial: Option<f64>,
    },
    /// Print the JSON schema of the tables that it reads: its share of `rockfall schema`
    #[command(hide = true)]
    Schema,
    /// Take part in a run that a coupler leads
    Serve(ServeArguments),
}

#[derive(clap::Args)]
struct RunArguments {
    #[command(flatten)]
    input: Input,
    #[command(flatten)]
    leader: Leader,
    #[command(flatten)]
    supervised: Supervised,
    #[command(flatten)]
    savings: Savings,
}

#[derive(clap::Args)]
struct ServeArguments {
    #[command(flatten)]
    input: Input,
    #[command(flatten)]
    dir: ResultDir,
    #[command(flatten)]
    savings: Savings,
    #[command(flatten)]
    membership: Membership,
    #[command(flatten)]
    profiling: Profiling,
    /// This solver's name in the run: `dem` or `fem` [default: its own]
    #[arg(long = "as", value_name = "NAME", help_heading = "Connection")]
    part: Option<String>,
    /// Longest time without a sign of life from the coupler [s]
    #[arg(long, value_name = "S", default_value_t = TIMEOUT, value_parser = seconds, help_heading = "Connection")]
    timeout: f64,
    /// How to wait for a request: `auto` looks again before it sleeps, `event` sleeps at once
    #[arg(long, value_name = "HOW", default_value_t, help_heading = "Connection")]
    wait: Wait,
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
    let mut command = Cli::command()
        .name(program.name)
        .about(program.about)
        .version(env!("CARGO_PKG_VERSION"))
        .long_version(provenance::long_version());
    for extra in extras {
        command = command.subcommand((extra.command)());
    }
    let matches = command.get_matches();
    if let Some((name, own)) = matches.subcommand()
        && let Some(extra) = extras.iter().find(|e| (e.command)().get_name() == name)
    {
        let form = matches.get_one("log_format").copied().unwrap_or_default();
        return guarded(|| {
            let quiet = own.try_get_one::<bool>("quiet").ok().flatten();
            log::init(form, quiet != Some(&true), (None, program.role))?;
            (extra.run)(own)
        });
    }
    let cli = match Cli::from_arg_matches(&matches) {
        Ok(cli) => cli,
        Err(e) => e.exit(),
    };
    let (hint, profiling) = match &cli.command {
        SolverCommand::Run(arguments) => (!arguments.leader.quiet, Some(&arguments.leader.profiling)),
        SolverCommand::Serve(arguments) => (true, Some(&arguments.profiling)),
        SolverCommand::Check { .. } | SolverCommand::Schema => (false, None),
    };
    let profile = profiling.and_then(|profiling| profiling.profile.as_deref());
    guarded(|| {
        log::init(cli.logging.log_format, hint, (profile, program.role))?;
        execute(program, &cli.command)
    })
}

/// Do it, print an error once, choose the exit code.
pub fn guarded(work: impl FnOnce() -> Result<Exit, Diagnostic>) -> ExitCode {
    // A broken invariant is on stderr by then; the exit code is that of a failed run.
    let all = || simd::choose().and_then(|_| work());
    let ended = std::panic::catch_unwind(std::panic::AssertUnwindSafe(all));
    profile::end();
    match ended {
        Ok(Ok(exit)) => exit.into(),
        Ok(Err(error)) => {
            complain(&error);
            Exit::BadInput.into()
        }
        Err(_) => Exit::Failed.into(),
    }
}

fn execute(program: &Program, command: &SolverCommand) -> Result<Exit, Diagnostic> {
    match command {
        SolverCommand::Check { input, answer, interface, trial } => {
            let mesh = interface.as_deref().map(check::read_interface).transpose()?;
            let scene = input.load()?;
            Limits::of(&scene)?;
            let trial = trial.map(Duration::from_secs_f64);
            (program.check)(&scene, mesh.as_ref(), trial)?.print(answer.format);
            Ok(Exit::Done)
        }
        SolverCommand::Schema => {
            show(&((program.schema)().to_json() + "\n"));
            Ok(Exit::Done)
        }
        SolverCommand::Run(arguments) => run_alone(program, arguments),
        SolverCommand::Serve(arguments) => serve_run(program, arguments),
    }
}

/// Run the scene with this solver alone.
fn run_alone(program: &Program, arguments: &RunArguments) -> Result<Exit, Diagnostic> {
    let RunArguments { input, leader, supervised: Supervised { supervisor }, savings } = arguments;
    let supervisor = *supervisor;
    let scene = input.load()?;
    let limits = Limits::of(&scene)?;
    let out = leader.results.dir.of(&scene);
    let options = Options { out: Some(out), shortcuts: !savings.no_shortcuts };
    let mut solver = (program.build)(&scene, &options)?;
    let claim = Claim { supervisor, ..Claim::default() };
    let (owner, resume) = claim_results(&scene, &leader.results, claim)?;
    owner.write_record(program.role, program.name)?;
    let owner = Arc::new(owner);
    interrupt::install();
    end_in_time(&owner, supervisor);
    let reporter = Reporter::new(leader.progress);
    let mut stage = Stage { role: program.role, owner: &owner, supervisor, limits, reporter, resume };
    let summary = solo::run(&mut stage, solver.as_mut(), &scene)?;
    Ok(summary.present(owner.dir(), leader.quiet))
}

/// The directory of the results of `scene`, owned as `claim` says, and the checkpoint from which a run in it goes on.
///
/// # Errors
/// If the run would start from its own results, another one owns the directory, or it may neither go on in it nor begin anew.
pub fn claim_results(
    scene: &Scene,
    results: &Results,
    claim: Claim,
) -> Result<(Owner, Option<Checkpoint>), Diagnostic> {
    let out = results.dir.of(scene);
    start_from::refuse_own(scene, &out)?;
    let from = results.resume.then(|| checkpoint::to_go_on(scene, &out)).transpose()?.flatten();
    let force = results.force || (results.resume && from.is_none());
    let owner = Owner::claim(&out, &Claim { force, resume: from.is_some(), ..claim })?;
    Ok((owner, from))
}

/// Take part in a run that a coupler leads.
fn serve_run(program: &Program, arguments: &ServeArguments) -> Result<Exit, Diagnostic> {
    let run = &arguments.membership.run;
    interrupt::install();
    let connection = Connection {
        run: run.clone(),
        name: arguments.part.clone().unwrap_or_else(|| program.role.into()),
        timeout: Duration::from_secs_f64(arguments.timeout),
        wait: arguments.wait,
        supervisor: arguments.membership.supervised.supervisor,
    };
    let built = arguments.input.load().and_then(|scene| {
        let out = arguments.dir.of(&scene);
        let options = Options { out: Some(out.clone()), shortcuts: !arguments.savings.no_shortcuts };
        let solver = (program.build)(&scene, &options)?;
        Ok(Guest { solver, out, run: run.clone(), scene: scene.fingerprint(), committed: false, count: 0 })
    });
    match built {
        Ok(mut solver) => Ok(serve::serve(&mut solver, &connection).map_or_else(
            |failure| {
                complain(&Diagnostic::from(&failure));
                if failure.is_input() { Exit::BadInput } else { Exit::Failed }
            },
            |()| Exit::Done,
        )),
        Err(error) => {
            complain(&error);
            // The coupler would wait for a solver that never comes: it is given the reason.
            let _ = serve::refuse(&error.into(), &connection);
            Ok(Exit::BadInput)
        }
    }
}

/// What a solver at work is given to end by itself after a signal, or without its launcher.
const LAST_WORDS: Duration = Duration::from_secs(1);

/// From now on a run of this process alone ends in time, in the middle of a window too, which may compute for hours and
/// looks at nothing else meanwhile. Between windows the run ends by itself, and with all its measures.
fn end_in_time(owner: &Arc<Owner>, supervisor: Option<u32>) {
    // Weak: the directory is given up where the run ends, and not with the process.
    let owner = Arc::downgrade(owner);
    let must_end = move || match supervisor.is_some_and(is_orphan) {
        true => Some((RunStatus::Failed, code::PROCESS, "the launcher was lost")),
        false => interrupt::requested().then_some((RunStatus::Interrupted, code::INTERRUPTED, "interrupted")),
    };
    interrupt::watch(LAST_WORDS, must_end, move |(status, code, message)| {
        let Some(owner) = owner.upgrade() else { return };
        let mut summary = Summary::ended(status, Diagnostic::error(code, message));
        let why = "the run ended in the middle of a window";
        summary.warnings.push(Diagnostic::absent("every measure", why));
        if !owner.dir().join(run_dir::SUMMARY).exists()
            && let Err(what) = owner.write_summary(&mut summary)
        {
            complain(&Diagnostic::error(code::NOT_WRITTEN, what));
        }
        owner.release();
        summary.complain();
        std::process::exit(Exit::Failed as i32);
    });
}

/// A solver that takes part in a run which a coupler leads.
///
/// It writes only into a directory that no other run owns. To the statistics of its solver it adds the count
/// `allocations_after_first_window`, which is 0 where the program's global allocator is not
/// [`CountingAllocator`](super::alloc::CountingAllocator).
struct Guest {
    solver: Box<dyn Solver>,
    out: PathBuf,
    run: RunId,
    /// Fingerprint of the scene, which all programs of the run compare.
    scene: String,
    committed: bool,
    count: u64,
}

impl Guest {
    fn count<T>(&mut self, work: impl FnOnce(&mut dyn Solver) -> T) -> T {
        let before = allocations();
        let result = work(self.solver.as_mut());
        if self.committed {
            self.count += allocations() - before;
        }
        result
    }
}

impl Solver for Guest {
    fn hello(&self) -> Hello {
        let options = vec![(option::BUILD.to_owned(), build_id().to_string())];
        Hello { scene: self.scene.clone(), options, ..self.solver.hello() }
    }

    fn prepare(&mut self, plan: &Plan, progress: OnProgress) -> Result<Ready, Fault> {
        refuse_stranger(&self.out, &self.run)?;
        self.solver.prepare(plan, progress)
    }

    fn solve(&mut self, window: &Window, input: &[f64], output: &mut [f64]) -> Result<(), Fault> {
        self.count(|solver| solver.solve(window, input, output))
    }

    fn commit(&mut self) -> Result<(), Fault> {
        let outcome = self.count(|solver| solver.commit());
        self.committed = true;
        outcome
    }

    fn select(&mut self, selection: Option<&mut Selection>) -> Result<(), Fault> {
        self.count(|solver| solver.select(selection))
    }

    fn committed(&mut self, output: &mut [f64]) -> Result<(), Fault> {
        self.count(|solver| solver.committed(output))
    }

    fn reach(&mut self, window: &Window, input: &[f64], nodes: &mut Vec<u32>) -> Result<(), Fault> {
        self.count(|solver| solver.reach(window, input, nodes))
    }

    fn is_at_rest(&self) -> bool {
        self.solver.is_at_rest()
    }

    fn save(&mut self) -> Result<Vec<u8>, Fault> {
        self.solver.save()
    }

    fn resume(&mut self, state: &[u8]) -> Result<(), Fault> {
        self.solver.resume(state)
    }

    fn finish(&mut self) -> Result<Statistics, Fault> {
        let mut statistics = self.solver.finish()?;
        statistics.counts.push(("allocations_after_first_window".into(), self.count));
        Ok(statistics)
    }
}
