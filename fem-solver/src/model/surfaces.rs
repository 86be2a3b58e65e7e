//! From the parts of membranes and shells to elements.

use super::parts::Key;
use crate::config::part::{MembranePart, ShellPart};
use crate::element::membrane::{Fabric, Geometry, Membrane};
use crate::element::{AnyElement, MembraneQuad, Shell};
use interface_defs::toolkit::input_error::InputError;
use nalgebra::{Vector2, Vector3};

/// The triangles of a cell of three or four nodes: of four, two along the shorter diagonal.
pub(super) fn triangles(cell: &[usize], positions: &[Vector3<f64>]) -> Vec<[usize; 3]> {
    let &[a, b, c, d] = cell else { return vec![[cell[0], cell[1], cell[2]]] };
    let apart = |one: usize, other: usize| (positions[one] - positions[other]).norm();
    if apart(a, c) <= apart(b, d) { vec![[a, b, c], [a, c, d]] } else { vec![[a, b, d], [b, c, d]] }
}

pub(super) fn membrane(
    key: &Key,
    place: &str,
    part: &MembranePart,
    cell: &[usize],
    positions: &[Vector3<f64>],
) -> Result<AnyElement, InputError> {
    key.positive("thickness", part.thickness, "m")?;
    key.not_negative("density", part.density, "kg/m3")?;
    key.not_negative("shear", part.shear, "Pa")?;
    for young in &part.young {
        key.positive("young", *young, "Pa")?;
    }
    if part.rupture_force.is_some() {
        return Err(key.invalid("rupture_force", "a membrane does not break"));
    }
    let (thickness, density, fabric) = (part.thickness, part.density, fabric(key, part)?);
    if let &[a, b, c, d] = cell {
        let corners = [a, b, c, d].map(|n| positions[n]);
        let along = direction(&(corners[2] - corners[0]).cross(&(corners[3] - corners[1])), part.along);
        let points = MembraneQuad::points(&corners, &along).ok_or_else(|| {
            let what = format!(
                "the quadrilateral of nodes {cell:?} has no area or is not convex, its nodes do not follow each other around, \
                 or `along` is normal to it"
            );
            key.invalid(place, what)
        })?;
        return Ok(MembraneQuad { nodes: [a, b, c, d], points, thickness, density, fabric }.into());
    }
    let nodes = [cell[0], cell[1], cell[2]];
    let (axes, slopes, area) = triangle(key, place, nodes, positions, part.along)?;
    Ok(Membrane { nodes, axes, slopes, area, thickness, density, fabric }.into())
}

fn fabric(key: &Key, part: &MembranePart) -> Result<Fabric, InputError> {
    Ok(match part.young[..] {
        [young] => {
            let poisson = poisson(key, part.poisson)?;
            let [first, second] = part.prestress;
            Fabric::Isotropic { young, poisson, prestress: [first, second, 0.0], wrinkles: part.wrinkles }
        }
        [first, second] => Fabric::Fibres {
            directions: [Vector2::x(), Vector2::y()],
            young: [first, second],
            prestress: part.prestress,
            shear: part.shear,
        },
        _ => return Err(key.invalid("young", "write one modulus (isotropic) or two (fibres)")),
    })
}

/// Direction of the first axis of a face with this normal: as stated, else x, or z where the face is normal to x.
fn direction(normal: &Vector3<f64>, along: Option<[f64; 3]>) -> Vector3<f64> {
    let upright = normal.x.abs() > 0.999 * normal.norm();
    along.map_or(if upright { Vector3::z() } else { Vector3::x() }, Vector3::from)
}

/// Axes, slopes and area of the triangle of `nodes`.
fn triangle(
    key: &Key,
    place: &str,
    nodes: [usize; 3],
    positions: &[Vector3<f64>],
    along: Option<[f64; 3]>,
) -> Result<Geometry, InputError> {
    let corners = nodes.map(|n| positions[n]);
    let normal = (corners[1] - corners[0]).cross(&(corners[2] - corners[0]));
    Membrane::geometry(&corners, &direction(&normal, along)).ok_or_else(|| {
        let what = format!("the triangle of nodes {nodes:?} has no area, or `along` is normal to it");
        key.invalid(place, what)
    })
}

/// Poisson's ratio, 0.3 where it is not stated.
fn poisson(key: &Key, stated: Option<f64>) -> Result<f64, InputError> {
    let poisson = stated.unwrap_or(0.3);
    if poisson > -1.0 && poisson < 0.5 + 1e-12 {
        return Ok(poisson);
    }
    Err(key.invalid("poisson", format!("it is {poisson}, it must lie above -1 and not above 0.5")))
}

pub(super) fn shell(
    key: &Key,
    place: &str,
    part: &ShellPart,
    nodes: [usize; 3],
    positions: &[Vector3<f64>],
) -> Result<Shell, InputError> {
    key.positive("thickness", part.thickness, "m")?;
    key.not_negative("density", part.density, "kg/m3")?;
    key.positive("young", part.young, "Pa")?;
    if part.rupture_force.is_some() {
        return Err(key.invalid("rupture_force", "a shell does not break"));
    }
    let poisson = poisson(key, part.poisson)?;
    let (axes, slopes, area) = triangle(key, place, nodes, positions, None)?;
    let fabric = Shell::fabric(part.young, poisson);
    let (thickness, density) = (part.thickness, part.density);
    Ok(Shell::new(Membrane { nodes, axes, slopes, area, thickness, density, fabric }, part.young, poisson))
}
