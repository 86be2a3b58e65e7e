//! `[[rock]]`: a rigid body and the spheres that stand for it in contact.

use crate::keys::{Checked, Keys};
use dem_solid::cluster::lattice::Lattice;
use dem_solid::cluster::{Fit, MOST_SPHERES};
use dem_solid::input::LENGTHS;
pub use dem_solid::shape::Shape;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};
use toolkit::scene::Scene;

/// A rigid rock, and the spheres that represent it in contact.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RockSettings {
    /// Name: letters, digits, `_`, `-`; it begins the names of the rock's columns. Default `rock`,
    /// for further ones `rock_2`, `rock_3`, ...
    #[serde(default)]
    pub name: String,
    /// Name of its material, for `[[contact]] between`. Default `rock`.
    #[serde(default = "rock_material")]
    pub material: String,
    /// Centre of mass [m].
    pub position: [f64; 3],
    /// Velocity of the centre of mass [m/s]. Default 0.
    #[serde(default)]
    pub velocity: [f64; 3],
    /// Quaternion `[w, x, y, z]` that turns the shape's own axes into those of space: for an angle a
    /// about the unit axis e it is `[cos(a/2), sin(a/2) e]`. Need not be normalised. Default `[1, 0, 0, 0]`.
    #[serde(default = "no_turn")]
    pub orientation: [f64; 4],
    /// Angular velocity along the axes of space [rad/s]. Default 0.
    #[serde(default)]
    pub angular_velocity: [f64; 3],
    /// Mass [kg]. Exactly one of `mass` and `density`.
    pub mass: Option<f64>,
    /// Density of the true solid [kg/m3]. Exactly one of `mass` and `density`.
    pub density: Option<f64>,
    /// The true solid: its mass, centre and inertia are the rock's.
    pub shape: Shape,
    /// The spheres that represent the solid in contact.
    pub cluster: Option<Cluster>,
    /// All lengths of the shape and of the spheres that were made for it times this: the same rock, larger or smaller. A mass
    /// stays as it is stated. Default 1.
    pub scale: Option<f64>,
}

/// The spheres of a rock: made in this number, or read from a file.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Cluster {
    /// Most spheres, 1 to 50 000. A box takes the largest number that fills it as a lattice (a
    /// cube: a cube number); other methods take exactly so many, or fewer on round shapes.
    /// Default: up to 64 for a box, 1 for a sphere, else 500.
    pub spheres: Option<u32>,
    /// How to place them. Default: `lattice` for a box, else `medial`.
    pub method: Option<Method>,
    /// With `medial`: where the spheres end. Default `volume`.
    pub fit: Option<Fit>,
    /// With `medial`: least radius [m]. Small spheres make edges sharp, and are soft: a wire is pulled past
    /// their centre early; what only smaller ones could reach stays uncovered. Default 0: as the error asks for.
    pub smallest_radius: Option<f64>,
    /// Largest distance of the spheres' surface from the true one [m]: a scene that passes it is refused.
    /// A lattice keeps the default but for single spheres.
    /// Default: the smaller one of 15 % of the diagonal of the shape's box and 0.9 radii of the largest ball in it.
    pub largest_error: Option<f64>,
    /// In place of all these: spheres from a file, `x y z r` text or Kratos `.clu`, in the shape's own axes;
    /// relative to the scene file.
    pub file: Option<PathBuf>,
}

/// How spheres are placed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Method {
    /// Equal spheres in rows; boxes only.
    Lattice,
    /// Balls of the medial axis, by their error.
    Medial,
}

impl Cluster {
    /// So many spheres.
    pub fn of(spheres: u32) -> Self {
        Self { spheres: Some(spheres), ..Self::default() }
    }
}

/// Most spheres of a box where the scene does not say.
const IN_A_BOX: u32 = 64;

pub(super) fn rock_material() -> String {
    "rock".into()
}

fn no_turn() -> [f64; 4] {
    [1.0, 0.0, 0.0, 0.0]
}

/// Fill in names and numbers of spheres; refuse what makes no sense.
pub(super) fn complete(rocks: &mut [RockSettings], scene: &Scene) -> Checked {
    for at in 0..rocks.len() {
        let keys = Keys::of(scene, format!("rock.{at}"));
        let rock = &mut rocks[at];
        if rock.name.is_empty() {
            rock.name = if at == 0 { "rock".into() } else { format!("rock_{}", at + 1) };
        }
        let letters = rock.name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_' || c == '-');
        let what = format!("`{}` cannot begin a column: letters, digits, `_` and `-` can", rock.name);
        keys.refuse(!letters, "name", what, "")?;
        let what = "a quaternion of zeros is no orientation";
        keys.refuse(rock.orientation == [0.0; 4], "orientation", what, "no turn is [1, 0, 0, 0]")?;
        keys.twice(["mass", "density"], rock.mass.is_some() && rock.density.is_some())?;
        let what = format!("rock `{}` has neither mass nor density", rock.name);
        let cure = "write one of them: mass [kg], density [kg/m3]";
        keys.refuse(rock.mass.is_none() && rock.density.is_none(), "mass", what, cure)?;
        keys.above_zero(&[("mass", rock.mass, " kg"), ("density", rock.density, " kg/m3")])?;
        check_shape(rock, &keys, scene)?;
        let name = rock.name.clone();
        if let Some(other) = rocks[..at].iter().position(|r| r.name == name) {
            let what = format!("two rocks are named `{name}`: number {} and {}", other + 1, at + 1);
            let cure = format!("a name of its own, as name = \"{name}_{}\"", at + 1);
            keys.refuse(true, "name", what, cure)?;
        }
    }
    Ok(())
}

/// Shape, scale and cluster.
fn check_shape(rock: &mut RockSettings, keys: &Keys, scene: &Scene) -> Checked {
    rock.shape.check().map_err(|(name, what)| keys.invalid(&format!("shape.{name}"), what))?;
    let scale = rock.scale.unwrap_or(1.0);
    let what =
        format!("scale = {scale}: it must lie above 0, from {:e} to {:e}", LENGTHS.start(), LENGTHS.end());
    let cure = "1 leaves the rock as it is, 2 doubles its edges";
    keys.refuse(!LENGTHS.contains(&scale), "scale", what, cure)?;
    if let Shape::Mesh { file, .. } = &mut rock.shape {
        *file = absolute(file, scene);
    }
    let cluster = rock.cluster.get_or_insert_default();
    let is_box = matches!(rock.shape, Shape::Box { .. });
    let medial = !is_box || cluster.method == Some(Method::Medial);
    let what = "a lattice fills a box, not this shape";
    let cure = "leave `method` out";
    keys.refuse(!is_box && cluster.method == Some(Method::Lattice), "cluster.method", what, cure)?;
    let (fit, smallest) = (cluster.fit.is_some(), cluster.smallest_radius.is_some());
    if let Some(file) = &mut cluster.file {
        *file = absolute(file, scene);
        return keys.beside_file(
            "the cluster is",
            &[
                ("cluster.spheres", cluster.spheres.is_some()),
                ("cluster.method", cluster.method.is_some()),
                ("cluster.fit", fit),
                ("cluster.smallest_radius", smallest),
                ("cluster.largest_error", cluster.largest_error.is_some()),
            ],
        );
    }
    if let (Shape::Sphere { .. }, Some(n)) = (&rock.shape, cluster.spheres) {
        let what = format!("a sphere is one sphere, not {n}");
        keys.refuse(n != 1, "cluster.spheres", what, "leave `cluster` out")?;
    }
    let spheres = *cluster.spheres.get_or_insert(match rock.shape {
        // As many as fill the box evenly, so that who asks for nothing hears nothing.
        Shape::Box { size } if !medial => {
            Lattice::within(size, IN_A_BOX).map_or(IN_A_BOX, |l| l.total() as u32)
        }
        Shape::Box { .. } => IN_A_BOX,
        Shape::Sphere { .. } => 1,
        _ => 500,
    });
    let what = format!("{spheres} spheres: 1 to {MOST_SPHERES} are possible");
    keys.refuse(!(1..=MOST_SPHERES).contains(&spheres), "cluster.spheres", what, "")?;
    for (name, there) in [("fit", fit), ("smallest_radius", smallest)] {
        let what = format!("`{name}` belongs to the method `medial`");
        let cure = "write cluster.method = \"medial\"";
        keys.refuse(there && !medial, &format!("cluster.{name}"), what, cure)?;
    }
    keys.above_zero(&[("cluster.largest_error", cluster.largest_error, " m")])?;
    keys.not_negative(&[("cluster.smallest_radius", cluster.smallest_radius, " m")])
}

/// A path of the scene that means the same from anywhere.
pub(super) fn absolute(file: &Path, scene: &Scene) -> PathBuf {
    let path = scene.resolve(file);
    std::path::absolute(&path).unwrap_or(path)
}
