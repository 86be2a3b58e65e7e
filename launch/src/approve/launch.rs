//! The launches of a case: each run is kept, so that the same command goes on where it was left.
//!
//! A launch runs until the block has been stopped and swings. From there block and net are brought to rest with damping, which a kit
//! has of its own and a model has not: the residual height is that at its end, block still in the net. A run that is not to be trusted is made
//! again with finer windows and steps.

use super::layout::{Layout, table_at};
use super::measured::{Ended, Launch};
use super::site::{BLOCK, Test, Which};
use crate::front::stop::{Stop, unwritten, write};
use crate::run::children::Events;
use crate::run::progress::{Progress, far};
use crate::run::sweep::{self, Task};
use interface_defs::diagnostic::{Diagnostic, Place, code};
use interface_defs::verdict::Fate;
use std::path::PathBuf;
use toml::{Table, Value};
use toolkit::files::Dir;
use toolkit::input_file::hash;
use toolkit::numbers::seconds;
use toolkit::scene::number;
use toolkit::summary::{RunStatus, Summary};

/// Damping with which block and net come to rest [1/s], and for how long in one run [s]: at 1 000 kJ the residual height is within 2 % of
/// its value after 2.5 s from 1.5 s on, with 8 to 30 /s.
const TO_REST: (f64, f64) = (20.0, 1.5);
/// Most such runs: a block that is thrown back may be in flight in the first ones.
const ROUNDS: usize = 4;
/// At rest is what stays within this part of the posts' length.
const STILL: f64 = 0.02;
/// Stiffness of contacts there, in that of the launch.
const SOFTER: f64 = 0.1;
/// How far the block is taken back along its path where it may not start as it is [m].
const PARTED: [f64; 3] = [0.0, 1e-2, 5e-2];
/// The bound of `limits.deflection_error` there.
const OF_REST: f64 = 0.1;
/// The preset of a run that is made again.
const FINER: &str = "accurate";
/// The same of the net alone, which is lighter and swings more slowly.
const EMPTY: (f64, f64) = (8.0, 3.0);

/// Wall time over that of steps and exchanges alone, and settling runs of a launch, least and most. Both kits took 1.5 to 2.9 times as
/// long, with friction in ropes twice that.
const COSTS: [(f64, f64); 2] = [(1.5, 1.0), (3.0, ROUNDS as f64)];

/// Wall time that all runs of a case are expected to take, least and most [s]; `None`: nothing is known.
pub fn cost(test: &Test) -> Option<[f64; 2]> {
    let length = test.document.get("end_time").and_then(number)?;
    let (launches, settle) = if test.kit.sel.is_some() { (3.0, 2.0) } else { (1.0, 1.0) };
    let per_second = test.cost? / length;
    Some(
        COSTS.map(|(slower, rounds)| slower * per_second * (launches * length + settle * rounds * TO_REST.1)),
    )
}

/// What a rock's state is in a scene, and in the columns of a history.
const STATE: [(&str, &[&str]); 4] = [
    ("position", &["x_m", "y_m", "z_m"]),
    ("velocity", &["vx_m_per_s", "vy_m_per_s", "vz_m_per_s"]),
    ("orientation", &["orientation_w", "orientation_x", "orientation_y", "orientation_z"]),
    ("angular_velocity", &["wx_rad_per_s", "wy_rad_per_s", "wz_rad_per_s"]),
];

/// The runs of a case.
pub struct Runs<'a> {
    /// What is tested.
    pub test: &'a Test<'a>,
    /// Their directory.
    pub dir: PathBuf,
    /// What is said of them while they run.
    pub label: String,
    /// Signals.
    pub events: &'a Events,
    /// Who is told.
    pub progress: &'a Progress,
}

/// Where a second launch starts: directory of the run whose structure it takes over; whether that is at rest as it is, and no
/// equilibrium is looked for; the structure there; what the run is of.
type Second = (String, bool, Layout, String);

/// What a run is, in words, and whether block and net settle in it.
type What<'a> = (&'a str, bool);

impl Runs<'_> {
    /// Make a launch. The second one starts where the `first` has come to rest, block taken out.
    pub fn launch(&self, which: Which, first: Option<&Launch>) -> Result<Launch, Stop> {
        let test = self.test;
        let start = match first.map(|first| self.at_rest(first)).transpose()? {
            Some(Err(ended)) => return Ok(Launch::of(which, test, first, None, ended, None)),
            start => start.and_then(Result::ok),
        };
        let now = start.as_ref().map_or(&test.layout, |(_, _, now, _)| now);
        let mut scene = test.launch(which, now)?;
        let of = start.as_ref().map_or("", |(from, rests, _, of)| {
            take_over(&mut scene, from, "rest", *rests);
            of
        });
        let ended = self.run(&which.dir(), &scene, of, (which.name(), false))?;
        let mut rest: Option<Ended> = None;
        // Of SEL 2 no height is judged, but whether a block that was thrown back comes again.
        let needed = which != Which::Sel2 || ended.fate() == Some(Fate::Rebounded);
        let rounds = if needed && ended.is_caught() && ended.doubt().is_none() { ROUNDS } else { 0 };
        for round in 1..=rounds {
            let found = self.bring_to_rest(which, round, &scene, rest.as_ref().unwrap_or(&ended))?;
            let near = STILL * test.layout.number("height");
            let over = found.doubt().is_some() || found.has_left(test) || found.is_settled(near);
            rest = Some(found);
            if over {
                break;
            }
        }
        Ok(Launch::of(which, test, first, Some(now), ended, rest))
    }

    /// From the end of a run on with damping, block still in the net. `scene` is that of the launch.
    fn bring_to_rest(&self, which: Which, round: usize, scene: &Table, ended: &Ended) -> Result<Ended, Stop> {
        let mut scene = scene.clone();
        // The net without its velocities: it is to rest, and the block keeps its own.
        take_over(&mut scene, &ended.name, "rest", true);
        damp(&mut scene, TO_REST);
        // A block that is pressed into the net may start there with softer contacts, and forces are small from here on.
        for contact in scene.get_mut("contact").and_then(Value::as_array_mut).into_iter().flatten() {
            if let Some(stiffness) = contact.get_mut("stiffness") {
                *stiffness = number(stiffness).map_or(stiffness.clone(), |of| (SOFTER * of).into());
            }
        }
        // Its deflections are small, and none is a result: what still swings is judged by itself.
        table_at(&mut scene, "limits").map(|limits| limits.insert("deflection_error".into(), OF_REST.into()));
        let (name, label) =
            (format!("{}_rest_{round}", which.dir()), format!("{}, settling phase", which.name()));
        let mut found = Ended::default();
        for back in PARTED {
            for (key, columns) in STATE {
                let rock = scene.get_mut("rock").and_then(|rocks| rocks.get_mut(0)?.as_table_mut());
                let value = |column: &&str| {
                    let off = if *column == "y_m" { back } else { 0.0 };
                    Value::from(ended.history.last(&format!("{BLOCK}_{column}")) - off)
                };
                let values: Vec<Value> = columns.iter().map(value).collect();
                rock.map(|rock| rock.insert(key.into(), values.into()));
            }
            found = self.run(&name, &scene, &ended.of, (&label, true))?;
            if !found.refused {
                break;
            }
        }
        Ok(found)
    }

    /// Where a launch starts after the `first`. An error within: it came to no rest, and how that ended.
    fn at_rest(&self, first: &Launch) -> Result<Result<Second, Ended>, Stop> {
        let [from, of] = first.last.clone();
        let layout = |from: &str, rests: bool| {
            let mut scene = self.test.document.clone();
            // It is written elsewhere.
            let dir = std::path::absolute(self.dir.join(from)).unwrap_or_default();
            take_over(&mut scene, &dir.display().to_string(), "rest", rests);
            Layout::of(&self.test.kit.written(&scene)?, self.events)
        };
        match layout(&from, false) {
            Ok(now) => return Ok(Ok((from, false, now, of))),
            Err(stop) if stop.errors.iter().all(|error| error.code == code::NOT_CONVERGED) => {}
            Err(stop) => return Err(stop),
        }
        // A net that is mostly slack may have no equilibrium that is found at once: it swings until it rests.
        let mut scene = self.test.document.clone();
        take_over(&mut scene, &from, "motion", false);
        damp(&mut scene, EMPTY);
        let from = format!("{}_empty", first.which.dir());
        let ended = self.run(&from, &scene, &of, ("SEL 1, block taken out", true))?;
        if ended.summary.status != RunStatus::Done {
            return Ok(Err(ended));
        }
        let now = layout(&from, true)?;
        Ok(Ok((from, true, now, ended.of)))
    }

    /// Make a run, again with finer windows and steps where it is not to be trusted.
    fn run(&self, name: &str, scene: &Table, before: &str, what: What) -> Result<Ended, Stop> {
        let ended = self.run_once(name, scene, before, what)?;
        let mut finer = scene.clone();
        let Some(coupling) = table_at(&mut finer, "coupling") else { return Ok(ended) };
        let chosen = ["preset", "scheme", "time_window"].iter().any(|key| coupling.contains_key(*key));
        if ended.summary.status != RunStatus::Unreliable || chosen || !scene.contains_key("rock") {
            return Ok(ended);
        }
        coupling.insert("preset".into(), FINER.into());
        let again = (&*format!("{}, {FINER}", what.0), what.1);
        let ended = self.run_once(&format!("{name}_{FINER}"), &finer, before, again)?;
        Ok(Ended { finer: true, ..ended })
    }

    /// Make a run, or take the one that is kept. `before` is what it starts from.
    fn run_once(&self, name: &str, scene: &Table, before: &str, what: What) -> Result<Ended, Stop> {
        let dir = self.dir.join(name);
        let file = dir.with_extension("toml");
        let text = scene.to_string();
        let of = hash(format!("{text}{before}").as_bytes());
        if let Some((there, ())) = sweep::kept::<()>(&dir)? {
            if there == of
                && let Ok(summary) = Summary::read(&dir)
            {
                return Ended::of(&dir, of, Some(summary), Vec::new());
            }
            let what = "this run is of another kit, or of another test";
            let cure = "begin anew with --force, or choose another directory with --out";
            let place = Place::file(dir.display());
            return Err(Diagnostic::error(code::RESULT_DIRECTORY, what).at(place).try_instead(cure).into());
        }
        Dir::create(&self.dir).map_err(unwritten(&self.dir))?;
        write(&file, &text)?;
        let task = Task { scene: &file, sets: Vec::new(), dir: &dir, shortcuts: true, limit: f64::INFINITY };
        let (label, progress) = (format!("{}, {}", self.label, what.0), self.progress);
        let mut say = |spent| progress.say(&format!("{label}: {}, after {spent} s", far(&dir)));
        let ran = task.run(self.events, &mut say)?;
        let ended = Ended::of(&dir, of, ran.summary, ran.errors)?;
        progress.say(&format!("{label}: {}, {}", ended.words(what.1), seconds(ran.seconds)));
        // A process that was lost says nothing of the kit: it is tried again.
        if !ended.refused && ended.summary.reasons.iter().all(|reason| reason.code != code::PROCESS) {
            sweep::keep(&dir, &ended.of, ())?;
        }
        Ok(ended)
    }
}

/// The scene starts from a run.
fn take_over(scene: &mut Table, run: &str, at: &str, rests: bool) {
    let from = [("run", run), ("at", at)].map(|(key, value)| (key.to_owned(), Value::from(value)));
    scene.insert("start_from".into(), Table::from_iter(from).into());
    if let Some(structure) = table_at(scene, "structure").filter(|_| rests) {
        structure.insert("form_finding".into(), "none".into());
    }
}

/// The scene has so much more damping, and ends at that time.
fn damp(scene: &mut Table, (damping, end): (f64, f64)) {
    if let Some(structure) = table_at(scene, "structure") {
        let own = structure.get("damping").and_then(number).unwrap_or(0.0);
        structure.insert("damping".into(), (own + damping).into());
    }
    scene.insert("end_time".into(), end.into());
}
