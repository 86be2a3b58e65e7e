//! A rope that slides over any number of nodes, without friction or with that of a capstan.

use super::capstan::{self, Returned, RopeLaw};
use super::material::Rupture;
use super::part::{NewElements, PartCell, PartSettings, is_zero, part};
use super::rope::Rope;
use super::segment::{Segment, add_pair, add_vector};
use super::{Answer, AnyElement, Constants, Element, Energy, Pace, Piece};
use crate::element::Slack;
use interface_defs::diagnostic::Diagnostic;
use nalgebra::{Matrix3, Vector3};
use std::cell::{RefCell, RefMut};

/// A rope from its first node over all others to its last.
///
/// Without friction it has one tension. With `l = sum l_i`, `L = sum L_i`, `g = dl/du`:
///
/// ```text
/// e = (l^2 - L^2) / (2 L^2),  N = A (s_0 + E e) l / L,  f = N g
/// K = dN/dl g (x) g + N dg/du,  dN/dl = (E A / L) (1 + 3 e) + s_0 A / L
/// ```
///
/// `dN/dl g (x) g` couples each node with each. It is what `n` springs of `n dN/dl` in a row show at their ends: with what slips past
/// each inner node as an unknown, every segment has such a spring of its own, and couples two nodes alone ([`Element::pieces`]).
///
/// With friction each segment has a tension, bound by its neighbours' as in `capstan`. The tangent is then
/// that of the return mapping, and not symmetric. Slack parts carry nothing.
///
/// Source: Volkwein (2004), ETH dissertation 15641 (without friction).
///
/// History: broken (0 or 1), energy lost at rupture [J], work of friction [J]; with friction, the
/// reference length of each segment [m].
#[derive(Debug, Clone)]
pub struct SlidingCable {
    /// Its nodes, two or more, in order.
    pub nodes: Vec<usize>,
    /// Span of each segment as modelled [m].
    pub spans: Vec<Vector3<f64>>,
    /// Unstretched length of each segment as modelled [m].
    pub lengths: Vec<f64>,
    /// Young's modulus [Pa].
    pub young: f64,
    /// Section [m2].
    pub area: f64,
    /// Density [kg/m3].
    pub density: f64,
    /// Second Piola-Kirchhoff stress at the unstretched length [Pa].
    pub prestress: f64,
    /// Coefficient of friction at its inner nodes.
    pub friction: f64,
    /// Radius that a contact sees [m].
    pub radius: f64,
    /// When it breaks.
    pub rupture: Rupture,
    /// Memory.
    pub memory: RopeMemory,
}

/// With friction a segment counts as long as this part of the shortest as modelled at least.
const LEAST: f64 = 0.5;
/// Part of its length as modelled below which a segment is blunted. Small enough to be seen nowhere else: under 1 000 kJ the barrier's
/// largest reaction over 1 ms is 567 kN with 0.01, 0.001 and without, 627 kN with 0.05, where nodes run up to the heads of posts.
const BLUNT: f64 = 1e-3;

const BROKEN: usize = 0;
const LOST: usize = 1;
const FRICTION: usize = 2;
const RESTS: usize = 3;

/// The rope at given displacements: memory that is kept so that nothing is allocated, and nothing computed twice. Force, energy
/// and gauges of a step, force and tangent of an iteration ask for the same.
#[derive(Debug, Clone, Default)]
struct RopeShape {
    /// Displacements and history that it was computed from; empty before.
    asked: Vec<f64>,
    segments: Vec<Segment>,
    lengths: Vec<f64>,
    factors: Vec<f64>,
    /// With friction only.
    returned: Returned,
    /// Tension of each segment [N]; the same in all without friction.
    forces: Vec<f64>,
    /// `dN/dl` without friction [N/m].
    stiffness: f64,
    /// For [`SlidingCable::tension_slopes`].
    by_length: Vec<f64>,
    by_wrap: Vec<f64>,
    into: Vec<f64>,
    slopes: Vec<f64>,
}

/// Memory of an element, which no answer depends on.
#[derive(Default)]
pub struct RopeMemory(Box<RefCell<RopeShape>>);

impl Clone for RopeMemory {
    // What is made of a rope may have another friction or stiffness: it begins without.
    fn clone(&self) -> Self {
        Self::default()
    }
}

impl std::fmt::Debug for RopeMemory {
    // Two ropes that are equal are shown as equal, whatever they have computed.
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        f.write_str("Memory")
    }
}

impl SlidingCable {
    fn law(&self) -> RopeLaw {
        let shortest = self.lengths.iter().copied().fold(f64::INFINITY, f64::min);
        let least = if self.friction > 0.0 { LEAST * shortest } else { 0.0 };
        RopeLaw { rigidity: self.young * self.area, preload: self.prestress * self.area, least }
    }

    fn total(&self) -> f64 {
        self.lengths.iter().sum()
    }

    /// Its segments where its nodes are displaced by `u`.
    fn pieces(&self, u: &[f64]) -> impl Iterator<Item = Segment> {
        let spans = self.spans.iter().enumerate();
        spans.map(|(i, span)| Segment::new(span, u, i, i + 1).blunted(BLUNT * span.norm()))
    }

    fn shape(&self, u: &[f64], history: &[f64]) -> RefMut<'_, RopeShape> {
        let mut borrowed = self.memory.0.borrow_mut();
        let shape = &mut *borrowed;
        let bits = |number: &f64| number.to_bits();
        if shape.asked.iter().map(bits).eq(u.iter().chain(history).map(bits)) {
            return borrowed;
        }
        shape.asked.clear();
        shape.asked.extend(u.iter().chain(history));
        shape.segments.clear();
        shape.segments.extend(self.pieces(u));
        shape.lengths.clear();
        shape.lengths.extend(shape.segments.iter().map(|s| s.length));
        let count = self.spans.len();
        shape.forces.clear();
        shape.forces.resize(count, 0.0);
        shape.stiffness = 0.0;
        if history[BROKEN] > 0.0 {
            return borrowed;
        }
        if self.friction == 0.0 {
            let one = self.law().tension(shape.lengths.iter().sum(), self.total());
            if one.force > 0.0 {
                shape.forces.fill(one.force);
                shape.stiffness = one.by_length;
            }
            return borrowed;
        }
        shape.factors.clear();
        shape.factors.extend(
            shape
                .segments
                .windows(2)
                .map(|pair| (self.friction * capstan::wrap(&pair[0].unit(), &pair[1].unit())).exp()),
        );
        shape.returned.slide(&self.law(), &shape.lengths, &history[RESTS..], &shape.factors);
        let tensions = shape.forces.iter_mut().zip(&shape.returned.tension);
        tensions.for_each(|(force, t)| *force = t.force.max(0.0));
        borrowed
    }

    /// Green-Lagrange strain of the whole rope at the length `l`.
    fn strain(&self, l: f64) -> f64 {
        let rest = self.total();
        (l * l - rest * rest) / (2.0 * rest * rest)
    }

    /// Stored energy [J] of segments of `lengths`, counted from where it is without stress; with friction these are `rest` long
    /// unstretched.
    fn stored(&self, lengths: impl Iterator<Item = f64>, rest: &[f64]) -> f64 {
        if self.friction > 0.0 {
            return lengths.zip(rest).map(|(l, rest)| self.law().energy(l, *rest)).sum();
        }
        self.law().energy(lengths.sum(), self.total())
    }

    /// Derivative of each tension with respect to every degree of freedom, by rows, into `shape.slopes`.
    fn tension_slopes(&self, shape: &mut RopeShape) {
        let (count, n) = (self.spans.len(), 3 * self.nodes.len());
        shape.slopes.resize(count * n, 0.0);
        shape.by_length.resize(count, 0.0);
        shape.by_wrap.resize(count - 1, 0.0);
        shape.into.resize(count, 0.0);
        for dof in 0..n {
            let (node, c) = (dof / 3, dof % 3);
            shape.by_length.fill(0.0);
            shape.by_wrap.fill(0.0);
            // Displacement of the node lengthens the segment before it and shortens the one behind it.
            for (segment, sign) in [(node.checked_sub(1), 1.0), (Some(node).filter(|n| *n < count), -1.0)] {
                let Some(i) = segment else { continue };
                shape.by_length[i] = sign * shape.segments[i].direction()[c];
                let along = shape.segments[i].unit();
                let mut unit = Vector3::zeros();
                unit[c] = sign;
                let turn = (unit - along * along.dot(&unit)) / shape.segments[i].distance();
                for inner in [i.checked_sub(1), Some(i).filter(|i| i + 1 < count)].into_iter().flatten() {
                    let other = shape.segments[if inner == i { i + 1 } else { i - 1 }].unit();
                    let (cosine, sine) = (along.dot(&other), along.cross(&other).norm());
                    // At 0 and at pi the angle has no slope; friction has none to first order there.
                    if sine > 1e-9 * cosine.abs() {
                        shape.by_wrap[inner] -= turn.dot(&other) / sine;
                    }
                }
            }
            if self.friction > 0.0 {
                shape.returned.derivative(self.friction, &shape.by_length, &shape.by_wrap, &mut shape.into);
            } else {
                shape.into.fill(shape.stiffness * shape.by_length.iter().sum::<f64>());
            }
            for (i, slope) in shape.into.iter().enumerate() {
                shape.slopes[i * n + dof] = if shape.forces[i] > 0.0 { *slope } else { 0.0 };
            }
        }
    }

    /// Add the tangent of an unbroken rope to `k`.
    fn add_tangent(&self, shape: &mut RopeShape, slack: Slack, k: &mut [f64]) {
        let n = 3 * self.nodes.len();
        if slack == Slack::Taut {
            // Every segment for itself, at least just taut: stiffer than what slides.
            for (i, (segment, rest)) in shape.segments.iter().zip(&self.lengths).enumerate() {
                let axial =
                    self.young * self.area * segment.length.powi(2) / rest.powi(3) + shape.forces[i] / rest;
                add_pair(k, n, 3 * i, 3 * i + 3, &segment.tangent(axial, shape.forces[i]));
            }
            return;
        }
        self.tension_slopes(shape);
        let slopes = &shape.slopes;
        for (i, segment) in shape.segments.iter().enumerate() {
            let t = segment.direction();
            for c in 0..3 {
                for dof in 0..n {
                    let growth = t[c] * slopes[i * n + dof];
                    k[(3 * i + c) * n + dof] -= growth;
                    k[(3 * i + 3 + c) * n + dof] += growth;
                }
            }
            add_pair(k, n, 3 * i, 3 * i + 3, &segment.tangent(0.0, shape.forces[i]));
            if let Slack::Regularised(part) = slack
                && shape.forces[i] == 0.0
            {
                let soft = Matrix3::from_diagonal_element(part * self.young * self.area / self.lengths[i]);
                add_pair(k, n, 3 * i, 3 * i + 3, &soft);
            }
        }
    }
}

impl Element for SlidingCable {
    fn frictionless(&self) -> Option<AnyElement> {
        (self.friction > 0.0).then(|| Self { friction: 0.0, ..self.clone() }.into())
    }

    fn frictionless_history<'a>(&self, history: &'a [f64]) -> &'a [f64] {
        &history[..RESTS]
    }

    fn relaxed_history(&self, u: &[f64], smooth: &[f64]) -> Vec<f64> {
        let mut history = self.start_history();
        history[..RESTS].copy_from_slice(smooth);
        if self.friction > 0.0 {
            // The same tension in every segment.
            let lengths: Vec<f64> = self.pieces(u).map(|s| s.length).collect();
            let share = self.total() / lengths.iter().sum::<f64>();
            history[RESTS..].iter_mut().zip(lengths).for_each(|(rest, l)| *rest = share * l);
        }
        history
    }

    fn nodes(&self) -> &[usize] {
        &self.nodes
    }

    fn constants(&self) -> Constants {
        let (can_break, broken) = (self.rupture != Rupture::NEVER, Some(BROKEN));
        let (lines, radius, section) = (self.spans.len(), self.radius, self.area);
        let in_pieces = self.friction == 0.0;
        Constants {
            can_break,
            broken,
            in_pieces,
            lines,
            forces: lines,
            radius,
            section,
            ..Constants::default()
        }
    }

    fn start_history(&self) -> Vec<f64> {
        let mut history = vec![0.0; RESTS];
        if self.friction > 0.0 {
            history.extend(&self.lengths);
        }
        history
    }

    fn add_to(&self, _pace: Pace, u: &[f64], history: &[f64], answer: &mut Answer) {
        if history[BROKEN] > 0.0 {
            return;
        }
        let mut shape = self.shape(u, history);
        if self.friction > 0.0 {
            answer.history[RESTS..].copy_from_slice(&shape.returned.rest);
            answer.history[FRICTION] += shape.returned.dissipated;
        }
        answer.tension = shape.forces.iter().copied().fold(0.0, f64::max);
        for (i, (segment, force)) in shape.segments.iter().zip(&shape.forces).enumerate() {
            let pull = *force * segment.direction();
            add_vector(answer.force, 3 * i, &-pull);
            add_vector(answer.force, 3 * i + 3, &pull);
        }
        if let Some(k) = &mut answer.tangent {
            self.add_tangent(&mut shape, answer.slack, k);
        }
    }

    fn pieces(&self, u: &[f64], history: &[f64], slack: Slack, take: &mut dyn FnMut(&Piece)) {
        let shape = self.shape(u, history);
        let (count, broken) = (self.spans.len(), history[BROKEN] > 0.0);
        for ((segment, force), rest) in shape.segments.iter().zip(&shape.forces).zip(&self.lengths) {
            let (mut k, rigidity) = ([[0.0; 8]; 8], self.young * self.area);
            let axial = match slack {
                _ if broken => 0.0,
                Slack::Taut => rigidity * segment.length.powi(2) / rest.powi(3) + force / rest,
                _ => (count as f64 * shape.stiffness).max(0.0),
            };
            let mut block = segment.tangent(axial, *force);
            if let Slack::Regularised(part) = slack
                && *force == 0.0
                && !broken
            {
                block += Matrix3::from_diagonal_element(part * rigidity / rest);
            }
            for (row, column) in (0..6).flat_map(|row| (0..6).map(move |column| (row, column))) {
                let sign = if row / 3 == column / 3 { 1.0 } else { -1.0 };
                k[row][column] = sign * block[(row % 3, column % 3)];
            }
            if slack != Slack::Taut && axial > 0.0 {
                // It is longer by `t . (u_2 - u_1) - s_1 + s_2`.
                let t = segment.direction();
                let growth = [-t.x, -t.y, -t.z, t.x, t.y, t.z, -1.0, 1.0];
                for (slip, along) in [(6, -axial), (7, axial)] {
                    (0..8).for_each(|i| (k[slip][i], k[i][slip]) = (along * growth[i], along * growth[i]));
                }
            } else {
                // Nothing to slip, of a rope that is slack or counts piece by piece.
                (k[6][6], k[7][7]) = (1.0, 1.0);
            }
            take(&k);
        }
    }

    fn energy(&self, u: &[f64], history: &[f64]) -> Energy {
        let start = self.stored(self.spans.iter().map(Vector3::norm), &self.lengths);
        let mut dissipated = history[LOST] + history[FRICTION];
        if history[BROKEN] > 0.0 {
            return Energy { stored: -start, dissipated };
        }
        let shape = self.shape(u, history);
        if self.friction > 0.0 {
            dissipated += shape.returned.dissipated;
        }
        let stored = self.stored(shape.lengths.iter().copied(), &shape.returned.rest);
        Energy { stored: stored - start, dissipated }
    }

    /// Slips take length to where tension is highest: what segments would carry without them is more.
    fn utilisation_bound(&self, u: &[f64], history: &[f64]) -> f64 {
        let (law, mut length, mut largest) = (self.law(), 0.0, 0.0_f64);
        for (i, piece) in self.pieces(u).enumerate() {
            length += piece.length;
            if self.friction > 0.0 {
                largest = largest.max(law.tension(piece.length, history[RESTS + i]).force);
            }
        }
        if self.friction == 0.0 {
            largest = law.tension(length, self.total()).force;
        }
        self.rupture.share(largest, self.strain(length))
    }

    fn breaks(&self, u: &[f64], history: &mut [f64]) -> bool {
        if history[BROKEN] > 0.0 || self.rupture == Rupture::NEVER {
            return false;
        }
        let shape = self.shape(u, history);
        let strain = self.strain(shape.lengths.iter().sum());
        let breaks = self.rupture.at(shape.forces.iter().copied().fold(0.0, f64::max), strain);
        if breaks {
            history[BROKEN] = 1.0;
            history[LOST] += self.stored(shape.lengths.iter().copied(), &shape.returned.rest);
        }
        breaks
    }

    fn lump(&self, mass: &mut [f64], _inertia: &mut [f64]) {
        for (i, length) in self.lengths.iter().enumerate() {
            let half = 0.5 * self.density * self.area * length;
            mass[i] += half;
            mass[i + 1] += half;
        }
    }

    fn line_forces(&self, u: &[f64], history: &[f64], forces: &mut [f64]) {
        if history[BROKEN] > 0.0 {
            forces.fill(f64::NAN);
        } else {
            forces.copy_from_slice(&self.shape(u, history).forces);
        }
    }

    /// Its length is a sum of roots.
    fn coarseness(&self) -> f64 {
        self.young * self.area
    }

    fn force_utilisation(&self, u: &[f64], force: f64) -> f64 {
        // The lengths of all pieces, for nothing where the strain is no matter.
        let strain = || self.strain(self.pieces(u).map(|s| s.length).sum());
        self.rupture.share(force, if self.rupture.strain.is_finite() { strain() } else { 0.0 })
    }

    fn elongation(&self, u: &[f64]) -> f64 {
        self.pieces(u).zip(&self.spans).map(|(piece, span)| piece.length - span.norm()).sum()
    }
}

part! {
    /// Ropes that slide over all of their nodes but the ends; lines of a mesh that follow each other are one rope.
    SlidingCablePart: "sliding cables", (2, usize::MAX) nodes, Line2 | Row {
        /// A wire rope from its catalogue, in place of `young`, `area`, `density`, `radius` and `rupture_force`; those of them that are
        /// stated go before.
        rope: Option<Rope>,
        /// Young's modulus [Pa].
        young: Option<f64>,
        /// Section [m2].
        area: Option<f64>,
        /// Density [kg/m3].
        density: Option<f64>,
        /// Second Piola-Kirchhoff stress at the unstretched length [Pa]; below 0: slack. Default 0.
        #[serde(default, skip_serializing_if = "is_zero")]
        prestress: f64,
        /// Unstretched length of each whole rope [m]. Default that of its polygon as modelled.
        length: Option<f64>,
        /// Coefficient of friction at inner nodes (capstan). Default 0.
        #[serde(default, skip_serializing_if = "is_zero")]
        friction: f64,
        /// Green-Lagrange strain of the whole rope at which it breaks. Default: never.
        rupture_strain: Option<f64>,
    }
}

impl SlidingCablePart {
    /// Fill in what its rope says.
    pub fn complete(&mut self) {
        let Self { rope, young, area, density, radius, rupture_force, .. } = self;
        if let Some(rope) = rope {
            rope.complete([young, area, density, radius, rupture_force]);
        }
    }
}

impl PartSettings for SlidingCablePart {
    fn joins_lines(&self) -> bool {
        true
    }

    fn build(&self, cell: &PartCell, made: &mut NewElements) -> Result<(), Diagnostic> {
        let key = cell.key;
        let (length, radius) = (self.length.unwrap_or(1.0), self.radius.unwrap_or(0.0));
        self.rope.map_or(Ok(()), |rope| rope.check(key))?;
        let needed = |name: &str, value: Option<f64>| {
            let missing = || key.scene.invalid(&key.key, format!("missing field `{name}`, or a `rope`"));
            value.ok_or_else(missing)
        };
        let (young, area) = (needed("young", self.young)?, needed("area", self.area)?);
        let density = needed("density", self.density)?;
        key.positive(&[("young", young, "Pa"), ("area", area, "m2"), ("length", length, "m")])?;
        key.not_negative(&[("density", density, "kg/m3"), ("radius", radius, "m")])?;
        key.not_negative(&[("friction", self.friction, "")])?;
        let spans = cell.spans();
        let polygon: f64 = spans.iter().map(Vector3::norm).sum();
        let share = self.length.unwrap_or(polygon) / polygon;
        let rope = SlidingCable {
            nodes: cell.nodes.to_vec(),
            lengths: spans.iter().map(|s| share * s.norm()).collect(),
            spans,
            young,
            area,
            density,
            prestress: self.prestress,
            friction: self.friction,
            radius,
            rupture: key.rupture(self.rupture_force, self.rupture_strain)?,
            memory: RopeMemory::default(),
        };
        made.elements.push(rope.into());
        Ok(())
    }
}

#[cfg(test)]
mod tests;
