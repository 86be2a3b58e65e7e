//! The program `fem-solver`: run, check and serve its part of a scene; say where it needs heights of the terrain.

use interface_defs::toolkit::alloc::CountingAllocator;
use interface_defs::toolkit::program;
use std::process::ExitCode;

#[global_allocator]
static ALLOCATOR: CountingAllocator = CountingAllocator;

fn main() -> ExitCode {
    program::main_with(&fem_solver::PROGRAM, &[fem_solver::solver::site::COMMAND])
}
