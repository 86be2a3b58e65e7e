//! `[coupling]`: its keys, their defaults, and what is refused or warned of. A new key has its field, default and check here.

use crate::acceleration::AnyAcceleration;
use crate::convergence::{Field, Measure, Tolerance};
use crate::mapping::AnyMapper;
use interface_defs::diagnostic::{Code, Diagnostic, code};
use nalgebra::Vector3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use toolkit::numbers::short;
use toolkit::output::Output;
use toolkit::scene::Scene;

/// Weak or strong.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Scheme {
    /// One pass per window, nothing is repeated: cheap, and limited in the window (`rockfall check` says where).
    Weak,
    /// Iterate until both sides agree.
    Strong,
}

/// What to do with a window that did not converge.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum OnNoConvergence {
    /// Accept it as it is, with a warning.
    Accept,
    /// Try again with half the window.
    Halve,
    /// End the run with exit code 1.
    Stop,
}

/// What `rockfall` chooses where the scene does not: a yielding net in windows of ten steps of the structure.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Preset {
    /// Longer steps of the structure, parts of 1 ms that just resolve its means.
    Fast,
    /// The steps that the solvers would take alone.
    Balanced,
    /// Half of the structure's steps, a quarter of the contact solver's, and a tenth of the tolerance.
    Accurate,
}

/// How the two solvers are coupled: required where a scene has rocks and a structure.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct CouplingSettings {
    /// Settings by name, measured in `docs/coupling.md`: `rockfall` fills in what the scene leaves open of this table and of the
    /// time steps of `[dem]` and `[fem]`.
    #[serde(skip_serializing)]
    pub preset: Option<Preset>,
    /// Weak or strong. Default: `rockfall` chooses.
    pub scheme: Scheme,
    /// Length of a window [s]. Default: `rockfall` computes it.
    #[serde(skip_serializing_if = "is_open")]
    pub time_window: f64,
    /// Longest window [s] in which weak coupling is stable and resolves the reaction, as `rockfall` estimates it; see
    /// `limits.weak_window`.
    pub longest_weak_window: Option<f64>,
    /// Largest residual, relative to the window's increment. A window is accepted when displacement and velocity each
    /// pass this or the absolute tolerance.
    pub tolerance: f64,
    /// Largest residual [m]; velocities count times the window.
    pub absolute_tolerance: f64,
    /// What is judged, and how; every measure that is named must pass. Default: the largest residual of displacement, and that of
    /// velocity, each with `tolerance` and `absolute_tolerance`.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub measure: Vec<Measure>,
    /// Most iterations of a window.
    pub max_iterations: u32,
    /// Order of the prediction of the net's motion at the start of a window: 0: it stays, 1: it continues at its velocity.
    pub predictor: u32,
    /// Parts of a window for which motion and mean force are exchanged: more resolve a contact that
    /// is shorter than the window.
    pub samples: u32,
    /// The contact solver advances the net in reach itself, with masses and tangents of the structure: windows of 1 ms then
    /// take one iteration. A structure that offers no tangents is coupled without, and the log says so.
    pub yielding_net: bool,
    /// Largest distance [m] between the net as the contact solver has moved it and the structure's answer, for a window of a
    /// yielding net to be accepted; or this share of the window's increment, `yielding_share`.
    pub yielding_tolerance: f64,
    /// The same, relative to the window's increment.
    pub yielding_share: f64,
    /// Rings of nodes around those in reach that a yielding net has.
    pub rings: u32,
    /// Longest window while nothing is in reach [s]: the output interval; 0: no longer than any other.
    #[serde(skip)]
    pub flight_window: f64,
    /// Whether the run ends once both solvers are at rest.
    #[serde(skip)]
    pub ends_at_rest: bool,
    /// What to do with a window that did not converge.
    pub on_no_convergence: OnNoConvergence,
    /// Shortest window that halving may reach [s]. Default: `time_window / 64`.
    pub min_window: Option<f64>,
    /// How a residual becomes the next iterate.
    pub acceleration: AnyAcceleration,
    /// How the meshes are connected. Default: node to node for equal meshes; for others one must be named.
    pub mapping: Option<AnyMapper>,
    /// Fingerprint of the scene that was read, compared with those of the solvers; `None`: it is not compared.
    #[serde(skip)]
    pub scene: Option<String>,
    /// Gravity of the scene [m/s2].
    #[serde(skip)]
    pub gravity: Vector3<f64>,
}

impl Default for CouplingSettings {
    /// Scheme and window are open: `rockfall` chooses them.
    fn default() -> Self {
        Self {
            preset: None,
            scheme: Scheme::Weak,
            time_window: f64::NAN,
            longest_weak_window: None,
            tolerance: 1e-4,
            absolute_tolerance: 1e-6,
            measure: Vec::new(),
            max_iterations: 30,
            predictor: 1,
            samples: 1,
            yielding_net: false,
            yielding_tolerance: 1e-5,
            yielding_share: 0.02,
            rings: 2,
            flight_window: 0.0,
            ends_at_rest: true,
            on_no_convergence: OnNoConvergence::Halve,
            min_window: None,
            acceleration: AnyAcceleration::default(),
            mapping: None,
            scene: None,
            gravity: Vector3::zeros(),
        }
    }
}

fn is_open(window: &f64) -> bool {
    window.is_nan()
}

/// Longest part of a strong window that resolves a mean over 1 ms [s].
const RESOLVED: f64 = 1e-3;

/// Part of a window of a yielding net for which motion and mean force are exchanged, if the scene does not say [s].
const PART_OF_YIELDING: f64 = 1e-4;

/// Absolute tolerance from which on something is said [m].
const COARSE: f64 = 1e-3;

/// Most parts of a window for which motion and force are exchanged.
const MOST_SAMPLES: u32 = 64;

/// Most rings of nodes around those in reach.
const MOST_RINGS: u32 = 20;

/// Keys that repeated windows alone use. Tolerances are no such keys: a scene keeps them for either scheme.
const OF_STRONG: [&str; 5] = ["acceleration", "max_iterations", "on_no_convergence", "min_window", "measure"];

/// Whether the scene itself names this key of `[coupling]`.
pub fn names(scene: &Scene, key: &str) -> bool {
    scene
        .document()
        .is_ok_and(|document| document.get("coupling").is_some_and(|table| table.get(key).is_some()))
}

/// A key of `[coupling]` that has no meaning as it is.
fn wrong(key: &str, message: impl Into<String>) -> Diagnostic {
    Diagnostic::new(message).about(format!("coupling.{key}"))
}

/// A warning about a key of `[coupling]`.
fn warn(code: Code, key: &str, message: impl Into<String>) -> Diagnostic {
    Diagnostic::warning(code, message).about(format!("coupling.{key}"))
}

fn check_tolerance(key: &str, name: &str, value: f64) -> Result<(), Diagnostic> {
    match value >= 0.0 {
        true => Ok(()),
        false => Err(wrong(key, format!("{name} must not be negative, it is {value}"))),
    }
}

/// A tolerance of 1 or more, and what is usual.
fn too_coarse(key: &str, name: &str, value: &str, usual: f64) -> Diagnostic {
    let what = format!("{name} must lie below 1: {value} accepts whatever the first iteration gives");
    wrong(key, what).try_instead(format!("{usual:e} is usual"))
}

impl CouplingSettings {
    /// Settings for `scheme` and `time_window` [s], all else by default.
    pub fn new(scheme: Scheme, time_window: f64) -> Self {
        Self { scheme, time_window, ..Self::default() }
    }

    /// From a scene that names scheme and window, checked.
    pub fn of(scene: &Scene) -> Result<Self, Diagnostic> {
        for key in ["scheme", "time_window"] {
            if !names(scene, key) {
                let what = format!("coupling.{key} is not named: the coupler alone cannot choose it");
                let cure = "start the scene with `rockfall run`, which chooses it; or let `rockfall check SCENE --resolved \
                            FILE` write it out, and give FILE to all programs";
                return Err(scene.invalid("coupling", what).coded(code::MISSING_KEY).try_instead(cure));
            }
        }
        let mut coupling = Self::open(scene)?;
        coupling.gravity = scene.gravity()?.into();
        if is_open(&coupling.time_window) {
            return Err(scene.invalid("coupling.time_window", "time_window must be positive, it is nan"));
        }
        Ok(coupling)
    }

    /// The same, where scheme and window may be left to `rockfall`: the window is not a number then.
    pub fn open(scene: &Scene) -> Result<Self, Diagnostic> {
        let mut coupling = scene.read::<Self>("coupling")?.unwrap_or_default();
        coupling.check().map_err(|wrong| scene.placed(wrong))?;
        coupling.check_against_run(scene)?;
        coupling.scene = Some(scene.fingerprint());
        coupling.flight_window = Output::of(scene)?.interval;
        if coupling.yielding_net && !names(scene, "samples") && !is_open(&coupling.time_window) {
            coupling.samples =
                (coupling.time_window / PART_OF_YIELDING).ceil().clamp(1.0, MOST_SAMPLES.into()) as u32;
        }
        Ok(coupling)
    }

    /// A window that is longer than the whole run.
    fn check_against_run(&self, scene: &Scene) -> Result<(), Diagnostic> {
        // A missing end_time is another's complaint.
        let Ok(end_time) = scene.end_time() else { return Ok(()) };
        if is_open(&self.time_window) || self.time_window <= end_time {
            return Ok(());
        }
        let what =
            format!("a window of {} s is longer than the run, end_time = {end_time} s", self.time_window);
        scene.refuse(
            "coupling.time_window",
            what,
            "it is written in seconds: 0.2 ms is 2e-4; or leave it out, and `rockfall` computes it",
        )
    }

    /// What the user should know: windows that resolve no reaction, and keys that weak coupling does not use.
    pub fn warnings(&self, scene: &Scene) -> Result<Vec<Diagnostic>, Diagnostic> {
        let mut warnings = Vec::new();
        let part = self.time_window / f64::from(self.samples);
        if self.scheme == Scheme::Strong && part > RESOLVED {
            let part = short(part);
            let what = format!(
                "forces are exchanged every {part} s, and the reaction is a mean over 1 ms, so that an impact is not resolved"
            );
            let warning = warn(code::UNUSUAL_VALUE, "time_window", what);
            warnings.push(warning.try_instead("0.2 ms is time_window = 2e-4"));
        }
        if self.scheme == Scheme::Strong {
            warnings.extend(self.never_or_always_converged());
        }
        let table: toml::Table = scene.read("coupling")?.unwrap_or_default();
        if self.scheme == Scheme::Weak && table.contains_key("scheme") {
            let unused = OF_STRONG.into_iter().filter(|key| table.contains_key(*key));
            let what = "weak coupling passes every window once, so nothing uses it";
            warnings.extend(unused.map(|key| {
                let warning = warn(code::UNUSED_KEY, key, what);
                warning.try_instead("leave it out, or write scheme = \"strong\"")
            }));
        }
        // Where no scheme is named, the net will yield.
        if !self.yielding_net && table.contains_key("scheme") {
            // A resolved scene names all keys, with their defaults.
            let usual = Self::default();
            let named = [
                ("yielding_tolerance", self.yielding_tolerance != usual.yielding_tolerance),
                ("yielding_share", self.yielding_share != usual.yielding_share),
                ("rings", self.rings != usual.rings),
            ];
            warnings.extend(named.into_iter().filter(|(_, named)| *named).map(|(key, _)| {
                let warning = warn(code::UNUSED_KEY, key, "nothing uses it without yielding_net = true");
                warning.try_instead("write that, or leave it out")
            }));
        }
        Ok(warnings)
    }

    /// What is said of settings with which hardly any window converges, or every one.
    fn never_or_always_converged(&self) -> Vec<Diagnostic> {
        let (mut warnings, usual) = (Vec::new(), Self::default());
        if self.tolerance == 0.0 && self.absolute_tolerance == 0.0 {
            let what = "both tolerances are 0, so that no window converges in which anything moves";
            let Tolerance { relative, absolute } = usual.tolerances();
            let hint = format!("{relative:e} is usual, and {absolute:e} m for absolute_tolerance");
            warnings.push(warn(code::UNUSUAL_VALUE, "tolerance", what).try_instead(hint));
        }
        if self.absolute_tolerance >= COARSE {
            let apart = short(self.absolute_tolerance);
            let what = format!("a window is accepted where the two sides are {apart} m apart");
            let hint = format!("{:e} m is usual", usual.absolute_tolerance);
            warnings.push(warn(code::UNUSUAL_VALUE, "absolute_tolerance", what).try_instead(hint));
        }
        if self.max_iterations == 1 {
            let what = "with one iteration a window converges only where nothing touches";
            let warning = warn(code::UNUSUAL_VALUE, "max_iterations", what);
            warnings.push(warning.try_instead("write more, or scheme = \"weak\""));
        }
        warnings
    }

    fn check(&self) -> Result<(), Diagnostic> {
        let positive = |key: &str, value: f64, unit: &str| match value > 0.0 {
            true => Ok(()),
            false => Err(wrong(key, format!("{key} must be positive, it is {value}{unit}"))),
        };
        if !is_open(&self.time_window) {
            positive("time_window", self.time_window, " s")?;
        }
        positive("max_iterations", self.max_iterations.into(), "")?;
        positive("samples", self.samples.into(), "")?;
        let usual = Self::default();
        for (key, value, usual, of) in [
            ("tolerance", self.tolerance, usual.tolerance, "times the window's increment"),
            ("absolute_tolerance", self.absolute_tolerance, usual.absolute_tolerance, "m"),
        ] {
            check_tolerance(key, key, value)?;
            if value >= 1.0 {
                return Err(too_coarse(key, key, &format!("{value} {of}"), usual));
            }
        }
        self.check_measures()?;
        if self.samples > MOST_SAMPLES {
            let what = format!("samples must be {MOST_SAMPLES} at most, it is {}", self.samples);
            return Err(wrong("samples", what));
        }
        if self.predictor > 1 {
            let what = format!("predictor {} does not exist", self.predictor);
            return Err(wrong("predictor", what).try_instead("0 keeps the net where it is, 1 lets it go on"));
        }
        if let Some(min) = self.min_window {
            positive("min_window", min, " s")?;
            if min > self.time_window {
                let window = self.time_window;
                let what = format!(
                    "min_window {min} s is longer than time_window {window} s, which halving starts from"
                );
                return Err(wrong("min_window", what).try_instead("a 64th of it is the default"));
            }
        }
        if let Some(mapping) = &self.mapping {
            mapping.check().map_err(|(key, what)| wrong(&format!("mapping.{key}"), what))?;
        }
        self.check_yielding()?;
        self.acceleration.check().map_err(|(key, what)| wrong(&format!("acceleration.{key}"), what))
    }

    fn check_measures(&self) -> Result<(), Diagnostic> {
        for (number, measure) in self.measure.iter().enumerate() {
            let Measure { field, norm, .. } = measure;
            let key = |key: &str| format!("measure.{number}.{key}");
            if self.measure[..number].iter().any(|m| (m.field, m.norm) == (*field, *norm)) {
                let what = format!("the {} is measured twice by the same norm", field.words());
                return Err(wrong(&key("field"), what).try_instead("one of them is enough"));
            }
            for (name, value) in [("tolerance", measure.tolerance), ("absolute", measure.absolute)] {
                value.map_or(Ok(()), |value| check_tolerance(&key(name), name, value))?;
            }
            if let Some(value) = measure.tolerance.filter(|value| *value >= 1.0) {
                let usual = Self::default().tolerance;
                return Err(too_coarse(&key("tolerance"), "tolerance", &value.to_string(), usual));
            }
            let Tolerance { relative, absolute } = measure.tolerance(&self.tolerances());
            if relative == 0.0 && absolute == 0.0 {
                let what = format!(
                    "both tolerances of the {} are 0, so that no window converges in which it changes",
                    field.words()
                );
                return Err(wrong(&key("field"), what));
            }
        }
        Ok(())
    }

    /// Whether the force is measured.
    pub fn measures_force(&self) -> bool {
        self.scheme == Scheme::Strong && self.measure.iter().any(|m| m.field == Field::Force)
    }

    /// What is certainly wrong of a yielding net.
    fn check_yielding(&self) -> Result<(), Diagnostic> {
        let usual = Self::default();
        let shares = [
            ("yielding_tolerance", self.yielding_tolerance, usual.yielding_tolerance, " m"),
            ("yielding_share", self.yielding_share, usual.yielding_share, ""),
        ];
        for (key, value, usual, unit) in shares {
            if !(0.0..1.0).contains(&value) {
                let what = format!("{key} must be at least 0 and below 1{unit}, it is {value}");
                return Err(wrong(key, what).try_instead(format!("{usual:e} is usual")));
            }
        }
        if self.rings > MOST_RINGS {
            let what = format!("rings must be {MOST_RINGS} at most, it is {}", self.rings);
            let hint = format!("{} are usual, and more of them cost time in every step", usual.rings);
            return Err(wrong("rings", what).try_instead(hint));
        }
        Ok(())
    }

    /// Tolerances.
    pub fn tolerances(&self) -> Tolerance {
        Tolerance { relative: self.tolerance, absolute: self.absolute_tolerance }
    }

    /// Tolerances of a yielding net: of the distance of the two motions of the net.
    pub fn of_yielding(&self) -> Tolerance {
        Tolerance { relative: self.yielding_share, absolute: self.yielding_tolerance }
    }

    /// Shortest window that halving may reach [s].
    pub fn shortest_window(&self) -> f64 {
        self.min_window.unwrap_or(self.time_window / 64.0)
    }

    /// Most iterations of a window: weak is the strong loop with one.
    pub fn iterations(&self) -> u32 {
        match self.scheme {
            Scheme::Weak => 1,
            Scheme::Strong => self.max_iterations,
        }
    }
}
