//! Rings, several at a time: force, history and energy, to the same bytes as [`crate::element::Ring`] alone.
//!
//! Rings that follow each other among the elements and have as many nodes form blocks of up to [`WIDTH`], with each quantity in
//! a column. A block is gathered, computed in wide registers by the formulas of [`crate::element::ring::formula`], and handed
//! back. Where the nodes of neighbours have consecutive numbers, as in the rows of a generated net, nodes are columns of the
//! structure already, and blocks end where rows do. Forces are handed back node by node of the rings: in a generated net
//! every node takes them in the order of the elements, as it does of rings one by one.

mod columns;

use self::columns::{BlockConstants, BlockMemory, NodeLanes};
use crate::element::ring::{BROKEN, PERIMETER, WIDTHS};
use crate::element::{AnyElement, Element, Energy, FAR, Ring};
use std::ops::Range;

/// Rings that are computed together.
pub const WIDTH: usize = 8;
/// A row of at least so many rings is a block, even if more rings follow it.
const SHORTEST_ROW: usize = 4;

/// A number of each of them.
type Lanes = [f64; WIDTH];

/// The rings of a structure, in blocks.
#[derive(Debug, Clone, Default)]
pub struct Rings {
    blocks: Vec<RingBlock>,
    /// Block of each element; `None` where it is computed alone. Empty where there are no rings.
    block_of: Vec<Option<u32>>,
    three: BlockMemory<3, 3>,
    four: BlockMemory<4, 2>,
}

/// Up to [`WIDTH`] rings.
#[derive(Debug, Clone)]
struct RingBlock {
    /// Their elements.
    elements: Range<usize>,
    /// Number of all nodes.
    nodes: usize,
    /// Where the history of the first begins; the others follow it.
    history: usize,
    /// Force of the perimeter at which each breaks [N], and whether any of them can.
    strength: Lanes,
    breakable: bool,
    /// Energy as modelled [J].
    modelled: Lanes,
    constants: BlockKind,
}

/// Nodes and constants, over 3 or over 4 nodes. Numbers beyond the last ring repeat it.
#[derive(Debug, Clone)]
enum BlockKind {
    Three(Box<([SameCorner; 3], BlockConstants<3>)>),
    Four(Box<([SameCorner; 4], BlockConstants<4>)>),
}

/// The nodes that are at one place of each ring.
#[derive(Debug, Clone, Copy)]
enum SameCorner {
    /// Consecutive numbers from this on.
    Row(usize),
    /// These.
    Each([u32; WIDTH]),
}

/// Does the same with a block over 3 and over 4 nodes: with its places and columns, and the memory of its kind.
macro_rules! of_kind {
    ($rings:expr, $block:expr, |$places:ident, $columns:ident, $memory:ident| $what:expr) => {
        match &$block.constants {
            BlockKind::Three(own) => {
                let (($places, $columns), $memory) = (&**own, &mut $rings.three);
                $what
            }
            BlockKind::Four(own) => {
                let (($places, $columns), $memory) = (&**own, &mut $rings.four);
                $what
            }
        }
    };
}

impl Rings {
    /// The rings among `elements` between `nodes` nodes, where `history` says where the history of each element begins.
    pub fn new(elements: &[AnyElement], nodes: usize, history: impl Fn(usize) -> usize) -> Self {
        let rings = elements.iter().map(|element| match element {
            AnyElement::Ring(ring) if !ring.is_eased() => Some(ring),
            _ => None,
        });
        let rings: Vec<Option<&Ring>> = rings.collect();
        let mut all = Self::default();
        let mut next = 0;
        while let Some(first) = (next..rings.len()).find(|i| rings[*i].is_some()) {
            let own: Vec<&Ring> = rings[first..].iter().take(WIDTH).map_while(|ring| *ring).collect();
            let count = together(&own);
            all.block_of.resize(rings.len(), None);
            all.block_of[first..first + count].fill(Some(all.blocks.len() as u32));
            all.blocks.push(RingBlock::new(&own[..count], first, nodes, history(first)));
            next = first + count;
        }
        all
    }

    /// The block of an element, and where its elements end; those of what is computed alone end behind it.
    pub fn block_at(&self, element: usize) -> (Option<usize>, usize) {
        let block = self.block_of.get(element).copied().flatten().map(|block| block as usize);
        (block, block.map_or(element + 1, |block| self.blocks[block].elements.end))
    }

    /// Elements of a block.
    pub fn elements(&self, block: usize) -> Range<usize> {
        self.blocks[block].elements.clone()
    }

    /// Compute force and history of a block in the middle of an explicit step that began at the displacements `start` [m], no
    /// node further than `farthest` [m] from there. Returns the largest share of its strength that a ring uses at the step's end as
    /// long as nothing holds it up, or an upper bound of it below [`FAR`].
    pub fn pull_ahead(
        &mut self,
        block: usize,
        (start, middle): (&[f64], &[f64]),
        farthest: f64,
        history: &[f64],
    ) -> f64 {
        let block = &self.blocks[block];
        let share = |forces: &Lanes| {
            let shares = forces.iter().zip(&block.strength).take(block.count());
            shares.fold(0.0, |most, (force, strength)| f64::max(most, force / strength))
        };
        of_kind!(self, block, |places, columns, memory| {
            memory.gather(block, places, middle, history);
            memory.pull(columns, farthest);
            // Mostly no ring is near its strength, however its nodes go on.
            let bound = if block.breakable { share(&memory.bound) } else { 0.0 };
            if bound < FAR {
                bound
            } else {
                gather(places, block.nodes, start, &mut memory.ahead);
                memory.look_ahead();
                share(&memory.tensions(columns, &memory.ahead))
            }
        })
    }

    /// Take the forces of a block that [`Rings::pull_ahead`] has computed from `force` [N], and write their histories. Returns
    /// the largest force of a perimeter [N].
    pub fn hand_back(&mut self, block: usize, force: &mut [f64], history: &mut [f64]) -> f64 {
        let block = &self.blocks[block];
        of_kind!(self, block, |places, _columns, memory| memory.hand_back(block, places, force, history))
    }

    /// What the perimeters of a block carry at `u` [N], 0 where it is broken, in the order of its elements.
    pub fn tensions(&mut self, block: usize, u: &[f64], history: &[f64]) -> Lanes {
        let block = &self.blocks[block];
        of_kind!(self, block, |places, columns, memory| {
            memory.gather(block, places, u, history);
            memory.tensions(columns, &memory.u)
        })
    }

    /// Add the energies of a block at `u` [J], 0 as modelled, to `sum`, in the order of its elements. Returns whether it could,
    /// as what is broken has to be asked alone; and what the perimeters carry there, as [`Rings::tensions`].
    pub fn add_energy(
        &mut self,
        block: usize,
        u: &[f64],
        history: &[f64],
        sum: &mut Energy,
    ) -> (bool, Lanes) {
        let block = &self.blocks[block];
        of_kind!(self, block, |places, columns, memory| {
            memory.gather(block, places, u, history);
            memory.measure(columns);
            (memory.add_energy(block, sum), memory.tension)
        })
    }

    /// Number of blocks.
    pub fn block_count(&self) -> usize {
        self.blocks.len()
    }
}

/// How many of these rings, the first and those that follow it, make a block.
fn together(rings: &[&Ring]) -> usize {
    let first = rings[0];
    let alike = rings.iter().take_while(|ring| ring.nodes.len() == first.nodes.len()).count();
    let in_row = |l: &usize| rings[*l].nodes.iter().zip(&first.nodes).all(|(node, from)| *node == from + l);
    let row = (0..alike).take_while(in_row).count();
    if row >= SHORTEST_ROW { row } else { alike }
}

impl RingBlock {
    fn new(rings: &[&Ring], first: usize, nodes: usize, history: usize) -> Self {
        let lanes: [&Ring; WIDTH] = std::array::from_fn(|l| rings[l.min(rings.len() - 1)]);
        let place = |a: usize| SameCorner::new(rings, lanes.map(|ring| ring.nodes[a]), nodes);
        let (constants, modelled) = if lanes[0].nodes.len() == 3 {
            let columns = columns_of::<3, 3>(&lanes);
            (BlockKind::Three(Box::new((std::array::from_fn(place), columns.0))), columns.1)
        } else {
            let columns = columns_of::<4, 2>(&lanes);
            (BlockKind::Four(Box::new((std::array::from_fn(place), columns.0))), columns.1)
        };
        Self {
            elements: first..first + rings.len(),
            nodes,
            history,
            strength: lanes.map(|ring| ring.rupture),
            breakable: rings.iter().any(|ring| Element::constants(*ring).can_break),
            modelled,
            constants,
        }
    }

    fn count(&self) -> usize {
        self.elements.len()
    }

    #[cfg(test)]
    fn is_row(&self) -> bool {
        let in_row = |place: &SameCorner| matches!(place, SameCorner::Row(_));
        match &self.constants {
            BlockKind::Three(own) => own.0.iter().all(in_row),
            BlockKind::Four(own) => own.0.iter().all(in_row),
        }
    }
}

/// Constants of rings, and their energies as modelled [J].
fn columns_of<const N: usize, const W: usize>(lanes: &[&Ring; WIDTH]) -> (BlockConstants<N>, Lanes) {
    let constants = lanes.map(|ring| ring.constants::<N>());
    let still = ([[0.0; 3]; N], (0.0, [0.0; W]));
    let modelled = constants.map(|ring| ring.energy::<W>(&still.0, &still.1).0);
    (BlockConstants::new(&constants), modelled)
}

impl SameCorner {
    /// At these nodes, of which there are `nodes` in all.
    fn new(rings: &[&Ring], own: [usize; WIDTH], nodes: usize) -> Self {
        let row = (0..rings.len()).all(|l| own[l] == own[0] + l);
        // What a row has beyond the last ring is computed and left.
        if row && own[0] + WIDTH <= nodes {
            Self::Row(own[0])
        } else {
            Self::Each(own.map(|node| node as u32))
        }
    }
}

impl<const N: usize, const W: usize> BlockMemory<N, W> {
    fn gather(&mut self, block: &RingBlock, places: &[SameCorner; N], u: &[f64], history: &[f64]) {
        gather(places, block.nodes, u, &mut self.u);
        let own = history[block.history..].chunks_exact(WIDTHS + W);
        for (l, own) in own.take(block.count()).enumerate() {
            self.broken[l] = own[BROKEN];
            self.had.1[l] = own[PERIMETER];
            for (most, own) in self.had.0.iter_mut().zip(&own[WIDTHS..]) {
                most[l] = *own;
            }
        }
    }

    /// Twice as far from the displacements in `ahead` as those of the nodes are.
    fn look_ahead(&mut self) {
        let ahead = self.ahead.as_flattened_mut().as_flattened_mut();
        for (start, middle) in ahead.iter_mut().zip(self.u.as_flattened().as_flattened()) {
            *start += 2.0 * (middle - *start);
        }
    }

    fn hand_back(
        &self,
        block: &RingBlock,
        places: &[SameCorner; N],
        force: &mut [f64],
        history: &mut [f64],
    ) -> f64 {
        for (place, own) in places.iter().zip(&self.force) {
            for (c, own) in own.iter().enumerate() {
                let to = &mut force[c * block.nodes..][..block.nodes];
                match place {
                    SameCorner::Row(first) => {
                        let to = &mut to[*first..*first + WIDTH];
                        for l in 0..block.count() {
                            to[l] -= own[l];
                        }
                    }
                    SameCorner::Each(nodes) => {
                        for l in 0..block.count() {
                            to[nodes[l] as usize] -= own[l];
                        }
                    }
                }
            }
        }
        let all = history[block.history..].chunks_exact_mut(WIDTHS + W);
        for (l, to) in all.take(block.count()).enumerate() {
            to[PERIMETER] = self.most.1[l];
            for (to, most) in to[WIDTHS..].iter_mut().zip(&self.most.0) {
                *to = most[l];
            }
        }
        self.tension[..block.count()].iter().copied().fold(0.0, f64::max)
    }

    fn add_energy(&self, block: &RingBlock, sum: &mut Energy) -> bool {
        let own = 0..block.count();
        if self.broken[own.clone()].iter().any(|broken| *broken > 0.0) {
            return false;
        }
        for l in own {
            sum.stored += self.stored[l] - block.modelled[l];
            sum.dissipated += self.dissipated[l];
        }
        true
    }
}

/// The numbers of `u` at `places`, of `nodes` nodes in all.
fn gather<const N: usize>(places: &[SameCorner; N], nodes: usize, u: &[f64], to: &mut NodeLanes<N>) {
    for (place, to) in places.iter().zip(to) {
        for (c, to) in to.iter_mut().enumerate() {
            let of = &u[c * nodes..][..nodes];
            match place {
                SameCorner::Row(first) => to.copy_from_slice(&of[*first..*first + WIDTH]),
                SameCorner::Each(own) => {
                    to.iter_mut().zip(own).for_each(|(to, node)| *to = of[*node as usize])
                }
            }
        }
    }
}

#[cfg(test)]
mod tests;
