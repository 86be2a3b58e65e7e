//! The interface between the two solvers: committed motion, iterate, answer, and what is judged.
//!
//! The unknown is the motion of the structure's interface nodes. With `S` samples per window,
//! sample i is the motion at the end of the i-th of S equal parts.

use crate::acceleration::Acceleration;
use crate::convergence::{Field, Judged, Measure, Residual, largest_distance};
use crate::energy::Work;
use crate::guard::Answered;
use crate::mapping::Matrix;
use crate::passing::Passing;
use crate::places::Places;
use crate::side::Side;
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// Motion of the structure's interface nodes: displacement [m] and velocity [m/s], sample by sample.
#[derive(Debug, Clone, Default)]
struct Motion {
    u: Vec<Vec<f64>>,
    v: Vec<Vec<f64>>,
}

impl Motion {
    fn zero(samples: usize, len: usize) -> Self {
        Self { u: vec![vec![0.0; len]; samples], v: vec![vec![0.0; len]; samples] }
    }

    fn resize(&mut self, len: usize) {
        self.u.iter_mut().chain(&mut self.v).for_each(|sample| sample.resize(len, 0.0));
    }

    fn copy(&mut self, other: &Self) {
        self.u.clone_from(&other.u);
        self.v.clone_from(&other.v);
    }

    /// Every sample of displacement and velocity beside that of `other`, with the factor to metres.
    fn paired<'a>(
        &'a mut self,
        other: &'a Self,
        length: f64,
    ) -> impl Iterator<Item = (&'a mut Vec<f64>, &'a Vec<f64>, f64)> {
        let u = self.u.iter_mut().zip(&other.u).map(|(x, y)| (x, y, 1.0));
        u.chain(self.v.iter_mut().zip(&other.v).map(move |(x, y)| (x, y, length)))
    }
}

/// The committed side of an [`Interface`].
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct KeptInterface {
    u: Vec<f64>,
    v: Vec<f64>,
    broken: Vec<f64>,
    /// Fields that are passed on.
    passing: Vec<Vec<f64>>,
    /// Mean forces: of the last iteration, of the one before, and committed.
    forces: [Vec<Vec<f64>>; 3],
    judged: Vec<bool>,
    in_reach: Vec<Range<usize>>,
}

/// State of the interface.
pub struct Interface {
    /// H, from the structure to the contact solver's mesh.
    pub mapping: Matrix,
    /// Fields that are passed on as they are.
    pub passing: Passing,
    places: Places,
    /// Whether all of this is of selected nodes alone; the meshes are equal then.
    selected: bool,
    /// Where the contact solver has moved the net itself, by samples; empty if it does not.
    own: Vec<Vec<f64>>,
    /// At the committed time.
    committed_u: Vec<f64>,
    committed_v: Vec<f64>,
    iterate: Motion,
    answer: Motion,
    /// Broken lines of the structure, as committed and in its last answer; empty if not agreed.
    committed_broken: Vec<f64>,
    broken: Vec<f64>,
    /// Mean force on the structure's nodes over each part [N]; empty if the structure takes none.
    force: Vec<Vec<f64>>,
    /// The mean force of the iteration before, and the committed one; empty where no measure asks for them.
    force_before: Vec<Vec<f64>>,
    committed_force: Vec<Vec<f64>>,
    /// Nodes that the contact solver may touch in this window.
    judged: Vec<bool>,
    /// The same, as ranges.
    in_reach: Vec<Range<usize>>,
    /// The same, one by one.
    nodes: Vec<u32>,
    /// Iterate and residual of the judged nodes, packed: displacement, then velocity times the window.
    packed: Vec<f64>,
    packed_residual: Vec<f64>,
}

impl Interface {
    /// At t = 0, with the structure's motion there.
    pub fn new(mapping: Matrix, places: Places, u: &[f64], v: &[f64]) -> Self {
        let samples = places.displacement.len();
        let motion = Motion::zero(samples, u.len());
        let whole = vec![0.0; places.broken.as_ref().map_or(0, Range::len)];
        Self {
            committed_broken: whole.clone(),
            broken: whole,
            committed_u: u.to_vec(),
            committed_v: v.to_vec(),
            iterate: motion.clone(),
            answer: motion,
            force: vec![vec![0.0; u.len()]; samples],
            force_before: Vec::new(),
            committed_force: Vec::new(),
            judged: vec![true; u.len() / 3],
            in_reach: {
                let mut all = Vec::with_capacity(u.len() / 6 + 1);
                all.push(0..u.len() / 3);
                all
            },
            nodes: Vec::with_capacity(u.len() / 3),
            packed: Vec::with_capacity(2 * samples * u.len()),
            packed_residual: Vec::with_capacity(2 * samples * u.len()),
            selected: false,
            own: vec![vec![0.0; u.len()]; places.own.len()],
            mapping,
            passing: Passing::default(),
            places,
        }
    }

    /// Lay everything out for the payloads as they are now, which hold `nodes` nodes, and begin from `state`, the structure's
    /// answer with its committed state.
    pub fn select(&mut self, dem: &Side, fem: &Side, nodes: usize, selected: bool, state: &[f64]) {
        let len = 3 * nodes;
        self.selected = selected;
        self.places.lay_out(dem, fem, self.iterate.u.len());
        self.passing.select(dem, fem, state);
        self.iterate.resize(len);
        self.answer.resize(len);
        self.own.iter_mut().chain(&mut self.force).for_each(|sample| sample.resize(len, 0.0));
        self.judged.clear();
        self.judged.resize(nodes, false);
        self.in_reach.clear();
        let last = |places: &[Range<usize>]| places.last().cloned().expect("chosen for every structure");
        for (committed, place) in [
            (&mut self.committed_u, last(&self.places.displacement)),
            (&mut self.committed_v, last(&self.places.velocity)),
        ] {
            committed.clear();
            committed.extend_from_slice(&state[place]);
        }
        if let Some(place) = &self.places.broken {
            self.committed_broken.clear();
            self.committed_broken.extend_from_slice(&state[place.clone()]);
            self.broken.clone_from(&self.committed_broken);
        }
    }

    /// Whether the contact solver advances the net itself.
    pub fn yields(&self) -> bool {
        self.selected && !self.own.is_empty()
    }

    /// Largest speed of a node in the committed state, in any component [m/s].
    pub fn fastest(&self) -> f64 {
        self.committed_v.iter().fold(0.0, |most, v| v.abs().max(most))
    }

    /// `contact = H structure`.
    fn consistent(&self, structure: &[f64], contact: &mut [f64]) {
        match self.selected {
            true => contact.copy_from_slice(structure),
            false => self.mapping.consistent(structure, contact),
        }
    }

    /// First iterate of a window of `length` [s]: displacement is extrapolated by `order` (0: it stays, 1: it goes on with its
    /// velocity). Order 2 gains nothing and fails earlier.
    pub fn predict(&mut self, order: u32, length: f64) {
        let samples = self.iterate.u.len();
        for (i, (u, v)) in self.iterate.u.iter_mut().zip(&mut self.iterate.v).enumerate() {
            let ahead = length * (i + 1) as f64 / samples as f64;
            let step = if order == 0 { 0.0 } else { ahead };
            for ((p, u), v) in u.iter_mut().zip(&self.committed_u).zip(&self.committed_v) {
                *p = u + step * v;
            }
            v.copy_from_slice(&self.committed_v);
        }
        if !self.force_before.is_empty() {
            self.force.iter_mut().for_each(|force| force.fill(0.0));
        }
    }

    /// Keep what a measure of the force compares with. `Err` says why it cannot be judged.
    pub fn follow_force(&mut self) -> Result<(), String> {
        if self.places.dem_force.is_empty() {
            return Err(
                "it gives no mean force over the parts of a window; measure displacement and velocity".into(),
            );
        }
        self.force_before.clone_from(&self.force);
        self.committed_force.clone_from(&self.force);
        Ok(())
    }

    /// The iterate, mapped into the request to the contact solver.
    pub fn write_motion(&self, payload: &mut [f64], iteration: u32, travel: f64) {
        let starts = [
            (&self.places.dem_displacement, &self.committed_u),
            (&self.places.dem_velocity, &self.committed_v),
        ];
        for (places, start) in starts {
            if let Some(place) = places.first() {
                self.consistent(start, &mut payload[place.clone()]);
            }
        }
        let ends =
            [(&self.places.dem_displacement, &self.iterate.u), (&self.places.dem_velocity, &self.iterate.v)];
        for (places, samples) in ends {
            for (place, sample) in places.iter().skip(1).zip(samples) {
                self.consistent(sample, &mut payload[place.clone()]);
            }
        }
        if let Some(place) = &self.places.dem_broken {
            payload[place.clone()].copy_from_slice(&self.committed_broken);
        }
        self.passing.write_to_contact(payload, iteration);
        for (place, force) in self.places.star.iter().zip(&self.force) {
            match iteration {
                1 => payload[place.clone()].fill(0.0),
                _ => payload[place.clone()].copy_from_slice(force),
            }
        }
        if let Some(place) = &self.places.dem_travel {
            payload[place.clone()].fill(travel);
        }
    }

    /// The contact solver's answer, mapped into the request to the structure. The mean force is kept
    /// for the booking of work.
    pub fn write_force(&mut self, from_dem: &[f64], payload: &mut [f64]) {
        if !self.force_before.is_empty() {
            std::mem::swap(&mut self.force, &mut self.force_before);
        }
        self.passing.write_to_structure(from_dem, payload);
        for (part, (place, force)) in self.places.dem_force.iter().zip(&mut self.force).enumerate() {
            let means = &from_dem[place.clone()];
            match self.places.force.get(part) {
                Some(to) => {
                    conservative(&self.mapping, self.selected, means, &mut payload[to.clone()]);
                    force.copy_from_slice(&payload[to.clone()]);
                }
                None => conservative(&self.mapping, self.selected, means, force),
            }
        }
        for (place, to) in self.places.dem_end_force.iter().zip(&self.places.end_force) {
            let to = &mut payload[to.clone()];
            conservative(&self.mapping, self.selected, &from_dem[place.clone()], to);
        }
        for (place, own) in self.places.own.iter().zip(&mut self.own) {
            own.copy_from_slice(&from_dem[place.clone()]);
        }
        if let Some(reach) = &self.places.reach {
            let marks = &from_dem[reach.clone()];
            match self.selected {
                true => self.judged.iter_mut().zip(marks).for_each(|(judged, mark)| *judged = *mark != 0.0),
                false => self.mapping.mark(marks, &mut self.judged),
            }
            self.in_reach.clear();
            self.in_reach.extend(ranges(&self.judged));
        }
    }

    /// Whether the contact solver's answer has a force.
    pub fn touches(&self, from_dem: &[f64]) -> bool {
        self.places.dem_force.iter().any(|place| from_dem[place.clone()].iter().any(|f| *f != 0.0))
    }

    /// Keep the structure's answer.
    pub fn take_motion(&mut self, from_structure: &[f64]) {
        self.passing.take(from_structure);
        for (place, u) in self.places.displacement.iter().zip(&mut self.answer.u) {
            u.copy_from_slice(&from_structure[place.clone()]);
        }
        for (place, v) in self.places.velocity.iter().zip(&mut self.answer.v) {
            v.copy_from_slice(&from_structure[place.clone()]);
        }
        if let Some(place) = &self.places.broken {
            self.broken.copy_from_slice(&from_structure[place.clone()]);
        }
    }

    /// How far the structure says that nodes have moved in its last answer [m].
    pub fn travel(&self, from_structure: &[f64]) -> f64 {
        self.places.travel.as_ref().map_or(0.0, |at| from_structure[at.start])
    }

    /// How long the contact solver says that nothing will touch [s].
    pub fn free_time(&self, from_dem: &[f64]) -> f64 {
        self.places.free_time.as_ref().map_or(0.0, |at| from_dem[at.start])
    }

    /// Distance between the net as the contact solver has moved it and the structure's answer, over the judged nodes; from
    /// the second iteration on what the answer has changed, where that is less: the two motions come no nearer than the
    /// parts of the window allow, over which force is a mean.
    pub fn yielding_residual(&self, iteration: u32) -> Residual {
        let mut residual = Residual::default();
        for (own, answer) in self.own.iter().zip(&self.answer.u) {
            let apart = largest_distance(answer, own, &self.in_reach);
            residual.displacement = residual.displacement.max(apart);
            let increment = largest_distance(answer, &self.committed_u, &self.in_reach);
            residual.displacement_increment = residual.displacement_increment.max(increment);
        }
        if iteration > 1 {
            residual.displacement = residual.displacement.min(self.displacement_residual().displacement);
        }
        residual
    }

    /// The structure's answer is the next iterate.
    pub fn adopt(&mut self) {
        self.iterate.copy(&self.answer);
    }

    /// Residual in displacement `answer - iterate` over the judged nodes; nothing else of it is known then.
    pub fn displacement_residual(&self) -> Residual {
        let samples = self.answer.u.iter().zip(&self.iterate.u);
        let distances = samples.map(|(answer, iterate)| largest_distance(answer, iterate, &self.in_reach));
        Residual { displacement: distances.fold(0.0, f64::max), ..Residual::UNKNOWN }
    }

    /// Residual `answer - iterate` over the judged nodes, for a window of `length` [s].
    pub fn residual(&self, length: f64) -> Residual {
        let mut residual = Residual::default();
        let Motion { u, v } = &self.answer;
        let largest = |a: &[f64], b: &[f64]| largest_distance(a, b, &self.in_reach);
        for (sample, (u, v)) in u.iter().zip(v).enumerate() {
            let Residual { displacement, displacement_increment, velocity, velocity_increment } =
                &mut residual;
            *displacement = displacement.max(largest(u, &self.iterate.u[sample]));
            *displacement_increment = displacement_increment.max(largest(u, &self.committed_u));
            *velocity = velocity.max(length * largest(v, &self.iterate.v[sample]));
            *velocity_increment = velocity_increment.max(length * largest(v, &self.committed_v));
        }
        residual
    }

    /// One measure of the residual over the judged nodes, for a window of `length` [s].
    pub fn judge(&self, measure: &Measure, length: f64) -> Judged {
        let Motion { u, v } = &self.answer;
        let (norm, nodes) = (measure.norm, &self.in_reach);
        let mut sum = Judged::default();
        for sample in 0..u.len() {
            let compared = match measure.field {
                Field::Displacement => [&u[sample], &self.iterate.u[sample], &self.committed_u],
                Field::Velocity => [&v[sample], &self.iterate.v[sample], &self.committed_v],
                Field::Force => {
                    [&self.force[sample], &self.force_before[sample], &self.committed_force[sample]]
                }
            };
            sum.add(norm, compared.map(Vec::as_slice), nodes);
        }
        let count = u.len() * nodes.iter().map(Range::len).sum::<usize>();
        sum.finish(norm, count, if measure.field == Field::Velocity { length } else { 1.0 })
    }

    /// Unknowns that are accelerated, at most: displacement and velocity of all samples.
    pub fn unknowns(&self) -> usize {
        2 * self.iterate.u.len() * self.committed_u.len()
    }

    /// The next iterate: judged nodes by `acceleration`, displacement and velocity by one factor; the
    /// others, which touch nothing, take the answer.
    pub fn accelerate(&mut self, acceleration: &mut dyn Acceleration, length: f64) {
        let Self { iterate, answer, judged, nodes, packed, packed_residual, .. } = self;
        nodes.clear();
        nodes.extend((0..judged.len() as u32).filter(|node| judged[*node as usize]));
        packed.clear();
        packed_residual.clear();
        for (x, y, unit) in iterate.paired(answer, length) {
            for i in nodes.iter().map(|node| 3 * *node as usize).flat_map(|first| first..first + 3) {
                packed.push(x[i] * unit);
                packed_residual.push((y[i] - x[i]) * unit);
            }
        }
        acceleration.update(packed, packed_residual, nodes);
        let mut next = packed.iter();
        for (x, y, unit) in iterate.paired(answer, length) {
            for (node, judged) in judged.iter().enumerate() {
                for i in 3 * node..3 * node + 3 {
                    x[i] = if *judged { next.next().expect("as many as packed") / unit } else { y[i] };
                }
            }
        }
    }

    /// The motion of the structure in the window at hand: committed, then as answered.
    pub fn answered(&self) -> Answered<'_> {
        let Motion { u, v } = &self.answer;
        Answered { start: (&self.committed_u, &self.committed_v), u, v }
    }

    /// Work of the mean force in this window [J]: on the structure, and on the mesh that the contact
    /// solver saw. They differ by mean force times residual.
    pub fn work(&self) -> Work {
        let mut work = Work::default();
        let seen = if self.yields() { &self.own } else { &self.iterate.u };
        for (sample, force) in self.force.iter().enumerate() {
            let (from_answer, from_iterate) = match sample {
                0 => (&self.committed_u, &self.committed_u),
                _ => (&self.answer.u[sample - 1], &seen[sample - 1]),
            };
            for (i, f) in force.iter().enumerate().filter(|(_, f)| **f != 0.0) {
                work.touched = true;
                work.structure += f * (self.answer.u[sample][i] - from_answer[i]);
                work.mesh += f * (seen[sample][i] - from_iterate[i]);
            }
        }
        work
    }

    /// What the next window follows from.
    pub fn kept(&self) -> KeptInterface {
        KeptInterface {
            u: self.committed_u.clone(),
            v: self.committed_v.clone(),
            broken: self.committed_broken.clone(),
            passing: self.passing.kept(),
            forces: [self.force.clone(), self.force_before.clone(), self.committed_force.clone()],
            judged: self.judged.clone(),
            in_reach: self.in_reach.clone(),
        }
    }

    /// Go on from there, with payloads laid out as they were.
    pub fn go_on(&mut self, kept: KeptInterface) {
        let KeptInterface { u, v, broken, passing, forces, judged, in_reach } = kept;
        (self.committed_u, self.committed_v) = (u, v);
        self.broken.clone_from(&broken);
        self.committed_broken = broken;
        self.passing.go_on(passing);
        [self.force, self.force_before, self.committed_force] = forces;
        (self.judged, self.in_reach) = (judged, in_reach);
    }

    /// The answer's end is the committed motion from now on, and what is broken in it is broken.
    pub fn commit(&mut self) {
        // The next answer is written over what is swapped out.
        if let (Some(u), Some(v)) = (self.answer.u.last_mut(), self.answer.v.last_mut()) {
            std::mem::swap(&mut self.committed_u, u);
            std::mem::swap(&mut self.committed_v, v);
        }
        self.committed_broken.copy_from_slice(&self.broken);
        for (committed, force) in self.committed_force.iter_mut().zip(&self.force) {
            committed.copy_from_slice(force);
        }
        self.passing.commit();
    }
}

/// `structure = H^T contact`.
fn conservative(mapping: &Matrix, selected: bool, contact: &[f64], structure: &mut [f64]) {
    match selected {
        true => structure.copy_from_slice(contact),
        false => mapping.conservative(contact, structure),
    }
}

/// The ranges of nodes that are marked.
fn ranges(marked: &[bool]) -> impl Iterator<Item = Range<usize>> {
    let mut from = 0;
    std::iter::from_fn(move || {
        let start = from + marked[from..].iter().position(|m| *m)?;
        from = marked[start..].iter().position(|m| !*m).map_or(marked.len(), |len| start + len);
        Some(start..from)
    })
}
