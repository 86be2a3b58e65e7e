//! Kinds of ground by name: values for `preset = "..."` of `[[contact]]`, which fill in what the table does not say.
//!
//! None is calibrated for this solver: restitutions are the means of the classes of Rockyfor3D, halved at 9.144 m/s as in
//! Pfeiffer and Bowen; friction is that of the classes of RAMMS; the modulus of pasture soil is that fitted by Lu et al. (2019) to
//! scars at Chant Sura, the other moduli are assumed. They are starting points of a calibration.

use crate::law::normal::LawName;

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

/// The law whose values they are.
pub const LAW: LawName = LawName::Ground;

/// Friction to which all of them grow.
const FRICTION_MAX: f64 = 2.0;
/// Tangential over normal stiffness: of Poisson's ratio 0.33.
const STIFFNESS_RATIO: f64 = 0.8;

type Text = &'static str;

const fn ground(name: Text, modulus: f64, restitution: f64, friction: [f64; 3], source: Text) -> Preset {
    Preset { name, modulus, restitution, friction, source }
}

const MEADOW: Text = "Rockyfor3D class 2, RAMMS medium soft, modulus of Lu et al. (2019)";
const SOIL: Text = "Rockyfor3D class 1, RAMMS soft, modulus of Lu et al. (2019)";
const WETLAND: Text =
    "Rockyfor3D class 0 (0, and 0.05 is the least that is computed), RAMMS extra soft, modulus assumed";
const FOREST: Text =
    "the ground of a forest: Rockyfor3D class 2, RAMMS medium soft, modulus assumed as of meadow";

/// All of them.
pub const ALL: [Preset; 6] = [
    ground("bedrock", 1e10, 0.53, [0.8, 4.0, 200.0], "Rockyfor3D class 6, RAMMS extra hard, modulus assumed"),
    ground("scree", 1e8, 0.33, [0.35, 2.0, 150.0], "Rockyfor3D class 3, RAMMS medium, modulus assumed"),
    ground("meadow", 15e6, 0.28, [0.3, 1.5, 125.0], MEADOW),
    ground("soil", 10e6, 0.23, [0.25, 1.25, 100.0], SOIL),
    ground("wetland", 3e6, 0.05, [0.2, 1.0, 50.0], WETLAND),
    ground("forest", 15e6, 0.28, [0.3, 1.5, 125.0], FOREST),
];

/// The preset of that name.
pub fn named(name: &str) -> Option<&'static Preset> {
    ALL.iter().find(|preset| preset.name == name)
}

/// What `preset = "name"` adds to a table that does not say it. Of an unknown name that of soil, so that the table can be
/// read and the name be refused.
pub fn fill(table: &mut toml::Table) {
    let Some(name) = table.get("preset").and_then(|name| name.as_str()) else { return };
    let preset = named(name).unwrap_or(&ALL[3]);
    let [friction, growth, relaxation] = preset.friction;
    // With the keys in whose place it stands.
    let all: [(&str, toml::Value, &[&str]); 9] = [
        ("law", LAW.name().into(), &[]),
        ("restitution_law", "pfeiffer_bowen".into(), &[]),
        ("ground_modulus", preset.modulus.into(), &["ground_stiffness", "ground_pressure"]),
        ("restitution", preset.restitution.into(), &[]),
        ("stiffness_ratio", STIFFNESS_RATIO.into(), &[]),
        ("friction", friction.into(), &[]),
        ("friction_max", FRICTION_MAX.into(), &["friction_dynamic"]),
        ("friction_growth", growth.into(), &["friction_dynamic"]),
        ("friction_relaxation", relaxation.into(), &["friction_dynamic"]),
    ];
    for (key, value, others) in all {
        if !others.iter().any(|other| table.contains_key(*other)) {
            table.entry(key).or_insert(value);
        }
    }
}
