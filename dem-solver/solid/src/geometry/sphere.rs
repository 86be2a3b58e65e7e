//! Spheres, the box around some of them, points spread evenly over one.

use nalgebra::Vector3;

/// A sphere.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sphere {
    /// Centre; of a rock's own from its centre of mass, in the rock's own frame [m].
    pub centre: Vector3<f64>,
    /// Radius [m].
    pub radius: f64,
}

/// Edges of the box around some spheres [m].
pub fn extent(spheres: impl Iterator<Item = (Vector3<f64>, f64)>) -> [f64; 3] {
    let corners = spheres.flat_map(|(centre, radius)| [-radius, radius].map(|r| centre.add_scalar(r)));
    let [low, high] = super::bounds(corners);
    (high - low).into()
}

/// Point `number` of `count` that are spread evenly over a sphere of radius 1.
pub fn direction(number: usize, count: usize) -> Vector3<f64> {
    let z = 1.0 - (2 * number + 1) as f64 / count as f64;
    let turn = std::f64::consts::PI * (3.0 - 5.0_f64.sqrt()) * number as f64;
    let across = (1.0 - z * z).sqrt();
    Vector3::new(across * turn.cos(), across * turn.sin(), z)
}

/// Eight directions at the angle `turn` [rad] from `along`.
pub fn around(along: &Vector3<f64>, turn: f64) -> [Vector3<f64>; 8] {
    let side = along.cross(&Vector3::ith(along.iamin(), 1.0)).normalize();
    let other = along.cross(&side);
    std::array::from_fn(|k| {
        let angle = k as f64 * std::f64::consts::FRAC_PI_4;
        along * turn.cos() + (side * angle.cos() + other * angle.sin()) * turn.sin()
    })
}
