//! The volume that all spheres fill together, compared with that of the solid.
//!
//! Along columns both are exact (chords of the spheres joined, crossings of the
//! triangles); over the columns a midpoint rule, the same for both, so that its error cancels for the larger part. The columns are
//! parallel to no face or edge that a symmetric solid has: there the rule would count whole columns or none.

use crate::geometry::bounds;
use crate::geometry::sphere::Sphere;
use crate::shape::Surface;
use nalgebra::{Rotation3, Vector3};

/// Place of a column in its cell.
const PLACE: [f64; 2] = [0.513_7, 0.489_1];

/// Turn of the solid before columns along z are taken [rad].
const TURN: [f64; 3] = [0.41, 0.73, 1.19];

/// Volume of all spheres together over that of the solid inside `surface`, minus 1; with so many
/// columns along x and along y.
pub fn excess(surface: &Surface, spheres: &[Sphere], columns: usize) -> f64 {
    let turn = Rotation3::from_euler_angles(TURN[0], TURN[1], TURN[2]);
    let turned = Surface {
        points: surface.points.iter().map(|p| turn * p).collect(),
        triangles: surface.triangles.clone(),
    };
    let spheres: Vec<Sphere> =
        spheres.iter().map(|s| Sphere { centre: turn * s.centre, radius: s.radius }).collect();
    along_z(&turned, &spheres, columns)
}

fn along_z(surface: &Surface, spheres: &[Sphere], columns: usize) -> f64 {
    let corners = spheres.iter().flat_map(|s| [-s.radius, s.radius].map(|r| s.centre.add_scalar(r)));
    let [lowest, highest] = bounds(surface.points.iter().copied().chain(corners));
    let step = (highest - lowest) / columns as f64;
    let place = |axis: usize, k: usize| lowest[axis] + (k as f64 + PLACE[axis]) * step[axis];
    // Columns of a row from one place along x to another.
    let range = |from: f64, to: f64| {
        let at = |x: f64| ((x - lowest.x) / step.x - PLACE[0]).ceil().clamp(0.0, columns as f64) as usize;
        at(from)..at(to)
    };
    let (mut filled, mut solid) = (0.0, 0.0);
    let mut chords: Vec<Vec<(f64, f64)>> = vec![Vec::new(); columns];
    for row in 0..columns {
        let y = place(1, row);
        chords.iter_mut().for_each(Vec::clear);
        for s in spheres {
            let square = s.radius * s.radius - (y - s.centre.y).powi(2);
            if square <= 0.0 {
                continue;
            }
            let half = square.sqrt();
            for k in range(s.centre.x - half, s.centre.x + half) {
                let chord = (square - (place(0, k) - s.centre.x).powi(2)).max(0.0).sqrt();
                chords[k].push((s.centre.z - chord, s.centre.z + chord));
            }
        }
        for column in &mut chords {
            filled += joined(column);
        }
        for t in 0..surface.triangles.len() {
            let corners = surface.corners(t);
            let Some((from, to)) = section(&corners, y) else { continue };
            let (a, b) = if from.x <= to.x { (from, to) } else { (to, from) };
            // Upwards or downwards: the sign of the triangle as seen along z.
            let up = (corners[1] - corners[0]).cross(&(corners[2] - corners[0])).z.signum();
            for k in range(a.x, b.x) {
                solid += up * (a.z + (b.z - a.z) * ((place(0, k) - a.x) / (b.x - a.x)));
            }
        }
    }
    filled / solid - 1.0
}

/// Length of all chords joined.
fn joined(chords: &mut [(f64, f64)]) -> f64 {
    chords.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (mut length, mut end) = (0.0, f64::NEG_INFINITY);
    for (from, to) in chords {
        if *to > end {
            length += *to - from.max(end);
            end = *to;
        }
    }
    length
}

/// The segment in which a triangle cuts the plane of this y.
fn section(corners: &[Vector3<f64>; 3], y: f64) -> Option<(Vector3<f64>, Vector3<f64>)> {
    let mut ends = (0..3).map(|k| (corners[k], corners[(k + 1) % 3])).filter(|(a, b)| (a.y < y) != (b.y < y));
    let mut end = || ends.next().map(|(a, b)| a + (b - a) * ((y - a.y) / (b.y - a.y)));
    Some((end()?, end()?))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shape::builtin;
    use std::f64::consts::PI;

    /// One sphere, two that overlap, two that do not: closed forms. Midpoint rule over 256 columns:
    /// at the rim chords end like a root, which leaves about 256^-1.5 = 2e-4.
    #[test]
    fn the_volume_of_spheres_together_counts_nothing_twice() {
        let surface = builtin::cuboid(Vector3::repeat(1.0));
        let ball = |x: f64| Sphere { centre: Vector3::new(x, 0.0, 0.0), radius: 0.5 };
        let one = 4.0 / 3.0 * PI * 0.125;
        // Lens of two spheres of radius r at distance d: pi (4r + d) (2r - d)^2 / 12.
        let lens = PI * (2.0 + 0.4) * 0.6_f64.powi(2) / 12.0;
        for (spheres, exact) in [
            (vec![ball(0.0)], one),
            (vec![ball(0.0), ball(0.4)], 2.0 * one - lens),
            (vec![ball(0.0), ball(1.1), ball(0.0)], 2.0 * one),
        ] {
            let found = excess(&surface, &spheres, 256) + 1.0;
            assert!((found / exact - 1.0).abs() < 1e-3, "{found} {exact}");
        }
    }

    #[test]
    fn spheres_on_their_own_polyhedron_lack_what_the_polyhedron_lacks() {
        let surface = builtin::ellipsoid(Vector3::repeat(0.5), 5);
        let sphere = Sphere { centre: Vector3::zeros(), radius: 0.5 };
        let lack = 4.0 / 3.0 * PI * 0.125 / crate::shape::SolidIntegrals::of(&surface).volume - 1.0;
        assert!((excess(&surface, &[sphere], 256) - lack).abs() < 2e-4, "{lack}");
    }
}
