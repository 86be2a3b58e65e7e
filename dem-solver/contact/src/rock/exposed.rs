//! How much of the surface of each sphere of a cluster lies outside all others.
//!
//! By points spread evenly over each sphere; the error of an area is about a hundredth of the sphere's.

use dem_solid::geometry::sphere::{Sphere, direction};
use dem_solid::geometry::sphere_tree::SphereTree;
use nalgebra::Vector3;

/// Points on each sphere.
const POINTS: usize = 256;

/// Exposed area of each sphere [m2]; 0 for one that lies inside others.
pub fn areas(spheres: &[Sphere]) -> Vec<f64> {
    let tree = SphereTree::new(spheres);
    let directions: Vec<_> = (0..POINTS).map(|i| direction(i, POINTS)).collect();
    let mut near = Vec::new();
    let area = |(number, sphere): (usize, &Sphere)| {
        let (lowest, highest) =
            (sphere.centre.add_scalar(-sphere.radius), sphere.centre.add_scalar(sphere.radius));
        near.clear();
        tree.near(&lowest, &highest, |k| near.push(k as usize));
        // Those that cover most first: most points are then covered by the first of them.
        let gap = |k: &usize| (spheres[*k].centre - sphere.centre).norm() - spheres[*k].radius;
        // Of equal spheres at one place the first shows the surface of all.
        if near.iter().any(|k| *k < number && spheres[*k] == *sphere) {
            return 0.0;
        }
        near.retain(|k| spheres[*k] != *sphere && gap(k) < sphere.radius);
        near.sort_by(|a, b| gap(a).total_cmp(&gap(b)).then(a.cmp(b)));
        let covered = |point: &Vector3<f64>| {
            let within = |k: &usize| {
                (spheres[*k].centre - point).norm_squared() < spheres[*k].radius * spheres[*k].radius
            };
            near.iter().any(within)
        };
        let free = directions.iter().filter(|d| !covered(&(sphere.centre + *d * sphere.radius))).count();
        4.0 * std::f64::consts::PI * sphere.radius * sphere.radius * free as f64 / POINTS as f64
    };
    spheres.iter().enumerate().map(area).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    fn sphere(x: f64, radius: f64) -> Sphere {
        Sphere { centre: Vector3::new(x, 0.0, 0.0), radius }
    }

    /// Two spheres of radius 1 a distance d apart: each keeps `2 pi (1 + d / 2)` of its surface.
    #[test]
    fn two_spheres_keep_the_caps_that_the_closed_form_says() {
        for apart in [0.2, 0.7, 1.5, 1.99, 2.5] {
            let areas = areas(&[sphere(0.0, 1.0), sphere(apart, 1.0)]);
            let exact = 2.0 * PI * (1.0 + f64::min(0.5 * apart, 1.0));
            for area in areas {
                assert!((area - exact).abs() < 0.015 * 4.0 * PI, "{apart}: {area} {exact}");
            }
        }
    }

    #[test]
    fn a_sphere_within_another_shows_nothing_and_of_equal_ones_one_shows_all() {
        let whole = 4.0 * PI;
        let found = areas(&[sphere(0.3, 0.5), sphere(0.0, 1.0)]);
        assert_eq!(found[0], 0.0);
        assert!((found[1] / whole - 1.0).abs() < 1e-12);
        let twice: f64 = areas(&[sphere(0.0, 1.0), sphere(0.0, 1.0)]).iter().sum();
        assert!((twice / whole - 1.0).abs() < 1e-12, "{twice}");
    }
}
