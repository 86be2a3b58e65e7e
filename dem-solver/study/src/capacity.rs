//! `[line.barrier]`: what a barrier on a line stops, judged by how members cross the line. No member is stopped in its fall: what it does
//! behind the line is what it does without a barrier, and is left out where what is behind barriers is counted.

use super::design::NUMBERS;
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

/// What becomes of a member: stopped (or passing, where there is no barrier), through the barrier, over it, elsewhere.
pub const FATES: usize = 4;

/// What is counted at a line by its fates; of a line without a barrier the first alone.
pub const COUNTED: [(&str, &[usize]); 6] = [
    ("passing", &[0, 1, 2]),
    ("not_reached", &[3]),
    ("stopped", &[0]),
    ("went_through", &[1]),
    ("passed_over", &[2]),
    ("behind_barrier", &[1, 2]),
];

/// Which of the [`FATES`] a member has that first crosses with this energy [J] and height of its centre [m]. One whose height is not
/// known is not stopped: it passes over.
pub fn fate(barrier: Option<Capacity>, first: Option<[f64; 2]>) -> usize {
    match (first, barrier) {
        (None, _) => 3,
        (Some([_, centre]), Some(of)) if centre.is_nan() || centre > of.height => 2,
        (Some([energy, _]), Some(of)) if energy > of.energy => 1,
        _ => 0,
    }
}

impl Capacity {
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
        let barrier = Some(Capacity { energy: 1e6, height: 4.0 });
        let of = |energy, centre| fate(barrier, Some([energy, centre]));
        assert_eq!([of(1e6, 4.0), of(1.01e6, 4.0)], [0, 1]);
        assert_eq!([of(1e3, 4.01), of(2e6, 4.01), of(1e3, f64::NAN)], [2; 3]);
        assert_eq!([fate(barrier, None), fate(None, Some([0.0; 2]))], [3, 0]);
    }
}
