//! All cables at once: forces and energy at given displacements, for the explicit step.
//!
//! The formulas are those of [`crate::element::Cable`]. Cables whose nodes follow each other form a
//! *run*: first nodes `a, a + 1, ...`, second nodes `b, b + 1, ...`. Its displacements are plain slices,
//! so the loops have neither indices nor bounds checks, and neither roots nor divisions. Small gaps
//! are filled with cables that carry nothing: a generated net is a handful of runs. Where runs are short, as in an
//! irregular structure, `scattered` pulls instead. Sums are taken in one fixed order.
//!
//! Runs are sorted into *tiles* of nodes that follow each other, by their first nodes: when the tiles up to one are done,
//! nothing pulls on its nodes any more, and a step can go on with them while they are in the nearest cache.

mod pull;
pub mod rings;
mod scattered;

use self::pull::{CableConstants, Pull, WIDEST};
use self::scattered::Scattered;
use crate::element::Cable;
use crate::linear_algebra::lanes::{add_to, subtract_from, sum_of, wide};
use std::ops::Range;
use toolkit::simd;

/// Nodes of a tile.
const TILE: usize = 256;
/// Cables without effect that are put in a row to join two runs; one more run costs as much as some ten.
const LARGEST_GAP: usize = 8;
/// Runs with fewer cables than this on average are left to [`Scattered`]; with ten to fourteen they were a quarter faster.
const SHORT: usize = 8;
/// Below that many cables nothing is gained.
const FEWEST_SCATTERED: usize = 64;

#[derive(Debug, Clone)]
struct Run {
    /// Its cables, in the order of the kernel.
    cables: Range<usize>,
    /// First and second nodes of its first cable.
    nodes: [usize; 2],
    /// Least pull per length [N/m].
    floor: f64,
    /// Whether all of its cables have the same constants.
    alike: bool,
}

/// Nodes that follow each other.
#[derive(Debug, Clone)]
struct Tile {
    nodes: Range<usize>,
    /// Runs of the cables whose lower nodes are here.
    runs: Range<usize>,
    /// End of the nodes that the runs up to here pull on, and no less than its own.
    reach: usize,
}

/// The cables of a structure, constants apart by kind.
#[derive(Debug, Clone, Default)]
pub struct Kernel {
    node_count: usize,
    tiles: Vec<Tile>,
    runs: Vec<Run>,
    /// Of each cable `2 D` by component [m], `D . D` [m2], `q_0` [N/m], `c` [N/m3].
    constants: [Vec<f64>; 6],
    /// `max(q_0, floor)` [N/m], from which the energy counts, and `1 / (4 c)` [m3/N].
    stored: [Vec<f64>; 2],
    /// Pulls of one run, by component.
    pull: [Vec<f64>; 3],
    /// Energy of each cable of one run.
    scalar: Vec<f64>,
    /// The same cables in another order, where runs are short.
    scattered: Option<Scattered>,
}

/// One run: the slices that its loops go over, all of one length.
///
/// Written out component by component: closures over components keep the compiler from working on
/// several cables at a time (measured for 1 300 cables: 34 us in place of 10 us, and 5.5 us with AVX2).
struct Slices<'a> {
    /// Displacements of the first nodes.
    first: [&'a [f64]; 3],
    /// Displacements of the second nodes.
    second: [&'a [f64]; 3],
    constants: CableConstants<'a>,
}

impl Kernel {
    /// The kernel of `cables` between `node_count` nodes.
    pub fn new(cables: &[Cable], node_count: usize) -> Self {
        let mut kernel = Self { node_count, ..Self::default() };
        let mut order: Vec<usize> = (0..cables.len()).collect();
        let ends = |cable: &Cable| {
            let [a, b] = cable.nodes;
            (a.min(b), a.max(b))
        };
        order.sort_by_key(|i| {
            let (a, b) = ends(&cables[*i]);
            (a / TILE, cables[*i].of.tension_only, b - a, a, *i)
        });
        let mut rest = &order[..];
        let mut reach = 0;
        for start in (0..node_count).step_by(TILE) {
            let nodes = start..(start + TILE).min(node_count);
            let (own, others) = rest.split_at(rest.partition_point(|i| ends(&cables[*i]).0 < nodes.end));
            rest = others;
            let first = kernel.runs.len();
            for cable in own.iter().map(|i| &cables[*i]) {
                kernel.append(cable, ends(cable), first);
                reach = reach.max(ends(cable).1 + 1);
            }
            reach = reach.max(nodes.end);
            kernel.tiles.push(Tile { nodes, runs: first..kernel.runs.len(), reach });
        }
        let longest = kernel.runs.iter().map(|r| r.cables.len()).max().unwrap_or(0);
        // Room for what the widest registers write beyond the end of a run.
        kernel.pull = [0, 1, 2].map(|_| vec![0.0; longest + WIDEST]);
        for constants in &mut kernel.constants {
            constants.resize(constants.len() + WIDEST, 0.0);
        }
        kernel.scalar = vec![0.0; longest];
        for run in &mut kernel.runs {
            let same = |of: &Vec<f64>| of[run.cables.clone()].windows(2).all(|two| two[0] == two[1]);
            run.alike = kernel.constants.iter().all(same);
        }
        if cables.len() >= FEWEST_SCATTERED && kernel.runs.len() * SHORT > cables.len() {
            kernel.scattered = Some(Scattered::new(cables, node_count));
            kernel.tiles = vec![Tile { nodes: 0..node_count, runs: 0..0, reach: node_count }];
        }
        kernel
    }

    /// Append a cable with these ends to the last run, if that is not before number `first` and it fits, or as a run of its own.
    fn append(&mut self, cable: &Cable, (a, b): (usize, usize), first: usize) {
        let joins = self.runs[first..].last().and_then(|run| {
            let gap = a.checked_sub(run.nodes[0] + run.cables.len())?;
            let fits = run.nodes[1] + run.cables.len() + gap == b && run.floor == cable.floor();
            (fits && gap <= LARGEST_GAP).then_some(gap)
        });
        match joins {
            Some(gap) => (0..gap).for_each(|_| self.push([0.0; 6], [0.0; 2])),
            None => {
                let next = self.stored[0].len();
                self.runs.push(Run { cables: next..next, nodes: [a, b], floor: cable.floor(), alike: false });
            }
        }
        let forward = if cable.nodes[0] < cable.nodes[1] { 2.0 } else { -2.0 };
        let [x, y, z]: [f64; 3] = (forward * cable.span).into();
        let (q0, slope) = (cable.initial_pull_per_length(), cable.slope());
        let stored = [q0.max(cable.floor()), 1.0 / (4.0 * slope)];
        self.push([x, y, z, cable.span.norm_squared(), q0, slope], stored);
    }

    /// Append a cable with these constants to the last run; one of zeros pulls on nothing and stores nothing.
    fn push(&mut self, constants: [f64; 6], stored: [f64; 2]) {
        let to = self.constants.iter_mut().chain(&mut self.stored);
        to.zip(constants.into_iter().chain(stored)).for_each(|(to, number)| to.push(number));
        if let Some(run) = self.runs.last_mut() {
            run.cables.end += 1;
        }
    }

    /// Number of runs; the fewer, the faster.
    pub fn run_count(&self) -> usize {
        self.runs.len()
    }

    /// Number of tiles.
    pub fn tile_count(&self) -> usize {
        self.tiles.len()
    }

    /// Nodes of a tile, and the end of those that the tiles up to it pull on.
    pub fn tile(&self, tile: usize) -> (Range<usize>, usize) {
        (self.tiles[tile].nodes.clone(), self.tiles[tile].reach)
    }

    /// Add what the cables pull on their nodes (minus the internal force) to `force` [N], at the
    /// displacements `u` [m]; both component-major. Returns the largest tension, squared [N2].
    pub fn pull(&mut self, u: &[f64], force: &mut [f64]) -> f64 {
        (0..self.tiles.len()).fold(0.0, |largest, tile| f64::max(largest, self.pull_tile(tile, u, force)))
    }

    /// The same for the cables whose lower nodes are in one tile.
    pub fn pull_tile(&mut self, tile: usize, u: &[f64], force: &mut [f64]) -> f64 {
        if let Some(scattered) = &mut self.scattered {
            return scattered.pull(u, force);
        }
        let runs = &self.runs[self.tiles[tile].runs.clone()];
        let constants = self.constants.each_ref().map(|of| &of[..]);
        let (nodes, spare) = (self.node_count, &mut self.pull);
        simd::arch().dispatch(Pull { runs, constants, u, force, nodes, spare })
    }

    /// Add the pull of the cables over a step from `before` to `after` to `force`: the mean stress
    /// between the two in the geometry of the middle.
    ///
    /// With `q` the mean of the pull per length over the change of `l^2`, `q d_m . (w_1 - w_0)` is exactly the
    /// change of stored energy, slack or not: an implicit midpoint step then keeps the energy to
    /// the tolerance of its solution. Source: Simo and Tarnow (1992), ZAMP 43, 757; Gonzalez (2000),
    /// CMAME 190, 1763. Returns the largest tension, squared [N2].
    pub fn pull_between(&mut self, before: &[f64], after: &[f64], force: &mut [f64]) -> f64 {
        let n = self.node_count;
        let mut largest = 0.0;
        for run in &self.runs {
            let start = slices(before, n, run, &self.constants);
            let end = slices(after, n, run, &self.constants);
            let len = run.cables.len();
            for k in 0..len {
                let (w0, s0, q0) = start.stretch(k);
                let (w1, s1, q1) = end.stretch(k);
                let q = mean_above(q0, q1, run.floor);
                let middle = [0, 1, 2].map(|c: usize| 0.5 * (start.constants[c][k] + w0[c] + w1[c]));
                let turn: f64 = (0..3).map(|c| (w1[c] - w0[c]) * (w1[c] - w0[c])).sum();
                for (pull, middle) in self.pull.iter_mut().zip(middle) {
                    pull[k] = q * middle;
                }
                let square = start.constants[3][k] + 0.5 * (s0 + s1) - 0.25 * turn;
                largest = f64::max(largest, q * q * square);
            }
            for (c, p) in self.pull.iter().enumerate() {
                let component = &mut force[c * n..(c + 1) * n];
                add_to(&mut component[run.nodes[0]..][..len], &p[..len]);
                subtract_from(&mut component[run.nodes[1]..][..len], &p[..len]);
            }
        }
        largest
    }

    /// Stored energy [J] at the displacements `u` [m]; 0 as modelled.
    pub fn energy(&mut self, u: &[f64]) -> f64 {
        if let Some(scattered) = &mut self.scattered {
            return scattered.energy(u);
        }
        let n = self.node_count;
        let mut sum = 0.0;
        for run in &self.runs {
            let slices = slices(u, n, run, &self.constants);
            let energies = &mut self.scalar[..run.cables.len()];
            let [base, inverse] = self.stored.each_ref().map(|of| &of[run.cables.clone()]);
            store_energies(&slices, run.floor, base, inverse, energies);
            sum += sum_of(energies);
        }
        sum
    }
}

impl Slices<'_> {
    /// Relative displacement, `s` with `l^2 = D . D + s`, and pull per length before any cut-off.
    fn stretch(&self, k: usize) -> ([f64; 3], f64, f64) {
        let w = [0, 1, 2].map(|c: usize| self.second[c][k] - self.first[c][k]);
        let s = (0..3).map(|c| w[c] * (self.constants[c][k] + w[c])).sum::<f64>();
        (w, s, self.constants[4][k] + self.constants[5][k] * s)
    }
}

/// Mean of `max(q, floor)` over a straight way from `a` to `b`.
fn mean_above(a: f64, b: f64, floor: f64) -> f64 {
    if a >= floor && b >= floor {
        return 0.5 * (a + b);
    }
    let (low, high) = (a.min(b), a.max(b));
    if high <= floor {
        return floor;
    }
    // Only the part above the floor counts; where both lie there the branch above is exact.
    floor + 0.5 * (high - floor) * ((high - floor) / (high - low))
}

/// The slices of `run`.
fn slices<'a>(u: &'a [f64], n: usize, run: &Run, constants: &'a [Vec<f64>; 6]) -> Slices<'a> {
    let len = run.cables.len();
    let nodes = |first: usize| [0, 1, 2].map(|c: usize| &u[c * n + first..][..len]);
    let constants = constants.each_ref().map(|of| &of[run.cables.clone()]);
    Slices { first: nodes(run.nodes[0]), second: nodes(run.nodes[1]), constants }
}

wide! {
    /// Energies of the cables of one run.
    fn store_energies(run: &Slices, floor: f64, base: &[f64], inverse: &[f64], energies: &mut [f64]) {
        let len = energies.len();
        let ([x1, y1, z1], [x2, y2, z2]) = (run.first.map(|of| &of[..len]), run.second.map(|of| &of[..len]));
        let [sx, sy, sz, _, q0, slope] = run.constants.map(|of| &of[..len]);
        let (base, inverse) = (&base[..len], &inverse[..len]);
        for k in 0..len {
            let (wx, wy, wz) = (x2[k] - x1[k], y2[k] - y1[k], z2[k] - z1[k]);
            let s = wx * (sx[k] + wx) + wy * (sy[k] + wy) + wz * (sz[k] + wz);
            let elastic = q0[k] + slope[k] * s;
            let q = if elastic < floor { floor } else { elastic };
            energies[k] = (q - base[k]) * (q + base[k]) * inverse[k];
        }
    }
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
                    let mut nodes = [j * side + i, j * side + i + step];
                    if i % 3 == 0 {
                        nodes.reverse();
                    }
                    cables.push(Cable {
                        nodes,
                        span: position(nodes[1]) - position(nodes[0]),
                        length: 1.0 + 0.1 * random(),
                        of: crate::element::cable::CableConfig {
                            young: 2e7,
                            area: 1e-3,
                            density: 1.0,
                            prestress: 1e6 * random(),
                            tension_only: j < 3,
                            radius: 0.0,
                        },
                    });
                }
            }
        }
        let n = side * side;
        let u = (0..3 * n).map(|_| 0.2 * random()).collect();
        (cables, n, u)
    }

    /// Chains that end at the last node, where the last register does not reach over the end: a node takes its forces in one order.
    #[test]
    fn every_code_path_gives_the_same_bytes() {
        let (_, n, u) = case();
        let of = crate::element::cable::CableConfig {
            young: 2e7,
            area: 1e-3,
            density: 1.0,
            prestress: 1e6,
            tension_only: false,
            radius: 0.0,
        };
        for first in 0..30 {
            let cable = |a: usize| Cable {
                nodes: [a, a + 1],
                span: Vector3::new(1.0, 0.1, 0.3),
                length: 1.1,
                of: of.clone(),
            };
            let mut kernel = Kernel::new(&(first..n - 1).map(cable).collect::<Vec<_>>(), n);
            let mut pulled = |arch: pulp::Arch| {
                let mut force: Vec<f64> = u.iter().map(|u| 1e3 * u.sin()).collect();
                let constants = kernel.constants.each_ref().map(|of| &of[..]);
                let (runs, spare) = (&kernel.runs[..], &mut kernel.pull);
                arch.dispatch(Pull { runs, constants, u: &u, force: &mut force, nodes: n, spare });
                force.into_iter().map(f64::to_bits).collect::<Vec<_>>()
            };
            let portable = pulled(pulp::Arch::Scalar);
            for arch in simd::PATHS.iter().filter_map(|(path, _)| path.arch()) {
                assert_eq!(pulled(arch), portable, "{arch:?}, {} cables", n - 1 - first);
            }
        }
    }

    #[test]
    fn it_answers_as_the_elements_do_one_by_one() {
        let (cables, n, u) = case();
        let mut kernel = Kernel::new(&cables, n);
        assert!(kernel.run_count() <= 4, "two directions, cables and bars: {}", kernel.run_count());
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
    fn the_pull_over_a_step_does_exactly_the_work_that_is_stored() {
        let (cables, n, u) = case();
        let mut kernel = Kernel::new(&cables, n);
        let later: Vec<f64> = u.iter().enumerate().map(|(i, u)| u + 0.1 * (i as f64).sin()).collect();
        let mut force = vec![0.0; 3 * n];
        kernel.pull_between(&u, &later, &mut force);
        let work: f64 = force.iter().zip(&u).zip(&later).map(|((f, u0), u1)| f * (u1 - u0)).sum();
        let stored = kernel.energy(&later) - kernel.energy(&u);
        // Sums of energies of the size of E A L: rounding of each.
        let rounding = 32.0 * f64::EPSILON * 2e7 * 1e-3 * cables.len() as f64;
        assert!((work + stored).abs() < rounding, "{work} {stored}");
        assert!(stored.abs() > 1e6 * rounding);
        // Without a change it is the pull there.
        let mut still = vec![0.0; 3 * n];
        kernel.pull_between(&u, &u, &mut still);
        let mut there = vec![0.0; 3 * n];
        kernel.pull(&u, &mut there);
        assert!(still.iter().zip(&there).all(|(a, b)| (a - b).abs() < rounding));
    }

    #[test]
    fn cables_without_order_are_pulled_as_those_in_rows_are() {
        let (mut cables, n, u) = case();
        // Each node gets another number, without a pattern.
        let mut numbers: Vec<usize> = (0..n).collect();
        let mut noise = crate::element::tests::checks::random(5);
        (1..n).rev().for_each(|i| numbers.swap(i, ((noise() + 0.5) * (i + 1) as f64) as usize));
        let to = |i: usize| numbers[i];
        let mut rows = Kernel::new(&cables, n);
        let mut expected = vec![0.0; 3 * n];
        let largest = rows.pull(&u, &mut expected);
        cables.iter_mut().for_each(|c| c.nodes = c.nodes.map(to));
        let mut moved = vec![0.0; 3 * n];
        (0..3 * n).for_each(|i| moved[i / n * n + to(i % n)] = u[i]);
        let mut kernel = Kernel::new(&cables, n);
        assert!(kernel.scattered.is_some(), "{} runs", kernel.run_count());
        let mut force = vec![0.0; 3 * n];
        assert_eq!(kernel.pull(&moved, &mut force), largest);
        // Sums over a node's four cables in another order.
        let rounding = 16.0 * f64::EPSILON * largest.sqrt();
        for i in 0..3 * n {
            assert!((force[i / n * n + to(i % n)] - expected[i]).abs() <= rounding);
        }
        assert!((kernel.energy(&moved) / rows.energy(&u) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn what_is_not_a_number_is_not_swallowed() {
        let (cables, n, mut u) = case();
        u[3] = f64::NAN;
        assert!(Kernel::new(&cables, n).energy(&u).is_nan());
    }
}
