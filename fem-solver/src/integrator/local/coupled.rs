//! Pairs of selected nodes that the tangents of elements couple.

use super::Sums;
use crate::internal_force::assembly::{Assembly, Heading};
use crate::model::Model;

/// Marks a node that is not selected.
const OUT: u32 = u32::MAX;

/// For each of so many nodes the numbers of what it belongs to, from the nodes of each number.
fn at_nodes<'a>(nodes: usize, of: impl Iterator<Item = &'a [usize]>) -> Vec<Vec<u32>> {
    let mut at = vec![Vec::new(); nodes];
    of.enumerate().for_each(|(number, own)| own.iter().for_each(|node| at[*node].push(number as u32)));
    at
}

/// Sort numbers, each of them once.
fn sort_once(numbers: &mut Vec<u32>) {
    numbers.sort_unstable();
    numbers.dedup();
}

/// Block of the tangent of an element: its nodes of row and column, and where it belongs.
#[derive(Debug, Clone, Copy)]
pub(super) struct TangentBlock {
    pub(super) row: u32,
    pub(super) column: u32,
    pub(super) pair: u32,
}

/// An element with a selected node.
#[derive(Debug, Clone)]
pub(super) struct NearElement {
    pub(super) number: u32,
    /// End of its blocks; they begin where those of the one before end.
    pub(super) blocks_end: u32,
    /// End of the places of its nodes, in the same manner.
    pub(super) places_end: u32,
}

/// The elements at selected nodes, and the pairs of these that they couple.
#[derive(Debug, Clone, Default)]
pub(super) struct Coupled {
    wires_at: Vec<Vec<u32>>,
    elements_at: Vec<Vec<u32>>,
    /// Place of each node of the structure among the selected ones, or [`OUT`].
    place: Vec<u32>,
    /// Numbers that a search has found.
    found: Vec<u32>,
    /// First pair of each place.
    first: Vec<u32>,
    /// The selected nodes.
    pub(super) nodes: Vec<u32>,
    /// Pairs of places, ascending, first not above second.
    pub(super) pairs: Vec<[u32; 2]>,
    pub(super) near_wires: Vec<NearWire>,
    pub(super) near_elements: Vec<NearElement>,
    pub(super) blocks: Vec<TangentBlock>,
    /// Places of the nodes of the near elements; that behind the last for a node that is not selected.
    pub(super) places: Vec<u32>,
}

impl Coupled {
    /// Of the elements of `model`, with memory for all of its nodes.
    pub(super) fn new(model: &Model) -> Self {
        let n = model.node_count();
        let mut coupled = Self {
            wires_at: at_nodes(n, model.cables.iter().map(|c| &c.nodes[..])),
            elements_at: at_nodes(n, model.elements.iter().map(|e| e.nodes())),
            place: vec![OUT; n],
            ..Self::default()
        };
        coupled.select(model, 0..n as u32, true);
        coupled
    }

    /// Select `nodes`; find pairs if asked for, otherwise all tangents belong to the place behind the last pair.
    pub(super) fn select(&mut self, model: &Model, nodes: impl Iterator<Item = u32>, pairs: bool) {
        self.nodes.drain(..).for_each(|node| self.place[node as usize] = OUT);
        for (place, node) in nodes.enumerate() {
            self.place[node as usize] = place as u32;
            self.nodes.push(node);
        }
        self.pairs.clear();
        self.first.clear();
        if pairs {
            self.find_pairs(model);
        }
        self.find_wires(model);
        self.find_elements(model);
    }

    fn find_pairs(&mut self, model: &Model) {
        for (own, node) in self.nodes.iter().enumerate() {
            let (own, node) = (own as u32, *node as usize);
            self.first.push(self.pairs.len() as u32);
            let by_wires = self.wires_at[node].iter().flat_map(|w| &model.cables[*w as usize].nodes);
            let by_elements = self.elements_at[node].iter().flat_map(|e| model.elements[*e as usize].nodes());
            let others = by_wires.chain(by_elements).map(|other| self.place[*other]);
            self.found.clear();
            self.found.push(own);
            self.found.extend(others.filter(|place| *place != OUT && *place > own));
            sort_once(&mut self.found);
            self.pairs.extend(self.found.iter().map(|place| [own, *place]));
        }
    }

    /// Place of a node of the structure, if it is selected.
    pub(super) fn place(&self, node: usize) -> Option<usize> {
        Some(self.place[node]).filter(|place| *place != OUT).map(|place| place as usize)
    }

    /// Number of the pair of two places, first not above second; that behind the last where they make none.
    pub(super) fn pair(&self, own: u32, other: u32) -> u32 {
        let none = self.pairs.len();
        let Some(from) = self.first.get(own as usize).map(|first| *first as usize) else {
            return none as u32;
        };
        let end = self.first.get(own as usize + 1).map_or(none, |first| *first as usize);
        let found = self.pairs[from..end].binary_search(&[own, other]);
        found.map_or(none, |at| from + at) as u32
    }

    /// The wires at selected nodes in the order of the structure, so that sums do not depend on what is selected.
    fn find_wires(&mut self, model: &Model) {
        self.found.clear();
        self.found.extend(self.nodes.iter().flat_map(|node| &self.wires_at[*node as usize]));
        sort_once(&mut self.found);
        self.near_wires.clear();
        let (nowhere, no_pair) = (self.nodes.len() as u32, self.pairs.len() as u32);
        for number in &self.found {
            let cable = &model.cables[*number as usize];
            let [a, b] = cable.nodes.map(|node| self.place[node]);
            let diagonal = |place: u32| if place == OUT { no_pair } else { self.pair(place, place) };
            let beside = if a == OUT || b == OUT { no_pair } else { self.pair(a.min(b), a.max(b)) };
            self.near_wires.push(NearWire {
                nodes: cable.nodes,
                span: cable.span.into(),
                q0: cable.initial_pull_per_length(),
                slope: cable.slope(),
                floor: cable.floor(),
                places: [a.min(nowhere), b.min(nowhere)],
                pairs: [diagonal(a), diagonal(b), beside],
            });
        }
    }

    /// The elements at selected nodes, likewise.
    fn find_elements(&mut self, model: &Model) {
        self.found.clear();
        self.found.extend(self.nodes.iter().flat_map(|node| &self.elements_at[*node as usize]));
        sort_once(&mut self.found);
        self.near_elements.clear();
        self.blocks.clear();
        self.places.clear();
        let nowhere = self.nodes.len() as u32;
        for number in &self.found {
            let from = self.places.len();
            let nodes = model.elements[*number as usize].nodes();
            self.places.extend(nodes.iter().map(|node| self.place[*node].min(nowhere)));
            let places = &self.places[from..];
            for (row, a) in places.iter().enumerate() {
                for (column, b) in places.iter().enumerate().filter(|(_, b)| a <= *b && **b < nowhere) {
                    let pair = self.pair(*a, *b);
                    self.blocks.push(TangentBlock { row: row as u32, column: column as u32, pair });
                }
            }
            self.near_elements.push(NearElement {
                number: *number,
                blocks_end: self.blocks.len() as u32,
                places_end: self.places.len() as u32,
            });
        }
    }

    /// Add force, rate and tangent of the near elements: those towards which they are heading.
    pub(super) fn add_elements(
        &self,
        model: &Model,
        assembly: &mut Assembly,
        heading: Heading,
        history: &[f64],
        to: &mut Sums,
    ) {
        let (mut block, mut place) = (0, 0);
        for near in &self.near_elements {
            let number = near.number as usize;
            let element = &model.elements[number];
            let (force, k, dofs) = assembly.linearised(number, element, heading, history);
            let (n, per_node) = (dofs.len(), if element.constants().rotates { 6 } else { 3 });
            let places = &self.places[place..near.places_end as usize];
            let selected = places.iter().enumerate().filter(|(_, own)| (**own as usize) < self.nodes.len());
            for (node, own) in selected {
                for c in 0..3 {
                    let row = node * per_node + c;
                    let along: f64 =
                        k[row * n..][..n].iter().zip(dofs).map(|(k, dof)| k * heading.v[*dof]).sum();
                    to.force[*own as usize][c] -= force[row] - heading.ahead * along;
                    to.rate[*own as usize][c] -= along;
                }
            }
            for TangentBlock { row, column, pair } in &self.blocks[block..near.blocks_end as usize] {
                let (row, column) = (*row as usize * per_node, *column as usize * per_node);
                let sum = &mut to.tangent[*pair as usize];
                for (i, entry) in sum.iter_mut().enumerate() {
                    let (r, c) = (row + i / 3, column + i % 3);
                    *entry += 0.5 * (k[r * n + c] + k[c * n + r]);
                }
            }
            (block, place) = (near.blocks_end as usize, near.places_end as usize);
        }
    }
}

/// A cable with a selected node, and its constants.
#[derive(Debug, Clone, Copy)]
pub(super) struct NearWire {
    nodes: [usize; 2],
    span: [f64; 3],
    q0: f64,
    slope: f64,
    floor: f64,
    /// Places of its nodes; that behind the last for a node that is not selected.
    places: [u32; 2],
    /// Pairs of its first node with itself, of its second, of both; that behind the last where there is none.
    pairs: [u32; 3],
}

/// Add what the cables do at the displacements `u` and velocities `v`, component-major over so many `nodes`.
pub(super) fn add_wires(near: &[NearWire], (u, v): (&[f64], &[f64]), nodes: usize, to: &mut Sums) {
    let (ux, uy, uz) = (&u[..nodes], &u[nodes..2 * nodes], &u[2 * nodes..3 * nodes]);
    let (vx, vy, vz) = (&v[..nodes], &v[nodes..2 * nodes], &v[2 * nodes..3 * nodes]);
    for wire in near {
        let [a, b] = wire.nodes;
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
        let [first, second] = wire.places.map(|place| place as usize);
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
        let [own, other, beside] = wire.pairs.map(|pair| pair as usize);
        (0..9).for_each(|i| to.tangent[own][i] += k[i]);
        (0..9).for_each(|i| to.tangent[other][i] += k[i]);
        (0..9).for_each(|i| to.tangent[beside][i] -= k[i]);
    }
}
