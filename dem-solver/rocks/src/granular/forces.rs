//! Forces of all pairs at one instant.
//!
//! Two passes: the first answers every pair, the second adds up, sphere by sphere, the answers of the
//! pairs in which it is the second, then of those in which it is the first, each ascending. Energies are
//! summed up block by block of spheres, and the blocks in their order.

use super::GranularModel;
use dem_contact::contact::broad_phase::cell_grid::{Plane, SpherePair, SpherePairs};
use dem_contact::contact::pipeline::Sums;
use dem_contact::law::Law;
use dem_contact::law::block::{Block, WIDTH};
use dem_contact::law::contact_point::{ContactPoint, History};
use nalgebra::Vector3;

/// Spheres of a block.
pub const BLOCK: usize = 256;

/// A sphere in the middle of a step, as the pairs see it.
#[derive(Debug, Clone, Copy)]
pub struct Seen {
    /// Centre [m].
    pub centre: Vector3<f64>,
    /// Radius [m].
    pub radius: f64,
    /// Velocity [m/s].
    pub velocity: Vector3<f64>,
    /// Angular velocity [rad/s].
    pub spin: Vector3<f64>,
}

/// What a pair does to its first sphere.
#[derive(Debug, Clone, Copy, Default)]
pub struct Push {
    /// Force [N]; the second takes the opposite.
    pub force: Vector3<f64>,
    /// Normal times force [N]: times each lever arm it turns both spheres alike.
    pub couple: Vector3<f64>,
}

/// A contact that waits for its response.
#[derive(Debug, Clone, Copy, Default)]
struct WaitingContact {
    /// Its pair.
    pair: usize,
    normal: Vector3<f64>,
    overlap: f64,
    /// The overlap over the radius of the smaller sphere.
    depth: f64,
}

/// Buffers for the answers of the pairs.
pub struct Answers<'a> {
    /// Sums of those answered so far.
    pub sums: Sums,
    /// What the pairs remember.
    pub held: &'a mut [History],
    /// What they do to their first spheres.
    pub pushes: &'a mut [Push],
    /// Moments of rolling resistance [N m]; empty where nothing rolls.
    pub moments: &'a mut [Vector3<f64>],
}

/// What does not change in a step.
#[derive(Clone, Copy)]
pub struct PairScene<'a> {
    /// The laws: of spheres with each other, then with surfaces.
    pub laws: &'a [Law],
    /// The pairs.
    pub list: &'a SpherePairs,
    /// The surfaces.
    pub planes: &'a [Plane],
    /// The spheres.
    pub seen: &'a [Seen],
    /// Inertia of each sphere about its centre [kg m2].
    pub inertia: &'a [f64],
    /// The step [s]; 0: at an instant.
    pub h: f64,
}

/// Most spheres that touch one of equal size.
const MOST_NEIGHBOURS: f64 = 12.0;

impl<'a> PairScene<'a> {
    /// The pairs of `list` as the spheres are `seen`, in a step of `h` [s].
    pub fn of(model: &'a GranularModel, list: &'a SpherePairs, seen: &'a [Seen], h: f64) -> Self {
        let GranularModel { laws, planes, inertia, .. } = model;
        Self { laws, list, planes, seen, inertia, h }
    }

    /// Where the pair touches: normal from the first, overlap, lever arms of both (the second's is 0 for a
    /// mesh).
    #[inline]
    fn touch(&self, first: &Seen, second: u32) -> Option<(Vector3<f64>, f64, [f64; 2])> {
        let count = self.seen.len();
        if let Some(other) = self.seen.get(second as usize) {
            let apart = other.centre - first.centre;
            let (square, reach) = (apart.norm_squared(), first.radius + other.radius);
            if square >= reach * reach {
                return None;
            }
            let distance = square.sqrt();
            let overlap = reach - distance;
            let arms = [first.radius - 0.5 * overlap, other.radius - 0.5 * overlap];
            return Some((apart / distance, overlap, arms));
        }
        let plane = &self.planes[second as usize - count];
        let distance = plane.offset - plane.normal.dot(&first.centre);
        let overlap = first.radius - distance;
        (overlap > 0.0).then_some((plane.normal, overlap, [distance, 0.0]))
    }

    /// Answer the pairs of the spheres from `from` to `to`.
    pub fn answer(&self, from: usize, to: usize, out: &mut Answers) {
        let mut block = Block::default();
        let mut waiting = [WaitingContact::default(); WIDTH];
        for i in from..to {
            let first = &self.seen[i];
            let range = self.list.start[i] as usize..self.list.start[i + 1] as usize;
            for p in range {
                let pair = &self.list.pairs[p];
                let Some((normal, overlap, arms)) = self.touch(first, pair.second) else {
                    out.held[p].overlap = 0.0;
                    continue;
                };
                let law = &self.laws[pair.law as usize];
                if block.is_full() || (block.count > 0 && block.law != pair.law) {
                    self.finish(&mut block, &waiting, out);
                }
                if block.count == 0 {
                    block.begin(pair.law, law);
                }
                let smaller = match self.seen.get(pair.second as usize) {
                    Some(other) => first.radius.min(other.radius),
                    None => first.radius,
                };
                waiting[block.count] = WaitingContact { pair: p, normal, overlap, depth: overlap / smaller };
                let held = &out.held[p];
                let history = if held.overlap > 0.0 { *held } else { History::default() };
                block.push(&self.point(law, i, pair, normal, overlap, arms), &history);
            }
        }
        self.finish(&mut block, &waiting, out);
    }

    /// Answer the contacts of a block, which is empty then.
    fn finish(&self, block: &mut Block, waiting: &[WaitingContact; WIDTH], out: &mut Answers) {
        if block.count == 0 {
            return;
        }
        let law = &self.laws[block.law as usize];
        block.compute(law, self.h);
        for (l, touch) in waiting.iter().enumerate().take(block.count) {
            let response = block.response(l);
            out.held[touch.pair] = response.history(touch.overlap);
            let couple =
                if law.tangential.is_some() { touch.normal.cross(&response.force) } else { Vector3::zeros() };
            out.pushes[touch.pair] = Push { force: response.force, couple };
            if law.rolling.is_some() {
                out.moments[touch.pair] = response.moment;
            }
            let sums = &mut out.sums;
            sums.damping_power += response.damping_power;
            sums.friction_power += response.friction_power;
            sums.tangential_energy += response.tangential_energy;
            sums.elastic += response.load.energy;
            sums.contacts += 1;
            sums.penetration = sums.penetration.max(touch.depth);
        }
        block.count = 0;
    }

    #[inline]
    fn point(
        &self,
        law: &Law,
        i: usize,
        pair: &SpherePair,
        normal: Vector3<f64>,
        overlap: f64,
        arms: [f64; 2],
    ) -> ContactPoint {
        let first = &self.seen[i];
        let mut velocity = first.velocity;
        let mut spin = first.spin;
        let mut turning = first.spin * arms[0];
        let mut inertia = 0.0;
        if let Some(other) = self.seen.get(pair.second as usize) {
            velocity -= other.velocity;
            spin -= other.spin;
            turning += other.spin * arms[1];
        }
        if law.rolling.is_some() {
            let other = self.inertia.get(pair.second as usize).map_or(0.0, |i| 1.0 / i);
            inertia = 1.0 / ((1.0 / self.inertia[i] + other) * MOST_NEIGHBOURS);
        }
        if law.tangential.is_some() {
            velocity += turning.cross(&normal);
        }
        let dashpot = law.damping.as_ref().map_or(0.0, |d| 2.0 * d.ratio * pair.root_mass);
        let jump = Vector3::zeros();
        ContactPoint { normal, overlap, radius: pair.radius, velocity, spin, inertia, dashpot, jump }
    }

    /// Energy of the normal springs and number of contacts of the spheres from `from` to `to`.
    pub fn stored(&self, from: usize, to: usize) -> (f64, usize) {
        let (mut energy, mut contacts) = (0.0, 0);
        for i in from..to {
            for p in self.list.start[i] as usize..self.list.start[i + 1] as usize {
                let pair = &self.list.pairs[p];
                if let Some((_, overlap, _)) = self.touch(&self.seen[i], pair.second) {
                    energy += self.laws[pair.law as usize].normal.load(pair.radius, overlap).energy;
                    contacts += 1;
                }
            }
        }
        (energy, contacts)
    }

    /// Force and torque on sphere `i`.
    #[inline]
    pub fn gather(
        &self,
        i: usize,
        held: &[History],
        pushes: &[Push],
        moments: &[Vector3<f64>],
    ) -> [Vector3<f64>; 2] {
        let radius = self.seen[i].radius;
        let (mut force, mut torque) = (Vector3::zeros(), Vector3::zeros());
        let back = self.list.back_start[i] as usize..self.list.back_start[i + 1] as usize;
        for &p in &self.list.back[back] {
            let overlap = held[p as usize].overlap;
            if overlap > 0.0 {
                force -= pushes[p as usize].force;
                torque += pushes[p as usize].couple * (radius - 0.5 * overlap);
                if let Some(moment) = moments.get(p as usize) {
                    torque -= moment;
                }
            }
        }
        for p in self.list.start[i] as usize..self.list.start[i + 1] as usize {
            let overlap = held[p].overlap;
            if overlap > 0.0 {
                let share = if self.list.pairs[p].second as usize >= self.seen.len() { 1.0 } else { 0.5 };
                force += pushes[p].force;
                torque += pushes[p].couple * (radius - share * overlap);
                if let Some(moment) = moments.get(p) {
                    torque += moment;
                }
            }
        }
        [force, torque]
    }
}
