//! The balance of energy of a whole system, and the energy to which its error relates.

use super::limits::{ENERGY_ERROR, Limits};
use super::numbers::percent;
use super::summary::Summary;
use interface_defs::{Diagnostic, Gauge, Measure, Role, Worse, code};
use serde::{Deserialize, Serialize};

/// Energies of a system at one time [J].
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Energies {
    /// Kinetic.
    pub kinetic: f64,
    /// Potential, of dead load.
    pub potential: f64,
    /// Stored (elastic).
    pub stored: f64,
    /// Dissipated since t = 0.
    pub dissipated: f64,
    /// Work received from outside since t = 0.
    pub received: f64,
}

impl Energies {
    /// Of gauges with these roles and values.
    pub fn of(values: impl IntoIterator<Item = (Role, f64)>) -> Self {
        let mut energies = Self::default();
        for (role, value) in values {
            match role {
                Role::None => {}
                Role::Kinetic => energies.kinetic += value,
                Role::Potential => energies.potential += value,
                Role::Stored => energies.stored += value,
                Role::Dissipated => energies.dissipated += value,
                Role::Received => energies.received += value,
            }
        }
        energies
    }

    /// What is constant in a system that keeps its energy [J].
    pub fn total(&self) -> f64 {
        self.parts().iter().sum()
    }

    fn parts(&self) -> [f64; 4] {
        [self.kinetic, self.potential - self.received, self.stored, self.dissipated]
    }
}

impl std::ops::Add for Energies {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            kinetic: self.kinetic + other.kinetic,
            potential: self.potential + other.potential,
            stored: self.stored + other.stored,
            dissipated: self.dissipated + other.dissipated,
            received: self.received + other.received,
        }
    }
}

/// Follows the energies of a system, window by window.
///
/// The energy error is the largest imbalance relative to the kinetic energy at impact. With several impacts
/// that is the largest kinetic energy of the system with which a contact began; without contact, the largest
/// one at all. Energy that came from nowhere by then does not count, so that a computation that
/// diverges cannot hide behind its own speed. Where hardly anything moves (a block at rest, a slow load), it is a
/// tenth of the energy that has gone from one form to another, or a hundredth of that held in contacts.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Balance {
    start: Energies,
    /// Imbalance at the last time [J]: above 0, energy came from nowhere.
    pub imbalance: f64,
    /// Largest |imbalance| so far [J], and its time [s].
    pub largest: (f64, f64),
    /// Largest kinetic energy of an impact so far [J], less what came from nowhere.
    impact: f64,
    /// Largest kinetic energy so far [J].
    pub kinetic: f64,
    /// Largest energy that has gone from one form to another so far [J].
    exchanged: f64,
    /// Largest energy held in contacts so far [J], less what came from nowhere.
    held: f64,
    /// Largest sum of the absolute energies so far [J]: what rounding relates to.
    scale: f64,
    /// Windows in a row beyond a bound.
    beyond: u32,
    /// The largest |imbalance| so far [J], each time [s] that it had grown by [`GROWN`].
    grown: Vec<(f64, f64)>,
}

/// Growth of the largest imbalance after which it is noted, and most notes: 25 orders of magnitude.
const GROWN: f64 = 1.2;
const NOTES: usize = 320;

/// Share of the exchanged energy that counts where hardly anything moves.
const EXCHANGED: f64 = 0.1;

/// Share of the energy held in contacts that counts where hardly anything moves.
const HELD: f64 = 0.01;

/// Share of the energies at hand below which a change is one of rounding.
const ROUNDING: f64 = 1e-12;

/// Windows in a row beyond the bound that end a run. An imbalance that grows stays; one that comes from the first touch
/// of something at rest passes.
const PATIENCE: u32 = 3;

impl Balance {
    /// Of a system that starts with these energies.
    pub fn new(start: Energies) -> Self {
        let scale = start.parts().iter().map(|e| e.abs()).sum();
        Self { start, kinetic: start.kinetic, scale, grown: Vec::with_capacity(NOTES), ..Self::default() }
    }

    /// Take in the energies at `time` [s], of which `held` [J] is stored in contacts.
    pub fn update(&mut self, time: f64, now: &Energies, held: f64) {
        let changes: [f64; 4] = std::array::from_fn(|i| now.parts()[i] - self.start.parts()[i]);
        self.imbalance = changes.iter().sum();
        // Also where it is not a number: then nothing is known any more.
        if self.imbalance.abs() > self.largest.0 || self.imbalance.is_nan() {
            self.largest = (self.imbalance.abs(), time);
            let noted = self.grown.last().map_or(0.0, |(_, noted)| *noted);
            if self.largest.0 > GROWN * noted && self.grown.len() < NOTES {
                self.grown.push((time, self.largest.0));
            }
        }
        let gained: f64 = changes.iter().filter(|c| **c > 0.0).sum();
        let lost: f64 = changes.iter().filter(|c| **c < 0.0).map(|c| -c).sum();
        self.exchanged = self.exchanged.max(gained.min(lost));
        self.held = self.held.max(held - self.imbalance.max(0.0));
        self.kinetic = self.kinetic.max(now.kinetic);
        self.scale = self.scale.max(now.parts().iter().map(|e| e.abs()).sum());
    }

    /// A contact began when the system had this kinetic energy [J].
    pub fn impact(&mut self, kinetic: f64) {
        self.impact = self.impact.max(kinetic - self.imbalance.max(0.0));
    }

    /// The energy to which the error relates [J]; `None` where nothing has moved.
    pub fn reference(&self) -> Option<f64> {
        let reference = self.impact.max(EXCHANGED * self.exchanged).max(HELD * self.held);
        (self.kinetic > 0.0 && reference > ROUNDING * self.scale).then_some(reference)
    }

    /// Largest imbalance relative to the reference; `None` where nothing has moved.
    pub fn error(&self) -> Option<f64> {
        self.relative(self.largest.0)
    }

    /// The same of what came or went by `time` [s], within a fifth.
    pub fn error_by(&self, time: f64) -> Option<f64> {
        let by = self.grown.iter().take_while(|(at, _)| *at <= time).last();
        self.relative(by.map_or(0.0, |(_, largest)| *largest))
    }

    /// An energy [J] relative to the reference; `None` where nothing has moved.
    pub fn relative(&self, energy: f64) -> Option<f64> {
        self.reference().map(|reference| energy.abs() / reference)
    }

    /// What is said of a run that is ended because its energy has exploded by `time` [s], `cure` being what to try.
    pub fn diverged(&self, time: f64, limits: &Limits, cure: &str) -> Diagnostic {
        let what = if self.imbalance < 0.0 { "are lost" } else { "have come from nowhere" };
        let (energy, impact) = (self.imbalance.abs(), self.reference().unwrap_or(0.0));
        let share = percent(self.relative(energy).unwrap_or(f64::INFINITY));
        let message = format!(
            "the computation has diverged: at t = {time:.6} s {energy:.3e} J {what}, {share} of the {impact:.3e} J at impact \
             (limits.energy_error = {}, and ten times that ends a run)",
            percent(limits.energy_error)
        );
        Diagnostic::error(code::LIMIT, message).about("limits.energy_error").try_instead(cure)
    }

    /// Write it into the summary of a run: the section of energies, and the energy error as a measure.
    pub fn describe(&self, summary: &mut Summary) {
        summary.energy.insert("imbalance_largest_J".into(), self.largest.0.into());
        let Some((reference, error)) = self.reference().zip(self.error()) else {
            summary.warnings.push(absent(NOTHING_MOVED));
            return;
        };
        summary.energy.insert("reference_J".into(), reference.into());
        summary.energy.insert(ENERGY_ERROR.into(), error.into());
        summary.measures.push(error_measure(error, self.largest.1));
    }

    /// Whether the imbalance has left `bound` (relative to the reference) for good. To be asked once per window.
    pub fn has_left(&mut self, bound: f64) -> bool {
        let left = self.reference().is_some_and(|reference| self.imbalance.abs() > bound * reference);
        self.beyond = if left { self.beyond + 1 } else { 0 };
        self.beyond >= PATIENCE || self.imbalance.is_nan()
    }
}

/// Whether the gauges have a part in the balance of energy.
pub fn has_roles(gauges: &[Gauge]) -> bool {
    gauges.iter().any(|gauge| gauge.role != Role::None)
}

/// Why there is no energy error where nothing has moved.
pub const NOTHING_MOVED: &str =
    "nothing has moved (or the run is one of statics), so there is no energy to relate it to";

/// That there is no energy error, and why.
pub fn absent(why: &str) -> Diagnostic {
    Diagnostic::absent(ENERGY_ERROR, why)
}

/// The largest imbalance relative to the energy at impact, and its time [s].
pub fn error_measure(value: f64, time: f64) -> Measure {
    Measure::new(ENERGY_ERROR, value, "1").at(time).ranked(40, Worse::Larger)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn energies(kinetic: f64, potential: f64, stored: f64) -> Energies {
        Energies { kinetic, potential, stored, ..Energies::default() }
    }

    #[test]
    fn the_largest_imbalance_counts_relative_to_the_kinetic_energy_at_impact() {
        let mut balance = Balance::new(energies(0.0, 10.0, 0.0));
        assert_eq!(balance.error(), None);
        balance.update(1.0, &energies(8.0, 2.0, 0.0), 0.0);
        balance.impact(8.0);
        balance.update(2.0, &energies(3.0, 1.0, 5.0), 0.0);
        // The ninth joule is gone; by the end it is back.
        assert_eq!((balance.imbalance, balance.largest, balance.error()), (-1.0, (1.0, 2.0), Some(0.125)));
        balance.update(3.0, &energies(9.0, 1.0, 0.0), 0.0);
        assert_eq!((balance.imbalance, balance.error()), (0.0, Some(0.125)));
    }

    #[test]
    fn energy_from_nowhere_does_not_raise_what_its_error_relates_to() {
        let mut balance = Balance::new(energies(100.0, 0.0, 0.0));
        balance.impact(100.0);
        balance.update(1.0, &energies(9000.0, 0.0, 0.0), 0.0);
        balance.impact(9000.0);
        assert_eq!(balance.reference(), Some(100.0));
        assert_eq!(balance.error(), Some(89.0));
    }

    #[test]
    fn a_system_almost_at_rest_relates_to_the_energy_that_changed_its_form() {
        let mut balance = Balance::new(energies(0.0, 0.0, 0.0));
        balance.update(1.0, &energies(1e-9, -2.0, 1.0), 0.0);
        // One of two joules of potential energy is stored, the other is lost.
        let (reference, error) = balance.reference().zip(balance.error()).expect("energy was exchanged");
        assert!((reference - 0.1).abs() < 1e-9 && (error - 10.0).abs() < 1e-7, "{reference} {error}");
    }

    #[test]
    fn a_block_that_lies_in_contact_relates_to_the_energy_held_there() {
        let mut balance = Balance::new(energies(0.0, 0.0, 5.0));
        balance.update(1.0, &energies(1e-9, 0.0, 5.001), 5.001);
        // The millijoule that is made does not count: a fiftieth of a hundredth of 5 J.
        let error = balance.error().expect("moves");
        assert!((error - 0.001 / 0.05).abs() < 1e-6, "{error}");
    }

    #[test]
    fn rounding_of_what_stays_where_it_is_has_no_error() {
        let mut balance = Balance::new(energies(0.0, 1e6, 3.0));
        balance.update(1.0, &energies(1e-25, 1e6 + 1e-9, 3.0), 0.0);
        assert_eq!(balance.error(), None);
        let mut statics = Balance::new(energies(0.0, 0.0, 0.0));
        statics.update(1.0, &energies(0.0, -2.0, 1.0), 0.0);
        assert_eq!(statics.error(), None);
    }

    #[test]
    fn a_bound_is_left_for_good_after_three_windows_or_by_what_is_no_number() {
        let mut balance = Balance::new(energies(1.0, 0.0, 0.0));
        balance.impact(1.0);
        let mut left = |created: f64| {
            balance.update(0.0, &energies(1.0 + created, 0.0, 0.0), 0.0);
            balance.has_left(1.0)
        };
        assert_eq!([2.0, 2.0, 0.5, 2.0, 2.0, 3.0].map(&mut left), [false, false, false, false, false, true]);
        assert!(left(f64::NAN));
    }
}
