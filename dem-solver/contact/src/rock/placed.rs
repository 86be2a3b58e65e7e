//! The spheres that stand for a rock in contact: read, a lattice, or made, as the scene asks for.

use crate::keys::{Checked, Keys};
use crate::settings::Cluster;
use dem_solid::cluster::{Accuracy, Bound, MOST_SPHERES, Wish, files, kept, lattice};
use dem_solid::geometry::sphere::{Sphere, extent};
use dem_solid::shape::Surface;
use interface_defs::diagnostic::Diagnostic;
use nalgebra::Vector3;
use std::path::{Path, PathBuf};
use toolkit::scene::Scene;

/// Refuse a least radius with which no sphere fits into the rock.
pub fn check_smallest(at: usize, surface: &Surface, cluster: &Cluster, scene: &Scene) -> Checked {
    let edges = extent(surface.points.iter().map(|p| (*p, 0.0)));
    let half = 0.5 * edges.into_iter().fold(f64::INFINITY, f64::min);
    let radius = cluster.smallest_radius.unwrap_or_default();
    let what = format!("smallest_radius = {radius} m, and no sphere above {half:.4} m fits into the rock");
    let cure = "it is written in metres: 50 mm is 0.05";
    Keys::of(scene, format!("rock.{at}.cluster")).refuse(radius > half, "smallest_radius", what, cure)
}

/// The spheres of a rock in its shape's own axes, and what is known of them from how they were made.
#[derive(Default)]
pub struct PlacedSpheres {
    pub spheres: Vec<Sphere>,
    pub origin: String,
    /// [`Rock::outermost`](super::Rock::outermost) and [`Rock::facing`](super::Rock::facing), where they are known.
    pub outer: Option<(Vec<u32>, f64)>,
    pub notice: Option<String>,
    pub accuracy: Option<Accuracy>,
    pub made: Option<String>,
}

/// Spheres that are made now, with their error.
fn made(
    surface: &Surface,
    wish: &Wish,
    bound: &Bound,
    name: &str,
) -> Result<(Vec<Sphere>, Option<Accuracy>), Diagnostic> {
    tracing::info!("rock `{name}`: making a cluster of {} spheres", wish.spheres);
    let mut printed = 0.0;
    let (spheres, accuracy) = bound.make(surface, wish, NAMED, |done| {
        if done >= printed + 0.25 {
            printed = done;
            tracing::info!("rock `{name}`: cluster {:.0} % done", 100.0 * done);
        }
    })?;
    Ok((spheres, Some(accuracy)))
}

/// How a scene writes the number of spheres and the largest error.
const NAMED: [&str; 2] = ["cluster.spheres =", "cluster.largest_error ="];

impl PlacedSpheres {
    /// A ball of `radius` [m] as the one sphere that it is.
    pub fn single(radius: f64) -> Self {
        Self {
            spheres: vec![Sphere { centre: Vector3::zeros(), radius }],
            origin: "itself".into(),
            outer: Some((vec![0], 1.0)),
            ..Self::default()
        }
    }

    /// Equal spheres in rows that fill a box of `size` [m]; an error where that takes more than a scene may ask for.
    pub fn lattice(size: [f64; 3], cluster: &Cluster) -> Result<Self, Diagnostic> {
        let asked = cluster.spheres.unwrap_or(64);
        let lattice = lattice::lattice(size, asked, cluster.largest_error, NAMED)?;
        let took = lattice.total();
        let [nx, ny, nz] = lattice.counts;
        let [x, y, z] = lattice.counts.map(f64::from);
        let notice = (took != u64::from(asked))
            .then(|| format!("{asked} spheres do not fill the box evenly; took {nx} x {ny} x {nz} = {took}"));
        Ok(Self {
            spheres: lattice.spheres(),
            origin: format!("{nx} x {ny} x {nz}"),
            outer: Some((lattice::outermost(lattice.counts), (x * y).max(y * z).max(x * z))),
            notice,
            ..Self::default()
        })
    }

    /// Spheres of any shape; those of a file in one of `folders` that was made for the same.
    pub fn medial(
        surface: &Surface,
        cluster: &Cluster,
        name: &str,
        folders: &[PathBuf],
    ) -> Result<Self, Diagnostic> {
        let wish = Wish {
            spheres: cluster.spheres.unwrap_or(1).clamp(1, MOST_SPHERES),
            fit: cluster.fit.unwrap_or_default(),
            smallest_radius: cluster.smallest_radius.unwrap_or(0.0),
        };
        let bound = Bound::of(surface, cluster.largest_error);
        let (spheres, accuracy) = match kept::find(folders, name, surface, &wish, &bound) {
            Some((spheres, file)) => {
                tracing::info!("rock `{name}`: {} spheres of {}", spheres.len(), file.display());
                (spheres, None)
            }
            None => made(surface, &wish, &bound, name)?,
        };
        let text = kept::text(surface, &wish, &bound, &spheres);
        let notice = (spheres.len() < wish.spheres as usize).then(|| {
            let (made, asked) = (spheres.len(), wish.spheres);
            format!(
                "{made} spheres cover the shape down to the chords of its triangles; {asked} were asked for"
            )
        });
        let (origin, made) = ("medial".into(), Some(text));
        Ok(Self { spheres, origin, notice, accuracy, made, ..Self::default() })
    }

    /// The spheres that `file` lists, with a notice where they do not hang together.
    pub fn read(file: &Path) -> Result<Self, Diagnostic> {
        let spheres = files::read(file)?;
        let groups = files::groups(&spheres);
        let notice = (groups > 1).then(|| {
            format!(
                "its spheres are {groups} groups that do not overlap: a thin wire falls through between them"
            )
        });
        let origin = format!("of {}", file.display());
        Ok(Self { spheres, origin, notice, ..Self::default() })
    }
}
