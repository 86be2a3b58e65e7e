//! The plan: shaded terrain, contours with heights, trajectories, scale bar, north arrow.

use super::contours;
use super::net::{self, Net};
use super::page::{
    Area, Chart, Drawn, EDGE, FEW, FINE, HeightMap, INK, LEFT, Line, RIGHT, WIDTH, colour, font, number, px,
    round_step, spacing, thinned,
};
use super::shade::ShadedGrid;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

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
    lowest: [f64; 2],
    highest: [f64; 2],
    /// Of the plot itself [px].
    size: [i32; 2],
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
        let extent = [0, 1].map(|a| (highest[a] - lowest[a]).max(1e-6));
        let scale = (f64::from(WIDTH - LEFT - RIGHT) / extent[0]).min(HIGHEST / extent[1]);
        let size = extent.map(|e| (e * scale).round().max(40.0) as i32);
        let grid = |cells| ShadedGrid::new([lowest, highest], cells, terrain.height);
        Self { net, lowest, highest, size, shading: grid(FINE_CELLS), coarse: grid(CONTOUR_CELLS) }
    }

    /// Room that it takes on the page [px].
    pub fn height(&self) -> i32 {
        self.size[1] + BELOW + ABOVE
    }

    /// Where the plot begins on the page [px]; it stands in the middle.
    fn left(&self) -> i32 {
        LEFT + (WIDTH - LEFT - RIGHT - self.size[0]) / 2
    }

    /// The shading, `top` pixels below the top of the page.
    pub fn image(&self, top: i32) -> String {
        let Ok(href) = self.shading.image() else { return String::new() };
        format!(
            "<image x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" preserveAspectRatio=\"none\" href=\"{href}\"/>\n",
            self.left() * FINE,
            (top + ABOVE) * FINE,
            self.size[0] * FINE,
            self.size[1] * FINE
        )
    }

    fn per_pixel(&self) -> f64 {
        (self.highest[0] - self.lowest[0]) / f64::from(self.size[0])
    }

    /// Draw it.
    pub fn draw(&self, area: &Area, lines: &[&Line]) -> Drawn {
        let right = WIDTH - self.left() - self.size[0];
        let mut chart = ChartBuilder::on(area)
            .margin_top(ABOVE * FINE)
            .margin_right(right * FINE)
            .margin_left((self.left() - LEFT + EDGE) * FINE)
            .x_label_area_size(BELOW * FINE)
            .y_label_area_size((LEFT - EDGE) * FINE)
            .build_cartesian_2d(self.lowest[0]..self.highest[0], self.lowest[1]..self.highest[1])?;
        chart
            .configure_mesh()
            .disable_mesh()
            .axis_style(INK.stroke_width(px(1.0) as u32))
            .label_style(font(12.0))
            .x_labels(7)
            .y_labels((self.size[1] / 70).clamp(2, 9) as usize)
            .x_label_formatter(&number)
            .y_label_formatter(&number)
            .x_desc("x (east) [m]")
            .y_desc("y (north) [m]")
            .axis_desc_style(font(13.0))
            .draw()?;
        self.contours(&mut chart)?;
        let per_pixel = [self.per_pixel(); 2];
        for edge in net::drawn(self.net.plan(), [self.lowest, self.highest], per_pixel) {
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
        self.scale_bar(&plot)?;
        self.north(&plot)
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
        line.first() == line.last() && length < ISLET * self.per_pixel()
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
                let line = thinned(line.iter().copied(), [self.per_pixel(); 2], 1.0);
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
        let pixel = self.per_pixel();
        let decimals = usize::from(step < 1.0);
        let text = format!("{level:.decimals$}");
        let half = [3.6 * text.len() as f64 * pixel, 7.0 * pixel];
        let fits = |(x, y): &(f64, f64)| {
            (0..2).all(|a| {
                let v = [*x, *y][a];
                v - half[a] > self.lowest[a] + 6.0 * pixel && v + half[a] < self.highest[a] - 6.0 * pixel
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

    /// A round length, about a fifth of the width.
    fn scale_bar(&self, plot: &Area) -> Drawn {
        let width = self.highest[0] - self.lowest[0];
        let length = round_step(width / 10.0);
        let long = length / self.per_pixel();
        let (x, y) = (16.0, f64::from(self.size[1]) - 18.0);
        let label = if length >= 1000.0 { format!("{} km", length / 1000.0) } else { format!("{length} m") };
        let corners = [(px(x - 8.0), px(y - 20.0)), (px(x + long + 10.0), px(y + 10.0))];
        plot.draw(&Rectangle::new(corners, WHITE.mix(0.75).filled()))?;
        for (part, filled) in [(0.0, true), (0.5, false)] {
            let corners = [(px(x + part * long), px(y)), (px(x + (part + 0.5) * long), px(y + 5.0))];
            let style = if filled { INK.filled() } else { WHITE.filled() };
            plot.draw(&Rectangle::new(corners, style))?;
            plot.draw(&Rectangle::new(corners, INK.stroke_width(px(0.8) as u32)))?;
        }
        let style = font(11.5).pos(Pos::new(HPos::Center, VPos::Bottom));
        plot.draw(&Text::new(label, (px(x + 0.5 * long), px(y - 3.0)), style))
    }

    /// North is up.
    fn north(&self, plot: &Area) -> Drawn {
        let (x, y) = (f64::from(self.size[0]) - 26.0, 14.0);
        let corners = [(px(x - 14.0), px(y - 8.0)), (px(x + 14.0), px(y + 42.0))];
        plot.draw(&Rectangle::new(corners, WHITE.mix(0.75).filled()))?;
        let tip = [(x, y), (x + 6.5, y + 21.0), (x, y + 16.0), (x - 6.5, y + 21.0)];
        plot.draw(&Polygon::new(tip.map(|(x, y)| (px(x), px(y))).to_vec(), INK.filled()))?;
        plot.draw(&Text::new("N", (px(x), px(y + 31.0)), font(13.0).pos(middle())))
    }
}

fn middle() -> Pos {
    Pos::new(HPos::Center, VPos::Center)
}
