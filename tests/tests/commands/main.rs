//! What the programs do when a user calls them: commands, files, messages, signals, other solvers.

mod again;
mod approve;
mod bad_input;
mod bridge;
mod clusters;
mod conform;
mod engines;
mod flight;
mod host;
mod lost_processes;
mod lying_solvers;
mod mistakes;
mod new_project;
mod presets;
mod profile;
mod refine;
mod replay;
mod report;
mod resume;
mod rows;
mod same_bytes;
mod site;
mod swapped_solvers;
mod trade;
mod verify;
mod worst;
