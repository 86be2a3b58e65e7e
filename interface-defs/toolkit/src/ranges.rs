//! Tables of ranges: which numbers of a scene or study are certainly wrong, which are unusual, and the unit that was likely meant.
//!
//! One [`Gate`] a key:
//!
//! ```
//! use toolkit::ranges::Gate;
//!
//! const DENSITY: Gate = Gate {
//!     key: "density",
//!     unit: "kg/m3",
//!     possible: [0.01, 1e6],
//!     usual: [30.0, 3e4],
//!     says: ["is that of a foam", "is heavier than any metal"],
//!     units: &[("g/cm3", 1e3)],
//!     hint: "steel has 7850",
//! };
//! let said = DENSITY.judge("rock.0", 2.6).expect("unusual").to_string();
//! let meant = "were it in g/cm3, it would be 2600 kg/m3; steel has 7850";
//! assert_eq!(said, format!("rock.0.density: 2.6 kg/m3 is that of a foam; {meant}"));
//! assert!(DENSITY.judge("rock.0", 2600.0).is_none());
//! ```

use super::numbers::four;
use super::scene::Scene;
use interface_defs::diagnostic::{Diagnostic, Severity, code};

/// All numbers.
pub const ALL: [f64; 2] = [f64::NEG_INFINITY, f64::INFINITY];

/// What is said of the numbers of one key.
pub struct Gate {
    /// Name of the key in its table.
    pub key: &'static str,
    /// Its unit; empty for a plain number.
    pub unit: &'static str,
    /// Least and largest number that someone can mean.
    pub possible: [f64; 2],
    /// Least and largest number of which nothing is said.
    pub usual: [f64; 2],
    /// What is said behind a number below these, and above: "is softer than rubber".
    pub says: [&'static str; 2],
    /// Other units that it may be written in, the likelier first, and how much of its own each is.
    pub units: &'static [(&'static str, f64)],
    /// What to write: an example in the unit of the key.
    pub hint: &'static str,
}

impl Gate {
    /// Of a plain number of which nothing is said.
    pub const ANY: Self = Self {
        key: "",
        unit: "",
        possible: ALL,
        usual: ALL,
        says: ["is very little", "is very much"],
        units: &[],
        hint: "",
    };

    /// What is to be said of `value` at this key of `table`.
    pub fn judge(&self, table: &str, value: f64) -> Option<Diagnostic> {
        let outside = |[low, high]: [f64; 2], value: f64| [value < low, value > high];
        let side = outside(self.usual, value).into_iter().position(|is| is)?;
        let wrong = outside(self.possible, value).contains(&true);
        let meant = self.units.iter().find(|(_, size)| outside(self.usual, size * value) == [false; 2]);
        let (severity, doubt) = match wrong {
            true => (Severity::Error, code::INVALID_VALUE),
            false => (Severity::Warning, code::UNUSUAL_VALUE),
        };
        let unit = if self.unit.is_empty() { String::new() } else { format!(" {}", self.unit) };
        // An error stands at its place without the key before it.
        let name =
            self.key.rsplit('.').next().filter(|_| wrong).map_or(String::new(), |key| format!("{key} = "));
        let must = if wrong { self.must() } else { String::new() };
        let message = format!("{name}{}{unit} {}{must}", four(value), self.says[side]);
        let likely = meant
            .map(|(other, size)| format!("were it in {other}, it would be {}{unit}", four(size * value)));
        let code = if likely.is_some() { code::LIKELY_UNIT } else { doubt };
        let hints: Vec<String> =
            likely.into_iter().chain([self.hint.into()]).filter(|h| !h.is_empty()).collect();
        let key = if table.is_empty() { self.key.into() } else { format!("{table}.{}", self.key) };
        let found = Diagnostic::of(severity, code, message).about(key);
        Some(found.try_if((!hints.is_empty()).then(|| hints.join("; "))))
    }

    /// What a number that is certainly wrong must be.
    fn must(&self) -> String {
        let ([low, high], unit) = (self.possible, self.unit);
        match (low == f64::MIN_POSITIVE, high.is_finite()) {
            (true, true) => format!(": it must lie above 0, up to {} {unit}", four(high)),
            (true, false) => ": it must lie above 0".into(),
            (false, true) if low.is_finite() => {
                format!(": it must be {} to {} {unit}", four(low), four(high))
            }
            (false, true) => format!(": it must be at most {} {unit}", four(high)),
            (false, false) => format!(": it must be {} {unit} or more", four(low)),
        }
        .replace("  ", " ")
        .trim_end()
        .into()
    }

    /// [`judge`](Self::judge) it: a warning is kept.
    ///
    /// # Errors
    ///
    /// If `value` is certainly wrong, at its place in `scene`.
    pub fn pass(
        &self,
        scene: &Scene,
        table: &str,
        value: f64,
        warnings: &mut Vec<Diagnostic>,
    ) -> Result<(), Diagnostic> {
        let found = self.judge(table, value).map(|found| refused(found, scene));
        warnings.extend(found.transpose()?);
        Ok(())
    }
}

/// A warning as it is; an error at its place in `scene` is one.
///
/// # Errors
///
/// If `found` is an error.
pub fn refused(found: Diagnostic, scene: &Scene) -> Result<Diagnostic, Diagnostic> {
    if found.severity == Severity::Error { Err(scene.placed(found)) } else { Ok(found) }
}

#[cfg(test)]
mod tests {
    use super::*;

    const STEP: Gate = Gate {
        key: "step",
        possible: [0.0, f64::INFINITY],
        usual: [f64::MIN_POSITIVE, 1e3],
        says: ["is nothing", "is long"],
        units: &[("ms", 1e-3)],
        ..Gate::ANY
    };

    #[test]
    fn what_is_wrong_is_an_error_at_its_place_and_what_is_unusual_a_warning() {
        let scene = Scene::from_text("s.toml", "[dem]\nstep = -1.0\n").expect("TOML");
        let mut warnings = Vec::new();
        let error = STEP.pass(&scene, "dem", -1.0, &mut warnings).expect_err("is wrong");
        assert_eq!(
            (error.headline().as_str(), error.code),
            ("s.toml:2:8: step = -1 is nothing: it must be 0 or more", code::INVALID_VALUE)
        );
        assert!([1.0, 999.0, f64::NAN].iter().all(|v| STEP.judge("dem", *v).is_none()));
        for value in [0.0, 2e4, 1.1e8] {
            STEP.pass(&scene, "dem", value, &mut warnings).expect("possible");
        }
        let said: Vec<String> = warnings.iter().map(ToString::to_string).collect();
        assert_eq!(
            said,
            [
                "dem.step: 0 is nothing",
                "dem.step: 20000 is long; were it in ms, it would be 20",
                "dem.step: 1.1e8 is long"
            ]
        );
        let codes = [code::UNUSUAL_VALUE, code::LIKELY_UNIT, code::UNUSUAL_VALUE];
        assert!(warnings.iter().map(|w| &w.code).eq(&codes));
    }
}
