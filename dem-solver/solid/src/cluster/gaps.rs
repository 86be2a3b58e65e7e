//! How far each sample lies outside of all balls so far, and which the furthest.
//!
//! The gap of a sample is its distance to the nearest ball, or the depth at which the ray from it into the
//! solid enters one if that is more: between two balls at an edge, a wire gets deeper than the
//! edge is away from them. A ball that the ray misses counts with four times its distance.
//!
//! A tree of boxes over the samples; each node knows the largest gap below it. A new ball visits only
//! the nodes in which it could make a gap smaller.

use super::samples::Sample;
use crate::geometry::bounds;
use crate::geometry::median_tree::{MedianNode, MedianTree, Split};
use crate::geometry::sphere::Sphere;
use nalgebra::Vector3;

const LEAF: usize = 8;

/// What a ball that a sample's ray misses counts more than one that it enters.
const MISSED: f64 = 4.0;

/// The gap at a sample that `ball` leaves [m].
pub fn left_by(place: &Sample, ball: &Sphere) -> f64 {
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

/// The gaps of samples.
pub struct Gaps {
    /// Of a node the largest gap below it [m].
    tree: MedianTree<f64>,
    samples: Vec<Sample>,
    gaps: Vec<f64>,
}

impl Gaps {
    /// No ball yet: all gaps are infinite.
    pub fn new(samples: &[Sample]) -> Self {
        let point = |i: u32| samples[i as usize].point;
        let describe = |some: &[u32]| {
            let [low, high] = bounds(some.iter().map(|i| point(*i)));
            ([low, high], f64::INFINITY, Split::Axis((high - low).iamax()))
        };
        let tree = MedianTree::new(samples.len(), LEAF, describe, point, |_| 0.0);
        let sorted = tree.order.iter().map(|i| samples[*i as usize]).collect();
        Self { tree, samples: sorted, gaps: vec![f64::INFINITY; samples.len()] }
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
        self.renew(0, &enter, &|_, place, before| before.min(left_by(place, ball)));
    }

    /// The sample with this number, which lies at `point`, cannot be helped: it counts no more.
    pub fn give_up(&mut self, number: usize, point: &Vector3<f64>) {
        let enter = |node: &MedianNode<f64>| node.square_to(point) <= 0.0;
        let new = |at, _: &Sample, before| if at == number { f64::NEG_INFINITY } else { before };
        self.renew(0, &enter, &new);
    }

    /// Give the samples of the leaves into which `enter` leads from node `at` their `new` gaps (sample, place, gap so far): the largest
    /// gap of the node then.
    fn renew(
        &mut self,
        at: u32,
        enter: &impl Fn(&MedianNode<f64>) -> bool,
        new: &impl Fn(usize, &Sample, f64) -> f64,
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
        let sample = |i: u32| Sample {
            point: points[i as usize],
            inward: inward[i as usize],
            slope: at(i, 0.77).abs(),
        };
        let samples: Vec<Sample> = (0..700).map(sample).collect();
        let mut gaps = Gaps::new(&samples);
        let mut balls: Vec<Sphere> = Vec::new();
        for i in 0..80 {
            let centre = Vector3::new(at(i, 5.3), at(i, 7.7), at(i, 9.1)) * 0.8;
            let ball = Sphere { centre, radius: 0.3 * at(i, 0.9).abs() };
            gaps.add(&ball);
            balls.push(ball);
            let gap = |k: usize| balls.iter().map(|b| left_by(&samples[k], b)).fold(f64::INFINITY, f64::min);
            let every = (0..700).map(gap).fold(f64::NEG_INFINITY, f64::max);
            let (largest, sample) = gaps.largest();
            assert_eq!(largest, every);
            assert_eq!(gap(sample), every);
        }
        let (before, sample) = gaps.largest();
        gaps.give_up(sample, &samples[sample].point);
        assert!(gaps.largest().0 < before);
    }
}
