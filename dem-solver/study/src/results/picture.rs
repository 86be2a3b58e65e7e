//! A map to look at: colours over the shaded terrain, releases and lines, scale bar, north, legend.

use crate::base::Base;
use crate::grid::Grid;
use crate::place::ground_at;
use crate::settings::{Place, Release};
use dem_rocks::results::map::page::round_step;
use dem_rocks::results::map::shade::{ShadedGrid, coloured};
use dem_solid::geometry::plan::Point;
use std::io;
use std::path::Path;
use toolkit::coordinates::Form;
use toolkit::files;
use toolkit::numbers::three;

/// Width of the map, and its largest height [px].
const WIDTH: f64 = 900.0;
const HIGHEST: f64 = 900.0;
/// Room for the title, at the left, for the legend at the right, and below [px].
const TOP: f64 = 56.0;
const LEFT: f64 = 16.0;
const RIGHT: f64 = 150.0;
const BELOW: f64 = 64.0;
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
    shading: String,
    size: [f64; 2],
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
        let [west, north] = grid.corner;
        let extent = grid.counts.map(|n| n as f64 * grid.cell);
        let scale = (WIDTH / extent[0]).min(HIGHEST / extent[1]);
        let height = |x: f64, y: f64| ground_at(&base.ground, [x, y]);
        let corners = [[west, north - extent[1]], [west + extent[0], north]];
        let shading = ShadedGrid::new(corners, SHADES, &height).image().unwrap_or_default();
        Self { base, grid, members, shading, size: extent.map(|e| e * scale) }
    }

    /// Pixels per metre.
    fn scale(&self) -> f64 {
        self.size[0] / (self.grid.counts[0] as f64 * self.grid.cell)
    }

    /// Where a place (local) [m] is on the page.
    fn pixel(&self, [x, y]: Point) -> [f64; 2] {
        let scale = self.scale();
        [LEFT + (x - self.grid.corner[0]) * scale, TOP + (self.grid.corner[1] - y) * scale]
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
        let [width, height] = self.size;
        let [wide, high] = [LEFT + width + RIGHT, TOP + height + BELOW];
        let (title, members, cell) = (capital(&title), self.members, three(self.grid.cell));
        let mut text = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{wide:.0}\" height=\"{high:.0}\" viewBox=\"0 0 {wide:.0} {high:.0}\" \
             font-family=\"sans-serif\" font-size=\"13\">\n<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n\
             <text x=\"{LEFT}\" y=\"24\" font-size=\"18\">{title}</text>\n\
             <text x=\"{LEFT}\" y=\"44\" fill=\"#444\">{members} members, cells of {cell} m{notes}</text>\n"
        );
        for (image, smooth) in [(&self.shading, "auto"), (&self.coloured(map, &share)?, "pixelated")] {
            text += &format!(
                "<image x=\"{LEFT}\" y=\"{TOP}\" width=\"{width:.1}\" height=\"{height:.1}\" preserveAspectRatio=\"none\" \
                 style=\"image-rendering:{smooth}\" href=\"{image}\"/>\n"
            );
        }
        self.outlines(&mut text);
        self.furniture(&mut text);
        if most.is_finite() {
            self.legend(&mut text, map.scale, [least, most].map(|end| unit * end));
        }
        text += "</svg>\n";
        Ok(text)
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

    /// Releases and lines.
    fn outlines(&self, text: &mut String) {
        let outline = |shape: &str, pixels: &[Point], colour: &str| {
            let points: Vec<String> = pixels.iter().map(|[x, y]| format!("{x:.1},{y:.1}")).collect();
            let points = points.join(" ");
            format!("<{shape} points=\"{points}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"2\"/>\n")
        };
        for Place { form, corners, .. } in self.base.study.releases.iter().map(Release::place) {
            let pixels: Vec<Point> = corners.iter().map(|p| self.pixel(self.base.local(p))).collect();
            match form {
                Form::Points => pixels.iter().for_each(|[x, y]| {
                    *text += &format!("<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"3\" fill=\"#0050b0\"/>\n");
                }),
                Form::Line => *text += &outline("polyline", &pixels, "#0050b0"),
                Form::Polygon => *text += &outline("polygon", &pixels, "#0050b0"),
            }
        }
        for (line, named) in self.base.lines.iter().zip(&self.base.study.lines) {
            let pixels: Vec<Point> = line.iter().map(|p| self.pixel(*p)).collect();
            let ([x, y], name) = (pixels[0], &named.name);
            *text += &outline("polyline", &pixels, "black");
            *text += &label([x + 4.0, y - 4.0], "", name);
        }
    }

    /// Frame, scale bar, north, coordinates of two corners.
    fn furniture(&self, text: &mut String) {
        let [width, height] = self.size;
        let (origin, [west, north]) = (self.base.ground.origin, self.grid.corner);
        let extent = self.grid.counts.map(|n| n as f64 * self.grid.cell);
        let bar = round_step(0.15 * extent[0]);
        let length = bar * self.scale();
        let base = TOP + height;
        let y = base + 34.0;
        *text += &format!(
            "<rect x=\"{LEFT}\" y=\"{TOP}\" width=\"{width:.1}\" height=\"{height:.1}\" fill=\"none\" stroke=\"black\"/>\n\
             <path d=\"M{LEFT} {y:.1} v6 h{length:.1} v-6\" fill=\"none\" stroke=\"black\" stroke-width=\"1.5\"/>\n"
        );
        *text += &label([LEFT + length + 6.0, base + 42.0], "", &format!("{} m", three(bar)));
        let corner = |x: f64, y: f64| format!("({:.0}, {:.0})", x + origin.x, y + origin.y);
        let grey = " fill=\"#444\" font-size=\"11\"";
        let south_west = corner(west, north - extent[1]);
        *text += &format!("<text x=\"{LEFT}\" y=\"{:.1}\"{grey}>{south_west}</text>\n", base + 14.0);
        let north_east = corner(west + extent[0], north);
        let from_the_right = format!("{grey} text-anchor=\"end\"");
        *text += &label([LEFT + width, TOP - 4.0], &from_the_right, &north_east);
        let (x, y) = (LEFT + width + 40.0, TOP + 16.0);
        *text += &format!("<path d=\"M{x:.1} {y:.1} l8 24 l-8 -6 l-8 6 z\" fill=\"black\"/>\n");
        *text += &label([x, TOP + 12.0], " text-anchor=\"middle\"", "N");
    }

    /// The colours and their values.
    fn legend(&self, text: &mut String, scale: Scale, [least, most]: [f64; 2]) {
        let (x, top, height, steps) = (LEFT + self.size[0] + 24.0, TOP + 70.0, 220.0, 44);
        for k in 0..steps {
            let [r, g, b] = colour((f64::from(k) + 0.5) / f64::from(steps));
            let part = height / f64::from(steps);
            let (y, high) = (top + height - f64::from(k + 1) * part, part + 0.5);
            *text += &format!(
                "<rect x=\"{x:.1}\" y=\"{y:.1}\" width=\"20\" height=\"{high:.1}\" fill=\"rgb({r},{g},{b})\"/>\n"
            );
        }
        for k in 0..=4 {
            let share = f64::from(k) / 4.0;
            let value = match scale {
                Scale::Linear => least + share * (most - least),
                Scale::Log => least * (most / least).powf(share),
            };
            *text += &label([x + 26.0, top + height * (1.0 - share) + 4.0], "", &three(value));
        }
        *text += &label([x, top + height + 30.0], " fill=\"#0050b0\"", "releases");
        if !self.base.lines.is_empty() {
            *text += &label([x, top + height + 48.0], "", "lines");
        }
    }
}

/// Words at a place of the page, with attributes that begin with a blank.
fn label([x, y]: [f64; 2], attributes: &str, words: &str) -> String {
    format!("<text x=\"{x:.1}\" y=\"{y:.1}\"{attributes}>{words}</text>\n")
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
