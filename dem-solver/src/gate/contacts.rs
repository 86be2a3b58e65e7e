//! Units of a contact: moduli, friction, damping and the properties of yielding ground.

use super::units::{of_no_solid, short};
use crate::settings::ContactSettings;
use interface_defs::diagnostic::Diagnostic;
use interface_defs::toolkit::scene::Scene;

/// Least modulus [Pa]: a rubber has 1e6, a gel 1e3. There is no largest one: who wants no overlap writes what no solid has.
const SOFTEST: f64 = 1e3;
/// Damping ratio beyond which a contact does not rebound, and that which no one can mean.
const CRITICAL: f64 = 1.0;
const OVERDAMPED: f64 = 5.0;
/// Rolling friction at which a ball rests on a slope of 45 degrees.
const STEEP: f64 = 1.0;
/// Coulomb coefficient from which on an angle is the likelier meaning.
const ANGLE: f64 = 2.0;

/// Properties of yielding ground.
struct Strength {
    key: &'static str,
    unit: &'static str,
    /// Least value that someone can mean, and below which something is said: peat has 2e5 Pa and more.
    least: f64,
    soft: f64,
    /// In words.
    usual: &'static str,
    /// Larger units, and how much of `unit` they are.
    units: [(&'static str, f64); 2],
}

const OF_GROUND: [Strength; 3] = [
    Strength {
        key: "ground_modulus",
        unit: "Pa",
        least: 1e3,
        soft: 1e5,
        usual: "peat has 2e5 Pa, pasture soil 1.5e7",
        units: [("MPa", 1e6), ("kPa", 1e3)],
    },
    Strength {
        key: "ground_pressure",
        unit: "Pa",
        least: 1e2,
        soft: 1e4,
        usual: "soft soil has 1e5 Pa and more",
        units: [("MPa", 1e6), ("kPa", 1e3)],
    },
    Strength {
        key: "ground_stiffness",
        unit: "N/m",
        least: 1e2,
        soft: 1e4,
        usual: "soil under a block of a tonne has some 4e5 N/m",
        units: [("MN/m", 1e6), ("kN/m", 1e3)],
    },
];

/// Of `[[contact]]` number `number`.
pub fn of_contact(
    number: usize,
    contact: &ContactSettings,
    scene: &Scene,
) -> Result<Vec<String>, Diagnostic> {
    for (key, value) in [("young", contact.young), ("partner_young", contact.partner_young)] {
        if let Some(e) = value.filter(|e| *e < SOFTEST) {
            return Err(scene
                .invalid(&format!("contact.{number}.{key}"), format!("a Young's modulus of {e:e} Pa"))
                .try_instead(format!("30 GPa are {key} = 30e9: here perhaps {key} = {:e}", e * 1e9)));
        }
    }
    let mut warnings = Vec::new();
    warnings.extend(of_ground(number, contact, scene)?);
    let friction = contact.friction;
    let coefficients = [
        ("friction", Some(friction)),
        ("friction_max", contact.friction_max),
        ("friction_dynamic", contact.friction_dynamic),
    ];
    for (key, value) in coefficients {
        if let Some(value) = value.filter(|value| *value > ANGLE && *value < 90.0) {
            warnings.push(format!(
                "contact.{number}.{key}: a friction of {}, at which slopes of {:.0} degrees hold; were it an angle in degrees, \
                 its coefficient would be {:.3}",
                short(value),
                value.atan().to_degrees(),
                value.to_radians().tan()
            ));
        }
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

/// Properties of yielding ground, with its density.
fn of_ground(number: usize, contact: &ContactSettings, scene: &Scene) -> Result<Vec<String>, Diagnostic> {
    let place = |key: &str| format!("contact.{number}.{key}");
    if let Some((what, cure)) =
        contact.ground_density.and_then(|density| of_no_solid("ground_density", density))
    {
        return Err(scene.invalid(&place("ground_density"), what).try_instead(cure));
    }
    let mut warnings = Vec::new();
    for it in &OF_GROUND {
        let value = contact.own.get(it.key);
        let value = value.and_then(|v| v.as_float().or_else(|| v.as_integer().map(|whole| whole as f64)));
        let Some(value) = value.filter(|value| *value < it.soft) else { continue };
        let what = format!("{} = {} {}: {}", it.key, short(value), it.unit, it.usual);
        // The unit in which it is as hard as ground, the larger ones first where it is next to nothing.
        let (unit, factor) = it.units[usize::from(value >= it.least)];
        if value < it.least {
            let cure = format!("were it in {unit}, it would be {} = {:e}", it.key, factor * value);
            return Err(scene.invalid(&place(it.key), what).try_instead(cure));
        }
        let in_unit = format!("were it in {unit}, it would be {:e} {}", factor * value, it.unit);
        warnings.push(format!("{}: {what}; {in_unit}", place(it.key)));
    }
    Ok(warnings)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(keys: &str) -> Result<Vec<String>, String> {
        let contact: ContactSettings = toml::from_str(keys).expect("a table");
        let scene = Scene::from_text("s.toml", &format!("[[contact]]\n{keys}\n")).expect("a scene");
        of_contact(0, &contact, &scene).map_err(|e| e.to_string())
    }

    #[test]
    fn ground_in_other_units_is_refused_or_doubted() {
        let law = "law = \"ground\"\nrestitution = 0.3\nfriction = 0.5\nstiffness_ratio = 0.8\n";
        for (keys, words) in [
            ("ground_modulus = 12", "were it in MPa, it would be ground_modulus = 1.2e7"),
            ("ground_pressure = 0.5", "were it in MPa, it would be ground_pressure = 5e5"),
            ("ground_stiffness = 0.4", "were it in MN/m, it would be ground_stiffness = 4e5"),
            ("ground_modulus = 15e6\nground_density = 1.7", "in kg/m3 that is ground_density = 1700.0"),
        ] {
            let refused = of(&format!("{law}{keys}")).expect_err(keys);
            assert!(refused.contains("s.toml:6") || refused.contains("s.toml:7"), "{refused}");
            assert!(refused.contains(words), "{refused}");
        }
        for (keys, words) in [
            ("ground_modulus = 12e3", "were it in kPa, it would be 1.2e7 Pa"),
            ("ground_pressure = 500.0", "were it in kPa, it would be 5e5 Pa"),
            ("ground_stiffness = 400.0", "were it in kN/m, it would be 4e5 N/m"),
            (
                "preset = \"meadow\"\nfriction_max = 40.0",
                "were it an angle in degrees, its coefficient would be 0.839",
            ),
        ] {
            let law = if keys.starts_with("preset") { "" } else { law };
            let warned = of(&format!("{law}{keys}")).expect(keys);
            assert!(warned.len() == 1 && warned[0].contains(words), "{warned:?}");
        }
        for preset in crate::law::presets::ALL {
            assert_eq!(of(&format!("preset = \"{}\"", preset.name)), Ok(Vec::new()));
        }
    }
}
