//! Settings of sliding ropes.

use super::{Memory, SlidingCable};
use crate::element::cable_properties::CableConfig;
use crate::element::part::{NewElements, PartCell, PartSettings, StatedSection, is_zero, part};
use interface_defs::diagnostic::Diagnostic;
use nalgebra::Vector3;

part! {
    /// Ropes that slide over all of their nodes but the ends; lines of a mesh that follow each other are one rope.
    SlidingCablePart: "sliding cables", (2, usize::MAX) nodes, Line2 | Row {
        /// Young's modulus [Pa].
        young: f64,
        /// Section [m2].
        area: f64,
        /// Density [kg/m3].
        density: f64,
        /// Second Piola-Kirchhoff stress at the unstretched length [Pa]; below 0: slack. Default 0.
        #[serde(default, skip_serializing_if = "is_zero")]
        prestress: f64,
        /// Unstretched length of each whole rope [m]. Default that of its polygon as modelled.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        length: Option<f64>,
        /// Coefficient of friction at inner nodes (capstan). Default 0.
        #[serde(default, skip_serializing_if = "is_zero")]
        friction: f64,
        /// Green-Lagrange strain of the whole rope at which it breaks. Default: never.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        rupture_strain: Option<f64>,
    }
}

impl PartSettings for SlidingCablePart {
    fn joins_lines(&self) -> bool {
        true
    }

    fn build(&self, cell: &PartCell, made: &mut NewElements) -> Result<(), Diagnostic> {
        let key = cell.key;
        key.positive("young", self.young, "Pa")?;
        key.positive("area", self.area, "m2")?;
        key.not_negative("density", self.density, "kg/m3")?;
        key.not_negative("radius", self.radius.unwrap_or(0.0), "m")?;
        key.not_negative("friction", self.friction, "")?;
        if let Some(length) = self.length {
            key.positive("length", length, "m")?;
        }
        let spans = cell.spans();
        let polygon: f64 = spans.iter().map(Vector3::norm).sum();
        let share = self.length.unwrap_or(polygon) / polygon;
        let rope = SlidingCable {
            nodes: cell.nodes.to_vec(),
            lengths: spans.iter().map(|s| share * s.norm()).collect(),
            spans,
            young: self.young,
            area: self.area,
            density: self.density,
            prestress: self.prestress,
            friction: self.friction,
            radius: self.radius.unwrap_or(0.0),
            rupture: key.rupture(self.rupture_force, self.rupture_strain)?,
            memory: Memory::default(),
        };
        made.elements.push(rope.into());
        Ok(())
    }

    fn section(&self, _common: Option<&CableConfig>) -> Option<StatedSection> {
        Some(StatedSection {
            young: Some(self.young),
            density: Some(self.density),
            area: Some(self.area),
            radius: self.radius,
            prestress: Some(self.prestress),
            strained: Some(self.young),
            rupture_force: self.rupture_force,
            rupture_strain: self.rupture_strain,
            ..StatedSection::default()
        })
    }
}
