//! The structure as a whole, in one test binary: linking is what takes the time.

mod again;
mod allocation;
mod bending;
mod common;
mod contract;
mod curves;
mod dynamics;
mod elastica;
mod elements;
mod exports;
mod extremes;
mod fields;
mod forms;
mod gate;
mod generated;
mod giving;
mod going_on;
mod ground;
mod groups;
mod input;
mod leans;
mod lines;
mod load_steps;
mod loads;
mod local;
mod meshes;
mod mutations;
mod parts;
mod paths;
mod pressures;
mod rest;
mod rings;
mod ropes;
mod selections;
mod statics;
mod supports;
mod surfaces;
mod tearing;
mod touching;
mod verdict;
mod yielding;

use toolkit::alloc::CountingAllocator;

#[global_allocator]
static ALLOCATOR: CountingAllocator = CountingAllocator;
