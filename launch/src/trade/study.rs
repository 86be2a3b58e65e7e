//! What is known so far: all finished runs of a study, and what follows from them.

use super::front::Trade;
use super::point::{Point, Space};
use super::reference::Reference;
use super::result::{Outcome, Purpose, Record, Status, median};
use std::cell::RefCell;
use std::collections::{BTreeMap, HashMap};

/// Most rungs that the reference is finer than the scene.
const FINEST: i32 = 6;

/// A finished run and its point.
#[derive(Debug, Clone)]
pub struct Finished {
    /// Its settings.
    pub point: Point,
    /// As on disk.
    pub record: Record,
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
    /// Keys of points that were asked for.
    pub keys: RefCell<HashMap<Point, Option<String>>>,
    /// Beyond this error a setting is not pushed further.
    pub worst: f64,
    /// Accuracies for which settings are recommended, the coarsest first.
    pub accuracies: Vec<f64>,
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
    /// What is computed at a point.
    fn key(&self, point: &Point) -> Option<String> {
        if let Some(key) = self.keys.borrow().get(point) {
            return key.clone();
        }
        let key = self.space.key(point);
        self.keys.borrow_mut().insert(point.clone(), key.clone());
        key
    }

    /// Wall time of all runs so far [s].
    pub fn spent(&self) -> f64 {
        self.runs.iter().map(|run| run.record.outcome.seconds).sum()
    }

    /// What a point gave, when it was first computed.
    pub fn outcome(&self, point: &Point) -> Option<&Outcome> {
        self.runs_of(point).find(|run| run.record.purpose == Purpose::Explore).map(|run| &run.record.outcome)
    }

    /// What came of a run again, to confirm a recommendation.
    pub fn confirmation(&self, point: &Point) -> Option<&Outcome> {
        let mut confirmed = self.runs_of(point).filter(|run| run.record.purpose == Purpose::Confirm);
        confirmed.next_back().map(|run| &run.record.outcome)
    }

    fn runs_of(&self, point: &Point) -> impl DoubleEndedIterator<Item = &Finished> {
        let key = self.key(point);
        self.runs.iter().filter(move |run| Some(&run.record.key) == key.as_ref())
    }

    /// Runs of a point whose time counts.
    pub fn timed(&self, point: &Point) -> Vec<&Outcome> {
        let counts = |run: &&Finished| {
            run.record.purpose != Purpose::Confirm && run.record.outcome.status == Status::Done
        };
        self.runs_of(point).filter(counts).map(|run| &run.record.outcome).collect()
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
        let finest = self.accuracies.iter().copied().fold(f64::INFINITY, f64::min);
        let known_well = runs.len() > 2 && self.reference.uncertainty().is_some_and(|u| u <= 0.2 * finest);
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
        self.error_at(point).is_some_and(|error| error <= self.worst)
    }

    /// Points that compute the scene's own model, each once, with cost and error. Errors below what the reference may be off by
    /// are not told apart.
    pub fn trades(&self) -> Vec<(&Point, Trade)> {
        let least = self.reference.uncertainty().unwrap_or(0.0);
        self.explored()
            .filter(|run| self.space.class(&run.point) == super::knobs::Class::Numerical)
            .filter_map(|run| {
                let error = self.error(&run.record.outcome)?.max(least);
                Some((&run.point, Trade { cost: self.cost(&run.point)?, error }))
            })
            .collect()
    }

    /// First runs of all points.
    pub fn explored(&self) -> impl Iterator<Item = &Finished> {
        self.runs.iter().filter(|run| run.record.purpose == Purpose::Explore)
    }

    /// Points that no other beats, the cheapest first.
    pub fn front(&self) -> Vec<Point> {
        let trades = self.trades();
        let places = super::front::front(&trades.iter().map(|(_, trade)| *trade).collect::<Vec<_>>());
        places.into_iter().map(|place| trades[place].0.clone()).collect()
    }

    /// Points on the front, and those that the noise of `factor` may hide behind it.
    pub fn candidates(&self, factor: f64) -> Vec<Point> {
        let trades = self.trades();
        let numbers: Vec<Trade> = trades.iter().map(|(_, trade)| *trade).collect();
        super::front::near_front(&numbers, factor).into_iter().map(|place| trades[place].0.clone()).collect()
    }

    /// The cheapest point for each accuracy. None where errors are only the distance from the scene itself.
    pub fn recommended(&self) -> Vec<Recommended> {
        if self.is_alone() {
            return Vec::new();
        }
        let trades = self.trades();
        let numbers: Vec<Trade> = trades.iter().map(|(_, trade)| *trade).collect();
        let cheapest =
            |accuracy| super::front::cheapest(&numbers, accuracy).map(|place| trades[place].0.clone());
        self.accuracies
            .iter()
            .map(|accuracy| Recommended { accuracy: *accuracy, point: cheapest(*accuracy) })
            .collect()
    }

    /// What a run of `point` may take with its checks [s]: the least bound that the runs so far give.
    pub fn estimate(&self, point: &Point) -> Option<f64> {
        let ended = |run: &&Finished| {
            let whole = matches!(run.record.outcome.status, Status::Done | Status::Unreliable);
            whole && run.record.purpose != Purpose::Atlas
        };
        let bound = |run: &Finished| run.record.outcome.seconds * self.space.dearer(&run.point, point);
        self.runs.iter().filter(ended).map(bound).min_by(f64::total_cmp)
    }
}
