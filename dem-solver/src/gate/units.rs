//! Units: values that are right in another unit than the one that the scene is written in.

use crate::geometry::sphere::extent;
use crate::rock::Rock;
use crate::settings::{ContactSettings, GranularSettings, RockSettings, Shape, SpheresSettings};
use interface_defs::toolkit::input_error::InputError;
use interface_defs::toolkit::scene::Scene;

/// Overlap over the radius beyond which the answer is not to be trusted; the bound of `[limits] penetration`.
pub const LIMIT: f64 = 0.5;
/// Density of rock and concrete [kg/m3]; and what no solid has.
const DENSITY: [f64; 2] = [1_000.0, 4_000.0];
const ANY_SOLID: [f64; 2] = [100.0, 25_000.0];
const OF_ROCK: &str = "rock has 2000 to 3000 kg/m3";
/// Longest edge of a rock of which nothing is said, and of one that is refused [m].
const LARGE: f64 = 20.0;
const LARGEST: f64 = 30.0;
/// Longest edge below which something is said [m].
const SMALL: f64 = 2e-3;
/// Least modulus [Pa]: a rubber has 1e6, a gel 1e3. There is no largest one: who wants no overlap writes what no solid has.
const SOFTEST: f64 = 1e3;
/// Largest volume of a norm rock of which nothing is said [m3].
const LARGEST_NORM: f64 = 20.0;
/// Kilograms per cubic metre of a pound per cubic foot, and the densities of rock for which that is asked.
const POUNDS: f64 = 16.018_463;
const OF_STONE: [f64; 2] = [2_000.0, 3_500.0];
/// Share of a box that spheres fill, below which something is said.
const EMPTY: f64 = 1e-6;
/// Damping ratio beyond which a contact does not rebound, and that which no one can mean.
const CRITICAL: f64 = 1.0;
const OVERDAMPED: f64 = 5.0;
/// Rolling friction at which a ball rests on a slope of 45 degrees.
const STEEP: f64 = 1.0;
/// Coulomb coefficient from which on an angle is the likelier meaning.
const ANGLE: f64 = 2.0;
/// Speeds of which something is said, and which are refused [m/s].
const FAST: f64 = 60.0;
const FASTEST: f64 = 1_000.0;
/// Spin of which something is said [rad/s]: no rock was seen to turn as fast.
const SPIN: f64 = 60.0;

/// A rock of a scene, with its edges.
struct RockOfScene<'a> {
    at: usize,
    rock: &'a Rock,
    table: &'a RockSettings,
    /// Edges of the box around it, in words.
    edges: String,
    /// The longest of them [m].
    longest: f64,
}

/// Of rock number `at`: refuse what no one can mean; else what the user should know.
pub fn of_rock(
    at: usize,
    rock: &Rock,
    table: &RockSettings,
    scene: &Scene,
) -> Result<Vec<String>, InputError> {
    let (points, _) = rock.solid.surface();
    let size = extent(points.iter().map(|p| (*p, 0.0)));
    let longest = size.iter().copied().fold(0.0, f64::max);
    let edges = format!("{} m x {} m x {} m", short(size[0]), short(size[1]), short(size[2]));
    let it = RockOfScene { at, rock, table, edges, longest };
    let mut warnings = it.size(scene)?;
    warnings.extend(it.density(scene)?);
    if let Some(bound) = table.cluster.as_ref().and_then(|c| c.largest_error).filter(|bound| *bound > longest)
    {
        warnings.push(format!(
            "rock.{at}.cluster.largest_error: {bound} m is more than the longest edge of rock `{}`, so every cluster keeps it; \
             20 mm is 0.02",
            rock.name
        ));
    }
    warnings.extend(it.speed(scene)?);
    warnings.extend(of_turning(at, rock, table));
    Ok(warnings)
}

impl RockOfScene<'_> {
    fn refuse(&self, scene: &Scene, key: &str, what: &str, cure: String) -> InputError {
        let key = format!("rock.{}.{key}", self.at);
        scene.invalid(&key, format!("rock `{}`: {what}", self.rock.name)).try_instead(cure)
    }

    fn size(&self, scene: &Scene) -> Result<Vec<String>, InputError> {
        let (at, name, edges) = (self.at, &self.rock.name, &self.edges);
        let in_metres = in_metres(self.longest, &self.table.shape);
        if self.longest > LARGEST {
            return Err(self.refuse(scene, "shape", &format!("it is {edges} large"), in_metres));
        }
        let mut warnings = Vec::new();
        if !(SMALL..=LARGE).contains(&self.longest) {
            warnings.push(format!("rock.{at}.shape: rock `{name}` is {edges} large; {in_metres}"));
        }
        if let Shape::NormRock { volume, .. } = self.table.shape.scaled(self.table.scale.unwrap_or(1.0))
            && volume > LARGEST_NORM
        {
            warnings.push(format!(
                "rock.{at}.shape.volume: rock `{name}` has {} m3, and norm rocks have up to 2; were it in litres, it would be {} m3",
                short(volume),
                short(1e-3 * volume)
            ));
        }
        Ok(warnings)
    }

    fn density(&self, scene: &Scene) -> Result<Option<String>, InputError> {
        let (mass, volume, edges) = (self.rock.mass, self.rock.solid.volume(), &self.edges);
        let density = mass / volume;
        if let Some((what, cure)) = self.table.density.and_then(of_no_solid) {
            return Err(self.refuse(scene, "density", &what, cure));
        }
        if density < ANY_SOLID[0] && (DENSITY[0]..=DENSITY[1]).contains(&(1e3 * density)) {
            let what = format!(
                "a mass of {} kg in {} m3 ({edges}), a density of {} kg/m3, as in tonnes",
                short(mass),
                short(volume),
                short(density)
            );
            return Err(self.refuse(scene, "mass", &what, format!("in kg that is mass = {:?}", 1e3 * mass)));
        }
        if (DENSITY[0]..=DENSITY[1]).contains(&density) {
            return Ok(None);
        }
        let key = if self.table.density.is_some() { "density" } else { "mass" };
        let pounds = POUNDS * density;
        let pounds = if (OF_STONE[0]..=OF_STONE[1]).contains(&pounds) {
            format!("; were it in lb/ft3, it would be {} kg/m3", short(pounds))
        } else {
            String::new()
        };
        Ok(Some(format!(
            "rock.{}.{key}: rock `{}` has a density of {} kg/m3: {} kg in {} m3 ({edges}); {OF_ROCK}{pounds}",
            self.at,
            self.rock.name,
            short(density),
            short(mass),
            short(volume)
        )))
    }

    fn speed(&self, scene: &Scene) -> Result<Option<String>, InputError> {
        let speed = norm(&self.table.velocity);
        if speed > FASTEST {
            let what = format!("a speed of {} m/s", short(speed));
            return Err(self.refuse(
                scene,
                "velocity",
                &what,
                "it is written in m/s; 25 m/s are 90 km/h".into(),
            ));
        }
        Ok((speed > FAST).then(|| {
            format!(
                "rock.{}.velocity: rock `{}` starts with {} m/s, {} km/h; were it in km/h, it would be {} m/s",
                self.at,
                self.rock.name,
                short(speed),
                short(3.6 * speed),
                short(speed / 3.6)
            )
        }))
    }
}

/// Of `[[spheres]]` number `at`: refuse a density that no solid has; else what the user should know.
pub fn of_spheres(at: usize, group: &SpheresSettings, scene: &Scene) -> Result<Option<String>, InputError> {
    if let Some((what, cure)) = of_no_solid(group.density) {
        let what = format!("spheres `{}`: {what}", group.name);
        return Err(scene.invalid(&format!("spheres.{at}.density"), what).try_instead(cure));
    }
    let speed = norm(&group.velocity).max(group.velocity_scatter);
    if speed > FASTEST {
        let key = if norm(&group.velocity) > FASTEST { "velocity" } else { "velocity_scatter" };
        return Err(scene
            .invalid(
                &format!("spheres.{at}.{key}"),
                format!("spheres `{}`: a speed of {} m/s", group.name, short(speed)),
            )
            .try_instead("it is written in m/s; 25 m/s are 90 km/h"));
    }
    let usual = (DENSITY[0]..=DENSITY[1]).contains(&group.density);
    Ok((!usual).then(|| {
        format!(
            "spheres.{at}.density: spheres `{}` have a density of {} kg/m3; {OF_ROCK}",
            group.name,
            short(group.density)
        )
    }))
}

/// What is said of a [box] in which all spheres together are next to nothing.
pub fn of_region(settings: &GranularSettings) -> Option<String> {
    let sides = settings.sides.as_ref()?;
    let edges = [0, 1, 2].map(|axis| sides.highest[axis] - sides.lowest[axis]);
    let largest = settings.spheres.iter().map(|group| group.radii()[1]).fold(0.0, f64::max);
    let ball = |group: &SpheresSettings| group.total() as f64 * 4.2 * group.radii()[1].powi(3);
    let share = settings.spheres.iter().map(ball).sum::<f64>() / edges.iter().product::<f64>();
    (share < EMPTY).then(|| {
        let [x, y, z] = edges.map(short);
        format!(
            "box: {x} m x {y} m x {z} m for spheres of up to {} m radius, which fill {share:.0e} of it; lengths are in metres: \
             200 mm is 0.2",
            short(largest)
        )
    })
}

/// What is wrong with a density [kg/m3] that no solid has, and what it may have been.
fn of_no_solid(density: f64) -> Option<(String, String)> {
    if (ANY_SOLID[0]..=ANY_SOLID[1]).contains(&density) {
        return None;
    }
    let likely = [1e3, 1e-3, 1e-6].into_iter().find(|f| (DENSITY[0]..=DENSITY[1]).contains(&(f * density)));
    let unit = match likely {
        Some(f) if f > 1.0 => ", as in g/cm3 or t/m3",
        Some(_) => ", as in g/m3 or mg/m3",
        None => "",
    };
    let cure = likely
        .map_or("rock has 2600 kg/m3".into(), |f| format!("in kg/m3 that is density = {:?}", f * density));
    Some((format!("a density of {} kg/m3{unit}", short(density)), cure))
}

fn of_turning(at: usize, rock: &Rock, table: &RockSettings) -> Vec<String> {
    let mut warnings = Vec::new();
    let spin = norm(&table.angular_velocity);
    if spin > SPIN {
        warnings.push(format!(
            "rock.{at}.angular_velocity: rock `{}` spins with {} rad/s, {} turns a second; were it in degrees per second, it would be {} rad/s",
            rock.name,
            short(spin),
            short(spin / std::f64::consts::TAU),
            short(spin.to_radians())
        ));
    }
    let length = norm(&table.orientation);
    if !(0.5..=2.0).contains(&length) {
        warnings.push(format!(
            "rock.{at}.orientation: rock `{}`: its orientation is a quaternion [w, x, y, z] of length {}, which is scaled to 1; an angle a in radians \
             about the unit axis e is [cos(a/2), sin(a/2) e]",
            rock.name,
            short(length)
        ));
    }
    if table.orientation == [0.0, 0.0, 0.0, 1.0] {
        warnings.push(format!(
            "rock.{at}.orientation: rock `{}`: the orientation [0, 0, 0, 1] is half a turn about z, as the order is [w, x, y, z]; no turn is \
             [1, 0, 0, 0]",
            rock.name
        ));
    }
    warnings
}

/// Of `[[contact]]` number `number`.
pub fn of_contact(
    number: usize,
    contact: &ContactSettings,
    scene: &Scene,
) -> Result<Vec<String>, InputError> {
    for (key, value) in [("young", contact.young), ("partner_young", contact.partner_young)] {
        if let Some(e) = value.filter(|e| *e < SOFTEST) {
            return Err(scene
                .invalid(&format!("contact.{number}.{key}"), format!("a Young's modulus of {e:e} Pa"))
                .try_instead(format!("30 GPa are {key} = 30e9: here perhaps {key} = {:e}", e * 1e9)));
        }
    }
    let mut warnings = Vec::new();
    let friction = contact.friction;
    if friction > ANGLE && friction < 90.0 {
        warnings.push(format!(
            "contact.{number}.friction: a friction of {}, at which slopes of {:.0} degrees hold; were it an angle in degrees, \
             its coefficient would be {:.3}",
            short(friction),
            friction.atan().to_degrees(),
            friction.to_radians().tan()
        ));
    }
    if let Some(fast) = contact.friction_dynamic.filter(|fast| *fast > friction) {
        warnings.push(format!(
            "contact.{number}.friction_dynamic: {} in fast slip is more than friction = {} at rest, and what slips resists less; \
             are the two exchanged?",
            short(fast),
            short(friction)
        ));
    }
    if let Some(ratio) = contact.damping_ratio.filter(|ratio| *ratio > CRITICAL) {
        let what = format!("a damping ratio of {}, and a contact at 1 does not rebound", short(ratio));
        let percent = format!("{} % is damping_ratio = {}", short(ratio), short(0.01 * ratio));
        if ratio > OVERDAMPED {
            return Err(scene.invalid(&format!("contact.{number}.damping_ratio"), what).try_instead(percent));
        }
        warnings.push(format!("contact.{number}.damping_ratio: {what}; {percent}"));
    }
    if contact.rolling_friction > STEEP {
        warnings.push(format!(
            "contact.{number}.rolling_friction: a rolling friction of {}, at which nothing rolls down a slope of {:.0} degrees; it \
             is a length over the radius, without unit: 0.1 is much",
            short(contact.rolling_friction),
            contact.rolling_friction.atan().to_degrees()
        ));
    }
    Ok(warnings)
}

/// How a rock whose longest edge is `longest` [m] may have been meant.
fn in_metres(longest: f64, shape: &Shape) -> String {
    let large = longest > LARGE;
    if let Shape::Mesh { scale, .. } = shape {
        return match (large, longest > 200.0) {
            (true, false) => format!("in centimetres? Then write scale = {:?}", 1e-2 * scale),
            (true, true) => format!("in millimetres? Then write scale = {:?}", 1e-3 * scale),
            (false, _) if *scale < 1.0 => "is the file in metres? Then leave scale out".into(),
            (false, _) => format!("in kilometres? Then write scale = {:?}", 1e3 * scale),
        };
    }
    let [unit, value] = match (large, longest > 200.0) {
        (true, false) => ["centimetres", &short(1e-2 * longest)],
        (true, true) => ["millimetres", &short(1e-3 * longest)],
        (false, _) => ["kilometres", &short(1e3 * longest)],
    };
    format!("lengths are in metres; were they in {unit}, it would be {value} m long")
}

fn norm(values: &[f64]) -> f64 {
    values.iter().map(|v| v * v).sum::<f64>().sqrt()
}

/// Four digits are enough for a hint.
pub(super) fn short(value: f64) -> String {
    interface_defs::toolkit::summary::short(format!("{value:.3e}").parse().unwrap_or(value))
}
