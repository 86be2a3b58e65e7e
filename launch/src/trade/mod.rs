//! `rockfall trade`: what accuracy costs, measured over the knobs of a scene.
//!
//! - [`knobs`]: which knobs there are, one line each, and settings of them
//! - [`result`](mod@result): what one run gave, and what it is compared with; [`store`]: the runs on disk
//! - [`study`]: what follows from them; [`plan`]: which run comes next
//! - [`atlas`]: `--atlas`, each knob pushed until the scene breaks
//! - [`report`]: the answer

mod atlas;
mod budget;
mod knobs;
mod plan;
mod report;
mod result;
mod store;
mod study;
#[cfg(test)]
mod tests;

use crate::check::choice::{PRESETS, Preset};
use crate::check::prepared::Prepared;
use crate::front::shell;
use crate::front::stop::Stop;
use crate::picture::scatter::{Scatter, draw};
use crate::run::children::Events;
use crate::run::progress::Progress;
use crate::run::record;
use crate::run::sweep;
use atlas::{Atlas, StabilityLimit};
use budget::{Budget, NextRun};
use clap::Args;
use interface_defs::diagnostic::code;
use knobs::{Base, Knob, Point, Space, Start};
use report::Facts;
use result::Reference;
use result::{Purpose, RunOutcome, Status};
use std::path::{Path, PathBuf};
use store::{Identity, Store};
use study::{Finished, Study};
use toml::{Table, Value};
use toolkit::arguments::Input;
use toolkit::exit::Exit;
use toolkit::numbers::{exact, percent, seconds};
use toolkit::run_dir::{TRADE, TRADE_PICTURE};
use toolkit::scene::{Scene, at};
use toolkit::screen::show;
use toolkit::{manifest, provenance};

/// What the command line asks for.
#[derive(Debug, Clone, Args)]
pub struct TradeArguments {
    /// The scene.
    #[command(flatten)]
    pub input: Input,
    /// Wall time of all runs together, as in 90s, 10m or 1h30m. A larger one later goes on
    #[arg(long, value_name = "TIME", default_value = "10m", value_parser = study::duration)]
    pub budget: f64,
    /// Number of all runs together, instead of their time. A larger one later goes on
    #[arg(long, value_name = "N", conflicts_with = "budget", value_parser = clap::value_parser!(u32).range(1..))]
    pub runs: Option<u32>,
    /// Find the limits of stability instead: push each knob until the scene breaks, and write `atlas.md` and `atlas.csv`
    #[arg(long)]
    pub atlas: bool,
    /// Measure to compare, repeatable [default: deflections of all rocks, the largest reaction over 1 ms, the cable
    /// force and what tore, or what the scene has in their place]
    #[arg(long = "measure", value_name = "NAME")]
    pub measures: Vec<String>,
    /// Value to compare a measure with, instead of the finest runs, repeatable
    #[arg(long = "reference", value_name = "NAME=VALUE", value_parser = study::given)]
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

impl TradeArguments {
    /// What the study may cost.
    fn budget(&self) -> Budget {
        self.runs.map_or(Budget::Time(self.budget), Budget::Runs)
    }
}

/// What a study starts from.
struct Setup {
    /// Its knobs.
    space: Space,
    /// Directory of the study.
    out: PathBuf,
    /// Its runs.
    store: Store,
    /// Set in every run: what costs time and is not measured.
    always: Vec<String>,
    /// For the page.
    facts: Facts,
    /// Whether its report is asked for.
    report: bool,
}

impl Setup {
    /// Of a scene. Nothing has run yet where it is refused.
    fn of(arguments: &TradeArguments, events: &Events) -> Result<Self, Stop> {
        let input = &arguments.input;
        let prepared = Prepared::of(input, |_| None, events)?;
        let (resolved, mut own) = start(&prepared)?;
        let Prepared { scene, plan, numbers, .. } = &prepared;
        let end_time = numbers.end_time;
        let fault = |e: std::io::Error| {
            let what = format!("{}: an input file cannot be read: {e}", scene.path().display());
            Stop::input(code::FILE, what)
        };
        let foreign = plan.members.iter().filter(|member| member.foreign).map(|member| &member.program);
        let hash = |program: &PathBuf| (program.display().to_string(), provenance::program(program).ok());
        let identity = Identity {
            scene: scene.fingerprint(),
            inputs: record::hashes(scene, &resolved).map_err(fault)?,
            build: sweep::build().clone(),
            foreign: foreign.map(hash).collect(),
        };
        let out =
            arguments.out.clone().unwrap_or_else(|| Path::new("out").join(format!("{}-trade", scene.name())));
        let bears_presets =
            plan.is_coupled() && !numbers.is_static && plan.members.iter().all(|m| !m.foreign);
        if bears_presets {
            own.knobs.insert(0, Knob::of_presets(PRESETS.iter().map(|preset| preset.name)));
        }
        knobs::turn_only(&mut own.knobs, &arguments.knobs)?;
        let store = Store::open(&out, &identity, arguments.force)?;
        let mut starts = vec![own];
        if bears_presets {
            let knob = starts[0].knobs[0].clone();
            for mut preset in presets(scene, resolved.clone(), &out, events)? {
                preset.knobs.insert(0, knob.clone());
                starts.push(preset);
            }
        }
        let space = Space { starts };
        // Field files cost time and disk, and no measure comes from them.
        let fields = at(&resolved, "output.fields").map(|_| format!("output.fields={}", exact(end_time)));
        let sets = input.sets.iter().fold(String::new(), |all, set| all + " --set " + &shell::join([set]));
        let facts = Facts {
            scene: scene.name(),
            command: shell::join([&input.scene]) + &sets,
            end_time,
            structure: scene.has("structure"),
            budget: arguments.budget(),
            processors: std::thread::available_parallelism().map_or(1, usize::from),
        };
        Ok(Self {
            space,
            out,
            store,
            report: at(&resolved, "output.report").and_then(Value::as_bool) != Some(false),
            always: fields.into_iter().chain(["output.report=false".into()]).collect(),
            facts,
        })
    }
}

/// The values of a prepared scene, with every default, and what of them is chosen by the programs.
fn start(prepared: &Prepared) -> Result<(Table, Start), Stop> {
    let mut resolved = prepared.resolved()?;
    prepared.ground.forget(&mut resolved);
    let numbers = &prepared.numbers;
    let steps = [("dem.time_step", numbers.contact.step), ("fem.time_step", numbers.net.step)];
    let in_use: Vec<_> = steps.iter().filter_map(|(key, step)| Some((*key, (*step)?))).collect();
    let knobs = knobs::of(&Base { resolved: &resolved, in_use: &in_use });
    let text = |value: &Value| match value {
        Value::String(name) => name.clone(),
        Value::Float(number) => exact(*number),
        other => other.to_string(),
    };
    let chosen = prepared.choices().map(|c| (format!("{}.{}", c.key.0, c.key.1), text(&c.value)));
    let mut pinned: Vec<(String, String)> = chosen.collect();
    let document = prepared.scene.document()?;
    // Parts of a window follow from its length and the scheme, where nobody names them.
    let parts = at(&resolved, SAMPLES).map(|parts| (SAMPLES, text(parts)));
    let others = in_use.iter().map(|(key, step)| (*key, exact(*step))).chain(parts);
    for (key, value) in others.filter(|(key, _)| at(&document, key).is_none()) {
        if knobs.iter().any(|knob| knob.keys().contains(&key)) && pinned.iter().all(|(other, _)| other != key)
        {
            pinned.push((key.to_owned(), value));
        }
    }
    Ok((resolved, Start { knobs, pinned }))
}

const SAMPLES: &str = "coupling.samples";

/// The values of each preset for a coupled `scene`, whatever it names itself.
fn presets(scene: &Scene, mut resolved: Table, out: &Path, events: &Events) -> Result<Vec<Start>, Stop> {
    let coupling =
        ["scheme", "time_window", "samples", "yielding_net", "yielding_share", "longest_weak_window"];
    // Over terrain a preset leaves the contact solver's step to that solver.
    let dem: &[&str] = if resolved.contains_key("terrain") { &[] } else { &["time_step"] };
    for (table, keys) in [("coupling", &coupling[..]), ("dem", dem), ("fem", &["time_step"])] {
        if let Some(table) = resolved.get_mut(table).and_then(Value::as_table_mut) {
            keys.iter().for_each(|key| drop(table.remove(*key)));
        }
    }
    let open = out.join("open.toml");
    record::write_scene(&open, scene, &resolved, None).map_err(|e| unwritten("open.toml", &e))?;
    let of = |preset: &Preset| {
        let sets = vec![format!("coupling.preset={}", preset.name)];
        let prepared = Prepared::of(&Input { scene: open.clone(), sets }, |_| None, events)?;
        Ok(start(&prepared)?.1)
    };
    PRESETS.iter().map(of).collect()
}

/// The whole command.
pub fn trade(arguments: &TradeArguments, json: bool) -> Result<Exit, Stop> {
    let events = Events::watch()?;
    let mut setup = Setup::of(arguments, &events)?;
    let store = &mut setup.store;
    let runs = store.load(&setup.space)?;
    let mut study = Study {
        space: setup.space,
        measures: Vec::new(),
        given: arguments.references.iter().cloned().collect(),
        runs,
        reference: Reference::default(),
    };
    let progress = Progress::new(arguments.quiet, json, true);
    if !study.runs.is_empty() {
        progress.say(&format!("{} runs are there already, and count", study.runs.len()));
    }
    let Input { scene, sets: own } = &arguments.input;
    let mut runner = |sets: &[String], dir: &Path, limit: f64| {
        let sets = own.iter().chain(&setup.always).chain(sets).map(String::as_str).collect();
        let run = sweep::Task { scene, sets, dir, shortcuts: true, limit };
        Ok(RunOutcome::of_run(run.run(&events, &mut |_| {})?, limit))
    };
    let budget = arguments.budget();
    let mut work = Explorer { runner: &mut runner, store, progress: &progress, budget };
    let next = if arguments.atlas { plan::next_of_atlas } else { plan::next };
    let ended = work.explore(&mut study, &arguments.measures, next);
    progress.finish();
    let written = match arguments.atlas {
        false => write(&study, &setup.store, &setup.facts),
        true => {
            let mut found = Atlas { study: &study, budget }.all().0;
            let theory = |push| atlas::theory(push, &study.space, &arguments.input, &events);
            found.iter_mut().for_each(|found| found.theory = theory(&found.push));
            write_atlas(&study, &found, &setup.store, &setup.facts)
        }
    };
    match ended {
        Ok(()) => {
            show(&written?);
            if setup.report {
                crate::report::close(&setup.out);
            }
            manifest::seal(&setup.out);
        }
        Err(stop) if stop.exit == Exit::BadInput => return Err(stop),
        Err(stop) => {
            let (runs, out) = (study.runs.len(), setup.out.display());
            return Err(stop.and(&format!("; {runs} runs are kept in {out}; the same command goes on")));
        }
    }
    match (study.reference.0.is_empty(), report::unknown(&study, arguments.budget())) {
        (true, _) => Err(Stop::failed(code::FEW_SAMPLES, no_reference(&study))),
        (false, Some(why)) if !arguments.atlas => Err(Stop::failed(code::FEW_SAMPLES, why)),
        _ => Ok(Exit::Done),
    }
}

/// Runs the scene with these `--set`s into a directory; ends it after so many seconds. An error ends the study.
type Runner<'a> = &'a mut dyn FnMut(&[String], &Path, f64) -> Result<RunOutcome, Stop>;

/// Which run comes next within a budget.
type Next = fn(&Study, Budget) -> Option<NextRun>;

/// What computes, what keeps it, what shows it.
struct Explorer<'a> {
    runner: Runner<'a>,
    store: &'a mut Store,
    progress: &'a Progress,
    budget: Budget,
}

impl Explorer<'_> {
    /// All runs that the plan asks for, each kept.
    fn explore(&mut self, study: &mut Study, asked: &[String], next: Next) -> Result<(), Stop> {
        study.choose_measures(asked)?;
        study.refresh();
        while let Some(NextRun { point, purpose, limit }) = next(study, self.budget) {
            let sets = match purpose {
                Purpose::Atlas => atlas::sets(&study.space, &point),
                _ => study.space.sets(&point),
            };
            let (Some(key), Some(sets)) = (study.space.key(&point), sets) else { break };
            let label = study.space.label(&point);
            let (used, budget) = (self.budget.used_text(study), self.budget);
            self.progress.begin(&format!("{used} of {budget}: {label}"));
            let outcome = (self.runner)(&sets, &self.store.next(), limit)?;
            if study.runs.is_empty() && outcome.status == Status::Refused {
                return Err(Stop { exit: Exit::BadInput, errors: outcome.errors });
            }
            let run = Finished { point, key, purpose, sets, outcome };
            self.store.keep(&run)?;
            study.runs.push(run);
            study.choose_measures(asked)?;
            study.refresh();
            self.ended(study, &label);
        }
        Ok(())
    }

    /// Say what came of the last run.
    fn ended(&self, study: &Study, label: &str) {
        let Some(run) = study.runs.last() else { return };
        let outcome = &run.outcome;
        let what = match (study.error(outcome), outcome.status) {
            // The first run has nothing to be compared with.
            (Some(error), _) if study.reference.uncertainty().is_some() => {
                format!("error {}", percent(error))
            }
            (Some(_), _) | (None, Status::Done) => "done".into(),
            (None, _) => report::why(outcome),
        };
        let purpose = match run.purpose {
            Purpose::Explore => "",
            Purpose::Repeat => " (again, for its time)",
            Purpose::Confirm => " (again, to confirm)",
            Purpose::Atlas => " (pushed)",
        };
        let number = study.runs.len();
        let spent = seconds(study.spent());
        self.progress
            .say(&format!("{number:>4}  {spent:>12}  {label}{purpose}: {what}, {}", seconds(outcome.wall)));
    }
}

/// Page and table of the limits; what the screen shows.
fn write_atlas(
    study: &Study,
    found: &[StabilityLimit],
    store: &Store,
    facts: &Facts,
) -> Result<String, Stop> {
    let page = atlas::page(study, found, facts);
    let path = store.write(TRADE[1], &page)?;
    store.write("atlas.csv", &atlas::table(study, found).map_err(|e| unwritten("atlas.csv", &e))?)?;
    Ok(format!("{}all limits   {}\n", atlas::screen(study, found), path.display()))
}

/// Page, table and picture; what the screen shows.
fn write(study: &Study, store: &Store, facts: &Facts) -> Result<String, Stop> {
    let page = store.write(TRADE[0], &report::page(study, facts))?;
    store.write("trade.csv", &report::table(study, facts).map_err(|e| unwritten("trade.csv", &e))?)?;
    let picture = picture(study, facts);
    if !picture.marks.is_empty() {
        store.write(TRADE_PICTURE, &draw(&picture).map_err(|e| unwritten(TRADE_PICTURE, &e))?)?;
    }
    Ok(format!("{}all runs     {}\n", report::screen(study, facts), page.display()))
}

fn unwritten(file: &str, why: &dyn std::fmt::Display) -> Stop {
    Stop::failed(code::NOT_WRITTEN, format!("{file} cannot be made: {why}"))
}

fn picture(study: &Study, facts: &Facts) -> Scatter {
    let space = &study.space;
    let arms = space.arms();
    let place = |trade: study::Trade| (trade.cost, trade.error);
    let group = |run: &Point| {
        let own = space.arm_of(run);
        arms.iter().position(|arm| *arm == own).unwrap_or(0)
    };
    Scatter {
        title: format!("{}: accuracy against cost", facts.scene),
        error: match study.is_alone() {
            true => "difference from the scene as it is, whose own error is unknown",
            false => "error of the measures, at most",
        },
        date: provenance::now(),
        groups: arms.iter().map(|arm| space.label(arm)).collect(),
        marks: study.trades().into_iter().map(|(point, trade)| (place(trade), group(point))).collect(),
        front: study.front().into_iter().map(|(point, trade)| (place(trade), space.label(point))).collect(),
        lines: &study::ACCURACIES,
    }
}

fn no_reference(study: &Study) -> String {
    let last = study.runs.last().map_or(String::new(), |run| run.outcome.message());
    let tried = study.refinements().len();
    format!(
        "there is nothing to compare with: of {tried} runs, each twice as fine as the one before, the finest is not done; raise \
         --budget or --runs, or give the value with --reference NAME=VALUE. The last run: {last}"
    )
}
