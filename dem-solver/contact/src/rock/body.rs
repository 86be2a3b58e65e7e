//! A rigid rock: everything of it that does not change in a run.

use super::faces::Faces;
use super::motion::Motion;
use super::placed::{PlacedSpheres, check_smallest};
use super::solid::Solid;
use super::{outermost, rotation};
use crate::settings::rock::Method;
use crate::settings::{RockSettings, Shape};
use dem_solid::cluster::{Accuracy, kept};
use dem_solid::geometry::bounds;
use dem_solid::geometry::sphere::Sphere;
use interface_defs::diagnostic::{Diagnostic, code};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use std::f64::consts::PI;
use std::path::PathBuf;
use std::sync::Arc;
use toolkit::scene::Scene;

/// A rigid rock: everything that does not change. Its own frame is the principal frame, with the
/// origin in the centre of mass.
#[derive(Debug, Clone, PartialEq)]
pub struct Rock {
    /// Its name.
    pub name: String,
    /// Mass [kg].
    pub mass: f64,
    /// Principal moments of inertia [kg m2].
    pub inertia: Vector3<f64>,
    /// The spheres that stand for it in contact.
    pub spheres: Vec<Sphere>,
    /// Those spheres of which one is the furthest in any direction.
    pub outermost: Vec<u32>,
    /// In words, how the spheres were placed.
    pub origin: String,
    /// So many spheres of the smallest radius would be as stiff together, at equal overlap, as those that touch
    /// a plane at once.
    pub facing: f64,
    /// Smallest box in its own frame around all spheres: lowest corner [m].
    pub lowest_corner: Vector3<f64>,
    /// Highest corner [m].
    pub highest_corner: Vector3<f64>,
    /// Distance of the furthest corner of that box from the centre of mass [m].
    pub reach: f64,
    /// Distance of the furthest sphere's centre from the centre of mass [m].
    pub arm: f64,
    /// Smallest radius of its spheres [m].
    pub smallest_radius: f64,
    /// Largest radius [m].
    pub largest_radius: f64,
    /// The true solid.
    pub solid: Solid,
    /// Its faces where wires touch it by them ([`Rock::touch_by_faces`]); `None`: they touch its spheres.
    pub faces: Option<Faces>,
    /// The error of the spheres, where making them took measuring it.
    accuracy: Option<Accuracy>,
    /// A file of the spheres for the run to read, where making them takes time ([`dem_solid::cluster::kept`]).
    pub made: Option<String>,
    /// Before all lengths were multiplied, and the factor, where the scene asks for that.
    pub unscaled: Option<Arc<(Self, f64)>>,
}

impl Rock {
    /// Rock number `at` of the scene, from its table, which has been checked. Reads the files that it names and makes its spheres;
    /// those that were made for it before are looked for beside the scene and in the folders `more`. The second part is what the
    /// user should know.
    pub fn new(
        at: usize,
        settings: &RockSettings,
        scene: &Scene,
        more: &[PathBuf],
    ) -> Result<(Self, Vec<Diagnostic>), Diagnostic> {
        let refuse = |key: &str, error: Diagnostic| {
            scene.invalid(&format!("rock.{at}.{key}"), format!("rock `{}`: {error}", settings.name))
        };
        let (solid, mut notices) = Solid::new(&settings.shape).map_err(|e| refuse("shape", e))?;
        let mass = settings
            .mass
            .unwrap_or_else(|| settings.density.expect("mass or density, checked") * solid.volume());
        let cluster = settings.cluster.clone().unwrap_or_default();
        let PlacedSpheres { mut spheres, origin, outer, notice, accuracy, made } =
            match (&settings.shape, &cluster.file) {
                (_, Some(file)) => PlacedSpheres::read(file).map_err(|e| refuse("cluster.file", e))?,
                (Shape::Sphere { radius }, None) => PlacedSpheres::single(*radius),
                (Shape::Box { size }, None) if cluster.method != Some(Method::Medial) => {
                    PlacedSpheres::lattice(*size, &cluster).map_err(|e| refuse("cluster.spheres", e))?
                }
                (shape, None) => {
                    let (surface, _) = shape.surface(false).map_err(|e| refuse("shape", e))?;
                    check_smallest(at, &surface, &cluster, scene)?;
                    let folders = [&[kept::folder(scene)], more].concat();
                    PlacedSpheres::medial(&surface, &cluster, &settings.name, &folders)
                        .map_err(|e| refuse("cluster.spheres", e))?
                }
            };
        notices.extend(notice);
        for sphere in &mut spheres {
            sphere.centre = solid.own(&sphere.centre);
        }
        let corners = spheres.iter().flat_map(|s| [-s.radius, s.radius].map(|r| s.centre.add_scalar(r)));
        let [lowest_corner, highest_corner] = bounds(corners);
        let radii = || spheres.iter().map(|s| s.radius);
        let (outermost, facing) =
            outer.unwrap_or_else(|| (outermost::of(&spheres), outermost::facing(&spheres, &solid.drawn)));
        let mut rock = Self {
            name: settings.name.clone(),
            mass,
            inertia: solid.inertia(mass),
            outermost,
            origin,
            facing,
            lowest_corner,
            highest_corner,
            reach: lowest_corner.abs().sup(&highest_corner.abs()).norm(),
            arm: spheres.iter().map(|s| s.centre.norm()).fold(0.0, f64::max),
            smallest_radius: radii().fold(f64::INFINITY, f64::min),
            largest_radius: radii().fold(0.0, f64::max),
            solid,
            faces: None,
            accuracy,
            made,
            spheres,
            unscaled: None,
        };
        if let Some(scale) = settings.scale {
            rock = rock.sized(scale, settings);
        }
        let noticed = |what: String| {
            let what = format!("rock `{}`: {what}", rock.name);
            Diagnostic::warning(code::GEOMETRY, what).about(format!("rock.{at}"))
        };
        let notices = notices.into_iter().map(noticed).collect();
        Ok((rock, notices))
    }

    /// The rock as its scene scales it. A cluster that was made is kept as it was before.
    fn sized(mut self, scale: f64, settings: &RockSettings) -> Self {
        let made = self.made.take();
        let mut grown = self.scaled(scale, self.mass);
        if let Some(density) = settings.density {
            grown.mass = density * grown.solid.volume();
            grown.inertia = grown.solid.inertia(grown.mass);
        }
        grown.made = made;
        grown.unscaled = Some(Arc::new((self, scale)));
        grown
    }

    /// The same rock with all its lengths times `factor`, spheres included, and `mass` [kg].
    #[must_use]
    pub fn scaled(&self, factor: f64, mass: f64) -> Self {
        let solid = self.solid.scaled(factor);
        let grown = |s: &Sphere| Sphere { centre: s.centre * factor, radius: s.radius * factor };
        Self {
            mass,
            inertia: solid.inertia(mass),
            spheres: self.spheres.iter().map(grown).collect(),
            lowest_corner: self.lowest_corner * factor,
            highest_corner: self.highest_corner * factor,
            reach: self.reach * factor,
            arm: self.arm * factor,
            smallest_radius: self.smallest_radius * factor,
            largest_radius: self.largest_radius * factor,
            solid,
            faces: self.faces.as_ref().map(|faces| faces.scaled(factor)),
            accuracy: None,
            made: None,
            unscaled: None,
            ..self.clone()
        }
    }

    /// From now on wires touch its true surface, if that is convex and has not too many faces; else, as before, its spheres.
    pub fn touch_by_faces(&mut self) {
        self.faces = Faces::of(&self.solid.drawn);
        let corners = self.faces.iter().flat_map(|faces| faces.corners());
        for corner in corners {
            self.lowest_corner = self.lowest_corner.inf(corner);
            self.highest_corner = self.highest_corner.sup(corner);
        }
        self.reach = self.lowest_corner.abs().sup(&self.highest_corner.abs()).norm();
    }

    /// Length against which overlaps with wires, and steps past them, are measured [m]: of a rock that touches by its faces the radius of
    /// the ball of its volume, else that of the smallest sphere.
    pub fn radius_on_wires(&self) -> f64 {
        if self.faces.is_some() { self.mean_radius() } else { self.smallest_radius }
    }

    /// Largest radius of a sphere that may be the furthest in some direction [m].
    pub fn largest_outer_radius(&self) -> f64 {
        self.outermost.iter().map(|k| self.spheres[*k as usize].radius).fold(self.smallest_radius, f64::max)
    }

    /// True if its spheres are a lattice in a box: then the outer ones end at its faces.
    pub fn fills_a_box(&self) -> bool {
        matches!(self.solid.shape, Shape::Box { .. }) && self.has_equal_spheres()
    }

    /// True if all its spheres have one radius.
    pub fn has_equal_spheres(&self) -> bool {
        self.largest_radius == self.smallest_radius
    }

    /// The error of its spheres against its true surface.
    pub fn accuracy(&self, settings: &RockSettings) -> Result<Accuracy, Diagnostic> {
        if let Some(known) = self.accuracy {
            return Ok(known);
        }
        let (mut surface, _) = settings.shape.surface(false)?;
        let scale = settings.scale.unwrap_or(1.0);
        surface.points.iter_mut().for_each(|p| *p = self.solid.own(&(*p * scale)));
        Ok(Accuracy::of(&surface, &self.spheres))
    }

    /// Motion at t = 0 as the scene has it; `gravity` [m/s2] is the acceleration before any contact.
    pub fn start(&self, settings: &RockSettings, gravity: Vector3<f64>) -> Motion {
        let [w, x, y, z] = settings.orientation;
        let shape = UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z));
        let orientation = self.solid.turn().map_or(shape, |turn| shape * turn);
        let spin: Vector3<f64> = settings.angular_velocity.into();
        let own = orientation.inverse_transform_vector(&spin);
        Motion {
            position: settings.position.into(),
            velocity: settings.velocity.into(),
            orientation,
            angular_momentum: orientation * self.inertia.component_mul(&own),
            acceleration: gravity,
            torque: Vector3::zeros(),
        }
    }

    /// Height of its lowest point along `down` (a unit vector), counted downwards [m].
    #[inline]
    pub fn depth(&self, motion: &Motion, down: &Vector3<f64>) -> f64 {
        let own = motion.orientation.inverse_transform_vector(down);
        let furthest = self.outermost.iter().map(|&k| {
            let sphere = &self.spheres[k as usize];
            sphere.centre.dot(&own) + sphere.radius
        });
        motion.position.dot(down) + furthest.fold(f64::NEG_INFINITY, f64::max)
    }

    /// True if `point` [m], in its own frame, lies further than `depth` radii inside the box that the centres of its
    /// outer spheres span.
    pub fn holds(&self, point: &Vector3<f64>, depth: f64) -> bool {
        let radius = (1.0 + depth) * self.smallest_radius;
        self.fills_a_box()
            && (0..3).all(|axis| {
                point[axis] > self.lowest_corner[axis] + radius
                    && point[axis] < self.highest_corner[axis] - radius
            })
    }

    /// How far a sphere's centre has moved at most by the turn since `before` [m]: at distance r by 2 r sin(angle / 2).
    #[inline]
    pub fn rotation_since(&self, before: &UnitQuaternion<f64>, now: &Motion) -> f64 {
        2.0 * (before.inverse() * now.orientation).imag().norm() * self.lever()
    }

    /// Distance of the furthest point that contact is measured from, a sphere's centre or a corner [m].
    fn lever(&self) -> f64 {
        if self.faces.is_some() { self.reach } else { self.arm }
    }

    /// Angular velocity along the axes of space [rad/s].
    #[inline]
    pub fn spin(&self, motion: &Motion) -> Vector3<f64> {
        if rotation::is_spherical(&self.inertia) {
            return motion.angular_momentum / self.inertia.x;
        }
        let own = motion.orientation.inverse_transform_vector(&motion.angular_momentum);
        motion.orientation * own.component_div(&self.inertia)
    }

    /// Orientation of the shape's axes, as the scene has it at the start: from them to the axes of space.
    #[inline]
    pub fn shape_orientation(&self, motion: &Motion) -> UnitQuaternion<f64> {
        self.solid.turn().map_or(motion.orientation, |turn| motion.orientation * turn.inverse())
    }

    /// Radius of the ball of its volume [m].
    pub fn mean_radius(&self) -> f64 {
        (0.75 / PI * self.solid.volume()).cbrt()
    }

    /// Bound of the speed of its fastest point [m/s].
    pub fn fastest(&self, motion: &Motion) -> f64 {
        let spin = motion.angular_momentum.norm() / self.inertia.min();
        motion.velocity.norm() + spin * (self.arm + self.smallest_radius)
    }

    /// Kinetic energy of translation and rotation [J].
    #[inline]
    pub fn kinetic_energy(&self, motion: &Motion) -> f64 {
        let translation = 0.5 * self.mass * motion.velocity.norm_squared();
        if motion.angular_momentum == Vector3::zeros() {
            return translation;
        }
        let own = motion.orientation.inverse_transform_vector(&motion.angular_momentum);
        translation + 0.5 * own.dot(&own.component_div(&self.inertia))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::Cluster;

    fn cube(spheres: u32) -> RockSettings {
        RockSettings {
            name: "cube".into(),
            material: "rock".into(),
            position: [0.0; 3],
            velocity: [0.0; 3],
            orientation: [1.0, 0.0, 0.0, 0.0],
            angular_velocity: [0.0; 3],
            mass: Some(180.0),
            density: None,
            shape: Shape::Box { size: [0.41; 3] },
            cluster: Some(Cluster::of(spheres)),
            scale: None,
        }
    }

    fn rock(settings: &RockSettings) -> (Rock, Vec<Diagnostic>) {
        let scene = Scene::from_text("test.toml", "").expect("a scene");
        Rock::new(0, settings, &scene, &[]).unwrap_or_else(|e| panic!("{e}"))
    }

    /// V-D10. The printed inertia has four digits; ours is the formula itself.
    #[test]
    fn mass_and_inertia_are_those_of_the_cube_however_many_spheres_fill_it() {
        for spheres in [1, 8, 64, 512, 4096, 22_232, 27_000] {
            let (rock, _) = rock(&cube(spheres));
            assert_eq!(rock.mass, 180.0);
            for moment in rock.inertia.iter() {
                assert!((moment / 5.043 - 1.0).abs() < 1e-12, "{moment}");
            }
            assert!((rock.reach - 0.355_070_416).abs() < 1e-9, "flush with the faces: {}", rock.reach);
        }
    }

    #[test]
    fn the_number_of_spheres_that_was_taken_is_printed_only_where_it_differs() {
        assert!(rock(&cube(64)).1.is_empty());
        let notices = rock(&cube(22_232)).1;
        assert!(notices[0].message.contains("28 x 28 x 28 = 21952"), "{notices:?}");
    }

    #[test]
    fn the_lowest_point_of_a_turned_cube_is_that_of_all_its_spheres() {
        let mut settings = cube(64);
        settings.orientation = [0.8, 0.3, -0.4, 0.2];
        settings.position = [1.0, 2.0, 3.0];
        let (rock, _) = rock(&settings);
        let motion = rock.start(&settings, Vector3::zeros());
        let down = Vector3::new(0.2, -0.5, -0.7).normalize();
        let every = rock
            .spheres
            .iter()
            .map(|s| (motion.position + motion.orientation * s.centre).dot(&down) + s.radius);
        let furthest = every.fold(f64::NEG_INFINITY, f64::max);
        assert!((rock.depth(&motion, &down) - furthest).abs() < 1e-14);
    }

    #[test]
    fn spin_and_energy_follow_from_the_angular_momentum() {
        let mut settings = cube(15);
        settings.shape = Shape::Box { size: [0.2, 0.4, 0.6] };
        settings.orientation = [0.9, 0.1, 0.3, -0.2];
        settings.angular_velocity = [1.0, -2.0, 3.0];
        let (rock, _) = rock(&settings);
        let motion = rock.start(&settings, Vector3::zeros());
        let spin = rock.spin(&motion);
        assert!((spin - Vector3::new(1.0, -2.0, 3.0)).norm() < 1e-14);
        let energy = 0.5 * spin.dot(&motion.angular_momentum);
        assert!((rock.kinetic_energy(&motion) / energy - 1.0).abs() < 1e-14);
    }
}
