//! Bounds of single numbers.

use interface_defs::diagnostic::Diagnostic;
use interface_defs::toolkit::scene::Scene;

/// `value` must be finite and lie above 0.
pub(crate) fn positive(scene: &Scene, key: &str, value: f64, unit: &str) -> Result<(), Diagnostic> {
    if value > 0.0 && value.is_finite() {
        return Ok(());
    }
    Err(scene.invalid(key, format!("{key} is {value} {unit}, it must lie above 0")))
}

/// `value` must be finite and not below 0.
pub(crate) fn not_negative(scene: &Scene, key: &str, value: f64, unit: &str) -> Result<(), Diagnostic> {
    if value >= 0.0 && value.is_finite() {
        return Ok(());
    }
    Err(scene.invalid(key, format!("{key} is {value} {unit}, it must not lie below 0")))
}
