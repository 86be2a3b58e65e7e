//! Friction of a rope over the nodes that it slides on: the return mapping, all nodes at once.
//!
//! Each segment has a reference length `L_i` of its own; their sum is that of the rope. At a node
//! with the wrap angle `phi`, `r = exp(mu phi)`, the tensions must satisfy
//!
//! ```text
//! N_i <= r N_(i-1)   and   N_(i-1) <= r N_i
//! ```
//!
//! Where they do not, reference length passes to the side of higher tension until they just do: the slips
//! of all nodes solve one tridiagonal system (semi-smooth Newton with an active set), so that the result does
//! not depend on the end where one starts, and a long rope needs no more iterations than a short one.
//! Handbook 2.2.

use nalgebra::Vector3;
use std::cmp::Ordering;
use std::sync::Once;

/// Most iterations at a time.
const MOST: usize = 25;
/// Times that they are begun anew after [`SWEEPS`] over all nodes, at most.
const ROUNDS: usize = 30;
/// Sweeps over all nodes, there and back, one node at a time.
const SWEEPS: usize = 4;
/// Relative error of a slip in a sweep.
const CLOSE: f64 = 1e-3;
/// Change of tension, relative to the stiffness of the rope, below which a node has returned.
const SETTLED: f64 = 1e-14;
/// A slack segment shows this part of its stiffness, so that length still finds its way through it.
const SLACK: f64 = 1e-9;

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

    /// Stored energy [J], counted from where the stress is 0.
    pub fn energy(&self, l: f64, rest: f64) -> f64 {
        let (l, rest) = self.padded(l, rest);
        let stress = self.stress(l, rest).max(0.0);
        rest * stress * stress / (2.0 * self.rigidity)
    }

    /// What a unit of reference length carries in energy as it leaves the segment, `-dW/dL` at constant length [N].
    pub fn release(&self, l: f64, rest: f64) -> f64 {
        if rest < self.least {
            return self.tension(l, rest).force.max(0.0);
        }
        let stress = self.stress(l, rest).max(0.0);
        stress * (l / rest).powi(2) - stress * stress / (2.0 * self.rigidity)
    }
}

/// What a node does, by the sign of its slip: length passes into the segment behind it.
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
    slip: Vec<f64>,
    /// Slips after the last sweeps.
    swept: Vec<f64>,
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

/// What passes into segment `i` by the `slip` of the nodes at its ends.
fn gained(slip: &[f64], i: usize) -> f64 {
    let before = if i > 0 { slip[i - 1] } else { 0.0 };
    before - slip.get(i).copied().unwrap_or(0.0)
}

impl Returned {
    /// Let a rope with segments of `lengths` and the committed reference lengths `rest` slip over its inner
    /// nodes, where `factors` are `exp(mu phi)`.
    pub fn slide(&mut self, law: &RopeLaw, lengths: &[f64], rest: &[f64], factors: &[f64]) {
        let inner = factors.len();
        self.begin(rest, factors);
        self.pull(law, lengths);
        let mut settled = self.iterate(law, lengths, rest);
        if !settled {
            self.slip.fill(0.0);
            self.rest.copy_from_slice(rest);
        }
        for _ in 0..ROUNDS {
            if settled {
                break;
            }
            // Where segments go slack and taut the iteration can walk in circles; one node at a time cannot.
            for _ in 0..SWEEPS {
                (0..inner).chain((0..inner).rev()).for_each(|j| self.return_one(law, lengths, j));
            }
            self.pull(law, lengths);
            for (contact, slip) in self.contacts.iter_mut().zip(&self.slip) {
                *contact = slip.partial_cmp(&0.0).unwrap_or(STICKS);
            }
            self.swept.copy_from_slice(&self.slip);
            settled = self.iterate(law, lengths, rest);
            if !settled {
                // On from where the sweeps had come.
                self.slip.copy_from_slice(&self.swept);
                for (i, now) in self.rest.iter_mut().enumerate() {
                    *now = rest[i] + gained(&self.slip, i);
                }
            }
        }
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

    /// The semi-smooth iteration from the slips and contacts at hand; whether it settled.
    fn iterate(&mut self, law: &RopeLaw, lengths: &[f64], rest: &[f64]) -> bool {
        let (inner, total, scale) = (self.factors.len(), rest.iter().sum::<f64>(), law.rigidity);
        for _ in 0..MOST {
            let changed = self.choose(scale);
            self.set_up();
            let left = (0..inner).map(|j| match self.contacts[j] {
                STICKS => self.slip[j].abs() / total,
                _ => self.system[3][j].abs() / scale,
            });
            if !changed && left.fold(0.0, f64::max) <= SETTLED {
                return true;
            }
            let [below, diagonal, above, step] = &mut self.system;
            solve_tridiagonal(below, diagonal, above, step);
            // No segment may lose more than half of what it counts as at once.
            let share = self.rest.iter().enumerate().map(|(i, rest)| {
                let change = gained(step, i);
                let most = -0.5 * rest.max(law.least);
                if change < most { most / change } else { 1.0 }
            });
            let share = share.fold(1.0, f64::min);
            self.slip.iter_mut().zip(step).for_each(|(s, d)| *s += share * *d);
            for (i, now) in self.rest.iter_mut().enumerate() {
                *now = rest[i] + gained(&self.slip, i);
            }
            self.pull(law, lengths);
        }
        false
    }

    /// Let node `j` alone slip to where friction holds the rope there; the slips of the others stay.
    fn return_one(&mut self, law: &RopeLaw, lengths: &[f64], j: usize) {
        let now = self.slip[j];
        let (before, behind) = (self.rest[j] + now, self.rest[j + 1] - now);
        // How far tension exceeds what friction holds towards the segment behind (`sign` 1) or before, at the slip
        // `sign * s`; decreases with `s`.
        let excess = |sign: f64, s: f64| {
            let a = softened(law, lengths[j], before - sign * s).force;
            let b = softened(law, lengths[j + 1], behind + sign * s).force;
            if sign > 0.0 { (b - self.factors[j] * a, b) } else { (a - self.factors[j] * b, a) }
        };
        let pulled = [1.0, -1.0].into_iter().find(|sign| {
            let (excess, pull) = excess(*sign, 0.0);
            excess > 0.0 && pull > 0.0
        });
        let Some(sign) = pulled else {
            self.put(j, 0.0, before, behind);
            return;
        };
        // A segment without a least length keeps some.
        let room = if law.least > 0.0 {
            f64::INFINITY
        } else if sign > 0.0 {
            before
        } else {
            behind
        };
        let (mut low, mut high) = (0.0, now.abs().max(1e-9 * (before + behind)).min(0.5 * room));
        while excess(sign, high).0 > 0.0 && high - low > f64::EPSILON * high {
            low = high;
            high = (4.0 * high).min(0.5 * (high + room));
        }
        // The iteration makes it exact.
        while high - low > CLOSE * high {
            let middle = 0.5 * (low + high);
            if excess(sign, middle).0 > 0.0 {
                low = middle;
            } else {
                high = middle;
            }
        }
        self.put(j, sign * high, before, behind);
    }

    /// Node `j` has slipped by `slip`, the segments beside it `before` and `behind` long without that.
    fn put(&mut self, j: usize, slip: f64, before: f64, behind: f64) {
        self.slip[j] = slip;
        (self.rest[j], self.rest[j + 1]) = (before - slip, behind + slip);
    }

    fn begin(&mut self, rest: &[f64], factors: &[f64]) {
        let inner = factors.len();
        rest.clone_into(&mut self.rest);
        factors.clone_into(&mut self.factors);
        self.contacts.clear();
        self.contacts.resize(inner, STICKS);
        self.slip.clear();
        self.slip.resize(inner, 0.0);
        self.swept.resize(inner, 0.0);
        self.system.iter_mut().for_each(|part| part.resize(inner, 0.0));
    }

    fn pull(&mut self, law: &RopeLaw, lengths: &[f64]) {
        self.tension.clear();
        self.tension.extend(lengths.iter().zip(&self.rest).map(|(l, rest)| softened(law, *l, *rest)));
    }

    /// What each node does next; returns whether any changes its mind.
    fn choose(&mut self, scale: f64) -> bool {
        let mut changed = false;
        for (j, contact) in self.contacts.iter_mut().enumerate() {
            let (before, behind, r) = (self.tension[j].force, self.tension[j + 1].force, self.factors[j]);
            let least = SETTLED * scale;
            let next = match *contact {
                STICKS if behind > r * before + least && behind > 0.0 => FORWARD,
                STICKS if before > r * behind + least && before > 0.0 => BACKWARD,
                FORWARD if self.slip[j] < 0.0 => STICKS,
                BACKWARD if self.slip[j] > 0.0 => STICKS,
                same => same,
            };
            changed |= next != *contact;
            *contact = next;
        }
        changed
    }

    /// The system for the next step of the slips; slip `s_j` takes from `L_j` and gives to `L_(j+1)`.
    fn set_up(&mut self) {
        let [below, diagonal, above, residual] = &mut self.system;
        for j in 0..self.factors.len() {
            if self.contacts[j] == STICKS {
                (below[j], diagonal[j], above[j], residual[j]) = (0.0, 1.0, 0.0, -self.slip[j]);
                continue;
            }
            let (a, b) = (self.tension[j], self.tension[j + 1]);
            let (weight_a, weight_b) = weights(self.contacts[j], self.factors[j]);
            residual[j] = -(weight_b * b.force + weight_a * a.force);
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
            *n += self.tension[i].by_rest * gained(slip, i);
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
                assert!(
                    n <= r * m + 1e-8 && m <= r * n + 1e-8,
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
        assert!(end.tension.iter().all(|t| t.force < 1e-6), "{:?}", end.tension);
        let end = slide(&[1.05, 0.99], &[1.0, 1.0], &[1.2]);
        assert!((end.tension[0].force / end.tension[1].force - 1.2).abs() < 1e-9);
        assert!(end.tension[1].force > 0.0);
    }
}
