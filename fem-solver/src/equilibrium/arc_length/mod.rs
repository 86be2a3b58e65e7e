//! Statics along the path of equilibrium: loads grow and fall by one factor, through limit points and back.
//!
//! ```text
//! r(u, f) = p + f q - f_int(u) = 0           p = dead load, q = the loads that grow, f = their factor
//! K du - q df = r,   du_e = 0                e = the degree of freedom that moves most along the path
//! ```
//!
//! A step goes along the tangent of the path until the degree of freedom that moves most along it has gone a
//! given way, and holds that one while Newton returns to the path: local parameters in place of a sphere, so that the
//! system stays regular at limit points of load and of displacement alike.
//!
//! How long a step is, the path says and not the output: the directions at both ends and the chord between them may differ by
//! `TURN` at most, of the displacements as of the load; and Newton returns within `FEW` iterations. Else the step is
//! shortened and taken anew; corners, where something goes slack or taut, are leapt over. Rows of output shorten a step to
//! their own place, and leave the length of the next as it is.
//!
//! The number of negative pivots of `K` says how many directions are unstable. Along a smooth path, the sign of its
//! determinant and that of `df/ds` change together; where one of both changes alone, the path has crossed a branch, or the
//! step has jumped to another path. `critical` finds which, and where.
//!
//! Source: Rheinboldt (1981), Numer. Math. 37, 1 (local parameters); Riks (1979), Int. J. Solids Structures 15, 529;
//! Wagner and Wriggers (1988), Eng. Comput. 5, 103 (critical points by the number of negative pivots).

mod corrector;
mod critical;

use crate::config::NewtonConfig;
use crate::equilibrium::newton::{Failure, Info};
use crate::internal_force::assembly::Event;
use crate::linear_algebra::lanes::{inner, norm, work};
use crate::model::Model;
use crate::state::{Along, Critical, CriticalKind, State};
use corrector::Corrector;
use critical::{CriticalSearch, Jump, PathPoint};

/// Angle by which directions may turn in one step [rad].
const TURN: f64 = 0.3;
/// Angle that the length of the next step aims at.
const AIM: f64 = 0.12;
/// Iterations within which Newton must return.
const FEW: u32 = 8;
/// Iterations up to which steps may grow.
const EASY: u64 = 4;
/// Length of the first step and of the longest, relative to the extent of the structure.
const FIRST: f64 = 1e-4;
const LONGEST: f64 = 0.05;
/// Where steps so short still turn too far, the path has a corner: something goes slack or taut. Steps of these lengths, all
/// relative to the extent of the structure, leap over it, if the chord turns by no more than this [rad].
const CORNER: f64 = 1e-6;
const LEAPS: [f64; 4] = [1e-4, 3e-4, 1e-3, 3e-3];
const LEAP_TURN: f64 = 1.0;
/// Largest change of the load factor, relative, in a step at whose end something breaks.
const BREAKS_WITHIN: f64 = 1e-3;

/// Memory of a step.
pub struct Path {
    /// Way of the degree of freedom that moves most, per unit of time [m/s].
    speed: f64,
    /// Whether it turns where it branches.
    turns: bool,
    extent: f64,
    /// Forces, internal and all, at the end of the last step.
    pub(crate) corrector: Corrector,
    /// Displacement and direction at the start of the step, and the direction at its end.
    before: Vec<f64>,
    set_out: Vec<f64>,
    direction: Vec<f64>,
    /// Memory of what would break; empty where nothing can.
    history: Vec<f64>,
}

/// A step that was taken: what its end is like, and what it took.
#[derive(Debug, Clone, Copy)]
pub struct Taken {
    /// How far along the path, as time [s].
    pub length: f64,
    /// Largest tension, squared [N2].
    pub tension: f64,
    /// Iterations and factorisations, those of steps that were taken anew included.
    pub info: Info,
    /// Steps that were shortened and taken anew.
    pub refused: u64,
}

/// The end of a step that was tried.
struct Tried {
    probe: PathPoint,
    tension: f64,
    turn: f64,
    iterations: u64,
}

impl Path {
    /// For `model`, at `speed` [m/s]; `turns` where it branches, or goes straight on.
    pub fn new(model: &Model, settings: NewtonConfig, speed: f64, turns: bool) -> Self {
        let n = model.dof_count();
        let [before, set_out, direction] = [(); 3].map(|()| vec![0.0; n]);
        let can_break = model.elements.iter().any(|e| e.constants().can_break);
        Self {
            speed,
            turns,
            extent: model.extent(),
            corrector: Corrector::new(model, settings),
            before,
            set_out,
            direction,
            history: if can_break { model.start_history() } else { Vec::new() },
        }
    }

    /// At the start of a path: its direction there, in which the loads grow, and its stability.
    pub fn begin(&mut self, model: &Model, state: &mut State) -> Result<(), Failure> {
        let rate = self.corrector.direction(model, state, &mut self.direction)?;
        let sign = if rate < 0.0 { -1.0 } else { 1.0 };
        self.direction.iter_mut().for_each(|d| *d *= sign);
        state.along = Along {
            stride: FIRST * self.extent,
            rate: sign * rate,
            steepest: rate.abs() / norm(&self.direction[..3 * model.node_count()]),
            negative: self.corrector.negative,
            ..state.along
        };
        self.face(state);
        Ok(())
    }

    /// The direction as velocity of the state.
    fn face(&self, state: &mut State) {
        state.velocity.iter_mut().zip(&self.direction).for_each(|(v, d)| *v = self.speed * d);
    }

    /// One step along the path, of at most `h` [s] from `time`.
    pub fn step(&mut self, model: &Model, state: &mut State, time: f64, h: f64) -> Result<Taken, Failure> {
        self.corrector.info = Info::default();
        if state.along.stride == 0.0 {
            self.begin(model, state)?;
        }
        // How the tangent is factorised first follows from the state, not from what was tried last: a run that goes on has no last.
        self.corrector.negative = state.along.negative;
        self.before.copy_from_slice(&state.displacement);
        self.set_out.iter_mut().zip(&state.velocity).for_each(|(d, v)| *d = v / self.speed);
        state.factor_before = state.factor;
        let (remaining, mut refused) = (self.speed * h, 0);
        loop {
            let stride = state.along.stride;
            let way = match remaining / stride {
                steps if steps <= 1.0 => remaining,
                // Two halves rather than a whole step and a very short one.
                steps if steps < 2.0 => 0.5 * remaining,
                _ => stride,
            };
            let leaps = stride < CORNER * self.extent;
            let outcome = if leaps {
                self.leap(model, state, time, remaining)
            } else {
                self.attempt(model, state, time, way)
            };
            match outcome.and_then(|tried| {
                let late = !leaps && self.breaks_late(model, state, tried.probe.way);
                if late { Err(Failure::Turns { angle: tried.turn }) } else { Ok(tried) }
            }) {
                Ok(tried) => {
                    let way = tried.probe.way;
                    self.accept(model, state, time + way / self.speed, way, &tried);
                    let length = if way >= remaining { h } else { way / self.speed };
                    return Ok(Taken { length, tension: tried.tension, info: self.corrector.info, refused });
                }
                Err(failure) => {
                    self.go_back(state);
                    refused += 1;
                    if leaps {
                        return Err(failure);
                    }
                    state.along.stride = 0.35 * way;
                }
            }
        }
    }

    /// Whether something breaks in the step, which is so long that the load at which it does stays unknown.
    fn breaks_late(&mut self, model: &Model, state: &State, way: f64) -> bool {
        let change = (state.factor - state.factor_before).abs();
        if self.history.is_empty()
            || change <= BREAKS_WITHIN * state.factor.abs()
            || way <= 3.0 * CORNER * self.extent
        {
            return false;
        }
        self.history.copy_from_slice(&state.history);
        self.corrector.internal.elements.advance(&model.elements, &state.displacement, &mut self.history);
        !self.corrector.internal.elements.broken.is_empty()
    }

    fn go_back(&self, state: &mut State) {
        state.critical.truncate(state.along.critical);
        state.along.turned = false;
        state.displacement.copy_from_slice(&self.before);
        state.factor = state.factor_before;
    }

    /// Leap over a corner of the path, by `remaining` [m] at most.
    fn leap(
        &mut self,
        model: &Model,
        state: &mut State,
        time: f64,
        remaining: f64,
    ) -> Result<Tried, Failure> {
        let n = 3 * model.node_count();
        let mut last = Failure::Turns { angle: LEAP_TURN };
        for share in LEAPS {
            let way = (share * self.extent).min(remaining);
            self.go_back(state);
            let mut tried = match self.go(model, state, way, u32::MAX) {
                Ok(tried) => tried,
                Err(failure) => {
                    last = failure;
                    continue;
                }
            };
            let chord = self.chord(&state.displacement, &self.set_out, n);
            if chord > LEAP_TURN {
                last = Failure::Turns { angle: chord };
                continue;
            }
            if self.chord(&state.displacement, &self.direction, n) > TURN {
                // Where cables are slack the tangent may not be that of the path: the chord says where it goes.
                tried.probe.rate = self.along_chord(state, n);
            }
            if (tried.probe.rate < 0.0) != (state.along.rate < 0.0) {
                let ends = [state.factor_before, state.factor];
                let most = if state.along.rate > 0.0 { f64::max } else { f64::min };
                let factor = most(ends[0], ends[1]);
                let (time, negative) = (time + way / self.speed, tried.probe.negative);
                state.critical.push(Critical { time, factor, negative, kind: CriticalKind::Limit });
            }
            tried.turn = AIM;
            state.along.stride = FIRST * self.extent;
            return Ok(tried);
        }
        Err(last)
    }

    /// Try a step of `way`. What is found critical in it is appended to the state.
    fn attempt(&mut self, model: &Model, state: &mut State, time: f64, way: f64) -> Result<Tried, Failure> {
        let tried = self.go(model, state, way, FEW)?;
        if tried.turn > TURN && !state.along.anew {
            return Err(Failure::Turns { angle: tried.turn });
        }
        let low = PathPoint {
            way: 0.0,
            factor: state.factor_before,
            rate: state.along.rate,
            negative: state.along.negative,
            log_determinant: tried.probe.log_determinant,
        };
        if low.differs(&tried.probe) && !state.along.anew {
            let known = state.critical.len();
            self.look_for_critical(model, state, (time, way), (low, tried.probe))?;
            let branch = |p: &Critical| p.kind == CriticalKind::Branch && p.negative > low.negative;
            if self.turns
                && let Some(at) = state.critical[known..].iter().position(branch)
            {
                state.critical.truncate(known + at + 1);
                return self.turn(model, state, time);
            }
        }
        Ok(tried)
    }

    /// Go to the branch point found last, and set out along the path that crosses there.
    fn turn(&mut self, model: &Model, state: &mut State, time: f64) -> Result<Tried, Failure> {
        let point = state.critical[state.critical.len() - 1];
        let mut tried = self.go(model, state, (point.time - time) * self.speed, FEW)?;
        self.corrector.softest(model, &mut self.direction);
        // The load of a path that crosses stands still, or nearly so; how stable that path is, its first step finds.
        (tried.probe.rate, tried.probe.negative, tried.turn) = (0.0, state.along.negative, 0.0);
        state.along.stride = FIRST * self.extent;
        state.along.turned = true;
        Ok(tried)
    }

    /// To the place `way` from the start of the step.
    fn go(&mut self, model: &Model, state: &mut State, way: f64, most: u32) -> Result<Tried, Failure> {
        let n = 3 * model.node_count();
        let dofs = &self.corrector.tangent.dofs;
        let size = |i: &usize| if dofs[*i] < n { self.set_out[dofs[*i]].abs() } else { 0.0 };
        let control = (0..dofs.len()).max_by(|a, b| size(a).total_cmp(&size(b)));
        let control = control.ok_or(Failure::Unstable { dof: 0 })?;
        for ((u, u0), d) in state.displacement.iter_mut().zip(&self.before).zip(&self.set_out) {
            *u = u0 + way * d;
        }
        state.factor = state.factor_before + way * state.along.rate;
        let (most, last) = (most.min(self.corrector.most_iterations()), self.corrector.info.iterations);
        let tension = self.corrector.correct(model, state, (&self.before, control), most)?;
        let mut rate = self.corrector.direction(model, state, &mut self.direction)?;
        let (old, new) = (&self.set_out[..n], &self.direction[..n]);
        let sizes = [norm(old), norm(new)];
        let Along { rate: rate_before, steepest, .. } = state.along;
        // Of a direction: its load, in units of the steepest that there was.
        let load = |rate: f64, size: f64| if steepest > 0.0 { rate / (size * steepest) } else { 0.0 };
        let (before, mut after) = (load(rate_before, sizes[0]), load(rate, sizes[1]));
        if inner(old, new) / (sizes[0] * sizes[1]) + before * after < 0.0 {
            (rate, after) = (-rate, -after);
            self.direction.iter_mut().for_each(|d| *d = -*d);
        }
        let of_shapes = inner(old, &self.direction[..n]) / (sizes[0] * sizes[1]);
        let lengths = [before, after].map(|load| (1.0 + load * load).sqrt());
        let of_all = (of_shapes + before * after) / lengths[0] / lengths[1];
        let chord = self.chord(&state.displacement, &self.direction, n);
        let turn = angle(of_all).max(angle(of_shapes)).max(chord);
        let probe = PathPoint {
            way,
            factor: state.factor,
            rate,
            negative: self.corrector.negative,
            log_determinant: self.corrector.tangent.matrix.cholesky.log_determinant(),
        };
        Ok(Tried { probe, tension, turn, iterations: self.corrector.info.iterations - last })
    }

    /// Angle of the chord of the step with a direction, of their first `n` degrees of freedom: displacements.
    fn chord(&self, u: &[f64], direction: &[f64], n: usize) -> f64 {
        let moves = || u[..n].iter().zip(&self.before).map(|(a, b)| a - b);
        let product: f64 = moves().zip(direction).map(|(m, d)| m * d).sum();
        let size = moves().map(|m| m * m).sum::<f64>().sqrt() * norm(&direction[..n]);
        if size > 0.0 { angle(product / size) } else { 0.0 }
    }

    /// Take the chord of the step for the direction of the path; returns the change of the load factor along it.
    fn along_chord(&mut self, state: &State, n: usize) -> f64 {
        for ((d, u1), u0) in self.direction.iter_mut().zip(&state.displacement).zip(&self.before) {
            *d = u1 - u0;
        }
        let most = self.direction[..n].iter().fold(0.0, |a, d| f64::max(a, d.abs()));
        self.direction.iter_mut().for_each(|d| *d /= most);
        (state.factor - state.factor_before) / most
    }

    /// Find the limit points and branch points of the step, and come back to its end.
    fn look_for_critical(
        &mut self,
        model: &Model,
        state: &mut State,
        (time, way): (f64, f64),
        (mut low, high): (PathPoint, PathPoint),
    ) -> Result<(), Failure> {
        let (end, end_direction) = (state.displacement.clone(), self.direction.clone());
        let (known, speed) = (state.critical.len(), self.speed);
        let mut found = std::mem::take(&mut state.critical);
        let mut probe = |way: f64| self.go(model, state, way, FEW).ok().map(|tried| tried.probe);
        // The start again, for the sake of its determinant.
        low.log_determinant = probe(0.0).map_or(high.log_determinant, |p| p.log_determinant);
        let mut search = CriticalSearch { probe: &mut probe, length: way, time, speed, found: &mut found };
        let outcome = search.between(low, high);
        state.critical = found;
        if let Err(Jump(at)) = outcome
            && at < way
        {
            state.critical.truncate(known);
            return Err(Failure::Turns { angle: std::f64::consts::PI });
        }
        (state.displacement, self.direction) = (end, end_direction);
        state.factor = high.factor;
        self.corrector.evaluate(model, state);
        self.corrector.negative = high.negative;
        Ok(())
    }

    /// Work of the loads that grow over the step: that of their mean, as straight as the step is.
    fn work(&mut self, model: &Model, state: &State) -> f64 {
        let u = &state.displacement;
        if model.live_pressures.is_empty() {
            let mean = 0.5 * (state.factor_before + state.factor);
            return mean * work(&model.live_load, u, &self.before);
        }
        let mut mean = 0.0;
        for (at, factor) in [(&self.before, state.factor_before), (u, state.factor)] {
            self.corrector.press(model, at, factor);
            mean += 0.5 * factor * work(&self.corrector.live, u, &self.before);
        }
        mean
    }

    /// The step counts: what follows from it.
    fn accept(&mut self, model: &Model, state: &mut State, time: f64, way: f64, tried: &Tried) {
        let along = &mut state.along;
        let known = along.critical;
        for point in &state.critical[known..] {
            along.lowest = along.lowest.min(point.factor);
            along.highest = along.highest.max(point.factor);
            let what = match point.kind {
                CriticalKind::Limit => "limit point: the load turns back",
                CriticalKind::Branch => "branch point: another path crosses",
            };
            tracing::info!(
                "t = {:.6e} s: {what} at the load factor {:.6e}; directions unstable from there on: {}",
                point.time,
                point.factor,
                point.negative
            );
        }
        if tried.probe.negative > 0 && along.unstable_from.is_none() {
            along.unstable_from = Some((time, tried.probe.factor));
            let at = self.corrector.unstable().map_or(String::new(), |dof| model.dof_name(dof));
            tracing::warn!("t = {time:.6e} s: the path goes on unstable, first at {at} (reported once)");
        }
        along.critical = state.critical.len();
        let size = norm(&self.direction[..3 * model.node_count()]);
        along.rate = tried.probe.rate;
        along.steepest = along.steepest.max(along.rate.abs() / size);
        along.negative = tried.probe.negative;
        along.lowest = along.lowest.min(state.factor);
        along.highest = along.highest.max(state.factor);
        let growth = if tried.iterations <= EASY { 2.0 } else { 1.0 };
        let aim = way * (AIM / tried.turn.max(f64::MIN_POSITIVE));
        let stride = aim.clamp(0.5 * along.stride, growth * along.stride);
        along.stride = stride.min(LONGEST * self.extent);
        along.anew = std::mem::take(&mut along.turned);
        state.received += self.work(model, state);
        self.face(state);
        let internal = &mut self.corrector.internal;
        internal.elements.follow(&mut state.used_parts, time);
        internal.elements.advance(&model.elements, &state.displacement, &mut state.history);
        internal.elements.follow(&mut state.used_parts, time);
        if !internal.elements.broken.is_empty() {
            (state.along.anew, state.along.stride) = (true, FIRST * self.extent);
        }
        state.events.extend(internal.elements.broken.iter().map(|broken| broken.event(time, 0.0)));
        state.yields.extend(Event::all(&internal.elements.yielded, time));
    }
}

/// Whose cosine it is, as far as rounding lets it be one [rad].
fn angle(cosine: f64) -> f64 {
    cosine.clamp(-1.0, 1.0).acos()
}
