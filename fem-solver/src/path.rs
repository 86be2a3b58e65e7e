//! Statics along the path of equilibrium: loads grow and fall by one factor, through limit points and back (arc length).
//!
//! ```text
//! r(u, f) = p + f q - f_int(u) = 0           p = dead load, q = the loads that grow, f = their factor
//! K du - q df = r,   du_e = 0                e = the degree of freedom that moves most along the path
//! ```
//!
//! A step goes along the tangent of the path until the degree of freedom that moves most along it has gone a
//! given way, and holds that one while Newton returns to the path: local parameters in place of a sphere, so that the
//! system stays regular at limit points of load and of displacement alike. Where one direction is unstable `K` has no
//! Cholesky factor; `B = K + c h h'` has, with `h` the degree of freedom of the pivot that was not positive, which moves in
//! that direction. With `s = c du_h` the system becomes `B du = r + q df + h s`: three solutions with `B`, and two equations
//! for `s` and `df`. The answer does not depend on `c`.
//!
//! Source: Rheinboldt (1981), Numer. Math. 37, 1 (local parameters); Riks (1979), Int. J. Solids Structures 15, 529.

use crate::assembly::{Assembly, Event};
use crate::config::NewtonConfig;
use crate::kernel::Kernel;
use crate::lanes::{dot, work};
use crate::model::Model;
use crate::newton::{Failure, Info, spring_dofs};
use crate::state::State;
use crate::tangent::{Slack, Tangent};

/// Part of its axial stiffness that a slack cable shows in the tangent.
const SLACK_SHARE: f64 = 1e-6;
/// Largest `c`, relative to the largest diagonal entry: beyond, more than one direction is unstable.
const MOST_STIFFENING: f64 = 1e5;

/// Memory of a step.
pub struct Path {
    settings: NewtonConfig,
    /// Way of the degree of freedom that moves most, per unit of time [m/s].
    speed: f64,
    /// Of the structure as modelled [N/m].
    stiffness: f64,
    tangent: Tangent,
    kernel: Kernel,
    assembly: Assembly,
    springs: Vec<(usize, f64)>,
    /// Displacement at the end of the last step [m].
    pub middle: Vec<f64>,
    /// Force of load and elements on every degree of freedom there [N].
    pub force: Vec<f64>,
    before: Vec<f64>,
    /// `B^-1 q`, `B^-1 r` and `B^-1 h`, of the free degrees of freedom.
    of_load: Vec<f64>,
    of_rest: Vec<f64>,
    of_hold: Vec<f64>,
    /// Which of the free ones `h` is, and `c` [N/m]; none where `K` is positive.
    hold: Option<(usize, f64)>,
}

impl Path {
    /// For `model`, at `speed` [m/s].
    pub fn new(model: &Model, settings: NewtonConfig, speed: f64) -> Self {
        let mut tangent = Tangent::new(model);
        let (n, free) = (model.dof_count(), tangent.len());
        let sums = tangent.row_sums(model, &vec![0.0; n], &model.start_history());
        Self {
            stiffness: sums.into_iter().fold(0.0, f64::max),
            settings,
            speed,
            kernel: Kernel::new(&model.cables, model.node_count()),
            assembly: Assembly::new(model),
            springs: spring_dofs(model),
            middle: vec![0.0; n],
            force: vec![0.0; n],
            before: vec![0.0; n],
            of_load: vec![0.0; free],
            of_rest: vec![0.0; free],
            of_hold: vec![0.0; free],
            hold: None,
            tangent,
        }
    }

    /// The cables and the other elements.
    pub fn parts(&mut self) -> (&mut Kernel, &mut Assembly) {
        (&mut self.kernel, &mut self.assembly)
    }

    /// Go on along the path for `h` [s] from `time`. Returns the largest tension, squared [N2], and what it took.
    pub fn step(
        &mut self,
        model: &Model,
        state: &mut State,
        time: f64,
        h: f64,
    ) -> Result<(f64, Info), Failure> {
        let mut info = Info::default();
        self.before.copy_from_slice(&state.displacement);
        let control = self.set_out(model, state, self.speed * h, &mut info)?;
        let start = state.factor_before;
        let tension = self.return_to_path(model, state, control, &mut info)?;
        // The work of the loads: their mean over the step, as straight as the step is.
        let mean = 0.5 * (start + state.factor);
        state.received += mean * work(&model.live_load, &state.displacement, &self.before);
        for ((v, u1), u0) in state.velocity.iter_mut().zip(&state.displacement).zip(&self.before) {
            *v = (u1 - u0) / h;
        }
        self.middle.copy_from_slice(&state.displacement);
        if !self.assembly.is_empty() {
            self.assembly.settle(&model.elements, &state.displacement, &mut state.history);
            let broken = self.assembly.broken().iter();
            state.events.extend(broken.map(|(element, tension)| Event {
                time: time + h,
                element: *element,
                tension: *tension,
            }));
        }
        Ok((tension, info))
    }

    /// Along the tangent of the path, `way` [m] of the one that moves most; returns which of the free ones that is.
    fn set_out(
        &mut self,
        model: &Model,
        state: &mut State,
        way: f64,
        info: &mut Info,
    ) -> Result<usize, Failure> {
        self.factorise(model, state, info)?;
        // Of `s (1 - c h' B^-1 h) = c df h' B^-1 q`, any multiple.
        let (factor, held) = match self.hold {
            None => (1.0, 0.0),
            Some((h, c)) => (1.0 - c * self.of_hold[h], c * self.of_load[h]),
        };
        let dofs = self.tangent.dofs();
        let along = |i: usize| factor * self.of_load[i] + held * self.of_hold[i];
        let onward: f64 = dofs.iter().enumerate().map(|(i, dof)| state.velocity[*dof] * along(i)).sum();
        let sign = if onward < 0.0 { -1.0 } else { 1.0 };
        let n = 3 * model.node_count();
        let size = |i: &usize| if dofs[*i] < n { along(*i).abs() } else { 0.0 };
        let most = (0..dofs.len()).max_by(|a, b| size(a).total_cmp(&size(b)));
        let Some(control) = most.filter(|i| size(i) > 0.0 && size(i).is_finite()) else {
            // Nothing moves under these loads.
            return Err(Failure::Unstable { dof: dofs.first().copied().unwrap_or(0) });
        };
        let share = sign * way / size(&control);
        for (i, dof) in dofs.iter().enumerate() {
            state.displacement[*dof] += share * along(i);
        }
        state.factor_before = state.factor;
        state.factor += share * factor;
        Ok(control)
    }

    /// Newton, with the free degree of freedom `control` held. Returns the largest tension, squared.
    fn return_to_path(
        &mut self,
        model: &Model,
        state: &mut State,
        control: usize,
        info: &mut Info,
    ) -> Result<f64, Failure> {
        let mut moved = f64::INFINITY;
        loop {
            let tension = self.evaluate(model, state);
            let free = self.tangent.dofs().iter();
            let residual = free.map(|dof| self.force[*dof].powi(2)).sum::<f64>().sqrt();
            let scale = dot(&self.force, &self.force).sqrt().max(state.factor.abs() * norm(&model.live_load));
            let limit = self.settings.tolerance * scale.max(tension.sqrt());
            let way = self.middle_way(state);
            if residual <= limit && moved <= 1e-6 * way {
                return Ok(tension);
            }
            if info.iterations >= u64::from(self.settings.max_iterations) || !residual.is_finite() {
                let size = |dof: &&usize| self.force[**dof].abs();
                let worst = self.tangent.dofs().iter().max_by(|a, b| size(a).total_cmp(&size(b)));
                return Err(Failure::NotConverged {
                    iterations: info.iterations as u32,
                    residual,
                    limit,
                    worst: worst.copied().unwrap_or(0),
                    moving: (residual <= limit).then_some(moved),
                    unstable: info.unstable,
                });
            }
            self.factorise(model, state, info)?;
            let (factor, held) = self.close(control);
            moved = 0.0;
            for (i, dof) in self.tangent.dofs().iter().enumerate() {
                let step = self.of_rest[i] + factor * self.of_load[i] + held * self.of_hold[i];
                state.displacement[*dof] += step;
                moved = f64::max(moved, step.abs());
            }
            state.factor += factor;
            info.iterations += 1;
        }
    }

    /// Largest way from the step's start [m].
    fn middle_way(&self, state: &State) -> f64 {
        state.displacement.iter().zip(&self.before).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    }

    /// Force of loads and elements at the state, into `force`; returns the largest tension, squared.
    fn evaluate(&mut self, model: &Model, state: &State) -> f64 {
        let u = &state.displacement;
        let loads = model.dead_load.iter().zip(&model.live_load);
        self.force.iter_mut().zip(loads).for_each(|(f, (dead, live))| *f = dead + state.factor * live);
        let mut tension = self.kernel.pull(u, &mut self.force);
        if !self.assembly.is_empty() {
            tension = tension.max(self.assembly.pull(&model.elements, u, &state.history, &mut self.force));
        }
        for (dof, k) in &self.springs {
            self.force[*dof] -= k * u[*dof];
        }
        tension
    }

    /// Factorise `B` at the state, and solve for the loads, for the residual that `force` holds, and for `h`.
    fn factorise(&mut self, model: &Model, state: &State, info: &mut Info) -> Result<(), Failure> {
        let slack = Slack::Regularised(SLACK_SHARE);
        self.tangent.assemble(model, &state.displacement, &state.history, 1.0, slack);
        info.factorisations += 1;
        self.hold = None;
        if let Err(dof) = self.tangent.factorise() {
            info.unstable = Some(dof);
            info.shifted_at = info.shifted_at.or(Some(dof));
            let position = self.tangent.dofs().iter().position(|d| *d == dof);
            let h = position.expect("a pivot is that of a free one");
            // Where every direction is unstable, no diagonal entry is positive.
            let largest = self.tangent.largest_diagonal();
            let (stiff, mut c) = (if largest > 0.0 { largest } else { self.stiffness }, 0.0);
            loop {
                // What is soft but for its neighbours needs more than they have.
                let more = if c > 0.0 { 99.0 * c } else { stiff };
                self.tangent.stiffen(h, more);
                c += more;
                info.factorisations += 1;
                match self.tangent.factorise() {
                    Ok(()) => break,
                    Err(other) if !(c <= MOST_STIFFENING * stiff && c > 0.0) => {
                        return Err(if other == dof {
                            Failure::Unstable { dof }
                        } else {
                            Failure::Forks { dofs: [dof, other] }
                        });
                    }
                    Err(_) => {}
                }
            }
            self.hold = Some((h, c));
        }
        for ((load, rest), dof) in self.of_load.iter_mut().zip(&mut self.of_rest).zip(self.tangent.dofs()) {
            (*load, *rest) = (model.live_load[*dof], self.force[*dof]);
        }
        self.tangent.solve(&mut self.of_load);
        self.tangent.solve(&mut self.of_rest);
        if let Some((h, _)) = self.hold {
            self.of_hold.fill(0.0);
            self.of_hold[h] = 1.0;
            self.tangent.solve(&mut self.of_hold);
        }
        Ok(())
    }

    /// Change of the load factor, and `s`, with which the residual vanishes and `control` stays.
    fn close(&self, control: usize) -> (f64, f64) {
        let (rest, load) = (self.of_rest[control], self.of_load[control]);
        let Some((h, c)) = self.hold else { return (-rest / load, 0.0) };
        // (1 - c h'B^-1 h) s - c h'B^-1 q df = c h'B^-1 r,   e'B^-1 h s + e'B^-1 q df = -e'B^-1 r
        let (a, b) = (1.0 - c * self.of_hold[h], -c * self.of_load[h]);
        let (d, x, y) = (self.of_hold[control], c * self.of_rest[h], -rest);
        let determinant = a * load - b * d;
        ((a * y - d * x) / determinant, (x * load - b * y) / determinant)
    }
}

fn norm(x: &[f64]) -> f64 {
    dot(x, x).sqrt()
}
