//! Ruptures within an explicit step, located inside it.
//!
//! From the displacements at the step's start the middle lies half a step ahead; twice as far is where the structure would
//! be at the step's end without forces. Where an element does not bear that, the instant `t = x h` at which its strength is
//! reached is found by bisection, and over the step it pulls with `x` times its force in the middle of that part: the impulse
//! that it gives until it breaks. What it held then is lost.
//!
//! The kick changes velocities, so the work `f . du` that the element takes differs from that energy in the square of
//! the step. [`Assembly::book_rupture`] returns the difference: with it the books say exactly what the scheme did.

use super::{Assembly, ElementPlace};
use crate::element::{AnyElement, CLOSE, FAR};
use serde::{Deserialize, Serialize};

/// Halvings of the part of the step in which something breaks.
const HALVINGS: u32 = 40;

/// The share of this element is the largest that it had.
pub fn take_largest(all: &mut Vec<(u32, f64)>, (element, share): (u32, f64)) {
    match all.iter_mut().find(|(known, _)| *known == element) {
        Some((_, largest)) => *largest = largest.max(share),
        None => all.push((element, share)),
    }
}

/// Something that broke, or began to yield.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Event {
    /// When; with implicit steps the end of the step in which it did [s].
    pub time: f64,
    /// Number of the element.
    pub element: u32,
    /// Largest axial force it carried then [N].
    pub tension: f64,
}

/// An element that broke in a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Broken {
    /// Number of the element.
    pub element: u32,
    /// Largest axial force it carried then [N].
    pub tension: f64,
    /// At which part of the step.
    pub part: f64,
    /// Share of its strength that it used then, 1 or more.
    pub share: f64,
}

impl Event {
    /// An event at `time` [s] for each of these elements, with its largest axial force [N].
    pub fn all(of: &[(u32, f64)], time: f64) -> impl Iterator<Item = Self> {
        of.iter().map(move |(element, tension)| Self { time, element: *element, tension: *tension })
    }
}

impl Broken {
    /// As an event of the step from `time` [s] that is `length` [s] long.
    pub fn event(&self, time: f64, length: f64) -> Event {
        Event { time: time + self.part * length, element: self.element, tension: self.tension }
    }
}

/// The work of an element that broke in the last step is `f . (u_1 - u_0)`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Release {
    pub(super) element: usize,
    /// Index at which its force begins in the memory.
    pub(super) first: usize,
    /// Its energy at the step's start, less `f . u_0` [J].
    pub(super) before: f64,
}

/// An element, and the displacements of all at a step's start and in its middle.
#[derive(Clone, Copy)]
pub(super) struct Stretch<'a> {
    pub(super) number: usize,
    pub(super) element: &'a AnyElement,
    pub(super) start: &'a [f64],
    pub(super) middle: &'a [f64],
}

impl Assembly {
    /// Room for what may break.
    pub(super) fn reserve_ruptures(&mut self, elements: &[AnyElement]) {
        let breakable = || elements.iter().enumerate().filter(|(_, e)| e.constants().can_break);
        self.broken.reserve(elements.len());
        self.yielded.reserve(self.places.iter().filter(|place| place.constants.plastic.is_some()).count());
        self.close.reserve(breakable().count());
        self.releases.reserve(breakable().count());
        self.released.reserve(breakable().map(|(i, _)| self.places[i].dofs.len()).sum());
        self.torn = vec![0.0; self.history.len()];
    }

    /// Move elements that were close to breaking and are far from it now to those that were spared: other steps may tear what swings so.
    pub fn spare(
        &mut self,
        elements: &[AnyElement],
        (u, history): (&[f64], &[f64]),
        [close, spared]: [&mut Vec<(u32, f64)>; 2],
    ) {
        close.retain(|near| {
            let number = near.0 as usize;
            let (n, own) = (self.gather(number, u).len(), self.history(number, history));
            let broken = elements[number].is_broken(own);
            let far = !broken && elements[number].utilisation_bound(&self.u[..n], own) < FAR;
            if far {
                take_largest(spared, *near);
            }
            !broken && !far
        });
    }

    /// Displacements of an element at the part `x` of the step, into the memory for one.
    fn gather_at(&mut self, of: &Stretch, x: f64) {
        let dofs = &self.dofs[self.places[of.number].dofs.clone()];
        for (to, dof) in self.u.iter_mut().zip(dofs) {
            *to = of.start[*dof] + 2.0 * x * (of.middle[*dof] - of.start[*dof]);
        }
    }

    /// Largest axial force of an element at the part `x` of the step [N]. Its force and history there are in the memory then.
    fn answer_at(&mut self, of: &Stretch, history: &[f64], x: f64) -> f64 {
        self.gather_at(of, x);
        self.answer(of.number, of.element, history, None)
    }

    /// Whether an element is broken at the part `x` of the step, by which its history in the memory says so.
    fn breaks_at(&mut self, of: &Stretch, history: &[f64], x: f64) -> bool {
        self.answer_at(of, history, x);
        let ElementPlace { dofs, history, .. } = &self.places[of.number];
        of.element.breaks(&self.u[..dofs.len()], &mut self.history[..history.len()])
    }

    /// Locate the rupture of an element within the step: its force over the step, and its history behind it, are in the memory then.
    pub(super) fn break_within(&mut self, of: &Stretch, history: &[f64]) -> Option<Broken> {
        let place = self.places[of.number].clone();
        let (n, own) = (place.dofs.len(), place.history.len());
        self.gather_at(of, 1.0);
        let own_history = &history[place.history.clone()];
        if of.element.is_broken(own_history) {
            return None;
        }
        let bound = of.element.utilisation_bound(&self.u[..n], own_history);
        self.used = self.used.max(bound);
        if bound > CLOSE {
            take_largest(&mut self.close, (of.number as u32, bound));
        }
        if bound <= 1.0 || !self.breaks_at(of, history, 1.0) {
            return None;
        }
        let (mut low, mut high) = (0.0, if self.breaks_at(of, history, 0.0) { 0.0 } else { 1.0 });
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            let to = if high > 0.0 && self.breaks_at(of, history, middle) { &mut high } else { &mut low };
            *to = middle;
        }
        let tension = self.answer_at(of, history, high);
        of.element.breaks(&self.u[..n], &mut self.history[..own]);
        self.torn[..own].copy_from_slice(&self.history[..own]);
        self.answer_at(of, history, 0.5 * high);
        self.force[..n].iter_mut().for_each(|f| *f *= high);
        self.history[..own].copy_from_slice(&self.torn[..own]);
        self.gather_at(of, 0.0);
        let had = of.element.energy(&self.u[..n], &history[place.history]);
        let work: f64 = self.force[..n].iter().zip(&self.u).map(|(f, u)| f * u).sum();
        let before = had.stored + had.dissipated - work;
        self.releases.push(Release { element: of.number, first: self.released.len(), before });
        self.released.extend_from_slice(&self.force[..n]);
        Some(Broken { element: of.number as u32, tension, part: high, share: 1.0 })
    }

    /// Energy [J] that the step took from the structure beyond what the histories of the elements that broke in it say:
    /// `f . (u_1 - u_0)` less what they held. `u` are the displacements at its end.
    pub fn book_rupture(&mut self, elements: &[AnyElement], u: &[f64], history: &[f64]) -> f64 {
        let mut sum = 0.0;
        for at in 0..self.releases.len() {
            let Release { element, first, before } = self.releases[at];
            let own = self.history(element, history);
            let has = elements[element].energy(self.gather(element, u), own);
            let n = self.dofs(element).len();
            let work: f64 = self.released[first..][..n].iter().zip(&self.u).map(|(f, u)| f * u).sum();
            sum += before + work - has.stored - has.dissipated;
        }
        sum
    }
}
