//! A co-rotational beam in space: posts.
//!
//! Each node carries a triad that turns with it. With the chord `e = d / l`, and `a_i, b_i` the two cross
//! axes of node `i`, the deformations that matter are
//!
//! ```text
//! l - L                                       stretch
//! y_i = asin(e . a_i),  z_i = asin(e . b_i)   turn of each end against the chord, in two planes
//! t = asin((b_1 . a_2 - a_1 . b_2) / 2)       twist
//! W = EA/2L (l-L)^2 + GJ/2L t^2 + sum over planes of EI/2L (4 y_1^2 + 4 y_1 y_2 + 4 y_2^2)
//! ```
//!
//! They are products of vectors that turn with the element, so the energy knows nothing of rigid
//! rotation however large, and force and tangent follow without an element frame. Small turns
//! against the chord are assumed, as by every co-rotational beam; the error falls with the square of the element's length.
//!
//! Rotations are kept as [`super::turn`] says. Forces are moments in space; the tangent is the second derivative of the
//! energy along rotations, which is symmetric.
//!
//! Source: Crisfield (1990), CMAME 81, 131 (kinematics by `e . r`); the energy form after handbook 2.5.

use super::material::Rupture;
use super::membrane::axes;
use super::part::{NewElements, PartCell, PartSettings, part};
use super::segment::{add_block, add_pair, add_product, add_scaled, vector};
use super::turn::{self, START, TURN};
use super::{Answer, Constants, Element, Energy};
use interface_defs::diagnostic::Diagnostic;
use nalgebra::{Matrix3, Vector3};

/// A beam between two nodes.
#[derive(Debug, Clone)]
pub struct Beam {
    /// Its two nodes.
    pub nodes: [usize; 2],
    /// From the first to the second as modelled [m].
    pub span: Vector3<f64>,
    /// Cross axes as modelled, unit vectors.
    pub axes: [Vector3<f64>; 2],
    /// Area of its section [m2].
    pub area: f64,
    /// `E A` [N].
    pub axial: f64,
    /// `E I` for bending in the plane of each cross axis [N m2].
    pub bending: [f64; 2],
    /// `G J` [N m2].
    pub torsion: f64,
    /// Mass per length [kg/m].
    pub line_mass: f64,
    /// Radius of gyration of its section [m].
    pub gyration: f64,
    /// Radius that a contact sees [m].
    pub radius: f64,
    /// When it breaks: axial force of either sign [N], or curvature is no matter.
    pub rupture: Rupture,
}

const BROKEN: usize = 2 * TURN;
const LOST: usize = BROKEN + 1;

/// The beam at given displacements and rotations.
struct BeamShape {
    length: f64,
    e: Vector3<f64>,
    /// Cross axes of each node: `axes[node][plane]`.
    axes: [[Vector3<f64>; 2]; 2],
}

/// Sine beyond which [`arc`] goes on as a parabola: 84 degrees against the chord, where the energy is no beam's any more.
const STEEPEST: f64 = 0.995;

/// `asin(s)` with first and second derivative. Beyond [`STEEPEST`], where they grow without bounds, the parabola that has
/// its value, slope and curvature there goes on: force and tangent stay derivatives of one energy.
fn arc(s: f64) -> (f64, f64, f64) {
    let size = s.abs();
    let at = size.min(STEEPEST);
    let root = (1.0 - at * at).sqrt();
    let (slope, bend, beyond) = (1.0 / root, at / (root * root * root), size - at);
    let value = at.asin() + (slope + 0.5 * bend * beyond) * beyond;
    (value.copysign(s), slope + bend * beyond, bend.copysign(s))
}

impl Beam {
    fn shape(&self, u: &[f64], history: &[f64]) -> BeamShape {
        let d = self.span + vector(u, 6) - vector(u, 0);
        let length = d.norm();
        let axes = [0, 1].map(|node| {
            let turn = turn::rotation(u, history, node);
            self.axes.map(|axis| turn * axis)
        });
        BeamShape { length, e: d / length, axes }
    }

    fn rest(&self) -> f64 {
        self.span.norm()
    }

    /// Axial force [N].
    fn force(&self, shape: &BeamShape) -> f64 {
        self.axial / self.rest() * (shape.length - self.rest())
    }

    /// Turn of each end against the chord in a plane, with its derivatives as [`arc`] has them, and the moment there.
    fn bent(&self, shape: &BeamShape, plane: usize) -> ([(f64, f64, f64); 2], [f64; 2]) {
        let arcs = [0, 1].map(|node: usize| arc(shape.e.dot(&shape.axes[node][plane])));
        let stiffness = self.bending[plane] / self.rest();
        (arcs, [0, 1].map(|i: usize| stiffness * (4.0 * arcs[i].0 + 2.0 * arcs[1 - i].0)))
    }

    fn stored(&self, shape: &BeamShape) -> f64 {
        let rest = self.rest();
        let stretch = shape.length - rest;
        let mut energy = 0.5 * self.axial / rest * stretch * stretch;
        for plane in 0..2 {
            let [y1, y2] = self.bent(shape, plane).0.map(|arc| arc.0);
            energy += 2.0 * self.bending[plane] / rest * (y1 * y1 + y1 * y2 + y2 * y2);
        }
        let twist = arc(shape.twist()).0;
        energy + 0.5 * self.torsion / rest * twist * twist
    }
}

impl BeamShape {
    fn twist(&self) -> f64 {
        let [[a1, b1], [a2, b2]] = self.axes;
        0.5 * (b1.dot(&a2) - a1.dot(&b2))
    }
}

/// Gradient of one deformation over the local degrees of freedom, of that with respect to `d = x_2 - x_1` and to the rotation
/// of each node.
fn gradient(d: Vector3<f64>, turns: [Vector3<f64>; 2]) -> [f64; 12] {
    let mut g = [0.0; 12];
    for (part, vector) in g.as_chunks_mut::<3>().0.iter_mut().zip([-d, turns[0], d, turns[1]]) {
        *part = vector.into();
    }
    g
}

/// Second derivative of `s = e . a` times `factor`, `a` being an axis of `node`.
fn add_curvature(k: &mut [f64], factor: f64, shape: &BeamShape, a: &Vector3<f64>, node: usize) {
    let (e, l) = (shape.e, shape.length);
    let s = e.dot(a);
    let across = Matrix3::identity() - e * e.transpose();
    let g = a - s * e;
    let dd = -(g * e.transpose() + e * g.transpose() + s * across) * (factor / (l * l));
    add_pair(k, 12, 0, 6, &dd);
    let at = 6 * node + 3;
    // d(a x e)/dd = [a]x (I - e e^T) / l, row = rotation.
    let mixed = a.cross_matrix() * across * (factor / l);
    add_block(k, 12, at, 6, &mixed);
    add_block(k, 12, at, 0, &-mixed);
    add_block(k, 12, 6, at, &mixed.transpose());
    add_block(k, 12, 0, at, &-mixed.transpose());
    add_block(k, 12, at, at, &(factor * turn::curvature(a, &e)));
}

/// Second derivative of `p . q` times `factor`, `p` being an axis of the first node and `q` of the second.
fn add_twist_curvature(k: &mut [f64], factor: f64, p: &Vector3<f64>, q: &Vector3<f64>) {
    let product = Matrix3::identity() * p.dot(q);
    let same = 0.5 * (p * q.transpose() + q * p.transpose()) - product;
    add_block(k, 12, 3, 3, &(factor * same));
    add_block(k, 12, 9, 9, &(factor * same));
    let mixed = factor * (product - q * p.transpose());
    add_block(k, 12, 3, 9, &mixed);
    add_block(k, 12, 9, 3, &mixed.transpose());
}

impl Element for Beam {
    fn nodes(&self) -> &[usize] {
        &self.nodes
    }

    fn constants(&self) -> Constants {
        Constants {
            rotates: true,
            has_moments: true,
            can_break: self.rupture != Rupture::NEVER,
            broken: Some(BROKEN),
            lines: 1,
            forces: 1,
            radius: self.radius,
            section: self.area,
            ..Constants::default()
        }
    }

    fn start_history(&self) -> Vec<f64> {
        [&START[..], &START[..], &[0.0, 0.0]].concat()
    }

    fn add_to(&self, u: &[f64], history: &[f64], answer: &mut Answer) {
        turn::settle(u, history, 2, answer.history);
        if history[BROKEN] > 0.0 {
            return;
        }
        let shape = self.shape(u, history);
        let (rest, e) = (self.rest(), shape.e);
        answer.tension = self.force(&shape);
        add_scaled(answer.force, answer.tension, &gradient(e, [Vector3::zeros(); 2]));
        if let Some(k) = &mut answer.tangent {
            let across = Matrix3::identity() - e * e.transpose();
            let block = self.axial / rest * e * e.transpose() + across * (answer.tension / shape.length);
            add_pair(k, 12, 0, 6, &block);
        }
        for plane in 0..2 {
            let axes = [0, 1].map(|node: usize| shape.axes[node][plane]);
            let stiffness = self.bending[plane] / rest;
            let (arcs, moments) = self.bent(&shape, plane);
            let gradients = [0, 1].map(|node: usize| {
                let a = axes[node];
                let mut turns = [Vector3::zeros(); 2];
                turns[node] = a.cross(&e);
                gradient((a - e.dot(&a) * e) / shape.length, turns)
            });
            for i in 0..2 {
                add_scaled(answer.force, moments[i] * arcs[i].1, &gradients[i]);
                let Some(k) = &mut answer.tangent else { continue };
                for j in 0..2 {
                    let share = if i == j { 4.0 } else { 2.0 };
                    let factor = stiffness * share * arcs[i].1 * arcs[j].1;
                    add_product(k, factor, &gradients[i], &gradients[j]);
                }
                add_product(k, moments[i] * arcs[i].2, &gradients[i], &gradients[i]);
                add_curvature(k, moments[i] * arcs[i].1, &shape, &axes[i], i);
            }
        }
        let [[a1, b1], [a2, b2]] = shape.axes;
        let (twist, slope, bend) = arc(shape.twist());
        let turn = 0.5 * (b1.cross(&a2) - a1.cross(&b2));
        let gradient = gradient(Vector3::zeros(), [turn, -turn]);
        let moment = self.torsion / rest * twist;
        add_scaled(answer.force, moment * slope, &gradient);
        if let Some(k) = &mut answer.tangent {
            let factor = self.torsion / rest * slope * slope + moment * bend;
            add_product(k, factor, &gradient, &gradient);
            add_twist_curvature(k, 0.5 * moment * slope, &b1, &a2);
            add_twist_curvature(k, -0.5 * moment * slope, &a1, &b2);
        }
    }

    fn energy(&self, u: &[f64], history: &[f64]) -> Energy {
        let stored = if history[BROKEN] > 0.0 { 0.0 } else { self.stored(&self.shape(u, history)) };
        Energy { stored, dissipated: history[LOST] }
    }

    fn utilisation_bound(&self, u: &[f64], _history: &[f64]) -> f64 {
        let force = (self.axial / self.rest() * self.elongation(u)).abs();
        self.rupture.share(force, force / self.axial)
    }

    fn breaks(&self, u: &[f64], history: &mut [f64]) -> bool {
        if history[BROKEN] > 0.0 || self.rupture == Rupture::NEVER {
            return false;
        }
        let shape = self.shape(u, history);
        let force = self.force(&shape).abs();
        let breaks = self.rupture.at(force, force / self.axial);
        if breaks {
            history[BROKEN] = 1.0;
            history[LOST] = self.stored(&shape);
        }
        breaks
    }

    fn lump(&self, mass: &mut [f64], inertia: &mut [f64]) {
        let half = 0.5 * self.line_mass * self.rest();
        mass.iter_mut().for_each(|m| *m += half);
        // Isotropic: half a rod about its end would be L^2 / 12; no mode is then faster than the bending of
        // the element itself. Handbook 2.5.
        let square = self.rest().powi(2) / 12.0 + self.gyration * self.gyration;
        inertia.iter_mut().for_each(|i| *i += half * square);
    }

    /// Its length is a root, its angles are products of unit vectors; moments become forces over its length.
    fn coarseness(&self) -> f64 {
        let rest = self.rest();
        let bending = 12.0 / rest * self.bending[0].max(self.bending[1]);
        self.axial.max(bending.max(self.torsion / rest) / rest.min(1.0))
    }

    fn line_forces(&self, u: &[f64], history: &[f64], forces: &mut [f64]) {
        forces[0] = if history[BROKEN] > 0.0 { f64::NAN } else { self.force(&self.shape(u, history)) };
    }

    fn utilisation(&self, _u: &[f64], force: f64) -> f64 {
        self.rupture.share(force.abs(), force.abs() / self.axial)
    }

    fn moments(&self, u: &[f64], history: &[f64]) -> [f64; 5] {
        if history[BROKEN] > 0.0 {
            return [0.0; 5];
        }
        let shape = self.shape(u, history);
        let [[a, b], [c, d]] = [0, 1].map(|plane: usize| {
            let (arcs, moments) = self.bent(&shape, plane);
            [moments[0] * arcs[0].1, -(moments[1] * arcs[1].1)]
        });
        let (twist, slope, _) = arc(shape.twist());
        [a, b, c, d, self.torsion / self.rest() * twist * slope]
    }

    fn elongation(&self, u: &[f64]) -> f64 {
        (self.span + vector(u, 6) - vector(u, 0)).norm() - self.rest()
    }
}

part! {
    /// Beams between two nodes, with rotations.
    BeamPart: "beams", (2, 2) nodes, Line2 {
        /// Young's modulus [Pa].
        young: f64,
        /// Shear modulus [Pa]. Default `young / 2.6`.
        shear: Option<f64>,
        /// Section [m2].
        area: f64,
        /// Second moments of area for bending towards `up`, and across it [m4].
        inertia: [f64; 2],
        /// Torsion constant [m4]. Default the sum of `inertia`, exact for circular sections.
        torsion: Option<f64>,
        /// Density [kg/m3]; `static` alone does without. Default 0.
        #[serde(default)]
        density: f64,
        /// A direction that lies in the plane of the first bending. Default z, or x for upright beams.
        up: Option<[f64; 3]>,
    }
}

impl PartSettings for BeamPart {
    fn turns_without_inertia(&self) -> bool {
        self.density <= 0.0
    }

    fn build(&self, cell: &PartCell, made: &mut NewElements) -> Result<(), Diagnostic> {
        let (key, nodes, span) = (cell.key, cell.ends(), cell.spans()[0]);
        let shear = self.shear.unwrap_or(self.young / 2.6);
        let torsion = self.torsion.unwrap_or(self.inertia[0] + self.inertia[1]);
        key.positive(&[("young", self.young, "Pa"), ("area", self.area, "m2"), ("shear", shear, "Pa")])?;
        key.positive(&[("inertia", self.inertia[0].min(self.inertia[1]), "m4"), ("torsion", torsion, "m4")])?;
        key.not_negative(&[("density", self.density, "kg/m3"), ("radius", self.radius.unwrap_or(0.0), "m")])?;
        let along = span.normalize();
        let default = if along.z.abs() > 0.9 { Vector3::x() } else { Vector3::z() };
        let up = self.up.map_or(default, Vector3::from);
        let axes = axes(&along, &up).ok_or_else(|| {
            cell.invalid(format!("`up` lies along the beam between nodes {} and {}", nodes[0], nodes[1]))
        })?;
        let beam = Beam {
            nodes,
            span,
            axes,
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
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::element::tests::checks::{Case, random};
    use nalgebra::UnitQuaternion;

    fn beam() -> Beam {
        let span = Vector3::new(0.6, 0.3, 0.2);
        let a = span.cross(&Vector3::z()).normalize();
        Beam {
            nodes: [0, 1],
            span,
            axes: [a, span.cross(&a).normalize()],
            area: 1e-3,
            axial: 3e5,
            bending: [2e3, 5e3],
            torsion: 1e3,
            line_mass: 8.0,
            gyration: 0.05,
            radius: 0.0,
            rupture: Rupture::NEVER,
        }
    }

    /// A history in which both nodes have turned by some vector, and the turn as degrees of freedom.
    fn turned(turns: [Vector3<f64>; 2]) -> Vec<f64> {
        let mut history = beam().start_history();
        for (node, turn) in turns.iter().enumerate() {
            let q = UnitQuaternion::new(*turn);
            history[node * TURN + 3..][..4].copy_from_slice(&[q.w, q.i, q.j, q.k]);
        }
        history
    }

    #[test]
    fn derivatives_rigid_motions_and_mass_are_consistent_at_any_rotation() {
        let beam = beam();
        let mut noise = random(4);
        for _ in 0..20 {
            let whole = Vector3::new(noise(), noise(), noise()) * 5.0;
            let turn = UnitQuaternion::new(whole);
            let mut u = [0.0; 12];
            let moved = turn * beam.span - beam.span;
            for c in 0..3 {
                u[c] = 0.02 * noise();
                u[6 + c] = moved[c] + 0.02 * noise();
            }
            let small = || Vector3::new(0.3, -0.2, 0.25);
            let second = UnitQuaternion::new(small()) * turn;
            let history = turned([whole, second.scaled_axis()]);
            let positions = [Vector3::zeros(), beam.span];
            Case::new(&beam, &positions, &u).with_history(&history).check_all(beam.line_mass * beam.rest());
        }
    }

    #[test]
    fn an_end_that_turns_across_its_chord_and_beyond_keeps_one_energy() {
        // 80 to 100 degrees, on both sides of where the parabola begins.
        let (beam, positions) = (beam(), [Vector3::zeros(), beam().span]);
        for degrees in [80.0_f64, 84.0, 84.5, 89.0, 91.0, 100.0] {
            let turn = beam.axes[1] * degrees.to_radians();
            let history = turned([turn, turn * 0.9]);
            Case::new(&beam, &positions, &[0.0; 12]).with_history(&history).derivatives();
        }
        let step = 1e-7;
        for s in [0.5, STEEPEST - step, STEEPEST + step, 0.9999] {
            let [(before, ..), (_, slope, bend), (after, ..)] = [arc(s - step), arc(s), arc(s + step)];
            // Third derivative below 3 / (1 - s^2)^2.5 = 3e5; rounding eps / h, and eps / h^2 of the curvature.
            assert!(((after - before) / (2.0 * step) - slope).abs() < 3e5 * step * step + 1e-8);
            assert!(
                ((arc(s + step).1 - arc(s - step).1) / (2.0 * step) - bend).abs() < 3e5 * step + 1e-6,
                "{s}"
            );
            assert_eq!(arc(-s), (-arc(s).0, slope, -bend));
        }
    }

    #[test]
    fn small_deformations_have_the_stiffness_of_the_textbook() {
        // Patch: pure bending, pure twist, pure stretch of 1e-6; errors are of second order.
        let beam = beam();
        let (l, t) = (beam.span.norm(), beam.span.normalize());
        let mut u = [0.0; 12];
        let about = beam.axes[1] * 1e-6;
        (0..3).for_each(|c| (u[3 + c], u[9 + c]) = (-about[c], about[c]));
        let bent = Case::new(&beam, &[], &u).force();
        // Turning about the second cross axis bends in the plane of the first.
        let moment = vector(&bent, 9);
        assert!((moment - beam.bending[0] * 2.0 / l * about).norm() < 1e-6 * moment.norm(), "{moment}");
        let mut u = [0.0; 12];
        (0..3).for_each(|c| u[9 + c] = 1e-6 * t[c]);
        let twisted = Case::new(&beam, &[], &u).force();
        assert!((vector(&twisted, 9) - beam.torsion / l * 1e-6 * t).norm() < 1e-9 * beam.torsion * 1e-6);
        let mut u = [0.0; 12];
        (0..3).for_each(|c| u[6 + c] = 1e-6 * t[c]);
        let pulled = Case::new(&beam, &[], &u).force();
        assert!((vector(&pulled, 6) - beam.axial / l * 1e-6 * t).norm() < 1e-8 * beam.axial * 1e-6);
    }
}
