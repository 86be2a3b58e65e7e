//! A run of the Gauss-Seidel loop over two participants: what it works with, and its books. `windows.rs` leads it.

use crate::convergence::Residual;
use crate::derived::{Crossed, Derived};
use crate::energy::{Balance, Both};
use crate::examination::Examination;
use crate::interface::Interface;
use crate::schedule::Span;
use crate::settings::CouplingSettings;
use crate::side::Side;
use crate::solver_slot::SolverSlot;
use crate::trust::Causes;
use interface_defs::{Failure, Participant, Statistics};
use serde::{Deserialize, Serialize};
use toolkit::limits::Limits;

pub use crate::observer::{Committed, Counts, CouplingError, Iteration, KeptRun, Observer};

/// A run of the loop over two participants.
pub struct Coupling<'a> {
    pub(crate) settings: CouplingSettings,
    pub(crate) end_time: f64,
    pub(crate) dem: SolverSlot<'a>,
    pub(crate) fem: SolverSlot<'a>,
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
    /// Those of the last pass.
    pub(crate) answers: Answers,
    /// Those of the last window that was accepted; empty before the first.
    pub(crate) committed: Answers,
    /// The window under way.
    pub(crate) span: Option<Span>,
    /// What follows from what crosses.
    pub derived: Derived,
    /// The committed window that the observer does not know yet.
    unreported: Option<Iterated>,
}

/// What both solvers have answered, as far as it is reported or decides what comes next.
#[derive(Clone, Default, Serialize, Deserialize)]
pub(crate) struct Answers {
    /// Gauges, three numbers each.
    pub dem: Vec<f64>,
    pub fem: Vec<f64>,
    pub energies: Both,
    pub touches: bool,
    /// Mean force of the contact on all nodes together [N].
    pub contact: [f64; 3],
    /// Time in which nothing will touch [s].
    pub free_time: f64,
    /// Distance that nodes of the net have moved that are not selected [m].
    pub travel: f64,
}

impl Answers {
    /// Take those of the contact solver.
    pub fn take_contact(&mut self, answer: &[f64], side: &Side, interface: &Interface) {
        let gauges = &answer[side.layout.gauges()];
        gauges.clone_into(&mut self.dem);
        self.energies.dem = side.account.energies(gauges);
        self.touches = interface.touches(answer);
        self.free_time = interface.free_time(answer);
    }

    /// Take those of the structure.
    pub fn take_structure(&mut self, answer: &[f64], side: &Side, interface: &Interface) {
        let gauges = &answer[side.layout.gauges()];
        gauges.clone_into(&mut self.fem);
        self.energies.fem = side.account.energies(gauges);
        self.travel = interface.travel(answer);
    }
}

/// Where a window stands: what is reported of it once it is committed.
#[derive(Clone, Copy)]
pub(crate) struct Iterated {
    pub span: Span,
    /// Number of the iteration, from 1.
    pub iteration: u32,
    /// What that has left.
    pub residual: Residual,
    /// Whether it has passed; weak coupling does not ask.
    pub converged: bool,
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
            dem: SolverSlot::new(dem),
            fem: SolverSlot::new(fem),
            counts: Counts::default(),
            balance: Balance::default(),
            has_balance: false,
            limits: Limits::default(),
            resume: None,
            examination: Examination::default(),
            answers: Answers::default(),
            committed: Answers::default(),
            span: None,
            derived: Derived::default(),
            unreported: None,
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

    /// Count and book a window that is accepted.
    pub(crate) fn book(&mut self, window: Iterated, interface: &Interface) {
        let Iterated { span, iteration, residual, converged } = window;
        let _span = interface_defs::profile!("commit", window = span.number);
        self.counts.windows += 1;
        self.counts.short += u64::from(span.level > 0);
        self.counts.unconverged += u64::from(!converged);
        self.counts.most_iterations = self.counts.most_iterations.max(iteration);
        self.counts.largest_residual = self.counts.largest_residual.max(residual.displacement);
        self.committed.dem.clone_from(&self.answers.dem);
        self.committed.fem.clone_from(&self.answers.fem);
        let energies = self.answers.energies;
        self.balance.book((span.start, span.end()), energies, interface.work());
        self.answers.contact = interface.resultant();
        if let Some(force) = interface.force() {
            let kinetic = self.has_balance.then_some(energies.dem.kinetic);
            self.derived.book(Crossed { span, force, motion: interface.answered(), kinetic });
        }
        self.unreported = Some(window);
    }

    /// Report the last committed window to the observer, once.
    pub(crate) fn report(&mut self, observer: &mut dyn Observer) -> Result<(), CouplingError> {
        let Some(Iterated { span, iteration, residual, converged }) = self.unreported.take() else {
            return Ok(());
        };
        let Answers { dem, fem, touches, contact, .. } = &self.answers;
        let (touches, contact, balance, counts) = (*touches, *contact, &self.balance, &self.counts);
        let iterations = iteration;
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
}
