//! One step of all rocks.
//!
//! Position Verlet: half a step of drift (position, orientation), forces once in the middle, a whole
//! kick (velocity, angular momentum), half a step of drift. Everything of the state so stands at the
//! same instant, and a force that is constant over a window does exactly the work F . du. All rocks
//! drift before any force is computed: two that touch see each other at one instant.
//!
//! Forces that depend on velocity see `v + h/2 a` with the acceleration of the step before: the
//! middle velocity to second order, from state alone.
//!
//! A step in which nothing acts on a rock is a part of its flight ([`dem_contact::rock::flight`]).

use crate::guard::cause::Case;
use crate::guard::watch;
use crate::integrator::mesh_stage::{MeshWindow, add_forces};
use crate::integrator::schedule::{Request, SubStep, Task};
use crate::integrator::terrain_stage::steps_per_look;
use crate::integrator::window::{RockIntegrator, StepLoad};
use crate::model::impact::Passage;
use crate::model::runout::Passed;
use crate::model::state::{Against, Body, State};
use crate::model::{Model, Span};
use dem_contact::contact::pipeline::Sums;
use dem_contact::law::resistance::Roller;
use dem_contact::rock::{Flight, Motion, Rock, rotation};
use interface_defs::Fault;

impl RockIntegrator {
    /// One part of a group of the window's steps; mostly a step.
    pub(super) fn step(&mut self, part: SubStep, state: &mut State, output: &mut [f64]) -> Result<(), Fault> {
        let (Request { model, input, .. }, cut) = (part.task.request, part.task.cut);
        let span = part.span();
        self.middles.clear();
        self.loads.clear();
        for (rock, body) in model.rocks.iter().zip(&state.bodies) {
            self.middles.push(middle(rock, &body.motion, span.h));
            self.loads.push(StepLoad::default());
        }
        self.net_to_middle(part);
        for rock in 0..model.rocks.len() {
            self.on_mesh(part, state, rock, output)?;
            self.on_surfaces(model, state, rock, span)?;
            self.resist_rolling(model, state, rock, span);
        }
        for rock in 0..model.rocks.len() {
            let (load, body) = (&self.loads[rock], &mut state.bodies[rock]);
            state.dissipated +=
                load.lost - (load.tangential_energy - body.tangential_energy - load.jump_energy);
            body.tangential_energy = load.tangential_energy;
            self.gauges.spring(rock, load.elastic + body.tangential_energy);
        }
        self.on_other_rocks(model, state, span)?;
        self.kick_net(part, state, output);
        for rock in 0..model.rocks.len() {
            self.kick(part, state, rock)?;
        }
        self.judge_partings(model, state, cut.middle(part.step).segment, input);
        Ok(())
    }

    /// Forces of the mesh.
    fn on_mesh(
        &mut self,
        part: SubStep,
        state: &mut State,
        rock: usize,
        output: &mut [f64],
    ) -> Result<(), Fault> {
        let Some(contact_mesh) = &self.contact_mesh else { return Ok(()) };
        let Task { request, cut, .. } = part.task;
        let (model, span @ Span { h, .. }) = (request.model, part.span());
        let (now, body, load) = (&self.middles[rock], &mut state.bodies[rock], &mut self.loads[rock]);
        let first = part.step == 0 && part.part == 0 && !state.predicted.is_empty();
        let predicted = first.then_some(state.predicted.as_slice());
        let (net, travel) = (self.live.then_some(&self.net), self.travel);
        let view =
            MeshWindow { travel, predicted, net, ..MeshWindow::new(request, contact_mesh, &self.fields) };
        let at = if self.live { cut.middle(part.step).alone() } else { cut.middle(part.step) };
        let stage = &mut self.mesh_stages[rock];
        stage.update(view, now, at)?;
        let (evaluation, scene) = stage.parts(view);
        let sums = evaluation.forces(scene, now, at, h, &body.histories);
        if !scene.list.pairs.is_empty() {
            let case = Case { impact: body.track.touch, ..Case::new(model, rock, Against::Net, span) };
            load.behind = watch(&case, now, &sums, |depth| {
                let contact = evaluation.passed_centre(scene, now, h, depth)?;
                let number = scene.list.elements[contact.element as usize].number;
                Some((contact.sphere, format!("element {number} of the interface mesh")))
            })?;
        }
        (load.force, load.torque, load.elastic, load.tangential_energy) =
            (sums.force, sums.torque, sums.elastic, sums.tangential_energy);
        (load.jump_energy, load.rolling) = (sums.jump_energy, sums.rolling);
        load.lost = (sums.damping_power + sums.friction_power) * h;
        let contacts = evaluation.touch.contacts.len();
        if contacts > 0 {
            // Its date is asked for once.
            let first = body.track.touch.is_none();
            load.touched = Some(if first { evaluation.touched_ago(scene, now, h) } else { 0.0 });
            body.deepest.take(Against::Net, sums.penetration, span.middle());
        }
        std::mem::swap(&mut body.histories, &mut evaluation.histories);
        self.counts.contact_evaluations += contacts as u64;
        if contacts > 0 {
            if !self.live {
                let share = cut.segments as f64 / cut.steps as f64;
                let pairs = stage.evaluation.node_forces.iter().zip(stage.increments(at.segment));
                state.received -= pairs.map(|(f, du)| f.dot(du)).sum::<f64>() * share;
            }
            let samples = self.answer.means.len();
            if samples > 0 {
                let field = self.answer.means[part.step * samples / cut.steps];
                add_forces(stage, &self.fields, output, field, samples as f64 / cut.steps as f64);
            }
            if let Some(reach) = &self.answer.reach {
                stage.mark_touched(view, &mut output[reach.clone()]);
            }
            if self.live {
                stage.load(&self.fields, &mut self.net);
            }
        }
        Ok(())
    }

    /// The net's drift to the middle of the step, where it is advanced here.
    fn net_to_middle(&mut self, part: SubStep) {
        if self.live {
            let step = part.of_net();
            let reference = self.fields.ends_of(step.number / (step.steps / step.segments));
            self.net.to_middle(step, reference, part.task.request.input);
        }
    }

    /// Its kick and the second half of its drift.
    fn kick_net(&mut self, part: SubStep, state: &mut State, output: &mut [f64]) {
        if self.live {
            let step = part.of_net();
            state.received -= self.net.kick(step, &self.local, part.task.request.input);
            self.net.answer(step, &self.local, output);
        }
    }

    /// Forces of what stands still: the terrain with its forests, and the sides of a box.
    fn on_surfaces(
        &mut self,
        model: &Model,
        state: &mut State,
        rock: usize,
        span: Span,
    ) -> Result<(), Fault> {
        let (now, body, load) = (&self.middles[rock], &mut state.bodies[rock], &mut self.loads[rock]);
        let counts = &mut self.counts;
        let mut take = |load: &mut StepLoad, body: &mut Body, against: Against, sums: &Sums| {
            load.add(sums, span.h);
            counts.contact_evaluations += sums.contacts as u64;
            body.deepest.take(against, sums.penetration, span.middle());
        };
        if let Some(terrain) = &mut self.terrain {
            let sums = terrain.forces(model, rock, body, now, span)?;
            take(load, body, Against::Terrain, &sums);
            if let Some(force) = terrain.forest(model, now) {
                load.force += force;
                load.lost -= force.dot(&now.velocity) * span.h;
            }
            (load.touching, body.contacts) = (sums.contacts, sums.contacts);
        }
        if let Some(sides) = &mut self.sides {
            let sums = sides.forces(model, rock, body, now, span)?;
            take(load, body, Against::Sides, &sums);
            body.contacts = load.touching + sums.contacts;
        }
        Ok(())
    }

    /// Rolling resistance of all of them.
    fn resist_rolling(&mut self, model: &Model, state: &mut State, rock: usize, Span { start, h }: Span) {
        let (it, load) = (&model.rocks[rock], &mut self.loads[rock]);
        if load.rolling.is_none() {
            return;
        }
        let roller = Roller {
            radius: it.mean_radius(),
            weight: model.settings.gravity * it.mass,
            mass: it.mass,
            inertia: it.inertia.min(),
            speed: self.middles[rock].velocity.norm(),
            spin: it.spin(&self.middles[rock]),
        };
        let (moment, energy) = state.bodies[rock].rolling.resist(&load.rolling, &roller, start, h);
        load.torque += moment;
        load.tangential_energy += energy;
        load.lost -= moment.dot(&roller.spin) * h;
    }

    /// Forces of the rocks on each other, likewise.
    fn on_other_rocks(&mut self, model: &Model, state: &mut State, span: Span) -> Result<(), Fault> {
        if self.rock_stage.is_empty() {
            return Ok(());
        }
        let between_rocks = &mut state.between_rocks;
        let all = self.rock_stage.forces(model, &self.middles, between_rocks, span)?;
        for ((load, felt), body) in self.loads.iter_mut().zip(&self.rock_stage.felt).zip(&mut state.bodies) {
            load.force += felt.force;
            load.torque += felt.torque;
            load.touching += felt.contacts;
            body.rock_contacts = felt.contacts;
            body.deepest.take(Against::Rocks, felt.penetration, span.middle());
        }
        state.dissipated += (all.damping_power + all.friction_power) * span.h
            - (all.tangential_energy - between_rocks.tangential_energy);
        (between_rocks.tangential_energy, between_rocks.contacts) = (all.tangential_energy, all.contacts);
        self.gauges.spring(model.rocks.len(), all.elastic + all.tangential_energy);
        self.counts.contact_evaluations += all.contacts as u64;
        Ok(())
    }

    /// The kick, and the second half of the drift.
    fn kick(&mut self, part: SubStep, state: &mut State, rock: usize) -> Result<(), Fault> {
        let (Task { request: Request { model, .. }, cut, .. }, span) = (part.task, part.span());
        let (it, load, Span { start, h }) = (&model.rocks[rock], &self.loads[rock], span);
        let body = &mut state.bodies[rock];
        let before = body.motion;
        let after = &mut body.motion;
        if load.is_none() {
            let mut flight = Flight::resume(body.flight, &it.inertia, &before, h);
            *after = flight.advance(&it.inertia, &model.settings.gravity, 1);
            body.flight = Some(flight);
        } else {
            body.flight = None;
            after.acceleration = load.force / it.mass + model.settings.gravity;
            after.torque = load.torque;
            after.velocity = before.velocity + after.acceleration * h;
            after.angular_momentum = before.angular_momentum + load.torque * h;
            after.position = before.position + (before.velocity + after.velocity) * (0.5 * h);
            let half = &self.middles[rock].orientation;
            after.orientation = rotation::turn(half, &after.angular_momentum, &it.inertia, 0.5 * h);
        }
        if !after.is_finite() {
            let against = if model.rows.is_empty() { Against::Terrain } else { Against::Net };
            let case = Case { impact: body.track.touch, ..Case::new(model, rock, against, span) };
            let overlap = body.deepest.largest().map_or(0.0, |(overlap, _)| overlap);
            let (name, why) = (&it.name, case.not_finite(&before, overlap));
            return Err(Fault::window(format!(
                "rock `{name}` has left the finite numbers at {start:.6} s, in a step of {h:.3e} s: {why}"
            )));
        }
        let after = body.motion;
        let passage = Passage {
            start,
            length: h,
            before: &before,
            after: &after,
            touched: load.touched,
            behind: load.behind,
        };
        body.track.follow(it, &model.settings, self.rest.as_ref(), &passage);
        if let Some(terrain) = &mut self.terrain {
            let (end, last) = part.end();
            let every = steps_per_look(cut.h);
            let look = last.is_some_and(|s| s.is_multiple_of(every) || s == cut.steps);
            terrain.stepped(model, rock, &before, body, Passed { end, h, touching: load.touching > 0, look });
        }
        Ok(())
    }
}

/// Motion in the middle of a step of `h` [s] that begins with `before`.
fn middle(rock: &Rock, before: &Motion, h: f64) -> Motion {
    let mut now = *before;
    now.position += before.velocity * (0.5 * h);
    now.orientation = rotation::turn(&before.orientation, &before.angular_momentum, &rock.inertia, 0.5 * h);
    now.velocity += before.acceleration * (0.5 * h);
    now.angular_momentum += before.torque * (0.5 * h);
    now
}
