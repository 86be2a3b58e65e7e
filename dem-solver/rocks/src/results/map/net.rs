//! The structure as it stands at the start: in the plan, and in the sections along trajectories.

use super::page::Line;
use super::sheet::{FINE, px};
use dem_contact::interface_mesh::{ContactMesh, Kind};
use nalgebra::Vector3;
use plotters::prelude::*;
use plotters::style::ShapeStyle;
use std::collections::BTreeSet;

/// How far beside a trajectory [m] a line of the net may lie to be drawn in its section.
const BESIDE: f64 = 2.0;
/// Points of a trajectory that are closer in the plan than this [m] are one.
const CLOSE: f64 = 0.05;

/// Its lines, and the edges of its faces, in the user's coordinates [m].
#[derive(Debug, Clone, Default)]
pub struct Net {
    edges: Vec<[[f64; 3]; 2]>,
}

impl Net {
    /// Of a mesh whose nodes are relative to `origin`; each edge once.
    pub fn of(mesh: &ContactMesh, origin: &Vector3<f64>) -> Self {
        let mut pairs = BTreeSet::new();
        for element in &mesh.elements {
            let own = element.own_nodes();
            let count = if element.kind == Kind::Face { own.len() } else { own.len().saturating_sub(1) };
            for k in 0..count {
                let (a, b) = (own[k], own[(k + 1) % own.len()]);
                pairs.insert((a.min(b), a.max(b)));
            }
        }
        let at = |node: u32| (mesh.nodes[node as usize] + origin).into();
        Self { edges: pairs.into_iter().map(|(a, b)| [at(a), at(b)]).collect() }
    }

    /// Whether there is nothing to draw.
    pub fn is_empty(&self) -> bool {
        self.edges.is_empty()
    }

    /// All ends of its lines.
    pub fn points(&self) -> impl Iterator<Item = &[f64; 3]> {
        self.edges.iter().flatten()
    }

    /// Seen from above.
    pub fn plan(&self) -> impl Iterator<Item = [(f64, f64); 2]> {
        self.edges.iter().map(|edge| edge.map(|p| (p[0], p[1])))
    }

    /// What of it lies near a trajectory: distance along that, and elevation.
    pub fn section(&self, line: &Line) -> Vec<[(f64, f64); 2]> {
        let mut path: Vec<([f64; 2], f64)> = Vec::new();
        for (point, along) in line.points.iter().zip(&line.along) {
            let [x, y, _] = point.row.position();
            let place = [x, y];
            if path.last().is_none_or(|(last, _)| (place[0] - last[0]).hypot(place[1] - last[1]) > CLOSE) {
                path.push((place, *along));
            }
        }
        let at = |p: &[f64; 3]| along(&path, p).map(|x| (x, p[2]));
        let both = |[a, b]: &[[f64; 3]; 2]| Some([at(a)?, at(b)?]);
        self.edges.iter().filter_map(both).collect()
    }
}

/// Distance along a path of places at the point of it that is next to `p` in the plan; `None` where it is far, or before or behind it.
fn along(path: &[([f64; 2], f64)], p: &[f64; 3]) -> Option<f64> {
    let mut best: Option<(f64, usize, f64)> = None;
    for (number, pair) in path.windows(2).enumerate() {
        let (from, to) = (pair[0].0, pair[1].0);
        let edge = [to[0] - from[0], to[1] - from[1]];
        let square = edge[0] * edge[0] + edge[1] * edge[1];
        let share = ((p[0] - from[0]) * edge[0] + (p[1] - from[1]) * edge[1]) / square;
        let held = share.clamp(0.0, 1.0);
        let apart = (from[0] + held * edge[0] - p[0]).hypot(from[1] + held * edge[1] - p[1]);
        if best.is_none_or(|(least, ..)| apart < least) {
            best = Some((apart, number, share));
        }
    }
    let (apart, number, share) = best?;
    let beyond = (number == 0 && share < 0.0) || (number + 2 == path.len() && share > 1.0);
    let [from, to] = [path[number].1, path[number + 1].1];
    (apart <= BESIDE && !beyond).then(|| from + share.clamp(0.0, 1.0) * (to - from))
}

/// Its style in the picture.
pub fn style() -> ShapeStyle {
    RGBColor(0, 60, 66).mix(0.85).stroke_width(px(0.8) as u32)
}

/// These lines without those that look the same at this many metres for a pixel, or are points, and that reach beyond the plot.
pub fn drawn(
    edges: impl Iterator<Item = [(f64, f64); 2]>,
    [lowest, highest]: [[f64; 2]; 2],
    per_pixel: [f64; 2],
) -> Vec<Vec<(f64, f64)>> {
    let mut seen = BTreeSet::new();
    let inside =
        |(x, y): &(f64, f64)| (lowest[0]..=highest[0]).contains(x) && (lowest[1]..=highest[1]).contains(y);
    let cell = |(x, y): (f64, f64)| {
        let fine =
            |v: f64, axis: usize| ((v - lowest[axis]) / per_pixel[axis] * f64::from(FINE)).round() as i64;
        [fine(x, 0), fine(y, 1)]
    };
    let mut new = |edge: &[(f64, f64); 2]| {
        let [a, b] = edge.map(cell);
        edge.iter().all(inside) && a != b && seen.insert((a.min(b), a.max(b)))
    };
    edges.filter(|edge| new(edge)).map(|edge| edge.to_vec()).collect()
}
