//! `[line.barrier]`: what a barrier on a line stops, judged by how members cross the line. No member is stopped in its fall: what it does
//! behind the line is what it does without a barrier.

use super::design::NUMBERS;
use super::track::Crossing;
use interface_defs::diagnostic::Diagnostic;
use schemars::JsonSchema;
use serde::Deserialize;
use toolkit::ranges::Gate;
use toolkit::scene::Scene;

/// What a barrier on the line stops: counted are the members that it stops, those that go through and those that pass over, by their
/// first crossing. Members are not stopped in the fall itself.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Capacity {
    /// Largest kinetic energy, rotation included, that it stops [J].
    pub energy: f64,
    /// Its height [m]: a rock whose centre is higher above the ground passes over.
    pub height: f64,
}

/// What becomes of members at a barrier, in words of measures.
pub const FATES: [&str; 3] = ["stopped", "went_through", "passed_over"];

impl Capacity {
    /// Which of the [`FATES`] a member has that crosses like this. One whose height is not known is not stopped: it passes over.
    pub fn fate(&self, first: &Crossing) -> usize {
        match () {
            () if first.centre.is_nan() || first.centre > self.height => 2,
            () if first.energy > self.energy => 1,
            () => 0,
        }
    }

    /// Refuse what is certainly wrong, and warn of what is unusual; `key` is that of the table.
    pub fn check(&self, key: &str, study: &Scene) -> Result<Vec<Diagnostic>, Diagnostic> {
        let mut said = Vec::new();
        for (name, value, of_design) in [("energy", self.energy, 0), ("height", self.height, 1)] {
            Gate { key: name, ..NUMBERS[of_design] }.pass(study, key, value, &mut said)?;
        }
        Ok(said.into_iter().map(|found| study.placed(found)).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rock_is_stopped_up_to_both_bounds_and_passes_over_before_it_goes_through() {
        let barrier = Capacity { energy: 1e6, height: 4.0 };
        let fate = |energy, centre| FATES[barrier.fate(&Crossing { energy, centre, ..Crossing::default() })];
        assert_eq!(fate(1e6, 4.0), "stopped");
        assert_eq!(fate(1.01e6, 4.0), "went_through");
        assert_eq!([fate(1e3, 4.01), fate(2e6, 4.01), fate(1e3, f64::NAN)], ["passed_over"; 3]);
    }
}
