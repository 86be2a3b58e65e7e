//! The program `fem-solver`: run, check and serve its part of a scene; export its structure; say where it needs heights of the terrain.

use std::process::ExitCode;
use toolkit::alloc::CountingAllocator;
use toolkit::program;

#[global_allocator]
static ALLOCATOR: CountingAllocator = CountingAllocator;

fn main() -> ExitCode {
    program::main_with(
        &fem_solver::PROGRAM,
        &[fem_solver::solver::export::COMMAND, fem_solver::solver::site::COMMAND],
    )
}
