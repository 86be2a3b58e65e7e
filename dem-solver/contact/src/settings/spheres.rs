//! `[[spheres]]` and `[box]`: many separate spheres, and the sides around them and around rocks.

use super::rock::absolute;
use crate::keys::{Checked, Keys};
use dem_solid::cluster::files;
use dem_solid::geometry::sphere::Sphere;
use dem_solid::input::{LARGEST, read_bytes};
use nalgebra::Vector3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;
use toolkit::scene::Scene;

/// Most spheres of a scene.
pub const MAX_SPHERES: usize = 10_000_000;

/// Separate spheres that differ in radius and place. Beside rocks, terrain or a structure each of them is a rock of its own.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SpheresSettings {
    /// Name. Default `spheres`, for further ones `spheres_2`, ...
    #[serde(default)]
    pub name: String,
    /// Name of their material, for `[[contact]] between`. Default `rock`.
    #[serde(default = "super::rock::rock_material")]
    pub material: String,
    /// How many; with `radius`, or `file` in place of both.
    pub count: Option<usize>,
    /// Smallest and largest radius [m]; in between all are equally likely.
    pub radius: Option<[f64; 2]>,
    /// In place of `count`, `radius` and a region: a text file with one sphere per line, `x y z r` in metres; relative to the
    /// scene file.
    pub file: Option<PathBuf>,
    /// The spheres of the file.
    #[serde(skip)]
    pub read: Vec<Sphere>,
    /// Density [kg/m3].
    pub density: f64,
    /// Lowest corner of the region that they are placed in [m]. Default: the box.
    pub lowest: Option<[f64; 3]>,
    /// Highest corner of that region [m]. Default: the box.
    pub highest: Option<[f64; 3]>,
    /// Velocity [m/s]. Default 0.
    #[serde(default)]
    pub velocity: [f64; 3],
    /// Largest deviation of each component of the velocity from that [m/s], all equally likely. Default 0.
    #[serde(default)]
    pub velocity_scatter: f64,
    /// Seed of radii, places and velocities: equal seeds, equal spheres. Default 1.
    #[serde(default = "one")]
    pub seed: u64,
}

/// Six fixed planes, inside of which rocks and separate spheres are.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BoxSettings {
    /// Lowest corner [m].
    pub lowest: [f64; 3],
    /// Highest corner [m].
    pub highest: [f64; 3],
    /// Sides that are left out: `-x`, `+x`, `-y`, `+y`, `-z`, `+z`. Default none. The others are planes without end: what leaves
    /// through an open side is still above the floor.
    #[serde(default)]
    pub open: Vec<String>,
    /// Name of its material. Default `wall`.
    #[serde(default = "wall")]
    pub material: String,
}

/// A plane with all spheres on one side: `normal . x = offset` on it, the normal points out of the room.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plane {
    /// Unit vector out of the room.
    pub normal: Vector3<f64>,
    /// Distance of the plane from the origin along it [m].
    pub offset: f64,
}

/// Names of the sides of a box, by axis, lower first.
pub const SIDES: [&str; 6] = ["-x", "+x", "-y", "+y", "-z", "+z"];

fn wall() -> String {
    "wall".into()
}

fn one() -> u64 {
    1
}

/// A sphere may reach so far beyond a plane at the start, in radii: it lies on it, as in a packing at rest.
const RESTING: f64 = 0.1;

impl BoxSettings {
    /// The side of the box beyond which a sphere reaches, and by how much [m].
    fn left_by(&self, sphere: &Sphere) -> Option<(&'static str, f64)> {
        let sides = (0..3).flat_map(|axis| {
            let c = sphere.centre[axis];
            let (low, high) =
                (self.lowest[axis] - (c - sphere.radius), c + sphere.radius - self.highest[axis]);
            [(SIDES[2 * axis], low), (SIDES[2 * axis + 1], high)]
        });
        let closed = |(side, _): &(&str, f64)| !self.open.iter().any(|open| open == side);
        sides.filter(closed).find(|(_, by)| *by > RESTING * sphere.radius)
    }

    /// The planes of the sides that are closed.
    pub fn planes(&self) -> Vec<Plane> {
        let plane = |(number, side): (usize, &&str)| {
            let axis = number / 2;
            let upper = number % 2 == 1;
            let mut normal = Vector3::zeros();
            normal[axis] = if upper { 1.0 } else { -1.0 };
            let offset = if upper { self.highest[axis] } else { -self.lowest[axis] };
            (!self.open.iter().any(|open| open == side)).then_some(Plane { normal, offset })
        };
        SIDES.iter().enumerate().filter_map(plane).collect()
    }

    /// Furthest that anything can fall along `down` (a unit vector) inside the box [m]; infinite where a side is open.
    pub fn height(&self, down: &Vector3<f64>) -> f64 {
        if !self.open.is_empty() {
            return f64::INFINITY;
        }
        let size = Vector3::from(self.highest) - Vector3::from(self.lowest);
        size.component_mul(down).abs().sum()
    }

    /// Refuse what makes no sense.
    pub(super) fn check(&self, scene: &Scene) -> Checked {
        let keys = Keys::of(scene, "box");
        if let Some(axis) = (0..3).find(|a| self.highest[*a] <= self.lowest[*a]) {
            let what = format!("the box reaches from {} to {} m", self.lowest[axis], self.highest[axis]);
            let cure = "exchange them: `lowest` is the corner with the smaller numbers";
            keys.refuse(true, "highest", what, cure)?;
        }
        for (at, side) in self.open.iter().enumerate() {
            let cure = format!("its sides are {}", SIDES.join(", "));
            let known = SIDES.contains(&side.as_str());
            keys.refuse(!known, "open", format!("a box has no side `{side}`"), cure)?;
            let what = format!("the side `{side}` is named twice");
            keys.refuse(self.open[..at].contains(side), "open", what, "name each side once")?;
        }
        let what = "all six sides are open: there is no box";
        let cure = "leave [box] out, and give [[spheres]] a region with lowest and highest";
        keys.refuse(self.open.len() == SIDES.len(), "open", what, cure)
    }
}

impl SpheresSettings {
    /// How many there are.
    pub fn total(&self) -> usize {
        if self.file.is_some() { self.read.len() } else { self.count.unwrap_or_default() }
    }

    /// Smallest and largest radius [m].
    pub fn radii(&self) -> [f64; 2] {
        let read = || {
            let radii = self.read.iter().map(|s| s.radius);
            radii.fold([f64::INFINITY, 0.0], |[low, high], r| [r.min(low), r.max(high)])
        };
        self.radius.unwrap_or_else(read)
    }
}

/// Fill in names and regions, read files; refuse what makes no sense.
pub(super) fn complete(all: &mut [SpheresSettings], sides: Option<&BoxSettings>, scene: &Scene) -> Checked {
    let mut total = 0_usize;
    for (at, group) in all.iter_mut().enumerate() {
        let keys = Keys::of(scene, format!("spheres.{at}"));
        if group.name.is_empty() {
            group.name = if at == 0 { "spheres".into() } else { format!("spheres_{}", at + 1) };
        }
        keys.above_zero(&[("density", Some(group.density), " kg/m3")])?;
        keys.not_negative(&[("velocity_scatter", Some(group.velocity_scatter), " m/s")])?;
        if group.file.is_some() {
            read(group, MAX_SPHERES - total, sides, scene, &keys)?;
        } else {
            place(group, total, sides, &keys)?;
        }
        total += group.total();
    }
    Ok(())
}

/// Read the spheres of a table, at most so many, and see that they lie in the box.
fn read(
    group: &mut SpheresSettings,
    most: usize,
    sides: Option<&BoxSettings>,
    scene: &Scene,
    keys: &Keys,
) -> Checked {
    keys.beside_file(
        &format!("the spheres of `{}` are", group.name),
        &[
            ("count", group.count.is_some()),
            ("radius", group.radius.is_some()),
            ("lowest", group.lowest.is_some()),
            ("highest", group.highest.is_some()),
        ],
    )?;
    let Some(file) = &mut group.file else { return Ok(()) };
    *file = absolute(file, scene);
    let spheres = read_bytes(file, LARGEST)
        .and_then(|bytes| files::read_at_most(&bytes, most).map_err(|e| e.in_file(file)))
        .map_err(|e| keys.invalid("file", format!("`{}`: {e}", group.name)))?;
    let left = |(k, sphere)| Some((k, sphere, sides?.left_by(sphere)?));
    if let Some((k, sphere, (side, by))) = spheres.iter().enumerate().find_map(left) {
        let ([x, y, z], radius): ([f64; 3], f64) = (sphere.centre.into(), sphere.radius);
        let what = format!(
            "sphere {} of {} ({x} {y} {z}, radius {radius} m) reaches {by:.3e} m beyond the side `{side}` of the box",
            k + 1,
            spheres.len(),
        );
        keys.refuse(true, "file", what, "make the box larger, or leave this side open")?;
    }
    group.read = spheres;
    Ok(())
}

/// Check number, radii and region of a table, before which there are `before` spheres, and fill in the region.
fn place(group: &mut SpheresSettings, before: usize, sides: Option<&BoxSettings>, keys: &Keys) -> Checked {
    let absent = |key: &str, example: &str| {
        keys.invalid(key, format!("`{}` has no `{key}`", group.name))
            .try_instead(format!("add {example}, or read spheres with file = \"spheres.xyzr\""))
    };
    let count = group.count.ok_or_else(|| absent("count", "count = 1000"))?;
    let [least, most] = group.radius.ok_or_else(|| absent("radius", "radius = [0.01, 0.02]"))?;
    let total = before.saturating_add(count);
    let what = format!("{total} spheres in all: 1 to {MAX_SPHERES} are possible");
    keys.refuse(count == 0 || total > MAX_SPHERES, "count", what, "")?;
    let what = format!("radii from {least} to {most} m: both must lie above 0, the smaller first");
    let cure = format!("radius = [{}, {}]", least.min(most).abs(), least.max(most).abs());
    keys.refuse(!(least > 0.0 && most >= least), "radius", what, cure)?;
    let missing = |key: &str| {
        keys.invalid("count", format!("`{}` has no `{key}`, and there is no [box]", group.name))
            .try_instead("give the region with lowest and highest, or add a table [box]")
    };
    let lowest = group.lowest.or(sides.map(|b| b.lowest)).ok_or_else(|| missing("lowest"))?;
    let highest = group.highest.or(sides.map(|b| b.highest)).ok_or_else(|| missing("highest"))?;
    let room = (0..3).map(|a| highest[a] - lowest[a]).find(|room| *room < 2.0 * most);
    if let Some(room) = room {
        let what = format!("the region is {room} m wide, a sphere {} m", 2.0 * most);
        keys.refuse(true, "radius", what, "lengths are in metres: 9 mm is 0.009")?;
    }
    (group.lowest, group.highest) = (Some(lowest), Some(highest));
    Ok(())
}
