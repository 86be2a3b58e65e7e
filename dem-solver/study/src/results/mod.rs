//! What follows from all members, in their order: whatever was computed where, the files are the same.
//!
//! - [`cells`]: values of every member by cell; [`raster`]: GeoTIFF; [`picture`]: the same to look at
//! - [`lines`]: what passes each line; [`design`]: what a barrier there must be able to do; [`trajectories`]: trajectories and ends for a map

pub mod cells;
pub mod design;
pub mod lines;
pub mod picture;
pub mod raster;
pub mod trajectories;

use super::base::Base;
use super::record::Record;
use design::{Checked, Reliability};
use std::io;
use std::path::Path;
use toolkit::files::Dir;

/// Rasters, pictures, trajectories.
pub const MAPS: &str = "maps";
/// Tables and curves of the lines.
pub const LINES: &str = "lines";

/// Calls what it is given with every record, in order.
pub type All<'a> = &'a mut dyn FnMut(&mut dyn FnMut(&Record) -> io::Result<()>) -> io::Result<()>;

/// Write all files into `dir`; the measures and checks of the lines, and what the user should know.
pub fn write(base: &Base, dir: &Path, study: &Reliability, all: All) -> io::Result<Checked> {
    let mut found = Checked::default();
    if let Some(grid) = &base.grid {
        let maps = dir.join(MAPS);
        Dir::create(&maps)?;
        let system = raster::System::of(base);
        found.warnings.extend(system.warning());
        cells::write(base, grid, &system, &maps, all)?;
        trajectories::write(base, &system, &maps, all)?;
    }
    if !base.lines.is_empty() {
        let lines = dir.join(LINES);
        Dir::create(&lines)?;
        lines::write(base, &lines, all, study, &mut found)?;
    }
    Ok(found)
}
