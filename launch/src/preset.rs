//! Presets of `[coupling]`: accuracy and cost by name.
//!
//! All of them let the net yield inside the contact solver, in windows of ten steps of the structure: measured on the drop test, the
//! cable net and the barrier, that is the longest window whose first pass is accepted (`docs/coupling.md`).

use crate::numbers::Numbers;
use crate::plan::Plan;
use crate::stability;
use interface_defs::diagnostic::Diagnostic;
use toml::{Table, Value};
use toolkit::scene::Scene;
use toolkit::summary::short;

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
    /// Bounds [%] that the deviations of deflection and `max_reaction_1ms` and the energy error kept when measured.
    pub measured: [f64; 3],
}

/// All, the fastest first. What was measured: `docs/coupling.md`, held by `tests/tests/presets.rs`.
pub const PRESETS: [Preset; 3] = [
    Preset { name: "fast", samples: 5, share: 0.3, structure: 1.2, contact: 0.7, measured: [0.05, 0.5, 0.5] },
    Preset {
        name: "balanced",
        samples: 10,
        share: 0.2,
        structure: 1.0,
        contact: 0.4,
        measured: [0.05, 0.5, 1.1],
    },
    Preset {
        name: "accurate",
        samples: 10,
        share: 0.02,
        structure: 0.5,
        contact: 0.16,
        measured: [0.05, 0.5, 0.1],
    },
];

/// Steps of the structure in a window.
const STEPS: f64 = 10.0;
/// Longest window [s]: what reactions are averaged over.
const LONGEST: f64 = 1e-3;

impl Preset {
    /// The one that a scene names, if it names one.
    pub fn of(document: &Table) -> Option<Self> {
        let name = document.get("coupling")?.get("preset")?.as_str()?;
        PRESETS.into_iter().find(|preset| preset.name == name)
    }

    /// What it sets and the scene leaves open.
    pub fn choose(self, scene: &Scene, plan: &Plan, numbers: &Numbers) -> Result<Vec<Chosen>, Diagnostic> {
        let document = scene.document()?;
        let named = |table: &str, key: &str| document.get(table).and_then(|t| t.get(key));
        let own = numbers.net.step.filter(|step| step.is_finite() && !numbers.is_static);
        let refused = [
            (
                plan.members.iter().any(|member| member.foreign),
                "a preset is for the solvers of this project: of another program neither its steps are known nor whether it offers \
                 what a yielding net takes",
                "leave the preset out, and name scheme and time_window",
            ),
            (
                named("coupling", "scheme").and_then(Value::as_str) == Some("weak"),
                "a preset lets the net yield inside the contact solver, which weak coupling does not",
                "keep one of preset and scheme",
            ),
            (
                named("coupling", "yielding_net").and_then(Value::as_bool) == Some(false),
                "a preset lets the net yield inside the contact solver, and yielding_net = false does not",
                "keep one of preset and yielding_net",
            ),
            (
                own.is_none(),
                "a preset needs steps of the structure in time: statics have none",
                "write integrator = \"central_difference\", or leave the preset out",
            ),
        ];
        if let Some((_, what, cure)) = refused.into_iter().find(|(refused, ..)| *refused) {
            return Err(scene.invalid("coupling.preset", what).try_instead(cure));
        }
        let own = own.unwrap_or(f64::NAN);
        let open = |table: &str, key: &str| named(table, key).is_none();
        let step = if open("fem", "time_step") { self.structure * own } else { own };
        let window = numbers.window.filter(|_| !open("coupling", "time_window"));
        let window = window.unwrap_or(two_digits((STEPS * step).min(LONGEST)));
        let samples = if open("coupling", "samples") { self.samples } else { numbers.samples };
        let part = window / f64::from(samples);
        let divide = |longest: f64| part / stability::steps(part, longest) as f64;
        let on_node = numbers.node_mass.zip(numbers.stiffness).map(|(m, k)| self.contact * (m / k).sqrt());
        let longest = [numbers.contact.longest, on_node].into_iter().flatten().fold(part, f64::min);
        let contact = divide(longest);
        let all: [((&str, &str), Value); 7] = [
            (("coupling", "scheme"), "strong".into()),
            (("coupling", "yielding_net"), true.into()),
            (("coupling", "time_window"), window.into()),
            (("coupling", "samples"), i64::from(samples).into()),
            (("coupling", "yielding_share"), self.share.into()),
            (("dem", "time_step"), contact.into()),
            (("fem", "time_step"), divide(step).into()),
        ];
        let by_steps = document.contains_key("terrain") || !open("dem", "steps_per_contact");
        let left = |key: &(&str, &str)| open(key.0, key.1) && !(*key == ("dem", "time_step") && by_steps);
        let left = all.into_iter().filter(|(key, _)| left(key));
        Ok(left.map(|(key, value)| Chosen { key, value }).collect())
    }

    /// What is known of it, for `rockfall check`.
    pub fn quote(self) -> String {
        let [deflection, reaction, energy] = self.measured;
        format!(
            "{}: deflection within {deflection} %, reaction (1 ms) within {reaction} %, energy within {energy} % on the drop test and \
             the barrier (docs/coupling.md)",
            self.name
        )
    }
}

/// `value`, its first two digits.
pub fn two_digits(value: f64) -> f64 {
    let power = value.log10().floor() as i32 - 1;
    // Read from text, so that the number is the one that a person would write.
    format!("{}e{power}", (value / 10.0_f64.powi(power) * (1.0 + 1e-9)).floor()).parse().unwrap_or(value)
}
