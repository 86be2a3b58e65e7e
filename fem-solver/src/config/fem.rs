//! `[fem]`: how the structure is advanced in time.

use crate::read::Key;
use interface_defs::diagnostic::Diagnostic;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::fmt;
use toolkit::scene::Scene;

/// Most iterations of one step where the scene does not say.
const MOST_ITERATIONS: u32 = 30;
/// Shortest load step, relative to the first, where the scene does not say.
const SHORTEST_STEP: f64 = 1e-4;

/// Integrator, time step, Newton iteration.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct FemConfig {
    /// Scheme in time.
    pub integrator: Integrator,
    /// Longest step [s]: each window is cut into the fewest equal steps that are not longer. Default:
    /// half the critical step for `central_difference`, one step per window for the others. From the window on in which
    /// something breaks, steps of `central_difference` are an eighth of the critical step at most.
    pub time_step: Option<f64>,
    /// `generalized_alpha` only: spectral radius at infinite frequency, 0 to 1. Default 1, the implicit
    /// midpoint rule: it takes the mean force of a window and does exactly its work. Lower values
    /// damp what the step does not resolve, and cost energy.
    pub rho_inf: Option<f64>,
    /// `bossak` only: its alpha, -1/3 to 0. Default -0.3. Nearer to 0 damps less.
    pub alpha: Option<f64>,
    /// `newmark` only: beta, at least `gamma / 2`. Default 1/4, the trapezoidal rule.
    pub beta: Option<f64>,
    /// `newmark` only: gamma, at least 1/2. Default 1/2; above, it damps and is of first order only.
    pub gamma: Option<f64>,
    /// Iteration of the implicit schemes and of `static`.
    pub newton: NewtonConfig,
    /// `central_difference` only: nodes that would need shorter steps than this [s] get as much more mass as they
    /// need, without weight. A warning gives the added mass. Default: none.
    pub mass_scaling: Option<f64>,
    /// `static` only: follow the path of equilibrium under `[[structure.loads]]` and `[[structure.pressures]]` that grow and
    /// fall by one factor, from 0 on, beyond limit points and back (arc length). Time is the distance along it: the degree of freedom that moves most
    /// does so at this speed [m/s]. Steps adapt to the curvature of the path, whatever the output; none is longer than
    /// `time_step`. The columns `load_factor` and `negative_pivots` give the factor and in how many directions the
    /// equilibrium is unstable; the summary gives limit points and branch points. Default: the loads are constant.
    pub path_speed: Option<f64>,
    /// `static` only: load steps that adapt, within the windows and whatever their number. Default: one step per window, or
    /// of `time_step`.
    pub load_steps: Option<LoadSteps>,
    /// With `path_speed`: where a path goes on from a branch point behind which more directions are unstable. Default
    /// `straight`.
    pub path_at_branch: Option<AtBranch>,
    /// Accept a `time_step` above the critical one (`central_difference` only). Default false.
    pub allow_unstable: bool,
}

/// Load steps of statics that adapt: they grow where Newton is fast, and are halved and taken anew where it fails. None is longer
/// than `time_step`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LoadSteps {
    /// Length of the first step [s].
    pub first: f64,
    /// Length [s] below which no step is tried: the run ends there, with a message. Default: 1e-4 of `first`.
    pub shortest: Option<f64>,
}

impl LoadSteps {
    /// Shortest step [s].
    pub fn shortest(&self) -> f64 {
        self.shortest.unwrap_or(SHORTEST_STEP * self.first)
    }
}

/// Where a path goes on from a branch point.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum AtBranch {
    /// On the path that it came by, which is unstable from there.
    #[default]
    Straight,
    /// Into the path that crosses: a perfect structure buckles.
    Turn,
}

/// Scheme in time.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Integrator {
    /// No inertia: static equilibrium at the end of each step, under the force there.
    Static,
    /// Implicit, order 2, damping of high frequencies by `rho_inf`.
    GeneralizedAlpha,
    /// Implicit, order 2, damps high frequencies; balances at the step's end.
    Bossak,
    /// Implicit, trapezoidal by default; balances at the step's end.
    Newmark,
    /// Explicit, order 2, steps below the critical one; a step costs microseconds.
    #[default]
    CentralDifference,
}

/// When the Newton iteration of a step is content, and when it gives up.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct NewtonConfig {
    /// Largest residual, relative to the largest of load, internal force and inertia. Default 1e-10.
    pub tolerance: f64,
    /// Residual [N] that is taken for equilibrium after the last iteration, however small the forces: between weak springs or in
    /// slack rings rounding may leave more than the tolerance asks for. Not of form finding. Default 1e-6, the weight of 0.1 mg.
    pub floor: f64,
    /// Most iterations of one step, and of each time that form finding begins anew. Default: 30 of a step, 120 of one of statics,
    /// 200 of form finding.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max_iterations: Option<u32>,
    /// Whether a step that overshoots is shortened. Default true; false is for comparison.
    pub line_search: bool,
}

impl Default for NewtonConfig {
    fn default() -> Self {
        Self { tolerance: 1e-10, floor: 1e-6, max_iterations: None, line_search: true }
    }
}

impl NewtonConfig {
    /// Most iterations of one step.
    pub fn most_iterations(&self) -> u32 {
        self.max_iterations.unwrap_or(MOST_ITERATIONS)
    }
}

impl FemConfig {
    /// Refuse numbers out of range, and parameters of an integrator that is not chosen.
    pub fn check(&self, scene: &Scene) -> Result<(), Diagnostic> {
        let (newton, own) = (&self.newton, self.integrator);
        let key = Key { scene, key: "fem".into() };
        let first = self.load_steps.map(|steps| steps.first);
        let shortest = self.load_steps.as_ref().map(LoadSteps::shortest);
        for (name, value, unit) in [
            ("time_step", self.time_step, "s"),
            ("newton.tolerance", Some(newton.tolerance), ""),
            ("mass_scaling", self.mass_scaling, "s"),
            ("path_speed", self.path_speed, "m/s"),
            ("load_steps.first", first, "s"),
            ("load_steps.shortest", shortest, "s"),
        ] {
            value.map_or(Ok(()), |value| key.positive(&[(name, value, unit)]))?;
        }
        key.not_negative(&[("newton.floor", newton.floor, "N")])?;
        if newton.tolerance >= 1.0 {
            let what =
                format!("a tolerance of {} accepts what is no equilibrium: 1 is the load", newton.tolerance);
            return key.refuse("newton.tolerance", what, "1e-10 is the default");
        }
        if newton.max_iterations == Some(0) {
            let what = "no Newton iteration is allowed; write 1 or more";
            return Err(key.invalid("newton.max_iterations", what));
        }
        if self.path_at_branch.is_some() && self.path_speed.is_none() {
            let what = "without path_speed there is no path that could branch";
            let hint = "write path_speed too, or leave out path_at_branch";
            return key.refuse("path_at_branch", what, hint);
        }
        let least_beta = 0.5 * self.gamma.unwrap_or(0.5);
        for (name, of, value, range) in [
            ("mass_scaling", Integrator::CentralDifference, self.mass_scaling, 0.0..=f64::MAX),
            ("path_speed", Integrator::Static, self.path_speed, 0.0..=f64::MAX),
            ("load_steps", Integrator::Static, first, 0.0..=f64::MAX),
            ("rho_inf", Integrator::GeneralizedAlpha, self.rho_inf, 0.0..=1.0),
            ("alpha", Integrator::Bossak, self.alpha, -1.0 / 3.0..=0.0),
            ("gamma", Integrator::Newmark, self.gamma, 0.5..=1.0),
            ("beta", Integrator::Newmark, self.beta, least_beta..=1.0),
        ] {
            let Some(value) = value else { continue };
            let (from, to) = (range.start(), range.end());
            let what = if of != own {
                format!("{name} belongs to the integrator {of}, not to {own}")
            } else if !range.contains(&value) {
                format!("{name} is {value}, it must lie between {from} and {to}")
            } else {
                continue;
            };
            return Err(key.invalid(name, what));
        }
        let Some((first, shortest)) = first.zip(shortest) else { return Ok(()) };
        if self.path_speed.is_some() {
            let what = "a path of equilibrium has steps of its own: there are no load_steps along it";
            return key.refuse("load_steps", what, "leave out either load_steps or path_speed");
        }
        let end = scene.end_time()?;
        if first > end {
            let what = format!("the first step of {first} s is longer than the run, end_time = {end} s");
            return key.refuse("load_steps.first", what, "0.05 is 50 ms");
        }
        if shortest > first {
            let what = format!("the shortest step of {shortest} s is longer than the first, {first} s");
            return Err(key.invalid("load_steps.shortest", what));
        }
        Ok(())
    }

    /// The same with every default in place that does not depend on the structure.
    #[must_use]
    pub fn resolved(&self) -> Self {
        let mut full = self.clone();
        match self.integrator {
            Integrator::GeneralizedAlpha => full.rho_inf = self.rho_inf.or(Some(1.0)),
            Integrator::Bossak => full.alpha = self.alpha.or(Some(-0.3)),
            Integrator::Newmark => {
                full.gamma = self.gamma.or(Some(0.5));
                full.beta = self.beta.or(full.gamma.map(|g| 0.25 * (g + 0.5) * (g + 0.5)));
            }
            Integrator::Static => {
                if let Some(steps) = &mut full.load_steps {
                    steps.shortest = Some(steps.shortest());
                }
            }
            Integrator::CentralDifference => {}
        }
        full
    }
}

/// Its name in a scene.
impl fmt::Display for Integrator {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        self.serialize(f)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn refused(fem: &str) -> String {
        let scene = Scene::from_text("s.toml", &format!("[fem]\n{fem}\n")).expect("is TOML");
        let config: FemConfig = scene.read("fem").expect("is known").expect("is there");
        config.check(&scene).expect_err("must be refused").to_string()
    }

    #[test]
    fn a_parameter_of_another_integrator_is_refused_where_it_stands() {
        let message = refused("integrator = \"bossak\"\nrho_inf = 0.8");
        assert!(message.starts_with("s.toml:3:"), "{message}");
        assert!(message.contains("belongs to the integrator generalized_alpha"), "{message}");
    }

    #[test]
    fn a_branch_needs_a_path() {
        let message = refused("integrator = \"static\"\npath_at_branch = \"turn\"");
        assert!(message.starts_with("s.toml:3:") && message.contains("write path_speed too"), "{message}");
    }

    #[test]
    fn numbers_out_of_range_are_refused() {
        assert!(refused("time_step = -1e-5").contains("must lie above 0"));
        assert!(refused("integrator = \"generalized_alpha\"\nrho_inf = 1.5").contains("between 0 and 1"));
        assert!(refused("integrator = \"newmark\"\nbeta = 0.1").contains("between 0.25"));
    }

    #[test]
    fn newmark_with_more_damping_keeps_the_highest_frequency_damped() {
        let fem = FemConfig { integrator: Integrator::Newmark, gamma: Some(0.6), ..Default::default() };
        let beta = fem.resolved().beta.expect("is filled in");
        assert!((beta - 0.3025).abs() < 1e-15);
    }
}
