//! Whether an iteration is accepted, and what is said of one that is not.

use super::Coupling;
use crate::convergence::{Field, Measure, Residual};
use crate::interface::Interface;

impl Coupling<'_> {
    /// What is left of the residual, with the tolerances beside it.
    pub(super) fn left(&self, residual: &Residual, interface: &Interface, length: f64) -> String {
        let (measures, mut usual) = (&self.settings.measure, self.settings.tolerances());
        if interface.yields() {
            usual = self.settings.of_yielding();
        }
        if measures.is_empty() || interface.yields() {
            return format!(
                "displacement residual {:.2e} m (increment {:.2e} m), velocity residual times window {:.2e} m, tolerances \
                 {:.1e} relative, {:.1e} m",
                residual.displacement,
                residual.displacement_increment,
                residual.velocity,
                usual.relative,
                usual.absolute
            );
        }
        let of = |m: &Measure| {
            let (judged, tolerance) = (interface.judge(m, length), m.tolerance(&usual));
            let unit = if m.field == Field::Force { "N" } else { "m" };
            format!(
                "{} residual {:.2e} {unit} (relative to {:.2e} {unit}; tolerances {:.1e} relative, {:.1e} {unit})",
                m.field, judged.residual, judged.reference, tolerance.relative, tolerance.absolute
            )
        };
        measures.iter().map(of).collect::<Vec<_>>().join(", ")
    }
}
