//! What one run gave, and what it cost; and what it is compared with: a value that the user gives, or what the finest runs tend to.

use crate::run::sweep::Ran;
use interface_defs::diagnostic::{Diagnostic, code};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::collections::BTreeMap;
use std::ops::Add;
use toolkit::exit::Exit;
use toolkit::summary::{RunStatus, Summary};

interface_defs::worded! {
    /// How a run ended.
    #[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
    #[serde(rename_all = "snake_case")]
    pub enum Status with word {
        /// Computed to the end, within the bounds of trust.
        Done = "done",
        /// Computed to the end, beyond one of them.
        Unreliable = "unreliable",
        /// It failed.
        #[default]
        Failed = "failed",
        /// Its settings were refused.
        Refused = "refused",
        /// Ended from here, because it was slower than allowed.
        Stopped = "too slow",
    }
}

/// Measure of the largest force of a cable.
pub const CABLE_FORCE: &str = "max_cable_force";
/// Measure of how many elements tore, where something can, and what the name of a part follows in its own.
pub const TORN: &str = "torn_elements";
/// No measure of a program has a point in its name.
pub const TORN_PART: &str = "torn.";

/// What one run gave, and what it cost.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct RunOutcome {
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

impl RunOutcome {
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
        let measures = summary.measures.iter().map(|m| (m.name.clone(), (m.value, m.unit.clone())));
        let mut measures: BTreeMap<_, _> = measures.collect();
        if let Some(torn) = &summary.torn {
            let counts = || torn.iter().map(|part| part.elements as f64);
            let parts = torn.iter().map(|part| format!("{TORN_PART}{}", part.part)).zip(counts());
            // Of nothing the sum is -0.
            let all = parts.chain([(TORN.to_owned(), counts().fold(0.0, f64::add))]);
            measures.extend(all.map(|(name, count)| (name, (count, String::new()))));
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
            measures,
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

    /// A measure. Of a part that is not among those that tore, nothing did.
    pub fn measure(&self, name: &str) -> Option<f64> {
        let whole = || (name.starts_with(TORN_PART) && self.measures.contains_key(TORN)).then_some(0.0);
        self.measures.get(name).map(|(value, _)| *value).or_else(whole)
    }

    /// What it costs [s]: processor time of all processes. Wall time is that of whatever else the machine does. Where no process
    /// says its own, the wall time all the same.
    pub fn cost(&self) -> f64 {
        if self.cpu.is_empty() { self.wall } else { self.cpu.values().sum() }
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

/// Orders of convergence that are believed: no scheme of the solvers has a higher one than 2.
const ORDERS: std::ops::RangeInclusive<f64> = 0.5..=2.5;
/// A change of one of the finest runs that is smaller than this share of the change before is small by accident.
const SHRINKS: f64 = 0.25;
/// Safety factors of the grid convergence index: with an order that is observed, and without.
const SAFETY: (f64, f64) = (1.25, 3.0);

/// Where a value comes from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Source {
    /// The user.
    Given,
    /// The finest run. Nothing is extrapolated: that may be worse than what was computed.
    Finest {
        /// Order of convergence, if all changes between the last runs have one.
        order: Option<f64>,
    },
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
            Source::Finest { order: Some(order) } => format!("the finest run, observed order {order:.1}"),
            Source::Finest { .. } if self.uncertainty.is_none() => "the only run".into(),
            Source::Finest { .. } => "the finest run; no order of convergence is observed".into(),
        }
    }
}

/// From the values of runs, each twice as fine as the one before: the last, and how far it may be off. That is no less than its
/// distance from the one before, and what is left by the order `p = log2((f1 - f2) / (f2 - f3))`, with a safety factor.
///
/// Source: grid convergence index, Roache 1994, J. Fluids Eng. 116, 405.
pub fn limit(values: &[f64]) -> Option<Known> {
    let value = *values.last()?;
    let changes: Vec<f64> = values.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let orders: Vec<f64> = changes.windows(2).rev().take(2).map(|pair| (pair[0] / pair[1]).log2()).collect();
    let order = orders.first().copied().filter(|_| orders.iter().all(|order| ORDERS.contains(order)));
    let last = changes.iter().fold(0.0, |before, change| change.abs().max(SHRINKS * before));
    let left = order.map_or(SAFETY.1, |order| SAFETY.0 * (order.exp2() - 1.0).recip().max(1.0));
    let uncertainty = (!changes.is_empty()).then(|| deviation(value + left * last, value).abs());
    Some(Known { value, source: Source::Finest { order }, uncertainty })
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
    pub fn of(measures: &[String], given: &BTreeMap<String, f64>, runs: &[&RunOutcome]) -> Self {
        let known = |name: &String| {
            if let Some(value) = given.get(name) {
                return Some(Known { value: *value, source: Source::Given, uncertainty: None });
            }
            runs.last()?.measure(name)?;
            let lacking = runs.iter().rposition(|run| run.measure(name).is_none()).map_or(0, |at| at + 1);
            let values: Vec<f64> = runs[lacking..].iter().filter_map(|run| run.measure(name)).collect();
            limit(&values)
        };
        let mut all: Vec<_> = measures.iter().filter_map(|name| Some((name.clone(), known(name)?))).collect();
        // One change may be small by accident: of two runs all measures are known as the one that changes most.
        if runs.len() == 2 {
            let most = all.iter().filter_map(|(_, known)| known.uncertainty).fold(0.0, f64::max);
            all.iter_mut().filter_map(|(_, known)| known.uncertainty.as_mut()).for_each(|off| *off = most);
        }
        Self(all)
    }

    /// What a measure is compared with.
    pub fn get(&self, measure: &str) -> Option<&Known> {
        self.0.iter().find(|(name, _)| name == measure).map(|(_, known)| known)
    }

    /// The largest deviation of a run; `None` if it lacks one of the measures.
    pub fn error(&self, run: &RunOutcome) -> Option<f64> {
        self.largest(run, |deviation, _| deviation)
    }

    /// The same with what the reference may be off itself.
    pub fn bound(&self, run: &RunOutcome) -> Option<f64> {
        self.largest(run, |deviation, known| deviation + known.uncertainty.unwrap_or(0.0))
    }

    fn largest(&self, run: &RunOutcome, of: impl Fn(f64, &Known) -> f64) -> Option<f64> {
        let each =
            self.0.iter().map(|(name, known)| Some((deviation(run.measure(name)?, known.value), known)));
        each.map(|one| one.map(|(off, known)| of(off.abs(), known)))
            .try_fold(0.0, |most: f64, off| Some(most.max(off?)))
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
    pub fn done(name: &str, value: f64, wall: f64) -> RunOutcome {
        let mut outcome = RunOutcome::without_results(Status::Done, Vec::new(), wall);
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
        let outcome = RunOutcome::of(&summary, 3.0);
        assert_eq!((outcome.status, outcome.wall, outcome.time_loop), (Status::Unreliable, 2.5, Some(2.0)));
        assert_eq!(
            (outcome.cpu.values().sum::<f64>(), outcome.memory, outcome.passes),
            (1.75, Some(30.0), Some(12.0))
        );
        assert_eq!((outcome.measure("posts_tension_min"), outcome.cost()), (Some(2.0), 1.75));
    }

    #[test]
    fn the_median_is_in_the_middle() {
        assert_eq!(median(vec![3.0, 1.0, 9.0]), Some(3.0));
        assert_eq!(median(vec![3.0, 1.0, 9.0, 5.0]), Some(4.0));
        assert_eq!(median(vec![]), None);
    }

    /// f(h) = 3 + a h^p, and a disturbance that no order has: what is said to be known covers the truth, and is the finest run.
    #[test]
    fn the_uncertainty_covers_the_truth() {
        for order in [0.6, 1.0, 1.5, 2.0] {
            for runs in 2..6 {
                for noise in [0.0, 1e-4, 1e-2] {
                    let value = |n: i32| {
                        let h = 0.5_f64.powi(n);
                        3.0 + 0.5 * h.powf(order) + noise * h * f64::from(n * n * 7).sin()
                    };
                    let values: Vec<f64> = (0..runs).map(value).collect();
                    let known = limit(&values).expect("runs");
                    assert_eq!(known.value, values[values.len() - 1]);
                    let off = (known.value - 3.0).abs() / known.value;
                    let said = known.uncertainty.expect("two runs at least");
                    assert!(off <= said, "{order} {runs} {noise}: {off} where {said} is said");
                    let seen = matches!(known.source, Source::Finest { order: Some(seen) } if (seen - order).abs() < 1e-9);
                    assert_eq!(seen, runs > 2 && noise == 0.0, "{known:?}");
                }
            }
        }
    }

    #[test]
    fn no_order_is_made_up() {
        // Back and forth, growing apart, an order that no scheme has, and one that the runs before do not have.
        for values in
            [&[1.0, 1.1, 1.05][..], &[1.0, 1.1, 1.3], &[1.0, 1.1, 1.100_001], &[1.0, 0.9, 1.0, 1.05]]
        {
            let known = limit(values).expect("three runs");
            assert_eq!(known.source, Source::Finest { order: None }, "{values:?}");
            let [.., before, last, finest] = *values else { panic!("three runs") };
            let off = known.uncertainty.expect("known") * finest;
            let least = (finest - last).abs().max(0.25 * (last - before).abs());
            assert!(off >= 3.0 * least - 1e-12, "{values:?}: {off}");
        }
        assert_eq!(limit(&[2.0]).map(|known| known.uncertainty), Some(None));
        assert_eq!(limit(&[]), None);
    }

    /// Of two runs nobody can say that a change is small by accident; of three the one before says so.
    #[test]
    fn a_measure_that_two_runs_happen_to_agree_on_is_not_known_better() {
        let run = |depth: f64, force: f64| {
            let mut run = done("depth", depth, 1.0);
            run.measures.insert("force".into(), (force, "N".into()));
            run
        };
        let runs = [run(1.0, 1.0), run(1.1, 1.0), run(1.15, 1.01)];
        let measures = ["depth".to_owned(), "force".to_owned()];
        let of = |runs: &[RunOutcome]| {
            let known = Reference::of(&measures, &BTreeMap::new(), &runs.iter().collect::<Vec<_>>());
            known.0.iter().map(|(_, known)| known.uncertainty.expect("known")).collect::<Vec<_>>()
        };
        let two = of(&runs[..2]);
        assert!(two[0] == two[1] && (two[0] - 3.0 * 0.1 / 1.1).abs() < 1e-12, "{two:?}");
        assert!((of(&runs)[1] - 3.0 * 0.01 / 1.01).abs() < 1e-12);
    }

    #[test]
    fn what_tears_is_a_measure_of_each_part() {
        let mut summary = Summary::new(RunStatus::Done);
        assert_eq!(RunOutcome::of(&summary, 1.0).measure(TORN), None, "nothing can tear");
        summary.torn = Some(Vec::new());
        let whole = RunOutcome::of(&summary, 1.0);
        assert_eq!((whole.measure(TORN), whole.measure("torn.rope")), (Some(0.0), Some(0.0)));
        assert!(whole.measure(TORN).is_some_and(f64::is_sign_positive));
        let part =
            json!({ "part": "rope", "elements": 2, "first": 0.1, "last": 0.2, "force": 1.0, "member": "m" });
        summary.torn = Some(vec![serde_json::from_value(part).expect("a part")]);
        let torn = RunOutcome::of(&summary, 1.0);
        assert_eq!((torn.measure(TORN), torn.measure("torn.rope")), (Some(2.0), Some(2.0)));
        assert_eq!(torn.measure("torn.net"), Some(0.0));
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
        assert!((own.uncertainty().expect("two runs") - 3.0 * 0.25).abs() < 1e-12);
        assert!((own.bound(runs[0]).expect("there") - 4.0 * 0.25).abs() < 1e-12);
        assert_eq!(own.error(&done("speed", 0.4, 1.0)), None);
        // A measure that came late: from the runs that have it.
        let late = [done("speed", 1.0, 1.0), done("depth", 0.4, 1.0)];
        let reference = Reference::of(&measures, &BTreeMap::new(), &late.iter().collect::<Vec<_>>());
        assert_eq!(reference.0[0].1.uncertainty, None);
    }
}
