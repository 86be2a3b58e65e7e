//! All cables at once: forces and energy at given displacements, for the explicit step.
//!
//! The formulas are those of [`crate::element::Cable`]. Cables that follow each other and whose
//! first and second nodes do too form a *run*: its displacements are plain slices, so the loops have
//! neither indices nor bounds checks, and neither roots nor divisions. The rows of a generated net
//! are runs; a cable of an irregular structure is a run of its own, right but several times slower.
//! Sums are taken in one fixed order.

use crate::element::Cable;
use std::ops::Range;

/// Partial sums that are kept apart so that a loop can work on several cables at a time.
const LANES: usize = 4;

#[derive(Debug, Clone)]
struct Run {
    /// Its cables.
    cables: Range<usize>,
    /// First and second nodes of its first cable.
    nodes: [usize; 2],
    /// Least pull per length [N/m].
    floor: f64,
}

/// The cables of a structure, constants apart by kind.
#[derive(Debug, Clone)]
pub struct Kernel {
    node_count: usize,
    runs: Vec<Run>,
    /// `2 D` of each cable, by component [m].
    span2: [Vec<f64>; 3],
    /// `D . D` [m2].
    square: Vec<f64>,
    /// `q_0` [N/m].
    q0: Vec<f64>,
    /// `c` [N/m3].
    slope: Vec<f64>,
    /// `max(q_0, floor)` [N/m], from which the energy counts.
    base: Vec<f64>,
    /// `1 / (4 c)` [m3/N].
    inverse: Vec<f64>,
    /// Pulls of one run, by component.
    pull: [Vec<f64>; 3],
    /// Squared tension, or energy, of each cable of one run.
    scalar: Vec<f64>,
}

/// One run: the slices that its loops go over, all of one length.
struct Slices<'a> {
    first: [&'a [f64]; 3],
    second: [&'a [f64]; 3],
    span2: [&'a [f64]; 3],
    q0: &'a [f64],
    slope: &'a [f64],
}

impl Slices<'_> {
    /// Relative displacement, and `s` with `l^2 = D . D + s`, of cable number `k`.
    #[inline(always)]
    fn stretch(&self, k: usize) -> ([f64; 3], f64) {
        let w = [0, 1, 2].map(|c: usize| self.second[c][k] - self.first[c][k]);
        let s = w[0] * (self.span2[0][k] + w[0])
            + w[1] * (self.span2[1][k] + w[1])
            + w[2] * (self.span2[2][k] + w[2]);
        (w, s)
    }

    /// Pull per length of cable number `k`. Anything not a number stays so, and is found at the end.
    #[inline(always)]
    fn pull_per_length(&self, k: usize, s: f64, floor: f64) -> f64 {
        let q = self.q0[k] + self.slope[k] * s;
        if q < floor { floor } else { q }
    }
}

impl Kernel {
    /// The kernel of `cables` between `node_count` nodes.
    pub fn new(cables: &[Cable], node_count: usize) -> Self {
        let mut runs: Vec<Run> = Vec::new();
        for (i, cable) in cables.iter().enumerate() {
            match runs.last_mut() {
                Some(run)
                    if run.floor == cable.floor()
                        && cable.nodes[0] == run.nodes[0] + run.cables.len()
                        && cable.nodes[1] == run.nodes[1] + run.cables.len() =>
                {
                    run.cables.end += 1;
                }
                _ => runs.push(Run { cables: i..i + 1, nodes: cable.nodes, floor: cable.floor() }),
            }
        }
        let longest = runs.iter().map(|r| r.cables.len()).max().unwrap_or(0);
        let each = |f: &dyn Fn(&Cable) -> f64| cables.iter().map(f).collect::<Vec<_>>();
        Self {
            node_count,
            runs,
            span2: [0, 1, 2].map(|c: usize| each(&|cable| 2.0 * cable.span[c])),
            square: each(&|cable| cable.span.norm_squared()),
            q0: each(&Cable::initial_pull_per_length),
            slope: each(&Cable::slope),
            base: each(&|cable| cable.initial_pull_per_length().max(cable.floor())),
            inverse: each(&|cable| 1.0 / (4.0 * cable.slope())),
            pull: [0, 1, 2].map(|_| vec![0.0; longest]),
            scalar: vec![0.0; longest],
        }
    }

    /// Number of runs; the fewer, the faster.
    pub fn run_count(&self) -> usize {
        self.runs.len()
    }

    /// Add what the cables pull on their nodes (minus the internal force) to `force` [N], at the
    /// displacements `u` [m]; both component-major. Returns the largest tension, squared [N2].
    pub fn pull(&mut self, u: &[f64], force: &mut [f64]) -> f64 {
        let n = self.node_count;
        let mut largest = 0.0;
        for run in &self.runs {
            let slices = slices(u, n, run, &self.span2, &self.q0, &self.slope);
            let len = run.cables.len();
            let [px, py, pz] = self.pull.each_mut().map(|p| &mut p[..len]);
            let squares = &mut self.scalar[..len];
            pulls(&slices, run.floor, &self.square[run.cables.clone()], [&mut *px, py, pz], squares);
            for (c, p) in [px, py, pz].into_iter().enumerate() {
                let component = &mut force[c * n..(c + 1) * n];
                add(&mut component[run.nodes[0]..][..len], p);
                subtract(&mut component[run.nodes[1]..][..len], p);
            }
            largest = largest_of(squares, largest);
        }
        largest
    }

    /// Stored energy [J] at the displacements `u` [m]; 0 as modelled.
    pub fn energy(&mut self, u: &[f64]) -> f64 {
        let n = self.node_count;
        let mut sum = 0.0;
        for run in &self.runs {
            let slices = slices(u, n, run, &self.span2, &self.q0, &self.slope);
            let energies = &mut self.scalar[..run.cables.len()];
            let (base, inverse) = (&self.base[run.cables.clone()], &self.inverse[run.cables.clone()]);
            store_energies(&slices, run.floor, base, inverse, energies);
            sum += sum_of(energies);
        }
        sum
    }
}

/// The slices of `run`.
fn slices<'a>(
    u: &'a [f64],
    n: usize,
    run: &Run,
    span2: &'a [Vec<f64>; 3],
    q0: &'a [f64],
    slope: &'a [f64],
) -> Slices<'a> {
    let len = run.cables.len();
    let nodes = |first: usize| [0, 1, 2].map(|c: usize| &u[c * n + first..][..len]);
    Slices {
        first: nodes(run.nodes[0]),
        second: nodes(run.nodes[1]),
        span2: [0, 1, 2].map(|c: usize| &span2[c][run.cables.clone()]),
        q0: &q0[run.cables.clone()],
        slope: &slope[run.cables.clone()],
    }
}

/// Pulls and squared tensions of one run. A function of its own, so that the compiler knows that
/// what is written overlaps nothing that is read.
#[inline(never)]
fn pulls(run: &Slices, floor: f64, square: &[f64], pull: [&mut [f64]; 3], squared_tension: &mut [f64]) {
    let len = square.len();
    let [px, py, pz] = pull;
    let (px, py, pz, squared) = (&mut px[..len], &mut py[..len], &mut pz[..len], &mut squared_tension[..len]);
    let run = run.cut(len);
    for k in 0..len {
        let (w, s) = run.stretch(k);
        let q = run.pull_per_length(k, s, floor);
        px[k] = q * (0.5 * run.span2[0][k] + w[0]);
        py[k] = q * (0.5 * run.span2[1][k] + w[1]);
        pz[k] = q * (0.5 * run.span2[2][k] + w[2]);
        squared[k] = q * q * (square[k] + s);
    }
}

/// Energies of the cables of one run.
#[inline(never)]
fn store_energies(run: &Slices, floor: f64, base: &[f64], inverse: &[f64], energies: &mut [f64]) {
    let len = energies.len();
    let (base, inverse) = (&base[..len], &inverse[..len]);
    let run = run.cut(len);
    for k in 0..len {
        let (_, s) = run.stretch(k);
        let q = run.pull_per_length(k, s, floor);
        energies[k] = (q - base[k]) * (q + base[k]) * inverse[k];
    }
}

impl<'a> Slices<'a> {
    /// The same, with all lengths equal to `len` in the compiler's sight.
    #[inline(always)]
    fn cut(&self, len: usize) -> Slices<'a> {
        Slices {
            first: self.first.map(|s| &s[..len]),
            second: self.second.map(|s| &s[..len]),
            span2: self.span2.map(|s| &s[..len]),
            q0: &self.q0[..len],
            slope: &self.slope[..len],
        }
    }
}

fn add(to: &mut [f64], what: &[f64]) {
    to.iter_mut().zip(what).for_each(|(t, w)| *t += w);
}

fn subtract(from: &mut [f64], what: &[f64]) {
    from.iter_mut().zip(what).for_each(|(f, w)| *f -= w);
}

/// Sum, in [`LANES`] parts that are added at the end.
pub fn sum_of(values: &[f64]) -> f64 {
    let (chunks, rest) = values.as_chunks::<LANES>();
    let mut lanes = [0.0; LANES];
    for chunk in chunks {
        for (lane, value) in lanes.iter_mut().zip(chunk) {
            *lane += value;
        }
    }
    lanes.iter().sum::<f64>() + rest.iter().sum::<f64>()
}

/// Largest of `values` and `at_least`.
fn largest_of(values: &[f64], at_least: f64) -> f64 {
    let (chunks, rest) = values.as_chunks::<LANES>();
    let mut lanes = [at_least; LANES];
    for chunk in chunks {
        for (lane, value) in lanes.iter_mut().zip(chunk) {
            *lane = if *value > *lane { *value } else { *lane };
        }
    }
    lanes.iter().chain(rest).fold(at_least, |a, b| if *b > a { *b } else { a })
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;

    /// A net with bars and cables, slack and taut, displaced at random.
    fn case() -> (Vec<Cable>, usize, Vec<f64>) {
        let mut seed = 7_u64;
        let mut random = move || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 33) as f64 / (1_u64 << 31) as f64 - 0.5
        };
        let side = 7;
        let position = |n: usize| Vector3::new((n % side) as f64, (n / side) as f64, 0.0);
        let mut cables = Vec::new();
        for j in 0..side {
            for (count, step) in [(side - 1, 1), (if j + 1 < side { side } else { 0 }, side)] {
                for i in 0..count {
                    let nodes = [j * side + i, j * side + i + step];
                    cables.push(Cable {
                        nodes,
                        span: position(nodes[1]) - position(nodes[0]),
                        length: 1.0 + 0.1 * random(),
                        young: 2e7,
                        area: 1e-3,
                        density: 1.0,
                        prestress: 1e6 * random(),
                        tension_only: j % 2 == 0,
                        radius: 0.0,
                    });
                }
            }
        }
        let n = side * side;
        let u = (0..3 * n).map(|_| 0.2 * random()).collect();
        (cables, n, u)
    }

    #[test]
    fn it_answers_as_the_elements_do_one_by_one() {
        let (cables, n, u) = case();
        let mut kernel = Kernel::new(&cables, n);
        assert!(kernel.run_count() < cables.len() / 4);
        let mut force = vec![0.0; 3 * n];
        let largest = kernel.pull(&u, &mut force).sqrt();
        let (mut expected, mut energy, mut tension) = (vec![0.0; 3 * n], 0.0, 0.0_f64);
        for cable in &cables {
            let at = |node: usize| Vector3::new(u[node], u[n + node], u[2 * n + node]);
            let answer = cable.response(&(at(cable.nodes[1]) - at(cable.nodes[0])));
            energy += answer.energy;
            tension = tension.max(answer.tension);
            for c in 0..3 {
                expected[c * n + cable.nodes[0]] += answer.pull[c];
                expected[c * n + cable.nodes[1]] -= answer.pull[c];
            }
        }
        // Both evaluate q = q0 + c s, whose terms are of the size of E A / L: some eps of that.
        let rounding = 32.0 * f64::EPSILON * 2e7 * 1e-3;
        for (f, e) in force.iter().zip(&expected) {
            assert!((f - e).abs() < rounding, "{f} is not {e}");
        }
        assert!((largest - tension).abs() < rounding);
        assert!((kernel.energy(&u) - energy).abs() < rounding * cables.len() as f64);
    }

    #[test]
    fn what_is_not_a_number_is_not_swallowed() {
        let (cables, n, mut u) = case();
        u[3] = f64::NAN;
        assert!(Kernel::new(&cables, n).energy(&u).is_nan());
    }

    #[test]
    fn sums_and_maxima_take_every_value() {
        let values: Vec<f64> = (1..=11).map(f64::from).collect();
        assert_eq!(sum_of(&values), 66.0);
        assert_eq!(largest_of(&values, 3.0), 11.0);
        assert_eq!(largest_of(&values[..2], 3.0), 3.0);
    }
}
