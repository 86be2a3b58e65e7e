//! Clusters of one solid compared: by samples that are made once, in a fraction of the time that measuring takes.

use super::index::SphereIndex;
use super::probe::{Effort, Largest, Measured, Probe};
use super::samples::Samples;
use crate::geometry::sphere::Sphere;
use crate::shape::Surface;
use crate::shape::tree::SurfaceTree;
use nalgebra::Vector3;

/// Most samples that clusters are compared with, beside the corners of the surface.
pub const MOST_SAMPLES: usize = 20_000;
const ROUGH: Effort = Effort { samples: MOST_SAMPLES, points: 25_000, starts: 16, steps: 16, pits: 32 };
/// For those that seem to be better than the best so far: between few points the worst place may be missed.
const SURE: Effort = Effort { samples: MOST_SAMPLES, points: 100_000, starts: 24, steps: 24, pits: 64 };

/// Columns along each side with which volumes are compared.
const COLUMNS: usize = 96;

/// What clusters of a solid are compared with.
pub struct Comparison<'a> {
    surface: &'a Surface,
    tree: &'a SurfaceTree,
    samples: Samples,
    /// Distance of the samples [m].
    step: f64,
}

impl<'a> Comparison<'a> {
    /// With these samples of the surface.
    pub fn new(surface: &'a Surface, tree: &'a SurfaceTree, samples: Samples) -> Self {
        let area: f64 = (0..surface.triangles.len()).map(|t| surface.area(t)).sum();
        let step = (area / samples.points.len() as f64).sqrt();
        Self { surface, tree, samples, step }
    }

    /// About the largest distances of the two surfaces; found by a longer search where they are less than `least` [m].
    pub fn of(&self, spheres: &[Sphere], least: f64) -> Largest {
        let index = SphereIndex::new(spheres);
        let mut scene = Probe { tree: self.tree, index, size: self.surface.size(), effort: ROUGH };
        let outside = spheres.iter().map(|s| s.radius + self.tree.signed(&s.centre).0).fold(0.0, f64::max);
        let measure = |(p, inward): (&Vector3<f64>, &Vector3<f64>)| -> Measured {
            let (there, back) = scene.at(p, inward);
            (there, back, *p, *inward)
        };
        let measured: Vec<Measured> =
            self.samples.points.iter().zip(&self.samples.inward).map(measure).collect();
        let found = scene.largest(measured.clone(), self.step, outside);
        if found.there.max(found.back) >= least {
            return found;
        }
        scene.effort = SURE;
        scene.largest(measured, self.step, outside)
    }

    /// The error of the volume as a share of it.
    pub fn volume(&self, spheres: &[Sphere]) -> f64 {
        super::volume::excess(self.surface, spheres, COLUMNS)
    }
}
