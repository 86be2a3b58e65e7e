//! A prepared structure: one window after the other.

mod answer;
mod counts;
mod kept;
mod load_steps;
mod report;
mod retry;

pub use self::counts::Counts;
pub use self::kept::{KeptWindows, other_structure};
use crate::config::Config;
use crate::config::fem::AtBranch;
use crate::config::scheme::Scheme;
use crate::equilibrium::arc_length::Path;
use crate::equilibrium::newton::{Failure, Info, Newton};
use crate::integrator::explicit::Explicit;
use crate::integrator::implicit::Implicit;
use crate::integrator::interface_force::Loads;
use crate::integrator::local::Local;
use crate::integrator::start::Start;
use crate::linear_algebra::lanes::{add, work, work_at};
use crate::model::Model;
use crate::results::energy::Energies;
use crate::results::record::{Largest, Recorder, Step};
use crate::state::{Peak, Peaks, State};
use answer::Answer;
use interface_defs::ipc::interrupt;
use interface_defs::mesh::InterfaceMesh;
use interface_defs::message::{Fault, Plan};
use interface_defs::solver::Window;
use load_steps::Control;
use report::Booked;

/// Explicit steps are no longer than this part of the critical step in windows from the first on in which something broke.
///
/// A load that rises over many steps moves slow modes alone; what a rupture lets go swings in the fastest ones, and wires
/// around it turn slack and taut at every swing. The energy of a mode at an instant is wrong by `(w h / 2)^2` of its kinetic
/// energy: with half the critical step by a quarter, with this step by a sixtieth.
const TORN_SHARE: f64 = 0.125;
/// The scheme in time.
enum Engine {
    Explicit(Box<Explicit>),
    Implicit(Box<Implicit>),
    Path(Box<Path>),
}

impl Engine {
    fn new(model: &Model, config: &Config, newton: Newton) -> Self {
        let settings = config.fem.newton.clone();
        if let Some(speed) = config.fem.path_speed {
            let turns = config.fem.path_at_branch == Some(AtBranch::Turn);
            return Self::Path(Box::new(Path::new(model, settings, speed, turns)));
        }
        match Scheme::of(&config.fem) {
            None => Self::Explicit(Box::new(Explicit::new(model))),
            Some(scheme) => Self::Implicit(Box::new(Implicit::new(model, scheme, settings, newton))),
        }
    }
}

/// What is exchanged with whoever loads the structure, and recorded.
pub struct Exchange<'a> {
    /// Reactions and gauges.
    pub recorder: Recorder,
    /// The interface force.
    pub loads: Loads,
    /// The fields of the run.
    pub plan: &'a Plan,
    /// The interface.
    pub mesh: &'a InterfaceMesh,
    /// Whether windows in which nothing loads or moves the structure are skipped.
    pub shortcuts: bool,
}

/// Everything that a window needs.
pub struct WindowSolver {
    engine: Engine,
    energies: Energies,
    recorder: Recorder,
    loads: Loads,
    /// State at the start of the window at hand.
    pub committed: State,
    trial: State,
    /// Displacement at t = 0 [m].
    pub origin: Vec<f64>,
    rest_force: Vec<f64>,
    nodes: usize,
    time_step: f64,
    /// Longest explicit step once something has broken [s].
    torn_step: f64,
    /// Largest share of its strength that anything used as it broke in an implicit step of the window.
    broke_under: f64,
    /// Load steps of statics that adapt.
    load_steps: Option<Box<Control>>,
    shortcuts: bool,
    skipped: bool,
    answer: Answer,
    /// Whether the explicit scheme has had a load since the selection changed.
    loaded: bool,
    /// What a contact solver needs to move nodes itself, if it asks for that.
    local: Option<Box<Local>>,
    /// Travel of the interface nodes [m] and all numbers of the gauges, of the window solved last and of that accepted last.
    booked: [Booked; 2],
    parts: usize,
    energy_now: Vec<f64>,
    part_start: Vec<f64>,
    end_loads: Vec<f64>,
    /// What was done so far.
    pub counts: Counts,
}

impl WindowSolver {
    /// For `model` from `start`, between the structure and whoever loads it.
    pub fn new(model: &Model, config: &Config, start: Start, exchange: Exchange) -> Self {
        let Exchange { recorder, loads, plan, mesh, shortcuts } = exchange;
        let answer = Answer::new(plan, mesh);
        let n = model.dof_count();
        let scheme = Scheme::of(&config.fem);
        let mut local = Local::new(model, plan, scheme.map(|_| start.time_step.min(plan.window)));
        local.iter_mut().for_each(|local| local.locate(|field| answer.place(field)));
        let loads_parts = loads.parts();
        let ends = if loads.has_end() { n } else { 0 };
        let committed = first_state(model, config, &start, &recorder, ends);
        let torn_step = match scheme {
            None => start.time_step.min(TORN_SHARE * start.critical_step),
            Some(_) => start.time_step,
        };
        let done = start.form_finding;
        Self {
            energies: Energies::new(model, scheme.is_none_or(|s| s.inertia)),
            engine: Engine::new(model, config, start.newton),
            recorder: recorder.at_end(scheme.is_some_and(|s| !s.inertia)),
            loads,
            load_steps: Control::new(&config.fem, &committed, model),
            trial: State { events: Vec::with_capacity(model.elements.len()), ..committed.clone() },
            nodes: model.node_count(),
            committed,
            origin: start.form.displacement,
            rest_force: start.force,
            time_step: if start.torn { torn_step } else { start.time_step },
            torn_step,
            broke_under: 0.0,
            shortcuts,
            skipped: false,
            booked: Default::default(),
            parts: least_common_multiple(loads_parts, answer.parts()),
            answer,
            loaded: false,
            local,
            energy_now: Vec::with_capacity(12),
            part_start: vec![0.0; n],
            end_loads: vec![0.0; n],
            counts: Counts {
                newton: done.iterations,
                factorisations: done.factorisations,
                ..Counts::default()
            },
        }
    }

    /// The answer as it stands at t = 0.
    pub fn initial(&mut self, model: &Model, output: &mut [f64]) {
        // Where a path does not begin at all, its first step says so.
        if let Engine::Path(path) = &mut self.engine
            && path.begin(model, &mut self.trial).is_ok()
        {
            self.counts.factorisations += path.corrector.info.factorisations;
            self.committed.copy_from(&self.trial);
        }
        self.rest(model, 0.0, 1.0);
        self.committed.groups.copy_from_slice(&self.trial.groups);
        self.answer.write_all(&self.trial, &self.origin, output);
        self.write_gauges(model, output);
        self.write_travel_and_local(model, 0.0, output);
        let [now, before] = &mut self.booked;
        before.clone_from(now);
        self.recorder.begin();
    }

    /// Advance the committed state over `window` under `input`, into the trial state and `output`.
    pub fn solve(
        &mut self,
        model: &Model,
        window: &Window,
        input: &[f64],
        output: &mut [f64],
    ) -> Result<(), Fault> {
        self.trial.copy_from(&self.committed);
        let rests = || model.rests(window.start, window.end());
        self.skipped = self.shortcuts && self.committed.at_rest && !self.loads.any(input) && rests();
        if self.skipped {
            self.rest(model, window.end(), window.length);
            self.answer.write_all(&self.trial, &self.origin, output);
        } else {
            self.trial.at_rest = false;
            self.advance(model, window, input, output)?;
        }
        self.write_gauges(model, output);
        self.write_travel_and_local(model, window.end(), output);
        if self.energy_now.iter().all(|e| e.is_finite()) {
            return Ok(());
        }
        Err(Fault::window(format!(
            "window {} from {:.6e} s diverged: its energy is not finite after steps of at most {:.3e} s; the force on the \
             structure or its time step is too large",
            window.number, window.start, self.time_step
        )))
    }

    /// Nothing happens for a time of `length` until `end`.
    fn rest(&mut self, model: &Model, end: f64, length: f64) {
        self.recorder.begin();
        let (mut peaks, mut groups) = (self.trial.peaks, std::mem::take(&mut self.trial.groups));
        let (force, middle) = (&self.rest_force, &self.trial.displacement);
        let step = Step { end, length, force, middle, at: end, tension: 0.0 };
        let largest = &mut Largest { peaks: &mut peaks, groups: &mut groups };
        self.recorder.step(model, &self.trial, &step, largest);
        self.trial.groups = groups;
    }

    fn advance_by(
        &mut self,
        model: &Model,
        window: &Window,
        input: &[f64],
        output: &mut [f64],
        (longest, finer): (f64, usize),
    ) -> Result<(), Fault> {
        self.recorder.begin();
        self.broke_under = 0.0;
        (self.trial.along.lowest, self.trial.along.highest) = (self.trial.factor, self.trial.factor);
        let part = Window { length: window.length / self.parts as f64, ..*window };
        let own = if self.load_steps.is_some() { 1 } else { part.steps(longest) };
        let steps = own * self.parts * finer;
        let h = window.length / steps as f64;
        let per_load = steps / self.loads.parts();
        let fault =
            |what| Fault::window(format!("window {} from {:.6e} s{what}", window.number, window.start));
        for step in 0..steps {
            if interrupt::requested() {
                return Err(Fault::interrupted());
            }
            let (time, end) = (window.start + step as f64 * h, window.start + (step + 1) as f64 * h);
            if step % per_load == 0 {
                self.loads.begin_part(input, step / per_load, &self.answer.shown, &self.trial.load);
                if step > 0 && matches!(self.engine, Engine::Explicit(_)) {
                    match self.answer.shown.dofs() {
                        None => self.part_start.copy_from_slice(&self.trial.displacement),
                        Some(dofs) => dofs.iter().map(|dof| *dof as usize).for_each(|dof| {
                            self.part_start[dof] = self.trial.displacement[dof];
                        }),
                    }
                }
            }
            if matches!(self.engine, Engine::Path(_)) {
                self.along_path(model, time, end).map_err(|what| fault(format!(": {what}")))?;
                self.answer.write((step + 1, steps), &self.trial, &self.origin, output);
                continue;
            }
            if self.load_steps.is_some() {
                let place = (step % per_load, per_load);
                self.by_load_steps(model, (time, end), place).map_err(|what| fault(format!(": {what}")))?;
                self.answer.write((step + 1, steps), &self.trial, &self.origin, output);
                continue;
            }
            let tension = self.step(model, time, h, step % per_load, per_load).map_err(|what| {
                let step = step + 1;
                fault(format!(", step {step} of {steps}: {what}; a shorter window or fem.time_step may do"))
            })?;
            if (step + 1) % per_load == 0 && matches!(self.engine, Engine::Explicit(_)) {
                self.book_mean_work(step < per_load);
            }
            self.record(model, end, h, tension);
            self.answer.write((step + 1, steps), &self.trial, &self.origin, output);
        }
        if !matches!(self.engine, Engine::Path(_)) && self.load_steps.is_none() {
            self.counts.steps += steps as u64;
        }
        Ok(())
    }

    /// One step; returns the largest tension in it.
    fn step(&mut self, model: &Model, time: f64, h: f64, step: usize, steps: usize) -> Result<f64, String> {
        match &mut self.engine {
            Engine::Explicit(explicit) => {
                if step == 0 {
                    explicit.load(model, self.loads.mean(), self.answer.shown.dofs().filter(|_| self.loaded));
                    self.loaded = true;
                }
                Ok(explicit.step(model, &mut self.trial, time, h).sqrt())
            }
            Engine::Path(_) => unreachable!("a path has steps of its own"),
            Engine::Implicit(_) => self
                .implicit_step(model, time, h, |x| (step as f64 + x) / steps as f64)
                .map(|(tension, _)| tension)
                .map_err(|failure| failure.describe(model)),
        }
    }

    /// One implicit step, whose begin and end, at 0 and 1, are these shares of the part of the window; returns the largest tension in it, and the
    /// iterations.
    fn implicit_step(
        &mut self,
        model: &Model,
        time: f64,
        h: f64,
        share: impl Fn(f64) -> f64,
    ) -> Result<(f64, Info), Failure> {
        let Engine::Implicit(implicit) = &mut self.engine else { return Err(Failure::Unstable { dof: 0 }) };
        self.part_start.copy_from_slice(&self.trial.displacement);
        let scheme = implicit.scheme;
        let load = self.loads.between(&scheme, share);
        let (largest, info) = implicit.step(model, &mut self.trial, &load, time, h)?;
        self.counts.newton += info.iterations;
        if let Some(dof) = info.shifted_at {
            if self.counts.shifted == 0 {
                tracing::warn!(
                    "t = {time:.6e} s: the tangent is not positive, first at {}; it is shifted (reported once)",
                    model.dof_name(dof)
                );
            }
            self.counts.shifted += 1;
        }
        self.counts.unstable += u64::from(info.unstable.is_some());
        self.counts.unstable_at = self.counts.unstable_at.or(info.unstable);
        self.counts.factorisations += info.factorisations;
        self.counts.kept_factors += info.kept_factors;
        self.broke_under = self.broke_under.max(implicit.broke_under());
        let (after, before) = (&self.trial.displacement, &self.part_start);
        if scheme.takes_mean_only() {
            self.trial.received += work(load.balance, after, before);
        } else if !self.trial.load.is_empty() {
            // The mean of both ends, as the trapezoidal rule does its work.
            add(&mut self.end_loads, &self.trial.load, load.end);
            self.trial.received += 0.5 * work(&self.end_loads, after, before);
            self.trial.load.copy_from_slice(load.end);
        }
        Ok((largest.sqrt(), info))
    }

    /// Along the path of equilibrium from `time` to `end`, by as many steps as it takes.
    fn along_path(&mut self, model: &Model, mut time: f64, end: f64) -> Result<(), String> {
        while time < end {
            let Engine::Path(path) = &mut self.engine else { return Ok(()) };
            let taken = path
                .step(model, &mut self.trial, time, end - time)
                .map_err(|failure| format!("t = {time:.6e} s: {}", failure.describe(model)))?;
            self.counts.newton += taken.info.iterations;
            self.counts.factorisations += taken.info.factorisations;
            self.counts.refused += taken.refused;
            self.counts.steps += 1;
            let h = taken.length;
            time = if h >= end - time { end } else { time + h };
            self.record(model, time, h, taken.tension.sqrt());
        }
        Ok(())
    }

    /// Work of the mean force over the part of the window that has just ended: exactly `F . du`.
    fn book_mean_work(&mut self, first_part: bool) {
        let before = if first_part { &self.committed.displacement } else { &self.part_start };
        let (force, after) = (self.loads.mean(), &self.trial.displacement);
        self.trial.received += match self.answer.shown.dofs() {
            None => work(force, after, before),
            Some(dofs) => work_at(dofs, force, after, before),
        };
    }

    fn record(&mut self, model: &Model, end: f64, h: f64, tension: f64) {
        let (mut peaks, mut groups) = (self.trial.peaks, std::mem::take(&mut self.trial.groups));
        let middle_of_step = end - 0.5 * h;
        let (force, middle, at) = match &self.engine {
            Engine::Explicit(e) => (&e.force[..], &e.middle[..], middle_of_step),
            // Statics knows no way between two states: what it reports is the state at the end.
            Engine::Implicit(i) if !i.scheme.inertia => {
                (&self.trial.force[..], &self.trial.displacement[..], end)
            }
            Engine::Implicit(i) => (&i.force[..], &i.middle[..], middle_of_step),
            Engine::Path(p) => (&p.corrector.force[..], &self.trial.displacement[..], end),
        };
        let step = Step { end, length: h, force, middle, at, tension };
        let largest = &mut Largest { peaks: &mut peaks, groups: &mut groups };
        self.recorder.step(model, &self.trial, &step, largest);
        (self.trial.peaks, self.trial.groups) = (peaks, groups);
    }

    /// State at the end of the window solved last.
    pub fn solved(&self) -> &State {
        &self.trial
    }

    /// Accept the last window.
    pub fn commit(&mut self) {
        std::mem::swap(&mut self.committed, &mut self.trial);
        self.booked.swap(0, 1);
        self.recorder.commit();
        self.counts.skipped += u64::from(self.skipped);
    }
}

/// The state at t = 0, with memory for `ends` numbers of interface force.
fn first_state(model: &Model, config: &Config, start: &Start, recorder: &Recorder, ends: usize) -> State {
    let (n, scheme) = (model.dof_count(), Scheme::of(&config.fem));
    let balances_at_end = scheme.is_some_and(|s| !s.takes_mean_only());
    let mut velocity = model.start_velocity.clone();
    let thrown = velocity.iter().any(|v| *v != 0.0);
    velocity.resize(n, 0.0);
    start.motion.iter().for_each(|motion| motion.add_to(&mut velocity));
    let mut state = State {
        displacement: start.form.displacement.clone(),
        velocity,
        acceleration: vec![0.0; if scheme.is_some() { n } else { 0 }],
        force: if balances_at_end { start.force.clone() } else { Vec::new() },
        load: vec![0.0; ends],
        at_rest: start.at_rest && !thrown && config.fem.path_speed.is_none(),
        history: start.form.history.clone(),
        groups: recorder.groups(),
        events: Vec::with_capacity(model.elements.len()),
        ..State::default()
    };
    if scheme.is_some_and(|s| s.inertia) && (thrown || !start.at_rest) {
        // The first step of an implicit scheme starts from a balance of its own.
        for dof in (0..n).filter(|dof| !model.held_first(*dof)) {
            let damped = model.damping * state.velocity[dof];
            state.acceleration[dof] = start.force[dof] / model.dof_mass(dof) - damped;
        }
        for (dof, viscosity) in model.dashpots.iter().filter(|(dof, _)| !model.held_first(*dof)) {
            state.acceleration[*dof] -= viscosity * state.velocity[*dof] / model.dof_mass(*dof);
        }
    }
    start.motion.iter().filter(|_| !thrown).for_each(|motion| motion.keep(&mut state.acceleration));
    state.open_books(start.booked);
    let reaction = recorder.total_reaction(&start.force, &start.form.displacement);
    let at_start = |value| Peak { value, time: 0.0 };
    let size = at_start(reaction.iter().map(|r| r * r).sum::<f64>().sqrt());
    state.peaks = Peaks { reaction: size, reaction_1ms: size, cable_force: at_start(start.cable_force) };
    state
}

fn least_common_multiple(a: usize, b: usize) -> usize {
    let (mut x, mut y) = (a, b);
    while y != 0 {
        (x, y) = (y, x % y);
    }
    a / x * b
}
