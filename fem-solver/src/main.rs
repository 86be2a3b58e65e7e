//! The program `fem-solver`: run, check and serve the structure of a scene.

use std::process::ExitCode;

fn main() -> ExitCode {
    interface_defs::toolkit::program::main(&fem_solver::PROGRAM)
}
