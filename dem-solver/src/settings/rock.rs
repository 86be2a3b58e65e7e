//! `[[rock]]`: a rigid body and the spheres that stand for it in contact.

use interface_defs::toolkit::input_error::InputError;
use interface_defs::toolkit::scene::Scene;
use serde::{Deserialize, Serialize};

/// Most spheres of a cluster.
pub const MOST_SPHERES: u32 = 27_000;

/// One `[[rock]]`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
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
    /// The spheres that stand for the solid in contact. Default: a box has 64, a sphere is one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cluster: Option<Cluster>,
}

/// The true solid, centred in its own axes.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(tag = "type", rename_all = "snake_case", deny_unknown_fields)]
pub enum Shape {
    /// A box.
    Box {
        /// Edge lengths along x, y, z [m].
        size: [f64; 3],
    },
    /// A sphere.
    Sphere {
        /// Radius [m].
        radius: f64,
    },
}

/// `cluster` of a rock.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Cluster {
    /// Number of spheres, 1 to 27 000. A cube takes the nearest cube number.
    pub spheres: u32,
}

impl Default for Cluster {
    fn default() -> Self {
        Self { spheres: 64 }
    }
}

fn rock_material() -> String {
    "rock".into()
}

fn no_turn() -> [f64; 4] {
    [1.0, 0.0, 0.0, 0.0]
}

/// Fill in names and clusters; refuse what makes no sense.
pub(super) fn complete(rocks: &mut [RockSettings], scene: &Scene) -> Result<(), InputError> {
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
            return Err(scene.invalid(&format!("rock.{at}.name"), what));
        }
    }
    Ok(())
}

fn check_mass(rock: &RockSettings, key: &dyn Fn(&str) -> String, scene: &Scene) -> Result<(), InputError> {
    match (rock.mass, rock.density) {
        (Some(_), Some(_)) => Err(scene
            .invalid(&key("density"), "mass and density together say one thing twice")
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
) -> Result<(), InputError> {
    match rock.shape {
        Shape::Box { size } => {
            if let Some(bad) = size.iter().find(|a| **a <= 0.0) {
                return Err(
                    scene.invalid(&key("shape.size"), format!("an edge of {bad} m: it must lie above 0"))
                );
            }
            let cluster = rock.cluster.get_or_insert_default();
            if !(1..=MOST_SPHERES).contains(&cluster.spheres) {
                let what = format!("{} spheres: 1 to {MOST_SPHERES} are possible", cluster.spheres);
                return Err(scene.invalid(&key("cluster.spheres"), what));
            }
        }
        Shape::Sphere { radius } => {
            if radius <= 0.0 {
                let what = format!("a radius of {radius} m: it must lie above 0");
                return Err(scene.invalid(&key("shape.radius"), what));
            }
            if let Some(cluster) = rock.cluster.filter(|c| c.spheres != 1) {
                let what = format!("a sphere is one sphere, not {}", cluster.spheres);
                return Err(scene.invalid(&key("cluster.spheres"), what).try_instead("leave `cluster` out"));
            }
        }
    }
    Ok(())
}
