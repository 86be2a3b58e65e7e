//! The membrane with four corners: bilinear, total Lagrangian, 2 x 2 points, the materials of the triangle.
//!
//! ```text
//! N_I = (1 + r r_I)(1 + s s_I) / 4      x(r, s) = sum_I x_I N_I
//! ```
//!
//! At each of the four Gauss points the plane that touches the surface there, as modelled, has axes of its own, the first as
//! near to `along` as the plane allows: a warped quadrilateral is a warped surface. Strain, tension field and fibres are those
//! of [`super::membrane`], point by point; four points leave no motion without stiffness in the plane of what is taut.
//!
//! Source: Zienkiewicz and Taylor (2005), The Finite Element Method 1, chapters 4 and 5 (bilinear, quadrature).

use super::membrane::{Fabric, MembranePoint, Sheet, axes};
use nalgebra::{Matrix2, Vector2, Vector3};

/// Corners in the plane of `r` and `s`.
const CORNERS: [[f64; 2]; 4] = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];

/// A quadrilateral of membrane.
pub type MembraneQuad = Sheet<4, 4>;

/// Shape functions and their slopes at `(r, s)`.
fn shape(r: f64, s: f64) -> ([f64; 4], [Vector2<f64>; 4]) {
    (
        CORNERS.map(|[a, b]| 0.25 * (1.0 + a * r) * (1.0 + b * s)),
        CORNERS.map(|[a, b]| 0.25 * Vector2::new(a * (1.0 + b * s), b * (1.0 + a * r))),
    )
}

/// Directions of `r` and `s` on the surface with these corners.
fn directions(x: &[Vector3<f64>; 4], slopes: &[Vector2<f64>; 4]) -> [Vector3<f64>; 2] {
    [0, 1].map(|c: usize| x.iter().zip(slopes).map(|(x, slope)| slope[c] * x).sum())
}

impl MembraneQuad {
    /// The quadrilateral of these nodes at `x`, of a thickness [m] and density [kg/m3]. `None` where it is not convex, has no
    /// area, or `along` is normal to it.
    pub fn new(
        nodes: [usize; 4],
        x: &[Vector3<f64>; 4],
        along: &Vector3<f64>,
        thickness: f64,
        density: f64,
        fabric: Fabric,
    ) -> Option<Self> {
        let normal = (x[2] - x[0]).cross(&(x[3] - x[1]));
        let size = (x[2] - x[0]).norm_squared() + (x[3] - x[1]).norm_squared();
        let convex = CORNERS.iter().all(|[r, s]| {
            let [a, b] = directions(x, &shape(*r, *s).1);
            a.cross(&b).dot(&normal) > 1e-9 * size * normal.norm()
        });
        if !convex {
            return None;
        }
        let mut lumped = [0.0; 4];
        let mut points = CORNERS.iter().map(|corner| {
            let [r, s] = corner.map(|c| c / 3.0_f64.sqrt());
            let (shape, slopes) = shape(r, s);
            let [a, b] = directions(x, &slopes);
            let (area, unit) = (a.cross(&b).norm(), a.cross(&b).normalize());
            let axes = axes(&unit, along)?;
            // dN/dr = J^T dN/dX with J_ac = A_a . dX/dr_c.
            let turned = Matrix2::from_fn(|c, k| axes[k].dot(&[a, b][c])).try_inverse()?;
            lumped.iter_mut().zip(shape).for_each(|(m, n)| *m += density * thickness * area * n);
            Some(MembranePoint { axes, slopes: slopes.map(|slope| turned * slope), area })
        });
        let points = Box::new([points.next()??, points.next()??, points.next()??, points.next()??]);
        Some(Self { nodes, points, thickness, lumped, fabric })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::element::Element;
    use crate::element::tests::checks::{Case, patch, random};
    use nalgebra::UnitQuaternion;

    const PLACES: [[f64; 3]; 4] = [[0.1, 0.0, 0.2], [1.2, 0.3, 0.1], [1.0, 1.4, 0.0], [-0.1, 1.1, 0.15]];

    fn of(x: &[Vector3<f64>; 4], nodes: [usize; 4], fabric: Fabric) -> MembraneQuad {
        MembraneQuad::new(nodes, x, &Vector3::x(), 0.002, 900.0, fabric).expect("is convex")
    }

    fn isotropic(prestress: [f64; 3], wrinkles: bool) -> Fabric {
        Fabric::Isotropic { young: 2e8, poisson: 0.3, prestress, wrinkles }
    }

    #[test]
    fn derivatives_rigid_motions_and_mass_are_consistent() {
        let places = PLACES.map(Vector3::from);
        let fibres = Fabric::Fibres {
            directions: [Vector2::new(0.8, 0.6), Vector2::new(-0.6, 0.8)],
            young: [3e8, 1e8],
            prestress: [1e6, -2e6],
            shear: 1e6,
        };
        let mut noise = random(12);
        for fabric in
            [isotropic([0.0; 3], false), isotropic([0.0; 3], true), isotropic([1e6, 2e6, 3e5], true), fibres]
        {
            let quad = of(&places, [0, 1, 2, 3], fabric);
            for _ in 0..30 {
                let u: Vec<f64> = (0..12).map(|_| 0.2 * noise()).collect();
                Case::new(&quad, &places, &u)
                    .check_all(1.8 * quad.points.iter().map(|p| p.area).sum::<f64>());
            }
        }
    }

    #[test]
    fn a_patch_of_any_quadrilaterals_carries_a_uniform_strain() {
        // MacNeal and Harder's patch: a rectangle with four nodes inside, turned out of the axes.
        let turn = UnitQuaternion::new(Vector3::new(0.3, -0.5, 0.2));
        let flat = [
            [0.0, 0.0],
            [0.24, 0.0],
            [0.24, 0.12],
            [0.0, 0.12],
            [0.04, 0.02],
            [0.18, 0.03],
            [0.16, 0.08],
            [0.08, 0.08],
        ];
        let places = flat.map(|[x, y]| turn * Vector3::new(x, y, 0.0));
        let cells = [[0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7], [4, 5, 6, 7]];
        let quads = cells.map(|nodes| of(&nodes.map(|n| places[n]), nodes, isotropic([0.0; 3], true)));
        // Large: stretched by 1.2 and 1.1 and sheared, then turned.
        let u: Vec<f64> = flat
            .iter()
            .zip(&places)
            .flat_map(|([x, y], at)| {
                <[f64; 3]>::from(turn * turn * Vector3::new(1.2 * x + 0.1 * y, 1.1 * y, 0.0) - at)
            })
            .collect();
        let all: Vec<&dyn Element> = quads.iter().map(|quad| quad as &dyn Element).collect();
        let left = patch(&all, &u, &[UnitQuaternion::identity(); 8], &[4, 5, 6, 7]);
        assert!(left < 1e-12, "{left}");
        // Green-Lagrange strain of that, and the stress by hand, in every one of them.
        let (e11, e22, e12) = (0.22, 0.5 * (0.01 + 1.21 - 1.0), 0.5 * 1.2 * 0.1);
        let k = 2e8 / 0.91;
        let (s11, s22, s12) = (k * (e11 + 0.3 * e22), k * (e22 + 0.3 * e11), k * 0.7 * e12);
        let radius = f64::hypot(0.5 * (s11 - s22), s12);
        for (quad, nodes) in quads.iter().zip(cells) {
            let own: Vec<f64> = nodes.iter().flat_map(|n| u[3 * n..3 * n + 3].to_vec()).collect();
            let [first, second] = quad.face_stresses(&own);
            let mean = 0.5 * (s11 + s22);
            assert!((first / (mean + radius) - 1.0).abs() < 1e-12, "{first}");
            assert!((second / (mean - radius) - 1.0).abs() < 1e-12, "{second}");
        }
    }

    #[test]
    fn what_is_bent_in_its_plane_is_softer_than_two_triangles() {
        // Pure bending of a square: u_x = x y, u_y = -(x^2) / 2 at its corners, small. Exact: E t I k^2 / 2.
        let square =
            [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]].map(|[x, y]| Vector3::new(x, y, 0.0));
        let quad = of(&square, [0, 1, 2, 3], isotropic([0.0; 3], false));
        let bend = 1e-6;
        let u: Vec<f64> =
            square.iter().flat_map(|p| [bend * p.x * p.y, -0.5 * bend * p.x * p.x, 0.0]).collect();
        let energy = quad.energy(&u, &[]).stored;
        // The bilinear element under bending: the shear that it cannot avoid makes it stiffer by the known factor
        // (1 / (1 - nu)) (1 + (1 - nu) / 2) / (1 + nu) of a square.
        let exact = 0.5 * 2e8 * 0.002 * (16.0 / 12.0) * bend * bend;
        let factor = (1.0 / (1.0 - 0.09)) * (1.0 + 0.5 * 0.7);
        assert!((energy / exact / factor - 1.0).abs() < 1e-4, "{} {factor}", energy / exact);
    }

    #[test]
    fn what_is_not_convex_or_has_no_area_is_no_quadrilateral() {
        let x = Vector3::x();
        let of = |corners: [[f64; 2]; 4]| {
            let corners = corners.map(|[x, y]| Vector3::new(x, y, 0.0));
            MembraneQuad::new([0, 1, 2, 3], &corners, &x, 0.002, 900.0, isotropic([0.0; 3], true))
        };
        assert!(of([[0.0, 0.0], [1.0, 0.0], [0.2, 0.2], [0.0, 1.0]]).is_none());
        assert!(of([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]]).is_none());
        assert!(of([[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [3.0, 0.0]]).is_none());
        assert!(of([[0.0, 0.0], [1.0, 0.0], [1.2, 1.3], [0.0, 1.0]]).is_some());
    }
}
