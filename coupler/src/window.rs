//! One window, from its first iterate to its place in the books: `predict`, `iterate` (pass after pass, judged and accelerated),
//! then `commit`, or `reject`, which leaves nothing of it.
//!
//! In the words of preCICE: an explicit (weak) or implicit (strong) serial coupling scheme of two participants.

use crate::convergence::{Field, Measure, Residual, Tolerance, Trend};
use crate::coupling::{Coupling, Iterated};
use crate::guard;
use crate::handshake::Agreement;
use crate::observer::{CouplingError, Iteration, Observer};
use crate::patch::Patch;
use crate::schedule::{Schedule, Span};
use crate::settings::{OnNoConvergence, Scheme};
use crate::side::Side;
use crate::solver_slot::{Answered, Ask, SolverSlot};
use interface_defs::{Command, Diagnostic, Failure, Fill, code};

/// Most iterations of a window of a yielding net: one that needs more is too long.
const MOST_YIELDING: u32 = 4;

/// Largest difference of the works of contact forces on the two motions of a yielding net in one window, over the energy at
/// impact.
const MOST_DEFECT: f64 = 2e-4;

/// Largest energy that comes from nowhere in one window of a yielding net, over the energy at impact.
const MOST_MADE: f64 = 1e-3;

/// A window is one of a flight if it is longer than the scene's by this factor.
const FLIGHT: f64 = 1.5;

/// Times that a window may begin anew with other nodes.
const MOST_SELECTIONS: u32 = 4;

/// A window of a run, on its way.
pub(crate) struct Window<'w, 'a> {
    run: &'w mut Coupling<'a>,
    agreement: &'w mut Agreement,
    observer: &'w mut dyn Observer,
    /// Whether it may be given up for two of half its length.
    may_halve: bool,
    state: Iterated,
}

/// What has become of a window.
pub(crate) enum Outcome {
    Accepted,
    /// Something touches in a window that was made longer because nothing would.
    Touched,
    Rejected(String),
}

impl<'w, 'a> Window<'w, 'a> {
    /// One that neither solver knows of yet.
    pub fn new(
        run: &'w mut Coupling<'a>,
        agreement: &'w mut Agreement,
        observer: &'w mut dyn Observer,
        span: Span,
        may_halve: bool,
    ) -> Self {
        let state = Iterated { span, iteration: 1, residual: Residual::default(), converged: true };
        Self { run, agreement, observer, may_halve, state }
    }

    /// Iterate until both solvers agree, or as often as is allowed. Weak coupling is the same with one iteration that is not judged:
    /// of its residual only the displacement is computed. A window that may be halved is given up as soon as it diverges.
    pub fn iterate(&mut self) -> Result<Outcome, CouplingError> {
        let _span = interface_defs::profile!("window", window = self.state.span.number);
        self.select_if_due()?;
        self.predict();
        let most = if self.yields() { MOST_YIELDING } else { u32::MAX }.min(self.run.settings.iterations());
        let (mut trend, mut selections) = (Trend::new(most), 0);
        while self.state.iteration <= most {
            match self.pass()? {
                Answered::Done => {}
                Answered::Failed(reason) => return Ok(Outcome::Rejected(reason)),
                Answered::Beyond if selections == MOST_SELECTIONS => {
                    let what = format!("{selections} selections of nodes were not enough");
                    return Ok(Outcome::Rejected(what));
                }
                Answered::Beyond => {
                    self.run.counts.iterations -= 1;
                    self.predict();
                    (self.state.iteration, selections) = (1, selections + 1);
                    continue;
                }
            }
            if let Some(outcome) = self.judge(&mut trend)? {
                return Ok(outcome);
            }
            if self.state.iteration < most {
                self.accelerate();
            }
            self.state.iteration += 1;
        }
        if self.run.settings.on_no_convergence == OnNoConvergence::Accept {
            (self.state.iteration, self.state.converged) = (most, false);
            return Ok(Outcome::Accepted);
        }
        Ok(Outcome::Rejected(format!("not converged after {most} iterations: {}", self.left())))
    }

    /// Whether the contact solver moves the net itself, in the nodes within its reach.
    fn yields(&self) -> bool {
        self.agreement.interface.yields()
    }

    /// The first iterate.
    fn predict(&mut self) {
        let Coupling { settings, .. } = &mut *self.run;
        self.agreement.interface.predict(settings.predictor, self.state.span.length);
        settings.acceleration.start_window(self.agreement.interface.unknowns());
    }

    /// One pass: motion to the contact solver, its force to the structure. [`Answered::Beyond`]: other nodes are selected now, and the
    /// window begins anew.
    fn pass(&mut self) -> Result<Answered, CouplingError> {
        let Iterated { span, iteration, .. } = self.state;
        let _span = interface_defs::profile!("pass", window = span.number, iteration);
        self.run.counts.iterations += 1;
        let Agreement { interface, dem, fem, patch, .. } = &mut *self.agreement;
        let selection = u32::from(patch.is_some());
        let mut ask = Ask::solve(dem, selection);
        let (fields, mut travel) = (ask.sends, 0.0);
        if let Some(patch) = patch {
            (ask.listed, ask.nodes) = patch.to_announce();
            ask.sends += ask.listed;
            travel = patch.expected_travel(span.length);
        }
        self.run.dem.send((span, iteration), ask, &mut |payload| {
            let (payload, list) = payload.split_at_mut(fields);
            interface.write_motion(payload, iteration, travel);
            if let Some(patch) = patch {
                patch.announce(list);
            }
        })?;
        // Files are written while the contact solver is at work.
        self.run.report(self.observer)?;
        match self.run.dem.receive(span, dem)? {
            Answered::Done => self.run.dem.check_gauges(span, dem)?,
            Answered::Beyond => {
                self.reselect()?;
                return Ok(Answered::Beyond);
            }
            failed => return Ok(failed),
        }
        if let Some(patch) = patch {
            patch.is_announced();
        }
        let force = self.run.dem.participant.answer();
        let ask = Ask::solve(fem, selection);
        self.run.fem.send((span, iteration), ask, &mut |payload| interface.write_force(force, payload))?;
        let answers = &mut self.run.answers;
        answers.take_contact(force, dem, interface);
        match self.run.fem.receive(span, fem)? {
            Answered::Done => self.run.fem.check_gauges(span, fem)?,
            failed @ Answered::Failed(_) => return Ok(failed),
            Answered::Beyond => return Err(no_selection(self.run.fem.participant.name())),
        }
        let motion = self.run.fem.participant.answer();
        interface.take_motion(motion);
        answers.take_structure(motion, fem, interface);
        let moved = answers.travel;
        if let Some(patch) = patch.as_mut().filter(|_| moved > travel) {
            // They have moved further than the contact solver was to expect.
            patch.expect(moved, span.length);
            self.reselect()?;
            return Ok(Answered::Beyond);
        }
        Ok(Answered::Done)
    }

    /// Judge the last pass; `None`: another iteration is due.
    fn judge(&mut self, trend: &mut Trend) -> Result<Option<Outcome>, CouplingError> {
        let (yields, Iterated { span, iteration, .. }) = (self.yields(), self.state);
        let Coupling { settings, answers, counts, .. } = &mut *self.run;
        let interface = &mut self.agreement.interface;
        if answers.touches && !yields && span.length > FLIGHT * settings.time_window {
            counts.iterations -= 1;
            return Ok(Some(Outcome::Touched));
        }
        let residual = match settings.scheme {
            _ if yields => interface.yielding_residual(iteration),
            Scheme::Weak => interface.displacement_residual(),
            Scheme::Strong => interface.residual(span.length),
        };
        self.state.residual = residual;
        let factor = if yields { 1.0 } else { settings.acceleration.factor() };
        let seen = Iteration { span, iteration, residual, factor };
        self.observer.iteration(&seen).map_err(CouplingError::output)?;
        if settings.scheme == Scheme::Weak || self.passes() {
            return Ok(Some(self.reason_to_halve().map_or(Outcome::Accepted, Outcome::Rejected)));
        }
        let hopeless = if self.may_halve { trend.diverges(&residual) } else { None };
        Ok(hopeless.map(|reason| {
            self.run.counts.diverged += 1;
            Outcome::Rejected(format!("given up after {iteration} iterations: {reason}"))
        }))
    }

    /// Whether the residual passes.
    fn passes(&self) -> bool {
        let (settings, Iterated { span, residual, .. }) = (&self.run.settings, &self.state);
        let interface = &self.agreement.interface;
        if interface.yields() {
            return residual.passes(&settings.of_yielding());
        }
        let (measures, usual) = (&settings.measure, settings.tolerances());
        match measures.is_empty() {
            true => residual.passes(&usual),
            false => measures.iter().all(|m| interface.judge(m, span.length).passes(&m.tolerance(&usual))),
        }
    }

    /// Why a window that both agree on is halved all the same.
    fn reason_to_halve(&self) -> Option<String> {
        if !self.may_halve {
            return None;
        }
        let strong = self.run.settings.scheme == Scheme::Strong;
        let energy = if self.yields() && strong { self.loses_energy() } else { None };
        // What is torn touches nothing from the next window on: that is to begin soon.
        let breaks = self.run.answers.touches && self.agreement.interface.breaks();
        energy.or_else(|| breaks.then(|| "something broke in it".into()))
    }

    /// Why a window of a yielding net is too long for the energy: its parts leave the two motions of the net too far apart.
    fn loses_energy(&self) -> Option<String> {
        let Coupling { balance, has_balance, answers, .. } = &*self.run;
        let reference = balance.system.reference().filter(|_| *has_balance)?;
        let work = self.agreement.interface.work();
        let apart = (work.structure - work.mesh).abs();
        let made = balance.made(answers.energies);
        if made.abs() > MOST_MADE * reference {
            let share = 100.0 * made / reference;
            return Some(format!(
                "{made:.3e} J come from nowhere in it, {share:.3} % of the energy at impact"
            ));
        }
        (apart > MOST_DEFECT * reference).then(|| {
            let (structure, mesh, share) = (work.structure, work.mesh, 100.0 * apart / reference);
            format!(
                "contact forces do {structure:.3e} J on the structure and {mesh:.3e} J on the net as the contact solver moves it, \
                 {share:.3} % of the energy at impact apart"
            )
        })
    }

    /// The next iterate.
    fn accelerate(&mut self) {
        let interface = &mut self.agreement.interface;
        match interface.yields() {
            true => interface.adopt(),
            false => interface.accelerate(&mut *self.run.settings.acceleration, self.state.span.length),
        }
    }

    /// What is left of the residual, with the tolerances beside it.
    fn left(&self) -> String {
        let (settings, Iterated { span, residual, .. }) = (&self.run.settings, &self.state);
        let interface = &self.agreement.interface;
        let (measures, mut usual) = (&settings.measure, settings.tolerances());
        if interface.yields() {
            usual = settings.of_yielding();
        }
        if measures.is_empty() || interface.yields() {
            let Residual { displacement, displacement_increment: increment, velocity, .. } = residual;
            let Tolerance { relative, absolute } = usual;
            return format!(
                "displacement residual {displacement:.2e} m (increment {increment:.2e} m), velocity residual times window \
                 {velocity:.2e} m, tolerances {relative:.1e} relative, {absolute:.1e} m"
            );
        }
        let of = |m: &Measure| {
            let (judged, tolerance) = (interface.judge(m, span.length), m.tolerance(&usual));
            let unit = if m.field == Field::Force { "N" } else { "m" };
            format!(
                "{} residual {:.2e} {unit} (relative to {:.2e} {unit}; tolerances {:.1e} relative, {:.1e} {unit})",
                m.field.words(),
                judged.residual,
                judged.reference,
                tolerance.relative,
                tolerance.absolute
            )
        };
        measures.iter().map(of).collect::<Vec<_>>().join(", ")
    }

    /// Commit it: both solvers hear of it with the next request, and it is booked.
    pub fn commit(self) -> Result<(), CouplingError> {
        let Self { run, agreement, observer, state, .. } = self;
        let span = state.span;
        agreement.motion.watch(run.fem.participant.name(), span, &agreement.interface.answered())?;
        let touches = run.answers.touches;
        agreement.bodies.watch(run.dem.participant.name(), span, &run.answers.dem, touches)?;
        run.examination.accepted(touches);
        if let Some(moved) = agreement.interface.moved(span.end(), &agreement.meshes[1]) {
            observer.moved(&moved).map_err(CouplingError::output)?;
        }
        (run.dem.commit_due, run.fem.commit_due) = (true, true);
        run.book(state, &agreement.interface);
        agreement.interface.commit();
        if let Some(patch) = &mut agreement.patch {
            patch.moved(run.answers.travel, span.length);
        }
        Ok(())
    }

    /// It failed: its first half is next, or the run ends.
    pub fn reject(self, reason: String, schedule: &mut Schedule) -> Result<(), CouplingError> {
        let Self { run, agreement, state: Iterated { span, .. }, .. } = self;
        // One that lasted as long as a flight is not to last as long again.
        run.answers.free_time = run.answers.free_time.min(0.5 * span.length);
        let stops = run.settings.on_no_convergence == OnNoConvergence::Stop;
        let once = [&agreement.dem, &agreement.fem].into_iter().find(|side| side.hello.repeats.is_none());
        if !stops && once.is_none() && schedule.halve() {
            tracing::debug!(window = span.number, t = span.start, "halved: {reason}");
            run.counts.halved += 1;
            return Ok(());
        }
        let advice = match once {
            Some(side) => format!(
                "the window cannot be tried again at half its length, since {} does not repeat one (Hello, `repeats`; PROTOCOL.md, \
                 clause {}) and may have advanced already; try a shorter coupling.time_window from the start, or a solver that \
                 repeats",
                side.program,
                guard::clause::REPEATS
            ),
            None if stops => "coupling.on_no_convergence = \"halve\" would try shorter windows".into(),
            None => format!(
                "a shorter window than coupling.min_window = {:.3e} s is not allowed; try a shorter time_window or \
                 more max_iterations",
                run.settings.shortest_window()
            ),
        };
        let Span { number, start, length, .. } = span;
        let what = format!("window {number} at t = {start} s of {length:.3e} s: {reason}");
        let why = Diagnostic::error(code::NOT_CONVERGED, what).try_instead(advice);
        Err(CouplingError::NotConverged(Box::new(why)))
    }

    /// Select nodes where none are, or far more than a window of this length needs.
    fn select_if_due(&mut self) -> Result<(), CouplingError> {
        let length = self.state.span.length;
        let flight_ended = self.run.answers.free_time < FLIGHT * length;
        let due = |patch: &Patch| patch.is_open() || (flight_ended && patch.is_wide_for(length));
        if self.agreement.patch.as_ref().is_some_and(due) { self.reselect() } else { Ok(()) }
    }

    /// Select the nodes that cross anew: all of the committed state to the contact solver, which lists what it must see; that to
    /// the structure, which says how these nodes are coupled.
    fn reselect(&mut self) -> Result<(), CouplingError> {
        let (run, span) = (&mut *self.run, self.state.span);
        let Agreement { interface, dem, fem, patch, .. } = &mut *self.agreement;
        let Some(patch) = patch else { return Err(no_selection(run.dem.participant.name())) };
        let _span = interface_defs::profile!("select", window = span.number);
        run.counts.selections += 1;
        let all = patch.all();
        dem.resize(&all);
        fem.resize(&all);
        let state = Ask {
            command: Command::State,
            selection: 0,
            listed: 0,
            nodes: 0,
            sends: 0,
            expects: Some(fem.layout.len()),
        };
        ask(&mut run.fem, fem, span, state, &mut |_| ())?;
        interface.select(dem, fem, all.nodes, false, run.fem.participant.answer());
        interface.predict(run.settings.predictor, span.length);
        let reach = Ask { command: Command::Reach, sends: dem.request.len(), expects: Some(0), ..state };
        ask(&mut run.dem, dem, span, reach, &mut |payload| interface.write_motion(payload, 1, 0.0))?;
        let selected = patch.select(run.dem.participant.answer(), span.length);
        selected.map_err(|what| Failure::contract(run.dem.participant.name(), what))?;
        let nodes = patch.nodes().len();
        let state = Ask { selection: 1, listed: nodes, nodes, sends: nodes, expects: None, ..state };
        ask(&mut run.fem, fem, span, state, &mut |list| patch.announce(list))?;
        let breaks = |what: String| Failure::contract(run.fem.participant.name(), what);
        let answer = run.fem.participant.answer();
        let fields = answer.len() - run.fem.participant.listed();
        patch.set_pairs(&answer[fields..]).map_err(breaks)?;
        let items = patch.items();
        dem.resize(&items);
        fem.resize(&items);
        if fields != fem.layout.len() {
            let what = format!(
                "its committed state has {fields} numbers, its fields and gauges make {}",
                fem.layout.len()
            );
            return Err(breaks(what).into());
        }
        interface.select(dem, fem, nodes, true, &answer[..fields]);
        Ok(())
    }
}

/// An answer that only a solver with a part of the net may give, of one that has all.
fn no_selection(solver: &str) -> CouplingError {
    let what = "answered status 3, beyond the selection, to a request for all nodes";
    Failure::contract(solver, what).into()
}

/// Ask for what cannot fail.
fn ask(slot: &mut SolverSlot, side: &Side, span: Span, ask: Ask, fill: Fill) -> Result<(), CouplingError> {
    slot.send((span, 1), ask, fill)?;
    match slot.receive(span, side)? {
        Answered::Done => Ok(()),
        Answered::Failed(what) => Err(Failure::contract(slot.participant.name(), what).into()),
        Answered::Beyond => Err(no_selection(slot.participant.name())),
    }
}
