//! Where the spheres of a scene start: each in its own cell of a lattice that fills the region, at a
//! random place within the room that is left there.

use super::rock::{RockSettings, Shape};
use super::spheres::SpheresSettings;
use dem_solid::cluster::index::SphereIndex;
use dem_solid::geometry::sphere::Sphere;
use dem_solid::random::SplitMix;
use interface_defs::diagnostic::Diagnostic;
use nalgebra::Vector3;
use std::f64::consts::PI;
use toolkit::scene::Scene;

/// What is constant of all spheres, and where they start.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Start {
    /// Radius [m].
    pub radius: Vec<f64>,
    /// Mass [kg].
    pub mass: Vec<f64>,
    /// Number of the table that made it.
    pub group: Vec<u16>,
    /// Centre [m].
    pub position: Vec<Vector3<f64>>,
    /// Velocity [m/s].
    pub velocity: Vec<Vector3<f64>>,
}

/// Three numbers from -1 to 1.
fn around_zero(random: &mut SplitMix) -> Vector3<f64> {
    Vector3::from_fn(|_, _| 2.0 * random.share() - 1.0)
}

/// Cells along each axis of the coarsest lattice that holds `count` spheres in a region of `size` [m],
/// and the width of a cell there; `None` if a cell would be narrower than `width` [m].
fn lattice(size: &Vector3<f64>, count: usize, width: f64) -> Option<([usize; 3], Vector3<f64>)> {
    let cells = |s: f64| [0, 1, 2].map(|a| ((size[a] / s * (1.0 + 1e-12)).floor() as usize).max(1));
    let room = |s: f64| cells(s).into_iter().map(|n| n as f64).product::<f64>();
    if room(width) < count as f64 {
        return None;
    }
    let (mut fits, mut too_wide) = (width, size.max());
    for _ in 0..60 {
        let middle = 0.5 * (fits + too_wide);
        if room(middle) >= count as f64 { fits = middle } else { too_wide = middle }
    }
    let n = cells(fits);
    Some((n, Vector3::from_fn(|a, _| size[a] / n[a] as f64)))
}

impl Start {
    /// The spheres of all tables, which have been checked.
    pub fn of(groups: &[SpheresSettings], scene: &Scene) -> Result<Self, Diagnostic> {
        let mut start = Self::default();
        for (number, group) in groups.iter().enumerate() {
            start.add(number, group).map_err(|room| {
                let (count, most) = (group.total(), group.radii()[1]);
                let what =
                    format!("{count} spheres of up to {most} m radius: the region has room for {room}");
                let key = format!("spheres.{number}.count");
                scene.invalid(&key, what).try_instead("fewer spheres, smaller ones or a larger region")
            })?;
        }
        Ok(start)
    }

    /// Add the spheres of table number `number`, which has been checked, from the bottom up. Errs with
    /// how many would fit if not all do.
    pub fn add(&mut self, number: usize, group: &SpheresSettings) -> Result<(), usize> {
        let mut random = SplitMix(group.seed);
        let mut push = |place: Vector3<f64>, radius: f64, scatter: Vector3<f64>| {
            self.position.push(place);
            self.velocity.push(Vector3::from(group.velocity) + scatter * group.velocity_scatter);
            self.radius.push(radius);
            self.mass.push(4.0 / 3.0 * PI * radius.powi(3) * group.density);
            self.group.push(number as u16);
        };
        if group.file.is_some() {
            for sphere in &group.read {
                push(sphere.centre, sphere.radius, around_zero(&mut random));
            }
            return Ok(());
        }
        let corner = |c: Option<[f64; 3]>| Vector3::from(c.expect("completed: a group has a region"));
        let (lowest, highest) = (corner(group.lowest), corner(group.highest));
        let ([least, most], count) = (group.radii(), group.total());
        let size = highest - lowest;
        let width = 2.0 * most;
        let Some((cells, cell)) = lattice(&size, count, width) else {
            return Err([0, 1, 2].into_iter().map(|a| (size[a] / width).floor() as usize).product());
        };
        for i in 0..count {
            let at = [i % cells[0], i / cells[0] % cells[1], i / (cells[0] * cells[1])];
            let middle = lowest + Vector3::from_fn(|a, _| (at[a] as f64 + 0.5) * cell[a]);
            let radius = least + (most - least) * random.share();
            let room = (cell * 0.5).add_scalar(-radius);
            let place = middle + room.component_mul(&around_zero(&mut random));
            push(place, radius, around_zero(&mut random));
        }
        Ok(())
    }

    /// Of the spheres that overlap at the start the two that do most: their numbers, and how deep in smaller radii.
    pub fn deepest(&self) -> Option<(usize, usize, f64)> {
        let sphere = |i: usize| Sphere { centre: self.position[i], radius: self.radius[i] };
        let spheres: Vec<Sphere> = (0..self.radius.len()).map(sphere).collect();
        let index = SphereIndex::new(&spheres);
        let mut worst: Option<(usize, usize, f64)> = None;
        for (i, a) in spheres.iter().enumerate() {
            for j in index.overlapping(a).into_iter().map(|k| index.place(k)).filter(|j| *j > i) {
                let b = &spheres[j];
                let overlap = a.radius + b.radius - (a.centre - b.centre).norm();
                let share = overlap / a.radius.min(b.radius);
                if worst.is_none_or(|w| share > w.2) {
                    worst = Some((i, j, share));
                }
            }
        }
        worst
    }
}

/// Add a rock for each sphere of the `groups` to `rocks`; for each the number of its table.
pub(super) fn as_rocks(
    groups: &[SpheresSettings],
    rocks: &mut Vec<RockSettings>,
    scene: &Scene,
) -> Result<Vec<u16>, Diagnostic> {
    for (number, group) in groups.iter().enumerate() {
        let known =
            rocks.iter().map(|rock| &rock.name).chain(groups[..number].iter().map(|other| &other.name));
        if known.into_iter().any(|name| *name == group.name) {
            let what = format!("`{}` is the name of a rock or of other spheres", group.name);
            return scene.refuse(&format!("spheres.{number}.name"), what, "give each a name of its own");
        }
    }
    let start = Start::of(groups, scene)?;
    let mut before = vec![0_usize; groups.len()];
    for k in 0..start.radius.len() {
        let group = &groups[usize::from(start.group[k])];
        let number = &mut before[usize::from(start.group[k])];
        *number += 1;
        rocks.push(RockSettings {
            name: format!("{}_{number}", group.name),
            material: group.material.clone(),
            position: start.position[k].into(),
            velocity: start.velocity[k].into(),
            orientation: [1.0, 0.0, 0.0, 0.0],
            angular_velocity: [0.0; 3],
            mass: None,
            density: Some(group.density),
            shape: Shape::Sphere { radius: start.radius[k] },
            cluster: None,
            scale: None,
        });
    }
    Ok(start.group)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn group(count: usize) -> SpheresSettings {
        SpheresSettings {
            name: "s".into(),
            material: "rock".into(),
            count: Some(count),
            radius: Some([0.02, 0.05]),
            file: None,
            read: Vec::new(),
            density: 1000.0,
            lowest: Some([0.0; 3]),
            highest: Some([1.0, 0.5, 2.0]),
            velocity: [0.0; 3],
            velocity_scatter: 1.0,
            seed: 7,
        }
    }

    #[test]
    fn spheres_are_placed_apart_and_inside_their_region() {
        for count in [1, 17, 500, 1000] {
            let mut start = Start::default();
            start.add(0, &group(count)).expect("10 x 5 x 20 fit");
            assert_eq!(start.position.len(), count);
            for (i, (x, r)) in start.position.iter().zip(&start.radius).enumerate() {
                assert!((0.02..=0.05).contains(r));
                let beyond = |a: usize, high: f64| x[a] - r < -1e-12 || x[a] + r > high + 1e-12;
                assert!(!beyond(0, 1.0) && !beyond(1, 0.5) && !beyond(2, 2.0), "{x}");
                let apart = |j: usize| (start.position[j] - x).norm() >= start.radius[j] + r - 1e-12;
                assert!((0..i).all(apart));
            }
        }
        assert_eq!(Start::default().add(0, &group(1001)), Err(1000));
    }
}
