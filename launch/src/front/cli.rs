//! The command line, and the manual page of it.

use super::{bridge, conform, reference, replay, status};
use crate::check::plan::own_program;
use crate::check::{self, prepared};
use crate::front::stop::Stop;
use crate::run::children;
use crate::{approve, export, new, report, run, trade, worst};
use clap::{CommandFactory, Parser, Subcommand};
use clap_mangen::Man;
use interface_defs::diagnostic::{Diagnostic, code};
use interface_defs::ipc;
use serde_json::json;
use std::ffi::OsString;
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use toolkit::arguments::{
    AnswerForm, CalibrateArguments, ClusterArguments, EnsembleArguments, ExportArguments, Input, Logging,
};
use toolkit::check::Format;
use toolkit::exit::Exit;
use toolkit::files::{self, Dir};
use toolkit::log::{self, LogFormat};
use toolkit::provenance;
use toolkit::screen::{complain, show};
use toolkit::simd;

/// Rockfall on flexible nets and over terrain: a contact solver and a structural solver, coupled
///
/// Exit codes: 0 done; 1 the run failed or was interrupted, what was computed is on disk; 2 bad
/// input, nothing was started; 3 computed to the end, but a bound of trust was passed (unreliable).
#[derive(Parser)]
#[command(name = "rockfall", version, long_version = provenance::long_version())]
struct Cli {
    #[command(subcommand)]
    command: Command,
    #[command(flatten)]
    logging: Logging,
}

#[derive(Subcommand)]
enum Command {
    /// Make a directory with scenes that run: a site from terrain and release area, a drop test, a net, a solver of your own
    ///
    /// rockfall new site --terrain dtm.tif --release cliff.geojson --line road.geojson
    ///
    /// What is missing is asked for on a terminal. Nothing that is there is overwritten.
    #[command(verbatim_doc_comment)]
    New(new::NewArguments),
    /// Run a scene: start the processes that it requires, watch them, write the results
    Run(run::RunArguments),
    /// Check a scene: processes, critical time steps [s], windows, cost, warnings; or a study: members, lines, cost, warnings
    ///
    /// Nothing is started and nothing written; for the cost a fall to the net, or a structure alone, is tried for half a second, of a study
    /// some members. What is expected is the wall time of the run on a machine that does nothing else, `wall_s` of the cost in its summary.
    Check {
        #[command(flatten)]
        input: Input,
        /// Write the scene with every default and --set filled in to this file; it runs as it is, from any directory
        #[arg(long, value_name = "FILE")]
        resolved: Option<PathBuf>,
        #[command(flatten)]
        answer: AnswerForm,
    },
    /// Examine a solver of your own: whether it keeps the interface contract, clause by clause of PROTOCOL.md
    ///
    /// rockfall conform --role fem -- ./my-solver --option 3
    ///
    /// It is started with a partner of this project and asked for windows: again, shorter, longer, under forces, on a mesh that is moved. Of each
    /// clause it says kept, broken with the numbers of both sides, or not examined and why.
    /// Exit codes: 0 no clause is broken; 1 one is, or it was lost or interrupted; 2 bad input.
    #[command(verbatim_doc_comment)]
    Conform(conform::ConformArguments),
    /// Measure what accuracy costs: run a scene over its knobs, print the cheapest settings for 10, 3, 1 and 0.1 %
    ///
    /// Runs are made one at a time, and kept: the same command goes on where it was left. The page `trade.md` of its directory
    /// has the table of all settings, the front and lines to copy; `trade.csv` has all runs, `trade.svg` shows error over cost; `report.html` is page and picture.
    /// Exit codes: 0 done; 1 interrupted, or nothing to compare with; 2 bad input.
    Trade(trade::TradeArguments),
    /// Run a barrier kit through its approval tests (EAD 340059-00-0106): SEL 1, SEL 2, MEL, each criterion with its number, pass or fail
    ///
    /// The launches are made at a vertical site, then again with what is uncertain varied, one thing at a time. Runs are kept: after
    /// Ctrl-C the same command goes on. `approval.json` and `approval.csv` of its directory have all numbers.
    /// Exit codes: 0 judged, pass or fail; 1 interrupted, or failed; 2 bad input, nothing was started; 3 not settled: a run that
    /// failed or is unreliable decides, which is never a pass.
    Approve(approve::ApproveArguments),
    /// Fill a closed surface (STL, OBJ, built-in shape) with overlapping spheres, and print its error
    #[command(
        after_help = "SHAPE is a file or one of cube:EDGE, box:A,B,C (edges), sphere:RADIUS, ellipsoid:A,B,C (semi-axes), \
        ead_block:EDGE, norm_rock_111:VOLUME, norm_rock_221:VOLUME, random_convex:A,B,C[,SEED[,POINTS]] (edges of its box); \
        lengths in m, volumes in m3.\nMass, centre and inertia of a rock always come from its shape, never from the spheres.\n\
        In a scene: cluster = { spheres = N } makes the same cluster, cluster = { file = \"FILE\" } reads it."
    )]
    Cluster(ClusterArguments),
    /// Many releases of one rock on one terrain: a table with a row for each, quantiles
    ///
    /// The study file names a scene, points, lines or areas where rocks start, and what varies. Members are computed on all cores
    /// of this machine; a study that was killed goes on with --resume and gives the same table. --members A..B is one task of
    /// many on other machines. --barrier SCENE --worst N runs the worst members again, coupled, against a barrier in its place.
    Ensemble(EnsembleArguments),
    /// Parameters from falls that were observed: their ranges, what the data do not settle, and what they predict of others
    ///
    /// The file names a study, parameters with the ranges that are searched, and stops, speeds or heights that were observed. Many sets
    /// of parameters are tried, each with as many falls as were observed; a calibration that was killed goes on with --resume, which also
    /// compares the same falls with other observations. `calibration.md` and `calibration.json` of its directory have the results.
    /// Exit codes: 0 done; 1 interrupted, or failed; 2 bad input, nothing was started; 3 a range is not to be trusted, or no set
    /// reproduces what was observed.
    Calibrate(CalibrateArguments),
    /// Write the structure of a scene for CalculiX or Abaqus (.inp), Kratos (.mdpa) or Gmsh (.msh), as its mesh is read again
    ///
    /// With parts and groups as sets, and where the format has them materials, prestress, supports and weight. What it cannot hold
    /// is listed, on the screen and at the head of the file. These three are written by python3, of which nothing but its standard library is
    /// needed; .json is structure.json, from which they are made, and needs none.
    Export(ExportArguments),
    /// Ask one solver again what a recording says that it was asked, and compare its answers; nothing else need run
    ///
    /// `rockfall run SCENE --record FILE` makes the recording. Fields and gauges of every answer are compared with those recorded;
    /// the first answer that differs by more than --tolerance is named, with its window and both numbers. Exit codes: 0 no answer
    /// differs by more; 1 one does, or the solver failed; 2 bad input.
    Replay(replay::ReplayArguments),
    /// Write the report of a run, study, test for approval or `trade` anew: `report.html`, one page that opens from disk
    ///
    /// Each writes it at its end, unless its scene or kit has `report = false` in `[output]`, or its study `report = false`. With `[output] fields` the replay shows the
    /// structure. Exit codes: 0 written; 1 it could not be; 2 no run that has ended is there, or no browser for --pdf.
    Report(report::ReportArguments),
    /// A solver in another language, container or on another machine: what crosses goes over TCP
    ///
    /// Beside the run `--listen` stands in for the solver, as a scene says: `[processes] fem = "rockfall bridge --listen 127.0.0.1:4711"`.
    /// On the other side `rockfall bridge --connect HOST:4711 -- COMMAND` starts the solver and passes everything on; a program
    /// may also speak TCP itself (interface-defs/PROTOCOL.md, section 7). The text of the scene goes with it; files that it
    /// names must lie there, too, at the same paths. Nothing is encrypted: between machines use a tunnel (`ssh -L`, WireGuard).
    /// Exit codes: 0 the run is done; 1 it failed, or one side was lost; 2 bad input, nothing was started.
    Bridge(bridge::BridgeArguments),
    /// How far a run, a study or a test for approval is, by the files in its directory
    ///
    /// Exit codes: 0 done, or running; 1 failed, interrupted or killed; 2 nothing of these there; 3 done, but unreliable or not settled.
    Status {
        /// Directory of the results
        dir: PathBuf,
    },
    /// Whether a directory is what its run or study wrote, file by file
    ///
    /// A run or study that has come to its end leaves the length and hash of every file in `manifest.json`. Files that came later
    /// are named, and no fault. Exit codes: 0 all files are as they were written; 1 a file is missing or was changed; 2 there is
    /// nothing to compare with.
    Verify {
        /// Directory of the results
        dir: PathBuf,
        #[command(flatten)]
        answer: AnswerForm,
    },
    /// Print the JSON schema of the scene file, or that of a study, a calibration or a kit, for editors
    ///
    /// Write it into a file once, and name that in the first line of a scene: `#:schema rockfall.schema.json`.
    /// Even Better TOML and taplo then complete keys, show units and defaults, and mark what is misspelt.
    Schema {
        /// The schema of a study file (`rockfall ensemble`)
        #[arg(long, group = "file")]
        study: bool,
        /// The schema of a calibration file (`rockfall calibrate`)
        #[arg(long, group = "file")]
        calibration: bool,
        /// The schema of a kit file (`rockfall approve`, or `kit` in [structure])
        #[arg(long, group = "file")]
        kit: bool,
        /// Print the reference of all keys and results instead (Markdown)
        #[arg(long, group = "file")]
        reference: bool,
    },
    /// Print a script that completes commands and options in a shell
    ///
    /// bash: rockfall completions bash > ~/.local/share/bash-completion/completions/rockfall
    /// zsh: rockfall completions zsh > a directory of $fpath, as _rockfall
    /// fish: rockfall completions fish > ~/.config/fish/completions/rockfall.fish
    #[command(verbatim_doc_comment)]
    Completions {
        /// Shell for which the script is
        #[arg(value_enum)]
        shell: clap_complete::Shell,
    },
    /// Print the manual page, all commands in one: rockfall man | man -l -
    Man {
        /// Write the page, and one for each command, into this directory instead
        #[arg(long, value_name = "DIR")]
        dir: Option<PathBuf>,
    },
    /// Remove what dead runs left behind in shared memory
    Clean,
}

/// The whole program.
pub fn main() -> Exit {
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        Err(error) => {
            let Some(scene) = scene_as_command(std::env::args_os().nth(1)) else { error.exit() };
            let what = format!("{scene}: this is a scene, and the command is missing");
            let cure = format!("write rockfall run {scene}");
            complain(&Diagnostic::error(code::ARGUMENT, what).try_instead(cure));
            return Exit::BadInput;
        }
    };
    let json = cli.logging.log_format == LogFormat::Json;
    let begun = log::init(cli.logging.log_format, json, (None, "rockfall")).and_then(|()| simd::choose());
    match begun.map_err(Stop::from).and_then(|_| execute(cli.command, json)) {
        Ok(exit) => exit,
        Err(stop) => {
            for error in &stop.errors {
                if json {
                    tracing::error!(code = error.code.as_str(), key = error.key.as_deref(), "{error}");
                } else {
                    complain(error);
                }
            }
            stop.exit
        }
    }
}

/// The scene that stands where a command must stand.
fn scene_as_command(first: Option<OsString>) -> Option<String> {
    first.filter(|word| Path::new(word).extension().is_some_and(|e| e == "toml"))?.into_string().ok()
}

fn execute(command: Command, json: bool) -> Result<Exit, Stop> {
    match command {
        Command::New(arguments) => new::new(&arguments),
        Command::Run(arguments) => run::run(&arguments, json),
        Command::Check { input, resolved: None, answer } if prepared::is_study(&input.scene) => {
            check_study(&input, answer.format)
        }
        Command::Check { input, resolved, answer } => {
            let checked = check::check(&input, resolved.as_deref(), answer.format);
            shown(checked.map(|text| (text, Exit::Done)), answer.format)
        }
        Command::Conform(arguments) => conform::conform(&arguments),
        Command::Trade(arguments) => trade::trade(&arguments, json),
        Command::Approve(arguments) => approve::approve(&arguments, json),
        Command::Ensemble(arguments) if arguments.barrier.is_some() => worst::worst(&arguments, json),
        Command::Ensemble(arguments) if worst::is_whole(&arguments) => worst::study(&arguments),
        Command::Ensemble(_) => become_program("dem-solver", "ensemble"),
        Command::Calibrate(_) => become_program("dem-solver", "calibrate"),
        Command::Export(arguments) => export::export(&arguments),
        Command::Replay(arguments) => replay::replay(&arguments),
        Command::Report(arguments) => report::report(&arguments),
        Command::Bridge(arguments) => bridge::bridge(&arguments),
        Command::Status { dir } => shown(status::status(&dir), Format::Text),
        Command::Verify { dir, answer } => shown(status::verify(&dir, answer.format), answer.format),
        Command::Cluster(_) => become_program("dem-solver", "cluster"),
        Command::Schema { study, calibration, kit, reference } => {
            show(&match () {
                () if study => reference::json(&reference::of_study()?),
                () if calibration => reference::json(&reference::of_calibration()?),
                () if kit => reference::json(&reference::of_kit()?),
                () if reference => {
                    reference::text(&reference::share()?, &reference::study()?, &reference::calibration()?)
                }
                () => reference::json(&reference::share()?.document()),
            });
            Ok(Exit::Done)
        }
        Command::Completions { shell } => {
            let mut script = Vec::new();
            clap_complete::generate(shell, &mut Cli::command(), "rockfall", &mut script);
            show(&String::from_utf8_lossy(&script));
            Ok(Exit::Done)
        }
        Command::Man { dir } => print_manual(dir.as_deref()),
        Command::Clean => {
            let removed = ipc::clean().map_err(|failure| Stop::failed(code::PROCESS, failure.to_string()))?;
            if removed.is_empty() {
                show("nothing to remove: no dead run has left anything behind\n");
            }
            removed.iter().for_each(|id| show(&format!("removed what run {id} left behind\n")));
            Ok(Exit::Done)
        }
    }
}

/// An answer on the screen; with JSON, what is wrong is one too.
fn shown(answered: Result<(String, Exit), Stop>, format: Format) -> Result<Exit, Stop> {
    match &answered {
        Ok((text, _)) => show(text),
        Err(stop) if format == Format::Json => show(&format!("{}\n", json!({ "errors": stop.errors }))),
        Err(_) => {}
    }
    answered.map(|(_, exit)| exit)
}

/// The manual: the pages of the program and of its commands, one after the other; or a file of a directory for each, of which that of
/// the program has them all.
fn print_manual(dir: Option<&Path>) -> Result<Exit, Stop> {
    let mut program = Cli::command();
    program.build();
    let mut pages = Vec::new();
    let commands = program.get_subcommands();
    let shown = commands.filter(|command| !command.is_hide_set() && command.get_name() != "help");
    std::iter::once(&program)
        .chain(shown)
        .try_for_each(|command| Man::new(command.clone()).render(&mut pages))
        .map_err(|e| Stop::failed(code::OTHER, format!("the manual page cannot be made: {e}")))?;
    let Some(dir) = dir else {
        show(&String::from_utf8_lossy(&pages));
        return Ok(Exit::Done);
    };
    let written = Dir::create(dir)
        .and_then(|_| clap_mangen::generate_to(program, dir))
        .and_then(|()| files::write(&dir.join("rockfall.1"), &pages));
    written.map_err(|e| {
        Stop::input(code::FILE, format!("{}: the manual pages cannot be written: {e}", dir.display()))
    })?;
    Ok(Exit::Done)
}

/// Become a program of this project beside this one: signals reach it, and it ends with its own code.
fn become_program(program: &str, command: &str) -> Result<Exit, Stop> {
    become_with(program, std::env::args_os().skip(1).skip_while(|argument| argument != command))
}

/// The check of a study is its own program's.
fn check_study(input: &Input, format: Format) -> Result<Exit, Stop> {
    let form = if format == Format::Json { "--format=json" } else { "--format=text" };
    let flags = ["--dry-run", form].map(OsString::from);
    become_with("dem-solver", std::iter::once("ensemble".into()).chain(flags).chain(children::scene(input)))
}

fn become_with(program: &str, arguments: impl Iterator<Item = OsString>) -> Result<Exit, Stop> {
    // It returns only where the program cannot be started.
    let e = std::process::Command::new(own_program(program)?).args(arguments).exec();
    Err(Stop::input(code::PROCESS, format!("{program} cannot be started: {e}")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_command_line_is_consistent() {
        Cli::command().debug_assert();
    }

    #[test]
    fn a_scene_in_the_place_of_the_command_is_known() {
        assert_eq!(scene_as_command(Some("fall.toml".into())).as_deref(), Some("fall.toml"));
        assert_eq!(scene_as_command(Some("rnu".into())), None);
        assert_eq!(scene_as_command(None), None);
    }

    #[test]
    fn every_command_is_completed_in_every_shell_and_stands_in_the_manual() {
        let commands: Vec<String> =
            Cli::command().get_subcommands().map(|c| c.get_name().to_owned()).collect();
        assert!(commands.iter().any(|c| c == "run") && commands.len() >= 7, "{commands:?}");
        let dir = tempfile::tempdir().expect("a directory");
        print_manual(Some(dir.path())).expect("written");
        use clap_complete::Shell;
        for shell in [Shell::Bash, Shell::Zsh, Shell::Fish] {
            let mut script = Vec::new();
            clap_complete::generate(shell, &mut Cli::command(), "rockfall", &mut script);
            let script = String::from_utf8(script).expect("text");
            for command in &commands {
                assert!(script.contains(command), "{command} in {shell}");
                assert!(dir.path().join(format!("rockfall-{command}.1")).exists(), "{command}");
            }
            assert!(script.contains("no-shortcuts"), "options in {shell}");
        }
        let page = std::fs::read_to_string(dir.path().join("rockfall.1")).expect("a page");
        assert!(page.contains("Exit codes"), "{page}");
        // What programs say to each other is not for the user, as below.
        let hidden = Cli::command().get_subcommands().filter(|c| c.is_hide_set()).count();
        assert_eq!(page.matches(".TH ").count(), 1 + commands.len() - hidden);
        // Every option of every command.
        for option in
            Cli::command().get_subcommands().flat_map(|c| c.get_arguments().cloned().collect::<Vec<_>>())
        {
            // What programs say to each other is not for the user.
            let Some(name) = option.get_long().filter(|_| !option.is_hide_set()) else { continue };
            let name = format!("\\-\\-{}", name.replace('-', "\\-"));
            assert!(page.contains(&name), "{name} is not in\n{page}");
        }
    }
}
