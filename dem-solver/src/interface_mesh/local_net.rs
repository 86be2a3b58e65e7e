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

use interface_defs::{Layout, Plan, Sampling, Selection, name, wide};
use nalgebra::Vector3;
use std::ops::Range;

/// Share of the critical step of the patch up to which `K d` is held back.
const SLOW: f64 = 0.2;
/// Most steps between two impulses of `K d`.
const MOST_HELD_BACK: usize = 16;
/// Coupled pairs for each node for which there is room from the start.
const PAIRS_PER_NODE: usize = 8;
/// Largest step times frequency of a contact on the masses of its nodes; 2 is the limit of stability.
const COARSEST: f64 = 0.7;
/// Largest step times the rate at which a dashpot stops a node; 1 is the limit of stability.
const COARSEST_DASHPOT: f64 = 0.3;

/// Where the request has what a yielding net needs, and the answer its motion.
#[derive(Debug, Clone, Default)]
pub struct LocalFields {
    force: Vec<Range<usize>>,
    residual: Option<Range<usize>>,
    rate: Option<Range<usize>>,
    tangent: Option<Range<usize>>,
    damping: Option<Range<usize>>,
    /// Begin of each sample of the net's motion in the answer.
    own: Vec<usize>,
}

impl LocalFields {
    /// Whether a plan has all that is needed.
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

    /// Samples of the net's motion in the answer.
    pub fn own_samples(&self) -> usize {
        self.own.len()
    }
}

/// Sample `number` of a field, if the plan has so many.
fn sample(layout: &Layout, name: &str, sampling: Sampling, number: usize) -> Option<Range<usize>> {
    let spec = layout.fields().find(|f| f.name == name && f.sampling == sampling)?;
    (number < spec.sample_count()).then(|| layout.sample(name, sampling, number)).flatten()
}

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
    damping: f64,
    /// Steps between two impulses of `K d`.
    stride: usize,
    /// Largest step so far, over the longest that the contacts on the net's masses take.
    pub coarseness: f64,
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
        let of_nodes =
            [&mut self.rest, &mut self.inverse_mass, &mut self.off, &mut self.off_rate, &mut self.fast];
        let others =
            [&mut self.slow, &mut self.before, &mut self.middle, &mut self.velocity, &mut self.force];
        of_nodes.into_iter().chain(others).for_each(|vector| vector.reserve(3 * nodes));
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
        for vector in [&mut self.off, &mut self.off_rate, &mut self.fast, &mut self.slow] {
            vector.resize(numbers, 0.0);
        }
        for vector in [&mut self.before, &mut self.middle, &mut self.velocity, &mut self.force] {
            vector.resize(numbers, 0.0);
        }
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
        let held = SLOW * 2.0 / fastest.sqrt() / h;
        self.stride = if held >= 1.0 { (held as usize).min(MOST_HELD_BACK) } else { 1 };
        self.force.fill(0.0);
    }

    /// Largest distance that the leftover force alone moves a node off the reference in `time` [m].
    pub fn drift(&self, fields: &LocalFields, input: &[f64], time: f64) -> f64 {
        let Some(at) = &fields.residual else { return 0.0 };
        let forces = input[at.clone()].iter().zip(&self.inverse_mass);
        let fastest = forces.map(|(f, w)| (f * w).abs()).fold(0.0, f64::max);
        3.0_f64.sqrt() * 0.5 * fastest * time * time
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
        let [value, rate] = hermite(along, per as f64 * step.h);
        let samples = self.samples(input);
        let half = 0.5 * step.h;
        blend(&value, &samples, &mut self.middle);
        add_scaled(&self.off, 1.0, &mut self.middle);
        add_scaled(&self.off_rate, half, &mut self.middle);
        blend(&rate, &samples, &mut self.velocity);
        add_scaled(&self.off_rate, 1.0, &mut self.velocity);
        add_scaled(&self.fast, half, &mut self.velocity);
        add_scaled(&self.slow, half, &mut self.velocity);
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
        // The room for velocities is free until the step's end: it takes the sum of the forces.
        self.velocity.copy_from_slice(&self.force);
        let bins = fields.force.len();
        if bins > 0 {
            let star = &input[fields.force[step.number * bins / step.steps].clone()];
            add_scaled(star, -1.0, &mut self.velocity);
        }
        for (at, weight) in [(&fields.residual, 1.0), (&fields.rate, time)] {
            if let Some(at) = at {
                add_scaled(&input[at.clone()], weight, &mut self.velocity);
            }
        }
        accelerate(&self.velocity, &self.inverse_mass, self.damping, &self.off_rate, &mut self.fast);
        add_scaled(&self.off_rate, 0.5 * h, &mut self.off);
        add_scaled(&self.fast, h, &mut self.off_rate);
        if held_back > 0.0 {
            add_scaled(&self.slow, h * held_back, &mut self.off_rate);
        }
        add_scaled(&self.off_rate, 0.5 * h, &mut self.off);
        for ([k, c], w) in self.stiffness.iter().zip(self.inverse_mass.as_chunks::<3>().0) {
            let (elastic, damped) = ((k * w[0]).sqrt() * h / COARSEST, c * w[0] * h / COARSEST_DASHPOT);
            self.coarseness = self.coarseness.max(elastic).max(damped);
        }
        let along = ((step.number % per) as f64 + 1.0) / per as f64;
        let [value, rate] = hermite(along, per as f64 * h);
        let samples = self.samples(input);
        blend(&value, &samples, &mut self.middle);
        add_scaled(&self.off, 1.0, &mut self.middle);
        blend(&rate, &samples, &mut self.velocity);
        add_scaled(&self.off_rate, 1.0, &mut self.velocity);
        let moved = self.force.iter().zip(&self.middle).zip(&self.before);
        moved.filter(|((f, _), _)| **f != 0.0).map(|((f, end), start)| f * (end - start)).sum()
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

    fn samples<'a>(&self, input: &'a [f64]) -> [&'a [f64]; 4] {
        let ranges = self.segment.as_ref().expect("a step has begun");
        [0, 1, 2, 3].map(|i| &input[ranges[i].clone()])
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

/// Weights of displacements and velocities at the ends of a segment of `length` [s]: cubic Hermite polynomials and their rates,
/// at the share `t` of it.
fn hermite(t: f64, length: f64) -> [[f64; 4]; 2] {
    let (t2, t3) = (t * t, t * t * t);
    let value =
        [2.0 * t3 - 3.0 * t2 + 1.0, 3.0 * t2 - 2.0 * t3, (t3 - 2.0 * t2 + t) * length, (t3 - t2) * length];
    let bend = 6.0 * (t2 - t) / length;
    [value, [bend, -bend, 3.0 * t2 - 4.0 * t + 1.0, 3.0 * t2 - 2.0 * t]]
}

wide! {
    /// `sum = sum of weight times sample`.
    fn blend(weights: &[f64; 4], samples: &[&[f64]; 4], sum: &mut [f64]) {
        let n = sum.len();
        let [a, b, c, d] = samples.map(|sample| &sample[..n]);
        for i in 0..n {
            sum[i] = weights[0] * a[i] + weights[1] * b[i] + weights[2] * c[i] + weights[3] * d[i];
        }
    }
}

wide! {
    /// `sum += factor a`.
    fn add_scaled(a: &[f64], factor: f64, sum: &mut [f64]) {
        let a = &a[..sum.len()];
        for i in 0..sum.len() {
            sum[i] += factor * a[i];
        }
    }
}

wide! {
    /// `acceleration = force / mass - damping velocity`.
    fn accelerate(force: &[f64], inverse_mass: &[f64], damping: f64, velocity: &[f64], acceleration: &mut [f64]) {
        let n = acceleration.len();
        let (force, inverse_mass, velocity) = (&force[..n], &inverse_mass[..n], &velocity[..n]);
        for i in 0..n {
            acceleration[i] = force[i] * inverse_mass[i] - damping * velocity[i];
        }
    }
}

wide! {
    /// `sum -= K at`, with the blocks of `K` for pairs of nodes.
    fn pull(pairs: &[[u32; 2]], blocks: &[[f64; 9]], at: &[[f64; 3]], sum: &mut [[f64; 3]]) {
        for (&[i, j], k) in pairs.iter().zip(blocks) {
            let (i, j) = (i as usize, j as usize);
            let (a, b) = (at[i], at[j]);
            let own = &mut sum[i];
            for row in 0..3 {
                own[row] -= k[3 * row] * b[0] + k[3 * row + 1] * b[1] + k[3 * row + 2] * b[2];
            }
            if i != j {
                let other = &mut sum[j];
                for row in 0..3 {
                    other[row] -= k[row] * a[0] + k[3 + row] * a[1] + k[6 + row] * a[2];
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use interface_defs::{FieldSpec, InterfaceMesh, Items, Place};

    /// Two nodes, the first held, a wire of 100 N/m between them along x, and a mass of 0.25 kg: a frequency of 20 rad/s.
    fn net() -> (LocalNet, LocalFields, Layout) {
        let mesh = InterfaceMesh { coordinates: vec![0.0; 6], lines: vec![[0, 1]], ..Default::default() };
        let spec = |name, sampling| FieldSpec { samples: 2, ..FieldSpec::nodal(name, 3, sampling) };
        let once = |name, components, place| FieldSpec {
            place,
            ..FieldSpec::nodal(name, components, Sampling::Once)
        };
        let mut takes = Layout::new(
            &[
                spec(name::DISPLACEMENT, Sampling::FromStart),
                spec(name::VELOCITY, Sampling::FromStart),
                spec(name::FORCE, Sampling::Means),
                once(name::LOCAL_FORCE, 3, Place::Node),
                once(name::LOCAL_FORCE_RATE, 3, Place::Node),
                once(name::LOCAL_TANGENT, 9, Place::Pair),
            ],
            &mesh,
            0,
        );
        let mut selection = Selection::new(&mesh);
        selection.set(&mesh, [0, 1].into_iter()).expect("nodes of the mesh");
        selection.pairs.extend([[0, 0], [0, 1], [1, 1]]);
        takes.resize(&Items { pairs: 3, ..selection.items() });
        let mut fields = LocalFields::default();
        fields.lay_out(&takes, &Layout::default());
        let mut net = LocalNet::default();
        net.select(&selection, &[Vector3::zeros(), Vector3::x()], Some(&[0.0, 4.0]));
        (net, fields, takes)
    }

    /// Advance a window of `length` [s] in `steps` steps under the force `pull` [N] on the second node along x; displacement and
    /// velocity of that node, and the work of the force.
    fn advance(input: &[f64], (length, steps): (f64, usize), pull: f64) -> (f64, f64, f64) {
        let (mut net, fields, takes) = net();
        let h = length / steps as f64;
        net.begin(&fields, input, h, &[]);
        let mut work = 0.0;
        for number in 0..steps {
            let step = NetStep { number, steps, h, segments: 2 };
            let at = |name, s| takes.sample(name, Sampling::FromStart, s).expect("in the plan");
            let s = number / (steps / 2);
            let ends = [
                at(name::DISPLACEMENT, s),
                at(name::DISPLACEMENT, s + 1),
                at(name::VELOCITY, s),
                at(name::VELOCITY, s + 1),
            ];
            net.to_middle(step, ends, input);
            net.force[3] = pull;
            work += net.kick(step, &fields, input);
        }
        let (position, velocity) = net.node(1);
        (position.x - 1.0, velocity.x, work)
    }

    fn tangent(takes: &Layout, input: &mut [f64]) {
        let at = takes.sample(name::LOCAL_TANGENT, Sampling::Once, 0).expect("in the plan").start;
        (input[at], input[at + 9], input[at + 18]) = (100.0, -100.0, 100.0);
    }

    /// `m u'' = F - K (u - u_0) + f` has the solution `(F + f) / K (1 - cos w t)` from rest; halving the steps quarters the error, as long
    /// as they are too long for `K d` to be held back; with that it stays below a hundredth.
    #[test]
    fn a_pulled_node_swings_as_a_mass_on_a_spring_with_second_order() {
        let (_, _, takes) = net();
        let mut input = vec![0.0; takes.len()];
        tangent(&takes, &mut input);
        let residual = takes.sample(name::LOCAL_FORCE, Sampling::Once, 0).expect("in the plan").start;
        input[residual + 3] = 2.0;
        let (w, time): (f64, f64) = (20.0, 0.1);
        let exact = 0.05 * (1.0 - (w * time).cos());
        let errors = [4, 8, 64].map(|steps| {
            let (u, v, work) = advance(&input, (time, steps), 3.0);
            assert!((work - 3.0 * u).abs() < 1e-12, "a constant force does force times displacement");
            assert!((v - 0.05 * w * (w * time).sin()).abs() < 0.06, "{v}");
            (u - exact).abs()
        });
        assert!(errors[0] < 5e-3 && errors[1] < 0.3 * errors[0] && errors[2] < 0.01 * exact, "{errors:?}");
    }

    /// A reference that is the solution already, with the force under which it is: nothing is left to move.
    #[test]
    fn under_the_force_of_the_reference_a_node_stays_on_it() {
        let (_, _, takes) = net();
        let mut input = vec![0.0; takes.len()];
        tangent(&takes, &mut input);
        for s in 0..3 {
            let t = 0.005 * s as f64;
            let at = |name| takes.sample(name, Sampling::FromStart, s).expect("in the plan").start + 3;
            input[at(name::DISPLACEMENT)] = 0.03 * (1.0 - (20.0 * t).cos());
            input[at(name::VELOCITY)] = 0.6 * (20.0 * t).sin();
        }
        for s in 0..2 {
            input[takes.sample(name::FORCE, Sampling::Means, s).expect("in the plan").start + 3] = 3.0;
        }
        let (u, v, _) = advance(&input, (0.01, 8), 3.0);
        assert!(
            (u - 0.03 * (1.0 - 0.2_f64.cos())).abs() < 1e-15 && (v - 0.6 * 0.2_f64.sin()).abs() < 1e-13,
            "{u} {v}"
        );
        let (other, ..) = advance(&input, (0.01, 8), 4.0);
        let off = 0.01 * (1.0 - 0.2_f64.cos());
        assert!(
            (other - u - off).abs() < 0.02 * off,
            "one newton more moves it as from rest: {}",
            (other - u) / off
        );
    }

    #[test]
    fn a_held_node_follows_its_reference_whatever_pulls() {
        let (mut net, fields, takes) = net();
        let input = vec![0.0; takes.len()];
        net.begin(&fields, &input, 1e-3, &[]);
        let step = NetStep { number: 0, steps: 2, h: 1e-3, segments: 2 };
        net.to_middle(step, [0..6, 6..12, 18..24, 24..30], &input);
        net.force[0] = 1e6;
        net.kick(step, &fields, &input);
        assert_eq!(net.node(0).0, Vector3::zeros());
    }
}
