//! The balance of energy of the whole system, and the work booked at the interface.
//!
//! Imbalance = change since t = 0 of kinetic + potential + stored + dissipated energy, over both
//! solvers. Nothing is taken from what the balance lacks, so what the coupling creates shows here.

use interface_defs::{Gauge, Layout, Role};
use serde::{Deserialize, Serialize};
use toolkit::energy::{Balance as System, Energies};

/// Which numbers of an answer are energies.
pub struct Account {
    places: Vec<(Role, usize)>,
    /// Energies at t = 0.
    pub start: Energies,
    /// Whether every role of the balance is there.
    pub complete: bool,
    /// Whether it reports the work that it received.
    pub receives: bool,
}

impl Account {
    /// Of a solver with these gauges; `initial` is its answer at t = 0.
    pub fn new(gauges: &[Gauge], layout: &Layout, initial: &[f64]) -> Self {
        let with_role = gauges.iter().enumerate().filter(|(_, g)| g.role != Role::None);
        let places: Vec<_> = with_role.map(|(i, g)| (g.role, 3 * i)).collect();
        let has = |role| gauges.iter().any(|g| g.role == role);
        let complete = [Role::Kinetic, Role::Potential, Role::Stored, Role::Dissipated, Role::Received]
            .into_iter()
            .all(has);
        let mut account =
            Self { places, start: Energies::default(), complete, receives: has(Role::Received) };
        account.start = account.energies(&initial[layout.gauges()]);
        account
    }

    /// Energies among the gauges of an answer, three numbers each.
    pub fn energies(&self, gauges: &[f64]) -> Energies {
        Energies::of(self.places.iter().map(|(role, place)| (*role, gauges[*place])))
    }
}

/// Energies of both solvers at the end of a window.
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize)]
pub struct Both {
    /// Of the contact solver.
    pub dem: Energies,
    /// Of the structure.
    pub fem: Energies,
}

impl Both {
    /// Of the whole system: what one solver receives through the interface the other one gives.
    fn system(&self) -> Energies {
        Energies { received: 0.0, ..self.dem + self.fem }
    }
}

/// Work of the mean force in one window.
#[derive(Debug, Clone, Copy, Default)]
pub struct Work {
    /// On the structure [J].
    pub structure: f64,
    /// On the interface mesh as the contact solver saw it [J].
    pub mesh: f64,
    /// Whether there was any force.
    pub touched: bool,
}

/// The run's balance.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub struct Balance {
    /// Imbalance at the committed time [J].
    pub imbalance: f64,
    /// Balance of the whole system.
    pub system: System,
    /// Work booked on the structure [J].
    pub structure_work: f64,
    /// Work booked on the interface mesh as the contact solver saw it [J].
    pub mesh_work: f64,
    /// Sum of |difference of the two| over the windows [J].
    pub defect: f64,
    /// Whether the first window had contact already.
    pub touched_at_start: bool,
    start: Both,
    now: Both,
    touched: bool,
    /// Largest work booked on the structure so far [J].
    largest_work: f64,
}

impl Balance {
    /// Of a system that starts with these energies.
    pub fn new(start: Both) -> Self {
        Self { system: System::new(start.system()), start, now: start, ..Self::default() }
    }

    /// Book a committed window from `start` to `end` [s].
    pub fn book(&mut self, (start, end): (f64, f64), now: Both, work: Work) {
        if work.touched && !self.touched {
            self.system.impact(self.now.system().kinetic);
            self.touched_at_start |= start == 0.0;
        }
        self.touched = work.touched;
        self.now = now;
        self.system.update(end, &now.system(), now.dem.stored);
        self.imbalance = self.system.imbalance;
        self.structure_work += work.structure;
        self.mesh_work += work.mesh;
        self.largest_work = self.largest_work.max(self.structure_work.abs());
        self.defect += (work.structure - work.mesh).abs();
    }

    /// Energy that would have come from nowhere in a window that ends with `now` [J], where something touched the net before it:
    /// what is lost on terrain, shorter windows do not keep.
    pub fn made(&self, now: Both) -> f64 {
        if self.touched { now.system().total() - self.now.system().total() } else { 0.0 }
    }

    /// The interface residual as energy: work on which the solvers disagree, relative to the energy at
    /// impact, or where that is not known to the largest work done on the structure.
    pub fn residual_share(&self, has_balance: bool) -> Option<f64> {
        let known = if has_balance { self.system.reference() } else { None };
        let reference = known.unwrap_or(self.largest_work);
        (reference > 0.0).then(|| self.defect / reference)
    }

    /// Work booked on the structure, or that the contact solver's mesh gave; that which this solver says it received; and the
    /// largest of all in the run [J]. `None` where none was done.
    pub fn work_apart(&self, of_structure: bool) -> Option<(f64, f64, f64)> {
        let received = |now: Energies, start: Energies| now.received - start.received;
        let (booked, received) = match of_structure {
            true => (self.structure_work, received(self.now.fem, self.start.fem)),
            false => (-self.mesh_work, received(self.now.dem, self.start.dem)),
        };
        let size = self.largest_work.max(received.abs());
        (size > 0.0).then_some((booked, received, size))
    }

    /// Energy that came from nowhere by the committed time: in the contact solver's own steps, in the
    /// structure's, and at the interface between them [J].
    pub fn origins(&self) -> [f64; 3] {
        let dem = self.now.dem.total() - self.start.dem.total();
        let fem = self.now.fem.total() - self.start.fem.total();
        [dem, fem, self.structure_work - self.mesh_work]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rock(kinetic: f64, received: f64) -> Energies {
        Energies { kinetic, received, ..Energies::default() }
    }

    fn net(stored: f64, received: f64) -> Energies {
        Energies { stored, received, ..Energies::default() }
    }

    #[test]
    fn an_error_at_the_interface_is_distinguished_from_one_in_a_solver() {
        let mut balance = Balance::new(Both { dem: rock(100.0, 0.0), fem: net(0.0, 0.0) });
        let work = |structure, mesh| Work { structure, mesh, touched: true };
        // The rock gives 40 J, the net gets 45 J: the five are the interface's. One of its own is lost in the net.
        let now = Both { dem: rock(60.0, -40.0), fem: net(44.0, 45.0) };
        balance.book((0.0, 1.0), now, work(45.0, 40.0));
        assert_eq!(balance.origins(), [0.0, -1.0, 5.0]);
        assert_eq!((balance.imbalance, balance.system.error()), (4.0, Some(0.04)));
        assert_eq!(
            (balance.residual_share(true), balance.residual_share(false)),
            (Some(0.05), Some(5.0 / 45.0))
        );
        assert!(balance.touched_at_start);
    }

    #[test]
    fn the_impact_counts_when_contact_begins_not_while_it_lasts() {
        let mut balance = Balance::new(Both { dem: rock(10.0, 0.0), fem: net(0.0, 0.0) });
        let none = Work::default();
        let touching = Work { touched: true, ..none };
        balance.book((0.0, 1.0), Both { dem: rock(10.0, 0.0), fem: net(0.0, 0.0) }, none);
        balance.book((1.0, 2.0), Both { dem: rock(6.0, -4.0), fem: net(4.0, 4.0) }, touching);
        assert_eq!(balance.system.reference(), Some(10.0));
        assert!(!balance.touched_at_start);
    }
}
