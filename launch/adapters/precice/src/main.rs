//! An adapter to preCICE: rockfall's solvers as its participants, and its participants as solvers in rockfall.

mod hosted;
mod join;
mod names;
mod stand_in;

use clap::{Parser, Subcommand};
use interface_defs::ipc::{Connection, serve::refuse};
use interface_defs::{Failure, Fault, serve};
use names::Names;
use std::ffi::OsString;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Duration;

/// Rockfall's solvers as preCICE participants, and preCICE participants as solvers in rockfall
#[derive(Parser)]
#[command(version, about)]
struct Cli {
    /// Configuration of preCICE
    #[arg(long, value_name = "FILE")]
    config: PathBuf,
    /// Name of the participant that this program is
    #[arg(long, value_name = "NAME")]
    participant: String,
    /// Program that knows the scene's structure, for its interface mesh
    #[arg(long, value_name = "PROGRAM", default_value = "fem-solver")]
    structure: OsString,
    /// `serve`: shell command that starts the other participant
    #[arg(long, value_name = "COMMAND")]
    start: Option<String>,
    /// `serve`: how well the other participant repeats a window, relative to the size of each field; 0: equal bytes
    #[arg(long, value_name = "SHARE", default_value_t = 0.0)]
    repeats: f64,
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Start a solver of rockfall's contract, and take part in a preCICE run in its name
    Join(join::Arguments),
    /// Be the structure of a rockfall run in the name of the other participant; `rockfall run` and `rockfall conform` add this
    Serve {
        /// The resolved scene
        scene: PathBuf,
        /// How the run is joined
        #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
        rest: Vec<OsString>,
    },
}

/// The user's input is wrong: exit code 2.
fn input(what: impl Into<String>) -> Failure {
    Failure::Fault { solver: "preCICE".into(), fault: Fault::input(what) }
}

/// preCICE itself says no.
fn said(error: precice::Error) -> Failure {
    Failure::Transport(error.to_string())
}

fn run(cli: &Cli) -> Result<(), Failure> {
    let names = || Names::read(&cli.config, &cli.participant);
    match &cli.command {
        // An interrupt ends it at once, in the middle of preCICE's waiting, too; the solver notices.
        Command::Join(arguments) => join::join(&names()?, &cli.structure, arguments),
        Command::Serve { scene, rest } => {
            let connection = Connection::from_args(rest.iter()).map_err(input)?;
            let standing = names().and_then(|names| {
                if connection.name != "fem" {
                    return Err(input(format!(
                        "it stands in for a structure (--as fem), not for {}",
                        connection.name
                    )));
                }
                let mesh = hosted::mesh_of(&cli.structure, scene, Duration::from_secs(600))?;
                stand_in::StandIn::new(names, mesh, cli.start.as_deref(), cli.repeats)
            });
            match standing {
                Ok(mut standing) => serve(&mut standing, &connection),
                Err(failure) => {
                    let fault = match &failure {
                        Failure::Fault { fault, .. } => fault.clone(),
                        other => Fault::broken(other.to_string()),
                    };
                    refuse(&fault, &connection)?;
                    Err(failure)
                }
            }
        }
    }
}

fn main() -> ExitCode {
    match run(&Cli::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            eprintln!("error: {failure}");
            ExitCode::from(if failure.is_input() { 2 } else { 1 })
        }
    }
}
