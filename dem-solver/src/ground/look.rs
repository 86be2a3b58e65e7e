//! What the terrain is asked: what is near, how high one stands, when one may come down on it.

use super::Ground;
use crate::search::boxes::Bounds;
use crate::wall::closest::on_face;
use nalgebra::Vector3;

/// Share of the reach that a piece of a flight path may measure before it is not cut further.
const FINEST: f64 = 0.125;

/// A flight in closed form.
#[derive(Debug, Clone, Copy)]
pub struct Parabola {
    /// Position at its start, local [m].
    pub position: Vector3<f64>,
    /// Velocity at its start [m/s].
    pub velocity: Vector3<f64>,
    /// Gravity [m/s2].
    pub gravity: Vector3<f64>,
}

impl Parabola {
    /// Position after `time` [s].
    #[inline]
    pub fn at(&self, time: f64) -> Vector3<f64> {
        self.position + (self.velocity + self.gravity * (0.5 * time)) * time
    }

    /// Lowest and highest corner of the box around the piece between two times [s].
    fn piece(&self, from: f64, to: f64) -> (Vector3<f64>, Vector3<f64>) {
        let (a, b) = (self.at(from), self.at(to));
        let (mut lowest, mut highest) = (a.inf(&b), a.sup(&b));
        for axis in 0..3 {
            let apex = -self.velocity[axis] / self.gravity[axis];
            if apex > from && apex < to {
                let turn = self.at(apex)[axis];
                lowest[axis] = lowest[axis].min(turn);
                highest[axis] = highest[axis].max(turn);
            }
        }
        (lowest, highest)
    }
}

impl Ground {
    /// Call `found` with the number of every triangle that comes within `radius` [m] of `centre`, in
    /// ascending order.
    pub fn within(&self, centre: &Vector3<f64>, radius: f64, mut found: impl FnMut(u32)) {
        let query = Bounds::around(&centre.add_scalar(-radius), &centre.add_scalar(radius));
        self.tree.visit(
            |bounds| bounds.meets(&query),
            |t| {
                let [a, b, c] = self.corners(t as u32);
                if on_face(centre, [&a, &b, &c]).to_point.norm_squared() <= radius * radius {
                    found(t as u32);
                }
                true
            },
        );
    }

    /// Whole steps of `h` [s], at most `most`, for which a sphere of `radius` [m] on this flight meets
    /// no triangle for certain.
    ///
    /// The path is taken in pieces; one whose box, widened by the radius, meets a triangle is halved,
    /// one that is free is flown and the next tried twice as long.
    pub fn free_steps(&self, flight: &Parabola, radius: f64, h: f64, most: usize) -> usize {
        let (mut done, mut piece) = (0, most.max(1));
        while done < most {
            piece = piece.min(most - done);
            let (lowest, highest) = flight.piece(h * done as f64, h * (done + piece) as f64);
            if !self.meets_box(&lowest.add_scalar(-radius), &highest.add_scalar(radius)) {
                done += piece;
                piece *= 2;
            } else if piece > 1 && (highest - lowest).max() > FINEST * radius {
                piece /= 2;
            } else {
                break;
            }
        }
        done
    }

    /// True if a triangle comes into the box, or may.
    fn meets_box(&self, lowest: &Vector3<f64>, highest: &Vector3<f64>) -> bool {
        let query = Bounds::around(lowest, highest);
        let (middle, half) = ((lowest + highest) * 0.5, (highest - lowest) * 0.5);
        let mut meets = false;
        self.tree.visit(
            |bounds| bounds.meets(&query),
            |t| {
                let [a, b, c] = self.corners(t as u32);
                let beside = (a.inf(&b).inf(&c) - highest).sup(&(lowest - a.sup(&b).sup(&c))).max() > 0.0;
                let normal = (b - a).cross(&(c - a));
                let off_plane = normal.dot(&(middle - a)).abs() > normal.abs().dot(&half);
                meets = !beside && !off_plane;
                !meets
            },
        );
        meets
    }

    /// Height of `point` above the terrain against `down`, a unit vector along an axis or not: distance
    /// along `down` to the first triangle at or below the point, else (below the surface) to the
    /// nearest above, counted negative; `None` beside the terrain.
    pub fn height(&self, point: &Vector3<f64>, down: &Vector3<f64>) -> Option<f64> {
        let far = (self.highest - self.lowest).norm() + (point - self.lowest).norm();
        let (from, to) = (point - down * far, point + down * far);
        let (mut below, mut above) = (f64::INFINITY, f64::NEG_INFINITY);
        self.tree.visit(
            |bounds| line_meets(bounds, &from, &to),
            |t| {
                if let Some(way) = crossing(&self.corners(t as u32), point, down) {
                    if way >= 0.0 {
                        below = below.min(way);
                    } else {
                        above = above.max(way);
                    }
                }
                true
            },
        );
        if below.is_finite() {
            Some(below)
        } else {
            above.is_finite().then_some(above)
        }
    }
}

/// True if the straight line between the points meets the box, or nearly.
fn line_meets(bounds: &Bounds, from: &Vector3<f64>, to: &Vector3<f64>) -> bool {
    let (middle, half) = bounds.middle_and_half();
    let way = (to - from) * 0.5;
    let off = (from + to) * 0.5 - middle;
    let reach = half.add_scalar(1e-9 * (1.0 + half.max())) + way.abs();
    if (0..3).any(|axis| off[axis].abs() > reach[axis]) {
        return false;
    }
    // Separated along a direction across the line and an axis.
    let across = way.cross(&off).abs();
    let size = way.abs();
    let wide = half.add_scalar(1e-9 * (1.0 + half.max()));
    across.x <= wide.y * size.z + wide.z * size.y
        && across.y <= wide.x * size.z + wide.z * size.x
        && across.z <= wide.x * size.y + wide.y * size.x
}

/// How far along `down` from `point` the line crosses the triangle [m]; its border counts.
fn crossing([a, b, c]: &[Vector3<f64>; 3], point: &Vector3<f64>, down: &Vector3<f64>) -> Option<f64> {
    let (ab, ac) = (b - a, c - a);
    let across = down.cross(&ac);
    let det = ab.dot(&across);
    // Twice the area as seen along `down`; a triangle seen from its edge is crossed nowhere.
    let border = 1e-9 * det.abs();
    if det.abs() <= 1e-12 * ab.norm() * ac.norm() {
        return None;
    }
    let from = point - a;
    let u = from.dot(&across) * det.signum();
    let other = from.cross(&ab);
    let v = down.dot(&other) * det.signum();
    let inside = u >= -border && v >= -border && u + v <= det.abs() + border;
    inside.then(|| ac.dot(&other) / det)
}
