//! The steps of a window of many spheres: position Verlet, as for the rocks (`solver::window`).

use super::GranularModel;
use super::forces::{Answers, BLOCK, PairScene, Push, Seen};
use super::state::GranularState;
use crate::gate::landing::LIMIT;
use dem_contact::contact::broad_phase::cell_grid::{SpherePair, SpherePairs};
use dem_contact::contact::pipeline::Sums;
use dem_contact::law::contact_point::History;
use interface_defs::{Fault, Window};
use nalgebra::Vector3;

/// Skin of the list of pairs over the smallest radius. Wider: fewer searches, more pairs that do not
/// touch.
const SKIN: f64 = 0.15;

/// Largest overlap over the radius of the smaller sphere: the other's surface has reached its centre.
const DEEPEST: f64 = 1.0;

/// Buffers of a run. None of it is state: it can be thrown away without changing a result.
#[derive(Default)]
pub struct GranularIntegrator {
    list: SpherePairs,
    seen: Vec<Seen>,
    held: Vec<History>,
    /// The list before, while histories are handed over.
    old: (Vec<u32>, Vec<SpherePair>, Vec<History>),
    centres: Vec<Vector3<f64>>,
    pushes: Vec<Push>,
    moments: Vec<Vector3<f64>>,
    /// Square of the furthest that a sphere has moved since the pairs were searched [m2].
    moved: f64,
    /// Steps so far.
    pub steps: u64,
    /// Evaluations of a contact so far.
    pub evaluations: u64,
}

impl GranularIntegrator {
    /// With room for what usually touches.
    pub fn new(count: usize) -> Self {
        let mut run = Self::default();
        run.list.pairs.reserve(8 * count);
        run.held.reserve(8 * count);
        run.old.1.reserve(8 * count);
        run.old.2.reserve(8 * count);
        run.pushes.reserve(8 * count);
        run
    }

    /// Times that the pairs were searched.
    pub fn searches(&self) -> u64 {
        self.list.searches
    }

    /// Advance `state` over `window`.
    pub fn solve(
        &mut self,
        model: &GranularModel,
        state: &mut GranularState,
        window: &Window,
    ) -> Result<(), Fault> {
        let steps = window.steps(model.steps.step);
        let h = window.length / steps as f64;
        self.recall(model, state);
        for step in 0..steps {
            let time = window.start + h * step as f64;
            self.step(model, state, h, time)
                .map_err(|what| Fault::window(format!("at {time:.6} s {what}")))?;
        }
        self.steps += steps as u64;
        self.remember(state, model);
        self.at_end(model, state);
        state.time = window.end();
        Ok(())
    }

    /// Contacts and stored energy of the state.
    pub fn at_end(&mut self, model: &GranularModel, state: &mut GranularState) {
        self.see(model, state, 0.0);
        self.make_sure(model);
        let scene = PairScene::of(model, &self.list, &self.seen, 0.0);
        let (mut energy, mut contacts) = (0.0, 0);
        for from in (0..self.seen.len()).step_by(BLOCK) {
            let (e, c) = scene.stored(from, (from + BLOCK).min(self.seen.len()));
            (energy, contacts) = (energy + e, contacts + c);
        }
        (state.elastic, state.contacts) = (energy, contacts);
    }

    /// The spheres after `half` a step of drift, their velocities half a step further; `half` 0: as they are.
    fn see(&mut self, model: &GranularModel, state: &GranularState, half: f64) {
        if self.seen.len() != state.position.len() {
            let zero = Vector3::zeros();
            let seen = |radius: &f64| Seen { centre: zero, radius: *radius, velocity: zero, spin: zero };
            self.seen = model.radius.iter().map(seen).collect();
        }
        let known = self.list.reference.len() == self.seen.len();
        self.moved = if known { 0.0 } else { f64::INFINITY };
        for (i, seen) in self.seen.iter_mut().enumerate() {
            seen.centre = state.position[i] + state.velocity[i] * half;
            seen.velocity = state.velocity[i] + state.acceleration[i] * half;
            seen.spin = state.spin[i] + state.turning[i] * half;
            if known {
                self.moved = self.moved.max((seen.centre - self.list.reference[i]).norm_squared());
            }
        }
    }

    /// Make sure that every pair of touching spheres is listed, histories in their places.
    fn make_sure(&mut self, model: &GranularModel) {
        let skin = SKIN * model.smallest;
        if 2.0 * self.moved.sqrt() <= skin {
            return;
        }
        let (start, pairs, held) = &mut self.old;
        std::mem::swap(start, &mut self.list.start);
        std::mem::swap(pairs, &mut self.list.pairs);
        std::mem::swap(held, &mut self.held);
        self.centres.clear();
        self.centres.extend(self.seen.iter().map(|s| s.centre));
        self.list.build(&self.centres, &model.radius, &model.planes, skin, |i, second| model.pair(i, second));
        let count = self.list.pairs.len();
        self.held.clear();
        self.held.resize(count, History::default());
        self.pushes.resize(count, Push::default());
        if model.rolls {
            self.moments.resize(count, Vector3::zeros());
        }
        let (start, pairs, held) = &self.old;
        for (i, ends) in start.windows(2).enumerate() {
            let before = ends[0] as usize..ends[1] as usize;
            hand_over(&pairs[before.clone()], &held[before], &self.list, i, &mut self.held);
        }
    }

    /// One step, that begins at `time` [s]; errs with what has gone wrong.
    fn step(
        &mut self,
        model: &GranularModel,
        state: &mut GranularState,
        h: f64,
        time: f64,
    ) -> Result<(), String> {
        self.see(model, state, 0.5 * h);
        self.make_sure(model);
        let sums = self.answer(model, h);
        if sums.penetration > DEEPEST {
            return Err(format!(
                "spheres overlap by {:.2} radii of the smaller: {}",
                sums.penetration,
                cause(model, state, h)
            ));
        }
        if sums.penetration > state.deepest.0 {
            state.deepest = (sums.penetration, time + 0.5 * h);
        }
        state.dissipated += (sums.damping_power + sums.friction_power) * h
            - (sums.tangential_energy - state.tangential_energy);
        state.tangential_energy = sums.tangential_energy;
        self.evaluations += sums.contacts as u64;
        if !self.kick(model, state, h) {
            return Err(format!("a sphere has left the finite numbers: {}", cause(model, state, h)));
        }
        Ok(())
    }

    /// Forces of all pairs.
    fn answer(&mut self, model: &GranularModel, h: f64) -> Sums {
        let Self { list, seen, held, pushes, moments, .. } = self;
        let scene = PairScene::of(model, list, seen, h);
        let mut all = Sums::default();
        for from in (0..seen.len()).step_by(BLOCK) {
            let mut out = Answers { sums: Sums::default(), held, pushes, moments };
            scene.answer(from, (from + BLOCK).min(seen.len()), &mut out);
            all.add_all(&out.sums);
        }
        all
    }

    /// The kick, and the second half of the drift; false if a sphere has left the finite numbers.
    fn kick(&self, model: &GranularModel, state: &mut GranularState, h: f64) -> bool {
        let scene = PairScene::of(model, &self.list, &self.seen, h);
        let GranularState { position, velocity, spin, acceleration, turning, .. } = state;
        let mut sum = 0.0;
        for i in 0..position.len() {
            let [force, torque] = scene.gather(i, &self.held, &self.pushes, &self.moments);
            acceleration[i] = force / model.mass[i] + model.gravity;
            turning[i] = torque / model.inertia[i];
            velocity[i] += acceleration[i] * h;
            spin[i] += turning[i] * h;
            position[i] = scene.seen[i].centre + velocity[i] * (0.5 * h);
            sum += position[i].sum() + velocity[i].sum() + spin[i].sum();
        }
        sum.is_finite()
    }

    /// Put what the state remembers into the list.
    fn recall(&mut self, model: &GranularModel, state: &GranularState) {
        self.see(model, state, 0.0);
        self.held.fill(History::default());
        self.make_sure(model);
        for (first, second, held) in &state.histories {
            let range =
                self.list.start[*first as usize] as usize..self.list.start[*first as usize + 1] as usize;
            let at = self.list.pairs[range.clone()].binary_search_by_key(second, |p| p.second);
            // A pair that has parted since the middle of its last step may be listed no more.
            if let Ok(at) = at {
                self.held[range.start + at] = *held;
            }
        }
    }

    fn remember(&self, state: &mut GranularState, model: &GranularModel) {
        state.histories.clear();
        if !model.remembers {
            return;
        }
        for i in 0..self.seen.len() {
            for p in self.list.start[i] as usize..self.list.start[i + 1] as usize {
                if self.held[p].overlap > 0.0 {
                    state.histories.push((i as u32, self.list.pairs[p].second, self.held[p]));
                }
            }
        }
    }
}

/// Hand the histories of sphere `i` from its old pairs to its new ones; both ascend.
fn hand_over(pairs: &[SpherePair], old: &[History], list: &SpherePairs, i: usize, held: &mut [History]) {
    let mut new = list.start[i] as usize;
    let end = list.start[i + 1] as usize;
    for (pair, old) in pairs.iter().zip(old).filter(|(_, old)| old.overlap > 0.0) {
        while new < end && list.pairs[new].second < pair.second {
            new += 1;
        }
        if new < end && list.pairs[new].second == pair.second {
            held[new] = *old;
        }
    }
}

/// How much faster than start and gravity make a sphere shows that contact forces gain energy.
const GAINED: f64 = 1.05;

/// Why spheres overlap too deep, or are nowhere any more, in a step of `h` [s].
fn cause(model: &GranularModel, state: &GranularState, h: f64) -> String {
    let steps = &model.steps;
    if h > steps.critical * (1.0 + 1e-9) {
        return format!(
            "the step of {h:.3e} s is above the critical step of {:.3e} s, contact forces grow from step to step: shorten \
             dem.time_step below it, or leave it out",
            steps.critical
        );
    }
    let fastest = state.velocity.iter().map(|v| v.norm()).fold(0.0, f64::max);
    // Two that collide head on are assumed there.
    let possible = 0.5 * steps.speed;
    let lost = state.velocity.iter().any(|v| !v.norm().is_finite());
    if lost || fastest > GAINED * possible {
        return format!(
            "a sphere moves with {fastest:.4e} m/s, start and gravity give {possible:.4} m/s: contact forces have made energy; \
             shorten dem.time_step ({h:.3e} s)"
        );
    }
    // Two of the smallest, head on; for a given density the overlap over the radius is the same for all sizes.
    let (radius, speed) = (model.smallest, 2.0 * fastest);
    let at = model.radius.iter().position(|r| *r == radius).unwrap_or(0);
    let deepest = |law: &dem_contact::law::Law| {
        let overlap = law.normal.deepest(0.5 * radius, 0.5 * model.mass[at], speed) / radius;
        (overlap / LIMIT).powf(law.normal.powers().overlap)
    };
    let times = model.laws.iter().map(deepest).fold(0.0, f64::max);
    let seen = format!("fastest sphere {fastest:.4} m/s, smallest radius {radius:.3e} m");
    if times <= 1.0 {
        return format!(
            "what lies on them presses them further than their own speed does; raise contact.young ({seen})"
        );
    }
    let young = model.settings.contacts.iter().filter_map(|c| c.young).fold(f64::INFINITY, f64::min);
    let stiffness = if young.is_finite() {
        format!("raise contact.young from {young:.3e} to {:.2e} Pa", young * times)
    } else {
        format!("make it {times:.1} times as stiff (contact.stiffness)")
    };
    format!("the contact is too soft for that speed, {stiffness} ({seen})")
}
