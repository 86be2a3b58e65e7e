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

/// A rock that comes down straight.
struct Descent<'a> {
    ground: &'a Terrain,
    rock: &'a Rock,
    motion: Motion,
    /// For each sphere a distance that it certainly has [m].
    least: Vec<f64>,
}

impl Descent<'_> {
    /// Distance of a sphere's surface from the ground [m], or `most` where that is less.
    fn distance(&self, sphere: u32, most: f64) -> f64 {
        let it = &self.rock.spheres[sphere as usize];
        let centre = self.motion.position + self.motion.orientation * it.centre;
        nearest(self.ground, &centre, most + it.radius) - it.radius
    }

    /// How far these spheres may move in any direction until one touches the ground [m].
    fn gap(&mut self, spheres: &[u32]) -> f64 {
        let mut gap = f64::INFINITY;
        for &sphere in spheres {
            if self.least[sphere as usize] < gap {
                let distance = self.distance(sphere, gap);
                self.least[sphere as usize] = distance;
                gap = gap.min(distance);
            }
        }
        gap
    }

    /// Come down until one of these spheres touches.
    fn sink(&mut self, spheres: &[u32]) {
        let free = nearest(self.ground, &self.motion.position, f64::INFINITY);
        self.least.clear();
        self.least.extend(self.rock.spheres.iter().map(|s| free - s.centre.norm() - s.radius));
        for _ in 0..STEPS {
            let gap = self.gap(spheres);
            if gap <= TOUCH * self.rock.smallest_radius {
                break;
            }
            // Not quite: rounding must not press it in.
            let by = gap * (1.0 - 1e-9);
            self.motion.position.z -= by;
            self.least.iter_mut().for_each(|least| *least -= by);
        }
    }

    /// Whether any sphere is in the ground.
    fn is_in(&self) -> bool {
        (0..self.rock.spheres.len() as u32).any(|sphere| self.distance(sphere, 0.0) < 0.0)
    }
}

/// Distance of a point from the ground [m], or `most` where that is less.
fn nearest(ground: &Terrain, point: &Vector3<f64>, most: f64) -> f64 {
    let mut found = most;
    if !most.is_finite() {
        // What lies straight below is not nearer than the nearest.
        let below = ground.height(point, &-Vector3::z()).map_or(f64::INFINITY, f64::abs);
        found = below.min((ground.highest - ground.lowest).norm());
    }
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
    let mut descent = Descent { ground, rock, motion, least: Vec::with_capacity(rock.spheres.len()) };
    descent.sink(&rock.outermost);
    // Between the outer spheres a ridge may reach into the rock; where it does, some sphere is cut by the surface.
    if descent.is_in() {
        descent.motion = motion;
        descent.sink(&(0..rock.spheres.len() as u32).collect::<Vec<_>>());
    }
    descent.motion.position.z += height;
    Some(descent.motion.position)
}
