//! A prepared structure: one window after the other.

mod answer;
mod counts;

pub use self::counts::Counts;
use crate::config::fem::{AtBranch, LoadSteps};
use crate::config::scheme::Scheme;
use crate::config::{Config, FemConfig};
use crate::element::{FAR, NEAR};
use crate::equilibrium::arc_length::Path;
use crate::equilibrium::newton::{Failure, Info, Newton};
use crate::integrator::explicit::Explicit;
use crate::integrator::implicit::Implicit;
use crate::integrator::interface_force::Loads;
use crate::integrator::local::Local;
use crate::integrator::start::Start;
use crate::internal_force::assembly::take_largest;
use crate::internal_force::line_contact::LineContact;
use crate::linear_algebra::lanes::{add, add_to, work, work_at};
use crate::model::Model;
use crate::results::energy::Energies;
use crate::results::moving_mean::{MovingMean, Sample};
use crate::results::record::{Recorder, Step};
use crate::state::{Peak, Peaks, State};
use answer::{WindowAnswer, travel};
use interface_defs::Utilisation;
use interface_defs::diagnostic::{Diagnostic, code};
use interface_defs::field::name;
use interface_defs::ipc::interrupt;
use interface_defs::mesh::InterfaceMesh;
use interface_defs::message::{Fault, FaultKind, Plan};
use interface_defs::selection::Selection;
use interface_defs::solver::Window;
use num_integer::lcm;
use serde::{Deserialize, Serialize};
use std::ops::Range;
use std::rc::Rc;

/// Explicit steps are no longer than this part of the critical step in windows from the first on in which something broke.
///
/// A load that rises over many steps moves slow modes alone; what a rupture lets go swings in the fastest ones, and wires
/// around it turn slack and taut at every swing. The energy of a mode at an instant is wrong by `(w h / 2)^2` of its kinetic
/// energy: with half the critical step by a quarter, with this step by a sixtieth.
///
/// Before, too, in windows that begin with more than [`FAR`] of any strength used, or come to use more than [`NEAR`] of it: when it
/// breaks depends on how its tension swings in the fastest modes. Measured on a net of cables (0.3 m): with half the critical
/// step it tore 0.37 ms late and the reaction was 10 % too large, with this step within 0.02 ms and 1.2 %.
const TORN_SHARE: f64 = 0.125;
/// A window in which Newton fails is cut into at most so many times the steps before it is given up.
const FINEST: usize = 8;

/// An implicit step ends where something breaks: a window in which that used more of its strength than all of it and this
/// part is cut into more steps.
const BREAKS_WITHIN: f64 = 0.01;
/// At most so many times the steps.
const FINEST_TORN: usize = 64;

/// Steps that are longer than what is left by less than this share are as long.
const SAME: f64 = 1e-9;

/// Shares of the iterations that are allowed up to which the next load step is twice as long, and up to which it is as long.
const FAST: f64 = 0.3;
const SLOW: f64 = 0.5;

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

/// Exchange with the solver that loads the structure, and records.
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

/// Load-step control.
struct Control {
    settings: LoadSteps,
    /// Most iterations of a step.
    most: f64,
    /// State at the start of the step at hand.
    fallback: State,
}

impl Control {
    /// As the scene says; `state` is one of the structure.
    fn new(fem: &FemConfig, state: &State, model: &Model) -> Option<Box<Self>> {
        let settings = fem.load_steps?;
        let most = f64::from(fem.newton.most_iterations());
        let fallback = with_room(state.clone(), model);
        Some(Box::new(Self { settings, most, fallback }))
    }

    /// Length of the next step over that of one of so many iterations.
    fn growth(&self, iterations: u64) -> f64 {
        match iterations as f64 / self.most {
            share if share <= FAST => 2.0,
            share if share <= SLOW => 1.0,
            _ => 0.5,
        }
    }
}

/// Numbers of an answer that its state does not hold: those of the way to it.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
struct Booked {
    /// Largest distance that an interface node has moved [m]; 0 where nobody asks.
    travel: f64,
    /// All numbers of the gauges.
    gauges: Vec<f64>,
}

/// The committed state, and what was booked and counted by then.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct KeptWindows {
    committed: State,
    booked: Booked,
    /// Impulse of the supports within each mean of the reaction.
    impulses: Vec<Vec<Sample>>,
    counts: Counts,
}

/// Everything that a window needs.
pub struct WindowSolver {
    model: Rc<Model>,
    engine: Engine,
    energies: Energies,
    recorder: Recorder,
    loads: Loads,
    /// State at the start of the window at hand.
    pub committed: State,
    /// State at the end of the window solved last.
    pub trial: State,
    /// Displacement at t = 0 [m].
    pub origin: Vec<f64>,
    rest_force: Vec<f64>,
    time_step: f64,
    /// Longest explicit step once something has broken [s].
    torn_step: f64,
    /// Largest share of its strength that anything used as it broke in an implicit step of the window.
    broke_under: f64,
    /// Load steps of statics that adapt.
    load_steps: Option<Box<Control>>,
    shortcuts: bool,
    skipped: bool,
    answer: WindowAnswer,
    /// Whether the explicit scheme has had a load since the selection changed.
    loaded: bool,
    /// Data for a contact solver that moves nodes itself, if it asks for that.
    local: Option<Box<Local>>,
    /// Travel of the interface nodes [m] and all numbers of the gauges, of the window solved last and of that accepted last.
    booked: [Booked; 2],
    parts: usize,
    energy_now: Vec<f64>,
    part_start: Vec<f64>,
    end_loads: Vec<f64>,
    /// Work done so far.
    pub counts: Counts,
}

impl WindowSolver {
    /// For `model` from `start`, between the structure and whoever loads it.
    pub fn new(model: &Rc<Model>, config: &Config, start: Start, exchange: Exchange) -> Self {
        let Exchange { mut recorder, loads, plan, mesh, shortcuts } = exchange;
        let answer = WindowAnswer::new(plan, mesh);
        let n = model.dof_count();
        let scheme = Scheme::of(&config.fem);
        recorder.at_end = scheme.is_some_and(|s| !s.inertia);
        let local = Local::new(model, plan, scheme.map(|_| start.time_step.min(plan.window)));
        let ends = if loads.has_end() { n } else { 0 };
        let committed = first_state(model, config, &start, &recorder, ends);
        let torn_step = match scheme {
            None => start.time_step.min(TORN_SHARE * start.critical_step),
            Some(_) => start.time_step,
        };
        let done = start.form_finding;
        Self {
            model: model.clone(),
            energies: Energies::new(model, scheme.is_none_or(|s| s.inertia)),
            engine: Engine::new(model, config, start.newton),
            recorder,
            load_steps: Control::new(&config.fem, &committed, model),
            trial: with_room(committed.clone(), model),
            committed,
            origin: start.form.displacement,
            rest_force: start.force,
            time_step: if start.torn { torn_step } else { start.time_step },
            torn_step,
            broke_under: 0.0,
            shortcuts,
            skipped: false,
            booked: Default::default(),
            parts: lcm(loads.parts(), answer.parts()),
            loads,
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
    pub fn initial(&mut self, output: &mut [f64]) {
        // Where a path does not begin at all, its first step says so.
        if let Engine::Path(path) = &mut self.engine
            && path.begin(&self.model, &mut self.trial).is_ok()
        {
            self.counts.factorisations += path.corrector.info.factorisations;
            self.committed.copy_from(&self.trial);
        }
        self.rest(0.0, 1.0);
        self.committed.groups.copy_from_slice(&self.trial.groups);
        self.answer.write_all(&self.trial, &self.origin, output);
        self.write_gauges(output);
        self.write_travel_and_local(0.0, output);
        let [now, before] = &mut self.booked;
        before.clone_from(now);
        self.recorder.begin();
    }

    /// Advance the committed state over `window` under `input`, into the trial state and `output`.
    pub fn solve(&mut self, window: &Window, input: &[f64], output: &mut [f64]) -> Result<(), Fault> {
        self.trial.copy_from(&self.committed);
        let rests = || self.model.rests(window.start, window.end());
        self.skipped = self.shortcuts && self.committed.at_rest && !self.loads.any(input) && rests();
        if self.skipped {
            self.rest(window.end(), window.length);
            self.answer.write_all(&self.trial, &self.origin, output);
        } else {
            self.trial.at_rest = false;
            self.advance(window, input, output)?;
        }
        self.write_gauges(output);
        self.write_travel_and_local(window.end(), output);
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
    fn rest(&mut self, end: f64, length: f64) {
        self.recorder.begin();
        self.record(end, length, None, true);
    }

    /// Advance over the window; where Newton fails, again from its start with twice the steps. Where something breaks in it
    /// for the first time, again with the steps of a torn structure; where that is far beyond its strength, with more.
    fn advance(&mut self, window: &Window, input: &[f64], output: &mut [f64]) -> Result<(), Fault> {
        let mut finer = 1;
        let mut longest = self.longest_step(&self.committed, FAR);
        loop {
            match self.advance_by(window, input, output, (longest, finer)) {
                Ok(()) => {
                    let torn = self.longest_step(&self.trial, NEAR);
                    let late = ((self.broke_under - 1.0) / BREAKS_WITHIN).clamp(0.0, FINEST_TORN as f64);
                    // In statics a step is what the scene makes it.
                    let moves = matches!(&self.engine, Engine::Implicit(implicit) if implicit.scheme.inertia);
                    if torn < longest {
                        longest = torn;
                    } else if late > 1.0 && finer < FINEST_TORN && moves {
                        finer = (finer * (late.ceil() as usize).next_power_of_two()).min(FINEST_TORN);
                    } else {
                        if late > 1.0 {
                            self.counts.late = self.counts.late.max(self.broke_under);
                        }
                        return Ok(());
                    }
                }
                Err(fault)
                    if fault.kind == FaultKind::Interrupted
                        || finer >= FINEST
                        || self.load_steps.is_some()
                        || !matches!(self.engine, Engine::Implicit(_)) =>
                {
                    return Err(fault);
                }
                Err(_) => {
                    finer *= 2;
                    self.counts.refined += 1;
                }
            }
            self.trial.copy_from(&self.committed);
            self.trial.at_rest = false;
        }
    }

    /// The longest step from a state in which something is torn, or uses more than this share of its strength, or not [s].
    fn longest_step(&self, state: &State, near: f64) -> f64 {
        if state.used > near || !state.events.is_empty() { self.torn_step } else { self.time_step }
    }

    fn advance_by(
        &mut self,
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
        for step in 0..steps {
            if interrupt::requested() {
                return Err(Fault::interrupted());
            }
            let (time, end) = (window.start + step as f64 * h, window.start + (step + 1) as f64 * h);
            let place = step % per_load;
            if place == 0 {
                self.begin_part(input, step / per_load);
            }
            let of_step = |what| {
                format!(", step {} of {steps}: {what}; a shorter window or fem.time_step may do", step + 1)
            };
            let taken = match &mut self.engine {
                Engine::Path(_) => {
                    self.along_path((time, end), step + 1 == steps).map_err(|what| format!(": {what}"))
                }
                Engine::Implicit(_) if self.load_steps.is_some() => {
                    self.by_load_steps((time, end), (place, per_load)).map_err(|what| format!(": {what}"))
                }
                Engine::Implicit(_) => self
                    .implicit_step(time, h, |x| (place as f64 + x) / per_load as f64)
                    .map(|(tension, _)| self.record(end, h, Some(tension), step + 1 == steps))
                    .map_err(|failure| of_step(failure.describe(&self.model))),
                Engine::Explicit(explicit) => {
                    let tension = explicit.step(&self.model, &mut self.trial, time, h).sqrt();
                    if place + 1 == per_load {
                        self.book_mean_work(step < per_load);
                    }
                    self.record(end, h, Some(tension), step + 1 == steps);
                    Ok(())
                }
            };
            taken.map_err(|what| {
                Fault::window(format!("window {} from {:.6e} s{what}", window.number, window.start))
            })?;
            self.answer.write((step + 1, steps), &self.trial, &self.origin, output);
        }
        if let Engine::Explicit(explicit) = &mut self.engine {
            if let Some(what) = explicit.internal.contact.as_mut().and_then(LineContact::too_deep) {
                let (number, start) = (window.number, window.start);
                return Err(Fault::window(format!("window {number} from {start:.6e} s: {what}")));
            }
            let elements = &mut explicit.internal.elements;
            self.trial.used = std::mem::take(&mut elements.used);
            elements.close.drain(..).for_each(|close| take_largest(&mut self.trial.close, close));
            let State { displacement, history, close, spared, .. } = &mut self.trial;
            elements.spare(&self.model.elements, (displacement, history), [close, spared]);
        }
        if !matches!(self.engine, Engine::Path(_)) && self.load_steps.is_none() {
            self.counts.steps += steps as u64;
        }
        Ok(())
    }

    /// Part number `part` of the window begins, which has a load of its own.
    fn begin_part(&mut self, input: &[f64], part: usize) {
        self.loads.begin_part(input, part, &self.answer.shown, &self.trial.load);
        let Engine::Explicit(explicit) = &mut self.engine else { return };
        let dofs = self.answer.shown.dofs();
        match dofs {
            _ if part == 0 => (),
            None => self.part_start.copy_from_slice(&self.trial.displacement),
            Some(dofs) => dofs.iter().map(|dof| *dof as usize).for_each(|dof| {
                self.part_start[dof] = self.trial.displacement[dof];
            }),
        }
        explicit.load(&self.model, self.loads.mean(), dofs.filter(|_| self.loaded));
        self.loaded = true;
    }

    /// One implicit step, whose begin and end, at 0 and 1, are these shares of the part of the window; returns the largest
    /// tension in it, and the iterations.
    fn implicit_step(
        &mut self,
        time: f64,
        h: f64,
        share: impl Fn(f64) -> f64,
    ) -> Result<(f64, Info), Failure> {
        let Engine::Implicit(implicit) = &mut self.engine else { return Err(Failure::Unstable { dof: 0 }) };
        self.part_start.copy_from_slice(&self.trial.displacement);
        let scheme = implicit.scheme;
        let load = self.loads.between(&scheme, share);
        let (largest, info) = implicit.step(&self.model, &mut self.trial, &load, time, h)?;
        if let Some(dof) = info.shifted_at
            && self.counts.shifted == 0
        {
            tracing::warn!(
                "t = {time:.6e} s: the tangent is not positive, first at {}; it is shifted (reported once)",
                self.model.dof_name(dof)
            );
        }
        self.counts.add(&info);
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

    /// Statics from `start` to `end` [s], part number `place.0` of `place.1` of what one load covers, by load steps as long as
    /// Newton is fast; those that fail are halved.
    fn by_load_steps(
        &mut self,
        (start, end): (f64, f64),
        (part, parts): (usize, usize),
    ) -> Result<(), String> {
        let Some(mut control) = self.load_steps.take() else { return Ok(()) };
        let settings = control.settings;
        let place = |time: f64| (part as f64 + (time - start) / (end - start)) / parts as f64;
        let (mut time, mut outcome) = (start, Ok(()));
        while time < end && outcome.is_ok() {
            let remaining = end - time;
            let stride = match self.trial.along.stride {
                0.0 => settings.first,
                stride => stride,
            }
            .min(self.time_step);
            let h = match remaining / stride {
                steps if steps <= 1.0 + SAME => remaining,
                // Two halves rather than a whole step and a very short one.
                steps if steps < 2.0 => 0.5 * remaining,
                _ => stride,
            };
            let next = if h >= remaining { end } else { time + h };
            control.fallback.copy_from(&self.trial);
            match self.implicit_step(time, h, |x| place(time) + x * (place(next) - place(time))) {
                Ok((tension, info)) => {
                    let growth = control.growth(info.iterations);
                    // A row of output that cuts a step short leaves the length of the next.
                    let longest = if growth >= 1.0 && h < stride { stride } else { growth * h };
                    self.trial.along.stride = longest.max(settings.shortest());
                    self.counts.steps += 1;
                    self.record(next, h, Some(tension), next >= end && part + 1 == parts);
                    time = next;
                }
                Err(failure) => {
                    self.trial.copy_from(&control.fallback);
                    self.counts.refused += 1;
                    let half = 0.5 * h;
                    self.trial.along.stride = half;
                    if half < settings.shortest() {
                        let (least, why) = (settings.shortest(), failure.describe(&self.model));
                        outcome = Err(format!(
                            "statics ends at t = {time:.6e} s, the last equilibrium: from there no load step of {h:.3e} s, and \
                             fem.load_steps allows none below {least:.3e} s. {why}; where the structure snaps or buckles, \
                             fem.path_speed follows it"
                        ));
                    }
                }
            }
        }
        self.load_steps = Some(control);
        outcome
    }

    /// Along the path of equilibrium from `time` to `end`, which may be that of the window, by as many steps as it takes.
    fn along_path(&mut self, (mut time, end): (f64, f64), last: bool) -> Result<(), String> {
        while time < end {
            let Engine::Path(path) = &mut self.engine else { return Ok(()) };
            let taken = path
                .step(&self.model, &mut self.trial, time, end - time)
                .map_err(|failure| format!("t = {time:.6e} s: {}", failure.describe(&self.model)))?;
            self.counts.add(&taken.info);
            self.counts.refused += taken.refused;
            self.counts.steps += 1;
            let h = taken.length;
            time = if h >= end - time { end } else { time + h };
            self.record(time, h, Some(taken.tension.sqrt()), last && time >= end);
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

    /// A step of length `h` that ends at `end` is done, with the largest tension in it; none where nothing has happened. It may
    /// be the `last` of its window: then the tensions at its end come with the energies.
    fn record(&mut self, end: f64, h: f64, tension: Option<f64>, last: bool) {
        let (mut peaks, mut groups) = (self.trial.peaks, std::mem::take(&mut self.trial.groups));
        let (displacement, middle_of_step) = (&self.trial.displacement[..], end - 0.5 * h);
        let (mut force, mut middle, mut at, internal) = match &mut self.engine {
            Engine::Explicit(e) => (&e.force[..], &e.middle[..], middle_of_step, &mut e.internal),
            // Statics knows no way between two states: what it reports is the state at the end.
            Engine::Implicit(i) if !i.scheme.inertia => {
                (&self.trial.force[..], displacement, end, &mut i.newton.internal)
            }
            Engine::Implicit(i) => (&i.force[..], &i.middle[..], middle_of_step, &mut i.newton.internal),
            Engine::Path(p) => (&p.corrector.force[..], displacement, end, &mut p.corrector.internal),
        };
        if tension.is_none() {
            (force, middle, at) = (&self.rest_force, displacement, end);
        }
        if last {
            internal.elements.follow(&mut self.trial.used_parts, end);
            internal.elements.note_sections(
                &self.model.elements,
                &self.trial.displacement,
                &self.trial.history,
            );
            internal.elements.follow(&mut self.trial.used_parts, end);
            self.energies.of(&self.model, internal, &self.trial, &mut self.energy_now);
        } else {
            internal.elements.begin_reading();
        }
        let step = Step { end, length: h, force, middle, at, tension: tension.unwrap_or(0.0) };
        let there = (&self.trial, &mut internal.elements);
        self.recorder.step(&self.model, there, &step, &mut peaks, &mut groups);
        self.trial.groups = groups;
        if tension.is_some() {
            self.trial.peaks = peaks;
        }
    }

    /// Accept the last window.
    pub fn commit(&mut self) {
        std::mem::swap(&mut self.committed, &mut self.trial);
        self.booked.swap(0, 1);
        self.recorder.means.iter_mut().for_each(MovingMean::commit);
        self.counts.skipped += u64::from(self.skipped);
    }

    /// Energies at the window's end, reactions and scene gauges over the window.
    fn write_gauges(&mut self, output: &mut [f64]) {
        let gauges = &mut output[self.answer.layout.len()..];
        let (triples, _) = gauges.as_chunks_mut::<3>();
        for (triple, energy) in triples.iter_mut().zip(&self.energy_now) {
            *triple = [*energy; 3];
        }
        if let (Engine::Path(_), [.., factor, _]) = (&self.engine, &mut triples[..self.energy_now.len()]) {
            let along = &self.trial.along;
            *factor = [factor[0], along.lowest.min(factor[0]), along.highest.max(factor[0])];
        }
        self.recorder.write(&mut gauges[3 * self.energy_now.len()..]);
        self.booked[0].gauges.clear();
        self.booked[0].gauges.extend_from_slice(gauges);
    }

    /// From now on inputs and answers are laid out for `selection`, or for the whole interface mesh. Names the pairs of nodes
    /// that the tangent couples, where a plan asks for it.
    pub fn select(&mut self, mut selection: Option<&mut Selection>) {
        match (&mut self.local, selection.as_deref_mut()) {
            (Some(local), selection) => local.select(&self.model, selection),
            (None, Some(selection)) => selection.pairs.clear(),
            (None, None) => (),
        }
        let selected = selection.map(|s| (&s.nodes[..], s.items()));
        self.loads.select(&selected.map_or(self.answer.whole, |(_, items)| items));
        self.answer.select(selected);
        self.loaded = false;
    }

    /// Write the committed state, reached at `time` [s], to `output`, as every sample of a window.
    pub fn write_committed(&mut self, time: f64, output: &mut [f64]) {
        self.answer.write_all(&self.committed, &self.origin, output);
        let Booked { travel, gauges } = &self.booked[1];
        self.answer.write_travel(*travel, output);
        output[self.answer.layout.len()..].copy_from_slice(gauges);
        if let Some(local) = &mut self.local {
            local.write(&self.model, &self.committed, (time, false), (&self.answer.layout, output));
        }
    }

    /// Range of a field with one value for the window in an answer.
    pub fn place(&self, field: &str) -> Option<Range<usize>> {
        self.answer.place(field)
    }

    /// Write how far the interface nodes have moved in the window that ends at `time` [s], and what a contact solver needs to
    /// move them itself from there, where the answer says so.
    fn write_travel_and_local(&mut self, time: f64, output: &mut [f64]) {
        if self.answer.place(name::TRAVEL).is_some() {
            let (from, to) = (&self.committed.displacement, &self.trial.displacement);
            self.booked[0].travel = travel(from, to, self.model.node_count(), self.answer.shown.selected());
            self.answer.write_travel(self.booked[0].travel, output);
        }
        if let Some(local) = &mut self.local {
            local.write(&self.model, &self.trial, (time, self.skipped), (&self.answer.layout, output));
        }
    }

    /// Energy stored and dissipated by the end of the last window accepted [J].
    pub fn energy(&self) -> [f64; 2] {
        let gauges = &self.booked[1].gauges;
        [2, 3].map(|energy| gauges[3 * energy])
    }

    /// State from which the next window follows.
    pub fn kept(&self) -> KeptWindows {
        KeptWindows {
            committed: self.committed.clone(),
            booked: self.booked[1].clone(),
            impulses: self.recorder.means.iter().map(MovingMean::kept).collect(),
            counts: self.counts,
        }
    }

    /// Go on from there.
    ///
    /// # Errors
    ///
    /// If that is of another structure.
    pub fn go_on(&mut self, kept: KeptWindows) -> Result<(), Fault> {
        let sizes = |state: &State, gauges: usize| {
            let State { displacement: u, velocity: v, acceleration: a, force: f, load, .. } = state;
            (
                [u, v, a, f, load, &state.history].map(Vec::len),
                state.groups.len(),
                state.used_parts.len(),
                gauges,
            )
        };
        let own = sizes(&self.committed, self.booked[1].gauges.len());
        let torn = kept
            .committed
            .events
            .iter()
            .chain(&kept.committed.yields)
            .all(|event| (event.element as usize) < self.model.elements.len());
        if own != sizes(&kept.committed, kept.booked.gauges.len())
            || kept.impulses.len() != self.recorder.means.len()
            || kept.impulses.iter().any(Vec::is_empty)
            || !torn
        {
            return Err(other_structure());
        }
        self.committed.copy_from(&kept.committed);
        self.trial.copy_from(&kept.committed);
        self.booked = [kept.booked.clone(), kept.booked];
        let means = self.recorder.means.iter_mut().zip(kept.impulses);
        means.for_each(|(mean, impulse)| mean.go_on(impulse));
        self.counts = kept.counts;
        Ok(())
    }
}

/// The same with room for all that may break.
fn with_room(mut state: State, model: &Model) -> State {
    state.events.reserve(model.elements.len());
    state
        .yields
        .reserve(model.elements.iter().filter(|element| element.constants().plastic.is_some()).count());
    let breakable = model.elements.iter().filter(|element| element.constants().can_break);
    state.close.reserve(breakable.clone().count());
    state.spared.reserve(breakable.count());
    state
}

/// The fault of a kept state that is of another structure.
pub fn other_structure() -> Fault {
    let what = "the state that was kept is of another structure";
    Diagnostic::error(code::PROVENANCE, what).into()
}

/// The state at t = 0, with memory for `ends` numbers of interface force.
fn first_state(model: &Model, config: &Config, start: &Start, recorder: &Recorder, ends: usize) -> State {
    let (n, scheme) = (model.dof_count(), Scheme::of(&config.fem));
    let balances_at_end = scheme.is_some_and(|s| !s.takes_mean_only());
    let mut velocity = model.start_velocity.clone();
    let thrown = velocity.iter().any(|v| *v != 0.0);
    velocity.resize(n, 0.0);
    start.motion.iter().for_each(|[own, _]| add_to(&mut velocity, own));
    let mut state = State {
        displacement: start.form.displacement.clone(),
        velocity,
        acceleration: vec![0.0; if scheme.is_some() { n } else { 0 }],
        force: if balances_at_end { start.force.clone() } else { Vec::new() },
        load: vec![0.0; ends],
        at_rest: start.at_rest && !thrown && config.fem.path_speed.is_none(),
        history: start.form.history.clone(),
        groups: recorder.groups(),
        used_parts: vec![Utilisation::default(); model.accounted().count()],
        ..State::default()
    };
    state = with_room(state, model);
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
    if let Some([_, own]) = &start.motion
        && !thrown
        && own.len() == state.acceleration.len()
    {
        state.acceleration.copy_from_slice(own);
    }
    [state.dissipated, state.received, state.support_work, state.load_work] = start.booked;
    let at_start = |value| Peak { value, time: 0.0 };
    let size = at_start(recorder.at_rest.iter().map(|r| r * r).sum::<f64>().sqrt());
    let tension = at_start(start.cable_force);
    state.peaks = Peaks {
        reaction: size,
        mean_reaction: [size; 2],
        cable_force: tension,
        tensions: [tension.value; 2],
        cable_force_beside: tension.value,
    };
    state
}
