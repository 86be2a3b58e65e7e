//! Friction of a rope over the nodes that it slides on: the return mapping, all nodes at once.
//!
//! Each segment has a reference length `L_i` of its own; their sum is that of the rope. At a node
//! with the wrap angle `phi`, `r = exp(mu phi)`, the tensions must satisfy
//!
//! ```text
//! N_i <= r N_(i-1)   and   N_(i-1) <= r N_i
//! ```
//!
//! Where they do not, reference length passes to the side of higher tension until they just do. With `y_i = ln N_i` the slips
//! `s_j` are where a convex sum is least,
//!
//! ```text
//! sum E_i(L_i + s_(i-1) - s_i) + sum mu phi_j |s_j|,   dE_i/dL = -y_i
//! ```
//!
//! for its conditions are those above: the rise of `y` over a node that slips is `mu phi` in the direction of the slip, and lies between where it
//! sticks. With `E` taken as a parabola in each segment, the least is found exactly in one pass along the rope and back ([`Returned::find_target`]);
//! from there again, some four times, and by a part of the step where the sum grows again behind it. So it comes down from anywhere, and does not
//! depend on the end where one starts.
//!
//! Source of the pass: Johnson (2013), J. Comput. Graph. Stat. 22, 246, there for the bounds of neighbours.

use nalgebra::Vector3;
use std::cmp::Ordering;
use std::sync::Once;

/// Most iterations. A prototype took 20 at most for 2 700 ropes, at random or with 95 segments bunched by their nodes, and four in the median of
/// the latter.
const MOST: usize = 100;
/// Most halvings of a step.
const HALVINGS: usize = 40;
/// A step is short enough where the sum, behind it, grows by less than this part of how it fell before.
const TURNS: f64 = 0.3;
/// Change of tension, relative to the stiffness of the rope, below which a node has returned.
const SETTLED: f64 = 1e-14;
/// Change of a slip, relative to the length of the rope, that is rounding where [`SETTLED`] nearly holds.
const ROUNDING: f64 = 2e-15;
/// See [`ROUNDING`].
const NEARLY: f64 = 1e-11;
/// A slack segment shows this part of its stiffness, so that length still finds its way through it.
const SLACK: f64 = 1e-9;
/// Tension over `E A` from which on down its logarithm goes on straight: the cone holds to this.
const LOWEST: f64 = 1e-9;

/// RopeLaw of a segment: `N = A (s_0 + E e) l / L`, `e = (l^2 - L^2) / (2 L^2)`.
#[derive(Debug, Clone, Copy)]
pub struct RopeLaw {
    /// `E A` [N].
    pub rigidity: f64,
    /// `s_0 A` [N].
    pub preload: f64,
    /// Reference length below which a segment counts as one of this length, the rest of it in line and unloaded [m]: no
    /// node that runs up to its neighbour makes a segment stiffer than explicit steps can follow.
    pub least: f64,
}

/// Force of a segment and what it depends on.
#[derive(Debug, Clone, Copy, Default)]
pub struct Tension {
    /// `N`, below 0 where slack [N].
    pub force: f64,
    /// `dN/dl` [N/m].
    pub by_length: f64,
    /// `dN/dL` [N/m].
    pub by_rest: f64,
}

impl RopeLaw {
    /// Of a segment of length `l` that is `rest` long unstretched.
    pub fn tension(&self, l: f64, rest: f64) -> Tension {
        let short = rest < self.least;
        let (l, rest) = self.padded(l, rest);
        let (x, stress) = (l / rest, self.stress(l, rest));
        let by_length = (stress + self.rigidity * x * x) / rest;
        Tension { force: stress * x, by_length, by_rest: if short { -by_length } else { -by_length * x } }
    }

    /// Length and reference length, of [`RopeLaw::least`] at least.
    fn padded(&self, l: f64, rest: f64) -> (f64, f64) {
        if rest < self.least { (l + self.least - rest, self.least) } else { (l, rest) }
    }

    /// `S A`, of a segment of length `l` that is `rest` long unstretched [N]; both padded.
    fn stress(&self, l: f64, rest: f64) -> f64 {
        self.preload + self.rigidity * (l - rest) * (l + rest) / (2.0 * rest * rest)
    }

    /// `S A` and its derivative by `L`: unlike `N` it falls with `L` however far a slack segment is pushed together.
    fn slack(&self, l: f64, rest: f64) -> (f64, f64) {
        let (padded, whole) = self.padded(l, rest);
        let x = padded / whole;
        let falls = self.rigidity * if rest < self.least { x } else { x * x } / whole;
        (self.stress(padded, whole), -falls.max(SLACK * self.rigidity / whole))
    }

    /// Stored energy [J], counted from where the stress is 0.
    pub fn energy(&self, l: f64, rest: f64) -> f64 {
        let (l, rest) = self.padded(l, rest);
        let stress = self.stress(l, rest).max(0.0);
        rest * stress * stress / (2.0 * self.rigidity)
    }

    /// Energy that a unit of reference length carries as it leaves the segment, `-dW/dL` at constant length [N].
    pub fn release(&self, l: f64, rest: f64) -> f64 {
        if rest < self.least {
            return self.tension(l, rest).force.max(0.0);
        }
        let stress = self.stress(l, rest).max(0.0);
        stress * (l / rest).powi(2) - stress * stress / (2.0 * self.rigidity)
    }
}

/// Direction of slip of a node: length passes into the segment behind it.
const FORWARD: Ordering = Ordering::Greater;
/// Length passes into the segment before it.
const BACKWARD: Ordering = Ordering::Less;
const STICKS: Ordering = Ordering::Equal;

/// A rope that has returned to where friction holds it, and the memory for that.
#[derive(Debug, Clone, Default)]
pub struct Returned {
    /// Reference length of each segment [m].
    pub rest: Vec<f64>,
    /// Tension of each segment.
    pub tension: Vec<Tension>,
    /// Work of friction on the way [J].
    pub dissipated: f64,
    contacts: Vec<Ordering>,
    factors: Vec<f64>,
    /// Their logarithms, `mu phi`.
    bounds: Vec<f64>,
    slip: Vec<f64>,
    /// Slips before a step, and where it leads.
    start: Vec<f64>,
    target: Vec<f64>,
    /// Logarithm of each tension, and by how much it falls per reference length.
    logarithms: Vec<(f64, f64)>,
    /// For [`Returned::find_target`]: where the logarithm of each tension would lie as far as the rope before it goes; and, to the left and right of
    /// that, where the slope of the sum changes, and by how much.
    best: Vec<f64>,
    knots: [Vec<(f64, f64)>; 2],
    /// The tridiagonal system: below, on and above the diagonal, and the right-hand side.
    system: [Vec<f64>; 4],
}

/// Wrap angle [rad] between two directions.
pub fn wrap(before: &Vector3<f64>, behind: &Vector3<f64>) -> f64 {
    // By the half angle: exact for small angles and for all but a reversal.
    2.0 * (behind - before).norm().atan2((behind + before).norm())
}

/// Tension of a segment; a slack one shows [`SLACK`] of its stiffness.
fn softened(law: &RopeLaw, l: f64, rest: f64) -> Tension {
    let full = law.tension(l, rest);
    if full.force >= 0.0 {
        return full;
    }
    Tension { force: SLACK * full.force, by_length: SLACK * full.by_length, by_rest: SLACK * full.by_rest }
}

/// Reference length that passes into segment `i` by the `slip` of the nodes at its ends.
fn length_change(slip: &[f64], i: usize) -> f64 {
    let before = if i > 0 { slip[i - 1] } else { 0.0 };
    before - slip.get(i).copied().unwrap_or(0.0)
}

impl Returned {
    /// Let a rope with segments of `lengths` and the committed reference lengths `rest` slip over its inner
    /// nodes, where `factors` are `exp(mu phi)`.
    pub fn slide(&mut self, law: &RopeLaw, lengths: &[f64], rest: &[f64], factors: &[f64]) {
        let inner = factors.len();
        self.begin(rest, factors);
        let settled = self.settle(law, lengths, rest);
        self.tension.clear();
        self.tension.extend(lengths.iter().zip(&self.rest).map(|(l, rest)| softened(law, *l, *rest)));
        if !settled {
            static SAID: Once = Once::new();
            SAID.call_once(|| {
                tracing::warn!(
                    "the slips of a rope over its {inner} nodes did not converge: its tensions are wrong in that step (reported once)"
                );
            });
        }
        let release = |i: usize| law.release(lengths[i], self.rest[i]);
        self.dissipated = (0..inner).map(|j| self.slip[j] * (release(j + 1) - release(j))).sum();
    }

    /// Slip to where the sum is least; whether it settled.
    fn settle(&mut self, law: &RopeLaw, lengths: &[f64], rest: &[f64]) -> bool {
        let (inner, least) = (self.factors.len(), LOWEST * law.rigidity);
        let total: f64 = rest.iter().sum();
        self.pull(law, lengths);
        for _ in 0..MOST {
            let mut left = 0.0_f64;
            for j in 0..inner {
                self.contacts[j] = self.slip_direction(j);
                let slope = match self.contacts[j] {
                    FORWARD => self.bounds[j] - self.rise(j),
                    BACKWARD => self.bounds[j] + self.rise(j),
                    STICKS => 0.0,
                };
                let force = self.tension[j].force.max(self.tension[j + 1].force).max(least);
                left = left.max(slope.abs() * force);
            }
            if left <= SETTLED * law.rigidity {
                return true;
            }
            self.find_target(rest);
            self.start.copy_from_slice(&self.slip);
            let step_of = |of: &Self, j: usize| of.target[j] - of.start[j];
            if left <= NEARLY * law.rigidity && (0..inner).all(|j| step_of(self, j).abs() <= ROUNDING * total)
            {
                return true;
            }
            // No segment may lose more than half of what it counts as at once.
            let mut share = 1.0_f64;
            for (i, now) in self.rest.iter().enumerate() {
                let change = rest[i] + length_change(&self.target, i) - now;
                let most = -0.5 * now.max(law.least);
                share = share.min(if change < most { most / change } else { 1.0 });
            }
            // Slope of the sum along the step: at its start ahead, and from where it ends back.
            let slope = |of: &Self, j: usize, towards: f64| {
                let sign = if of.slip[j] == 0.0 { towards } else { of.slip[j] }.signum();
                step_of(of, j) * (sign * of.bounds[j] - of.rise(j))
            };
            let before: f64 = (0..inner).map(|j| slope(self, j, step_of(self, j))).sum();
            for _ in 0..HALVINGS {
                for j in 0..inner {
                    let part = self.start[j] + share * step_of(self, j);
                    self.slip[j] = if share == 1.0 { self.target[j] } else { part };
                }
                for (i, now) in self.rest.iter_mut().enumerate() {
                    *now = rest[i] + length_change(&self.slip, i);
                }
                self.pull(law, lengths);
                let behind: f64 = (0..inner).map(|j| slope(self, j, -step_of(self, j))).sum();
                if behind <= TURNS * before.abs() {
                    break;
                }
                share *= 0.5;
            }
        }
        false
    }

    /// By how much the logarithm of the tension rises over a node.
    fn rise(&self, j: usize) -> f64 {
        self.logarithms[j + 1].0 - self.logarithms[j].0
    }

    /// Direction in which a node slips, or is about to.
    fn slip_direction(&self, j: usize) -> Ordering {
        let (slip, rise, most) = (self.slip[j], self.rise(j), self.bounds[j]);
        match slip.partial_cmp(&0.0) {
            Some(STICKS) if rise > most => FORWARD,
            Some(STICKS) if rise < -most => BACKWARD,
            direction => direction.unwrap_or(STICKS),
        }
    }

    /// Slips at which the sum is least, with the logarithms straight in the reference lengths.
    ///
    /// In terms of the logarithms `y`: the least of `sum (y_i - c_i)^2 / (2 e_i)` where no rise exceeds its bound. What the segments up to one add to
    /// it as a function of that one's `y` has a slope of straight pieces, `a y + b` around its zero; over a node the pieces move apart by
    /// its bound, and flat ground opens at the zero.
    fn find_target(&mut self, rest: &[f64]) {
        let (inner, [left, right]) = (self.factors.len(), &mut self.knots);
        let centre = |i: usize| {
            let (y, falls) = self.logarithms[i];
            y + falls * (self.rest[i] - rest[i])
        };
        left.clear();
        right.clear();
        let (mut moved, mut a, mut b) = (0.0, 0.0, 0.0);
        for i in 0..=inner {
            let weight = 1.0 / self.logarithms[i].1;
            a += weight;
            b -= weight * centre(i);
            let mut zero = -b / a;
            if left.last().is_some_and(|(at, _)| zero < at - moved) {
                while let Some((at, change)) = left.pop_if(|(at, _)| zero < *at - moved) {
                    (a, b) = (a - change, b + change * (at - moved));
                    right.push((at - 2.0 * moved, change));
                    zero = (-b / a).min(at - moved);
                }
            } else {
                while let Some((at, change)) = right.pop_if(|(at, _)| zero > *at + moved) {
                    (a, b) = (a + change, b - change * (at + moved));
                    left.push((at + 2.0 * moved, change));
                    zero = (-b / a).max(at + moved);
                }
            }
            self.best[i] = zero;
            if i < inner {
                moved += self.bounds[i];
                left.push((zero - self.bounds[i] + moved, -a));
                right.push((zero + self.bounds[i] - moved, a));
                (a, b) = (0.0, 0.0);
            }
        }
        // Back from the last segment, whose `y` is known; where a bound holds, its node slips.
        for j in (0..inner).rev() {
            let (next, bound) = (self.best[j + 1], self.bounds[j]);
            self.contacts[j] = match self.best[j] {
                y if y <= next - bound => FORWARD,
                y if y >= next + bound => BACKWARD,
                _ => STICKS,
            };
            self.best[j] = self.best[j].clamp(next - bound, next + bound);
        }
        let mut given = 0.0;
        for j in 0..inner {
            given += (self.best[j] - centre(j)) / self.logarithms[j].1;
            let turns = given.partial_cmp(&0.0) != Some(self.contacts[j]);
            self.target[j] = if turns { 0.0 } else { given };
        }
    }

    fn begin(&mut self, rest: &[f64], factors: &[f64]) {
        let inner = factors.len();
        rest.clone_into(&mut self.rest);
        factors.clone_into(&mut self.factors);
        self.bounds.clear();
        self.bounds.extend(factors.iter().map(|factor| factor.ln()));
        self.contacts.clear();
        self.contacts.resize(inner, STICKS);
        self.slip.clear();
        self.slip.resize(inner, 0.0);
        self.start.resize(inner, 0.0);
        self.target.resize(inner, 0.0);
        self.best.resize(inner + 1, 0.0);
        self.system.iter_mut().for_each(|part| part.resize(inner, 0.0));
    }

    /// Tensions at the reference lengths at hand, and their logarithms.
    fn pull(&mut self, law: &RopeLaw, lengths: &[f64]) {
        let least = LOWEST * law.rigidity;
        self.tension.clear();
        self.tension.extend(lengths.iter().zip(&self.rest).map(|(l, rest)| law.tension(*l, *rest)));
        self.logarithms.clear();
        self.logarithms.extend(self.tension.iter().zip(lengths.iter().zip(&self.rest)).map(
            |(t, (l, rest))| {
                if t.force >= least {
                    return (t.force.ln(), -t.by_rest / t.force);
                }
                let (force, by_rest) = law.slack(*l, *rest);
                (least.ln() + force / least - 1.0, -by_rest / least)
            },
        ));
    }

    /// The system for the derivative of the slips; slip `s_j` takes from `L_j` and gives to `L_(j+1)`.
    fn set_up(&mut self) {
        let [below, diagonal, above, _] = &mut self.system;
        for j in 0..self.factors.len() {
            if self.contacts[j] == STICKS {
                (below[j], diagonal[j], above[j]) = (0.0, 1.0, 0.0);
                continue;
            }
            let (a, b) = (self.tension[j], self.tension[j + 1]);
            let (weight_a, weight_b) = weights(self.contacts[j], self.factors[j]);
            below[j] = weight_a * a.by_rest;
            diagonal[j] = weight_b * b.by_rest - weight_a * a.by_rest;
            above[j] = -weight_b * b.by_rest;
        }
    }

    /// Derivative of every tension: `by_length[i]` is that of `l_i` and `by_wrap[j]` that of `phi_j` with
    /// respect to one degree of freedom. `into[i]` becomes that of `N_i`.
    pub fn derivative(&mut self, friction: f64, by_length: &[f64], by_wrap: &[f64], into: &mut [f64]) {
        self.set_up();
        for ((n, t), l) in into.iter_mut().zip(&self.tension).zip(by_length) {
            *n = t.by_length * l;
        }
        let [below, diagonal, above, slip] = &mut self.system;
        for (j, slip) in slip.iter_mut().enumerate() {
            let (weight_a, weight_b) = weights(self.contacts[j], self.factors[j]);
            let grows = friction * self.factors[j] * by_wrap[j];
            *slip = match self.contacts[j] {
                STICKS => 0.0,
                BACKWARD => grows * self.tension[j + 1].force,
                FORWARD => grows * self.tension[j].force,
            };
            if self.contacts[j] != STICKS {
                *slip -= weight_b * into[j + 1] + weight_a * into[j];
            }
        }
        solve_tridiagonal(below, diagonal, above, slip);
        for (i, n) in into.iter_mut().enumerate() {
            *n += self.tension[i].by_rest * length_change(slip, i);
        }
    }
}

/// `g = w_a N_before + w_b N_behind` is 0 where a node slides.
fn weights(contact: Ordering, factor: f64) -> (f64, f64) {
    match contact {
        BACKWARD => (1.0, -factor),
        _ => (-factor, 1.0),
    }
}

/// Thomas' algorithm; `x` holds the right-hand side and then the solution.
fn solve_tridiagonal(below: &[f64], diagonal: &mut [f64], above: &[f64], x: &mut [f64]) {
    for j in 1..x.len() {
        let factor = below[j] / diagonal[j - 1];
        diagonal[j] -= factor * above[j - 1];
        x[j] -= factor * x[j - 1];
    }
    for j in (0..x.len()).rev() {
        let right = if j + 1 < x.len() { above[j] * x[j + 1] } else { 0.0 };
        x[j] = (x[j] - right) / diagonal[j];
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::element::tests::checks::random;

    const LAW: RopeLaw = RopeLaw { rigidity: 1e5, preload: 0.0, least: 0.0 };

    fn slide(lengths: &[f64], rest: &[f64], factors: &[f64]) -> Returned {
        let mut returned = Returned::default();
        returned.slide(&LAW, lengths, rest, factors);
        returned
    }

    #[test]
    fn tensions_lie_in_the_cone_and_the_sum_of_lengths_stays() {
        let mut noise = random(11);
        for friction in [0.02_f64, 0.1, 0.3, 1.0] {
            for segments in [2, 3, 10, 60] {
                let rest: Vec<f64> = (0..segments).map(|_| 1.0 + 0.5 * noise()).collect();
                let lengths: Vec<f64> = rest.iter().map(|r| r * (1.01 + 0.02 * noise())).collect();
                let factors: Vec<f64> = (1..segments).map(|_| (friction * (1.0 + noise())).exp()).collect();
                let end = slide(&lengths, &rest, &factors);
                let (a, b): (f64, f64) = (rest.iter().sum(), end.rest.iter().sum());
                assert!((a - b).abs() < 1e-13 * a);
                // Tensions are found to SETTLED of E A each.
                for (j, r) in factors.iter().enumerate() {
                    let (n, m) = (end.tension[j].force, end.tension[j + 1].force);
                    assert!(n <= r * m + 1e-9 && m <= r * n + 1e-9, "{n} {m} {r} mu {friction}, {segments}");
                    match end.contacts[j] {
                        FORWARD => assert!((m - r * n).abs() < 1e-9),
                        BACKWARD => assert!((n - r * m).abs() < 1e-9),
                        STICKS => {}
                    }
                }
                assert!(end.dissipated >= 0.0);
            }
        }
    }

    #[test]
    fn ropes_between_slack_and_taut_return_too() {
        let mut noise = random(5);
        let mut slack = 0;
        for round in 0..4000 {
            let friction = [0.02_f64, 0.1, 0.4, 1.0][round % 4];
            let segments = 2 + round % 31;
            let least = if round % 2 == 0 { 0.5 } else { 0.0 };
            let law = RopeLaw { preload: 10.0, least, ..LAW };
            let rest: Vec<f64> = (0..segments).map(|_| 1.0 + 0.8 * noise()).collect();
            // Mean strains around 0, single segments far from it.
            let spread = [1e-4, 1e-2, 0.3][round % 3];
            let lengths: Vec<f64> = rest.iter().map(|r| r * (1.0 + spread * noise())).collect();
            let factors: Vec<f64> = (1..segments).map(|_| (friction * (0.5 + noise())).exp()).collect();
            let mut end = Returned::default();
            end.slide(&law, &lengths, &rest, &factors);
            let (a, b): (f64, f64) = (rest.iter().sum(), end.rest.iter().sum());
            assert!((a - b).abs() < 1e-13 * a);
            slack += usize::from(end.tension.iter().all(|t| t.force <= 0.0));
            for (j, r) in factors.iter().enumerate() {
                let (n, m) = (end.tension[j].force.max(0.0), end.tension[j + 1].force.max(0.0));
                let slack = 2.0 * LOWEST * LAW.rigidity;
                assert!(
                    n <= r * m + slack && m <= r * n + slack,
                    "round {round}, node {j} of {segments}: {n} {m} {r}"
                );
            }
        }
        assert!(slack > 100 && slack < 3900, "{slack}");
    }

    #[test]
    fn a_segment_that_has_run_out_is_no_stiffer_than_one_of_the_least_length() {
        let law = RopeLaw { least: 0.1, ..LAW };
        let step = 1e-7;
        for rest in [0.3, 0.1 + 2.0 * step, 0.1 - 2.0 * step, 0.01, 0.0, -0.02] {
            let l = rest + 0.002;
            let slope = |f: &dyn Fn(f64) -> f64| (f(step) - f(-step)) / (2.0 * step);
            let now = law.tension(l, rest);
            assert!(now.by_length <= law.tension(0.102, 0.1).by_length * (1.0 + 1e-5), "{rest}: {now:?}");
            let by_length = slope(&|d| law.tension(l + d, rest).force);
            let by_rest = slope(&|d| law.tension(l, rest + d).force);
            // Stiffnesses of 1e6 N/m on forces of 2e3 N: rounding of stresses of E A to eps, over h; truncation below it.
            assert!((by_length - now.by_length).abs() < 10.0, "{rest}: {by_length} {now:?}");
            assert!((by_rest - now.by_rest).abs() < 10.0, "{rest}: {by_rest} {now:?}");
            let (force, release) =
                (slope(&|d| law.energy(l + d, rest)), -slope(&|d| law.energy(l, rest + d)));
            assert!((force - now.force).abs() < 1e-2, "{rest}: {force} {now:?}");
            assert!((release - law.release(l, rest)).abs() < 1e-2, "{rest}: {release}");
        }
        // A node drawn all the way to its neighbour: the cone still holds.
        let mut returned = Returned::default();
        returned.slide(&law, &[0.0001, 1.05], &[0.05, 1.0], &[1.1]);
        let [a, b] = [returned.tension[0].force, returned.tension[1].force];
        assert!(a > 0.0 && (b / a - 1.1).abs() < 1e-9, "{a} {b}");
        assert!((returned.rest.iter().sum::<f64>() - 1.05).abs() < 1e-14);
    }

    #[test]
    fn both_ends_are_alike() {
        let rest = [1.0, 1.2, 0.8, 1.1, 0.9];
        let lengths = [1.02, 1.2, 0.83, 1.1, 0.91];
        let factors = [1.1, 1.3, 1.2, 1.05];
        let reversed = |a: &[f64]| a.iter().rev().copied().collect::<Vec<_>>();
        let there = slide(&lengths, &rest, &factors);
        let back = slide(&reversed(&lengths), &reversed(&rest), &reversed(&factors));
        for (a, b) in there.rest.iter().zip(back.rest.iter().rev()) {
            assert!((a - b).abs() < 1e-14, "{a} {b}");
        }
        assert!((there.dissipated - back.dissipated).abs() < 1e-10);
    }

    #[test]
    fn a_slack_side_is_pulled_over_until_nothing_is_taut_or_it_carries_its_share() {
        // Long slack: all is slack in the end. Short slack: both taut, in the ratio of the capstan.
        let end = slide(&[1.01, 0.9], &[1.0, 1.0], &[1.2]);
        assert!(end.tension.iter().all(|t| t.force < 2.0 * LOWEST * LAW.rigidity), "{:?}", end.tension);
        let end = slide(&[1.05, 0.99], &[1.0, 1.0], &[1.2]);
        assert!((end.tension[0].force / end.tension[1].force - 1.2).abs() < 1e-9);
        assert!(end.tension[1].force > 0.0);
    }
}
