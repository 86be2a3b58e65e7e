//! A run of the coupling, window after window: agree, iterate and commit each, keep its state, examine both solvers.

use crate::coupling::{Answers, Coupling};
use crate::derived::Derived;
use crate::energy::{Balance, Both};
use crate::guard;
use crate::handshake::{Agreement, agree, refuse};
use crate::interface::KeptInterface;
use crate::observer::{Counts, CouplingError, KeptRun, Observer};
use crate::patch::{KeptPatch, Patch};
use crate::schedule::{Schedule, Span};
use crate::settings::OnNoConvergence;
use crate::side::Side;
use crate::window::{Outcome, Window};
use interface_defs::{Failure, Fault, OnProgress, code, ipc::interrupt};
use serde::{Deserialize, Serialize};
use toolkit::checkpoint::{pack, unpack};

impl Coupling<'_> {
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
            let (slots, span) = ((&mut self.dem, &mut self.fem), Span { number: 0, start, length, level: 0 });
            self.examination.add_windows(slots, &mut agreement, span, [&gauges[0], &gauges[1]])?;
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
            let mut window = Window::new(self, agreement, observer, span, may_halve);
            match window.iterate()? {
                Outcome::Accepted => {
                    window.commit()?;
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
                Outcome::Rejected(reason) => window.reject(reason, &mut schedule)?,
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
            let (slots, span) = ((&mut self.dem, &mut self.fem), Span { length, ..span });
            self.examination.examine(slots, agreement, span, [&gauges[0], &gauges[1]])
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
        let free = self.answers.free_time.min(agreement.largest_window());
        if self.settings.flight_window > 0.0 && !self.answers.touches {
            schedule.lengthen(free, self.settings.flight_window);
        }
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
            answers: self.answers.clone(),
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
        (self.counts, self.balance, self.answers) = (kept.counts, kept.balance, kept.answers);
        self.committed = self.answers.clone();
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
    answers: Answers,
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
