//! Rocks that meet each other: the pairs of them, their contacts in a step, and free time between.
//!
//! Every two rocks make a pair, the one with the smaller number first; pairs are gone through in
//! ascending order. What is kept here between windows is a list of candidates, which no result shows.

use super::state::{Encounters, State};
use super::{Model, name_of};
use crate::contact::rocks::{Evaluation, Held, Sums, Two};
use crate::rock::{Motion, Rock};
use crate::search::rocks::{Pose, RockPairs, free_time};
use interface_defs::Fault;
use nalgebra::Vector3;

/// Largest way of one rock past another in one step, as a share of the smaller of their spheres' radii.
const LARGEST_STRIDE: f64 = 0.5;

/// Largest overlap, in radii of the smaller sphere: the other's surface has reached its centre.
const DEEPEST: f64 = 1.0;

/// Overlap of two rocks at the start, in radii of the smaller sphere, that is refused.
pub const DEEPEST_AT_START: f64 = 0.5;

/// What a rock feels of all others in the middle of a step.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Felt {
    /// Force [N].
    pub force: Vector3<f64>,
    /// Torque about its centre of mass [N m].
    pub torque: Vector3<f64>,
    /// Number of contacts.
    pub contacts: usize,
    /// Largest overlap over the smaller radius.
    pub penetration: f64,
}

/// Two rocks and what is near between them.
#[derive(Debug, Clone)]
struct Pair {
    rocks: [usize; 2],
    /// Number of their law.
    law: usize,
    near: RockPairs,
}

/// All pairs of rocks; none without a law between rocks.
#[derive(Debug, Clone, Default)]
pub struct Meetings {
    pairs: Vec<Pair>,
    evaluation: Evaluation,
    after: Vec<Held>,
    /// What each rock feels, by its number.
    pub felt: Vec<Felt>,
}

impl Meetings {
    /// For the rocks of a model.
    pub fn new(model: &Model) -> Self {
        let mut pairs = Vec::new();
        if let Some(rows) = &model.rock_rows {
            for (b, row) in rows.iter().enumerate() {
                for (a, law) in row.iter().enumerate().take(b) {
                    let near = RockPairs::new(&model.rocks[a], &model.rocks[b]);
                    pairs.push(Pair { rocks: [a, b], law: *law as usize, near });
                }
            }
        }
        let most = pairs.iter().map(|p| p.near.pairs.capacity()).max().unwrap_or(0);
        let mut evaluation = Evaluation::default();
        evaluation.reserve(most);
        let felt = vec![Felt::default(); model.rocks.len()];
        Self { after: Vec::with_capacity(Self::room(&pairs)), pairs, evaluation, felt }
    }

    fn room(pairs: &[Pair]) -> usize {
        // A rock has no more neighbours than spheres of one size have: most pairs never meet at once.
        let mut room: Vec<usize> = pairs.iter().map(|p| p.near.pairs.capacity()).collect();
        room.sort_unstable_by(|a, b| b.cmp(a));
        room.iter().take(24).sum()
    }

    /// Memories for which there is room.
    pub fn most_contacts(&self) -> usize {
        self.after.capacity()
    }

    /// Whether there is anything to do.
    pub fn is_empty(&self) -> bool {
        self.pairs.is_empty()
    }

    /// Times that candidates were searched.
    pub fn searches(&self) -> u64 {
        self.pairs.iter().map(|p| p.near.searches).sum()
    }

    /// Time in which no two rocks that fly freely can touch [s].
    pub fn free_time(&self, model: &Model, state: &State) -> f64 {
        let free = |pair: &Pair| {
            let [a, b] = pair.rocks;
            let motion = |r: usize| &state.bodies[r].motion;
            free_time(&model.trees[a], &model.trees[b], motion(a), motion(b))
        };
        self.pairs.iter().map(free).fold(f64::INFINITY, f64::min)
    }

    /// The pairs of rocks.
    pub fn pairs(&self) -> impl Iterator<Item = [usize; 2]> {
        self.pairs.iter().map(|pair| pair.rocks)
    }

    /// Forces of all pairs in the middle of the step of `h` [s] that began at `time`, where the rocks
    /// move as `middles`; what each feels goes to [`Meetings::felt`], memories to `encounters`. The
    /// sums are those of all pairs together.
    pub fn forces(
        &mut self,
        model: &Model,
        middles: &[Motion],
        encounters: &mut Encounters,
        h: f64,
        time: f64,
    ) -> Result<Sums, Fault> {
        self.felt.fill(Felt::default());
        self.after.clear();
        let mut all = Sums::default();
        let mut before = &encounters.memories[..];
        for (number, pair) in self.pairs.iter_mut().enumerate() {
            let own = before.iter().take_while(|held| held.rocks as usize == number).count();
            let (mine, others) = before.split_at(own);
            before = others;
            let rocks @ [a, b] = pair.rocks;
            let seen = pair.see(model, number, [&middles[a], &middles[b]]);
            let Some((two, pose)) = seen else { continue };
            let sums = self.evaluation.forces(&two, &pose, h, mine, &mut self.after);
            watch(model, &two, rocks, &sums, h, time)?;
            if sums.contacts == 0 {
                continue;
            }
            for (side, sign) in [(0, 1.0), (1, -1.0)] {
                let felt = &mut self.felt[rocks[side]];
                felt.force += sums.force * sign;
                felt.torque += sums.torques[side];
                felt.contacts += sums.contacts;
                felt.penetration = felt.penetration.max(sums.penetration);
            }
            all.elastic += sums.elastic;
            all.damped += sums.damped;
            all.rubbed += sums.rubbed;
            all.sheared += sums.sheared;
            all.contacts += sums.contacts;
        }
        std::mem::swap(&mut encounters.memories, &mut self.after);
        Ok(all)
    }

    /// Fill in elastic energy and number of contacts at the instant of `state`; the two rocks that
    /// overlap most, and by how many radii of the smaller sphere.
    pub fn energy(&mut self, model: &Model, state: &mut State) -> Option<([usize; 2], f64)> {
        let (mut elastic, mut contacts, mut worst) = (0.0, 0, None);
        state.bodies.iter_mut().for_each(|body| body.met = 0);
        for (number, pair) in self.pairs.iter_mut().enumerate() {
            let [a, b] = pair.rocks;
            let motions = [state.bodies[a].motion, state.bodies[b].motion];
            let Some((two, pose)) = pair.see(model, number, [&motions[0], &motions[1]]) else { continue };
            let (energy, count, deepest) = self.evaluation.energy(&two, &pose);
            elastic += energy;
            contacts += count;
            state.bodies[a].met += count;
            state.bodies[b].met += count;
            if count > 0 && worst.is_none_or(|(_, most)| deepest > most) {
                worst = Some((pair.rocks, deepest));
            }
        }
        (state.encounters.elastic, state.encounters.contacts) = (elastic, contacts);
        worst
    }
}

impl Pair {
    /// The two as they stand, their candidates up to date; `None` if none are near.
    fn see<'a>(
        &'a mut self,
        model: &'a Model,
        number: usize,
        motions: [&'a Motion; 2],
    ) -> Option<(Two<'a>, Pose)> {
        let [a, b] = self.rocks;
        let pose = Pose::new(motions[0], motions[1]);
        let side = |r: usize| (&model.rocks[r], &model.trees[r]);
        self.near.update(side(a), side(b), &pose);
        if self.near.pairs.is_empty() {
            return None;
        }
        let law = &model.laws.as_ref()?.rocks[self.law];
        let rocks: [&Rock; 2] = [&model.rocks[a], &model.rocks[b]];
        Some((Two { number: number as u32, rocks, motions, law, pairs: &self.near.pairs }, pose))
    }
}

/// Fail the window if two rocks have passed each other too fast to be met, or too deep.
fn watch(model: &Model, two: &Two, [a, b]: [usize; 2], sums: &Sums, h: f64, time: f64) -> Result<(), Fault> {
    let radius = two.rocks[0].smallest_radius.min(two.rocks[1].smallest_radius);
    let names = || format!("rocks `{}` and `{}`", name_of(model, a), name_of(model, b));
    let stride = sums.fastest * h;
    if stride > LARGEST_STRIDE * radius {
        return Err(Fault::window(format!(
            "{} at {time:.6} s: they move {stride:.3e} m past each other in one step of {h:.3e} s, more than half the \
             radius {radius:.3e} m of their spheres, and might pass through unseen; shorten dem.time_step",
            names()
        )));
    }
    if sums.penetration > DEEPEST {
        return Err(Fault::window(format!(
            "{} at {time:.6} s: they overlap by {:.2} radii of the smaller sphere, past its centre; the contact is too \
             soft, raise contact.young, or shorten dem.time_step",
            names(),
            sums.penetration
        )));
    }
    Ok(())
}
