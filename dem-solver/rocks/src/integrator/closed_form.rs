//! Flight in closed form, for windows in which no rock can touch the mesh.
//!
//! A flight has the same numbers in steps and at once ([`dem_contact::rock::flight`]): switching this off changes nothing.

use crate::integrator::schedule::{Request, Task};
use crate::integrator::terrain_stage::steps_per_look;
use crate::integrator::window::RockIntegrator;
use crate::model::impact::Passage;
use crate::model::state::{Body, State};
use crate::results::gauges::Moment;
use dem_contact::rock::Flight;
use nalgebra::Vector3;
use std::ops::Range;

/// The steps (1 to `steps`) whose ends must be looked at so that smallest and largest values are those
/// of all steps: every one where a rock turns, else the first, the last and those beside an apex.
pub fn instants(bodies: &[Body], gravity: &Vector3<f64>, steps: usize, h: f64, found: &mut Vec<usize>) {
    found.clear();
    if bodies.iter().any(|b| b.motion.angular_momentum != Vector3::zeros()) {
        found.extend(1..=steps);
        return;
    }
    let mut beside = |apex: f64| {
        if apex > 0.0 && apex < steps as f64 {
            found.extend([apex.floor() as usize, apex.ceil() as usize]);
        }
    };
    for start in bodies.iter().map(|b| &b.motion) {
        for axis in 0..3 {
            beside(-start.velocity[axis] / (gravity[axis] * h));
        }
        beside(-start.velocity.dot(gravity) / (gravity.norm_squared() * h));
    }
    found.extend([1, steps]);
    found.retain(|s| *s > 0);
    found.sort_unstable();
    found.dedup();
}

impl RockIntegrator {
    /// Fly the steps `range` in closed form.
    pub(super) fn fly(&mut self, task: Task, state: &mut State, range: Range<usize>, output: &mut [f64]) {
        let Task { window, cut, request: Request { model, input, .. } } = task;
        let gravity = model.settings.gravity;
        let look = steps_per_look(cut.h);
        if model.ground.is_some() {
            // Of all steps those at which a stepping run would look at the height.
            let first = (range.start / look + 1) * look;
            self.instants.clear();
            self.instants.extend((first..range.end).step_by(look));
            self.instants.push(range.end);
        } else {
            instants(&state.bodies, &gravity, cut.steps, cut.h, &mut self.instants);
        }
        for body in &mut state.bodies {
            state.dissipated += body.tangential_energy;
            body.part();
        }
        state.dissipated += state.between_rocks.tangential_energy;
        state.between_rocks.end();
        let mut from = range.start;
        for i in 0..self.instants.len() {
            let to = self.instants[i];
            let time = |step: usize| if step == cut.steps { window.length } else { cut.h * step as f64 };
            for (r, body) in state.bodies.iter_mut().enumerate() {
                let rock = &model.rocks[r];
                let before = body.motion;
                let mut flight = Flight::resume(body.flight, &rock.inertia, &before, cut.h);
                body.motion = flight.advance(&rock.inertia, &gravity, (to - from) as u64);
                body.flight = Some(flight);
                let passage = Passage {
                    start: window.start + time(from),
                    length: time(to) - time(from),
                    before: &before,
                    after: &body.motion,
                    touched: None,
                    behind: false,
                };
                body.track.follow(rock, &model.settings, self.rest.as_ref(), &passage);
                if let Some(terrain) = &mut self.terrain {
                    let due = to.is_multiple_of(look) || to == cut.steps;
                    terrain.flew(model, r, body, window.start + time(to), due);
                }
            }
            self.judge_partings(model, state, 0, input);
            if self.reads_steps(model) {
                self.gauges.take(model, state, Moment::Step, &mut output[self.answer.gauges..]);
            }
            from = to;
        }
        self.counts.flight_steps += range.len() as u64;
    }
}
