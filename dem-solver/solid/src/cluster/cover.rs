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

use super::ball::Balls;
use super::gaps::{Gaps, leaves};
use super::samples::Samples;
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

/// Exactly `count` balls (fewer only where nothing is left to cover, [`Balls::finest`]): first until every sample lies
/// within the error, then on where the gap is largest. `middle` is the first ball where samples may be too few
/// to find the largest: all may lie at corners, where no ball is large. Without it balls smaller than the tolerance, with
/// a radius below 0, are not left out: such a cover is no good, but one for fewer balls may lead to a good one; and balls that overlap no
/// other are moved until they do.
pub fn cover(balls: &Balls, samples: &Samples, middle: Option<&Sphere>, wanted: &Wanted) -> Cover {
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
        let (gap, sample) = gaps.largest();
        if gap <= error && enough.is_none() {
            enough = Some(chosen.len());
        }
        if gap <= balls.finest() {
            break;
        }
        let wish = SHARE * error.min(gap);
        let ball = balls.near(&samples.points[sample], &samples.inward[sample], wish, least);
        let left = ball.map_or(f64::INFINITY, |b| leaves(samples, sample, &b));
        match ball {
            // It must help by more than rounding, or the same sample would come again for ever.
            Some(ball)
                if ball.radius >= least
                    && (middle.is_none() || ball.radius > 0.0)
                    && left < gap * if ball.radius <= 2.0 * least { 0.8 } else { 0.999 } =>
            {
                gaps.add(&ball);
                chosen.push(ball);
                made_for.push(sample);
                // A ball that must be larger than the gap asks for leaves its sample as it is.
                if left <= wish * (1.0 + 1e-9) || ball.radius > 2.0 * least {
                    continue;
                }
            }
            _ => {}
        }
        helpless.push(sample);
        gaps.give_up(sample, &samples.points[sample]);
    }
    if middle.is_none() && connect(balls, samples, &mut chosen, &made_for, least) > 0 {
        gaps = Gaps::new(samples);
        chosen.iter().for_each(|ball| gaps.add(ball));
        helpless.iter().for_each(|sample| gaps.give_up(*sample, &samples.points[*sample]));
    }
    let gap = gaps.largest().0.max(0.0);
    Cover { balls: chosen, gap, enough, error }
}

/// Put balls that overlap no other (the last ones in pointed corners) further inside, until they do: between
/// spheres that only touch a thin wire falls through. How many were moved.
fn connect(balls: &Balls, samples: &Samples, chosen: &mut [Sphere], made_for: &[usize], least: f64) -> usize {
    let within = |a: &Sphere, b: &Sphere, share: f64| {
        let sum = share * (a.radius + b.radius);
        (a.centre - b.centre).norm_squared() < sum * sum
    };
    let overlap = |a: &Sphere, b: &Sphere| within(a, b, OVERLAP);
    let mut apart: Vec<usize> = (1..chosen.len()).collect();
    let mut linked = vec![0];
    let mut next = 0;
    let mut moved = 0;
    loop {
        while next < linked.len() {
            let k = linked[next];
            next += 1;
            linked.extend(apart.extract_if(.., |other| overlap(&chosen[k], &chosen[*other])));
        }
        if apart.is_empty() {
            return moved;
        }
        let k = apart.remove(0);
        let (at, inward) = (&samples.points[made_for[k]], &samples.inward[made_for[k]]);
        let away = |other: &usize| (chosen[*other].centre - at).norm() - chosen[*other].radius;
        let Some(next_to) = linked.iter().copied().min_by(|a, b| away(a).total_cmp(&away(b))) else {
            return moved;
        };
        let nearest = away(&next_to);
        for step in 1..MOST_STEPS {
            let wish = nearest * f64::from(step) / f64::from(MOST_STEPS);
            let Some(ball) = balls.near(at, inward, wish, least) else { continue };
            if linked.iter().any(|other| overlap(&ball, &chosen[*other])) {
                chosen[k] = ball;
                break;
            }
        }
        if !linked.iter().any(|other| within(&chosen[k], &chosen[*other], BARELY)) {
            // In a slit between faces there may be none: then hidden in its nearest neighbour.
            let host = chosen[next_to];
            let aside = (at - host.centre).normalize() * (0.4 * host.radius);
            chosen[k] = Sphere { centre: host.centre + aside, radius: 0.5 * host.radius };
        }
        moved += 1;
        linked.push(k);
    }
}

/// About the largest of the balls that touch at some of the samples.
pub fn largest(balls: &Balls, samples: &Samples) -> Option<Sphere> {
    let rough = balls.roughly();
    let step = (samples.points.len() / 500).max(1);
    let mut best: Option<Sphere> = None;
    for k in (0..samples.points.len()).step_by(step) {
        // From a little below the surface: at edges and corners no ball touches.
        let inside =
            samples.points[k] + samples.inward[k] * best.map_or(1e-6, |b| (0.01 * b.radius).max(1e-6));
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
