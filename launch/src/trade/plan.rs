//! Which run comes next. A function of the finished runs and the budget alone, so that a study goes on where it was left.
//!
//! In this order, each up to its share of the budget: the scene and the reference; each arm of the scene, presets and the yielding net
//! before the others; one knob at a time, both ways, for each of them, the cheapest first; knobs of the model; combinations near the front; repeats of what is on the front, so that the
//! medians decide; each recommendation once more.
//!
//! Combinations are the neighbours of the cheapest settings for an accuracy. What is coarser in everything than a point that was refuted
//! is not tried.

use super::knobs::{Class, NET, Point, rung, with};
use super::result::{Outcome, Purpose, Status};
use super::study::{ACCURACIES, Study, near_front};
use std::fmt;
use toolkit::numbers::seconds;

/// Shares of the budget up to which runs of a stage may start.
const REFERENCE: f64 = 0.35;
const LADDERS: f64 = 0.62;
const MODEL: f64 = 0.68;
const COMBINATIONS: f64 = 0.8;
const REPEATS: f64 = 0.93;

/// Most rungs up, down, and of a knob of the model.
const COARSER: i32 = 8;
const FINER: i32 = 2;
const MODELS: i32 = 2;
/// Most rungs that a window is shortened until an arm computes at all.
const RESCUE: i32 = 6;
/// What costs at most so many times the best may lead to a better one.
const CLOSE: f64 = 1.2;
/// Runs of each point on the front.
pub const RUNS: usize = 3;
/// So many times slower than it is a run may be on a busy machine.
const NOISE: f64 = 1.5;
/// A finer rung is followed by another if it takes away at least this share of the error.
const WORTH: f64 = 0.2;
/// A run may take so many times its estimate, and these seconds besides.
const PATIENCE: (f64, f64) = (4.0, 5.0);
/// Largest share of the budget that one run may take, apart from those of the reference: one setting that is far slower than the
/// others must not cost the study.
const ONE_RUN: f64 = 0.1;

/// Longest that a run may take where runs are counted instead of their time [s].
const A_DAY: f64 = 86_400.0;

/// What a study may cost.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Budget {
    /// Wall time of all runs together [s].
    Time(f64),
    /// So many runs, however long these take: what is tried depends less on how busy the machine is.
    Runs(u32),
}

impl Budget {
    /// How much it is: seconds or runs.
    fn whole(self) -> f64 {
        match self {
            Self::Time(seconds) => seconds,
            Self::Runs(runs) => runs.into(),
        }
    }

    /// How long a run may take [s], of which that much time would be enough.
    pub fn limit(self, enough: f64) -> f64 {
        match self {
            Self::Time(_) => enough,
            Self::Runs(_) => A_DAY,
        }
    }

    /// How much of it `study` has used, and what one more run of so many seconds takes.
    fn used(self, study: &Study, run: f64) -> (f64, f64) {
        match self {
            Self::Time(_) => (study.spent(), run),
            Self::Runs(_) => (study.runs.len() as f64, 1.0),
        }
    }

    /// Whether one more run of so many seconds fits into this share of it.
    pub fn holds(self, study: &Study, run: f64, share: f64) -> bool {
        let (used, more) = self.used(study, run);
        used + more <= share * self.whole()
    }

    /// How much of it `study` has used, in words.
    pub fn used_text(self, study: &Study) -> String {
        match self {
            Self::Time(_) => seconds(study.spent()),
            Self::Runs(_) => study.runs.len().to_string(),
        }
    }

    /// The option with which the scene gets two finer runs, so that something is known of its error.
    pub fn of_reference(self, study: &Study) -> Option<String> {
        let finer = |rungs| study.space.refined(&Point::new(), rungs);
        let missing = [1, 2].map(finer).into_iter().filter(|point| study.outcome(point).is_none());
        match self {
            Self::Time(_) => {
                let needed: f64 = missing.map(|point| study.estimate(&point)).sum::<Option<f64>>()?;
                Some(format!("--budget {:.0}m", ((study.spent() + needed) / REFERENCE / 60.0).ceil()))
            }
            Self::Runs(_) => {
                let runs = study.runs.len() + missing.count();
                Some(format!("--runs {:.0}", (runs as f64 / REFERENCE).ceil()))
            }
        }
    }
}

impl fmt::Display for Budget {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Self::Time(time) => f.write_str(&seconds(*time)),
            Self::Runs(runs) => write!(f, "{runs} runs"),
        }
    }
}

/// A run to make.
#[derive(Debug, Clone, PartialEq)]
pub struct Task {
    /// Its settings.
    pub point: Point,
    /// Why.
    pub purpose: Purpose,
    /// It is ended after this time [s].
    pub limit: f64,
}

/// The run that comes next within `budget`; `None`: nothing is left to do, or nothing that fits.
pub fn next(study: &Study, budget: Budget) -> Option<Task> {
    let planner = Planner { study, budget };
    if study.runs.is_empty() {
        return Some(Task {
            point: Point::new(),
            purpose: Purpose::Explore,
            limit: budget.limit(budget.whole()),
        });
    }
    planner
        .reference()
        .or_else(|| planner.ladders())
        .or_else(|| planner.models())
        .or_else(|| planner.combined())
        .or_else(|| planner.repeats())
        .or_else(|| planner.confirmations())
}

/// The same for the reference alone.
pub fn next_of_reference(study: &Study, budget: Budget) -> Option<Task> {
    if study.runs.is_empty() { next(study, budget) } else { Planner { study, budget }.reference() }
}

struct Planner<'a> {
    study: &'a Study,
    budget: Budget,
}

impl Planner<'_> {
    /// A run of `point`, if it fits into this share of the budget.
    fn task(&self, point: &Point, purpose: Purpose, share: f64) -> Option<Task> {
        let estimate = self.study.estimate(point)?;
        if !self.budget.holds(self.study, estimate, share) {
            return None;
        }
        let left = self.budget.whole() - self.study.spent();
        let most = if share == REFERENCE { left } else { (ONE_RUN * self.budget.whole()).max(estimate) };
        let limit = self.budget.limit((PATIENCE.0 * estimate).min(most.min(left)) + PATIENCE.1);
        Some(Task { point: point.clone(), purpose, limit })
    }

    /// The first run of a point that has none.
    fn explore(&self, point: &Point, share: f64) -> Option<Task> {
        self.study.space.key(point)?;
        if self.study.outcome(point).is_some() {
            return None;
        }
        self.task(point, Purpose::Explore, share)
    }

    fn reference(&self) -> Option<Task> {
        self.explore(&self.study.next_refinement()?, REFERENCE)
    }

    /// One knob at a time, all to the same depth before any goes deeper.
    fn ladders(&self) -> Option<Task> {
        let rescue = self.study.space.arms().iter().find_map(|arm| self.rescue(arm));
        rescue.or_else(|| {
            let anchors = self.anchors();
            (1..=COARSER).find_map(|depth| anchors.iter().find_map(|a| self.one_at_a_time(a, depth)))
        })
    }

    /// The cheapest first: it is the most likely to lead somewhere.
    fn anchors(&self) -> Vec<Point> {
        let arms = self.study.space.arms();
        let mut all: Vec<Point> = arms.iter().filter_map(|arm| anchor(self.study, arm)).collect();
        let cost = |point: &Point| self.study.cost(point).unwrap_or(f64::INFINITY);
        all.sort_by(|a, b| cost(a).total_cmp(&cost(b)));
        all
    }

    /// The first point of an arm, and shorter windows until one is good.
    fn rescue(&self, arm: &Point) -> Option<Task> {
        self.explore(arm, LADDERS).or_else(|| {
            // What is too slow as it is, is slower with shorter windows.
            let too_slow = |run: &Outcome| run.status == Status::Stopped;
            if anchor(self.study, arm).is_some() || self.study.outcome(arm).is_some_and(too_slow) {
                return None;
            }
            (1..=RESCUE).find_map(|rungs| self.explore(&with(arm, "window", -rungs), LADDERS))
        })
    }

    fn one_at_a_time(&self, anchor: &Point, depth: i32) -> Option<Task> {
        let space = &self.study.space;
        space.turned(anchor).filter(|knob| !knob.arm).find_map(|knob| {
            let own = rung(anchor, knob.name);
            let at = |away: i32| with(anchor, knob.name, own + away);
            // Up to the first that is not good; names are no ladder.
            let goes_on = !knob.is_ladder() || self.study.is_good(&at(depth - 1));
            let coarser = if goes_on { self.explore(&at(depth), LADDERS) } else { None };
            let finer = || {
                (depth <= FINER && self.is_worth(&at(1 - depth), &at(2 - depth), depth))
                    .then(|| self.explore(&at(-depth), LADDERS))?
            };
            coarser.or_else(finer)
        })
    }

    /// Whether the last finer rung has taken enough of the error away for another.
    fn is_worth(&self, last: &Point, before: &Point, depth: i32) -> bool {
        let error = |point| self.study.error_at(point);
        depth == 1
            || error(last).zip(error(before)).is_some_and(|(last, before)| last < (1.0 - WORTH) * before)
    }

    fn models(&self) -> Option<Task> {
        let space = &self.study.space;
        let knobs =
            || space.knobs().iter().filter(|knob| knob.turned && knob.class == Class::Model).map(|k| k.name);
        // A finer net swings faster: its steps and windows are as much shorter.
        let finer =
            |name: &str, depth| if name == NET { space.refined(&Point::new(), depth) } else { Point::new() };
        let both = |name, depth| [with(&finer(name, depth), name, -depth), Point::from([(name, depth)])];
        let mut points = (1..=MODELS).flat_map(|depth| knobs().flat_map(move |name| both(name, depth)));
        points.find_map(|point| self.explore(&point, MODEL))
    }

    /// Beside what costs about as much as the best: coarser in one knob; beside the best itself also finer in another.
    fn combined(&self) -> Option<Task> {
        let trades = self.study.trades();
        ACCURACIES.into_iter().find_map(|accuracy| {
            let mut good: Vec<_> = trades.iter().filter(|(_, trade)| trade.error <= accuracy).collect();
            good.sort_by(|(_, a), (_, b)| a.cost.total_cmp(&b.cost));
            let (best, cheapest) = good.first()?;
            let close = good.iter().take_while(|(_, trade)| trade.cost <= CLOSE * cheapest.cost);
            let refuted = refuted(self.study, accuracy);
            let points =
                close.flat_map(|(point, _)| moved(self.study, point, 1)).chain(pairs(self.study, best));
            let mut open = points.filter(|point| is_open(self.study, &refuted, point));
            open.find_map(|point| self.explore(&point, COMBINATIONS))
        })
    }

    /// Those on the front, those that noise may hide behind it, and the scene in turn, the one with the fewest runs first.
    fn repeats(&self) -> Option<Task> {
        let scene = Point::new();
        let runs = |point: &&Point| self.study.timed(point).len();
        let mut few = near_front(&self.study.trades(), NOISE);
        few.push(&scene);
        few.retain(|point| (1..RUNS).contains(&runs(point)));
        few.sort_by_key(runs);
        few.into_iter().find_map(|point| self.task(point, Purpose::Repeat, REPEATS))
    }

    fn confirmations(&self) -> Option<Task> {
        let points = self.study.recommended().into_iter().filter_map(|recommended| recommended.point);
        let mut unconfirmed = points.filter(|point| self.study.confirmation(point).is_none());
        unconfirmed.find_map(|point| self.task(&point, Purpose::Confirm, 1.0))
    }
}

/// Where the knobs of an arm are turned from: its own point, or the longest shorter window that is good.
fn anchor(study: &Study, arm: &Point) -> Option<Point> {
    (0..=RESCUE).map(|rungs| with(arm, "window", -rungs)).find(|point| study.is_good(point))
}

/// `point` with one ladder moved.
fn moved(study: &Study, point: &Point, by: i32) -> Vec<Point> {
    let ladders = study.space.turned(point).filter(|knob| knob.is_ladder());
    ladders.map(|knob| with(point, knob.name, rung(point, knob.name) + by)).collect()
}

/// What is coarser in one knob and finer in another: longer windows have more parts.
fn pairs(study: &Study, point: &Point) -> Vec<Point> {
    let coarser = moved(study, point, 1);
    coarser.iter().flat_map(|coarser| moved(study, coarser, -1)).filter(|other| other != point).collect()
}

/// Points that do not keep `accuracy`.
fn refuted(study: &Study, accuracy: f64) -> Vec<Point> {
    let fails = |run: &&super::study::Finished| {
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
