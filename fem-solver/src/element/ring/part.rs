//! Settings of rings.

use super::{Mechanism, Ring};
use crate::element::cable_properties::CableConfig;
use crate::element::part::{NewElements, PartCell, PartSettings, StatedSection, Surroundings, part};
use interface_defs::diagnostic::{Diagnostic, code};

part! {
    /// Rings of a ring net, by their 3 or 4 points of contact, around.
    RingPart: "rings", (3, 4) nodes, Tri3 | Quad4 {
        /// Diameter of the ring [m].
        diameter: f64,
        /// Stiffness of its perimeter, beyond its length [N/m].
        perimeter_stiffness: f64,
        /// Stiffness of each width (diagonal, or of 3 points the median beyond 3/4 of the diameter), beyond the diameter [N/m].
        bending_stiffness: f64,
        /// Length of the perimeter at which it becomes taut [m]. Default that of the circle.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        perimeter: Option<f64>,
        /// Stiffness of unloading over that of loading, of the perimeter and of the widths. Default `[3, 100]`.
        #[serde(default = "unloading")]
        unloading: [f64; 2],
        /// Mass of each ring [kg].
        mass: f64,
    }
}

fn unloading() -> [f64; 2] {
    [3.0, 100.0]
}

impl PartSettings for RingPart {
    fn build(&self, cell: &PartCell, made: &mut NewElements) -> Result<(), Diagnostic> {
        let (key, nodes) = (cell.key, cell.nodes);
        key.positive("diameter", self.diameter, "m")?;
        key.positive("perimeter_stiffness", self.perimeter_stiffness, "N/m")?;
        key.positive("bending_stiffness", self.bending_stiffness, "N/m")?;
        key.not_negative("mass", self.mass, "kg")?;
        key.not_negative("radius", self.radius.unwrap_or(0.0), "m")?;
        if let Some(factor) = self.unloading.iter().find(|f| !(**f >= 1.0 && f.is_finite())) {
            return Err(key.invalid(
                "unloading",
                format!("it unloads with {factor} of its stiffness, it must be 1 or more"),
            ));
        }
        let perimeter = self.perimeter.unwrap_or(std::f64::consts::PI * self.diameter);
        key.positive("perimeter", perimeter, "m")?;
        let share = if nodes.len() == 4 { 1.0 } else { 0.75 };
        let mechanism = |start, stiffness, unloading| Mechanism { start, stiffness, unloading, ease: 0.0 };
        let side = |i: usize| cell.positions[nodes[(i + 1) % nodes.len()]] - cell.positions[nodes[i]];
        let ring = Ring {
            nodes: nodes.to_vec(),
            spans: (0..nodes.len()).map(side).collect(),
            perimeter: mechanism(perimeter, self.perimeter_stiffness, self.unloading[0]),
            width: mechanism(share * self.diameter, self.bending_stiffness, self.unloading[1]),
            mass: self.mass,
            radius: self.radius.unwrap_or(0.0),
            rupture: key.rupture(self.rupture_force, None)?.force,
        };
        made.elements.push(ring.into());
        Ok(())
    }

    fn section(&self, _common: Option<&CableConfig>) -> Option<StatedSection> {
        Some(StatedSection { radius: self.radius, ..StatedSection::default() })
    }

    fn judge(&self, at: &Surroundings) -> Result<Vec<Diagnostic>, Diagnostic> {
        let (diameter, size) = (self.diameter, at.size);
        if size > 0.0 && diameter > 20.0 * size {
            return Err(at.too_long("diameter", diameter, "its nodes lie within", size));
        }
        if size > 0.0 && !(0.5..=2.0).contains(&(diameter / size)) {
            let what = format!("{diameter} m, and its nodes lie {size:.4} m apart");
            let about = Diagnostic::warning(code::UNUSUAL_VALUE, what);
            return Ok(vec![about.about(format!("{}.diameter", at.key.key))]);
        }
        Ok(Vec::new())
    }
}
