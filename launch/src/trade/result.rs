//! What one run gave, and what it cost.

use crate::sweep::Ran;
use interface_defs::diagnostic::{Diagnostic, code};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::collections::BTreeMap;
use toolkit::exit::Exit;
use toolkit::summary::{RunStatus, Summary};

/// How a run ended.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Status {
    /// Computed to the end, within the bounds of trust.
    Done,
    /// Computed to the end, beyond one of them.
    Unreliable,
    /// It failed.
    #[default]
    Failed,
    /// Its settings were refused.
    Refused,
    /// Ended from here, because it was slower than allowed.
    Stopped,
}

impl Status {
    /// One word.
    pub fn word(self) -> &'static str {
        match self {
            Self::Done => "done",
            Self::Unreliable => "unreliable",
            Self::Failed => "failed",
            Self::Refused => "refused",
            Self::Stopped => "too slow",
        }
    }
}

/// What one run gave, and what it cost.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Outcome {
    /// How it ended.
    pub status: Status,
    /// Why it is not done.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub errors: Vec<Diagnostic>,
    /// Wall time of the whole command, with its checks [s].
    pub seconds: f64,
    /// Wall time of the run itself [s].
    pub wall: f64,
    /// Of its time loop [s].
    pub time_loop: Option<f64>,
    /// Processor time by process [s].
    pub cpu: BTreeMap<String, f64>,
    /// Passes over both solvers.
    pub passes: Option<f64>,
    /// Largest peak memory of a process [bytes].
    pub memory: Option<f64>,
    /// Value and unit by name.
    pub measures: BTreeMap<String, (f64, String)>,
}

impl Outcome {
    /// Of a run that was to take no more than `limit` [s].
    pub fn of_run(ran: Ran, limit: f64) -> Self {
        let status = match ran.summary {
            Some(summary) if !ran.too_slow => return Self::of(&summary, ran.seconds),
            _ if ran.too_slow => Status::Stopped,
            _ if ran.exit == Exit::BadInput => Status::Refused,
            _ => Status::Failed,
        };
        let slow = || format!("ended after {limit:.1} s: slower than settings like these should be");
        let errors = if ran.too_slow { vec![Diagnostic::error(code::LIMIT, slow())] } else { ran.errors };
        Self::without_results(status, errors, ran.seconds)
    }

    /// From the summary of a run that took `seconds`.
    fn of(summary: &Summary, seconds: f64) -> Self {
        let cost = |path: &[&str]| number(&summary.cost, path);
        let processes = summary.cost.get("processes").and_then(Value::as_object);
        let of_each = |name: &str| -> BTreeMap<String, f64> {
            let each = processes.into_iter().flatten();
            each.filter_map(|(process, at)| Some((process.clone(), at.get(name)?.as_f64()?))).collect()
        };
        let mut cpu = of_each("cpu_s");
        if let (true, Some(alone)) = (cpu.is_empty(), cost(&["cpu_s"])) {
            cpu.insert("solver".into(), alone);
        }
        let memory = of_each("peak_memory_bytes").into_values().reduce(f64::max);
        Self {
            status: match summary.status {
                RunStatus::Done => Status::Done,
                RunStatus::Unreliable => Status::Unreliable,
                RunStatus::Failed | RunStatus::Interrupted => Status::Failed,
            },
            errors: summary.reasons.clone(),
            seconds,
            wall: cost(&["wall_s"]).unwrap_or(seconds),
            time_loop: cost(&["loop_s"]).or_else(|| cost(&["stages", "loop_s"])),
            cpu,
            passes: number(&summary.coupling, &["iterations"]),
            memory: memory.or_else(|| cost(&["peak_memory_bytes"])),
            measures: (summary.measures.iter())
                .map(|m| (m.name.clone(), (m.value, m.unit.clone())))
                .collect(),
        }
    }

    /// One that gave nothing.
    pub fn without_results(status: Status, errors: Vec<Diagnostic>, seconds: f64) -> Self {
        Self { status, errors, seconds, wall: seconds, ..Self::default() }
    }

    /// Why it is not done, in words.
    pub fn message(&self) -> String {
        self.errors.iter().map(Diagnostic::headline).collect::<Vec<_>>().join("; ")
    }

    /// A measure.
    pub fn measure(&self, name: &str) -> Option<f64> {
        self.measures.get(name).map(|(value, _)| *value)
    }
}

fn number(table: &serde_json::Map<String, Value>, path: &[&str]) -> Option<f64> {
    let (first, rest) = path.split_first()?;
    rest.iter().try_fold(table.get(*first)?, |value, name| value.get(name))?.as_f64()
}

/// Why a run is made.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Purpose {
    /// To see what a point gives.
    Explore,
    /// To see what it costs, again.
    Repeat,
    /// To confirm a recommendation.
    Confirm,
    /// To find where a knob breaks.
    Atlas,
}

/// The middle one of `values`, of an even number the mean of the two in the middle.
pub fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    let half = values.len() / 2;
    match values.len() {
        0 => None,
        n if n % 2 == 1 => Some(values[half]),
        _ => Some(0.5 * (values[half - 1] + values[half])),
    }
}

#[cfg(test)]
pub mod tests {
    use super::*;
    use interface_defs::message::Measure;
    use serde_json::json;

    /// A run that is done, with one measure.
    pub fn done(name: &str, value: f64, wall: f64) -> Outcome {
        let mut outcome = Outcome::without_results(Status::Done, Vec::new(), wall);
        outcome.measures.insert(name.into(), (value, "m".into()));
        outcome
    }

    #[test]
    fn the_cost_of_a_summary_is_read_by_process_and_stage() {
        let mut summary = Summary::new(RunStatus::Unreliable);
        let measure = |name: &str| Measure::new(name, 2.0, "N");
        summary.measures =
            vec![measure("max_reaction"), measure("posts_tension_min").of_member(Some("post 3".into()))];
        let cost = json!({ "wall_s": 2.5, "stages": { "loop_s": 2.0 }, "processes": {
            "dem": { "cpu_s": 1.5, "peak_memory_bytes": 10 }, "fem": { "cpu_s": 0.25, "peak_memory_bytes": 30 } } });
        summary.cost = cost.as_object().expect("a table").clone();
        summary.coupling.insert("iterations".into(), 12.into());
        let outcome = Outcome::of(&summary, 3.0);
        assert_eq!((outcome.status, outcome.wall, outcome.time_loop), (Status::Unreliable, 2.5, Some(2.0)));
        assert_eq!(
            (outcome.cpu.values().sum::<f64>(), outcome.memory, outcome.passes),
            (1.75, Some(30.0), Some(12.0))
        );
        assert_eq!(outcome.measure("posts_tension_min"), Some(2.0));
    }

    #[test]
    fn the_median_is_in_the_middle() {
        assert_eq!(median(vec![3.0, 1.0, 9.0]), Some(3.0));
        assert_eq!(median(vec![3.0, 1.0, 9.0, 5.0]), Some(4.0));
        assert_eq!(median(vec![]), None);
    }
}
