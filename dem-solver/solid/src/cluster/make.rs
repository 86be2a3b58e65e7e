//! A cluster of a given number of spheres, with the smallest error that the method reaches.
//!
//! The number of balls that a cover with error e takes grows a little faster than 1/e. The error for `n` balls is
//! found from covers with fewer balls, each a guess for the next; the best cover with at most `n` is filled up
//! to `n` where its gap is largest. At last all balls grow alike, up to half the gap, so that they reach out
//! of the solid as the solid reaches out of them ([`Fit`]).
//!
//! Where the guesses do not settle, as in plates, bars and limbs, [`super::search`] searches further.
//!
//! A round surface is covered down to the chords of its triangles by fewer balls than may be asked for: a sphere
//! by one. There are as many as asked for where edges are left to cover.

use super::accuracy::Accuracy;
use super::ball::{Balls, FINEST};
use super::cover::{self, Cover, Wanted, cover};
use super::index::SphereIndex;
use super::samples::{Sample, Sizes, no_finer};
use super::wish::{Fit, Wish};
use super::{samples, volume};
use crate::geometry::sphere::Sphere;
use crate::shape::Surface;
use crate::shape::tree::SurfaceTree;

/// Samples are closer than this share of what one ball covers.
const DENSITY: f64 = 0.4;
/// Columns along each side with which the volume is compared before the last measurement.
const COLUMNS: usize = 96;
/// With so many more balls the error goes down: as `n^-ORDER`. A guess to begin with; what is reached is measured.
const ORDER: f64 = 0.8;
/// Balls may be smaller than the largest by this share of the error, and of the largest ball.
const TOLERANCE: f64 = 0.02;
const THIN: f64 = 0.05;
/// Gaps of more than this share of the radius of the largest ball ask for a second search.
const COARSE: f64 = 0.5;
/// A guess is right if this share of the balls was required, and what they leave at last is at most so many times it.
const SETTLED: f64 = 0.93;
const LEFT: f64 = 1.1;
/// Most samples for each ball: on a smooth solid a guess of the error may be far too small.
const MOST_SAMPLES: usize = 100;

/// The spheres [m, in the surface's axes] and the share done (0 to 1) so far.
pub fn make(surface: &Surface, wish: &Wish, progress: impl FnMut(f64)) -> Vec<Sphere> {
    measured(surface, wish, progress).0
}

/// Each sphere once, in their order: symmetric bodies may send two to one place.
fn without_repeats(mut spheres: Vec<Sphere>) -> Vec<Sphere> {
    let mut seen = std::collections::HashSet::with_capacity(spheres.len());
    let key = |s: &Sphere| [s.centre.x, s.centre.y, s.centre.z, s.radius].map(f64::to_bits);
    spheres.retain(|s| seen.insert(key(s)));
    spheres
}

/// The same, with their error.
pub fn measured(surface: &Surface, wish: &Wish, mut progress: impl FnMut(f64)) -> (Vec<Sphere>, Accuracy) {
    let tree = SurfaceTree::new(surface);
    let count = wish.spheres.max(1) as usize;
    let middle = largest(&tree);
    let thick = middle.radius;
    let mut sizes = Sizes::new(&tree);
    sizes.careful = false;
    let mut maker = Maker { tree: &tree, sizes, middle, count, wish };
    let covers = maker.by_guesses(&mut progress);
    let tried = tried(&covers);
    let found: Vec<Cover> = maker.best(covers).into_iter().collect();
    progress(1.0);
    // Samples that see thin parts too.
    maker.sizes.careful = true;
    let is_good = |cover: &Cover| {
        maker.is_settled(cover) && {
            let seen = furthest(&cover.balls, &maker.samples(cover.seen));
            seen <= COARSE * thick && seen <= 2.0 * cover.seen
        }
    };
    let others = if found.iter().any(is_good) { Vec::new() } else { maker.search_further(tried) };
    let (spheres, accuracy) = maker.settle(found, others);
    (without_repeats(spheres), accuracy)
}

/// The largest error for which balls were too few, and the smallest for which they were enough [m].
fn tried(covers: &[Cover]) -> (f64, f64) {
    let enough = covers.iter().filter(|c| c.enough.is_some()).map(|c| c.error).fold(f64::INFINITY, f64::min);
    let few = covers.iter().filter(|c| c.enough.is_none() && c.error < enough).map(|c| c.error);
    (few.fold(0.0, f64::max), enough)
}

/// About the largest ball in the solid inside the surface of `tree`.
pub fn largest(tree: &SurfaceTree) -> Sphere {
    let mut sizes = Sizes::new(tree);
    let balls = Balls::new(tree, 1e-6 * tree.size);
    let most = most_samples(tree.surface, 1);
    let found = no_finer(0.05 * tree.size, |error| samples::corners(&mut sizes, error, 0.9, most));
    cover::largest(&balls, &found).unwrap_or(Sphere { centre: found[0].point, radius: 0.0 })
}

/// What a cluster is made of.
pub(super) struct Maker<'a> {
    pub(super) tree: &'a SurfaceTree<'a>,
    pub(super) sizes: Sizes<'a>,
    /// About the largest ball.
    pub(super) middle: Sphere,
    pub(super) count: usize,
    pub(super) wish: &'a Wish,
}

impl Maker<'_> {
    /// Covers with errors that follow from those of fewer balls.
    fn by_guesses(&mut self, progress: &mut impl FnMut(f64)) -> Vec<Cover> {
        let size = self.tree.size;
        let finest = FINEST * size;
        let mut steps = vec![self.count];
        while let Some(last) = steps.last().filter(|n| **n > 30) {
            steps.push(last / 6);
        }
        // A single ball leaves about a third of the size; from there on a guess follows from the last.
        let mut error = 0.3 * size / (*steps.last().unwrap_or(&1) as f64).powf(ORDER);
        let mut done = 0;
        let mut covers: Vec<Cover> = Vec::new();
        for (k, n) in steps.iter().rev().enumerate() {
            let last = k + 1 == steps.len();
            for attempt in 0..3 {
                let found = self.attempt(error, *n, true);
                // A cover with as many as asked for, or nearly so, is near the best; and there is none finer.
                let used = found.enough.map(|m| m as f64 / *n as f64);
                let enough = used.is_some_and(|share| share > SETTLED || error <= finest);
                error = match used {
                    Some(share) => error * share.max(0.05).powf(ORDER),
                    None if found.gap < 1.5 * error => 1.02 * found.gap.max(error),
                    None => (error * found.gap.powi(2)).cbrt(),
                }
                .max(finest);
                done += n;
                progress(done as f64 / (3 * steps.iter().sum::<usize>()) as f64);
                if last {
                    covers.push(found);
                }
                if enough || attempt == 2 {
                    break;
                }
            }
            if !last {
                let next = steps[steps.len() - k - 2];
                error = (error * (*n as f64 / next as f64).powf(ORDER)).max(finest);
            }
        }
        covers
    }

    /// A cover with samples that fit `error`, or coarser ones where those would be too many.
    /// With `joined` balls that overlap no other are moved.
    pub(super) fn attempt(&mut self, error: f64, count: usize, joined: bool) -> Cover {
        let thin = if joined { f64::INFINITY } else { THIN * self.middle.radius };
        let mut balls = Balls::new(self.tree, (TOLERANCE * error).min(thin));
        balls.careful = !joined;
        let samples = self.samples(error);
        let wanted = Wanted { error, count, least: self.wish.smallest_radius };
        cover(&balls, &samples, (!joined).then_some(&self.middle), &wanted)
    }

    /// True if a cover is about the best that guesses find: nearly all balls were required, and joining them has
    /// left no gap.
    fn is_settled(&self, cover: &Cover) -> bool {
        let used = cover.enough.map_or(0.0, |m| m as f64 / self.count as f64);
        cover.error <= FINEST * self.tree.size || (used > SETTLED && cover.gap <= LEFT * cover.error)
    }

    /// The cover that leaves the surface nearest to its balls, as samples see it that are fine enough for all of them:
    /// those made for a larger error do not see all of what is left.
    pub(super) fn best(&mut self, covers: Vec<Cover>) -> Option<Cover> {
        let least = covers.iter().map(|c| c.gap).fold(f64::INFINITY, f64::min);
        let samples = self.samples(0.5 * least);
        let inside = |b: &Sphere| b.radius > 0.0 && self.tree.signed(&b.centre).0 < -0.5 * b.radius;
        let sound = |c: &Cover| !c.balls.is_empty() && c.balls.iter().all(inside);
        let seen = covers.into_iter().filter(sound);
        let seen = seen.map(|c| Cover { seen: furthest(&c.balls, &samples), ..c });
        seen.reduce(|a, b| if b.seen < a.seen { b } else { a })
    }

    /// Samples that fit `error` [m], or coarser ones where those would be too many.
    pub(super) fn samples(&mut self, error: f64) -> Vec<Sample> {
        self.at_most(error, DENSITY, most_samples(self.tree.surface, self.count))
    }

    /// Samples closer than a share of what a ball covers up to `error` [m], or coarser ones where those would be more
    /// than `most`.
    pub(super) fn at_most(&mut self, error: f64, share: f64, most: usize) -> Vec<Sample> {
        let error = error.max(1e-6 * self.tree.size);
        no_finer(error, |error| samples::corners(&mut self.sizes, error, share, most))
    }

    /// Growth of all balls [m].
    pub(super) fn growth(&self, balls: &[Sphere], gap: f64) -> f64 {
        match self.wish.fit {
            Fit::Inside => 0.0,
            Fit::Largest => 0.5 * gap,
            Fit::Volume if balls.is_empty() => 0.0,
            Fit::Volume => to_volume(self.tree.surface, balls, gap),
        }
    }
}

/// The largest distance of samples outside of all balls from them [m].
pub(super) fn furthest(balls: &[Sphere], samples: &[Sample]) -> f64 {
    SphereIndex::new(balls).furthest(samples.iter().map(|s| &s.point))
}

/// All balls grown by a length [m].
pub(super) fn larger(balls: &[Sphere], by: f64) -> Vec<Sphere> {
    balls.iter().map(|b| Sphere { radius: b.radius + by, ..*b }).collect()
}

/// The corners of the surface are samples in any case.
fn most_samples(surface: &Surface, count: usize) -> usize {
    (MOST_SAMPLES * count).max(20_000) + 2 * surface.points.len()
}

/// Growth with which all balls together have the solid's volume [m]: up to half of `gap` [m], and where that is
/// too little, in thin solids, up to the whole of it.
fn to_volume(surface: &Surface, balls: &[Sphere], gap: f64) -> f64 {
    let excess = |grown: f64| volume::excess(surface, &larger(balls, grown), COLUMNS);
    let half = 0.5 * gap;
    let (mut low, mut high) = ((0.0, excess(0.0)), (half, excess(half)));
    if low.1 >= 0.0 {
        return 0.0;
    }
    if high.1 <= 0.0 {
        (low, high) = (high, (gap, excess(gap)));
    }
    if high.1 <= 0.0 {
        return gap;
    }
    // The volume is nearly a parabola in the growth: a few steps of the false position do.
    for _ in 0..4 {
        let at = low.0 - low.1 * (high.0 - low.0) / (high.1 - low.1);
        let found = excess(at);
        if found < 0.0 { low = (at, found) } else { high = (at, found) }
    }
    low.0 - low.1 * (high.0 - low.0) / (high.1 - low.1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_spheres_at_one_place_one_stays_and_the_order_too() {
        let sphere = |x: f64, radius: f64| Sphere { centre: nalgebra::Vector3::new(x, 0.0, 0.0), radius };
        let spheres = vec![sphere(2.0, 1.0), sphere(1.0, 1.0), sphere(2.0, 1.0), sphere(2.0, 0.5)];
        assert_eq!(without_repeats(spheres), [sphere(2.0, 1.0), sphere(1.0, 1.0), sphere(2.0, 0.5)]);
    }
}
