//! The solver through its contract: scenes with exact or published answers, invariances, repeatability.

mod bench;
mod borders;
mod clusters;
mod covers;
mod energy;
mod extremes;
mod gate;
mod granular;
mod holes;
mod impact;
mod input;
mod keys;
mod limits;
mod mixed;
mod oblique;
mod relief;
mod repeat;
mod rocks;
mod rolling;
mod sampled;
mod shapes;
mod solids;
mod verdicts;
mod whole;
mod wires;

use toolkit::alloc::CountingAllocator;

#[global_allocator]
static ALLOCATOR: CountingAllocator = CountingAllocator;
