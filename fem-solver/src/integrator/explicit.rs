//! The explicit step: central differences as position Verlet.
//!
//! ```text
//! u_m = u_0 + h/2 v_0
//! v_1 = ((1 - a h/2) v_0 + h M^-1 f(u_m)) / (1 + a h/2)       a = damping alpha
//! u_1 = u_m + h/2 v_1
//! ```
//!
//! Displacement and velocity are at one instant at the ends, forces are evaluated once. With
//! `v_m = (v_0 + v_1) / 2` the step is `u_1 - u_0 = h v_m` and the gain of kinetic energy is
//! `f . h v_m - h a v_m . M v_m`: a force that is constant over steps does exactly the work
//! `f . du`, and damping dissipates `h a v_m . M v_m`, never less than 0 at any step. Stable for
//! `h < 2 / w`, whatever the damping.

use crate::element::Pace;
use crate::internal_force::InternalForce;
use crate::internal_force::assembly::Event;
use crate::linear_algebra::lanes::{LANES, add, total, wide, work};
use crate::model::Model;
use crate::model::applied::Applied;
use crate::state::State;
use std::ops::Range;

/// Memory and constants of the explicit step.
pub struct Explicit {
    /// The internal force.
    pub internal: InternalForce,
    /// 1 / mass of each degree of freedom, 0 where held [1/kg].
    inverse_mass: Vec<f64>,
    /// Mass of each degree of freedom, 0 where held [kg].
    mass: Vec<f64>,
    /// Degrees of freedom that supports let go.
    released: Vec<usize>,
    /// Dead load and what loads the structure now [N].
    load: Vec<f64>,
    /// Loads with a history over the step; and without them, what loads the structure, and where it was. Empty without.
    applied: Applied,
    steady: Vec<f64>,
    before: Vec<f64>,
    /// Displacement in the middle of the last step [m].
    pub middle: Vec<f64>,
    /// Force of load and elements on each degree of freedom there [N]; the inertia of held nodes
    /// that move is taken off, so that supports give the opposite.
    pub force: Vec<f64>,
    /// Velocity of the supports that move, at the step's start [m/s].
    support_velocity: Vec<f64>,
    /// Number of tiles to sweep over, where plain cables are all there is.
    tiles: Option<usize>,
}

impl Explicit {
    /// For `model`; every node that moves must have a mass.
    pub fn new(model: &Model) -> Self {
        let mass = model.free_masses();
        let n = model.dof_count();
        let internal = InternalForce::new(model);
        let applied = Applied::new(model);
        let own = if applied.is_empty() { 0 } else { n };
        Self {
            tiles: internal.tile_count().filter(|_| model.moving.is_empty()),
            internal,
            inverse_mass: mass.iter().map(|m| if *m > 0.0 { 1.0 / m } else { 0.0 }).collect(),
            mass,
            released: model.released(),
            load: model.dead_load.clone(),
            applied,
            steady: model.dead_load[..own].to_vec(),
            before: vec![0.0; own],
            middle: vec![0.0; n],
            force: vec![0.0; n],
            support_velocity: vec![0.0; model.moving.len()],
        }
    }

    /// From now on the constant force `outer` [N] loads the structure, beside the dead load. Since the last call it has changed at
    /// the degrees of freedom `at` alone, or anywhere.
    pub fn load(&mut self, model: &Model, outer: &[f64], at: Option<&[u32]>) {
        // With loads that have a history, every step adds them to what is steady.
        let to = if self.applied.is_empty() { &mut self.load } else { &mut self.steady };
        match at {
            None => add(to, &model.dead_load, outer),
            Some(dofs) => {
                for dof in dofs.iter().map(|dof| *dof as usize) {
                    to[dof] = model.dead_load[dof] + outer[dof];
                }
            }
        }
    }

    /// Advance `state` from `time` by `h` [s]. Returns the largest tension in the middle of the step, squared [N2].
    pub fn step(&mut self, model: &Model, state: &mut State, time: f64, h: f64) -> f64 {
        // Histories are those of the middles of steps.
        self.internal.elements.pace = Pace { rate: 1.0 / h, by_ends: true };
        if !self.applied.is_empty() {
            self.before.copy_from_slice(&state.displacement);
            self.applied.mean(model, time, time + h);
            add(&mut self.load, &self.steady, &self.applied.force);
        }
        for dof in &self.released {
            let mass = if model.holds(*dof, time, h) { 0.0 } else { model.dof_mass(*dof) };
            self.mass[*dof] = mass;
            self.inverse_mass[*dof] = if mass > 0.0 { 1.0 / mass } else { 0.0 };
        }
        let damping = 0.5 * model.damping * h;
        let kick = Kick {
            keep: (1.0 - damping) / (1.0 + damping),
            gain: h / (1.0 + damping),
            half: 0.5 * h,
            damped: model.damping > 0.0,
        };
        let (largest, squares) = match self.tiles {
            Some(tiles) => self.sweep(tiles, model, state, &kick),
            None => self.step_whole(model, state, time, h, &kick),
        };
        state.dissipated += 0.25 * model.damping * h * squares;
        self.dash(model, state, h);
        for ((dof, motion), v0) in model.moving.iter().zip(&self.support_velocity) {
            if model.holds(*dof, time, h) {
                let du = motion.at(time + h) - motion.at(time);
                state.velocity[*dof] = du / h;
                state.book_support(model, &mut self.force[*dof], *dof, du, Some((h, *v0)));
            }
        }
        model.prescribe(time + h, (time, h), &mut state.displacement);
        state.dissipated +=
            self.internal.elements.book_rupture(&model.elements, &state.displacement, &state.history);
        if !self.applied.is_empty() {
            state.load_work += work(&self.applied.force, &state.displacement, &self.before);
        }
        largest
    }

    /// The step of a structure of cables, tile by tile, each kicked as soon as nothing pulls on it any more.
    fn sweep(&mut self, tiles: usize, model: &Model, state: &mut State, kick: &Kick) -> (f64, f64) {
        let nodes = model.node_count();
        let (mut largest, mut squares, mut begun) = (0.0, 0.0, 0);
        for tile in 0..tiles {
            let (own, reach) = self.internal.cables.tile(tile);
            for c in 0..3 {
                self.begin(c * nodes + begun..c * nodes + reach, state, kick.half);
            }
            begun = reach;
            largest = f64::max(largest, self.internal.cables.pull_tile(tile, &self.middle, &mut self.force));
            for c in 0..3 {
                let dofs = c * nodes + own.start..c * nodes + own.end;
                squares += self.kick(dofs, state, kick);
            }
        }
        (largest, squares)
    }

    /// The step of any structure.
    fn step_whole(&mut self, model: &Model, state: &mut State, time: f64, h: f64, kick: &Kick) -> (f64, f64) {
        let all = 0..model.dof_count();
        self.begin(all.clone(), state, kick.half);
        model.prescribe(time + 0.5 * h, (time, h), &mut self.middle);
        let (u, history) = ((&state.displacement[..], &self.middle[..]), &mut state.history);
        self.internal.elements.follow(&mut state.used_parts, time + 0.5 * h);
        let largest = self.internal.subtract_and_advance(model, u, history, &mut self.force);
        self.internal.elements.follow(&mut state.used_parts, time);
        state.events.extend(self.internal.elements.broken.iter().map(|broken| broken.event(time, h)));
        state.yields.extend(Event::all(&self.internal.elements.yielded, time + 0.5 * h));
        if let Some(contact) = &mut self.internal.contact {
            let u = (&state.displacement[..], &self.middle[..]);
            state.dissipated += contact.push(model, u, &mut state.touches, &mut self.force);
        }
        self.applied.press_on(model, &self.middle, &mut self.force);
        for ((dof, _), velocity) in model.moving.iter().zip(&mut self.support_velocity) {
            *velocity = state.velocity[*dof];
        }
        (largest, self.kick(all, state, kick))
    }

    /// The first drift of some degrees of freedom, which the load alone pulls on then.
    fn begin(&mut self, dofs: Range<usize>, state: &State, half: f64) {
        let (u, v) = (&state.displacement[dofs.clone()], &state.velocity[dofs.clone()]);
        begin(&mut self.middle[dofs.clone()], &mut self.force[dofs.clone()], u, v, &self.load[dofs], half);
    }

    /// Kick and second drift of some degrees of freedom. Returns `sum m (v_0 + v_1)^2` where there is damping, otherwise 0.
    fn kick(&self, dofs: Range<usize>, state: &mut State, kick: &Kick) -> f64 {
        let (v, u) = (&mut state.velocity[dofs.clone()], &mut state.displacement[dofs.clone()]);
        let (middle, force) = (&self.middle[dofs.clone()], &self.force[dofs.clone()]);
        let inverse_mass = &self.inverse_mass[dofs.clone()];
        if kick.damped {
            return kick_and_drift_damped(kick, v, u, middle, force, inverse_mass, &self.mass[dofs]);
        }
        kick_and_drift(kick, v, u, middle, force, inverse_mass);
        0.0
    }

    /// Apply grounded dashpots: `m (v_1 - v_0)/h + (c + a m)(v_0 + v_1)/2 = f` solved again where there is
    /// one, as the damping of all is.
    fn dash(&mut self, model: &Model, state: &mut State, h: f64) {
        for (dof, viscosity) in &model.dashpots {
            if self.inverse_mass[*dof] == 0.0 {
                continue;
            }
            let (mass, after) = (self.mass[*dof], state.velocity[*dof]);
            let own = 0.5 * model.damping * h;
            // The kick gave v_1 = ((1 - a h/2) v_0 + h f/m) / (1 + a h/2).
            let before = ((1.0 + own) * after - h * self.force[*dof] / mass) / (1.0 - own);
            let both = own + 0.5 * viscosity * h / mass;
            let damped = ((1.0 - both) * before + h * self.force[*dof] / mass) / (1.0 + both);
            state.velocity[*dof] = damped;
            state.displacement[*dof] = self.middle[*dof] + 0.5 * h * damped;
            let twice = |after: f64| (before + after) * (before + after);
            let was = 0.25 * model.damping * h * mass * twice(after);
            let is = 0.25 * (model.damping * mass + viscosity) * h * twice(damped);
            state.dissipated += is - was;
        }
    }
}

/// Factors of the kick and of the second drift.
struct Kick {
    keep: f64,
    gain: f64,
    half: f64,
    damped: bool,
}

wide! {
    /// `middle = u + half v`, `force = load`.
    fn begin(middle: &mut [f64], force: &mut [f64], u: &[f64], v: &[f64], load: &[f64], half: f64) {
        let n = middle.len();
        let (force, u, v, load) = (&mut force[..n], &u[..n], &v[..n], &load[..n]);
        for i in 0..n {
            middle[i] = u[i] + half * v[i];
            force[i] = load[i];
        }
    }

    /// New velocity and displacement of some degrees of freedom without damping.
    fn kick_and_drift(
        kick: &Kick,
        velocity: &mut [f64],
        displacement: &mut [f64],
        middle: &[f64],
        force: &[f64],
        inverse_mass: &[f64],
    ) {
        let n = velocity.len();
        let (u, x, f, i) = (&mut displacement[..n], &middle[..n], &force[..n], &inverse_mass[..n]);
        let (gain, half) = (kick.gain, kick.half);
        for k in 0..n {
            let after = velocity[k] + gain * (i[k] * f[k]);
            velocity[k] = after;
            u[k] = x[k] + half * after;
        }
    }

    /// The same with damping; returns `sum m (v_0 + v_1)^2`.
    fn kick_and_drift_damped(
        kick: &Kick,
        velocity: &mut [f64],
        displacement: &mut [f64],
        middle: &[f64],
        force: &[f64],
        inverse_mass: &[f64],
        mass: &[f64],
    ) -> f64 {
        let mut lanes = [0.0; LANES];
        let ((v, v_rest), (u, u_rest)) = (velocity.as_chunks_mut::<LANES>(), displacement.as_chunks_mut::<LANES>());
        let ((x, x_rest), (f, f_rest)) = (middle.as_chunks::<LANES>(), force.as_chunks::<LANES>());
        let ((i, i_rest), (m, m_rest)) = (inverse_mass.as_chunks::<LANES>(), mass.as_chunks::<LANES>());
        for (((((v, u), x), f), i), m) in v.iter_mut().zip(u).zip(x).zip(f).zip(i).zip(m) {
            // All is read before anything is written: the compiler cannot know that nothing overlaps.
            let (mut after, mut drifted) = ([0.0; LANES], [0.0; LANES]);
            for l in 0..LANES {
                after[l] = kick.velocity(v[l], f[l], i[l]);
                drifted[l] = x[l] + kick.half * after[l];
                lanes[l] += square(m[l], v[l], after[l]);
            }
            (*v, *u) = (after, drifted);
        }
        let rest = v_rest.iter_mut().zip(u_rest).zip(x_rest).zip(f_rest).zip(i_rest).zip(m_rest);
        total(lanes, rest.map(|(((((v, u), x), f), i), m)| {
            let before = std::mem::replace(v, kick.velocity(*v, *f, *i));
            *u = x + kick.half * *v;
            square(*m, before, *v)
        }))
    }
}

impl Kick {
    #[inline(always)]
    fn velocity(&self, before: f64, force: f64, inverse_mass: f64) -> f64 {
        self.keep * before + self.gain * (inverse_mass * force)
    }
}

/// `m (v_0 + v_1)^2`.
#[inline(always)]
fn square(mass: f64, before: f64, after: f64) -> f64 {
    let twice = before + after;
    mass * (twice * twice)
}
