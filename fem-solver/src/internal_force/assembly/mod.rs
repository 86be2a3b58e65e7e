//! All elements that are not in the fast kernel, one by one: their forces, histories, tangents, energies.

mod rupture;
#[cfg(test)]
mod tests;

pub use self::rupture::{Broken, Event, take_largest};
use self::rupture::{Release, Stretch};
use crate::element::{Answer, AnyElement, CLOSE, Constants, Energy, Pace, Piece, Slack};
use crate::internal_force::kernel::rings::{Rings, WIDTH};
use crate::model::Model;
use interface_defs::{ShareOf, Utilisation};
use nalgebra::Vector3;
use std::ops::Range;

/// Places of an element's numbers in those of all.
#[derive(Debug, Clone)]
struct ElementPlace {
    dofs: Range<usize>,
    history: Range<usize>,
    constants: Constants,
}

impl ElementPlace {
    /// The axial force of its element, where it counts among those of cables, ropes, rings and brakes: a post or a support is none of
    /// them.
    fn counted(&self, tension: f64) -> f64 {
        if self.constants.has_moments || self.constants.lines == 0 { 0.0 } else { tension }
    }
}

/// Displacements in a time from now, and what moves there.
#[derive(Debug, Clone, Copy)]
pub struct Heading<'a> {
    /// Displacements now [m].
    pub u: &'a [f64],
    /// Velocities [m/s].
    pub v: &'a [f64],
    /// Time ahead [s].
    pub ahead: f64,
}

/// The elements of a structure, with memory for one of them.
#[derive(Debug, Clone, Default)]
pub struct Assembly {
    places: Vec<ElementPlace>,
    /// Time between the history and the displacements asked for, for the dashpots of elements.
    pub pace: Pace,
    /// Degrees of freedom of all elements, one after the other.
    dofs: Vec<usize>,
    u: Vec<f64>,
    force: Vec<f64>,
    tangent: Vec<f64>,
    history: Vec<f64>,
    /// Ruptures as the history was last advanced.
    pub broken: Vec<Broken>,
    /// Elements that began to yield as the history was last advanced, with their largest axial force [N].
    pub yielded: Vec<(u32, f64)>,
    /// Largest share of its strength that anything used in explicit steps since somebody set this to 0.
    pub used: f64,
    /// Each element that used more than [`CLOSE`] of it since somebody cleared this, with the largest share.
    pub close: Vec<(u32, f64)>,
    /// Of each element which of [`Model::accounted`] it is in, and the largest utilisation of each of these, at `now` [s] or before;
    /// empty where nobody asks.
    accounts: Vec<u32>,
    used_parts: Vec<Utilisation>,
    now: f64,
    /// Beams with fibres, whose sections are asked for at the ends of windows.
    sections: Vec<usize>,
    /// Ruptures within the last explicit step, and the forces of these elements over the step, one after the other [N].
    releases: Vec<Release>,
    released: Vec<f64>,
    /// History of one element that breaks.
    torn: Vec<f64>,
    /// Rings that are computed several at a time.
    rings: Rings,
    /// Of each block in which of the readings its tensions were computed, and these [N]; and the number of the current reading.
    read: Vec<(u64, [f64; WIDTH])>,
    reading: u64,
}

impl Assembly {
    /// For the elements of `model`.
    pub fn new(model: &Model) -> Self {
        let mut assembly = Self::default();
        for (element, history) in model.elements.iter().zip(model.histories()) {
            let (first, constants) = (assembly.dofs.len(), element.constants());
            for node in element.nodes() {
                assembly.dofs.extend((0..3).map(|c| model.dof(*node, c)));
                if constants.rotates {
                    assembly.dofs.extend((0..3).filter_map(|c| model.rotation(*node, c)));
                }
            }
            let dofs = first..assembly.dofs.len();
            assembly.places.push(ElementPlace { dofs, history, constants });
        }
        let most = |of: fn(&ElementPlace) -> usize| assembly.places.iter().map(of).max().unwrap_or(0);
        let (widest, longest) = (most(|place| place.dofs.len()), most(|place| place.history.len()));
        (assembly.u, assembly.force) = (vec![0.0; widest], vec![0.0; widest]);
        (assembly.tangent, assembly.history) = (vec![0.0; widest * widest], vec![0.0; longest]);
        assembly.reserve_ruptures(&model.elements);
        assembly.accounts = model.accounts();
        let section = |i: &usize| {
            assembly.places[*i].constants.has_moments && assembly.places[*i].constants.plastic.is_some()
        };
        assembly.sections = (0..assembly.places.len()).filter(section).collect();
        assembly
    }

    /// The same with rings several at a time in explicit steps, energies and tensions, which then are asked for the elements of
    /// this `model` alone.
    pub fn with_blocks(model: &Model) -> Self {
        let mut assembly = Self::new(model);
        let places = &assembly.places;
        let history = |i: usize| places[i].history.start;
        assembly.rings = Rings::new(&model.elements, model.node_count(), &assembly.accounts, history);
        assembly.read = vec![(0, [0.0; WIDTH]); assembly.rings.block_count()];
        assembly
    }

    /// Whether there is nothing to do.
    pub fn is_empty(&self) -> bool {
        self.places.is_empty()
    }

    /// Degrees of freedom of element number `element`.
    pub fn dofs(&self, element: usize) -> &[usize] {
        &self.dofs[self.places[element].dofs.clone()]
    }

    /// History of element number `element` in that of all.
    pub fn history<'a>(&self, element: usize, of: &'a [f64]) -> &'a [f64] {
        &of[self.places[element].history.clone()]
    }

    /// Displacements of element number `element` out of `u`.
    pub fn gather(&mut self, element: usize, u: &[f64]) -> &[f64] {
        let dofs = &self.dofs[self.places[element].dofs.clone()];
        let local = &mut self.u[..dofs.len()];
        local.iter_mut().zip(dofs).for_each(|(to, dof)| *to = u[*dof]);
        local
    }

    /// The same, of its own.
    pub fn gathered(&self, element: usize, u: &[f64]) -> Vec<f64> {
        self.dofs(element).iter().map(|dof| u[*dof]).collect()
    }

    /// Take the internal forces at the displacements `u` from `force` [N]. Returns the largest axial
    /// force, squared [N2].
    pub fn subtract(
        &mut self,
        elements: &[AnyElement],
        u: &[f64],
        history: &[f64],
        force: &mut [f64],
    ) -> f64 {
        let mut largest = 0.0;
        for (i, element) in elements.iter().enumerate() {
            let tension = self.respond(i, element, u, history, None);
            self.take_force(i, force);
            largest = f64::max(largest, self.places[i].counted(tension));
        }
        largest * largest
    }

    /// The same over an explicit step from the displacements `start`, at those in its middle, where no node is further than
    /// `farthest` [m] from there; `history` becomes that at the middle, and what breaks within the step pulls until it does.
    pub fn subtract_and_advance(
        &mut self,
        elements: &[AnyElement],
        ((start, middle), farthest): ((&[f64], &[f64]), f64),
        history: &mut [f64],
        force: &mut [f64],
    ) -> f64 {
        self.broken.clear();
        self.yielded.clear();
        self.releases.clear();
        self.released.clear();
        let (mut largest, mut next) = (0.0, 0);
        while next < elements.len() {
            let (block, end) = self.rings.block_at(next);
            let ahead =
                block.map(|block| (block, self.rings.pull_ahead(block, (start, middle), farthest, history)));
            self.used = self.used.max(ahead.map_or(0.0, |(_, used)| used));
            match ahead {
                Some((block, used)) if used <= CLOSE => {
                    let tension = self.rings.hand_back(block, force, history);
                    self.note_block(next, block, tension);
                    largest = f64::max(largest, tension);
                }
                // Where a block has a ring that may not bear the step, too.
                _ => {
                    for (number, element) in elements.iter().enumerate().take(end).skip(next) {
                        let of = Stretch { number, element, start, middle };
                        largest = f64::max(largest, self.subtract_one(&of, history, force));
                    }
                }
            }
            next = end;
        }
        largest * largest
    }

    /// The same of one element.
    fn subtract_one(&mut self, of: &Stretch, history: &mut [f64], force: &mut [f64]) -> f64 {
        let can_break = self.places[of.number].constants.can_break;
        let broken = if can_break { self.break_within(of, history) } else { None };
        let tension = match broken {
            Some(broken) => broken.tension,
            None => self.respond(of.number, of.element, of.middle, history, None),
        };
        self.broken.extend(broken);
        self.note_force(of.number, of.element, tension, broken.map_or(0.0, |broken| broken.share));
        self.take_force(of.number, force);
        self.note_yield(of.number, history, tension);
        self.take_history(of.number, history);
        self.places[of.number].counted(tension)
    }

    /// From now on, at `now` [s], the largest utilisations are these; those so far are in their place.
    pub fn follow(&mut self, used_parts: &mut Vec<Utilisation>, now: f64) {
        std::mem::swap(&mut self.used_parts, used_parts);
        self.now = now;
    }

    /// An element uses this share of what it bears.
    fn note_used(&mut self, element: usize, (share, of): (f64, ShareOf)) {
        let account = self.used_parts.get_mut(self.accounts[element] as usize);
        if let Some(account) = account.filter(|account| share > account.share) {
            *account = Utilisation { share, of, time: self.now };
        }
    }

    /// The same of the rings of a block from number `first` on, of which the most drawn one carries `tension` [N].
    fn note_block(&mut self, first: usize, block: usize, tension: f64) {
        if let Some(most) = self.used_parts.get(self.accounts[first] as usize) {
            let share = self.rings.share(block, tension, most.share);
            self.note_used(first, (share, ShareOf::Force));
        }
    }

    /// The same by its axial force `tension` [N] in the answer at hand, and at `least`.
    fn note_force(&mut self, number: usize, element: &AnyElement, tension: f64, least: f64) {
        let ElementPlace { dofs, history, constants } = &self.places[number];
        if constants.lines > 0 || constants.can_break {
            let own = &self.history[..history.len()];
            let (share, of) = element.utilisation(&self.u[..dofs.len()], tension, own);
            self.note_used(number, (share.max(least), of));
        }
    }

    /// The same of sections that yield, at `u`.
    pub fn note_sections(&mut self, elements: &[AnyElement], u: &[f64], history: &[f64]) {
        for at in 0..self.sections.len() {
            let number = self.sections[at];
            let (element, own) = (&elements[number], &history[self.places[number].history.clone()]);
            let u = self.gather(number, u);
            let share = element.plastic_utilisation(u, own).max(element.strain_utilisation(u, own));
            self.note_used(number, (share, ShareOf::Section));
        }
    }

    /// Take the force of the answer at hand, that of element number `element`, from `force`.
    fn take_force(&self, element: usize, force: &mut [f64]) {
        self.dofs(element).iter().zip(&self.force).for_each(|(dof, f)| force[*dof] -= f);
    }

    /// Its history becomes that of the answer.
    fn take_history<'a>(&self, element: usize, history: &'a mut [f64]) -> &'a mut [f64] {
        let own = &mut history[self.places[element].history.clone()];
        own.copy_from_slice(&self.history[..own.len()]);
        own
    }

    /// Whether the answer at hand, that of element number `element`, is the first in which it yields.
    fn note_yield(&mut self, element: usize, history: &[f64], tension: f64) {
        let ElementPlace { history: own, constants, .. } = &self.places[element];
        let begins = |at| history[own.start + at] == 0.0 && self.history[at] > 0.0;
        if constants.plastic.is_some_and(begins) {
            self.yielded.push((element as u32, tension));
        }
    }

    /// `history` becomes that at `u`.
    pub fn advance(&mut self, elements: &[AnyElement], u: &[f64], history: &mut [f64]) {
        self.broken.clear();
        self.yielded.clear();
        for (i, element) in elements.iter().enumerate() {
            let tension = self.respond(i, element, u, history, None);
            self.note_yield(i, history, tension);
            self.note_force(i, element, tension, 0.0);
            let own = self.take_history(i, history);
            let u = &self.u[..self.places[i].dofs.len()];
            if element.breaks(u, own) {
                let share = element.force_utilisation(u, tension).max(element.strain_utilisation(u, own));
                self.broken.push(Broken { element: i as u32, tension, part: 1.0, share });
            }
        }
    }

    /// `history` becomes that at `u` where nodes turn, and stays as it is elsewhere.
    pub fn advance_rotations(&mut self, elements: &[AnyElement], u: &[f64], history: &mut [f64]) {
        for (i, element) in elements.iter().enumerate() {
            if !self.places[i].constants.rotates {
                continue;
            }
            self.respond(i, element, u, history, None);
            // What would yield on the way to a rest shape does not: plastic strains stand behind the rotations.
            let ElementPlace { history: own, constants, .. } = &self.places[i];
            if let Some(plastic) = constants.plastic {
                self.history[plastic..own.len()].copy_from_slice(&history[own.start + plastic..own.end]);
            }
            self.take_history(i, history);
        }
    }

    /// Answer of one element into the memory of this; returns its largest axial force.
    fn respond(
        &mut self,
        i: usize,
        element: &AnyElement,
        u: &[f64],
        history: &[f64],
        slack: Option<Slack>,
    ) -> f64 {
        self.gather(i, u);
        self.answer(i, element, history, slack)
    }

    /// The same at the displacements in the memory of this.
    fn answer(&mut self, i: usize, element: &AnyElement, history: &[f64], slack: Option<Slack>) -> f64 {
        let place = &self.places[i];
        let (n, m) = (place.dofs.len(), place.history.len());
        let mut answer = Answer {
            force: &mut self.force[..n],
            tangent: slack.is_some().then_some(&mut self.tangent[..n * n]),
            slack: slack.unwrap_or(Slack::Exact),
            history: &mut self.history[..m],
            tension: 0.0,
        };
        element.respond(self.pace, &self.u[..n], &history[place.history.clone()], &mut answer);
        answer.tension
    }

    /// Tangent of element number `i`, square, by rows.
    pub fn tangent(
        &mut self,
        i: usize,
        element: &AnyElement,
        u: &[f64],
        history: &[f64],
        slack: Slack,
    ) -> &[f64] {
        self.respond(i, element, u, history, Some(slack));
        let n = self.places[i].dofs.len();
        &self.tangent[..n * n]
    }

    /// Call `take` with the tangent of each piece of element number `i`.
    pub fn pieces(
        &mut self,
        i: usize,
        element: &AnyElement,
        (u, history): (&[f64], &[f64]),
        slack: Slack,
        mut take: impl FnMut(&Piece),
    ) {
        self.gather(i, u);
        let ElementPlace { dofs, history: own, .. } = &self.places[i];
        element.pieces(&self.u[..dofs.len()], &history[own.clone()], slack, &mut take);
    }

    /// Internal forces of element number `i` where it is `heading`, its exact tangent there, square, by rows, and its degrees of
    /// freedom.
    pub fn linearised(
        &mut self,
        i: usize,
        element: &AnyElement,
        heading: Heading,
        history: &[f64],
    ) -> (&[f64], &[f64], &[usize]) {
        let dofs = self.places[i].dofs.clone();
        let n = dofs.len();
        for (to, dof) in self.u.iter_mut().zip(&self.dofs[dofs.clone()]) {
            *to = heading.u[*dof] + heading.ahead * heading.v[*dof];
        }
        self.answer(i, element, history, Some(Slack::Exact));
        (&self.force[..n], &self.tangent[..n * n], &self.dofs[dofs])
    }

    /// Energies of all elements at `u` [J]. [`Assembly::ring_tensions`] is asked from now on there, for what comes with them.
    pub fn energy(&mut self, elements: &[AnyElement], u: &[f64], history: &[f64]) -> Energy {
        self.begin_reading();
        let (mut sum, mut next) = (Energy::default(), 0);
        while next < elements.len() {
            let (block, end) = self.rings.block_at(next);
            let added = block.is_some_and(|block| {
                let (added, tensions) = self.rings.add_energy(block, u, history, &mut sum);
                self.read[block] = (self.reading, tensions);
                added
            });
            if !added {
                for (i, element) in elements.iter().enumerate().take(end).skip(next) {
                    let history = self.history(i, history);
                    let own = element.energy(self.gather(i, u), history);
                    sum.stored += own.stored;
                    sum.dissipated += own.dissipated;
                }
            }
            next = end;
        }
        sum
    }

    /// Sum of what the ground pushes and holds [N].
    pub fn ground_force(&mut self, model: &Model, u: &[f64], history: &[f64]) -> Vector3<f64> {
        let mut sum = Vector3::zeros();
        for (number, contact) in model.ground.clone().zip(model.ground_contacts()) {
            let own = self.history(number, history);
            sum += contact.force(self.gather(number, u), own);
        }
        sum
    }

    /// [`Assembly::ring_tensions`] is asked from now on at other displacements or histories than before.
    pub fn begin_reading(&mut self) {
        self.reading += 1;
    }

    /// Tensions at `u` of a ring that is computed with others and of those that follow it there [N], 0 where one is broken; none
    /// of any other element.
    pub fn ring_tensions(&mut self, element: usize, u: &[f64], history: &[f64]) -> &[f64] {
        let Some(block) = self.rings.block_at(element).0 else { return &[] };
        let read = &mut self.read[block];
        if read.0 != self.reading {
            *read = (self.reading, self.rings.tensions(block, u, history));
        }
        let own = self.rings.elements(block);
        &read.1[element - own.start..own.len()]
    }
}
