//! The balance of energy of the whole system, and the work booked at the interface.
//!
//! Imbalance = change since t = 0 of kinetic + potential + stored + dissipated energy, over both
//! solvers. Nothing is taken from what the balance lacks, so what the coupling creates shows here.

use interface_defs::{Gauge, Layout, Role};

/// Which numbers of an answer are energies.
pub struct Account {
    energies: Vec<usize>,
    kinetic: Vec<usize>,
    start: f64,
    /// Whether every role of the balance is there.
    pub complete: bool,
}

impl Account {
    /// Of a solver with these gauges; `initial` is its answer at t = 0.
    pub fn new(gauges: &[Gauge], layout: &Layout, initial: &[f64]) -> Self {
        let of = |roles: &[Role]| -> Vec<usize> {
            let with_role = gauges.iter().enumerate().filter(|(_, g)| roles.contains(&g.role));
            with_role.map(|(i, _)| layout.gauge(i).start).collect()
        };
        let energies = of(&[Role::Kinetic, Role::Potential, Role::Stored, Role::Dissipated]);
        let has = |role| gauges.iter().any(|g| g.role == role);
        let complete = [Role::Kinetic, Role::Potential, Role::Stored, Role::Dissipated, Role::Received]
            .into_iter()
            .all(has);
        let mut account = Self { energies, kinetic: of(&[Role::Kinetic]), start: 0.0, complete };
        account.start = account.total(initial);
        account
    }

    fn total(&self, answer: &[f64]) -> f64 {
        self.energies.iter().map(|&i| answer[i]).sum()
    }

    /// Energy gained since t = 0 [J].
    pub fn gain(&self, answer: &[f64]) -> f64 {
        self.total(answer) - self.start
    }

    /// Kinetic energy [J].
    pub fn kinetic(&self, answer: &[f64]) -> f64 {
        self.kinetic.iter().map(|&i| answer[i]).sum()
    }
}

/// The run's balance.
#[derive(Debug, Clone, Copy, Default)]
pub struct Balance {
    /// Imbalance at the committed time [J].
    pub imbalance: f64,
    /// Largest |imbalance| so far [J], and its time [s].
    pub largest: (f64, f64),
    /// Largest kinetic energy so far [J].
    pub largest_kinetic: f64,
    /// Work booked on the structure [J].
    pub structure_work: f64,
    /// Work booked on the wall as the contact solver saw it [J].
    pub wall_work: f64,
    /// Sum of |difference of the two| over the windows [J].
    pub defect: f64,
}

impl Balance {
    /// Book a committed window that ends at `time` [s].
    pub fn book(&mut self, time: f64, imbalance: f64, kinetic: f64, (structure, wall): (f64, f64)) {
        self.imbalance = imbalance;
        if imbalance.abs() > self.largest.0 {
            self.largest = (imbalance.abs(), time);
        }
        self.largest_kinetic = self.largest_kinetic.max(kinetic);
        self.structure_work += structure;
        self.wall_work += wall;
        self.defect += (structure - wall).abs();
    }
}
