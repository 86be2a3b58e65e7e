//! The steps of a window.
//!
//! Position Verlet: half a step of drift (position, orientation), forces once in the middle, a whole
//! kick (velocity, angular momentum), half a step of drift. Everything of the state so stands at the
//! same instant, and a force that is constant over a window does exactly the work F . du.
//!
//! Forces that depend on velocity see `v + h/2 a` with the acceleration of the step before: the
//! middle velocity to second order, from state alone.

use super::cut::Cut;
use super::gauges::{Gauges, Moment};
use super::measures::Passage;
use super::state::State;
use super::watch::watch;
use super::zone::{View, Zone};
use super::{Counts, Model, flight, name_of, rocks_that_met};
use crate::rock::Motion;
use crate::rock::rotation::rotate;
use crate::search::pairs::Instant;
use crate::wall::Wall;
use crate::wall::motion::MotionFields;
use interface_defs::{Fault, InterfaceMesh, Layout, Plan, Sampling, Window, name};
use nalgebra::Vector3;

/// A prepared run.
pub struct Run {
    wall: Option<Wall>,
    zones: Vec<Zone>,
    fields: MotionFields,
    answer: Answer,
    /// Numbers of a request and of its answer.
    lengths: (usize, usize),
    gauges: Gauges,
    counts: Counts,
    most_contacts: usize,
    /// Furthest down that a node of the wall lies at rest [m].
    level: Option<f64>,
    starts: Vec<Motion>,
    instants: Vec<usize>,
}

/// Where the answer's fields lie.
#[derive(Debug, Clone)]
struct Answer {
    means: Vec<usize>,
    ends: Vec<usize>,
    reach: Option<std::ops::Range<usize>>,
    gauges: usize,
}

impl Run {
    /// For a checked plan.
    pub fn new(model: &Model, wall: Option<Wall>, plan: &Plan) -> Self {
        let empty = InterfaceMesh::default();
        let mesh = plan.wall.as_ref().unwrap_or(&empty);
        let takes = Layout::new(&plan.takes, mesh, 0);
        let gives = Layout::new(&plan.gives, mesh, Gauges::count(&model.rocks));
        let fields = MotionFields::new(&takes);
        let starts_of = |sampling| {
            let spec = plan.gives.iter().find(|f| f.name == name::FORCE && f.sampling == sampling);
            let count = spec.map_or(0, |f| f.samples as usize);
            (0..count).filter_map(|i| Some(gives.sample(name::FORCE, sampling, i)?.start)).collect::<Vec<_>>()
        };
        let answer = Answer {
            means: starts_of(Sampling::Means),
            ends: starts_of(Sampling::AtEnds),
            reach: gives.sample(name::REACH, Sampling::Once, 0),
            gauges: gives.gauge(0).start,
        };
        let zones = match &wall {
            Some(wall) => (0..model.rocks.len()).map(|r| Zone::new(model, r, wall, &fields)).collect(),
            None => Vec::new(),
        };
        let contacts = |r| if wall.is_some() { Zone::most_contacts(model, r) } else { 0 };
        Self {
            zones,
            fields,
            answer,
            lengths: (takes.len(), gives.len()),
            gauges: Gauges::new(&model.settings),
            counts: Counts::default(),
            most_contacts: (0..model.rocks.len()).map(contacts).max().unwrap_or(0),
            level: wall.as_ref().map(|w| w.depth(&model.settings.down())),
            starts: Vec::with_capacity(model.rocks.len()),
            instants: Vec::with_capacity(16 * model.rocks.len() + 16),
            wall,
        }
    }

    /// Contacts of a rock for which there is room.
    pub fn most_contacts(&self) -> usize {
        self.most_contacts
    }

    /// Whether there is a wall.
    pub fn has_wall(&self) -> bool {
        self.wall.is_some()
    }

    /// Work done, by name.
    pub fn counts(&self) -> Vec<(String, u64)> {
        let searches = self.zones.iter().map(|z| z.pairs.searches).sum();
        let near = self.zones.iter().map(|z| z.refreshes).sum();
        [
            ("sub_steps", self.counts.sub_steps),
            ("flight_windows", self.counts.flight_windows),
            ("contact_evaluations", self.counts.contact_evaluations),
            ("candidate_refreshes", searches),
            ("near_refreshes", near),
        ]
        .map(|(name, count)| (name.to_owned(), count))
        .into()
    }

    /// The answer as it would stand at t = 0, with the wall at rest; also fills in what the state
    /// knows of its contacts.
    pub fn initial(&mut self, model: &Model, state: &mut State, plan: &Plan) -> Result<Vec<f64>, Fault> {
        let input = vec![0.0; self.lengths.0];
        let mut output = vec![0.0; self.lengths.1];
        // A window of no length would have no steps; reach looks as far as the plan's window.
        let length =
            if plan.window > 0.0 && plan.window.is_finite() { plan.window } else { model.steps.step };
        self.begin(model, state, length, &input, &mut output)?;
        let start = Instant { segment: 0, along: 0.0, elapsed: 0.0 };
        self.at_end(model, state, &input, length, start, None)?;
        for sample in self.answer.means.clone().into_iter().chain(self.answer.ends.clone()) {
            self.at_end(model, state, &input, length, start, Some((&mut output, sample)))?;
        }
        self.gauges.first(model, state, &mut output[self.answer.gauges..]);
        Ok(output)
    }

    /// Advance `state` over `window`.
    pub fn solve(
        &mut self,
        model: &Model,
        state: &mut State,
        window: &Window,
        input: &[f64],
        output: &mut [f64],
    ) -> Result<(), Fault> {
        self.check_request(window, input, output)?;
        output.fill(0.0);
        let flies = self.begin(model, state, window.length, input, output)?;
        let cut = self.cut(model, window);
        self.gauges.begin(state, &mut output[self.answer.gauges..]);
        if flies {
            self.counts.flight_windows += 1;
            self.fly(model, state, window, cut, output);
        } else {
            self.step_through(model, state, window, cut, input, output)?;
        }
        state.time = window.end();
        if let Some((a, b)) = rocks_that_met(model, state) {
            return Err(Fault::broken(format!(
                "rock `{}` and rock `{}` have met at {:.4} s; contact between rocks is not part of this version",
                name_of(model, a),
                name_of(model, b),
                state.time
            )));
        }
        Ok(())
    }

    /// Refuse a request that is not of the plan.
    fn check_request(&self, window: &Window, input: &[f64], output: &[f64]) -> Result<(), Fault> {
        if !(window.length > 0.0 && window.length.is_finite()) {
            return Err(Fault::broken(format!("a window of {} s cannot be solved", window.length)));
        }
        let (takes, gives) = self.lengths;
        if (input.len(), output.len()) != (takes, gives) {
            return Err(Fault::broken(format!(
                "the request has {} numbers and room for {}, by the plan they are {takes} and {gives}",
                input.len(),
                output.len()
            )));
        }
        Ok(())
    }

    fn cut(&self, model: &Model, window: &Window) -> Cut {
        let samples = [self.answer.means.len(), self.answer.ends.len()];
        Cut::new(window, model.steps.step, self.fields.segments(), &samples)
    }

    /// Look around; true if no rock can meet the wall within the window.
    fn begin(
        &mut self,
        model: &Model,
        state: &State,
        length: f64,
        input: &[f64],
        output: &mut [f64],
    ) -> Result<bool, Fault> {
        self.starts.clear();
        self.starts.extend(state.bodies.iter().map(|b| b.motion));
        let Some(wall) = &self.wall else { return Ok(model.shortcuts) };
        let view = View { model, wall, fields: &self.fields, input, length };
        let mut flies = model.shortcuts;
        for (zone, body) in self.zones.iter_mut().zip(&state.bodies) {
            zone.begin(view, &body.motion)?;
            if let Some(reach) = &self.answer.reach {
                zone.mark_reach(view, &body.motion, &mut output[reach.clone()]);
            }
            flies = flies && body.contacts == 0 && !zone.in_reach(view, &body.motion);
        }
        Ok(flies)
    }

    fn fly(&mut self, model: &Model, state: &mut State, window: &Window, cut: Cut, output: &mut [f64]) {
        let gravity = model.settings.gravity;
        flight::instants(&self.starts, &model.rocks, &gravity, cut.steps, cut.h, &mut self.instants);
        for body in &mut state.bodies {
            state.dissipated += body.sheared;
            body.memories.clear();
            (body.sheared, body.elastic) = (0.0, 0.0);
        }
        let mut from = 0;
        for i in 0..self.instants.len() {
            let to = self.instants[i];
            let time = |step: usize| if step == cut.steps { window.length } else { cut.h * step as f64 };
            for (r, body) in state.bodies.iter_mut().enumerate() {
                let rock = &model.rocks[r];
                let before = body.motion;
                body.motion =
                    flight::motion_at(rock, &self.starts[r], &before, &gravity, time(to), cut.h, to - from);
                let passage = Passage {
                    start: window.start + time(from),
                    length: time(to) - time(from),
                    before: &before,
                    after: &body.motion,
                    touched: None,
                    penetration: 0.0,
                    behind: false,
                };
                body.track.follow(rock, &model.settings, self.level, &passage);
            }
            self.gauges.take(model, state, Moment::Step, &mut output[self.answer.gauges..]);
            from = to;
        }
        self.gauges.take(model, state, Moment::End, &mut output[self.answer.gauges..]);
    }

    fn step_through(
        &mut self,
        model: &Model,
        state: &mut State,
        window: &Window,
        cut: Cut,
        input: &[f64],
        output: &mut [f64],
    ) -> Result<(), Fault> {
        for step in 0..cut.steps {
            for rock in 0..model.rocks.len() {
                self.step(model, state, rock, window, cut, step, input, output)?;
            }
            self.counts.sub_steps += model.rocks.len() as u64;
            let samples = self.answer.ends.len();
            if samples > 0 && (step + 1) % (cut.steps / samples) == 0 {
                let sample = self.answer.ends[(step + 1) * samples / cut.steps - 1];
                self.at_end(model, state, input, window.length, cut.end(step), Some((output, sample)))?;
            } else if step + 1 == cut.steps {
                self.at_end(model, state, input, window.length, cut.end(step), None)?;
            }
            self.gauges.take(model, state, Moment::Step, &mut output[self.answer.gauges..]);
        }
        self.gauges.take(model, state, Moment::End, &mut output[self.answer.gauges..]);
        Ok(())
    }

    /// One step of one rock.
    fn step(
        &mut self,
        model: &Model,
        state: &mut State,
        rock: usize,
        window: &Window,
        cut: Cut,
        step: usize,
        input: &[f64],
        output: &mut [f64],
    ) -> Result<(), Fault> {
        let (it, h) = (&model.rocks[rock], cut.h);
        let body = &mut state.bodies[rock];
        let before = body.motion;
        let mut now = before;
        now.position += before.velocity * (0.5 * h);
        now.orientation = rotate(&before.orientation, &before.angular_momentum, &it.inertia, 0.5 * h);
        now.velocity += before.acceleration * (0.5 * h);
        now.angular_momentum += before.torque * (0.5 * h);
        let mut force = Vector3::zeros();
        let mut torque = Vector3::zeros();
        let mut passage = Passage {
            start: window.start + h * step as f64,
            length: h,
            before: &before,
            after: &before,
            touched: None,
            penetration: 0.0,
            behind: false,
        };
        let mut elastic = 0.0;
        if let Some(wall) = &self.wall {
            let view = View { model, wall, fields: &self.fields, input, length: window.length };
            let at = cut.middle(step);
            let zone = &mut self.zones[rock];
            zone.update(view, &now, at)?;
            let (evaluation, scene) = zone.parts(view);
            let sums = evaluation.forces(scene, &now, at, h, &body.memories);
            passage.behind = watch(evaluation, scene, &now, &sums, h, passage.start)?;
            (force, torque, elastic) = (sums.force, sums.torque, sums.elastic);
            let contacts = evaluation.touch.contacts.len();
            if contacts > 0 {
                // Its date is asked for once.
                let first = body.track.touch.is_none();
                passage.touched = Some(if first { evaluation.touched_ago(scene, &now) } else { 0.0 });
                passage.penetration = sums.penetration;
            }
            std::mem::swap(&mut body.memories, &mut evaluation.memories);
            state.dissipated += (sums.damped + sums.rubbed) * h - (sums.sheared - body.sheared);
            body.sheared = sums.sheared;
            self.counts.contact_evaluations += contacts as u64;
            if contacts > 0 {
                let share = cut.segments as f64 / cut.steps as f64;
                let pairs = zone.evaluation.node_forces.iter().zip(zone.increments(at.segment));
                state.received -= pairs.map(|(f, du)| f.dot(du)).sum::<f64>() * share;
                let samples = self.answer.means.len();
                if samples > 0 {
                    let field = self.answer.means[step * samples / cut.steps];
                    add_forces(zone, output, field, samples as f64 / cut.steps as f64);
                }
            }
        }
        self.gauges.spring(rock, elastic + body.sheared);
        let after = &mut body.motion;
        after.acceleration = force / it.mass + model.settings.gravity;
        after.torque = torque;
        after.velocity = before.velocity + after.acceleration * h;
        after.angular_momentum = before.angular_momentum + torque * h;
        after.position = before.position + (before.velocity + after.velocity) * (0.5 * h);
        after.orientation = rotate(&now.orientation, &after.angular_momentum, &it.inertia, 0.5 * h);
        if !after.is_finite() {
            return Err(Fault::window(format!(
                "rock `{}` has left the finite numbers at {:.6} s: the contact forces have diverged; shorten \
                 dem.time_step ({h:.3e} s) or the coupling window",
                it.name, passage.start
            )));
        }
        let after = body.motion;
        body.track.follow(it, &model.settings, self.level, &Passage { after: &after, ..passage });
        Ok(())
    }

    /// Contacts and elastic energy at an instant of the state; forces where `field` says.
    fn at_end(
        &mut self,
        model: &Model,
        state: &mut State,
        input: &[f64],
        length: f64,
        at: Instant,
        mut field: Option<(&mut [f64], usize)>,
    ) -> Result<(), Fault> {
        let Some(wall) = &self.wall else { return Ok(()) };
        let view = View { model, wall, fields: &self.fields, input, length };
        for (zone, body) in self.zones.iter_mut().zip(&mut state.bodies) {
            zone.update(view, &body.motion, at)?;
            let (evaluation, scene) = zone.parts(view);
            if let Some((output, field)) = &mut field {
                body.elastic = evaluation.forces(scene, &body.motion, at, 0.0, &body.memories).elastic;
                add_forces(zone, output, *field, 1.0);
            } else {
                body.elastic = evaluation.energy(scene, &body.motion, at);
            }
            body.contacts = zone.evaluation.touch.contacts.len();
            self.counts.contact_evaluations += body.contacts as u64;
        }
        Ok(())
    }
}

/// Add the forces on the wall's nodes, times `share`, to the field that begins at `field`.
fn add_forces(zone: &Zone, output: &mut [f64], field: usize, share: f64) {
    for (number, force) in zone.pairs.numbers.iter().zip(&zone.evaluation.node_forces) {
        let at = field + 3 * *number as usize;
        for (o, f) in output[at..at + 3].iter_mut().zip(force.iter()) {
            *o += f * share;
        }
    }
}
