//! Results of a run.
//!
//! - [`record`]: reactions and their largest values, of every step, and gauges; [`moving_mean`]: the mean over 1 ms
//! - [`height`]: gauges of the height that is left
//! - [`energy`]: energies of a state
//! - [`parts`]: how far each part was used, and the energy in it
//! - [`fields`]: the structure as VTU files, and what the numbers in them mean

pub mod energy;
pub mod fields;
pub mod height;
pub mod moving_mean;
pub mod parts;
pub mod record;
