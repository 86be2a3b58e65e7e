//! `[vary]`: which quantities of the rock and which keys of the scene differ from member to member.

use super::distribution::{Distribution, Spread};
use interface_defs::diagnostic::Diagnostic;
use schemars::JsonSchema;
use serde_json::{Map, Value};
use std::ops::{Bound, RangeBounds};
use toolkit::scene::Scene;

/// Something that varies.
#[derive(Debug, Clone, PartialEq)]
pub struct Variable {
    /// Its key in `[vary]`: a quantity of the rock, or a dotted key of the scene.
    pub name: String,
    /// What.
    pub quantity: Varied,
    /// How.
    pub distribution: Distribution,
    /// Where it stands in the study.
    pub key: String,
}

/// What can vary.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Varied {
    /// Volume of the rock [m3]: its shape and spheres are scaled.
    Volume,
    /// Mass [kg]: the same, by its density.
    Mass,
    /// Density [kg/m3].
    Density,
    /// Its shape, a table as in a scene.
    Shape,
    /// Speed of the start [m/s].
    Speed,
    /// Its direction seen from above, clockwise from +y (north) [degrees].
    Azimuth,
    /// Its angle below the horizontal [degrees].
    Dip,
    /// Angular velocity about an axis of any direction [rad/s].
    Spin,
    /// Height above where the rock would touch the ground [m].
    Height,
    /// A key of the scene.
    Key,
}

/// Quantities by name, with the least and the largest value that is possible; any other name is a key of the scene.
const QUANTITIES: [(&str, Varied, [Bound<f64>; 2]); 9] = [
    ("volume", Varied::Volume, [Bound::Excluded(0.0), Bound::Unbounded]),
    ("mass", Varied::Mass, [Bound::Excluded(0.0), Bound::Unbounded]),
    ("density", Varied::Density, [Bound::Excluded(0.0), Bound::Unbounded]),
    ("shape", Varied::Shape, [Bound::Unbounded; 2]),
    ("speed", Varied::Speed, [Bound::Included(0.0), Bound::Unbounded]),
    ("azimuth", Varied::Azimuth, [Bound::Included(-360.0), Bound::Included(360.0)]),
    ("dip", Varied::Dip, [Bound::Included(-90.0), Bound::Included(90.0)]),
    ("spin", Varied::Spin, [Bound::Included(0.0), Bound::Unbounded]),
    ("height", Varied::Height, [Bound::Included(0.0), Bound::Unbounded]),
];

/// Their names.
fn known() -> String {
    QUANTITIES.map(|(known, ..)| known).join(", ")
}

/// What differs from member to member. A value is a number, or `{ uniform = [low, high] }`, `{ normal = [mean, standard
/// deviation] }`, `{ lognormal = [median, factor] }` (both cut at three deviations or `within = [low, high]`), `{ power_law = [least, most,
/// exponent] }`, `{ table = [[value, share], ...] }`, or `{ choice = [a, b], weights = [2, 1] }`; `levels = 5` for a full factorial.
// For editors and the reference; `variables` reads the table.
#[derive(JsonSchema)]
#[schemars(deny_unknown_fields)]
#[allow(dead_code, reason = "its names and texts are all that is used of it")]
pub struct Vary {
    /// Volume of the rock [m3]: its shape and spheres are scaled. Needs a density in the scene.
    volume: Option<Spread>,
    /// Its mass [kg]: the same, by its density. Not with `volume`.
    mass: Option<Spread>,
    /// Its density [kg/m3].
    density: Option<Spread>,
    /// Its shape: a `choice` of tables as in a scene.
    shape: Option<Map<String, Value>>,
    /// `"uniform"`: every orientation is as likely as any other.
    orientation: Option<String>,
    /// Speed of the start [m/s].
    speed: Option<Spread>,
    /// Direction of that speed seen from above, in degrees clockwise from +y (north). Default that of the scene's `velocity`, or
    /// the line of fall.
    azimuth: Option<Spread>,
    /// Its angle below the horizontal, in degrees. Default likewise.
    dip: Option<Spread>,
    /// Angular velocity about an axis of any direction [rad/s].
    spin: Option<Spread>,
    /// Height above where the rock would touch the ground [m], in place of that of the release.
    height: Option<Spread>,
    /// Keys of the scene's `[[contact]]` by number, as in `contact.0.restitution = { uniform = [0.1, 0.3] }`.
    contact: Option<Map<String, Value>>,
    /// Keys of its `[dem]`, as in `dem.steps_per_contact = { choice = [20, 40] }`.
    dem: Option<Map<String, Value>>,
    /// Keys of its `[terrain]`, as in `terrain.forest_drag = { uniform = [200.0, 400.0] }`.
    terrain: Option<Map<String, Value>>,
}

/// Name of the orientation in `[vary]`, and its one value.
const ORIENTATION: &str = "orientation";
const UNIFORM: &str = "uniform";

/// Tables of the scene whose keys may vary.
const TABLES: [&str; 3] = ["contact", "dem", "terrain"];
/// Keys of these that all members share: what the terrain is made of, and how it is read.
const SHARED: &str =
    "law between file nodata nodata_value classes longest_edge material zones polygon number";

/// What `[vary]` says, and whether the orientation is any.
pub fn variables(study: &Scene) -> Result<(Vec<Variable>, bool), Diagnostic> {
    let mut table: toml::Table = study.read("vary")?.unwrap_or_default();
    let turned = table.remove(ORIENTATION);
    if turned.as_ref().is_some_and(|value| value.as_str() != Some(UNIFORM)) {
        let what = "an orientation that varies is `uniform`: every one as likely as any other";
        let key = format!("vary.{ORIENTATION}");
        return study.refuse(&key, what, "one orientation for all stands in the scene");
    }
    Ok((all_of(&table, "vary", study)?, turned.is_some()))
}

/// What varies at a release: its own distributions, which stand at `key`, go before those of `all`.
pub fn of_release(
    all: &[Variable],
    own: Option<&toml::Table>,
    key: &str,
    study: &Scene,
) -> Result<Vec<Variable>, Diagnostic> {
    let own = own.map_or(Ok(Vec::new()), |own| all_of(own, key, study))?;
    let of = |variable: &Variable| own.iter().find(|it| it.name == variable.name).unwrap_or(variable).clone();
    let found: Vec<Variable> = all.iter().map(of).collect();
    match own.iter().find(|it| it.quantity == Varied::Shape || !found.contains(it)) {
        None => Ok(found),
        Some(Variable { name, key, .. }) => {
            let what = format!(
                "`{name}` varies at this release alone: a [vary] of the study must have it too, for other releases (shapes cannot vary at a release)"
            );
            study.refuse(key, what, format!("add {name} to [vary]; a fixed number will do"))
        }
    }
}

/// All quantities and keys of a table that varies them, which stands at `place`.
fn all_of(table: &toml::Table, place: &str, study: &Scene) -> Result<Vec<Variable>, Diagnostic> {
    let mut found = Vec::new();
    for (name, value) in table {
        let key = format!("{place}.{name}");
        if let Some((_, quantity, possible)) = QUANTITIES.iter().find(|(known, ..)| known == name) {
            let distribution = Distribution::of(value, &key, study)?;
            let variable = Variable { name: name.clone(), quantity: *quantity, distribution, key };
            variable.check(*possible, study)?;
            found.push(variable);
        } else if name.contains('.') || value.is_table() && !Distribution::is_one(value) {
            keys_below(name, value, place, study, &mut found)?;
        } else {
            let known = known();
            let cure = format!(
                "known here: {known}, {ORIENTATION}; or a key of the scene, as in contact.0.restitution"
            );
            return study.refuse(&key, format!("unknown quantity `{name}`"), cure);
        }
    }
    Ok(found)
}

/// All distributions at or below a dotted key of the scene.
fn keys_below(
    name: &str,
    value: &toml::Value,
    place: &str,
    study: &Scene,
    found: &mut Vec<Variable>,
) -> Result<(), Diagnostic> {
    if let Some(table) = value.as_table().filter(|_| !Distribution::is_one(value)) {
        return table
            .iter()
            .try_for_each(|(key, below)| keys_below(&format!("{name}.{key}"), below, place, study, found));
    }
    let key = format!("{place}.{name}");
    let parts: Vec<&str> = name.split('.').collect();
    if !TABLES.contains(&parts[0]) || parts.len() < 2 {
        let known = known();
        let cure = format!("keys of {} can; of the rock: {known}, {ORIENTATION}", TABLES.join(", "));
        return study.refuse(&key, format!("`{name}` of the scene cannot vary"), cure);
    }
    if let Some(part) = parts.iter().find(|part| SHARED.split(' ').any(|shared| shared == **part)) {
        let what = format!("`{part}` is the same for all members: they share one terrain and its laws");
        return study.refuse(&key, what, "write one study for each");
    }
    let distribution = Distribution::of(value, &key, study)?;
    found.push(Variable { name: name.into(), quantity: Varied::Key, distribution, key });
    Ok(())
}

impl Variable {
    fn check(&self, possible: [Bound<f64>; 2], study: &Scene) -> Result<(), Diagnostic> {
        let Self { quantity, distribution, key, .. } = self;
        if *quantity == Varied::Shape {
            let tables = distribution.values().is_some_and(|v| v.iter().all(toml::Value::is_table));
            let cure = "shape = { choice = [{ type = \"norm_rock\", form = \"111\", volume = 1.0 }, { type = \"sphere\", radius = 0.5 }] }";
            return if tables { Ok(()) } else { study.refuse(key, "shapes are a choice of tables", cure) };
        }
        let Some([low, high]) = distribution.range() else {
            return Err(study.invalid(key, "numbers are needed here"));
        };
        if [low, high].iter().all(|value| (possible[0], possible[1]).contains(value)) {
            return Ok(());
        }
        let bounds = match possible {
            [Bound::Included(least), Bound::Included(most)] => format!("from {least} to {most}"),
            [Bound::Excluded(least), _] => format!("above {least}"),
            [Bound::Included(least), _] => format!("{least} or more"),
            [Bound::Unbounded, _] => "any number".into(),
        };
        let what =
            if low == high { format!("a value of {low}") } else { format!("values from {low} to {high}") };
        let cure = match (distribution.has_tails(), quantity) {
            (true, _) => "cut the distribution with within = [low, high]".into(),
            (false, Varied::Speed) => "a speed has no sign: azimuth and dip say where it points".into(),
            (false, _) => format!("write values {bounds}"),
        };
        study.refuse(key, format!("{what}: {bounds} is possible"), cure)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn editors_know_the_names_that_are_read() {
        let schema = schemars::schema_for!(Vary).to_value();
        let mut known: Vec<&str> =
            schema["properties"].as_object().expect("keys").keys().map(String::as_str).collect();
        let mut read: Vec<&str> =
            QUANTITIES.iter().map(|(name, ..)| *name).chain([ORIENTATION]).chain(TABLES).collect();
        known.sort_unstable();
        read.sort_unstable();
        assert_eq!(known, read);
    }
}
