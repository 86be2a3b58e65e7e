//! Kinds of ground by name: values for `preset = "..."` of `[[contact]]`, which fill in what the table does not say.
//!
//! None is calibrated for this solver: restitutions are the means of the classes of Rockyfor3D, halved at 9.144 m/s as in
//! Pfeiffer and Bowen; friction is that of the classes of RAMMS; the modulus of pasture soil is that fitted by Lu et al. (2019) to
//! scars at Chant Sura, the other moduli are assumed. They are starting points of a calibration.

/// A kind of ground.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Preset {
    /// As the scene writes it.
    pub name: &'static str,
    /// Modulus in a plate test [Pa].
    pub modulus: f64,
    /// Restitution of a slow impact.
    pub restitution: f64,
    /// Friction: coefficient at first touch, growth [1/m], relaxation [1/s].
    pub friction: [f64; 3],
    /// Where the numbers come from.
    pub source: &'static str,
}

/// Friction to which all of them grow.
const FRICTION_MAX: f64 = 2.0;
/// Tangential over normal stiffness: of Poisson's ratio 0.33.
const STIFFNESS_RATIO: f64 = 0.8;

/// All of them.
pub const ALL: [Preset; 6] = [
    Preset {
        name: "bedrock",
        modulus: 1e10,
        restitution: 0.53,
        friction: [0.8, 4.0, 200.0],
        source: "Rockyfor3D class 6, RAMMS extra hard, modulus assumed",
    },
    Preset {
        name: "scree",
        modulus: 1e8,
        restitution: 0.33,
        friction: [0.35, 2.0, 150.0],
        source: "Rockyfor3D class 3, RAMMS medium, modulus assumed",
    },
    Preset {
        name: "meadow",
        modulus: 15e6,
        restitution: 0.28,
        friction: [0.3, 1.5, 125.0],
        source: "Rockyfor3D class 2, RAMMS medium soft, modulus of Lu et al. (2019)",
    },
    Preset {
        name: "soil",
        modulus: 10e6,
        restitution: 0.23,
        friction: [0.25, 1.25, 100.0],
        source: "Rockyfor3D class 1, RAMMS soft, modulus of Lu et al. (2019)",
    },
    Preset {
        name: "wetland",
        modulus: 3e6,
        restitution: 0.05,
        friction: [0.2, 1.0, 50.0],
        source: "Rockyfor3D class 0 (0, and 0.05 is the least that is computed), RAMMS extra soft, modulus assumed",
    },
    Preset {
        name: "forest",
        modulus: 15e6,
        restitution: 0.28,
        friction: [0.3, 1.5, 125.0],
        source: "the ground of a forest: Rockyfor3D class 2, RAMMS medium soft, modulus assumed as of meadow",
    },
];

/// The preset of that name.
pub fn named(name: &str) -> Option<&'static Preset> {
    ALL.iter().find(|preset| preset.name == name)
}

/// Keys of a table that give way where another stands in it.
const REPLACED: [(&str, &[&str]); 4] = [
    ("ground_modulus", &["ground_stiffness", "ground_pressure"]),
    ("friction_max", &["friction_dynamic"]),
    ("friction_growth", &["friction_dynamic"]),
    ("friction_relaxation", &["friction_dynamic"]),
];

/// What `preset = "name"` adds to a table that has the keys `given`. Of an unknown name that of soil, so that the table can be
/// read and the name be refused.
pub fn fill(name: &str, given: &[String]) -> Vec<(String, toml::Value)> {
    let preset = named(name).unwrap_or(&ALL[3]);
    let [friction, growth, relaxation] = preset.friction;
    let has = |key: &str| given.iter().any(|g| g == key);
    let replaced =
        |key: &str| REPLACED.iter().any(|(own, others)| *own == key && others.iter().any(|o| has(o)));
    let mut all: Vec<(&str, toml::Value)> =
        vec![("law", "ground".into()), ("restitution_law", "pfeiffer_bowen".into())];
    all.extend(
        [
            ("ground_modulus", preset.modulus),
            ("restitution", preset.restitution),
            ("stiffness_ratio", STIFFNESS_RATIO),
            ("friction", friction),
            ("friction_max", FRICTION_MAX),
            ("friction_growth", growth),
            ("friction_relaxation", relaxation),
        ]
        .map(|(key, value)| (key, value.into())),
    );
    all.retain(|(key, _)| !has(key) && !replaced(key));
    all.into_iter().map(|(key, value)| (key.to_owned(), value)).collect()
}
