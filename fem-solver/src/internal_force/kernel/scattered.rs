//! Cables whose nodes follow no pattern, fast: what the kernel does where runs are short.
//!
//! Nodes are numbered anew, neighbours next to each other (Cuthill and McKee), and stored together: x, y, z and a
//! fourth number that makes a node fill a register. A cable then loads two nodes and changes two forces, each
//! in one piece, and a step over the structure walks through memory from end to end.

use crate::element::Cable;
use crate::linear_algebra::lanes::wide;
use crate::model::numbering::neighbours_together;

/// ScatteredConstants of one cable.
#[derive(Debug, Clone, Copy, PartialEq)]
struct ScatteredConstants {
    /// Its nodes, in the new numbers.
    nodes: [u32; 2],
    /// `2 D` [m], and 0.
    span2: [f64; 4],
    /// `D . D` [m2].
    square: f64,
    /// `q_0` [N/m].
    q0: f64,
    /// `c` [N/m3].
    slope: f64,
    /// Least pull per length [N/m].
    floor: f64,
}

/// The cables of a structure.
#[derive(Debug, Clone, Default)]
pub struct Scattered {
    cables: Vec<ScatteredConstants>,
    /// `max(q_0, floor)` [N/m] and `1 / (4 c)` [m3/N], for the energy.
    stored: Vec<[f64; 2]>,
    /// Old number of each new one.
    old: Vec<u32>,
    positions: Vec<[f64; 4]>,
    forces: Vec<[f64; 4]>,
}

impl Scattered {
    /// For `cables` between `nodes` nodes.
    pub fn new(cables: &[Cable], nodes: usize) -> Self {
        let pairs: Vec<[usize; 2]> = cables.iter().map(|c| c.nodes).collect();
        let old: Vec<u32> = neighbours_together(&pairs, nodes).into_iter().map(|n| n as u32).collect();
        let mut new = vec![0_u32; nodes];
        old.iter().enumerate().for_each(|(i, o)| new[*o as usize] = i as u32);
        let number = |cable: &Cable| cable.nodes.map(|n| new[n]);
        let mut order: Vec<usize> = (0..cables.len()).collect();
        order.sort_by_key(|i| {
            let [a, b] = number(&cables[*i]);
            (a.min(b), a.max(b), *i)
        });
        let sorted = order.iter().map(|i| &cables[*i]);
        let constants = sorted.clone().map(|cable| ScatteredConstants {
            nodes: number(cable),
            span2: [2.0 * cable.span.x, 2.0 * cable.span.y, 2.0 * cable.span.z, 0.0],
            square: cable.span.norm_squared(),
            q0: cable.initial_pull_per_length(),
            slope: cable.slope(),
            floor: cable.floor(),
        });
        let stored =
            sorted.clone().map(|c| [c.initial_pull_per_length().max(c.floor()), 1.0 / (4.0 * c.slope())]);
        Self {
            cables: constants.collect(),
            stored: stored.collect(),
            positions: vec![[0.0; 4]; nodes],
            forces: vec![[0.0; 4]; nodes],
            old,
        }
    }

    /// Add what the cables pull on their nodes to `force` [N], at the displacements `u` [m]; both
    /// component-major. Returns the largest tension, squared [N2].
    pub fn pull(&mut self, u: &[f64], force: &mut [f64]) -> f64 {
        self.gather(u);
        self.forces.fill([0.0; 4]);
        let largest = pulls(&self.cables, &self.positions, &mut self.forces);
        let n = self.old.len();
        let (x, rest) = force.split_at_mut(n);
        let (y, rest) = rest.split_at_mut(n);
        let z = &mut rest[..n];
        for (old, f) in self.old.iter().zip(&self.forces) {
            let i = *old as usize;
            x[i] += f[0];
            y[i] += f[1];
            z[i] += f[2];
        }
        largest
    }

    /// Stored energy [J] at the displacements `u` [m]; 0 as modelled.
    pub fn energy(&mut self, u: &[f64]) -> f64 {
        self.gather(u);
        energies(&self.cables, &self.stored, &self.positions)
    }

    fn gather(&mut self, u: &[f64]) {
        let n = self.old.len();
        let (x, y, z) = (&u[..n], &u[n..2 * n], &u[2 * n..3 * n]);
        for (old, to) in self.old.iter().zip(&mut self.positions) {
            let i = *old as usize;
            *to = [x[i], y[i], z[i], 0.0];
        }
    }
}

impl ScatteredConstants {
    /// Relative displacement, `s` with `l^2 = D . D + s`, pull per length.
    #[inline(always)]
    fn stretch(&self, positions: &[[f64; 4]]) -> ([f64; 4], f64, f64) {
        let (a, b) = (&positions[self.nodes[0] as usize], &positions[self.nodes[1] as usize]);
        let mut w = [0.0; 4];
        let mut product = [0.0; 4];
        for c in 0..4 {
            w[c] = b[c] - a[c];
            product[c] = w[c] * (self.span2[c] + w[c]);
        }
        let s = product[0] + product[1] + product[2];
        let elastic = self.q0 + self.slope * s;
        // Anything not a number stays so, and is found at the window's end.
        (w, s, if elastic < self.floor { self.floor } else { elastic })
    }
}

wide! {
    /// Pulls of all cables; returns the largest tension, squared.
    fn pulls(cables: &[ScatteredConstants], positions: &[[f64; 4]], forces: &mut [[f64; 4]]) -> f64 {
        let mut largest = 0.0;
        for cable in cables {
            let (w, s, q) = cable.stretch(positions);
            let mut pull = [0.0; 4];
            for c in 0..4 {
                pull[c] = q * (0.5 * cable.span2[c] + w[c]);
            }
            let first = &mut forces[cable.nodes[0] as usize];
            for c in 0..4 {
                first[c] += pull[c];
            }
            let second = &mut forces[cable.nodes[1] as usize];
            for c in 0..4 {
                second[c] -= pull[c];
            }
            let squared = q * q * (cable.square + s);
            largest = if squared > largest { squared } else { largest };
        }
        largest
    }

    /// Sum of the energies of all cables.
    fn energies(cables: &[ScatteredConstants], stored: &[[f64; 2]], positions: &[[f64; 4]]) -> f64 {
        let mut sum = 0.0;
        for (cable, [base, inverse]) in cables.iter().zip(stored) {
            let (_, _, q) = cable.stretch(positions);
            sum += (q - base) * (q + base) * inverse;
        }
        sum
    }
}
