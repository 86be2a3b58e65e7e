//! What the parts of `trajectory.svg` share: what is drawn, sizes, colours.

use super::sheet::{LEFT, RIGHT};
use crate::results::trajectory::Row;
use plotters::prelude::*;

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
    /// Horizontal distance along it at each point [m].
    pub along: Vec<f64>,
    /// Largest jump height [m], speed [m/s] and kinetic energy, rotation included [kJ], at any step; zero where only the points are known.
    pub peaks: [f64; 3],
}

impl Line {
    /// With the distances along `points`.
    pub fn new(name: String, points: Vec<TrajectoryPoint>) -> Self {
        let mut far = 0.0;
        let mut before: Option<[f64; 3]> = None;
        let along = points
            .iter()
            .map(|p| {
                let place = p.row.position();
                far += before.map_or(0.0, |b| (place[0] - b[0]).hypot(place[1] - b[1]));
                before = Some(place);
                far
            })
            .collect();
        Self { name, points, along, peaks: [0.0; 3] }
    }

    /// Point number `k` as seen from above [m].
    pub fn seen(&self, k: usize) -> (f64, f64) {
        let [x, y, _] = self.points[k].row.position();
        (x, y)
    }

    /// Length of its projection on the plan [m].
    pub fn length(&self) -> f64 {
        self.along.last().copied().unwrap_or(0.0)
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
/// Colours of the rocks.
pub const COLOURS: [RGBColor; 6] = [
    RGBColor(193, 18, 31),
    RGBColor(3, 83, 164),
    RGBColor(123, 44, 191),
    RGBColor(0, 121, 107),
    RGBColor(181, 101, 29),
    RGBColor(60, 60, 60),
];

/// Colour of the line with this number; they repeat.
pub fn colour(number: usize) -> RGBColor {
    COLOURS[number % COLOURS.len()]
}

/// How close points of a line may lie [px]: closer where there are few lines, so that the file stays small.
pub fn spacing(lines: usize) -> f64 {
    0.5 * (lines as f64 / FEW as f64).max(1.0)
}
