//! Where the mesh's nodes are within a window.
//!
//! Position is piecewise linear between the samples of displacement. Velocity is the chord of the
//! segment, so that force times displacement is exactly the work. A node that all samples leave at
//! one place has a structure behind it that was not moved (a predictor of order 0): there the
//! transmitted velocity is the better one for dashpot and friction.

use interface_defs::{Layout, Sampling, Selection, name};
use nalgebra::Vector3;
use std::ops::Range;

/// Numbers of eight nodes.
const EIGHT_NODES: usize = 24;

/// Where the mesh's motion lies in the input of a window. The input may name selected nodes alone; where the others were
/// seen last is remembered for what may be coarse.
#[derive(Debug, Clone, Default)]
pub struct MotionFields {
    displacement: Vec<Range<usize>>,
    velocity: Vec<Range<usize>>,
    /// Place of each node of the mesh in a sample; [`Selection::OUT`] if it is not sent.
    place: Vec<u32>,
    /// The nodes that are sent; all if `whole`.
    nodes: Vec<u32>,
    whole: bool,
    /// Displacement of all nodes as they were seen last [m]; kept up where some are not sent.
    seen: Vec<f64>,
}

impl MotionFields {
    /// From the layout of the plan's input, for `nodes` nodes.
    pub fn new(layout: &Layout, nodes: usize) -> Self {
        let mut fields = Self {
            place: (0..nodes as u32).collect(),
            nodes: Vec::with_capacity(nodes),
            whole: true,
            seen: vec![0.0; 3 * nodes],
            ..Self::default()
        };
        fields.lay_out(layout);
        fields
    }

    /// The same fields lie elsewhere.
    pub fn lay_out(&mut self, layout: &Layout) {
        for (places, field) in
            [(&mut self.displacement, name::DISPLACEMENT), (&mut self.velocity, name::VELOCITY)]
        {
            places.clear();
            places.extend((0..).map_while(|i| sample(layout, field, Sampling::FromStart, i)));
        }
    }

    /// From now on the nodes of `selection` are sent; `None`: all.
    pub fn select(&mut self, selection: Option<&Selection>) {
        self.nodes.clear();
        self.whole = selection.is_none();
        for (node, place) in (0..).zip(&mut self.place) {
            *place = selection.map_or(node, |s| s.place(node).map_or(Selection::OUT, |at| at as u32));
        }
        self.nodes.extend(selection.iter().flat_map(|s| &s.nodes));
    }

    /// True if nodes are missing in the input.
    pub fn is_partial(&self) -> bool {
        !self.whole
    }

    /// The nodes that are sent, if they are not all.
    pub fn nodes(&self) -> &[u32] {
        &self.nodes
    }

    /// Remember where nodes are at the start of a window.
    pub fn see(&mut self, input: &[f64]) {
        let Some(first) = self.displacement.first() else { return };
        let sample = &input[first.clone()];
        if self.whole {
            self.seen.copy_from_slice(sample);
            return;
        }
        for (node, u) in self.nodes.iter().zip(sample.as_chunks::<3>().0) {
            self.seen[3 * *node as usize..][..3].copy_from_slice(u);
        }
    }

    /// Parts of the window between which the motion is linear, at least 1.
    pub fn segments(&self) -> usize {
        self.displacement.len().saturating_sub(1).max(1)
    }

    /// The samples of the displacement of the nodes that are sent; none if the mesh stands still.
    pub fn displacements<'a>(&'a self, input: &'a [f64]) -> impl Iterator<Item = &'a [f64]> {
        self.displacement.iter().map(|range| &input[range.clone()])
    }

    /// Displacement of `node` in sample `sample` [m]; of one that is not sent, where it was seen last.
    pub fn displacement(&self, input: &[f64], sample: usize, node: u32) -> Vector3<f64> {
        let Some(range) = self.displacement.get(sample) else { return Vector3::zeros() };
        match self.place(node) {
            Some(place) => of_node(&input[range.clone()], place),
            None => of_node(&self.seen, node),
        }
    }

    /// Place of a node in a sample.
    #[inline]
    pub fn place(&self, node: u32) -> Option<u32> {
        Some(self.place[node as usize]).filter(|place| *place != Selection::OUT)
    }

    /// Where displacement and velocity at both ends of segment `s` lie in the input.
    pub fn ends_of(&self, s: usize) -> [Range<usize>; 4] {
        let (u, v) = (&self.displacement, &self.velocity);
        [u[s].clone(), u[s + 1].clone(), v[s].clone(), v[s + 1].clone()]
    }

    /// Largest distance that a node that is sent is from `reference`, which has all, and that shifted by `shift` [m]; at both
    /// ends of the window.
    pub fn furthest_from(&self, input: &[f64], reference: &[f64], shift: &Vector3<f64>) -> f64 {
        let ends = [self.displacement.first(), self.displacement.last()];
        let mut most = 0.0_f64;
        for range in ends.into_iter().flatten() {
            let sample = input[range.clone()].as_chunks::<3>().0;
            for (node, u) in self.nodes.iter().zip(sample) {
                let from = &reference[3 * *node as usize..][..3];
                let d = [u[0] - from[0] - shift.x, u[1] - from[1] - shift.y, u[2] - from[2] - shift.z];
                let square = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
                most = if square > most { square } else { most };
            }
        }
        most.sqrt()
    }

    /// Displacement of the nodes that are sent at both ends of segment `s`.
    fn ends<'a>(&self, input: &'a [f64], s: usize) -> Option<(&'a [f64], &'a [f64])> {
        Some((&input[self.displacement.get(s)?.clone()], &input[self.displacement.get(s + 1)?.clone()]))
    }

    /// Displacement of the nodes that are sent at the end of a window of `length` [s] as contacts have seen it: the last
    /// sample, and for a node that all samples leave at one place what its transmitted velocity makes of it. Nothing if
    /// the mesh stands still.
    pub fn seen_at_end(&self, input: &[f64], length: f64, seen: &mut Vec<f64>) {
        seen.clear();
        let Some((last, earlier)) = self.displacement.split_last() else { return };
        seen.extend_from_slice(&input[last.clone()]);
        if self.velocity.is_empty() {
            return;
        }
        let segments = self.segments();
        let share = length / segments as f64;
        let samples = (&input[earlier.first().unwrap_or(last).clone()], &input[last.clone()]);
        let chunks = samples.0.chunks(EIGHT_NODES).zip(samples.1.chunks(EIGHT_NODES)).enumerate();
        // Hardly a node is left at its place: that eight are not is seen at a glance.
        let may_rest =
            chunks.filter(|(_, (a, b))| !a.iter().zip(*b).fold(true, |all, (a, b)| all & (a != b)));
        let places = may_rest.flat_map(|(i, (a, _))| (i * EIGHT_NODES / 3..).take(a.len() / 3));
        for place in places.map(|place| place as u32) {
            let end = of_node(&input[last.clone()], place);
            if earlier.iter().any(|range| of_node(&input[range.clone()], place) != end) {
                continue;
            }
            let at = |sample| self.velocity(input, sample, place);
            let moved = (0..segments).map(|s| (at(s) + at(s + 1)) * (0.5 * share)).sum::<Vector3<f64>>();
            for (seen, moved) in seen[3 * place as usize..].iter_mut().zip(moved.iter()) {
                *seen += moved;
            }
        }
    }

    /// Velocity in sample `sample` of the node that is sent at `place` [m/s].
    pub fn velocity(&self, input: &[f64], sample: usize, place: u32) -> Vector3<f64> {
        // The velocity may come in fewer samples than the displacement.
        let (have, all) = (self.velocity.len(), self.segments() + 1);
        if have == 0 {
            return Vector3::zeros();
        }
        let at = (sample * (have - 1)).div_ceil(all - 1).min(have - 1);
        of_node(&input[self.velocity[at].clone()], place)
    }
}

/// Where two windows join. The motion of a window is a prediction; the next one begins where the structure really is.
#[derive(Debug, Clone, Copy)]
pub struct Seam<'a> {
    /// Displacement of the nodes that are sent at the end of the window before, as it was predicted [m]; not a number
    /// where nothing is known.
    pub predicted: &'a [f64],
    /// Their displacement at the start of this one [m].
    pub actual: &'a [f64],
    /// Where a node's numbers are.
    pub fields: &'a MotionFields,
}

impl Seam<'_> {
    /// What a node has moved from the one to the other [m].
    pub fn of_node(&self, node: u32) -> Vector3<f64> {
        let Some(place) = self.fields.place(node) else { return Vector3::zeros() };
        let jump = of_node(self.actual, place) - of_node(self.predicted, place);
        if jump.sum().is_nan() { Vector3::zeros() } else { jump }
    }
}

/// Sample `number` of a field, if there are so many.
pub(super) fn sample(layout: &Layout, name: &str, sampling: Sampling, number: usize) -> Option<Range<usize>> {
    let spec = layout.fields().find(|f| f.name == name && f.sampling == sampling)?;
    (number < spec.sample_count()).then(|| layout.sample(name, sampling, number)).flatten()
}

#[inline]
fn of_node(field: &[f64], node: u32) -> Vector3<f64> {
    let at = 3 * node as usize;
    Vector3::new(field[at], field[at + 1], field[at + 2])
}

/// Motion of some of the mesh's nodes within a window, segment by segment.
#[derive(Debug, Clone, Default)]
pub struct NodeMotion {
    count: usize,
    /// Position at the start of each segment [m].
    origin: Vec<Vector3<f64>>,
    /// Displacement over each segment [m].
    increment: Vec<Vector3<f64>>,
    /// Velocities at the segment's ends [m/s], once any node is held still: its transmitted ones, the chord's for the others; else
    /// empty.
    transmitted: Vec<[Vector3<f64>; 2]>,
    /// Length of a segment [s].
    pub segment: f64,
    /// Its inverse [1/s].
    rate: f64,
    /// True if this is one instant of nodes whose further course is not known.
    instant: bool,
}

impl NodeMotion {
    /// Room for `nodes` nodes in `segments` segments.
    pub fn reserve(&mut self, nodes: usize, segments: usize) {
        self.origin.reserve(nodes * segments);
        self.increment.reserve(nodes * segments);
        self.transmitted.reserve(nodes * segments);
    }

    /// Nodes that a step's middle finds at these positions [m] with these velocities [m/s].
    pub fn place(&mut self, nodes: impl Iterator<Item = (Vector3<f64>, Vector3<f64>)>) {
        self.origin.clear();
        self.transmitted.clear();
        for (position, velocity) in nodes {
            self.origin.push(position);
            self.transmitted.push([velocity; 2]);
        }
        self.count = self.origin.len();
        self.increment.clear();
        self.increment.resize(self.count, Vector3::zeros());
        self.instant = true;
    }

    /// True if it is known where the nodes will be.
    pub fn has_course(&self) -> bool {
        !self.instant
    }

    /// Read the motion of `nodes` over a window of `length` [s]. `rest` has all nodes at t = 0.
    ///
    /// Errs with the first node whose displacement is not finite.
    pub fn read(
        &mut self,
        fields: &MotionFields,
        input: &[f64],
        rest: &[Vector3<f64>],
        nodes: &[u32],
        length: f64,
    ) -> Result<(), u32> {
        let segments = fields.segments();
        self.instant = false;
        self.count = nodes.len();
        self.segment = length / segments as f64;
        self.rate = segments as f64 / length;
        self.origin.clear();
        self.increment.clear();
        self.transmitted.clear();
        for s in 0..segments {
            let Some((start, end)) = fields.ends(input, s) else {
                self.origin.extend(nodes.iter().map(|n| rest[*n as usize]));
                self.increment.resize(nodes.len(), Vector3::zeros());
                break;
            };
            for &node in nodes {
                let place = fields.place[node as usize];
                let (from, to) = (of_node(start, place), of_node(end, place));
                if !(from.sum() + to.sum()).is_finite() {
                    return Err(node);
                }
                self.origin.push(rest[node as usize] + from);
                self.increment.push(to - from);
            }
        }
        self.read_transmitted(fields, input, nodes);
        Ok(())
    }

    fn read_transmitted(&mut self, fields: &MotionFields, input: &[f64], nodes: &[u32]) {
        let zero = Vector3::zeros();
        let held = |a: usize, this: &Self| this.increment[a..].iter().step_by(this.count).all(|d| *d == zero);
        let velocity = |s: usize, a: usize| fields.velocity(input, s, fields.place[nodes[a] as usize]);
        let moving = |a: usize| (0..=fields.segments()).any(|s| velocity(s, a) != zero);
        if fields.velocity.is_empty() || !(0..self.count).any(|a| held(a, self) && moving(a)) {
            return;
        }
        for s in 0..fields.segments() {
            for a in 0..nodes.len() {
                let ends = match held(a, self) {
                    true => [velocity(s, a), velocity(s + 1, a)],
                    false => [self.increment[s * self.count + a] * self.rate; 2],
                };
                self.transmitted.push(ends);
            }
        }
    }

    /// Number of segments.
    pub fn segments(&self) -> usize {
        self.origin.len().checked_div(self.count).unwrap_or(1)
    }

    /// Position of the `a`-th node at the share `along` of segment `s` [m].
    #[inline]
    pub fn position(&self, s: usize, a: usize, along: f64) -> Vector3<f64> {
        let at = s * self.count + a;
        self.origin[at] + self.increment[at] * along
    }

    /// Position of node `a` at the end of the window, or where it was placed last [m].
    pub fn last(&self, a: usize) -> Vector3<f64> {
        match self.has_course() {
            true => self.position(self.segments() - 1, a, 1.0),
            false => self.position(0, a, 0.0),
        }
    }

    /// Its velocity there [m/s].
    #[inline]
    pub fn velocity(&self, s: usize, a: usize, along: f64) -> Vector3<f64> {
        let at = s * self.count + a;
        match self.transmitted.get(at) {
            None => self.increment[at] * self.rate,
            Some([start, end]) => start * (1.0 - along) + end * along,
        }
    }

    /// Its displacement over segment `s` [m].
    #[inline]
    pub fn increment(&self, s: usize, a: usize) -> &Vector3<f64> {
        &self.increment[s * self.count + a]
    }
}

toolkit::wide! {
    /// Largest difference of two fields in any component, numbers that are not finite left out.
    pub fn largest_difference(a: &[f64], b: &[f64]) -> f64 {
        // Eight maxima side by side: a single one would wait for itself at every number.
        let mut lanes = [0.0_f64; 8];
        let (a_chunks, b_chunks) = (a.chunks_exact(8), b.chunks_exact(8));
        let (a_rest, b_rest) = (a_chunks.remainder(), b_chunks.remainder());
        for (a, b) in a_chunks.zip(b_chunks) {
            for i in 0..8 {
                let d = (a[i] - b[i]).abs();
                lanes[i] = if d > lanes[i] { d } else { lanes[i] };
            }
        }
        let rest = a_rest.iter().zip(b_rest).map(|(a, b)| (a - b).abs());
        rest.chain(lanes).fold(0.0, |most, d| if d > most { d } else { most })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use interface_defs::{FieldSpec, InterfaceMesh};

    fn fields(samples: u32) -> (MotionFields, usize) {
        fields_of(2, samples)
    }

    fn fields_of(nodes: usize, samples: u32) -> (MotionFields, usize) {
        let mesh = InterfaceMesh { coordinates: vec![0.0; 3 * nodes], ..Default::default() };
        let spec = |name| FieldSpec { samples, ..FieldSpec::nodal(name, 3, Sampling::FromStart) };
        let layout = Layout::new(&[spec(name::DISPLACEMENT), spec(name::VELOCITY)], &mesh, 0);
        (MotionFields::new(&layout, nodes), layout.len())
    }

    #[test]
    fn a_node_moves_along_the_chords_of_its_samples() {
        let (fields, len) = fields(2);
        let mut input = vec![0.0; len];
        (input[9], input[15]) = (0.2, 0.1);
        let mut motion = NodeMotion::default();
        motion.read(&fields, &input, &[Vector3::zeros(), Vector3::x()], &[1], 0.1).expect("finite");
        assert_eq!(motion.segments(), 2);
        assert_eq!(motion.position(0, 0, 0.5).x, 1.1);
        assert!((motion.position(1, 0, 1.0).x - 1.1).abs() < 1e-15);
        assert!((motion.velocity(1, 0, 0.3).x + 2.0).abs() < 1e-14);
    }

    #[test]
    fn a_node_that_is_held_still_has_the_transmitted_velocity() {
        let (fields, len) = fields(1);
        let mut input = vec![0.0; len];
        // Node 0 is held and has a velocity, node 1 moves.
        (input[9], input[12], input[18]) = (0.5, 3.0, 5.0);
        let mut motion = NodeMotion::default();
        motion.read(&fields, &input, &[Vector3::zeros(); 2], &[0, 1], 0.1).expect("finite");
        assert_eq!(motion.velocity(0, 0, 0.5).x, 4.0);
        assert!((motion.velocity(0, 1, 0.5).x - 5.0).abs() < 1e-14);
        assert_eq!(motion.position(0, 0, 1.0).x, 0.0);
    }

    #[test]
    fn at_the_end_nodes_that_were_held_are_where_their_velocities_take_them() {
        let nodes = 19;
        let (fields, len) = fields_of(nodes, 1);
        for held in 0..nodes {
            let mut input: Vec<f64> = (0..len).map(|i| i as f64).collect();
            input.copy_within(3 * held..3 * held + 3, 3 * (nodes + held));
            let mut seen = Vec::new();
            fields.seen_at_end(&input, 0.5, &mut seen);
            let mut expected = input[3 * nodes..6 * nodes].to_vec();
            for c in 3 * held..3 * held + 3 {
                expected[c] += 0.25 * (input[6 * nodes + c] + input[9 * nodes + c]);
            }
            assert_eq!(seen, expected, "{held}");
        }
    }

    #[test]
    fn a_displacement_that_is_not_finite_is_named() {
        let (fields, len) = fields(1);
        let mut input = vec![0.0; len];
        input[10] = f64::NAN;
        let mut motion = NodeMotion::default();
        assert_eq!(motion.read(&fields, &input, &[Vector3::zeros(); 2], &[0, 1], 0.1), Err(1));
    }

    #[test]
    fn a_wall_without_fields_stands_still() {
        let mut motion = NodeMotion::default();
        let fields = MotionFields::default();
        motion.read(&fields, &[], &[Vector3::y()], &[0], 0.1).expect("finite");
        assert_eq!(
            (motion.position(0, 0, 0.7), motion.velocity(0, 0, 0.7)),
            (Vector3::y(), Vector3::zeros())
        );
    }

    #[test]
    fn the_largest_difference_is_found_in_any_place() {
        for len in [1, 7, 8, 30] {
            for at in 0..len {
                let a = vec![1.0; len];
                let mut b = a.clone();
                b[at] = -1.5;
                assert_eq!(largest_difference(&a, &b), 2.5);
            }
        }
    }
}
