//! Which run comes next. A function of the finished runs and the budget alone, so that a study goes on where it was left.
//!
//! In this order, each up to its share of the budget: the scene and the reference; each arm of the scene, presets and the yielding net
//! before the others; one knob at a time, both ways, for each of them, the cheapest first; knobs of the model; combinations near the front; repeats of what is on the front, so that the
//! medians decide; each recommendation once more.
//!
//! Combinations are those that look cheaper than all known ones, from what each setting does alone: deviations are taken to add up
//! and costs to multiply. That is a guess, which a run then proves or refutes: what is coarser in everything than a point that was
//! refuted is not tried.

use super::knobs::{Class, NET, Point, rung, with};
use super::result::{Outcome, Purpose, Status};
use super::study::{ACCURACIES, Recommended, Study, near_front};

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

/// The run that comes next within `budget` [s]; `None`: nothing is left to do, or nothing that fits.
pub fn next(study: &Study, budget: f64) -> Option<Task> {
    let planner = Planner { study, budget };
    if study.runs.is_empty() {
        return Some(Task { point: Point::new(), purpose: Purpose::Explore, limit: budget });
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
pub fn next_of_reference(study: &Study, budget: f64) -> Option<Task> {
    if study.runs.is_empty() { next(study, budget) } else { Planner { study, budget }.reference() }
}

/// With which budget [s] the scene gets two finer runs, so that something is known of its error.
pub fn budget_of_reference(study: &Study) -> Option<f64> {
    let finer = |rungs| study.space.refined(&Point::new(), rungs);
    let missing = [1, 2].map(finer).into_iter().filter(|point| study.outcome(point).is_none());
    let needed: f64 = missing.map(|point| study.estimate(&point)).sum::<Option<f64>>()?;
    Some((study.spent() + needed) / REFERENCE)
}

struct Planner<'a> {
    study: &'a Study,
    budget: f64,
}

impl Planner<'_> {
    /// A run of `point`, if it fits into this share of the budget.
    fn task(&self, point: &Point, purpose: Purpose, share: f64) -> Option<Task> {
        let left = self.budget - self.study.spent();
        let estimate = self.study.estimate(point)?;
        if self.study.spent() + estimate > share * self.budget {
            return None;
        }
        let most = if share == REFERENCE { left } else { (ONE_RUN * self.budget).max(estimate) };
        let limit = (PATIENCE.0 * estimate).min(most.min(left)) + PATIENCE.1;
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

    fn combined(&self) -> Option<Task> {
        let anchors = self.anchors();
        let guessed = |accuracy: f64| {
            let each = anchors.iter().filter_map(|anchor| combinations(self.study, anchor, accuracy));
            let mut all: Vec<_> = each.collect();
            all.sort_by(|a, b| a.cost.total_cmp(&b.cost));
            all.into_iter().find_map(|found| self.explore(&found.point, COMBINATIONS))
        };
        ACCURACIES.into_iter().find_map(guessed).or_else(|| {
            let near = self.study.recommended().into_iter().flat_map(|best| neighbours(self.study, &best));
            near.into_iter().find_map(|point| self.explore(&point, COMBINATIONS))
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

/// Share of an accuracy that a guess may take.
const SAFETY: f64 = 0.8;
/// What a guess must save, as a share of the cheapest known cost.
const SAVING: f64 = 0.95;
/// Share of the deviations that is counted even where they cancel.
const CANCEL: f64 = 0.5;

/// A combination, and what is expected of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Guess {
    /// Its settings.
    pub point: Point,
    /// Expected cost [s].
    pub cost: f64,
}

/// One setting of one knob, beside the anchor.
struct Level {
    rung: i32,
    /// Change of each measure, relative to the reference.
    changes: Vec<f64>,
    /// Cost over that of the anchor.
    cost: f64,
}

/// The cheapest combination around `anchor` that may keep `accuracy` and beat all known points that do.
pub fn combinations(study: &Study, anchor: &Point, accuracy: f64) -> Option<Guess> {
    let own = study.reference.deviations(study.outcome(anchor)?)?;
    let cost = study.cost(anchor)?;
    let known = study.trades().into_iter().filter(|(_, trade)| trade.error <= accuracy);
    let bound = known.map(|(_, trade)| trade.cost).fold(f64::INFINITY, f64::min);
    let knobs: Vec<(&'static str, Vec<Level>)> = levels(study, anchor, cost);
    let search = Search {
        study,
        knobs,
        bound: SAVING * bound,
        accuracy: SAFETY * (accuracy - study.reference.uncertainty().unwrap_or(0.0)),
        refuted: refuted(study, accuracy),
    };
    let mut best = None;
    let worst = own.iter().map(|d| d.abs()).collect();
    search.walk(0, &Partial { point: anchor.clone(), signed: own, worst, cost }, &mut best);
    best
}

/// What is one rung coarser than a recommended point in one knob, or besides finer in another, and was not refuted: steps may be
/// longer in longer windows, and longer windows have more parts.
pub fn neighbours(study: &Study, best: &Recommended) -> Vec<Point> {
    let Some(point) = &best.point else { return Vec::new() };
    let space = &study.space;
    let refuted = refuted(study, best.accuracy);
    let ladders: Vec<_> = space.turned(point).filter(|knob| knob.is_ladder()).map(|knob| knob.name).collect();
    let moved = |point: &Point, name, by| with(point, name, rung(point, name) + by);
    let coarser: Vec<Point> = ladders.iter().map(|name| moved(point, name, 1)).collect();
    let finer = coarser.iter().flat_map(|point| ladders.iter().map(|name| moved(point, name, -1)));
    let pairs: Vec<Point> = finer.filter(|other| other != point).collect();
    coarser.into_iter().chain(pairs).filter(|point| is_open(study, &refuted, point)).collect()
}

/// What each setting of each knob did alone; the anchor's own comes first.
fn levels(study: &Study, anchor: &Point, cost: f64) -> Vec<(&'static str, Vec<Level>)> {
    let reference = &study.reference;
    let turned = study.space.turned(anchor).filter(|knob| !knob.arm);
    turned
        .map(|knob| {
            let own = rung(anchor, knob.name);
            let level = |away: i32| {
                let point = with(anchor, knob.name, own + away);
                let run = study.outcome(&point).filter(|_| study.is_good(&point))?;
                let there = study.outcome(anchor)?;
                let [run, there] = [run, there].map(|run| reference.deviations(run));
                let changes = run?.iter().zip(there?).map(|(a, b)| a - b).collect();
                // Times are noisy: what is finer is never expected to save, nor what is coarser to cost.
                let ratio = study.cost(&point)? / cost;
                let ratio = if away < 0 { ratio.max(1.0) } else { ratio.min(1.0) };
                Some(Level { rung: own + away, changes, cost: ratio })
            };
            (knob.name, std::iter::once(0).chain(1..=8).chain(-2..0).filter_map(level).collect())
        })
        .collect()
}

/// Points that do not keep `accuracy`.
fn refuted(study: &Study, accuracy: f64) -> Vec<Point> {
    let fails = |run: &&super::study::Finished| {
        run.outcome.status != Status::Done || study.bound(&run.outcome).is_none_or(|bound| bound > accuracy)
    };
    study.explored().filter(fails).map(|run| run.point.clone()).collect()
}

struct Search<'a> {
    study: &'a Study,
    knobs: Vec<(&'static str, Vec<Level>)>,
    bound: f64,
    accuracy: f64,
    refuted: Vec<Point>,
}

/// Settings chosen so far.
#[derive(Clone)]
struct Partial {
    point: Point,
    signed: Vec<f64>,
    worst: Vec<f64>,
    cost: f64,
}

impl Search<'_> {
    fn walk(&self, depth: usize, chosen: &Partial, best: &mut Option<Guess>) {
        let Some((name, levels)) = self.knobs.get(depth) else {
            let better = chosen.cost < best.as_ref().map_or(self.bound, |best| best.cost);
            let each = chosen.signed.iter().zip(&chosen.worst).map(|(s, w)| s.abs().max(CANCEL * w));
            let expected = each.fold(0.0, f64::max);
            if better && expected <= self.accuracy && is_open(self.study, &self.refuted, &chosen.point) {
                *best = Some(Guess { point: chosen.point.clone(), cost: chosen.cost });
            }
            return;
        };
        for level in levels {
            let mut next = Partial { point: with(&chosen.point, name, level.rung), ..chosen.clone() };
            next.cost *= level.cost;
            for ((signed, worst), change) in next.signed.iter_mut().zip(&mut next.worst).zip(&level.changes) {
                *signed += change;
                *worst += change.abs();
            }
            self.walk(depth + 1, &next, best);
        }
    }
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
