//! Contact of lines with lines: cylinders with round ends that push each other off at their closest points, and hold each other by
//! Coulomb friction.
//!
//! With the distance `d` of the closest points, `g = r_a + r_b - d` deep, along the normal `n` from `b` to `a`,
//!
//! ```text
//! F_n = k w g n        F_t = -k w s,  s <- s + du_t,  |s| <= mu g
//! ```
//!
//! `s` is the elastic slip, kept in the state from step to step; where it would be longer, the lines slide. `w` hands a contact
//! on along a chain: at a node at which another line follows it is 1/2, as that of the other is there, and 1 from a radius on.
//! Forces at the closest points are opposite and equal. Friction acts in the middle lines: that it turns a rope about itself is not followed.
//!
//! Source: Wriggers, Zavarise (1997), Commun. Numer. Meth. Engng 13, 429 (beams with round sections, closest points).

use crate::model::Model;
use crate::model::contact::{ContactLine, ContactLines};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

/// Lines closer than this share of the thinnest radius are listed, too.
const MARGIN: f64 = 1.0;
/// Depth over the sum of the radii from which on the direction in which two lines push each other may turn over.
const TOO_DEEP: f64 = 0.6;

/// What two lines that touch remember.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct LineTouch {
    /// Which lines.
    pair: [u32; 2],
    /// Elastic slip of the first on the second [m].
    slip: [f64; 3],
    /// Stiffness against it [N/m].
    stiffness: f64,
}

impl LineTouch {
    fn stored(&self) -> f64 {
        0.5 * self.stiffness * Vector3::from(self.slip).norm_squared()
    }
}

/// The lines of a structure, and which may touch.
pub struct LineContact {
    of: ContactLines,
    /// Pairs closer than [`MARGIN`], in order, and where their nodes were then [m].
    near: Vec<[u32; 2]>,
    listed: Vec<Vector3<f64>>,
    margin: f64,
    /// Least coordinate and number of each line, along the longest extent.
    order: Vec<(f64, u32)>,
    /// What touches in the step at hand.
    touches: Vec<LineTouch>,
    /// Largest depth over the sum of the radii since somebody asked, and of which lines.
    deepest: (f64, [u32; 2]),
}

/// Two lines where they touch.
struct TouchingPoint {
    /// Where along each.
    at: [f64; 2],
    /// From the second to the first, a unit vector.
    normal: Vector3<f64>,
    /// How deep they are in each other [m].
    depth: f64,
    /// Share of the stiffness.
    share: f64,
}

impl LineContact {
    /// Those of `model`, which every call names again.
    pub fn new(model: &Model, of: &ContactLines) -> Self {
        let thinnest = of.lines.iter().map(|line| line.radius).fold(f64::INFINITY, f64::min);
        Self {
            of: of.clone(),
            near: Vec::new(),
            listed: vec![Vector3::repeat(f64::INFINITY); model.node_count()],
            margin: MARGIN * thinnest,
            order: Vec::new(),
            touches: Vec::new(),
            deepest: (0.0, [0; 2]),
        }
    }

    /// Add the forces of contact in the `middle` of a step from the displacements `start` [m] to `force` [N]; `touches` become those
    /// there. Returns what friction has dissipated from the middle of the step before [J].
    pub fn push(
        &mut self,
        model: &Model,
        (start, middle): (&[f64], &[f64]),
        touches: &mut Vec<LineTouch>,
        force: &mut [f64],
    ) -> f64 {
        self.list(model, middle);
        let mut dissipated = 0.0;
        let mut before = touches.iter().peekable();
        self.touches.clear();
        for pair in &self.near {
            let [a, b] = pair.map(|i| &self.of.lines[i as usize]);
            let Some(place) = touch(model, middle, [a, b]) else { continue };
            let deep = place.depth / (a.radius + b.radius);
            if deep > self.deepest.0 {
                self.deepest = (deep, *pair);
            }
            let stiffness = self.of.stiffness * place.share;
            let mut push = stiffness * place.depth * place.normal;
            if self.of.friction > 0.0 {
                // What does not touch any more loses what it had stored.
                while let Some(left) = before.next_if(|touch| touch.pair < *pair) {
                    dissipated += left.stored();
                }
                let had = before.next_if(|touch| touch.pair == *pair).copied().unwrap_or_default();
                let slip = Vector3::from(had.slip);
                // From the last middle to this one it is twice as far as from the start.
                let way = 2.0
                    * (moved(model, (start, middle), a, place.at[0])
                        - moved(model, (start, middle), b, place.at[1]));
                let along = slip + way;
                let along = along - place.normal * place.normal.dot(&along);
                let most = self.of.friction * place.depth;
                let along = if along.norm() > most { along.normalize() * most } else { along };
                let now = LineTouch { pair: *pair, slip: along.into(), stiffness };
                let work = 0.5 * (had.stiffness * slip + stiffness * along).dot(&way);
                dissipated += work + had.stored() - now.stored();
                self.touches.push(now);
                push -= stiffness * along;
            }
            for (line, at, push) in [(a, place.at[0], push), (b, place.at[1], -push)] {
                for (node, share) in line.nodes.into_iter().zip([1.0 - at, at]) {
                    (0..3).for_each(|c| force[model.dof(node, c)] += share * push[c]);
                }
            }
        }
        dissipated += before.map(LineTouch::stored).sum::<f64>();
        touches.clone_from(&self.touches);
        dissipated
    }

    /// Energy stored at the displacements `u` [J].
    pub fn stored(&mut self, model: &Model, u: &[f64], touches: &[LineTouch]) -> f64 {
        self.list(model, u);
        let pairs = self.near.iter().map(|pair| pair.map(|i| &self.of.lines[i as usize]));
        let places = pairs.filter_map(|pair| touch(model, u, pair));
        let normal: f64 = places.map(|place| 0.5 * place.share * place.depth * place.depth).sum();
        self.of.stiffness * normal + touches.iter().map(LineTouch::stored).sum::<f64>()
    }

    /// What is wrong where lines were pressed into each other too far since the last call.
    pub fn too_deep(&mut self) -> Option<String> {
        let (share, pair) = std::mem::take(&mut self.deepest);
        let ends = |i: u32| self.of.lines[i as usize].nodes;
        (share > TOO_DEEP).then(|| {
            let (a, b, percent) = (ends(pair[0]), ends(pair[1]), 100.0 * share);
            format!(
                "the lines between the nodes {a:?} and {b:?} are pressed into each other by {percent:.0} % of their radii, and may pass through \
                 each other; a larger structure.contact.stiffness does"
            )
        })
    }

    /// List the pairs that are near at the displacements `u` [m], where nodes have come far since the last time.
    fn list(&mut self, model: &Model, u: &[f64]) {
        let at = |node: usize| model.nodes[node] + model.vector(u, node);
        let far = |node: usize| {
            let way = (at(node) - self.listed[node]).norm_squared();
            way.is_nan() || way > 0.25 * self.margin * self.margin
        };
        if !self.of.lines.iter().any(|line| line.nodes.into_iter().any(far)) {
            return;
        }
        (0..self.listed.len()).for_each(|node| self.listed[node] = at(node));
        let reach = |line: &ContactLine| line.radius + 0.5 * self.margin;
        let boxed = |i: usize| {
            let line = &self.of.lines[i];
            let ([p, q], by) = (line.nodes.map(|n| self.listed[n]), Vector3::repeat(reach(line)));
            (p.inf(&q) - by, p.sup(&q) + by)
        };
        let boxes: Vec<_> = (0..self.of.lines.len()).map(boxed).collect();
        let all = boxes.iter().copied().reduce(|a, b| (a.0.inf(&b.0), a.1.sup(&b.1)));
        let axis = all.map_or(0, |(low, high)| (high - low).imax());
        self.order.clear();
        self.order.extend(boxes.iter().enumerate().map(|(i, (low, _))| (low[axis], i as u32)));
        self.order.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
        self.near.clear();
        for (place, (_, i)) in self.order.iter().enumerate() {
            let (low, high) = boxes[*i as usize];
            for (_, j) in self.order[place + 1..].iter().take_while(|(least, _)| *least <= high[axis]) {
                let other = boxes[*j as usize];
                let apart = (0..3).any(|c| low[c] > other.1[c] || high[c] < other.0[c]);
                if !apart && self.of.lines[*i as usize].body != self.of.lines[*j as usize].body {
                    self.near.push([*i.min(j), *i.max(j)]);
                }
            }
        }
        // One order of sums, however the list came about.
        self.near.sort_unstable();
    }
}

/// How far the point `at` of a line is moved between two displacements [m].
fn moved(model: &Model, (from, to): (&[f64], &[f64]), line: &ContactLine, at: f64) -> Vector3<f64> {
    let [a, b] = line.nodes.map(|node| model.vector(to, node) - model.vector(from, node));
    a + at * (b - a)
}

/// Where two lines touch at the displacements `u`, if they do.
fn touch(model: &Model, u: &[f64], lines: [&ContactLine; 2]) -> Option<TouchingPoint> {
    let [[p, d], [q, e]] = lines.map(|line| {
        let [a, b] = line.nodes.map(|node| model.nodes[node] + model.vector(u, node));
        [a, b - a]
    });
    let lengths = [d.norm(), e.norm()];
    let at = closest([d, e], p - q);
    let apart = p + at[0] * d - q - at[1] * e;
    let (distance, reach) = (apart.norm(), lines[0].radius + lines[1].radius);
    let share: f64 = (0..2).map(|i| handed_on(lines[i].overlap, at[i], lengths[i])).product();
    let depth = reach - distance;
    (depth > 0.0 && distance > 0.0).then(|| TouchingPoint { at, normal: apart / distance, depth, share })
}

/// Where along each of two lines with the directions `d` and `e` their closest points lie, 0 to 1; the first begins at `from` as
/// seen from the second.
fn closest([d, e]: [Vector3<f64>; 2], from: Vector3<f64>) -> [f64; 2] {
    let (dd, ee, de) = (d.norm_squared(), e.norm_squared(), d.dot(&e));
    let (df, ef) = (d.dot(&from), e.dot(&from));
    let square = dd * ee - de * de;
    let first = if square > 1e-9 * dd * ee { (de * ef - df * ee) / square } else { 0.5 };
    let s = first.clamp(0.0, 1.0);
    let t = ((de * s + ef) / ee).clamp(0.0, 1.0);
    let s = ((de * t - df) / dd).clamp(0.0, 1.0);
    [s, ((de * s + ef) / ee).clamp(0.0, 1.0)]
}

/// Share of a contact `at` a place along a line that is its own, and not that of the line that follows.
fn handed_on(overlap: [f64; 2], at: f64, length: f64) -> f64 {
    let smooth = |from_end: f64, overlap: f64| {
        let x = if overlap > 0.0 { (0.5 + 0.5 * from_end / overlap).min(1.0) } else { 1.0 };
        x * x * (3.0 - 2.0 * x)
    };
    smooth(at * length, overlap[0]) * smooth((1.0 - at) * length, overlap[1])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::element::tests::checks::random;

    /// Two lines that do not hang together, each of a radius of 10 mm, across each other within 16 mm somewhere.
    fn crossed(noise: &mut impl FnMut() -> f64, friction: f64) -> Model {
        let mut point = |z: f64, out: f64, along_x: bool| {
            let side = 0.02 * noise();
            Vector3::new(if along_x { out } else { side }, if along_x { side } else { out }, z)
        };
        let nodes = vec![
            point(0.0, -0.05, true),
            point(0.0, 0.06, true),
            point(0.016, -0.07, false),
            point(0.016, 0.05, false),
        ];
        let line = |nodes, body| ContactLine { nodes, radius: 0.01, body, overlap: [0.0; 2] };
        let lines = vec![line([0, 1], 0), line([2, 3], 1)];
        let contact = Some(ContactLines { lines, stiffness: 1e6, friction });
        Model { nodes, contact, ..Model::default() }
    }

    fn of(model: &Model) -> LineContact {
        LineContact::new(model, model.contact.as_ref().expect("is there"))
    }

    #[test]
    fn forces_are_the_slopes_of_the_energy_and_balance_in_sum_and_moment() {
        let mut noise = random(11);
        for _ in 0..50 {
            let model = crossed(&mut noise, 0.0);
            let u: Vec<f64> = (0..12).map(|_| 2e-3 * noise()).collect();
            let (mut contact, mut force) = (of(&model), vec![0.0; 12]);
            contact.push(&model, (&u, &u), &mut Vec::new(), &mut force);
            let most = force.iter().fold(0.0, |most: f64, f| most.max(f.abs()));
            assert!(most > 100.0, "{most}");
            for dof in 0..12 {
                let mut at = |step: f64| {
                    let mut moved = u.clone();
                    moved[dof] += step;
                    contact.stored(&model, &moved, &[])
                };
                let slope = (at(1e-7) - at(-1e-7)) / 2e-7;
                assert!((force[dof] + slope).abs() < 1e-6 * most, "{} {slope}", force[dof]);
            }
            let at = |node: usize| (model.nodes[node] + model.vector(&u, node), model.vector(&force, node));
            let sum: Vector3<f64> = (0..4).map(|node| at(node).1).sum();
            let moment: Vector3<f64> = (0..4).map(|node| at(node).0.cross(&at(node).1)).sum();
            assert!(sum.norm() < 1e-12 * most && moment.norm() < 1e-12 * most, "{sum} {moment}");
        }
    }

    #[test]
    fn friction_holds_up_to_its_share_of_the_normal_force_and_dissipates_what_it_takes() {
        let (model, friction) = (crossed(&mut || 0.0, 0.3), 0.3);
        let (mut contact, mut touches, mut before) = (of(&model), Vec::new(), vec![0.0; 12]);
        let (mut work, mut dissipated, mut last) = (0.0, 0.0, 0.0);
        // The first line along y, to and fro; steps of the middles are twice those from their starts.
        for step in 1..=4000 {
            let mut u = vec![0.0; 12];
            let aside = 4e-3 * (f64::from(step) * 2e-3).sin();
            (u[4], u[5]) = (aside, aside);
            let start: Vec<f64> = u.iter().zip(&before).map(|(u, b)| 0.5 * (u + b)).collect();
            let mut force = vec![0.0; 12];
            dissipated += contact.push(&model, (&start, &u), &mut touches, &mut force);
            let (along, normal) = (force[4] + force[5], force[8] + force[9]);
            assert!(along.abs() <= friction * normal.abs() * (1.0 + 1e-12));
            work -= 0.5 * (along + last) * (u[4] - before[4]);
            (before, last) = (u, along);
        }
        let kept: f64 = touches.iter().map(LineTouch::stored).sum();
        // 4 mm of depth and 20 mm of way: 1.2 kN over about 18 mm.
        assert!(work > 15.0 && (work - dissipated - kept).abs() < 1e-9 * work, "{work} {dissipated} {kept}");
    }
}
