//! Rotations of nodes, as elements with rotations keep them in their history.
//!
//! A degree of freedom of rotation grows by the increments of the rotation vector in space. A node's rotation is
//! `exp(u - u_0) R_0` with `u_0` and the quaternion `R_0` of the last committed state, hence never near the
//! singularity at a full turn. The local degrees of freedom of a node are x, y, z, then the three of its rotation.

use super::segment::vector;
use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};

/// Numbers of one node in the history: the vector at the last commit, the quaternion there.
pub const TURN: usize = 7;

/// A node that has not turned.
pub const START: [f64; TURN] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0];

/// Rotation of node number `node` of an element whose history begins with those of its nodes.
pub fn rotation(u: &[f64], history: &[f64], node: usize) -> UnitQuaternion<f64> {
    let h = &history[node * TURN..][..TURN];
    let step = vector(u, 6 * node + 3) - Vector3::new(h[0], h[1], h[2]);
    let before = UnitQuaternion::new_unchecked(Quaternion::new(h[3], h[4], h[5], h[6]));
    UnitQuaternion::new(step) * before
}

/// Write the rotations of the first `nodes` nodes at `u` into `to`, which may be committed.
pub fn settle(u: &[f64], history: &[f64], nodes: usize, to: &mut [f64]) {
    for node in 0..nodes {
        let now = rotation(u, history, node);
        let to = &mut to[node * TURN..][..TURN];
        to[..3].copy_from_slice(&u[6 * node + 3..6 * node + 6]);
        // Products of unit quaternions drift from 1 by rounding.
        let q = now.quaternion().normalize();
        to[3..].copy_from_slice(&[q.w, q.i, q.j, q.k]);
    }
}

/// Second derivative of `a . f` along rotations of `a`.
pub fn curvature(a: &Vector3<f64>, f: &Vector3<f64>) -> Matrix3<f64> {
    0.5 * (f * a.transpose() + a * f.transpose()) - Matrix3::from_diagonal_element(a.dot(f))
}
