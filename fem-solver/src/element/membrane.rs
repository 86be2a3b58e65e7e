//! The membrane: a triangle of constant strain or a quadrilateral, total Lagrangian, isotropic or of two fibres, with wrinkling.
//!
//! With orthonormal axes `A_1, A_2` in the plane as modelled, `f_a = sum_I x_I dN_I/dX_a`:
//!
//! ```text
//! E_ab = (f_a . f_b - d_ab) / 2          p_I = A t S_ab dN_I/dX_a f_b
//! ```
//!
//! An isotropic one carries no compression: where the smaller principal stress would lie below 0 it
//! wrinkles into uniaxial tension `S = E e_1 n (x) n` along the larger principal strain, where that lies
//! below 0, too, it is slack. The relaxed energy `E e_1^2 / 2` is continuous with that of the taut
//! state, so force and tangent stay derivatives of one function. Prestress is a strain `e_0 = C^-1 S_0` to
//! begin with. Fibres carry tension only, each for itself, and a linear shear between them.
//!
//! A quadrilateral is bilinear, with 2 x 2 points:
//!
//! ```text
//! N_I = (1 + r r_I)(1 + s s_I) / 4      x(r, s) = sum_I x_I N_I
//! ```
//!
//! At each of the four Gauss points the plane that touches the surface there, as modelled, has axes of its own, the first as
//! near to `along` as the plane allows: a warped quadrilateral is a warped surface. Strain, tension field and fibres are those
//! of the triangle, point by point; four points leave no motion without stiffness in the plane of what is taut.
//!
//! Sources: Pipkin (1986), IMA J. Appl. Math. 36, 85 (relaxed energy); Zienkiewicz and Taylor (2005), The Finite
//! Element Method 1, chapters 4 and 5 (bilinear, quadrature).

use super::part::{Key, NewElements, PartCell, PartSettings, Surroundings, is_zero, part};
use super::segment::{add_block, add_vector, vector};
use super::{Answer, Constants, Element, Energy, Pace};
use crate::element::Slack;
use interface_defs::diagnostic::Diagnostic;
use nalgebra::{Matrix2, Matrix3, Vector2, Vector3};

/// Stress over strain, both in the axes of the element: `[11, 22, 12]`, the strain with twice the 12.
#[derive(Debug, Clone, PartialEq)]
pub enum Fabric {
    /// Plane stress.
    Isotropic {
        /// Young's modulus [Pa].
        young: f64,
        /// Poisson's ratio.
        poisson: f64,
        /// Prestress [Pa].
        prestress: [f64; 3],
        /// Whether it wrinkles; otherwise it carries compression.
        wrinkles: bool,
    },
    /// Two families of fibres.
    Fibres {
        /// Their directions, unit vectors in the plane.
        directions: [Vector2<f64>; 2],
        /// Their moduli [Pa].
        young: [f64; 2],
        /// Their prestress [Pa].
        prestress: [f64; 2],
        /// Shear modulus between them [Pa].
        shear: f64,
    },
}

/// Energy per volume, stress, tangent.
type Behaviour = (f64, Vector3<f64>, Matrix3<f64>);

impl Fabric {
    /// At the strain `e`, energy counted from where it carries nothing.
    fn respond(&self, e: &Vector3<f64>, slack: Slack) -> Behaviour {
        match self {
            Self::Isotropic { young, poisson, prestress, wrinkles } => {
                let c = plane_stress(*young, *poisson);
                let begin = compliance(*young, *poisson) * Vector3::from(*prestress);
                let e = e + begin;
                if !*wrinkles || slack == Slack::Taut {
                    let s = c * e;
                    return (0.5 * s.dot(&e), s, c);
                }
                tension_field(*young, *poisson, &e, &c, slack)
            }
            Self::Fibres { directions, young, prestress, shear } => {
                let (mut energy, mut s, mut c) = (0.0, Vector3::zeros(), Matrix3::zeros());
                for i in 0..2 {
                    let p = product(&directions[i], &directions[i]);
                    let stress = prestress[i] + young[i] * p.dot(e);
                    if stress > 0.0 {
                        energy += stress * stress / (2.0 * young[i]);
                        s += stress * p;
                    }
                    c += match slack {
                        _ if stress > 0.0 => young[i] * p * p.transpose(),
                        Slack::Taut => young[i] * p * p.transpose(),
                        Slack::Regularised(part) => part * young[i] * p * p.transpose(),
                        Slack::Exact => Matrix3::zeros(),
                    };
                }
                let q = 2.0 * product(&directions[0], &directions[1]);
                let slide = q.dot(e);
                energy += 0.5 * shear * slide * slide;
                (energy, s + *shear * slide * q, c + *shear * q * q.transpose())
            }
        }
    }
}

/// The vector `p` with `p . e = a . E b` for symmetric strains.
fn product(a: &Vector2<f64>, b: &Vector2<f64>) -> Vector3<f64> {
    Vector3::new(a.x * b.x, a.y * b.y, 0.5 * (a.x * b.y + a.y * b.x))
}

fn plane_stress(young: f64, poisson: f64) -> Matrix3<f64> {
    let k = young / (1.0 - poisson * poisson);
    Matrix3::new(k, k * poisson, 0.0, k * poisson, k, 0.0, 0.0, 0.0, 0.5 * k * (1.0 - poisson))
}

fn compliance(young: f64, poisson: f64) -> Matrix3<f64> {
    Matrix3::new(1.0, -poisson, 0.0, -poisson, 1.0, 0.0, 0.0, 0.0, 2.0 * (1.0 + poisson)) / young
}

/// Taut, wrinkled or slack, by the mixed criterion of stress and strain.
fn tension_field(young: f64, poisson: f64, e: &Vector3<f64>, c: &Matrix3<f64>, slack: Slack) -> Behaviour {
    let (mean, half) = (0.5 * (e.x + e.y), 0.5 * (e.x - e.y));
    let radius = half.hypot(0.5 * e.z);
    let (large, small) = (mean + radius, mean - radius);
    if small + poisson * large > 0.0 {
        let s = c * e;
        return (0.5 * s.dot(e), s, *c);
    }
    let soft = match slack {
        Slack::Regularised(part) => part * c,
        _ => Matrix3::zeros(),
    };
    if large <= 0.0 {
        return (0.0, Vector3::zeros(), soft);
    }
    let angle = 0.5 * (0.5 * e.z).atan2(half);
    let n = Vector2::new(angle.cos(), angle.sin());
    let m = Vector2::new(-n.y, n.x);
    let (along, turning) = (product(&n, &n), product(&n, &m));
    let tangent = along * along.transpose() + 2.0 * large / (large - small) * turning * turning.transpose();
    (0.5 * young * large * large, young * large * along, young * tangent + soft)
}

/// A point of a membrane over `N` nodes at which its strain is taken.
#[derive(Debug, Clone)]
pub struct MembranePoint<const N: usize> {
    /// Axes of the plane there as modelled, orthonormal.
    pub axes: [Vector3<f64>; 2],
    /// `dN_I/dX_a` of each node [1/m].
    pub slopes: [Vector2<f64>; N],
    /// Area that it stands for [m2].
    pub area: f64,
}

/// A piece of membrane over `N` nodes with `P` points.
#[derive(Debug, Clone)]
pub struct Sheet<const N: usize, const P: usize> {
    /// Its nodes, around.
    pub nodes: [usize; N],
    /// Its points.
    pub points: Box<[MembranePoint<N>; P]>,
    /// Thickness [m].
    pub thickness: f64,
    /// Mass at each node [kg].
    pub lumped: [f64; N],
    /// Its material.
    pub fabric: Fabric,
}

/// A triangle of membrane: of one strain.
pub type Membrane = Sheet<3, 1>;

impl Membrane {
    /// Of these nodes and this geometry, of a thickness [m] and density [kg/m3].
    pub fn new(
        nodes: [usize; 3],
        point: MembranePoint<3>,
        thickness: f64,
        density: f64,
        fabric: Fabric,
    ) -> Self {
        let lumped = [density * thickness * point.area / 3.0; 3];
        Self { nodes, points: Box::new([point]), thickness, lumped, fabric }
    }

    /// The one point of the triangle `x`; the first axis lies as near to `along` as the plane allows. `None` where it has no area,
    /// or `along` is normal to it.
    pub fn geometry(x: &[Vector3<f64>; 3], along: &Vector3<f64>) -> Option<MembranePoint<3>> {
        let (a, b) = (x[1] - x[0], x[2] - x[0]);
        let normal = a.cross(&b);
        let area = 0.5 * normal.norm();
        if area <= 1e-14 * (a.norm_squared() + b.norm_squared()) {
            return None;
        }
        let axes = axes(&normal.normalize(), along)?;
        let flat = |v: Vector3<f64>| Vector2::new(v.dot(&axes[0]), v.dot(&axes[1]));
        // Gradient of N_I: the normal of the opposite side in the plane, over twice the area.
        let slopes = [0, 1, 2].map(|i: usize| {
            let side = flat(x[(i + 2) % 3] - x[(i + 1) % 3]);
            Vector2::new(-side.y, side.x) / (2.0 * area)
        });
        Some(MembranePoint { axes, slopes, area })
    }
}

/// Corners in the plane of `r` and `s`.
const CORNERS: [[f64; 2]; 4] = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];

/// A quadrilateral of membrane.
pub type MembraneQuad = Sheet<4, 4>;

/// Shape functions and their slopes at `(r, s)`.
fn shape(r: f64, s: f64) -> ([f64; 4], [Vector2<f64>; 4]) {
    (
        CORNERS.map(|[a, b]| 0.25 * (1.0 + a * r) * (1.0 + b * s)),
        CORNERS.map(|[a, b]| 0.25 * Vector2::new(a * (1.0 + b * s), b * (1.0 + a * r))),
    )
}

/// Directions of `r` and `s` on the surface with these corners.
fn directions(x: &[Vector3<f64>; 4], slopes: &[Vector2<f64>; 4]) -> [Vector3<f64>; 2] {
    [0, 1].map(|c: usize| x.iter().zip(slopes).map(|(x, slope)| slope[c] * x).sum())
}

impl MembraneQuad {
    /// The quadrilateral of these nodes at `x`, of a thickness [m] and density [kg/m3]. `None` where it is not convex, has no
    /// area, or `along` is normal to it.
    pub fn new(
        nodes: [usize; 4],
        x: &[Vector3<f64>; 4],
        along: &Vector3<f64>,
        thickness: f64,
        density: f64,
        fabric: Fabric,
    ) -> Option<Self> {
        let normal = (x[2] - x[0]).cross(&(x[3] - x[1]));
        let size = (x[2] - x[0]).norm_squared() + (x[3] - x[1]).norm_squared();
        let convex = CORNERS.iter().all(|[r, s]| {
            let [a, b] = directions(x, &shape(*r, *s).1);
            a.cross(&b).dot(&normal) > 1e-9 * size * normal.norm()
        });
        if !convex {
            return None;
        }
        let mut lumped = [0.0; 4];
        let mut points = CORNERS.iter().map(|corner| {
            let [r, s] = corner.map(|c| c / 3.0_f64.sqrt());
            let (shape, slopes) = shape(r, s);
            let [a, b] = directions(x, &slopes);
            let (area, unit) = (a.cross(&b).norm(), a.cross(&b).normalize());
            let axes = axes(&unit, along)?;
            // dN/dr = J^T dN/dX with J_ac = A_a . dX/dr_c.
            let turned = Matrix2::from_fn(|c, k| axes[k].dot(&[a, b][c])).try_inverse()?;
            lumped.iter_mut().zip(shape).for_each(|(m, n)| *m += density * thickness * area * n);
            Some(MembranePoint { axes, slopes: slopes.map(|slope| turned * slope), area })
        });
        let points = Box::new([points.next()??, points.next()??, points.next()??, points.next()??]);
        Some(Self { nodes, points, thickness, lumped, fabric })
    }
}

/// Axes in the plane normal to the unit vector `unit`, the first as near to `along` as it allows; none where that is normal to it.
pub(super) fn axes(unit: &Vector3<f64>, along: &Vector3<f64>) -> Option<[Vector3<f64>; 2]> {
    let first = along - unit * unit.dot(along);
    if first.norm() <= 1e-6 * along.norm() || along.norm() == 0.0 {
        return None;
    }
    let first = first.normalize();
    Some([first, unit.cross(&first)])
}

/// Principal values of a stress, the larger first.
pub(super) fn principal(s: &Vector3<f64>) -> [f64; 2] {
    let (mean, radius) = (0.5 * (s.x + s.y), (0.5 * (s.x - s.y)).hypot(s.z));
    [mean + radius, mean - radius]
}

/// `f_1, f_2` and the strain where nodes with the slopes `slopes` are displaced by `u`, in the plane of `axes` as modelled.
pub(super) fn strain(
    axes: &[Vector3<f64>; 2],
    slopes: &[Vector2<f64>],
    u: &[f64],
) -> ([Vector3<f64>; 2], Vector3<f64>) {
    let growth = [0, 1].map(|a: usize| {
        slopes.iter().enumerate().map(|(i, slope)| slope[a] * vector(u, 3 * i)).sum::<Vector3<f64>>()
    });
    let f = [axes[0] + growth[0], axes[1] + growth[1]];
    // f_a . f_b - A_a . A_b without the cancellation of two numbers near 1.
    let pair =
        |a: usize, b: usize| axes[a].dot(&growth[b]) + growth[a].dot(&axes[b]) + growth[a].dot(&growth[b]);
    (f, Vector3::new(0.5 * pair(0, 0), 0.5 * pair(1, 1), pair(0, 1)))
}

impl<const N: usize, const P: usize> Sheet<N, P> {
    /// Add force and tangent of one point at `u`.
    fn pull(&self, point: &MembranePoint<N>, u: &[f64], answer: &mut Answer) {
        let (f, e) = strain(&point.axes, &point.slopes, u);
        let (_, s, c) = self.fabric.respond(&e, answer.slack);
        let volume = point.area * self.thickness;
        // Columns of B_I: dE / dx_I.
        let b = |g: &Vector2<f64>| {
            Matrix3::from_rows(&[
                (g.x * f[0]).transpose(),
                (g.y * f[1]).transpose(),
                (g.x * f[1] + g.y * f[0]).transpose(),
            ])
        };
        for (i, g) in point.slopes.iter().enumerate() {
            add_vector(answer.force, 3 * i, &(volume * b(g).transpose() * s));
        }
        let Some(k) = &mut answer.tangent else { return };
        for (i, g) in point.slopes.iter().enumerate() {
            let left = b(g).transpose() * c;
            for (j, h) in point.slopes.iter().enumerate() {
                let geometric = g.x * h.x * s.x + g.y * h.y * s.y + (g.x * h.y + g.y * h.x) * s.z;
                let block = left * b(h) + Matrix3::from_diagonal_element(geometric);
                add_block(k, 3 * N, 3 * i, 3 * j, &(volume * block));
            }
        }
    }

    /// Energy that one point stores at `u`, 0 as modelled [J].
    fn stored(&self, point: &MembranePoint<N>, u: &[f64]) -> f64 {
        let at = |e: &Vector3<f64>| self.fabric.respond(e, Slack::Exact).0;
        let (_, e) = strain(&point.axes, &point.slopes, u);
        point.area * self.thickness * (at(&e) - at(&Vector3::zeros()))
    }
}

impl<const N: usize, const P: usize> Element for Sheet<N, P> {
    fn nodes(&self) -> &[usize] {
        &self.nodes
    }

    fn constants(&self) -> Constants {
        Constants { thickness: self.thickness, ..Constants::default() }
    }

    fn add_to(&self, _pace: Pace, u: &[f64], _history: &[f64], answer: &mut Answer) {
        self.points.iter().for_each(|point| self.pull(point, u, answer));
    }

    fn energy(&self, u: &[f64], _history: &[f64]) -> Energy {
        let stored = self.points.iter().map(|point| self.stored(point, u)).sum();
        Energy { stored, dissipated: 0.0 }
    }

    fn lump(&self, mass: &mut [f64], _inertia: &mut [f64]) {
        mass.iter_mut().zip(self.lumped).for_each(|(m, own)| *m += own);
    }

    /// Of the mean stress.
    fn face_stresses(&self, u: &[f64]) -> [f64; 2] {
        let area: f64 = self.points.iter().map(|p| p.area).sum();
        let strain = |p: &MembranePoint<N>| strain(&p.axes, &p.slopes, u).1;
        let stress = |p: &MembranePoint<N>| self.fabric.respond(&strain(p), Slack::Exact).1;
        principal(&self.points.iter().map(|p| stress(p) * (p.area / area)).sum())
    }

    fn face_cell(&self) -> &[usize] {
        &self.nodes
    }
}

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
        poisson: Option<f64>,
        /// Shear modulus between the fibres [Pa], fibres only. Default 0.
        #[serde(default, skip_serializing_if = "is_zero")]
        shear: f64,
        /// Second Piola-Kirchhoff prestress along `along` and across it [Pa]. Default 0.
        #[serde(default)]
        prestress: [f64; 2],
        /// Direction of the first fibre, or of the prestress; its part in the plane counts. Default x, or z for faces
        /// normal to x.
        along: Option<[f64; 3]>,
        /// Whether it carries no compression, isotropic only. Default true.
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
        key.not_negative(&[("shear", self.shear, "Pa")])?;
        self.young.iter().try_for_each(|young| key.positive(&[("young", *young, "Pa")]))?;
        check_sheet(key, "membrane", (self.thickness, self.density), (self.rupture_force, self.radius))?;
        let (thickness, density, fabric) = (self.thickness, self.density, self.fabric(key)?);
        if let &[a, b, c, d] = cell.nodes {
            let nodes = [a, b, c, d];
            let corners = nodes.map(|n| cell.positions[n]);
            let normal = (corners[2] - corners[0]).cross(&(corners[3] - corners[1]));
            let along = direction(&normal, self.along);
            let quad = MembraneQuad::new(nodes, &corners, &along, thickness, density, fabric);
            let quad = quad.ok_or_else(|| {
                cell.invalid(format!(
                    "the quadrilateral of nodes {nodes:?} has no area or is not convex, its nodes do not follow each other \
                     around, or `along` is normal to it"
                ))
            })?;
            made.elements.push(quad.into());
            return Ok(());
        }
        let nodes = [cell.nodes[0], cell.nodes[1], cell.nodes[2]];
        let point = triangle(cell, nodes, self.along)?;
        made.elements.push(Membrane::new(nodes, point, thickness, density, fabric).into());
        Ok(())
    }

    fn judge(&self, at: &Surroundings) -> Result<Vec<Diagnostic>, Diagnostic> {
        check_thickness(at, self.thickness)
    }
}

/// Refuse a thickness [m] and a density [kg/m3] that no sheet has, and what lines alone have: rupture and radius.
pub(super) fn check_sheet(
    key: &Key,
    one: &str,
    (thickness, density): (f64, f64),
    (rupture, radius): (Option<f64>, Option<f64>),
) -> Result<(), Diagnostic> {
    key.positive(&[("thickness", thickness, "m")])?;
    key.not_negative(&[("density", density, "kg/m3")])?;
    if rupture.is_some() {
        return Err(key.invalid("rupture_force", format!("a {one} does not break")));
    }
    if radius.is_some() {
        return Err(key.invalid("radius", format!("a {one} is touched at its faces, it has no radius")));
    }
    Ok(())
}

/// Refuse faces that are thicker than they are wide.
pub(super) fn check_thickness(at: &Surroundings, thickness: f64) -> Result<Vec<Diagnostic>, Diagnostic> {
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

/// Geometry of the triangle of `nodes`, of a cell.
pub(super) fn triangle(
    cell: &PartCell,
    nodes: [usize; 3],
    along: Option<[f64; 3]>,
) -> Result<MembranePoint<3>, Diagnostic> {
    let corners = nodes.map(|n| cell.positions[n]);
    let normal = (corners[1] - corners[0]).cross(&(corners[2] - corners[0]));
    Membrane::geometry(&corners, &direction(&normal, along)).ok_or_else(|| {
        cell.invalid(format!("the triangle of nodes {nodes:?} has no area, or `along` is normal to it"))
    })
}

/// Poisson's ratio, 0.3 where it is not stated.
pub(super) fn poisson(key: &Key, stated: Option<f64>) -> Result<f64, Diagnostic> {
    let poisson = stated.unwrap_or(0.3);
    if poisson > -1.0 && poisson < 0.5 + 1e-12 {
        return Ok(poisson);
    }
    Err(key.invalid("poisson", format!("it is {poisson}, it must lie above -1 and not above 0.5")))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::element::tests::checks::{Case, random};

    const CORNERS: [[f64; 3]; 3] = [[0.1, 0.0, 0.2], [1.2, 0.3, 0.0], [0.4, 1.1, 0.1]];

    fn membrane(fabric: Fabric) -> Membrane {
        let corners = CORNERS.map(Vector3::from);
        let point = Membrane::geometry(&corners, &Vector3::x()).expect("has an area");
        Membrane::new([0, 1, 2], point, 0.002, 900.0, fabric)
    }

    fn fabrics() -> Vec<Fabric> {
        let isotropic =
            |prestress, wrinkles| Fabric::Isotropic { young: 2e8, poisson: 0.3, prestress, wrinkles };
        let fibres = Fabric::Fibres {
            directions: [Vector2::new(0.8, 0.6), Vector2::new(-0.6, 0.8)],
            young: [3e8, 1e8],
            prestress: [1e6, -2e6],
            shear: 1e6,
        };
        vec![isotropic([0.0; 3], false), isotropic([0.0; 3], true), isotropic([1e6, 2e6, 3e5], true), fibres]
    }

    #[test]
    fn derivatives_rigid_motions_and_mass_are_consistent() {
        let corners = CORNERS.map(Vector3::from);
        let mut noise = random(12);
        for fabric in fabrics() {
            let membrane = membrane(fabric);
            for _ in 0..40 {
                let u: Vec<f64> = (0..9).map(|_| 0.2 * noise()).collect();
                Case::new(&membrane, &corners, &u).check_all(1.8 * membrane.points[0].area);
            }
        }
    }

    #[test]
    fn a_uniform_strain_gives_the_stress_of_the_textbook() {
        // The patch test: stretched by 1e-6 along its first axis, all corners follow.
        let membrane =
            membrane(Fabric::Isotropic { young: 2e8, poisson: 0.3, prestress: [0.0; 3], wrinkles: true });
        let corners = CORNERS.map(Vector3::from);
        let u: Vec<f64> = corners
            .iter()
            .flat_map(|x| {
                <[f64; 3]>::from(1e-6 * membrane.points[0].axes[0] * membrane.points[0].axes[0].dot(x))
            })
            .collect();
        let force = Case::new(&membrane, &[], &u).force();
        let (s1, s2) = (2e8 / 0.91 * 1e-6, 2e8 / 0.91 * 0.3 * 1e-6);
        for i in 0..3 {
            let exact = membrane.points[0].area
                * 0.002
                * (s1 * membrane.points[0].slopes[i].x * membrane.points[0].axes[0]
                    + s2 * membrane.points[0].slopes[i].y * membrane.points[0].axes[1]);
            assert!((vector(&force, 3 * i) - exact).norm() < 1e-5 * exact.norm());
        }
    }

    #[test]
    fn it_wrinkles_to_uniaxial_tension_and_slackens_to_nothing() {
        let fabric = Fabric::Isotropic { young: 2e8, poisson: 0.3, prestress: [0.0; 3], wrinkles: true };
        let (_, s, _) = fabric.respond(&Vector3::new(1e-3, -1e-3, 0.0), Slack::Exact);
        assert!((s - Vector3::new(2e5, 0.0, 0.0)).norm() < 1e-9);
        let (energy, s, _) = fabric.respond(&Vector3::new(-1e-4, -1e-3, 0.0), Slack::Exact);
        assert_eq!((energy, s.norm()), (0.0, 0.0));
        // The energy is continuous where wrinkles begin: e_2 = -nu e_1.
        let at = |e2: f64| fabric.respond(&Vector3::new(1e-3, e2, 0.0), Slack::Exact).0;
        assert!((at(-3e-4 * (1.0 - 1e-9)) / at(-3e-4 * (1.0 + 1e-9)) - 1.0).abs() < 1e-8);
    }
}

#[cfg(test)]
mod quad_tests {
    use super::*;
    use crate::element::tests::checks::{Case, patch, random};
    use nalgebra::UnitQuaternion;

    const PLACES: [[f64; 3]; 4] = [[0.1, 0.0, 0.2], [1.2, 0.3, 0.1], [1.0, 1.4, 0.0], [-0.1, 1.1, 0.15]];

    fn of(x: &[Vector3<f64>; 4], nodes: [usize; 4], fabric: Fabric) -> MembraneQuad {
        MembraneQuad::new(nodes, x, &Vector3::x(), 0.002, 900.0, fabric).expect("is convex")
    }

    fn isotropic(prestress: [f64; 3], wrinkles: bool) -> Fabric {
        Fabric::Isotropic { young: 2e8, poisson: 0.3, prestress, wrinkles }
    }

    #[test]
    fn derivatives_rigid_motions_and_mass_are_consistent() {
        let places = PLACES.map(Vector3::from);
        let fibres = Fabric::Fibres {
            directions: [Vector2::new(0.8, 0.6), Vector2::new(-0.6, 0.8)],
            young: [3e8, 1e8],
            prestress: [1e6, -2e6],
            shear: 1e6,
        };
        let mut noise = random(12);
        for fabric in
            [isotropic([0.0; 3], false), isotropic([0.0; 3], true), isotropic([1e6, 2e6, 3e5], true), fibres]
        {
            let quad = of(&places, [0, 1, 2, 3], fabric);
            for _ in 0..30 {
                let u: Vec<f64> = (0..12).map(|_| 0.2 * noise()).collect();
                Case::new(&quad, &places, &u)
                    .check_all(1.8 * quad.points.iter().map(|p| p.area).sum::<f64>());
            }
        }
    }

    #[test]
    fn a_patch_of_any_quadrilaterals_carries_a_uniform_strain() {
        // MacNeal and Harder's patch: a rectangle with four nodes inside, turned out of the axes.
        let turn = UnitQuaternion::new(Vector3::new(0.3, -0.5, 0.2));
        let flat = [
            [0.0, 0.0],
            [0.24, 0.0],
            [0.24, 0.12],
            [0.0, 0.12],
            [0.04, 0.02],
            [0.18, 0.03],
            [0.16, 0.08],
            [0.08, 0.08],
        ];
        let places = flat.map(|[x, y]| turn * Vector3::new(x, y, 0.0));
        let cells = [[0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7], [4, 5, 6, 7]];
        let quads = cells.map(|nodes| of(&nodes.map(|n| places[n]), nodes, isotropic([0.0; 3], true)));
        // Large: stretched by 1.2 and 1.1 and sheared, then turned.
        let u: Vec<f64> = flat
            .iter()
            .zip(&places)
            .flat_map(|([x, y], at)| {
                <[f64; 3]>::from(turn * turn * Vector3::new(1.2 * x + 0.1 * y, 1.1 * y, 0.0) - at)
            })
            .collect();
        let all: Vec<&dyn Element> = quads.iter().map(|quad| quad as &dyn Element).collect();
        let left = patch(&all, &u, &[UnitQuaternion::identity(); 8], &[4, 5, 6, 7]);
        assert!(left < 1e-12, "{left}");
        // Green-Lagrange strain of that, and the stress by hand, in every one of them.
        let (e11, e22, e12) = (0.22, 0.5 * (0.01 + 1.21 - 1.0), 0.5 * 1.2 * 0.1);
        let k = 2e8 / 0.91;
        let (s11, s22, s12) = (k * (e11 + 0.3 * e22), k * (e22 + 0.3 * e11), k * 0.7 * e12);
        let radius = f64::hypot(0.5 * (s11 - s22), s12);
        for (quad, nodes) in quads.iter().zip(cells) {
            let own: Vec<f64> = nodes.iter().flat_map(|n| u[3 * n..3 * n + 3].to_vec()).collect();
            let [first, second] = quad.face_stresses(&own);
            let mean = 0.5 * (s11 + s22);
            assert!((first / (mean + radius) - 1.0).abs() < 1e-12, "{first}");
            assert!((second / (mean - radius) - 1.0).abs() < 1e-12, "{second}");
        }
    }

    #[test]
    fn what_is_bent_in_its_plane_is_softer_than_two_triangles() {
        // Pure bending of a square: u_x = x y, u_y = -(x^2) / 2 at its corners, small. Exact: E t I k^2 / 2.
        let square =
            [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]].map(|[x, y]| Vector3::new(x, y, 0.0));
        let quad = of(&square, [0, 1, 2, 3], isotropic([0.0; 3], false));
        let bend = 1e-6;
        let u: Vec<f64> =
            square.iter().flat_map(|p| [bend * p.x * p.y, -0.5 * bend * p.x * p.x, 0.0]).collect();
        let energy = quad.energy(&u, &[]).stored;
        // The bilinear element under bending: the shear that it cannot avoid makes it stiffer by the known factor
        // (1 / (1 - nu)) (1 + (1 - nu) / 2) / (1 + nu) of a square.
        let exact = 0.5 * 2e8 * 0.002 * (16.0 / 12.0) * bend * bend;
        let factor = (1.0 / (1.0 - 0.09)) * (1.0 + 0.5 * 0.7);
        assert!((energy / exact / factor - 1.0).abs() < 1e-4, "{} {factor}", energy / exact);
    }

    #[test]
    fn what_is_not_convex_or_has_no_area_is_no_quadrilateral() {
        let x = Vector3::x();
        let of = |corners: [[f64; 2]; 4]| {
            let corners = corners.map(|[x, y]| Vector3::new(x, y, 0.0));
            MembraneQuad::new([0, 1, 2, 3], &corners, &x, 0.002, 900.0, isotropic([0.0; 3], true))
        };
        assert!(of([[0.0, 0.0], [1.0, 0.0], [0.2, 0.2], [0.0, 1.0]]).is_none());
        assert!(of([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]]).is_none());
        assert!(of([[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [3.0, 0.0]]).is_none());
        assert!(of([[0.0, 0.0], [1.0, 0.0], [1.2, 1.3], [0.0, 1.0]]).is_some());
    }
}
