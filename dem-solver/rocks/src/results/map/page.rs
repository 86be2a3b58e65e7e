//! What the parts of `trajectory.svg` share: what is drawn, sizes, colours.

use super::sheet::{LEFT, RIGHT};
use crate::results::trajectory::Row;
use dem_contact::settings::TerrainSettings;
use plotters::prelude::*;
use toolkit::picture::COLOURS;

/// One moment of a trajectory.
#[derive(Debug, Clone, Copy)]
pub struct TrajectoryPoint {
    /// What the rock does.
    pub row: Row,
    /// Height of the terrain under it [m].
    pub ground: Option<f64>,
}

/// The trajectory of one rock.
#[derive(Debug, Clone)]
pub struct Line {
    /// Name of the rock.
    pub name: String,
    /// In the order of time.
    pub points: Vec<TrajectoryPoint>,
    /// Largest jump height [m], speed [m/s] and kinetic energy, rotation included [kJ], at any step; zero where only the points are known.
    pub peaks: [f64; 3],
}

/// The horizontal axis of the section and of the curves, straight in the plan.
#[derive(Debug, Clone, Copy)]
pub struct Axis {
    start: (f64, f64),
    /// Of length 1.
    along: (f64, f64),
}

impl Axis {
    /// From the start of a trajectory to its farthest point.
    pub fn new(line: &Line) -> Self {
        let start = line.seen(0);
        let far = |k: &usize| (line.seen(*k).0 - start.0).hypot(line.seen(*k).1 - start.1);
        let end = (0..line.points.len()).max_by(|a, b| far(a).total_cmp(&far(b))).unwrap_or(0);
        // A rock that does not move has a section from west to east.
        let along = match far(&end) {
            far if far > 1e-6 => ((line.seen(end).0 - start.0) / far, (line.seen(end).1 - start.1) / far),
            _ => (1.0, 0.0),
        };
        Self { start, along }
    }

    /// Distance along it of a place [m]; negative before its start.
    pub fn of(&self, (x, y): (f64, f64)) -> f64 {
        (x - self.start.0) * self.along.0 + (y - self.start.1) * self.along.1
    }

    /// The place at this distance.
    pub fn at(&self, far: f64) -> (f64, f64) {
        (self.start.0 + far * self.along.0, self.start.1 + far * self.along.1)
    }

    /// Its direction from north over east [degrees].
    pub fn azimuth(&self) -> f64 {
        self.along.0.atan2(self.along.1).to_degrees().rem_euclid(360.0)
    }
}

impl Line {
    /// Of these points.
    pub fn new(name: String, points: Vec<TrajectoryPoint>) -> Self {
        Self { name, points, peaks: [0.0; 3] }
    }

    /// Point number `k` as seen from above [m].
    pub fn seen(&self, k: usize) -> (f64, f64) {
        let [x, y, _] = self.points[k].row.position();
        (x, y)
    }

    /// Length of its projection on the plan [m].
    pub fn length(&self) -> f64 {
        let pairs = (1..self.points.len()).map(|k| (self.seen(k - 1), self.seen(k)));
        pairs.map(|(a, b)| (a.0 - b.0).hypot(a.1 - b.1)).sum()
    }

    /// Points at which the rock lands.
    pub fn landings(&self) -> impl Iterator<Item = usize> {
        let touches = |k: usize| self.points[k].row.touches();
        (1..self.points.len()).filter(move |k| touches(*k) && !touches(k - 1))
    }
}

/// The terrain as the picture needs it.
pub struct HeightMap<'a> {
    /// Lowest and highest x and y that it has [m].
    pub extent: [[f64; 2]; 2],
    /// Height at x and y [m], where there is terrain.
    pub height: &'a dyn Fn(f64, f64) -> Option<f64>,
    /// Its table in the scene, with zones of other ground.
    pub settings: Option<&'a TerrainSettings>,
}

/// Width of the page [px].
pub const WIDTH: i32 = 1000;
/// Width of the plots over the distance, and largest width of the plan [px].
pub const PLOT: f64 = (WIDTH - LEFT - RIGHT) as f64;
/// Trajectories that are drawn along their length with a section of their own.
pub const SECTIONS: usize = 3;
/// Trajectories up to which impacts are marked.
pub const FEW: usize = 20;
/// Height of title and legend [px].
pub const LEGEND: i32 = 58;
/// Names in the legend.
pub const NAMES: usize = 6;

/// Colour of the line with this number; they repeat.
pub fn colour(number: usize) -> RGBColor {
    let (r, g, b) = COLOURS[number % COLOURS.len()];
    RGBColor(r, g, b)
}

/// Which of the dashes of [`super::sheet::draw_line`] the line with this number of so many has: solid where there are too many to be named.
pub fn dashes(number: usize, lines: usize) -> usize {
    if lines > NAMES { 0 } else { number }
}

/// How close points of a line may lie [px]: closer where there are few lines, so that the file stays small.
pub fn spacing(lines: usize) -> f64 {
    0.5 * (lines as f64 / FEW as f64).max(1.0)
}
