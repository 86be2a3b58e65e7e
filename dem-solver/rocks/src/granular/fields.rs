//! Field files: the spheres as points with radius, velocity and spin.

use super::GranularModel;
use super::state::GranularState;
use crate::results::fields::{due, unwritable};
use interface_defs::Fault;
use std::path::Path;
use toolkit::vtu::{Cells, Series, Vtu};

/// The series `spheres`, written whenever an interval has passed.
pub struct GranularFields {
    interval: f64,
    written: u64,
    series: Series,
    group: Vec<f64>,
}

impl GranularFields {
    /// A new series in `dir`, a step each `interval` [s] from t = 0 on.
    pub fn create(dir: &Path, interval: f64, model: &GranularModel) -> Result<Self, Fault> {
        let series = Series::create(dir, "spheres").map_err(unwritable)?;
        let group = model.group.iter().map(|g| f64::from(*g)).collect();
        Ok(Self { interval, written: 0, series, group })
    }

    /// Wait until all states are written.
    pub fn finish(&mut self) -> Result<(), Fault> {
        self.series.finish().map_err(unwritable)
    }

    /// Write `state` if its time has reached the next multiple of the interval.
    pub fn write_if_due(&mut self, model: &GranularModel, state: &GranularState) -> Result<(), Fault> {
        if !due(&mut self.written, self.interval, state.time) {
            return Ok(());
        }
        let flat = |vectors: &[nalgebra::Vector3<f64>]| -> Vec<f64> {
            vectors.iter().flat_map(|v| [v.x, v.y, v.z]).collect()
        };
        let (points, velocity, spin) = (flat(&state.position), flat(&state.velocity), flat(&state.spin));
        let vtu = Vtu {
            points: &points,
            cells: Cells::Vertices,
            point_data: vec![
                ("radius", 1, &model.radius),
                ("group", 1, &self.group),
                ("velocity", 3, &velocity),
                ("spin", 3, &spin),
            ],
            cell_data: vec![],
        };
        self.series.add(state.time, &vtu).map_err(unwritable)
    }
}
