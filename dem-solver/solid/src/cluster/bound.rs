//! Whether a cluster is a fair copy of its solid: bounds of its error, and how many spheres would keep them.

use super::accuracy::Accuracy;
use super::files;
use super::make::{largest, measured};
use super::wish::{Fit, MOST_SPHERES, Wish};
use crate::geometry::sphere::Sphere;
use crate::shape::Surface;
use crate::shape::tree::SurfaceTree;
use interface_defs::diagnostic::Diagnostic;

/// Largest error as a share of the size (diagonal of the box around the solid) where nothing else is asked for: a cube
/// of eight spheres has it.
pub const SHARE: f64 = 0.15;

/// The same as a share of the radius of the largest ball in the solid: what lies between the balls of a plate is a
/// hole at the whole of it.
pub const THICKNESS: f64 = 0.9;

/// Largest error of the volume with [`Fit::Volume`].
pub const VOLUME: f64 = 0.05;

/// Most spheres of a try that finds out how many it takes.
const MOST_TRIED: u32 = 4000;

/// Bounds of a cluster's error.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bound {
    /// Largest distance of the two surfaces [m].
    pub largest: f64,
    /// Its origin, for messages.
    pub source: BoundSource,
}

/// Origin of a bound.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BoundSource {
    /// It was asked for.
    Asked,
    /// [`SHARE`] of the size.
    Size,
    /// [`THICKNESS`] of the radius of the largest ball in the solid.
    Thickness,
}

impl Bound {
    /// The bound that was asked for [m], else the smaller one of [`SHARE`] of the size and [`THICKNESS`] of the
    /// radius of the largest ball in the solid.
    pub fn of(surface: &Surface, asked: Option<f64>) -> Self {
        if let Some(largest) = asked {
            return Self { largest, source: BoundSource::Asked };
        }
        let size = SHARE * surface.size();
        let thickness = THICKNESS * largest(&SurfaceTree::new(surface)).radius;
        if thickness < size {
            Self { largest: thickness, source: BoundSource::Thickness }
        } else {
            Self { largest: size, source: BoundSource::Size }
        }
    }

    fn describe(&self) -> String {
        let from = match self.source {
            BoundSource::Asked => "asked for".to_owned(),
            BoundSource::Size => {
                format!("{:.0} % of the diagonal of the box around the solid", 100.0 * SHARE)
            }
            BoundSource::Thickness => {
                format!("{THICKNESS} times the radius of the largest ball that fits into the solid")
            }
        };
        format!("{:.3e} m ({from})", self.largest)
    }

    /// Why `spheres` with this error are no fair copy of the solid, if they are none.
    pub fn passed(&self, spheres: &[Sphere], accuracy: &Accuracy, fit: Fit) -> Option<String> {
        let (many, error) = (spheres.len(), accuracy.largest());
        if error.is_nan() || error > self.largest {
            let bound = self.describe();
            return Some(format!(
                "{many} spheres lie up to {error:.3e} m from the surface, beyond the bound of {bound}"
            ));
        }
        let groups = files::groups(spheres);
        if groups > 1 {
            return Some(format!(
                "{many} spheres fall into {groups} groups that do not overlap: a thin wire passes between them"
            ));
        }
        (fit == Fit::Volume && (accuracy.volume.is_nan() || accuracy.volume.abs() > VOLUME)).then(|| {
            let [off, allowed] = [accuracy.volume, VOLUME].map(|share| 100.0 * share);
            format!("the volume of {many} spheres is {off:+.1} % off: {allowed:.0} % are allowed")
        })
    }

    /// The cluster of a wish with its error, or why it is refused. `names` are how the number of spheres and the largest
    /// error are written: `--spheres` and `--largest-error`, or keys of a scene.
    pub fn make(
        &self,
        surface: &Surface,
        wish: &Wish,
        names: [&str; 2],
        progress: impl FnMut(f64),
    ) -> Result<(Vec<Sphere>, Accuracy), Diagnostic> {
        let (spheres, accuracy) = measured(surface, wish, progress);
        match self.passed(&spheres, &accuracy, wish.fit) {
            None => Ok((spheres, accuracy)),
            Some(why) => Err(Diagnostic::new(why).try_instead(self.cure(surface, wish, &accuracy, names))),
        }
    }

    /// What to do about a wish whose cluster has passed the bound with this error: a number of spheres that was tried
    /// and keeps it, where trying takes seconds, else an estimate.
    fn cure(&self, surface: &Surface, wish: &Wish, accuracy: &Accuracy, names: [&str; 2]) -> String {
        let [spheres, largest] = names;
        let accept = if self.source == BoundSource::Asked || accuracy.largest() > 0.5 * surface.size() {
            String::new()
        } else {
            format!("; `{largest} {:.2e}` accepts it", 1.01 * accuracy.largest())
        };
        let about = |n: u32| format!("about {n} spheres are required (`{spheres} {n}`){accept}");
        let (mut count, mut error) = (f64::from(wish.spheres), accuracy.largest());
        for _ in 0..4 {
            // Evenly spread balls leave an error of order -1/2 in a thin solid, better ones elsewhere.
            let ratio = (error / self.largest).clamp(1.1, 1e6);
            count = (count * ratio.powf(1.7)).max(count + 2.0).ceil();
            if count > f64::from(MOST_SPHERES) {
                return format!(
                    "more than {MOST_SPHERES} spheres are required, or another fit: `largest`{accept}"
                );
            }
            let n = rounded(count as u32);
            if n > MOST_TRIED {
                return about(n);
            }
            let (tried, found) = measured(surface, &Wish { spheres: n, ..*wish }, |_| ());
            (count, error) = (f64::from(n), found.largest());
            if self.passed(&tried, &found, wish.fit).is_none() {
                return format!("`{spheres} {n}` leaves {error:.2e} m{accept}");
            }
        }
        about(rounded(2 * count as u32))
    }
}

/// Two digits, upwards.
fn rounded(n: u32) -> u32 {
    let unit = 10_u32.pow(n.max(1).ilog10().saturating_sub(1));
    n.div_ceil(unit) * unit
}
