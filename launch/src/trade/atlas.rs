//! `--atlas`: each knob pushed until the scene breaks, and the limit that theory gives beside the one found.
//!
//! A knob is doubled until a run breaks, and the two last values are narrowed down to a factor of 1.1. Where the scene itself
//! breaks, the knob is halved until a run holds. Bounds that only say what theory says are off for these runs. Like the plan of a
//! study, a search is a function of the finished runs: it ends with what was found, or with the run that it needs next.

use super::budget::{Budget, NextRun};
use super::knobs::{Class, Knob, PRESET, Point, Space, with};
use super::report;
use super::result::{Purpose, RunOutcome, Status, deviation};
use super::study::Study;
use crate::check::prepared::Prepared;
use crate::run::children::Events;
use toolkit::arguments::Input;
use toolkit::columns::Columns;
use toolkit::numbers::{percent, rounded, three};

/// A measure that is off by more is broken.
const OFF: f64 = 0.1;
/// To this factor the limit is narrowed down.
pub const NARROW: f64 = 1.1;
/// Share of the longest window that holds with which other knobs are pushed.
const SAFE: f64 = 0.8;
/// Most doublings.
const DOUBLINGS: i32 = 14;
/// A run may take so many times the longest one of the scene as it is, and these seconds besides.
const PATIENCE: (f64, f64) = (10.0, 15.0);

/// What lets a run go beyond the limits that theory gives, by the knob that a scene has if these keys mean anything in it.
const BEYOND: [(&str, &str); 3] = [
    ("window", "limits.weak_window=1e9"),
    ("dem_step", "dem.allow_unstable=true"),
    ("fem_step", "fem.allow_unstable=true"),
];

/// One push: a knob, from a point, in one direction.
#[derive(Debug, Clone)]
pub struct Push {
    /// Where the others stand, and stay.
    pub from: Point,
    /// The knob.
    pub knob: Knob,
    /// Whether it is made coarser (or finer, as a stiffer contact is).
    pub coarser: bool,
}

/// What came of a push.
#[derive(Debug, Clone)]
pub struct StabilityLimit {
    /// What was pushed.
    pub push: Push,
    /// The last value that holds.
    pub holds: Option<f64>,
    /// The first value that breaks, with its symptom.
    pub breaks: Option<(f64, String)>,
    /// The limit that `rockfall check` gives for it.
    pub theory: Option<f64>,
    /// Why there is no more.
    pub note: Option<String>,
}

/// All pushes of a scene.
fn pushes(space: &Space) -> Vec<Push> {
    let mut all = Vec::new();
    for arm in space.arms().into_iter().filter(|arm| !arm.contains_key(PRESET)) {
        let turned = space.knobs().iter().filter(|knob| knob.turned && space.uses(&arm, knob));
        for knob in turned.filter(|knob| knob.rung_of(1.0).is_some()) {
            // Steps with every scheme, as some bear longer windows than others.
            let step = knob.is_step() && !arm.contains_key("integrator");
            let coupled = arm.is_empty() || knob.name == "window" || knob.needs.is_some() || step;
            let push = |coarser| Push { from: arm.clone(), knob: knob.clone(), coarser };
            match knob.class {
                Class::Numerical if coupled => all.push(push(true)),
                Class::Model if arm.is_empty() => all.extend([push(false), push(true)]),
                _ => {}
            }
        }
    }
    all
}

/// How a value fared.
enum Fared {
    Held,
    Broke(String),
    /// It was not run: why.
    Not(String),
}

/// The searches of a study within its budget.
pub struct Atlas<'a> {
    /// The study with its reference.
    pub study: &'a Study,
    /// What it may cost.
    pub budget: Budget,
}

impl Atlas<'_> {
    /// The run that the first search needs which has not ended; `None`: all have.
    pub fn next(&self) -> Option<NextRun> {
        self.all().1
    }

    /// What the searches have found that have ended, and the run that the next one needs.
    pub fn all(&self) -> (Vec<StabilityLimit>, Option<NextRun>) {
        let mut all = Vec::new();
        if !self.study.reference.0.is_empty() {
            for push in pushes(&self.study.space) {
                match self.search(&push, &all) {
                    Ok(found) => all.push(found),
                    Err(task) => return (all, Some(task)),
                }
            }
        }
        (all, None)
    }

    /// Push one knob, in the scene's own windows. Where these do not hold, in windows that do, and a step that they let be no longer
    /// in longer ones. `before` has what was found of the windows of this arm.
    fn search(&self, push: &Push, before: &[StabilityLimit]) -> Result<StabilityLimit, NextRun> {
        let window = self.study.space.knob("window").filter(|knob| knob.name != push.knob.name);
        let of_arm =
            |found: &&StabilityLimit| found.push.knob.name == "window" && found.push.from == push.from;
        let longest = before.iter().find(of_arm).and_then(|found| found.holds);
        let safe = window
            .zip(longest)
            .and_then(|(window, longest)| window.rung_of(rounded(SAFE * longest, 4)))
            .unwrap_or(0.0);
        let within = |rungs| Push { from: with(&push.from, "window", rungs), ..push.clone() };
        let found = self.search_in(&within(safe.min(0.0)))?;
        if safe > 0.0 && push.knob.is_step() && found.holds.is_some() && found.breaks.is_none() {
            return self.search_in(&within(safe));
        }
        Ok(found)
    }

    fn search_in(&self, push: &Push) -> Result<StabilityLimit, NextRun> {
        let space = &self.study.space;
        // Four digits of what a person copies; all of a step, so that it is a part of a window.
        let at = |value: f64| {
            let value = if push.knob.is_step() { value } else { rounded(value, 4) };
            with(&push.from, push.knob.name, push.knob.rung_of(value).unwrap_or(0.0))
        };
        let used = |point: &Point| space.used(point, &push.knob);
        let same = |a: &Point, b: &Point| space.key(a) == space.key(b);
        let mut found =
            StabilityLimit { push: push.clone(), holds: None, breaks: None, theory: None, note: None };
        let own = push.knob.as_number(0.0).unwrap_or(f64::NAN);
        // A longer window is coarser, a stiffer contact finer.
        let larger_is_coarser = push.knob.rung_of(2.0 * own).is_some_and(|rung| rung > 0.0);
        let step = if push.coarser == larger_is_coarser { 2.0_f64 } else { 0.5 };
        let mut power = 0;
        loop {
            let point = at(own * step.powi(power));
            if found.holds.is_some_and(|holds| same(&point, &at(holds))) {
                found.note = Some("a step is never longer than a part of a window".into());
                break;
            }
            match self.fare(&point, push)? {
                Fared::Held => {
                    found.holds = used(&point);
                    power += 1;
                }
                Fared::Broke(symptom) => {
                    found.breaks = used(&point).map(|value| (value, symptom));
                    power -= 1;
                }
                Fared::Not(why) => {
                    found.note = Some(why);
                    break;
                }
            }
            if found.holds.is_some() && found.breaks.is_some() {
                break;
            }
            if found.breaks.is_some() && push.knob.name != "window" {
                found.note = Some("the scene's own value already fails".into());
                break;
            }
            if power.abs() > DOUBLINGS {
                let factor = three(step.powi(power - power.signum()));
                found.note = Some(format!("nothing changed up to {factor} times the scene's value"));
                break;
            }
        }
        while let (Some(holds), Some((breaks, _))) = (found.holds, &found.breaks)
            && (breaks / holds).max(holds / breaks) > NARROW
        {
            let middle = at((holds * breaks).sqrt());
            if [holds, *breaks].iter().any(|end| same(&middle, &at(*end))) {
                found.note = Some("no step between these divides a part of a window".into());
                break;
            }
            match self.fare(&middle, push)? {
                Fared::Held => found.holds = used(&middle),
                Fared::Broke(symptom) => found.breaks = used(&middle).map(|value| (value, symptom)),
                Fared::Not(why) => {
                    found.note = Some(why);
                    break;
                }
            }
        }
        Ok(found)
    }

    /// How the scene fared at a point. An error: it has not been run there.
    fn fare(&self, point: &Point, push: &Push) -> Result<Fared, NextRun> {
        let space = &self.study.space;
        if let Some(outcome) = self.study.pushed(point) {
            return Ok(self.judge(outcome, push.knob.class));
        }
        let slowest = self.study.outcome(&Point::new()).map_or(0.0, |run| run.seconds);
        match () {
            () if space.key(point).is_none() => Ok(Fared::Not("there is no such value".into())),
            () if !self.budget.holds(self.study, slowest, 1.0) => {
                Ok(Fared::Not("search ended: the budget is used up".into()))
            }
            () => {
                let dearer = space.dearer(&Point::new(), &space.arm_of(point));
                let limit = self.budget.limit(PATIENCE.0 * slowest * dearer + PATIENCE.1);
                Err(NextRun { point: point.clone(), purpose: Purpose::Atlas, limit })
            }
        }
    }

    /// Whether a run holds. Another model has other measures: its status alone counts.
    fn judge(&self, outcome: &RunOutcome, class: Class) -> Fared {
        // A value that no run may have breaks nothing.
        if matches!(outcome.status, Status::Stopped | Status::Refused) {
            return Fared::Not(format!("search ended: {}", outcome.message()));
        }
        if outcome.status != Status::Done {
            return Fared::Broke(report::why(outcome));
        }
        for (name, known) in &self.study.reference.0 {
            let Some(value) = outcome.measure(name) else {
                return Fared::Broke(format!("{name} is absent: the window is too long to resolve it"));
            };
            let off = deviation(value, known.value);
            if off.abs() > OFF && class == Class::Numerical {
                return Fared::Broke(format!("{name} is off by {}", percent(off)));
            }
        }
        Fared::Held
    }
}

/// The `--set`s of a run that may go beyond what theory allows: nothing but the knob moves in a push.
pub fn sets(space: &Space, point: &Point) -> Option<Vec<String>> {
    let beyond = BEYOND.iter().filter(|(knob, _)| space.knob(knob).is_some());
    space.with_sets(point, beyond.map(|(_, set)| (*set).to_owned()).collect())
}

/// The limit that `rockfall check` gives for a push.
pub fn theory(push: &Push, space: &Space, input: &Input, events: &Events) -> Option<f64> {
    let mut input = input.clone();
    input.sets.extend(space.with_sets(&space.arm_of(&push.from), Vec::new())?);
    let of = Prepared::of(&input, |_| None, events).ok()?.numbers;
    match push.knob.name {
        "window" if of.weak => {
            of.limit.map(|limit| limit.stable.unwrap_or(f64::INFINITY)).filter(|w| w.is_finite())
        }
        // It is of a landing on something rigid: a light node of a net in contact with the rock swings faster.
        "dem_step" if of.net.critical.is_none() => of.contact.critical.filter(|step| step.is_finite()),
        "fem_step" => of.net.loaded.or(of.net.critical).filter(|step| step.is_finite()),
        _ => None,
    }
}

/// What to do about a limit.
fn cure(found: &StabilityLimit) -> &'static str {
    match (found.push.knob.name, found.push.coarser) {
        ("window", _) => "shorten `coupling.time_window` or leave it out, or couple strongly",
        ("tolerance", _) => "lower `coupling.tolerance` and `coupling.absolute_tolerance`",
        ("fem_step", _) => {
            "keep `fem.time_step` below the critical step, or use an implicit `fem.integrator`"
        }
        ("dem_step" | "steps_per_contact", _) => "shorten `dem.time_step`, or leave it out",
        ("modulus", false) => {
            "shorten window and steps in proportion to the root of the modulus, or couple strongly"
        }
        ("modulus", true) => "use a stiffer contact: the overlap must stay below half a radius",
        _ => "keep the scene's own value",
    }
}

/// The table, as a page.
pub fn page(study: &Study, all: &[StabilityLimit], facts: &report::Facts) -> String {
    let report::Facts { scene, command, .. } = facts;
    let (version, off) = (env!("CARGO_PKG_VERSION"), percent(OFF));
    let text = format!(
        "# Limits of stability: {scene}\n\n`rockfall trade {command} --atlas`, version {version}. One setting at a time was pushed until \
         a run was not done or a measure was off by more than {off}, and the limit was narrowed down to a factor of {NARROW}. Theory: the \
         limit of stability that `rockfall check` computes.\n\n"
    );
    let table = columns(study)
        .number("theory over what holds", |found| {
            let holds = found.holds.filter(|_| found.breaks.is_some());
            found.theory.zip(holds).map(|(due, holds)| due / holds)
        })
        .text("symptom", symptom)
        .text("cure", |found| if found.breaks.is_some() { cure(found) } else { "-" }.into());
    text + &table.markdown(all)
}

/// The limits, for the screen.
pub fn screen(study: &Study, all: &[StabilityLimit]) -> String {
    columns(study).text("symptom", symptom).aligned(all)
}

/// The table, for programs.
pub fn table(study: &Study, all: &[StabilityLimit]) -> Result<String, csv::Error> {
    columns(study).text("symptom", symptom).text("cure", |found| cure(found).into()).csv(all)
}

/// What is said of a limit everywhere.
fn columns(study: &Study) -> Columns<'_, StabilityLimit> {
    Columns::new()
        .text("setting", name)
        .text("others", |found: &StabilityLimit| study.space.label(&found.push.from))
        .number("scene", |found| found.push.knob.as_number(0.0))
        .number("theory", |found| found.theory)
        .number("holds at", |found| found.holds)
        .number("breaks at", |found| found.breaks.as_ref().map(|(value, _)| *value))
}

fn name(found: &StabilityLimit) -> String {
    let direction = match (found.push.knob.class, found.push.coarser) {
        (Class::Numerical, _) => "",
        (Class::Model, true) => ", lower",
        (Class::Model, false) => ", higher",
    };
    format!("{}{direction}", found.push.knob.name)
}

fn symptom(found: &StabilityLimit) -> String {
    let words = found.breaks.iter().map(|(_, symptom)| symptom.clone()).chain(found.note.clone());
    words.collect::<Vec<_>>().join("; ")
}
