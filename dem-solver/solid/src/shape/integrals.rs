//! Exact integrals over the solid that a closed surface encloses.
//!
//! A sum over the tetrahedra (o, a, b, c) of all triangles, with `o` in the middle of the surface so
//! that a solid far from the origin loses no digits: `V = a.(b x c) / 6`, first moment
//! `V (a + b + c) / 4`, second moment `V / 20 (a a' + b b' + c c' + s s')` with `s = a + b + c`.
//!
//! Source: Tonon (2005), J. Math. Stat. 1, 8; Mirtich (1996), J. Graphics Tools 1, 31.

use super::surface::Surface;
use nalgebra::{Matrix3, Rotation3, SymmetricEigen, Vector3};

/// What a solid of density 1 kg/m3 weighs and how it resists rotation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SolidIntegrals {
    /// Volume [m3]; negative if the triangles face inwards.
    pub volume: f64,
    /// Centre of mass [m].
    pub centre: Vector3<f64>,
    /// Principal moments of inertia about the centre over the mass [m2].
    pub gyration: Vector3<f64>,
    /// From the principal axes to the axes in which the surface is given.
    pub axes: Rotation3<f64>,
}

/// A tensor whose products of inertia are below this share of its trace has the given axes as
/// principal axes: what is left is rounding, and would turn a symmetric solid by any angle.
const DIAGONAL: f64 = 1e-10;

impl SolidIntegrals {
    /// Of the solid inside `surface`.
    pub fn of(surface: &Surface) -> Self {
        let (lowest, highest) = surface.bounds();
        let origin = (lowest + highest) / 2.0;
        let (mut volume, mut first, mut second) = (0.0, Vector3::zeros(), Matrix3::zeros());
        for triangle in 0..surface.triangles.len() {
            let [a, b, c] = surface.corners(triangle).map(|p| p - origin);
            let part = a.dot(&b.cross(&c)) / 6.0;
            let sum = a + b + c;
            volume += part;
            first += sum * (part / 4.0);
            let squares = a * a.transpose() + b * b.transpose() + c * c.transpose() + sum * sum.transpose();
            second += squares * (part / 20.0);
        }
        let centre = first / volume;
        let spread = second / volume - centre * centre.transpose();
        let tensor = Matrix3::identity() * spread.trace() - spread;
        let (gyration, axes) = principal(tensor);
        Self { volume, centre: origin + centre, gyration, axes }
    }
}

/// Principal moments and axes of a symmetric tensor, right-handed; the given axes where they are principal.
fn principal(tensor: Matrix3<f64>) -> (Vector3<f64>, Rotation3<f64>) {
    let off = tensor.m12.abs().max(tensor.m13.abs()).max(tensor.m23.abs());
    if off <= DIAGONAL * tensor.trace() {
        return (tensor.diagonal(), Rotation3::identity());
    }
    let eigen = SymmetricEigen::new(tensor);
    // Ascending, each axis with its largest component positive: one answer whatever the solver's order.
    let mut order = [0, 1, 2];
    order.sort_by(|a, b| eigen.eigenvalues[*a].total_cmp(&eigen.eigenvalues[*b]));
    let axis = |k: usize| {
        let v = eigen.eigenvectors.column(order[k]).into_owned().normalize();
        if v[v.iamax()] < 0.0 { -v } else { v }
    };
    let (x, y) = (axis(0), axis(1));
    let axes = Matrix3::from_columns(&[x, y, x.cross(&y)]);
    (order.map(|k| eigen.eigenvalues[k]).into(), Rotation3::from_matrix_unchecked(axes))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shape::builtin;

    /// A box, turned and moved far away: the formula's moments, its centre, its axes.
    /// The corners are rounded at 2.6e6 m to 4e-10 m, which is 1e-9 of the shortest edge.
    #[test]
    fn a_turned_box_far_away_has_its_own_moments_and_axes() {
        let size = Vector3::new(0.4, 0.7, 1.1);
        let turn = Rotation3::from_euler_angles(0.3, -0.8, 1.9);
        let shift = Vector3::new(2.6e6, 1.1e6, 1800.0);
        for (shift, exact) in [(Vector3::zeros(), 1e-13), (shift, 1e-8)] {
            let mut surface = builtin::cuboid(size);
            for p in &mut surface.points {
                *p = turn * *p + shift;
            }
            let body = SolidIntegrals::of(&surface);
            assert!((body.volume / (0.4 * 0.7 * 1.1) - 1.0).abs() < exact);
            assert!((body.centre - shift).norm() < 1e-9);
            let square = size.component_mul(&size) / 12.0;
            let mut expected = [square.y + square.z, square.x + square.z, square.x + square.y];
            expected.sort_by(f64::total_cmp);
            for (moment, expected) in body.gyration.iter().zip(expected) {
                assert!((moment / expected - 1.0).abs() < exact, "{moment} {expected}");
            }
            assert!((body.axes.matrix().determinant() - 1.0).abs() < 1e-12);
            // Smallest moment about the longest edge.
            let longest = turn * Vector3::z();
            assert!(body.axes.matrix().column(0).dot(&longest).abs() > 1.0 - 1e-7);
        }
    }

    /// V-D10: the cube of 180 kg.
    #[test]
    fn the_cube_of_the_drop_test_keeps_its_axes() {
        let body = SolidIntegrals::of(&builtin::cuboid(Vector3::repeat(0.41)));
        assert_eq!(body.axes, Rotation3::identity());
        assert!((180.0 / body.volume - 2_611.685_84).abs() < 1e-5);
        for moment in body.gyration.iter() {
            assert!((180.0 * moment / 5.043 - 1.0).abs() < 1e-12);
        }
    }
}
