//! A ring by the stiffnesses of its mechanisms, loaded at 3 or 4 points: a perimeter that stretches, and widths that bend it.
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
//! Source: Volkwein (2004), Numerische Simulation von flexiblen Steinschlagschutzsystemen, ETH dissertation 15641.

#![expect(
    clippy::needless_range_loop,
    reason = "iterators over components keep the compiler from wide registers"
)]

use super::formula::{Extensions, Formula, RingPull, RingSides, Vector, add_perimeter, norm};
use super::{Ring, RingLaw, judge_diameter, sides};
use crate::element::Slack;
use crate::element::part::{NewElements, PartCell, PartSettings, Surroundings, part};
use crate::element::segment::add_block;
use interface_defs::diagnostic::{Diagnostic, code};
use nalgebra::{Matrix3, Vector3};

/// One mechanism.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Mechanism {
    /// Length beyond which it acts [m].
    pub start: f64,
    /// Stiffness of loading [N/m].
    pub loading: f64,
    /// Stiffness of unloading [N/m].
    pub unloading: f64,
    /// Share of the work of loading that is dissipated.
    pub lost: f64,
}

impl Mechanism {
    /// Beyond the length `start` [m], with a `stiffness` [N/m], so many times as stiff on unloading: 1 or more.
    pub fn new(start: f64, stiffness: f64, unloading: f64) -> Self {
        Self { start, loading: stiffness, unloading: stiffness * unloading, lost: 1.0 - 1.0 / unloading }
    }

    /// Force [N] and largest extension [m] at the length `l` [m] after the largest extension `most` [m], which is 0 or more.
    #[inline(always)]
    pub fn force(&self, l: f64, most: f64) -> (f64, f64) {
        let u = l - self.start;
        let loads = u >= most;
        let back = self.loading * most - self.unloading * (most - u);
        let back = if back > 0.0 { back } else { 0.0 };
        (if loads { self.loading * u } else { back }, if loads { u } else { most })
    }

    /// The same without a corner at slack, over a range of forces `ease` [N]: `N = (f + sqrt(f^2 + 4 e^2)) / 2` of the force `f` that
    /// would push, too. The slope [N/m] comes with it.
    pub fn eased_force(&self, l: f64, most: f64, ease: f64) -> (f64, f64, f64) {
        let u = l - self.start;
        let (slope, most_now) = if u >= most { (self.loading, u.max(most)) } else { (self.unloading, most) };
        let force = self.loading * most + slope * (u - most);
        let root = force.hypot(2.0 * ease);
        // Without the cancellation where it would push.
        let eased = if force > 0.0 { 0.5 * (force + root) } else { 2.0 * ease * ease / (root - force) };
        (eased, slope * eased / root, most_now)
    }

    /// Force and its slope there [N, N/m], eased or not, as the tangent shall show it.
    fn tangent(&self, l: f64, most: f64, ease: f64, slack: Slack) -> (f64, f64) {
        let (force, slope) = if ease > 0.0 {
            let (force, slope, _) = self.eased_force(l, most, ease);
            (force, slope)
        } else {
            let (force, _) = self.force(l, most);
            let slope = if l - self.start >= most { self.loading } else { self.unloading };
            (force, if force > 0.0 { slope } else { 0.0 })
        };
        let shown = match slack {
            Slack::Taut => self.unloading,
            Slack::Regularised(part) if slope == 0.0 => part * self.loading,
            _ => slope,
        };
        (force, shown)
    }

    /// Stored and dissipated energy [J] at the length `l` [m] after the largest extension `most` [m].
    #[inline(always)]
    pub fn energy(&self, l: f64, most: f64) -> (f64, f64) {
        let (force, most) = self.force(l, most);
        (force * force / (2.0 * self.unloading), 0.5 * self.loading * most * most * self.lost)
    }
}

/// The mechanisms of a ring over `N` nodes with `W` widths, and its sides.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mechanisms<const N: usize, const W: usize> {
    /// From each node to the next as modelled [m].
    pub spans: [Vector; N],
    /// The perimeter.
    pub perimeter: Mechanism,
    /// Each width.
    pub width: Mechanism,
    /// Force of the perimeter at which it breaks [N]; infinite = never.
    pub rupture: f64,
    /// Range of forces over which both go slack [N], in a search for a rest shape; 0 = at a corner. Their energy is that without.
    pub ease: f64,
}

/// Coefficient of node `a` in width number `j` of a ring of `N` nodes: diagonals of four, medians of three.
#[inline(always)]
const fn coefficient<const N: usize>(j: usize, a: usize) -> f64 {
    match (N, (a + N - j) % N) {
        (_, 0) => -1.0,
        (3, _) => 0.5,
        (_, 2) => 1.0,
        _ => 0.0,
    }
}

impl<const N: usize, const W: usize> Mechanisms<N, W> {
    /// The widths as vectors [m].
    #[inline(always)]
    fn widths(&self, u: &[Vector; N]) -> [Vector; W] {
        let (mut widths, mut place) = ([[0.0; 3]; W], [0.0; 3]);
        for a in 0..N {
            for c in 0..3 {
                let position = place[c] + u[a][c];
                for (j, width) in widths.iter_mut().enumerate() {
                    if coefficient::<N>(j, a) != 0.0 {
                        width[c] += coefficient::<N>(j, a) * position;
                    }
                }
                place[c] += self.spans[a][c];
            }
        }
        widths
    }

    /// Force of a mechanism [N] and its largest extension [m].
    #[inline(always)]
    fn force<const EASED: bool>(&self, of: &Mechanism, l: f64, most: f64) -> (f64, f64) {
        if !EASED {
            return of.force(l, most);
        }
        let (force, _, most) = of.eased_force(l, most, self.ease);
        (force, most)
    }

    #[inline(always)]
    fn pull_by<const EASED: bool>(&self, u: &[Vector; N], most: &Extensions<W>) -> RingPull<N, W> {
        let sides = RingSides::new(&self.spans, u);
        let (tension, stretched) = self.force::<EASED>(&self.perimeter, sides.perimeter, most.0);
        let mut pull = RingPull { force: [[0.0; 3]; N], tension, most: (stretched, most.1) };
        let mut along = sides.spans;
        for i in 0..N {
            for c in 0..3 {
                let unit = along[i][c] / sides.lengths[i];
                along[i][c] = if sides.lengths[i] > 0.0 { unit } else { 0.0 };
            }
        }
        for i in 0..N {
            for c in 0..3 {
                pull.force[i][c] = tension * (along[(i + N - 1) % N][c] - along[i][c]);
            }
        }
        for (j, width) in self.widths(u).into_iter().enumerate() {
            let length = norm(width);
            let (force, stretched) = self.force::<EASED>(&self.width, length, most.1[j]);
            pull.most.1[j] = stretched;
            for c in 0..3 {
                let unit = width[c] / length;
                for a in 0..N {
                    if coefficient::<N>(j, a) != 0.0 {
                        pull.force[a][c] += coefficient::<N>(j, a) * force * unit;
                    }
                }
            }
        }
        pull
    }
}

impl<const N: usize, const W: usize> Formula<N, W> for Mechanisms<N, W> {
    #[inline(always)]
    fn over(self, spans: [Vector; N]) -> Self {
        Self { spans, ..self }
    }

    fn spans(&self) -> [Vector; N] {
        self.spans
    }

    fn modelled(&self) -> (f64, f64) {
        (self.energy(&[[0.0; 3]; N], &(0.0, [0.0; W])).0, 0.0)
    }

    #[inline(always)]
    fn length(&self, u: &[Vector; N]) -> f64 {
        RingSides::new(&self.spans, u).perimeter
    }

    #[inline(always)]
    fn tension(&self, length: f64, most: f64) -> f64 {
        self.perimeter.force(length, most).0
    }

    #[inline(always)]
    fn pull(&self, u: &[Vector; N], most: &Extensions<W>) -> RingPull<N, W> {
        self.pull_by::<false>(u, most)
    }

    fn pull_alone(&self, u: &[Vector; N], most: &Extensions<W>) -> RingPull<N, W> {
        if self.ease > 0.0 { self.pull_by::<true>(u, most) } else { self.pull(u, most) }
    }

    fn add_tangent(&self, u: &[Vector; N], most: &Extensions<W>, slack: Slack, k: &mut [f64]) {
        let of_perimeter = self.perimeter.tangent(self.length(u), most.0, self.ease, slack);
        add_perimeter(k, (&self.spans, 0.0), u, of_perimeter);
        for (j, width) in self.widths(u).map(Vector3::from).iter().enumerate() {
            let (force, slope) = self.width.tangent(width.norm(), most.1[j], self.ease, slack);
            let (t, across) = (width.normalize(), force / width.norm());
            let block = (slope - across) * t * t.transpose() + Matrix3::from_diagonal_element(across);
            for (a, b) in (0..N).flat_map(|a| (0..N).map(move |b| (a, b))) {
                let share = coefficient::<N>(j, a) * coefficient::<N>(j, b);
                add_block(k, 3 * N, 3 * a, 3 * b, &(share * block));
            }
        }
    }

    #[inline(always)]
    fn energy(&self, u: &[Vector; N], most: &Extensions<W>) -> (f64, f64) {
        let perimeter = RingSides::new(&self.spans, u).perimeter;
        let (mut stored, mut dissipated) = self.perimeter.energy(perimeter, most.0);
        for (j, width) in self.widths(u).into_iter().enumerate() {
            let own = self.width.energy(norm(width), most.1[j]);
            stored += own.0;
            dissipated += own.1;
        }
        (stored, dissipated)
    }

    #[inline(always)]
    fn strength(&self) -> f64 {
        self.rupture
    }

    /// Its lengths are roots; it unloads the stiffest.
    fn coarseness(&self) -> f64 {
        f64::max(self.perimeter.start * self.perimeter.unloading, self.width.start * self.width.unloading)
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

impl RingPart {
    /// Over `N` nodes, with widths that are this `share` of the diameter.
    fn mechanisms<const N: usize, const W: usize>(
        &self,
        cell: &PartCell,
        share: f64,
    ) -> Result<Mechanisms<N, W>, Diagnostic> {
        let perimeter = self.perimeter.unwrap_or(std::f64::consts::PI * self.diameter);
        let rupture = cell.key.rupture(self.rupture_force, None)?.force;
        Ok(Mechanisms {
            spans: sides(cell),
            perimeter: Mechanism::new(perimeter, self.perimeter_stiffness, self.unloading[0]),
            width: Mechanism::new(share * self.diameter, self.bending_stiffness, self.unloading[1]),
            rupture,
            ease: 0.0,
        })
    }
}

impl PartSettings for RingPart {
    fn build(&self, cell: &PartCell, made: &mut NewElements) -> Result<(), Diagnostic> {
        let key = cell.key;
        key.positive(&[("diameter", self.diameter, "m"), ("perimeter", self.perimeter.unwrap_or(1.0), "m")])?;
        key.positive(&[("perimeter_stiffness", self.perimeter_stiffness, "N/m")])?;
        key.positive(&[("bending_stiffness", self.bending_stiffness, "N/m")])?;
        key.not_negative(&[("mass", self.mass, "kg"), ("radius", self.radius.unwrap_or(0.0), "m")])?;
        if let Some(factor) = self.unloading.iter().find(|f| !(**f >= 1.0 && f.is_finite())) {
            return Err(key.invalid(
                "unloading",
                format!("it unloads with {factor} of its stiffness, it must be 1 or more"),
            ));
        }
        let law = match cell.nodes.len() {
            3 => RingLaw::Three(self.mechanisms(cell, 0.75)?),
            _ => RingLaw::Four(self.mechanisms(cell, 1.0)?),
        };
        let (nodes, radius) = (cell.nodes.to_vec(), self.radius.unwrap_or(0.0));
        made.elements.push(Ring { nodes, law, section: 0.0, mass: self.mass, radius }.into());
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
                let about = Diagnostic::warning(code::LIKELY_UNIT, what).about(at.key.at(name));
                warnings.push(about.try_instead(cure));
            }
        }
        Ok(warnings)
    }
}
