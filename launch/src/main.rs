//! The program `rockfall`.

use toolkit::alloc::CountingAllocator;
use toolkit::exit::Exit;

#[global_allocator]
static ALLOCATOR: CountingAllocator = CountingAllocator;

fn main() -> Exit {
    launch::main()
}
