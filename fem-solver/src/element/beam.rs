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
//! A beam that yields has fibres ([`super::fibres`]) in place of the first and the last term of `W`; twist stays elastic.
//!
//! Rotations are kept as [`super::turn`] says. Forces are moments in space; the tangent is the second derivative of the
//! energy along rotations, which is symmetric.
//!
//! Source: Crisfield (1990), CMAME 81, 131 (kinematics by `e . r`).

use super::bar::Bar;
use super::fibres::{ENDS, Fibres, Resultants};
use super::material::{Law, Rupture};
use super::membrane::axes;
use super::part::{Key, NewElements, PartCell, PartSettings, part};
use super::section::{Section, Steel};
use super::segment::{add_block, add_pair, add_product, add_scaled, vector};
use super::turn::{self, START, TURN};
use super::{Answer, Constants, Element, Energy, Pace, Slack};
use interface_defs::diagnostic::Diagnostic;
use nalgebra::{Matrix3, Vector3};
use std::sync::Arc;

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
    /// When it breaks: axial force of either sign [N]; tensile strain of a fibre, without fibres never.
    pub rupture: Rupture,
    /// Of what it yields; `None`: it does not.
    pub fibres: Option<Arc<Fibres>>,
}

const BROKEN: usize = 2 * TURN;
const LOST: usize = BROKEN + 1;
/// Index at which the history of its fibres begins, with their largest plastic strain.
const PLASTIC: usize = LOST + 1;

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

    /// Stretch [m] and turns of the ends against the chord, by planes.
    fn ends(&self, shape: &BeamShape) -> [f64; ENDS] {
        let [[a, b], [c, d]] = [0, 1].map(|plane| shape.arcs(plane).map(|arc| arc.0));
        [shape.length - self.rest(), a, b, c, d]
    }

    /// Its fibres where one flows there or has flowed, and their history; without them it answers as an elastic beam.
    fn yielding<'a>(&self, ends: &[f64; ENDS], history: &'a [f64]) -> Option<(&Fibres, &'a [f64])> {
        let (fibres, own) = (self.fibres.as_deref()?, &history[PLASTIC..]);
        (!fibres.is_elastic(ends, self.rest(), own)).then_some((fibres, own))
    }

    /// Forces and moments at its ends.
    fn resultants(&self, shape: &BeamShape, history: &[f64], after: Option<&mut [f64]>) -> Resultants {
        let ends = self.ends(shape);
        match self.yielding(&ends, history) {
            Some((fibres, own)) => {
                fibres.respond(&ends, self.rest(), own, after.map(|after| &mut after[PLASTIC..]))
            }
            None => self.elastic(&ends),
        }
    }

    /// The same of an elastic beam.
    fn elastic(&self, ends: &[f64; ENDS]) -> Resultants {
        let (rest, mut stiffness) = (self.rest(), [[0.0; ENDS]; ENDS]);
        stiffness[0][0] = self.axial / rest;
        let mut force = [self.axial / rest * ends[0], 0.0, 0.0, 0.0, 0.0];
        for plane in 0..2 {
            let (own, of_plane) = (self.bending[plane] / rest, 1 + 2 * plane);
            for (i, j) in [(0, 1), (1, 0)] {
                let (here, there) = (of_plane + i, of_plane + j);
                force[here] = own * (4.0 * ends[here] + 2.0 * ends[there]);
                (stiffness[here][here], stiffness[here][there]) = (own * 4.0, own * 2.0);
            }
        }
        Resultants { force, stiffness }
    }

    /// Axial force at `u` [N].
    fn force(&self, u: &[f64], history: &[f64]) -> f64 {
        self.resultants(&self.shape(u, history), history, None).force[0]
    }

    /// Largest tensile strain of its fibres, where it can break by that; else 0.
    fn strain(&self, u: &[f64], history: &[f64]) -> f64 {
        let Some(fibres) = self.fibres.as_ref().filter(|_| self.rupture.strain.is_finite()) else {
            return 0.0;
        };
        fibres.largest_strain(&self.ends(&self.shape(u, history)), self.rest(), &history[PLASTIC..])
    }

    fn energy_of(&self, shape: &BeamShape, history: &[f64]) -> Energy {
        let (rest, ends) = (self.rest(), self.ends(shape));
        let (stored, dissipated) = match self.yielding(&ends, history) {
            Some((fibres, own)) => fibres.energy(&ends, rest, own),
            None => {
                let mut energy = 0.5 * self.axial / rest * ends[0] * ends[0];
                for (bending, [y1, y2]) in self.bending.iter().zip([[ends[1], ends[2]], [ends[3], ends[4]]]) {
                    energy += 2.0 * bending / rest * (y1 * y1 + y1 * y2 + y2 * y2);
                }
                (energy, 0.0)
            }
        };
        let twist = arc(shape.twist()).0;
        Energy { stored: stored + 0.5 * self.torsion / rest * twist * twist, dissipated }
    }
}

impl BeamShape {
    /// Turn of each end against the chord in a plane, with its derivatives as [`arc`] has them.
    fn arcs(&self, plane: usize) -> [(f64, f64, f64); 2] {
        [0, 1].map(|node: usize| arc(self.e.dot(&self.axes[node][plane])))
    }

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
            plastic: self.fibres.as_ref().map(|_| PLASTIC),
            ..Constants::default()
        }
    }

    fn start_history(&self) -> Vec<f64> {
        let fibres = self.fibres.as_ref().map_or(0, |fibres| fibres.history_len());
        [&START[..], &START[..], &[0.0, 0.0], &vec![0.0; fibres]].concat()
    }

    fn add_to(&self, _pace: Pace, u: &[f64], history: &[f64], answer: &mut Answer) {
        turn::settle(u, history, 2, answer.history);
        if history[BROKEN] > 0.0 {
            return;
        }
        let shape = self.shape(u, history);
        let (rest, e) = (self.rest(), shape.e);
        let mut now = self.resultants(&shape, history, Some(&mut *answer.history));
        // The step must stay below the critical one when plastic flow ends, too.
        let flows =
            answer.slack != Slack::Taut && answer.history.get(PLASTIC).is_some_and(|most| *most > 0.0);
        if !flows {
            now.stiffness = self.elastic(&self.ends(&shape)).stiffness;
        }
        answer.tension = now.force[0];
        let along = gradient(e, [Vector3::zeros(); 2]);
        add_scaled(answer.force, answer.tension, &along);
        if let Some(k) = &mut answer.tangent {
            let across = Matrix3::identity() - e * e.transpose();
            let block = now.stiffness[0][0] * e * e.transpose() + across * (answer.tension / shape.length);
            add_pair(k, 12, 0, 6, &block);
        }
        // Of each deformation, what of its gradient the turn of its end has by itself.
        let (mut slopes, mut gradients) = ([1.0; ENDS], [along; ENDS]);
        for plane in 0..2 {
            let axes = [0, 1].map(|node: usize| shape.axes[node][plane]);
            let arcs = shape.arcs(plane);
            for node in 0..2 {
                let a = axes[node];
                let mut turns = [Vector3::zeros(); 2];
                turns[node] = a.cross(&e);
                slopes[1 + 2 * plane + node] = arcs[node].1;
                gradients[1 + 2 * plane + node] = gradient((a - e.dot(&a) * e) / shape.length, turns);
            }
            for i in 0..2 {
                let own = 1 + 2 * plane + i;
                add_scaled(answer.force, now.force[own] * arcs[i].1, &gradients[own]);
                let Some(k) = &mut answer.tangent else { continue };
                for other in 1 + 2 * plane..3 + 2 * plane {
                    let factor = now.stiffness[own][other] * slopes[own] * slopes[other];
                    add_product(k, factor, &gradients[own], &gradients[other]);
                }
                add_product(k, now.force[own] * arcs[i].2, &gradients[own], &gradients[own]);
                add_curvature(k, now.force[own] * arcs[i].1, &shape, &axes[i], i);
            }
        }
        if let Some(k) = answer.tangent.as_mut().filter(|_| flows) {
            // Where it yields, each force depends on all deformations.
            for (own, other) in (0..ENDS).flat_map(|own| (0..ENDS).map(move |other| (own, other))) {
                if own.div_ceil(2) != other.div_ceil(2) {
                    let factor = now.stiffness[own][other] * slopes[own] * slopes[other];
                    add_product(k, factor, &gradients[own], &gradients[other]);
                }
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
        if history[BROKEN] > 0.0 {
            return Energy { stored: 0.0, dissipated: history[LOST] };
        }
        self.energy_of(&self.shape(u, history), history)
    }

    fn utilisation_bound(&self, u: &[f64], history: &[f64]) -> f64 {
        let force = match self.fibres {
            None => (self.axial / self.rest() * self.elongation(u)).abs(),
            Some(_) => self.force(u, history).abs(),
        };
        self.rupture.share(force, self.strain(u, history))
    }

    fn breaks(&self, u: &[f64], history: &mut [f64]) -> bool {
        if history[BROKEN] > 0.0 || self.rupture == Rupture::NEVER {
            return false;
        }
        let force = self.force(u, history).abs();
        let breaks = self.rupture.at(force, self.strain(u, history));
        if breaks {
            let had = self.energy(u, history);
            history[LOST] = had.stored + had.dissipated;
            history[BROKEN] = 1.0;
        }
        breaks
    }

    fn lump(&self, mass: &mut [f64], inertia: &mut [f64]) {
        let half = 0.5 * self.line_mass * self.rest();
        mass.iter_mut().for_each(|m| *m += half);
        // Isotropic: half a rod about its end would be L^2 / 12; no mode is then faster than the bending of
        // the element itself.
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
        forces[0] = if history[BROKEN] > 0.0 { f64::NAN } else { self.force(u, history) };
    }

    fn force_utilisation(&self, _u: &[f64], force: f64) -> f64 {
        self.rupture.share(force.abs(), 0.0)
    }

    fn strain_utilisation(&self, u: &[f64], history: &[f64]) -> f64 {
        self.rupture.share(0.0, self.strain(u, history))
    }

    fn moments(&self, u: &[f64], history: &[f64]) -> [f64; 5] {
        if history[BROKEN] > 0.0 {
            return [0.0; 5];
        }
        let shape = self.shape(u, history);
        let force = self.resultants(&shape, history, None).force;
        let [[a, b], [c, d]] = [0, 1].map(|plane: usize| {
            // Over the cosine of their turn the moments of elastic ends are a little too large: 1.5 % at 10 degrees.
            let slopes = shape.arcs(plane).map(|arc| if self.fibres.is_none() { arc.1 } else { 1.0 });
            [force[1 + 2 * plane] * slopes[0], -(force[2 + 2 * plane] * slopes[1])]
        });
        let (twist, slope, _) = arc(shape.twist());
        [a, b, c, d, self.torsion / self.rest() * twist * slope]
    }

    fn plastic_utilisation(&self, u: &[f64], history: &[f64]) -> f64 {
        let Some(fibres) = self.fibres.as_ref().filter(|_| history[BROKEN] == 0.0) else { return 0.0 };
        let (moments, [a, b]) = (self.moments(u, history), fibres.section.plastic());
        let yields = fibres.law.yield_stress(0.0);
        let end = |i: usize| (moments[i] / a).abs() + (moments[2 + i] / b).abs();
        (self.force(u, history).abs() / self.area + end(0).max(end(1))) / yields
    }

    fn elongation(&self, u: &[f64]) -> f64 {
        (self.span + vector(u, 6) - vector(u, 0)).norm() - self.rest()
    }
}

part! {
    /// Beams between two nodes, with rotations.
    BeamPart: "beams", (2, 2) nodes, Line2 {
        /// Young's modulus [Pa]. Default that of `steel`.
        young: Option<f64>,
        /// Shear modulus [Pa]. Default `young / 2.6`.
        shear: Option<f64>,
        /// A section by name, in place of `area`, `inertia` and `torsion`: `HE 160 B`, `HE 160 A` (100 to 300), `CHS 101.6x6.3`
        /// (tube: diameter and wall in mm), `ROUND 20` (bar), `WIRES 7x3` (7 wires of 3 mm side by side, each of which bends about
        /// its own middle: the bundle of a ring). The web of an H lies towards `up`.
        section: Option<String>,
        /// Section [m2].
        area: Option<f64>,
        /// Second moments of area for bending towards `up`, and across it [m4]. With both 0 they are bars, which bear no moments.
        inertia: Option<[f64; 2]>,
        /// Torsion constant [m4]. Default that of `section`, or the sum of `inertia`, exact for circular sections.
        torsion: Option<f64>,
        /// Structural steel of EN 1993-1-1: modulus, density and the stress at which a `section` yields.
        steel: Option<Steel>,
        /// Stress at which the fibres of a `section` yield [Pa]. Default that of `steel`; without either they stay elastic.
        yield_stress: Option<f64>,
        /// How much that grows per plastic strain [Pa]. Default `young / 10000`, nearly nothing (EN 1993-1-5, C.6).
        hardening_modulus: Option<f64>,
        /// Tensile strain of a fibre at which the element tears, of a `section` that yields. It depends on the length of the elements in
        /// which the strains concentrate. Default: never.
        fracture_strain: Option<f64>,
        /// Density [kg/m3]; `static` alone does without. Default that of `steel`, else 0.
        density: Option<f64>,
        /// A direction that lies in the plane of the first bending. Default z, or x for upright beams.
        up: Option<[f64; 3]>,
    }
}

impl BeamPart {
    fn density(&self) -> f64 {
        self.density.unwrap_or(if self.steel.is_some() { Steel::DENSITY } else { 0.0 })
    }

    /// Young's modulus [Pa].
    fn young(&self, key: &Key) -> Result<f64, Diagnostic> {
        let of_steel = self.steel.map(|_| Steel::YOUNG);
        self.young.or(of_steel).ok_or_else(|| {
            key.scene
                .invalid(&key.key, "beams need a modulus")
                .try_instead("young = 2.1e11, or steel = \"S235\"")
        })
    }

    /// Area [m2], second moments and torsion constant [m4], and the section by name.
    fn sections(&self, key: &Key) -> Result<(f64, [f64; 2], f64, Option<Section>), Diagnostic> {
        if let Some(name) = &self.section {
            let stated = [("area", self.area.is_some()), ("inertia", self.inertia.is_some())];
            if let Some((twice, _)) = stated.iter().find(|(_, stated)| *stated) {
                return Err(key.invalid(twice, format!("`section` says it: leave out {twice}")));
            }
            let section = Section::named(name).map_err(|what| key.invalid("section", what))?;
            let (area, inertia) = (section.area(), section.inertia());
            return Ok((area, inertia, self.torsion.unwrap_or(section.torsion), Some(section)));
        }
        let (Some(area), Some(inertia)) = (self.area, self.inertia) else {
            let what = "beams need `area` and `inertia`, or a `section` by name";
            return Err(key.scene.invalid(&key.key, what).try_instead("section = \"HE 160 B\""));
        };
        Ok((area, inertia, self.torsion.unwrap_or(inertia[0] + inertia[1]), None))
    }

    /// The strain at which fibres tear, where stated: above that at which they yield.
    fn fracture_strain(&self, key: &Key, fibres: Option<&Fibres>) -> Result<f64, Diagnostic> {
        let Some(strain) = self.fracture_strain else { return Ok(f64::INFINITY) };
        let Some(law) = fibres.map(|fibres| &fibres.law) else {
            let what = "only fibres have strains, and this beam has none: it stays elastic";
            let hint = "section = \"HE 160 B\" and steel = \"S235\"; or rupture_force";
            return key.refuse("fracture_strain", what, hint);
        };
        let yields = law.yield_stress(0.0) / law.modulus;
        if !(strain > yields && strain < 1.0) {
            let what = format!(
                "fracture_strain = {strain}: it must lie above {yields:.5}, where the steel yields, and below 1"
            );
            return key.refuse("fracture_strain", what, "15 % is 0.15");
        }
        Ok(strain)
    }

    /// Fibres of a beam that yields; `None` of an elastic one.
    fn fibres(
        &self,
        key: &Key,
        young: f64,
        section: Option<Section>,
    ) -> Result<Option<Arc<Fibres>>, Diagnostic> {
        let Some(stress) = self.yield_stress.or(self.steel.map(Steel::yield_stress)) else {
            return Ok(None);
        };
        let hardening = self.hardening_modulus.unwrap_or(1e-4 * young);
        key.positive(&[("yield_stress", stress, "Pa")])?;
        key.not_negative(&[("hardening_modulus", hardening, "Pa")])?;
        let Some(section) = section else {
            let name = if self.yield_stress.is_some() { "yield_stress" } else { "steel" };
            let what = "where a section yields depends on its shape, which area and inertia do not say";
            return key.refuse(
                name,
                what,
                "section = \"HE 160 B\"; or young and density, for an elastic beam",
            );
        };
        let law = Law {
            hardening: vec![(0.0, stress), (1.0, stress + hardening)],
            ..Law::elastic(young, 0.0, false)
        };
        Ok(Some(Arc::new(Fibres::new(section, law))))
    }
}

impl PartSettings for BeamPart {
    fn turns_without_inertia(&self) -> bool {
        self.density() <= 0.0 && self.inertia != Some([0.0; 2])
    }

    fn build(&self, cell: &PartCell, made: &mut NewElements) -> Result<(), Diagnostic> {
        let (key, nodes, span) = (cell.key, cell.ends(), cell.spans()[0]);
        let (young, density) = (self.young(key)?, self.density());
        let (area, inertia, torsion, section) = self.sections(key)?;
        let shear = self.shear.unwrap_or(young / 2.6);
        key.positive(&[("young", young, "Pa"), ("area", area, "m2"), ("shear", shear, "Pa")])?;
        let bends = inertia != [0.0; 2];
        if bends {
            key.positive(&[("inertia", inertia[0].min(inertia[1]), "m4"), ("torsion", torsion, "m4")])?;
        }
        key.not_negative(&[("density", density, "kg/m3"), ("radius", self.radius.unwrap_or(0.0), "m")])?;
        let fibres = self.fibres(key, young, section)?;
        let strain = self.fracture_strain(key, fibres.as_deref())?;
        let rupture = Rupture { strain, ..key.rupture(self.rupture_force, None)? };
        if !bends {
            let bar = Bar {
                nodes,
                span,
                length: span.norm(),
                section: Some(area),
                mass: density * area * span.norm(),
                radius: self.radius.unwrap_or(0.0),
                law: Law::elastic(young, 0.0, false),
                rupture,
            };
            made.elements.push(bar.into());
            return Ok(());
        }
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
            area,
            axial: young * area,
            bending: inertia.map(|i| young * i),
            torsion: shear * torsion,
            line_mass: density * area,
            gyration: (torsion.max(inertia[0] + inertia[1]) / area).sqrt(),
            radius: self.radius.unwrap_or(0.0),
            rupture,
            fibres,
        };
        made.elements.push(beam.into());
        Ok(())
    }
}

#[cfg(test)]
mod tests;
