//! `rockfall`: the front door. Reads a scene, starts only the processes that it requires, watches
//! them, and says how it went.
//!
//! It knows which table of a scene belongs to which program, and not what is in it.
//!
//! # Where to begin
//!
//! `run` is `rockfall run` from top to bottom, `front::cli` the command line before it, with the manual page.
//!
//! - `front`: the command line, why a command ends, and commands that are one file
//! - `check`: `rockfall check`, and what every command does that reads a scene
//! - `run`: `rockfall run`: processes, records, many runs
//! - `report`: `rockfall report`: the results of a run, a study or a test as one page; `picture`: pictures as SVG
//! - `trade`: `rockfall trade`: accuracy against cost, by many runs
//! - `approve`: `rockfall approve`: a kit under the launches of an approval test, each criterion judged
//! - `worst`: `rockfall ensemble --barrier`: the members of a study that are hardest on a barrier, coupled with it
//! - `new`: `rockfall new`: a directory to begin with
//! - `export`: `rockfall export`: the structure as a file of CalculiX, Kratos or Gmsh
//!
//! A new command is a variant of `Command` in `front::cli`; options that other programs have too stand in
//! `toolkit::arguments`.

mod approve;
mod check;
mod export;
mod front;
mod new;
mod picture;
mod report;
mod run;
mod trade;
mod worst;

pub use front::cli::main;
