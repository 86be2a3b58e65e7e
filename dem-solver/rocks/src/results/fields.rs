//! Field files: the spheres as points with radius, and the surface of the true solids; where there is terrain,
//! its triangles and, at the end, the trajectories over it.

use crate::model::Model;
use crate::model::state::State;
use crate::results::trajectory::Row;
use dem_terrain::Terrain;
use interface_defs::Fault;
use serde::{Deserialize, Serialize};
use std::io;
use std::path::{Path, PathBuf};
use toolkit::files;
use toolkit::vtu::{Cells, KeptSeries, Series, Vtu};

/// The two series.
const SPHERES: &str = "rocks";
const SURFACE: &str = "rock_surface";
/// The terrain, which never moves.
const TERRAIN: &str = "terrain.vtu";
/// The trajectories of all rocks.
pub const TRAJECTORIES: &str = "trajectory.vtu";

/// The series `rocks` and `rock_surface`, written whenever an interval has passed.
pub struct FieldFiles {
    dir: PathBuf,
    interval: f64,
    written: u64,
    spheres: Series,
    surface: Series,
    radius: Vec<f64>,
    rock: Vec<f64>,
    triangles: Vec<[u32; 3]>,
    /// Number of the rock of each triangle.
    of: Vec<f64>,
}

/// What was written, for a run that goes on.
#[derive(Debug, Serialize, Deserialize)]
pub struct KeptFields {
    written: u64,
    spheres: KeptSeries,
    surface: KeptSeries,
}

impl FieldFiles {
    /// New series in `dir`, a step each `interval` [s] from t = 0 on; the terrain is written at once.
    pub fn create(dir: &Path, interval: f64, model: &Model) -> Result<Self, Fault> {
        let mut fields = Self {
            dir: dir.to_owned(),
            interval,
            written: 0,
            spheres: Series::create(dir, SPHERES).map_err(unwritable)?,
            surface: Series::create(dir, SURFACE).map_err(unwritable)?,
            radius: Vec::new(),
            rock: Vec::new(),
            triangles: Vec::new(),
            of: Vec::new(),
        };
        let mut points = 0;
        for (number, rock) in model.rocks.iter().enumerate() {
            fields.radius.extend(rock.spheres.iter().map(|s| s.radius));
            fields.rock.extend(rock.spheres.iter().map(|_| number as f64));
            if number >= model.settings.named() {
                continue;
            }
            let surface = &rock.solid.drawn;
            fields.triangles.extend(surface.triangles.iter().map(|t| t.map(|n| n + points)));
            fields.of.extend(surface.triangles.iter().map(|_| number as f64));
            points += surface.points.len() as u32;
        }
        if let Some(ground) = &model.ground {
            files::write(&dir.join(TERRAIN), terrain(ground).as_ref()).map_err(unwritable)?;
        }
        Ok(fields)
    }

    /// The series in `dir` as they were when they were [`FieldFiles::kept`].
    pub fn go_on(dir: &Path, interval: f64, model: &Model, kept: KeptFields) -> Result<Self, Fault> {
        let mut fields = Self::create(dir, interval, model)?;
        fields.written = kept.written;
        fields.spheres = Series::go_on(dir, SPHERES, kept.spheres).map_err(unwritable)?;
        fields.surface = Series::go_on(dir, SURFACE, kept.surface).map_err(unwritable)?;
        Ok(fields)
    }

    /// What was written so far, all of it on the disk.
    pub fn kept(&mut self) -> Result<KeptFields, Fault> {
        let spheres = self.spheres.kept().map_err(unwritable)?;
        let surface = self.surface.kept().map_err(unwritable)?;
        Ok(KeptFields { written: self.written, spheres, surface })
    }

    /// Write the trajectories of all rocks, rows by rock, as lines.
    pub fn write_trajectories(&self, trajectories: &[Vec<Row>]) -> io::Result<()> {
        let (mut points, mut lines) = (Vec::new(), Vec::new());
        let mut data = [(); 4].map(|()| Vec::new());
        for (rock, line) in trajectories.iter().enumerate() {
            let first = (points.len() / 3) as u32;
            lines.extend((1..line.len() as u32).map(|k| [first + k - 1, first + k]));
            for row in line {
                points.extend(row.position());
                // Outside of the terrain there is no height over it.
                let values = [row.time(), row.speed(), row.height().unwrap_or(0.0), rock as f64];
                data.iter_mut().zip(values).for_each(|(list, value)| list.push(value));
            }
        }
        let [time, speed, height, rock] = &data;
        let point_data =
            vec![("time", 1, &time[..]), ("speed", 1, speed), ("jump_height", 1, height), ("rock", 1, rock)];
        let vtu = Vtu { points: &points, cells: Cells::Lines(&lines), point_data, cell_data: vec![] };
        files::write(&self.dir.join(TRAJECTORIES), &vtu.to_bytes())
    }

    /// Wait until all states are written.
    pub fn finish(&mut self) -> Result<(), Fault> {
        self.spheres.finish().and_then(|()| self.surface.finish()).map_err(unwritable)
    }

    /// Write `state` if its time has reached the next multiple of the interval.
    pub fn write_if_due(&mut self, model: &Model, state: &State) -> Result<(), Fault> {
        if due(&mut self.written, self.interval, state.time) {
            self.write(model, state).map_err(unwritable)?;
        }
        Ok(())
    }

    fn write(&mut self, model: &Model, state: &State) -> io::Result<()> {
        let (mut centres, mut velocities, mut corners) = (Vec::new(), Vec::new(), Vec::new());
        for (number, (rock, body)) in model.rocks.iter().zip(&state.bodies).enumerate() {
            let motion = &body.motion;
            let spin = rock.spin(motion);
            let place = motion.position + model.origin;
            for sphere in &rock.spheres {
                let arm = motion.orientation * sphere.centre;
                centres.extend_from_slice((place + arm).as_slice());
                velocities.extend_from_slice((motion.velocity + spin.cross(&arm)).as_slice());
            }
            if number >= model.settings.named() {
                continue;
            }
            for corner in &rock.solid.drawn.points {
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
        self.surface.add(
            state.time,
            &Vtu { points: &corners, cells, point_data: vec![], cell_data: vec![("rock", 1, &self.of)] },
        )
    }
}

/// The triangles in the user's coordinates, with the number of the zone of each where there are zones.
fn terrain(ground: &Terrain) -> Vec<u8> {
    let points: Vec<f64> = ground.nodes.iter().flat_map(|n| <[f64; 3]>::from(n + ground.origin)).collect();
    let zones: Vec<f64> = ground.zones.iter().map(|z| f64::from(*z)).collect();
    let cell_data = if zones.is_empty() { vec![] } else { vec![("zone", 1, &zones[..])] };
    Vtu { points: &points, cells: Cells::Triangles(&ground.triangles), point_data: vec![], cell_data }
        .to_bytes()
}

/// True if `time` [s] has reached the next multiple of an interval [s] of which so many are `written`: then it counts as written, too.
pub(crate) fn due(written: &mut u64, interval: f64, time: f64) -> bool {
    // A time that is a multiple but for rounding counts as that multiple.
    let due = time >= *written as f64 * interval - 1e-9 * interval;
    if due {
        *written = (time / interval + 1e-9).floor() as u64 + 1;
    }
    due
}

/// The fault of a field file that cannot be written.
pub(crate) fn unwritable(e: io::Error) -> Fault {
    Fault::broken(format!("the field files cannot be written: {e}"))
}
