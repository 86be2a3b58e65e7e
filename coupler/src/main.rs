//! The program `coupler`.

use std::process::ExitCode;
use toolkit::alloc::CountingAllocator;

#[global_allocator]
static ALLOCATOR: CountingAllocator = CountingAllocator;

fn main() -> ExitCode {
    coupler::program::main()
}
