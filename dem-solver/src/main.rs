//! The program `dem-solver`.

fn main() -> std::process::ExitCode {
    interface_defs::toolkit::program::main(&dem_solver::PROGRAM)
}
