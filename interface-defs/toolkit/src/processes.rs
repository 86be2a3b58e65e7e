//! The table `[processes]`: programs of others in the place of this project's, and how long one is waited for.

use super::scene::Scene;
use interface_defs::{
    Diagnostic,
    ipc::{TIMEOUT, Wait},
};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use toml::{Table, Value};

/// Longest deadline [s]: a day.
const LONGEST: f64 = 86_400.0;

/// Programs of others in the place of this project's, and how long one is waited for.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Processes {
    /// Command line in the place of `dem-solver`.
    pub dem: Option<String>,
    /// Command line in the place of `fem-solver`.
    pub fem: Option<String>,
    /// Command line in the place of `coupler`.
    pub coupler: Option<String>,
    /// Deadline for one answer [s].
    pub timeout: f64,
    /// How to wait for an answer.
    pub wait: Wait,
}

impl Default for Processes {
    fn default() -> Self {
        Self { dem: None, fem: None, coupler: None, timeout: TIMEOUT, wait: Wait::default() }
    }
}

/// Keys of it that change no result: how long, and how, programs wait for each other.
const OF_WAITING: [&str; 2] = ["timeout", "wait"];

/// A scene without these keys: a run may go on with another deadline.
pub fn without_waiting(mut scene: Table) -> Table {
    if let Some(Value::Table(processes)) = scene.get_mut("processes") {
        processes.retain(|key, _| OF_WAITING.iter().all(|of| *of != key));
        if processes.is_empty() {
            scene.remove("processes");
        }
    }
    scene
}

impl Processes {
    /// From a scene, checked; the whole table may be absent.
    pub fn of(scene: &Scene) -> Result<Self, Diagnostic> {
        let processes: Self = scene.read("processes")?.unwrap_or_default();
        let timeout = processes.timeout;
        if timeout > 0.0 && timeout <= LONGEST {
            return Ok(processes);
        }
        let what = format!("a deadline of {timeout} s; it must lie above 0, up to {LONGEST} s");
        scene.refuse("processes.timeout", what, format!("it is written in seconds: {TIMEOUT} is the default"))
    }
}
