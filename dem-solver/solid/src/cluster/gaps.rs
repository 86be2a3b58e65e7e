//! How far each sample lies outside of all balls so far, and which the furthest.
//!
//! The gap of a sample is its distance to the nearest ball, or the depth at which the ray from it into the
//! solid enters one if that is more: between two balls at an edge, a wire gets deeper than the
//! edge is away from them. A ball that the ray misses counts with four times its distance.
//!
//! A tree of boxes over the samples; each node knows the largest gap below it. A new ball visits only
//! the nodes in which it could make a gap smaller.

use super::samples::Samples;
use crate::geometry::bounds;
use crate::geometry::median_tree::{MedianNode, MedianTree, Split};
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

impl SamplePlace {
    fn of(samples: &Samples, at: usize) -> Self {
        Self { point: samples.points[at], inward: samples.inward[at], slope: samples.slope[at] }
    }
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
    gap(&SamplePlace::of(samples, at), ball)
}

/// The gaps of samples.
pub struct Gaps {
    /// Of a node the largest gap below it [m].
    tree: MedianTree<f64>,
    samples: Vec<SamplePlace>,
    gaps: Vec<f64>,
}

impl Gaps {
    /// No ball yet: all gaps are infinite.
    pub fn new(samples: &Samples) -> Self {
        let points = &samples.points;
        let describe = |some: &[u32]| {
            let [low, high] = bounds(some.iter().map(|i| points[*i as usize]));
            ([low, high], f64::INFINITY, Split::Axis((high - low).iamax()))
        };
        let tree = MedianTree::new(points.len(), LEAF, describe, |i| points[i as usize], |_| 0.0);
        let sorted = tree.order.iter().map(|i| SamplePlace::of(samples, *i as usize)).collect();
        Self { tree, samples: sorted, gaps: vec![f64::INFINITY; points.len()] }
    }

    /// The largest gap [m], negative if all lie inside, and its sample.
    pub fn largest(&self) -> (f64, usize) {
        let goal = self.tree.node(0).more;
        let mut at = 0;
        let items = loop {
            if let Some(items) = self.tree.node(at).items() {
                break items;
            }
            let [left, right] = self.tree.children(at);
            at = if self.tree.node(left).more == goal { left } else { right };
        };
        let k = items.clone().find(|k| self.gaps[*k] == goal).unwrap_or(items.start);
        (goal, self.tree.order[k] as usize)
    }

    /// A ball more.
    pub fn add(&mut self, ball: &Sphere) {
        let enter = |node: &MedianNode<f64>| {
            let reach = ball.radius + node.more;
            reach > 0.0 && node.square_to(&ball.centre) < reach * reach
        };
        self.renew(0, &enter, &|_, place, before| before.min(gap(place, ball)));
    }

    /// This sample, which lies at `point`, cannot be helped: it counts no more.
    pub fn give_up(&mut self, sample: usize, point: &Vector3<f64>) {
        let enter = |node: &MedianNode<f64>| node.square_to(point) <= 0.0;
        let new = |number, _: &SamplePlace, before| if number == sample { f64::NEG_INFINITY } else { before };
        self.renew(0, &enter, &new);
    }

    /// Give the samples of the leaves into which `enter` leads from node `at` their `new` gaps (sample, place, gap so far): the largest
    /// gap of the node then.
    fn renew(
        &mut self,
        at: u32,
        enter: &impl Fn(&MedianNode<f64>) -> bool,
        new: &impl Fn(usize, &SamplePlace, f64) -> f64,
    ) -> f64 {
        let node = self.tree.node(at);
        if !enter(node) {
            return node.more;
        }
        let largest = if let Some(items) = node.items() {
            let mut largest = f64::NEG_INFINITY;
            for k in items {
                self.gaps[k] = new(self.tree.order[k] as usize, &self.samples[k], self.gaps[k]);
                largest = largest.max(self.gaps[k]);
            }
            largest
        } else {
            let [left, right] = self.tree.children(at);
            self.renew(left, enter, new).max(self.renew(right, enter, new))
        };
        *self.tree.more_mut(at) = largest;
        largest
    }
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
        gaps.give_up(sample, &samples.points[sample]);
        assert!(gaps.largest().0 < before);
    }
}
