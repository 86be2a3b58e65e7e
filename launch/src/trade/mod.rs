//! `rockfall trade`: what accuracy costs, measured over the knobs of a scene.
//!
//! - [`knobs`]: which knobs there are, one line each; [`point`]: settings of them
//! - [`runner`]: one run as a program of its own; [`result`](mod@result): what it gave; [`store`]: the runs on disk
//! - [`study`]: what follows from them, with [`mod@reference`] and [`front`]; [`plan`] and [`combine`]: which run comes next
//! - [`atlas`]: `--atlas`, each knob pushed until the scene breaks
//! - [`measures`]: which measures count; [`report`] and [`plot`]: the answer

mod atlas;
mod combine;
mod front;
mod knobs;
mod measures;
mod plan;
mod plot;
mod point;
mod reference;
mod report;
mod result;
mod runner;
mod setup;
mod store;
mod study;
#[cfg(test)]
mod tests;

use crate::events::Events;
use crate::stop::Stop;
use crate::sweep;
use crate::verify;
use clap::Args;
use interface_defs::diagnostic::code;
use plan::Task;
use reference::Reference;
use report::{Facts, percent, seconds};
use result::{Outcome, Purpose, Record, Status};
use runner::{Programs, Runner};
use setup::Setup;
use std::cell::RefCell;
use std::path::PathBuf;
use store::Store;
use study::{Finished, Study};
use toolkit::arguments::Input;
use toolkit::exit::Exit;
use toolkit::screen::show;

/// Accuracies for which settings are recommended.
const ACCURACIES: [f64; 4] = [0.1, 0.03, 0.01, 0.001];
/// A setting with a larger error is not pushed further.
const WORST: f64 = 0.2;

/// What the command line asks for.
#[derive(Debug, Clone, Args)]
pub struct Arguments {
    /// The scene.
    #[command(flatten)]
    pub input: Input,
    /// Wall time of all runs together, as in 90s, 10m or 1h30m. A larger one later goes on
    #[arg(long, value_name = "TIME", default_value = "10m", value_parser = measures::duration)]
    pub budget: f64,
    /// Find the limits of stability instead: push each knob until the scene breaks, and write `atlas.md` and `atlas.csv`
    #[arg(long)]
    pub atlas: bool,
    /// Measure to compare, repeatable [default: the deflection and the largest reaction over 1 ms, or what the scene has
    /// in their place]
    #[arg(long = "measure", value_name = "NAME")]
    pub measures: Vec<String>,
    /// Value to compare a measure with, instead of the finest runs, repeatable
    #[arg(long = "reference", value_name = "NAME=VALUE", value_parser = measures::given)]
    pub references: Vec<(String, f64)>,
    /// Knob to turn, repeatable [default: all that the scene has]
    #[arg(long = "knob", value_name = "NAME")]
    pub knobs: Vec<String>,
    /// Directory of the study [default: out/NAME-trade for the scene NAME.toml]
    #[arg(long, value_name = "DIR", help_heading = "Results")]
    pub out: Option<PathBuf>,
    /// Remove the runs of another study that the directory holds, and begin anew
    #[arg(long, help_heading = "Results")]
    pub force: bool,
    /// Print nothing but the result and errors
    #[arg(long, help_heading = "Results")]
    pub quiet: bool,
}

/// The whole command.
pub fn trade(arguments: &Arguments, json: bool) -> Result<Exit, Stop> {
    let events = Events::watch()?;
    let setup = Setup::of(arguments, &events)?;
    let mut store = Store::open(&setup.out, &setup.identity, arguments.force)?;
    let runs = store.load(&setup.space)?;
    let mut study = Study {
        space: setup.space,
        measures: Vec::new(),
        given: arguments.references.iter().cloned().collect(),
        runs,
        reference: Reference::default(),
        keys: RefCell::default(),
        worst: WORST,
        accuracies: ACCURACIES.to_vec(),
    };
    let mut progress = Progress::new(arguments.quiet, json, arguments.budget);
    if !study.runs.is_empty() {
        progress.shown.say(&format!("{} runs are there already, and count", study.runs.len()));
    }
    let mut runner = Programs { input: &arguments.input, always: setup.always, events: &events };
    let mut work = Work { runner: &mut runner, store: &mut store, progress: &mut progress };
    let mut found = Vec::new();
    let ended = match arguments.atlas {
        false => explore(&mut study, &mut work, arguments, plan::next),
        true => explore(&mut study, &mut work, arguments, plan::next_of_reference)
            .and_then(|()| push_all(&mut study, &mut work, arguments, &events, &mut found)),
    };
    progress.shown.finish();
    let written = match arguments.atlas {
        false => write(&study, &store, &setup.facts),
        true => write_atlas(&study, &found, &store, &setup.facts),
    };
    match ended {
        Ok(()) => {
            show(&written?);
            verify::seal(&setup.out);
        }
        Err(stop) if stop.exit == Exit::BadInput => return Err(stop),
        Err(stop) => {
            let (runs, out) = (study.runs.len(), setup.out.display());
            return Err(stop.and(&format!("; {runs} runs are kept in {out}; the same command goes on")));
        }
    }
    match (study.reference.0.is_empty(), report::unknown(&study)) {
        (true, _) => Err(Stop::failed(code::FEW_SAMPLES, no_reference(&study))),
        (false, Some(why)) if !arguments.atlas => Err(Stop::failed(code::FEW_SAMPLES, why)),
        _ => Ok(Exit::Done),
    }
}

/// What computes, what keeps it, what shows it.
struct Work<'a> {
    runner: &'a mut dyn Runner,
    store: &'a mut Store,
    progress: &'a mut Progress,
}

/// All runs that the plan asks for.
fn explore(
    study: &mut Study,
    work: &mut Work,
    arguments: &Arguments,
    next: fn(&Study, f64) -> Option<Task>,
) -> Result<(), Stop> {
    measures::choose(study, &arguments.measures)?;
    study.refresh();
    while let Some(task) = next(study, arguments.budget) {
        let (Some(key), Some(sets)) = (study.space.key(&task.point), study.space.sets(&task.point)) else {
            break;
        };
        let label = study.space.label(&task.point);
        work.progress.begin(study, &label);
        let outcome = work.runner.run(&sets, &work.store.next(), task.limit)?;
        if study.runs.is_empty() && outcome.status == Status::Refused {
            return Err(Stop { exit: Exit::BadInput, errors: outcome.errors });
        }
        let run =
            Finished { point: task.point, record: Record { key, purpose: task.purpose, sets, outcome } };
        work.store.keep(&run)?;
        study.runs.push(run);
        measures::choose(study, &arguments.measures)?;
        study.refresh();
        work.progress.ended(study, &label);
    }
    Ok(())
}

/// Push every knob until the scene breaks.
fn push_all(
    study: &mut Study,
    work: &mut Work,
    arguments: &Arguments,
    events: &Events,
    found: &mut Vec<atlas::Found>,
) -> Result<(), Stop> {
    if study.reference.0.is_empty() {
        return Ok(());
    }
    let pushes = atlas::pushes(&study.space);
    let mut atlas = atlas::Atlas { study, work, budget: arguments.budget, longest_windows: Vec::new() };
    for push in &pushes {
        let mut one = atlas.push(push)?;
        one.theory = atlas::theory(push, &atlas.study.space, &arguments.input, events);
        found.push(one);
    }
    Ok(())
}

/// Page and table of the limits; what the screen shows.
fn write_atlas(study: &Study, found: &[atlas::Found], store: &Store, facts: &Facts) -> Result<String, Stop> {
    let page = atlas::page(study, found, facts);
    let path = store.write("atlas.md", &page)?;
    store.write("atlas.csv", &atlas::table(study, found).map_err(|e| unwritten("atlas.csv", &e))?)?;
    Ok(format!("{}all limits   {}\n", atlas::screen(study, found), path.display()))
}

/// Page, table and picture; what the screen shows.
fn write(study: &Study, store: &Store, facts: &Facts) -> Result<String, Stop> {
    let page = store.write("trade.md", &report::page(study, facts))?;
    store.write("trade.csv", &report::table(study, facts).map_err(|e| unwritten("trade.csv", &e))?)?;
    let picture = plot::draw(&picture(study, facts)).map_err(|e| unwritten("trade.svg", &e))?;
    if let Some(picture) = picture {
        store.write("trade.svg", &picture)?;
    }
    Ok(format!("{}all runs     {}\n", report::screen(study), page.display()))
}

fn unwritten(file: &str, why: &dyn std::fmt::Display) -> Stop {
    Stop::failed(code::NOT_WRITTEN, format!("{file} cannot be made: {why}"))
}

fn picture(study: &Study, facts: &Facts) -> plot::Picture {
    let arms = study.space.arms();
    let group = |run: &point::Point| {
        let same = |arm: &&point::Point| {
            study.space.knobs.iter().all(|k| !k.arm || point::rung(arm, k.name) == point::rung(run, k.name))
        };
        arms.iter().position(|arm| same(&arm)).unwrap_or(0)
    };
    let trades = study.trades();
    let trade = |at: &point::Point| trades.iter().find(|(p, _)| *p == at).map(|(_, trade)| *trade);
    plot::Picture {
        title: format!("{}: accuracy against cost", facts.scene),
        groups: arms.iter().map(|arm| study.space.label(arm)).collect(),
        marks: trades.iter().map(|(p, trade)| plot::Mark { trade: *trade, group: group(p) }).collect(),
        front: study.front().iter().filter_map(|p| Some((trade(p)?, study.space.label(p)))).collect(),
        accuracies: study.accuracies.clone(),
    }
}

fn no_reference(study: &Study) -> String {
    let last = study.runs.last().map_or(String::new(), |run| run.record.outcome.message());
    let tried = study.refinements().len();
    format!(
        "there is nothing to compare with: of {tried} runs, each twice as fine as the one before, the finest is not done; raise \
         --budget, or give the value with --reference NAME=VALUE. The last run: {last}"
    )
}

/// What is shown while runs are at work.
struct Progress {
    shown: sweep::Progress,
    budget: f64,
}

impl Progress {
    fn new(quiet: bool, json: bool, budget: f64) -> Self {
        Self { shown: sweep::Progress::new(quiet, json, true), budget }
    }

    fn begin(&self, study: &Study, label: &str) {
        let spent = seconds(study.spent());
        self.shown.begin(&format!("{spent} of {}: {label}", seconds(self.budget)));
    }

    fn ended(&self, study: &Study, label: &str) {
        let Some(run) = study.runs.last() else { return };
        let outcome: &Outcome = &run.record.outcome;
        let what = match (study.error(outcome), outcome.status) {
            // The first run has nothing to be compared with.
            (Some(error), _) if study.reference.uncertainty().is_some() => {
                format!("error {}", percent(error))
            }
            (Some(_), _) => "done".into(),
            (None, Status::Done) => "done".into(),
            (None, status) => {
                let why = Some(outcome.message()).filter(|message| !message.is_empty());
                let why = why.map_or(String::new(), |why| format!(": {}", report::shortened(&why)));
                format!("{}{why}", status.word())
            }
        };
        let purpose = match run.record.purpose {
            Purpose::Explore => "",
            Purpose::Repeat => " (again, for its time)",
            Purpose::Confirm => " (again, to confirm)",
            Purpose::Atlas => " (pushed)",
        };
        let number = study.runs.len();
        let spent = seconds(study.spent());
        self.shown
            .say(&format!("{number:>4}  {spent:>12}  {label}{purpose}: {what}, {}", seconds(outcome.wall)));
    }
}
