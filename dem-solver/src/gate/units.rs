//! Units: values that are right in another unit than the one that the scene is written in.

use crate::rock::Rock;
use crate::settings::{ContactSettings, RockSettings, Shape, SpheresSettings};
use interface_defs::toolkit::input_error::InputError;
use interface_defs::toolkit::scene::Scene;

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
/// Coulomb coefficient from which on an angle is the likelier meaning.
const ANGLE: f64 = 2.0;
/// Speeds of which something is said, and which are refused [m/s].
const FAST: f64 = 60.0;
const FASTEST: f64 = 1_000.0;
/// Spin of which something is said [rad/s]: no rock was seen to turn as fast.
const SPIN: f64 = 60.0;

/// Of rock number `at`: refuse what no one can mean; else what the user should know.
pub fn of_rock(
    at: usize,
    rock: &Rock,
    table: &RockSettings,
    scene: &Scene,
) -> Result<Vec<String>, InputError> {
    let mut warnings = Vec::new();
    let refuse = |key: &str, what: String, cure: String| {
        Err(scene
            .invalid(&format!("rock.{at}.{key}"), format!("rock `{}`: {what}", rock.name))
            .try_instead(cure))
    };
    let (points, _) = rock.solid.surface();
    let size = extent(points.iter().map(|p| (*p, 0.0)));
    let longest = size.iter().copied().fold(0.0, f64::max);
    let in_metres = match table.shape {
        Shape::Mesh { scale, .. } => format!("in millimetres? Then write scale = {:?}", 1e-3 * scale),
        _ => "lengths are in metres".into(),
    };
    let edges = format!("{} m x {} m x {} m", short(size[0]), short(size[1]), short(size[2]));
    if longest > LARGEST {
        return refuse("shape", format!("it is {edges} large"), in_metres);
    }
    if !(SMALL..=LARGE).contains(&longest) {
        warnings.push(format!("rock `{}` is {edges} large; {in_metres}", rock.name));
    }
    let volume = rock.solid.volume();
    let density = rock.mass / volume;
    if let Some((what, cure)) = table.density.and_then(of_no_solid) {
        return refuse("density", what, cure);
    }
    if density < ANY_SOLID[0] && (DENSITY[0]..=DENSITY[1]).contains(&(1e3 * density)) {
        let what = format!(
            "a mass of {} kg in {} m3 ({edges}), a density of {} kg/m3, as in tonnes",
            short(rock.mass),
            short(volume),
            short(density)
        );
        return refuse("mass", what, format!("in kg that is mass = {:?}", 1e3 * rock.mass));
    }
    if !(DENSITY[0]..=DENSITY[1]).contains(&density) {
        warnings.push(format!(
            "rock `{}` has a density of {} kg/m3: {} kg in {} m3 ({edges}); {OF_ROCK}",
            rock.name,
            short(density),
            short(rock.mass),
            short(volume)
        ));
    }
    let speed = norm(&table.velocity);
    if speed > FASTEST {
        let what = format!("a speed of {} m/s", short(speed));
        return refuse("velocity", what, "it is written in m/s; 25 m/s are 90 km/h".into());
    }
    if speed > FAST {
        warnings.push(format!(
            "rock `{}` starts with {} m/s, {} km/h; were it in km/h, it would be {} m/s",
            rock.name,
            short(speed),
            short(3.6 * speed),
            short(speed / 3.6)
        ));
    }
    warnings.extend(of_turning(rock, table));
    Ok(warnings)
}

/// Of `[[spheres]]` number `at`: refuse a density that no solid has; else what the user should know.
pub fn of_spheres(at: usize, group: &SpheresSettings, scene: &Scene) -> Result<Option<String>, InputError> {
    if let Some((what, cure)) = of_no_solid(group.density) {
        let what = format!("spheres `{}`: {what}", group.name);
        return Err(scene.invalid(&format!("spheres.{at}.density"), what).try_instead(cure));
    }
    let usual = (DENSITY[0]..=DENSITY[1]).contains(&group.density);
    Ok((!usual).then(|| {
        format!("spheres `{}` have a density of {} kg/m3; {OF_ROCK}", group.name, short(group.density))
    }))
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

fn of_turning(rock: &Rock, table: &RockSettings) -> Vec<String> {
    let mut warnings = Vec::new();
    let spin = norm(&table.angular_velocity);
    if spin > SPIN {
        warnings.push(format!(
            "rock `{}` spins with {} rad/s, {} turns a second; were it in degrees per second, it would be {} rad/s",
            rock.name,
            short(spin),
            short(spin / std::f64::consts::TAU),
            short(spin.to_radians())
        ));
    }
    let length = norm(&table.orientation);
    if !(0.5..=2.0).contains(&length) {
        warnings.push(format!(
            "rock `{}`: its orientation is a quaternion [w, x, y, z] of length {}, which is scaled to 1; an angle a in radians \
             about the unit axis e is [cos(a/2), sin(a/2) e]",
            rock.name,
            short(length)
        ));
    }
    if table.orientation == [0.0, 0.0, 0.0, 1.0] {
        warnings.push(format!(
            "rock `{}`: the orientation [0, 0, 0, 1] is half a turn about z, as the order is [w, x, y, z]; no turn is \
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
    let friction = contact.friction;
    Ok(if friction > ANGLE && friction < 90.0 {
        vec![format!(
            "contact number {}: a friction of {}, at which slopes of {:.0} degrees hold; were it an angle in degrees, its \
             coefficient would be {:.3}",
            number + 1,
            short(friction),
            friction.atan().to_degrees(),
            friction.to_radians().tan()
        )]
    } else {
        Vec::new()
    })
}

/// Edges of the box around some spheres [m].
pub fn extent(spheres: impl Iterator<Item = (nalgebra::Vector3<f64>, f64)>) -> [f64; 3] {
    let nowhere = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    let (low, high) = spheres.fold(nowhere, |(mut low, mut high), (centre, radius)| {
        for axis in 0..3 {
            low[axis] = low[axis].min(centre[axis] - radius);
            high[axis] = high[axis].max(centre[axis] + radius);
        }
        (low, high)
    });
    [0, 1, 2].map(|axis| high[axis] - low[axis])
}

fn norm(values: &[f64]) -> f64 {
    values.iter().map(|v| v * v).sum::<f64>().sqrt()
}

/// Four digits are enough for a hint.
pub(super) fn short(value: f64) -> String {
    interface_defs::toolkit::summary::short(format!("{value:.3e}").parse().unwrap_or(value))
}
