//! Better clusters of as many spheres: those that few would miss are taken out, and put where the error is largest.
//!
//! A cover is made for the gaps that samples see before its balls grow. What is measured at last are the gaps that are left
//! then, and the depth of pits between spheres; here both decide.

use super::ball::Balls;
use super::even::Best;
use super::index::SphereIndex;
use super::make::{Maker, larger};
use super::samples::Samples;
use super::seen::{Place, View};
use crate::rock::Sphere;

/// Share of the spheres that is moved in a round, in so many batches, and most rounds in a row that are no better.
const MOVED: f64 = 0.1;
const BATCHES: usize = 4;
const VAIN: usize = 2;
/// Most rounds, for clusters of up to so many spheres.
const ROUNDS: [(usize, usize); 3] = [(500, 4), (2000, 2), (6000, 1)];
/// Share of the error that a new ball leaves at the place it is made for.
const SHARE: f64 = 0.5;

impl Maker<'_> {
    /// Move spheres of the best cluster to where its error is largest, as long as that makes it better.
    pub(super) fn refine(&self, samples: &Samples, best: &mut Best, mut balls: Vec<Sphere>) {
        let rounds = ROUNDS.iter().find(|(most, _)| self.count <= *most).map_or(0, |(_, rounds)| *rounds);
        let mut vain = 0;
        for _ in 0..rounds {
            let tried = self.moved(samples, &balls, best.grown);
            let gap = super::make::furthest(&tried, samples);
            if best.add_grown(&tried, gap, 1.0) {
                (balls, vain) = (tried, 0);
            } else {
                vain += 1;
                balls = tried;
            }
            if vain == VAIN {
                break;
            }
        }
    }

    /// The balls with some of them moved; all of them grow by `grown` [m].
    fn moved(&self, samples: &Samples, balls: &[Sphere], grown: f64) -> Vec<Sphere> {
        let many = ((MOVED * balls.len() as f64).ceil() as usize).min(balls.len() / 2);
        let mut kept = without(balls, samples, many);
        let all = Balls::new(self.tree, self.surface.size(), super::even::FINE * self.middle.radius);
        let mut view = View::new(self.tree, samples, &larger(&kept, grown));
        for batch in 0..BATCHES {
            let before = kept.len();
            let missing = self.count.saturating_sub(before).div_ceil(BATCHES - batch);
            for Place { point, inward, depth } in view.worst(missing) {
                let found = all.near(&point, &inward, SHARE * depth, self.wish.smallest_radius);
                kept.extend(found.filter(|b| b.radius > 0.0 && b.radius >= self.wish.smallest_radius));
            }
            view.add(&larger(&kept[before..], grown));
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
