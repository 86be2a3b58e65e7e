//! The program `coupler`.

use interface_defs::toolkit::alloc::CountingAllocator;
use interface_defs::toolkit::exit::Exit;

#[global_allocator]
static ALLOCATOR: CountingAllocator = CountingAllocator;

fn main() -> Exit {
    coupler::program::main()
}
