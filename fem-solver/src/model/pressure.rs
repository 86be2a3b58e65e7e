//! Pressure on triangles: it follows them, as a force on each corner of a third of pressure times area along the normal.
//!
//! ```text
//! f_a = p/6 n,   n = (b - a) x (c - a)          dn/da v = v x (b - c), and so on round the triangle
//! ```
//!
//! The stiffness of a single triangle is not symmetric; that of a surface is, but at its free edges, where the work of
//! pressure depends on the way. The solver takes the symmetric part.
//!
//! Source: Schweizerhof and Ramm (1984), Displacement dependent pressure loads in nonlinear finite element analyses,
//! Comput. Struct. 18, 1099.

use super::timed::{Face, TimedLoad};
use nalgebra::{Matrix3, Vector3};

/// Add the forces of `pressures` [Pa] on the faces of `loads` at the displacements `u` to `force` [N]. Returns the sum of
/// the squares of the forces on all corners [N2].
pub fn press(loads: &[TimedLoad], pressures: &[f64], u: &[f64], force: &mut [f64]) -> f64 {
    let mut squares = 0.0;
    for (load, pressure) in loads.iter().zip(pressures).filter(|(_, pressure)| **pressure != 0.0) {
        for face in &load.faces {
            let f = pressure / 6.0 * normal(&load.corners(face, u));
            squares += 3.0 * f.norm_squared();
            for node in face.nodes {
                for c in 0..3 {
                    force[c * load.node_count + node] += f[c];
                }
            }
        }
    }
    squares
}

/// Twice the area of a triangle along its normal [m2].
fn normal([a, b, c]: &[Vector3<f64>; 3]) -> Vector3<f64> {
    (b - a).cross(&(c - a))
}

/// What the pressure adds to the stiffness of a triangle, by rows: minus the derivative of its forces [N/m]. Local degrees
/// of freedom are x, y, z of one corner after the other.
pub fn face_tangent([a, b, c]: &[Vector3<f64>; 3], pressure: f64) -> [[f64; 9]; 9] {
    let columns = [c - b, a - c, b - a].map(|edge| -pressure / 6.0 * cross_matrix(&edge));
    let mut tangent = [[0.0; 9]; 9];
    for (row, entries) in tangent.iter_mut().enumerate() {
        for (column, entry) in entries.iter_mut().enumerate() {
            *entry = columns[column / 3][(row % 3, column % 3)];
        }
    }
    tangent
}

fn cross_matrix(v: &Vector3<f64>) -> Matrix3<f64> {
    Matrix3::new(0.0, -v.z, v.y, v.z, 0.0, -v.x, -v.y, v.x, 0.0)
}

/// Degrees of freedom of a face in a structure of so many nodes.
pub fn dofs_of_face(face: &Face, node_count: usize) -> [usize; 9] {
    std::array::from_fn(|i| (i % 3) * node_count + face.nodes[i / 3])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::support::Motion;

    fn load(corners: [[f64; 3]; 3]) -> TimedLoad {
        TimedLoad {
            factor: Motion::new(&[(0.0, 1.0)]).expect("is one row"),
            forces: Vec::new(),
            pressure: 1.0,
            faces: vec![Face { nodes: [0, 1, 2], corners: corners.map(Vector3::from) }],
            node_count: 3,
        }
    }

    const CORNERS: [[f64; 3]; 3] = [[0.1, -0.2, 0.3], [1.2, 0.4, 0.0], [0.3, 1.5, 0.7]];

    #[test]
    fn a_face_gets_pressure_times_area_along_its_normal() {
        let load = load([[0.0; 3], [2.0, 0.0, 0.0], [0.0, 3.0, 0.0]]);
        let mut force = vec![0.0; 9];
        press(&[load], &[6.0], &[0.0; 9], &mut force);
        assert_eq!(force, [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 6.0, 6.0, 6.0], "18 N along z");
    }

    #[test]
    fn the_stiffness_is_the_derivative_of_the_force() {
        let (load, pressure, step) = (load(CORNERS), 7.0, 1e-6);
        let u: Vec<f64> = (0..9).map(|i| 0.1 * f64::from(i).sin()).collect();
        let k = face_tangent(&load.corners(&load.faces[0], &u), pressure);
        let dofs = dofs_of_face(&load.faces[0], 3);
        for column in 0..9 {
            let force = |sign: f64| {
                let (mut at, mut force) = (u.clone(), vec![0.0; 9]);
                at[dofs[column]] += sign * step;
                press(std::slice::from_ref(&load), &[pressure], &at, &mut force);
                force
            };
            let (ahead, behind) = (force(1.0), force(-1.0));
            for row in 0..9 {
                let slope = -(ahead[dofs[row]] - behind[dofs[row]]) / (2.0 * step);
                assert!((k[row][column] - slope).abs() < 1e-8, "{row} {column}: {} {slope}", k[row][column]);
            }
        }
    }
}
