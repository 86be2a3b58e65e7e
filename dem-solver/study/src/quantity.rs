//! The quantities of a finished fall, each declared once: a column of `members.csv`, and of some quantiles in the summary.

use dem_rocks::model::runout::RunOut;
use interface_defs::message::{Measure, Worse};
use toolkit::history::column;

/// What is known of a fall that has ended.
pub struct Ended<'a> {
    /// When it ended [s].
    pub time: f64,
    /// How far from its start, seen from above [m].
    pub run_out: f64,
    /// What was followed on its course.
    pub path: &'a RunOut,
    /// Deepest overlap over the radius.
    pub penetration: f64,
    /// Largest imbalance of energy over that of the largest impact.
    pub energy_error: f64,
}

/// A quantity of every member.
pub struct Quantity {
    /// Its name.
    pub name: &'static str,
    /// Its unit.
    pub unit: &'static str,
    /// Its value.
    pub of: fn(&Ended) -> f64,
    /// Whether the summary has its quantiles.
    pub quantiles: bool,
    /// Whether trajectories and ends on the map have it.
    pub mapped: bool,
    /// Whether it is known of rocks that came to rest alone: of others it is at least that at which they were seen last.
    pub at_rest: bool,
    /// Place of its quantiles among the measures.
    pub rank: u16,
    /// In which direction it is worse.
    pub worse: Worse,
}

impl Quantity {
    const fn new(name: &'static str, unit: &'static str, of: fn(&Ended) -> f64) -> Self {
        let (quantiles, mapped, at_rest) = (false, false, false);
        Self { name, unit, of, quantiles, mapped, at_rest, rank: Measure::ORDINARY, worse: Worse::Neither }
    }

    const fn quantiles(mut self, worse: Worse) -> Self {
        (self.quantiles, self.worse) = (true, worse);
        self
    }

    const fn mapped(mut self) -> Self {
        self.mapped = true;
        self
    }

    const fn at_rest(mut self) -> Self {
        self.at_rest = true;
        self
    }

    /// Name of its column.
    pub fn column(&self) -> String {
        column(self.name, self.unit)
    }
}

/// All of them, in the order of their columns. A new one takes a line here.
pub const QUANTITIES: [Quantity; 9] = [
    Quantity::new("time", "s", |fall| fall.time).quantiles(Worse::Neither).mapped().at_rest(),
    Quantity::new("run_out", "m", |fall| fall.run_out).quantiles(Worse::Larger).mapped().at_rest(),
    Quantity::new("max_speed", "m/s", |fall| fall.path.fastest.0).quantiles(Worse::Larger).mapped(),
    Quantity::new("max_kinetic_energy", "J", |fall| fall.path.most_energy.0)
        .quantiles(Worse::Larger)
        .mapped(),
    Quantity::new("max_jump_height", "m", |fall| fall.path.highest.0).quantiles(Worse::Larger).mapped(),
    Quantity::new("impacts", "1", |fall| fall.path.impacts as f64).quantiles(Worse::Neither),
    Quantity::new("contact_time_fraction", "1", |fall| match fall.time > 0.0 {
        true => fall.path.in_contact / fall.time,
        false => 0.0,
    }),
    Quantity::new("max_penetration", "1", |fall| fall.penetration),
    Quantity::new("energy_error", "1", |fall| fall.energy_error),
];
