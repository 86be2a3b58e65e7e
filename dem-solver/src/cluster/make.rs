//! A cluster of a given number of spheres, with the smallest error that the method reaches.
//!
//! The number of balls that a cover with error e takes grows about as 1/e. The error for `n` balls is
//! found from covers with fewer balls, each a guess for the next; the best cover with at most `n` is filled up
//! to `n` where its gap is largest. At last all balls grow by half the gap, so that they reach out
//! of the solid as far as the solid out of them: the error is halved ([`Fit::Inside`] leaves that out).

use super::ball::Balls;
use super::cover::{Cover, cover};
use super::samples;
use crate::rock::Sphere;
use crate::shape::Surface;
use crate::shape::tree::SurfaceTree;
use serde::{Deserialize, Serialize};

/// Samples are closer than this share of what one ball covers.
const DENSITY: f64 = 0.45;
/// Most samples of a cover, and of one that is only a guess for the next.
const MOST_SAMPLES: usize = 4_000_000;

/// Where the spheres end.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Fit {
    /// As far outside of the solid as inside: the smallest error.
    #[default]
    Balanced,
    /// Never outside of the solid.
    Inside,
}

/// What a cluster is to be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wish {
    /// Number of spheres.
    pub spheres: u32,
    /// Where they end.
    pub fit: Fit,
    /// Least radius where the solid has room for it [m]. 0: as the error asks for.
    pub smallest_radius: f64,
}

/// The spheres [m, in the surface's axes] and the share done (0 to 1) on the way.
pub fn make(surface: &Surface, wish: &Wish, mut progress: impl FnMut(f64)) -> Vec<Sphere> {
    let tree = SurfaceTree::new(surface);
    let balls = Balls::new(&tree, surface.size());
    let count = wish.spheres.max(1) as usize;
    let mut steps = vec![count];
    while let Some(last) = steps.last().filter(|n| **n > 200) {
        steps.push(last / 6);
    }
    // A single ball leaves about a third of the size; from there on a guess follows from the last.
    let mut error = 0.3 * surface.size() / (*steps.last().unwrap_or(&1) as f64);
    let mut done = 0;
    let mut best: Option<Cover> = None;
    for (k, n) in steps.iter().rev().enumerate() {
        let last = k + 1 == steps.len();
        for attempt in 0..3 {
            let found = attempt_cover(surface, &balls, error, *n, wish.smallest_radius);
            // A cover with as many as asked for, or nearly so, is near the best.
            let used = found.enough.map(|m| m as f64 / *n as f64);
            error = match used {
                Some(share) => error * share.max(0.05).powf(0.9),
                None => (error * found.gap.max(error)).sqrt(),
            };
            done += n;
            progress(done as f64 / (3 * steps.iter().sum::<usize>()) as f64);
            if last && best.as_ref().is_none_or(|b| found.gap < b.gap) {
                best = Some(found);
            }
            if used.is_some_and(|share| share > 0.93) || attempt == 2 {
                break;
            }
        }
        if !last {
            let next = steps[steps.len() - k - 2];
            error *= (*n as f64 / next as f64).powf(0.92);
        }
    }
    progress(1.0);
    let Cover { mut balls, gap, .. } = best.unwrap_or(Cover { balls: Vec::new(), gap: 0.0, enough: None });
    if wish.fit == Fit::Balanced {
        balls.iter_mut().for_each(|b| b.radius += 0.5 * gap);
    }
    balls
}

/// A cover by `count` balls with samples that fit `error`, or coarser ones where those would be too many.
fn attempt_cover(surface: &Surface, balls: &Balls, error: f64, count: usize, least: f64) -> Cover {
    let mut coarse = error;
    loop {
        if let Some(samples) = samples::corners(surface, balls, coarse, DENSITY, MOST_SAMPLES) {
            return cover(balls, &samples, error, count, least);
        }
        coarse *= 2.0;
    }
}
