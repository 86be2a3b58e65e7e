//! Rings, several at a time: force, history and energy, to the same bytes as [`crate::element::Ring`] alone.
//!
//! Rings that follow each other among the elements and have as many nodes form blocks of up to [`WIDTH`], with each quantity in
//! a column. A block is gathered, computed in wide registers by the formulas of [`crate::element::ring::formula`], and handed
//! back ring by ring in the order of the elements, so that sums at nodes stay as they are.

use crate::element::ring::formula::{Constants, Pull, Stiffness, Triple};
use crate::element::ring::{BROKEN, PERIMETER, WIDTHS};
use crate::element::{AnyElement, Element, Energy, Ring};
use crate::linear_algebra::lanes::wide;

/// Rings that are computed together.
pub const WIDTH: usize = 8;

/// A number of each of them.
type Column = [f64; WIDTH];
/// A vector at each of `N` nodes.
type Vectors<const N: usize> = [[Column; 3]; N];

/// Which block an element is in, and at which place.
#[derive(Debug, Clone, Copy)]
pub struct Seat {
    /// Number of the block.
    pub block: usize,
    /// Its ring.
    pub lane: usize,
}

/// The rings of a structure, in blocks.
#[derive(Debug, Clone, Default)]
pub struct Rings {
    blocks: Vec<AnyBlock>,
    /// Of each element; `None` where it is computed alone. Empty where there are no rings.
    seats: Vec<Option<Seat>>,
}

/// A block of rings over 3 or over 4 nodes.
#[derive(Debug, Clone)]
enum AnyBlock {
    Three(Box<Block<3, 3>>),
    Four(Box<Block<4, 2>>),
}

/// Up to [`WIDTH`] rings over `N` nodes with `W` widths.
#[derive(Debug, Clone)]
struct Block<const N: usize, const W: usize> {
    /// Where the numbers of each node of each ring begin, by component, and where the history of each ring does.
    dofs: [[[u32; WIDTH]; 3]; N],
    history: [usize; WIDTH],
    columns: Columns<N>,
    /// Energy as modelled [J].
    modelled: Column,
    /// Force of the perimeter at which each breaks [N], and whether any of them can.
    strength: Column,
    breakable: bool,
    state: State<N, W>,
    found: Found<N, W>,
}

/// Constants of each ring.
#[derive(Debug, Clone)]
struct Columns<const N: usize> {
    spans: Vectors<N>,
    perimeter: [Column; 4],
    width: [Column; 4],
}

/// What goes in.
#[derive(Debug, Clone)]
struct State<const N: usize, const W: usize> {
    u: Vectors<N>,
    /// Displacements at the start of an explicit step, of which `u` is the middle.
    start: Vectors<N>,
    most: [Column; W],
    most_perimeter: Column,
    broken: Column,
}

/// What comes out.
#[derive(Debug, Clone)]
struct Found<const N: usize, const W: usize> {
    force: Vectors<N>,
    tension: Column,
    most: [Column; W],
    most_perimeter: Column,
    /// Tension at the end of an explicit step if nothing held it up.
    ahead: Column,
    stored: Column,
    dissipated: Column,
}

const ZERO: Column = [0.0; WIDTH];

impl Rings {
    /// The rings among `elements`, where `dofs` and `history` say where each element has its degrees of freedom and where its
    /// history begins.
    pub fn new<'a>(
        elements: &[AnyElement],
        dofs: impl Fn(usize) -> &'a [usize],
        history: impl Fn(usize) -> usize,
    ) -> Self {
        let mut rings = Self::default();
        let sharp = |i: &usize| matches!(elements.get(*i), Some(AnyElement::Ring(ring)) if !ring.is_eased());
        let mut next = 0;
        while let Some(first) = (next..elements.len()).find(|i| sharp(i)) {
            let nodes = elements[first].nodes().len();
            let alike = (first..elements.len().min(first + WIDTH)).take_while(sharp);
            let count = alike.take_while(|i| elements[*i].nodes().len() == nodes).count();
            let lane = |l: usize| first + l.min(count - 1);
            let own: [&Ring; WIDTH] = std::array::from_fn(|l| match &elements[lane(l)] {
                AnyElement::Ring(ring) => ring,
                _ => unreachable!("only rings were counted"),
            });
            let places = std::array::from_fn(|l| (dofs(lane(l)), history(lane(l))));
            rings.blocks.push(if nodes == 3 {
                AnyBlock::Three(Box::new(Block::new(&own, &places)))
            } else {
                AnyBlock::Four(Box::new(Block::new(&own, &places)))
            });
            rings.seats.resize(elements.len(), None);
            for lane in 0..count {
                rings.seats[first + lane] = Some(Seat { block: rings.blocks.len() - 1, lane });
            }
            next = first + count;
        }
        rings
    }

    /// Where an element is; `None` where it is computed alone.
    pub fn seat(&self, element: usize) -> Option<Seat> {
        self.seats.get(element).copied().flatten()
    }

    /// Compute force and history of a block at the displacements `u` [m], from `history`.
    pub fn pull(&mut self, block: usize, u: &[f64], history: &[f64]) {
        match &mut self.blocks[block] {
            AnyBlock::Three(block) => {
                block.gather(u, history);
                pull_three(&block.columns, &block.state, &mut block.found);
            }
            AnyBlock::Four(block) => {
                block.gather(u, history);
                pull_four(&block.columns, &block.state, &mut block.found);
            }
        }
    }

    /// The same in the middle of an explicit step that began at the displacements `start` [m], and what the perimeters would
    /// carry at its end.
    pub fn pull_ahead(&mut self, block: usize, start: &[f64], middle: &[f64], history: &[f64]) {
        self.pull(block, middle, history);
        match &mut self.blocks[block] {
            AnyBlock::Three(block) if block.breakable => {
                gather(&block.dofs, start, &mut block.state.start);
                ahead_three(&block.columns, &block.state, &mut block.found);
            }
            AnyBlock::Four(block) if block.breakable => {
                gather(&block.dofs, start, &mut block.state.start);
                ahead_four(&block.columns, &block.state, &mut block.found);
            }
            _ => {}
        }
    }

    /// Compute the energies of a block and what its perimeters carry at `u` [m], from `history`.
    pub fn measure(&mut self, block: usize, u: &[f64], history: &[f64]) {
        match &mut self.blocks[block] {
            AnyBlock::Three(block) => {
                block.gather(u, history);
                measure_three(&block.columns, &block.state, &mut block.found);
            }
            AnyBlock::Four(block) => {
                block.gather(u, history);
                measure_four(&block.columns, &block.state, &mut block.found);
            }
        }
    }

    /// Take the force of a ring from `force` [N] and write its history. Returns what its perimeter carries [N].
    pub fn hand_back(&self, seat: Seat, force: &mut [f64], history: &mut [f64]) -> f64 {
        match &self.blocks[seat.block] {
            AnyBlock::Three(block) => block.hand_back(seat.lane, force, history),
            AnyBlock::Four(block) => block.hand_back(seat.lane, force, history),
        }
    }

    /// Whether a ring bears the step that [`Rings::pull_ahead`] has looked at, as long as nothing holds it up.
    pub fn bears(&self, seat: Seat) -> bool {
        match &self.blocks[seat.block] {
            AnyBlock::Three(block) => block.bears(seat.lane),
            AnyBlock::Four(block) => block.bears(seat.lane),
        }
    }

    /// What the perimeter of a ring carries [N], 0 where it is broken; see [`Rings::measure`] and [`Rings::pull`].
    pub fn tension(&self, seat: Seat) -> f64 {
        match &self.blocks[seat.block] {
            AnyBlock::Three(block) => block.found.tension[seat.lane],
            AnyBlock::Four(block) => block.found.tension[seat.lane],
        }
    }

    /// Stored and dissipated energy of a ring [J], 0 as modelled, without what it lost at rupture; `None` where it is
    /// broken. See [`Rings::measure`].
    pub fn energy(&self, seat: Seat) -> Option<Energy> {
        match &self.blocks[seat.block] {
            AnyBlock::Three(block) => block.energy(seat.lane),
            AnyBlock::Four(block) => block.energy(seat.lane),
        }
    }
}

impl<const N: usize, const W: usize> Block<N, W> {
    /// Of rings whose degrees of freedom and histories lie at `places`; where there are fewer, the last stands for the rest.
    fn new(rings: &[&Ring; WIDTH], places: &[(&[usize], usize); WIDTH]) -> Self {
        let mut block = Self {
            dofs: [[[0; WIDTH]; 3]; N],
            history: places.map(|(_, history)| history),
            columns: Columns { spans: [[ZERO; 3]; N], perimeter: [ZERO; 4], width: [ZERO; 4] },
            modelled: ZERO,
            strength: ZERO,
            breakable: rings.iter().any(|ring| ring.can_break()),
            state: State {
                u: [[ZERO; 3]; N],
                start: [[ZERO; 3]; N],
                most: [ZERO; W],
                most_perimeter: ZERO,
                broken: ZERO,
            },
            found: Found {
                force: [[ZERO; 3]; N],
                tension: ZERO,
                most: [ZERO; W],
                most_perimeter: ZERO,
                ahead: ZERO,
                stored: ZERO,
                dissipated: ZERO,
            },
        };
        for (l, (ring, (dofs, _))) in rings.iter().zip(places).enumerate() {
            let constants = ring.constants::<N>();
            block.modelled[l] = constants.energy::<W>(&[[0.0; 3]; N], &(0.0, [0.0; W])).0;
            block.columns.put(l, &constants);
            block.strength[l] = ring.rupture;
            for a in 0..N {
                for c in 0..3 {
                    block.dofs[a][c][l] = dofs[3 * a + c] as u32;
                }
            }
        }
        block
    }

    fn gather(&mut self, u: &[f64], history: &[f64]) {
        gather(&self.dofs, u, &mut self.state.u);
        for (l, first) in self.history.iter().enumerate() {
            let own = &history[*first..*first + WIDTHS + W];
            self.state.broken[l] = own[BROKEN];
            self.state.most_perimeter[l] = own[PERIMETER];
            for j in 0..W {
                self.state.most[j][l] = own[WIDTHS + j];
            }
        }
    }

    fn bears(&self, l: usize) -> bool {
        !self.breakable || self.found.ahead[l] <= self.strength[l]
    }

    fn hand_back(&self, l: usize, force: &mut [f64], history: &mut [f64]) -> f64 {
        for (dofs, own) in self.dofs.iter().zip(&self.found.force) {
            for c in 0..3 {
                force[dofs[c][l] as usize] -= own[c][l];
            }
        }
        let own = &mut history[self.history[l]..][..WIDTHS + W];
        own[PERIMETER] = self.found.most_perimeter[l];
        for j in 0..W {
            own[WIDTHS + j] = self.found.most[j][l];
        }
        self.found.tension[l]
    }

    fn energy(&self, l: usize) -> Option<Energy> {
        let whole = self.state.broken[l] <= 0.0;
        whole.then(|| Energy {
            stored: self.found.stored[l] - self.modelled[l],
            dissipated: self.found.dissipated[l],
        })
    }
}

fn gather<const N: usize>(dofs: &[[[u32; WIDTH]; 3]; N], u: &[f64], to: &mut Vectors<N>) {
    for (dofs, to) in dofs.iter().zip(to) {
        for c in 0..3 {
            for l in 0..WIDTH {
                to[c][l] = u[dofs[c][l] as usize];
            }
        }
    }
}

impl<const N: usize> Columns<N> {
    fn put(&mut self, l: usize, ring: &Constants<N>) {
        for a in 0..N {
            for c in 0..3 {
                self.spans[a][c][l] = ring.spans[a][c];
            }
        }
        for (columns, of) in [(&mut self.perimeter, ring.perimeter), (&mut self.width, ring.width)] {
            for (column, value) in columns.iter_mut().zip([of.start, of.loading, of.unloading, of.lost]) {
                column[l] = value;
            }
        }
    }

    /// The constants of one of them.
    #[inline(always)]
    fn ring(&self, l: usize) -> Constants<N> {
        let mechanism = |of: &[Column; 4]| Stiffness {
            start: of[0][l],
            loading: of[1][l],
            unloading: of[2][l],
            lost: of[3][l],
        };
        Constants {
            spans: lane(&self.spans, l),
            perimeter: mechanism(&self.perimeter),
            width: mechanism(&self.width),
        }
    }
}

/// The vectors of one ring.
#[inline(always)]
fn lane<const N: usize>(columns: &Vectors<N>, l: usize) -> [Triple; N] {
    let mut own = [[0.0; 3]; N];
    for a in 0..N {
        for c in 0..3 {
            own[a][c] = columns[a][c][l];
        }
    }
    own
}

impl<const N: usize, const W: usize> State<N, W> {
    /// Largest extensions of one ring.
    #[inline(always)]
    fn most(&self, l: usize) -> (f64, [f64; W]) {
        let mut own = [0.0; W];
        for j in 0..W {
            own[j] = self.most[j][l];
        }
        (self.most_perimeter[l], own)
    }
}

#[inline(always)]
fn pull_each<const N: usize, const W: usize>(
    columns: &Columns<N>,
    state: &State<N, W>,
    found: &mut Found<N, W>,
) {
    for l in 0..WIDTH {
        let (u, most) = (lane(&state.u, l), state.most(l));
        let Pull { force, tension, most: now } = columns.ring(l).pull::<W>(&u, &most);
        let broken = state.broken[l] > 0.0;
        found.tension[l] = if broken { 0.0 } else { tension };
        for a in 0..N {
            for c in 0..3 {
                found.force[a][c][l] = if broken { 0.0 } else { force[a][c] };
            }
        }
        found.most_perimeter[l] = if broken { most.0 } else { now.0 };
        for j in 0..W {
            found.most[j][l] = if broken { most.1[j] } else { now.1[j] };
        }
    }
}

#[inline(always)]
fn ahead_each<const N: usize, const W: usize>(
    columns: &Columns<N>,
    state: &State<N, W>,
    found: &mut Found<N, W>,
) {
    for l in 0..WIDTH {
        let (start, mut u) = (lane(&state.start, l), lane(&state.u, l));
        for a in 0..N {
            for c in 0..3 {
                u[a][c] = start[a][c] + 2.0 * (u[a][c] - start[a][c]);
            }
        }
        let ring = columns.ring(l);
        let (tension, _) = ring.perimeter.force(ring.sides(&u).perimeter, state.most_perimeter[l]);
        found.ahead[l] = if state.broken[l] > 0.0 { 0.0 } else { tension };
    }
}

#[inline(always)]
fn measure_each<const N: usize, const W: usize>(
    columns: &Columns<N>,
    state: &State<N, W>,
    found: &mut Found<N, W>,
) {
    for l in 0..WIDTH {
        let (u, most) = (lane(&state.u, l), state.most(l));
        let ring = columns.ring(l);
        let (tension, _) = ring.perimeter.force(ring.sides(&u).perimeter, most.0);
        found.tension[l] = if state.broken[l] > 0.0 { 0.0 } else { tension };
        (found.stored[l], found.dissipated[l]) = ring.energy::<W>(&u, &most);
    }
}

wide! {
    fn pull_three(columns: &Columns<3>, state: &State<3, 3>, found: &mut Found<3, 3>) {
        pull_each(columns, state, found)
    }
}

wide! {
    fn pull_four(columns: &Columns<4>, state: &State<4, 2>, found: &mut Found<4, 2>) {
        pull_each(columns, state, found)
    }
}

wide! {
    fn ahead_three(columns: &Columns<3>, state: &State<3, 3>, found: &mut Found<3, 3>) {
        ahead_each(columns, state, found)
    }
}

wide! {
    fn ahead_four(columns: &Columns<4>, state: &State<4, 2>, found: &mut Found<4, 2>) {
        ahead_each(columns, state, found)
    }
}

wide! {
    fn measure_three(columns: &Columns<3>, state: &State<3, 3>, found: &mut Found<3, 3>) {
        measure_each(columns, state, found)
    }
}

wide! {
    fn measure_four(columns: &Columns<4>, state: &State<4, 2>, found: &mut Found<4, 2>) {
        measure_each(columns, state, found)
    }
}
