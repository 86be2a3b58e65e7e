//! Scheme, window and steps of a coupled scene that leaves them open.
//!
//! The net yields inside the contact solver wherever both solvers are this project's and the structure offers its tangents, in
//! windows of ten steps of the structure: measured on the drop test, the cable net and the barrier, that is the longest window
//! whose first pass is accepted (`docs/coupling.md`). Presets of `[coupling]` move its accuracy and cost.
//!
//! Elsewhere weak coupling where its longest window is about as long as the steps of the structure, which it then costs nothing
//! to exchange at; else strong coupling, whose windows are limited by what they resolve. Measured: `tests/tests/physics/defaults.rs`.

use crate::check::numbers::Numbers;
use crate::check::plan::{Part, Plan};
use crate::check::stability::divided;
use interface_defs::diagnostic::Diagnostic;
use toml::{Table, Value};
use toolkit::check::CheckReport;
use toolkit::numbers::{rounded, short, two_digits};
use toolkit::scene::{Scene, at};

/// Longest weak window, and longest part of a strong one [s]: a tenth of the millisecond over which reactions are averaged.
const RESOLVED: f64 = 1e-4;
/// Parts of a strong window.
const PARTS: u32 = 2;
/// Shortest weak window that is cheaper than strong coupling: [s], and over the structure's step.
const WORTH: (f64, f64) = (4e-5, 0.5);

/// Choose what `scene` leaves open, and write it into the reports of the programs. Nothing if it is not coupled.
pub fn complete(
    scene: &Scene,
    plan: &Plan,
    reports: &mut [(Part, CheckReport)],
) -> Result<Vec<Chosen>, Diagnostic> {
    if !plan.is_coupled() || plan.members.iter().any(|member| member.part == Part::Coupler && member.foreign)
    {
        return Ok(Vec::new());
    }
    let numbers = Numbers::of(reports, scene.end_time()?);
    let document = scene.document()?;
    let named = |key: &str| at(&document, key);
    let yields = named("coupling.yielding_net").and_then(Value::as_bool);
    let open = named("coupling.scheme").is_none() || named("coupling.time_window").is_none();
    let preset = match Preset::of(&document) {
        Some(preset) => {
            preset.check(scene, plan, &numbers)?;
            Some(preset)
        }
        None => {
            let scheme = named("coupling.scheme").and_then(Value::as_str);
            let asked = scheme.is_none() || scheme == Some("strong") && yields == Some(true);
            let can = numbers.offers_tangents && !plan.members.iter().any(|member| member.foreign);
            (open && asked && can && yields != Some(false)).then_some(USUAL)
        }
    };
    let mut chosen = match preset {
        Some(preset) => preset.choose(&document, &numbers),
        None if open => coupling(scene, &document, &numbers)?,
        None => Vec::new(),
    };
    let scheme = chosen.iter().find(|c| c.key == ("coupling", "scheme"));
    let weak = scheme.map_or(numbers.weak, |c| c.value.as_str() == Some("weak"));
    // The limit is that of a net which stands still in the contact solver's eyes.
    if weak
        && yields != Some(true)
        && let Some(limit) = numbers.limit
    {
        chosen.push(Chosen {
            key: ("coupling", "longest_weak_window"),
            // As it is printed, so that who names the printed window is within it.
            value: rounded(limit.window, 6).into(),
        });
    }
    if open && preset.is_none() {
        steps(&document, &numbers, &mut chosen);
    }
    chosen.iter().for_each(|choice| enter(choice, reports));
    Ok(chosen)
}

/// Scheme, window and samples.
fn coupling(scene: &Scene, document: &Table, numbers: &Numbers) -> Result<Vec<Chosen>, Diagnostic> {
    let [scheme, window, samples] = ["coupling.scheme", "coupling.time_window", "coupling.samples"]
        .map(|key| at(document, key).is_some());
    let own = numbers.net.step.filter(|step| step.is_finite());
    let named = numbers.window.filter(|_| window);
    let longest = numbers.limit.map(|limit| limit.window);
    let unknown = || {
        let (key, why, cure) = match numbers.is_static {
            true => (
                "fem.integrator",
                "a structure in statics has no masses that limit a window",
                "write integrator = \"central_difference\", or scheme and time_window of [coupling]",
            ),
            false => (
                "coupling",
                "a solver does not report the numbers of its contact or of its structure",
                "add [coupling] with scheme = \"weak\" or \"strong\" and time_window in seconds",
            ),
        };
        let what = format!("scheme and time_window are not given and cannot be computed: {why}");
        scene.invalid(key, what).try_instead(cure)
    };
    let weak = if scheme {
        numbers.weak
    } else {
        let longest = longest.ok_or_else(unknown)?;
        match named {
            Some(window) => window <= longest,
            None => longest >= own.map_or(WORTH.0, |step| WORTH.0.min(WORTH.1 * step)),
        }
    };
    let mut chosen = Vec::new();
    let mut choose = |key, value| chosen.push(Chosen { key: ("coupling", key), value });
    if !scheme {
        choose("scheme", if weak { "weak" } else { "strong" }.into());
    }
    let mut parts = numbers.samples;
    if !weak && !samples && !window {
        parts = PARTS;
        choose("samples", i64::from(parts).into());
    }
    if !window {
        let value = if weak {
            of_whole_steps(longest.ok_or_else(unknown)?.min(RESOLVED), own)
        } else {
            f64::from(parts) * of_whole_steps(RESOLVED, own)
        };
        choose("time_window", two_digits(value).into());
    }
    Ok(chosen)
}

/// The solvers' own steps, which divide each part of the window.
fn steps(document: &Table, numbers: &Numbers, chosen: &mut Vec<Chosen>) {
    let find = |name: &str| chosen.iter().find(|c| c.key == ("coupling", name)).map(|c| &c.value);
    let window = find("time_window").and_then(Value::as_float).or(numbers.window);
    let samples = find("samples").and_then(Value::as_integer).unwrap_or(numbers.samples.into());
    let Some(window) = window else { return };
    let part = window / samples as f64;
    // Terrain and other rocks are touched in steps that the contact solver knows best.
    let named = ["dem.time_step", "dem.steps_per_contact"].iter().any(|key| at(document, key).is_some());
    let open = !named && !document.contains_key("terrain");
    if let (true, Some(longest)) = (open, numbers.contact.longest) {
        chosen.push(Chosen { key: ("dem", "time_step"), value: divided(part, longest).into() });
    }
    let open = at(document, "fem.time_step").is_none();
    if let (true, Some(own)) = (open, numbers.net.step.filter(|step| step.is_finite())) {
        chosen.push(Chosen { key: ("fem", "time_step"), value: divided(part, own).into() });
    }
}

/// The longest that is not above `most` [s] and is a whole number of steps of `own` [s], where one fits in.
fn of_whole_steps(most: f64, own: Option<f64>) -> f64 {
    match own {
        Some(own) if own <= most => (most / own).floor() * own,
        _ => most,
    }
}

/// Write a choice into the report of the program whose table it is in.
fn enter(choice: &Chosen, reports: &mut [(Part, CheckReport)]) {
    let (table, key) = choice.key;
    let part = match table {
        "coupling" => Part::Coupler,
        "dem" => Part::Dem,
        _ => Part::Fem,
    };
    let Some((_, report)) = reports.iter_mut().find(|(p, _)| *p == part) else { return };
    let entry = report.resolved.entry(table).or_insert_with(|| Table::new().into());
    if let Some(entry) = entry.as_table_mut() {
        entry.insert(key.into(), choice.value.clone());
        if choice.key == ("dem", "time_step") {
            entry.remove("steps_per_contact");
            entry.remove("time_step_scale");
        }
    }
    report.numbers.extend(choice.value.as_float().map(|value| (format!("{key}_s"), value)));
}

/// A value that the scene leaves open, and that was chosen.
#[derive(Debug, Clone, PartialEq)]
pub struct Chosen {
    /// Table and key.
    pub key: (&'static str, &'static str),
    /// The value.
    pub value: Value,
}

impl Chosen {
    /// Whether a scene would name it; what is for messages alone is none of its choices.
    pub fn is_of_scene(&self) -> bool {
        self.key.1 != "longest_weak_window"
    }

    /// As a person reads it.
    pub fn text(&self) -> String {
        let value = match &self.value {
            Value::Float(number) => short(*number),
            Value::String(text) => text.clone(),
            other => other.to_string(),
        };
        format!("{}.{} = {value}", self.key.0, self.key.1)
    }
}

/// A preset.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Preset {
    /// Name in the scene.
    pub name: &'static str,
    /// Parts of a window.
    pub samples: u32,
    /// Share of the window's increment by which both motions of the net may differ.
    pub share: f64,
    /// Step of the structure over the one that it takes by itself.
    pub structure: f64,
    /// Longest step of the contact solver times the frequency of the stiffest contact on the lightest node of the net.
    pub contact: f64,
    /// Bound [%] that the energy error kept when measured.
    pub energy: f64,
}

/// All, the fastest first. What was measured: `docs/coupling.md`, held by `tests/tests/commands/presets.rs`.
pub const PRESETS: [Preset; 3] = [
    Preset { name: "fast", samples: 5, share: 0.3, structure: 1.2, contact: 0.7, energy: 0.5 },
    Preset { name: "balanced", samples: 10, share: 0.1, structure: 1.0, contact: 0.5, energy: 1.1 },
    Preset { name: "accurate", samples: 10, share: 0.02, structure: 0.5, contact: 0.16, energy: 0.1 },
];

/// What is chosen where a scene names none.
const USUAL: Preset = PRESETS[1];

/// Bounds [%] that the deviations of deflection and, but for barriers, whose reaction scatters, `max_reaction_1ms` kept with all of them.
const MEASURED: [f64; 2] = [0.05, 0.5];
/// Steps of the structure in a window.
const STEPS: f64 = 10.0;
/// Longest window [s]: what reactions are averaged over.
const LONGEST: f64 = 1e-3;
/// Most parts of a window.
const MOST_PARTS: f64 = 64.0;

impl Preset {
    /// The one that a scene names, if it names one.
    pub fn of(document: &Table) -> Option<Self> {
        let name = at(document, "coupling.preset")?.as_str()?;
        PRESETS.into_iter().find(|preset| preset.name == name)
    }

    /// What speaks against it in a scene that names it.
    fn check(self, scene: &Scene, plan: &Plan, numbers: &Numbers) -> Result<(), Diagnostic> {
        let document = scene.document()?;
        let named = |key: &str| at(&document, &format!("coupling.{key}"));
        let refused = [
            (
                plan.members.iter().any(|member| member.foreign),
                "a preset is for the solvers of this project: of another program neither its steps are known nor whether it offers \
                 what a yielding net takes",
                "leave the preset out, and name scheme and time_window",
            ),
            (
                named("scheme").and_then(Value::as_str) == Some("weak"),
                "a preset lets the net yield inside the contact solver, which weak coupling does not",
                "keep one of preset and scheme",
            ),
            (
                named("yielding_net").and_then(Value::as_bool) == Some(false),
                "a preset lets the net yield inside the contact solver, and yielding_net = false does not",
                "keep one of preset and yielding_net",
            ),
            (
                numbers.is_static,
                "a preset needs steps of the structure in time: statics have none",
                "write integrator = \"central_difference\", or leave the preset out",
            ),
            (
                !numbers.offers_tangents,
                "a preset lets the net yield inside the contact solver, and the elements of this structure couple too many nodes",
                "leave the preset out, and name scheme and time_window",
            ),
        ];
        match refused.into_iter().find(|(refused, ..)| *refused) {
            Some((_, what, cure)) => scene.refuse("coupling.preset", what, cure),
            None => Ok(()),
        }
    }

    /// What it sets and the scene leaves open.
    fn choose(self, document: &Table, numbers: &Numbers) -> Vec<Chosen> {
        let named = |table: &str, key: &str| at(document, &format!("{table}.{key}"));
        let open = |table: &str, key: &str| named(table, key).is_none();
        // An implicit structure has no step of its own: it takes those that resolve a reaction.
        let own = numbers.net.step.filter(|step| step.is_finite()).unwrap_or(RESOLVED);
        let step = if open("fem", "time_step") { self.structure * own } else { own };
        let usual = two_digits((STEPS * step).min(LONGEST));
        let window = numbers.window.filter(|_| !open("coupling", "time_window")).unwrap_or(usual);
        // A window that the scene names has parts of the usual length.
        let parts = (f64::from(self.samples) * window / usual).ceil().clamp(1.0, MOST_PARTS) as u32;
        let samples = if open("coupling", "samples") { parts } else { numbers.samples };
        let part = window / f64::from(samples);
        let on_node = numbers.node_mass.zip(numbers.stiffness).map(|(m, k)| self.contact * (m / k).sqrt());
        let longest = [numbers.contact.longest, on_node].into_iter().flatten().fold(part, f64::min);
        let all: [((&str, &str), Value); 7] = [
            (("coupling", "scheme"), "strong".into()),
            (("coupling", "yielding_net"), true.into()),
            (("coupling", "time_window"), window.into()),
            (("coupling", "samples"), i64::from(samples).into()),
            (("coupling", "yielding_share"), self.share.into()),
            (("dem", "time_step"), divided(part, longest).into()),
            (("fem", "time_step"), divided(part, step).into()),
        ];
        let by_steps = document.contains_key("terrain") || !open("dem", "steps_per_contact");
        let left = |key: &(&str, &str)| open(key.0, key.1) && !(*key == ("dem", "time_step") && by_steps);
        let left = all.into_iter().filter(|(key, _)| left(key));
        left.map(|(key, value)| Chosen { key, value }).collect()
    }

    /// What is known of it, for `rockfall check`.
    pub fn quote(self) -> String {
        let ([deflection, reaction], energy) = (MEASURED, self.energy);
        format!(
            "{}: deflection within {deflection} %, energy within {energy} % on the drop test and the barrier, reaction (1 ms) within \
             {reaction} % on the drop test (docs/coupling.md)",
            self.name
        )
    }
}
