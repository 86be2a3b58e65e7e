//! Better clusters of as many spheres: those that few would miss are taken out, and put where the error is largest.
//!
//! A cover is made for the gaps that samples see before its balls grow. What is measured at last are the gaps that are left
//! then, and the depth of pits between spheres; here both decide.

use super::ball::Balls;
use super::best::{Best, FINE};
use super::index::SphereIndex;
use super::make::{Maker, larger};
use super::probe::{Place, apart};
use super::samples::Samples;
use super::seen::ViewOfSurface;
use crate::geometry::sphere::Sphere;

/// Share of the spheres that is moved in a round, in so many batches; after a round that is no better, so many times fewer.
const MOVED: f64 = 0.1;
const BATCHES: usize = 4;
const FEWER: f64 = 3.0;
/// Most rounds in a row of the fewest that are no better.
const VAIN: usize = 2;
/// Share of these that goes to places that were found when the best cluster was measured.
const KNOWN: f64 = 0.5;
/// Most rounds, for clusters of up to so many spheres.
const ROUNDS: [(usize, usize); 3] = [(500, 5), (2000, 3), (6000, 2)];
/// Share of the error that a new ball leaves at the place it is made for.
const SHARE: f64 = 0.5;

/// Most rounds for a cluster of `count` spheres.
pub(super) fn rounds(count: usize) -> usize {
    ROUNDS.iter().find(|(most, _)| count <= *most).map_or(0, |(_, rounds)| *rounds)
}

impl Maker<'_> {
    /// Move spheres of the best cluster to where its error is largest, as long as that makes it better.
    pub(super) fn refine(&self, samples: &Samples, best: &mut Best, mut balls: Vec<Sphere>) {
        let (mut share, mut vain) = (MOVED, 0);
        for _ in 0..rounds(self.count) {
            let tried = self.moved(samples, &balls, share, best, vain == 0);
            let gap = super::make::furthest(&tried, samples);
            if best.add_grown(&tried, gap, 1.0) {
                (balls, vain) = (tried, 0);
            } else if share * (balls.len() as f64) > 1.0 {
                share /= FEWER;
            } else {
                // Some steps on from a place that is no better may lead to one that is.
                (balls, vain) = (tried, vain + 1);
            }
            if vain == VAIN {
                break;
            }
        }
    }

    /// The balls with a share of them moved; whether they are the `known` best ones, of which it is known where they are worst.
    fn moved(
        &self,
        samples: &Samples,
        balls: &[Sphere],
        share: f64,
        best: &Best,
        known: bool,
    ) -> Vec<Sphere> {
        let many = ((share * balls.len() as f64).ceil() as usize).min(balls.len() / 2);
        let mut kept = without(balls, samples, many);
        let all = Balls::new(self.tree, self.surface.size(), FINE * self.middle.radius);
        let mut view = ViewOfSurface::new(self.tree, samples, &larger(&kept, best.grown));
        // First where it is known to be worst, which between samples none of them sees.
        let mut places = apart(&best.places, if known { KNOWN * many as f64 } else { 0.0 });
        for batch in 0..=BATCHES {
            let before = kept.len();
            let missing = self.count.saturating_sub(before);
            if batch > 0 {
                places = view.worst(missing.div_ceil(BATCHES + 1 - batch));
            }
            for Place { point, inward, depth } in places.drain(..).take(missing) {
                let found = all.near(&point, &inward, SHARE * depth, self.wish.smallest_radius);
                kept.extend(found.filter(|b| b.radius > 0.0 && b.radius >= self.wish.smallest_radius));
            }
            view.add(&larger(&kept[before..], best.grown));
        }
        kept
    }
}

/// The balls without those `many` whose places others come nearest to.
fn without(balls: &[Sphere], samples: &Samples, many: usize) -> Vec<Sphere> {
    let index = SphereIndex::new(balls);
    // How far samples would lie from all others, for each ball the most of those that are nearest to it.
    let mut required = vec![f64::NEG_INFINITY; balls.len()];
    for p in &samples.points {
        let [(_, near), (other, _)] = index.nearest_two(p);
        let place = index.place(near);
        required[place] = required[place].max(other);
    }
    let mut order: Vec<usize> = (0..balls.len()).collect();
    order.sort_by(|a, b| required[*a].total_cmp(&required[*b]).then(a.cmp(b)));
    // Of two that lie in each other both seem to be of no use: the second one stays.
    let mut out = vec![false; balls.len()];
    let mut gone: Vec<usize> = Vec::new();
    for k in order {
        if gone.len() == many {
            break;
        }
        let near = |other: &usize| {
            let (a, b) = (&balls[k], &balls[*other]);
            (a.centre - b.centre).norm_squared() < (a.radius + b.radius).powi(2) / 4.0
        };
        if !gone.iter().any(near) {
            gone.push(k);
            out[k] = true;
        }
    }
    balls.iter().zip(out).filter(|(_, out)| !out).map(|(ball, _)| *ball).collect()
}
