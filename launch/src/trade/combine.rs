//! Combinations of settings that look cheaper than all known ones, from what each does alone.
//!
//! Deviations are taken to add up and costs to multiply. That is a guess, which a run then proves or refutes: what is coarser
//! in everything than a point that was refuted is not tried.

use super::knobs::Class;
use super::point::{Point, rung, with};
use super::result::Status;
use super::study::{Recommended, Study};

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
    /// Expected wall time [s].
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
        accuracy: SAFETY * accuracy,
        refuted: refuted(study, accuracy),
    };
    let mut best = None;
    let worst = own.iter().map(|d| d.abs()).collect();
    search.walk(0, &Partial { point: anchor.clone(), signed: own, worst, cost }, &mut best);
    best
}

/// What is one rung coarser than a recommended point in one knob, and was not refuted: steps may be longer in longer windows.
pub fn neighbours(study: &Study, best: &Recommended) -> Vec<Point> {
    let Some(point) = &best.point else { return Vec::new() };
    let space = &study.space;
    let refuted = refuted(study, best.accuracy);
    (space.turned(point).filter(|knob| knob.names() == 0))
        .map(|knob| with(point, knob.name, rung(point, knob.name) + 1))
        .filter(|point| is_open(study, &refuted, point))
        .collect()
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
        run.outcome.status != Status::Done || study.error(&run.outcome).is_none_or(|error| error > accuracy)
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
        space.knobs.iter().all(|knob| {
            let (a, b) = (rung(point, knob.name), rung(failed, knob.name));
            if knob.names() > 0 || knob.class == Class::Model { a == b } else { a >= b }
        })
    };
    space.key(point).is_some() && study.outcome(point).is_none() && !refuted.iter().any(coarser)
}
