//! What one run gave, and what it cost; and what it is compared with: a value that the user gives, or what the finest runs tend to.

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

/// Orders of convergence that are believed.
const ORDERS: std::ops::RangeInclusive<f64> = 0.5..=4.5;

/// Changes that hardly shrink are taken to leave at most so many times the last.
const MOST: f64 = 10.0;

/// Where a value comes from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Source {
    /// The user.
    Given,
    /// Three runs, each twice as fine as the one before, converge with this order, and their limit is extrapolated.
    Extrapolated {
        /// Order.
        order: f64,
    },
    /// The finest run: no order is observed.
    Finest,
}

/// The value of a measure to compare with.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Known {
    /// Value.
    pub value: f64,
    /// Where it comes from.
    pub source: Source,
    /// How far it may be off, relative; `None`: nothing is known of it.
    pub uncertainty: Option<f64>,
}

impl Known {
    /// Where it comes from, in words.
    pub fn words(&self) -> String {
        match self.source {
            Source::Given => "given by the user".into(),
            Source::Extrapolated { order } => {
                format!("extrapolated from the three finest runs, observed order {order:.1}")
            }
            Source::Finest if self.uncertainty.is_none() => "the only run".into(),
            Source::Finest => "the finest run; no order of convergence is observed".into(),
        }
    }
}

/// From the values of runs, each twice as fine as the one before.
///
/// Source: Richardson extrapolation, `f = f3 + (f3 - f2) / (2^p - 1)` with `p = log2((f1 - f2) / (f2 - f3))`.
pub fn limit(values: &[f64]) -> Option<Known> {
    let finest = *values.last()?;
    let relative = |difference: f64| deviation(finest + difference, finest).abs();
    let [.., first, second, third] = *values else {
        let uncertainty = values.len().checked_sub(2).map(|before| relative(values[before] - finest));
        return Some(Known { value: finest, source: Source::Finest, uncertainty });
    };
    let (before, last) = (first - second, second - third);
    let order = (before / last).log2();
    if before * last > 0.0 && ORDERS.contains(&order) {
        let value = third - last / (order.exp2() - 1.0);
        let uncertainty = Some(relative(value - third));
        return Some(Known { value, source: Source::Extrapolated { order }, uncertainty });
    }
    // Without an order: what is left of the changes if they go on to shrink as they did, and no less than the last.
    let ratio = relative(last) / relative(before);
    let uncertainty = Some(match ratio < 1.0 {
        true => relative(last) * (ratio / (1.0 - ratio)).clamp(1.0, MOST),
        false => relative(before).max(relative(last)),
    });
    Some(Known { value: finest, source: Source::Finest, uncertainty })
}

/// How far `value` is from `reference`, relative to it, with its sign; absolute where that is 0.
pub fn deviation(value: f64, reference: f64) -> f64 {
    if reference == 0.0 { value } else { (value - reference) / reference.abs() }
}

/// What runs are compared with, by measure.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Reference(pub Vec<(String, Known)>);

impl Reference {
    /// Of these measures, from runs each twice as fine as the one before; `given` takes precedence. A measure that the finest
    /// run lacks has none.
    pub fn of(measures: &[String], given: &BTreeMap<String, f64>, runs: &[&Outcome]) -> Self {
        let known = |name: &String| {
            if let Some(value) = given.get(name) {
                return Some(Known { value: *value, source: Source::Given, uncertainty: None });
            }
            runs.last()?.measure(name)?;
            let lacking = runs.iter().rposition(|run| run.measure(name).is_none()).map_or(0, |at| at + 1);
            let values: Vec<f64> = runs[lacking..].iter().filter_map(|run| run.measure(name)).collect();
            limit(&values)
        };
        Self(measures.iter().filter_map(|name| Some((name.clone(), known(name)?))).collect())
    }

    /// What a measure is compared with.
    pub fn get(&self, measure: &str) -> Option<&Known> {
        self.0.iter().find(|(name, _)| name == measure).map(|(_, known)| known)
    }

    /// Deviations of a run, relative, with their signs; `None` if it lacks one of the measures.
    pub fn deviations(&self, run: &Outcome) -> Option<Vec<f64>> {
        self.0.iter().map(|(name, known)| Some(deviation(run.measure(name)?, known.value))).collect()
    }

    /// The largest of them.
    pub fn error(&self, run: &Outcome) -> Option<f64> {
        self.deviations(run).map(|all| all.iter().fold(0.0, |most: f64, d| most.max(d.abs())))
    }

    /// How far it may be off itself: the largest of its measures; `None` if nothing is known of one that is computed.
    pub fn uncertainty(&self) -> Option<f64> {
        let computed = self.0.iter().filter(|(_, known)| known.source != Source::Given);
        computed.map(|(_, known)| known.uncertainty).try_fold(0.0, |most: f64, u| Some(most.max(u?)))
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

    #[test]
    fn the_limit_of_a_known_order_is_found() {
        // f(h) = 3 + 0.5 h^p.
        for order in [1.0, 2.0, 3.0] {
            let values: Vec<f64> = [1.0_f64, 0.5, 0.25].iter().map(|h| 3.0 + 0.5 * h.powf(order)).collect();
            let known = limit(&values).expect("three runs");
            assert!((known.value - 3.0).abs() < 1e-12, "{known:?}");
            let Source::Extrapolated { order: observed } = known.source else { panic!("{known:?}") };
            assert!((observed - order).abs() < 1e-9, "{observed}");
            assert!((known.uncertainty.expect("known") - (values[2] - 3.0) / values[2]).abs() < 1e-12);
        }
    }

    #[test]
    fn no_order_is_made_up() {
        // Back and forth, growing apart, unreasonably fast.
        for values in [[1.0, 1.1, 1.05], [1.0, 1.1, 1.3], [1.0, 1.1, 1.100_001]] {
            let known = limit(&values).expect("three runs");
            assert_eq!((known.source, known.value), (Source::Finest, values[2]), "{values:?}");
            let off = known.uncertainty.expect("known");
            let (before, last) = (values[0] - values[1], values[1] - values[2]);
            // All further changes together, if each is as much smaller: a geometric series, summed up term by term.
            let ratio = (last / before).abs();
            let rest: f64 = (1..200).map(|n| last.abs() * ratio.powi(n)).sum();
            let least = if ratio < 1.0 { rest.max(last.abs()) } else { before.abs().max(last.abs()) };
            assert!((off * values[2] - least).abs() < 1e-12, "{values:?}: {off}");
        }
        assert_eq!(limit(&[2.0]).map(|known| known.uncertainty), Some(None));
        assert_eq!(limit(&[]), None);
    }

    #[test]
    fn a_given_value_comes_first_and_a_run_without_a_measure_has_no_error() {
        let runs = [done("depth", 0.5, 1.0), done("depth", 0.4, 1.0)];
        let runs: Vec<_> = runs.iter().collect();
        let measures = ["depth".to_owned()];
        let given = Reference::of(&measures, &BTreeMap::from([("depth".to_owned(), 0.25)]), &runs);
        assert_eq!((given.error(runs[0]), given.uncertainty()), (Some(1.0), Some(0.0)));
        let own = Reference::of(&measures, &BTreeMap::new(), &runs);
        assert!((own.error(runs[0]).expect("there") - 0.25).abs() < 1e-12);
        assert!((own.uncertainty().expect("two runs") - 0.25).abs() < 1e-12);
        assert_eq!(own.error(&done("speed", 0.4, 1.0)), None);
        // A measure that came late: from the runs that have it.
        let late = [done("speed", 1.0, 1.0), done("depth", 0.4, 1.0)];
        let reference = Reference::of(&measures, &BTreeMap::new(), &late.iter().collect::<Vec<_>>());
        assert_eq!(reference.0[0].1.uncertainty, None);
    }
}
