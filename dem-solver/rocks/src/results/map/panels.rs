//! Along the trajectories: a section of the terrain, jump height, speed, kinetic energy.

use super::net::{self, Net};
use super::page::{FEW, Line, PLOT, SECTIONS, TrajectoryPoint, colour, spacing};
use super::sheet::{Area, Axes, Chart, Drawn, LEFT, RIGHT, font, plot, px, thinned};
use plotters::prelude::*;

/// Height of a plain panel on the page [px].
pub const PANEL: i32 = 150;
/// Room above a plot for its heading, and below for its axis [px].
const ABOVE: i32 = 26;
const BELOW: i32 = 24;
const BELOW_LAST: i32 = 42;
/// Lowest and highest section [px].
const SECTION: [f64; 2] = [150.0, 440.0];
const TERRAIN: RGBColor = RGBColor(222, 209, 188);
const SURFACE: RGBColor = RGBColor(101, 67, 33);

/// A curve over the distance: what it is, its unit, its value at a point.
type Curve = (&'static str, &'static str, fn(&TrajectoryPoint) -> Option<f64>);

/// One below the other, in the order of [`Line::peaks`].
pub const CURVES: [Curve; 3] = [
    ("Jump height of the rock's lowest point", "m", |p| p.row.height().map(|jump| jump.max(0.0))),
    ("Speed", "m/s", |p| Some(p.row.speed())),
    ("Kinetic energy, rotation included", "kJ", |p| Some(p.row.kinetic_energy() / 1000.0)),
];

/// What is drawn over the distance along the trajectories.
pub struct Panels<'a> {
    lines: &'a [&'a Line],
    /// Numbers of the trajectories with a section, the longest first.
    sections: Vec<usize>,
    /// What of the structure lies near them.
    nets: Vec<Vec<[(f64, f64); 2]>>,
    far: f64,
    /// Lowest and highest point of the sections [m].
    levels: [f64; 2],
    /// Height of the section's plot [px], and how much steeper it is drawn than it is.
    plot: f64,
    exaggeration: f64,
}

impl<'a> Panels<'a> {
    /// Of these trajectories.
    pub fn new(lines: &'a [&'a Line], net: &Net) -> Self {
        let mut sections: Vec<usize> = (0..lines.len()).collect();
        // Many sections in one picture say nothing: then that of the longest trajectory alone.
        sections.sort_by(|a, b| lines[*b].length().total_cmp(&lines[*a].length()));
        sections.truncate(if lines.len() > SECTIONS { 1 } else { SECTIONS });
        let far = lines.iter().map(|l| l.length()).fold(0.0, f64::max).max(1e-3);
        let nets: Vec<_> = sections.iter().map(|number| net.section(lines[*number])).collect();
        let heights = || {
            let points = sections.iter().flat_map(|n| &lines[*n].points);
            let of_nets = nets.iter().flatten().flatten().map(|(_, z)| *z);
            points.flat_map(|p| [Some(p.row.position()[2]), p.ground]).flatten().chain(of_nets)
        };
        let (low, high) =
            (heights().fold(f64::INFINITY, f64::min), heights().fold(f64::NEG_INFINITY, f64::max));
        let (low, high) = if low <= high { (low, high) } else { (0.0, 1.0) };
        let room = 0.06 * (high - low) + 0.01 * far;
        let levels = [low - room, high + room];
        let per_pixel = far / PLOT;
        let even = (levels[1] - levels[0]) / per_pixel;
        let plot = even.clamp(SECTION[0], SECTION[1]);
        Self { lines, sections, nets, far, levels, plot, exaggeration: plot / even }
    }

    /// Room that the section takes on the page [px].
    pub fn section_height(&self) -> i32 {
        self.plot.round() as i32 + ABOVE + BELOW
    }

    fn metres_per_pixel(&self) -> f64 {
        self.far / PLOT
    }

    /// The terrain under the trajectory, and the trajectory over it.
    pub fn section(&self, area: &Area) -> Drawn {
        let scale = match self.exaggeration {
            e if (e - 1.0).abs() < 0.005 => "vertical and horizontal scale are equal".to_owned(),
            e => format!("vertical scale {} times the horizontal", significant(e)),
        };
        let whose = match (self.sections.len(), self.lines.len()) {
            (1, 1) => String::new(),
            (1, _) => format!(" of {}, the longest", self.lines[self.sections[0]].name),
            _ => "s".into(),
        };
        let heading = format!("Terrain section along the trajectory{whose} ({scale})");
        let heading = heading.replace("trajectorys", "trajectories");
        let mut chart = self.chart(area, &heading, "elevation [m]", self.levels, BELOW)?;
        let per_pixel = [self.metres_per_pixel(), (self.levels[1] - self.levels[0]) / self.plot];
        let surface = |line: &Line| {
            let points = line.points.iter().zip(&line.along);
            thinned(points.filter_map(|(p, x)| Some((*x, p.ground?))), per_pixel, 0.5)
        };
        let first = surface(self.lines[self.sections[0]]);
        chart.draw_series(AreaSeries::new(first, self.levels[0], TERRAIN.filled()))?;
        for (place, number) in self.sections.iter().enumerate() {
            let line = self.lines[*number];
            let tint = if place == 0 { SURFACE } else { colour(*number) };
            let style = tint.mix(if place == 0 { 1.0 } else { 0.5 }).stroke_width(px(1.0) as u32);
            chart.plotting_area().draw(&PathElement::new(surface(line), style))?;
        }
        let range = [[0.0, self.levels[0]], [self.far, self.levels[1]]];
        for edge in net::drawn(self.nets.iter().flatten().copied(), range, per_pixel) {
            chart.plotting_area().draw(&PathElement::new(edge, net::style()))?;
        }
        for number in &self.sections {
            let line = self.lines[*number];
            let heights = line.points.iter().zip(&line.along).map(|(p, x)| (*x, p.row.position()[2]));
            let style = colour(*number).stroke_width(px(1.6) as u32);
            chart.plotting_area().draw(&PathElement::new(thinned(heights, per_pixel, 0.5), style))?;
            for k in line.landings() {
                let at = (line.along[k], line.points[k].row.position()[2]);
                chart.plotting_area().draw(&Circle::new(at, px(2.4), colour(*number).filled()))?;
            }
        }
        Ok(())
    }

    /// Draw curve number `number` of [`CURVES`].
    pub fn curve(&self, area: &Area, number: usize) -> Drawn {
        let (heading, unit, value) = CURVES[number];
        let below = if number + 1 == CURVES.len() { BELOW_LAST } else { BELOW };
        // A peak may lie between two points; the heading gives the number of the summary.
        let points = self.lines.iter().flat_map(|l| &l.points).filter_map(value);
        let highest = points.chain(self.lines.iter().map(|l| l.peaks[number])).fold(1e-6, f64::max);
        let heading = format!("{heading} (largest {} {unit})", significant(highest));
        let levels = [0.0, 1.08 * highest];
        let mut chart = self.chart(area, &heading, &format!("[{unit}]"), levels, below)?;
        let plot = f64::from(PANEL - ABOVE - below);
        let per_pixel = [self.metres_per_pixel(), levels[1] / plot];
        let width = if self.lines.len() > FEW { 0.8 } else { 1.5 };
        for (number, line) in self.lines.iter().enumerate() {
            let points = line.points.iter().zip(&line.along);
            let values = points.filter_map(|(p, x)| Some((*x, value(p)?)));
            let curve = thinned(values, per_pixel, spacing(self.lines.len()));
            let style = colour(number).stroke_width(px(width) as u32);
            chart.draw_series(std::iter::once(PathElement::new(curve, style)))?;
        }
        Ok(())
    }

    /// Axes, grid and heading of a plot over the distance.
    fn chart<'b, 'c>(
        &self,
        area: &'b Area<'c>,
        heading: &str,
        unit: &str,
        levels: [f64; 2],
        below: i32,
    ) -> Drawn<Chart<'b, 'c>> {
        let along = "horizontal distance along the trajectory [m]";
        let titles = [if below == BELOW_LAST { along } else { "" }, unit];
        let axes = Axes { room: [ABOVE, RIGHT, below, LEFT], titles, numbers: [11, 5], grid: true };
        let chart = plot(area, [[0.0, levels[0]], [self.far, levels[1]]], &axes)?;
        area.draw(&Text::new(heading.to_owned(), (px(f64::from(LEFT)), px(7.0)), font(13.0)))?;
        Ok(chart)
    }
}

/// Three digits.
fn significant(value: f64) -> String {
    let digits = (2 - value.abs().max(1e-9).log10().floor() as i32).clamp(0, 6) as usize;
    format!("{value:.digits$}")
}
