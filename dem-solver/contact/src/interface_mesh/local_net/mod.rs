//! The net as the contact solver advances it itself within a window, so that the window may last as long as the structure's
//! own time scale instead of the contact's.
//!
//! The request has a reference motion `u*(t)` of the selected nodes, which the structure follows under the forces `F*`, and what
//! is left over, `r = local_force + local_force_rate t`. In the first iteration of a window the reference is straight,
//! `F* = 0`, and `r` is what accelerates the structure there; in later ones it is the structure's last answer under the force sent
//! last, and `r = 0`. Contact forces `F` move the nodes off it by `d`:
//!
//! ```text
//! m d'' = F - F* + r - K d - alpha m d'
//! ```
//!
//! with lumped masses `m`, the tangents `K` of the elements between selected nodes (nodes outside stay on their reference), and
//! mass-proportional damping `alpha`. The scheme is that of the rocks, position Verlet; `K d` varies slowly and is applied every
//! few steps as one impulse (multiple time stepping: Grubmueller et al. (1991), Mol. Simul. 6, 121).
//!
//! Such a window is right while no disturbance leaves the patch and comes back: the coupler compares the motion found here
//! with the structure's answer.

use super::motion::sample;
use interface_defs::{Layout, Plan, Sampling, Selection, name};
use kernel::{Off, Push, Reference, add_scaled, hermite, pull};
use nalgebra::Vector3;
use std::ops::Range;

mod kernel;

/// Share of the critical step of the patch up to which `K d` is held back: what an explicit structure itself takes in one step.
const SLOW: f64 = 0.5;
/// Most steps between two impulses of `K d`.
const MOST_HELD_BACK: usize = 16;
/// Coupled pairs for each node for which there is room from the start.
const PAIRS_PER_NODE: usize = 8;
/// Largest step times frequency of a contact on the masses of its nodes; 2 is the limit of stability.
const COARSEST: f64 = 0.7;
/// Largest step times the rate at which a dashpot stops a node; 1 is the limit of stability.
const COARSEST_DASHPOT: f64 = 0.3;

/// The selected nodes within a window. Vectors run over the nodes, three components each.
#[derive(Debug, Clone, Default)]
pub struct LocalNet {
    /// At rest [m].
    rest: Vec<f64>,
    /// One over the mass [1/kg], three times; 0 where a node is held.
    inverse_mass: Vec<f64>,
    pairs: Vec<[u32; 2]>,
    /// Blocks of the tangent, row by row [N/m].
    blocks: Vec<[f64; 9]>,
    /// Displacement and velocity of the reference at the ends of the segment under way, in the request.
    segment: Option<[Range<usize>; 4]>,
    /// Off the reference [m], its rate [m/s], and its acceleration in the step before without and by `K d` [m/s2].
    off: Vec<f64>,
    off_rate: Vec<f64>,
    fast: Vec<f64>,
    slow: Vec<f64>,
    /// Displacement at the start of the step under way [m].
    before: Vec<f64>,
    /// Displacement [m] and velocity [m/s] in its middle.
    middle: Vec<f64>,
    velocity: Vec<f64>,
    /// Contact force on the nodes in it [N].
    pub force: Vec<f64>,
    /// Stiffness [N/m] and dashpots [N s/m] of the contacts on each node.
    pub stiffness: Vec<[f64; 2]>,
    /// As long as the others.
    zeros: Vec<f64>,
    damping: f64,
    /// Steps between two impulses of `K d`.
    stride: usize,
    /// Largest step so far, over the longest that the contacts on the net's masses take, and that its own stiffness does.
    pub coarseness: f64,
}

/// Where the request has what a yielding net needs, and the answer its motion.
#[derive(Debug, Clone, Default)]
pub struct LocalFields {
    force: Vec<Range<usize>>,
    residual: Option<Range<usize>>,
    rate: Option<Range<usize>>,
    tangent: Option<Range<usize>>,
    damping: Option<Range<usize>>,
    /// Begin of each sample of the net's motion in the answer.
    pub own: Vec<usize>,
}

impl LocalFields {
    /// True if a plan has all that is needed.
    pub fn are_in(plan: &Plan) -> bool {
        let has = |name: &str| plan.takes.iter().any(|f| f.name == name);
        [name::LOCAL_FORCE, name::LOCAL_FORCE_RATE, name::LOCAL_TANGENT].into_iter().all(has)
    }

    /// Find the fields in the layouts of request and answer.
    pub fn lay_out(&mut self, takes: &Layout, gives: &Layout) {
        self.force.clear();
        self.force.extend((0..).map_while(|i| sample(takes, name::FORCE, Sampling::Means, i)));
        let once = |name| takes.sample(name, Sampling::Once, 0);
        (self.residual, self.rate) = (once(name::LOCAL_FORCE), once(name::LOCAL_FORCE_RATE));
        (self.tangent, self.damping) = (once(name::LOCAL_TANGENT), once(name::LOCAL_DAMPING));
        self.own.clear();
        let own = (0..).map_while(|i| sample(gives, name::DISPLACEMENT, Sampling::AtEnds, i));
        self.own.extend(own.map(|range| range.start));
    }
}

/// A step of a net, and where it is in the window.
#[derive(Debug, Clone, Copy)]
pub struct NetStep {
    /// Number, from 0.
    pub number: usize,
    /// Steps of the window.
    pub steps: usize,
    /// Length [s].
    pub h: f64,
    /// Parts of the window between the samples of the reference.
    pub segments: usize,
}

impl NetStep {
    fn per_segment(&self) -> usize {
        self.steps / self.segments
    }
}

impl LocalNet {
    /// Room for a net of so many nodes.
    pub fn reserve(&mut self, nodes: usize) {
        self.pairs.reserve(PAIRS_PER_NODE * nodes);
        self.blocks.reserve(PAIRS_PER_NODE * nodes);
        self.stiffness.reserve(nodes);
        self.vectors().into_iter().for_each(|vector| vector.reserve(3 * nodes));
    }

    fn vectors(&mut self) -> [&mut Vec<f64>; 11] {
        let Self { rest, inverse_mass, off, off_rate, fast, slow, .. } = self;
        let Self { before, middle, velocity, force, zeros, .. } = self;
        [rest, inverse_mass, off, off_rate, fast, slow, before, middle, velocity, force, zeros]
    }

    /// Other nodes are selected; `rest` and `inverse_mass` are of all nodes.
    pub fn select(&mut self, selection: &Selection, rest: &[Vector3<f64>], inverse_mass: Option<&[f64]>) {
        self.rest.clear();
        self.inverse_mass.clear();
        for &node in &selection.nodes {
            self.rest.extend_from_slice(rest[node as usize].as_slice());
            let inverse = inverse_mass.map_or(0.0, |all| all[node as usize]);
            self.inverse_mass.extend([inverse; 3]);
        }
        self.pairs.clone_from(&selection.pairs);
        self.blocks.resize(self.pairs.len(), [0.0; 9]);
        let numbers = self.rest.len();
        self.vectors().into_iter().for_each(|vector| vector.resize(numbers, 0.0));
        self.stiffness.resize(numbers / 3, [0.0; 2]);
    }

    /// Begin a window that is cut into steps of `h` [s].
    ///
    /// `contact` is the acceleration by contact forces at the end of the window before [m/s2], empty if there were none: forces that
    /// depend on velocity see it in the first step.
    pub fn begin(&mut self, fields: &LocalFields, input: &[f64], h: f64, contact: &[f64]) {
        let numbers = self.rest.len();
        for vector in [&mut self.off, &mut self.off_rate, &mut self.slow, &mut self.force] {
            vector.fill(0.0);
        }
        self.damping = fields.damping.as_ref().map_or(0.0, |at| input[at.start]);
        self.fast.fill(0.0);
        if let Some(at) = &fields.residual {
            for i in 0..numbers {
                self.fast[i] = input[at.start + i] * self.inverse_mass[i];
            }
        }
        if contact.len() == numbers {
            add_scaled(contact, 1.0, &mut self.fast);
            if let Some(star) = fields.force.first() {
                let star = &input[star.clone()];
                let pull = star.iter().zip(&self.inverse_mass).map(|(f, w)| f * w);
                self.fast.iter_mut().zip(pull).for_each(|(fast, pull)| *fast -= pull);
            }
        }
        self.coarseness = 0.0;
        self.stride = 1;
        let Some(at) = &fields.tangent else { return };
        let blocks = input[at.clone()].as_chunks::<9>().0;
        self.blocks.copy_from_slice(blocks);
        // Gershgorin: no frequency of the patch is above the largest sum of a row over its mass. `force` is free here.
        let sums = &mut self.force;
        for (&[i, j], block) in self.pairs.iter().zip(blocks) {
            for row in 0..3 {
                for column in 0..3 {
                    let size = block[3 * row + column].abs();
                    sums[3 * i as usize + row] += size;
                    if i != j {
                        sums[3 * j as usize + column] += size;
                    }
                }
            }
        }
        let fastest = sums.iter().zip(&self.inverse_mass).map(|(k, w)| k * w).fold(0.0, f64::max);
        // Verlet is stable below twice the inverse of the frequency.
        self.coarseness = 0.5 * fastest.sqrt() * h;
        let held = SLOW / self.coarseness;
        self.stride = if held >= 1.0 { (held as usize).min(MOST_HELD_BACK) } else { 1 };
        self.force.fill(0.0);
    }

    /// Half of the largest acceleration of a node by the leftover force alone [m/s2]: times the square of a time [s], the distance
    /// that it moves off the reference.
    pub fn half_acceleration(&self, fields: &LocalFields, input: &[f64]) -> f64 {
        let Some(at) = &fields.residual else { return 0.0 };
        let forces = input[at.clone()].iter().zip(&self.inverse_mass);
        let fastest = forces.map(|(f, w)| (f * w).abs()).fold(0.0, f64::max);
        3.0_f64.sqrt() * 0.5 * fastest
    }

    /// Drift to the middle of a step; `reference` are displacement and velocity at both ends of its segment, in the request.
    pub fn to_middle(&mut self, step: NetStep, reference: [Range<usize>; 4], input: &[f64]) {
        let per = step.per_segment();
        let along = ((step.number % per) as f64 + 0.5) / per as f64;
        // Where it ended before is where this one starts.
        std::mem::swap(&mut self.before, &mut self.middle);
        if step.number == 0 {
            self.before.copy_from_slice(&input[reference[0].clone()]);
        }
        self.segment = Some(reference);
        let weights = hermite(along, per as f64 * step.h);
        let (net, reference, _) = self.split(weights, input);
        kernel::to_middle(net, 0.5 * step.h, &reference);
        self.force.fill(0.0);
        self.stiffness.fill([0.0; 2]);
    }

    /// The kick of the contact forces, and the drift to the step's end. Returns the work of the contact forces on the net [J].
    pub fn kick(&mut self, step: NetStep, fields: &LocalFields, input: &[f64]) -> f64 {
        let (h, per) = (step.h, step.per_segment());
        let time = (step.number as f64 + 0.5) * h;
        let held_back = self.held_back(step);
        if held_back > 0.0 {
            self.pull_back(h);
        }
        let along = ((step.number % per) as f64 + 1.0) / per as f64;
        let weights = hermite(along, per as f64 * h);
        let bins = fields.force.len();
        let star = (bins > 0).then(|| fields.force[step.number * bins / step.steps].clone());
        let (damping, slow) = (self.damping, h * held_back);
        let (net, reference, [contact, zeros, inverse_mass]) = self.split(weights, input);
        let part = |at: &Option<Range<usize>>| at.as_ref().map_or(zeros, |at| &input[at.clone()]);
        let (star, left, left_rate) = (part(&star), part(&fields.residual), part(&fields.rate));
        let push = Push { contact, star, left, left_rate, time, inverse_mass, damping, step: h, slow };
        kernel::kick(net, &push, &reference);
        self.touched(h)
    }

    /// Work of the contact forces in the step that ends [J]; how coarse the step is for them is remembered.
    fn touched(&mut self, h: f64) -> f64 {
        let ([mut fastest, mut most_damped], mut moved) = ([0.0_f64; 2], 0.0);
        let forces = self.force.as_chunks::<3>().0;
        for (node, (force, [k, c])) in forces.iter().zip(&self.stiffness).enumerate() {
            if *k == 0.0 && *c == 0.0 && *force == [0.0; 3] {
                continue;
            }
            let w = self.inverse_mass[3 * node];
            (fastest, most_damped) = (fastest.max(k * w), most_damped.max(c * w));
            for (i, f) in (3 * node..).zip(force) {
                moved += f * (self.middle[i] - self.before[i]);
            }
        }
        let (elastic, damped) = (fastest.sqrt() * h / COARSEST, most_damped * h / COARSEST_DASHPOT);
        self.coarseness = self.coarseness.max(elastic).max(damped);
        moved
    }

    /// Steps whose `K d` is applied in this one: all of its group, in the middle of it.
    fn held_back(&self, step: NetStep) -> f64 {
        let first = step.number / self.stride * self.stride;
        let group = self.stride.min(step.steps - first);
        if step.number == first + group / 2 { group as f64 } else { 0.0 }
    }

    /// Acceleration by `K d` in the middle of the step.
    fn pull_back(&mut self, h: f64) {
        let half = 0.5 * h;
        // Room that is free until the step's end.
        let at = &mut self.velocity;
        at.copy_from_slice(&self.off);
        add_scaled(&self.off_rate, half, at);
        self.slow.fill(0.0);
        pull(&self.pairs, &self.blocks, at.as_chunks::<3>().0, self.slow.as_chunks_mut::<3>().0);
        for (slow, w) in self.slow.iter_mut().zip(&self.inverse_mass) {
            *slow *= w;
        }
    }

    /// The motion, what the reference is at an instant with these weights, and contact force, zeros and inverse masses.
    fn split<'a>(
        &'a mut self,
        weights: [[f64; 4]; 2],
        input: &'a [f64],
    ) -> (Off<'a>, Reference<'a>, [&'a [f64]; 3]) {
        let ranges = self.segment.as_ref().expect("a step has begun");
        let samples = [0, 1, 2, 3].map(|i| &input[ranges[i].clone()]);
        let net = Off {
            off: &mut self.off,
            rate: &mut self.off_rate,
            fast: &mut self.fast,
            slow: &self.slow,
            place: &mut self.middle,
            velocity: &mut self.velocity,
        };
        (net, Reference { samples, weights }, [&self.force, &self.zeros, &self.inverse_mass])
    }

    /// Position [m] and velocity [m/s] of the node at `place`, in the middle of the step under way or, once that has ended, at
    /// its end.
    #[inline]
    pub fn node(&self, place: usize) -> (Vector3<f64>, Vector3<f64>) {
        let at = 3 * place;
        let of = |v: &[f64]| Vector3::new(v[at], v[at + 1], v[at + 2]);
        (of(&self.rest) + of(&self.middle), of(&self.velocity))
    }

    /// Write the displacement at the end of step `step` to the answer if a sample lies there.
    pub fn answer(&self, step: NetStep, fields: &LocalFields, output: &mut [f64]) {
        let samples = fields.own.len();
        let done = (step.number + 1) * samples;
        if samples > 0 && done.is_multiple_of(step.steps) {
            let at = fields.own[done / step.steps - 1];
            output[at..at + self.middle.len()].copy_from_slice(&self.middle);
        }
    }

    /// Write the acceleration by contact forces in the last step to `contact` [m/s2]; nothing where there were none.
    pub fn contact_acceleration(&self, contact: &mut Vec<f64>) {
        contact.clear();
        if self.force.iter().any(|f| *f != 0.0) {
            contact.extend(self.force.iter().zip(&self.inverse_mass).map(|(f, w)| f * w));
        }
    }

    /// Displacement at the end of the last step [m].
    pub fn displacement(&self) -> &[f64] {
        &self.middle
    }
}

#[cfg(test)]
mod tests;
