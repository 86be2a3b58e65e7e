//! The Gauss-Seidel loop: contact solver, then structure, until both agree; window after window.

use crate::convergence::{Field, Measure, Residual, Trend};
use crate::counts::Counts;
use crate::energy::{Balance, Both};
use crate::guard;
use crate::handshake::{Agreement, Side, agree};
use crate::interface::Interface;
use crate::schedule::{Schedule, Span};
use crate::seat::Seat;
use crate::settings::{CouplingSettings, OnNoConvergence, Scheme};
use crate::trust::Causes;
use interface_defs::solver::OnProgress;
use interface_defs::toolkit::limits::Limits;
use interface_defs::{Failure, Layout, Participant, Statistics, ipc::interrupt};
use std::fmt;

/// Why the run ended before its time.
#[derive(Debug, Clone, PartialEq)]
pub enum CouplingError {
    /// A participant failed, was lost, or broke the contract.
    Failed(Failure),
    /// A window could not be solved, and is not halved: not allowed, or as short as allowed.
    NotConverged {
        /// Number of the window.
        window: u64,
        /// Its start [s].
        start: f64,
        /// Its length [s].
        length: f64,
        /// Why.
        reason: String,
        /// What to try.
        advice: String,
    },
    /// The energy error has left its bound for good.
    Diverged(String),
    /// The records could not be written.
    Output(String),
}

impl fmt::Display for CouplingError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Self::Failed(failure) => write!(f, "{failure}"),
            Self::NotConverged { window, start, length, reason, advice } => {
                write!(f, "window {window} at t = {start} s of {length:.3e} s: {reason}; {advice}")
            }
            Self::Diverged(what) | Self::Output(what) => f.write_str(what),
        }
    }
}

impl std::error::Error for CouplingError {}

impl From<Failure> for CouplingError {
    fn from(failure: Failure) -> Self {
        Self::Failed(failure)
    }
}

/// One coupling iteration, as an observer sees it.
pub struct Iteration {
    /// The window.
    pub span: Span,
    /// Number of the iteration in it, from 1.
    pub iteration: u32,
    /// What is left.
    pub residual: Residual,
    /// Relaxation factor used for the iterate.
    pub factor: f64,
}

/// One committed window, as an observer sees it.
pub struct Committed<'a> {
    /// The window.
    pub span: Span,
    /// Iterations that it took.
    pub iterations: u32,
    /// What was left.
    pub residual: Residual,
    /// Whether the residual passed (always true in weak coupling, where it is not judged).
    pub converged: bool,
    /// Whether the contact solver exerts a force.
    pub touches: bool,
    /// The contact solver's gauges, three numbers each.
    pub dem: &'a [f64],
    /// The structure's gauges, three numbers each.
    pub fem: &'a [f64],
    /// Energy and work.
    pub balance: &'a Balance,
}

/// Sees what happens; writes files, draws progress. The loop does neither.
pub trait Observer {
    /// Both solvers are prepared.
    fn prepared(&mut self, dem: &Side, fem: &Side, warnings: &[String]) -> Result<(), String>;
    /// One iteration is done.
    fn iteration(&mut self, _iteration: &Iteration) -> Result<(), String> {
        Ok(())
    }
    /// One window is committed. Called while the contact solver is at work on the next.
    fn committed(&mut self, committed: &Committed) -> Result<(), String>;
}

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
    gauges: Gauges,
    /// The committed window that the observer does not know yet.
    unreported: Option<Accepted>,
}

/// The answers' gauges, kept from one solve to the commit.
#[derive(Default)]
struct Gauges {
    dem: Vec<f64>,
    fem: Vec<f64>,
    energies: Both,
    touches: bool,
}

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
            gauges: Gauges::default(),
            unreported: None,
        }
    }

    /// Prepare both solvers and run to the end. Committed windows are with the observer, whatever comes.
    pub fn run(&mut self, observer: &mut dyn Observer, progress: OnProgress) -> Result<(), CouplingError> {
        let mut agreement =
            agree(&self.settings, self.end_time, self.dem.participant, self.fem.participant, progress)?;
        self.has_balance = agreement.dem.account.complete && agreement.fem.account.complete;
        let accounts = (&agreement.dem.account, &agreement.fem.account);
        self.balance = Balance::new(Both { dem: accounts.0.start(), fem: accounts.1.start() });
        observer
            .prepared(&agreement.dem, &agreement.fem, &agreement.warnings)
            .map_err(CouplingError::Output)?;
        let outcome = self.windows(&mut agreement, observer);
        // Whatever has come: what is committed is reported.
        let reported = self.report(observer);
        outcome.and(reported)
    }

    fn windows(
        &mut self,
        agreement: &mut Agreement,
        observer: &mut dyn Observer,
    ) -> Result<(), CouplingError> {
        let mut schedule =
            Schedule::new(self.settings.time_window, self.end_time, self.settings.shortest_window());
        while let Some(span) = schedule.next() {
            if interrupt::requested() {
                return Err(Failure::Interrupted.into());
            }
            let may_halve = self.settings.on_no_convergence == OnNoConvergence::Halve && schedule.can_halve();
            match self.window(span, may_halve, agreement, observer)? {
                Outcome::Accepted(accepted) => {
                    let structure = self.fem.participant.name();
                    agreement.motion.watch(structure, accepted.span, &agreement.interface.answered())?;
                    self.book(accepted, &agreement.interface);
                    agreement.interface.commit();
                    schedule.accept();
                    self.check_energy(span.end())?;
                }
                Outcome::Rejected(reason) => self.reject(span, reason, agreement, &mut schedule)?,
            }
        }
        agreement.motion.end(self.fem.participant.name())?;
        for (seat, side, of_structure) in
            [(&self.fem, &agreement.fem, true), (&self.dem, &agreement.dem, false)]
        {
            if guard::has_comparable_work(side, of_structure) {
                guard::check_work(seat.participant.name(), &self.balance, of_structure)?;
            }
        }
        Ok(())
    }

    /// An energy error far beyond its bound ends the run at once.
    fn check_energy(&mut self, time: f64) -> Result<(), CouplingError> {
        if self.has_balance && self.balance.system.has_left(self.limits.fatal_energy_error()) {
            return Err(CouplingError::Diverged(self.causes().diverged(time, &self.limits)));
        }
        Ok(())
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
        let Gauges { dem, fem, touches, .. } = &self.gauges;
        let (touches, balance) = (*touches, &self.balance);
        let committed = Committed { span, iterations, residual, converged, touches, dem, fem, balance };
        observer.committed(&committed).map_err(CouplingError::Output)
    }

    /// Whether no solver is at work on a request.
    pub fn is_idle(&self) -> bool {
        !self.dem.asked && !self.fem.asked
    }

    /// End both solvers; the last solve is committed if it was accepted.
    pub fn finish(&mut self) -> Result<(Statistics, Statistics), Failure> {
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
        let most = self.settings.iterations();
        let mut residual = Residual::default();
        let mut trend = Trend::new(most);
        agreement.interface.predict(self.settings.predictor, span.length);
        self.settings.acceleration.start_window(agreement.interface.unknowns());
        for iteration in 1..=most {
            if let Some(reason) = self.pass(span, iteration, agreement, observer)? {
                return Ok(Outcome::Rejected(reason));
            }
            residual = match self.settings.scheme {
                Scheme::Weak => agreement.interface.displacement_residual(),
                Scheme::Strong => agreement.interface.residual(span.length),
            };
            let factor = self.settings.acceleration.factor();
            observer
                .iteration(&Iteration { span, iteration, residual, factor })
                .map_err(CouplingError::Output)?;
            if self.settings.scheme == Scheme::Weak
                || self.passes(&residual, &agreement.interface, span.length)
            {
                return Ok(Outcome::Accepted(Accepted {
                    span,
                    iterations: iteration,
                    residual,
                    converged: true,
                }));
            }
            if may_halve && let Some(reason) = trend.diverges(&residual) {
                self.counts.diverged += 1;
                return Ok(Outcome::Rejected(format!("given up after {iteration} iterations: {reason}")));
            }
            if iteration < most {
                agreement.interface.accelerate(&mut *self.settings.acceleration, span.length);
            }
        }
        if self.settings.on_no_convergence == OnNoConvergence::Accept {
            return Ok(Outcome::Accepted(Accepted { span, iterations: most, residual, converged: false }));
        }
        let left = self.left(&residual, &agreement.interface, span.length);
        Ok(Outcome::Rejected(format!("not converged after {most} iterations: {left}")))
    }

    /// Whether an iteration is accepted.
    fn passes(&self, residual: &Residual, interface: &Interface, length: f64) -> bool {
        let (measures, usual) = (&self.settings.measure, self.settings.tolerances());
        match measures.is_empty() {
            true => residual.passes(&usual),
            false => measures.iter().all(|m| interface.judge(m, length).passes(&m.tolerance(&usual))),
        }
    }

    /// What is left of the residual, with the tolerances beside it.
    fn left(&self, residual: &Residual, interface: &Interface, length: f64) -> String {
        let (measures, usual) = (&self.settings.measure, self.settings.tolerances());
        if measures.is_empty() {
            return format!(
                "displacement residual {:.2e} m (increment {:.2e} m), velocity residual times window {:.2e} m, tolerances \
                 {:.1e} relative, {:.1e} m",
                residual.displacement,
                residual.displacement_increment,
                residual.velocity,
                usual.relative,
                usual.absolute
            );
        }
        let of = |m: &Measure| {
            let (judged, tolerance) = (interface.judge(m, length), m.tolerance(&usual));
            let unit = if m.field == Field::Force { "N" } else { "m" };
            format!(
                "{} residual {:.2e} {unit} (relative to {:.2e} {unit}; tolerances {:.1e} relative, {:.1e} {unit})",
                m.field, judged.residual, judged.reference, tolerance.relative, tolerance.absolute
            )
        };
        measures.iter().map(of).collect::<Vec<_>>().join(", ")
    }

    /// One pass: motion to the contact solver, its force to the structure. `Some` is why it failed.
    fn pass(
        &mut self,
        span: Span,
        iteration: u32,
        agreement: &mut Agreement,
        observer: &mut dyn Observer,
    ) -> Result<Option<String>, CouplingError> {
        self.counts.iterations += 1;
        let Agreement { interface, dem, fem, .. } = agreement;
        self.dem.send(span, iteration, dem, &mut |payload| interface.write_motion(payload))?;
        // Files are written while the contact solver is at work.
        self.report(observer)?;
        if let Some(reason) = self.dem.receive(span, dem)? {
            return Ok(Some(reason));
        }
        let force = self.dem.participant.answer();
        self.fem.send(span, iteration, fem, &mut |payload| interface.write_force(force, payload))?;
        let gauges = &mut self.gauges;
        keep(&mut gauges.dem, &dem.layout, force);
        gauges.energies.dem = dem.account.energies(force);
        gauges.touches = interface.touches(force);
        if let Some(reason) = self.fem.receive(span, fem)? {
            return Ok(Some(reason));
        }
        let motion = self.fem.participant.answer();
        interface.take_motion(motion);
        keep(&mut gauges.fem, &fem.layout, motion);
        gauges.energies.fem = fem.account.energies(motion);
        Ok(None)
    }

    /// Count and book an accepted window.
    fn book(&mut self, accepted: Accepted, interface: &Interface) {
        let Accepted { span, iterations, residual, converged } = accepted;
        self.dem.commit_due = true;
        self.fem.commit_due = true;
        self.counts.windows += 1;
        self.counts.short += u64::from(span.level > 0);
        self.counts.unconverged += u64::from(!converged);
        self.counts.most_iterations = self.counts.most_iterations.max(iterations);
        self.counts.largest_residual = self.counts.largest_residual.max(residual.displacement);
        self.balance.book((span.start, span.end()), self.gauges.energies, interface.work());
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
        let once = [&agreement.dem, &agreement.fem].into_iter().find(|side| !side.repeatable);
        if !stops && once.is_none() && schedule.halve() {
            tracing::debug!(window = span.number, t = span.start, "halved: {reason}");
            self.counts.halved += 1;
            return Ok(());
        }
        let advice = match once {
            Some(side) => format!(
                "the window cannot be tried again at half its length, since {} does not repeat one (Hello, `repeats`; PROTOCOL.md, \
                 \"The rule\") and may have advanced already; try a shorter coupling.time_window from the start, or a solver that \
                 repeats",
                side.program
            ),
            None if stops => "coupling.on_no_convergence = \"halve\" would try shorter windows".into(),
            None => format!(
                "a shorter window than coupling.min_window = {:.3e} s is not allowed; try a shorter time_window or \
                 more max_iterations",
                self.settings.shortest_window()
            ),
        };
        Err(CouplingError::NotConverged {
            window: span.number,
            start: span.start,
            length: span.length,
            reason,
            advice,
        })
    }
}

/// Keep the gauges of an answer.
fn keep(kept: &mut Vec<f64>, layout: &Layout, answer: &[f64]) {
    kept.clear();
    kept.extend_from_slice(&answer[layout.gauges()]);
}
