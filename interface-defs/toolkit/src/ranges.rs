//! Tables of ranges: which numbers of a scene or study are certainly wrong, which are unusual, and the unit that was likely meant.
//!
//! One [`Gate`] a key, one [`Band`] for what is said of numbers in one range:
//!
//! ```
//! use toolkit::ranges::{Band, Gate};
//!
//! const DENSITY: Gate = Gate {
//!     key: "density",
//!     unit: "kg/m3",
//!     hint: "steel has 7850",
//!     bands: &[
//!         Band::wrong(0.0..0.01, "is lighter than air"),
//!         Band::likely(0.01..30.0, "is that of a foam", "g/cm3", 1e3),
//!     ],
//! };
//! let said = DENSITY.judge("rock.0", 2.6).expect("unusual").to_string();
//! let meant = "in g/cm3 it would be 2600.0 kg/m3: write 2600.0; steel has 7850";
//! assert_eq!(said, format!("rock.0.density: 2.6 kg/m3 is that of a foam; {meant}"));
//! assert!(DENSITY.judge("rock.0", 2600.0).is_none());
//! ```

use super::scene::Scene;
use interface_defs::diagnostic::{Code, Diagnostic, Severity, code};
use std::ops::Range;

/// What is said of numbers in one range.
pub struct Band {
    /// From, to below.
    range: Range<f64>,
    severity: Severity,
    code: Code,
    /// What is said behind the number: "is softer than rubber".
    says: &'static str,
    /// The unit that was likely meant, and how much of the key's unit it is.
    meant: Option<(&'static str, f64)>,
}

impl Band {
    /// Numbers that are certainly wrong.
    pub const fn wrong(range: Range<f64>, says: &'static str) -> Self {
        Self { range, severity: Severity::Error, code: code::INVALID_VALUE, says, meant: None }
    }

    /// Numbers that are possible, but unusual.
    pub const fn unusual(range: Range<f64>, says: &'static str) -> Self {
        Self { range, severity: Severity::Warning, code: code::UNUSUAL_VALUE, says, meant: None }
    }

    /// Unusual numbers that would be ordinary ones in `unit`, which is `size` of the unit of the key.
    pub const fn likely(range: Range<f64>, says: &'static str, unit: &'static str, size: f64) -> Self {
        Self { range, severity: Severity::Warning, code: code::LIKELY_UNIT, says, meant: Some((unit, size)) }
    }
}

/// What is said of the numbers of one key.
pub struct Gate {
    /// Name of the key in its table.
    pub key: &'static str,
    /// Its unit; empty for a plain number.
    pub unit: &'static str,
    /// What to write: an example in the unit of the key.
    pub hint: &'static str,
    /// Of several ranges that hold a number the first counts.
    pub bands: &'static [Band],
}

impl Gate {
    /// What is to be said of `value` at this key of `table`.
    pub fn judge(&self, table: &str, value: f64) -> Option<Diagnostic> {
        let band = self.bands.iter().find(|band| band.range.contains(&value))?;
        let unit = if self.unit.is_empty() { String::new() } else { format!(" {}", self.unit) };
        // An error stands at its place without the key before it.
        let key = if band.severity == Severity::Error { format!("{} = ", self.key) } else { String::new() };
        let message = format!("{key}{}{unit} {}", shown(value), band.says);
        let meant = band.meant.map(|(meant, size)| {
            let right = shown(size * value);
            format!("in {meant} it would be {right}{unit}: write {right}")
        });
        let hints: Vec<String> =
            meant.into_iter().chain([self.hint.into()]).filter(|h| !h.is_empty()).collect();
        let key = if table.is_empty() { self.key.into() } else { format!("{table}.{}", self.key) };
        let about = Diagnostic::of(band.severity, band.code.clone(), message).about(key);
        Some(about.try_if((!hints.is_empty()).then(|| hints.join("; "))))
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
        match self.judge(table, value) {
            Some(error) if error.severity == Severity::Error => Err(scene.placed(error)),
            said => {
                warnings.extend(said);
                Ok(())
            }
        }
    }
}

/// A number as one would write it in a scene.
fn shown(value: f64) -> String {
    // Products with a unit end in digits of rounding.
    let value: f64 = format!("{value:.11e}").parse().unwrap_or(value);
    if value == 0.0 || (1e-3..1e5).contains(&value.abs()) {
        format!("{value:?}")
    } else {
        format!("{value:e}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const STEP: Gate = Gate {
        key: "step",
        unit: "",
        hint: "",
        bands: &[
            Band::wrong(f64::NEG_INFINITY..0.0, "is below 0"),
            Band::unusual(0.0..f64::MIN_POSITIVE, "is nothing"),
            Band::likely(1e3..f64::INFINITY, "is long", "ms", 1e-3),
        ],
    };

    #[test]
    fn what_is_wrong_is_an_error_at_its_place_and_what_is_unusual_a_warning() {
        let scene = Scene::from_text("s.toml", "[dem]\nstep = -1.0\n").expect("TOML");
        let mut warnings = Vec::new();
        let error = STEP.pass(&scene, "dem", -1.0, &mut warnings).expect_err("is wrong");
        assert_eq!(
            (error.headline().as_str(), error.code),
            ("s.toml:2:8: step = -1.0 is below 0", code::INVALID_VALUE)
        );
        assert!([1.0, 999.0, f64::NAN].iter().all(|v| STEP.judge("dem", *v).is_none()));
        for value in [0.0, 1.1e6] {
            STEP.pass(&scene, "dem", value, &mut warnings).expect("possible");
        }
        let said: Vec<String> = warnings.iter().map(ToString::to_string).collect();
        assert_eq!(
            said,
            ["dem.step: 0.0 is nothing", "dem.step: 1.1e6 is long; in ms it would be 1100.0: write 1100.0"]
        );
        assert_eq!(warnings[1].code, code::LIKELY_UNIT);
    }
}
