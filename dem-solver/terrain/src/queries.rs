//! What the terrain is asked: what is near, how high one stands, when one may come down on it.

use super::Terrain;
use dem_solid::geometry::box_tree::Bounds;
use dem_solid::geometry::closest::on_face;
use nalgebra::Vector3;

/// Length of the pieces in which a flight is tested, in radii of what flies.
const PIECE: f64 = 3.0;
/// Another piece follows if at least one in so many of its steps were free.
const FEWEST: usize = 8;

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
    pub(super) fn piece(&self, from: f64, to: f64) -> (Vector3<f64>, Vector3<f64>) {
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

impl Terrain {
    /// Call `found` with the number of every triangle that comes within `radius` [m] of `centre`, and of some
    /// others, in ascending order.
    pub fn about(&self, centre: &Vector3<f64>, radius: f64, mut found: impl FnMut(u32)) {
        self.tree.visit(
            |bounds| bounds.square_to(centre) <= radius * radius,
            |t| {
                found(t as u32);
                true
            },
        );
    }

    /// True if some triangle comes within `radius` [m] of `point`.
    pub fn is_near(&self, point: &Vector3<f64>, radius: f64) -> bool {
        let near = std::cell::Cell::new(false);
        self.tree.visit(
            |bounds| !near.get() && bounds.square_to(point) <= radius * radius,
            |t| {
                let [a, b, c] = self.corners(t as u32);
                near.set(on_face(point, [&a, &b, &c]).to_point.norm_squared() <= radius * radius);
                !near.get()
            },
        );
        near.get()
    }

    /// Whole steps of `h` [s], at most `most`, for which a sphere of `radius` [m] on this flight touches
    /// no triangle for certain.
    ///
    /// A triangle is convex: the sphere cannot touch it before it has reached the triangle's own plane, nor before
    /// it has reached the one through its closest point. The shortest such time is flown, and the test repeated from
    /// there while it is worth it.
    pub fn free_steps(&self, flight: &Parabola, radius: f64, h: f64, most: usize) -> usize {
        let mut done = 0;
        while done < most {
            let from = h * done as f64;
            let (position, velocity) = (flight.at(from), flight.velocity + flight.gravity * from);
            let (speed, bow) = (velocity.norm(), flight.gravity.norm());
            // No further ahead than is worth it: boxes around long flights are wide.
            let left = most - done;
            let piece = ((arrival(PIECE * radius, speed, bow) / h) as usize).clamp(1, left);
            let whole = h * piece as f64;
            let (lowest, highest) = flight.piece(from, from + whole);
            let query = Bounds::around(&lowest.add_scalar(-radius), &highest.add_scalar(radius));
            let least = std::cell::Cell::new(whole);
            let until = |distance: f64, normal: &Vector3<f64>| {
                arrival(distance - radius, velocity.dot(normal), flight.gravity.dot(normal).max(0.0))
            };
            self.tree.visit(
                |bounds| {
                    bounds.meets(&query) && {
                        let gap = bounds.square_to(&position).sqrt() - radius;
                        gap <= 0.0 || arrival(gap, speed, bow) < least.get()
                    }
                },
                |t| {
                    let corners = self.corners(t as u32);
                    let [a, b, c] = &corners;
                    let upright = (b - a).cross(&(c - a));
                    let (off, size) = (upright.dot(&(a - position)), upright.norm());
                    let plane = off.abs() / size;
                    let plane =
                        if plane > radius { until(plane, &(upright * (off.signum() / size))) } else { 0.0 };
                    if plane >= least.get() {
                        return true;
                    }
                    let to_point = on_face(&position, [a, b, c]).to_point;
                    let distance = to_point.norm();
                    if distance <= radius {
                        least.set(0.0);
                        return false;
                    }
                    let closest = until(distance, &(to_point / distance));
                    least.set(least.get().min(closest.max(plane)));
                    true
                },
            );
            let least = least.get();
            if least >= whole {
                done += piece;
                continue;
            }
            let steps = (least / h) as usize;
            done += steps;
            if FEWEST * steps < piece {
                break;
            }
        }
        done
    }

    /// Height of `point` above the terrain against `down`, a unit vector along an axis or not: distance
    /// along `down` to the first triangle at or below the point, else (below the surface) to the
    /// nearest above, counted negative; `None` beside the terrain.
    #[inline]
    pub fn height(&self, point: &Vector3<f64>, down: &Vector3<f64>) -> Option<f64> {
        self.below(point, down).map(|(height, _)| height)
    }

    /// Height of the highest surface at x and y, all relative to the origin [m]; `None` where there is none.
    pub fn ground_at(&self, [x, y]: [f64; 2]) -> Option<f64> {
        let top = self.highest.z + 1.0;
        Some(top - self.height(&Vector3::new(x, y, top), &-Vector3::z())?)
    }

    /// The same with all in the user's coordinates [m].
    pub fn highest_at(&self, x: f64, y: f64) -> Option<f64> {
        Some(self.ground_at([x - self.origin.x, y - self.origin.y])? + self.origin.z)
    }

    /// The same with the number of that triangle.
    pub fn below(&self, point: &Vector3<f64>, down: &Vector3<f64>) -> Option<(f64, u32)> {
        let far = (self.highest - self.lowest).norm() + (point - self.lowest).norm();
        let (from, to) = (point - down * far, point + down * far);
        let (mut below, mut above) = ((f64::INFINITY, 0), (f64::NEG_INFINITY, 0));
        let query = Bounds::around(&from.inf(&to), &from.sup(&to));
        // The box around a line along an axis is the line.
        let upright = down.amax() == 1.0;
        self.tree.visit(
            |bounds| bounds.meets(&query) && (upright || line_meets(bounds, &from, &to)),
            |t| {
                if let Some(distance) = crossing(&self.corners(t as u32), point, down) {
                    if distance >= 0.0 && distance < below.0 {
                        below = (distance, t as u32);
                    } else if distance < 0.0 && distance > above.0 {
                        above = (distance, t as u32);
                    }
                }
                true
            },
        );
        if below.0.is_finite() { Some(below) } else { above.0.is_finite().then_some(above) }
    }
}

/// Smallest time above 0 at which `speed t + bow t^2 / 2` reaches `gap` > 0; `bow` is 0 or more.
#[inline]
pub fn arrival(gap: f64, speed: f64, bow: f64) -> f64 {
    let root = (speed * speed + 2.0 * bow * gap).sqrt();
    // Of the two forms of the root the one that does not cancel; infinite where it never arrives.
    if speed >= 0.0 { 2.0 * gap / (speed + root) } else { (root - speed) / bow }
}

/// True if the straight line between the points has a point in the box, or nearly.
fn line_meets(bounds: &Bounds, from: &Vector3<f64>, to: &Vector3<f64>) -> bool {
    let (middle, half) = bounds.middle_and_half();
    let half_line = (to - from) * 0.5;
    let off = (from + to) * 0.5 - middle;
    let reach = half.add_scalar(1e-9 * (1.0 + half.max())) + half_line.abs();
    if (0..3).any(|axis| off[axis].abs() > reach[axis]) {
        return false;
    }
    // Separated along a direction across the line and an axis.
    let across = half_line.cross(&off).abs();
    let size = half_line.abs();
    let wide = half.add_scalar(1e-9 * (1.0 + half.max()));
    across.x <= wide.y * size.z + wide.z * size.y
        && across.y <= wide.x * size.z + wide.z * size.x
        && across.z <= wide.x * size.y + wide.y * size.x
}

/// Distance along `down` from `point` at which the line crosses the triangle [m]; its border counts.
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

#[cfg(test)]
mod tests {
    use super::arrival;

    #[test]
    fn a_gap_is_reached_when_the_way_is_as_long() {
        for (gap, speed, bow) in
            [(0.3, 2.0, 5.0), (0.3, -2.0, 5.0), (1e-9, 10.0, 0.0), (2.0, 0.0, 9.81), (0.1, -3.0, 1e-3)]
        {
            let t: f64 = arrival(gap, speed, bow);
            assert!(((speed + 0.5 * bow * t) * t / gap - 1.0).abs() < 1e-9, "{gap} {speed} {bow}: {t}");
        }
        assert_eq!(arrival(1.0, -1.0, 0.0), f64::INFINITY);
        assert_eq!(arrival(1.0, 0.0, 0.0), f64::INFINITY);
    }
}
