//! Units of a contact: moduli, friction, damping and the properties of yielding ground.

use super::units::{DENSITY, Judged, doubted, judged, likely};
use dem_contact::settings::ContactSettings;
use interface_defs::diagnostic::Diagnostic;
use toolkit::numbers::four;
use toolkit::ranges::Gate;
use toolkit::scene::Scene;

const ALL_ABOVE: f64 = f64::INFINITY;
/// Units of ground, of which the smaller one that makes it as hard as ground is the likelier.
const PRESSURES: &[(&str, f64)] = &[("kPa", 1e3), ("MPa", 1e6)];

/// A rubber has 1e6, a gel 1e3. There is no largest one: who wants no overlap writes what no solid has.
const YOUNG: Gate = Gate {
    key: "young",
    unit: "Pa",
    possible: [1e3, ALL_ABOVE],
    usual: [1e3, ALL_ABOVE],
    says: ["is the Young's modulus of no solid", ""],
    units: &[("GPa", 1e9)],
    hint: "30 GPa are 30e9",
};
const PARTNER_YOUNG: Gate = Gate { key: "partner_young", ..YOUNG };
const GROUND_DENSITY: Gate =
    Gate { key: "ground_density", usual: DENSITY.possible, hint: "soil has 1000 to 2200 kg/m3", ..DENSITY };
const GROUND_MODULUS: Gate = Gate {
    key: "ground_modulus",
    unit: "Pa",
    possible: [1e3, ALL_ABOVE],
    usual: [1e5, ALL_ABOVE],
    units: PRESSURES,
    hint: "peat has 2e5 Pa, pasture soil 1.5e7",
    ..Gate::ANY
};
const GROUND_PRESSURE: Gate = Gate {
    key: "ground_pressure",
    unit: "Pa",
    possible: [1e2, ALL_ABOVE],
    usual: [1e4, ALL_ABOVE],
    units: PRESSURES,
    hint: "soft soil has 1e5 Pa and more",
    ..Gate::ANY
};
const GROUND_STIFFNESS: Gate = Gate {
    key: "ground_stiffness",
    unit: "N/m",
    possible: [1e2, ALL_ABOVE],
    usual: [1e4, ALL_ABOVE],
    units: &[("kN/m", 1e3), ("MN/m", 1e6)],
    hint: "soil under a block of a tonne has some 4e5 N/m",
    ..Gate::ANY
};
const DAMPING_RATIO: Gate = Gate {
    key: "damping_ratio",
    possible: [-ALL_ABOVE, 5.0],
    usual: [-ALL_ABOVE, 1.0],
    says: ["", "is more than 1, at which a contact does not rebound"],
    units: &[("per cent", 0.01)],
    ..Gate::ANY
};
/// Rolling friction at which a ball rests on a slope of 45 degrees.
const STEEP: f64 = 1.0;
/// Coulomb coefficient from which on an angle is the likelier meaning.
const ANGLE: f64 = 2.0;

/// Of `[[contact]]` number `number`.
pub fn of_contact(number: usize, contact: &ContactSettings, scene: &Scene) -> Judged {
    let own = |gate: &'static Gate| (contact.own_number(gate.key), gate);
    let numbers = [
        (contact.young, &YOUNG),
        (contact.partner_young, &PARTNER_YOUNG),
        (contact.ground_density, &GROUND_DENSITY),
        (contact.damping_ratio, &DAMPING_RATIO),
        own(&GROUND_MODULUS),
        own(&GROUND_PRESSURE),
        own(&GROUND_STIFFNESS),
    ];
    let found = numbers.into_iter().filter_map(|(value, gate)| gate.judge("", value?));
    let mut all: Vec<_> = found.collect();
    let friction = contact.friction;
    for (key, value) in [
        ("friction", Some(friction)),
        ("friction_max", contact.friction_max),
        ("friction_dynamic", contact.friction_dynamic),
    ] {
        all.extend(value.filter(|value| *value > ANGLE && *value < 90.0).map(|value| {
            let slope = value.atan().to_degrees();
            let what = format!("a friction of {}, at which slopes of {slope:.0} degrees hold", four(value));
            let angle = value.to_radians().tan();
            let cure = format!("were it an angle in degrees, its coefficient would be {angle:.3}");
            likely(key, what, cure)
        }));
    }
    all.extend(contact.friction_dynamic.filter(|fast| *fast > friction).map(|fast| {
        let (fast, slow) = (four(fast), four(friction));
        let what = format!(
            "{fast} in fast slip is more than friction = {slow} at rest, and what slips resists less"
        );
        doubted("friction_dynamic", what, "are the two exchanged?")
    }));
    let rolling = contact.rolling_friction;
    if rolling > STEEP {
        let (rolling, slope) = (four(rolling), rolling.atan().to_degrees());
        let what = format!(
            "a rolling friction of {rolling}, at which nothing rolls down a slope of {slope:.0} degrees"
        );
        let cure = "it is a length over the radius, without unit: 0.1 is much";
        all.push(doubted("rolling_friction", what, cure));
    }
    judged(all, &format!("contact.{number}"), scene)
}

/// What is said of ground that takes no energy from a rock.
pub fn lossless(number: usize, contact: &ContactSettings) -> impl Iterator<Item = Diagnostic> {
    let elastic = [
        ("restitution", contact.restitution == Some(1.0)),
        ("damping_ratio", contact.damping_ratio == Some(0.0)),
    ];
    let bounces = elastic.into_iter().filter(|(_, elastic)| *elastic).map(|(key, _)| {
        let what = "no loss on the ground: a rock rebounds as fast as it came, and never comes to rest";
        (key, what, "rock on rock has a restitution of some 0.3 to 0.6, on soil less")
    });
    let slips = (contact.friction == 0.0).then_some((
        "friction",
        "0 on the ground: a rock slides without end, and does not roll",
        "rock on ground has some 0.4 to 0.8",
    ));
    bounces.chain(slips).map(move |(key, what, cure)| {
        let found = doubted(key, what.into(), cure);
        found.about(format!("contact.{number}.{key}"))
    })
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
            ("ground_modulus = 12", "were it in MPa, it would be 1.2e7 Pa; peat has 2e5 Pa"),
            ("ground_pressure = 0.5", "were it in MPa, it would be 500000 Pa; soft soil has 1e5 Pa"),
            ("ground_stiffness = 0.4", "were it in MN/m, it would be 400000 N/m; soil under a block"),
            (
                "ground_modulus = 15e6\nground_density = 1.7",
                "were it in g/cm3 or t/m3, it would be 1700 kg/m3; soil has",
            ),
        ] {
            let refused = of(&format!("{law}{keys}")).expect_err(keys);
            assert!(refused.contains("s.toml:6") || refused.contains("s.toml:7"), "{refused}");
            assert!(refused.contains(words), "{refused}");
        }
        for (keys, words) in [
            ("ground_modulus = 12e3", "were it in kPa, it would be 1.2e7 Pa"),
            ("ground_pressure = 500.0", "were it in kPa, it would be 500000 Pa"),
            ("ground_stiffness = 400.0", "were it in kN/m, it would be 400000 N/m"),
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
