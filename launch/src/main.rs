//! `rockfall`: the front door. Reads a scene, starts only the processes that it requires, watches
//! them, and says how it went.
//!
//! It knows which table of a scene belongs to which program, and not what is in it.
//!
//! # Where to begin
//!
//! [`run`] is `rockfall run` from top to bottom, [`cli`] the command line before it, with the manual page. In order:
//!
//! - [`prepared`]: all of this up to the record, for every command that reads a scene: each program checks the tables that are its
//!   own, and reports numbers
//! - [`plan`]: who takes part, by presence, and the program files
//! - [`ground`]: heights of the terrain for a structure that stands on it, and where files lie that one program hands to another
//! - [`choice`]: scheme, window and steps that the scene leaves open, from [`numbers`] and [`stability`] (the longest weak window)
//! - [`record`]: on disk before it runs: `scene.toml` with every default, `run.json`; whether a run that was killed can go on there
//! - [`children`]: start programs, watch them, end them ([`progress`]), logs of bounded length; [`stop`]: why a command ends, with its
//!   exit code
//! - [`estimate`]: `rockfall check`: the same without starting, with steps and cost
//! - [`export`](mod@export): `rockfall export`: the structure as a file of CalculiX, Kratos or Gmsh
//! - [`status`]: `rockfall status`: how far a run, a study or a test for approval is, by its files; `rockfall verify`: whether they are what was written
//! - [`conform`](mod@conform): `rockfall conform`: one program against the contract, with a partner of ours
//! - [`sweep`]: many runs, each kept
//! - [`trade`](mod@trade): `rockfall trade`: accuracy against cost, by many runs
//! - [`approve`](mod@approve): `rockfall approve`: a kit under the launches of an approval test, each criterion judged
//! - [`worst`](mod@worst): `rockfall ensemble --barrier`: the members of a study that are hardest on a barrier, coupled with it
//! - [`report`](mod@report): `rockfall report`: the results of a run as one page
//! - [`replay`](mod@replay): `rockfall replay`: one solver alone against a recording of a run
//! - [`bridge`](mod@bridge): `rockfall bridge`: a solver that is elsewhere, over TCP
//! - [`reference`](mod@reference): schema and reference of what a scene may hold, put together from all programs
//!
//! A new command is a variant of `Command` in [`cli`]; options that other programs have too stand in
//! `toolkit::arguments`.

mod approve;
mod bridge;
mod children;
mod choice;
mod cli;
mod conform;
mod estimate;
mod export;
mod ground;
mod new;
mod numbers;
mod plan;
mod prepared;
mod progress;
mod record;
mod reference;
mod refine;
mod replay;
mod report;
mod run;
mod shell;
mod stability;
mod status;
mod stop;
mod sweep;
mod table;
mod trade;
mod worst;

use toolkit::alloc::CountingAllocator;
use toolkit::exit::Exit;

#[global_allocator]
static ALLOCATOR: CountingAllocator = CountingAllocator;

fn main() -> Exit {
    cli::main()
}
