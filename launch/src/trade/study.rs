//! What is known so far: all finished runs of a study, which measures of them are compared, and what follows from them.

use super::knobs::{Class, Point, Space};
use super::result::{CABLE_FORCE, Purpose, Reference, RunOutcome, Status, TORN, TORN_PART, median};
use crate::front::stop::Stop;
use interface_defs::diagnostic::Diagnostic;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};
use toolkit::explain::suggestion;
use toolkit::once::each_once;

/// Accuracies for which settings are recommended, the coarsest first.
pub const ACCURACIES: [f64; 4] = [0.1, 0.03, 0.01, 0.001];
/// The finest of them.
pub const FINEST_ACCURACY: f64 = ACCURACIES[ACCURACIES.len() - 1];
/// A descent does not begin with settings of a larger error.
const WORST: f64 = 0.2;
/// Most rungs that the reference is finer than the scene.
const FINEST: usize = 6;

/// A finished run, as it is kept on disk; there its point has names of its own.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Finished<P = Point> {
    /// Its settings.
    pub point: P,
    /// What is computed: [`Space::key`].
    pub key: String,
    /// Why it was made.
    pub purpose: Purpose,
    /// Its `--set`s, beside those of the user.
    pub sets: Vec<String>,
    /// What it gave.
    pub outcome: RunOutcome,
}

/// All finished runs of a study.
pub struct Study {
    /// What may be set.
    pub space: Space,
    /// Measures that are compared; empty until the first run is done.
    pub measures: Vec<String>,
    /// References that the user gives.
    pub given: BTreeMap<String, f64>,
    /// In the order in which they ended.
    pub runs: Vec<Finished>,
    /// What runs are compared with, as [`Study::refresh`] has found it.
    pub reference: Reference,
}

/// A recommendation.
#[derive(Debug, Clone, PartialEq)]
pub struct Recommended {
    /// Largest error.
    pub accuracy: f64,
    /// The cheapest point that keeps it; `None`: nothing does.
    pub point: Option<Point>,
}

impl Study {
    /// Choose the measures of the study as soon as a run has some: those that are asked for, those with a given reference, else the
    /// usual ones.
    pub fn choose_measures(&mut self, asked: &[String]) -> Result<(), Stop> {
        let Some(run) = self.runs.iter().find(|run| !run.outcome.measures.is_empty()) else {
            return Ok(());
        };
        let there = &run.outcome.measures;
        let known: Vec<&String> = there.keys().collect();
        let given = self.given.keys().map(|name| (name, "--reference"));
        let named = asked.iter().map(|name| (name, "--measure")).chain(given);
        for (name, option) in named {
            if !there.contains_key(name) {
                let what = format!("{option} {name}: this scene gives no measure of that name");
                let cure = suggestion(name, &known).unwrap_or_default();
                return Err(Diagnostic::new(what).try_instead(cure).into());
            }
        }
        let mut chosen = if asked.is_empty() { usual(&known) } else { asked.to_vec() };
        // Each part that has torn in one of the runs, where all together are compared.
        if chosen.iter().any(|name| name == TORN) {
            let all = self.runs.iter().flat_map(|run| run.outcome.measures.keys());
            chosen.extend(all.filter(|name| name.starts_with(TORN_PART)).cloned());
        }
        self.measures = each_once(chosen.into_iter().chain(self.given.keys().cloned()));
        if self.measures.is_empty() {
            let list: Vec<String> = known.iter().map(|name| format!("`{name}`")).collect();
            let what = "none of the usual measures is given by this scene";
            let cure = format!("name some with --measure; known here: {}", list.join(", "));
            return Err(Diagnostic::new(what).try_instead(cure).into());
        }
        Ok(())
    }

    /// Wall time of all runs so far [s].
    pub fn spent(&self) -> f64 {
        self.runs.iter().map(|run| run.outcome.seconds).sum()
    }

    /// What a point gave, when it was first computed.
    pub fn outcome(&self, point: &Point) -> Option<&RunOutcome> {
        self.runs_of(point).find(|run| run.purpose == Purpose::Explore).map(|run| &run.outcome)
    }

    /// What came of a point that was pushed. What was too slow is tried once more: the machine may have been busy.
    pub fn pushed(&self, point: &Point) -> Option<&RunOutcome> {
        let runs = || self.runs_of(point).filter(|run| run.purpose == Purpose::Atlas).map(|run| &run.outcome);
        runs().find(|run| run.status != Status::Stopped).or_else(|| runs().nth(1))
    }

    /// What came of a run again, to confirm a recommendation.
    pub fn confirmation(&self, point: &Point) -> Option<&RunOutcome> {
        let mut confirmed = self.runs_of(point).filter(|run| run.purpose == Purpose::Confirm);
        confirmed.next_back().map(|run| &run.outcome)
    }

    fn runs_of(&self, point: &Point) -> impl DoubleEndedIterator<Item = &Finished> {
        let key = self.space.key(point);
        self.runs.iter().filter(move |run| Some(&run.key) == key.as_ref())
    }

    /// Runs of a point whose time counts.
    pub fn timed(&self, point: &Point) -> Vec<&RunOutcome> {
        let counts = |run: &&Finished| {
            matches!(run.purpose, Purpose::Explore | Purpose::Repeat) && run.outcome.status == Status::Done
        };
        self.runs_of(point).filter(counts).map(|run| &run.outcome).collect()
    }

    /// Its cost: the median of the processor times [s].
    pub fn cost(&self, point: &Point) -> Option<f64> {
        median(self.timed(point).into_iter().map(RunOutcome::cost).collect())
    }

    /// The scene as it is, and finer and finer in all that the reference refines, as far as it was run.
    pub fn refinements(&self) -> Vec<&RunOutcome> {
        let finer = |rungs| self.outcome(&self.space.refined(&Point::new(), rungs as f64));
        (0..=FINEST).map_while(finer).collect()
    }

    /// The next point of the reference; `None` if it is fine enough.
    pub fn next_refinement(&self) -> Option<Point> {
        let runs = self.refinements();
        let all_given =
            !self.measures.is_empty() && self.measures.iter().all(|name| self.given.contains_key(name));
        let known_well =
            runs.len() > 2 && self.reference.uncertainty().is_some_and(|u| u <= 0.2 * FINEST_ACCURACY);
        let next = runs.len();
        if (all_given && next > 0) || known_well || next > FINEST {
            return None;
        }
        let point = self.space.refined(&Point::new(), next as f64);
        // A scene without numbers to refine is its own reference.
        (self.space.sets(&point).is_some() && self.outcome(&point).is_none()).then_some(point)
    }

    /// Find what runs are compared with, from the last of the refinements that are done: after runs or measures were added.
    pub fn refresh(&mut self) {
        let mut runs = self.refinements();
        while runs.last().is_some_and(|run| run.status != Status::Done) {
            runs.pop();
        }
        let from = runs.iter().rposition(|run| run.status != Status::Done).map_or(0, |at| at + 1);
        self.reference = Reference::of(&self.measures, &self.given, &runs[from..]);
    }

    /// Whether nothing is known of the scene's own error: it is the only run of the reference that is done, and could be refined.
    pub fn is_alone(&self) -> bool {
        let finer = || self.space.sets(&self.space.refined(&Point::new(), 1.0)).is_some();
        !self.reference.0.is_empty() && self.reference.uncertainty().is_none() && finer()
    }

    /// Error of a run that is done and has all measures: its distance from the reference.
    pub fn error(&self, outcome: &RunOutcome) -> Option<f64> {
        let complete = !self.reference.0.is_empty() && self.reference.0.len() == self.measures.len();
        (outcome.status == Status::Done && complete).then(|| self.reference.error(outcome))?
    }

    /// The same with the uncertainty of the reference: what it is at most.
    pub fn bound(&self, outcome: &RunOutcome) -> Option<f64> {
        self.error(outcome).and_then(|_| self.reference.bound(outcome))
    }

    /// Whether a run is good enough for a descent to begin with.
    pub fn is_good(&self, run: &RunOutcome) -> bool {
        self.error(run).is_some_and(|error| error <= WORST)
    }

    /// Points that compute the scene's own model, each once, with cost and the error that they have at most.
    pub fn trades(&self) -> Vec<(&Point, Trade)> {
        let own = self.explored().filter(|run| self.space.class(&run.point) == Class::Numerical);
        own.filter_map(|run| {
            let (cost, error) = (self.cost(&run.point)?, self.bound(&run.outcome)?);
            Some((&run.point, Trade { cost, error }))
        })
        .collect()
    }

    /// First runs of all points.
    pub fn explored(&self) -> impl Iterator<Item = &Finished> {
        self.runs.iter().filter(|run| run.purpose == Purpose::Explore)
    }

    /// Points that no other beats, the cheapest first.
    pub fn front(&self) -> Vec<(&Point, Trade)> {
        front(self.trades())
    }

    /// The cheapest point for each accuracy. None where errors are only the distance from the scene itself.
    pub fn recommended(&self) -> Vec<Recommended> {
        if self.is_alone() {
            return Vec::new();
        }
        let front = self.front();
        let cheapest = |accuracy| front.iter().find(|(_, trade)| trade.error <= accuracy);
        ACCURACIES
            .map(|accuracy| Recommended { accuracy, point: cheapest(accuracy).map(|(p, _)| (*p).clone()) })
            .to_vec()
    }

    /// What a run of `point` may take with its checks [s]: the least bound that the runs so far give.
    pub fn estimate(&self, point: &Point) -> Option<f64> {
        let ended = |run: &&Finished| {
            let whole = matches!(run.outcome.status, Status::Done | Status::Unreliable);
            whole && run.purpose != Purpose::Atlas
        };
        let bound = |run: &Finished| run.outcome.seconds * self.space.dearer(&run.point, point);
        self.runs.iter().filter(ended).map(bound).min_by(f64::total_cmp)
    }
}

/// A point's cost and error.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Trade {
    /// [s]
    pub cost: f64,
    /// Relative, at most.
    pub error: f64,
}

impl Trade {
    fn is_finite(&self) -> bool {
        self.cost.is_finite() && self.error.is_finite()
    }
}

/// Those that no other beats, the cheapest first.
pub fn front<P>(mut all: Vec<(P, Trade)>) -> Vec<(P, Trade)> {
    all.retain(|(_, trade)| trade.is_finite());
    all.sort_by(|(_, a), (_, b)| a.cost.total_cmp(&b.cost).then(a.error.total_cmp(&b.error)));
    let mut best = f64::INFINITY;
    all.retain(|(_, trade)| {
        let before = best;
        best = best.min(trade.error);
        trade.error < before
    });
    all
}

/// Those that would be on the front if they cost `factor` times less: the noise of one run may hide them.
pub fn near_front<P: Copy>(all: &[(P, Trade)], factor: f64) -> Vec<P> {
    let beaten =
        |one: &Trade| all.iter().any(|(_, other)| other.error <= one.error && other.cost < one.cost / factor);
    all.iter().filter(|(_, trade)| trade.is_finite() && !beaten(trade)).map(|(point, _)| *point).collect()
}

/// Measures by default: of each line the first that a rock has, of all rocks. A later block counts where an earlier has none.
const DEFAULTS: &[&[&[&str]]] = &[
    &[
        &["max_deflection", "max_travel", "max_elongation"],
        // Where posts and ropes vibrate, peaks of 1 ms are a matter of chance.
        &["max_reaction_10ms", "max_reaction_1ms", "max_reaction"],
        &[CABLE_FORCE],
        &[TORN],
    ],
    &[&["runout_distance"], &["max_speed"], &["max_jump_height"]],
];
/// Most gauges that are compared by default, where there is nothing else.
const GAUGES: usize = 4;

fn usual(known: &[&String]) -> Vec<String> {
    // With several rocks a name begins with that of one.
    let rock = |name: &str, measure: &str| {
        let before = name.strip_suffix(measure)?;
        (before.is_empty() || before.ends_with('_')).then(|| before.to_owned())
    };
    for block in DEFAULTS {
        let mut found = Vec::new();
        for line in *block {
            let mut rocks = BTreeSet::new();
            for (measure, name) in
                line.iter().flat_map(|measure| known.iter().map(move |name| (measure, name)))
            {
                if rock(name, measure).is_some_and(|rock| rocks.insert(rock)) {
                    found.push((*name).clone());
                }
            }
        }
        if found.iter().any(|name| name != TORN) {
            return found;
        }
    }
    // Extremes of gauges, of which the scene says that they matter.
    let extremes = known.iter().filter(|name| name.ends_with("_min") || name.ends_with("_max"));
    extremes.take(GAUGES).map(|name| (*name).clone()).collect()
}

/// A duration as 90s, 10m, 1h30m; a bare number is seconds.
pub fn duration(text: &str) -> Result<f64, String> {
    let refuse = || format!("{text} is not a duration; write 90s, 10m or 1h30m");
    let mut total = 0.0;
    let mut rest = text.trim();
    while !rest.is_empty() {
        let digits = rest.find(|c: char| !c.is_ascii_digit() && c != '.').unwrap_or(rest.len());
        let value: f64 = rest[..digits].parse().map_err(|_| refuse())?;
        let unit = rest[digits..].find(|c: char| c.is_ascii_digit()).map_or(rest.len(), |at| digits + at);
        total += value
            * match rest[digits..unit].trim() {
                "s" | "" => 1.0,
                "m" | "min" => 60.0,
                "h" => 3600.0,
                _ => return Err(refuse()),
            };
        rest = &rest[unit..];
    }
    if total > 0.0 { Ok(total) } else { Err(refuse()) }
}

/// `NAME=VALUE`.
pub fn given(text: &str) -> Result<(String, f64), String> {
    let pair =
        text.split_once('=').and_then(|(name, value)| Some((name.trim(), value.trim().parse::<f64>().ok()?)));
    match pair {
        Some((name, value)) if value.is_finite() && !name.is_empty() => Ok((name.to_owned(), value)),
        _ => Err(format!("{text} is not a value of a measure; write NAME=VALUE, as in max_deflection=0.495")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn trades(all: &[(f64, f64)]) -> Vec<(usize, Trade)> {
        all.iter().map(|(cost, error)| Trade { cost: *cost, error: *error }).enumerate().collect()
    }

    fn places(all: Vec<(usize, Trade)>) -> Vec<usize> {
        all.into_iter().map(|(place, _)| place).collect()
    }

    #[test]
    fn the_front_holds_those_that_no_other_beats() {
        let all = trades(&[
            (4.0, 0.001),
            (1.0, 0.1),
            (2.0, 0.2),
            (2.0, 0.05),
            (3.0, 0.05),
            (f64::NAN, 0.0),
            (0.5, f64::INFINITY),
        ]);
        assert_eq!(places(front(all.clone())), [1, 3, 0]);
        // By definition.
        for (i, one) in &all {
            let beats = |(_, o): &(usize, Trade)| {
                o.cost <= one.cost && o.error <= one.error && (o.cost < one.cost || o.error < one.error)
            };
            let finite = one.cost.is_finite() && one.error.is_finite();
            assert_eq!(places(front(all.clone())).contains(i), finite && !all.iter().any(beats), "{i}");
        }
        assert!(front::<usize>(Vec::new()).is_empty());
    }

    #[test]
    fn what_noise_may_hide_is_near_the_front() {
        let all = trades(&[(1.0, 0.1), (1.4, 0.1), (1.6, 0.1), (1.6, 0.05), (3.0, 0.05)]);
        assert_eq!(near_front(&all, 1.5), [0, 1, 3]);
        assert_eq!(near_front(&all, 1.0), places(front(all)));
    }

    #[test]
    fn a_duration_has_units() {
        for (text, seconds) in
            [("90s", 90.0), ("10m", 600.0), ("1h30m", 5400.0), ("2.5m", 150.0), ("45", 45.0)]
        {
            assert_eq!(duration(text), Ok(seconds));
        }
        for text in ["", "0s", "10x", "m", "-5m"] {
            assert!(duration(text).is_err(), "{text}");
        }
    }

    #[test]
    fn a_reference_has_a_name_and_a_number() {
        assert_eq!(given("max_deflection=0.49514"), Ok(("max_deflection".into(), 0.49514)));
        for text in ["max_deflection", "=1", "a=b", "a=inf"] {
            assert!(given(text).is_err(), "{text}");
        }
    }

    #[test]
    fn the_usual_measures_are_those_that_are_there() {
        let pick = |names: &[&str]| {
            let names: Vec<String> = names.iter().map(|name| (*name).to_owned()).collect();
            usual(&names.iter().collect::<Vec<_>>())
        };
        assert_eq!(
            pick(&["max_elongation", "max_reaction", "max_reaction_1ms", "max_travel"]),
            ["max_travel", "max_reaction_1ms"]
        );
        // Of every rock its own, whatever others have.
        assert_eq!(
            pick(&["a_max_deflection", "a_max_travel", "b_max_travel", "max_cable_force", TORN]),
            ["a_max_deflection", "b_max_travel", "max_cable_force", TORN]
        );
        assert_eq!(pick(&["max_speed", "x_min"]), ["max_speed"]);
        assert_eq!(pick(&["sag", "x_min", "x_max"]), ["x_min", "x_max"]);
        assert!(pick(&["sag"]).is_empty());
    }
}
