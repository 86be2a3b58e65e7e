//! Kinetic damping: what Newton alone cannot bring to rest falls and swings with its own masses, and is stopped wherever
//! its kinetic energy is largest.
//!
//! Steps are implicit (backward Euler), so that their length follows the motion and not the stiffest element: with
//! `x = u + h v` each is a Newton iteration for `f(u') = M (u' - x) / h^2`, and `v' = (u' - u) / h`. Between peaks that is
//! the fall of the structure itself; at a peak potential energy is about least along the way, all velocities become 0, and
//! Newton tries to finish.
//!
//! Rotations are committed after each step: those of a post that falls over are not small.
//!
//! Source: Barnes (1999), Form finding and analysis of tension structures by dynamic relaxation, Int. J. Space Structures
//! 14(2), 89 (kinetic damping).

use crate::equilibrium::form_finding::Search;
use crate::equilibrium::newton::{Failure, Problem};
use crate::model::Model;

/// Most steps.
pub const MOST_STEPS: usize = 1000;
/// Most iterations of a step; one that takes more is done again at half its length.
const MOST_ITERATIONS: u32 = 40;
/// Residual of a step, relative to the forces: as small as the peaks of the kinetic energy ask for. Where nothing moves any
/// more by that, it becomes [`FINER`] times as large, down to the level of rounding.
const TOLERANCE: f64 = 1e-4;
const FINER: f64 = 1e-2;
const FINEST: f64 = 1e-12;
/// Iterations up to which the next step is twice as long, and up to which it is [`LONGER`] as long.
const EASY: (u64, u64) = (8, 20);
const LONGER: f64 = 1.4;
/// Free fall in the first step, relative to the extent of the structure.
const FIRST: f64 = 1e-5;
/// Length of the first step where no load acts [s].
const UNLOADED: f64 = 1e-3;
/// Shortest step, relative to the first: below, rounding of places counts for more than forces. It begins anew there, at
/// rest and with a residual [`COARSER`] times as large, at most so many times.
const SHORTEST: f64 = 1e-4;
const COARSER: f64 = 10.0;
const RESTARTS: usize = 5;
/// Displacement over the extent of the structure beyond which it falls for ever.
const GONE: f64 = 20.0;
/// Share of the largest speed from which a node counts as moving.
const MOVING: f64 = 0.1;

/// A structure that swings.
pub struct Swing<'a> {
    model: &'a Model,
    pressures: Vec<f64>,
    /// Mass of degrees of freedom that have none of their own [kg, kg m2].
    lent: Vec<f64>,
    velocity: Vec<f64>,
    before: Vec<f64>,
    target: Vec<f64>,
    step: f64,
    first: f64,
    energy: f64,
    tolerance: f64,
    restarts: usize,
}

impl<'a> Swing<'a> {
    /// At rest.
    pub fn new(model: &'a Model) -> Self {
        let n = model.dof_count();
        let lent = lent_masses(model);
        let mass = |dof: usize| model.dof_mass(dof) + lent[dof];
        let free = (0..3 * model.node_count()).filter(|dof| !model.held[*dof]);
        let load = model.load_at_start(&vec![0.0; n]);
        let fastest = free.map(|dof| load[dof].abs() / mass(dof)).fold(0.0, f64::max);
        let first = if fastest > 0.0 { (2.0 * FIRST * model.extent() / fastest).sqrt() } else { UNLOADED };
        Self {
            model,
            pressures: model.pressures_at_start(),
            lent,
            velocity: vec![0.0; n],
            before: vec![0.0; n],
            target: vec![0.0; n],
            step: first,
            first,
            energy: 0.0,
            tolerance: TOLERANCE,
            restarts: 0,
        }
    }

    /// At a peak of the kinetic energy at which it does not rest: all velocities become 0.
    pub fn stop(&mut self) {
        self.velocity.fill(0.0);
        self.energy = 0.0;
        self.step *= 2.0;
    }

    /// One step; whether the kinetic energy was largest before it, or nothing moves.
    pub fn advance(
        &mut self,
        search: &mut Search,
        u: &mut [f64],
        history: &mut [f64],
    ) -> Result<bool, Failure> {
        self.before.copy_from_slice(u);
        for ((target, u), v) in self.target.iter_mut().zip(&*u).zip(&self.velocity) {
            *target = u + self.step * v;
        }
        u.copy_from_slice(&self.target);
        let rate = 1.0 / (self.step * self.step);
        let problem = Problem {
            inertia: rate,
            viscosity: (&self.lent, rate),
            ..Problem::of_rest(self.model, &self.target, history, &self.pressures)
        };
        let limits = (self.tolerance, MOST_ITERATIONS);
        let count = match search.solve_stage(&problem, limits, u) {
            Ok(info) => info.iterations,
            Err(failure @ Failure::Stopped(_)) => return Err(failure),
            Err(failure) => {
                u.copy_from_slice(&self.before);
                self.step *= 0.5;
                if self.step < SHORTEST * self.first {
                    if self.restarts == RESTARTS {
                        return Err(failure);
                    }
                    // At rest, in coarser steps.
                    self.restarts += 1;
                    self.velocity.fill(0.0);
                    (self.energy, self.step) = (0.0, self.first);
                    self.tolerance *= COARSER;
                }
                return Ok(false);
            }
        };
        search.newton.internal.elements.advance_rotations(&self.model.elements, u, history);
        let energy = self.speed_up(u);
        let still = count == 0;
        if still {
            self.tolerance = (FINER * self.tolerance).max(FINEST);
        }
        let peak = energy < self.energy || still;
        self.energy = energy;
        let travel = u.iter().take(3 * self.model.node_count()).fold(0.0_f64, |most, u| most.max(u.abs()));
        if travel > GONE * self.model.extent() {
            return Err(self.moves());
        }
        self.step *= match count {
            count if count <= EASY.0 => 2.0,
            count if count <= EASY.1 => LONGER,
            _ => 1.0,
        };
        Ok(peak)
    }

    /// Velocities of the step that was just done; returns the kinetic energy [J].
    fn speed_up(&mut self, u: &[f64]) -> f64 {
        let mut energy = 0.0;
        for (dof, u) in u.iter().enumerate().filter(|(dof, _)| !self.model.held[*dof]) {
            let v = (u - self.before[dof]) / self.step;
            self.velocity[dof] = v;
            energy += 0.5 * (self.model.dof_mass(dof) + self.lent[dof]) * v * v;
        }
        energy
    }

    /// What does not come to rest.
    pub fn moves(&self) -> Failure {
        let speed = |node: usize| self.model.vector(&self.velocity, node).norm();
        let nodes = 0..self.model.node_count();
        let fastest = nodes.clone().max_by(|a, b| speed(*a).total_cmp(&speed(*b))).unwrap_or(0);
        let count = nodes.filter(|node| speed(*node) >= MOVING * speed(fastest)).count();
        Failure::Moves(fastest, speed(fastest), count)
    }
}

/// For each degree of freedom without mass the smallest there is of its kind; 1 kg or kg m2 where there is none.
fn lent_masses(model: &Model) -> Vec<f64> {
    let turns = 3 * model.node_count();
    let least = |dofs: std::ops::Range<usize>| {
        let own =
            dofs.map(|dof| model.dof_mass(dof)).filter(|mass| *mass > 0.0).fold(f64::INFINITY, f64::min);
        if own.is_finite() { own } else { 1.0 }
    };
    let (of_nodes, of_turns) = (least(0..turns), least(turns..model.dof_count()));
    let lent = |dof: usize| match model.dof_mass(dof) {
        own if own > 0.0 => 0.0,
        _ if dof < turns => of_nodes,
        _ => of_turns,
    };
    (0..model.dof_count()).map(lent).collect()
}
