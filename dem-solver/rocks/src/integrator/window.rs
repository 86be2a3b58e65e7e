//! A window: cut into steps, which are taken one by one ([`crate::integrator::step`]) or flown through in closed form.

use crate::integrator::box_stage::{self, BoxStage};
use crate::integrator::mesh_stage::{MeshStage, MeshWindow, add_forces};
use crate::integrator::rock_stage::RockStage;
use crate::integrator::schedule::{Cut, Request, SubStep, Task};
use crate::integrator::secondary_impacts::{SecondaryImpacts, bend};
use crate::integrator::sub_stepping::SubSteps;
use crate::integrator::terrain_stage::TerrainStage;
use crate::model::Counts;
use crate::model::Model;
use crate::model::runout::jump_height;
use crate::model::state::{Body, State};
use crate::results::gauges::{Gauges, Moment};
use crate::results::outline::Outline;
use crate::results::trajectory::Row;
use dem_contact::contact::broad_phase::mesh_pairs::Instant;
use dem_contact::contact::broad_phase::terrain_pairs::TerrainPairs;
use dem_contact::contact::pipeline::Sums;
use dem_contact::interface_mesh::local_net::{LocalFields, LocalNet};
use dem_contact::interface_mesh::motion::MotionFields;
use dem_contact::interface_mesh::{AtRest, ContactMesh};
use dem_contact::law::resistance::RollingLoad;
use dem_contact::rock::Motion;
use interface_defs::verdict::Fate;
use interface_defs::{Fault, FieldSpec, InterfaceMesh, Items, Layout, Plan, Sampling, Window, name};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// Beginning of a window.
const START: Instant = Instant { segment: 0, along: 0.0, elapsed: 0.0 };

/// Fewest steps that are worth a flight in closed form, and steps until the next look for one.
const FEWEST: usize = 4;

/// Places of the fields in the answer.
#[derive(Debug, Clone, Default)]
pub(super) struct Answer {
    pub(super) means: Vec<usize>,
    pub(super) ends: Vec<usize>,
    pub(super) reach: Option<Range<usize>>,
    pub(super) gauges: usize,
}

impl Answer {
    /// Find them in the layout of the answer.
    pub(super) fn lay_out(&mut self, gives: &Layout) {
        for (starts, sampling) in [(&mut self.means, Sampling::Means), (&mut self.ends, Sampling::AtEnds)] {
            let force = |f: &&FieldSpec| f.name == name::FORCE && f.sampling == sampling;
            let count = gives.fields().find(force).map_or(0, |f| f.samples as usize);
            starts.clear();
            starts.extend((0..count).filter_map(|i| Some(gives.sample(name::FORCE, sampling, i)?.start)));
        }
        self.reach = gives.sample(name::REACH, Sampling::Once, 0);
        self.gauges = gives.gauges().start;
    }
}

/// What acts on a rock in the middle of a step.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct StepLoad {
    /// Force of all contacts [N].
    pub force: Vector3<f64>,
    /// Torque about the centre of mass [N m].
    pub torque: Vector3<f64>,
    /// Energy of the normal springs on mesh and terrain [J].
    pub elastic: f64,
    /// Energy of the tangential springs there after the step [J].
    pub tangential_energy: f64,
    /// Energy that those on the mesh have taken up between the window before and this one [J].
    pub jump_energy: f64,
    /// Energy that dashpots and friction take there in the step [J].
    pub lost: f64,
    /// What presses the rock on surfaces that resist its rolling.
    pub rolling: RollingLoad,
    /// Contacts with terrain and other rocks, not with the sides of a box.
    pub touching: usize,
    /// With contacts on the mesh: how long the first has lasted [s].
    pub touched: Option<f64>,
    /// True if the mesh lies behind the centres of the outer spheres.
    pub behind: bool,
}

impl StepLoad {
    /// True if nothing acts.
    pub fn is_none(&self) -> bool {
        self.force == Vector3::zeros() && self.torque == Vector3::zeros()
    }

    /// Take in the contacts with something that stands still, in a step of `h` [s].
    pub fn add(&mut self, sums: &Sums, h: f64) {
        self.force += sums.force;
        self.torque += sums.torque;
        self.elastic += sums.elastic;
        self.tangential_energy += sums.tangential_energy;
        self.lost += (sums.damping_power + sums.friction_power) * h + sums.yielded;
        self.rolling.add_all(&sums.rolling);
    }
}

/// A prepared run.
#[derive(Default)]
pub struct RockIntegrator {
    pub(super) contact_mesh: Option<ContactMesh>,
    pub(super) mesh_stages: Vec<MeshStage>,
    pub(super) fields: MotionFields,
    /// Where the request says which lines of the mesh are broken.
    pub(super) broken: Option<Range<usize>>,
    pub(super) answer: Answer,
    /// Layouts of a request and of its answer.
    pub(super) takes: Layout,
    pub(super) gives: Layout,
    /// All nodes, lines and faces of the mesh.
    pub(super) all: Items,
    /// Lines that the request speaks of, where it does not of all.
    pub(super) lines: Vec<u32>,
    /// Room for what is remembered of nodes while others are selected.
    pub(super) remembered: Vec<f64>,
    /// Where the request says how far other nodes have moved, and the answer how long nothing touches.
    pub(super) travel_at: Option<Range<usize>>,
    pub(super) free_time_at: Option<Range<usize>>,
    pub(super) travel: f64,
    /// Half of the largest acceleration by which the net's own forces take a node off its course, as last sent [m/s2].
    pub(super) half_acceleration: f64,
    /// What the plan has for a net that is advanced here, and whether it has all.
    pub(super) local: LocalFields,
    pub(super) is_local: bool,
    pub(super) net: LocalNet,
    /// True if the net is advanced here in the window under way.
    pub(super) live: bool,
    pub(super) gauges: Gauges,
    /// What the rocks touch of the terrain.
    pub(super) terrain: Option<TerrainStage>,
    /// Their contacts with each other.
    pub(super) rock_stage: RockStage,
    /// Their contacts with the sides of a box.
    pub(super) sides: Option<BoxStage>,
    pub(super) secondary_impacts: SecondaryImpacts,
    /// Motions in the middle of the step under way.
    pub(super) middles: Vec<Motion>,
    /// What acts on the rocks there.
    pub(super) loads: Vec<StepLoad>,
    pub(super) counts: Counts,
    pub(super) most_contacts: usize,
    /// Length of the scene's windows [s].
    usual: f64,
    /// The net at rest.
    pub(super) rest: Option<AtRest>,
    pub(super) instants: Vec<usize>,
}

/// Outcome of a window.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Solved {
    /// It is solved.
    Done,
    /// Contacts on the net's own masses, or its own stiffness, ask for shorter steps: solve it again.
    TooCoarse,
}

impl RockIntegrator {
    /// For a checked plan.
    pub fn new(model: &Model, contact_mesh: Option<ContactMesh>, plan: &Plan, rows: bool) -> Self {
        let empty = InterfaceMesh::default();
        let mesh = plan.partner_mesh.as_ref().unwrap_or(&empty);
        let takes = Layout::new(&plan.takes, mesh, 0);
        let gives = Layout::new(&plan.gives, mesh, Gauges::declared(model).len());
        let fields = MotionFields::new(&takes, mesh.node_count());
        let mesh_stages = match &contact_mesh {
            Some(contact_mesh) => {
                (0..model.rocks.len()).map(|r| MeshStage::new(model, r, contact_mesh, &fields)).collect()
            }
            None => Vec::new(),
        };
        let touches = contact_mesh.is_some() || model.ground.is_some();
        let contacts = |r| if touches { MeshStage::most_contacts(model, r) } else { 0 };
        let mut integrator = Self {
            mesh_stages,
            fields,
            takes,
            gives,
            all: Items::of(mesh),
            lines: Vec::with_capacity(mesh.lines.len()),
            remembered: Vec::with_capacity(3 * mesh.node_count()),
            is_local: LocalFields::are_in(plan),
            gauges: Gauges::new(&model.settings, model.origin),
            terrain: model.ground.as_ref().map(|ground| TerrainStage::new(model, ground, rows)),
            rock_stage: RockStage::new(model),
            sides: (!model.planes.is_empty()).then(|| BoxStage::new(model)),
            middles: Vec::with_capacity(model.rocks.len()),
            loads: Vec::with_capacity(model.rocks.len()),
            most_contacts: (0..model.rocks.len()).map(contacts).max().unwrap_or(0),
            usual: plan.window,
            rest: contact_mesh.as_ref().map(|w| w.at_rest(&model.settings.down())),
            instants: Vec::with_capacity(16 * model.rocks.len() + 16),
            contact_mesh,
            ..Self::default()
        };
        if integrator.is_local {
            integrator.net.reserve(mesh.node_count());
        }
        integrator.lay_out();
        integrator
    }

    /// The net, and what it is at rest.
    pub fn net(&self) -> Option<(&ContactMesh, &AtRest)> {
        self.contact_mesh.as_ref().zip(self.rest.as_ref())
    }

    /// Judge which rocks that have lost contact have the net behind them, as it stands at the start of segment `segment`.
    pub(super) fn judge_partings(&self, model: &Model, state: &mut State, segment: usize, input: &[f64]) {
        let Some(contact_mesh) = &self.contact_mesh else { return };
        for (rock, body) in model.rocks.iter().zip(&mut state.bodies) {
            let Some(direction) = body.track.is_parting(rock, &body.motion) else { continue };
            let at = |n: u32| contact_mesh.nodes[n as usize] + self.fields.displacement(input, segment, n);
            let up = -model.settings.down();
            let mut passed = Outline { contact_mesh, at }.passed(&body.motion.position, &direction, &up);
            if passed.is_some() && state.broken > 0 {
                // A torn net falls: who came into it and is past it now has gone through, whatever is left of it above or below.
                let at_rest = Outline { contact_mesh, at: |n: u32| contact_mesh.nodes[n as usize] };
                let came = body.track.touch.and_then(|touch| at_rest.before(&touch.position, &direction));
                passed = came.map_or(passed, |_| Some(Fate::WentThrough));
            }
            body.track.passed = passed;
        }
    }

    /// How far the net is displaced at the start of a window, at `time` [s], along the impact directions.
    fn elongate(&self, state: &mut State, time: f64, input: &[f64]) {
        let Some(displacements) = self.fields.displacements(input).next() else { return };
        if state.broken > 0 {
            return;
        }
        for body in state.bodies.iter_mut() {
            body.track.elongate(displacements, time);
        }
    }

    /// Rows of the trajectories over terrain in the window solved last.
    pub fn rows(&self) -> &[Row] {
        self.terrain.as_ref().and_then(|t| t.rows.as_deref()).unwrap_or_default()
    }

    /// Work done, by name.
    pub fn counts(&self) -> Vec<(String, u64)> {
        let [found, looked] = self.terrain.as_ref().map(TerrainStage::searches).unwrap_or_default();
        let searches = self.mesh_stages.iter().map(|z| z.pairs.searches).sum::<u64>()
            + found
            + self.rock_stage.searches();
        let near = self.mesh_stages.iter().map(|z| z.refreshes).sum::<u64>() + looked;
        [
            ("sub_steps", self.counts.sub_steps),
            ("flight_windows", self.counts.flight_windows),
            ("flight_steps", self.counts.flight_steps),
            ("contact_evaluations", self.counts.contact_evaluations),
            ("candidate_refreshes", searches),
            ("neighbour_list_refreshes", near),
        ]
        .map(|(name, count)| (name.to_owned(), count))
        .into()
    }

    /// The answer as it would stand at t = 0, with the mesh at rest; also fills in what the state
    /// knows of its contacts.
    pub fn initial(&mut self, model: &Model, state: &mut State, plan: &Plan) -> Result<Vec<f64>, Fault> {
        let input = vec![0.0; self.takes.len()];
        let mut output = vec![0.0; self.gives.len()];
        // A window of no length would have no steps; reach looks as far as the plan's window.
        let length =
            if plan.window > 0.0 && plan.window.is_finite() { plan.window } else { model.steps.step };
        let request = Request { model, input: &input, length };
        self.begin(request, state, &mut output)?;
        if model.ground.is_some() {
            for (number, (rock, body)) in model.rocks.iter().zip(&mut state.bodies).enumerate() {
                body.path.begin(rock, &body.motion, jump_height(model, number, &body.motion));
            }
        }
        self.at_end(request, state, START, None)?;
        for sample in self.answer.means.clone().into_iter().chain(self.answer.ends.clone()) {
            self.at_end(request, state, START, Some((&mut output, sample)))?;
        }
        let gauges = &mut output[self.answer.gauges..];
        self.gauges.begin(gauges);
        self.gauges.take(model, state, Moment::End, gauges);
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
    ) -> Result<Solved, Fault> {
        self.check_request(window, input, output)?;
        output.fill(0.0);
        self.travel = self.travel_at.as_ref().map_or(0.0, |at| input[at.start]);
        self.live = false;
        self.fields.see(input);
        let torn = self.tear(state, input);
        self.elongate(state, window.start, input);
        let request = Request { model, input, length: window.length };
        let flies = self.begin(request, state, output)?;
        if torn {
            self.end_contacts_with_broken(request, state)?;
        }
        let samples = [self.answer.means.len(), self.answer.ends.len(), self.local.own.len()];
        let steps = (model.steps.step, self.usual);
        let cut = Cut::new(window, steps, self.fields.segments(), &samples, state.finer);
        let task = Task { request, window, cut };
        self.live = self.is_local && self.fields.is_partial() && !(flies && model.shortcuts);
        if self.live {
            self.net.begin(&self.local, input, cut.h, &state.pushed);
            if self.net.coarseness > 1.0 {
                return Ok(Solved::TooCoarse);
            }
        }
        self.gauges.begin(&mut output[self.answer.gauges..]);
        let flies = flies && (model.ground.is_some() || self.free_time(model, state, 0.0) > window.length);
        if flies && model.ground.is_none() {
            self.counts.flight_windows += 1;
            self.fly(task, state, 0..cut.steps, output);
        } else {
            self.step_through(task, state, flies, output)?;
        }
        self.gauges.take(model, state, Moment::End, &mut output[self.answer.gauges..]);
        if self.live {
            if self.net.coarseness > 1.0 {
                return Ok(Solved::TooCoarse);
            }
            if self.net.coarseness < 0.4 && state.finer > 1 {
                state.finer /= 2;
            }
        }
        state.time = window.end();
        self.write_free_time(request, state, output);
        self.remember_motion(state, window.length, input);
        if let Some(terrain) = &mut self.terrain {
            terrain.end(model, state);
        }
        Ok(Solved::Done)
    }

    /// Keep where the mesh is said to be at the window's end, if a contact remembers its slip.
    fn remember_motion(&self, state: &mut State, length: f64, input: &[f64]) {
        state.predicted.clear();
        match self.live {
            true => self.net.contact_acceleration(&mut state.pushed),
            false => state.pushed.clear(),
        }
        let remembers = state.bodies.iter().any(|b| !b.histories.is_empty());
        if remembers && self.live {
            state.predicted.extend_from_slice(self.net.displacement());
        } else if remembers {
            self.fields.seen_at_end(input, length, &mut state.predicted);
        }
    }

    /// Take broken lines out of the mesh; true if there are more of them than the state knows.
    fn tear(&mut self, state: &mut State, input: &[f64]) -> bool {
        let (Some(at), Some(contact_mesh)) = (&self.broken, &mut self.contact_mesh) else { return false };
        let flags = &input[at.clone()];
        let lines = self.fields.is_partial().then_some(&self.lines[..]);
        if contact_mesh.tear(flags, lines) {
            self.mesh_stages.iter_mut().for_each(MeshStage::forget);
        }
        let count = contact_mesh.broken.iter().filter(|broken| **broken).count();
        std::mem::replace(&mut state.broken, count) != count
    }

    /// Contacts with lines that are no more end: what their normal springs held is lost. Where something else is touched
    /// in their place and holds more, that is no negative loss.
    fn end_contacts_with_broken(&mut self, request: Request, state: &mut State) -> Result<(), Fault> {
        let held = |state: &State| state.bodies.iter().map(|b| b.elastic).sum::<f64>();
        let before = held(state);
        self.at_end(request, state, START, None)?;
        state.dissipated += (before - held(state)).max(0.0);
        Ok(())
    }

    /// Look around; true if no rock can touch the mesh within the window.
    fn begin(&mut self, request: Request, state: &State, output: &mut [f64]) -> Result<bool, Fault> {
        let Request { model, input, length } = request;
        if let Some(terrain) = &mut self.terrain {
            terrain.begin();
        }
        let Some(contact_mesh) = &self.contact_mesh else { return Ok(model.shortcuts) };
        let view = MeshWindow { travel: self.travel, ..MeshWindow::new(request, contact_mesh, &self.fields) };
        self.half_acceleration =
            if self.is_local { self.net.half_acceleration(&self.local, input) } else { 0.0 };
        let drift = self.half_acceleration * length * length;
        let mut flies = model.shortcuts;
        let bent = |body: &Body| bend(model, body, length);
        self.secondary_impacts.find(model, &self.rock_stage, state, length);
        for ((stage, body), kick) in
            self.mesh_stages.iter_mut().zip(&state.bodies).zip(&self.secondary_impacts.displacements)
        {
            stage.begin(view, &body.motion, *kick + drift + bent(body))?;
            if let Some(reach) = &self.answer.reach {
                stage.mark_reach(view, &body.motion, &mut output[reach.clone()]);
            }
            flies = flies && body.contacts == 0 && !stage.in_reach(view, &body.motion);
        }
        Ok(flies)
    }

    /// True if the smallest and largest values of all steps are asked for.
    pub(super) fn reads_steps(&self, model: &Model) -> bool {
        self.contact_mesh.is_some() || model.ground.is_none()
    }

    fn step_through(
        &mut self,
        task: Task,
        state: &mut State,
        flies: bool,
        output: &mut [f64],
    ) -> Result<(), Fault> {
        let Task { request, cut, .. } = task;
        let model = request.model;
        let (mut step, mut next_try) = (0, 0);
        while step < cut.steps {
            if flies && step >= next_try {
                let most = self.steps_apart(model, state, cut.h, cut.steps - step);
                let clear = match &mut self.terrain {
                    Some(terrain) if most > 0 => terrain.clear_steps(model, state, cut.h, most),
                    _ => 0,
                };
                if clear >= FEWEST.min(cut.steps - step) {
                    self.fly(task, state, step..step + clear, output);
                    step += clear;
                    continue;
                }
                next_try = step + FEWEST;
            }
            let SubSteps { steps, parts } = self.sub_steps(model, state, cut, step);
            for part in 0..parts {
                self.step(SubStep { task, step, steps, part, parts }, state, output)?;
            }
            self.counts.sub_steps += (parts * model.rocks.len()) as u64;
            // Longer stretches are taken only where nobody samples.
            step += steps - 1;
            let samples = self.answer.ends.len();
            if samples > 0 && (step + 1) % (cut.steps / samples) == 0 {
                let sample = self.answer.ends[(step + 1) * samples / cut.steps - 1];
                self.at_end(request, state, cut.end(step), Some((output, sample)))?;
            } else if step + 1 == cut.steps {
                self.at_end(request, state, cut.end(step), None)?;
            }
            if self.reads_steps(model) {
                self.gauges.take(model, state, Moment::Step, &mut output[self.answer.gauges..]);
            }
            step += 1;
        }
        Ok(())
    }

    /// The steps that are taken next, and how they are cut; one where a mesh moves.
    fn sub_steps(&mut self, model: &Model, state: &State, cut: Cut, step: usize) -> SubSteps {
        match (&self.contact_mesh, &mut self.terrain, &self.sides) {
            (None, Some(terrain), None) => terrain.sub_steps(model, &state.bodies, cut.h, cut.steps - step),
            _ => SubSteps::ONE,
        }
    }

    /// Steps of `h` [s], at most `most`, in which no two rocks in flight can touch.
    fn steps_apart(&self, model: &Model, state: &State, h: f64, most: usize) -> usize {
        let time = self.free_time(model, state, FEWEST as f64 * h);
        if time < h * most as f64 { (time / h) as usize } else { most }
    }

    /// Time in which no two rocks, and no rock and a side of the box, can touch in flight [s]; of many rocks 0 where it is below
    /// `least` [s].
    fn free_time(&self, model: &Model, state: &State, least: f64) -> f64 {
        self.rock_stage.free_time(model, state, least).min(box_stage::free_time(model, state))
    }

    /// Contacts and elastic energy at an instant of the state; forces where `field` says.
    fn at_end(
        &mut self,
        request: Request,
        state: &mut State,
        at: Instant,
        mut field: Option<(&mut [f64], usize)>,
    ) -> Result<(), Fault> {
        let model = request.model;
        for (rock, body) in state.bodies.iter_mut().enumerate() {
            let on_terrain =
                self.terrain.as_mut().map_or((0.0, 0), |terrain| terrain.energy(model, rock, body));
            let on_box =
                self.sides.as_mut().map_or((0.0, 0), |sides| sides.energy(model, rock, &body.motion));
            (body.elastic, body.contacts) = (on_terrain.0 + on_box.0, on_terrain.1 + on_box.1);
            self.counts.contact_evaluations += body.contacts as u64;
        }
        if !self.rock_stage.is_empty() {
            self.rock_stage.energy(model, state);
            self.counts.contact_evaluations += state.between_rocks.contacts as u64;
        }
        let Some(contact_mesh) = &self.contact_mesh else { return Ok(()) };
        let (net, travel) = (self.live.then_some(&self.net), self.travel);
        let (fields, at) = (&self.fields, if self.live { at.alone() } else { at });
        let view = MeshWindow { travel, net, ..MeshWindow::new(request, contact_mesh, fields) };
        for (stage, body) in self.mesh_stages.iter_mut().zip(&mut state.bodies) {
            let (on_others, contacts) = (body.elastic, body.contacts);
            stage.update(view, &body.motion, at)?;
            let (evaluation, scene) = stage.parts(view);
            if let Some((output, field)) = &mut field {
                let sums = evaluation.forces(scene, &body.motion, at, 0.0, &body.histories);
                body.elastic = on_others + sums.elastic;
                add_forces(stage, fields, output, *field, 1.0);
            } else {
                body.elastic = on_others + evaluation.energy(scene, &body.motion, at);
            }
            let on_mesh = stage.evaluation.touch.contacts.len();
            body.contacts = contacts + on_mesh;
            self.counts.contact_evaluations += on_mesh as u64;
        }
        Ok(())
    }
}

/// What an integrator takes from one window to the next beside the state, for a run that goes on: lists, and what was counted.
///
/// No answer of a window depends on these lists but for its last bits: by them the order of sums, the ends of flights and the
/// nodes that are selected are the same as in a run that nobody killed.
#[derive(Debug, Serialize, Deserialize)]
pub struct KeptIntegrator {
    mesh: Vec<MeshStage>,
    terrain: Vec<TerrainPairs>,
    /// Which elements of the mesh are broken.
    broken: Vec<bool>,
    half_acceleration: f64,
    coarseness: f64,
    counts: Counts,
}

impl RockIntegrator {
    /// What the next window follows from, and `state` as it is with all nodes selected.
    pub fn kept(&self, state: &State) -> (KeptIntegrator, State) {
        let kept = KeptIntegrator {
            mesh: self.mesh_stages.clone(),
            terrain: self.terrain.as_ref().map_or(Vec::new(), |terrain| terrain.around.clone()),
            broken: self.contact_mesh.as_ref().map_or(Vec::new(), |mesh| mesh.broken.clone()),
            half_acceleration: self.half_acceleration,
            coarseness: self.net.coarseness,
            counts: self.counts,
        };
        let mut state = state.clone();
        let all = 0..self.all.nodes as u32;
        state.select(|node| self.fields.place(node), all, &mut Vec::new());
        (kept, state)
    }

    /// Go on from there.
    pub fn go_on(&mut self, kept: KeptIntegrator) {
        self.mesh_stages.iter_mut().zip(kept.mesh).for_each(|(stage, kept)| stage.go_on(kept));
        if let Some(terrain) = &mut self.terrain {
            terrain.around.clone_from(&kept.terrain);
        }
        if let Some(mesh) = &mut self.contact_mesh {
            mesh.go_on(kept.broken);
        }
        (self.half_acceleration, self.net.coarseness, self.counts) =
            (kept.half_acceleration, kept.coarseness, kept.counts);
    }
}
