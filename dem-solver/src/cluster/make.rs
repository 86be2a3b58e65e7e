//! A cluster of a given number of spheres, with the smallest error that the method reaches.
//!
//! The number of balls that a cover with error e takes grows a little faster than 1/e. The error for `n` balls is
//! found from covers with fewer balls, each a guess for the next; the best cover with at most `n` is filled up
//! to `n` where its gap is largest. At last all balls grow alike, up to half the gap, so that they reach out
//! of the solid as the solid reaches out of them ([`Fit`]).
//!
//! A guess that is too small spends all balls on one part of the solid, and balls that overlap no other are put beside
//! one that they do overlap: in plates, bars and limbs, where few balls leave gaps as large as the solid is
//! thick, nothing good is left of such a cover. There the error is sought again between bounds, balls are moved to the
//! middle of what they cover, and joined only when it is known how far they grow; what is measured to be best is taken.
//!
//! A round surface is covered down to the chords of its triangles by fewer balls than may be asked for: a sphere
//! by one. There are as many as asked for where edges are left to cover.

use super::Accuracy;
use super::ball::Balls;
use super::bound::VOLUME;
use super::cover::{self, Cover, Wanted, cover};
use super::files;
use super::index::SphereIndex;
use super::samples::{Samples, Sizes};
use super::{samples, volume};
use crate::rock::Sphere;
use crate::shape::Surface;
use crate::shape::tree::SurfaceTree;
use nalgebra::Vector3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Samples are closer than this share of what one ball covers.
const DENSITY: f64 = 0.4;
/// Columns along each side with which the volume is compared on the way.
const COLUMNS: usize = 96;
/// With so many more balls the error goes down: as `n^-ORDER`. A guess to begin with; what is reached is measured.
const ORDER: f64 = 0.8;
/// Balls may be smaller than the largest by this share of the error, and of the largest ball.
const TOLERANCE: f64 = 0.02;
const THIN: f64 = 0.05;
/// Gaps of more than this share of the radius of the largest ball ask for a second search.
const COARSE: f64 = 0.5;
/// Covers of the second search, and how near its bounds come to each other.
const MOST_COVERS: usize = 12;
const NEAR: f64 = 1.05;
/// Most times that balls are moved to the middle of what they cover, and steps towards that middle.
const MOST_ROUNDS: usize = 30;
const MOST_STEPS: u32 = 60;
/// Balls overlap if they are nearer than this share of the sum of their radii.
const BARELY: f64 = 0.97;
/// Most samples for each ball: on a smooth solid a guess of the error may be far too small.
const MOST_SAMPLES: usize = 100;

/// Where the spheres end.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Fit {
    /// As much outside of the solid as lacks inside: together they have the solid's volume.
    #[default]
    Volume,
    /// As far outside of the solid as inside: the smallest largest error; too much volume.
    Largest,
    /// Never outside of the solid: too little volume.
    Inside,
}

/// What a cluster is to be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wish {
    /// Number of spheres.
    pub spheres: u32,
    /// Where they end.
    pub fit: Fit,
    /// Least radius [m]; what only smaller ones could reach stays uncovered. 0: as the error asks for.
    pub smallest_radius: f64,
}

/// The spheres [m, in the surface's axes] and the share done (0 to 1) on the way.
pub fn make(surface: &Surface, wish: &Wish, mut progress: impl FnMut(f64)) -> Vec<Sphere> {
    let tree = SurfaceTree::new(surface);
    let count = wish.spheres.max(1) as usize;
    let middle = largest(surface, &tree);
    let thick = middle.radius;
    let sizes = Sizes::new(&tree, surface.size()).trusting();
    let mut maker = Maker { surface, tree: &tree, sizes, middle, count, wish };
    let covers = maker.by_guesses(&mut progress);
    let found = maker.best(covers);
    progress(1.0);
    // Samples that see thin parts too.
    maker.sizes = Sizes::new(&tree, surface.size());
    let seen = maker.seen(&found);
    if !found.balls.is_empty() && seen <= COARSE * thick && seen <= 2.0 * found.gap {
        let grown = maker.growth(&found.balls, found.gap);
        return larger(&found.balls, grown);
    }
    maker.coarse(found)
}

/// About the largest ball in the solid inside `surface`, with the tree `tree`.
pub fn largest(surface: &Surface, tree: &SurfaceTree) -> Sphere {
    let size = surface.size();
    let mut sizes = Sizes::new(tree, size);
    let balls = Balls::new(tree, size, 1e-6 * size);
    let mut error = 0.05 * size;
    loop {
        if let Some(found) = samples::corners(surface, &mut sizes, error, 0.9, most_samples(surface, 1)) {
            let nothing = Sphere { centre: found.points[0], radius: 0.0 };
            return cover::largest(&balls, &found).unwrap_or(nothing);
        }
        error *= 1.5;
    }
}

/// What a cluster is made of.
struct Maker<'a> {
    surface: &'a Surface,
    tree: &'a SurfaceTree,
    sizes: Sizes<'a>,
    /// About the largest ball.
    middle: Sphere,
    count: usize,
    wish: &'a Wish,
}

impl Maker<'_> {
    /// Covers with errors that follow from those of fewer balls.
    fn by_guesses(&mut self, progress: &mut impl FnMut(f64)) -> Vec<Cover> {
        let size = self.surface.size();
        let finest = Balls::new(self.tree, size, 0.0).finest();
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
                let enough = used.is_some_and(|share| share > 0.93 || error <= finest);
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

    /// Covers with errors between one for which a ball is enough and one for which all are too few, until these two
    /// are near each other. Balls that overlap no other stay where they are.
    fn evenly(&mut self) -> Vec<Cover> {
        let (mut few, mut enough) = (0.0, f64::INFINITY);
        let mut error = 0.5 * self.surface.size();
        let mut covers: Vec<Cover> = Vec::new();
        while covers.len() < MOST_COVERS && enough > NEAR * few {
            let found = self.attempt(error, self.count, false);
            match found.enough {
                Some(_) => enough = error,
                None => few = error,
            }
            let share = found.enough.map_or(1.0, |m| m as f64 / self.count as f64);
            covers.push(found);
            if (0.97..1.0).contains(&share) {
                break;
            }
            error = match (few > 0.0, enough.is_finite()) {
                (true, true) => (few * enough).sqrt(),
                (true, false) => 2.0 * error,
                // Of order -1/2 or steeper: not below what is sought.
                _ => error * share.sqrt().clamp(0.3, 0.9),
            };
        }
        covers
    }

    /// A cover with samples that fit `error`, or coarser ones where those would be too many.
    /// With `joined` balls that overlap no other are moved.
    fn attempt(&mut self, error: f64, count: usize, joined: bool) -> Cover {
        let thin = if joined { f64::INFINITY } else { THIN * self.middle.radius };
        let tolerance = (TOLERANCE * error).min(thin);
        let balls = Balls::new(self.tree, self.surface.size(), tolerance);
        let balls = if joined { balls.trusting() } else { balls };
        let samples = self.samples(error);
        let wanted = Wanted { error, count, least: self.wish.smallest_radius, joined };
        cover(&balls, &samples, (!joined).then_some(&self.middle), &wanted)
    }

    /// The cover that leaves the surface nearest to its balls, as samples see it that are fine enough for all of them:
    /// those made for a larger error do not see all of what is left. Its gap is what they see.
    fn best(&mut self, covers: Vec<Cover>) -> Cover {
        let least = covers.iter().map(|c| c.gap).fold(f64::INFINITY, f64::min);
        let samples = self.samples(0.5 * least);
        let seen = |cover: Cover| {
            let index = SphereIndex::new(&cover.balls);
            let gap = samples.points.iter().map(|p| index.nearest(p).0).fold(0.0, f64::max);
            Cover { gap, ..cover }
        };
        let none = Cover { balls: Vec::new(), gap: 0.0, enough: None };
        let better = |a: Cover, b: Cover| if b.gap < a.gap { b } else { a };
        let inside = |b: &Sphere| b.radius > 0.0 && self.tree.signed(&b.centre).0 < -0.5 * b.radius;
        let sound = |c: &Cover| !c.balls.is_empty() && c.balls.iter().all(inside);
        covers.into_iter().filter(sound).map(seen).reduce(better).unwrap_or(none)
    }

    /// Move every ball to the middle of the samples that are nearest to it, where that brings them nearer.
    fn relax(&mut self, cover: &mut Cover) {
        if cover.balls.is_empty() {
            return;
        }
        let samples = self.samples(0.5 * cover.gap);
        let balls = Balls::new(self.tree, self.surface.size(), THIN * THIN * self.middle.radius);
        let least = self.wish.smallest_radius;
        for _ in 0..MOST_ROUNDS {
            let index = SphereIndex::new(&cover.balls);
            let mut own: Vec<Vec<Vector3<f64>>> = vec![Vec::new(); cover.balls.len()];
            let mut gap = 0.0_f64;
            for p in &samples.points {
                let (distance, near) = index.nearest(p);
                gap = gap.max(distance);
                own[index.place(near)].push(*p);
            }
            cover.gap = gap;
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
            let index = SphereIndex::new(&moved);
            let after = samples.points.iter().map(|p| index.nearest(p).0).fold(0.0, f64::max);
            if after >= gap {
                break;
            }
            (cover.balls, cover.gap) = (moved, after);
        }
    }

    /// The largest distance of samples from the balls of a cover [m].
    fn seen(&mut self, cover: &Cover) -> f64 {
        if cover.balls.is_empty() {
            return f64::INFINITY;
        }
        let index = SphereIndex::new(&cover.balls);
        let samples = self.samples(cover.gap);
        samples.points.iter().map(|p| index.nearest(p).0).fold(0.0, f64::max)
    }

    /// Samples that fit `error` [m], or coarser ones where those would be too many.
    fn samples(&mut self, error: f64) -> Samples {
        let mut error = error.max(1e-6 * self.surface.size());
        let most = most_samples(self.surface, self.count);
        loop {
            match samples::corners(self.surface, &mut self.sizes, error, DENSITY, most) {
                Some(found) => return found,
                None => error *= 1.5,
            }
        }
    }

    /// The best of few balls: of those found by guesses, of evenly spread ones, and of those moved to the middle of
    /// what they cover, as measured when they are grown.
    fn coarse(&mut self, guessed: Cover) -> Vec<Sphere> {
        let covers = self.evenly();
        let even = self.best(covers);
        let mut relaxed = even.clone();
        self.relax(&mut relaxed);
        let mut best: Option<(f64, Vec<Sphere>)> = None;
        for cover in [guessed, even, relaxed] {
            for joined in [self.joined_by_moving(&cover), self.joined_by_growing(&cover)] {
                if joined.is_empty() {
                    continue;
                }
                let found = Accuracy::of(self.surface, &joined);
                let doubt = match self.wish.fit {
                    Fit::Volume => 1.0 + (found.volume.abs() - 0.01).max(0.0) / VOLUME,
                    _ => 1.0,
                } * files::groups(&joined) as f64;
                let error = found.largest() * doubt;
                if best.as_ref().is_none_or(|(least, _)| error < *least) {
                    best = Some((error, joined));
                }
            }
        }
        best.map_or_else(|| vec![self.middle], |(_, balls)| balls)
    }

    /// The balls of a cover, grown as the fit asks for; those that overlap no other then are moved towards others.
    fn joined_by_moving(&self, cover: &Cover) -> Vec<Sphere> {
        let balls = Balls::new(self.tree, self.surface.size(), THIN * THIN * self.middle.radius);
        let mut moved = cover.balls.clone();
        let grown = self.growth(&moved, cover.gap);
        if join(&balls, &mut moved, grown, self.wish.smallest_radius) == 0 {
            return larger(&moved, grown);
        }
        let grown = self.growth(&moved, cover.gap);
        larger(&moved, grown)
    }

    /// The balls of a cover, grown as the fit asks for, and on up to the gap while they are not joined.
    fn joined_by_growing(&self, cover: &Cover) -> Vec<Sphere> {
        let grown = self.growth(&cover.balls, cover.gap);
        let apart = |by: f64| files::groups(&larger(&cover.balls, by)) > 1;
        if self.wish.fit == Fit::Inside || !apart(grown) || apart(cover.gap) {
            return larger(&cover.balls, grown);
        }
        let (mut few, mut enough) = (grown, cover.gap);
        while enough - few > 1e-3 * cover.gap {
            let half = 0.5 * (few + enough);
            if apart(half) { few = half } else { enough = half }
        }
        larger(&cover.balls, enough)
    }

    /// How far all balls grow [m].
    fn growth(&self, balls: &[Sphere], gap: f64) -> f64 {
        match self.wish.fit {
            Fit::Inside => 0.0,
            Fit::Largest => 0.5 * gap,
            Fit::Volume if balls.is_empty() => 0.0,
            Fit::Volume => to_volume(self.surface, balls, gap),
        }
    }
}

fn larger(balls: &[Sphere], by: f64) -> Vec<Sphere> {
    balls.iter().map(|b| Sphere { radius: b.radius + by, ..*b }).collect()
}

/// Move balls that overlap no other when all have grown by `grown` [m] towards the nearest one that is joined to the first,
/// inside the solid, until they do. How many were moved.
fn join(balls: &Balls, chosen: &mut [Sphere], grown: f64, least: f64) -> usize {
    let overlap = |a: &Sphere, b: &Sphere| {
        let sum = BARELY * (a.radius + b.radius + 2.0 * grown);
        (a.centre - b.centre).norm_squared() < sum * sum
    };
    let mut apart: Vec<usize> = (1..chosen.len()).collect();
    let mut linked: Vec<usize> = chosen.first().map_or(vec![], |_| vec![0]);
    let (mut next, mut moved) = (0, 0);
    loop {
        while next < linked.len() {
            let here = chosen[linked[next]];
            next += 1;
            let (found, rest) = apart.iter().partition(|other| overlap(&here, &chosen[**other]));
            linked.extend::<Vec<usize>>(found);
            apart = rest;
        }
        let away = |k: usize, other: usize| {
            let (a, b): (&Sphere, &Sphere) = (&chosen[k], &chosen[other]);
            (a.centre - b.centre).norm() - a.radius - b.radius
        };
        let pairs = apart.iter().flat_map(|k| linked.iter().map(|other| (*k, *other)));
        let Some((k, host)) = pairs.min_by(|a, b| away(a.0, a.1).total_cmp(&away(b.0, b.1))) else {
            return moved;
        };
        let (from, to) = (chosen[k].centre, chosen[host].centre);
        for step in 1..MOST_STEPS {
            let share = f64::from(step) / f64::from(MOST_STEPS);
            let Some(ball) = balls.around(&(from + (to - from) * share)) else { continue };
            if ball.radius > least && overlap(&ball, &chosen[host]) {
                chosen[k] = ball;
                moved += 1;
                break;
            }
        }
        apart.retain(|other| *other != k);
        linked.push(k);
    }
}

/// The corners of the surface are samples in any case.
fn most_samples(surface: &Surface, count: usize) -> usize {
    (MOST_SAMPLES * count).max(20_000) + 2 * surface.points.len()
}

/// How far all balls must grow to have the solid's volume together: up to half of `gap` [m], and where that is
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
