//! How far each sample lies outside of all balls so far, and which the furthest.
//!
//! The gap of a sample is its distance to the nearest ball, or the depth at which the ray from it into the
//! solid enters one if that is more: between two balls at an edge, a wire gets deeper than the
//! edge is away from them. A ball that the ray misses counts with four times its distance.
//!
//! A tree of boxes over the samples; each node knows the largest gap below it. A new ball visits only
//! the nodes in which it could make a gap smaller.

use super::samples::Samples;
use crate::geometry::sphere::Sphere;
use nalgebra::Vector3;

const LEAF: usize = 8;

/// What a ball that a sample's ray misses counts more than one that it enters.
const MISSED: f64 = 4.0;

/// A sample: place, direction into the solid, depth per length along that.
#[derive(Clone, Copy)]
struct SamplePlace {
    point: Vector3<f64>,
    inward: Vector3<f64>,
    slope: f64,
}

/// The gap that `ball` leaves at a sample [m].
fn gap(place: &SamplePlace, ball: &Sphere) -> f64 {
    let arm = ball.centre - place.point;
    let square = arm.norm_squared();
    let near = square.sqrt() - ball.radius;
    if near <= 0.0 {
        return near;
    }
    let along = arm.dot(&place.inward);
    let inside = along * along - square + ball.radius * ball.radius;
    if along > 0.0 && inside > 0.0 {
        near.max((along - inside.sqrt()) * place.slope).min(MISSED * near)
    } else {
        MISSED * near
    }
}

/// The gap that `ball` leaves at sample `at` [m].
pub fn leaves(samples: &Samples, at: usize, ball: &Sphere) -> f64 {
    let place =
        SamplePlace { point: samples.points[at], inward: samples.inward[at], slope: samples.slope[at] };
    gap(&place, ball)
}

struct GapNode {
    lowest: Vector3<f64>,
    highest: Vector3<f64>,
    first: u32,
    count: u32,
    largest: f64,
}

/// The gaps of samples.
pub struct Gaps {
    nodes: Vec<GapNode>,
    order: Vec<u32>,
    /// Place of each sample in that order.
    places: Vec<u32>,
    samples: Vec<SamplePlace>,
    gaps: Vec<f64>,
}

impl Gaps {
    /// No ball yet: all gaps are infinite.
    pub fn new(samples: &Samples) -> Self {
        let points = &samples.points;
        let mut order: Vec<u32> = (0..points.len() as u32).collect();
        let mut nodes = Vec::new();
        build(&mut nodes, &mut order, 0, points);
        let place =
            |i: usize| SamplePlace { point: points[i], inward: samples.inward[i], slope: samples.slope[i] };
        let sorted = order.iter().map(|i| place(*i as usize)).collect();
        let mut places = vec![0; points.len()];
        for (place, sample) in order.iter().enumerate() {
            places[*sample as usize] = place as u32;
        }
        Self { nodes, order, places, samples: sorted, gaps: vec![f64::INFINITY; points.len()] }
    }

    /// The largest gap [m], negative if all lie inside, and its sample.
    pub fn largest(&self) -> (f64, usize) {
        let goal = self.nodes[0].largest;
        let mut at = 0;
        while self.nodes[at].count == 0 {
            let left = at + 1;
            at = if self.nodes[left].largest == goal { left } else { self.nodes[at].first as usize };
        }
        let node = &self.nodes[at];
        let range = node.first as usize..(node.first + node.count) as usize;
        let k = range.clone().find(|k| self.gaps[*k] == goal).unwrap_or(range.start);
        (goal, self.order[k] as usize)
    }

    /// A ball more.
    pub fn add(&mut self, ball: &Sphere) {
        self.visit(0, ball);
    }

    /// This sample cannot be helped: it counts no more.
    pub fn give_up(&mut self, sample: usize) {
        let place = self.places[sample] as usize;
        self.gaps[place] = f64::NEG_INFINITY;
        self.renew(0, 0, self.order.len(), place);
    }

    /// The largest gap of node `at`, which holds `length` samples from `start` on, after `place` changed.
    fn renew(&mut self, at: usize, start: usize, length: usize, place: usize) -> f64 {
        let largest = if self.nodes[at].count > 0 {
            self.gaps[start..start + length].iter().copied().fold(f64::NEG_INFINITY, f64::max)
        } else {
            let (left, right, half) = (at + 1, self.nodes[at].first as usize, length / 2);
            if place < start + half {
                self.renew(left, start, half, place).max(self.nodes[right].largest)
            } else {
                self.renew(right, start + half, length - half, place).max(self.nodes[left].largest)
            }
        };
        self.nodes[at].largest = largest;
        largest
    }

    fn visit(&mut self, at: usize, ball: &Sphere) -> f64 {
        let node = &self.nodes[at];
        let mut square = 0.0;
        for axis in 0..3 {
            let c = ball.centre[axis];
            let d = (node.lowest[axis] - c).max(c - node.highest[axis]).max(0.0);
            square += d * d;
        }
        let reach = ball.radius + node.largest;
        if reach <= 0.0 || square >= reach * reach {
            return node.largest;
        }
        let largest = if node.count > 0 {
            let mut largest = f64::NEG_INFINITY;
            for k in node.first as usize..(node.first + node.count) as usize {
                self.gaps[k] = self.gaps[k].min(gap(&self.samples[k], ball));
                largest = largest.max(self.gaps[k]);
            }
            largest
        } else {
            let right = node.first as usize;
            self.visit(at + 1, ball).max(self.visit(right, ball))
        };
        self.nodes[at].largest = largest;
        largest
    }
}

fn build(nodes: &mut Vec<GapNode>, order: &mut [u32], first: u32, points: &[Vector3<f64>]) {
    let (mut lowest, mut highest) = (Vector3::repeat(f64::INFINITY), Vector3::repeat(f64::NEG_INFINITY));
    for i in order.iter() {
        lowest = lowest.inf(&points[*i as usize]);
        highest = highest.sup(&points[*i as usize]);
    }
    let at = nodes.len();
    nodes.push(GapNode { lowest, highest, first, count: order.len() as u32, largest: f64::INFINITY });
    if order.len() <= LEAF {
        return;
    }
    let axis = (highest - lowest).iamax();
    let half = order.len() / 2;
    order.select_nth_unstable_by(half, |a, b| {
        points[*a as usize][axis].total_cmp(&points[*b as usize][axis]).then(a.cmp(b))
    });
    let (left, right) = order.split_at_mut(half);
    build(nodes, left, first, points);
    nodes[at].count = 0;
    nodes[at].first = nodes.len() as u32;
    build(nodes, right, first + half as u32, points);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_largest_gap_is_that_of_a_look_at_every_sample() {
        let at = |i: u32, f: f64| (f64::from(i) * f).sin();
        let points: Vec<_> = (0..700).map(|i| Vector3::new(at(i, 1.3), at(i, 2.7), at(i, 3.1))).collect();
        let inward: Vec<_> =
            (0..700).map(|i| Vector3::new(at(i, 0.3), at(i, 1.7), at(i, 2.1)).normalize()).collect();
        let slope = (0..700).map(|i| at(i, 0.77).abs()).collect();
        let samples = Samples { points, inward, slope };
        let mut gaps = Gaps::new(&samples);
        let mut balls: Vec<Sphere> = Vec::new();
        for i in 0..80 {
            let centre = Vector3::new(at(i, 5.3), at(i, 7.7), at(i, 9.1)) * 0.8;
            let ball = Sphere { centre, radius: 0.3 * at(i, 0.9).abs() };
            gaps.add(&ball);
            balls.push(ball);
            let gap = |k: usize| balls.iter().map(|b| leaves(&samples, k, b)).fold(f64::INFINITY, f64::min);
            let every = (0..700).map(gap).fold(f64::NEG_INFINITY, f64::max);
            let (largest, sample) = gaps.largest();
            assert_eq!(largest, every);
            assert_eq!(gap(sample), every);
        }
        let (before, sample) = gaps.largest();
        gaps.give_up(sample);
        assert!(gaps.largest().0 < before);
    }
}
