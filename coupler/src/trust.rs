//! What speaks against a run: bounds that it passed, and the likely cause.

use crate::energy::Balance;
use crate::observer::Counts;
use crate::settings::{CouplingSettings, Scheme};
use interface_defs::diagnostic::{Diagnostic, code};
use toolkit::limits::{Evidence, Limits};
use toolkit::numbers::percent;

/// What the cause of an error is read from.
pub struct Causes<'a> {
    /// How the run is coupled.
    pub settings: &'a CouplingSettings,
    /// What was done.
    pub counts: &'a Counts,
    /// Energy and work.
    pub balance: &'a Balance,
    /// Whether both solvers report all energies.
    pub has_balance: bool,
}

impl Causes<'_> {
    /// For the judgement at the end.
    pub fn evidence(&self) -> Evidence {
        Evidence {
            energy: self.of_energy(),
            residual: self.balance.residual_share(self.has_balance),
            weak_window: match self.settings.scheme {
                Scheme::Weak => {
                    self.settings.longest_weak_window.map(|longest| (self.settings.time_window, longest))
                }
                Scheme::Strong => None,
            },
            interface: self.of_interface(),
        }
    }

    /// Why energy came from nowhere or is lost, by the place where most of it did, and what to try.
    fn of_energy(&self) -> String {
        let [dem, fem, interface] = self.balance.origins();
        let (dem_size, fem_size, interface_size) = (dem.abs(), fem.abs(), interface.abs());
        let cause = if interface_size >= dem_size.max(fem_size) {
            format!("{interface:.3e} J of it arose between the solvers: {}", self.of_interface())
        } else if dem_size > fem_size {
            format!(
                "{dem:.3e} J of it arose in the contact solver's own steps: shorten its steps (dem-solver's: [dem] time_step, or more \
                 steps_per_contact); energy that is lost where wires cross is kept by dem.contact_selection = \"continuous\""
            )
        } else {
            format!(
                "{fem:.3e} J of it arose in the structure's own steps: shorten them (fem-solver's: [fem] time_step); of a solver of your own, see that \
                 its gauges of energy have the right roles"
            )
        };
        if self.balance.touched_at_start {
            return format!(
                "a rock touches the net from the start: does it start inside of it? If not: {cause}"
            );
        }
        cause
    }

    fn of_interface(&self) -> String {
        let window = self.settings.time_window;
        match self.settings.scheme {
            Scheme::Weak => format!(
                "the weak window of {window:e} s is too long for the stiffness of this contact (`rockfall check` \
                 gives the longest one); shorten coupling.time_window, or set coupling.scheme = \"strong\""
            ),
            Scheme::Strong if self.counts.unconverged > 0 => format!(
                "{} of {} windows were accepted although they had not converged; raise coupling.max_iterations, or set \
                 coupling.on_no_convergence = \"halve\"",
                self.counts.unconverged, self.counts.windows
            ),
            Scheme::Strong => format!(
                "lower coupling.tolerance ({:e}) and absolute_tolerance ({:e} m), or shorten coupling.time_window ({window:e} \
                 s)",
                self.settings.tolerance, self.settings.absolute_tolerance
            ),
        }
    }

    /// The energy error by now, if it is beyond its bound: said with a failure that it may explain.
    pub fn beyond(&self, limits: &Limits) -> Option<Diagnostic> {
        let error = self.has_balance.then(|| self.balance.system.error()).flatten()?;
        let what = || format!("by then the energy error was {}, and {}", percent(error), self.of_energy());
        (error > limits.energy_error).then(|| Diagnostic::error(code::LIMIT, what()))
    }

    /// What is said of a run that is ended because its energy has exploded by `time` [s].
    pub fn diverged(&self, time: f64, limits: &Limits) -> Diagnostic {
        self.balance.system.diverged(time, limits, &self.of_energy())
    }
}
