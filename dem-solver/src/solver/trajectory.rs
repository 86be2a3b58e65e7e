//! `trajectory.csv`: the way of each rock over the terrain, finer than `history.csv` while it touches.
//!
//! A row stands at each window's end, where a contact begins and ends, ten times in the shortest contact
//! after it began, and five times per row of `history.csv` in one that lasts.

use super::Model;
use super::state::{Body, State};
use interface_defs::Fault;
use interface_defs::toolkit::history::History;
use std::io;
use std::path::Path;

pub use interface_defs::toolkit::run_dir::TRAJECTORY;

const COLUMNS: [&str; 17] = [
    "time_s",
    "rock",
    "x_m",
    "y_m",
    "z_m",
    "vx_m_per_s",
    "vy_m_per_s",
    "vz_m_per_s",
    "wx_rad_per_s",
    "wy_rad_per_s",
    "wz_rad_per_s",
    "energy_translation_J",
    "energy_rotation_J",
    "energy_potential_J",
    "jump_height_m",
    "contact",
    "impacts",
];

/// One row, in the order of the columns: rocks are numbered from 0, potential energy counts from the
/// rock's start, the jump height is empty where there is no ground, contact is 1 or 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Row(pub [f64; COLUMNS.len()]);

impl Row {
    /// Of rock number `rock` at `time` [s].
    pub fn of(
        model: &Model,
        rock: usize,
        body: &Body,
        time: f64,
        height: Option<f64>,
        contact: bool,
    ) -> Self {
        let (it, motion) = (&model.rocks[rock], &body.motion);
        let place = motion.position + model.origin;
        let spin = it.spin(motion);
        let translation = 0.5 * it.mass * motion.velocity.norm_squared();
        let start = nalgebra::Vector3::from(model.settings.rocks[rock].position) - model.origin;
        Self([
            time,
            rock as f64,
            place.x,
            place.y,
            place.z,
            motion.velocity.x,
            motion.velocity.y,
            motion.velocity.z,
            spin.x,
            spin.y,
            spin.z,
            translation,
            it.kinetic_energy(motion) - translation,
            -it.mass * model.settings.gravity.dot(&(motion.position - start)),
            height.unwrap_or(f64::NAN),
            f64::from(u8::from(contact)),
            body.path.impacts as f64,
        ])
    }

    /// Time [s].
    pub fn time(&self) -> f64 {
        self.0[0]
    }

    /// Number of the rock.
    pub fn rock(&self) -> usize {
        self.0[1] as usize
    }

    /// Position [m].
    pub fn position(&self) -> [f64; 3] {
        [self.0[2], self.0[3], self.0[4]]
    }

    /// Speed [m/s].
    pub fn speed(&self) -> f64 {
        nalgebra::Vector3::new(self.0[5], self.0[6], self.0[7]).norm()
    }

    /// Whether it touched.
    pub fn touches(&self) -> bool {
        self.0[15] > 0.0
    }

    /// Jump height [m], where there is ground.
    pub fn height(&self) -> Option<f64> {
        Some(self.0[14]).filter(|h| !h.is_nan())
    }
}

/// Writes the rows, and keeps them for the picture.
pub struct Trajectory {
    file: History,
    /// All rows so far.
    pub rows: Vec<Row>,
}

impl Trajectory {
    /// A new file in `dir`, with the rows at t = 0.
    pub fn create(dir: &Path, model: &Model, state: &State) -> Result<Self, Fault> {
        let columns = COLUMNS.map(String::from);
        let file = History::create(&dir.join(TRAJECTORY), &columns).map_err(unwritable)?;
        let mut it = Self { file, rows: Vec::new() };
        let Some(ground) = &model.ground else { return Ok(it) };
        let first: Vec<Row> = (0..model.rocks.len())
            .map(|rock| {
                let body = &state.bodies[rock];
                let down = model.settings.down();
                let height = super::path::jump_height(ground, &model.rocks[rock], &body.motion, &down);
                Row::of(model, rock, body, state.time, height, body.contacts > 0)
            })
            .collect();
        it.add(&first)?;
        Ok(it)
    }

    /// Append the rows of a committed window.
    pub fn add(&mut self, rows: &[Row]) -> Result<(), Fault> {
        self.rows.extend_from_slice(rows);
        rows.iter().try_for_each(|row| self.file.row(&row.0)).map_err(unwritable)
    }
}

fn unwritable(e: io::Error) -> Fault {
    Fault::broken(format!("{TRAJECTORY} cannot be written: {e}"))
}
