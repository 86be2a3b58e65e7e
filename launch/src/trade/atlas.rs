//! `--atlas`: each knob pushed until the scene breaks, and the limit that theory gives beside the one found.
//!
//! A knob is doubled until a run breaks, and the two last values are narrowed down to a factor of 1.1. Where the scene itself
//! breaks, the knob is halved until a run holds. Bounds that only say what theory says are off for these runs.

use super::knobs::{Class, Knob, PRESET, Point, Space};
use super::result::{Outcome, Purpose, Status};
use super::study::{Finished, Study};
use super::{Work, report};
use crate::children::Events;
use crate::prepared::Prepared;
use crate::stability::divided;
use crate::stop::Stop;
use toolkit::arguments::Input;
use toolkit::columns::Columns;
use toolkit::numbers::{exact, percent, three};

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

/// One push: a knob, from a point, in one direction.
#[derive(Debug, Clone)]
pub struct Push {
    /// Where the others stand.
    pub arm: Point,
    /// The knob.
    pub knob: Knob,
    /// Whether it is made coarser (or finer, as a stiffer contact is).
    pub coarser: bool,
    /// Length of the windows [s], where it is not the scene's own: it stays while the knob moves.
    pub window: Option<f64>,
}

/// What came of a push.
#[derive(Debug, Clone)]
pub struct Found {
    /// What was pushed.
    pub push: Push,
    /// The scene's own value.
    pub own: f64,
    /// The last value that holds, and the first that breaks, with its symptom.
    pub holds: Option<f64>,
    /// The first value that breaks.
    pub breaks: Option<(f64, String)>,
    /// The limit that `rockfall check` gives for it.
    pub theory: Option<f64>,
    /// Why there is no more.
    pub note: Option<String>,
}

/// All pushes of a scene.
pub fn pushes(space: &Space) -> Vec<Push> {
    let mut all = Vec::new();
    for arm in space.arms().into_iter().filter(|arm| !arm.contains_key(PRESET)) {
        let turned = space.knobs().iter().filter(|knob| knob.turned && space.uses(&arm, knob));
        for knob in turned.filter(|knob| knob.number_at(1.0).is_some()) {
            // Steps with every scheme, as some bear longer windows than others.
            let step = is_step(knob) && !arm.contains_key("integrator");
            let coupled = arm.is_empty() || knob.name == "window" || knob.needs.is_some() || step;
            let push = |coarser| Push { arm: arm.clone(), knob: knob.clone(), coarser, window: None };
            match knob.class {
                Class::Numerical if coupled => all.push(push(true)),
                Class::Model if arm.is_empty() => all.extend([push(false), push(true)]),
                _ => {}
            }
        }
    }
    all
}

/// Whether it is a step of a solver, which is cut to a whole part of a window.
fn is_step(knob: &Knob) -> bool {
    knob.name.ends_with("_step")
}

/// What is needed to push.
pub struct Atlas<'a, 'w> {
    /// The study with its reference.
    pub study: &'a mut Study,
    /// What computes and keeps.
    pub work: &'a mut Work<'w>,
    /// The longest window that was found to hold [s], by arm.
    pub longest_windows: Vec<(Point, f64)>,
}

/// How a value fared.
enum Fared {
    Held,
    Broke(String),
    /// It was not run: why.
    Not(String),
}

impl Atlas<'_, '_> {
    /// Push one knob, in the scene's own windows. Where these do not hold, in windows that do, and a step that they let be no longer
    /// in longer ones.
    pub fn push(&mut self, push: &Push) -> Result<Found, Stop> {
        let own = self.study.space.knob("window").and_then(|knob| knob.as_number(0));
        let others = own.zip(self.longest_window(push)).filter(|_| push.knob.name != "window");
        let other = others.map(|(own, longest)| (own, SAFE * longest));
        let shorter = other.filter(|(own, safe)| safe < own).map(|(_, safe)| safe);
        let found = self.push_in(&Push { window: shorter, ..push.clone() })?;
        let longer = other.filter(|(own, safe)| safe > own).map(|(_, safe)| safe);
        match longer.filter(|_| is_step(&push.knob) && found.holds.is_some() && found.breaks.is_none()) {
            Some(_) => self.push_in(&Push { window: longer, ..push.clone() }),
            None => Ok(found),
        }
    }

    fn push_in(&mut self, push: &Push) -> Result<Found, Stop> {
        let own = push.knob.number_at(1.0).unwrap_or(f64::NAN);
        let mut note = None;
        let step = if push.coarser { 2.0_f64 } else { 0.5 };
        let (mut good, mut bad) = (None, None);
        let mut factor = 1.0_f64;
        for doubling in 0..=DOUBLINGS {
            let cut = self.cut(push, factor);
            if good == Some(cut) {
                note = Some(LONGEST_STEP.into());
                break;
            }
            factor = cut;
            match self.fare(push, factor)? {
                Fared::Held => {
                    good = Some(factor);
                    if bad.is_some() {
                        break;
                    }
                    factor *= step;
                }
                Fared::Broke(symptom) => {
                    bad = Some((factor, symptom));
                    if good.is_some() {
                        break;
                    }
                    if push.knob.name != "window" {
                        note = Some("the scene's own value already fails".into());
                        break;
                    }
                    factor /= step;
                }
                Fared::Not(why) => {
                    note = Some(why);
                    break;
                }
            }
            if doubling == DOUBLINGS {
                note = Some(format!("nothing changed up to {} times the scene's value", three(factor)));
            }
        }
        while let (Some(holds), Some((breaks, _))) = (good, &bad)
            && (breaks / holds).max(holds / breaks) > NARROW
        {
            let middle = self.cut(push, (holds * breaks).sqrt());
            if [holds, *breaks].contains(&middle) {
                note = Some("no step between these divides a part of a window".into());
                break;
            }
            match self.fare(push, middle)? {
                Fared::Held => good = Some(middle),
                Fared::Broke(symptom) => bad = Some((middle, symptom)),
                Fared::Not(why) => {
                    note = Some(why);
                    break;
                }
            }
        }
        let value = |factor| push.knob.number_at(factor);
        let holds = good.and_then(value);
        let breaks = bad.and_then(|(factor, symptom)| Some((value(factor)?, symptom)));
        if push.knob.name == "window" {
            self.longest_windows.extend(holds.map(|longest| (push.arm.clone(), longest)));
        }
        Ok(Found { push: push.clone(), own, holds, breaks, theory: None, note })
    }

    /// The longest window that holds where the others stand so [s].
    fn longest_window(&self, push: &Push) -> Option<f64> {
        self.longest_windows.iter().find(|(arm, _)| *arm == push.arm).map(|(_, longest)| *longest)
    }

    /// The factor of the value that is computed with: a step divides a part of a window.
    fn cut(&self, push: &Push, factor: f64) -> f64 {
        let space = &self.study.space;
        let number = |name: &str| space.knob(name)?.as_number(0);
        let window = push.window.or_else(|| number("window")).filter(|_| is_step(&push.knob));
        let part = window.map(|window| window / number("samples").unwrap_or(1.0));
        match part.zip(push.knob.as_number(0)) {
            Some((part, own)) => divided(part, own * factor) / own,
            None => factor,
        }
    }

    /// Run the scene with the knob's value times `factor`.
    fn fare(&mut self, push: &Push, factor: f64) -> Result<Fared, Stop> {
        let Some(sets) = self.sets(push, factor) else {
            return Ok(Fared::Not("there is no such value".into()));
        };
        let key = format!("atlas {}", sets.join(" "));
        // What was too slow may have been so because the machine was busy.
        let counts = |run: &&Finished| run.key == key && run.outcome.status != Status::Stopped;
        let at = match self.study.runs.iter().position(|run| counts(&run)) {
            Some(at) => at,
            None => {
                let slowest = self.study.outcome(&Point::new()).map_or(0.0, |run| run.seconds);
                let limit =
                    PATIENCE.0 * slowest * self.study.space.dearer(&Point::new(), &push.arm) + PATIENCE.1;
                if !self.work.budget.holds(self.study, slowest, 1.0) {
                    return Ok(Fared::Not("search ended: the budget is used up".into()));
                }
                let value = push.knob.number_at(factor).map_or(String::new(), three);
                let label = format!("{} {value}", push.knob.name);
                let (purpose, outcome) = (Purpose::Atlas, Outcome::default());
                let run = Finished { point: Point::new(), key, purpose, sets, outcome };
                let limit = self.work.budget.limit(limit);
                self.work.make(self.study, run, limit, &label)?;
                let label = format!("{}, {label}", self.study.space.label(&push.arm));
                self.work.ended(self.study, &label);
                self.study.runs.len() - 1
            }
        };
        Ok(self.judge(&self.study.runs[at].outcome, push.knob.class))
    }

    /// Whether a run holds. Another model has other measures: its status alone counts.
    fn judge(&self, outcome: &Outcome, class: Class) -> Fared {
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
            let off = super::result::deviation(value, known.value);
            if off.abs() > OFF && class == Class::Numerical {
                return Fared::Broke(format!("{name} is off by {}", percent(off)));
            }
        }
        Fared::Held
    }

    /// The `--set`s: nothing but the knob moves in a push.
    fn sets(&self, push: &Push, factor: f64) -> Option<Vec<String>> {
        let space = &self.study.space;
        let mut sets = match (is_step(&push.knob), push.knob.as_number(0)) {
            // All its digits, so that it is a part of a window.
            (true, Some(own)) => vec![format!("{}={}", push.knob.keys()[0], exact(own * factor))],
            _ => push.knob.sets_at(factor)?,
        };
        sets.extend(push.window.map(|length| format!("{WINDOW}={}", exact(length))));
        sets.extend(
            BEYOND.iter().filter(|(knob, _)| space.knob(knob).is_some()).map(|(_, set)| (*set).to_owned()),
        );
        space.with_sets(&push.arm, sets)
    }
}

const WINDOW: &str = "coupling.time_window";
const LONGEST_STEP: &str = "a step is never longer than a part of a window";

/// What lets a run go beyond the limits that theory gives, by the knob that a scene has if these keys mean anything in it.
const BEYOND: [(&str, &str); 3] = [
    ("window", "limits.weak_window=1e9"),
    ("dem_step", "dem.allow_unstable=true"),
    ("fem_step", "fem.allow_unstable=true"),
];

/// The limit that `rockfall check` gives for a push.
pub fn theory(push: &Push, space: &Space, input: &Input, events: &Events) -> Option<f64> {
    let mut input = input.clone();
    input.sets.extend(space.with_sets(&push.arm, Vec::new())?);
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
fn cure(found: &Found) -> &'static str {
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
pub fn page(study: &Study, all: &[Found], facts: &report::Facts) -> String {
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
pub fn screen(study: &Study, all: &[Found]) -> String {
    columns(study).text("symptom", symptom).aligned(all)
}

/// The table, for programs.
pub fn table(study: &Study, all: &[Found]) -> Result<String, csv::Error> {
    columns(study).text("symptom", symptom).text("cure", |found| cure(found).into()).csv(all)
}

/// What is said of a limit everywhere.
fn columns(study: &Study) -> Columns<'_, Found> {
    Columns::new()
        .text("setting", name)
        .text("others", |found: &Found| {
            let window =
                found.push.window.map_or(String::new(), |length| format!(", window {}", three(length)));
            study.space.label(&found.push.arm) + &window
        })
        .number("scene", |found| Some(found.own))
        .number("theory", |found| found.theory)
        .number("holds at", |found| found.holds)
        .number("breaks at", |found| found.breaks.as_ref().map(|(value, _)| *value))
}

fn name(found: &Found) -> String {
    let direction = match (found.push.knob.class, found.push.coarser) {
        (Class::Numerical, _) => "",
        (Class::Model, true) => ", lower",
        (Class::Model, false) => ", higher",
    };
    format!("{}{direction}", found.push.knob.name)
}

fn symptom(found: &Found) -> String {
    let words = found.breaks.iter().map(|(_, symptom)| symptom.clone()).chain(found.note.clone());
    words.collect::<Vec<_>>().join("; ")
}
