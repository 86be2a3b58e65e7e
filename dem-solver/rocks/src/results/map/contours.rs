//! Lines of equal height through the middles of a grid's cells, and how they are drawn on a plan.

use super::shade::ShadedGrid;
use super::sheet::{Chart, Drawn, Frame, font, middle, px, round_step, thinned};
use plotters::prelude::*;
use std::collections::BTreeMap;

/// Cells along the longer side.
const CELLS: usize = 240;
/// Contours that are drawn, about; each fifth is thick and bears its height.
const CONTOURS: f64 = 35.0;
/// Length of a closed contour below which it is left out [px].
const ISLET: f64 = 90.0;
/// Their colour.
pub const BROWN: RGBColor = RGBColor(101, 67, 33);

/// The contours of a part of the terrain.
pub struct Contours {
    frame: Frame,
    grid: ShadedGrid,
}

impl Contours {
    /// Of what a frame shows, by the height of the terrain.
    pub fn new(frame: &Frame, height: &dyn Fn(f64, f64) -> Option<f64>) -> Self {
        Self { frame: *frame, grid: ShadedGrid::new([frame.lowest, frame.highest], CELLS, height) }
    }

    /// Lowest and highest level that is drawn, and the interval of the contours [m].
    fn levels(&self) -> Option<(f64, f64, f64)> {
        let (low, high) = self.grid.range().filter(|(low, high)| high > low)?;
        Some((low, high, round_step((high - low) / CONTOURS)))
    }

    /// Interval of the contours [m], if there are any.
    pub fn interval(&self) -> Option<f64> {
        let (low, high, step) = self.levels()?;
        ((low / step).ceil() <= (high / step).floor()).then_some(step)
    }

    /// True if a contour is closed and too short to mean more than the roughness of the terrain.
    fn is_islet(&self, line: &[(f64, f64)]) -> bool {
        let length: f64 = line.windows(2).map(|p| (p[1].0 - p[0].0).hypot(p[1].1 - p[0].1)).sum();
        line.first() == line.last() && length < ISLET * self.frame.per_pixel()
    }

    /// Draw them, each fifth thick with its height.
    ///
    /// # Errors
    /// What the backend says.
    pub fn draw(&self, chart: &Chart) -> Drawn {
        let Some((low, high, step)) = self.levels() else { return Ok(()) };
        let first = (low / step).ceil() as i64;
        let last = (high / step).floor() as i64;
        let mut taken: Vec<(f64, f64)> = Vec::new();
        for number in first..=last {
            let level = number as f64 * step;
            let thick = number % 5 == 0;
            let (width, opacity) = if thick { (1.5, 0.9) } else { (0.8, 0.7) };
            let style = BROWN.mix(opacity).stroke_width(px(width) as u32);
            let mut found = lines(&self.grid, level);
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

/// An edge between two neighbouring middles: that of the first, and the axis along which the second lies.
type CellEdge = (usize, usize, usize);

/// Polylines at `level` [m], in metres.
pub fn lines(grid: &ShadedGrid, level: f64) -> Vec<Vec<(f64, f64)>> {
    let mut joined = Joined::default();
    for j in 1..grid.counts[1] {
        for i in 1..grid.counts[0] {
            let corners = [(i - 1, j - 1), (i, j - 1), (i, j), (i - 1, j)];
            let four = corners.map(|(i, j)| grid.at(i, j));
            let [Some(a), Some(b), Some(c), Some(d)] = four else { continue };
            let heights = [a, b, c, d];
            let edges = [(i - 1, j - 1, 0), (i, j - 1, 1), (i - 1, j, 0), (i - 1, j - 1, 1)];
            let crossed: Vec<CellEdge> = (0..4)
                .filter(|k| (heights[*k] < level) != (heights[(*k + 1) % 4] < level))
                .map(|k| edges[k])
                .collect();
            for pair in crossed.chunks_exact(2) {
                joined.add(pair[0], pair[1]);
            }
        }
    }
    let point = |(i, j, axis): &CellEdge| {
        let from = grid.at(*i, *j).unwrap_or(level);
        let to = grid.at(i + (1 - axis), j + axis).unwrap_or(level);
        let share = if to == from { 0.5 } else { (level - from) / (to - from) };
        let (dx, dy) = if *axis == 0 { (share, 0.0) } else { (0.0, share) };
        (
            grid.corner[0] + grid.cell * (*i as f64 + 0.5 + dx),
            grid.corner[1] + grid.cell * (*j as f64 + 0.5 + dy),
        )
    };
    joined.chains().iter().map(|chain| chain.iter().map(point).collect()).collect()
}

/// Pieces that share an edge are one line.
#[derive(Default)]
struct Joined {
    neighbours: BTreeMap<CellEdge, [Option<CellEdge>; 2]>,
}

impl Joined {
    fn add(&mut self, a: CellEdge, b: CellEdge) {
        for (from, to) in [(a, b), (b, a)] {
            let both = self.neighbours.entry(from).or_default();
            if both[0].is_none() {
                both[0] = Some(to);
            } else {
                both[1] = Some(to);
            }
        }
    }

    /// Each line once: first those with ends, then closed ones.
    fn chains(mut self) -> Vec<Vec<CellEdge>> {
        let ends: Vec<CellEdge> =
            self.neighbours.iter().filter(|(_, n)| n[1].is_none()).map(|(edge, _)| *edge).collect();
        let mut chains: Vec<Vec<CellEdge>> = ends.into_iter().filter_map(|end| self.take(end)).collect();
        while let Some(start) = self.neighbours.keys().next().copied() {
            let Some(mut ring) = self.take(start) else { break };
            ring.push(start);
            chains.push(ring);
        }
        chains
    }

    /// The line from `start` on, which is removed.
    fn take(&mut self, start: CellEdge) -> Option<Vec<CellEdge>> {
        let mut next = self.neighbours.remove(&start)?;
        let mut chain = vec![start];
        while let Some((edge, beyond)) =
            next.into_iter().flatten().find_map(|edge| Some((edge, self.neighbours.remove(&edge)?)))
        {
            chain.push(edge);
            next = beyond;
        }
        Some(chain)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cone_has_one_closed_line_of_its_radius_and_a_plane_a_straight_one() {
        let cone = |x: f64, y: f64| Some(10.0 - x.hypot(y));
        let grid = ShadedGrid::new([[-8.0, -8.0], [8.0, 8.0]], 160, &cone);
        let found = lines(&grid, 5.0);
        assert_eq!(found.len(), 1);
        assert_eq!(found[0].first(), found[0].last());
        assert!(found[0].iter().all(|(x, y)| (x.hypot(*y) - 5.0).abs() < 1e-3));
        let plane = |x: f64, _: f64| Some(x);
        let found = lines(&ShadedGrid::new([[0.0, 0.0], [10.0, 10.0]], 20, &plane), 3.3);
        assert_eq!((found.len(), found[0].len()), (1, 20));
        assert!(found[0].iter().all(|(x, _)| (x - 3.3).abs() < 1e-12));
    }
}
