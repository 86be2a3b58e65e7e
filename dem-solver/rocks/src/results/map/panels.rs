//! Along the trajectories: a section of the terrain, jump height, speed, kinetic energy.

use super::net::{self, Net};
use super::page::{Axis, FEW, HeightMap, Line, PLOT, SECTIONS, TrajectoryPoint, colour, dashes, spacing};
use super::sheet::{Area, Axes, Chart, Drawn, LEFT, RIGHT, draw_line, font, plot, px, thinned};
use plotters::prelude::*;

/// Height of a plain panel on the page [px].
pub const PANEL: i32 = 150;
/// Room above a plot for its heading, and below for its axis [px].
const ABOVE: i32 = 26;
const BELOW: i32 = 24;
const BELOW_LAST: i32 = 42;
/// Lowest and highest section [px].
const SECTION: [f64; 2] = [150.0, 640.0];
/// Points of the terrain before and behind the trajectory.
const BEYOND: i32 = 20;
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

/// What is drawn over the distance along one straight axis, so that what lies at one place stands at one place.
pub struct Panels<'a> {
    lines: &'a [&'a Line],
    axis: Axis,
    /// Numbers of the trajectories with a section, the longest first.
    sections: Vec<usize>,
    /// What of the structure lies near them.
    nets: Vec<Vec<[(f64, f64); 2]>>,
    /// The terrain under the first of them, and before and behind it along the axis.
    surface: Vec<(f64, f64)>,
    /// Least and largest distance [m].
    reach: [f64; 2],
    /// Lowest and highest point of the sections [m].
    levels: [f64; 2],
    /// Height of the section's plot [px].
    plot: f64,
}

impl<'a> Panels<'a> {
    /// Of these trajectories.
    pub fn new(lines: &'a [&'a Line], terrain: &HeightMap, net: &Net) -> Self {
        let mut sections: Vec<usize> = (0..lines.len()).collect();
        // Many sections in one picture say nothing: then that of the longest trajectory alone.
        sections.sort_by(|a, b| lines[*b].length().total_cmp(&lines[*a].length()));
        sections.truncate(if lines.len() > SECTIONS { 1 } else { SECTIONS });
        let axis = Axis::new(lines[sections[0]]);
        let nets: Vec<_> = sections.iter().map(|number| net.section(lines[*number], &axis)).collect();
        let own = lines.iter().flat_map(|line| (0..line.points.len()).map(|k| axis.of(line.seen(k))));
        let places = own.chain(nets.iter().flatten().flatten().map(|(x, _)| *x));
        let (least, most) = places.fold((0.0_f64, 1e-3_f64), |(low, high), x| (low.min(x), high.max(x)));
        let room = 0.03 * (most - least);
        let reach = [least - room, most + room];
        let surface = surface(lines[sections[0]], &axis, terrain, reach);
        let heights = || {
            let points = sections.iter().flat_map(|n| &lines[*n].points);
            let of_nets = nets.iter().flatten().flatten().map(|(_, z)| *z);
            let own = points.flat_map(|p| [Some(p.row.position()[2]), p.ground]).flatten();
            own.chain(of_nets).chain(surface.iter().map(|(_, z)| *z))
        };
        let (low, high) =
            (heights().fold(f64::INFINITY, f64::min), heights().fold(f64::NEG_INFINITY, f64::max));
        let (low, high) = if low <= high { (low, high) } else { (0.0, 1.0) };
        let far = reach[1] - reach[0];
        let edge = 0.06 * (high - low) + 0.01 * far;
        // Both scales are equal: a high section is narrow, a flat one has sky above it.
        let high_most = (high - low + 2.0 * edge) / SECTION[1] * PLOT;
        let aside = 0.5 * (high_most - far).max(0.0);
        let reach = [reach[0] - aside, reach[1] + aside];
        let per_pixel = (reach[1] - reach[0]) / PLOT;
        let plot = ((high - low + 2.0 * edge) / per_pixel).max(SECTION[0]);
        let levels = [low - edge, low - edge + plot * per_pixel];
        let mut surface = self::surface(lines[sections[0]], &axis, terrain, reach);
        surface.retain(|(_, z)| (levels[0]..=levels[1]).contains(z));
        Self { lines, axis, sections, nets, surface, reach, levels, plot }
    }

    /// Room that the section takes on the page [px].
    pub fn section_height(&self) -> i32 {
        self.plot.round() as i32 + ABOVE + BELOW
    }

    fn metres_per_pixel(&self) -> f64 {
        (self.reach[1] - self.reach[0]) / PLOT
    }

    /// The terrain under the trajectory, and the trajectory over it.
    pub fn section(&self, area: &Area) -> Drawn {
        let whose = match (self.sections.len(), self.lines.len()) {
            (1, 1) => "the trajectory".to_owned(),
            (1, _) => format!("the trajectory of {}, the longest", self.lines[self.sections[0]].name),
            _ => "the trajectories".into(),
        };
        let heading = format!(
            "Terrain section at {whose}, towards {:03.0} degrees from north (heights and lengths 1:1)",
            self.axis.azimuth()
        );
        let chart = self.chart(area, &heading, "elevation [m]", self.levels, BELOW)?;
        let per_pixel = [self.metres_per_pixel(); 2];
        let thin = |points: &[(f64, f64)]| thinned(points.iter().copied(), per_pixel, 0.5);
        let mut ground = thin(&self.surface);
        if let (Some(first), Some(last)) = (ground.first().copied(), ground.last().copied()) {
            let style = SURFACE.stroke_width(px(1.0) as u32);
            let line = PathElement::new(ground.clone(), style);
            ground.extend([(last.0, self.levels[0]), (first.0, self.levels[0])]);
            chart.plotting_area().draw(&Polygon::new(ground, TERRAIN.filled()))?;
            chart.plotting_area().draw(&line)?;
        }
        for number in &self.sections[1..] {
            let ground: Vec<_> = under(self.lines[*number], &self.axis).collect();
            draw_line(
                chart.plotting_area(),
                dashes(*number, self.lines.len()),
                thin(&ground),
                colour(*number).mix(0.5).stroke_width(px(1.0) as u32),
            )?;
        }
        let range = [[self.reach[0], self.levels[0]], [self.reach[1], self.levels[1]]];
        for edge in net::drawn(self.nets.iter().flatten().copied(), range, per_pixel) {
            chart.plotting_area().draw(&PathElement::new(edge, net::style()))?;
        }
        for number in &self.sections {
            let line = self.lines[*number];
            let at = |k: usize| (self.axis.of(line.seen(k)), line.points[k].row.position()[2]);
            let style = colour(*number).stroke_width(px(1.6) as u32);
            draw_line(
                chart.plotting_area(),
                dashes(*number, self.lines.len()),
                thinned((0..line.points.len()).map(at), per_pixel, 0.5),
                style,
            )?;
            for k in line.landings() {
                let at = at(k);
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
        let chart = self.chart(area, &heading, &format!("[{unit}]"), levels, below)?;
        let plot = f64::from(PANEL - ABOVE - below);
        let per_pixel = [self.metres_per_pixel(), levels[1] / plot];
        let width = if self.lines.len() > FEW { 0.8 } else { 1.5 };
        for (number, line) in self.lines.iter().enumerate() {
            let at = |k: usize| Some((self.axis.of(line.seen(k)), value(&line.points[k])?));
            let values = (0..line.points.len()).filter_map(at);
            let curve = thinned(values, per_pixel, spacing(self.lines.len()));
            let style = colour(number).stroke_width(px(width) as u32);
            draw_line(chart.plotting_area(), dashes(number, self.lines.len()), curve, style)?;
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
        let along = "horizontal distance from the start, along the section [m]";
        let titles = [if below == BELOW_LAST { along } else { "" }, unit];
        let axes = Axes { room: [ABOVE, RIGHT, below, LEFT], titles, numbers: [11, 5], grid: true };
        let chart = plot(area, [[self.reach[0], levels[0]], [self.reach[1], levels[1]]], &axes)?;
        area.draw(&Text::new(heading.to_owned(), (px(f64::from(LEFT)), px(7.0)), font(13.0)))?;
        Ok(chart)
    }
}

/// The terrain under a trajectory.
fn under<'l>(line: &'l Line, axis: &'l Axis) -> impl Iterator<Item = (f64, f64)> + 'l {
    (0..line.points.len()).filter_map(|k| Some((axis.of(line.seen(k)), line.points[k].ground?)))
}

/// The same, with the terrain along the axis before and behind it. Where a rock comes back, the terrain is that of its first passing.
fn surface(line: &Line, axis: &Axis, terrain: &HeightMap, [least, most]: [f64; 2]) -> Vec<(f64, f64)> {
    let mut own: Vec<(f64, f64)> = Vec::new();
    for (x, z) in under(line, axis) {
        if own.last().is_none_or(|(last, _)| x > *last) {
            own.push((x, z));
        }
    }
    let (first, last) = (own.first().map_or(most, |p| p.0), own.last().map_or(most, |p| p.0));
    let beyond = |from: f64, to: f64| {
        let far = move |k: i32| from + (to - from) * f64::from(k) / f64::from(BEYOND);
        (0..=BEYOND).map(far).filter_map(|x| {
            let (east, north) = axis.at(x);
            Some((x, (terrain.height)(east, north)?))
        })
    };
    beyond(least, first).chain(own.iter().copied()).chain(beyond(last, most)).collect()
}

/// Three digits.
fn significant(value: f64) -> String {
    let digits = (2 - value.abs().max(1e-9).log10().floor() as i32).clamp(0, 6) as usize;
    format!("{value:.digits$}")
}
