//! The interface over time for ParaView, where the structure is not this project's and writes no fields of its own.

use crate::interface::Moved;
use serde::{Deserialize, Serialize};
use std::io;
use std::path::Path;
use toolkit::vtu::{Cells, KeptSeries, Series, Vtu};

/// Name of the series in the directory of the fields.
const NAME: &str = "interface";

/// Writes the interface now and then.
pub struct Fields {
    series: Series,
    interval: f64,
    next: f64,
}

/// What is kept of them for a run that goes on.
#[derive(Serialize, Deserialize)]
pub struct KeptFields(KeptSeries, f64);

impl Fields {
    /// In `dir`, every `interval` [s]; of a run that goes on, behind what is there.
    pub fn new(dir: &Path, interval: f64, kept: Option<KeptFields>) -> io::Result<Self> {
        let (series, next) = match kept {
            Some(KeptFields(series, next)) => (Series::go_on(dir, NAME, series)?, next),
            None => (Series::create(dir, NAME)?, 0.0),
        };
        Ok(Self { series, interval, next })
    }

    /// Write the state, if it is time.
    pub fn add(&mut self, moved: &Moved) -> io::Result<()> {
        let Moved { time, mesh, motion: (u, v), force, given } = *moved;
        if time < self.next * (1.0 - 1e-9) {
            return Ok(());
        }
        self.next = self.interval * ((time / self.interval + 1e-6).floor() + 1.0);
        let residual: Vec<f64> = u.iter().zip(given).map(|(u, given)| u - given).collect();
        let points: Vec<f64> = mesh.coordinates.iter().zip(u).map(|(x, u)| x + u).collect();
        let cells = mesh.lines.iter().map(|line| &line[..]).chain(mesh.faces.iter().map(|face| &face[..]));
        let (mut nodes, mut ends) = (Vec::new(), Vec::new());
        for cell in cells {
            nodes.extend_from_slice(cell);
            ends.push(nodes.len() as u32);
        }
        let mut point_data = vec![("displacement", 3, u), ("velocity", 3, v), ("residual", 3, &residual[..])];
        point_data.extend(force.map(|force| ("contact_force", 3, force)));
        let cells = match ends.is_empty() {
            true => Cells::Vertices,
            false => Cells::Polygons { nodes: &nodes, ends: &ends },
        };
        self.series.add(time, &Vtu { points: &points, cells, point_data, cell_data: vec![] })
    }

    /// All of it on the disk.
    pub fn kept(&mut self) -> io::Result<KeptFields> {
        Ok(KeptFields(self.series.kept()?, self.next))
    }

    /// Wait until all is written.
    pub fn finish(&mut self) -> io::Result<()> {
        self.series.finish()
    }
}
