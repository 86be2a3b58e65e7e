//! Vectors as the interface has them: x, y, z of one node after the other.

use crate::linear_algebra::lanes::wide;

wide! {
    /// `a - b`, from component-major to node-major.
    pub fn difference_to_node_major(a: &[f64], b: &[f64], nodes: usize, to: &mut [f64]) {
        let (ax, ay, az) = (&a[..nodes], &a[nodes..2 * nodes], &a[2 * nodes..3 * nodes]);
        let (bx, by, bz) = (&b[..nodes], &b[nodes..2 * nodes], &b[2 * nodes..3 * nodes]);
        let (vectors, _) = to[..3 * nodes].as_chunks_mut::<3>();
        let vectors = &mut vectors[..nodes];
        for i in 0..nodes {
            vectors[i] = [ax[i] - bx[i], ay[i] - by[i], az[i] - bz[i]];
        }
    }

    /// From component-major to node-major.
    pub fn to_node_major(from: &[f64], nodes: usize, to: &mut [f64]) {
        let (x, y, z) = (&from[..nodes], &from[nodes..2 * nodes], &from[2 * nodes..3 * nodes]);
        let (vectors, _) = to[..3 * nodes].as_chunks_mut::<3>();
        let vectors = &mut vectors[..nodes];
        for i in 0..nodes {
            vectors[i] = [x[i], y[i], z[i]];
        }
    }

    /// From node-major to component-major.
    pub fn to_component_major(from: &[f64], nodes: usize, to: &mut [f64]) {
        let (x, rest) = to.split_at_mut(nodes);
        let (y, rest) = rest.split_at_mut(nodes);
        let z = &mut rest[..nodes];
        let (vectors, _) = from[..3 * nodes].as_chunks::<3>();
        for (((v, x), y), z) in vectors.iter().zip(x).zip(y).zip(z) {
            (*x, *y, *z) = (v[0], v[1], v[2]);
        }
    }
}
