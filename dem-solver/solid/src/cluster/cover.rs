//! Balls in the solid, until no sample of its surface lies further outside of them than an error.
//!
//! Greedy: the sample that lies furthest outside gets the largest ball that comes near enough to it.
//! "Near enough" is half the error: of an edge that halves the length to cover with the largest balls
//! (a ball of radius 2.4 g leaves a gap g at a right-angled edge and covers `sqrt(g (e - g))` along it,
//! which is most at g = e/2).
//!
//! The idea, spheres of the medial axis placed where the error is largest, is that of Bradshaw and
//! O'Sullivan (2004), ACM Trans. Graph. 23, 1, and of Hubbard (1996), ACM Trans. Graph. 15, 179; they merge
//! and burst the balls of a Voronoi diagram of surface points, here balls are grown where they are needed.

use super::ball::{Balls, FINEST};
use super::gaps::{Gaps, left_by};
use super::samples::Sample;
use crate::geometry::sphere::Sphere;

/// Share of the error that a new ball leaves at the sample it is made for.
const SHARE: f64 = 0.5;

/// A ball lies nearer to another than this share of the sum of their radii.
const OVERLAP: f64 = 0.9;

/// One that could not be moved may stay where it is if it is nearer than this share.
const BARELY: f64 = 0.99;

/// Steps inwards in search of a ball that overlaps another.
const MOST_STEPS: u32 = 40;

/// Balls in the solid and what they leave.
#[derive(Debug, Clone)]
pub struct Cover {
    /// The balls, none of which reaches out of the solid.
    pub balls: Vec<Sphere>,
    /// The furthest that a sample lies outside of all [m], but for those that no ball can help.
    pub gap: f64,
    /// The same as finer samples see it, once they have been asked [m].
    pub seen: f64,
    /// Balls after which no sample lay further outside than the error that was asked for.
    pub enough: Option<usize>,
    /// That error [m].
    pub error: f64,
}

/// What a cover is to be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wanted {
    /// Every sample is to lie within this distance [m].
    pub error: f64,
    /// Number of balls.
    pub count: usize,
    /// No ball is smaller [m], but for the first.
    pub least: f64,
}

/// A ball is about the largest if it has this share of its radius.
const ABOUT: f64 = 0.7;

/// Exactly `count` balls (fewer only where nothing is left to cover, [`FINEST`]): first until every sample lies
/// within the error, then on where the gap is largest. `middle` is the first ball where samples may be too few
/// to find the largest: all may lie at corners, where no ball is large. Without it balls smaller than the tolerance, with
/// a radius below 0, are not left out: such a cover is no good, but one for fewer balls may lead to a good one; and balls that overlap no
/// other are moved until they do.
pub fn cover(balls: &Balls, samples: &[Sample], middle: Option<&Sphere>, wanted: &Wanted) -> Cover {
    let Wanted { error, count, least } = *wanted;
    let mut gaps = Gaps::new(samples);
    let mut chosen: Vec<Sphere> = Vec::with_capacity(count);
    let about = middle.map_or(f64::NEG_INFINITY, |ball| ABOUT * ball.radius);
    let first = largest(balls, samples).filter(|ball| ball.radius > about).or(middle.copied());
    if let Some(first) = first {
        gaps.add(&first);
        chosen.push(first);
    }
    let mut made_for = vec![0; chosen.len()];
    let mut enough = None;
    let mut helpless = Vec::new();
    while chosen.len() < count {
        let (gap, number) = gaps.largest();
        if gap <= error && enough.is_none() {
            enough = Some(chosen.len());
        }
        if gap <= FINEST * balls.tree.size {
            break;
        }
        let (wish, sample) = (SHARE * error.min(gap), &samples[number]);
        let large = |ball: &Sphere| ball.radius >= least && (middle.is_none() || ball.radius > 0.0);
        if let Some(ball) = balls.near(&sample.point, &sample.inward, wish, least).filter(large) {
            let (left, larger) = (left_by(sample, &ball), ball.radius > 2.0 * least);
            // It must help by more than rounding, or the same sample would come again for ever.
            if left < gap * if larger { 0.999 } else { 0.8 } {
                gaps.add(&ball);
                chosen.push(ball);
                made_for.push(number);
                // A ball that must be larger than the gap asks for leaves its sample as it is.
                if left <= wish * (1.0 + 1e-9) || larger {
                    continue;
                }
            }
        }
        helpless.push(number);
        gaps.give_up(number, &sample.point);
    }
    if middle.is_none() && connect(balls, samples, &mut chosen, &made_for, least) > 0 {
        gaps = Gaps::new(samples);
        chosen.iter().for_each(|ball| gaps.add(ball));
        helpless.iter().for_each(|number| gaps.give_up(*number, &samples[*number].point));
    }
    let gap = gaps.largest().0.max(0.0);
    Cover { balls: chosen, gap, seen: gap, enough, error }
}

/// Link balls that overlap, beginning with the first; `bring` moves one of those `apart` to those `linked`, and says which. How
/// many were moved.
pub fn link(
    balls: &mut [Sphere],
    overlap: impl Fn(&Sphere, &Sphere) -> bool,
    mut bring: impl FnMut(&mut [Sphere], &[usize], &[usize]) -> usize,
) -> usize {
    let mut apart: Vec<usize> = (1..balls.len()).collect();
    let mut linked = vec![0];
    let (mut next, mut moved) = (0, 0);
    loop {
        while let Some(&k) = linked.get(next) {
            linked.extend(apart.extract_if(.., |other| overlap(&balls[k], &balls[*other])));
            next += 1;
        }
        if apart.is_empty() {
            return moved;
        }
        let k = bring(balls, &apart, &linked);
        apart.retain(|other| *other != k);
        linked.push(k);
        moved += 1;
    }
}

/// Put balls that overlap no other (the last ones in pointed corners) further inside, until they do: between
/// spheres that only touch a thin wire falls through. How many were moved.
fn connect(balls: &Balls, samples: &[Sample], chosen: &mut [Sphere], origin: &[usize], least: f64) -> usize {
    let within = |a: &Sphere, b: &Sphere, share: f64| {
        let sum = share * (a.radius + b.radius);
        (a.centre - b.centre).norm_squared() < sum * sum
    };
    let overlap = |a: &Sphere, b: &Sphere| within(a, b, OVERLAP);
    link(chosen, overlap, |chosen, apart, linked| {
        let k = apart[0];
        let Sample { point: at, inward, .. } = &samples[origin[k]];
        let away = |other: &usize| (chosen[*other].centre - at).norm() - chosen[*other].radius;
        let next_to = linked.iter().copied().min_by(|a, b| away(a).total_cmp(&away(b)));
        let next_to = next_to.expect("the first is linked");
        let nearest = away(&next_to);
        let wishes = (1..MOST_STEPS).map(|step| nearest * f64::from(step) / f64::from(MOST_STEPS));
        let mut tried = wishes.filter_map(|wish| balls.near(at, inward, wish, least));
        if let Some(ball) = tried.find(|ball| linked.iter().any(|other| overlap(ball, &chosen[*other]))) {
            chosen[k] = ball;
        }
        if !linked.iter().any(|other| within(&chosen[k], &chosen[*other], BARELY)) {
            // In a slit between faces there may be none: then hidden in its nearest neighbour.
            let host = chosen[next_to];
            let aside = (at - host.centre).normalize() * (0.4 * host.radius);
            chosen[k] = Sphere { centre: host.centre + aside, radius: 0.5 * host.radius };
        }
        k
    })
}

/// About the largest of the balls that touch at some of the samples.
pub fn largest(balls: &Balls, samples: &[Sample]) -> Option<Sphere> {
    let rough = balls.roughly();
    let step = (samples.len() / 500).max(1);
    let mut best: Option<Sphere> = None;
    for sample in samples.iter().step_by(step) {
        // From a little below the surface: at edges and corners no ball touches.
        let inside = sample.point + sample.inward * best.map_or(1e-6, |b| (0.01 * b.radius).max(1e-6));
        if let Some(ball) = rough.around(&inside)
            && best.is_none_or(|b| ball.radius > b.radius * (1.0 + 1e-9))
            && balls.tree.signed(&ball.centre).0 < 0.0
        {
            best = Some(ball);
        }
    }
    // From its middle: between the triangles of a round surface the ball that touches at a place may be small.
    balls.around(&best?.centre)
}
