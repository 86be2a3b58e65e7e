//! Points of the surface, as dense as a cover by balls requires.
//!
//! On a face that balls of radius R touch, a ball covers a patch of radius `sqrt(2 R e)` up to the
//! error e; samples lie closer than a share of that, towards edges (where R goes to 0) at last
//! closer than a share of e itself. Triangles are halved at their longest edge until they are as small.

use super::ball::Balls;
use crate::geometry::double_area;
use crate::shape::tree::{SurfaceFeature, SurfaceTree};
use nalgebra::Vector3;
use rustc_hash::FxHashSet;

/// A point of a surface.
#[derive(Debug, Clone, Copy)]
pub struct Sample {
    /// The point [m].
    pub point: Vector3<f64>,
    /// Unit vector into the solid there: against the normal of the face; at edges and corners
    /// against that of all faces there.
    pub inward: Vector3<f64>,
    /// Depth per length along that direction: 1 on a face, less at edges and corners.
    pub slope: f64,
}

/// The sizes of the balls that touch in the middles of parts of the triangles, kept for the next time that they are asked
/// for.
pub struct Sizes<'a> {
    /// The balls.
    pub balls: Balls<'a>,
    /// True if balls beyond thin parts of the solid are left out ([`Balls::careful`]).
    pub careful: bool,
    /// First one for each triangle, then the two halves of a part next to each other.
    parts: Vec<SamplePart>,
}

/// A part of a triangle.
#[derive(Clone, Copy)]
struct SamplePart {
    /// Radii of the ball that touches in its middle ([`Balls::radii`]) [m]; not yet known: no numbers.
    radii: [f64; 2],
    /// Its first half; 0: not yet halved.
    halves: u32,
}

const UNKNOWN: SamplePart = SamplePart { radii: [f64::NAN; 2], halves: 0 };

impl<'a> Sizes<'a> {
    /// Sizes in the solid inside the surface of `tree`.
    pub fn new(tree: &'a SurfaceTree) -> Self {
        let balls = Balls::new(tree, 1e-7 * tree.size).roughly();
        Self { balls, careful: true, parts: vec![UNKNOWN; tree.surface.triangles.len()] }
    }

    fn radius(&mut self, part: u32, at: &Vector3<f64>, inward: &Vector3<f64>, most: f64) -> f64 {
        let part = &mut self.parts[part as usize];
        if part.radii[0].is_nan() {
            part.radii = self.balls.radii(at, inward, most);
        }
        part.radii[usize::from(!self.careful)]
    }

    /// The first half of a part; the second one follows it.
    fn halves(&mut self, part: u32) -> u32 {
        if self.parts[part as usize].halves == 0 {
            self.parts[part as usize].halves = self.parts.len() as u32;
            self.parts.extend([UNKNOWN; 2]);
        }
        self.parts[part as usize].halves
    }
}

/// A piece of a triangle: corners, and for each the edges of the whole triangle on which it lies (bits).
struct SamplePiece {
    corners: [(Vector3<f64>, u8); 3],
    triangle: usize,
    /// Its number in [`Sizes`].
    part: u32,
    /// Radius of the ball that touches in the middle of the piece from which this one was cut [m].
    radius: f64,
}

/// A piece smaller than this share of the ball at the piece from which it was cut has about that ball.
const SAME_BALL: f64 = 0.3;

/// The ball in the middle of a piece is at most so many times that of the piece from which it was cut: else a smaller one
/// does too, and samples are denser than they must be.
const GROWS: f64 = 4.0;

/// Part of its triangle on which a point with these edges lies.
fn feature(edges: u8) -> SurfaceFeature {
    match edges {
        0b001 => SurfaceFeature::Edge(0),
        0b010 => SurfaceFeature::Edge(1),
        0b100 => SurfaceFeature::Edge(2),
        0b101 => SurfaceFeature::Corner(0),
        0b011 => SurfaceFeature::Corner(1),
        0b110 => SurfaceFeature::Corner(2),
        _ => SurfaceFeature::Face,
    }
}

/// Cut every triangle until its longest edge is below `share (sqrt(2 R e) + e / 2)` and call `piece` with each
/// part (corners, their edges, triangle); ends early when it says `false`.
fn cut(
    sizes: &mut Sizes,
    error: f64,
    share: f64,
    mut piece: impl FnMut(&[(Vector3<f64>, u8); 3], usize) -> bool,
) {
    let surface = sizes.balls.tree.surface;
    let mut stack = Vec::new();
    for triangle in 0..surface.triangles.len() {
        let [a, b, c] = surface.corners(triangle);
        let corners = [(a, 0b101), (b, 0b011), (c, 0b110)];
        stack.push(SamplePiece { corners, triangle, part: triangle as u32, radius: 0.0 });
        let inward = -surface.normal(triangle);
        while let Some(part) = stack.pop() {
            let p = part.corners.map(|c| c.0);
            let lengths = [0, 1, 2].map(|k| (p[(k + 1) % 3] - p[k]).norm_squared());
            let k = (0..3).fold(0, |best, k| if lengths[k] > lengths[best] { k } else { best });
            let longest = lengths[k].sqrt();
            let mut radius = part.radius;
            let small = longest <= 0.5 * share * error || {
                if longest > SAME_BALL * radius {
                    let most = if radius > 0.0 { GROWS * radius } else { f64::INFINITY };
                    radius = sizes.radius(part.part, &((p[0] + p[1] + p[2]) / 3.0), &inward, most);
                }
                longest <= share * ((2.0 * radius * error).sqrt() + 0.5 * error)
            };
            if small {
                if !piece(&part.corners, part.triangle) {
                    return;
                }
                continue;
            }
            let ((a, in_a), (b, in_b), apex) =
                (part.corners[k], part.corners[(k + 1) % 3], part.corners[(k + 2) % 3]);
            let middle = ((a + b) / 2.0, in_a & in_b);
            let first = sizes.halves(part.part);
            let half = |part: u32, corners| SamplePiece { corners, triangle, part, radius };
            stack.push(half(first + 1, [middle, (b, in_b), apex]));
            stack.push(half(first, [(a, in_a), middle, apex]));
        }
    }
}

/// What `find` gives for `error` [m], or for the next larger one with which its samples are not too many.
pub fn no_finer<T>(mut error: f64, mut find: impl FnMut(f64) -> Option<T>) -> T {
    loop {
        if let Some(found) = find(error) {
            return found;
        }
        error *= 1.5;
    }
}

/// The corners of all parts, each once; `None` if they are more than `most`.
pub fn corners(sizes: &mut Sizes, error: f64, share: f64, most: usize) -> Option<Vec<Sample>> {
    let tree = sizes.balls.tree;
    let mut samples = Vec::new();
    let mut known: FxHashSet<[u64; 3]> = FxHashSet::default();
    cut(sizes, error, share, |part, triangle| {
        for &(point, edges) in part {
            if known.insert([point.x, point.y, point.z].map(f64::to_bits)) {
                let inward = -tree.normal_at(triangle, feature(edges)).normalize();
                samples.push(Sample { point, inward, slope: -inward.dot(&tree.surface.normal(triangle)) });
            }
        }
        samples.len() <= most
    });
    (samples.len() <= most).then_some(samples)
}

/// The middles of all parts with the area [m2] of each, faces only; `None` if they are more than `most`.
pub fn middles(sizes: &mut Sizes, error: f64, share: f64, most: usize) -> Option<(Vec<Sample>, Vec<f64>)> {
    let surface = sizes.balls.tree.surface;
    let (mut samples, mut areas) = (Vec::new(), Vec::new());
    cut(sizes, error, share, |part, triangle| {
        let corners = part.map(|corner| corner.0);
        let point = (corners[0] + corners[1] + corners[2]) / 3.0;
        samples.push(Sample { point, inward: -surface.normal(triangle), slope: 1.0 });
        areas.push(0.5 * double_area(corners).norm());
        areas.len() <= most
    });
    (areas.len() <= most).then_some((samples, areas))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shape::builtin;

    #[test]
    fn samples_stand_on_the_surface_and_are_denser_at_edges() {
        let surface = builtin::cuboid(Vector3::repeat(1.0));
        let tree = SurfaceTree::new(&surface);
        let mut sizes = Sizes::new(&tree);
        let samples = corners(&mut sizes, 0.01, 0.5, 1_000_000).expect("fewer");
        let (mut at_edges, mut inside) = (0, 0);
        for Sample { point: p, inward, .. } in &samples {
            let on = p.iter().filter(|c| (c.abs() - 0.5).abs() < 1e-15).count();
            assert!(on > 0, "{p}");
            // At an edge the direction halves the angle, at a corner it is the diagonal.
            assert!((inward.dot(p) / (on as f64).sqrt() + 0.5).abs() < 0.5 + 1e-12);
            assert!(tree.signed(&(p + inward * 1e-3)).0 < 0.0);
            let depth = p.iter().map(|c| 0.5 - c.abs()).filter(|d| *d > 1e-12).fold(f64::INFINITY, f64::min);
            at_edges += usize::from(depth < 0.1);
            inside += usize::from(depth >= 0.1);
        }
        // 36 % of the area lies within 0.1 of an edge.
        assert!(at_edges > inside, "{at_edges} {inside}");
        let (_, areas) = middles(&mut sizes, 0.01, 0.5, 1_000_000).expect("fewer");
        assert!((areas.iter().sum::<f64>() - 6.0).abs() < 1e-12);
        assert!(middles(&mut sizes, 0.01, 0.5, 100).is_none());
    }
}
