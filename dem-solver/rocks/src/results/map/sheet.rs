//! The sheet of all pictures: a page that says of which study or run it is, plots with axes, and a plan in the terrain's coordinates
//! with scale bar, north arrow and zones of other ground.

use dem_contact::settings::TerrainSettings;
use dem_terrain::system;
use plotters::coord::CoordTranslate;
use plotters::coord::types::RangedCoordf64;
use plotters::element::DashedPathElement;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use serde::Deserialize;
use std::io::Error;
use std::path::Path;
use toolkit::scene::Scene;
use toolkit::{files, picture};

/// Drawn in quarters of a pixel: the backend rounds to whole numbers.
pub const FINE: i32 = 4;
/// Room left of the plots, for titles and numbers of the axes [px].
pub const LEFT: i32 = 86;
/// Free edge left of the titles of the axes [px].
pub const EDGE: i32 = 10;
/// Free edge right of the plots [px].
pub const RIGHT: i32 = 22;
/// Colour of text and axes.
pub const INK: RGBColor = RGBColor(40, 40, 40);

/// Colour of zones of other ground.
pub const ZONE: RGBColor = RGBColor(0, 90, 50);

/// What is drawn on.
pub type Area<'a> = DrawingArea<SVGBackend<'a>, plotters::coord::Shift>;
/// A plot with its axes.
pub type Chart<'a, 'b> = ChartContext<'a, SVGBackend<'b>, Cartesian2d<RangedCoordf64, RangedCoordf64>>;
/// True if it could be drawn.
pub type Drawn<T = ()> = Result<T, DrawingAreaErrorKind<Error>>;

/// Pixels of the page in units of the drawing.
pub fn px(pixels: f64) -> i32 {
    (pixels * f64::from(FINE)).round() as i32
}

/// Text of this height [px].
pub fn font<'a>(size: f64) -> TextStyle<'a> {
    ("sans-serif", px(size)).into_font().color(&INK)
}

/// 1, 2 or 5 times a power of ten, at least `step`.
pub fn round_step(step: f64) -> f64 {
    let power = 10_f64.powf(step.log10().floor());
    [1.0, 2.0, 5.0, 10.0].into_iter().map(|f| f * power).find(|s| *s >= step * (1.0 - 1e-9)).unwrap_or(1.0)
}

/// A number at an axis: as many digits as it has.
pub fn number(value: &f64) -> String {
    let text = format!("{value:.4}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".into() } else { text.into() }
}

/// A line that differs from the others of a picture without its colour: solid, dashed, dotted by its number.
///
/// # Errors
/// What the backend says.
pub fn draw_line<C: CoordTranslate>(
    area: &DrawingArea<SVGBackend, C>,
    number: usize,
    points: Vec<C::From>,
    style: ShapeStyle,
) -> Drawn
where
    C::From: Clone + 'static,
{
    let dashes = match number % 3 {
        0 => return area.draw(&PathElement::new(points, style)),
        1 => [9.0, 4.0],
        _ => [2.5, 2.5],
    };
    let [dash, gap] = dashes.map(px);
    area.draw(&DashedPathElement::new(points, dash, gap, style))
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

/// Of which run or study a picture is: the line at its foot.
#[derive(Debug, Clone, Default)]
pub struct Imprint {
    /// Title of the scene or the study.
    pub title: Option<String>,
    /// When it was begun: the day, as the record of the run has it.
    pub date: Option<String>,
    /// EPSG code of the terrain's coordinates.
    pub epsg: Option<u16>,
}

/// What a picture needs of the record of a run or a study.
#[derive(Default, Deserialize)]
struct Record {
    date: Option<String>,
}

impl Imprint {
    /// With the date of the JSON file `record`.
    pub fn new(title: Option<String>, record: &Path, epsg: Option<u16>) -> Self {
        let known: Record = files::read_json(record).unwrap_or_default();
        let date = known.date.and_then(|date| Some(date.split(' ').next()?.to_owned()));
        Self { title, date, epsg }
    }

    /// Code of the coordinate system that the terrain's file of a scene names.
    pub fn system(scene: &Scene, terrain: Option<&TerrainSettings>) -> Option<u16> {
        system::of_file(&scene.resolve(&terrain?.file))
    }

    fn close(&self, svg: &mut String, size: [i32; 2]) {
        let system = self.epsg.map_or("coordinate system not named".into(), |code| format!("EPSG:{code}"));
        picture::close(svg, size, FINE, &[self.title.as_deref(), self.date.as_deref(), Some(&system)]);
    }
}

/// A page of so many pixels as SVG text, with `images` right above its white ground and the imprint below.
///
/// # Errors
/// What the backend says.
pub fn page(
    [width, height]: [i32; 2],
    imprint: &Imprint,
    images: &str,
    draw: impl FnOnce(&Area) -> Drawn,
) -> Result<String, String> {
    let size = [width, height + picture::FOOT];
    let fine = size.map(|length| length * FINE);
    let mut text = String::new();
    {
        let root = SVGBackend::with_string(&mut text, (fine[0] as u32, fine[1] as u32)).into_drawing_area();
        let drawn = root.fill(&WHITE).and_then(|()| draw(&root.split_vertically(height * FINE).0));
        drawn.and_then(|()| root.present()).map_err(|e| e.to_string())?;
    }
    imprint.close(&mut text, fine);
    let head = |[width, height]: [i32; 2]| format!("width=\"{width}\" height=\"{height}\"");
    let mut text = text.replacen(&head(fine), &head(size), 1);
    if let Some(at) = text.find("<rect").and_then(|at| text[at..].find("/>").map(|end| at + end + 2)) {
        text.insert_str(at, &format!("\n{images}"));
    }
    Ok(text)
}

/// Axes of a plot.
#[derive(Debug, Clone, Copy)]
pub struct Axes<'a> {
    /// Room above, right of, below and left of the plot [px].
    pub room: [i32; 4],
    /// What is written at x and at y.
    pub titles: [&'a str; 2],
    /// Numbers at x and at y, about.
    pub numbers: [usize; 2],
    /// True if there are lines at the numbers.
    pub grid: bool,
}

/// A plot from the lowest to the highest x and y, with its axes.
///
/// # Errors
/// What the backend says.
pub fn plot<'b, 'c>(
    area: &'b Area<'c>,
    [lowest, highest]: [[f64; 2]; 2],
    axes: &Axes,
) -> Drawn<Chart<'b, 'c>> {
    let [above, right, below, left] = axes.room;
    let mut chart = ChartBuilder::on(area)
        .margin_top(above * FINE)
        .margin_right(right * FINE)
        .margin_left((left - LEFT + EDGE) * FINE)
        .x_label_area_size(below * FINE)
        .y_label_area_size((LEFT - EDGE) * FINE)
        .build_cartesian_2d(lowest[0]..highest[0], lowest[1]..highest[1])?;
    let mut mesh = chart.configure_mesh();
    if axes.grid {
        mesh.light_line_style(TRANSPARENT).bold_line_style(INK.mix(0.13).stroke_width(px(0.7) as u32));
    } else {
        mesh.disable_mesh();
    }
    mesh.axis_style(INK.stroke_width(px(1.0) as u32))
        .label_style(font(12.0))
        .x_labels(axes.numbers[0])
        .y_labels(axes.numbers[1])
        .x_label_formatter(&number)
        .y_label_formatter(&number)
        .y_desc(axes.titles[1])
        .axis_desc_style(font(13.0));
    if !axes.titles[0].is_empty() {
        mesh.x_desc(axes.titles[0]);
    }
    mesh.draw()?;
    Ok(chart)
}

/// A part of the terrain seen from above, at one scale along both axes.
#[derive(Debug, Clone, Copy)]
pub struct Frame {
    /// Lowest x and y in the terrain's coordinates [m].
    pub lowest: [f64; 2],
    /// Highest x and y [m].
    pub highest: [f64; 2],
    /// Width and height on the page [px].
    pub size: [i32; 2],
}

impl Frame {
    /// From the lowest to the highest x and y, not wider and higher than `most` [px].
    pub fn new([lowest, highest]: [[f64; 2]; 2], most: [f64; 2]) -> Self {
        let extent = [0, 1].map(|a| (highest[a] - lowest[a]).max(1e-6));
        let scale = (most[0] / extent[0]).min(most[1] / extent[1]);
        Self { lowest, highest, size: extent.map(|e| (e * scale).round().max(40.0) as i32) }
    }

    /// Metres of a pixel.
    pub fn per_pixel(&self) -> f64 {
        (self.highest[0] - self.lowest[0]) / f64::from(self.size[0])
    }

    /// An image that fills it, so many pixels right of and below the corner of the page, with attributes that begin with a blank.
    pub fn image(&self, corner: [i32; 2], attributes: &str, href: &str) -> String {
        let [[x, y], [width, height]] = [corner, self.size].map(|pair| pair.map(|length| length * FINE));
        format!(
            "<image x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{height}\" preserveAspectRatio=\"none\"{attributes} \
             href=\"{href}\"/>\n"
        )
    }

    /// Its plot with the terrain's coordinates, and so much room around it as in [`Axes`].
    ///
    /// # Errors
    /// What the backend says.
    pub fn plot<'b, 'c>(&self, area: &'b Area<'c>, room: [i32; 4]) -> Drawn<Chart<'b, 'c>> {
        let numbers = [7, (self.size[1] / 70).clamp(2, 9) as usize];
        let axes = Axes { room, titles: ["x (east) [m]", "y (north) [m]"], numbers, grid: false };
        plot(area, [self.lowest, self.highest], &axes)
    }

    /// What of a straight line lies in it.
    pub fn part(&self, [from, to]: [[f64; 2]; 2]) -> Option<[(f64, f64); 2]> {
        let (mut first, mut last) = (0.0_f64, 1.0_f64);
        for axis in 0..2 {
            let share = |edge: f64| (edge - from[axis]) / (to[axis] - from[axis]);
            let (one, other) = (share(self.lowest[axis]), share(self.highest[axis]));
            (first, last) = (first.max(one.min(other)), last.min(one.max(other)));
        }
        let at = |share: f64, axis: usize| from[axis] + share * (to[axis] - from[axis]);
        (first <= last).then(|| [first, last].map(|share| (at(share, 0), at(share, 1))))
    }

    /// Zones of other ground, dashed, with the names of their materials.
    ///
    /// # Errors
    /// What the backend says.
    pub fn zones(&self, chart: &Chart, terrain: Option<&TerrainSettings>) -> Drawn {
        let plot = chart.plotting_area();
        for zone in terrain.iter().flat_map(|terrain| &terrain.zone) {
            let Some(corners) = &zone.polygon else { continue };
            let ends = corners.iter().zip(corners.iter().cycle().skip(1));
            let parts: Vec<_> = ends.filter_map(|(a, b)| self.part([*a, *b])).collect();
            for part in &parts {
                let style = ZONE.stroke_width(px(1.4) as u32);
                plot.draw(&DashedPathElement::new(part.to_vec(), px(7.0), px(4.0), style))?;
            }
            // At its highest corner that is seen.
            let ends = parts.iter().flatten();
            if let Some(top) = ends.max_by(|a, b| a.1.total_cmp(&b.1)) {
                let style = font(12.0).color(&ZONE);
                plot.draw(
                    &(EmptyElement::at(*top) + Text::new(zone.material.clone(), (px(4.0), px(4.0)), style)),
                )?;
            }
        }
        Ok(())
    }

    /// A round length, about a fifth of the width; its left end on the area [px].
    pub fn scale_bar(&self, area: &Area, [x, y]: [f64; 2]) -> Drawn {
        let width = self.highest[0] - self.lowest[0];
        let length = round_step(width / 10.0);
        let long = length / self.per_pixel();
        let label = if length >= 1000.0 { format!("{} km", length / 1000.0) } else { format!("{length} m") };
        let corners = [(px(x - 8.0), px(y - 20.0)), (px(x + long + 10.0), px(y + 10.0))];
        area.draw(&Rectangle::new(corners, WHITE.mix(0.75).filled()))?;
        for (part, filled) in [(0.0, true), (0.5, false)] {
            let corners = [(px(x + part * long), px(y)), (px(x + (part + 0.5) * long), px(y + 5.0))];
            let style = if filled { INK.filled() } else { WHITE.filled() };
            area.draw(&Rectangle::new(corners, style))?;
            area.draw(&Rectangle::new(corners, INK.stroke_width(px(0.8) as u32)))?;
        }
        let style = font(11.5).pos(Pos::new(HPos::Center, VPos::Bottom));
        area.draw(&Text::new(label, (px(x + 0.5 * long), px(y - 3.0)), style))
    }
}

/// An arrow to the north, which is up; its tip on the area [px].
///
/// # Errors
/// What the backend says.
pub fn north(area: &Area, [x, y]: [f64; 2]) -> Drawn {
    let corners = [(px(x - 14.0), px(y - 8.0)), (px(x + 14.0), px(y + 42.0))];
    area.draw(&Rectangle::new(corners, WHITE.mix(0.75).filled()))?;
    let tip = [(x, y), (x + 6.5, y + 21.0), (x, y + 16.0), (x - 6.5, y + 21.0)];
    area.draw(&Polygon::new(tip.map(|(x, y)| (px(x), px(y))).to_vec(), INK.filled()))?;
    area.draw(&Text::new("N", (px(x), px(y + 31.0)), font(13.0).pos(middle())))
}

/// Text around its place.
pub fn middle() -> Pos {
    Pos::new(HPos::Center, VPos::Center)
}
