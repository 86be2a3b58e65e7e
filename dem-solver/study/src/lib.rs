//! Many releases of one rock on one terrain: a study file names a scene, where members start and what varies.
//!
//! Terrain, trees and spheres are read and built once, members are computed on all cores, and each is the run of its scene
//! alone: the same windows, the same steps, the same bytes (`dem-solver/tests/study`).
//!
//! - [`settings`], [`vary`], [`distribution`]: the study file; [`reference`](mod@reference): what editors know of it; [`design`]: what a barrier on a line is judged by;
//!   [`capacity`]: what it stops
//! - [`sampling`]: numbers from 0 to 1, a function of seed and member alone
//! - [`base`](mod@base): what all members share; [`gate`]: what can be known of them before the start; [`member`]: what one has of its own, and its scene; [`place`]: where it starts
//! - [`runner`]: one member from start to end
//! - [`quantity`], [`path_quantity`]: the quantities of members and of their paths, each a line; all results follow from these
//! - [`record`], [`directory`]: what is kept of each member, so that a killed process loses nothing; and what they were computed from
//! - [`preview`]: what it would compute, and at what cost
//! - [`table`], [`summary`]: `members.csv`, `summary.json`; [`bounds`]: how far quantiles and shares may be off
//! - [`track`]: what is kept of a member's trajectory, by the cells of [`grid`]; [`results`]: maps, lines, trajectories of all
//! - [`calibrate`](mod@calibrate): `rockfall calibrate`: parameters from falls that were observed, by a study with many sets of them
//! - [`worst`]: the members that are hardest on a barrier, each as a scene with it
//! - [`command`](mod@command): `dem-solver ensemble`, which `rockfall ensemble` starts: many members on all cores, handed on in order;
//!   [`until`]: how many replicates of them

pub mod base;
pub mod bounds;
pub mod calibrate;
pub mod capacity;
pub mod command;
pub mod design;
pub mod directory;
pub mod distribution;
pub mod gate;
pub mod grid;
pub mod member;
pub mod path_quantity;
pub mod place;
pub mod preview;
pub mod quantity;
pub mod record;
pub mod reference;
pub mod results;
pub mod runner;
pub mod sampling;
pub mod settings;
pub mod summary;
pub mod table;
pub mod track;
pub mod until;
pub mod vary;
pub mod worst;
