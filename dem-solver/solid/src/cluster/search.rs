//! A second search for a cover, where guesses lead to none that is known to be good.
//!
//! A guess that is too small spends all balls on one part of the solid, and balls that overlap no other, put beside one
//! that they do overlap, leave a gap where they were. Here the error is sought between bounds, balls stay where they
//! are, and are joined only when it is known how far they grow. Few balls are moved to the middle of what they
//! cover besides. What is measured to be best is taken.
//!
//! The best of clusters that were measured is kept, with balls joined where they overlap no other. Its spheres that few would miss are taken
//! out, and put where the error is largest: a cover is made for the gaps that samples see before its balls grow; what is measured at last
//! are the gaps that are left then, and the depth of pits between spheres; here both decide.

use super::accuracy::{Accuracy, Comparison, MOST_COMPARED};
use super::ball::Balls;
use super::bound::VOLUME;
use super::cover::{Cover, link};
use super::files;
use super::index::{SphereIndex, entry};
use super::make::{Maker, furthest, larger};
use super::probe::{self, Place};
use super::samples::Sample;
use super::wish::Fit;
use crate::geometry::sphere::Sphere;
use crate::shape::tree::SurfaceTree;
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
    /// The best of evenly spread covers, and the same moved to the middle of what it covers. `tried` are errors for which balls
    /// were too few and enough [m].
    pub fn search_further(&mut self, tried: (f64, f64)) -> Vec<Cover> {
        let covers = self.evenly(tried);
        let even = self.best(covers);
        let relaxed = even.clone().filter(|_| self.count <= MANY).map(|cover| self.relaxed(cover));
        even.into_iter().chain(relaxed).collect()
    }

    /// The best of covers as measured when they are grown, with some spheres moved where that makes it better. Others
    /// must be better than the `preferred` ones by a share.
    pub fn settle(&mut self, preferred: Vec<Cover>, others: Vec<Cover>) -> (Vec<Sphere>, Accuracy) {
        let cluster = match (preferred.as_slice(), others.as_slice(), rounds(self.count)) {
            // Very many spheres are not moved: nothing to compare with.
            ([cover], [], 0) => larger(&cover.balls, self.growth(&cover.balls, cover.seen)),
            _ => self.compared(&preferred, &others),
        };
        let accuracy = Accuracy::with(&mut self.sizes, &cluster);
        (cluster, accuracy)
    }

    fn compared(&mut self, preferred: &[Cover], others: &[Cover]) -> Vec<Sphere> {
        let gap = preferred.iter().chain(others).map(|c| c.seen).fold(f64::INFINITY, f64::min);
        let gap = if gap.is_finite() { gap } else { 2.0 * self.tree.size };
        let samples = self.samples(0.5 * gap);
        let few = self.at_most(gap, 0.9, MOST_COMPARED + self.tree.surface.points.len());
        let comparison = Comparison::new(self.tree, few);
        let (balls, places) = (Vec::new(), Vec::new());
        let mut best = Best { maker: self, comparison, best: None, balls, grown: 0.0, places };
        for (weight, covers) in [(BETTER, preferred), (1.0, others)] {
            for cover in covers {
                best.add_grown(&cover.balls, cover.seen, weight);
            }
        }
        let balls = best.balls.clone();
        if balls.len() > 2 {
            self.refine(&samples, &mut best, balls);
        }
        best.best.map_or_else(|| vec![self.middle], |(_, cluster)| cluster)
    }

    /// Covers with errors between one for which balls are enough and one for which all are too few, until these two
    /// are near each other. Balls that overlap no other stay where they are.
    fn evenly(&mut self, tried: (f64, f64)) -> Vec<Cover> {
        let most = if self.count > MANY { FEWER_COVERS } else { MOST_COVERS };
        let (mut few, mut enough) = (0.0, f64::INFINITY);
        let mut error = match tried {
            (few, enough) if few > 0.0 && enough.is_finite() => (few * enough).sqrt(),
            (_, enough) if enough.is_finite() => enough,
            _ => 0.5 * self.tree.size,
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
    fn relaxed(&mut self, mut cover: Cover) -> Cover {
        let samples = self.samples(0.5 * cover.seen);
        let balls = self.fine_balls();
        let least = self.wish.smallest_radius;
        let nearest = |balls: &[Sphere]| -> Vec<(f64, usize)> {
            let index = SphereIndex::new(balls);
            let near = |sample: &Sample| {
                let (distance, near) = index.nearest(&sample.point);
                (distance, index.place(near))
            };
            samples.iter().map(near).collect()
        };
        let furthest = |near: &[(f64, usize)]| near.iter().map(|n| n.0).fold(0.0, f64::max);
        let mut near = nearest(&cover.balls);
        cover.seen = furthest(&near);
        for _ in 0..MOST_ROUNDS {
            let mut own: Vec<Vec<Vector3<f64>>> = vec![Vec::new(); cover.balls.len()];
            for (sample, (_, ball)) in samples.iter().zip(&near) {
                own[*ball].push(sample.point);
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
            if gap >= cover.seen {
                break;
            }
            (cover.balls, near, cover.seen) = (moved, after, gap);
        }
        cover
    }

    /// Balls that are nearly the largest.
    fn fine_balls(&self) -> Balls<'_> {
        Balls::new(self.tree, FINE * self.middle.radius)
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

/// Balls overlap if they are nearer than this share of the sum of their radii.
const BARELY: f64 = 0.97;
/// Steps in which a ball is moved towards another.
const JOINING_STEPS: u32 = 60;
/// Balls may be smaller than the largest by this share of the largest in the solid.
const FINE: f64 = 0.0025;

/// Clusters that were measured, and the best of them.
struct Best<'a, 'b> {
    maker: &'a Maker<'b>,
    comparison: Comparison<'b>,
    best: Option<(f64, Vec<Sphere>)>,
    /// The balls of which the best one was made by growing, and by how much [m].
    balls: Vec<Sphere>,
    grown: f64,
    /// Places at which its error is large.
    places: Vec<Place>,
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
    fn add_grown(&mut self, balls: &[Sphere], gap: f64, weight: f64) -> bool {
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
        let mut moved = balls.to_vec();
        self.join(&mut moved, grown);
        let grown = self.growth(&moved, gap);
        larger(&moved, grown)
    }

    /// Move balls that overlap no other when all have grown by `grown` [m] towards the nearest one that is joined to the first,
    /// inside the solid, until they do.
    fn join(&self, chosen: &mut [Sphere], grown: f64) {
        let overlap = |a: &Sphere, b: &Sphere| {
            let sum = BARELY * (a.radius + b.radius + 2.0 * grown);
            (a.centre - b.centre).norm_squared() < sum * sum
        };
        let balls = self.fine_balls();
        link(chosen, overlap, |chosen, apart, linked| {
            let away = |(k, other): &(usize, usize)| {
                let (a, b) = (&chosen[*k], &chosen[*other]);
                (a.centre - b.centre).norm() - a.radius - b.radius
            };
            let pairs = apart.iter().flat_map(|k| linked.iter().map(|other| (*k, *other)));
            let nearest = pairs.min_by(|a, b| away(a).total_cmp(&away(b)));
            let (k, host) = nearest.expect("some are apart, and the first is linked");
            let (from, to) = (chosen[k].centre, chosen[host].centre);
            let shares = (1..JOINING_STEPS).map(|step| f64::from(step) / f64::from(JOINING_STEPS));
            let mut tried = shares.filter_map(|share| balls.around(&(from + (to - from) * share)));
            let fits =
                |ball: &Sphere| ball.radius > self.wish.smallest_radius && overlap(ball, &chosen[host]);
            if let Some(ball) = tried.find(fits) {
                chosen[k] = ball;
            }
            k
        });
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
fn rounds(count: usize) -> usize {
    ROUNDS.iter().find(|(most, _)| count <= *most).map_or(0, |(_, rounds)| *rounds)
}

impl Maker<'_> {
    /// Move spheres of the best cluster to where its error is largest, as long as that makes it better.
    fn refine(&self, samples: &[Sample], best: &mut Best, mut balls: Vec<Sphere>) {
        let (mut share, mut vain) = (MOVED, 0);
        for _ in 0..rounds(self.count) {
            let tried = self.moved(samples, &balls, share, best, vain == 0);
            let gap = furthest(&tried, samples);
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
        samples: &[Sample],
        balls: &[Sphere],
        share: f64,
        best: &Best,
        known: bool,
    ) -> Vec<Sphere> {
        let many = ((share * balls.len() as f64).ceil() as usize).min(balls.len() / 2);
        let mut kept = without(balls, samples, many);
        let all = self.fine_balls();
        let mut view = ViewOfSurface::new(self.tree, samples, &larger(&kept, best.grown));
        // First where it is known to be worst, which between samples none of them sees.
        let worst = if known { (KNOWN * many as f64).ceil() as usize } else { 0 };
        let mut places = probe::worst(best.places.iter().copied(), worst);
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
fn without(balls: &[Sphere], samples: &[Sample], many: usize) -> Vec<Sphere> {
    let index = SphereIndex::new(balls);
    // How far samples would lie from all others, for each ball the most of those that are nearest to it.
    let mut required = vec![f64::NEG_INFINITY; balls.len()];
    for sample in samples {
        let [(_, near), (other, _)] = index.nearest_two(&sample.point);
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

/// Samples among which the worst places are sought.
const ENOUGH: usize = 100_000;

/// A sample outside of all spheres.
struct SeenPlace {
    place: Place,
    /// Distance to the nearest sphere [m], and along the ray into the solid to the first one that it enters.
    gap: f64,
    ray: f64,
}

/// The samples outside of all spheres so far.
struct ViewOfSurface<'a> {
    tree: &'a SurfaceTree<'a>,
    seen: Vec<SeenPlace>,
}

impl<'a> ViewOfSurface<'a> {
    /// What `samples` of the surface of `tree` see of `spheres`.
    fn new(tree: &'a SurfaceTree, samples: &[Sample], spheres: &[Sphere]) -> Self {
        let index = SphereIndex::new(spheres);
        let mut view = Self { tree, seen: Vec::new() };
        let step = (samples.len() / ENOUGH).max(1);
        for Sample { point, inward, .. } in samples.iter().copied().step_by(step) {
            let gap = index.nearest(&point).0;
            if gap > 0.0 {
                let ray = index.entry(&point, &inward, f64::INFINITY).unwrap_or(f64::INFINITY);
                let place = Place { point, inward, depth: 0.0 };
                view.seen.push(SeenPlace { place, gap, ray });
            }
        }
        view.seen.iter_mut().for_each(|s| s.measure(tree));
        view
    }

    /// Spheres more.
    fn add(&mut self, spheres: &[Sphere]) {
        for seen in &mut self.seen {
            let before = (seen.gap, seen.ray);
            for sphere in spheres {
                let gap = (seen.place.point - sphere.centre).norm() - sphere.radius;
                // A sphere that the ray enters within its length lies no further from the sample than that.
                if gap < seen.gap.max(seen.ray) {
                    seen.gap = seen.gap.min(gap);
                    let ray = entry(sphere, &seen.place.point, &seen.place.inward);
                    seen.ray = ray.map_or(seen.ray, |t| t.min(seen.ray));
                }
            }
            if (seen.gap, seen.ray) != before && seen.gap > 0.0 {
                seen.measure(self.tree);
            }
        }
        self.seen.retain(|s| s.gap > 0.0);
    }

    /// The places, at most `many`, where the spheres leave the surface furthest; none within its own depth of a worse one.
    fn worst(&mut self, many: usize) -> Vec<Place> {
        self.seen.sort_by(|a, b| b.place.depth.total_cmp(&a.place.depth));
        probe::worst(self.seen.iter().map(|s| s.place), many)
    }
}

impl SeenPlace {
    /// The depth: the distance to the nearest sphere, or if it is more that of the ray's end to the surface. A ray that
    /// enters no sphere says nothing.
    fn measure(&mut self, tree: &SurfaceTree) {
        let end = self.place.point + self.place.inward * self.ray;
        let back = if self.ray.is_finite() {
            tree.nearest(&end, self.ray * (1.0 + 1e-9)).map_or(self.ray, |n| n.square.sqrt())
        } else {
            0.0
        };
        self.place.depth = self.gap.max(back);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cluster::samples::{Sizes, corners};
    use crate::shape::builtin;
    use nalgebra::Vector3;

    /// Added one after the other, or there from the beginning: the same places.
    #[test]
    fn what_is_seen_of_added_spheres_is_what_is_seen_of_all() {
        let surface = builtin::cuboid(Vector3::new(1.0, 0.8, 0.6));
        let tree = SurfaceTree::new(&surface);
        let samples = corners(&mut Sizes::new(&tree), 0.05, 0.4, 100_000).expect("fewer");
        let at = |i: u32, f: f64| 0.4 * (f64::from(i) * f).sin();
        let spheres: Vec<Sphere> = (0..12)
            .map(|i| {
                let centre = Vector3::new(at(i, 1.3), 0.8 * at(i, 2.7), 0.6 * at(i, 3.1));
                Sphere { centre, radius: 0.01 - tree.signed(&centre).0 }
            })
            .collect();
        let mut added = ViewOfSurface::new(&tree, &samples, &spheres[..3]);
        spheres[3..].chunks(2).for_each(|some| added.add(some));
        let mut all = ViewOfSurface::new(&tree, &samples, &spheres);
        let depths = |view: &mut ViewOfSurface| view.worst(20).iter().map(|p| p.depth).collect::<Vec<_>>();
        let found = depths(&mut added);
        assert!(found.len() == 20 && found[0] > 0.01);
        assert_eq!(found, depths(&mut all));
    }
}
