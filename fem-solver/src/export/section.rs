//! What other programs can hold of the elements of a part, and what not.

use crate::element::cable::CableConfig;
use crate::element::material::Rupture;
use crate::element::{AnyElement, PartConfig};
use crate::model::Model;
use serde::Serialize;

/// Section of what stands for a device without one [m2], thickness [m] and Young's modulus [Pa] of what stands for a ring.
const DEVICE: f64 = 1e-4;
const SHEET: f64 = 1e-3;
const SOFT: f64 = 1e6;

/// What the elements of a set are made of.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Section {
    /// Name of the set, and of the material.
    pub name: String,
    /// Young's modulus [Pa].
    pub young: f64,
    /// Density [kg/m3].
    pub density: f64,
    /// What it is, with the rest of its numbers.
    pub form: Form,
    /// What is not in the document of it.
    #[serde(skip)]
    pub lost: Vec<String>,
}

/// What an element is to other programs.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Form {
    /// It carries axial force.
    Truss {
        /// Section [m2].
        area: f64,
        /// Second Piola-Kirchhoff stress as modelled [Pa].
        prestress: f64,
        /// Whether it carries no compression.
        tension_only: bool,
    },
    /// It bends.
    Beam {
        /// Section [m2].
        area: f64,
        /// Second moments for bending in the planes of two cross axes [m4].
        inertia: [f64; 2],
        /// `G J / E` [m4].
        torsion: f64,
        /// The first of the cross axes, a unit vector.
        axis: [f64; 3],
    },
    /// A surface.
    Sheet {
        /// Thickness [m].
        thickness: f64,
        /// Poisson's ratio.
        poisson: f64,
        /// Whether it is a shell.
        bends: bool,
    },
}

impl Section {
    /// Of elastic cables.
    pub fn cable(name: String, of: &CableConfig) -> Self {
        let &CableConfig { young, area, density, prestress, tension_only, .. } = of;
        Self { name, young, density, form: Form::Truss { area, prestress, tension_only }, lost: Vec::new() }
    }

    /// Of the faces, or else the lines, of part number `number`; `None` where it has no element.
    pub fn of(part: &PartConfig, model: &Model, number: usize, face: bool) -> Option<Self> {
        let own = &model.parts[number];
        let name = own.name.clone();
        let Some(element) = own.elements.first().map(|element| &model.elements[*element]) else {
            let cable = &model.cables[*own.cables.first()?];
            return Some(if face {
                stand_in(name, "closed polygons of cables")
            } else {
                Self::cable(name, &cable.of)
            });
        };
        let mut lost: Vec<String> = Vec::new();
        let breaks = |rupture: &Rupture| (*rupture != Rupture::NEVER).then(|| "where it breaks".to_owned());
        let section = match (part, element) {
            (PartConfig::MembranePart(of), _) => {
                lost.push("its prestress, and that it carries no compression".into());
                if of.young.len() > 1 {
                    lost.push("its two fibres: the first modulus counts in all directions".into());
                }
                let form =
                    Form::Sheet { thickness: of.thickness, poisson: of.poisson.unwrap_or(0.3), bends: false };
                Self { name, young: of.young[0], density: of.density, form, lost: Vec::new() }
            }
            (PartConfig::ShellPart(of), _) => {
                let form =
                    Form::Sheet { thickness: of.thickness, poisson: of.poisson.unwrap_or(0.3), bends: true };
                Self { name, young: of.young, density: of.density, form, lost: Vec::new() }
            }
            (_, AnyElement::Bar(bar)) if !face => {
                lost.extend(breaks(&bar.rupture));
                let area = bar.section.unwrap_or(DEVICE);
                let volume = area * bar.length;
                if bar.section.is_none() {
                    let what = "that it gives way, its end stop and what speed does: a bar of its first stiffness stands for it";
                    lost.push(what.into());
                } else if !bar.law.hardening.is_empty() {
                    lost.push("that it yields".into());
                }
                let young = bar.section.map_or(bar.law.modulus * bar.length / area, |_| bar.law.modulus);
                let prestress = bar.law.prestress / bar.section.map_or(area, |_| 1.0);
                let tension_only = bar.law.tension_only;
                let form = Form::Truss { area, prestress, tension_only };
                Self { name, young, density: bar.mass / volume, form, lost: Vec::new() }
            }
            (_, AnyElement::SlidingCable(rope)) => {
                lost.extend(breaks(&rope.rupture));
                lost.push("that it slides over its nodes: each of its lines is a bar for itself".into());
                let form = Form::Truss { area: rope.area, prestress: rope.prestress, tension_only: true };
                Self { name, young: rope.young, density: rope.density, form, lost: Vec::new() }
            }
            (_, AnyElement::Beam(beam)) => {
                lost.extend(breaks(&beam.rupture));
                if beam.fibres.is_some() {
                    lost.push("that it yields".into());
                }
                let young = beam.axial / beam.area;
                let form = Form::Beam {
                    area: beam.area,
                    inertia: beam.bending.map(|bending| bending / young),
                    torsion: beam.torsion / young,
                    axis: beam.axes[0].into(),
                };
                Self { name, young, density: beam.line_mass / beam.area, form, lost: Vec::new() }
            }
            _ => stand_in(name, part.head().plural),
        };
        Some(Self { lost: [section.lost, lost].concat(), ..section })
    }
}

/// A thin and soft membrane without mass for what cannot be written.
fn stand_in(name: String, plural: &str) -> Section {
    let lost = vec![format!(
        "the law and the mass of its {plural}: a soft membrane of 1 mm stands for the shape of each"
    )];
    let form = Form::Sheet { thickness: SHEET, poisson: 0.0, bends: false };
    Section { name, young: SOFT, density: 0.0, form, lost }
}
