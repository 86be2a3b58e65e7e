//! A map to look at: colours over the shaded terrain, releases and lines, legend.

use crate::base::Base;
use crate::grid::Grid;
use crate::settings::{Place, Release};
use dem_rocks::results::map::shade::{ShadedGrid, coloured};
use dem_rocks::results::map::sheet::{Area, Chart, Drawn, FINE, Frame, INK, LEFT, font, north, page, px};
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use std::io;
use std::path::Path;
use toolkit::coordinates::Form;
use toolkit::files;
use toolkit::numbers::three;

/// Largest width and height of the map [px].
const MOST: [f64; 2] = [900.0, 900.0];
/// Room for the title, for the legend at the right, for the axis below, and below that for the scale bar [px].
const TOP: i32 = 56;
const RIGHT: i32 = 150;
const BELOW: i32 = 44;
const FOOT: i32 = 36;
/// Height of the colours in the legend [px], and their steps.
const HEIGHT: f64 = 220.0;
const STEPS: i32 = 44;
/// Where the legend ends [px].
const LEGEND: i32 = 420;
const RELEASES: RGBColor = RGBColor(0, 80, 176);
/// Cells of the shading along the longer side.
const SHADES: usize = 500;
/// Colours from the least to the largest: light to dark, and told apart without hue.
const COLOURS: [[f64; 3]; 5] = [
    [255.0, 245.0, 190.0],
    [254.0, 200.0, 90.0],
    [245.0, 130.0, 50.0],
    [200.0, 40.0, 45.0],
    [90.0, 0.0, 60.0],
];
/// How much of the shading shows through.
const OPAQUE: f64 = 0.85;

/// A raster with what it is.
pub struct Map<'a> {
    /// In words, with its unit.
    pub title: String,
    /// What to know when reading it, for the line below the title.
    pub note: Option<String>,
    /// How its colours are spread.
    pub scale: Scale,
    /// Value of each cell; NaN: nothing was there.
    pub values: &'a [f32],
}

/// How colours are spread over values.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scale {
    /// Evenly.
    Linear,
    /// By their logarithm.
    Log,
}

/// What all maps of a study have in common.
pub struct Sheet<'a> {
    base: &'a Base,
    grid: &'a Grid,
    members: u64,
    frame: Frame,
    shading: String,
}

fn colour(share: f64) -> [u8; 3] {
    let at = share.clamp(0.0, 1.0) * (COLOURS.len() - 1) as f64;
    let below = (at as usize).min(COLOURS.len() - 2);
    [0, 1, 2].map(|k| {
        let [a, b] = [COLOURS[below][k], COLOURS[below + 1][k]];
        (a + (at - below as f64) * (b - a)).round() as u8
    })
}

impl<'a> Sheet<'a> {
    /// Of a study with so many members that were computed.
    pub fn new(base: &'a Base, grid: &'a Grid, members: u64) -> Self {
        let [west, north] = [0, 1].map(|k| grid.corner[k] + base.ground.origin[k]);
        let [width, height] = grid.counts.map(|n| n as f64 * grid.cell);
        let corners = [[west, north - height], [west + width, north]];
        let shading = ShadedGrid::new(corners, SHADES, &|x, y| base.ground.highest_at(x, y)).image();
        Self { base, grid, members, frame: Frame::new(corners, MOST), shading: shading.unwrap_or_default() }
    }

    /// Write the picture of a map.
    pub fn write(&self, path: &Path, map: &Map) -> io::Result<()> {
        files::write(path, self.text(map).map_err(io::Error::other)?.as_bytes())
    }

    fn text(&self, map: &Map) -> Result<String, Box<dyn std::error::Error + Send + Sync>> {
        let known = || map.values.iter().filter(|v| !v.is_nan()).map(|v| f64::from(*v));
        let most = known().fold(f64::NEG_INFINITY, f64::max);
        let least = match map.scale {
            Scale::Linear => 0.0,
            Scale::Log => known().fold(f64::INFINITY, f64::min),
        };
        let share = |v: f64| match map.scale {
            _ if most <= least => 1.0,
            Scale::Linear => (v - least) / (most - least),
            Scale::Log => (v / least).ln() / (most / least).ln(),
        };
        // Energies in kJ, as in all pictures; rasters hold J.
        let (title, unit) = match map.title.strip_suffix("[J]") {
            Some(words) => (format!("{words}[kJ]"), 1e-3),
            None => (map.title.clone(), 1.0),
        };
        let log = (map.scale == Scale::Log).then_some("colours on a logarithmic scale");
        let notes: String = [map.note.as_deref(), log].iter().flatten().map(|n| format!("; {n}")).collect();
        let (title, members, cell) = (capital(&title), self.members, three(self.grid.cell));
        let below_title = format!("{members} members, cells of {cell} m{notes}");
        let image = |style: &str, href: &str| {
            let style = format!(" style=\"image-rendering:{style}\"");
            self.frame.image([LEFT, TOP], &style, href)
        };
        let images = image("auto", &self.shading) + &image("pixelated", &self.coloured(map, &share)?);
        let [width, height] = self.frame.size;
        let (left, bottom) = (f64::from(LEFT), TOP + height + BELOW);
        // A flat map is less high than the legend beside it.
        let high = (bottom + FOOT).max(LEGEND);
        Ok(page([LEFT + width + RIGHT, high], &images, |root| {
            let (above, foot) = root.split_vertically(bottom * FINE);
            above.draw(&Text::new(title, (px(left), px(8.0)), font(18.0)))?;
            above.draw(&Text::new(below_title, (px(left), px(33.0)), font(13.0)))?;
            self.outlines(&self.frame.plot(&above, [TOP, RIGHT, BELOW, LEFT])?)?;
            self.frame.scale_bar(&foot, [left, 18.0])?;
            north(root, [f64::from(LEFT + width + 40), f64::from(TOP + 8)])?;
            let range = [least, most].map(|end| unit * end);
            if most.is_finite() { self.legend(root, map.scale, range) } else { Ok(()) }
        })?)
    }

    /// The cells in colours, as text for `href`.
    fn coloured(&self, map: &Map, share: &dyn Fn(f64) -> f64) -> io::Result<String> {
        let pixel = |v: &f32| {
            let [r, g, b] = colour(share(f64::from(*v)));
            [r, g, b, if v.is_nan() { 0 } else { (255.0 * OPAQUE) as u8 }]
        };
        coloured(self.grid.counts, &map.values.iter().flat_map(pixel).collect::<Vec<u8>>())
            .map_err(io::Error::other)
    }

    /// Edge of the map, releases and lines.
    fn outlines(&self, chart: &Chart) -> Drawn {
        let (plot, Frame { lowest, highest, .. }) = (chart.plotting_area(), self.frame);
        let corners = [lowest, highest].map(<(f64, f64)>::from);
        plot.draw(&Rectangle::new(corners, INK.stroke_width(px(1.0) as u32)))?;
        let wide = px(2.0) as u32;
        for Place { form, corners, .. } in self.base.study.releases.iter().map(Release::place) {
            let mut places: Vec<(f64, f64)> = corners.iter().map(|corner| (*corner).into()).collect();
            if form == Form::Points {
                let dot = |place| plot.draw(&Circle::new(place, px(3.0), RELEASES.filled()));
                places.into_iter().try_for_each(dot)?;
                continue;
            }
            if form == Form::Polygon {
                places.extend_from_within(..1);
            }
            plot.draw(&PathElement::new(places, RELEASES.stroke_width(wide)))?;
        }
        for line in &self.base.study.lines {
            let pairs = line.points.windows(2).filter_map(|pair| self.frame.part([pair[0], pair[1]]));
            let parts: Vec<_> = pairs.collect();
            for part in &parts {
                plot.draw(&PathElement::new(part.to_vec(), BLACK.stroke_width(wide)))?;
            }
            let style = font(13.0).pos(Pos::new(HPos::Left, VPos::Bottom));
            let name = Text::new(line.name.clone(), (px(4.0), px(-4.0)), style);
            if let Some([start, _]) = parts.first() {
                plot.draw(&(EmptyElement::at(*start) + name))?;
            }
        }
        Ok(())
    }

    /// The colours and their values.
    fn legend(&self, area: &Area, scale: Scale, [least, most]: [f64; 2]) -> Drawn {
        let (x, bottom) = (f64::from(LEFT + self.frame.size[0] + 24), f64::from(TOP) + 70.0 + HEIGHT);
        let at = |share: f64| px(bottom - HEIGHT * share);
        for k in 0..STEPS {
            let [from, to] = [k, k + 1].map(|k| f64::from(k) / f64::from(STEPS));
            let [r, g, b] = colour(0.5 * (from + to));
            let corners = [(px(x), at(to)), (px(x + 20.0), at(from))];
            area.draw(&Rectangle::new(corners, RGBColor(r, g, b).filled()))?;
        }
        let style = font(13.0).pos(Pos::new(HPos::Left, VPos::Center));
        for share in [0.0, 0.25, 0.5, 0.75, 1.0] {
            let value = match scale {
                Scale::Linear => least + share * (most - least),
                Scale::Log => least * (most / least).powf(share),
            };
            area.draw(&Text::new(three(value), (px(x + 26.0), at(share)), style.clone()))?;
        }
        area.draw(&Text::new("releases", (px(x), px(bottom + 26.0)), style.color(&RELEASES)))?;
        if !self.base.lines.is_empty() {
            area.draw(&Text::new("lines", (px(x), px(bottom + 44.0)), style.color(&BLACK)))?;
        }
        Ok(())
    }
}

/// With a capital at its beginning.
fn capital(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or(String::new(), |first| first.to_uppercase().chain(letters).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_go_from_the_first_to_the_last_and_numbers_have_three_digits() {
        assert_eq!(colour(0.0), [255, 245, 190]);
        assert_eq!(colour(1.0), [90, 0, 60]);
        assert_eq!(colour(0.125), [255, 223, 140]);
        assert_eq!([0.0, 12.34, 0.5, 1234.0, 2.5e7].map(three), ["0", "12.3", "0.5", "1230", "2.5e7"]);
    }
}
