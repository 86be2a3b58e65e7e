//! A map to look at: colours over the shaded terrain, releases and lines, legend.

use crate::base::Base;
use crate::grid::Grid;
use crate::settings::{Place, Release};
use dem_rocks::results::map::contours::{BROWN, Contours};
use dem_rocks::results::map::shade::{ShadedGrid, coloured};
use dem_rocks::results::map::sheet::{
    Area, Chart, Drawn, FINE, Frame, INK, Imprint, LEFT, ZONE, draw_line, font, north, number, page, px,
    round_step,
};
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use std::io;
use std::ops::Range;
use std::path::Path;
use toolkit::coordinates::Form;
use toolkit::files;
use toolkit::numbers::three;

/// Largest width and height of the map [px].
const MAX_SIZE: [f64; 2] = [900.0, 900.0];
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
/// Part of the map around the paths that is shown beside them, and at least so many cells.
const ROOM: f64 = 0.06;
const CELLS: usize = 3;
/// Numbers beside the colours, at most.
const NUMBERS: usize = 8;
/// Colours from the least to the largest: light to dark, and told apart without hue.
pub const COLOURS: [[f64; 3]; 5] = [
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
    pub scale: ColourScale,
    /// Value of each cell; NaN: nothing was there.
    pub values: &'a [f32],
}

impl<'a> Map<'a> {
    /// One that needs no note.
    pub fn new(title: &str, scale: ColourScale, values: &'a [f32]) -> Self {
        Self { title: title.into(), note: None, scale, values }
    }
}

/// How colours are spread over values.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ColourScale {
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
    imprint: &'a Imprint,
    /// Columns and rows that are shown: those around paths, releases and lines.
    shown: [Range<usize>; 2],
    frame: Frame,
    shading: String,
    contours: Contours,
}

/// Values of the first and the last colour; infinite where there is no value.
pub fn extremes(scale: ColourScale, values: &[f32]) -> [f64; 2] {
    let known = || values.iter().filter(|v| !v.is_nan()).map(|v| f64::from(*v));
    let most = known().fold(f64::NEG_INFINITY, f64::max);
    match scale {
        ColourScale::Linear => [0.0, most],
        ColourScale::Log => [known().fold(f64::INFINITY, f64::min), most],
    }
}

/// The colour at a share, 0 to 1, of the way from the first to the last.
pub fn colour(share: f64) -> [u8; 3] {
    let at = share.clamp(0.0, 1.0) * (COLOURS.len() - 1) as f64;
    let below = (at as usize).min(COLOURS.len() - 2);
    [0, 1, 2].map(|k| {
        let [a, b] = [COLOURS[below][k], COLOURS[below + 1][k]];
        (a + (at - below as f64) * (b - a)).round() as u8
    })
}

impl<'a> Sheet<'a> {
    /// Of a study with so many members that were computed; `passed` says of each cell whether a rock was there.
    pub fn new(
        base: &'a Base,
        grid: &'a Grid,
        members: u64,
        imprint: &'a Imprint,
        passed: impl Fn(usize) -> bool,
    ) -> Self {
        let releases = base.study.releases.iter().flat_map(|release| release.place().corners);
        let places = releases.chain(base.study.lines.iter().flat_map(|line| line.points.iter()));
        let named = places.filter_map(|place| grid.at(base.local(place))).map(|cell| cell as usize);
        let cells: Vec<usize> = (0..grid.cells()).filter(|cell| passed(*cell)).chain(named).collect();
        let shown = [0, 1].map(|axis| {
            let at = |cell: &usize| [cell % grid.counts[0], cell / grid.counts[0]][axis];
            let (least, most) = (cells.iter().map(at).min(), cells.iter().map(at).max());
            let (least, most) = (least.unwrap_or(0), most.unwrap_or(grid.counts[axis] - 1));
            let room = CELLS.max((ROOM * (most - least) as f64) as usize);
            least.saturating_sub(room)..(most + 1 + room).min(grid.counts[axis])
        });
        let at = |column: usize, row: usize| {
            let far = [column as f64, -(row as f64)].map(|cells| cells * grid.cell);
            [0, 1].map(|k| grid.corner[k] + base.ground.origin[k] + far[k])
        };
        let ([west, south], [east, north]) =
            (at(shown[0].start, shown[1].end), at(shown[0].end, shown[1].start));
        let corners = [[west, south], [east, north]];
        let height = |x: f64, y: f64| base.ground.highest_at(x, y);
        let shading = ShadedGrid::new(corners, SHADES, &height).image().unwrap_or_default();
        let frame = Frame::new(corners, MAX_SIZE);
        let contours = Contours::new(&frame, &height);
        Self { base, grid, members, imprint, shown, frame, shading, contours }
    }

    /// Write the picture of a map.
    pub fn write(&self, path: &Path, map: &Map) -> io::Result<()> {
        files::write(path, self.text(map).map_err(io::Error::other)?.as_bytes())
    }

    fn text(&self, map: &Map) -> Result<String, Box<dyn std::error::Error + Send + Sync>> {
        let [least, most] = extremes(map.scale, map.values);
        let share = |v: f64| share(map.scale, [least, most], v);
        // Energies in kJ, as in all pictures; rasters hold J.
        let (title, unit) = match map.title.strip_suffix("[J]") {
            Some(words) => (format!("{words}[kJ]"), 1e-3),
            None => (map.title.clone(), 1.0),
        };
        let log = (map.scale == ColourScale::Log).then_some("colours on a logarithmic scale");
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
        Ok(page([LEFT + width + RIGHT, high], self.imprint, &images, |root| {
            let (above, foot) = root.split_vertically(bottom * FINE);
            above.draw(&Text::new(title, (px(left), px(8.0)), font(18.0)))?;
            above.draw(&Text::new(below_title, (px(left), px(33.0)), font(13.0)))?;
            self.outlines(&self.frame.plot(&above, [TOP, RIGHT, BELOW, LEFT])?)?;
            self.frame.scale_bar(&foot, [left, 18.0])?;
            north(root, [f64::from(LEFT + width + 40), f64::from(TOP + 8)])?;
            let range = [least, most].map(|end| unit * end);
            if most.is_finite() {
                self.legend(root, map.scale, range)?
            }
            self.signs(root)
        })?)
    }

    /// The cells in colours, as text for `href`.
    fn coloured(&self, map: &Map, share: &dyn Fn(f64) -> f64) -> io::Result<String> {
        let pixel = |v: &f32| {
            let [r, g, b] = colour(share(f64::from(*v)));
            [r, g, b, if v.is_nan() { 0 } else { (255.0 * OPAQUE) as u8 }]
        };
        let [columns, rows] = &self.shown;
        let own = rows.clone().flat_map(|row| columns.clone().map(move |column| (row, column)));
        let values = own.map(|(row, column)| &map.values[row * self.grid.counts[0] + column]);
        coloured([columns.len(), rows.len()], &values.flat_map(pixel).collect::<Vec<u8>>())
            .map_err(io::Error::other)
    }

    /// Edge of the map, contours, zones, releases and lines.
    fn outlines(&self, chart: &Chart) -> Drawn {
        let (plot, Frame { lowest, highest, .. }) = (chart.plotting_area(), self.frame);
        let corners = [lowest, highest].map(<(f64, f64)>::from);
        self.contours.draw(chart)?;
        self.frame.zones(chart, self.base.settings.terrain.as_ref())?;
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
            let corner = (px(8.0 + 6.5 * line.name.chars().count() as f64), px(-2.0));
            let ground = Rectangle::new([(px(2.0), px(-19.0)), corner], WHITE.mix(0.6).filled());
            if let Some([start, _]) = parts.first() {
                plot.draw(&(EmptyElement::at(*start) + ground + name))?;
            }
        }
        Ok(())
    }

    /// The colours and their values.
    fn legend(&self, area: &Area, scale: ColourScale, [least, most]: [f64; 2]) -> Drawn {
        let (x, bottom) = (f64::from(LEFT + self.frame.size[0] + 24), f64::from(TOP) + 70.0 + HEIGHT);
        let at = |share: f64| px(bottom - HEIGHT * share);
        for k in 0..STEPS {
            let [from, to] = [k, k + 1].map(|k| f64::from(k) / f64::from(STEPS));
            let [r, g, b] = colour(0.5 * (from + to));
            let corners = [(px(x), at(to)), (px(x + 20.0), at(from))];
            area.draw(&Rectangle::new(corners, RGBColor(r, g, b).filled()))?;
        }
        let style = font(13.0).pos(Pos::new(HPos::Left, VPos::Center));
        let largest = format!("largest {}", three(most));
        area.draw(&Text::new(largest, (px(x), at(1.0) - px(12.0)), style.clone()))?;
        for value in numbers(scale, [least, most]) {
            let share = share(scale, [least, most], value);
            area.draw(&PathElement::new(vec![(px(x + 20.0), at(share)), (px(x + 24.0), at(share))], INK))?;
            area.draw(&Text::new(three(value), (px(x + 28.0), at(share)), style.clone()))?;
        }
        Ok(())
    }

    /// What lines of the map mean.
    fn signs(&self, area: &Area) -> Drawn {
        let (x, mut y) = (f64::from(LEFT + self.frame.size[0] + 24), f64::from(TOP) + HEIGHT + 92.0);
        let style = font(12.0).pos(Pos::new(HPos::Left, VPos::Center));
        let has_zones = self
            .base
            .settings
            .terrain
            .iter()
            .flat_map(|terrain| &terrain.zone)
            .any(|zone| zone.polygon.is_some());
        let interval = self.contours.interval().map(|step| format!("contours, {} m", number(&step)));
        let signs = [
            (Some("releases".into()), RELEASES, 0, 2.0),
            ((!self.base.lines.is_empty()).then(|| "lines".into()), BLACK, 0, 2.0),
            (has_zones.then(|| "other ground".into()), ZONE, 1, 1.4),
            (interval, BROWN, 0, 0.8),
        ];
        for (text, colour, dashes, width) in signs {
            let Some(text) = text else { continue };
            let ends = vec![(px(x), px(y)), (px(x + 20.0), px(y))];
            draw_line(area, dashes, ends, colour.stroke_width(px(width) as u32))?;
            area.draw(&Text::new(text, (px(x + 26.0), px(y)), style.clone()))?;
            y += 18.0;
        }
        Ok(())
    }
}

/// Where a value lies between the least and the largest: 0 to 1.
fn share(scale: ColourScale, [least, most]: [f64; 2], value: f64) -> f64 {
    match scale {
        _ if most <= least => 1.0,
        ColourScale::Linear => (value - least) / (most - least),
        ColourScale::Log => (value / least).ln() / (most / least).ln(),
    }
}

/// Round numbers from the least to the largest value: 1, 2 or 5 times powers of ten, or multiples of such a step.
fn numbers(scale: ColourScale, [least, most]: [f64; 2]) -> Vec<f64> {
    let all: Vec<f64> = match scale {
        ColourScale::Log => {
            let powers = || (least.log10().floor() as i32)..=(most.log10().ceil() as i32);
            let of = |factors: &[f64]| -> Vec<f64> {
                let all = powers().flat_map(|power| factors.iter().map(move |f| f * 10_f64.powi(power)));
                let all = all.filter(|v| (least * (1.0 - 1e-6)..=most * (1.0 + 1e-6)).contains(v));
                // The least has its number where there is room.
                std::iter::once(least)
                    .filter(|_| all.clone().all(|v| v > 1.2 * least))
                    .chain(all.clone())
                    .collect()
            };
            let fine = of(&[1.0, 2.0, 5.0]);
            if fine.len() > NUMBERS { of(&[1.0]) } else { fine }
        }
        ColourScale::Linear if most > least => {
            let step = round_step((most - least) / 5.0);
            let [first, last] = [(least / step).ceil() as i64, (most / step).floor() as i64];
            (first..=last).map(|k| k as f64 * step).collect()
        }
        ColourScale::Linear => Vec::new(),
    };
    if all.is_empty() { vec![most] } else { all }
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
    fn numbers_beside_the_colours_are_round() {
        assert_eq!(numbers(ColourScale::Linear, [0.0, 2328.0]), [0.0, 500.0, 1000.0, 1500.0, 2000.0]);
        assert_eq!(numbers(ColourScale::Log, [1.0, 47.0]), [1.0, 2.0, 5.0, 10.0, 20.0]);
        assert_eq!(numbers(ColourScale::Log, [3.0, 3.0]), [3.0]);
        assert_eq!(numbers(ColourScale::Log, [1.0, 2e4]), [1.0, 10.0, 100.0, 1000.0, 1e4]);
    }

    #[test]
    fn colours_go_from_the_first_to_the_last_and_numbers_have_three_digits() {
        assert_eq!(colour(0.0), [255, 245, 190]);
        assert_eq!(colour(1.0), [90, 0, 60]);
        assert_eq!(colour(0.125), [255, 223, 140]);
        assert_eq!([0.0, 12.34, 0.5, 1234.0, 2.5e7].map(three), ["0", "12.3", "0.5", "1230", "2.5e7"]);
    }
}
