//! The program `coupler`.

use toolkit::alloc::CountingAllocator;
use toolkit::exit::Exit;

#[global_allocator]
static ALLOCATOR: CountingAllocator = CountingAllocator;

fn main() -> Exit {
    coupler::program::main()
}
