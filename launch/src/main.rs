//! `rockfall`: the front door. Reads a scene, starts only the processes that it requires, watches
//! them, and says how it went.
//!
//! It knows which table of a scene belongs to which program, and not what is in it: [`plan`] decides
//! by presence, [`validate`] asks the programs themselves, [`choice`] fills in scheme, window and steps that are open
//! ([`numbers`], [`stability`]), [`record`] writes down what will run,
//! [`schema`] and [`reference`] say what a scene may hold, [`supervise`] starts and watches, [`verdict`] makes one message
//! of how it ended, [`estimate`] estimates steps and cost for `rockfall check`; [`manual`] makes the manual page.

mod choice;
mod cli;
mod cluster;
mod command_line;
mod estimate;
mod events;
mod manual;
mod numbers;
mod plan;
mod progress;
mod record;
mod reference;
mod run;
mod schema;
mod stability;
mod stop;
mod supervise;
mod validate;
mod verdict;

use interface_defs::toolkit::alloc::CountingAllocator;
use interface_defs::toolkit::exit::Exit;

#[global_allocator]
static ALLOCATOR: CountingAllocator = CountingAllocator;

fn main() -> Exit {
    cli::main()
}
