//! When a flying rock may touch a triangle.
//!
//! A triangle is convex: it lies behind the plane through its point that is closest to a sphere, and until
//! the sphere has reached that plane they cannot touch. Along the plane's normal the sphere's centre moves
//! with the rock and its spin, bent by gravity and by the turn. A box of spheres that lies on one side of the
//! triangle's own plane touches nothing until it has reached that, so that the tree over the spheres is left out
//! where the rock flies away from a triangle, along it, or comes later than another contact.

use crate::rock::{Motion, Rock};
use dem_solid::geometry::box_tree::Bounds;
use dem_solid::geometry::sphere_tree::{Slab, SphereTree};
use dem_solid::geometry::triangle::Face;
use dem_terrain::queries::arrival;
use nalgebra::{Matrix3, Vector3};

/// Share of the reach by which gaps are taken smaller, for rounding.
const ROUNDING: f64 = 1e-9;

/// A rock in free flight, seen in its own axes at one instant.
#[derive(Debug, Clone, Copy)]
pub struct Course {
    position: Vector3<f64>,
    to_own: Matrix3<f64>,
    /// Velocity of the centre of mass [m/s], angular velocity [rad/s], and gravity [m/s2].
    velocity: Vector3<f64>,
    spin: Vector3<f64>,
    pull: Vector3<f64>,
    /// Largest acceleration of a point at the distance 1 that the turn gives it [1/s2].
    bend: f64,
    /// Speed [m/s] and acceleration [m/s2] that no point exceeds.
    speed: f64,
    bow: f64,
    reach: f64,
    rounding: f64,
}

impl Course {
    /// Of a rock and the tree over its spheres.
    pub fn new(rock: &Rock, tree: &SphereTree, now: &Motion, gravity: &Vector3<f64>) -> Self {
        let to_own = now.rotation().transpose();
        let rate = now.angular_momentum.norm() / rock.inertia.min();
        // The spin itself turns where the moments differ.
        let bend = rate * rate * (rock.inertia.max() / rock.inertia.min());
        Self {
            position: now.position,
            velocity: to_own * now.velocity,
            spin: (to_own * now.angular_momentum).component_div(&rock.inertia),
            pull: to_own * gravity,
            to_own,
            bend,
            speed: now.velocity.norm() + rate * rock.arm,
            bow: gravity.norm() + bend * rock.arm,
            reach: tree.reach,
            rounding: ROUNDING * tree.reach,
        }
    }

    /// When a point may have come `far` [m] [s].
    pub fn after(&self, far: f64) -> f64 {
        arrival(far, self.speed, self.bow)
    }

    /// Largest travel of a point after `time` [s] [m].
    pub fn distance(&self, time: f64) -> f64 {
        (self.speed + 0.5 * self.bow * time) * time
    }

    /// The smaller of `least` [s] and the time at which the rock may touch the triangle, if that comes within `far`
    /// [m] of its reach; 0 where they touch already.
    pub fn meets(&self, tree: &SphereTree, face: &Face, far: f64, least: f64) -> f64 {
        // At a glance, with the sphere around the whole rock.
        let late = |off: f64| off > far || (off > 0.0 && arrival(off, self.speed, self.bow) >= least);
        if late(face.off_plane(&self.position) - self.reach) {
            return least;
        }
        let (to_point, _) = face.closest(&self.position);
        if late(to_point.norm() - self.reach) {
            return least;
        }
        if let Some(radius) = tree.single() {
            let distance = to_point.norm();
            let gap = distance - radius - self.rounding;
            if gap <= 0.0 {
                return 0.0;
            }
            let normal = self.to_own * (to_point / distance);
            return least.min(arrival(gap, self.velocity.dot(&normal), self.pull.dot(&normal).max(0.0)));
        }
        let seen = face.seen(&self.to_own, &self.position);
        let plane = ApproachPlane::new(self, &seen);
        let least = std::cell::Cell::new(least);
        tree.visit(
            |bounds| self.box_meets(&plane, bounds) < least.get(),
            |sphere| {
                let (to_point, _) = seen.closest(&sphere.centre);
                let distance = to_point.norm();
                let gap = distance - sphere.radius - self.rounding;
                if gap <= 0.0 {
                    least.set(0.0);
                    return false;
                }
                let normal = to_point / distance;
                let approach = (self.velocity + self.spin.cross(&sphere.centre)).dot(&normal);
                let bow = self.pull.dot(&normal).max(0.0) + self.bend * sphere.centre.norm();
                least.set(least.get().min(arrival(gap, approach, bow)));
                true
            },
        );
        least.get()
    }

    /// A time [s] before which nothing in the box can reach the plane, or the box around the triangle.
    #[inline]
    fn box_meets(&self, plane: &ApproachPlane, bounds: &Bounds) -> f64 {
        let (middle, half) = bounds.middle_and_half();
        let [off, wide, beside] = plane.slab.clearance((middle, half));
        let side = if off > 0.0 { -1.0 } else { 1.0 };
        let (gap, beside) = (off.abs() - wide - self.rounding, beside - self.rounding);
        let mut time = 0.0;
        if beside > 0.0 {
            time = arrival(beside, self.speed, self.bow);
        }
        if gap > 0.0 {
            let approach = side * (plane.approach + plane.turn.dot(&middle)) + plane.turn.abs().dot(&half);
            let bow = (side * plane.pull).max(0.0) + self.bend * self.reach;
            time = arrival(gap, approach, bow).max(time);
        }
        time
    }
}

/// The plane of a triangle, as the course sees it.
struct ApproachPlane {
    slab: Slab,
    /// Velocity of the centre of mass along the normal, and what a point's place adds to it.
    approach: f64,
    turn: Vector3<f64>,
    /// Gravity along the normal.
    pull: f64,
}

impl ApproachPlane {
    fn new(course: &Course, face: &Face) -> Self {
        Self {
            slab: Slab::new(face),
            approach: course.velocity.dot(&face.normal),
            // (w x r) . n = r . (n x w)
            turn: face.normal.cross(&course.spin),
            pull: course.pull.dot(&face.normal),
        }
    }
}
