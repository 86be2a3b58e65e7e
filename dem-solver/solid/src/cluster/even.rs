//! A second search for a cover, where guesses lead to none that is known to be good.
//!
//! A guess that is too small spends all balls on one part of the solid, and balls that overlap no other, put beside one
//! that they do overlap, leave a gap where they were. Here the error is sought between bounds, balls stay where they
//! are, and are joined only when it is known how far they grow. Few balls are moved to the middle of what they
//! cover besides. What is measured to be best is taken.

use super::accuracy::Accuracy;
use super::ball::Balls;
use super::best::{Best, FINE};
use super::compare::{self, Comparison};
use super::cover::Cover;
use super::index::SphereIndex;
use super::make::{Maker, larger};
use super::refine::rounds;
use crate::geometry::sphere::Sphere;
use nalgebra::Vector3;

/// Covers of the search, fewer where balls are many, and how near its bounds come to each other.
const MOST_COVERS: usize = 12;
const FEWER_COVERS: usize = 4;
const MANY: usize = 3000;
const NEAR: f64 = 1.05;
/// Most times that balls are moved to the middle of what they cover, and steps towards that middle.
const MOST_ROUNDS: usize = 30;
const MOST_STEPS: u32 = 60;
/// A cover found by guesses is kept if no other is better than this share of its error.
const BETTER: f64 = 0.95;
impl Maker<'_> {
    /// The best of covers found by guesses, of evenly spread ones, and of these moved to the middle of what they cover,
    /// as measured when they are grown. `tried` are errors for which balls were too few and enough [m].
    pub fn search_further(
        &mut self,
        guessed: Option<(Cover, f64)>,
        tried: (f64, f64),
    ) -> (Vec<Sphere>, Accuracy) {
        let covers = self.evenly(tried);
        let even = self.best(covers);
        let relaxed = even.clone().filter(|_| self.count <= MANY).map(|mut found| {
            self.relax(&mut found);
            found
        });
        self.settle(guessed.into_iter().collect(), [even, relaxed].into_iter().flatten().collect())
    }

    /// The best of covers, each with the gap that it leaves [m], with some spheres moved where that makes it better. Others
    /// must be better than the `preferred` ones by a share.
    pub(super) fn settle(
        &mut self,
        preferred: Vec<(Cover, f64)>,
        others: Vec<(Cover, f64)>,
    ) -> (Vec<Sphere>, Accuracy) {
        // Very many spheres are not moved: nothing to compare with.
        if let ([(cover, gap)], [], 0) = (preferred.as_slice(), others.as_slice(), rounds(self.count)) {
            let cluster = larger(&cover.balls, self.growth(&cover.balls, *gap));
            let accuracy = Accuracy::with(self.surface, &mut self.sizes, &cluster);
            return (cluster, accuracy);
        }
        let gap = preferred.iter().chain(&others).map(|f| f.1).fold(f64::INFINITY, f64::min);
        let gap = if gap.is_finite() { gap } else { 2.0 * self.surface.size() };
        let samples = self.samples(0.5 * gap);
        let few = self.at_most(gap, 0.9, compare::MOST_SAMPLES + self.surface.points.len());
        let maker = &*self;
        let comparison = Comparison::new(maker.surface, maker.tree, few);
        let mut best =
            Best { maker, comparison, best: None, balls: Vec::new(), grown: 0.0, places: Vec::new() };
        for (weight, covers) in [(BETTER, preferred), (1.0, others)] {
            for (cover, gap) in covers {
                best.add_grown(&cover.balls, gap, weight);
            }
        }
        let balls = best.balls.clone();
        if balls.len() > 2 {
            maker.refine(&samples, &mut best, balls);
        }
        let cluster = best.best.map_or_else(|| vec![maker.middle], |(_, cluster)| cluster);
        let accuracy = Accuracy::with(self.surface, &mut self.sizes, &cluster);
        (cluster, accuracy)
    }

    /// Covers with errors between one for which balls are enough and one for which all are too few, until these two
    /// are near each other. Balls that overlap no other stay where they are.
    fn evenly(&mut self, tried: (f64, f64)) -> Vec<Cover> {
        let most = if self.count > MANY { FEWER_COVERS } else { MOST_COVERS };
        let (mut few, mut enough) = (0.0, f64::INFINITY);
        let mut error = match tried {
            (few, enough) if few > 0.0 && enough.is_finite() => (few * enough).sqrt(),
            (_, enough) if enough.is_finite() => enough,
            _ => 0.5 * self.surface.size(),
        };
        let mut covers: Vec<Cover> = Vec::new();
        while covers.len() < most && enough > NEAR * few {
            let found = self.attempt(error, self.count, false);
            match found.enough {
                Some(_) => enough = error,
                None => few = error,
            }
            let share = found.enough.map_or(1.0, |m| m as f64 / self.count as f64);
            let full = found.balls.len() < self.count;
            covers.push(found);
            if (0.97..1.0).contains(&share) || full {
                break;
            }
            error = match (few > 0.0, enough.is_finite()) {
                (true, true) => (few * enough).sqrt(),
                (true, false) if few < tried.1 && tried.1.is_finite() => tried.1.max(1.05 * few),
                (true, false) => 2.0 * error,
                // Of order -1/2 or steeper: not below what is sought.
                _ => error * share.sqrt().clamp(0.3, 0.9),
            };
        }
        covers
    }

    /// Move every ball to the middle of the samples that are nearest to it, where that brings them nearer.
    fn relax(&mut self, (cover, largest): &mut (Cover, f64)) {
        let samples = self.samples(0.5 * *largest);
        let balls = Balls::new(self.tree, self.surface.size(), FINE * self.middle.radius);
        let least = self.wish.smallest_radius;
        let nearest = |balls: &[Sphere]| -> Vec<(f64, usize)> {
            let index = SphereIndex::new(balls);
            let near = |p| {
                let (distance, near) = index.nearest(p);
                (distance, index.place(near))
            };
            samples.points.iter().map(near).collect()
        };
        let furthest = |near: &[(f64, usize)]| near.iter().map(|n| n.0).fold(0.0, f64::max);
        let mut near = nearest(&cover.balls);
        *largest = furthest(&near);
        for _ in 0..MOST_ROUNDS {
            let mut own: Vec<Vec<Vector3<f64>>> = vec![Vec::new(); cover.balls.len()];
            for (p, (_, ball)) in samples.points.iter().zip(&near) {
                own[*ball].push(*p);
            }
            let mut moved = cover.balls.clone();
            for (ball, own) in moved.iter_mut().zip(&own) {
                let away = |b: &Sphere| {
                    own.iter().map(|p| (p - b.centre).norm() - b.radius).fold(f64::NEG_INFINITY, f64::max)
                };
                let Some(found) = balls.around(&middle(own)) else { continue };
                if found.radius > 0.0 && found.radius >= least && away(&found) < 0.999 * away(ball) {
                    *ball = found;
                }
            }
            let after = nearest(&moved);
            let gap = furthest(&after);
            if gap >= *largest {
                break;
            }
            (cover.balls, near, *largest) = (moved, after, gap);
        }
    }
}

/// About the centre of the smallest ball around points. Source: Badoiu and Clarkson (2003), SODA, 801.
fn middle(points: &[Vector3<f64>]) -> Vector3<f64> {
    let mut centre = points.iter().sum::<Vector3<f64>>() / points.len().max(1) as f64;
    for step in 1..MOST_STEPS {
        let away = |p: &&Vector3<f64>| (**p - centre).norm_squared();
        if let Some(furthest) = points.iter().max_by(|a, b| away(a).total_cmp(&away(b))) {
            centre += (furthest - centre) / f64::from(step + 1);
        }
    }
    centre
}
