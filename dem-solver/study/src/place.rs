//! Where a member starts: on the ground, or at a height above it.

use dem_contact::rock::{Motion, Rock};
use dem_solid::geometry::closest::on_face;
use dem_solid::geometry::sphere_tree::{Slab, SphereTree};
use dem_solid::geometry::triangle::Face;
use dem_terrain::Terrain;
use nalgebra::Vector3;

/// Gap that counts as a touch, in radii of the smallest sphere: a tenth of what the check of a start lets pass.
const TOUCH: f64 = 3e-4;
/// Most steps down: on a slope of a degrees each leaves the share 1 - cos(a) of the gap.
const STEPS: usize = 200;
/// Most steps up until the rock is free.
const RISES: usize = 1000;
/// Share by which bounds are taken wider, for rounding.
const ROUNDING: f64 = 1e-9;

/// Unit vector down the line of fall of the ground at a place, over a distance of `size` [m]; level ground has none.
pub fn line_of_fall(ground: &Terrain, [x, y]: [f64; 2], size: f64) -> Option<Vector3<f64>> {
    let at = |dx: f64, dy: f64| ground.ground_at([x + dx, y + dy]);
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
    /// For each sphere a distance that it certainly has, cut off at the gap of the step in which it was looked at [m].
    least: Vec<f64>,
    /// The same as far as it was looked for [m].
    sure: Vec<f64>,
}

impl Descent<'_> {
    fn centre(&self, sphere: u32) -> Vector3<f64> {
        self.motion.position + self.motion.orientation * self.rock.spheres[sphere as usize].centre
    }

    /// Distance of a sphere's surface from the ground [m], or `most` where that is less.
    fn distance(&mut self, sphere: u32, most: f64) -> f64 {
        let radius = self.rock.spheres[sphere as usize].radius;
        let cut = most + radius;
        let sure = self.sure[sphere as usize];
        if sure > most * (1.0 + ROUNDING) {
            return cut - radius;
        }
        // Twice as far as is asked for: after a step down by `most` it is known still that this sphere is not the nearest.
        let found = nearest(self.ground, &self.centre(sphere), cut + most);
        self.sure[sphere as usize] = found - radius;
        found.min(cut) - radius
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
        self.sure.clone_from(&self.least);
        for _ in 0..STEPS {
            let gap = self.gap(spheres);
            if gap <= TOUCH * self.rock.smallest_radius {
                break;
            }
            // Not quite: rounding must not press it in.
            let by = gap * (1.0 - 1e-9);
            self.motion.position.z -= by;
            self.least.iter_mut().chain(&mut self.sure).for_each(|distance| *distance -= by);
        }
    }

    /// Whether any sphere is in the ground. Few triangles lie in reach of a rock of many spheres: they look for spheres.
    fn is_in(&self, tree: &SphereTree) -> bool {
        let (position, to_own) = (self.motion.position, self.motion.orientation.inverse());
        let cuts = |sphere: u32, [a, b, c]: &[Vector3<f64>; 3]| {
            let radius = self.rock.spheres[sphere as usize].radius;
            on_face(&self.centre(sphere), [a, b, c]).to_point.norm() < radius
        };
        let mut found = false;
        self.ground.about(&position, tree.reach * (1.0 + ROUNDING), |t| {
            if !found {
                let corners = self.ground.corners(t);
                let own = Slab::new(&Face::new(corners.map(|corner| to_own * (corner - position))));
                tree.near_face(&own, ROUNDING * tree.reach, 0.0, |_, sphere| {
                    found = found || cuts(sphere, &corners);
                });
            }
        });
        found
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
    (rock, tree): (&Rock, &SphereTree),
    motion: &Motion,
    place: [f64; 2],
    height: f64,
) -> Option<Vector3<f64>> {
    let mut motion = Motion { position: Vector3::new(place[0], place[1], 0.0), ..*motion };
    motion.position.z = ground.ground_at(place)? + 1.01 * rock.reach;
    for _ in 0..RISES {
        if !ground.is_near(&motion.position, rock.reach) {
            break;
        }
        motion.position.z += 0.5 * rock.reach;
    }
    let [least, sure] = [(); 2].map(|()| Vec::with_capacity(rock.spheres.len()));
    let mut descent = Descent { ground, rock, motion, least, sure };
    descent.sink(&rock.outermost);
    // Between the outer spheres a ridge may reach into the rock; where it does, some sphere is cut by the surface.
    if descent.is_in(tree) {
        descent.motion = motion;
        descent.sink(&(0..rock.spheres.len() as u32).collect::<Vec<_>>());
    }
    descent.motion.position.z += height;
    Some(descent.motion.position)
}

#[cfg(test)]
use {dem_solid::random::SplitMix, dem_terrain::raster::Raster};

#[cfg(test)]
#[path = "../../tests/support/slope.rs"]
mod slope;

#[cfg(test)]
mod tests {
    use super::slope::Slope;
    use super::*;
    use crate::member::orientation;
    use dem_contact::settings::Settings;
    use dem_solid::geometry::sphere::Sphere;
    use toolkit::scene::Scene;

    const SCENE: &str = "end_time = 1.0\ngravity = [0.0, 0.0, -9.81]\n\
        [[rock]]\nposition = [5.0, 5.0, 90.0]\ndensity = 2600.0\n\
        shape = { type = \"box\", size = [2.2, 1.6, 1.2] }\ncluster.spheres = 216\n\
        [terrain]\nfile = \"slope.asc\"\n\
        [[contact]]\nlaw = \"hertz_rock\"\nyoung = 1e9\npoisson = 0.25\nrestitution = 0.2\nfriction = 0.6\n";

    /// Rough ground in cells smaller than the rock, the rock, its tree and how it would start.
    fn parts() -> (std::sync::Arc<Terrain>, Rock, SphereTree, Motion) {
        let temp = tempfile::tempdir().expect("a directory");
        let slope = Slope {
            corner: [0.0, 0.0],
            spacing: 0.4,
            counts: [51, 51],
            drop: 12.0,
            foot: 0.0,
            benches: 1,
            roughness: 0.4,
            seed: 5,
        };
        slope.raster().write_asc(&temp.path().join("slope.asc")).expect("written");
        let scene =
            Scene::from_text(&temp.path().join("s.toml").display().to_string(), SCENE).expect("a scene");
        let settings = Settings::of(&scene).unwrap_or_else(|e| panic!("{e}"));
        let (rock, _) = Rock::new(0, &settings.rocks[0], &scene, &[]).unwrap_or_else(|e| panic!("{e}"));
        let solver = dem_rocks::DemSolver::new(&scene, &toolkit::program::Options::default());
        let ground = solver.unwrap_or_else(|e| panic!("{e}")).into_model().ground.expect("a terrain");
        let tree = SphereTree::new(&rock.spheres);
        let start = rock.start(&settings.rocks[0], settings.gravity);
        (ground, rock, tree, start)
    }

    /// Every sphere looked at in every step, with no bound of what was seen before but that of the step.
    fn plainly(ground: &Terrain, rock: &Rock, start: &Motion, spheres: &[u32]) -> Motion {
        let mut motion = *start;
        let distance = |motion: &Motion, s: &Sphere, most: f64| {
            nearest(ground, &(motion.position + motion.orientation * s.centre), most + s.radius) - s.radius
        };
        for _ in 0..STEPS {
            let each = spheres.iter().map(|k| &rock.spheres[*k as usize]);
            let gap = each.fold(f64::INFINITY, |gap, s| gap.min(distance(&motion, s, gap)));
            if gap <= TOUCH * rock.smallest_radius {
                break;
            }
            motion.position.z -= gap * (1.0 - 1e-9);
        }
        motion
    }

    #[test]
    fn what_is_known_of_spheres_changes_no_place() {
        let (ground, rock, tree, own) = parts();
        let all: Vec<u32> = (0..rock.spheres.len() as u32).collect();
        let mut cut = 0;
        for k in 0..40 {
            let part = |f: f64| (f64::from(k) * f).fract();
            let place = [
                4.0 + 12.0 * part(0.618_034) - ground.origin.x,
                4.0 + 12.0 * part(0.414_214) - ground.origin.y,
            ];
            let [w, x, y, z] = orientation([part(0.732_051), part(0.236_068), part(0.645_751)]);
            let turn = nalgebra::Quaternion::new(w, x, y, z);
            let motion = Motion { orientation: nalgebra::UnitQuaternion::from_quaternion(turn), ..own };
            let found = above_ground(&ground, (&rock, &tree), &motion, place, 0.0).expect("ground below");
            let top = ground.ground_at(place).expect("ground below") + 1.01 * rock.reach;
            let mut start = Motion { position: Vector3::new(place[0], place[1], top), ..motion };
            while ground.is_near(&start.position, rock.reach) {
                start.position.z += 0.5 * rock.reach;
            }
            let mut own = plainly(&ground, &rock, &start, &rock.outermost);
            let is_in = rock
                .spheres
                .iter()
                .any(|s| nearest(&ground, &(own.position + own.orientation * s.centre), s.radius) < s.radius);
            if is_in {
                cut += 1;
                own = plainly(&ground, &rock, &start, &all);
            }
            let apart = (found - own.position).norm();
            assert!(apart < 1e-9 * rock.smallest_radius, "place {k}: {apart:e}");
        }
        assert!((5..=35).contains(&cut), "ridges reach into {cut} of 40");
    }
}
