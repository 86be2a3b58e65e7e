//! The structure as it stands at the start: in the plan, and in the sections along trajectories.

use super::page::{Axis, Line};
use super::sheet::{FINE, px};
use dem_contact::interface_mesh::{ContactMesh, Kind};
use nalgebra::Vector3;
use plotters::prelude::*;
use plotters::style::ShapeStyle;
use std::collections::BTreeSet;

/// How far beside a trajectory [m] a line of the net may lie to be drawn in its section.
const BESIDE: f64 = 2.0;
/// Points of a trajectory that are closer in the plan than this [m] are one.
const CLOSE: f64 = 0.25;

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

    /// True if there is nothing to draw.
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

    /// What of it lies near a trajectory: distance along the axis, and elevation.
    pub fn section(&self, line: &Line, axis: &Axis) -> Vec<[(f64, f64); 2]> {
        let mut path: Vec<(f64, f64)> = Vec::new();
        for k in 0..line.points.len() {
            let (x, y) = line.seen(k);
            if path.last().is_none_or(|(a, b)| (x - a).hypot(y - b) > CLOSE) {
                path.push((x, y));
            }
        }
        let is_near = |p: &[f64; 3]| path.iter().any(|(x, y)| (x - p[0]).hypot(y - p[1]) <= BESIDE);
        let near = self.edges.iter().filter(|edge| edge.iter().all(is_near));
        near.map(|edge| edge.map(|p| (axis.of((p[0], p[1])), p[2]))).collect()
    }
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
