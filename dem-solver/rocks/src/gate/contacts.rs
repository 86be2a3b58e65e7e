//! Units of a contact: moduli, friction, damping and the properties of yielding ground.

use super::units::{Judged, doubted, judged, likely, of_no_solid, refused, short};
use dem_contact::settings::ContactSettings;
use interface_defs::diagnostic::Diagnostic;
use toolkit::scene::Scene;

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
pub fn of_contact(number: usize, contact: &ContactSettings, scene: &Scene) -> Judged {
    let mut all = Vec::new();
    for (key, value) in [("young", contact.young), ("partner_young", contact.partner_young)] {
        all.extend(value.filter(|e| *e < SOFTEST).map(|e| {
            let cure = format!("30 GPa are {key} = 30e9: here perhaps {key} = {:e}", e * 1e9);
            refused(key, format!("a Young's modulus of {e:e} Pa"), cure)
        }));
    }
    let density = contact.ground_density.and_then(|density| of_no_solid("ground_density", density));
    all.extend(density.map(|(what, cure)| refused("ground_density", what, cure)));
    all.extend(OF_GROUND.iter().filter_map(|it| it.check(contact)));
    let friction = contact.friction;
    for (key, value) in [
        ("friction", Some(friction)),
        ("friction_max", contact.friction_max),
        ("friction_dynamic", contact.friction_dynamic),
    ] {
        all.extend(value.filter(|value| *value > ANGLE && *value < 90.0).map(|value| {
            let slope = value.atan().to_degrees();
            let what = format!("a friction of {}, at which slopes of {slope:.0} degrees hold", short(value));
            let angle = value.to_radians().tan();
            let cure = format!("were it an angle in degrees, its coefficient would be {angle:.3}");
            likely(key, what, cure)
        }));
    }
    all.extend(contact.friction_dynamic.filter(|fast| *fast > friction).map(|fast| {
        let (fast, slow) = (short(fast), short(friction));
        let what = format!(
            "{fast} in fast slip is more than friction = {slow} at rest, and what slips resists less"
        );
        doubted("friction_dynamic", what, "are the two exchanged?")
    }));
    all.extend(contact.damping_ratio.filter(|ratio| *ratio > CRITICAL).map(|ratio| {
        let what = format!("a damping ratio of {}, and a contact at 1 does not rebound", short(ratio));
        let percent = format!("{} % is damping_ratio = {}", short(ratio), short(0.01 * ratio));
        let found = if ratio > OVERDAMPED { refused } else { likely };
        found("damping_ratio", what, percent)
    }));
    let rolling = contact.rolling_friction;
    if rolling > STEEP {
        let what = format!(
            "a rolling friction of {}, at which nothing rolls down a slope of {:.0} degrees",
            short(rolling),
            rolling.atan().to_degrees()
        );
        let cure = "it is a length over the radius, without unit: 0.1 is much";
        all.push(doubted("rolling_friction", what, cure));
    }
    judged(all, &format!("contact.{number}"), scene)
}

impl Strength {
    fn check(&self, contact: &ContactSettings) -> Option<Diagnostic> {
        let value = contact.own_number(self.key).filter(|value| *value < self.soft)?;
        let what = format!("{} = {} {}: {}", self.key, short(value), self.unit, self.usual);
        // The unit in which it is as hard as ground, the larger ones first where it is next to nothing.
        let (unit, factor) = self.units[usize::from(value >= self.least)];
        let right = factor * value;
        let were = format!("were it in {unit}, it would be");
        Some(match value < self.least {
            true => refused(self.key, what, format!("{were} {} = {right:e}", self.key)),
            false => likely(self.key, what, format!("{were} {right:e} {}", self.unit)),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(keys: &str) -> Result<Vec<Diagnostic>, String> {
        let contact = ContactSettings::of("contact.0", keys.parse().expect("TOML")).expect("a table");
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
            assert!(warned.len() == 1 && warned[0].to_string().contains(words), "{warned:?}");
        }
        for preset in dem_contact::law::presets::ALL {
            assert_eq!(of(&format!("preset = \"{}\"", preset.name)), Ok(Vec::new()));
        }
    }
}
