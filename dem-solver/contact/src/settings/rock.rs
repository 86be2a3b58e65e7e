//! `[[rock]]`: a rigid body and the spheres that stand for it in contact.

use dem_solid::cluster::lattice::Lattice;
use dem_solid::cluster::{Fit, MOST_SPHERES};
use dem_solid::input::LENGTHS;
pub use dem_solid::shape::Shape;
use interface_defs::diagnostic::Diagnostic;
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
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mass: Option<f64>,
    /// Density of the true solid [kg/m3]. Exactly one of `mass` and `density`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub density: Option<f64>,
    /// The true solid: its mass, centre and inertia are the rock's.
    pub shape: Shape,
    /// The spheres that represent the solid in contact.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cluster: Option<Cluster>,
    /// All lengths of the shape and of the spheres that were made for it times this: the same rock, larger or smaller. A mass
    /// stays as it is stated. Default 1.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub scale: Option<f64>,
}

/// The spheres of a rock: made in this number, or read from a file.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Cluster {
    /// Most spheres, 1 to 50 000. A box takes the largest number that fills it as a lattice (a
    /// cube: a cube number); other methods take exactly so many, or fewer on round shapes.
    /// Default: up to 64 for a box, 1 for a sphere, else 500.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub spheres: Option<u32>,
    /// How to place them. Default: `lattice` for a box, else `medial`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub method: Option<Method>,
    /// With `medial`: where the spheres end. Default `volume`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fit: Option<Fit>,
    /// With `medial`: least radius [m]. Small spheres make edges sharp, and are soft: a wire is pulled past
    /// their centre early; what only smaller ones could reach stays uncovered. Default 0: as the error asks for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub smallest_radius: Option<f64>,
    /// Largest distance of the spheres' surface from the true one [m]: a scene that passes it is refused.
    /// A lattice keeps the default but for single spheres.
    /// Default: the smaller one of 15 % of the diagonal of the shape's box and 0.9 radii of the largest ball in it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub largest_error: Option<f64>,
    /// In place of all these: spheres from a file, `x y z r` text or Kratos `.clu`, in the shape's own axes;
    /// relative to the scene file.
    #[serde(skip_serializing_if = "Option::is_none")]
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

impl RockSettings {
    /// A sphere of `radius` [m] and `density` [kg/m3] that starts with this position [m] and velocity [m/s].
    pub fn sphere(
        name: String,
        material: String,
        radius: f64,
        density: f64,
        [position, velocity]: [[f64; 3]; 2],
    ) -> Self {
        Self {
            name,
            material,
            position,
            velocity,
            orientation: no_turn(),
            angular_velocity: [0.0; 3],
            mass: None,
            density: Some(density),
            shape: Shape::Sphere { radius },
            cluster: None,
            scale: None,
        }
    }
}

impl Cluster {
    /// So many spheres.
    pub fn of(spheres: u32) -> Self {
        Self { spheres: Some(spheres), ..Self::default() }
    }
}

/// Most spheres of a box where the scene does not say.
const IN_A_BOX: u32 = 64;

fn rock_material() -> String {
    "rock".into()
}

fn no_turn() -> [f64; 4] {
    [1.0, 0.0, 0.0, 0.0]
}

/// Fill in names and clusters; refuse what makes no sense.
pub(super) fn complete(rocks: &mut [RockSettings], scene: &Scene) -> Result<(), Diagnostic> {
    for at in 0..rocks.len() {
        let key = |name: &str| format!("rock.{at}.{name}");
        let rock = &mut rocks[at];
        if rock.name.is_empty() {
            rock.name = if at == 0 { "rock".into() } else { format!("rock_{}", at + 1) };
        }
        if !rock.name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_' || c == '-') {
            let what = format!("`{}` cannot begin a column: letters, digits, `_` and `-` can", rock.name);
            return Err(scene.invalid(&key("name"), what));
        }
        if rock.orientation.iter().all(|c| *c == 0.0) {
            return Err(scene
                .invalid(&key("orientation"), "a quaternion of zeros is no orientation")
                .try_instead("no turn is [1, 0, 0, 0]"));
        }
        check_mass(rock, &key, scene)?;
        check_shape(rock, &key, scene)?;
        let name = rock.name.clone();
        if let Some(other) = rocks[..at].iter().position(|r| r.name == name) {
            let what = format!("two rocks are named `{name}`: number {} and {}", other + 1, at + 1);
            return Err(scene
                .invalid(&format!("rock.{at}.name"), what)
                .try_instead(format!("a name of its own, as name = \"{name}_{}\"", at + 1)));
        }
    }
    Ok(())
}

fn check_mass(rock: &RockSettings, key: &dyn Fn(&str) -> String, scene: &Scene) -> Result<(), Diagnostic> {
    match (rock.mass, rock.density) {
        (Some(_), Some(_)) => Err(scene
            .invalid(&key("density"), "mass and density together define one thing twice")
            .try_instead("keep one of them")),
        (None, None) => Err(scene
            .invalid(&key("mass"), format!("rock `{}` has neither mass nor density", rock.name))
            .try_instead("write one of them: mass [kg], density [kg/m3]")),
        (Some(m), None) if m <= 0.0 => {
            Err(scene.invalid(&key("mass"), format!("a mass of {m} kg: it must lie above 0")))
        }
        (None, Some(d)) if d <= 0.0 => {
            Err(scene.invalid(&key("density"), format!("a density of {d} kg/m3: it must lie above 0")))
        }
        _ => Ok(()),
    }
}

fn check_shape(
    rock: &mut RockSettings,
    key: &dyn Fn(&str) -> String,
    scene: &Scene,
) -> Result<(), Diagnostic> {
    if let Err((name, what)) = rock.shape.check() {
        return Err(scene.invalid(&key(&format!("shape.{name}")), what));
    }
    if let Some(scale) = rock.scale.filter(|scale| !LENGTHS.contains(scale)) {
        let what = format!(
            "scale = {scale}: it must lie above 0, from {:e} to {:e}",
            LENGTHS.start(),
            LENGTHS.end()
        );
        return Err(scene
            .invalid(&key("scale"), what)
            .try_instead("1 leaves the rock as it is, 2 doubles its edges"));
    }
    if let Shape::Mesh { file, .. } = &mut rock.shape {
        *file = absolute(file, scene);
    }
    let cluster = rock.cluster.get_or_insert_default();
    let medial = match (&rock.shape, cluster.method) {
        (Shape::Box { .. }, method) => method == Some(Method::Medial),
        (_, Some(Method::Lattice)) => {
            return Err(scene
                .invalid(&key("cluster.method"), "a lattice fills a box, not this shape")
                .try_instead("leave `method` out"));
        }
        (_, _) => true,
    };
    if let Some(file) = &mut cluster.file {
        *file = absolute(file, scene);
        let rest = [
            ("spheres", cluster.spheres.is_some()),
            ("method", cluster.method.is_some()),
            ("fit", cluster.fit.is_some()),
            ("smallest_radius", cluster.smallest_radius.is_some()),
            ("largest_error", cluster.largest_error.is_some()),
        ];
        return match rest.iter().find(|(_, there)| *there) {
            Some((name, _)) => Err(scene
                .invalid(&key(&format!("cluster.{name}")), "the cluster is read from a file as it is")
                .try_instead(format!("keep one of `file` and `{name}`"))),
            None => Ok(()),
        };
    }
    if let (Shape::Sphere { .. }, Some(n)) = (&rock.shape, cluster.spheres.filter(|n| *n != 1)) {
        let what = format!("a sphere is one sphere, not {n}");
        return Err(scene.invalid(&key("cluster.spheres"), what).try_instead("leave `cluster` out"));
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
    if !(1..=MOST_SPHERES).contains(&spheres) {
        let what = format!("{spheres} spheres: 1 to {MOST_SPHERES} are possible");
        return Err(scene.invalid(&key("cluster.spheres"), what));
    }
    for (name, there) in
        [("fit", cluster.fit.is_some()), ("smallest_radius", cluster.smallest_radius.is_some())]
    {
        if there && !medial {
            return Err(scene
                .invalid(&key(&format!("cluster.{name}")), format!("`{name}` belongs to the method `medial`"))
                .try_instead("write cluster.method = \"medial\""));
        }
    }
    if let Some(error) = cluster.largest_error.filter(|e| e.is_nan() || *e <= 0.0) {
        let what = format!("an error of {error} m: it must lie above 0");
        return Err(scene.invalid(&key("cluster.largest_error"), what));
    }
    match cluster.smallest_radius {
        Some(r) if r < 0.0 => Err(scene
            .invalid(&key("cluster.smallest_radius"), format!("a radius of {r} m: 0 or more is possible"))),
        _ => Ok(()),
    }
}

/// A path of the scene that means the same from anywhere.
fn absolute(file: &Path, scene: &Scene) -> PathBuf {
    let path = scene.resolve(file);
    std::path::absolute(&path).unwrap_or(path)
}
