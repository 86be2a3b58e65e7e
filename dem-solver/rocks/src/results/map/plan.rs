//! The plan: shaded terrain, contours with heights, trajectories, scale bar, north arrow.

use super::contours::Contours;
use super::net::{self, Net};
use super::page::{FEW, HeightMap, Line, PLOT, WIDTH, colour, dashes, spacing};
use super::shade::ShadedGrid;
use super::sheet::{Area, Chart, Drawn, Frame, LEFT, draw_line, north, px, thinned};
use dem_contact::settings::TerrainSettings;
use plotters::prelude::*;

/// Highest plan [px].
const HIGHEST: f64 = 640.0;
/// Room below the plan for its axis, and above it [px].
const BELOW: i32 = 44;
const ABOVE: i32 = 12;
/// Cells of the shading along the longer side.
const FINE_CELLS: usize = 720;

/// What the plan shows.
pub struct Plan<'a> {
    net: &'a Net,
    frame: Frame,
    shading: ShadedGrid,
    contours: Contours,
    terrain: Option<&'a TerrainSettings>,
}

impl<'a> Plan<'a> {
    /// The part of the terrain around the trajectories and the structure, at one scale along both axes.
    pub fn new(lines: &[&Line], terrain: &HeightMap<'a>, net: &'a Net) -> Self {
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
        let shading = ShadedGrid::new([lowest, highest], FINE_CELLS, terrain.height);
        Self {
            net,
            frame,
            shading,
            contours: Contours::new(&frame, terrain.height),
            terrain: terrain.settings,
        }
    }

    /// Room that it takes on the page [px].
    pub fn height(&self) -> i32 {
        self.frame.size[1] + BELOW + ABOVE
    }

    /// Left edge of the plot on the page [px]; it stands in the middle.
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
        let chart = self.frame.plot(area, [ABOVE, right, BELOW, self.left()])?;
        self.contours.draw(&chart)?;
        self.frame.zones(&chart, self.terrain)?;
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
            draw_line(chart.plotting_area(), dashes(number, lines.len()), path, style)?;
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

    /// True if a structure is in it.
    pub fn has_net(&self) -> bool {
        !self.net.is_empty()
    }

    /// Interval of the contours [m], if there are any.
    pub fn interval(&self) -> Option<f64> {
        self.contours.interval()
    }
}
