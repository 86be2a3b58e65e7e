//! The plan: shaded terrain, contours with heights, trajectories, scale bar, north arrow.

use super::contours;
use super::net::{self, Net};
use super::page::{FEW, HeightMap, Line, PLOT, WIDTH, colour, spacing};
use super::shade::ShadedGrid;
use super::sheet::{Area, Chart, Drawn, Frame, LEFT, font, middle, north, px, round_step, thinned};
use plotters::prelude::*;

/// Highest plan [px].
const HIGHEST: f64 = 640.0;
/// Room below the plan for its axis, and above it [px].
const BELOW: i32 = 44;
const ABOVE: i32 = 12;
/// Cells along the longer side: of the shading, and of the contours.
const FINE_CELLS: usize = 720;
const CONTOUR_CELLS: usize = 240;
/// Contours that are drawn, about; each fifth is thick and bears its height.
const CONTOURS: f64 = 35.0;
/// Length of a closed contour below which it is left out [px].
const ISLET: f64 = 90.0;
const BROWN: RGBColor = RGBColor(101, 67, 33);

/// What the plan shows.
pub struct Plan<'a> {
    net: &'a Net,
    frame: Frame,
    shading: ShadedGrid,
    coarse: ShadedGrid,
}

impl<'a> Plan<'a> {
    /// The part of the terrain around the trajectories and the structure, at one scale along both axes.
    pub fn new(lines: &[&Line], terrain: &HeightMap, net: &'a Net) -> Self {
        let of_lines = || lines.iter().flat_map(|l| &l.points).map(|p| p.row.position());
        let places = || of_lines().chain(net.points().copied());
        let [least, most] = terrain.extent;
        let mut lowest = [0, 1].map(|a| places().fold(f64::INFINITY, |l, p| l.min(p[a])));
        let mut highest = [0, 1].map(|a| places().fold(f64::NEG_INFINITY, |h, p| h.max(p[a])));
        let room = 0.12 * (highest[0] - lowest[0]).max(highest[1] - lowest[1]) + 3.0;
        for axis in [0, 1] {
            lowest[axis] = (lowest[axis] - room).max(least[axis]);
            highest[axis] = (highest[axis] + room).min(most[axis]);
        }
        // A trajectory beside the terrain leaves nothing of it: then all of it.
        if (0..2).any(|a| highest[a].partial_cmp(&lowest[a]) != Some(std::cmp::Ordering::Greater)) {
            (lowest, highest) = (least, most);
        }
        let frame = Frame::new([lowest, highest], [PLOT, HIGHEST]);
        let grid = |cells| ShadedGrid::new([lowest, highest], cells, terrain.height);
        Self { net, frame, shading: grid(FINE_CELLS), coarse: grid(CONTOUR_CELLS) }
    }

    /// Room that it takes on the page [px].
    pub fn height(&self) -> i32 {
        self.frame.size[1] + BELOW + ABOVE
    }

    /// Where the plot begins on the page [px]; it stands in the middle.
    fn left(&self) -> i32 {
        LEFT + (PLOT as i32 - self.frame.size[0]) / 2
    }

    /// The shading, `top` pixels below the top of the page.
    pub fn image(&self, top: i32) -> String {
        let corner = [self.left(), top + ABOVE];
        self.shading.image().map_or(String::new(), |href| self.frame.image(corner, "", &href))
    }

    /// Draw it.
    pub fn draw(&self, area: &Area, lines: &[&Line]) -> Drawn {
        let right = WIDTH - self.left() - self.frame.size[0];
        let mut chart = self.frame.plot(area, [ABOVE, right, BELOW, self.left()])?;
        self.contours(&mut chart)?;
        let per_pixel = [self.frame.per_pixel(); 2];
        for edge in net::drawn(self.net.plan(), [self.frame.lowest, self.frame.highest], per_pixel) {
            chart.plotting_area().draw(&PathElement::new(edge, net::style()))?;
        }
        let few = lines.len() <= FEW;
        let stroke = if few { 2.0 } else { 1.0 };
        for (number, line) in lines.iter().enumerate() {
            let path = thinned((0..line.points.len()).map(|k| line.seen(k)), per_pixel, spacing(lines.len()));
            if few {
                let halo = WHITE.mix(0.75).stroke_width(px(2.0 * stroke) as u32);
                chart.plotting_area().draw(&PathElement::new(path.clone(), halo))?;
            }
            let style = colour(number).stroke_width(px(stroke) as u32);
            chart.plotting_area().draw(&PathElement::new(path, style))?;
        }
        for (number, line) in lines.iter().enumerate() {
            self.marks(&chart, line, colour(number), few)?;
        }
        let plot = chart.plotting_area().strip_coord_spec();
        let [width, height] = self.frame.size.map(f64::from);
        self.frame.scale_bar(&plot, [16.0, height - 18.0])?;
        north(&plot, [width - 26.0, 14.0])
    }

    fn marks(&self, chart: &Chart, line: &Line, colour: RGBColor, few: bool) -> Drawn {
        let at = |k: usize| line.seen(k);
        let plot = chart.plotting_area();
        for k in line.landings().filter(|_| few) {
            plot.draw(&Circle::new(at(k), px(2.6), colour.filled()))?;
        }
        plot.draw(&Circle::new(at(0), px(if few { 5.0 } else { 3.0 }), colour.stroke_width(px(1.8) as u32)))?;
        let (size, style) = (px(if few { 4.5 } else { 3.0 }), colour.stroke_width(px(1.8) as u32));
        plot.draw(&Cross::new(at(line.points.len() - 1), size, style))
    }

    /// Lowest and highest level of the terrain that is drawn, and the interval of the contours [m].
    fn levels(&self) -> Option<(f64, f64, f64)> {
        let (low, high) = self.coarse.range().filter(|(low, high)| high > low)?;
        Some((low, high, round_step((high - low) / CONTOURS)))
    }

    /// Whether a structure is in it.
    pub fn has_net(&self) -> bool {
        !self.net.is_empty()
    }

    /// Interval of the contours [m], if there are any.
    pub fn interval(&self) -> Option<f64> {
        let (low, high, step) = self.levels()?;
        ((low / step).ceil() <= (high / step).floor()).then_some(step)
    }

    /// Whether a contour is closed and too short to mean more than the roughness of the terrain.
    fn is_islet(&self, line: &[(f64, f64)]) -> bool {
        let length: f64 = line.windows(2).map(|p| (p[1].0 - p[0].0).hypot(p[1].1 - p[0].1)).sum();
        line.first() == line.last() && length < ISLET * self.frame.per_pixel()
    }

    fn contours(&self, chart: &mut Chart) -> Drawn {
        let Some((low, high, step)) = self.levels() else { return Ok(()) };
        let first = (low / step).ceil() as i64;
        let last = (high / step).floor() as i64;
        let mut taken: Vec<(f64, f64)> = Vec::new();
        for number in first..=last {
            let level = number as f64 * step;
            let thick = number % 5 == 0;
            let (width, opacity) = if thick { (1.5, 0.9) } else { (0.8, 0.7) };
            let style = BROWN.mix(opacity).stroke_width(px(width) as u32);
            let mut found = contours::lines(&self.coarse, level);
            found.retain(|line| !self.is_islet(line));
            for line in &found {
                let line = thinned(line.iter().copied(), [self.frame.per_pixel(); 2], 1.0);
                chart.plotting_area().draw(&PathElement::new(line, style))?;
            }
            if thick && let Some(longest) = found.iter().max_by_key(|line| line.len()) {
                self.contour_label(chart, longest, level, step, &mut taken)?;
            }
        }
        Ok(())
    }

    /// The height at a quarter of the line, where there is room.
    fn contour_label(
        &self,
        chart: &Chart,
        line: &[(f64, f64)],
        level: f64,
        step: f64,
        taken: &mut Vec<(f64, f64)>,
    ) -> Drawn {
        let pixel = self.frame.per_pixel();
        let decimals = usize::from(step < 1.0);
        let text = format!("{level:.decimals$}");
        let half = [3.6 * text.len() as f64 * pixel, 7.0 * pixel];
        let fits = |(x, y): &(f64, f64)| {
            (0..2).all(|a| {
                let v = [*x, *y][a];
                v - half[a] > self.frame.lowest[a] + 6.0 * pixel
                    && v + half[a] < self.frame.highest[a] - 6.0 * pixel
            }) && taken.iter().all(|(a, b)| (x - a).abs() > 3.0 * half[0] || (y - b).abs() > 4.0 * half[1])
        };
        let Some(place) = [4, 3, 2, 5, 8].iter().map(|part| line[line.len() / part]).find(|p| fits(p)) else {
            return Ok(());
        };
        taken.push(place);
        let plot = chart.plotting_area();
        let corner = |sign: f64| (place.0 + sign * half[0], place.1 - sign * half[1]);
        plot.draw(&Rectangle::new([corner(-1.0), corner(1.0)], WHITE.mix(0.6).filled()))?;
        let style = font(10.5).color(&BROWN).pos(middle());
        plot.draw(&Text::new(text, place, style))
    }
}
