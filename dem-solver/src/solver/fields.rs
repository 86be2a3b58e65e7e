//! Field files: the spheres as points with radius, and the surface of the true solids.

use super::Model;
use super::state::State;
use interface_defs::Fault;
use interface_defs::toolkit::vtu::{Cells, Series, Vtu};
use std::io;
use std::path::Path;

/// The series `rocks` and `rock_surface`, written whenever an interval has passed.
pub struct Fields {
    interval: f64,
    written: u64,
    spheres: Series,
    surface: Series,
    radius: Vec<f64>,
    rock: Vec<f64>,
    triangles: Vec<[u32; 3]>,
}

impl Fields {
    /// New series in `dir`, a step each `interval` [s] from t = 0 on.
    pub fn create(dir: &Path, interval: f64, model: &Model) -> Result<Self, Fault> {
        let mut fields = Self {
            interval,
            written: 0,
            spheres: Series::create(dir, "rocks").map_err(unwritable)?,
            surface: Series::create(dir, "rock_surface").map_err(unwritable)?,
            radius: Vec::new(),
            rock: Vec::new(),
            triangles: Vec::new(),
        };
        let mut points = 0;
        for (number, rock) in model.rocks.iter().enumerate() {
            fields.radius.extend(rock.spheres.iter().map(|s| s.radius));
            fields.rock.extend(rock.spheres.iter().map(|_| number as f64));
            let (nodes, triangles) = rock.solid.surface();
            fields.triangles.extend(triangles.iter().map(|t| t.map(|n| n + points)));
            points += nodes.len() as u32;
        }
        Ok(fields)
    }

    /// Write `state` if its time has reached the next multiple of the interval.
    pub fn write_if_due(&mut self, model: &Model, state: &State) -> Result<(), Fault> {
        // A time that is a multiple but for rounding counts as that multiple.
        if state.time < self.written as f64 * self.interval - 1e-9 * self.interval {
            return Ok(());
        }
        self.written = (state.time / self.interval + 1e-9).floor() as u64 + 1;
        self.write(model, state).map_err(unwritable)
    }

    fn write(&mut self, model: &Model, state: &State) -> io::Result<()> {
        let (mut centres, mut velocities, mut corners) = (Vec::new(), Vec::new(), Vec::new());
        for (rock, body) in model.rocks.iter().zip(&state.bodies) {
            let motion = &body.motion;
            let spin = rock.spin(motion);
            let place = motion.position + model.origin;
            for sphere in &rock.spheres {
                let arm = motion.orientation * sphere.centre;
                centres.extend_from_slice((place + arm).as_slice());
                velocities.extend_from_slice((motion.velocity + spin.cross(&arm)).as_slice());
            }
            for corner in rock.solid.surface().0 {
                corners.extend_from_slice((place + motion.orientation * corner).as_slice());
            }
        }
        let spheres = Vtu {
            points: &centres,
            cells: Cells::Vertices,
            point_data: vec![
                ("radius", 1, &self.radius),
                ("rock", 1, &self.rock),
                ("velocity", 3, &velocities),
            ],
            cell_data: vec![],
        };
        self.spheres.add(state.time, &spheres)?;
        let cells = Cells::Triangles(&self.triangles);
        self.surface.add(state.time, &Vtu { points: &corners, cells, point_data: vec![], cell_data: vec![] })
    }
}

fn unwritable(e: io::Error) -> Fault {
    Fault::broken(format!("the field files cannot be written: {e}"))
}
