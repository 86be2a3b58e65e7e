//! Settings of membranes, and what faces have in common with shells.

use super::{Fabric, Geometry, Membrane};
use crate::element::MembraneQuad;
use crate::element::cable_properties::CableConfig;
use crate::element::part::{
    Key, NewElements, PartCell, PartSettings, StatedSection, Surroundings, is_zero, part,
};
use interface_defs::diagnostic::Diagnostic;
use nalgebra::{Vector2, Vector3};

part! {
    /// Triangles and quadrilaterals of membrane.
    MembranePart: "membranes", (3, 4) nodes, Tri3 | Quad4 {
        /// Thickness [m].
        thickness: f64,
        /// Density [kg/m3].
        density: f64,
        /// Young's modulus [Pa]: one number, isotropic; or two, of fibres along `along` and across it.
        young: Vec<f64>,
        /// Poisson's ratio, isotropic only. Default 0.3.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        poisson: Option<f64>,
        /// Shear modulus between the fibres [Pa], fibres only. Default 0.
        #[serde(default, skip_serializing_if = "is_zero")]
        shear: f64,
        /// Second Piola-Kirchhoff prestress along `along` and across it [Pa]. Default 0.
        #[serde(default)]
        prestress: [f64; 2],
        /// Direction of the first fibre, or of the prestress; its part in the plane counts. Default x, or z for faces
        /// normal to x.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        along: Option<[f64; 3]>,
        /// Whether it carries no compression, isotropic only. Default true.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        wrinkles: Option<bool>,
    }
}

impl MembranePart {
    fn fabric(&self, key: &Key) -> Result<Fabric, Diagnostic> {
        Ok(match self.young[..] {
            [young] => {
                if self.shear != 0.0 {
                    return Err(
                        key.invalid("shear", "`shear` is between two fibres, and `young` is one number")
                    );
                }
                let poisson = poisson(key, self.poisson)?;
                let [first, second] = self.prestress;
                Fabric::Isotropic {
                    young,
                    poisson,
                    prestress: [first, second, 0.0],
                    wrinkles: self.wrinkles.unwrap_or(true),
                }
            }
            [first, second] => {
                let idle = [("poisson", self.poisson.is_some()), ("wrinkles", self.wrinkles.is_some())];
                if let Some((name, _)) = idle.into_iter().find(|(_, stated)| *stated) {
                    let what = format!("`{name}` is of an isotropic membrane, and `young` of two fibres");
                    return Err(key.invalid(name, what));
                }
                Fabric::Fibres {
                    directions: [Vector2::x(), Vector2::y()],
                    young: [first, second],
                    prestress: self.prestress,
                    shear: self.shear,
                }
            }
            _ => return Err(key.invalid("young", "write one modulus (isotropic) or two (fibres)")),
        })
    }
}

impl PartSettings for MembranePart {
    fn build(&self, cell: &PartCell, made: &mut NewElements) -> Result<(), Diagnostic> {
        let key = cell.key;
        key.positive("thickness", self.thickness, "m")?;
        key.not_negative("density", self.density, "kg/m3")?;
        key.not_negative("shear", self.shear, "Pa")?;
        for young in &self.young {
            key.positive("young", *young, "Pa")?;
        }
        if self.rupture_force.is_some() {
            return Err(key.invalid("rupture_force", "a membrane does not break"));
        }
        if self.radius.is_some() {
            return Err(key.invalid("radius", "a membrane is touched at its faces, it has no radius"));
        }
        let (thickness, density, fabric) = (self.thickness, self.density, self.fabric(key)?);
        if let &[a, b, c, d] = cell.nodes {
            let corners = [a, b, c, d].map(|n| cell.positions[n]);
            let normal = (corners[2] - corners[0]).cross(&(corners[3] - corners[1]));
            let points =
                MembraneQuad::points(&corners, &direction(&normal, self.along)).ok_or_else(|| {
                    cell.invalid(format!(
                        "the quadrilateral of nodes {:?} has no area or is not convex, its nodes do not follow each other \
                         around, or `along` is normal to it",
                        cell.nodes
                    ))
                })?;
            let nodes = [a, b, c, d];
            made.elements.push(MembraneQuad { nodes, points, thickness, density, fabric }.into());
            return Ok(());
        }
        let nodes = [cell.nodes[0], cell.nodes[1], cell.nodes[2]];
        let (axes, slopes, area) = triangle(cell, nodes, self.along)?;
        made.elements.push(Membrane { nodes, axes, slopes, area, thickness, density, fabric }.into());
        Ok(())
    }

    fn section(&self, _common: Option<&CableConfig>) -> Option<StatedSection> {
        let (young, density) = (self.young.first().copied(), Some(self.density));
        Some(StatedSection { young, density, ..StatedSection::default() })
    }

    fn judge(&self, at: &Surroundings) -> Result<Vec<Diagnostic>, Diagnostic> {
        check_thickness(at, self.thickness)
    }
}

/// Refuse faces that are thicker than they are wide.
pub(in crate::element) fn check_thickness(
    at: &Surroundings,
    thickness: f64,
) -> Result<Vec<Diagnostic>, Diagnostic> {
    if at.size > 0.0 && thickness > at.size {
        return Err(at.too_long("thickness", thickness, "its triangles have sides of", at.size));
    }
    Ok(Vec::new())
}

/// Direction of the first axis of a face with this normal: as stated, else x, or z where the face is normal to x.
fn direction(normal: &Vector3<f64>, along: Option<[f64; 3]>) -> Vector3<f64> {
    let upright = normal.x.abs() > 0.999 * normal.norm();
    along.map_or(if upright { Vector3::z() } else { Vector3::x() }, Vector3::from)
}

/// Axes, slopes and area of the triangle of `nodes`, of a cell.
pub(in crate::element) fn triangle(
    cell: &PartCell,
    nodes: [usize; 3],
    along: Option<[f64; 3]>,
) -> Result<Geometry, Diagnostic> {
    let corners = nodes.map(|n| cell.positions[n]);
    let normal = (corners[1] - corners[0]).cross(&(corners[2] - corners[0]));
    Membrane::geometry(&corners, &direction(&normal, along)).ok_or_else(|| {
        cell.invalid(format!("the triangle of nodes {nodes:?} has no area, or `along` is normal to it"))
    })
}

/// Poisson's ratio, 0.3 where it is not stated.
pub(in crate::element) fn poisson(key: &Key, stated: Option<f64>) -> Result<f64, Diagnostic> {
    let poisson = stated.unwrap_or(0.3);
    if poisson > -1.0 && poisson < 0.5 + 1e-12 {
        return Ok(poisson);
    }
    Err(key.invalid("poisson", format!("it is {poisson}, it must lie above -1 and not above 0.5")))
}
