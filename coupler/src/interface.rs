//! The interface between the two solvers: committed motion, iterate, answer, and what is judged.
//!
//! The unknown is the motion of the structure's interface nodes. With `S` samples per window,
//! sample i is the motion at the end of the i-th of S equal parts.

use crate::acceleration::Acceleration;
use crate::convergence::{Field, Judged, Measure, Norm, Residual, largest_distance};
use crate::energy::Work;
use crate::guard::Answered;
use crate::mapping::Matrix;
use crate::passing::Passing;
use crate::side::Side;
use interface_defs::{InterfaceMesh, Layout, Sampling, name};
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

/// Where the fields that the coupler knows lie in the four payloads.
#[derive(Debug, Clone, Default)]
struct Places {
    /// `[sample]`: start, then the ends of the parts; to the contact solver.
    dem_displacement: Vec<Range<usize>>,
    /// As `dem_displacement`; empty if the contact solver takes no velocity.
    dem_velocity: Vec<Range<usize>>,
    /// Means over the parts, from the contact solver; empty if not agreed.
    dem_force: Vec<Range<usize>>,
    /// At the ends of the parts, from the contact solver; empty if not agreed.
    dem_end_force: Vec<Range<usize>>,
    /// From the contact solver.
    reach: Option<Range<usize>>,
    /// To the structure.
    force: Vec<Range<usize>>,
    /// To the structure.
    end_force: Vec<Range<usize>>,
    /// From the structure.
    displacement: Vec<Range<usize>>,
    /// From the structure.
    velocity: Vec<Range<usize>>,
    /// To the contact solver: means over the parts of the force under which the motion sent was computed.
    star: Vec<Range<usize>>,
    /// From the contact solver: its own motion of the net at the ends of the parts.
    own: Vec<Range<usize>>,
    /// From the structure.
    travel: Option<Range<usize>>,
    /// To the contact solver: the sum of what came, and what may come.
    dem_travel: Option<Range<usize>>,
    /// From the contact solver.
    free_time: Option<Range<usize>>,
}

impl Places {
    /// Fill it in from the layouts of the four payloads, with `samples` parts per window.
    fn lay_out(&mut self, dem: &Side, fem: &Side, samples: usize) {
        let (to_dem, from_dem, to_fem, from_fem) = (&dem.request, &dem.layout, &fem.request, &fem.layout);
        let all = |ranges: &mut Vec<Range<usize>>, layout: &Layout, name, sampling, count: usize| {
            ranges.clear();
            ranges.extend((0..count).filter_map(|i| layout.sample(name, sampling, i)));
        };
        use Sampling::{AtEnds, FromStart, Means, Once};
        all(&mut self.dem_displacement, to_dem, name::DISPLACEMENT, FromStart, samples + 1);
        all(&mut self.dem_velocity, to_dem, name::VELOCITY, FromStart, samples + 1);
        all(&mut self.star, to_dem, name::FORCE, Means, samples);
        all(&mut self.dem_force, from_dem, name::FORCE, Means, samples);
        all(&mut self.dem_end_force, from_dem, name::FORCE, AtEnds, samples);
        all(&mut self.own, from_dem, name::DISPLACEMENT, AtEnds, samples);
        all(&mut self.force, to_fem, name::FORCE, Means, samples);
        all(&mut self.end_force, to_fem, name::FORCE, AtEnds, samples);
        all(&mut self.displacement, from_fem, name::DISPLACEMENT, AtEnds, samples);
        all(&mut self.velocity, from_fem, name::VELOCITY, AtEnds, samples);
        self.reach = from_dem.sample(name::REACH, Once, 0);
        self.travel = from_fem.sample(name::TRAVEL, Once, 0);
        self.dem_travel = to_dem.sample(name::TRAVEL, Once, 0);
        self.free_time = from_dem.sample(name::FREE_TIME, Once, 0);
    }
}

/// What the next window follows from.
#[derive(Debug, Clone, Serialize, Deserialize)]
struct State {
    /// Committed displacement and velocity.
    u: Vec<f64>,
    v: Vec<f64>,
    /// Mean force on the structure's nodes over each part [N]; empty if the structure takes none.
    force: Vec<Vec<f64>>,
    /// The mean force of the iteration before, and the committed one; empty where no measure asks for them.
    force_before: Vec<Vec<f64>>,
    committed_force: Vec<Vec<f64>>,
    /// Nodes that the contact solver may touch in this window.
    judged: Vec<bool>,
    /// The same, as ranges.
    in_reach: Vec<Range<usize>>,
}

/// The committed side of an [`Interface`], and the fields that are passed on.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct KeptInterface(State, Vec<Vec<f64>>);

/// The interface at the end of a window, as it is committed; 3 numbers per node.
#[derive(Debug, Clone, Copy)]
pub struct Moved<'a> {
    /// Its end [s].
    pub time: f64,
    /// The structure's mesh at t = 0.
    pub mesh: &'a InterfaceMesh,
    /// Displacement [m] and velocity [m/s].
    pub motion: (&'a [f64], &'a [f64]),
    /// Mean contact force over its last part [N]; `None`: the contact solver moves the nodes itself.
    pub force: Option<&'a [f64]>,
    /// Displacement that the contact solver was given [m].
    pub given: &'a [f64],
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
    state: State,
    iterate: Motion,
    answer: Motion,
    /// The judged nodes, one by one.
    nodes: Vec<u32>,
    /// Iterate and residual of the judged nodes, packed: displacement, then velocity times the window.
    packed: Vec<f64>,
    packed_residual: Vec<f64>,
}

impl Interface {
    /// At t = 0, with the structure's displacement and velocity there, and so many samples in a window.
    pub fn new(
        mapping: Matrix,
        (dem, fem): (&Side, &Side),
        samples: usize,
        (u, v): (&[f64], &[f64]),
    ) -> Self {
        let mut places = Places::default();
        places.lay_out(dem, fem, samples);
        let nodes = u.len() / 3;
        let motion = Motion::zero(samples, u.len());
        let mut in_reach = Vec::with_capacity(nodes / 2 + 1);
        in_reach.push(0..nodes);
        let state = State {
            u: u.to_vec(),
            v: v.to_vec(),
            force: vec![vec![0.0; u.len()]; samples],
            force_before: Vec::new(),
            committed_force: Vec::new(),
            judged: vec![true; nodes],
            in_reach,
        };
        Self {
            state,
            iterate: motion.clone(),
            answer: motion,
            nodes: Vec::with_capacity(nodes),
            packed: Vec::with_capacity(2 * samples * u.len()),
            packed_residual: Vec::with_capacity(2 * samples * u.len()),
            selected: false,
            own: vec![vec![0.0; u.len()]; places.own.len()],
            mapping,
            passing: Passing::default(),
            places,
        }
    }

    /// Lay everything out for the payloads as they are now, which hold `nodes` nodes, and begin from `answer`, the
    /// structure's with its committed state.
    pub fn select(&mut self, dem: &Side, fem: &Side, nodes: usize, selected: bool, answer: &[f64]) {
        let len = 3 * nodes;
        self.selected = selected;
        self.places.lay_out(dem, fem, self.iterate.u.len());
        self.passing.select(dem, fem, answer);
        self.iterate.resize(len);
        self.answer.resize(len);
        let state = &mut self.state;
        self.own.iter_mut().chain(&mut state.force).for_each(|sample| sample.resize(len, 0.0));
        state.judged.clear();
        state.judged.resize(nodes, false);
        state.in_reach.clear();
        let last =
            |places: &[Range<usize>]| &answer[places.last().expect("chosen for every structure").clone()];
        last(&self.places.displacement).clone_into(&mut state.u);
        last(&self.places.velocity).clone_into(&mut state.v);
    }

    /// Whether the contact solver advances the net itself.
    pub fn yields(&self) -> bool {
        self.selected && !self.own.is_empty()
    }

    /// First iterate of a window of `length` [s]: displacement is extrapolated by `order` (0: it stays, 1: it goes on with its
    /// velocity). Order 2 gains nothing and fails earlier.
    pub fn predict(&mut self, order: u32, length: f64) {
        let samples = self.iterate.u.len();
        for (i, (u, v)) in self.iterate.u.iter_mut().zip(&mut self.iterate.v).enumerate() {
            let ahead = length * (i + 1) as f64 / samples as f64;
            let step = if order == 0 { 0.0 } else { ahead };
            for ((p, u), v) in u.iter_mut().zip(&self.state.u).zip(&self.state.v) {
                *p = u + step * v;
            }
            v.copy_from_slice(&self.state.v);
        }
        if !self.state.force_before.is_empty() {
            self.state.force.iter_mut().for_each(|force| force.fill(0.0));
        }
    }

    /// Keep what a measure of the force compares with. `Err` says why it cannot be judged.
    pub fn follow_force(&mut self) -> Result<(), String> {
        if self.places.dem_force.is_empty() {
            return Err(
                "it gives no mean force over the parts of a window; measure displacement and velocity".into(),
            );
        }
        self.state.force_before.clone_from(&self.state.force);
        self.state.committed_force.clone_from(&self.state.force);
        Ok(())
    }

    /// The iterate, mapped into the request to the contact solver.
    pub fn write_motion(&self, payload: &mut [f64], iteration: u32, travel: f64) {
        for (places, start, ends) in [
            (&self.places.dem_displacement, &self.state.u, &self.iterate.u),
            (&self.places.dem_velocity, &self.state.v, &self.iterate.v),
        ] {
            for (place, sample) in places.iter().zip(std::iter::once(start).chain(ends)) {
                self.mapping.consistent(sample, &mut payload[place.clone()]);
            }
        }
        self.passing.write_to_contact(payload, iteration);
        for (place, force) in self.places.star.iter().zip(&self.state.force) {
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
        if !self.state.force_before.is_empty() {
            std::mem::swap(&mut self.state.force, &mut self.state.force_before);
        }
        self.passing.write_to_structure(from_dem, payload);
        for (part, (place, force)) in self.places.dem_force.iter().zip(&mut self.state.force).enumerate() {
            let means = &from_dem[place.clone()];
            match self.places.force.get(part) {
                Some(to) => {
                    self.mapping.conservative(means, &mut payload[to.clone()]);
                    force.copy_from_slice(&payload[to.clone()]);
                }
                None => self.mapping.conservative(means, force),
            }
        }
        for (place, to) in self.places.dem_end_force.iter().zip(&self.places.end_force) {
            self.mapping.conservative(&from_dem[place.clone()], &mut payload[to.clone()]);
        }
        take(from_dem, &self.places.own, &mut self.own);
        if let Some(reach) = &self.places.reach {
            self.mapping.mark(&from_dem[reach.clone()], &mut self.state.judged);
            self.state.in_reach.clear();
            self.state.in_reach.extend(ranges(&self.state.judged));
        }
    }

    /// Whether the contact solver's answer has a force.
    pub fn touches(&self, from_dem: &[f64]) -> bool {
        self.places.dem_force.iter().any(|place| from_dem[place.clone()].iter().any(|f| *f != 0.0))
    }

    /// Keep the structure's answer.
    pub fn take_motion(&mut self, from_structure: &[f64]) {
        self.passing.take(from_structure);
        take(from_structure, &self.places.displacement, &mut self.answer.u);
        take(from_structure, &self.places.velocity, &mut self.answer.v);
    }

    /// Whether something broke in the structure's last answer.
    pub fn breaks(&self) -> bool {
        self.passing.breaks()
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
            let apart = largest_distance(answer, own, &self.state.in_reach);
            residual.displacement = residual.displacement.max(apart);
            let increment = largest_distance(answer, &self.state.u, &self.state.in_reach);
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
        let distances =
            samples.map(|(answer, iterate)| largest_distance(answer, iterate, &self.state.in_reach));
        let (displacement, unknown) = (distances.fold(0.0, f64::max), f64::NAN);
        Residual {
            displacement,
            displacement_increment: unknown,
            velocity: unknown,
            velocity_increment: unknown,
        }
    }

    /// Residual `answer - iterate` over the judged nodes, for a window of `length` [s].
    pub fn residual(&self, length: f64) -> Residual {
        let largest = |field| Measure { field, norm: Norm::Largest, tolerance: None, absolute: None };
        let [u, v] = [Field::Displacement, Field::Velocity].map(|field| self.judge(&largest(field), length));
        Residual {
            displacement: u.residual,
            displacement_increment: u.reference,
            velocity: v.residual,
            velocity_increment: v.reference,
        }
    }

    /// One measure of the residual over the judged nodes, for a window of `length` [s].
    pub fn judge(&self, measure: &Measure, length: f64) -> Judged {
        let Motion { u, v } = &self.answer;
        let (norm, nodes) = (measure.norm, &self.state.in_reach);
        let mut sum = Judged::default();
        for sample in 0..u.len() {
            let compared = match measure.field {
                Field::Displacement => [&u[sample], &self.iterate.u[sample], &self.state.u],
                Field::Velocity => [&v[sample], &self.iterate.v[sample], &self.state.v],
                Field::Force => [
                    &self.state.force[sample],
                    &self.state.force_before[sample],
                    &self.state.committed_force[sample],
                ],
            };
            sum.add(norm, compared.map(Vec::as_slice), nodes);
        }
        let count = u.len() * nodes.iter().map(Range::len).sum::<usize>();
        sum.finish(norm, count, if measure.field == Field::Velocity { length } else { 1.0 })
    }

    /// Unknowns that are accelerated, at most: displacement and velocity of all samples.
    pub fn unknowns(&self) -> usize {
        2 * self.iterate.u.len() * self.state.u.len()
    }

    /// The next iterate: judged nodes by `acceleration`, displacement and velocity by one factor; the
    /// others, which touch nothing, take the answer.
    pub fn accelerate(&mut self, acceleration: &mut dyn Acceleration, length: f64) {
        let Self { iterate, answer, nodes, packed, packed_residual, state: State { judged, .. }, .. } = self;
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

    /// Committed displacement and velocity of the structure's nodes.
    pub fn committed(&self) -> (&[f64], &[f64]) {
        (&self.state.u, &self.state.v)
    }

    /// The motion of the structure in the window at hand: committed, then as answered.
    pub fn answered(&self) -> Answered<'_> {
        let Motion { u, v } = &self.answer;
        Answered { start: (&self.state.u, &self.state.v), u, v }
    }

    /// The mean force of the window at hand over each part [N]; `None` while only a part of the nodes crosses.
    pub fn force(&self) -> Option<&[Vec<f64>]> {
        (!self.selected && !self.places.dem_force.is_empty()).then_some(&self.state.force[..])
    }

    /// The mean force of the window at hand on all nodes together [N]; nodes that do not cross have none.
    pub fn resultant(&self) -> [f64; 3] {
        let parts = self.state.force.iter().flat_map(|part| part.as_chunks().0);
        let sum = parts.fold([0.0; 3], |sum, force: &[f64; 3]| std::array::from_fn(|c| sum[c] + force[c]));
        sum.map(|component| component / self.state.force.len().max(1) as f64)
    }

    /// The end of the window at hand, at `time` [s], of a structure with this mesh; `None` while only a part of the nodes crosses.
    pub fn moved<'a>(&'a self, time: f64, mesh: &'a InterfaceMesh) -> Option<Moved<'a>> {
        let last = |samples: &'a [Vec<f64>]| samples.last().map(|sample| &sample[..]);
        let motion = (last(&self.answer.u)?, last(&self.answer.v)?);
        let (force, given) = (self.force().and_then(last), last(&self.iterate.u)?);
        (!self.selected).then_some(Moved { time, mesh, motion, force, given })
    }

    /// Work of the mean force in this window [J]: on the structure, and on the mesh that the contact
    /// solver saw. They differ by mean force times residual.
    pub fn work(&self) -> Work {
        let mut work = Work::default();
        let seen = if self.yields() { &self.own } else { &self.iterate.u };
        for (sample, force) in self.state.force.iter().enumerate() {
            let (from_answer, from_iterate) = match sample {
                0 => (&self.state.u, &self.state.u),
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
        KeptInterface(self.state.clone(), self.passing.kept())
    }

    /// Go on from there, with payloads laid out as they were.
    pub fn go_on(&mut self, KeptInterface(state, passing): KeptInterface) {
        self.state = state;
        self.passing.go_on(passing);
    }

    /// The answer's end is committed from now on: the motion, the mean force, and what is passed on.
    pub fn commit(&mut self) {
        // The next answer is written over what is swapped out.
        if let (Some(u), Some(v)) = (self.answer.u.last_mut(), self.answer.v.last_mut()) {
            std::mem::swap(&mut self.state.u, u);
            std::mem::swap(&mut self.state.v, v);
        }
        for (committed, force) in self.state.committed_force.iter_mut().zip(&self.state.force) {
            committed.copy_from_slice(force);
        }
        self.passing.commit();
    }
}

/// Copy what lies at `places` of a payload, sample by sample.
fn take(payload: &[f64], places: &[Range<usize>], samples: &mut [Vec<f64>]) {
    for (place, sample) in places.iter().zip(samples) {
        sample.copy_from_slice(&payload[place.clone()]);
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
