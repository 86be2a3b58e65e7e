//! The Gauss-Seidel loop: contact solver, then structure, until both agree; window after window.

use crate::convergence::{Field, Measure, Residual, Tolerance, Trend};
use crate::derived::{Crossed, Derived};
use crate::energy::{Balance, Both};
use crate::examination::Examination;
use crate::guard;
use crate::handshake::{Agreement, agree, refuse};
use crate::interface::{Interface, KeptInterface};
use crate::patch::{KeptPatch, Patch};
use crate::schedule::{Schedule, Span};
use crate::seat::{Answered, Ask, Seat};
use crate::settings::{CouplingSettings, OnNoConvergence, Scheme};
use crate::side::Side;
use crate::trust::Causes;
use interface_defs::{
    Command, Diagnostic, Failure, Fault, Fill, OnProgress, Participant, Statistics, code, ipc::interrupt,
};
use serde::{Deserialize, Serialize};
use toolkit::checkpoint::{pack, unpack};
use toolkit::limits::Limits;

pub use crate::observer::{Committed, Counts, CouplingError, Iteration, KeptRun, Observer};

/// A run of the loop over two participants.
pub struct Coupling<'a> {
    settings: CouplingSettings,
    end_time: f64,
    dem: Seat<'a>,
    fem: Seat<'a>,
    /// What was done so far.
    pub counts: Counts,
    /// Energy and work so far.
    pub balance: Balance,
    /// Whether both solvers report all energies, so that there is an `energy_error`.
    pub has_balance: bool,
    /// Bounds of trust.
    pub limits: Limits,
    /// The state from which the run goes on, if it does not begin.
    pub resume: Option<KeptRun>,
    /// What was examined of the solvers, and when.
    pub examination: Examination,
    gauges: Gauges,
    /// Those of the windows that were accepted last; empty before the first.
    committed: Gauges,
    /// The window under way.
    span: Option<Span>,
    /// What follows from what crosses.
    pub derived: Derived,
    /// The committed window that the observer does not know yet.
    unreported: Option<Accepted>,
}

/// The answers' gauges, kept from one solve to the commit.
#[derive(Clone, Default, Serialize, Deserialize)]
struct Gauges {
    dem: Vec<f64>,
    fem: Vec<f64>,
    energies: Both,
    touches: bool,
    /// Mean force of the contact on all nodes together [N].
    contact: [f64; 3],
    /// Time in which nothing will touch [s].
    free_time: f64,
    /// Distance that nodes of the net have moved that are not selected [m].
    travel: f64,
}

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

/// A window that was accepted.
#[derive(Clone, Copy)]
struct Accepted {
    span: Span,
    iterations: u32,
    residual: Residual,
    converged: bool,
}

enum Outcome {
    Accepted(Accepted),
    /// Something touches in a window that was made longer because nothing would.
    Touched,
    Rejected(String),
}

impl<'a> Coupling<'a> {
    /// A run to `end_time` [s].
    pub fn new(
        settings: CouplingSettings,
        end_time: f64,
        dem: &'a mut dyn Participant,
        fem: &'a mut dyn Participant,
    ) -> Self {
        Self {
            settings,
            end_time,
            dem: Seat::new(dem),
            fem: Seat::new(fem),
            counts: Counts::default(),
            balance: Balance::default(),
            has_balance: false,
            limits: Limits::default(),
            resume: None,
            examination: Examination::default(),
            gauges: Gauges::default(),
            committed: Gauges::default(),
            span: None,
            derived: Derived::default(),
            unreported: None,
        }
    }

    /// Prepare both solvers and run to the end. Committed windows are with the observer, whatever comes.
    pub fn run(&mut self, observer: &mut dyn Observer, progress: OnProgress) -> Result<(), CouplingError> {
        let (dem, fem) = (&mut *self.dem.participant, &mut *self.fem.participant);
        let mut agreement = agree(&self.settings, self.end_time, dem, fem, self.resume.as_ref(), progress)?;
        self.has_balance = agreement.dem.account.complete && agreement.fem.account.complete;
        let accounts = (&agreement.dem.account, &agreement.fem.account);
        self.balance = Balance::new(Both { dem: accounts.0.start, fem: accounts.1.start });
        self.derived = Derived::new(&agreement.fem.masses, self.settings.gravity);
        observer
            .prepared(&agreement.dem, &agreement.fem, &agreement.warnings)
            .map_err(CouplingError::output)?;
        let outcome = self.windows(&mut agreement, observer).map_err(|error| match error {
            // The signal has reached all: a solver at work on a window has given it up, or ended.
            CouplingError::Failed(_) if interrupt::requested() => Failure::Interrupted.into(),
            error => self.examined(error, &mut agreement),
        });
        if outcome.is_ok() && self.examination.of.is_some() {
            let (start, length) = (self.end_time, self.settings.time_window);
            let gauges = self.committed_gauges(&agreement);
            let (seats, span) = ((&mut self.dem, &mut self.fem), Span { number: 0, start, length, level: 0 });
            self.examination.add_windows(seats, &mut agreement, span, [&gauges[0], &gauges[1]])?;
        }
        // Whatever has come: what is committed is reported.
        let reported = self.report(observer);
        outcome.and(reported)
    }

    fn windows(
        &mut self,
        agreement: &mut Agreement,
        observer: &mut dyn Observer,
    ) -> Result<(), CouplingError> {
        let _span = interface_defs::profile!("loop");
        let mut schedule = match self.resume.take() {
            Some(kept) => self.go_on(&kept.coupling, agreement)?,
            None => {
                let shortest = self.settings.shortest_window();
                let schedule = Schedule::new(self.settings.time_window, self.end_time, shortest);
                self.span = schedule.next();
                self.examine(agreement)?;
                schedule
            }
        };
        while schedule.next().is_some() {
            let interrupted = interrupt::requested();
            let kept = self.keep_if_due(&schedule, agreement, observer, interrupted);
            if interrupted {
                return Err(Failure::Interrupted.into());
            }
            kept?;
            self.lengthen(&mut schedule, agreement);
            let Some(span) = schedule.next() else { break };
            self.span = Some(span);
            if self.examination.is_due(span.end() >= self.end_time) {
                // What is examined is no longer the window that was accepted.
                self.report(observer)?;
                self.examine(agreement)?;
            }
            let may_halve = self.settings.on_no_convergence == OnNoConvergence::Halve && schedule.can_halve();
            match self.window(span, may_halve, agreement, observer)? {
                Outcome::Accepted(accepted) => {
                    let structure = self.fem.participant.name();
                    agreement.motion.watch(structure, accepted.span, &agreement.interface.answered())?;
                    let (contact, touches) = (self.dem.participant.name(), self.gauges.touches);
                    agreement.bodies.watch(contact, accepted.span, &self.gauges.dem, touches)?;
                    self.examination.accepted(touches);
                    if let Some(moved) = agreement.interface.moved(accepted.span.end(), &agreement.meshes[1])
                    {
                        observer.moved(&moved).map_err(CouplingError::output)?;
                    }
                    self.book(accepted, &agreement.interface);
                    agreement.interface.commit();
                    if let Some(patch) = &mut agreement.patch {
                        patch.moved(self.gauges.travel, span.length);
                    }
                    schedule.accept();
                    self.span = schedule.next().or(self.span);
                    // An energy error far beyond its bound ends the run at once.
                    if self.has_balance && self.balance.system.has_left(self.limits.fatal_energy_error()) {
                        let why = self.causes().diverged(span.end(), &self.limits);
                        return Err(CouplingError::Diverged(why.into()));
                    }
                    if self.settings.ends_at_rest && self.dem.rests && self.fem.rests {
                        self.report(observer)?;
                        self.examine(agreement)?;
                        tracing::info!(
                            t = span.end(),
                            "ended: the rocks lie still, and so does the structure"
                        );
                        break;
                    }
                }
                Outcome::Rejected(reason) => {
                    // One that lasted as long as a flight is not to last as long again.
                    self.gauges.free_time = self.gauges.free_time.min(0.5 * span.length);
                    self.reject(span, reason, agreement, &mut schedule)?;
                }
                // Both solvers begin again, in a window of the usual length.
                Outcome::Touched => schedule.shorten(),
            }
        }
        agreement.motion.end(self.fem.participant.name())?;
        agreement.bodies.end(self.dem.participant.name())?;
        guard::check_work(self.fem.participant.name(), &agreement.fem, &self.balance, true)?;
        // Who moves the net itself does other work on it than means over parts of a window do.
        if agreement.patch.is_none() {
            guard::check_work(self.dem.participant.name(), &agreement.dem, &self.balance, false)?;
        }
        Ok(())
    }

    /// Examine the solvers in their committed states, where the next window begins.
    fn examine(&mut self, agreement: &mut Agreement) -> Result<(), Failure> {
        let Some(span) = self.span else { return Ok(()) };
        let length = self.settings.time_window.min(self.end_time - span.start);
        toolkit::alloc::uncounted(|| {
            let gauges = self.committed_gauges(agreement);
            let (seats, span) = ((&mut self.dem, &mut self.fem), Span { length, ..span });
            self.examination.examine(seats, agreement, span, [&gauges[0], &gauges[1]])
        })
    }

    /// Gauges of both committed states.
    fn committed_gauges(&self, agreement: &Agreement) -> [Vec<f64>; 2] {
        let of = |gauges: &Vec<f64>, side: &Side| match gauges.is_empty() {
            true => side.initial[side.layout.gauges()].to_vec(),
            false => gauges.clone(),
        };
        [of(&self.committed.dem, &agreement.dem), of(&self.committed.fem, &agreement.fem)]
    }

    /// Before anything numerical is blamed the solvers are examined once more.
    fn examined(&mut self, error: CouplingError, agreement: &mut Agreement) -> CouplingError {
        let numerical = match &error {
            CouplingError::NotConverged(_) | CouplingError::Diverged(_) => true,
            CouplingError::Failed(failure) => matches!(failure, Failure::Fault { .. }) && !failure.is_input(),
            CouplingError::Output(_) => false,
        };
        if !numerical || !self.is_idle() {
            return error;
        }
        match self.examine(agreement) {
            Err(Failure::Contract { solver, what, clause }) => {
                let what = format!("{what}; without that it would be said that {error}");
                Failure::Contract { solver, what, clause }.into()
            }
            _ => error,
        }
    }

    /// While nothing is in reach, one window lasts as long as the contact solver says, up to the next row.
    fn lengthen(&self, schedule: &mut Schedule, agreement: &Agreement) {
        let free = self.gauges.free_time.min(agreement.largest_window());
        if self.settings.flight_window > 0.0 && !self.gauges.touches {
            schedule.lengthen(free, self.settings.flight_window);
        }
    }

    /// Time over which the contact force is a mean [s].
    pub fn sample_length(&self) -> f64 {
        self.settings.time_window / f64::from(self.settings.samples)
    }

    /// What speaks against the run so far.
    pub fn causes(&self) -> Causes<'_> {
        let Self { settings, counts, balance, has_balance, .. } = self;
        Causes { settings, counts, balance, has_balance: *has_balance }
    }

    /// Report the last committed window to the observer, once.
    fn report(&mut self, observer: &mut dyn Observer) -> Result<(), CouplingError> {
        let Some(Accepted { span, iterations, residual, converged }) = self.unreported.take() else {
            return Ok(());
        };
        let Gauges { dem, fem, touches, contact, .. } = &self.gauges;
        let (touches, contact, balance, counts) = (*touches, *contact, &self.balance, &self.counts);
        let committed =
            Committed { span, iterations, residual, converged, touches, dem, fem, contact, balance, counts };
        observer.committed(&committed).map_err(CouplingError::output)
    }

    /// Whether no solver is at work on a request.
    pub fn is_idle(&self) -> bool {
        !self.dem.asked && !self.fem.asked
    }

    /// End both solvers; the last solve is committed if it was accepted.
    pub fn finish(&mut self) -> Result<(Statistics, Statistics), Failure> {
        let _span = interface_defs::profile!("finish");
        Ok((self.dem.finish()?, self.fem.finish()?))
    }

    /// Iterate one window. Weak coupling is the same with one iteration that is not judged: of its
    /// residual only the displacement is computed. A window that may be halved is given up as soon as it diverges.
    fn window(
        &mut self,
        span: Span,
        may_halve: bool,
        agreement: &mut Agreement,
        observer: &mut dyn Observer,
    ) -> Result<Outcome, CouplingError> {
        let _span = interface_defs::profile!("window", window = span.number);
        let (mut iteration, mut selections) = (1, 0);
        let ended = self.gauges.free_time < FLIGHT * span.length;
        let selects = |patch: &Patch| patch.is_open() || (ended && patch.is_wide_for(span.length));
        if agreement.patch.as_ref().is_some_and(selects) {
            self.reselect(span, agreement)?;
        }
        self.begin(span, agreement);
        let yields = agreement.interface.yields();
        let most = if yields { MOST_YIELDING } else { u32::MAX }.min(self.settings.iterations());
        let (mut residual, mut trend) = (Residual::default(), Trend::new(most));
        let accepted = |iterations, residual, converged| {
            Ok(Outcome::Accepted(Accepted { span, iterations, residual, converged }))
        };
        while iteration <= most {
            match self.pass(span, iteration, agreement, observer)? {
                Answered::Done => {}
                Answered::Failed(reason) => return Ok(Outcome::Rejected(reason)),
                Answered::Beyond if selections == MOST_SELECTIONS => {
                    let what = format!("{selections} selections of nodes were not enough");
                    return Ok(Outcome::Rejected(what));
                }
                Answered::Beyond => {
                    self.counts.iterations -= 1;
                    self.begin(span, agreement);
                    (iteration, selections) = (1, selections + 1);
                    continue;
                }
            }
            let interface = &mut agreement.interface;
            if self.gauges.touches && !yields && span.length > FLIGHT * self.settings.time_window {
                self.counts.iterations -= 1;
                return Ok(Outcome::Touched);
            }
            residual = match self.settings.scheme {
                _ if yields => interface.yielding_residual(iteration),
                Scheme::Weak => interface.displacement_residual(),
                Scheme::Strong => interface.residual(span.length),
            };
            let factor = if yields { 1.0 } else { self.settings.acceleration.factor() };
            observer
                .iteration(&Iteration { span, iteration, residual, factor })
                .map_err(CouplingError::output)?;
            if self.settings.scheme == Scheme::Weak || self.passes(&residual, interface, span.length) {
                let judged = yields && may_halve && self.settings.scheme == Scheme::Strong;
                if judged && let Some(reason) = self.loses_energy(interface) {
                    return Ok(Outcome::Rejected(reason));
                }
                // What is torn touches nothing from the next window on: that is to begin soon.
                if may_halve && self.gauges.touches && interface.breaks() {
                    return Ok(Outcome::Rejected("something broke in it".into()));
                }
                return accepted(iteration, residual, true);
            }
            if may_halve && let Some(reason) = trend.diverges(&residual) {
                self.counts.diverged += 1;
                return Ok(Outcome::Rejected(format!("given up after {iteration} iterations: {reason}")));
            }
            if iteration < most {
                match yields {
                    true => interface.adopt(),
                    false => interface.accelerate(&mut *self.settings.acceleration, span.length),
                }
            }
            iteration += 1;
        }
        if self.settings.on_no_convergence == OnNoConvergence::Accept {
            return accepted(most, residual, false);
        }
        let left = self.left(&residual, &agreement.interface, span.length);
        Ok(Outcome::Rejected(format!("not converged after {most} iterations: {left}")))
    }

    /// Why a window of a yielding net is too long for the energy: its parts leave the two motions of the net too far apart.
    fn loses_energy(&self, interface: &Interface) -> Option<String> {
        let reference = self.balance.system.reference().filter(|_| self.has_balance)?;
        let work = interface.work();
        let apart = (work.structure - work.mesh).abs();
        let made = self.balance.made(self.gauges.energies);
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

    /// Whether an iteration is accepted.
    fn passes(&self, residual: &Residual, interface: &Interface, length: f64) -> bool {
        if interface.yields() {
            return residual.passes(&self.settings.of_yielding());
        }
        let (measures, usual) = (&self.settings.measure, self.settings.tolerances());
        match measures.is_empty() {
            true => residual.passes(&usual),
            false => measures.iter().all(|m| interface.judge(m, length).passes(&m.tolerance(&usual))),
        }
    }

    /// What is left of the residual, with the tolerances beside it.
    fn left(&self, residual: &Residual, interface: &Interface, length: f64) -> String {
        let (measures, mut usual) = (&self.settings.measure, self.settings.tolerances());
        if interface.yields() {
            usual = self.settings.of_yielding();
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
            let (judged, tolerance) = (interface.judge(m, length), m.tolerance(&usual));
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

    /// The first iterate of a window.
    fn begin(&mut self, span: Span, agreement: &mut Agreement) {
        agreement.interface.predict(self.settings.predictor, span.length);
        self.settings.acceleration.start_window(agreement.interface.unknowns());
    }

    /// One pass: motion to the contact solver, its force to the structure. [`Answered::Beyond`]: other nodes are selected now, and the
    /// window begins anew.
    fn pass(
        &mut self,
        span: Span,
        iteration: u32,
        agreement: &mut Agreement,
        observer: &mut dyn Observer,
    ) -> Result<Answered, CouplingError> {
        let _span = interface_defs::profile!("pass", window = span.number, iteration);
        self.counts.iterations += 1;
        let Agreement { interface, dem, fem, patch, .. } = &mut *agreement;
        let selection = u32::from(patch.is_some());
        let mut ask = Ask::solve(dem, selection);
        let (fields, mut travel) = (ask.sends, 0.0);
        if let Some(patch) = patch {
            (ask.listed, ask.nodes) = patch.to_announce();
            ask.sends += ask.listed;
            travel = patch.expected_travel(span.length);
        }
        self.dem.send((span, iteration), ask, &mut |payload| {
            let (payload, list) = payload.split_at_mut(fields);
            interface.write_motion(payload, iteration, travel);
            if let Some(patch) = patch {
                patch.announce(list);
            }
        })?;
        // Files are written while the contact solver is at work.
        self.report(observer)?;
        match self.dem.receive(span, dem)? {
            Answered::Done => self.dem.check_gauges(span, dem)?,
            Answered::Beyond => {
                self.reselect(span, agreement)?;
                return Ok(Answered::Beyond);
            }
            failed => return Ok(failed),
        }
        if let Some(patch) = patch {
            patch.is_announced();
        }
        let force = self.dem.participant.answer();
        let ask = Ask::solve(fem, selection);
        self.fem.send((span, iteration), ask, &mut |payload| interface.write_force(force, payload))?;
        let gauges = &mut self.gauges;
        force[dem.layout.gauges()].clone_into(&mut gauges.dem);
        gauges.energies.dem = dem.account.energies(&force[dem.layout.gauges()]);
        gauges.touches = interface.touches(force);
        gauges.free_time = interface.free_time(force);
        match self.fem.receive(span, fem)? {
            Answered::Done => self.fem.check_gauges(span, fem)?,
            failed @ Answered::Failed(_) => return Ok(failed),
            Answered::Beyond => return Err(no_selection(self.fem.participant.name())),
        }
        let motion = self.fem.participant.answer();
        interface.take_motion(motion);
        gauges.travel = interface.travel(motion);
        motion[fem.layout.gauges()].clone_into(&mut gauges.fem);
        gauges.energies.fem = fem.account.energies(&motion[fem.layout.gauges()]);
        if let Some(patch) = patch.as_mut().filter(|_| gauges.travel > travel) {
            // They have moved further than the contact solver was to expect.
            patch.expect(gauges.travel, span.length);
            self.reselect(span, agreement)?;
            return Ok(Answered::Beyond);
        }
        Ok(Answered::Done)
    }

    /// Count and book an accepted window.
    fn book(&mut self, accepted: Accepted, interface: &Interface) {
        let Accepted { span, iterations, residual, converged } = accepted;
        let _span = interface_defs::profile!("commit", window = span.number);
        self.dem.commit_due = true;
        self.fem.commit_due = true;
        self.counts.windows += 1;
        self.counts.short += u64::from(span.level > 0);
        self.counts.unconverged += u64::from(!converged);
        self.counts.most_iterations = self.counts.most_iterations.max(iterations);
        self.counts.largest_residual = self.counts.largest_residual.max(residual.displacement);
        self.committed.dem.clone_from(&self.gauges.dem);
        self.committed.fem.clone_from(&self.gauges.fem);
        let energies = self.gauges.energies;
        self.balance.book((span.start, span.end()), energies, interface.work());
        self.gauges.contact = interface.resultant();
        if let Some(force) = interface.force() {
            let kinetic = self.has_balance.then_some(energies.dem.kinetic);
            self.derived.book(Crossed { span, force, motion: interface.answered(), kinetic });
        }
        self.unreported = Some(accepted);
    }

    /// A window failed: its first half is next, or the run ends.
    fn reject(
        &mut self,
        span: Span,
        reason: String,
        agreement: &Agreement,
        schedule: &mut Schedule,
    ) -> Result<(), CouplingError> {
        let stops = self.settings.on_no_convergence == OnNoConvergence::Stop;
        let once = [&agreement.dem, &agreement.fem].into_iter().find(|side| side.hello.repeats.is_none());
        if !stops && once.is_none() && schedule.halve() {
            tracing::debug!(window = span.number, t = span.start, "halved: {reason}");
            self.counts.halved += 1;
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
                self.settings.shortest_window()
            ),
        };
        let Span { number, start, length, .. } = span;
        let what = format!("window {number} at t = {start} s of {length:.3e} s: {reason}");
        let why = Diagnostic::error(code::NOT_CONVERGED, what).try_instead(advice);
        Err(CouplingError::NotConverged(Box::new(why)))
    }

    /// Select the nodes that cross anew: all of the committed state to the contact solver, which lists what it must see; that to
    /// the structure, which says how these nodes are coupled.
    fn reselect(&mut self, span: Span, agreement: &mut Agreement) -> Result<(), CouplingError> {
        let Agreement { interface, dem, fem, patch, .. } = agreement;
        let Some(patch) = patch else { return Err(no_selection(self.dem.participant.name())) };
        let _span = interface_defs::profile!("select", window = span.number);
        self.counts.selections += 1;
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
        ask(&mut self.fem, fem, span, state, &mut |_| ())?;
        interface.select(dem, fem, all.nodes, false, self.fem.participant.answer());
        interface.predict(self.settings.predictor, span.length);
        let reach = Ask { command: Command::Reach, sends: dem.request.len(), expects: Some(0), ..state };
        ask(&mut self.dem, dem, span, reach, &mut |payload| interface.write_motion(payload, 1, 0.0))?;
        let selected = patch.select(self.dem.participant.answer(), span.length);
        selected.map_err(|what| Failure::contract(self.dem.participant.name(), what))?;
        let nodes = patch.nodes().len();
        let state = Ask { selection: 1, listed: nodes, nodes, sends: nodes, expects: None, ..state };
        ask(&mut self.fem, fem, span, state, &mut |list| patch.announce(list))?;
        let breaks = |what: String| Failure::contract(self.fem.participant.name(), what);
        let answer = self.fem.participant.answer();
        let fields = answer.len() - self.fem.participant.listed();
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

    /// Between two windows: give the observer the state of all three, if it is time for that or if the run is `interrupted`.
    fn keep_if_due(
        &mut self,
        schedule: &Schedule,
        agreement: &Agreement,
        observer: &mut dyn Observer,
        interrupted: bool,
    ) -> Result<(), CouplingError> {
        if !observer.is_due(interrupted) {
            return Ok(());
        }
        if let Some(who) = agreement.forgetful() {
            observer.cannot_keep(who);
            return Ok(());
        }
        self.report(observer)?;
        let (dem, fem) = (self.dem.save()?, self.fem.save()?);
        let acceleration = self.settings.acceleration.memory().map_or(Vec::new(), |memory| pack(memory));
        let kept = KeptLoop {
            schedule: schedule.clone(),
            counts: self.counts,
            balance: self.balance.clone(),
            gauges: self.gauges.clone(),
            derived: self.derived.clone(),
            interface: agreement.interface.kept(),
            motion: agreement.motion.clone(),
            bodies: agreement.bodies.clone(),
            patch: agreement.patch.as_ref().map(Patch::kept),
            acceleration,
        };
        let time = schedule.next().map_or(self.end_time, |span| span.start);
        observer.keep(time, KeptRun { dem, fem, coupling: pack(&kept) });
        Ok(())
    }

    /// Go on from `kept`; both solvers have been prepared and stand where they stood then.
    fn go_on(&mut self, kept: &[u8], agreement: &mut Agreement) -> Result<Schedule, Failure> {
        let kept: KeptLoop = unpack(kept).map_err(of_checkpoint)?;
        let Agreement { interface, dem, fem, patch, motion, bodies, .. } = agreement;
        if let (Some(patch), Some(of_patch)) = (patch, kept.patch) {
            patch.go_on(of_patch).map_err(|what| of_checkpoint(Fault::broken(what)))?;
            if !patch.is_open() {
                let items = patch.items();
                dem.resize(&items);
                fem.resize(&items);
                interface.select(dem, fem, items.nodes, true, &vec![0.0; fem.layout.len()]);
            }
        }
        interface.go_on(kept.interface);
        (*motion, *bodies) = (kept.motion, kept.bodies);
        (self.counts, self.balance, self.gauges) = (kept.counts, kept.balance, kept.gauges);
        self.committed = self.gauges.clone();
        self.derived = kept.derived;
        if let Some(memory) = self.settings.acceleration.memory() {
            *memory = unpack(&kept.acceleration).map_err(of_checkpoint)?;
        }
        Ok(kept.schedule)
    }
}

/// What the loop takes from one window to the next.
#[derive(Serialize, Deserialize)]
struct KeptLoop {
    schedule: Schedule,
    counts: Counts,
    balance: Balance,
    gauges: Gauges,
    derived: Derived,
    interface: KeptInterface,
    motion: guard::Motion,
    bodies: guard::Bodies,
    patch: Option<KeptPatch>,
    /// What the acceleration takes along.
    acceleration: Vec<u8>,
}

/// A checkpoint that cannot be gone on from.
fn of_checkpoint(fault: Fault) -> Failure {
    refuse(fault.diagnostic.coded(code::PROVENANCE))
}

/// An answer that only a solver with a part of the net may give, of one that has all.
fn no_selection(solver: &str) -> CouplingError {
    let what = "answered status 3, beyond the selection, to a request for all nodes";
    Failure::contract(solver, what).into()
}

/// Ask for what cannot fail.
fn ask(seat: &mut Seat, side: &Side, span: Span, ask: Ask, fill: Fill) -> Result<(), CouplingError> {
    seat.send((span, 1), ask, fill)?;
    match seat.receive(span, side)? {
        Answered::Done => Ok(()),
        Answered::Failed(what) => Err(Failure::contract(seat.participant.name(), what).into()),
        Answered::Beyond => Err(no_selection(seat.participant.name())),
    }
}
