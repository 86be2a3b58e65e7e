//! The implicit step: generalised alpha, with Newmark, Bossak and the midpoint rule as members; statics.
//!
//! ```text
//! M a_(1-am) + alpha M v_(1-af) + f_int(u_(1-af)) = f_ext(t_(1-af))     x_(1-s) = (1-s) x_1 + s x_0
//! u_1 = u_0 + h v_0 + h^2 ((1/2 - b) a_0 + b a_1),    v_1 = v_0 + h ((1 - g) a_0 + g a_1)
//! ```
//!
//! With `af = am = 1/2` this is the implicit midpoint rule: the force of the step is its mean over
//! it, and its work is exactly `f . du`. Cables pull with their mean stress of the step there, and so
//! keep the energy exactly however far they turn ([`Displacements::Step`]). With `af = 0` forces balance at the end of the step. Between
//! the two, the load is the straight line that has the given mean and the given end.
//!
//! Source: Chung and Hulbert (1993), J. Appl. Mech. 60, 371; Simo and Tarnow (1992), ZAMP 43, 757 (the mean stress).

use crate::config::NewtonConfig;
use crate::config::scheme::Scheme;
use crate::element::Pace;
use crate::equilibrium::newton::{Failure, Info, Newton, Problem};
use crate::internal_force::Displacements;
use crate::internal_force::assembly::Event;
use crate::linear_algebra::lanes::{add, add_to, sum_of, work};
use crate::model::Model;
use crate::model::applied::Applied;
use crate::state::State;

/// Interface force of one step, component-major [N].
pub struct StepLoad<'a> {
    /// At the instant at which the scheme balances.
    pub balance: &'a [f64],
    /// At the step's end; equal to the mean where only that is known.
    pub end: &'a [f64],
}

/// Memory of the implicit step.
pub struct Implicit {
    /// The scheme.
    pub scheme: Scheme,
    /// The iteration of each step.
    pub newton: Newton,
    settings: NewtonConfig,
    /// Viscosity of the dashpot at each degree of freedom [N s/m]; empty without any.
    viscosity: Vec<f64>,
    mass: Vec<f64>,
    /// Displacement in the middle of the last step [m].
    pub middle: Vec<f64>,
    /// Mean force of load and elements over the last step [N]; see [`crate::integrator::explicit::Explicit::force`].
    pub force: Vec<f64>,
    load: Vec<f64>,
    /// Degrees of freedom that supports let go, and those of them that are held now.
    released: Vec<usize>,
    fixed: Vec<usize>,
    /// Loads with a history where the step balances, later at its end; and those at its start.
    applied: [Applied; 2],
    before: Vec<f64>,
    squares: Vec<f64>,
    /// Velocity of the supports that move, at the step's start [m/s].
    support_velocity: Vec<f64>,
}

impl Implicit {
    /// For `model`, with a Newton iteration that may have been used before.
    pub fn new(model: &Model, scheme: Scheme, settings: NewtonConfig, newton: Newton) -> Self {
        let n = model.dof_count();
        Self {
            scheme,
            newton,
            settings,
            viscosity: model.viscosities(),
            mass: model.free_masses(),
            middle: vec![0.0; n],
            force: vec![0.0; n],
            load: vec![0.0; n],
            released: model.released(),
            fixed: model.released(),
            applied: [Applied::new(model), Applied::new(model)],
            before: vec![0.0; n],
            squares: vec![0.0; n],
            support_velocity: vec![0.0; model.moving.len()],
        }
    }

    /// Advance `state` from `time` by `h` [s]. Returns the largest tension, squared [N2], and what
    /// Newton did.
    pub fn step(
        &mut self,
        model: &Model,
        state: &mut State,
        load: &StepLoad,
        time: f64,
        h: f64,
    ) -> Result<(f64, Info), Failure> {
        let Scheme { alpha_m, alpha_f, beta, gamma, inertia } = self.scheme;
        let damping = model.damping;
        let known = if inertia { self.known_inertia(damping, h) } else { (0.0, 0.0) };
        let known_rate = self.known_rate(h);
        self.before.copy_from_slice(&state.displacement);
        self.let_go(model, state, time, h);
        for ((dof, _), velocity) in model.moving.iter().zip(&mut self.support_velocity) {
            *velocity = state.velocity[*dof];
        }
        for i in 0..self.load.len() {
            let (v0, a0) = (state.velocity[i], state.acceleration[i]);
            let mut inert = self.mass[i] * (known.0 * v0 + known.1 * a0);
            if !self.viscosity.is_empty() && inertia {
                inert += self.viscosity[i] * (known_rate.0 * v0 + known_rate.1 * a0);
            }
            self.load[i] = model.dead_load[i] + load.balance[i] - inert;
            if self.mass[i] > 0.0 && inertia {
                state.displacement[i] += h * v0 + 0.5 * h * h * a0;
            }
        }
        self.begin_applied(model, time, h);
        model.prescribe(time + h, (time, h), &mut state.displacement);
        let factor = if inertia {
            (1.0 - alpha_m) / (beta * h * h) + damping * (1.0 - alpha_f) * gamma / (beta * h)
        } else {
            0.0
        };
        let problem = Problem {
            model,
            load: &self.load,
            start: &self.before,
            inertia: factor,
            share: 1.0 - alpha_f,
            mean_stress: self.scheme.takes_mean_only(),
            history: &state.history,
            pressures: &self.applied[0].pressures,
            viscosity: (&self.viscosity, if inertia { (1.0 - alpha_f) * gamma / (beta * h) } else { 0.0 }),
        };
        self.newton.tangent.set_pace(self.pace((1.0 - alpha_f) * h));
        self.newton.internal.elements.pace = self.pace((1.0 - alpha_f) * h);
        let silent = &mut |_, _| Ok(());
        let info = self.newton.solve(&problem, &self.settings, &mut state.displacement, silent)?;
        self.advance_rates(damping, state, h);
        let to_balance = if self.scheme.takes_mean_only() { 0.5 * h } else { h };
        self.newton.internal.elements.pace = self.pace(to_balance);
        let largest = self.balance(model, state, load);
        self.newton.internal.elements.pace = self.pace(h);
        self.end_applied(model, state, time + h);
        let internal = &mut self.newton.internal;
        internal.elements.follow(&mut state.used_parts, time + h);
        internal.elements.advance(&model.elements, &state.displacement, &mut state.history);
        internal.elements.follow(&mut state.used_parts, time);
        state.events.extend(internal.elements.broken.iter().map(|broken| broken.event(time, h)));
        state.yields.extend(Event::all(&internal.elements.yielded, time + h));
        if !internal.elements.broken.is_empty() && !self.scheme.takes_mean_only() {
            self.begin_torn(model, state, load);
        }
        self.book_supports(model, state, time, h);
        Ok((largest, info))
    }

    /// Displacements are those a time of `after` [s] behind the start of the step.
    fn pace(&self, after: f64) -> Pace {
        let by_ends = self.scheme.inertia && !self.scheme.takes_mean_only();
        Pace { rate: if self.scheme.inertia { 1.0 / after } else { 0.0 }, by_ends }
    }

    /// Largest share of its strength that anything used as it broke in the last step; 0 where nothing did.
    pub fn broke_under(&mut self) -> f64 {
        self.newton.internal.elements.broken.iter().map(|broken| broken.share).fold(0.0, f64::max)
    }

    /// Fix what supports hold in this step, of what they let go; the rest has its mass, and a balance of its own to start from.
    fn let_go(&mut self, model: &Model, state: &mut State, time: f64, h: f64) {
        if self.released.is_empty() {
            return;
        }
        self.fixed.clear();
        for dof in &self.released {
            let held = model.holds(*dof, time, h);
            let mass = if held { 0.0 } else { model.dof_mass(*dof) };
            self.mass[*dof] = mass;
            if held {
                self.fixed.push(*dof);
            } else if self.scheme.inertia && state.acceleration[*dof] == 0.0 && !state.force.is_empty() {
                let viscosity = self.viscosity.get(*dof).copied().unwrap_or(0.0);
                let damped = (model.damping + viscosity / mass) * state.velocity[*dof];
                state.acceleration[*dof] = state.force[*dof] / mass - damped;
            }
        }
        self.newton.fix(&self.fixed);
    }

    /// Loads with a history where the step balances: their mean over it, or what they are there.
    fn begin_applied(&mut self, model: &Model, time: f64, h: f64) {
        let [balance, start] = &mut self.applied;
        if balance.is_empty() {
            return;
        }
        if self.scheme.takes_mean_only() {
            balance.mean(model, time, time + h);
        } else {
            start.at(model, time);
            start.press(model, &self.before);
            balance.at(model, time + (1.0 - self.scheme.alpha_f) * h);
        }
        add_to(&mut self.load, &balance.force);
    }

    /// Their work over the step, and their share of its force.
    fn end_applied(&mut self, model: &Model, state: &mut State, end: f64) {
        let [now, start] = &mut self.applied;
        if now.is_empty() {
            return;
        }
        let (after, before) = (&state.displacement, &self.before);
        if self.scheme.takes_mean_only() {
            now.press(model, &self.middle);
            add_to(&mut self.force, &now.force);
            state.load_work += work(&now.force, after, before);
            return;
        }
        // Their work is that of the mean of both ends, as the trapezoidal rule does it.
        now.at(model, end);
        now.press(model, after);
        state.load_work += 0.5 * (work(&now.force, after, before) + work(&start.force, after, before));
        // The force at the start has its share of the mean already: it is that of the last step's end.
        self.force.iter_mut().zip(&now.force).for_each(|(mean, f)| *mean += 0.5 * f);
        add_to(&mut state.force, &now.force);
    }

    /// Known part of `v_(1-af)` before the step is solved, per unit of velocity and acceleration at its start.
    fn known_rate(&self, h: f64) -> (f64, f64) {
        let Scheme { alpha_f, beta, gamma, .. } = self.scheme;
        ((1.0 - alpha_f) * (1.0 - gamma / beta) + alpha_f, (1.0 - alpha_f) * h * (1.0 - 0.5 * gamma / beta))
    }

    /// Known part of `M a_(1-am) + alpha M v_(1-af)` before the step is solved, per unit of
    /// velocity and acceleration at its start.
    fn known_inertia(&self, damping: f64, h: f64) -> (f64, f64) {
        let Scheme { alpha_m, alpha_f, beta, gamma, .. } = self.scheme;
        // a_1 = du/(b h^2) - v_0/(b h) - (1/(2b) - 1) a_0;  v_1 = g du/(b h) + (1 - g/b) v_0 + h (1 - g/(2b)) a_0
        let velocity_jump = h * (1.0 - 0.5 * gamma / beta);
        let velocity = -(1.0 - alpha_m) / (beta * h) + damping * self.known_rate(h).0;
        let acceleration =
            alpha_m - (1.0 - alpha_m) * (0.5 / beta - 1.0) + damping * (1.0 - alpha_f) * velocity_jump;
        (velocity, acceleration)
    }

    /// Velocity and acceleration at the end, from the displacement there; what damping took.
    fn advance_rates(&mut self, damping: f64, state: &mut State, h: f64) {
        let Scheme { beta, gamma, inertia, .. } = self.scheme;
        let midpoint = self.scheme.takes_mean_only();
        for i in 0..self.mass.len() {
            let du = state.displacement[i] - self.before[i];
            let (v0, a0) = (state.velocity[i], state.acceleration[i]);
            if self.mass[i] == 0.0 || !inertia {
                state.velocity[i] = du / h;
                continue;
            }
            let a1 = (du - h * v0) / (beta * h * h) - (0.5 / beta - 1.0) * a0;
            let v1 = v0 + h * ((1.0 - gamma) * a0 + gamma * a1);
            state.velocity[i] = v1;
            // The midpoint rule knows no accelerations at the ends; its own is the best guess for the next.
            state.acceleration[i] = if midpoint { (v1 - v0) / h } else { a1 };
            self.squares[i] = self.mass[i] * ((v0 + v1) * (v0 + v1));
            if !self.viscosity.is_empty() {
                state.dissipated += 0.25 * h * self.viscosity[i] * ((v0 + v1) * (v0 + v1));
            }
        }
        if damping > 0.0 && inertia {
            state.dissipated += 0.25 * damping * h * sum_of(&self.squares);
        }
    }

    /// Mean force of the step on every degree of freedom: in its middle, or the mean of its ends.
    fn balance(&mut self, model: &Model, state: &mut State, load: &StepLoad) -> f64 {
        for ((m, u0), u1) in self.middle.iter_mut().zip(&self.before).zip(&state.displacement) {
            *m = 0.5 * (u0 + u1);
        }
        if self.scheme.takes_mean_only() {
            add(&mut self.force, &model.dead_load, load.balance);
            let at = Displacements::Step {
                before: &self.before,
                after: &state.displacement,
                middle: &self.middle,
            };
            return self.newton.internal.subtract(model, at, &state.history, &mut self.force);
        }
        add(&mut self.force, &model.dead_load, load.end);
        let at = Displacements::At(&state.displacement);
        let largest = self.newton.internal.subtract(model, at, &state.history, &mut self.force);
        for (mean, end) in self.force.iter_mut().zip(&mut state.force) {
            let now = *mean;
            *mean = 0.5 * (*end + now);
            *end = now;
        }
        largest
    }

    /// Force with which the next step begins, where something broke at the end of this one: without it.
    fn begin_torn(&mut self, model: &Model, state: &mut State, load: &StepLoad) {
        add(&mut state.force, &model.dead_load, load.end);
        let at = Displacements::At(&state.displacement);
        self.newton.internal.subtract(model, at, &state.history, &mut state.force);
        if !self.applied[0].is_empty() {
            add_to(&mut state.force, &self.applied[0].force);
        }
    }

    /// Work of supports that move, and what their nodes' inertia adds to their force.
    fn book_supports(&mut self, model: &Model, state: &mut State, time: f64, h: f64) {
        for ((dof, _), v0) in model.moving.iter().zip(&self.support_velocity) {
            if model.holds(*dof, time, h) {
                let du = state.displacement[*dof] - self.before[*dof];
                let inertia = self.scheme.inertia.then_some((h, *v0));
                state.book_support(model, &mut self.force[*dof], *dof, du, inertia);
            }
        }
    }
}
