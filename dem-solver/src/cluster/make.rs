//! A cluster of a given number of spheres, with the smallest error that the method reaches.
//!
//! The number of balls that a cover with error e takes grows a little faster than 1/e. The error for `n` balls is
//! found from covers with fewer balls, each a guess for the next; the best cover with at most `n` is filled up
//! to `n` where its gap is largest. At last all balls grow alike, up to half the gap, so that they reach out
//! of the solid as the solid reaches out of them ([`Fit`]).
//!
//! A round surface is covered down to the chords of its triangles by fewer balls than may be asked for: a sphere
//! by one. There are as many as asked for where edges are left to cover.

use super::ball::Balls;
use super::cover::{Cover, cover};
use super::index::SphereIndex;
use super::samples::Sizes;
use super::{samples, volume};
use crate::rock::Sphere;
use crate::shape::Surface;
use crate::shape::tree::SurfaceTree;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Samples are closer than this share of what one ball covers.
const DENSITY: f64 = 0.4;
/// Columns along each side with which the volume is compared on the way.
const COLUMNS: usize = 96;
/// With so many more balls the error goes down: as `n^-ORDER`. A guess to begin with; what is reached is measured.
const ORDER: f64 = 0.8;
/// Balls may be smaller than the largest by this share of the error.
const TOLERANCE: f64 = 0.02;
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
    let mut sizes = Sizes::new(&tree, surface.size());
    let finest = Balls::new(&tree, surface.size(), 0.0).finest();
    let count = wish.spheres.max(1) as usize;
    let mut steps = vec![count];
    while let Some(last) = steps.last().filter(|n| **n > 30) {
        steps.push(last / 6);
    }
    // A single ball leaves about a third of the size; from there on a guess follows from the last.
    let mut error = 0.3 * surface.size() / (*steps.last().unwrap_or(&1) as f64).powf(ORDER);
    let mut done = 0;
    let mut covers: Vec<Cover> = Vec::new();
    for (k, n) in steps.iter().rev().enumerate() {
        let last = k + 1 == steps.len();
        for attempt in 0..3 {
            let found = attempt_cover(surface, &tree, &mut sizes, error, *n, wish.smallest_radius);
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
    progress(1.0);
    let Cover { mut balls, gap, .. } = best(surface, &mut sizes, covers, count);
    let grown = match wish.fit {
        Fit::Inside => 0.0,
        Fit::Largest => 0.5 * gap,
        Fit::Volume => to_volume(surface, &balls, 0.5 * gap),
    };
    balls.iter_mut().for_each(|b| b.radius += grown);
    balls
}

/// The cover that leaves the surface nearest to its balls, as samples see it that are fine enough for all of them: those
/// made for a larger error do not see all of what is left. Its gap is what they see.
fn best(surface: &Surface, sizes: &mut Sizes, covers: Vec<Cover>, count: usize) -> Cover {
    let mut error =
        0.5 * covers.iter().map(|c| c.gap).fold(f64::INFINITY, f64::min).max(1e-6 * surface.size());
    let samples = loop {
        if let Some(samples) = samples::corners(surface, sizes, error, DENSITY, most_samples(surface, count))
        {
            break samples;
        }
        error *= 1.5;
    };
    let seen = |cover: Cover| {
        let index = SphereIndex::new(&cover.balls);
        let gap = samples.points.iter().map(|p| index.nearest(p).0).fold(0.0, f64::max);
        Cover { gap, ..cover }
    };
    let none = Cover { balls: Vec::new(), gap: 0.0, enough: None };
    let better = |a: Cover, b: Cover| if b.gap < a.gap { b } else { a };
    covers.into_iter().filter(|c| !c.balls.is_empty()).map(seen).reduce(better).unwrap_or(none)
}

/// The corners of the surface are samples in any case.
fn most_samples(surface: &Surface, count: usize) -> usize {
    (MOST_SAMPLES * count).max(20_000) + 2 * surface.points.len()
}

/// How far all balls must grow to have the solid's volume together, up to `most` [m].
fn to_volume(surface: &Surface, balls: &[Sphere], most: f64) -> f64 {
    let excess = |grown: f64| {
        let larger: Vec<Sphere> = balls.iter().map(|b| Sphere { radius: b.radius + grown, ..*b }).collect();
        volume::excess(surface, &larger, COLUMNS)
    };
    let (mut low, mut high) = ((0.0, excess(0.0)), (most, excess(most)));
    if high.1 <= 0.0 || low.1 >= 0.0 {
        return if high.1 <= 0.0 { most } else { 0.0 };
    }
    // The volume is nearly a parabola in the growth: a few steps of the false position do.
    for _ in 0..4 {
        let at = low.0 - low.1 * (high.0 - low.0) / (high.1 - low.1);
        let found = excess(at);
        if found < 0.0 { low = (at, found) } else { high = (at, found) }
    }
    low.0 - low.1 * (high.0 - low.0) / (high.1 - low.1)
}

/// A cover by `count` balls with samples that fit `error`, or coarser ones where those would be too many.
fn attempt_cover(
    surface: &Surface,
    tree: &SurfaceTree,
    sizes: &mut Sizes,
    error: f64,
    count: usize,
    least: f64,
) -> Cover {
    let balls = Balls::new(tree, surface.size(), TOLERANCE * error);
    let mut coarse = error;
    let most = most_samples(surface, count);
    loop {
        if let Some(samples) = samples::corners(surface, sizes, coarse, DENSITY, most) {
            return cover(&balls, &samples, error, count, least);
        }
        coarse *= 1.5;
    }
}
