//! `trajectory.csv`: the trajectory of each rock over the terrain, finer than `history.csv` while it touches.
//!
//! A row stands at each window's end, where a contact begins and ends, ten times in the shortest contact
//! after it began, and five times per row of `history.csv` in one that lasts.

use crate::model::Model;
use crate::model::runout::jump_height;
use crate::model::state::{Body, State};
use dem_terrain::Terrain;
use interface_defs::Fault;
use nalgebra::Vector3;
use std::io;
use std::path::Path;
use toolkit::files;
use toolkit::history::{History, Mark};

pub use toolkit::run_dir::TRAJECTORY;

/// Numbers of a row.
const WIDTH: usize = 17;

/// What they are.
fn columns() -> [String; WIDTH] {
    let names = "time_s rock x_m y_m z_m vx_m_per_s vy_m_per_s vz_m_per_s wx_rad_per_s wy_rad_per_s wz_rad_per_s \
                 energy_translation_J energy_rotation_J energy_potential_J jump_height_m contact impacts";
    let mut names = names.split_whitespace().map(String::from);
    std::array::from_fn(|_| names.next().unwrap_or_default())
}

/// Places of the energies in a row.
const TRANSLATION: usize = 11;
const ROTATION: usize = 12;
const POTENTIAL: usize = 13;

/// One row, in the order of the columns: rocks are numbered from 0, potential energy counts from the
/// rock's start, the jump height is empty where there is no ground, contact is 1 or 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Row(pub [f64; WIDTH]);

impl Row {
    /// Of rock number `rock` at `time` [s].
    pub fn of(model: &Model, rock: usize, body: &Body, time: f64, contact: bool) -> Self {
        let (it, motion) = (&model.rocks[rock], &body.motion);
        let [x, y, z] = (motion.position + model.origin).into();
        let [vx, vy, vz] = motion.velocity.into();
        let [wx, wy, wz] = it.spin(motion).into();
        let moving = 0.5 * it.mass * motion.velocity.norm_squared();
        let turning = it.kinetic_energy(motion) - moving;
        let start = Vector3::from(model.settings.rocks[rock].position) - model.origin;
        let potential = -it.mass * model.settings.gravity.dot(&(motion.position - start));
        let height = jump_height(model, rock, motion).unwrap_or(f64::NAN);
        let (touches, impacts) = (f64::from(u8::from(contact)), body.path.impacts as f64);
        let rock = rock as f64;
        Self([
            time, rock, x, y, z, vx, vy, vz, wx, wy, wz, moving, turning, potential, height, touches, impacts,
        ])
    }

    /// At a share (0 to 1) of the time to the row `to`, by the cubic that has place and velocity of both: exact in free
    /// flight, as are the energies. The spin is that of this row.
    pub fn towards(&self, to: &Self, share: f64) -> Self {
        let (s, length) = (share, to.time() - self.time());
        let mut row = *self;
        row.0[0] = self.time() + s * length;
        for axis in 0..3 {
            let (x, v) = (2 + axis, 5 + axis);
            let (a, b) = (self.0[x], to.0[x]);
            let (va, vb) = (self.0[v] * length, to.0[v] * length);
            let (q, c) = (3.0 * (b - a) - 2.0 * va - vb, va + vb - 2.0 * (b - a));
            row.0[x] = a + s * (va + s * (q + s * c));
            row.0[v] = (va + s * (2.0 * q + 3.0 * s * c)) / length;
        }
        // The faster of the two rows gives the mass with the fewest digits lost.
        let faster = if self.speed() > to.speed() { self } else { to };
        let mixed = |of: &dyn Fn(&Self) -> f64| of(self) + s * (of(to) - of(self));
        if faster.speed() > 0.0 {
            row.0[TRANSLATION] = faster.0[TRANSLATION] * (row.speed() / faster.speed()).powi(2);
        }
        row.0[ROTATION] = mixed(&|r| r.0[ROTATION]);
        // What a flight loses of the one energy it gains of the other.
        row.0[POTENTIAL] = mixed(&|r| r.kinetic_energy() + r.0[POTENTIAL]) - row.kinetic_energy();
        row
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
        Vector3::new(self.0[5], self.0[6], self.0[7]).norm()
    }

    /// Velocity [m/s].
    pub fn velocity(&self) -> [f64; 3] {
        [self.0[5], self.0[6], self.0[7]]
    }

    /// Kinetic energy of rotation [J].
    pub fn rotation_energy(&self) -> f64 {
        self.0[ROTATION]
    }

    /// Kinetic energy, rotation included [J].
    pub fn kinetic_energy(&self) -> f64 {
        self.0[TRANSLATION] + self.0[ROTATION]
    }

    /// True if it touched.
    pub fn touches(&self) -> bool {
        self.0[15] > 0.0
    }

    /// Jump height [m], where there is ground.
    pub fn height(&self) -> Option<f64> {
        Some(self.0[14]).filter(|h| !h.is_nan())
    }
}

/// Chords of a flight that is drawn lie this close to its arc [m].
const CHORD: f64 = 0.01;

/// The trajectory of each rock: its rows, with more of them in its flights, so that lines between them look as the rock flew.
pub fn trajectories(model: &Model, ground: &Terrain, rows: &[Row]) -> Vec<Vec<Row>> {
    let down = model.settings.down();
    let centre = |row: &Row| ground.height(&(Vector3::from(row.position()) - model.origin), &down);
    // Of an arc over a time t the chord is g t^2 / 8 away.
    let per_second = (model.settings.gravity.norm() / (8.0 * CHORD)).sqrt();
    let line = |rock: usize| {
        let mut line: Vec<Row> = Vec::new();
        for row in rows.iter().filter(|row| row.rock() == rock) {
            if let Some(from) = line.last().copied().filter(|from| !from.touches()) {
                let parts = (per_second * (row.time() - from.time())).ceil().max(1.0) as usize;
                // How far the lowest point of the rock lies below its centre.
                let below = |row: &Row| centre(row).zip(row.height()).map_or(0.0, |(c, h)| c - h);
                let ends = [below(&from), below(row)];
                line.extend((1..parts).map(|k| {
                    let share = k as f64 / parts as f64;
                    let mut between = from.towards(row, share);
                    let height = centre(&between).map(|c| c - ends[0] - share * (ends[1] - ends[0]));
                    between.0[14] = height.map_or(f64::NAN, |h| h.max(0.0));
                    between
                }));
            }
            line.push(*row);
        }
        line
    };
    (0..model.settings.named()).map(line).collect()
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
        let file = History::create(&dir.join(TRAJECTORY), &columns()).map_err(unwritable)?;
        let mut it = Self { file, rows: Vec::new() };
        let bodies = state.bodies.iter().take(model.settings.named()).enumerate();
        let row = |(rock, body): (usize, &Body)| Row::of(model, rock, body, state.time, body.contacts > 0);
        it.add(&bodies.map(row).collect::<Vec<_>>())?;
        Ok(it)
    }

    /// Go on with the file in `dir` as it was at `mark`: its rows are read again, as they were written.
    pub fn go_on(dir: &Path, mark: &Mark) -> Result<Self, Fault> {
        let path = dir.join(TRAJECTORY);
        let file = History::go_on(&path, &columns(), mark).map_err(unwritable)?;
        let text = files::read_text(&path).map_err(unwritable)?;
        let rows = text.lines().skip(1).map(read).collect::<Option<Vec<Row>>>();
        let rows =
            rows.ok_or_else(|| Fault::broken(format!("{TRAJECTORY} has rows that were not written here")))?;
        Ok(Self { file, rows })
    }

    /// What is written so far, all of it on the disk.
    pub fn kept(&self) -> Result<Mark, Fault> {
        self.file.sync().map_err(unwritable)?;
        Ok(self.file.mark())
    }

    /// Append the rows of a committed window.
    pub fn add(&mut self, rows: &[Row]) -> Result<(), Fault> {
        self.rows.extend_from_slice(rows);
        rows.iter().try_for_each(|row| self.file.row(&row.0)).map_err(unwritable)
    }
}

/// A row as it was written; what was not finite is empty.
fn read(line: &str) -> Option<Row> {
    let mut row = [f64::NAN; WIDTH];
    let mut words = line.split(',');
    for (number, word) in row.iter_mut().zip(&mut words) {
        if !word.is_empty() {
            *number = word.parse().ok()?;
        }
    }
    words.next().is_none().then_some(Row(row))
}

fn unwritable(e: io::Error) -> Fault {
    Fault::broken(format!("{TRAJECTORY} cannot be written: {e}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_free_flight_between_two_rows_is_its_parabola() {
        let at = |t: f64| {
            let mut row = [0.0; WIDTH];
            row[0] = 3.0 + t;
            let height = 5.0 * t - 4.905 * t * t;
            row[2..5].copy_from_slice(&[2.0 * t, -t, height]);
            row[5..8].copy_from_slice(&[2.0, -1.0, 5.0 - 9.81 * t]);
            // Of 3 kg; it spins with 4 J.
            row[11..14].copy_from_slice(&[1.5 * (5.0 + (5.0 - 9.81 * t).powi(2)), 4.0, 29.43 * height]);
            Row(row)
        };
        for share in [0.0, 0.3, 0.5, 1.0] {
            let (found, due) = (at(0.0).towards(&at(0.8), share), at(0.8 * share));
            assert!(
                found.0.iter().zip(&due.0).all(|(a, b)| (a - b).abs() < 1e-14 * b.abs().max(20.0)),
                "{found:?} {due:?}"
            );
        }
    }
}
