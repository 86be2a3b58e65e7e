//! The table `[limits]`: bounds of trust. A run that passes one is `unreliable`, never `done`.

use super::numbers::{percent, rounded, short, three};
use super::scene::Scene;
use super::summary::{RunStatus, Summary};
use interface_defs::diagnostic::{Diagnostic, code};
use interface_defs::message::Found;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Bounds beyond which a run is not to be trusted.
///
/// A scene that shows a failing scheme on purpose raises them and says why.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Limits {
    /// Largest imbalance of the whole system's energy, relative to the kinetic energy at impact. Ten times
    /// this bound ends the run at once.
    pub energy_error: f64,
    /// Deepest overlap of a sphere, relative to its radius: laws of contact are ones of small overlaps. Default: none; above 0.5 a
    /// run is done with a warning.
    pub penetration: Option<f64>,
    /// Largest interface residual, as energy: the work of the contact force over the displacement on which the two solvers
    /// disagree, summed over the windows without regard to sign, relative to the energy to which `energy_error` relates. It
    /// shows noise at the interface, and windows that were accepted although they had not converged. Default: none; above 0.5
    /// a run is done with a warning.
    pub residual: Option<f64>,
    /// Longest window of weak coupling, relative to the longest one that `rockfall check` reports: up to that
    /// one disturbances stay small and the reaction over 1 ms is resolved; far beyond it the answer can be wrong
    /// although energy is kept. The windows found to be right in `docs/accuracy.md` reach up to 1.25 times that one.
    pub weak_window: f64,
    /// Largest `uncertainty` of `max_deflection`, `max_travel` and `max_elongation` of a coupled run, relative to their values; of
    /// `max_reaction_1ms` and `max_cable_force` three times as much, as their estimates are larger. Default: a tenth of `energy_error`.
    pub deflection_error: Option<f64>,
}

impl Default for Limits {
    fn default() -> Self {
        Self {
            energy_error: 0.1,
            penetration: None,
            residual: None,
            weak_window: 1.25,
            deflection_error: None,
        }
    }
}

/// So many times the bound of energy ends a run at once.
const FATAL: f64 = 10.0;

/// Largest bound of an overlap over the radius: spheres that overlap by more have passed each other.
const DEEPEST: f64 = 2.0;

/// Penetration and residual above which a run is done with a warning, where they have no bound.
pub const NOTICED: f64 = 0.5;

/// Energy error above which a run is done with a warning.
const NOTICE: f64 = 0.01;

impl Limits {
    /// From the scene; the whole table may be absent.
    pub fn of(scene: &Scene) -> Result<Self, Diagnostic> {
        let limits: Self = scene.read("limits")?.unwrap_or_default();
        for (key, bound) in [
            ("energy_error", Some(limits.energy_error)),
            ("penetration", limits.penetration),
            ("residual", limits.residual),
            ("weak_window", Some(limits.weak_window)),
            ("deflection_error", limits.deflection_error),
        ] {
            if let Some(bound) = bound.filter(|bound| *bound <= 0.0) {
                let what = format!("a bound of {bound} would be passed by every run, it must lie above 0");
                let default = "leave the key out for the default, or raise the bound to accept more";
                return scene.refuse(&format!("limits.{key}"), what, default);
            }
        }
        if let Some(bound) = limits.penetration.filter(|bound| *bound > DEEPEST) {
            let meant = 0.01 * bound;
            let what = format!("a bound of {bound} radii: no run passes it, two spheres part at 2");
            let cure = format!("it is a share of the radius: 50 % is 0.5, here perhaps {meant:?}");
            return scene.refuse("limits.penetration", what, cure);
        }
        Ok(limits)
    }

    /// Shares that may have been meant as percentages. A scene that shows a failing scheme on purpose raises `weak_window` too.
    pub fn warnings(&self) -> Vec<Diagnostic> {
        if self.weak_window > Self::default().weak_window {
            return Vec::new();
        }
        let shares = [
            ("energy_error", Some(self.energy_error)),
            ("residual", self.residual),
            ("deflection_error", self.deflection_error),
        ];
        let whole = shares.into_iter().filter_map(|(key, share)| Some((key, share.filter(|s| *s >= 1.0)?)));
        whole
            .map(|(key, share)| {
                let bound = percent(share);
                let what = format!("{share} is a share, so a bound of {bound}, and hardly any run passes it");
                let warning = Diagnostic::warning(code::LIKELY_UNIT, what).about(format!("limits.{key}"));
                warning.try_instead(format!("{share} % is {key} = {}", short(0.01 * share)))
            })
            .collect()
    }

    /// Energy error beyond which a run ends at once.
    pub fn fatal_energy_error(&self) -> f64 {
        FATAL * self.energy_error
    }

    /// Uncertainty of the deflection beyond which a coupled run is not to be trusted.
    fn deflection_bound(&self) -> f64 {
        self.deflection_error.unwrap_or(0.1 * self.energy_error)
    }

    /// The same of a measure of this name; none of most.
    fn uncertainty_bound(&self, name: &str) -> Option<f64> {
        let ends = |names: &[&str]| names.iter().any(|end| name.ends_with(end));
        if ends(&["max_deflection", "max_travel", "max_elongation"]) {
            return Some(self.deflection_bound());
        }
        ends(&["max_reaction_1ms", "max_cable_force"]).then(|| 3.0 * self.deflection_bound())
    }

    /// Judge a run that has ended: each bound that it passed becomes a sentence of its message (of its
    /// warnings, where it has not come to its end).
    pub fn judge(&self, summary: &mut Summary, evidence: &Evidence) {
        let [mut passed, mut noticed] = [const { Vec::<(String, &str)>::new() }; 2];
        for measure in &summary.measures {
            let (name, value) = (measure.name.as_str(), measure.value);
            let at = measure.time.map_or(String::new(), |t| format!(" at {t:.6} s"));
            if name == ENERGY_ERROR {
                let is = format!("energy_error is {}{at}", percent(value));
                if value > self.energy_error {
                    let what = format!("{is}, above limits.energy_error = {}", percent(self.energy_error));
                    passed.push((what, evidence.energy.as_str()));
                } else if value > NOTICE {
                    noticed.push((is, evidence.energy.as_str()));
                }
            }
            let bound = self.penetration.unwrap_or(NOTICED);
            if name.contains("max_penetration") && measure.unit == "1" && value > bound {
                let what = format!("{name} is {value:.3} radii{at}, above limits.penetration = {bound}");
                if self.penetration.is_some() { &mut passed } else { &mut noticed }.push((what, TOO_SOFT));
            }
        }
        let of_measures = match evidence.residual {
            Some(_) => self.of_measures(summary, &evidence.energy),
            None => Vec::new(),
        };
        let bound = self.residual.unwrap_or(NOTICED);
        if let Some(share) = evidence.residual.filter(|share| *share > bound) {
            let [share, bound] = [share, bound].map(percent);
            let what = format!(
                "the solvers disagree about interface work of {share} of the energy at impact, above limits.residual = {bound}"
            );
            if self.residual.is_some() { &mut passed } else { &mut noticed }
                .push((what, &evidence.interface));
        }
        let notice = |(what, cure): (String, &str)| Diagnostic::warning(code::LIMIT, what).try_instead(cure);
        summary.warnings.extend(noticed.into_iter().map(notice));
        let is_near = |warning: &mut Diagnostic| warning.code == code::NEAR_RUPTURE;
        let nearly: Vec<_> = summary.warnings.extract_if(.., is_near).collect();
        if let Some(what) = evidence.weak_window.and_then(|windows| self.of_weak_window(windows)) {
            passed.push((what, SHORTEN));
        }
        if passed.is_empty() && nearly.is_empty() && of_measures.is_empty() {
            return;
        }
        if summary.status == RunStatus::Done {
            let reason = |(what, cure): (String, &str)| {
                Diagnostic::error(code::LIMIT, what).try_if((!cure.is_empty()).then(|| cure.to_owned()))
            };
            let passed = passed.into_iter().map(reason);
            summary.doubt(nearly.into_iter().chain(passed).chain(of_measures).collect());
        } else {
            // Its message has the cause.
            let warnings = passed.into_iter().map(|(what, _)| Diagnostic::warning(code::LIMIT, what));
            summary.warnings.extend(nearly.into_iter().chain(warnings));
        }
    }

    /// Key of the bounds of measures.
    pub const OF_MEASURES: &str = "limits.deflection_error";

    /// Mark the measures that may be off by more than their bounds. Those that a run stands for are reasons not to trust it; a
    /// cable force, in which wires swing, is warned of.
    pub fn of_measures(&self, summary: &mut Summary, cure: &str) -> Vec<Diagnostic> {
        let mut reasons = Vec::new();
        for measure in &mut summary.measures {
            let (name, size) = (&measure.name, measure.value.abs());
            let Some((bound, uncertainty)) = self.uncertainty_bound(name).zip(measure.uncertainty.as_mut())
            else {
                continue;
            };
            // Shorter steps do not help against chance.
            let of_steps = uncertainty.value.filter(|_| uncertainty.by != Found::Vibration);
            let share = of_steps.map_or(0.0, |value| value / size);
            uncertainty.beyond = share > bound;
            if !uncertainty.beyond {
                continue;
            }
            let [share, bound] = [rounded(share, 2), bound].map(percent);
            let at = measure.time.map_or(String::new(), |t| format!(" at {t:.6} s"));
            let what = format!("{name}{at} may be off by {share}, above the bound of {bound}");
            if name.ends_with("max_cable_force") {
                let cure = "run it with --refine, or shorten the steps of [fem] and windows: wires swing faster than they resolve";
                let warning = Diagnostic::warning(code::LIMIT, what).about(Self::OF_MEASURES);
                summary.warnings.push(warning.try_instead(cure));
            } else {
                let reason = Diagnostic::error(code::LIMIT, what).about(Self::OF_MEASURES);
                reasons.push(reason.try_if((!cure.is_empty()).then(|| cure.to_owned())));
            }
        }
        reasons
    }

    /// What is said of a weak window that is too long, if it is: its length and the longest [s].
    fn of_weak_window(&self, (window, longest): (f64, f64)) -> Option<String> {
        let (share, bound) = (window / longest, self.weak_window);
        let ([window, longest], times) = ([window, longest].map(short), three(share));
        let what = format!(
            "coupling.time_window = {window} s is {times} times the longest window of weak coupling, {longest} s, above \
             limits.weak_window = {bound}"
        );
        (share > bound * (1.0 + ROUNDING)).then_some(what)
    }
}

/// Windows are compared as they are printed, with six digits.
const ROUNDING: f64 = 1e-5;

/// What to try against too long a weak window.
const SHORTEN: &str = "beyond it nobody vouches for the reaction or the deflection, even where energy is kept; shorten \
     coupling.time_window, or set coupling.scheme = \"strong\"";

/// What to try against too deep an overlap.
pub const TOO_SOFT: &str = "the contact is too soft for this speed; raise contact.young (or stiffness, ground_modulus), or cluster.smallest_radius; prints in soft ground (law = \"ground\") may be that deep: limits.penetration = 1.0";

/// Name of the measure to which [`Limits::energy_error`] applies.
pub const ENERGY_ERROR: &str = "energy_error";

/// What is known of a run beside its measures.
#[derive(Debug, Clone, Default)]
pub struct Evidence {
    /// What to try against an energy error, by its likely cause.
    pub energy: String,
    /// The number that [`Limits::residual`] bounds; `None` where there is no interface.
    pub residual: Option<f64>,
    /// Window of weak coupling, and the longest one [s]; `None` where either is not known.
    pub weak_window: Option<(f64, f64)>,
    /// What to try against it.
    pub interface: String,
}

/// What to try against an energy error of a solver that runs alone.
pub(super) fn cure(role: &str) -> &'static str {
    match role {
        "dem" => {
            "shorten the steps ([dem] time_step, or more steps_per_contact); energy that is lost at edges of a mesh is \
             kept by dem.contact_selection = \"continuous\""
        }
        _ => "shorten [fem] time_step, or choose an integrator that keeps the energy",
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use interface_defs::message::{Measure, Uncertainty};

    fn limits(text: &str) -> Result<Limits, String> {
        let scene = Scene::from_text("s.toml", text).map_err(|e| e.to_string())?;
        Limits::of(&scene).map_err(|e| e.to_string())
    }

    #[test]
    fn an_absent_table_gives_the_defaults_and_a_key_changes_one_bound() {
        let default = Limits {
            energy_error: 0.1,
            penetration: None,
            residual: None,
            weak_window: 1.25,
            deflection_error: None,
        };
        assert_eq!(limits(""), Ok(default));
        let raised = limits("[limits]\nenergy_error = 20\n").expect("valid");
        assert_eq!(raised, Limits { energy_error: 20.0, ..Limits::default() });
    }

    #[test]
    fn unknown_keys_and_bounds_that_every_run_passes_are_refused() {
        let unknown = limits("[limits]\nenergy = 1.0\n").expect_err("no such bound");
        assert!(unknown.starts_with("s.toml:2:1: unknown key `energy`"), "{unknown}");
        for key in ["energy_error", "penetration", "residual", "weak_window", "deflection_error"] {
            let zero = limits(&format!("[limits]\n{key} = 0.0\n")).expect_err("no bound");
            assert!(zero.starts_with(&format!("s.toml:2:{}: a bound of 0", key.len() + 4)), "{zero}");
        }
    }

    #[test]
    fn shares_that_look_like_percentages_are_named_unless_a_scene_fails_on_purpose() {
        let said = |text: &str| limits(&format!("[limits]\n{text}")).expect("valid").warnings();
        assert_eq!(said("energy_error = 0.5\ndeflection_error = 0.2\n"), Vec::<Diagnostic>::new());
        let ten = said("energy_error = 10\n");
        assert!(
            ten.len() == 1
                && ten[0].message.contains("1000 %")
                && ten[0].to_string().ends_with("energy_error = 0.1"),
            "{ten:?}"
        );
        assert_eq!(said("deflection_error = 1\nresidual = 50\n").len(), 2);
        assert_eq!(said("energy_error = 20\nresidual = 100\nweak_window = 3\n"), Vec::<Diagnostic>::new());
        let deep = limits("[limits]\npenetration = 50\n").expect_err("percent");
        assert!(deep.starts_with("s.toml:2:15: ") && deep.contains("perhaps 0.5"), "{deep}");
    }

    fn judged(status: RunStatus, energy_error: f64, penetration: f64, residual: f64) -> Summary {
        let mut summary = Summary::new(status);
        let measure = |name: &str, value| Measure::new(name, value, "1").at(0.25);
        summary.measures =
            vec![measure("energy_error", energy_error), measure("block_max_penetration", penetration)];
        let evidence = Evidence {
            energy: "try A".into(),
            residual: Some(residual),
            weak_window: None,
            interface: "try B".into(),
        };
        let limits = Limits { penetration: Some(0.5), residual: Some(0.5), ..Limits::default() };
        limits.judge(&mut summary, &evidence);
        summary
    }

    /// A coupled run of which one measure may be off by this share.
    fn uncertain(share: f64, name: &str) -> Summary {
        let mut summary = Summary::new(RunStatus::Done);
        let uncertainty = Some(Uncertainty { value: Some(2.0 * share), by: Found::Estimate, beyond: false });
        summary.measures = vec![Measure { uncertainty, ..Measure::new(name, 2.0, "m").at(0.25) }];
        let evidence = Evidence { energy: "try A".into(), residual: Some(0.0), ..Evidence::default() };
        Limits::default().judge(&mut summary, &evidence);
        summary
    }

    #[test]
    fn a_run_within_its_bounds_stays_done_and_each_bound_that_is_passed_is_named() {
        assert_eq!(judged(RunStatus::Done, 0.02, 0.5, 0.5).status, RunStatus::Done);
        for (share, name) in [(0.009, "max_travel"), (0.029, "max_reaction_1ms"), (0.5, "braking_time")] {
            assert_eq!(uncertain(share, name).status, RunStatus::Done, "{name}");
        }
        // A cable force is not to be trusted alone.
        let cable = uncertain(0.035, "max_cable_force");
        assert!(cable.measures[0].uncertainty.is_some_and(|of| of.beyond) && cable.warnings.len() == 1);
        assert_eq!(cable.status, RunStatus::Done);
        for (summary, says) in [
            (
                judged(RunStatus::Done, 0.12, 0.1, 0.1),
                "energy_error is 12 % at 0.250000 s, above limits.energy_error = 10 %: try A",
            ),
            (
                uncertain(0.025, "max_deflection"),
                "max_deflection at 0.250000 s may be off by 2.5 %, above the bound of 1 %: try A",
            ),
            (
                uncertain(0.035, "max_reaction_1ms"),
                "max_reaction_1ms at 0.250000 s may be off by 3.5 %, above the bound of 3 %: try A",
            ),
            (
                judged(RunStatus::Done, 0.0, 0.75, 0.1),
                "block_max_penetration is 0.750 radii at 0.250000 s, above limits.penetration = 0.5",
            ),
            (
                judged(RunStatus::Done, 0.0, 0.0, 0.8),
                "80 % of the energy at impact, above limits.residual = 50 %: try B",
            ),
        ] {
            assert_eq!(summary.status, RunStatus::Unreliable);
            let message = summary.message.expect("says why");
            assert!(message.contains(says), "{message}");
        }
        let failed = judged(RunStatus::Failed, 5.0, 0.0, 0.0);
        assert_eq!((failed.status, failed.message), (RunStatus::Failed, None));
        assert!(failed.warnings[0].message.contains("energy_error is 500 %"), "{:?}", failed.warnings);
    }

    #[test]
    fn a_weak_window_beyond_the_longest_is_unreliable_unless_the_bound_is_raised() {
        let judged = |window: f64, limits: Limits| {
            let mut summary = Summary::new(RunStatus::Done);
            let evidence = Evidence { weak_window: Some((window, 1.12375e-4)), ..Evidence::default() };
            limits.judge(&mut summary, &evidence);
            (summary.status, summary.message.unwrap_or_default())
        };
        // As it is printed it is within.
        assert_eq!(judged(0.000112375, Limits::default()).0, RunStatus::Done);
        let (status, message) = judged(2e-4, Limits::default());
        assert_eq!(status, RunStatus::Unreliable);
        let says = "coupling.time_window = 0.0002 s is 1.78 times the longest window of weak coupling, 0.000112375 s, \
                    above limits.weak_window = 1.25: ";
        assert!(message.contains(says), "{message}");
        assert_eq!(judged(2e-4, Limits { weak_window: 2.0, ..Limits::default() }).0, RunStatus::Done);
    }
}
