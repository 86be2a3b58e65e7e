//! Where a member starts: on the ground, or at a height above it.

use crate::geometry::closest::on_face;
use crate::rock::{Motion, Rock};
use crate::terrain::Terrain;
use nalgebra::Vector3;

/// Gap that counts as a touch, in radii of the smallest sphere: a tenth of what the check of a start lets pass.
const TOUCH: f64 = 3e-4;
/// Most steps down: on a slope of a degrees each leaves the share 1 - cos(a) of the gap.
const STEPS: usize = 200;
/// Most steps up until the rock is free.
const RISES: usize = 1000;

/// Height of the ground at a place seen from above, local [m]; `None` where there is none.
pub fn ground_at(ground: &Terrain, [x, y]: [f64; 2]) -> Option<f64> {
    let top = ground.highest.z + 1.0;
    Some(top - ground.height(&Vector3::new(x, y, top), &-Vector3::z())?)
}

/// Unit vector down the line of fall of the ground at a place, over a distance of `size` [m]; level ground has none.
pub fn line_of_fall(ground: &Terrain, [x, y]: [f64; 2], size: f64) -> Option<Vector3<f64>> {
    let at = |dx: f64, dy: f64| ground_at(ground, [x + dx, y + dy]);
    let slope = |plus: Option<f64>, minus: Option<f64>| {
        let here = at(0.0, 0.0)?;
        Some(match (plus, minus) {
            (Some(plus), Some(minus)) => (plus - minus) / (2.0 * size),
            (Some(plus), None) => (plus - here) / size,
            (None, Some(minus)) => (here - minus) / size,
            (None, None) => 0.0,
        })
    };
    let [dx, dy] = [slope(at(size, 0.0), at(-size, 0.0))?, slope(at(0.0, size), at(0.0, -size))?];
    let steep = dx * dx + dy * dy;
    Vector3::new(-dx, -dy, -steep).try_normalize(1e-9)
}

/// Distance of a rock's spheres from the ground, as it comes down.
struct Gap<'a> {
    ground: &'a Terrain,
    rock: &'a Rock,
    motion: Motion,
    /// For each sphere a distance that it certainly has [m].
    least: Vec<f64>,
}

impl Gap<'_> {
    /// How far the rock may move in any direction until it touches the ground [m].
    fn find(&mut self) -> f64 {
        let mut gap = f64::INFINITY;
        // From the lowest sphere: most others are then known to be further away.
        for at in std::iter::once(self.lowest()).chain(0..self.least.len()) {
            if self.least[at] < gap {
                let sphere = &self.rock.spheres[at];
                let centre = self.motion.position + self.motion.orientation * sphere.centre;
                self.least[at] = nearest(self.ground, &centre, gap + sphere.radius) - sphere.radius;
                gap = gap.min(self.least[at]);
            }
        }
        gap
    }

    /// The sphere that reaches furthest down.
    fn lowest(&self) -> usize {
        let up = self.motion.orientation.inverse_transform_vector(&Vector3::z());
        let end = |at: &usize| {
            let sphere = &self.rock.spheres[*at];
            sphere.centre.dot(&up) - sphere.radius
        };
        (0..self.least.len()).min_by(|a, b| end(a).total_cmp(&end(b))).unwrap_or(0)
    }

    fn sink(&mut self, by: f64) {
        self.motion.position.z -= by;
        self.least.iter_mut().for_each(|gap| *gap -= by);
    }
}

/// Distance of a point from the ground [m], or `most` where that is less.
fn nearest(ground: &Terrain, point: &Vector3<f64>, most: f64) -> f64 {
    // What lies straight below is not nearer than the nearest.
    let below = ground.height(point, &-Vector3::z()).map_or(f64::INFINITY, f64::abs);
    let size = (ground.highest - ground.lowest).norm();
    let mut found = most.min(below).min(size);
    ground.about(point, found, |t| {
        let [a, b, c] = &ground.corners(t);
        found = found.min(on_face(point, [a, b, c]).to_point.norm());
    });
    found
}

/// The lowest position at and above a place seen from above at which the rock only touches the ground, `height` [m] higher;
/// local [m]. `None` where there is no ground below.
pub fn above_ground(
    ground: &Terrain,
    rock: &Rock,
    motion: &Motion,
    place: [f64; 2],
    height: f64,
) -> Option<Vector3<f64>> {
    let mut motion = Motion { position: Vector3::new(place[0], place[1], 0.0), ..*motion };
    motion.position.z = ground_at(ground, place)? + 1.01 * rock.reach;
    for _ in 0..RISES {
        if !ground.is_near(&motion.position, rock.reach) {
            break;
        }
        motion.position.z += 0.5 * rock.reach;
    }
    let free = nearest(ground, &motion.position, f64::INFINITY);
    let least = rock.spheres.iter().map(|sphere| free - sphere.centre.norm() - sphere.radius).collect();
    let mut gap = Gap { ground, rock, motion, least };
    for _ in 0..STEPS {
        let free = gap.find();
        if free <= TOUCH * rock.smallest_radius {
            break;
        }
        // Not quite: rounding must not press it in.
        gap.sink(free * (1.0 - 1e-9));
    }
    gap.motion.position.z += height;
    Some(gap.motion.position)
}
