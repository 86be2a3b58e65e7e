//! The best of clusters that were measured, with balls joined where they overlap no other.

use super::ball::Balls;
use super::bound::VOLUME;
use super::compare::Comparison;
use super::files;
use super::make::{Maker, larger};
use super::probe::Place;
use super::wish::Fit;
use crate::geometry::sphere::Sphere;

/// Balls overlap if they are nearer than this share of the sum of their radii.
const BARELY: f64 = 0.97;
/// Steps in which a ball is moved towards another.
const MOST_STEPS: u32 = 60;
/// Balls may be smaller than the largest by this share of the largest in the solid.
pub(super) const FINE: f64 = 0.0025;

/// Clusters that were measured, and the best of them.
pub(super) struct Best<'a, 'b> {
    pub(super) maker: &'a Maker<'b>,
    pub(super) comparison: Comparison<'b>,
    pub(super) best: Option<(f64, Vec<Sphere>)>,
    /// The balls of which the best one was made by growing, and by how much [m].
    pub(super) balls: Vec<Sphere>,
    pub(super) grown: f64,
    /// Where its error is large.
    pub(super) places: Vec<Place>,
}

impl Best<'_, '_> {
    /// Measure a cluster and keep it if it is the best; errors count with `weight`.
    fn add(&mut self, cluster: Vec<Sphere>, weight: f64) -> bool {
        if cluster.is_empty() {
            return false;
        }
        let volume = self.comparison.volume(&cluster);
        let doubt = match self.maker.wish.fit {
            Fit::Volume => 1.0 + (volume.abs() - 0.01).max(0.0) / VOLUME,
            _ => 1.0,
        } * files::groups(&cluster) as f64;
        let least = self.best.as_ref().map_or(f64::INFINITY, |(error, _)| error / (weight * doubt));
        let found = self.comparison.of(&cluster, least);
        let error = weight * doubt * found.there.max(found.back);
        let better = self.best.as_ref().is_none_or(|(least, _)| error < *least);
        if better {
            self.best = Some((error, cluster));
            self.places = found.places;
        }
        better
    }

    /// The same of balls that are grown as the fit asks for, and joined; `gap` [m] is what they leave.
    pub(super) fn add_grown(&mut self, balls: &[Sphere], gap: f64, weight: f64) -> bool {
        let maker = self.maker;
        let grown = maker.growth(balls, gap);
        let cluster = larger(balls, grown);
        let apart = files::groups(&cluster) > 1;
        let mut better = self.add(cluster, weight);
        if apart {
            better |= self.add(maker.joined_by_moving(balls, gap, grown), weight);
            better |= self.add(maker.joined_by_growing(balls, gap, grown), weight);
        }
        if better {
            (self.balls, self.grown) = (balls.to_vec(), grown);
        }
        better
    }
}

impl Maker<'_> {
    /// Balls that overlap no other when all have grown by `grown` [m] are moved towards others, and all grown as the
    /// fit asks for then.
    fn joined_by_moving(&self, balls: &[Sphere], gap: f64, grown: f64) -> Vec<Sphere> {
        let all = Balls::new(self.tree, self.surface.size(), FINE * self.middle.radius);
        let mut moved = balls.to_vec();
        join(&all, &mut moved, grown, self.wish.smallest_radius);
        let grown = self.growth(&moved, gap);
        larger(&moved, grown)
    }

    /// Balls grown by more than `grown` [m], up to the gap, until they are joined; none where that does not help.
    fn joined_by_growing(&self, balls: &[Sphere], gap: f64, grown: f64) -> Vec<Sphere> {
        let apart = |by: f64| files::groups(&larger(balls, by)) > 1;
        if self.wish.fit == Fit::Inside || apart(gap) {
            return Vec::new();
        }
        let (mut few, mut enough) = (grown, gap);
        while enough - few > 1e-3 * gap {
            let half = 0.5 * (few + enough);
            if apart(half) { few = half } else { enough = half }
        }
        larger(balls, enough)
    }
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
            linked.extend(apart.extract_if(.., |other| overlap(&here, &chosen[*other])));
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
