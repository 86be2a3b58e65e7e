//! The knobs of a scene: which there are, one line each in [`REGISTRY`], what a setting of one is in `--set`s, and points among them:
//! the rungs of those that are not the scene's own.
//!
//! A knob belongs to a scene by presence: its key stands in the resolved scene, or a program reports its value. A *rung* is the
//! number of steps away from the scene's own value, above 0 towards what is coarser and cheaper; a ladder doubles or halves with each,
//! and has values between two rungs, too: where a scene breaks is found among them.

use crate::check::stability;
use interface_defs::diagnostic::Diagnostic;
use std::collections::BTreeMap;
use std::ops::Deref;
use toml::{Table, Value};
use toolkit::explain::suggestion;
use toolkit::numbers::{exact, rounded};
use toolkit::scene::at;

/// What a knob changes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Class {
    /// How exactly the scene's model is computed.
    Numerical,
    /// The model itself.
    Model,
}

/// A knob that a scene may have.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spec {
    /// Name, in tables.
    pub name: &'static str,
    /// Dotted keys, `*` for every item of an array, with the power of two by which one rung coarser changes each.
    keys: &'static [(&'static str, i32)],
    /// Names to choose from; empty: a ladder.
    names: &'static [&'static str],
    /// What it changes.
    pub class: Class,
    /// Whether all others are tried anew with each of its names.
    pub arm: bool,
    /// Whether the reference refines it.
    pub refines: bool,
    /// How many times dearer one rung finer may be.
    pub growth: f64,
    /// Used only with this name of that knob.
    pub needs: Option<(&'static str, &'static str)>,
    /// Where the scene has no value, this number of `check` is the one in use.
    reported: Option<&'static str>,
}

/// All knobs, one line each. To add one, add its line: `ladder` for numbers, each with its power of two per rung; `choice` for
/// names.
const REGISTRY: &[Spec] = &[
    Spec { arm: true, ..choice("scheme", &[("coupling.scheme", 0)], &["weak", YIELDING, "strong"]) },
    Spec { arm: true, ..choice("integrator", &[("fem.integrator", 0)], INTEGRATORS) },
    Spec { refines: true, ..ladder("window", &[("coupling.time_window", 1)]) },
    ladder("samples", &[("coupling.samples", -1)]),
    Spec { needs: Some(("scheme", "strong")), ..tolerance("tolerance", TOLERANCES) },
    Spec { needs: Some(("scheme", YIELDING)), ..tolerance("yielding_tolerance", OF_YIELDING) },
    Spec { refines: true, reported: Some("dem.time_step"), ..ladder("dem_step", &[("dem.time_step", 1)]) },
    Spec { refines: true, ..ladder("steps_per_contact", &[("dem.steps_per_contact", -1)]) },
    Spec { refines: true, reported: Some("fem.time_step"), ..ladder("fem_step", &[("fem.time_step", 1)]) },
    Spec { class: Class::Model, growth: 8.0, ..ladder("spheres", &[("rock.*.cluster.spheres", -3)]) },
    Spec { class: Class::Model, growth: 8.0, ..ladder(NET, CELLS) },
    Spec { class: Class::Model, ..ladder("modulus", MODULI) },
    Spec { class: Class::Model, ..choice("contact_selection", &[("dem.contact_selection", 0)], SELECTIONS) },
];

/// Name of the knob of the net's cells.
pub const NET: &str = "refinement";
/// Name of the knob that starts from the values of a preset in place of the scene's.
pub const PRESET: &str = "preset";
const INTEGRATORS: &[&str] = &["central_difference", "generalized_alpha"];
const SELECTIONS: &[&str] = &["nearest", "continuous"];
/// How stiff a contact is, by whichever its law has.
const MODULI: &[(&str, i32)] = &[("contact.*.young", -2), ("contact.*.stiffness", -2)];
/// Both tolerances of strong coupling.
const TOLERANCES: &[(&str, i32)] = &[("coupling.tolerance", 2), ("coupling.absolute_tolerance", 2)];
/// Name of strong coupling with a net that yields in the contact solver: weak coupling accepts what that has not judged.
const YIELDING: &str = "yielding";
const YIELDING_NET: &str = "coupling.yielding_net";
/// Both its tolerances.
const OF_YIELDING: &[(&str, i32)] = &[("coupling.yielding_tolerance", 2), (SHARE, 2)];
/// A share of a whole: 1 and more are refused.
const SHARE: &str = "coupling.yielding_share";
/// A rectangular net of half the cells, its wires thicker: of the same mass and stiffness per metre of its width.
const CELLS: &[(&str, i32)] =
    &[("structure.generator.cells", -1), ("structure.generator.spacing", 1), ("structure.cable.area", 1)];

const fn ladder(name: &'static str, keys: &'static [(&'static str, i32)]) -> Spec {
    Spec {
        name,
        keys,
        names: &[],
        class: Class::Numerical,
        arm: false,
        refines: false,
        growth: 2.0,
        needs: None,
        reported: None,
    }
}

const fn tolerance(name: &'static str, keys: &'static [(&'static str, i32)]) -> Spec {
    Spec { refines: true, growth: 1.5, ..ladder(name, keys) }
}

const fn choice(
    name: &'static str,
    keys: &'static [(&'static str, i32)],
    names: &'static [&'static str],
) -> Spec {
    Spec { names, growth: 5.0, ..ladder(name, keys) }
}

impl Spec {
    /// This knob of the scene; `None` if it has none.
    fn of(&self, scene: &Base) -> Option<Knob> {
        let own: Vec<KnobValue> =
            self.keys.iter().flat_map(|(key, power)| parts(scene.resolved, key, *power)).collect();
        let (mut parts, mut names) = (Vec::new(), Vec::new());
        if self.names.is_empty() {
            let all_there =
                self.keys.iter().all(|(key, _)| key.contains('*') || own.iter().any(|p| p.key == *key));
            let of_report = || {
                let (key, value) = (self.reported?, scene.reported(self.reported?)?);
                Some(vec![KnobValue { key: key.into(), base: Number::Float(value), power: self.keys[0].1 }])
            };
            parts = if own.is_empty() { of_report()? } else { all_there.then_some(own)? };
        } else {
            let mut now = at(scene.resolved, self.keys[0].0)?.as_str()?;
            let yields = at(scene.resolved, YIELDING_NET).and_then(Value::as_bool);
            if self.names.contains(&YIELDING) && yields == Some(true) {
                now = YIELDING;
            }
            let others =
                self.names.iter().filter(|name| **name != now && (**name != YIELDING || yields.is_some()));
            names = std::iter::once(&now).chain(others).map(|name| (*name).to_owned()).collect();
        }
        let knob = Knob { spec: *self, turned: true, parts, names };
        // A single sphere, a tolerance of zero: nothing to turn.
        [-1.0, 1.0].iter().any(|rung| knob.sets(*rung).is_some()).then_some(knob)
    }
}

/// What the knobs of a scene start from.
pub struct Base<'a> {
    /// The scene with every default filled in.
    pub resolved: &'a Table,
    /// Values in use that stand in no table, by dotted key.
    pub in_use: &'a [(&'static str, f64)],
}

impl Base<'_> {
    fn reported(&self, key: &str) -> Option<f64> {
        // Steps in a contact take the place of a step.
        let excluded = key == "dem.time_step" && at(self.resolved, "dem.steps_per_contact").is_some();
        self.in_use.iter().find(|(k, v)| *k == key && v.is_finite() && !excluded).map(|(_, v)| *v)
    }
}

/// All knobs that a scene has.
pub fn of(scene: &Base) -> Vec<Knob> {
    REGISTRY.iter().filter_map(|spec| spec.of(scene)).collect()
}

/// Turn those alone that are named in `only`, all if it is empty. An unknown name is bad input.
pub fn turn_only(knobs: &mut [Knob], only: &[String]) -> Result<(), Diagnostic> {
    let names: Vec<&str> = knobs.iter().map(|knob| knob.name).collect();
    if let Some(unknown) = only.iter().find(|name| !names.contains(&name.as_str())) {
        let what = format!("--knob {unknown}: this scene has no knob of that name");
        return Err(Diagnostic::new(what).try_instead(suggestion(unknown, &names).unwrap_or_default()));
    }
    knobs
        .iter_mut()
        .for_each(|knob| knob.turned = only.is_empty() || only.iter().any(|name| name == knob.name));
    Ok(())
}

/// A knob of a scene.
#[derive(Debug, Clone, PartialEq)]
pub struct Knob {
    spec: Spec,
    /// Whether it is to be turned; the reference refines it all the same.
    pub turned: bool,
    /// The values of a ladder.
    parts: Vec<KnobValue>,
    /// The names of a choice, the scene's own first.
    names: Vec<String>,
}

impl Deref for Knob {
    type Target = Spec;

    fn deref(&self) -> &Spec {
        &self.spec
    }
}

/// A value that a ladder changes.
#[derive(Debug, Clone, PartialEq)]
struct KnobValue {
    key: String,
    base: Number,
    power: i32,
}

#[derive(Debug, Clone, PartialEq)]
enum Number {
    Float(f64),
    Whole(i64),
    /// They stay in proportion: all divide, or none.
    Wholes(Vec<i64>),
}

impl Knob {
    /// From which values all others start: the scene's own, or those of a preset. These are numbers of the scene and stand in
    /// [`Space::starts`], so that it sets nothing by itself.
    pub fn of_presets<'a>(names: impl Iterator<Item = &'a str>) -> Self {
        let spec = Spec { arm: true, growth: 2.0, ..choice(PRESET, &[], &[]) };
        let names = std::iter::once("none").chain(names).map(str::to_owned).collect();
        Self { spec, turned: true, parts: Vec::new(), names }
    }

    /// A ladder for a test or a knob that no registry has.
    #[cfg(test)]
    pub fn number(name: &'static str, key: &str, base: f64) -> Self {
        let parts = vec![KnobValue { key: key.into(), base: Number::Float(base), power: 1 }];
        Self { spec: Spec { refines: true, ..ladder(name, &[]) }, turned: true, parts, names: Vec::new() }
    }

    /// The `--set`s of a rung; `None` if it has none there, or if it is what another one is.
    pub fn sets(&self, rung: f64) -> Option<Vec<String>> {
        if self.is_ladder() {
            let set = |part: &KnobValue| {
                let value = part.base.scaled(f64::from(part.power) * rung)?;
                let is_valid = part.key != SHARE || value.parse().is_ok_and(|share: f64| share < 1.0);
                is_valid.then(|| format!("{}={value}", part.key))
            };
            return self.parts.iter().map(set).collect();
        }
        let name = self.value(rung)?;
        let Some((key, _)) = self.spec.keys.first() else { return Some(Vec::new()) };
        let yields = name == YIELDING;
        let other = (yields || self.names[0] == YIELDING).then(|| format!("{YIELDING_NET}={yields}"));
        let set = format!("{key}={}", if yields { "strong" } else { &name });
        Some(std::iter::once(set).chain(other).collect())
    }

    /// Its value at a rung, for people: the first of its values.
    pub fn value(&self, rung: f64) -> Option<String> {
        match self.parts.first() {
            Some(first) => self.sets(rung).and(first.base.scaled(f64::from(first.power) * rung)),
            None => (rung >= 0.0).then(|| self.names.get(rung as usize).cloned())?,
        }
    }

    /// Its value as a number.
    pub fn as_number(&self, rung: f64) -> Option<f64> {
        self.value(rung)?.parse().ok()
    }

    /// The rung at which its first value is this number; `None`: it is not continuous.
    pub fn rung_of(&self, value: f64) -> Option<f64> {
        match self.parts.first()? {
            KnobValue { base: Number::Float(base), power, .. } => {
                Some((value / base).log2() / f64::from(*power))
            }
            _ => None,
        }
    }

    /// The dotted keys.
    pub fn keys(&self) -> Vec<&str> {
        let of_choice = self.spec.keys.iter().map(|(key, _)| *key).filter(|_| !self.is_ladder());
        self.parts.iter().map(|part| part.key.as_str()).chain(of_choice).collect()
    }

    /// Whether it is a step of a solver.
    pub fn is_step(&self) -> bool {
        self.name.ends_with("_step")
    }

    /// Whether its values are numbers, and not names to choose from.
    pub fn is_ladder(&self) -> bool {
        self.names.is_empty()
    }

    /// The rungs of its names beside the scene's own.
    pub fn others(&self) -> impl Iterator<Item = f64> {
        (1..self.names.len()).map(|name| name as f64)
    }
}

impl Number {
    /// Times two to the power of `power`, as TOML; `None` if there is no such value.
    fn scaled(&self, power: f64) -> Option<String> {
        let factor = power.exp2();
        let whole = |n: i64, exact: bool| {
            let value = n as f64 * factor;
            let differs = power == 0.0 || value.round() != n as f64;
            (value >= 1.0 && differs && (!exact || value.fract() == 0.0)).then_some(value.round() as i64)
        };
        match self {
            // Between rungs without the last digits, in which the logarithm of a value and its power differ.
            Self::Float(base) if power.fract() != 0.0 => Some(exact(rounded(base * factor, 12))),
            Self::Float(base) => (*base != 0.0).then(|| exact(base * factor)),
            Self::Whole(n) => whole(*n, false).map(|n| n.to_string()),
            Self::Wholes(all) => {
                let all: Option<Vec<_>> = all.iter().map(|n| whole(*n, true)).collect();
                all.map(|all| format!("{all:?}"))
            }
        }
    }
}

/// A value as a label shows it: a third of a step has more digits than anyone reads.
fn shown(value: String) -> String {
    let number = if value.parse::<i64>().is_ok() { None } else { value.parse().ok() };
    number.map_or(value, |number| exact(rounded(number, 4)).trim_end_matches(".0").to_owned())
}

/// The numbers at a dotted key, `*` for every item of an array.
fn parts(table: &Table, key: &str, power: i32) -> Vec<KnobValue> {
    let mut found = Vec::new();
    if let Some((list, rest)) = key.split_once(".*.") {
        let items = at(table, list).and_then(Value::as_array).map_or(&[] as &[Value], Vec::as_slice);
        for (index, item) in items.iter().enumerate() {
            let number = item.as_table().and_then(|item| at(item, rest)).and_then(number);
            found.extend(number.map(|base| KnobValue { key: format!("{list}.{index}.{rest}"), base, power }));
        }
    } else if let Some(base) = at(table, key).and_then(number) {
        found.push(KnobValue { key: key.into(), base, power });
    }
    // A single sphere is none of a cluster.
    found.retain(|part| part.base != Number::Whole(1) || part.key == "coupling.samples");
    found
}

fn number(value: &Value) -> Option<Number> {
    match value {
        Value::Float(f) => Some(Number::Float(*f)),
        Value::Integer(n) => Some(Number::Whole(*n)),
        Value::Array(all) => all.iter().map(Value::as_integer).collect::<Option<_>>().map(Number::Wholes),
        _ => None,
    }
}

/// Rungs by knob; a knob at the scene's own value is left out.
pub type Point = BTreeMap<&'static str, f64>;

/// Values from which knobs are turned.
pub struct Start {
    /// The knobs, at these values.
    pub knobs: Vec<Knob>,
    /// Dotted keys and values that the programs choose where nobody names them: every run in which a knob has moved names them, as
    /// what is chosen may depend on the others.
    pub pinned: Vec<(String, String)>,
}

/// All points of a scene.
pub struct Space {
    /// The scene's own values, and those of each preset.
    pub starts: Vec<Start>,
}

/// `point` with the rung of one knob.
pub fn with(point: &Point, knob: &'static str, rung: f64) -> Point {
    let mut point = point.clone();
    point.insert(knob, rung);
    point.retain(|_, rung| *rung != 0.0);
    point
}

/// Rung of a knob.
pub fn rung(point: &Point, knob: &str) -> f64 {
    point.get(knob).copied().unwrap_or(0.0)
}

impl Space {
    /// The knobs, at the scene's own values.
    pub fn knobs(&self) -> &[Knob] {
        &self.starts[0].knobs
    }

    fn start(&self, point: &Point) -> &Start {
        self.starts.get(rung(point, PRESET) as usize).unwrap_or(&self.starts[0])
    }

    /// The knob of this name.
    pub fn knob(&self, name: &str) -> Option<&Knob> {
        self.knobs().iter().find(|knob| knob.name == name)
    }

    /// The same at the values from which `point` starts.
    pub fn knob_at(&self, point: &Point, name: &str) -> Option<&Knob> {
        self.start(point).knobs.iter().find(|knob| knob.name == name)
    }

    /// Whether a knob changes anything there.
    pub fn uses(&self, point: &Point, knob: &Knob) -> bool {
        knob.needs.is_none_or(|(other, name)| {
            let value = self.knob_at(point, other).and_then(|other| other.value(rung(point, other.name)));
            value.as_deref() == Some(name)
        })
    }

    /// The numerical knobs that are to be turned and that change anything there.
    pub fn turned<'a>(&'a self, point: &'a Point) -> impl Iterator<Item = &'a Knob> {
        let is_turned = |knob: &Knob| self.knob(knob.name).is_none_or(|knob| knob.turned);
        let knobs = self.start(point).knobs.iter().filter(move |knob| is_turned(knob));
        knobs.filter(|knob| knob.class == Class::Numerical && self.uses(point, knob))
    }

    /// Whether the point changes the model.
    pub fn class(&self, point: &Point) -> Class {
        let changes = |knob: &Knob| knob.class == Class::Model && point.contains_key(knob.name);
        if self.knobs().iter().any(changes) { Class::Model } else { Class::Numerical }
    }

    /// `point` with the scene's own model.
    pub fn of_own_model(&self, point: &Point) -> Point {
        let is_model = |name: &str| self.knob(name).is_some_and(|knob| knob.class == Class::Model);
        point.iter().filter(|(name, _)| !is_model(name)).map(|(name, rung)| (*name, *rung)).collect()
    }

    /// The `--set`s of a point; `None` if a knob has no such rung. The scene as it is has none.
    pub fn sets(&self, point: &Point) -> Option<Vec<String>> {
        if point.is_empty() { Some(Vec::new()) } else { self.with_sets(point, Vec::new()) }
    }

    /// The same, beside other `--set`s; all that is chosen is held.
    pub fn with_sets(&self, point: &Point, mut all: Vec<String>) -> Option<Vec<String>> {
        let is_there = |all: &[String], set: &str| {
            let key = |set: &str| set.split('=').next().map(str::to_owned);
            all.iter().any(|other| key(other) == key(set))
        };
        let Start { knobs, pinned } = self.start(point);
        let mut add = |set: String| {
            if !is_there(&all, &set) {
                all.push(set)
            }
        };
        for knob in knobs.iter().filter(|knob| rung(point, knob.name) != 0.0) {
            knob.sets(rung(point, knob.name))?.into_iter().for_each(&mut add);
        }
        pinned.iter().map(|(key, value)| format!("{key}={value}")).for_each(add);
        Some(all)
    }

    /// The value of a knob that is computed with. A solver's step is cut to a whole part of a window, or of its samples.
    pub fn used(&self, point: &Point, knob: &Knob) -> Option<f64> {
        let number = |name: &str| self.knob_at(point, name)?.as_number(rung(point, name));
        let value = knob.as_number(rung(point, knob.name))?;
        let part = number("window").map(|window| window / number("samples").unwrap_or(1.0));
        Some(part.filter(|_| knob.is_step()).map_or(value, |part| stability::divided(part, value)))
    }

    /// What is computed there: two points of one key compute the same.
    pub fn key(&self, point: &Point) -> Option<String> {
        self.sets(point)?;
        let mut words = Vec::new();
        for knob in self.start(point).knobs.iter().filter(|knob| self.uses(point, knob)) {
            match self.used(point, knob).filter(|_| knob.is_step()) {
                Some(step) => words.push(format!("{}={step:.9e}", knob.name)),
                None => words.extend(knob.sets(rung(point, knob.name))?),
            }
        }
        Some(words.join(" "))
    }

    /// For people: what is not as in the scene.
    pub fn label(&self, point: &Point) -> String {
        let knobs = self.start(point).knobs.iter().filter(|knob| point.contains_key(knob.name));
        let words: Vec<String> = knobs
            .filter_map(|knob| Some(format!("{} {}", knob.name, shown(knob.value(rung(point, knob.name))?))))
            .collect();
        if words.is_empty() { "the scene as it is".into() } else { words.join(", ") }
    }

    /// The scene, or with a name of one of its arms.
    pub fn arms(&self) -> Vec<Point> {
        let mut all = vec![Point::new()];
        for knob in self.knobs().iter().filter(|knob| knob.turned && knob.arm) {
            all.extend(knob.others().map(|name| Point::from([(knob.name, name)])));
        }
        all
    }

    /// The arm to which a point belongs.
    pub fn arm_of(&self, point: &Point) -> Point {
        let names =
            self.knobs().iter().filter(|knob| knob.arm).map(|knob| (knob.name, rung(point, knob.name)));
        names.filter(|(_, name)| *name != 0.0).collect()
    }

    /// `point`, so many rungs finer in all that the reference refines.
    pub fn refined(&self, point: &Point, rungs: f64) -> Point {
        let mut out = point.clone();
        for knob in self.start(point).knobs.iter().filter(|knob| knob.refines && self.uses(point, knob)) {
            out = with(&out, knob.name, rung(point, knob.name) - rungs);
        }
        out
    }

    /// How many times dearer than `from` the point `to` may be. What is coarser is not counted as a saving.
    pub fn dearer(&self, from: &Point, to: &Point) -> f64 {
        let (mut factor, mut steps) = (1.0, 1.0_f64);
        for knob in self.knobs() {
            let (a, b) = (rung(from, knob.name), rung(to, knob.name));
            let finer = if knob.is_ladder() { (a - b).max(0.0) } else { f64::from(u8::from(a != b)) };
            let growth = knob.growth.powf(finer);
            // Shorter windows and steps of each solver make each its own part dearer: together no more than the finest of them.
            if knob.refines && knob.needs.is_none() { steps = steps.max(growth) } else { factor *= growth }
        }
        factor * steps
    }
}

#[cfg(test)]
mod tests;
