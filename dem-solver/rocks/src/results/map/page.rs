//! What the parts of the picture share: what is drawn, sizes, colours, numbers at axes.

use crate::results::trajectory::Row;
use plotters::coord::types::RangedCoordf64;
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

/// Drawn in quarters of a pixel: the backend rounds to whole numbers.
pub const FINE: i32 = 4;
/// Width of the page [px].
pub const WIDTH: i32 = 1000;
/// Room left of the plots, for titles and numbers of the axes [px].
pub const LEFT: i32 = 86;
/// Free edge left of the titles of the axes [px].
pub const EDGE: i32 = 10;
/// Free edge right of the plots [px].
pub const RIGHT: i32 = 22;
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
/// Colour of text and axes.
pub const INK: RGBColor = RGBColor(40, 40, 40);

/// What is drawn on.
pub type Area<'a> = DrawingArea<SVGBackend<'a>, plotters::coord::Shift>;
/// A plot with its axes.
pub type Chart<'a, 'b> = ChartContext<'a, SVGBackend<'b>, Cartesian2d<RangedCoordf64, RangedCoordf64>>;
/// Whether it could be drawn.
pub type Drawn = Result<(), DrawingAreaErrorKind<std::io::Error>>;

/// Pixels of the page in units of the drawing.
pub fn px(pixels: f64) -> i32 {
    (pixels * f64::from(FINE)).round() as i32
}

/// Text of this height [px].
pub fn font<'a>(size: f64) -> TextStyle<'a> {
    ("sans-serif", px(size)).into_font().color(&INK)
}

/// Colour of the line with this number; they repeat.
pub fn colour(number: usize) -> RGBColor {
    COLOURS[number % COLOURS.len()]
}

/// 1, 2 or 5 times a power of ten, at least `step`.
pub fn round_step(step: f64) -> f64 {
    let power = 10_f64.powf(step.log10().floor());
    [1.0, 2.0, 5.0, 10.0].into_iter().map(|f| f * power).find(|s| *s >= step * (1.0 - 1e-9)).unwrap_or(1.0)
}

/// How close points of a line may lie [px]: closer where there are few lines, so that the file stays small.
pub fn spacing(lines: usize) -> f64 {
    0.5 * (lines as f64 / FEW as f64).max(1.0)
}

/// A number at an axis: as many digits as it has.
pub fn number(value: &f64) -> String {
    let text = format!("{value:.4}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".into() } else { text.into() }
}

/// Points of a polyline without those that lie closer than this to the one before [px].
pub fn thinned(
    points: impl Iterator<Item = (f64, f64)>,
    per_pixel: [f64; 2],
    closer: f64,
) -> Vec<(f64, f64)> {
    let mut kept: Vec<(f64, f64)> = Vec::new();
    let mut skipped = None;
    for (x, y) in points {
        let far =
            kept.last().is_none_or(|(a, b)| ((x - a) / per_pixel[0]).hypot((y - b) / per_pixel[1]) > closer);
        if far {
            kept.push((x, y));
        }
        skipped = (!far).then_some((x, y));
    }
    kept.extend(skipped);
    kept
}
