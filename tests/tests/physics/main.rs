//! What coupled scenes compute, by the programs together.

mod accounts;
mod barrier;
mod defaults;
mod drape;
mod limits;
mod paper_figures;
mod rest;
mod rupture;
mod slope_barrier;
mod torn;
mod trust;
mod weak_windows;
mod yielding;

use toolkit::alloc::CountingAllocator;

#[global_allocator]
static ALLOCATOR: CountingAllocator = CountingAllocator;
