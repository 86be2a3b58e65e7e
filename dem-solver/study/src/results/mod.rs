//! What follows from all members, in their order: whatever was computed where, the files are the same.
//!
//! - [`maps`]: values of every member by cell, as GeoTIFF, and trajectories and ends; [`picture`]: the same to look at
//! - [`lines`]: what passes each line; [`frequency`]: how often in a year; [`design`]: what a barrier there must be able to do

pub mod design;
pub mod frequency;
mod geopackage;
pub mod lines;
pub mod maps;
pub mod picture;
pub mod style;

use super::base::Base;
use super::record::All;
use dem_rocks::results::map::sheet::Imprint;
use design::{Checked, Reliability};
use std::io;
use std::path::Path;
use toolkit::files::Dir;
use toolkit::run_dir::STUDY_RECORD;

/// Rasters, pictures, trajectories.
pub const MAPS: &str = "maps";
/// Tables and curves of the lines.
pub const LINES: &str = "lines";

/// Write all files into `dir`; the measures and checks of the lines, and what the user should know.
pub fn write(base: &Base, dir: &Path, study: &Reliability, all: All) -> io::Result<Checked> {
    let mut found = Checked::default();
    let system = maps::System::of(base);
    let imprint = Imprint::new(base.study.title.clone(), &dir.join(STUDY_RECORD), system.epsg);
    if let Some(grid) = &base.grid {
        let maps = dir.join(MAPS);
        Dir::create(&maps)?;
        found.warnings.extend(system.warning());
        maps::write(base, grid, &system, &maps, &imprint, all)?;
        maps::write_features(base, &system, &maps, all)?;
    }
    if !base.lines.is_empty() {
        let lines = dir.join(LINES);
        Dir::create(&lines)?;
        lines::write(base, &lines, &imprint, all, study, &mut found)?;
    }
    Ok(found)
}
