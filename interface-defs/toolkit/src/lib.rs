//! What rockfall's own programs share beside the contract. A foreign solver needs none of it.
//!
//! - [`scene`]: scene text, its tables, and where in the file a value stands
//! - [`kit`]: a barrier from a file of its own, which a scene names; [`library`]: parts by name
//! - [`schema`]: what a program reads and writes, for editors and the reference
//! - [`tagged`]: enums that a table names under one of its keys
//! - [`input_file`]: what stands at the path of an input file; [`coordinates`]: points of lines and areas, as written or of a file
//! - [`output`], [`processes`]: the tables `[output]` and `[processes]`
//! - [`arguments`]: options that several programs have on their command lines
//! - [`program`]: the `main` of a solver: run, check, serve
//! - [`progress`]: lines from which a launcher draws its bar
//! - [`check`]: what a program answers to `check`; [`trial`]: what a run costs, by its first part
//! - [`words`]: words and numbers of a text file; [`raster`]: heights on a grid, and ESRI grids of them
//! - [`ground`]: heights of the terrain for what is built on it
//! - [`history`], [`summary`], [`vtu`]: result files; [`columns`]: tables of which every column is declared once
//! - [`run_dir`], [`owner`]: the directory of a run, and who owns it; [`files`]: how every file is read and written
//! - [`provenance`], [`manifest`]: which program wrote what, and whether a directory is what its run wrote
//! - [`start_from`], [`state_file`]: a run that starts where another has ended, and the file that this one leaves for it
//! - [`checkpoint`]: what a run that was killed goes on from
//! - [`energy`]: the balance of energy, from gauges by role
//! - [`limits`]: bounds of trust, and who passes them; [`numbers`]: numbers for a reader; [`once`]: lists without repetition
//! - [`simd`]: wide registers, and who uses which
//! - [`exit`], [`log`], [`screen`], [`alloc`]: exit codes, logs, text on the screen, counted allocations; [`profile`]: what a process does
//!   when

pub mod alloc;
pub mod arguments;
pub mod check;
pub mod checkpoint;
pub mod columns;
pub mod coordinates;
mod elementary;
pub mod energy;
mod exact;
pub mod exit;
pub mod explain;
pub mod files;
pub mod ground;
pub mod history;
pub mod input_file;
pub mod kit;
pub mod library;
pub mod limits;
pub mod log;
pub mod manifest;
pub mod numbers;
pub mod once;
pub mod output;
pub mod owner;
pub mod picture;
pub mod processes;
pub mod profile;
pub mod program;
pub mod progress;
pub mod provenance;
pub mod ranges;
pub mod raster;
pub mod recorder;
pub mod recording;
mod regular_file;
pub mod run_dir;
pub mod scene;
pub mod schema;
pub mod screen;
pub mod simd;
mod solo;
pub mod start_from;
pub mod state_file;
pub mod summary;
mod syntax;
pub mod tagged;
pub mod trial;
pub mod uncertainty;
pub mod vtu;
pub mod words;
