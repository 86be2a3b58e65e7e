//! Back to the path of equilibrium at a given place along it, and the path's direction there.
//!
//! Newton holds one degree of freedom, `control`, so that the system stays regular at limit points of load and of displacement
//! alike: `K du - q df = r`, `du_control = 0`, by two solutions with `K`. Where `K` is not positive it is factorised with
//! pivots of either sign ([`crate::linear_algebra::signed`]), and the answer refined: small pivots may have been replaced.

use crate::config::NewtonConfig;
use crate::element::Slack;
use crate::equilibrium::newton::{COARSEST, Failure, Info, LEAST_TRAVEL, SLACK_SHARE};
use crate::internal_force::tangent::Tangent;
use crate::internal_force::{Displacements, InternalForce};
use crate::linear_algebra::lanes::dot;
use crate::model::Model;
use crate::model::pressure::press;
use crate::state::State;

/// Most rounds of refinement of one solution.
const ROUNDS: usize = 3;
/// A direction is exact enough where its residual is this part of what it is a difference of.
const REFINED: f64 = 1e-12;

/// Rounds of inverse iteration.
const SOFTEST: usize = 4;

/// Newton with one degree of freedom held, and its memory.
pub struct Corrector {
    settings: NewtonConfig,
    pub tangent: Tangent,
    pub internal: InternalForce,
    /// Force of load and elements on every degree of freedom [N].
    pub force: Vec<f64>,
    /// Negative pivots of the tangent that was factorised last.
    pub negative: usize,
    /// `q` at the displacements evaluated last, and the pressures of it times the load factor [Pa].
    pub live: Vec<f64>,
    pressures: Vec<f64>,
    /// `q` of the free ones, `K^-1 q`, and `K^-1 r`.
    load: Vec<f64>,
    of_load: Vec<f64>,
    of_rest: Vec<f64>,
    rest: Vec<f64>,
    product: Vec<f64>,
    /// Largest size of terms that elements other than cables take differences of [N].
    coarseness: f64,
    load_size: f64,
    /// Iterations and factorisations of the step at hand.
    pub info: Info,
}

impl Corrector {
    pub fn new(model: &Model, settings: NewtonConfig) -> Self {
        let tangent = Tangent::whole(model);
        let free = tangent.dofs.len();
        let [of_load, of_rest, rest, product] = [(); 4].map(|()| vec![0.0; free]);
        Self {
            settings,
            internal: InternalForce::new(model),
            force: vec![0.0; model.dof_count()],
            negative: 0,
            live: model.live_load.clone(),
            pressures: vec![0.0; model.live_pressures.len()],
            load: tangent.dofs.iter().map(|dof| model.live_load[*dof]).collect(),
            of_load,
            of_rest,
            rest,
            product,
            coarseness: model.elements.iter().map(|e| e.coarseness()).fold(0.0, f64::max),
            load_size: norm(&model.live_load),
            info: Info::default(),
            tangent,
        }
    }

    /// Most iterations that a step may take.
    pub fn most_iterations(&self) -> u32 {
        self.settings.most_iterations()
    }

    /// Newton, with the free degree of freedom `control` held; `before` is where the step began. Returns the largest
    /// tension, squared.
    pub fn correct(
        &mut self,
        model: &Model,
        state: &mut State,
        (before, control): (&[f64], usize),
        most: u32,
    ) -> Result<f64, Failure> {
        let (mut moved, mut moved_before) = (f64::INFINITY, f64::INFINITY);
        let (mut iterations, mut rounding) = (0, 0.0);
        loop {
            let tension = self.evaluate(model, state);
            let residual = self.tangent.norm(&self.force);
            let scale = norm(&self.force).max(state.factor.abs() * self.load_size).max(tension.sqrt());
            let limit = self.settings.tolerance * scale;
            let way = state.displacement.iter().zip(before).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            // Where steps are tiny, rounding alone moves more than the tolerance: then it is enough that nothing improves.
            let moved_little = moved <= LEAST_TRAVEL * way || (iterations > 3 && moved >= 0.3 * moved_before);
            if iterations > 0 && (residual <= rounding || (residual <= limit && moved_little)) {
                return Ok(tension);
            }
            if iterations >= most || !residual.is_finite() {
                return Err(Failure::NotConverged {
                    iterations,
                    residual,
                    limit,
                    worst: self.tangent.worst(&self.force),
                    moving: (residual <= limit).then_some(moved),
                    unstable: self.unstable(),
                });
            }
            self.factorise(model, state)?;
            let forces = tension.sqrt() + self.coarseness;
            // As [`crate::equilibrium::newton`] has it.
            rounding = self.tangent.noise(&state.displacement, forces, &mut self.rest).min(COARSEST * scale);
            let factor = self.close(control);
            (moved_before, moved) = (moved, 0.0);
            for (i, dof) in self.tangent.dofs.iter().enumerate() {
                state.displacement[*dof] += self.of_rest[i];
                moved = f64::max(moved, self.of_rest[i].abs());
            }
            state.factor += factor;
            iterations += 1;
            self.info.iterations += 1;
        }
    }

    /// The direction of the path at `state` into `direction`, its largest displacement 1; returns the change of the load
    /// factor [1/m]. Either sign.
    pub fn direction(&mut self, model: &Model, state: &State, direction: &mut [f64]) -> Result<f64, Failure> {
        self.evaluate(model, state);
        self.factorise(model, state)?;
        let Some(control) = self.moves_most(model) else {
            // Nothing moves under these loads.
            return Err(Failure::Unstable { dof: self.tangent.dofs.first().copied().unwrap_or(0) });
        };
        let mut rate = 1.0 / self.of_load[control];
        let along = &mut self.of_rest;
        along.iter_mut().zip(&self.of_load).for_each(|(a, x)| *a = rate * x);
        let mut last = f64::INFINITY;
        for _ in 0..ROUNDS {
            self.tangent.matrix.multiply(along, &mut self.product);
            for ((rest, product), q) in self.rest.iter_mut().zip(&self.product).zip(&self.load) {
                *rest = rate * q - product;
            }
            let (size, whole) = (norm(&self.rest), norm(&self.product) + rate.abs() * self.load_size);
            if size <= REFINED * whole || size >= 0.5 * last {
                break;
            }
            last = size;
            self.tangent.matrix.solve(&mut self.rest);
            let change = -self.rest[control] / self.of_load[control];
            for ((a, y), x) in along.iter_mut().zip(&self.rest).zip(&self.of_load) {
                *a += y + change * x;
            }
            rate += change;
        }
        self.tangent.scatter(&self.of_rest, direction);
        Ok(rate)
    }

    /// Into `direction`, its largest displacement 1: the direction in which the tangent that was factorised last, which is
    /// (almost) singular, resists least.
    pub fn softest(&mut self, model: &Model, direction: &mut [f64]) {
        // By inverse iteration from what has a share of every direction.
        self.of_load.iter_mut().enumerate().for_each(|(i, x)| *x = (1.7 * i as f64 + 1.0).sin());
        for _ in 0..SOFTEST {
            self.tangent.matrix.solve(&mut self.of_load);
            let Some(most) = self.moves_most(model) else { return };
            let size = 1.0 / self.of_load[most];
            self.of_load.iter_mut().for_each(|x| *x *= size);
        }
        self.tangent.scatter(&self.of_load, direction);
    }

    /// The free displacement that moves most under the loads.
    fn moves_most(&self, model: &Model) -> Option<usize> {
        let (dofs, n) = (&self.tangent.dofs, 3 * model.node_count());
        let size = |i: &usize| if dofs[*i] < n { self.of_load[*i].abs() } else { 0.0 };
        let most = (0..dofs.len()).max_by(|a, b| size(a).total_cmp(&size(b)));
        most.filter(|i| size(i) > 0.0 && size(i).is_finite())
    }

    /// The free degree of freedom, as one of the structure, of the first pivot that is not positive.
    pub fn unstable(&self) -> Option<usize> {
        self.tangent.first_negative().filter(|_| self.negative > 0)
    }

    /// Force of loads and elements at the state, into `force`; returns the largest tension, squared.
    pub fn evaluate(&mut self, model: &Model, state: &State) -> f64 {
        let u = &state.displacement;
        if !model.live_pressures.is_empty() {
            self.press(model, u, state.factor);
        }
        let loads = model.dead_load.iter().zip(&self.live);
        self.force.iter_mut().zip(loads).for_each(|(f, (dead, live))| *f = dead + state.factor * live);
        self.internal.subtract(model, Displacements::At(u), &state.history, &mut self.force)
    }

    /// The loads that grow, at the factor 1 and the displacements `u`, into `live`.
    pub fn press(&mut self, model: &Model, u: &[f64], factor: f64) {
        for (pressure, load) in self.pressures.iter_mut().zip(&model.live_pressures) {
            *pressure = load.pressure;
        }
        self.live.copy_from_slice(&model.live_load);
        press(&model.live_pressures, &self.pressures, u, &mut self.live);
        self.pressures.iter_mut().for_each(|pressure| *pressure *= factor);
        self.load_size = norm(&self.live);
        self.tangent.gather(&self.live, &mut self.load);
    }

    /// Factorise `K` at the state, and solve for the loads and for the residual that `force` holds.
    fn factorise(&mut self, model: &Model, state: &State) -> Result<(), Failure> {
        let slack = Slack::Regularised(SLACK_SHARE);
        self.tangent.assemble(model, &state.displacement, &state.history, 1.0, slack);
        self.tangent.add_pressures(&model.live_pressures, &self.pressures, &state.displacement, 1.0);
        self.info.factorisations += 1;
        // What was indefinite mostly stays so.
        if self.negative > 0 || self.tangent.factorise().is_err() {
            self.negative = self.tangent.factorise_signed().map_err(|dof| Failure::Unstable { dof })?;
        }
        self.of_load.copy_from_slice(&self.load);
        self.tangent.gather(&self.force, &mut self.of_rest);
        self.tangent.matrix.solve(&mut self.of_load);
        self.tangent.matrix.solve(&mut self.of_rest);
        Ok(())
    }

    /// With the solutions of the last factorisation: the step at which the residual vanishes and `control` stays, into
    /// `of_rest`; returns the change of the load factor.
    fn close(&mut self, control: usize) -> f64 {
        let mut factor = -self.of_rest[control] / self.of_load[control];
        for (step, x) in self.of_rest.iter_mut().zip(&self.of_load) {
            *step += factor * x;
        }
        if self.negative == 0 {
            return factor;
        }
        self.tangent.matrix.multiply(&self.of_rest, &mut self.product);
        let sums = self.rest.iter_mut().zip(&self.tangent.dofs).zip(self.product.iter().zip(&self.load));
        sums.for_each(|((rest, dof), (product, q))| *rest = self.force[*dof] - product + factor * q);
        self.tangent.matrix.solve(&mut self.rest);
        let change = -(self.rest[control] + self.of_rest[control]) / self.of_load[control];
        for ((step, y), x) in self.of_rest.iter_mut().zip(&self.rest).zip(&self.of_load) {
            *step += y + change * x;
        }
        factor += change;
        factor
    }
}

fn norm(x: &[f64]) -> f64 {
    dot(x, x).sqrt()
}
