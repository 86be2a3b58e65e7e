//! Which run comes next. A function of the finished runs and the budget alone, so that a study goes on where it was left.
//!
//! In this order, each up to its share of the budget: the scene and the reference; each arm of the scene, presets and the yielding net
//! before the others; knobs of the model; a descent from settings to their neighbours; repeats of what is on the front, so that the
//! medians decide; each recommendation once more.
//!
//! The descent goes, in every arm and for every accuracy, from the cheapest settings that keep it to those that are coarser in one knob.
//! Where none keep it, it goes from the most accurate to those that are finer in one. Settings that are coarser in everything than some
//! that were refuted are not tried.

use super::atlas::Atlas;
use super::budget::{Budget, NextRun, REFERENCE};
use super::knobs::{Class, NET, Point, rung, with};
use super::result::{Purpose, RunOutcome, Status};
use super::study::{ACCURACIES, Finished, Study, Trade, near_front};

/// Shares of the budget up to which runs of a stage may start, behind those of the reference.
const ARMS: f64 = 0.5;
const MODEL: f64 = 0.56;
const DESCENT: f64 = 0.8;
const REPEATS: f64 = 0.93;

/// Most rungs of a knob of the model.
const MODELS: i32 = 2;
/// Most rungs that a window is shortened until an arm computes at all.
const RESCUE: i32 = 6;
/// Runs of each point on the front.
pub const RUNS: usize = 3;
/// So many times slower than it is a run may be on a busy machine.
const NOISE: f64 = 1.5;
/// A run may take so many times its estimate, and these seconds besides.
const PATIENCE: (f64, f64) = (4.0, 5.0);
/// Largest share of the budget that one run may take, apart from those of the reference: one setting that is far slower than the
/// others must not cost the study.
const ONE_RUN: f64 = 0.1;

/// The run that comes next within `budget`; `None`: nothing is left to do, or nothing that fits.
pub fn next(study: &Study, budget: Budget) -> Option<NextRun> {
    let planner = Planner { study, budget };
    if study.runs.is_empty() {
        return Some(NextRun {
            point: Point::new(),
            purpose: Purpose::Explore,
            limit: budget.limit(budget.whole()),
        });
    }
    planner
        .reference()
        .or_else(|| study.space.arms().iter().find_map(|arm| planner.rescue(arm)))
        .or_else(|| planner.models())
        .or_else(|| planner.descend())
        .or_else(|| planner.repeats())
        .or_else(|| planner.confirmations())
}

/// The same for the limits of stability: the reference, then what their searches need.
pub fn next_of_atlas(study: &Study, budget: Budget) -> Option<NextRun> {
    let of_reference =
        if study.runs.is_empty() { next(study, budget) } else { Planner { study, budget }.reference() };
    of_reference.or_else(|| Atlas { study, budget }.next())
}

struct Planner<'a> {
    study: &'a Study,
    budget: Budget,
}

impl Planner<'_> {
    /// A run of `point`, if it fits into this share of the budget.
    fn task(&self, point: &Point, purpose: Purpose, share: f64) -> Option<NextRun> {
        let estimate = self.study.estimate(point)?;
        if !self.budget.holds(self.study, estimate, share) {
            return None;
        }
        let left = self.budget.whole() - self.study.spent();
        let most = if share == REFERENCE { left } else { (ONE_RUN * self.budget.whole()).max(estimate) };
        let limit = self.budget.limit((PATIENCE.0 * estimate).min(most.min(left)) + PATIENCE.1);
        Some(NextRun { point: point.clone(), purpose, limit })
    }

    /// The first run of a point that has none.
    fn explore(&self, point: &Point, share: f64) -> Option<NextRun> {
        self.study.space.key(point)?;
        if self.study.outcome(point).is_some() {
            return None;
        }
        self.task(point, Purpose::Explore, share)
    }

    fn reference(&self) -> Option<NextRun> {
        self.explore(&self.study.next_refinement()?, REFERENCE)
    }

    /// The first point of an arm, and shorter windows until one is good. What is too slow as it is, is slower with these.
    fn rescue(&self, arm: &Point) -> Option<NextRun> {
        let mut points = (0..=RESCUE).map(|rungs| with(arm, "window", -f64::from(rungs)));
        let last = |run: &RunOutcome| run.status == Status::Stopped || self.study.is_good(run);
        let next = points.find(|point| self.study.outcome(point).is_none_or(last))?;
        self.explore(&next, ARMS)
    }

    fn models(&self) -> Option<NextRun> {
        let space = &self.study.space;
        let knobs =
            || space.knobs().iter().filter(|knob| knob.turned && knob.class == Class::Model).map(|k| k.name);
        // A finer net swings faster: its steps and windows are as much shorter.
        let finer =
            |name: &str, depth| if name == NET { space.refined(&Point::new(), depth) } else { Point::new() };
        let both = |name, depth| [with(&finer(name, depth), name, -depth), Point::from([(name, depth)])];
        let depths = (1..=MODELS).map(f64::from);
        let mut points = depths.flat_map(|depth| knobs().flat_map(move |name| both(name, depth)));
        points.find_map(|point| self.explore(&point, MODEL))
    }

    /// The neighbours of what is the cheapest so far, or the most accurate. Those of what costs least come first.
    fn descend(&self) -> Option<NextRun> {
        let (study, space) = (self.study, &self.study.space);
        let trades = study.trades();
        let arms = space.arms();
        let mut moves: Vec<(f64, Point)> = Vec::new();
        for accuracy in ACCURACIES {
            let refuted = refuted(study, accuracy);
            let keeps = |(_, trade): &&(&Point, Trade)| trade.error <= accuracy;
            let mut add = |from: Option<&(&Point, Trade)>, to: &dyn Fn(&Point) -> Vec<Point>| {
                let open = from
                    .into_iter()
                    .flat_map(|(point, trade)| to(point).into_iter().map(|to| (trade.cost, to)));
                moves.extend(open.filter(|(_, point)| is_open(study, &refuted, point)));
            };
            for arm in &arms {
                let own = || trades.iter().filter(|(point, _)| space.arm_of(point) == *arm);
                match cheapest(own().filter(keeps)) {
                    None => add(own().min_by(|a, b| a.1.error.total_cmp(&b.1.error)), &|point| {
                        moved(study, point, -1.0)
                    }),
                    best => add(best, &|point| moved(study, point, 1.0)),
                }
            }
            add(cheapest(trades.iter().filter(keeps)), &|point| pairs(study, point));
        }
        moves.sort_by(|a, b| a.0.total_cmp(&b.0));
        moves.iter().find_map(|(_, point)| self.explore(point, DESCENT))
    }

    /// Those on the front, those that noise may hide behind it, and the scene in turn, the one with the fewest runs first.
    fn repeats(&self) -> Option<NextRun> {
        let scene = Point::new();
        let runs = |point: &&Point| self.study.timed(point).len();
        let mut few = near_front(&self.study.trades(), NOISE);
        few.push(&scene);
        few.retain(|point| (1..RUNS).contains(&runs(point)));
        few.sort_by_key(runs);
        few.into_iter().find_map(|point| self.task(point, Purpose::Repeat, REPEATS))
    }

    fn confirmations(&self) -> Option<NextRun> {
        let points = self.study.recommended().into_iter().filter_map(|recommended| recommended.point);
        let mut unconfirmed = points.filter(|point| self.study.confirmation(point).is_none());
        unconfirmed.find_map(|point| self.task(&point, Purpose::Confirm, 1.0))
    }
}

/// The one that costs least.
fn cheapest<'a>(all: impl Iterator<Item = &'a (&'a Point, Trade)>) -> Option<&'a (&'a Point, Trade)> {
    all.min_by(|a, b| a.1.cost.total_cmp(&b.1.cost))
}

/// `point` with one ladder moved.
fn moved(study: &Study, point: &Point, by: f64) -> Vec<Point> {
    let ladders = study.space.turned(point).filter(|knob| knob.is_ladder());
    ladders.map(|knob| with(point, knob.name, rung(point, knob.name) + by)).collect()
}

/// What is coarser in one knob and finer in another: longer windows have more parts.
fn pairs(study: &Study, point: &Point) -> Vec<Point> {
    moved(study, point, 1.0)
        .iter()
        .flat_map(|coarser| moved(study, coarser, -1.0))
        .filter(|other| other != point)
        .collect()
}

/// Points that do not keep `accuracy`.
fn refuted(study: &Study, accuracy: f64) -> Vec<Point> {
    let fails = |run: &&Finished| {
        run.outcome.status != Status::Done || study.bound(&run.outcome).is_none_or(|bound| bound > accuracy)
    };
    study.explored().filter(fails).map(|run| run.point.clone()).collect()
}

/// Whether nothing is known of a point: it was not run, and is not coarser in everything than one that failed.
fn is_open(study: &Study, refuted: &[Point], point: &Point) -> bool {
    let space = &study.space;
    let coarser = |failed: &Point| {
        space.knobs().iter().all(|knob| {
            let (a, b) = (rung(point, knob.name), rung(failed, knob.name));
            if !knob.is_ladder() || knob.class == Class::Model { a == b } else { a >= b }
        })
    };
    space.key(point).is_some() && study.outcome(point).is_none() && !refuted.iter().any(coarser)
}
