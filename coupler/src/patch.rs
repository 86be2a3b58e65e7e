//! The part of the net that crosses the interface: the nodes that the contact solver may reach, and rings of nodes around them.

use interface_defs::{InterfaceMesh, Items, Selection, selection::Selected};
use serde::{Deserialize, Serialize};

/// The selected nodes of the interface mesh, and how far the others may have moved since they were selected.
pub struct Patch {
    mesh: InterfaceMesh,
    /// Neighbours of each node, by lines and faces: begin of each node's, and all of them.
    starts: Vec<u32>,
    neighbours: Vec<u32>,
    rings: u32,
    selection: Selection,
    marked: Vec<bool>,
    edge: Vec<u32>,
    now: Now,
}

/// What is known of the selection, and of the nodes that it leaves out.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
struct Now {
    /// Whether the contact solver knows of the selection.
    announced: bool,
    /// Whether anything is selected.
    chosen: bool,
    /// Length of the window that the selection was made for [s].
    length: f64,
    /// Distance that a node that is not selected has moved since, at most [m]; of the last window alone; and the window's
    /// length [s].
    travel: f64,
    last_travel: (f64, f64),
}

/// What is selected, and how far the others may have moved, for a run that goes on.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct KeptPatch {
    selected: Selected,
    now: Now,
}

/// A selection that was made for windows longer than this many of those to come has nodes that these do not need.
const WIDE: f64 = 8.0;

/// What a node that is not selected may move in any window without a new selection [m].
const SLACK: f64 = 2e-3;

impl Patch {
    /// Of `mesh`, with so many rings of nodes around those in reach.
    pub fn new(mesh: InterfaceMesh, rings: u32) -> Self {
        let nodes = mesh.node_count();
        let of_lines = mesh.lines.iter().map(|[a, b]| (*a, *b));
        let of_faces = mesh.faces.iter().flat_map(|[a, b, c]| [(*a, *b), (*b, *c), (*c, *a)]);
        let mut pairs: Vec<(u32, u32)> =
            of_lines.chain(of_faces).flat_map(|(a, b)| [(a, b), (b, a)]).collect();
        pairs.sort_unstable();
        pairs.dedup();
        let mut starts = vec![0; nodes + 1];
        pairs.iter().for_each(|(a, _)| starts[*a as usize + 1] += 1);
        for node in 0..nodes {
            starts[node + 1] += starts[node];
        }
        Self {
            starts,
            neighbours: pairs.into_iter().map(|(_, b)| b).collect(),
            rings,
            selection: Selection::new(&mesh),
            marked: vec![false; nodes],
            edge: Vec::with_capacity(2 * nodes),
            now: Now { announced: false, chosen: false, length: 0.0, travel: 0.0, last_travel: (0.0, 1.0) },
            mesh,
        }
    }

    /// All nodes, lines and faces.
    pub fn all(&self) -> Items {
        Items::of(&self.mesh)
    }

    /// Select what the contact solver has listed for a window of `length` [s], and the rings around it. At least one node, so that
    /// a list is never empty.
    pub fn select(&mut self, listed: &[f64], length: f64) -> Result<(), String> {
        self.marked.fill(false);
        self.edge.clear();
        for number in listed {
            let node = *number as usize;
            if *number < 0.0 || node >= self.marked.len() {
                return Err(format!("it listed node {number} of {}", self.marked.len()));
            }
            self.marked[node] = true;
            self.edge.push(node as u32);
        }
        let mut from = 0;
        for _ in 0..self.rings {
            let until = self.edge.len();
            for at in from..until {
                let node = self.edge[at] as usize;
                for near in &self.neighbours[self.starts[node] as usize..self.starts[node + 1] as usize] {
                    if !std::mem::replace(&mut self.marked[*near as usize], true) {
                        self.edge.push(*near);
                    }
                }
            }
            from = until;
        }
        if let (true, Some(first)) = (self.edge.is_empty(), self.marked.first_mut()) {
            *first = true;
        }
        let Self { selection, marked, mesh, .. } = self;
        let nodes = marked.iter().enumerate().filter(|(_, marked)| **marked).map(|(node, _)| node as u32);
        selection.set(mesh, nodes)?;
        self.now = Now { announced: false, chosen: true, length, travel: 0.0, ..self.now };
        Ok(())
    }

    /// The pairs of selected nodes that the structure couples, as it has listed them.
    pub fn set_pairs(&mut self, listed: &[f64]) -> Result<(), String> {
        let places = self.selection.nodes.len() as f64;
        let (pairs, rest) = listed.as_chunks::<2>();
        let wrong = |[a, b]: &&[f64; 2]| !(*a >= 0.0 && a <= b && *b < places);
        if let Some(pair) = pairs.iter().find(wrong) {
            return Err(format!("it couples places {pair:?} of {places} selected nodes"));
        }
        if !rest.is_empty() {
            return Err(format!("its list of pairs has {} numbers", listed.len()));
        }
        self.selection.pairs.clear();
        self.selection.pairs.extend(pairs.iter().map(|pair| pair.map(|place| place as u32)));
        Ok(())
    }

    /// Nodes of the selection.
    pub fn nodes(&self) -> &[u32] {
        &self.selection.nodes
    }

    /// Whether nothing has been selected yet.
    pub fn is_open(&self) -> bool {
        !self.now.chosen
    }

    /// Whether far fewer nodes may do for windows of `length` [s]: those of a flight that has come to its end had more in reach.
    pub fn is_wide_for(&self, length: f64) -> bool {
        self.now.chosen && self.now.length > WIDE * length
    }

    /// For a run that goes on.
    pub fn kept(&self) -> KeptPatch {
        KeptPatch { selected: self.selection.selected(), now: self.now }
    }

    /// Go on from there.
    pub fn go_on(&mut self, kept: KeptPatch) -> Result<(), String> {
        self.now = kept.now;
        self.selection.select_again(&self.mesh, kept.selected)
    }

    /// Items of the selection.
    pub fn items(&self) -> Items {
        self.selection.items()
    }

    /// Numbers that announce the selection to the contact solver, if it does not know it; and how many are nodes.
    pub fn to_announce(&self) -> (usize, usize) {
        let nodes = self.selection.nodes.len();
        if self.now.announced { (0, 0) } else { (nodes + 2 * self.selection.pairs.len(), nodes) }
    }

    /// Write these numbers.
    pub fn announce(&self, list: &mut [f64]) {
        let nodes = self.selection.nodes.iter();
        let numbers = nodes.chain(self.selection.pairs.iter().flatten());
        list.iter_mut().zip(numbers).for_each(|(to, number)| *to = f64::from(*number));
    }

    /// The contact solver knows it now.
    pub fn is_announced(&mut self) {
        self.now.announced = true;
    }

    /// How far a node that is not selected may have moved by the end of a window of `length` [s], in [m].
    pub fn expected_travel(&self, length: f64) -> f64 {
        let (last, over) = self.now.last_travel;
        self.now.travel + 2.0 * last * length / over + SLACK
    }

    /// Such nodes have moved by `travel` [m] in an accepted window of `length` [s].
    pub fn moved(&mut self, travel: f64, length: f64) {
        self.now.travel += travel;
        self.now.last_travel = (travel, length);
    }

    /// What is known of the travel before the first window.
    pub fn expect(&mut self, travel: f64, length: f64) {
        self.now.last_travel = (travel, length);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rings_of_neighbours_are_selected_around_the_listed_nodes() {
        let lines = (0..9).map(|n| [n, n + 1]).collect();
        let mesh = InterfaceMesh { coordinates: vec![0.0; 30], lines, ..Default::default() };
        let mut patch = Patch::new(mesh, 2);
        patch.select(&[4.0, 5.0], 1e-3).expect("nodes of the mesh");
        assert_eq!(patch.nodes(), [2, 3, 4, 5, 6, 7]);
        assert_eq!(patch.items().lines, 5);
        patch.set_pairs(&[0.0, 0.0, 0.0, 1.0]).expect("pairs of the selection");
        assert_eq!(patch.to_announce(), (10, 6));
        assert!(patch.set_pairs(&[0.0, 6.0]).is_err() && patch.set_pairs(&[1.0, 0.0]).is_err());
        patch.select(&[], 1e-3).expect("nothing is in reach");
        assert_eq!(patch.nodes(), [0]);
        assert!(patch.is_wide_for(1e-4) && !patch.is_wide_for(5e-4));
        assert!(patch.select(&[10.0], 1e-3).is_err());
    }

    #[test]
    fn travel_is_summed_up_and_what_comes_is_expected_to_be_twice_what_came() {
        let mut patch = Patch::new(InterfaceMesh { coordinates: vec![0.0; 3], ..Default::default() }, 1);
        patch.moved(1e-3, 1e-3);
        patch.moved(2e-3, 1e-3);
        assert!((patch.expected_travel(2e-3) - (3e-3 + 8e-3 + SLACK)).abs() < 1e-15);
    }
}
