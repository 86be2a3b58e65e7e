//! Settings of beams.

use super::Beam;
use crate::element::cable_properties::CableConfig;
use crate::element::part::{NewElements, PartCell, PartSettings, StatedSection, part};
use interface_defs::diagnostic::Diagnostic;
use nalgebra::Vector3;

part! {
    /// Beams between two nodes, with rotations.
    BeamPart: "beams", (2, 2) nodes, Line2 {
        /// Young's modulus [Pa].
        young: f64,
        /// Shear modulus [Pa]. Default `young / 2.6`.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        shear: Option<f64>,
        /// Section [m2].
        area: f64,
        /// Second moments of area for bending towards `up`, and across it [m4].
        inertia: [f64; 2],
        /// Torsion constant [m4]. Default the sum of `inertia`, exact for circular sections.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        torsion: Option<f64>,
        /// Density [kg/m3]; `static` alone does without. Default 0.
        #[serde(default)]
        density: f64,
        /// A direction that lies in the plane of the first bending. Default z, or x for upright beams.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        up: Option<[f64; 3]>,
    }
}

impl PartSettings for BeamPart {
    fn turns_without_inertia(&self) -> bool {
        self.density <= 0.0
    }

    fn build(&self, cell: &PartCell, made: &mut NewElements) -> Result<(), Diagnostic> {
        let (key, nodes, span) = (cell.key, cell.ends(), cell.spans()[0]);
        key.positive("young", self.young, "Pa")?;
        key.positive("area", self.area, "m2")?;
        key.positive("inertia", self.inertia[0].min(self.inertia[1]), "m4")?;
        key.not_negative("density", self.density, "kg/m3")?;
        key.not_negative("radius", self.radius.unwrap_or(0.0), "m")?;
        let shear = self.shear.unwrap_or(self.young / 2.6);
        key.positive("shear", shear, "Pa")?;
        let torsion = self.torsion.unwrap_or(self.inertia[0] + self.inertia[1]);
        key.positive("torsion", torsion, "m4")?;
        let along = span.normalize();
        let default = if along.z.abs() > 0.9 { Vector3::x() } else { Vector3::z() };
        let up = self.up.map_or(default, Vector3::from);
        let first = up - along * along.dot(&up);
        if first.norm() <= 1e-6 * up.norm() || up.norm() == 0.0 {
            let what = format!("`up` lies along the beam between nodes {} and {}", nodes[0], nodes[1]);
            return Err(cell.invalid(what));
        }
        let first = first.normalize();
        let beam = Beam {
            nodes,
            span,
            axes: [first, along.cross(&first)],
            area: self.area,
            axial: self.young * self.area,
            bending: self.inertia.map(|i| self.young * i),
            torsion: shear * torsion,
            line_mass: self.density * self.area,
            gyration: (torsion.max(self.inertia[0] + self.inertia[1]) / self.area).sqrt(),
            radius: self.radius.unwrap_or(0.0),
            rupture: key.rupture(self.rupture_force, None)?,
        };
        made.elements.push(beam.into());
        Ok(())
    }

    fn section(&self, _common: Option<&CableConfig>) -> Option<StatedSection> {
        Some(StatedSection {
            young: Some(self.young),
            density: Some(self.density),
            area: Some(self.area),
            inertia: Some(self.inertia),
            radius: self.radius,
            rupture_force: self.rupture_force,
            ..StatedSection::default()
        })
    }
}
