//! Which nodes of a selection the tangents of which elements couple.

use super::Sums;
use crate::element::Cable;
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

/// Block of the tangent of an element: its nodes of row and column, and where it belongs.
#[derive(Debug, Clone, Copy)]
pub(super) struct Block {
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
    wires: Vec<Wire>,
    wires_at: Vec<Vec<u32>>,
    elements_at: Vec<Vec<u32>>,
    /// Nodes of each element.
    nodes_of: Vec<Vec<u32>>,
    /// Place of each node of the structure among the selected ones, or [`OUT`].
    place: Vec<u32>,
    /// For each node and each element the mark of the last search that found it.
    node_seen: Vec<u32>,
    element_seen: Vec<u32>,
    mark: u32,
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
    pub(super) blocks: Vec<Block>,
    /// Places of the nodes of the near elements; that behind the last for a node that is not selected.
    pub(super) places: Vec<u32>,
}

impl Coupled {
    /// Of the elements of `model`, with memory for all of its nodes.
    pub(super) fn new(model: &Model) -> Self {
        let n = model.node_count();
        let mut coupled = Self {
            wires: model.cables.iter().map(Wire::of).collect(),
            wires_at: at_nodes(n, model.cables.iter().map(|c| &c.nodes[..])),
            elements_at: at_nodes(n, model.elements.iter().map(|e| e.nodes())),
            nodes_of: model.elements.iter().map(|e| e.nodes().iter().map(|n| *n as u32).collect()).collect(),
            place: vec![OUT; n],
            node_seen: vec![0; n],
            element_seen: vec![0; model.elements.len()],
            ..Self::default()
        };
        coupled.select(0..n as u32, true);
        coupled
    }

    /// Select `nodes`; find pairs if asked for, otherwise all tangents belong to the place behind the last pair.
    pub(super) fn select(&mut self, nodes: impl Iterator<Item = u32>, pairs: bool) {
        self.nodes.drain(..).for_each(|node| self.place[node as usize] = OUT);
        for (place, node) in nodes.enumerate() {
            self.place[node as usize] = place as u32;
            self.nodes.push(node);
        }
        self.pairs.clear();
        self.first.clear();
        if pairs {
            self.find_pairs();
        }
        self.find_wires();
        self.find_elements();
    }

    fn find_pairs(&mut self) {
        for own in 0..self.nodes.len() as u32 {
            let (from, node) = (self.pairs.len(), self.nodes[own as usize]);
            self.first.push(from as u32);
            self.mark = self.mark.wrapping_add(1);
            self.node_seen[node as usize] = self.mark;
            self.pairs.push([own, own]);
            let by_wires = self.wires_at[node as usize].iter().flat_map(|w| &self.wires[*w as usize].nodes);
            let by_elements =
                self.elements_at[node as usize].iter().flat_map(|e| &self.nodes_of[*e as usize]);
            for other in by_wires.chain(by_elements).map(|other| *other as usize) {
                let place = self.place[other];
                if place != OUT && place > own && self.node_seen[other] != self.mark {
                    self.node_seen[other] = self.mark;
                    self.pairs.push([own, place]);
                }
            }
            self.pairs[from..].sort_unstable();
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
    fn find_wires(&mut self) {
        self.found.clear();
        for (own, node) in self.nodes.iter().enumerate() {
            // A wire between two selected nodes belongs to the first of them.
            let here = |number: &&u32| {
                let ends = self.wires[**number as usize].nodes;
                ends.iter().all(|end| self.place[*end as usize] as usize >= own)
            };
            self.found.extend(self.wires_at[*node as usize].iter().filter(here));
        }
        self.found.sort_unstable();
        self.near_wires.clear();
        let (nowhere, no_pair) = (self.nodes.len() as u32, self.pairs.len() as u32);
        for number in &self.found {
            let wire = self.wires[*number as usize];
            let [a, b] = wire.nodes.map(|node| self.place[node as usize]);
            let diagonal = |place: u32| if place == OUT { no_pair } else { self.pair(place, place) };
            let beside = if a == OUT || b == OUT { no_pair } else { self.pair(a.min(b), a.max(b)) };
            let (pairs, places) = ([diagonal(a), diagonal(b), beside], [a.min(nowhere), b.min(nowhere)]);
            self.near_wires.push(NearWire { wire, places, pairs });
        }
    }

    /// The elements at selected nodes, likewise.
    fn find_elements(&mut self) {
        self.found.clear();
        self.mark = self.mark.wrapping_add(1);
        for node in &self.nodes {
            for number in &self.elements_at[*node as usize] {
                if std::mem::replace(&mut self.element_seen[*number as usize], self.mark) != self.mark {
                    self.found.push(*number);
                }
            }
        }
        self.found.sort_unstable();
        self.near_elements.clear();
        self.blocks.clear();
        self.places.clear();
        let nowhere = self.nodes.len() as u32;
        for number in &self.found {
            let from = self.places.len();
            let nodes = &self.nodes_of[*number as usize];
            self.places.extend(nodes.iter().map(|node| self.place[*node as usize].min(nowhere)));
            let places = &self.places[from..];
            for (row, a) in places.iter().enumerate() {
                for (column, b) in places.iter().enumerate().filter(|(_, b)| a <= *b && **b < nowhere) {
                    let pair = self.pair(*a, *b);
                    self.blocks.push(Block { row: row as u32, column: column as u32, pair });
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
            let (n, per_node) = (dofs.len(), if element.rotates() { 6 } else { 3 });
            let places = &self.places[place..near.places_end as usize];
            for (node, own) in
                places.iter().enumerate().filter(|(_, own)| (**own as usize) < self.nodes.len())
            {
                for c in 0..3 {
                    let row = node * per_node + c;
                    let along: f64 =
                        k[row * n..][..n].iter().zip(dofs).map(|(k, dof)| k * heading.v[*dof]).sum();
                    to.force[*own as usize][c] -= force[row] - heading.ahead * along;
                    to.rate[*own as usize][c] -= along;
                }
            }
            for Block { row, column, pair } in &self.blocks[block..near.blocks_end as usize] {
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

/// Constants of a cable.
#[derive(Debug, Clone, Copy)]
struct Wire {
    nodes: [u32; 2],
    span: [f64; 3],
    q0: f64,
    slope: f64,
    floor: f64,
}

impl Wire {
    fn of(cable: &Cable) -> Self {
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
    wire: Wire,
    /// Places of its nodes; that behind the last for a node that is not selected.
    places: [u32; 2],
    /// Pairs of its first node with itself, of its second, of both; that behind the last where there is none.
    pairs: [u32; 3],
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
