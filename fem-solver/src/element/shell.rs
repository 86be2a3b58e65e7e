//! A thin shell: a flat triangle with the membrane of constant strain and the plate of Kirchhoff (DKT).
//!
//! Each node carries a triad `a_1, a_2, a_3` that turns with it, at first the axes of the triangle and its normal. With the
//! columns `f_1, f_2` of the deformation gradient, as in [`Membrane`], the deformations are
//!
//! ```text
//! E_ab                                        membrane, by Green and Lagrange
//! q_ia = a_3i . f_a                           tilt of the normal of node i against the plane
//! g_i  = (a_1i . f_2 - a_2i . f_1) / 2        turn of node i in the plane against the triangle
//! W = W_membrane + q' K_b q / 2 + k_d / 2 sum g_i^2
//! ```
//!
//! They are products of vectors that turn with the element: the energy knows nothing of rigid rotation however large, and
//! force and tangent follow without an element frame. `K_b` is that of the discrete Kirchhoff triangle whose corners lie in
//! their plane: along each side the normal of its middle tilts by `-1/4` of the sum of its ends, across it by half.
//! `k_d` holds turns in the plane, which nothing else does: 1e-3 of the membrane's stiffness. Small strains, and turns of a
//! node against its triangle that are small; the error falls with the square of the triangles' size.
//!
//! Source: Batoz, Bathe, Ho (1980), Int. J. Numer. Meth. Eng. 15, 1771 (DKT); rotations as in [`super::Beam`].

use super::membrane::{
    Fabric, Membrane, MembranePoint, check_sheet, check_thickness, poisson, principal, strain, triangle,
};
use super::part::{NewElements, PartCell, PartSettings, Surroundings, part};
use super::segment::{add_block, add_product, add_scaled, add_vector};
use super::turn::{self, START};
use super::{Answer, Constants, Element, Energy, Pace};
use interface_defs::diagnostic::{Diagnostic, code};
use nalgebra::{Matrix3, Matrix6, SMatrix, Vector2, Vector3, Vector6};

/// Stiffness against turns in the plane, relative to that of the membrane.
const DRILLING: f64 = 1e-3;

/// A triangle of shell.
#[derive(Debug, Clone)]
pub struct Shell {
    /// Its middle surface.
    membrane: Membrane,
    /// `K_b`, over `q_11, q_12, q_21, ...` [N m].
    bending: Box<Matrix6<f64>>,
    /// Mean bending moments per width `[11, 22, 12]` over the same [N m/m].
    moments: Box<SMatrix<f64, 3, 6>>,
    /// `k_d` [N m].
    drilling: f64,
}

/// `a . f_b` of one node: what all deformations with rotations are made of.
struct Tilt {
    node: usize,
    a: Vector3<f64>,
    b: usize,
    f: Vector3<f64>,
}

/// The shell at given displacements and rotations.
struct ShellShape {
    /// `f_1, f_2`.
    f: [Vector3<f64>; 2],
    /// `triads[node][axis]`.
    triads: [[Vector3<f64>; 3]; 3],
}

impl Shell {
    /// On the middle surface `membrane`, isotropic with Young's modulus [Pa] and Poisson's ratio.
    pub fn new(membrane: Membrane, young: f64, poisson: f64) -> Self {
        let thickness = membrane.thickness;
        let k = young * thickness.powi(3) / (12.0 * (1.0 - poisson * poisson));
        let d = Matrix3::new(1.0, poisson, 0.0, poisson, 1.0, 0.0, 0.0, 0.0, 0.5 * (1.0 - poisson)) * k;
        let points = kirchhoff(&membrane.points[0].slopes, membrane.points[0].area);
        let bending: Matrix6<f64> = points.iter().map(|(b, weight)| *weight * b.transpose() * d * b).sum();
        let area = membrane.points[0].area;
        let moments: SMatrix<f64, 3, 6> = points.iter().map(|(b, weight)| d * b * (weight / area)).sum();
        let drilling = DRILLING * young * thickness * membrane.points[0].area / 3.0;
        Self { membrane, bending: bending.into(), moments: moments.into(), drilling }
    }

    /// The material of its middle surface: it carries compression.
    pub fn fabric(young: f64, poisson: f64) -> Fabric {
        Fabric::Isotropic { young, poisson, prestress: [0.0; 3], wrinkles: false }
    }

    fn middle(&self) -> &MembranePoint<3> {
        &self.membrane.points[0]
    }

    fn shape(&self, u: &[f64], history: &[f64]) -> ShellShape {
        let [first, second] = self.middle().axes;
        let own = [first, second, first.cross(&second)];
        let (f, _) = strain(&self.middle().axes, &self.middle().slopes, &translations(u));
        let triads = [0, 1, 2].map(|node: usize| {
            let turn = turn::rotation(u, history, node);
            own.map(|axis| turn * axis)
        });
        ShellShape { f, triads }
    }

    /// Gradient of `a . f_b`, over the 18 local degrees of freedom.
    fn gradient(&self, tilt: &Tilt) -> [f64; 18] {
        let mut g = [0.0; 18];
        for node in 0..3 {
            add_vector(&mut g, 6 * node, &(self.middle().slopes[node][tilt.b] * tilt.a));
        }
        add_vector(&mut g, 6 * tilt.node + 3, &tilt.a.cross(&tilt.f));
        g
    }

    /// Add `factor` times its second derivative.
    fn add_curvature(&self, tilt: &Tilt, factor: f64, k: &mut [f64]) {
        let turn = 6 * tilt.node + 3;
        add_block(k, 18, turn, turn, &(factor * turn::curvature(&tilt.a, &tilt.f)));
        for node in 0..3 {
            let mixed = factor * self.middle().slopes[node][tilt.b] * tilt.a.cross_matrix();
            add_block(k, 18, turn, 6 * node, &mixed);
            add_block(k, 18, 6 * node, turn, &mixed.transpose());
        }
    }
}

impl ShellShape {
    /// `q_11, q_12, q_21, ...`.
    fn tilts(&self) -> [Tilt; 6] {
        std::array::from_fn(|k| self.tilt(k / 2, 2, k % 2))
    }

    fn tilt(&self, node: usize, axis: usize, b: usize) -> Tilt {
        Tilt { node, a: self.triads[node][axis], b, f: self.f[b] }
    }

    /// The two halves of each `g_i`.
    fn drills(&self) -> [[Tilt; 2]; 3] {
        std::array::from_fn(|node| [self.tilt(node, 0, 1), self.tilt(node, 1, 0)])
    }
}

impl Tilt {
    fn value(&self) -> f64 {
        self.a.dot(&self.f)
    }
}

fn values(tilts: &[Tilt; 6]) -> Vector6<f64> {
    Vector6::from_fn(|i, _| tilts[i].value())
}

/// Curvature `[11, 22, 2 x 12]` over the tilts of the corners, at the three points of a rule that integrates its square,
/// and their weights.
fn kirchhoff(slopes: &[Vector2<f64>; 3], area: f64) -> [(SMatrix<f64, 3, 6>, f64); 3] {
    std::array::from_fn(|point| {
        // The middle of the side opposite to corner `point`.
        let l: [f64; 3] = std::array::from_fn(|i| if i == point { 0.0 } else { 0.5 });
        // Slope of the tilt field for a unit tilt at each corner and direction, corners and middles of sides together.
        let mut b = SMatrix::<f64, 3, 6>::zeros();
        let mut add = |corner: usize, weight: &nalgebra::Matrix2<f64>, gradient: Vector2<f64>| {
            for c in 0..2 {
                let tilt = weight.column(c);
                let column = 2 * corner + c;
                b[(0, column)] += tilt[0] * gradient.x;
                b[(1, column)] += tilt[1] * gradient.y;
                b[(2, column)] += tilt[0] * gradient.y + tilt[1] * gradient.x;
            }
        };
        for i in 0..3 {
            add(i, &nalgebra::Matrix2::identity(), (4.0 * l[i] - 1.0) * slopes[i]);
            let j = (i + 1) % 3;
            // A side is normal to the slope of the opposite corner's shape function.
            let normal = slopes[(i + 2) % 3].normalize();
            let along = Vector2::new(-normal.y, normal.x);
            let middle = 0.5 * nalgebra::Matrix2::identity() - 0.75 * along * along.transpose();
            let gradient = 4.0 * (l[i] * slopes[j] + l[j] * slopes[i]);
            add(i, &middle, gradient);
            add(j, &middle, gradient);
        }
        (b, area / 3.0)
    })
}

fn translations(u: &[f64]) -> [f64; 9] {
    std::array::from_fn(|i| u[6 * (i / 3) + i % 3])
}

impl Element for Shell {
    fn nodes(&self) -> &[usize] {
        &self.membrane.nodes
    }

    fn constants(&self) -> Constants {
        Constants { rotates: true, ..self.membrane.constants() }
    }

    fn start_history(&self) -> Vec<f64> {
        START.repeat(3)
    }

    fn add_to(&self, pace: Pace, u: &[f64], history: &[f64], answer: &mut Answer) {
        turn::settle(u, history, 3, answer.history);
        let (mut force, mut tangent) = ([0.0; 9], [0.0; 81]);
        let mut middle = Answer {
            force: &mut force,
            tangent: answer.tangent.is_some().then_some(&mut tangent[..]),
            slack: answer.slack,
            history: &mut [],
            tension: 0.0,
        };
        self.membrane.respond(pace, &translations(u), &[], &mut middle);
        let place = |i: usize| 6 * (i / 3) + i % 3;
        (0..9).for_each(|i| answer.force[place(i)] += force[i]);
        if let Some(k) = &mut answer.tangent {
            (0..81).for_each(|i| k[place(i / 9) * 18 + place(i % 9)] += tangent[i]);
        }
        let shape = self.shape(u, history);
        let tilts = shape.tilts();
        let moments = *self.bending * values(&tilts);
        let gradients: [[f64; 18]; 6] = std::array::from_fn(|i| self.gradient(&tilts[i]));
        for (moment, gradient) in moments.iter().zip(&gradients) {
            add_scaled(answer.force, *moment, gradient);
        }
        if let Some(k) = &mut answer.tangent {
            for i in 0..6 {
                (0..6).for_each(|j| add_product(k, self.bending[(i, j)], &gradients[i], &gradients[j]));
                self.add_curvature(&tilts[i], moments[i], k);
            }
        }
        for [one, other] in shape.drills() {
            let moment = 0.5 * self.drilling * (one.value() - other.value());
            let (g, h) = (self.gradient(&one), self.gradient(&other));
            let gradient: [f64; 18] = std::array::from_fn(|i| 0.5 * (g[i] - h[i]));
            add_scaled(answer.force, moment, &gradient);
            if let Some(k) = &mut answer.tangent {
                add_product(k, self.drilling, &gradient, &gradient);
                self.add_curvature(&one, 0.5 * moment, k);
                self.add_curvature(&other, -0.5 * moment, k);
            }
        }
    }

    fn energy(&self, u: &[f64], history: &[f64]) -> Energy {
        let shape = self.shape(u, history);
        let tilts = shape.tilts();
        let q = values(&tilts);
        let drills = shape.drills().map(|[one, other]| 0.5 * (one.value() - other.value()));
        let turned = drills.iter().map(|g| g * g).sum::<f64>();
        let own = 0.5 * (*self.bending * q).dot(&q) + 0.5 * self.drilling * turned;
        Energy { stored: self.membrane.energy(&translations(u), &[]).stored + own, dissipated: 0.0 }
    }

    fn lump(&self, mass: &mut [f64], inertia: &mut [f64]) {
        let mut none = [0.0; 3];
        self.membrane.lump(mass, &mut none);
        let m = self.membrane.lumped[0];
        // Isotropic, and as much as the triangle's own extent asks for: no tilt is then faster than the membrane.
        let square = self.membrane.thickness.powi(2) / 12.0 + self.middle().area / 8.0;
        inertia.iter_mut().for_each(|i| *i += m * square);
    }

    fn face_moments(&self, u: &[f64], history: &[f64]) -> [f64; 2] {
        principal(&(*self.moments * values(&self.shape(u, history).tilts())))
    }

    fn face_cell(&self) -> &[usize] {
        &self.membrane.nodes
    }

    /// That of its middle surface.
    fn face_stresses(&self, u: &[f64]) -> [f64; 2] {
        self.membrane.face_stresses(&translations(u))
    }

    /// Its tilts are products of unit vectors; moments become forces over the heights of the triangle.
    fn coarseness(&self) -> f64 {
        let steepest = self.middle().slopes.iter().map(|s| s.norm()).fold(1.0, f64::max);
        self.bending.iter().fold(self.drilling, |a, k| f64::max(a, k.abs())) * steepest
    }
}

part! {
    /// Thin shell, with rotations: triangles, and quadrilaterals that are split into two, along their shorter diagonals.
    ShellPart: "shells", (3, 4) nodes, Tri3 | Quad4 {
        /// Thickness [m].
        thickness: f64,
        /// Density [kg/m3].
        density: f64,
        /// Young's modulus [Pa].
        young: f64,
        /// Poisson's ratio. Default 0.3.
        poisson: Option<f64>,
    }
}

impl PartSettings for ShellPart {
    fn remark(&self, quadrilaterals: usize) -> Option<Diagnostic> {
        (quadrilaterals > 0).then(|| {
            let what = format!(
                "part `{}`: {quadrilaterals} quadrilaterals of shell are split into two triangles each, along the shorter diagonal",
                self.name
            );
            Diagnostic::warning(code::GEOMETRY, what)
        })
    }

    fn build(&self, cell: &PartCell, made: &mut NewElements) -> Result<(), Diagnostic> {
        let (key, young) = (cell.key, self.young);
        key.positive(&[("young", young, "Pa")])?;
        check_sheet(key, "shell", (self.thickness, self.density), (self.rupture_force, self.radius))?;
        let poisson = poisson(key, self.poisson)?;
        let (thickness, density) = (self.thickness, self.density);
        for nodes in triangles(cell) {
            let (point, fabric) = (triangle(cell, nodes, None)?, Shell::fabric(young, poisson));
            let membrane = Membrane::new(nodes, point, thickness, density, fabric);
            made.elements.push(Shell::new(membrane, young, poisson).into());
        }
        Ok(())
    }

    fn judge(&self, at: &Surroundings) -> Result<Vec<Diagnostic>, Diagnostic> {
        check_thickness(at, self.thickness)
    }
}

/// The triangles of a cell of three or four nodes: of four, two along the shorter diagonal.
fn triangles(cell: &PartCell) -> Vec<[usize; 3]> {
    let &[a, b, c, d] = cell.nodes else { return vec![[cell.nodes[0], cell.nodes[1], cell.nodes[2]]] };
    let apart = |one: usize, other: usize| (cell.positions[one] - cell.positions[other]).norm();
    if apart(a, c) <= apart(b, d) { vec![[a, b, c], [a, c, d]] } else { vec![[a, b, d], [b, c, d]] }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::element::tests::checks::{Case, random};
    use nalgebra::UnitQuaternion;

    const CORNERS: [[f64; 3]; 3] = [[0.1, 0.0, 0.2], [1.2, 0.3, 0.0], [0.4, 1.1, 0.1]];

    fn shell() -> (Shell, [Vector3<f64>; 3]) {
        let corners = CORNERS.map(Vector3::from);
        let point = Membrane::geometry(&corners, &Vector3::x()).expect("has an area");
        let (young, poisson) = (1e6, 0.3);
        let fabric = Shell::fabric(young, poisson);
        let membrane = Membrane::new([0, 1, 2], point, 0.1, 900.0, fabric);
        (Shell::new(membrane, young, poisson), corners)
    }

    fn turned(turns: [UnitQuaternion<f64>; 3]) -> Vec<f64> {
        turns.iter().flat_map(|q| [0.0, 0.0, 0.0, q.w, q.i, q.j, q.k]).collect()
    }

    #[test]
    fn derivatives_rigid_motions_and_mass_are_consistent_at_any_rotation() {
        let (shell, corners) = shell();
        let mut noise = random(14);
        for _ in 0..20 {
            let whole = UnitQuaternion::new(Vector3::new(noise(), noise(), noise()) * 5.0);
            let mut u = [0.0; 18];
            for (node, x) in corners.iter().enumerate() {
                let moved = whole * x - x;
                (0..3).for_each(|c| u[6 * node + c] = moved[c] + 0.1 * noise());
            }
            let turns =
                [0, 1, 2].map(|_| UnitQuaternion::new(Vector3::new(noise(), noise(), noise())) * whole);
            Case::new(&shell, &corners, &u)
                .with_history(&turned(turns))
                .check_all(90.0 * shell.middle().area);
        }
    }

    #[test]
    fn a_rigid_motion_leaves_no_force_and_no_energy() {
        let (shell, corners) = shell();
        let turn = UnitQuaternion::new(Vector3::new(0.7, -2.1, 1.4));
        let mut u = [0.0; 18];
        for (node, x) in corners.iter().enumerate() {
            let moved = turn * x - x + Vector3::new(3.0, 1.0, -2.0);
            (0..3).for_each(|c| u[6 * node + c] = moved[c]);
        }
        let history = turned([turn; 3]);
        // Displacements of some metres round to 1e-15 m, against a membrane of 1e5 N/m.
        assert!(shell.energy(&u, &history).stored < 1e-24);
        let force = Case::new(&shell, &[], &u).with_history(&history).force();
        assert!(force.iter().all(|f| f.abs() < 1e-8), "{force:?}");
    }

    #[test]
    fn a_constant_curvature_stores_its_exact_energy() {
        // The patch test of a plate: w = (k_11 x^2 + k_22 y^2) / 2 + k_12 x y over the axes, normals tilted by -grad w, so
        // small that squares of strains vanish beside it. Corners of a curved surface: their plane is that of a chord.
        let (shell, corners) = shell();
        let [e1, e2] = shell.middle().axes;
        let normal = e1.cross(&e2);
        let k = [1e-4, -0.6e-4, 0.4e-4];
        let (mut u, mut turns) = ([0.0; 18], [UnitQuaternion::identity(); 3]);
        for (node, corner) in corners.iter().enumerate() {
            let (x, y) = (corner.dot(&e1), corner.dot(&e2));
            let w = 0.5 * (k[0] * x * x + k[1] * y * y) + k[2] * x * y;
            let (slope_x, slope_y) = (k[0] * x + k[2] * y, k[1] * y + k[2] * x);
            (0..3).for_each(|c| u[6 * node + c] = w * normal[c]);
            turns[node] = UnitQuaternion::new(e1 * slope_y - e2 * slope_x);
        }
        let d = 1e6 * 1e-3 / (12.0 * 0.91);
        let density = k[0] * k[0] + k[1] * k[1] + 0.6 * k[0] * k[1] + 2.0 * 0.7 * k[2] * k[2];
        let exact = 0.5 * d * density * shell.middle().area;
        let energy = shell.energy(&u, &turned(turns)).stored;
        // Slopes of 1e-4 strain the membrane by their squares, 1e-8: E t e^2 A = 1e-11 J of 5e-7.
        assert!((energy / exact - 1.0).abs() < 1e-3, "{energy} is not {exact}");
        // Curved towards the normal, the side of the normal is pressed.
        let [m1, m2, m12] = [-d * (k[0] + 0.3 * k[1]), -d * (k[1] + 0.3 * k[0]), -d * 0.7 * k[2]];
        let (mean, radius) = (0.5 * (m1 + m2), (0.5 * (m1 - m2)).hypot(m12));
        let moments = shell.face_moments(&u, &turned(turns));
        for (moment, exact) in moments.iter().zip([mean + radius, mean - radius]) {
            assert!((moment - exact).abs() < 1e-3 * radius, "{moment} is not {exact}");
        }
    }
}
