//! Plain cables near selected nodes: force, rate and tangent in one go. The formulas are those of [`crate::element::Cable`].

use super::Sums;
use crate::element::Cable;

/// Constants of a cable.
#[derive(Debug, Clone, Copy)]
pub(super) struct Wire {
    pub(super) nodes: [u32; 2],
    span: [f64; 3],
    q0: f64,
    slope: f64,
    floor: f64,
}

impl Wire {
    pub(super) fn of(cable: &Cable) -> Self {
        Self {
            nodes: cable.nodes.map(|node| node as u32),
            span: cable.span.into(),
            q0: cable.initial_pull_per_length(),
            slope: cable.slope(),
            floor: cable.floor(),
        }
    }
}

/// A cable with a selected node.
#[derive(Debug, Clone, Copy)]
pub(super) struct NearWire {
    pub(super) wire: Wire,
    /// Places of its nodes; that behind the last for a node that is not selected.
    pub(super) places: [u32; 2],
    /// Pairs of its first node with itself, of its second, of both; that behind the last where there is none.
    pub(super) pairs: [u32; 3],
}

/// Add what the cables do at the displacements `u` and velocities `v`, component-major over so many `nodes`.
pub(super) fn add_wires(near: &[NearWire], (u, v): (&[f64], &[f64]), nodes: usize, to: &mut Sums) {
    let (ux, uy, uz) = (&u[..nodes], &u[nodes..2 * nodes], &u[2 * nodes..3 * nodes]);
    let (vx, vy, vz) = (&v[..nodes], &v[nodes..2 * nodes], &v[2 * nodes..3 * nodes]);
    for NearWire { wire, places, pairs } in near {
        let [a, b] = wire.nodes.map(|node| node as usize);
        let w = [ux[b] - ux[a], uy[b] - uy[a], uz[b] - uz[a]];
        let away = [vx[b] - vx[a], vy[b] - vy[a], vz[b] - vz[a]];
        let d = [0, 1, 2].map(|c: usize| wire.span[c] + w[c]);
        let s = (0..3).map(|c| w[c] * (wire.span[c] + d[c])).sum::<f64>();
        let elastic = wire.q0 + wire.slope * s;
        if elastic < wire.floor {
            continue;
        }
        let twice = 2.0 * wire.slope;
        let along = twice * (d[0] * away[0] + d[1] * away[1] + d[2] * away[2]);
        let [first, second] = places.map(|place| place as usize);
        for c in 0..3 {
            let (pull, change) = (elastic * d[c], along * d[c] + elastic * away[c]);
            to.force[first][c] += pull;
            to.force[second][c] -= pull;
            to.rate[first][c] += change;
            to.rate[second][c] -= change;
        }
        let mut k = [0.0; 9];
        for r in 0..3 {
            for c in 0..3 {
                k[3 * r + c] = twice * d[r] * d[c];
            }
            k[4 * r] += elastic;
        }
        let [own, other, beside] = pairs.map(|pair| pair as usize);
        (0..9).for_each(|i| to.tangent[own][i] += k[i]);
        (0..9).for_each(|i| to.tangent[other][i] += k[i]);
        (0..9).for_each(|i| to.tangent[beside][i] -= k[i]);
    }
}
