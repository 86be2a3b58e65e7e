//! A ring of a ring net, loaded at 3 or 4 points: a perimeter that stretches, and widths that bend it.
//!
//! ```text
//! perimeter  u = sum l_i - l_0,  N = k_t u        each side is pulled by N along itself
//! widths     u = |w_j| - w_0,    N = k_b u        w_j = sum_a c_a x_a
//! ```
//!
//! Each mechanism acts where `u > 0`, along its virgin line; below the largest `u` so far it unloads and
//! reloads with a multiple of its stiffness, down to 0 and no further. The area between is plastic bending.
//! With 4 points the widths are the two diagonals; with 3 they are the medians, three quarters of the diameter long in a
//! round ring.
//!
//! Source: handbook 2.3, after Volkwein (2004), ETH dissertation 15641.

pub mod formula;

use self::formula::{Formula, RingConstants, Stiffnesses, coefficient};
use super::part::{NewElements, PartCell, PartSettings, Surroundings, part};
use super::segment::{Segment, add_block, add_pair, add_scaled, add_vector};
use super::{Answer, AnyElement, Constants, Element, Energy};
use crate::element::Slack;
use interface_defs::diagnostic::{Diagnostic, code};
use nalgebra::{Matrix3, Vector3};
use std::array::from_fn;

/// One mechanism.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mechanism {
    /// Length beyond which it acts [m].
    pub start: f64,
    /// Stiffness of loading [N/m].
    pub stiffness: f64,
    /// Stiffness of unloading over that of loading, 1 or more.
    pub unloading: f64,
    /// Range of forces over which it goes slack [N], in a search for a rest shape; 0 = at a corner.
    pub ease: f64,
}

impl Mechanism {
    /// Force, its slope, and the largest extension, at the length `l` after the largest extension `most`.
    fn force(&self, l: f64, most: f64) -> (f64, f64, f64) {
        let u = l - self.start;
        if self.ease > 0.0 {
            return self.eased_force(u, most);
        }
        let law = Stiffnesses::from(self);
        let (force, most_now) = law.force(l, most);
        let slope = if u >= most { law.loading } else { law.unloading };
        (force, if force > 0.0 { slope } else { 0.0 }, most_now)
    }

    /// The same without a corner: `N = (f + sqrt(f^2 + 4 e^2)) / 2` of the force `f` that would push, too.
    fn eased_force(&self, u: f64, most: f64) -> (f64, f64, f64) {
        let (slope, most_now) =
            if u >= most { (self.stiffness, u.max(most)) } else { (self.stiffness * self.unloading, most) };
        let force = self.stiffness * most + slope * (u - most);
        let root = force.hypot(2.0 * self.ease);
        // Without the cancellation where it would push.
        let eased =
            if force > 0.0 { 0.5 * (force + root) } else { 2.0 * self.ease * self.ease / (root - force) };
        (eased, slope * eased / root, most_now)
    }
}

/// A ring.
#[derive(Debug, Clone)]
pub struct Ring {
    /// Its 3 or 4 nodes, around.
    pub nodes: Vec<usize>,
    /// From each node to the next as modelled [m].
    pub spans: Vec<Vector3<f64>>,
    /// The perimeter.
    pub perimeter: Mechanism,
    /// Each width.
    pub width: Mechanism,
    /// Mass [kg].
    pub mass: f64,
    /// Radius of its bundle that a contact sees [m].
    pub radius: f64,
    /// Force of the perimeter at which it breaks [N]; infinite = never.
    pub rupture: f64,
}

/// Numbers of its history: broken (0 or 1), energy lost at rupture [J], largest extension of its perimeter and of each width [m].
pub const BROKEN: usize = 0;
/// See [`BROKEN`].
pub const LOST: usize = 1;
/// See [`BROKEN`].
pub const PERIMETER: usize = 2;
/// See [`BROKEN`].
pub const WIDTHS: usize = 3;

impl Ring {
    /// The same, going slack over the forces `ease` [N]: for forces and tangents, its energy stays.
    pub fn eased(&self, ease: f64) -> Self {
        let mechanism = |of: Mechanism| Mechanism { ease, ..of };
        Self { perimeter: mechanism(self.perimeter), width: mechanism(self.width), ..self.clone() }
    }

    /// Whether it goes slack gradually.
    pub fn is_eased(&self) -> bool {
        self.perimeter.ease > 0.0 || self.width.ease > 0.0
    }

    fn side(&self, u: &[f64], i: usize) -> Segment {
        Segment::new(&self.spans[i], u, i, (i + 1) % self.nodes.len())
    }

    fn length(&self, u: &[f64]) -> f64 {
        (0..self.nodes.len()).map(|i| self.side(u, i).length).sum()
    }

    /// The widths as vectors [m].
    fn widths<const N: usize, const W: usize>(&self, u: &[f64]) -> [Vector3<f64>; W] {
        self.constants::<N>().widths::<W>(&places(u)).map(Vector3::from)
    }

    /// What its formulas need, over its `N` nodes.
    pub fn constants<const N: usize>(&self) -> RingConstants<N> {
        let spans = from_fn(|i| self.spans[i].into());
        let (perimeter, width) = ((&self.perimeter).into(), (&self.width).into());
        RingConstants { spans, perimeter, width, rupture: self.rupture }
    }

    /// Force, history, tension and tangent of an unbroken ring.
    fn pull<const N: usize, const W: usize>(&self, u: &[f64], history: &[f64], answer: &mut Answer) {
        if self.is_eased() {
            self.eased_pull::<N, W>(u, history, answer);
        } else {
            let pull = self.constants::<N>().pull(&places(u), &most::<W>(history));
            answer.force.copy_from_slice(pull.force.as_flattened());
            answer.tension = pull.tension;
            answer.history[PERIMETER] = pull.most.0;
            answer.history[WIDTHS..].copy_from_slice(&pull.most.1);
        }
        let slack = answer.slack;
        if let Some(k) = &mut answer.tangent {
            self.add_tangent::<N, W>(u, history, slack, k);
        }
    }

    /// Force, history and tension of one whose mechanisms go slack gradually.
    fn eased_pull<const N: usize, const W: usize>(&self, u: &[f64], history: &[f64], answer: &mut Answer) {
        let (force, _, most) = self.perimeter.force(self.length(u), history[PERIMETER]);
        answer.history[PERIMETER] = most;
        answer.tension = force;
        add_scaled(answer.force, force, &self.gradient(u));
        for (j, width) in self.widths::<N, W>(u).iter().enumerate() {
            let (force, _, most) = self.width.force(width.norm(), history[WIDTHS + j]);
            answer.history[WIDTHS + j] = most;
            let t = width.normalize();
            (0..N).for_each(|a| add_vector(answer.force, 3 * a, &(coefficient::<N>(j, a) * force * t)));
        }
    }

    /// Derivative of the length of its perimeter by each degree of freedom.
    fn gradient(&self, u: &[f64]) -> [f64; 12] {
        let (count, mut gradient) = (self.nodes.len(), [0.0; 12]);
        for i in 0..count {
            let t = self.side(u, i).direction();
            add_vector(&mut gradient, 3 * i, &-t);
            add_vector(&mut gradient, 3 * ((i + 1) % count), &t);
        }
        gradient
    }

    /// Add the tangent of an unbroken ring to `k`.
    fn add_tangent<const N: usize, const W: usize>(
        &self,
        u: &[f64],
        history: &[f64],
        slack: Slack,
        k: &mut [f64],
    ) {
        let n = 3 * N;
        let taut = |slope: f64, of: &Mechanism| match slack {
            Slack::Taut => of.stiffness * of.unloading,
            Slack::Regularised(part) if slope == 0.0 => part * of.stiffness,
            _ => slope,
        };
        let (force, slope, _) = self.perimeter.force(self.length(u), history[PERIMETER]);
        for i in 0..N {
            add_pair(k, n, 3 * i, 3 * ((i + 1) % N), &self.side(u, i).tangent(0.0, force));
        }
        let (gradient, stiffness) = (self.gradient(u), taut(slope, &self.perimeter));
        for (row, g) in k.chunks_exact_mut(n).zip(gradient) {
            row.iter_mut().zip(gradient).for_each(|(k, h)| *k += stiffness * g * h);
        }
        for (j, width) in self.widths::<N, W>(u).iter().enumerate() {
            let (force, slope, _) = self.width.force(width.norm(), history[WIDTHS + j]);
            let (t, across) = (width.normalize(), force / width.norm());
            let block = (taut(slope, &self.width) - across) * t * t.transpose()
                + Matrix3::from_diagonal_element(across);
            for (a, b) in (0..N).flat_map(|a| (0..N).map(move |b| (a, b))) {
                let share = coefficient::<N>(j, a) * coefficient::<N>(j, b);
                add_block(k, n, 3 * a, 3 * b, &(share * block));
            }
        }
    }

    fn tension(&self, u: &[f64], history: &[f64]) -> f64 {
        self.perimeter.force(self.length(u), history[PERIMETER]).0
    }

    fn energies(&self, u: &[f64], history: &[f64]) -> (f64, f64) {
        match self.nodes.len() {
            3 => self.constants::<3>().energy(&places(u), &most::<3>(history)),
            _ => self.constants::<4>().energy(&places(u), &most::<2>(history)),
        }
    }
}

/// A vector of each of `N` nodes out of the local `u`.
pub(super) fn places<const N: usize>(u: &[f64]) -> [[f64; 3]; N] {
    from_fn(|a| [u[3 * a], u[3 * a + 1], u[3 * a + 2]])
}

/// Largest extensions of the perimeter and of each width.
fn most<const W: usize>(history: &[f64]) -> (f64, [f64; W]) {
    (history[PERIMETER], from_fn(|j| history[WIDTHS + j]))
}

impl Element for Ring {
    fn eased(&self, range: f64) -> Option<AnyElement> {
        Some(Self::eased(self, range).into())
    }

    fn nodes(&self) -> &[usize] {
        &self.nodes
    }

    fn constants(&self) -> Constants {
        let (can_break, broken) = (self.rupture < f64::INFINITY, Some(BROKEN));
        let (lines, radius) = (self.nodes.len(), self.radius);
        Constants { can_break, broken, lines, forces: 1, radius, ..Constants::default() }
    }

    fn start_history(&self) -> Vec<f64> {
        vec![0.0; WIDTHS + if self.nodes.len() == 4 { 2 } else { 3 }]
    }

    fn add_to(&self, u: &[f64], history: &[f64], answer: &mut Answer) {
        if history[BROKEN] > 0.0 {
            return;
        }
        match self.nodes.len() {
            3 => self.pull::<3, 3>(u, history, answer),
            _ => self.pull::<4, 2>(u, history, answer),
        }
    }

    fn energy(&self, u: &[f64], history: &[f64]) -> Energy {
        let start = self.energies(&[0.0; 12], &[0.0; WIDTHS + 3]);
        let lost = history[LOST];
        if history[BROKEN] > 0.0 {
            let (_, dissipated) = self.energies(&[0.0; 12], history);
            return Energy { stored: -start.0, dissipated: lost + dissipated };
        }
        let (stored, dissipated) = self.energies(u, history);
        Energy { stored: stored - start.0, dissipated: lost + dissipated }
    }

    fn utilisation_bound(&self, u: &[f64], history: &[f64]) -> f64 {
        self.tension(u, history) / self.rupture
    }

    fn breaks(&self, u: &[f64], history: &mut [f64]) -> bool {
        if history[BROKEN] > 0.0 || self.tension(u, history) <= self.rupture {
            return false;
        }
        let (stored, dissipated) = self.energies(u, history);
        // What the history alone says it dissipated is told of it afterwards, too.
        history[LOST] += stored + dissipated - self.energies(&[0.0; 12], history).1;
        history[BROKEN] = 1.0;
        true
    }

    fn lump(&self, mass: &mut [f64], _inertia: &mut [f64]) {
        let share = self.mass / self.nodes.len() as f64;
        mass.iter_mut().for_each(|m| *m += share);
    }

    fn utilisation(&self, _u: &[f64], force: f64) -> f64 {
        force / self.rupture
    }

    fn line_forces(&self, u: &[f64], history: &[f64], forces: &mut [f64]) {
        forces.fill(if history[BROKEN] > 0.0 { f64::NAN } else { self.tension(u, history) });
    }

    /// Its lengths are roots; it unloads the stiffest.
    fn coarseness(&self) -> f64 {
        [&self.perimeter, &self.width]
            .map(|m| m.start * m.stiffness * m.unloading)
            .into_iter()
            .fold(0.0, f64::max)
    }

    fn elongation(&self, u: &[f64]) -> f64 {
        self.length(u) - self.spans.iter().map(Vector3::norm).sum::<f64>()
    }
}

part! {
    /// Rings of a ring net, by their 3 or 4 points of contact, around.
    RingPart: "rings", (3, 4) nodes, Tri3 | Quad4 {
        /// Diameter of the ring [m].
        diameter: f64,
        /// Stiffness of its perimeter, beyond its length [N/m].
        perimeter_stiffness: f64,
        /// Stiffness of each width (diagonal, or of 3 points the median beyond 3/4 of the diameter), beyond the diameter [N/m].
        bending_stiffness: f64,
        /// Length of the perimeter at which it becomes taut [m]. Default that of the circle.
        perimeter: Option<f64>,
        /// Stiffness of unloading over that of loading, of the perimeter and of the widths. Default `[3, 100]`.
        #[serde(default = "unloading")]
        unloading: [f64; 2],
        /// Mass of each ring [kg].
        mass: f64,
    }
}

/// Largest mass of a ring [kg], and least stiffness of its perimeter [N/m], of which nothing is said.
const HEAVIEST: f64 = 100.0;
const SOFTEST: f64 = 1e5;

fn unloading() -> [f64; 2] {
    [3.0, 100.0]
}

impl PartSettings for RingPart {
    fn build(&self, cell: &PartCell, made: &mut NewElements) -> Result<(), Diagnostic> {
        let (key, nodes) = (cell.key, cell.nodes);
        let perimeter = self.perimeter.unwrap_or(std::f64::consts::PI * self.diameter);
        key.positive(&[("diameter", self.diameter, "m"), ("perimeter", perimeter, "m")])?;
        key.positive(&[("perimeter_stiffness", self.perimeter_stiffness, "N/m")])?;
        key.positive(&[("bending_stiffness", self.bending_stiffness, "N/m")])?;
        key.not_negative(&[("mass", self.mass, "kg"), ("radius", self.radius.unwrap_or(0.0), "m")])?;
        if let Some(factor) = self.unloading.iter().find(|f| !(**f >= 1.0 && f.is_finite())) {
            return Err(key.invalid(
                "unloading",
                format!("it unloads with {factor} of its stiffness, it must be 1 or more"),
            ));
        }
        let share = if nodes.len() == 4 { 1.0 } else { 0.75 };
        let mechanism = |start, stiffness, unloading| Mechanism { start, stiffness, unloading, ease: 0.0 };
        let side = |i: usize| cell.positions[nodes[(i + 1) % nodes.len()]] - cell.positions[nodes[i]];
        let ring = Ring {
            nodes: nodes.to_vec(),
            spans: (0..nodes.len()).map(side).collect(),
            perimeter: mechanism(perimeter, self.perimeter_stiffness, self.unloading[0]),
            width: mechanism(share * self.diameter, self.bending_stiffness, self.unloading[1]),
            mass: self.mass,
            radius: self.radius.unwrap_or(0.0),
            rupture: key.rupture(self.rupture_force, None)?.force,
        };
        made.elements.push(ring.into());
        Ok(())
    }

    fn judge(&self, at: &Surroundings) -> Result<Vec<Diagnostic>, Diagnostic> {
        let mut warnings = judge_diameter(self.diameter, at)?;
        for (name, value, [least, most], cure) in [
            ("mass", self.mass, [0.0, HEAVIEST], "it is written in kg, that of each ring"),
            ("perimeter_stiffness", self.perimeter_stiffness, [SOFTEST, f64::INFINITY], "8000 kN/m is 8e6"),
        ] {
            if !(least..=most).contains(&value) {
                let what = format!("a {name} of {value} is that of no ring net");
                let about =
                    Diagnostic::warning(code::LIKELY_UNIT, what).about(format!("{}.{name}", at.key.key));
                warnings.push(about.try_instead(cure));
            }
        }
        Ok(warnings)
    }
}

/// Refuse a `diameter` [m] far beyond where the contacts of its ring lie; a warning where it is unusual.
pub(super) fn judge_diameter(diameter: f64, at: &Surroundings) -> Result<Vec<Diagnostic>, Diagnostic> {
    let size = at.size;
    if size > 0.0 && diameter > 20.0 * size {
        return Err(at.too_long("diameter", diameter, "its nodes lie within", size));
    }
    if size > 0.0 && !(0.5..=2.0).contains(&(diameter / size)) {
        let what = format!("{diameter} m, and its nodes lie {size:.4} m apart");
        let about = Diagnostic::warning(code::UNUSUAL_VALUE, what);
        return Ok(vec![about.about(format!("{}.diameter", at.key.key))]);
    }
    Ok(Vec::new())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::element::tests::checks::{Case, random};

    /// A ring of diameter 0.3 m with its nodes on the circle.
    fn ring(count: usize) -> (Ring, Vec<Vector3<f64>>) {
        let angle = |i: usize| std::f64::consts::TAU * i as f64 / count as f64;
        let points: Vec<_> =
            (0..count).map(|i| 0.15 * Vector3::new(angle(i).cos(), angle(i).sin(), 0.0)).collect();
        let spans = (0..count).map(|i| points[(i + 1) % count] - points[i]).collect();
        let sides: f64 = 2.0 * 0.15 * (std::f64::consts::PI / count as f64).sin() * count as f64;
        let width = if count == 4 { 0.3 } else { 0.225 };
        let ring = Ring {
            nodes: (0..count).collect(),
            spans,
            perimeter: Mechanism { start: sides * 1.02, stiffness: 2e5, unloading: 3.0, ease: 0.0 },
            width: Mechanism { start: width, stiffness: 1e4, unloading: 100.0, ease: 0.0 },
            mass: 0.8,
            radius: 0.0,
            rupture: f64::INFINITY,
        };
        (ring, points)
    }

    #[test]
    fn derivatives_rigid_motions_and_mass_are_consistent() {
        let mut noise = random(9);
        for count in [3, 4] {
            let (ring, points) = ring(count);
            for _ in 0..20 {
                let u: Vec<f64> = (0..3 * count).map(|_| 0.1 * noise()).collect();
                Case::new(&ring, &points, &u).check_all(0.8);
            }
        }
    }

    #[test]
    fn an_eased_ring_pulls_everywhere_and_its_corner_comes_back_as_the_range_narrows() {
        let exact = Mechanism { start: 0.3, stiffness: 1e4, unloading: 100.0, ease: 0.0 };
        for ease in [1e3, 1.0, 1e-3] {
            let eased = Mechanism { ease, ..exact };
            for most in [0.0, 0.02] {
                // Slack to yielding, in steps that avoid the corners.
                for i in -40..40 {
                    let l = 0.3 + most + (f64::from(i) + 0.3) * 5e-4;
                    let (force, slope, now) = eased.force(l, most);
                    let (without, _, then) = exact.force(l, most);
                    assert!(
                        slope > 0.0 && force >= without && force - without <= ease,
                        "{ease} {l}: {force}"
                    );
                    assert_eq!(now, then);
                    let h = 1e-8;
                    let difference = (eased.force(l + h, most).0 - eased.force(l - h, most).0) / (2.0 * h);
                    let rounding = 16.0 * f64::EPSILON * (force / h + slope / h);
                    assert!(
                        (slope - difference).abs() <= 1e-4 * slope + rounding,
                        "{ease} {l}: {slope} {difference}"
                    );
                }
            }
        }
        // Where it goes slack, the force of the corner is the whole range.
        let slack = 0.3 + 0.02 * (1.0 - 1.0 / exact.unloading);
        let at_corner = Mechanism { ease: 7.0, ..exact }.force(slack, 0.02).0;
        assert!((at_corner - 7.0).abs() < 1e-6, "{at_corner}");
    }

    #[test]
    fn it_unloads_steeper_than_it_loads_and_keeps_the_difference() {
        let (ring, points) = ring(4);
        // All nodes move outwards: widths grow by 2 d, the perimeter by 4 sqrt 2 d.
        let grown =
            |d: f64| points.iter().flat_map(|p| <[f64; 3]>::from(p.normalize() * d)).collect::<Vec<_>>();
        let mut history = ring.start_history();
        let mut work = 0.0;
        let steps = 4000;
        let path = (1..=steps).map(|i| 0.05 * f64::from(i) / f64::from(steps));
        let mut before = (0.0, 0.0);
        for d in path.clone().chain(path.rev()) {
            let u = grown(d);
            let case = Case::new(&ring, &[], &u).with_history(&history);
            let force: f64 = case.force().iter().zip(grown(1.0)).map(|(f, g)| f * g).sum();
            work += 0.5 * (force + before.1) * (d - before.0);
            before = (d, force);
            let mut after = history.clone();
            let mut force = [0.0; 12];
            let mut answer = Answer {
                force: &mut force,
                tangent: None,
                slack: Slack::Exact,
                history: &mut after,
                tension: 0.0,
            };
            ring.respond(&u, &history, &mut answer);
            history = after;
        }
        let energy = ring.energy(&grown(before.0), &history);
        assert!(energy.stored.abs() < 1e-12, "{energy:?}");
        // The trapezoidal rule over kinks: some 1e-6 of 60 J.
        assert!((work - energy.dissipated).abs() < 1e-4 * work, "{work} {energy:?}");
        let u = 0.1 + 0.0;
        let (l, w) = (4.0 * std::f64::consts::SQRT_2 * 0.2 - ring.perimeter.start, u);
        let exact = 0.5 * 2e5 * l * l * (1.0 - 1.0 / 3.0) + 2.0 * 0.5 * 1e4 * w * w * 0.99;
        assert!((energy.dissipated / exact - 1.0).abs() < 1e-9, "{} {exact}", energy.dissipated);
    }
}
