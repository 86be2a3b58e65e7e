//! The coupler as a library: accelerations, lies, fields that are passed on, and a sphere on a spring.

mod allocations;
mod common;
mod forty_lies;
mod lies;
mod passed_fields;
mod spring_mass;

use toolkit::alloc::CountingAllocator;

#[global_allocator]
static ALLOCATOR: CountingAllocator = CountingAllocator;
