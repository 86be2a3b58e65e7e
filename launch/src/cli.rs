//! The command line.

use crate::command_line::beside;
use crate::estimate;
use crate::run::{self, Request};
use crate::stop::Stop;
use clap::{Parser, Subcommand};
use interface_defs::ipc;
use interface_defs::toolkit::exit::Exit;
use interface_defs::toolkit::input_error::InputError;
use interface_defs::toolkit::log::{self, LogFormat};
use interface_defs::toolkit::screen::{complain, tell};
use std::ffi::OsString;
use std::path::PathBuf;

/// Rocks on nets: co-simulation of a contact solver and a structure's solver
///
/// Exit codes: 0 done; 1 the run failed or was interrupted, what was computed is on disk; 2 bad
/// input, nothing was started.
#[derive(Parser)]
#[command(name = "rockfall", version, about)]
struct Cli {
    #[command(subcommand)]
    command: Command,
    /// Form of the log lines on stderr; with json no bar is drawn. RUST_LOG=debug tells more
    #[arg(long, global = true, value_enum, default_value_t, value_name = "FORM")]
    log_format: LogFormat,
}

#[derive(Subcommand)]
enum Command {
    /// Start the processes that a scene requires, watch them, write the results
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
        #[arg(long, conflicts_with = "log_format", help_heading = "Results")]
        quiet: bool,
        /// Switch off every saving (flight in closed form, skipped structure), to prove that it is harmless
        #[arg(long)]
        no_shortcuts: bool,
    },
    /// Say what would run: processes, critical time steps [s], windows, cost, warnings; start nothing
    Check {
        #[command(flatten)]
        input: Input,
        /// Write the scene with every default and --set filled in to this file; it runs as it is, from any directory
        #[arg(long, value_name = "FILE")]
        resolved: Option<PathBuf>,
    },
    /// Fill a closed surface (STL, OBJ, built-in shape) with overlapping spheres, with its error: `dem-solver cluster`
    #[command(disable_help_flag = true)]
    Cluster {
        /// As `dem-solver cluster` takes them: SHAPE --spheres N -o FILE; --help tells more
        #[arg(value_name = "ARGUMENTS", trailing_var_arg = true, allow_hyphen_values = true)]
        arguments: Vec<OsString>,
    },
    /// Remove what dead runs left behind in shared memory
    Clean,
}

#[derive(clap::Args)]
struct Input {
    /// Scene file (TOML, SI units)
    scene: PathBuf,
    /// Set a value of the scene, as in --set coupling.scheme=weak --set rock.0.cluster.spheres=512
    #[arg(long = "set", value_name = "KEY=VALUE")]
    sets: Vec<String>,
}

/// The whole program.
pub fn main() -> Exit {
    let cli = Cli::parse();
    let json = cli.log_format == LogFormat::Json;
    log::init(cli.log_format, json);
    match execute(cli.command, json) {
        Ok(exit) => exit,
        Err(stop) => {
            if json {
                tracing::error!("{}", stop.message);
            } else {
                complain(&stop.message);
            }
            stop.exit
        }
    }
}

fn execute(command: Command, json: bool) -> Result<Exit, Stop> {
    match command {
        Command::Run { input, out, force, quiet, no_shortcuts } => run::run(&Request {
            scene: input.scene,
            sets: input.sets,
            out,
            force,
            shortcuts: !no_shortcuts,
            quiet,
            bar: !quiet && !json,
        }),
        Command::Check { input, resolved } => {
            tell(&estimate::check(&input.scene, &input.sets, resolved.as_deref())?);
            Ok(Exit::Done)
        }
        Command::Cluster { arguments } => hand_over("dem-solver", "cluster", &arguments),
        Command::Clean => {
            let removed = ipc::clean().map_err(|failure| Stop::failed(failure.to_string()))?;
            if removed.is_empty() {
                tell("nothing to remove: no dead run has left anything behind\n");
            }
            for id in removed {
                tell(&format!("removed what run {id} left behind\n"));
            }
            Ok(Exit::Done)
        }
    }
}

/// Let a program of this project beside this one do the whole work, and end as it does.
fn hand_over(program: &str, command: &str, arguments: &[OsString]) -> Result<Exit, Stop> {
    let file = beside(program)
        .map_err(|what| InputError::new(what).try_instead("build all programs with cargo build --release"))?;
    let status = std::process::Command::new(file).arg(command).args(arguments).status();
    match status.map(|s| s.code()) {
        Ok(Some(0)) => Ok(Exit::Done),
        Ok(Some(2)) => Ok(Exit::BadInput),
        Ok(_) => Ok(Exit::Failed),
        Err(e) => Err(InputError::new(format!("{program} cannot be started: {e}")).into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_command_line_is_consistent() {
        Cli::command().debug_assert();
    }
}
