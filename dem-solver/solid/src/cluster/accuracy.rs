//! How far a cluster's surface and the true surface lie apart, both ways.
//!
//! From every sample of the true surface a ray runs along the normal to the surface of the cluster:
//! inwards where the sample lies outside of all spheres, outwards where it lies inside of one.
//!
//! - surface to spheres: the distance of the sample to the nearest sphere (outside), or to the end of a ray (inside
//!   of a sphere): the shorter one of the ray along the normal and that from the sphere's centre, and for
//!   the largest ones the shortest of all directions (`Probe::shortest`) - along the normal of a rough
//!   surface a ray may run through spheres for long
//! - spheres to surface: the distance of the end of the normal's ray to the true surface; besides, for each sphere,
//!   how far it reaches out of the solid (exact where nothing else is nearer: radius plus signed depth of the
//!   centre), and the distance of points of it that are seen from the surface
//!
//! Means are weighted with the area of the samples; the largest ones are improved by small steps uphill.
//!
//! Clusters of one solid compared: by samples that are made once, in a fraction of the time that measuring takes.

use super::probe::{Effort, Largest, Probe};
use super::samples::{self, Sample, Sizes};
use crate::geometry::sphere::Sphere;
use crate::shape::Surface;
use crate::shape::tree::SurfaceTree;
use std::fmt;

const FULL: Effort = Effort { points: 200_000, starts: 48, steps: 30, pits: 96 };
/// Samples of the surface, beside its corners.
const SAMPLES: usize = 150_000;
/// Samples for each sphere of very many, so that none is missed.
const SAMPLES_EACH: usize = 30;
/// Spheres for each of the places from which the largest error is sought uphill.
const SPHERES_PER_START: usize = 25;
/// Columns along each side with which the volume is compared: few where many spheres fill them.
const COLUMNS: usize = 256;
const FEW_COLUMNS: usize = 128;
const MANY_SPHERES: usize = 4000;

/// A mean and a largest distance [m].
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Spread {
    /// Mean [m].
    pub mean: f64,
    /// Largest [m].
    pub max: f64,
}

/// The error of a cluster.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Accuracy {
    /// From the true surface to the surface of the cluster.
    pub surface_to_spheres: Spread,
    /// From the surface of the cluster to the true surface.
    pub spheres_to_surface: Spread,
    /// Furthest that a sphere reaches out of the solid [m].
    pub outside: f64,
    /// Volume of all spheres together over that of the solid, minus 1.
    pub volume: f64,
}

impl Accuracy {
    /// Of `spheres` (at least one) that approximate the solid inside `surface`.
    pub fn of(surface: &Surface, spheres: &[Sphere]) -> Self {
        Self::with(&mut Sizes::new(&SurfaceTree::new(surface)), spheres)
    }

    /// The same where sizes of balls in the solid are known already.
    pub fn with(sizes: &mut Sizes, spheres: &[Sphere]) -> Self {
        let tree = sizes.balls.tree;
        let (surface, size) = (tree.surface, tree.size);
        let most = SAMPLES.max(SAMPLES_EACH * spheres.len());
        // Of very many spheres many are nearly as far off as the worst.
        let starts = FULL.starts.max(spheres.len() / SPHERES_PER_START);
        let scene = Probe::new(tree, spheres, Effort { starts, ..FULL });
        let mut corners = |error| samples::corners(sizes, error, 0.9, most + surface.points.len());
        let mut error = 0.1 * size;
        let mut points = corners(error);
        // Samples as dense as the error found with coarser ones asks for.
        for _ in 0..3 {
            let Some(coarse) = &points else { break };
            let found = coarse.iter().map(|s| scene.index.nearest(&s.point).0.abs()).fold(0.0, f64::max);
            let finer = found.max(1e-6 * size);
            if finer >= error {
                break;
            }
            let Some(fine) = corners(finer) else { break };
            (points, error) = (Some(fine), finer);
        }
        let points = points.unwrap_or_default();
        let most = most + surface.triangles.len();
        let (middles, areas) = samples::no_finer(error, |error| samples::middles(sizes, error, 0.9, most));
        let (mut there, mut back) = (Spread::default(), Spread::default());
        let total: f64 = areas.iter().sum();
        let mut measured = scene.measured(&middles);
        for (found, area) in measured.iter().zip(&areas) {
            there.mean += found.0 * area / total;
            back.mean += found.1 * area / total;
        }
        measured.extend(scene.measured(&points));
        let step = (total / measured.len() as f64).sqrt();
        let found = scene.largest(measured, step);
        (there.max, back.max) = (found.there, found.back);
        let columns = if spheres.len() > MANY_SPHERES { FEW_COLUMNS } else { COLUMNS };
        let volume = super::volume::excess(surface, spheres, columns);
        Self { surface_to_spheres: there, spheres_to_surface: back, outside: scene.outside, volume }
    }

    /// The largest distance of all [m].
    pub fn largest(&self) -> f64 {
        self.surface_to_spheres.max.max(self.spheres_to_surface.max)
    }
}

impl fmt::Display for Accuracy {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let Spread { mean, max } = self.surface_to_spheres;
        let Spread { mean: mean_back, max: max_back } = self.spheres_to_surface;
        let (outside, volume) = (self.outside, 100.0 * self.volume);
        write!(
            f,
            "surface to spheres {mean:.3e} m (mean) {max:.3e} m (largest), spheres to surface {mean_back:.3e} m and \
             {max_back:.3e} m, {outside:.3e} m outside at most, volume {volume:+.3} %"
        )
    }
}

/// Most samples that clusters are compared with, beside the corners of the surface.
pub const MOST_COMPARED: usize = 20_000;
const ROUGH: Effort = Effort { points: 25_000, starts: 16, steps: 16, pits: 32 };
/// For those that seem to be better than the best so far: between few points the worst place may be missed.
const SURE: Effort = Effort { points: 100_000, starts: 24, steps: 24, pits: 64 };

/// Columns along each side with which their volumes are compared.
const ROUGH_COLUMNS: usize = 96;

/// What clusters of a solid are compared with.
pub struct Comparison<'a> {
    tree: &'a SurfaceTree<'a>,
    samples: Vec<Sample>,
    /// Distance of the samples [m].
    step: f64,
}

impl<'a> Comparison<'a> {
    /// With these samples of the surface.
    pub fn new(tree: &'a SurfaceTree, samples: Vec<Sample>) -> Self {
        let area: f64 = (0..tree.surface.triangles.len()).map(|t| tree.surface.area(t)).sum();
        let step = (area / samples.len() as f64).sqrt();
        Self { tree, samples, step }
    }

    /// About the largest distances of the two surfaces; found by a longer search where they are less than `least` [m].
    pub fn of(&self, spheres: &[Sphere], least: f64) -> Largest {
        let mut scene = Probe::new(self.tree, spheres, ROUGH);
        let measured = scene.measured(&self.samples);
        let found = scene.largest(measured.clone(), self.step);
        if found.there.max(found.back) >= least {
            return found;
        }
        scene.effort = SURE;
        scene.largest(measured, self.step)
    }

    /// The error of the volume as a share of it.
    pub fn volume(&self, spheres: &[Sphere]) -> f64 {
        super::volume::excess(self.tree.surface, spheres, ROUGH_COLUMNS)
    }
}
