//! `rockfall`: the front door. Reads a scene, starts only the processes that it requires, watches
//! them, and says how it went.
//!
//! It knows which table of a scene belongs to which program, and not what is in it.
//!
//! # Where to begin
//!
//! [`run`] is `rockfall run` from top to bottom, [`cli`] the command line before it. In order:
//!
//! - [`prepared`]: all of this up to the record, for every command that reads a scene
//! - [`plan`]: who takes part, by presence; [`command_line`]: the program files
//! - [`kind`]: a scene, and not a study or a barrier for one
//! - [`ground`]: heights of the terrain for a structure that stands on it
//! - [`validate`]: each program checks the tables that are its own, and reports numbers
//! - [`choice`]: scheme, window and steps that the scene leaves open, from [`numbers`] and [`stability`] (the longest weak window)
//! - [`resume`]: whether a run that was killed can go on in the directory of the results
//! - [`record`]: on disk before it runs: `scene.toml` with every default, `run.json`
//! - [`children`]: start programs, watch them, end them ([`events`], [`progress`]); [`verdict`]: how a run ended, [`stop`]: with its
//!   exit code; [`logs`]: of bounded
//!   length; [`scratch`]: where files lie that one program hands to another
//! - [`estimate`]: `rockfall check`: the same without starting, with steps and cost
//! - [`status`]: `rockfall status`: how far a run or a study is, by its files
//! - [`verify`]: `rockfall verify`: whether a directory is what its run wrote
//! - [`sweep`]: many runs, each kept; [`columns`]: tables of what came of them
//! - [`trade`](mod@trade): `rockfall trade`: accuracy against cost, by many runs
//! - [`worst`](mod@worst): `rockfall ensemble --barrier`: the members of a study that are hardest on a barrier, coupled with it
//! - [`schema`], [`reference`](mod@reference): what a scene may hold, put together from all programs; [`manual`]: the manual page
//!
//! A new command is a variant of `Command` in [`cli`]; options that other programs have too stand in
//! `toolkit::arguments`.

mod children;
mod choice;
mod cli;
mod columns;
mod command_line;
mod estimate;
mod events;
mod ground;
mod kind;
mod logs;
mod manual;
mod numbers;
mod plan;
mod prepared;
mod progress;
mod record;
mod reference;
mod resume;
mod run;
mod schema;
mod scratch;
mod stability;
mod status;
mod stop;
mod sweep;
mod trade;
mod validate;
mod verdict;
mod verify;
mod worst;

use toolkit::alloc::CountingAllocator;
use toolkit::exit::Exit;

#[global_allocator]
static ALLOCATOR: CountingAllocator = CountingAllocator;

fn main() -> Exit {
    cli::main()
}
