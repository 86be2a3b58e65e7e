//! The ground that a structure lies on: a smooth surface through heights on a grid, and how far a point is from it.
//!
//! What nodes do on it is an element, [`crate::element::GroundContact`]; where it comes from is in `model/ground.rs`.
//!
//! The surface is bicubic in each cell of the grid, with a normal that does not jump.
//!
//! It runs through all heights of the grid. Slopes there are differences of the heights beside (one-sided at borders and
//! holes), so that planes are exact, and so are parabolas along the grid. The terrain that rocks touch is of triangles, of
//! which the grid holds samples: between two of them that lie `c` apart the surface leaves a kink of the slope by `s` by `2/27 s c`
//! at most (`|x|` between 0 and `c`: `x (1 - x/c)^2`), 2 cm at a kink of 45 degrees and 0.25 m. On triangles a node would
//! catch at every edge, and an iteration would jump from one to the next.

use crate::read::heights::Heights;
use interface_defs::ipc::run_id::fnv1a;
use nalgebra::{Matrix2, Matrix3, Matrix3x2, Vector2, Vector3};
use std::fmt;

/// Most iterations for a closest point.
const MOST: usize = 30;
/// Change of a closest point, relative to a cell, at which it is found.
const FOUND: f64 = 1e-13;
/// Cells of the grid that are kept around what is asked for.
const RIM: f64 = 2.0;

/// A piece of ground. Coordinates are relative to [`Surface::origin`] in its middle, so that those of a survey lose no digits.
pub struct Surface {
    /// A point of the grid, where its coordinates count from [m].
    pub origin: Vector3<f64>,
    /// Its column and row.
    middle: [usize; 2],
    spacing: [f64; 2],
    /// Columns and rows.
    counts: [usize; 2],
    /// Row by row from the south.
    corners: Vec<Corner>,
    /// For each cell a height that the ground does not exceed in it and the eight around it [m].
    tops: Vec<f64>,
    checksum: u64,
}

/// The point of the surface that is closest to another one.
#[derive(Debug, Clone, Copy)]
pub struct ClosestPoint {
    /// Height of the point above the surface [m]; below it: less than 0.
    pub distance: f64,
    /// Normal of the surface, upwards: the derivative of the distance.
    pub normal: Vector3<f64>,
    /// Second derivative of the distance [1/m].
    pub curvature: Matrix3<f64>,
}

impl Surface {
    /// Of the part of `heights` between `low` and `high` (x, y [m]), with some cells around it.
    pub fn new(heights: &Heights, low: [f64; 2], high: [f64; 2]) -> Self {
        let Heights { counts: [columns, rows], spacing, corner, .. } = *heights;
        let range = |axis: usize, count: usize| {
            let cells = |v: f64| (v - corner[axis]) / spacing[axis];
            let from = (cells(low[axis]).floor() - RIM).clamp(0.0, count as f64 - 2.0) as usize;
            let to = (cells(high[axis]).ceil() + RIM).clamp(from as f64 + 1.0, count as f64 - 1.0) as usize;
            (from, to - from + 1)
        };
        let ((west, columns), (south, rows)) = (range(0, columns), range(1, rows));
        let height = |i: usize, j: usize| heights.height(west + i, south + j);
        let known = (0..rows).flat_map(|j| (0..columns).map(move |i| (i, j))).map(|(i, j)| height(i, j));
        let middle = [columns / 2, rows / 2];
        let from_middle = known.clone().skip(middle[1] * columns + middle[0]);
        let level = from_middle.chain(known.clone()).find(|z| z.is_finite()).unwrap_or(0.0);
        let bytes: Vec<u8> = known.flat_map(f64::to_le_bytes).collect();
        let along = |axis: usize, first: usize| corner[axis] + first as f64 * spacing[axis];
        let mut surface = Self {
            origin: Vector3::new(along(0, west + middle[0]), along(1, south + middle[1]), level),
            middle,
            spacing,
            counts: [columns, rows],
            corners: Vec::with_capacity(columns * rows),
            tops: Vec::new(),
            checksum: fnv1a(&bytes),
        };
        let values: Vec<f64> =
            (0..columns * rows).map(|k| height(k % columns, k / columns) - level).collect();
        let across = differences(&values, surface.counts, 0);
        let up = differences(&values, surface.counts, 1);
        let both = differences(&across, surface.counts, 1);
        surface.corners.extend((0..values.len()).map(|k| [values[k], across[k], up[k], both[k]]));
        surface.bound();
        surface
    }

    /// Distance of the points of the grid, the shorter one [m].
    pub fn cell(&self) -> f64 {
        self.spacing[0].min(self.spacing[1])
    }

    /// Height of the ground below or above `at` [m]; `None` where there is none.
    pub fn height(&self, at: &Vector3<f64>) -> Option<f64> {
        self.shape(at.x, at.y).map(|shape| shape.height)
    }

    /// Whether the ground may come nearer than `reach` [m] to `at`. Cheap, and right where it says no.
    pub fn may_reach(&self, at: &Vector3<f64>, reach: f64) -> bool {
        let Some(([i, j], _)) = self.cell_at(at.x, at.y) else { return false };
        // Within a cell's size the foot lies in this cell or one around it.
        reach > self.cell() || at.z - reach <= self.tops[j * (self.counts[0] - 1) + i]
    }

    /// The closest point of the surface; `None` where there is no ground.
    pub fn foot(&self, at: &Vector3<f64>) -> Option<ClosestPoint> {
        let (mut place, mut shape) = (at.xy(), self.shape(at.x, at.y)?);
        for iteration in 0..MOST {
            let over = at.z - shape.height;
            let ([sx, sy], [xx, xy, yy]) = (shape.slope, shape.bend);
            let away = at.xy() - place;
            // (X - c) . c_a, whose zero is looked for.
            let gradient = away + Vector2::new(sx, sy) * over;
            let metric = Matrix2::new(1.0 + sx * sx, sx * sy, sx * sy, 1.0 + sy * sy);
            let exact = metric - over * Matrix2::new(xx, xy, xy, yy);
            // Below a ridge of a narrower radius the exact matrix has no least distance: that of the tangent plane has.
            let convex =
                iteration > 0 && exact.determinant() > 0.1 * metric.determinant() && exact.trace() > 0.0;
            let matrix = if convex { exact } else { metric };
            let mut step = matrix.try_inverse()? * gradient;
            let length = step.norm();
            if length > 2.0 * self.cell() {
                step *= 2.0 * self.cell() / length;
            }
            place += step;
            shape = self.shape(place.x, place.y)?;
            if length <= FOUND * self.cell() {
                break;
            }
        }
        Some(foot(&(at - Vector3::new(place.x, place.y, shape.height)), &shape))
    }

    /// Cell and the parts of its sides at a point.
    fn cell_at(&self, x: f64, y: f64) -> Option<([usize; 2], [f64; 2])> {
        let one = |v: f64, axis: usize| {
            let (at, middle) = (v / self.spacing[axis], self.middle[axis] as f64);
            let last = (self.counts[axis] - 1) as f64 - middle;
            (at >= -middle && at <= last).then(|| {
                let cell = at.floor().min(last - 1.0);
                ((cell + middle) as usize, at - cell)
            })
        };
        let ((i, u), (j, v)) = (one(x, 0)?, one(y, 1)?);
        Some(([i, j], [u, v]))
    }

    fn corners(&self, [i, j]: [usize; 2]) -> [&Corner; 4] {
        let at = |i: usize, j: usize| &self.corners[j * self.counts[0] + i];
        [at(i, j), at(i + 1, j), at(i, j + 1), at(i + 1, j + 1)]
    }

    fn shape(&self, x: f64, y: f64) -> Option<SurfaceShape> {
        let (cell, at) = self.cell_at(x, y)?;
        let shape = shape(self.corners(cell), at, self.spacing);
        (!shape.height.is_nan()).then_some(shape)
    }

    fn bound(&mut self) {
        let [columns, rows] = self.counts.map(|count| count - 1);
        let own: Vec<f64> =
            (0..columns * rows).map(|k| bound(self.corners([k % columns, k / columns]))).collect();
        let around = |k: usize, count: usize| k.saturating_sub(1)..(k + 2).min(count);
        self.tops = (0..columns * rows)
            .map(|k| {
                let cells = around(k / columns, rows)
                    .flat_map(|j| around(k % columns, columns).map(move |i| j * columns + i));
                // f64::max leaves out what is not a number.
                cells.map(|cell| own[cell]).fold(f64::NEG_INFINITY, f64::max)
            })
            .collect();
    }
}

/// The raster would fill pages.
impl fmt::Debug for Surface {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let Self { origin, spacing, counts, checksum, middle: _, corners: _, tops: _ } = self;
        write!(f, "Surface({origin:?}, {spacing:?}, {counts:?}, {checksum:x})")
    }
}

/// Differences of values on a grid along an axis, per cell: central, one-sided where one neighbour is missing, 0 where
/// both are.
fn differences(values: &[f64], counts: [usize; 2], axis: usize) -> Vec<f64> {
    let stride = if axis == 0 { 1 } else { counts[0] };
    let one = |k: usize| {
        let place = if axis == 0 { k % counts[0] } else { k / counts[0] };
        let before = (place > 0).then(|| values[k - stride]).filter(|v| !v.is_nan());
        let behind = (place + 1 < counts[axis]).then(|| values[k + stride]).filter(|v| !v.is_nan());
        match (before, behind) {
            (Some(before), Some(behind)) => 0.5 * (behind - before),
            (Some(before), None) => values[k] - before,
            (None, Some(behind)) => behind - values[k],
            (None, None) => 0.0,
        }
    };
    (0..values.len()).map(one).collect()
}

/// Distance, normal and curvature where `away` leads from the closest point, with this shape, to the point asked for.
///
/// With `c_a` the tangents, `g_ab = c_a . c_b`, `L_ab = n . c_ab` and `d` the distance, the foot moves by
/// `(g - d L)^-1 (c_a . dX)` and the normal turns by `-c_a (g^-1 L)_ab` times that.
fn foot(away: &Vector3<f64>, shape: &SurfaceShape) -> ClosestPoint {
    let ([sx, sy], [xx, xy, yy]) = (shape.slope, shape.bend);
    let steep = (1.0 + sx * sx + sy * sy).sqrt();
    let normal = Vector3::new(-sx, -sy, 1.0) / steep;
    let distance = away.dot(&normal);
    let tangents = Matrix3x2::new(1.0, 0.0, 0.0, 1.0, sx, sy);
    let metric = tangents.transpose() * tangents;
    let bend = Matrix2::new(xx, xy, xy, yy) / steep;
    let turned = |m: Matrix2<f64>| m.try_inverse().unwrap_or_default();
    let curvature =
        -tangents * turned(metric) * bend * turned(metric - distance * bend) * tangents.transpose();
    ClosestPoint { distance, normal, curvature }
}

/// Height, slopes and second derivatives at a point, per metre.
#[derive(Debug, Clone, Copy, PartialEq)]
struct SurfaceShape {
    /// `h` [m].
    pub height: f64,
    /// `h_x`, `h_y`.
    pub slope: [f64; 2],
    /// `h_xx`, `h_xy`, `h_yy` [1/m].
    pub bend: [f64; 3],
}

/// Height, `h_x`, `h_y` and `h_xy` at a point of the grid, per cell: what is known of the surface there [m].
type Corner = [f64; 4];

/// Value, slope and second derivative of the four cubic polynomials of Hermite at `t` between 0 and 1: those of the value
/// at 0, of the slope at 0, of the value at 1, of the slope at 1.
fn hermite(t: f64) -> [[f64; 4]; 3] {
    let (s, square) = (1.0 - t, t * t);
    [
        [(1.0 + 2.0 * t) * s * s, t * s * s, square * (3.0 - 2.0 * t), -square * s],
        [-6.0 * t * s, s * (1.0 - 3.0 * t), 6.0 * t * s, t * (3.0 * t - 2.0)],
        [12.0 * t - 6.0, 6.0 * t - 4.0, 6.0 - 12.0 * t, 6.0 * t - 2.0],
    ]
}

/// The surface of a cell with these corners (low x and y; high x; high y; both) at the parts `at` of its sides, which are
/// `size` long [m].
fn shape(corners: [&Corner; 4], at: [f64; 2], size: [f64; 2]) -> SurfaceShape {
    let (x, y) = (hermite(at[0]), hermite(at[1]));
    // Derivatives of the order `i` along x and `j` along y.
    let sum = |i: usize, j: usize| {
        let mut sum = 0.0;
        for (k, corner) in corners.iter().enumerate() {
            let (a, b) = (2 * (k % 2), 2 * (k / 2));
            let along = |order: usize| x[i][a + order];
            let (value, slope) = (y[j][b], y[j][b + 1]);
            sum += along(0) * (value * corner[0] + slope * corner[2]);
            sum += along(1) * (value * corner[1] + slope * corner[3]);
        }
        sum
    };
    let [dx, dy] = size;
    SurfaceShape {
        height: sum(0, 0),
        slope: [sum(1, 0) / dx, sum(0, 1) / dy],
        bend: [sum(2, 0) / (dx * dx), sum(1, 1) / (dx * dy), sum(0, 2) / (dy * dy)],
    }
}

/// A height that the cell does not exceed [m]: the highest of its 16 control points (Bezier); NaN where it is no ground.
fn bound(corners: [&Corner; 4]) -> f64 {
    let mut highest = f64::NEG_INFINITY;
    for (k, [height, x, y, xy]) in corners.into_iter().enumerate() {
        if height.is_nan() {
            return f64::NAN;
        }
        let (right, up) = (if k % 2 == 0 { 1.0 } else { -1.0 }, if k / 2 == 0 { 1.0 } else { -1.0 });
        let (x, y, xy) = (right * x / 3.0, up * y / 3.0, right * up * xy / 9.0);
        for control in [*height, height + x, height + y, height + x + y + xy] {
            highest = f64::max(highest, control);
        }
    }
    highest
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grid(cells: usize, cell: f64, height: impl Fn(f64, f64) -> f64) -> Surface {
        let mut text =
            format!("ncols {0}\nnrows {0}\nxllcenter 0\nyllcenter 0\ncellsize {cell}\n", cells + 1);
        for j in (0..=cells).rev() {
            for i in 0..=cells {
                text += &format!("{:?} ", height(i as f64 * cell, j as f64 * cell));
            }
            text += "\n";
        }
        let heights = Heights::parse("g.asc", &text).expect("a grid");
        Surface::new(&heights, [0.0; 2], [cells as f64 * cell; 2])
    }

    fn own(surface: &Surface, at: [f64; 3]) -> Vector3<f64> {
        Vector3::from(at) - surface.origin
    }

    #[test]
    fn a_plane_has_one_normal_and_its_distance_everywhere() {
        let plane = grid(8, 0.5, |x, y| 100.0 + 0.75 * x - 0.4 * y);
        let normal = Vector3::new(-0.75, 0.4, 1.0).normalize();
        for k in 0..9 {
            let (x, y, over) = (0.4 * k as f64 + 0.3, 3.5 - 0.35 * k as f64, 0.1 * (k as f64 - 4.0));
            let on = Vector3::new(x, y, 100.0 + 0.75 * x - 0.4 * y);
            let foot = plane.foot(&own(&plane, (on + over * normal).into())).expect("ground");
            assert!((foot.distance - over).abs() < 1e-13 && (foot.normal - normal).norm() < 1e-13);
            assert!(foot.curvature.norm() < 1e-12);
        }
    }

    #[test]
    fn the_distance_of_a_dome_converges_and_its_derivatives_are_those_of_the_distance() {
        // A sphere of 3 m: distances are known.
        let sphere = |cells: usize| {
            grid(cells, 2.0 / cells as f64, |x, y| (9.0 - (x - 1.0).powi(2) - (y - 1.0).powi(2)).sqrt())
        };
        let points = [[0.61, 0.83, 2.99], [1.37, 1.21, 2.95], [0.9, 1.44, 3.1]];
        let error = |cells: usize| {
            let surface = sphere(cells);
            let off = |p: &[f64; 3]| {
                let exact = (Vector3::from(*p) - Vector3::new(1.0, 1.0, 0.0)).norm() - 3.0;
                (surface.foot(&own(&surface, *p)).expect("ground").distance - exact).abs()
            };
            points.iter().map(off).fold(0.0, f64::max)
        };
        let (coarse, fine) = (error(10), error(20));
        // Slopes by central differences: the surface is of the third order in the cell at least.
        assert!(coarse < 1e-4 && coarse > 6.0 * fine, "{coarse} {fine}");
        let surface = sphere(10);
        for p in points {
            let at = own(&surface, p);
            let foot = surface.foot(&at).expect("ground");
            for c in 0..3 {
                let step = 1e-6 * Vector3::ith(c, 1.0);
                let [plus, minus] = [at + step, at - step].map(|p| surface.foot(&p).expect("ground"));
                let slope = (plus.distance - minus.distance) / 2e-6;
                assert!((slope - foot.normal[c]).abs() < 1e-9, "{slope} {}", foot.normal[c]);
                let turn = (plus.normal - minus.normal) / 2e-6;
                assert!((turn - foot.curvature.column(c)).norm() < 1e-8, "{turn} {}", foot.curvature);
            }
        }
    }

    #[test]
    fn what_is_out_of_reach_is_never_near_and_holes_are_no_ground() {
        let waves = |x: f64, y: f64| 0.3 * (3.0 * x).sin() * (2.0 * y).cos();
        let surface = grid(12, 0.25, |x, y| if x > 2.4 && y > 2.4 { -9999.0 } else { waves(x, y) });
        let (mut near, mut far) = (0, 0);
        for k in 0..400 {
            let (x, y) = (0.0075 * k as f64, 3.0 - 0.0071 * (k * 7 % 400) as f64);
            let at = own(&surface, [x, y, 0.002 * k as f64 - 0.3]);
            let touches = surface.foot(&at).is_some_and(|foot| foot.distance < 0.05);
            assert!(surface.may_reach(&at, 0.05) || !touches);
            if surface.may_reach(&at, 0.05) { near += 1 } else { far += 1 }
        }
        assert!(near > 50 && far > 50, "{near} {far}");
        assert!(surface.foot(&own(&surface, [2.9, 2.9, 0.0])).is_none());
        assert!(surface.foot(&own(&surface, [-0.1, 1.0, 0.0])).is_none());
        assert!(surface.foot(&own(&surface, [1.0, 1.0, 0.0])).is_some());
    }
}

#[cfg(test)]
mod cell_tests {
    use super::*;

    #[test]
    fn a_bicubic_polynomial_is_reproduced_with_its_derivatives_and_bounded() {
        // h = (1 + x - 2 x^2 + 3 x^3)(2 - y + y^2 - y^3 / 2) in a cell of 2 m by 0.5 m.
        let (px, py) = ([1.0, 1.0, -2.0, 3.0], [2.0, -1.0, 1.0, -0.5]);
        let poly = |p: &[f64; 4], t: f64, order: usize| match order {
            0 => p[0] + t * (p[1] + t * (p[2] + t * p[3])),
            1 => p[1] + t * (2.0 * p[2] + t * 3.0 * p[3]),
            _ => 2.0 * p[2] + 6.0 * t * p[3],
        };
        let size = [2.0, 0.5];
        let h = |x: f64, y: f64, i: usize, j: usize| poly(&px, x, i) * poly(&py, y, j);
        let corner = |x: f64, y: f64| {
            let [dx, dy] = size;
            [h(x, y, 0, 0), dx * h(x, y, 1, 0), dy * h(x, y, 0, 1), dx * dy * h(x, y, 1, 1)]
        };
        let corners = [corner(0.0, 0.0), corner(2.0, 0.0), corner(0.0, 0.5), corner(2.0, 0.5)];
        let corners = [&corners[0], &corners[1], &corners[2], &corners[3]];
        let highest = bound(corners);
        for k in 0..=20 {
            let at = [k as f64 / 20.0, (7 * k % 21) as f64 / 20.0];
            let (x, y) = (size[0] * at[0], size[1] * at[1]);
            let is = shape(corners, at, size);
            let exact =
                [h(x, y, 0, 0), h(x, y, 1, 0), h(x, y, 0, 1), h(x, y, 2, 0), h(x, y, 1, 1), h(x, y, 0, 2)];
            let [a, b] = is.slope;
            let [c, d, e] = is.bend;
            for (value, exact) in [is.height, a, b, c, d, e].into_iter().zip(exact) {
                // Heights of some 40 m, divided by the square of half a metre.
                assert!((value - exact).abs() < 1e-11, "{value} {exact}");
            }
            assert!(is.height <= highest);
        }
    }
}
