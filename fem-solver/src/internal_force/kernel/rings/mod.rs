//! Rings, several at a time: force, history and energy, to the same bytes as [`crate::element::Ring`] alone.
//!
//! Rings that follow each other among the elements, of one law with the same numbers and as many nodes, form blocks of up to
//! [`WIDTH`], with each quantity in a column. A block is gathered, computed in wide registers by the [`Formula`] of its law, and
//! handed back. Where the nodes of neighbours have consecutive numbers, as in the rows of a generated net, nodes are columns of the
//! structure already, and blocks end where rows do. Forces are handed back node by node of the rings: in a generated net
//! every node takes them in the order of the elements, as it does of rings one by one.

mod columns;

use self::columns::{BlockConstants, BlockMemory, NodeLanes};
use crate::element::ring::formula::Formula;
use crate::element::ring::mechanisms::Mechanisms;
use crate::element::ring::wire::Wire;
use crate::element::ring::{BROKEN, PERIMETER, RingLaw, WIDTHS};
use crate::element::{AnyElement, Energy, FAR};
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
    wire_three: BlockMemory<3, 0>,
    wire_four: BlockMemory<4, 0>,
}

/// Up to [`WIDTH`] rings.
#[derive(Debug, Clone)]
struct RingBlock {
    /// Their elements.
    elements: Range<usize>,
    /// Number of all nodes.
    nodes: usize,
    /// Index at which the history of the first begins; the others follow it.
    history: usize,
    /// Energies as modelled [J], stored and dissipated.
    modelled: (Lanes, Lanes),
    constants: BlockKind,
}

/// Nodes and constants. Numbers beyond the last ring repeat it.
type Own<const N: usize, F> = Box<([SameCorner; N], BlockConstants<N, F>)>;

/// By law and number of nodes.
#[derive(Debug, Clone)]
enum BlockKind {
    Three(Own<3, Mechanisms<3, 3>>),
    Four(Own<4, Mechanisms<4, 2>>),
    WireThree(Own<3, Wire<3>>),
    WireFour(Own<4, Wire<4>>),
}

/// The nodes that are at one place of each ring.
#[derive(Debug, Clone, Copy)]
enum SameCorner {
    /// Consecutive numbers from this on.
    Row(usize),
    /// These.
    Each([u32; WIDTH]),
}

/// Does the same with a block of any kind: with its places and columns, and the memory of its kind.
macro_rules! of_kind {
    ($rings:expr, $block:expr, |$places:ident, $columns:ident, $memory:ident| $what:expr) => {
        of_kind!($rings, $block, |$places, $columns, $memory| $what; Three three, Four four, WireThree wire_three, WireFour wire_four)
    };
    ($rings:expr, $block:expr, |$places:ident, $columns:ident, $memory:ident| $what:expr; $($kind:ident $own:ident),*) => {
        match &$block.constants {
            $(BlockKind::$kind(own) => {
                let (($places, $columns), $memory) = (&**own, &mut $rings.$own);
                $what
            })*
        }
    };
}

/// The law of an element that is a ring; of one that goes slack gradually none is computed here.
fn law(element: &AnyElement) -> Option<RingLaw> {
    match element {
        AnyElement::Ring(ring) if !ring.is_eased() => Some(ring.law),
        _ => None,
    }
}

impl Rings {
    /// The rings among `elements` between `nodes` nodes, where `history` says where the history of each element begins.
    /// Those of a block are all in one part, whose numbers are `parts`.
    pub fn new(
        elements: &[AnyElement],
        nodes: usize,
        parts: &[u32],
        history: impl Fn(usize) -> usize,
    ) -> Self {
        let (mut all, mut next) = (Self::default(), 0);
        while next < elements.len() {
            let own = parts[next..].iter().take(WIDTH).take_while(|part| **part == parts[next]).count();
            let own = &elements[next..next + own];
            let Some(block) = RingBlock::first_of(own, (next, nodes, history(next))) else {
                next += 1;
                continue;
            };
            next = block.elements.end;
            all.block_of.resize(elements.len(), None);
            all.block_of[block.elements.clone()].fill(Some(all.blocks.len() as u32));
            all.blocks.push(block);
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
        of_kind!(self, block, |places, columns, memory| {
            memory.gather(block, places, middle, history);
            memory.pull(columns, farthest);
            // Mostly no ring is near its strength, however its nodes go on.
            let bound = memory.share_bound(columns, block.count());
            if bound < FAR {
                return bound;
            }
            gather(places, block.nodes, start, &mut memory.ahead);
            memory.look_ahead();
            memory.share_ahead(columns, block.count())
        })
    }

    /// Largest share of its strength that a ring of a block uses where [`Rings::pull_ahead`] has computed it, the most drawn one with
    /// `tension` [N]; or an upper bound that is not above `most`.
    pub fn share(&mut self, block: usize, tension: f64, most: f64) -> f64 {
        let block = &self.blocks[block];
        of_kind!(self, block, |_places, columns, memory| {
            memory.share_above(columns, block.count(), (tension, most))
        })
    }

    /// Take the forces of a block that [`Rings::pull_ahead`] has computed from `force` [N], and write their histories. Returns
    /// the largest force of a perimeter [N].
    pub fn hand_back(&mut self, block: usize, force: &mut [f64], history: &mut [f64]) -> f64 {
        let block = &self.blocks[block];
        of_kind!(self, block, |places, _columns, memory| memory.hand_back(block, places, force, history))
    }

    /// Tensions of the perimeters of a block at `u` [N], 0 where it is broken, in the order of its elements.
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

/// Number of these rings, the first and those that follow it, that make a block.
fn together(rings: &[AnyElement]) -> usize {
    let first = rings[0].nodes();
    let in_row = |l: &usize| rings[*l].nodes().iter().zip(first).all(|(node, from)| *node == from + l);
    let row = (0..rings.len()).take_while(in_row).count();
    if row >= SHORTEST_ROW { row } else { rings.len() }
}

impl RingBlock {
    /// The block that begins with these `elements`, of which the first is number `place.0`, between `place.1` nodes, and has its
    /// history at `place.2`.
    fn first_of(elements: &[AnyElement], place: (usize, usize, usize)) -> Option<Self> {
        macro_rules! of {
            ($kind:ident) => {
                Self::new(
                    elements,
                    place,
                    |element| match law(element) {
                        Some(RingLaw::$kind(law)) => Some(law),
                        _ => None,
                    },
                    BlockKind::$kind,
                )
            };
        }
        match law(elements.first()?)? {
            RingLaw::Three(_) => of!(Three),
            RingLaw::Four(_) => of!(Four),
            RingLaw::WireTwo(_) => None,
            RingLaw::WireThree(_) => of!(WireThree),
            RingLaw::WireFour(_) => of!(WireFour),
        }
    }

    /// The same of one kind.
    fn new<const N: usize, const W: usize, F: Formula<N, W>>(
        elements: &[AnyElement],
        (first, nodes, history): (usize, usize, usize),
        formulas: fn(&AnyElement) -> Option<F>,
        kind: fn(Own<N, F>) -> BlockKind,
    ) -> Option<Self> {
        let still = [[0.0; 3]; N];
        let law = formulas(elements.first()?)?.over(still);
        let of = |element: &AnyElement| formulas(element).filter(|own| own.over(still) == law);
        let alike = elements.iter().take(WIDTH).take_while(|element| of(element).is_some()).count();
        let rings = &elements[..together(&elements[..alike])];
        let lanes: [&AnyElement; WIDTH] = std::array::from_fn(|l| &rings[l.min(rings.len() - 1)]);
        let place = |a: usize| SameCorner::new(rings.len(), lanes.map(|ring| ring.nodes()[a]), nodes);
        let constants = lanes.map(|ring| of(ring).unwrap_or(law));
        let modelled = constants.map(|ring| ring.modelled());
        let spans = constants.map(|ring| ring.spans());
        let spans = std::array::from_fn(|a| [0, 1, 2].map(|c| spans.map(|of| of[a][c])));
        Some(Self {
            elements: first..first + rings.len(),
            nodes,
            history,
            modelled: (modelled.map(|energy| energy.0), modelled.map(|energy| energy.1)),
            constants: kind(Box::new((std::array::from_fn(place), BlockConstants { spans, law }))),
        })
    }

    fn count(&self) -> usize {
        self.elements.len()
    }

    #[cfg(test)]
    fn is_row(&self) -> bool {
        let in_row = |place: &SameCorner| matches!(place, SameCorner::Row(_));
        of_kind!(Rings::default(), self, |places, _columns, _memory| places.iter().all(in_row))
    }
}

impl SameCorner {
    /// At these nodes of so many rings; there are `nodes` in all.
    fn new(count: usize, own: [usize; WIDTH], nodes: usize) -> Self {
        let row = (0..count).all(|l| own[l] == own[0] + l);
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
            sum.stored += self.stored[l] - block.modelled.0[l];
            sum.dissipated += self.dissipated[l] - block.modelled.1[l];
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
