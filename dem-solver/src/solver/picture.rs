//! `trajectory.svg`: the ways of the rocks over the shaded terrain with its contours, seen from above, and
//! below it their heights over the ground along the way. Drawn from nothing but the rows and the terrain.

use super::Model;
use super::trajectory::Row;
use crate::ground::Ground;
use nalgebra::Vector3;
use std::fmt::Write as _;
use std::io;
use std::path::Path;

pub use interface_defs::toolkit::run_dir::PICTURE;

/// Width of the map, and height of the section [px].
const WIDTH: f64 = 900.0;
const SECTION: f64 = 260.0;
/// Room for text around them [px].
const MARGIN: f64 = 50.0;
/// Cells of the map along its longer side, and shades of grey.
const CELLS: usize = 160;
const SHADES: f64 = 24.0;
/// Contours that are drawn, about.
const CONTOURS: f64 = 20.0;
/// Most points of a way.
const POINTS: usize = 4000;
const COLOURS: [&str; 6] = ["#c1121f", "#0353a4", "#2b7a0b", "#7b2cbf", "#b5651d", "#00798c"];

/// Heights of the terrain at the middles of map cells, local coordinates.
struct Map {
    lowest: Vector3<f64>,
    cell: f64,
    counts: [usize; 2],
    heights: Vec<Option<f64>>,
}

impl Map {
    /// The part of the terrain around the ways.
    fn new(ground: &Ground, ways: &[Vec<Row>], origin: &Vector3<f64>) -> Self {
        let rows = || ways.iter().flatten();
        let place = |row: &Row| Vector3::from(row.position()) - origin;
        let mut lowest = rows().fold(Vector3::repeat(f64::INFINITY), |l, r| l.inf(&place(r)));
        let mut highest = rows().fold(Vector3::repeat(f64::NEG_INFINITY), |h, r| h.sup(&place(r)));
        let room = 0.15 * (highest - lowest).xy().max() + 2.0;
        lowest = lowest.add_scalar(-room).sup(&ground.lowest);
        highest = highest.add_scalar(room).inf(&ground.highest);
        // A way beside the terrain leaves nothing of it: then all of it.
        if (0..2).any(|axis| highest[axis] <= lowest[axis]) {
            (lowest, highest) = (ground.lowest, ground.highest);
        }
        let size = highest - lowest;
        let cell = (size.x.max(size.y) / CELLS as f64).max(f64::MIN_POSITIVE);
        let counts = [size.x, size.y].map(|s| ((s / cell).ceil() as usize).clamp(1, CELLS));
        let top = ground.highest.z + 1.0;
        let height = |i: usize, j: usize| {
            let at =
                Vector3::new(lowest.x + cell * (i as f64 + 0.5), lowest.y + cell * (j as f64 + 0.5), top);
            ground.height(&at, &-Vector3::z()).map(|h| top - h)
        };
        let heights = (0..counts[1])
            .flat_map(|j| (0..counts[0]).map(move |i| (i, j)))
            .map(|(i, j)| height(i, j))
            .collect();
        Self { lowest, cell, counts, heights }
    }

    fn at(&self, i: usize, j: usize) -> Option<f64> {
        if i < self.counts[0] && j < self.counts[1] { self.heights[j * self.counts[0] + i] } else { None }
    }

    fn scale(&self) -> f64 {
        WIDTH / (self.cell * self.counts[0] as f64)
    }

    fn depth(&self) -> f64 {
        self.scale() * self.cell * self.counts[1] as f64
    }

    /// Pixels of a local point.
    fn pixel(&self, x: f64, y: f64) -> [f64; 2] {
        let s = self.scale();
        [MARGIN + s * (x - self.lowest.x), MARGIN + self.depth() - s * (y - self.lowest.y)]
    }

    /// Light from the north-west, runs of equal shade as one rectangle.
    fn shade(&self, svg: &mut String) {
        let light = Vector3::new(-0.5, 0.5, 0.75).normalize();
        let shade = |i: usize, j: usize| {
            let here = self.at(i, j)?;
            let slope = |a: Option<f64>, b: Option<f64>| match (a, b) {
                (Some(a), Some(b)) => (b - a) / (2.0 * self.cell),
                (Some(a), None) => (here - a) / self.cell,
                (None, Some(b)) => (b - here) / self.cell,
                (None, None) => 0.0,
            };
            let before = |k: usize| k.checked_sub(1);
            let normal = Vector3::new(
                -slope(before(i).and_then(|i| self.at(i, j)), self.at(i + 1, j)),
                -slope(before(j).and_then(|j| self.at(i, j)), self.at(i, j + 1)),
                1.0,
            );
            let bright = 0.35 + 0.65 * normal.normalize().dot(&light).max(0.0);
            Some((bright * SHADES).round() as u32)
        };
        let side = self.scale() * self.cell;
        for j in 0..self.counts[1] {
            let mut i = 0;
            while i < self.counts[0] {
                let grey = shade(i, j);
                let run = (i..self.counts[0]).take_while(|k| shade(*k, j) == grey).count();
                if let Some(grey) = grey {
                    let v = (f64::from(grey) / SHADES * 255.0).round() as u8;
                    let (x, y) = (MARGIN + side * i as f64, MARGIN + self.depth() - side * (j + 1) as f64);
                    // A little larger, lest the paper shines through between them.
                    let _ = writeln!(
                        svg,
                        "<rect x=\"{x:.1}\" y=\"{y:.1}\" width=\"{:.1}\" height=\"{:.1}\" fill=\"#{v:02x}{v:02x}{v:02x}\"/>",
                        side * run as f64 + 0.3,
                        side + 0.3
                    );
                }
                i += run;
            }
        }
    }

    /// Contours at whole multiples of a round step; the step [m].
    fn contours(&self, svg: &mut String) -> f64 {
        let known = || self.heights.iter().flatten();
        let (low, high) = (
            known().copied().fold(f64::INFINITY, f64::min),
            known().copied().fold(f64::NEG_INFINITY, f64::max),
        );
        let step = round_step((high - low) / CONTOURS);
        if step.is_nan() || step <= 0.0 {
            return 0.0;
        }
        let mut path = String::new();
        for j in 1..self.counts[1] {
            for i in 1..self.counts[0] {
                let four = [self.at(i - 1, j - 1), self.at(i, j - 1), self.at(i, j), self.at(i - 1, j)];
                let [Some(a), Some(b), Some(c), Some(d)] = four else { continue };
                self.cell_contours([a, b, c, d], [i, j], step, &mut path);
            }
        }
        let _ = writeln!(
            svg,
            "<path d=\"{path}\" fill=\"none\" stroke=\"#5c4326\" stroke-width=\"0.5\" opacity=\"0.7\"/>"
        );
        step
    }

    /// Lines through the cell of four middles, the last of which is that of (i, j).
    fn cell_contours(&self, heights: [f64; 4], [i, j]: [usize; 2], step: f64, path: &mut String) {
        let corner = |k: usize| {
            let [di, dj] = [[0, 0], [1, 0], [1, 1], [0, 1]][k];
            let at = |n: usize, d: usize| (n + d) as f64 - 0.5;
            [self.lowest.x + self.cell * at(i, di), self.lowest.y + self.cell * at(j, dj)]
        };
        let (low, high) = (
            heights.iter().copied().fold(f64::INFINITY, f64::min),
            heights.iter().copied().fold(f64::NEG_INFINITY, f64::max),
        );
        let mut level = (low / step).ceil() * step;
        while level < high {
            let mut ends = Vec::with_capacity(4);
            for k in 0..4 {
                let (from, to) = (heights[k], heights[(k + 1) % 4]);
                if (from < level) != (to < level) {
                    let t = (level - from) / (to - from);
                    let ([x0, y0], [x1, y1]) = (corner(k), corner((k + 1) % 4));
                    ends.push(self.pixel(x0 + t * (x1 - x0), y0 + t * (y1 - y0)));
                }
            }
            for pair in ends.chunks_exact(2) {
                let _ =
                    write!(path, "M{:.1} {:.1}L{:.1} {:.1}", pair[0][0], pair[0][1], pair[1][0], pair[1][1]);
            }
            level += step;
        }
    }
}

/// 1, 2 or 5 times a power of ten, at least `step`.
fn round_step(step: f64) -> f64 {
    let power = 10_f64.powf(step.log10().floor());
    [1.0, 2.0, 5.0, 10.0].into_iter().map(|f| f * power).find(|s| *s >= step).unwrap_or(f64::NAN)
}

/// Draw the ways, rows by rock.
pub fn write(path: &Path, model: &Model, ground: &Ground, ways: &[Vec<Row>]) -> io::Result<()> {
    let map = Map::new(ground, ways, &model.origin);
    let mut body = String::new();
    map.shade(&mut body);
    let step = map.contours(&mut body);
    let top = 2.0 * MARGIN + map.depth();
    let (farthest, highest) = extents(ways);
    let (across, up) = (WIDTH / farthest.max(1e-9), SECTION / highest.max(1e-9));
    for (number, (rock, own)) in model.rocks.iter().zip(ways).enumerate() {
        let colour = COLOURS[number % COLOURS.len()];
        let every = own.len().div_ceil(POINTS).max(1);
        let (mut line, mut heights, mut dots) = (String::new(), String::new(), String::new());
        let mut way = 0.0;
        for (k, row) in own.iter().enumerate() {
            let at = Vector3::from(row.position()) - model.origin;
            if k > 0 {
                way += (at - (Vector3::from(own[k - 1].position()) - model.origin)).xy().norm();
            }
            let lands = k > 0 && row.touches() && !own[k - 1].touches();
            let [x, y] = map.pixel(at.x, at.y);
            if k == 0 {
                let _ = write!(
                    dots,
                    "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"5\" fill=\"none\" stroke=\"{colour}\"/>"
                );
            }
            if lands {
                let _ = write!(dots, "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"2.2\"/>");
            }
            if k % every == 0 || lands || k + 1 == own.len() {
                let letter = if line.is_empty() { 'M' } else { 'L' };
                let _ = write!(line, "{letter}{x:.1} {y:.1}");
                if let Some(height) = row.height() {
                    let letter = if heights.is_empty() { 'M' } else { 'L' };
                    let _ = write!(
                        heights,
                        "{letter}{:.1} {:.1}",
                        MARGIN + across * way,
                        top + SECTION - up * height.max(0.0)
                    );
                }
            }
        }
        let _ = writeln!(
            body,
            "<g stroke=\"{colour}\" fill=\"none\" stroke-width=\"1.5\"><path d=\"{line}\"/><path d=\"{heights}\"/>\
             <g fill=\"{colour}\" stroke=\"none\">{dots}</g></g>\n<text x=\"{:.0}\" y=\"{:.0}\" fill=\"{colour}\">{}</text>",
            MARGIN + 8.0 + 140.0 * number as f64,
            MARGIN - 12.0,
            rock.name
        );
    }
    let base = top + SECTION;
    let _ = writeln!(
        body,
        "<path d=\"M{MARGIN} {top}V{base}H{}\" fill=\"none\" stroke=\"#333\"/>\n<text x=\"{MARGIN}\" y=\"{}\">jump height, \
         0 to {highest:.1} m, over {farthest:.1} m of way seen from above</text>\n<text x=\"{MARGIN}\" y=\"{}\">map {:.1} m wide, \
         its lower left corner at x {:.1}, y {:.1}; contours each {step} m; ring: start, dots: impacts</text>",
        MARGIN + WIDTH,
        base + 20.0,
        MARGIN + map.depth() + 20.0,
        map.cell * map.counts[0] as f64,
        map.lowest.x + model.origin.x,
        map.lowest.y + model.origin.y
    );
    let (width, height) = (WIDTH + 2.0 * MARGIN, base + MARGIN);
    std::fs::write(
        path,
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width:.0} {height:.0}\" font-family=\"sans-serif\" \
             font-size=\"13\">\n<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n{body}</svg>\n"
        ),
    )
}

/// Longest way seen from above, and largest jump height [m].
fn extents(ways: &[Vec<Row>]) -> (f64, f64) {
    let place = |row: &Row| Vector3::from(row.position());
    let length =
        |way: &Vec<Row>| way.windows(2).map(|w| (place(&w[1]) - place(&w[0])).xy().norm()).sum::<f64>();
    let farthest = ways.iter().map(length).fold(0.0, f64::max);
    (farthest, ways.iter().flatten().filter_map(Row::height).fold(0.0, f64::max))
}
