//! How far the measures of a run may be off, by what the run itself knows: an estimate that costs nothing. `rockfall run
//! --refine` finds it by a second run.
//!
//! Energy that came or went unbooked by the time of a measure, relative to that at impact, shows what steps and windows have
//! cost by then. A force that stands out of the steps before and after, or of its own mean over 1 ms, swings in modes that steps
//! hardly resolve. Where solvers exchange one mean force for each window, energy is kept however wrong the motion: there the length of
//! windows over the time in which the rock is stopped counts, too.
//!
//! The shares are fitted: rocks of 0.1 to 6e4 kg on nets up to a thousand times softer and stiffer than that of the drop test, every
//! scheme and preset, against runs with steps of 5 us (`docs/accuracy.md`).

use super::energy::Balance;
use interface_defs::message::{Found, Measure, Uncertainty};

/// What is known of the errors of one kind of measure: shares of relative errors.
struct Kind {
    /// End of its name.
    name: &'static str,
    /// Of the energy error by its time.
    energy: f64,
    /// Of how far it is above the measure of this name, its mean.
    swing: f64,
    mean: &'static str,
    /// Of [`of_windows`].
    windows: f64,
    /// What is left where all of these vanish.
    least: f64,
}

const fn kind(name: &'static str, energy: f64, windows: f64, least: f64) -> Kind {
    Kind { name, energy, swing: 0.0, mean: "", windows, least }
}

const KINDS: [Kind; 13] = [
    Kind { swing: 0.1, mean: "max_reaction_1ms", ..kind("max_reaction", 5.0, 1.5, 3e-3) },
    Kind { swing: 0.05, mean: "max_reaction", ..kind("max_reaction_1ms", 2.0, 1.5, 2e-3) },
    kind("max_reaction_10ms", 2.0, 1.5, 2e-3),
    Kind { swing: 8.0, mean: "cable_force_beside", ..kind("max_cable_force", 3.0, 2.0, 2e-3) },
    kind("max_deflection", 1.0, 0.4, 3e-4),
    kind("max_travel", 1.0, 0.4, 3e-4),
    // How far a wire swings, and when the last one leaves the rock, is not in the balance of energy.
    kind("max_elongation", 1.0, 0.4, 1e-3),
    // Flights are computed in closed form: what is left is how exactly the first touch is found within its step.
    kind("impact_speed", 1.0, 0.0, 1e-5),
    kind("impact_energy", 2.0, 0.0, 2e-5),
    kind("time_of_impact", 1.0, 0.0, 1e-5),
    kind("rebound_speed", 2.0, 0.7, 5e-3),
    kind("braking_time", 1.0, 0.6, 3e-4),
    kind("max_speed", 1.0, 0.0, 1e-9),
];

/// Means are taken over this time [s].
const MEAN: f64 = 1e-3;

/// What the run knows of its errors.
#[derive(Debug, Clone, Copy, Default)]
pub struct Known<'a> {
    /// Balance of energy, where all of it is reported.
    pub balance: Option<&'a Balance>,
    /// From when on measures depend on what small differences decide, and on what [s].
    pub chance: Option<(f64, Found)>,
    /// Time over which the force between rock and structure is a mean [s]; 0 where they move each other within it.
    pub mean: f64,
}

/// That time over the shortest one in which a rock is stopped.
pub fn of_windows(measures: &[Measure], mean: f64) -> f64 {
    let stopped = measures.iter().filter(|m| is_of(&m.name, "braking_time") && m.value > 0.0);
    stopped.map(|m| mean / m.value).fold(0.0, f64::max)
}

/// Fill in the uncertainty of every measure of which it is known.
pub fn estimate(measures: &mut [Measure], known: Known) {
    let Some(balance) = known.balance.filter(|balance| balance.error().is_some()) else { return };
    let values: Vec<(String, f64)> = measures.iter().map(|m| (m.name.clone(), m.value)).collect();
    let windows = of_windows(measures, known.mean);
    let vibrates = values.iter().any(|(name, _)| name == SLOW);
    for measure in measures {
        let Some(kind) = KINDS.iter().find(|kind| is_of(&measure.name, kind.name)) else { continue };
        if let Some((time, (from, by))) = measure.time.zip(known.chance)
            && time > if by == Found::Rupture { from - MEAN } else { from }
        {
            measure.uncertainty = Some(Uncertainty { value: None, by, beyond: false });
            continue;
        }
        let error = measure.time.map_or(balance.error(), |time| balance.error_by(time)).unwrap_or(0.0);
        let mean =
            values.iter().find(|(name, _)| name == kind.mean).map_or(measure.value, |(_, value)| *value);
        let mut swing = (measure.value - mean).abs() / measure.value.abs().max(f64::MIN_POSITIVE);
        if vibrates && kind.name.starts_with("max_reaction") {
            // No matter of steps: see `scatter`.
            swing = 0.0;
        }
        let share = kind.energy * error + kind.swing * swing + kind.windows * windows + kind.least;
        let value = Some(share * measure.value.abs());
        measure.uncertainty = Some(Uncertainty { value, by: Found::Estimate, beyond: false });
    }
}

/// Mean of the reaction over 10 ms, which a structure gives that vibrates.
const SLOW: &str = "max_reaction_10ms";
/// Share by which a measure scatters: of how far it, or the reaction over 1 ms, is above that mean, and what is left without. Fitted
/// to 78 runs of six barriers, in several windows and with starts that differ by 1e-9 (`docs/accuracy.md`).
const SCATTER: [(&str, f64, f64); 9] = [
    ("max_reaction", 1.0, 0.0),
    ("max_reaction_1ms", 1.0, 0.0),
    (SLOW, 0.1, 0.0),
    ("max_cable_force", 0.2, 0.0),
    // When ropes touch a rock for the last time is a matter of chance, too.
    ("rebound_speed", 0.5, 0.02),
    ("max_deflection", 4e-3, 0.0),
    ("max_travel", 4e-3, 0.0),
    ("max_elongation", 4e-3, 0.0),
    ("braking_time", 4e-3, 0.0),
];

/// Add what is left to chance where a structure vibrates: starts that differ by rounding alone give reactions that differ by so much.
/// Bounds do not judge it, as no shorter step makes it smaller.
pub fn scatter(measures: &mut [Measure]) {
    let value = |name: &str| measures.iter().find(|m| m.name == name).map(|m| m.value);
    let Some((slow, fast)) = value(SLOW).zip(value("max_reaction_1ms")) else { return };
    for measure in measures {
        let Some((name, factor, least)) = SCATTER.iter().find(|(name, ..)| is_of(&measure.name, name)) else {
            continue;
        };
        let Some(Uncertainty { value: Some(off), by, .. }) = &mut measure.uncertainty else { continue };
        let peak = if *name == "max_reaction" { measure.value } else { fast };
        let chance = (factor * (1.0 - slow / peak).max(0.0) + least) * measure.value.abs();
        if chance > *off {
            *by = Found::Vibration;
        }
        *off += chance;
    }
}

/// Whether a measure is of this kind: those of one rock of several begin with its name.
fn is_of(name: &str, kind: &str) -> bool {
    name.strip_suffix(kind).is_some_and(|rock| rock.is_empty() || rock.ends_with('_'))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::energy::Energies;

    /// 100 J at impact; 0.1 J are lost by 1 s, and 5 J by 2 s.
    fn balance() -> Balance {
        let kinetic = |kinetic| Energies { kinetic, ..Energies::default() };
        let mut balance = Balance::new(kinetic(100.0));
        balance.impact(100.0);
        balance.update(1.0, &kinetic(99.9), 0.0);
        balance.update(2.0, &kinetic(95.0), 0.0);
        balance
    }

    fn estimated(name: &str, time: f64, torn: Option<f64>) -> Option<Uncertainty> {
        let balance = balance();
        let mut measures = vec![
            Measure::new(name, 10.0, "m").at(time),
            Measure::new("cable_force_beside", 9.9, "N"),
            Measure::new("max_reaction", 10.5, "N"),
        ];
        let chance = torn.map(|time| (time, Found::Rupture));
        estimate(&mut measures, Known { balance: Some(&balance), chance, mean: 0.0 });
        measures[0].uncertainty
    }

    fn share(name: &str, time: f64) -> f64 {
        estimated(name, time, None).and_then(|of| of.value).expect("known") / 10.0
    }

    #[test]
    fn energy_that_is_lost_after_a_measure_does_not_count_for_it() {
        assert!((share("max_deflection", 0.5) - 3e-4).abs() < 1e-15);
        assert!((share("max_deflection", 1.5) - 1.3e-3).abs() < 1e-12);
        assert!((share("block_max_travel", 2.5) - 0.050_3).abs() < 1e-12);
        assert_eq!(estimated("depth", 0.5, None), None, "nothing is known of it");
    }

    #[test]
    fn one_force_for_a_window_as_long_as_the_braking_is_not_trusted() {
        let balance = balance();
        let mut measures = ["block_max_travel", "block_braking_time", "impact_speed"]
            .map(|name| Measure::new(name, 0.01, "m").at(0.5))
            .to_vec();
        estimate(&mut measures, Known { balance: Some(&balance), mean: 5e-3, ..Known::default() });
        let share = |at: usize| measures[at].uncertainty.and_then(|of| of.value).expect("known") / 0.01;
        assert!((share(0) - 0.200_3).abs() < 1e-12 && (share(1) - 0.300_3).abs() < 1e-12);
        assert!((share(2) - 1e-5).abs() < 1e-15, "it is known before the first window of contact");
    }

    #[test]
    fn a_force_that_swings_is_less_certain() {
        assert!((share("max_cable_force", 0.5) - (8.0 * 0.01 + 2e-3)).abs() < 1e-12);
        assert!((share("max_reaction_1ms", 0.5) - (0.05 * 0.05 + 2e-3)).abs() < 1e-12);
    }

    #[test]
    fn a_reaction_that_swings_about_its_mean_of_10_ms_is_left_to_chance() {
        let balance = balance();
        let measure = |name: &str, value: f64| Measure::new(name, value, "N").at(0.5);
        let mut measures = ["max_reaction_1ms", "block_rebound_speed", "max_travel"]
            .map(|name| measure(name, 10.0))
            .to_vec();
        estimate(&mut measures, Known { balance: Some(&balance), ..Known::default() });
        let before = measures.clone();
        scatter(&mut measures);
        assert_eq!(measures, before, "a structure that does not vibrate gives no such mean");
        measures.push(measure(SLOW, 9.0));
        scatter(&mut measures);
        let known = |at: usize| measures[at].uncertainty.expect("known");
        let off = |at: usize| {
            known(at).value.expect("known") - before[at].uncertainty.and_then(|of| of.value).expect("known")
        };
        assert!(
            (off(0) - 1.0).abs() < 1e-12 && (off(1) - 0.7).abs() < 1e-12 && (off(2) - 4e-3).abs() < 1e-12
        );
        assert_eq!([0, 1, 2].map(|at| known(at).by), [Found::Vibration; 3]);
    }

    #[test]
    fn what_comes_after_a_rupture_depends_on_what_tore() {
        let after = estimated("max_reaction_1ms", 1.5, Some(1.0)).expect("stated");
        assert_eq!((after.value, after.by), (None, Found::Rupture));
        let before = estimated("max_reaction_1ms", 0.5, Some(1.0)).expect("stated");
        assert_eq!(before.by, Found::Estimate);
    }
}
