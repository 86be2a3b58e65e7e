//! The program `dem-solver`: run, check and serve its part of a scene; make clusters, compute studies, write heights.

use std::process::ExitCode;
use toolkit::alloc::CountingAllocator;
use toolkit::program;

#[global_allocator]
static ALLOCATOR: CountingAllocator = CountingAllocator;

fn main() -> ExitCode {
    program::main_with(
        &dem_solver::PROGRAM,
        &[
            dem_solver::command::COMMAND,
            dem_solver::study::command::COMMAND,
            dem_solver::study::reference::COMMAND,
            dem_solver::study::calibrate::command::COMMAND,
            dem_solver::study::calibrate::SCHEMA,
            dem_solver::terrain::ground::COMMAND,
        ],
    )
}
