//! What is known so far: all finished runs of a study, and what follows from them.

use super::front::{self, Trade};
use super::knobs::Class;
use super::point::{Point, Space};
use super::reference::Reference;
use super::result::{Outcome, Purpose, Status, median};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Accuracies for which settings are recommended, the coarsest first.
pub const ACCURACIES: [f64; 4] = [0.1, 0.03, 0.01, 0.001];
/// The finest of them.
pub const FINEST_ACCURACY: f64 = ACCURACIES[ACCURACIES.len() - 1];
/// A setting with a larger error is not pushed further.
const WORST: f64 = 0.2;
/// Most rungs that the reference is finer than the scene.
const FINEST: i32 = 6;

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
    pub outcome: Outcome,
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
    /// Wall time of all runs so far [s].
    pub fn spent(&self) -> f64 {
        self.runs.iter().map(|run| run.outcome.seconds).sum()
    }

    /// What a point gave, when it was first computed.
    pub fn outcome(&self, point: &Point) -> Option<&Outcome> {
        self.runs_of(point).find(|run| run.purpose == Purpose::Explore).map(|run| &run.outcome)
    }

    /// What came of a run again, to confirm a recommendation.
    pub fn confirmation(&self, point: &Point) -> Option<&Outcome> {
        let mut confirmed = self.runs_of(point).filter(|run| run.purpose == Purpose::Confirm);
        confirmed.next_back().map(|run| &run.outcome)
    }

    fn runs_of(&self, point: &Point) -> impl DoubleEndedIterator<Item = &Finished> {
        let key = self.space.key(point);
        self.runs.iter().filter(move |run| Some(&run.key) == key.as_ref())
    }

    /// Runs of a point whose time counts.
    pub fn timed(&self, point: &Point) -> Vec<&Outcome> {
        let counts = |run: &&Finished| run.purpose != Purpose::Confirm && run.outcome.status == Status::Done;
        self.runs_of(point).filter(counts).map(|run| &run.outcome).collect()
    }

    /// Its cost: the median of the wall times [s].
    pub fn cost(&self, point: &Point) -> Option<f64> {
        median(self.timed(point).iter().map(|run| run.wall).collect())
    }

    /// The scene as it is, and finer and finer in all that the reference refines, as far as it was run.
    pub fn refinements(&self) -> Vec<&Outcome> {
        let finer = |rungs| self.outcome(&self.space.refined(&Point::new(), rungs));
        (0..=FINEST).map_while(finer).collect()
    }

    /// The next point of the reference; `None` if it is fine enough.
    pub fn next_refinement(&self) -> Option<Point> {
        let runs = self.refinements();
        let all_given =
            !self.measures.is_empty() && self.measures.iter().all(|name| self.given.contains_key(name));
        let known_well =
            runs.len() > 2 && self.reference.uncertainty().is_some_and(|u| u <= 0.2 * FINEST_ACCURACY);
        let next = runs.len() as i32;
        if (all_given && next > 0) || known_well || next > FINEST {
            return None;
        }
        let point = self.space.refined(&Point::new(), next);
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
        let finer = || self.space.sets(&self.space.refined(&Point::new(), 1)).is_some();
        !self.reference.0.is_empty() && self.reference.uncertainty().is_none() && finer()
    }

    /// Error of a run that is done and has all measures.
    pub fn error(&self, outcome: &Outcome) -> Option<f64> {
        let complete = !self.reference.0.is_empty() && self.reference.0.len() == self.measures.len();
        if outcome.status == Status::Done && complete { self.reference.error(outcome) } else { None }
    }

    /// Error of a point.
    pub fn error_at(&self, point: &Point) -> Option<f64> {
        self.error(self.outcome(point)?)
    }

    /// Whether a point is worth pushing further.
    pub fn is_good(&self, point: &Point) -> bool {
        self.error_at(point).is_some_and(|error| error <= WORST)
    }

    /// Points that compute the scene's own model, each once, with cost and error. Errors below what the reference may be off by
    /// are not told apart.
    pub fn trades(&self) -> Vec<(&Point, Trade)> {
        let least = self.reference.uncertainty().unwrap_or(0.0);
        self.explored()
            .filter(|run| self.space.class(&run.point) == Class::Numerical)
            .filter_map(|run| {
                let error = self.error(&run.outcome)?.max(least);
                Some((&run.point, Trade { cost: self.cost(&run.point)?, error }))
            })
            .collect()
    }

    /// First runs of all points.
    pub fn explored(&self) -> impl Iterator<Item = &Finished> {
        self.runs.iter().filter(|run| run.purpose == Purpose::Explore)
    }

    /// Points that no other beats, the cheapest first.
    pub fn front(&self) -> Vec<(&Point, Trade)> {
        front::front(self.trades())
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
