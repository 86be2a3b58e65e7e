//! `[[spheres]]` and `[box]`: many separate spheres, and the walls around them.

use interface_defs::toolkit::input_error::InputError;
use interface_defs::toolkit::scene::Scene;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Most spheres of a scene.
pub const MOST: usize = 10_000_000;

/// Separate spheres that differ in radius and place, instead of rocks.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SpheresSettings {
    /// Name. Default `spheres`, for further ones `spheres_2`, ...
    #[serde(default)]
    pub name: String,
    /// Name of their material, for `[[contact]] between`. Default `rock`.
    #[serde(default = "rock")]
    pub material: String,
    /// How many.
    pub count: usize,
    /// Smallest and largest radius [m]; in between all are equally likely.
    pub radius: [f64; 2],
    /// Density [kg/m3].
    pub density: f64,
    /// Lowest corner of the region that they are placed in [m]. Default: the box.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub lowest: Option<[f64; 3]>,
    /// Highest corner of that region [m]. Default: the box.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub highest: Option<[f64; 3]>,
    /// Velocity [m/s]. Default 0.
    #[serde(default)]
    pub velocity: [f64; 3],
    /// Largest deviation of each component of the velocity from that [m/s], all equally likely. Default 0.
    #[serde(default)]
    pub velocity_scatter: f64,
    /// Seed of radii, places and velocities: equal seeds, equal spheres. Default 1.
    #[serde(default = "one")]
    pub seed: u64,
}

/// Six fixed planes, inside of which the separate spheres are.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BoxSettings {
    /// Lowest corner [m].
    pub lowest: [f64; 3],
    /// Highest corner [m].
    pub highest: [f64; 3],
    /// Sides that are left out: `-x`, `+x`, `-y`, `+y`, `-z`, `+z`. Default none.
    #[serde(default)]
    pub open: Vec<String>,
    /// Name of its material. Default `wall`.
    #[serde(default = "wall")]
    pub material: String,
}

/// Names of the sides of a box, by axis, lower first.
pub const SIDES: [&str; 6] = ["-x", "+x", "-y", "+y", "-z", "+z"];

fn rock() -> String {
    "rock".into()
}

fn wall() -> String {
    "wall".into()
}

fn one() -> u64 {
    1
}

impl BoxSettings {
    /// Refuse what makes no sense.
    pub(super) fn check(&self, scene: &Scene) -> Result<(), InputError> {
        if let Some(axis) = (0..3).find(|a| self.highest[*a] <= self.lowest[*a]) {
            let (low, high) = (self.lowest[axis], self.highest[axis]);
            return Err(scene
                .invalid("box.highest", format!("the box reaches from {low} to {high} m"))
                .try_instead("exchange them: `lowest` is the corner with the smaller numbers"));
        }
        if let Some(side) = self.open.iter().find(|side| !SIDES.contains(&side.as_str())) {
            return Err(scene
                .invalid("box.open", format!("a box has no side `{side}`"))
                .try_instead(format!("its sides are {}", SIDES.join(", "))));
        }
        Ok(())
    }
}

/// Fill in names and regions; refuse what makes no sense.
pub(super) fn complete(
    groups: &mut [SpheresSettings],
    walls: Option<&BoxSettings>,
    scene: &Scene,
) -> Result<(), InputError> {
    let mut total = 0_usize;
    for (at, group) in groups.iter_mut().enumerate() {
        let invalid = |key: &str, what: String| scene.invalid(&format!("spheres.{at}.{key}"), what);
        if group.name.is_empty() {
            group.name = if at == 0 { "spheres".into() } else { format!("spheres_{}", at + 1) };
        }
        total = total.saturating_add(group.count);
        if group.count == 0 || total > MOST {
            return Err(invalid("count", format!("{total} spheres in all: 1 to {MOST} are possible")));
        }
        let [least, most] = group.radius;
        if !(least > 0.0 && most >= least) {
            let what = format!("radii from {least} to {most} m: both must lie above 0, the smaller first");
            return Err(invalid("radius", what).try_instead(format!(
                "radius = [{}, {}]",
                least.min(most).abs(),
                least.max(most).abs()
            )));
        }
        if group.density <= 0.0 {
            return Err(invalid(
                "density",
                format!("a density of {} kg/m3: it must lie above 0", group.density),
            ));
        }
        if group.velocity_scatter < 0.0 {
            let what = format!("a scatter of {} m/s: it must be 0 or more", group.velocity_scatter);
            return Err(invalid("velocity_scatter", what));
        }
        let missing = |key: &str| {
            invalid("count", format!("`{}` has no `{key}`, and there is no [box]", group.name))
                .try_instead("give the region with lowest and highest, or add a table [box]")
        };
        let lowest = group.lowest.or(walls.map(|b| b.lowest)).ok_or_else(|| missing("lowest"))?;
        let highest = group.highest.or(walls.map(|b| b.highest)).ok_or_else(|| missing("highest"))?;
        if let Some(axis) = (0..3).find(|a| highest[*a] - lowest[*a] < 2.0 * most) {
            let room = highest[axis] - lowest[axis];
            return Err(invalid("radius", format!("the region is {room} m wide, a sphere {} m", 2.0 * most))
                .try_instead("lengths are in metres: 9 mm is 0.009"));
        }
        (group.lowest, group.highest) = (Some(lowest), Some(highest));
    }
    Ok(())
}
