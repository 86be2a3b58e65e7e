//! Contacts of rocks with each other: the pairs of them, their contacts in a step, and free time between.
//!
//! Of two rocks the one with the smaller number is the first; pairs are gone through by the second, then by the first. Of few
//! rocks every two make a pair, of many those that are near. What is kept here between windows are lists of candidates, which no
//! result shows.

use crate::guard::cause::{Case, Pair};
use crate::guard::{LARGEST_STRIDE, STRIDE_OF_WHOLE};
use crate::model::between::Between;
use crate::model::state::{Against, BetweenRocks, State};
use crate::model::{Model, Span};
use dem_contact::contact::broad_phase::rock_pairs::{NearRocks, Pose, RockPairs, free_time};
use dem_contact::contact::pipeline::Sums;
use dem_contact::contact::rocks::{RockForces, RockHistory, RockPair, RockPairSums};
use dem_contact::contact::whole_rock::rocks::TwoWholes;
use dem_contact::law::Law;
use dem_contact::rock::{Motion, Rock};
use interface_defs::Fault;
use nalgebra::Vector3;

/// Largest overlap, in radii of the smaller sphere: the other's surface has reached its centre.
const DEEPEST: f64 = 1.0;

/// Overlap of two rocks at the start, in radii of the smaller sphere, that is refused.
pub const DEEPEST_AT_START: f64 = 0.5;

/// Most rocks of which every two are looked at.
const FEW: usize = 16;

/// Contacts of a rock with others for which room is made, of many rocks.
const NEIGHBOURS: usize = 8;

/// What a rock feels of all others in the middle of a step.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct RockLoad {
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
struct NearRocksPair {
    rocks: [usize; 2],
    /// Number of their law.
    law: usize,
    near: RockPairs,
}

/// The pairs of rocks; none without a law between rocks.
#[derive(Debug, Clone, Default)]
pub struct RockStage {
    pairs: Vec<NearRocksPair>,
    /// Number of rocks that have a law between them.
    rocks: usize,
    /// Which pairs are looked at, of many rocks.
    near: Option<NearRocks>,
    /// Searches of pairs that are no more near.
    ended: u64,
    evaluation: RockForces,
    after: Vec<RockHistory>,
    /// What each rock feels, by its number.
    pub felt: Vec<RockLoad>,
}

impl RockStage {
    /// For the rocks of a model.
    pub fn new(model: &Model) -> Self {
        let felt = vec![RockLoad::default(); model.rocks.len()];
        let Some(between) = &model.between else { return Self { felt, ..Self::default() } };
        let rocks = model.rocks.len();
        let mut it = Self { rocks, felt, ..Self::default() };
        if rocks > FEW {
            it.near = Some(NearRocks::new(model.trees.iter().map(|tree| tree.reach).collect()));
            it.after.reserve(NEIGHBOURS * rocks);
        } else {
            it.pairs = every_two(rocks).map(|rocks| NearRocksPair::new(model, between, rocks)).collect();
            it.after.reserve(Self::room(&it.pairs));
        }
        let most = it.pairs.iter().map(|p| p.near.pairs.capacity()).max().unwrap_or(0);
        it.evaluation.reserve(most);
        it
    }

    /// Of many rocks, look for those that are near each other at `position` [m].
    fn update(&mut self, model: &Model, position: impl Iterator<Item = Vector3<f64>>) {
        let (Some(near), Some(between)) = (&mut self.near, &model.between) else { return };
        if !near.update(position) {
            return;
        }
        let order = |[a, b]: [usize; 2]| [b, a];
        let mut old = std::mem::take(&mut self.pairs).into_iter().peekable();
        for rocks in near.pairs() {
            while let Some(ended) = old.next_if(|pair| order(pair.rocks) < order(rocks)) {
                self.ended += ended.near.searches;
            }
            let known = old.next_if(|pair| pair.rocks == rocks);
            self.pairs.push(known.unwrap_or_else(|| NearRocksPair::new(model, between, rocks)));
        }
        self.ended += old.map(|ended| ended.near.searches).sum::<u64>();
    }

    fn room(pairs: &[NearRocksPair]) -> usize {
        // A rock has no more neighbours than spheres of one size have: most pairs never touch at once.
        let mut room: Vec<usize> = pairs.iter().map(|p| p.near.pairs.capacity()).collect();
        room.sort_unstable_by(|a, b| b.cmp(a));
        room.iter().take(24).sum()
    }

    /// Memories for which there is room.
    pub fn most_contacts(&self) -> usize {
        self.after.capacity()
    }

    /// True if there is nothing to do.
    pub fn is_empty(&self) -> bool {
        self.rocks == 0
    }

    /// Times that candidates were searched.
    pub fn searches(&self) -> u64 {
        let all = self.near.as_ref().map_or(0, NearRocks::searches);
        all + self.ended + self.pairs.iter().map(|p| p.near.searches).sum::<u64>()
    }

    /// Time in which no two rocks that fly freely can touch [s]; of many rocks 0 where it is below `least` [s].
    pub fn free_time(&self, model: &Model, state: &State, least: f64) -> f64 {
        let motion = |r: usize| &state.bodies[r].motion;
        let least = if self.near.is_some() { least } else { 0.0 };
        let mut free = f64::INFINITY;
        for [a, b] in self.pairs() {
            free = free.min(free_time(&model.trees[a], &model.trees[b], motion(a), motion(b)));
            if free <= least {
                return 0.0;
            }
        }
        free
    }

    /// Every two rocks between which there is a law.
    pub fn pairs(&self) -> impl Iterator<Item = [usize; 2]> {
        every_two(self.rocks)
    }

    /// Forces of all pairs in the middle of a step, where the rocks
    /// move as `middles`; what each feels goes to [`RockStage::felt`], histories to `between_rocks`. The
    /// sums are those of all pairs together.
    pub fn forces(
        &mut self,
        model: &Model,
        middles: &[Motion],
        between_rocks: &mut BetweenRocks,
        span @ Span { h, .. }: Span,
    ) -> Result<Sums, Fault> {
        self.update(model, middles.iter().map(|motion| motion.position));
        self.felt.fill(RockLoad::default());
        self.after.clear();
        let mut all = Sums::default();
        let mut before = &between_rocks.histories[..];
        for pair in &mut self.pairs {
            let numbers = pair.numbers();
            let ended = before.iter().take_while(|held| held.rocks < numbers).count();
            before = &before[ended..];
            let own = before.iter().take_while(|held| held.rocks == numbers).count();
            let (mine, others) = before.split_at(own);
            before = others;
            let rocks @ [a, b] = pair.rocks;
            let law = pair.law;
            let seen = pair.see(model, [&middles[a], &middles[b]]);
            let Some((two, pose)) = seen else { continue };
            let sums = self.evaluation.forces(&two, &pose, h, mine, &mut self.after);
            watch(model, &two, rocks, law, &sums, span)?;
            let own = &sums.first;
            if own.contacts == 0 {
                continue;
            }
            for (rock, sign, torque) in [(a, 1.0, own.torque), (b, -1.0, sums.torque)] {
                let felt = &mut self.felt[rock];
                felt.force += own.force * sign;
                felt.torque += torque;
                felt.contacts += own.contacts;
                felt.penetration = felt.penetration.max(own.penetration);
            }
            all.add_all(own);
        }
        std::mem::swap(&mut between_rocks.histories, &mut self.after);
        Ok(all)
    }

    /// Fill in elastic energy and number of contacts at the instant of `state`; the two rocks that
    /// overlap most, and by how many radii of the smaller sphere.
    pub fn energy(&mut self, model: &Model, state: &mut State) -> Option<([usize; 2], f64)> {
        self.update(model, state.bodies.iter().map(|body| body.motion.position));
        let (mut elastic, mut contacts, mut worst) = (0.0, 0, None);
        state.bodies.iter_mut().for_each(|body| body.rock_contacts = 0);
        for pair in &mut self.pairs {
            let [a, b] = pair.rocks;
            let motions = [state.bodies[a].motion, state.bodies[b].motion];
            let Some((two, pose)) = pair.see(model, [&motions[0], &motions[1]]) else { continue };
            let (energy, count, deepest) = self.evaluation.energy(&two, &pose);
            elastic += energy;
            contacts += count;
            state.bodies[a].rock_contacts += count;
            state.bodies[b].rock_contacts += count;
            if count > 0 && worst.is_none_or(|(_, most)| deepest > most) {
                worst = Some((pair.rocks, deepest));
            }
        }
        (state.between_rocks.elastic, state.between_rocks.contacts) = (elastic, contacts);
        worst
    }
}

/// All pairs of so many rocks.
fn every_two(rocks: usize) -> impl Iterator<Item = [usize; 2]> {
    (1..rocks).flat_map(|b| (0..b).map(move |a| [a, b]))
}

impl NearRocksPair {
    fn new(model: &Model, between: &Between, rocks @ [a, b]: [usize; 2]) -> Self {
        let near = RockPairs::new(&model.rocks[a], &model.rocks[b]);
        Self { rocks, law: between.law(a, b), near }
    }

    /// What its histories are kept under.
    fn numbers(&self) -> [u32; 2] {
        let [a, b] = self.rocks;
        [b as u32, a as u32]
    }

    /// The two as they stand, their candidates up to date; `None` if none are near.
    fn see<'a>(&'a mut self, model: &'a Model, motions: [&'a Motion; 2]) -> Option<(RockPair<'a>, Pose)> {
        let [a, b] = self.rocks;
        let pose = Pose::new(motions[0], motions[1]);
        let side = |r: usize| (&model.rocks[r], &model.trees[r]);
        self.near.update(side(a), side(b), &pose);
        if self.near.pairs.is_empty() {
            return None;
        }
        let law = &model.laws.as_ref()?.rocks[self.law];
        let rocks: [&Rock; 2] = [&model.rocks[a], &model.rocks[b]];
        let numbers = self.numbers();
        let wholes = wholes(model, law, self.rocks);
        Some((RockPair { numbers, rocks, motions, law, wholes, pairs: &self.near.pairs }, pose))
    }
}

/// What two rocks need that touch as wholes.
fn wholes<'a>(model: &'a Model, law: &Law, [a, b]: [usize; 2]) -> Option<TwoWholes<'a>> {
    let [one, other] = [a, b].map(|r| model.pair_wholes.get(r).and_then(Option::as_ref));
    one.zip(other).filter(|_| law.whole).map(|(a, b)| TwoWholes { wholes: [a, b] })
}

/// Fail the window if two rocks have passed each other too fast to be seen, or overlap too far.
fn watch(
    model: &Model,
    two: &RockPair,
    rocks @ [a, b]: [usize; 2],
    law: usize,
    sums: &RockPairSums,
    span: Span,
) -> Result<(), Fault> {
    let [one, other] = two.motions;
    let Sums { fastest, penetration, .. } = sums.first;
    // The faster shows where energy has been made.
    let (rock, now) = if one.velocity.norm() > other.velocity.norm() { (a, one) } else { (b, other) };
    let [r, s] = match &two.wholes {
        Some(wholes) => wholes.wholes.map(|whole| whole.radius),
        None => two.rocks.map(|rock| rock.smallest_radius),
    };
    let [m, n] = two.rocks.map(|rock| rock.mass);
    let pair = Pair { rocks, smallest: r.min(s), effective: r * s / (r + s), mass: m * n / (m + n) };
    let case = Case { law: Some(law), pair: Some(pair), ..Case::new(model, rock, Against::Rocks, span) };
    let share = if two.wholes.is_some() { STRIDE_OF_WHOLE } else { LARGEST_STRIDE };
    case.check_stride(now, fastest, share, "they move past each other")?;
    if penetration <= DEEPEST {
        return Ok(());
    }
    let of = if two.wholes.is_some() { "rock" } else { "sphere" };
    let what = format!(
        " against each other: they overlap by {penetration:.2} radii of the smaller {of} (radius {:.3e} m{}), past its centre",
        pair.smallest,
        case.modulus(", ")
    );
    let speed = (one.velocity - other.velocity).norm();
    Err(case.too_deep(speed, &what, &case.why_too_deep(now, fastest)))
}
